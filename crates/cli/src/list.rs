//! `nonsmooth list`: all of it comes from the registry.

use std::collections::HashSet;
use std::fmt::Write;

use nonsmooth_problem::Kind;
use nonsmooth_solve::registry::{self, About, Prefix, Solves};
use nonsmooth_solve::settings::Setting;
use serde_json::{Value, json};

use crate::kinds::{Class, Offer, offers};
use crate::report::{fields, row};
use crate::{Exit, output};

/// List the solvers and their settings.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Solvers or reformulations to list; all if none is named
    #[arg(value_name = "NAME")]
    names: Vec<String>,
    /// Print one object of JSON
    #[arg(long, conflicts_with = "markdown")]
    json: bool,
    /// Print the page docs/solvers.md
    #[arg(long)]
    markdown: bool,
}

const EXAMPLES: &str = "\
Examples:
  nonsmooth list
  nonsmooth list auto nsgs
  nonsmooth list --markdown > docs/solvers.md

Settings are given to `nonsmooth solve` as `--set key=value`. A reformulation stands before a solver's name:
`--solver condense/nsgs`. Citations are keys of docs/refs.bib.";

/// What is said of a solver whose answers are those of another problem.
const RELAXATION: &str = "a relaxation; its answers are judged by Coulomb's law all the same";

/// A solver and the kinds of problem that it takes, all of one class.
struct Listed {
    about: &'static About,
    kinds: Vec<Kind>,
}

impl Listed {
    fn class(&self) -> Class {
        Class::of(self.kinds[0])
    }

    /// The name, unlike that of any other solver: of contact problems the plain one.
    fn heading(&self) -> String {
        match self.class() {
            Class::Contact => self.about.name.into(),
            class => format!("{} ({})", self.about.name, class.name()),
        }
    }

    /// The anchor that a heading has in rendered Markdown.
    fn anchor(&self) -> String {
        match self.class() {
            Class::Contact => self.about.name.into(),
            class => format!("{}-{}", self.about.name, class.name()),
        }
    }
}

/// Everything that the registry has.
struct Catalogue {
    solvers: Vec<Listed>,
    prefixes: Vec<&'static Prefix>,
    composed: Vec<String>,
}

impl Catalogue {
    fn new() -> Self {
        let mut all = Self { solvers: vec![], prefixes: vec![], composed: vec![] };
        for Offer { kind, solvers, prefixes, composed } in offers() {
            for about in solvers {
                let same =
                    |s: &&mut Listed| s.about.name == about.name && s.class() == Class::of(kind);
                match all.solvers.iter_mut().find(same) {
                    Some(listed) => listed.kinds.push(kind),
                    None => all.solvers.push(Listed { about, kinds: vec![kind] }),
                }
            }
            for prefix in prefixes {
                if all.prefixes.iter().all(|known| known.name != prefix.name) {
                    all.prefixes.push(prefix);
                }
            }
            for name in composed {
                if !all.composed.contains(&name) {
                    all.composed.push(name);
                }
            }
        }
        all
    }

    /// The classes that have solvers here, each with them.
    fn by_class(&self) -> impl Iterator<Item = (Class, Vec<&Listed>)> {
        let of = |class| self.solvers.iter().filter(|s| s.class() == class).collect::<Vec<_>>();
        let all = Class::ALL.into_iter().map(move |class| (class, of(class)));
        all.filter(|(_, solvers)| !solvers.is_empty())
    }

    /// Only what is named.
    fn only(mut self, names: &[String]) -> Result<Self, String> {
        let known = |name: &str| {
            self.solvers.iter().any(|s| s.about.name == name)
                || self.prefixes.iter().any(|p| p.name == name)
        };
        if let Some(unknown) = names.iter().find(|name| !known(name)) {
            let all = self.solvers.iter().map(|s| s.about.name);
            let mut all: Vec<_> = all.chain(self.prefixes.iter().map(|p| p.name)).collect();
            let mut seen = HashSet::new();
            all.retain(|name| seen.insert(*name));
            let all = all.join(", ");
            return Err(format!("expected a name among {all}, found `{unknown}`"));
        }
        if !names.is_empty() {
            let named = |name: &str| names.iter().any(|n| n == name);
            self.solvers.retain(|s| named(s.about.name));
            self.prefixes.retain(|p| named(p.name));
            self.composed.clear();
        }
        Ok(self)
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Result<Exit, String> {
    let catalogue = Catalogue::new().only(&args.names)?;
    output::print(&if args.json {
        format!("{}\n", json(&catalogue))
    } else if args.markdown {
        markdown(&catalogue)
    } else {
        text(&catalogue)
    });
    Ok(Exit::Solved)
}

fn json(catalogue: &Catalogue) -> Value {
    let solvers = catalogue.solvers.iter().map(|listed| {
        let mut solver = fields(json!(listed.about));
        solver.insert("class".into(), json!(listed.class().name()));
        solver.insert("kinds".into(), json!(listed.kinds));
        solver.insert("solves".into(), json!(listed.about.solves));
        solver
    });
    json!({
        "default": registry::DEFAULT,
        "solvers": solvers.collect::<Vec<_>>(),
        "reformulations": catalogue.prefixes,
        "composed": catalogue.composed,
    })
}

fn text(catalogue: &Catalogue) -> String {
    let mut text = String::new();
    let both = catalogue.by_class().count() > 1;
    for (class, solvers) in catalogue.by_class() {
        if both {
            let _ = writeln!(text, "# {}\n", class.title());
        }
        for Listed { about, kinds } in solvers {
            let default = if about.name == registry::DEFAULT { " (the default)" } else { "" };
            let _ = writeln!(text, "{}{default}: {}", about.name, about.summary);
            row(&mut text, "family", about.family);
            row(&mut text, "kinds", names(kinds));
            if about.solves == Solves::Relaxation {
                row(&mut text, "solves", RELAXATION);
            }
            if !about.needs.is_empty() {
                row(&mut text, "needs", about.needs.join(", "));
            }
            row(&mut text, "see", about.cites.join(", "));
            settings_text(&mut text, (about.settings)());
            text.push('\n');
        }
    }
    if both && !catalogue.prefixes.is_empty() {
        text.push_str("# Reformulations\n\n");
    }
    for prefix in &catalogue.prefixes {
        let _ = writeln!(text, "{}/SOLVER: {}", prefix.name, prefix.summary);
        row(&mut text, "kinds", names(prefix.from));
        row(&mut text, "see", prefix.cites.join(", "));
        settings_text(&mut text, (prefix.settings)());
        text.push('\n');
    }
    if !catalogue.composed.is_empty() {
        let _ = writeln!(text, "Composed: {}", catalogue.composed.join(", "));
    }
    text
}

fn settings_text(text: &mut String, settings: Vec<Setting>) {
    for setting in settings {
        let default = default_of(&setting);
        row(text, "--set", format!("{}={default}", setting.key));
        row(text, "", format!("    {}", setting.help));
        if !setting.choices.is_empty() {
            let choices = setting.choices.join(", ");
            row(text, "", format!("    One of {choices}."));
        }
    }
}

fn settings_table(page: &mut String, settings: Vec<Setting>) {
    if settings.is_empty() {
        return;
    }
    page.push_str("\n| setting | default | meaning |\n| --- | --- | --- |\n");
    for setting in settings {
        let (key, default) = (&setting.key, default_of(&setting));
        let choices: Vec<_> = setting.choices.iter().map(|c| format!("`{c}`")).collect();
        let choices = match choices.join(", ") {
            none if none.is_empty() => none,
            all => format!(" One of {all}."),
        };
        let help = cell(&setting.help);
        let _ = writeln!(page, "| `{key}` | `{default}` | {help}{choices} |");
    }
}

fn markdown(catalogue: &Catalogue) -> String {
    let mut page = String::from(
        "<!-- Generated by `nonsmooth list --markdown` from the registry; edit the solvers' own documentation. -->\n\n\
         # Solvers\n\n\
         `nonsmooth solve FILE --solver NAME --set key=value` takes these names and settings, and so does\n\
         `registry::session`. Citations are keys of [refs.bib](refs.bib).\n",
    );
    for (class, solvers) in catalogue.by_class() {
        let title = class.title();
        let _ =
            write!(page, "\n## {title}\n\n| solver | family | what it is |\n| --- | --- | --- |\n");
        for listed in &solvers {
            let about = listed.about;
            let default = if about.name == registry::DEFAULT { "; the default" } else { "" };
            let (name, family, summary) = (about.name, about.family, cell(about.summary));
            let anchor = listed.anchor();
            let _ = writeln!(page, "| [`{name}`](#{anchor}) | {family} | {summary}{default} |");
        }
        for listed in solvers {
            let Listed { about, kinds } = listed;
            let (heading, summary) = (listed.heading(), sentence(about.summary));
            let _ = write!(page, "\n### {heading}\n\n{summary}.\n\n");
            let _ = writeln!(page, "- Family: {}", about.family);
            let _ = writeln!(page, "- Kinds of problem: {}", names(kinds));
            if about.solves == Solves::Relaxation {
                let _ = writeln!(page, "- Solves: {RELAXATION}");
            }
            if !about.needs.is_empty() {
                let _ = writeln!(page, "- Needs: {}", about.needs.join(", "));
            }
            let _ = writeln!(page, "- References: {}", about.cites.join(", "));
            settings_table(&mut page, (about.settings)());
        }
    }
    page.push_str(
        "\n## Reformulations\n\n\
         A reformulation stands before a solver's name, as in `condense/nsgs`: the problem is reformulated, solved\n\
         as what it has become, and the point is led back. The settings are the solver's, and those that the reformulation adds.\n\n\
         | reformulation | takes | what it does | references |\n| --- | --- | --- | --- |\n",
    );
    for prefix in &catalogue.prefixes {
        let (name, kinds, summary) = (prefix.name, names(prefix.from), cell(prefix.summary));
        let cites = prefix.cites.join(", ");
        let _ = writeln!(page, "| `{name}/` | {kinds} | {summary} | {cites} |");
    }
    for prefix in &catalogue.prefixes {
        let settings = (prefix.settings)();
        if !settings.is_empty() {
            let _ = writeln!(page, "\nSettings that `{}/` adds:", prefix.name);
            settings_table(&mut page, settings);
        }
    }
    if !catalogue.composed.is_empty() {
        let names: Vec<_> = catalogue.composed.iter().map(|n| format!("`{n}`")).collect();
        let _ = write!(
            page,
            "\nComposed names, among others (a prefix takes any method of the problem that it leads to): {}.\n",
            names.join(", ")
        );
    }
    page
}

fn names(kinds: &[Kind]) -> String {
    kinds.iter().map(|k| k.name()).collect::<Vec<_>>().join(", ")
}

/// The default as it would be typed.
fn default_of(setting: &Setting) -> String {
    match &setting.default {
        Value::String(word) => word.clone(),
        other => other.to_string(),
    }
}

/// Text that may stand in a cell of a table.
fn cell(text: &str) -> String {
    text.replace('|', "\\|")
}

fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map(|c| c.to_uppercase().to_string());
    first.unwrap_or_default() + letters.as_str()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_solver_setting_and_composition_is_on_the_page() {
        let catalogue = Catalogue::new();
        let page = markdown(&catalogue);
        assert!(page.starts_with("<!-- Generated by `nonsmooth list --markdown`"));
        assert!(page.ends_with(".\n") && !page.contains("\n\n\n"));
        let mut headings = HashSet::new();
        for listed in &catalogue.solvers {
            let heading = format!("\n### {}\n", listed.heading());
            assert_eq!(page.matches(&heading).count(), 1, "{heading}");
            assert!(
                page.contains(&format!("](#{})", listed.anchor()))
                    && headings.insert(listed.anchor())
            );
            for setting in (listed.about.settings)() {
                assert!(page.contains(&format!("| `{}` | `", setting.key)), "{setting:?}");
            }
        }
        assert!(page.contains("`condense/nsgs`"));
        assert_eq!(page, markdown(&Catalogue::new()));
    }

    #[test]
    fn rows_of_a_table_have_as_many_cells_as_its_head() {
        let page = markdown(&Catalogue::new());
        let mut width = 0;
        for line in page.lines() {
            let cells = line.replace("\\|", "").matches('|').count();
            if width > 0 && cells > 0 {
                assert_eq!(cells, width, "{line}");
            }
            width = cells;
        }
    }

    #[test]
    fn the_text_names_defaults_and_choices() {
        let only = [registry::DEFAULT.to_owned(), "nsgs".to_owned()];
        let text = text(&Catalogue::new().only(&only).unwrap());
        assert!(text.starts_with("# Frictional contact\n\nauto (the default): "), "{text}");
        assert!(text.contains("\nnsgs: ") && text.contains("# Complementarity\n\nauto "));
        assert!(text.contains("local=exact") && text.contains("One of exact, quartic"));
        assert!(!text.contains("extragradient"));
        assert!(Catalogue::new().only(&["magic".to_owned()]).is_err());
    }
}

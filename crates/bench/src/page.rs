//! The page of a comparison: what a campaign shows, in sentences, tables and figures made from its runs alone.
//!
//! Nothing on the page is written by hand, so that a new campaign makes a new page that is true.

use std::collections::BTreeSet;

use crate::figures::{self, Figure};
use crate::plural;
use crate::profile::{Cost, Selection, VIRTUAL_BEST};
use crate::record::Campaign;
use crate::runs::Runs;
use crate::tables::{By, Row, Table, competitive, markdown_text, summary, summary_page, unsolved};
use crate::traits_table;

/// A page and its figures.
#[derive(Debug, Clone, PartialEq)]
pub struct Page {
    /// The page, in Markdown.
    pub markdown: String,
    /// The figures that it shows, each with a name of its own.
    pub figures: Vec<Figure>,
}

/// Makes the page. Figures are referred to as `folder/NAME.svg`; `command` is what makes the page again; `beside`: whether the [`DOCUMENTS`] stand beside it, and
/// links lead to them.
///
/// Errors: a figure that cannot be drawn.
pub fn page(
    runs: &Runs,
    traits: Option<&traits_table::Table>,
    folder: &str,
    command: &str,
    beside: bool,
) -> Result<Page, String> {
    let kinds = runs.kinds();
    let mut short = String::from("\n## In short\n\n");
    let (mut body, mut shown) = (String::new(), vec![]);
    for (kind, problems) in &kinds {
        let heading = heading(kind);
        body += &format!("\n## {heading}\n\n{}.\n", plural(*problems, "problem"));
        let at = |tolerance| Selection::at(kind, tolerance);
        let mut show = |figure: Option<Figure>, name: &str| {
            figure.map_or_else(String::new, |f| show(f, kind, name, folder, &mut shown))
        };
        let tolerances = runs.tolerances_of(kind);
        for &tolerance in &tolerances {
            let selection = at(tolerance);
            let rows = summary(runs, &selection, By::All);
            short += &format!("- {heading}, to {tolerance:e}: ");
            let Some(best) = taken(&rows) else {
                short += "every solver refuses them.\n";
                continue;
            };
            short += &findings(best, &rows);
            body += &format!("\n### To {tolerance:e}\n\n{}", summary_page(&rows).markdown());
            let profile = figures::profile(runs, &selection, Cost::Seconds)?;
            let reached = format!("{tolerance:e}").replace('.', "p");
            body += &show(profile, &format!("profile-seconds-{reached}"));
            body += COMPETITIVE;
            body += &competitive(runs, &selection).markdown();
            body += &winners(runs, &selection);
            body += &nobody(runs, &selection);
        }
        if let Some(tightest) = tolerances.last()
            && let Some(figure) = figures::success(runs, &at(*tightest))?
        {
            body += "\n### Success against tolerance\n";
            body += &show(Some(figure), "success");
        }
    }
    if let Some(traits) = traits {
        body += TRAITS;
        body += &traits.markdown();
    }
    let introduction = introduction(runs, &kinds, command, beside);
    Ok(Page { markdown: introduction + &short + &body, figures: shown })
}

/// The documents that the page refers to, without `.md`.
pub const DOCUMENTS: [&str; 2] = ["benchmarking", "notation"];

const COMPETITIVE: &str = "
Solved within 4/3 and within twice the least time T_min, *very competitive* and *competitive* (BillupsDirkseFerris1997):

";

const TRAITS: &str = "
## The families

Each family beside those published for FCLIB that it is like (AcaryBremondHuber2018): n degrees of freedom, nc contacts, contact density
c = 3 nc / n, rows of W over its rank, condition number of W over the singular values that are not rounding. Sizes are those of this
suite; `nonsmooth gen --list` says what can be set.

";

fn heading(kind: &str) -> String {
    match kind {
        "friction_local_2d" => "Local problems in the plane, u = W r + q".into(),
        "friction_local_3d" => "Local problems, u = W r + q".into(),
        "friction_global_2d" => "Global problems in the plane, M v = H r + f".into(),
        "friction_global_3d" => "Global problems, M v = H r + f".into(),
        "rolling_friction_local_3d" => "Local problems with rolling friction".into(),
        "rolling_friction_global_3d" => "Global problems with rolling friction".into(),
        "" => "Problems of unknown kind".into(),
        other => format!("Problems of kind {}", markdown_text(other)),
    }
}

fn introduction(runs: &Runs, kinds: &[(&str, usize)], command: &str, beside: bool) -> String {
    let families: BTreeSet<_> = runs.runs.iter().map(|r| &r.family).collect();
    let problems: usize = kinds.iter().map(|k| k.1).sum();
    let solvers = runs.solvers();
    let command = markdown_text(command);
    let comment = command.replace("--", "\u{2010}\u{2010}");
    let mut text = format!(
        "# The solvers compared\n\n<!-- Made by `{comment}`; changes by hand are lost. -->\n\n{} of {}, {}, {}. \
         Made by `{command}`, from the problems to this page.\n",
        plural(problems, "problem"),
        if families.len() == 1 {
            "1 family".into()
        } else {
            format!("{} families", families.len())
        },
        plural(solvers.len(), "solver"),
        plural(runs.runs.len(), "run"),
    );
    for campaign in &runs.campaigns {
        text += &format!("\n- {}", markdown_text(&measured(campaign)));
    }
    let [benchmarking, notation] = DOCUMENTS.map(|name| match beside {
        true => format!("[{name}]({name}.md)"),
        false => format!("docs/{name}.md of nonsmooth"),
    });
    text += &format!(
        "\n\nWhat a run is and how it is timed: {benchmarking}. *Solved* is the judge's word on the relative residual \
             ({notation}), or on a proof that there is no solution. Problems that a solver *refuses* do not count in its shares. *Fastest* is the share of problems on which the solver needs the least time, and the *ratios* are its \
             time over that least time where it solves the problem; *seconds* are all its runs, failed ones included. The *virtual best* takes on each problem the \
             fastest solver. A profile shows the distance from the best; with more than two solvers it does not rank them (GouldScott2016).\n"
    );
    text
}

fn measured(campaign: &Campaign) -> String {
    let machine = &campaign.machine;
    let mut text = format!("{}, on {}", campaign.program, machine.cpu);
    if machine.cores > 0 {
        let gib = machine.memory as f64 / f64::from(1 << 30);
        text += &format!(" ({}, {gib:.0} GiB, {})", plural(machine.cores, "core"), machine.os);
    }
    if campaign.foreign {
        text += "; a foreign measurement, by its own error";
    }
    if let Some(plan) = &campaign.plan {
        text += &format!(
            "; at most {} s a solve, {} at a time, {}",
            plan.time_limit,
            plan.jobs,
            match plan.repeats {
                0 => "one solve of a run".into(),
                n => format!("{} of a run after one to warm up", plural(n as usize, "timed solve")),
            }
        );
    }
    text
}

/// The row of the virtual best, unless every solver refuses every problem.
fn taken(rows: &[Row]) -> Option<&Row> {
    rows.iter().find(|r| r.solver == VIRTUAL_BEST && r.taken() > 0)
}

/// What the rows of all problems say, in sentences; problems that every solver refuses do not count.
fn findings(best: &Row, rows: &[Row]) -> String {
    let (most, who) = leaders(rows, |r| r.solved);
    let (fastest, fast) = leaders(rows, |r| r.fastest);
    let (who, fast) = (listed(&who), listed(&fast));
    if most == 0 {
        return format!("no solver solves any of the {}.\n", plural(best.taken(), "problem"));
    }
    let are = |n: usize, what: &str| match n {
        1 => format!("one is {what}"),
        n => format!("{n} are {what}"),
    };
    let mut left = match best.taken() - best.solved {
        0 => "every problem is solved by at least one solver".into(),
        n => are(n, "solved by none"),
    };
    if best.refused > 0 {
        left += &format!("; beside them {}", are(best.refused, "refused by all"));
    }
    let mut text =
        format!("most problems are solved by {who}, {most} of {}; {left}.", best.taken());
    // Solved runs need not have a time.
    if fastest > 0 {
        text += &format!(" Most often the fastest is {fast}, on {fastest}.");
    }
    text + "\n"
}

/// The most that a solver has of something, and the labels of those that have it.
fn leaders(rows: &[Row], value: fn(&Row) -> usize) -> (usize, Vec<String>) {
    let solvers = || rows.iter().filter(|r| r.solver != VIRTUAL_BEST);
    let most = solvers().map(value).max().unwrap_or(0);
    (most, solvers().filter(|r| value(r) == most).map(|r| code(&r.solver)).collect())
}

/// A label as Markdown's code.
fn code(label: &str) -> String {
    format!("`{}`", markdown_text(label).replace('`', "'"))
}

/// The name of a folder within an address: blanks and brackets would end it.
fn address(folder: &str) -> String {
    let safe = |c: char| c.is_alphanumeric() || "-_.~".contains(c);
    let part = |c: char| match safe(c) {
        true => c.to_string(),
        false => c.to_string().bytes().map(|b| format!("%{b:02X}")).collect(),
    };
    folder.chars().map(part).collect()
}

/// `a`, `a and b`, `a, b and c`.
fn listed(all: &[String]) -> String {
    match all {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// A name for the files of a kind. Other programs' kinds may hold anything, and names must stay in the folder.
pub fn slug(kind: &str) -> String {
    let letter = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' };
    let kind: String = match kind.strip_prefix("friction_").unwrap_or(kind) {
        "" => "unknown".into(),
        kind => kind.chars().map(letter).collect(),
    };
    kind.trim_matches('-').into()
}

/// A name, and the next ones where it is taken: `a`, `a-2`, `a-3`, …
pub fn names(name: String) -> impl Iterator<Item = String> {
    std::iter::once(name.clone()).chain((2..).map(move |k| format!("{name}-{k}")))
}

/// Keeps a figure, under a name of its own, and says where the page shows it.
fn show(figure: Figure, kind: &str, name: &str, folder: &str, all: &mut Vec<Figure>) -> String {
    let name = format!("{}-{name}", slug(kind));
    let free = |name: &String| all.iter().all(|f| f.name != *name);
    let name = names(name).find(free).unwrap_or_default();
    let text = format!("\n![{}]({}/{name}.svg)\n", figure.title, address(folder));
    all.push(Figure { name, ..figure });
    text
}

/// Who wins where: family by family.
fn winners(runs: &Runs, selection: &Selection) -> String {
    let rows = summary(runs, selection, By::Family);
    let mut table = Table {
        head: ["family", "problems", "solved by any", "most solved by", "most often the fastest"]
            .map(String::from)
            .into(),
        rows: vec![],
    };
    for family in rows.chunk_by(|a, b| a.group == b.group) {
        let Some(any) = taken(family) else { continue };
        let solvers = family.len() - 1;
        let leaders = |value| match leaders(family, value) {
            (0, _) => "nobody".into(),
            (n, names) if names.len() == solvers && solvers > 1 => format!("all ({n})"),
            (n, names) => format!("{} ({n})", listed(&names)),
        };
        table.rows.push(vec![
            any.group.clone(),
            any.taken().to_string(),
            any.solved.to_string(),
            leaders(|r| r.solved),
            leaders(|r| r.fastest),
        ]);
    }
    format!("\nWho wins where:\n\n{}", table.markdown())
}

/// What nobody solves.
fn nobody(runs: &Runs, selection: &Selection) -> String {
    let all = unsolved(runs, selection);
    if all.is_empty() {
        return String::new();
    }
    let rows = all.iter().map(|u| {
        let closest = u.closest.as_ref().map_or_else(String::new, |(solver, reached)| {
            format!("{} reaches {reached:.1e}", code(solver))
        });
        vec![u.problem.clone(), u.contacts.to_string(), closest]
    });
    let head = ["unsolved", selection.counted(), "closest"].map(String::from).into();
    format!("\n{}", Table { head, rows: rows.collect() }.markdown())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::{Ending, FORMAT, Machine, Residuals, Run, VERSION};

    fn run(problem: &str, kind: &str, solver: &str, ending: Ending, seconds: f64) -> Run {
        Run {
            campaign: "c".into(),
            problem: problem.into(),
            family: problem.split('/').next().unwrap_or_default().into(),
            kind: kind.into(),
            contacts: 20,
            solver: solver.into(),
            tolerance: 1e-8,
            ending,
            seconds: Some(seconds),
            iterations: Some(7),
            residuals: Residuals {
                reached: Some(if ending == Ending::Solved { 9e-9 } else { 2e-5 }),
                ..Residuals::default()
            },
            ..Run::default()
        }
    }

    fn example() -> Runs {
        let (local, global) = ("friction_local_3d", "friction_global_3d");
        let campaign = Campaign {
            format: FORMAT.into(),
            version: VERSION,
            id: "c".into(),
            program: "nonsmooth 9".into(),
            foreign: false,
            started: None,
            machine: Machine { cpu: "a processor".into(), ..Machine::default() },
            plan: None,
        };
        use Ending::{Refused, Solved, TimeLimit};
        let runs = vec![
            run("wall/a", local, "quick", Solved, 1.0),
            run("wall/a", local, "sure", Solved, 2.0),
            run("arch/b", local, "quick", TimeLimit, 10.0),
            run("arch/b", local, "sure", Solved, 3.0),
            run("arch/c", local, "quick", TimeLimit, 10.0),
            run("arch/c", local, "sure", TimeLimit, 10.0),
            run("arch/c", local, "condense/quick", Refused, 0.0),
            run("pile/d", global, "condense/quick", Solved, 0.5),
            run("pile/d", global, "quick", Solved, 0.6),
        ];
        Runs { campaigns: vec![campaign], runs, ..Runs::default() }
    }

    #[test]
    fn what_other_programs_write_stays_text_and_in_the_folder() {
        use Ending::Solved;
        let kinds = ["../../evil", "friction_local_3d", "local-3d", "a\n# b", ""];
        let all = (0..).zip(kinds);
        let runs = all.map(|(k, kind)| run(&format!("f/{k}"), kind, "a`<b>|", Solved, 1.0));
        let mut all = Runs { runs: runs.collect(), ..example() };
        all.campaigns[0].program = "<img src=x>\n# P".into();
        let page = page(&all, None, "my (page)", "make --> <b>", false).unwrap();
        let names: BTreeSet<_> = page.figures.iter().map(|f| &f.name).collect();
        assert_eq!((names.len(), page.figures.len()), (10, 10), "{names:?}");
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '-';
        assert!(names.iter().all(|n| !n.starts_with('-') && n.chars().all(plain)), "{names:?}");
        for name in names {
            let shown = format!("](my%20%28page%29/{name}.svg)");
            assert!(page.markdown.contains(&shown), "{shown}\n{}", page.markdown);
        }
        // The one element and the one comment on the page are its own.
        assert_eq!(page.markdown.matches('<').count(), 1, "{}", page.markdown);
        assert_eq!(page.markdown.matches("-->").count(), 2, "{}", page.markdown);
        assert!(!page.markdown.contains("\n# P") && !page.markdown.contains("\n# b"));
        assert!(page.markdown.contains("most problems are solved by `a'&lt;b>|`, 1 of 1"));
    }

    #[test]
    fn the_page_says_who_solves_most_who_is_fastest_and_what_nobody_solves() {
        let page = page(&example(), None, "figures", "make it", true).unwrap();
        let has = |text: &str| assert!(page.markdown.contains(text), "{text}\n{}", page.markdown);
        has("4 problems of 3 families, 3 solvers, 9 runs. Made by `make it`");
        has("- nonsmooth 9, on a processor");
        has("## Local problems, u = W r + q\n\n3 problems.");
        has(
            "- Local problems, u = W r + q, to 1e-8: most problems are solved by `sure`, 2 of 3; one is solved by none. Most often the fastest is `quick` and `sure`, on 1.",
        );
        has("| arch | 2 | 1 | `sure` (1) | `sure` (1) |");
        has("| quick | 3 | 1 | 1 | 1 |\n| sure | 3 | 2 | 1 | 2 |");
        has("| wall | 1 | 1 | all (1) | `quick` (1) |");
        has("| arch/c | 20 | `quick` reaches 2.0e-5 |");
        has("## Global problems, M v = H r + f\n\n1 problem.");
        has(
            "1 of 1; every problem is solved by at least one solver. Most often the fastest is `condense/quick`, on 1.",
        );
        // A solver that refuses a kind has no row in its table.
        let local = page.markdown.split("\n## ").find(|part| part.starts_with("Local")).unwrap();
        assert!(!local.contains("condense"), "{local}");
        for figure in &page.figures {
            has(&format!("(figures/{}.svg)", figure.name));
            assert!(figure.svg.starts_with("<svg"));
        }
        let names: BTreeSet<_> = page.figures.iter().map(|f| &f.name).collect();
        assert_eq!((names.len(), page.figures.len()), (4, 4));
    }

    /// Two kinds at a tolerance of their own each, one without figure of success, and one that no solver takes.
    #[test]
    fn kinds_have_tolerances_of_their_own_and_no_empty_sections() {
        use Ending::{Refused, Solved, Stalled};
        let at = |tolerance, run| Run { tolerance, ..run };
        let untold = |run| Run { residuals: Residuals::default(), seconds: None, ..run };
        let runs = vec![
            at(1e-4, run("f/a", "lcp", "A", Solved, 1.0)),
            at(1e-4, run("f/b", "lcp", "A", Refused, 1.0)),
            at(1e-4, run("f/c", "lcp", "A", Stalled, 1.0)),
            at(1e-4, run("e/d", "lcp", "A", Refused, 1.0)),
            untold(run("g/a", "mcp", "A", Solved, 1.0)),
            run("h/a", "vi", "A", Refused, 1.0),
            run("h/a", "vi", "B", Refused, 1.0),
        ];
        let page = page(&Runs { runs, ..example() }, None, "figures", "make it", true).unwrap();
        let (begin, body) = page.markdown.split_once("\n## Problems").unwrap();
        let (_, short) = begin.split_once("## In short\n\n").unwrap();
        assert_eq!(
            short,
            "- Problems of kind lcp, to 1e-4: most problems are solved by `A`, 1 of 2; one is solved by none; beside them 2 are refused by all. Most often the fastest is `A`, on 1.\n\
             - Problems of kind mcp, to 1e-8: most problems are solved by `A`, 1 of 1; every problem is solved by at least one solver.\n\
             - Problems of kind vi, to 1e-8: every solver refuses them.\n"
        );
        let body = body.split("\n## Problems").collect::<Vec<_>>();
        let headings = |part: &str| {
            let lines = part.lines().filter_map(|l| l.strip_prefix("### "));
            lines.map(String::from).collect::<Vec<_>>()
        };
        assert_eq!(headings(body[0]), ["To 1e-4", "Success against tolerance"], "{}", body[0]);
        assert_eq!(headings(body[1]), ["To 1e-8"], "{}", body[1]);
        assert_eq!(body[2].trim_end(), " of kind vi\n\n1 problem.");
        // What all refuse is no problem of the tables that count.
        assert!(body[0].contains("| f | 2 | 1 | `A` (1) | `A` (1) |\n\n| unsolved"), "{}", body[0]);
        assert!(!body[0].contains("f/b") && !body[0].contains("| e |"), "{}", body[0]);
        assert!(body[0].contains("| A | 2 | 1 | 1 | 1 |"), "{}", body[0]);
        assert!(body[1].contains("| A | 1 | 1 | 0 | 0 |"), "{}", body[1]);
    }

    #[test]
    fn what_is_not_beside_the_page_is_named_without_a_link() {
        let page = |beside| super::page(&example(), None, "figures", "make it", beside).unwrap();
        for name in DOCUMENTS {
            let (link, text) =
                (format!("[{name}]({name}.md)"), format!("docs/{name}.md of nonsmooth"));
            let [with, without] = [true, false].map(|beside| page(beside).markdown);
            assert!(with.contains(&link) && !with.contains(&text), "{with}");
            assert!(without.contains(&text) && !without.contains(".md)"), "{without}");
        }
    }
}

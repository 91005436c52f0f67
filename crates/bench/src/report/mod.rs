//! A report: one HTML file that holds the runs and draws them, for a browser without a network.
//!
//! All its numbers are those of [`profile`](crate::profile) and [`tables`], counted once for each view: a kind
//! of problem, a tolerance, and all problems, a family or a class of size. The script chooses a view, draws it, and hides the
//! solvers that are not asked for; the best is that of all solvers of the kind, whatever is hidden.
//!
//! Texts from the runs reach the page as text nodes only, and a content security policy forbids every request.

mod data;
mod views;

use std::collections::HashSet;
use std::fmt::Write;

use crate::plural;
use crate::profile::Selection;
use crate::record::{Campaign, Plan};
use crate::runs::Runs;
use crate::tables::{self, By, Row};

const PAGE: &str = include_str!("report.html");
const STYLE: &str = include_str!("report.css");
const SCRIPTS: [&str; 3] =
    [include_str!("view.js"), include_str!("drawing.js"), include_str!("page.js")];

/// What the page says besides the runs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Options {
    /// The heading.
    pub title: String,
}

impl Default for Options {
    fn default() -> Self {
        Self { title: "Solvers compared".into() }
    }
}

/// The page.
pub fn html(runs: &Runs, options: &Options) -> String {
    let data = serde_json::to_string(&data::Data::of(runs))
        .expect("columns of numbers and texts are JSON");
    let mut page = String::with_capacity(data.len() + 100_000);
    // Only the page itself is searched for places: what is put in may hold anything.
    let mut rest = PAGE;
    while let Some((before, after)) = rest.split_once("{{") {
        let (place, after) = after.split_once("}}").expect("a place of the page is closed");
        page += before;
        match place {
            "title" => page += &escaped(&options.title),
            "generator" => page += concat!("nonsmooth ", env!("CARGO_PKG_VERSION")),
            "style" => page += STYLE,
            "counts" => counts(&mut page, runs),
            "measured" => measured(&mut page, runs),
            "summary" => summary(&mut page, runs),
            // In JSON `<` stands in texts only; without it nothing can end the element.
            "data" => page += &data.replace('<', "\\u003c"),
            "script" => SCRIPTS.iter().for_each(|s| page += s),
            _ => unreachable!("a place of the page that nothing fills: {place}"),
        }
        rest = after;
    }
    page + rest
}

/// A text as HTML, in elements and in quoted attributes.
fn escaped(text: &str) -> String {
    text.chars().fold(String::with_capacity(text.len()), |mut all, c| {
        match c {
            '&' => all += "&amp;",
            '<' => all += "&lt;",
            '>' => all += "&gt;",
            '"' => all += "&quot;",
            '\'' => all += "&#39;",
            c if c.is_control() && c != '\n' && c != '\t' => all.push('\u{fffd}'),
            c => all.push(c),
        }
        all
    })
}

// ------------------------------------------------------------------------------------------------ what was measured

/// What was measured.
fn counts(page: &mut String, all: &Runs) {
    let with_runs: HashSet<&str> = all.runs.iter().map(|r| r.problem.as_str()).collect();
    let tolerances: Vec<String> = all.tolerances().iter().map(|t| format!("{t:e}")).collect();
    let waiting = all
        .problems
        .values()
        .filter(|p| p.error.is_none() && !with_runs.contains(p.name.as_str()))
        .count();
    let mut text = format!(
        "{}, {}, {}",
        plural(with_runs.len(), "problem"),
        plural(all.solvers().len(), "solver"),
        plural(all.runs.len(), "run"),
    );
    match tolerances.as_slice() {
        [] => {}
        [one] => text += &format!(" at the tolerance {one}"),
        several => text += &format!(" at the tolerances {}", several.join(", ")),
    }
    text.push('.');
    if waiting > 0 {
        text += &format!(" {} more without a run.", plural(waiting, "problem"));
    }
    if all.torn {
        text += " The last line of the runs was torn and is left out: their measurement was broken off.";
    }
    let _ = writeln!(page, "<p>{}</p>", escaped(&text));
}

/// By what it was measured, where and how.
fn measured(page: &mut String, all: &Runs) {
    for (campaign, parts) in groups(all) {
        let class = if campaign.foreign { " class=\"foreign\"" } else { "" };
        let _ = writeln!(page, "<p{class}>{}</p>", escaped(&conditions(campaign, parts)));
    }
    let by = concat!("Report by nonsmooth ", env!("CARGO_PKG_VERSION"), ".");
    let _ = writeln!(page, "<p class=\"small\">{by}</p>");
}

/// The campaigns that have runs; those that differ in their part and start alone are one, with the number of them.
fn groups(all: &Runs) -> Vec<(&Campaign, usize)> {
    let used: HashSet<&str> = all.runs.iter().map(|r| r.campaign.as_str()).collect();
    let whole = |plan: &Option<Plan>| plan.clone().map(|p| Plan { shard: None, ..p });
    let mut groups: Vec<(&Campaign, usize)> = Vec::new();
    for campaign in all.campaigns.iter().filter(|c| used.contains(c.id.as_str())) {
        let same = |c: &Campaign| {
            (&c.program, c.foreign, &c.machine)
                == (&campaign.program, campaign.foreign, &campaign.machine)
                && whole(&c.plan) == whole(&campaign.plan)
        };
        match groups.iter_mut().find(|(c, _)| same(c)) {
            Some((_, parts)) => *parts += 1,
            None => groups.push((campaign, 1)),
        }
    }
    groups
}

fn conditions(campaign: &Campaign, parts: usize) -> String {
    let mut text = match campaign.foreign {
        true => format!("† Foreign measurements: {}", campaign.program),
        false => format!("Measured: {}", campaign.program),
    };
    let machine = &campaign.machine;
    let mut known: Vec<String> = Vec::new();
    if machine.cores > 0 {
        known.push(plural(machine.cores, "core"));
    }
    if machine.memory > 0 {
        known.push(gibibytes(machine.memory));
    }
    known.extend(Some(machine.os.clone()).filter(|s| !s.is_empty()));
    let name = if machine.cpu.is_empty() { "a machine that is not named" } else { &machine.cpu };
    text += &format!(" on {name}");
    if !known.is_empty() {
        text += &format!(" ({})", known.join(", "));
    }
    if let Some(started) = campaign.started {
        text += &format!(", started {}", date(started));
    }
    if parts > 1 {
        text += &format!(", in {parts} parts");
    }
    text.push('.');
    if let Some(plan) = &campaign.plan {
        let memory = match plan.memory_limit {
            0 => String::new(),
            bytes => format!(" and {}", gibibytes(bytes)),
        };
        text += &format!(
            " At most {} s{memory} a run, {} at a time. ",
            plan.time_limit,
            plural(plan.jobs, "run"),
        );
        text += &match plan.repeats {
            0 | 1 => "A time is that of one solve.".into(),
            n => format!(
                "A time is the least of at most {n} solves after one to warm up, and that of the first where it takes {} s or longer.",
                plan.repeat_below
            ),
        };
    }
    if campaign.foreign {
        text += " Times and residuals are that program's own word.";
    }
    text
}

fn gibibytes(bytes: u64) -> String {
    format!("{:.1} GiB", bytes as f64 / (1u64 << 30) as f64)
}

/// The day of a time since 1970 in the Gregorian calendar, `2026-11-21`.
fn date(seconds: u64) -> String {
    // Years begin in March here, so that the day that leap years add is their last.
    let days = seconds / 86_400 + 719_468;
    let (era, day) = (days / 146_097, days % 146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let day = day - (365 * year + year / 4 - year / 100);
    let month = (5 * day + 2) / 153;
    let of_month = day - (153 * month + 2) / 5 + 1;
    let (year, month) = match month {
        0..10 => (era * 400 + year, month + 3),
        _ => (era * 400 + year + 1, month - 9),
    };
    format!("{year:04}-{month:02}-{of_month:02}")
}

// ------------------------------------------------------------------------------------------------ without a script

/// The tables for browsers without JavaScript: problems solved of those that a solver does not refuse, by tolerance.
fn summary(page: &mut String, all: &Runs) {
    for (kind, problems) in all.kinds() {
        let kind = Selection::at(kind, 0.0);
        let tolerances = all.tolerances();
        let at =
            |&tolerance| tables::summary(all, &Selection { tolerance, ..kind.clone() }, By::All);
        let columns: Vec<Vec<Row>> = tolerances.iter().map(at).collect();
        let name = escaped(&kind.kind);
        let _ = write!(page, "<h2>{name}</h2><p>{}</p>", plural(problems, "problem"));
        *page += "<table><thead><tr><th>solver</th>";
        for tolerance in &tolerances {
            let _ = write!(page, "<th class=\"n\">{tolerance:e}</th>");
        }
        *page += "</tr></thead><tbody>\n";
        for solver in kind.solvers(all) {
            let _ = write!(page, "<tr><td>{}</td>", escaped(solver));
            for rows in &columns {
                let row = rows.iter().find(|r| r.solver == solver);
                let cell = row.map(|r| format!("{} of {}", r.solved, r.problems - r.refused));
                let _ = write!(page, "<td class=\"n\">{}</td>", cell.unwrap_or_default());
            }
            *page += "</tr>\n";
        }
        *page += "</tbody></table>";
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_of_the_calendar() {
        let cases = [
            (0, "1970-01-01"),
            (951_782_399, "2000-02-28"),
            (951_782_400, "2000-02-29"),
            (951_868_800, "2000-03-01"),
            (1_735_689_599, "2024-12-31"),
            (4_107_542_400, "2100-03-01"),
        ];
        for (seconds, day) in cases {
            assert_eq!(date(seconds), day);
        }
    }

    #[test]
    fn nothing_of_the_page_ends_its_script() {
        for script in SCRIPTS {
            assert!(!script.contains("</script") && !script.contains("<!--"));
        }
        assert!(!STYLE.contains("</style"));
    }
}

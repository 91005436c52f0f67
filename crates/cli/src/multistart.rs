//! `nonsmooth solve --multistart`: the solutions of a nonlinear problem that several starts lead to.

use std::path::Path;

use nonsmooth_io::table::Table;
use nonsmooth_io::{ProblemFile, StoredPoint};
use nonsmooth_problem::{AnyPoint, AnyProblem, AnyStatus, Complementarity, Problem};
use nonsmooth_solve::settings::SettingsMap;
use nonsmooth_solve::{Answer, Found, Limits, Solve, multistart};
use serde_json::json;

use crate::report::{self, count, row};
use crate::{Exit, answer, output};

/// What is asked for.
pub struct Starts<'a> {
    /// How many.
    pub number: usize,
    /// Of the random ones.
    pub seed: u64,
    pub solver: &'a str,
    pub settings: &'a SettingsMap,
}

/// Lists the solutions that differ of the problem of a file.
pub fn run(
    file: &Path,
    content: &ProblemFile,
    starts: &Starts,
    limits: &Limits,
    json: bool,
) -> Result<Exit, String> {
    let AnyProblem::Complementarity(Complementarity::Mcp(problem)) = &content.problem else {
        let (file, kind) = (file.display(), content.problem.kind().name());
        return Err(format!("{file}: --multistart: expected a problem mcp, found {kind}"));
    };
    if starts.number == 0 {
        return Err("--multistart: expected at least 1 start, found 0".into());
    }
    let how =
        Solve::new().solver(starts.solver).settings(starts.settings.clone()).limits(limits.clone());
    let found = multistart(problem, &how, starts.number, starts.seed)
        .map_err(|e| format!("{}: {e}", file.display()))?;
    output::print(&match json {
        true => as_json(file, content, &found),
        false => text(file, content, &found)?,
    });
    Ok(Exit::solved(!found.solutions.is_empty()))
}

fn text(file: &Path, content: &ProblemFile, found: &Found) -> Result<String, String> {
    let number = count(found.solutions.len(), "solution");
    let starts = count(found.starts, "start");
    let mut text = format!("{}: {number} from {starts}; there may be others\n", file.display());
    row(&mut text, "problem", report::problem_text(&content.problem));
    if let Some(limit) = found.limit {
        let status = nonsmooth_solve::Status::Limit(limit);
        row(&mut text, "stopped", status.to_string().replace("not solved: ", ""));
    }
    for (k, (one, times)) in found.solutions.iter().enumerate() {
        let relative = report::number(one.verdict.measure.relative);
        let from = count(*times, "start");
        let line = format!("from {from} (relative residual {relative})");
        row(&mut text, &format!("{}", k + 1), line);
        let table = table(content, one).map_err(|e| format!("{}: {e}", file.display()))?;
        answer::lines(&table).iter().for_each(|line| row(&mut text, "", line));
    }
    Ok(text)
}

fn table(
    content: &ProblemFile,
    one: &Answer<nonsmooth_problem::Mcp>,
) -> Result<Table, nonsmooth_problem::ProblemError> {
    let point = AnyPoint::from(one.point.clone());
    let stored = StoredPoint::new(&content.problem, point, one.verdict.velocity.clone());
    let statuses = one.verdict.statuses.iter().map(|s| AnyStatus::from(*s)).collect();
    Table::new(&content.problem, &StoredPoint { statuses, ..stored }, &content.info.names)
}

fn as_json(file: &Path, content: &ProblemFile, found: &Found) -> String {
    let mut all = report::problem_json(file, &content.problem);
    let each = found.solutions.iter().map(|(one, times)| {
        json!({
            "x": one.point.z,
            "F": one.verdict.velocity,
            "starts": times,
            "relative": one.verdict.measure.relative,
            "absolute": one.verdict.measure.absolute,
        })
    });
    let each = each.collect::<Vec<_>>();
    all.extend(report::fields(json!({"starts": found.starts, "solutions": each})));
    format!("{}\n", json!(all))
}

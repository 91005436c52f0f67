//! `nonsmooth solve --all-solutions`: every solution of a small linear complementarity problem.

use std::path::Path;

use nonsmooth_io::table::Table;
use nonsmooth_io::{ProblemFile, StoredPoint};
use nonsmooth_problem::check::Judged;
use nonsmooth_problem::{AnyPoint, AnyProblem, Complementarity, LcpPoint, Problem};
use nonsmooth_solve::complementarity::pivoting::{Face, Solutions, all_solutions};
use nonsmooth_solve::{Limits, SolveError, guard};
use serde_json::json;

use crate::report::{self, count, row};
use crate::{Exit, answer, files, output};

/// Patterns of `z_i = 0` and `w_i = 0` with solutions that are listed at most.
const MOST: usize = 1000;

/// Lists the solutions of the problem of a file. Isolated ones are judged at the tolerance of the limits.
pub fn run(
    file: &Path,
    content: &ProblemFile,
    limits: &Limits,
    json: bool,
) -> Result<Exit, String> {
    let problem = &content.problem;
    let found = match problem {
        AnyProblem::Complementarity(
            linear @ (Complementarity::Lcp(_) | Complementarity::Mlcp(_)),
        ) => {
            let copy = linear.clone();
            guard::run(limits, || {}, move |_| solutions(&copy))
        }
        other => {
            let (file, kind) = (file.display(), other.kind().name());
            return Err(format!(
                "{file}: --all-solutions: expected an LCP or an MLCP, found {kind}"
            ));
        }
    };
    let found = match found {
        Ok(found) => found.map_err(|e| format!("{}: --all-solutions: {e}", file.display()))?,
        Err(limit) => return Ok(files::late(file, json, limit, "before all cases were looked at")),
    };
    let tolerance = limits.tolerance;
    let listed = found.faces.iter().map(|face| Listed::new(content, face, tolerance));
    let listed =
        listed.collect::<Result<Vec<_>, _>>().map_err(|e| format!("{}: {e}", file.display()))?;
    output::print(&match json {
        true => as_json(file, problem, &found, &listed),
        false => text(file, problem, &found, &listed, tolerance),
    });
    let passes = listed.iter().all(|one| one.relative <= tolerance);
    Ok(Exit::solved(!listed.is_empty() && passes))
}

fn solutions(problem: &Complementarity) -> Result<Solutions, SolveError> {
    match problem {
        Complementarity::Lcp(p) => all_solutions(p, MOST),
        Complementarity::Mlcp(p) => all_solutions(p, MOST),
        _ => Err(SolveError::needs("an LCP or an MLCP", "another kind")),
    }
}

/// A solution, or one of a family, with what the judge says of it.
struct Listed<'a> {
    face: &'a Face,
    table: Table,
    w: Vec<f64>,
    relative: f64,
}

impl<'a> Listed<'a> {
    fn new(
        content: &ProblemFile,
        face: &'a Face,
        tolerance: f64,
    ) -> Result<Self, nonsmooth_problem::ProblemError> {
        let point = AnyPoint::from(LcpPoint { z: face.z.clone() });
        let verdict = content.problem.judge(&point, tolerance)?;
        let stored = StoredPoint::new(&content.problem, point, verdict.velocity);
        let stored = StoredPoint { statuses: verdict.statuses, ..stored };
        let table = Table::new(&content.problem, &stored, &content.info.names)?;
        let relative = verdict.measure.relative;
        Ok(Self { face, table, w: stored.partner.unwrap_or_default(), relative })
    }
}

/// How many there are, and whether there may be more.
fn summary(found: &Solutions) -> String {
    let (isolated, families) = (found.isolated().count(), found.families().count());
    let what = match (isolated, families) {
        (0, 0) => "no solution".into(),
        (n, 0) => count(n, "isolated solution"),
        (0, 1) => "1 family of solutions".into(),
        (0, k) => format!("{k} families of solutions"),
        (n, 1) => format!("{} and 1 family", count(n, "isolated solution")),
        (n, k) => format!("{} and {k} families", count(n, "isolated solution")),
    };
    match found.complete {
        true => format!("{what}; there are no others"),
        false => format!("{what}, and perhaps more: the list ends after {MOST} patterns"),
    }
}

fn text(
    file: &Path,
    problem: &AnyProblem,
    found: &Solutions,
    listed: &[Listed],
    tolerance: f64,
) -> String {
    let mut text = format!("{}: {}\n", file.display(), summary(found));
    row(&mut text, "problem", report::problem_text(problem));
    for (k, one) in listed.iter().enumerate() {
        let label = format!("{}", k + 1);
        let what = match one.face.dimension {
            0 => "isolated".into(),
            1 => "a segment or ray of solutions; one in its interior".into(),
            d => format!("a family of dimension {d}; one in its interior"),
        };
        let passes = if one.relative <= tolerance { "" } else { ", does not pass" };
        row(
            &mut text,
            &label,
            format!("{what} (relative residual {}{passes})", report::number(one.relative)),
        );
        answer::lines(&one.table).iter().for_each(|line| row(&mut text, "", line));
        for (name, all) in [("end", &one.face.ends), ("direction", &one.face.rays)] {
            for z in all {
                let each: Vec<_> = z.iter().map(|&x| answer::short(x)).collect();
                row(&mut text, "", format!("{name}: ({})", each.join(", ")));
            }
        }
    }
    text
}

fn as_json(file: &Path, problem: &AnyProblem, found: &Solutions, listed: &[Listed]) -> String {
    let mut all = report::problem_json(file, problem);
    let each = listed.iter().map(|one| {
        json!({
            "z": one.face.z,
            "w": one.w,
            "dimension": one.face.dimension,
            "ends": one.face.ends,
            "rays": one.face.rays,
            "relative": one.relative,
        })
    });
    let each = each.collect::<Vec<_>>();
    all.extend(report::fields(json!({"complete": found.complete, "solutions": each})));
    format!("{}\n", json!(all))
}

//! `nonsmooth solve --all-solutions`: every solution of a small linear complementarity problem.

use std::path::Path;
use std::time::Instant;

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
/// Ends, directions and lines of a family that a report has at most, of each.
const SHOWN: usize = 20;

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
            guard::run(
                limits,
                || {},
                move |own| {
                    let _scope = own.budget(Instant::now()).enter();
                    solutions(&copy)
                },
            )
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
    let passing = listed.iter().filter(|one| one.relative <= tolerance).count();
    let mut lacks = found.lacks.clone();
    if passing < listed.len() {
        let failing = listed.len() - passing;
        lacks.push(format!("{failing} of them, rounded to doubles, do not pass"));
    }
    output::print(&match json {
        true => as_json(file, problem, &lacks, &listed),
        false => {
            let heading = format!("{}: {}\n", file.display(), summary(&found, &lacks));
            text(heading, problem, &listed, tolerance)
        }
    });
    Ok(Exit::solved(!listed.is_empty() && passing == listed.len()))
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

/// How many there are, and whether that is all.
fn summary(found: &Solutions, lacks: &[String]) -> String {
    let (isolated, families) = (found.isolated().count(), found.families().count());
    let what = match (isolated, families) {
        (0, 0) => "no solution".into(),
        (n, 0) => count(n, "isolated solution"),
        (0, 1) => "1 family of solutions".into(),
        (0, k) => format!("{k} families of solutions"),
        (n, 1) => format!("{} and 1 family", count(n, "isolated solution")),
        (n, k) => format!("{} and {k} families", count(n, "isolated solution")),
    };
    match (lacks, found.faces.is_empty()) {
        ([], _) => format!("{what}; there are no others"),
        (_, true) => format!("{what} found, but perhaps there are some: {}", lacks.join("; ")),
        (_, false) => format!("{what}, and perhaps more: {}", lacks.join("; ")),
    }
}

fn text(heading: String, problem: &AnyProblem, listed: &[Listed], tolerance: f64) -> String {
    let mut text = heading;
    row(&mut text, "problem", report::problem_text(problem));
    for (k, one) in listed.iter().enumerate() {
        let label = format!("{}", k + 1);
        let what = match one.face.dimension {
            0 => "isolated".into(),
            1 => "a segment, ray or line of solutions; one in its interior".into(),
            d => format!("a family of dimension {d}; one in its interior"),
        };
        let passes = if one.relative <= tolerance { "" } else { ", does not pass" };
        row(
            &mut text,
            &label,
            format!("{what} (relative residual {}{passes})", report::number(one.relative)),
        );
        answer::lines(&one.table).iter().for_each(|line| row(&mut text, "", line));
        let Face { ends, rays, lines, .. } = one.face;
        for (name, all) in [("end", ends), ("direction", rays), ("line", lines)] {
            for z in all.iter().take(SHOWN) {
                let each: Vec<_> = z.iter().map(|&x| answer::short(x)).collect();
                row(&mut text, "", format!("{name}: ({})", each.join(", ")));
            }
            if all.len() > SHOWN {
                row(&mut text, "", format!("{name}: {} more, see --json", all.len() - SHOWN));
            }
        }
    }
    text
}

fn as_json(file: &Path, problem: &AnyProblem, lacks: &[String], listed: &[Listed]) -> String {
    let mut all = report::problem_json(file, problem);
    let each = listed.iter().map(|one| {
        json!({
            "z": one.face.z,
            "w": one.w,
            "dimension": one.face.dimension,
            "ends": one.face.ends,
            "rays": one.face.rays,
            "lines": one.face.lines,
            "relative": one.relative,
        })
    });
    let each = each.collect::<Vec<_>>();
    all.extend(report::fields(json!({"complete": lacks.is_empty(), "solutions": each})));
    if !lacks.is_empty() {
        all.extend(report::fields(json!({"lacks": lacks})));
    }
    format!("{}\n", json!(all))
}

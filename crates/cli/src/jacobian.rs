//! `nonsmooth check --jacobian`: the Jacobian of a nonlinear problem beside differences of F.

use std::path::{Path, PathBuf};

use nonsmooth_analysis::{Entry, JacobianCheck};
use nonsmooth_problem::field::Field;
use nonsmooth_problem::{AnyPoint, AnyProblem, Problem, Stated, with_complementarity};
use serde_json::{Value, json};

use crate::{Exit, files, kinds, output, report};

/// Compares at the start of each problem, and at its solution where the file has one.
pub fn check(problems: &[PathBuf], as_json: bool) -> Exit {
    files::each(problems, as_json, |_, file| {
        let content = files::read(file)?;
        let function = match &content.problem {
            AnyProblem::Complementarity(p) => with_complementarity!(p, p => p.function()),
            AnyProblem::Friction(_) => None,
        };
        let Some(field) = function else {
            let found = content.problem.kind().name();
            return Err(format!(
                "{}: --jacobian: expected a problem by a function (mcp, vi), found {found}",
                file.display()
            ));
        };
        let stored = content.solution.as_ref().and_then(|stored| match &stored.point {
            AnyPoint::Lcp(point) => Some(("solution", &point.z)),
            _ => None,
        });
        let start = kinds::start_of(&content.problem);
        let points: Vec<_> = std::iter::once(("start", &start)).chain(stored).collect();
        let checks: Vec<_> =
            points.iter().map(|(name, x)| (*name, JacobianCheck::of(field, x))).collect();
        let agrees = checks.iter().all(|(_, c)| c.as_ref().is_none_or(JacobianCheck::agrees));
        let compared = checks.iter().any(|(_, c)| c.is_some());
        let (name, says) = match (compared, agrees) {
            (false, _) => ("undefined", "the Jacobian is not defined where it is asked for"),
            (true, true) => ("agrees", "the Jacobian agrees with differences of F"),
            (true, false) => ("differs", "the Jacobian does not agree with differences of F"),
        };
        output::print(&match as_json {
            true => line(file, &content.problem, name, says, &checks),
            false => text(file, &content.problem, field, says, &checks, &content.info.names),
        });
        Ok(Exit::solved(compared && agrees))
    })
}

type Checks<'a> = [(&'a str, Option<JacobianCheck>)];

fn line(file: &Path, any: &AnyProblem, name: &str, says: &str, checks: &Checks) -> String {
    let mut all = report::problem_json(file, any);
    all.extend(report::fields(json!({"status": name, "message": says})));
    let of = |(name, check): &(&str, _)| ((*name).to_owned(), json!(check));
    all.insert("jacobian".into(), Value::Object(checks.iter().map(of).collect()));
    format!("{}\n", json!(all))
}

fn text(
    file: &Path,
    any: &AnyProblem,
    field: &dyn Field,
    says: &str,
    checks: &Checks,
    names: &[String],
) -> String {
    let mut text = format!("{}: {says}\n", file.display());
    report::row(&mut text, "problem", report::problem_text(any));
    report::row(&mut text, "Jacobian", field.source());
    for (name, check) in checks {
        let said = match check {
            None => "F or its Jacobian is not defined there".into(),
            Some(JacobianCheck { compared, undefined, wrong, worst }) => {
                let mut said = match compared {
                    1 => "1 entry compared".into(),
                    n => format!("{n} entries compared"),
                };
                if *undefined > 0 {
                    said += &format!(", {undefined} at which F has no difference");
                }
                if *wrong > 0 {
                    said += &format!(", {wrong} wrong");
                }
                said + &worst.map_or_else(String::new, |worst| shown(&worst, names))
            }
        };
        report::row(&mut text, name, said);
    }
    text
}

/// The entry that agrees least.
fn shown(worst: &Entry, names: &[String]) -> String {
    let Entry { row, column, stated, difference, in_pattern, .. } = worst;
    let by = names.get(*column).map_or_else(|| format!("x[{column}]"), Clone::clone);
    let outside = if *in_pattern { "" } else { ", for which the pattern has no place" };
    format!("; worst dF[{row}]/d{by} = {stated:?}, by differences {difference:?}{outside}")
}

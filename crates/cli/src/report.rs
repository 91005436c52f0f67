//! What the judge says of a point, as text and as JSON.

use std::fmt::Write;
use std::path::Path;

use nonsmooth_analysis::{Indeterminacy, Regularity};
/// `1 contact`, `2 contacts`.
pub use nonsmooth_bench::plural as count;
use nonsmooth_io::ProblemFile;
use nonsmooth_problem::check::{self, Failing, Measure, RELATIVE};
use nonsmooth_problem::{
    AnyCounts, AnyPoint, AnyProblem, AnyStatus, GlobalPoint, LocalPoint, Problem, Stated,
    with_complementarity,
};
use serde_json::{Value, json};

pub use crate::json::{Object, fields};
use crate::kinds::{self, AnyVerdict, Counted, counted};

/// A line of a report: what it is about, and the rest.
pub fn row(text: &mut String, label: &str, rest: impl std::fmt::Display) {
    // Writing to a String cannot fail.
    let _ = writeln!(text, "  {label:<10} {rest}");
}

/// A number of three digits.
pub fn number(x: f64) -> String {
    format!("{x:.2e}")
}

/// The file and the size of its problem.
pub fn problem_json(file: &Path, problem: &AnyProblem) -> Object {
    let mut all = fields(json!({"file": file.to_string_lossy(), "kind": problem.kind().name()}));
    all.extend(kinds::sizes(problem));
    all
}

/// The size of a problem.
pub fn problem_text(problem: &AnyProblem) -> String {
    format!("{}, {}", problem.kind().name(), kinds::size(problem))
}

/// The residuals, what of them fails at `tolerance`, the contacts (or rows) by status and the worst of them. Numbers that
/// are not finite become null.
pub fn verdict_json(verdict: &AnyVerdict, tolerance: f64, worst: usize) -> Object {
    let Counted { what, judged, .. } = counted(&verdict.counts);
    let mut counts = json!(verdict.counts);
    let mut degenerate = counts.as_object_mut().and_then(|counts| counts.remove("degenerate"));
    if uncounted(verdict) {
        (counts, degenerate) = (Value::Null, None);
    }
    let worst = worst_of(verdict, worst)
        .map(|(which, residual)| json!({(judged): which, "residual": residual}));
    fields(json!({
        "residual": residual_json(&verdict.measure),
        "failing": verdict.measure.failing(tolerance),
        (format!("{what}s_by_status")): counts,
        "degenerate": degenerate,
        (format!("worst_{judged}s")): worst.collect::<Vec<_>>(),
    }))
}

/// Whether the motion of a solution determines its impulses; `dofs` as a file has them. Nothing of a point that is none, or of a complementarity problem.
fn indeterminacy(
    problem: &AnyProblem,
    point: &AnyPoint,
    dofs: Option<usize>,
    verdict: &AnyVerdict,
) -> Option<Indeterminacy> {
    let (AnyPoint::Local(LocalPoint { r, lambda })
    | AnyPoint::Global(GlobalPoint { r, lambda, .. })) = point
    else {
        return None;
    };
    let AnyProblem::Friction(problem) = problem else { return None };
    let contact = |status: &AnyStatus| match status {
        AnyStatus::Contact(contact) => Some(*contact),
        AnyStatus::Row(_) | AnyStatus::Set(_) => None,
    };
    let statuses: Vec<_> = verdict.statuses.iter().filter_map(contact).collect();
    let residual = verdict.measure.relative;
    let found = || Indeterminacy::of(problem, (r, lambda), &statuses, dofs, residual);
    verdict.solved.then(found).flatten()
}

/// Whether the Jacobian says that a solution of a nonlinear problem is isolated. Nothing of a point that is none, or of another problem.
fn regularity(problem: &AnyProblem, point: &AnyPoint, verdict: &AnyVerdict) -> Option<Regularity> {
    let (AnyProblem::Complementarity(problem), AnyPoint::Lcp(point)) = (problem, point) else {
        return None;
    };
    let row = |status: &AnyStatus| match status {
        AnyStatus::Row(row) => Some(*row),
        AnyStatus::Contact(_) | AnyStatus::Set(_) => None,
    };
    let statuses: Vec<_> = verdict.statuses.iter().filter_map(row).collect();
    let found = |mcp| Regularity::of(mcp, &point.z, &statuses, verdict.measure.relative);
    let nonlinear = with_complementarity!(problem, p => p.nonlinear());
    nonlinear.filter(|_| verdict.solved).and_then(found)
}

/// Says where the impulses of a solution are not the only ones, and whether a solution of a nonlinear problem is isolated.
pub fn uniqueness_text(
    text: &mut String,
    content: &ProblemFile,
    point: &AnyPoint,
    verdict: &AnyVerdict,
) {
    let found = indeterminacy(&content.problem, point, content.info.dofs, verdict);
    if let Some(Indeterminacy { rank, of, counted, .. }) =
        found.filter(|i| i.is_unique() == Some(false))
    {
        let how = if counted { "rank at most" } else { "rank" };
        let says = format!("not unique: {how} {rank} of {of}; all of them give the same motion");
        row(text, "impulses", says);
    }
    if let Some(found) = regularity(&content.problem, point, verdict) {
        let Regularity { rank, of } = found;
        let degenerate = counted(&verdict.counts).degenerate > 0;
        let says = match (found.is_regular(), degenerate) {
            (false, _) => {
                ": the solution need not be isolated, and is less accurate than the residual"
            }
            (true, true) => ", but pairs are degenerate",
            (true, false) => ": an isolated solution",
        };
        row(text, "Jacobian", format!("rank {rank} of {of} on the active set{says}"));
    }
}

/// The same for JSON; null where it is not known.
pub fn uniqueness_json(content: &ProblemFile, point: &AnyPoint, verdict: &AnyVerdict) -> Object {
    let found = indeterminacy(&content.problem, point, content.info.dofs, verdict);
    if let AnyProblem::Complementarity(problem) = &content.problem {
        let found = regularity(&content.problem, point, verdict);
        let nonlinear = with_complementarity!(problem, p => p.nonlinear());
        let said = nonlinear.map(|_| fields(json!({"jacobian_on_active_set": found})));
        return said.unwrap_or_default();
    }
    let unique = found.as_ref().and_then(Indeterminacy::is_unique);
    fields(json!({"impulses_unique": unique, "indeterminacy": found}))
}

fn uncounted(verdict: &AnyVerdict) -> bool {
    // A set may have no constraint.
    let counts = !matches!(verdict.counts, AnyCounts::Sets(_));
    counts && verdict.statuses.is_empty() && !verdict.velocity.is_empty()
}

/// The residuals by name.
pub fn residual_json(measure: &Measure) -> Object {
    let mut all = fields(json!(measure));
    for of_one_contact in ["worst_contact", "worst"] {
        all.remove(of_one_contact);
    }
    all
}

/// The first line on a point: the file, what came of it, and what the judge's decision rests on.
pub fn headline(file: &Path, says: &str, measure: &Measure, tolerance: f64) -> String {
    if *measure == Measure::unknown() {
        return format!("{}: {says} (the point was not judged)\n", file.display());
    }
    let others = match listed(&measure.failing_beside(tolerance).1, |_| String::new()) {
        none if none.is_empty() => none,
        others => format!("; fails {others}"),
    };
    let relative = number(measure.relative);
    format!("{}: {says} ({RELATIVE} {relative}, tolerance {tolerance:e}{others})\n", file.display())
}

fn listed(failing: &[Failing], more: impl Fn(&Failing) -> String) -> String {
    let each = failing.iter().map(|f| format!("{} {}{}", f.what, number(f.value), more(f)));
    each.collect::<Vec<_>>().join(", ")
}

/// The residuals, what else than the relative one fails at `tolerance`, the contacts (or rows) by status, and the
/// `worst` of them where it is they that fail.
///
/// Rows and variables go by their names in `content`, where they have any.
pub fn verdict_text(
    text: &mut String,
    content: &ProblemFile,
    verdict: &AnyVerdict,
    tolerance: f64,
    worst: usize,
) {
    let Counted { what, judged, unit, all, at_limit, degenerate, rolling } =
        counted(&verdict.counts);
    let names = kinds::names_of_rows(content);
    let called = |i: usize| match names.get(i) {
        Some(name) => format!("{i} `{name}`"),
        None => i.to_string(),
    };
    let judged_at_all = verdict.measure != Measure::unknown();
    if judged_at_all {
        residual_text(text, &verdict.measure, unit);
    } else {
        row(text, "residual", "not judged: the limit had passed");
    }
    let (relative, others) = verdict.measure.failing_beside(tolerance);
    if judged_at_all && !others.is_empty() {
        let limit = |f: &Failing| {
            let limit = format!("limit {:.1e}", f.limit).replace(".0e", "e");
            match verdict.measure.own_contact.filter(|_| f.what == check::OWN) {
                Some(c) => format!(" ({judged} {}, {limit})", called(c)),
                None => format!(" ({limit})"),
            }
        };
        row(text, "fails", listed(&others, limit));
    }
    let what = format!("{what}s");
    if uncounted(verdict) {
        return row(text, &what, "not counted: the limit had passed");
    }
    let degenerate = match degenerate {
        0 => String::new(),
        n => format!(" ({n} degenerate: near another status)"),
    };
    let limit = |what: &str| match at_limit {
        n if n > 0 && what == "stick" => format!(" ({n} at the limit of friction)"),
        _ => String::new(),
    };
    let all: Vec<_> = all.iter().map(|(n, what)| format!("{n} {what}{}", limit(what))).collect();
    let rolls = match rolling {
        0 => String::new(),
        n => format!("; {n} roll"),
    };
    row(text, &what, all.join(", ") + &rolls + &degenerate);
    let worst = if relative || others.is_empty() { worst } else { 0 };
    let worst: Vec<_> = worst_of(verdict, worst)
        .map(|(which, residual)| format!("{} ({})", called(which), number(residual)))
        .collect();
    if !worst.is_empty() {
        row(text, "worst", format!("{judged}s {}", worst.join(", ")));
    }
}

/// The residuals, in two lines.
fn residual_text(text: &mut String, m: &Measure, unit: &str) {
    let rest = [
        ("relative", Some(m.relative)),
        ("literature", Some(m.literature)),
        ("siconos", Some(m.siconos)),
    ];
    let absolute = format!(", absolute {}{unit}", number(m.absolute));
    row(text, "residual", named(&rest) + &absolute);
    let parts = [
        ("primal", Some(m.primal)),
        ("dual", Some(m.dual)),
        ("complementarity", Some(m.complementarity)),
        ("own", m.own),
        ("dynamics", m.dynamics),
        ("velocities", m.velocity_gap),
        ("bilateral", m.bilateral),
    ];
    row(text, "", named(&parts));
}

fn named(parts: &[(&str, Option<f64>)]) -> String {
    let there = parts.iter().filter_map(|&(name, x)| Some((name, x?)));
    let texts: Vec<_> = there.map(|(name, x)| format!("{name} {}", number(x))).collect();
    texts.join(", ")
}

/// The contacts, or rows, with the largest residuals; those without any are not listed.
fn worst_of(verdict: &AnyVerdict, worst: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
    // A NaN is as bad as it gets: keep it.
    let bad = verdict.worst.iter().copied().filter(|&(_, x)| x != 0.0);
    bad.take(worst)
}

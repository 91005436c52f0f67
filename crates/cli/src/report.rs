//! What the judge says of a point, as text and as JSON.

use std::fmt::Write;
use std::path::Path;

use nonsmooth_problem::check::{Measure, Verdict};
use serde_json::{Map, Value, json};

use crate::kinds::Form;

/// An object of JSON, in the order in which it is filled.
pub type Object = Map<String, Value>;

/// A line of a report: what it is about, and the rest.
pub fn row(text: &mut String, label: &str, rest: impl std::fmt::Display) {
    // Writing to a String cannot fail.
    let _ = writeln!(text, "  {label:<11}{rest}");
}

/// A number of three digits.
pub fn number(x: f64) -> String {
    format!("{x:.2e}")
}

/// `1 contact`, `2 contacts`.
pub fn count(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

/// The file and the size of its problem.
pub fn problem_json<P: Form>(file: &Path, problem: &P) -> Object {
    fields(json!({
        "file": file.to_string_lossy(),
        "kind": problem.kind().name(),
        "contacts": problem.contacts(),
        "unknowns": problem.unknowns(),
    }))
}

/// The size of a problem.
pub fn problem_text<P: Form>(problem: &P) -> String {
    format!(
        "{}, {}, {}",
        problem.kind().name(),
        count(problem.contacts(), "contact"),
        count(problem.unknowns(), "unknown")
    )
}

/// The residuals, the contacts by status and the worst contacts. Numbers that are not finite become null.
pub fn verdict_json(verdict: &Verdict, worst: usize) -> Object {
    let mut counts = fields(json!(verdict.counts));
    let degenerate = counts.remove("degenerate");
    let worst = worst_of(verdict, worst)
        .map(|(contact, residual)| json!({"contact": contact, "residual": residual}));
    fields(json!({
        "residual": residual_json(&verdict.measure),
        "contacts_by_status": counts,
        "degenerate": degenerate,
        "worst_contacts": worst.collect::<Vec<_>>(),
    }))
}

/// The residuals by name.
pub fn residual_json(measure: &Measure) -> Object {
    let mut all = fields(json!(measure));
    for of_one_contact in ["worst_contact", "worst"] {
        all.remove(of_one_contact);
    }
    all
}

/// The fields of an object.
pub fn fields(value: Value) -> Object {
    match value {
        Value::Object(map) => map,
        other => Object::from_iter([("value".into(), other)]),
    }
}

/// The residuals and the contacts by status, a line each, and the `worst` contacts.
pub fn verdict_text(text: &mut String, verdict: &Verdict, worst: usize) {
    residual_text(text, &verdict.measure);
    let counts = &verdict.counts;
    let degenerate = match counts.degenerate {
        0 => String::new(),
        n => format!(" ({n} degenerate: near another status)"),
    };
    let all = [(counts.open, "open"), (counts.stick, "stick"), (counts.slip, "slip")];
    let all = all.map(|(n, what)| format!("{n} {what}")).join(", ");
    row(text, "contacts", all + &degenerate);
    let worst: Vec<_> = worst_of(verdict, worst)
        .map(|(contact, residual)| format!("{contact} ({})", number(residual)))
        .collect();
    if !worst.is_empty() {
        row(text, "worst", format!("contacts {}", worst.join(", ")));
    }
}

/// The residuals, in two lines.
pub fn residual_text(text: &mut String, m: &Measure) {
    let rest = [("relative", Some(m.relative)), ("paper", Some(m.paper)), ("peer", Some(m.peer))];
    let absolute = format!(", absolute {} m/s", number(m.absolute));
    row(text, "residual", named(&rest) + &absolute);
    let parts = [
        ("primal", Some(m.primal)),
        ("dual", Some(m.dual)),
        ("complementarity", Some(m.complementarity)),
        ("dynamics", m.dynamics),
        ("bilateral", m.bilateral),
    ];
    row(text, "", named(&parts));
}

fn named(parts: &[(&str, Option<f64>)]) -> String {
    let there = parts.iter().filter_map(|&(name, x)| Some((name, x?)));
    let texts: Vec<_> = there.map(|(name, x)| format!("{name} {}", number(x))).collect();
    texts.join(", ")
}

/// The contacts with the largest residuals; those without any are not listed.
fn worst_of(verdict: &Verdict, worst: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
    // A NaN is as bad as it gets: keep it.
    let bad = verdict.worst.iter().copied().filter(|&(_, x)| x != 0.0);
    bad.take(worst)
}

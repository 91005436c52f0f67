//! The solution itself, as text and as JSON.

use nonsmooth_io::table::{Column, Table};
use nonsmooth_io::{ProblemFile, StoredPoint};
use nonsmooth_problem::{AnyPoint, AnyProblem, GlobalPoint, LocalPoint, Problem};
use serde_json::{Value, json};

use crate::json::Object;
use crate::report::{count, row};

/// The rows of a solution that a report prints unasked.
pub const FEW: usize = 20;

/// Decimals that a report prints of a number.
const DIGITS: usize = 6;

/// Prints a solution under a label; where it has more than [`FEW`] rows and is not asked for, how to have it, unless it is `kept` in a file.
pub fn text(text: &mut String, label: &str, content: &ProblemFile, asked: bool, kept: bool) {
    let Some(stored) = &content.solution else { return };
    let Ok(table) = Table::new(&content.problem, stored, &content.info.names) else { return };
    let rows = table.len();
    if rows > FEW && !asked {
        let what = count(rows, table.columns[0].0);
        let keeps = if kept { "" } else { ", --out FILE keeps it" };
        return row(text, label, format!("of {what}: --solution prints it{keeps}"));
    }
    for (k, line) in lines(&table).iter().enumerate() {
        row(text, if k == 0 { label } else { "" }, line);
    }
    for (name, x) in rest(&stored.point) {
        if !x.is_empty() && (asked || x.len() <= FEW) {
            let each: Vec<_> = x.iter().map(|&x| short(x)).collect();
            row(text, "", format!("{name}: {}", each.join(", ")));
        }
    }
}

/// What of a point is in no row of its table: body velocities and multipliers.
fn rest(point: &AnyPoint) -> Vec<(&'static str, &[f64])> {
    match point {
        AnyPoint::Local(LocalPoint { lambda, .. }) => vec![("multipliers", &lambda[..])],
        AnyPoint::Global(GlobalPoint { v, lambda, .. }) => {
            vec![("velocities v", &v[..]), ("multipliers", &lambda[..])]
        }
        _ => vec![],
    }
}

/// The table with aligned columns, its names first: words to the left, numbers to the right.
pub fn lines(table: &Table) -> Vec<String> {
    let columns: Vec<(bool, Vec<String>)> = table
        .columns
        .iter()
        .map(|(name, column)| {
            let cells: Vec<String> = match column {
                Column::Text(words) => words.clone(),
                Column::Numbers(all) => all.iter().map(|x| x.map_or("".into(), short)).collect(),
            };
            let words = matches!(column, Column::Text(_));
            (words, std::iter::once((*name).into()).chain(cells).collect())
        })
        .collect();
    let width = |cells: &[String]| cells.iter().map(|c| c.chars().count()).max().unwrap_or(0);
    let widths: Vec<_> = columns.iter().map(|(_, cells)| width(cells)).collect();
    let line = |k: usize| {
        let cells = columns.iter().zip(&widths).map(|((words, cells), &width)| match words {
            true => format!("{:<width$}", cells[k]),
            false => format!("{:>width$}", cells[k]),
        });
        cells.collect::<Vec<_>>().join("  ").trim_end().to_owned()
    };
    (0..=table.len()).map(line).collect()
}

/// A number with a few digits, as people write it.
pub fn short(x: f64) -> String {
    let size = x.abs();
    if x == 0.0 {
        return "0".into();
    }
    if !(1e-4..1e6).contains(&size) {
        return format!("{x:.3e}");
    }
    let whole = size.log10().floor().max(0.0) as usize;
    let text = format!("{x:.*}", (DIGITS - 1).saturating_sub(whole));
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').into(),
        false => text,
    }
}

/// A solution with all digits, by the names that its file formats use, and the status of each contact or variable.
pub fn json(problem: &AnyProblem, stored: &StoredPoint, names: &[String]) -> Value {
    let mut all = Object::new();
    let partner = stored.partner.clone().unwrap_or_else(|| problem.partner(&stored.point));
    for (name, x) in problem.point_parts(&stored.point, &partner) {
        all.insert(name.into(), json!(x));
    }
    let statuses = Table::new(problem, stored, names).ok();
    let statuses = statuses.as_ref().and_then(|table| table.column("status"));
    if let Some(Column::Text(words)) = statuses {
        all.insert("status".into(), json!(words));
    }
    if !names.is_empty() {
        all.insert("names".into(), json!(names));
    }
    Value::Object(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_as_people_write_them() {
        for (x, text) in [
            (0.0, "0"),
            (-0.0, "0"),
            (5.0, "5"),
            (1.0 / 3.0, "0.33333"),
            (-1234.5678, "-1234.57"),
            (123456.7, "123457"),
            (1e6, "1.000e6"),
            (2.5e-17, "2.500e-17"),
            (0.1 + 0.2, "0.3"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(short(x), text);
        }
    }
}

//! Scenes in the plane: what has two numbers there, or one, is written out as in space before the document is read.
//!
//! | in the plane | in space |
//! | --- | --- |
//! | a vector `[x, y]` | `[x, y, 0]` |
//! | a rate of turning or a torque `c` | `[0, 0, c]` |
//! | an orientation `φ` | `{ axis = [0, 0, 1], angle = φ }` |
//! | a velocity gradient `[[a, b], [c, d]]` | `[[a, b, 0], [c, d, 0], [0, 0, 0]]` |
//! | a moment of inertia `J` | `[J/2, J/2, J]`, that of a thin sheet |
//! | gravity, the normal of a plane, where none is given | `[0, −9.81, 0]`, `[0, 1, 0]` |

use schemars::{Schema, SchemaGenerator, json_schema};
use toml::{Table, Value};

use super::EARTH;
use crate::{Dimension, SimulateError};

/// Vectors that have two components in the plane.
const VECTORS: [&str; 14] = [
    "gravity",
    "position",
    "velocity",
    "force",
    "at",
    "anchor",
    "anchor_b",
    "axis",
    "reference",
    "amplitude",
    "half",
    "normal",
    "lengths",
    "corner",
];
/// What turns about the third axis.
const TURNS: [&str; 2] = ["angular_velocity", "torque"];

/// Of the key `dimension`.
///
/// Errors: neither 2 nor 3.
pub(super) fn dimension(number: i64) -> Result<Dimension, SimulateError> {
    match number {
        2 => Ok(Dimension::Two),
        3 => Ok(Dimension::Three),
        _ => Err(SimulateError::value("dimension", "2 or 3", number)),
    }
}

/// Writes a document that says it is in the plane as one in space is written.
///
/// Errors: another dimension than 2 or 3.
pub(super) fn lift(document: &mut Value) -> Result<(), SimulateError> {
    let Some(table) = document.as_table_mut() else { return Ok(()) };
    let stated = table.get("dimension").and_then(Value::as_integer);
    if stated.map_or(Ok(Dimension::Three), dimension)? == Dimension::Three {
        return Ok(());
    }
    let down = || Value::Array([0.0, -EARTH, 0.0].map(Value::Float).into());
    table.entry("gravity").or_insert_with(down);
    // Settings of solvers and families have keys of their own.
    for (_, value) in table.iter_mut().filter(|(key, _)| *key != "solver" && *key != "generate") {
        inside(value);
    }
    if let Some(value) = table.get_mut("gravity") {
        lifted("gravity", value);
    }
    Ok(())
}

fn inside(value: &mut Value) {
    match value {
        Value::Array(list) => list.iter_mut().for_each(inside),
        Value::Table(table) => {
            if table.get("kind").and_then(Value::as_str) == Some("plane") {
                let up = || Value::Array([0.0, 1.0, 0.0].map(Value::Float).into());
                table.entry("normal").or_insert_with(up);
            }
            for (key, value) in table.iter_mut() {
                lifted(key, value);
                inside(value);
            }
        }
        _ => {}
    }
}

fn lifted(key: &str, value: &mut Value) {
    let number = |v: &Value| v.as_float().or(v.as_integer().map(|x| x as f64));
    let list = |numbers: &[f64]| Value::Array(numbers.iter().map(|x| Value::Float(*x)).collect());
    if let Value::Array(parts) = value {
        if key == "gradient" && parts.len() == 2 {
            for row in parts.iter_mut().filter_map(Value::as_array_mut).filter(|r| r.len() == 2) {
                row.push(Value::Float(0.0));
            }
            parts.push(list(&[0.0; 3]));
        }
        if VECTORS.contains(&key) && parts.len() == 2 && parts.iter().all(|p| number(p).is_some()) {
            parts.push(Value::Float(0.0));
        }
        return;
    }
    let Some(x) = number(value) else { return };
    if TURNS.contains(&key) {
        *value = list(&[0.0, 0.0, x]);
    } else if key == "inertia" {
        *value = list(&[0.5 * x, 0.5 * x, x]);
    } else if key == "rotation" {
        let axis = list(&[0.0, 0.0, 1.0]);
        *value = Value::Table(Table::from_iter([
            ("axis".to_owned(), axis),
            ("angle".to_owned(), Value::Float(x)),
        ]));
    }
}

/// The schema of a vector: three numbers, or two in the plane.
pub(super) fn vector(_: &mut SchemaGenerator) -> Schema {
    json_schema!({"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 3})
}

/// Of a matrix: three rows of three numbers, or two of two in the plane.
pub(super) fn matrix(_: &mut SchemaGenerator) -> Schema {
    let row =
        json_schema!({"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 3});
    json_schema!({"type": "array", "items": row, "minItems": 2, "maxItems": 3})
}

/// Of what turns: three numbers, or one in the plane.
pub(super) fn turn(_: &mut SchemaGenerator) -> Schema {
    json_schema!({
        "type": ["array", "number"], "items": {"type": "number"}, "minItems": 3, "maxItems": 3
    })
}

/// Of an inertia: three or six numbers, or one in the plane.
pub(super) fn inertia(_: &mut SchemaGenerator) -> Schema {
    json_schema!({
        "type": ["array", "number", "null"], "items": {"type": "number"}, "minItems": 3, "maxItems": 6
    })
}

/// Of an orientation: a table, or the angle in the plane.
pub(super) fn rotation(generator: &mut SchemaGenerator) -> Schema {
    let table = generator.subschema_for::<super::RotationTable>();
    json_schema!({"anyOf": [table, {"type": "number"}, {"type": "null"}]})
}

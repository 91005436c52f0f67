//! Objects of JSON, put together from parts.

use serde_json::{Map, Value};

/// An object of JSON, in the order in which it is filled.
pub type Object = Map<String, Value>;

/// The fields of an object.
pub fn fields(value: Value) -> Object {
    match value {
        Value::Object(map) => map,
        other => Object::from_iter([("value".into(), other)]),
    }
}

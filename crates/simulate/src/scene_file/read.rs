//! From text to a [`SceneFile`], and back.

use std::io::ErrorKind;
use std::path::Path;

use nonsmooth_scenes::Scene;
use nonsmooth_solve::settings::SettingsMap;
use nonsmooth_solve::spelling::meant;
use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{MapAccess, Visitor};

use super::{
    FORMAT, GenerateTable, LawTable, Made, SceneFile, ShapeOrName, ShapeTable, Time, VERSION,
};
use crate::{Activation, MoreauJean, SimulateError};

impl SceneFile {
    /// The text of a scene in a file, for [`parse`](Self::parse).
    ///
    /// Errors: one line that begins with the file, which cannot be read or is no text.
    pub fn text(file: &Path) -> Result<String, String> {
        std::fs::read_to_string(file).map_err(|e| {
            let name = file.display();
            match e.kind() {
                ErrorKind::InvalidData => format!(
                    "{name}: expected a scene as TOML or JSON, found a file that is no text"
                ),
                _ => format!("{name}: expected a readable file, found: {e}"),
            }
        })
    }

    /// Reads a scene from TOML, or from JSON where the text begins with `{`; `changes` are `key=value` with a path like `time.h` or `bodies[0].mass` and a TOML value (a word stands for itself).
    ///
    /// Errors: one line that begins with the place.
    pub fn parse(text: &str, changes: &[&str]) -> Result<Self, SimulateError> {
        let mut document: toml::Value = match text.trim_start().starts_with('{') {
            true => serde_json::from_str(text).map_err(|e| {
                let place = format!("line {}, column {}", e.line(), e.column());
                SimulateError::value(place, "valid JSON", said(&e.to_string()))
            })?,
            false => toml::from_str(text).map(toml::Value::Table).map_err(|e| {
                let before = &text[..e.span().map_or(0, |s| s.start.min(text.len()))];
                let place = format!("line {}", before.matches('\n').count() + 1);
                SimulateError::value(place, "valid TOML", said(e.message()))
            })?,
        };
        for change in changes {
            apply(&mut document, change)?;
        }
        super::plane::lift(&mut document)?;
        spell_out(&mut document);
        let scene: Self = serde_path_to_error::deserialize(document).map_err(|e| {
            let path = match e.path().to_string() {
                root if root == "." => "the scene".to_owned(),
                path => path,
            };
            SimulateError::Schema { path, problem: explained(&said(e.into_inner().message())) }
        })?;
        scene.identified()
    }

    fn identified(self) -> Result<Self, SimulateError> {
        if self.format != FORMAT {
            let expected = format!("\"{FORMAT}\"");
            return Err(SimulateError::value("format", expected, format!("\"{}\"", self.format)));
        }
        if self.version != VERSION {
            return Err(SimulateError::value("version", VERSION.to_string(), self.version));
        }
        Ok(self)
    }

    /// The bodies of a family of `nonsmooth gen` with these settings, in steps of h until `end`, s.
    pub fn of_family(family: &str, set: SettingsMap, h: f64, end: f64) -> Self {
        Self {
            format: FORMAT.into(),
            version: VERSION,
            name: family.into(),
            dimension: 3,
            gravity: super::earth(),
            periodic: None,
            time: Time { h, end },
            integrator: MoreauJean::default(),
            solver: Default::default(),
            materials: Default::default(),
            pairs: vec![],
            pairs_default: Some(LawTable::default()),
            shapes: vec![],
            bodies: vec![],
            elastic: vec![],
            generate: vec![GenerateTable {
                scene: family.into(),
                set,
                name: None,
                position: [0.0; 3],
                made: Made::default(),
            }],
            joints: vec![],
            couplings: vec![],
            forces: vec![],
            output: Default::default(),
        }
    }

    /// The same of a family that was made already with these settings, under the scene's gravity and in its steps: [`build`](Self::build) makes it no second time.
    pub fn of_made(family: &str, set: SettingsMap, made: Scene, end: f64) -> Self {
        let (gravity, h) = (made.gravity, made.h);
        let made = Made::of(family, &set, made);
        let mut scene = Self { gravity, ..Self::of_family(family, set, h, end) };
        scene.generate[0].made = made;
        scene
    }

    /// The document, with all defaults written out, as TOML.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("tables of numbers, words and lists")
    }

    /// The JSON Schema of the format.
    pub fn schema() -> serde_json::Value {
        let mut schema = schemars::schema_for!(SceneFile).to_value();
        let ways = schema.pointer_mut("/$defs/Activation/oneOf").and_then(|all| all.as_array_mut());
        // The word that `spell_out` takes.
        ways.into_iter().for_each(|all| {
            all.push(serde_json::json!({
                "const": FORECAST,
                "description": "The forecast index set, with its default numbers.",
            }));
        });
        schema
    }
}

/// The word for the forecast of contacts with its default numbers.
const FORECAST: &str = "forecast";

/// Writes the forecast of contacts out where a word asks for it, with its default numbers.
fn spell_out(document: &mut toml::Value) {
    let activation = document.get_mut("integrator").and_then(|table| table.get_mut("activation"));
    if let Some(activation) = activation.filter(|value| value.as_str() == Some(FORECAST)) {
        *activation = toml::Value::try_from(Activation::default()).expect("a table of numbers");
    }
}

/// A message on one line.
fn said(message: &str) -> String {
    message.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// With the key that may have been meant, where one is unknown.
fn explained(message: &str) -> String {
    let mut words = message.split('`').skip(1).step_by(2);
    match words.next() {
        Some(word) if message.starts_with("unknown") => {
            format!("{message}{}", meant(word, words))
        }
        _ => message.into(),
    }
}

/// Sets one value of the document.
fn apply(document: &mut toml::Value, change: &str) -> Result<(), SimulateError> {
    let wrong = |expected: &str| SimulateError::value("--set", expected, format!("`{change}`"));
    let (path, text) = change.split_once('=').ok_or_else(|| wrong("KEY=VALUE"))?;
    let value = match toml::from_str::<toml::Table>(&format!("x = {text}")) {
        Ok(mut table) => table.remove("x").ok_or_else(|| wrong("KEY=VALUE"))?,
        Err(_) => toml::Value::String(text.trim().into()),
    };
    let mut at = document;
    for step in path.split('.') {
        let (key, places) = match step.split_once('[') {
            Some((key, rest)) => (key, rest.split('[').collect()),
            None => (step, vec![]),
        };
        let table = at.as_table_mut().ok_or_else(|| wrong("a key of a table"))?;
        let empty = || toml::Value::Table(toml::Table::new());
        at = table.entry(key.trim()).or_insert_with(empty);
        for place in places {
            let k = place.strip_suffix(']').and_then(|k| k.parse::<usize>().ok());
            let k = k.ok_or_else(|| wrong("a path like bodies[0].mass"))?;
            let list = at.as_array_mut().ok_or_else(|| wrong("a place of a list"))?;
            let length = list.len();
            at = list.get_mut(k).ok_or_else(|| {
                let key = format!("--set {path}");
                SimulateError::value(key, format!("a place below {length}"), k)
            })?;
        }
    }
    *at = value;
    Ok(())
}

impl<'de> Deserialize<'de> for ShapeOrName {
    fn deserialize<D: serde::Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = ShapeOrName;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("the name of a shape, or a table with its kind")
            }

            fn visit_str<E>(self, name: &str) -> Result<ShapeOrName, E> {
                Ok(ShapeOrName::Name(name.into()))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<ShapeOrName, A::Error> {
                ShapeTable::deserialize(MapAccessDeserializer::new(map)).map(ShapeOrName::Shape)
            }
        }
        from.deserialize_any(Either)
    }
}

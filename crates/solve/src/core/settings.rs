//! Settings: one struct gives parsing, defaults, ranges and documentation, of solvers and of scenes alike.

use schemars::JsonSchema;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Number, Value};

use crate::core::spelling::meant;

/// Settings by key, as they come from a command line or a file.
pub type SettingsMap = Map<String, Value>;

/// A struct of settings: typed, documented by its fields' comments, defaulted, unknown keys refused.
pub trait Settings: DeserializeOwned + Serialize + JsonSchema + Default {
    /// The ranges that types do not express. The message names the key, what is expected and what was found.
    fn validate(&self) -> Result<(), String> {
        Ok(())
    }
}

/// No settings: of what has nothing to choose.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NoSettings {}

impl Settings for NoSettings {}

/// One setting, as help texts show it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Setting {
    /// As it stands before the `=`.
    pub key: String,
    /// Its value where the user says nothing.
    pub default: Value,
    /// The names it may take, where it is a choice.
    pub choices: Vec<String>,
    /// What it does.
    pub help: String,
}

/// Reads `key=value` texts: the value as JSON where it is (numbers, true), as a plain string elsewhere.
pub fn from_texts<S: AsRef<str>>(texts: &[S]) -> Result<SettingsMap, String> {
    let mut map = SettingsMap::new();
    for text in texts {
        let text = text.as_ref();
        let (key, value) = text
            .split_once('=')
            .filter(|(key, _)| !key.trim().is_empty())
            .ok_or_else(|| format!("expected key=value, found `{text}`"))?;
        let (key, value) = (key.trim(), value.trim());
        let value = serde_json::from_str(value)
            .ok()
            // What a person types as a number is one: .5, 1., +3.
            .or_else(|| Some(Value::Number(Number::from_f64(value.parse().ok()?)?)))
            .unwrap_or_else(|| Value::String(value.into()));
        if map.insert(key.into(), value).is_some() {
            return Err(format!("`{key}` is set twice"));
        }
    }
    Ok(map)
}

/// The typed settings behind a map.
///
/// Errors: an unknown key, with those that exist; a value of the wrong type or out of range, by its key.
pub fn parse<S: Settings>(map: &SettingsMap) -> Result<S, String> {
    if map.is_empty() {
        return Ok(S::default());
    }
    let read = |map: &SettingsMap| serde_json::from_value::<S>(Value::Object(map.clone()));
    // The schema is made where there is something to correct or to explain: it costs as much as a small solve.
    let settings = match read(map) {
        Ok(settings) if are_all_of(map, serde_json::to_value(&settings)) => settings,
        _ => {
            let corrected = corrected(map, &described::<S>(), &|map| read(map).is_ok())?;
            read(&corrected).map_err(|e| e.to_string())?
        }
    };
    settings.validate()?;
    Ok(settings)
}

/// Whether all keys of a map are among those of some settings.
fn are_all_of(map: &SettingsMap, settings: serde_json::Result<Value>) -> bool {
    matches!(settings, Ok(Value::Object(all)) if map.keys().all(|key| all.contains_key(key)))
}

/// The map with whole numbers where these are due; `reads` says whether a map can be read.
///
/// Errors: the first key that is unknown or cannot be read.
fn corrected(
    map: &SettingsMap,
    known: &[Setting],
    reads: &dyn Fn(&SettingsMap) -> bool,
) -> Result<SettingsMap, String> {
    let mut map = map.clone();
    // One key at a time, so that the message can name the key at fault.
    for (key, value) in &mut map {
        let Some(setting) = known.iter().find(|s| s.key == *key) else {
            let keys: Vec<_> = known.iter().map(|s| s.key.as_str()).collect();
            let meant = meant(key, &keys);
            return Err(format!("unknown key `{key}`{meant}; there are: {}", keys.join(", ")));
        };
        // 1e3 where a whole number is due is that whole number.
        if let (true, Some(x)) = (setting.default.is_u64(), value.as_f64())
            && x.fract() == 0.0
            && (0.0..9e15).contains(&x)
        {
            *value = (x as u64).into();
        }
        let takes = |value: &Value| reads(&SettingsMap::from_iter([(key.clone(), value.clone())]));
        if !takes(value) {
            // Of a number that is whole, its type's upper end is what is missed.
            let whole = setting.default.is_u64()
                && value.as_f64().is_some_and(|x| x >= 0.0 && x.fract() == 0.0);
            let ends = [u64::MAX, u32::MAX.into(), u16::MAX.into(), u8::MAX.into()];
            let most = ends.into_iter().filter(|_| whole).find(|most| takes(&(*most).into()));
            let most = most.map_or_else(String::new, |most| format!(" and at most {most}"));
            return Err(format!("{key}: expected {}{most}, found {value}", setting.expected()));
        }
    }
    Ok(map)
}

impl Setting {
    /// What the value may be, in words.
    fn expected(&self) -> String {
        match &self.default {
            _ if !self.choices.is_empty() => format!("one of {}", self.choices.join(", ")),
            Value::Bool(_) => "true or false".into(),
            Value::Number(n) if n.is_u64() => "a whole number of at least 0".into(),
            Value::Number(_) => "a number".into(),
            _ => "text".into(),
        }
    }
}

/// The settings of `S` as its type documents them.
pub fn described<S: Settings>() -> Vec<Setting> {
    let defaults = serde_json::to_value(S::default()).unwrap_or_default();
    of_schema(&schemars::schema_for!(S), &defaults)
}

/// The properties of a schema, with their defaults.
fn of_schema(schema: &schemars::Schema, defaults: &Value) -> Vec<Setting> {
    let Some(properties) = schema.get("properties").and_then(Value::as_object) else {
        return vec![];
    };
    let text = |v: Option<&Value>| v.and_then(Value::as_str).unwrap_or_default().replace('\n', " ");
    properties
        .iter()
        .map(|(key, property)| Setting {
            key: key.clone(),
            default: defaults.get(key).cloned().unwrap_or_default(),
            choices: choices(schema, property),
            help: text(property.get("description")),
        })
        .collect()
}

/// The names of an enumeration, which a schema states as a reference to a `oneOf` of constants.
fn choices(schema: &schemars::Schema, property: &Value) -> Vec<String> {
    let reference = property.get("$ref").and_then(Value::as_str).unwrap_or_default();
    let Some(name) = reference.rsplit('/').next().filter(|n| !n.is_empty()) else {
        return vec![];
    };
    let definition = schema.get("$defs").and_then(|d| d.get(name));
    let list = |key: &str| definition.and_then(|d| d.get(key)).and_then(Value::as_array);
    let constants = list("oneOf").into_iter().flatten().filter_map(|one| one.get("const"));
    let plain = list("enum").into_iter().flatten();
    constants.chain(plain).filter_map(Value::as_str).map(str::to_owned).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_texts() {
        assert!(from_texts(&["omega"]).is_err() && from_texts(&["=1"]).is_err());
        assert!(from_texts(&["a=1", "a=2"]).unwrap_err().contains("twice"));
        let map = from_texts(&["a=1.5", "b=word", "c=true"]).unwrap();
        assert_eq!(map["a"], Value::from(1.5));
        assert_eq!((&map["b"], &map["c"]), (&Value::from("word"), &Value::from(true)));
        assert_eq!(from_texts(&["a=.5"]).unwrap()["a"], Value::from(0.5));
        let nsgs: crate::contact::splitting::Nsgs =
            parse(&from_texts(&["seed=1e3"]).unwrap()).unwrap();
        assert_eq!(nsgs.seed, 1000);
    }

    #[test]
    fn numbers_that_are_too_large_are_told_the_end() {
        let refused = |text: &str| {
            parse::<crate::contact::splitting::Nsgs>(&from_texts(&[text]).unwrap()).unwrap_err()
        };
        let end = "expected a whole number of at least 0 and at most 4294967295, found 5000000000";
        assert_eq!(refused("freeze_for=5000000000"), format!("freeze_for: {end}"));
        let sign = "expected a whole number of at least 0, found -1";
        assert_eq!(refused("freeze_for=-1"), format!("freeze_for: {sign}"));
    }
}

//! Suites: problems of scenes by the list.
//!
//! ```toml
//! [[problem]]
//! family = "wall"                      # a scene
//! name = "wall"                        # of the files; else the family and all settings given
//! form = ["local", "global"]           # or one of them; global if not given
//! settings = { rows = [4, 8], mu = 0.4, seed = [1, 2, 3] }
//! ```
//!
//! Lists expand to their product, the last setting first; what a list varies is part of the file's name, so this entry
//! makes `wall/wall-rows4-seed1-local.hdf5` and eleven more.

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use nonsmooth_scenes::SceneEntry;
use nonsmooth_solve::settings::SettingsMap;
use serde::Deserialize;
use serde_json::Value;

use super::scene::{Form, make, plain, summary};
use crate::{Exit, files, output};

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Suite {
    problem: Vec<Entry>,
}

/// One entry of a suite.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    family: String,
    name: Option<String>,
    form: Option<Value>,
    #[serde(default)]
    settings: SettingsMap,
}

/// One problem to make.
struct Planned {
    scene: &'static SceneEntry,
    name: String,
    form: Form,
    settings: SettingsMap,
}

/// Writes every problem that the suite in `file` lists below `folder`.
pub fn run(file: &Path, folder: &Path) -> Result<Exit, String> {
    let at = file.display();
    let text = fs::read_to_string(file)
        .map_err(|e| format!("--suite {at}: expected a TOML file, found: {e}"))?;
    let suite: Suite = toml::from_str(&text).map_err(|e| {
        let line = e.span().map_or(1, |s| 1 + text[..s.start].matches('\n').count());
        let message = e.message().replace('\n', " ");
        format!("--suite {at}, line {line}: {message}")
    })?;
    let mut planned = vec![];
    for (k, entry) in suite.problem.iter().enumerate() {
        let all = plan(entry);
        planned.extend(all.map_err(|e| format!("--suite {at}, problem {}: {e}", k + 1))?);
    }
    let mut seen = HashMap::new();
    for Planned { scene, name, .. } in &planned {
        if seen.insert((scene.name, name), ()).is_some() {
            return Err(format!(
                "--suite {at}: expected a name for each problem, found `{}/{name}` twice",
                scene.name
            ));
        }
    }
    for Planned { scene, name, form, settings } in &planned {
        let below = folder.join(scene.name);
        files::folder("--out", &below)?;
        let path = below.join(format!("{name}.hdf5"));
        files::writable("--out", &path)?;
        let (made, content) = make(scene, settings, *form)
            .map_err(|e| format!("--suite {at}, {}/{name}: {e}", scene.name))?;
        content.write(&path).map_err(|e| e.to_string())?;
        output::print(&summary(&path, &made, &content.problem));
    }
    Ok(Exit::Solved)
}

/// The problems of an entry: the product of its lists.
fn plan(entry: &Entry) -> Result<Vec<Planned>, String> {
    let scene = SceneEntry::find(&entry.family).map_err(|e| e.to_string())?;
    let base = entry.name.as_deref().unwrap_or(&entry.family);
    if base.is_empty() || base.contains(['/', '\\']) || base.starts_with('.') {
        return Err(format!("name: expected a file name without folder, found `{base}`"));
    }
    let mut all = vec![(base.to_string(), SettingsMap::new())];
    for (key, value) in &entry.settings {
        let (values, varies) = match value {
            Value::Array(values) => (values.as_slice(), true),
            one => (std::slice::from_ref(one), false),
        };
        if values.is_empty() {
            return Err(format!("{key}: expected a value or a list of some, found []"));
        }
        let told = varies || entry.name.is_none();
        let with = |(name, settings): &(String, SettingsMap), value: &Value| {
            let name = match value {
                _ if !told => name.clone(),
                // A word says by itself what it is.
                Value::String(word) => format!("{name}-{word}"),
                other => format!("{name}-{key}{}", plain(other)),
            };
            let mut settings = settings.clone();
            settings.insert(key.clone(), value.clone());
            (name, settings)
        };
        all = all.iter().flat_map(|one| values.iter().map(move |v| with(one, v))).collect();
    }
    let forms = forms(entry.form.as_ref())?;
    let with = |(name, settings): (String, SettingsMap)| {
        let one = move |&(form, suffix): &(Form, &str)| Planned {
            scene,
            name: format!("{name}{suffix}"),
            form,
            settings: settings.clone(),
        };
        forms.iter().map(one).collect::<Vec<_>>()
    };
    Ok(all.into_iter().flat_map(with).collect())
}

/// The forms of an entry, each with what it adds to the name of the file: nothing if it is the only one.
fn forms(stated: Option<&Value>) -> Result<Vec<(Form, &'static str)>, String> {
    let Some(stated) = stated else { return Ok(vec![(Form::Global, "")]) };
    let form = |value: &Value| match value.as_str() {
        Some("local") => Some((Form::Local, "-local")),
        Some("global") => Some((Form::Global, "-global")),
        _ => None,
    };
    let forms: Option<Vec<_>> = match stated {
        Value::Array(list) if !list.is_empty() => list.iter().map(form).collect(),
        one => form(one).map(|(form, _)| vec![(form, "")]),
    };
    forms.ok_or_else(|| format!("form: expected local, global or a list of them, found {stated}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(text: &str) -> Vec<String> {
        let suite: Suite = toml::from_str(text).unwrap();
        suite.problem.iter().flat_map(|e| plan(e).unwrap()).map(|p| p.name).collect()
    }

    #[test]
    fn lists_expand_to_their_product_and_name_the_files() {
        let entry = "[[problem]]\nfamily = \"stack\"\n";
        let settings = "settings = { count = [2, 3], mu = 0.5, seed = [1, 2] }\n";
        let all = names(&format!("{entry}name = \"s\"\n{settings}"));
        assert_eq!(all, ["s-count2-seed1", "s-count2-seed2", "s-count3-seed1", "s-count3-seed2"]);
        let all = names(&format!("{entry}settings = {{ count = 2, state = \"impact\" }}"));
        assert_eq!(all, ["stack-count2-impact"]);
        assert_eq!(
            names(&format!("{entry}form = [\"local\", \"global\"]")),
            ["stack-local", "stack-global"]
        );
        assert_eq!(names(&format!("{entry}form = \"local\"")), ["stack"]);
    }
}

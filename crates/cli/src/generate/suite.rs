//! Suites: problems of scenes and of complementarity by the list.
//!
//! ```toml
//! [[problem]]
//! family = "wall"                      # a scene, or a maker of complementarity problems
//! name = "wall"                        # of the files; else the family and all settings given
//! folder = "walls"                     # of the files; else the family
//! form = ["local", "global"]           # of a scene, or one of them; global if not given
//! settings = { rows = [4, 8], mu = 0.4, seed = [1, 2, 3] }
//! ```
//!
//! Lists expand to their product, the last setting first; what a list varies is part of the file's name, so this entry
//! makes `walls/wall-rows4-seed1-local.hdf5` and eleven more. Scenes are written as FCLIB's HDF5, complementarity problems as TOML.

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use nonsmooth_solve::settings::SettingsMap;
use serde::Deserialize;
use serde_json::Value;

use super::scene::{Form, plain};
use super::{Made, said};
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
    folder: Option<String>,
    form: Option<Value>,
    #[serde(default)]
    settings: SettingsMap,
}

/// One problem to make.
struct Planned {
    made: Made,
    folder: String,
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
    for Planned { folder, name, .. } in &planned {
        if seen.insert((folder, name), ()).is_some() {
            return Err(format!(
                "--suite {at}: expected a name for each problem, found `{folder}/{name}` twice"
            ));
        }
    }
    output::results_are_filed();
    for Planned { made, folder: family, name, form, settings } in &planned {
        let below = folder.join(family);
        files::folder("--out", &below)?;
        let path = below.join(format!("{name}.{}", made.extension()));
        files::writable("--out", &path)?;
        let (scene, content) = made
            .make(settings, *form)
            .map_err(|e| format!("--suite {at}, {family}/{name}: {e}"))?;
        content.write(&path).map_err(|e| e.to_string())?;
        output::print(&said(&path, scene.as_ref(), &content));
    }
    Ok(Exit::Solved)
}

/// The problems of an entry: the product of its lists.
fn plan(entry: &Entry) -> Result<Vec<Planned>, String> {
    let made = Made::find(&entry.family)?;
    let base = entry.name.as_deref().unwrap_or(&entry.family);
    let folder = entry.folder.as_deref().unwrap_or(&entry.family);
    for (key, name) in [("name", base), ("folder", folder)] {
        if name.is_empty() || name.contains(['/', '\\']) || name.starts_with('.') {
            return Err(format!("{key}: expected a name without folders, found `{name}`"));
        }
    }
    if let (Made::Complementarity(maker), Some(form)) = (made, &entry.form) {
        let name = maker.name;
        return Err(format!("form: expected one of a scene only, found {form} of {name}"));
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
            made,
            folder: folder.to_owned(),
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
        let linear = "[[problem]]\nfamily = \"lcp\"\nname = \"x\"\nfolder = \"psd\"\n";
        let all = names(&format!("{linear}settings = {{ class = \"psd\", n = [6, 12] }}"));
        assert_eq!(all, ["x-n6", "x-n12"]);
        let suite: Suite = toml::from_str(&format!("{linear}form = \"local\"")).unwrap();
        let Err(said) = plan(&suite.problem[0]) else { panic!("an LCP has no form") };
        assert!(said.contains("form: expected one of a scene only"), "{said}");
    }
}

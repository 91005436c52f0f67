//! The problem of a scene, as a file.

use std::path::Path;

use nonsmooth_io::{Info, ProblemFile};
use nonsmooth_problem::{AnyProblem, Problem};
use nonsmooth_scenes::{Scene, SceneEntry, SceneError};
use nonsmooth_solve::settings::{Setting, SettingsMap};
use serde_json::Value;

use crate::report;

/// How the problem is stated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Form {
    /// M v = H r + f
    Global,
    /// u = W r + q
    Local,
}

/// The scene and the file of its problem.
pub fn make(
    entry: &SceneEntry,
    settings: &SettingsMap,
    form: Form,
) -> Result<(Scene, ProblemFile), SceneError> {
    let scene = entry.make(settings)?;
    let mut content = ProblemFile::new(scene.stated(form == Form::Local)?);
    let by = |all: &str| {
        format!(
            "One Moreau-Jean time step of the scene `{}` ({}), by nonsmooth {}: {all}. SI units.",
            entry.name,
            entry.summary,
            env!("CARGO_PKG_VERSION"),
        )
    };
    let info = told(entry.name, settings, entry.settings(), by);
    content.info = Info { dofs: Some(scene.dofs()), ..info };
    Ok((scene, content))
}

/// What made the file, so that it can be made again: the settings given, and `by` what with all of them.
pub fn told(
    name: &str,
    given: &SettingsMap,
    settings: Vec<Setting>,
    by: impl FnOnce(&str) -> String,
) -> Info {
    let mut all: SettingsMap = settings.into_iter().map(|s| (s.key, s.default)).collect();
    all.extend(given.clone());
    Info {
        title: Some(format!("{name} {}", join(given)).trim_end().into()),
        description: Some(by(&join(&all))),
        ..Info::default()
    }
}

fn join(settings: &SettingsMap) -> String {
    let each = settings.iter().map(|(k, v)| format!("{k}={}", plain(v)));
    each.collect::<Vec<_>>().join(" ")
}

/// A value as it would be typed.
pub fn plain(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

/// What was made.
pub fn summary(label: &Path, scene: &Scene, problem: &AnyProblem) -> String {
    format!(
        "{}: {}, {} and {} ({})\n",
        label.display(),
        scene.name,
        match scene.bodies.len() + scene.solids.len() {
            1 => "1 body".into(),
            n => format!("{n} bodies"),
        },
        report::count(scene.contacts.len(), "contact"),
        problem.kind().name(),
    )
}

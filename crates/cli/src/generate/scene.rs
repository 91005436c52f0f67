//! The problem of a scene, as a file.

use std::path::Path;

use nonsmooth_io::fclib::{FclibFile, Info};
use nonsmooth_problem::Friction;
use nonsmooth_scenes::{Scene, SceneEntry, SceneError};
use nonsmooth_solve::settings::SettingsMap;
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
) -> Result<(Scene, FclibFile), SceneError> {
    let scene = entry.make(settings)?;
    let problem = match form {
        Form::Global => Friction::Global3(scene.problem()?),
        Form::Local => Friction::Local3(scene.condensed()?),
    };
    let mut content = FclibFile::new(problem);
    content.info = info(entry, settings, &scene);
    Ok((scene, content))
}

/// What made the file, so that it can be made again.
fn info(entry: &SceneEntry, settings: &SettingsMap, scene: &Scene) -> Info {
    let title = format!("{} {}", entry.name, join(settings));
    let mut all: SettingsMap = entry.settings().into_iter().map(|s| (s.key, s.default)).collect();
    all.extend(settings.clone());
    Info {
        title: Some(title.trim_end().into()),
        description: Some(format!(
            "One Moreau-Jean time step of the scene `{}` ({}), by nonsmooth {}: {}. SI units.",
            entry.name,
            entry.summary,
            env!("CARGO_PKG_VERSION"),
            join(&all)
        )),
        dofs: Some(scene.dofs()),
        ..Info::default()
    }
}

pub fn join(settings: &SettingsMap) -> String {
    let each = settings.iter().map(|(k, v)| format!("{k}={}", plain(v)));
    each.collect::<Vec<_>>().join(" ")
}

/// A value as it would be typed.
pub fn plain(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

/// What was made.
pub fn summary(label: &Path, scene: &Scene, problem: &Friction) -> String {
    format!(
        "{}: {}, {} and {} ({})\n",
        label.display(),
        scene.name,
        match scene.bodies.len() + scene.solids.len() {
            1 => "1 body".into(),
            n => format!("{n} bodies"),
        },
        report::count(problem.contacts(), "contact"),
        problem.kind().name(),
    )
}

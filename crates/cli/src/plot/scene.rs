//! A scene with what a solution says of its contacts, as an SVG or a page.

use std::path::Path;

use nonsmooth_problem::check::Motion;
use nonsmooth_problem::{AnyPoint, AnyStatus};
use nonsmooth_scenes::SceneError;
use nonsmooth_scenes::draw::{Answer, Drawing, Picture, Show, html, svg};

use crate::kinds::AnyVerdict;

/// What is to be seen well.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum View {
    /// Bodies, with an arrow for each impulse
    Bodies,
    /// Impulses as force chains, as wide as they are large, in front of pale bodies
    Forces,
}

/// The extensions of the pictures of scenes.
pub const EXTENSIONS: &[&str] = &["svg", "html"];

/// The picture with the impulses, velocities and statuses of a solution.
pub fn solved(
    picture: Picture,
    point: &AnyPoint,
    verdict: &AnyVerdict,
) -> Result<Picture, SceneError> {
    // A scene's problem is one of contacts.
    let motion = |status: &AnyStatus| match status {
        AnyStatus::Contact(contact) => Some(contact.status),
        AnyStatus::Row(_) | AnyStatus::Set(_) => None,
    };
    let motions: Vec<_> = verdict.statuses.iter().filter_map(motion).collect();
    // Where a limit had passed, nobody has counted.
    let motions = Some(&motions[..]).filter(|motions| !motions.is_empty());
    let r = match point {
        AnyPoint::Local(point) => &point.r,
        AnyPoint::Global(point) => &point.r,
        _ => return Ok(picture),
    };
    picture.with(&Answer { r, u: Some(&verdict.velocity), motions })
}

/// The text of the picture: a page where the file's name ends in .html, else an SVG.
pub fn drawn(picture: &Picture, path: &Path, view: Option<View>) -> Result<String, SceneError> {
    let count = |of| {
        let frames = picture.frames.iter();
        frames.flat_map(|f| &f.contacts).filter(|c| c.status == Some(of)).count()
    };
    let [open, stick, slip] = [Motion::Open, Motion::Stick, Motion::Slip].map(count);
    let caption = (open + stick + slip > 0)
        .then(|| format!("impulses: {stick} stick, {slip} slip; {open} open"));
    let show = view.map(|view| match view {
        View::Bodies => Show::Bodies,
        View::Forces => Show::Forces,
    });
    let drawing = Drawing { show, caption: caption.as_deref(), ..Drawing::default() };
    match path.extension() {
        Some(e) if e.eq_ignore_ascii_case("html") => html(picture, &drawing),
        _ => svg(picture, &drawing),
    }
}

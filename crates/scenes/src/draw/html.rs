//! A scene as a page: one HTML file that turns it in a browser, without a network.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use serde::Serialize;

use super::camera::View;
use super::chains::{Chain, chains};
use super::paper::{escape, hex};
use super::picture::{Picture, short_json};
use super::svg::{self, Drawing, shows_forces};
use crate::SceneError;

const PAGE: &str = include_str!("page/view.html");
pub(super) const STYLE: &str = include_str!("page/view.css");
const SCRIPT: &str = include_str!("page/view.js");
const THREE: &str = include_str!("page/three.module.min.js");
const CONTROLS: &str = include_str!("page/OrbitControls.js");
const COMMON: &str = include_str!("page/common.js");

/// What the script reads.
#[derive(Serialize)]
struct Data<'a> {
    picture: &'a Picture,
    /// Of each frame.
    chains: Vec<Vec<Chain>>,
    /// The mean radius of a body, by which arrows are long, m.
    size: f64,
    /// The radius of the widest chain, m.
    width: f64,
    /// Whether the page begins with the forces.
    forces: bool,
    view: View,
    colours: Colours,
}

/// What is drawn in which colour.
#[derive(Serialize)]
pub(super) struct Colours {
    bodies: Vec<String>,
    obstacle: String,
    edge: String,
    contact: String,
    open: String,
    stick: String,
    slip: String,
    velocity: String,
}

impl Default for Colours {
    fn default() -> Self {
        let motion = |m| hex(svg::motion_colour(m));
        let [open, stick, slip] = svg::MOTIONS.map(|m| motion(Some(m)));
        Self {
            bodies: svg::BODY.map(hex).to_vec(),
            obstacle: hex(svg::OBSTACLE),
            edge: svg::EDGE.into(),
            contact: motion(None),
            open,
            stick,
            slip,
            velocity: hex(svg::VELOCITY),
        }
    }
}

/// Draws a picture as a page of HTML that holds it whole, with three.js: to turn, to come near, to see through.
///
/// The page begins with the view and with the bodies or forces that `drawing` asks for; its width and marks follow the window.
///
/// Errors: those of [`svg`](super::svg()).
pub fn html(picture: &Picture, drawing: &Drawing) -> Result<String, SceneError> {
    drawing.validate(picture)?;
    let size = svg::body_size(picture);
    let data = Data {
        picture,
        chains: picture.frames.iter().map(|frame| chains(picture, frame)).collect(),
        size,
        width: (0.15 * size).min(0.8 * svg::body_thickness(picture)),
        forces: shows_forces(picture, drawing),
        view: drawing.view,
        colours: Colours::default(),
    };
    let title = escape(&picture.name);
    Ok(filled(PAGE, &title, &short_json(&data), STYLE, SCRIPT))
}

/// A page with its parts in their places, each between `{{` and `}}`: title (as HTML), data (JSON), style, libraries and script.
pub(super) fn filled(page: &str, title: &str, data: &str, style: &str, script: &str) -> String {
    let address =
        |script: &str| format!("data:text/javascript;base64,{}", BASE64_STANDARD.encode(script));
    let mut out = String::with_capacity(2 * THREE.len() + data.len());
    // Only the page itself is searched for places: what is put in may hold anything.
    let mut rest = page;
    while let Some((before, after)) = rest.split_once("{{") {
        let (place, after) = after.split_once("}}").expect("a place of the page is closed");
        out += before;
        match place {
            "title" => out += title,
            "generator" => out += concat!("nonsmooth ", env!("CARGO_PKG_VERSION")),
            "style" => out += style,
            // In JSON `<` stands in texts only; without it nothing can end the element.
            "data" => out += &data.replace('<', "\\u003c"),
            "three" => out += &address(THREE),
            "controls" => out += &address(CONTROLS),
            "common" => out += &address(COMMON),
            "script" => out += script,
            _ => unreachable!("a place of the page that nothing fills: {place}"),
        }
        rest = after;
    }
    out + rest
}

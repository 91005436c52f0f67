//! Scenes as pictures: what is drawn ([`Picture`]), as a standalone SVG in perspective ([`svg`]) and as a page that can be turned ([`html`]). Motion is a page that plays it ([`playback`]).

mod camera;
mod chains;
mod ground;
mod html;
mod order;
mod paper;
mod picture;
pub mod playback;
mod surface;
mod svg;

pub use camera::View;
pub use html::html;
pub use picture::{Answer, Body, Frame, Part, Picture, Pose, Touch};
pub use svg::{Drawing, Show, svg};

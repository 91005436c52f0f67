//! Force chains: each impulse as a line through the bodies that it presses on, as wide as it is large.

use std::collections::HashSet;

use super::picture::{Body, Frame, Picture, Touch};
use crate::vec3::{Vec3, add, dot, norm, scale, sub};

/// The line of one contact.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub(super) struct Chain {
    /// The contact.
    pub contact: usize,
    /// The size of its impulse, N·s.
    pub size: f64,
    /// From the contact into b, and into a where that is no ground.
    pub segments: Vec<[Vec3; 2]>,
}

/// Bodies that touch more others than this on average are grains, however they are shaped.
const JOINTS: f64 = 6.0;
/// A body is compact where its distance from face to centre is at least this share of its radius.
const COMPACT: f64 = 0.25;

/// The chains of a frame. Impulses below a thousandth of the largest, which nobody would see, have none.
///
/// In a grain the line leads to the centre, so that it goes on from contact to contact, as granular matter is drawn. In any other body, a block or a
/// plank between a few joints, it follows the impulse until it is beside the centre, as lines of thrust are drawn: to the centre
/// the contacts of a joint would make a star.
pub(super) fn chains(picture: &Picture, frame: &Frame) -> Vec<Chain> {
    let grains = grains(picture, frame);
    let of = |(contact, touch): (usize, &Touch)| {
        let impulse = touch.impulse()?;
        let size = norm(impulse);
        let into = |k: usize, from: Vec3| {
            let to = sub(frame.poses[k].position, from);
            let along = match grains[k] || size == 0.0 {
                true => to,
                false => scale(dot(to, impulse) / (size * size), impulse),
            };
            [from, add(from, along)]
        };
        let a = touch.a.map(|a| into(a, sub(touch.point, touch.offset)));
        let segments = [Some(into(touch.b, touch.point)), a].into_iter().flatten().collect();
        Some(Chain { contact, size, segments })
    };
    let mut all: Vec<Chain> = frame.contacts.iter().enumerate().filter_map(of).collect();
    let largest = all.iter().map(|c| c.size).fold(0.0, f64::max);
    all.retain(|c| c.size > 1e-3 * largest);
    all
}

/// Which bodies are grains: balls, and compact bodies where bodies touch many others.
fn grains(picture: &Picture, frame: &Frame) -> Vec<bool> {
    let pairs: HashSet<_> = frame.contacts.iter().map(|c| (c.a, c.b)).collect();
    let sides: usize = pairs.iter().map(|(a, _)| 1 + usize::from(a.is_some())).sum();
    let moving = picture.bodies.iter().filter(|b| !b.fixed).count();
    let granular = sides as f64 > JOINTS * moving as f64;
    let compact = |body: &Body| body.inner_radius() > COMPACT * body.radius();
    picture.bodies.iter().map(|body| body.is_ball() || (granular && compact(body))).collect()
}

//! What touches at a contact, in the frames of the two bodies: so that normal and point can be had wherever the bodies are.

use nonsmooth_scenes::vec3::{Vec3, add, cross, dot, norm, scale, sub};
use serde::{Deserialize, Serialize};

use crate::detect::segments::{Segment, closest};
use crate::rotation::Pose;

/// Which features of which shapes touch; the same key in the next step is the same contact.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize,
)]
pub struct Key {
    /// The first shape, counted through all bodies.
    pub shape_a: u32,
    /// The second shape, a later one.
    pub shape_b: u32,
    /// The feature of the first shape: a vertex, an edge or a face with its number, or 0 where it is curved.
    pub feature_a: u32,
    /// The feature of the second shape.
    pub feature_b: u32,
}

/// A feature as a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Feature {
    Curved(u32),
    Vertex(u32),
    Edge(u32),
    Face(u32),
}

impl Feature {
    pub fn code(self) -> u32 {
        match self {
            Feature::Curved(k) => k,
            Feature::Vertex(k) => 1 << 29 | k,
            Feature::Edge(k) => 2 << 29 | k,
            Feature::Face(k) => 3 << 29 | k,
        }
    }
}

/// On which body the point of a contact stays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Anchor {
    /// On the one that touches the face: a vertex of it.
    Other,
    /// On that of the face: a corner of the face.
    Face,
    /// On both: where two edges cross.
    Both,
}

/// The geometry of a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Witness {
    /// A plane face with the outward `normal` of one body, and a point of the other, rounded with `radius`.
    Face {
        on_a: bool,
        normal: Vec3,
        /// The point of the other body, in its frame.
        other: Vec3,
        /// The point of the face below it, in the frame of the face.
        foot: Vec3,
        radius: f64,
        anchor: Anchor,
    },
    /// Two rounded segments, each in the frame of its body.
    Rounds { s: Segment, s_radius: f64, t: Segment, t_radius: f64 },
    /// Two crossing edges; `sign` makes the product of their directions point from a to b.
    Edges { s: Segment, t: Segment, sign: f64 },
}

/// Where a contact is: `normal` from a to b, `point` midway between the two surfaces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Place {
    pub normal: Vec3,
    pub point: Vec3,
    pub gap: f64,
}

/// What a direction turns with must be larger than this share of its parts; else the contact has no direction of its own.
const DEGENERATE: f64 = 1e-12;

impl Segment {
    pub(crate) fn placed(&self, pose: &Pose) -> Segment {
        Segment { p: pose.point(self.p), d: pose.direction(self.d) }
    }
}

impl Witness {
    /// Where the contact is with the bodies at these poses; `normal` is that to fall back on where the bodies leave none.
    pub fn place(&self, a: &Pose, b: &Pose, normal: Vec3) -> Place {
        match self {
            Witness::Face { on_a, normal, other, foot, radius, anchor } => {
                let (face, rest, sign) = if *on_a { (a, b, 1.0) } else { (b, a, -1.0) };
                let n = face.direction(*normal);
                let (q, f) = (rest.point(*other), face.point(*foot));
                let gap = dot(n, sub(q, f)) - radius;
                let half = 0.5 * gap;
                let point = match anchor {
                    Anchor::Other => sub(q, scale(radius + half, n)),
                    Anchor::Face => add(f, scale(half, n)),
                    Anchor::Both => scale(0.5, add(q, f)),
                };
                Place { normal: scale(sign, n), point, gap }
            }
            Witness::Rounds { s, s_radius, t, t_radius } => {
                let (s, t) = (s.placed(a), t.placed(b));
                let (x, y) = closest(&s, &t);
                let (p, q) = (s.at(x), t.at(y));
                let d = sub(q, p);
                let distance = norm(d);
                let n = match distance > DEGENERATE * (s_radius + t_radius) {
                    true => scale(1.0 / distance, d),
                    false => normal,
                };
                let gap = distance - s_radius - t_radius;
                Place { normal: n, point: add(p, scale(s_radius + 0.5 * gap, n)), gap }
            }
            Witness::Edges { s, t, sign } => {
                let (s, t) = (s.placed(a), t.placed(b));
                let product = cross(s.d, t.d);
                let length = norm(product);
                let n = match length > DEGENERATE * norm(s.d) * norm(t.d) {
                    true => scale(sign / length, product),
                    false => normal,
                };
                let (x, y) = closest(&s, &t);
                let (p, q) = (s.at(x), t.at(y));
                Place { normal: n, point: scale(0.5, add(p, q)), gap: dot(n, sub(q, p)) }
            }
        }
    }
}

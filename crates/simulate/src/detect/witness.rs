//! What touches at a contact, in the frames of the two bodies: so that normal and point can be had wherever the bodies are.

use nonsmooth_scenes::vec3::{Vec3, add, cross, dot, norm, scale, sub};
use serde::{Deserialize, Serialize};

use crate::detect::segments::{Segment, closest};
use crate::detect::turned::beside;
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
    /// In a [periodic](crate::Periodic) world which image of the first shape touches, in numbers of the periods.
    #[serde(default)]
    pub image: [i32; 3],
    /// The feature of the first shape: a vertex, an edge or a face with its number, or 0 where it is curved.
    pub feature_a: u32,
    /// The feature of the second shape.
    pub feature_b: u32,
}

impl Key {
    /// The two shapes.
    pub(crate) fn pair(&self) -> (u32, u32) {
        (self.shape_a, self.shape_b)
    }
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
    /// A plane with the outward `normal` of one body, through `foot`, and that point of a circle of the other which is lowest above it. `side` is the
    /// direction from the centre where no point is lowest.
    Rim { on_a: bool, normal: Vec3, foot: Vec3, centre: Vec3, axis: Vec3, side: Vec3, radius: f64 },
    /// A line of the half plane (ρ, z) about an axis of one body, which is a surface of revolution, and a ball of the other.
    Revolved {
        on_a: bool,
        centre: Vec3,
        axis: Vec3,
        side: Vec3,
        line: [[f64; 2]; 2],
        ball: Vec3,
        radius: f64,
    },
    /// Two points, and the `normal` from a to b, in the frame of one of them: where curved surfaces meet edges or each other, to first order.
    Points { s: Vec3, t: Vec3, normal: Vec3, on_a: bool },
    /// Two crossing edges; `sign` makes the product of their directions point from a to b.
    Edges { s: Segment, t: Segment, sign: f64 },
}

/// Where a contact is: `normal` from a to b, `point` midway between the two surfaces.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Place {
    pub normal: Vec3,
    pub point: Vec3,
    pub gap: f64,
}

/// The lowest point of a rim runs along it in a step by angles with larger cosines.
const FOLLOWED: f64 = 0.7;

/// What a direction turns with must be larger than this share of its parts; else the contact has no direction of its own.
const DEGENERATE: f64 = 1e-12;

impl Segment {
    pub(crate) fn placed(&self, pose: &Pose) -> Segment {
        Segment { p: pose.point(self.p), d: pose.direction(self.d) }
    }
}

impl Witness {
    /// The same contact with its bodies named the other way round.
    pub fn swapped(self) -> Self {
        match self {
            Witness::Face { on_a, normal, other, foot, radius, anchor } => {
                Witness::Face { on_a: !on_a, normal, other, foot, radius, anchor }
            }
            Witness::Rounds { s, s_radius, t, t_radius } => {
                Witness::Rounds { s: t, s_radius: t_radius, t: s, t_radius: s_radius }
            }
            Witness::Rim { on_a, normal, foot, centre, axis, side, radius } => {
                Witness::Rim { on_a: !on_a, normal, foot, centre, axis, side, radius }
            }
            Witness::Revolved { on_a, centre, axis, side, line, ball, radius } => {
                Witness::Revolved { on_a: !on_a, centre, axis, side, line, ball, radius }
            }
            Witness::Points { s, t, normal, on_a } => {
                Witness::Points { s: t, t: s, normal: scale(-1.0, normal), on_a: !on_a }
            }
            // Both the product of the edges and the normal turn about.
            Witness::Edges { s, t, sign } => Witness::Edges { s: t, t: s, sign },
        }
    }

    /// Where the contact is with the bodies at these poses; `normal` is that to fall back on where the bodies leave none.
    pub fn place(&self, a: &Pose, b: &Pose, normal: Vec3) -> Place {
        self.within(None, a, b, normal)
    }

    /// The same in the course of a step that began with the bodies at `start`, where the contact was found.
    ///
    /// The lowest point of a rim runs round it while a body rolls or wobbles. Where an end turns past level it jumps across: an impulse on one side, and the law
    /// for velocities on the other, make energy of nothing. So where it does not run but jumps, the rim touches where it did, in space.
    pub fn moved(&self, start: [&Pose; 2], a: &Pose, b: &Pose, normal: Vec3) -> Place {
        self.within(Some(start), a, b, normal)
    }

    fn within(&self, start: Option<[&Pose; 2]>, a: &Pose, b: &Pose, normal: Vec3) -> Place {
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
            Witness::Rim { on_a, normal, foot, centre, axis, side, radius } => {
                let (face, rest, sign) = if *on_a { (a, b, 1.0) } else { (b, a, -1.0) };
                let n = face.direction(*normal);
                let axis = rest.direction(*axis);
                let across = |d: Vec3| sub(d, scale(dot(d, axis), axis));
                let down = across(scale(-1.0, n));
                let held = start.map_or(rest, |s| s[usize::from(*on_a)]).direction(*side);
                let held = across(held);
                let jumps = start.is_some() && dot(down, held) < FOLLOWED * norm(down) * norm(held);
                let out = if norm(down) > DEGENERATE && !jumps { down } else { held };
                let out = scale(1.0 / norm(out), out);
                let p = add(rest.point(*centre), scale(*radius, out));
                let gap = dot(n, sub(p, face.point(*foot)));
                Place { normal: scale(sign, n), point: sub(p, scale(0.5 * gap, n)), gap }
            }
            Witness::Revolved { on_a, centre, axis, side, line, ball, radius } => {
                let (solid, rest, sign) = if *on_a { (a, b, 1.0) } else { (b, a, -1.0) };
                let (axis, x) = (solid.direction(*axis), rest.point(*ball));
                let d = sub(x, solid.point(*centre));
                let z = dot(d, axis);
                let across = sub(d, scale(z, axis));
                let rho = norm(across);
                let out = match rho > DEGENERATE * norm(d) {
                    true => scale(1.0 / rho, across),
                    false => solid.direction(*side),
                };
                let (distance, [radial, axial]) = beside(line, [rho, z]);
                let n = add(scale(radial, out), scale(axial, axis));
                let gap = distance - radius;
                let point = sub(x, scale(radius + 0.5 * gap, n));
                Place { normal: scale(sign, n), point, gap }
            }
            Witness::Points { s, t, normal, on_a } => {
                let n = if *on_a { a.direction(*normal) } else { b.direction(*normal) };
                let (p, q) = (a.point(*s), b.point(*t));
                Place { normal: n, point: scale(0.5, add(p, q)), gap: dot(n, sub(q, p)) }
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

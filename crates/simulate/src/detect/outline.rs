//! Convex polygons in the plane, with each other, with discs and with rounded segments.
//!
//! A rounded segment is a polygon of two sides with a radius. The axes that may separate two polygons are the normals of their sides; that which separates most, with
//! hysteresis, has its side clip the side of the other one that looks against it most. Where round corners face each other the two corners touch instead. At most
//! two points. Cost: sides × corners.

use nonsmooth_scenes::vec3::{Vec3, add, dot, norm, scale, sub};

use crate::detect::hull::PosedHull;
use crate::detect::segments::{Segment, closest};
use crate::detect::witness::{Anchor, Feature, Witness};
use crate::rotation::Pose;
use crate::state::Axis;

/// By which share of the size another side must be better than that of the last step.
const HYSTERESIS: f64 = 1e-4;
/// By which share of the size the sides of the second must separate better to be taken at first sight.
const FIRST: f64 = 1e-6;
/// A corner outside an end by no more than this share of the size is inside.
const INSIDE: f64 = 1e-9;
/// Corners nearer to each other than this share of the size are one.
const SAME: f64 = 1e-6;

/// A convex polygon in the frame of its body. Side k begins at corner k.
#[derive(Debug, Clone)]
pub(crate) struct Outline {
    pub vertices: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    /// The largest distance of a corner from the mean of all.
    pub size: f64,
}

/// The normals of the sides.
fn normals(vertices: &[Vec3]) -> impl Iterator<Item = Vec3> + '_ {
    (0..vertices.len()).map(|k| {
        let [x, y, _] = sub(vertices[(k + 1) % vertices.len()], vertices[k]);
        let length = x.hypot(y);
        [y / length, -x / length, 0.0]
    })
}

impl Outline {
    /// Of the corners of a polygon, counterclockwise.
    pub fn new(vertices: Vec<Vec3>) -> Self {
        let sum = vertices.iter().fold([0.0; 3], |s, &v| add(s, v));
        let centre = scale(1.0 / vertices.len() as f64, sum);
        let size = vertices.iter().map(|&v| norm(sub(v, centre))).fold(0.0, f64::max);
        Self { normals: normals(&vertices).collect(), vertices, size }
    }
}

impl PosedHull {
    /// Where a polygon is.
    pub fn set_outline(&mut self, outline: &Outline, pose: &Pose) {
        self.vertices.clear();
        self.vertices.extend(outline.vertices.iter().map(|&v| pose.point(v)));
        self.normals.clear();
        self.normals.extend(outline.normals.iter().map(|&n| pose.direction(n)));
    }
}

/// A polygon or rounded segment with its body: corners and normals in the frame of that, and where they are.
#[derive(Clone, Copy)]
pub(crate) struct Flat<'a> {
    local: &'a [Vec3],
    normals: &'a [Vec3],
    corners: &'a [Vec3],
    turned: &'a [Vec3],
    radius: f64,
    size: f64,
    pose: &'a Pose,
}

impl<'a> Flat<'a> {
    pub fn of(outline: &'a Outline, posed: &'a PosedHull, pose: &'a Pose) -> Self {
        Self {
            local: &outline.vertices,
            normals: &outline.normals,
            corners: &posed.vertices,
            turned: &posed.normals,
            radius: 0.0,
            size: outline.size,
            pose,
        }
    }

    fn count(&self) -> usize {
        self.local.len()
    }

    fn side(&self, k: usize) -> [Vec3; 2] {
        [self.corners[k], self.corners[(k + 1) % self.count()]]
    }

    /// How far the other one is in front of side k.
    fn separation(&self, k: usize, other: &Self) -> f64 {
        let n = self.turned[k];
        let least = other.corners.iter().map(|&v| dot(n, v)).fold(f64::INFINITY, f64::min);
        least - dot(n, self.corners[k]) - self.radius - other.radius
    }

    /// The side that the other one is farthest in front of.
    fn deepest(&self, other: &Self) -> (usize, f64) {
        let mut best = (0, f64::NEG_INFINITY);
        for k in 0..self.count() {
            let now = self.separation(k, other);
            if now > best.1 {
                best = (k, now);
            }
        }
        best
    }

    /// The side that looks most against a direction.
    fn facing(&self, n: Vec3) -> usize {
        let against = |k: &usize| dot(self.turned[*k], n);
        let all = 0..self.count();
        all.min_by(|i, j| against(i).total_cmp(&against(j))).unwrap_or(0)
    }
}

/// A rounded segment as a polygon of two sides.
pub(crate) struct Rod<'a> {
    local: [Vec3; 2],
    normals: [Vec3; 2],
    corners: [Vec3; 2],
    turned: [Vec3; 2],
    radius: f64,
    pose: &'a Pose,
}

impl<'a> Rod<'a> {
    pub fn new(segment: &Segment, radius: f64, pose: &'a Pose) -> Self {
        let local = [segment.p, segment.at(1.0)];
        let mut n = [[0.0; 3]; 2];
        normals(&local).zip(&mut n).for_each(|(n, to)| *to = n);
        let corners = local.map(|v| pose.point(v));
        Self { local, normals: n, corners, turned: n.map(|n| pose.direction(n)), radius, pose }
    }

    pub fn flat(&self) -> Flat<'_> {
        Flat {
            local: &self.local,
            normals: &self.normals,
            corners: &self.corners,
            turned: &self.turned,
            radius: self.radius,
            size: 0.5 * norm(sub(self.local[1], self.local[0])) + self.radius,
            pose: self.pose,
        }
    }
}

/// All points where a and b are nearer to each other than `prediction`; returns the side that separates them most, none where they are farther apart.
pub(crate) fn collide(
    a: &Flat,
    b: &Flat,
    last: Option<Axis>,
    prediction: f64,
    mut found: impl FnMut([Feature; 2], Witness),
) -> Option<Axis> {
    let size = a.size.min(b.size);
    let (mut side_a, mut best_a) = a.deepest(b);
    let (mut side_b, mut best_b) = b.deepest(a);
    if best_a.max(best_b) > prediction {
        return None;
    }
    // The side of the last step stays where it is nearly as good.
    let enough = best_a.max(best_b) - HYSTERESIS * size;
    match last {
        Some(Axis::FaceA(k)) if (k as usize) < a.count() => {
            let now = a.separation(k as usize, b);
            if now > enough {
                (side_a, best_a, best_b) = (k as usize, now, f64::NEG_INFINITY);
            }
        }
        Some(Axis::FaceB(k)) if (k as usize) < b.count() => {
            let now = b.separation(k as usize, a);
            if now > enough {
                (side_b, best_b, best_a) = (k as usize, now, f64::NEG_INFINITY);
            }
        }
        _ => {}
    }
    let by_a = best_a >= best_b - FIRST * size;
    let (reference, incident, side) = if by_a { (a, b, side_a) } else { (b, a, side_b) };
    let other = incident.facing(reference.turned[side]);
    let axis = if by_a { Axis::FaceA(side as u32) } else { Axis::FaceB(side as u32) };
    if a.radius + b.radius > 0.0
        && let Some([i, j]) = corners_face(reference, incident, (side, other))
    {
        let (i, j) = if by_a { (i, j) } else { (j, i) };
        let point = |flat: &Flat, k: usize| Segment::point(flat.local[k]);
        let (s, t) = (point(a, i), point(b, j));
        let features = [Feature::Vertex(i as u32), Feature::Vertex(j as u32)];
        found(features, Witness::Rounds { s, s_radius: a.radius, t, t_radius: b.radius });
        return Some(axis);
    }
    clip(reference, incident, (side, other), by_a, prediction, found);
    Some(axis)
}

/// The corners of two sides that are nearest to each other, where both are corners and apart.
fn corners_face(
    reference: &Flat,
    incident: &Flat,
    (side, other): (usize, usize),
) -> Option<[usize; 2]> {
    let [p, q] = reference.side(side);
    let [r, s] = incident.side(other);
    let (first, second) = (Segment::between(p, q), Segment::between(r, s));
    let n = reference.turned[side];
    // Above the side, or not at all: what lies beside it is not in front of it.
    let (x, y) = closest(&first, &second);
    let d = sub(second.at(y), first.at(x));
    let at_end = |x: f64| x == 0.0 || x == 1.0;
    if !at_end(x) || !at_end(y) || dot(n, d) <= 0.0 {
        return None;
    }
    // Beyond the end: a corner above the side itself is met along its normal.
    let t = scale(1.0 / norm(first.d), first.d);
    let beyond = if x == 0.0 { -dot(t, d) } else { dot(t, d) };
    if beyond <= INSIDE * reference.size.min(incident.size) {
        return None;
    }
    let corner = |k: usize, x: f64, flat: &Flat| (k + usize::from(x == 1.0)) % flat.count();
    Some([corner(side, x, reference), corner(other, y, incident)])
}

/// The part of the incident side above the reference side, by its ends.
fn clip(
    reference: &Flat,
    incident: &Flat,
    (side, other): (usize, usize),
    by_a: bool,
    prediction: f64,
    mut found: impl FnMut([Feature; 2], Witness),
) {
    let n = reference.turned[side];
    let [p, q] = reference.side(side);
    let t = [-n[1], n[0], 0.0];
    let (low, high) = (dot(t, p), dot(t, q));
    let size = reference.size.min(incident.size);
    let inside = INSIDE * size;
    let ends = incident.side(other);
    let places = ends.map(|v| dot(t, v));
    // Sides that face each other run against each other.
    let (from, to) = if places[0] > places[1] { (1, 0) } else { (0, 1) };
    let length = places[to] - places[from];
    let number = |k: usize| ((other + k) % incident.count()) as u32;
    let count = reference.count();
    let mut points: [Option<(Vec3, Feature, Feature)>; 2] = [None; 2];
    // Below: the corner of the incident side, or where it passes the end of the reference side.
    for (k, (end, bound, corner)) in
        [(from, low, side), (to, high, (side + 1) % count)].into_iter().enumerate()
    {
        let beyond = if k == 0 { bound - places[end] } else { places[end] - bound };
        points[k] = if beyond <= inside {
            let within =
                if k == 0 { places[end] <= high + inside } else { places[end] >= low - inside };
            within.then(|| (ends[end], Feature::Face(side as u32), Feature::Vertex(number(end))))
        } else {
            let x = beyond / length;
            let rest = sub(ends[1 - end], ends[end]);
            (x < 1.0).then(|| {
                let point = add(ends[end], scale(x, rest));
                (point, Feature::Vertex(corner as u32), Feature::Face(other as u32))
            })
        };
    }
    if let [Some(first), Some(second)] = &points
        && dot(t, sub(second.0, first.0)) <= SAME * size
    {
        // A side seen from its end: the point that is deeper, which has the name of a corner where both are as deep.
        let lower = dot(n, second.0) < dot(n, first.0);
        points[usize::from(!lower)] = None;
    }
    let offset = dot(n, p) + reference.radius;
    for (point, of_reference, of_incident) in points.into_iter().flatten() {
        let distance = dot(n, point) - offset;
        if distance - incident.radius > prediction {
            continue;
        }
        let anchor =
            if matches!(of_reference, Feature::Vertex(_)) { Anchor::Face } else { Anchor::Other };
        let witness = Witness::Face {
            on_a: by_a,
            normal: reference.normals[side],
            other: incident.pose.local_point(point),
            foot: reference.pose.local_point(sub(point, scale(distance, n))),
            radius: incident.radius,
            anchor,
        };
        let pair = [of_reference, of_incident];
        found(if by_a { pair } else { [pair[1], pair[0]] }, witness);
    }
}

/// A disc, its centre in the frame of its body and where it is, and a polygon: at most one contact. The side that the centre is farthest in front of is the
/// nearest one, or begins or ends at the nearest corner.
pub(crate) fn disc(
    (centre, at, radius): (Vec3, Vec3, f64),
    flat: &Flat,
    flat_is_a: bool,
    prediction: f64,
    mut found: impl FnMut([Feature; 2], Witness),
) {
    let (mut side, mut most) = (0, f64::NEG_INFINITY);
    for k in 0..flat.count() {
        let d = dot(flat.turned[k], sub(at, flat.corners[k]));
        if d > most {
            (side, most) = (k, d);
        }
    }
    if most - radius > prediction {
        return;
    }
    let pair = |feature: Feature| {
        let curved = Feature::Curved(0);
        if flat_is_a { [feature, curved] } else { [curved, feature] }
    };
    let [p, q] = flat.side(side);
    let along = sub(q, p);
    let x = dot(sub(at, p), along) / dot(along, along);
    if most <= 0.0 || (0.0..=1.0).contains(&x) {
        let foot = flat.pose.local_point(sub(at, scale(most, flat.turned[side])));
        let (normal, anchor) = (flat.normals[side], Anchor::Other);
        let witness =
            Witness::Face { on_a: flat_is_a, normal, other: centre, foot, radius, anchor };
        return found(pair(Feature::Face(side as u32)), witness);
    }
    let corner = if x < 0.0 { side } else { (side + 1) % flat.count() };
    let (point, ball) = (Segment::point(flat.local[corner]), Segment::point(centre));
    let witness = match flat_is_a {
        true => Witness::Rounds { s: point, s_radius: 0.0, t: ball, t_radius: radius },
        false => Witness::Rounds { s: ball, s_radius: radius, t: point, t_radius: 0.0 },
    };
    found(pair(Feature::Vertex(corner as u32)), witness);
}

//! Two convex solids of which one at least is round: capsules with polyhedra, cylinders and cones with all.
//!
//! `sep(n) = min_{q ∈ B} n · q − max_{p ∈ A} n · p` is largest for the normal of the contact. Apart it is the distance, which [`gjk`](super::gjk) finds. Where the solids
//! overlap by d, B is moved off by `s > d` along the best normal known and the distance gives the next one: the fixed points are the local maxima of sep, found in one
//! step where surfaces are flat, and linearly with rate `s/(s + R − d)` where they have the radius R, which is extrapolated. It starts from the best of all flat faces, mantles and, where the
//! solids are apart by hardly more than rounding, the direction of the distance, which then is the answer mostly.
//!
//! Then the features say where: what lies on a flat face or end is clipped by it, whole; lines of mantles and edges meet at one point or, where they are parallel, at two; these have
//! closed forms. What is left (a rim at an edge, a cone at an edge or at another cone) is a pair of points with a normal, to first order in how far the bodies move in a step.
//! Cost: some tens of support points.

use nonsmooth_scenes::vec3::{Vec3, add, cross, dot, norm, scale, sub};

use crate::detect::gjk::{Closest, closest};
use crate::detect::hull::{Hull, PosedHull};
use crate::detect::rounds;
use crate::detect::segments::Segment;
use crate::detect::turned::{LEVEL, STANDING, Turned};
use crate::detect::witness::{Anchor, Feature, Witness};
use crate::rotation::Pose;

/// Nearer than this share of the size, the normal that the distance gives has the bodies' rounding in it, and is one of those to begin with.
const NEAR: f64 = 1e-4;
/// A normal that separates by no less than the distance less this share of it is that of the distance.
const SEPARATES: f64 = 1e-6;
/// By which share of the size the bodies are moved apart where they overlap.
const APART: f64 = 0.02;
/// Solids that overlap by more than this share of the size may do so in several directions.
const DEEP: f64 = 1e-3;
/// Steps of a climb at most.
const CLIMBS: usize = 30;
/// A climb whose steps shrink by a larger factor is extrapolated.
const SLOW: f64 = 0.3;
/// Normals that differ by less have converged.
const CONVERGED: f64 = 1e-13;
/// A flat face that separates worse by less than this share of the size gives the normal.
const FLAT: f64 = 1e-8;
/// A face whose normal differs by less than this is met as a whole.
const ALIGNED: f64 = 1e-6;
/// A line that is inclined by less than this is met as a whole.
const PARALLEL: f64 = 1e-3;
/// Points this share of its radius outside a rim are on it.
const SAME_RIM: f64 = 1e-9;
/// An end that is inclined by more stands on its lowest point alone.
const STANDS: f64 = 0.05;

/// One of the two solids, in the frame of its body and where it is.
#[derive(Clone, Copy)]
pub(crate) enum Side<'a> {
    Hull { hull: &'a Hull, posed: &'a PosedHull, pose: &'a Pose },
    Turned { local: &'a Turned, world: Turned, pose: &'a Pose },
    Rod { local: Segment, world: Segment, radius: f64, pose: &'a Pose },
}

/// A flat face, the end of a solid of revolution, or a half space.
pub(crate) struct Flat<'a> {
    pub feature: Feature,
    pub normal: Vec3,
    /// The normal in the frame of the body.
    pub local: Vec3,
    pub point: Vec3,
    pub pose: &'a Pose,
    pub extent: Extent<'a>,
}

pub(crate) enum Extent<'a> {
    All,
    Polygon {
        corners: &'a [u32],
        edges: &'a [u32],
        vertices: &'a [Vec3],
    },
    /// An end of a solid of revolution.
    Disc {
        solid: Turned,
        end: usize,
    },
}

/// What of a solid meets where no face does: a rounded line, or a point of a surface.
enum Core {
    Line { local: Segment, radius: f64, feature: Feature, inner: bool },
    Point,
}

/// The normal of a contact from the first to the second solid, and where they are nearest.
#[derive(Clone, Copy)]
pub(super) struct Meeting {
    pub normal: Vec3,
    pub separation: f64,
    pub on: [Vec3; 2],
}

/// All points where a and b are nearer to each other than `prediction`; whether they are, wherever.
pub(crate) fn collide(
    a: &Side,
    b: &Side,
    prediction: f64,
    mut found: impl FnMut([Feature; 2], Witness),
) -> bool {
    let reach = prediction + a.radius() + b.radius();
    let Some(meeting) = meeting(a, b, reach) else { return false };
    let n = meeting.normal;
    let (on_a, on_b) = (a.flat(n), b.flat(scale(-1.0, n)));
    match (&on_a, &on_b) {
        // A polygon rather than a disc: discs are clipped by it.
        (Some(flat), Some(Flat { extent: Extent::Disc { .. }, .. }) | None) => {
            on_flat(flat, true, b, prediction, &mut found);
        }
        (_, Some(flat)) => on_flat(flat, false, a, prediction, &mut found),
        (None, None) => beside(a, b, &meeting, &mut found),
    }
    true
}

/// Where `incident` is nearer than `prediction` to a face of the first body (`on_a`) or the second one.
pub(crate) fn on_flat(
    flat: &Flat,
    on_a: bool,
    incident: &Side,
    prediction: f64,
    found: &mut impl FnMut([Feature; 2], Witness),
) {
    let n = flat.normal;
    let height = |x: Vec3| dot(n, sub(x, flat.point));
    let foot = |x: Vec3| flat.pose.local_point(sub(x, scale(height(x), n)));
    let ordered = |reference: Feature, other: Feature| {
        if on_a { [reference, other] } else { [other, reference] }
    };
    let mut point = |reference: Feature, other: Feature, x: Vec3, radius: f64, anchor: Anchor| {
        if height(x) - radius <= prediction {
            let witness = Witness::Face {
                on_a,
                normal: flat.local,
                other: incident.pose().local_point(x),
                foot: foot(x),
                radius,
                anchor,
            };
            found(ordered(reference, other), witness);
        }
    };
    match incident {
        Side::Rod { world, radius, .. } => {
            let Some(ends) = flat.clip(world.p, add(world.p, world.d)) else { return };
            for (k, t, cut) in apart(ends) {
                let own = if t == f64::from(k) { k } else { 2 + k };
                point(cut, Feature::Curved(own), world.at(t), *radius, Anchor::Other);
            }
        }
        Side::Hull { hull, posed, .. } => {
            let face = posed.facing(hull, n);
            let (corners, edges) = (&hull.faces[face], &hull.face_edges[face]);
            for k in 0..corners.len() {
                let at = |i: usize| posed.vertices[corners[i % corners.len()] as usize];
                let (p, q) = (at(k), at(k + 1));
                let Some(ends) = flat.clip(p, q) else { continue };
                let d = sub(q, p);
                // Each corner with the edge that begins there.
                if ends[0].0 == 0.0 {
                    point(flat.feature, Feature::Vertex(corners[k]), p, 0.0, Anchor::Other);
                }
                for (t, cut) in ends.into_iter().filter(|e| e.0 > 0.0 && e.0 < 1.0) {
                    let x = add(p, scale(t, d));
                    point(cut, Feature::Edge(edges[k]), x, 0.0, Anchor::Both);
                }
            }
        }
        Side::Turned { local, world, pose } => {
            let down = scale(-1.0, n);
            for k in 0..2 {
                let radius = world.radii[k];
                let (_, sine) = world.across(n);
                let high = 2.0 * radius * sine;
                let stands = radius > 0.0
                    && dot(world.outwards(k), n) < 0.0
                    && sine <= STANDS
                    && high <= f64::max(prediction, 2.0 * PARALLEL * radius);
                if !stands {
                    continue;
                }
                for i in 0..STANDING {
                    let x = world.standing(k, i);
                    if flat.holds(x) {
                        point(flat.feature, standing(k, i), x, 0.0, Anchor::Other);
                    }
                }
                // Corners of the face below the end, and where its edges and the rim cross.
                let (centre, outwards) = (world.end(k), world.outwards(k));
                let onto = |x: Vec3| {
                    let along = dot(outwards, sub(centre, x)) / dot(outwards, n);
                    add(x, scale(along, n))
                };
                let below = Flat {
                    feature: Feature::Curved(4 + k as u32),
                    normal: outwards,
                    local: local.outwards(k),
                    point: centre,
                    pose,
                    extent: Extent::Disc { solid: *world, end: k },
                };
                flat.outline(|corner, edge, p, q| {
                    let Some(ends) = below.clip(onto(p), onto(q)) else { return };
                    let d = sub(q, p);
                    if ends[0].0 == 0.0 {
                        point(corner, below.feature, onto(p), 0.0, Anchor::Face);
                    }
                    for (t, cut) in ends.into_iter().filter(|e| e.0 > 0.0 && e.0 < 1.0) {
                        point(edge, cut, onto(add(p, scale(t, d))), 0.0, Anchor::Both);
                    }
                });
                if let Extent::Disc { solid: other, end } = &flat.extent {
                    // What the other end stands on has the name that it has with the ends the other way round. A point of both rims is taken from above.
                    let inside = radius * (1.0 - SAME_RIM);
                    for i in 0..STANDING {
                        let x = onto(other.standing(*end, i));
                        if norm(sub(x, centre)) < inside {
                            let face = Feature::Face(k as u32);
                            point(standing(*end, i), face, x, 0.0, Anchor::Face);
                        }
                    }
                    let rim = (other.end(*end), other.radii[*end]);
                    let both = crossings(flat.normal, rim, (onto(centre), radius));
                    for (end, x) in both.into_iter().flatten().enumerate() {
                        let own = Feature::Curved(6 + end as u32);
                        point(flat.feature, own, onto(x), 0.0, Anchor::Both);
                    }
                }
            }
            let (out, sine) = world.across(down);
            if sine < LEVEL {
                // A cone on its point.
                for k in (0..2).filter(|&k| world.radii[k] == 0.0) {
                    let x = world.end(k);
                    if flat.holds(x) {
                        point(flat.feature, Feature::Curved(k as u32), x, 0.0, Anchor::Other);
                    }
                }
                return;
            }
            // The lowest points of both rims, and of all circles between: a line of the mantle.
            let rim = |k: usize| add(world.end(k), scale(world.radii[k], out));
            let (p, q) = (rim(0), rim(1));
            let Some(ends) = flat.clip(p, q) else { return };
            for (k, t, cut) in apart(ends) {
                let x = add(p, scale(t, sub(q, p)));
                if height(x) > prediction {
                    continue;
                }
                let own = if t == f64::from(k) { k } else { 2 + k };
                let along = (2.0 * t - 1.0) * local.half;
                let witness = Witness::Rim {
                    on_a,
                    normal: flat.local,
                    foot: foot(x),
                    centre: add(local.centre, scale(along, local.axis)),
                    axis: local.axis,
                    side: pose.local_direction(out),
                    radius: (1.0 - t) * local.radii[0] + t * local.radii[1],
                };
                found(ordered(cut, Feature::Curved(own)), witness);
            }
        }
    }
}

/// The ends of an interval with their numbers, one where they are the same.
fn apart(ends: [(f64, Feature); 2]) -> impl Iterator<Item = (u32, f64, Feature)> {
    let count = if ends[1].0 - ends[0].0 > 1e-9 { 2 } else { 1 };
    ends.into_iter().enumerate().take(count).map(|(k, (t, cut))| (k as u32, t, cut))
}

/// The name of point i of those on which end k of a solid of revolution stands.
fn standing(k: usize, i: usize) -> Feature {
    Feature::Curved((8 + k * STANDING + i) as u32)
}

/// Where the boundaries of two discs in a plane with normal n cross.
fn crossings(n: Vec3, (p, r): (Vec3, f64), (q, s): (Vec3, f64)) -> Option<[Vec3; 2]> {
    let d = sub(q, p);
    let d = sub(d, scale(dot(d, n), n));
    let far = norm(d);
    if far <= (r - s).abs() || far >= r + s {
        return None;
    }
    let along = 0.5 * (far + (r - s) * (r + s) / far);
    let off = (r * r - along * along).max(0.0).sqrt();
    let (u, v) = (scale(1.0 / far, d), scale(1.0 / far, cross(n, d)));
    Some([-1.0, 1.0].map(|sign| add(p, add(scale(along, u), scale(sign * off, v)))))
}

/// Where lines and points meet.
fn beside(a: &Side, b: &Side, meeting: &Meeting, found: &mut impl FnMut([Feature; 2], Witness)) {
    let n = meeting.normal;
    let (p, q) = (a.core(n), b.core(scale(-1.0, n)));
    let points = |found: &mut dyn FnMut([Feature; 2], Witness), f: Feature, g: Feature| {
        let s = a.pose().local_point(add(meeting.on[0], scale(a.radius(), n)));
        let t = b.pose().local_point(sub(meeting.on[1], scale(b.radius(), n)));
        // The normal is of what is flatter, if anything is.
        let on_a = !matches!(b, Side::Hull { .. });
        let normal = if on_a { a.pose() } else { b.pose() }.local_direction(n);
        found([f, g], Witness::Points { s, t, normal, on_a });
    };
    let feature = |core: &Core| match core {
        Core::Line { feature, .. } => *feature,
        Core::Point => Feature::Curved(4),
    };
    let (f, g) = (feature(&p), feature(&q));
    let (
        Core::Line { local: s, radius: r, inner, .. },
        Core::Line { local: t, radius: o, inner: other, .. },
    ) = (&p, &q)
    else {
        return points(found, f, g);
    };
    // Lines have a distance only where they are apart: two edges, or the line of a rod that has sunk in, do not say on which side they are.
    let cylinders = [inner, other].into_iter().zip([r, o]).filter(|c| *c.0).map(|c| c.1);
    if *r + *o == 0.0 || meeting.separation + cylinders.sum::<f64>() <= 0.0 {
        return points(found, f, g);
    }
    // Beyond its ends the mantle of a cylinder is none.
    let (u, v) = (s.placed(a.pose()), t.placed(b.pose()));
    let (x, y) = crate::detect::segments::closest(&u, &v);
    let within = |inner: bool, x: f64| !inner || (x > 0.0 && x < 1.0);
    if !within(*inner, x) || !within(*other, y) {
        let turned = norm(cross(u.d, v.d)) < PARALLEL * dot(u.d, v.d).abs();
        if !turned {
            return points(found, f, g);
        }
    }
    rounds::rounds((*s, *r, a.pose()), (*t, *o, b.pose()), |[k, _], witness| {
        // One of two points of parallel lines, or the only one.
        let curved = |feature: Feature| match feature {
            Feature::Curved(_) => k,
            other => other,
        };
        let pair = [curved(f), curved(g)];
        let code = if matches!(k, Feature::Curved(2)) { [pair[0], second(pair[1])] } else { pair };
        found(code, witness);
    });
}

/// Another name for the second point on one feature.
fn second(feature: Feature) -> Feature {
    match feature {
        Feature::Vertex(k) | Feature::Edge(k) | Feature::Face(k) => Feature::Curved(1 << 20 | k),
        curved => curved,
    }
}

/// The normal that separates most; none where the solids are farther apart than `reach`.
fn meeting(a: &Side, b: &Side, reach: f64) -> Option<Meeting> {
    let size = a.size().min(b.size());
    let start = sub(b.middle(), a.middle());
    let start = if norm(start) > 0.0 { start } else { [0.0, 0.0, 1.0] };
    let near = closest(|d| a.support(d), |d| b.support(d), start, size);
    let of = |c: &Closest| Meeting { normal: c.normal, separation: c.distance, on: c.on };
    match near {
        Some(c) if c.distance > reach => return None,
        Some(c) if c.distance > NEAR * size => return Some(snapped(a, b, of(&c), size)),
        _ => {}
    }
    // The best three directions known, the best first.
    let mut starts: [Option<Meeting>; 3] = [None; 3];
    let across =
        a.mantle(b.middle()).into_iter().chain(b.mantle(a.middle()).map(|n| scale(-1.0, n)));
    let known = std::iter::once(scale(1.0 / norm(start), start)).chain(across);
    let known = known.chain(flats(a, b)).map(|n| measured(|d| a.support(d), b, n));
    let apart = near.map(|c| measured(|d| a.support(d), b, c.normal));
    for now in known.chain(apart) {
        let better = |s: &Option<Meeting>| s.is_none_or(|s| now.separation > s.separation);
        if let Some(k) = starts.iter().position(better) {
            starts[k..].rotate_right(1);
            starts[k] = Some(now);
        }
    }
    let first = starts[0]?;
    if first.separation > reach {
        return None;
    }
    // No direction separates by more than the distance.
    if let Some(c) = near.filter(|c| first.separation >= (1.0 - SEPARATES) * c.distance) {
        return Some(snapped(a, b, Meeting { on: c.on, ..first }, size));
    }
    // Deep inside there are several local maxima.
    let count = if first.separation > -DEEP * size { 1 } else { 3 };
    let all = starts.into_iter().flatten().take(count);
    let all = all.map(|from| climbed(|d| a.support(d), b, from, size));
    let best = all.max_by(|s, t| s.separation.total_cmp(&t.separation))?;
    Some(snapped(a, b, best, size))
}

/// The local maximum of the separation of b from a set with these support points that is reached from a direction.
pub(super) fn climbed(a: impl Fn(Vec3) -> Vec3, b: &Side, mut best: Meeting, size: f64) -> Meeting {
    let mut last = None;
    for _ in 0..CLIMBS {
        let s = APART * size - best.separation;
        let off = scale(s, best.normal);
        let moved = |d: Vec3| add(b.support(d), off);
        let Some(c) = closest(&a, moved, best.normal, size) else { break };
        let now = measured(&a, b, c.normal);
        // The separation grows with each step: where it does not, it is by rounding, and these are the points of the best normal.
        best.on = [c.on[0], sub(c.on[1], off)];
        if now.separation < best.separation {
            break;
        }
        let step = sub(now.normal, best.normal);
        best = Meeting { on: best.on, ..now };
        if norm(step) < CONVERGED {
            break;
        }
        // Steps of which each is the last one times q end q/(1 − q) of it farther.
        let q = last.map_or(0.0, |l| dot(l, step) / dot(l, l));
        last = Some(step);
        if q > SLOW && q < 1.0 {
            let n = add(best.normal, scale(q / (1.0 - q), step));
            let far = measured(&a, b, scale(1.0 / norm(n), n));
            if far.separation > best.separation {
                (best, last) = (Meeting { on: best.on, ..far }, None);
            }
        }
    }
    best
}

/// The separation along n.
pub(super) fn measured(a: impl Fn(Vec3) -> Vec3, b: &Side, n: Vec3) -> Meeting {
    let (p, q) = (a(n), b.support(scale(-1.0, n)));
    Meeting { normal: n, separation: dot(n, sub(q, p)), on: [p, q] }
}

/// With the normal of a flat face where one separates as well.
fn snapped(a: &Side, b: &Side, meeting: Meeting, size: f64) -> Meeting {
    let close = |n: &Vec3| norm(sub(*n, meeting.normal)) < 1e-3;
    for n in flats(a, b).filter(close) {
        let now = measured(|d| a.support(d), b, n);
        if now.separation >= meeting.separation - FLAT * size {
            return Meeting { normal: n, separation: now.separation, ..meeting };
        }
    }
    meeting
}

/// The normals of the flat faces of both, from a to b.
fn flats<'a>(a: &'a Side, b: &'a Side) -> impl Iterator<Item = Vec3> + 'a {
    a.normals().chain(b.normals().map(|n| scale(-1.0, n)))
}

impl<'a> Side<'a> {
    pub fn pose(&self) -> &'a Pose {
        match self {
            Side::Hull { pose, .. } | Side::Turned { pose, .. } | Side::Rod { pose, .. } => pose,
        }
    }

    pub fn radius(&self) -> f64 {
        if let Side::Rod { radius, .. } = self { *radius } else { 0.0 }
    }

    pub fn size(&self) -> f64 {
        match self {
            Side::Hull { hull, .. } => hull.size,
            Side::Turned { world, .. } => world.size(),
            Side::Rod { world, radius, .. } => 0.5 * norm(world.d) + radius,
        }
    }

    pub fn middle(&self) -> Vec3 {
        match self {
            Side::Hull { posed, .. } => posed.centre,
            Side::Turned { world, .. } => world.centre,
            Side::Rod { world, .. } => world.at(0.5),
        }
    }

    pub fn support(&self, d: Vec3) -> Vec3 {
        match self {
            Side::Hull { posed, .. } => posed.support(d),
            Side::Turned { world, .. } => world.support(d),
            Side::Rod { world, .. } => world.at(f64::from(u8::from(dot(world.d, d) > 0.0))),
        }
    }

    /// Its lowest point where n is up.
    pub fn lowest(&self, n: Vec3) -> Vec3 {
        let down = scale(-1.0, n);
        add(self.support(down), scale(self.radius(), down))
    }

    /// The normals of all flat faces.
    fn normals(&self) -> impl Iterator<Item = Vec3> + '_ {
        let (faces, ends) = match self {
            Side::Hull { posed, .. } => (&posed.normals[..], None),
            Side::Turned { world, .. } => (&[][..], Some(world)),
            Side::Rod { .. } => (&[][..], None),
        };
        let ends = ends
            .into_iter()
            .flat_map(|world| (0..2).filter(|&k| world.radii[k] > 0.0).map(|k| world.outwards(k)));
        faces.iter().copied().chain(ends)
    }

    /// The normal of the mantle on the side of x.
    fn mantle(&self, x: Vec3) -> Option<Vec3> {
        let Side::Turned { world, .. } = self else { return None };
        let (out, sine) = world.across(sub(x, world.centre));
        (sine > 0.0).then(|| world.mantle(out))
    }

    /// The flat face whose normal is n.
    pub fn flat(&self, n: Vec3) -> Option<Flat<'a>> {
        let aligned = |m: Vec3| norm(sub(m, n)) < ALIGNED;
        match *self {
            Side::Hull { hull, posed, pose } => {
                let face = posed.normals.iter().position(|&m| aligned(m))?;
                let [corners, edges] = [&hull.faces[face], &hull.face_edges[face]];
                // A side of a triangle is no face.
                (corners.len() > 2).then(|| Flat {
                    feature: Feature::Face(face as u32),
                    normal: posed.normals[face],
                    local: hull.normals[face],
                    point: posed.vertices[corners[0] as usize],
                    pose,
                    extent: Extent::Polygon { corners, edges, vertices: &posed.vertices },
                })
            }
            Side::Turned { local, world, pose } => {
                let k = (0..2).find(|&k| world.radii[k] > 0.0 && aligned(world.outwards(k)))?;
                Some(Flat {
                    feature: Feature::Face(k as u32),
                    normal: world.outwards(k),
                    local: local.outwards(k),
                    point: world.end(k),
                    pose,
                    extent: Extent::Disc { solid: world, end: k },
                })
            }
            Side::Rod { .. } => None,
        }
    }

    /// What of it meets along n.
    fn core(&self, n: Vec3) -> Core {
        match self {
            Side::Rod { local, radius, .. } => {
                let feature = Feature::Curved(0);
                Core::Line { local: *local, radius: *radius, feature, inner: false }
            }
            Side::Turned { local, world, .. } => {
                if local.radii[0] != local.radii[1] || !world.is_mantle(n, PARALLEL) {
                    return Core::Point;
                }
                let line = Segment::between(local.end(0), local.end(1));
                let (radius, feature) = (local.radii[0], Feature::Curved(0));
                Core::Line { local: line, radius, feature, inner: true }
            }
            Side::Hull { hull, posed, .. } => {
                let height = |k: u32| dot(n, posed.vertices[k as usize]);
                let count = posed.vertices.len() as u32;
                let top = (0..count).max_by(|&i, &j| height(i).total_cmp(&height(j))).unwrap_or(0);
                // The edge at the top that falls least.
                let mut best = (PARALLEL, None);
                for (e, edge) in hull.edges.iter().enumerate() {
                    let [i, j] = edge.ends;
                    if i != top && j != top {
                        continue;
                    }
                    let [p, q] = [i, j].map(|k| posed.vertices[k as usize]);
                    let falls = (height(i) - height(j)).abs() / norm(sub(q, p));
                    if falls < best.0 {
                        best = (falls, Some(e));
                    }
                }
                let at = |k: u32| hull.vertices[k as usize];
                let (local, feature) = match best.1 {
                    Some(e) => {
                        let [i, j] = hull.edges[e].ends;
                        (Segment::between(at(i), at(j)), Feature::Edge(e as u32))
                    }
                    None => (Segment::point(at(top)), Feature::Vertex(top)),
                };
                Core::Line { local, radius: 0.0, feature, inner: false }
            }
        }
    }
}

impl Flat<'_> {
    /// The part of the segment from p to q that lies above or below the face, as parameters, each with the feature of the face that cuts it off there.
    fn clip(&self, p: Vec3, q: Vec3) -> Option<[(f64, Feature); 2]> {
        let d = sub(q, p);
        let (mut low, mut high) = ((0.0, self.feature), (1.0, self.feature));
        match self.extent {
            Extent::All => {}
            Extent::Polygon { corners, vertices, edges } => {
                for k in 0..corners.len() {
                    let at = |i: usize| vertices[corners[i % corners.len()] as usize];
                    let (c, edge) = (at(k), sub(at(k + 1), at(k)));
                    let outwards = cross(edge, self.normal);
                    // Points on the side are within.
                    let slack = 1e-9 * dot(edge, edge);
                    let (x, rate) = (dot(outwards, sub(p, c)) - slack, dot(outwards, d));
                    if rate.abs() <= 1e-14 * norm(outwards) * norm(d) {
                        if x > 0.0 {
                            return None;
                        }
                    } else if rate > 0.0 && -x / rate < high.0 {
                        high = (-x / rate, Feature::Edge(edges[k]));
                    } else if rate < 0.0 && -x / rate > low.0 {
                        low = (-x / rate, Feature::Edge(edges[k]));
                    }
                }
            }
            Extent::Disc { solid, end } => {
                let (centre, radius) = (solid.end(end), solid.radii[end]);
                let across = |x: Vec3| sub(x, scale(dot(x, self.normal), self.normal));
                let (o, d) = (across(sub(p, centre)), across(d));
                let (a, b, c) =
                    (dot(d, d), dot(d, o), dot(o, o) - radius * radius * (1.0 + 2.0 * SAME_RIM));
                if a <= 1e-28 * radius * radius {
                    return (c <= 0.0).then_some([low, high]);
                }
                let root = b * b - a * c;
                if root < 0.0 {
                    return None;
                }
                let (first, last) = ((-b - root.sqrt()) / a, (-b + root.sqrt()) / a);
                if first > low.0 {
                    low = (first, Feature::Curved(6));
                }
                if last < high.0 {
                    high = (last, Feature::Curved(7));
                }
            }
        }
        (low.0 <= high.0).then_some([low, high])
    }

    /// Whether x lies above or below the face.
    fn holds(&self, x: Vec3) -> bool {
        self.clip(x, x).is_some()
    }

    /// The corners of a polygon with the edges that begin there.
    fn outline(&self, mut each: impl FnMut(Feature, Feature, Vec3, Vec3)) {
        if let Extent::Polygon { corners, edges, vertices } = self.extent {
            for k in 0..corners.len() {
                let next = corners[(k + 1) % corners.len()];
                let [p, q] = [corners[k], next].map(|i| vertices[i as usize]);
                each(Feature::Vertex(corners[k]), Feature::Edge(edges[k]), p, q);
            }
        }
    }
}

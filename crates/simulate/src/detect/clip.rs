//! Two convex polyhedra: the separating axis that separates them most, then the whole face of one clipped by the whole face of the other.
//!
//! The axes are the normals of all faces and the products of those pairs of edges that make a face of the Minkowski difference (their arcs on the Gauss map
//! cross). The axis of the last step stays unless another is better by [`HYSTERESIS`] of the size, so that normals do not hop between near ties. On a
//! face axis the face of the other body that looks against it most, of those with its lowest vertex, is clipped by the planes through the sides of the reference face (Sutherland–Hodgman):
//! every corner is a vertex of one body or a crossing of two edges, and has its name by that, whichever of the two was clipped.
//! Cost: faces × vertices, and edges × edges where no faces are parallel.

use nonsmooth_scenes::vec3::{Vec3, add, cross, dot, norm, scale, sub};

use crate::detect::hull::{Hull, PosedHull};
use crate::detect::segments::{Segment, closest};
use crate::detect::witness::{Anchor, Feature, Witness};
use crate::rotation::Pose;
use crate::state::Axis;

/// By which share of the size another axis must be better than that of the last step.
const HYSTERESIS: f64 = 1e-4;
/// By which share of the size edges must separate better than faces to be taken at first sight.
const FIRST: f64 = 1e-6;
/// A point outside a side by no more than this share of the size is inside.
const INSIDE: f64 = 1e-9;
/// Corners nearer to each other than this share of the size are one: bodies that are turned against each other by rounding have no more contacts for it.
const SAME: f64 = 1e-6;
/// By which share of the size edges may miss each other and touch.
const BESIDE: f64 = 1e-4;
/// Faces whose normals differ by less than this may touch elsewhere too than where two of their edges cross.
const FACING: f64 = 0.1;
/// Edges that are parallel up to this have no common normal.
const PARALLEL: f64 = 1e-6;

/// One of the two polyhedra: its hull, where its vertices are, where its body is.
pub(crate) type Side<'a> = (&'a Hull, &'a PosedHull, &'a Pose);

/// Where a corner of the clipped face comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Corner {
    point: Vec3,
    /// What of the reference and of the incident body.
    reference: Feature,
    incident: Feature,
    /// The line of the polygon that begins here.
    line: Line,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Line {
    /// An edge of the incident body.
    Incident(u32),
    /// Along side k of the reference face.
    Side(usize),
}

/// Buffers of clipping.
#[derive(Debug, Clone, Default)]
pub(crate) struct Clip {
    polygon: Vec<Corner>,
    next: Vec<Corner>,
}

impl Clip {
    /// All points where a and b are nearer to each other than `prediction`; returns the axis that separates them most, none where they are farther apart.
    pub fn collide(
        &mut self,
        a: Side,
        b: Side,
        last: Option<Axis>,
        prediction: f64,
        mut found: impl FnMut([Feature; 2], Witness),
    ) -> Option<Axis> {
        let size = a.0.size.min(b.0.size);
        let (face_a, mut best_a) = deepest(a, b);
        if best_a > prediction {
            return None;
        }
        let (face_b, mut best_b) = deepest(b, a);
        if best_b > prediction {
            return None;
        }
        let (mut face_a, mut face_b) = (face_a, face_b);
        // The faces of the last step stay where they are nearly as good.
        match last {
            Some(Axis::FaceA(f)) => {
                let now = separation(a, b, f as usize);
                if now > best_a.max(best_b) - HYSTERESIS * size {
                    (face_a, best_a, best_b) = (f as usize, now, f64::NEG_INFINITY);
                }
            }
            Some(Axis::FaceB(f)) => {
                let now = separation(b, a, f as usize);
                if now > best_a.max(best_b) - HYSTERESIS * size {
                    (face_b, best_b, best_a) = (f as usize, now, f64::NEG_INFINITY);
                }
            }
            _ => {}
        }
        let by_a = best_a >= best_b - FIRST * size;
        let best = best_a.max(best_b);
        let (reference, incident, face) = if by_a { (a, b, face_a) } else { (b, a, face_b) };
        let other = incident.1.facing(incident.0, reference.1.normals[face]);
        let (n, m) = (reference.1.normals[face], incident.1.normals[other]);
        let tilt = norm(cross(n, m));
        // Where two faces are parallel no edges can be better by more than rounding.
        let parallel = tilt * (a.0.size + b.0.size) < 0.1 * HYSTERESIS * size;
        let mut axis = if by_a { Axis::FaceA(face as u32) } else { Axis::FaceB(face as u32) };
        if !parallel {
            let margin = if matches!(last, Some(Axis::FaceA(_) | Axis::FaceB(_))) {
                HYSTERESIS
            } else {
                FIRST
            };
            if let Some(edges) = edges(a, b, last, size) {
                if edges.separation > prediction {
                    return None;
                }
                let keep = matches!(last, Some(Axis::Edges(..))) && edges.is_last;
                let margin = if keep { -HYSTERESIS } else { margin };
                if edges.separation > best + margin * size {
                    axis = Axis::Edges(edges.i, edges.j);
                    self.cross(a, b, &edges, prediction, &mut found);
                    // Of faces that nearly lie on each other one point would be left, about which they rock while all else sinks.
                    let facing = tilt < FACING && dot(n, m) < 0.0;
                    if facing && dot(edges.normal, n).abs() > 1.0 - FACING {
                        let crossing = [Feature::Edge(edges.i), Feature::Edge(edges.j)];
                        self.faces(
                            reference,
                            incident,
                            (face, other),
                            by_a,
                            prediction,
                            |pair, at| {
                                if pair != crossing {
                                    found(pair, at);
                                }
                            },
                        );
                    }
                    return Some(axis);
                }
            }
        }
        self.faces(reference, incident, (face, other), by_a, prediction, found);
        Some(axis)
    }

    /// All points where b is nearer than `prediction` to a face of a, along the normal of that.
    pub fn on_face(
        &mut self,
        a: Side,
        b: Side,
        face: usize,
        prediction: f64,
        found: impl FnMut([Feature; 2], Witness),
    ) {
        let other = b.1.facing(b.0, a.1.normals[face]);
        self.faces(a, b, (face, other), true, prediction, found);
    }

    fn cross(
        &mut self,
        a: Side,
        b: Side,
        edges: &Edges,
        prediction: f64,
        found: &mut impl FnMut([Feature; 2], Witness),
    ) {
        if edges.separation > prediction {
            return;
        }
        let local = |side: &Hull, e: u32| {
            let [p, q] = side.edges[e as usize].ends.map(|k| side.vertices[k as usize]);
            Segment::between(p, q)
        };
        let (s, t) = (local(a.0, edges.i), local(b.0, edges.j));
        let product = cross(a.2.direction(s.d), b.2.direction(t.d));
        let sign = dot(product, edges.normal).signum();
        let features = [Feature::Edge(edges.i), Feature::Edge(edges.j)];
        // Edges that pass beside each other's ends do not touch, whatever their lines do.
        let (p, q) = (s.placed(a.2), t.placed(b.2));
        let (x, y) = closest(&p, &q);
        let across = sub(sub(q.at(y), p.at(x)), scale(edges.separation, edges.normal));
        if norm(across) <= BESIDE * a.0.size.min(b.0.size) {
            found(features, Witness::Edges { s, t, sign });
        }
    }

    fn faces(
        &mut self,
        reference: Side,
        incident: Side,
        (face, other): (usize, usize),
        by_a: bool,
        prediction: f64,
        mut found: impl FnMut([Feature; 2], Witness),
    ) {
        let (hull, posed, pose) = reference;
        let n = posed.normals[face];
        let sides = &hull.faces[face];
        let size = hull.size.min(incident.0.size);
        let inside_by = INSIDE * size;
        let Self { polygon, next } = self;
        polygon.clear();
        let loops = &incident.0.faces[other];
        polygon.extend((0..loops.len()).map(|k| Corner {
            point: incident.1.vertices[loops[k] as usize],
            reference: Feature::Face(face as u32),
            incident: Feature::Vertex(loops[k]),
            line: Line::Incident(incident.0.face_edges[other][k]),
        }));
        // The side of a triangle without thickness is a line, which ends at its corners, too.
        let count = sides.len();
        let cuts = if count == 2 { 4 } else { count };
        for k in 0..cuts {
            let [p, q] = [k, k + 1].map(|i| posed.vertices[sides[i % count] as usize]);
            let edge = sub(q, p);
            let across = if k < count { cross(edge, n) } else { scale(-1.0, edge) };
            let outwards = scale(1.0 / norm(edge), across);
            let beyond = |x: Vec3| dot(outwards, sub(x, p));
            next.clear();
            for i in 0..polygon.len() {
                let (here, there) = (polygon[i], polygon[(i + 1) % polygon.len()]);
                let (d, e) = (beyond(here.point), beyond(there.point));
                let (inside, stays) = (d <= inside_by, e <= inside_by);
                if inside {
                    next.push(here);
                }
                if inside != stays {
                    let point = add(here.point, scale(d / (d - e), sub(there.point, here.point)));
                    // Going out the polygon follows the side, coming in its own line.
                    let line = if inside { Line::Side(k) } else { here.line };
                    let (reference, incident) = match here.line {
                        Line::Incident(edge) if k < count => {
                            (Feature::Edge(hull.face_edges[face][k]), Feature::Edge(edge))
                        }
                        Line::Incident(edge) => {
                            (Feature::Vertex(sides[k - count]), Feature::Edge(edge))
                        }
                        Line::Side(j) => {
                            let corner = match j.max(k) {
                                end if end >= count => end - count,
                                _ if (j + 1) % count == k => k,
                                _ => j,
                            };
                            (Feature::Vertex(sides[corner]), Feature::Face(other as u32))
                        }
                    };
                    next.push(Corner { point, reference, incident, line });
                }
            }
            std::mem::swap(polygon, next);
            if polygon.is_empty() {
                return;
            }
        }
        tidy(polygon, n, SAME * size);
        let offset = posed.offsets[face];
        for corner in polygon.iter() {
            let gap = dot(n, corner.point) - offset;
            if gap > prediction {
                continue;
            }
            let anchor = match (corner.reference, corner.incident) {
                (Feature::Vertex(_), _) => Anchor::Face,
                (_, Feature::Vertex(_)) => Anchor::Other,
                _ => Anchor::Both,
            };
            let witness = Witness::Face {
                on_a: by_a,
                normal: hull.normals[face],
                other: incident.2.local_point(corner.point),
                foot: pose.local_point(sub(corner.point, scale(gap, n))),
                radius: 0.0,
                anchor,
            };
            let pair = [corner.reference, corner.incident];
            found(if by_a { pair } else { [pair[1], pair[0]] }, witness);
        }
    }
}

/// Drops corners at the place of another one, and those on the line between their neighbours.
fn tidy(polygon: &mut Vec<Corner>, n: Vec3, same: f64) {
    let across = |x: Vec3| sub(x, scale(dot(n, x), n));
    let rank = |c: &Corner| match (c.reference, c.incident) {
        (_, Feature::Vertex(_)) => 0,
        (Feature::Vertex(_), _) => 1,
        _ => 2,
    };
    let mut k = 0;
    while polygon.len() > 1 && k < polygon.len() {
        let j = (k + 1) % polygon.len();
        if norm(across(sub(polygon[j].point, polygon[k].point))) <= same {
            // A vertex has the better name.
            let worse = if rank(&polygon[j]) < rank(&polygon[k]) { k } else { j };
            polygon.remove(worse);
        } else {
            k += 1;
        }
    }
    let mut k = 0;
    while polygon.len() > 2 && k < polygon.len() {
        let m = polygon.len();
        let [p, q, r] = [k + m - 1, k, k + 1].map(|i| across(polygon[i % m].point));
        let (u, v) = (sub(q, p), sub(r, q));
        let chord = norm(sub(r, p));
        let turns = norm(cross(u, v)) > same * chord;
        if turns {
            k += 1;
        } else {
            polygon.remove(k);
        }
    }
}

/// How far b is in front of face f of a.
fn separation(a: Side, b: Side, f: usize) -> f64 {
    let n = a.1.normals[f];
    let least = b.1.vertices.iter().map(|&v| dot(n, v)).fold(f64::INFINITY, f64::min);
    least - a.1.offsets[f]
}

/// The face of a that b is farthest in front of.
fn deepest(a: Side, b: Side) -> (usize, f64) {
    let mut best = (0, f64::NEG_INFINITY);
    for f in 0..a.1.normals.len() {
        let now = separation(a, b, f);
        if now > best.1 {
            best = (f, now);
        }
    }
    best
}

struct Edges {
    i: u32,
    j: u32,
    separation: f64,
    normal: Vec3,
    is_last: bool,
}

/// The pair of edges that separates most, that of the last step where it is nearly as good.
fn edges(a: Side, b: Side, last: Option<Axis>, size: f64) -> Option<Edges> {
    let mut best: Option<Edges> = None;
    let mut kept = None;
    for (i, e) in a.0.edges.iter().enumerate() {
        let [n0, n1] = e.faces.map(|f| a.1.normals[f as usize]);
        let [p, p1] = e.ends.map(|k| a.1.vertices[k as usize]);
        let u = sub(p1, p);
        let across = cross(n1, n0);
        for (j, f) in b.0.edges.iter().enumerate() {
            // The arcs of normals, those of b turned about, cross on the Gauss map.
            let [m0, m1] = f.faces.map(|g| scale(-1.0, b.1.normals[g as usize]));
            let (s, t) = (dot(m0, across), dot(m1, across));
            if s * t >= 0.0 {
                continue;
            }
            let other = cross(m1, m0);
            let (x, y) = (dot(n0, other), dot(n1, other));
            if x * y >= 0.0 || s * y <= 0.0 {
                continue;
            }
            let [q, q1] = f.ends.map(|k| b.1.vertices[k as usize]);
            let v = sub(q1, q);
            let product = cross(u, v);
            let length = norm(product);
            if length <= PARALLEL * norm(u) * norm(v) {
                continue;
            }
            let mut normal = scale(1.0 / length, product);
            // Outwards: between the normals of the two faces.
            if dot(normal, add(n0, n1)) < 0.0 {
                normal = scale(-1.0, normal);
            }
            let separation = dot(normal, sub(q, p));
            let is_last = last == Some(Axis::Edges(i as u32, j as u32));
            let pair = Edges { i: i as u32, j: j as u32, separation, normal, is_last };
            if is_last {
                kept = Some(Edges { ..pair });
            }
            if best.as_ref().is_none_or(|b| separation > b.separation) {
                best = Some(pair);
            }
        }
    }
    match (best, kept) {
        (Some(best), Some(kept)) if kept.separation > best.separation - HYSTERESIS * size => {
            Some(kept)
        }
        (best, _) => best,
    }
}

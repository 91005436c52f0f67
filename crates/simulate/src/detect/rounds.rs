//! Closed forms for what has a round part: spheres and capsules with each other, with planes and with polyhedra; and the vertices of polyhedra with planes.

use nonsmooth_scenes::vec3::{Vec3, cross, dot, norm, scale, sub};

use crate::detect::hull::{Hull, PosedHull};
use crate::detect::segments::Segment;
use crate::detect::witness::{Anchor, Feature, Witness};
use crate::rotation::Pose;

/// Axes of capsules that differ by less than this angle touch along a line: at two points.
const PARALLEL: f64 = 1e-3;

/// Two rounded segments, in the frames of their bodies and where they are.
pub(crate) fn rounds(
    (s, s_radius, a): (Segment, f64, &Pose),
    (t, t_radius, b): (Segment, f64, &Pose),
    mut found: impl FnMut([Feature; 2], Witness),
) {
    let (p, q) = (s.placed(a), t.placed(b));
    let (square, along) = (dot(p.d, p.d), dot(p.d, q.d));
    let turned = norm(cross(p.d, q.d));
    if square > 0.0 && along != 0.0 && turned < PARALLEL * along.abs() {
        let ends = [0.0, 1.0].map(|y| dot(sub(q.at(y), p.p), p.d) / square);
        let (low, high) = (ends[0].min(ends[1]).max(0.0), ends[0].max(ends[1]).min(1.0));
        if high - low > 1e-9 {
            for (k, x) in [low, high].into_iter().enumerate() {
                let feature = Feature::Curved(k as u32 + 1);
                let s = Segment::point(s.at(x));
                found([feature; 2], Witness::Rounds { s, s_radius, t, t_radius });
            }
            return;
        }
    }
    found([Feature::Curved(0); 2], Witness::Rounds { s, s_radius, t, t_radius });
}

/// A plane through the origin of `plane`, its normal the third axis, and points of the other body, each with its feature. `face` is the body of the plane.
pub(crate) fn plane(
    on_a: bool,
    plane: &Pose,
    face: &Pose,
    points: impl Iterator<Item = (Feature, Vec3, Vec3)>,
    radius: f64,
    prediction: f64,
    mut found: impl FnMut([Feature; 2], Witness),
) {
    let n = plane.direction([0.0, 0.0, 1.0]);
    let normal = face.local_direction(n);
    let offset = dot(n, plane.x);
    for (feature, local, world) in points {
        let distance = dot(n, world) - offset;
        if distance - radius > prediction {
            continue;
        }
        let foot = face.local_point(sub(world, scale(distance, n)));
        let pair = [Feature::Face(0), feature];
        let features = if on_a { pair } else { [pair[1], pair[0]] };
        let anchor = Anchor::Other;
        found(features, Witness::Face { on_a, normal, other: local, foot, radius, anchor });
    }
}

/// A ball, its centre in the frame of its body and where it is, and a polyhedron: at most one contact.
pub(crate) fn ball_and_hull(
    (centre, at, radius): (Vec3, Vec3, f64),
    (hull, posed, pose): (&Hull, &PosedHull, &Pose),
    hull_is_a: bool,
    prediction: f64,
    mut found: impl FnMut([Feature; 2], Witness),
) {
    let distance = |f: usize| dot(posed.normals[f], at) - posed.offsets[f];
    let (mut deepest, mut most) = (0, f64::NEG_INFINITY);
    for f in 0..hull.faces.len() {
        let d = distance(f);
        if d > most {
            (deepest, most) = (f, d);
        }
    }
    if most - radius > prediction {
        return;
    }
    let pair = |hull_feature: Feature| {
        let curved = Feature::Curved(0);
        if hull_is_a { [hull_feature, curved] } else { [curved, hull_feature] }
    };
    let above = |f: usize| {
        let n = posed.normals[f];
        let corner = |k: u32| posed.vertices[k as usize];
        let face = &hull.faces[f];
        (0..face.len()).all(|k| {
            let (p, q) = (corner(face[k]), corner(face[(k + 1) % face.len()]));
            dot(cross(n, sub(q, p)), sub(at, p)) >= 0.0
        })
    };
    let on_face = |f: usize| {
        let foot = pose.local_point(sub(at, scale(distance(f), posed.normals[f])));
        let (normal, anchor) = (hull.normals[f], Anchor::Other);
        let witness =
            Witness::Face { on_a: hull_is_a, normal, other: centre, foot, radius, anchor };
        (pair(Feature::Face(f as u32)), witness)
    };
    // Inside, or above the face whose plane is the farthest below: that face is the nearest point's.
    if most <= 0.0 || above(deepest) {
        let (features, witness) = on_face(deepest);
        return found(features, witness);
    }
    let mut best = (f64::INFINITY, None);
    for (f, edges) in hull.face_edges.iter().enumerate() {
        if distance(f) <= 0.0 {
            continue;
        }
        if above(f) {
            if distance(f) < best.0 {
                best = (distance(f), Some(on_face(f)));
            }
            continue;
        }
        for &e in edges {
            let [i, j] = hull.edges[e as usize].ends;
            let [p, q] = [i, j].map(|k| posed.vertices[k as usize]);
            let world = Segment::between(p, q);
            let x = world.nearest(at);
            let d = norm(sub(at, world.at(x)));
            if d < best.0 {
                let [p, q] = [i, j].map(|k| hull.vertices[k as usize]);
                let (feature, line) = match x {
                    0.0 => (Feature::Vertex(i), Segment::point(p)),
                    1.0 => (Feature::Vertex(j), Segment::point(q)),
                    _ => (Feature::Edge(e), Segment::between(p, q)),
                };
                let ball = Segment::point(centre);
                let witness = match hull_is_a {
                    true => Witness::Rounds { s: line, s_radius: 0.0, t: ball, t_radius: radius },
                    false => Witness::Rounds { s: ball, s_radius: radius, t: line, t_radius: 0.0 },
                };
                best = (d, Some((pair(feature), witness)));
            }
        }
    }
    if let (_, Some((features, witness))) = best {
        found(features, witness);
    }
}

//! Contact detection: where bodies are near each other, with keys that persist.
//!
//! | pair | how |
//! | --- | --- |
//! | sphere, capsule with sphere, capsule, plane | closed form; parallel capsules at two points |
//! | sphere with box, polyhedron | nearest vertex, edge or face |
//! | box, polyhedron with plane | all vertices |
//! | box, polyhedron with each other | separating axes with hysteresis, whole faces clipped |
//!
//! What is drawn is what touches: no margin, no skin. A point is reported where the gap is at most the prediction of the pair, so that a step
//! knows what it may run into. Every list is sorted by key: the same bodies give the same contacts in the same order.

mod broad;
mod clip;
mod hull;
mod rounds;
mod segments;
mod witness;

use nonsmooth_scenes::Polyhedron;
use nonsmooth_scenes::vec3::{Vec3, add, scale, sub};

use crate::rotation::Pose;
use crate::state::{Axis, State};
use crate::{BodyId, Law, Shape, SimulateError, World};
use broad::{Aabb, Broad};
use clip::Clip;
use hull::{Hull, PosedHull};
use segments::Segment;
use witness::Feature;
pub use witness::Key;
pub(crate) use witness::{Place, Witness};

/// A point where two bodies are near each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Near {
    pub key: Key,
    pub a: u32,
    pub b: u32,
    pub law: Law,
    /// The size of the smaller shape.
    pub size: f64,
    pub place: Place,
    pub witness: Witness,
}

/// What a shape is made of, in the frame of its body.
#[derive(Debug, Clone)]
enum Solid {
    Rounded(Segment, f64),
    Plane(Pose),
    Hull(Box<Hull>),
}

#[derive(Debug, Clone)]
struct Solids {
    body: u32,
    material: usize,
    solid: Solid,
    size: f64,
}

/// Broad and narrow phase, with the memory that they use.
#[derive(Debug, Clone)]
pub(crate) struct Detector {
    solids: Vec<Solids>,
    moves: Vec<bool>,
    planes: Vec<u32>,
    finite: Vec<u32>,
    poses: Vec<Pose>,
    hulls: Vec<PosedHull>,
    boxes: Vec<Aabb>,
    box_moves: Vec<bool>,
    broad: Broad,
    pairs: Vec<(u32, u32)>,
    axes: Vec<((u32, u32), Axis)>,
    clip: Clip,
}

impl Detector {
    /// Of a valid world.
    ///
    /// Errors: two shapes that may meet and whose contact is not implemented.
    pub fn new(world: &World) -> Result<Self, SimulateError> {
        let mut solids = vec![];
        let mut names = vec![];
        for (k, body) in world.bodies.iter().enumerate() {
            for (s, part) in body.parts.iter().enumerate() {
                let pose = Pose { x: part.position, r: part.rotation.matrix() };
                let hull = |p: &Polyhedron| Solid::Hull(Box::new(Hull::new(p, &pose)));
                let solid = match &part.shape {
                    Shape::Sphere { radius } => Solid::Rounded(Segment::point(pose.x), *radius),
                    Shape::Capsule { half_length, radius } => {
                        let end = |z| pose.point([0.0, 0.0, z]);
                        Solid::Rounded(
                            Segment::between(end(-half_length), end(*half_length)),
                            *radius,
                        )
                    }
                    Shape::Plane => Solid::Plane(pose),
                    Shape::Box { half } => hull(&Polyhedron::cuboid(*half)?),
                    Shape::Polyhedron(p) => hull(p),
                };
                let size = match &solid {
                    Solid::Hull(hull) => hull.size,
                    _ => part.shape.radius(),
                };
                solids.push(Solids { body: k as u32, material: part.material, solid, size });
                names.push((k, s, part.shape.name()));
            }
        }
        let capsule =
            |k: usize| matches!(&solids[k].solid, Solid::Rounded(s, _) if s.d != [0.0; 3]);
        let hull = |k: usize| matches!(&solids[k].solid, Solid::Hull(_));
        let capsules: Vec<usize> = (0..solids.len()).filter(|&k| capsule(k)).collect();
        for &i in &capsules {
            let meets = |&j: &usize| {
                let (p, q) = (solids[i].body, solids[j].body);
                p != q && hull(j) && world.may_touch(BodyId(p), BodyId(q))
            };
            if let Some(j) = (0..solids.len()).find(meets) {
                let place = |k: usize| format!("{}.parts[{}]", world.label(names[k].0), names[k].1);
                let (i, j) = (i.min(j), i.max(j));
                let (first, second) = (names[i].2, names[j].2);
                return Err(SimulateError::Pair { a: place(i), b: place(j), first, second });
            }
        }
        let moves: Vec<bool> = world.bodies.iter().map(super::world::Body::is_free).collect();
        let is_plane = |k: &u32| matches!(solids[*k as usize].solid, Solid::Plane(_));
        let (planes, finite): (Vec<u32>, Vec<u32>) =
            (0..solids.len() as u32).partition(|k| is_plane(k));
        let box_moves = finite.iter().map(|&k| moves[solids[k as usize].body as usize]).collect();
        Ok(Self {
            hulls: vec![PosedHull::default(); solids.len()],
            moves,
            planes,
            finite,
            poses: vec![],
            boxes: vec![],
            box_moves,
            broad: Broad::default(),
            pairs: vec![],
            axes: vec![],
            clip: Clip::default(),
            solids,
        })
    }

    /// The size of each body: the radius of its largest finite shape.
    pub fn sizes(&self, bodies: usize) -> Vec<f64> {
        let mut out = vec![0.0; bodies];
        for s in self.solids.iter().filter(|s| s.size.is_finite()) {
            let size = &mut out[s.body as usize];
            *size = f64::max(*size, s.size);
        }
        out
    }

    /// All points where two bodies that may touch are within the sum of their margins (m, one a body), by key. The axes that separate polyhedra are left in
    /// the memory of the state.
    pub fn detect(
        &mut self,
        world: &World,
        state: &mut State,
        margins: &[f64],
        out: &mut Vec<Near>,
    ) {
        out.clear();
        self.place(world, state, margins);
        self.pairs.clear();
        self.broad.pairs(&self.boxes, &self.box_moves, &mut self.pairs);
        for pair in &mut self.pairs {
            // Places among the finite shapes, which keep the order of all shapes.
            *pair = (self.finite[pair.0 as usize], self.finite[pair.1 as usize]);
        }
        self.pairs_with_planes(margins);
        self.pairs.sort_unstable();
        self.axes.clear();
        let pairs = std::mem::take(&mut self.pairs);
        let (mut last, mut body_pair, mut may) = (0, (u32::MAX, u32::MAX), false);
        for &(i, j) in &pairs {
            let (p, q) = (self.solids[i as usize].body, self.solids[j as usize].body);
            if (p, q) != body_pair {
                body_pair = (p, q);
                may = p != q && world.may_touch(BodyId(p), BodyId(q));
            }
            if !may {
                continue;
            }
            // Both lists are sorted.
            let known = &state.memory.axes;
            while last < known.len() && known[last].0 < (i, j) {
                last += 1;
            }
            let axis = known.get(last).filter(|k| k.0 == (i, j)).map(|k| k.1);
            let prediction = margins[p as usize] + margins[q as usize];
            let first = out.len();
            let now = self.narrow(world, i, j, axis, prediction, out);
            self.axes.extend(now.map(|now| ((i, j), now)));
            out[first..].sort_unstable_by_key(|n| n.key);
        }
        self.pairs = pairs;
        std::mem::swap(&mut state.memory.axes, &mut self.axes);
    }

    /// Poses of bodies, vertices of polyhedra and boxes of finite shapes.
    fn place(&mut self, world: &World, state: &State, margins: &[f64]) {
        let anew = self.poses.is_empty();
        self.poses.resize(world.bodies.len(), Pose { x: [0.0; 3], r: [[0.0; 3]; 3] });
        for (k, pose) in self.poses.iter_mut().enumerate() {
            *pose = state.pose(k);
        }
        self.boxes.clear();
        for &k in &self.finite {
            let Solids { body, solid, .. } = &self.solids[k as usize];
            let (pose, margin) = (&self.poses[*body as usize], margins[*body as usize]);
            let (low, high, margin) = match solid {
                Solid::Rounded(segment, radius) => {
                    let s = segment.placed(pose);
                    let end = add(s.p, s.d);
                    let by = |f: fn(f64, f64) -> f64| std::array::from_fn(|i| f(s.p[i], end[i]));
                    (by(f64::min), by(f64::max), margin + radius)
                }
                Solid::Hull(hull) => {
                    let posed = &mut self.hulls[k as usize];
                    let still = matches!(world.bodies[*body as usize].motion, crate::Motion::Fixed);
                    if anew || !still {
                        posed.set(hull, pose);
                    }
                    let by = |start: f64, f: fn(f64, f64) -> f64| {
                        posed
                            .vertices
                            .iter()
                            .fold([start; 3], |s, v| std::array::from_fn(|i| f(s[i], v[i])))
                    };
                    (by(f64::INFINITY, f64::min), by(f64::NEG_INFINITY, f64::max), margin)
                }
                Solid::Plane(_) => continue,
            };
            self.boxes.push(Aabb { low: low.map(|x| x - margin), high: high.map(|x| x + margin) });
        }
    }

    /// A plane has no box: those shapes whose box reaches below it.
    fn pairs_with_planes(&mut self, margins: &[f64]) {
        for &k in &self.planes {
            let Solids { body, solid: Solid::Plane(pose), .. } = &self.solids[k as usize] else {
                continue;
            };
            let pose = self.poses[*body as usize].then(pose);
            let n = pose.direction([0.0, 0.0, 1.0]);
            let offset = nonsmooth_scenes::vec3::dot(n, pose.x) + margins[*body as usize];
            for (b, &j) in self.boxes.iter().zip(&self.finite) {
                let least: f64 =
                    (0..3).map(|i| n[i] * if n[i] > 0.0 { b.low[i] } else { b.high[i] }).sum();
                if least <= offset && self.moves[self.solids[j as usize].body as usize] {
                    self.pairs.push((k.min(j), k.max(j)));
                }
            }
        }
    }

    fn narrow(
        &mut self,
        world: &World,
        i: u32,
        j: u32,
        axis: Option<Axis>,
        prediction: f64,
        out: &mut Vec<Near>,
    ) -> Option<Axis> {
        let Self { solids, poses, hulls, clip, .. } = self;
        let (s, t) = (&solids[i as usize], &solids[j as usize]);
        let (a, b) = (&poses[s.body as usize], &poses[t.body as usize]);
        let law = world.law_between(s.material, t.material);
        let size = s.size.min(t.size);
        let fallback = || {
            // Bodies that coincide leave no direction: from the one centre to the other, upwards if these do too.
            let d = sub(b.x, a.x);
            let length = nonsmooth_scenes::vec3::norm(d);
            if length > 0.0 { scale(1.0 / length, d) } else { [0.0, 0.0, 1.0] }
        };
        let mut found = |[f, g]: [Feature; 2], witness: Witness| {
            let place = witness.place(a, b, fallback());
            if place.gap <= prediction {
                let key = Key { shape_a: i, shape_b: j, feature_a: f.code(), feature_b: g.code() };
                out.push(Near { key, a: s.body, b: t.body, law, size, place, witness });
            }
        };
        let center = |segment: &Segment, pose: &Pose| pose.point(segment.p);
        match (&s.solid, &t.solid) {
            (Solid::Rounded(p, r), Solid::Rounded(q, o)) => {
                rounds::rounds((*p, *r, a), (*q, *o, b), found);
                None
            }
            (Solid::Plane(plane), Solid::Rounded(q, r)) => {
                let plane = a.then(plane);
                rounds::plane(true, &plane, a, ends(q, b), *r, prediction, found);
                None
            }
            (Solid::Rounded(q, r), Solid::Plane(plane)) => {
                let plane = b.then(plane);
                rounds::plane(false, &plane, b, ends(q, a), *r, prediction, found);
                None
            }
            (Solid::Plane(plane), Solid::Hull(hull)) => {
                let points = corners(hull, &hulls[j as usize]);
                rounds::plane(true, &a.then(plane), a, points, 0.0, prediction, found);
                None
            }
            (Solid::Hull(hull), Solid::Plane(plane)) => {
                let points = corners(hull, &hulls[i as usize]);
                rounds::plane(false, &b.then(plane), b, points, 0.0, prediction, found);
                None
            }
            (Solid::Hull(hull), Solid::Rounded(q, r)) => {
                let side = (&**hull, &hulls[i as usize], a);
                let ball = (q.p, center(q, b), *r);
                rounds::ball_and_hull(ball, side, true, prediction, found);
                None
            }
            (Solid::Rounded(q, r), Solid::Hull(hull)) => {
                let side = (&**hull, &hulls[j as usize], b);
                let ball = (q.p, center(q, a), *r);
                rounds::ball_and_hull(ball, side, false, prediction, found);
                None
            }
            (Solid::Hull(p), Solid::Hull(q)) => {
                let first = (&**p, &hulls[i as usize], a);
                let second = (&**q, &hulls[j as usize], b);
                clip.collide(first, second, axis, prediction, &mut found)
            }
            (Solid::Plane(_), Solid::Plane(_)) => None,
        }
    }
}

/// The ends of a segment as features, in the frame of the body and in the world; one of a point.
fn ends<'a>(s: &'a Segment, pose: &'a Pose) -> impl Iterator<Item = (Feature, Vec3, Vec3)> + 'a {
    let count = if s.d == [0.0; 3] { 1 } else { 2 };
    (0..count).map(move |k| {
        let p = s.at(f64::from(k));
        (Feature::Curved(k as u32), p, pose.point(p))
    })
}

fn corners<'a>(
    hull: &'a Hull,
    posed: &'a PosedHull,
) -> impl Iterator<Item = (Feature, Vec3, Vec3)> + 'a {
    let both = hull.vertices.iter().zip(&posed.vertices);
    both.enumerate().map(|(k, (&p, &q))| (Feature::Vertex(k as u32), p, q))
}

#[cfg(test)]
mod tests;

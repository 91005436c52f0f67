//! Nodes of one elastic box at the faces of another.
//!
//! One pass: of two boxes the nodes of that with the finer mesh touch the faces of the other, of two equal ones those of the later box. Turns are small, so a node of the side `±x_k` may touch
//! the side `∓x_k` of the other box alone; a node of several sides touches where the gap is largest. Faces are where the nodes have moved them, bilinear in u and v; the foot of a node is
//!
//! ```text
//! X(u, v) = Σ N_i X_i,     (x − X)·X_u = (x − X)·X_v = 0,     g = n·(x − X),     n = X_u × X_v/‖X_u × X_v‖
//! ```
//!
//! and moves with `Σ N_i v_i`, so that an impulse is shared out by the N_i. A node stands for half an element about it, so it may be beyond the edge of the side by that much; its foot is then on the edge.
//! What is narrower than the elements of the finer mesh passes between its nodes.
//!
//! Cost: nodes of a side times faces of a side, for those within the box of the other.

use nonsmooth_scenes::vec3::{Vec3, add, cross, dot, norm, scale, sub};

use super::{Feature, Key, Near, Witness};
use crate::World;
use crate::elastic::{Foot, Nodes};
use crate::rotation::Pose;
use crate::state::State;

/// No such place.
const NONE: u32 = u32::MAX;
/// Newton's steps to a foot; two are enough on a plane face.
const STEPS: usize = 20;

/// All pairs of elastic boxes.
#[derive(Debug, Clone, Default)]
pub(super) struct Facing {
    boxes: Vec<Faces>,
    /// The box whose nodes touch, and that whose faces are touched.
    pairs: Vec<(u32, u32)>,
    /// Where all nodes of each box are.
    places: Vec<Vec<Vec3>>,
    /// The number of shapes of bodies and nodes, after which sides are counted.
    shapes: u32,
}

/// A box as nodes and faces.
#[derive(Debug, Clone)]
struct Faces {
    /// Nodes that may touch: their places among all, their numbers, and on which sides they are, twice the axis and one more at its upper end.
    nodes: Vec<(u32, u32, Vec<usize>)>,
    /// The nodes of the faces of each side, counterclockwise from outside.
    faces: [Vec<[u32; 4]>; 6],
    /// For each node its place among all that may touch.
    place_of: Vec<u32>,
    cell: Vec3,
    sides: Vec3,
}

/// Where a node is over a face.
struct Over {
    gap: f64,
    beyond: f64,
    normal: Vec3,
    point: Vec3,
    share: [f64; 4],
}

impl Facing {
    pub fn new(world: &World, nodes: &Nodes, shapes: usize) -> Self {
        let count = if world.elastic.len() < 2 { 0 } else { world.elastic.len() };
        let boxes: Vec<Faces> = (0..count).map(|k| Faces::new(world, nodes, k)).collect();
        let mut pairs = vec![];
        for j in 0..boxes.len() {
            for i in 0..j {
                let [first, second] = [i, j].map(|k| &world.elastic[k]);
                pairs.push(match first.is_finer_than(second) {
                    true => (i as u32, j as u32),
                    false => (j as u32, i as u32),
                });
            }
        }
        Self { boxes, pairs, places: vec![], shapes: shapes as u32 }
    }

    /// Adds all nodes that are within the margins of a face, and their feet, which are counted on where `first` bodies and nodes end.
    pub fn find(
        &mut self,
        world: &World,
        state: &State,
        (margins, nodes): (&[f64], &Nodes),
        out: &mut Vec<Near>,
        feet: &mut Vec<Foot>,
    ) {
        feet.clear();
        if self.pairs.is_empty() {
            return;
        }
        let bodies = world.bodies.len();
        let first = bodies + nodes.list.len();
        self.places.resize_with(self.boxes.len(), Vec::new);
        let each = self.places.iter_mut().zip(world.elastic.iter().zip(&state.elastic));
        each.for_each(|(places, (elastic, state))| {
            places.clear();
            places.extend(elastic.positions(state));
        });
        let Self { boxes, pairs, places, shapes } = &*self;
        let widest = |k: u32| {
            let own = boxes[k as usize].nodes.iter().map(|n| margins[bodies + n.0 as usize]);
            own.fold(0.0, f64::max)
        };
        for &(slave, master) in pairs {
            let (s, m) = (&boxes[slave as usize], &boxes[master as usize]);
            let (here, there) = (&places[slave as usize], &places[master as usize]);
            let reach = 0.5 * s.cell.into_iter().fold(0.0, f64::max);
            let far = widest(slave) + widest(master);
            let [low, high] = bounds(there.iter().copied());
            let outside = |x: Vec3| {
                (0..3).any(|k| x[k] < low[k] - far.max(reach) || x[k] > high[k] + far.max(reach))
            };
            let materials = [slave, master].map(|k| world.elastic[k as usize].material);
            let law = world.law_between(materials[0], materials[1]);
            let compliance = world.compliance_between(materials[0], materials[1]);
            for (place, node, sides) in &s.nodes {
                let x = here[*node as usize];
                if outside(x) {
                    continue;
                }
                let over = sides.iter().filter_map(|&side| {
                    let (over, face) = m.under(x, side ^ 1, there, s.cell)?;
                    (over.gap >= -0.5 * m.sides[side / 2]).then_some((over, side ^ 1, face))
                });
                let best = over.reduce(|p, q| if q.0.gap > p.0.gap { q } else { p });
                let Some((over, side, face)) = best.filter(|b| b.0.gap <= far) else { continue };
                let foot = Foot {
                    solid: master,
                    place: over.point,
                    parts: std::array::from_fn(|i| (m.place_of[face[i] as usize], over.share[i])),
                };
                let key = Key {
                    shape_a: *place + *shapes - nodes.list.len() as u32,
                    shape_b: shapes + 6 * master + side as u32,
                    image: [0; 3],
                    feature_a: 0,
                    feature_b: Feature::Face(side as u32).code(),
                };
                let a = (bodies + *place as usize) as u32;
                let b = (first + feet.len()) as u32;
                let normal = scale(-1.0, over.normal);
                let witness = Witness::Points { s: [0.0; 3], t: [0.0; 3], normal, on_a: true };
                let at = witness.place(&Pose::at(x), &Pose::at(over.point), normal);
                let size = nodes.list[*place as usize].size;
                let near = Near {
                    key,
                    a,
                    b,
                    law,
                    compliance,
                    size,
                    place: at,
                    witness,
                    image: super::Beside::default(),
                    deep: false,
                };
                out.push(near);
                feet.push(foot);
            }
        }
        if !feet.is_empty() {
            out.sort_unstable_by_key(|n| n.key);
        }
    }
}

impl Faces {
    fn new(world: &World, nodes: &Nodes, k: usize) -> Self {
        let solid = &world.elastic[k].solid;
        let (skin, all) = solid.skin();
        let mut place_of = vec![NONE; solid.nodes()];
        for (place, node) in nodes.list.iter().enumerate().filter(|n| n.1.solid as usize == k) {
            place_of[node.node as usize] = place as u32;
        }
        // The faces of a side follow each other, axis by axis, the lower end first.
        let mut faces: [Vec<[u32; 4]>; 6] = Default::default();
        let mut rest = all.into_iter().map(|face| face.map(|place| skin[place] as u32));
        for (side, faces) in faces.iter_mut().enumerate() {
            let (u, v) = ((side / 2 + 1) % 3, (side / 2 + 2) % 3);
            faces.extend(rest.by_ref().take(solid.elements[u] * solid.elements[v]));
        }
        let mut sides_of: Vec<Vec<usize>> = vec![vec![]; solid.nodes()];
        for (side, faces) in faces.iter().enumerate() {
            for &node in faces.iter().flatten() {
                let sides = &mut sides_of[node as usize];
                if sides.last() != Some(&side) {
                    sides.push(side);
                }
            }
        }
        let touching = skin.iter().filter(|&&n| place_of[n] != NONE);
        let own = touching.map(|&n| (place_of[n], n as u32, std::mem::take(&mut sides_of[n])));
        let own = own.collect();
        Self { nodes: own, faces, place_of, cell: solid.cell(), sides: solid.sides }
    }

    /// The face of a side that x is over, least far beyond its edge.
    fn under(&self, x: Vec3, side: usize, places: &[Vec3], cell: Vec3) -> Option<(Over, [u32; 4])> {
        let (u, v) = ((side / 2 + 1) % 3, (side / 2 + 2) % 3);
        let mut best: Option<(Over, [u32; 4])> = None;
        for &face in &self.faces[side] {
            let corners = face.map(|n| places[n as usize]);
            let [low, high] = bounds(corners.into_iter());
            let reach = |k: usize| 0.5 * cell[k];
            if [u, v].iter().any(|&k| x[k] < low[k] - reach(k) || x[k] > high[k] + reach(k)) {
                continue;
            }
            let over = over(x, &corners);
            let nearer = best.as_ref().is_none_or(|b| over.beyond < b.0.beyond);
            if nearer && over.beyond <= 0.5 * cell[u].max(cell[v]) * (1.0 + 1e-9) {
                best = Some((over, face));
            }
        }
        best
    }
}

fn bounds(points: impl Iterator<Item = Vec3>) -> [Vec3; 2] {
    points.fold([[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]], |[low, high], x| {
        [0, 1].map(|end| {
            std::array::from_fn(|k| if end == 0 { low[k].min(x[k]) } else { high[k].max(x[k]) })
        })
    })
}

/// The foot of x on the bilinear face with these corners, and how far beyond its edge x is.
fn over(x: Vec3, [a, b, c, d]: &[Vec3; 4]) -> Over {
    // X = a + u e + v f + u v g.
    let (e, f) = (sub(*b, *a), sub(*d, *a));
    let g = sub(sub(*c, *b), f);
    let at = |u: f64, v: f64| add(*a, add(scale(u, e), add(scale(v, f), scale(u * v, g))));
    let (mut u, mut v) = (0.5, 0.5);
    let along = |u: f64, v: f64| [add(e, scale(v, g)), add(f, scale(u, g))];
    for _ in 0..STEPS {
        let [p, q] = along(u, v);
        let miss = sub(x, at(u, v));
        let (pp, pq, qq) = (dot(p, p), dot(p, q), dot(q, q));
        let (mp, mq) = (dot(miss, p), dot(miss, q));
        let det = pp * qq - pq * pq;
        let (du, dv) = ((qq * mp - pq * mq) / det, (pp * mq - pq * mp) / det);
        (u, v) = (u + du, v + dv);
        if du.abs().max(dv.abs()) < 1e-14 {
            break;
        }
    }
    let free = at(u, v);
    let (u, v) = (u.clamp(0.0, 1.0), v.clamp(0.0, 1.0));
    let point = at(u, v);
    let [p, q] = along(u, v);
    let product = cross(p, q);
    let normal = scale(1.0 / norm(product), product);
    let share = [(1.0 - u) * (1.0 - v), u * (1.0 - v), u * v, (1.0 - u) * v];
    Over { gap: dot(normal, sub(x, point)), beyond: norm(sub(free, point)), normal, point, share }
}

//! Elastic solids in a step: linear, so that one factor of M̂ serves all steps of a length.
//!
//! ```text
//! M (v⁺ − v_k) = h (f − C v_θ − K x_θ) + H r,     x⁺ = x_k + h v_θ,     x_θ = x_k + h θ v_θ
//! M̂ (v_free − v_k) = h (f − C v_k − K (x_k + h θ v_k)),     M̂ = M + h θ C + h² θ² K,     v⁺ = v_free + M̂⁻¹ H r
//! ```
//!
//! with the displacements x of all nodes and the weights f. W has `d_iᵀ (M̂⁻¹)_{pq} d_j` for directions d at nodes p and q of the same solid: the columns of M̂⁻¹ at a node are made when it first
//! touches, and kept. A node is a body of the step without a rotation; its own mass is infinite, for what it moves with is its solid.
//!
//! Energy: `T⁺ − T_k = h v_θ · f − h v_θ · (C v_θ + K x_θ) + v_θ · H r − (θ − ½) ‖v⁺ − v_k‖²_M`; the second term counts as work of forces, and `½ xᵀ K x` as potential energy.
//! Reference: Acary2016 for the energy of the scheme. Cost: a solve a step and solid, one for each pass with contacts, three for each node that touches for the first time.

use nonsmooth_linalg::{Csc, Matrix, SquareCholesky};
use nonsmooth_scenes::vec3::{Mat3, Vec3, add, scale};

use super::Stride;
use super::contact::Row;
use super::rigid::Rigid;
use crate::elastic::{Foot, Node, Nodes};
use crate::report::EnergyBalance;
use crate::state::State;
use crate::{LinearSystem, MoreauJean, SimulateError, World};

/// The elastic solids of a world with the memory of their steps.
pub(super) struct Solids {
    pub nodes: Nodes,
    /// Points of faces that nodes of others are over, this step.
    pub feet: Vec<Foot>,
    /// The number of bodies, from which on nodes and solids are counted.
    bodies: usize,
    solids: Vec<Solid>,
}

struct Solid {
    system: LinearSystem<3>,
    /// The work of the weights that the places without strain stand for: `Σ f · place`.
    height: f64,
    /// Where nothing holds it.
    rigid: Option<Rigid>,
    /// α of its damping, `C = α M + β K`.
    alpha: f64,
    /// Its nodes among all that may touch.
    nodes: std::ops::Range<usize>,
    /// M̂, with the h and θ that it is made for.
    hat: SquareCholesky,
    made_for: Option<(f64, f64)>,
    /// For each of its nodes that has touched, `(M̂⁻¹)_{qp}` for all of its nodes q.
    columns: Vec<Option<Vec<Mat3>>>,
    /// v without impulses, v⁺, and the impulses H r.
    free: Vec<f64>,
    v: Vec<f64>,
    impulse: Vec<f64>,
    work: Vec<f64>,
}

impl Solids {
    pub fn new(world: &World) -> Result<Self, SimulateError> {
        let nodes = Nodes::of(world);
        let solids = world.elastic.iter().enumerate().map(|(k, elastic)| {
            let system = LinearSystem::elastic(&elastic.solid, world.gravity)?;
            let places: Vec<Vec3> = elastic.solid.places().collect();
            let height = system.load.iter().zip(places.as_flattened()).map(|(f, x)| f * x).sum();
            let is_free = !elastic.solid.held.contains(&true);
            let own = |n: &Node| n.solid as usize == k;
            let first = nodes.list.iter().position(own).unwrap_or(0);
            let count = nodes.list.iter().filter(|n| own(n)).count();
            Ok(Solid {
                height,
                rigid: is_free.then(|| Rigid::new(&system.mass, &places)),
                alpha: elastic.solid.material.alpha,
                nodes: first..first + count,
                hat: SquareCholesky::default(),
                made_for: None,
                columns: vec![None; count],
                free: vec![],
                v: vec![],
                impulse: vec![],
                work: vec![],
                system,
            })
        });
        let solids = solids.collect::<Result<_, SimulateError>>()?;
        Ok(Self { bodies: world.bodies.len(), nodes, feet: vec![], solids })
    }

    pub fn len(&self) -> usize {
        self.solids.len()
    }

    pub fn is_empty(&self) -> bool {
        self.solids.is_empty()
    }

    /// The velocities without impulses; false where a number is not finite.
    pub fn begin(&mut self, stride: Stride, state: &State) -> bool {
        let each = self.solids.iter_mut().zip(&state.elastic);
        each.fold(true, |finite, (solid, state)| {
            let (x, v) = (state.displacement.as_flattened(), state.velocity.as_flattened());
            solid.begin(stride, x, v) && finite
        })
    }

    /// The velocity of a node without impulses.
    pub fn free(&self, node: usize) -> Vec3 {
        let Node { solid, node, .. } = self.nodes.list[node];
        at(&self.solids[solid as usize].free, node)
    }

    /// The solid of a node, or of a foot, which count on.
    pub fn owner(&self, place: usize) -> u32 {
        match place.checked_sub(self.nodes.list.len()) {
            None => self.nodes.list[place].solid,
            Some(foot) => self.feet[foot].solid,
        }
    }

    /// The nodes that make up a node, itself, or a foot, with their shares.
    fn parts(&self, place: usize) -> ([(usize, f64); 4], usize) {
        let mut parts = [(place, 1.0); 4];
        let Some(foot) = place.checked_sub(self.nodes.list.len()) else { return (parts, 1) };
        let mut count = 0;
        for part in self.feet[foot].parts() {
            parts[count] = part;
            count += 1;
        }
        (parts, count)
    }

    /// The velocities of a foot at the beginning of the step, and without impulses.
    pub fn foot_velocities(&self, foot: &Foot, state: &State) -> (Vec3, Vec3) {
        let velocity = &state.elastic[foot.solid as usize].velocity;
        foot.parts().fold(([0.0; 3], [0.0; 3]), |(v, free), (place, share)| {
            let now = velocity[self.nodes.list[place].node as usize];
            (add(v, scale(share, now)), add(free, scale(share, self.free(place))))
        })
    }

    /// Makes the columns of the nodes of a contact ready.
    pub fn reach(&mut self, row: &Row) {
        for arm in row.free_arms() {
            let Some(place) = (arm.body as usize).checked_sub(self.bodies) else { continue };
            let (parts, count) = self.parts(place);
            for &(place, _) in &parts[..count] {
                let solid = &mut self.solids[self.nodes.list[place].solid as usize];
                solid.reach(place, &self.nodes.list);
            }
        }
    }

    /// Adds what two contacts feel of each other through solids to their block of W.
    pub fn couple<const D: usize>(&self, block: &mut [[f64; D]; D], row: &Row, other: &Row) {
        for left in row.free_arms().filter(|a| a.body as usize >= self.bodies) {
            for right in other.free_arms().filter(|b| b.owner == left.owner) {
                let [p, q] = [left, right].map(|arm| arm.body as usize - self.bodies);
                let between = self.between(p, q);
                let sign = left.sign * right.sign;
                for i in 0..D {
                    let d = row.frame_end[i];
                    let along: Vec3 =
                        std::array::from_fn(|k| (0..3).map(|l| d[l] * between[l][k]).sum());
                    for j in 0..D {
                        let x: f64 = (0..3).map(|k| along[k] * other.frame[j][k]).sum();
                        block[i][j] += sign * x;
                    }
                }
            }
        }
    }

    /// `(M̂⁻¹)_{pq}` of nodes or feet of the same solid.
    fn between(&self, p: usize, q: usize) -> Mat3 {
        let block = |p: usize, q: usize| {
            let solid = &self.solids[self.nodes.list[p].solid as usize];
            let columns = solid.columns[q - solid.nodes.start].as_ref().expect("reached");
            &columns[p - solid.nodes.start]
        };
        let nodes = self.nodes.list.len();
        if p < nodes && q < nodes {
            return *block(p, q);
        }
        let ((left, m), (right, n)) = (self.parts(p), self.parts(q));
        let mut sum = [[0.0; 3]; 3];
        for &(p, share) in &left[..m] {
            for &(q, other) in &right[..n] {
                for (sum, x) in sum.iter_mut().flatten().zip(block(p, q).iter().flatten()) {
                    *sum += share * other * x;
                }
            }
        }
        sum
    }

    /// Forgets the impulses on solid k.
    pub fn clear(&mut self, k: u32) {
        self.solids[k as usize].impulse.fill(0.0);
    }

    /// Adds an impulse at a node or a foot.
    pub fn receive(&mut self, body: u32, x: f64, direction: Vec3) {
        let (parts, count) = self.parts(body as usize - self.bodies);
        for &(place, share) in &parts[..count] {
            let Node { solid, node, .. } = self.nodes.list[place];
            let r = &mut self.solids[solid as usize].impulse[3 * node as usize..][..3];
            r.iter_mut().zip(direction).for_each(|(r, d)| *r += share * x * d);
        }
    }

    /// The velocities of solid k after the step, with the impulses that it has; `tell` hears of its nodes and feet.
    pub fn respond(&mut self, k: u32, mut tell: impl FnMut(usize, Vec3)) {
        let solid = &mut self.solids[k as usize];
        let mut v = std::mem::take(&mut solid.v);
        v.clone_from(&solid.impulse);
        let whole = solid.of_force(&v);
        solid.answer(&mut v, whole);
        v.iter_mut().zip(&solid.free).for_each(|(v, free)| *v += *free);
        solid.v = v;
        for place in solid.nodes.clone() {
            tell(self.bodies + place, at(&solid.v, self.nodes.list[place].node));
        }
        let (nodes, v) = (&self.nodes.list, &self.solids[k as usize].v);
        for (number, foot) in self.feet.iter().enumerate().filter(|f| f.1.solid == k) {
            let moves = foot.parts().fold([0.0; 3], |sum, (place, share)| {
                add(sum, scale(share, at(v, nodes[place].node)))
            });
            tell(self.bodies + nodes.len() + number, moves);
        }
    }

    /// Adds their energy to the balance.
    pub fn energy(&mut self, stride: Stride, state: &State, e: &mut EnergyBalance) {
        for (solid, state) in self.solids.iter_mut().zip(&state.elastic) {
            let (x, v) = (state.displacement.as_flattened(), state.velocity.as_flattened());
            solid.energy(stride, x, v, e);
        }
    }

    /// Moves them.
    pub fn take(&self, scheme: &MoreauJean, h: f64, state: &mut State) {
        for (solid, state) in self.solids.iter().zip(&mut state.elastic) {
            let each = state.displacement.iter_mut().zip(&mut state.velocity);
            for ((x, v), new) in each.zip(solid.v.as_chunks::<3>().0) {
                *x = add(*x, scale(h, scheme.mean(*v, *new)));
                *v = *new;
            }
        }
    }

    pub fn is_finite(&self) -> bool {
        super::are_finite(self.solids.iter().flat_map(|s| &s.v).copied())
    }
}

impl Solid {
    fn begin(&mut self, Stride { scheme, h, .. }: Stride, x: &[f64], v: &[f64]) -> bool {
        let theta = scheme.theta;
        self.free.clear();
        self.free.extend_from_slice(v);
        if self.made_for != Some((h, theta)) {
            self.columns.fill(None);
            self.made_for = self.factorise(h, theta).is_ok().then_some((h, theta));
            if self.made_for.is_none() {
                return false;
            }
        }
        let LinearSystem { damping, stiffness, load, .. } = &self.system;
        let Self { rigid, work, free, .. } = self;
        // f − C v − K x_θ
        free.clone_from(load);
        work.clear();
        work.extend(x.iter().zip(v).map(|(x, v)| x + h * theta * v));
        if let Some(rigid) = rigid {
            rigid.remove(work);
        }
        stiffness.mul_add(-1.0, work, free);
        work.copy_from_slice(v);
        let part = rigid.as_ref().map(|rigid| rigid.remove(work));
        damping.mul_add(-1.0, work, free);
        free.iter_mut().for_each(|f| *f *= h);
        // Nothing inside of it moves it as a whole; C v is then α M v.
        let whole = rigid.as_ref().zip(part).map(|(rigid, part)| {
            let outer = rigid.of_force(load);
            std::array::from_fn(|i| h * (outer[i] - self.alpha * part[i]))
        });
        let mut free = std::mem::take(&mut self.free);
        self.answer(&mut free, whole);
        free.iter_mut().zip(v).for_each(|(free, v)| *free += v);
        self.free = free;
        self.v.clone_from(&self.free);
        self.impulse.clear();
        self.impulse.resize(v.len(), 0.0);
        super::are_finite(self.free.iter().copied())
    }

    /// What an impulse makes of what nothing holds as a whole.
    fn of_force(&self, impulse: &[f64]) -> Option<[f64; 6]> {
        self.rigid.as_ref().map(|rigid| rigid.of_force(impulse))
    }

    /// `M̂⁻¹ x`; `whole` is what x makes of the solid as a whole.
    fn answer(&mut self, x: &mut [f64], whole: Option<[f64; 6]>) {
        self.hat.solve(x);
        if let (Some(rigid), Some(whole), Some((h, theta))) = (&self.rigid, whole, self.made_for) {
            rigid.set(whole.map(|part| part / (1.0 + h * theta * self.alpha)), x);
        }
    }

    fn factorise(&mut self, h: f64, theta: f64) -> Result<(), ()> {
        let LinearSystem { mass, damping, stiffness, .. } = &self.system;
        let ht = h * theta;
        let part =
            |a: &Csc, x: f64| a.triplets().map(|(i, j, a)| (i, j, x * a)).collect::<Vec<_>>();
        let parts = [part(mass, 1.0), part(damping, ht), part(stiffness, ht * ht)].concat();
        let hat = Csc::from_triplets(mass.nrows(), mass.nrows(), parts.into_iter());
        self.hat.factorise(&Matrix::from(hat.map_err(drop)?)).map_err(drop)
    }

    /// The columns of M̂⁻¹ at the node of this place among all that may touch.
    fn reach(&mut self, place: usize, all: &[Node]) {
        let own = place - self.nodes.start;
        if self.columns[own].is_some() {
            return;
        }
        let mut blocks = vec![[[0.0; 3]; 3]; self.nodes.len()];
        let mut work = std::mem::take(&mut self.work);
        for k in 0..3 {
            work.clear();
            work.resize(self.impulse.len(), 0.0);
            work[3 * all[place].node as usize + k] = 1.0;
            let whole = self.of_force(&work);
            self.answer(&mut work, whole);
            for (block, other) in blocks.iter_mut().zip(&all[self.nodes.clone()]) {
                let column = at(&work, other.node);
                (0..3).for_each(|l| block[l][k] = column[l]);
            }
        }
        self.work = work;
        self.columns[own] = Some(blocks);
    }

    fn energy(
        &mut self,
        Stride { scheme, h, .. }: Stride,
        x: &[f64],
        old: &[f64],
        e: &mut EnergyBalance,
    ) {
        let Self { system, height, rigid, alpha, v, work, .. } = self;
        let theta = scheme.theta;
        let mut form = |a: &Csc, x: &[f64], y: &[f64]| {
            work.clear();
            work.resize(x.len(), 0.0);
            a.mul_add(1.0, x, work);
            work.iter().zip(y).map(|(p, q)| p * q).sum::<f64>()
        };
        let both = || v.iter().zip(old);
        let mean: Vec<f64> = both().map(|(new, old)| theta * new + (1.0 - theta) * old).collect();
        let change: Vec<f64> = both().map(|(new, old)| new - old).collect();
        let end: Vec<f64> = x.iter().zip(&mean).map(|(x, v)| x + h * v).collect();
        // Of strains alone; what moves as a whole is damped by α.
        let mut middle: Vec<f64> = x.iter().zip(&mean).map(|(x, v)| x + h * theta * v).collect();
        let (mut strained, mut straining) = (end.clone(), mean.clone());
        let mut whole = 0.0;
        if let Some(rigid) = rigid {
            rigid.remove(&mut middle);
            rigid.remove(&mut strained);
            let part = rigid.remove(&mut straining);
            whole = *alpha * part.iter().map(|x| x * x).sum::<f64>();
        }
        let [before, after] = [old, v].map(|v| 0.5 * form(&system.mass, v, v));
        let numerical = (theta - 0.5) * form(&system.mass, &change, &change);
        let inner = form(&system.damping, &straining, &straining)
            + whole
            + form(&system.stiffness, &middle, &straining);
        let strain = 0.5 * form(&system.stiffness, &strained, &strained);
        let along = |x: &[f64]| system.load.iter().zip(x).map(|(f, x)| f * x).sum::<f64>();
        let gravity = h * along(&mean);
        e.kinetic_before += before;
        e.kinetic += after;
        e.numerical += numerical;
        e.gravity += gravity;
        e.forces -= h * inner;
        e.potential += strain - along(&end) - *height;
        e.scale += gravity.abs() + (h * inner).abs() + strain;
    }
}

/// A node of a vector of all nodes.
fn at(x: &[f64], node: u32) -> Vec3 {
    let k = 3 * node as usize;
    [x[k], x[k + 1], x[k + 2]]
}

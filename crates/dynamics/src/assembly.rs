//! Assembly: a scene into the problem of one Moreau–Jean time step.
//!
//! At the velocity level, with `v_k` the velocity at the beginning of the step and positions frozen there,
//!
//! ```text
//! M v = H r + f,                 f = M v_k + h (m g + force, −ω × J ω),
//! u = Hᵀ v + w,                  w_N = e u_{N,k},  w_T = 0,  u_k = Hᵀ v_k  (Newton's impact law).
//! ```
//!
//! Each body has six degrees of freedom `[linear, angular]`, both in the world frame, and the block
//! `diag(m I, R J Rᵀ)` of M. A contact at p with frame `[N, T1, T2]` has the columns `(d, (p − x_b) × d)` for b
//! and minus `(d, (p − x_a) × d)` for a, with d each of N, T1, T2.
//!
//! An elastic solid ([`ElasticBox`]) has three degrees of freedom a node, after those of all bodies. Its forces
//! `−K x − C v` weigh θ at the end of the step and 1 − θ at its beginning, with `x' = x_k + h (θ v + (1 − θ) v_k)`
//! at its end (the θ-method of Jean1999):
//!
//! ```text
//! M (v − v_k) = h (F − θ (K x' + C v) − (1 − θ) (K x_k + C v_k)) + H r,      that is, with
//! M̂ = M + h θ C + h² θ² K      in place of M,
//! f = M̂ v_k + h (F − C v_k − K x_k − h θ K v_k).
//! ```
//!
//! A contact has the columns `N_a(p) d` at the nodes of the element that it touches, `N_a` their shape functions. A
//! held node keeps its diagonal of M̂, no part of f and no row of H: its velocity is zero.

use nonsmooth_problem::linalg::Csc;
use nonsmooth_problem::{FrictionGlobal, FrictionLocal};
use nonsmooth_solve::Reformulation;
use nonsmooth_solve::reform::Condense;

use crate::vec3::{add, apply, cross, scale, sub};
use crate::{Contact, ElasticBox, RigidBody, Scene, SceneError};

#[allow(non_snake_case)]
impl Scene {
    /// The time step as a global problem.
    ///
    /// Errors: those of [`Scene::validate`]; nothing that moves or no contacts.
    pub fn problem(&self) -> Result<FrictionGlobal<3>, SceneError> {
        self.validate()?;
        let (n, nc) = (self.dofs(), self.contacts.len());
        let mut mass: Vec<_> =
            self.bodies.iter().enumerate().flat_map(|(k, b)| mass_entries(6 * k, b)).collect();
        let starts = self.solid_starts();
        for (solid, at) in self.solids.iter().zip(&starts) {
            let matrix = solid.iteration_matrix(self.h)?;
            mass.extend(matrix.triplets().map(|(i, j, x)| (at + i, at + j, x)));
        }
        let mut jacobian: Vec<_> = self
            .contacts
            .iter()
            .enumerate()
            .flat_map(|(c, contact)| jacobian_entries(&self.bodies, c, contact))
            .collect();
        for (c, contact) in self.contacts.iter().enumerate() {
            self.push_solid_entries(&starts, c, contact, &mut jacobian);
        }
        let M = Csc::from_triplets(n, n, mass.into_iter())?;
        let H = Csc::from_triplets(n, 3 * nc, jacobian.into_iter())?;
        let v = self.velocities();
        let mut f: Vec<f64> = self.bodies.iter().flat_map(|b| self.drive(b)).collect();
        self.solids.iter().for_each(|s| f.extend(s.drive(self.h, self.gravity)));
        M.mul_add(1.0, &v, &mut f);
        let mut w = vec![0.0; 3 * nc];
        for (c, contact) in self.contacts.iter().enumerate() {
            w[3 * c] = contact.e * H.column_dot(3 * c, &v);
        }
        let mu = self.contacts.iter().map(|c| c.mu).collect();
        Ok(FrictionGlobal::new(M, H, f, w, mu)?)
    }

    /// The time step as a local problem, by [`Condense`].
    ///
    /// Errors: those of [`Scene::problem`].
    pub fn condensed(&self) -> Result<FrictionLocal<3>, SceneError> {
        Ok(Condense.reduce(&self.problem()?)?.0)
    }

    /// The velocities at the beginning of the step, as the problem stacks them.
    pub fn velocities(&self) -> Vec<f64> {
        let bodies = self.bodies.iter().flat_map(|b| [b.velocity, b.angular_velocity]);
        bodies
            .chain(self.solids.iter().flat_map(|s| s.velocity.iter().copied()))
            .flatten()
            .collect()
    }

    /// The first degree of freedom of each solid.
    fn solid_starts(&self) -> Vec<usize> {
        let bodies = 6 * self.bodies.len();
        let next = |at: &mut usize, s: &ElasticBox| Some(std::mem::replace(at, *at + s.dofs()));
        self.solids.iter().scan(bodies, next).collect()
    }

    /// The columns of H of contact number `c` at the nodes of solids.
    fn push_solid_entries(
        &self,
        starts: &[usize],
        c: usize,
        contact: &Contact,
        entries: &mut Vec<(usize, usize, f64)>,
    ) {
        let frame = contact.frame();
        for (sign, k) in [(1.0, Some(contact.b)), (-1.0, contact.a)] {
            let Some(k) = k.and_then(|k| k.checked_sub(self.bodies.len())) else { continue };
            let solid = &self.solids[k];
            let weights = solid.weights(contact.point).expect("validated");
            for (node, weight) in weights.into_iter().filter(|&(node, _)| !solid.held[node]) {
                for (column, d) in frame.iter().enumerate() {
                    let rows = (0..3).filter(|&i| d[i] != 0.0);
                    let at = starts[k] + 3 * node;
                    entries.extend(rows.map(|i| (at + i, 3 * c + column, sign * weight * d[i])));
                }
            }
        }
    }

    /// `h (m g + force, −ω × J ω)`.
    fn drive(&self, body: &RigidBody) -> [f64; 6] {
        let weight = add(scale(body.mass, self.gravity), body.force);
        let omega = body.angular_velocity;
        let gyroscopic = cross(apply(&body.world_inertia(), omega), omega);
        let all = [weight, gyroscopic];
        std::array::from_fn(|k| self.h * all[k / 3][k % 3])
    }
}

/// The block `diag(m I, R J Rᵀ)` of a body whose degrees of freedom start at `at`.
fn mass_entries(at: usize, body: &RigidBody) -> Vec<(usize, usize, f64)> {
    let inertia = body.world_inertia();
    let linear = (0..3).map(|k| (at + k, at + k, body.mass));
    // The product R J Rᵀ is symmetric up to rounding only; its mean with its transpose is so exactly.
    let angular = (0..9)
        .map(|k| (k / 3, k % 3))
        .map(|(k, l)| (at + 3 + k, at + 3 + l, 0.5 * (inertia[k][l] + inertia[l][k])));
    linear.chain(angular.filter(|e| e.2 != 0.0)).collect()
}

/// The columns of H of contact number `c` at rigid bodies.
fn jacobian_entries(
    bodies: &[RigidBody],
    c: usize,
    contact: &Contact,
) -> impl Iterator<Item = (usize, usize, f64)> {
    let frame = contact.frame();
    let sides = [(1.0, Some(contact.b)), (-1.0, contact.a)];
    let rigid = |k: &usize| *k < bodies.len();
    let sides = sides.into_iter().filter_map(move |(sign, body)| Some((sign, body.filter(rigid)?)));
    sides.flat_map(move |(sign, k)| {
        let arm = sub(contact.point, bodies[k].position);
        (0..18).filter_map(move |i| {
            let (column, row) = (i / 6, i % 6);
            let d = frame[column];
            let x = sign * if row < 3 { d[row] } else { cross(arm, d)[row - 3] };
            (x != 0.0).then_some((6 * k + row, 3 * c + column, x))
        })
    })
}

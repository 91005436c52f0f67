//! Assembly: a scene into the problem of one Moreau–Jean time step.
//!
//! At the velocity level, with `v_k` the velocity at the beginning of the step and positions frozen there,
//!
//! ```text
//! M v = H r + f,                 f = M v_k + h (m g + force, −ω × J ω),
//! u = Hᵀ v + w,                  w = s + (e u_{N,k}, 0, 0),      u_k = Hᵀ v_k + s  (Newton's impact law).
//! ```
//!
//! s is minus the given velocity of images and walls ([`crate::Image`]) in the frame of the contact; elsewhere zero.
//!
//! Each body has six degrees of freedom `[linear, angular]`, both in the world frame, and the block
//! `diag(m I, R J Rᵀ)` of M. A contact at p with frame `[N, T1, T2]` has the columns `(d, (p − x_b) × d)` for b
//! and minus `(d, (p − x_a) × d)` for a, with d each of N, T1, T2; where an image of a touches, x_a is the place of the image. With rolling friction two more,
//! `(0, d)` for b and minus that for a with d each of T1, T2: the angular velocity of b seen from a. The points of an elastic solid have none.
//!
//! With [`Gyroscopic::Implicit`] the torque `g(ω) = ω × J ω` is linearised about `ω_k`: the block of M becomes
//! `J + h G` with `G = ∂g/∂ω = [ω_k]× J − [J ω_k]×`, and f is stated with that M, so that
//! `J (ω − ω_k) = −h (g(ω_k) + G (ω − ω_k))` without impulses.
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
//! A contact has the columns `±N_j(p) d` at the nodes j of the element that it touches, `N_j` their shape functions, at
//! `p − offset` where an image of a touches. A held node keeps its diagonal of M̂, no part of f and no row of H: its
//! velocity is zero.

use std::array::from_fn;

use nonsmooth_linalg::Csc;
use nonsmooth_problem::{Friction, FrictionGlobal, FrictionLocal, RollingGlobal};
use nonsmooth_solve::Reformulation;
use nonsmooth_solve::contact::Condense;

use crate::vec3::{Mat3, Vec3, add, apply, cross, dot, scale, sub};
use crate::{Contact, ElasticBox, Gyroscopic, RigidBody, Scene, SceneError};

#[allow(non_snake_case)]
impl Scene {
    /// The time step as a global problem.
    ///
    /// Errors: those of [`Scene::validate`]; nothing that moves or no contacts.
    pub fn problem(&self) -> Result<FrictionGlobal<3>, SceneError> {
        self.validate()?;
        let (n, nc) = (self.dofs(), self.contacts.len());
        let mut mass: Vec<_> =
            self.bodies.iter().enumerate().flat_map(|(k, b)| self.mass_entries(6 * k, b)).collect();
        let starts = self.solid_starts();
        for (solid, at) in self.solids.iter().zip(&starts) {
            let matrix = solid.iteration_matrix(self.h)?;
            mass.extend(matrix.triplets().map(|(i, j, x)| (at + i, at + j, x)));
        }
        let jacobian: Vec<_> = self
            .contacts
            .iter()
            .enumerate()
            .flat_map(|(c, contact)| self.jacobian_entries(&starts, c, contact))
            .collect();
        let M = Csc::from_triplets(n, n, mass.into_iter())?;
        let H = Csc::from_triplets(n, 3 * nc, jacobian.into_iter())?;
        let v = self.velocities();
        let mut f: Vec<f64> = self.bodies.iter().flat_map(|b| self.drive(b)).collect();
        self.solids.iter().for_each(|s| f.extend(s.drive(self.h, self.gravity)));
        M.mul_add(1.0, &v, &mut f);
        let mut w = vec![0.0; 3 * nc];
        for (c, contact) in self.contacts.iter().enumerate() {
            let frame = contact.frame();
            for k in 0..3 {
                w[3 * c + k] = -dot(frame[k], contact.image.velocity);
            }
            w[3 * c] += contact.e * (H.column_dot(3 * c, &v) + w[3 * c]);
        }
        let mu = self.contacts.iter().map(|c| c.mu).collect();
        Ok(FrictionGlobal::new(M, H, f, w, mu)?)
    }

    /// The time step with rolling friction as a global problem.
    ///
    /// Errors: those of [`Scene::problem`].
    pub fn rolling(&self) -> Result<RollingGlobal, SceneError> {
        let FrictionGlobal { M, H, f, w, mu, .. } = self.problem()?;
        let nc = self.contacts.len();
        let mut jacobian: Vec<_> =
            H.triplets().map(|(i, j, x)| (i, 5 * (j / 3) + j % 3, x)).collect();
        for (c, contact) in self.contacts.iter().enumerate() {
            let [_, tangents @ ..] = contact.frame();
            for (sign, k, _) in contact.sides().filter(|side| side.1 < self.bodies.len()) {
                for (column, d) in tangents.iter().enumerate() {
                    let rows = (0..3).filter(|&i| d[i] != 0.0);
                    let at = 5 * c + 3 + column;
                    jacobian.extend(rows.map(|i| (6 * k + 3 + i, at, sign * d[i])));
                }
            }
        }
        let H = Csc::from_triplets(f.len(), 5 * nc, jacobian.into_iter())?;
        let mut all = vec![0.0; 5 * nc];
        w.iter().enumerate().for_each(|(i, w)| all[5 * (i / 3) + i % 3] = *w);
        let mu_r = self.contacts.iter().map(|c| c.mu_r).collect();
        Ok(RollingGlobal::rolling(M, H, f, all, mu, mu_r)?)
    }

    /// The time step as a problem with rolling friction where a contact has any, global or condensed.
    ///
    /// Errors: those of [`Scene::problem`].
    pub fn stated(&self, condensed: bool) -> Result<Friction, SceneError> {
        let rolls = self.contacts.iter().any(|c| c.mu_r > 0.0);
        Ok(match (rolls, condensed) {
            (false, false) => Friction::Global3(self.problem()?),
            (false, true) => Friction::Local3(self.condensed()?),
            (true, false) => Friction::RollingGlobal(self.rolling()?),
            (true, true) => Friction::RollingLocal(Condense.reduce(&self.rolling()?)?.0),
        })
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

    /// The three columns of H of contact number `c`; `starts` are those of the solids.
    fn jacobian_entries(
        &self,
        starts: &[usize],
        c: usize,
        contact: &Contact,
    ) -> Vec<(usize, usize, f64)> {
        let frame = contact.frame();
        let mut entries = vec![];
        for (sign, k, point) in contact.sides() {
            // The rows from `first` on, where the column of direction d has `factor` times `part(d)`.
            let mut push = |first: usize, factor: f64, part: &dyn Fn(Vec3) -> Vec3| {
                for (column, x) in frame.map(part).iter().enumerate() {
                    let rows = (0..3).filter(|&i| x[i] != 0.0);
                    entries.extend(rows.map(|i| (first + i, 3 * c + column, factor * x[i])));
                }
            };
            if let Some(body) = self.bodies.get(k) {
                let arm = sub(point, body.position);
                push(6 * k, sign, &|d| d);
                push(6 * k + 3, sign, &|d| cross(arm, d));
            } else {
                let s = k - self.bodies.len();
                let solid = &self.solids[s];
                let weights = solid.weights(point).expect("validated");
                for (node, weight) in weights.into_iter().filter(|w| !solid.held[w.0]) {
                    push(starts[s] + 3 * node, sign * weight, &|d| d);
                }
            }
        }
        entries
    }

    /// `h (m g + force, −ω × J ω)`.
    fn drive(&self, body: &RigidBody) -> [f64; 6] {
        let weight = add(scale(body.mass, self.gravity), body.force);
        let omega = body.angular_velocity;
        let gyroscopic = cross(apply(&body.world_inertia(), omega), omega);
        let all = [weight, gyroscopic];
        from_fn(|k| self.h * all[k / 3][k % 3])
    }

    /// The block of M of a body whose degrees of freedom start at `at`.
    fn mass_entries(&self, at: usize, body: &RigidBody) -> Vec<(usize, usize, f64)> {
        let J = body.world_inertia();
        // The product R J Rᵀ is symmetric up to rounding only; its mean with its transpose is so exactly.
        let mut angular: Mat3 = from_fn(|k| from_fn(|l| 0.5 * (J[k][l] + J[l][k])));
        if self.gyroscopic == Gyroscopic::Implicit {
            let omega = body.angular_velocity;
            let momentum = apply(&J, omega);
            for l in 0..3 {
                let unit: Vec3 = from_fn(|k| f64::from(u8::from(k == l)));
                // Column l of G: ω × (J e_l) − (J ω) × e_l.
                let column = sub(cross(omega, apply(&J, unit)), cross(momentum, unit));
                (0..3).for_each(|k| angular[k][l] += self.h * column[k]);
            }
        }
        let linear = (0..3).map(|k| (at + k, at + k, body.mass));
        let angular =
            (0..9).map(|i| (i / 3, i % 3)).map(|(k, l)| (at + 3 + k, at + 3 + l, angular[k][l]));
        linear.chain(angular.filter(|e| e.2 != 0.0)).collect()
    }
}

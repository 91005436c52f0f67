//! Lagrangian systems with contacts, relations and scalar rows: the discrete problem P_MNL.
//!
//! A user states what is in `M(q) dv = F(t, q, v) dt + H(q) di + G(q) dλ` by a [`Lagrangian`]; a [`LagrangianSimulation`] moves it. What is not given (derivatives
//! of F, gradients of gaps and relations) is made by central differences.

mod coupling;
mod differences;
mod elastic;
mod energy;
mod gradients;
mod linear;
mod lines;
mod matrices;
mod project;
mod scheme;
mod simulation;
mod state;
mod step;

pub use linear::{LinearContact, LinearRow, LinearSystem};
pub use scheme::{Directions, LagrangianScheme, RelationsAt};
pub use simulation::LagrangianSimulation;
pub use state::{LagrangianContact, LagrangianState};

use nonsmooth_linalg::{Csc, Dense};

use crate::{Law, SimulateError};

/// How many of what a [`Lagrangian`] has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Size {
    /// n, degrees of freedom.
    pub dofs: usize,
    /// nc, points that may touch, with or without friction.
    pub contacts: usize,
    /// p, bilateral relations `φ(t, q) = 0`.
    pub relations: usize,
    /// Scalar rows: limits, motors, dry friction on a coordinate.
    pub rows: usize,
}

impl Size {
    /// n degrees of freedom, nothing that holds them.
    pub fn new(dofs: usize) -> Self {
        Self { dofs, ..Self::default() }
    }

    /// The same with nc contacts.
    #[must_use]
    pub fn contacts(self, contacts: usize) -> Self {
        Self { contacts, ..self }
    }

    /// The same with p bilateral relations.
    #[must_use]
    pub fn relations(self, relations: usize) -> Self {
        Self { relations, ..self }
    }

    /// The same with scalar rows.
    #[must_use]
    pub fn rows(self, rows: usize) -> Self {
        Self { rows, ..self }
    }
}

/// The law of a scalar row: what its impulse λ has to do with the rate `c = jᵀ v + b` of its coordinate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RowLaw {
    /// A limit: the coordinate is a gap, and `0 ≤ λ ⟂ c⁺ + e c⁻ ≥ 0` where it closes.
    Limit {
        /// Coefficient of restitution, from 0 to 1.
        e: f64,
    },
    /// A force between two bounds (N, N·m), `h·lower ≤ λ ≤ h·upper` and `−c ∈ N(λ)`: a motor that is to reach the velocity `−b` with what strength it has, dry
    /// friction on the coordinate for b = 0.
    Force {
        /// The least force.
        lower: f64,
        /// The largest force.
        upper: f64,
    },
}

impl RowLaw {
    /// Dry friction: a force of at most `bound` against the motion.
    pub fn friction(bound: f64) -> Self {
        Self::Force { lower: -bound, upper: bound }
    }
}

/// The matrices of a linear system, each n × n: M symmetric positive definite, `C = −∂F/∂v`, `K = −∂F/∂q`.
#[derive(Debug, Clone, Copy)]
pub struct Constant<'a> {
    /// M.
    pub mass: &'a Csc,
    /// C.
    pub damping: &'a Csc,
    /// K.
    pub stiffness: &'a Csc,
}

/// A mechanical system in generalised coordinates, with `q' = v`:
///
/// ```text
/// M(q) dv = F(t, q, v) dt + H(q) di + G(q) dλ,
/// contacts   u = Hᵀ v + s,   Coulomb's law with Newton's or Frémond's impact law where the gap g(t, q) is closed;
/// relations  φ(t, q) = 0,    G = ∂φ/∂qᵀ;
/// rows       c = Jᵀ v + b,   a limit or a force between bounds.
/// ```
///
/// F is **all** that is not M v': given forces, springs, dampers, weight, and with the sign of a force the terms in which velocities are squared (centrifugal,
/// Coriolis and gyroscopic), `F = Q − C(q, v) v` where Lagrange's equations are `M v' + C(q, v) v = Q`.
///
/// D is 2 for contacts `[N, T]` and 3 for `[N, T1, T2]`; a system without contacts may take either. What is written into comes filled with zeros. A number that
/// is not finite ends the step with [`StepStatus::NotFinite`](crate::StepStatus::NotFinite).
pub trait Lagrangian<const D: usize> {
    /// How many of what there are; it never changes.
    fn size(&self) -> Size;

    /// Checks the data of the system, before it moves and before it goes on after a call of [`system_mut`](LagrangianSimulation::system_mut).
    fn validate(&self) -> Result<(), SimulateError> {
        Ok(())
    }

    /// M(q), n × n, symmetric positive definite.
    fn mass(&self, q: &[f64], mass: &mut Dense);

    /// F(t, q, v), n.
    fn force(&self, t: f64, q: &[f64], v: &[f64], force: &mut [f64]);

    /// ∂F/∂q, n × n; false where it is not given and differences are to be taken.
    fn force_by_position(&self, _t: f64, _q: &[f64], _v: &[f64], _out: &mut Dense) -> bool {
        false
    }

    /// ∂F/∂v, n × n; false where it is not given and differences are to be taken.
    fn force_by_velocity(&self, _t: f64, _q: &[f64], _v: &[f64], _out: &mut Dense) -> bool {
        false
    }

    /// The potential energy of F, J, for the report.
    fn potential(&self, _t: f64, _q: &[f64]) -> f64 {
        0.0
    }

    /// The matrices of a system that is linear but for its contacts; M̂ is then sparse, factorised once for each step size, and a step takes one iteration.
    fn constant(&self) -> Option<Constant<'_>> {
        None
    }

    /// The size that a coordinate or a velocity typically has: differences are taken over a thousandth of it.
    fn typical(&self) -> f64 {
        1.0
    }

    /// The gaps g(t, q), nc, negative in penetration.
    fn gaps(&self, _t: f64, _q: &[f64], _gaps: &mut [f64]) {}

    /// Hᵀ(q), D·nc × n: of each contact the row that makes the rate of its gap of v, then those of the tangents. False where it is not given: normals are then the
    /// gradients of the gaps, and contacts are frictionless.
    fn directions(&self, _t: f64, _q: &[f64], _directions: &mut Dense) -> bool {
        false
    }

    /// s, D·nc: the part of u that does not come from v, of belts and walls that are moved. That of a normal is ∂g/∂t.
    fn surface(&self, _t: f64, _q: &[f64], _s: &mut [f64]) {}

    /// The law of a contact, by the state at the beginning of the step.
    fn law(&self, _contact: usize, _t: f64, _q: &[f64], _v: &[f64]) -> Law {
        Law::default()
    }

    /// φ(t, q), p.
    fn relations(&self, _t: f64, _q: &[f64], _phi: &mut [f64]) {}

    /// Gᵀ(t, q) = ∂φ/∂q, p × n; false where differences are to be taken.
    fn relation_gradients(&self, _t: f64, _q: &[f64], _gradients: &mut Dense) -> bool {
        false
    }

    /// The coordinates of the scalar rows: of a limit its gap, of a motor or of friction what it acts on.
    fn rows(&self, _t: f64, _q: &[f64], _coordinates: &mut [f64]) {}

    /// Jᵀ(q), rows × n; false where differences of [`rows`](Self::rows) are to be taken.
    fn row_gradients(&self, _t: f64, _q: &[f64], _gradients: &mut Dense) -> bool {
        false
    }

    /// b, rows: the part of c that does not come from v, for example minus the velocity that a motor is to reach.
    fn row_velocities(&self, _t: f64, _q: &[f64], _b: &mut [f64]) {}

    /// The law of a scalar row, by the state at the beginning of the step.
    fn row_law(&self, _row: usize, _t: f64, _q: &[f64], _v: &[f64]) -> RowLaw {
        RowLaw::Limit { e: 0.0 }
    }
}

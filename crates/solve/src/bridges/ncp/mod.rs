//! Friction as a nonlinear complementarity problem: Coulomb's law itself, for the methods of `l ≤ x ≤ u ⟂ F(x)`.
//!
//! | edge | the law of a contact that is pressed | unknowns a contact in space | F | source |
//! | --- | --- | --- | --- | --- |
//! | [`First`] | `κ r_T + mu r_N u_T = 0`, `0 ≤ κ ⟂ mu r_N − ‖r_T‖ ≥ 0` | 4 | has a root | lecture (78)–(80) |
//! | [`Glocker`] | `u_T + Σ κ_i e_i + 2 κ_D r_T = 0`, `0 ≤ κ_j ⟂ σ_j ≥ 0` | 7 | quadratic | lecture (81)–(86); Glocker1999 |
//!
//! In both `0 ≤ r_N ⟂ u_N ≥ 0`, `u = W r + q`, and r_T is free. F is stated as expressions in pure numbers: `√w_c r_c / s`, `u_c / (√w_c s)` with w_c the mean
//! diagonal of the contact's block and `s = max ‖q_c‖/√w_c`, so that the blocks of W become one in the mean and the largest free velocity 1. Bilateral constraints are eliminated as everywhere
//! (`W − V R⁻¹ Vᵀ`), scalar rows with bounds are refused, frictionless contacts keep `r_N` alone.
//!
//! A solver starts from `r − ũ/w_c`, projected on the cone, with the multipliers that oppose u_T there.
//!
//! **Where the Jacobian is singular.** At an open contact, in both forms, because its multipliers are not unique: with `r = 0` the saturation of the cone holds no
//! gradient, any `κ ≥ 0` or `κ_D ≥ 0` will do, and to the κ_i any number may be added, `Σ e_i = 0`. And wherever W has a null vector among the impulses of contacts that stick inside the cone (hyperstatic problems):
//! their rows are rows of W alone. Methods that solve with JF live of their regularisation there, those with pivots choose one of the multipliers.

mod first;
mod glocker;

pub use first::First;
pub use glocker::Glocker;

use nonsmooth_linalg::budget::Pace;
use nonsmooth_linalg::small;
use nonsmooth_problem::check::Certificate;
use nonsmooth_problem::field::{Expressions, Graph, Id, Node};
use nonsmooth_problem::{FrictionLocal, Kind, LcpPoint, LocalPoint, Mcp, Problem};

use super::kept::{Kept, normal_impulses};
use crate::contact::form::Contacts;
use crate::contact::law::cone;
use crate::core::reformulation::Reformulation;
use crate::core::register::{Composed, Over};
use crate::core::settings::NoSettings;
use crate::{Boxed, SolveError, Via, ViaSession};

/// A way to say Coulomb's law of a contact by pairs and equations: rows for r_T, and multipliers κ ≥ 0, each with a row.
pub trait Formulation<const D: usize>: Copy + Default + Send + Sync + 'static {
    /// The name before the slash.
    const NAME: &'static str;
    /// One line, without the name.
    const SUMMARY: &'static str;
    /// Keys of `docs/refs.bib`.
    const CITES: &'static [&'static str];
    /// The number of multipliers of a contact with friction.
    const MULTIPLIERS: usize;

    /// Directions that span the tangential plane by nonnegative sums, where multipliers belong to such.
    fn directions() -> Vec<[f64; 2]> {
        vec![]
    }

    /// Adds the rows of r_T, then those of κ.
    fn state(graph: &mut Graph, slot: &Slot<D>, directions: &[[f64; 2]], rows: &mut Vec<Id>);

    /// The multipliers at an impulse of the cone and the velocity that it is to oppose; κ comes as zeros.
    fn multipliers(
        law: Law,
        directions: &[[f64; 2]],
        r: &[f64; D],
        u: &[f64; D],
        kappa: &mut [f64],
    );
}

/// What the rows of a contact with friction are made with, besides its velocity.
#[derive(Debug, Clone, Copy)]
pub struct Law {
    /// The coefficient of friction, positive.
    pub mu: f64,
    /// The `mu r_N` by which the contact alone would end its approach, 1 where it does not approach: a unit for its tangential impulse.
    pub usual: f64,
}

/// A contact with friction in the problem that is being stated.
pub struct Slot<const D: usize> {
    /// The law.
    pub law: Law,
    /// The variable of r_N; those of r_T follow, then those of κ.
    pub first: usize,
    /// u, by the coefficients of the variables and a constant.
    pub velocity: [(Vec<(usize, f64)>, f64); D],
}

impl<const D: usize> Slot<D> {
    /// The variable of the multiplier of this number.
    pub fn kappa(&self, j: usize) -> usize {
        self.first + D + j
    }
}

/// The part of `mu r_N` from which on an impulse is taken to be on the boundary of the cone.
const LIMIT: f64 = 1.0 - 1e-12;

/// The solvers that are listed behind the prefixes: the one that solves most, and `auto`.
const LISTED: &[&str] = &["path", "auto"];

/// Operations that an entry of W takes to be stated, or so.
const EACH: f64 = 100.0;

/// An impulse that is taken for none, in units of s.
const NEGLIGIBLE: f64 = 1e-10;

/// `Σ c_i x_i + constant`.
fn affine(graph: &mut Graph, terms: Vec<(usize, f64)>, constant: f64) -> Id {
    let linear = graph.add(Node::Linear(terms));
    let constant = graph.constant(constant);
    graph.sum(vec![linear, constant])
}

/// The edge from contacts to the mixed complementarity problem of a formulation.
#[derive(Debug, Clone, Copy, Default)]
pub struct AsNcp<F>(pub F);

impl<F: Formulation<D>, const D: usize> Composed<FrictionLocal<D>> for AsNcp<F> {
    type To = Mcp;
    type Settings = NoSettings;
    const NAME: &'static str = F::NAME;
    const SUMMARY: &'static str = F::SUMMARY;
    const FROM: &'static [Kind] = &[Kind::FrictionLocal2d, Kind::FrictionLocal3d];
    const CITES: &'static [&'static str] = F::CITES;
    const SESSION: Option<Over<NoSettings, Mcp, FrictionLocal<D>>> =
        Some(|_, session| Box::new(ViaSession::new(Self::default(), session)));

    fn compose(_: NoSettings, solver: Boxed<Mcp>) -> Boxed<FrictionLocal<D>> {
        Boxed::new(Via { reformulation: Self::default(), solver })
    }

    fn lists(solver: &str) -> bool {
        LISTED.contains(&solver)
    }
}

/// What the way back needs.
pub struct NcpMemo<const D: usize> {
    kept: Kept<D>,
    /// `√w_c`
    root: Vec<f64>,
    /// s
    size: f64,
    /// The first variable of each contact, and their number.
    starts: Vec<usize>,
}

impl<const D: usize> NcpMemo<D> {
    fn update(&mut self, problem: &FrictionLocal<D>, multipliers: usize) {
        let Self { kept, root, size, starts } = self;
        root.clear();
        root.extend(kept.unit.iter().map(|w| w.sqrt()));
        let (_, free) = kept.state.operator(problem);
        *size = free
            .chunks(D)
            .zip(&*root)
            .fold(0.0, |s, (q, root)| s.max(nonsmooth_linalg::norm(q) / root));
        if !(*size > 0.0 && size.is_finite()) {
            *size = 1.0;
        }
        starts.clear();
        starts.push(0);
        let mut at = 0;
        for &mu in &problem.mu {
            at += if mu > 0.0 { D + multipliers } else { 1 };
            starts.push(at);
        }
    }

    fn len(&self) -> usize {
        self.starts[self.starts.len() - 1]
    }

    fn law(&self, problem: &FrictionLocal<D>, c: usize) -> Law {
        let mu = problem.mu[c];
        let (_, free) = self.kept.state.operator(problem);
        let usual = -mu * free[D * c] / (self.root[c] * self.size);
        Law { mu, usual: if usual > NEGLIGIBLE { usual } else { 1.0 } }
    }

    /// How many components of contact c's impulse are variables.
    fn components(&self, c: usize) -> usize {
        if self.starts[c + 1] - self.starts[c] > 1 { D } else { 1 }
    }

    /// `u_k / (√w_c s)` of contact c, by the variables.
    fn velocity(&self, problem: &FrictionLocal<D>, c: usize, k: usize) -> (Vec<(usize, f64)>, f64) {
        let (w, free) = self.kept.state.operator(problem);
        let (columns, blocks) = w.row(c);
        let mut terms = vec![];
        for (&d, block) in columns.iter().zip(blocks) {
            let d = d as usize;
            let scale = self.root[c] * self.root[d];
            let entries = block[k][..self.components(d)].iter().enumerate();
            let stored = entries.filter(|(_, w)| **w != 0.0);
            terms.extend(stored.map(|(l, w)| (self.starts[d] + l, w / scale)));
        }
        (terms, free[D * c + k] / (self.root[c] * self.size))
    }

    fn state<F: Formulation<D>>(&self, problem: &FrictionLocal<D>) -> Result<Mcp, SolveError> {
        let n = self.len();
        let mut graph = Graph::new(n);
        let mut rows = Vec::with_capacity(n);
        let (mut lower, upper) = (vec![0.0; n], vec![f64::INFINITY; n]);
        let mut pace = Pace::default();
        for c in 0..problem.mu.len() {
            let entries = D * D * self.kept.state.operator(problem).0.row(c).0.len();
            if pace.over(EACH * entries as f64) {
                return Err(SolveError::needs(
                    "the time to state its equations",
                    format!("a limit that was reached at contact {c}"),
                ));
            }
            let first = self.starts[c];
            let (terms, constant) = self.velocity(problem, c, 0);
            rows.push(affine(&mut graph, terms, constant));
            if self.components(c) > 1 {
                lower[first + 1..first + D].fill(f64::NEG_INFINITY);
                let velocity = std::array::from_fn(|k| self.velocity(problem, c, k));
                let slot = Slot { law: self.law(problem, c), first, velocity };
                F::state(&mut graph, &slot, &self.kept.directions, &mut rows);
            }
        }
        let mut start = LcpPoint { z: vec![] };
        self.lower::<F>(problem, &problem.origin().r, &mut start);
        Ok(Mcp::new(Expressions::new(graph, rows)?, lower, upper, start.z)?)
    }

    fn lower<F: Formulation<D>>(
        &self,
        problem: &FrictionLocal<D>,
        r: &[f64],
        reduced: &mut LcpPoint,
    ) {
        let z = &mut reduced.z;
        z.resize(self.len(), 0.0);
        z.fill(0.0);
        let (w, free) = self.kept.state.operator(problem);
        for (c, &mu) in problem.mu.iter().enumerate() {
            let (first, root) = (self.starts[c], self.root[c]);
            let mut u = w.row_product(c, r);
            for (k, u) in u.iter_mut().enumerate() {
                *u = (*u + free[D * c + k]) / (root * self.size);
            }
            let mut x = small::block::<D>(r, c).map(|r| r * root / self.size);
            x.iter_mut().zip(&u).for_each(|(x, u)| *x -= u);
            x[0] -= mu * small::tangential_norm(&u);
            let x = cone::project(&x, mu);
            let components = self.components(c);
            z[first..first + components].copy_from_slice(&x[..components]);
            let kappa = &mut z[first + components..self.starts[c + 1]];
            if !kappa.is_empty() {
                F::multipliers(self.law(problem, c), &self.kept.directions, &x, &u, kappa);
            }
        }
    }
}

impl<F: Formulation<D>, const D: usize> Reformulation<FrictionLocal<D>> for AsNcp<F> {
    type To = Mcp;
    type Memo = NcpMemo<D>;

    fn reduce(&self, problem: &FrictionLocal<D>) -> Result<(Mcp, NcpMemo<D>), SolveError> {
        let kept = Kept::new(problem, F::directions())?;
        let mut memo = NcpMemo { kept, root: vec![], size: 1.0, starts: vec![] };
        memo.update(problem, F::MULTIPLIERS);
        Ok((memo.state::<F>(problem)?, memo))
    }

    /// The expressions are stated anew, as [`reduce`](Reformulation::reduce) does: both look at the limits every few milliseconds.
    fn reduce_again(
        &self,
        problem: &FrictionLocal<D>,
        reduced: &mut Mcp,
        memo: &mut NcpMemo<D>,
    ) -> Result<(), SolveError> {
        memo.kept.refill(problem)?;
        memo.update(problem, F::MULTIPLIERS);
        *reduced = memo.state::<F>(problem)?;
        Ok(())
    }

    fn contradiction(&self, memo: &NcpMemo<D>) -> Option<Certificate> {
        memo.kept.contradiction.clone().map(Certificate::from)
    }

    fn lift_certificate(&self, certificate: Certificate, memo: &NcpMemo<D>) -> Certificate {
        let contacts = memo.root.len();
        let row = |c: usize| memo.starts[c];
        normal_impulses(certificate, &memo.kept, contacts, row, |c| 1.0 / memo.root[c])
    }

    fn lower(
        &self,
        problem: &FrictionLocal<D>,
        point: &LocalPoint,
        memo: &NcpMemo<D>,
        reduced: &mut LcpPoint,
    ) {
        memo.lower::<F>(problem, &point.r, reduced);
    }

    fn lift(
        &self,
        problem: &FrictionLocal<D>,
        reduced: &LcpPoint,
        memo: &mut NcpMemo<D>,
        point: &mut LocalPoint,
    ) {
        point.r.fill(0.0);
        for c in 0..problem.mu.len() {
            let (first, components) = (memo.starts[c], memo.components(c));
            let x = &reduced.z[first..first + components];
            let scale = memo.size / memo.root[c];
            point.r[D * c..].iter_mut().zip(x).for_each(|(r, x)| *r = scale * x);
        }
        problem.complete(&mut memo.kept.state, point);
    }
}

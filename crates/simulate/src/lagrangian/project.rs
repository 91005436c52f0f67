//! Direct projection: the smallest move of the coordinates, in the norm of M, that puts them on the relations and out of penetration.
//!
//! ```text
//! min ½ ‖Δ‖²_M   such that   φ(q + Δ) = 0,   g(q + Δ) ≥ 0 for the contacts and limits that took part in the step
//! ```
//!
//! by Newton's method: each iterate is a frictionless problem `M Δ = Gκ + Hν, GᵀΔ + φ = 0, 0 ≤ HᵀΔ + g ⟂ ν ≥ 0`, stated as scalar rows and solved by the solver of the steps. Velocities
//! are not touched. Reference: Acary2013, the direct projection. Two iterations usually suffice; fails (false) where relations contradict each other.

use nonsmooth_linalg::{Csc, Dense};
use nonsmooth_problem::{Bounds, FrictionLocal, LocalPoint, RowsLocal};
use nonsmooth_solve::registry::{self, Registered};
use nonsmooth_solve::settings::SettingsMap;
use nonsmooth_solve::{Limits, Session, Status};

use super::Lagrangian;
use super::gradients::{Gradients, dot};
use super::lines::Lines;
use super::matrices::Matrices;
use super::step::{empty, zero};
use crate::SimulateError;

/// The most iterations.
const PASSES: usize = 10;

/// The projection with its memory.
pub(super) struct Projection<const D: usize> {
    gradients: Gradients,
    solved: Dense,
    /// The lines: all relations, then what is unilateral.
    lines: Vec<usize>,
    /// Gaps, φ and coordinates of all contacts, relations and rows, and those of the lines.
    all: [Vec<f64>; 3],
    values: Vec<f64>,
    session: Box<dyn Session<FrictionLocal<D>>>,
    problem: FrictionLocal<D>,
    point: LocalPoint,
}

impl<const D: usize> Projection<D> {
    pub fn new(solver: &str, settings: &SettingsMap) -> Result<Self, SimulateError>
    where
        FrictionLocal<D>: Registered,
    {
        Ok(Self {
            gradients: Gradients::default(),
            solved: Dense::default(),
            lines: vec![],
            all: Default::default(),
            values: vec![],
            session: registry::session::<FrictionLocal<D>>(solver, settings)?,
            problem: empty(),
            point: LocalPoint::default(),
        })
    }

    /// Moves q; whether `|φ|` and `−g` are at most `tolerance` afterwards.
    pub fn project<L: Lagrangian<D> + ?Sized>(
        &mut self,
        system: &L,
        lines: &Lines<D>,
        matrices: &mut Matrices,
        (t, q): (f64, &mut Vec<f64>),
        (tolerance, limits): (f64, &Limits),
        work: &mut Vec<f64>,
    ) -> Result<bool, SimulateError> {
        let size = system.size();
        let first = D * size.contacts;
        self.lines.clear();
        self.lines.extend(first..first + size.relations);
        self.lines.extend(lines.unilateral());
        let p = self.lines.len();
        for pass in 0..=PASSES {
            if p == 0 || self.violation(system, t, q) <= tolerance {
                return Ok(true);
            }
            if pass == PASSES {
                break;
            }
            self.gradients.evaluate(system, t, q, work);
            if !self.correct(size.relations, matrices, limits, q)? {
                break;
            }
        }
        Ok(self.violation(system, t, q) <= tolerance)
    }

    /// `v ← v − M⁻¹ G (Gᵀ M⁻¹ G)⁻¹ (Gᵀ v + rate)` with the gradients of the relations, which are the lines from `first` on; whether that is solved.
    pub fn project_velocity(
        &mut self,
        (gradients, first): (&Gradients, usize),
        rate: &[f64],
        matrices: &mut Matrices,
        limits: &Limits,
        v: &mut [f64],
    ) -> Result<bool, SimulateError> {
        self.gradients.clone_from(gradients);
        self.lines.clear();
        self.lines.extend(first..first + rate.len());
        self.values.clear();
        let violated = |(i, b): (&usize, &f64)| dot(gradients.line(*i), v) + b;
        self.values.extend(self.lines.iter().zip(rate).map(violated));
        self.correct(rate.len(), matrices, limits, v)
    }

    /// The largest of `|φ|` and `−g`, with the values of the lines.
    fn violation<L: Lagrangian<D> + ?Sized>(&mut self, system: &L, t: f64, q: &[f64]) -> f64 {
        let size = system.size();
        let [gaps, phi, rows] = &mut self.all;
        zero(gaps, size.contacts);
        zero(phi, size.relations);
        zero(rows, size.rows);
        system.gaps(t, q, gaps);
        system.relations(t, q, phi);
        system.rows(t, q, rows);
        let first = D * size.contacts;
        let value = |&i: &usize| match i {
            i if i < first => gaps[i / D],
            i if i < first + size.relations => phi[i - first],
            i => rows[i - first - size.relations],
        };
        self.values.clear();
        self.values.extend(self.lines.iter().map(value));
        let violation = |(k, x): (usize, &f64)| if k < size.relations { x.abs() } else { -x };
        let all = self.values.iter().enumerate().map(violation);
        all.fold(0.0, |a, x| if x > a || x.is_nan() { x } else { a })
    }

    /// `x ← x + M⁻¹ A λ` for the lines A with the values c, `0 = AᵀM⁻¹A λ + c` for the first `free` of them and `0 ≤ λ ⟂ AᵀM⁻¹A λ + c ≥ 0` for the others; whether
    /// that is solved.
    #[allow(non_snake_case)]
    fn correct(
        &mut self,
        free: usize,
        matrices: &mut Matrices,
        limits: &Limits,
        x: &mut [f64],
    ) -> Result<bool, SimulateError> {
        let Self { gradients, solved, lines, values, .. } = self;
        let p = lines.len();
        solved.reset(p, x.len());
        for (k, &i) in lines.iter().enumerate() {
            solved.row_mut(k).copy_from_slice(gradients.line(i));
            matrices.solve_mass(solved.row_mut(k));
        }
        let mut R = Dense::zeros(p, p);
        for (i, &line) in lines.iter().enumerate() {
            for j in i..p {
                let x = dot(gradients.line(line), solved.row(j));
                (R[(i, j)], R[(j, i)]) = (x, x);
            }
        }
        if !R.values().iter().chain(&*values).all(|x| x.is_finite()) {
            return Ok(false);
        }
        let lower = (0..p).map(|k| if k < free { f64::NEG_INFINITY } else { 0.0 }).collect();
        let bounds = Bounds { lower, upper: vec![f64::INFINITY; p] };
        self.problem.rows =
            Some(RowsLocal { V: Csc::zeros(0, p), R: R.to_csc(), s: values.clone(), bounds });
        self.point.r.clear();
        zero(&mut self.point.lambda, p);
        let outcome = self.session.solve(&self.problem, &mut self.point, limits, &mut |_| {})?;
        for (k, lambda) in self.point.lambda.iter().enumerate() {
            x.iter_mut().zip(self.solved.row(k)).for_each(|(x, s)| *x += lambda * s);
        }
        Ok(outcome.status == Status::Solved)
    }
}

//! One step of Moreau–Jean's θ-scheme for a Lagrangian system: the problem P_MNL.
//!
//! With `v_θ = θ v⁺ + (1 − θ) v_k`, `q⁺ = q_k + h v_θ`, impulses r and λ over the whole step, q_* the middle of the step and `F_θ = θ F⁺ + (1 − θ) F_k`,
//!
//! ```text
//! R(v⁺) = M(q_*) (v⁺ − v_k) − h F_θ = H(q_*) r + G(q_*) λ,
//! K* ∋ u⁺ + w + mu‖u_T⁺ + w_T‖ e_N  ⟂  r ∈ K,   w_N = e min(u_{N,k}, 0) ([`crate::restitution`]),   w_T = e_T u_{T,k}    for contacts with g_k + γ h u_{N,k} ≤ 0, r = 0 elsewhere,
//! Gᵀ(q_*) v_θ + ∂φ/∂t = 0  (or Gᵀ(q⁺) v⁺ + ∂φ/∂t = 0)   for relations,       −c_j ∈ N_[h l_j, h u_j](λ_j)   for scalar rows.
//! ```
//!
//! Method: Newton's. Each iterate `M̂ (v^{i+1} − v^i) = −R(v^i) + H r + G λ` with `M̂ = M − hθ ∂F/∂v − h²θ² ∂F/∂q` is one local problem in r and λ, warm started by
//! the last one and solved by a session of the project's solvers. Derivatives of M, H and G are left out, and of M̂ the symmetric part is taken where contacts or
//! scalar rows act, so that W is symmetric: the iteration contracts by about h times the rate at which directions turn. A velocity in a law that is taken with the
//! directions at the end of the step has their difference to those at q_* from the last iterate, for the same reason. Relations alone are linearised with the gradients
//! at the end of the step, which is Newton's method for them and passes singular positions.
//!
//! A step ends when, at the new v, `‖R − H r − G λ‖_{M⁻¹}` is at most tol times the larger of `‖h F‖_{M⁻¹}`, `‖H r‖_{M⁻¹}` and `1e-12 ‖v‖_M`, and the velocities in the
//! laws differ from those that the laws were solved with by at most tol: then v, r, λ solve the problem itself, whatever the last correction was. The first test has
//! a floor of some roundings of `‖v‖_M`; and an iterate within 100 tol that no longer improves is accepted, since rounding in the user's functions is not known.
//!
//! Frémond's law has `w_T = (1 − θ)/θ u_{T,k}`: u_θ in place of u⁺. References: Moreau1988 and Jean1999 for the scheme, Acary2018 for P_MNL and the index set,
//! Acary2016 for the energy, Acary2013 for the projection (`project.rs`).
//!
//! Cost: an iteration factorises M̂ (n³/3 of operations where it is dense) unless it has not changed, and solves with it for each line that takes part. Fails (a status) where a
//! contact problem is not solved, or where h is so large that Newton's method does not contract; an M that is not positive definite is an error.

use std::time::Instant;

use nonsmooth_linalg::Bsr;
use nonsmooth_linalg::budget;
use nonsmooth_problem::{FrictionLocal, LocalPoint, RowsLocal};
use nonsmooth_solve::registry::{self, Registered};
use nonsmooth_solve::{Limit, Limits, Session, Status, settings::SettingsMap};

use super::lines::Lines;
use super::matrices::{Matrices, Unfit};
use super::project::Projection;
use super::state::LagrangianState;
use super::{Lagrangian, LagrangianContact, LagrangianScheme};
use crate::drive::CANCELLED;
use crate::report::{Counts, Drift, EnergyBalance, StepReport, StepStatus, Timings, worst_share};
use crate::state::is_rest;
use crate::{Directions, SimulateError};

/// All memory of a simulation that is not its state.
pub(super) struct Tools<const D: usize> {
    pub motion: Motion,
    pub matrices: Matrices,
    pub lines: Lines<D>,
    problem: FrictionLocal<D>,
    point: LocalPoint,
    session: Box<dyn Session<FrictionLocal<D>>>,
    pub projection: Projection<D>,
    pub contacts: Vec<LagrangianContact<D>>,
    work: Vec<f64>,
}

/// What a step moves: at its beginning, in its middle, at its end.
#[derive(Debug, Default)]
pub(super) struct Motion {
    pub start: Vec<f64>,
    pub middle: Vec<f64>,
    pub end: Vec<f64>,
    /// v⁺ of the present iterate, and without impulses.
    pub v: Vec<f64>,
    free: Vec<f64>,
    /// F at the beginning, at the end, and `h F_θ`.
    force: Vec<f64>,
    force_end: Vec<f64>,
    pub drive: Vec<f64>,
    /// `H r + G λ`.
    pub push: Vec<f64>,
    /// R.
    pub residual: Vec<f64>,
    /// How often the tolerance the last iterate missed the tests by.
    merit: f64,
}

/// Roundings of `‖v‖_M` that no residual falls below.
const ROUNDING: f64 = 16.0 * f64::EPSILON;
/// An iterate within so many tolerances that is no better than the last one is as good as rounding in the user's functions, or in their differences, allows.
const ROUNDED: f64 = 100.0;

/// Why the iteration of a step ended before its laws were met.
enum Ended {
    Status(StepStatus),
    Mistake(SimulateError),
}

impl From<SimulateError> for Ended {
    fn from(error: SimulateError) -> Self {
        Self::Mistake(error)
    }
}

impl From<nonsmooth_solve::SolveError> for Ended {
    fn from(error: nonsmooth_solve::SolveError) -> Self {
        Self::Mistake(error.into())
    }
}

impl<const D: usize> Tools<D> {
    pub fn new<L: Lagrangian<D> + ?Sized>(
        system: &L,
        solver: &str,
        settings: &SettingsMap,
    ) -> Result<Self, SimulateError>
    where
        FrictionLocal<D>: Registered,
    {
        Ok(Self {
            motion: Motion::default(),
            matrices: Matrices::new(system),
            lines: Lines::default(),
            problem: empty(),
            point: LocalPoint::default(),
            session: registry::session::<FrictionLocal<D>>(solver, settings)?,
            projection: Projection::new(solver, settings)?,
            contacts: vec![],
            work: vec![],
        })
    }

    /// Everything up to the coordinates and velocities after the step; the state stays as it is.
    pub fn attempt<L: Lagrangian<D> + ?Sized>(
        &mut self,
        system: &L,
        scheme: &LagrangianScheme,
        state: &LagrangianState,
        limits: &Limits,
        h: f64,
    ) -> Result<StepReport, SimulateError> {
        let begun = Instant::now();
        let _scope = limits.budget(begun).enter();
        let mut report = StepReport {
            status: StepStatus::Solved,
            t: state.t,
            h,
            residual: 0.0,
            energy: EnergyBalance::default(),
            counts: Counts::default(),
            newton: 0,
            drift: Drift::default(),
            timings: Timings::default(),
        };
        match self.newton(system, scheme, state, limits, begun, &mut report) {
            Ok(()) => {}
            Err(Ended::Status(status)) => report.status = status,
            Err(Ended::Mistake(error)) => return Err(error),
        }
        if report.status != StepStatus::NotFinite {
            self.project(system, scheme, state, &limits.left(begun), &mut report)?;
            report.energy = self.energy(system, scheme, state, h);
            self.count(system, state, &mut report);
            if !self.motion.is_finite() {
                report.status = StepStatus::NotFinite;
            }
        }
        report.timings.total = begun.elapsed().as_secs_f64();
        report.timings.assembly = report.timings.total - report.timings.solve;
        Ok(report)
    }

    /// The problem of the first iterate of a step of length h; none without contacts or rows.
    pub fn problem<L: Lagrangian<D> + ?Sized>(
        &mut self,
        system: &L,
        scheme: &LagrangianScheme,
        state: &LagrangianState,
        h: f64,
    ) -> Result<Option<FrictionLocal<D>>, SimulateError> {
        let stated = (|| {
            self.begin(system, state)?;
            self.evaluate(system, scheme, state, h)?;
            self.choose(system, scheme, state, h)?;
            self.linearise(system, scheme, state, h)
        })();
        match stated {
            Ok(()) => {}
            Err(Ended::Status(_)) => return Ok(None),
            Err(Ended::Mistake(error)) => return Err(error),
        }
        Ok((!self.lines.lines.is_empty()).then(|| self.problem.clone()))
    }

    /// Newton's method; its last iterate is in `motion` whatever it ends with.
    fn newton<L: Lagrangian<D> + ?Sized>(
        &mut self,
        system: &L,
        scheme: &LagrangianScheme,
        state: &LagrangianState,
        limits: &Limits,
        begun: Instant,
        report: &mut StepReport,
    ) -> Result<(), Ended> {
        let h = report.h;
        if limit() == CANCELLED {
            return Err(Ended::Status(CANCELLED));
        }
        self.begin(system, state)?;
        self.evaluate(system, scheme, state, h)?;
        self.choose(system, scheme, state, h)?;
        loop {
            self.linearise(system, scheme, state, h)?;
            let solved = self.solve(&limits.left(begun), report);
            report.newton += 1;
            self.evaluate(system, scheme, state, h)?;
            solved?;
            if self.has_converged(system, scheme, state, h) {
                return Ok(());
            }
            if report.newton >= scheme.newton {
                return Err(Ended::Status(StepStatus::NewtonLimit));
            }
            if budget::over() {
                return Err(Ended::Status(limit()));
            }
        }
    }

    /// The beginning of a step: `v = v_k`, forces, gaps and lines there.
    fn begin<L: Lagrangian<D> + ?Sized>(
        &mut self,
        system: &L,
        state: &LagrangianState,
    ) -> Result<(), Ended> {
        let m = &mut self.motion;
        m.start.clone_from(&state.q);
        m.v.clone_from(&state.v);
        m.merit = f64::INFINITY;
        zero(&mut m.force, state.q.len());
        system.force(state.t, &state.q, &state.v, &mut m.force);
        self.lines.begin(system, state, &mut m.start, &mut self.work);
        Ok(())
    }

    /// M, F, lines and laws at the present v.
    fn evaluate<L: Lagrangian<D> + ?Sized>(
        &mut self,
        system: &L,
        scheme: &LagrangianScheme,
        state: &LagrangianState,
        h: f64,
    ) -> Result<(), Ended> {
        let Self { motion: m, matrices, lines, work, .. } = self;
        m.place(scheme, state, h);
        let theta = scheme.theta;
        zero(&mut m.force_end, state.q.len());
        // The end of the step for forces is where v leads, whatever directions are.
        let mut end = std::mem::take(&mut m.residual);
        advance(&mut end, state, &m.v, theta, h);
        system.force(state.t + h, &end, &m.v, &mut m.force_end);
        m.residual = end;
        m.drive.clear();
        let both = m.force_end.iter().zip(&m.force);
        m.drive.extend(both.map(|(new, old)| h * (theta * new + (1.0 - theta) * old)));
        let middle = (&mut m.middle[..], &mut m.end[..]);
        lines.evaluate(system, scheme, (state.t, h), middle, work);
        if !(lines.is_finite() && m.drive.iter().all(|x| x.is_finite())) {
            return Err(Ended::Status(StepStatus::NotFinite));
        }
        matrices.mass(system, &m.middle).map_err(|unfit| match unfit {
            Unfit::Singular if budget::over() => Ended::Status(limit()),
            _ if !matrices.is_finite() => Ended::Status(StepStatus::NotFinite),
            _ => Ended::Mistake(unfit.at(state.t)),
        })
    }

    /// The index set, by what forces alone make of the velocities.
    fn choose<L: Lagrangian<D> + ?Sized>(
        &mut self,
        system: &L,
        scheme: &LagrangianScheme,
        state: &LagrangianState,
        h: f64,
    ) -> Result<(), Ended> {
        let m = &mut self.motion;
        m.residual.clear();
        m.residual.extend(m.force.iter().map(|f| h * f));
        self.matrices.solve_mass(&mut m.residual);
        Ok(self.lines.choose(system, scheme, state, h, &m.residual)?)
    }

    /// R and M̂ at the present v, and the problem that the next one comes from.
    fn linearise<L: Lagrangian<D> + ?Sized>(
        &mut self,
        system: &L,
        scheme: &LagrangianScheme,
        state: &LagrangianState,
        h: f64,
    ) -> Result<(), Ended> {
        let Self { motion: m, matrices, lines, problem, point, work, .. } = self;
        let symmetric = lines.is_symmetric();
        advance(work, state, &m.v, scheme.theta, h);
        let at = (state.t + h, &mut work[..], &mut m.v[..]);
        let Ok(changed) = matrices.hat(system, at, (h, scheme.theta), symmetric) else {
            let singular = Status::Stalled("the iteration matrix is singular".into());
            return Err(Ended::Status(match matrices.is_hat_finite() {
                _ if budget::over() => limit(),
                true => StepStatus::Solver(singular),
                false => StepStatus::NotFinite,
            }));
        };
        lines.shift(system, scheme, state, h, ([&m.middle, &m.end], &m.v));
        m.residue(matrices, state);
        m.free.clone_from(&m.residual);
        matrices.solve_hat(&mut m.free);
        m.free.iter_mut().zip(&m.v).for_each(|(free, v)| *free = v - *free);
        if !lines.lines.is_empty() {
            lines.state(matrices, changed, &m.free, problem, point);
        }
        Ok(())
    }

    /// Has the problem solved, and takes the velocities that its impulses make.
    fn solve(&mut self, limits: &Limits, report: &mut StepReport) -> Result<(), Ended> {
        let Self { motion: m, lines, problem, point, session, .. } = self;
        if lines.lines.is_empty() {
            m.v.clone_from(&m.free);
            return Ok(());
        }
        let entries = problem.q.iter().chain(problem.rows.iter().flat_map(|r| &r.s));
        if !entries.map(|x| 0.0 * x).sum::<f64>().is_finite() {
            return Err(Ended::Status(StepStatus::NotFinite));
        }
        let begun = Instant::now();
        let outcome = session.solve(problem, point, limits, &mut |_| {})?;
        report.timings.solve += begun.elapsed().as_secs_f64();
        report.counts.iterations += outcome.iterations;
        report.residual = worst_share(&outcome.measure);
        lines.respond(point, &m.free, &mut m.v);
        match outcome.status {
            Status::Solved => Ok(()),
            status => Err(Ended::Status(StepStatus::Solver(status))),
        }
    }

    /// The tests of the head of this file, at the present v.
    fn has_converged<L: Lagrangian<D> + ?Sized>(
        &mut self,
        system: &L,
        scheme: &LagrangianScheme,
        state: &LagrangianState,
        h: f64,
    ) -> bool {
        let Self { motion: m, matrices, lines, .. } = self;
        lines.shift(system, scheme, state, h, ([&m.middle, &m.end], &m.v));
        m.residue(matrices, state);
        zero(&mut m.push, m.v.len());
        lines.push(&mut m.push);
        m.residual.iter_mut().zip(&m.push).for_each(|(r, p)| *r -= p);
        let speed =
            (2.0 * f64::max(matrices.half_square(&m.v), matrices.half_square(&state.v))).sqrt();
        let forces = f64::max(matrices.dual_norm(&m.drive), lines.strength());
        let bound = scheme.tolerance * forces.max(1e-12 * speed);
        let bound = bound.max(ROUNDING * speed).max(f64::MIN_POSITIVE);
        let residual = matrices.dual_norm(&m.residual) / bound;
        let merit = largest(residual, lines.change(speed) / scheme.tolerance);
        let before = std::mem::replace(&mut m.merit, merit);
        merit <= 1.0 || (merit <= ROUNDED && merit >= 0.5 * before)
    }

    /// Moves the coordinates at the end of the step onto relations and out of gaps.
    fn project<L: Lagrangian<D> + ?Sized>(
        &mut self,
        system: &L,
        scheme: &LagrangianScheme,
        state: &LagrangianState,
        limits: &Limits,
        report: &mut StepReport,
    ) -> Result<(), SimulateError> {
        let Self { motion: m, matrices, lines, work, projection, .. } = self;
        advance(&mut m.end, state, &m.v, scheme.theta, report.h);
        let Some(tolerance) = scheme.projection else { return Ok(()) };
        let at = (state.t + report.h, &mut m.end);
        let reached = projection.project(system, lines, matrices, at, (tolerance, limits), work)?;
        if !reached && report.status == StepStatus::Solved {
            report.status = StepStatus::ProjectionLimit;
        }
        Ok(())
    }

    /// Counts and drifts.
    fn count<L: Lagrangian<D> + ?Sized>(
        &mut self,
        system: &L,
        state: &LagrangianState,
        report: &mut StepReport,
    ) {
        let Self { motion: m, lines, work, .. } = self;
        let counts = &mut report.counts;
        counts.near = lines.gaps.len();
        counts.active = lines.touching.len();
        counts.rows = lines.lines.len() - D * counts.active;
        counts.warm = lines.warm;
        counts.islands = usize::from(!lines.lines.is_empty());
        counts.largest = counts.active;
        for (touch, lines) in lines.touching.iter().zip(lines.lines.chunks_exact(D)) {
            if lines[0].impulse <= 0.0 {
                counts.open += 1;
            } else if sticks(lines.iter().map(|l| l.impulse), touch.law.mu) {
                counts.stick += 1;
            } else {
                counts.slip += 1;
            }
        }
        zero(work, system.size().relations);
        system.relations(state.t + report.h, &m.end, work);
        let worst = |x: &[f64], sign: f64| x.iter().fold(0.0_f64, |a, x| a.max(sign * x));
        report.drift.joints = worst(work, 1.0).max(worst(work, -1.0));
        report.drift.penetration = worst(&lines.gaps, -1.0);
    }

    /// Takes the step: coordinates, velocities, what is remembered, the reports of contacts.
    pub fn commit<L: Lagrangian<D> + ?Sized>(
        &mut self,
        system: &L,
        state: &mut LagrangianState,
        h: f64,
    ) {
        let size = system.size();
        state.q.clone_from(&self.motion.end);
        match is_rest(&self.motion.v) {
            true => state.v.fill(0.0),
            false => state.v.clone_from(&self.motion.v),
        }
        state.t += h;
        state.steps += 1;
        let memory = &mut state.memory;
        memory.h = h;
        zero(&mut memory.contacts, D * size.contacts);
        zero(&mut memory.scalars, size.relations + size.rows);
        for flags in [&mut memory.active, &mut memory.stuck] {
            flags.clear();
            flags.resize(size.contacts + size.rows, false);
        }
        self.contacts.clear();
        self.contacts.extend(self.lines.gaps.iter().map(|&gap| LagrangianContact {
            gap,
            active: false,
            impulse: [0.0; D],
            before: [0.0; D],
            after: [0.0; D],
        }));
        let lines = &self.lines;
        for (touch, own) in lines.touching.iter().zip(lines.lines.chunks_exact(D)) {
            let c = touch.contact;
            memory.active[c] = true;
            memory.stuck[c] =
                own[0].impulse > 0.0 && sticks(own.iter().map(|l| l.impulse), touch.law.mu);
            let report = &mut self.contacts[c];
            report.active = true;
            for (i, line) in own.iter().enumerate() {
                memory.contacts[D * c + i] = line.impulse;
                report.impulse[i] = line.impulse;
                report.before[i] = line.before;
                report.after[i] = lines.after(line, &state.v);
            }
        }
        for line in &lines.lines[D * lines.touching.len()..] {
            let k = line.index - D * size.contacts;
            memory.scalars[k] = line.impulse;
            if k >= size.relations {
                memory.active[size.contacts + k - size.relations] = true;
            }
        }
    }
}

impl Motion {
    /// Where M, H and G are taken, for the present v.
    fn place(&mut self, scheme: &LagrangianScheme, state: &LagrangianState, h: f64) {
        let theta = scheme.theta;
        match scheme.directions {
            Directions::Frozen => {
                self.middle.clone_from(&state.q);
                self.end.clone_from(&state.q);
            }
            Directions::Extrapolated => {
                advance(&mut self.middle, state, &state.v, theta, 0.5 * h);
                advance(&mut self.end, state, &state.v, theta, h);
            }
            Directions::Iterated => {
                advance(&mut self.middle, state, &self.v, theta, 0.5 * h);
                advance(&mut self.end, state, &self.v, theta, h);
            }
        }
    }

    /// `R = M (v − v_k) − h F_θ`.
    fn residue(&mut self, matrices: &Matrices, state: &LagrangianState) {
        let Self { residual, push, v, drive, .. } = self;
        push.clear();
        push.extend(v.iter().zip(&state.v).map(|(new, old)| new - old));
        zero(residual, push.len());
        matrices.times(push, residual);
        residual.iter_mut().zip(drive).for_each(|(r, f)| *r -= *f);
    }

    fn is_finite(&self) -> bool {
        let check = |x: &[f64]| x.iter().map(|x| 0.0 * x).sum::<f64>();
        (check(&self.end) + check(&self.v)).is_finite()
    }
}

/// `q_k + h (θ v + (1 − θ) v_k)` into `out`.
fn advance(out: &mut Vec<f64>, state: &LagrangianState, v: &[f64], theta: f64, h: f64) {
    out.clear();
    let mean = v.iter().zip(&state.v).map(|(new, old)| theta * new + (1.0 - theta) * old);
    out.extend(state.q.iter().zip(mean).map(|(q, v)| q + h * v));
}

/// The larger of the two, or the one that is no number.
fn largest(a: f64, b: f64) -> f64 {
    if a > b || a.is_nan() { a } else { b }
}

/// n zeros, in the memory it has.
pub(super) fn zero(x: &mut Vec<f64>, n: usize) {
    x.clear();
    x.resize(n, 0.0);
}

/// Whether an impulse lies within the cone, not on its boundary.
fn sticks(mut r: impl Iterator<Item = f64>, mu: f64) -> bool {
    let normal = r.next().unwrap_or(0.0);
    let tangential: f64 = r.map(|t| t * t).sum();
    tangential.sqrt() < (1.0 - 1e-6) * mu * normal
}

/// A problem without contacts, to be filled.
pub(super) fn empty<const D: usize>() -> FrictionLocal<D> {
    let rows: Option<RowsLocal> = None;
    FrictionLocal { W: Bsr::from_rows(0, &[]), q: vec![], mu: vec![], mu_r: (), rows }
}

/// The status of a step whose budget is over.
fn limit() -> StepStatus {
    let cancelled = budget::current()
        .cancel
        .is_some_and(|flag| flag.load(std::sync::atomic::Ordering::Relaxed));
    StepStatus::Solver(Status::Limit(if cancelled { Limit::Cancelled } else { Limit::Time }))
}

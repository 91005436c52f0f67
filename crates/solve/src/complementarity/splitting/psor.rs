//! **Projected successive over-relaxation** (PSOR): every variable in turn goes ω times as far as its own row asks, and no farther than its bounds.
//!
//! Problem: `−w_i ∈ N_[l_i, u_i](z_i)`, `w = M z + q`; an LCP is `l = 0, u = ∞`. Free variables are relaxed without projection.
//!
//! Method: `z_i ← P(z_i − ω/M_ii (q_i + Σ_{j<i} M_ij z_j^new + Σ_{j≥i} M_ij z_j^old))`, ω in (0, 2). With `adapt`, ω follows the rate λ at which the moves
//! shrink: Young's relation `(λ + ω − 1)² = λ ω² μ²` gives the spectral radius μ of the Jacobi iteration on the present face, and that the
//! best `ω = 2/(1 + √(1 − μ²))`; on grids this takes O(n) sweeps for n points a side where ω = 1 takes O(n²). Where the relation does not hold, the new ω is measured
//! against the old one, and the better stays; where the moves grow, which they may when M is not symmetric, the over-relaxation is halved for good.
//! With `patience`, the method ends as soon as the rate of a settled ω promises more sweeps than that; without `adapt` after a quarter of them at the earliest.
//!
//! References: Acary2018 (12)(13), the latter with the second sum over j ≥ i; Cryer1971; CottlePangStone2009, chapter 5; HagemanYoung1981, chapter 9, for ω.
//!
//! Cost of a step: one pass over M. Storage: M by rows, the steps ω/M_ii.
//! Fails: needs a positive diagonal (nonzero at free variables). Converges for symmetric positive definite M and any ω in (0, 2), for H-matrices with positive
//! diagonal and ω ≤ 1; where M is neither, the iterates may cycle or diverge. Slow where M is ill conditioned.

use nonsmooth_problem::LcpPoint;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::rows::{Direction, Pass, Rows, is_fixed};
use crate::complementarity::form::{Bounded, System, system};
use crate::core::ranges::{at_least, below};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};
use crate::{SolveError, Solver, Step};

/// A fixed ω, or the first of those that adapt to the rate seen.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Psor {
    /// Relaxation: the step in units of the one that solves the row, in (0, 2). With adapt, the first one.
    pub omega: f64,
    /// Whether omega follows the observed rate of convergence, with direction=forward; pays for matrices like those of grids.
    pub adapt: bool,
    /// The order of the visits.
    pub direction: Direction,
    /// Steps between two evaluations of the true residual, unless the estimate asks for one earlier.
    pub check_every: usize,
    /// End where the observed rate of convergence promises more sweeps than this, with direction=forward; 0: never. Without adapt it is read after a quarter of them.
    pub patience: usize,
}

impl Default for Psor {
    fn default() -> Self {
        let direction = Direction::Forward;
        Self { omega: 1.3, adapt: true, direction, check_every: 50, patience: 0 }
    }
}

impl Settings for Psor {
    fn validate(&self) -> Result<(), String> {
        below("omega", self.omega, 2.0)?;
        at_least("check_every", self.check_every, 1)
    }
}

impl Described for Psor {
    const ABOUT: &'static About = &About {
        name: "psor",
        family: "splitting",
        solves: Solves::Law,
        summary: "projected Gauss-Seidel with over-relaxation, whose factor may follow the observed rate",
        needs: &["the entries of M", "a positive diagonal of M"],
        cites: &["Acary2018", "Cryer1971", "CottlePangStone2009", "HagemanYoung1981"],
        variants: &["adapt=false", "direction=symmetric"],
        settings: described::<Self>,
    };
}

/// The workspace: M by rows, the steps, and what is known of the rate.
#[derive(Debug, Clone, Default)]
pub struct RelaxationWork {
    rows: Rows,
    /// `ω / M_ii`.
    step: Vec<f64>,
    scale: f64,
    backward: bool,
    rate: Rate,
    tolerance: f64,
}

/// The present ω and what has been seen of its rate: what adapting ω goes by.
#[derive(Debug, Clone, Copy, Default)]
struct Rate {
    omega: f64,
    /// Sweeps since ω changed.
    age: usize,
    /// The moves of the last sweep.
    moves: f64,
    /// The last ratio of two moves.
    ratio: f64,
    /// The moves at the beginning of the second window.
    mark: f64,
    /// The ω before this one, and its rate.
    other: Option<(f64, f64)>,
    /// The rate of `other` was measured as the present one is, and was the worse.
    returned: bool,
    /// ω stays.
    settled: bool,
    /// The moves of the first sweep with this ω.
    first: f64,
    /// The moves have grown: no larger ω.
    most: Option<f64>,
    /// Sweeps so far.
    sweeps: usize,
    /// Every how many sweeps the rate is read, to say how much longer it takes, and the moves when it was last.
    watch: usize,
    watched: f64,
}

/// What [`Rate::next`] says after a sweep.
enum Verdict {
    Stay,
    Relax(f64),
    /// So many sweeps are still to come, at the present rate.
    Slow(f64),
}

/// Sweeps that a new ω is given before its rate is read.
const YOUNG: usize = 10;

/// Moves of an over-relaxed sweep that are so many times those of the first one with this ω do not come down by themselves.
const GROWN: f64 = 10.0;

/// Moves that are so many times the first ones have no end.
const RUNAWAY: f64 = 1e4;

/// The largest ω that is tried: what Young's relation overstates costs more than what it understates.
const LARGEST: f64 = 1.995;

impl<P: Bounded> Solver<P> for Psor {
    type Work = RelaxationWork;

    fn work(&self, problem: &P) -> Result<RelaxationWork, SolveError> {
        let mut work = RelaxationWork::default();
        self.fill(&problem.system()?, &mut work)?;
        Ok(work)
    }

    fn refill(&self, problem: &P, work: &mut RelaxationWork) -> Result<(), SolveError> {
        self.fill(&problem.system()?, work)
    }

    fn start(&self, problem: &P, point: &mut LcpPoint, work: &mut RelaxationWork) {
        let bounds = system(problem).bounds;
        point.z.iter_mut().enumerate().for_each(|(i, z)| *z = bounds.project(i, *z));
        work.backward = false;
        let watch = if self.adapt { usize::MAX } else { (self.patience / 8).max(5) };
        work.rate = Rate { watch, ..Rate::default() };
        work.relax(&system(problem), self.omega);
    }

    fn aim(&self, tolerance: f64, work: &mut RelaxationWork) {
        work.tolerance = tolerance;
    }

    fn step(&self, problem: &P, point: &mut LcpPoint, work: &mut RelaxationWork) -> Step {
        let system = system(problem);
        let RelaxationWork { rows, step, scale, backward, rate, tolerance } = work;
        let pass = Pass { q: system.q, bounds: system.bounds, step, backward: *backward };
        let mut sum = 0.0;
        let note = |i: usize, move_i: f64| sum += (rows.diagonal[i] * move_i).powi(2);
        rows.sweep(system.matrix, &pass, &mut point.z, |_, _| 0.0, note);
        *backward = self.direction == Direction::Symmetric && !*backward;
        let moves = sum.sqrt();
        let estimate = moves / (*scale * rate.omega);
        if self.direction == Direction::Forward && (self.adapt || self.patience > 0) {
            // The moves at which the estimate is the tolerance.
            let target = *tolerance * *scale * rate.omega;
            match rate.next(moves, target, self.adapt) {
                Verdict::Stay => {}
                Verdict::Relax(omega) => work.relax(&system, omega),
                Verdict::Slow(left) => {
                    let all = rate.sweeps as f64 + left;
                    if self.patience > 0 && all > self.patience as f64 {
                        return Step::Stuck(
                            "too slow: the rate promises more sweeps than `patience`".into(),
                        );
                    }
                }
            }
        }
        Step::Continue { estimate }
    }

    fn check_every(&self, _: &Self::Work) -> usize {
        self.check_every
    }
}

impl Psor {
    fn fill(&self, system: &System, work: &mut RelaxationWork) -> Result<(), SolveError> {
        work.rows.fill(system)?;
        work.rows.needs_diagonal(&system.bounds)?;
        work.scale = system.scale();
        Ok(())
    }
}

impl RelaxationWork {
    /// Takes another ω.
    fn relax(&mut self, system: &System, omega: f64) {
        self.rate = Rate { omega, age: 0, ..self.rate };
        self.step.clear();
        self.step.extend(self.rows.diagonal.iter().enumerate().map(|(i, &d)| {
            // A fixed variable goes to its place whatever its row says.
            if d == 0.0 || is_fixed(&system.bounds, i) { 0.0 } else { omega / d }
        }));
    }
}

impl Rate {
    /// Takes the moves of a sweep, and those that are small enough; another ω, where it is time for one, or how much longer it takes.
    fn next(&mut self, moves: f64, target: f64, adapt: bool) -> Verdict {
        let ratio = moves / self.moves;
        let steady = (ratio - self.ratio).abs() <= 0.1 * (1.0 - ratio).abs();
        (self.moves, self.ratio, self.age) = (moves, ratio, self.age + 1);
        self.sweeps += 1;
        if self.age == 1 {
            self.first = moves;
        }
        // The slowest mode shows after some 1/(2 − ω) sweeps.
        let window = YOUNG + (3.0 / (2.0 - self.omega)) as usize;
        // An ω that stays has its rate read as late as the patience allows: waves have to leave first, where M is not symmetric.
        let watch = if self.watch == usize::MAX { window } else { self.watch };
        let due = self.age > watch && self.age.is_multiple_of(watch);
        let seen = (moves / self.watched).powf(1.0 / watch as f64);
        if self.age.is_multiple_of(watch) {
            self.watched = moves;
        }
        let rate = (moves / self.mark).powf(1.0 / window as f64);
        if self.age.is_multiple_of(window) {
            self.mark = moves;
        }
        if adapt && self.omega > 1.0 && moves > GROWN * self.first {
            let omega = 0.5 * (1.0 + self.omega);
            (self.most, self.other) = (Some(omega), None);
            return Verdict::Relax(omega);
        }
        if adapt && !self.settled {
            if self.age == 2 * window
                && let Some(omega) = self.compare(rate)
            {
                return Verdict::Relax(omega);
            }
            if let Some(omega) = self.larger(ratio, steady) {
                return Verdict::Relax(omega);
            }
        }
        if !adapt && moves > RUNAWAY * self.first {
            return Verdict::Slow(f64::INFINITY);
        }
        if !due {
            return Verdict::Stay;
        }
        let left = (target / moves).ln() / seen.ln();
        Verdict::Slow(if seen < 1.0 { left.max(0.0) } else { f64::INFINITY })
    }

    /// By Young's relation, where the ratio of moves is steady.
    fn larger(&mut self, ratio: f64, steady: bool) -> Option<f64> {
        if self.returned || self.age < YOUNG || !steady {
            return None;
        }
        // With ω above the best one the moves oscillate, and their rate ω − 1 says no more of μ.
        if !(ratio < 1.0 && ratio > (self.omega - 1.0) * 1.02) {
            return None;
        }
        let omega = self.omega;
        let mu = (ratio + omega - 1.0) / (omega * ratio.sqrt()); //  (λ + ω − 1)² = λ ω² μ²
        let best = 2.0 / (1.0 + (1.0 - mu * mu).max(1e-10).sqrt());
        let next = best.min(LARGEST).min(self.most.unwrap_or(LARGEST));
        ((2.0 - next) < 0.9 * (2.0 - omega)).then(|| {
            self.other = Some((omega, ratio));
            next
        })
    }

    /// The rate of the present ω has been measured: back to the other one, if that was better. The rate of the other may have been read
    /// too early; so it is measured as well before it is believed.
    fn compare(&mut self, rate: f64) -> Option<f64> {
        match self.other.take() {
            Some((omega, better)) if better < rate || rate.is_nan() => {
                self.other = (!self.returned).then_some((self.omega, rate));
                self.returned = !self.returned;
                Some(omega)
            }
            other => {
                self.settled = other.is_some() && self.returned;
                None
            }
        }
    }
}

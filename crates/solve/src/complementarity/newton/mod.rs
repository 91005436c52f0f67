//! Semismooth Newton methods for linear complementarity problems.
//!
//! ```text
//! Φ_i(z_i, w_i) = 0 for every pair, w_i = 0 for every equality,   w = M z + q
//! (diag(∂Φ/∂z) + diag(∂Φ/∂w) M) d = −Φ,   z ← z + t d
//! ```
//!
//! One skeleton ([`Newton`]); the functions stand in [`functions`], each with what its method is called. All is done in pure numbers: rows and columns of M scaled to entries of about one, so
//! units change neither steps nor decisions.
//!
//! *Globalisation.* The merit is `Ψ = ½‖Φ‖²` of a function whose square is differentiable (Fischer–Burmeister or penalised). A step goes down a ladder until one
//! direction gives enough decrease; one `step` of the solver is one rung, so one or two factorisations:
//!
//! | rung | direction |
//! | --- | --- |
//! | minimum | Newton's on `min(z, w)`: where it is full and Ψ falls well, or along a descent direction of Ψ. `newton_min` tries it first, the others to finish |
//! | Newton | on the method's own function |
//! | proximal | the same with `M + λ E`, λ tied to ‖Φ‖: nonsingular where M is P0 |
//! | Levenberg–Marquardt | `min ‖Φ + J d‖² + λ‖d‖²`: a descent direction always; the first rung where equalities are not as many as free variables |
//! | gradient | `−∇Ψ` with the step that is best for the linearisation |
//!
//! `newton_min` takes full steps whatever Ψ says as long as there is a new low every few steps, and then goes back to the last low and downhill: the plain method often
//! is the fastest. Where no rung descends, or Ψ has no new low for [`PATIENCE`] steps, the method starts again elsewhere, every other time with the minimum first
//! where its own function was first before, and the other way round; after a few of these it is stuck.
//!
//! *Proofs.* A row that no z satisfies is found before the first step. Where Ψ is stationary and `Φ ≤ 0`, `−∂Φ/∂w ∘ Φ` is a Farkas vector.
//!
//! *Finish.* A full step on the minimum solves for the variables inside their bounds alone, refined against the problem's data with residuals in doubled
//! precision: exact but for the rounding of z.
//!
//! References: DeLucaFacchineiKanzow1996 (semismooth Newton, gradient fallback), GrippoLamparielloLucidi1986 (nonmonotone search), BenGharbiaGilbert2012 (why the
//! minimum needs it), YamashitaFukushima2001 (λ), Billups1995 (proximal term); Acary2018 (73)(74).
//!
//! Cost of a step: one LU of the size of M (Levenberg–Marquardt: twice the size), a few products. Storage: M twice, the factor, ten vectors.

mod josephy;
mod nonlinear;
mod scaled;
mod semismooth;
mod smooth;

pub use josephy::Miles;
pub use semismooth::Semismooth;
pub use smooth::Smooth;

use nonsmooth_linalg::{Matrix, SquareLu, norm};
use nonsmooth_problem::LcpPoint;
use nonsmooth_problem::check::Certificate;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::complementarity::form::Rowwise;
use crate::complementarity::functions::{self, Min, NewtonFunction, ScalarFunction, Slope};
use crate::core::line_search::{LineSearch, Search};
use crate::core::ranges::at_most;
use crate::core::register::{About, Described};
use crate::core::settings::{Settings, described};
use crate::{SolveError, Solver, Step};

use crate::complementarity::parts::factor::Factor;
use scaled::{Jacobian, Scaled};

/// Newton's method on the function F. (Unknown keys are refused where settings are parsed; serde cannot refuse them beside `flatten`.)
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, bound = "F: NewtonFunction")]
#[schemars(bound = "F: NewtonFunction")]
pub struct Newton<F> {
    /// The function, with hyperparameters of its own.
    #[serde(flatten)]
    pub function: F,
    /// How the line search accepts a step, on half the square of the function; `none` takes every full step and knows no other directions.
    pub line_search: LineSearch,
    /// How often the method starts again elsewhere after it got stuck.
    pub restarts: usize,
    /// Where it begins: 0 at the start given, other numbers elsewhere, and all their restarts are others.
    pub seed: u64,
}

impl<F: Default> Default for Newton<F> {
    fn default() -> Self {
        Self { function: F::default(), line_search: LineSearch::Nonmonotone, restarts: 4, seed: 0 }
    }
}

impl<F> Newton<F> {
    /// The number of the start after so many restarts: those of a seed follow those of the one before.
    fn start_number(&self, restarts: usize) -> u64 {
        restarts as u64 + self.seed % SEEDS * (self.restarts as u64 + 1)
    }
}

impl<F: NewtonFunction> Settings for Newton<F> {
    fn validate(&self) -> Result<(), String> {
        self.function.validate()?;
        at_most("restarts", self.restarts, 1000)
    }
}

impl<F: NewtonFunction> Described for Newton<F> {
    const ABOUT: &'static About =
        &F::METHOD.about("newton", &["the entries of M"], described::<Self>);
}

/// Steps without a new low after which the method starts again elsewhere.
pub const PATIENCE: usize = 30;
/// A new low is below this part of the last one.
const LOWER: f64 = 0.5;
/// Steps on the minimum without a new low after which they are no longer taken blindly, and then no longer first.
const CREDIT: usize = 8;
/// A full step on the minimum must bring Ψ below this part of the reference.
const GOOD: f64 = 0.9;
/// A step that is to finish must bring Ψ below this part.
const FINISHED: f64 = 0.1;
/// The methods on smooth merits try to finish below this ‖Φ‖∞.
const FINISH_BELOW: f64 = 1e-3;
/// After an attempt that failed the next one waits until ‖Φ‖∞ has fallen to this part, or until a step leaves Ψ above the part `SLOW`.
const NEXT_FINISH: f64 = 0.03;
const SLOW: f64 = 0.5;
/// Below this ‖Φ‖∞ w is computed in doubled precision.
const PRECISE_BELOW: f64 = 1e-6;
/// A direction descends if `∇Ψᵀd ≤ −ρ‖d‖^p` (DeLucaFacchineiKanzow1996).
const DESCENT: (f64, f64) = (1e-8, 2.1);
/// A linear system is solved if its residual is below this part of the right-hand side.
const SOLVED: f64 = 1e-3;
/// A direction is long if it is this many times as long as what it is to remove.
const LONG: f64 = 30.0;
/// λ of the minimum's singular matrices; refinement removes its bias.
const SMALL: f64 = 1e-9;
/// Up to this order Levenberg–Marquardt's dense matrices are factorised.
const MARQUARDT: usize = 4000;
/// Seeds with starts of their own; later ones begin with them again.
const SEEDS: u64 = 1 << 32;
/// ‖Φ‖∞ at which a standstill counts as the end, not as a failure.
const ROUNDING: f64 = 1e-11;

/// Where a direction comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Rung {
    Minimum,
    Newton,
    Proximal,
    Marquardt,
    Gradient,
}

/// The workspace: the scaled problem, its Jacobian and factors, and the vectors of a step.
pub struct Work {
    problem: Scaled,
    jacobian: Jacobian,
    factor: Factor,
    /// Of Levenberg–Marquardt's matrices, which have another pattern.
    augmented_lu: SquareLu,
    search: Search,
    /// ẑ and ŵ.
    x: Vec<f64>,
    w: Vec<f64>,
    /// ẑ at the last new low.
    best: Vec<f64>,
    /// Φ of the merit with its slopes, and of the direction where that has another function.
    phi: Vec<f64>,
    of_z: Vec<f64>,
    of_w: Vec<f64>,
    /// ∇Ψ.
    gradient: Vec<f64>,
    /// d, M̂ d.
    d: Vec<f64>,
    d_w: Vec<f64>,
    trial: Vec<f64>,
    trial_w: Vec<f64>,
    /// A residual, a correction, and both of them one after the other.
    residual: Vec<f64>,
    correction: Vec<f64>,
    stacked: Vec<f64>,
    phase: Phase,
}

/// How the solve is going.
#[derive(Debug, Clone, Copy)]
struct Phase {
    /// No step was made yet.
    fresh: bool,
    /// Full steps on the minimum are taken whatever the merit says, as long as there is a new low every now and then.
    blind: bool,
    rung: Option<Rung>,
    /// Newton's matrix was singular once.
    singular: bool,
    /// λ in units of ‖Φ‖∞, of the proximal term and of Levenberg–Marquardt.
    proximal: f64,
    marquardt: f64,
    proximal_tries: usize,
    low: f64,
    since_low: usize,
    /// Ψ where the last step began.
    last: f64,
    /// ‖Φ‖∞ below which the next attempt to finish is made.
    finish_below: f64,
    restarts: usize,
    /// The steps that each rung made.
    moves: [usize; 5],
}

impl Phase {
    fn new() -> Self {
        Self {
            fresh: true,
            blind: true,
            rung: None,
            singular: false,
            proximal: 0.1,
            marquardt: 0.1,
            proximal_tries: 0,
            low: f64::INFINITY,
            since_low: 0,
            last: f64::INFINITY,
            finish_below: FINISH_BELOW,
            restarts: 0,
            moves: [0; 5],
        }
    }

    /// The same solve from another start.
    fn anew(&mut self) {
        let Self { restarts, moves, .. } = *self;
        *self = Self { fresh: false, restarts: restarts + 1, moves, ..Self::new() };
    }
}

/// The merit at a point.
#[derive(Debug, Clone, Copy)]
struct Merit {
    /// ½‖Φ‖²
    value: f64,
    /// ‖Φ‖∞
    largest: f64,
}

impl<P: Rowwise, F: NewtonFunction> Solver<P> for Newton<F> {
    type Work = Work;

    fn work(&self, problem: &P) -> Result<Work, SolveError> {
        let problem = Scaled::new(&problem.rowwise())?;
        let (m, n) = (problem.nrows(), problem.dim());
        Ok(Work {
            factor: Factor::new(&problem.matrix),
            jacobian: Jacobian::new(&problem),
            problem,
            augmented_lu: SquareLu::default(),
            search: Search::new(self.line_search),
            x: vec![0.0; n],
            w: vec![0.0; m],
            best: vec![0.0; n],
            phi: vec![0.0; m],
            of_z: vec![0.0; m],
            of_w: vec![0.0; m],
            gradient: vec![0.0; n],
            d: vec![0.0; n],
            d_w: vec![0.0; m],
            trial: vec![0.0; n],
            trial_w: vec![0.0; m],
            residual: vec![0.0; m],
            correction: vec![0.0; n],
            stacked: Vec::with_capacity(m + n),
            phase: Phase::new(),
        })
    }

    fn refill(&self, problem: &P, work: &mut Work) -> Result<(), SolveError> {
        let rows = problem.rowwise();
        rows.needs_entries()?;
        if !work.problem.refill(&rows) {
            *work = self.work(problem)?;
        }
        Ok(())
    }

    fn start(&self, _: &P, point: &mut LcpPoint, work: &mut Work) {
        work.search = Search::new(self.line_search);
        work.phase = Phase::new();
        let Work { problem, x, w, .. } = work;
        problem.enter(&point.z, x);
        problem.multiply(x, w, false);
        if self.seed > 0 {
            self.elsewhere(work);
        }
    }

    fn step(&self, problem: &P, _: &mut LcpPoint, work: &mut Work) -> Step {
        let merit = self.linearise(work);
        if !merit.value.is_finite() {
            return self.restart(work);
        }
        if merit.largest == 0.0 {
            return Step::Done;
        }
        if std::mem::take(&mut work.phase.fresh)
            && let Some(proof) = impossible_row(problem, work)
        {
            return Step::NoSolution(proof);
        }
        work.phase.since_low += 1;
        let rung = match work.phase.rung {
            Some(rung) => rung,
            None => {
                let phase = &mut work.phase;
                if merit.value < LOWER * phase.low {
                    (phase.low, phase.since_low) = (merit.value, 0);
                    work.best.copy_from_slice(&work.x);
                }
                if self.by_minimum(phase)
                    && phase.blind
                    && phase.since_low > CREDIT
                    && self.line_search != LineSearch::None
                {
                    // The full steps lead nowhere: back, and downhill from now on.
                    (phase.blind, phase.since_low) = (false, 0);
                    let Work { problem, x, w, best, .. } = work;
                    x.copy_from_slice(best);
                    problem.multiply(x, w, false);
                    return Step::Continue { estimate: f64::NAN };
                }
                if phase.since_low > PATIENCE {
                    return self.give_up(problem, work, merit);
                }
                self.first_rung(work, merit)
            }
        };
        let moved = match rung {
            Rung::Minimum => self.minimum(work, merit),
            Rung::Newton => self.newton(work, merit, 0.0),
            Rung::Proximal => {
                let lambda = (work.phase.proximal * merit.largest).clamp(1e-12, 1e3);
                self.newton(work, merit, lambda)
            }
            Rung::Marquardt => self.marquardt(work, merit),
            Rung::Gradient => self.steepest(work, merit),
        };
        let phase = &mut work.phase;
        match (rung, moved) {
            (Rung::Proximal, true) => phase.proximal = (phase.proximal / 4.0).max(1e-3),
            (Rung::Proximal, false) => phase.proximal = (phase.proximal * 10.0).min(1e4),
            (Rung::Marquardt, true) => phase.marquardt = (phase.marquardt / 4.0).max(1e-6),
            (Rung::Marquardt, false) => phase.marquardt = (phase.marquardt * 10.0).min(1e2),
            _ => {}
        }
        if moved {
            phase.moves[rung as usize] += 1;
            (phase.rung, phase.proximal_tries) = (None, 0);
            return Step::Continue { estimate: norm(&work.phi) };
        }
        let (square, large) = (work.x.len() == work.w.len(), dense_and_large(work));
        let phase = &mut work.phase;
        phase.rung = match rung {
            _ if self.line_search == LineSearch::None => None,
            Rung::Minimum if phase.singular => Some(Rung::Proximal),
            Rung::Minimum => Some(Rung::Newton),
            Rung::Newton => Some(Rung::Proximal),
            Rung::Proximal if phase.proximal_tries < 2 => {
                phase.proximal_tries += 1;
                Some(Rung::Proximal)
            }
            Rung::Proximal if square && large => Some(Rung::Gradient),
            Rung::Proximal => Some(Rung::Marquardt),
            Rung::Marquardt => Some(Rung::Gradient),
            Rung::Gradient => None,
        };
        match work.phase.rung {
            None => self.give_up(problem, work, merit),
            Some(_) => Step::Continue { estimate: norm(&work.phi) },
        }
    }

    fn publish(&self, _: &P, point: &mut LcpPoint, work: &mut Work) {
        work.problem.leave(&work.x, &mut point.z);
    }

    fn account(&self, work: &Work) -> Vec<String> {
        let Phase { moves, restarts, .. } = work.phase;
        let [minimum, newton, proximal, marquardt, gradient] = moves;
        let mut said = vec![format!(
            "steps on the minimum {minimum}, Newton {newton}, proximal {proximal}, Levenberg-Marquardt {marquardt}, gradient {gradient}"
        )];
        if restarts > 0 {
            said.push(format!("started again elsewhere {restarts} times"));
        }
        said
    }
}

fn dense_and_large(work: &Work) -> bool {
    matches!(work.problem.matrix, Matrix::Dense(_)) && work.x.len() + work.w.len() > MARQUARDT
}

/// Φ_i of row i at `(x, w)`.
#[inline]
fn row<F: ScalarFunction>(f: &F, problem: &Scaled, x: &[f64], w: &[f64], i: usize) -> Slope {
    match problem.variable(i) {
        None => Slope { value: w[i], z: 0.0, w: 1.0 },
        Some(j) => functions::boxed(f, x[j], w[i], problem.lower[j], problem.upper[j]),
    }
}

/// Ψ at `(x, w)`.
fn merit_at<F: ScalarFunction>(f: &F, problem: &Scaled, x: &[f64], w: &[f64]) -> f64 {
    (0..w.len()).map(|i| 0.5 * row(f, problem, x, w, i).value.powi(2)).sum()
}

impl<F: NewtonFunction> Newton<F> {
    fn first_rung(&self, work: &mut Work, merit: Merit) -> Rung {
        let phase = &mut work.phase;
        if work.x.len() != work.w.len() {
            return Rung::Marquardt;
        }
        if self.leads(phase) {
            return Rung::Minimum;
        }
        let slow = merit.value > SLOW * std::mem::replace(&mut phase.last, merit.value);
        if merit.largest <= phase.finish_below || (slow && merit.largest <= FINISH_BELOW) {
            phase.finish_below = NEXT_FINISH * merit.largest;
            return Rung::Minimum;
        }
        if phase.singular { Rung::Proximal } else { Rung::Newton }
    }

    /// Whether this start is the minimum's: every other one.
    fn by_minimum(&self, phase: &Phase) -> bool {
        F::MINIMUM_FIRST == phase.restarts.is_multiple_of(2)
    }

    /// Whether steps on the minimum come first: not where they have not helped for a while.
    fn leads(&self, phase: &Phase) -> bool {
        let plain = self.line_search == LineSearch::None;
        self.by_minimum(phase) && (plain || phase.since_low <= CREDIT)
    }

    /// Φ and its slopes at the present point; Ψ. Remembers nothing.
    fn linearise(&self, work: &mut Work) -> Merit {
        let Work { problem, x, w, phi, of_z, of_w, .. } = work;
        let mut merit = Merit { value: 0.0, largest: 0.0 };
        for i in 0..w.len() {
            let at = row(&self.function.merit(), problem, x, w, i);
            (phi[i], of_z[i], of_w[i]) = (at.value, at.z, at.w);
            merit.value += 0.5 * at.value * at.value;
            merit.largest = merit.largest.max(at.value.abs());
        }
        merit
    }

    /// `∇Ψ = Eᵀ (∂Φ/∂z ∘ Φ) + M̂ᵀ (∂Φ/∂w ∘ Φ)` from the slopes.
    fn differentiate(work: &mut Work) {
        let Work { problem, phi, of_z, of_w, gradient, residual, .. } = work;
        for ((r, f), phi) in residual.iter_mut().zip(&*of_w).zip(&*phi) {
            *r = f * phi;
        }
        problem.matrix.mul_transpose(residual, gradient);
        for i in 0..phi.len() {
            if let Some(j) = problem.variable(i) {
                gradient[j] += of_z[i] * phi[i];
            }
        }
    }

    /// d with `J d = −Φ` for the slopes and Φ that the workspace holds, M̂ with λE added; refined towards λ = 0 where `to_zero`.
    /// False where the matrix is singular.
    fn solve(work: &mut Work, lambda: f64, to_zero: bool) -> bool {
        let mut again = false;
        loop {
            let Work { problem, jacobian, factor, of_z, of_w, .. } = work;
            jacobian.assemble(problem, of_z, of_w, lambda);
            let factorised = factor.factorise(&jacobian.matrix);
            if lambda > 0.0 && to_zero {
                jacobian.assemble(problem, of_z, of_w, 0.0);
            }
            if factorised && Self::refine(work, if to_zero { 6 } else { 2 }) {
                return true;
            }
            if !work.factor.distrust() {
                if again {
                    // It was the matrix, not the order of elimination.
                    work.factor.trust();
                }
                return false;
            }
            again = true;
        }
    }

    /// d from the factors, by so many corrections at most; whether `J d = −Φ` holds well enough.
    fn refine(work: &mut Work, sweeps: usize) -> bool {
        let Work { jacobian, factor, phi, d, residual, correction, .. } = work;
        d.fill(0.0);
        let wanted = norm(phi);
        let mut last = wanted;
        residual.copy_from_slice(phi);
        for _ in 0..sweeps {
            correction.iter_mut().zip(&*residual).for_each(|(c, r)| *c = -r);
            factor.solve(correction);
            d.iter_mut().zip(&*correction).for_each(|(d, c)| *d += c);
            jacobian.matrix.mul(d, residual);
            residual.iter_mut().zip(&*phi).for_each(|(r, phi)| *r += phi);
            let now = norm(residual);
            if now.is_nan() || now > last {
                d.iter_mut().zip(&*correction).for_each(|(d, c)| *d -= c);
                break;
            }
            let slow = now > 0.5 * last;
            last = now;
            if slow || last <= 1e-15 * wanted {
                break;
            }
        }
        last <= SOLVED * wanted && d.iter().all(|d| d.is_finite())
    }

    /// `∇Ψᵀ d` and M̂ d.
    fn slope(work: &mut Work) -> f64 {
        let Work { problem, d, d_w, gradient, .. } = work;
        problem.matrix.mul(d, d_w);
        gradient.iter().zip(&*d).map(|(g, d)| g * d).sum()
    }

    fn descends(work: &Work, slope: f64) -> bool {
        slope < 0.0 && slope <= -DESCENT.0 * norm(&work.d).powf(DESCENT.1)
    }

    /// Searches along d, whose slope and M̂ d are known; moves where it finds enough decrease.
    fn along(&self, work: &mut Work, merit: Merit, slope: f64) -> bool {
        let Work { problem, search, x, w, d, d_w, trial, trial_w, .. } = work;
        let found = search.search_along(merit.value, slope, |t| {
            for (to, (x, d)) in trial.iter_mut().zip(x.iter().zip(&*d)) {
                *to = x + t * d;
            }
            for (to, (w, d)) in trial_w.iter_mut().zip(w.iter().zip(&*d_w)) {
                *to = w + t * d;
            }
            merit_at(&self.function.merit(), problem, trial, trial_w)
        });
        if found.accepted {
            Self::take(work, merit);
        }
        found.accepted
    }

    /// The trial point becomes the present one.
    fn take(work: &mut Work, before: Merit) {
        let Work { problem, x, w, trial, .. } = work;
        x.copy_from_slice(trial);
        problem.multiply(x, w, before.largest < PRECISE_BELOW);
    }

    /// A step of Newton's method on `min(z, w)`: the full one if that is good, else along the direction if Ψ descends there.
    fn minimum(&self, work: &mut Work, merit: Merit) -> bool {
        Self::differentiate(work);
        {
            let Work { problem, x, w, phi, of_z, of_w, .. } = work;
            for i in 0..w.len() {
                let at = row(&Min {}, problem, x, w, i);
                (phi[i], of_z[i], of_w[i]) = (at.value, at.z, at.w);
            }
        }
        let solved = Self::solve(work, 0.0, true);
        if solved && self.full(work, merit) {
            return true;
        }
        // Where the matrix is (nearly) singular the short solution is wanted: it leaves the other pairs alone.
        let long = norm(&work.d) > LONG * norm(&work.phi);
        if (!solved || long) && Self::solve(work, SMALL, true) {
            if self.full(work, merit) {
                return true;
            }
        } else if !solved {
            return false;
        }
        if !self.leads(&work.phase) {
            return false;
        }
        let slope = Self::slope(work);
        Self::descends(work, slope) && self.along(work, merit, slope)
    }

    /// The full step d of the minimum, what goes to a bound going there exactly, if it is good.
    fn full(&self, work: &mut Work, merit: Merit) -> bool {
        let Work { problem, x, phi, of_z, of_w, d, trial, trial_w, .. } = work;
        for (to, (x, d)) in trial.iter_mut().zip(x.iter().zip(&*d)) {
            *to = x + d;
        }
        for i in 0..phi.len() {
            if let Some(j) = problem.variable(i).filter(|_| of_w[i] == 0.0 && of_z[i] != 0.0) {
                let (l, u) = (problem.lower[j], problem.upper[j]);
                trial[j] = if (trial[j] - l).abs() <= (trial[j] - u).abs() { l } else { u };
            }
        }
        problem.multiply(trial, trial_w, merit.largest < PRECISE_BELOW);
        let full = merit_at(&self.function.merit(), problem, trial, trial_w);
        let good = if self.leads(&work.phase) {
            full <= GOOD * work.search.reference(merit.value)
        } else {
            full <= FINISHED * merit.value
        };
        let plain = self.line_search == LineSearch::None;
        let blind = self.leads(&work.phase) && (plain || work.phase.blind);
        let accepted = (good || blind) && full.is_finite();
        if accepted {
            work.search.remember(merit.value);
            Self::take(work, merit);
        }
        accepted
    }

    /// A step on the method's own function, with a proximal term.
    fn newton(&self, work: &mut Work, merit: Merit, lambda: f64) -> bool {
        Self::differentiate(work);
        if !Self::solve(work, lambda, false) {
            work.phase.singular |= lambda == 0.0;
            return false;
        }
        let slope = Self::slope(work);
        Self::descends(work, slope) && self.along(work, merit, slope)
    }

    fn marquardt(&self, work: &mut Work, merit: Merit) -> bool {
        if dense_and_large(work) {
            return false;
        }
        Self::differentiate(work);
        let lambda = (work.phase.marquardt * merit.largest).clamp(1e-14, 1e2);
        let Work { problem, jacobian, augmented_lu, phi, of_z, of_w, d, stacked, .. } = work;
        jacobian.assemble(problem, of_z, of_w, 0.0);
        if augmented_lu.factorise(&jacobian.augmented(lambda)).is_err() {
            return false;
        }
        stacked.clear();
        stacked.extend(phi.iter().map(|phi| -phi));
        stacked.resize(phi.len() + d.len(), 0.0);
        augmented_lu.solve(stacked);
        d.copy_from_slice(&stacked[phi.len()..]);
        let slope = Self::slope(work);
        slope < 0.0 && self.along(work, merit, slope)
    }

    /// A step along −∇Ψ, as long as the linearisation likes best.
    fn steepest(&self, work: &mut Work, merit: Merit) -> bool {
        Self::differentiate(work);
        let Work { problem, of_z, of_w, gradient, d, d_w, .. } = work;
        problem.matrix.mul(gradient, d_w);
        let mut curvature = 0.0;
        for i in 0..d_w.len() {
            let of_pair = problem.variable(i).map_or(0.0, |j| of_z[i] * gradient[j]);
            curvature += (of_w[i] * d_w[i] + of_pair).powi(2);
        }
        let square = gradient.iter().map(|g| g * g).sum::<f64>();
        if !(square > 0.0 && curvature > 0.0) {
            return false;
        }
        d.iter_mut().zip(&*gradient).for_each(|(d, g)| *d = -square / curvature * g);
        let slope = Self::slope(work);
        self.along(work, merit, slope)
    }

    /// No direction descends, or none descends enough.
    fn give_up<P: Rowwise>(&self, problem: &P, work: &mut Work, merit: Merit) -> Step {
        let reach = work.x.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
        if merit.largest <= ROUNDING * reach {
            return Step::Done;
        }
        self.linearise(work);
        match proof(problem, work) {
            Some(proof) => Step::NoSolution(proof),
            None => self.restart(work),
        }
    }

    /// Starts again elsewhere, if that is still allowed.
    fn restart(&self, work: &mut Work) -> Step {
        if work.phase.restarts >= self.restarts {
            let why =
                "Newton's method is stuck: its merit has stationary points that solve nothing";
            return Step::Stuck(why.into());
        }
        work.phase.anew();
        // What the one rule does not reach the other may.
        let other = match (self.line_search, work.phase.restarts / 2 % 2) {
            (LineSearch::Nonmonotone, 1) => LineSearch::Armijo,
            (LineSearch::Armijo, 1) => LineSearch::Nonmonotone,
            (rule, _) => rule,
        };
        work.search = Search::new(other);
        self.elsewhere(work);
        Step::Continue { estimate: f64::NAN }
    }

    /// To the start of this restart.
    fn elsewhere(&self, work: &mut Work) {
        let Work { problem, x, w, phase, .. } = work;
        let k = self.start_number(phase.restarts);
        for (j, x) in x.iter_mut().enumerate() {
            // The bounds, then points that have nothing in common, near and far.
            let noise = ((j + 1) as f64 * 0.618_033_988_75 + k as f64 * 0.414_213_562_37).fract();
            let free = !problem.lower[j].is_finite() && !problem.upper[j].is_finite();
            let far = match k {
                1 => 0.0,
                2 => 10.0,
                3 => 1.0,
                k => [1.0, 10.0, 0.1, 100.0][(k % 4) as usize] * noise,
            };
            let from = if problem.lower[j].is_finite() { problem.lower[j] } else { 0.0 };
            *x = if free { 0.0 } else { (from + far).max(problem.lower[j]).min(problem.upper[j]) };
        }
        problem.multiply(x, w, false);
    }
}

/// A row that no point satisfies, lecture (19), if there is one. Cost: one pass over M.
fn impossible_row<P: Rowwise>(problem: &P, work: &mut Work) -> Option<Certificate> {
    let rows = problem.rowwise();
    let largest = &mut work.residual;
    largest.fill(f64::NEG_INFINITY);
    rows.matrix.for_each(|i, _, x| largest[i] = largest[i].max(x));
    let row = (0..largest.len()).find(|&i| rows.q[i] < 0.0 && largest[i] <= 0.0)?;
    Some(Certificate::Row { row }).filter(|proof| problem.verify(proof))
}

/// A proof that there is no solution, where the stationary point is one.
///
/// With `y = −∂Φ/∂w ∘ Φ`, `∇Ψ = 0` says `Mᵀ y = ∂Φ/∂z ∘ Φ`: a Farkas vector, if Φ ≤ 0.
fn proof<P: Rowwise>(problem: &P, work: &Work) -> Option<Certificate> {
    let Work { problem: scaled, phi, of_w, .. } = work;
    let mut y: Vec<f64> = (0..phi.len())
        .map(|i| {
            let y = -scaled.row(i) * of_w[i] * phi[i];
            match scaled.variable(i).map(|j| (scaled.lower[j], scaled.upper[j])) {
                Some((l, u)) if l.is_finite() && u.is_finite() => 0.0,
                Some((l, _)) if l.is_finite() => y.max(0.0),
                Some((_, u)) if u.is_finite() => y.min(0.0),
                _ => y,
            }
        })
        .collect();
    let largest = y.iter().fold(0.0_f64, |m, y| m.max(y.abs()));
    y.iter_mut().filter(|y| y.abs() <= 1e-9 * largest).for_each(|y| *y = 0.0);
    let farkas = Certificate::Farkas { y };
    problem.evidence(&farkas).holds().then_some(farkas)
}

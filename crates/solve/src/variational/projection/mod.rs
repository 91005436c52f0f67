//! Projection methods: find x ∈ X with `F(x)ᵀ(y − x) ≥ 0` for all y ∈ X.
//!
//! They need values of F and projections on X only. All predict `x̄ = P_X(x − ρ F(x))` with a self-adaptive ρ (Khobotov1987, SolodovTseng1996); what they do with it tells them apart.
//! Where F is not defined at a prediction, ρ is shortened; where it is not at the start, the start is moved inside X.

mod extragradient;
mod fixed_point;
mod hyperplane;

use nonsmooth_problem::field::{Evaluator, tentatively};
use nonsmooth_problem::{LcpPoint, Vi};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

pub use crate::core::step_rule::{Ratio, StepRule};
pub use extragradient::Extragradient;
pub use fixed_point::FixedPoint;
pub use hyperplane::{Hyperplane, Normal};

use super::parts::Projector;
use crate::{SolveError, Solver, Step};

/// F at x and at a prediction, and the step length that outlives a step.
pub struct State {
    field: Box<dyn Evaluator>,
    projector: Projector,
    /// F(x).
    f: Vec<f64>,
    /// x̄ and F(x̄).
    trial: Vec<f64>,
    trial_f: Vec<f64>,
    from: Vec<f64>,
    rho: f64,
    /// Whether f is F at the present x.
    known: bool,
    /// Whether the last projection was found.
    projected: bool,
}

impl State {
    fn new(problem: &Vi) -> Self {
        let zeros = || vec![0.0; problem.dim()];
        Self {
            field: problem.F.evaluator(),
            projector: Projector::new(&problem.set),
            f: zeros(),
            trial: zeros(),
            trial_f: zeros(),
            from: zeros(),
            rho: 1.0,
            known: false,
            projected: true,
        }
    }

    /// `trial = P_X(x − t d)`
    fn project(&mut self, x: &[f64], t: f64, along: impl Fn(&Self) -> &[f64]) -> bool {
        let mut from = std::mem::take(&mut self.from);
        from.iter_mut().zip(x).zip(along(self)).for_each(|((p, x), d)| *p = x - t * d);
        self.projected = self.projector.onto(&from, &mut self.trial);
        self.from = from;
        self.projected
    }

    /// F(x), unless it is known. False where it is not defined.
    fn evaluate(&mut self, x: &[f64]) -> bool {
        self.known = self.known || self.field.value(x, &mut self.f);
        self.known
    }

    /// Moves x ∈ X, where F is not defined, to the nearest of some points inside X where it is: means of projections of points about x, which are in X since it is convex, and off its border unless all of X is.
    fn enter(&mut self, x: &mut [f64]) {
        let size = x.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let size = if size > 0.0 { size } else { 1.0 };
        let mut random = Pcg64::seed_from_u64(1);
        let mut mean = vec![0.0; x.len()];
        for distance in INSIDE {
            mean.fill(0.0);
            for _ in 0..PAIRS {
                self.trial_f.fill_with(|| random.random_range(-1.0..1.0));
                for side in [size * distance, -size * distance] {
                    if !self.project(x, side, |state| &state.trial_f) {
                        return;
                    }
                    let part = 0.5 / PAIRS as f64;
                    mean.iter_mut().zip(&self.trial).for_each(|(mean, y)| *mean += part * y);
                }
            }
            if tentatively(|| self.field.value(&mean, &mut self.f)) {
                x.copy_from_slice(&mean);
                self.known = true;
                return;
            }
        }
    }

    /// From F(x): `x̄ = P_X(x − ρ F(x))` and F(x̄) with a ρ that the rule accepts; the ratio. `None` where there is none.
    fn predict(&mut self, rule: &StepRule, x: &[f64]) -> Option<f64> {
        let mut rho = self.rho;
        let ratio = rule.shorten(&mut rho, |rho| {
            if !self.project(x, rho, |state| &state.f) {
                return f64::NAN;
            }
            if !tentatively(|| self.field.value(&self.trial, &mut self.trial_f)) {
                return f64::INFINITY;
            }
            let differences = || {
                let x = x.iter().zip(&self.trial).map(|(x, y)| x - y);
                x.zip(self.f.iter().zip(&self.trial_f).map(|(f, g)| f - g))
            };
            let squares: f64 = differences().map(|(x, _)| x * x).sum();
            match rule.rule {
                Ratio::Khobotov => {
                    rho * (differences().map(|(_, f)| f * f).sum::<f64>() / squares).sqrt()
                }
                Ratio::SolodovTseng => {
                    rho * differences().map(|(x, f)| x * f).sum::<f64>().abs() / squares
                }
            }
        });
        self.rho = rho;
        (self.projected && ratio != f64::INFINITY).then_some(ratio)
    }

    /// `‖x − x̄‖_∞` for a step of length one, near enough.
    fn estimate(&self, x: &[f64]) -> f64 {
        let moved = x.iter().zip(&self.trial).fold(0.0_f64, |most, (x, y)| most.max((x - y).abs()));
        moved / self.rho
    }
}

/// What tells one projection method from another.
trait Method: Send + Sync {
    /// One step on x ∈ X, where F is known; an estimate of the natural residual before it. `None` where F is not defined on the way, or the projection was not found.
    fn advance(&self, x: &mut [f64], state: &mut State) -> Option<f64>;

    /// Steps between two visits of the judge.
    fn check_every(&self) -> usize;
}

/// The [`Solver`] that a method is.
macro_rules! solver {
    ($method:ty) => {
        impl Solver<Vi> for $method {
            type Work = State;

            fn work(&self, problem: &Vi) -> Result<State, SolveError> {
                Ok(State::new(problem))
            }

            fn start(&self, _: &Vi, point: &mut LcpPoint, state: &mut State) {
                (state.rho, state.known) = (1.0, false);
                // On the set.
                if state.project(&point.z, 0.0, |state| &state.f) {
                    point.z.copy_from_slice(&state.trial);
                    state.known = tentatively(|| state.field.value(&point.z, &mut state.f));
                    if !state.known {
                        state.enter(&mut point.z);
                    }
                }
            }

            fn step(&self, _: &Vi, point: &mut LcpPoint, state: &mut State) -> Step {
                if !state.projected {
                    return Step::Stuck(NO_PROJECTION.into());
                }
                if !state.evaluate(&point.z) {
                    return Step::Stuck(UNDEFINED.into());
                }
                match Method::advance(self, &mut point.z, state) {
                    Some(estimate) => Step::Continue { estimate },
                    None if state.projected => Step::Stuck(UNDEFINED.into()),
                    None => Step::Stuck(NO_PROJECTION.into()),
                }
            }

            fn check_every(&self, _: &Self::Work) -> usize {
                Method::check_every(self)
            }
        }
    };
}

solver!(FixedPoint);
solver!(Extragradient);
solver!(Hyperplane);

pub(super) const NO_PROJECTION: &str =
    "no projection on the set is found: a polyhedron is empty, or empty but for rounding";

/// Distances to which a start is moved, in units of its size.
const INSIDE: [f64; 8] = [1e-6, 1e-4, 1e-2, 0.1, 0.5, 1.0, 10.0, 100.0];
/// Points on both sides of it whose projections make a mean.
const PAIRS: usize = 4;

const UNDEFINED: &str = "F is not defined at the iterate, nor near it along a step";

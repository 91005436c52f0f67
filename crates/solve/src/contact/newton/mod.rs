//! Semismooth Newton methods on a complementarity function of each contact.
//!
//! ```text
//! Φ_c(u_c, r_c) = 0 for all contacts,   u = W r + q
//! (Q + P W) Δr = −Φ,   P = diag ∂Φ_c/∂u_c,   Q = diag ∂Φ_c/∂r_c,   r ← r + t Δr
//! ```
//!
//! One skeleton ([`Newton`]); the functions stand in [`cfun`](crate::contact::law::cfun), each with its paper and what its method is called. The linear system is [`Linearised`]'s: in contact space
//! where W is known, over the degrees of freedom where M and H are.
//!
//! All is done in pure numbers, `û = u/s` and `r̂ = w_c r/s` with `s = ‖q‖/√nc`, `w_c = tr(W_cc)/D`: units change neither steps
//! nor decisions, and light and heavy contacts weigh the same in the merit `Ψ = ½ Σ‖Φ_c‖²`.
//!
//! *Globalisation.* A few Gauss–Seidel sweeps come first. A line search shortens steps that do not decrease Ψ; where none does, or
//! the matrix is singular, or Ψ has not fallen to a new low for [`PATIENCE`] steps, sweeps take over for one step. After
//! [`RESCUES`] such rescues without a new low the method says that it is stuck.
//!
//! Cost of a step: one sparse factorisation, one to ten products with W. Storage: the factor, 6 vectors, 2 blocks a contact.
//!
//! Fails: where W is rank deficient (hyperstatic) and many contacts stick, Newton's matrix is nearly singular and its
//! neighbourhood of convergence tiny: use a proximal method around it.

mod scaling;

use nonsmooth_linalg::{Block, budget, small};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::contact::form::{Access, Disked, Linearised, OnContacts};
use crate::contact::law::cfun::{ContactFunction, Linearisation, NewtonFunction, OneContact};
use crate::contact::parts::Sweep;
use crate::core::line_search::{LineSearch, Search};
use crate::core::ranges::{at_most, nonnegative, positive};
use crate::core::register::{About, Described};
use crate::core::settings::{Settings, described};
use crate::{SolveError, Solver, Step};

pub use scaling::RhoRule;

/// Newton's method on the function F. (Unknown keys are refused where settings are parsed; serde cannot refuse them beside `flatten`.)
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, bound = "F: NewtonFunction")]
#[schemars(bound = "F: NewtonFunction")]
pub struct Newton<F> {
    /// The function, with hyperparameters of its own.
    #[serde(flatten)]
    pub function: F,
    /// How the line search accepts a step, on half the square of the function.
    pub line_search: LineSearch,
    /// How rho of each contact follows from its block of W.
    pub rho_rule: RhoRule,
    /// The factor of the rule, positive: a pure number.
    pub rho: f64,
    /// Gauss-Seidel sweeps before the first Newton step.
    pub warm_up: usize,
    /// Gauss-Seidel sweeps that take over for one step where Newton's fails, doubled up to 64-fold while that does not help;
    /// 0 gives up at once.
    pub rescue: usize,
    /// Smoothed functions: the smoothing parameter is at most this fraction of the residual, at least 0. The others do not look at it.
    pub smoothing: f64,
}

impl<F: Default> Default for Newton<F> {
    fn default() -> Self {
        Self {
            function: F::default(),
            line_search: LineSearch::default(),
            rho_rule: RhoRule::default(),
            rho: 1.0,
            warm_up: 10,
            rescue: 20,
            smoothing: 0.1,
        }
    }
}

impl<F: NewtonFunction> Settings for Newton<F> {
    fn validate(&self) -> Result<(), String> {
        self.function.validate()?;
        at_most("warm_up", self.warm_up, MOST_SWEEPS)?;
        at_most("rescue", self.rescue, MOST_SWEEPS)?;
        positive("rho", self.rho)?;
        nonnegative("smoothing", self.smoothing)
    }
}

impl<F: NewtonFunction> Described for Newton<F> {
    const ABOUT: &'static About = &F::METHOD.about("newton", &[], described::<Self>);
}

/// The most sweeps that may be asked for in one step: time limits act between steps.
const MOST_SWEEPS: usize = 1000;
/// Rescues without a new low after which the method is stuck.
pub const RESCUES: usize = 12;
/// Each rescue in a row has twice as many sweeps as the one before, this often.
const DOUBLINGS: usize = 6;
/// Newton steps without a new low after which sweeps take over.
pub const PATIENCE: usize = 25;

/// The workspace: the problem's view, the scaling of each contact, and the vectors of a step.
pub struct Work<P: Linearised<D> + Disked<D>, const D: usize> {
    state: P::State,
    sweep: Sweep<P::Law, D>,
    laws: Vec<OneContact<P::Law>>,
    /// `w_c`, positive.
    unit: Vec<f64>,
    /// `‖q‖/√nc`.
    scale: f64,
    /// The velocities at the present impulses.
    u: Vec<f64>,
    trial: Vec<f64>,
    trial_u: Vec<f64>,
    step: Vec<f64>,
    step_u: Vec<f64>,
    b: Vec<f64>,
    p: Vec<Block<D>>,
    q: Vec<Block<D>>,
    search: Search,
    phase: Phase,
}

/// How the solve is going.
#[derive(Debug, Clone, Copy)]
struct Phase {
    /// No step was made yet.
    fresh: bool,
    /// The smallest merit since the last change of rho, and Newton steps since then.
    low: f64,
    since_low: usize,
    rescues: usize,
    smoothing: f64,
    /// The place in the ladder of rho.
    rung: usize,
}

impl Phase {
    fn new() -> Self {
        Self {
            fresh: true,
            low: f64::INFINITY,
            since_low: 0,
            rescues: 0,
            smoothing: f64::INFINITY,
            rung: 0,
        }
    }

    /// Notes a merit; a new low forgives the rescues.
    fn note(&mut self, merit: f64) {
        if merit < 0.98 * self.low {
            if self.low.is_finite() {
                self.rescues = 0;
            }
            (self.low, self.since_low) = (merit, 0);
        } else {
            self.since_low += 1;
        }
    }
}

impl<P, F, const D: usize> Solver<P> for OnContacts<Newton<F>, D>
where
    P: Linearised<D> + Disked<D>,
    F: ContactFunction<D, P::Law>,
{
    type Work = Work<P, D>;

    fn work(&self, problem: &P) -> Result<Self::Work, SolveError> {
        Skeleton::of(&self.0).work(problem)
    }

    fn refill(&self, problem: &P, work: &mut Self::Work) -> Result<(), SolveError> {
        problem.refill(&mut work.state)?;
        work.sweep.fill(problem, &work.state);
        Skeleton::of(&self.0).fill(problem, work);
        Ok(())
    }

    fn start(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) {
        Skeleton::of(&self.0).start(problem, point, work);
    }

    fn step(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) -> Step {
        Skeleton::of(&self.0).step(problem, point, work)
    }

    fn publish(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) {
        problem.complete(&mut work.state, point);
    }
}

/// The method without its function, so that it is compiled once for each kind of problem.
struct Skeleton<'a, P: Disked<D>, const D: usize> {
    function: &'a dyn OnAll<P::Law, D>,
    smoothed: bool,
    settings: Newton<()>,
}

impl<'a, P: Linearised<D> + Disked<D>, const D: usize> Skeleton<'a, P, D> {
    fn of<F: ContactFunction<D, P::Law>>(newton: &'a Newton<F>) -> Self {
        let Newton { ref function, line_search, rho_rule, rho, warm_up, rescue, smoothing } =
            *newton;
        let settings =
            Newton { function: (), line_search, rho_rule, rho, warm_up, rescue, smoothing };
        Self { function, smoothed: F::SMOOTHED, settings }
    }

    fn work(&self, problem: &P) -> Result<Work<P, D>, SolveError> {
        let state = problem.state(Access::Newton)?;
        let mut work = Work {
            sweep: Sweep::new(problem, &state),
            state,
            laws: vec![],
            unit: vec![],
            scale: 1.0,
            u: vec![],
            trial: vec![],
            trial_u: vec![],
            step: vec![],
            step_u: vec![],
            b: vec![],
            p: vec![],
            q: vec![],
            search: Search::new(self.settings.line_search),
            phase: Phase::new(),
        };
        self.fill(problem, &mut work);
        Ok(work)
    }

    fn start(&self, problem: &P, point: &mut P::Point, work: &mut Work<P, D>) {
        work.search.restart();
        if work.phase.rung > 0 {
            work.phase.rung = 0;
            self.scale_contacts(problem, work);
        }
        work.phase = Phase::new();
        problem.velocities(&mut work.state, P::impulses(point), &mut work.u);
    }

    fn step(&self, problem: &P, point: &mut P::Point, work: &mut Work<P, D>) -> Step {
        if let Some(ray) = problem.contradiction(&work.state) {
            return Step::NoSolution(ray.clone().into());
        }
        if std::mem::take(&mut work.phase.fresh) && self.settings.warm_up > 0 {
            return self.sweeps(problem, point, work, self.settings.warm_up);
        }
        if self.smoothed {
            self.reduce_smoothing(P::impulses(point), work);
        }
        let r = P::impulses(point);
        let Work { laws, unit, scale, u, b, p, q, .. } = &mut *work;
        let at = At { laws, unit, scale: *scale, u, r };
        let merit = self.function.linearise(at, b, p, q); //             Φ, P, Q
        if !self.smoothed {
            work.phase.note(merit);
        }
        if work.phase.since_low > PATIENCE {
            return self.rescue(
                problem,
                point,
                work,
                "Newton's method is stuck: its merit no longer decreases",
            );
        }
        if problem.linearise(&mut work.state, &work.p, &work.q).is_err() {
            return self.rescue(
                problem,
                point,
                work,
                "Newton's method is stuck: its matrix is singular",
            );
        }
        let Work { state, u, trial, trial_u, step, step_u, b, search, laws, unit, scale, .. } =
            work;
        problem.solve_linearised(state, b, step, step_u); //             (Q + P W) Δr = −Φ
        if step.iter().any(|x| !x.is_finite()) {
            return self.rescue(
                problem,
                point,
                work,
                "Newton's method is stuck: its step is not finite",
            );
        }
        let found = search.search(merit, |t| {
            for i in 0..r.len() {
                trial[i] = r[i] + t * step[i];
            }
            // Recomputed, not u + t W Δr: rounding does not gather.
            problem.velocities(state, trial, trial_u);
            self.function.merit(At { laws, unit, scale: *scale, u: trial_u, r: trial })
        });
        if !(found.accepted || found.merit < merit) {
            return self.rescue(
                problem,
                point,
                work,
                "Newton's method is stuck: no step along its direction decreases the merit",
            );
        }
        r.copy_from_slice(trial); //                                     r ← r + t Δr
        std::mem::swap(u, trial_u);
        Step::Continue { estimate: (2.0 * found.merit / laws.len() as f64).sqrt() }
    }

    fn fill(&self, problem: &P, work: &mut Work<P, D>) {
        let n = problem.contacts();
        work.scale = problem.velocity_scale(&work.state) / (n as f64).sqrt();
        problem.units(&work.state, &mut work.unit);
        for x in [
            &mut work.u,
            &mut work.trial,
            &mut work.trial_u,
            &mut work.step,
            &mut work.step_u,
            &mut work.b,
        ] {
            x.resize(D * n, 0.0);
        }
        work.p.resize(n, [[0.0; D]; D]);
        work.q.resize(n, [[0.0; D]; D]);
        self.scale_contacts(problem, work);
    }

    /// ρ of every contact for the present rung.
    fn scale_contacts(&self, problem: &P, work: &mut Work<P, D>) {
        let Newton { rho_rule, rho, .. } = self.settings;
        let factor = scaling::LADDER[work.phase.rung % scaling::LADDER.len()];
        work.laws.clear();
        for (c, &unit) in work.unit.iter().enumerate() {
            let w = problem.diagonal_block(&work.state, c);
            let (rho, rho_cone) = scaling::radii::<P::Law, D>(rho_rule, rho * factor, &w, unit);
            work.laws.push(OneContact { law: problem.law(c), rho, rho_cone, smoothing: 0.0 });
        }
    }

    /// `count` sweeps on the point; the velocities after them.
    fn sweeps(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut Work<P, D>,
        count: usize,
    ) -> Step {
        problem.enter(&mut work.state, point);
        let r = P::impulses(point);
        let mut moves = 0.0;
        for _ in 0..count {
            moves = work.sweep.sweep(problem, &mut work.state, r);
            if budget::over() {
                break;
            }
        }
        problem.velocities(&mut work.state, r, &mut work.u);
        Step::Continue { estimate: moves.sqrt() / (work.scale * (work.laws.len() as f64).sqrt()) }
    }

    /// Sweeps in place of a Newton step that failed, and another ρ where that is asked for; stuck after too many of them.
    fn rescue(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut Work<P, D>,
        why: &'static str,
    ) -> Step {
        if self.settings.rescue == 0 || work.phase.rescues >= RESCUES {
            return Step::Stuck(why.into());
        }
        // Longer each time in a row: where W is rank deficient, Newton needs a start that few sweeps do not give.
        let count = self.settings.rescue << work.phase.rescues.min(DOUBLINGS);
        work.phase.rescues += 1;
        work.phase.since_low = 0;
        work.search.restart();
        if self.settings.rho_rule == RhoRule::Adaptive {
            work.phase.rung += 1;
            work.phase.low = f64::INFINITY;
            self.scale_contacts(problem, work);
        }
        self.sweeps(problem, point, work, count)
    }

    /// ε: at most a fraction of the residual without smoothing and, near the solution, of its square; never larger than before.
    fn reduce_smoothing(&self, r: &[f64], work: &mut Work<P, D>) {
        work.laws.iter_mut().for_each(|law| law.smoothing = 0.0);
        let Work { laws, unit, scale, u, phase, search, .. } = work;
        let merit = self.function.merit(At { laws, unit, scale: *scale, u, r });
        phase.note(merit);
        let rms = (2.0 * merit / laws.len() as f64).sqrt();
        let bound = self.settings.smoothing * rms * rms.min(1.0);
        if bound < phase.smoothing {
            phase.smoothing = bound;
            search.restart();
        }
        let epsilon = phase.smoothing;
        laws.iter_mut().for_each(|law| law.smoothing = epsilon);
    }
}

/// A function on all contacts.
trait OnAll<L, const D: usize> {
    /// Φ, P, Q into `b = −Φ`, `p`, `q`, in the problem's units; the merit.
    fn linearise(&self, at: At<L>, b: &mut [f64], p: &mut [Block<D>], q: &mut [Block<D>]) -> f64;

    /// `½ Σ‖Φ_c‖²`.
    fn merit(&self, at: At<L>) -> f64;
}

/// Velocities and impulses, and what makes pure numbers of them.
struct At<'a, L> {
    laws: &'a [OneContact<L>],
    unit: &'a [f64],
    scale: f64,
    u: &'a [f64],
    r: &'a [f64],
}

impl<F: ContactFunction<D, L>, L, const D: usize> OnAll<L, D> for F {
    fn linearise(&self, at: At<L>, b: &mut [f64], p: &mut [Block<D>], q: &mut [Block<D>]) -> f64 {
        let mut merit = 0.0;
        for (c, &w) in at.unit.iter().enumerate() {
            let of = at.contact(self, c);
            for k in 0..D {
                merit += 0.5 * of.phi[k] * of.phi[k];
                b[D * c + k] = -at.scale * of.phi[k];
            }
            p[c] = of.a;
            q[c] = of.b.map(|row| row.map(|x| w * x));
        }
        merit
    }

    fn merit(&self, at: At<L>) -> f64 {
        let square = |c| at.contact(self, c).phi.iter().map(|x| x * x).sum::<f64>();
        (0..at.unit.len()).fold(0.0, |merit, c| merit + 0.5 * square(c))
    }
}

impl<L> At<'_, L> {
    /// The function of contact c, in pure numbers.
    #[inline(always)]
    fn contact<F, const D: usize>(&self, function: &F, c: usize) -> Linearisation<D>
    where
        F: ContactFunction<D, L>,
    {
        let (w, scale) = (self.unit[c], self.scale);
        let u: [f64; D] = small::block(self.u, c);
        let r: [f64; D] = small::block(self.r, c);
        function.linearise(&self.laws[c], &u.map(|x| x / scale), &r.map(|x| x * (w / scale)))
    }
}

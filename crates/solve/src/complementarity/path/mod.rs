//! **path**: Newton's method on the normal map with arcs of the linearisation, as in the code PATH.
//!
//! Problem: `l ≤ x ≤ u ⟂ F(x)`, that is `F(π(y)) + y − π(y) = 0`, x = π(y) (Robinson's normal map). Method: after a crash (projected Newton steps that look for the active set) a
//! pivotal method follows the arc of the linearised normal map from x to z, where that is solved
//! ([`arc`](crate::complementarity::parts::arc)), or as far as it leads; a step goes along `π(x + t(z − x))`, t = 1, ½, …, as soon as `Ψ ≤ R − σ ∇Ψᵀ(x − x(t))` with the
//! Fischer–Burmeister merit Ψ and R the largest of `memory` merits (at first `kappa` Ψ(x⁰)), or, as long as a watchdog allows it, by t = 1 whatever Ψ says. Then:
//!
//! | where | what |
//! | --- | --- |
//! | the first matrix is singular | `JF + λI` with `λ = Ψ/10`, at most 1, which falls with Ψ |
//! | the arc ends on a ray | Lemke's ray, then larger λ; else along the gradient of Ψ |
//! | no t is accepted | back to the best point, along the gradient, at most five times |
//! | Ψ has not halved for 100 steps, or neither helps | again from the start with other options |
//!
//! | start | from | κ | λ | merit |
//! | --- | --- | --- | --- | --- |
//! | first | x⁰ | `kappa` | where singular | `merit` |
//! | second | x⁰ | 2 | .1 | `merit` |
//! | third | x⁰ | `kappa` | none | normal map |
//! | fourth | 10 % off x⁰ | `kappa` | where singular | `merit` |
//! | fifth | 50 % off x⁰ | 2 | where singular | penalised |
//! | sixth | x⁰, crash | 1, monotone | 1 | penalised |
//!
//! The search on the normal map goes along the arcs themselves; it is that of PATH's first versions (`merit=normal`).
//!
//! References: Robinson1992, Ralph1994, DirkseFerris1995 (normal map, path search, watchdog), FerrisMunson1999, Munson2002 (merit, gradient, proximal term, restarts),
//! DirkseFerris1997 (crash), GrippoLamparielloLucidi1986; Acary2018 (71)(72). Cost of a step: a sparse LU, a solve for each pivot, an evaluation for each t.
//! Fails: at stationary points of Ψ that are no solutions, where JF is not P0 there.

mod normal;
mod watchdog;

use nonsmooth_problem::{LcpPoint, Mcp};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::complementarity::functions::{Min, Penalised};
use crate::complementarity::parts::arc::{Cell, End, Linearised, Start};
use crate::complementarity::parts::nonlinear::{
    CHECK_EVERY, Crash, Descent, Idle, MEMORY_MOST, Moved, Options, STATIONARY, Solve, UNDEFINED,
};
use crate::core::ranges::{at_least, at_most, nonnegative, positive};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};
use crate::{SolveError, Solver, Step};
use normal::Normal;
use watchdog::Watchdog;

/// The merit of the search.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Merit {
    /// Half the square of the Fischer-Burmeister function.
    Fischer,
    /// The same of the penalised one, with the weight 0.8.
    Penalised,
    /// The size of the normal map, along the arcs themselves.
    Normal,
}

impl Merit {
    /// The function of the search; of the normal map's that of the crash.
    fn function(self) -> Penalised {
        match self {
            Self::Fischer | Self::Normal => Penalised { lambda: 1.0 },
            Self::Penalised => Penalised { lambda: 0.8 },
        }
    }
}

/// When projected Newton steps that look for the active set come first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Crashing {
    /// Where there are more than 500 variables: there pivots that look for it cost more.
    Automatic,
    /// Always, in the first and the last start.
    Always,
    /// Never.
    Never,
}

/// When linear problems begin on Lemke's ray rather than in the basis of the point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LemkeStart {
    /// Where the basis of the point leads nowhere.
    Automatic,
    /// In addition, the first of each start.
    First,
    /// All of them.
    Always,
    /// None of them.
    Never,
}

/// The hyperparameters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PathSearch {
    /// When projected Newton steps that look for the active set come first.
    pub crash: Crashing,
    /// The merit that a step must decrease.
    pub merit: Merit,
    /// Of how many merits the largest is the reference of the search; 1: monotone.
    pub memory: usize,
    /// The reference at the beginning, in units of the first merit, at least 1.
    pub kappa: f64,
    /// When linear problems begin on Lemke's ray rather than in the basis of the point.
    pub lemke_start: LemkeStart,
    /// The proximal term λ at the beginning; 0: only where the first matrix is singular.
    pub proximal: f64,
    /// Whether full steps are taken for a while whatever the merit says.
    pub watchdog: bool,
    /// How often it begins again with other options, at most 5.
    pub restarts: usize,
    /// The most pivots of one linear problem.
    pub pivots: usize,
}

impl Default for PathSearch {
    fn default() -> Self {
        Self {
            crash: Crashing::Automatic,
            merit: Merit::Fischer,
            memory: 10,
            kappa: 20.0,
            lemke_start: LemkeStart::Automatic,
            proximal: 0.0,
            watchdog: true,
            restarts: 5,
            pivots: 1000,
        }
    }
}

impl Settings for PathSearch {
    fn validate(&self) -> Result<(), String> {
        at_least("memory", self.memory, 1)?;
        at_most("memory", self.memory, MEMORY_MOST)?;
        positive("kappa", self.kappa)?;
        nonnegative("proximal", self.proximal)?;
        at_most("restarts", self.restarts, 5)?;
        at_least("pivots", self.pivots, 1)
    }
}

impl Described for PathSearch {
    const ABOUT: &'static About = &About {
        name: "path",
        family: "path",
        solves: Solves::Law,
        summary: "Newton on the normal map along arcs of its linearisation, non-monotone, with crash, proximal term and restarts (the code PATH)",
        needs: &[],
        cites: &[
            "Robinson1992",
            "Ralph1994",
            "DirkseFerris1995",
            "DirkseFerris1997",
            "FerrisMunson1999",
            "Munson2002",
            "Acary2018",
        ],
        variants: &["lemke_start=always", "crash=always", "merit=penalised", "merit=normal"],
        settings: described::<Self>,
    };
}

/// The workspace.
pub struct Work {
    solve: Solve,
    crash: Crash,
    linear: Linearised,
    descent: Descent<Min, Penalised>,
    /// The settings of the present start.
    options: PathSearch,
    /// λ, as far as it is in use.
    lambda: f64,
    /// Linear problems of this start.
    problems: usize,
    /// Of Ψ, or of the normal map.
    idle: Idle,
    /// The point with the least Ψ of this start, and that.
    best: Vec<f64>,
    best_merit: f64,
    /// Steps along the gradient in this start.
    gradients: usize,
    watchdog: Watchdog,
    /// The search on the normal map, and whether it has begun.
    normal: Normal,
    begun: bool,
    end: Vec<f64>,
    counts: Counts,
}

#[derive(Debug, Clone, Copy, Default)]
struct Counts {
    crash: usize,
    rays: usize,
    lemke: usize,
    untested: usize,
}

/// Above this number of variables the crash is worth its steps.
const LARGE: usize = 500;
/// Steps along the gradient in one start.
const GRADIENTS: usize = 5;
/// Steps in which Ψ must have halved.
const PATIENCE: usize = 100;

impl PathSearch {
    /// The settings of a start.
    fn turned(&self, turn: usize) -> Self {
        let other = match self.merit {
            Merit::Normal => Merit::Fischer,
            _ => Merit::Normal,
        };
        let plain = Self { crash: Crashing::Never, ..*self };
        let penalised = Self { merit: Merit::Penalised, kappa: 2.0, ..plain };
        match turn {
            0 => *self,
            1 => Self { kappa: 2.0, proximal: 0.1, ..plain },
            2 => Self { merit: other, ..plain },
            3 => plain,
            4 => penalised,
            _ => Self {
                crash: match self.crash {
                    Crashing::Never => Crashing::Never,
                    _ => Crashing::Always,
                },
                memory: 1,
                kappa: 1.0,
                proximal: 1.0,
                watchdog: false,
                ..penalised
            },
        }
    }

    /// Begins the start of this number.
    fn begin(&self, turn: usize, work: &mut Work) {
        work.options = self.turned(turn);
        let Self { crash, merit, memory, kappa, proximal, .. } = work.options;
        let wanted = match crash {
            Crashing::Automatic => work.end.len() > LARGE,
            crash => crash == Crashing::Always,
        };
        work.crash.begin(wanted);
        let function = merit.function();
        let options = Options { memory, slack: kappa, ..Options::default() };
        work.descent.restart(Min {}, function, options);
        (work.lambda, work.problems, work.gradients) = (proximal, 0, 0);
        (work.idle, work.best_merit) = (Idle::default(), f64::INFINITY);
        work.watchdog = Watchdog::new(work.options.watchdog);
        work.begun = false;
    }

    /// Follows arcs of the linearisation until one leads somewhere; whether one does.
    fn follow(work: &mut Work, merit: f64) -> bool {
        let Work { solve, linear, options, lambda, problems, end, counts, .. } = work;
        let at = (&solve.at.x[..], &solve.at.f[..]);
        *problems += 1;
        let lemke = match options.lemke_start {
            LemkeStart::Always => true,
            LemkeStart::First => *problems == 1,
            _ => false,
        };
        let ray = (Start::Ray, Cell::Preimage);
        let own = (Start::At, Cell::Preimage);
        let first = if lemke { ray } else { own };
        let mut reached = 0.0;
        let regular = (0.1 * merit).clamp(1e-8, 1.0);
        if *lambda > 0.0 && *problems > 1 {
            *lambda = (0.4 * *lambda).min(regular);
        }
        let mut attempts = [Some((first, *lambda)), None, None, None];
        if options.lemke_start != LemkeStart::Never {
            attempts[1] = Some((ray, *lambda));
        }
        attempts[2] = Some((own, lambda.max(regular)));
        attempts[3] = Some((own, 10.0 * lambda.max(regular)));
        for (basis, weight) in attempts.into_iter().flatten() {
            counts.lemke += usize::from(basis == ray);
            let found = linear.solve(&solve.model, at, weight, basis, options.pivots);
            if found == End::Over {
                return false;
            }
            counts.rays += usize::from(!matches!(found, End::Solved | End::Pivots));
            // The path from Lemke's ray does not begin at x.
            let t = if found == End::Solved || basis == own { linear.reached() } else { 0.0 };
            if t > reached {
                reached = t;
                end.copy_from_slice(linear.end());
            }
            if found == End::Solved {
                if *problems == 1 && linear.was_singular() && *lambda == 0.0 {
                    *lambda = regular;
                }
                return true;
            }
            if found == End::Pivots && reached > 0.0 {
                // The next arc goes on from there.
                break;
            }
        }
        reached > 0.0
    }

    /// A step of the path search.
    fn step_on_normal_map(&self, work: &mut Work) -> Step {
        let Work { solve, linear, options, lambda, normal, begun, counts, .. } = work;
        if !*begun {
            normal.begin(&solve.model, &solve.at, options.memory, options.watchdog);
            *begun = true;
        }
        let before = normal.untested();
        let moved = normal.step(&mut solve.model, &mut solve.at, linear, (*lambda, options.pivots));
        counts.untested += normal.untested() - before;
        solve.note(moved);
        let least = normal.least();
        *lambda = (0.4 * *lambda).min(0.05 * least * least);
        let idle_for = work.idle.note(least);
        if moved.moved() && idle_for <= PATIENCE {
            return work.solve.goes_on();
        }
        self.another(work, moved.why())
    }

    /// The next start, or the end.
    fn another(&self, work: &mut Work, why: &'static str) -> Step {
        if work.solve.is_done() || work.solve.restarts >= self.restarts {
            return work.solve.ends(why);
        }
        work.solve.restarts += 1;
        let Solve { model, at, restarts, .. } = &mut work.solve;
        match restarts {
            3 => at.perturbed(model, 1),
            4 => at.perturbed(model, 2),
            _ => at.again(model),
        }
        self.begin(work.solve.restarts, work);
        work.solve.goes_on()
    }
}

impl Work {
    /// A full step that is not tested; whether it was made.
    fn leap(&mut self) -> bool {
        let Self { solve, watchdog, end, counts, .. } = self;
        let moves = solve.at.x.iter().zip(&*end);
        if !watchdog.allows(moves.fold(0.0_f64, |m, (x, e)| m.max((x - e).abs()))) {
            return false;
        }
        std::mem::swap(&mut solve.at.x, end);
        if !solve.at.arrive(&mut solve.model) || !solve.at.residual.is_finite() {
            std::mem::swap(&mut solve.at.x, end);
            solve.at.arrive(&mut solve.model);
            return false;
        }
        counts.untested += 1;
        true
    }

    /// Goes to the best point of this start. False where that is where it is.
    fn retreat(&mut self) -> bool {
        let Self { solve, best, .. } = self;
        if solve.at.x == *best {
            return false;
        }
        solve.at.x.copy_from_slice(best);
        solve.at.arrive(&mut solve.model);
        true
    }

    /// Along the gradient from the best point; whether that decreased Ψ.
    fn descend(&mut self) -> bool {
        if self.gradients >= GRADIENTS {
            return false;
        }
        self.gradients += 1;
        self.retreat();
        let options = Options { memory: self.options.memory, slack: 1.0, ..Options::default() };
        let function = self.options.merit.function();
        self.descent.restart(Min {}, function, options);
        let Self { solve, descent, .. } = self;
        let made = descent.look(&mut solve.model, &mut solve.at).is_some()
            && descent.downhill(&mut solve.model, &mut solve.at);
        // The reference is what is found now.
        self.descent.restart(Min {}, function, options);
        made
    }
}

impl Solver<Mcp> for PathSearch {
    type Work = Work;

    fn work(&self, problem: &Mcp) -> Result<Work, SolveError> {
        let solve = Solve::new(problem);
        let n = solve.model.dim();
        let function = self.merit.function();
        let mut crash = Crash::new(&solve.model);
        if n > LARGE {
            crash.persist();
        }
        Ok(Work {
            crash,
            linear: Linearised::new(&solve.model),
            descent: Descent::new(Min {}, function, Options::default(), &solve.model),
            solve,
            options: *self,
            lambda: 0.0,
            problems: 0,
            idle: Idle::default(),
            best: vec![0.0; n],
            best_merit: f64::INFINITY,
            gradients: 0,
            watchdog: Watchdog::new(self.watchdog),
            normal: Normal::new(n),
            begun: false,
            end: vec![0.0; n],
            counts: Counts::default(),
        })
    }

    fn aim(&self, tolerance: f64, work: &mut Work) {
        work.solve.aim(tolerance);
    }

    fn start(&self, _: &Mcp, point: &mut LcpPoint, work: &mut Work) {
        work.solve.begin(point);
        (work.linear.pivots, work.counts) = (0, Counts::default());
        self.begin(0, work);
    }

    fn step(&self, _: &Mcp, _: &mut LcpPoint, work: &mut Work) -> Step {
        if !work.crash.is_over() {
            let Work { solve, crash, counts, .. } = work;
            let before = crash.steps();
            crash.step(&mut solve.model, &mut solve.at);
            counts.crash += crash.steps() - before;
            return solve.goes_on();
        }
        if work.options.merit == Merit::Normal {
            return self.step_on_normal_map(work);
        }
        let Work { solve, descent, .. } = &mut *work;
        let Some(merit) = descent.look(&mut solve.model, &mut solve.at) else {
            // Untested steps may end where the Jacobian is not defined.
            if work.watchdog.gives_up() && work.retreat() {
                return work.solve.goes_on();
            }
            return self.another(work, UNDEFINED);
        };
        if merit < work.best_merit {
            work.best_merit = merit;
            work.best.copy_from_slice(&work.solve.at.x);
        }
        if work.idle.note(merit) > PATIENCE {
            return self.another(work, STATIONARY);
        }
        if work.watchdog.is_due() && work.best_merit < merit {
            work.watchdog.turns_back();
            work.retreat();
            return work.solve.goes_on();
        }
        let moved = if Self::follow(work, merit) {
            if work.leap() {
                Moved::Newton
            } else {
                let Work { solve, descent, end, .. } = &mut *work;
                match descent.towards(&mut solve.model, &mut solve.at, end) {
                    true if work.lambda > 0.0 => Moved::Regularised,
                    true => Moved::Newton,
                    false => Moved::Stuck,
                }
            }
        } else {
            Moved::Stuck
        };
        let moved = match moved {
            Moved::Stuck if work.descend() => Moved::Gradient,
            moved => moved,
        };
        work.solve.note(moved);
        if moved.moved() { work.solve.goes_on() } else { self.another(work, STATIONARY) }
    }

    fn publish(&self, _: &Mcp, point: &mut LcpPoint, work: &mut Work) {
        work.solve.publish(point);
    }

    fn account(&self, work: &Work) -> Vec<String> {
        let Counts { crash, rays, lemke, untested } = work.counts;
        work.solve.account(vec![format!(
            "crash steps {crash}, pivots {}, arcs that led nowhere {rays}, starts on Lemke's ray {lemke}, steps without a test {untested}",
            work.linear.pivots
        )])
    }

    fn check_every(&self, _: &Self::Work) -> usize {
        CHECK_EVERY
    }
}

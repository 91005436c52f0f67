//! Cadoux' fixed point where Newton's iterations stay in vain: with the sliding speeds held the problem is convex, and the interior point finds its solution whatever the friction; then the
//! speeds are brought up to date ([`Speeds`]). Problems with mu of 1 and more and few degrees of freedom, on which sweeps diverge and Newton's iterations go round, end here.

use nonsmooth_problem::check::Kinematic;

use super::starts::{interior_point, lost};
use super::{Auto, EARLY, HybridWork, Stage};
use crate::Step;
use crate::contact::form::{Disked, Linearised, OnContacts};
use crate::contact::law::DiskLaw;
use crate::contact::parts::{ConvexIp, Speeds};

/// Problems of so few impulses come here after [`EARLY`] Newton iterations, others at a change of strategy: there a factorisation costs microseconds.
const SMALL: usize = 64;
/// Factorisations of the first time; and a later one has so many times those of the one before.
const FIRST: f64 = 200.0;
const MORE: f64 = 1.5;
/// After two times, the second from the best point, none that came no nearer than this multiple of its error.
const IN_VAIN: (usize, f64) = (2, 10.0);
/// Factorisations in the face of a proof that there is no solution by rounding only, and the share of the error there: a convex problem has a solution all the same, but a closer one is needed. Of 114 such
/// problems some 100 are solved with it or without, one to three more with it.
const INSIST: f64 = 2000.0;
const INSISTENT_SHARE: f64 = 1e-3;
/// A convex problem is solved to this share of the error of the last one (.1 and .01 solve as many: 1240 and 1238 of 1263 planted problems), in at most so many iterations.
const SHARE: f64 = 0.1;
const ITERATIONS: usize = 60;

/// The convex problem, its speeds, and the best of its solutions.
pub(super) struct Cadoux<L, const D: usize> {
    speeds: Speeds<L, D>,
    convex: ConvexIp<D, L>,
    /// Its solution, polished, and the velocities; the best one.
    r: Vec<f64>,
    u: Vec<f64>,
    best: Vec<f64>,
    /// The error of the law at the last solution, and the least.
    error: f64,
    least: f64,
    /// Factorisations that are left.
    left: f64,
    budget: f64,
    /// How often it has begun.
    begun: usize,
    /// See [`SHARE`].
    share: f64,
}

impl<L: DiskLaw<D>, const D: usize> Cadoux<L, D> {
    /// With all the room that it takes.
    fn new<P: Linearised<D> + Disked<D, Law = L>>(problem: &P, state: &mut P::State) -> Self {
        let mut new = Self {
            speeds: Speeds::new(problem, state),
            convex: ConvexIp::new(),
            r: vec![],
            u: vec![],
            best: vec![],
            error: 1.0,
            least: f64::INFINITY,
            left: 0.0,
            budget: FIRST,
            begun: 0,
            share: SHARE,
        };
        new.begin(problem, state);
        new.convex.begin(problem, state, &new.speeds.s, None);
        new
    }

    /// The first time of a solve; allocates nothing where there are no more contacts than before.
    fn begin<P: Linearised<D> + Disked<D, Law = L>>(&mut self, problem: &P, state: &P::State) {
        self.speeds.fill(problem, state);
        for x in [&mut self.r, &mut self.u, &mut self.best] {
            x.resize(D * problem.contacts(), 0.0);
        }
        (self.error, self.least, self.budget) = (1.0, f64::INFINITY, FIRST);
        (self.begun, self.share) = (0, SHARE);
    }

    /// The solution of the convex problem.
    fn solve<P: Linearised<D> + Disked<D, Law = L>>(&mut self, problem: &P, state: &mut P::State) {
        let tolerance = (self.share * self.error).clamp(1e-15, 0.1);
        self.convex.begin(problem, state, &self.speeds.s, None);
        let end = self.convex.solve(problem, state, tolerance, ITERATIONS);
        self.r.copy_from_slice(self.convex.r());
        self.u.copy_from_slice(self.convex.u());
        let steps = self.speeds.polish(problem, state, (&mut self.r, &mut self.u), tolerance);
        self.left -= (end.iterations + steps).max(1) as f64;
    }

    /// Takes note of the error at that solution.
    fn note(&mut self, error: f64) {
        self.error = error;
        if error < self.least {
            self.least = error;
            self.best.copy_from_slice(&self.r);
        }
    }

    /// The next speeds.
    fn renew<P: Linearised<D> + Disked<D, Law = L>>(&mut self, problem: &P, state: &mut P::State) {
        let Self { speeds, r, u, left, .. } = self;
        speeds.see(u);
        *left -= 1.0;
        if !speeds.newton(problem, state, (r, u), true) {
            speeds.advance(1.0);
        }
    }
}

fn is_small<P: Linearised<D>, const D: usize>(problem: &P) -> bool {
    D * problem.contacts() <= SMALL
}

impl<const D: usize> OnContacts<Auto, D> {
    /// Whether the stage comes before a change of strategy.
    pub(super) fn cadoux_is_due<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        work: &HybridWork<P, D>,
    ) -> bool {
        work.done.convex == 0 && work.done.newton >= EARLY && is_small::<P, D>(problem)
    }

    /// Whether the stage has come far less near than the best point, and would again.
    pub(super) fn cadoux_is_in_vain<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        work: &HybridWork<P, D>,
    ) -> bool {
        let in_vain = |cadoux: &Cadoux<P::Law, D>| {
            cadoux.begun >= IN_VAIN.0 && cadoux.least > IN_VAIN.1 * work.controller.least()
        };
        work.done.convex > 0 && work.cadoux.as_deref().is_some_and(in_vain)
    }

    /// Makes room for the stage, and for the interior point that it puts off, where it may come soon.
    pub(super) fn make_room_for_cadoux<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        work: &mut HybridWork<P, D>,
    ) {
        let HybridWork { cadoux, central, state, .. } = work;
        if is_small::<P, D>(problem) && cadoux.is_none() {
            *cadoux = Some(Box::new(Cadoux::new(problem, state)));
            central.get_or_insert_with(interior_point).begin(problem, state, 0.0, None);
        }
    }

    /// Begins the stage, the first time from s = 0, then from the speeds of the best point: where the fixed point goes round, another start leads elsewhere.
    pub(super) fn begin_cadoux<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        work: &mut HybridWork<P, D>,
    ) -> Step {
        let HybridWork { cadoux, state, stage, best, done, .. } = work;
        let cadoux = cadoux.get_or_insert_with(|| Box::new(Cadoux::new(problem, state)));
        if done.convex == 0 {
            cadoux.begin(problem, state);
        } else if cadoux.least.is_finite() {
            problem.velocities(state, best, &mut cadoux.u);
            cadoux.speeds.see(&cadoux.u);
            cadoux.speeds.begin_at_image();
        }
        cadoux.left = cadoux.budget;
        cadoux.budget *= MORE;
        cadoux.begun += 1;
        *stage = Stage::Cadoux;
        Step::Continue { estimate: f64::NAN }
    }

    /// Begins the stage anew, and for long, where a problem is small and the earlier stages have made their room; whether it did.
    pub(super) fn insist_on_cadoux<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        work: &mut HybridWork<P, D>,
    ) -> bool {
        let HybridWork { cadoux: Some(cadoux), newton: Some(_), state, stage, .. } = work else {
            return false;
        };
        if is_small::<P, D>(problem) {
            cadoux.begin(problem, state);
            (cadoux.left, cadoux.share) = (INSIST, INSISTENT_SHARE);
            *stage = Stage::Cadoux;
        }
        is_small::<P, D>(problem)
    }

    /// One convex problem and the next speeds; at the end the best of the solutions goes on where it is better than the best point.
    pub(super) fn cadoux<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
    ) -> Step {
        let HybridWork { cadoux, newton, state, done, tolerance, controller, best, still, .. } =
            work;
        let (Some(cadoux), Some(newton)) = (cadoux, newton) else {
            return lost();
        };
        let r = P::impulses(point);
        cadoux.solve(problem, state);
        let error = newton.look(problem, state, &cadoux.r);
        cadoux.note(error);
        (done.convex, done.convex_error) = (done.convex + 1, cadoux.least);
        cadoux.renew(problem, state);
        // Where the judge is not content with it, the next one may be better in what it asks for.
        let claims = error <= *tolerance;
        if claims {
            *still = false;
            r.copy_from_slice(&cadoux.r);
        }
        if cadoux.left <= 0.0 {
            if !claims {
                let better = cadoux.least < controller.least();
                r.copy_from_slice(if better { &cadoux.best } else { best });
            }
            self.subproblem_here(problem, point, work);
        }
        Step::Continue { estimate: error }
    }
}

//! Who does the work of a step, on as many threads as are asked for: bodies, contacts and problems by their parts, islands by one session for each large one, and a
//! few for each thread for all small ones.
//!
//! What a part comes to does not depend on where it was cut, and a session's answer depends on problem, start and limits alone, so neither the number of threads nor who
//! takes what changes a bit.
//!
//! `u = 0` solves Coulomb's law wherever `W r + q = 0` has a solution in K, which makes it one of the convex relaxation, `min ½ rᵀW r + qᵀr` in K: a few
//! solves with one factor, or iterations of its interior point, tell. The law itself may have other solutions, which move and take long to find. So the bodies of a large island that are slow,
//! whose contacts are new, are first asked whether they may stay at rest.

use std::cmp::Reverse;
use std::sync::{Mutex, PoisonError};

use nonsmooth_linalg::{Bsr, budget};
use nonsmooth_problem::factors::FactorsGauge;
use nonsmooth_problem::{
    FrictionGlobal, FrictionLocal, GlobalPoint, LocalPoint, Problem, RollingLocal,
};
use nonsmooth_solve::registry::Registered;
use nonsmooth_solve::settings::SettingsMap;
use nonsmooth_solve::{Limits, Outcome, Session, SolveError, Status, registry};
use rayon::slice::ParallelSliceMut;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::SimulateError;
use crate::cut::Cut;

/// Fewer bodies, contacts or pairs of shapes than this are not worth another thread, which has to be woken.
const FEW: usize = 512;
/// So many parts for each thread: one that is held up leaves the rest to others.
const PARTS: usize = 4;
/// Islands of more contacts have a session of their own, which keeps what it knows of their pattern.
pub(crate) const SMALL: usize = 32;
/// What is asked first of a large island, and for how many iterations at most. A small one is solved more sharply without.
const RELAXATION: &str = "convex_relaxation";
const ITERATIONS: usize = 40;
/// It is solved so much better than asked for, an iteration or two, that the steps after it find the impulses good enough as they are; but no better than this.
const FINER: f64 = 1e-3;
const FINEST: f64 = 1e-12;

/// The solver of contact problems and its limits.
pub(crate) struct Inner<'a> {
    pub solver: &'a str,
    pub settings: &'a SettingsMap,
    pub limits: &'a Limits,
}

impl Inner<'_> {
    /// Whether the solver is the one that chooses for itself.
    pub fn is_auto(&self) -> bool {
        self.solver == "auto" && self.settings.is_empty()
    }
}

/// What is asked of the solver of an island.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Asked {
    /// All numbers of the problem are finite; else nothing is solved.
    pub finite: bool,
    /// Whether the bodies may stay at rest comes first.
    pub may_rest: bool,
    /// At most so many iterations.
    pub most: usize,
}

/// One contact problem, its start and its solution.
pub(crate) struct Slot<const D: usize> {
    pub problem: FrictionLocal<D>,
    /// The same with rolling friction, where a contact has any: then the point is of this one.
    pub rolling: Option<RollingLocal>,
    pub point: LocalPoint,
    /// The same with the bodies, where that is sooner solved: then the other two are not stated.
    pub global: Option<FrictionGlobal<D>>,
    pub asked: Asked,
    /// Whether velocities are taken where impulses are, and whether no contact has compliance or rolling friction.
    pub symmetric: bool,
    pub rigid: bool,
    /// Tells whether the impulses of the step before are good enough before W is formed.
    pub gauge: FactorsGauge,
    /// What came of it, before the solver is asked where it need not be; nothing where the problem is not finite.
    pub outcome: Option<Result<Outcome, SolveError>>,
    /// A number for each contact, for who states the problem.
    pub scratch: Vec<u32>,
    /// Behind a lock that nobody waits for, so that threads may look at the rest.
    own: Mutex<Option<Sessions<D>>>,
}

impl<const D: usize> Slot<D> {
    /// The problem is one of contacts alone, without scalar rows and rolling friction.
    pub fn leave_rows_out(&mut self) {
        (self.problem.rows, self.rolling) = (None, None);
        self.point.lambda.clear();
    }
}

impl<const D: usize> Slot<D>
where
    FrictionLocal<D>: Registered<Point = LocalPoint>,
    FrictionGlobal<D>: Registered<Point = GlobalPoint>,
{
    pub fn new() -> Result<Self, SimulateError> {
        let one = |i: usize, j: usize| f64::from(u8::from(i == j));
        let identity = std::array::from_fn(|i| std::array::from_fn(|j| one(i, j)));
        let w = Bsr::from_rows(1, &[vec![(0, identity)]]);
        let problem = FrictionLocal::new(w, vec![0.0; D], vec![0.0]).map_err(SolveError::from)?;
        let point = problem.origin();
        let asked = Asked::default();
        let scratch = vec![];
        Ok(Self {
            problem,
            rolling: None,
            point,
            global: None,
            asked,
            symmetric: true,
            rigid: true,
            gauge: FactorsGauge::default(),
            outcome: None,
            scratch,
            own: Mutex::new(None),
        })
    }

    fn is_large(&self) -> bool {
        self.problem.mu.len() > SMALL
    }

    fn solve(&mut self, sessions: &mut Sessions<D>, inner: &Inner) {
        if self.outcome.is_none() {
            self.outcome = sessions.solve(self, inner).transpose();
        }
    }

    fn own(&mut self) -> &mut Option<Sessions<D>> {
        self.own.get_mut().unwrap_or_else(PoisonError::into_inner)
    }

    /// By its own sessions.
    fn solve_alone(&mut self, inner: &Inner) {
        if let Some(mut own) = self.own().take() {
            self.solve(&mut own, inner);
            *self.own() = Some(own);
        }
    }
}

/// The sessions that solve one problem after the other.
pub(crate) struct Sessions<const D: usize> {
    local: Asking<FrictionLocal<D>>,
    rolling: Asking<RollingLocal>,
    global: Asking<FrictionGlobal<D>>,
    /// Of a problem with its bodies, which begins with the impulses.
    moved: GlobalPoint,
}

impl<const D: usize> Sessions<D>
where
    FrictionLocal<D>: Registered<Point = LocalPoint>,
    FrictionGlobal<D>: Registered<Point = GlobalPoint>,
{
    /// Errors: a solver that does not exist.
    fn new(inner: &Inner) -> Result<Self, SolveError> {
        let mut local = Asking::default();
        local.law(inner)?;
        let moved = GlobalPoint { v: vec![], r: vec![], lambda: vec![] };
        Ok(Self { local, rolling: Asking::default(), global: Asking::default(), moved })
    }

    fn solve(&mut self, slot: &mut Slot<D>, inner: &Inner) -> Result<Option<Outcome>, SolveError> {
        let Slot { problem, rolling, global, point, asked, .. } = slot;
        if !asked.finite {
            return Ok(None);
        }
        if let Some(problem) = rolling {
            let asked = Asked { may_rest: false, ..*asked };
            return self.rolling.solve(problem, point, asked, inner).map(Some);
        }
        if let Some(problem) = global {
            let moved = &mut self.moved;
            moved.v.clear();
            moved.v.resize(problem.f.len(), 0.0);
            moved.r.clone_from(&point.r);
            let outcome = self.global.solve(problem, moved, *asked, inner)?;
            point.r.copy_from_slice(&moved.r);
            return Ok(Some(outcome));
        }
        self.local.solve(problem, point, *asked, inner).map(Some)
    }
}

/// What is asked of problems of one kind; each session is made where it is first needed.
struct Asking<P: Problem> {
    law: Option<Box<dyn Session<P>>>,
    relaxation: Option<Box<dyn Session<P>>>,
}

impl<P: Problem> Default for Asking<P> {
    fn default() -> Self {
        Self { law: None, relaxation: None }
    }
}

impl<P: Registered<Point: Clone>> Asking<P> {
    fn law(&mut self, inner: &Inner) -> Result<&mut dyn Session<P>, SolveError> {
        let made = match self.law.take() {
            Some(session) => session,
            None => registry::session(inner.solver, inner.settings)?,
        };
        Ok(&mut **self.law.insert(made))
    }

    fn solve(
        &mut self,
        problem: &P,
        point: &mut P::Point,
        asked: Asked,
        inner: &Inner,
    ) -> Result<Outcome, SolveError> {
        let limits = |most: usize| Limits {
            max_iterations: inner.limits.max_iterations.min(most),
            ..inner.limits.clone()
        };
        if asked.may_rest {
            let relaxation = match &mut self.relaxation {
                Some(relaxation) => relaxation,
                None => self.relaxation.insert(registry::session(RELAXATION, &SettingsMap::new())?),
            };
            let start = point.clone();
            let tolerance = (FINER * inner.limits.tolerance).max(FINEST);
            let finer = Limits { tolerance, ..limits(ITERATIONS) };
            let outcome = relaxation.solve(problem, point, &finer, &mut |_| {})?;
            if outcome.measure.passes(inner.limits.tolerance) {
                return Ok(Outcome { status: Status::Solved, ..outcome });
            }
            *point = start;
        }
        self.law(inner)?.solve(problem, point, &limits(asked.most), &mut |_| {})
    }
}

/// The threads.
pub(crate) struct Crew {
    /// As asked for.
    pub threads: usize,
    /// None where the calling thread works alone.
    pool: Option<ThreadPool>,
}

impl Crew {
    /// So many threads, 0 for one a core; fewer where the system gives no more.
    pub fn new(threads: usize) -> Self {
        let pool = || ThreadPoolBuilder::new().num_threads(threads).build().ok();
        let pool = if threads == 1 { None } else { pool() };
        let pool = pool.filter(|p| p.current_num_threads() > 1);
        Self { threads, pool }
    }

    /// The threads, where there are more than the calling one and so many bodies, contacts or pairs are worth them.
    pub fn pool(&self, worth: usize) -> Option<&ThreadPool> {
        self.pool.as_ref().filter(|_| worth >= FEW)
    }

    /// Into how many parts so many items are to be cut.
    pub fn parts(&self, worth: usize) -> usize {
        self.pool(worth).map_or(1, |pool| PARTS * pool.current_num_threads())
    }

    /// Does `work` on consecutive parts of `all`, wherever they are cut, at the same time where so many items are worth it.
    pub fn spread<C: Cut>(&self, all: C, worth: usize, work: impl Fn(C) + Sync) {
        match self.pool(worth) {
            None => work(all),
            Some(pool) => {
                let most = all.count().div_ceil(self.parts(worth)).max(1);
                pool.install(|| halve(all, most, &work));
            }
        }
    }

    /// Sorts items whose keys are all different.
    pub fn sort_by_key<T: Send, K: Ord + Send>(
        &self,
        items: &mut [T],
        key: impl Fn(&T) -> K + Sync,
    ) {
        match self.pool(items.len()) {
            None => items.sort_unstable_by_key(key),
            Some(pool) => pool.install(|| items.par_sort_unstable_by_key(&key)),
        }
    }

    /// All items of the parts in place of those in `out`.
    pub fn join<'a, T: Copy + Send + Sync + 'a>(
        &self,
        parts: impl Iterator<Item = &'a [T]> + Clone,
        out: &mut Vec<T>,
    ) {
        let count = parts.clone().map(<[T]>::len).sum();
        let Some(&any) = parts.clone().flatten().next() else { return out.clear() };
        out.resize(count, any);
        let (mut rest, mut pairs) = (&mut out[..], vec![]);
        for part in parts {
            let (here, after) = rest.split_at_mut(part.len());
            pairs.push((here, part));
            rest = after;
        }
        self.spread(&mut pairs[..], count, |pairs| {
            pairs.iter_mut().for_each(|(to, from)| to.copy_from_slice(from));
        });
    }

    /// Solves the `open` ones of the slots that have no outcome yet, in ascending order; small ones by the `sessions`, one for each part of them, which are made where they are needed. Each keeps its
    /// outcome, errors too.
    ///
    /// Errors: a solver that does not exist.
    pub fn solve<const D: usize>(
        &self,
        (slots, sessions): (&mut [Slot<D>], &mut Vec<Sessions<D>>),
        open: &[u32],
        inner: &Inner,
    ) -> Result<(), SimulateError>
    where
        FrictionLocal<D>: Registered<Point = LocalPoint>,
        FrictionGlobal<D>: Registered<Point = GlobalPoint>,
    {
        let parts = self.pool.as_ref().map_or(1, |pool| PARTS * pool.current_num_threads());
        while sessions.len() < parts.min(open.len()).max(1) {
            sessions.push(Sessions::new(inner)?);
        }
        for &k in open {
            let slot = &mut slots[k as usize];
            if slot.outcome.is_none() && slot.is_large() && slot.own().is_none() {
                *slot.own() = Some(Sessions::new(inner)?);
            }
        }
        let Some(pool) = self.pool.as_ref().filter(|_| open.len() > 1) else {
            for &k in open {
                let slot = &mut slots[k as usize];
                match slot.is_large() {
                    true => slot.solve_alone(inner),
                    false => slot.solve(&mut sessions[0], inner),
                }
            }
            return Ok(());
        };
        let mut next = open.iter().peekable();
        let is_open =
            |(k, _): &(usize, &mut Slot<D>)| next.next_if(|&&o| o as usize == *k).is_some();
        let (mut large, mut small): (Vec<_>, Vec<_>) =
            slots.iter_mut().enumerate().filter(is_open).map(|s| s.1).partition(|s| s.is_large());
        // What takes longest begins first.
        large.sort_by_key(|slot| Reverse(slot.problem.mu.len()));
        let budget = budget::current();
        let share = small.len().div_ceil(parts).max(1);
        pool.scope(|scope| {
            for slot in large {
                let budget = &budget;
                scope.spawn(move |_| {
                    let _scope = budget.enter();
                    slot.solve_alone(inner);
                });
            }
            for (part, sessions) in small.chunks_mut(share).zip(sessions) {
                let budget = &budget;
                scope.spawn(move |_| {
                    let _scope = budget.enter();
                    part.iter_mut().for_each(|slot| slot.solve(sessions, inner));
                });
            }
        });
        Ok(())
    }
}

/// Parts of at most so many items, each half for whoever is free.
fn halve<C: Cut>(all: C, most: usize, work: &(impl Fn(C) + Sync)) {
    let count = all.count();
    if count <= most {
        return work(all);
    }
    let (first, rest) = all.cut(count / 2);
    // What belongs together may be all there is.
    if rest.count() == 0 {
        return work(first);
    }
    rayon::join(|| halve(first, most, work), || halve(rest, most, work));
}

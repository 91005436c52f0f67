//! **Coloured NSGS**: block Gauss–Seidel with contacts that do not feel each other visited at the same time.
//!
//! Problem: `u = W r + q`, `K* ∋ u + mu‖u_T‖e_N ⟂ r ∈ K` for each contact.
//!
//! Method: contacts are coloured so that two of one colour are not coupled (no block of W between them; in velocity space: no
//! component of M that both touch), greedily. A sweep takes the colours in turn; the members of a team of threads each answer a part of the
//! colour's visits from the same impulses, then one of them enters all the answers in order. The result is that of NSGS with the contacts
//! ordered by colour, and the same bits for every number of threads. Colours with few contacts are left to one thread.
//!
//! References: JourdanAlartJean1998; Acary, lecture (107); JonesPlassmann1993 for colourings.
//!
//! Cost of a sweep: as NSGS, plus the handing over of a colour to the team (a few atomic operations).
//! Storage: as NSGS.
//!
//! Fails: as NSGS; another order than the contacts' own may need more sweeps. Where contacts share an elastic body, in velocity space,
//! there is nothing to do at the same time (condense first).

use std::sync::{Mutex, MutexGuard, PoisonError, RwLock};

use nonsmooth_linalg::small;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::circles::Circles;
use super::contact::{Answer, Contact, ContactOf};
use super::nsgs::{LocalChoice, with_local};
use crate::contact::form::{Access, Concurrent, Disked, Frictional};
use crate::contact::law::Rolling;
use crate::contact::law::local::{Exact, LocalSolver, Quartic, RollingExact};
use crate::contact::splitting::coloring::Coloring;
use crate::contact::splitting::team::Team;
use crate::core::ranges::{at_least, at_most, below};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};
use crate::{Boxed, SolveError, Solver, Step};

/// Those of NSGS that make sense for colours, and the number of threads.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Colored {
    /// The one-contact solver. Contacts without friction and contacts in the plane have a closed form.
    pub local: LocalChoice,
    /// The number of threads; 0 for one a core. It changes the time, not one bit of the result.
    pub threads: usize,
    /// Colours with fewer contacts than this are left to one thread.
    pub serial_below: usize,
    /// Relaxation, in (0, 2); 1 is plain Gauss-Seidel.
    pub omega: f64,
    /// Where 1000 sweeps bring no progress and go in circles, omega is multiplied by 0.8, down to this, in (0, 2).
    /// Not below omega: never.
    pub omega_min: f64,
    /// Sweeps between two evaluations of the true residual, unless the cheap estimate asks for one earlier.
    pub check_every: usize,
}

impl Default for Colored {
    fn default() -> Self {
        Self {
            local: LocalChoice::default(),
            threads: 1,
            serial_below: 32,
            omega: 1.0,
            omega_min: 0.4,
            check_every: 50,
        }
    }
}

/// More threads than any machine has use for.
const THREADS_MOST: usize = 1024;

impl Settings for Colored {
    fn validate(&self) -> Result<(), String> {
        below("omega", self.omega, 2.0)?;
        below("omega_min", self.omega_min, 2.0)?;
        at_most("threads", self.threads, THREADS_MOST)?;
        at_least("check_every", self.check_every, 1)
    }
}

impl Described for Colored {
    const ABOUT: &'static About = &About {
        name: "nsgs_colored",
        family: "splitting",
        solves: Solves::Law,
        summary: "nonsmooth block Gauss-Seidel on several threads, contacts by colour; the same bits for any number of threads",
        needs: &[],
        cites: &["JourdanAlartJean1998", "Acary2018", "JonesPlassmann1993"],
        variants: &["threads=2", "serial_below=1", "local=newton_ac"],
        settings: described::<Self>,
    };
}

/// Coloured NSGS with its local solver known by type.
#[derive(Debug, Clone)]
pub struct ColoredSweeps<L, const D: usize> {
    settings: Colored,
    local: L,
}

impl Colored {
    /// The method with its local solver known by type.
    pub(crate) fn boxed<P: Concurrent<D> + Frictional<D> + 'static, const D: usize>(
        self,
    ) -> Boxed<P> {
        with_local!(self.local, [Exact, Quartic], local => Boxed::new(ColoredSweeps { settings: self, local }))
    }

    /// The same with rolling friction.
    pub(crate) fn rolling<P: Concurrent<D> + Disked<D, Law = Rolling> + 'static, const D: usize>(
        self,
    ) -> Boxed<P> {
        with_local!(self.local, [RollingExact, RollingExact], local => Boxed::new(ColoredSweeps { settings: self, local }))
    }
}

/// Parts of a colour for each member: two, so that a member that is late costs little.
const PARTS: usize = 2;

/// The workspace: the problem's view, the colours, and the contacts of each colour in parts.
pub struct ColoredWork<P: Concurrent<D>, L: LocalSolver<D, P::Law>, const D: usize> {
    state: P::State,
    team: Team,
    coloring: Coloring,
    /// The colours worth the team's while.
    shared: usize,
    parts: Vec<Mutex<Part<ContactOf<P, L, D>, D>>>,
    /// The contacts of the other colours.
    rest: Vec<(usize, ContactOf<P, L, D>)>,
    units: Vec<f64>,
    circles: Circles,
    by_color: Vec<Vec<u32>>,
    /// The last sweep moved nothing.
    still: bool,
}

/// A part of every colour's contacts, and the answers to the present colour's visits.
struct Part<C, const D: usize> {
    contacts: Vec<(usize, C)>,
    /// Where each shared colour's contacts begin; one more at the end.
    starts: Vec<usize>,
    answers: Vec<(usize, Answer<D>)>,
}

/// What a sweep moved.
#[derive(Default)]
struct Moves {
    sum: f64,
    any: bool,
}

impl Moves {
    /// Enters an answer.
    fn take<P: Concurrent<D>, const D: usize>(
        &mut self,
        problem: &P,
        (r, state): (&mut [f64], &mut P::State),
        c: usize,
        answer: &Answer<D>,
    ) {
        if answer.made {
            self.any = true;
            r[D * c..D * c + D].copy_from_slice(&answer.new);
            problem.moved(state, c, &answer.dr);
        }
        self.sum += answer.moved;
    }
}

impl<const D: usize, P, L> Solver<P> for ColoredSweeps<L, D>
where
    P: Concurrent<D>,
    L: LocalSolver<D, P::Law>,
{
    type Work = ColoredWork<P, L, D>;

    fn work(&self, problem: &P) -> Result<Self::Work, SolveError> {
        let team = Team::new(self.settings.threads);
        let part = || Part { contacts: vec![], starts: vec![], answers: vec![] };
        let mut work = ColoredWork {
            state: problem.state(Access::Visits)?,
            coloring: Coloring::default(),
            shared: 0,
            parts: (0..PARTS * team.size()).map(|_| Mutex::new(part())).collect(),
            rest: vec![],
            units: vec![],
            circles: Circles::default(),
            by_color: vec![],
            still: false,
            team,
        };
        self.fill(problem, &mut work);
        Ok(work)
    }

    fn refill(&self, problem: &P, work: &mut Self::Work) -> Result<(), SolveError> {
        problem.refill(&mut work.state)?;
        self.fill(problem, work);
        Ok(())
    }

    fn start(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) {
        problem.enter(&mut work.state, point);
        work.circles.restart(self.settings.omega, self.settings.omega_min);
        work.still = false;
    }

    fn step(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) -> Step {
        if let Some(ray) = problem.contradiction(&work.state) {
            return Step::NoSolution(ray.clone().into());
        }
        let r = P::impulses(point);
        let omega = work.circles.omega(r);
        let mut moves = self.sweep(problem, r, work, omega);
        for (c, contact) in &mut work.rest {
            let old = small::block(r, *c);
            let u = problem.velocity(&work.state, r, *c);
            let answer = contact.answer(&self.local, &u, &old, omega);
            moves.take(problem, (&mut *r, &mut work.state), *c, &answer);
        }
        if std::mem::replace(&mut work.still, !moves.any) && !moves.any {
            // Every later sweep would repeat this one, with velocities that the judge's look has renewed.
            return Step::Done;
        }
        let estimate = moves.sum.sqrt();
        let unit = |c: usize| work.units[c];
        match work.circles.observe(problem, &unit, r, estimate) {
            Some(ray) => Step::NoSolution(ray),
            None => Step::Continue { estimate },
        }
    }

    fn publish(&self, problem: &P, point: &mut P::Point, work: &mut Self::Work) {
        problem.complete(&mut work.state, point);
    }

    fn check_every(&self, _: &Self::Work) -> usize {
        self.settings.check_every
    }
}

impl<L, const D: usize> ColoredSweeps<L, D> {
    /// The shared colours, in turn. All members answer from the same impulses; then one enters the answers, in the order of
    /// the contacts whatever the number of members.
    fn sweep<P>(
        &self,
        problem: &P,
        r: &mut [f64],
        work: &mut ColoredWork<P, L, D>,
        omega: f64,
    ) -> Moves
    where
        P: Concurrent<D>,
        L: LocalSolver<D, P::Law>,
    {
        let ColoredWork { state, team, shared, parts, .. } = work;
        if *shared == 0 {
            return Moves::default();
        }
        let (parts, shared) = (&*parts, *shared);
        let present = RwLock::new((r, state));
        let mut moves = Moves::default();
        let answer = |color: usize, k: usize| {
            let mut part = locked(&parts[k]);
            let present = present.read().unwrap_or_else(PoisonError::into_inner);
            let (r, state) = (&*present.0, &*present.1);
            let Part { contacts, starts, answers } = &mut *part;
            answers.clear();
            for (c, contact) in &mut contacts[starts[color]..starts[color + 1]] {
                let u = problem.velocity(state, r, *c);
                let old = small::block(r, *c);
                answers.push((*c, contact.answer(&self.local, &u, &old, omega)));
            }
        };
        let enter = |_: usize| {
            let mut present = present.write().unwrap_or_else(PoisonError::into_inner);
            let (r, state) = &mut *present;
            for part in parts {
                for (c, answer) in &locked(part).answers {
                    moves.take(problem, (&mut **r, &mut **state), *c, answer);
                }
            }
        };
        team.share(shared, parts.len(), answer, enter);
        moves
    }

    fn fill<P>(&self, problem: &P, work: &mut ColoredWork<P, L, D>)
    where
        P: Concurrent<D>,
        L: LocalSolver<D, P::Law>,
    {
        let n = problem.contacts();
        let ColoredWork { state, coloring, parts, rest, units, by_color, .. } = work;
        let scale = problem.velocity_scale(state);
        coloring.fill(problem, state);
        by_color.iter_mut().for_each(Vec::clear);
        if by_color.len() < coloring.count() {
            by_color.resize(coloring.count(), vec![]);
        }
        for (c, color) in coloring.colors().iter().enumerate() {
            by_color[*color as usize].push(c as u32);
        }
        rest.clear();
        for part in &mut *parts {
            let Part { contacts, starts, .. } = &mut *locked(part);
            contacts.clear();
            starts.clear();
            starts.push(0);
        }
        units.clear();
        units.resize(n, 0.0);
        let mut made = |c: u32| {
            let c = c as usize;
            let w = problem.diagonal_block(state, c);
            let contact = Contact::new(&self.local, w, problem.law(c), scale);
            units[c] = contact.unit;
            (c, contact)
        };
        work.shared = 0;
        for contacts in &by_color[..coloring.count()] {
            if contacts.len() < self.settings.serial_below {
                rest.extend(contacts.iter().map(|c| made(*c)));
                continue;
            }
            work.shared += 1;
            let count = parts.len();
            for (i, part) in parts.iter_mut().enumerate() {
                let mut part = locked(part);
                let at = |k: usize| k * contacts.len() / count;
                part.contacts.extend(contacts[at(i)..at(i + 1)].iter().map(|c| made(*c)));
                let end = part.contacts.len();
                part.starts.push(end);
                let most = part.starts.windows(2).map(|s| s[1] - s[0]).max().unwrap_or(0);
                part.answers.clear();
                part.answers.reserve(most);
            }
        }
        work.circles.resize(D * n);
    }
}

/// The lock's content; that another thread has panicked is told by the team.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use nonsmooth_problem::planted::Planted;

    use super::*;
    use crate::contact::law::local::Exact;
    use crate::contact::splitting::{Nsgs, Sweeps};
    use crate::{Driver, Limits, Session};

    fn many() -> Planted {
        Planted { contacts: 60, dofs: 400, seed: 2, ..Planted::default() }
    }

    fn solved<P: Concurrent<D> + Frictional<D>, const D: usize>(
        problem: &P,
        solver: impl Solver<P>,
    ) -> Vec<f64> {
        let mut driver = Driver::new(solver);
        let mut point = problem.origin();
        let limits = Limits { tolerance: 1e-12, max_iterations: 20_000, ..Limits::default() };
        let outcome = driver.solve(problem, &mut point, &limits, &mut |_| {}).unwrap();
        assert!(outcome.measure.relative < 1e-11, "{}", outcome.measure.relative);
        P::impulses(&mut point).to_vec()
    }

    fn colored<const D: usize>(threads: usize, serial_below: usize) -> ColoredSweeps<Exact, D> {
        let settings = Colored { threads, serial_below, ..Colored::default() };
        ColoredSweeps { settings, local: Exact }
    }

    /// The impulses after a few sweeps, as bits.
    fn bits<P: Concurrent<D> + Frictional<D>, const D: usize>(
        problem: &P,
        threads: usize,
        below: usize,
    ) -> Vec<u64> {
        let solver = colored::<D>(threads, below);
        let mut work = solver.work(problem).unwrap();
        assert!(below > 100 || work.shared > 0);
        let mut point = problem.origin();
        solver.start(problem, &mut point, &mut work);
        for _ in 0..7 {
            solver.step(problem, &mut point, &mut work);
        }
        P::impulses(&mut point).iter().map(|x| x.to_bits()).collect()
    }

    #[test]
    fn the_bits_do_not_depend_on_the_number_of_threads() {
        let (local, global) = (many().local::<3>().0, many().global::<3>().0);
        let plane = Planted { bilateral: 3, ..many() }.global::<2>().0;
        for below in [1, 3] {
            for threads in [2, 3] {
                assert_eq!(bits(&local, threads, below), bits(&local, 1, below));
                assert_eq!(bits(&global, threads, below), bits(&global, 1, below));
                assert_eq!(bits(&plane, threads, below), bits(&plane, 1, below));
            }
        }
    }

    /// Colours as a team and colours by one thread are the same Gauss–Seidel, in exact arithmetic and for W in rows also in
    /// this one, where no colour is left out of the order.
    #[test]
    fn a_colour_at_once_is_a_colour_in_sequence() {
        let local = many().local::<3>().0;
        assert_eq!(bits(&local, 2, 1), bits(&local, 1, usize::MAX));
    }

    #[test]
    fn the_solution_is_that_of_nsgs() {
        let check = |a: Vec<f64>, b: Vec<f64>| {
            let size = b.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-8 * size));
        };
        let nsgs = || Sweeps { settings: Nsgs::default(), local: Exact };
        let (local, global) = (many().local::<3>().0, many().global::<3>().0);
        check(solved(&local, colored::<3>(2, 2)), solved(&local, nsgs()));
        check(solved(&global, colored::<3>(2, 2)), solved(&global, nsgs()));
    }
}

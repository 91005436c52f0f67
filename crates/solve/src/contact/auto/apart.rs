//! Islands apart.
//!
//! Problem: contacts in groups that do not feel each other, `W = diag(W_1 … W_k)`.
//!
//! Method: where no island has nearly all contacts, each that a few sweeps over all have not solved is solved by itself, by all stages of `auto`, from the impulses that it has: what is hard in one
//! costs nothing in the others, and what comes to rest is not held up by what slides. If one has no solution, neither has the whole. The natural map of the whole is made of theirs, so that islands with `e_i ≤ τ max(‖q_i‖, ‖q‖/√k)/√2`
//! have `√(Σ e_i²) ≤ τ‖q‖`. Where the judge of all does not agree, as of a contact whose own loads are small, islands are asked for a tenth, and by the judge.
//! On 52 local problems of the corpus that fall apart this takes .57 of the time (.14 to 1.6), on those of capsules a half to a seventh.
//!
//! Cost: a union-find over the couplings; then what the islands cost, a problem and a workspace for each of the first sixteen and one for the others. Fails: where an island does, or leaves in doubt whether it has a solution; after the others the stages go on with the whole.

use nonsmooth_linalg::{Groups, budget};
use nonsmooth_problem::check::{Certificate, Kinematic};

use super::starts::lost;
use super::{Auto, Done, FIRST, HybridWork, Stage, runs_away};
use crate::contact::form::{Disked, Linearised, OnContacts, Parted};
use crate::{SolveError, Solver, Step};

/// A problem of fewer contacts is left whole.
const CONTACTS: usize = 18;
/// A problem is left whole where its largest island has more than this part of the contacts.
const LARGEST: f64 = 0.9;
/// The islands' aims leave room for the rounding of their sum.
const MARGIN: f64 = 0.7;
/// An island may be looser than the whole by so much of `√τ`, which is what a contact's own residual may be.
const OWN: f64 = 0.1;
/// Nor is an island asked for less than this, which is rounding.
const LEAST: f64 = 1e-14;
/// An island whose residual is small, and that of a contact by itself is not, is given up after so many steps.
const IN_VAIN: usize = 200;
/// So often is a tenth asked for.
const ROUNDS: usize = 4;
/// After so many steps an island waits until all others have had their turn.
const PATIENCE: usize = 64;
/// So many islands are kept for the next solve, at most.
const KEPT: usize = 16;
/// Steps of islands between two looks of the judge.
const LOOK: usize = 32;

/// The islands of a problem, and the one that is being solved.
pub(super) struct Apart<P: Linearised<D> + Disked<D>, const D: usize> {
    /// The members of each, and the group of each member.
    islands: Vec<Vec<usize>>,
    numbers: Vec<usize>,
    /// Contacts of the largest.
    largest: usize,
    /// Those before have had their turn.
    next: usize,
    present: Option<Box<Island<P, D>>>,
    /// What is kept of each island: another solve of the same islands allocates nothing. So many are there.
    home: Vec<Option<Box<Island<P, D>>>>,
    at_home: usize,
    /// Those that take long, until all others have had their turn.
    put_off: Vec<usize>,
    /// The workspace of the last island that was not kept: of the next it keeps the memory.
    spare: Option<HybridWork<P, D>>,
    /// The square of each contact's error at the beginning of the round.
    squares: Vec<f64>,
    /// None: the problem was not taken apart.
    rounds: usize,
    /// One could not be solved.
    failed: bool,
    /// Steps since the judge looked.
    since: usize,
    /// How often one was solved by itself; the most steps that one took, which, and what was done there if it was not kept.
    solves: usize,
    longest: (usize, usize),
    said: Option<String>,
}

/// An island as a problem of its own.
struct Island<P: Linearised<D> + Disked<D>, const D: usize> {
    /// Its place among the islands.
    at: usize,
    problem: P,
    point: P::Point,
    work: HybridWork<P, D>,
    /// The judge of the island, where that of the whole has refused what plain residuals let pass.
    gauge: Option<P::Gauge>,
    steps: usize,
    since: usize,
}

/// What a step came to.
enum Came {
    Further,
    Solved,
    Hopeless(Certificate),
    Failed,
}

impl<P, const D: usize> Island<P, D>
where
    P: Linearised<D> + Disked<D> + Kinematic<D> + Parted<D> + Send,
{
    /// A step; it is solved where its residual is as small as it must be and, if `own` is a limit, the residuals of its contacts by themselves are below that.
    fn step(&mut self, method: &OnContacts<Auto, D>, own: Option<f64>) -> Came {
        let Self { problem, point, work, .. } = self;
        let step = method.step(problem, point, work);
        self.steps += 1;
        self.since += 1;
        let due = match step {
            Step::Continue { estimate } => {
                estimate <= work.tolerance || self.since >= method.check_every(work)
            }
            Step::Done => true,
            Step::NoSolution(certificate) if problem.verify(&certificate) => {
                return Came::Hopeless(certificate);
            }
            // What holds nearly alone may be no word on the whole.
            Step::NoSolution(_) | Step::Stuck(_) => return Came::Failed,
        };
        if !due {
            return Came::Further;
        }
        self.since = 0;
        method.publish(problem, point, work);
        let r = P::impulses(point);
        work.units.resize(r.len(), 0.0);
        problem.velocities(&mut work.state, r, &mut work.units);
        let error = work.sweep.residual(&work.units, r);
        let near = error <= work.tolerance * work.scale;
        if near && own.is_none_or(|limit| self.passes_by_itself(limit)) {
            Came::Solved
        } else if near && self.steps > IN_VAIN || runs_away(error / self.work.scale) {
            Came::Failed
        } else {
            Came::Further
        }
    }

    /// The same of a point by its impulses.
    fn completed_passes(&mut self, limit: f64) -> bool {
        let Self { problem, point, work, .. } = self;
        problem.enter(&mut work.state, point);
        problem.complete(&mut work.state, point);
        self.passes_by_itself(limit)
    }

    /// Whether the own residual of each contact is at most `limit`.
    fn passes_by_itself(&mut self, limit: f64) -> bool {
        let Self { problem, point, gauge, .. } = self;
        if gauge.is_none() {
            *gauge = problem.gauge().ok();
        }
        let Some(gauge) = gauge else { return true };
        problem.certify(point, gauge).own.is_none_or(|own| own <= limit)
    }
}

impl<P: Linearised<D> + Disked<D>, const D: usize> Apart<P, D> {
    /// Of groups that are joined.
    fn new(groups: &mut Groups, contacts: usize) -> Self {
        let mut islands = groups.members();
        islands.retain(|members| members[0] < contacts);
        let sizes = islands.iter().map(|members| of_contacts(members, contacts).len());
        Self {
            numbers: groups.numbers(),
            largest: sizes.max().unwrap_or(0),
            next: islands.len(),
            present: None,
            home: islands.iter().map(|_| None).collect(),
            at_home: 0,
            put_off: Vec::with_capacity(islands.len()),
            spare: None,
            squares: vec![],
            rounds: 0,
            failed: false,
            since: 0,
            solves: 0,
            longest: (0, 0),
            said: None,
            islands,
        }
    }

    /// Begins again with another problem of the same islands.
    pub(super) fn restart(&mut self) {
        if let Some(island) = self.present.take() {
            self.keep(island);
        }
        self.put_off.clear();
        (self.rounds, self.since, self.failed) = (0, 0, false);
        (self.solves, self.longest, self.said) = (0, (0, 0), None);
    }

    /// Keeps an island that has ended, or its memory.
    fn keep(&mut self, island: Box<Island<P, D>>) {
        if self.at_home < KEPT {
            self.bring_home(island);
        } else {
            self.spare = Some(island.work);
        }
    }

    fn bring_home(&mut self, island: Box<Island<P, D>>) {
        self.at_home += 1;
        let at = island.at;
        self.home[at] = Some(island);
    }

    fn fetch(&mut self, at: usize) -> Option<Box<Island<P, D>>> {
        let island = self.home[at].take();
        self.at_home -= usize::from(island.is_some());
        island
    }

    /// The limit of contacts' own residuals, where the judge has refused what residuals of islands let pass.
    fn own_limit(&self, tolerance: f64) -> Option<f64> {
        (self.rounds > 1).then(|| 0.5 * tolerance.sqrt())
    }

    /// Whether it was taken apart in this solve.
    pub(super) fn was_used(&self) -> bool {
        self.rounds > 0
    }
}

impl<P, const D: usize> Apart<P, D>
where
    P: Linearised<D> + Disked<D> + Kinematic<D> + Parted<D> + Send,
{
    /// What was done.
    pub(super) fn account(&self, method: &OnContacts<Auto, D>) -> String {
        let Self { islands, home, solves, longest, said, .. } = self;
        let kept = home.get(longest.1).and_then(Option::as_ref);
        let longest = match (said, kept) {
            (Some(said), _) => said.clone(),
            (None, Some(island)) => method.account(&island.work).join("; "),
            (None, None) => "none".into(),
        };
        format!("{} islands, in {solves} solves, the longest by {longest}", islands.len())
    }
}

/// The contacts among the members of a group.
fn of_contacts(members: &[usize], all: usize) -> &[usize] {
    &members[..members.partition_point(|&x| x < all)]
}

impl<const D: usize> OnContacts<Auto, D> {
    /// Whether the problem falls apart, asked once, after sweeps whose last one moved so much; its islands are then to be solved one by one.
    pub(super) fn falls_apart<P: Linearised<D> + Disked<D> + Kinematic<D> + Parted<D> + Send>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
        moves: f64,
    ) -> bool {
        let all = problem.contacts();
        let small = all < CONTACTS || moves <= work.tolerance;
        if small || work.parted || problem.bounds().is_some() {
            return false;
        }
        work.parted = true;
        problem.join(&mut work.groups);
        if work.groups.count() == 1 {
            return false;
        }
        let before = work.apart.take().filter(|apart| work.groups.are(&apart.numbers));
        let groups = &mut work.groups;
        let mut apart = before.unwrap_or_else(|| Box::new(Apart::new(groups, all)));
        let whole = apart.largest as f64 > LARGEST * all as f64;
        if !whole {
            self.begin_round(problem, point, work, &mut apart);
            work.stage = Stage::Apart;
        }
        work.apart = Some(apart);
        !whole
    }

    /// The errors of all islands, each of which gets its turn; returns that of the whole, relative.
    fn begin_round<P: Linearised<D> + Disked<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
        apart: &mut Apart<P, D>,
    ) -> f64 {
        let HybridWork { state, sweep, units: u, scale, .. } = work;
        let r = P::impulses(point);
        u.resize(r.len(), 0.0);
        problem.velocities(state, r, u);
        sweep.squares(u, r, &mut apart.squares);
        (apart.next, apart.rounds) = (0, apart.rounds + 1);
        apart.squares.iter().sum::<f64>().sqrt() / *scale
    }

    /// A step on an island; where there is none left, all are looked at.
    pub(super) fn part<P: Linearised<D> + Disked<D> + Kinematic<D> + Parted<D> + Send>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
    ) -> Step {
        let Some(mut apart) = work.apart.take() else { return lost() };
        let (mut estimate, mut ended) = (f64::NAN, None);
        let own = apart.own_limit(work.tolerance);
        if apart.present.is_none() {
            apart.present = self.next_island(problem, point, work, &mut apart);
        }
        if let Some(island) = &mut apart.present {
            let came = island.step(self, own);
            let members = &apart.islands[island.at];
            let (own, r) = (P::impulses(&mut island.point), P::impulses(point));
            for (own, &c) in own.chunks(D).zip(of_contacts(members, problem.contacts())) {
                r[D * c..D * c + D].copy_from_slice(own);
            }
            apart.since += 1;
            if apart.since >= LOOK {
                (apart.since, work.still) = (0, false);
            }
            apart.failed |= matches!(came, Came::Failed | Came::Hopeless(_));
            if let Came::Hopeless(certificate) = &came
                && !work.doubted
            {
                ended = Some(Step::NoSolution(problem.lifted(members, certificate.clone())));
            }
            if let Came::Further = came {
                if island.steps == PATIENCE
                    && let Some(island) = apart.present.take()
                {
                    apart.put_off.push(island.at);
                    apart.bring_home(island);
                }
            } else if let Some(island) = apart.present.take() {
                apart.solves += 1;
                if island.steps > apart.longest.0 {
                    let lost = apart.at_home >= KEPT;
                    apart.longest = (island.steps, island.at);
                    apart.said = lost.then(|| self.account(&island.work).join("; "));
                }
                apart.keep(island);
            }
        } else {
            // Whether the judge agrees is seen when this comes again.
            work.still = false;
            let over = apart.failed || apart.rounds > ROUNDS;
            estimate = self.begin_round(problem, point, work, &mut apart);
            if over {
                problem.enter(&mut work.state, point);
                work.rate.begin();
                work.acceleration.begin_again();
                work.stage = FIRST;
            }
        }
        work.apart = Some(apart);
        ended.unwrap_or(Step::Continue { estimate })
    }

    /// Island `at` as a problem of its own: what is kept of it, or made anew.
    fn island<P: Linearised<D> + Disked<D> + Kinematic<D> + Parted<D> + Send>(
        &self,
        problem: &P,
        apart: &mut Apart<P, D>,
        at: usize,
    ) -> Result<Box<Island<P, D>>, SolveError> {
        if let Some(mut island) = apart.fetch(at) {
            problem.island_again(&apart.islands[at], &mut island.problem);
            self.refill(&island.problem, &mut island.work)?;
            if let Some(gauge) = &mut island.gauge {
                island.problem.regauge(gauge)?;
            }
            return Ok(island);
        }
        let inner = problem.island(&apart.islands[at]);
        let work = match apart.spare.take() {
            Some(mut work) => {
                self.refill(&inner, &mut work)?;
                work
            }
            None => self.work(&inner)?,
        };
        let point = inner.origin();
        Ok(Box::new(Island { at, problem: inner, point, work, gauge: None, steps: 0, since: 0 }))
    }

    /// The next island that is not yet as near as it must be, ready to be solved; at last one that was put off.
    fn next_island<P: Linearised<D> + Disked<D> + Kinematic<D> + Parted<D> + Send>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
        apart: &mut Apart<P, D>,
    ) -> Option<Box<Island<P, D>>> {
        let all = problem.contacts();
        let k = apart.islands.len() as f64;
        let aim = MARGIN * work.tolerance * 0.1_f64.powi(apart.rounds as i32 - 1);
        let aim = aim.max(LEAST.min(MARGIN * work.tolerance));
        let own = apart.own_limit(work.tolerance);
        while let Some(members) = apart.islands.get(apart.next) {
            let at = apart.next;
            apart.next += 1;
            let contacts = of_contacts(members, all);
            let error = contacts.iter().map(|&c| apart.squares[c]).sum::<f64>().sqrt();
            let share = aim * work.scale / k.sqrt();
            if error <= share && own.is_none() {
                continue;
            }
            if budget::over() {
                break;
            }
            let Ok(mut island) = self.island(problem, apart, at) else { continue };
            let loads = island.work.scale.min(work.scale);
            let tolerance = (aim * loads).max(share) / island.work.scale;
            let tolerance = tolerance.min(OWN * work.tolerance.sqrt());
            if error <= tolerance * island.work.scale && own.is_none() {
                apart.keep(island);
                continue;
            }
            let members = of_contacts(&apart.islands[at], all);
            let (to, r) = (P::impulses(&mut island.point), P::impulses(point));
            for (to, &c) in to.chunks_mut(D).zip(members) {
                to.copy_from_slice(&r[D * c..D * c + D]);
            }
            let near = error <= tolerance * island.work.scale;
            if near && own.is_some_and(|limit| island.completed_passes(limit)) {
                apart.keep(island);
                continue;
            }
            let Island { problem: inner, point: start, work: own, steps, since, .. } = &mut *island;
            self.aim(tolerance, own);
            own.done = Done { start: work.done.start, ..Done::default() };
            self.begin(inner, start, own);
            (*steps, *since) = (0, 0);
            return Some(island);
        }
        apart.put_off.pop().and_then(|at| apart.fetch(at))
    }
}

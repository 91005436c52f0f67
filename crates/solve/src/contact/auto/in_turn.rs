//! Motion and impulses in turn: what moves is found with what rests as its support, then the impulses of all from that motion.
//!
//! Problem: `M v = H r + f`, `u = Hᵀ v + w`, `K* ∋ u + mu‖u_T‖e_N ⟂ r ∈ K` for each contact, M in blocks of one body each.
//!
//! Method: two problems that are each easier than the whole.
//!
//! *Motion* of the bodies of a set B as if all others were fixed, `v = 0`: the rows of B, and the contacts that touch it: the same problem, smaller. Where bodies
//! next to the border of B move, their neighbours join it.
//!
//! *Impulses* for a motion v*: the law leaves each contact a convex set, K where it sticks, the ray `a (1, −mu t)`, `t = u_T/‖u_T‖`, where it slides, zero where it opens, and the
//! dynamics ask for v*: the static theorem of limit analysis. The impulses that come nearest,
//!
//! ```text
//! min ½ ‖v − v*‖²_M    over    v = M⁻¹(H r + f),    r_c in the set of contact c,
//! ```
//!
//! are those of a problem with frictionless contacts for the rays and without the term `mu‖u_T‖`, on which an interior point has nothing to turn back for. Where they reach v*, both
//! are a solution. Bodies that are torn away from it join B with their neighbours: the first time, with B empty, they are those that cannot rest.
//!
//! References: Livesley1978 (limit analysis of rigid blocks: what impulses must be where the motion is known); NesterovTodd1998 for the interior point; that the two are done in turn is ours.
//! Cost of a round: some 15 to 50 factorisations for the impulses, and one to a few solves over B. Storage: two copies of H and the interior point's.
//! Fails: where all bodies move (flows), B is all there is. Where what moves depends on which of many impulses hold it, the impulses may not be found; the caller keeps the best.

use nonsmooth_linalg::{Csc, Groups, budget, norm, small};
use nonsmooth_problem::check::Kinematic;
use nonsmooth_problem::{FrictionGlobal, GlobalPoint, Problem};

use super::starts::{Halvings, lost};
use super::{Auto, HybridWork, Stage};
use crate::contact::form::{Access, Contacts, Disked, Linearised, OnContacts};
use crate::contact::law::DiskLaw;
use crate::contact::parts::Central;
use crate::core::drive::Driver;
use crate::{Limits, Session, Status, Step};

/// Motion and impulses in turn have come near enough for Newton's iterations; where the impulses of rest come no nearer than this, nearly all moves.
const TURNED: f64 = 1e-6;
const NOT_AT_REST: f64 = 1.5e-2;

/// Fewer bodies than this are no structure of which a part could rest.
const BODIES: usize = 8;
/// The unknowns of a rigid body in space.
const NEIGHBOURS: usize = 6;
/// Velocities below this part of the mean of the loads' are rest.
const REST: f64 = 1e-6;
/// Bodies torn away by this part of the largest such velocity join those that may move.
const TORN: f64 = 0.1;
/// Where B has grown by less than this part, it grows by all its neighbours.
const LITTLE: f64 = 0.02;
/// Iterations of the interior point, and so many that have not halved the error end it; also an error below this part of what tears bodies away: then they are known.
const ITERATIONS: usize = 60;
const IDLE: usize = 12;
const KNOWN: f64 = 1e-2;
/// Iterations of one solve over B.
const NESTED: usize = 1000;
/// Of solves over B in a row, each with a larger one.
const LARGER: usize = 10;
/// Rounds.
const ROUNDS: usize = 8;

/// What comes next.
enum Turn<L: DiskLaw<D>, const D: usize> {
    Impulses(Box<Impulses<L, D>>),
    Motion { solves: usize },
    Nothing,
}

/// What a step came to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Came {
    /// Nothing yet.
    Further,
    /// The impulses of a round: [`InTurn::impulses`].
    Round,
    /// Nothing more will come.
    End,
}

/// The bodies, which of them may move, and how.
pub(super) struct InTurn<L: DiskLaw<D>, const D: usize> {
    /// The degrees of freedom of each body, and the body of each.
    dofs: Vec<Vec<usize>>,
    body: Vec<usize>,
    /// The contacts of each body.
    contacts: Vec<Vec<usize>>,
    /// Those that may move, B; those that do, or are torn away from rest; and how many do with v*.
    free: Vec<bool>,
    moving: Vec<bool>,
    movers: usize,
    /// v*.
    motion: Vec<f64>,
    /// r of the last round.
    r: Vec<f64>,
    /// What counts as rest, in m/s.
    rest: f64,
    tolerance: f64,
    turn: Turn<L, D>,
    rounds: usize,
}

impl<L: DiskLaw<D>, const D: usize> InTurn<L, D> {
    /// Begins with all bodies at rest. `scale` is ‖q‖, `tolerance` the relative residual asked for.
    ///
    /// `None`: too few bodies, rolling friction, or a matrix that cannot be had.
    pub(super) fn begin(
        problem: &FrictionGlobal<D, L>,
        scale: f64,
        tolerance: f64,
    ) -> Option<Self> {
        if L::DISKS > 1 {
            return None;
        }
        let n = problem.dofs();
        let mut groups = unknowns_of_bodies(problem);
        let (dofs, body) = (groups.members(), groups.numbers());
        if dofs.len() < BODIES {
            return None;
        }
        let mut contacts = vec![vec![]; dofs.len()];
        for c in 0..problem.contacts() {
            for b in bodies_of::<L, D>(problem, &body, c) {
                contacts[b].push(c);
            }
        }
        let none = vec![false; dofs.len()];
        let motion = vec![0.0; n];
        let turn = Turn::Impulses(Box::new(Impulses::begin(problem, &motion, 0.0)?));
        Some(Self {
            rest: REST * scale / (problem.contacts() as f64).sqrt(),
            r: vec![0.0; D * problem.contacts()],
            free: none.clone(),
            moving: none,
            movers: 0,
            rounds: 0,
            dofs,
            body,
            contacts,
            motion,
            tolerance,
            turn,
        })
    }

    /// The impulses of the last round.
    pub(super) fn impulses(&self) -> &[f64] {
        &self.r
    }

    /// Rounds, bodies that move in the last motion, and all.
    pub(super) fn counts(&self) -> [usize; 3] {
        [self.rounds, self.movers, self.dofs.len()]
    }

    /// One iteration for the impulses, or one solve for the motion. After a round that is not good enough, the next step goes on.
    pub(super) fn step(&mut self, problem: &FrictionGlobal<D, L>) -> Came {
        match &mut self.turn {
            Turn::Impulses(impulses) => {
                if !impulses.iterate(self.tolerance) {
                    return Came::Further;
                }
                let v = impulses.end(&mut self.r);
                self.rounds += 1;
                let torn: Vec<f64> = v.iter().zip(&self.motion).map(|(v, to)| v - to).collect();
                let goes_on = self.admit(problem, &torn) && self.rounds < ROUNDS;
                self.turn = if goes_on { Turn::Motion { solves: 0 } } else { Turn::Nothing };
                Came::Round
            }
            Turn::Nothing => Came::End,
            Turn::Motion { solves } => {
                *solves += 1;
                let last = *solves == LARGER;
                if !self.move_free(problem) {
                    return Came::End;
                }
                let larger = self.surround(problem);
                if larger && self.all_free() {
                    return Came::End;
                }
                if last || !larger {
                    match Impulses::begin(problem, &self.motion, self.rest) {
                        Some(next) => self.turn = Turn::Impulses(Box::new(next)),
                        None => return Came::End,
                    }
                }
                Came::Further
            }
        }
    }

    /// How fast a body moves with v, by the velocities that it gives its contacts.
    fn speed(&self, problem: &FrictionGlobal<D, L>, v: &[f64], body: usize) -> f64 {
        let at = |c: &usize| {
            let of = |j: usize| {
                let (rows, values) = problem.H.column(j);
                let own = rows.iter().zip(values).filter(|(i, _)| self.body[**i] == body);
                own.map(|(&i, h)| h * v[i]).sum::<f64>()
            };
            norm(&std::array::from_fn::<f64, D, _>(|k| of(D * c + k)))
        };
        self.contacts[body].iter().map(at).fold(0.0, f64::max)
    }

    /// The bodies that these velocities tear away, and the neighbours of all that move, may move. False where B becomes all there is, or nothing is torn.
    fn admit(&mut self, problem: &FrictionGlobal<D, L>, torn: &[f64]) -> bool {
        let speeds: Vec<f64> = (0..self.dofs.len()).map(|b| self.speed(problem, torn, b)).collect();
        let largest = speeds.iter().copied().fold(0.0, f64::max);
        if !(largest > 0.0 && largest.is_finite()) {
            return false;
        }
        let before = count(&self.free);
        for (moving, speed) in self.moving.iter_mut().zip(&speeds) {
            *moving |= *speed > TORN * largest;
        }
        self.surround(problem);
        if ((count(&self.free) - before) as f64) < LITTLE * before as f64 {
            let all = self.free.clone();
            self.join_neighbours(problem, &all);
        }
        !self.all_free()
    }

    /// Whether B is all there is: the whole problem, once more.
    fn all_free(&self) -> bool {
        self.free.iter().all(|free| *free)
    }

    /// What moves and its neighbours join B; whether B has grown.
    fn surround(&mut self, problem: &FrictionGlobal<D, L>) -> bool {
        let moving = self.moving.clone();
        self.join_neighbours(problem, &moving)
    }

    fn join_neighbours(&mut self, problem: &FrictionGlobal<D, L>, of: &[bool]) -> bool {
        let before = count(&self.free);
        for body in (0..of.len()).filter(|&b| of[b]) {
            self.free[body] = true;
            for &c in &self.contacts[body] {
                for b in bodies_of::<L, D>(problem, &self.body, c) {
                    self.free[b] = true;
                }
            }
        }
        count(&self.free) > before
    }

    /// The motion of B while all others rest; false where it is not found.
    fn move_free(&mut self, problem: &FrictionGlobal<D, L>) -> bool {
        let (part, dofs) = self.part(problem);
        let limits = Limits {
            tolerance: (0.01 * self.tolerance).max(1e-12),
            max_iterations: NESTED,
            ..Limits::of(&budget::current())
        };
        let mut point = part.origin();
        let mut driver =
            Driver::new(OnContacts::<_, D>(Auto { in_turn: false, ..Auto::default() }));
        let solved = driver.solve(&part, &mut point, &limits, &mut |_| {});
        if !solved.is_ok_and(|outcome| outcome.status == Status::Solved) {
            return false;
        }
        self.motion.fill(0.0);
        dofs.iter().zip(&point.v).for_each(|(&i, v)| self.motion[i] = *v);
        for body in 0..self.dofs.len() {
            self.moving[body] =
                self.free[body] && self.speed(problem, &self.motion, body) > self.rest;
            if !self.moving[body] {
                self.dofs[body].iter().for_each(|&i| self.motion[i] = 0.0);
            }
        }
        self.movers = count(&self.moving);
        true
    }

    /// The problem of B, the others fixed, and its degrees of freedom in those of the whole.
    fn part(&self, problem: &FrictionGlobal<D, L>) -> (FrictionGlobal<D, L>, Vec<usize>) {
        let dofs: Vec<usize> = (0..self.body.len()).filter(|&i| self.free[self.body[i]]).collect();
        let mut place = vec![usize::MAX; self.body.len()];
        dofs.iter().enumerate().for_each(|(k, &i)| place[i] = k);
        let touches = |c: &usize| {
            bodies_of::<L, D>(problem, &self.body, *c).into_iter().any(|b| self.free[b])
        };
        let contacts: Vec<usize> = (0..problem.contacts()).filter(touches).collect();
        let columns: Vec<usize> = contacts.iter().flat_map(|&c| D * c..D * (c + 1)).collect();
        let rows = |a: &Csc, columns: &[usize]| {
            let of = |(k, &j): (usize, &usize)| {
                let (rows, values) = a.column(j);
                rows.iter().zip(values).map(move |(&i, &x)| (i, k, x)).collect::<Vec<_>>()
            };
            let all = columns.iter().enumerate().flat_map(of);
            let kept = all.filter(|(i, _, _)| place[*i] != usize::MAX);
            let kept: Vec<_> = kept.map(|(i, k, x)| (place[i], k, x)).collect();
            Csc::from_triplets(dofs.len(), columns.len(), kept.into_iter()).expect("rows in range")
        };
        let part = FrictionGlobal {
            M: rows(&problem.M, &dofs),
            H: rows(&problem.H, &columns),
            f: dofs.iter().map(|&i| problem.f[i]).collect(),
            w: columns.iter().map(|&j| problem.w[j]).collect(),
            mu: contacts.iter().map(|&c| problem.mu[c]).collect(),
            mu_r: problem.mu_r.clone(),
            rows: None,
        };
        (part, dofs)
    }
}

fn count(which: &[bool]) -> usize {
    which.iter().filter(|is| **is).count()
}

impl<const D: usize> OnContacts<Auto, D> {
    /// Begins stage 9, once, where the problem is stated by its bodies.
    pub(super) fn begin_turns<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        work: &mut HybridWork<P, D>,
    ) -> bool {
        let HybridWork { in_turn, stage, turned, scale, tolerance, .. } = work;
        if std::mem::replace(turned, true) || !self.0.in_turn {
            return false;
        }
        let begun = problem.bodies().and_then(|bodies| InTurn::begin(bodies, *scale, *tolerance));
        *in_turn = begun.map(Box::new);
        if in_turn.is_some() {
            *stage = Stage::InTurn;
        }
        in_turn.is_some()
    }

    /// Stage 9: a step of motion and impulses in turn; at its end the best of their rounds goes on where it is better than the point.
    pub(super) fn take_turns<P: Linearised<D> + Disked<D> + Kinematic<D>>(
        &self,
        problem: &P,
        point: &mut P::Point,
        work: &mut HybridWork<P, D>,
    ) -> Step {
        let HybridWork { in_turn, newton, state, done, inner_best, controller, .. } = work;
        let (Some(turns), Some(bodies), Some(newton)) = (in_turn, problem.bodies(), newton) else {
            return lost();
        };
        let mut ended = false;
        match turns.step(bodies) {
            Came::Further => {}
            Came::Round => {
                done.turns = turns.counts();
                let error = newton.look(problem, state, turns.impulses());
                if done.turns[0] == 1 || error < done.turned_error {
                    done.turned_error = error;
                    inner_best.copy_from_slice(turns.impulses());
                }
                ended = error < TURNED || done.turns[0] == 1 && error > NOT_AT_REST;
            }
            Came::End => ended = true,
        }
        if ended {
            let r = P::impulses(point);
            if done.turns[0] > 0 && done.turned_error < controller.least() {
                r.copy_from_slice(inner_best);
            }
            work.in_turn = None;
            self.subproblem_here(problem, point, work);
        }
        Step::Continue { estimate: f64::NAN }
    }
}

/// The unknowns in groups that are bodies, as far as M and H tell: what M couples, and neighbours in order of which one is touched wherever the other is (a contact along an axis
/// leaves some unknowns of its body out).
fn unknowns_of_bodies<L: DiskLaw<D>, const D: usize>(problem: &FrictionGlobal<D, L>) -> Groups {
    let n = problem.dofs();
    let mut touching: Vec<Vec<usize>> = vec![vec![]; n];
    for (i, j, x) in problem.H.triplets() {
        if x != 0.0 && touching[i].last() != Some(&(j / D)) {
            touching[i].push(j / D);
        }
    }
    let mut groups = Groups::new(n);
    problem.M.triplets().filter(|e| e.2 != 0.0).for_each(|(i, j, _)| groups.join(i, j));
    for i in 0..n {
        for j in i + 1..n.min(i + NEIGHBOURS) {
            let [few, many] = if touching[i].len() < touching[j].len() { [i, j] } else { [j, i] };
            let within = |c: &usize| touching[many].binary_search(c).is_ok();
            if !touching[few].is_empty() && touching[few].iter().all(within) {
                groups.join(i, j);
            }
        }
    }
    groups
}

/// The bodies that contact c touches.
fn bodies_of<L: DiskLaw<D>, const D: usize>(
    problem: &FrictionGlobal<D, L>,
    body: &[usize],
    c: usize,
) -> Vec<usize> {
    let mut found = vec![];
    for j in D * c..D * (c + 1) {
        for &i in problem.H.column(j).0 {
            if !found.contains(&body[i]) {
                found.push(body[i]);
            }
        }
    }
    found
}

/// The search for the impulses of a motion.
struct Impulses<L: DiskLaw<D>, const D: usize> {
    /// With the rays in place of the normals of contacts that slide, velocities from those of the motion on.
    problem: FrictionGlobal<D, L>,
    state: <FrictionGlobal<D, L> as Contacts<D>>::State,
    /// `u_T/‖u_T‖` of those that slide.
    slides: Vec<(usize, [f64; D])>,
    /// Those that stick.
    sticks: Vec<bool>,
    mu: Vec<f64>,
    central: Central<L, D>,
    halvings: Halvings,
    iterations: usize,
    point: GlobalPoint,
}

impl<L: DiskLaw<D>, const D: usize> Impulses<L, D> {
    /// `rest`: slower contacts stick. `None`: a matrix that cannot be had.
    fn begin(whole: &FrictionGlobal<D, L>, motion: &[f64], rest: f64) -> Option<Self> {
        let nc = whole.contacts();
        let mut u = vec![0.0; D * nc];
        whole.velocity_into(motion, &mut u);
        let (mut slides, mut sticks, mut mu) = (vec![], vec![true; nc], whole.mu.clone());
        let mut given = vec![0.0; nc];
        for c in 0..nc {
            let mut t: [f64; D] = small::block(&u, c);
            let normal = std::mem::take(&mut t[0]);
            let size = norm(&t);
            if normal.abs() > rest {
                given[c] = normal;
            }
            if normal > rest {
                (sticks[c], mu[c]) = (false, 0.0);
            } else if size > rest && mu[c] > 0.0 {
                (sticks[c], mu[c]) = (false, 0.0);
                slides.push((c, t.map(|x| x / size)));
            }
        }
        let rays = slides.iter().flat_map(|&(c, t)| {
            (1..D).flat_map(move |k| {
                let (rows, values) = whole.H.column(D * c + k);
                let weight = -whole.mu[c] * t[k];
                rows.iter().zip(values).map(move |(&i, x)| (i, D * c, weight * x))
            })
        });
        let entries: Vec<_> = whole.H.triplets().chain(rays).collect();
        let h = Csc::from_triplets(whole.dofs(), D * nc, entries.into_iter()).ok()?;
        // Velocities are those beyond the motion's; what opens by it stays open, and what closes tears its bodies away.
        let mut w = vec![0.0; D * nc];
        h.mul_transpose_add(-1.0, motion, &mut w);
        given.iter().enumerate().for_each(|(c, normal)| w[D * c] += normal);
        let problem = FrictionGlobal { H: h, w, mu, ..whole.clone() };
        let mut state = problem.state(Access::Newton).ok()?;
        let mut central = Central::default();
        let now = central.begin_relaxed(&problem, &mut state);
        Some(Self {
            halvings: Halvings::from(now.error),
            iterations: 0,
            point: problem.origin(),
            mu: whole.mu.clone(),
            problem,
            state,
            slides,
            sticks,
            central,
        })
    }

    /// One iteration; whether it was the last.
    fn iterate(&mut self, tolerance: f64) -> bool {
        let Ok(now) = self.central.iterate(&self.problem, &mut self.state) else { return true };
        self.iterations += 1;
        let u = self.central.u().chunks_exact(D).zip(&self.sticks);
        let torn = u.filter(|(_, sticks)| **sticks).map(|(u, _)| norm(u).powi(2)).sum::<f64>();
        let known = KNOWN * torn.sqrt() / self.problem.velocity_scale(&self.state);
        now.error <= (0.1 * tolerance).max(known)
            || self.halvings.idle_at(now.error) >= IDLE
            || self.iterations >= ITERATIONS
    }

    /// The impulses of the best iterate, into r, and the velocities that they give.
    fn end(&mut self, r: &mut [f64]) -> &[f64] {
        self.point.r.copy_from_slice(self.central.best().0);
        self.problem.complete(&mut self.state, &mut self.point);
        r.copy_from_slice(&self.point.r);
        for (c, t) in &self.slides {
            for k in 1..D {
                r[D * c + k] = -self.mu[*c] * t[k] * r[D * c];
            }
        }
        &self.point.v
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::law::cfun::natural_residual;

    /// Five stacks of four points of mass 1 on each other, each pressed down by 1; the topmost of two stacks is pushed sideways by more than its friction, that of a third by less.
    fn stacks(mu: f64, pushes: [f64; 5]) -> FrictionGlobal<3> {
        let (bodies, mut entries) = (20, vec![]);
        let (mut f, m) = (vec![0.0; 60], Csc::diagonal(&[1.0; 60]));
        for b in 0..bodies {
            for k in 0..3 {
                entries.push((3 * b + k, 3 * b + k, 1.0));
                if b % 4 > 0 {
                    entries.push((3 * (b - 1) + k, 3 * b + k, -1.0));
                }
            }
            f[3 * b] = -1.0;
        }
        (0..5).for_each(|s| f[3 * (4 * s + 3) + 1] = pushes[s]);
        let h = Csc::from_triplets(60, 60, entries.into_iter()).unwrap();
        FrictionGlobal::new(m, h, f, vec![0.0; 60], vec![mu; 20]).unwrap()
    }

    #[test]
    fn what_slides_on_what_rests_is_found_with_its_impulses() {
        // A pushed point slides at push − mu and drags the one below with mu, which that one's friction, up to 2 mu, holds.
        let (mu, pushes) = (0.5, [0.0, 0.8, 0.3, 0.0, 2.0]);
        let problem = stacks(mu, pushes);
        let mut turns = InTurn::begin(&problem, 20.0_f64.sqrt(), 1e-9).unwrap();
        let mut rounds = 0;
        while rounds < 2 {
            match turns.step(&problem) {
                Came::Further => {}
                Came::Round => rounds += 1,
                Came::End => panic!("ended after {rounds} rounds"),
            }
        }
        // The topmost point of a stack is touched only where the one below it is: they count as one body.
        assert_eq!(turns.counts(), [2, 2, 15]);
        let r = turns.impulses();
        let mut v = problem.f.clone();
        problem.H.mul_add(1.0, r, &mut v);
        let mut u = vec![0.0; 60];
        problem.velocity_into(&v, &mut u);
        for c in 0..20 {
            let law = problem.law(c);
            let error = natural_residual(1.0, &small::block(r, c), &small::block::<3>(&u, c), law);
            assert!(error < 1e-16, "{c}: {error:e}");
            let slides = c % 4 == 3 && pushes[c / 4] > mu;
            let expected = if slides { pushes[c / 4] - mu } else { 0.0 };
            assert!((v[3 * c + 1] - expected).abs() < 1e-8, "{c}: {}", v[3 * c + 1]);
        }
    }

    #[test]
    fn where_all_moves_there_is_nothing_to_take_turns_for() {
        let mut problem = stacks(0.1, [0.0; 5]);
        // All but the points on the ground are thrown upwards and sideways.
        (0..20).for_each(|b| problem.f[3 * b..3 * b + 2].copy_from_slice(&[0.1 * b as f64, 1.0]));
        let mut turns = InTurn::begin(&problem, 20.0_f64.sqrt(), 1e-9).unwrap();
        let mut steps = 0;
        while turns.step(&problem) != Came::End {
            steps += 1;
            assert!(steps < 1000);
        }
    }

    #[test]
    fn unknowns_of_a_body_are_found_where_contacts_leave_some_out() {
        let problem = stacks(0.5, [0.0; 5]);
        let mut groups = unknowns_of_bodies(&problem);
        assert_eq!([groups.root(2), groups.root(5), groups.root(11)], [0, 3, 6]);
        assert_eq!(groups.sizes(), [3, 3, 6].repeat(5));
    }
}

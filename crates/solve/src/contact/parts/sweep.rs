//! A plain Gauss–Seidel sweep, with the exact local solver or another, for methods that start from a few sweeps or mix them in.
//!
//! Visits the contacts in the order given; each gets the solution of its own problem with all other impulses frozen. It is
//! NSGS (JourdanAlartJean1998; Acary, lecture (107)) without its options: no relaxation, no freezing, no shuffling.
//!
//! What converges last is often a drift among a few contacts, for thousands of sweeps until one of them changes sides (of 107 277
//! contacts of a pile of polyhedra 13 hold .99 of the squared movement, 300 .999). [`follow`](Sweep::follow) visits these alone.
//!
//! Cost of a sweep: one pass over the blocks of W (or over the rows of H and M⁻¹H) plus nc local solves. Storage: the
//! diagonal block and the local solver's memo of each contact.

use nonsmooth_linalg::{Parts, budget, norm, pieces, small};

use crate::contact::form::{AHEAD, Blockwise, Disked, Visits};
use crate::contact::law::DiskLaw;
use crate::contact::law::cfun::natural_residual;
use crate::contact::law::local::{LocalSolver, frictionless};

/// The square of a relative move that is far below any rounding and is not made: impulses that die away would end as subnormal numbers, which are slow.
pub const NEGLIGIBLE: f64 = 1e-80;

/// Contacts are followed that moved, in the square, by more than this part of the mean, where they are at most one in so many, and while as many visits as so many sweeps have.
const FOLLOWED: f64 = 1e-3;
const FEW: usize = 4;
const FOLLOW: usize = 2;

/// The fewest contacts whose impulses a thread gathers.
const PIECE: usize = 1024;

/// What sweeps keep for each contact; S solves one.
#[derive(Debug, Clone)]
pub struct Sweep<L: DiskLaw<D>, const D: usize, S: LocalSolver<D, L> = <L as DiskLaw<D>>::Local> {
    local: S,
    /// In the order of the visits.
    contacts: Vec<Visited<L, D, S::Memo>>,
    /// Several threads may make them.
    shared: bool,
    /// The square of a velocity that is negligible.
    negligible: f64,
    /// `(w_c‖Δr_c‖)²` of each contact's last visit, what the last sweep returned, and the contacts last followed.
    moved: Vec<f64>,
    moves: f64,
    followed: Vec<usize>,
    /// Impulses, and what of the velocities does not depend on them, in the order of the visits.
    gathered: Vec<([f64; D], [f64; D])>,
}

#[derive(Debug, Clone)]
struct Visited<L, const D: usize, M> {
    place: usize,
    w: [[f64; D]; D],
    law: L,
    /// `tr(W_cc)/D`.
    unit: f64,
    memo: M,
}

impl<L: DiskLaw<D>, const D: usize> Sweep<L, D> {
    /// Sweeps over `problem`'s contacts, each solved exactly.
    pub fn new<P: Blockwise<D> + Disked<D, Law = L>>(problem: &P, state: &P::State) -> Self {
        Self::with(L::Local::default(), problem, state)
    }
}

impl<L: DiskLaw<D>, const D: usize, S: LocalSolver<D, L>> Sweep<L, D, S> {
    /// Sweeps over `problem`'s contacts, each visited by `local`.
    pub fn with<P: Blockwise<D> + Disked<D, Law = L>>(
        local: S,
        problem: &P,
        state: &P::State,
    ) -> Self {
        let contacts = Vec::with_capacity(problem.contacts());
        let mut sweep = Self {
            local,
            contacts,
            shared: false,
            negligible: 0.0,
            moved: vec![],
            moves: 0.0,
            followed: vec![],
            gathered: vec![],
        };
        sweep.fill(problem, state);
        sweep
    }

    /// Takes another problem; allocates nothing where the number of contacts is the same.
    pub fn fill<P: Blockwise<D> + Disked<D, Law = L>>(&mut self, problem: &P, state: &P::State) {
        self.contacts.clear();
        self.moved.clear();
        self.moved.resize(problem.contacts(), 0.0);
        self.followed.clear();
        self.followed.reserve(problem.contacts() / FEW + 1);
        self.moves = 0.0;
        self.negligible = NEGLIGIBLE * problem.velocity_scale(state).powi(2);
        let passes = problem.passes(state);
        self.shared = passes.is_some();
        for c in (0..problem.contacts()).map(|at| passes.map_or(at, |passes| passes.item(at))) {
            let (w, law) = (problem.diagonal_block(state, c), problem.law(c));
            let unit = small::mean_diagonal(&w).abs();
            let memo = self.local.prepare(&w, law);
            self.contacts.push(Visited { place: c, w, law, unit, memo });
        }
    }

    /// One sweep on `r`, which `state` must know already (`enter`); returns `Σ (w_c‖Δr_c‖)²`, `w_c = tr(W_cc)/D`.
    pub fn sweep<P: Blockwise<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        r: &mut [f64],
    ) -> f64 {
        let Self { local, contacts, negligible, moved, .. } = self;
        self.moves = 0.0;
        for at in 0..contacts.len() {
            if let Some(ahead) = contacts.get(at + AHEAD) {
                problem.foresee(state, ahead.place);
            }
            moved[at] = contacts[at].visit(local, problem, state, r, *negligible);
            self.moves += moved[at];
        }
        self.moves
    }

    /// How many sweeps to ask [`sweeps`](Self::sweeps) for where so many are due: all where threads may share them, so that their number changes nothing, else one.
    pub fn together(&self, due: usize) -> usize {
        if self.shared { due } else { 1 }
    }

    /// As many sweeps, on all threads that the budget allows, one behind the other ([`Passes`](nonsmooth_linalg::Passes)): the same bits for any number of threads. Returns what
    /// the last one moved. It ends early where the budget is over.
    pub fn sweeps<P: Blockwise<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        r: &mut [f64],
        count: usize,
    ) -> f64 {
        let Some(Visits { passes, moving, given }) = problem.moving(state) else {
            for _ in 0..count {
                self.sweep(problem, state, r);
            }
            return self.moves;
        };
        // In the order of the visits: memory is read from one end to the other.
        let Self { local, contacts, negligible, gathered, moved, .. } = self;
        let (local, negligible) = (&*local, *negligible);
        gathered.resize(contacts.len(), ([0.0; D], [0.0; D]));
        pieces::writing(contacts.len(), PIECE, [&mut gathered[..]], |piece, [gathered]| {
            for (gathered, contact) in gathered.iter_mut().zip(&contacts[piece]) {
                *gathered = (small::block(r, contact.place), small::block(given, contact.place));
            }
            []
        });
        let (contacts, impulses) = (Parts::of(contacts), Parts::of(gathered));
        let moved = Parts::of(moved);
        self.moves = passes.run(count, |block| {
            // SAFETY: two passes are never at the same block, ...
            let (contacts, impulses, moved) = unsafe {
                let at = (block.start, block.len());
                (contacts.part(at.0, at.1), impulses.part(at.0, at.1), moved.part(at.0, at.1))
            };
            let of_block = contacts.iter_mut().zip(impulses).zip(&mut *moved);
            for (at, ((contact, (old, given)), moved)) in block.clone().zip(of_block) {
                if at + AHEAD < block.end {
                    moving.foresee(at + AHEAD);
                }
                // SAFETY: ... nor at contacts that feel each other.
                let mut u = unsafe { moving.local_velocity(at) };
                for k in 0..D {
                    u[k] += given[k];
                }
                let answer = contact.answer(local, old, u, negligible);
                *moved = answer.moved;
                if let Some(dr) = answer.dr {
                    *old = answer.new;
                    // SAFETY: as before.
                    unsafe { moving.apply_impulse(at, &dr) };
                }
            }
            moved.iter().sum()
        });
        let (contacts, gathered, r) = (&self.contacts, &self.gathered, Parts::of(r));
        pieces::each(contacts.len(), PIECE, |piece| {
            for (contact, (new, _)) in contacts[piece.clone()].iter().zip(&gathered[piece]) {
                // SAFETY: each contact is visited at one place.
                unsafe { r.part(D * contact.place, D) }.copy_from_slice(new);
            }
        });
        self.moves
    }

    /// After a sweep: visits the contacts again that moved most in it, if these are few, in the same order, until together they move no more than
    /// all others did, or as much time has passed as a few sweeps take. Returns the number of passes over them.
    pub fn follow<P: Blockwise<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        r: &mut [f64],
    ) -> usize {
        let Self { local, contacts, followed, negligible, moved, moves, .. } = self;
        let (all, few) = (contacts.len(), contacts.len() / FEW);
        let least = FOLLOWED * *moves / all as f64;
        followed.clear();
        let moving = moved.iter().enumerate().filter(|(_, moved)| **moved > least);
        followed.extend(moving.map(|(at, _)| at).take(few + 1));
        if followed.is_empty() || followed.len() > few {
            return 0;
        }
        let others = *moves - followed.iter().map(|&at| moved[at]).sum::<f64>();
        let mut passes = 0;
        while passes * followed.len() < FOLLOW * all && !budget::over() {
            passes += 1;
            let visits = followed
                .iter()
                .map(|&at| contacts[at].visit(local, problem, state, r, *negligible));
            let moves: f64 = visits.sum();
            // Neither may it go on where moves are not finite.
            if !(moves > others && moves.is_finite()) {
                break;
            }
        }
        passes
    }

    /// `max_c w_c‖r_c‖`, a velocity.
    pub fn largest(&self, r: &[f64]) -> f64 {
        let of = |contact: &Visited<L, D, S::Memo>| {
            contact.unit * norm(&small::block::<D>(r, contact.place))
        };
        self.contacts.iter().map(of).fold(0.0, f64::max)
    }

    /// The square of each contact's natural residual, `‖w_c r_c − P_K(w_c r_c − ũ_c)‖²`, at r, whose velocities are u.
    pub fn squares(&self, u: &[f64], r: &[f64], squares: &mut Vec<f64>) {
        squares.clear();
        squares.resize(self.contacts.len(), 0.0);
        for contact in &self.contacts {
            let (u, r) = (small::block::<D>(u, contact.place), small::block(r, contact.place));
            squares[contact.place] = natural_residual(contact.unit, &r, &u, contact.law);
        }
    }

    /// The natural residual `‖( w_c r_c − P_K(w_c r_c − ũ_c) )_c‖` at r, whose velocities are u.
    pub fn residual(&self, u: &[f64], r: &[f64]) -> f64 {
        let mut sum = 0.0;
        for contact in &self.contacts {
            let (u, r) = (small::block::<D>(u, contact.place), small::block(r, contact.place));
            sum += natural_residual(contact.unit, &r, &u, contact.law);
        }
        sum.sqrt()
    }
}

/// What a visit finds.
struct Answer<const D: usize> {
    new: [f64; D],
    /// By how much it differs from the old impulse, if that is not negligible.
    dr: Option<[f64; D]>,
    /// `(w_c‖Δr_c‖)²`, 0 where that is negligible.
    moved: f64,
}

impl<L: DiskLaw<D>, const D: usize, M> Visited<L, D, M> {
    /// Solves the problem of this contact; returns `(w_c‖Δr_c‖)²`, 0 where that is negligible and the move not made.
    #[inline]
    fn visit<P: Blockwise<D> + Disked<D, Law = L>>(
        &mut self,
        local: &impl LocalSolver<D, L, Memo = M>,
        problem: &P,
        state: &mut P::State,
        r: &mut [f64],
        negligible: f64,
    ) -> f64 {
        let c = self.place;
        let u = problem.velocity(state, r, c);
        let answer = self.answer(local, &small::block(r, c), u, negligible);
        if let Some(dr) = answer.dr {
            r[D * c..D * c + D].copy_from_slice(&answer.new);
            problem.moved(state, c, &dr);
        }
        answer.moved
    }

    /// Solves the contact's own problem, where `old` has the velocity u.
    #[inline(always)]
    fn answer(
        &mut self,
        local: &impl LocalSolver<D, L, Memo = M>,
        old: &[f64; D],
        u: [f64; D],
        negligible: f64,
    ) -> Answer<D> {
        let mut q = u;
        let own = small::mul(&self.w, old);
        for k in 0..D {
            q[k] -= own[k];
        }
        let new = if self.law.is_frictionless() {
            frictionless(&self.w, &q, old)
        } else {
            local.solve(&mut self.memo, &self.w, &q, self.law, old)
        };
        let mut dr = new;
        for k in 0..D {
            dr[k] -= old[k];
        }
        let moved = dr.iter().map(|x| (self.unit * x).powi(2)).sum::<f64>();
        // Of an empty block a move has no velocity; one that is not finite is made too, and seen.
        let unfelt = self.unit == 0.0 && dr != [0.0; D];
        match moved > negligible || moved.is_nan() || unfelt {
            true => Answer { new, dr: Some(dr), moved },
            false => Answer { new, dr: None, moved: 0.0 },
        }
    }
}

#[cfg(test)]
mod tests {
    use nonsmooth_linalg::{Bsr, Csc};
    use nonsmooth_problem::planted::Planted;
    use nonsmooth_problem::{FrictionLocal, Problem};

    use super::*;
    use crate::Solver;
    use crate::contact::form::{Access, Contacts};
    use crate::contact::law::local::Projection;
    use crate::contact::splitting::Psor;

    /// Sweeps until they no longer move; the distance to the planted solution.
    fn distance<const D: usize, P>(problem: &P, known: &[f64]) -> f64
    where
        P: Blockwise<D> + Disked<D> + Problem,
    {
        let mut point = problem.origin();
        let mut state = problem.state(Access::Visits).unwrap();
        let mut sweep = Sweep::new(problem, &state);
        problem.enter(&mut state, &point);
        let first = sweep.sweep(problem, &mut state, P::impulses(&mut point));
        let mut last = first;
        for _ in 0..3000 {
            last = sweep.sweep(problem, &mut state, P::impulses(&mut point));
        }
        assert!(last < 1e-20 * first, "{first:e} {last:e}");
        let r = P::impulses(&mut point);
        r.iter().zip(known).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    /// Blocks that feel nothing of each other, of which the last two contacts converge slowly.
    fn one_slow_pair(contacts: usize) -> FrictionLocal<2> {
        let n = 2 * contacts;
        let slow = [(n - 4, n - 2, 0.99), (n - 2, n - 4, 0.99)];
        let entries = (0..n).map(|i| (i, i, 1.0)).chain(slow);
        let w = Bsr::from_csc(&Csc::from_triplets(n, n, entries).unwrap());
        let q = (0..n).map(|i| if i % 2 == 0 { -1.0 } else { 0.0 }).collect();
        FrictionLocal::new(w, q, vec![0.5; contacts]).unwrap()
    }

    #[test]
    fn contacts_that_still_move_are_followed_where_they_are_few() {
        for (contacts, few) in [(40, true), (6, false)] {
            let problem = one_slow_pair(contacts);
            let mut point = problem.origin();
            let mut state = problem.state(Access::Visits).unwrap();
            let mut sweep = Sweep::new(&problem, &state);
            problem.enter(&mut state, &point);
            assert_eq!(sweep.follow(&problem, &mut state, &mut point.r), 0, "nothing has moved");
            // In the first sweep all move.
            sweep.sweep(&problem, &mut state, &mut point.r);
            assert_eq!(sweep.follow(&problem, &mut state, &mut point.r), 0);
            let second = sweep.sweep(&problem, &mut state, &mut point.r);
            let passes = sweep.follow(&problem, &mut state, &mut point.r);
            // Two sweeps' time for two contacts.
            assert_eq!(passes, if few { contacts } else { 0 });
            let third = sweep.sweep(&problem, &mut state, &mut point.r);
            let fall = 0.99_f64.powi(4 * (1 + passes as i32));
            assert!((third / second - fall).abs() < 1e-9, "{third:e} {second:e} {fall:e}");
        }
    }

    /// The sweeps of the solver `psor` are these, to the last bit.
    #[test]
    fn with_one_projection_a_contact_they_are_those_of_psor() {
        let case = Planted { contacts: 20, dofs: 90, seed: 6, ..Planted::default() };
        let (problem, _) = case.local::<3>();
        let solver = Psor { omega: 0.7, ..Psor::default() }.sweeps::<3>();
        let (mut work, mut theirs) = (solver.work(&problem).unwrap(), problem.origin());
        solver.start(&problem, &mut theirs, &mut work);
        let mut state = problem.state(Access::Visits).unwrap();
        let mut sweep = Sweep::with(Projection { step: 0.7 }, &problem, &state);
        let mut ours = problem.origin();
        problem.enter(&mut state, &ours);
        for _ in 0..30 {
            solver.step(&problem, &mut theirs, &mut work);
            let moved = sweep.sweep(&problem, &mut state, &mut ours.r);
            assert!(moved > 0.0 && ours.r == theirs.r);
        }
    }

    #[test]
    fn sweeps_end_at_the_planted_solution_in_both_forms() {
        let case = Planted { contacts: 8, dofs: 60, mu: (0.0, 0.6), seed: 5, ..Planted::default() };
        let (problem, known) = case.local::<3>();
        assert!(distance(&problem, &known.r) < 1e-8);
        let (problem, known) = case.global::<2>();
        assert!(distance(&problem, &known.r) < 1e-8);
    }
}

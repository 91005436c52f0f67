//! A plain Gauss–Seidel sweep with the exact local solver, for methods that start from a few sweeps or mix them in.
//!
//! Visits the contacts in the order given; each gets the solution of its own problem with all other impulses frozen. It is
//! NSGS (JourdanAlartJean1998; Acary, lecture (107)) without its options: no relaxation, no freezing, no shuffling.
//!
//! What converges last is often a drift among a few contacts, for thousands of sweeps until one of them changes sides (of 107 277
//! contacts of a pile of polyhedra 13 hold .99 of the squared movement, 300 .999). [`follow`](Sweep::follow) visits these alone.
//!
//! Cost of a sweep: one pass over the blocks of W (or over the rows of H and M⁻¹H) plus nc local solves. Storage: the
//! diagonal block and the local solver's memo of each contact.

use nonsmooth_linalg::{budget, norm, small};

use crate::contact::form::{AHEAD, Blockwise, Disked};
use crate::contact::law::DiskLaw;
use crate::contact::law::cfun::natural_residual;
use crate::contact::law::local::{LocalSolver, frictionless};

/// The square of a relative move that is far below any rounding and is not made: impulses that die away would end as subnormal numbers, which are slow.
pub const NEGLIGIBLE: f64 = 1e-80;

/// Contacts are followed that moved, in the square, by more than this part of the mean, where they are at most one in so many, and while as many visits as so many sweeps have.
const FOLLOWED: f64 = 1e-3;
const FEW: usize = 4;
const FOLLOW: usize = 2;

/// What sweeps keep for each contact.
#[derive(Debug, Clone)]
pub struct Sweep<L: DiskLaw<D>, const D: usize> {
    contacts: Vec<Visited<L, D>>,
    /// The square of a velocity that is negligible.
    negligible: f64,
    /// What the last sweep returned, and the contacts last followed.
    moves: f64,
    followed: Vec<usize>,
}

#[derive(Debug, Clone)]
struct Visited<L: DiskLaw<D>, const D: usize> {
    w: [[f64; D]; D],
    law: L,
    /// `tr(W_cc)/D`.
    unit: f64,
    memo: <L::Local as LocalSolver<D, L>>::Memo,
    /// `(w_c‖Δr_c‖)²` of the last visit.
    moved: f64,
}

impl<L: DiskLaw<D>, const D: usize> Sweep<L, D> {
    /// Sweeps over `problem`'s contacts.
    pub fn new<P: Disked<D, Law = L>>(problem: &P, state: &P::State) -> Self {
        let contacts = Vec::with_capacity(problem.contacts());
        let mut sweep = Self { contacts, negligible: 0.0, moves: 0.0, followed: vec![] };
        sweep.fill(problem, state);
        sweep
    }

    /// Takes another problem; allocates nothing where the number of contacts is the same.
    pub fn fill<P: Disked<D, Law = L>>(&mut self, problem: &P, state: &P::State) {
        self.contacts.clear();
        self.followed.clear();
        self.followed.reserve(problem.contacts() / FEW + 1);
        self.moves = 0.0;
        self.negligible = NEGLIGIBLE * problem.velocity_scale(state).powi(2);
        for c in 0..problem.contacts() {
            let (w, law) = (problem.diagonal_block(state, c), problem.law(c));
            let unit = small::mean_diagonal(&w).abs();
            let memo = L::Local::default().prepare(&w, law);
            self.contacts.push(Visited { w, law, unit, memo, moved: 0.0 });
        }
    }

    /// One sweep on `r`, which `state` must know already (`enter`); returns `Σ (w_c‖Δr_c‖)²`, `w_c = tr(W_cc)/D`.
    pub fn sweep<P: Blockwise<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        r: &mut [f64],
    ) -> f64 {
        let contacts = self.contacts.len();
        self.moves = 0.0;
        for (c, contact) in self.contacts.iter_mut().enumerate() {
            if c + AHEAD < contacts {
                problem.foresee(state, c + AHEAD);
            }
            self.moves += contact.visit(problem, state, r, c, self.negligible);
        }
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
        let Self { contacts, followed, negligible, moves, .. } = self;
        let (all, few) = (contacts.len(), contacts.len() / FEW);
        let least = FOLLOWED * *moves / all as f64;
        followed.clear();
        let moving = contacts.iter().enumerate().filter(|(_, contact)| contact.moved > least);
        followed.extend(moving.map(|(c, _)| c).take(few + 1));
        if followed.is_empty() || followed.len() > few {
            return 0;
        }
        let others = *moves - followed.iter().map(|&c| contacts[c].moved).sum::<f64>();
        let mut passes = 0;
        while passes * followed.len() < FOLLOW * all && !budget::over() {
            passes += 1;
            let visits =
                followed.iter().map(|&c| contacts[c].visit(problem, state, r, c, *negligible));
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
        let of =
            |(c, contact): (usize, &Visited<L, D>)| contact.unit * norm(&small::block::<D>(r, c));
        self.contacts.iter().enumerate().map(of).fold(0.0, f64::max)
    }

    /// The natural residual `‖( w_c r_c − P_K(w_c r_c − ũ_c) )_c‖` at r, whose velocities are u.
    pub fn residual(&self, u: &[f64], r: &[f64]) -> f64 {
        let mut sum = 0.0;
        for (c, contact) in self.contacts.iter().enumerate() {
            let (u, r) = (small::block::<D>(u, c), small::block(r, c));
            sum += natural_residual(contact.unit, &r, &u, contact.law);
        }
        sum.sqrt()
    }
}

impl<L: DiskLaw<D>, const D: usize> Visited<L, D> {
    /// Solves the problem of this contact, the c-th; returns `(w_c‖Δr_c‖)²`, 0 where that is negligible and the move not made.
    #[inline]
    fn visit<P: Blockwise<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        r: &mut [f64],
        c: usize,
        negligible: f64,
    ) -> f64 {
        let old: [f64; D] = small::block(r, c);
        let mut q = problem.velocity(state, r, c);
        let own = small::mul(&self.w, &old);
        for k in 0..D {
            q[k] -= own[k];
        }
        let new = if self.law.is_frictionless() {
            frictionless(&self.w, &q, &old)
        } else {
            L::Local::default().solve(&mut self.memo, &self.w, &q, self.law, &old)
        };
        let mut dr = new;
        for k in 0..D {
            dr[k] -= old[k];
        }
        let moved = dr.iter().map(|x| (self.unit * x).powi(2)).sum::<f64>();
        // Of an empty block a move has no velocity; one that is not finite is made too, and seen.
        let unfelt = self.unit == 0.0 && dr != [0.0; D];
        let made = moved > negligible || moved.is_nan() || unfelt;
        self.moved = if made { moved } else { 0.0 };
        if made {
            r[D * c..D * c + D].copy_from_slice(&new);
            problem.moved(state, c, &dr);
        }
        self.moved
    }
}

#[cfg(test)]
mod tests {
    use nonsmooth_linalg::{Bsr, Csc};
    use nonsmooth_problem::planted::Planted;
    use nonsmooth_problem::{FrictionLocal, Problem};

    use super::*;
    use crate::contact::form::{Access, Contacts};

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

    #[test]
    fn sweeps_end_at_the_planted_solution_in_both_forms() {
        let case = Planted { contacts: 8, dofs: 60, mu: (0.0, 0.6), seed: 5, ..Planted::default() };
        let (problem, known) = case.local::<3>();
        assert!(distance(&problem, &known.r) < 1e-8);
        let (problem, known) = case.global::<2>();
        assert!(distance(&problem, &known.r) < 1e-8);
    }
}

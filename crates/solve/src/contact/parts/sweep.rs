//! A plain Gauss–Seidel sweep with the exact local solver, for methods that start from a few sweeps or mix them in.
//!
//! Visits the contacts in the order given; each gets the solution of its own problem with all other impulses frozen. It is
//! NSGS (JourdanAlartJean1998; Acary, lecture (107)) without its options: no relaxation, no freezing, no shuffling.
//!
//! Cost of a sweep: one pass over the blocks of W (or over the rows of H and M⁻¹H) plus nc local solves. Storage: the
//! diagonal block and the local solver's memo of each contact.

use nonsmooth_linalg::{budget, norm, small};
use rayon::ThreadPool;

use crate::contact::form::{AHEAD, Blockwise, Disked};
use crate::contact::law::DiskLaw;
use crate::contact::law::cfun::natural_residual;
use crate::contact::law::local::{LocalSolver, frictionless};

use super::turns::Turns;

/// The square of a relative move that is far below any rounding and is not made: impulses that die away would end as subnormal numbers, which are slow.
pub const NEGLIGIBLE: f64 = 1e-80;

/// From so many contacts on sweeps come several at a time: below, threads would cost more than they gain.
const MANY: usize = 2000;
/// A schedule for threads is worth its while after so many sweeps: others will follow.
const SCHEDULED_AFTER: usize = 20;

/// What sweeps keep for each contact.
#[derive(Debug)]
pub struct Sweep<L: DiskLaw<D>, const D: usize> {
    contacts: Vec<Visited<L, D>>,
    /// The square of a velocity that is negligible.
    negligible: f64,
    /// For so many threads, where these gain something.
    turns: Option<(usize, Option<Turns>)>,
    /// The sweeps so far.
    made: usize,
    /// What each contact moved by in the last sweep that threads made.
    moves: Vec<f64>,
}

#[derive(Debug)]
struct Visited<L: DiskLaw<D>, const D: usize> {
    w: [[f64; D]; D],
    law: L,
    /// `tr(W_cc)/D`.
    unit: f64,
    memo: <L::Local as LocalSolver<D, L>>::Memo,
}

/// A contact's answer to the velocities of the others.
struct Move<const D: usize> {
    new: [f64; D],
    dr: [f64; D],
    /// `(w_c‖Δr_c‖)²`.
    moved: f64,
}

impl<L: DiskLaw<D>, const D: usize> Visited<L, D> {
    /// The solution of the contact's own problem at the velocity u, of which the old impulse is a part; none where it does not move.
    #[inline(always)]
    fn answer(&mut self, mut u: [f64; D], old: &[f64; D], negligible: f64) -> Option<Move<D>> {
        let own = small::mul(&self.w, old);
        for k in 0..D {
            u[k] -= own[k];
        }
        let new = if self.law.is_frictionless() {
            frictionless(&self.w, &u, old)
        } else {
            L::Local::default().solve(&mut self.memo, &self.w, &u, self.law, old)
        };
        let mut dr = new;
        for k in 0..D {
            dr[k] -= old[k];
        }
        let moved = dr.iter().map(|x| (self.unit * x).powi(2)).sum::<f64>();
        // Of an empty block a move has no velocity; one that is not finite is made too, and seen.
        let unfelt = self.unit == 0.0 && dr != [0.0; D];
        (moved > negligible || moved.is_nan() || unfelt).then_some(Move { new, dr, moved })
    }
}

impl<L: DiskLaw<D>, const D: usize> Sweep<L, D> {
    /// Sweeps over `problem`'s contacts.
    pub fn new<P: Disked<D, Law = L>>(problem: &P, state: &P::State) -> Self {
        let contacts = Vec::with_capacity(problem.contacts());
        let mut sweep = Self { contacts, negligible: 0.0, turns: None, made: 0, moves: vec![] };
        sweep.fill(problem, state);
        sweep
    }

    /// Takes another problem; allocates nothing where the number of contacts is the same.
    pub fn fill<P: Disked<D, Law = L>>(&mut self, problem: &P, state: &P::State) {
        self.contacts.clear();
        (self.turns, self.made) = (None, 0);
        self.negligible = NEGLIGIBLE * problem.velocity_scale(state).powi(2);
        for c in 0..problem.contacts() {
            let (w, law) = (problem.diagonal_block(state, c), problem.law(c));
            let unit = small::mean_diagonal(&w).abs();
            let memo = L::Local::default().prepare(&w, law);
            self.contacts.push(Visited { w, law, unit, memo });
        }
    }

    /// One sweep on `r`, which `state` must know already (`enter`); returns `Σ (w_c‖Δr_c‖)²`, `w_c = tr(W_cc)/D`.
    pub fn sweep<P: Blockwise<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        r: &mut [f64],
    ) -> f64 {
        let mut moves = 0.0;
        let contacts = self.contacts.len();
        for (c, contact) in self.contacts.iter_mut().enumerate() {
            if c + AHEAD < contacts {
                problem.foresee(state, c + AHEAD);
            }
            let u = problem.velocity(state, r, c);
            let old = small::block(r, c);
            if let Some(Move { new, dr, moved }) = contact.answer(u, &old, self.negligible) {
                r[D * c..D * c + D].copy_from_slice(&new);
                problem.moved(state, c, &dr);
                moves += moved;
            }
        }
        moves
    }

    /// Whether there are so many contacts that sweeps are made [`sweeps`](Self::sweeps) at a time.
    pub fn are_many(&self) -> bool {
        self.contacts.len() >= MANY
    }

    /// As many sweeps, or fewer where the time is over; returns what the last one does. Where there are [many](Self::are_many) contacts, of a view that has it, on the threads that the budget allows:
    /// the same bits for every number of them.
    pub fn sweeps<P: Blockwise<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        r: &mut [f64],
        count: usize,
    ) -> f64 {
        self.made += count;
        if self.are_many()
            && self.made > SCHEDULED_AFTER
            && let Some(pool) = budget::team()
            && let Some(moves) = self.on_threads(problem, state, r, count, &pool)
        {
            return moves;
        }
        let mut moves = 0.0;
        for _ in 0..count {
            moves = self.sweep(problem, state, r);
            if budget::over() {
                break;
            }
        }
        moves
    }

    fn on_threads<P: Blockwise<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        r: &mut [f64],
        count: usize,
        pool: &ThreadPool,
    ) -> Option<f64> {
        let threads = pool.current_num_threads();
        let view = problem.in_turn(state)?;
        let Self { contacts, negligible, turns, moves, .. } = self;
        if turns.as_ref().is_none_or(|(of, _)| *of != threads) {
            let (nc, places) = (contacts.len(), view.components());
            *turns = Some((threads, Turns::new(nc, places, threads, |c, p| view.places(c, p))));
        }
        let turns = turns.as_mut()?.1.as_mut()?;
        if !turns.are_free() {
            return None;
        }
        moves.clear();
        moves.resize(contacts.len(), 0.0);
        let visited = contacts.iter_mut().zip(r.chunks_exact_mut(D)).zip(&mut *moves);
        type Mine<'a, L, const D: usize> = ((&'a mut Visited<L, D>, &'a mut [f64]), &'a mut f64);
        let visit = |c: usize, ((contact, r), moves): &mut Mine<'_, L, D>, last| {
            let old = small::block(r, 0);
            let answer = contact.answer(view.velocity(c), &old, *negligible);
            if let Some(Move { new, dr, moved }) = answer {
                r.copy_from_slice(&new);
                view.moved(c, &dr);
                if last {
                    **moves = moved;
                }
            }
        };
        turns.run(pool, count, visited, visit, |c| view.foresee(c));
        // In the order of one thread.
        Some(moves.iter().sum())
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

#[cfg(test)]
mod tests {
    use nonsmooth_linalg::Csc;
    use nonsmooth_problem::planted::Planted;
    use nonsmooth_problem::{FrictionGlobal, Problem};

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

    /// Bodies in a grid, 12 wide, each in contact with its neighbours; its contacts row by row, or from body to body in no order.
    fn grid(shuffled: bool) -> FrictionGlobal<3> {
        const WIDE: usize = 12;
        let bodies = 1100;
        let mut pairs: Vec<(usize, usize)> = (0..bodies)
            .flat_map(|i| [(i, i + 1), (i, i + WIDE)])
            .filter(|&(i, j)| j < bodies && (j != i + 1 || j % WIDE != 0))
            .collect();
        if shuffled {
            pairs.sort_by_key(|&(i, j)| (i * 7919 + j * 104_729) % 1009);
        }
        let entries = pairs.iter().enumerate().flat_map(|(c, &(i, j))| {
            let entry = move |(k, row): (usize, usize)| {
                let sign = if row < 6 { 1.0 } else { -1.0 };
                let row = if row < 6 { 6 * i + row } else { 6 * j + row - 6 };
                let of_all = ((31 * c + 7 * row + 3 * k) as f64).sin();
                (row, 3 * c + k, sign * if row % 6 == k { 1.0 } else { 0.3 * of_all })
            };
            (0..3).flat_map(|k| (0..12).map(move |row| (k, row))).map(entry)
        });
        let h = Csc::from_triplets(6 * bodies, 3 * pairs.len(), entries).unwrap();
        let mass = (0..6 * bodies).map(|i| 1.0 + (i % 5) as f64).collect::<Vec<_>>();
        let force = (0..6 * bodies).map(|i| (i as f64).cos()).collect();
        let (w, mu) = (vec![0.0; 3 * pairs.len()], vec![0.4; pairs.len()]);
        FrictionGlobal::new(Csc::diagonal(&mass), h, force, w, mu).unwrap()
    }

    #[test]
    fn the_bits_do_not_depend_on_the_number_of_threads() {
        the_same_on_threads(&grid(true), true);
        // Row by row each contact waits for the one before: one thread makes all visits.
        the_same_on_threads(&grid(false), false);
    }

    fn the_same_on_threads(problem: &FrictionGlobal<3>, apart: bool) {
        let bits = |threads: usize| {
            let _scope = budget::Budget { threads, ..Default::default() }.enter();
            let mut state = problem.state(Access::Visits).unwrap();
            let mut sweep = Sweep::new(problem, &state);
            let mut point = problem.origin();
            problem.enter(&mut state, &point);
            let r = FrictionGlobal::<3>::impulses(&mut point);
            let moves: Vec<u64> = [20, 10, 3, 20, 1]
                .map(|n| sweep.sweeps(problem, &mut state, r, n).to_bits())
                .to_vec();
            let turns = sweep.turns.as_ref().is_some_and(|(_, turns)| turns.is_some());
            assert_eq!(turns, apart && threads > 1);
            (moves, r.iter().map(|x| x.to_bits()).collect::<Vec<_>>())
        };
        let one = bits(1);
        for threads in [2, 3] {
            assert!(bits(threads) == one, "{threads} threads");
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

//! Anderson acceleration of the first sweeps, one by one, for as long as it converges fast.
//!
//! Method: `r ← g(r)`, where g is one sweep, accelerated ([`Accelerator`]) with three differences of `f = ( w_c (g(r) − r)_c )_c`, a velocity; what is proposed is projected onto the cones.
//! Where contacts change sides no more, sweeps converge linearly, and these in about half of their number (problems of 2 to 5 contacts: 23 → 11).
//! From the fourth of them on the movement must have fallen by .85 a sweep in the mean; else all goes back to where it began, and goes on without it: on what converges slowly
//! [`Acceleration`](super::Acceleration) of ten sweeps at a time sees more than a few single ones.
//!
//! References: Anderson1965; WalkerNi2011.
//! Cost of a sweep: some 20 products of the length of r, a projection a contact, and a pass over the rows of H in the global form, beside its own. Storage: 13 vectors and w_c.

use nonsmooth_linalg::small;

use super::anderson::Accelerator;
use crate::contact::form::{Blockwise, Disked, put_within_cones};

/// Differences: two and four do about as well.
const DEPTH: usize = 3;
/// After so many sweeps, and each one more, the movement of the first one times this power of their number. At .7 and at .8 it leaves early what it would have ended.
const GRACE: i32 = 4;
const FAST: f64 = 0.85;

/// What has become of it in this solve.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
enum Stage {
    #[default]
    Due,
    On,
    Over,
}

/// The acceleration of a solve's first sweeps; its memory is made when it is first needed.
///
/// ```text
/// begin ── sweeps ── turn_on ── sweep ── move_on ── sweep ── move_on ── …
/// ```
#[derive(Debug, Default)]
pub struct EarlyAcceleration {
    accelerator: Option<Accelerator>,
    /// `w_c`.
    unit: Vec<f64>,
    stage: Stage,
    /// Where it began, the sweeps since, and how much the first of them moved.
    from: Vec<f64>,
    sweeps: i32,
    first: f64,
    /// The impulses to which the last sweep came.
    reached: Vec<f64>,
}

impl EarlyAcceleration {
    /// Another solve begins.
    pub fn begin(&mut self) {
        self.stage = Stage::Due;
    }

    /// Whether it has been neither on nor in vain in this solve.
    pub fn is_due(&self) -> bool {
        self.stage == Stage::Due
    }

    /// Whether it has a say in where the next sweep begins.
    pub fn is_on(&self) -> bool {
        self.stage == Stage::On
    }

    /// The next sweep, from r, is the first that it sees.
    pub fn turn_on<P: Blockwise<D> + Disked<D>, const D: usize>(
        &mut self,
        problem: &P,
        state: &P::State,
        r: &[f64],
    ) {
        let accelerator = self.accelerator.get_or_insert_with(|| Accelerator::new(DEPTH, r.len()));
        accelerator.resize(r.len());
        accelerator.begin(r);
        problem.units(state, &mut self.unit);
        for copy in [&mut self.from, &mut self.reached] {
            copy.clear();
            copy.extend_from_slice(r);
        }
        (self.stage, self.sweeps) = (Stage::On, 0);
    }

    /// After a sweep: the impulses from which the next one begins, in place of those to which it came. False: it was in vain, and they are those from which it began.
    pub fn move_on<P: Blockwise<D> + Disked<D>, const D: usize>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        point: &mut P::Point,
    ) -> bool {
        let Self { accelerator: Some(accelerator), unit, reached, .. } = self else { return true };
        let r = P::impulses(point);
        reached.copy_from_slice(r);
        let moved = accelerator.advance(r, |i| unit[i / D]);
        self.sweeps += 1;
        self.first = if self.sweeps == 1 { moved } else { self.first };
        let fast = moved <= self.first * FAST.powi(self.sweeps);
        if self.sweeps >= GRACE && !fast {
            self.go_back(problem, state, point);
            return false;
        }
        put_within_cones(problem, r);
        accelerator.begin(r);
        // Velocities by what has changed: in the global form a fraction of what they cost anew.
        for c in 0..problem.contacts() {
            let (new, old) = (small::block::<D>(r, c), small::block::<D>(reached, c));
            let mut dr = new;
            for k in 0..D {
                dr[k] -= old[k];
            }
            if dr != [0.0; D] {
                problem.moved(state, c, &dr);
            }
        }
        true
    }

    /// Back to where it began, and none in this solve any more.
    pub fn go_back<P: Blockwise<D> + Disked<D>, const D: usize>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        point: &mut P::Point,
    ) {
        self.stage = Stage::Over;
        P::impulses(point).copy_from_slice(&self.from);
        problem.enter(state, point);
    }
}

#[cfg(test)]
mod tests {
    use nonsmooth_problem::Problem;
    use nonsmooth_problem::planted::Planted;

    use super::*;
    use crate::contact::form::Access;
    use crate::contact::parts::Sweep;
    use crate::contact::parts::acceleration::tests::row;

    /// Sweeps until one moves no more than 1e-12 of what the first did, and the impulses; `None` where the acceleration was in vain.
    fn run<P, const D: usize>(problem: &P, accelerated: bool) -> Option<(usize, Vec<f64>)>
    where
        P: Blockwise<D> + Disked<D> + Problem,
    {
        let mut point = problem.origin();
        let mut state = problem.state(Access::Visits).unwrap();
        let mut sweep = Sweep::new(problem, &state);
        let mut early = EarlyAcceleration::default();
        problem.enter(&mut state, &point);
        let mut first = 0.0;
        for swept in 1..=20_000 {
            if accelerated && early.is_due() {
                early.turn_on(problem, &state, P::impulses(&mut point));
            } else if accelerated && !early.move_on(problem, &mut state, &mut point) {
                assert!(!early.is_on() && !early.is_due());
                assert!(P::impulses(&mut point).iter().all(|r| *r == 0.0), "back at the origin");
                return None;
            }
            let moved = sweep.sweep(problem, &mut state, P::impulses(&mut point)).sqrt();
            first = if swept == 1 { moved } else { first };
            if moved <= 1e-12 * first {
                return Some((swept, P::impulses(&mut point).to_vec()));
            }
        }
        panic!("not in 20 000 sweeps");
    }

    fn agree(a: &[f64], b: &[f64]) {
        let largest = b.iter().fold(0.0_f64, |m, r| m.max(r.abs()));
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() < 1e-9 * largest, "{a} {b}");
        }
    }

    #[test]
    fn what_converges_takes_half_of_the_sweeps_and_ends_at_the_same_impulses() {
        let problem = row(6, 0.45);
        let (plain, expected) = run::<_, 2>(&problem, false).unwrap();
        let (sweeps, found) = run::<_, 2>(&problem, true).unwrap();
        assert!(2 * sweeps < plain, "{sweeps} of {plain}");
        agree(&found, &expected);
    }

    #[test]
    fn what_converges_slowly_is_left_where_it_began() {
        assert!(run::<_, 2>(&row(40, 0.4999), true).is_none());
    }

    #[test]
    fn velocities_follow_in_the_global_form() {
        let case = Planted { contacts: 3, dofs: 60, mu: (0.0, 0.6), seed: 5, ..Planted::default() };
        let (problem, known) = case.global::<3>();
        let (_, found) = run::<_, 3>(&problem, true).unwrap();
        agree(&found, &known.r);
    }
}

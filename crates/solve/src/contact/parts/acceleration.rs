//! Anderson acceleration of sweeps, where it shows that it helps.
//!
//! Method: `r ← g(r)`, where g is a step of some sweeps, accelerated ([`Accelerator`]) with five differences of `f = ( w_c (g(r) − r)_c )_c`, a velocity; what is proposed is projected onto the
//! cones. Piles and flows converge linearly at .99 a sweep and slower, most of them along a few directions, which five differences see.
//! It is on trial until a step moves a tenth of what its first one did. Where four steps in a row bring nothing new before that, all goes back to where it began, and goes on without it: sweeps that
//! circle, as in chutes, it spoils as a start for what follows. Later eight steps without a new low have eight others without it: contacts that drift at a constant pace until one of them changes
//! sides are held back by a mean over steps.
//!
//! References: Anderson1965; WalkerNi2011.
//! Cost of a step: some 40 products of the length of r, a projection a contact and a pass over the rows of H. Storage: 16 vectors and w_c.

use super::anderson::Accelerator;
use crate::contact::form::{Blockwise, Disked, put_within_cones};

/// Differences: three and eight do about as well.
const DEPTH: usize = 5;
/// It begins after so many steps, in which contacts change sides.
const FIRST: usize = 3;
/// It is trusted once a step has moved less than this part of what the first one did.
const TRUSTED: f64 = 0.1;
/// A low is new where it is below this part of the one before. So many steps without one, on trial and later, and the steps of a pause.
const LOWER: f64 = 0.9;
const IDLE_ON_TRIAL: usize = 4;
const IDLE: usize = 8;
const PAUSE: usize = 8;

/// What is known of its use to a problem.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
enum Verdict {
    #[default]
    OnTrial,
    Trusted,
    Refused,
}

/// The acceleration of a run of sweeps; its memory is made when it is first needed.
///
/// ```text
/// begin ── move_on ── sweeps ── move_on ── sweeps ── …
/// ```
#[derive(Debug, Default)]
pub struct Acceleration {
    accelerator: Option<Accelerator>,
    /// `w_c`.
    unit: Vec<f64>,
    verdict: Verdict,
    on: bool,
    /// Steps without it to come.
    plain: usize,
    /// Where the trial began, its steps, and how much the first one moved.
    from: Vec<f64>,
    steps: usize,
    first: f64,
    /// The last low, and the steps since.
    low: f64,
    idle: usize,
}

impl Acceleration {
    /// A run on a problem of which nothing is known begins.
    pub fn begin(&mut self) {
        self.verdict = Verdict::OnTrial;
        self.begin_again();
    }

    /// Another run on the same problem begins, anywhere.
    pub fn begin_again(&mut self) {
        (self.plain, self.on) = (FIRST, false);
    }

    /// Whether it has a say in where the next step begins.
    pub fn is_on(&self) -> bool {
        self.on
    }

    /// Whether it helps.
    pub fn is_trusted(&self) -> bool {
        self.verdict == Verdict::Trusted
    }

    /// How many steps it has been on trial for, where it is.
    pub fn on_trial(&self) -> Option<usize> {
        (self.on && self.verdict == Verdict::OnTrial).then_some(self.steps)
    }

    /// Ends the trial: back to where it began, and none for this problem any more.
    pub fn go_back<P: Blockwise<D> + Disked<D>, const D: usize>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        point: &mut P::Point,
    ) {
        (self.verdict, self.on) = (Verdict::Refused, false);
        P::impulses(point).copy_from_slice(&self.from);
        problem.enter(state, point);
    }

    /// Between two steps of a run: the impulses from which the next one begins, in place of those to which the last one came. False: the trial has ended, and they are those from which it began.
    pub fn move_on<P: Blockwise<D> + Disked<D>, const D: usize>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        point: &mut P::Point,
    ) -> bool {
        if self.verdict == Verdict::Refused {
            return true;
        }
        if self.plain > 0 {
            self.plain -= 1;
            return true;
        }
        let r = P::impulses(point);
        if !self.on {
            self.turn_on(problem, state, r);
            return true;
        }
        let Self { accelerator: Some(accelerator), unit, .. } = self else { return true };
        let moved = accelerator.advance(r, |i| unit[i / D]);
        let on_trial = self.verdict == Verdict::OnTrial;
        if on_trial {
            self.first = if self.steps == 0 { moved } else { self.first };
            self.steps += 1;
            if moved < TRUSTED * self.first {
                self.verdict = Verdict::Trusted;
            }
        }
        let lower = moved < LOWER * self.low;
        self.idle = if lower { 0 } else { self.idle + 1 };
        // On trial a slow fall, which is new in a few steps, is one too.
        if lower || !on_trial {
            self.low = self.low.min(moved);
        }
        if self.verdict == Verdict::OnTrial && self.idle >= IDLE_ON_TRIAL {
            self.go_back(problem, state, point);
            return false;
        }
        if self.verdict == Verdict::Trusted && self.idle >= IDLE {
            accelerator.take_back(r);
            (self.plain, self.on) = (PAUSE, false);
        } else {
            put_within_cones(problem, r);
            accelerator.begin(r);
        }
        problem.enter(state, point);
        true
    }

    /// The next step is the first that it sees.
    fn turn_on<P: Blockwise<D> + Disked<D>, const D: usize>(
        &mut self,
        problem: &P,
        state: &P::State,
        r: &[f64],
    ) {
        let accelerator = self.accelerator.get_or_insert_with(|| Accelerator::new(DEPTH, r.len()));
        accelerator.resize(r.len());
        accelerator.begin(r);
        problem.units(state, &mut self.unit);
        (self.on, self.low, self.idle) = (true, f64::INFINITY, 0);
        if self.verdict == Verdict::OnTrial {
            self.steps = 0;
            self.from.clear();
            self.from.extend_from_slice(r);
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use nonsmooth_linalg::{Bsr, Csc};
    use nonsmooth_problem::planted::Planted;
    use nonsmooth_problem::{FrictionLocal, Problem};

    use super::*;
    use crate::contact::form::{Access, Contacts};
    use crate::contact::parts::Sweep;

    /// Steps of ten sweeps until one moves no more than a part of what the first did; the impulses.
    fn run<P, const D: usize>(problem: &P, part: f64, accelerated: bool) -> (usize, Vec<f64>)
    where
        P: Blockwise<D> + Disked<D> + Problem,
    {
        let mut point = problem.origin();
        let mut state = problem.state(Access::Visits).unwrap();
        let mut sweep = Sweep::new(problem, &state);
        let mut acceleration = Acceleration::default();
        acceleration.begin();
        problem.enter(&mut state, &point);
        let mut first = 0.0;
        for step in 1..=2000 {
            if accelerated {
                acceleration.move_on(problem, &mut state, &mut point);
            }
            let moved = sweep.sweeps(problem, &mut state, P::impulses(&mut point), 10).sqrt();
            first = if step == 1 { moved } else { first };
            if moved <= part * first {
                return (step, P::impulses(&mut point).to_vec());
            }
        }
        panic!("not in 20 000 sweeps");
    }

    /// A row of contacts that press, each of which feels its neighbours by a part of what it feels itself.
    pub(in crate::contact::parts) fn row(contacts: usize, part: f64) -> FrictionLocal<2> {
        let n = 2 * contacts;
        let own = (0..n).map(|i| (i, i, 1.0));
        let coupled = (2..n).flat_map(|i| [(i, i - 2, -part), (i - 2, i, -part)]);
        let w = Bsr::from_csc(&Csc::from_triplets(n, n, own.chain(coupled)).unwrap());
        let q = (0..n).map(|i| if i % 2 == 0 { -1.0 } else { 0.01 * i as f64 }).collect();
        FrictionLocal::new(w, q, vec![0.7; contacts]).unwrap()
    }

    /// Nearly half.
    const SLOW: f64 = 0.4999;

    #[test]
    fn what_converges_slowly_takes_a_fraction_of_the_sweeps_and_ends_at_the_same_impulses() {
        let problem = row(40, SLOW);
        let (plain, r) = run::<_, 2>(&problem, 1e-12, false);
        let (steps, accelerated) = run::<_, 2>(&problem, 1e-12, true);
        assert!(3 * steps < plain, "{steps} of {plain}");
        let largest = r.iter().fold(0.0_f64, |m, r| m.max(r.abs()));
        for (a, b) in r.iter().zip(&accelerated) {
            assert!((a - b).abs() < 1e-8 * largest, "{a} {b}");
        }
    }

    #[test]
    fn planted_solutions_are_found_in_both_forms() {
        let case = Planted { contacts: 8, dofs: 60, mu: (0.0, 0.6), seed: 5, ..Planted::default() };
        let near =
            |r: &[f64], known: &[f64]| r.iter().zip(known).all(|(a, b)| (a - b).abs() < 1e-7);
        let (problem, known) = case.local::<3>();
        assert!(near(&run::<_, 3>(&problem, 1e-12, true).1, &known.r));
        let (problem, known) = case.global::<2>();
        assert!(near(&run::<_, 2>(&problem, 1e-12, true).1, &known.r));
    }

    /// Steps that move so much, one after the other, from where the trial begins.
    fn steps_of(moves: &[f64]) -> (Acceleration, Vec<bool>, f64) {
        let problem = row(2, SLOW);
        let mut state = problem.state(Access::Visits).unwrap();
        let mut point = problem.origin();
        let mut acceleration = Acceleration::default();
        acceleration.begin();
        for _ in 0..FIRST {
            assert!(acceleration.move_on(&problem, &mut state, &mut point));
            assert!(!acceleration.is_on());
        }
        point.r[0] = 1.0;
        acceleration.move_on(&problem, &mut state, &mut point);
        let went_on = moves.iter().map(|moved| {
            point.r[0] += moved;
            acceleration.move_on(&problem, &mut state, &mut point)
        });
        let went_on = went_on.collect();
        (acceleration, went_on, point.r[0])
    }

    #[test]
    fn a_trial_in_vain_ends_where_it_began_and_is_the_last() {
        let (acceleration, went_on, at) = steps_of(&[1.0; 2 + IDLE_ON_TRIAL]);
        // The first low is the first step.
        assert_eq!(went_on.iter().position(|on| !on), Some(IDLE_ON_TRIAL));
        assert!(!acceleration.is_on() && acceleration.on_trial().is_none());
        assert_eq!(at, 2.0, "back at 1, and a plain step on");
    }

    #[test]
    fn it_is_trusted_after_a_tenth_and_pauses_where_nothing_new_comes() {
        let mut moves = vec![1.0, 0.5, 0.09];
        let (acceleration, ..) = steps_of(&moves);
        assert!(acceleration.is_on() && acceleration.is_trusted());
        moves.extend([0.09; IDLE]);
        let (acceleration, went_on, _) = steps_of(&moves);
        assert!(went_on.iter().all(|on| *on));
        assert!(!acceleration.is_on() && acceleration.is_trusted(), "it pauses");
        moves.extend([0.09; PAUSE + 1]);
        assert!(steps_of(&moves).0.is_on());
    }

    #[test]
    fn a_slow_fall_goes_on_as_a_trial() {
        let moves: Vec<f64> = (0..15).map(|k| 0.96_f64.powi(k)).collect();
        let (acceleration, went_on, _) = steps_of(&moves);
        assert!(went_on.iter().all(|on| *on));
        assert_eq!(acceleration.on_trial(), Some(moves.len()));
    }
}

//! A linear problem with bounds, solved along a piecewise linear arc by pivots.
//!
//! ```text
//! l ≤ x ≤ u,   A x + q = w − v,   0 ≤ w ⟂ x − l ≥ 0,   0 ≤ v ⟂ u − x ≥ 0
//! A x − w + v + t r = r − q,      t from 0 at the start to 1 at a solution
//! ```
//!
//! In the variables `y` with `x = π(y)`, `w = (l − y)₊`, `v = (y − u)₊` the left side is the normal map `N(y) = A π(y) + q + y − π(y)`, and the arc solves
//! `N(y(t)) = (1 − t) r`. In each cell of the map one of x_i, w_i, v_i is basic for every i; where the arc leaves the cell, that variable leaves the basis at one of
//! its two bounds, and its neighbour in y_i enters ([`Tracer::follow`]). Bounds are implicit: they make no rows, and x_i that crosses from one bound to the other
//! while it enters changes no basis. Free variables are basic from the start to the end.
//!
//! *Starts.* [`Start::At`]: the cell of a given y; what is strictly inside is basic. [`Start::Basis`]: the cell of y with the values that solve its equations, those
//! beyond a bound lifted by the largest of these distances (Rutherford's covering by the infeasibility of a basis). [`Start::Ray`]: all bounded variables at a
//! bound and their w or v large: Lemke's. A column that depends on others in the first basis is replaced by an artificial one, which stays zero; when it leaves, the
//! column that it replaced enters.
//!
//! *Ties* are broken by tolerances (Harris): of what is bounded within the tolerance t leaves first, then artificial variables, then the largest pivot. Where the
//! arc stands still for long, or a basis comes back, values at a bound are moved off it at random, which changes q, and the last basis is solved with the true one.
//!
//! References: Ralph1994, DirkseFerris1995, Munson2002 (start, artificial columns), Rutherford1993 (implicit bounds, covering), CottlePangStone2009 (4.4). Cost of a
//! pivot: one solve with the LU of the last renewal, and the product form of the pivots since. Storage: the LU, a column a pivot, 20 vectors.

mod basis;
mod linearised;
#[cfg(test)]
mod tests;

use nonsmooth_linalg::{Csc, budget};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::cycles::Cycles;
use basis::{Basis, Variable};
pub use linearised::{Cell, Linearised};

/// The problem whose solution the arc leads to.
#[derive(Debug, Clone, Copy)]
pub struct Linear<'a> {
    /// A, n × n.
    pub matrix: &'a Csc,
    /// q.
    pub q: &'a [f64],
    /// l; −∞ allowed.
    pub lower: &'a [f64],
    /// u; ∞ allowed.
    pub upper: &'a [f64],
}

/// Where the arc begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Start {
    /// At y.
    At,
    /// In the cell of y, where its equations hold as far as bounds allow.
    Basis,
    /// With bounded variables at the bound that is the nearer to y, and a residual that is the same in all their rows: Lemke's ray.
    Ray,
}

/// How an arc ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// At t = 1: a solution.
    Solved,
    /// On a ray, or in a loop, on which t does not reach 1.
    Ray,
    /// The basis is singular to working accuracy.
    Singular,
    /// The pivots that were allowed have been made.
    Pivots,
    /// A basis came back in spite of perturbations.
    Cycle,
    /// Time or memory is over.
    Over,
}

/// A pivot is zero below this, in units of the largest entry of its column.
const ZERO: f64 = 1e-11;
/// A pivot below this, in units of its column, is looked at again with a fresh basis.
const SUSPECT: f64 = 1e-7;
/// By how much bounds may be exceeded where that makes a pivot larger.
const TOLERANCE: f64 = 1e-10;
/// Pivots between two factorisations.
const RENEW: usize = 64;
/// A step of no length.
const STILL: f64 = 1e-13;
/// Steps of no length after which values are moved off their bounds.
const STANDSTILL: usize = 30;
/// How often that is done.
const PERTURBATIONS: usize = 3;
/// By how much, in units of 1 + the value.
const PERTURBATION: f64 = 1e-6;

/// Follows arcs; its memory is kept from one to the next.
#[derive(Debug)]
pub struct Tracer {
    basis: Basis,
    /// Scaled bounds.
    lower: Vec<f64>,
    upper: Vec<f64>,
    /// Scaled q, and as perturbed.
    q0: Vec<f64>,
    q: Vec<f64>,
    /// Values of the basic variables, by slots.
    z: Vec<f64>,
    /// Values of x where it is not basic, zero where it is.
    resting: Vec<f64>,
    /// What artificial variables replace: their row, the variable and its value.
    parked: Vec<(usize, Variable, f64)>,
    alpha: Vec<f64>,
    right: Vec<f64>,
    /// y where t was the largest, scaled, before it fell.
    best: Vec<f64>,
    best_t: f64,
    /// The slot of t, where that is basic.
    slot_t: Option<usize>,
    cycles: Cycles,
    rng: Pcg64Mcg,
    /// t at the end.
    t: f64,
    /// Where it is to end.
    until: f64,
    /// Pivots of the last arc.
    pivots: usize,
    /// Columns of its first basis that depended on others.
    dependent: usize,
}

/// What is moved along the arc between two pivots.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Driving {
    variable: Variable,
    /// Whether it grows (1) or falls (−1), and where it begins.
    sign: f64,
    from: f64,
    /// Its direction was a choice.
    chosen: bool,
}

/// What bounds a move.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Block {
    /// The basic variable of this slot.
    Slot(usize),
    /// The other bound of what is moved.
    Own,
    Nothing,
}

impl Tracer {
    /// For problems with n variables.
    pub fn new(n: usize) -> Self {
        let zeros = || vec![0.0; n];
        Self {
            basis: Basis::new(n),
            lower: zeros(),
            upper: zeros(),
            q0: zeros(),
            q: zeros(),
            z: zeros(),
            resting: zeros(),
            parked: vec![],
            alpha: zeros(),
            right: zeros(),
            best: zeros(),
            best_t: 0.0,
            slot_t: None,
            cycles: Cycles::default(),
            rng: Pcg64Mcg::seed_from_u64(0),
            t: 0.0,
            until: 1.0,
            pivots: 0,
            dependent: 0,
        }
    }

    /// The pivots of the last arc.
    pub fn pivots(&self) -> usize {
        self.pivots
    }

    /// How many columns of the first basis of the last arc depended on others.
    pub fn dependent(&self) -> usize {
        self.dependent
    }

    /// The largest t of the last arc: 1 where it was solved.
    pub fn reached(&self) -> f64 {
        self.best_t
    }

    /// Follows the arc of `problem` from y, by at most `pivots` pivots. Then y is where t was the largest: a solution where it ended [`Solved`](End::Solved).
    pub fn follow(&mut self, problem: &Linear, start: Start, y: &mut [f64], pivots: usize) -> End {
        self.follow_until(problem, start, y, pivots, 1.0)
    }

    /// As [`follow`](Self::follow), to `t = until` in place of 1.
    pub fn follow_until(
        &mut self,
        problem: &Linear,
        start: Start,
        y: &mut [f64],
        pivots: usize,
        until: f64,
    ) -> End {
        (self.pivots, self.until) = (0, until);
        let mut end = End::Singular;
        // Where a direction had to be chosen and led nowhere, the other one.
        for sign in [1.0, -1.0] {
            match self.begin(problem, start, y) {
                Ok(()) => end = self.trace(sign, pivots),
                Err(why) => return why,
            }
            if end != End::Ray || self.dependent == 0 || self.best_t > 0.0 {
                break;
            }
        }
        self.leave(problem, end, y);
        end
    }

    /// Scales the problem, and makes the first basis.
    fn begin(&mut self, problem: &Linear, start: Start, y: &[f64]) -> Result<(), End> {
        let n = y.len();
        self.basis.take(problem.matrix);
        let Self { basis, lower, upper, q0, q, z, resting, parked, right, .. } = self;
        for i in 0..n {
            (lower[i], upper[i]) =
                (problem.lower[i] / basis.columns[i], problem.upper[i] / basis.columns[i]);
            q0[i] = problem.q[i] * basis.rows[i];
        }
        q.copy_from_slice(q0);
        parked.clear();
        resting.fill(0.0);
        for i in 0..n {
            let (l, u) = (problem.lower[i], problem.upper[i]);
            let inside = y[i] > l && y[i] < u;
            let free = l.is_infinite() && u.is_infinite();
            let below = match start {
                Start::Ray if inside => y[i] - l <= u - y[i],
                _ => y[i] <= l,
            };
            (basis.basic[i], z[i]) = if free || (inside && start != Start::Ray) {
                (Variable::X(i), y[i] / basis.columns[i])
            } else if below {
                resting[i] = lower[i];
                (Variable::W(i), (l - y[i]).max(0.0) * basis.rows[i])
            } else {
                resting[i] = upper[i];
                (Variable::V(i), (y[i] - u).max(0.0) * basis.rows[i])
            };
        }
        basis.renew().map_err(|()| End::Over)?;
        self.dependent = basis.lu.replaced().len();
        for &(slot, row) in basis.lu.replaced() {
            let variable = basis.basic[slot];
            parked.push((row, variable, z[slot]));
            if let Variable::X(i) = variable {
                resting[i] = z[slot];
            }
            (basis.basic[slot], z[slot]) = (Variable::Artificial(row), 0.0);
        }
        match start {
            Start::At => {}
            Start::Basis => {
                // What solves the equations of the cell.
                Self::right_side(basis, q, resting, parked, right);
                basis.solve(right, &mut self.alpha);
                if self.alpha.iter().any(|x| !x.is_finite()) {
                    return Err(End::Singular);
                }
                let mut worst = 0.0_f64;
                for (slot, &x) in self.alpha.iter().enumerate() {
                    let (l, u) = range(lower, upper, basis.basic[slot]);
                    worst = worst.max(l - x).max(x - u);
                }
                let lift = 1.1 * worst + 1e-3 * worst.min(1.0);
                for (slot, &x) in self.alpha.iter().enumerate() {
                    let (l, u) = range(lower, upper, basis.basic[slot]);
                    z[slot] = if x < l {
                        (x + lift).min(0.5 * (l + u).min(f64::MAX)).max(l)
                    } else if x > u {
                        (x - lift).max(0.5 * (l + u).max(f64::MIN)).min(u)
                    } else {
                        x
                    };
                }
            }
            Start::Ray => {
                // F, with the slacks gone.
                right.copy_from_slice(q);
                for i in 0..n {
                    let x = match basis.basic[i] {
                        Variable::X(i) => z[i],
                        _ => resting[i],
                    };
                    basis.a.column(i).0.iter().zip(basis.a.column(i).1).for_each(|(&k, a)| {
                        right[k] += a * x;
                    });
                }
                let wanted = |slot: usize| match basis.basic[slot] {
                    Variable::W(i) => Some(right[i]),
                    Variable::V(i) => Some(-right[i]),
                    _ => None,
                };
                let worst = (0..n).filter_map(wanted).fold(0.0_f64, |m, f| m.max(-f));
                let height = 1.1 * worst + 1.0;
                for slot in 0..n {
                    if let Some(f) = wanted(slot) {
                        z[slot] = f + height;
                    }
                }
            }
        }
        // r = N(y).
        right.copy_from_slice(q);
        right.iter_mut().for_each(|r| *r = -*r);
        Self::right_side(basis, q, resting, parked, right);
        right.iter_mut().for_each(|r| *r = -*r);
        for (slot, &x) in z.iter().enumerate() {
            basis.add_column(basis.basic[slot], x, right);
        }
        basis.r.copy_from_slice(right);
        Ok(())
    }

    /// `−q − A x` of what rests, less what is parked: the right side of the basis, but for t r.
    fn right_side(
        basis: &Basis,
        q: &[f64],
        resting: &[f64],
        parked: &[(usize, Variable, f64)],
        right: &mut [f64],
    ) {
        right.iter_mut().zip(q).for_each(|(b, q)| *b = -q);
        for (i, &x) in resting.iter().enumerate().filter(|r| *r.1 != 0.0) {
            basis.add_column(Variable::X(i), -x, right);
        }
        for &(_, variable, value) in parked {
            // An x that is parked rests.
            if !matches!(variable, Variable::X(_)) {
                basis.add_column(variable, -value, right);
            }
        }
    }

    /// Pivots to the end of the arc. `sign`: that of directions that have to be chosen.
    fn trace(&mut self, sign: f64, limit: usize) -> End {
        (self.t, self.best_t, self.slot_t) = (0.0, 0.0, None);
        self.keep_best();
        self.cycles.begin();
        // Steps of no length since the last one that had some, and since the cycle was begun; perturbations.
        let (mut still, mut moved, mut perturbed) = (0, false, 0);
        let mut driving = Driving { variable: Variable::T, sign: 1.0, from: 0.0, chosen: false };
        loop {
            if budget::over() {
                return End::Over;
            }
            if self.pivots >= limit {
                return End::Pivots;
            }
            if self.basis.age() >= RENEW && !self.renew(driving) {
                return End::Singular;
            }
            self.basis.column(driving.variable, &mut self.alpha);
            let mut largest = 0.0_f64;
            for a in &self.alpha {
                largest = if a.is_nan() { f64::NAN } else { largest.max(a.abs()) };
            }
            if !largest.is_finite() {
                return End::Singular;
            }
            let (block, length) = self.block(&driving, largest);
            if let Block::Slot(slot) = block
                && self.alpha[slot].abs() < SUSPECT * largest
                && self.basis.age() > 0
            {
                if !self.renew(driving) {
                    return End::Singular;
                }
                continue;
            }
            // The rate of t.
            let rate = match (driving.variable, self.slot_t) {
                (Variable::T, _) => driving.sign,
                (_, Some(slot)) => -driving.sign * self.alpha[slot],
                _ => 0.0,
            };
            if rate < 0.0 && self.t > self.best_t {
                self.keep_best();
            }
            if block == Block::Nothing {
                if driving.chosen {
                    driving = Driving { sign: -driving.sign, chosen: false, ..driving };
                    continue;
                }
                return End::Ray;
            }
            let step = driving.sign * length;
            for (z, a) in self.z.iter_mut().zip(&self.alpha) {
                *z -= step * a;
            }
            let value = driving.from + step;
            self.pivots += 1;
            let leaving = match block {
                Block::Slot(slot) => {
                    let leaving = self.basis.basic[slot];
                    if leaving == Variable::T {
                        self.slot_t = None;
                    }
                    self.basis.exchange(slot, driving.variable, &self.alpha);
                    self.z[slot] = value;
                    match driving.variable {
                        Variable::T => self.slot_t = Some(slot),
                        Variable::X(i) => self.resting[i] = 0.0,
                        _ => {}
                    }
                    // Up or down: by the direction in which it went.
                    (
                        leaving,
                        -step * self.alpha[slot] > 0.0
                            || (length == 0.0 && -driving.sign * self.alpha[slot] > 0.0),
                    )
                }
                _ => (driving.variable, driving.sign > 0.0),
            };
            self.t = match self.slot_t {
                Some(slot) => self.z[slot],
                None if leaving.0 == Variable::T => self.until,
                None => self.t,
            };
            still = if length > STILL { 0 } else { still + 1 };
            moved |= length > STILL;
            let words = driving.variable.word() ^ leaving.0.word();
            if leaving.0 == Variable::T {
                self.best_t = self.until;
                return End::Solved;
            }
            driving = self.next(leaving, sign);
            // With a bit for the direction.
            let next = driving.variable.word().rotate_left(u32::from(driving.sign > 0.0));
            let back = self.cycles.exchange_and_drive(words, next);
            if back && moved {
                return End::Ray;
            }
            if back || still >= STANDSTILL {
                if perturbed == PERTURBATIONS {
                    return End::Cycle;
                }
                perturbed += 1;
                still = 0;
                self.cycles.begin();
                self.perturb();
            }
        }
    }

    /// What bounds the move, and how far off.
    fn block(&self, driving: &Driving, largest: f64) -> (Block, f64) {
        let least = ZERO * largest;
        let room = |slot: usize, rate: f64| {
            let (l, u) = self.range(self.basis.basic[slot]);
            let z = self.z[slot];
            if rate < 0.0 { z - l } else { u - z }
        };
        let rate = |slot: usize| -driving.sign * self.alpha[slot];
        let mut most = f64::INFINITY;
        for slot in 0..self.z.len() {
            let rate = rate(slot);
            if rate.abs() > least {
                let slack = TOLERANCE * (1.0 + self.z[slot].abs());
                most = most.min((room(slot, rate).max(0.0) + slack) / rate.abs());
            }
        }
        let mut found = Block::Nothing;
        let (mut length, mut rank) = (f64::INFINITY, (0, 0.0));
        if most.is_finite() {
            for slot in 0..self.z.len() {
                let rate = rate(slot);
                if rate.abs() <= least {
                    continue;
                }
                let distance = room(slot, rate).max(0.0) / rate.abs();
                if distance <= most {
                    let class = match self.basis.basic[slot] {
                        Variable::T => 2,
                        Variable::Artificial(_) => 1,
                        _ => 0,
                    };
                    // A tiny pivot is no gain.
                    let class = if rate.abs() < SUSPECT * largest { 0 } else { class };
                    let this = (class, rate.abs());
                    if this > rank {
                        (found, length, rank) = (Block::Slot(slot), distance, this);
                    }
                }
            }
        }
        let (l, u) = self.range(driving.variable);
        let own = if driving.sign > 0.0 { u - driving.from } else { driving.from - l };
        if own <= length && own.is_finite() {
            return (Block::Own, own.max(0.0));
        }
        (found, length)
    }

    /// The bounds of a variable.
    fn range(&self, v: Variable) -> (f64, f64) {
        match v {
            Variable::T => (f64::NEG_INFINITY, self.until),
            v => range(&self.lower, &self.upper, v),
        }
    }

    /// What is moved after a variable has reached its upper or lower bound.
    fn next(&mut self, (left, up): (Variable, bool), sign: f64) -> Driving {
        let of = |variable, sign, from| Driving { variable, sign, from, chosen: false };
        match left {
            Variable::X(i) if up => {
                self.resting[i] = self.upper[i];
                of(Variable::V(i), 1.0, 0.0)
            }
            Variable::X(i) => {
                self.resting[i] = self.lower[i];
                of(Variable::W(i), 1.0, 0.0)
            }
            Variable::W(i) => of(Variable::X(i), 1.0, self.lower[i]),
            Variable::V(i) => of(Variable::X(i), -1.0, self.upper[i]),
            Variable::Artificial(row) => {
                let at = self.parked.iter().position(|p| p.0 == row).expect("one for each");
                let (_, variable, from) = self.parked.swap_remove(at);
                // Towards larger t, if it moves t at all.
                self.basis.column(variable, &mut self.alpha);
                let rate = self.slot_t.map_or(0.0, |slot| -self.alpha[slot]);
                let sign = if rate.abs() > 1e-9 { rate.signum() } else { sign };
                Driving { variable, sign, from, chosen: true }
            }
            Variable::T => unreachable!("the arc ends there"),
        }
    }

    /// Factorises the basis, and makes the values from it. False where it is singular.
    fn renew(&mut self, driving: Driving) -> bool {
        if self.basis.renew().is_err() || !self.basis.lu.replaced().is_empty() {
            return false;
        }
        let Self { basis, q, resting, parked, right, z, .. } = self;
        // What is moved has a value, too, and an x of its own rests elsewhere.
        let rested = match driving.variable {
            Variable::X(i) => Some((i, std::mem::replace(&mut resting[i], driving.from))),
            _ => None,
        };
        Self::right_side(basis, q, resting, parked, right);
        if let Some((i, x)) = rested {
            resting[i] = x;
        } else if driving.variable != Variable::T {
            basis.add_column(driving.variable, -driving.from, right);
        }
        right.iter_mut().zip(&basis.r).for_each(|(b, r)| *b += r);
        basis.solve(right, z);
        z.iter().all(|z| z.is_finite())
    }

    /// Moves values that are at a bound off it, and q with them.
    fn perturb(&mut self) {
        for slot in 0..self.z.len() {
            let variable = self.basis.basic[slot];
            let (l, u) = self.range(variable);
            let z = self.z[slot];
            let near = PERTURBATION * (1.0 + z.abs());
            if matches!(variable, Variable::T | Variable::Artificial(_)) || u - l < 4.0 * near {
                continue;
            }
            let by = near * self.rng.random_range(0.5..1.0);
            let moved = if z - l < near {
                by
            } else if u - z < near {
                -by
            } else {
                continue;
            };
            self.z[slot] += moved;
            self.basis.add_column(variable, -moved, &mut self.q);
        }
    }

    /// Keeps y where the arc is now.
    fn keep_best(&mut self) {
        self.best_t = self.t;
        let Self { basis, best, resting, z, lower, upper, parked, .. } = self;
        best.copy_from_slice(resting);
        for (&v, &z) in basis.basic.iter().zip(&*z) {
            write(basis, lower, upper, v, z, best);
        }
        for &(_, v, z) in &*parked {
            write(basis, lower, upper, v, z, best);
        }
    }

    /// The end of the arc in the problem's own units.
    fn leave(&mut self, problem: &Linear, end: End, y: &mut [f64]) {
        if end == End::Solved {
            // With the q that was given, refined once.
            let Self { basis, q0, resting, parked, right, z, alpha, .. } = self;
            Self::right_side(basis, q0, resting, parked, right);
            let share = 1.0 - self.until;
            right.iter_mut().zip(&basis.r).for_each(|(b, r)| *b += share * r);
            let mut rest = right.clone();
            basis.solve(right, alpha);
            if alpha.iter().all(|x| x.is_finite()) {
                for (slot, &x) in alpha.iter().enumerate() {
                    basis.add_column(basis.basic[slot], -x, &mut rest);
                }
                basis.solve(&mut rest, z);
                let sum = z.iter_mut().zip(&*alpha);
                sum.for_each(|(z, x)| *z = if z.is_finite() { *z + x } else { *x });
            }
            self.t = self.until;
            self.keep_best();
        } else if self.t > self.best_t {
            self.keep_best();
        }
        for i in 0..y.len() {
            let (l, u) = (problem.lower[i], problem.upper[i]);
            let (scaled, row) = (self.best[i], self.basis.rows[i]);
            y[i] = if scaled < self.lower[i] {
                l - (self.lower[i] - scaled) / row
            } else if scaled > self.upper[i] {
                u + (scaled - self.upper[i]) / row
            } else {
                (scaled * self.basis.columns[i]).max(l).min(u)
            };
        }
    }
}

/// The bounds of a variable; t has them elsewhere.
fn range(lower: &[f64], upper: &[f64], v: Variable) -> (f64, f64) {
    match v {
        Variable::X(i) => (lower[i], upper[i]),
        Variable::W(_) | Variable::V(_) => (0.0, f64::INFINITY),
        Variable::Artificial(_) | Variable::T => (0.0, 0.0),
    }
}

/// Writes the value of a variable to y.
fn write(basis: &Basis, lower: &[f64], upper: &[f64], v: Variable, z: f64, y: &mut [f64]) {
    debug_assert_eq!(basis.basic.len(), y.len());
    match v {
        Variable::X(i) => y[i] = z.max(lower[i]).min(upper[i]),
        Variable::W(i) => y[i] = lower[i] - z.max(0.0),
        Variable::V(i) => y[i] = upper[i] + z.max(0.0),
        Variable::Artificial(_) | Variable::T => {}
    }
}

//! Vectors that refute a problem, from iterates that run away.
//!
//! Where `M z + q ≥ 0, z ≥ 0` is impossible and M is monotone, the iterates grow, and their directions x̂, ŝ tend to `M x̂ = ŝ`, `x̂ᵀŝ = 0`; then
//! `x̂ᵀM x̂ = 0`, hence `Mᵀx̂ = −M x̂ ≤ 0`, and `qᵀx̂ < 0`: a Farkas vector, but for rounding and the path still to go. It is made exact by a projection: entries
//! that should be zero, of y and of `Mᵀy`, are guessed, and the nearest vector with these zeros is taken. With R in general `Rᵀy = x̂`, `Qᵀy = ŝ`.

use nonsmooth_linalg::{Csc, Inverse, Matrix, budget};

use super::scale::Scaled;
use crate::complementarity::form::Equations;

/// The projection's cost is that of a sparse factorisation of this order, at most.
const LARGEST: usize = 5_000;
/// A guess counts what is below these fractions of the largest as zero, in turn.
const FRACTIONS: [f64; 4] = [1e-1, 1e-2, 1e-4, 1e-8];
/// Projections for each.
const ROUNDS: usize = 5;
/// How far from a Farkas vector the first guess may be.
const NEAR: f64 = 0.05;

/// A row that no z ≥ 0 makes nonnegative: `q_r < 0`, `M_rj ≤ 0` for all j, and zero for free variables (lecture (19)). `marks` is room for a mark a row.
pub fn hopeless_row(problem: &Equations, marks: &mut Vec<bool>) -> Option<usize> {
    let Equations { matrix, slack, q, free } = *problem;
    if slack.is_some() {
        return None;
    }
    marks.clear();
    marks.extend(q.iter().enumerate().map(|(i, q)| i >= free && *q < 0.0));
    matrix.for_each(|i, j, x| {
        if x > 0.0 || (j < free && x != 0.0) {
            marks[i] = false;
        }
    });
    marks.iter().position(|hopeless| *hopeless)
}

/// y with `Qᵀ y = s`, `Rᵀ y = x` in the sense of least squares: the multipliers of `min ‖v − (s, x)‖`, `[Q R] v = 0`.
fn combination(q: &Matrix, r: &Matrix, x: &[f64], s: &[f64]) -> Option<Vec<f64>> {
    let n = x.len();
    if n > LARGEST {
        return None;
    }
    let mut entries = vec![];
    q.for_each(|i, j, x| entries.push((j, i, x)));
    r.for_each(|i, j, x| entries.push((n + j, i, x)));
    let g = Csc::from_triplets(2 * n, n, entries.into_iter()).ok()?;
    let saddle = Inverse::saddle(&Csc::diagonal(&vec![1.0; 2 * n]), &g).ok()?;
    let mut both = [s, x, &vec![0.0; n]].concat();
    saddle.solve(&mut both);
    Some(both[2 * n..].iter().map(|y| -y).collect())
}

/// A Farkas vector from an iterate, in the caller's units. `None` where the iterate does not look like one; `Some(None)` where it does, but is none.
pub(super) fn farkas(scaled: &Scaled, z: &[f64], s: &[f64]) -> Option<Option<Vec<f64>>> {
    let free = scaled.free;
    let size = s.iter().chain(&z[free..]).fold(0.0_f64, |l, x| l.max(x.abs()));
    if size.is_nan() || size <= 0.0 {
        return None;
    }
    let y: Vec<f64> = match &scaled.slack {
        None => z.iter().map(|z| z / size).collect(),
        Some(slack) => {
            combination(scaled.matrix(), slack, z, s)?.iter().map(|y| y / size).collect()
        }
    };
    let sign = if scaled.slack.is_some() { -1.0 } else { 1.0 };
    if !negative(&scaled.c, sign, &y) {
        return None;
    }
    // The matrix whose transpose must not be positive (nonnegative with R) on the combination.
    let (columns, direction) = match &scaled.slack {
        None => (vec![scaled.matrix()], 1.0),
        Some(r) => (vec![scaled.matrix(), r], -1.0),
    };
    let side = |i: usize| if i < free { Side::Free } else { Side::Lower };
    let sides: Vec<Side> = match &scaled.slack {
        None => (0..y.len()).map(side).collect(),
        Some(_) => vec![],
    };
    let cleaned = cleaned(&columns, direction, &sides, &y);
    let proof = cleaned.filter(|y| negative(&scaled.c, sign, y));
    Some(proof.map(|mut y| {
        scaled.rows_leave(&mut y);
        y
    }))
}

/// Whether `sign cᵀ y` is negative beyond rounding.
fn negative(c: &[f64], sign: f64, y: &[f64]) -> bool {
    let (mut sum, mut size) = (0.0, 0.0);
    for (c, y) in c.iter().zip(y) {
        sum += sign * c * y;
        size += (c * y).abs();
    }
    sum < -1e-8 * size
}

/// Which bounds a variable has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// −∞ and ∞.
    Free,
    /// l and ∞.
    Lower,
    /// −∞ and u.
    Upper,
    /// l and u, both finite.
    Both,
}

impl Side {
    /// Whether y_i, or −y_i, is nonnegative, if that is asked for.
    fn sign(self) -> Option<f64> {
        match self {
            Self::Lower => Some(1.0),
            Self::Upper => Some(-1.0),
            Self::Free | Self::Both => None,
        }
    }
}

/// The vector nearest to y with the zeros that it seems to have: for a problem `w = M z + q` with these bounds, `y_i ≥ 0` and `(Mᵀy)_i ≤ 0` for a lower bound, the other way
/// round for an upper one, `(Mᵀy)_i = 0` without bounds, `y_i = 0` with two. In the units of `matrix`.
pub fn clean(matrix: &Matrix, sides: &[Side], y: &[f64]) -> Option<Vec<f64>> {
    cleaned(&[matrix], 1.0, sides, y)
}

/// With one matrix y has signs; with two (and no sides) it has any.
fn cleaned(matrices: &[&Matrix], direction: f64, sides: &[Side], y: &[f64]) -> Option<Vec<f64>> {
    let n = y.len();
    if n > LARGEST {
        return None;
    }
    let largest = |v: &[f64]| v.iter().fold(0.0_f64, |l, x| l.max(x.abs()));
    // Of problems without sides all combinations have the same sign, and y has any.
    let side = |j: usize| sides.get(j).copied();
    let sign = |j: usize| side(j).map_or(Some(1.0), Side::sign);
    let sums: Vec<Vec<f64>> = matrices
        .iter()
        .map(|m| {
            let mut g = vec![0.0; n];
            m.mul_transpose(y, &mut g);
            g.iter_mut().for_each(|g| *g *= direction);
            g
        })
        .collect();
    let reach = largest(y);
    let excess = |(j, g): (usize, &f64)| match sign(j) {
        Some(sign) => sign * g,
        None if side(j) == Some(Side::Free) => g.abs(),
        None => 0.0,
    };
    let worst = |g: &Vec<f64>| g.iter().enumerate().map(excess).fold(0.0_f64, f64::max);
    let wrong = sums.iter().map(worst).fold(0.0_f64, f64::max);
    if wrong.is_nan() || wrong > NEAR * reach {
        return None;
    }
    for fraction in FRACTIONS {
        if budget::over() {
            return None;
        }
        let floor = fraction * reach;
        let supports = |i: &usize| match side(*i) {
            None | Some(Side::Free) => true,
            Some(Side::Both) => false,
            Some(side) => side.sign().is_some_and(|sign| sign * y[*i] > floor),
        };
        let mut support: Vec<usize> = (0..n).filter(supports).collect();
        let zero = |k: usize, j: usize| match sign(j) {
            Some(sign) => sign * sums[k][j] > -floor,
            None => side(j) == Some(Side::Free) || sums[k][j].abs() < floor,
        };
        // Entries that a projection makes negative are zero in the next.
        for _ in 0..ROUNDS {
            if budget::over() {
                return None;
            }
            let Some(mut out) = project(matrices, &support, zero, y) else { break };
            let size = largest(&out);
            let rounding = |y: &f64| y.abs() <= 1e-14 * size;
            out.iter_mut().filter(|y| rounding(y)).for_each(|y| *y = 0.0);
            if size < 0.5 * reach {
                break;
            }
            let wrong =
                |i: &usize| side(*i).and_then(Side::sign).is_some_and(|sign| sign * out[*i] < 0.0);
            if support.iter().any(wrong) {
                support.retain(|i| !wrong(i));
            } else if holds(matrices, direction, sides, &out) {
                return Some(out);
            } else {
                break;
            }
        }
    }
    None
}

/// The vector with this support that is nearest to y among those whose combination vanishes where `zero(matrix, column)` says.
fn project(
    matrices: &[&Matrix],
    support: &[usize],
    zero: impl Fn(usize, usize) -> bool,
    y: &[f64],
) -> Option<Vec<f64>> {
    let n = y.len();
    let mut place = vec![usize::MAX; n];
    support.iter().enumerate().for_each(|(k, &i)| place[i] = k);
    let mut entries = vec![];
    let mut count = 0;
    for (k, m) in matrices.iter().enumerate() {
        let mut number = vec![usize::MAX; n];
        for (j, number) in number.iter_mut().enumerate() {
            if zero(k, j) {
                *number = count;
                count += 1;
            }
        }
        m.for_each(|i, j, x| {
            if place[i] != usize::MAX && number[j] != usize::MAX {
                entries.push((place[i], number[j], x));
            }
        });
    }
    let p = support.len();
    let g = Csc::from_triplets(p, count, entries.into_iter()).ok()?;
    let projection = Inverse::saddle(&Csc::diagonal(&vec![1.0; p]), &g).ok()?;
    let mut both: Vec<f64> = support.iter().map(|&i| y[i]).collect();
    both.resize(p + count, 0.0);
    projection.solve(&mut both);
    let mut out = vec![0.0; n];
    support.iter().zip(&both).for_each(|(&i, &b)| out[i] = b);
    Some(out)
}

/// The signs of the combination, with what is rounding taken for zero.
fn holds(matrices: &[&Matrix], direction: f64, sides: &[Side], y: &[f64]) -> bool {
    let n = y.len();
    matrices.iter().all(|m| {
        let (mut sums, mut sizes) = (vec![0.0; n], vec![0.0; n]);
        m.for_each(|i, j, x| {
            sums[j] += direction * x * y[i];
            sizes[j] += (x * y[i]).abs();
        });
        let fine = |(j, (g, size)): (usize, (&f64, &f64))| {
            let zero = 5e-14 * size;
            match sides.get(j) {
                None | Some(Side::Lower) => *g <= zero,
                Some(Side::Upper) => *g >= -zero,
                Some(Side::Free) => g.abs() <= zero,
                Some(Side::Both) => true,
            }
        };
        sums.iter().zip(&sizes).enumerate().all(fine)
    })
}

//! A hierarchy of ever smaller symmetric matrices by pairwise aggregation, and the K-cycle through it.
//!
//! Level `k + 1` has one unknown for each aggregate of unknowns of level k: `A_{k+1} = Pᵀ A_k P`, P the piecewise constant prolongation. Aggregates are pairs of pairs of strongly
//! coupled unknowns. Unknowns may be *truncated*: they stay zero on their level and count on no coarser one, so that one hierarchy serves all faces of the
//! bounds; only the numbers of the coarse matrices are summed anew, in one pass over the entries.
//!
//! A cycle is a preconditioner: one forward sweep of Gauss–Seidel, at most two steps of flexible conjugate gradients on the next level, each with a cycle of its own, one backward
//! sweep. Two steps are what makes the number of cycles independent of the number of levels although the prolongation is not smooth.
//!
//! References: Notay2010 (aggregation), NotayVassilevski2008 (K-cycle), Kornhuber1994 (truncation).
//!
//! Cost of a cycle: some 7 passes over the entries of A. Storage: 16 bytes for each entry of A and of the coarser matrices, which have a third as many.

use nonsmooth_linalg::{Csc, budget};

use super::rows::dot;

/// Below this many unknowns there is no coarser level.
const COARSEST: usize = 16;
/// A level with more than this share of the unknowns or entries of the one before is none: graphs without geometry fill up.
const COARSENS: f64 = 0.6;
/// Sweeps forth and back that solve the coarsest level, up to so many unknowns; of more, where nothing coarser was found, one is the preconditioner.
const SWEEPS: usize = 12;
const SOLVED: usize = 200;
/// A first step of conjugate gradients that leaves less than this of the residual needs no second.
const ENOUGH: f64 = 0.25;
/// What of a diagonal entry is rounding, in units of those that it is the sum of.
const NOTHING: f64 = 1e-12;
/// No aggregate.
const NONE: u32 = u32::MAX;

/// A matrix by rows, and its place in the hierarchy.
#[derive(Debug, Clone, Default)]
pub(super) struct Level {
    start: Vec<usize>,
    column: Vec<u32>,
    value: Vec<f64>,
    pub diagonal: Vec<f64>,
    /// `1/a_ii`; zero of what is truncated.
    pub inverse: Vec<f64>,
    /// Of each unknown, the next level's.
    pub aggregate: Vec<u32>,
    /// Of each entry, the one of the next level that it is added to.
    target: Vec<u32>,
    // Of the conjugate gradients on this level: right-hand side, solution, and two directions with their products.
    r: Vec<f64>,
    x: Vec<f64>,
    p: [Vec<f64>; 2],
    product: [Vec<f64>; 2],
}

/// Pairs of strongly coupled unknowns: of each, the number of its pair, and how many there are.
fn pairs(level: &Level) -> (Vec<u32>, usize) {
    let n = level.order();
    let mut pair = vec![NONE; n];
    let mut count = 0;
    for i in 0..n {
        if pair[i] != NONE {
            continue;
        }
        let strongest = level
            .row(i)
            .filter(|&(j, _)| j != i && pair[j] == NONE)
            .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        pair[i] = count as u32;
        if let Some((j, _)) = strongest {
            pair[j] = count as u32;
        }
        count += 1;
    }
    (pair, count)
}

impl Level {
    /// The finest level: a symmetric matrix, whose columns are its rows.
    fn of(a: &Csc) -> Self {
        let mut level = Self {
            start: a.col_ptr().to_vec(),
            column: a.row_idx().iter().map(|&i| i as u32).collect(),
            value: a.values().to_vec(),
            ..Self::default()
        };
        level.make_room();
        level
    }

    fn make_room(&mut self) {
        let n = self.order();
        self.diagonal.resize(n, 0.0);
        self.inverse.resize(n, 0.0);
    }

    /// The number of unknowns.
    pub fn order(&self) -> usize {
        self.start.len().saturating_sub(1)
    }

    fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = self.start[i]..self.start[i + 1];
        self.column[range.clone()]
            .iter()
            .map(|&j| j as usize)
            .zip(self.value[range].iter().copied())
    }

    /// `(A x)_i`.
    #[inline]
    pub fn dot(&self, i: usize, x: &[f64]) -> f64 {
        let range = self.start[i]..self.start[i + 1];
        let entries = self.column[range.clone()].iter().zip(&self.value[range]);
        entries.map(|(&j, &v)| v * x[j as usize]).sum()
    }

    /// `y = A x`.
    pub fn mul(&self, x: &[f64], y: &mut [f64]) {
        y.iter_mut().enumerate().for_each(|(i, y)| *y = self.dot(i, x));
    }

    /// The matrix of the aggregates, and of each entry of this one the place there.
    fn summed(&self, aggregate: &[u32], count: usize) -> (Self, Vec<u32>) {
        // The members of the aggregates, one after the other.
        let n = self.order();
        let mut first = vec![0_usize; count + 1];
        aggregate.iter().for_each(|&a| first[a as usize + 1] += 1);
        for a in 0..count {
            first[a + 1] += first[a];
        }
        let mut members = vec![0_u32; n];
        let mut next = first.clone();
        for (i, &a) in aggregate.iter().enumerate() {
            members[next[a as usize]] = i as u32;
            next[a as usize] += 1;
        }
        let mut target = vec![0_u32; self.column.len()];
        let mut place = vec![usize::MAX; count];
        let mut coarse = Self { start: vec![0], ..Self::default() };
        for a in 0..count {
            let begin = coarse.column.len();
            for &i in &members[first[a]..first[a + 1]] {
                for k in self.start[i as usize]..self.start[i as usize + 1] {
                    let b = aggregate[self.column[k] as usize];
                    let at = &mut place[b as usize];
                    if *at == usize::MAX || *at < begin {
                        *at = coarse.column.len();
                        coarse.column.push(b);
                        coarse.value.push(0.0);
                    }
                    coarse.value[*at] += self.value[k];
                    target[k] = *at as u32;
                }
            }
            coarse.start.push(coarse.column.len());
        }
        coarse.make_room();
        (coarse, target)
    }

    /// One visit of every unknown for `A x = b`.
    pub fn sweep(&self, b: &[f64], x: &mut [f64], backward: bool) {
        let mut visit = |i: usize| {
            let inverse = self.inverse[i];
            if inverse != 0.0 {
                x[i] += inverse * (b[i] - self.dot(i, x));
            }
        };
        if backward {
            (0..self.order()).rev().for_each(&mut visit);
        } else {
            (0..self.order()).for_each(&mut visit);
        }
    }
}

/// The hierarchy below a matrix whose columns are its rows. The coarse matrices have no numbers until [`truncate`].
pub(super) fn levels(a: &Csc) -> Vec<Level> {
    let mut levels = vec![Level::of(a)];
    while let Some(fine) = levels.last_mut()
        && fine.order() > COARSEST
        && !budget::over()
    {
        let (pair, half) = pairs(fine);
        let (between, _) = fine.summed(&pair, half);
        let (pair_of_pair, count) = pairs(&between);
        if count as f64 > COARSENS * fine.order() as f64 {
            break;
        }
        let aggregate: Vec<u32> = pair.iter().map(|&p| pair_of_pair[p as usize]).collect();
        let (coarse, target) = fine.summed(&aggregate, count);
        if coarse.column.len() as f64 > COARSENS * fine.column.len() as f64 {
            break;
        }
        (fine.aggregate, fine.target) = (aggregate, target);
        levels.push(coarse);
    }
    for level in levels.iter_mut().skip(1) {
        let n = level.order();
        let [p, q] = &mut level.p;
        let [u, v] = &mut level.product;
        for x in [&mut level.r, &mut level.x, p, q, u, v] {
            x.resize(n, 0.0);
        }
    }
    levels
}

/// Leaves out the unknowns of the first level for which `out` says so, and sums the coarser matrices anew.
pub(super) fn truncate(levels: &mut [Level], out: impl Fn(usize) -> bool) {
    for k in 0..levels.len() {
        let (above, below) = levels.split_at_mut(k + 1);
        let fine = &mut above[k];
        for i in 0..fine.order() {
            let (mut d, mut size) = (0.0, 0.0);
            for e in fine.start[i]..fine.start[i + 1] {
                let v = fine.value[e];
                size += v.abs();
                if fine.column[e] as usize == i {
                    d = v;
                }
            }
            let gone = (k == 0 && out(i)) || d <= NOTHING * size;
            fine.diagonal[i] = d;
            fine.inverse[i] = if gone { 0.0 } else { 1.0 / d };
        }
        let Some(coarse) = below.first_mut() else { return };
        coarse.value.fill(0.0);
        for i in 0..fine.order() {
            if fine.inverse[i] == 0.0 {
                continue;
            }
            for e in fine.start[i]..fine.start[i + 1] {
                if fine.inverse[fine.column[e] as usize] != 0.0 {
                    coarse.value[fine.target[e] as usize] += fine.value[e];
                }
            }
        }
    }
}

/// `x ≈ A⁻¹ b` by one cycle, x zero where truncated.
pub(super) fn cycle(levels: &mut [Level], b: &[f64], x: &mut [f64]) {
    x.fill(0.0);
    let Some((fine, below)) = levels.split_first_mut() else { return };
    if budget::over() {
        return;
    }
    let Some(coarse) = below.first_mut() else {
        let sweeps = if fine.order() <= SOLVED { SWEEPS } else { 1 };
        for _ in 0..sweeps {
            fine.sweep(b, x, false);
            fine.sweep(b, x, true);
        }
        return;
    };
    fine.sweep(b, x, false);
    coarse.r.fill(0.0);
    for i in 0..fine.order() {
        if fine.inverse[i] != 0.0 {
            coarse.r[fine.aggregate[i] as usize] += b[i] - fine.dot(i, x);
        }
    }
    gradients(below);
    let coarse = &below[0];
    for (i, x) in x.iter_mut().enumerate() {
        if fine.inverse[i] != 0.0 {
            *x += coarse.x[fine.aggregate[i] as usize];
        }
    }
    fine.sweep(b, x, true);
}

/// At most two steps of flexible conjugate gradients for `A x = r` of the first level, with its r and x; r is lost.
fn gradients(levels: &mut [Level]) {
    let take = |level: &mut Level| {
        let [p, q] = std::mem::take(&mut level.p);
        let [u, v] = std::mem::take(&mut level.product);
        (std::mem::take(&mut level.r), std::mem::take(&mut level.x), p, q, u, v)
    };
    let (mut r, mut x, mut p, mut q, mut u, mut v) = take(&mut levels[0]);
    let size = dot(&r, &r);
    cycle(levels, &r, &mut p);
    if levels.len() == 1 {
        x.copy_from_slice(&p);
    } else {
        levels[0].mul(&p, &mut u);
        let (curvature, slope) = (dot(&p, &u), dot(&p, &r));
        let alpha = if curvature > 0.0 { slope / curvature } else { 0.0 };
        x.iter_mut().zip(&p).for_each(|(x, p)| *x = alpha * p);
        // What is truncated stays in r and is never looked at.
        for i in 0..r.len() {
            if levels[0].inverse[i] != 0.0 {
                r[i] -= alpha * u[i];
            }
        }
        if curvature > 0.0 && dot(&r, &r) > ENOUGH * ENOUGH * size {
            cycle(levels, &r, &mut q);
            levels[0].mul(&q, &mut v);
            let (mixed, own, rest) = (dot(&q, &u), dot(&q, &v), dot(&q, &r));
            let second = own - mixed * mixed / curvature;
            if second > 0.0 {
                let beta = rest / second;
                let back = beta * mixed / curvature;
                for i in 0..x.len() {
                    x[i] += beta * q[i] - back * p[i];
                }
            }
        }
    }
    let level = &mut levels[0];
    (level.r, level.x, level.p, level.product) = (r, x, [p, q], [u, v]);
}

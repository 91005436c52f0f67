//! The numbers of a factorisation: fronts are assembled, eliminated and leave their remainders, one after the other or side by side.

use rayon::prelude::*;

use super::super::budget::{self, Budget, Pace};
use super::BlockLu;
use super::kernel::{self, At, Pivots, Simd, WIDTH};
use super::symbolic::{Front, Run, Symbolic};

/// What all fronts read.
#[derive(Clone, Copy)]
struct Given<'a> {
    symbolic: &'a Symbolic,
    simd: Simd,
    values: &'a [f64],
    row_scale: &'a [f64],
    column_scale: &'a [f64],
}

/// What a range of fronts writes and nobody else does meanwhile.
struct Part<'a> {
    given: Given<'a>,
    lower: &'a mut [f64],
    upper: &'a mut [f64],
    triangles: &'a mut [f64],
    inverses: &'a mut [f64],
    swaps: &'a mut [u32],
    remainders: &'a mut [f64],
    origin: Origin,
    /// Threads that large fronts may be shared among.
    threads: usize,
    pace: Pace,
}

/// Where a part's arrays begin in those of the whole.
#[derive(Debug, Clone, Copy, Default)]
struct Origin {
    lower: usize,
    upper: usize,
    triangles: usize,
    start: usize,
    remainder: usize,
}

impl BlockLu {
    /// All fronts; `None` where the time is over.
    pub(super) fn eliminate(&mut self) -> Option<Pivots> {
        let mut whole = self.whole(1);
        let mut outcome = Pivots::default();
        // A plan for several threads serves one: it only says where remainders lie.
        for (mut part, fronts) in whole.tasks() {
            outcome.add(part.fronts(fronts)?);
        }
        outcome.add(whole.others()?);
        Some(outcome)
    }

    /// The same on the threads of the pool that this is called in, each under `limits`.
    pub(super) fn eliminate_shared(&mut self, limits: &Budget) -> Option<Pivots> {
        let _limits = limits.enter();
        let mut whole = self.whole(rayon::current_num_threads());
        let one = |(mut part, fronts): (Part, _)| {
            let _limits = limits.enter();
            part.fronts(fronts)
        };
        let tasks = whole.tasks().into_par_iter().with_max_len(1).map(one);
        let found: Option<Vec<Pivots>> = tasks.collect();
        let found = found?;
        let mut outcome = whole.others()?;
        found.into_iter().for_each(|found| outcome.add(found));
        Some(outcome)
    }

    /// All that a factorisation reads and writes.
    fn whole(&mut self, threads: usize) -> Part<'_> {
        Part {
            given: Given {
                symbolic: &self.symbolic,
                simd: self.simd,
                values: &self.values,
                row_scale: &self.row_scale,
                column_scale: &self.column_scale,
            },
            lower: &mut self.lower,
            upper: &mut self.upper,
            triangles: &mut self.triangles,
            inverses: &mut self.inverses,
            swaps: &mut self.swaps,
            remainders: &mut self.remainders,
            origin: Origin::default(),
            threads,
            pace: Pace::default(),
        }
    }
}

impl Part<'_> {
    /// The tasks of the plan, each with what it writes.
    fn tasks(&mut self) -> Vec<(Part<'_>, std::ops::Range<usize>)> {
        let s = self.given.symbolic;
        let mut out = Vec::with_capacity(s.plan.tasks.len());
        let (mut lower, mut upper) = (Cut::new(self.lower), Cut::new(self.upper));
        let (mut triangles, mut inverses) = (Cut::new(self.triangles), Cut::new(self.inverses));
        let (mut swaps, mut remainders) = (Cut::new(self.swaps), Cut::new(self.remainders));
        for (task, region) in s.plan.tasks.iter().zip(s.plan.regions.windows(2)) {
            let (first, end) = (&s.fronts[task.start], s.bounds(task.end));
            let part = Part {
                given: self.given,
                lower: lower.range(first.lower, end.lower),
                upper: upper.range(first.upper, end.upper),
                triangles: triangles.range(first.triangles, end.triangles),
                inverses: inverses.range(first.start, end.start),
                swaps: swaps.range(first.start, end.start),
                remainders: remainders.range(region[0], region[1]),
                origin: Origin {
                    lower: first.lower,
                    upper: first.upper,
                    triangles: first.triangles,
                    start: first.start,
                    remainder: region[0],
                },
                threads: 1,
                pace: Pace::default(),
            };
            out.push((part, task.clone()));
        }
        out
    }

    /// The fronts above the tasks.
    fn others(&mut self) -> Option<Pivots> {
        let s = self.given.symbolic;
        self.fronts(s.plan.others(s.fronts.len()))
    }

    fn fronts(&mut self, fronts: impl Iterator<Item = usize>) -> Option<Pivots> {
        let mut outcome = Pivots::default();
        for f in fronts {
            outcome.add(self.front(f)?);
        }
        Some(outcome)
    }

    /// Assembles and eliminates front f; `None` where the time is over.
    fn front(&mut self, f: usize) -> Option<Pivots> {
        let front = &self.given.symbolic.fronts[f];
        let (k, m) = (front.pivots, front.rest);
        let (ld, simd, threads) = (k + m, self.given.simd, self.threads);
        if self.pace.over((ld * ld) as f64) {
            return None;
        }
        self.assemble(front);
        let origin = self.origin;
        let lower = &mut self.lower[front.lower - origin.lower..][..k * ld];
        let upper = &mut self.upper[front.upper - origin.upper..][..k * m];
        let triangles = &mut self.triangles[front.triangles - origin.triangles..];
        let swaps = &mut self.swaps[front.start - origin.start..][..k];
        let mut elimination = Elimination {
            simd,
            threads,
            k,
            ld,
            lower,
            triangles,
            inverses: &mut self.inverses[front.start - origin.start..][..k],
            swaps,
            outcome: Pivots::default(),
            pace: &mut self.pace,
        };
        elimination.columns(0, k)?;
        let outcome = elimination.outcome;
        if m == 0 {
            return Some(outcome);
        }
        exchange(upper, At { at: 0, ld: k }, m, swaps, 0);
        // The remainder; the children's follow on top of it.
        let remainder = &mut self.remainders[front.remainder - origin.remainder..][..m * m];
        let below = At { at: k, ld };
        let (lower, triangles) = (&*lower, &*triangles);
        let each = (k * (k + 2 * m)) as f64;
        let strip = |pace: &mut Pace, upper: &mut [f64], remainder: &mut [f64]| {
            let n = upper.len() / k;
            let part = At { at: 0, ld: k };
            left_solve(simd, (0, k), (lower, ld), triangles, (upper, part), n);
            let remainder = (remainder, At { at: 0, ld: m });
            kernel::product(simd, (m, n, k), (lower, below), (upper, part), remainder, true);
            (!pace.over(each * n as f64)).then_some(())
        };
        let width = strip_width(m, each, threads);
        if shares(m, each, threads) {
            let limits = budget::current();
            let strips = upper.par_chunks_mut(width * k).zip(remainder.par_chunks_mut(width * m));
            strips
                .with_max_len(1)
                .try_for_each(|(u, r)| within(&limits, |pace| strip(pace, u, r)))?;
        } else {
            let mut strips = upper.chunks_mut(width * k).zip(remainder.chunks_mut(width * m));
            strips.try_for_each(|(u, r)| strip(&mut self.pace, u, r))?;
        }
        self.add_remainders(front);
        Some(outcome)
    }

    /// Fills the pivots' rows and columns of a front: the entries of A, and what the children leave there.
    fn assemble(&mut self, front: &Front) {
        let Given { symbolic: s, values, row_scale, column_scale, .. } = self.given;
        let (k, m) = (front.pivots, front.rest);
        let ld = k + m;
        let origin = self.origin;
        let remainders = &*self.remainders;
        let lower = &mut self.lower[front.lower - origin.lower..][..k * ld];
        let upper = &mut self.upper[front.upper - origin.upper..][..k * m];
        lower.fill(0.0);
        upper.fill(0.0);
        for p in &s.places[front.blocks.clone()] {
            let (rows, columns) = (p.rows as usize, p.columns as usize);
            let block = &values[p.values..p.values + rows * columns];
            let row_scale = &row_scale[p.row as usize..p.row as usize + rows];
            let column_scale = &column_scale[p.column as usize..p.column as usize + columns];
            let (to, ld) = if p.upper {
                (&mut upper[p.to - front.upper..], k)
            } else {
                (&mut lower[p.to - front.lower..], ld)
            };
            match rows {
                3 => scatter(block, 3, row_scale, column_scale, to, ld),
                6 => scatter(block, 6, row_scale, column_scale, to, ld),
                12 => scatter(block, 12, row_scale, column_scale, to, ld),
                _ => scatter(block, rows, row_scale, column_scale, to, ld),
            }
        }
        for &c in &s.children[front.children.clone()] {
            let child = &s.fronts[c as usize];
            let from = child.remainder - origin.remainder;
            let from = &remainders[from..from + child.rest * child.rest];
            let (near, far) = (child.runs.start..child.beyond, child.beyond..child.runs.end);
            for column in &s.runs[near.clone()] {
                for l in 0..column.len as usize {
                    let from = &from[(column.from as usize + l) * child.rest..][..child.rest];
                    let to = &mut lower[(column.to as usize + l) * ld..][..ld];
                    add_runs(&s.runs[child.runs.clone()], from, to, 0);
                }
            }
            for column in &s.runs[far] {
                for l in 0..column.len as usize {
                    let from = &from[(column.from as usize + l) * child.rest..][..child.rest];
                    let to = &mut upper[(column.to as usize + l - k) * k..][..k];
                    add_runs(&s.runs[near.clone()], from, to, 0);
                }
            }
        }
    }

    /// Adds what the children leave beyond the pivots of a front to its remainder.
    fn add_remainders(&mut self, front: &Front) {
        let s = self.given.symbolic;
        let (k, m) = (front.pivots, front.rest);
        let begin = front.remainder - self.origin.remainder;
        let end = begin + m * m;
        for &c in &s.children[front.children.clone()] {
            let child = &s.fronts[c as usize];
            let from = child.remainder - self.origin.remainder;
            let from = from..from + child.rest * child.rest;
            // The two lie apart in the stack.
            let (from, to) = if from.start < begin {
                let (low, high) = self.remainders.split_at_mut(begin);
                (&low[from], &mut high[..m * m])
            } else {
                let (low, high) = self.remainders.split_at_mut(end);
                (&high[from.start - end..from.end - end], &mut low[begin..])
            };
            let runs = &s.runs[child.beyond..child.runs.end];
            for column in runs {
                for l in 0..column.len as usize {
                    let from = &from[(column.from as usize + l) * child.rest..][..child.rest];
                    let to = &mut to[(column.to as usize + l - k) * m..][..m];
                    add_runs(runs, from, to, k);
                }
            }
        }
    }
}

/// What is left of an array from which ranges are cut in order.
pub(super) struct Cut<'a, T> {
    rest: &'a mut [T],
    at: usize,
}

impl<'a, T> Cut<'a, T> {
    pub(super) fn new(rest: &'a mut [T]) -> Self {
        Self { rest, at: 0 }
    }

    /// Entries `begin..end` of the whole array.
    pub(super) fn range(&mut self, begin: usize, end: usize) -> &'a mut [T] {
        let (_, from) = std::mem::take(&mut self.rest).split_at_mut(begin - self.at);
        let (range, rest) = from.split_at_mut(end - begin);
        (self.rest, self.at) = (rest, end);
        range
    }
}

/// A piece of work on a thread of a team, under the limits of who shares it out.
fn within<T>(limits: &Budget, work: impl FnOnce(&mut Pace) -> T) -> T {
    let _limits = limits.enter();
    work(&mut Pace::default())
}

/// A block, scaled, into columns of a front.
#[inline(always)]
fn scatter(
    block: &[f64],
    height: usize,
    row_scale: &[f64],
    column_scale: &[f64],
    to: &mut [f64],
    ld: usize,
) {
    let row_scale = &row_scale[..height];
    for (c, (column, scale)) in block.chunks_exact(height).zip(column_scale).enumerate() {
        let to = &mut to[c * ld..c * ld + height];
        for i in 0..height {
            to[i] = column[i] * row_scale[i] * scale;
        }
    }
}

/// Adds the rows of a child's column to its parent's column, which begins at row `first` of the front.
#[inline(always)]
fn add_runs(runs: &[Run], from: &[f64], to: &mut [f64], first: usize) {
    for run in runs {
        let (f, t, len) = (run.from as usize, run.to as usize - first, run.len as usize);
        to[t..t + len].iter_mut().zip(&from[f..f + len]).for_each(|(to, from)| *to += from);
    }
}

/// Exchanges rows in `columns` columns as `swaps` says, rows counted from `first`.
fn exchange(x: &mut [f64], part: At, columns: usize, swaps: &[u32], first: usize) {
    if swaps.iter().enumerate().all(|(j, &p)| j + first == p as usize) {
        return;
    }
    for c in 0..columns {
        let column = &mut x[part.at + c * part.ld..];
        for (j, &p) in swaps.iter().enumerate() {
            column.swap(first + j, p as usize);
        }
    }
}

/// `X ← L⁻¹ X` with the unit lower triangle of pivots `a..b`, for `n` columns of X whose row 0 is that of pivot 0.
fn left_solve(
    simd: Simd,
    (a, b): (usize, usize),
    (lower, ld): (&[f64], usize),
    triangles: &[f64],
    (x, part): (&mut [f64], At),
    n: usize,
) {
    if b - a <= WIDTH {
        let negative = &triangles[a * WIDTH..a * WIDTH + WIDTH * WIDTH];
        let rows = At { at: part.at + a, ld: part.ld };
        kernel::replace(simd, (b - a, n), negative, (x, rows));
        return;
    }
    let mid = middle(a, b);
    left_solve(simd, (a, mid), (lower, ld), triangles, (x, part), n);
    let beside = At { at: a * ld + mid, ld };
    let (done, open) = (At { at: part.at + a, ld: part.ld }, At { at: part.at + mid, ld: part.ld });
    kernel::product_below(simd, (b - mid, n, mid - a), (lower, beside), (x, done, open));
    left_solve(simd, (mid, b), (lower, ld), triangles, (x, part), n);
}

/// Operations of a product that is made in one go: some 20 ms.
const STRIP: f64 = 2e8;
/// The least columns of a strip, so that the rest of the product's operands are not read too often.
const NARROW: usize = 48;

/// Operations of a product that is worth sharing: some tenths of a millisecond.
const WORTH: f64 = 4e6;

/// Whether `columns` columns of `each` operations are shared among threads.
fn shares(columns: usize, each: f64, threads: usize) -> bool {
    threads > 1 && each * columns as f64 > WORTH && columns >= 2 * NARROW
}

/// The columns of a strip, where `columns` columns of `each` operations are cut into strips of some milliseconds; on one thread, all but the largest
/// fronts are one strip.
fn strip_width(columns: usize, each: f64, threads: usize) -> usize {
    let whole = each * columns as f64;
    let long =
        if whole <= 2.0 * STRIP { columns.max(1) } else { ((STRIP / each) as usize).max(NARROW) };
    if !shares(columns, each, threads) {
        return long;
    }
    let strips = (4 * threads).min((2.0 * whole / WORTH) as usize).max(1);
    long.min(columns.div_ceil(strips).next_multiple_of(WIDTH).max(NARROW))
}

/// Where a range of pivots is halved: at a multiple of the panel width from its start.
fn middle(a: usize, b: usize) -> usize {
    a + ((b - a) / 2).next_multiple_of(WIDTH)
}

/// The elimination of a front's pivots by halves: the left half, its effect on the right half, the right half.
struct Elimination<'a> {
    simd: Simd,
    threads: usize,
    k: usize,
    ld: usize,
    lower: &'a mut [f64],
    triangles: &'a mut [f64],
    inverses: &'a mut [f64],
    swaps: &'a mut [u32],
    outcome: Pivots,
    pace: &'a mut Pace,
}

impl Elimination<'_> {
    /// `None` where the time is over.
    fn columns(&mut self, a: usize, b: usize) -> Option<()> {
        let (simd, k, ld) = (self.simd, self.k, self.ld);
        if b - a <= WIDTH {
            self.panel(a, b);
            return Some(());
        }
        let mid = middle(a, b);
        self.columns(a, mid)?;
        let (left, right) = self.lower.split_at_mut(mid * ld);
        let columns = At { at: 0, ld };
        exchange(right, columns, b - mid, &self.swaps[a..mid], a);
        let below = At { at: a * ld + mid, ld };
        let each = ((mid - a) * (mid - a + 2 * (ld - mid))) as f64;
        let (left, triangles) = (&*left, &*self.triangles);
        let strip = |pace: &mut Pace, right: &mut [f64]| {
            let n = right.len() / ld;
            left_solve(simd, (a, mid), (left, ld), triangles, (right, At { at: 0, ld }), n);
            let (done, open) = (At { at: a, ld }, At { at: mid, ld });
            kernel::product_below(simd, (ld - mid, n, mid - a), (left, below), (right, done, open));
            (!pace.over(each * n as f64)).then_some(())
        };
        let right = &mut right[..(b - mid) * ld];
        let width = ld * strip_width(b - mid, each, self.threads);
        if shares(b - mid, each, self.threads) {
            let limits = budget::current();
            let strips = right.par_chunks_mut(width).with_max_len(1);
            strips.try_for_each(|right| within(&limits, |pace| strip(pace, right)))?;
        } else {
            right.chunks_mut(width).try_for_each(|right| strip(self.pace, right))?;
        }
        self.columns(mid, b)?;
        let columns = At { at: a * self.ld, ld: self.ld };
        exchange(self.lower, columns, mid - a, &self.swaps[mid..b], mid);
        debug_assert!(b <= k);
        Some(())
    }

    /// Eliminates pivots `a..b`, at most [`WIDTH`], in their own columns.
    fn panel(&mut self, a: usize, b: usize) {
        let (simd, k, ld) = (self.simd, self.k, self.ld);
        let diagonal = At { at: a * ld + a, ld };
        let (swaps, inverses) = (&mut self.swaps[a..b], &mut self.inverses[a..b]);
        let found = kernel::factor_panel(simd, k - a, (self.lower, diagonal), swaps, inverses);
        self.outcome.add(found);
        swaps.iter_mut().for_each(|p| *p += a as u32);
        let rest = At { at: a * ld + k, ld };
        kernel::right_solve(simd, ld - k, (self.lower, diagonal, rest), inverses);
        // −L⁻¹ of the unit triangle, column by column; entries of L are at most one.
        let w = b - a;
        let triangle = &mut self.triangles[a * WIDTH..a * WIDTH + WIDTH * WIDTH];
        for j in 0..w {
            let column = &mut triangle[j * WIDTH..j * WIDTH + WIDTH];
            column.fill(0.0);
            column[j] = -1.0;
            for p in j..w {
                let y = column[p];
                for i in p + 1..w {
                    column[i] -= self.lower[diagonal.at + p * ld + i] * y;
                }
            }
        }
    }
}

//! The dense tableau of principal pivoting: `w = M z + q` solved for one variable of each complementary pair.
//!
//! ```text
//! x_i = q̄_i + Σ_j t_ij ξ_j,    {x_i, ξ_i} = {z_i, w_i},    α = {i : x_i = z_i},    t_αα = M_αα⁻¹
//! ```
//!
//! Rows and columns are scaled by powers of two, which changes no sign and no rounding, so that tolerances may compare entries. Every `q̄_i` knows the
//! size of the terms it came from: what is below [`NEGLIGIBLE`] of that is zero. [`polish`](Tableau::polish) computes q̄ anew from the problem's data, with residuals in
//! doubled precision and `t_αα` as the approximate inverse, so that answers are as accurate as the data allow.
//!
//! Free variables of a mixed problem are solved for first: the equations are paired with them by complete pivoting on A. Where A is singular, a free
//! variable becomes basic together with a complementary one, and an equation without entries is dropped.
//!
//! References: CottlePangStone2009, sections 2.3 (principal pivotal transforms) and 4.1; Acary2018 (23)(24).
//!
//! Cost: 2n² operations a pivot. Storage: two n × n matrices.

use nonsmooth_linalg::{Compensated, Matrix, budget};
use nonsmooth_problem::check::Certificate;

use crate::SolveError;
use crate::complementarity::form::System;
use crate::core::trace::{Pivot, Recorder, Variable};

/// The largest order: beyond, two dense matrices are no longer a sensible thing to allocate.
const MOST: usize = 20_000;
/// What of q̄ is zero, in units of its terms.
const NEGLIGIBLE: f64 = 1e-11;
/// What of an entry of t is zero, as a perturbation of M.
const ZERO: f64 = 1e-13;
/// What rounding makes of refined values, in units of their terms.
const REFINED: f64 = 64.0 * f64::EPSILON;
/// How often the answer is polished and found not to be one, before the method gives up.
const POLISHES: usize = 20;

/// A row of M that refutes the problem: `q_r < 0`, `m_rj ≤ 0` for all j (and `= 0` for free variables). Lecture (19). `candidate`: a buffer.
pub fn refuting_row(system: &System, candidate: &mut Vec<bool>) -> Option<usize> {
    let free = system.free();
    candidate.clear();
    candidate.extend(system.q.iter().map(|q| *q < 0.0));
    candidate[..free].fill(false);
    let known = system.matrix.for_each(|i, j, x| {
        if x > 0.0 || (j < free && x != 0.0) {
            candidate[i] = false;
        }
    });
    known.then(|| candidate.iter().position(|c| *c)).flatten()
}

/// Powers of two that bring the largest modulus of every row and column near 1.
pub fn equilibrate(
    matrix: &Matrix,
    rows: &mut Vec<f64>,
    columns: &mut Vec<f64>,
    scratch: &mut Vec<f64>,
) {
    let (n, m) = (matrix.nrows(), matrix.ncols());
    let visit = |each: &mut dyn FnMut(usize, usize, f64)| {
        matrix.for_each(each);
    };
    equilibrate_entries(n, m, visit, rows, columns, scratch);
}

/// [`equilibrate`] of the matrix with n rows and m columns whose entries `visit` goes through.
pub fn equilibrate_entries(
    n: usize,
    m: usize,
    visit: impl Fn(&mut dyn FnMut(usize, usize, f64)),
    rows: &mut Vec<f64>,
    columns: &mut Vec<f64>,
    scratch: &mut Vec<f64>,
) {
    rows.clear();
    rows.resize(n, 1.0);
    columns.clear();
    columns.resize(m, 1.0);
    let power = |x: f64| if x > 0.0 { (0.5 * x.log2()).round().clamp(-250.0, 250.0) } else { 0.0 };
    for _ in 0..4 {
        // The largest moduli of the rows, then those of the columns.
        scratch.clear();
        scratch.resize(n + m, 0.0);
        visit(&mut |i, j, x| {
            let x = (x * rows[i] * columns[j]).abs();
            scratch[i] = scratch[i].max(x);
            scratch[n + j] = scratch[n + j].max(x);
        });
        for (factor, x) in rows.iter_mut().chain(columns.iter_mut()).zip(scratch.iter()) {
            *factor *= (-power(*x)).exp2();
        }
    }
}

/// Says when a sequence of bases repeats itself, by Brent's method: one basis is kept, and replaced after 1, 2, 4, … others.
#[derive(Debug, Clone, Default)]
pub struct Cycle {
    mark: Vec<bool>,
    since: usize,
    patience: usize,
}

impl Cycle {
    /// Begins at this basis.
    pub fn begin(&mut self, basis: &[bool]) {
        self.mark.clear();
        self.mark.extend_from_slice(basis);
        (self.since, self.patience) = (0, 1);
    }

    /// The next basis: true where the sequence has come back to the one that is kept.
    pub fn returns(&mut self, basis: &[bool]) -> bool {
        self.since += 1;
        if self.mark == basis {
            return true;
        }
        if self.since == self.patience {
            self.mark.copy_from_slice(basis);
            (self.since, self.patience) = (0, 2 * self.patience);
        }
        false
    }
}

/// What [`Tableau::polish`] found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Polished {
    /// Nothing is negative: the basis solves the problem.
    Feasible,
    /// With accurate values, something is negative after all: go on.
    Negative,
    /// As before, too often to go on.
    Exhausted,
}

/// q̄ and t of the present basis, with M and q to compute them anew from.
#[derive(Debug, Clone, Default)]
pub struct Tableau {
    n: usize,
    free: usize,
    /// Powers of two: the scaled M is `rows_i M_ij columns_j`.
    rows: Vec<f64>,
    columns: Vec<f64>,
    /// Row i is that of the problem's row `equation[i]`; other than i for equalities only.
    equation: Vec<usize>,
    /// M and q, scaled.
    m: Vec<f64>,
    q0: Vec<f64>,
    t: Vec<f64>,
    q: Vec<f64>,
    /// The size of the terms that q̄ came from.
    size: Vec<f64>,
    basic: Vec<bool>,
    /// Equations that say nothing; their free variables stay zero.
    dropped: Vec<bool>,
    /// An equation that cannot hold.
    impossible: Option<usize>,
    refuting: Option<usize>,
    since_rebuilt: usize,
    polishes: usize,
    /// How often a singular basis threw the solve back to the initial one.
    restarts: usize,
    /// Numbers the pivots of a solve.
    count: usize,
    /// The initial basis: the free variables, and what they needed.
    first: Vec<bool>,
    pivot_row: Vec<f64>,
    sizes: Vec<f64>,
    scratch: Vec<f64>,
    moved: Vec<usize>,
    set: Vec<usize>,
    from: Vec<usize>,
    wanted: Vec<bool>,
    /// The pivots, if they are wanted.
    pub record: Recorder<Pivot>,
}

impl Tableau {
    /// A tableau for a problem, its free variables basic.
    pub fn new(system: &System) -> Result<Self, SolveError> {
        let mut tableau = Self::default();
        tableau.load(system)?;
        Ok(tableau)
    }

    /// As [`new`](Self::new), in memory that is kept.
    ///
    /// Errors: an operator, too many variables, free variables that neither their equations nor pairs determine.
    pub fn load(&mut self, system: &System) -> Result<(), SolveError> {
        system.needs_entries()?;
        let n = system.dim();
        if n > MOST {
            let found = format!("{n} variables");
            return Err(SolveError::needs("at most 20000 variables: its tableau is dense", found));
        }
        budget::admit("the dense tableau", 16.0 * (n as f64) * (n as f64))?;
        (self.n, self.free) = (n, system.free());
        equilibrate(system.matrix, &mut self.rows, &mut self.columns, &mut self.scratch);
        self.equation.clear();
        self.equation.extend(0..n);
        for x in [&mut self.q0, &mut self.q, &mut self.size, &mut self.sizes, &mut self.scratch] {
            x.clear();
            x.resize(n, 0.0);
        }
        for x in [&mut self.m, &mut self.t] {
            x.clear();
            x.resize(n * n, 0.0);
        }
        // Nothing is basic at first, not even what was of an earlier problem: a restart may come before the free variables are solved for.
        for x in [&mut self.basic, &mut self.dropped, &mut self.wanted, &mut self.first] {
            x.clear();
            x.resize(n, false);
        }
        self.pivot_row.resize(n, 0.0);
        for x in [&mut self.moved, &mut self.from] {
            x.clear();
            x.resize(n, 0);
        }
        self.set.clear();
        self.set.reserve(n);
        (self.impossible, self.count, self.polishes, self.restarts) = (None, 0, 0, 0);
        self.refuting = refuting_row(system, &mut self.wanted);
        self.fill(system);
        self.reset();
        if self.free > 0 {
            self.pair_equations(system);
            self.solve_for_free()?;
        }
        self.first.clone_from(&self.basic);
        Ok(())
    }

    /// M and q, scaled, with the equations in their order.
    fn fill(&mut self, system: &System) {
        let n = self.n;
        self.moved.iter_mut().enumerate().for_each(|(k, m)| *m = k);
        for (i, &e) in self.equation.iter().enumerate() {
            self.moved[e] = i;
            self.q0[i] = system.q[e] * self.rows[e];
        }
        self.m.fill(0.0);
        let Self { m, moved, rows, columns, .. } = self;
        system.matrix.for_each(|e, j, x| m[moved[e] * n + j] = x * rows[e] * columns[j]);
    }

    /// No z is basic.
    fn reset(&mut self) {
        self.t.copy_from_slice(&self.m);
        self.q.copy_from_slice(&self.q0);
        self.size.iter_mut().zip(&self.q0).for_each(|(s, q)| *s = q.abs());
        self.basic.fill(false);
        self.since_rebuilt = 0;
    }

    /// Pairs each free variable with an equation, by complete pivoting on A: then A can be pivoted on along its diagonal.
    fn pair_equations(&mut self, system: &System) {
        let (n, f) = (self.n, self.free);
        // Elimination on a copy of A, in t.
        let (mut of_column, mut used) =
            (std::mem::take(&mut self.from), std::mem::take(&mut self.wanted));
        of_column[..f].fill(usize::MAX);
        used[..f].fill(false);
        let largest = |t: &[f64], used: &[bool], of: &[usize]| {
            let mut best = (0.0, 0, 0);
            for i in (0..f).filter(|i| !used[*i]) {
                for j in (0..f).filter(|j| of[*j] == usize::MAX) {
                    if t[i * n + j].abs() > best.0 {
                        best = (t[i * n + j].abs(), i, j);
                    }
                }
            }
            best
        };
        let first = largest(&self.t, &used, &of_column).0;
        for _ in 0..f {
            let (x, a, b) = largest(&self.t, &used, &of_column);
            if x <= 1e-12 * first || x == 0.0 {
                break;
            }
            (used[a], of_column[b]) = (true, a);
            for i in (0..f).filter(|i| !used[*i]) {
                let factor = self.t[i * n + b] / self.t[a * n + b];
                for j in 0..f {
                    self.t[i * n + j] -= factor * self.t[a * n + j];
                }
            }
        }
        let mut left = (0..f).filter(|i| !used[*i]);
        for (equation, &of) in self.equation.iter_mut().zip(&of_column[..f]) {
            *equation = if of == usize::MAX { left.next().unwrap_or(0) } else { of };
        }
        (self.from, self.wanted) = (of_column, used);
        self.fill(system);
        self.reset();
    }

    /// Makes the free variables basic.
    fn solve_for_free(&mut self) -> Result<(), SolveError> {
        loop {
            let left = (0..self.free).filter(|i| !self.basic[*i] && !self.dropped[*i]);
            let best = left.map(|i| (self.diagonal(i).abs(), i)).max_by(|a, b| a.0.total_cmp(&b.0));
            match best {
                None => return Ok(()),
                Some((x, i)) if x > 0.0 => self.exchange_diagonal(i),
                Some(_) => self.solve_with_pair()?,
            }
        }
    }

    /// The equations left have no free variable to solve for: one is made basic together with a complementary variable.
    fn solve_with_pair(&mut self) -> Result<(), SolveError> {
        let n = self.n;
        let mut best = (0.0, 0, 0);
        for i in 0..self.free {
            if self.basic[i] || self.dropped[i] {
                continue;
            }
            self.sizes_of_row(i);
            for j in (self.free..n).filter(|j| !self.basic[*j]) {
                let (there, back) = (self.t[i * n + j].abs(), self.t[j * n + i].abs());
                if there > self.threshold(j) && there.min(back) > best.0 {
                    best = (there.min(back), i, j);
                }
            }
        }
        if best.0 > 1e-9 {
            self.set.clear();
            self.set.extend([best.1, best.2]);
            if self.exchange_set() {
                return Ok(());
            }
        }
        for i in 0..self.free {
            if self.basic[i] || self.dropped[i] {
                continue;
            }
            self.sizes_of_row(i);
            let mut empty = (0..n).all(|j| {
                let silent = j < self.free && (self.basic[j] || self.dropped[j]);
                silent || self.t[i * n + j].abs() <= self.threshold(j)
            });
            self.sizes_of_column(i);
            empty &= (0..n).all(|k| {
                let silent = k < self.free && (self.basic[k] || self.dropped[k]);
                silent || self.t[k * n + i].abs() <= self.threshold(k)
            });
            if !empty {
                return Err(SolveError::needs(
                    "free variables that the equations, or these and complementary pairs, determine",
                    format!("equation {} without a pivot", self.equation[i]),
                ));
            }
            if self.q[i].abs() > 1e-9 * self.size[i] {
                self.impossible = Some(i);
            }
            self.dropped[i] = true;
        }
        Ok(())
    }

    /// n: pairs and free variables.
    pub fn dim(&self) -> usize {
        self.n
    }

    /// The first complementary index: free variables come before it.
    pub fn pairs(&self) -> std::ops::Range<usize> {
        self.free..self.n
    }

    /// Whether each z_i is basic.
    pub fn basis(&self) -> &[bool] {
        &self.basic
    }

    /// The number of pivots of this solve.
    pub fn count(&self) -> usize {
        self.count
    }

    /// q̄_i, scaled.
    #[inline]
    pub fn value(&self, i: usize) -> f64 {
        self.q[i]
    }

    /// q̄_i in the problem's units.
    #[inline]
    pub fn unscaled(&self, i: usize) -> f64 {
        self.q[i] * self.unit(i)
    }

    /// What a basic variable is to be multiplied with to have the problem's units.
    fn unit(&self, i: usize) -> f64 {
        if self.basic[i] { self.columns[i] } else { 1.0 / self.rows[self.equation[i]] }
    }

    /// The size of the terms that q̄_i came from.
    #[inline]
    pub fn value_size(&self, i: usize) -> f64 {
        self.size[i]
    }

    /// Whether q̄_i is negative beyond rounding.
    #[inline]
    pub fn is_negative(&self, i: usize) -> bool {
        i >= self.free && self.q[i] < -NEGLIGIBLE * self.size[i]
    }

    /// The least index (or the largest) with a negative q̄.
    pub fn first_negative(&self, descending: bool) -> Option<usize> {
        let mut pairs = self.pairs();
        if descending {
            pairs.rfind(|i| self.is_negative(*i))
        } else {
            pairs.find(|i| self.is_negative(*i))
        }
    }

    /// The index whose q̄ is the most negative in the problem's units, the least among equals.
    pub fn most_negative(&self) -> Option<usize> {
        let mut worst = None;
        for i in self.pairs().filter(|i| self.is_negative(*i)) {
            let value = self.unscaled(i);
            if worst.is_none_or(|(_, least)| value < least) {
                worst = Some((i, value));
            }
        }
        worst.map(|(i, _)| i)
    }

    /// How often a singular basis threw the solve back to the initial one.
    pub fn restarts(&self) -> usize {
        self.restarts
    }

    /// Whether the bases on the way are numerically singular, and it is of no use to go on.
    pub fn is_lost(&self) -> bool {
        self.restarts > 3
    }

    /// A sentence for the user.
    pub fn summary(&self) -> String {
        let basic = self.basic[self.free..].iter().filter(|b| **b).count();
        format!("{} pivots; {basic} of {} z basic in the end.", self.count, self.n - self.free)
    }

    /// Row i of t, as it was computed.
    #[inline]
    pub fn row(&self, i: usize) -> &[f64] {
        &self.t[i * self.n..(i + 1) * self.n]
    }

    /// t_ij as it was computed.
    #[inline]
    pub fn entry(&self, i: usize, j: usize) -> f64 {
        self.t[i * self.n + j]
    }

    /// How row i of t feels a perturbation of M: `‖t_iα‖₁`, and 1 for its own row where w_i is basic. M is scaled to entries of at most about 1.
    fn row_reach(&self, i: usize) -> f64 {
        let row = self.row(i).iter().zip(&self.basic);
        let own = if self.basic[i] { 0.0 } else { 1.0 };
        own + row.filter(|(_, b)| **b).map(|(t, _)| t.abs()).sum::<f64>()
    }

    /// As [`row_reach`](Self::row_reach), of column j.
    fn column_reach(&self, j: usize) -> f64 {
        let own = if self.basic[j] { 0.0 } else { 1.0 };
        let column = (0..self.n).filter(|k| self.basic[*k]).map(|k| self.t[k * self.n + j].abs());
        own + column.sum::<f64>()
    }

    /// t_ii, zero where it is no more than rounding: a perturbation E of M changes t_ij by `(t_iα, 1) E (t_αj, 1)ᵀ`.
    pub fn diagonal(&self, i: usize) -> f64 {
        let value = self.entry(i, i);
        let size = self.row_reach(i) * self.column_reach(i);
        if value.abs() <= ZERO * size { 0.0 } else { value }
    }

    /// How the entries of row i feel a perturbation of M, for [`threshold`](Self::threshold).
    pub fn sizes_of_row(&mut self, i: usize) {
        let n = self.n;
        let reach = self.row_reach(i);
        let Self { sizes, t, basic, .. } = self;
        sizes.iter_mut().zip(&*basic).for_each(|(s, b)| *s = if *b { 0.0 } else { 1.0 });
        for k in (0..n).filter(|k| basic[*k]) {
            sizes.iter_mut().zip(&t[k * n..(k + 1) * n]).for_each(|(s, t)| *s += t.abs());
        }
        sizes.iter_mut().for_each(|s| *s *= reach);
    }

    /// As [`sizes_of_row`](Self::sizes_of_row), of column j.
    pub fn sizes_of_column(&mut self, j: usize) {
        let reach = self.column_reach(j);
        for i in 0..self.n {
            self.sizes[i] = self.row_reach(i) * reach;
        }
    }

    /// Entries of the row or column last sized that are no larger are rounding.
    pub fn threshold(&self, k: usize) -> f64 {
        ZERO * self.sizes[k]
    }

    /// Whether the nonbasic variable of index j may take positive values: not the residual of an equation, nor what belongs to a dropped one.
    pub fn may_enter(&self, j: usize) -> bool {
        j >= self.free
    }

    fn entering(&self, i: usize) -> Variable {
        if self.basic[i] { Variable::W(i) } else { Variable::Z(i) }
    }

    fn leaving(&self, i: usize) -> Variable {
        if self.basic[i] { Variable::Z(i) } else { Variable::W(i) }
    }

    /// Exchanges z_i and w_i, and keeps a record of it.
    pub fn pivot(&mut self, i: usize) {
        let (entering, leaving) = (self.entering(i), self.leaving(i));
        self.exchange_diagonal(i);
        self.note(entering, leaving, i);
        self.maintain();
    }

    /// Exchanges z_i with w_j and z_j with w_i: a 2 × 2 pivot where `t_ii` is zero. False where the block is singular, and nothing done.
    pub fn pivot_pair(&mut self, i: usize, j: usize) -> bool {
        let variables =
            [(j, self.entering(j), self.leaving(i)), (i, self.entering(i), self.leaving(j))];
        self.set.clear();
        self.set.extend([i, j]);
        if !self.exchange_set() {
            return false;
        }
        for (k, entering, leaving) in variables {
            self.note(entering, leaving, k);
        }
        self.maintain();
        true
    }

    fn note(&mut self, entering: Variable, leaving: Variable, row: usize) {
        self.count += 1;
        let ratio = self.unscaled(row);
        self.record.push(Pivot { iteration: self.count, entering, leaving, ratio, z0: None });
    }

    /// From time to time the tableau is computed anew from the data.
    fn maintain(&mut self) {
        self.since_rebuilt += 1;
        if self.since_rebuilt > self.n + 100 {
            self.rebuild();
        }
    }

    fn exchange_diagonal(&mut self, i: usize) {
        self.exchange(i, i);
        self.basic[i] = !self.basic[i];
    }

    /// The basic variable of row a changes places with the nonbasic one of column b.
    fn exchange(&mut self, a: usize, b: usize) {
        let n = self.n;
        let Self { t, q, size, pivot_row, .. } = self;
        let row = &mut t[a * n..(a + 1) * n];
        let p = row[b];
        row.iter_mut().for_each(|x| *x /= -p);
        row[b] = 1.0 / p;
        pivot_row.copy_from_slice(row);
        q[a] /= -p;
        size[a] /= p.abs();
        // Of what cancelled in row a, its rounding goes on to the others, not its size.
        let (value, terms) = (q[a], q[a].abs().max(1e-3 * size[a]));
        for i in (0..n).filter(|i| *i != a) {
            let row = &mut t[i * n..(i + 1) * n];
            let factor = row[b];
            if factor != 0.0 {
                row[b] = 0.0;
                row.iter_mut().zip(&*pivot_row).for_each(|(x, p)| *x += factor * p);
                q[i] += factor * value;
                size[i] = size[i].max(factor.abs() * terms);
            }
        }
    }

    /// Exchanges every index of `set`, by complete pivoting within it. False where the block is singular: where that shows at once, nothing is done,
    /// else the tableau is that of the initial basis.
    fn exchange_set(&mut self) -> bool {
        let n = self.n;
        for &k in &self.set {
            (self.moved[k], self.from[k]) = (usize::MAX, usize::MAX);
        }
        let mut first = 0.0;
        for step in 0..self.set.len() {
            let mut best = (0.0, 0, 0);
            for &a in self.set.iter().filter(|a| self.moved[**a] == usize::MAX) {
                for &b in self.set.iter().filter(|b| self.from[**b] == usize::MAX) {
                    let x = self.t[a * n + b].abs();
                    if x > best.0 {
                        best = (x, a, b);
                    }
                }
            }
            let (x, a, b) = best;
            if step == 0 {
                first = x;
            }
            // Where the time is over all ends here, and whoever looks next says so.
            if x.is_nan() || x <= 1e-14 * first || budget::over() {
                if step > 0 {
                    self.restart();
                }
                return false;
            }
            self.exchange(a, b);
            (self.moved[a], self.from[b]) = (b, a);
        }
        // Row a holds the variable of index moved[a], column b that of index from[b]: both go to their places.
        for k in 0..self.set.len() {
            let a = self.set[k];
            while self.moved[a] != a {
                let b = self.moved[a];
                let (head, tail) = self.t.split_at_mut(a.max(b) * n);
                head[a.min(b) * n..][..n].swap_with_slice(&mut tail[..n]);
                self.q.swap(a, b);
                self.size.swap(a, b);
                self.moved.swap(a, b);
            }
        }
        for k in 0..self.set.len() {
            let b = self.set[k];
            while self.from[b] != b {
                let a = self.from[b];
                (0..n).for_each(|i| self.t.swap(i * n + a, i * n + b));
                self.from.swap(a, b);
            }
        }
        for &i in &self.set {
            self.basic[i] = !self.basic[i];
        }
        true
    }

    /// Back to the initial basis.
    fn restart(&mut self) {
        self.restarts += 1;
        let first = std::mem::take(&mut self.first);
        self.reset();
        self.adopt(&first);
        self.first = first;
    }

    /// Pivots to the basis where the z of `wanted` are basic, from data; passes over what makes it singular. The free variables and what they need
    /// come first.
    fn adopt(&mut self, wanted: &[bool]) {
        // The largest diagonal entry first, as in a Cholesky factorisation with pivoting. A basis that the end of the time leaves unfinished is one all the same.
        while !budget::over() {
            let n = self.n;
            let left = || (0..n).filter(|i| wanted[*i] && !self.basic[*i]);
            let cheap = left().map(|i| (self.t[i * n + i].abs(), i));
            let best = cheap.max_by(|a, b| a.0.total_cmp(&b.0));
            let Some((_, i)) = best else { break };
            if self.diagonal(i) != 0.0 {
                self.exchange_diagonal(i);
                continue;
            }
            // Nothing on the diagonal: a pair, or the end.
            let mut pair = (1e-9, 0, 0);
            for i in left() {
                for j in left().filter(|j| *j > i) {
                    let x = self.t[i * n + j].abs().min(self.t[j * n + i].abs());
                    if x > pair.0 {
                        pair = (x, i, j);
                    }
                }
            }
            let (x, i, j) = pair;
            if x <= 1e-9 {
                break;
            }
            self.set.clear();
            self.set.extend([i, j]);
            if !self.exchange_set() {
                break;
            }
        }
    }

    /// Takes the basis that a point suggests.
    pub fn warm(&mut self, system: &System, z: &[f64]) {
        let n = self.n;
        (self.count, self.polishes) = (0, 0);
        self.restarts = 0;
        if z.iter().any(|z| !z.is_finite()) || z[self.free..].iter().all(|z| *z <= 0.0) {
            if self.basic != self.first {
                self.restart();
                self.restarts = 0;
            }
            return;
        }
        system.matrix.mul(z, &mut self.scratch);
        let mut wanted = std::mem::take(&mut self.wanted);
        wanted.clone_from(&self.first);
        for i in self.free..n {
            let w = (self.scratch[i] + system.q[i]) * self.rows[i];
            let z = z[i] / self.columns[i];
            wanted[i] |= z > 0.0 && z > w;
        }
        self.reset();
        self.adopt(&wanted);
        // What the free variables need goes before what the point suggests.
        if (0..n).any(|i| self.first[i] && !self.basic[i]) {
            self.restart();
        }
        self.restarts = 0;
        self.wanted = wanted;
    }

    /// The same basis, computed anew from the data. False where it is singular: then the tableau is that of the initial basis.
    pub fn rebuild(&mut self) -> bool {
        self.set.clear();
        let basic = &self.basic;
        self.set.extend((0..self.n).filter(|i| basic[*i]));
        self.reset();
        let regular = self.set.is_empty() || self.exchange_set();
        self.since_rebuilt = 0;
        regular
    }

    /// q̄ from the problem's data as accurately as they allow, and whether anything is negative then.
    pub fn polish(&mut self) -> Polished {
        self.polishes += 1;
        if !(self.refine() || self.rebuild() && self.refine()) {
            return Polished::Exhausted;
        }
        if !(self.free..self.n).any(|i| self.is_negative(i)) {
            return Polished::Feasible;
        }
        if self.polishes > POLISHES { Polished::Exhausted } else { Polished::Negative }
    }

    /// Before a tableau says something unpleasant: the same basis anew from the data, where it has seen pivots since the last time. False where that has been
    /// done already, or too often.
    pub fn freshen(&mut self) -> bool {
        if self.since_rebuilt == 0 || self.polishes > POLISHES {
            return false;
        }
        self.polishes += 1;
        if self.rebuild() {
            self.refine();
        }
        true
    }

    /// Iterative refinement of the basic z, then w of the others; q̄ and its sizes become those of accurate values. False where it does not converge.
    fn refine(&mut self) -> bool {
        let n = self.n;
        let Self { set, basic, m, t, q, q0, size, scratch, sizes, .. } = self;
        set.clear();
        set.extend((0..n).filter(|i| basic[*i]));
        let mut last = f64::INFINITY;
        let mut converged = set.is_empty();
        for _ in 0..20 {
            // The residual M_αα z_α + q_α, and the size of its terms.
            for &k in set.iter() {
                let row = &m[k * n..(k + 1) * n];
                let mut sum = Compensated::from(q0[k]);
                let mut terms = q0[k].abs();
                for &j in set.iter() {
                    sum.add_product(row[j], q[j]);
                    terms += (row[j] * q[j]).abs();
                }
                (scratch[k], sizes[k]) = (sum.value(), terms);
            }
            let (mut largest, mut finite) = (0.0_f64, true);
            for &i in set.iter() {
                let row = &t[i * n..(i + 1) * n];
                let correction: f64 = set.iter().map(|&k| row[k] * scratch[k]).sum();
                q[i] -= correction;
                let terms = set.iter().map(|&k| (row[k] * sizes[k]).abs()).sum::<f64>();
                size[i] = REFINED / NEGLIGIBLE * terms;
                // In units of the component's own rounding: small components converge too.
                let unit = 4.0 * f64::EPSILON * terms;
                finite &= correction.is_finite() && unit.is_finite();
                largest = largest.max(if unit > 0.0 { correction.abs() / unit } else { 0.0 });
            }
            if !finite {
                break;
            }
            if largest <= 1.0 {
                converged = true;
                break;
            }
            if largest > 0.5 * last {
                break;
            }
            last = largest;
        }
        for i in (0..n).filter(|i| !basic[*i]) {
            let row = &m[i * n..(i + 1) * n];
            let mut sum = Compensated::from(q0[i]);
            let mut terms = q0[i].abs();
            for &j in set.iter() {
                sum.add_product(row[j], q[j]);
                terms += (row[j] * q[j]).abs();
            }
            // What the rounding of z_α does to w_i: t_iα times that of the residuals.
            let row = &t[i * n..(i + 1) * n];
            terms += set.iter().map(|&k| (row[k] * sizes[k]).abs()).sum::<f64>();
            q[i] = sum.value();
            size[i] = REFINED / NEGLIGIBLE * terms;
        }
        converged
    }

    /// The point of the basis: `z_α = q̄_α`, what is negative set to zero.
    pub fn write(&self, z: &mut [f64]) {
        for (i, z) in z.iter_mut().enumerate() {
            let value = if self.basic[i] { self.q[i] * self.columns[i] } else { 0.0 };
            *z = if i < self.free { value } else { value.max(0.0) };
        }
    }

    /// A proof that was seen before the first pivot: a row that is always negative, an equation that cannot hold.
    pub fn refuted(&mut self) -> Option<Certificate> {
        let row = self.refuting.map(|row| Certificate::Row { row });
        row.or_else(|| {
            let i = self.impossible?;
            let mut proof = self.farkas(i);
            // An equation may be taken with either sign.
            if let (Certificate::Farkas { y }, true) = (&mut proof, self.q[i] > 0.0) {
                y.iter_mut().for_each(|y| *y = -*y);
            }
            Some(proof)
        })
    }

    /// The combination of rows that row i of the tableau is. Where `q̄_i < 0` and no entry of the row is positive, it proves that there is no solution.
    ///
    /// Row i says `x_i − Σ_j t_ij ξ_j = q̄_i`, which is `yᵀ(w − M z) = yᵀ q` with `y_k` the coefficient of `w_k`.
    pub fn farkas(&mut self, i: usize) -> Certificate {
        let n = self.n;
        let Self { set, basic, m, t, scratch, sizes, .. } = self;
        set.clear();
        set.extend((0..n).filter(|k| basic[*k]));
        let row = &t[i * n..(i + 1) * n];
        let y = sizes;
        y.fill(0.0);
        set.iter().for_each(|&k| y[k] = -row[k]);
        let own = if basic[i] { None } else { Some(i) };
        if let Some(i) = own {
            y[i] = 1.0;
        }
        // Refined: the coefficient of every basic z_j, −(Mᵀ y)_j, is 1 of z_i and 0 of the others.
        for _ in 0..3 {
            for &j in set.iter() {
                let mut sum = Compensated::from(if j == i { -1.0 } else { 0.0 });
                set.iter().chain(own.iter()).for_each(|&k| sum.add_product(-m[k * n + j], y[k]));
                scratch[j] = sum.value();
            }
            // y_α ← y_α + t_ααᵀ (what is missing).
            for &k in set.iter() {
                y[k] += set.iter().map(|&j| t[j * n + k] * scratch[j]).sum::<f64>();
            }
        }
        let mut out = vec![0.0; n];
        for k in 0..n {
            let keep = k < self.free || y[k] > 0.0;
            let e = self.equation[k];
            out[e] = if keep { y[k] * self.rows[e] } else { 0.0 };
        }
        Certificate::Farkas { y: out }
    }
}

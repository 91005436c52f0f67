//! Branch and bound over the cones of a [`ConeSystem`], in exact arithmetic.
//!
//! Problem: `Σ t_j A_j = b` with t_j free, nonnegative, or nonnegative and one of a pair of which one is zero.
//!
//! Method: without the pairs' condition it is a linear program, which the simplex method decides: a point, or a vector y with `yᵀ A_j ≥ 0` for all columns
//! and `yᵀ b < 0`. Where both columns of a pair are positive at the point there are two cases, one without each; a case goes on from the tableau of the case before,
//! in which the column that it excludes is one of those to be driven out. A case without a point is closed by its y.
//!
//! The tableau holds integers with one common denominator, so a pivot divides without remainder (Edmonds' and Bareiss' elimination): no greatest
//! common divisors. Rows and columns are first divided by what they have in common, so exact scalings cost nothing.
//!
//! Cost: at most 2ᵐ cases for m pairs; a pivot is rows · columns products of integers of rows · 53 bits at most. Storage: a tableau for each open case.

use std::cmp::Ordering;
use std::sync::{Arc, Mutex, PoisonError};

use dashu_int::ops::{BitTest, Gcd, UnsignedAbs};
use dashu_int::{IBig, UBig};
use nonsmooth_linalg::budget;
use nonsmooth_problem::Problem;
use nonsmooth_problem::check::{
    Certificate, ConeSystem, Evidence, Exact, ExactVector, Proof, rounded,
};

use crate::core::status::is_final;
use crate::{Limits, Outcome, Status};

/// How the enumeration ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Found {
    /// The coefficients t of a solution.
    Solution(Vec<Exact>),
    /// No case has a point: the vectors that close them.
    Nothing(Vec<ExactVector>),
}

/// The search.
#[derive(Debug, Clone)]
pub struct ExactCones {
    system: ConeSystem,
    /// `A'_ij = ρ_i A_ij κ_j`, `b'_i = ρ_i b_i β`.
    rho: Vec<Exact>,
    kappa: Vec<Exact>,
    beta: Exact,
    open: Vec<Case>,
    vectors: Vec<ExactVector>,
    /// Cases looked at.
    pub cases: usize,
    /// Products of machine words, about, and how many are allowed.
    work: u64,
    allowed: u64,
    cut: bool,
}

/// A case: which columns are excluded, and the tableau on which it goes on. Columns: those of A, the rows' units, b.
#[derive(Debug, Clone)]
pub struct Case {
    rows: Vec<Vec<IBig>>,
    denominator: IBig,
    basis: Vec<usize>,
    excluded: Vec<bool>,
    work: u64,
}

/// Everything in a case: convex combinations of the points, plus nonnegative multiples of the rays, plus any multiples of the lines. All are coefficients t,
/// followed by 1 for a point and 0 for a direction.
#[derive(Debug, Clone)]
pub struct ExactFace {
    /// The extreme points, where coefficients that others determine up to the lines are zero.
    pub points: Vec<Vec<Exact>>,
    /// The extreme rays.
    pub rays: Vec<Vec<Exact>>,
    /// Independent of each other.
    pub lines: Vec<Vec<Exact>>,
    /// Lines included.
    pub dimension: usize,
    /// Columns that are not excluded.
    pub allowed: Vec<bool>,
    /// Columns that are not zero everywhere; of free ones nothing is said.
    pub support: Vec<bool>,
}

impl ExactCones {
    /// Begins a search of any length.
    pub fn new(system: ConeSystem) -> Self {
        Self::within(u64::MAX, system)
    }

    /// Begins a search that ends, see [`is_cut_short`](Self::is_cut_short), when it has cost about so many products of machine words: some 10⁸ of them a second.
    pub fn within(allowed: u64, system: ConeSystem) -> Self {
        let (m, n) = (system.rhs.len(), system.columns.len());
        let mut a = vec![vec![Exact::ZERO; n + 1]; m];
        for (j, column) in system.columns.iter().enumerate() {
            for (i, x) in column {
                a[*i][j] += x;
            }
        }
        for (i, b) in system.rhs.iter().enumerate() {
            a[i][n] = b.clone();
        }
        let mut rho = vec![Exact::ONE; m];
        let mut kappa = vec![Exact::ONE; n + 1];
        // Twice: a row's factor changes what the columns have in common.
        for _ in 0..2 {
            // Where time is over what follows is of no use, and the search is cut short.
            for (row, rho) in a.iter_mut().zip(&mut rho).take_while(|_| !budget::over()) {
                let factor = common(row.iter());
                row.iter_mut().for_each(|x| *x = &*x / &factor);
                *rho = &*rho / &factor;
            }
            for (j, kappa) in kappa.iter_mut().enumerate().take_while(|_| !budget::over()) {
                let factor = common(a.iter().map(|row| &row[j]));
                a.iter_mut().for_each(|row| row[j] = &row[j] / &factor);
                *kappa = &*kappa / &factor;
            }
        }
        // Columns may have become fractions again.
        for (row, rho) in a.iter_mut().zip(&mut rho) {
            let factor = common(row.iter());
            row.iter_mut().for_each(|x| *x = &*x / &factor);
            *rho = &*rho / &factor;
        }
        let beta = kappa.pop().unwrap_or(Exact::ONE);
        let mut case = Case {
            rows: a
                .into_iter()
                .enumerate()
                .map(|(i, mut row)| {
                    let b = row.pop().unwrap_or(Exact::ZERO);
                    let units = (0..m).map(|k| if k == i { IBig::ONE } else { IBig::ZERO });
                    let whole = |x: Exact| x.into_parts().0;
                    row.into_iter().map(whole).chain(units).chain([whole(b)]).collect()
                })
                .collect(),
            denominator: IBig::ONE,
            basis: (n..n + m).collect(),
            excluded: (0..n + m).map(|j| j >= n).collect(),
            work: 0,
        };
        let entered = case.enter_free(&system.free, n) && !budget::over();
        let mut search = Self {
            system,
            rho,
            kappa,
            beta,
            open: vec![],
            vectors: vec![],
            cases: 0,
            work: 0,
            allowed,
            cut: !entered,
        };
        search.close_or_open(case);
        search
    }

    /// As [`within`](Self::within), of a search near a point with these unknowns: of each pair the column that is as good as zero there is left out, and cases remain only where both are.
    /// That nothing is found says nothing of the system itself.
    pub fn near(allowed: u64, mut system: ConeSystem, unknowns: &[f64]) -> Self {
        for j in vanishing(&system, unknowns) {
            system.columns[j].clear();
        }
        Self::within(allowed, system)
    }

    /// Whether a limit ended the search, which then finds nothing any more.
    pub fn is_cut_short(&self) -> bool {
        self.cut
    }

    /// Looks at one more case; `None` while there are others.
    pub fn advance(&mut self) -> Option<Found> {
        if self.cut {
            return None;
        }
        let Some(case) = self.open.pop() else {
            return Some(Found::Nothing(std::mem::take(&mut self.vectors)));
        };
        self.cases += 1;
        let Some(pair) = self.conflict(&case) else {
            return Some(Found::Solution(self.coefficients(&case)));
        };
        for j in pair {
            let mut without = case.clone();
            without.excluded[j] = true;
            self.close_or_open(without);
        }
        None
    }

    /// A pair of which both columns are positive at the point of a case.
    pub fn conflict(&self, case: &Case) -> Option<[usize; 2]> {
        let positive = |j: usize| case.row_of(j).is_some_and(|i| *case.value(i) > IBig::ZERO);
        self.system.pairs.iter().find(|p| p.iter().all(|&j| positive(j))).copied()
    }

    /// A pair of which neither column is excluded from a case.
    pub fn undecided(&self, case: &Case) -> Option<[usize; 2]> {
        self.system.pairs.iter().find(|p| p.iter().all(|&j| !case.excluded[j])).copied()
    }

    /// The case that a search begins with, taken out of it, for whoever goes through all cases: `None` where it has no point, and where a limit ended the search.
    pub fn root(&mut self) -> Option<Case> {
        self.open.pop()
    }

    /// A case where these columns are excluded as well: `None` where it has no point, and where a limit ended the search.
    pub fn without(&mut self, case: &Case, columns: &[usize]) -> Option<Case> {
        let mut case = case.clone();
        columns.iter().for_each(|&j| case.excluded[j] = true);
        self.drive_out(&mut case);
        (!self.cut && case.has_point()).then_some(case)
    }

    /// Everything in a case in which all pairs are decided and that has a point. `None` where there are more than `most` extreme points and rays, and where a
    /// limit ended the search.
    ///
    /// Method: of the variables that are not basic any nonnegative values satisfy the equations: a cone, once b has a coefficient s ≥ 0 of its own. The basic ones are made
    /// nonnegative one by one (double description).
    ///
    /// Cost: in each of these steps the square of the number of extreme points and rays, times that number.
    pub fn face(&mut self, case: &Case, most: usize) -> Option<ExactFace> {
        let n = self.system.columns.len();
        let mut bounded = vec![true; n];
        self.system.free.iter().for_each(|&j| bounded[j] = false);
        let mut case = case.clone();
        let found = case.generators(&bounded, most);
        self.cut |= found.is_none() && budget::over();
        let generators = found?;
        let mut support = vec![false; n];
        for x in &generators {
            support.iter_mut().zip(x).for_each(|(s, x)| *s |= !x.is_zero());
        }
        let allowed = (0..n).map(|j| !case.excluded[j]).collect();
        // What is zero everywhere leaves as many variables as there are dimensions.
        (0..n).for_each(|j| case.excluded[j] |= bounded[j] && !support[j]);
        if !case.dismiss(&bounded) {
            self.cut = true;
            return None;
        }
        // Free columns that depend on the others: no case has them in its basis.
        let dependent = (0..n).filter(|&j| !bounded[j] && case.row_of(j).is_none());
        let lines: Vec<_> = dependent.map(|j| self.unscaled(&case.direction(j))).collect();
        let dimension = case.entering(&bounded).count() + lines.len();
        let (points, rays): (Vec<_>, Vec<_>) =
            generators.iter().map(|x| self.unscaled(x)).partition(|x| !x[n].is_zero());
        Some(ExactFace { points, rays, lines, dimension, allowed, support })
    }

    /// The coefficients t of a vector over the scaled columns and b; of a point, where that of b is not zero.
    fn unscaled(&self, x: &[IBig]) -> Vec<Exact> {
        let (x, last) = x.split_at(self.kappa.len());
        let part = match Exact::from(last[0].clone()) {
            zero if zero.is_zero() => Exact::ONE,
            b => b * &self.beta,
        };
        let coefficient = |(x, kappa): (&IBig, &Exact)| Exact::from(x.clone()) * kappa / &part;
        let is_point = if last[0].is_zero() { Exact::ZERO } else { Exact::ONE };
        x.iter().zip(&self.kappa).map(coefficient).chain([is_point]).collect()
    }

    fn drive_out(&mut self, case: &mut Case) {
        let left = self.allowed.saturating_sub(self.work);
        self.cut = self.cut || !case.drive_out(self.system.columns.len(), &self.system.free, left);
        self.work += std::mem::take(&mut case.work);
    }

    /// Whether a point is left to be looked at.
    fn close_or_open(&mut self, mut case: Case) {
        self.drive_out(&mut case);
        if self.cut {
            return;
        }
        match case.closing(self.system.columns.len()) {
            None => self.open.push(case),
            Some(y) => {
                let scaled = y.into_iter().zip(&self.rho).map(|(y, rho)| Exact::from(y) * rho);
                self.vectors.push(ExactVector(scaled.collect()));
            }
        }
    }

    /// The problem that is searched.
    pub fn system(&self) -> &ConeSystem {
        &self.system
    }

    fn coefficients(&self, case: &Case) -> Vec<Exact> {
        let denominator = Exact::from(case.denominator.clone());
        let n = self.system.columns.len();
        let mut t = vec![Exact::ZERO; n];
        for (i, &j) in case.basis.iter().enumerate().filter(|(_, j)| **j < n) {
            let value = Exact::from(case.value(i).clone());
            t[j] = value / &denominator * &self.kappa[j] / &self.beta;
        }
        t
    }
}

/// Rows and columns beyond which a problem in exact numbers is not searched: the tableau alone would take seconds.
pub const LARGE: [usize; 2] = [250, 1500];

/// The proof that a problem has no solution, where a search of this cost, see [`ExactCones::within`], finds one. Of nonlinear problems, and of contact in space, a relaxation is searched.
pub fn refuted<P: Problem>(problem: &P, allowed: u64) -> Option<Proof> {
    let system = problem.cones()?;
    if system.rhs.len() > LARGE[0] || system.columns.len() > LARGE[1] {
        return None;
    }
    let mut search = ExactCones::within(allowed, system);
    while !search.is_cut_short() {
        match search.advance() {
            None => {}
            Some(Found::Solution(_)) => return None,
            Some(Found::Nothing(vectors)) => {
                return match problem.evidence(&Certificate::Separating { vectors }) {
                    Evidence::Proved(proof) => Some(proof),
                    _ => None,
                };
            }
        }
    }
    None
}

/// What a plan of solvers has come upon by [`refuted`], for the session that follows it.
#[derive(Debug, Clone, Default)]
pub struct Refutation(Arc<Mutex<Option<Proof>>>);

impl Refutation {
    /// Looks for a proof, and keeps it; whether there is one that ends the search for a point at the default tolerance.
    pub fn search<P: Problem>(&self, problem: &P, allowed: u64) -> bool {
        let found = refuted(problem, allowed);
        let is = found.as_ref().is_some_and(|proof| is_final(proof, Limits::default().tolerance));
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = found;
        is
    }

    /// Forgets what an earlier solve has found.
    pub fn clear(&self) {
        self.take();
    }

    /// Makes the proof that was found, if any, the status of an outcome that is no solution; whether it did.
    pub fn settle(&self, outcome: &mut Outcome) -> bool {
        match self.take() {
            Some(proof) if outcome.status != Status::Solved => {
                outcome.status = Status::Infeasible(proof);
                true
            }
            _ => false,
        }
    }

    fn take(&self) -> Option<Proof> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

/// Whether the solution of a problem with these coefficients passes the check when it is rounded to doubles, at the default tolerance.
pub fn is_representable<P: Problem>(problem: &P, system: &ConeSystem, t: &[Exact]) -> bool {
    let point = problem.assembled(&system.unknowns_at(t));
    problem.validate_point(&point).is_ok()
        && problem.gauge().is_ok_and(|mut gauge| {
            problem.certify(&point, &mut gauge).passes(Limits::default().tolerance)
        })
}

/// A partner is as good as zero where it is so much smaller than the other one.
const SMALLER: f64 = 1e-6;

/// Of each pair the column, if any, that is as good as zero where the problem's unknowns are these.
fn vanishing(system: &ConeSystem, unknowns: &[f64]) -> Vec<usize> {
    let mut t: Vec<Option<f64>> = vec![None; system.columns.len()];
    // Columns that are an unknown itself, shifted.
    for ((constant, terms), x) in system.unknowns.iter().zip(unknowns) {
        if let [(j, factor)] = &terms[..] {
            t[*j] = Some((x - rounded(constant)) / rounded(factor));
        }
    }
    let mut left: Vec<f64> = system.rhs.iter().map(rounded).collect();
    for (t, column) in t.iter().zip(&system.columns) {
        let value = t.unwrap_or(0.0);
        column.iter().for_each(|(i, x)| left[*i] -= value * rounded(x));
    }
    // The others are slacks of one row: the one with the sign of what is left takes it.
    for (t, column) in t.iter_mut().zip(&system.columns) {
        if let (None, [(i, x)]) = (&t, &column[..]) {
            *t = Some((left[*i] / rounded(x)).max(0.0));
        }
    }
    let size = |j: usize| {
        let largest = system.columns[j].iter().map(|(_, x)| rounded(x).abs()).fold(0.0, f64::max);
        t[j].map(|t| t.abs() * largest)
    };
    let smaller = |&[a, b]: &[usize; 2]| {
        let (of_a, of_b) = (size(a)?, size(b)?);
        match () {
            () if of_a < SMALLER * of_b => Some(a),
            () if of_b < SMALLER * of_a => Some(b),
            () => None,
        }
    };
    system.pairs.iter().filter_map(smaller).collect()
}

/// A positive number such that all x over it are whole and have nothing in common: the greatest common divisor of the numerators over the least common
/// multiple of the denominators.
fn common<'a>(x: impl Iterator<Item = &'a Exact>) -> Exact {
    let mut divisor = UBig::ZERO;
    let mut multiple = UBig::ONE;
    for x in x.filter(|x| !x.is_zero()) {
        let (numerator, denominator) = x.clone().into_parts();
        let size = numerator.unsigned_abs();
        divisor = if divisor.is_zero() { size } else { divisor.gcd(size) };
        multiple = &multiple / (&multiple).gcd(&denominator) * denominator;
    }
    if divisor.is_zero() { Exact::ONE } else { Exact::from_parts(divisor.into(), multiple) }
}

/// Over the greatest common divisor.
fn primitive(mut x: Vec<IBig>) -> Vec<IBig> {
    let sizes = x.iter().filter(|x| !x.is_zero()).map(UnsignedAbs::unsigned_abs);
    let divisor = sizes.reduce(Gcd::gcd).unwrap_or(UBig::ONE);
    if !divisor.is_one() {
        x.iter_mut().for_each(|x| *x = std::mem::take(x) / &divisor);
    }
    x
}

/// Pivots by the largest coefficient before Bland's rule, which cannot cycle.
const DANTZIG: usize = 50;

impl Case {
    fn value(&self, row: usize) -> &IBig {
        &self.rows[row][self.excluded.len()]
    }

    fn row_of(&self, column: usize) -> Option<usize> {
        self.basis.iter().position(|&j| j == column)
    }

    /// Free columns into the basis, as far as they are independent, then every other row with a nonnegative right-hand side. False where a limit ended that.
    fn enter_free(&mut self, free: &[usize], n: usize) -> bool {
        for &j in free {
            let candidate =
                (0..self.rows.len()).find(|&i| self.basis[i] >= n && !self.rows[i][j].is_zero());
            if candidate.is_some_and(|i| !self.pivot(i, j)) {
                return false;
            }
        }
        for i in 0..self.rows.len() {
            // The row's unit stands for an artificial column with the sign that makes its value nonnegative.
            if self.basis[i] >= n && *self.value(i) < IBig::ZERO {
                self.rows[i].iter_mut().for_each(|x| *x = -std::mem::take(x));
            }
        }
        true
    }

    /// False where a limit ended it: the tableau is of no use then.
    fn pivot(&mut self, row: usize, column: usize) -> bool {
        let pivot = self.rows[row][column].clone();
        let chosen = std::mem::take(&mut self.rows[row]);
        for other in self.rows.iter_mut().filter(|r| !r.is_empty()) {
            if budget::over() {
                return false;
            }
            let factor = other[column].clone();
            for (x, y) in other.iter_mut().zip(&chosen) {
                let mut product = &*x * &pivot;
                if !factor.is_zero() && !y.is_zero() {
                    product -= &factor * y;
                }
                *x = if product.is_zero() { product } else { product / &self.denominator };
            }
        }
        let words = 1 + self.denominator.bit_len().max(pivot.bit_len()) as u64 / 64;
        self.work += (self.rows.len() * chosen.len()) as u64 * words;
        self.rows[row] = chosen;
        self.basis[row] = column;
        self.denominator = pivot;
        if self.denominator < IBig::ZERO {
            self.denominator = -std::mem::take(&mut self.denominator);
            self.rows.iter_mut().flatten().for_each(|x| *x = -std::mem::take(x));
        }
        true
    }

    /// Which rows hold a column that is to be driven out.
    fn excluded_rows(&self) -> Vec<usize> {
        (0..self.rows.len()).filter(|&i| self.excluded[self.basis[i]]).collect()
    }

    /// Lowers the sum of the excluded columns' values as far as it goes; false where a limit ended that, or it cost more than `allowed`.
    fn drive_out(&mut self, n: usize, free: &[usize], allowed: u64) -> bool {
        let mut is_free = vec![false; self.excluded.len()];
        free.iter().for_each(|&j| is_free[j] = true);
        let mut pivots = 0;
        loop {
            if self.has_point() {
                return true;
            }
            let rows = self.excluded_rows();
            if self.work > allowed || budget::over() {
                return false;
            }
            let gain = |j: usize| rows.iter().fold(IBig::ZERO, |sum, &i| sum + &self.rows[i][j]);
            let mut entering: Option<(usize, IBig)> = None;
            for j in (0..n).filter(|&j| !self.excluded[j] && !is_free[j]) {
                let gain = gain(j);
                if gain <= IBig::ZERO {
                    continue;
                }
                if entering.as_ref().is_none_or(|(_, best)| gain > *best) {
                    entering = Some((j, gain));
                }
                if pivots >= DANTZIG {
                    break;
                }
            }
            let Some((j, _)) = entering else { return true };
            // The least ratio; among equals excluded columns leave first, then Bland's rule.
            let mut leaving: Option<usize> = None;
            for i in 0..self.rows.len() {
                if is_free[self.basis[i]] || self.rows[i][j] <= IBig::ZERO {
                    continue;
                }
                let better = leaving.is_none_or(|k| {
                    let ours = self.value(i) * &self.rows[k][j];
                    let theirs = self.value(k) * &self.rows[i][j];
                    let rank = |i: usize| (!self.excluded[self.basis[i]], self.basis[i]);
                    ours < theirs || (ours == theirs && rank(i) < rank(k))
                });
                if better {
                    leaving = Some(i);
                }
            }
            let Some(i) = leaving else { return true };
            if !self.pivot(i, j) {
                return false;
            }
            pivots += 1;
        }
    }

    /// Columns that may enter the basis.
    fn entering<'a>(&'a self, bounded: &'a [bool]) -> impl Iterator<Item = usize> + 'a {
        let enters = |&j: &usize| bounded[j] && !self.excluded[j] && self.row_of(j).is_none();
        (0..bounded.len()).filter(enters)
    }

    /// Takes excluded columns, whose values are zero, out of the basis: where one stays its row says 0 = 0. False where a limit ended that.
    fn dismiss(&mut self, bounded: &[bool]) -> bool {
        for i in 0..self.rows.len() {
            if !self.excluded[self.basis[i]] {
                continue;
            }
            let column = self.entering(bounded).find(|&j| !self.rows[i][j].is_zero());
            if column.is_some_and(|j| !self.pivot(i, j)) {
                return false;
            }
        }
        true
    }

    /// How all variables move with the one of this column, or, beyond the last one, with b; b last.
    fn direction(&self, column: usize) -> Vec<IBig> {
        let n = self.excluded.len() - self.rows.len();
        let (place, sign) = match column {
            j if j < n => (j, -IBig::ONE),
            _ => (self.excluded.len(), IBig::ONE),
        };
        let mut x = vec![IBig::ZERO; n + 1];
        x[column.min(n)] = self.denominator.clone();
        for (row, &j) in self.rows.iter().zip(&self.basis) {
            if j < n && !self.excluded[j] {
                x[j] = &row[place] * &sign;
            }
        }
        primitive(x)
    }

    /// The extreme rays of `{(t, s) ≥ 0: A t = b s}`, where free columns may have any sign; see [`ExactCones::face`].
    fn generators(&mut self, bounded: &[bool], most: usize) -> Option<Vec<Vec<IBig>>> {
        if !self.dismiss(bounded) {
            return None;
        }
        let n = bounded.len();
        let simplicial: Vec<usize> = self.entering(bounded).chain([n]).collect();
        let pending: Vec<usize> = self
            .basis
            .iter()
            .copied()
            .filter(|&j| j < n && bounded[j] && !self.excluded[j])
            .collect();
        // Bits of a number say which of the inequalities are equalities.
        if simplicial.len() + pending.len() > u128::BITS as usize {
            return None;
        }
        let all: u128 = simplicial.iter().enumerate().fold(0, |all, (k, _)| all | 1 << k);
        let first = simplicial.iter().enumerate();
        let mut rays: Vec<(Vec<IBig>, u128)> =
            first.map(|(k, &j)| (self.direction(j), all ^ 1 << k)).collect();
        for (k, &j) in pending.iter().enumerate() {
            let bit = 1 << (simplicial.len() + k);
            let sign = |ray: &(Vec<IBig>, u128)| ray.0[j].cmp(&IBig::ZERO);
            let of = |wanted: Ordering| {
                (0..rays.len()).filter(|&r| sign(&rays[r]) == wanted).collect::<Vec<_>>()
            };
            let (above, below) = (of(Ordering::Greater), of(Ordering::Less));
            let mut between = vec![];
            for (&a, &b) in above.iter().flat_map(|a| below.iter().map(move |b| (a, b))) {
                if budget::over() || rays.len() + between.len() > 2 * most {
                    return None;
                }
                let zeros = rays[a].1 & rays[b].1;
                // Neighbours: no third one is on all the walls that they share.
                let on_all = |(r, ray): (usize, &(Vec<IBig>, u128))| {
                    r != a && r != b && ray.1 & zeros == zeros
                };
                if rays.iter().enumerate().any(on_all) {
                    continue;
                }
                let (up, down) = (&rays[a].0, &rays[b].0);
                let x = up.iter().zip(down).map(|(u, d)| d * &up[j] - u * &down[j]).collect();
                between.push((primitive(x), zeros | bit));
            }
            rays.iter_mut().filter(|r| r.0[j].is_zero()).for_each(|r| r.1 |= bit);
            rays.retain(|r| r.0[j] >= IBig::ZERO);
            rays.append(&mut between);
            if rays.len() > most {
                return None;
            }
        }
        Some(rays.into_iter().map(|ray| ray.0).collect())
    }

    /// Whether no excluded column is left with a value.
    fn has_point(&self) -> bool {
        self.excluded_rows().iter().all(|&i| self.value(i).is_zero())
    }

    /// Where excluded columns could not be driven out: the vector that closes the case, over the scaled rows.
    fn closing(&self, n: usize) -> Option<Vec<IBig>> {
        if self.has_point() {
            return None;
        }
        let rows = self.excluded_rows();
        let y = |k: usize| -rows.iter().fold(IBig::ZERO, |sum, &i| sum + &self.rows[i][n + k]);
        Some((0..self.rows.len()).map(y).collect())
    }
}

#[cfg(test)]
mod tests {
    use nonsmooth_linalg::{Bsr, Csc, Dense};
    use nonsmooth_problem::{BoxLcp, FrictionLocal, Hlcp, Lcp, Mlcp, Problem};

    use super::*;

    /// The unknowns of a solution, or that a proof of their absence has been verified.
    fn decide(problem: &impl Problem) -> Option<Vec<f64>> {
        let mut search = ExactCones::new(problem.cones().unwrap());
        let found = loop {
            if let Some(found) = search.advance() {
                break found;
            }
        };
        match found {
            Found::Solution(t) => {
                assert!(search.system().solved_by(&t));
                Some(search.system().unknowns_at(&t))
            }
            Found::Nothing(vectors) => {
                let evidence = problem.evidence(&Certificate::Separating { vectors });
                assert!(matches!(evidence, Evidence::Proved(_)), "{evidence:?}");
                None
            }
        }
    }

    fn dense<const N: usize>(m: [[f64; N]; N]) -> Dense {
        let mut out = Dense::zeros(N, N);
        for i in 0..N {
            for j in 0..N {
                out[(i, j)] = m[i][j];
            }
        }
        out
    }

    #[test]
    fn problems_at_the_edge_of_rounding_are_decided() {
        // Positive definite by seven units of the last place, and singular.
        let d = 1.0 + 7e-15;
        let near = |d: f64| Lcp::new(dense([[d, -1.0], [-1.0, d]]), vec![-1.0, -1.0]).unwrap();
        let z = decide(&near(d)).unwrap();
        assert!((z[0] * (d - 1.0) - 1.0).abs() < 1e-12 && z[0] == z[1], "{z:?}");
        assert_eq!(decide(&near(1.0)), None);
        // No solution though the constraints can be met: z2 > 0 needs w2 = 0, and z1 wants w1 = 0.
        let m = [[0.0, 17179869184.0], [4.57763671875e-5, 3.0]];
        let scaled = Lcp::new(dense(m), vec![-131072.0, -7.62939453125e-6]).unwrap();
        assert_eq!(decide(&scaled), None);
        assert_eq!(decide(&Lcp::new(dense([[0.0]]), vec![0.0]).unwrap()), Some(vec![0.0]));
    }

    #[test]
    fn every_kind_is_decided() {
        let mixed = |a: f64| Mlcp::new(dense([[0.0, 1.0], [1.0, 0.0]]), vec![a, -1.0], 1).unwrap();
        assert_eq!(decide(&mixed(-2.0)), Some(vec![1.0, 2.0]));
        assert_eq!(decide(&mixed(1.0)), None);
        let bounded =
            |u: f64| BoxLcp::new(dense([[0.0]]), vec![-1.0], vec![-2.0], vec![u]).unwrap();
        assert_eq!(decide(&bounded(3.0)), Some(vec![3.0]));
        assert_eq!(decide(&bounded(-2.0)), Some(vec![-2.0]));
        assert_eq!(decide(&bounded(f64::INFINITY)), None);
        let pair = |q: f64| Hlcp::new(dense([[1.0]]), dense([[1.0]]), vec![q]).unwrap();
        assert!(decide(&pair(2.0)).is_some());
        assert_eq!(decide(&pair(-2.0)), None);
    }

    #[test]
    fn friction_in_the_plane_is_decided() {
        // u = W r + q: pressed with u_N = r_N - 1 and sliding or sticking.
        let contact = |w: [f64; 4], q: [f64; 2], mu: f64| {
            let entries = w.into_iter().enumerate().map(|(k, x)| (k / 2, k % 2, x));
            let w = Bsr::from_csc(&Csc::from_triplets(2, 2, entries).unwrap());
            FrictionLocal::<2>::new(w, q.to_vec(), vec![mu]).unwrap()
        };
        let unit = [1.0, 0.0, 0.0, 1.0];
        assert_eq!(decide(&contact(unit, [-1.0, 0.25], 0.5)), Some(vec![1.0, -0.25]));
        assert_eq!(decide(&contact(unit, [-1.0, 2.0], 0.5)), Some(vec![1.0, -0.5]));
        assert_eq!(decide(&contact(unit, [1.0, 2.0], 0.5)), Some(vec![0.0, 0.0]));
        // Skew: without friction u_N = -1 whatever r_N is.
        let skew = [0.0, -2.0, 2.0, 1.0];
        assert_eq!(decide(&contact(skew, [-1.0, 0.0], 0.0)), None);
        assert!(decide(&contact(skew, [-1.0, 0.0], 1.0)).is_some());
    }
}

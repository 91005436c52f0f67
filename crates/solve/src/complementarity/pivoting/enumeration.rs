//! **Enumeration** of the complementary cones, by branch and bound.
//!
//! Problem: `A u + C v + a = 0`, `0 ≤ v ⟂ w = D u + B v + b ≥ 0`, of any class and shape; an LCP has no u.
//!
//! Method: without complementarity the problem is one of linear inequalities, for which the simplex method finds a point or a vector that proves that there is none. Where
//! `v_j w_j > 0` at the point, there are two cases, `v_j = 0` or `w_j = 0`; each goes on from the tableau of the case before with a few pivots. A case without a point is
//! closed, with the separating vector as its proof; when all are closed, the vectors together prove that no complementary cone contains q.
//!
//! References: CottlePangStone2009, section 1.3 (complementary cones); Bland1977 (ties); Acary2018, section on the MLCP.
//!
//! Cost: at most 2ᵐ cases for m pairs, usually far fewer, a few pivots of O(rows · columns) each. Storage: a tableau for each open case, at most m.
//! Fails: by its cost; it is refused beyond `max_pairs` pairs.

use nonsmooth_linalg::{Compensated, Matrix};
use nonsmooth_problem::LcpPoint;
use nonsmooth_problem::check::Certificate;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::complementarity::form::{Complementary, Rows};
use crate::complementarity::parts::{equilibrate, refuting_row};
use crate::core::ranges::{at_least, at_most};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};
use crate::{SolveError, Solver, Step};

/// How many pairs are taken on, since the cases double with each.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Enumeration {
    /// The most complementary pairs that are taken on, at most 40: the cases may be 2 to that power.
    pub max_pairs: usize,
    /// Cases looked at in a step.
    pub batch: usize,
}

impl Default for Enumeration {
    fn default() -> Self {
        Self { max_pairs: 20, batch: 64 }
    }
}

impl Settings for Enumeration {
    fn validate(&self) -> Result<(), String> {
        at_most("max_pairs", self.max_pairs, 40)?;
        at_least("batch", self.batch, 1)
    }
}

impl Described for Enumeration {
    const ABOUT: &'static About = &About {
        name: "enumeration",
        family: "pivoting",
        solves: Solves::Law,
        summary: "enumeration of complementary cones by branch and bound: any M of few variables, a solution or a proof that there is none",
        needs: &["the entries of M", "few complementary pairs (max_pairs)"],
        cites: &["CottlePangStone2009", "Bland1977", "Acary2018"],
        variants: &["batch=1"],
        settings: described::<Self>,
    };
}

/// The cases still open, and one tableau for the case that is looked at.
pub struct EnumerateWork {
    data: Data,
    refuting: Option<usize>,
    open: Vec<Case>,
    separating: Vec<Vec<f64>>,
    started: bool,
    found: Vec<f64>,
    cases: usize,
}

impl<P: Complementary> Solver<P> for Enumeration {
    type Work = EnumerateWork;

    fn work(&self, problem: &P) -> Result<EnumerateWork, SolveError> {
        Ok(EnumerateWork {
            data: Data::new(&problem.rowwise(), self.max_pairs)?,
            refuting: problem.system().ok().and_then(|system| refuting_row(&system, &mut vec![])),
            open: vec![],
            separating: vec![],
            started: false,
            found: vec![],
            cases: 0,
        })
    }

    fn start(&self, _: &P, point: &mut LcpPoint, work: &mut EnumerateWork) {
        work.open.clear();
        work.separating.clear();
        (work.started, work.cases) = (false, 0);
        work.found.clone_from(&point.z);
    }

    fn step(&self, _: &P, _: &mut LcpPoint, work: &mut EnumerateWork) -> Step {
        let EnumerateWork { data, refuting, open, separating, started, found, cases } = work;
        if let Some(row) = *refuting {
            return Step::NoSolution(Certificate::Row { row });
        }
        if !*started {
            match Case::root(data) {
                Ok(case) => open.push(case),
                Err(closed) => {
                    return Step::NoSolution(Certificate::Farkas { y: closed.proof(data) });
                }
            }
            *started = true;
        }
        for _ in 0..self.batch {
            let Some(case) = open.pop() else {
                return Step::NoSolution(Certificate::Cones {
                    separating: std::mem::take(separating),
                });
            };
            *cases += 1;
            let Some(j) = case.conflict(data) else {
                *found = case.point(data);
                return Step::Done;
            };
            for side in case.sides(data, j) {
                match case.without(data, side) {
                    Ok(case) => open.push(case),
                    Err(closed) => separating.push(closed.proof(data)),
                }
            }
        }
        Step::Continue { estimate: f64::NAN }
    }

    fn publish(&self, _: &P, point: &mut LcpPoint, work: &mut EnumerateWork) {
        point.z.copy_from_slice(&work.found);
    }

    fn account(&self, work: &EnumerateWork) -> Vec<String> {
        let pairs = work.data.pairs;
        vec![format!("{} of 2^{pairs} cases were looked at or closed together.", work.cases)]
    }
}

/// What of an entry is zero, in units of the largest of its row.
const ZERO: f64 = 1e-11;
/// What of a value is zero, in units of its terms.
const NEGLIGIBLE: f64 = 1e-11;
/// Steepest pivots before Bland's rule, which cannot cycle.
const STEEPEST: usize = 100;

/// The problem as `Σ columns · x = q`, scaled: the residuals of equalities and w first (unit columns), then z and u.
pub(super) struct Data {
    equalities: usize,
    free: usize,
    pub(super) pairs: usize,
    rows: usize,
    /// `rows × width`, by rows.
    columns: Vec<f64>,
    q: Vec<f64>,
    /// Powers of two.
    row_scale: Vec<f64>,
    column_scale: Vec<f64>,
}

impl Data {
    pub(super) fn new(mixed: &Rows, most: usize) -> Result<Self, SolveError> {
        let Rows { matrix, q, equalities, free, .. } = *mixed;
        if let Matrix::Operator(_) = matrix {
            return Err(SolveError::needs("the entries of M (dense or sparse)", "an operator"));
        }
        let (rows, pairs) = (q.len(), q.len() - equalities);
        if pairs > most {
            let found = format!("{pairs} (at most {most} are taken on)");
            return Err(SolveError::needs("few complementary pairs", found));
        }
        let (mut row_scale, mut column_scale) = (vec![], vec![]);
        equilibrate(matrix, &mut row_scale, &mut column_scale, &mut vec![]);
        let width = rows + pairs + free;
        let mut columns = vec![0.0; rows * width];
        (0..rows).for_each(|i| columns[i * width + i] = 1.0);
        matrix.for_each(|i, j, x| {
            let at = if j < free { rows + pairs + j } else { rows + j - free };
            columns[i * width + at] = -x * row_scale[i] * column_scale[j];
        });
        let q = q.iter().zip(&row_scale).map(|(q, r)| q * r).collect();
        Ok(Self { equalities, free, pairs, rows, columns, q, row_scale, column_scale })
    }

    fn width(&self) -> usize {
        self.rows + self.pairs + self.free
    }

    pub(super) fn w(&self, pair: usize) -> usize {
        self.equalities + pair
    }

    pub(super) fn z(&self, pair: usize) -> usize {
        self.rows + pair
    }

    fn column(&self, j: usize) -> impl Iterator<Item = f64> {
        (0..self.rows).map(move |i| self.columns[i * self.width() + j])
    }

    /// `Σ columns · x` for values of all columns, as a point of the problem.
    fn unscaled(&self, x: &[f64]) -> Vec<f64> {
        let value = |j: usize| {
            let at =
                if j < self.free { self.rows + self.pairs + j } else { self.rows + j - self.free };
            x[at] * self.column_scale[j]
        };
        (0..self.free + self.pairs).map(value).collect()
    }
}

/// What is basic in a row of the tableau.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Basic {
    /// A column.
    Column(usize),
    /// The unit vector of the row of this number, times the sign: not part of the problem, to be made zero.
    Artificial(usize, f64),
}

/// A case: some variables are not allowed; the tableau of a feasible basis.
#[derive(Clone)]
pub(super) struct Case {
    /// `B⁻¹ [columns, q]`.
    t: Vec<f64>,
    b: Vec<f64>,
    /// The size of the terms of b.
    size: Vec<f64>,
    basis: Vec<Basic>,
    /// Rows whose basic variable may have any value: free variables, and what says nothing.
    loose: Vec<bool>,
    pub(super) allowed: Vec<bool>,
}

/// A case without a point: this row of its tableau says that a positive number is the sum of nonpositive multiples of allowed variables.
pub(super) struct Closed {
    pub(super) case: Box<Case>,
    row: usize,
}

impl Case {
    /// The case where every z and w is allowed.
    pub(super) fn root(data: &Data) -> Result<Self, Closed> {
        let (n, width) = (data.rows, data.width());
        let mut allowed = vec![true; width];
        allowed[..data.equalities].fill(false);
        allowed[n + data.pairs..].fill(false);
        let mut case = Self {
            t: data.columns.clone(),
            b: data.q.clone(),
            size: data.q.iter().map(|q| q.abs()).collect(),
            basis: (0..n).map(Basic::Column).collect(),
            loose: vec![false; n],
            allowed,
        };
        (0..data.equalities).for_each(|i| case.basis[i] = Basic::Artificial(i, 1.0));
        // Free variables become basic and stay so; what depends on the others stays zero.
        for _ in 0..data.free {
            let mut best = (ZERO, 0, 0);
            for i in (0..n).filter(|i| !case.loose[*i]) {
                for j in n + data.pairs..width {
                    let x = case.t[i * width + j].abs();
                    if case.row_of(j).is_none() && x > best.0 {
                        best = (x, i, j);
                    }
                }
            }
            let (x, i, j) = best;
            if x <= ZERO {
                break;
            }
            case.pivot(width, i, j);
            case.loose[i] = true;
        }
        for i in 0..n {
            if !case.loose[i] && case.b[i] < -NEGLIGIBLE * case.size[i] {
                // Only unit columns are basic here: the same column with the other sign.
                let (Basic::Column(unit) | Basic::Artificial(unit, _)) = case.basis[i];
                case.basis[i] = Basic::Artificial(unit, -1.0);
                case.t[i * width..(i + 1) * width].iter_mut().for_each(|t| *t = -*t);
                case.b[i] = -case.b[i];
            }
        }
        // Artificial variables, one by one, while the rest stays feasible.
        for i in 0..n {
            if matches!(case.basis[i], Basic::Artificial(..)) && !case.loose[i] {
                case = case.expelled(data, i)?;
            }
        }
        Ok(case)
    }

    fn row_of(&self, column: usize) -> Option<usize> {
        self.basis.iter().position(|b| *b == Basic::Column(column))
    }

    /// The value of a column's variable.
    fn value(&self, column: usize) -> f64 {
        self.row_of(column).map_or(0.0, |i| {
            if self.b[i].abs() <= NEGLIGIBLE * self.size[i] { 0.0 } else { self.b[i] }
        })
    }

    /// The basic variable of row i leaves for column j.
    fn pivot(&mut self, width: usize, i: usize, j: usize) {
        let (head, rest) = self.t.split_at_mut(i * width);
        let (row, tail) = rest.split_at_mut(width);
        let p = row[j];
        row.iter_mut().for_each(|x| *x /= p);
        row[j] = 1.0;
        self.b[i] /= p;
        self.size[i] /= p.abs();
        // Of what cancelled in row i, its rounding goes on to the others, not its size.
        let (value, terms) = (self.b[i], self.b[i].abs().max(1e-3 * self.size[i]));
        let others = head.chunks_exact_mut(width).chain(tail.chunks_exact_mut(width));
        let kept = self.b.iter_mut().zip(&mut self.size).enumerate().filter(|(k, _)| *k != i);
        for (other, (_, (b, size))) in others.zip(kept) {
            let factor = other[j];
            if factor != 0.0 {
                other.iter_mut().zip(&*row).for_each(|(x, r)| *x -= factor * r);
                other[j] = 0.0;
                *b -= factor * value;
                *size = size.max(factor.abs() * terms);
            }
        }
        self.basis[i] = Basic::Column(j);
    }

    /// The largest modulus in row i, times the tolerance.
    fn threshold(&self, width: usize, i: usize) -> f64 {
        ZERO * self.t[i * width..(i + 1) * width].iter().fold(0.0_f64, |l, t| l.max(t.abs()))
    }

    /// The columns that may enter.
    fn candidates(&self) -> impl Iterator<Item = usize> {
        (0..self.allowed.len()).filter(|j| self.allowed[*j] && self.row_of(*j).is_none())
    }

    /// Which row blocks the growth of column j, and at what value. Among equals row `first`, then the least variable.
    fn block(&self, width: usize, j: usize, first: usize) -> Option<(usize, f64)> {
        let rank = |i: usize| match self.basis[i] {
            _ if i == first => 0,
            Basic::Artificial(..) => 1,
            Basic::Column(k) => 2 + k,
        };
        let mut best: Option<(usize, f64)> = None;
        for i in (0..self.b.len()).filter(|i| !self.loose[*i]) {
            let slope = self.t[i * width + j];
            if slope > self.threshold(width, i) {
                let ratio = self.b[i].max(0.0) / slope;
                let better = best.is_none_or(|(k, least)| {
                    let tie = (ratio - least).abs() <= 1e-13 * least.abs().max(ratio);
                    if tie { rank(i) < rank(k) } else { ratio < least }
                });
                if better {
                    best = Some((i, ratio));
                }
            }
        }
        best
    }

    /// The case with the basic variable of row i, which must not be allowed, out of the basis.
    fn expelled(mut self, data: &Data, i: usize) -> Result<Self, Closed> {
        match self.expel(data, i) {
            true => Ok(self),
            false => Err(Closed { case: Box::new(self), row: i }),
        }
    }

    /// Makes the basic variable of row i zero and takes it out of the basis; it must not be allowed. False where the row proves that it cannot be zero.
    fn expel(&mut self, data: &Data, i: usize) -> bool {
        let width = data.width();
        for round in 0.. {
            let least = self.threshold(width, i);
            let zero = self.b[i] <= NEGLIGIBLE * self.size[i];
            let entering = {
                let slope = |j: &usize| self.t[i * width + j];
                let steeper = |a: &usize, b: &usize| slope(a).abs().total_cmp(&slope(b).abs());
                let mut growing = self.candidates().filter(|j| slope(j) > least);
                if zero {
                    // At zero already: anything that lets it leave.
                    self.candidates().filter(|j| slope(j).abs() > least).max_by(steeper)
                } else if round < STEEPEST {
                    growing.max_by(steeper)
                } else {
                    growing.next()
                }
            };
            let Some(j) = entering else {
                if zero {
                    // The row says 0 = 0.
                    (self.loose[i], self.b[i]) = (true, 0.0);
                }
                return zero;
            };
            if zero {
                self.pivot(width, i, j);
                return true;
            }
            // Row i blocks, if no other.
            let Some((k, _)) = self.block(width, j, i) else { return false };
            self.pivot(width, k, j);
            if k == i || round > 10_000 {
                break;
            }
        }
        true
    }

    /// A pair whose z and w are both positive: the one with the largest lesser of them.
    pub(super) fn conflict(&self, data: &Data) -> Option<usize> {
        let lesser = |j: usize| self.value(data.w(j)).min(self.value(data.z(j)));
        let worst = (0..data.pairs).map(|j| (lesser(j), j)).max_by(|a, b| a.0.total_cmp(&b.0));
        worst.filter(|(x, _)| *x > 0.0).map(|(_, j)| j)
    }

    /// A pair whose z and w are both allowed.
    pub(super) fn undecided(&self, data: &Data) -> Option<usize> {
        (0..data.pairs).find(|j| self.allowed[data.w(*j)] && self.allowed[data.z(*j)])
    }

    /// The two columns of a pair, the one to be tried last first: the lesser value goes.
    pub(super) fn sides(&self, data: &Data, j: usize) -> [usize; 2] {
        let (w, z) = (data.w(j), data.z(j));
        if self.value(w) < self.value(z) { [z, w] } else { [w, z] }
    }

    /// The case where a column is not allowed either.
    pub(super) fn without(&self, data: &Data, column: usize) -> Result<Self, Closed> {
        let mut case = self.clone();
        case.allowed[column] = false;
        match case.row_of(column) {
            Some(i) => case.expelled(data, i),
            None => Ok(case),
        }
    }

    /// The values of all columns at the basis, refined against the data.
    fn values(&self, data: &Data) -> Vec<f64> {
        let (n, width) = (data.rows, data.width());
        let mut x = vec![0.0; width];
        let columns: Vec<Option<usize>> = self
            .basis
            .iter()
            .map(|b| match b {
                Basic::Column(j) => Some(*j),
                Basic::Artificial(..) => None,
            })
            .collect();
        for (j, b) in columns.iter().zip(&self.b) {
            j.iter().for_each(|j| x[*j] = *b);
        }
        for _ in 0..4 {
            let residual: Vec<f64> = (0..n)
                .map(|i| {
                    let mut sum = Compensated::from(data.q[i]);
                    for j in columns.iter().flatten() {
                        sum.add_product(-data.columns[i * width + j], x[*j]);
                    }
                    sum.value()
                })
                .collect();
            for (r, j) in columns.iter().enumerate() {
                let correction: f64 =
                    residual.iter().enumerate().map(|(k, s)| self.t[r * width + k] * s).sum();
                j.iter().for_each(|j| x[*j] += correction);
            }
        }
        for (r, j) in columns.iter().enumerate() {
            if let (Some(j), false) = (j, self.loose[r])
                && x[*j] < 0.0
            {
                x[*j] = 0.0;
            }
        }
        x
    }

    /// The point of the basis.
    fn point(&self, data: &Data) -> Vec<f64> {
        data.unscaled(&self.values(data))
    }
}

impl Closed {
    /// The vector that proves it, up to rounding: y with `yᵀ columns_j ≥ 0` for allowed columns, `yᵀ q < 0`.
    fn proof(&self, data: &Data) -> Vec<f64> {
        let Self { case, row: i } = self;
        let (n, width) = (data.rows, data.width());
        let mut y: Vec<f64> = (0..n).map(|k| -case.t[i * width + k]).collect();
        // Bᵀ y = −e_i, refined.
        for _ in 0..3 {
            let missing: Vec<f64> = (0..n)
                .map(|r| {
                    let mut sum = Compensated::from(if r == *i { -1.0 } else { 0.0 });
                    match case.basis[r] {
                        Basic::Artificial(k, sign) => sum.add(-sign * y[k]),
                        Basic::Column(c) => {
                            data.column(c).zip(&y).for_each(|(a, y)| sum.add_product(-a, *y));
                        }
                    }
                    sum.value()
                })
                .collect();
            for (k, y) in y.iter_mut().enumerate() {
                *y += (0..n).map(|r| case.t[r * width + k] * missing[r]).sum::<f64>();
            }
        }
        let largest = y.iter().fold(0.0_f64, |l, y| l.max(y.abs()));
        for (k, y) in y.iter_mut().enumerate() {
            let must = case.allowed[k];
            if y.abs() <= 1e-13 * largest || (must && *y < 0.0) {
                *y = 0.0;
            }
            *y *= data.row_scale[k];
        }
        y
    }

    /// A vector that proves it whatever is lost by rounding: `yᵀ columns_j` is positive of basic columns too, where a [`proof`](Self::proof) has zeros. `None` where
    /// other columns leave no room for that, and with free variables, which want zeros.
    pub(super) fn strict_proof(&self, data: &Data) -> Option<Vec<f64>> {
        if data.free > 0 {
            return None;
        }
        let Self { case, row: i } = self;
        let (n, width) = (data.rows, data.width());
        let allowed = |r: &usize| matches!(case.basis[*r], Basic::Column(j) if case.allowed[j]);
        let raised: Vec<usize> = (0..n).filter(allowed).collect();
        let slope = |j: usize| -case.t[i * width + j];
        let change = |j: usize| raised.iter().map(|r| case.t[r * width + j]).sum::<f64>();
        let value = raised.iter().map(|r| case.b[*r]).sum::<f64>();
        let room =
            |has: f64, loses: f64| if loses > 0.0 { 0.5 * has / loses } else { f64::INFINITY };
        let rooms = case.candidates().map(|j| room(slope(j), -change(j)));
        let step = rooms.fold(room(case.b[*i], value).min(1.0), f64::min);
        let y = |k: usize| (slope(k) + step * change(k)) * data.row_scale[k];
        (step > 0.0).then(|| (0..n).map(y).collect())
    }
}

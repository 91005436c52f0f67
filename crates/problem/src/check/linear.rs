//! The judge of linear complementarity problems.

use serde::Serialize;

use super::rows::Rows;
use super::{Judged, Measure, Verdict, over};
use crate::linalg::{Matrix, norm};
use crate::{BoxLcp, Hlcp, HlcpPoint, Lcp, LcpPoint, Mlcp, Problem, ProblemError};

/// The data of a problem in z with `w = M z + q`: row i belongs to an equality, or to the variable `free + i − equalities`.
pub(crate) struct Data<'a> {
    pub(super) matrix: &'a Matrix,
    pub(super) q: &'a [f64],
    pub(super) equalities: usize,
    pub(super) free: usize,
    pub(super) bounds: Option<(&'a [f64], &'a [f64])>,
}

pub(crate) trait Stated {
    fn data(&self) -> Data<'_>;
}

impl Stated for Lcp {
    fn data(&self) -> Data<'_> {
        Data { matrix: &self.M, q: &self.q, equalities: 0, free: 0, bounds: None }
    }
}

impl Stated for Mlcp {
    fn data(&self) -> Data<'_> {
        let Self { M, q, equalities, free } = self;
        Data { matrix: M, q, equalities: *equalities, free: *free, bounds: None }
    }
}

impl Stated for BoxLcp {
    fn data(&self) -> Data<'_> {
        let bounds = Some((&self.lower[..], &self.upper[..]));
        Data { matrix: &self.M, q: &self.q, equalities: 0, free: 0, bounds }
    }
}

impl Data<'_> {
    /// The variable of row i; `None` of an equality.
    pub(super) fn variable(&self, i: usize) -> Option<usize> {
        i.checked_sub(self.equalities).map(|k| self.free + k)
    }

    /// The bounds of the variable of row i.
    pub(super) fn bounds(&self, i: usize) -> (f64, f64) {
        match self.bounds {
            Some((lower, upper)) => (lower[i], upper[i]),
            None if i < self.equalities => (f64::NEG_INFINITY, f64::INFINITY),
            None => (0.0, f64::INFINITY),
        }
    }

    /// The bounds of column j.
    pub(super) fn column_bounds(&self, j: usize) -> (f64, f64) {
        match self.bounds {
            Some((lower, upper)) => (lower[j], upper[j]),
            None if j < self.free => (f64::NEG_INFINITY, f64::INFINITY),
            None => (0.0, f64::INFINITY),
        }
    }
}

/// The judge's constants and buffers for an LCP, an MLCP or a box LCP.
///
/// With `s_i` the largest modulus in row i of M (1 of an empty row or an operator without diagonal), `x_i = s_i z_i`, and P the projection on the bounds of
/// `x_i`, here for an LCP:
///
/// | field of [`Measure`] | formula |
/// | --- | --- |
/// | `absolute` | `‖(x_i − P(x_i − w_i))_i‖₂ = ‖(min(x_i, w_i))_i‖₂`, in the unit of q |
/// | `relative` | `absolute / ‖q‖₂`, with q = 0 `absolute` itself |
/// | `rows` | `max_i |min(σ_i z_i, w_i)| / (|q_i| + σ_i ‖z‖_∞)`, `σ_i = Σ_j |M_ij|`: the same whatever the scale of row i |
/// | `paper`, `peer` | `‖min(z, w)‖₂ / ‖q‖₂`, as Siconos has it for an LCP |
///
/// `relative` and `rows` decide. An equality counts with `w_i`. Both bounds finite: `min` becomes the distance to the projection.
#[derive(Debug, Clone, Default)]
pub struct LinearGauge {
    norm_q: f64,
    /// s
    largest: Vec<f64>,
    /// σ
    sums: Vec<f64>,
    w: Vec<f64>,
    rows: Rows,
}

/// What the judge adds up, row by row.
struct Sum {
    unit: f64,
    scaled: f64,
    plain: f64,
    primal: f64,
    dual: f64,
    complementarity: f64,
    rows: f64,
    worst: (usize, f64),
}

/// `x − P(x − w)`, P the projection on `[l, u]`. Zero where x and w obey the law.
fn natural(x: f64, w: f64, l: f64, u: f64) -> f64 {
    // The smaller of the two differences is computed without the larger.
    if x - w <= l {
        x - l
    } else if x - w >= u {
        x - u
    } else {
        w
    }
}

/// The part of w that its law does not allow, for a variable with these bounds.
fn dual_violation(w: f64, l: f64, u: f64) -> f64 {
    match (l.is_finite(), u.is_finite()) {
        (true, true) => 0.0,
        (true, false) => (-w).max(0.0),
        (false, true) => w.max(0.0),
        (false, false) => w.abs(),
    }
}

impl Sum {
    fn new(norm_q: f64) -> Self {
        Self {
            unit: if norm_q > 0.0 { norm_q } else { 1.0 },
            scaled: 0.0,
            plain: 0.0,
            primal: 0.0,
            dual: 0.0,
            complementarity: 0.0,
            rows: 0.0,
            worst: (0, -1.0),
        }
    }

    /// A pair of z with bounds and w. `s` makes z comparable to w in the sums; `sigma` in its row, whose terms have the size `terms`.
    #[allow(clippy::too_many_arguments)]
    fn pair(
        &mut self,
        i: usize,
        z: f64,
        w: f64,
        (l, u): (f64, f64),
        s: f64,
        sigma: f64,
        terms: f64,
    ) {
        let (x, sl, su) = (s * z, s * l, s * u);
        self.add(i, natural(x, w, sl, su));
        self.plain += (natural(z, w, l, u) / self.unit).powi(2);
        self.primal += ((sl - x).max(x - su).max(0.0) / self.unit).powi(2);
        self.dual += (dual_violation(w, l, u) / self.unit).powi(2);
        let gap = if w > 0.0 { x - sl } else { su - x };
        if gap.is_finite() {
            self.complementarity += (gap / self.unit * (w / self.unit)).abs();
        }
        let row = over(natural(sigma * z, w, sigma * l, sigma * u).abs(), terms);
        // A NaN is the worst there is.
        self.rows = if row.is_nan() { row } else { self.rows.max(row) };
    }

    fn equality(&mut self, i: usize, w: f64, terms: f64) {
        self.add(i, w);
        self.plain += (w / self.unit).powi(2);
        self.dual += (w / self.unit).powi(2);
        let row = over(w.abs(), terms);
        self.rows = if row.is_nan() { row } else { self.rows.max(row) };
    }

    fn add(&mut self, i: usize, residual: f64) {
        let share = (residual / self.unit).powi(2);
        if share > self.worst.1 || share.is_nan() {
            self.worst = (i, share);
        }
        self.scaled += share;
    }

    fn measure(self) -> Measure {
        Measure {
            absolute: self.scaled.sqrt() * self.unit,
            relative: self.scaled.sqrt(),
            paper: self.plain.sqrt(),
            peer: self.plain.sqrt(),
            primal: self.primal.sqrt(),
            dual: self.dual.sqrt(),
            complementarity: self.complementarity,
            rows: Some(self.rows),
            worst_contact: self.worst.0,
            worst: self.worst.1.max(0.0).sqrt(),
            ..Measure::unknown()
        }
    }
}

/// The largest modulus and the sum of moduli of each row; of an operator its diagonal, else 1.
fn sizes(m: &Matrix, largest: &mut Vec<f64>, sums: &mut Vec<f64>) {
    largest.clear();
    largest.resize(m.nrows(), 0.0);
    sums.clear();
    sums.resize(m.nrows(), 0.0);
    let known = m.for_each(|i, _, x| {
        largest[i] = largest[i].max(x.abs());
        sums[i] += x.abs();
    });
    if !known {
        for (i, d) in m.diagonal().into_iter().flatten().enumerate().take(m.nrows()) {
            (largest[i], sums[i]) = (d.abs(), d.abs());
        }
    }
    for x in largest.iter_mut().chain(sums) {
        if *x == 0.0 {
            *x = 1.0;
        }
    }
}

/// The largest modulus; infinite where an entry is not finite.
fn largest_of(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |l, x| if x.is_finite() { l.max(x.abs()) } else { f64::INFINITY })
}

impl LinearGauge {
    pub(crate) fn new(problem: &impl Stated) -> Self {
        let mut gauge = Self::default();
        gauge.refill(problem);
        gauge
    }

    pub(crate) fn refill(&mut self, problem: &impl Stated) {
        let data = problem.data();
        self.norm_q = norm(data.q);
        sizes(data.matrix, &mut self.largest, &mut self.sums);
        self.w.resize(data.q.len(), 0.0);
        self.rows.start(data.q);
    }

    pub(crate) fn measure(
        &mut self,
        problem: &impl Stated,
        point: &LcpPoint,
        precisely: bool,
    ) -> Measure {
        let data = problem.data();
        let reach = largest_of(&point.z);
        if !reach.is_finite() {
            // An empty column would hide it.
            return Measure::unknown();
        }
        self.rows.precisely(precisely);
        self.rows.start(data.q);
        if !self.rows.add_matrix(1.0, data.matrix, &point.z) {
            data.matrix.mul(&point.z, &mut self.w);
            self.rows.add_vector(&self.w);
        }
        self.w.iter_mut().zip(self.rows.values()).for_each(|(w, sum)| *w = sum);
        let mut sum = Sum::new(self.norm_q);
        for (i, (&w, &q)) in self.w.iter().zip(data.q).enumerate() {
            let (s, sigma) = (self.largest[i], self.sums[i]);
            let terms = q.abs() + sigma * reach;
            match data.variable(i) {
                None => sum.equality(i, w, terms),
                Some(j) => sum.pair(i, point.z[j], w, data.bounds(i), s, sigma, terms),
            }
        }
        sum.measure()
    }

    fn judge(
        problem: &(impl Stated + Problem<Point = LcpPoint, Gauge = Self>),
        point: &LcpPoint,
        tolerance: f64,
    ) -> Result<Verdict<RowStatus, RowCounts>, ProblemError> {
        problem.validate_point(point)?;
        let mut gauge = problem.gauge()?;
        let measure = problem.certify(point, &mut gauge);
        let data = problem.data();
        let rows = gauge.w.iter().enumerate().map(|(i, &w)| {
            let pair = data.variable(i).map(|j| (gauge.largest[i] * point.z[j], data.bounds(i)));
            (pair.map(|(x, (l, u))| (x, gauge.largest[i] * l, gauge.largest[i] * u)), w)
        });
        let rows: Vec<_> = rows.collect();
        Ok(verdict(measure, &rows, gauge.norm_q, gauge.w.clone(), tolerance))
    }
}

/// The judge's constants and buffers for a horizontal LCP.
///
/// With `c_i`, `d_i` the largest moduli in column i of Q and R, the residual is that of the equalities `Q x + R s − q` and of the pairs `min(c_i x_i, d_i s_i)`; what
/// is made of it is as for [`LinearGauge`]. The rows of pairs follow those of the equalities.
#[derive(Debug, Clone, Default)]
pub struct HlcpGauge {
    norm_q: f64,
    c: Vec<f64>,
    d: Vec<f64>,
    /// `Σ_j |Q_ij|`, `Σ_j |R_ij|`.
    sums: [Vec<f64>; 2],
    w: Vec<f64>,
    rows: Rows,
}

impl HlcpGauge {
    pub(crate) fn new(problem: &Hlcp) -> Self {
        let mut gauge = Self::default();
        gauge.refill(problem);
        gauge
    }

    pub(crate) fn refill(&mut self, problem: &Hlcp) {
        self.norm_q = norm(&problem.q);
        let mut unused = vec![];
        let [of_q, of_r] = &mut self.sums;
        for (m, size, sums) in [(&problem.Q, &mut self.c, of_q), (&problem.R, &mut self.d, of_r)] {
            sizes(m, &mut unused, sums);
            size.clear();
            size.resize(m.ncols(), 0.0);
            m.for_each(|_, j, x| size[j] = size[j].max(x.abs()));
            size.iter_mut().filter(|x| **x == 0.0).for_each(|x| *x = 1.0);
        }
        self.w.resize(problem.q.len(), 0.0);
        self.rows.start(&problem.q);
    }

    pub(crate) fn measure(
        &mut self,
        problem: &Hlcp,
        point: &HlcpPoint,
        precisely: bool,
    ) -> Measure {
        let (x_reach, s_reach) = (largest_of(&point.x), largest_of(&point.s));
        if !(x_reach.is_finite() && s_reach.is_finite()) {
            return Measure::unknown();
        }
        self.rows.precisely(precisely);
        self.rows.start_at_zero(problem.q.len());
        self.w.iter_mut().zip(&problem.q).for_each(|(w, q)| *w = -q);
        self.rows.add_vector(&self.w);
        for (m, x) in [(&problem.Q, &point.x), (&problem.R, &point.s)] {
            if !self.rows.add_matrix(1.0, m, x) {
                m.mul(x, &mut self.w);
                self.rows.add_vector(&self.w);
            }
        }
        self.w.iter_mut().zip(self.rows.values()).for_each(|(w, sum)| *w = sum);
        let mut sum = Sum::new(self.norm_q);
        for (i, (&w, &q)) in self.w.iter().zip(&problem.q).enumerate() {
            let terms = q.abs() + self.sums[0][i] * x_reach + self.sums[1][i] * s_reach;
            sum.equality(i, w, terms);
        }
        let n = self.w.len();
        let reach = self.reach(point);
        for (i, (&x, &s)) in point.x.iter().zip(&point.s).enumerate() {
            let (c, ds) = (self.c[i], self.d[i] * s);
            sum.pair(n + i, x, ds, (0.0, f64::INFINITY), c, c, reach);
        }
        sum.measure()
    }

    /// The size of the terms that pairs are compared with.
    fn reach(&self, point: &HlcpPoint) -> f64 {
        let largest =
            |x: &[f64], c: &[f64]| x.iter().zip(c).fold(0.0_f64, |l, (x, c)| l.max((c * x).abs()));
        self.norm_q + largest(&point.x, &self.c) + largest(&point.s, &self.d)
    }
}

/// Where a variable is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RowStatus {
    /// Strictly between its bounds; `w_i = 0`.
    Inside,
    /// At its lower bound, `w_i > 0`.
    Lower,
    /// At its upper bound, `w_i < 0`.
    Upper,
    /// The row is an equality.
    Equality,
}

/// How many rows do what (they add up), and how many of those are degenerate.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct RowCounts {
    /// Variables strictly between their bounds: `z_i > 0` of an LCP.
    pub inside: usize,
    /// Variables at their lower bound: `z_i = 0` of an LCP.
    pub lower: usize,
    /// Variables at their upper bound.
    pub upper: usize,
    /// Equalities.
    pub equalities: usize,
    /// Pairs, counted above as well, that are zero on both sides within the tolerance.
    pub degenerate: usize,
}

/// `(x, l, u)`: a variable and its bounds in the unit of q.
type Scaled = (f64, f64, f64);

/// From each row's variable (none of an equality) and w.
fn verdict(
    measure: Measure,
    rows: &[(Option<Scaled>, f64)],
    norm_q: f64,
    w: Vec<f64>,
    tolerance: f64,
) -> Verdict<RowStatus, RowCounts> {
    let margin = tolerance * if norm_q > 0.0 { norm_q } else { 1.0 };
    let mut counts = RowCounts::default();
    let (mut statuses, mut worst) = (vec![], vec![]);
    for (i, &(pair, w)) in rows.iter().enumerate() {
        let (status, residual) = match pair {
            None => (RowStatus::Equality, w),
            Some((x, l, u)) => {
                let at = if x - w <= l {
                    RowStatus::Lower
                } else if x - w >= u {
                    RowStatus::Upper
                } else {
                    RowStatus::Inside
                };
                let bound = (x - l).abs().min((u - x).abs()) <= margin;
                counts.degenerate += usize::from(bound && w.abs() <= margin && l < u);
                (at, natural(x, w, l, u))
            }
        };
        match status {
            RowStatus::Inside => counts.inside += 1,
            RowStatus::Lower => counts.lower += 1,
            RowStatus::Upper => counts.upper += 1,
            RowStatus::Equality => counts.equalities += 1,
        }
        statuses.push(status);
        worst.push((i, over(residual.abs(), norm_q)));
    }
    worst.sort_by(|a, b| b.1.total_cmp(&a.1));
    worst.truncate(10);
    Verdict { measure, solved: measure.passes(tolerance), counts, statuses, velocity: w, worst }
}

macro_rules! judged {
    ($kind:ty) => {
        impl Judged for $kind {
            type Status = RowStatus;
            type Counts = RowCounts;

            fn judge(
                &self,
                point: &LcpPoint,
                tolerance: f64,
            ) -> Result<Verdict<RowStatus, RowCounts>, ProblemError> {
                LinearGauge::judge(self, point, tolerance)
            }
        }
    };
}

judged!(Lcp);
judged!(Mlcp);
judged!(BoxLcp);

impl Judged for Hlcp {
    type Status = RowStatus;
    type Counts = RowCounts;

    /// The counts are those of the pairs; what is called w here is `Q x + R s − q`.
    fn judge(
        &self,
        point: &HlcpPoint,
        tolerance: f64,
    ) -> Result<Verdict<RowStatus, RowCounts>, ProblemError> {
        self.validate_point(point)?;
        let mut gauge = self.gauge()?;
        let measure = self.certify(point, &mut gauge);
        let equalities = gauge.w.iter().map(|&w| (None, w));
        let pairs = (0..self.dim()).map(|i| {
            let (x, s) = (gauge.c[i] * point.x[i], gauge.d[i] * point.s[i]);
            (Some((x, 0.0, f64::INFINITY)), s)
        });
        let rows: Vec<_> = equalities.chain(pairs).collect();
        Ok(verdict(measure, &rows, gauge.norm_q, gauge.w.clone(), tolerance))
    }
}

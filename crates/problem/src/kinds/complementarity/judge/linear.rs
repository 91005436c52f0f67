//! The judge of problems in z with `w = M z + q`: LCP, MLCP and box LCP.

use super::{
    Noise, Pair, RowCounts, RowStatus, Sum, find_effects, find_units, finite, floor, put, rounding,
    share, unseen, verdict, without_noise,
};
use crate::check::proof::{Exact, exactly_near, sum_of_products, worth_a_look};
use crate::check::rows::Rows;
use crate::check::{Measure, Verdict};
use crate::{LcpPoint, Problem};
use nonsmooth_linalg::budget::Pace;
use nonsmooth_linalg::{Matrix, norm};

/// The data of a problem in z with `w = M z + q`: row i belongs to an equality, or to the variable `free + i − equalities`.
pub(crate) struct Data<'a> {
    pub(crate) matrix: &'a Matrix,
    pub(crate) q: &'a [f64],
    pub(crate) equalities: usize,
    pub(crate) free: usize,
    pub(crate) bounds: Option<(&'a [f64], &'a [f64])>,
}

/// A problem in z.
pub(crate) trait InZ {
    fn data(&self) -> Data<'_>;
}

impl Data<'_> {
    /// The variable of row i; `None` of an equality.
    pub(crate) fn variable(&self, i: usize) -> Option<usize> {
        i.checked_sub(self.equalities).map(|k| self.free + k)
    }

    /// The bounds of the variable of row i.
    pub(crate) fn bounds(&self, i: usize) -> (f64, f64) {
        match self.bounds {
            Some((lower, upper)) => (lower[i], upper[i]),
            None if i < self.equalities => (f64::NEG_INFINITY, f64::INFINITY),
            None => (0.0, f64::INFINITY),
        }
    }

    /// The bounds of column j.
    fn column_bounds(&self, j: usize) -> (f64, f64) {
        match self.bounds {
            Some((lower, upper)) => (lower[j], upper[j]),
            None if j < self.free => (f64::NEG_INFINITY, f64::INFINITY),
            None => (0.0, f64::INFINITY),
        }
    }
}

/// The judge's constants and buffers for an LCP, an MLCP or a box LCP.
///
/// The error of row i is `|w_i| / D_i` (0/0 = 0), `D_i = min(Σ_j |M_ij||z_j| + |q_i|, ω_i)`. That a variable is d away from a bound counts as much as what it does
/// to the rows: `max_k |M_kj| d / D_k`. Therefore neither changes when rows or columns of the problem are multiplied by numbers.
///
/// | field of [`Measure`] | formula |
/// | --- | --- |
/// | `primal` | the largest `d_j` of a variable beyond a bound |
/// | `dual` | the largest error of an equality, and of a w whose sign no bound allows |
/// | `complementarity` | the largest error of a pair: the smaller of that of w and that of the distance from the bound that the sign of w asks for |
/// | `relative` | the largest of the three; **decides** |
/// | `absolute` | `‖(min(s_i z_i, w_i))_i‖₂`, `s_i` the largest modulus in row i, in the unit of q |
/// | `literature`, `siconos` | `‖min(z, w)‖₂ / ‖q‖₂`, as Siconos has it for an LCP |
///
/// The unit `ω_i` is what q and the bounds make of row i: `ω_i = max(|q_i|, max_j |M_ij| ζ_j)`, where `ζ_j = max_k |q_k| / |M_kj|`, at least the smaller
/// modulus of two finite bounds, is the unit of column j; what q does not reach gets its unit from its
/// neighbours, and where they have none the terms alone count. An entry of q that is the rounding of a sum that cancels, below 1e-12 of the largest load of its component in the units in
/// which the entries of M are near one (CurtisReid1972), is no unit either. Without it a z that
/// runs to infinity in the kernel of M would solve every problem. The relative error is thus one of q as well as one of the whole row.
///
/// A variable with an empty column is wrong unless it is exactly where it should be. Of an operator only products are known: `D_i = |q_i| + |(M z)_i| + s_i |z_i|`, and
/// a distance counts with `s_i / D_i`, `s_i` the modulus of the diagonal entry (1 where unknown).
#[derive(Debug, Clone, Default)]
pub struct LinearGauge {
    norm_q: f64,
    /// s
    largest: Vec<f64>,
    /// ω
    units: Vec<f64>,
    /// `max_k |M_kj| / ω_k`
    columns: Vec<f64>,
    /// Whether what has no unit has no connection with q either.
    closed: bool,
    /// D at the point last measured.
    scales: Vec<f64>,
    /// `max_k |M_kj| / D_k` at the point last measured.
    effects: Vec<f64>,
    w: Vec<f64>,
    noise: Noise,
    rows: Rows,
}

impl LinearGauge {
    pub(crate) fn new(problem: &impl InZ) -> Self {
        let mut gauge = Self::default();
        gauge.refill(problem);
        gauge
    }

    pub(crate) fn refill(&mut self, problem: &impl InZ) {
        let data = problem.data();
        let (m, n) = (data.q.len(), data.matrix.ncols());
        self.norm_q = norm(data.q);
        sizes(data.matrix, &mut self.largest);
        self.w.resize(m, 0.0);
        self.scales.resize(m, 0.0);
        self.effects.resize(n, 0.0);
        self.units.clear();
        self.units.extend(data.q.iter().map(|q| q.abs()));
        self.columns.clear();
        self.columns.extend((0..n).map(|j| match data.column_bounds(j) {
            (l, u) if data.bounds.is_some() => reach(l, u),
            _ => 0.0,
        }));
        let Self { units, columns, noise, w, .. } = self;
        self.closed = find_units(&[data.matrix], units, &mut [columns], noise, w);
        // Room that served for columns.
        self.w.resize(m, 0.0);
        self.rows.start(data.q);
    }

    pub(crate) fn measure(
        &mut self,
        problem: &impl InZ,
        point: &LcpPoint,
        precisely: bool,
    ) -> Measure {
        let data = problem.data();
        if !finite(&point.z) {
            // An empty column would hide it.
            return Measure::unknown();
        }
        self.rows.precisely(precisely);
        self.rows.start(data.q);
        let known = self.rows.add_matrix(1.0, data.matrix, &point.z);
        if !known {
            data.matrix.mul(&point.z, &mut self.w);
            self.rows.add_vector(&self.w);
        }
        self.w.iter_mut().zip(self.rows.values()).for_each(|(w, sum)| *w = sum);
        let mut visible = true;
        if known {
            let terms = self.rows.sizes().iter().zip(&self.units);
            self.scales.iter_mut().zip(terms).for_each(|(d, (terms, unit))| *d = terms.min(*unit));
            visible = find_effects(data.matrix, &point.z, &self.scales, &mut self.effects);
        } else {
            for (i, terms) in self.rows.sizes().iter().enumerate() {
                let j = data.variable(i).unwrap_or(i);
                let own = self.largest[i];
                self.scales[i] = terms + own * point.z.get(j).map_or(0.0, |z| z.abs());
                if let Some(j) = data.variable(i) {
                    self.effects[j] = own / self.scales[i];
                }
            }
        }
        let mut sum = Sum::new(self.norm_q);
        for i in 0..self.w.len() {
            match self.pair(&data, point, i) {
                None => sum.equality(i, self.w[i], share(self.w[i], self.scales[i])),
                Some(pair) => sum.pair(i, &pair, self.largest[i]),
            }
        }
        let measure = Measure { floor: precisely.then(|| self.floor()), ..sum.measure() };
        let exactly = |error| is_rounded(&data, &point.z, error);
        let measure = if visible { measure } else { unseen(measure, precisely, exactly) };
        rounding(measure, point.z.len() + 1, exactly)
    }

    /// The pair of row i at the point last measured, if it is no equality.
    fn pair(&self, data: &Data, point: &LcpPoint, i: usize) -> Option<Pair> {
        let j = data.variable(i)?;
        let (l, u) = data.bounds(i);
        let (w, error) = (self.w[i], share(self.w[i], self.scales[i]));
        Some(Pair { z: point.z[j], l, u, w, error, effect: self.effects[j] })
    }

    /// Puts variables on their bounds that are there but for rounding, boldly also those to zero that may have both signs: `point` is the one last measured. Says whether anything changed.
    pub(crate) fn tidy(&self, problem: &impl InZ, point: &mut LcpPoint, boldly: bool) -> bool {
        let data = problem.data();
        let mut changed = false;
        for i in data.equalities..self.w.len() {
            let (Some(pair), Some(j)) = (self.pair(&data, point, i), data.variable(i)) else {
                continue;
            };
            let unit = self.units[i];
            let z = if !boldly {
                pair.tidied()
            } else if unit.is_finite() || self.closed {
                pair.boldly_tidied(self.columns[j], 1.0 / unit)
            } else {
                pair.z
            };
            changed |= put(z, &mut point.z[j]);
        }
        for (j, z) in point.z.iter_mut().enumerate().filter(|_| boldly) {
            let (l, u) = data.column_bounds(j);
            let reached = self.columns[j] > 0.0 || self.closed;
            if reached && l < 0.0 && u > 0.0 {
                changed |= put(without_noise(*z, self.columns[j]), z);
            }
        }
        changed
    }

    fn floor(&self) -> f64 {
        floor(self.rows.sizes(), &self.scales)
    }

    pub(crate) fn verdict(
        &mut self,
        problem: &(impl InZ + Problem<Point = LcpPoint, Gauge = Self>),
        point: &LcpPoint,
        tolerance: f64,
    ) -> Verdict<RowStatus, RowCounts> {
        let measure = problem.certify(point, self);
        let data = problem.data();
        let rows = (0..self.w.len())
            .map(|i| self.pair(&data, point, i).ok_or_else(|| share(self.w[i], self.scales[i])));
        verdict(measure, rows, self.w.clone(), tolerance)
    }
}

/// The largest modulus of each row; of an operator its diagonal, else 1.
fn sizes(m: &Matrix, largest: &mut Vec<f64>) {
    largest.clear();
    largest.resize(m.nrows(), 0.0);
    if !m.for_each(|i, _, x| largest[i] = largest[i].max(x.abs())) {
        for (l, d) in largest.iter_mut().zip(m.diagonal().into_iter().flatten()) {
            *l = d.abs();
        }
    }
    largest.iter_mut().filter(|x| **x == 0.0).for_each(|x| *x = 1.0);
}

/// The smaller modulus of two bounds, 0 where there is none that is finite.
fn reach(l: f64, u: f64) -> f64 {
    let least = l.abs().min(u.abs());
    if least.is_finite() { least } else { 0.0 }
}

/// Whether z is an exact solution, rounded: with what is on a bound there, the equations of the others have a solution within its last bits, and all
/// signs are right there, in exact arithmetic. Where that is not too dear for a point with this error.
fn is_rounded(data: &Data, z: &[f64], error: f64) -> bool {
    if !worth_a_look(z.len().max(data.q.len()), error) {
        return false;
    }
    let mut rows = vec![vec![]; data.q.len()];
    if !data.matrix.for_each(|i, j, x| rows[i].push((j, x))) {
        return false;
    }
    let mut movable = vec![true; z.len()];
    for (j, movable) in movable.iter_mut().enumerate() {
        let (l, u) = data.column_bounds(j);
        *movable = l < z[j] && z[j] < u;
        if z[j] < l || z[j] > u {
            return false;
        }
    }
    let is_zero = |i: usize| data.variable(i).is_none_or(|j| movable[j]);
    let equations = (0..rows.len()).filter(|&i| is_zero(i)).map(|i| (rows[i].clone(), data.q[i]));
    let Some(x) = exactly_near(equations.collect(), z, &movable) else { return false };
    let mut pace = Pace::default();
    rows.iter().enumerate().filter(|(i, _)| !is_zero(*i)).all(|(i, row)| {
        let Some(w) = sum_of_products(data.q[i], row, &x, &mut pace) else { return false };
        let (l, u) = data.bounds(i);
        let at = data.variable(i).map_or(0.0, |j| z[j]);
        (at == l || w <= Exact::ZERO) && (at == u || w >= Exact::ZERO)
    })
}

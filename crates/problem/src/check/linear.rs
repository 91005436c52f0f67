//! The judge of linear complementarity problems.

use serde::Serialize;

use super::proof::{Exact, FEW, exact, exactly_near};
use super::rows::{Rows, doubt};
use super::{Judged, Measure, Verdict};
use crate::{BoxLcp, Hlcp, HlcpPoint, Lcp, LcpPoint, Mlcp, Problem};
use nonsmooth_linalg::{Matrix, norm};

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
    fn column_bounds(&self, j: usize) -> (f64, f64) {
        match self.bounds {
            Some((lower, upper)) => (lower[j], upper[j]),
            None if j < self.free => (f64::NEG_INFINITY, f64::INFINITY),
            None => (0.0, f64::INFINITY),
        }
    }
}

/// What an error is that nothing can be compared with: never accepted, and still finite.
const NEVER: f64 = f64::MAX;
/// Below this, products have rounding errors that no double holds.
const TINY: f64 = 1e-270;
/// So many times a row without a unit of its own looks for one in the columns that have one, and conversely.
const GENERATIONS: usize = 50;
/// In the units of the problem, not of the point: a distance of this size may be rounding,
const ROUNDING: f64 = 1e-12;
/// and one so much smaller than the partner's.
const SMALLER: f64 = 1e-3;

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
/// neighbours, and where they have none the terms alone count. Without it a z that
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
    rows: Rows,
}

/// The judge's constants and buffers for a horizontal LCP.
///
/// As for [`LinearGauge`]: the rows `Q x + R s − q` are equalities with `D_i = min(Σ_j |Q_ij||x_j| + Σ_j |R_ij||s_j| + |q_i|, ω_i)`, and a pair is as good as the
/// better one of x and s is zero: `min(max_k |Q_kj| x_j / D_k, max_k |R_kj| s_j / D_k)`. `absolute` is that of the equalities and of `min(c_j x_j, d_j s_j)`, with
/// `c_j`, `d_j` the largest moduli in column j of Q and R. The rows of pairs follow those of the equalities.
#[derive(Debug, Clone, Default)]
pub struct HlcpGauge {
    norm_q: f64,
    c: Vec<f64>,
    d: Vec<f64>,
    units: Vec<f64>,
    columns: [Vec<f64>; 2],
    closed: bool,
    scales: Vec<f64>,
    effects: [Vec<f64>; 2],
    w: Vec<f64>,
    rows: Rows,
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

/// The error of a sum in units of D.
fn share(w: f64, scale: f64) -> f64 {
    if w == 0.0 {
        0.0
    } else if scale > 0.0 && scale.is_finite() || scale.is_nan() {
        capped(w.abs() / scale)
    } else {
        NEVER
    }
}

/// The error of a distance that matters so much.
fn distance(d: f64, effect: f64) -> f64 {
    if d == 0.0 {
        0.0
    } else if effect == 0.0 {
        // Nothing feels it, so that nothing hinders it from being exact.
        NEVER
    } else {
        capped(d * effect)
    }
}

/// As [`distance`], of one that may be undone: what nothing feels does not matter.
fn matters(d: f64, effect: f64) -> f64 {
    if d == 0.0 { 0.0 } else { d * effect }
}

/// Finite unless not a number.
fn capped(x: f64) -> f64 {
    if x > NEVER { NEVER } else { x }
}

/// The larger one; a NaN is the worst there is.
fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

/// A variable, its bounds and its partner.
struct Pair {
    z: f64,
    l: f64,
    u: f64,
    /// Of w only the sign counts,
    w: f64,
    /// and its error as a sum that should be zero.
    error: f64,
    /// What a distance of z counts.
    effect: f64,
}

impl Pair {
    /// The bound that the sign of w asks for.
    fn towards(&self) -> f64 {
        if self.w > 0.0 { self.l } else { self.u }
    }

    fn primal(&self) -> f64 {
        distance((self.l - self.z).max(self.z - self.u).max(0.0), self.effect)
    }

    fn dual(&self) -> f64 {
        if self.w == 0.0 || self.towards().is_finite() { 0.0 } else { self.error }
    }

    fn complementarity(&self) -> f64 {
        let bound = self.towards();
        if self.w.is_nan() {
            f64::NAN
        } else if self.w == 0.0 || !bound.is_finite() {
            0.0
        } else {
            self.error.min(distance((self.z - bound).abs(), self.effect))
        }
    }

    fn worst(&self) -> f64 {
        worse(worse(self.primal(), self.dual()), self.complementarity())
    }

    fn status(&self) -> RowStatus {
        let Self { z, l, u, w, error, effect } = *self;
        if w >= 0.0 && distance((z - l).max(0.0), effect) <= error {
            RowStatus::Lower
        } else if w <= 0.0 && distance((u - z).max(0.0), effect) <= error {
            RowStatus::Upper
        } else {
            RowStatus::Inside
        }
    }

    fn degenerate(&self, tolerance: f64) -> bool {
        let nearest = (self.z - self.l).abs().min((self.u - self.z).abs());
        self.l < self.u && self.error <= tolerance && distance(nearest, self.effect) <= tolerance
    }

    /// z between its bounds, and on the one that w asks for where that is no worse than to let z be.
    fn tidied(&self) -> f64 {
        let z = self.z.max(self.l).min(self.u);
        let bound = self.towards();
        let better = self.w != 0.0
            && bound.is_finite()
            && matters((z - bound).abs(), self.effect) <= self.error;
        if better { bound } else { z }
    }

    /// As [`tidied`](Self::tidied) in the units of the problem, in which rows of nothing but rounding hide nothing: z and w count `distance` and `size` a unit.
    /// A z that no unit reaches is as well on its bound.
    fn boldly_tidied(&self, distance: f64, size: f64) -> f64 {
        let z = self.z.max(self.l).min(self.u);
        let w = (self.w * size).abs();
        let near = |bound: f64| {
            let d = matters((z - bound).abs(), distance);
            bound.is_finite() && (d <= SMALLER * w || d.max(w) <= ROUNDING)
        };
        let bound = self.towards();
        let other = if self.w > 0.0 { self.u } else { self.l };
        if near(bound) {
            bound
        } else if w <= ROUNDING && near(other) {
            other
        } else {
            z
        }
    }
}

/// What the judge adds up, row by row.
struct Sum {
    unit: f64,
    scaled: f64,
    plain: f64,
    primal: f64,
    dual: f64,
    complementarity: f64,
    worst: (usize, f64),
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
            worst: (0, -1.0),
        }
    }

    /// A pair with its partner in the unit of w; `s` makes z comparable to it.
    fn pair(&mut self, i: usize, pair: &Pair, s: f64) {
        let Pair { z, l, u, w, .. } = *pair;
        self.scaled += (natural(s * z, w, s * l, s * u) / self.unit).powi(2);
        self.plain += (natural(z, w, l, u) / self.unit).powi(2);
        self.primal = worse(self.primal, pair.primal());
        self.dual = worse(self.dual, pair.dual());
        self.complementarity = worse(self.complementarity, pair.complementarity());
        self.note(i, pair.worst());
    }

    fn equality(&mut self, i: usize, w: f64, error: f64) {
        self.scaled += (w / self.unit).powi(2);
        self.plain += (w / self.unit).powi(2);
        self.dual = worse(self.dual, error);
        self.note(i, error);
    }

    fn note(&mut self, i: usize, error: f64) {
        if error > self.worst.1 || error.is_nan() {
            self.worst = (i, error);
        }
    }

    fn measure(self) -> Measure {
        let Self { primal, dual, complementarity, .. } = self;
        Measure {
            absolute: self.scaled.sqrt() * self.unit,
            relative: worse(worse(primal, dual), complementarity),
            literature: self.plain.sqrt(),
            siconos: self.plain.sqrt(),
            primal,
            dual,
            complementarity,
            worst_contact: self.worst.0,
            worst: worse(self.worst.1, 0.0),
            ..Measure::unknown()
        }
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

/// ω from the moduli of q in `units`, infinite where nothing is known; from those of bounds in `columns`, one for each matrix, what a distance counts in them.
/// Whether the rest is known to have no connection. `next` is room.
///
/// Products, quotients and maxima only: whatever powers of two the rows and columns are multiplied by, the units go with them to the last bit.
fn find_units(
    matrices: &[&Matrix],
    units: &mut [f64],
    columns: &mut [&mut Vec<f64>],
    next: &mut Vec<f64>,
) -> bool {
    let mut closed = false;
    for generation in 0..GENERATIONS {
        // The first time everybody listens, later who has no unit yet.
        let open = |x: f64| generation == 0 || x == 0.0;
        let mut grown = false;
        for (m, columns) in matrices.iter().zip(columns.iter_mut()) {
            next.clear();
            next.resize(columns.len(), 0.0);
            m.for_each(|i, j, x| {
                if x != 0.0 && open(columns[j]) {
                    next[j] = next[j].max(units[i] / x.abs());
                }
            });
            for (to, &from) in columns.iter_mut().zip(next.iter()) {
                grown |= from > *to;
                *to = to.max(from);
            }
        }
        next.clear();
        next.resize(units.len(), 0.0);
        for (m, columns) in matrices.iter().zip(columns.iter()) {
            m.for_each(|i, j, x| {
                if open(units[i]) {
                    next[i] = next[i].max(x.abs() * columns[j]);
                }
            });
        }
        for (to, &from) in units.iter_mut().zip(next.iter()) {
            grown |= from > *to;
            *to = to.max(from);
        }
        closed = !grown || units.iter().all(|x| *x > 0.0);
        if closed {
            break;
        }
    }
    units.iter_mut().filter(|x| **x == 0.0).for_each(|x| *x = f64::INFINITY);
    for (m, columns) in matrices.iter().zip(columns.iter_mut()) {
        columns.fill(0.0);
        m.for_each(|i, j, x| columns[j] = columns[j].max(x.abs() / units[i]));
    }
    closed
}

/// `max_k |A_kj| / D_k` into `effects`. False where a row's terms are so small that its rounding cannot be told.
fn find_effects(a: &Matrix, x: &[f64], scales: &[f64], effects: &mut [f64]) -> bool {
    effects.fill(0.0);
    let mut visible = true;
    a.for_each(|i, j, v| {
        if v != 0.0 {
            effects[j] = effects[j].max(v.abs() / scales[i]);
            visible &= x[j] == 0.0 || scales[i] >= TINY;
        }
    });
    visible
}

/// The smaller modulus of two bounds, 0 where there is none that is finite.
fn reach(l: f64, u: f64) -> f64 {
    let least = l.abs().min(u.abs());
    if least.is_finite() { least } else { 0.0 }
}

fn finite(x: &[f64]) -> bool {
    x.iter().all(|x| x.is_finite())
}

impl LinearGauge {
    pub(crate) fn new(problem: &impl Stated) -> Self {
        let mut gauge = Self::default();
        gauge.refill(problem);
        gauge
    }

    pub(crate) fn refill(&mut self, problem: &impl Stated) {
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
        let Self { units, columns, w, .. } = self;
        self.closed = find_units(&[data.matrix], units, &mut [columns], w);
        // Room that served for columns.
        self.w.resize(m, 0.0);
        self.rows.start(data.q);
    }

    pub(crate) fn measure(
        &mut self,
        problem: &impl Stated,
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
        let measure = if visible { measure } else { Measure { relative: NEVER, ..measure } };
        rounding(measure, point.z.len() + 1, || is_rounded(&data, &point.z))
    }

    /// The pair of row i at the point last measured, if it is no equality.
    fn pair(&self, data: &Data, point: &LcpPoint, i: usize) -> Option<Pair> {
        let j = data.variable(i)?;
        let (l, u) = data.bounds(i);
        let (w, error) = (self.w[i], share(self.w[i], self.scales[i]));
        Some(Pair { z: point.z[j], l, u, w, error, effect: self.effects[j] })
    }

    /// Puts variables on their bounds that are there but for rounding: `point` is the one last measured. Says whether anything changed.
    pub(crate) fn tidy(&self, problem: &impl Stated, point: &mut LcpPoint, boldly: bool) -> bool {
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
        changed
    }

    fn floor(&self) -> f64 {
        floor(self.rows.sizes(), &self.scales)
    }

    fn verdict(
        &mut self,
        problem: &(impl Stated + Problem<Point = LcpPoint, Gauge = Self>),
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

/// The measure of a point whose errors may be those of its rounding alone: where that is so, they count as one bit. What doubled precision leaves in
/// doubt of sums of `terms` terms is added: of terms 1e30 times larger than the row's unit nobody can tell that they vanish.
fn rounding(measure: Measure, terms: usize, is_rounded: impl FnOnce() -> bool) -> Measure {
    /// Beyond so many floors nothing is explained by rounding.
    const REACH: f64 = 100.0;
    let bit = f64::EPSILON;
    let in_doubt = measure.floor.map_or(0.0, |floor| floor * doubt(terms) / (0.5 * bit));
    let in_doubt = if in_doubt > bit { in_doubt } else { 0.0 };
    let measure = Measure { relative: measure.relative + in_doubt, ..measure };
    match measure.floor {
        Some(floor) if measure.relative > 1e-14 && measure.relative <= REACH * floor => {}
        _ => return measure,
    }
    if !is_rounded() {
        return measure;
    }
    let least = |x: f64| x.min(bit);
    Measure {
        relative: bit,
        primal: least(measure.primal),
        dual: least(measure.dual),
        worst: least(measure.worst),
        ..measure
    }
}

/// Whether z is an exact solution, rounded: with what is on a bound there, the equations of the others have a solution within its last bits, and all
/// signs are right there, in exact arithmetic. Of few variables only.
fn is_rounded(data: &Data, z: &[f64]) -> bool {
    if z.len() > FEW || data.q.len() > FEW {
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
    rows.iter().enumerate().filter(|(i, _)| !is_zero(*i)).all(|(i, row)| {
        let terms = row.iter().map(|&(j, a)| exact(a) * &x[j]);
        let w = terms.fold(exact(data.q[i]), |sum, term| sum + term);
        let (l, u) = data.bounds(i);
        let at = data.variable(i).map_or(0.0, |j| z[j]);
        (at == l || w <= Exact::ZERO) && (at == u || w >= Exact::ZERO)
    })
}

/// The same of a horizontal problem.
fn is_rounded_pair(problem: &Hlcp, HlcpPoint { x, s }: &HlcpPoint) -> bool {
    let n = x.len();
    let mut rows = vec![vec![]; n];
    let known = 2 * n <= FEW
        && problem.Q.for_each(|i, j, a| rows[i].push((j, a)))
        && problem.R.for_each(|i, j, a| rows[i].push((n + j, a)));
    let complementary = x.iter().zip(s).all(|(x, s)| x.min(*s) == 0.0);
    if !(known && complementary) {
        return false;
    }
    let values = [&x[..], s].concat();
    let movable: Vec<bool> = values.iter().map(|x| *x > 0.0).collect();
    let equations = rows.into_iter().zip(&problem.q).map(|(row, q)| (row, -q));
    // Within the last bit of a positive number all are positive.
    exactly_near(equations.collect(), &values, &movable).is_some()
}

/// The largest error that a change of all variables by half their last bit makes.
fn floor(terms: &[f64], scales: &[f64]) -> f64 {
    let rows = terms.iter().zip(scales).filter(|(_, d)| **d > 0.0);
    0.5 * f64::EPSILON * rows.fold(0.0_f64, |most, (terms, d)| most.max(terms / d))
}

/// Overwrites `to`; whether that changed it.
fn put(x: f64, to: &mut f64) -> bool {
    let changed = x != *to;
    *to = x;
    changed
}

impl HlcpGauge {
    pub(crate) fn new(problem: &Hlcp) -> Self {
        let mut gauge = Self::default();
        gauge.refill(problem);
        gauge
    }

    pub(crate) fn refill(&mut self, problem: &Hlcp) {
        let n = problem.q.len();
        self.norm_q = norm(&problem.q);
        for (m, size) in [(&problem.Q, &mut self.c), (&problem.R, &mut self.d)] {
            size.clear();
            size.resize(m.ncols(), 0.0);
            m.for_each(|_, j, x| size[j] = size[j].max(x.abs()));
            size.iter_mut().filter(|x| **x == 0.0).for_each(|x| *x = 1.0);
        }
        for v in self.effects.iter_mut().chain([&mut self.w, &mut self.scales]) {
            v.resize(n, 0.0);
        }
        for v in &mut self.columns {
            v.clear();
            v.resize(n, 0.0);
        }
        self.units.clear();
        self.units.extend(problem.q.iter().map(|q| q.abs()));
        let [of_q, of_r] = &mut self.columns;
        let parts = [&problem.Q, &problem.R];
        self.closed = find_units(&parts, &mut self.units, &mut [of_q, of_r], &mut self.w);
        self.rows.start(&problem.q);
    }

    pub(crate) fn measure(
        &mut self,
        problem: &Hlcp,
        point: &HlcpPoint,
        precisely: bool,
    ) -> Measure {
        if !(finite(&point.x) && finite(&point.s)) {
            return Measure::unknown();
        }
        let parts = [(&problem.Q, &point.x), (&problem.R, &point.s)];
        self.rows.precisely(precisely);
        self.rows.start_at_zero(problem.q.len());
        self.w.iter_mut().zip(&problem.q).for_each(|(w, q)| *w = -q);
        self.rows.add_vector(&self.w);
        for (m, x) in parts {
            if !self.rows.add_matrix(1.0, m, x) {
                m.mul(x, &mut self.w);
                self.rows.add_vector(&self.w);
            }
        }
        self.w.iter_mut().zip(self.rows.values()).for_each(|(w, sum)| *w = sum);
        let operators = parts.iter().any(|(m, _)| matches!(m, Matrix::Operator(_)));
        let terms = self.rows.sizes().iter().zip(&self.units);
        for (d, (terms, unit)) in self.scales.iter_mut().zip(terms) {
            *d = if operators { *terms } else { terms.min(*unit) };
        }
        let mut visible = true;
        for ((m, x), effects) in parts.into_iter().zip(&mut self.effects) {
            if let Matrix::Operator(_) = m {
                effects.iter_mut().zip(&self.scales).for_each(|(e, d)| *e = 1.0 / d);
            } else {
                visible &= find_effects(m, x, &self.scales, effects);
            }
        }
        let mut sum = Sum::new(self.norm_q);
        for (i, (&w, &scale)) in self.w.iter().zip(&self.scales).enumerate() {
            sum.equality(i, w, share(w, scale));
        }
        let n = self.w.len();
        for i in 0..n {
            let (pair, d) = (self.pair(point, i), self.d[i]);
            sum.pair(n + i, &Pair { w: d * pair.w, ..pair }, self.c[i]);
        }
        let measure = Measure { floor: precisely.then(|| self.floor()), ..sum.measure() };
        let measure = if visible { measure } else { Measure { relative: NEVER, ..measure } };
        rounding(measure, 2 * n + 1, || is_rounded_pair(problem, point))
    }

    fn floor(&self) -> f64 {
        floor(self.rows.sizes(), &self.scales)
    }

    fn pair(&self, point: &HlcpPoint, i: usize) -> Pair {
        let (x, s) = (point.x[i], point.s[i]);
        let [effect, of_s] = [self.effects[0][i], self.effects[1][i]];
        Pair { z: x, l: 0.0, u: f64::INFINITY, w: s, error: distance(s.abs(), of_s), effect }
    }

    /// As [`LinearGauge::tidy`]: of each pair the side is put to zero whose size matters less, and what is negative.
    pub(crate) fn tidy(&self, point: &mut HlcpPoint, boldly: bool) -> bool {
        let mut changed = false;
        let [of_x, of_s] = if boldly { &self.columns } else { &self.effects };
        for i in 0..self.w.len() {
            let (x, s) = (point.x[i].max(0.0), point.s[i].max(0.0));
            let (by_x, by_s) = (matters(x, of_x[i]), matters(s, of_s[i]));
            let (x, s) = if boldly && by_x.max(by_s) <= ROUNDING && self.closed {
                (0.0, 0.0)
            } else if by_x <= by_s {
                (0.0, s)
            } else {
                (x, 0.0)
            };
            changed |= put(x, &mut point.x[i]);
            changed |= put(s, &mut point.s[i]);
        }
        changed
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
    /// Rows without a bound, whose w must be zero.
    pub equalities: usize,
    /// Pairs, counted above as well, that are zero on both sides within the tolerance.
    pub degenerate: usize,
}

/// From each row's pair, or the error of an equality.
fn verdict(
    measure: Measure,
    rows: impl Iterator<Item = Result<Pair, f64>>,
    w: Vec<f64>,
    tolerance: f64,
) -> Verdict<RowStatus, RowCounts> {
    let mut counts = RowCounts::default();
    let (mut statuses, mut worst) = (vec![], vec![]);
    for (i, row) in rows.enumerate() {
        let (status, error) = match row {
            Err(error) => (RowStatus::Equality, error),
            Ok(pair) => {
                counts.degenerate += usize::from(pair.degenerate(tolerance));
                (pair.status(), pair.worst())
            }
        };
        match status {
            RowStatus::Inside => counts.inside += 1,
            RowStatus::Lower => counts.lower += 1,
            RowStatus::Upper => counts.upper += 1,
            RowStatus::Equality => counts.equalities += 1,
        }
        statuses.push(status);
        worst.push((i, error));
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

            fn verdict(
                &self,
                point: &LcpPoint,
                gauge: &mut LinearGauge,
                tolerance: f64,
            ) -> Verdict<RowStatus, RowCounts> {
                gauge.verdict(self, point, tolerance)
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
    fn verdict(
        &self,
        point: &HlcpPoint,
        gauge: &mut HlcpGauge,
        tolerance: f64,
    ) -> Verdict<RowStatus, RowCounts> {
        let measure = self.certify(point, gauge);
        let equalities = gauge.w.iter().zip(&gauge.scales).map(|(w, d)| Err(share(*w, *d)));
        let pairs = (0..self.dim()).map(|i| Ok(gauge.pair(point, i)));
        verdict(measure, equalities.chain(pairs), gauge.w.clone(), tolerance)
    }
}

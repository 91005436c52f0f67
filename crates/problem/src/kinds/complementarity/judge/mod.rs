//! The judges of complementarity problems: what an error is, of a row and of a pair, and what it is measured in.

mod linear;
mod noise;
mod terms;

pub use linear::LinearGauge;
pub(super) use linear::{Data, InZ};
pub(crate) use noise::Noise;
pub(crate) use terms::{Terms, Units, to_the_edge};

use serde::Serialize;

use crate::check::rows::doubt;
use crate::check::{Measure, Verdict};
use crate::field::Pattern;
use nonsmooth_linalg::Matrix;

/// What an error is that nothing can be compared with: never accepted, and still finite.
pub(crate) const NEVER: f64 = f64::MAX;
/// Below this, products have rounding errors that no double holds.
pub(crate) const TINY: f64 = 1e-270;
/// So many times a row without a unit of its own looks for one in the columns that have one, and conversely.
pub(crate) const GENERATIONS: usize = 50;
/// In the units of the problem, not of the point: a distance of this size may be rounding,
pub(crate) const ROUNDING: f64 = 1e-12;
/// and one so much smaller than the partner's.
pub(crate) const SMALLER: f64 = 1e-3;

/// `x − P(x − w)`, P the projection on `[l, u]`. Zero where x and w obey the law.
pub(crate) fn natural(x: f64, w: f64, l: f64, u: f64) -> f64 {
    // The smaller of the two differences is computed without the larger. A bound that is infinite is none, though x may be beyond the doubles.
    if x - w <= l && l > f64::NEG_INFINITY {
        x - l
    } else if x - w >= u && u < f64::INFINITY {
        x - u
    } else {
        w
    }
}

/// The error of a sum in units of D.
pub(crate) fn share(w: f64, scale: f64) -> f64 {
    if w == 0.0 {
        0.0
    } else if scale > 0.0 && scale.is_finite() || scale.is_nan() {
        capped(w.abs() / scale)
    } else {
        NEVER
    }
}

/// The error of a distance that matters so much.
pub(crate) fn distance(d: f64, effect: f64) -> f64 {
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
pub(crate) fn matters(d: f64, effect: f64) -> f64 {
    if d == 0.0 { 0.0 } else { d * effect }
}

/// Finite unless not a number.
pub(crate) fn capped(x: f64) -> f64 {
    if x > NEVER { NEVER } else { x }
}

/// The larger one; a NaN is the worst there is.
pub(crate) fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

/// A variable, its bounds and its partner.
pub(crate) struct Pair {
    pub(crate) z: f64,
    pub(crate) l: f64,
    pub(crate) u: f64,
    /// Of w only the sign counts,
    pub(crate) w: f64,
    /// and its error as a sum that should be zero.
    pub(crate) error: f64,
    /// What a distance of z counts.
    pub(crate) effect: f64,
}

impl Pair {
    /// The bound that the sign of w asks for.
    pub(crate) fn towards(&self) -> f64 {
        if self.w > 0.0 { self.l } else { self.u }
    }

    pub(crate) fn primal(&self) -> f64 {
        distance((self.l - self.z).max(self.z - self.u).max(0.0), self.effect)
    }

    pub(crate) fn dual(&self) -> f64 {
        if self.w == 0.0 || self.towards().is_finite() { 0.0 } else { self.error }
    }

    pub(crate) fn complementarity(&self) -> f64 {
        let bound = self.towards();
        if self.w.is_nan() {
            f64::NAN
        } else if self.w == 0.0 || !bound.is_finite() {
            0.0
        } else {
            self.error.min(distance((self.z - bound).abs(), self.effect))
        }
    }

    /// Whether w is excused by the nearness of the bound that its sign asks for.
    pub(crate) fn is_excused(&self) -> bool {
        self.dual().max(self.complementarity()) < self.error
    }

    pub(crate) fn worst(&self) -> f64 {
        worse(worse(self.primal(), self.dual()), self.complementarity())
    }

    pub(crate) fn status(&self) -> RowStatus {
        let Self { z, l, u, w, error, effect } = *self;
        if w >= 0.0 && distance((z - l).max(0.0), effect) <= error {
            RowStatus::Lower
        } else if w <= 0.0 && distance((u - z).max(0.0), effect) <= error {
            RowStatus::Upper
        } else {
            RowStatus::Inside
        }
    }

    /// Whether w is zero and z on a bound, within the tolerance.
    pub(crate) fn vanishes(&self, tolerance: f64) -> bool {
        let nearest = (self.z - self.l).abs().min((self.u - self.z).abs());
        self.error <= tolerance && distance(nearest, self.effect) <= tolerance
    }

    /// z between its bounds, and on the one that w asks for where that is no worse than to let z be.
    pub(crate) fn tidied(&self) -> f64 {
        let z = self.z.max(self.l).min(self.u);
        let bound = self.towards();
        let better = self.w != 0.0
            && bound.is_finite()
            && matters((z - bound).abs(), self.effect) <= self.error;
        if better { bound } else { z }
    }

    /// As [`tidied`](Self::tidied) in the units of the problem, in which rows of nothing but rounding hide nothing: z and w count `distance` and `size` a unit.
    /// A z that no unit reaches is as well on its bound.
    pub(crate) fn boldly_tidied(&self, distance: f64, size: f64) -> f64 {
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

/// A variable that may have both signs; zero where it is so but for rounding in the units of the problem, in which a unit of it counts `distance`. A row whose terms all vanish at a
/// solution would make an error of 1 of that rounding.
pub(crate) fn without_noise(z: f64, distance: f64) -> f64 {
    if matters(z.abs(), distance) <= ROUNDING { 0.0 } else { z }
}

/// What the judge adds up, row by row.
pub(crate) struct Sum {
    pub(crate) unit: f64,
    pub(crate) scaled: f64,
    pub(crate) plain: f64,
    pub(crate) primal: f64,
    pub(crate) dual: f64,
    pub(crate) complementarity: f64,
    pub(crate) worst: (usize, f64),
}

impl Sum {
    pub(crate) fn new(norm_q: f64) -> Self {
        Self {
            // Beyond the doubles the largest of them, within a small factor.
            unit: if norm_q > 0.0 { norm_q.min(f64::MAX) } else { 1.0 },
            scaled: 0.0,
            plain: 0.0,
            primal: 0.0,
            dual: 0.0,
            complementarity: 0.0,
            worst: (0, -1.0),
        }
    }

    /// A pair with its partner in the unit of w; `s` makes z comparable to it.
    pub(crate) fn pair(&mut self, i: usize, pair: &Pair, s: f64) {
        let Pair { z, l, u, w, .. } = *pair;
        self.scaled += (natural(s * z, w, s * l, s * u) / self.unit).powi(2);
        self.plain += (natural(z, w, l, u) / self.unit).powi(2);
        self.primal = worse(self.primal, pair.primal());
        self.dual = worse(self.dual, pair.dual());
        self.complementarity = worse(self.complementarity, pair.complementarity());
        self.note(i, pair.worst());
    }

    pub(crate) fn equality(&mut self, i: usize, w: f64, error: f64) {
        self.scaled += (w / self.unit).powi(2);
        self.plain += (w / self.unit).powi(2);
        self.dual = worse(self.dual, error);
        self.note(i, error);
    }

    pub(crate) fn note(&mut self, i: usize, error: f64) {
        if error > self.worst.1 || error.is_nan() {
            self.worst = (i, error);
        }
    }

    pub(crate) fn measure(self) -> Measure {
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

/// The size of a row's terms; that of their sum where it is none, or less.
pub(crate) fn size_of_row(terms: f64, sum: f64) -> f64 {
    if terms.is_finite() { terms.max(sum.abs()) } else { sum.abs() }
}

/// The smaller of two units; the other where one is zero: not known.
pub(crate) fn lesser(a: f64, b: f64) -> f64 {
    if a > 0.0 && b > 0.0 { a.min(b) } else { a.max(b) }
}

/// How large a variable that starts at `start` is at most, as far as its bounds say: the smaller modulus of two of them, for one that is far off says nothing; infinite where none is finite
/// and other than zero.
pub(crate) fn reach(start: f64, lower: f64, upper: f64) -> f64 {
    let size = |bound: f64| if bound.is_finite() { bound.abs() } else { 0.0 };
    let bounds = lesser(size(lower), size(upper));
    if bounds > 0.0 { bounds.max(start.abs()) } else { f64::INFINITY }
}

/// Units of rows that have none, from their neighbours: `ω_i = max_j |J_ij| ζ_j`, `ζ_j = max_k ω_k / |J_kj|`, at most the reach of variable j.
pub(crate) fn hand_on(
    units: &mut Vec<f64>,
    pattern: &Pattern,
    jacobian: &[f64],
    reach: impl Fn(usize) -> f64,
) {
    let mut columns = vec![0.0_f64; units.len()];
    for _ in 0..GENERATIONS {
        if units.iter().all(|u| *u > 0.0) {
            return;
        }
        let places = || pattern.places().zip(jacobian).filter(|(_, a)| **a != 0.0);
        for ((k, j), a) in places().filter(|((k, _), _)| units[*k] > 0.0) {
            columns[j] = columns[j].max((units[k] / a.abs()).min(reach(j)));
        }
        let mut grown = false;
        let mut next = units.clone();
        for ((i, j), a) in places().filter(|((i, _), _)| units[*i] == 0.0) {
            let unit = a.abs() * columns[j];
            if unit > next[i] && unit.is_finite() {
                (next[i], grown) = (unit, true);
            }
        }
        *units = next;
        if !grown {
            return;
        }
    }
}

/// ω from the moduli of q in `units`, infinite where nothing is known; from those of bounds in `columns`, one for each matrix, what a distance counts in them.
/// Whether the rest is known to have no connection. Entries of q that are the rounding of sums that cancel count as zero ([`Noise`]). `next` is room.
pub(crate) fn find_units(
    matrices: &[&Matrix],
    units: &mut [f64],
    columns: &mut [&mut Vec<f64>],
    noise: &mut Noise,
    next: &mut Vec<f64>,
) -> bool {
    noise.keep(units, columns);
    let mut closed = spread(matrices, units, columns, next);
    if Noise::jumps(matrices, units, next) && noise.without(matrices, units, columns) {
        closed = spread(matrices, units, columns, next);
    }
    units.iter_mut().filter(|x| **x == 0.0).for_each(|x| *x = f64::INFINITY);
    for (m, columns) in matrices.iter().zip(columns.iter_mut()) {
        columns.fill(0.0);
        m.for_each(|i, j, x| columns[j] = columns[j].max(x.abs() / units[i]));
    }
    closed
}

/// Units from neighbour to neighbour, zero where nothing is known; whether the rest is known to have no connection.
///
/// Products, quotients and maxima only: whatever powers of two the rows and columns are multiplied by, the units go with them to the last bit. What is beyond the doubles is the
/// largest of them, since infinity means that nothing is known.
fn spread(
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
                    next[j] = next[j].max(capped(units[i] / x.abs()));
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
                    next[i] = next[i].max(capped(x.abs() * columns[j]));
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
    closed
}

/// `max_k |A_kj| / D_k` into `effects`. False where a row's terms are so small that its rounding cannot be told.
pub(crate) fn find_effects(a: &Matrix, x: &[f64], scales: &[f64], effects: &mut [f64]) -> bool {
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

pub(crate) fn finite(x: &[f64]) -> bool {
    x.iter().all(|x| x.is_finite())
}

/// The measure of a point with a row whose terms are so small that their rounding cannot be told: only exact arithmetic accepts it. Plain arithmetic lets it pass, so
/// that the question comes up.
pub(crate) fn unseen(
    measure: Measure,
    precisely: bool,
    is_rounded: impl FnOnce(f64) -> bool,
) -> Measure {
    match !precisely || is_rounded(NEVER) {
        true => measure,
        false => Measure { relative: NEVER, ..measure },
    }
}

/// The measure of a point whose errors may be those of its rounding alone: where that is so, which `is_rounded` is asked with the error, they count as one bit. What doubled precision leaves in
/// doubt of sums of `terms` terms is added: of terms 1e30 times larger than the row's unit nobody can tell that they vanish.
pub(crate) fn rounding(
    measure: Measure,
    terms: usize,
    is_rounded: impl FnOnce(f64) -> bool,
) -> Measure {
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
    if !is_rounded(measure.relative) {
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

/// The largest error that a change of all variables by half their last bit makes.
pub(crate) fn floor(terms: &[f64], scales: &[f64]) -> f64 {
    let rows = terms.iter().zip(scales).filter(|(_, d)| **d > 0.0);
    0.5 * f64::EPSILON * rows.fold(0.0_f64, |most, (terms, d)| most.max(capped(*terms) / d))
}

/// Overwrites `to`; whether that changed it.
pub(crate) fn put(x: f64, to: &mut f64) -> bool {
    let changed = x != *to;
    *to = x;
    changed
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
    /// As `degenerate`, and not among those, of pairs with equal bounds: the solution stays as it is, but follows the one bound or the other.
    #[serde(skip)]
    pub fixed: usize,
}

/// From each row's pair, or the error of an equality.
pub(crate) fn verdict(
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
                let vanishing = usize::from(pair.vanishes(tolerance));
                let of = if pair.l < pair.u { &mut counts.degenerate } else { &mut counts.fixed };
                *of += vanishing;
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

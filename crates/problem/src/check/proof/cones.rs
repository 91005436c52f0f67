//! A problem as a union of polyhedral cones, in exact numbers, and the vectors that separate its right-hand side from them.

use std::cmp::Ordering;

use nonsmooth_linalg::{Compensated, budget};

use super::exact::{Equation, Exact, double, exact, negative, rounded, satisfying};
use super::sectors::Spatial;
use super::statement::exacts;

/// A column of a [`ConeSystem`]: its entries by row.
pub type Column = Vec<(usize, Exact)>;

/// `Σ_j t_j A_j = b`, where t_j is free, or nonnegative, or nonnegative and one of a pair of which one is zero.
///
/// Every linear complementarity problem, and every contact problem in the plane or without friction, is of this form exactly; of contact with friction in
/// space it is a relaxation (`complete` is false). It is stated from the stored doubles without rounding
/// ([`crate::Problem::cones`]): products of coefficients, and differences of bounds, are rational numbers.
#[derive(Debug, Clone, Default)]
pub struct ConeSystem {
    /// b.
    pub rhs: Vec<Exact>,
    /// A, by columns; of rows that were not asked for nothing is kept.
    pub columns: Vec<Column>,
    /// Columns with a free coefficient.
    pub free: Vec<usize>,
    /// Columns with a nonnegative coefficient.
    pub rays: Vec<usize>,
    /// Pairs of columns with nonnegative coefficients, at most one of them positive.
    pub pairs: Vec<[usize; 2]>,
    /// What the coefficients say of the problem's unknowns: `x = constant + Σ factor · t_j`, in the order of the problem's point.
    pub unknowns: Vec<(Exact, Vec<(usize, Exact)>)>,
    /// Whether the system says all that the problem says.
    pub complete: bool,
    /// Contacts in space with friction, where there are few: what is said of them above is little, see [`sectors`](super::sectors).
    pub(crate) spatial: Vec<Spatial>,
    /// Rows that define bounds, and the two columns (with the entry ±1 there) that are their slacks.
    pub(crate) slack_rows: Vec<(usize, [usize; 2])>,
    /// Entries of other rows are left out.
    pub(crate) wanted: Option<Vec<bool>>,
}

impl ConeSystem {
    /// A system with the right-hand side b; with `wanted`, entries in rows where it is false are left out.
    pub(crate) fn new(rhs: Vec<Exact>, wanted: Option<&[bool]>) -> Self {
        let wanted = wanted.map(|w| {
            let mut w = w.to_vec();
            // Rows beyond those of the problem define slacks, and are few.
            w.resize(rhs.len().max(w.len()), true);
            w
        });
        Self { rhs, complete: true, wanted, ..Self::default() }
    }

    pub(crate) fn wants(&self, row: usize) -> bool {
        self.wanted.as_ref().is_none_or(|w| w.get(row).copied().unwrap_or(true))
    }

    /// A new row with this right-hand side.
    pub(crate) fn row(&mut self, rhs: Exact) -> usize {
        self.rhs.push(rhs);
        self.rhs.len() - 1
    }

    /// A new column.
    pub(crate) fn column(&mut self, mut entries: Column) -> usize {
        entries.retain(|(i, x)| self.wants(*i) && !x.is_zero());
        entries.sort_by_key(|e| e.0);
        entries.dedup_by(|b, a| {
            let same = a.0 == b.0;
            if same {
                a.1 += &b.1;
            }
            same
        });
        self.columns.push(entries);
        self.columns.len() - 1
    }

    /// A new column with one entry.
    pub(crate) fn unit(&mut self, row: usize, x: i8) -> usize {
        self.column(vec![(row, Exact::from(x))])
    }

    /// `yᵀ A_j`.
    fn slope(&self, y: &[Exact], j: usize) -> Exact {
        let terms = self.columns[j].iter().filter(|(i, _)| !y[*i].is_zero());
        terms.fold(Exact::ZERO, |sum, (i, x)| sum + x * &y[*i])
    }

    /// `yᵀ A_j` in doubled precision.
    fn about(&self, entries: &Entries, y: &[[f64; 2]], j: usize) -> About {
        About::sum(self.columns[j].iter().zip(&entries.0[j]).map(|((i, _), &x)| (*i, x)), y)
    }

    /// The sign of `yᵀ A_j`: exact, and in rational numbers only where doubled precision does not tell.
    pub(super) fn sign(&self, entries: &Entries, y: &Vector, j: usize) -> Ordering {
        let known = self.about(entries, &y.doubled, j).sign();
        known.unwrap_or_else(|| self.slope(y.exact, j).cmp(&Exact::ZERO))
    }

    /// `yᵀ A_j` and `Σ |y_i A_ij|`; of the former its rounding at most is lost.
    pub(super) fn measured(&self, entries: &Entries, y: &Vector, j: usize) -> (f64, f64) {
        let about = self.about(entries, &y.doubled, j);
        if about.is_in_range() {
            return (about.value, about.size);
        }
        let sizes = self.columns[j].iter().map(|(i, x)| (rounded(x) * y.doubled[*i][0]).abs());
        (rounded(&self.slope(y.exact, j)), sizes.sum())
    }

    /// Completes y in the rows that define bounds, where the best value follows from the other rows.
    pub(crate) fn complete(&self, y: &mut Vec<Exact>) {
        y.resize(self.rhs.len(), Exact::ZERO);
        for &(row, columns) in &self.slack_rows {
            y[row] = Exact::ZERO;
            if budget::over() {
                return;
            }
            let sign = self.columns[columns[0]].iter().find(|(i, _)| *i == row);
            let Some((_, sign)) = sign else { continue };
            let least = columns.map(|j| -self.slope(y, j)).into_iter().max().unwrap_or_default();
            y[row] = sign * least;
        }
    }

    /// What y separates from b exactly: for each pair whether it does so with the first and with the second column. `None` where it separates
    /// nothing: `yᵀ b ≥ 0`, or a free column or a ray on the wrong side. And where the computation of this thread is over.
    fn separates(&self, entries: &Entries, y: &[Exact]) -> Option<Vec<[bool; 2]>> {
        let power = y.iter().zip(&self.rhs).fold(Exact::ZERO, |sum, (y, b)| sum + y * b);
        if !negative(&power) {
            return None;
        }
        let y = &Vector::new(y);
        let sign = |j: usize| (!budget::over()).then(|| self.sign(entries, y, j));
        for &j in &self.free {
            sign(j).filter(|sign| sign.is_eq())?;
        }
        for &j in &self.rays {
            sign(j).filter(|sign| sign.is_ge())?;
        }
        let side = |j: usize| Some(sign(j)?.is_ge());
        self.pairs.iter().map(|&[a, b]| Some([side(a)?, side(b)?])).collect()
    }

    /// Whether the vectors together separate b from every choice of one column a pair, **in exact arithmetic**: the system then has no solution. False where the
    /// computation of this thread is [over](nonsmooth_linalg::budget::over).
    pub fn refuted_by(&self, vectors: &[Vec<Exact>]) -> bool {
        self.refutation(&self.entries(), vectors, &[]).is_some()
    }

    /// Whether y alone separates b from the columns that are not excluded, **in exact arithmetic**: no solution has zeros in all of those that are.
    pub fn closed_by(&self, entries: &Entries, y: &[f64], excluded: &[bool]) -> bool {
        if self.wanted.is_some() || y.len() != self.rhs.len() || y.iter().any(|y| !y.is_finite()) {
            return false;
        }
        let y = exacts(y);
        let power = y.iter().zip(&self.rhs).fold(Exact::ZERO, |sum, (y, b)| sum + y * b);
        let vector = Vector::new(&y);
        let sign = |j: usize| self.sign(entries, &vector, j);
        negative(&power)
            && self.free.iter().all(|&j| excluded[j] || sign(j).is_eq())
            && self.rays.iter().all(|&j| excluded[j] || sign(j).is_ge())
            && self.pairs.iter().flatten().all(|&j| excluded[j] || sign(j).is_ge())
    }

    /// As [`refuted_by`](Self::refuted_by), with the entries in doubles: the places of the vectors that separate something, for the others are superfluous, and by how much there is no solution, see
    /// [`Proof::margin`](super::Proof::margin), where the rows of the problem have these weights.
    pub(crate) fn refutation(
        &self,
        entries: &Entries,
        vectors: &[Vec<Exact>],
        weights: &[f64],
    ) -> Option<(Vec<usize>, f64)> {
        if self.wanted.is_some() && !vectors.iter().all(|y| self.is_supported(y)) {
            return None;
        }
        if !vectors.iter().all(|y| y.len() == self.rhs.len()) {
            return None;
        }
        let each = vectors.iter().map(|y| self.separates(entries, y)).enumerate();
        let (places, sides): (Vec<usize>, Vec<_>) =
            each.filter_map(|(k, sides)| Some((k, sides?))).unzip();
        if !all_closed(&sides, self.pairs.len()) {
            return None;
        }
        let weights = exacts(weights);
        // What the vectors that miss by most close already is missed by as much; fewer vectors close no more.
        let excess: Vec<f64> = places.iter().map(|&k| self.excess(&vectors[k], &weights)).collect();
        let mut order: Vec<usize> = (0..excess.len()).collect();
        order.sort_by(|&a, &b| excess[b].total_cmp(&excess[a]));
        let closed = |count: usize| {
            let some: Vec<_> = order[..count].iter().map(|&k| sides[k].clone()).collect();
            all_closed(&some, self.pairs.len())
        };
        let (mut open, mut enough) = (0, order.len());
        while enough - open > 1 {
            let middle = open.midpoint(enough);
            if closed(middle) { enough = middle } else { open = middle }
        }
        Some((places, excess[order[enough - 1]]))
    }

    /// For a y that separates: the least error in some row that has a weight, over that weight and as a part of the largest such right-hand side, of whatever it separates b from:
    /// `|yᵀ(A t − b)| ≥ −yᵀ b`.
    pub(super) fn excess(&self, y: &[Exact], weights: &[Exact]) -> f64 {
        let size = |x: &Exact| if negative(x) { -x } else { x.clone() };
        let shares = self.rhs.iter().zip(weights).map(|(b, weight)| size(b) / weight);
        let largest = shares.max().unwrap_or(Exact::ZERO);
        let terms = y.iter().zip(weights).map(|(y, weight)| size(y) * weight);
        let room = terms.fold(Exact::ZERO, |sum, term| sum + term) * largest;
        if room.is_zero() {
            return f64::INFINITY;
        }
        let power = y.iter().zip(&self.rhs).fold(Exact::ZERO, |sum, (y, b)| sum + y * b);
        rounded(&(-power / room))
    }

    /// The entries in doubles, for as long as the columns stay.
    pub fn entries(&self) -> Entries {
        let doubles = |c: &Column| c.iter().map(|(_, x)| double(x).unwrap_or(f64::NAN)).collect();
        Entries(self.columns.iter().map(doubles).collect())
    }

    /// Whether the coefficients solve the system, **in exact arithmetic**.
    pub fn solved_by(&self, t: &[Exact]) -> bool {
        let signs = |j: &usize| !negative(&t[*j]);
        let fine = t.len() == self.columns.len()
            && self.wanted.is_none()
            && self.rays.iter().all(signs)
            && self.pairs.iter().all(|p| p.iter().all(signs) && p.iter().any(|&j| t[j].is_zero()));
        let mut left = self.rhs.clone();
        for (t, column) in t.iter().zip(&self.columns).filter(|(t, _)| !t.is_zero()) {
            column.iter().for_each(|(i, x)| left[*i] -= x * t);
        }
        fine && left.iter().all(Exact::is_zero)
    }

    /// The problem's unknowns where the coefficients are t, each rounded once.
    pub fn unknowns_at(&self, t: &[Exact]) -> Vec<f64> {
        let sum = |(constant, terms): &(Exact, Vec<(usize, Exact)>)| {
            rounded(&terms.iter().fold(constant.clone(), |sum, (j, factor)| sum + factor * &t[*j]))
        };
        self.unknowns.iter().map(sum).collect()
    }

    /// Whether y is zero in the rows that were left out.
    fn is_supported(&self, y: &[Exact]) -> bool {
        y.iter().enumerate().all(|(i, y)| y.is_zero() || self.wants(i))
    }

    /// The vectors without the entries whose terms are at most `noise` of the largest of theirs.
    pub(crate) fn without(&self, vectors: &[Vec<Exact>], noise: f64) -> Vec<Vec<Exact>> {
        if noise == 0.0 {
            return vectors.to_vec();
        }
        let mut rows = vec![0.0_f64; self.rhs.len()];
        for (i, x) in self.columns.iter().filter(|c| c.len() > 1).flatten() {
            rows[*i] = rows[*i].max(rounded(x).abs());
        }
        let row = |i: usize| if rows[i] > 0.0 { rows[i] } else { 1.0 };
        let pruned = |y: &Vec<Exact>| {
            let size = |i: usize| rounded(&y[i]).abs() * row(i);
            let largest = (0..y.len()).fold(0.0_f64, |l, i| l.max(size(i)));
            let kept = |i: usize| size(i) > noise * largest;
            let mut out: Vec<Exact> =
                (0..y.len()).map(|i| if kept(i) { y[i].clone() } else { Exact::ZERO }).collect();
            self.complete(&mut out);
            out
        };
        vectors.iter().map(pruned).collect()
    }

    /// The vectors, exact, changed by no more than rounding so that they separate what they nearly separate; each as it is where that fails.
    ///
    /// What is nearly zero is made zero by elimination within the vector's support.
    pub(crate) fn mended(&self, entries: &Entries, vectors: &[Vec<Exact>]) -> Vec<Vec<Exact>> {
        vectors.iter().map(|y| self.mend(entries, y).unwrap_or_else(|| y.clone())).collect()
    }

    /// `None` where it fails, and where the computation of this thread is over.
    fn mend(&self, entries: &Entries, y: &[Exact]) -> Option<Vec<Exact>> {
        let bounding: Vec<usize> = self.slack_rows.iter().map(|s| s.0).collect();
        let mut start = y.to_vec();
        bounding.iter().for_each(|&i| start[i] = Exact::ZERO);
        // What is zero stays zero: the support does not grow.
        let weights: Vec<f64> = start.iter().map(|y| rounded(y).abs()).collect();
        let vector = Vector::new(y);
        let mut before = 0;
        for near in [1e-13, 1e-10] {
            let mut equations = vec![];
            for j in 0..self.columns.len() {
                if budget::over() {
                    return None;
                }
                let about = self.about(entries, &vector.doubled, j);
                let vanishes = match about.sign() {
                    Some(_) => about.value.abs() <= near * about.size,
                    None => {
                        let slope = self.slope(y, j);
                        let (value, size) = self.measured(entries, &vector, j);
                        let tight = !slope.is_zero() && value.abs() <= near * size;
                        tight || (slope.is_zero() && self.columns[j].len() > 1)
                    }
                };
                if vanishes {
                    let terms = self.columns[j].iter().filter(|(i, _)| !bounding.contains(i));
                    let terms: Vec<_> = terms.filter(|(i, _)| !y[*i].is_zero()).cloned().collect();
                    // A column that meets a bound's row is closed by that row.
                    let closed = self.columns[j].iter().any(|(i, _)| bounding.contains(i));
                    if !closed && !terms.is_empty() {
                        equations.push(Equation { terms, constant: Exact::ZERO });
                    }
                }
            }
            // More equations than before, or the same ones.
            if equations.len() == before {
                continue;
            }
            before = equations.len();
            // What contradicts itself, or costs too much, does so with more equations as well.
            let mut found = satisfying(equations, &start, &weights, BUDGET)?;
            self.complete(&mut found);
            if self.separates(entries, &found).is_some() {
                return Some(found);
            }
        }
        None
    }

    /// The smallest relative change of the entries of A and b (those that are no units) for which the vectors would refute the system, up to a
    /// factor of two; `None` where that is more than [`NEAR`].
    pub(crate) fn nearness(&self, entries: &Entries, vectors: &[Vec<Exact>]) -> Option<f64> {
        if vectors.iter().any(|y| y.len() != self.rhs.len()) {
            return None;
        }
        // Of each vector: its own violation, and that of each side of each pair.
        let violations: Vec<(f64, Vec<[f64; 2]>)> =
            vectors.iter().map(|y| self.violations(entries, y)).collect::<Option<_>>()?;
        let closed = |change: f64| {
            let sides = violations.iter().filter(|(own, _)| *own <= change).map(|(_, sides)| {
                sides.iter().map(|s| s.map(|v| v <= change)).collect::<Vec<[bool; 2]>>()
            });
            all_closed(&sides.collect::<Vec<_>>(), self.pairs.len())
        };
        let mut change = f64::EPSILON / 16.0;
        while change <= NEAR {
            if closed(change) {
                return Some(change);
            }
            change *= 2.0;
        }
        None
    }

    /// `None` where the computation of this thread is over.
    fn violations(&self, entries: &Entries, y: &[Exact]) -> Option<(f64, Vec<[f64; 2]>)> {
        let power = y.iter().zip(&self.rhs).fold(Exact::ZERO, |sum, (y, b)| sum + y * b);
        let size: f64 = y.iter().zip(&self.rhs).map(|(y, b)| (rounded(y) * rounded(b)).abs()).sum();
        let share = |x: f64, size: f64| if x == 0.0 { 0.0 } else { x.abs() / size };
        let mut own = match rounded(&power) {
            power if power < 0.0 => 0.0,
            power if size > 0.0 => (power / size).max(f64::EPSILON / 16.0),
            _ => f64::INFINITY,
        };
        let y = &Vector::new(y);
        let measured = |j: usize| (!budget::over()).then(|| self.measured(entries, y, j));
        let below = |j: usize| measured(j).map(|(slope, size)| share(slope.min(0.0), size));
        for &j in &self.free {
            let (slope, size) = measured(j)?;
            own = own.max(share(slope, size));
        }
        for &j in &self.rays {
            own = own.max(below(j)?);
        }
        let sides = self.pairs.iter().map(|&[a, b]| Some([below(a)?, below(b)?]));
        Some((own, sides.collect::<Option<_>>()?))
    }

    /// The vectors of doubles as exact ones over the rows of the system, with the rows that define bounds completed.
    pub(crate) fn vector(&self, y: &[f64]) -> Vec<Exact> {
        let mut y: Vec<Exact> = y.iter().map(|&y| exact(y)).collect();
        self.complete(&mut y);
        y
    }
}

/// The entries of a system in doubles, by columns; NaN where one is none.
#[derive(Debug, Clone)]
pub struct Entries(Vec<Vec<f64>>);

/// A vector in exact numbers and in doubles.
pub(super) struct Vector<'a> {
    exact: &'a [Exact],
    /// The nearest double and the nearest to what that leaves; NaN where these are no two doubles' precision.
    pub(super) doubled: Vec<[f64; 2]>,
}

impl<'a> Vector<'a> {
    pub(super) fn new(exact: &'a [Exact]) -> Self {
        Self { exact, doubled: exact.iter().map(doubled).collect() }
    }
}

fn doubled(x: &Exact) -> [f64; 2] {
    /// Below this what is left may be below all doubles.
    const LEAST: f64 = 1e-250;
    if let Some(x) = double(x) {
        return [x, 0.0];
    }
    match rounded(x) {
        high if high.abs() > LEAST && high.is_finite() => [high, rounded(&(x - exact(high)))],
        _ => [f64::NAN; 2],
    }
}

/// A sum known up to an error, with the size of its terms.
pub(super) struct About {
    pub(super) value: f64,
    pub(super) size: f64,
    pub(super) error: f64,
}

impl About {
    /// `Σ x y_i` over these (i, x), in doubled precision.
    pub(super) fn sum(terms: impl Iterator<Item = (usize, f64)>, y: &[[f64; 2]]) -> Self {
        let (mut sum, mut size, mut count) = (Compensated::default(), 0.0, 0);
        for (i, x) in terms {
            let [high, low] = y[i];
            count += 1;
            if high != 0.0 {
                sum.add_product(x, high);
                sum.add_product(x, low);
                size += (x * high).abs();
            }
        }
        // Of 2 k terms (2 k u)² at most (OgitaRumpOishi2005), and u² of each y: four times as much.
        let unit = (2 * count + 4) as f64 * f64::EPSILON;
        Self { value: sum.value(), size, error: unit * unit * size }
    }

    /// Whether nothing that matters is below or beyond all doubles.
    pub(super) fn is_in_range(&self) -> bool {
        self.value.is_finite() && self.size > 1e-200 && self.size < 1e200
    }

    /// The sign where it is sure: of a sum that is zero it never is.
    fn sign(&self) -> Option<Ordering> {
        let sure = self.is_in_range() && self.value.abs() > self.error;
        sure.then(|| self.value.total_cmp(&0.0))
    }
}

/// The largest relative change of the data that still counts as rounding.
pub const NEAR: f64 = 1e-9;
/// Rational operations that mending a vector may cost.
const BUDGET: usize = 200_000;

/// Whether every choice of a side for each pair is closed by some vector, given which sides each vector closes; false where the computation of this thread is over.
fn all_closed(sides: &[Vec<[bool; 2]>], pairs: usize) -> bool {
    fn closed(sides: &[Vec<[bool; 2]>], left: &[usize], depth: usize, pairs: usize) -> bool {
        // Pairs that no vector cares about are no choice.
        let matters = |d: &usize| left.iter().any(|&k| sides[k][*d] != [true, true]);
        let Some(depth) = (depth..pairs).find(matters) else { return !left.is_empty() };
        if budget::over() {
            return false;
        }
        [0, 1].into_iter().all(|side| {
            let still: Vec<_> = left.iter().copied().filter(|&k| sides[k][depth][side]).collect();
            // One that closes all that is left decides at once.
            let all = |&k: &usize| sides[k][depth + 1..].iter().all(|s| s[0] && s[1]);
            still.iter().any(all) || closed(sides, &still, depth + 1, pairs)
        })
    }
    closed(sides, &(0..sides.len()).collect::<Vec<_>>(), 0, pairs)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `A_0 = (1, −1)ᵀ`, its second entry off by what is given, and a pair of units.
    fn nearly(off: f64) -> ConeSystem {
        let mut system = ConeSystem::new(vec![exact(-1.0), exact(0.0)], None);
        let second = exact(-1.0) + exact(off);
        let column = system.column(vec![(0, exact(1.0)), (1, second)]);
        let unit = system.unit(1, 1);
        system.pairs.push([column, unit]);
        system
    }

    #[test]
    fn signs_that_doubles_do_not_tell_are_exact() {
        let y = vec![vec![Exact::ONE, Exact::ONE]];
        // The sum is off, whose sign no doubles tell below their precision squared, and which is no double beside one.
        for off in [1e-30, 1e-60, 1e-300, 0.0] {
            assert!(nearly(off).refuted_by(&y), "{off}");
            assert!(off == 0.0 || !nearly(-off).refuted_by(&y), "{off}");
        }
        let thirds = vec![vec![Exact::from(1u8) / Exact::from(3u8); 2]];
        assert!(nearly(0.0).refuted_by(&thirds) && !nearly(-1e-40).refuted_by(&thirds));
        let tiny = vec![vec![exact(1e-308); 2]];
        assert!(nearly(1e-40).refuted_by(&tiny) && !nearly(-1e-40).refuted_by(&tiny));
    }

    #[test]
    fn nothing_is_concluded_when_the_time_is_over() {
        let (system, y) = (nearly(0.0), vec![vec![Exact::ONE, Exact::ONE]]);
        let entries = system.entries();
        let over =
            budget::Budget { deadline: Some(std::time::Instant::now()), ..Default::default() };
        let scope = over.enter();
        assert!(!system.refuted_by(&y) && system.nearness(&entries, &y).is_none());
        assert_eq!(system.mended(&entries, &y), y);
        assert!(scope.raised());
        drop(scope);
        assert!(system.refuted_by(&y) && system.nearness(&entries, &y).is_some());
    }

    #[test]
    fn vectors_close_all_choices_together_or_not() {
        let all = vec![vec![[true, true]; 60]];
        assert!(all_closed(&all, 60));
        let mut one = all.clone();
        one[0][59] = [true, false];
        assert!(!all_closed(&one, 60));
        let mut two = one.clone();
        two.push(vec![[true, true]; 60]);
        two[1][59] = [false, true];
        assert!(all_closed(&two, 60));
        two[1][3] = [false, true];
        assert!(!all_closed(&two, 60));
        assert!(!all_closed(&[], 3) && !all_closed(&[], 0));
    }

    #[test]
    fn a_vector_that_separates_nothing_does_no_harm() {
        let system = nearly(0.0);
        let [y, none] = [[Exact::ONE, Exact::ONE], [Exact::ZERO, Exact::ONE]].map(Vec::from);
        let all = [none.clone(), y];
        let (places, _) = system.refutation(&system.entries(), &all, &[]).unwrap();
        assert_eq!(places, [1]);
        assert!(!system.refuted_by(&[none]));
    }
}

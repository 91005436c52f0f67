//! Exact rational arithmetic on stored doubles.

use dashu_ratio::RBig;
use nonsmooth_linalg::budget::Pace;

/// A rational number of any size.
pub type Exact = RBig;

/// A finite double as the rational number that it is; zero in place of an infinity or a NaN, which no problem holds.
pub(crate) fn exact(x: f64) -> Exact {
    Exact::try_from(x).unwrap_or(Exact::ZERO)
}

/// The double that it is, if it is one.
pub(crate) fn double(x: &Exact) -> Option<f64> {
    let nearest = x.to_f64();
    nearest.error_ref().is_none().then(|| nearest.value())
}

/// The nearest double.
pub fn rounded(x: &Exact) -> f64 {
    x.to_f64().value()
}

/// `x < 0`.
pub(crate) fn negative(x: &Exact) -> bool {
    *x < Exact::ZERO
}

/// A linear equation in some unknowns: `Σ coefficient · unknown + constant = 0`.
pub(crate) struct Equation {
    pub(crate) terms: Vec<(usize, Exact)>,
    pub(crate) constant: Exact,
}

/// Values that satisfy all equations exactly and differ from those given only in one unknown for each independent equation,
/// the one whose coefficient times weight is largest: with the unknown's own size as its weight, the one which that moves least relative to itself.
/// Unknowns without weight stay as they are. `None` where the equations contradict each other, or would cost more than `budget`
/// operations on rational numbers as short as doubles are: a longer one counts as many as its words take the greatest common divisor. `None`, too, where the
/// computation of this thread is [over](nonsmooth_linalg::budget::over).
///
/// Cost: one elimination, rows · unknowns · rank operations at most, on numbers whose length grows with the rank.
pub(crate) fn satisfying(
    equations: Vec<Equation>,
    values: &[Exact],
    weights: &[f64],
    budget: usize,
) -> Option<Vec<Exact>> {
    let mut spent = 0;
    let mut pace = Pace::default();
    // Reduced rows: (pivot, terms without the pivot, constant), the pivot's coefficient being 1.
    let mut reduced: Vec<(usize, Row, Exact)> = vec![];
    let mut place = vec![usize::MAX; values.len()];
    for Equation { terms, mut constant } in equations {
        let mut row: Row = Row::new();
        for (j, a) in terms {
            if weights[j] > 0.0 {
                row.add(j, a);
            } else {
                constant += a * &values[j];
            }
        }
        // Pivots of earlier rows are replaced, in the order of these rows.
        while let Some((k, a)) = row.first_with(|j| place[j]) {
            row.remove(reduced[k].0);
            // The search for the pivot and what follows for the constant.
            if pace.over(row.0.len() as f64 + cost(&a, &reduced[k].2) as f64 * OPERATION) {
                return None;
            }
            for (j, b) in &reduced[k].1.0 {
                let cost = cost(&a, b);
                spent += cost;
                if spent > budget || pace.over(cost as f64 * OPERATION) {
                    return None;
                }
                row.add(*j, -(&a * b));
            }
            constant -= &a * &reduced[k].2;
        }
        let weight = |(j, a): &(usize, Exact)| rounded(a).abs() * weights[*j];
        let Some((pivot, a)) = row.0.iter().max_by(|x, y| weight(x).total_cmp(&weight(y))).cloned()
        else {
            if constant.is_zero() {
                continue;
            }
            return None;
        };
        row.remove(pivot);
        for (_, b) in &mut row.0 {
            if pace.over(cost(&a, b) as f64 * OPERATION) {
                return None;
            }
            *b = &*b / &a;
        }
        place[pivot] = reduced.len();
        reduced.push((pivot, row, constant / a));
    }
    let mut out = values.to_vec();
    // A row refers to pivots of later rows only.
    for (pivot, row, constant) in reduced.iter().rev() {
        let mut sum = -constant;
        for (j, b) in &row.0 {
            if pace.over(cost(b, &out[*j]) as f64 * OPERATION) {
                return None;
            }
            sum -= b * &out[*j];
        }
        out[*pivot] = sum;
    }
    Some(out)
}

/// `constant + Σ a_j x_j`; `None` where the computation of this thread is over.
pub(crate) fn sum_of_products(
    constant: f64,
    terms: &[(usize, f64)],
    x: &[Exact],
    pace: &mut Pace,
) -> Option<Exact> {
    let mut sum = exact(constant);
    for &(j, a) in terms {
        let a = exact(a);
        if pace.over(cost(&a, &x[j]) as f64 * OPERATION) {
            return None;
        }
        sum += a * &x[j];
    }
    Some(sum)
}

/// An operation on rational numbers as short as doubles are, in units of one on doubles.
const OPERATION: f64 = 1e3;

/// What a product takes, in units of that of two doubles.
fn cost(a: &Exact, b: &Exact) -> usize {
    let words =
        |x: &Exact| x.numerator().as_sign_words().1.len() + x.denominator().as_words().len();
    1 + words(a) * words(b) / 16
}

/// A sparse row, sorted by unknown.
struct Row(Vec<(usize, Exact)>);

impl Row {
    fn new() -> Self {
        Self(vec![])
    }

    fn add(&mut self, j: usize, a: Exact) {
        match self.0.binary_search_by_key(&j, |e| e.0) {
            Ok(k) => {
                self.0[k].1 += a;
                if self.0[k].1.is_zero() {
                    self.0.remove(k);
                }
            }
            Err(k) if !a.is_zero() => self.0.insert(k, (j, a)),
            Err(_) => {}
        }
    }

    fn remove(&mut self, j: usize) {
        if let Ok(k) = self.0.binary_search_by_key(&j, |e| e.0) {
            self.0.remove(k);
        }
    }

    /// The least `place` of an unknown that has one, and its coefficient.
    fn first_with(&self, place: impl Fn(usize) -> usize) -> Option<(usize, Exact)> {
        let placed = self.0.iter().filter(|e| place(e.0) != usize::MAX);
        placed.min_by_key(|e| place(e.0)).map(|e| (place(e.0), e.1.clone()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_numbers_cost_more() {
        // A dense system whose numbers grow to hundreds of words would take seconds.
        let n = 60;
        let entry = |i: usize, j: usize| ((i * 37 + j * 91) as f64 * 0.618).sin() + 1.5;
        let dense = || {
            (0..n).map(|i| {
                let terms: Vec<_> = (0..n).map(|j| (j, entry(i, j))).collect();
                equation(&terms, 1.0)
            })
        };
        let (values, weights) = (vec![Exact::ZERO; n], vec![1.0; n]);
        let begun = std::time::Instant::now();
        assert!(satisfying(dense().collect(), &values, &weights, 200_000).is_none());
        assert!(begun.elapsed().as_secs_f64() < 2.0, "{:?}", begun.elapsed());
        // Without the length of its numbers it would not be too dear.
        assert!(n * n * n / 3 < 200_000);
    }

    fn equation(terms: &[(usize, f64)], constant: f64) -> Equation {
        Equation {
            terms: terms.iter().map(|&(j, a)| (j, exact(a))).collect(),
            constant: exact(constant),
        }
    }

    #[test]
    fn doubles_are_what_they_are() {
        assert_eq!(exact(0.1) * Exact::from(10u8) - Exact::ONE, exact(2f64.powi(-54)));
        assert_eq!(rounded(&exact(-1e-300)), -1e-300);
        assert_eq!(exact(f64::INFINITY), Exact::ZERO);
    }

    #[test]
    fn equations_hold_exactly_and_little_changes() {
        let values: Vec<_> = [1.0 / 3.0, 2.0 / 3.0, 0.0, 1e-17].map(exact).into();
        let rows = [(vec![(0, 2.0), (1, -1.0)], 0.0), (vec![(0, 1.0), (1, 1.0), (3, 1.0)], -1.0)];
        let state = || rows.iter().map(|(t, c)| equation(t, *c)).collect::<Vec<_>>();
        let weights: Vec<f64> = values.iter().map(|x| rounded(x).abs()).collect();
        let satisfying = |equations| satisfying(equations, &values, &weights, 1000);
        let found = satisfying(state()).unwrap();
        for Equation { terms, constant } in state() {
            let sum = terms.iter().fold(constant, |s, (j, a)| s + a * &found[*j]);
            assert!(sum.is_zero());
        }
        assert!(found.iter().zip(&values).all(|(a, b)| rounded(&(a - b)).abs() < 1e-15));
        // The same equation twice is one; two that contradict each other have no solution.
        let twice =
            |c| vec![equation(&[(0, 1.0), (1, 1.0)], -1.0), equation(&[(0, 2.0), (1, 2.0)], c)];
        assert!(satisfying(twice(-2.0)).is_some());
        assert!(satisfying(twice(-2.1)).is_none());
        // Nothing can be changed in an unknown without weight.
        assert!(satisfying(vec![equation(&[(2, 1.0)], -1.0)]).is_none());
    }
}

//! One frictional contact by enumeration: open, stick, and every sliding solution as a root of a quartic.
//!
//! With the notation of [`Exact`] a sliding solution is a root α > 0 of `‖A + α q̃‖² − c(α)² = 0` with `c(α) ≥ 0`,
//! a polynomial of degree four. All its positive roots are found, and the sliding impulse whose own
//! residual is smallest is taken. Cost: about 500 flops.
//! Source: BonnefonDaviet2011; DBB11, appendix B.

use nonsmooth_linalg::small;

use super::exact::{Schur, Sliding, embed, stick};
use super::{Exact, LocalSolver, Rest, modified_velocity};
use crate::contact::law::{Coulomb, cone};

/// The local solver that enumerates the roots of the quartic.
#[derive(Debug, Clone, Copy, Default)]
pub struct Quartic;

/// The inverse of the block, and what [`Exact`] keeps (its closed forms serve in the plane and where nothing resists sliding).
#[derive(Debug, Clone)]
pub struct QuarticMemo<const D: usize> {
    rest: Option<Rest<D>>,
    schur: Option<Schur>,
    exact: <Exact as LocalSolver<D>>::Memo,
}

impl<const D: usize> LocalSolver<D> for Quartic {
    type Memo = QuarticMemo<D>;

    fn prepare(&self, w: &[[f64; D]; D], law: Coulomb) -> QuarticMemo<D> {
        let schur = if D == 3 { Schur::new(w) } else { None };
        QuarticMemo { rest: Rest::new(w), schur, exact: Exact.prepare(w, law) }
    }

    fn solve(
        &self,
        memo: &mut QuarticMemo<D>,
        w: &[[f64; D]; D],
        q: &[f64; D],
        law: Coulomb,
        r: &[f64; D],
    ) -> [f64; D] {
        let Coulomb { mu } = law;
        if D == 2 {
            return Exact.solve(&mut memo.exact, w, q, law, r);
        }
        if q[0] >= 0.0 {
            return [0.0; D];
        }
        if let Some(stuck) = memo.rest.as_ref().and_then(|rest| stick(rest, w, q, mu)) {
            return stuck;
        }
        let Some(schur) = &memo.schur else {
            return Exact.solve(&mut memo.exact, w, q, law, r);
        };
        let sliding = Sliding::new(schur, q, mu);
        let (p, scale) = sliding.quartic();
        // In units of `scale` the coefficients are comparable.
        let mut scaled = p;
        let mut power = 1.0;
        for c in &mut scaled {
            *c *= power;
            power *= scale;
        }
        positive_roots(&scaled)
            .filter(|&x| sliding.pressure(x * scale) >= 0.0)
            .filter_map(|x| sliding.impulse(x * scale))
            .map(embed)
            .min_by(|a, b| natural_residual(w, q, mu, a).total_cmp(&natural_residual(w, q, mu, b)))
            // Rounding may hide a double root: the bracketed search still finds it.
            .unwrap_or_else(|| Exact.solve(&mut memo.exact, w, q, law, r))
    }
}

/// `‖w̄ r − P_K(w̄ r − ũ)‖²`, w̄ the mean diagonal.
fn natural_residual<const D: usize>(w: &[[f64; D]; D], q: &[f64; D], mu: f64, r: &[f64; D]) -> f64 {
    let mean = small::mean_diagonal(w);
    let u = modified_velocity(w, q, Coulomb { mu }, r);
    let mut x = [0.0; D];
    for k in 0..D {
        x[k] = mean * r[k] - u[k];
    }
    let p = cone::project(&x, mu);
    (0..D).map(|k| (mean * r[k] - p[k]).powi(2)).sum()
}

/// The positive roots of a polynomial of degree at most four, coefficients of 1, x, …
///
/// The roots of the derivative split the axis into intervals on which the polynomial is monotone; each holds at
/// most one root, found by bisection-guarded Newton. Exact multiplicities and tiny leading coefficients do no harm.
fn positive_roots(p: &[f64; 5]) -> impl Iterator<Item = f64> {
    let mut roots = [0.0; 5];
    let mut count = 0;
    // Cauchy's bound on the roots, from the highest coefficient that is not negligible.
    let largest = p.iter().fold(0.0_f64, |m, c| m.max(c.abs()));
    let degree = (0..5).rev().find(|&k| p[k].abs() > 1e-14 * largest).unwrap_or(0);
    let bound = 1.0 + p[..degree].iter().fold(0.0_f64, |m, c| m.max((c / p[degree]).abs()));
    // From the lowest derivative that is linear up to p itself.
    for order in (0..degree).rev() {
        let derivative = differentiate(p, order);
        let mut edges = [0.0; 7];
        let inner = count;
        edges[1..=inner].copy_from_slice(&roots[..inner]);
        edges[inner + 1] = bound;
        count = 0;
        for pair in edges[..inner + 2].windows(2) {
            if let Some(x) = root_between(&derivative, pair[0], pair[1]) {
                roots[count] = x;
                count += 1;
            }
        }
    }
    roots.into_iter().take(count).filter(|x| *x > 0.0)
}

/// The `order`-th derivative's coefficients.
fn differentiate(p: &[f64; 5], order: usize) -> [f64; 5] {
    let mut d = *p;
    for _ in 0..order {
        for k in 0..4 {
            d[k] = (k + 1) as f64 * d[k + 1];
        }
        d[4] = 0.0;
    }
    d
}

fn evaluate(p: &[f64; 5], x: f64) -> f64 {
    p.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// The root of a polynomial that is monotone on `[low, high]`, if it has one there.
fn root_between(p: &[f64; 5], mut low: f64, mut high: f64) -> Option<f64> {
    let (at_low, at_high) = (evaluate(p, low), evaluate(p, high));
    if at_low == 0.0 {
        return Some(low);
    }
    if at_low.signum() == at_high.signum() {
        return None;
    }
    let slope = differentiate(p, 1);
    let mut x = 0.5 * (low + high);
    for _ in 0..100 {
        let value = evaluate(p, x);
        if value == 0.0 || high - low <= f64::EPSILON * high {
            break;
        }
        if value.signum() == at_low.signum() {
            low = x;
        } else {
            high = x;
        }
        let newton = x - value / evaluate(&slope, x);
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        if (next - x).abs() <= 0.5 * f64::EPSILON * x.abs() {
            break;
        }
        x = next;
    }
    Some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_of_known_polynomials() {
        // (x−1)(x−2)(x−3)(x+4) = x⁴ − 2x³ − 13x² + 38x − 24.
        let roots: Vec<f64> = positive_roots(&[-24.0, 38.0, -13.0, -2.0, 1.0]).collect();
        assert_eq!(roots.len(), 3);
        assert!(roots.iter().zip([1.0, 2.0, 3.0]).all(|(x, y)| (x - y).abs() < 1e-14), "{roots:?}");
        assert_eq!(positive_roots(&[1.0, 0.0, 1.0, 0.0, 1.0]).count(), 0);
        let linear: Vec<f64> = positive_roots(&[-3.0, 2.0, 0.0, 0.0, 0.0]).collect();
        assert_eq!(linear, [1.5]);
        assert_eq!(positive_roots(&[0.0; 5]).count(), 0);
    }
}

//! What the edges from contact have in common: the problem without its bilateral constraints, units, directions in the tangential plane, certificates.

use nonsmooth_linalg::{Bsr, small};
use nonsmooth_problem::check::{Certificate, Impulses};
use nonsmooth_problem::{FrictionLocal, LocalPoint};

use crate::SolveError;
use crate::contact::form::{Access, Contacts, LocalState};

/// The tangential part of a contact's vector, with a zero where the plane has no second component.
pub(super) fn tangential<const D: usize>(x: &[f64; D]) -> [f64; 2] {
    [x[1], if D > 2 { x[2] } else { 0.0 }]
}

pub(super) fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// `x = Σ a_i d_i` with at most two of the `a_i` positive, those of the neighbours of x; calls `f(i, a_i)` for them.
pub(super) fn decompose(directions: &[[f64; 2]], x: [f64; 2], mut f: impl FnMut(usize, f64)) {
    let count = directions.len();
    let (mut nearest, mut most) = (0, f64::NEG_INFINITY);
    for (i, d) in directions.iter().enumerate() {
        if dot(*d, x) > most {
            (nearest, most) = (i, dot(*d, x));
        }
    }
    if most <= 0.0 {
        return;
    }
    let d = directions[nearest];
    let across = d[0] * x[1] - d[1] * x[0];
    let other = if across >= 0.0 { (nearest + 1) % count } else { (nearest + count - 1) % count };
    let e = directions[other];
    let area = d[0] * e[1] - d[1] * e[0];
    if count > 2 && area != 0.0 {
        f(nearest, ((x[0] * e[1] - x[1] * e[0]) / area).max(0.0));
        f(other, (across / area).max(0.0));
    } else {
        f(nearest, most);
    }
}

/// The unit `w_c` of each contact, positive: the mean diagonal of its block, of all blocks where that is not positive.
fn units<const D: usize>(w: &Bsr<D>, out: &mut Vec<f64>) {
    out.clear();
    out.extend((0..w.nrows()).map(|c| small::mean_diagonal(&w.diagonal_block(c))));
    let (sum, count) =
        out.iter().filter(|w| **w > 0.0).fold((0.0, 0), |(sum, n), w| (sum + w, n + 1));
    let mean = if count > 0 { sum / f64::from(count) } else { 1.0 };
    out.iter_mut().filter(|w| w.is_nan() || **w <= 0.0).for_each(|w| *w = mean);
}

/// What the edges keep of the friction problem: its view without bilateral constraints, units, and where a contradiction was found.
pub(super) struct Kept<const D: usize> {
    pub(super) state: LocalState<D>,
    /// `w_c`
    pub(super) unit: Vec<f64>,
    /// Unit vectors whose nonnegative sums are all of the tangential plane, where the reformulation has such.
    pub(super) directions: Vec<[f64; 2]>,
    pub(super) contradiction: Option<Impulses>,
}

impl<const D: usize> Kept<D> {
    /// Errors: rows with bounds, which are refused; no contacts, of which there is nothing to be restated.
    pub(super) fn new(
        problem: &FrictionLocal<D>,
        directions: Vec<[f64; 2]>,
    ) -> Result<Self, SolveError> {
        has_contacts(problem)?;
        let state = problem.state(Access::Visits)?;
        let mut kept = Self { state, unit: vec![], directions, contradiction: None };
        kept.update(problem);
        Ok(kept)
    }

    pub(super) fn refill(&mut self, problem: &FrictionLocal<D>) -> Result<(), SolveError> {
        has_contacts(problem)?;
        problem.refill(&mut self.state)?;
        self.update(problem);
        Ok(())
    }

    fn update(&mut self, problem: &FrictionLocal<D>) {
        units(self.state.operator(problem).0, &mut self.unit);
        self.contradiction = problem.contradiction(&self.state).cloned();
    }
}

/// Errors: a problem of scalar rows alone.
fn has_contacts<const D: usize>(problem: &FrictionLocal<D>) -> Result<(), SolveError> {
    match problem.mu.is_empty() {
        true => Err(SolveError::needs(
            "at least one contact (scalar rows alone go to nsgs, psor and auto)",
            "none",
        )),
        false => Ok(()),
    }
}

/// The velocity of contact c at a point as the caller states it, multipliers included.
pub(super) fn velocity<const D: usize>(
    problem: &FrictionLocal<D>,
    point: &LocalPoint,
    c: usize,
) -> [f64; D] {
    let mut u = problem.W.row_product(c, &point.r);
    for (k, u) in u.iter_mut().enumerate() {
        *u += problem.q[D * c + k];
        if let Some(b) = &problem.rows {
            let each = point.lambda.iter().enumerate();
            *u += each.map(|(j, l)| b.V.get(D * c + k, j) * l).sum::<f64>();
        }
    }
    u
}

/// A certificate of the other problem, read as normal impulses that no motion feels: `row(c)` is the row of `u_N` of contact c, in units of `1/size(c)`. Tangential parts are
/// left out, because impulses with them refute nothing; the judge looks whether the normal ones do by themselves.
pub(super) fn normal_impulses<const D: usize>(
    certificate: Certificate,
    memo: &Kept<D>,
    contacts: usize,
    row: impl Fn(usize) -> usize,
    size: impl Fn(usize) -> f64,
) -> Certificate {
    let mut r = vec![0.0; D * contacts];
    match &certificate {
        Certificate::Row { row: only } => {
            (0..contacts).filter(|&c| row(c) == *only).for_each(|c| r[D * c] = size(c));
        }
        Certificate::Farkas { y } | Certificate::Ray { z: y, .. } => {
            let normal = |c: usize| y.get(row(c)).map_or(0.0, |y| size(c) * y.max(0.0));
            (0..contacts).for_each(|c| r[D * c] = normal(c));
        }
        Certificate::Impulses(_) | Certificate::Cones { .. } | Certificate::Separating { .. } => {
            return certificate;
        }
    }
    let lambda = memo.state.multipliers(&r);
    Impulses { r, lambda }.into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bridges::facets::Facets;

    #[test]
    fn a_vector_is_the_sum_of_its_neighbours() {
        for count in [3, 4, 5, 16] {
            let directions = Facets { facets: count, facet_angle: 0.3 }.directions::<3>();
            for k in 0..50 {
                let x = [(0.7 * f64::from(k)).cos(), 1.3 * (1.9 * f64::from(k)).sin()];
                let mut sum = [0.0; 2];
                decompose(&directions, x, |i, a| {
                    assert!(a >= 0.0);
                    sum[0] += a * directions[i][0];
                    sum[1] += a * directions[i][1];
                });
                assert!((sum[0] - x[0]).abs() + (sum[1] - x[1]).abs() < 1e-14, "{count} {x:?}");
            }
        }
        let plane = Facets::default().directions::<2>();
        decompose(&plane, [-2.0, 0.0], |i, a| assert_eq!((i, a), (1, 2.0)));
    }
}

//! Certificates that a problem has no solution, and their verification.

use serde::Serialize;

use super::contact::distance_to_cone;
use crate::linalg::{norm, small};
use crate::{FrictionGlobal, FrictionLocal};

/// Impulses that every admissible motion would have to feed: proof that a problem has no solution.
///
/// Let `r ∈ K` with `r_c = 0` wherever `mu_c > 0`, and multipliers `lambda`.
///
/// - Local: `(r, lambda)ᵀ [W, V; Vᵀ, R] = 0` and `qᵀ r + sᵀ lambda < 0`.
/// - Global: `H r + G lambda = 0` and `wᵀ r + bᵀ lambda < 0`.
///
/// Any solution has `ũ ∈ K*`, so `rᵀ ũ ≥ 0`; on the support of r friction vanishes and `rᵀ ũ = rᵀ u`, which the
/// two equations make negative: a contradiction (Farkas' alternative). With friction on the support the
/// sliding term could still make the product positive, so such an r proves nothing and is refused.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Certificate {
    /// Contact impulses of the ray.
    pub r: Vec<f64>,
    /// Multipliers of the ray (empty without bilateral constraints).
    pub lambda: Vec<f64>,
}

impl Certificate {
    /// The ray or its opposite, whichever makes `qᵀ r + sᵀ lambda` negative, if it passes `verify`.
    pub fn toward(
        r: Vec<f64>,
        lambda: Vec<f64>,
        q: &[f64],
        s: &[f64],
        verify: impl Fn(&Self) -> bool,
    ) -> Option<Self> {
        let product = dot(q, &r) + dot(s, &lambda);
        let mut ray = Self { r, lambda };
        if product > 0.0 {
            ray.r.iter_mut().chain(&mut ray.lambda).for_each(|x| *x = -*x);
        }
        verify(&ray).then_some(ray)
    }
}

/// The relative rounding that "equals zero" forgives.
const ZERO: f64 = 1e-10;
/// The relative margin by which the product must be negative.
const NEGATIVE: f64 = 1e-8;

pub(crate) fn refutes_local<const D: usize>(
    problem: &FrictionLocal<D>,
    certificate: &Certificate,
) -> bool {
    let (r, lambda) = (&certificate.r, &certificate.lambda);
    if !admissible::<D>(r, &problem.mu) || lambda.len() != problem.multipliers() {
        return false;
    }
    // The rows (r, λ) of [W V; Vᵀ R] vanish; the sizes of the terms say what vanishing means.
    let mut product = vec![0.0; r.len() + lambda.len()];
    let mut size = product.clone();
    for i in 0..problem.contacts() {
        let (cols, blocks) = problem.W.row(i);
        for (&j, b) in cols.iter().zip(blocks) {
            for k in 0..D {
                for l in 0..D {
                    let term = b[k][l] * r[D * i + k];
                    product[D * j as usize + l] += term;
                    size[D * j as usize + l] += term.abs();
                }
            }
        }
    }
    let mut load = Load::default();
    load.add(&problem.q, r);
    if let Some(b) = &problem.bilateral {
        let m = r.len();
        let entries = (b.V.triplets().map(|(i, j, x)| (i, m + j, x)))
            .chain(b.V.triplets().map(|(i, j, x)| (m + j, i, x)))
            .chain(b.R.triplets().map(|(i, j, x)| (m + i, m + j, x)));
        for (i, j, x) in entries {
            let term = x * if i < m { r[i] } else { lambda[i - m] };
            product[j] += term;
            size[j] += term.abs();
        }
        load.add(&b.s, lambda);
    }
    norm(&product) <= ZERO * norm(&size) && load.is_negative()
}

pub(crate) fn refutes_global<const D: usize>(
    problem: &FrictionGlobal<D>,
    certificate: &Certificate,
) -> bool {
    let (r, lambda) = (&certificate.r, &certificate.lambda);
    if !admissible::<D>(r, &problem.mu) || lambda.len() != problem.multipliers() {
        return false;
    }
    let mut product = vec![0.0; problem.dofs()];
    let mut size = product.clone();
    let mut load = Load::default();
    load.add(&problem.w, r);
    let mut add = |a: &crate::linalg::Csc, x: &[f64]| {
        for (i, j, value) in a.triplets() {
            product[i] += value * x[j];
            size[i] += (value * x[j]).abs();
        }
    };
    add(&problem.H, r);
    if let Some(b) = &problem.bilateral {
        add(&b.G, lambda);
        load.add(&b.b, lambda);
    }
    norm(&product) <= ZERO * norm(&size) && load.is_negative()
}

/// A sum of products and of their sizes.
#[derive(Default)]
struct Load {
    sum: f64,
    size: f64,
}

impl Load {
    fn add(&mut self, a: &[f64], b: &[f64]) {
        self.sum += dot(a, b);
        self.size += a.iter().zip(b).map(|(x, y)| (x * y).abs()).sum::<f64>();
    }

    fn is_negative(&self) -> bool {
        self.sum < -NEGATIVE * self.size
    }
}

/// `r ∈ K`, supported on frictionless contacts, finite and of the right length.
fn admissible<const D: usize>(r: &[f64], mu: &[f64]) -> bool {
    let scale = norm(r);
    r.len() == D * mu.len()
        && scale.is_finite()
        && mu.iter().enumerate().all(|(c, &mu)| {
            let rc: [f64; D] = small::block(r, c);
            if mu > 0.0 { rc == [0.0; D] } else { distance_to_cone(&rc, 0.0) <= 1e-14 * scale }
        })
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::{Bsr, Csc};

    /// A mass of 1 pressed between two opposite walls that approach each other: no motion is admissible.
    fn squeezed(mu: f64) -> (FrictionGlobal<2>, FrictionLocal<2>) {
        let h = [(0, 0, 1.0), (1, 1, 1.0), (0, 2, -1.0), (1, 3, -1.0)];
        let h = Csc::from_triplets(2, 4, h.into_iter()).unwrap();
        let w = vec![-1.0, 0.0, -1.0, 0.0];
        let product = Csc::from_triplets(
            4,
            4,
            [
                (0, 0, 1.0),
                (0, 2, -1.0),
                (2, 0, -1.0),
                (2, 2, 1.0),
                (1, 1, 1.0),
                (1, 3, -1.0),
                (3, 1, -1.0),
                (3, 3, 1.0),
            ]
            .into_iter(),
        );
        let global = FrictionGlobal::new(
            Csc::diagonal(&[1.0, 1.0]),
            h,
            vec![0.0; 2],
            w.clone(),
            vec![mu; 2],
        );
        let local = FrictionLocal::new(Bsr::from_csc(&product.unwrap()), w, vec![mu; 2]).unwrap();
        (global.unwrap(), local)
    }

    #[test]
    fn squeezing_walls_are_refuted_without_friction_only() {
        let ray = Certificate { r: vec![1.0, 0.0, 1.0, 0.0], lambda: vec![] };
        let (global, local) = squeezed(0.0);
        assert!(refutes_global(&global, &ray) && refutes_local(&local, &ray));
        let (global, local) = squeezed(0.5);
        assert!(!refutes_global(&global, &ray) && !refutes_local(&local, &ray));
    }

    #[test]
    fn a_false_ray_is_refused() {
        let (global, local) = squeezed(0.0);
        for r in [vec![1.0, 0.0, 0.9, 0.0], vec![-1.0, 0.0, -1.0, 0.0], vec![0.0; 4], vec![1.0]] {
            let ray = Certificate { r, lambda: vec![] };
            assert!(!refutes_global(&global, &ray) && !refutes_local(&local, &ray), "{ray:?}");
        }
    }

    #[test]
    fn contradicting_bilateral_constraints_are_refuted() {
        // v_0 = 1 and v_0 = 2 at once.
        let (mut global, _) = squeezed(0.5);
        let g = Csc::from_triplets(2, 2, [(0, 0, 1.0), (0, 1, 1.0)].into_iter()).unwrap();
        global.bilateral = Some(crate::BilateralGlobal { G: g, b: vec![-1.0, -2.0] });
        assert!(global.validate().is_ok());
        let ray = Certificate { r: vec![0.0; 4], lambda: vec![-1.0, 1.0] };
        assert!(refutes_global(&global, &ray));
    }
}

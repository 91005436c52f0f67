//! Impulses that prove that a contact problem has no solution, and their verification.

use serde::{Deserialize, Serialize};

use crate::FrictionGlobal;
use crate::check::{Kinematic, Law};

/// Impulses that every admissible motion would have to feed: proof that a problem has no solution.
///
/// Let `r_N ≥ 0` and `r_T = 0` at every contact, and multipliers `lambda`.
///
/// - Local: `(r, lambda)ᵀ [W, V; Vᵀ, R] = 0` and `qᵀ r + sᵀ lambda < 0`.
/// - Global: `H r + G lambda = 0` and `wᵀ r + bᵀ lambda < 0`.
///
/// Any solution has `u_N ≥ 0`, so `rᵀ u = Σ r_N u_N ≥ 0`, which the two equations make negative: a contradiction (Farkas'
/// alternative), whatever mu. With `r_T ≠ 0` there is none: of a solution only `ũ ∈ K*` is known, so `rᵀ u ≥ −Σ mu r_N‖u_T‖`, which may
/// be negative where contacts slide. Such an r is refused here; it refutes the criterion of existence only
/// ([`crate::check::Kinematics::refutes_criterion`]).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Impulses {
    /// Contact impulses of the ray.
    pub r: Vec<f64>,
    /// Multipliers of the ray (empty without bilateral constraints).
    pub lambda: Vec<f64>,
}

impl Impulses {
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

    /// Which of the `contacts` have an impulse.
    pub fn pressed(&self, contacts: usize) -> Vec<usize> {
        let width = self.r.len() / contacts.max(1);
        let any = |c: &usize| self.r[width * c..width * (c + 1)].iter().any(|r| *r != 0.0);
        (0..contacts).filter(any).collect()
    }
}

/// Whether the impulses refute the problem, if only up to rounding.
pub(crate) fn holds<const D: usize, L: Law<D>>(
    problem: &FrictionGlobal<D, L>,
    certificate: &Impulses,
) -> bool {
    problem.kinematics().refutes(certificate)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{FrictionLocal, Problem};
    use nonsmooth_linalg::{Bsr, Csc};

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
    fn squeezing_walls_are_refuted_whatever_the_friction() {
        let ray = Impulses { r: vec![1.0, 0.0, 1.0, 0.0], lambda: vec![] };
        for mu in [0.0, 0.5, 3.0] {
            let (global, local) = squeezed(mu);
            assert!(
                global.verify(&ray.clone().into()) && local.verify(&ray.clone().into()),
                "mu = {mu}"
            );
            // Tangential impulses that balance as well and lie in K spoil the proof.
            let tilted = Impulses { r: vec![1.0, 0.1, 1.0, 0.1], lambda: vec![] };
            assert!(
                !global.verify(&tilted.clone().into()) && !local.verify(&tilted.clone().into())
            );
        }
    }

    #[test]
    fn a_false_ray_is_refused() {
        let (global, local) = squeezed(0.0);
        for r in [vec![1.0, 0.0, 0.9, 0.0], vec![-1.0, 0.0, -1.0, 0.0], vec![0.0; 4], vec![1.0]] {
            let ray = Impulses { r, lambda: vec![] };
            assert!(
                !global.verify(&ray.clone().into()) && !local.verify(&ray.clone().into()),
                "{ray:?}"
            );
        }
    }

    #[test]
    fn contradicting_bilateral_constraints_are_refuted() {
        // v_0 = 1 and v_0 = 2 at once.
        let (mut global, _) = squeezed(0.5);
        let g = Csc::from_triplets(2, 2, [(0, 0, 1.0), (0, 1, 1.0)].into_iter()).unwrap();
        global.rows = Some(crate::RowsGlobal::bilateral(g, vec![-1.0, -2.0]));
        assert!(global.validate().is_ok());
        let ray = Impulses { r: vec![0.0; 4], lambda: vec![-1.0, 1.0] };
        assert!(global.verify(&ray.clone().into()));
    }
}

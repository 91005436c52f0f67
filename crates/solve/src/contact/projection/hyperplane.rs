//! **Hyperplane projection**: `r ← P_K(r − γ τ_k d_k)`, a step to (or beyond) a hyperplane that parts r from the solutions.
//!
//! Problem: find r ∈ K with `F(r)ᵀ(r' − r) ≥ 0` for all r' ∈ K, `F(r) = W r + q + (mu‖u_T‖e_N)_c`.
//!
//! Method: a prediction `r̄ = P_K(r − ρ_k F(r))` with a self-adaptive step; a hyperplane through r̄ with the normal d that has r on one side
//! and, for monotone F, all solutions on the other; γ times the way from r to it, `τ = dᵀ(r − r̄)/‖d‖²`, then back to K. Each step
//! brings r closer to every solution, without a Lipschitz constant. The normal is
//!
//! ```text
//! d = r − r̄ − ρ(F(r) − F(r̄))    residual: vanishes at the solution, so τ stays of order one
//! d = F(r̄)                      field: the classical one, which does not
//! ```
//!
//! (in the metric of the methods: fields are divided by w_c).
//!
//! References: SolodovTseng1996 (residual); SolodovSvaiter1999 (field, projecting on the part of K behind the hyperplane); Acary, lecture, the variants of (105);
//! AcaryBremondHuber2018, section on projection methods (field).
//! Cost of a step: two products with W, more where the step is shortened. Storage: 4 vectors.
//! Fails: as the extragradient method. With the normal F(r̄), which is not zero at open and sliding contacts, τ tends to zero: on planted
//! problems of 20 contacts 200 000 steps end at 1e-3.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Field, Method, Ratio, StepRule};
use crate::contact::form::Linear;
use crate::core::ranges::{at_least, below};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};

/// The hyperparameters of the hyperplane projection.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Hyperplane {
    /// The normal of the hyperplane.
    pub normal: Normal,
    /// How far beyond (above 1) or short of (below 1) the hyperplane a step goes, in (0, 2).
    pub gamma: f64,
    /// What the prediction's step length is measured by.
    pub rule: Ratio,
    /// Accept a prediction whose ratio is at most this, in (0, 1).
    pub accept: f64,
    /// Lengthen the next prediction after a ratio below this, in (0, accept).
    pub grow_below: f64,
    /// The factor by which a prediction's step is shortened, in (0, 0.99); its inverse lengthens.
    pub shrink: f64,
    /// Steps between two evaluations of the true residual, unless the estimate asks for one earlier.
    pub check_every: usize,
}

/// The normals of the hyperplane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Normal {
    /// `r - r' - rho (F(r) - F(r'))`.
    #[default]
    Residual,
    /// `F(r')`, the classical one: very slow with friction.
    Field,
}

impl Default for Hyperplane {
    fn default() -> Self {
        let StepRule { accept, grow_below, shrink, check_every, .. } = StepRule::default();
        Self {
            normal: Normal::Residual,
            gamma: 1.5,
            rule: Ratio::SolodovTseng,
            accept,
            grow_below,
            shrink,
            check_every,
        }
    }
}

impl Hyperplane {
    fn step_rule(&self) -> StepRule {
        let Self { rule, accept, grow_below, shrink, check_every, .. } = *self;
        StepRule { rule, accept, grow_below, shrink, check_every }
    }
}

impl Settings for Hyperplane {
    fn validate(&self) -> Result<(), String> {
        below("gamma", self.gamma, 2.0)?;
        self.step_rule().validate()?;
        at_least("check_every", self.check_every, 1)
    }
}

impl Described for Hyperplane {
    const ABOUT: &'static About = &About {
        name: "hyperplane",
        family: "projection",
        solves: Solves::Law,
        summary: "hyperplane projection with a self-adaptive prediction",
        needs: &[],
        cites: &["SolodovTseng1996", "SolodovSvaiter1999", "AcaryBremondHuber2018", "Acary2018"],
        // normal=field is too slow for any problem that tests would run.
        variants: &["rule=khobotov"],
        settings: described::<Self>,
    };
}

impl Method for Hyperplane {
    fn begin<P: Linear<D>, const D: usize>(&self, _: &P, _: &[f64], _: &mut Field<P, D>) {}

    fn advance<P: Linear<D>, const D: usize>(
        &self,
        problem: &P,
        r: &mut [f64],
        field: &mut Field<P, D>,
    ) -> f64 {
        let rule = self.step_rule();
        Field::evaluate(&mut field.state, problem, r, &mut field.f); // F(r)
        let ratio = field.predict(&rule, problem, r); //                 r̄ = P_K(r − ρ F(r)), F(r̄)
        let estimate = field.estimate(r);
        let tau = match self.normal {
            Normal::Field => field.step_to_hyperplane(r),
            Normal::Residual => {
                field.residual_normal(r); //                            F(r) ← d
                field.step_along_normal(r)
            }
        };
        // Else r̄ is behind no hyperplane (F is not monotone there, or r̄ = r solves the problem): go there.
        if tau > 0.0 && tau.is_finite() {
            let at_trial = self.normal == Normal::Field;
            field.project_by(self.gamma * tau, problem, r, at_trial); // P_K(r − γ τ d)
        }
        r.copy_from_slice(&field.trial);
        rule.adapt(ratio, &mut field.rho);
        estimate
    }

    fn check_every(&self) -> usize {
        self.check_every
    }
}

#[cfg(test)]
mod tests {
    use nonsmooth_linalg::{Bsr, Csc};
    use nonsmooth_problem::{FrictionLocal, Problem};

    use super::*;
    use crate::contact::form::Contacts;

    /// One frictionless contact, `W = 2 I`, `q = (−2, 0, 0)`, r = 0, ρ = 1: in the metric `w_c = 2`
    /// `r̄ = (0 + 2/2) = 1`, `F(r̄) = 0`: r̄ is the solution. With q_T = (3, 0) only the normal part counts:
    /// `F(r̄) = (0, 3, 0)` is orthogonal to r − r̄, so λ = 0 and the step goes to r̄.
    #[test]
    fn steps_by_hand() {
        let w = Bsr::from_csc(&Csc::diagonal(&[2.0; 3]));
        let problem = FrictionLocal::<3>::new(w, vec![-2.0, 3.0, 0.0], vec![0.0]).unwrap();
        let mut field = Field::new(&problem).unwrap();
        let mut r = vec![0.0; 3];
        let normal = Normal::Field;
        let method = Hyperplane { normal, accept: 0.99, ..Hyperplane::default() };
        // The ratio of ρ = 1 is 1: shortened to 0.67, r̄ = 0.67, F(r̄) = (−0.66, 3, 0).
        method.advance(&problem, &mut r, &mut field);
        let lambda = 2.0 * 0.67 * 0.66 / (0.66_f64.powi(2) + 9.0);
        assert!((r[0] - 1.5 * lambda * 0.66 / 2.0).abs() < 1e-14, "{r:?} {lambda}");
        assert_eq!((r[1], r[2]), (0.0, 0.0));
        // The other normal, in the metric w = 2: d = −0.67 − 0.67/2 (−2 + 0.66) = −0.2211, τ = 0.67/0.2211.
        let mut r = vec![0.0; 3];
        field.rho = 1.0;
        Hyperplane { accept: 0.99, ..Hyperplane::default() }.advance(&problem, &mut r, &mut field);
        assert!((r[0] - 1.5 * 0.67).abs() < 1e-13, "{r:?}");
        assert_eq!(FrictionLocal::<3>::impulses(&mut problem.origin()).len(), 3);
    }

    /// The Solodov–Tseng ratio is at most Khobotov's, and equal where F(r) − F(r̄) is along r − r̄.
    #[test]
    fn ratios_by_hand() {
        let w = Csc::from_triplets(
            3,
            3,
            (0..3).map(|i| (i, i, 1.0)).chain([(0, 1, -1.0), (1, 0, 1.0)]),
        );
        let problem =
            FrictionLocal::<3>::new(Bsr::from_csc(&w.unwrap()), vec![-1.0, -0.5, 0.0], vec![0.5])
                .unwrap();
        let mut field = Field::new(&problem).unwrap();
        let r = vec![0.0; 3];
        (field.f, field.trial_f) = (vec![0.0; 3], vec![1.0, 1.0, 0.0]);
        (field.trial, field.rho) = (vec![1.0, 0.0, 0.0], 0.5);
        assert!((field.lipschitz_ratio(&r) - 0.5 * 2.0_f64.sqrt()).abs() < 1e-15);
        assert!((field.monotone_ratio(&r) - 0.5).abs() < 1e-15);
        assert!((field.step_to_hyperplane(&r) + 0.5).abs() < 1e-15);
    }
}

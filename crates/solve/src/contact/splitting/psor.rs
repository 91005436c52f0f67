//! **PSOR**, projected successive over-relaxation over contacts.
//!
//! Problem: `u = W r + q`, `K* ∋ u + mu‖u_T‖e_N ⟂ r ∈ K` for each contact.
//!
//! Method: visit the contacts in turn; move the visited contact's impulse against its modified velocity by ω over the norm of its
//! block, and project: `r_c ← P_K(r_c − (ω/‖W_cc‖) (u_c + mu‖u_cT‖ e_N))`, with the velocity that all the impulses moved before give. It is the sweep of
//! NSGS with this one projection in place of a local solve.
//!
//! References: Cryer1971; AcaryBremondHuber2018 (there PSOR, and NSGS with one projection).
//!
//! Cost of a sweep: one pass over the blocks of W and a projection a contact. Storage: as NSGS.
//! Fails: as NSGS, more slowly where the blocks W_cc are badly conditioned; ω is bounded by 2 even for a single contact.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::nsgs::{LocalChoice, Nsgs, Sweeps};
use crate::contact::law::local::Projection;
use crate::contact::splitting::ordering::Ordering;
use crate::core::ranges::{at_least, below};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};

/// One projection a visit: its length, and the order of the visits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Psor {
    /// Over-relaxation: the step in units of `1/|W_cc|`, in (0, 2).
    pub omega: f64,
    /// The order of the contacts within a sweep.
    pub ordering: Ordering,
    /// The seed of the shuffled orders.
    pub seed: u64,
    /// Sweeps between two evaluations of the true residual, unless the cheap estimate asks for one earlier.
    pub check_every: usize,
}

impl Default for Psor {
    fn default() -> Self {
        Self { omega: 1.3, ordering: Ordering::default(), seed: 0, check_every: 50 }
    }
}

impl Settings for Psor {
    fn validate(&self) -> Result<(), String> {
        below("omega", self.omega, 2.0)?;
        at_least("check_every", self.check_every, 1)
    }
}

impl Described for Psor {
    const ABOUT: &'static About = &About {
        name: "psor",
        family: "splitting",
        solves: Solves::Law,
        summary: "projected successive over-relaxation: Gauss-Seidel sweeps with one projection a contact",
        needs: &[],
        cites: &["Cryer1971", "AcaryBremondHuber2018"],
        variants: &["omega=1"],
        settings: described::<Self>,
    };
}

impl Psor {
    /// The sweeps that do it.
    pub(crate) fn sweeps<const D: usize>(self) -> Sweeps<Projection, D> {
        let Self { omega, ordering, seed, check_every } = self;
        let local = LocalChoice::Projection;
        Sweeps {
            settings: Nsgs { local, ordering, seed, check_every, ..Nsgs::default() },
            local: Projection { step: omega },
        }
    }
}

#[cfg(test)]
mod tests {
    use nonsmooth_linalg::{Bsr, Csc};
    use nonsmooth_problem::{FrictionLocal, Problem};

    use super::*;
    use crate::Solver;

    /// Two contacts in the plane, `W = I` but for 0.5 between their normals, `q = (−1, 0, −1, 0)`, ω = 0.5: the first moves to
    /// 0.5, then the second sees `u_N = 0.25 − 1` and moves to 0.375.
    #[test]
    fn a_sweep_by_hand() {
        let entries = (0..4).map(|i| (i, i, 1.0)).chain([(0, 2, 0.5), (2, 0, 0.5)]);
        let w = Bsr::from_csc(&Csc::from_triplets(4, 4, entries).unwrap());
        let problem = FrictionLocal::<2>::new(w, vec![-1.0, 0.0, -1.0, 0.0], vec![0.5; 2]).unwrap();
        let solver = Psor { omega: 0.5, ..Psor::default() }.sweeps::<2>();
        let mut work = solver.work(&problem).unwrap();
        let mut point = problem.origin();
        solver.start(&problem, &mut point, &mut work);
        solver.step(&problem, &mut point, &mut work);
        assert_eq!(point.r, [0.5, 0.0, 0.375, 0.0]);
    }
}

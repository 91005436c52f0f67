//! **Murty's least-index principal pivoting** (of Bard's type).
//!
//! Problem: `0 ≤ z ⟂ w = M z + q ≥ 0`, with free variables that equations determine.
//!
//! Method: while some `q̄_i < 0`, take `r = min{i : q̄_i < 0}` and exchange z_r and w_r. Starts from the basis that the caller's point suggests.
//! Ends with a polished answer.
//!
//! References: Acary2018 (23)(24); Murty1974; Murty1988, section 4.1; CottlePangStone2009, section 4.2.
//!
//! Cost of a step: one pivot, 2n². Storage: two n × n matrices.
//! Fails: finite for P-matrices, after at most 2ⁿ − 1 pivots, which there are examples of. Otherwise it stops at a zero on the diagonal or when a
//! basis comes back, and says so.

use nonsmooth_problem::LcpPoint;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{NOT_P, ended, polished, unpleasant};
use crate::complementarity::form::{Complementary, system};
use crate::complementarity::parts::{Cycle, Tableau};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};
use crate::core::trace::Trace;
use crate::{SolveError, Solver, Step};

/// The least index leaves, for which P-matrices guarantee an end.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Murty {
    /// Take the largest index in place of the least: as good in theory, and exponentially better or worse on an example.
    pub descending: bool,
}

impl Settings for Murty {}

impl Described for Murty {
    const ABOUT: &'static About = &About {
        name: "murty",
        family: "pivoting",
        solves: Solves::Law,
        summary: "Murty's principal pivoting: the least index with a negative value changes sides",
        needs: &[
            "the entries of M",
            "no zero on the tableau's diagonal (M a P-matrix: guaranteed)",
        ],
        cites: &["Acary2018", "Murty1974", "Murty1988", "CottlePangStone2009"],
        variants: &["descending=true"],
        settings: described::<Self>,
    };
}

/// The tableau, and the bases visited.
pub struct MurtyWork {
    tableau: Tableau,
    cycle: Cycle,
}

impl<P: Complementary> Solver<P> for Murty {
    type Work = MurtyWork;

    fn work(&self, problem: &P) -> Result<MurtyWork, SolveError> {
        Ok(MurtyWork { tableau: Tableau::new(&problem.system()?)?, cycle: Cycle::default() })
    }

    fn refill(&self, problem: &P, work: &mut MurtyWork) -> Result<(), SolveError> {
        work.tableau.load(&problem.system()?)
    }

    fn start(&self, problem: &P, point: &mut LcpPoint, work: &mut MurtyWork) {
        work.tableau.warm(&system(problem), &point.z);
        work.cycle.begin(work.tableau.basis());
    }

    fn step(&self, _: &P, _: &mut LcpPoint, work: &mut MurtyWork) -> Step {
        let MurtyWork { tableau, cycle } = work;
        if let Some(end) = ended(tableau) {
            return end;
        }
        let Some(r) = tableau.first_negative(self.descending) else {
            return polished(tableau, cycle);
        };
        if tableau.diagonal(r) == 0.0 {
            return unpleasant(tableau, Step::Stuck(NOT_P.into()));
        }
        tableau.pivot(r);
        if cycle.returns(tableau.basis()) {
            return Step::Stuck("the pivots cycle: M is not a P-matrix".into());
        }
        Step::Continue { estimate: f64::NAN }
    }

    fn publish(&self, _: &P, point: &mut LcpPoint, work: &mut MurtyWork) {
        work.tableau.write(&mut point.z);
    }

    fn record(&self, on: bool, work: &mut MurtyWork) {
        work.tableau.record.begin(on);
    }

    fn trace(&self, work: &MurtyWork) -> Trace {
        Trace::Pivots(work.tableau.record.rows())
    }

    fn account(&self, work: &MurtyWork) -> Vec<String> {
        vec![work.tableau.summary()]
    }

    fn check_every(&self, _: &Self::Work) -> usize {
        super::CHECK_EVERY
    }
}

//! **Least-index criss-cross** for sufficient matrices.
//!
//! Problem: `0 ≤ z ⟂ w = M z + q ≥ 0`, with free variables that equations determine.
//!
//! Method: take the least i with `q̄_i < 0`. Where `t_ii > 0`, exchange the pair i; where it is zero, take the least j with `t_ij > 0` and exchange both pairs, i and j;
//! where there is none, row i proves that there is no solution. Neither feasibility nor an objective is watched.
//!
//! References: DenHertogRoosTerlaky1993; CsizmadiaIlles2006; CottlePangStone2009, chapter 4.
//!
//! Cost of a step: one pivot (2n²) or two. Storage: two n × n matrices.
//! Fails: finite for sufficient matrices (positive semidefinite and P among them), singular ones included. Others are noticed by a negative diagonal entry, by
//! signs that do not fit, or by a basis that comes back.

use nonsmooth_problem::LcpPoint;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{NOT_SUFFICIENT, ended, polished, unpleasant};
use crate::complementarity::form::{Complementary, system};
use crate::complementarity::parts::{Cycle, Tableau};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};
use crate::core::trace::Trace;
use crate::{SolveError, Solver, Step};

/// The order in which indices count as least.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CrissCross {
    /// Take the largest index in place of the least: as good in theory.
    pub descending: bool,
}

impl Settings for CrissCross {}

impl Described for CrissCross {
    const ABOUT: &'static About = &About {
        name: "criss_cross",
        family: "pivoting",
        solves: Solves::Law,
        summary: "least-index criss-cross: single and double principal pivots, for sufficient M; proves infeasibility",
        needs: &["the entries of M", "a sufficient M (PSD or P, for instance): guaranteed"],
        cites: &["DenHertogRoosTerlaky1993", "CsizmadiaIlles2006", "CottlePangStone2009"],
        variants: &["descending=true"],
        settings: described::<Self>,
    };
}

/// The tableau, and the bases visited.
pub struct CrissCrossWork {
    tableau: Tableau,
    cycle: Cycle,
}

impl<P: Complementary> Solver<P> for CrissCross {
    type Work = CrissCrossWork;

    fn work(&self, problem: &P) -> Result<CrissCrossWork, SolveError> {
        Ok(CrissCrossWork { tableau: Tableau::new(&problem.system()?)?, cycle: Cycle::default() })
    }

    fn refill(&self, problem: &P, work: &mut CrissCrossWork) -> Result<(), SolveError> {
        work.tableau.load(&problem.system()?)
    }

    fn start(&self, problem: &P, point: &mut LcpPoint, work: &mut CrissCrossWork) {
        work.tableau.warm(&system(problem), &point.z);
        work.cycle.begin(work.tableau.basis());
    }

    fn step(&self, _: &P, _: &mut LcpPoint, work: &mut CrissCrossWork) -> Step {
        let CrissCrossWork { tableau, cycle } = work;
        if let Some(end) = ended(tableau) {
            return end;
        }
        let Some(r) = tableau.first_negative(self.descending) else {
            return polished(tableau, cycle);
        };
        match tableau.diagonal(r) {
            d if d > 0.0 => tableau.pivot(r),
            d if d < 0.0 => return unpleasant(tableau, Step::Stuck(NOT_SUFFICIENT.into())),
            _ => {
                tableau.sizes_of_row(r);
                let eligible = |j: &usize| *j != r && tableau.entry(r, *j) > tableau.threshold(*j);
                let mut pairs = tableau.pairs();
                let partner =
                    if self.descending { pairs.rfind(eligible) } else { pairs.find(eligible) };
                match partner {
                    None => {
                        let proof = tableau.farkas(r);
                        return unpleasant(tableau, Step::NoSolution(proof));
                    }
                    // Of a sufficient matrix t_jr is negative.
                    Some(j) if !tableau.pivot_pair(r, j) => {
                        return unpleasant(tableau, Step::Stuck(NOT_SUFFICIENT.into()));
                    }
                    Some(_) => {}
                }
            }
        }
        if cycle.returns(tableau.basis()) {
            return Step::Stuck("the pivots cycle: M is not sufficient".into());
        }
        Step::Continue { estimate: f64::NAN }
    }

    fn publish(&self, _: &P, point: &mut LcpPoint, work: &mut CrissCrossWork) {
        work.tableau.write(&mut point.z);
    }

    fn record(&self, on: bool, work: &mut CrissCrossWork) {
        work.tableau.record.begin(on);
    }

    fn trace(&self, work: &CrissCrossWork) -> Trace {
        Trace::Pivots(work.tableau.record.rows())
    }

    fn account(&self, work: &CrissCrossWork) -> Vec<String> {
        vec![work.tableau.summary()]
    }

    fn check_every(&self, _: &Self::Work) -> usize {
        super::CHECK_EVERY
    }
}

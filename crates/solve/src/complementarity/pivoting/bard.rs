//! **Bard's principal pivoting**: the most negative variable leaves.
//!
//! Problem: `0 ≤ z ⟂ w = M z + q ≥ 0`, with free variables that equations determine.
//!
//! Method: while some `q̄_i < 0`, exchange z_r and w_r where `q̄_r` is the most negative, in the problem's units, the least index among equals. A basis that
//! comes back is noticed; from then on, unless protection is switched off, the least index is taken as Murty does.
//!
//! References: Murty1988, section 4.1; CottlePangStone2009, section 4.2; Acary2018 (23)(24).
//!
//! Cost of a step: one pivot, 2n². Storage: two n × n matrices.
//! Fails: without protection it may cycle even for P-matrices, and says so; else as Murty's method, usually after far fewer pivots.

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

/// The most negative variable leaves: few pivots, but nothing keeps it from cycling by itself.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Bard {
    /// Go on with the least index once a basis has come back; otherwise stop and say that the pivots cycle.
    pub protect: bool,
}

impl Default for Bard {
    fn default() -> Self {
        Self { protect: true }
    }
}

impl Settings for Bard {}

impl Described for Bard {
    const ABOUT: &'static About = &About {
        name: "bard",
        family: "pivoting",
        solves: Solves::Law,
        summary: "Bard's principal pivoting: the most negative variable changes sides; least index where that cycles",
        needs: &[
            "the entries of M",
            "no zero on the tableau's diagonal (M a P-matrix: guaranteed)",
        ],
        cites: &["Acary2018", "Murty1988", "CottlePangStone2009"],
        variants: &["protect=false"],
        settings: described::<Self>,
    };
}

/// The tableau, and the bases visited.
pub struct BardWork {
    tableau: Tableau,
    cycle: Cycle,
    /// Whether a basis has come back.
    least: bool,
}

impl<P: Complementary> Solver<P> for Bard {
    type Work = BardWork;

    fn work(&self, problem: &P) -> Result<BardWork, SolveError> {
        let tableau = Tableau::new(&problem.system()?)?;
        Ok(BardWork { tableau, cycle: Cycle::default(), least: false })
    }

    fn refill(&self, problem: &P, work: &mut BardWork) -> Result<(), SolveError> {
        work.tableau.load(&problem.system()?)
    }

    fn start(&self, problem: &P, point: &mut LcpPoint, work: &mut BardWork) {
        work.tableau.warm(&system(problem), &point.z);
        work.cycle.begin(work.tableau.basis());
        work.least = false;
    }

    fn step(&self, _: &P, _: &mut LcpPoint, work: &mut BardWork) -> Step {
        let BardWork { tableau, cycle, least } = work;
        if let Some(end) = ended(tableau) {
            return end;
        }
        let chosen = if *least { tableau.first_negative(false) } else { tableau.most_negative() };
        let Some(r) = chosen else {
            return polished(tableau, cycle);
        };
        if tableau.diagonal(r) == 0.0 {
            return unpleasant(tableau, Step::Stuck(NOT_P.into()));
        }
        tableau.pivot(r);
        if cycle.returns(tableau.basis()) {
            if *least {
                return Step::Stuck("the pivots cycle: M is not a P-matrix".into());
            }
            if !self.protect {
                return Step::Stuck("the pivots cycle".into());
            }
            *least = true;
            cycle.begin(tableau.basis());
        }
        Step::Continue { estimate: f64::NAN }
    }

    fn publish(&self, _: &P, point: &mut LcpPoint, work: &mut BardWork) {
        work.tableau.write(&mut point.z);
    }

    fn record(&self, on: bool, work: &mut BardWork) {
        work.tableau.record.begin(on);
    }

    fn trace(&self, work: &BardWork) -> Trace {
        Trace::Pivots(work.tableau.record.rows())
    }

    fn account(&self, work: &BardWork) -> Vec<String> {
        let mut said = vec![work.tableau.summary()];
        if work.least {
            said.push("A basis came back: from then on the least index was taken.".into());
        }
        said
    }

    fn check_every(&self, _: &Self::Work) -> usize {
        super::CHECK_EVERY
    }
}

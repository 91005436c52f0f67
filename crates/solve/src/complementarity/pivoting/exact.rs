//! **Exact enumeration** of the complementary cones, by branch and bound in rational arithmetic.
//!
//! Problem: any complementarity problem whose matrices are known by their entries: LCP, MLCP (of any shape), horizontal and box LCP.
//!
//! Method: as [`enumeration`](super::Enumerate), on the problem in exact numbers ([`ExactCones`]): nothing is ever taken for zero. It ends with a solution, rounded once, or with vectors that
//! prove that there is none; both whatever the class, the scaling and the condition of M.
//!
//! References: CottlePangStone2009, section 1.3 (complementary cones); Bareiss1968 (elimination in integers); Bland1977 (ties).
//!
//! Cost: at most 2ᵐ cases for m pairs; a pivot is O(rows · columns) products of integers of up to 53 · rows bits: about 1 ms for ten rows.
//! Fails: by its cost; it is refused beyond `max_pairs` pairs. Where a solution is beyond the range or the precision of doubles its rounding may fail the check.

use nonsmooth_problem::Problem;
use nonsmooth_problem::check::Certificate;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::core::exact_cones::{ExactCones, Found as ExactlyFound};
use crate::core::ranges::at_most;
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};
use crate::{SolveError, Solver, Step};

/// How many pairs are taken on, since the cases double with each.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct EnumerationExact {
    /// The most complementary pairs that are taken on, at most 40: the cases may be 2 to that power.
    pub max_pairs: usize,
}

impl Default for EnumerationExact {
    fn default() -> Self {
        Self { max_pairs: 20 }
    }
}

impl Settings for EnumerationExact {
    fn validate(&self) -> Result<(), String> {
        at_most("max_pairs", self.max_pairs, 40)
    }
}

impl Described for EnumerationExact {
    const ABOUT: &'static About = &About {
        name: "enumeration_exact",
        family: "pivoting",
        solves: Solves::Law,
        summary: "enumeration of complementary cones in rational arithmetic: decides any problem of few variables, whatever its scaling and condition",
        needs: &["the entries of M", "few complementary pairs (max_pairs)"],
        cites: &["CottlePangStone2009", "Bareiss1968", "Bland1977"],
        variants: &[],
        settings: described::<Self>,
    };
}

/// What is said where an exact solution, rounded, is none.
const BEYOND: &str = "there is a solution, found exactly, but it is beyond double precision: rounded, it fails the check";

/// The search in rational numbers, and the solution that it found, rounded once.
pub struct ExactWork<P: Problem> {
    search: ExactCones,
    pairs: usize,
    found: Option<P::Point>,
}

impl<P: Problem> Solver<P> for EnumerationExact {
    type Work = ExactWork<P>;

    fn work(&self, problem: &P) -> Result<Self::Work, SolveError> {
        let needs = |found: &str| SolveError::needs("the entries of M (dense or sparse)", found);
        let system = problem.cones().ok_or_else(|| needs("an operator"))?;
        let pairs = system.pairs.len();
        if pairs > self.max_pairs {
            return Err(SolveError::needs(
                "at most `max_pairs` complementary pairs",
                format!("{pairs} (max_pairs = {})", self.max_pairs),
            ));
        }
        Ok(ExactWork { search: ExactCones::new(system), pairs, found: None })
    }

    fn start(&self, _: &P, _: &mut P::Point, _: &mut Self::Work) {}

    fn step(&self, problem: &P, _: &mut P::Point, work: &mut Self::Work) -> Step {
        match work.search.advance() {
            None => Step::Continue { estimate: f64::NAN },
            Some(ExactlyFound::Solution(t)) => {
                let x = work.search.system().unknowns_at(&t);
                work.found = Some(problem.assembled(&x));
                // The judge's word comes first.
                Step::Stuck(BEYOND.into())
            }
            Some(ExactlyFound::Nothing(vectors)) => {
                Step::NoSolution(Certificate::Separating { vectors })
            }
        }
    }

    fn publish(&self, _: &P, point: &mut P::Point, work: &mut Self::Work) {
        if let Some(found) = &work.found {
            P::copy_point(found, point);
        }
    }

    fn account(&self, work: &Self::Work) -> Vec<String> {
        let (pairs, cases) = (work.pairs, work.search.cases);
        vec![format!(
            "{cases} of 2^{pairs} cases were looked at or closed together, in exact arithmetic."
        )]
    }
}

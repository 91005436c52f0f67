//! Pivoting methods for linear complementarity problems: finite, on complementary (or almost complementary) bases.

mod bard;
mod basis;
mod block;
mod criss_cross;
mod enumeration;
mod exact;
mod keller;
mod lemke;
mod lemke_howson;
mod listing;
mod murty;
mod path;
mod start;

pub use crate::complementarity::parts::game::Equilibrium;
pub use bard::Bard;
pub use block::BlockPivoting;
pub use criss_cross::CrissCross;
pub use enumeration::Enumeration;
pub use exact::EnumerationExact;
pub use keller::Keller;
pub use lemke::{BasisKind, Covering, Lemke, LemkeWork, Ties};
pub use lemke_howson::{LemkeHowson, game, lemke_howson};
pub use listing::{Face, Solutions, all_solutions};
pub use murty::Murty;

use crate::Step;
use crate::complementarity::parts::{Cycle, Polished, Tableau};

/// Pivots between two visits of the judge: the bases on the way are rarely worth a visit, but the best of them survives a limit.
const CHECK_EVERY: usize = 100;
const NOT_P: &str = "a zero on the diagonal of the tableau: M is not a P-matrix";
const NOT_SUFFICIENT: &str = "signs in the tableau show that M is not a sufficient matrix";

/// What ends a method before it chooses a pivot: there is no solution, or the tableau is of no use.
fn ended(tableau: &mut Tableau) -> Option<Step> {
    if let Some(proof) = tableau.refuted() {
        return Some(Step::NoSolution(proof));
    }
    tableau.is_lost().then(|| Step::Stuck("numerically singular bases on the way".into()))
}

/// Nothing is negative: the answer is polished, which may show that something is after all.
fn polished(tableau: &mut Tableau, cycle: &mut Cycle) -> Step {
    match tableau.polish() {
        Polished::Negative => {
            cycle.begin(tableau.basis());
            Step::Continue { estimate: f64::NAN }
        }
        Polished::Feasible | Polished::Exhausted => Step::Done,
    }
}

/// The step's word, once it has been heard from a tableau that is fresh from the data.
fn unpleasant(tableau: &mut Tableau, word: Step) -> Step {
    if tableau.freshen() { Step::Continue { estimate: f64::NAN } } else { word }
}

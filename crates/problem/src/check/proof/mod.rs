//! Proofs in exact arithmetic on the stored doubles.
//!
//! A solver's certificate is a handful of doubles, and what it says of the problem usually holds up to rounding only. Here it is first made strictly
//! valid (what is nearly zero is made zero by exact elimination) and then verified in rational numbers: [`Evidence::Proved`]. What cannot be made valid holds for
//! data nearby, and that is all that is said: [`Evidence::Nearly`].

mod cones;
mod cuts;
mod evidence;
mod exact;
mod monotone;
mod relaxation;
mod rounding;
mod sectors;
mod statement;

pub use cones::{Column, ConeSystem, Entries, NEAR};
pub use evidence::{Evidence, ExactVector, Proof};
pub use exact::{Exact, rounded};
pub use monotone::Monotone;
pub use relaxation::Constraint;
pub use sectors::{Case, Sector};

pub(crate) use evidence::{Claim, weigh};
pub(crate) use exact::{Equation, exact, negative, satisfying, sum_of_products};
pub(crate) use monotone::{monotone, principal};
pub(crate) use relaxation::Relaxed;
pub(crate) use rounding::{exactly_near, worth_a_look};
pub(crate) use sectors::{FEW as FEW_SPATIAL, Spatial};
pub(crate) use statement::{Exactly, bounded, columns, exacts, just};

//! Frictional contact: `u = W r + q`, `K* ∋ u + mu‖u_T‖ e_N ⟂ r ∈ K` at every contact, and all methods for it.
//!
//! | floor | rooms |
//! | --- | --- |
//! | families | [`splitting`], [`projection`], [`newton`], [`interior`], [`proximal`], [`optimisation`], [`auto`] |
//! | what families share | [`parts`], [`existence`], [`condense`], [`weigh`] |
//! | [`form`] | what a family may ask of a problem |
//! | [`law`] | one contact: cones, complementarity functions, one-contact solvers |

pub mod auto;
pub mod condense;
pub mod existence;
pub mod form;
pub mod interior;
pub mod law;
pub mod newton;
pub mod optimisation;
pub mod parts;
pub mod projection;
pub mod proximal;
pub mod solvers;
pub mod splitting;
pub mod weigh;

pub use condense::Condense;

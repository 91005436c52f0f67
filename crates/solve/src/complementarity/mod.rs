//! Complementarity problems, `0 ≤ z ⟂ M z + q ≥ 0` and its kin and `l ≤ x ≤ u ⟂ F(x)`, and all methods for them.
//!
//! | floor | rooms |
//! | --- | --- |
//! | families | [`splitting`], [`pivoting`], [`newton`], [`interior`], [`quadratic`], [`proximal`], [`path`], [`auto`] |
//! | what families share | [`parts`], [`guarantees`], [`reform`] |
//! | [`form`] | what a family may ask of a problem |
//! | [`functions`] | scalar complementarity functions |

pub mod auto;
pub mod form;
pub mod functions;
pub mod guarantees;
pub mod interior;
pub mod newton;
pub mod parts;
pub mod path;
pub mod pivoting;
pub mod proximal;
pub mod quadratic;
pub mod reform;
pub mod solvers;
pub mod splitting;

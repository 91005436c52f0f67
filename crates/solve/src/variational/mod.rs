//! Variational inequalities: find x ∈ X with `F(x)ᵀ(y − x) ≥ 0` for all y ∈ X.
//!
//! | room | what |
//! | --- | --- |
//! | `parts` | projections on the sets |
//! | [`projection`] | methods that project on X, and need monotone F |
//! | [`reform`] | by multipliers to a complementarity problem, for boxes and polyhedra |
//! | [`auto`] | the multipliers' complementarity problem, then projections |

pub mod auto;
mod parts;
pub mod projection;
pub mod reform;
mod solvers;

pub use parts::Projector;

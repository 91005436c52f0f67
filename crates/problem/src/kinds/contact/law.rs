//! The laws of contact, by their data.

/// Coulomb's friction with unilateral contact, `K* ∋ u + mu‖u_T‖e_N ⟂ r ∈ K`, `K = {‖r_T‖ ≤ mu r_N}`.
///
/// The law is said twice: for the judge ([`crate::check::Law`]), and for the solvers, who share nothing with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coulomb {
    /// The coefficient of friction, 0 allowed.
    pub mu: f64,
}

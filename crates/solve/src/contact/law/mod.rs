//! The law of one contact: cones with their projections, complementarity functions with their Jacobians, one-contact solvers.
//!
//! A law is a type ([`Coulomb`]); what methods ask of any law is [`ContactLaw`]. Gauss–Seidel with the projecting local solvers and the projection methods need no
//! more than that. A method with a formula for Coulomb's law alone takes problems with `Law = Coulomb` ([`Frictional`](crate::contact::form::Frictional)), and so
//! refuses others by type.

use cone::ConvexSet;
pub use nonsmooth_problem::Coulomb;

pub mod cfun;
pub mod cone;
pub mod local;

/// A law `K* ∋ ũ ⟂ r ∈ K` with `ũ = u + shift(u) e_N`: the cone K with its projection and the Jacobian of that ([`ConvexSet`]), and the change of variable.
pub trait ContactLaw<const D: usize>: ConvexSet<D> + Copy + Send + Sync {
    /// `ũ_N − u_N ≥ 0`.
    fn shift(&self, u: &[f64; D]) -> f64;

    /// Whether K is the half line of the normal impulses, so that the contact has a closed form.
    fn is_frictionless(&self) -> bool;
}

/// De Saxcé's change of variable, `ũ = u + mu‖u_T‖ e_N`.
impl<const D: usize> ContactLaw<D> for Coulomb {
    #[inline(always)]
    fn shift(&self, u: &[f64; D]) -> f64 {
        self.mu * cone::tangential_norm(u)
    }

    #[inline(always)]
    fn is_frictionless(&self) -> bool {
        self.mu <= 0.0
    }
}

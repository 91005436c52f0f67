//! The law of one contact: cones with their projections, complementarity functions with their Jacobians, one-contact solvers.
//!
//! A law is a type ([`Coulomb`], [`Rolling`]); what methods ask of any law is [`ContactLaw`]. Gauss–Seidel with the projecting local solvers and the projection methods need no
//! more than that. Newton's methods, interior points and `auto` take laws whose cone is made of disks ([`DiskLaw`]). A method with a formula for Coulomb's law alone takes problems with
//! `Law = Coulomb` ([`Frictional`](crate::contact::form::Frictional)), and so refuses others by type.

use std::fmt::Debug;
use std::ops::Range;

use cone::ConvexSet;
use local::LocalSolver;
use nonsmooth_linalg::norm;
use nonsmooth_problem::check::Law;
pub use nonsmooth_problem::{Coulomb, Rolling};

pub mod cfun;
pub mod cone;
pub mod local;

/// A law `K* ∋ ũ ⟂ r ∈ K` with `ũ = u + shift(u) e_N`: the cone K with its projection and the Jacobian of that ([`ConvexSet`]), and the change of variable.
pub trait ContactLaw<const D: usize>: ConvexSet<D> + Copy + Send + Sync {
    /// `ũ_N − u_N ≥ 0`.
    fn shift(&self, u: &[f64; D]) -> f64;

    /// Whether K is the half line of the normal impulses, so that the contact has a closed form.
    fn is_frictionless(&self) -> bool;

    /// `x − P_K(x − ũ)`.
    #[inline(always)]
    fn natural(&self, x: &[f64; D], modified: &[f64; D]) -> [f64; D] {
        let mut y = *x;
        for k in 0..D {
            y[k] -= modified[k];
        }
        let p = self.project(&y);
        std::array::from_fn(|k| x[k] - p[k])
    }
}

/// A law whose cone is made of disks, `K = {‖r_k‖ ≤ mu_k r_N for each disk k}`, `ũ = u + Σ_k mu_k‖u_k‖ e_N`: what its data are the judge's statement says ([`Law`]), which gives a solver
/// nothing but coefficients.
pub trait DiskLaw<const D: usize>: ContactLaw<D> + Law<D> + Debug {
    /// The one-contact solver that methods use where nothing else is asked for.
    type Local: LocalSolver<D, Self, Memo: Debug + Clone> + Default + Copy + Debug;

    /// The rows of a disk.
    #[inline(always)]
    fn rows(disk: usize) -> Range<usize> {
        let rows = (D - 1) / Self::DISKS;
        1 + disk * rows..1 + (disk + 1) * rows
    }

    /// `∂shift/∂u`, with a zero in front; zero where a disk's velocity is zero, whose every subgradient has length one at most.
    #[inline(always)]
    fn slope(&self, u: &[f64; D]) -> [f64; D] {
        let mut slope = [0.0; D];
        for disk in 0..Self::DISKS {
            let size = norm(&u[Self::rows(disk)]);
            if size > 0.0 {
                for k in Self::rows(disk) {
                    slope[k] = self.coefficient(disk) * (u[k] / size);
                }
            }
        }
        slope
    }
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

    #[inline(always)]
    fn natural(&self, x: &[f64; D], modified: &[f64; D]) -> [f64; D] {
        cfun::natural_map(x, modified, self.mu)
    }
}

impl<const D: usize> DiskLaw<D> for Coulomb {
    type Local = local::Exact;
}

/// `ũ = u + (mu‖u_T‖ + mu_r‖u_R‖) e_N`.
impl<const D: usize> ContactLaw<D> for Rolling {
    #[inline(always)]
    fn shift(&self, u: &[f64; D]) -> f64 {
        let [t, r] = [0, 1].map(|disk| norm(&u[<Self as DiskLaw<D>>::rows(disk)]));
        self.mu * t + self.mu_r * r
    }

    #[inline(always)]
    fn is_frictionless(&self) -> bool {
        self.mu <= 0.0 && self.mu_r <= 0.0
    }

    #[inline(always)]
    fn natural(&self, x: &[f64; D], modified: &[f64; D]) -> [f64; D] {
        cone::rolling_natural_map(*self, x, modified)
    }
}

impl<const D: usize> DiskLaw<D> for Rolling {
    type Local = local::RollingExact;
}

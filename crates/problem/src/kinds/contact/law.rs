//! The laws of contact, by their data.

use std::fmt::Debug;

/// Coulomb's friction with unilateral contact, `K* ∋ u + mu‖u_T‖e_N ⟂ r ∈ K`, `K = {‖r_T‖ ≤ mu r_N}`.
///
/// The law is said twice: for the judge ([`crate::check::Law`]), and for the solvers, who share nothing with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coulomb {
    /// The coefficient of friction, 0 allowed.
    pub mu: f64,
}

/// Coulomb's friction with rolling friction, `K* ∋ u + (mu‖u_T‖ + mu_r‖u_R‖) e_N ⟂ r ∈ K`,
/// `K = {‖r_T‖ ≤ mu r_N, ‖r_R‖ ≤ mu_r r_N}`, at contacts `[N, T, R]`: r_R is the impulse of a moment about the tangents, u_R the angular velocity of rolling.
///
/// Two disks, not one of four dimensions: sliding and rolling are resisted independently of each other. Said twice, as [`Coulomb`] is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rolling {
    /// The coefficient of friction, 0 allowed.
    pub mu: f64,
    /// The coefficient of rolling friction, a length, 0 allowed.
    pub mu_r: f64,
}

/// What a problem keeps of the coefficients of rolling friction: nothing under a law without.
pub trait RollingData: Debug + Clone + PartialEq + Default + Send + Sync + 'static {
    /// nc, or empty.
    fn values(&self) -> &[f64];

    /// Of these values; nothing of them under a law without.
    fn of(values: Vec<f64>) -> Self;

    /// Each times what `factor` says of its contact.
    fn scaled(&self, factor: impl Fn(usize) -> f64) -> Self;
}

impl RollingData for () {
    fn values(&self) -> &[f64] {
        &[]
    }

    fn of(_: Vec<f64>) -> Self {}

    fn scaled(&self, _: impl Fn(usize) -> f64) -> Self {}
}

impl RollingData for Vec<f64> {
    fn values(&self) -> &[f64] {
        self
    }

    fn of(values: Vec<f64>) -> Self {
        values
    }

    fn scaled(&self, factor: impl Fn(usize) -> f64) -> Self {
        self.iter().enumerate().map(|(c, x)| factor(c) * x).collect()
    }
}

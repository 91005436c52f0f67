//! Complementarity functions: maps that vanish exactly at the pairs `(u, r)` that obey the law, with an element of
//! their generalised Jacobian.

mod alart_curnier;
mod chen_mangasarian;
mod fischer_burmeister;
mod hueber_stadler_wohlmuth;
mod natural_map;
mod park_kwak;
mod xuewen_soh_wanji;

use crate::contact::law::{Coulomb, DiskLaw, cone};
use crate::core::register::Named;
use crate::core::settings::Settings;

pub use alart_curnier::{AlartCurnier, Disk, JeanMoreau, alart_curnier};
pub use chen_mangasarian::{ChenMangasarian, Kernel};
pub use fischer_burmeister::{FischerBurmeister, SmoothedFischerBurmeister};
pub use hueber_stadler_wohlmuth::{HueberStadlerWohlmuth, SlipBlock};
pub use natural_map::{NaturalMap, natural_map, natural_residual};
pub use park_kwak::ParkKwak;
pub use xuewen_soh_wanji::XuewenSohWanji;

/// The scaling parameters ρ_N, ρ_T > 0, in units of 1/W.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Radii {
    /// ρ_N.
    pub normal: f64,
    /// ρ_T.
    pub tangential: f64,
    /// ρ_R; no law without rolling friction looks at it.
    pub rolling: f64,
}

impl Radii {
    /// One for all parts.
    pub fn uniform(rho: f64) -> Self {
        Self { normal: rho, tangential: rho, rolling: rho }
    }

    /// From the block of W: of the normal part, and of each disk's block with all else zero.
    pub fn of<L: DiskLaw<D>, const D: usize>(
        w: &[[f64; D]; D],
        normal: impl Fn(&[[f64; D]; D]) -> f64,
        disk: impl Fn(&[[f64; D]; D]) -> f64,
    ) -> Self {
        let of = |which: usize| {
            let mut part = [[0.0; D]; D];
            for k in L::rows(which) {
                for l in L::rows(which) {
                    part[k][l] = w[k][l];
                }
            }
            disk(&part)
        };
        let tangential = of(0);
        let rolling = if L::DISKS > 1 { of(1) } else { tangential };
        Self { normal: normal(w), tangential, rolling }
    }

    /// ρ of a disk.
    #[inline(always)]
    pub fn of_disk(&self, disk: usize) -> f64 {
        if disk == 0 { self.tangential } else { self.rolling }
    }

    /// Whether all are positive numbers.
    pub fn are_positive(&self) -> bool {
        [self.normal, self.tangential, self.rolling].iter().all(|r| *r > 0.0 && r.is_finite())
    }
}

/// One contact as a complementarity function sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OneContact<L = Coulomb> {
    /// The law with its coefficients.
    pub law: L,
    /// What multiplies the velocity where its parts are treated apart.
    pub rho: Radii,
    /// What multiplies the velocity where it is treated as one vector.
    pub rho_cone: f64,
    /// ε ≥ 0 of the smoothed functions, in the unit of r; the others do not look at it.
    pub smoothing: f64,
}

/// Φ and its derivatives `A = ∂Φ/∂u`, `B = ∂Φ/∂r` at `(u, r)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Linearisation<const D: usize> {
    /// Φ.
    pub phi: [f64; D],
    /// ∂Φ/∂u.
    pub a: [[f64; D]; D],
    /// ∂Φ/∂r.
    pub b: [[f64; D]; D],
}

impl<const D: usize> Linearisation<D> {
    fn zero() -> Self {
        Self { phi: [0.0; D], a: [[0.0; D]; D], b: [[0.0; D]; D] }
    }

    /// `Φ_N = r_N − max(0, x_N)` with its derivatives and nothing else, and `x_N = r_N − ρ_N u_N`.
    #[inline(always)]
    fn with_normal_part(u: &[f64; D], r: &[f64; D], rho: &Radii) -> (Self, f64) {
        let mut out = Self::zero();
        let x_n = r[0] - rho.normal * u[0];
        if x_n > 0.0 {
            out.phi[0] = rho.normal * u[0];
            out.a[0][0] = rho.normal;
        } else {
            out.phi[0] = r[0];
            out.b[0][0] = 1.0;
        }
        (out, x_n)
    }

    /// `Φ_T = r_T` in place of what is there: the tangential part without friction.
    fn set_no_friction(&mut self, r: &[f64; D]) {
        for k in 1..D {
            self.phi[k] = r[k];
            self.a[k] = [0.0; D];
            self.b[k] = [0.0; D];
            self.b[k][k] = 1.0;
        }
    }
}

/// The piece of the friction law, with a disk of radius R, on which the tangential part is smooth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Piece {
    /// `‖x_T‖ ≤ R`, `R > 0`.
    Stick,
    /// `‖x_T‖ > R > 0`.
    Slip,
    /// `R = 0`.
    Open,
}

impl Piece {
    /// That of `size = ‖x_T‖`.
    #[inline(always)]
    fn of(size: f64, radius: f64) -> Self {
        if radius <= 0.0 {
            Self::Open
        } else if size <= radius {
            Self::Stick
        } else {
            Self::Slip
        }
    }
}

/// A complementarity function of one contact under the law L: `Φ(u, r) = 0` exactly where `K* ∋ ũ ⟂ r ∈ K`, Coulomb's
/// `ũ = u + mu‖u_T‖e_N` (for `smoothing = 0`).
pub trait ContactFunction<const D: usize, L = Coulomb>: Send + Sync {
    /// Whether the function has a smoothing parameter.
    const SMOOTHED: bool = false;

    /// Φ with an element of its generalised Jacobian (or what the method puts in its place).
    fn linearise(&self, contact: &OneContact<L>, u: &[f64; D], r: &[f64; D]) -> Linearisation<D>;
}

/// A function that has a Newton method. The struct is its hyperparameters.
pub trait NewtonFunction: Settings + Copy + Send + Sync + 'static {
    /// What the registry says of Newton's method on this function: name, summary, citations.
    const METHOD: Named;
}

/// De Saxcé's modified velocity `ũ = u + mu s e_N`, `s = √(‖u_T‖² + ε²) − ε`, and ∂s/∂u_T as `(0, t)`.
///
/// Where `u_T = 0` the derivative of ‖u_T‖ is every vector of the unit disk; zero is taken.
#[inline(always)]
fn modified_velocity<const D: usize>(u: &[f64; D], mu: f64, epsilon: f64) -> ([f64; D], [f64; D]) {
    let square: f64 = u[1..].iter().map(|v| v * v).sum();
    let root = (square + epsilon * epsilon).sqrt();
    let (mut modified, mut t) = (*u, [0.0; D]);
    if root > 0.0 {
        // √(s² + ε²) − ε without cancellation.
        modified[0] += mu * square / (root + epsilon);
        for k in 1..D {
            t[k] = u[k] / root;
        }
    }
    (modified, t)
}

/// The pair in the coordinates in which K and K* are both the second-order cone: `x = (mu r_N, r_T)`,
/// `y = ρ (ũ_N/mu, ũ_T)`, for `mu > 0`; with ∂y/∂u.
struct SelfDual<const D: usize> {
    x: [f64; D],
    y: [f64; D],
    dy: [[f64; D]; D],
}

impl<const D: usize> SelfDual<D> {
    #[inline(always)]
    fn new(contact: &OneContact, u: &[f64; D], r: &[f64; D]) -> Self {
        let (mu, rho) = (contact.law.mu, contact.rho_cone);
        let (modified, t) = modified_velocity(u, mu, contact.smoothing);
        let (mut x, mut y, mut dy) = (*r, modified.map(|v| rho * v), [[0.0; D]; D]);
        x[0] *= mu;
        y[0] /= mu;
        dy[0][0] = rho / mu;
        for k in 1..D {
            dy[0][k] = rho * t[k];
            dy[k][k] = rho;
        }
        Self { x, y, dy }
    }

    /// Φ with `∂φ/∂x` and `∂φ/∂y` taken back to r and u.
    #[inline(always)]
    fn pull_back(
        &self,
        mu: f64,
        phi: [f64; D],
        dx: &[[f64; D]; D],
        dy: &[[f64; D]; D],
    ) -> Linearisation<D> {
        let mut out = Linearisation { phi, a: [[0.0; D]; D], b: *dx };
        for k in 0..D {
            out.b[k][0] *= mu;
            for l in 0..D {
                for j in 0..D {
                    out.a[k][l] += dy[k][j] * self.dy[j][l];
                }
            }
        }
        out
    }
}

/// A unit vector along `x_T` as `(0, t)`, or `None` where `x_T = 0`.
#[inline(always)]
fn direction<const D: usize>(x: &[f64; D]) -> Option<[f64; D]> {
    let size = cone::tangential_norm(x);
    (size > 0.0).then(|| {
        let mut t = x.map(|v| v / size);
        t[0] = 0.0;
        t
    })
}

#[cfg(test)]
mod tests;

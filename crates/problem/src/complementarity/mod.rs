//! Linear complementarity problems as plain validated data.
//!
//! | kind | statement |
//! | --- | --- |
//! | [`Lcp`] | `0 ≤ z ⟂ w = M z + q ≥ 0` |
//! | [`Mlcp`] | `A u + C v + a = 0`, `0 ≤ v ⟂ D u + B v + b ≥ 0` |
//! | [`Hlcp`] | `Q x + R s = q`, `0 ≤ x ⟂ s ≥ 0` |
//! | [`BoxLcp`] | `−(M z + q) ∈ N_[l, u](z)` |

/// The [`Problem`](crate::Problem) of a kind whose point is z: what differs is the number of variables and the point to begin from.
macro_rules! problem_in_z {
    ($kind:ident, $problem:ident => $unknowns:expr, $origin:expr) => {
        impl crate::Problem for $kind {
            type Point = $crate::LcpPoint;
            type Gauge = $crate::check::LinearGauge;

            fn kind(&self) -> $crate::Kind {
                $crate::Kind::$kind
            }

            fn unknowns(&self) -> usize {
                let $problem = self;
                $unknowns
            }

            fn origin(&self) -> Self::Point {
                let $problem = self;
                $crate::LcpPoint { z: $origin }
            }

            fn validate_point(&self, point: &Self::Point) -> Result<(), $crate::ProblemError> {
                $crate::error::vector("z", &point.z, self.unknowns(), "variables")
            }

            fn copy_point(from: &Self::Point, to: &mut Self::Point) {
                to.z.clone_from(&from.z);
            }

            fn gauge(&self) -> Result<Self::Gauge, $crate::ProblemError> {
                Ok($crate::check::LinearGauge::new(self))
            }

            fn regauge(&self, gauge: &mut Self::Gauge) -> Result<(), $crate::ProblemError> {
                gauge.refill(self);
                Ok(())
            }

            fn measure(
                &self,
                point: &Self::Point,
                gauge: &mut Self::Gauge,
            ) -> $crate::check::Measure {
                gauge.measure(self, point, false)
            }

            fn certify(
                &self,
                point: &Self::Point,
                gauge: &mut Self::Gauge,
            ) -> $crate::check::Measure {
                gauge.measure(self, point, true)
            }

            fn tidy(&self, point: &mut Self::Point, gauge: &mut Self::Gauge, boldly: bool) -> bool {
                gauge.tidy(self, point, boldly)
            }

            fn partner(&self, point: &Self::Point) -> Vec<f64> {
                let mut w = vec![0.0; self.q.len()];
                self.M.mul(&point.z, &mut w);
                w.iter_mut().zip(&self.q).for_each(|(w, q)| *w += q);
                w
            }

            fn evidence(
                &self,
                certificate: &$crate::check::Certificate,
            ) -> $crate::check::Evidence {
                $crate::check::weigh(self, certificate)
            }

            fn cones(&self) -> Option<$crate::check::ConeSystem> {
                $crate::check::Exactly::system(self, None)
            }

            fn assembled(&self, unknowns: &[f64]) -> Self::Point {
                $crate::LcpPoint { z: unknowns.to_vec() }
            }
        }
    };
}

mod boxed;
mod hlcp;
mod lcp;
mod mlcp;

pub use boxed::BoxLcp;
pub use hlcp::{Hlcp, HlcpPoint};
pub use lcp::{Lcp, LcpPoint};
pub use mlcp::Mlcp;

use crate::ProblemError;
use nonsmooth_linalg::Matrix;

/// Any of the linear complementarity problems.
#[derive(Debug, Clone, PartialEq)]
pub enum Complementarity {
    /// `0 ≤ z ⟂ M z + q ≥ 0`.
    Lcp(Lcp),
    /// With equalities and free variables.
    Mlcp(Mlcp),
    /// `Q x + R s = q`, `0 ≤ x ⟂ s ≥ 0`.
    Hlcp(Hlcp),
    /// With two bounds.
    Box(BoxLcp),
}

/// Evaluates an expression for whichever problem a [`Complementarity`] holds.
#[macro_export]
macro_rules! with_complementarity {
    ($any:expr, $problem:ident => $body:expr) => {
        match $any {
            $crate::Complementarity::Lcp($problem) => $body,
            $crate::Complementarity::Mlcp($problem) => $body,
            $crate::Complementarity::Hlcp($problem) => $body,
            $crate::Complementarity::Box($problem) => $body,
        }
    };
}

/// A square matrix with finite entries, and at least one.
fn square(name: &str, m: &Matrix) -> Result<(), ProblemError> {
    if m.nrows() == 0 {
        return Err(ProblemError::shape(name, "at least one row", "none"));
    }
    m.check_shape(name, m.nrows(), m.nrows(), "square")?;
    Ok(m.check_finite(name)?)
}

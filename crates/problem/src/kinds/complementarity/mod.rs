//! Complementarity problems as plain validated data, their judges and planted instances.
//!
//! | kind | statement |
//! | --- | --- |
//! | [`Lcp`] | `0 ≤ z ⟂ w = M z + q ≥ 0` |
//! | [`Mlcp`] | `A u + C v + a = 0`, `0 ≤ v ⟂ D u + B v + b ≥ 0` |
//! | [`Hlcp`] | `Q x + R s = q`, `0 ≤ x ⟂ s ≥ 0` |
//! | [`BoxLcp`] | `−(M z + q) ∈ N_[l, u](z)` |
//! | [`Mcp`] | `−F(x) ∈ N_[l, u](x)` |

/// The [`Problem`](crate::Problem) of a kind whose point is z, and its verdict: what differs is the number of variables and the point to begin from.
macro_rules! problem_in_z {
    ($kind:ident, $problem:ident => $unknowns:expr, $origin:expr) => {
        impl crate::Problem for $kind {
            type Point = $crate::LcpPoint;
            type Gauge = $crate::check::LinearGauge;

            fn kind(&self) -> $crate::Kind {
                <Self as $crate::OfAny>::KIND
            }

            fn unknowns(&self) -> usize {
                let $problem = self;
                $unknowns
            }

            fn origin(&self) -> Self::Point {
                let $problem = self;
                $crate::LcpPoint { z: $origin }
            }

            fn validate(&self) -> Result<(), $crate::ProblemError> {
                Self::validate(self)
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

        impl $crate::check::Judged for $kind {
            type Status = $crate::check::RowStatus;
            type Counts = $crate::check::RowCounts;

            fn verdict(
                &self,
                point: &Self::Point,
                gauge: &mut Self::Gauge,
                tolerance: f64,
            ) -> $crate::check::VerdictOf<Self> {
                gauge.verdict(self, point, tolerance)
            }
        }
    };
}

mod boxed;
mod hlcp;
pub(crate) mod judge;
mod lcp;
mod mcp;
mod mlcp;
pub mod planted;
pub(crate) mod stated;

pub use boxed::BoxLcp;
pub use hlcp::{Hlcp, HlcpGauge, HlcpPoint};
pub use judge::{LinearGauge, RowCounts, RowStatus};
pub use lcp::{Lcp, LcpPoint};
pub use mcp::{Mcp, McpGauge};
pub use mlcp::Mlcp;
pub use stated::{Part, Parts, Shape, Stated, plural};

use crate::ProblemError;
use crate::check::ConeSystem;
use crate::check::proof::{columns, exacts, just};
use nonsmooth_linalg::Matrix;

/// A square matrix with finite entries, and at least one.
fn square(name: &str, m: &Matrix) -> Result<(), ProblemError> {
    if m.nrows() == 0 {
        return Err(ProblemError::shape(name, "at least one row", "none"));
    }
    m.check_shape(name, m.nrows(), m.nrows(), "square")?;
    Ok(m.check_finite(name)?)
}

/// `w − M z = q` with pairs after the equalities and the free variables.
fn mixed(
    m: &Matrix,
    q: &[f64],
    equalities: usize,
    free: usize,
    wanted: Option<&[bool]>,
) -> Option<ConeSystem> {
    let mut system = ConeSystem::new(exacts(q), wanted);
    for (j, column) in columns(m, -1, &|i| system.wants(i))?.into_iter().enumerate() {
        let z = system.column(column);
        system.unknowns.push(just(z));
        match j.checked_sub(free) {
            None => system.free.push(z),
            Some(k) => {
                let w = system.unit(equalities + k, 1);
                system.pairs.push([w, z]);
            }
        }
    }
    Some(system)
}

//! Horizontal LCP → MLCP: s becomes a free variable.
//!
//! `Q x + R s = q`, `0 ≤ x ⟂ s ≥ 0` is `R u + Q v − q = 0`, `0 ≤ v ⟂ u ≥ 0` with `u = s`, `v = x`: `A = R`, `C = Q`, `D = I`, `B = 0`. The way back is the same.
//!
//! A Farkas vector `(η, y)` of the MLCP, `Rᵀη + y = 0`, `Qᵀη ≤ 0`, `−qᵀη < 0`, `y ≥ 0`, is −η for the horizontal problem.
//!
//! Source: Acary, lecture (8)(33). Cost: a copy of Q and R. Storage: both, and an identity; dense only where both are.

use nonsmooth_linalg::{Csc, Dense, Matrix};
use nonsmooth_problem::check::Certificate;
use nonsmooth_problem::{Hlcp, HlcpPoint, LcpPoint, Mlcp};

use crate::SolveError;
use crate::core::reformulation::Reformulation;
use crate::core::register::Composed;
use crate::core::settings::NoSettings;
use crate::{Boxed, Via};
use nonsmooth_problem::Kind;

/// The horizontal problem as a mixed one.
#[derive(Debug, Clone, Copy, Default)]
pub struct Mixed;

impl Composed<Hlcp> for Mixed {
    type To = Mlcp;
    type Settings = NoSettings;
    const NAME: &'static str = "mixed";
    const SUMMARY: &'static str = "horizontal LCP to MLCP: s is a free variable";
    const FROM: &'static [Kind] = &[Kind::Hlcp];
    const CITES: &'static [&'static str] = &["Acary2018"];

    fn compose(_: NoSettings, solver: Boxed<Self::To>) -> Boxed<Hlcp> {
        Boxed::new(Via { reformulation: Mixed, solver })
    }
}

impl Reformulation<Hlcp> for Mixed {
    type To = Mlcp;
    type Memo = ();

    fn reduce(&self, problem: &Hlcp) -> Result<(Mlcp, ()), SolveError> {
        let n = problem.dim();
        let mut entries = vec![];
        let known = problem.R.for_each(|i, j, x| entries.push((i, j, x)))
            && problem.Q.for_each(|i, j, x| entries.push((i, n + j, x)));
        if !known {
            return Err(SolveError::needs(
                "the entries of Q and R (dense or sparse)",
                "an operator",
            ));
        }
        entries.extend((0..n).map(|i| (n + i, i, 1.0)));
        let matrix: Matrix = match (&problem.Q, &problem.R) {
            (Matrix::Dense(_), Matrix::Dense(_)) => {
                let mut m = Dense::zeros(2 * n, 2 * n);
                entries.iter().for_each(|&(i, j, x)| m[(i, j)] = x);
                m.into()
            }
            _ => Csc::from_triplets(2 * n, 2 * n, entries.iter().copied())?.into(),
        };
        let q = problem.q.iter().map(|q| -q).chain(vec![0.0; n]).collect();
        Ok((Mlcp::new(matrix, q, n)?, ()))
    }

    fn lift_certificate(&self, certificate: Certificate, (): &()) -> Certificate {
        match certificate {
            Certificate::Farkas { y } | Certificate::Ray { z: y, z0: 0.0 } => {
                Certificate::Farkas { y: y[..y.len() / 2].iter().map(|y| -y).collect() }
            }
            other => other,
        }
    }

    fn lower(&self, _: &Hlcp, point: &HlcpPoint, (): &(), reduced: &mut LcpPoint) {
        reduced.z.clear();
        reduced.z.extend_from_slice(&point.s);
        reduced.z.extend_from_slice(&point.x);
    }

    fn lift(&self, problem: &Hlcp, reduced: &LcpPoint, (): &mut (), point: &mut HlcpPoint) {
        let (s, x) = reduced.z.split_at(problem.dim());
        point.s.copy_from_slice(s);
        point.x.copy_from_slice(x);
    }
}

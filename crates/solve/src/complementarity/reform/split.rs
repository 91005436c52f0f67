//! Box LCP → MLCP: bounds become shifts, second bounds become pairs with multipliers.
//!
//! | bounds of z_i | unknowns | rows |
//! | --- | --- | --- |
//! | none | `z_i`, free | `w_i = 0` |
//! | l | `z_i = l + v`, `v ≥ 0` | `w_i ≥ 0` |
//! | u | `z_i = u − v`, `v ≥ 0` | `−w_i ≥ 0` |
//! | l < u | `z_i = l + v`, `v ≥ 0`, `s ≥ 0` | `w_i + s ≥ 0`, `u − l − v ≥ 0` |
//! | l = u | none: `z_i = l` | none |
//!
//! Equations first, then v, then s. The way back is exact: a v of zero is the bound itself, a v of `u − l` or more is the other one.
//!
//! A Farkas vector y of the MLCP is one of the box LCP with the signs of its rows; it is zero where there are two bounds, since the column of s asks for `y ≤ 0`
//! there and the row for `y ≥ 0`.
//!
//! Source: Acary, lecture (8). Cost: O(entries of M). Storage: M again, with a row and a column more for every pair of bounds.

use nonsmooth_linalg::{Csc, Dense, Matrix};
use nonsmooth_problem::check::Certificate;
use nonsmooth_problem::{BoxLcp, LcpPoint, Mlcp};

use crate::SolveError;
use crate::core::reformulation::Reformulation;
use crate::core::register::Composed;
use crate::core::settings::NoSettings;
use crate::{Boxed, Via};
use nonsmooth_problem::Kind;

/// The prefix without settings: what becomes of a variable is decided by its bounds alone.
#[derive(Debug, Clone, Copy, Default)]
pub struct Split;

impl Composed<BoxLcp> for Split {
    type To = Mlcp;
    type Settings = NoSettings;
    const NAME: &'static str = "split";
    const SUMMARY: &'static str = "box LCP to MLCP: bounds by shifts, second bounds by multipliers";
    const FROM: &'static [Kind] = &[Kind::BoxLcp];
    const CITES: &'static [&'static str] = &["Acary2018"];

    fn compose(_: NoSettings, solver: Boxed<Self::To>) -> Boxed<BoxLcp> {
        Boxed::new(Via { reformulation: Split, solver })
    }
}

/// Where a variable went.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Place {
    /// A free variable of this number.
    Free(usize),
    /// `z = at + sign·v`, v of this number; s, if there is one.
    Pair { at: f64, sign: f64, v: usize, s: Option<usize> },
    /// `z = at`.
    Fixed(f64),
}

/// The places of the variables.
#[derive(Debug, Clone, PartialEq)]
pub struct SplitMemo {
    places: Vec<Place>,
    rows: usize,
}

impl SplitMemo {
    /// The unknown of the mixed problem (and its row) that stands for variable i, with its sign.
    fn unknown(&self, i: usize) -> Option<(usize, f64)> {
        match self.places[i] {
            Place::Free(k) => Some((k, 1.0)),
            Place::Pair { sign, v, .. } => Some((v, sign)),
            Place::Fixed(_) => None,
        }
    }

    /// A vector over the rows of the mixed problem, over the rows of the box problem.
    fn rows_back(&self, y: &[f64]) -> Vec<f64> {
        (0..self.places.len())
            .map(|i| match (self.places[i], self.unknown(i)) {
                (Place::Pair { s: Some(_), .. }, _) | (_, None) => 0.0,
                (_, Some((k, sign))) => sign * y[k],
            })
            .collect()
    }
}

fn places(problem: &BoxLcp) -> SplitMemo {
    let bounds: Vec<(f64, f64)> =
        problem.lower.iter().copied().zip(problem.upper.iter().copied()).collect();
    let free = bounds.iter().filter(|(l, u)| !l.is_finite() && !u.is_finite()).count();
    let fixed = bounds.iter().filter(|(l, u)| l == u).count();
    let (mut next_free, mut next_v, mut next_s) = (0, free, bounds.len() - fixed);
    let take = |next: &mut usize| {
        *next += 1;
        *next - 1
    };
    let places = bounds
        .iter()
        .map(|&(l, u)| match (l.is_finite(), u.is_finite()) {
            (true, true) if l == u => Place::Fixed(l),
            (false, false) => Place::Free(take(&mut next_free)),
            (false, true) => Place::Pair { at: u, sign: -1.0, v: take(&mut next_v), s: None },
            (true, second) => {
                let s = second.then(|| take(&mut next_s));
                Place::Pair { at: l, sign: 1.0, v: take(&mut next_v), s }
            }
        })
        .collect();
    SplitMemo { places, rows: next_s }
}

impl Reformulation<BoxLcp> for Split {
    type To = Mlcp;
    type Memo = SplitMemo;

    fn reduce(&self, problem: &BoxLcp) -> Result<(Mlcp, SplitMemo), SolveError> {
        if matches!(problem.M, Matrix::Operator(_)) {
            return Err(SolveError::needs("the entries of M (dense or sparse)", "an operator"));
        }
        let memo = places(problem);
        if memo.rows == 0 {
            return Err(SolveError::needs("a variable that can move", "bounds that fix them all"));
        }
        let free = memo.places.iter().filter(|p| matches!(p, Place::Free(_))).count();
        // q + M z at the bounds.
        let at: Vec<f64> = memo
            .places
            .iter()
            .map(|place| match *place {
                Place::Free(_) => 0.0,
                Place::Pair { at, .. } | Place::Fixed(at) => at,
            })
            .collect();
        let mut w = vec![0.0; at.len()];
        problem.M.mul(&at, &mut w);
        let mut q = vec![0.0; memo.rows];
        let mut entries = vec![];
        for (i, place) in memo.places.iter().enumerate() {
            if let Some((k, sign)) = memo.unknown(i) {
                q[k] = sign * (problem.q[i] + w[i]);
            }
            if let Place::Pair { v, s: Some(s), .. } = *place {
                q[s] = problem.upper[i] - problem.lower[i];
                entries.extend([(v, s, 1.0), (s, v, -1.0)]);
            }
        }
        problem.M.for_each(|i, j, x| {
            if let (Some((r, a)), Some((c, b))) = (memo.unknown(i), memo.unknown(j)) {
                entries.push((r, c, a * x * b));
            }
        });
        let matrix: Matrix = match problem.M {
            Matrix::Dense(_) => {
                let mut m = Dense::zeros(memo.rows, memo.rows);
                entries.iter().for_each(|&(i, j, x)| m[(i, j)] = x);
                m.into()
            }
            _ => Csc::from_triplets(memo.rows, memo.rows, entries.iter().copied())?.into(),
        };
        Ok((Mlcp::new(matrix, q, free)?, memo))
    }

    fn lift_certificate(&self, certificate: Certificate, memo: &SplitMemo) -> Certificate {
        match certificate {
            Certificate::Row { row } if row < memo.rows => {
                let y: Vec<f64> = (0..memo.rows).map(|i| f64::from(u8::from(i == row))).collect();
                Certificate::Farkas { y: memo.rows_back(&y) }
            }
            Certificate::Farkas { y } if y.len() == memo.rows => {
                Certificate::Farkas { y: memo.rows_back(&y) }
            }
            Certificate::Ray { z, z0 } if z.len() == memo.rows => {
                Certificate::Ray { z: memo.rows_back(&z), z0 }
            }
            other => other,
        }
    }

    fn lower(&self, problem: &BoxLcp, point: &LcpPoint, memo: &SplitMemo, reduced: &mut LcpPoint) {
        let mut w = vec![0.0; problem.q.len()];
        problem.M.mul(&point.z, &mut w);
        reduced.z.clear();
        reduced.z.resize(memo.rows, 0.0);
        for (i, (place, &z)) in memo.places.iter().zip(&point.z).enumerate() {
            match *place {
                Place::Free(k) => reduced.z[k] = z,
                Place::Pair { at, sign, v, s } => {
                    reduced.z[v] = (sign * (z - at)).max(0.0);
                    if let Some(s) = s {
                        reduced.z[s] = (-w[i] - problem.q[i]).max(0.0);
                    }
                }
                Place::Fixed(_) => {}
            }
        }
    }

    fn lift(
        &self,
        problem: &BoxLcp,
        reduced: &LcpPoint,
        memo: &mut SplitMemo,
        point: &mut LcpPoint,
    ) {
        for (i, (place, z)) in memo.places.iter().zip(&mut point.z).enumerate() {
            *z = match *place {
                Place::Free(k) => reduced.z[k],
                Place::Pair { at, sign, v, .. } => {
                    let (l, u, v) = (problem.lower[i], problem.upper[i], reduced.z[v]);
                    if v >= u - l {
                        [l, u][usize::from(sign > 0.0)]
                    } else {
                        (at + sign * v).max(l).min(u)
                    }
                }
                Place::Fixed(at) => at,
            };
        }
    }
}

//! Friction through facets: the disk of friction becomes a polygon, and the contact problem a linear complementarity problem.
//!
//! | edge | polygon | problem | source |
//! | --- | --- | --- | --- |
//! | [`FacetInner`] | inscribed, by its vertices | LCP in `(r_N, β, λ)` | lecture (58)–(63); StewartTrinkle1996, AnitescuPotra1997 |
//! | [`FacetOuter`] | circumscribed, by its normals | MLCP in `(r_T; r_N, κ)` | lecture (52)–(57); Klarbring1986 |
//!
//! In the plane the disk is a segment, ω = 2, and both are Coulomb's law itself. In space they are another law, the nearer to Coulomb's the more facets:
//! `K_inner ⊂ K ⊂ K_outer` within `1 − cos(π/ω)`, but a sliding contact's impulse may be turned by up to π/ω. The judge of the friction problem says how much
//! that is; [`Reformulation::approximates`](crate::core::reformulation::Reformulation::approximates) is why nobody waits for it to become zero.
//!
//! Bilateral constraints are eliminated as everywhere else (`W − V R⁻¹ Vᵀ`). Frictionless contacts keep `r_N` alone. Multipliers that are velocities (λ, κ)
//! are stated in units of impulse, `λ = w_c λ'`, and their rows `σ ≥ 0` times w_c, so that all variables of the problem are impulses and all rows velocities;
//! scaling a row and its column alike keeps the matrix copositive.

mod inner;
mod outer;

pub use inner::{FacetInner, InnerMemo};
pub use outer::{FacetOuter, OuterMemo};

use nonsmooth_linalg::{Bsr, Csc, Matrix, small};
use nonsmooth_problem::check::{Certificate, Impulses};
use nonsmooth_problem::{FrictionLocal, LocalPoint};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::SolveError;
use crate::contact::form::{Access, Contacts, LocalState};
use crate::core::settings::Settings;

/// How the disk of friction is faceted.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Facets {
    /// The number ω of facets of each contact in space, at least 3; in the plane there are always 2, and the law is exact.
    pub facets: usize,
    /// The angle from the first tangent to the first vertex (inner) or the normal of the first facet (outer), rad.
    pub facet_angle: f64,
}

impl Default for Facets {
    fn default() -> Self {
        Self { facets: 8, facet_angle: 0.0 }
    }
}

impl Settings for Facets {
    fn validate(&self) -> Result<(), String> {
        if !(3..=MOST).contains(&self.facets) {
            let found = self.facets;
            return Err(format!("facets: expected a whole number from 3 to {MOST}, found {found}"));
        }
        if !self.facet_angle.is_finite() {
            return Err(format!(
                "facet_angle: expected a finite number, found {}",
                self.facet_angle
            ));
        }
        Ok(())
    }
}

/// More facets would change the law by less than 1e-7, and the matrix has ω² entries a block.
const MOST: usize = 4096;

/// How the keys of [`Facets`] begin.
const KEYS: &str = "facet";

/// The solvers that are listed behind the prefixes: those that work on matrices which are no more than copositive.
const LISTED: &[&str] = &["lemke"];

/// What is said where the faceted problem is solved and the friction problem is not.
const SAID: &str = "the faceted problem is solved; Coulomb's law holds only as nearly as so many facets can follow it";

impl Facets {
    /// The directions of the facets: unit vectors, one tangential component in the plane and two in space.
    fn directions<const D: usize>(&self) -> Vec<[f64; 2]> {
        if D == 2 {
            return vec![[1.0, 0.0], [-1.0, 0.0]];
        }
        let step = std::f64::consts::TAU / self.facets as f64;
        let at = |i: usize| (self.facet_angle + step * i as f64).sin_cos();
        (0..self.facets).map(|i| (at(i).1, at(i).0)).map(|(x, y)| [x, y]).collect()
    }
}

/// Whether the contacts of dimension D are approximated.
const fn approximates<const D: usize>() -> Option<&'static str> {
    if D > 2 { Some(SAID) } else { None }
}

/// The tangential part of a contact's vector, with a zero where the plane has no second component.
fn tangential<const D: usize>(x: &[f64; D]) -> [f64; 2] {
    [x[1], if D > 2 { x[2] } else { 0.0 }]
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// `x = Σ a_i d_i` with at most two of the `a_i` positive, those of the neighbours of x; calls `f(i, a_i)` for them.
fn decompose(directions: &[[f64; 2]], x: [f64; 2], mut f: impl FnMut(usize, f64)) {
    let count = directions.len();
    let (mut nearest, mut most) = (0, f64::NEG_INFINITY);
    for (i, d) in directions.iter().enumerate() {
        if dot(*d, x) > most {
            (nearest, most) = (i, dot(*d, x));
        }
    }
    if most <= 0.0 {
        return;
    }
    let d = directions[nearest];
    let across = d[0] * x[1] - d[1] * x[0];
    let other = if across >= 0.0 { (nearest + 1) % count } else { (nearest + count - 1) % count };
    let e = directions[other];
    let area = d[0] * e[1] - d[1] * e[0];
    if count > 2 && area != 0.0 {
        f(nearest, ((x[0] * e[1] - x[1] * e[0]) / area).max(0.0));
        f(other, (across / area).max(0.0));
    } else {
        f(nearest, most);
    }
}

/// The unit `w_c` of each contact, positive: the mean diagonal of its block, of all blocks where that is not positive.
fn units<const D: usize>(w: &Bsr<D>, out: &mut Vec<f64>) {
    out.clear();
    out.extend((0..w.nrows()).map(|c| small::mean_diagonal(&w.diagonal_block(c))));
    let (sum, count) =
        out.iter().filter(|w| **w > 0.0).fold((0.0, 0), |(sum, n), w| (sum + w, n + 1));
    let mean = if count > 0 { sum / f64::from(count) } else { 1.0 };
    out.iter_mut().filter(|w| w.is_nan() || **w <= 0.0).for_each(|w| *w = mean);
}

/// What both edges keep of the friction problem: its view without bilateral constraints, units, and where a contradiction was found.
struct Kept<const D: usize> {
    state: LocalState<D>,
    unit: Vec<f64>,
    directions: Vec<[f64; 2]>,
    contradiction: Option<Impulses>,
}

impl<const D: usize> Kept<D> {
    fn new(problem: &FrictionLocal<D>, facets: &Facets) -> Result<Self, SolveError> {
        facets.validate().map_err(|found| SolveError::needs("facets in their range", found))?;
        let directions = facets.directions::<D>();
        let state = problem.state(Access::Visits)?;
        let mut kept = Self { state, unit: vec![], directions, contradiction: None };
        kept.update(problem);
        Ok(kept)
    }

    fn refill(&mut self, problem: &FrictionLocal<D>) -> Result<(), SolveError> {
        problem.refill(&mut self.state)?;
        self.update(problem);
        Ok(())
    }

    fn update(&mut self, problem: &FrictionLocal<D>) {
        units(self.state.operator(problem).0, &mut self.unit);
        self.contradiction = problem.contradiction(&self.state).cloned();
    }
}

/// The velocity of contact c at a point as the caller states it, multipliers included.
fn velocity<const D: usize>(problem: &FrictionLocal<D>, point: &LocalPoint, c: usize) -> [f64; D] {
    let mut u = problem.W.row_product(c, &point.r);
    for (k, u) in u.iter_mut().enumerate() {
        *u += problem.q[D * c + k];
        if let Some(b) = &problem.rows {
            let each = point.lambda.iter().enumerate();
            *u += each.map(|(j, l)| b.V.get(D * c + k, j) * l).sum::<f64>();
        }
    }
    u
}

/// A certificate of the faceted problem, read as normal impulses that no motion feels: `row(c)` is the row of `u_N` of contact c. Tangential parts are
/// left out, because impulses with them refute nothing; the judge looks whether the normal ones do by themselves.
fn normal_impulses<const D: usize>(
    certificate: Certificate,
    memo: &Kept<D>,
    contacts: usize,
    row: impl Fn(usize) -> usize,
) -> Certificate {
    let mut r = vec![0.0; D * contacts];
    match &certificate {
        Certificate::Row { row: only } => {
            (0..contacts).filter(|&c| row(c) == *only).for_each(|c| r[D * c] = 1.0);
        }
        Certificate::Farkas { y } | Certificate::Ray { z: y, .. } => {
            (0..contacts).for_each(|c| r[D * c] = y.get(row(c)).map_or(0.0, |y| y.max(0.0)));
        }
        Certificate::Impulses(_) | Certificate::Cones { .. } | Certificate::Separating { .. } => {
            return certificate;
        }
    }
    let lambda = memo.state.multipliers(&r);
    Impulses { r, lambda }.into()
}

/// A sparse matrix that is stated entry by entry, always in the same order, so that other values find their places again.
#[derive(Default)]
struct Entries {
    stated: Vec<(usize, usize, f64)>,
    /// The place of each entry among the values.
    places: Vec<usize>,
}

impl Entries {
    /// The matrix with the entries of `state`.
    fn assemble(
        &mut self,
        n: usize,
        state: impl FnOnce(&mut dyn FnMut(usize, usize, f64)),
    ) -> Result<Csc, SolveError> {
        let Self { stated, places } = self;
        stated.clear();
        state(&mut |i, j, x| stated.push((i, j, x)));
        let matrix = Csc::from_triplets(n, n, stated.iter().copied())?;
        places.clear();
        places.extend(stated.iter().map(|&(i, j, _)| {
            let start = matrix.col_ptr()[j];
            start + matrix.column(j).0.binary_search(&i).unwrap_or_default()
        }));
        *stated = vec![];
        Ok(matrix)
    }

    /// Overwrites the values; false where the entries are not those of before.
    fn overwrite(
        &self,
        matrix: &mut Matrix,
        state: impl FnOnce(&mut dyn FnMut(usize, usize, f64)),
    ) -> bool {
        let Matrix::Sparse(matrix) = matrix else { return false };
        let (pointers, rows, values) = matrix.parts_mut();
        values.fill(0.0);
        let (mut next, mut same) = (self.places.iter(), true);
        state(&mut |i, j, x| match next.next() {
            Some(&k) if same && j + 1 < pointers.len() => {
                same = rows[k] == i && (pointers[j]..pointers[j + 1]).contains(&k);
                if same {
                    values[k] += x;
                }
            }
            _ => same = false,
        });
        same && next.next().is_none()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vector_is_the_sum_of_its_neighbours() {
        for count in [3, 4, 5, 16] {
            let directions = Facets { facets: count, facet_angle: 0.3 }.directions::<3>();
            for k in 0..50 {
                let x = [(0.7 * f64::from(k)).cos(), 1.3 * (1.9 * f64::from(k)).sin()];
                let mut sum = [0.0; 2];
                decompose(&directions, x, |i, a| {
                    assert!(a >= 0.0);
                    sum[0] += a * directions[i][0];
                    sum[1] += a * directions[i][1];
                });
                assert!((sum[0] - x[0]).abs() + (sum[1] - x[1]).abs() < 1e-14, "{count} {x:?}");
            }
        }
        let plane = Facets::default().directions::<2>();
        decompose(&plane, [-2.0, 0.0], |i, a| assert_eq!((i, a), (1, 2.0)));
    }
}

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

use nonsmooth_linalg::{Csc, Matrix, budget};
use nonsmooth_problem::FrictionLocal;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::kept::Kept;
use crate::SolveError;
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
    pub(super) fn directions<const D: usize>(&self) -> Vec<[f64; 2]> {
        if D == 2 {
            return vec![[1.0, 0.0], [-1.0, 0.0]];
        }
        let step = std::f64::consts::TAU / self.facets as f64;
        let at = |i: usize| (self.facet_angle + step * i as f64).sin_cos();
        (0..self.facets).map(|i| (at(i).1, at(i).0)).map(|(x, y)| [x, y]).collect()
    }

    /// What is kept of a problem.
    fn keep<const D: usize>(&self, problem: &FrictionLocal<D>) -> Result<Kept<D>, SolveError> {
        self.validate().map_err(|found| SolveError::needs("facets in their range", found))?;
        let directions = self.directions::<D>();
        let entries = problem.W.nblocks() * (1 + directions.len()).pow(2);
        budget::admit("the matrix with facets", AN_ENTRY * entries as f64)?;
        Kept::new(problem, directions)
    }
}

/// What an entry takes, in bytes, while the matrix is made of triplets.
const AN_ENTRY: f64 = 64.0;

/// Whether the contacts of dimension D are approximated.
const fn approximates<const D: usize>() -> Option<&'static str> {
    if D > 2 { Some(SAID) } else { None }
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
                // A problem drops entries that are zero.
                same = rows.get(k) == Some(&i) && (pointers[j]..pointers[j + 1]).contains(&k);
                if same {
                    values[k] += x;
                }
            }
            _ => same = false,
        });
        same && next.next().is_none()
    }
}

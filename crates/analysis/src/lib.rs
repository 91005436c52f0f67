//! What a problem is like before anybody solves it: [`Traits`] are cheap, a [`Spectrum`] is dense. And whether the impulses of a solution are the only ones: its
//! [`Indeterminacy`].

mod classes;
pub mod derivative;
mod indeterminacy;
mod jacobian;
mod monotone;
mod pattern;
mod regularity;
mod spectrum;

use std::cmp::Reverse;
use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

pub use classes::{Class, Classes, Effort, Finding, How, Why, Witness};
pub use derivative::Derivative;
pub use indeterminacy::Indeterminacy;
pub use jacobian::{Entry, JacobianCheck};
pub use monotone::{Apart, Sampled};
pub use pattern::Pattern;
pub use regularity::Regularity;
pub use spectrum::{Spectrum, SpectrumError, rank};

use nonsmooth_linalg::Groups;
use nonsmooth_problem::check::Law;
use nonsmooth_problem::{Friction, FrictionGlobal, FrictionLocal, Kind, Problem, RollingData};

/// Sizes, density, friction and structure of a problem. Cost: O(nnz), and for W of global problems the pairs of
/// contacts that share a body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[allow(non_snake_case)]
pub struct Traits {
    /// Which kind of problem.
    pub kind: Kind,
    /// The number of contacts, nc.
    pub contacts: usize,
    /// The number of scalar unknowns that a solver works on: v, r and the multipliers of a global problem, r and the
    /// multipliers of a local one.
    pub unknowns: usize,
    /// The degrees of freedom n of the system before condensation; `None`: nobody says.
    pub dofs: Option<usize>,
    /// The number of bilateral constraints, p.
    pub bilateral_rows: usize,
    /// The coefficients of friction.
    pub mu: MuRange,
    /// The coefficients of rolling friction, of problems that have any, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mu_r: Option<MuRange>,
    /// 0: symmetric. `‖W − Wᵀ‖_F / ‖W‖_F` of a local problem, `max |M_ij − M_ji| / max |M_ij|` of a global one.
    pub asymmetry: f64,
    /// The block structure of W: stored, or as it would be if condensed.
    pub W: Pattern,
    /// The matrices of a global problem.
    pub mass: Option<Mass>,
}

/// The coefficients of friction of all contacts.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MuRange {
    /// The least.
    pub min: f64,
    /// The largest.
    pub max: f64,
    /// The number of contacts without friction.
    pub frictionless: usize,
}

/// The matrices of a global problem.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[allow(non_snake_case)]
pub struct Mass {
    /// Stored entries.
    pub entries: Entries,
    /// The connected components of M by size, the most frequent first.
    pub components: Vec<Components>,
}

/// The numbers of stored entries of two matrices.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[allow(non_snake_case)]
pub struct Entries {
    /// Of the mass matrix.
    pub M: usize,
    /// Of the transposed contact Jacobian.
    pub H: usize,
}

/// Connected components of one size.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Components {
    /// The unknowns of each.
    pub size: usize,
    /// How many there are.
    pub count: usize,
}

impl Traits {
    /// The traits of a problem. `dofs` are the degrees of freedom that a local problem was condensed from, where they
    /// are known; a global problem has its own.
    pub fn of(problem: &Friction, dofs: Option<usize>) -> Self {
        match problem {
            Friction::Local2(p) => Self::of_local(p, dofs),
            Friction::Local3(p) => Self::of_local(p, dofs),
            Friction::RollingLocal(p) => Self::of_local(p, dofs),
            Friction::Global2(p) => Self::of_global(p),
            Friction::Global3(p) => Self::of_global(p),
            Friction::RollingGlobal(p) => Self::of_global(p),
        }
    }

    /// The traits of a local problem, condensed from `dofs` degrees of freedom.
    pub fn of_local<const D: usize, L: Law<D>>(
        p: &FrictionLocal<D, L>,
        dofs: Option<usize>,
    ) -> Self {
        Self {
            kind: p.kind(),
            contacts: p.contacts(),
            unknowns: p.unknowns(),
            dofs,
            bilateral_rows: p.multipliers(),
            mu: MuRange::of(&p.mu),
            mu_r: MuRange::of_rolling(p.mu_r.values()),
            asymmetry: p.W.asymmetry(),
            W: Pattern::of(&p.W),
            mass: None,
        }
    }

    /// The traits of a global problem.
    pub fn of_global<const D: usize, L: Law<D>>(p: &FrictionGlobal<D, L>) -> Self {
        let mut bodies = Groups::new(p.dofs());
        p.M.triplets().filter(|e| e.2 != 0.0).for_each(|(i, j, _)| bodies.join(i, j));
        let components = by_frequency(bodies.sizes());
        // Bilateral constraints couple what they touch, in W as well.
        if let Some(bilateral) = &p.rows {
            let columns = (0..bilateral.G.ncols()).map(|j| bilateral.G.column(j).0);
            columns.for_each(|touched| bodies.join_all(touched));
        }
        Self {
            kind: p.kind(),
            contacts: p.contacts(),
            unknowns: p.unknowns(),
            dofs: Some(p.dofs()),
            bilateral_rows: p.multipliers(),
            mu: MuRange::of(&p.mu),
            mu_r: MuRange::of_rolling(p.mu_r.values()),
            asymmetry: p.M.asymmetry(),
            W: Pattern::condensed::<D>(&p.H, &mut bodies),
            mass: Some(Mass { entries: Entries { M: p.M.nnz(), H: p.H.nnz() }, components }),
        }
    }

    /// The components of the contact impulses and the rows of W, m = D nc.
    pub fn impulses(&self) -> usize {
        self.kind.dimension() * self.contacts
    }

    /// The contact density c = D nc / n. Above 1 the problem is hyperstatic: impulses need not be unique, and iterative
    /// solvers slow down. `None` where n is not known or zero.
    ///
    /// Source: AcaryBremondHuber2018, where it characterises the families of problems.
    pub fn density(&self) -> Option<f64> {
        let dofs = self.dofs.filter(|&n| n > 0)?;
        Some(self.impulses() as f64 / dofs as f64)
    }
}

impl MuRange {
    fn of_rolling(mu_r: &[f64]) -> Option<Self> {
        (!mu_r.is_empty()).then(|| Self::of(mu_r))
    }

    fn of(mu: &[f64]) -> Self {
        Self {
            min: mu.iter().copied().reduce(f64::min).unwrap_or(0.0),
            max: mu.iter().copied().fold(0.0, f64::max),
            frictionless: mu.iter().filter(|&&m| m == 0.0).count(),
        }
    }
}

/// How often each size occurs, the most frequent first.
fn by_frequency(sizes: Vec<usize>) -> Vec<Components> {
    let mut times = BTreeMap::new();
    sizes.into_iter().for_each(|size| *times.entry(size).or_insert(0) += 1);
    let mut all: Vec<_> =
        times.into_iter().map(|(size, count)| Components { size, count }).collect();
    all.sort_by_key(|c| (Reverse(c.count), c.size));
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use nonsmooth_linalg::{Csc, Delassus, Inverse};
    use nonsmooth_problem::planted::Planted;

    #[test]
    fn sizes_are_counted_the_most_frequent_first() {
        let counted = by_frequency(vec![3, 1, 1, 2, 2]);
        let pairs: Vec<_> = counted.iter().map(|c| (c.size, c.count)).collect();
        assert_eq!(pairs, [(1, 2), (2, 2), (3, 1)]);
    }

    #[test]
    fn a_planted_problem_has_the_traits_it_was_planted_with() {
        let case =
            Planted { contacts: 15, dofs: 30, bilateral: 4, mu: (0.0, 0.0), ..Planted::default() };
        let (problem, _) = case.global::<3>();
        let traits = Traits::of(&Friction::Global3(problem.clone()), Some(1));
        assert_eq!((traits.contacts, traits.dofs, traits.bilateral_rows), (15, Some(30), 4));
        assert_eq!((traits.impulses(), traits.unknowns), (45, 30 + 45 + 4));
        assert_eq!(traits.density(), Some(1.5));
        assert_eq!(traits.mu, MuRange { min: 0.0, max: 0.0, frictionless: 15 });
        assert_eq!(traits.asymmetry, 0.0);
        let mass = traits.mass.unwrap();
        assert_eq!(mass.components, [Components { size: 6, count: 5 }]);
        assert_eq!(mass.entries, Entries { M: 5 * 36, H: problem.H.nnz() });
    }

    #[test]
    fn the_density_of_a_local_problem_needs_its_dofs() {
        let (problem, _) = Planted { contacts: 6, ..Planted::default() }.local::<2>();
        let density = |dofs| Traits::of(&Friction::Local2(problem.clone()), dofs).density();
        assert_eq!([density(None), density(Some(0)), density(Some(8))], [None, None, Some(1.5)]);
    }

    #[test]
    fn the_pattern_of_w_is_that_of_the_condensed_problem() {
        for (seed, dofs, bilateral) in [(1, 120, 0), (2, 600, 0), (3, 600, 40)] {
            let case = Planted { contacts: 60, dofs, bilateral, seed, ..Planted::default() };
            let (problem, _) = case.global::<3>();
            let inverse = match &problem.rows {
                None => Inverse::new(&problem.M, "M"),
                Some(b) => Inverse::saddle(&problem.M, &b.G),
            };
            let w = Delassus::<3>::condense(&problem.H, &inverse.unwrap());
            assert_eq!(Traits::of_global(&problem).W, Pattern::of(&w), "seed {seed}");
        }
    }

    #[test]
    fn asymmetry_is_that_of_the_stored_matrix() {
        let (mut problem, _) = Planted { contacts: 1, dofs: 2, ..Planted::default() }.global::<2>();
        let entries = [(0, 0, 2.0), (1, 1, 4.0), (0, 1, 1.0)];
        problem.M = Csc::from_triplets(2, 2, entries.into_iter()).unwrap();
        assert_eq!(Traits::of_global(&problem).asymmetry, 0.25);
    }

    #[test]
    fn traits_pass_through_json() {
        let (local, _) = Planted::default().local::<2>();
        let (global, _) = Planted::default().global::<3>();
        for problem in [Friction::Local2(local), Friction::Global3(global)] {
            let traits = Traits::of(&problem, None);
            let text = serde_json::to_string(&traits).unwrap();
            assert!(text.contains(&format!("\"kind\":\"{}\"", problem.kind().name())), "{text}");
            let back: Traits = serde_json::from_str(&text).unwrap();
            assert_eq!((back.W, &back.mass, back.kind), (traits.W, &traits.mass, traits.kind));
            assert!((back.mu.max - traits.mu.max).abs() <= f64::EPSILON);
        }
    }
}

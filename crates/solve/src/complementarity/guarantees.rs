//! Which solvers are guaranteed to work, by the class of M.
//!
//! *Guaranteed* means in exact arithmetic and without limits: the method converges to, or ends in, a solution of LCP(M, q) for every q (for every q of a feasible
//! problem where the reason says so). It does not say which method is fast, and what is not listed may well work.
//!
//! References, theorem by theorem, are in [`Guarantee::cites`]; most are in CottlePangStone2009, chapters 4 and 5.

use nonsmooth_analysis::{Class, Classes, Finding};
use serde::Serialize;

/// A solver that is guaranteed to work, and why.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Guarantee {
    /// The name in the registry.
    pub solver: &'static str,
    /// The class that M is in; `None` where it works for all.
    pub class: Option<Class>,
    /// What the guarantee is, in words.
    pub because: &'static str,
    /// Under which settings, if not all.
    pub when: Option<&'static str>,
    /// Works that prove it, as keys of the bibliography.
    pub cites: &'static [&'static str],
}

impl std::fmt::Display for Guarantee {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { solver, class, because, when, .. } = self;
        write!(f, "{solver}")?;
        if let Some(when) = when {
            write!(f, " ({when})")?;
        }
        match class {
            Some(class) => write!(f, ": M is {class}; {because}"),
            None => write!(f, ": {because}"),
        }
    }
}

/// `(solvers, all classes that M must be in, why, under which settings, who proved it)`, the first class gives the reason its name.
type Row = (
    &'static [&'static str],
    &'static [Class],
    &'static str,
    Option<&'static str>,
    &'static [&'static str],
);

use Class::*;

const LEXICOGRAPHIC: Option<&str> = Some("with lexicographic ties");

/// Stronger statements first: of a solver the first row that applies is given.
const TABLE: &[Row] = &[
    // Splitting.
    (
        &["psor"],
        &[PositiveDefinite, Symmetric],
        "each sweep decreases the energy, for every omega between 0 and 2",
        None,
        &["Cryer1971", "CottlePangStone2009"],
    ),
    (
        &["pgs"],
        &[PositiveDefinite, Symmetric],
        "each sweep decreases the energy",
        None,
        &["Cryer1971", "CottlePangStone2009"],
    ),
    (
        &["splitting_ls"],
        &[PositiveDefinite, Symmetric],
        "the line search makes every step decrease the energy",
        None,
        &["CottlePangStone2009"],
    ),
    (
        &["tnnmg"],
        &[PositiveDefinite, Symmetric],
        "its sweeps decrease the energy, and the correction of the face never raises it",
        None,
        &["GraserKornhuber2009"],
    ),
    (
        &["rpgs", "rpsor"],
        &[PositiveSemidefinite, Symmetric],
        "proximal steps converge to a solution if there is one; their problems are positive definite",
        None,
        &["Rockafellar1976", "CottlePangStone2009"],
    ),
    (
        &["projected_jacobi", "pgs", "psor"],
        &[HPlus],
        "the iteration is a contraction in a weighted maximum norm",
        Some("with omega at most 1"),
        &["CottlePangStone2009"],
    ),
    // Pivoting.
    (
        &["bard"],
        &[K],
        "what became positive stays so: at most n pivots from z = 0",
        None,
        &["CottlePangStone2009"],
    ),
    (
        &["murty"],
        &[P],
        "no basis is visited twice by the least index",
        None,
        &["CottlePangStone2009"],
    ),
    (
        &["block_pivoting"],
        &[P],
        "it falls back on the least index, which visits no basis twice",
        None,
        &["CottlePangStone2009"],
    ),
    (
        &["keller"],
        &[P],
        "each major cycle reduces the infeasibilities and raises none",
        None,
        &["CottlePangStone2009"],
    ),
    (
        &["keller"],
        &[PositiveSemidefinite],
        "it finds a solution, or that there is none",
        Some("with least-index ties"),
        &["CottlePangStone2009"],
    ),
    (
        &["criss_cross"],
        &[Sufficient],
        "the least-index rule is finite, and finds a solution or that there is none",
        None,
        &["CottlePangVenkateswaran1989", "CottlePangStone2009"],
    ),
    (&["lemke"], &[P], "the path cannot end in a ray", LEXICOGRAPHIC, &["CottlePangStone2009"]),
    (
        &["lemke"],
        &[StrictlyCopositive],
        "the path cannot end in a ray",
        LEXICOGRAPHIC,
        &["CottlePangStone2009"],
    ),
    (
        &["lemke"],
        &[CopositivePlus],
        "it ends in a solution, or in a ray that proves that there is none",
        LEXICOGRAPHIC,
        &["CottlePangStone2009"],
    ),
    (
        &["lemke"],
        &[Sufficient],
        "it ends in a solution, or in a ray that proves that there is none",
        LEXICOGRAPHIC,
        &["CottlePangStone2009"],
    ),
    // Interior point.
    (
        &["ip_mty", "ip_mehrotra"],
        &[PositiveSemidefinite],
        "the problem is monotone; with an interior point the steps are polynomial in number",
        Some("where z > 0, w > 0 is possible"),
        &["CottlePangStone2009"],
    ),
    (
        &["ip_mty", "ip_mehrotra"],
        &[Sufficient],
        "sufficient matrices are those of the classes P*(kappa); the steps grow with kappa",
        Some("where z > 0, w > 0 is possible"),
        &["Valiaho1996"],
    ),
    // Optimisation.
    (
        &["qp"],
        &[PositiveDefinite, Symmetric],
        "the problem is that of a strictly convex program",
        None,
        &["CottlePangStone2009"],
    ),
    (
        &["qp"],
        &[PositiveSemidefinite, Symmetric],
        "the problem is that of a convex program; if it has no solution, neither has the program",
        None,
        &["CottlePangStone2009"],
    ),
    // Newton.
    (
        &["newton_fb", "newton_pfb"],
        &[P],
        "the merit function has no other stationary points, and the steps converge quadratically",
        None,
        &["FacchineiPang2003"],
    ),
    (
        &["newton_min"],
        &[K],
        "the active sets are monotone, so there are finitely many",
        None,
        &["HintermullerItoKunisch2002"],
    ),
];

/// The order of the largest problem whose bases are all tried.
const ALL_BASES: usize = 15;

/// The solvers that are guaranteed to solve LCP(M, q) by what is proven of M; each once, with its strongest reason. Those without a guarantee are absent.
pub fn guaranteed(classes: &Classes) -> Vec<Guarantee> {
    by(classes, Finding::is_proven)
}

/// As [`guaranteed`], by what is true at least up to rounding.
pub fn likely(classes: &Classes) -> Vec<Guarantee> {
    by(classes, Finding::is_likely)
}

fn by(classes: &Classes, holds: impl Fn(&Finding) -> bool) -> Vec<Guarantee> {
    let mut out: Vec<Guarantee> = vec![];
    for &(solvers, all, because, when, cites) in TABLE {
        if !all.iter().all(|class| holds(classes.get(*class))) {
            continue;
        }
        for &solver in solvers {
            if out.iter().all(|g| g.solver != solver) {
                out.push(Guarantee { solver, class: Some(all[0]), because, when, cites });
            }
        }
    }
    if (1..=ALL_BASES).contains(&classes.order()) {
        out.push(Guarantee {
            solver: "enumeration",
            class: None,
            because: "all complementary bases are tried",
            when: None,
            cites: &["CottlePangStone2009"],
        });
    }
    out
}

//! Certificates that a problem has no solution.

use serde::{Deserialize, Serialize};

use super::Impulses;
use super::proof::ExactVector;

/// The claim that a problem has no solution, and why. What it is worth the problem's own judge says, from the data alone ([`crate::Problem::evidence`]).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "proof", rename_all = "snake_case")]
pub enum Certificate {
    /// Frictional contact: normal impulses that no motion feels.
    Impulses(Impulses),
    /// LCP: a row that no `z ≥ 0` makes nonnegative, `q_r < 0` and `M_rj ≤ 0` for all j (lecture (19)).
    Row {
        /// r.
        row: usize,
    },
    /// LCP: `y ≥ 0`, `Mᵀ y ≤ 0`, `qᵀ y < 0`. No `z ≥ 0` has `M z + q ≥ 0`, since `0 ≤ yᵀ(M z + q) = (Mᵀ y)ᵀ z + qᵀ y < 0`.
    ///
    /// MLCP: `y` of any sign on equalities, `(Mᵀ y)_j = 0` for free variables. hLCP: `Qᵀ y ≥ 0`, `Rᵀ y ≥ 0`, `qᵀ y < 0`. Box: the least upper bound
    /// of `yᵀ(M z + q)` over the box is negative, with `y_i = 0` where both bounds are finite.
    Farkas {
        /// y, one entry a row.
        y: Vec<f64>,
    },
    /// The secondary ray `(z̃, z̃₀)` on which Lemke's method ended. Where M is copositive-plus (on this ray at least), `z̃₀ = 0` and z̃ is a Farkas
    /// vector: a proof. Otherwise it proves nothing.
    Ray {
        /// z̃, one entry a variable.
        z: Vec<f64>,
        /// z̃₀, the part of the artificial variable.
        z0: f64,
    },
    /// Every one of the complementary cones is separated from q by one of these vectors: `yᵀ e_j ≥ 0` for the `w_j` and `−yᵀ M_j ≥ 0` for the `z_j`
    /// of the cone (`= 0` for free variables), `qᵀ y < 0`. Proves that a problem has no solution even where `M z + q ≥ 0, z ≥ 0` is possible.
    Cones {
        /// The vectors y.
        separating: Vec<Vec<f64>>,
    },
    /// The same in exact numbers, for any kind of problem: vectors over the rows of its [`ConeSystem`](super::ConeSystem).
    Separating {
        /// y, by rows of the problem's cone system.
        vectors: Vec<ExactVector>,
    },
}

impl From<Impulses> for Certificate {
    fn from(impulses: Impulses) -> Self {
        Self::Impulses(impulses)
    }
}

impl Certificate {
    /// The same with those of its vectors alone that stand at these places.
    pub(super) fn of(&self, places: &[usize]) -> Self {
        fn taken<T: Clone>(all: &[T], places: &[usize]) -> Vec<T> {
            places.iter().map(|&k| all[k].clone()).collect()
        }
        match self {
            Self::Cones { separating } => Self::Cones { separating: taken(separating, places) },
            Self::Separating { vectors } => Self::Separating { vectors: taken(vectors, places) },
            // There is one.
            other => other.clone(),
        }
    }

    /// The impulses, if that is what it is.
    pub fn impulses(&self) -> Option<&Impulses> {
        match self {
            Self::Impulses(impulses) => Some(impulses),
            _ => None,
        }
    }
}

impl std::fmt::Display for Certificate {
    /// A sentence for a user: what a verified certificate proves.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Impulses(_) => f.write_str("no admissible motion exists"),
            Self::Row { row } => {
                write!(
                    f,
                    "row {row} is negative for every z >= 0: its q is, and no entry of M there is positive"
                )
            }
            Self::Farkas { y } => {
                let rows = y.iter().filter(|y| **y != 0.0).count();
                write!(
                    f,
                    "a combination of {rows} rows is negative for every z >= 0 (Farkas vector)"
                )
            }
            Self::Ray { .. } => f.write_str(
                "Lemke's secondary ray is a combination of rows that is negative for every z >= 0",
            ),
            Self::Cones { separating } => no_cone(f, separating.len()),
            Self::Separating { vectors } => no_cone(f, vectors.len()),
        }
    }
}

fn no_cone(f: &mut std::fmt::Formatter<'_>, vectors: usize) -> std::fmt::Result {
    match vectors {
        1 => {
            f.write_str("a combination of rows contradicts every solution (one separating vector)")
        }
        n => write!(
            f,
            "every choice of zeros contradicts the equations, as {n} separating vectors show"
        ),
    }
}

//! The classes, and which of them contain which.

use serde::Serialize;

/// A class of square matrices.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Class {
    /// `M = Mᵀ`.
    Symmetric,
    /// No entry beside the diagonal is positive.
    Z,
    /// `M_ii > 0` for all i.
    PositiveDiagonal,
    /// `|M_ii| > Σ_{j≠i} |M_ij|` for all i.
    StrictlyDominant,
    /// Irreducible, `|M_ii| ≥ Σ_{j≠i} |M_ij|` for all i, and `>` for some i.
    IrreduciblyDominant,
    /// `xᵀ M x > 0` for all `x ≠ 0`; M need not be symmetric.
    PositiveDefinite,
    /// `xᵀ M x ≥ 0` for all x; M need not be symmetric.
    PositiveSemidefinite,
    /// All principal minors are positive: LCP(M, q) has one solution for each q.
    P,
    /// No principal minor is negative.
    P0,
    /// Z ∩ P: nonsingular M-matrices.
    K,
    /// The diagonal is positive, and the comparison matrix (moduli on the diagonal, minus moduli beside it) is in K.
    #[serde(rename = "h_plus")]
    HPlus,
    /// Some `z > 0` has `M z > 0`.
    S,
    /// `xᵀ M x > 0` for all `x ≥ 0`, `x ≠ 0`.
    StrictlyCopositive,
    /// Copositive, and `xᵀ M x = 0`, `x ≥ 0` only where `(M + Mᵀ) x = 0`.
    CopositivePlus,
    /// `xᵀ M x ≥ 0` for all `x ≥ 0`.
    Copositive,
    /// `x_i (M x)_i ≤ 0` for all i only where all are zero: the solutions of LCP(M, q) form a convex set for each q.
    ColumnSufficient,
    /// The transpose is column sufficient.
    RowSufficient,
    /// Both.
    Sufficient,
}

use Class::*;

impl Class {
    /// All classes, in the order of display.
    pub const ALL: [Self; 18] = [
        Symmetric,
        Z,
        PositiveDiagonal,
        StrictlyDominant,
        IrreduciblyDominant,
        PositiveDefinite,
        PositiveSemidefinite,
        P,
        P0,
        K,
        HPlus,
        S,
        StrictlyCopositive,
        CopositivePlus,
        Copositive,
        ColumnSufficient,
        RowSufficient,
        Sufficient,
    ];

    /// What a user reads.
    pub fn name(self) -> &'static str {
        match self {
            Symmetric => "symmetric",
            Z => "Z",
            PositiveDiagonal => "positive diagonal",
            StrictlyDominant => "strictly diagonally dominant",
            IrreduciblyDominant => "irreducibly diagonally dominant",
            PositiveDefinite => "positive definite",
            PositiveSemidefinite => "positive semidefinite",
            P => "P",
            P0 => "P0",
            K => "K (M-matrix)",
            HPlus => "H+",
            S => "S",
            StrictlyCopositive => "strictly copositive",
            CopositivePlus => "copositive-plus",
            Copositive => "copositive",
            ColumnSufficient => "column sufficient",
            RowSufficient => "row sufficient",
            Sufficient => "sufficient",
        }
    }
}

impl std::fmt::Display for Class {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

/// A matrix that is in all classes on the left is in the one on the right.
///
/// References: CottlePangStone2009, sections 3.1 to 3.13 (the figure of inclusions in 3.13); CottlePangVenkateswaran1989 (sufficient matrices). That a copositive
/// Z-matrix is semidefinite: `|x|ᵀ M |x| ≤ xᵀ M x`.
pub(super) const IMPLICATIONS: &[(&[Class], Class)] = &[
    (&[PositiveDefinite], PositiveSemidefinite),
    (&[PositiveDefinite], P),
    (&[PositiveDefinite], StrictlyCopositive),
    (&[PositiveSemidefinite], P0),
    (&[PositiveSemidefinite], CopositivePlus),
    (&[PositiveSemidefinite], ColumnSufficient),
    (&[PositiveSemidefinite], RowSufficient),
    (&[Symmetric, P], PositiveDefinite),
    (&[Symmetric, P0], PositiveSemidefinite),
    (&[P], P0),
    (&[P], PositiveDiagonal),
    (&[P], S),
    (&[P], ColumnSufficient),
    (&[P], RowSufficient),
    (&[K], Z),
    (&[K], HPlus),
    (&[Z, P], K),
    (&[Z, S], K),
    (&[Z, Copositive], PositiveSemidefinite),
    (&[Z, StrictlyCopositive], PositiveDefinite),
    (&[HPlus], P),
    (&[StrictlyDominant, PositiveDiagonal], HPlus),
    (&[IrreduciblyDominant, PositiveDiagonal], HPlus),
    (&[StrictlyCopositive], CopositivePlus),
    (&[StrictlyCopositive], PositiveDiagonal),
    (&[StrictlyCopositive], S),
    (&[CopositivePlus], Copositive),
    (&[ColumnSufficient], P0),
    (&[RowSufficient], P0),
    (&[ColumnSufficient, RowSufficient], Sufficient),
    (&[Sufficient], ColumnSufficient),
    (&[Sufficient], RowSufficient),
];

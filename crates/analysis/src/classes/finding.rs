//! What is known of a class: a proof, a witness against it, or why neither.

use std::cmp::Ordering;
use std::fmt;

use serde::Serialize;

use super::Class;
use super::interval::Interval;
use super::tableau::{Tableau, determinant_sign};
use nonsmooth_linalg::Matrix;

/// What can be said of M and a class.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "verdict", rename_all = "snake_case")]
pub enum Finding {
    /// M is in the class.
    Proven {
        /// How it was proven.
        how: How,
    },
    /// M is not in the class.
    Refuted {
        /// What shows it, by M alone ([`Witness::refutes`]).
        witness: Witness,
        /// The class that the witness refutes, which contains the other, or contains it under what else is proven.
        of: Class,
    },
    /// Neither.
    Unknown {
        /// Why not.
        why: Why,
    },
}

/// A way of proof.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum How {
    /// By looking at all entries.
    Entries,
    /// The dominance of the diagonal of `M + Mᵀ`.
    Dominance,
    /// A Cholesky factorisation of the symmetric part, shifted by more than its rounding errors.
    Cholesky,
    /// Elimination of the symmetric part, with the rounding errors bounded.
    Elimination,
    /// All principal minors (of the irreducible diagonal blocks), with the rounding errors bounded.
    Minors,
    /// A vector `x > 0` that the comparison matrix keeps positive.
    Comparison,
    /// All principal pivotal transforms have sufficient pairs (CottleGuu1992).
    Transforms,
    /// The principal submatrices, one by one (Hadeler1983).
    Submatrices,
    /// It is in other classes.
    Follows {
        /// Which.
        from: Vec<Class>,
    },
}

/// What shows that a matrix is not in a class.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Witness {
    /// An entry: unlike its mirror image (symmetric), positive beside the diagonal (Z), not positive on it (positive diagonal).
    Entry {
        /// i.
        row: usize,
        /// j.
        column: usize,
    },
    /// A row in which the diagonal does not dominate.
    Row {
        /// i.
        row: usize,
    },
    /// No row dominates strictly.
    NoStrictRow,
    /// A set α of rows without entries in other columns: M is reducible.
    Block {
        /// α.
        rows: Vec<usize>,
    },
    /// A principal minor `det M_αα` that is negative (P0), or not positive (P).
    Minor {
        /// α.
        rows: Vec<usize>,
    },
    /// A principal minor of `M + Mᵀ` that is negative (positive semidefinite), or not positive (positive definite).
    SymmetricMinor {
        /// α.
        rows: Vec<usize>,
    },
    /// A vector x with `xᵀ M x < 0`, or `≤ 0`; of copositive classes `x ≥ 0`, of copositive-plus also with `xᵀ M x = 0` and `(M + Mᵀ) x ≠ 0`.
    Direction {
        /// The entries of x that are not zero, by index.
        x: Vec<(usize, f64)>,
    },
    /// In the principal pivotal transform on α, the principal submatrix of these two rows is not (column, row) sufficient.
    Transform {
        /// α.
        pivots: Vec<usize>,
        /// The two rows.
        pair: [usize; 2],
    },
    /// A principal minor of the comparison matrix that is not positive.
    ComparisonMinor {
        /// Its rows.
        rows: Vec<usize>,
    },
    /// A vector `x ≥ 0`, not zero, whose product with the comparison matrix has no positive entry.
    Comparison {
        /// The entries of x that are not zero, by index.
        x: Vec<(usize, f64)>,
    },
    /// A vector `y ≥ 0`, not zero, with `Mᵀ y ≤ 0`: no z > 0 has `M z > 0`.
    Combination {
        /// The entries of y that are not zero, by index.
        y: Vec<(usize, f64)>,
    },
}

/// Why nothing is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Why {
    /// M is known by its products only.
    Operator,
    /// It holds for a matrix that differs from M by rounding.
    UpToRounding,
    /// Rounding hides the signs that decide.
    Rounding,
    /// The test takes more operations, or memory, than were allowed.
    Operations,
    /// The tests that apply did not decide.
    Undecided,
}

impl Finding {
    /// M is surely in the class.
    pub fn is_proven(&self) -> bool {
        matches!(self, Self::Proven { .. })
    }

    /// M is surely not in the class.
    pub fn is_refuted(&self) -> bool {
        matches!(self, Self::Refuted { .. })
    }

    /// Neither is known.
    pub fn is_unknown(&self) -> bool {
        matches!(self, Self::Unknown { .. })
    }

    /// M is in the class, or so near that rounding makes the difference: what a method may count on that checks its answer.
    pub fn is_likely(&self) -> bool {
        self.is_proven() || matches!(self, Self::Unknown { why: Why::UpToRounding })
    }

    /// What shows that M is not in the class.
    pub fn witness(&self) -> Option<&Witness> {
        match self {
            Self::Refuted { witness, .. } => Some(witness),
            _ => None,
        }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Proven { how } => write!(f, "proven ({how})"),
            Self::Refuted { witness, .. } => write!(f, "refuted by {witness}"),
            Self::Unknown { why } => write!(f, "unknown ({why})"),
        }
    }
}

impl fmt::Display for How {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Entries => "entries",
            Self::Dominance => "dominant diagonal of M + M^T",
            Self::Cholesky => "Cholesky factorisation of M + M^T",
            Self::Elimination => "elimination of M + M^T",
            Self::Minors => "principal minors",
            Self::Comparison => "comparison matrix",
            Self::Transforms => "principal pivotal transforms",
            Self::Submatrices => "principal submatrices",
            Self::Follows { from } => {
                let names: Vec<_> = from.iter().map(|c| c.name()).collect();
                return write!(f, "follows from {}", names.join(", "));
            }
        })
    }
}

impl fmt::Display for Why {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Operator => "M is known by its products only",
            Self::UpToRounding => "true up to rounding",
            Self::Rounding => "rounding decides",
            Self::Operations => "the test takes too many operations",
            Self::Undecided => "no test decides",
        })
    }
}

/// A few indices, or how many.
fn indices(rows: &[usize]) -> String {
    const SHOWN: usize = 8;
    if rows.len() > SHOWN {
        return format!("{} rows", rows.len());
    }
    let names: Vec<_> = rows.iter().map(usize::to_string).collect();
    format!("{{{}}}", names.join(", "))
}

/// A short vector, or how many entries it has.
fn vector(x: &[(usize, f64)]) -> String {
    const SHOWN: usize = 4;
    match x {
        &[(i, a)] if a > 0.0 => format!("e_{i}"),
        x if x.len() > SHOWN => format!("a vector of {} entries", x.len()),
        x => x.iter().map(|(i, a)| format!("{a:.3} e_{i}")).collect::<Vec<_>>().join(" + "),
    }
}

impl fmt::Display for Witness {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Entry { row, column } => write!(f, "M[{row}, {column}]"),
            Self::Row { row } => write!(f, "row {row}"),
            Self::NoStrictRow => f.write_str("its rows, none of which dominates strictly"),
            Self::Block { rows } => write!(f, "the block of rows {}", indices(rows)),
            Self::Minor { rows } => write!(f, "the principal minor of {}", indices(rows)),
            Self::SymmetricMinor { rows } => {
                write!(f, "the principal minor of {} of M + M^T", indices(rows))
            }
            Self::Direction { x } => write!(f, "x = {}", vector(x)),
            Self::Transform { pivots, pair: [i, j] } => {
                write!(f, "the pair {{{i}, {j}}} after pivots on {}", indices(pivots))
            }
            Self::ComparisonMinor { rows } => {
                write!(f, "the principal minor of {} of the comparison matrix", indices(rows))
            }
            Self::Comparison { x } => write!(f, "the comparison matrix and x = {}", vector(x)),
            Self::Combination { y } => write!(f, "y^T M <= 0 for y = {}", vector(y)),
        }
    }
}

/// Reads entries of a matrix that is not an operator.
pub(super) fn entry(m: &Matrix, i: usize, j: usize) -> f64 {
    match m {
        Matrix::Dense(a) => a[(i, j)],
        Matrix::Sparse(a) => a.get(i, j),
        Matrix::Operator(_) => f64::NAN,
    }
}

/// The entry of the comparison matrix.
pub(super) fn compared(m: &Matrix, i: usize, j: usize) -> Interval {
    let x = entry(m, i, j).abs();
    Interval::from(if i == j { x } else { -x })
}

/// `M_ij + M_ji`.
pub(super) fn doubled(m: &Matrix, i: usize, j: usize) -> Interval {
    Interval::from(entry(m, i, j)) + Interval::from(entry(m, j, i))
}

/// `M x`, or `Mᵀ x`, x by its entries that are not zero.
fn product(m: &Matrix, x: &[(usize, f64)], transposed: bool) -> Vec<Interval> {
    let mut dense = vec![0.0; m.nrows()];
    x.iter().for_each(|&(i, a)| dense[i] = a);
    let mut out = vec![Interval::ZERO; m.nrows()];
    m.for_each(|i, j, a| {
        let (to, from) = if transposed { (j, i) } else { (i, j) };
        if dense[from] != 0.0 {
            out[to] += Interval::from(a) * Interval::from(dense[from]);
        }
    });
    out
}

/// `xᵀ M x`.
pub(super) fn quadratic(m: &Matrix, x: &[(usize, f64)]) -> Interval {
    let mx = product(m, x, false);
    x.iter().fold(Interval::ZERO, |sum, &(i, a)| sum + Interval::from(a) * mx[i])
}

/// `|M_ii| − Σ_{j≠i} |M_ij|` of each row.
pub(super) fn slacks(m: &Matrix, transposed: bool) -> Vec<Interval> {
    let mut slack = vec![Interval::ZERO; m.nrows()];
    m.for_each(|i, j, x| {
        let size = Interval::from(x.abs());
        let row = if transposed { j } else { i };
        slack[row] = if i == j { slack[row] + size } else { slack[row] - size };
    });
    slack
}

/// The product of the comparison matrix with x.
pub(super) fn comparison(m: &Matrix, x: &[f64]) -> Vec<Interval> {
    let mut out = vec![Interval::ZERO; m.nrows()];
    m.for_each(|i, j, a| {
        let term = Interval::from(a.abs()) * Interval::from(x[j]);
        out[i] = if i == j { out[i] + term } else { out[i] - term };
    });
    out
}

/// Strictly increasing indices below n, at least one.
fn proper(rows: &[usize], n: usize) -> bool {
    !rows.is_empty() && rows.iter().all(|&i| i < n) && rows.windows(2).all(|w| w[0] < w[1])
}

/// Finite entries at strictly increasing indices below n, at least one that is not zero.
fn proper_vector(x: &[(usize, f64)], n: usize) -> bool {
    let rows: Vec<_> = x.iter().map(|e| e.0).collect();
    proper(&rows, n) && x.iter().all(|e| e.1.is_finite()) && x.iter().any(|e| e.1 != 0.0)
}

impl Witness {
    /// The vector e_i.
    pub(super) fn axis(i: usize) -> Self {
        Self::Direction { x: vec![(i, 1.0)] }
    }

    /// Whether this shows, from M alone and in spite of rounding, that M is not in the class.
    pub fn refutes(&self, m: &Matrix, class: Class) -> bool {
        let n = m.nrows();
        if n != m.ncols() || matches!(m, Matrix::Operator(_)) {
            return false;
        }
        let at = |i: usize, j: usize| Interval::from(entry(m, i, j));
        let twice = |i: usize, j: usize| doubled(m, i, j);
        let negative = |sign: Option<Ordering>, zero_too: bool| match sign {
            Some(Ordering::Less) => true,
            Some(Ordering::Equal) => zero_too,
            _ => false,
        };
        match (self, class) {
            (&Self::Entry { row: i, column: j }, _) if i >= n || j >= n => false,
            (&Self::Entry { row: i, column: j }, Class::Symmetric) => {
                entry(m, i, j) != entry(m, j, i)
            }
            (&Self::Entry { row: i, column: j }, Class::Z) => i != j && entry(m, i, j) > 0.0,
            (&Self::Entry { row: i, column: j }, Class::PositiveDiagonal) => {
                i == j && entry(m, i, j) <= 0.0
            }
            (&Self::Row { row }, Class::StrictlyDominant) => {
                slacks(m, false).get(row).is_some_and(|s| s.is_nonpositive())
            }
            (&Self::Row { row }, Class::IrreduciblyDominant) => {
                slacks(m, false).get(row).is_some_and(|s| s.is_negative())
            }
            (Self::NoStrictRow, Class::IrreduciblyDominant | Class::StrictlyDominant) => {
                slacks(m, false).iter().all(|s| s.is_nonpositive())
            }
            (Self::Block { rows }, Class::IrreduciblyDominant) => {
                let mut inside = vec![false; n];
                let valid = proper(rows, n) && rows.len() < n;
                let mut alone = valid;
                if valid {
                    rows.iter().for_each(|&i| inside[i] = true);
                    m.for_each(|i, j, x| alone &= x == 0.0 || !inside[i] || inside[j]);
                }
                alone
            }
            (Self::Minor { rows }, Class::P | Class::P0) if proper(rows, n) => negative(
                determinant_sign(rows.len(), |i, j| at(rows[i], rows[j])),
                class == Class::P,
            ),
            (
                Self::SymmetricMinor { rows },
                Class::PositiveDefinite | Class::PositiveSemidefinite,
            ) if proper(rows, n) => negative(
                determinant_sign(rows.len(), |i, j| twice(rows[i], rows[j])),
                class == Class::PositiveDefinite,
            ),
            (Self::Direction { x }, _) if proper_vector(x, n) => {
                let sign = quadratic(m, x);
                let nonnegative = x.iter().all(|e| e.1 >= 0.0);
                match class {
                    Class::PositiveDefinite => sign.is_nonpositive(),
                    Class::PositiveSemidefinite => sign.is_negative(),
                    Class::StrictlyCopositive => nonnegative && sign.is_nonpositive(),
                    Class::Copositive => nonnegative && sign.is_negative(),
                    Class::CopositivePlus => {
                        let moved = || {
                            let (a, b) = (product(m, x, false), product(m, x, true));
                            let sum = a.iter().zip(&b).map(|(a, b)| *a + *b);
                            sum.into_iter().any(|s| s.is_positive() || s.is_negative())
                        };
                        nonnegative && (sign.is_negative() || (sign.is_nonpositive() && moved()))
                    }
                    _ => false,
                }
            }
            (
                Self::Transform { pivots, pair: [i, j] },
                Class::ColumnSufficient | Class::RowSufficient,
            ) if i < j && *j < n && (pivots.is_empty() || proper(pivots, n)) => {
                // Only these rows and columns matter.
                let mut rows = [&pivots[..], &[*i, *j]].concat();
                rows.sort_unstable();
                rows.dedup();
                let place = |k: &usize| rows.binary_search(k).expect("it is there");
                let set: Vec<_> = pivots.iter().map(place).collect();
                let tableau = Tableau::new(rows.len(), |i, j| at(rows[i], rows[j]));
                let Some(t) = tableau.transformed(&set) else { return false };
                let [column, row] = insufficient(&t, place(i), place(j));
                if class == Class::ColumnSufficient { column } else { row }
            }
            (Self::ComparisonMinor { rows }, Class::HPlus) if proper(rows, n) => {
                negative(determinant_sign(rows.len(), |i, j| compared(m, rows[i], rows[j])), true)
            }
            (Self::Comparison { x }, Class::HPlus) if proper_vector(x, n) => {
                let mut dense = vec![0.0; n];
                x.iter().for_each(|&(i, a)| dense[i] = a);
                x.iter().all(|e| e.1 >= 0.0)
                    && comparison(m, &dense).iter().all(|s| s.is_nonpositive())
            }
            (Self::Combination { y }, Class::S) if proper_vector(y, n) => {
                y.iter().all(|e| e.1 >= 0.0)
                    && product(m, y, true).iter().all(|s| s.is_nonpositive())
            }
            _ => false,
        }
    }
}

/// Whether the pair of a tableau is surely not column sufficient, not row sufficient, by its zeros; minors are left to others.
pub(super) fn insufficient(t: &Tableau, i: usize, j: usize) -> [bool; 2] {
    let (a, b, c, d) = (t.at(i, i), t.at(i, j), t.at(j, i), t.at(j, j));
    let there = |x: Interval| x.is_positive() || x.is_negative();
    let lone = |zero: Interval, other: Interval, entry: Interval| {
        zero.is_zero() && other.is_zero() && there(entry)
    };
    [lone(a, b, c) || lone(d, c, b), lone(a, c, b) || lone(d, b, c)]
}

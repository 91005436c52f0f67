//! The mixed linear complementarity problem.

use super::judge::{Data, InZ};
use super::mixed;
use super::stated::{Part, Parts, Shape, Stated, plural};
use crate::check::ConeSystem;
use crate::check::proof::Exactly;
use crate::error::vector;
use crate::{LcpPoint, ProblemError};
use nonsmooth_linalg::{Csc, Dense, Matrix};

/// `A u + C v + a = 0`, `0 ≤ v ⟂ D u + B v + b ≥ 0`: MLCP, lecture (8).
///
/// Stored as one matrix, `M = [A C; D B]` and `q = (a, b)`: the first `equalities` rows are equalities, the first `free` columns belong to the free
/// variables u. The others are complementary pairs, so there are as many rows as columns of them; A may be singular or rectangular.
#[derive(Debug, Clone, PartialEq)]
#[allow(non_snake_case)]
pub struct Mlcp {
    /// `[A C; D B]`, (equalities + m) × (free + m).
    pub M: Matrix,
    /// `(a, b)`.
    pub q: Vec<f64>,
    /// The rows of A and C.
    pub equalities: usize,
    /// The columns of A and D: free variables.
    pub free: usize,
}

#[allow(non_snake_case)]
impl Mlcp {
    /// States a problem with as many equalities as free variables, validated.
    ///
    /// Errors: no rows, a wrong shape, a value that is not finite; each names its entry.
    pub fn new(M: impl Into<Matrix>, q: Vec<f64>, free: usize) -> Result<Self, ProblemError> {
        Self::rectangular(M, q, free, free)
    }

    /// States a problem whose A may be rectangular, validated.
    ///
    /// Errors: as [`new`](Self::new).
    pub fn rectangular(
        M: impl Into<Matrix>,
        q: Vec<f64>,
        equalities: usize,
        free: usize,
    ) -> Result<Self, ProblemError> {
        let problem = Self { M: M.into().without_zeros(), q, equalities, free };
        problem.validate()?;
        Ok(problem)
    }

    /// States a problem by its blocks: A p × n, B m × m, C p × m, D m × n.
    ///
    /// Errors: blocks that do not fit each other, by name; a value that is not finite.
    pub fn from_blocks(
        [A, B, C, D]: [&Csc; 4],
        a: &[f64],
        b: &[f64],
    ) -> Result<Self, ProblemError> {
        let (p, n, m) = (a.len(), A.ncols(), b.len());
        A.check_shape("A", p, n, "entries of a × free variables")?;
        B.check_shape("B", m, m, "entries of b")?;
        C.check_shape("C", p, m, "entries of a × entries of b")?;
        D.check_shape("D", m, n, "entries of b × free variables")?;
        let placed = |block: &Csc, i0: usize, j0: usize| {
            block.triplets().map(|(i, j, x)| (i0 + i, j0 + j, x)).collect::<Vec<_>>()
        };
        let entries = [placed(A, 0, 0), placed(B, p, n), placed(C, 0, n), placed(D, p, 0)].concat();
        let M = Csc::from_triplets(p + m, n + m, entries.into_iter())?;
        Self::rectangular(M, [a, b].concat(), p, n)
    }

    /// Checks shapes and values; the fields are public, so call it after changing them.
    pub fn validate(&self) -> Result<(), ProblemError> {
        let Self { M, q, equalities, free } = self;
        if M.nrows() == 0 {
            return Err(ProblemError::shape("M", "at least one row", "none"));
        }
        vector("q", q, M.nrows(), "rows of M")?;
        let most = |name: &str, what: &str, value: usize, most: usize| {
            let expected = || format!("at most {most}, the {what} of M");
            (value <= most)
                .then_some(())
                .ok_or_else(|| ProblemError::value(name, expected(), value))
        };
        // Where one number stands for both, of a square matrix, it is that of the free variables.
        most("free", "columns", *free, M.ncols())?;
        most("equalities", "rows", *equalities, M.nrows())?;
        let pairs = M.nrows() - equalities;
        if (M.nrows(), M.ncols()) != (equalities + pairs, free + pairs) {
            let meaning = format!("{equalities} equalities, {free} free variables, {pairs} pairs");
            M.check_shape("M", equalities + pairs, free + pairs, &meaning)?;
        }
        Ok(M.check_finite("M")?)
    }

    /// The number of complementary pairs m.
    pub fn pairs(&self) -> usize {
        self.q.len() - self.equalities
    }

    /// The block of M with these rows and columns, dense; `None` of an operator.
    pub fn block(
        &self,
        rows: std::ops::Range<usize>,
        columns: std::ops::Range<usize>,
    ) -> Option<Dense> {
        let mut out = Dense::zeros(rows.len(), columns.len());
        let known = self.M.for_each(|i, j, x| {
            if rows.contains(&i) && columns.contains(&j) {
                out[(i - rows.start, j - columns.start)] = x;
            }
        });
        known.then_some(out)
    }
}

problem_in_z!(Mlcp, problem => problem.M.ncols(), vec![0.0; problem.M.ncols()]);

/// The parts of the whole, and those of the blocks that may stand in their place.
const WHOLE: [&str; 4] = ["M", "q", "free", "equalities"];
const BLOCKS: [&str; 6] = ["A", "B", "C", "D", "a", "b"];

impl Mlcp {
    /// Of blocks; B, C and D are zero where they are not stated.
    fn from_stated_blocks(parts: &mut dyn Parts) -> Result<Self, ProblemError> {
        let (a, b) = (parts.vector("a")?, parts.vector("b")?);
        let a_matrix = parts.matrix("A")?;
        let (p, n, m) = (a.len(), a_matrix.ncols(), b.len());
        let mut sparse = matches!(a_matrix, Matrix::Sparse(_));
        let mut other = |name, rows, columns| match parts.has(name) {
            false => Ok(Csc::zeros(rows, columns)),
            true => {
                let block = parts.matrix(name)?;
                sparse |= matches!(block, Matrix::Sparse(_));
                Ok::<_, ProblemError>(block.to_csc().unwrap_or_else(|| Csc::zeros(rows, columns)))
            }
        };
        let b_matrix = other("B", m, m)?;
        let c_matrix = other("C", p, m)?;
        let d_matrix = other("D", m, n)?;
        let a_matrix = a_matrix.to_csc().unwrap_or_else(|| Csc::zeros(p, n));
        let made = Self::from_blocks([&a_matrix, &b_matrix, &c_matrix, &d_matrix], &a, &b)?;
        Ok(match made.M.to_dense() {
            // Rows make a dense matrix, entries a sparse one.
            Some(dense) if !sparse => Self { M: dense.into(), ..made },
            _ => made,
        })
    }
}

impl Stated for Mlcp {
    const STATEMENT: &'static str =
        "A u + C v + a = 0, 0 <= v, w = D u + B v + b >= 0, v'w = 0; M = [A C; D B], q = (a, b)";
    const PARTS: &'static [(&'static str, Shape)] = &[
        ("M", Shape::Matrix),
        ("q", Shape::Vector),
        ("free", Shape::Count),
        ("equalities", Shape::Count),
        ("A", Shape::Matrix),
        ("B", Shape::Matrix),
        ("C", Shape::Matrix),
        ("D", Shape::Matrix),
        ("a", Shape::Vector),
        ("b", Shape::Vector),
    ];
    const SOLUTION: &'static [&'static str] = &["u", "v", "w"];

    fn parts(&self) -> Vec<(&'static str, Part<'_>)> {
        let mut parts = vec![("free", Part::Count(self.free))];
        if self.equalities != self.free {
            parts.push(("equalities", Part::Count(self.equalities)));
        }
        parts.extend([("q", Part::Vector(&self.q)), ("M", Part::Matrix(&self.M))]);
        parts
    }

    fn from_parts(parts: &mut dyn Parts) -> Result<Self, ProblemError> {
        let first = |names: &[&'static str]| names.iter().copied().find(|name| parts.has(name));
        match (first(&BLOCKS), first(&WHOLE)) {
            (Some(block), Some(whole)) => {
                let expected = "either M, q and free, or A, B, C, D, a and b";
                Err(ProblemError::shape(block, expected, format!("both this and {whole}")))
            }
            (Some(_), None) => Self::from_stated_blocks(parts),
            (None, _) => {
                let free = parts.count("free")?;
                let (matrix, q) = (parts.matrix("M")?, parts.vector("q")?);
                let stated = parts.has("equalities");
                let equalities = if stated { parts.count("equalities")? } else { free };
                Self::rectangular(matrix, q, equalities, free)
            }
        }
    }

    fn point_parts<'a>(
        &self,
        point: &'a LcpPoint,
        w: Option<&'a [f64]>,
    ) -> Vec<(&'static str, &'a [f64])> {
        let (u, v) = point.z.split_at(self.free);
        [("u", u), ("v", v)].into_iter().chain(w.map(|w| ("w", w))).collect()
    }

    fn point_from_parts<E>(
        mut part: impl FnMut(&'static str) -> Result<Vec<f64>, E>,
    ) -> Result<LcpPoint, E> {
        Ok(LcpPoint { z: [part("u")?, part("v")?].concat() })
    }

    /// Equalities come first, and have no w.
    fn kept(&self, mut partner: Vec<f64>) -> Option<Vec<f64>> {
        partner.drain(..self.equalities.min(partner.len()));
        Some(partner)
    }

    fn pairs(&self) -> usize {
        self.pairs()
    }

    fn variables(&self) -> usize {
        self.free + self.pairs()
    }

    fn size(&self) -> String {
        let equalities = match self.equalities {
            1 => "1 equality".into(),
            n => format!("{n} equalities"),
        };
        let (free, pairs) = (plural(self.free, "free variable"), plural(self.pairs(), "pair"));
        format!("{equalities}, {free}, {pairs}")
    }

    fn sizes(&self) -> Vec<(&'static str, usize)> {
        vec![("equalities", self.equalities), ("free", self.free), ("pairs", self.pairs())]
    }

    fn blocks(&self) -> Vec<(&'static str, Dense)> {
        let (rows, columns) = (self.M.nrows(), self.M.ncols());
        let (r, c) = (self.equalities, self.free);
        let all = [
            ("A", 0..r, 0..c),
            ("B", r..rows, c..columns),
            ("C", 0..r, c..columns),
            ("D", r..rows, 0..c),
        ];
        let block = |(name, rows, columns)| Some((name, self.block(rows, columns)?));
        all.into_iter().filter_map(block).collect()
    }
}

impl InZ for Mlcp {
    fn data(&self) -> Data<'_> {
        let Self { M, q, equalities, free } = self;
        Data { matrix: M, q, equalities: *equalities, free: *free, bounds: None }
    }
}

impl Exactly for Mlcp {
    fn system(&self, wanted: Option<&[bool]>) -> Option<ConeSystem> {
        mixed(&self.M, &self.q, self.equalities, self.free, wanted)
    }

    fn rows(&self) -> usize {
        self.q.len()
    }
}

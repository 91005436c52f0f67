//! The mixed linear complementarity problem.

use super::judge::{Data, InZ};
use super::mixed;
use crate::ProblemError;
use crate::check::ConeSystem;
use crate::check::proof::Exactly;
use crate::error::vector;
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
        let problem = Self { M: M.into(), q, equalities, free };
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
        most("equalities", "rows", *equalities, M.nrows())?;
        most("free", "columns", *free, M.ncols())?;
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

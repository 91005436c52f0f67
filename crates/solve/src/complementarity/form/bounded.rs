//! Linear complementarity problems, seen by the methods that solve them.

use nonsmooth_linalg::{Matrix, norm_or_one};
use nonsmooth_problem::{BoxLcp, Lcp, LcpPoint, Mlcp, Problem};

use crate::SolveError;

/// A problem with a matrix of any shape, `w = M z + q`: each row is an equality `w_i = 0`, or belongs to one variable. Offered by [`Lcp`], [`Mlcp`]
/// and [`BoxLcp`].
pub trait Rowwise: Problem<Point = LcpPoint> {
    /// The problem's data.
    fn rowwise(&self) -> Rows<'_>;
}

/// The data of a [`Rowwise`] problem: the first `equalities` rows are equalities, row `equalities + k` belongs to variable `free + k`.
#[derive(Debug, Clone, Copy)]
pub struct Rows<'a> {
    /// M, rows × variables.
    pub matrix: &'a Matrix,
    /// q, one entry a row.
    pub q: &'a [f64],
    /// How many rows are equalities: the first ones, whose variables are free.
    pub equalities: usize,
    /// The number of variables that belong to no row; they come first, and are free.
    pub free: usize,
    /// The bounds of the variables.
    pub bounds: Bounds<'a>,
}

impl Rows<'_> {
    /// Refuses a matrix that is known by its products only.
    pub fn needs_entries(&self) -> Result<(), SolveError> {
        needs_entries(self.matrix)
    }
}

impl Rowwise for Lcp {
    fn rowwise(&self) -> Rows<'_> {
        let bounds = Bounds::Orthant { free: 0 };
        Rows { matrix: &self.M, q: &self.q, equalities: 0, free: 0, bounds }
    }
}

impl Rowwise for Mlcp {
    fn rowwise(&self) -> Rows<'_> {
        let Self { M, q, equalities, free } = self;
        let bounds = Bounds::Orthant { free: *free };
        Rows { matrix: M, q, equalities: *equalities, free: *free, bounds }
    }
}

impl Rowwise for BoxLcp {
    fn rowwise(&self) -> Rows<'_> {
        let bounds = Bounds::Box { lower: &self.lower, upper: &self.upper };
        Rows { matrix: &self.M, q: &self.q, equalities: 0, free: 0, bounds }
    }
}

fn needs_entries(matrix: &Matrix) -> Result<(), SolveError> {
    match matrix {
        Matrix::Operator(_) => {
            Err(SolveError::needs("the entries of M (dense or sparse)", "an operator"))
        }
        Matrix::Dense(_) | Matrix::Sparse(_) => Ok(()),
    }
}

/// A problem with one variable a row: `−w_i ∈ N_[l_i, u_i](z_i)`, `w = M z + q`. Offered by [`Lcp`], [`Mlcp`] (with as many equalities as
/// free variables) and [`BoxLcp`].
pub trait Bounded: Rowwise {
    /// The problem's data.
    ///
    /// Errors: a mixed problem whose equalities are not as many as its free variables.
    fn system(&self) -> Result<System<'_>, SolveError>;
}

/// A [`Bounded`] problem whose variables are free (the first ones, if any) or nonnegative. Offered by [`Lcp`] and [`Mlcp`].
pub trait Complementary: Bounded {}

impl Complementary for Lcp {}
impl Complementary for Mlcp {}

/// The data of a [`Bounded`] problem.
#[derive(Debug, Clone, Copy)]
pub struct System<'a> {
    /// M, n × n.
    pub matrix: &'a Matrix,
    /// q, n.
    pub q: &'a [f64],
    /// l and u.
    pub bounds: Bounds<'a>,
}

/// The bounds l and u.
#[derive(Debug, Clone, Copy)]
pub enum Bounds<'a> {
    /// The first `free` variables have none; the others are nonnegative.
    Orthant {
        /// The number of free variables.
        free: usize,
    },
    /// As the arrays say.
    Box {
        /// l; −∞ allowed.
        lower: &'a [f64],
        /// u; ∞ allowed.
        upper: &'a [f64],
    },
}

impl Bounds<'_> {
    /// l_i.
    #[inline]
    pub fn lower(&self, i: usize) -> f64 {
        match self {
            Self::Orthant { free } if i < *free => f64::NEG_INFINITY,
            Self::Orthant { .. } => 0.0,
            Self::Box { lower, .. } => lower[i],
        }
    }

    /// u_i.
    #[inline]
    pub fn upper(&self, i: usize) -> f64 {
        match self {
            Self::Orthant { .. } => f64::INFINITY,
            Self::Box { upper, .. } => upper[i],
        }
    }

    /// The point of `[l_i, u_i]` nearest to x.
    #[inline]
    pub fn project(&self, i: usize, x: f64) -> f64 {
        match self {
            Self::Orthant { free } if i < *free => x,
            Self::Orthant { .. } => x.max(0.0),
            Self::Box { lower, upper } => x.max(lower[i]).min(upper[i]),
        }
    }
}

impl<'a> System<'a> {
    /// The number of variables n.
    pub fn dim(&self) -> usize {
        self.q.len()
    }

    /// The number of free variables, which come first; zero for problems with a box.
    pub fn free(&self) -> usize {
        match self.bounds {
            Bounds::Orthant { free } => free,
            Bounds::Box { .. } => 0,
        }
    }

    /// `‖q‖`, or 1 where q = 0: what a solver's estimate is relative to.
    pub fn scale(&self) -> f64 {
        norm_or_one(self.q)
    }

    /// Refuses a matrix that is known by its products only.
    pub fn needs_entries(&self) -> Result<(), SolveError> {
        needs_entries(self.matrix)
    }
}

impl Bounded for Lcp {
    fn system(&self) -> Result<System<'_>, SolveError> {
        Ok(System { matrix: &self.M, q: &self.q, bounds: Bounds::Orthant { free: 0 } })
    }
}

impl Bounded for Mlcp {
    fn system(&self) -> Result<System<'_>, SolveError> {
        let Self { M, q, equalities, free } = self;
        if equalities != free {
            return Err(SolveError::needs(
                "as many equalities as free variables",
                format!("{equalities} equalities and {free} free variables"),
            ));
        }
        Ok(System { matrix: M, q, bounds: Bounds::Orthant { free: *free } })
    }
}

impl Bounded for BoxLcp {
    fn system(&self) -> Result<System<'_>, SolveError> {
        let bounds = Bounds::Box { lower: &self.lower, upper: &self.upper };
        Ok(System { matrix: &self.M, q: &self.q, bounds })
    }
}

/// The problem, once its data have been validated: for whoever calls [`Bounded::system`] again in a step.
///
/// # Panics
///
/// Where [`Bounded::system`] refuses: `work` has asked before.
pub fn system<P: Bounded>(problem: &P) -> System<'_> {
    problem.system().expect("the workspace was made for it")
}

//! A caller's mistake, as opposed to a numerical outcome (which is a [`Status`](crate::Status)).

use nonsmooth_linalg::MatrixError;
use nonsmooth_linalg::budget::TooLarge;
use nonsmooth_problem::{Problem, ProblemError};

/// Why a solve could not be started.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// The data of the problem or of the starting point is at fault.
    #[error(transparent)]
    Problem(#[from] ProblemError),
    /// No solver of that name exists for this kind of problem.
    #[error(
        "unknown solver `{name}` for this kind of problem{meant}; there are, and others behind the same prefixes: {known}"
    )]
    UnknownSolver {
        /// The name asked for.
        name: String,
        /// ` (did you mean …?)`, or nothing.
        meant: String,
        /// The names that exist.
        known: String,
    },
    /// A setting is unknown, of the wrong type or out of range.
    #[error("solver `{solver}`: {problem}")]
    Settings {
        /// The solver's name.
        solver: String,
        /// What is wrong, with the key, what is expected and what was found.
        problem: String,
    },
    /// The method does not apply: the problem lacks something that it needs.
    #[error("the solver needs {expected}, found {found}")]
    Needs {
        /// What the method needs.
        expected: &'static str,
        /// What the problem has.
        found: String,
    },
    /// The method does not apply: a factorisation that it begins with needs more memory than it may take.
    #[error("not enough memory: {0}")]
    TooLarge(#[from] TooLarge),
    /// A limit of the solve is impossible.
    #[error("{name}: expected {expected}, found {found}")]
    Limits {
        /// The limit's name.
        name: &'static str,
        /// What it may be.
        expected: &'static str,
        /// What it is.
        found: String,
    },
}

impl From<MatrixError> for SolveError {
    fn from(error: MatrixError) -> Self {
        Self::Problem(error.into())
    }
}

impl SolveError {
    /// The method needs something that the problem does not have.
    pub fn needs(expected: &'static str, found: impl Into<String>) -> Self {
        Self::Needs { expected, found: found.into() }
    }

    /// The error of a method that reformulates `problem`: where that is in order, what is at fault in the other problem is none of the caller's data.
    pub(crate) fn of_reformulated<P: Problem>(self, problem: &P) -> Self {
        if self.is_inapplicable() || problem.validate().is_err() {
            return self;
        }
        match self {
            Self::Problem(e) => {
                Self::needs("a reformulation within the range of doubles", e.to_string())
            }
            other => other,
        }
    }

    /// Whether it says that the method does not apply to the problem, as opposed to a mistake of the caller.
    pub fn is_inapplicable(&self) -> bool {
        matches!(
            self,
            Self::Needs { .. } | Self::TooLarge(_) | Self::Problem(ProblemError::Singular { .. })
        )
    }
}

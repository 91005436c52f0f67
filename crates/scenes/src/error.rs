//! A caller's mistake in a scene or its settings.

use nonsmooth_linalg::{MatrixError, budget};
use nonsmooth_problem::ProblemError;
use nonsmooth_solve::SolveError;

/// What is wrong with a scene; every message is a single line that names the place.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// No family of scenes has this name.
    #[error("unknown scene `{found}`; there are: {known}")]
    UnknownScene {
        /// The name asked for.
        found: String,
        /// The names that exist.
        known: String,
    },
    /// A value is of the wrong type or not allowed where it stands.
    #[error("{key}: expected {expected}, found {found}")]
    Value {
        /// The setting or field at fault, for example `mu` or `bodies[3].mass`.
        key: String,
        /// What may stand there.
        expected: String,
        /// What stands there.
        found: String,
    },
    /// A setting that the family does not have or that its type refuses; the text names it.
    #[error("{0}")]
    Setting(String),
    /// The assembled problem is not valid.
    #[error(transparent)]
    Problem(#[from] ProblemError),
    /// The problem cannot be reformulated.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// The limits of the computation ([`nonsmooth_linalg::budget`]) ended it.
    #[error("stopped before the scene was made")]
    Stopped,
}

impl SceneError {
    pub(crate) fn value(
        key: impl Into<String>,
        expected: impl Into<String>,
        found: impl ToString,
    ) -> Self {
        Self::Value { key: key.into(), expected: expected.into(), found: found.to_string() }
    }
}

/// Whether the limits in force let the making of a scene go on.
pub(crate) fn within_limits() -> Result<(), SceneError> {
    if budget::over() { Err(SceneError::Stopped) } else { Ok(()) }
}

/// `x` is finite and `ok`, or an error that says what was `expected` of `key`.
pub(crate) fn require(key: &str, x: f64, ok: bool, expected: &str) -> Result<(), SceneError> {
    if x.is_finite() && ok { Ok(()) } else { Err(SceneError::value(key, expected, x)) }
}

/// `x` is a positive number.
pub(crate) fn positive(key: &str, x: f64) -> Result<(), SceneError> {
    require(key, x, x > 0.0, "a positive number")
}

impl From<MatrixError> for SceneError {
    fn from(error: MatrixError) -> Self {
        Self::Problem(error.into())
    }
}

//! A caller's mistake in the data of a matrix.

/// What is wrong with a matrix: the place, what was expected there and what was found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MatrixError {
    /// It does not have the size that is asked for.
    #[error("{place}: expected {expected}, found {found}")]
    Shape {
        /// The matrix at fault.
        place: String,
        /// What its shape must be.
        expected: String,
        /// What its shape is.
        found: String,
    },
    /// A value is not allowed where it stands.
    #[error("{place}: expected {expected}, found {found}")]
    Value {
        /// The entry at fault, for example `W[4, 7]`.
        place: String,
        /// What may stand there.
        expected: String,
        /// What stands there.
        found: String,
    },
    /// It is singular and is to be inverted.
    #[error("{place}: expected an invertible matrix, found {found}")]
    Singular {
        /// The matrix at fault.
        place: String,
        /// How the singularity showed.
        found: String,
    },
}

impl MatrixError {
    pub(crate) fn shape(
        place: impl Into<String>,
        expected: impl Into<String>,
        found: impl Into<String>,
    ) -> Self {
        Self::Shape { place: place.into(), expected: expected.into(), found: found.into() }
    }

    pub(crate) fn value(
        place: impl Into<String>,
        expected: impl Into<String>,
        found: impl ToString,
    ) -> Self {
        Self::Value { place: place.into(), expected: expected.into(), found: found.to_string() }
    }
}

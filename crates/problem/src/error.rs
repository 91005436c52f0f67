//! A caller's mistake in the data of a problem.

use nonsmooth_linalg::MatrixError;

/// What is wrong with a problem's data: the place, what was expected there and what was found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ProblemError {
    /// A vector or matrix does not have the size that the rest of the problem asks for.
    #[error("{place}: expected {expected}, found {found}")]
    Shape {
        /// The dataset at fault, in FCLIB's letters.
        place: String,
        /// What its shape must be.
        expected: String,
        /// What its shape is.
        found: String,
    },
    /// A value is not allowed where it stands (NaN, infinite, negative coefficient of friction, ...).
    #[error("{place}: expected {expected}, found {found}")]
    Value {
        /// The entry at fault, for example `mu[3]` or `W[4, 7]`.
        place: String,
        /// What may stand there.
        expected: String,
        /// What stands there.
        found: String,
    },
    /// The problem has no contacts, so there is nothing to solve.
    #[error("{place}: expected at least one contact, found none")]
    Empty {
        /// The dataset at fault.
        place: String,
    },
    /// A matrix that the statement inverts (M, or M with the bilateral constraints) is singular.
    #[error("{place}: expected an invertible matrix, found {found}")]
    Singular {
        /// The matrix at fault.
        place: String,
        /// How the singularity showed.
        found: String,
    },
}

impl From<MatrixError> for ProblemError {
    fn from(error: MatrixError) -> Self {
        match error {
            MatrixError::Shape { place, expected, found } => Self::Shape { place, expected, found },
            MatrixError::Value { place, expected, found } => Self::Value { place, expected, found },
            MatrixError::Singular { place, found } => Self::Singular { place, found },
        }
    }
}

impl ProblemError {
    /// The same of a part that stands at `at` in something larger: the place becomes `at.place`.
    #[must_use]
    pub fn within(mut self, at: &str) -> Self {
        let (Self::Shape { place, .. }
        | Self::Value { place, .. }
        | Self::Empty { place }
        | Self::Singular { place, .. }) = &mut self;
        *place = if place.is_empty() { at.into() } else { format!("{at}.{place}") };
        self
    }

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

/// The first entry of `x` that is not finite, as an error that names it.
pub(crate) fn all_finite(name: &str, x: &[f64]) -> Result<(), ProblemError> {
    match x.iter().position(|v| !v.is_finite()) {
        Some(k) => Err(ProblemError::value(format!("{name}[{k}]"), "a finite number", x[k])),
        None => Ok(()),
    }
}

/// `x` has `len` entries, all finite.
pub(crate) fn vector(name: &str, x: &[f64], len: usize, meaning: &str) -> Result<(), ProblemError> {
    if x.len() != len {
        return Err(ProblemError::shape(
            name,
            format!("{len} entries ({meaning})"),
            format!("{} entries", x.len()),
        ));
    }
    all_finite(name, x)
}

/// Every coefficient of friction is finite and not negative; zero is allowed (a frictionless contact).
pub(crate) fn friction_coefficients(name: &str, mu: &[f64]) -> Result<(), ProblemError> {
    all_finite(name, mu)?;
    match mu.iter().position(|&m| m < 0.0) {
        Some(c) => Err(ProblemError::value(
            format!("{name}[{c}]"),
            "a coefficient of friction of at least 0",
            mu[c],
        )),
        None => Ok(()),
    }
}

/// Coefficients of rolling friction of each of the contacts, of a law with more disks than one.
pub(crate) fn rolling_coefficients(
    mu_r: &[f64],
    contacts: usize,
    disks: usize,
) -> Result<(), ProblemError> {
    vector("mu_r", mu_r, if disks > 1 { contacts } else { 0 }, "contacts")?;
    friction_coefficients("mu_r", mu_r)
}

/// Bounds `[l, u]`, each of so many entries, that are numbers and do not cross.
pub(crate) fn bounds(
    [lower, upper]: [&[f64]; 2],
    rows: usize,
    meaning: &str,
) -> Result<(), ProblemError> {
    for (name, bound) in [("l", lower), ("u", upper)] {
        if bound.len() != rows {
            let found = format!("{} entries", bound.len());
            return Err(ProblemError::shape(name, format!("{rows} entries ({meaning})"), found));
        }
    }
    let wrong = |(l, u): (&f64, &f64)| !(l <= u && *l < f64::INFINITY && *u > f64::NEG_INFINITY);
    match lower.iter().zip(upper).position(wrong) {
        Some(i) => Err(ProblemError::value(
            format!("[l, u][{i}]"),
            "l ≤ u, l < ∞, u > −∞",
            format!("[{}, {}]", lower[i], upper[i]),
        )),
        None => Ok(()),
    }
}

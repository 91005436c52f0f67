//! A caller's mistake in a world or in how it is to be stepped.

use nonsmooth_linalg::budget;
use nonsmooth_scenes::SceneError;
use nonsmooth_solve::SolveError;

/// What is wrong; every message is a single line that names the place. What numerics come to is a status, never an error.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SimulateError {
    /// A value that is not possible where it stands.
    #[error("{key}: expected {expected}, found {found}")]
    Value {
        /// The field at fault, for example `bodies[3].mass`.
        key: String,
        /// What may stand there.
        expected: String,
        /// What stands there.
        found: String,
    },
    /// What a file says in a place that cannot be read there.
    #[error("{path}: {problem}")]
    Schema {
        /// The path in the document, for example `bodies[3].shape`.
        path: String,
        /// What is wrong.
        problem: String,
    },
    /// Two materials that may meet, of whose contact nothing is said.
    #[error(
        "pairs: expected a law between the materials `{a}` and `{b}`, for {first} and {second} may meet, or [pairs_default], found none"
    )]
    Lawless {
        /// The first material.
        a: String,
        /// The second one, perhaps the same.
        b: String,
        /// A body of the first material, by its name or `bodies[k]`.
        first: String,
        /// A body of the second one.
        second: String,
    },
    /// Two shapes that may meet and whose contact is not implemented.
    #[error("{a} and {b}: contact between a {first} and a {second} is not supported")]
    Pair {
        /// The first shape, for example `bodies[0].shapes[1]`.
        a: String,
        /// The second shape.
        b: String,
        /// What the first one is.
        first: &'static str,
        /// What the second one is.
        second: &'static str,
    },
    /// Bodies overlap before the first step.
    #[error("bodies overlap at the start: {}", list(.0))]
    Overlap(Vec<Overlap>),
    /// A scene that cannot be set in motion, or a shape that is none.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// An unknown solver, a setting, limits at fault.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// Bytes that are no checkpoint of this world.
    #[error("checkpoint: expected one of a world of {bodies} bodies, found {found}")]
    Checkpoint {
        /// The number of bodies of the world.
        bodies: usize,
        /// What was found.
        found: String,
    },
}

/// Whether the limits in force let the making of a simulation go on.
pub(crate) fn within_limits() -> Result<(), SimulateError> {
    if budget::over() { Err(SceneError::Stopped.into()) } else { Ok(()) }
}

/// Two bodies that overlap.
#[derive(Debug, Clone, PartialEq)]
pub struct Overlap {
    /// The first body, by its name or `bodies[k]`.
    pub a: String,
    /// The second body.
    pub b: String,
    /// How deep, m.
    pub depth: f64,
}

/// The most pairs that a message names.
const NAMED: usize = 10;

fn list(pairs: &[Overlap]) -> String {
    let named = pairs.iter().take(NAMED);
    let mut out: Vec<_> =
        named.map(|o| format!("{} and {} by {:.3e} m", o.a, o.b, o.depth)).collect();
    if pairs.len() > NAMED {
        out.push(format!("{} more pairs", pairs.len() - NAMED));
    }
    out.join(", ")
}

impl SimulateError {
    pub(crate) fn value(
        key: impl Into<String>,
        expected: impl Into<String>,
        found: impl ToString,
    ) -> Self {
        Self::Value { key: key.into(), expected: expected.into(), found: found.to_string() }
    }
}

/// `x` is finite and `ok`, or an error that says what was `expected` of `key`.
pub(crate) fn require(
    key: impl Fn() -> String,
    x: f64,
    ok: bool,
    expected: &str,
) -> Result<(), SimulateError> {
    if x.is_finite() && ok { Ok(()) } else { Err(SimulateError::value(key(), expected, x)) }
}

/// All components are finite numbers.
pub(crate) fn finite(key: impl Fn() -> String, x: &[f64]) -> Result<(), SimulateError> {
    match x.iter().find(|x| !x.is_finite()) {
        None => Ok(()),
        Some(bad) => Err(SimulateError::value(key(), "finite components", bad)),
    }
}

//! What a method did, iteration by iteration, as data: the pivots of pivoting methods, the path of interior points.

use serde::{Serialize, Serializer};

/// The record of a solve; asked for with [`Limits::trace`](crate::Limits::trace).
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
#[serde(tag = "method", content = "rows", rename_all = "snake_case")]
pub enum Trace {
    /// The method keeps no record, or was not asked for one.
    #[default]
    None,
    /// Of a pivoting method.
    Pivots(Vec<Pivot>),
    /// Of an interior-point method.
    Path(Vec<PathPoint>),
}

/// A variable of a tableau. Written as `z3`, `w3` and `z0`: indices count from 1, as in the literature.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Variable {
    /// `z_i`, i from 0.
    Z(usize),
    /// `w_i`, i from 0.
    W(usize),
    /// Lemke's artificial variable `z_0`.
    Artificial,
}

impl std::fmt::Display for Variable {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Z(i) => write!(f, "z{}", i + 1),
            Self::W(i) => write!(f, "w{}", i + 1),
            Self::Artificial => f.write_str("z0"),
        }
    }
}

impl Serialize for Variable {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// One pivot: a variable enters the basis, another leaves it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Pivot {
    /// The number of the pivot, from 1.
    pub iteration: usize,
    /// The variable that becomes basic.
    pub entering: Variable,
    /// The variable that becomes nonbasic.
    pub leaving: Variable,
    /// The value that the entering variable takes: the least ratio, where there is a ratio test.
    pub ratio: f64,
    /// Lemke's `z_0` after the pivot.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub z0: Option<f64>,
}

/// One iterate of an interior-point method.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PathPoint {
    /// The number of the iteration, from 1.
    pub iteration: usize,
    /// The mean complementarity `μ = xᵀs / n`.
    pub mu: f64,
    /// The centrality `δ = ‖x∘s/μ − 1‖₂`.
    pub delta: f64,
    /// The least `x_i s_i / μ`: the neighbourhood N₋∞ asks for at least its ε.
    pub least: f64,
    /// The step that was taken, in (0, 1].
    pub step: f64,
    /// `‖Q x + R s − q‖` over `‖q‖`.
    pub residual: f64,
}

/// Keeps rows where they are wanted, and costs nothing where they are not.
#[derive(Debug, Clone)]
pub struct Recorder<T> {
    on: bool,
    rows: Vec<T>,
}

impl<T> Default for Recorder<T> {
    fn default() -> Self {
        Self { on: false, rows: vec![] }
    }
}

impl<T: Clone> Recorder<T> {
    /// Begins anew; keeps rows from now on, or not.
    pub fn begin(&mut self, on: bool) {
        self.on = on;
        self.rows.clear();
    }

    /// Keeps a row, if rows are wanted.
    pub fn push(&mut self, row: T) {
        if self.on {
            self.rows.push(row);
        }
    }

    /// The rows kept.
    pub fn rows(&self) -> Vec<T> {
        self.rows.clone()
    }
}

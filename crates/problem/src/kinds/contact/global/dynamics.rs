//! The factorised dynamics of a global problem.

use crate::check::{Impulses, Law};
use crate::kinds::contact::judge;
use crate::{FrictionGlobal, ProblemError, RowsGlobal};
use nonsmooth_linalg::{Compensated, Csc, Inverse, Refine};

/// The factorised dynamics of global problems that share M and G: r to `(v, lambda)`.
///
/// `[M, −G; Gᵀ, 0] (v, lambda) = (H r + f, −b)`, or `M v = H r + f` without bilateral constraints. Rows with bounds are no constraints: their impulses are
/// [held](Self::hold) at what they are given, and only the free rows border M.
#[derive(Debug, Clone)]
#[allow(non_snake_case)]
pub struct Dynamics {
    /// `M⁻¹`, or the inverse of the bordered matrix.
    pub inverse: Inverse,
    M: Csc,
    G: Option<Csc>,
    held: Option<Held>,
    state: Vec<f64>,
    scratch: Vec<f64>,
}

/// Rows with bounds among the others.
#[derive(Debug, Clone)]
struct Held {
    /// The rows that are free.
    free: Vec<usize>,
    /// The impulses of all rows: given where they have bounds, computed where they are free.
    lambda: Vec<f64>,
}

impl Held {
    fn new(rows: &RowsGlobal) -> Option<Self> {
        let free = rows.bounds.free(rows.b.len());
        let all = free.len() == rows.b.len();
        (!all).then(|| Self { free, lambda: vec![0.0; rows.b.len()] })
    }
}

impl Dynamics {
    /// Factorises. Errors: a singular M, by the component at fault.
    pub fn new<const D: usize, L: Law<D>>(
        problem: &FrictionGlobal<D, L>,
    ) -> Result<Self, ProblemError> {
        let held = problem.rows.as_ref().and_then(Held::new);
        let inverse = match (&problem.rows, &held) {
            (None, _) => Inverse::new(&problem.M, "M")?,
            (Some(b), None) => Inverse::saddle(&problem.M, &b.G)?,
            (Some(_), Some(held)) if held.free.is_empty() => Inverse::new(&problem.M, "M")?,
            (Some(b), Some(held)) => Inverse::saddle(&problem.M, &b.G.columns(&held.free))?,
        };
        Ok(Self {
            M: problem.M.clone(),
            G: problem.rows.as_ref().map(|b| b.G.clone()),
            held,
            state: vec![0.0; inverse.dim()],
            scratch: vec![0.0; inverse.scratch_len()],
            inverse,
        })
    }

    /// Whether `problem` has the matrices that were factorised. Cost: one comparison of M and G.
    pub fn serves<const D: usize, L: Law<D>>(&self, problem: &FrictionGlobal<D, L>) -> bool {
        let borders = |j: usize| match &self.held {
            None => true,
            Some(held) => held.free.binary_search(&j).is_ok(),
        };
        self.M == problem.M
            && self.G.as_ref() == problem.rows.as_ref().map(|b| &b.G)
            && problem
                .rows
                .iter()
                .all(|b| (0..b.b.len()).all(|j| b.bounds.is_free(j) == borders(j)))
    }

    /// From now on the rows with bounds have the impulses that they have in `lambda`, p; of the others nothing is taken.
    pub fn hold(&mut self, lambda: &[f64]) {
        if let Some(held) = &mut self.held {
            held.lambda.copy_from_slice(lambda);
        }
    }

    /// `(v, lambda)` for the impulses `r`, by one solve as refined as asked for; allocates nothing unless M has a component that is
    /// factorised sparsely.
    pub fn solve<const D: usize, L: Law<D>>(
        &mut self,
        problem: &FrictionGlobal<D, L>,
        r: &[f64],
        refine: Refine,
    ) -> (&[f64], &[f64]) {
        let v = &mut self.state[..problem.dofs()];
        v.copy_from_slice(&problem.f);
        problem.H.mul_add(1.0, r, v);
        self.solve_state(problem, refine)
    }

    /// [`solve`](Self::solve) for the impulses r of which `load = H r + f`.
    pub(super) fn solve_under<const D: usize, L: Law<D>>(
        &mut self,
        problem: &FrictionGlobal<D, L>,
        load: impl Iterator<Item = f64>,
        refine: Refine,
    ) -> (&[f64], &[f64]) {
        self.state[..problem.dofs()].iter_mut().zip(load).for_each(|(v, load)| *v = load);
        self.solve_state(problem, refine)
    }

    /// The same, where the state is `H r + f` already.
    fn solve_state<const D: usize, L: Law<D>>(
        &mut self,
        problem: &FrictionGlobal<D, L>,
        refine: Refine,
    ) -> (&[f64], &[f64]) {
        let n = problem.dofs();
        let (v, constraints) = self.state.split_at_mut(n);
        match (&problem.rows, &self.held) {
            (None, _) => {}
            (Some(b), None) => constraints.iter_mut().zip(&b.b).for_each(|(o, b)| *o = -b),
            (Some(b), Some(held)) => {
                for j in b.bounds.bounded() {
                    let (rows, values) = b.G.column(j);
                    rows.iter().zip(values).for_each(|(&i, g)| v[i] += g * held.lambda[j]);
                }
                constraints.iter_mut().zip(&held.free).for_each(|(o, &j)| *o = -b.b[j]);
            }
        }
        self.inverse.solve_with(&mut self.state, &mut self.scratch, refine);
        let (v, multipliers) = self.state.split_at(n);
        match &mut self.held {
            None => (v, multipliers),
            Some(Held { free, lambda }) => {
                free.iter().zip(multipliers).for_each(|(&j, x)| lambda[j] = *x);
                (v, lambda)
            }
        }
    }

    /// The velocities and multipliers for the impulses `r` in doubled precision: `high + low`, each n + p, and in `last` what is
    /// not known of them ([`Inverse::solve_doubled`]).
    pub fn solve_doubled<const D: usize, L: Law<D>>(
        &mut self,
        problem: &FrictionGlobal<D, L>,
        r: &[f64],
        [high, low, last]: [&mut [f64]; 3],
    ) {
        let n = problem.dofs();
        high[..n].copy_from_slice(&problem.f);
        low.fill(0.0);
        for (j, &rj) in r.iter().enumerate() {
            let (rows, values) = problem.H.column(j);
            rows.iter().zip(values).for_each(|(&i, &v)| add_product((high, low), i, v, rj));
        }
        self.solve_parts(problem, [high, low, last]);
    }

    /// [`solve_doubled`](Self::solve_doubled) for the impulses r of which `load = H r + f`, a sum and what it has lost.
    pub(super) fn solve_doubled_under<const D: usize, L: Law<D>>(
        &mut self,
        problem: &FrictionGlobal<D, L>,
        load: impl Iterator<Item = (f64, f64)>,
        [high, low, last]: [&mut [f64]; 3],
    ) {
        low.fill(0.0);
        for (i, load) in load.enumerate() {
            (high[i], low[i]) = load;
        }
        self.solve_parts(problem, [high, low, last]);
    }

    /// The same, where `high + low` are `H r + f` already.
    fn solve_parts<const D: usize, L: Law<D>>(
        &mut self,
        problem: &FrictionGlobal<D, L>,
        [high, low, last]: [&mut [f64]; 3],
    ) {
        let (n, dim) = (problem.dofs(), self.inverse.dim());
        let Some(held) = &self.held else {
            let b = problem.rows.iter().flat_map(|b| &b.b);
            high[n..].iter_mut().zip(b).for_each(|(high, b)| *high = -b);
            return self.inverse.solve_doubled(high, low, last, &mut self.scratch);
        };
        let rows = problem.rows.iter();
        for (b, j) in rows.clone().flat_map(|b| b.bounds.bounded().map(move |j| (b, j))) {
            let (rows, values) = b.G.column(j);
            rows.iter()
                .zip(values)
                .for_each(|(&i, &g)| add_product((high, low), i, g, held.lambda[j]));
        }
        for b in rows {
            high[n..dim].iter_mut().zip(&held.free).for_each(|(high, &j)| *high = -b.b[j]);
        }
        let parts = [&mut high[..dim], &mut low[..dim], &mut last[..dim]];
        let [h, l, e] = parts;
        self.inverse.solve_doubled(h, l, e, &mut self.scratch);
        // The multipliers to their rows, the last first: no row comes before its place among the free ones.
        for (k, &j) in held.free.iter().enumerate().rev() {
            for part in [&mut *high, &mut *low, &mut *last] {
                part[n + j] = part[n + k];
            }
        }
        for j in (0..held.lambda.len()).filter(|j| held.free.binary_search(j).is_err()) {
            (high[n + j], low[n + j], last[n + j]) = (held.lambda[j], 0.0, 0.0);
        }
    }

    /// The change of velocity `M⁻¹ H r` that the impulses alone bring about, the constraints kept.
    pub fn respond<const D: usize, L: Law<D>>(
        &mut self,
        problem: &FrictionGlobal<D, L>,
        r: &[f64],
        refine: Refine,
    ) -> &[f64] {
        let n = problem.dofs();
        self.state.fill(0.0);
        problem.H.mul_add(1.0, r, &mut self.state[..n]);
        self.inverse.solve_with(&mut self.state, &mut self.scratch, refine);
        &self.state[..n]
    }

    /// The change of velocity `M⁻¹ G_j` that a unit impulse of row j brings about, the constraints kept.
    pub fn respond_to_row<const D: usize, L: Law<D>>(
        &mut self,
        problem: &FrictionGlobal<D, L>,
        j: usize,
    ) -> &[f64] {
        self.state.fill(0.0);
        if let Some(b) = &problem.rows {
            let (rows, values) = b.G.column(j);
            rows.iter().zip(values).for_each(|(&i, g)| self.state[i] += g);
        }
        self.inverse.solve_with(&mut self.state, &mut self.scratch, Refine::Fully);
        &self.state[..problem.dofs()]
    }

    /// Completes `point` from its impulses.
    pub fn complete<const D: usize, L: Law<D>>(
        &mut self,
        problem: &FrictionGlobal<D, L>,
        point: &mut crate::GlobalPoint,
    ) {
        self.hold(&point.lambda);
        let (v, lambda) = self.solve(problem, &point.r, Refine::Fully);
        point.v.copy_from_slice(v);
        point.lambda.copy_from_slice(lambda);
    }

    /// The velocities v of the last solve.
    pub fn velocities<const D: usize, L: Law<D>>(&self, problem: &FrictionGlobal<D, L>) -> &[f64] {
        &self.state[..problem.dofs()]
    }

    /// `q = Hᵀ v_free + w`, the relative velocity without impulses (rows with bounds none either); and a certificate if the bilateral constraints
    /// contradict each other, so that no v satisfies `Gᵀ v + b = 0`.
    pub fn free_velocity<const D: usize, L: Law<D>>(
        &mut self,
        problem: &FrictionGlobal<D, L>,
        q: &mut [f64],
    ) -> Option<Impulses> {
        if let Some(held) = &mut self.held {
            held.lambda.fill(0.0);
        }
        q.fill(0.0);
        let (v, _) = self.solve(problem, q, Refine::Fully);
        problem.velocity_into(v, q);
        let b = problem.rows.as_ref()?;
        let left = |j: usize| b.b[j] + b.G.column_dot(j, v);
        let violated = |j: usize| left(j).abs() > 1e-10 * (b.b[j].abs() + (left(j) - b.b[j]).abs());
        let free = || (0..b.b.len()).filter(|&j| b.bounds.is_free(j));
        if !free().any(violated) {
            return None;
        }
        let mut residual = vec![0.0; v.len()];
        residual.extend(free().map(left));
        self.inverse.null_direction(&mut residual);
        let mut multipliers = vec![0.0; b.b.len()];
        free().zip(&residual[problem.dofs()..]).for_each(|(j, x)| multipliers[j] = *x);
        let r = vec![0.0; problem.w.len()];
        Impulses::toward(r, multipliers, &[], &b.b, |c| judge::holds(problem, c))
    }
}

/// Adds `a x` to entry i of `high + low`, its rounding error included.
fn add_product((high, low): (&mut [f64], &mut [f64]), i: usize, a: f64, x: f64) {
    let mut sum = Compensated::parts(high[i], low[i]);
    sum.add_product(a, x);
    (high[i], low[i]) = sum.into_parts();
}

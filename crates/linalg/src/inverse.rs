//! The inverse of M, or of M under bilateral constraints, behind one face.
//!
//! Each connected component of M's graph is factorised by its own size and kind: a division, a dense LU, sparse Cholesky where it is symmetric positive definite
//! and sparse LU where it is not (implicit gyroscopic terms). So block-diagonal M is found without being told, and `M⁻¹ H_c` stays sparse. A factorisation that
//! cannot reproduce a known solution to two digits, with residuals in doubled precision, is refused as singular, by the component at fault.
//!
//! Under redundant constraints `[M, −G; Gᵀ, 0]` is singular though the problem is sound: velocities are then exact, and the multipliers one of the possible sets.
//! Under contradicting ones refinement runs away along a null vector of G, which is the certificate that there is no solution.

use std::cell::Cell;

use faer::linalg::solvers::Solve;
use faer::sparse::{SparseColMat, Triplet};

use super::budget::Pace;
use super::{Compensated, Csc, Doubled, Groups, admit_sparse, norm};
use crate::MatrixError;

/// Components up to this size are factorised densely; rigid bodies have 1, 3 or 6.
const DENSE_LIMIT: usize = 48;
/// The relative size of the regularisation of bilateral rows; refinement removes its bias.
const BILATERAL_REGULARISATION: f64 = 1e-12;
/// Refinement converges in a few steps or not at all.
const MOST_REFINEMENTS: usize = 40;

/// `A⁻¹` for a square sparse A, by one LU factorisation per connected component of A's graph.
///
/// A mass matrix of rigid bodies falls into components of 1 to 6 unknowns, each a small dense LU; a finite
/// element body or a mechanism is one component with a sparse LU (faer). Solves are refined
/// against A itself, with residuals in doubled precision where it matters. With [`Inverse::saddle`] the matrix is `[M, −G; Gᵀ, 0]`, so bilateral
/// constraints, redundant ones included, are honoured by every product with the inverse.
#[derive(Debug, Clone)]
pub struct Inverse {
    matrix: Csc,
    components: Vec<Component>,
    /// For each unknown: its component and its place there.
    place: Vec<(u32, u32)>,
    /// The factor is that of A with a small diagonal added.
    regularised: bool,
}

thread_local! {
    static FACTORISATIONS: Cell<u64> = const { Cell::new(0) };
}

/// The matrices that this thread has factorised so far, each counted once however many components it has; the
/// difference of two readings is what happened between them.
pub fn factorisations() -> u64 {
    FACTORISATIONS.get()
}

/// Does work whose factorisations are nobody's: [`factorisations`] stays as it was.
pub fn uncounted<T>(work: impl FnOnce() -> T) -> T {
    let before = factorisations();
    let done = work();
    FACTORISATIONS.set(before);
    done
}

/// Matrices up to this order are factorised without a look at the clock.
pub(super) const QUICK: usize = 100;

/// Counts one factorisation of a matrix that grows with the problem.
pub(super) fn count_factorisation() {
    FACTORISATIONS.set(FACTORISATIONS.get() + 1);
}

/// How far a solve is refined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refine {
    /// One step, if the factor is that of A itself: backward stable.
    Once,
    /// Until the correction is rounding, with residuals in doubled precision: as accurate as A's data allow.
    Fully,
}

#[derive(Debug, Clone)]
struct Component {
    index: Vec<usize>,
    factor: Factor,
}

#[derive(Debug, Clone)]
enum Factor {
    /// The entry itself.
    Scalar(f64),
    Dense(DenseLu),
    Cholesky(Box<faer::sparse::linalg::solvers::Llt<usize, f64>>),
    Sparse(Box<faer::sparse::linalg::solvers::Lu<usize, f64>>),
}

impl Inverse {
    /// Factorises the square matrix `a`, called `name` in messages.
    ///
    /// Cost: O(Σ k³) over small components of size k, a sparse LU for each large one (Cholesky where
    /// it is symmetric positive definite).
    /// Errors: a singular matrix, by the first unknown of the component at fault.
    pub fn new(a: &Csc, name: &str) -> Result<Self, MatrixError> {
        Self::with_factor_of(a.clone(), a, name, false)
    }

    /// Factorises `[M, −G; Gᵀ, 0]`, the dynamics under the bilateral constraints `Gᵀ v + b = 0`.
    ///
    /// The factor is that of `[M, −G; Gᵀ, δD]` with `D = diag(Gᵀ M⁻¹ G)`, δ = 1e-12; each refinement step is one
    /// step of the proximal method of multipliers, which converges for redundant constraints as well.
    pub fn saddle(m: &Csc, g: &Csc) -> Result<Self, MatrixError> {
        let (n, p) = (m.nrows(), g.ncols());
        let m_inv = Self::new(m, "M")?;
        let mut d = vec![0.0; p];
        let mut x = vec![0.0; n];
        for j in 0..p {
            let (rows, values) = g.column(j);
            x.fill(0.0);
            rows.iter().zip(values).for_each(|(&i, &v)| x[i] = v);
            m_inv.solve(&mut x);
            d[j] = g.column_dot(j, &x);
            if d[j] <= 0.0 || !d[j].is_finite() {
                // An empty column constrains nothing: 0ᵀ v + b_j = 0.
                d[j] = 1.0;
            }
        }
        let coupling = g
            .triplets()
            .flat_map(|(i, j, x)| [(i, n + j, -x), (n + j, i, x)])
            .chain(m.triplets())
            .collect::<Vec<_>>();
        let delta = d.iter().enumerate().map(|(j, d)| (n + j, n + j, BILATERAL_REGULARISATION * d));
        let regular = coupling.iter().copied().chain(delta);
        let exact = coupling.iter().copied().chain((0..p).map(|j| (n + j, n + j, 0.0)));
        Self::with_factor_of(
            Csc::from_triplets(n + p, n + p, exact)?,
            &Csc::from_triplets(n + p, n + p, regular)?,
            "M with G",
            true,
        )
    }

    /// Factorises the matrix R of bilateral multipliers: as it is where it is invertible, else, as `R = Gᵀ M⁻¹ G` of
    /// redundant constraints, with a small diagonal added. `R⁻¹ b` is then a solution of the consistent system.
    pub fn of_multipliers(r: &Csc, name: &str) -> Result<Self, MatrixError> {
        if let Ok(inverse) = Self::new(r, name) {
            return Ok(inverse);
        }
        let p = r.nrows();
        let mean = (0..p).map(|i| r.get(i, i).abs()).sum::<f64>() / p.max(1) as f64;
        let delta = (0..p).map(|i| {
            let d = r.get(i, i).abs();
            // An empty row constrains nothing.
            let d = if d > 0.0 { d } else { mean };
            (i, i, if d > 0.0 { BILATERAL_REGULARISATION * d } else { 1.0 })
        });
        let regular = Csc::from_triplets(p, p, r.triplets().chain(delta))?;
        Self::with_factor_of(r.clone(), &regular, name, true)
    }

    fn with_factor_of(
        matrix: Csc,
        regular: &Csc,
        name: &str,
        regularised: bool,
    ) -> Result<Self, MatrixError> {
        count_factorisation();
        let matrix = without_zeros(matrix);
        let (index, place) = connected_components(&matrix);
        let mut pace = Pace::default();
        let components = index
            .into_iter()
            .map(|index| {
                // A lower bound of what a sparse factor costs, an upper one of what a dense one does.
                if pace.over((index.len() * index.len().min(DENSE_LIMIT).pow(2)) as f64) {
                    return Err(MatrixError::Singular {
                        place: name.into(),
                        found: "no time to factorise it".into(),
                    });
                }
                let factor =
                    factorise(regular, &index, &place).ok_or_else(|| MatrixError::Singular {
                        place: format!("{name} (component of row {})", index[0]),
                        found: "a vanishing pivot".into(),
                    })?;
                Ok(Component { index, factor })
            })
            .collect::<Result<Vec<_>, MatrixError>>()?;
        let out = Self { matrix, components, place, regularised };
        out.verify(name)?;
        Ok(out)
    }

    /// Solves for a known pseudo-random solution: a factorisation that does not find it is of a singular matrix.
    /// Of a regularised matrix, whose solutions are many, the residual is asked to vanish.
    fn verify(&self, name: &str) -> Result<(), MatrixError> {
        let n = self.dim();
        let known: Vec<f64> =
            (0..n).map(|i| 1.0 + (i as f64 * 0.618_033_988_749_895).fract()).collect();
        let mut b = vec![0.0; n];
        self.matrix.mul_add(1.0, &known, &mut b);
        let mut x = b.clone();
        self.solve(&mut x);
        let (error, size): (Vec<f64>, Vec<f64>) = if self.regularised {
            let mut residual = b.clone();
            self.matrix.mul_add(-1.0, &x, &mut residual);
            (residual, b)
        } else {
            (x.iter().zip(&known).map(|(x, y)| x - y).collect(), known)
        };
        let most = if self.regularised { 1e-8 } else { 1e-2 };
        for component in &self.components {
            let part = |v: &[f64]| norm(&component.index.iter().map(|&i| v[i]).collect::<Vec<_>>());
            let error = part(&error) / part(&size).max(f64::MIN_POSITIVE);
            if error.is_nan() || error > most {
                return Err(MatrixError::Singular {
                    place: format!("{name} (component of row {})", component.index[0]),
                    found: format!(
                        "one that does not reproduce a known solution ({error:.0e} off)"
                    ),
                });
            }
        }
        Ok(())
    }

    /// The number of unknowns.
    pub fn dim(&self) -> usize {
        self.place.len()
    }

    /// A as it was given.
    pub fn matrix(&self) -> &Csc {
        &self.matrix
    }

    /// Whether the factor is that of A with a small diagonal added.
    pub(crate) fn is_regularised(&self) -> bool {
        self.regularised
    }

    /// The sizes of the connected components, in the order of their first unknown.
    pub fn component_sizes(&self) -> impl ExactSizeIterator<Item = usize> + '_ {
        self.components.iter().map(|c| c.index.len())
    }

    /// Whether a component is too large for a dense factor.
    pub fn has_sparse_factor(&self) -> bool {
        let sparse = |c: &Component| matches!(c.factor, Factor::Cholesky(_) | Factor::Sparse(_));
        self.components.iter().any(sparse)
    }

    /// The component of unknown `i`.
    pub fn component_of(&self, i: usize) -> usize {
        self.place[i].0 as usize
    }

    /// The place of unknown `i` within its component.
    pub fn place_in_component(&self, i: usize) -> usize {
        self.place[i].1 as usize
    }

    /// The unknowns of component `k`.
    pub fn component(&self, k: usize) -> &[usize] {
        &self.components[k].index
    }

    /// `x ← A⁻¹ x`, fully refined.
    pub fn solve(&self, x: &mut [f64]) {
        self.solve_with(x, &mut vec![0.0; self.scratch_len()], Refine::Fully);
    }

    /// The length of the buffer that [`solve_with`](Inverse::solve_with) asks for.
    pub fn scratch_len(&self) -> usize {
        5 * self.component_sizes().max().unwrap_or(0)
    }

    /// `x ← A⁻¹ x` within a buffer of [`scratch_len`](Inverse::scratch_len) entries.
    ///
    /// Allocates nothing unless a component is factorised sparsely.
    pub fn solve_with(&self, x: &mut [f64], scratch: &mut [f64], refine: Refine) {
        for (k, component) in self.components.iter().enumerate() {
            let size = component.index.len();
            let (local, rest) = scratch.split_at_mut(size);
            for (l, &i) in local.iter_mut().zip(&component.index) {
                *l = x[i];
            }
            self.solve_component(k, local, rest, refine);
            for (l, &i) in local.iter().zip(&component.index) {
                x[i] = *l;
            }
        }
    }

    /// Where `residual` is what a regularised solve leaves of an inconsistent right-hand side: the direction in which its
    /// solution runs away, a null vector of A up to rounding. Overwrites `residual`.
    pub fn null_direction(&self, residual: &mut [f64]) {
        for component in &self.components {
            let mut local: Vec<f64> = component.index.iter().map(|&i| residual[i]).collect();
            component.factor.solve(&mut local, component.index.len());
            component.index.iter().zip(local).for_each(|(&i, x)| residual[i] = x);
        }
        let largest = residual.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        if largest > 0.0 {
            residual.iter_mut().for_each(|x| *x /= largest);
        }
    }

    /// Solves within component `k` for several right-hand sides, the columns of `x`, each as [`Refine::Once`] does.
    ///
    /// A large factor is read from memory once for all columns.
    pub fn solve_columns(&self, k: usize, x: &mut [f64], scratch: &mut Vec<f64>) {
        let Component { index, factor } = &self.components[k];
        let n = index.len();
        if self.regularised || !matches!(factor, Factor::Cholesky(_) | Factor::Sparse(_)) {
            scratch.resize(4 * n, 0.0);
            x.chunks_mut(n).for_each(|x| self.solve_component(k, x, scratch, Refine::Once));
            return;
        }
        scratch.clear();
        scratch.extend_from_slice(x);
        let step = scratch;
        factor.solve(x, n);
        for (step, x) in step.chunks_mut(n).zip(x.chunks(n)) {
            for (j, xj) in index.iter().zip(x) {
                let (rows, values) = self.matrix.column(*j);
                for (&i, v) in rows.iter().zip(values) {
                    step[self.place[i].1 as usize] -= v * xj;
                }
            }
        }
        factor.solve(step, n);
        // A correction that is not finite would spoil what there is, as in `solve_component`.
        if step.iter().all(|s| s.is_finite()) {
            x.iter_mut().zip(step.iter()).for_each(|(x, s)| *x += s);
        }
    }

    /// Solves within component `k`: `x` holds its right-hand side, then its solution.
    /// `scratch` has at least four times the component's size. A regularised factor is always refined fully.
    pub fn solve_component(&self, k: usize, x: &mut [f64], scratch: &mut [f64], refine: Refine) {
        let Component { index, factor } = &self.components[k];
        if let (Factor::Scalar(entry), false) = (factor, self.regularised) {
            x[0] /= entry;
            return;
        }
        let n = x.len();
        let (b, rest) = scratch.split_at_mut(n);
        let (step, rest) = rest.split_at_mut(n);
        let (sum, rest) = rest.split_at_mut(n);
        let error = &mut rest[..n];
        b.copy_from_slice(x);
        factor.solve(x, n);
        let most = match refine {
            Refine::Once if !self.regularised => 1,
            _ => MOST_REFINEMENTS,
        };
        let mut last = f64::INFINITY;
        for pass in 0..most {
            // step = b − A x, within the component, then A⁻¹ of it.
            sum.copy_from_slice(b);
            error.fill(0.0);
            for (j, &xj) in index.iter().zip(x.iter()) {
                let (rows, values) = self.matrix.column(*j);
                for (&i, &v) in rows.iter().zip(values) {
                    let i = self.place[i].1 as usize;
                    if most == 1 {
                        sum[i] -= v * xj;
                    } else {
                        let mut term = Compensated::parts(sum[i], error[i]);
                        term.add_product(-v, xj);
                        (sum[i], error[i]) = term.into_parts();
                    }
                }
            }
            for i in 0..n {
                step[i] = Compensated::parts(sum[i], error[i]).value();
            }
            factor.solve(step, n);
            let largest = |v: &[f64]| v.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let correction = largest(step);
            // Of an inconsistent system only the multipliers go on moving, at the same pace: stop.
            if !correction.is_finite() || (pass > 2 && correction > 0.9 * last) {
                break;
            }
            for (xi, si) in x.iter_mut().zip(step.iter()) {
                *xi += si;
            }
            if correction <= f64::EPSILON * largest(x) {
                break;
            }
            last = correction;
        }
    }
}

/// Corrections below this share of the solution end a solve in doubled precision.
const DOUBLED_ENOUGH: f64 = 0.25 * f64::EPSILON * f64::EPSILON;

impl Inverse {
    /// `x ← A⁻¹ x` in doubled precision: the right-hand side and the solution are `high + low`, corrections are added to both parts.
    /// `last` becomes the last correction of each unknown: what is not known of it. Of a well-conditioned A that is
    /// 1e-31 of the solution; with a condition of 1e12 some 1e-20 after a few more steps than a plain solve takes.
    pub fn solve_doubled(
        &self,
        high: &mut [f64],
        low: &mut [f64],
        last: &mut [f64],
        scratch: &mut [f64],
    ) {
        for component in &self.components {
            component.solve_doubled(self, [high, low, last], scratch);
        }
    }
}

impl Component {
    fn solve_doubled(
        &self,
        inverse: &Inverse,
        [high, low, last]: [&mut [f64]; 3],
        scratch: &mut [f64],
    ) {
        let Component { index, factor } = self;
        if let (Factor::Scalar(entry), false) = (factor, inverse.regularised) {
            let i = index[0];
            let quotient = Doubled::new(high[i], low[i]) / *entry;
            (high[i], low[i]) = quotient.parts();
            last[i] = 0.0;
            return;
        }
        let n = index.len();
        let (b_high, rest) = scratch.split_at_mut(n);
        let (b_low, rest) = rest.split_at_mut(n);
        let (error, rest) = rest.split_at_mut(n);
        let step = &mut rest[..n];
        for (l, &i) in index.iter().enumerate() {
            (b_high[l], b_low[l]) = (high[i], low[i]);
            (high[i], low[i]) = (0.0, 0.0);
        }
        let mut before = f64::INFINITY;
        for pass in 0..MOST_REFINEMENTS {
            // step = b − A x, then A⁻¹ of it.
            step.copy_from_slice(b_high);
            error.copy_from_slice(b_low);
            if pass > 0 {
                for &j in index {
                    let (rows, values) = inverse.matrix.column(j);
                    for (&i, &v) in rows.iter().zip(values) {
                        let i = inverse.place[i].1 as usize;
                        let mut term = Compensated::parts(step[i], error[i]);
                        term.add_product(-v, high[j]);
                        term.add_product(-v, low[j]);
                        (step[i], error[i]) = term.into_parts();
                    }
                }
            }
            step.iter_mut().zip(&*error).for_each(|(s, e)| *s = Compensated::parts(*s, *e).value());
            factor.solve(step, n);
            let correction = step.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            for (l, &i) in index.iter().enumerate() {
                last[i] = step[l];
            }
            // Of an inconsistent system only the multipliers go on moving, at the same pace: stop.
            if !step.iter().all(|s| s.is_finite()) || (pass > 4 && correction > 0.9 * before) {
                break;
            }
            let mut largest = 0.0_f64;
            for (l, &i) in index.iter().enumerate() {
                let x = Doubled::new(high[i], low[i]) + Doubled::from(step[l]);
                (high[i], low[i]) = x.parts();
                largest = largest.max(high[i].abs());
            }
            if correction <= DOUBLED_ENOUGH * largest {
                break;
            }
            before = correction;
        }
    }
}

impl Factor {
    /// Solves for each column of the n × k matrix `x`.
    fn solve(&self, x: &mut [f64], n: usize) {
        match self {
            Factor::Scalar(entry) => x.iter_mut().for_each(|x| *x /= entry),
            Factor::Dense(lu) => x.chunks_mut(n).for_each(|x| lu.solve(x)),
            Factor::Cholesky(llt) => llt.solve_in_place(columns(x, n)),
            Factor::Sparse(lu) => lu.solve_in_place(columns(x, n)),
        }
    }
}

/// Vectors of n entries as the matrix that faer solves in place.
fn columns(x: &mut [f64], n: usize) -> faer::MatMut<'_, f64> {
    let k = x.len() / n;
    faer::MatMut::from_column_major_slice_mut(x, n, k)
}

/// The factor of the principal submatrix of `a` on `index`, `None` where it is singular.
fn factorise(a: &Csc, index: &[usize], place: &[(u32, u32)]) -> Option<Factor> {
    let n = index.len();
    if n == 1 {
        let entry = a.get(index[0], index[0]);
        return (1.0 / entry).is_finite().then_some(Factor::Scalar(entry));
    }
    let entries = index.iter().enumerate().flat_map(|(j, &column)| {
        let (rows, values) = a.column(column);
        // A stored zero may belong to another component's row.
        let there = rows.iter().zip(values).filter(|(_, x)| **x != 0.0);
        there.map(move |(&i, &x)| (place[i].1 as usize, j, x))
    });
    if n <= DENSE_LIMIT {
        let mut dense = vec![0.0; n * n];
        entries.for_each(|(i, j, x)| dense[j * n + i] = x);
        return DenseLu::new(dense, n).map(Factor::Dense);
    }
    let triplets: Vec<_> = entries.map(|(i, j, x)| Triplet::new(i, j, x)).collect();
    let matrix = SparseColMat::<usize, f64>::try_new_from_triplets(n, n, &triplets).ok()?;
    let pattern = triplets.iter().map(|t| (t.row, t.col));
    admit_sparse("the factorisation of the dynamics", n, pattern, 1.0).ok()?;
    // A symmetric positive definite M, as finite elements give it, at half the price.
    let symmetric = triplets.iter().all(|t| a.get(index[t.col], index[t.row]) == t.val);
    if symmetric && let Ok(llt) = matrix.sp_cholesky(faer::Side::Lower) {
        return Some(Factor::Cholesky(Box::new(llt)));
    }
    matrix.sp_lu().ok().map(|lu| Factor::Sparse(Box::new(lu)))
}

/// Whether the symmetric part of `a`, with `shift` times its mean diagonal added to its diagonal, is positive definite.
///
/// Cost: one sparse Cholesky factorisation, not counted by [`factorisations`].
pub fn is_positive_definite(a: &Csc, shift: f64) -> bool {
    let n = a.nrows();
    let mean = (0..n).map(|i| a.get(i, i)).sum::<f64>() / n.max(1) as f64;
    let halves = a.triplets().flat_map(|(i, j, x)| [(i, j, 0.5 * x), (j, i, 0.5 * x)]);
    let shifts = (0..n).map(|i| (i, i, shift * mean));
    let Ok(symmetric) = Csc::from_triplets(n, n, halves.chain(shifts)) else {
        return false;
    };
    let lower = symmetric.triplets().filter(|(i, j, _)| i >= j);
    let lower: Vec<_> = lower.map(|(i, j, x)| Triplet::new(i, j, x)).collect();
    SparseColMat::<usize, f64>::try_new_from_triplets(n, n, &lower)
        .is_ok_and(|a| a.sp_cholesky(faer::Side::Lower).is_ok())
}

/// Without stored zeros, which would couple components that are none of each other's business.
fn without_zeros(a: Csc) -> Csc {
    if a.values().iter().all(|x| *x != 0.0) {
        return a;
    }
    let there = a.triplets().filter(|e| e.2 != 0.0);
    Csc::from_triplets(a.nrows(), a.ncols(), there).expect("in range")
}

/// Connected components of the graph of `a + aᵀ`: the unknowns of each, and each unknown's place.
fn connected_components(a: &Csc) -> (Vec<Vec<usize>>, Vec<(u32, u32)>) {
    let n = a.nrows();
    let mut groups = Groups::new(n);
    a.triplets().filter(|e| e.2 != 0.0).for_each(|(i, j, _)| groups.join(i, j));
    let components = groups.members();
    let mut place = vec![(0, 0); n];
    let narrow = |i: usize| u32::try_from(i).expect("fewer than 2³² unknowns");
    for (k, members) in components.iter().enumerate() {
        members.iter().enumerate().for_each(|(p, &i)| place[i] = (narrow(k), narrow(p)));
    }
    (components, place)
}

/// Dense LU with partial pivoting, by columns: no sum waits for its last term.
#[derive(Debug, Clone)]
struct DenseLu {
    n: usize,
    lu: Vec<f64>,
    swaps: Vec<u32>,
}

impl DenseLu {
    fn new(mut lu: Vec<f64>, n: usize) -> Option<Self> {
        let mut swaps = Vec::with_capacity(n);
        for k in 0..n {
            let (done, rest) = lu.split_at_mut((k + 1) * n);
            let pivots = &mut done[k * n..];
            let p = (k..n).max_by(|&i, &j| pivots[i].abs().total_cmp(&pivots[j].abs()))?;
            let pivot = pivots[p];
            if pivot == 0.0 || !pivot.is_finite() {
                return None;
            }
            swaps.push(p as u32);
            pivots.swap(k, p);
            pivots[k + 1..].iter_mut().for_each(|l| *l /= pivot);
            for column in rest.chunks_exact_mut(n) {
                column.swap(k, p);
                subtract(column[k], &pivots[k + 1..], &mut column[k + 1..]);
            }
            done[..k * n].chunks_exact_mut(n).for_each(|column| column.swap(k, p));
        }
        Some(Self { n, lu, swaps })
    }

    fn solve(&self, x: &mut [f64]) {
        let n = self.n;
        for (k, &p) in self.swaps.iter().enumerate() {
            x.swap(k, p as usize);
        }
        for (k, column) in self.lu.chunks_exact(n).enumerate() {
            subtract(x[k], &column[k + 1..], &mut x[k + 1..]);
        }
        for (k, column) in self.lu.chunks_exact(n).enumerate().rev() {
            x[k] /= column[k];
            subtract(x[k], &column[..k], &mut x[..k]);
        }
    }
}

/// `y ← y − a x`.
#[inline(always)]
fn subtract(a: f64, x: &[f64], y: &mut [f64]) {
    y.iter_mut().zip(x).for_each(|(y, x)| *y -= a * x);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A block-diagonal matrix: one scalar, one dense 2×2, one chain long enough for the sparse factor.
    fn example() -> Csc {
        let mut e = vec![(0, 0, 4.0), (1, 1, 2.0), (1, 2, -1.0), (2, 1, 0.5), (2, 2, 3.0)];
        for k in 3..80 {
            e.push((k, k, 2.5));
            if k > 3 {
                e.push((k, k - 1, -1.0));
                e.push((k - 1, k, -1.1));
            }
        }
        Csc::from_triplets(80, 80, e.iter().copied()).unwrap()
    }

    #[test]
    fn every_kind_of_component_is_inverted() {
        let a = example();
        let inverse = Inverse::new(&a, "A").unwrap();
        assert_eq!(inverse.component_sizes().collect::<Vec<_>>(), [1, 2, 77]);
        let x: Vec<f64> = (0..80).map(|i| (i as f64).sin()).collect();
        let mut b = vec![0.0; 80];
        a.mul_add(1.0, &x, &mut b);
        inverse.solve(&mut b);
        assert!(x.iter().zip(&b).all(|(x, y)| (x - y).abs() < 1e-13));
    }

    #[test]
    fn columns_are_solved_together_as_one_by_one() {
        let a = example();
        let symmetric = a.triplets().chain(a.transpose().triplets()).collect::<Vec<_>>();
        let symmetric = Csc::from_triplets(80, 80, symmetric.into_iter()).unwrap();
        for a in [a, symmetric] {
            let inverse = Inverse::new(&a, "A").unwrap();
            assert!(inverse.has_sparse_factor());
            for (k, n) in inverse.component_sizes().enumerate() {
                let b: Vec<f64> = (0..4 * n).map(|i| (i as f64).cos()).collect();
                let (mut together, mut scratch) = (b.clone(), vec![]);
                inverse.solve_columns(k, &mut together, &mut scratch);
                for (b, x) in b.chunks(n).zip(together.chunks(n)) {
                    let mut alone = b.to_vec();
                    inverse.solve_component(k, &mut alone, &mut vec![0.0; 4 * n], Refine::Once);
                    assert!(alone.iter().zip(x).all(|(a, x)| (a - x).abs() < 1e-14));
                }
            }
        }
    }

    #[test]
    fn stored_zeros_couple_nothing() {
        let entries =
            [(0, 0, 2.0), (1, 1, 4.0), (2, 1, 1.0), (2, 2, 5.0), (2, 0, 0.0), (0, 2, 0.0)];
        let inverse = Inverse::new(&Csc::from_triplets(3, 3, entries.into_iter()).unwrap(), "A");
        let inverse = inverse.unwrap();
        assert_eq!(inverse.component_sizes().collect::<Vec<_>>(), [1, 2]);
        let mut x = [2.0, 4.0, 6.0];
        inverse.solve(&mut x);
        assert_eq!(x, [1.0, 1.0, 1.0]);
    }

    #[test]
    fn a_singular_component_is_named() {
        let a = Csc::from_triplets(
            3,
            3,
            [(0, 0, 1.0), (1, 1, 1.0), (1, 2, 2.0), (2, 1, 2.0), (2, 2, 4.0)].into_iter(),
        );
        let e = Inverse::new(&a.unwrap(), "M").unwrap_err().to_string();
        assert!(e.starts_with("M (component of row 1)"), "{e}");
    }

    #[test]
    fn redundant_bilateral_constraints_are_honoured() {
        // v_0 + v_1 = 1 stated twice on M = I, f = (3, 0): v = (2, −1), the multipliers share the load.
        let m = Csc::diagonal(&[1.0, 1.0]);
        let g = Csc::from_triplets(
            2,
            2,
            [(0, 0, 1.0), (1, 0, 1.0), (0, 1, 1.0), (1, 1, 1.0)].into_iter(),
        );
        let inverse = Inverse::saddle(&m, &g.unwrap()).unwrap();
        let mut x = [3.0, 0.0, 1.0, 1.0];
        inverse.solve(&mut x);
        assert!((x[0] - 2.0).abs() < 1e-12 && (x[1] + 1.0).abs() < 1e-12, "{x:?}");
        assert!((x[2] + x[3] + 1.0).abs() < 1e-12, "{x:?}");
    }
}

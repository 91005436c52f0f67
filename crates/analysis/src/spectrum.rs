//! The singular values of W: rank, rank ratio and condition number.

use faer::{Mat, Side};
use serde::{Deserialize, Serialize};

use nonsmooth_linalg::budget::{self, TooLarge};
use nonsmooth_linalg::{Bsr, Csc, Delassus, Inverse, MatrixError, norm, norm_of};
use nonsmooth_problem::check::Law;
use nonsmooth_problem::{Friction, FrictionGlobal, FrictionLocal};

/// What the singular values `σ_1 ≥ … ≥ σ_m ≥ 0` of W say, bilateral constraints left aside (W is that of the free
/// dynamics, `Hᵀ M⁻¹ H`).
///
/// The rank counts the singular values above `m ε σ_1`, ε = 2⁻⁵²: what rounding leaves of a zero is below. Where
/// [`least`](Self::least) is close to the cut or [`dropped`](Self::dropped) close to `least`, the rank is a matter of
/// taste, and with it the condition number. Four of FCLIB's families met in Siconos' test data fall into the published ranges of both.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Spectrum {
    /// The rows of W, m = D nc.
    pub rows: usize,
    /// The rank of W.
    pub rank: usize,
    /// The largest singular value `σ_1`, 1/kg.
    pub largest: f64,
    /// The least singular value above the cut, 1/kg; zero if W is zero.
    pub least: f64,
    /// The largest singular value below the cut, 1/kg; zero if there is none.
    pub dropped: f64,
    /// `‖W − Wᵀ‖_F`, 1/kg.
    pub skew: f64,
}

/// Why there is no spectrum.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SpectrumError {
    /// The dense matrix would be too large.
    #[error("W: expected at most {limit} rows for a dense spectrum, found {rows}")]
    TooLarge {
        /// The order of the dense matrix.
        rows: usize,
        /// What the caller allows.
        limit: usize,
    },
    /// It would not fit in memory.
    #[error(transparent)]
    Memory(#[from] TooLarge),
    /// M is singular, so there is no W.
    #[error(transparent)]
    Singular(#[from] MatrixError),
    /// The iteration for the singular values did not converge, as where W holds entries that are not finite.
    #[error("W: expected singular values, found none: their iteration did not converge")]
    NotConverged,
}

impl Spectrum {
    /// The spectrum of a problem.
    ///
    /// Cost: `8/3 m³` operations and some `24 m²` bytes. A global problem with n < m and symmetric positive definite
    /// `M = L Lᵀ` has `W = Aᵀ A`, `A = L⁻¹ H`, and the squares of the singular values of A (n × m) are those of W that
    /// need not vanish: O(n² m).
    ///
    /// Errors: more than `limit` rows (of A where A serves, else of W), or of entries than the [`budget`] in force has memory for; a singular M; no convergence.
    pub fn of(problem: &Friction, limit: usize) -> Result<Self, SpectrumError> {
        match problem {
            Friction::Local2(p) => Self::of_local(p, limit),
            Friction::Local3(p) => Self::of_local(p, limit),
            Friction::RollingLocal(p) => Self::of_local(p, limit),
            Friction::Global2(p) => Self::of_global(p, limit),
            Friction::Global3(p) => Self::of_global(p, limit),
            Friction::RollingGlobal(p) => Self::of_global(p, limit),
        }
    }

    /// The spectrum of a local problem; see [`of`](Self::of).
    pub fn of_local<const D: usize, L: Law<D>>(
        p: &FrictionLocal<D, L>,
        limit: usize,
    ) -> Result<Self, SpectrumError> {
        within(D * p.contacts(), limit)?;
        Self::of_delassus(&p.W)
    }

    /// The spectrum of a global problem; see [`of`](Self::of).
    pub fn of_global<const D: usize, L: Law<D>>(
        p: &FrictionGlobal<D, L>,
        limit: usize,
    ) -> Result<Self, SpectrumError> {
        let (n, m) = (p.dofs(), D * p.contacts());
        if n < m && p.M.asymmetry() == 0.0 {
            within(n, limit)?;
            admit(n as f64 * (n as f64 + COPIES * m as f64))?;
            if let Ok(cholesky) = dense(&p.M).llt(Side::Lower) {
                let mut a = dense(&p.H);
                cholesky.L().solve_lower_triangular_in_place(&mut a);
                let mut values = singular_values(&a)?;
                values.iter_mut().for_each(|s| *s *= *s);
                return Ok(Self::cut(m, &values, 0.0));
            }
        }
        within(m, limit)?;
        Self::of_delassus(&Delassus::<D>::condense(&p.H, &Inverse::new(&p.M, "M")?))
    }

    fn of_delassus<const D: usize>(w: &Bsr<D>) -> Result<Self, SpectrumError> {
        admit(COPIES * ((D * w.nrows()) as f64).powi(2))?;
        let values = singular_values(&dense(&w.to_csc()))?;
        let norm = norm_of(w.blocks().iter().flatten().flatten().copied());
        Ok(Self::cut(D * w.nrows(), &values, w.asymmetry() * norm))
    }

    /// From singular values in falling order; those of the rest of the `rows` are zero.
    fn cut(rows: usize, values: &[f64], skew: f64) -> Self {
        let largest = values.first().copied().unwrap_or(0.0);
        let cut = rows as f64 * f64::EPSILON * largest;
        let rank = values.iter().take_while(|&&s| s > cut).count();
        let at = |k: usize| values.get(k).copied().unwrap_or(0.0);
        let least = if rank > 0 { at(rank - 1) } else { 0.0 };
        Self { rows, rank, largest, least, dropped: at(rank), skew }
    }

    /// The rank ratio `m / rank W`: how many rows say what one would. `None` if W is zero.
    pub fn rank_ratio(&self) -> Option<f64> {
        (self.rank > 0).then(|| self.rows as f64 / self.rank as f64)
    }

    /// The condition number `σ_1 / σ_rank` of W on its range. `None` if W is zero.
    pub fn condition(&self) -> Option<f64> {
        (self.rank > 0).then(|| self.largest / self.least)
    }
}

/// The largest dense matrix, in entries, of which a solution's rank is computed: some 50 ms.
pub(crate) const DENSE: usize = 100_000;

/// The rank of a sparse matrix whose columns count the same whatever their size: singular values above ε times the larger
/// dimension times the largest. `None` where the dense matrix would have more than `limit` entries, or an entry is not finite.
pub fn rank(a: &Csc, limit: usize) -> Option<usize> {
    rank_of_units(a, limit, 0.0)
}

/// The same with singular values above `relative` times the largest.
pub(crate) fn rank_of_units(a: &Csc, limit: usize, relative: f64) -> Option<usize> {
    if a.nrows().checked_mul(a.ncols())? > limit {
        return None;
    }
    let mut unit = dense(a);
    for j in 0..a.ncols() {
        let size = norm(a.column(j).1);
        if size > 0.0 {
            (0..a.nrows()).for_each(|i| unit[(i, j)] /= size);
        }
    }
    above(&unit, relative)
}

/// The number of singular values above `relative` times the largest, and above rounding. `None` where an entry is not finite.
pub(crate) fn rank_above(a: &Csc, relative: f64) -> Option<usize> {
    above(&dense(a), relative)
}

fn above(a: &Mat<f64>, relative: f64) -> Option<usize> {
    let values = singular_values(a).ok()?;
    let rounding = a.nrows().max(a.ncols()) as f64 * f64::EPSILON;
    let cut = relative.max(rounding) * values.first().copied().unwrap_or(0.0);
    Some(values.iter().filter(|&&s| s > cut).count())
}

/// A dense matrix of `rows` rows is small enough.
fn within(rows: usize, limit: usize) -> Result<(), SpectrumError> {
    if rows <= limit { Ok(()) } else { Err(SpectrumError::TooLarge { rows, limit }) }
}

/// A dense matrix, what the iteration reduces it to, and its reflections.
const COPIES: f64 = 3.0;

/// Memory for so many entries.
fn admit(entries: f64) -> Result<(), TooLarge> {
    budget::admit("the spectrum", 8.0 * entries)
}

fn dense(a: &Csc) -> Mat<f64> {
    let mut out = Mat::zeros(a.nrows(), a.ncols());
    a.triplets().for_each(|(i, j, x)| out[(i, j)] = x);
    out
}

/// In falling order.
fn singular_values(a: &Mat<f64>) -> Result<Vec<f64>, SpectrumError> {
    // The iteration is not asked about what is not finite.
    let finite = a.col_iter().all(|c| c.iter().all(|x| x.is_finite()));
    let values = finite.then(|| a.singular_values().ok()).flatten();
    values.ok_or(SpectrumError::NotConverged)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nonsmooth_problem::planted::Planted;

    fn local(entries: &[(usize, usize, f64)], nc: usize) -> FrictionLocal<3> {
        let w = Csc::from_triplets(3 * nc, 3 * nc, entries.iter().copied()).unwrap();
        FrictionLocal::new(Bsr::from_csc(&w), vec![0.0; 3 * nc], vec![0.5; nc]).unwrap()
    }

    /// `I − 2 x xᵀ / xᵀx`, by rows.
    fn reflection(n: usize, shift: f64) -> Vec<Vec<f64>> {
        let x: Vec<f64> = (0..n).map(|i| (1.3 * i as f64 + shift).sin()).collect();
        let square: f64 = x.iter().map(|x| x * x).sum();
        let entry = |i: usize, j: usize| f64::from(u8::from(i == j)) - 2.0 * x[i] * x[j] / square;
        (0..n).map(|i| (0..n).map(|j| entry(i, j)).collect()).collect()
    }

    #[test]
    fn planted_singular_values_are_found() {
        // W = P S Q with reflections P, Q: not symmetric, and its singular values are those of S.
        let planted = [8.0, 5.0, 2.0, 1e-3, 1e-7, 0.0, 0.0, 0.0, 0.0];
        let (p, q) = (reflection(9, 0.1), reflection(9, 0.7));
        let entry =
            |i: usize, j: usize| (0..9).map(|k| p[i][k] * planted[k] * q[k][j]).sum::<f64>();
        let entries: Vec<_> = (0..81).map(|k| (k / 9, k % 9, entry(k / 9, k % 9))).collect();
        let found = Spectrum::of_local(&local(&entries, 3), 9).unwrap();
        assert_eq!((found.rows, found.rank), (9, 5));
        assert_eq!(found.rank_ratio(), Some(9.0 / 5.0));
        assert!((found.largest - 8.0).abs() < 1e-14);
        assert!((found.condition().unwrap() / 8e7 - 1.0).abs() < 1e-7);
        assert!(found.dropped < 1e-14);
        let skew: f64 =
            (0..81).map(|k| entry(k / 9, k % 9) - entry(k % 9, k / 9)).map(|x| x * x).sum();
        assert!((found.skew - skew.sqrt()).abs() < 1e-13);
    }

    #[test]
    fn memory_is_asked_for_before_it_is_taken() {
        let (global, _) = Planted { contacts: 20, dofs: 30, ..Planted::default() }.global::<3>();
        let budget = |memory| budget::Budget { memory: Some(memory), ..Default::default() };
        let found = |memory| {
            let _scope = budget(memory).enter();
            [Spectrum::of_global(&global, 60), Spectrum::of_local(&local(&[], 20), 60)]
        };
        assert!(found(10_000).iter().all(|s| matches!(s, Err(SpectrumError::Memory(_)))));
        assert!(found(1 << 20).iter().all(Result::is_ok));
    }

    #[test]
    fn a_chain_of_springs_has_its_closed_form() {
        // tridiag(−1, 2, −1) of order n: eigenvalues 4 sin²(k π / (2 (n + 1))), k = 1, …, n.
        let n = 30;
        let neighbours = |i: usize| [(i, i + 1, -1.0), (i + 1, i, -1.0)];
        let entries: Vec<_> =
            (0..n).map(|i| (i, i, 2.0)).chain((0..n - 1).flat_map(neighbours)).collect();
        let found = Spectrum::of_local(&local(&entries, n / 3), n).unwrap();
        let closed = |k: usize| (k as f64 * std::f64::consts::PI / 62.0).sin().powi(2) * 4.0;
        assert_eq!((found.rank, found.dropped, found.skew), (n, 0.0, 0.0));
        assert!((found.largest - closed(n)).abs() < 1e-13);
        assert!((found.condition().unwrap() / (closed(n) / closed(1)) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn both_routes_of_a_global_problem_and_its_local_form_agree() {
        // n < m with symmetric M takes Cholesky's route; a skew part in M, or n ≥ m, condenses.
        for (contacts, dofs, skew) in [(20, 30, 0.0), (20, 30, 0.2), (5, 60, 0.0)] {
            let case = Planted { contacts, dofs, skew, ..Planted::default() };
            let found = Spectrum::of_global(&case.global::<3>().0, 60).unwrap();
            let other = Spectrum::of_local(&case.local::<3>().0, 60).unwrap();
            assert_eq!((found.rows, found.rank), (other.rows, other.rank));
            assert_eq!(found.rank, dofs.min(3 * contacts));
            let off = |f: fn(&Spectrum) -> f64| (f(&found) / f(&other) - 1.0).abs();
            assert!(off(|s| s.largest) < 1e-12 && off(|s| s.least) < 1e-9, "{found:?} {other:?}");
            assert!((found.skew - other.skew).abs() < 1e-12 * found.largest);
            assert_eq!(skew > 0.0, found.skew > 0.01);
        }
    }

    #[test]
    fn redundant_columns_do_not_count_however_large() {
        let entries = [(0, 0, 1.0), (1, 1, 1e-9), (0, 2, 2e9), (1, 2, 2e9), (0, 3, 3.0)];
        let a = Csc::from_triplets(3, 5, entries.into_iter()).unwrap();
        assert_eq!((rank(&a, 15), rank(&a, 14)), (Some(2), None));
        assert_eq!(rank(&Csc::zeros(2, 2), 4), Some(0));
    }

    #[test]
    fn without_a_w_or_with_one_of_zeros_there_is_no_condition() {
        let zero = Spectrum::of_local(&local(&[], 2), 6).unwrap();
        assert_eq!((zero.rank, zero.rank_ratio(), zero.condition()), (0, None, None));
        let (mut problem, _) = Planted { contacts: 3, dofs: 6, ..Planted::default() }.global::<3>();
        problem.M = Csc::zeros(6, 6);
        let error = Spectrum::of_global(&problem, 9).unwrap_err();
        assert!(matches!(error, SpectrumError::Singular(MatrixError::Singular { .. })), "{error}");
    }

    #[test]
    fn a_large_problem_is_refused_by_its_size() {
        let case = Planted { contacts: 20, dofs: 30, ..Planted::default() };
        let (problem, _) = case.local::<3>();
        let error = Spectrum::of_local(&problem, 59).unwrap_err();
        assert_eq!(error, SpectrumError::TooLarge { rows: 60, limit: 59 });
        // The global form has the smaller matrix.
        let (problem, _) = case.global::<3>();
        assert!(Spectrum::of_global(&problem, 30).is_ok());
        let error = Spectrum::of_global(&problem, 29).unwrap_err();
        assert_eq!(error, SpectrumError::TooLarge { rows: 30, limit: 29 });
    }

    #[test]
    fn entries_that_are_not_finite_are_an_error() {
        let mut problem = local(&[(0, 0, 1.0)], 1);
        problem.W = Bsr::from_rows(1, &[vec![(0, [[f64::NAN; 3]; 3])]]);
        assert_eq!(Spectrum::of_local(&problem, 3), Err(SpectrumError::NotConverged));
    }
}

//! MLCP → LCP: `M = B − D A⁻¹ C`, `q = b − D A⁻¹ a`, where A is square and invertible.
//!
//! The free variables are eliminated by the equalities: `u = −A⁻¹(C v + a)`, which is also the way back. A⁻¹ is never formed: A is factorised, and each column of C
//! is one solve, refined once.
//!
//! A certificate y of the LCP is one of the MLCP with `η = −A⁻ᵀ Dᵀ y` for the equalities: then `Aᵀη + Dᵀy = 0`, `Cᵀη + Bᵀy = Mᵀy`, `aᵀη + bᵀy = qᵀy`.
//!
//! Source: Acary, lecture (8) and the comment below it, with the reduced matrix corrected. Cost: one LU of A, one solve and one product with D a column of C. Storage: M, dense, and the
//! problem's matrix. Fails where A is singular, as it is in most circuits: those are to be solved as they are.

use nonsmooth_linalg::{Csc, Dense, Matrix, SquareLu};
use nonsmooth_problem::check::Certificate;
use nonsmooth_problem::{Lcp, LcpPoint, Mlcp, ProblemError};

use crate::SolveError;
use crate::core::reformulation::Reformulation;
use crate::core::register::Composed;
use crate::core::settings::NoSettings;
use crate::{Boxed, Via};
use nonsmooth_problem::Kind;

/// The elimination of the free variables.
#[derive(Debug, Clone, Copy, Default)]
pub struct Reduce;

impl Composed<Mlcp> for Reduce {
    type To = Lcp;
    type Settings = NoSettings;
    const NAME: &'static str = "reduce";
    const SUMMARY: &'static str =
        "MLCP to LCP: the free variables eliminated, M = B - D A^-1 C, where A is invertible";
    const FROM: &'static [Kind] = &[Kind::Mlcp];
    const CITES: &'static [&'static str] = &["Acary2018"];

    fn compose(_: NoSettings, solver: Boxed<Self::To>) -> Boxed<Mlcp> {
        Boxed::new(Via { reformulation: Reduce, solver })
    }
}

/// The factors of A and the blocks of the matrix.
pub struct ReduceMemo {
    matrix: Matrix,
    /// A and D.
    a: Matrix,
    d: Matrix,
    inverse: SquareLu,
    /// u, a right-hand side, and a residual.
    u: Vec<f64>,
    wanted: Vec<f64>,
    residual: Vec<f64>,
    /// A vector over all rows.
    w: Vec<f64>,
}

/// A is called singular where it does not give a known vector back to this relative accuracy.
const REPRODUCES: f64 = 1e-3;

/// The rows and columns of a matrix with entries, stored in the same way.
fn block(m: &Matrix, rows: std::ops::Range<usize>, columns: std::ops::Range<usize>) -> Matrix {
    let (height, width) = (rows.len(), columns.len());
    match m {
        Matrix::Dense(a) => {
            let entry = |i: usize, j: usize| a[(rows.start + i, columns.start + j)];
            Dense::from_fn(height, width, entry).into()
        }
        other => {
            let mut entries = vec![];
            other.for_each(|i, j, x| {
                if rows.contains(&i) && columns.contains(&j) {
                    entries.push((i - rows.start, j - columns.start, x));
                }
            });
            Csc::from_triplets(height, width, entries.into_iter()).expect("in range").into()
        }
    }
}

fn singular(found: &str) -> SolveError {
    ProblemError::Singular { place: "A".into(), found: found.into() }.into()
}

/// Factors of A; an error where it has no inverse, or none to working precision.
fn inverse(a: &Matrix) -> Result<SquareLu, SolveError> {
    let n = a.nrows();
    let mut lu = SquareLu::default();
    if n == 0 {
        return Ok(lu);
    }
    lu.factorise(a).map_err(|_| singular("a singular one"))?;
    // A known vector in the units of the columns: what comes back of it shows the condition, whatever the scale of rows and columns.
    let mut largest = vec![0.0_f64; n];
    a.for_each(|_, j, x| largest[j] = largest[j].max(x.abs()));
    let known: Vec<f64> = (0..n)
        .map(|j| (1.0 + (j as f64 * 0.618_034).fract()) / largest[j] * [1.0, -1.0][j % 2])
        .collect();
    let mut back = vec![0.0; n];
    a.mul(&known, &mut back);
    lu.solve(&mut back);
    let error = |(x, y): (&f64, &f64)| ((x - y) / y).abs();
    let good = back.iter().zip(&known).map(error).all(|e| e <= REPRODUCES);
    if good { Ok(lu) } else { Err(singular("one that is singular to working precision")) }
}

impl ReduceMemo {
    fn free(&self) -> usize {
        self.u.len()
    }

    /// `u ← A⁻¹ u`, refined once.
    fn solve(&mut self) {
        let Self { a, inverse, u, wanted, residual, .. } = self;
        if u.is_empty() {
            return;
        }
        wanted.copy_from_slice(u);
        inverse.solve(u);
        a.mul(u, residual);
        residual.iter_mut().zip(&*wanted).for_each(|(r, b)| *r = b - *r);
        inverse.solve(residual);
        u.iter_mut().zip(&*residual).for_each(|(u, r)| *u += r);
    }

    /// `q = b − D A⁻¹ a`.
    fn constants(&mut self, problem: &Mlcp, q: &mut [f64]) {
        let free = self.free();
        self.u.copy_from_slice(&problem.q[..free]);
        self.solve();
        self.d.mul(&self.u, q);
        q.iter_mut().zip(&problem.q[free..]).for_each(|(q, b)| *q = b - *q);
    }

    /// `(η, y)` of y.
    fn multipliers(&self, y: &[f64]) -> Vec<f64> {
        let free = self.free();
        let mut wanted = vec![0.0; free];
        self.d.mul_transpose(y, &mut wanted);
        let mut eta = vec![0.0; free];
        let mut residual = wanted.clone();
        for _ in 0..if free > 0 { 3 } else { 0 } {
            self.inverse.solve_transpose(&mut residual);
            eta.iter_mut().zip(&residual).for_each(|(e, r)| *e += r);
            self.a.mul_transpose(&eta, &mut residual);
            residual.iter_mut().zip(&wanted).for_each(|(r, w)| *r = w - *r);
        }
        eta.iter().map(|e| -e).chain(y.iter().copied()).collect()
    }
}

impl Reformulation<Mlcp> for Reduce {
    type To = Lcp;
    type Memo = ReduceMemo;

    fn reduce(&self, problem: &Mlcp) -> Result<(Lcp, ReduceMemo), SolveError> {
        let Mlcp { M, q, equalities, free } = problem;
        if equalities != free {
            return Err(SolveError::needs(
                "as many equalities as free variables",
                format!("{equalities} equalities and {free} free variables"),
            ));
        }
        if matches!(M, Matrix::Operator(_)) {
            return Err(SolveError::needs("the entries of M (dense or sparse)", "an operator"));
        }
        let (n, free) = (q.len(), *free);
        if n == free {
            return Err(SolveError::needs("a complementary pair", "equalities only"));
        }
        let a = block(M, 0..free, 0..free);
        let mut memo = ReduceMemo {
            inverse: inverse(&a)?,
            a,
            d: block(M, free..n, 0..free),
            matrix: M.clone(),
            u: vec![0.0; free],
            wanted: vec![0.0; free],
            residual: vec![0.0; free],
            w: vec![0.0; n],
        };
        let c = block(M, 0..free, free..n);
        let mut reduced = block(M, free..n, free..n).to_dense().expect("not an operator"); // B
        // Rows of Cᵀ are contiguous whatever the storage of C.
        let mut columns = Dense::zeros(n - free, free);
        c.for_each(|i, j, x| columns[(j, i)] = x);
        let mut image = vec![0.0; n - free];
        for j in 0..n - free {
            let column = columns.row(j);
            if column.iter().all(|x| *x == 0.0) {
                continue;
            }
            memo.u.copy_from_slice(column);
            memo.solve();
            memo.d.mul(&memo.u, &mut image);
            image.iter().enumerate().for_each(|(i, x)| reduced[(i, j)] -= x); //     M = B − D A⁻¹ C
        }
        let mut constants = vec![0.0; n - free];
        memo.constants(problem, &mut constants);
        Ok((Lcp::new(reduced, constants)?, memo))
    }

    fn reduce_again(
        &self,
        problem: &Mlcp,
        reduced: &mut Lcp,
        memo: &mut ReduceMemo,
    ) -> Result<(), SolveError> {
        let same = problem.equalities == problem.free && problem.free == memo.free();
        if same && problem.M == memo.matrix {
            problem.validate()?;
            memo.constants(problem, &mut reduced.q);
        } else {
            (*reduced, *memo) = self.reduce(problem)?;
        }
        Ok(())
    }

    fn lift_certificate(&self, certificate: Certificate, memo: &ReduceMemo) -> Certificate {
        let pairs = memo.d.nrows();
        match certificate {
            Certificate::Row { row } if row < pairs => {
                let y: Vec<f64> = (0..pairs).map(|i| f64::from(u8::from(i == row))).collect();
                Certificate::Farkas { y: memo.multipliers(&y) }
            }
            Certificate::Farkas { y } if y.len() == pairs => {
                Certificate::Farkas { y: memo.multipliers(&y) }
            }
            Certificate::Ray { z, z0 } if z.len() == pairs => {
                Certificate::Ray { z: memo.multipliers(&z), z0 }
            }
            Certificate::Cones { separating } if separating.iter().all(|y| y.len() == pairs) => {
                let separating = separating.iter().map(|y| memo.multipliers(y)).collect();
                Certificate::Cones { separating }
            }
            other => other,
        }
    }

    fn lower(&self, problem: &Mlcp, point: &LcpPoint, _: &ReduceMemo, reduced: &mut LcpPoint) {
        reduced.z.clear();
        reduced.z.extend_from_slice(&point.z[problem.free..]);
    }

    fn lift(
        &self,
        problem: &Mlcp,
        reduced: &LcpPoint,
        memo: &mut ReduceMemo,
        point: &mut LcpPoint,
    ) {
        let free = memo.free();
        let (u, v) = point.z.split_at_mut(free);
        v.copy_from_slice(&reduced.z);
        u.fill(0.0);
        problem.M.mul(&point.z, &mut memo.w);
        for ((u, w), a) in memo.u.iter_mut().zip(&memo.w).zip(&problem.q) {
            *u = -(w + a); //                                                        u = −A⁻¹(C v + a)
        }
        memo.solve();
        point.z[..free].copy_from_slice(&memo.u);
    }
}

//! Derivatives of solutions with respect to the data, by implicit differentiation on the active set.
//!
//! A solution of `0 ≤ z ⟂ w = M z + q ≥ 0` or of the local frictional contact problem satisfies, piece by piece, smooth equations of the pair `(x, y)`,
//! `y = S x + p` (z, w, M, q; or r, u, W, q):
//!
//! | piece | equations | A | B | c |
//! | --- | --- | --- | --- | --- |
//! | `z_i = 0 < w_i`; open contact | `x = 0` | I | 0 | 0 |
//! | `z_i > 0 = w_i`; sticking contact | `y = 0` | 0 | I | 0 |
//! | sliding contact, `t = u_T/‖u_T‖` | `u_N = 0` | 0 | `e_Nᵀ` | 0 |
//! | | `r_T + mu r_N t = 0` | `[mu t, I]` | `[0, mu r_N (I − t tᵀ)/‖u_T‖]` | `r_N t` |
//!
//! so that a change of the data changes x by
//!
//! ```text
//! (A + B S) dx = −B (dS x + dp) − c dmu,        dy = S dx + dS x + dp.
//! ```
//!
//! With the adjoint `(A + B S)ᵀ λ = −(g_x + Sᵀ g_y)` a function of the solution with gradients `(g_x, g_y)` has, with `s = Bᵀ λ + g_y`, the gradients
//! `∂p = s`, `∂S = s xᵀ`, `∂mu = cᵀ λ` (contact by contact).
//!
//! Where no pair is zero on both sides, no contact is at the border of two pieces and the matrix is regular, the solution is strongly regular and this is its
//! derivative (Robinson1980; FacchineiPang2003, section 5.4; for contacts KlarbringPang1998). At a *degenerate* solution it is that of one of the pieces that meet there: one element of the
//! B-subdifferential if that piece is one of the solution map's, and a directional derivative in general in no direction.
//!
//! Where impulses are not unique the matrix is singular, and there is no derivative of them.
//! Cost: a sparse factorisation of the equations that are not `x = 0`; then two triangular solves a direction.

use nonsmooth_linalg::{Csc, Matrix, SquareLu};
use nonsmooth_problem::check::{ContactStatus, Judged, Motion, RowStatus};
use nonsmooth_problem::{FrictionLocal, Lcp, LcpPoint, LocalPoint, ProblemError};

/// Why a solution has no derivative here.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DerivativeError {
    /// The point or the problem is at fault.
    #[error(transparent)]
    Problem(#[from] ProblemError),
    /// The judge does not accept the point.
    #[error(
        "the point: expected a solution at tolerance {tolerance:e}, found a relative residual of {found:e}"
    )]
    NotSolved {
        /// The tolerance asked for.
        tolerance: f64,
        /// The residual found.
        found: f64,
    },
    /// The equations of the active set are singular: impulses are not unique.
    #[error(
        "the solution: expected one that the data determine, found others beside it (the equations of the active set are singular)"
    )]
    Singular,
    /// Scalar rows are not differentiated.
    #[error("the problem: expected contacts without scalar rows, found {found} rows")]
    Rows {
        /// Their number.
        found: usize,
    },
}

/// A change of the data: of q, of the entries of M or W, of mu. What is `None` does not change.
#[derive(Debug, Clone, Copy, Default)]
pub struct Change<'a> {
    /// dq, as long as q.
    pub vector: Option<&'a [f64]>,
    /// dM or dW, n × n.
    pub matrix: Option<&'a Matrix>,
    /// dmu, one for each contact; of problems without friction it is ignored.
    pub mu: Option<&'a [f64]>,
}

/// The gradient of a function of the solution with respect to the data.
#[derive(Debug, Clone, PartialEq)]
pub struct Gradient {
    /// With respect to q, n: s.
    pub vector: Vec<f64>,
    /// With respect to mu, nc; empty of problems without friction.
    pub mu: Vec<f64>,
}

/// The derivative of a solution with respect to the data of its problem; see the [module's head](self).
#[derive(Debug)]
pub struct Derivative {
    /// S.
    matrix: Csc,
    /// x.
    point: Vec<f64>,
    /// The components of a piece: D of contacts, 1 of pairs.
    dimension: usize,
    /// The rows of B by pieces, each D × D; of open ones nothing is used.
    b: Vec<f64>,
    /// c.
    c: Vec<f64>,
    /// The place of each unknown among those that are not fixed at zero.
    places: Vec<Option<usize>>,
    lu: SquareLu,
    friction: bool,
    /// Pairs or contacts at the border of two pieces: where there is one the derivative is that of one piece.
    pub degenerate: usize,
}

impl Derivative {
    /// That of a solution z of a linear complementarity problem, as the judge accepts it at `tolerance`.
    ///
    /// Errors: a point that is none, M known by its products only, a singular `M_αα`, `α = {z > 0}`.
    pub fn of_lcp(
        problem: &Lcp,
        point: &LcpPoint,
        tolerance: f64,
    ) -> Result<Self, DerivativeError> {
        let verdict = problem.judge(point, tolerance)?;
        solved(verdict.solved, verdict.measure.relative, tolerance)?;
        let n = point.z.len();
        let is_active = |i: usize| verdict.statuses[i] != RowStatus::Lower;
        let b = (0..n).map(|i| if is_active(i) { 1.0 } else { 0.0 }).collect();
        let matrix = problem.M.to_csc().ok_or(ProblemError::Shape {
            place: "M".into(),
            expected: "a matrix with entries".into(),
            found: "one that is known by its products".into(),
        })?;
        let pieces = Pieces {
            matrix,
            point: point.z.clone(),
            dimension: 1,
            active: (0..n).map(is_active).collect(),
            a: vec![0.0; n],
            b,
            c: vec![0.0; n],
            friction: false,
            degenerate: verdict.counts.degenerate,
        };
        pieces.factorised()
    }

    /// That of a solution r of a local problem without scalar rows, as the judge accepts it at `tolerance`.
    ///
    /// Errors: a point that is none, scalar rows, impulses that are not unique.
    pub fn of_local<const D: usize>(
        problem: &FrictionLocal<D>,
        point: &LocalPoint,
        tolerance: f64,
    ) -> Result<Self, DerivativeError>
    where
        FrictionLocal<D>: Judged<Point = LocalPoint, Status = ContactStatus>,
    {
        if problem.multipliers() > 0 {
            return Err(DerivativeError::Rows { found: problem.multipliers() });
        }
        let verdict = problem.judge(point, tolerance)?;
        solved(verdict.solved, verdict.measure.relative, tolerance)?;
        let (nc, n) = (problem.contacts(), point.r.len());
        let (mut a, mut b) = (vec![0.0; n * D], vec![0.0; n * D]);
        let mut c = vec![0.0; n];
        for (k, status) in verdict.statuses.iter().enumerate() {
            let at = k * D * D;
            match status.status {
                Motion::Open => {}
                Motion::Stick => (0..D).for_each(|i| b[at + i * D + i] = 1.0),
                Motion::Slip => {
                    let u = &verdict.velocity[k * D..k * D + D];
                    let size = u[1..].iter().fold(0.0_f64, |size, x| size.hypot(*x));
                    let (mu, normal) = (problem.mu[k], point.r[k * D]);
                    b[at] = 1.0;
                    for i in 1..D {
                        let t = u[i] / size;
                        a[at + i * D] = mu * t;
                        a[at + i * D + i] = 1.0;
                        for j in 1..D {
                            let same = if i == j { 1.0 } else { 0.0 };
                            let turn = (same - t * u[j] / size) / size;
                            b[at + i * D + j] = mu * normal * turn;
                        }
                        c[k * D + i] = normal * t;
                    }
                }
            }
        }
        let border = |s: &&ContactStatus| s.degenerate || s.at_limit;
        let pieces = Pieces {
            matrix: problem.W.to_csc(),
            point: point.r.clone(),
            dimension: D,
            active: (0..nc).map(|k| verdict.statuses[k].status != Motion::Open).collect(),
            a,
            b,
            c,
            friction: true,
            degenerate: verdict.statuses.iter().filter(border).count(),
        };
        pieces.factorised()
    }

    /// dx and dy of a change of the data.
    ///
    /// # Panics
    ///
    /// Where what changes has not the shape of the data.
    pub fn forward(&self, change: &Change<'_>) -> (Vec<f64>, Vec<f64>) {
        let (n, d) = (self.point.len(), self.dimension);
        // dS x + dp
        let mut load = change.vector.map_or_else(|| vec![0.0; n], <[f64]>::to_vec);
        assert_eq!(load.len(), n, "dq is as long as q");
        if let Some(matrix) = change.matrix {
            let mut product = vec![0.0; n];
            matrix.mul(&self.point, &mut product);
            load.iter_mut().zip(&product).for_each(|(l, p)| *l += p);
        }
        let mut right = vec![0.0; self.lu_dim()];
        for (i, place) in self.places.iter().enumerate() {
            let Some(place) = *place else { continue };
            let (piece, row) = (i / d, &self.b[i * d..i * d + d]);
            let mut of = -row.iter().zip(&load[piece * d..]).map(|(b, l)| b * l).sum::<f64>();
            if let Some(mu) = change.mu.filter(|_| self.friction) {
                of -= self.c[i] * mu[piece];
            }
            right[place] = of;
        }
        self.lu.solve(&mut right);
        let dx: Vec<f64> = self.places.iter().map(|p| p.map_or(0.0, |p| right[p])).collect();
        let mut dy = load;
        self.matrix.mul_add(1.0, &dx, &mut dy);
        (dx, dy)
    }

    /// The gradient with respect to q and mu of a function of the solution whose gradients with respect to x and y are these; with respect to the
    /// entries of M or W it is `s xᵀ`, s the gradient with respect to q.
    ///
    /// # Panics
    ///
    /// Where a gradient has not the length of the solution.
    pub fn backward(&self, gx: &[f64], gy: &[f64]) -> Gradient {
        let (n, d) = (self.point.len(), self.dimension);
        assert_eq!((gx.len(), gy.len()), (n, n), "gradients are as long as the solution");
        let mut through = gx.to_vec();
        self.matrix.mul_transpose_add(1.0, gy, &mut through);
        let mut lambda = vec![0.0; self.lu_dim()];
        for (place, g) in self.places.iter().zip(&through) {
            if let Some(place) = *place {
                lambda[place] = -g;
            }
        }
        self.lu.solve_transpose(&mut lambda);
        let mut vector = gy.to_vec();
        let mut mu = vec![0.0; self.contacts()];
        for (i, place) in self.places.iter().enumerate() {
            let Some(place) = *place else { continue };
            let (piece, row) = (i / d, &self.b[i * d..i * d + d]);
            row.iter().enumerate().for_each(|(j, b)| vector[piece * d + j] += b * lambda[place]);
            if self.friction {
                mu[piece] += self.c[i] * lambda[place];
            }
        }
        Gradient { vector, mu }
    }

    /// x: z or r.
    pub fn point(&self) -> &[f64] {
        &self.point
    }

    /// The number of contacts; 0 of problems without friction.
    pub fn contacts(&self) -> usize {
        if self.friction { self.point.len() / self.dimension } else { 0 }
    }

    fn lu_dim(&self) -> usize {
        self.places.iter().flatten().count()
    }
}

fn solved(solved: bool, found: f64, tolerance: f64) -> Result<(), DerivativeError> {
    match solved {
        true => Ok(()),
        false => Err(DerivativeError::NotSolved { tolerance, found }),
    }
}

/// The pieces of a solution before their equations are factorised.
struct Pieces {
    matrix: Csc,
    point: Vec<f64>,
    dimension: usize,
    /// Pieces that are not `x = 0`.
    active: Vec<bool>,
    /// The rows of A by pieces.
    a: Vec<f64>,
    b: Vec<f64>,
    c: Vec<f64>,
    friction: bool,
    degenerate: usize,
}

impl Pieces {
    fn factorised(self) -> Result<Derivative, DerivativeError> {
        let Self { matrix, point, dimension: d, active, a, mut b, mut c, friction, degenerate } =
            self;
        let mut count = 0;
        let places: Vec<Option<usize>> = (0..point.len())
            .map(|i| {
                active[i / d].then(|| {
                    count += 1;
                    count - 1
                })
            })
            .collect();
        // A + B S over the unknowns that are not fixed.
        let mut entries = vec![];
        for (i, place) in places.iter().enumerate() {
            let Some(place) = *place else { continue };
            for j in 0..d {
                let to = places[i / d * d + j].expect("the components of a contact go together");
                entries.push((place, to, a[i * d + j]));
            }
        }
        for (k, j, s) in matrix.triplets() {
            let Some(to) = places[j] else { continue };
            for i in k / d * d..k / d * d + d {
                if let Some(place) = places[i] {
                    entries.push((place, to, b[i * d + k % d] * s));
                }
            }
        }
        // Rows in units of their own: velocities and impulses stand beside each other.
        let mut sizes = vec![0.0_f64; count];
        entries.iter().for_each(|&(i, _, x)| sizes[i] = sizes[i].max(x.abs()));
        if sizes.contains(&0.0) {
            return Err(DerivativeError::Singular);
        }
        entries.iter_mut().for_each(|(i, _, x)| *x /= sizes[*i]);
        for (i, place) in places.iter().enumerate() {
            let Some(size) = place.map(|place| sizes[place]) else { continue };
            b[i * d..i * d + d].iter_mut().for_each(|b| *b /= size);
            c[i] /= size;
        }
        let mut lu = SquareLu::default();
        if count > 0 {
            let system = Csc::from_triplets(count, count, entries.into_iter())
                .map_err(ProblemError::from)?;
            // Of few unknowns or a full matrix all entries are less work.
            let full = count <= FEW || 4 * system.nnz() > count * count;
            let system = match full {
                true => Matrix::from(system).to_dense().map(Matrix::from),
                false => Some(system.into()),
            };
            let system = system.expect("a matrix with entries");
            lu.factorise(&system).map_err(|_| DerivativeError::Singular)?;
            if inverse_norm(&lu, count) > REGULAR {
                return Err(DerivativeError::Singular);
            }
        }
        Ok(Derivative { matrix, point, dimension: d, b, c, places, lu, friction, degenerate })
    }
}

/// The largest `‖K⁻¹‖₁` of equations whose rows have the size 1 that a derivative is believed with: a quarter of the digits is then left.
const REGULAR: f64 = 1e12;

/// A lower bound of `‖K⁻¹‖₁`, nearly always within a factor of three, by a few solves.
///
/// Source: Higham1988, algorithm 2.4 without its last test.
fn inverse_norm(lu: &SquareLu, n: usize) -> f64 {
    let mut x = vec![1.0 / n as f64; n];
    let mut best = 0.0_f64;
    for _ in 0..5 {
        lu.solve(&mut x);
        let norm = x.iter().map(|x| x.abs()).sum::<f64>();
        if norm.is_nan() || norm <= best {
            return if norm.is_nan() { f64::INFINITY } else { best };
        }
        best = norm;
        x.iter_mut().for_each(|x| *x = 1.0_f64.copysign(*x));
        lu.solve_transpose(&mut x);
        let largest = (0..n).max_by(|&i, &j| x[i].abs().total_cmp(&x[j].abs())).unwrap_or(0);
        x.fill(0.0);
        x[largest] = 1.0;
    }
    best
}

/// Systems up to this size are factorised with all their entries.
const FEW: usize = 100;

#[cfg(test)]
mod tests {
    use nonsmooth_linalg::{Bsr, Dense};

    use super::*;

    /// One box: pressed with N, pushed with T beyond friction; dr and du by hand.
    #[test]
    fn a_sliding_box_moves_as_by_hand() {
        let (mu, push) = (0.5, 2.0);
        let identity = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(i == j)));
        let w = Bsr::from_rows(1, &[vec![(0, identity)]]);
        let problem = FrictionLocal::<3>::new(w, vec![-1.0, push, 0.0], vec![mu]).unwrap();
        let point = LocalPoint { r: vec![1.0, -mu, 0.0], lambda: vec![] };
        let derivative = Derivative::of_local(&problem, &point, 1e-10).unwrap();
        assert_eq!(derivative.degenerate, 0);
        let of = |vector: Option<&[f64]>, mu: Option<&[f64]>| {
            derivative.forward(&Change { vector, mu, ..Change::default() }).0
        };
        let near = |a: &[f64], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
        // Pressed more: r_N and the friction that goes with it.
        assert!(near(&of(Some(&[-1.0, 0.0, 0.0]), None), [1.0, -mu, 0.0]));
        // Pushed more: nothing. To the side: friction turns.
        assert!(near(&of(Some(&[0.0, 1.0, 0.0]), None), [0.0, 0.0, 0.0]));
        assert!(near(&of(Some(&[0.0, 0.0, 1.0]), None), [0.0, 0.0, -mu / push]));
        assert!(near(&of(None, Some(&[1.0])), [0.0, -1.0, 0.0]));
        // ⟨g, dx⟩ = ⟨∂, dp⟩ for g = r_T2.
        let gradient = derivative.backward(&[0.0, 0.0, 1.0], &[0.0; 3]);
        assert!(near(&gradient.vector, [0.0, 0.0, -mu / push]) && gradient.mu[0].abs() < 1e-14);
    }

    #[test]
    fn what_has_no_derivative_says_so() {
        // M_αα = 0 where z is free to choose, a degenerate pair, a point that is no solution.
        let m = |rows: &[[f64; 2]]| Dense::from_rows(rows).unwrap();
        let singular = Lcp::new(m(&[[1.0, 1.0], [1.0, 1.0]]), vec![-2.0, -2.0]).unwrap();
        let at = |z: [f64; 2]| LcpPoint { z: z.to_vec() };
        let found = Derivative::of_lcp(&singular, &at([1.0, 1.0]), 1e-8);
        assert_eq!(found.unwrap_err(), DerivativeError::Singular);
        let regular = Lcp::new(m(&[[1.0, 0.0], [0.0, 1.0]]), vec![-1.0, 0.0]).unwrap();
        assert_eq!(Derivative::of_lcp(&regular, &at([1.0, 0.0]), 1e-8).unwrap().degenerate, 1);
        let found = Derivative::of_lcp(&regular, &at([0.0, 0.0]), 1e-8).unwrap_err().to_string();
        assert!(found.starts_with("the point: expected a solution at tolerance 1e-8"), "{found}");
        // Two contacts of one body at one place share their load as they like.
        let identity = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(i == j)));
        let row = || vec![(0, identity), (1, identity)];
        let shared = FrictionLocal::<2>::new(
            Bsr::from_rows(2, &[row(), row()]),
            vec![-1.0, 0.0, -1.0, 0.0],
            vec![0.5, 0.5],
        )
        .unwrap();
        let point = LocalPoint { r: vec![0.5, 0.0, 0.5, 0.0], lambda: vec![] };
        let found = Derivative::of_local(&shared, &point, 1e-8);
        assert_eq!(found.unwrap_err(), DerivativeError::Singular);
    }
}

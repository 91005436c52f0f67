//! M and M̂ with their factors, made anew only where an entry has changed.

use nonsmooth_linalg::{Csc, Dense, Matrix, Singular, SquareCholesky, SquareLu};

use super::Lagrangian;
use crate::SimulateError;

/// A matrix with its factorisation, which is kept while the matrix stays.
struct Factored<F> {
    matrix: Matrix,
    /// The entries that the factor belongs to; none before the first.
    of: Vec<f64>,
    factor: F,
    factorise: fn(&mut F, &Matrix) -> Result<(), Singular>,
}

impl<F: Default> Factored<F> {
    fn new(matrix: Matrix, factorise: fn(&mut F, &Matrix) -> Result<(), Singular>) -> Self {
        Self { matrix, of: vec![], factor: F::default(), factorise }
    }

    /// Factorises unless the entries are those of the last time; whether it did.
    fn refresh(&mut self) -> Result<bool, Singular> {
        let entries = entries(&self.matrix);
        if entries == self.of {
            return Ok(false);
        }
        self.of.clear();
        (self.factorise)(&mut self.factor, &self.matrix)?;
        self.of.extend_from_slice(entries);
        Ok(true)
    }
}

fn entries(a: &Matrix) -> &[f64] {
    match a {
        Matrix::Dense(a) => a.values(),
        Matrix::Sparse(a) => a.values(),
        Matrix::Operator(_) => &[],
    }
}

fn dense(a: &mut Matrix) -> Option<&mut Dense> {
    match a {
        Matrix::Dense(a) => Some(a),
        _ => None,
    }
}

/// The most that `|M_ij − M_ji|` may be relative to the largest entry of M.
const ASYMMETRY: f64 = 1e-10;

/// What an M must be and is not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Unfit {
    /// Positive definite, of finite entries.
    Singular,
    /// Symmetric; by how much it is not.
    Asymmetric(f64),
}

impl Unfit {
    /// The same in words, of M at this time.
    pub fn at(self, t: f64) -> SimulateError {
        match self {
            Self::Singular => SimulateError::value(
                "mass",
                "a symmetric positive definite matrix",
                format!("one that is not, at t = {t}"),
            ),
            Self::Asymmetric(x) => SimulateError::value(
                "asymmetry of mass",
                "0, of a symmetric matrix",
                format!("{x}, at t = {t}"),
            ),
        }
    }
}

/// What a constant M̂ is made of: h, θ, whether it is symmetrised, and M, C, K. These share the memory of those of the system, so that they are the same by
/// address as long as nobody has written to them.
type Made = (f64, f64, bool, [Csc; 3]);

/// The matrices of an iteration; those of constant systems are sparse.
pub(super) struct Matrices {
    n: usize,
    mass: Factored<SquareCholesky>,
    hat: Factored<SquareLu>,
    /// What a constant M̂ is made of.
    made: Option<Made>,
    /// M elsewhere, for the kinetic energy.
    other: Dense,
    by_position: Dense,
    by_velocity: Dense,
    work: Vec<f64>,
}

impl Matrices {
    pub fn new<L: Lagrangian<D> + ?Sized, const D: usize>(system: &L) -> Self {
        let n = system.size().dofs;
        let (mass, hat) = match system.constant() {
            Some(c) => (c.mass.clone().into(), c.mass.clone().into()),
            None => (Dense::zeros(n, n).into(), Dense::zeros(n, n).into()),
        };
        Self {
            n,
            mass: Factored::new(mass, SquareCholesky::factorise),
            hat: Factored::new(hat, SquareLu::factorise),
            made: None,
            other: Dense::default(),
            by_position: Dense::default(),
            by_velocity: Dense::default(),
            work: vec![],
        }
    }

    /// M at q, factorised unless it is that of the last time. Errors: not symmetric, not positive definite, or not finite.
    pub fn mass<L: Lagrangian<D> + ?Sized, const D: usize>(
        &mut self,
        system: &L,
        q: &[f64],
    ) -> Result<(), Unfit> {
        match (&mut self.mass.matrix, system.constant()) {
            (Matrix::Dense(mass), _) => {
                mass.reset(self.n, self.n);
                system.mass(q, mass);
            }
            (Matrix::Sparse(mass), Some(c)) if mass != c.mass => {
                mass.clone_from(c.mass);
                self.mass.of.clear();
            }
            _ => {}
        }
        if self.mass.refresh().map_err(|_| Unfit::Singular)? {
            let asymmetry = self.mass.matrix.asymmetry().unwrap_or(0.0);
            if asymmetry > ASYMMETRY {
                // Not to be taken for known by the next call.
                self.mass.of.clear();
                return Err(Unfit::Asymmetric(asymmetry));
            }
        }
        Ok(())
    }

    /// Whether all entries of M are finite.
    pub fn is_finite(&self) -> bool {
        entries(&self.mass.matrix).iter().all(|x| x.is_finite())
    }

    /// Whether all entries of M̂ are finite.
    pub fn is_hat_finite(&self) -> bool {
        entries(&self.hat.matrix).iter().all(|x| x.is_finite())
    }

    /// `M̂ = M − hθ ∂F/∂v − h²θ² ∂F/∂q` at t, q, v, its symmetric part if asked for, factorised; whether it has changed.
    pub fn hat<L: Lagrangian<D> + ?Sized, const D: usize>(
        &mut self,
        system: &L,
        (t, q, v): (f64, &mut [f64], &mut [f64]),
        (h, theta): (f64, f64),
        symmetric: bool,
    ) -> Result<bool, Singular> {
        let ht = h * theta;
        if let Some(c) = system.constant() {
            let same = |(a, b, s, [m, d, k]): &Made| {
                (*a, *b, *s) == (h, theta, symmetric)
                    && (m, d, k) == (c.mass, c.damping, c.stiffness)
            };
            if !self.made.as_ref().is_some_and(same) {
                let part =
                    |a: &Csc, x: f64| a.triplets().map(move |(i, j, a)| (i, j, x * a)).collect();
                let parts: [Vec<_>; 3] =
                    [part(c.mass, 1.0), part(c.damping, ht), part(c.stiffness, ht * ht)];
                let all = parts.iter().flatten().copied();
                let hat = match symmetric {
                    false => Csc::from_triplets(self.n, self.n, all),
                    true => {
                        let both = all.flat_map(|(i, j, x)| [(i, j, 0.5 * x), (j, i, 0.5 * x)]);
                        Csc::from_triplets(self.n, self.n, both)
                    }
                };
                self.hat.matrix = hat.map_err(|_| Singular)?.into();
                self.hat.of.clear();
                let parts = [c.mass, c.damping, c.stiffness].map(Csc::clone);
                self.made = Some((h, theta, symmetric, parts));
            }
            return self.hat.refresh();
        }
        let n = self.n;
        let Self { by_position, by_velocity, work, .. } = self;
        by_position.reset(n, n);
        if !system.force_by_position(t, q, v, by_position) {
            by_position.reset(n, n);
            let force = |x: &[f64], f: &mut [f64]| system.force(t, x, v, f);
            super::differences::jacobian(q, system.typical(), work, by_position, force);
        }
        by_velocity.reset(n, n);
        if !system.force_by_velocity(t, q, v, by_velocity) {
            by_velocity.reset(n, n);
            let force = |x: &[f64], f: &mut [f64]| system.force(t, q, x, f);
            super::differences::jacobian(v, system.typical(), work, by_velocity, force);
        }
        let (Matrix::Dense(mass), Some(hat)) = (&self.mass.matrix, dense(&mut self.hat.matrix))
        else {
            unreachable!("dense unless constant")
        };
        let value = |i: usize, j: usize| {
            mass[(i, j)] - ht * by_velocity[(i, j)] - ht * ht * by_position[(i, j)]
        };
        for i in 0..n {
            for j in 0..n {
                hat[(i, j)] = match symmetric {
                    true => 0.5 * (value(i, j) + value(j, i)),
                    false => value(i, j),
                };
            }
        }
        self.hat.refresh()
    }

    /// `y = M x`, with M of the last call of [`mass`](Self::mass).
    pub fn times(&self, x: &[f64], y: &mut [f64]) {
        self.mass.matrix.mul(x, y);
    }

    /// `x ← M⁻¹ x`.
    pub fn solve_mass(&mut self, x: &mut [f64]) {
        self.mass.factor.solve(x);
    }

    /// `x ← M̂⁻¹ x`.
    pub fn solve_hat(&mut self, x: &mut [f64]) {
        self.hat.factor.solve(x);
    }

    /// `½ ‖v‖²_M` with the last M.
    pub fn half_square(&mut self, v: &[f64]) -> f64 {
        self.work.clear();
        self.work.resize(self.n, 0.0);
        self.mass.matrix.mul(v, &mut self.work);
        0.5 * v.iter().zip(&self.work).map(|(a, b)| a * b).sum::<f64>()
    }

    /// `‖x‖_{M⁻¹}` with the last M.
    pub fn dual_norm(&mut self, x: &[f64]) -> f64 {
        self.work.clear();
        self.work.extend_from_slice(x);
        self.mass.factor.solve(&mut self.work);
        x.iter().zip(&self.work).map(|(a, b)| a * b).sum::<f64>().max(0.0).sqrt()
    }

    /// `½ vᵀ M(q) v`.
    pub fn kinetic<L: Lagrangian<D> + ?Sized, const D: usize>(
        &mut self,
        system: &L,
        q: &[f64],
        v: &[f64],
    ) -> f64 {
        if system.constant().is_some() {
            return self.half_square(v);
        }
        self.other.reset(self.n, self.n);
        system.mass(q, &mut self.other);
        let row = |i: usize| self.other.row(i).iter().zip(v).map(|(m, v)| m * v).sum::<f64>();
        0.5 * (0..self.n).map(|i| v[i] * row(i)).sum::<f64>()
    }
}

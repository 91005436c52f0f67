//! The global (mixed linear) frictional contact problem.

mod dynamics;
mod judge;

pub use dynamics::Dynamics;
pub use judge::GlobalGauge;

use crate::check::Law;
use crate::check::{self, Certificate, ConeSystem, Evidence, Measure};
use crate::error::{all_finite, friction_coefficients, rolling_coefficients, vector};
use crate::kinds::contact::judge::Weighed;
use crate::kinds::contact::law::RollingData;
use crate::{Bounds, Coulomb, Kind, Problem, ProblemError, Rolling};
use nonsmooth_linalg::Csc;

/// **Find** `v`, `r` (and the impulses `lambda` of scalar rows) such that
///
/// ```text
/// M v = H r + f  (+ G lambda),    u = Hᵀ v + w,    c = Gᵀ v + b,
/// K* ∋ u + mu‖u_T‖ e_N  ⟂  r ∈ K    for each contact, K = {‖r_T‖ ≤ mu r_N},
/// −c_j ∈ N_[l_j, u_j](lambda_j)       for each row; c = 0 for bilateral constraints.
/// ```
///
/// | field | meaning | shape | unit |
/// | --- | --- | --- | --- |
/// | `M` | mass (iteration) matrix, invertible; need not be symmetric | n × n | kg |
/// | `H` | transposed contact Jacobian, columns by contact | n × D·nc | 1 |
/// | `f` | right-hand side | n | N·s |
/// | `w` | given part of the relative velocity, impact terms included | D·nc | m/s |
/// | `mu` | coefficients of friction, 0 allowed | nc | 1 |
/// | `mu_r` | coefficients of rolling friction, of [`Rolling`] | nc | m |
/// | `rows` | `G`, `b` of FCLIB, and bounds | n × p, p | |
///
/// A problem with scalar rows may have no contacts.
///
/// Source: Acary, lecture, problems P_ML and P_ML_b; FCLIB `/fclib_global`.
#[derive(Debug, Clone, PartialEq)]
#[allow(non_snake_case)]
pub struct FrictionGlobal<const D: usize, L: Law<D> = Coulomb> {
    /// The mass matrix.
    pub M: Csc,
    /// The transposed contact Jacobian.
    pub H: Csc,
    /// The right-hand side of the dynamics.
    pub f: Vec<f64>,
    /// The given part of the relative velocity.
    pub w: Vec<f64>,
    /// The coefficients of friction.
    pub mu: Vec<f64>,
    /// The coefficients of rolling friction, nc, in m, of a law that has them.
    pub mu_r: L::Rolling,
    /// Scalar rows, such as bilateral constraints, if the problem has any.
    pub rows: Option<RowsGlobal>,
}

/// The scalar rows `c = Gᵀ v + b` of a [`FrictionGlobal`], with `G lambda` added to the dynamics.
#[derive(Debug, Clone, PartialEq)]
#[allow(non_snake_case)]
pub struct RowsGlobal {
    /// n × p: transposed Jacobian of the rows.
    pub G: Csc,
    /// p: given velocity of the rows.
    pub b: Vec<f64>,
    /// What the impulses may be.
    pub bounds: Bounds,
}

#[allow(non_snake_case)]
impl RowsGlobal {
    /// Bilateral constraints, `Gᵀ v + b = 0`.
    pub fn bilateral(G: Csc, b: Vec<f64>) -> Self {
        Self { G, b, bounds: Bounds::default() }
    }
}

/// The unknown of a [`FrictionGlobal`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GlobalPoint {
    /// Generalised velocities, n, in m/s.
    pub v: Vec<f64>,
    /// Contact impulses, D·nc, in N·s.
    pub r: Vec<f64>,
    /// Impulses of the scalar rows, p (empty without any): of bilateral constraints their multipliers.
    pub lambda: Vec<f64>,
}

#[allow(non_snake_case)]
impl<const D: usize> FrictionGlobal<D> {
    /// States a problem without scalar rows, validated.
    ///
    /// Errors: neither contacts nor rows, a wrong shape, a value that is not finite, a negative `mu`; each names its entry.
    /// A singular M is found when it is factorised: by the judge ([`Problem::gauge`]) or by a solver.
    pub fn new(
        M: Csc,
        H: Csc,
        f: Vec<f64>,
        w: Vec<f64>,
        mu: Vec<f64>,
    ) -> Result<Self, ProblemError> {
        let problem = Self { M, H, f, w, mu, mu_r: (), rows: None };
        problem.validate()?;
        Ok(problem)
    }
}

/// A global problem with rolling friction: `[N, T1, T2, R1, R2]` at each contact.
pub type RollingGlobal = FrictionGlobal<5, Rolling>;

#[allow(non_snake_case)]
impl RollingGlobal {
    /// States a problem without scalar rows, validated; `mu_r` in m.
    ///
    /// Errors: as without rolling friction; `mu_r` of another length than `mu`, negative or not finite.
    pub fn rolling(
        M: Csc,
        H: Csc,
        f: Vec<f64>,
        w: Vec<f64>,
        mu: Vec<f64>,
        mu_r: Vec<f64>,
    ) -> Result<Self, ProblemError> {
        let problem = Self { M, H, f, w, mu, mu_r, rows: None };
        problem.validate()?;
        Ok(problem)
    }
}

#[allow(non_snake_case)]
impl<const D: usize, L: Law<D>> FrictionGlobal<D, L> {
    /// nc.
    pub fn contacts(&self) -> usize {
        self.mu.len()
    }

    /// The number of degrees of freedom n.
    pub fn dofs(&self) -> usize {
        self.f.len()
    }

    /// The coefficients of rolling friction, nc, or empty.
    pub fn rolling_coefficients(&self) -> &[f64] {
        self.mu_r.values()
    }

    /// The law of contact c.
    pub fn law(&self, c: usize) -> L {
        L::of(&self.mu, &self.mu_r, c)
    }

    /// The number of scalar rows p.
    pub fn multipliers(&self) -> usize {
        self.rows.as_ref().map_or(0, |b| b.b.len())
    }

    /// Checks shapes and values; the fields are public, so call it after changing them.
    pub fn validate(&self) -> Result<(), ProblemError> {
        const { assert!(L::FITS, "contacts have 2 or 3 components, 5 with rolling friction") };
        let (n, nc) = (self.dofs(), self.contacts());
        if nc + self.multipliers() == 0 {
            return Err(ProblemError::Empty { place: "mu".into() });
        }
        if n == 0 {
            return Err(ProblemError::shape("f", "at least one degree of freedom", "0 entries"));
        }
        self.M.check_shape("M", n, n, "entries of f")?;
        self.H.check_shape("H", n, D * nc, "entries of f × contact components of mu")?;
        self.M.check_finite("M")?;
        self.H.check_finite("H")?;
        all_finite("f", &self.f)?;
        vector("w", &self.w, D * nc, "components of the contacts")?;
        friction_coefficients("mu", &self.mu)?;
        rolling_coefficients(self.mu_r.values(), nc, L::DISKS)?;
        if let Some(RowsGlobal { G, b, bounds }) = &self.rows {
            G.check_shape("G", n, b.len(), "entries of f × entries of b")?;
            G.check_finite("G")?;
            all_finite("b", b)?;
            bounds.validate(b.len(), "entries of b")?;
        }
        Ok(())
    }

    /// `u = Hᵀ v + w` into `u`.
    pub fn velocity_into(&self, v: &[f64], u: &mut [f64]) {
        u.copy_from_slice(&self.w);
        self.H.mul_transpose_add(1.0, v, u);
    }
}

impl<const D: usize, L: Law<D>> Problem for FrictionGlobal<D, L> {
    type Point = GlobalPoint;
    type Gauge = GlobalGauge;

    fn kind(&self) -> Kind {
        L::GLOBAL
    }

    fn unknowns(&self) -> usize {
        self.dofs() + D * self.contacts() + self.multipliers()
    }

    fn origin(&self) -> GlobalPoint {
        GlobalPoint {
            v: vec![0.0; self.dofs()],
            r: vec![0.0; D * self.contacts()],
            lambda: vec![0.0; self.multipliers()],
        }
    }

    fn validate(&self) -> Result<(), ProblemError> {
        Self::validate(self)
    }

    fn validate_point(&self, point: &GlobalPoint) -> Result<(), ProblemError> {
        vector("v", &point.v, self.dofs(), "degrees of freedom")?;
        vector("r", &point.r, D * self.contacts(), "components of the contacts")?;
        vector("lambda", &point.lambda, self.multipliers(), "scalar rows")
    }

    fn copy_point(from: &GlobalPoint, to: &mut GlobalPoint) {
        to.v.clone_from(&from.v);
        to.r.clone_from(&from.r);
        to.lambda.clone_from(&from.lambda);
    }

    fn gauge(&self) -> Result<Self::Gauge, ProblemError> {
        match self.arms() {
            None => GlobalGauge::new(self),
            Some(arms) => GlobalGauge::new(&self.weighed(&arms)),
        }
    }

    fn regauge(&self, gauge: &mut Self::Gauge) -> Result<(), ProblemError> {
        match self.arms() {
            None => gauge.refill(self),
            Some(arms) => gauge.refill(&self.weighed(&arms)),
        }
    }

    fn measure(&self, point: &GlobalPoint, gauge: &mut Self::Gauge) -> Measure {
        gauge.measure_weighed(self, point, false)
    }

    fn certify(&self, point: &GlobalPoint, gauge: &mut Self::Gauge) -> Measure {
        gauge.measure_weighed(self, point, true)
    }

    fn tidy(&self, point: &mut GlobalPoint, gauge: &mut Self::Gauge, boldly: bool) -> bool {
        gauge.law().tidy::<L, D>(&mut point.r, boldly)
    }

    fn follow_impulses(&self, point: &mut GlobalPoint, gauge: &mut Self::Gauge) -> bool {
        let (v, lambda) = gauge.motion(self.dofs());
        if v.iter().chain(lambda).any(|x| !x.is_finite()) {
            return false;
        }
        point.v.copy_from_slice(v);
        point.lambda.copy_from_slice(lambda);
        true
    }

    fn partner(&self, point: &GlobalPoint) -> Vec<f64> {
        let mut u = vec![0.0; self.w.len()];
        self.velocity_into(&point.v, &mut u);
        u
    }

    fn evidence(&self, certificate: &Certificate) -> Evidence {
        check::weigh(self, certificate)
    }

    fn cones(&self) -> Option<ConeSystem> {
        check::Exactly::system(self, None)
    }

    fn assembled(&self, unknowns: &[f64]) -> Self::Point {
        let (v, rest) = unknowns.split_at(self.dofs());
        let (r, lambda) = rest.split_at(self.w.len());
        GlobalPoint { v: v.to_vec(), r: r.to_vec(), lambda: lambda.to_vec() }
    }
}

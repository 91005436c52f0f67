//! The local (Delassus) frictional contact problem.

mod judge;

pub use judge::LocalGauge;

use crate::check::Law;
use crate::check::{self, Certificate, ConeSystem, Evidence, Measure};
use crate::error::{all_finite, friction_coefficients, rolling_coefficients, vector};
use crate::kinds::contact::judge::Weighed;
use crate::kinds::contact::law::RollingData;
use crate::{Bounds, Coulomb, Kind, Problem, ProblemError, Rolling};
use nonsmooth_linalg::{Bsr, Csc};

/// **Find** `r` (and the impulses `lambda` of scalar rows) such that
///
/// ```text
/// u = W r + q  (+ V lambda),      c = Vᵀ r + R lambda + s,
/// K* ∋ u + mu‖u_T‖ e_N  ⟂  r ∈ K    for each contact, K = {‖r_T‖ ≤ mu r_N},
/// −c_j ∈ N_[l_j, u_j](lambda_j)       for each row; c = 0 for bilateral constraints.
/// ```
///
/// | field | meaning | shape | unit |
/// | --- | --- | --- | --- |
/// | `W` | Delassus operator Hᵀ M⁻¹ H, by D×D blocks; need not be symmetric | D·nc × D·nc | 1/kg |
/// | `q` | free relative velocity, impact terms included | D·nc | m/s |
/// | `mu` | coefficients of friction, 0 allowed | nc | 1 |
/// | `mu_r` | coefficients of rolling friction, of [`Rolling`] | nc | m |
/// | `rows` | `V`, `R`, `s` of FCLIB, and bounds | D·nc × p, p × p, p | |
///
/// Each contact's entries are `[N, T]` (D = 2) or `[N, T1, T2]` (D = 3). A problem with scalar rows may have no contacts.
///
/// Under the law L = [`Rolling`] they are `[N, T1, T2, R1, R2]`, of u in m/s and rad/s, of r in N·s and N·m·s, and
/// `K = {‖r_T‖ ≤ mu r_N, ‖r_R‖ ≤ mu_r r_N}`, `ũ = u + (mu‖u_T‖ + mu_r‖u_R‖) e_N`.
/// Source: Acary, lecture (3)(4), problem P_L; FCLIB `/fclib_local`.
#[derive(Debug, Clone, PartialEq)]
#[allow(non_snake_case)]
pub struct FrictionLocal<const D: usize, L: Law<D> = Coulomb> {
    /// The Delassus operator.
    pub W: Bsr<D>,
    /// The free relative velocity.
    pub q: Vec<f64>,
    /// The coefficients of friction.
    pub mu: Vec<f64>,
    /// The coefficients of rolling friction, nc, in m, of a law that has them.
    pub mu_r: L::Rolling,
    /// Scalar rows, such as bilateral constraints, if the problem has any.
    pub rows: Option<RowsLocal>,
}

/// The scalar rows `c = Vᵀ r + R lambda + s` of a [`FrictionLocal`], with `V lambda` added to u.
#[derive(Debug, Clone, PartialEq)]
#[allow(non_snake_case)]
pub struct RowsLocal {
    /// D·nc × p: relative velocity at the contacts for unit impulses of the rows.
    pub V: Csc,
    /// p × p: velocity of the rows for unit impulses.
    pub R: Csc,
    /// p: free velocity of the rows.
    pub s: Vec<f64>,
    /// What the impulses may be.
    pub bounds: Bounds,
}

#[allow(non_snake_case)]
impl RowsLocal {
    /// Bilateral constraints, `0 = Vᵀ r + R lambda + s`.
    pub fn bilateral(V: Csc, R: Csc, s: Vec<f64>) -> Self {
        Self { V, R, s, bounds: Bounds::default() }
    }
}

/// The unknown of a [`FrictionLocal`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LocalPoint {
    /// Contact impulses, D·nc, in N·s.
    pub r: Vec<f64>,
    /// Impulses of the scalar rows, p (empty without any): of bilateral constraints their multipliers.
    pub lambda: Vec<f64>,
}

#[allow(non_snake_case)]
impl<const D: usize> FrictionLocal<D> {
    /// States a problem without scalar rows, validated.
    ///
    /// Errors: neither contacts nor rows, a wrong shape, a value that is not finite, a negative `mu`; each names its entry.
    pub fn new(W: Bsr<D>, q: Vec<f64>, mu: Vec<f64>) -> Result<Self, ProblemError> {
        let problem = Self { W, q, mu, mu_r: (), rows: None };
        problem.validate()?;
        Ok(problem)
    }

    /// States a problem with scalar rows, validated.
    pub fn with_rows(
        W: Bsr<D>,
        q: Vec<f64>,
        mu: Vec<f64>,
        rows: RowsLocal,
    ) -> Result<Self, ProblemError> {
        let problem = Self { W, q, mu, mu_r: (), rows: Some(rows) };
        problem.validate()?;
        Ok(problem)
    }
}

/// A local problem with rolling friction: `[N, T1, T2, R1, R2]` at each contact.
pub type RollingLocal = FrictionLocal<5, Rolling>;

#[allow(non_snake_case)]
impl RollingLocal {
    /// States a problem without scalar rows, validated; `mu_r` in m.
    ///
    /// Errors: as without rolling friction; `mu_r` of another length than `mu`, negative or not finite.
    pub fn rolling(
        W: Bsr<5>,
        q: Vec<f64>,
        mu: Vec<f64>,
        mu_r: Vec<f64>,
    ) -> Result<Self, ProblemError> {
        let problem = Self { W, q, mu, mu_r, rows: None };
        problem.validate()?;
        Ok(problem)
    }
}

#[allow(non_snake_case)]
impl<const D: usize, L: Law<D>> FrictionLocal<D, L> {
    /// nc.
    pub fn contacts(&self) -> usize {
        self.mu.len()
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
        self.rows.as_ref().map_or(0, |b| b.s.len())
    }

    /// Checks shapes and values; the fields are public, so call it after changing them.
    pub fn validate(&self) -> Result<(), ProblemError> {
        const { assert!(L::FITS, "contacts have 2 or 3 components, 5 with rolling friction") };
        let nc = self.contacts();
        if nc + self.multipliers() == 0 {
            return Err(ProblemError::Empty { place: "mu".into() });
        }
        if (self.W.nrows(), self.W.ncols()) != (nc, nc) {
            return Err(ProblemError::shape(
                "W",
                format!("{0} × {0} ({D} for each of the {nc} entries of mu)", D * nc),
                format!("{} × {}", D * self.W.nrows(), D * self.W.ncols()),
            ));
        }
        for i in 0..nc {
            let (cols, blocks) = self.W.row(i);
            let astray = |k: &usize| cols[*k] as usize >= nc || *k > 0 && cols[*k] <= cols[*k - 1];
            if let Some(k) = (0..cols.len()).find(astray) {
                let expected = format!("columns of blocks that ascend, below {nc}");
                return Err(ProblemError::value(format!("W, block row {i}"), expected, cols[k]));
            }
            for (&j, b) in cols.iter().zip(blocks) {
                if let Some(k) = b.iter().flatten().position(|x| !x.is_finite()) {
                    let (row, column) = (D * i + k / D, D * j as usize + k % D);
                    return Err(ProblemError::value(
                        format!("W[{row}, {column}]"),
                        "a finite number",
                        b[k / D][k % D],
                    ));
                }
            }
        }
        vector("q", &self.q, D * nc, "components of the contacts")?;
        friction_coefficients("mu", &self.mu)?;
        rolling_coefficients(self.mu_r.values(), nc, L::DISKS)?;
        if let Some(RowsLocal { V, R, s, bounds }) = &self.rows {
            V.check_shape("V", D * nc, s.len(), "contact components × entries of s")?;
            R.check_shape("R", s.len(), s.len(), "entries of s")?;
            V.check_finite("V")?;
            R.check_finite("R")?;
            all_finite("s", s)?;
            bounds.validate(s.len(), "entries of s")?;
        }
        Ok(())
    }

    /// `u = W r + V lambda + q` into `u`.
    pub fn velocity_into(&self, point: &LocalPoint, u: &mut [f64]) {
        self.W.mul_plus(&point.r, &self.q, u);
        if let Some(b) = &self.rows {
            b.V.mul_add(1.0, &point.lambda, u);
        }
    }
}

impl<const D: usize, L: Law<D>> Problem for FrictionLocal<D, L> {
    type Point = LocalPoint;
    type Gauge = LocalGauge;

    fn kind(&self) -> Kind {
        L::LOCAL
    }

    fn unknowns(&self) -> usize {
        D * self.contacts() + self.multipliers()
    }

    fn origin(&self) -> LocalPoint {
        LocalPoint { r: vec![0.0; D * self.contacts()], lambda: vec![0.0; self.multipliers()] }
    }

    fn validate(&self) -> Result<(), ProblemError> {
        Self::validate(self)
    }

    fn validate_point(&self, point: &LocalPoint) -> Result<(), ProblemError> {
        vector("r", &point.r, D * self.contacts(), "components of the contacts")?;
        vector("lambda", &point.lambda, self.multipliers(), "scalar rows")
    }

    fn copy_point(from: &LocalPoint, to: &mut LocalPoint) {
        to.r.clone_from(&from.r);
        to.lambda.clone_from(&from.lambda);
    }

    fn gauge(&self) -> Result<Self::Gauge, ProblemError> {
        Ok(match self.arms() {
            None => LocalGauge::new(self),
            Some(arms) => LocalGauge::new(&self.weighed(&arms)),
        })
    }

    fn regauge(&self, gauge: &mut Self::Gauge) -> Result<(), ProblemError> {
        match self.arms() {
            None => gauge.refill(self),
            Some(arms) => gauge.refill(&self.weighed(&arms)),
        }
        Ok(())
    }

    fn measure(&self, point: &LocalPoint, gauge: &mut Self::Gauge) -> Measure {
        gauge.measure_weighed(self, point, false)
    }

    fn certify(&self, point: &LocalPoint, gauge: &mut Self::Gauge) -> Measure {
        gauge.measure_weighed(self, point, true)
    }

    fn tidy(&self, point: &mut LocalPoint, gauge: &mut Self::Gauge, boldly: bool) -> bool {
        gauge.law().tidy::<L, D>(&mut point.r, boldly)
    }

    fn accept(
        &self,
        point: &LocalPoint,
        gauge: &mut Self::Gauge,
        tolerance: f64,
    ) -> Option<(Measure, f64)> {
        gauge.accept(self, point, tolerance)
    }

    fn partner(&self, point: &LocalPoint) -> Vec<f64> {
        let mut u = self.q.clone();
        self.velocity_into(point, &mut u);
        u
    }

    fn evidence(&self, certificate: &Certificate) -> Evidence {
        check::weigh(self, certificate)
    }

    fn cones(&self) -> Option<ConeSystem> {
        check::Exactly::system(self, None)
    }

    fn assembled(&self, unknowns: &[f64]) -> Self::Point {
        let (r, lambda) = unknowns.split_at(self.q.len());
        LocalPoint { r: r.to_vec(), lambda: lambda.to_vec() }
    }
}

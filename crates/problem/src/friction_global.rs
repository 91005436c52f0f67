//! The global (mixed linear) frictional contact problem.

use crate::check::{self, Certificate, ConeSystem, Evidence, Impulses, Measure};
use crate::error::{all_finite, friction_coefficients, vector};
use crate::{Kind, Problem, ProblemError};
use nonsmooth_linalg::{Compensated, Csc, Inverse, Refine};

/// **Find** `v`, `r` (and the multipliers `lambda` of bilateral constraints) such that
///
/// ```text
/// M v = H r + f  (+ G lambda),    u = Hᵀ v + w,    Gᵀ v + b = 0,
/// K* ∋ u + mu‖u_T‖ e_N  ⟂  r ∈ K    for each contact, K = {‖r_T‖ ≤ mu r_N}.
/// ```
///
/// | field | meaning | shape | unit |
/// | --- | --- | --- | --- |
/// | `M` | mass (iteration) matrix, invertible; need not be symmetric | n × n | kg |
/// | `H` | transposed contact Jacobian, columns by contact | n × D·nc | 1 |
/// | `f` | right-hand side | n | N·s |
/// | `w` | given part of the relative velocity, impact terms included | D·nc | m/s |
/// | `mu` | coefficients of friction, 0 allowed | nc | 1 |
/// | `bilateral` | `G`, `b` of FCLIB | n × p, p | |
///
/// Source: Acary, lecture, problems P_ML and P_ML_b; FCLIB `/fclib_global`.
#[derive(Debug, Clone, PartialEq)]
#[allow(non_snake_case)]
pub struct FrictionGlobal<const D: usize> {
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
    /// Bilateral constraints, if the problem has any.
    pub bilateral: Option<BilateralGlobal>,
}

/// The bilateral constraints `Gᵀ v + b = 0` of a [`FrictionGlobal`], with `G lambda` added to the dynamics.
#[derive(Debug, Clone, PartialEq)]
#[allow(non_snake_case)]
pub struct BilateralGlobal {
    /// n × p: transposed constraint Jacobian.
    pub G: Csc,
    /// p: given velocity of the constraints.
    pub b: Vec<f64>,
}

/// The unknown of a [`FrictionGlobal`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GlobalPoint {
    /// Generalised velocities, n, in m/s.
    pub v: Vec<f64>,
    /// Contact impulses, D·nc, in N·s.
    pub r: Vec<f64>,
    /// Multipliers of the bilateral constraints, p (empty without any).
    pub lambda: Vec<f64>,
}

#[allow(non_snake_case)]
impl<const D: usize> FrictionGlobal<D> {
    /// States a problem without bilateral constraints, validated.
    ///
    /// Errors: no contacts, a wrong shape, a value that is not finite, a negative `mu`; each names its entry.
    /// A singular M is found when it is factorised: by the judge ([`Problem::gauge`]) or by a solver.
    pub fn new(
        M: Csc,
        H: Csc,
        f: Vec<f64>,
        w: Vec<f64>,
        mu: Vec<f64>,
    ) -> Result<Self, ProblemError> {
        let problem = Self { M, H, f, w, mu, bilateral: None };
        problem.validate()?;
        Ok(problem)
    }

    /// nc.
    pub fn contacts(&self) -> usize {
        self.mu.len()
    }

    /// The number of degrees of freedom n.
    pub fn dofs(&self) -> usize {
        self.f.len()
    }

    /// The number of bilateral multipliers.
    pub fn multipliers(&self) -> usize {
        self.bilateral.as_ref().map_or(0, |b| b.b.len())
    }

    /// Checks shapes and values; the fields are public, so call it after changing them.
    pub fn validate(&self) -> Result<(), ProblemError> {
        const { assert!(D == 2 || D == 3, "contacts have 2 or 3 components") };
        let (n, nc) = (self.dofs(), self.contacts());
        if nc == 0 {
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
        friction_coefficients(&self.mu)?;
        if let Some(BilateralGlobal { G, b }) = &self.bilateral {
            G.check_shape("G", n, b.len(), "entries of f × entries of b")?;
            G.check_finite("G")?;
            all_finite("b", b)?;
        }
        Ok(())
    }

    /// `H r + f`, followed by `−b` where there are bilateral constraints: the right-hand side of
    /// [`Dynamics`].
    pub fn load(&self, r: &[f64], out: &mut [f64]) {
        let n = self.dofs();
        out[..n].copy_from_slice(&self.f);
        self.H.mul_add(1.0, r, &mut out[..n]);
        if let Some(b) = &self.bilateral {
            for (o, b) in out[n..].iter_mut().zip(&b.b) {
                *o = -b;
            }
        }
    }

    /// `u = Hᵀ v + w` into `u`.
    pub fn velocity_into(&self, v: &[f64], u: &mut [f64]) {
        u.copy_from_slice(&self.w);
        self.H.mul_transpose_add(1.0, v, u);
    }
}

/// The factorised dynamics of global problems that share M and G: r to `(v, lambda)`.
///
/// `[M, −G; Gᵀ, 0] (v, lambda) = (H r + f, −b)`, or `M v = H r + f` without bilateral constraints.
#[derive(Debug, Clone)]
#[allow(non_snake_case)]
pub struct Dynamics {
    /// `M⁻¹`, or the inverse of the bordered matrix.
    pub inverse: Inverse,
    M: Csc,
    G: Option<Csc>,
    state: Vec<f64>,
    scratch: Vec<f64>,
}

impl Dynamics {
    /// Factorises. Errors: a singular M, by the component at fault.
    pub fn new<const D: usize>(problem: &FrictionGlobal<D>) -> Result<Self, ProblemError> {
        let inverse = match &problem.bilateral {
            None => Inverse::new(&problem.M, "M")?,
            Some(b) => Inverse::saddle(&problem.M, &b.G)?,
        };
        Ok(Self {
            M: problem.M.clone(),
            G: problem.bilateral.as_ref().map(|b| b.G.clone()),
            state: vec![0.0; inverse.dim()],
            scratch: vec![0.0; inverse.scratch_len()],
            inverse,
        })
    }

    /// Whether `problem` has the matrices that were factorised. Cost: one comparison of M and G.
    pub fn serves<const D: usize>(&self, problem: &FrictionGlobal<D>) -> bool {
        self.M == problem.M && self.G.as_ref() == problem.bilateral.as_ref().map(|b| &b.G)
    }

    /// `(v, lambda)` for the impulses `r`, by one solve as refined as asked for; allocates nothing unless M has a component that is
    /// factorised sparsely.
    pub fn solve<const D: usize>(
        &mut self,
        problem: &FrictionGlobal<D>,
        r: &[f64],
        refine: Refine,
    ) -> (&[f64], &[f64]) {
        problem.load(r, &mut self.state);
        self.inverse.solve_with(&mut self.state, &mut self.scratch, refine);
        self.state.split_at(problem.dofs())
    }

    /// The velocities and multipliers for the impulses `r` in doubled precision: `high + low`, each n + p, and in `last` what is
    /// not known of them ([`Inverse::solve_doubled`]).
    pub fn solve_doubled<const D: usize>(
        &mut self,
        problem: &FrictionGlobal<D>,
        r: &[f64],
        [high, low, last]: [&mut [f64]; 3],
    ) {
        // H r + f and −b, each one sum in doubled precision.
        let n = problem.dofs();
        high[..n].copy_from_slice(&problem.f);
        let b = problem.bilateral.iter().flat_map(|b| &b.b);
        high[n..].iter_mut().zip(b).for_each(|(high, b)| *high = -b);
        low.fill(0.0);
        for (j, &rj) in r.iter().enumerate() {
            let (rows, values) = problem.H.column(j);
            for (&i, &v) in rows.iter().zip(values) {
                let mut sum = Compensated::parts(high[i], low[i]);
                sum.add_product(v, rj);
                (high[i], low[i]) = sum.into_parts();
            }
        }
        self.inverse.solve_doubled(high, low, last, &mut self.scratch);
    }

    /// The change of velocity `M⁻¹ H r` that the impulses alone bring about, the constraints kept.
    pub fn respond<const D: usize>(
        &mut self,
        problem: &FrictionGlobal<D>,
        r: &[f64],
        refine: Refine,
    ) -> &[f64] {
        let n = problem.dofs();
        self.state.fill(0.0);
        problem.H.mul_add(1.0, r, &mut self.state[..n]);
        self.inverse.solve_with(&mut self.state, &mut self.scratch, refine);
        &self.state[..n]
    }

    /// Completes `point` from its impulses.
    pub fn complete<const D: usize>(
        &mut self,
        problem: &FrictionGlobal<D>,
        point: &mut GlobalPoint,
    ) {
        let (v, lambda) = self.solve(problem, &point.r, Refine::Fully);
        point.v.copy_from_slice(v);
        point.lambda.copy_from_slice(lambda);
    }

    /// `q = Hᵀ v_free + w`, the relative velocity without impulses; and a certificate if the bilateral constraints
    /// contradict each other, so that no v satisfies `Gᵀ v + b = 0`.
    pub fn free_velocity<const D: usize>(
        &mut self,
        problem: &FrictionGlobal<D>,
        q: &mut [f64],
    ) -> Option<Impulses> {
        q.fill(0.0);
        let (v, _) = self.solve(problem, q, Refine::Fully);
        problem.velocity_into(v, q);
        let b = problem.bilateral.as_ref()?;
        let left = |j: usize| b.b[j] + b.G.column_dot(j, v);
        let violated = |j: usize| left(j).abs() > 1e-10 * (b.b[j].abs() + (left(j) - b.b[j]).abs());
        if !(0..b.b.len()).any(violated) {
            return None;
        }
        let mut residual = vec![0.0; v.len()];
        residual.extend((0..b.b.len()).map(left));
        self.inverse.null_direction(&mut residual);
        let multipliers = residual.split_off(problem.dofs());
        let r = vec![0.0; problem.w.len()];
        Impulses::toward(r, multipliers, &[], &b.b, |c| check::holds(problem, c))
    }
}

impl<const D: usize> Problem for FrictionGlobal<D> {
    type Point = GlobalPoint;
    type Gauge = check::GlobalGauge;

    fn kind(&self) -> Kind {
        if D == 2 { Kind::FrictionGlobal2d } else { Kind::FrictionGlobal3d }
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

    fn validate_point(&self, point: &GlobalPoint) -> Result<(), ProblemError> {
        vector("v", &point.v, self.dofs(), "degrees of freedom")?;
        vector("r", &point.r, D * self.contacts(), "components of the contacts")?;
        vector("lambda", &point.lambda, self.multipliers(), "bilateral constraints")
    }

    fn copy_point(from: &GlobalPoint, to: &mut GlobalPoint) {
        to.v.clone_from(&from.v);
        to.r.clone_from(&from.r);
        to.lambda.clone_from(&from.lambda);
    }

    fn gauge(&self) -> Result<Self::Gauge, ProblemError> {
        check::GlobalGauge::new(self)
    }

    fn regauge(&self, gauge: &mut Self::Gauge) -> Result<(), ProblemError> {
        gauge.refill(self)
    }

    fn measure(&self, point: &GlobalPoint, gauge: &mut Self::Gauge) -> Measure {
        gauge.measure(self, point, false)
    }

    fn certify(&self, point: &GlobalPoint, gauge: &mut Self::Gauge) -> Measure {
        gauge.measure(self, point, true)
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

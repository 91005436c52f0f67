//! The judge: how far a point is from solving a problem, computed from the problem's data alone.
//!
//! Nothing here is shared with a solver: products with W are written out plainly, the distance to the cone
//! comes from its definition, and a test confronts both with the solvers' kernels. The status that a user sees
//! is decided by [`Measure::passes`] at the `relative` residual.

mod certificate;
mod existence;
pub(crate) mod proof;
pub(crate) mod rows;
mod verdict;

pub use crate::kinds::complementarity::{HlcpGauge, LinearGauge, McpGauge, RowCounts, RowStatus};
pub use crate::kinds::contact::{
    ContactStatus, GlobalGauge, Impulses, Law, LocalGauge, Motion, friction_rows,
};
pub use crate::kinds::variational::{Held, SetCounts, SetStatus, ViGauge};
pub use certificate::Certificate;
pub use existence::{Existence, Kinematic, Kinematics};
pub use proof::{
    Case, Column, ConeSystem, Constraint, Entries, Evidence, Exact, ExactVector, Monotone, NEAR,
    Proof, Sector, rounded,
};
pub(crate) use proof::{Exactly, Relaxed, weigh};
pub use verdict::{Judged, StatusCounts, Verdict, VerdictOf};

use serde::Serialize;

/// The dynamics residual that always counts as rounding; see [`Measure::dynamics_rounding`].
pub const DYNAMICS_TOLERANCE: f64 = 1e-10;

/// The residuals of a point. With `x_c = w_c r_c`, `w_c = tr(W_cc)/D`, `ũ_c = u_c + mu‖u_T‖e_N`:
///
/// | field | formula |
/// | --- | --- |
/// | `absolute` | `‖(x_c − P_K(x_c − ũ_c))_c‖₂`, a velocity in m/s |
/// | `relative` | `absolute / ‖q‖₂`; **decides**. With q = 0, `absolute` itself |
/// | `literature` | `‖r − P_K(r − ũ)‖₂ / ‖q‖₂` (natural map with ρ = 1) |
/// | `siconos` | `‖r − P_K(r − ũ)‖₂ / max(‖q‖, ‖r‖, ‖u‖)` |
///
/// u is recomputed from r (for global problems through the dynamics, with `q = Hᵀ M⁻¹ f + w`). Where a contact's
/// `w_c` is not positive, the mean over the contacts stands in (1 if that is not positive either), so that
/// such a contact is still judged. Of linear complementarity problems `relative`, `primal`, `dual` and `complementarity` are componentwise errors; see [`LinearGauge`].
///
/// `primal` and, where mu ≤ 1, `dual` are at most `relative` in exact arithmetic and are tested beside it, because rounding can
/// hide one residual of a point with huge impulses, but not all three.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Measure {
    /// The unscaled residual in velocity units.
    pub absolute: f64,
    /// The unit-free residual that decides.
    pub relative: f64,
    /// The residual of the published campaigns.
    pub literature: f64,
    /// The residual that Siconos reports.
    pub siconos: f64,
    /// Infeasibility of the impulses: `‖(dist(x_c, K))_c‖ / ‖q‖`.
    pub primal: f64,
    /// Infeasibility of the velocities: `‖(dist(ũ_c, K*))_c‖ / ‖q‖`; of a contact with mu > 1 (mu_r > 1) by the cone and ũ of the same velocity with coefficients of 1, because K* is then nearly the whole
    /// space.
    pub dual: f64,
    /// Complementarity: `Σ |x_c · ũ_c| / ‖q‖²`.
    pub complementarity: f64,
    /// Global problems: `‖M v − H r − f − G λ‖ / max(‖f‖, ‖H r‖)`, the worse of the caller's v and the judge's own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dynamics: Option<f64>,
    /// Global problems: what of `dynamics` the rounding of v alone explains, `16 ε ‖|M||v| + |H||r| + |f| + |G||λ|‖` over the
    /// same scale. Large for stiff M, whose v no double holds exactly enough.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dynamics_rounding: Option<f64>,
    /// Global problems: `‖Hᵀ (v − v(r))‖ / ‖q‖`, the caller's v against the velocities that follow from r.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub velocity_gap: Option<f64>,
    /// Bilateral constraints: the largest violation of a constraint over the size of the terms that should cancel in it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bilateral: Option<f64>,
    /// Contacts, certified measurements only: the largest residual of one contact in units of its own, `max_c ‖φ_c‖ / min(‖(|q| + |W||r| + |V||λ|)_c‖, ω_c)` with its part
    /// φ_c of the natural map (or `max(0, −u_N − ε‖u_c‖)` over its normal terms alone, if larger: under much friction a velocity into the obstacle is near K*): a contact that nothing
    /// solves does not hide behind larger ones, whatever its scale. ω_c is the largest load that reaches the contact, in its unit: impulses that run away excuse
    /// nothing (docs/notation.md). The limit is the root of the tolerance: half of the digits, because a contact with a small load gets no more than
    /// its share of the work. Islands of contacts without load are left out: r = 0 solves them, and what is there is noise. For global
    /// problems the terms are `|w| + |H|ᵀ|M⁻¹|(|f| + |H||r| + |G||λ|)`; in a large component of M (finite elements), whose inverse nobody
    /// knows, `|w| + |H|ᵀ|v|` and the bound by Cauchy and Schwarz on `|W||r|`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub own: Option<f64>,
    /// The contact that `own` is of.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub own_contact: Option<usize>,
    /// Contacts, certified measurements only: what the rounding of r (and λ, v) to doubles makes of the residual in the root mean
    /// square, over `‖q‖`. No solver can be expected to get below it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub floor: Option<f64>,
    /// The contact with the largest share in `absolute`; the row with the largest error.
    pub worst_contact: usize,
    /// That contact's share, over `‖q‖`; that row's error.
    pub worst: f64,
}

/// The name of the criterion that comes first.
pub const RELATIVE: &str = "relative residual";
/// Those of its parts.
const PARTS: [&str; 2] = ["primal", "dual"];
/// The name of the criterion of each contact by its own terms.
pub const OWN: &str = "own residual of a contact or row";

/// A criterion that a point does not meet.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Failing {
    /// The criterion's name.
    pub what: &'static str,
    /// Its value; NaN where the point is not finite.
    pub value: f64,
    /// What it may be at most.
    pub limit: f64,
}

impl Measure {
    /// The residuals of a point that nobody has looked at: none of them passes, each is worse than any other.
    pub fn unknown() -> Self {
        let never = f64::INFINITY;
        Self {
            absolute: never,
            relative: never,
            literature: never,
            siconos: never,
            primal: never,
            dual: never,
            complementarity: never,
            dynamics: None,
            dynamics_rounding: None,
            velocity_gap: None,
            bilateral: None,
            own: None,
            own_contact: None,
            floor: None,
            worst_contact: 0,
            worst: never,
        }
    }

    /// The residuals of a point at which the problem has no value: worse than any other, and still numbers, so that a solver may go on from there.
    pub(crate) fn never() -> Self {
        let never = f64::MAX;
        Self {
            absolute: never,
            relative: never,
            literature: never,
            siconos: never,
            primal: never,
            dual: never,
            complementarity: never,
            worst: never,
            ..Self::unknown()
        }
    }

    /// The criteria: what, value, limit at `tolerance`.
    fn criteria(&self, tolerance: f64) -> impl Iterator<Item = Failing> {
        let rounding = self.dynamics_rounding.unwrap_or(0.0).max(DYNAMICS_TOLERANCE);
        [
            (RELATIVE, Some(self.relative), tolerance),
            (PARTS[0], Some(self.primal), tolerance),
            (PARTS[1], Some(self.dual), tolerance),
            ("bilateral constraints", self.bilateral, tolerance),
            (OWN, self.own, tolerance.sqrt()),
            ("velocities", self.velocity_gap, tolerance),
            ("dynamics", self.dynamics, rounding),
        ]
        .into_iter()
        .filter_map(|(what, value, limit)| Some(Failing { what, value: value?, limit }))
    }

    /// Whether a contact's own residual is all that fails.
    pub fn fails_own_only(&self, tolerance: f64) -> bool {
        let mut failing =
            self.criteria(tolerance).filter(|c| !matches!(c.value, v if v <= c.limit));
        failing.next().is_some_and(|c| c.what == OWN) && failing.next().is_none()
    }

    /// The decision: every criterion within its limit.
    pub fn passes(&self, tolerance: f64) -> bool {
        self.criteria(tolerance).all(|c| c.value <= c.limit)
    }

    /// The criteria that are not met; empty exactly where the point [`passes`](Self::passes).
    pub fn failing(&self, tolerance: f64) -> Vec<Failing> {
        // A NaN is not within any limit.
        self.criteria(tolerance).filter(|c| c.value.is_nan() || c.value > c.limit).collect()
    }

    /// Whether the relative residual is beyond the tolerance, and what else fails. Where it is, primal and dual residuals are only parts of it, and are left out.
    pub fn failing_beside(&self, tolerance: f64) -> (bool, Vec<Failing>) {
        let (relative, mut others): (Vec<_>, Vec<_>) =
            self.failing(tolerance).into_iter().partition(|f| f.what == RELATIVE);
        let relative = !relative.is_empty();
        others.retain(|f| !(relative && PARTS.contains(&f.what)));
        (relative, others)
    }

    /// One number to compare two points of the same problem: the largest of the values that are compared with the
    /// tolerance, with the dynamics where they exceed rounding; infinite where a value is NaN. `own` is not among them: it says
    /// whether the smallest contact is done, not how far the problem is.
    pub fn merit(&self) -> f64 {
        self.criteria(0.0).filter(|c| c.what != OWN).fold(0.0, |merit, c| match c.value {
            v if v.is_nan() => f64::INFINITY,
            v if c.limit > 0.0 && v <= c.limit => merit,
            v => merit.max(v),
        })
    }

    /// Whether this point is the better one of two of the same problem, by [`merit`](Self::merit); among equals by `absolute`.
    pub fn is_better_than(&self, other: &Self) -> bool {
        let (here, there) = (self.merit(), other.merit());
        here < there || (here == there && self.absolute < other.absolute)
    }
}

/// `a / b`, or `a` itself where `b` is zero: a residual with nothing to scale by is absolute.
pub(crate) fn over(a: f64, b: f64) -> f64 {
    if b > 0.0 { a / b } else { a }
}

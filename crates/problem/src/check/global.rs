//! The judge of the global problem.

use super::local::{LawGauge, ROUNDING, worst};
use super::rows::Rows;
use super::{Measure, over};
use crate::linalg::{Csc, Delassus, Inverse, Refine, norm, small};
use crate::{Dynamics, FrictionGlobal, GlobalPoint, ProblemError};

/// The judge's constants and buffers for a [`FrictionGlobal`]: among them its own factorisation of the dynamics.
#[derive(Debug, Clone)]
pub struct GlobalGauge {
    pub(super) law: LawGauge,
    dynamics: Dynamics,
    /// `M⁻¹` alone and its scratch, where bilateral constraints border the dynamics.
    free: Option<(Inverse, Vec<f64>)>,
    /// w_c belongs to this H.
    h: Csc,
    u: Vec<f64>,
    buffer: Vec<f64>,
    rows: Rows,
}

impl GlobalGauge {
    pub(crate) fn new<const D: usize>(problem: &FrictionGlobal<D>) -> Result<Self, ProblemError> {
        let dynamics = Dynamics::new(problem)?;
        // W = Hᵀ M⁻¹ H and q = Hᵀ M⁻¹ f + w are those of the free dynamics, with bilateral rows apart.
        let free = match problem.bilateral {
            Some(_) => {
                let free = Inverse::new(&problem.M, "M")?;
                let scratch = vec![0.0; free.scratch_len()];
                Some((free, scratch))
            }
            None => None,
        };
        let inverse = free.as_ref().map_or(&dynamics.inverse, |f| &f.0);
        let diagonal = Delassus::<D>::diagonal(&problem.H, inverse);
        let mut gauge = Self {
            law: LawGauge::new(diagonal.iter().map(small::mean_diagonal)),
            dynamics,
            free,
            h: problem.H.clone(),
            u: vec![0.0; problem.w.len()],
            buffer: vec![0.0; problem.dofs()],
            rows: Rows::default(),
        };
        gauge.rescale(problem);
        // The longest use of the rows, so that a measurement allocates nothing.
        let longest = problem.dofs().max(problem.w.len()).max(problem.multipliers());
        gauge.rows.start(&vec![0.0; longest]);
        Ok(gauge)
    }

    pub(crate) fn refill<const D: usize>(
        &mut self,
        problem: &FrictionGlobal<D>,
    ) -> Result<(), ProblemError> {
        if self.dynamics.serves(problem) && self.h == problem.H {
            self.rescale(problem);
        } else {
            *self = Self::new(problem)?;
        }
        Ok(())
    }

    /// `‖q‖` from the present f and w.
    fn rescale<const D: usize>(&mut self, problem: &FrictionGlobal<D>) {
        match &mut self.free {
            None => {
                let _ = self.dynamics.free_velocity(problem, &mut self.u);
            }
            Some((free, scratch)) => {
                self.buffer.copy_from_slice(&problem.f);
                free.solve_with(&mut self.buffer, scratch, Refine::Fully);
                problem.velocity_into(&self.buffer, &mut self.u);
            }
        }
        self.law.norm_q = norm(&self.u);
    }

    pub(crate) fn measure<const D: usize>(
        &mut self,
        problem: &FrictionGlobal<D>,
        point: &GlobalPoint,
        precisely: bool,
    ) -> Measure {
        let Self { law, dynamics, u, buffer, rows, .. } = self;
        rows.precisely(precisely);
        rows.start_at_zero(problem.dofs());
        rows.add(1.0, &problem.H, &point.r);
        let force = norm(&problem.f).max(rows.norm());
        let given = imbalance(problem, &point.v, &point.r, &point.lambda, force, rows);
        let (v, lambda) = dynamics.solve(problem, &point.r, Refine::Fully);
        let own = imbalance(problem, v, &point.r, lambda, force, rows);
        rows.start(&problem.w);
        rows.add_transposed(&problem.H, v);
        u.iter_mut().zip(rows.values()).for_each(|(u, x)| *u = x);
        let mut measure = law.measure::<D>(&point.r, u, &problem.mu);

        let worse = |a: f64, b: f64| if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) };
        measure.dynamics = Some(worse(given.residual, own.residual));
        measure.dynamics_rounding = Some(given.rounding.max(own.rounding));
        for ((gap, a), b) in buffer.iter_mut().zip(&point.v).zip(v) {
            *gap = a - b;
        }
        rows.start_at_zero(problem.w.len());
        rows.add_transposed(&problem.H, buffer);
        measure.velocity_gap = Some(over(rows.norm(), law.norm_q));

        if let Some(b) = &problem.bilateral {
            // |Gᵀ v + b| against its terms, or against what velocities of a typical size would make of them.
            let typical = point.v.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            rows.start(&b.b);
            rows.add_transposed(&b.G, &point.v);
            let shares = rows.values().zip(rows.sizes()).enumerate().map(|(j, (sum, size))| {
                let weight: f64 = b.G.column(j).1.iter().map(|g| g.abs()).sum();
                (sum, size + ROUNDING * typical * weight)
            });
            measure.bilateral = Some(worst(shares));
        }
        measure
    }

    /// The velocity of the last point measured.
    pub(super) fn velocity(&self) -> &[f64] {
        &self.u
    }
}

/// The residual of the dynamics and what of it the rounding of v explains.
struct Imbalance {
    residual: f64,
    rounding: f64,
}

/// `‖M v − H r − f − G λ‖` over `force = max(‖f‖, ‖H r‖)`.
fn imbalance<const D: usize>(
    problem: &FrictionGlobal<D>,
    v: &[f64],
    r: &[f64],
    lambda: &[f64],
    force: f64,
    rows: &mut Rows,
) -> Imbalance {
    rows.start(&problem.f);
    rows.add(1.0, &problem.H, r);
    if let Some(b) = &problem.bilateral {
        rows.add(1.0, &b.G, lambda);
    }
    rows.add(-1.0, &problem.M, v);
    Imbalance {
        residual: over(rows.norm(), force),
        rounding: over(16.0 * f64::EPSILON * norm(rows.sizes()), force),
    }
}

//! The judge of the global problem.

use super::local::LawGauge;
use super::{Measure, over};
use crate::linalg::{Csc, Delassus, Inverse, norm, small};
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
    constraint: Vec<f64>,
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
            constraint: vec![0.0; problem.multipliers()],
        };
        gauge.rescale(problem);
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
            None => self.dynamics.free_velocity(problem, &mut self.u),
            Some((free, scratch)) => {
                self.buffer.copy_from_slice(&problem.f);
                free.solve_with(&mut self.buffer, scratch);
                problem.velocity_into(&self.buffer, &mut self.u);
            }
        }
        self.law.norm_q = norm(&self.u);
    }

    pub(crate) fn measure<const D: usize>(
        &mut self,
        problem: &FrictionGlobal<D>,
        point: &GlobalPoint,
    ) -> Measure {
        let given = imbalance(problem, &point.v, &point.r, &point.lambda, &mut self.buffer);
        let (v, lambda) = self.dynamics.solve(problem, &point.r);
        let own = imbalance(problem, v, &point.r, lambda, &mut self.buffer);
        problem.velocity_into(v, &mut self.u);
        let mut measure = self.law.measure::<D>(&point.r, &self.u, &problem.mu);
        let dynamics = if given.is_nan() || own.is_nan() { f64::NAN } else { given.max(own) };
        measure.dynamics = Some(dynamics);

        if let Some(b) = &problem.bilateral {
            // Gᵀ v + b against the size of its terms, for the caller's v.
            let c = &mut self.constraint;
            c.copy_from_slice(&b.b);
            b.G.mul_transpose_add(1.0, &point.v, c);
            let violation = norm(c);
            for (j, c) in c.iter_mut().enumerate() {
                let (rows, values) = b.G.column(j);
                *c = rows.iter().zip(values).map(|(&i, g)| (g * point.v[i]).abs()).sum();
            }
            measure.bilateral = Some(over(violation, norm(c).max(norm(&b.b))));
        }
        measure
    }

    /// The velocity of the last point measured.
    pub(super) fn velocity(&self) -> &[f64] {
        &self.u
    }
}

/// `‖M v − H r − f − G λ‖ / max(‖f‖, ‖H r‖)`.
fn imbalance<const D: usize>(
    problem: &FrictionGlobal<D>,
    v: &[f64],
    r: &[f64],
    lambda: &[f64],
    buffer: &mut [f64],
) -> f64 {
    buffer.fill(0.0);
    problem.H.mul_add(1.0, r, buffer);
    let scale = norm(&problem.f).max(norm(buffer));
    for (b, f) in buffer.iter_mut().zip(&problem.f) {
        *b += f;
    }
    if let Some(b) = &problem.bilateral {
        b.G.mul_add(1.0, lambda, buffer);
    }
    problem.M.mul_add(-1.0, v, buffer);
    over(norm(buffer), scale)
}

//! The judge of the global problem.

use super::local::LawGauge;
use super::{Measure, over};
use crate::linalg::{Delassus, Inverse, norm, small};
use crate::{FrictionGlobal, GlobalPoint, ProblemError};

/// The judge's constants and buffers for a [`FrictionGlobal`]: among them its own factorisation of the dynamics.
#[derive(Debug, Clone)]
pub struct GlobalGauge {
    pub(super) law: LawGauge,
    dynamics: Inverse,
    scratch: Vec<f64>,
    /// `(v, λ)` that follow from r.
    state: Vec<f64>,
    u: Vec<f64>,
    buffer: Vec<f64>,
    constraint: Vec<f64>,
}

impl GlobalGauge {
    pub(crate) fn new<const D: usize>(problem: &FrictionGlobal<D>) -> Result<Self, ProblemError> {
        let (n, p, m) = (problem.dofs(), problem.multipliers(), problem.w.len());
        let dynamics = problem.dynamics()?;
        // W = Hᵀ M⁻¹ H and q = Hᵀ M⁻¹ f + w are those of the free dynamics, with bilateral rows apart.
        let free = if p > 0 { &Inverse::new(&problem.M, "M")? } else { &dynamics };
        let mut v = problem.f.clone();
        free.solve(&mut v);
        let mut q = vec![0.0; m];
        problem.velocity_into(&v, &mut q);
        let delassus = Delassus::<D>::new(&problem.H, free);
        let mut law = LawGauge::default();
        law.refill(
            (0..problem.contacts()).map(|c| small::mean_diagonal(&delassus.diagonal_block(c))),
            norm(&q),
        );
        Ok(Self {
            law,
            scratch: vec![0.0; dynamics.scratch_len()],
            dynamics,
            state: vec![0.0; n + p],
            u: vec![0.0; m],
            buffer: vec![0.0; n],
            constraint: vec![0.0; p],
        })
    }

    pub(crate) fn measure<const D: usize>(
        &mut self,
        problem: &FrictionGlobal<D>,
        point: &GlobalPoint,
    ) -> Measure {
        let n = problem.dofs();
        problem.load(&point.r, &mut self.state);
        self.dynamics.solve_with(&mut self.state, &mut self.scratch);
        problem.velocity_into(&self.state[..n], &mut self.u);
        let mut measure = self.law.measure::<D>(&point.r, &self.u, &problem.mu);

        let given = imbalance(problem, &point.v, &point.r, &point.lambda, &mut self.buffer);
        let (own_v, own_lambda) = self.state.split_at(n);
        let own = imbalance(problem, own_v, &point.r, own_lambda, &mut self.buffer);
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

//! The judge of the local problem.

use super::contact::{distance_to_cone, distance_to_dual, modified_velocity, natural_map};
use super::{Measure, over};
use crate::linalg::{norm, small};
use crate::{FrictionLocal, LocalPoint};

/// The judge's constants and buffers for a [`FrictionLocal`].
#[derive(Debug, Clone)]
pub struct LocalGauge {
    pub(super) law: LawGauge,
    u: Vec<f64>,
    constraint: Vec<f64>,
}

impl LocalGauge {
    pub(crate) fn new<const D: usize>(problem: &FrictionLocal<D>) -> Self {
        let mut gauge = Self { law: LawGauge::default(), u: Vec::new(), constraint: Vec::new() };
        gauge.refill(problem);
        gauge
    }

    pub(crate) fn refill<const D: usize>(&mut self, problem: &FrictionLocal<D>) {
        let diagonal =
            (0..problem.contacts()).map(|c| small::mean_diagonal(&problem.W.diagonal_block(c)));
        self.law.refill(diagonal, norm(&problem.q));
        self.u.resize(problem.q.len(), 0.0);
        self.constraint.resize(problem.multipliers(), 0.0);
    }

    pub(crate) fn measure<const D: usize>(
        &mut self,
        problem: &FrictionLocal<D>,
        point: &LocalPoint,
    ) -> Measure {
        self.update_velocity(problem, point);
        let mut measure = self.law.measure::<D>(&point.r, &self.u, &problem.mu);
        if let Some(b) = &problem.bilateral {
            // Vᵀ r + R λ + s, against the size of its terms.
            let c = &mut self.constraint;
            c.copy_from_slice(&b.s);
            b.V.mul_transpose_add(1.0, &point.r, c);
            b.R.mul_add(1.0, &point.lambda, c);
            let violation = norm(c);
            let mut size = norm(&b.s);
            c.fill(0.0);
            b.V.mul_transpose_add(1.0, &point.r, c);
            size = size.max(norm(c));
            c.fill(0.0);
            b.R.mul_add(1.0, &point.lambda, c);
            measure.bilateral = Some(over(violation, size.max(norm(c))));
        }
        measure
    }

    /// The velocity of the last point measured.
    pub(super) fn velocity(&self) -> &[f64] {
        &self.u
    }

    /// `u = W r + V λ + q`, block by block, without the solvers' kernels.
    fn update_velocity<const D: usize>(&mut self, problem: &FrictionLocal<D>, point: &LocalPoint) {
        for i in 0..problem.contacts() {
            let (cols, blocks) = problem.W.row(i);
            let mut sum: [f64; D] = small::block(&problem.q, i);
            for (&j, b) in cols.iter().zip(blocks) {
                let rj: [f64; D] = small::block(&point.r, j as usize);
                let y = small::mul(b, &rj);
                for k in 0..D {
                    sum[k] += y[k];
                }
            }
            self.u[D * i..D * i + D].copy_from_slice(&sum);
        }
        if let Some(b) = &problem.bilateral {
            b.V.mul_add(1.0, &point.lambda, &mut self.u);
        }
    }
}

/// What the contact law's residual needs of a problem: `w_c` and `‖q‖`.
#[derive(Debug, Clone, Default)]
pub(super) struct LawGauge {
    pub(super) w: Vec<f64>,
    pub(super) norm_q: f64,
}

impl LawGauge {
    pub(super) fn new(diagonal: impl Iterator<Item = f64>) -> Self {
        let mut gauge = Self::default();
        gauge.refill(diagonal, 0.0);
        gauge
    }

    pub(super) fn refill(&mut self, diagonal: impl Iterator<Item = f64>, norm_q: f64) {
        self.norm_q = norm_q;
        self.w.clear();
        self.w.extend(diagonal);
        let mean = self.w.iter().sum::<f64>() / self.w.len().max(1) as f64;
        let stand_in = if mean > 0.0 { mean } else { 1.0 };
        for w in &mut self.w {
            if *w <= 0.0 {
                *w = stand_in;
            }
        }
    }

    pub(super) fn measure<const D: usize>(&self, r: &[f64], u: &[f64], mu: &[f64]) -> Measure {
        let square = |x: &[f64; D]| x.iter().map(|v| v * v).sum::<f64>();
        let (mut scaled, mut plain) = (0.0, 0.0);
        let (mut primal, mut dual, mut complementarity) = (0.0, 0.0, 0.0);
        let (mut worst_contact, mut worst) = (0, -1.0);
        for (c, (&mu, &w)) in mu.iter().zip(&self.w).enumerate() {
            let rc: [f64; D] = small::block(r, c);
            let x = rc.map(|v| w * v);
            let modified = modified_velocity::<D>(&small::block(u, c), mu);
            let share = square(&natural_map(&x, &modified, mu));
            if share > worst || share.is_nan() {
                (worst_contact, worst) = (c, share);
            }
            scaled += share;
            plain += square(&natural_map(&rc, &modified, mu));
            primal += distance_to_cone(&x, mu).powi(2);
            dual += distance_to_dual(&modified, mu).powi(2);
            complementarity += x.iter().zip(&modified).map(|(a, b)| a * b).sum::<f64>().abs();
        }
        let (absolute, plain, q) = (scaled.sqrt(), plain.sqrt(), self.norm_q);
        Measure {
            absolute,
            relative: over(absolute, q),
            paper: over(plain, q),
            peer: over(plain, q.max(norm(r)).max(norm(u))),
            primal: over(primal.sqrt(), q),
            dual: over(dual.sqrt(), q),
            complementarity: over(over(complementarity, q), q),
            dynamics: None,
            bilateral: None,
            worst_contact,
            worst: over(worst.sqrt(), q),
        }
    }
}

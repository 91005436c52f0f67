//! The judge of the local problem.

use super::contact::{distance_to_cone, distance_to_dual, modified_velocity, natural_map};
use super::rows::Rows;
use super::{Measure, over};
use crate::linalg::{Compensated, norm, small};
use crate::{FrictionLocal, LocalPoint};

/// The judge's constants and buffers for a [`FrictionLocal`].
#[derive(Debug, Clone)]
pub struct LocalGauge {
    pub(super) law: LawGauge,
    u: Vec<f64>,
    rows: Rows,
}

impl LocalGauge {
    pub(crate) fn new<const D: usize>(problem: &FrictionLocal<D>) -> Self {
        let mut gauge = Self { law: LawGauge::default(), u: Vec::new(), rows: Rows::default() };
        gauge.refill(problem);
        gauge
    }

    pub(crate) fn refill<const D: usize>(&mut self, problem: &FrictionLocal<D>) {
        let diagonal =
            (0..problem.contacts()).map(|c| small::mean_diagonal(&problem.W.diagonal_block(c)));
        self.law.refill(diagonal, norm(&problem.q));
        self.u.resize(problem.q.len(), 0.0);
        // Both uses of the rows, so that a measurement allocates nothing.
        self.rows.start(&self.u);
    }

    /// The residuals; `precisely` with the products in doubled precision.
    pub(crate) fn measure<const D: usize>(
        &mut self,
        problem: &FrictionLocal<D>,
        point: &LocalPoint,
        precisely: bool,
    ) -> Measure {
        if precisely {
            self.update_velocity(
                problem,
                point,
                Compensated::from,
                |sum, a, b| {
                    sum.add_product(a, b);
                },
                Compensated::value,
            );
        } else {
            self.update_velocity(problem, point, |x| x, |sum, a, b| *sum += a * b, |sum| sum);
        }
        if let Some(b) = &problem.bilateral {
            self.rows.start(&self.u);
            self.rows.add(1.0, &b.V, &point.lambda);
            self.u.iter_mut().zip(self.rows.values()).for_each(|(u, v)| *u = v);
        }
        let mut measure = self.law.measure::<D>(&point.r, &self.u, &problem.mu);
        measure.bilateral = self.violation(problem, point);
        measure
    }

    /// The largest `|(Vᵀ r + R λ + s)_j|` over the size of its terms. A constraint whose terms are all rounding is compared
    /// with the others, in units of `√R_jj`, instead of with itself.
    fn violation<const D: usize>(
        &mut self,
        problem: &FrictionLocal<D>,
        point: &LocalPoint,
    ) -> Option<f64> {
        let b = problem.bilateral.as_ref()?;
        self.rows.start(&b.s);
        self.rows.add_transposed(&b.V, &point.r);
        self.rows.add(1.0, &b.R, &point.lambda);
        let unit = |j: usize| match b.R.get(j, j).abs().sqrt() {
            d if d > 0.0 => d,
            _ => 1.0,
        };
        let sizes = self.rows.sizes();
        let typical = (0..sizes.len()).fold(0.0_f64, |m, j| m.max(sizes[j] / unit(j)));
        let shares = self.rows.values().zip(sizes).enumerate();
        Some(worst(shares.map(|(j, (sum, size))| (sum, size + ROUNDING * typical * unit(j)))))
    }

    /// The velocity of the last point measured.
    pub(super) fn velocity(&self) -> &[f64] {
        &self.u
    }

    /// `u = W r + q`, entry by entry, without the solvers' kernels.
    fn update_velocity<const D: usize, S: Copy>(
        &mut self,
        problem: &FrictionLocal<D>,
        point: &LocalPoint,
        start: impl Fn(f64) -> S,
        add: impl Fn(&mut S, f64, f64),
        end: impl Fn(S) -> f64,
    ) {
        for i in 0..problem.contacts() {
            let (cols, blocks) = problem.W.row(i);
            let mut sum = small::block::<D>(&problem.q, i).map(&start);
            for (&j, b) in cols.iter().zip(blocks) {
                for k in 0..D {
                    for l in 0..D {
                        add(&mut sum[k], b[k][l], point.r[D * j as usize + l]);
                    }
                }
            }
            self.u[D * i..D * i + D].copy_from_slice(&sum.map(&end));
        }
    }
}

/// A term smaller than this share of its like may be rounding.
pub(super) const ROUNDING: f64 = 1e-3;

/// The largest ratio of violation to size, infinite if any is NaN.
pub(super) fn worst(shares: impl Iterator<Item = (f64, f64)>) -> f64 {
    shares.fold(0.0, |worst: f64, (violation, size)| match over(violation.abs(), size) {
        share if share.is_nan() => f64::INFINITY,
        share => worst.max(share),
    })
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

    /// All sums of squares are taken in units of their scale, so that none leaves the range of double precision
    /// before the data do.
    pub(super) fn measure<const D: usize>(&self, r: &[f64], u: &[f64], mu: &[f64]) -> Measure {
        let q = self.norm_q;
        let unit = if q > 0.0 { q } else { 1.0 };
        let plain_unit = match q.max(norm(r)).max(norm(u)) {
            largest if largest > 0.0 => largest,
            _ => 1.0,
        };
        let square = |x: &[f64; D], unit: f64| x.iter().map(|v| (v / unit).powi(2)).sum::<f64>();
        let (mut scaled, mut plain) = (0.0, 0.0);
        let (mut primal, mut dual, mut complementarity) = (0.0, 0.0, 0.0);
        let (mut worst_contact, mut worst) = (0, -1.0);
        for (c, (&mu, &w)) in mu.iter().zip(&self.w).enumerate() {
            let rc: [f64; D] = small::block(r, c);
            let x = rc.map(|v| w * v);
            let modified = modified_velocity::<D>(&small::block(u, c), mu);
            let share = square(&natural_map(&x, &modified, mu), unit);
            if share > worst || share.is_nan() {
                (worst_contact, worst) = (c, share);
            }
            scaled += share;
            plain += square(&natural_map(&rc, &modified, mu), plain_unit);
            primal += (distance_to_cone(&x, mu) / unit).powi(2);
            dual += (distance_to_dual(&modified, mu) / unit).powi(2);
            let product = |(a, b): (&f64, &f64)| (a / unit) * (b / unit);
            complementarity += x.iter().zip(&modified).map(product).sum::<f64>().abs();
        }
        let plain = plain.sqrt();
        Measure {
            absolute: scaled.sqrt() * unit,
            relative: scaled.sqrt(),
            paper: plain * plain_unit / unit,
            peer: plain,
            primal: primal.sqrt(),
            dual: dual.sqrt(),
            complementarity,
            worst_contact,
            worst: worst.sqrt(),
            ..Measure::unknown()
        }
    }
}

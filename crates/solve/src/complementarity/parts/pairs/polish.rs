//! From a guess which variables are positive to a solution at rounding level.
//!
//! Active are the pairs with `x > s`. The equations with `s_A = 0`, `x_Ā = 0` are solved by steps of the proximal point method (`K + δ` factorised once, residuals
//! in doubled precision), so a singular `M_AA`, whose solutions are many, is no obstacle: the one nearest to the iterate is found. Signs that come out
//! wrong are exchanged and the equations solved again, a few times: Newton's method for `min(x, s) = 0` from a good start. The best point met counts.

use nonsmooth_linalg::Compensated;

use super::newton::Newton;
use super::scale::Scaled;

/// Sets of active pairs that are tried.
const ROUNDS: usize = 6;
/// Steps of the proximal point method for each.
const STEPS: usize = 12;
/// δ
const SHIFT: f64 = 1e-11;
/// A residual that counts as rounding.
const EXACT: f64 = 2e-15;

/// The workspace, and the best point found, in scaled units.
#[derive(Debug, Default)]
pub struct Polish {
    /// z
    pub z: Vec<f64>,
    /// s
    pub s: Vec<f64>,
    now: (Vec<f64>, Vec<f64>),
    active: Vec<bool>,
    r: Vec<f64>,
    sums: Vec<Compensated>,
}

/// What came of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Polished {
    /// The residual, see [`Scaled::merit`].
    pub merit: f64,
    /// It is rounding.
    pub exact: bool,
}

impl Polish {
    /// Polishes the iterate (z, s). `alpha`, `beta` and `t` are overwritten.
    #[allow(clippy::too_many_arguments)]
    pub fn run(
        &mut self,
        scaled: &mut Scaled,
        newton: &mut Newton,
        z: &[f64],
        s: &[f64],
        alpha: &mut [f64],
        beta: &mut [f64],
        t: &mut [f64],
    ) -> Polished {
        let free = scaled.free;
        let (n, m) = (z.len(), s.len());
        self.r.resize(n, 0.0);
        self.active.clear();
        self.active.extend(z[free..].iter().zip(s).map(|(x, s)| x > s));
        for (to, from) in [(&mut self.now.0, z), (&mut self.now.1, s)] {
            to.clear();
            to.extend_from_slice(from);
        }
        for (to, len) in [(&mut self.z, n), (&mut self.s, m)] {
            to.resize(len, 0.0);
        }
        let mut best = Polished { merit: f64::INFINITY, exact: false };
        for _ in 0..ROUNDS {
            alpha[..free].fill(1.0);
            beta[..free].fill(0.0);
            for (k, &active) in self.active.iter().enumerate() {
                (alpha[free + k], beta[free + k]) = if active { (1.0, 0.0) } else { (0.0, 1.0) };
            }
            if newton.factorise(scaled, alpha, beta, SHIFT).is_err() {
                break;
            }
            let error = self.solve(scaled, newton, t);
            let flips = self.flips(free, error);
            let merit = self.clipped_merit(scaled, free);
            if merit < best.merit {
                best.merit = merit;
                self.z.copy_from_slice(&self.now.0);
                self.s.copy_from_slice(&self.now.1);
            }
            if merit <= EXACT || flips == 0 {
                best.exact = best.merit <= EXACT;
                break;
            }
        }
        best
    }

    /// Solves the equations of the active set; the largest residual that is left.
    fn solve(&mut self, scaled: &Scaled, newton: &mut Newton, t: &mut [f64]) -> f64 {
        let free = scaled.free;
        let Self { now: (z, s), active, r, sums, .. } = self;
        for (k, &active) in active.iter().enumerate() {
            if active {
                s[k] = 0.0;
            } else {
                z[free + k] = 0.0;
            }
        }
        let mut last = f64::INFINITY;
        for step in 0..=STEPS {
            scaled.residual_precisely(z, s, r, sums);
            if scaled.slack.is_none() {
                for (k, &active) in active.iter().enumerate() {
                    if !active {
                        // s is what the equation makes of z.
                        s[k] += r[free + k];
                        r[free + k] = 0.0;
                    }
                }
            }
            let error = r.iter().fold(0.0_f64, |l, r| l.max(r.abs()));
            if error == 0.0 || step == STEPS || (step > 2 && error > 0.7 * last) || error.is_nan() {
                return error;
            }
            last = error;
            t.iter_mut().zip(r.iter()).for_each(|(t, r)| *t = -r);
            newton.solve_once(t);
            if t.iter().any(|t| !t.is_finite()) {
                return error;
            }
            z[..free].iter_mut().zip(t.iter()).for_each(|(z, t)| *z += t);
            for (k, &active) in active.iter().enumerate() {
                if active {
                    z[free + k] += t[free + k];
                } else if scaled.slack.is_some() {
                    s[k] -= t[k];
                }
            }
        }
        last
    }

    /// Exchanges the pairs whose sign is wrong; how many.
    fn flips(&mut self, free: usize, error: f64) -> usize {
        let (z, s) = &self.now;
        let mut flips = 0;
        for (k, active) in self.active.iter_mut().enumerate() {
            let value = if *active { z[free + k] } else { s[k] };
            if value < -4.0 * error {
                *active = !*active;
                flips += 1;
            }
        }
        flips
    }

    /// The merit of the point with its wrong signs cut off.
    fn clipped_merit(&mut self, scaled: &mut Scaled, free: usize) -> f64 {
        let Self { now: (z, s), r, sums, .. } = self;
        z[free..].iter_mut().chain(s.iter_mut()).for_each(|x| *x = x.max(0.0));
        scaled.residual_precisely(z, s, r, sums);
        scaled.merit(z, s, r)
    }
}

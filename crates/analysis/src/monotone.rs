//! Monotonicity of a nonlinear problem's F on its box, by samples: a pair of points refutes it, none proves it.

use nonsmooth_linalg::budget;
use nonsmooth_problem::Mcp;
use nonsmooth_problem::field::Evaluator;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde::Serialize;

/// What pairs of points of the box say of F. It is monotone where `(x − y)ᵀ(F(x) − F(y)) ≥ 0` for all pairs, and a P₀-function where each pair of different points
/// has an i with `x_i ≠ y_i` and `(x_i − y_i)(F_i(x) − F_i(y)) ≥ 0`.
///
/// A sum is negative only where it is so by more than a thousand roundings of its terms.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sampled {
    /// Pairs at both points of which F is defined.
    pub pairs: usize,
    /// Pairs at which it is not.
    pub undefined: usize,
    /// A pair that shows that F is not monotone.
    pub not_monotone: Option<Apart>,
    /// A pair that shows that F is no P₀-function.
    pub not_p0: Option<Apart>,
}

/// Two points of the box.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Apart {
    /// x
    pub x: Vec<f64>,
    /// y
    pub y: Vec<f64>,
}

/// Pairs of which a few are asked for at once are found by this many tries each.
const TRIES: usize = 4;

/// Roundings that a sum may lose.
const ROUNDING: f64 = 1000.0 * f64::EPSILON;

impl Sampled {
    /// So many pairs, with points about the start and, where both bounds are finite, anywhere between them; a quarter of the pairs differ in one variable, one in
    /// some, one in all, and one along the direction in which `½(J + Jᵀ)` at x has about its least eigenvalue. Ends early where the time is over, and where both are refuted. Cost: two values of F each.
    pub fn of(problem: &Mcp, pairs: usize, seed: u64) -> Self {
        let n = problem.dim();
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut run = problem.F.evaluator();
        let mut out = Self { pairs: 0, undefined: 0, not_monotone: None, not_p0: None };
        let [mut x, mut y] = [(); 2].map(|()| problem.start.clone());
        let [mut f, mut g, mut sizes] = [(); 3].map(|()| vec![0.0; n]);
        let mut falling = Falling::default();
        for k in 0..TRIES * pairs {
            if out.pairs == pairs
                || budget::over()
                || out.not_monotone.is_some() && out.not_p0.is_some()
            {
                break;
            }
            // Near the start first: there F is defined, if anywhere.
            let reach = [0.1, 1.0, 10.0][rng.random_range(0..3)];
            for i in 0..n {
                x[i] = point(problem, i, reach, &mut rng);
            }
            y.clone_from(&x);
            if let Some(share) = [Some(0.0), Some(0.3), Some(1.0), None][k % 4] {
                let one = rng.random_range(0..n);
                for i in 0..n {
                    if i == one || rng.random::<f64>() < share {
                        y[i] = point(problem, i, reach, &mut rng);
                    }
                }
            } else if falling.direction(problem, &mut *run, &x) {
                let length = 0.01 * reach * x.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
                for i in 0..n {
                    y[i] = problem.project(i, x[i] + length * falling.direction[i]);
                }
            } else {
                out.undefined += 1;
                continue;
            }
            let [at_x, at_y] = [run.precisely(&x, &mut f), run.precisely(&y, &mut g)];
            if !(at_x && at_y) {
                out.undefined += 1;
                continue;
            }
            out.pairs += 1;
            let size = |i: usize, sizes: &[f64]| {
                f[i].abs().max(g[i].abs()).max(if sizes[i].is_finite() { sizes[i] } else { 0.0 })
            };
            if !run.sizes(&x, &mut sizes) {
                sizes.fill(0.0);
            }
            let (mut sum, mut terms, mut some, mut all_negative) = (0.0, 0.0, false, true);
            for i in 0..n {
                let product = (x[i] - y[i]) * (f[i] - g[i]);
                let rounding = (x[i] - y[i]).abs() * size(i, &sizes);
                sum += product;
                terms += product.abs().max(rounding);
                if x[i] != y[i] {
                    some = true;
                    all_negative &= product < -ROUNDING * rounding;
                }
            }
            let pair = || Some(Apart { x: x.clone(), y: y.clone() });
            if out.not_monotone.is_none() && sum < -ROUNDING * terms {
                out.not_monotone = pair();
            }
            if out.not_p0.is_none() && some && all_negative {
                out.not_p0 = pair();
            }
        }
        out
    }
}

/// Where the symmetric part of a Jacobian has about its least eigenvalue.
#[derive(Default)]
struct Falling {
    /// Its largest entry is 1 or −1; 0 where a variable is at a bound.
    direction: Vec<f64>,
    next: Vec<f64>,
    value: Vec<f64>,
    jacobian: Vec<f64>,
}

/// Operations that a direction may take.
const OPERATIONS: usize = 20_000_000;

impl Falling {
    /// Looks at x, by power iterations with `c − ½(J + Jᵀ)` from `(1, …, 1)`. False where J is not defined, or the time is over.
    fn direction(&mut self, problem: &Mcp, run: &mut dyn Evaluator, x: &[f64]) -> bool {
        let Self { direction, next, value, jacobian } = self;
        let pattern = problem.F.pattern();
        [&mut *direction, next, value].into_iter().for_each(|v| v.resize(x.len(), 0.0));
        jacobian.resize(pattern.len(), 0.0);
        if !run.jacobian(x, value, jacobian) {
            return false;
        }
        let inside = |i: usize| problem.lower[i] < x[i] && x[i] < problem.upper[i];
        direction.iter_mut().enumerate().for_each(|(i, d)| *d = f64::from(u8::from(inside(i))));
        // Sums of moduli of rows and columns bound the norm.
        next.fill(0.0);
        for ((i, j), a) in pattern.places().zip(&*jacobian) {
            next[i] += 0.5 * a.abs();
            next[j] += 0.5 * a.abs();
        }
        let bound = next.iter().fold(0.0, |m: f64, x| m.max(*x));
        for _ in 0..(OPERATIONS / pattern.len().max(1)).clamp(5, 100) {
            if budget::over() {
                return false;
            }
            next.iter_mut().zip(&*direction).for_each(|(n, d)| *n = bound * d);
            for ((i, j), a) in pattern.places().zip(&*jacobian) {
                next[i] -= 0.5 * a * direction[j];
                next[j] -= 0.5 * a * direction[i];
            }
            let largest =
                (0..x.len()).filter(|i| inside(*i)).fold(0.0, |m: f64, i| m.max(next[i].abs()));
            if !(largest > 0.0 && largest.is_finite()) {
                break;
            }
            for (i, d) in direction.iter_mut().enumerate() {
                *d = if inside(i) { next[i] / largest } else { 0.0 };
            }
        }
        true
    }
}

/// A number in `[l_i, u_i]`.
fn point(problem: &Mcp, i: usize, reach: f64, rng: &mut Pcg64) -> f64 {
    let (l, u) = (problem.lower[i], problem.upper[i]);
    let share: f64 = rng.random();
    if l.is_finite() && u.is_finite() && u - l <= reach * 10.0 {
        return problem.project(i, l + share * (u - l));
    }
    let start = problem.project(i, problem.start[i]);
    problem.project(i, start + (2.0 * share - 1.0) * reach * start.abs().max(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nonsmooth_problem::field::Expressions;

    fn problem(texts: &[&str]) -> Mcp {
        let texts: Vec<_> = texts.iter().map(ToString::to_string).collect();
        let n = texts.len();
        Mcp::ncp(Expressions::parse(&texts, &[]).unwrap(), vec![1.0; n]).unwrap()
    }

    #[test]
    fn monotone_functions_are_never_refuted() {
        for texts in [
            &["x1^3 + x1*1e8 - x2", "x1 + exp(x2)", "x3 - 1e8"][..],
            &["1e12 - x2", "x1 + 1e12"],
            &["log(x1)"],
        ] {
            let sampled = Sampled::of(&problem(texts), 100, 1);
            assert_eq!((sampled.not_monotone, sampled.not_p0), (None, None), "{texts:?}");
            assert_eq!(sampled.pairs, 100);
        }
    }

    #[test]
    fn pairs_refute() {
        // P but not monotone: x1 + 3 x2, x2.
        let p = problem(&["x1 + 3*x2", "x2"]);
        let sampled = Sampled::of(&p, 100, 1);
        let Apart { x, y } = sampled.not_monotone.unwrap();
        let d = [x[0] - y[0], x[1] - y[1]];
        assert!(d[0] * (d[0] + 3.0 * d[1]) + d[1] * d[1] < 0.0);
        assert_eq!(sampled.not_p0, None);
        // Only along (1, 1, …): the stiffness hides it from other pairs.
        let chain: Vec<_> = (1..=12)
            .map(|i| match i {
                1 => "x1 - x2 - 0.001*x1".into(),
                12 => "x12 - x11 - 0.001*x12".into(),
                i => format!("1.999*x{i} - x{} - x{}", i - 1, i + 1),
            })
            .collect();
        let chain: Vec<_> = chain.iter().map(String::as_str).collect();
        assert!(Sampled::of(&problem(&chain), 100, 1).not_monotone.is_some());
        // Decreasing in one variable.
        let sampled = Sampled::of(&problem(&["x1 + x2", "sin(x2)", "x3 - x3^2"]), 100, 1);
        assert!(sampled.not_monotone.is_some() && sampled.not_p0.is_some());
        // Defined nowhere.
        let sampled = Sampled::of(&problem(&["log(-1 - x1)"]), 10, 1);
        assert_eq!((sampled.pairs, sampled.undefined), (0, 40));
    }
}

//! Worked examples of linear complementarity, with all their solutions.
//!
//! Each is written down from its definition. [`all`] lists them at small sizes.
//!
//! ```
//! use nonsmooth_problem::planted::classics::{self, Known};
//!
//! let example = classics::kostreva();
//! assert_eq!(example.known, Known::Solutions(vec![vec![1.0 / 3.0; 3]]));
//! ```

use crate::Lcp;
use nonsmooth_linalg::Dense;

/// An LCP of the literature, with what is known of its solutions.
#[derive(Debug, Clone, PartialEq)]
pub struct Classic {
    /// The name under which tests and messages speak of it.
    pub name: &'static str,
    /// M and q as published.
    pub problem: Lcp,
    /// What is known of its solutions.
    pub known: Known,
}

/// What is known of the solutions of an example.
#[derive(Debug, Clone, PartialEq)]
pub enum Known {
    /// These z are all.
    Solutions(Vec<Vec<f64>>),
    /// All points between these, and no others.
    Segment([Vec<f64>; 2]),
    /// All points on the half line from the first in the direction of the second, and no others.
    HalfLine([Vec<f64>; 2]),
    /// There is none.
    Nothing,
}

impl Classic {
    fn new(name: &'static str, m: Dense, q: Vec<f64>, known: Known) -> Self {
        Self { name, problem: Lcp::new(m, q).expect("a square matrix of finite numbers"), known }
    }

    fn small<const N: usize>(
        name: &'static str,
        m: [[f64; N]; N],
        q: [f64; N],
        known: &[[f64; N]],
    ) -> Self {
        let m = Dense::from_fn(N, N, |i, j| m[i][j]);
        let known = match known {
            [] => Known::Nothing,
            some => Known::Solutions(some.iter().map(|z| z.to_vec()).collect()),
        };
        Self::new(name, m, q.to_vec(), known)
    }

    /// A solution, if there is one.
    pub fn solution(&self) -> Option<&[f64]> {
        match &self.known {
            Known::Solutions(all) => all.first().map(Vec::as_slice),
            Known::Segment([z, _]) | Known::HalfLine([z, _]) => Some(z),
            Known::Nothing => None,
        }
    }

    /// Whether z is a solution, by what is known, up to `tolerance` in every entry.
    pub fn has(&self, z: &[f64], tolerance: f64) -> bool {
        let near = |a: &[f64]| a.iter().zip(z).all(|(a, z)| (a - z).abs() <= tolerance);
        // The point of a line nearest to z, its parameter in an interval.
        let on_line = |p: &[f64], d: Vec<f64>, most: f64| {
            let length: f64 = d.iter().map(|d| d * d).sum();
            let along: f64 = p.iter().zip(z).zip(&d).map(|((p, z), d)| (z - p) * d).sum();
            let t = (along / length).clamp(0.0, most);
            near(&p.iter().zip(&d).map(|(p, d)| p + t * d).collect::<Vec<_>>())
        };
        match &self.known {
            Known::Solutions(all) => all.iter().any(|a| near(a)),
            Known::Segment([a, b]) => {
                on_line(a, a.iter().zip(b).map(|(a, b)| b - a).collect(), 1.0)
            }
            Known::HalfLine([a, d]) => on_line(a, d.clone(), f64::INFINITY),
            Known::Nothing => false,
        }
    }
}

/// e_i scaled, i from 0.
fn unit(n: usize, i: usize, x: f64) -> Vec<f64> {
    let mut z = vec![0.0; n];
    z[i] = x;
    z
}

/// Every example, at a small size where it has one.
pub fn all() -> Vec<Classic> {
    vec![
        murty_exponential(6, Costs::Ones),
        murty_exponential(6, Costs::Differences),
        murty_exponential(6, Costs::Powers),
        murty_exponential_reversed(6, Costs::Ones),
        murty_exponential_reversed(6, Costs::Differences),
        murty_exponential_reversed(6, Costs::Powers),
        fathi(8),
        fathi_reversed(8),
        csizmadia(8),
        csizmadia_ones(8),
        kostreva(),
        kostreva_scaled(),
        ben_gharbia_gilbert(3),
        ben_gharbia_gilbert(4),
        ben_gharbia_gilbert(5),
        ben_gharbia_gilbert(6),
        ahn(8),
        geiger_kanzow(8),
        murty_2_2(),
        murty_2_8(),
        murty_2_9(),
        floudas_10_2_3(),
        floudas_10_2_4(),
        floudas_10_2_9(10.0),
        floudas_10_2_9(100.0),
        path_manual(),
        psd_segment(),
        psd_half_line(),
        pang_isolated(),
        pang_perturbed(),
        pang_other_perturbed(),
        two_by_two(),
        ortiz(),
        reciprocals(9),
        minus_one_infeasible(),
        minus_one_two_solutions(),
        beale(),
    ]
}

/// The right-hand sides of Murty's exponential examples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Costs {
    /// `q = −e`.
    Ones,
    /// `q_i = −(2ⁿ⁺¹ − 2ⁱ)`.
    Differences,
    /// `q_i = −2ⁱ`.
    Powers,
}

/// Murty's example: M unit upper triangular with 2 above the diagonal, a P-matrix. The least-index rule takes 2ⁿ − 1 pivots to `z = e_n` (times 2ⁿ but for
/// [`Costs::Ones`]), for each of the three q; Lemke's method with `d = e` takes 2ⁿ for [`Costs::Differences`] and few for [`Costs::Ones`].
///
/// Source: Murty1978; Murty1988, chapter 6.
pub fn murty_exponential(n: usize, costs: Costs) -> Classic {
    let m = Dense::from_fn(n, n, |i, j| match i.cmp(&j) {
        std::cmp::Ordering::Less => 2.0,
        std::cmp::Ordering::Equal => 1.0,
        std::cmp::Ordering::Greater => 0.0,
    });
    let q = (1..=n).map(|i| -costs.of(n, i)).collect();
    let z = unit(n, n - 1, costs.of(n, n));
    Classic::new("murty_exponential", m, q, Known::Solutions(vec![z]))
}

impl Costs {
    /// −q_i, i from 1.
    fn of(self, n: usize, i: usize) -> f64 {
        let power = |k: usize| (k as f64).exp2();
        match self {
            Self::Ones => 1.0,
            Self::Differences => power(n + 1) - power(i),
            Self::Powers => power(i),
        }
    }
}

/// [`murty_exponential`] with rows and columns in the opposite order: M unit lower triangular with 2 below the diagonal. The least-index rule takes a single pivot;
/// the largest-index rule takes 2ⁿ − 1.
pub fn murty_exponential_reversed(n: usize, costs: Costs) -> Classic {
    reversed("murty_exponential_reversed", &murty_exponential(n, costs))
}

fn reversed(name: &'static str, of: &Classic) -> Classic {
    let n = of.problem.dim();
    let old = of.problem.M.to_dense().expect("dense");
    let m = Dense::from_fn(n, n, |i, j| old[(n - 1 - i, n - 1 - j)]);
    let turn = |x: &[f64]| x.iter().rev().copied().collect::<Vec<_>>();
    let known = match &of.known {
        Known::Solutions(all) => Known::Solutions(all.iter().map(|z| turn(z)).collect()),
        Known::Segment([a, b]) => Known::Segment([turn(a), turn(b)]),
        Known::HalfLine([a, b]) => Known::HalfLine([turn(a), turn(b)]),
        Known::Nothing => Known::Nothing,
    };
    Classic::new(name, m, turn(&of.problem.q), known)
}

/// Fathi's example `M = L Lᵀ` with L of [`murty_exponential_reversed`]: `M_ii = 4(i−1) + 1`, `M_ij = 4(min(i,j)−1) + 2`, symmetric positive definite; `q = −e`, `z = e_1`.
/// One least-index pivot.
///
/// Source: Fathi1979.
pub fn fathi(n: usize) -> Classic {
    let m = Dense::from_fn(n, n, |i, j| 4.0 * i.min(j) as f64 + if i == j { 1.0 } else { 2.0 });
    Classic::new("fathi", m, vec![-1.0; n], Known::Solutions(vec![unit(n, 0, 1.0)]))
}

/// [`fathi`] in the opposite order, `M = U Uᵀ`: `z = e_n`, 2ⁿ − 1 least-index pivots.
pub fn fathi_reversed(n: usize) -> Classic {
    reversed("fathi_reversed", &fathi(n))
}

/// Csizmadia's matrix: 1 on the diagonal, −1 below it; a P-matrix whose handicap as a sufficient matrix grows exponentially. `q = e − M e = (0, 1, …, n−1)`, so that `z = w = e` is
/// strictly feasible, and `z = 0` solves.
pub fn csizmadia(n: usize) -> Classic {
    let q = (0..n).map(|i| i as f64).collect();
    Classic::new("csizmadia", csizmadia_matrix(n), q, Known::Solutions(vec![vec![0.0; n]]))
}

/// Csizmadia's matrix with `q = −e`: `z_i = 2ⁱ⁻¹`.
pub fn csizmadia_ones(n: usize) -> Classic {
    // z_i = 1 + Σ_{j<i} z_j.
    let z = (0..n).map(|i| (i as f64).exp2()).collect();
    Classic::new("csizmadia_ones", csizmadia_matrix(n), vec![-1.0; n], Known::Solutions(vec![z]))
}

fn csizmadia_matrix(n: usize) -> Dense {
    Dense::from_fn(n, n, |i, j| match i.cmp(&j) {
        std::cmp::Ordering::Less => 0.0,
        std::cmp::Ordering::Equal => 1.0,
        std::cmp::Ordering::Greater => -1.0,
    })
}

const KOSTREVA: [[f64; 3]; 3] = [[1.0, 2.0, 0.0], [0.0, 1.0, 2.0], [2.0, 0.0, 1.0]];

/// A P-matrix on which single principal pivots in an unlucky order cycle: `{1}, {1,2}, {2}, {2,3}, {3}, {3,1}, {1}`. The least-index rule takes 5 pivots.
pub fn kostreva() -> Classic {
    Classic::small("kostreva", KOSTREVA, [-1.0; 3], &[[1.0 / 3.0; 3]])
}

/// [`kostreva`] with M a tenth: there the most negative variable is the unlucky one, and Bard's rule cycles.
pub fn kostreva_scaled() -> Classic {
    let m = KOSTREVA.map(|row| row.map(|x| x / 10.0));
    Classic::small("kostreva_scaled", m, [-1.0; 3], &[[10.0 / 3.0; 3]])
}

/// P-matrices on which Newton's method on `min(z, w)`, that is to change all variables of the wrong sign at once, has cycles of length n. `q = e`, `z = 0`; the cycle
/// begins at the basis {1}. n ≥ 3.
///
/// Source: BenGharbiaGilbert2012.
pub fn ben_gharbia_gilbert(n: usize) -> Classic {
    let odd = n % 2 == 1;
    let m = Dense::from_fn(n, n, |i, j| {
        let behind = (i + n - j) % n;
        match behind {
            0 => 1.0,
            1 if odd => 2.0,
            1 => 4.0 / 3.0,
            2 if !odd => 0.5,
            _ => 0.0,
        }
    });
    let known = Known::Solutions(vec![vec![0.0; n]]);
    Classic::new("ben_gharbia_gilbert", m, vec![1.0; n], known)
}

/// Tridiagonal with 1 below, 4 on and −2 above the diagonal, `q = −e`; every z is positive.
pub fn ahn(n: usize) -> Classic {
    tridiagonal("ahn", n, [1.0, 4.0, -2.0])
}

/// Tridiagonal with −1, 4, −1, `q = −e`; every z is positive.
pub fn geiger_kanzow(n: usize) -> Classic {
    tridiagonal("geiger_kanzow", n, [-1.0, 4.0, -1.0])
}

fn tridiagonal(name: &'static str, n: usize, [below, on, above]: [f64; 3]) -> Classic {
    let m = Dense::from_fn(n, n, |i, j| match (i + 1).wrapping_sub(j) {
        0 => above,
        1 => on,
        2 => below,
        _ => 0.0,
    });
    // M z = e by elimination.
    let (mut d, mut z) = (vec![on; n], vec![1.0; n]);
    for i in 1..n {
        let factor = below / d[i - 1];
        d[i] -= factor * above;
        z[i] -= factor * z[i - 1];
    }
    z[n - 1] /= d[n - 1];
    for i in (0..n - 1).rev() {
        z[i] = (z[i] - above * z[i + 1]) / d[i];
    }
    Classic::new(name, m, vec![-1.0; n], Known::Solutions(vec![z]))
}

/// No solution: both rows together are negative.
///
/// Source: Murty1988, example 2.2.
pub fn murty_2_2() -> Classic {
    Classic::small("murty_2_2", [[-2.0, 1.0], [1.0, -2.0]], [-1.0; 2], &[])
}

/// The optimality conditions of a quadratic program.
///
/// Source: Murty1988, example 2.8.
pub fn murty_2_8() -> Classic {
    let m = [
        [1.0, -1.0, -1.0, -1.0],
        [-1.0, 1.0, -1.0, -1.0],
        [1.0, 1.0, 2.0, 0.0],
        [1.0, 1.0, 0.0, 2.0],
    ];
    Classic::small("murty_2_8", m, [3.0, 5.0, -9.0, -5.0], &[[2.0, 1.0, 3.0, 1.0]])
}

/// No solution.
///
/// Source: Murty1988, example 2.9.
pub fn murty_2_9() -> Classic {
    let m = [[-1.0, 0.0, -3.0], [1.0, -2.0, -5.0], [-2.0, -1.0, -2.0]];
    Classic::small("murty_2_9", m, [-3.0, -2.0, -1.0], &[])
}

/// Problem 10.2.3 of the collection of Floudas and others.
pub fn floudas_10_2_3() -> Classic {
    let m = [[0.0, -1.0, 2.0], [2.0, 0.0, -2.0], [-1.0, 1.0, 0.0]];
    Classic::small("floudas_10_2_3", m, [-3.0, 6.0, -1.0], &[[0.0, 1.0, 3.0]])
}

/// A bimatrix game with two pure equilibria and a mixed one: problem 10.2.4 of the collection of Floudas and others. Lemke's method with `d = e` ends on a ray.
pub fn floudas_10_2_4() -> Classic {
    let payoff = Dense::from_fn(2, 2, |i, j| [[10.0, 20.0], [30.0, 15.0]][i][j]);
    let transposed = Dense::from_fn(2, 2, |i, j| payoff[(j, i)]);
    let known = [
        [0.1, 0.0, 0.1, 0.0],
        [0.0, 1.0 / 15.0, 0.0, 1.0 / 15.0],
        [1.0 / 90.0, 2.0 / 45.0, 1.0 / 90.0, 2.0 / 45.0],
    ];
    let known = Known::Solutions(known.iter().map(|z| z.to_vec()).collect());
    let problem = bimatrix(&payoff, &transposed);
    Classic { name: "floudas_10_2_4", problem, known }
}

/// The equilibria of a bimatrix game with positive losses A of the first and B of the second player: `M = [0 A; Bᵀ 0]`, `q = −e`; the mixed strategies are `z = (x, y)`, scaled to sum up to 1.
///
/// # Panics
///
/// Where A and B differ in shape.
pub fn bimatrix(a: &Dense, b: &Dense) -> Lcp {
    assert_eq!((a.nrows(), a.ncols()), (b.nrows(), b.ncols()), "shapes");
    let (p, n) = (a.nrows(), a.nrows() + a.ncols());
    let m = Dense::from_fn(n, n, |i, j| match (i < p, j < p) {
        (true, false) => a[(i, j - p)],
        (false, true) => b[(j, i - p)],
        _ => 0.0,
    });
    Lcp::new(m, vec![-1.0; n]).expect("finite losses")
}

/// Problem 10.2.9 of the collection of Floudas and others, for `l ≤ 23` or `l ≥ 23`.
pub fn floudas_10_2_9(l: f64) -> Classic {
    let m = [
        [11.0, 0.0, 10.0, -1.0],
        [0.0, 11.0, 10.0, -1.0],
        [10.0, 10.0, 21.0, -1.0],
        [1.0, 1.0, 1.0, 0.0],
    ];
    let z = if l <= 23.0 {
        let first = (l + 16.0) / 13.0;
        [first, first, 2.0 * (23.0 - l) / 13.0, (1286.0 - 9.0 * l) / 13.0]
    } else {
        [3.0, 3.0, 0.0, 83.0]
    };
    Classic::small("floudas_10_2_9", m, [50.0, 50.0, l, -6.0], &[z])
}

/// The example of the manual of PATH.
pub fn path_manual() -> Classic {
    let m = [
        [0.0, 0.0, -1.0, -1.0],
        [0.0, 0.0, 1.0, -2.0],
        [1.0, -1.0, 2.0, -2.0],
        [1.0, 2.0, -2.0, 4.0],
    ];
    Classic::small("path_manual", m, [2.0, 2.0, -2.0, -6.0], &[[2.8, 0.0, 0.8, 1.2]])
}

/// Positive semidefinite and singular: the segment `z_1 + z_2 = 1`.
pub fn psd_segment() -> Classic {
    let m = Dense::from_fn(2, 2, |_, _| 1.0);
    let known = Known::Segment([vec![1.0, 0.0], vec![0.0, 1.0]]);
    Classic::new("psd_segment", m, vec![-1.0; 2], known)
}

/// Positive semidefinite and singular: the half line `(t, 1 + t)`, t ≥ 0.
pub fn psd_half_line() -> Classic {
    let m = Dense::from_fn(2, 2, |i, j| if i == j { 1.0 } else { -1.0 });
    let known = Known::HalfLine([vec![0.0, 1.0], vec![1.0, 1.0]]);
    Classic::new("psd_half_line", m, vec![1.0, -1.0], known)
}

const PANG: [[f64; 3]; 3] = [[0.0, -1.0, -1.0], [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]];

/// A solution that is isolated but does not survive a perturbation of q: [`pang_perturbed`].
pub fn pang_isolated() -> Classic {
    Classic::small("pang_isolated", PANG, [0.0, -1.0, 1.0], &[[1.0, 0.0, 0.0]])
}

/// [`pang_isolated`] with `q_1 = −1e−4`: no solution.
pub fn pang_perturbed() -> Classic {
    Classic::small("pang_perturbed", PANG, [-1e-4, -1.0, 1.0], &[])
}

/// [`pang_perturbed`] with `M_12 = −1`, `M_13 = 1`: solvable again, by `(1, t, 10⁻⁴ + t)`, t ≥ 0.
pub fn pang_other_perturbed() -> Classic {
    let m = Dense::from_fn(3, 3, |i, j| if (i, j) == (0, 2) { 1.0 } else { PANG[i][j] });
    let known = Known::HalfLine([vec![1.0, 0.0, 1e-4], vec![0.0, 1.0, 1.0]]);
    Classic::new("pang_other_perturbed", m, vec![-1e-4, -1.0, 1.0], known)
}

/// Two variables, positive definite, both positive.
pub fn two_by_two() -> Classic {
    let z = [4.0 / 3.0, 7.0 / 3.0];
    Classic::small("two_by_two", [[2.0, 1.0], [1.0, 2.0]], [-5.0, -6.0], &[z])
}

/// Four variables, not symmetric, of P type.
pub fn ortiz() -> Classic {
    let m =
        [[3.0, 1.0, 0.0, -1.0], [-1.0, 2.0, 1.0, 1.0], [0.0, 1.0, 3.0, -1.0], [0.0, 0.0, 1.0, 2.0]];
    let z = [2.0 / 3.0, 0.0, 1.0 / 3.0, 0.0];
    Classic::small("ortiz", m, [-2.0, 1.0, -1.0, 1.0], &[z])
}

/// `M = diag(1, …, n)`, `q = −e`: `z_i = 1/i`.
pub fn reciprocals(n: usize) -> Classic {
    let m = Dense::from_fn(n, n, |i, j| if i == j { (i + 1) as f64 } else { 0.0 });
    let z = (0..n).map(|i| 1.0 / (i + 1) as f64).collect();
    Classic::new("reciprocals", m, vec![-1.0; n], Known::Solutions(vec![z]))
}

/// `M = −1`, `q = −1`: no solution.
pub fn minus_one_infeasible() -> Classic {
    Classic::small("minus_one_infeasible", [[-1.0]], [-1.0], &[])
}

/// `M = −1`, `q = 1`: 0 and 1.
pub fn minus_one_two_solutions() -> Classic {
    Classic::small("minus_one_two_solutions", [[-1.0]], [1.0], &[[0.0], [1.0]])
}

/// The optimality conditions `M = [0 Aᵀ; −A 0]`, `q = (c, b)` of Beale's linear program `min cᵀx, A x ≤ b, x ≥ 0`, on whose degenerate vertex the textbook simplex method
/// cycles; `x = (1/25, 0, 1, 0)`, objective −1/20.
pub fn beale() -> Classic {
    let c = [-0.75, 150.0, -0.02, 6.0];
    let a = [[0.25, -60.0, -0.04, 9.0], [0.5, -90.0, -0.02, 3.0], [0.0, 0.0, 1.0, 0.0]];
    let m = Dense::from_fn(7, 7, |i, j| match (i < 4, j < 4) {
        (true, false) => a[j - 4][i],
        (false, true) => -a[i - 4][j],
        _ => 0.0,
    });
    let q = [&c[..], &[0.0, 0.0, 1.0]].concat();
    let z = vec![0.04, 0.0, 1.0, 0.0, 0.0, 1.5, 0.05];
    Classic::new("beale", m, q, Known::Solutions(vec![z]))
}

/// The matrix of an example times positive factors of rows and columns: z becomes `z_j / columns_j`.
///
/// # Panics
///
/// Where a length is wrong, or M is not explicit.
pub fn scaled(of: &Classic, rows: &[f64], columns: &[f64]) -> Classic {
    let (n, m) = (of.problem.dim(), of.problem.M.to_dense().expect("explicit"));
    assert_eq!((rows.len(), columns.len()), (n, n), "lengths");
    let m = Dense::from_fn(n, n, |i, j| rows[i] * m[(i, j)] * columns[j]);
    let q = of.problem.q.iter().zip(rows).map(|(q, r)| q * r).collect();
    let back = |z: &Vec<f64>| z.iter().zip(columns).map(|(z, c)| z / c).collect::<Vec<_>>();
    let known = match &of.known {
        Known::Solutions(all) => Known::Solutions(all.iter().map(back).collect()),
        Known::Segment([a, b]) => Known::Segment([back(a), back(b)]),
        Known::HalfLine([a, b]) => Known::HalfLine([back(a), back(b)]),
        Known::Nothing => Known::Nothing,
    };
    Classic::new(of.name, m, q, known)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::Judged;

    #[test]
    fn the_judge_accepts_what_is_known() {
        for example in all() {
            let Classic { name, problem, known } = &example;
            let points = match known {
                Known::Solutions(all) => all.clone(),
                Known::Segment([a, b]) => {
                    let middle = a.iter().zip(b).map(|(a, b)| 0.5 * (a + b)).collect();
                    vec![a.clone(), b.clone(), middle]
                }
                Known::HalfLine([a, d]) => {
                    vec![a.clone(), a.iter().zip(d).map(|(a, d)| a + 7.0 * d).collect()]
                }
                Known::Nothing => vec![],
            };
            for z in points {
                let verdict = problem.judge(&crate::LcpPoint { z: z.clone() }, 1e-14).unwrap();
                assert!(verdict.solved, "{name}: {z:?}, {:?}", verdict.measure);
                assert!(example.has(&z, 1e-14), "{name}");
            }
        }
    }

    #[test]
    fn printed_solutions() {
        let near =
            |z: &[f64], printed: &[f64]| z.iter().zip(printed).all(|(z, p)| (z - p).abs() < 6e-7);
        let ahn = ahn(8);
        let z = [0.407637, 0.315273, 0.334365, 0.326367, 0.319917, 0.303019, 0.265996, 0.183501];
        assert!(near(ahn.solution().unwrap(), &z));
        let geiger = geiger_kanzow(8);
        assert!(near(geiger.solution().unwrap(), &[0.366013, 0.464052, 0.490196, 0.496732]));
    }
}

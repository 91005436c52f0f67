use nonsmooth_linalg::Dense;

use super::*;

struct Planted {
    matrix: Csc,
    q: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
}

impl Planted {
    fn linear(&self) -> Linear<'_> {
        Linear { matrix: &self.matrix, q: &self.q, lower: &self.lower, upper: &self.upper }
    }

    fn n(&self) -> usize {
        self.q.len()
    }

    /// The natural residual at π(y).
    fn residual(&self, y: &[f64]) -> f64 {
        let n = self.n();
        let project = |i: usize, x: f64| x.max(self.lower[i]).min(self.upper[i]);
        let x: Vec<f64> = (0..n).map(|i| project(i, y[i])).collect();
        let mut f = self.q.clone();
        self.matrix.mul_add(1.0, &x, &mut f);
        (0..n).map(|i| (x[i] - project(i, x[i] - f[i])).abs()).fold(0.0, f64::max)
    }
}

/// Which bounds the variables have.
#[derive(Clone, Copy, PartialEq)]
enum Bounds {
    Lower,
    All,
}

/// `M = B Bᵀ + S + shift I`, B of `rank` columns, S skew, with a solution at which a part of the pairs is degenerate.
fn planted(
    n: usize,
    rank: usize,
    shift: f64,
    bounds: Bounds,
    degenerate: f64,
    seed: u64,
) -> Planted {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let b: Vec<Vec<f64>> =
        (0..n).map(|_| (0..rank).map(|_| rng.random_range(-1.0..1.0)).collect()).collect();
    let mut m = Dense::zeros(n, n);
    for i in 0..n {
        for j in 0..i {
            let s = rng.random_range(-1.0..1.0);
            m.row_mut(i)[j] += s;
            m.row_mut(j)[i] -= s;
        }
    }
    for i in 0..n {
        for j in 0..n {
            let dot: f64 = b[i].iter().zip(&b[j]).map(|(x, y)| x * y).sum();
            m.row_mut(i)[j] += dot + if i == j { shift } else { 0.0 };
        }
    }
    let (mut lower, mut upper) = (vec![0.0; n], vec![f64::INFINITY; n]);
    let (mut x, mut f) = (vec![0.0; n], vec![0.0; n]);
    for i in 0..n {
        if bounds == Bounds::All {
            match rng.random_range(0..5) {
                0 => (lower[i], upper[i]) = (f64::NEG_INFINITY, f64::INFINITY),
                1 => (lower[i], upper[i]) = (f64::NEG_INFINITY, 1.0),
                2 => (lower[i], upper[i]) = (-1.0, 1.0),
                3 if i % 3 == 0 => (lower[i], upper[i]) = (0.5, 0.5),
                _ => {}
            }
        }
        let force = if rng.random_bool(degenerate) { 0.0 } else { rng.random_range(0.0..2.0) };
        let side = rng.random_range(0..3);
        (x[i], f[i]) = if side == 0 && lower[i].is_finite() {
            (lower[i], force)
        } else if side == 1 && upper[i].is_finite() {
            (upper[i], -force)
        } else {
            let at: f64 = rng.random_range(-1.0..2.0);
            (at.max(lower[i]).min(upper[i]), 0.0)
        };
    }
    let matrix = m.to_csc();
    let mut q = f;
    matrix.mul_add(-1.0, &x, &mut q);
    Planted { matrix, q, lower, upper }
}

fn start(problem: &Planted, seed: u64) -> Vec<f64> {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let n = problem.n();
    // Some inside, some outside, some exactly at a bound.
    let mut y: Vec<f64> = (0..n).map(|_| rng.random_range(-2.0..2.0)).collect();
    for i in (0..n).filter(|i| i % 4 == 0) {
        y[i] = y[i].max(problem.lower[i]).min(problem.upper[i]);
    }
    y
}

#[test]
fn arcs_of_p_matrices_end_in_the_solution() {
    for case in 0..300 {
        let n = 1 + case as usize % 24;
        let degenerate = if case % 2 == 0 { 0.0 } else { 0.6 };
        let problem = planted(n, n, 0.1, Bounds::All, degenerate, case);
        let mut tracer = Tracer::new(n);
        for begin in [Start::At, Start::Basis, Start::Ray] {
            let mut y = start(&problem, case);
            let end = tracer.follow(&problem.linear(), begin, &mut y, 2000);
            assert_eq!(end, End::Solved, "case {case}, {begin:?}");
            assert!(
                problem.residual(&y) < 1e-8,
                "case {case}, {begin:?}: {:e}",
                problem.residual(&y)
            );
        }
    }
}

#[test]
fn rays_of_semidefinite_matrices_end_in_a_solution() {
    for case in 0..300 {
        let n = 2 + case as usize % 24;
        let degenerate = if case % 2 == 0 { 0.0 } else { 0.6 };
        let problem = planted(n, n / 3, 0.0, Bounds::Lower, degenerate, 1000 + case);
        let mut tracer = Tracer::new(n);
        let mut y = start(&problem, case);
        let end = tracer.follow(&problem.linear(), Start::Ray, &mut y, 2000);
        assert_eq!(end, End::Solved, "case {case}");
        assert!(problem.residual(&y) < 1e-8, "case {case}: {:e}", problem.residual(&y));
    }
}

#[test]
fn semidefinite_matrices_with_any_bounds() {
    let mut solved = [0; 3];
    for case in 0..300 {
        let n = 2 + case as usize % 24;
        let problem = planted(n, n / 3, 0.0, Bounds::All, 0.3, 5000 + case);
        let mut tracer = Tracer::new(n);
        for (k, begin) in [Start::At, Start::Basis, Start::Ray].into_iter().enumerate() {
            let mut y = start(&problem, case);
            let end = tracer.follow(&problem.linear(), begin, &mut y, 2000);
            if end == End::Solved {
                assert!(problem.residual(&y) < 1e-7, "case {case}: {:e}", problem.residual(&y));
                solved[k] += 1;
            } else {
                eprintln!("case {case} {begin:?} {end:?} t {}", tracer.reached());
            }
        }
    }
    assert!(solved.iter().all(|&s| s >= 290), "{solved:?}");
}

/// A five-point grid of m × m points between bounds 0 and 1, with a solution that is given by its normal variables y.
fn grid(m: usize) -> (Planted, Vec<f64>) {
    let n = m * m;
    let mut entries = vec![];
    for i in 0..n {
        entries.push((i, i, 4.0));
        let (a, b) = (i / m, i % m);
        let near = [(a > 0, i.wrapping_sub(m)), (a + 1 < m, i + m), (b > 0, i.wrapping_sub(1))];
        for (there, j) in near.into_iter().chain([(b + 1 < m, i + 1)]) {
            if there {
                entries.push((i, j, -1.0));
            }
        }
    }
    let matrix = Csc::from_triplets(n, n, entries.into_iter()).unwrap();
    let wave = |i: usize| (0.09 * (i / m) as f64).sin() * (0.07 * (i % m) as f64).cos();
    let y: Vec<f64> = (0..n).map(|i| 0.5 + wave(i)).collect();
    let x: Vec<f64> = y.iter().map(|y| y.clamp(0.0, 1.0)).collect();
    // q = −A x − (y − x): N(y) = 0.
    let mut q: Vec<f64> = x.iter().zip(&y).map(|(x, y)| x - y).collect();
    matrix.mul_add(-1.0, &x, &mut q);
    (Planted { matrix, q, lower: vec![0.0; n], upper: vec![1.0; n] }, y)
}

#[test]
fn a_near_start_on_a_large_grid_takes_few_pivots() {
    let (problem, solution) = grid(141);
    let n = problem.n();
    let mut y = solution.clone();
    // Some variables begin on the wrong side of a bound.
    (0..n).step_by(400).for_each(|i| y[i] += if y[i] < 0.5 { -0.8 } else { 0.8 });
    let mut tracer = Tracer::new(n);
    assert_eq!(tracer.follow(&problem.linear(), Start::At, &mut y, 500), End::Solved);
    assert!(problem.residual(&y) < 1e-12, "{:e}", problem.residual(&y));
    assert!(tracer.pivots() < 200, "{}", tracer.pivots());
    assert!(y.iter().zip(&solution).all(|(a, b)| (a - b).abs() < 1e-9));
}

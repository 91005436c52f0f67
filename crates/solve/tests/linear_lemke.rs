//! Lemke's method: known solutions and pivot counts, degeneracy, certificates, mixed problems, bad scaling, and that the bases agree.

use nonsmooth_linalg::{Csc, Dense, Matrix, norm};
use nonsmooth_problem::check::Certificate;
use nonsmooth_problem::{Lcp, LcpPoint, Mlcp, Problem};
use nonsmooth_solve::complementarity::pivoting::{BasisKind, Covering, Lemke, Ties};
use nonsmooth_solve::trace::{Pivot, Trace, Variable};
use nonsmooth_solve::{Driver, Limits, Outcome, Session, Status};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

const BASES: [BasisKind; 3] = [BasisKind::Tableau, BasisKind::Dense, BasisKind::Sparse];

/// The textbook's method.
fn plain() -> Lemke {
    Lemke { ties: Ties::Rows, restarts: 0, ..Lemke::default() }
}

struct Run {
    z: Vec<f64>,
    outcome: Outcome,
    pivots: Vec<Pivot>,
}

fn run_with<P>(problem: &P, solver: Lemke, start: &[f64], tolerance: f64) -> Run
where
    P: Problem<Point = LcpPoint> + nonsmooth_solve::complementarity::form::Complementary,
{
    let mut driver = Driver::new(solver);
    let mut point = problem.origin();
    if !start.is_empty() {
        point.z.copy_from_slice(start);
    }
    let limits = Limits { trace: true, tolerance, max_iterations: 1_000_000, ..Limits::default() };
    let outcome = driver.solve(problem, &mut point, &limits, &mut |_| {}).expect("it applies");
    let Trace::Pivots(pivots) = driver.trace() else { panic!("a history of pivots") };
    Run { z: point.z, outcome, pivots }
}

fn run<P>(problem: &P, settings: Lemke) -> Run
where
    P: Problem<Point = LcpPoint> + nonsmooth_solve::complementarity::form::Complementary,
{
    run_with(problem, settings, &[], 1e-11)
}

fn lcp<const N: usize>(rows: [[f64; N]; N], q: [f64; N]) -> Lcp {
    Lcp::new(Dense::from_rows(&rows).unwrap(), q.to_vec()).unwrap()
}

fn from_fn(n: usize, m: impl FnMut(usize, usize) -> f64, q: impl FnMut(usize) -> f64) -> Lcp {
    Lcp::new(Dense::from_fn(n, n, m), (0..n).map(q).collect()).unwrap()
}

fn assert_close(z: &[f64], expected: &[f64], what: &str) {
    let size = expected.iter().fold(1e-300_f64, |l, x| l.max(x.abs()));
    let off = z.iter().zip(expected).fold(0.0_f64, |l, (a, b)| l.max((a - b).abs()));
    assert!(z.len() == expected.len() && off <= 1e-12 * size, "{what}: {z:?}, not {expected:?}");
}

/// 1 on the diagonal, 2 above.
fn upper(i: usize, j: usize) -> f64 {
    if i == j {
        1.0
    } else if i < j {
        2.0
    } else {
        0.0
    }
}

/// Name, problem, solution, pivots of the textbook's tableau with d = e and lexicographic ties.
fn classics() -> Vec<(String, Lcp, Vec<f64>, Option<usize>)> {
    let unit = |n: usize, i: usize, x: f64| (0..n).map(|k| if k == i { x } else { 0.0 }).collect();
    let mut all: Vec<(String, Lcp, Vec<f64>, Option<usize>)> = vec![
        ("CPS 1".into(), lcp([[1.0, 1.0], [1.0, 1.0]], [-1.0, -1.0]), vec![1.0, 0.0], None),
        (
            "CPS 2".into(),
            lcp([[0.0, -1.0, 2.0], [2.0, 0.0, -2.0], [-1.0, 1.0, 0.0]], [-3.0, 6.0, -1.0]),
            vec![0.0, 1.0, 3.0],
            None,
        ),
        ("CPS 5".into(), lcp([[1.0, -1.0], [-1.0, 1.0]], [1.0, -1.0]), vec![0.0, 1.0], None),
        (
            "deudeu".into(),
            lcp([[2.0, 1.0], [1.0, 2.0]], [-5.0, -6.0]),
            vec![4.0 / 3.0, 7.0 / 3.0],
            None,
        ),
        (
            "ortiz".into(),
            lcp(
                [
                    [3.0, 1.0, 0.0, -1.0],
                    [-1.0, 2.0, 1.0, 1.0],
                    [0.0, 1.0, 3.0, -1.0],
                    [0.0, 0.0, 1.0, 2.0],
                ],
                [-2.0, 1.0, -1.0, 1.0],
            ),
            vec![2.0 / 3.0, 0.0, 1.0 / 3.0, 0.0],
            None,
        ),
        (
            "Kostreva".into(),
            lcp([[1.0, 2.0, 0.0], [0.0, 1.0, 2.0], [2.0, 0.0, 1.0]], [-1.0; 3]),
            vec![1.0 / 3.0; 3],
            Some(8),
        ),
        (
            "Murty 2.8".into(),
            lcp(
                [
                    [1.0, -1.0, -1.0, -1.0],
                    [-1.0, 1.0, -1.0, -1.0],
                    [1.0, 1.0, 2.0, 0.0],
                    [1.0, 1.0, 0.0, 2.0],
                ],
                [3.0, 5.0, -9.0, -5.0],
            ),
            vec![2.0, 1.0, 3.0, 1.0],
            Some(5),
        ),
        (
            "PATH manual".into(),
            lcp(
                [
                    [0.0, 0.0, -1.0, -1.0],
                    [0.0, 0.0, 1.0, -2.0],
                    [1.0, -1.0, 2.0, -2.0],
                    [1.0, 2.0, -2.0, 4.0],
                ],
                [2.0, 2.0, -2.0, -6.0],
            ),
            vec![2.8, 0.0, 0.8, 1.2],
            None,
        ),
    ];
    for n in [3, 6, 10] {
        let power = |k: usize| 2.0_f64.powi(k as i32);
        all.push((
            format!("Murty lower {n}"),
            from_fn(n, |i, j| upper(j, i), |i| -(power(n + 1) - power(n - i))),
            unit(n, 0, power(n)),
            Some(1 << n),
        ));
        all.push((
            format!("Murty upper {n}"),
            from_fn(n, upper, |i| -(power(n + 1) - power(i + 1))),
            unit(n, n - 1, power(n)),
            Some(1 << n),
        ));
        let fathi = |i: usize, j: usize| {
            let least = i.min(j) as f64;
            if i == j { 4.0 * least + 1.0 } else { 4.0 * least + 2.0 }
        };
        all.push((format!("Fathi {n}"), from_fn(n, fathi, |_| -1.0), unit(n, 0, 1.0), Some(2)));
        let reversed = move |i: usize, j: usize| fathi(n - 1 - i, n - 1 - j);
        all.push((
            format!("Fathi reversed {n}"),
            from_fn(n, reversed, |_| -1.0),
            unit(n, n - 1, 1.0),
            Some(2 * n),
        ));
        let csizmadia = |i: usize, j: usize| {
            if i == j {
                1.0
            } else if j < i {
                -1.0
            } else {
                0.0
            }
        };
        let z: Vec<f64> = (0..n).map(power).collect();
        all.push((format!("Csizmadia {n}"), from_fn(n, csizmadia, |_| -1.0), z, Some(n + 1)));
    }
    all.push(("exp_murty".into(), from_fn(6, upper, |_| -1.0), unit(6, 5, 1.0), Some(4)));
    all
}

#[test]
fn classics_have_their_solutions_and_their_pivots() {
    for (name, problem, z, pivots) in classics() {
        for basis in BASES {
            let found = run(&problem, Lemke { basis, ..plain() });
            assert_eq!(found.outcome.status, Status::Solved, "{name}, {basis:?}");
            assert_close(&found.z, &z, &name);
            if let Some(pivots) = pivots {
                assert_eq!(found.pivots.len(), pivots, "{name}, {basis:?}");
            }
            // A pivot a step.
            assert_eq!(found.outcome.iterations, found.pivots.len(), "{name}");
        }
    }
}

#[test]
fn ties_without_a_rule_cycle_and_are_noticed() {
    // Kostreva 1979: a P-matrix on which Lemke's method cycles.
    let problem = lcp([[1.0, 2.0, 0.0], [0.0, 1.0, 2.0], [2.0, 0.0, 1.0]], [-1.0; 3]);
    for basis in BASES {
        let found = run(&problem, Lemke { ties: Ties::First, basis, ..plain() });
        let Status::Stalled(why) = &found.outcome.status else { panic!("{:?}", found.outcome) };
        assert!(why.contains("cycles"), "{why}");
        assert!(found.pivots.len() < 30);
        for ties in [Ties::Lexicographic, Ties::Perturbed] {
            let found = run(&problem, Lemke { ties, basis, ..plain() });
            assert_eq!(found.outcome.status, Status::Solved);
            assert_close(&found.z, &[1.0 / 3.0; 3], "Kostreva");
        }
    }
}

/// What the three bases agree on.
fn same_pivots(problem: &Lcp, settings: Lemke, what: &str) -> Run {
    let mut runs: Vec<Run> =
        BASES.iter().map(|&basis| run(problem, Lemke { basis, ..settings.clone() })).collect();
    let first = runs.remove(0);
    let exchanges = |r: &Run| r.pivots.iter().map(|p| (p.entering, p.leaving)).collect::<Vec<_>>();
    for other in &runs {
        let (a, b) = (exchanges(&first), exchanges(other));
        let differ = a.iter().zip(&b).position(|(a, b)| a != b);
        assert!(differ.is_none() && a.len() == b.len(), "{what}: at pivot {differ:?}");
        assert_eq!(first.outcome.status.name(), other.outcome.status.name(), "{what}");
    }
    first
}

fn rng(seed: u64) -> Pcg64Mcg {
    Pcg64Mcg::seed_from_u64(seed)
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Class {
    /// A positive definite matrix that is not symmetric, so a P-matrix.
    Definite,
    /// `B Bᵀ` of half the rank, with redundant rows, and a skew part.
    Semidefinite,
    /// `B Bᵀ + N`, N ≥ 0 with few entries: copositive-plus on what matters.
    CopositivePlus,
    /// Entries of a P-matrix that is not definite: upper triangular, permuted.
    Triangular,
}

/// A problem with a planted solution: `share` of the pairs are zero on both sides.
fn planted(n: usize, class: Class, share: f64, seed: u64) -> (Lcp, Vec<f64>) {
    let mut rng = rng(seed);
    let mut uniform = || rng.random_range(-1.0..1.0_f64);
    let rank = if class == Class::Semidefinite { n.div_ceil(2) } else { n };
    let b = Dense::from_fn(n, rank, |_, _| uniform());
    let skew = Dense::from_fn(n, n, |_, _| uniform());
    let product = |i: usize, j: usize| -> f64 {
        b.row(i).iter().zip(b.row(j)).map(|(x, y)| x * y).sum::<f64>() / n as f64
    };
    let m = Dense::from_fn(n, n, |i, j| match class {
        Class::Definite => {
            product(i, j) + 0.5 * (skew[(i, j)] - skew[(j, i)]) + if i == j { 0.1 } else { 0.0 }
        }
        Class::Semidefinite => product(i, j) + 0.5 * (skew[(i, j)] - skew[(j, i)]),
        Class::CopositivePlus => product(i, j) + skew[(i, j)].abs() + f64::from(u8::from(i == j)),
        Class::Triangular => {
            let (a, b) = ((7 * i + 3) % n, (7 * j + 3) % n);
            if i == j {
                1.0
            } else if a < b {
                skew[(i, j)]
            } else {
                0.0
            }
        }
    });
    let (mut z, mut w) = (vec![0.0; n], vec![0.0; n]);
    for i in 0..n {
        let at = 0.5 + 0.5 * uniform();
        if at >= share {
            let which = if uniform() > 0.0 { &mut z } else { &mut w };
            which[i] = 1.5 + 0.5 * uniform();
        }
    }
    let m = Matrix::from(m);
    let mut q = vec![0.0; n];
    m.mul(&z, &mut q);
    q.iter_mut().zip(&w).for_each(|(q, w)| *q = w - *q);
    (Lcp::new(m, q).unwrap(), z)
}

#[test]
fn planted_problems_are_solved_by_the_same_pivots() {
    for class in [Class::Definite, Class::Semidefinite, Class::CopositivePlus, Class::Triangular] {
        for (n, share) in [(5, 0.0), (30, 0.1), (80, 0.5), (120, 0.0)] {
            for ties in [Ties::Lexicographic, Ties::Perturbed] {
                let (problem, z) = planted(n, class, share, n as u64);
                let what = format!("{class:?}, n = {n}, {share} degenerate, {ties:?}");
                let found = same_pivots(&problem, Lemke { ties, ..plain() }, &what);
                assert_eq!(found.outcome.status, Status::Solved, "{what}");
                if matches!(class, Class::Definite | Class::Triangular) {
                    let off: Vec<f64> = z.iter().zip(&found.z).map(|(a, b)| a - b).collect();
                    assert!(norm(&off) <= 1e-8 * norm(&z), "{what}: {}", norm(&off));
                }
                assert!(found.z.iter().all(|z| *z >= 0.0));
            }
        }
    }
}

#[test]
fn many_ties_are_broken() {
    // All rows tied at the start, and most of them ever after.
    for n in [20, 60, 150] {
        let mut rng = rng(n as u64);
        let signs = Dense::from_fn(n, n, |_, _| f64::from(rng.random_range(-1..2_i32)));
        let m = |i: usize, j: usize| signs[(i, j)] - signs[(j, i)] + if i == j { 1.0 } else { 0.0 };
        let problem = from_fn(n, m, |_| -1.0);
        for ties in [Ties::Lexicographic, Ties::Perturbed] {
            if n <= 60 {
                same_pivots(&problem, Lemke { ties, ..plain() }, "ties");
            }
            for basis in BASES {
                let found = run(&problem, Lemke { ties, basis, ..plain() });
                assert_eq!(found.outcome.status, Status::Solved, "n = {n}, {ties:?}, {basis:?}");
            }
        }
    }
}

#[test]
fn no_solution_is_proved() {
    // Murty 2.2: a row that nothing lifts exists in neither; the ray does it.
    let cases = [
        ("row", lcp([[1.0, 0.0], [-1.0, 0.0]], [1.0, -1.0])),
        ("1 × 1", lcp([[-1.0]], [-1.0])),
        ("skew", lcp([[0.0, -1.0], [1.0, 0.0]], [-1.0, -1.0])),
        // x ≥ 1 and x ≤ 0 as conditions of a quadratic program.
        ("psd", lcp([[1.0, -1.0, 1.0], [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]], [0.0, -1.0, 0.0])),
    ];
    for (name, problem) in cases {
        for basis in BASES {
            let found = run(&problem, Lemke { basis, ..plain() });
            let Status::Infeasible(proof) = found.outcome.status else {
                panic!("{name}: {:?}", found.outcome.status)
            };
            let certificate = proof.certificate();
            let row = matches!(certificate, Certificate::Row { .. });
            let ray = matches!(certificate, Certificate::Ray { z0: 0.0, .. });
            assert!(if name == "psd" { ray } else { row }, "{name}: {certificate:?}");
        }
    }
}

#[test]
fn infeasible_programs_have_a_ray() {
    // min ½ xᵀ H x + cᵀ x under A x ≥ b, x ≥ 0, where A x ≥ b has no solution; as an LCP, positive semidefinite.
    for seed in 0..20 {
        let mut rng = rng(seed);
        let (k, m) = (12, 8);
        let mut uniform = || rng.random_range(-1.0..1.0_f64);
        let b = Dense::from_fn(k, k, |_, _| uniform());
        let a = Dense::from_fn(m, k, |_, _| uniform());
        let y: Vec<f64> = (0..m).map(|_| uniform().abs()).collect();
        // The last row: −(yᵀ A) − positive, so that with weights (y, 1) nothing can be positive.
        let mix: Vec<f64> =
            (0..k).map(|j| -(0..m).map(|i| y[i] * a[(i, j)]).sum::<f64>() - 0.1).collect();
        let row = |i: usize, j: usize| if i < m { a[(i, j)] } else { mix[j] };
        let n = k + m + 1;
        let entry = |i: usize, j: usize| match (i < k, j < k) {
            (true, true) => b.row(i).iter().zip(b.row(j)).map(|(x, y)| x * y).sum(),
            (true, false) => -row(j - k, i),
            (false, true) => row(i - k, j),
            (false, false) => 0.0,
        };
        let q: Vec<f64> = (0..n)
            .map(|i| {
                if i < k {
                    i as f64 - 6.0
                } else if i < k + m {
                    0.0
                } else {
                    -1.0
                }
            })
            .collect();
        let problem = from_fn(n, entry, |i| q[i]);
        let found = same_pivots(&problem, plain(), "infeasible");
        assert!(
            found.outcome.status.refutes()
                && matches!(found.outcome.status.certificate(), Some(Certificate::Ray { .. })),
            "{seed}: {:?}",
            found.outcome.status
        );
    }
}

#[test]
fn rays_that_prove_nothing_say_so() {
    // Murty 2.2 and 2.9 have no solution, CPS 3 has three: of none does Lemke's ray say anything.
    let bimatrix = bimatrix_problem();
    for problem in [
        lcp([[-2.0, 1.0], [1.0, -2.0]], [-1.0, -1.0]),
        lcp([[-1.0, 0.0, -3.0], [1.0, -2.0, -5.0], [-2.0, -1.0, -2.0]], [-3.0, -2.0, -1.0]),
        bimatrix.clone(),
    ] {
        let found = run(&problem, plain());
        let none = found.outcome.status.certificate().is_some();
        assert!(none, "{:?}", found.outcome.status);
    }
    let again = run(&bimatrix, Lemke { restarts: 3, ..plain() });
    assert_eq!(again.outcome.status, Status::Solved, "another first basis");
}

/// CPS 3 (Floudas 10.2.4).
fn bimatrix_problem() -> Lcp {
    let a = [[10.0, 20.0], [30.0, 15.0]];
    let entry = |i: usize, j: usize| match (i < 2, j < 2) {
        (true, false) => a[i][j - 2],
        (false, true) => a[i - 2][j],
        _ => 0.0,
    };
    from_fn(4, entry, |_| -1.0)
}

#[test]
fn scales_of_rows_and_columns_do_not_matter() {
    for class in [Class::Definite, Class::Semidefinite] {
        for (n, seed) in [(30, 1), (100, 2)] {
            let (problem, _) = planted(n, class, 0.2, seed);
            let m = problem.M.to_dense().unwrap();
            let mut rng = rng(seed);
            let mut scale = || 10.0_f64.powf(rng.random_range(-8.0..8.0));
            let rows: Vec<f64> = (0..n).map(|_| scale()).collect();
            let columns: Vec<f64> = (0..n).map(|_| scale()).collect();
            let scaled =
                from_fn(n, |i, j| rows[i] * m[(i, j)] * columns[j], |i| rows[i] * problem.q[i]);
            for covering in [Covering::Auto, Covering::RowNorms, Covering::Ones] {
                let found = same_pivots(&scaled, Lemke { covering, ..plain() }, "scaled");
                assert_eq!(found.outcome.status, Status::Solved, "{class:?}, {n}, {covering:?}");
            }
        }
    }
}

#[test]
fn a_solution_is_a_first_basis() {
    let (problem, z) = planted(60, Class::Definite, 0.0, 5);
    let cold = run(&problem, Lemke::default());
    let warm = run_with(
        &problem,
        Lemke::default(),
        &z.iter().map(|z| 1.01 * z).collect::<Vec<_>>(),
        1e-11,
    );
    assert_eq!(warm.outcome.status, Status::Solved);
    assert!(warm.pivots.is_empty() && cold.pivots.len() > 10);
    // A few of the signs are wrong: a few pivots.
    let mut off = z.clone();
    for i in [3, 17, 40] {
        off[i] = if off[i] > 0.0 { 0.0 } else { 10.0 };
    }
    for basis in BASES {
        let settings = Lemke { basis, ..Lemke::default() };
        let warm = run_with(&problem, settings, &off, 1e-11);
        assert_eq!(warm.outcome.status, Status::Solved);
        assert!(
            warm.pivots.len() < cold.pivots.len(),
            "{} pivots, {} before",
            warm.pivots.len(),
            cold.pivots.len()
        );
        assert_close(&warm.z, &cold.z, "warm");
    }
}

#[test]
fn nothing_to_do_is_done_at_once() {
    let found = run(&lcp([[-1.0, 2.0], [0.0, -3.0]], [0.0, 1.0]), plain());
    assert_eq!(found.outcome.status, Status::Solved);
    assert_eq!(found.z, [0.0, 0.0]);
    assert!(found.pivots.is_empty());
}

#[test]
fn the_first_pivot_is_an_argmax() {
    // Acary2018 (26)–(28): z0 = max −q_i/d_i.
    let problem = lcp([[2.0, 0.0], [0.0, 2.0]], [-3.0, -5.0]);
    let solver = Lemke { covering_vector: Some(vec![1.0, 4.0]), ..plain() };
    let found = run_with(&problem, solver, &[], 1e-11);
    let first = found.pivots[0];
    assert_eq!((first.entering, first.leaving), (Variable::Artificial, Variable::W(0)));
    assert_eq!((first.ratio, first.z0), (3.0, Some(3.0)));
    assert_eq!(found.pivots.last().unwrap().z0, Some(0.0));
    assert_eq!(found.z, [1.5, 2.5]);
    // The same, whatever d is.
    for covering in [Covering::Ones, Covering::RowNorms, Covering::Random] {
        assert_eq!(run(&problem, Lemke { covering, ..plain() }).z, [1.5, 2.5]);
    }
}

#[test]
fn sparse_problems_of_some_size() {
    // The obstacle problem on a grid, and a random sparse matrix with a dominant diagonal.
    let k = 40_usize;
    let n = k * k;
    let mut entries = vec![];
    for i in 0..n {
        entries.push((i, i, 4.0));
        for j in [i.wrapping_sub(k), i + k] {
            if j < n {
                entries.push((i, j, -1.0));
            }
        }
        if i % k > 0 {
            entries.push((i, i - 1, -1.0));
        }
        if i % k + 1 < k {
            entries.push((i, i + 1, -1.0));
        }
    }
    let q: Vec<f64> = (0..n)
        .map(|i| {
            let (x, y) = ((i % k) as f64 / k as f64, (i / k) as f64 / k as f64);
            0.1 - 0.8 * (9.0 * x).sin() * (7.0 * y).cos()
        })
        .collect();
    let m = Csc::from_triplets(n, n, entries.iter().copied()).unwrap();
    let problem = Lcp::new(m, q).unwrap();
    let found = run(&problem, Lemke::default());
    assert_eq!(found.outcome.status, Status::Solved);
    assert!(found.outcome.measure.relative <= 1e-13);
    println!("{} pivots, {} factorisations", found.pivots.len(), found.outcome.factorisations);
}

#[test]
fn games_have_their_equilibria() {
    use nonsmooth_solve::complementarity::pivoting::{game, lemke_howson};
    let dense = |rows: &[[f64; 2]]| Dense::from_rows(rows).unwrap();
    // Two pure equilibria, and a mixed one that no label reaches from the artificial one.
    let (a, b) = (dense(&[[2.0, 0.0], [0.0, 1.0]]), dense(&[[1.0, 0.0], [0.0, 2.0]]));
    let mut pure = [false; 2];
    for label in 0..4 {
        let e = lemke_howson(&a, &b, label).unwrap().unwrap();
        let which = usize::from(e.x == [0.0, 1.0]);
        assert_eq!(e.x, e.y);
        assert_eq!(e.x[which], 1.0);
        pure[which] = true;
    }
    assert_eq!(pure, [true; 2]);
    // Matching pennies, and a 3 × 2 game (von Stengel) with a mixed equilibrium (0, 1/3, 2/3), (1/3, 2/3).
    let (a, b) = (dense(&[[1.0, -1.0], [-1.0, 1.0]]), dense(&[[-1.0, 1.0], [1.0, -1.0]]));
    for label in 0..4 {
        let e = lemke_howson(&a, &b, label).unwrap().unwrap();
        assert_close(&e.x, &[0.5, 0.5], "pennies");
        assert_close(&e.y, &[0.5, 0.5], "pennies");
    }
    let (a, b) = (
        dense(&[[3.0, 3.0], [2.0, 5.0], [0.0, 6.0]]),
        dense(&[[3.0, 2.0], [2.0, 6.0], [3.0, 1.0]]),
    );
    let known = [
        (vec![1.0, 0.0, 0.0], vec![1.0, 0.0]),
        (vec![0.8, 0.2, 0.0], vec![2.0 / 3.0, 1.0 / 3.0]),
        (vec![0.0, 1.0 / 3.0, 2.0 / 3.0], vec![1.0 / 3.0, 2.0 / 3.0]),
    ];
    for label in 0..5 {
        let e = lemke_howson(&a, &b, label).unwrap().unwrap();
        let near = |x: &[f64], y: &[f64]| x.iter().zip(y).all(|(x, y)| (x - y).abs() < 1e-12);
        assert!(known.iter().any(|(x, y)| near(x, &e.x) && near(y, &e.y)), "{label}: {e:?}");
    }
    assert!(lemke_howson(&a, &b, 5).is_err());
    // Larger ones, by what an equilibrium is; the last with a factorised basis.
    for n in [10, 45] {
        let mut rng = rng(n as u64);
        let a = Dense::from_fn(n, n, |_, _| rng.random_range(-3.0..5.0));
        let b = Dense::from_fn(n, n, |_, _| rng.random_range(0.0..1.0));
        let e = lemke_howson(&a, &b, 3).unwrap().unwrap();
        let (mut rows, mut columns) = (vec![0.0; n], vec![0.0; n]);
        a.mul_add(1.0, &e.y, &mut rows);
        b.mul_transpose_add(1.0, &e.x, &mut columns);
        for (payoff, s) in [(rows, &e.x), (columns, &e.y)] {
            let now: f64 = payoff.iter().zip(s).map(|(p, s)| p * s).sum();
            assert!(payoff.iter().all(|p| *p <= now + 1e-12), "{n}");
        }
        assert_eq!(game(&a, &b).unwrap().dim(), 2 * n);
    }
}

/// `A u + C v + a = 0`, `0 ≤ v ⟂ D u + B v + b ≥ 0` with a planted solution.
fn planted_mixed(
    free: usize,
    m: usize,
    mut entry: impl FnMut(usize, usize) -> f64,
    seed: u64,
) -> (Mlcp, Vec<f64>) {
    let n = free + m;
    let mut rng = rng(seed);
    let matrix = Matrix::from(Dense::from_fn(n, n, &mut entry));
    let mut z: Vec<f64> = (0..n).map(|_| rng.random_range(-1.0..1.0)).collect();
    let mut w = vec![0.0; n];
    for i in free..n {
        (z[i], w[i]) = (z[i].max(0.0), (-z[i]).max(0.0));
    }
    let mut q = vec![0.0; n];
    matrix.mul(&z, &mut q);
    q.iter_mut().zip(&w).for_each(|(q, w)| *q = w - *q);
    (Mlcp::new(matrix, q, free).unwrap(), z)
}

#[test]
fn free_variables_are_basic_whether_a_is_singular_or_not() {
    for (free, m) in [(1, 1), (3, 5), (20, 30), (30, 40)] {
        let n = free + m;
        let mut rng = rng(n as u64);
        let r = Dense::from_fn(n, n, |_, _| rng.random_range(-1.0..1.0_f64));
        let gram = |i: usize, j: usize| -> f64 {
            r.row(i).iter().zip(r.row(j)).map(|(x, y)| x * y).sum::<f64>() / n as f64
        };
        let skew = |i: usize, j: usize| r[(i, j)] - r[(j, i)];
        // A definite; A = 0, a saddle point; A of half the rank.
        let kinds: [Box<dyn Fn(usize, usize) -> f64>; 3] = [
            Box::new(|i, j| gram(i, j) + skew(i, j) + f64::from(u8::from(i == j))),
            Box::new(|i, j| match (i < free, j < free) {
                (true, true) => 0.0,
                (false, false) => gram(i, j) + f64::from(u8::from(i == j)),
                _ => skew(i, j),
            }),
            Box::new(|i, j| match (i < free, j < free) {
                (true, true) => f64::from(u8::from(i == j && i >= free.div_ceil(2))),
                (false, false) => gram(i, j) + f64::from(u8::from(i == j)),
                _ => skew(i, j),
            }),
        ];
        for (kind, entry) in kinds.iter().enumerate() {
            if kind > 0 && m < free {
                continue;
            }
            let (problem, z) = planted_mixed(free, m, entry, n as u64);
            for basis in BASES {
                let found = run(&problem, Lemke { basis, ..plain() });
                let what = format!("{free} + {m}, kind {kind}, {basis:?}");
                assert_eq!(found.outcome.status, Status::Solved, "{what}");
                // Elsewhere u need not be unique.
                let off: Vec<f64> = z.iter().zip(&found.z).map(|(a, b)| a - b).collect();
                assert!(kind > 0 || norm(&off) <= 1e-9 * norm(&z), "{what}");
            }
        }
    }
}

#[test]
fn equalities_that_cannot_be_met_are_refuted_or_named() {
    // u + v = 1 twice; then the second one says 2.
    let rows = [[1.0, 1.0, 1.0], [1.0, 1.0, 1.0], [0.0, 0.0, 1.0]];
    let matrix = || Dense::from_rows(&rows).unwrap();
    for basis in BASES {
        let settings = Lemke { basis, ..plain() };
        let redundant = Mlcp::new(matrix(), vec![-1.0, -1.0, 0.5], 2).unwrap();
        assert_eq!(run(&redundant, settings.clone()).outcome.status, Status::Solved, "{basis:?}");
        let contradictory = Mlcp::new(matrix(), vec![-1.0, -2.0, 0.5], 2).unwrap();
        let found = run(&contradictory, settings).outcome.status;
        assert!(
            found.refutes() && matches!(found.certificate(), Some(Certificate::Farkas { .. })),
            "{basis:?}: {found:?}"
        );
    }
}

/// All solutions of a small LCP whose complementary bases are regular: `None` where one is singular.
fn enumerated(problem: &Lcp) -> Option<Vec<Vec<f64>>> {
    let n = problem.dim();
    let m = problem.M.to_dense().unwrap();
    let mut found = vec![];
    for set in 0..1_u32 << n {
        let basic = |i: usize| set >> i & 1 == 1;
        // [I or −M] x = q.
        let mut t = Dense::from_fn(n, n + 1, |i, j| match j {
            _ if j == n => problem.q[i],
            _ if basic(j) => -m[(i, j)],
            _ => f64::from(u8::from(i == j)),
        });
        for c in 0..n {
            let r = (c..n).max_by(|&a, &b| t[(a, c)].abs().total_cmp(&t[(b, c)].abs())).unwrap();
            if t[(r, c)].abs() < 1e-9 {
                return None;
            }
            for j in 0..=n {
                (t[(r, j)], t[(c, j)]) = (t[(c, j)], t[(r, j)]);
            }
            let pivot = t[(c, c)];
            (0..=n).for_each(|j| t[(c, j)] /= pivot);
            for i in (0..n).filter(|&i| i != c) {
                let y = t[(i, c)];
                (0..=n).for_each(|j| t[(i, j)] -= y * t[(c, j)]);
            }
        }
        if (0..n).all(|i| t[(i, n)] >= -1e-9) {
            found.push((0..n).map(|i| if basic(i) { t[(i, n)].max(0.0) } else { 0.0 }).collect());
        }
    }
    Some(found)
}

#[test]
fn small_problems_of_any_class_agree_with_enumeration() {
    let (mut solved, mut refuted, mut open) = (0, 0, 0);
    for seed in 0..600 {
        let mut rng = rng(seed);
        let n = rng.random_range(2..6_usize);
        let m = Dense::from_fn(n, n, |_, _| f64::from(rng.random_range(-4..6_i32)));
        let q = (0..n).map(|_| f64::from(rng.random_range(-5..4_i32))).collect();
        let problem = Lcp::new(m, q).unwrap();
        let Some(all) = enumerated(&problem) else { continue };
        for basis in BASES {
            let found = run(&problem, Lemke { basis, ..Lemke::default() });
            match found.outcome.status {
                Status::Solved => {
                    solved += 1;
                    let near = |z: &Vec<f64>| {
                        z.iter().zip(&found.z).all(|(a, b)| (a - b).abs() < 1e-7 * (1.0 + a.abs()))
                    };
                    assert!(all.iter().any(near), "{seed}: {:?} is none of {all:?}", found.z);
                }
                Status::Infeasible(_) => {
                    refuted += 1;
                    assert!(all.is_empty(), "{seed}: {all:?}");
                }
                Status::NoConclusion(_) => open += 1,
                other => panic!("{seed}: {other:?}"),
            }
        }
    }
    println!("{solved} solved, {refuted} refuted, {open} open");
    assert!(solved > 500 && refuted > 50);
}

#[test]
fn almost_singular_problems_end() {
    for seed in 0..30 {
        let n = 40;
        let mut rng = rng(seed);
        let (problem, _) = planted(n, Class::Semidefinite, 0.3, seed);
        let m = problem.M.to_dense().unwrap();
        // Rows and columns twice, up to rounding, in scales that differ by 1e16.
        let mut noise = || 1.0 + 1e-14 * rng.random_range(-1.0..1.0_f64);
        let size = |i: usize| {
            if i.is_multiple_of(3) {
                1e-8
            } else if i.is_multiple_of(5) {
                1e8
            } else {
                1.0
            }
        };
        let twice =
            Dense::from_fn(2 * n, 2 * n, |i, j| size(i) * size(j) * m[(i % n, j % n)] * noise());
        let q = (0..2 * n).map(|i| size(i) * problem.q[i % n]).collect();
        let problem = Lcp::new(twice, q).unwrap();
        for basis in BASES {
            let found = run_with(&problem, Lemke { basis, ..plain() }, &[], 1e-8);
            let named = match &found.outcome.status {
                Status::Stalled(why) => !why.is_empty(),
                Status::Solved | Status::NoConclusion(_) => true,
                // It has a solution.
                _ => false,
            };
            assert!(named && found.outcome.iterations < 5000, "{:?}", found.outcome.status);
            if seed == 0 {
                println!("{basis:?}: {}", found.outcome.status);
            }
        }
    }
}

#[test]
fn a_session_solves_one_problem_after_another() {
    let mut driver = Driver::new(Lemke::default());
    for (n, seed) in [(20, 1), (20, 2), (60, 3), (20, 4), (60, 5)] {
        let (problem, z) = planted(n, Class::Definite, 0.0, seed);
        let mut point = problem.origin();
        let limits = Limits { tolerance: 1e-10, ..Limits::default() };
        let outcome = driver.solve(&problem, &mut point, &limits, &mut |_| {}).unwrap();
        assert_eq!(outcome.status, Status::Solved);
        let off: Vec<f64> = z.iter().zip(&point.z).map(|(a, b)| a - b).collect();
        assert!(norm(&off) <= 1e-8 * norm(&z));
        assert_eq!(driver.account().len(), 1, "{:?}", driver.account());
    }
}

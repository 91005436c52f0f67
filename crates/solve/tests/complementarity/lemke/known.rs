//! Problems of the literature: solutions and pivot counts, ties, rays and what they prove.

use nonsmooth_linalg::Dense;
use nonsmooth_problem::Lcp;
use nonsmooth_problem::check::Certificate;
use nonsmooth_solve::Status;
use nonsmooth_solve::complementarity::pivoting::{Covering, Lemke, Ties};
use nonsmooth_solve::trace::Variable;
use rand::RngExt;

use super::{BASES, assert_close, from_fn, plain, rng, run, run_with, same_pivots};

fn lcp<const N: usize>(rows: [[f64; N]; N], q: [f64; N]) -> Lcp {
    Lcp::new(Dense::from_rows(&rows).unwrap(), q.to_vec()).unwrap()
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

//! Planted and worked problems: symmetric, dominant, monotone with zero diagonals.

use nonsmooth_linalg::Dense;
use nonsmooth_problem::{Lcp, Problem};
use nonsmooth_solve::complementarity::splitting::Psor;
use nonsmooth_solve::{Limits, Solver, Status};
use rand::RngExt;

use super::{Draw, SYMMETRIC, distance, gram, limits, solved, try_solve};

/// Diagonally dominant by the factor given, of any signs off the diagonal.
fn dominant(mut a: Dense, factor: f64) -> Dense {
    for i in 0..a.nrows() {
        a[(i, i)] = 0.0;
        a[(i, i)] = factor * a.row(i).iter().map(|x| x.abs()).sum::<f64>();
    }
    a
}

/// `[H −Aᵀ; A 0]`: monotone, with zeros on the diagonal.
fn kkt(h: &Dense, a: &Dense, rows: usize) -> Dense {
    let n = h.nrows();
    Dense::from_fn(n + rows, n + rows, |i, j| match (i < n, j < n) {
        (true, true) => h[(i, j)],
        (true, false) => -a[(j - n, i)],
        (false, true) => a[(i - n, j)],
        (false, false) => 0.0,
    })
}

#[test]
fn symmetric_positive_definite_problems() {
    for seed in 0..4 {
        let mut draw = Draw::seeded(seed);
        let m = gram(&draw.square(40), 0.05);
        let (q, z) = draw.plant(&m);
        for (storage, problem) in [
            ("dense", Lcp::new(m.clone(), q.clone()).unwrap()),
            ("sparse", Lcp::new(m.to_csc(), q).unwrap()),
        ] {
            for label in SYMMETRIC {
                let (found, _) = solved(&problem, label);
                assert!(distance(&found, &z) < 1e-7, "{label} {storage} seed {seed}");
            }
        }
    }
}

#[test]
fn units_do_not_matter() {
    let mut draw = Draw::seeded(11);
    let m = gram(&draw.square(30), 0.05);
    let units: Vec<f64> = (0..30).map(|_| 10f64.powf(draw.0.random_range(-4.0..4.0))).collect();
    let scaled = Dense::from_fn(30, 30, |i, j| units[i] * m[(i, j)] * units[j]);
    let (q, z) = draw.plant(&m);
    let q = q.iter().zip(&units).map(|(q, u)| q * u).collect();
    let problem = Lcp::new(scaled, q).unwrap();
    for label in SYMMETRIC {
        let (mut found, _) = solved(&problem, label);
        found.iter_mut().zip(&units).for_each(|(z, u)| *z *= u);
        assert!(distance(&found, &z) < 1e-5, "{label}: {}", distance(&found, &z));
    }
}

#[test]
fn h_matrices_need_no_symmetry() {
    let labels = ["projected_jacobi", "pgs", "psor", "psor omega=1 adapt=false", "rpgs", "rpsor"];
    for seed in 0..4 {
        let mut draw = Draw::seeded(20 + seed);
        let m = dominant(draw.square(50), 1.1);
        let (q, z) = draw.plant(&m);
        let problem = Lcp::new(m, q).unwrap();
        for label in labels {
            let (found, _) = solved(&problem, label);
            assert!(distance(&found, &z) < 1e-8, "{label} seed {seed}");
        }
    }
}

#[test]
fn gauss_seidel_on_m_matrices_rises_to_the_least_solution() {
    // M an M-matrix, z = 0 at the start: the iterates rise, and never beyond the solution.
    let problem = Lcp::new(
        Dense::from_fn(30, 30, |i, j| match i.abs_diff(j) {
            0 => 2.0,
            1 => -1.0,
            _ => 0.0,
        }),
        (0..30).map(|i| 0.3 - f64::from(u8::from(i > 8 && i < 16))).collect(),
    )
    .unwrap();
    let (z, _) = solved(&problem, "mprgp");
    let solver = Psor { omega: 1.0, adapt: false, ..Psor::default() };
    let mut work = solver.work(&problem).unwrap();
    let mut point = problem.origin();
    solver.start(&problem, &mut point, &mut work);
    for _ in 0..200 {
        let before = point.z.clone();
        solver.step(&problem, &mut point, &mut work);
        for i in 0..30 {
            assert!(before[i] <= point.z[i] && point.z[i] <= z[i] + 1e-9);
        }
    }
    assert!(z.iter().any(|z| *z > 0.1) && z.contains(&0.0));
}

#[test]
fn worked_examples() {
    let lcp =
        |rows: &[&[f64]], q: &[f64]| Lcp::new(Dense::from_rows(rows).unwrap(), q.to_vec()).unwrap();
    let deudeu = lcp(&[&[2.0, 1.0], &[1.0, 2.0]], &[-5.0, -6.0]);
    let ortiz = lcp(
        &[
            &[3.0, 1.0, 0.0, -1.0],
            &[-1.0, 2.0, 1.0, 1.0],
            &[0.0, 1.0, 3.0, -1.0],
            &[0.0, 0.0, 1.0, 2.0],
        ],
        &[-2.0, 1.0, -1.0, 1.0],
    );
    for label in ["pgs", "psor", "rpgs", "rpsor"] {
        assert!(distance(&solved(&deudeu, label).0, &[4.0 / 3.0, 7.0 / 3.0]) < 1e-8, "{label}");
        let known = [2.0 / 3.0, 0.0, 1.0 / 3.0, 0.0];
        assert!(distance(&solved(&ortiz, label).0, &known) < 1e-8, "{label}");
    }
    // Fathi: symmetric positive definite, badly conditioned; z = e_1.
    let fathi = Dense::from_fn(6, 6, |i, j| {
        let low = i.min(j) as f64;
        if i == j { 4.0 * low + 1.0 } else { 4.0 * low + 2.0 }
    });
    let fathi = Lcp::new(fathi, vec![-1.0; 6]).unwrap();
    for label in ["pgs", "psor", "splitting_ls", "mprgp", "rpsor"] {
        let (z, _) = solved(&fathi, label);
        assert!(distance(&z, &[1.0, 0.0, 0.0, 0.0, 0.0, 0.0]) < 1e-6, "{label}: {z:?}");
    }
}

#[test]
fn regularised_sweeps_solve_monotone_problems_with_zero_diagonals() {
    let lcp =
        |rows: &[&[f64]], q: &[f64]| Lcp::new(Dense::from_rows(rows).unwrap(), q.to_vec()).unwrap();
    let cps2 = lcp(&[&[0.0, -1.0, 2.0], &[2.0, 0.0, -2.0], &[-1.0, 1.0, 0.0]], &[-3.0, 6.0, -1.0]);
    let path = lcp(
        &[
            &[0.0, 0.0, -1.0, -1.0],
            &[0.0, 0.0, 1.0, -2.0],
            &[1.0, -1.0, 2.0, -2.0],
            &[1.0, 2.0, -2.0, 4.0],
        ],
        &[2.0, 2.0, -2.0, -6.0],
    );
    for label in ["rpgs", "rpsor", "rpgs adapt=false", "rpsor direction=symmetric"] {
        assert!(distance(&solved(&path, label).0, &[2.8, 0.0, 0.8, 1.2]) < 1e-7, "{label}");
        // Not monotone, but solved.
        assert!(distance(&solved(&cps2, label).0, &[0.0, 1.0, 3.0]) < 1e-7, "{label}");
    }
    for seed in 0..3 {
        let mut draw = Draw::seeded(40 + seed);
        let m = kkt(&gram(&draw.square(24), 0.1), &draw.square(24), 6);
        let (q, z) = draw.plant(&m);
        for problem in [Lcp::new(m.clone(), q.clone()).unwrap(), Lcp::new(m.to_csc(), q).unwrap()] {
            for label in ["rpgs", "rpsor"] {
                let (found, _) = solved(&problem, label);
                assert!(distance(&found, &z) < 1e-6, "{label} seed {seed}");
            }
        }
    }
}

#[test]
fn a_zero_row_is_no_trouble() {
    // The second row: w = 1, so z = 0. With a negative q there is no solution, and nothing becomes NaN.
    let m = || Dense::from_rows(&[[2.0, 0.0], [0.0, 0.0]]).unwrap();
    let problem = Lcp::new(m(), vec![-1.0, 1.0]).unwrap();
    assert!(distance(&solved(&problem, "rpsor").0, &[0.5, 0.0]) < 1e-9);
    assert_eq!(solved(&problem, "mprgp").0, [0.5, 0.0]);
    let infeasible = Lcp::new(m(), vec![-1.0, -1.0]).unwrap();
    let (outcome, z) = try_solve(&infeasible, "rpsor", &limits(1e-8, 3000)).unwrap();
    assert!(outcome.status != Status::Solved && z.iter().all(|z| z.is_finite()));
    let (outcome, _) = try_solve(&infeasible, "mprgp", &limits(1e-8, 3000)).unwrap();
    assert!(matches!(outcome.status, Status::Infeasible(_)), "{outcome:?}");
}

#[test]
fn a_semidefinite_energy_without_a_minimum_is_proved_infeasible() {
    let problem =
        Lcp::new(Dense::from_rows(&[[1.0, -1.0], [-1.0, 1.0]]).unwrap(), vec![-1.0, -1.0]).unwrap();
    let (outcome, _) = try_solve(&problem, "mprgp", &Limits::default()).unwrap();
    assert!(matches!(outcome.status, Status::Infeasible(_)), "{outcome:?}");
}

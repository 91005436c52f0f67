//! Planted problems, monotone ones and others, in any scale, from any start.

use nonsmooth_linalg::{Dense, Matrix};
use nonsmooth_problem::{Lcp, LcpPoint, Problem};
use nonsmooth_solve::registry::{self};
use nonsmooth_solve::settings::from_texts;
use nonsmooth_solve::{Limits, Status};

use super::{ALL, BOTH, Numbers, gram, off, planted, run, run_from, skew};
use crate::common::w_of;

#[test]
fn planted_monotone_problems_are_solved_to_rounding() {
    for n in [1, 2, 5, 30, 120] {
        for seed in 0..4 {
            let numbers = &mut Numbers(seed + 1000 * n as u64);
            let cases: [(&str, Dense); 4] = [
                ("SPD", gram(n, n, 0.1, numbers)),
                ("PSD", gram(n, n.div_ceil(2), 0.0, numbers)),
                ("skew", skew(n, 0.0, numbers)),
                ("skew + 1", skew(n, 1.0, numbers)),
            ];
            for (class, m) in cases {
                for share in [0.0, 0.3, 1.0] {
                    let matrices = [Matrix::from(m.clone()), m.to_csc().into()];
                    let (z, w, q) = planted(&matrices[0], share, numbers);
                    for m in matrices {
                        let storage =
                            if matches!(m, Matrix::Dense(_)) { "dense" } else { "sparse" };
                        let problem = Lcp::new(m, q.clone()).unwrap();
                        for name in ALL {
                            let at = format!(
                                "{name}, {class}, {storage}, n = {n}, seed {seed}, share {share}"
                            );
                            let run = run(&problem, name, 1e-12);
                            assert_eq!(
                                run.outcome.status,
                                Status::Solved,
                                "{at}: {:?}",
                                run.outcome.measure
                            );
                            let most = if name == "ip_mty" { 120 } else { 60 };
                            assert!(
                                run.outcome.iterations <= most,
                                "{at}: {}",
                                run.outcome.iterations
                            );
                            let wrong = off(&w_of(&problem, &run.point.z), &w);
                            if class == "SPD" || class == "PSD" {
                                assert!(wrong < 1e-6, "{at}: w off by {wrong:.1e}");
                            }
                            if class == "SPD" || class == "skew + 1" {
                                let wrong = off(&run.point.z, &z);
                                assert!(wrong < 1e-6, "{at}: z off by {wrong:.1e}");
                            }
                        }
                    }
                }
            }
        }
    }
}

fn csizmadia(n: usize) -> Lcp {
    let m = Dense::from_fn(n, n, |i, j| match i.cmp(&j) {
        std::cmp::Ordering::Equal => 1.0,
        std::cmp::Ordering::Greater => -1.0,
        std::cmp::Ordering::Less => 0.0,
    });
    Lcp::new(m, vec![-1.0; n]).unwrap()
}

#[test]
fn csizmadias_problem_costs_what_its_handicap_says_and_is_solved_or_named() {
    for n in [3, 6, 10, 16, 24] {
        let problem = csizmadia(n);
        for name in BOTH {
            let run = run(&problem, name, 1e-10);
            println!(
                "Csizmadia n = {n}, {name}: {} in {}",
                run.outcome.status, run.outcome.iterations
            );
            assert!(
                matches!(run.outcome.status, Status::Solved | Status::Stalled(_)),
                "{:?}",
                run.outcome.status
            );
            if n <= 10 {
                assert_eq!(run.outcome.status, Status::Solved, "{name}, n = {n}");
                // z = 2^i: the whole is an M-matrix, all rows are equalities.
                for (i, z) in run.point.z.iter().enumerate() {
                    let exact = (i as f64).exp2();
                    assert!((z / exact - 1.0).abs() < 1e-9, "{name}: z[{i}] = {z}");
                }
            }
        }
    }
}

#[test]
fn scaling_by_different_hands_is_undone() {
    for n in [5, 40] {
        for seed in 0..4 {
            let numbers = &mut Numbers(seed + 31 * n as u64);
            let m = if seed % 2 == 0 { gram(n, n, 0.5, numbers) } else { skew(n, 1.0, numbers) };
            let (_, _, q) = planted(&Matrix::from(m.clone()), 0.1, numbers);
            let d: Vec<[f64; 2]> =
                (0..n).map(|_| [0; 2].map(|_| 10f64.powf(numbers.within(-6.0, 6.0)))).collect();
            let scaled = Dense::from_fn(n, n, |i, j| d[i][0] * m[(i, j)] * d[j][1]);
            let q: Vec<f64> = q.iter().zip(&d).map(|(q, d)| q * d[0]).collect();
            let problem = Lcp::new(scaled, q).unwrap();
            for name in BOTH {
                let run = run(&problem, name, 1e-10);
                println!(
                    "n = {n}, seed {seed}, {name}: {} in {}",
                    run.outcome.status, run.outcome.iterations
                );
                assert_eq!(run.outcome.status, Status::Solved, "{name}: {:?}", run.outcome.measure);
            }
        }
    }
}

#[test]
fn a_good_start_is_used_and_a_bad_one_does_no_harm() {
    let numbers = &mut Numbers(9);
    let m = Matrix::from(gram(80, 80, 0.1, numbers));
    let (z, _, q) = planted(&m, 0.0, numbers);
    let problem = Lcp::new(m, q).unwrap();
    for name in BOTH {
        let cold = run(&problem, name, 1e-10).outcome.iterations;
        let near: Vec<f64> = z.iter().map(|z| z + numbers.within(-1e-4, 1e-4)).collect();
        let warm = run_from(&problem, name, &[], 1e-10, LcpPoint { z: near });
        let wild: Vec<f64> = z.iter().map(|_| numbers.within(-1e6, 1e6)).collect();
        let bad = run_from(&problem, name, &[], 1e-10, LcpPoint { z: wild });
        println!(
            "{name}: {cold} cold, {} warm, {} from afar",
            warm.outcome.iterations, bad.outcome.iterations
        );
        assert_eq!((warm.outcome.status, bad.outcome.status), (Status::Solved, Status::Solved));
        assert!(warm.outcome.iterations <= cold && bad.outcome.iterations <= cold + 1);
    }
}

#[test]
fn what_is_not_monotone_is_solved_or_named() {
    let murty = Dense::from_rows(&[[-2.0, 1.0], [1.0, -2.0]]).unwrap();
    let pang = Dense::from_rows(&[[0.0, -1.0, -1.0], [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]).unwrap();
    let ray =
        Dense::from_rows(&[[-1.0, 0.0, -3.0], [1.0, -2.0, -5.0], [-2.0, -1.0, -2.0]]).unwrap();
    let kostreva = Dense::from_rows(&[[1.0, 2.0, 0.0], [0.0, 1.0, 2.0], [2.0, 0.0, 1.0]]).unwrap();
    for (m, q, solvable) in [
        (murty, vec![-1.0, -1.0], false),
        (pang, vec![0.0, -1.0, 1.0], true),
        (ray, vec![-3.0, -2.0, -1.0], false),
        (kostreva, vec![-1.0; 3], true),
    ] {
        let problem = Lcp::new(m, q).unwrap();
        for name in BOTH {
            let status = run(&problem, name, 1e-9).outcome.status;
            println!("{name}: {status}");
            match status {
                Status::Solved => assert!(solvable),
                Status::Infeasible(_) => assert!(!solvable),
                Status::Stalled(_) => {}
                other => panic!("{name}: {other}"),
            }
        }
    }
}

#[test]
fn a_session_is_used_again() {
    let numbers = &mut Numbers(21);
    let m = gram(40, 25, 0.0, numbers);
    for m in [Matrix::from(m.clone()), m.to_csc().into()] {
        for name in ALL {
            let mut session =
                registry::session::<Lcp>(name, &from_texts::<&str>(&[]).unwrap()).unwrap();
            for share in [0.0, 0.4, 0.0] {
                let (_, w, q) = planted(&m, share, numbers);
                let problem = Lcp::new(m.clone(), q).unwrap();
                let mut point = problem.origin();
                let limits = Limits { tolerance: 1e-11, ..Limits::default() };
                let outcome = session.solve(&problem, &mut point, &limits, &mut |_| {}).unwrap();
                assert_eq!(outcome.status, Status::Solved, "{name}: {:?}", outcome.measure);
                assert!(off(&w_of(&problem, &point.z), &w) < 1e-8);
            }
        }
    }
}

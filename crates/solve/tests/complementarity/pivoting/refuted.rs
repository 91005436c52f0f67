//! Problems without a solution, and their certificates.

use nonsmooth_linalg::Dense;
use nonsmooth_problem::check::Certificate;
use nonsmooth_problem::planted::classics;
use nonsmooth_problem::{Lcp, Problem};
use nonsmooth_solve::Status;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::{ALL, solve};

#[test]
fn rows_refute_before_the_first_pivot() {
    let example = classics::minus_one_infeasible();
    for name in ALL {
        let solved = solve(name, &[], &example.problem);
        assert!(matches!(solved.outcome.status, Status::Infeasible(_)), "{name}");
        assert_eq!(
            solved.outcome.status.certificate(),
            Some(&Certificate::Row { row: 0 }),
            "{name}"
        );
    }
    let m = Dense::from_rows(&[[1.0, 0.5, 0.0], [0.0, 2.0, 1.0], [-1.0, 0.0, -3.0]]).unwrap();
    let problem = Lcp::new(m, vec![-1.0, -1.0, -1e-7]).unwrap();
    for name in ALL {
        let solved = solve(name, &[], &problem);
        assert!(matches!(solved.outcome.status, Status::Infeasible(_)), "{name}");
        assert_eq!(
            solved.outcome.status.certificate(),
            Some(&Certificate::Row { row: 2 }),
            "{name}"
        );
    }
}

#[test]
fn enumeration_proves_that_there_is_no_solution() {
    for example in [classics::murty_2_2(), classics::murty_2_9(), classics::pang_perturbed()] {
        let solved = solve("enumeration", &[], &example.problem);
        let Status::Infeasible(certificate) = &solved.outcome.status else {
            panic!("{}: {}", example.name, solved.outcome.status);
        };
        assert!(example.problem.verify(certificate.certificate()));
        // The same vectors say nothing of the problem with another right-hand side.
        let other = Lcp::new(example.problem.M.clone(), vec![1.0; example.problem.dim()]).unwrap();
        assert!(!other.verify(certificate.certificate()));
    }
}

/// PSD with dependent rows and a right-hand side that they contradict: both methods for sufficient matrices prove it.
#[test]
fn contradicting_rows_are_proved() {
    for seed in 0..20 {
        let mut rng = Pcg64::seed_from_u64(seed);
        let n = [4, 10, 30, 60][seed as usize % 4];
        let problem = contradiction(n, &mut rng);
        for (name, settings) in
            [("criss_cross", vec![]), ("keller", vec![]), ("keller", vec!["least_index=true"])]
        {
            // The bases of criss-cross are any, and soon as badly conditioned as M itself.
            if name == "criss_cross" && n > 30 {
                continue;
            }
            let solved = solve(name, &settings, &problem);
            assert_eq!(
                solved.status(),
                "infeasible",
                "{name} seed {seed}: {}",
                solved.outcome.status
            );
        }
        if n <= 10 {
            assert_eq!(solve("enumeration", &[], &problem).status(), "infeasible");
        }
    }
}

/// M = G Gᵀ with `yᵀ G = 0`, y ≥ 0, and `qᵀ y < 0`, in whole numbers, so that it is so exactly.
fn contradiction(n: usize, rng: &mut Pcg64) -> Lcp {
    let rank = n / 2;
    let mut g: Vec<Vec<f64>> =
        (0..n).map(|_| (0..rank).map(|_| f64::from(rng.random_range(-4..=4))).collect()).collect();
    // The last row is minus a positive combination of some others.
    let y: Vec<f64> = (0..n - 1).map(|_| f64::from(rng.random_range(0..=3))).collect();
    g[n - 1] = (0..rank).map(|k| -(0..n - 1).map(|i| y[i] * g[i][k]).sum::<f64>()).collect();
    let m = Dense::from_fn(n, n, |i, j| g[i].iter().zip(&g[j]).map(|(a, b)| a * b).sum());
    let mut q: Vec<f64> = (0..n).map(|_| f64::from(rng.random_range(-4..=4))).collect();
    q[n - 1] = -1.0 - (0..n - 1).map(|i| y[i] * q[i]).sum::<f64>();
    Lcp::new(m, q).unwrap()
}

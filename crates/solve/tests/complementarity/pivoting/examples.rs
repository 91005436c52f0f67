//! Every method on the examples of the literature: solved with a known solution, refuted, or a named end.

use nonsmooth_linalg::Dense;
use nonsmooth_problem::planted::classics::{self, Costs, Known};
use nonsmooth_problem::{Lcp, Problem};
use nonsmooth_solve::Status;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::{ALL, close, eliminate, from, largest, solve};

/// Every method, every example: solved with a known solution, infeasible where there is none, or a named end. Never a false word.
#[test]
fn no_method_is_wrong_on_any_example() {
    let mut table = String::new();
    for example in classics::all() {
        for name in ALL {
            let solved = solve(name, &[], &example.problem);
            table += &format!(
                "{:28} {:15} {:4} {}\n",
                example.name, name, solved.pivots, solved.outcome.status
            );
            match &solved.outcome.status {
                Status::Solved => {
                    let tolerance = 1e-11 * largest(&solved.z).max(1e-3);
                    assert!(example.has(&solved.z, tolerance), "{name} {example:?} {:?}", solved.z);
                }
                Status::Infeasible(certificate) => {
                    assert_eq!(example.known, Known::Nothing, "{name} {}", example.name);
                    assert!(example.problem.verify(certificate.certificate()));
                }
                Status::Stalled(_) => assert!(solved.account.len() < 3),
                other => panic!("{name} {}: {other}", example.name),
            }
        }
    }
    println!("{table}");
}

/// Enumeration leaves nothing open.
#[test]
fn enumeration_decides_every_example() {
    for example in classics::all() {
        let solved = solve("enumeration", &[], &example.problem);
        match &example.known {
            Known::Nothing => assert_eq!(solved.status(), "infeasible", "{}", example.name),
            _ => assert_eq!(solved.status(), "solved", "{}", example.name),
        }
    }
}

/// The examples with a P-matrix: everything solves them.
#[test]
fn p_matrices_are_solved_by_all() {
    let examples = [
        classics::murty_exponential(6, Costs::Ones),
        classics::murty_exponential(6, Costs::Differences),
        classics::murty_exponential(6, Costs::Powers),
        classics::murty_exponential_reversed(6, Costs::Differences),
        classics::fathi(8),
        classics::fathi(100),
        classics::fathi_reversed(8),
        classics::csizmadia(20),
        classics::csizmadia_ones(20),
        classics::kostreva(),
        classics::kostreva_scaled(),
        classics::ben_gharbia_gilbert(3),
        classics::ben_gharbia_gilbert(6),
        classics::ahn(8),
        classics::geiger_kanzow(8),
        classics::two_by_two(),
        classics::ortiz(),
        classics::reciprocals(9),
    ];
    for example in &examples {
        for name in ALL.iter().filter(|n| **n != "enumeration" || example.problem.dim() <= 20) {
            let solved = solve(name, &[], &example.problem);
            assert_eq!(solved.status(), "solved", "{name} {}", example.name);
            let z = example.solution().unwrap();
            assert!(close(&solved.z, z, 1e-12) || largest(z) == 0.0, "{name} {}", example.name);
        }
    }
}

/// What is sufficient is solved, or refuted, by the methods that are made for it.
#[test]
fn sufficient_matrices_are_solved_or_refuted() {
    let examples = [
        classics::murty_2_8(),
        classics::psd_segment(),
        classics::psd_half_line(),
        classics::path_manual(),
        classics::beale(),
        classics::floudas_10_2_9(10.0),
        classics::floudas_10_2_9(23.0),
        classics::floudas_10_2_9(100.0),
    ];
    for example in &examples {
        for (name, settings) in [
            ("criss_cross", vec![]),
            ("criss_cross", vec!["descending=true"]),
            ("keller", vec![]),
            ("keller", vec!["least_index=true"]),
        ] {
            let solved = solve(name, &settings, &example.problem);
            assert_eq!(solved.status(), "solved", "{name} {settings:?} {}", example.name);
            assert!(example.has(&solved.z, 1e-11 * largest(&solved.z)), "{name} {}", example.name);
        }
    }
}

#[test]
fn least_index_pivots_are_as_many_as_the_literature_says() {
    for costs in [Costs::Ones, Costs::Differences, Costs::Powers] {
        for n in [3, 6, 10] {
            let worst = (1 << n) - 1;
            let example = classics::murty_exponential(n, costs);
            assert_eq!(solve("murty", &[], &example.problem).pivots, worst);
            assert_eq!(solve("criss_cross", &[], &example.problem).pivots, worst);
            assert_eq!(solve("murty", &["descending=true"], &example.problem).pivots, 1);
            let example = classics::murty_exponential_reversed(n, costs);
            assert_eq!(solve("murty", &[], &example.problem).pivots, 1);
            assert_eq!(solve("murty", &["descending=true"], &example.problem).pivots, worst);
        }
    }
    // Floudas 10.2.1, the explcp of MCPLIB.
    let example = classics::murty_exponential(16, Costs::Ones);
    let solved = solve("murty", &[], &example.problem);
    assert_eq!((solved.pivots, solved.z.as_slice()), (65_535, example.solution().unwrap()));
    assert_eq!(solve("murty", &[], &classics::fathi(8).problem).pivots, 1);
    assert_eq!(solve("murty", &[], &classics::fathi_reversed(8).problem).pivots, 255);
    assert_eq!(solve("murty", &[], &classics::kostreva().problem).pivots, 5);
    assert_eq!(solve("murty", &[], &classics::csizmadia(8).problem).pivots, 0);
    assert_eq!(solve("murty", &[], &classics::csizmadia_ones(8).problem).pivots, 8);
}

#[test]
fn cycles_are_named_and_protection_ends_them() {
    let example = classics::kostreva_scaled();
    let plain = solve("bard", &["protect=false"], &example.problem);
    assert_eq!(plain.status(), "stalled");
    assert!(plain.outcome.status.to_string().contains("the pivots cycle"));
    let protected = solve("bard", &[], &example.problem);
    assert_eq!(protected.status(), "solved");
    assert!(protected.account.iter().any(|a| a.contains("came back")));
    assert!(close(&protected.z, example.solution().unwrap(), 1e-14));

    for n in [3, 4, 5, 6, 7, 8, 9] {
        // The example with z and w exchanged, so that the points of the cycle, what is negative set to zero, are no solutions: M⁻¹, z = e.
        let example = classics::ben_gharbia_gilbert(n);
        let old = example.problem.M.to_dense().unwrap();
        let all: Vec<usize> = (0..n).collect();
        let column = |j: usize| {
            let unit: Vec<f64> = (0..n).map(|i| if i == j { -1.0 } else { 0.0 }).collect();
            eliminate(&old, &unit, &all).unwrap()
        };
        let columns: Vec<Vec<f64>> = (0..n).map(column).collect();
        let m = Dense::from_fn(n, n, |i, j| columns[j][i]);
        let q = (0..n).map(|i| -m.row(i).iter().sum::<f64>()).collect();
        let problem = Lcp::new(m, q).unwrap();
        let mut rng = Pcg64::seed_from_u64(n as u64);
        let mut cycles = 0;
        for _ in 0..200 {
            let start: Vec<f64> =
                (0..n).map(|_| rng.random_range(-1000.0..1000.0_f64).max(0.0)).collect();
            let plain = ["fallback=false"];
            let plain = from("block_pivoting", &plain, &problem, start.clone()).unwrap();
            if plain.status() == "stalled" {
                assert!(plain.outcome.status.to_string().contains("cycle"), "n = {n}");
                cycles += 1;
            }
            let protected = from("block_pivoting", &[], &problem, start).unwrap();
            assert_eq!(protected.status(), "solved", "n = {n}");
            assert!(close(&protected.z, &vec![1.0; n], 1e-13));
            let singles = !protected.account[0].contains(" 0 of them");
            assert_eq!(singles, plain.status() == "stalled", "{:?}", protected.account);
        }
        assert!(cycles > 0, "n = {n}");
    }
}

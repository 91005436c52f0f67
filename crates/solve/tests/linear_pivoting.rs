//! Pivoting methods on linear complementarity problems: worked examples, pivot counts, certificates, random problems of known class.

use nonsmooth_linalg::{Csc, Dense, Matrix};
use nonsmooth_problem::check::Certificate;
use nonsmooth_problem::planted::classics::{self, Classic, Costs, Known};
use nonsmooth_problem::{Lcp, LcpPoint, Mlcp, Problem};
use nonsmooth_solve::complementarity::pivoting::all_solutions;
use nonsmooth_solve::registry::{self, Registered};
use nonsmooth_solve::settings::from_texts;
use nonsmooth_solve::trace::Trace;
use nonsmooth_solve::{Limits, Outcome, SolveError, Status};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// What a solve came to.
struct Solved {
    outcome: Outcome,
    z: Vec<f64>,
    pivots: usize,
    account: Vec<String>,
}

impl Solved {
    fn status(&self) -> &'static str {
        self.outcome.status.name()
    }
}

/// Solves from a point to the accuracy that direct methods reach.
fn from<P: Registered + Problem<Point = LcpPoint>>(
    name: &str,
    settings: &[&str],
    problem: &P,
    z: Vec<f64>,
) -> Result<Solved, SolveError> {
    let map = from_texts(settings).expect("key=value");
    let mut session = registry::session::<P>(name, &map)?;
    let mut point = LcpPoint { z };
    let limits =
        Limits { tolerance: 1e-12, max_iterations: 200_000, trace: true, ..Limits::default() };
    let outcome = session.solve(problem, &mut point, &limits, &mut |_| {})?;
    let Trace::Pivots(rows) = session.trace() else {
        return Ok(Solved { outcome, z: point.z, pivots: 0, account: session.account() });
    };
    Ok(Solved { outcome, z: point.z, pivots: rows.len(), account: session.account() })
}

fn solve<P: Registered + Problem<Point = LcpPoint>>(
    name: &str,
    settings: &[&str],
    problem: &P,
) -> Solved {
    from(name, settings, problem, problem.origin().z).expect("the method applies")
}

/// The methods with the classes of matrices they are made for.
const ALL: [&str; 6] = ["murty", "bard", "criss_cross", "keller", "block_pivoting", "enumeration"];

/// `M z + q`.
fn w_of(problem: &Lcp, z: &[f64]) -> Vec<f64> {
    let mut w = vec![0.0; z.len()];
    problem.M.mul(z, &mut w);
    w.iter_mut().zip(&problem.q).for_each(|(w, q)| *w += q);
    w
}

fn close(a: &[f64], b: &[f64], relative: f64) -> bool {
    let scale = b.iter().fold(f64::MIN_POSITIVE, |l, x| l.max(x.abs()));
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= relative * scale)
}

fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |l, x| l.max(x.abs()))
}

// ------------------------------------------------------------------------------------------------ worked examples

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

// ------------------------------------------------------------------------------------------------ no solution

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

// ------------------------------------------------------------------------------------------------ all solutions

#[test]
fn every_solution_of_every_example_is_listed() {
    for example in classics::all() {
        let found = all_solutions(&example.problem, 1000).unwrap();
        assert!(found.complete, "{}", example.name);
        match &example.known {
            Known::Solutions(all) => {
                assert_eq!(found.faces.len(), all.len(), "{}: {found:?}", example.name);
                for face in &found.faces {
                    assert_eq!(face.dimension, 0, "{}", example.name);
                    assert!(example.has(&face.z, 1e-11 * largest(&face.z).max(1e-3)));
                }
                for z in all {
                    assert!(found.faces.iter().any(
                        |f| close(&f.z, z, 1e-10) || largest(z) == 0.0 && largest(&f.z) == 0.0
                    ));
                }
            }
            Known::Segment(ends) => {
                let [face] = &found.faces[..] else { panic!("{found:?}") };
                assert_eq!((face.dimension, face.ends.len(), face.rays.len()), (1, 2, 0));
                assert!(ends.iter().all(|e| face.ends.iter().any(|f| close(f, e, 1e-12))));
                assert!(example.has(&face.z, 1e-12));
            }
            Known::HalfLine([end, direction]) => {
                let [face] = &found.faces[..] else { panic!("{found:?}") };
                assert_eq!((face.dimension, face.ends.len(), face.rays.len()), (1, 1, 1));
                assert!(close(&face.ends[0], end, 1e-12) && close(&face.rays[0], direction, 1e-12));
                assert!(example.has(&face.z, 1e-12));
            }
            Known::Nothing => assert_eq!(found.faces, []),
        }
    }
    let three = all_solutions(&classics::floudas_10_2_4().problem, 100).unwrap();
    assert_eq!((three.isolated().count(), three.families().count()), (3, 0));
    let stopped = all_solutions(&classics::floudas_10_2_4().problem, 1).unwrap();
    assert!(!stopped.complete && stopped.faces.len() == 1);
}

/// Enumeration against plain testing of all 2ⁿ bases by elimination.
#[test]
fn all_solutions_against_all_bases() {
    let mut rng = Pcg64::seed_from_u64(5);
    for _ in 0..200 {
        let n = rng.random_range(1..6);
        let m = Dense::from_fn(n, n, |_, _| rng.random_range(-1.0..1.0));
        let q: Vec<f64> = (0..n).map(|_| rng.random_range(-1.0..1.0)).collect();
        let problem = Lcp::new(m.clone(), q.clone()).unwrap();
        let mut all = vec![];
        for set in 0..1_usize << n {
            let alpha: Vec<usize> = (0..n).filter(|i| set >> i & 1 == 1).collect();
            let mut z = vec![0.0; n];
            if let Some(x) = eliminate(&m, &q, &alpha) {
                alpha.iter().zip(x).for_each(|(i, x)| z[*i] = x);
                let w = w_of(&problem, &z);
                if z.iter().all(|z| *z >= 0.0) && w.iter().all(|w| *w >= -1e-12) {
                    all.push(z);
                }
            }
        }
        let found = all_solutions(&problem, 1000).unwrap();
        assert_eq!(found.isolated().count(), all.len(), "{m:?} {q:?}");
        for face in &found.faces {
            assert!(all.iter().any(|z| close(z, &face.z, 1e-8) || largest(z) == 0.0));
        }
        let solved = solve("enumeration", &[], &problem);
        assert_eq!(solved.status(), if all.is_empty() { "infeasible" } else { "solved" });
    }
}

/// `M_αα x = −q_α`.
fn eliminate(m: &Dense, q: &[f64], alpha: &[usize]) -> Option<Vec<f64>> {
    let k = alpha.len();
    let mut a: Vec<Vec<f64>> =
        alpha.iter().map(|&i| alpha.iter().map(|&j| m[(i, j)]).chain([-q[i]]).collect()).collect();
    for c in 0..k {
        let p = (c..k).max_by(|x, y| a[*x][c].abs().total_cmp(&a[*y][c].abs()))?;
        a.swap(c, p);
        let pivot = a[c].clone();
        if pivot[c].abs() < 1e-12 {
            return None;
        }
        for (r, row) in a.iter_mut().enumerate().filter(|(r, _)| *r != c) {
            let _ = r;
            let factor = row[c] / pivot[c];
            row.iter_mut().zip(&pivot).for_each(|(x, p)| *x -= factor * p);
        }
    }
    Some((0..k).map(|c| a[c][k] / a[c][c]).collect())
}

// ------------------------------------------------------------------------------------------------ random problems

/// A problem with a planted solution: (z > 0, w = 0), (0, w > 0), and a share of degenerate pairs (0, 0).
fn planted(m: Dense, degenerate: f64, rng: &mut Pcg64) -> (Lcp, Vec<f64>) {
    let n = m.nrows();
    let (mut z, mut w) = (vec![0.0; n], vec![0.0; n]);
    for i in 0..n {
        let value = rng.random_range(1.0..2.0);
        if rng.random_range(0.0..1.0) >= degenerate {
            if rng.random_range(0.0..1.0) < 0.5 { z[i] = value } else { w[i] = value }
        }
    }
    let q =
        (0..n).map(|i| w[i] - m.row(i).iter().zip(&z).map(|(m, z)| m * z).sum::<f64>()).collect();
    (Lcp::new(m, q).unwrap(), z)
}

/// `AᵀA + B + diag(d)`, B skew: positive definite, not symmetric.
fn p_matrix(n: usize, rng: &mut Pcg64) -> Dense {
    let a = Dense::from_fn(n, n, |_, _| rng.random_range(-5.0..5.0));
    let mut m = Dense::zeros(n, n);
    for k in 0..n {
        let row = a.row(k).to_vec();
        for i in 0..n {
            let x = row[i];
            m.row_mut(i).iter_mut().zip(&row).for_each(|(m, y)| *m += x * y);
        }
    }
    for i in 0..n {
        m[(i, i)] += rng.random_range(0.0..0.3);
        for j in 0..i {
            let b = rng.random_range(-5.0..5.0);
            m[(i, j)] += b;
            m[(j, i)] -= b;
        }
    }
    m
}

/// `G Gᵀ` of rank n/2 with repeated rows: contacts of a rigid body, hyperstatic.
fn redundant(n: usize, rng: &mut Pcg64) -> Dense {
    let rank = (n / 2).max(1);
    let g: Vec<Vec<f64>> =
        (0..n).map(|_| (0..rank).map(|_| rng.random_range(-1.0..1.0)).collect()).collect();
    let of = |i: usize| &g[if i % 5 == 4 { i - 1 } else { i }];
    Dense::from_fn(n, n, |i, j| of(i).iter().zip(of(j)).map(|(a, b)| a * b).sum())
}

/// The optimality conditions of a quadratic program: `[H −Aᵀ; A 0]` with repeated rows of A and integers, so that ties are exact.
fn program(n: usize, rng: &mut Pcg64) -> Dense {
    let p = n / 2;
    let a = Dense::from_fn(n - p, p, |_, _| f64::from(rng.random_range(-2..3)));
    let of = |i: usize| if i % 3 == 2 { i - 1 } else { i };
    Dense::from_fn(n, n, |i, j| match (i < p, j < p) {
        (true, true) if i == j => 1.0,
        (true, false) => -a[(of(j - p), i)],
        (false, true) => a[(of(i - p), j)],
        _ => 0.0,
    })
}

#[test]
fn random_p_matrices() {
    let mut rng = Pcg64::seed_from_u64(1);
    for n in [1, 2, 5, 12, 40, 100, 200] {
        for degenerate in [0.0, 0.1, 0.5] {
            let (problem, z) = planted(p_matrix(n, &mut rng), degenerate, &mut rng);
            for name in ALL.iter().filter(|name| n <= 12 || **name != "enumeration") {
                // The least index is exponential in the worst case, and slow in all.
                if n > 40 && ["murty", "criss_cross"].contains(name) {
                    continue;
                }
                let solved = solve(name, &[], &problem);
                assert_eq!(solved.status(), "solved", "{name} n = {n} {}", solved.outcome.status);
                assert!(close(&solved.z, &z, 1e-9), "{name} n = {n}");
            }
        }
    }
}

#[test]
fn random_semidefinite_matrices_with_redundant_rows() {
    let mut rng = Pcg64::seed_from_u64(2);
    for n in [2, 5, 10, 20, 40, 100, 200] {
        for degenerate in [0.0, 0.3] {
            let (problem, z) = planted(redundant(n, &mut rng), degenerate, &mut rng);
            let w = w_of(&problem, &z);
            for (name, settings) in [
                ("criss_cross", vec![]),
                ("keller", vec![]),
                ("keller", vec!["least_index=true"]),
                ("enumeration", vec![]),
            ] {
                if (name == "enumeration" && n > 10) || (name == "criss_cross" && n > 40) {
                    continue;
                }
                let solved = solve(name, &settings, &problem);
                assert_eq!(solved.status(), "solved", "{name} n = {n} {}", solved.outcome.status);
                // M symmetric and semidefinite: w is unique, z need not be.
                let found = w_of(&problem, &solved.z);
                assert!(close(&found, &w, 1e-9 * largest(&z) * n as f64), "{name} n = {n}");
            }
        }
    }
}

#[test]
fn degenerate_programs_with_many_ties() {
    let mut rng = Pcg64::seed_from_u64(3);
    for n in [6, 10, 20, 40, 100, 200] {
        for degenerate in [0.0, 0.5, 0.9] {
            let m = program(n, &mut rng);
            let (mut z, mut w) = (vec![0.0; n], vec![0.0; n]);
            for i in 0..n {
                if rng.random_range(0.0..1.0) >= degenerate {
                    let value = f64::from(rng.random_range(1..4));
                    if rng.random_range(0.0..1.0) < 0.5 { z[i] = value } else { w[i] = value }
                }
            }
            let q = (0..n)
                .map(|i| w[i] - m.row(i).iter().zip(&z).map(|(m, z)| m * z).sum::<f64>())
                .collect();
            let problem = Lcp::new(m, q).unwrap();
            for (name, settings) in [
                ("criss_cross", vec![]),
                ("keller", vec![]),
                ("keller", vec!["least_index=true"]),
                ("enumeration", vec![]),
            ] {
                if (name == "enumeration" && n > 10) || (name == "criss_cross" && n > 40) {
                    continue;
                }
                let solved = solve(name, &settings, &problem);
                assert_eq!(solved.status(), "solved", "{name} n = {n} {}", solved.outcome.status);
                // H is definite: x is unique.
                let off = solved.z[..n / 2].iter().zip(&z).map(|(a, b)| (a - b).abs());
                assert!(off.fold(0.0, f64::max) < 1e-9, "{name} n = {n}");
            }
        }
    }
}

#[test]
fn rows_and_columns_of_any_scale() {
    let mut rng = Pcg64::seed_from_u64(4);
    for n in [5, 20, 60] {
        let (problem, z) = planted(p_matrix(n, &mut rng), 0.1, &mut rng);
        let known = Known::Solutions(vec![z]);
        let plain = Classic { name: "random", problem, known };
        let mut factors =
            || (0..n).map(|_| 10f64.powf(rng.random_range(-6.0..6.0))).collect::<Vec<_>>();
        let scaled = classics::scaled(&plain, &factors(), &factors());
        for name in ["bard", "keller", "block_pivoting", "murty"] {
            if name == "murty" && n > 20 {
                continue;
            }
            let solved = solve(name, &[], &scaled.problem);
            assert_eq!(solved.status(), "solved", "{name} n = {n} {}", solved.outcome.status);
            let known = scaled.solution().unwrap();
            let off = solved.z.iter().zip(known).map(|(a, b)| (a - b).abs() / b.max(1e-300));
            let off = off.zip(known).filter(|(_, b)| **b > 0.0).map(|(o, _)| o).fold(0.0, f64::max);
            assert!(off < 1e-8, "{name} n = {n}: {off:.1e}");
        }
    }
}

#[test]
fn a_solution_as_the_start_costs_no_pivot() {
    let mut rng = Pcg64::seed_from_u64(6);
    let (problem, z) = planted(p_matrix(50, &mut rng), 0.0, &mut rng);
    // Near the solution, but not at it: the basis is right.
    let near: Vec<f64> = z.iter().map(|z| 1.001 * z).collect();
    for name in ["murty", "bard", "criss_cross", "keller", "block_pivoting"] {
        let solved = from(name, &[], &problem, near.clone()).unwrap();
        assert_eq!((solved.status(), solved.pivots), ("solved", 0), "{name}");
        assert!(close(&solved.z, &z, 1e-10));
    }
}

// ------------------------------------------------------------------------------------------------ mixed problems

/// A mixed problem with a planted solution, A nonsingular or zero.
#[test]
fn mixed_problems() {
    let mut rng = Pcg64::seed_from_u64(7);
    for n in [1, 3, 6, 20] {
        for m in [1, 4, 8, 30] {
            for saddle in [false, true] {
                if saddle && n > m {
                    continue;
                }
                let size = n + m;
                let base = p_matrix(size, &mut rng);
                let mut matrix = base.clone();
                if saddle {
                    // [0 C; −Cᵀ B], B definite: A is singular.
                    for i in 0..n {
                        for j in 0..n {
                            matrix[(i, j)] = 0.0;
                        }
                        for j in n..size {
                            matrix[(j, i)] = -base[(i, j)];
                        }
                    }
                } else if n > 1 {
                    // Rows of A in another order: no usable diagonal.
                    for j in 0..size {
                        matrix[(0, j)] = base[(n - 1, j)];
                        matrix[(n - 1, j)] = base[(0, j)];
                    }
                }
                let mut z: Vec<f64> = (0..size).map(|_| rng.random_range(-1.0..1.0)).collect();
                let mut w = vec![0.0; size];
                for i in n..size {
                    w[i] = (-z[i]).max(0.0);
                    z[i] = z[i].max(0.0);
                }
                if saddle {
                    // As many z as equations are needed for a solution to be regular.
                    for i in n..(2 * n).min(size) {
                        (z[i], w[i]) = (1.0, 0.0);
                    }
                }
                let product =
                    |i: usize| matrix.row(i).iter().zip(&z).map(|(m, z)| m * z).sum::<f64>();
                let q = (0..size).map(|i| w[i] - product(i)).collect();
                let problem = Mlcp::new(matrix.clone(), q, n).unwrap();
                for name in ALL {
                    if (m > 8 && ["enumeration", "murty", "criss_cross"].contains(&name))
                        || (saddle && ["murty", "bard", "block_pivoting"].contains(&name))
                    {
                        continue;
                    }
                    let solved = solve(name, &[], &problem);
                    let said = &solved.outcome.status;
                    assert_eq!(solved.status(), "solved", "{name} {n} {m} {saddle}: {said}");
                    assert!(close(&solved.z, &z, 1e-7), "{name} {n} {m} {saddle}");
                }
            }
        }
    }
}

#[test]
fn mixed_problems_of_any_shape() {
    // Two equal equations for one free variable: u + v = 1, 0 ≤ v ⟂ u ≥ 0.
    let m = Dense::from_rows(&[[1.0, 1.0], [1.0, 1.0], [1.0, 0.0]]).unwrap();
    let more = Mlcp::rectangular(m, vec![-1.0, -1.0, 0.0], 2, 1).unwrap();
    assert_eq!(solve("enumeration", &[], &more).status(), "solved");
    assert!(from("murty", &[], &more, vec![0.0; 2]).is_err_and(|e| e.is_inapplicable()));
    let mut both: Vec<_> =
        all_solutions(&more, 10).unwrap().isolated().map(|f| f.z.clone()).collect();
    both.sort_by(|a, b| a[0].total_cmp(&b[0]));
    assert!(close(&both[0], &[0.0, 1.0], 1e-14) && close(&both[1], &[1.0, 0.0], 1e-14));

    // Equations that contradict each other.
    let m = Dense::from_rows(&[[1.0, 1.0], [1.0, 1.0], [1.0, 0.0]]).unwrap();
    let none = Mlcp::rectangular(m, vec![-1.0, -2.0, 0.0], 2, 1).unwrap();
    let solved = solve("enumeration", &[], &none);
    assert!(matches!(solved.outcome.status, Status::Infeasible(_)));
    let certificate = solved.outcome.status.certificate();
    assert!(matches!(certificate, Some(Certificate::Farkas { .. })));

    // One equation for two free variables: a line of solutions.
    let m = Dense::from_rows(&[[1.0, 2.0, 0.0], [0.0, 0.0, 1.0]]).unwrap();
    let fewer = Mlcp::rectangular(m, vec![-1.0, -1.0], 1, 2).unwrap();
    assert_eq!(solve("enumeration", &[], &fewer).status(), "solved");
    let found = all_solutions(&fewer, 10).unwrap();
    assert_eq!((found.isolated().count(), found.families().next().unwrap().dimension), (0, 1));

    // An equation without entries: 0 = 0 is dropped, 0 = 1 is a contradiction.
    let m = Dense::from_rows(&[[0.0, 0.0], [0.0, 1.0]]).unwrap();
    let empty = Mlcp::new(m.clone(), vec![0.0, -1.0], 1).unwrap();
    let impossible = Mlcp::new(m, vec![1.0, -1.0], 1).unwrap();
    for name in ["murty", "bard", "criss_cross", "keller", "enumeration"] {
        assert_eq!(solve(name, &[], &empty).status(), "solved", "{name}");
        assert_eq!(solve(name, &[], &impossible).status(), "infeasible", "{name}");
    }
    // A free variable that only a pair's row mentions: the tableau methods say so.
    let m = Dense::from_rows(&[[0.0, 0.0], [1.0, 1.0]]).unwrap();
    let loose = Mlcp::new(m, vec![0.0, -1.0], 1).unwrap();
    assert!(from("keller", &[], &loose, vec![0.0; 2]).is_err_and(|e| e.is_inapplicable()));
    assert_eq!(solve("enumeration", &[], &loose).status(), "solved");
}

// ------------------------------------------------------------------------------------------------ what is refused

#[derive(Debug)]
struct Products;

impl nonsmooth_linalg::Operator for Products {
    fn nrows(&self) -> usize {
        2
    }
    fn ncols(&self) -> usize {
        2
    }
    fn mul(&self, x: &[f64], y: &mut [f64]) {
        y.copy_from_slice(x);
    }
    fn mul_transpose(&self, x: &[f64], y: &mut [f64]) {
        y.copy_from_slice(x);
    }
}

#[test]
fn what_does_not_apply_says_so() {
    let operator =
        Lcp::new(Matrix::Operator(std::sync::Arc::new(Products)), vec![-1.0; 2]).unwrap();
    for name in ALL {
        let refused = from(name, &[], &operator, vec![0.0; 2]);
        assert!(refused.is_err_and(|e| e.is_inapplicable()), "{name}");
    }
    let refused = from("enumeration", &["max_pairs=5"], &classics::fathi(6).problem, vec![0.0; 6]);
    assert!(refused.is_err_and(|e| e.to_string().contains("few complementary pairs")));
    let big = Csc::diagonal(&vec![1.0; 100_000]);
    let big = Lcp::new(big, vec![-1.0; 100_000]).unwrap();
    for name in ["murty", "bard", "criss_cross", "keller"] {
        let refused = from(name, &[], &big, vec![0.0; 100_000]);
        assert!(refused.is_err_and(|e| e.is_inapplicable()), "{name}");
    }
    assert_eq!(solve("block_pivoting", &[], &big).status(), "solved");
}

/// Problems of no class: an end with a name, an answer that the judge accepts, or a proof. Nothing runs on for ever.
#[test]
fn matrices_of_no_class_end_with_a_name() {
    let mut rng = Pcg64::seed_from_u64(8);
    for _ in 0..300 {
        let n = rng.random_range(1..9);
        let integer = rng.random_range(0..2) == 0;
        let mut entry = || match integer {
            true => f64::from(rng.random_range(-2..3)),
            false => rng.random_range(-1.0..1.0),
        };
        let m = Dense::from_fn(n, n, |_, _| entry());
        let q: Vec<f64> = (0..n).map(|_| entry()).collect();
        let problem = Lcp::new(m, q).unwrap();
        let exact = solve("enumeration", &[], &problem);
        assert!(
            ["solved", "infeasible"].contains(&exact.status()),
            "{problem:?} {}",
            exact.status()
        );
        for name in ALL {
            let solved = solve(name, &[], &problem);
            match solved.status() {
                "solved" => assert_eq!(exact.status(), "solved"),
                "infeasible" => assert_eq!(exact.status(), "infeasible"),
                "stalled" | "no_conclusion" => {}
                other => panic!("{name}: {other} {problem:?}"),
            }
        }
    }
}

// ------------------------------------------------------------------------------------------------ larger ones

/// The five-point Laplacian of an obstacle problem on a square.
fn obstacle(side: usize) -> Lcp {
    let n = side * side;
    let mut entries = vec![];
    for x in 0..side {
        for y in 0..side {
            let i = x * side + y;
            entries.push((i, i, 4.0));
            for (a, b) in [(x + 1, y), (x, y + 1)] {
                if a < side && b < side {
                    entries.push((i, a * side + b, -1.0));
                    entries.push((a * side + b, i, -1.0));
                }
            }
        }
    }
    let m = Csc::from_triplets(n, n, entries.into_iter()).unwrap();
    let wave = |i: usize| ((i / side) as f64 * 0.37).sin() * ((i % side) as f64 * 0.23).cos();
    Lcp::new(m, (0..n).map(|i| 0.1 * wave(i) - 0.02).collect()).unwrap()
}

#[test]
fn block_pivoting_takes_few_factorisations() {
    for side in [10, 30, 70] {
        let solved = solve("block_pivoting", &[], &obstacle(side));
        assert_eq!(solved.status(), "solved");
        assert!(solved.outcome.factorisations <= 20, "{}", solved.outcome.factorisations);
        println!("n = {}: {} factorisations", side * side, solved.outcome.factorisations);
    }
    let mut rng = Pcg64::seed_from_u64(9);
    let (problem, z) = planted(p_matrix(300, &mut rng), 0.1, &mut rng);
    let solved = solve("block_pivoting", &[], &problem);
    assert!(close(&solved.z, &z, 1e-8));
}

#[test]
#[ignore = "a minute"]
fn a_thousand_variables() {
    let mut rng = Pcg64::seed_from_u64(10);
    let (problem, z) = planted(p_matrix(1000, &mut rng), 0.1, &mut rng);
    for name in ["keller", "block_pivoting"] {
        let solved = solve(name, &[], &problem);
        let Outcome { seconds, factorisations, .. } = solved.outcome;
        println!(
            "{name}: {} pivots, {factorisations} factorisations, {seconds:.2} s",
            solved.pivots
        );
        assert_eq!(solved.status(), "solved");
        assert!(close(&solved.z, &z, 1e-7), "{name}");
    }
    let (problem, z) = planted(redundant(1000, &mut rng), 0.1, &mut rng);
    let solved = solve("keller", &[], &problem);
    println!("keller, semidefinite: {} pivots, {:.2} s", solved.pivots, solved.outcome.seconds);
    assert_eq!(solved.status(), "solved");
    assert!(close(&w_of(&problem, &solved.z), &w_of(&problem, &z), 1e-5));
    let solved = solve("block_pivoting", &[], &obstacle(300));
    println!("obstacle: {:?}", solved.outcome);
    assert_eq!(solved.status(), "solved");
}

// ------------------------------------------------------------------------------------------------ the corpus

/// Numbers of a file of Siconos, in order.
struct Tokens(std::vec::IntoIter<f64>);

impl Tokens {
    fn new(text: &str) -> Self {
        let numbers: Vec<f64> = text.split_whitespace().map_while(|t| t.parse().ok()).collect();
        Self(numbers.into_iter())
    }

    fn number(&mut self) -> f64 {
        self.0.next().expect("a number")
    }

    fn index(&mut self) -> usize {
        self.number() as usize
    }

    fn vector(&mut self, n: usize) -> Vec<f64> {
        (0..n).map(|_| self.number()).collect()
    }

    /// The dense matrix of a file: by columns. `None` of another storage.
    fn dense(&mut self) -> Option<Dense> {
        if self.index() != 0 {
            return None;
        }
        let _ = self.vector(2);
        let (rows, columns) = (self.index(), self.index());
        let values = self.vector(rows * columns);
        Some(Dense::from_fn(rows, columns, |i, j| values[j * rows + i]))
    }
}

fn corpus(folder: &str) -> Option<Vec<(String, String)>> {
    let Some(root) = std::env::var_os("NONSMOOTH_CORPUS") else {
        eprintln!("skipped: NONSMOOTH_CORPUS is not set");
        return None;
    };
    let folder = std::path::Path::new(&root).join(folder);
    let mut files: Vec<_> = std::fs::read_dir(folder)
        .expect("a folder")
        .filter_map(|entry| {
            let path = entry.ok()?.path();
            let name = path.file_name()?.to_string_lossy().into_owned();
            Some((name, std::fs::read_to_string(path).ok()?))
        })
        .collect();
    files.sort();
    Some(files)
}

/// The residual that the files' precision allows is reached, or the end has a name.
fn try_all<P: Registered + Problem<Point = LcpPoint>>(
    file: &str,
    problem: &P,
) -> Vec<&'static str> {
    let mut solved_by = vec![];
    for name in ALL.into_iter().chain(["enumeration_exact"]) {
        match from(name, &[], problem, problem.origin().z) {
            Err(refused) => {
                assert!(refused.is_inapplicable(), "{file} {name}: {refused}");
                println!("{file:36} {name:15} {refused}");
            }
            Ok(solved) => {
                println!("{file:36} {name:15} {:5} {}", solved.pivots, solved.outcome.status);
                match solved.outcome.status {
                    Status::Solved => solved_by.push(name),
                    Status::Infeasible(proof) => assert!(problem.verify(proof.certificate())),
                    Status::NearlyInfeasible { certificate, .. } => {
                        assert!(problem.evidence(&certificate).holds());
                    }
                    Status::Stalled(_) | Status::NoConclusion(_) => {}
                    Status::Limit(limit) => panic!("{file} {name}: {limit:?}"),
                }
            }
        }
    }
    solved_by
}

#[test]
fn lcp_files() {
    let Some(files) = corpus("lcp") else { return };
    for (file, text) in files {
        let mut tokens = Tokens::new(&text);
        let n = tokens.index();
        let Some(m) = tokens.dense() else { continue };
        let problem = Lcp::new(m, tokens.vector(n)).unwrap();
        let solved_by = try_all(&file, &problem);
        if file.contains("isolated_sol_perturbed") {
            assert!(solved_by.is_empty());
        } else if file.contains("tobenna") {
            // Neither P nor sufficient, and too many pairs unless they are asked for.
            let mut session =
                registry::session::<Lcp>("enumeration", &from_texts(&["max_pairs=40"]).unwrap());
            let mut point = problem.origin();
            let limits = Limits { max_iterations: 500, tolerance: 1e-10, ..Limits::default() };
            let session = session.as_mut().unwrap();
            let outcome = session.solve(&problem, &mut point, &limits, &mut |_| {}).unwrap();
            assert_eq!(outcome.status, Status::Solved);
        } else {
            assert!(!solved_by.is_empty(), "{file}");
            assert!(n > 20 || solved_by.contains(&"enumeration"), "{file}");
        }
    }
}

#[test]
fn mlcp_files() {
    let Some(files) = corpus("mlcp") else { return };
    for (file, text) in files {
        let mut tokens = Tokens::new(&text);
        let _ = tokens.vector(2);
        let (n, m) = (tokens.index(), tokens.index());
        let _ = tokens.vector(5);
        let Some(matrix) = tokens.dense() else { continue };
        if matrix.nrows() != matrix.ncols() {
            continue;
        }
        let problem = Mlcp::new(matrix, tokens.vector(n + m), n).unwrap();
        let solved_by = try_all(&file, &problem);
        // In BuckConverter powers of ten divide the rows: only fractions tell its cases apart.
        let enumerated = ["enumeration", "enumeration_exact"].iter().any(|n| solved_by.contains(n));
        assert!(m > 20 || enumerated, "{file}");
    }
}

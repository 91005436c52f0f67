//! Splitting and projection methods for linear complementarity problems: known, planted and published solutions, what they refuse, and what they promise.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use nonsmooth_linalg::{Csc, Dense, Matrix};
use nonsmooth_problem::planted::{JournalBearing, Membrane, energy, torsion};
use nonsmooth_problem::{BoxLcp, Lcp, LcpPoint, Mlcp, Problem};
use nonsmooth_solve::complementarity::quadratic::Mprgp;
use nonsmooth_solve::complementarity::splitting::{Direction, Psor, Rpsor, SplittingLs, Sweep};
use nonsmooth_solve::registry::{self, Registered};
use nonsmooth_solve::settings;
use nonsmooth_solve::{Limits, Outcome, Session, SolveError, Solver, Status};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

// ------------------------------------------------------------------------------------------------ tools

/// A solver with settings, as a command line has them: `psor omega=1.5 adapt=false`.
fn session<P: Registered>(label: &str) -> Box<dyn Session<P>> {
    let mut words = label.split(' ');
    let name = words.next().unwrap();
    let settings = settings::from_texts(&words.collect::<Vec<_>>()).unwrap();
    registry::session::<P>(name, &settings).unwrap()
}

fn limits(tolerance: f64, max_iterations: usize) -> Limits {
    Limits { tolerance, max_iterations, ..Limits::default() }
}

fn try_solve<P>(
    problem: &P,
    label: &str,
    limits: &Limits,
) -> Result<(Outcome, Vec<f64>), SolveError>
where
    P: Registered + Problem<Point = LcpPoint>,
{
    let mut point = problem.origin();
    let outcome = session::<P>(label).solve(problem, &mut point, limits, &mut |_| {})?;
    Ok((outcome, point.z))
}

/// The solution to 1e-10, and the number of steps.
fn solved<P>(problem: &P, label: &str) -> (Vec<f64>, usize)
where
    P: Registered + Problem<Point = LcpPoint>,
{
    let (outcome, z) = try_solve(problem, label, &limits(1e-10, 200_000)).unwrap();
    assert_eq!(outcome.status, Status::Solved, "{label}: {outcome:?}");
    (z, outcome.iterations)
}

fn refusal<P>(problem: &P, label: &str) -> String
where
    P: Registered + Problem<Point = LcpPoint>,
{
    let error = try_solve(problem, label, &Limits::default()).expect_err(label);
    assert!(error.is_inapplicable(), "{label}: {error}");
    error.to_string()
}

/// The largest difference relative to the largest entry of b.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    let size = b.iter().fold(f64::MIN_POSITIVE, |l, x| l.max(x.abs()));
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / size
}

/// Pseudo-random in (−1, 1), the same for the same indices.
struct Draw(Pcg64);

impl Draw {
    fn seeded(seed: u64) -> Self {
        Self(Pcg64::seed_from_u64(seed))
    }

    fn square(&mut self, n: usize) -> Dense {
        Dense::from_fn(n, n, |_, _| self.0.random_range(-1.0..1.0))
    }

    /// q such that z with about half of its entries zero solves LCP(M, q), strictly; and z.
    fn plant(&mut self, m: &Dense) -> (Vec<f64>, Vec<f64>) {
        let n = m.nrows();
        let (mut z, mut w) = (vec![0.0; n], vec![0.0; n]);
        for i in 0..n {
            let side = if self.0.random_range(0.0..1.0) < 0.5 { &mut z } else { &mut w };
            side[i] = self.0.random_range(1.0..2.0);
        }
        let mut q = vec![0.0; n];
        Matrix::from(m.clone()).mul(&z, &mut q);
        q.iter_mut().zip(&w).for_each(|(q, w)| *q = w - *q);
        (q, z)
    }
}

/// `AᵀA/n + shift I`.
fn gram(a: &Dense, shift: f64) -> Dense {
    let n = a.nrows();
    Dense::from_fn(n, n, |i, j| {
        let sum: f64 = (0..n).map(|k| a[(k, i)] * a[(k, j)]).sum();
        sum / n as f64 + if i == j { shift } else { 0.0 }
    })
}

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

const SYMMETRIC: [&str; 10] = [
    "pgs",
    "pgs direction=symmetric",
    "psor",
    "psor omega=1.5 adapt=false",
    "psor direction=symmetric",
    "rpgs",
    "rpsor",
    "splitting_ls",
    "splitting_ls sweep=jacobi",
    "mprgp",
];

// ------------------------------------------------------------------------------------------------ planted and known solutions

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

// ------------------------------------------------------------------------------------------------ zero diagonals

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

// ------------------------------------------------------------------------------------------------ mixed problems and boxes

#[test]
fn free_variables_are_relaxed_without_projection() {
    let mut draw = Draw::seeded(60);
    let m = gram(&draw.square(30), 0.1);
    let (q, _) = draw.plant(&m);
    let problem = Mlcp::new(m, q, 8).unwrap();
    let (z, _) = solved(&problem, "mprgp");
    assert!(z[..8].iter().any(|z| *z < -1e-3), "some free variable is negative: {z:?}");
    for label in SYMMETRIC {
        assert!(distance(&solved(&problem, label).0, &z) < 1e-6, "{label}");
    }
    // The sign of an equality is free.
    let mut turned = problem.M.to_dense().unwrap();
    let mut q = problem.q.clone();
    for i in 0..8 {
        turned.row_mut(i).iter_mut().for_each(|x| *x = -*x);
        q[i] = -q[i];
    }
    let turned = Mlcp::new(turned, q, 8).unwrap();
    for label in ["pgs", "psor", "rpgs", "rpsor"] {
        assert!(distance(&solved(&turned, label).0, &z) < 1e-6, "{label}");
    }
}

#[test]
fn saddle_points_are_solved_whatever_the_sign_of_their_equalities() {
    let mut draw = Draw::seeded(61);
    let (h, a) = (gram(&draw.square(20), 0.2), draw.square(20));
    let mut found = vec![];
    for sign in [1.0, -1.0] {
        // Free multipliers first: [0 ±A; −Aᵀ H].
        let m = Dense::from_fn(25, 25, |i, j| match (i < 5, j < 5) {
            (true, true) => 0.0,
            (true, false) => sign * a[(i, j - 5)],
            (false, true) => -a[(j, i - 5)],
            (false, false) => h[(i - 5, j - 5)],
        });
        let q = (0..25).map(|i| if i < 5 { -sign } else { (i as f64).sin() }).collect::<Vec<_>>();
        for problem in [Mlcp::new(m.clone(), q.clone(), 5), Mlcp::new(m.to_csc(), q.clone(), 5)] {
            for label in ["rpgs", "rpsor"] {
                found.push(solved(&problem.clone().unwrap(), label).0);
            }
        }
    }
    for other in &found[1..] {
        assert!(distance(other, &found[0]) < 1e-6);
    }
}

#[test]
fn boxes() {
    let problem = torsion(14, 5.0);
    let (z, _) = solved(&problem, "mprgp");
    for label in SYMMETRIC {
        assert!(distance(&solved(&problem, label).0, &z) < 1e-6, "{label}");
    }
    assert!((0..z.len()).any(|i| z[i] == problem.upper[i]));
    // A fixed variable needs no diagonal; an infinite bound is none.
    let m = Dense::from_rows(&[[0.0, 1.0], [1.0, 2.0]]).unwrap();
    let (lower, upper) = (vec![3.0, f64::NEG_INFINITY], vec![3.0, 5.0]);
    let fixed = BoxLcp::new(m, vec![7.0, 1.0], lower, upper).unwrap();
    for label in ["pgs", "psor", "rpgs", "rpsor", "splitting_ls", "mprgp"] {
        assert!(distance(&solved(&fixed, label).0, &[3.0, -2.0]) < 1e-9, "{label}");
    }
}

// ------------------------------------------------------------------------------------------------ what the methods promise

#[test]
fn the_first_sweep_by_hand() {
    let m = Dense::from_rows(&[[2.0, 1.0], [3.0, 4.0]]).unwrap();
    let problem = Lcp::new(m, vec![-2.0, -8.0]).unwrap();
    let one = |omega| {
        let solver = Psor { omega, adapt: false, ..Psor::default() };
        let mut work = solver.work(&problem).unwrap();
        let mut point = LcpPoint { z: vec![1.0, 1.0] };
        solver.start(&problem, &mut point, &mut work);
        solver.step(&problem, &mut point, &mut work);
        point.z
    };
    // w_1 = 2 + 1 − 2 = 1; z_1 = 1 − ω/2. w_2 = 3 z_1 + 4 − 8; z_2 = 1 − ω/4 w_2.
    assert_eq!(one(1.0), [0.5, 1.0 + 2.5 / 4.0]);
    assert_eq!(one(1.5), [0.25, 1.0 + 1.5 * 3.25 / 4.0]);
    // RPSOR: units from balancing; a second sweep from the same centre feels ρ (z − z̃).
    let solver = Rpsor { omega: 1.0, adapt: false, fraction: 1e-9, ..Rpsor::default() };
    let zero = Lcp::new(Dense::from_rows(&[[0.0]]).unwrap(), vec![-1.0]).unwrap();
    let mut work = solver.work(&zero).unwrap();
    let mut point = zero.origin();
    solver.start(&zero, &mut point, &mut work);
    let mut seen = vec![];
    for _ in 0..3 {
        solver.step(&zero, &mut point, &mut work);
        seen.push(point.z[0]);
    }
    // ρ = 1: z = z̃ + 1; then nothing moves, and the centre does; then again.
    assert_eq!(seen, [1.0, 1.0, 2.0]);
}

#[test]
fn backward_sweeps_go_backward() {
    // U with 2 above the diagonal: backward substitution is one backward sweep.
    let m = Dense::from_fn(12, 12, |i, j| match i.cmp(&j) {
        std::cmp::Ordering::Equal => 1.0,
        std::cmp::Ordering::Less => 2.0,
        std::cmp::Ordering::Greater => 0.0,
    });
    let problem = Lcp::new(m, vec![-1.0; 12]).unwrap();
    let solver =
        Psor { omega: 1.0, adapt: false, direction: Direction::Symmetric, ..Psor::default() };
    let mut work = solver.work(&problem).unwrap();
    let mut point = problem.origin();
    solver.start(&problem, &mut point, &mut work);
    solver.step(&problem, &mut point, &mut work);
    solver.step(&problem, &mut point, &mut work);
    let mut known = vec![0.0; 12];
    known[11] = 1.0;
    assert_eq!(point.z, known);
}

#[test]
fn the_line_search_lowers_the_energy_in_every_step() {
    let mut draw = Draw::seeded(80);
    // Jacobi alone diverges on it: the largest eigenvalue is far above twice the diagonal.
    let m = gram(&Dense::from_fn(40, 40, |_, _| 1.0 + 0.3 * draw.0.random_range(-1.0..1.0)), 0.01);
    let (q, _) = draw.plant(&m);
    let problem = Lcp::new(m, q).unwrap();
    let (outcome, _) = try_solve(&problem, "projected_jacobi", &limits(1e-8, 5000)).unwrap();
    assert_ne!(outcome.status, Status::Solved);
    for sweep in [Sweep::Psor, Sweep::Jacobi] {
        let solver = SplittingLs { sweep, ..SplittingLs::default() };
        let mut work = solver.work(&problem).unwrap();
        let mut point = LcpPoint { z: vec![1.0; 40] };
        solver.start(&problem, &mut point, &mut work);
        let phi = |z: &[f64]| energy(&problem.M, &problem.q, z);
        let mut last = phi(&point.z);
        let first = last;
        for step in 0..150 {
            solver.step(&problem, &mut point, &mut work);
            let now = phi(&point.z);
            assert!(now <= last + 1e-12 * last.abs(), "{sweep:?} step {step}: {last} -> {now}");
            assert!(point.z.iter().all(|z| *z >= 0.0));
            last = now;
        }
        assert!(last < first - 0.1);
        let label = if sweep == Sweep::Psor { "splitting_ls" } else { "splitting_ls sweep=jacobi" };
        solved(&problem, label);
    }
}

#[test]
fn proportioning_lowers_the_energy_in_every_step() {
    let problem = torsion(20, 5.0);
    let solver = Mprgp::default();
    let mut work = solver.work(&problem).unwrap();
    let mut point = problem.origin();
    solver.start(&problem, &mut point, &mut work);
    let mut last = 0.0;
    for step in 0..60 {
        solver.step(&problem, &mut point, &mut work);
        let now = energy(&problem.M, &problem.q, &point.z);
        assert!(now <= last + 1e-14, "step {step}: {last} -> {now}");
        last = now;
    }
    assert!(last < -0.1);
}

#[test]
fn over_relaxation_that_follows_the_rate_takes_sweeps_in_proportion_to_the_side() {
    let sweeps = |n: usize, label: &str| {
        let problem = Membrane { load: -8.0, ..Membrane::square(n) }.above(bump);
        solved(&problem, label).1
    };
    let (small, large) = (sweeps(32, "psor"), sweeps(64, "psor"));
    assert!(large < 3 * small, "{small} {large}");
    assert!(3 * large < sweeps(64, "pgs"), "{large}");
    // Where the theory does not hold it does no great harm.
    let mut draw = Draw::seeded(90);
    let a = draw.square(40);
    let m = Dense::from_fn(40, 40, |i, j| (0..20).map(|k| a[(k, i)] * a[(k, j)]).sum());
    let (q, _) = draw.plant(&m);
    let problem = Lcp::new(m, q).unwrap();
    let (fixed, adapted) = (solved(&problem, "psor adapt=false").1, solved(&problem, "psor").1);
    assert!(adapted < 10 * fixed, "{fixed} {adapted}");
}

#[test]
fn a_start_near_the_solution_pays() {
    let problem = Membrane { load: -8.0, ..Membrane::square(40) }.above(bump);
    for label in SYMMETRIC {
        let (z, from_zero) = solved(&problem, label);
        let mut near = LcpPoint { z: z.iter().map(|z| z * (1.0 + 1e-6)).collect() };
        let outcome =
            session::<Lcp>(label).solve(&problem, &mut near, &limits(1e-10, 100_000), &mut |_| {});
        let outcome = outcome.unwrap();
        assert_eq!(outcome.status, Status::Solved, "{label}");
        assert!(outcome.iterations < from_zero, "{label}: {} {from_zero}", outcome.iterations);
    }
}

#[test]
fn refusals_say_what_is_missing() {
    let lcp = |rows: &[&[f64]]| {
        Lcp::new(Dense::from_rows(rows).unwrap(), vec![-1.0; rows.len()]).unwrap()
    };
    let zero = lcp(&[&[1.0, 1.0], &[-1.0, 0.0]]);
    for label in ["pgs", "psor"] {
        let text = refusal(&zero, label);
        assert!(text.contains("positive diagonal") && text.contains("M[1, 1] = 0"), "{text}");
        assert!(text.contains("rpsor"), "it says who can: {text}");
    }
    for label in ["splitting_ls", "mprgp"] {
        let text = refusal(&zero, label);
        assert!(text.contains("symmetric M") && text.contains("2.0e0"), "{text}");
    }
    let negative = lcp(&[&[1.0, 0.0], &[0.0, -1.0]]);
    for label in ["rpgs", "rpsor", "mprgp"] {
        let text = refusal(&negative, label);
        assert!(text.contains("M[1, 1] = -1"), "{text}");
    }
    let products = Membrane::square(5).above_by_products(|_, _| -1.0);
    for label in ["pgs", "psor", "rpgs", "rpsor", "splitting_ls"] {
        let text = refusal(&products, label);
        assert!(text.contains("entries of M") && text.contains("operator"), "{text}");
    }
    let more = Mlcp::rectangular(
        Dense::from_rows(&[[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]).unwrap(),
        vec![1.0; 3],
        2,
        1,
    );
    for label in SYMMETRIC {
        let text = refusal(more.as_ref().unwrap(), label);
        assert!(text.contains("2 equalities and 1 free"), "{text}");
    }
    let free = Mlcp::new(Dense::from_rows(&[[0.0, 1.0], [-1.0, 1.0]]).unwrap(), vec![1.0; 2], 1);
    let text = refusal(&free.unwrap(), "psor");
    assert!(text.contains("nonzero diagonal of M at free variables"), "{text}");
    for wrong in [
        "psor omega=2",
        "rpsor rho=0",
        "rpsor fraction=1",
        "mprgp expansion=2",
        "pgs check_every=0",
    ] {
        let mut words = wrong.split(' ');
        let (name, text) = (words.next().unwrap(), words.next().unwrap());
        let settings = settings::from_texts(&[text]).unwrap();
        let error =
            registry::session::<Lcp>(name, &settings).map(|_| ()).expect_err(wrong).to_string();
        assert!(error.contains(text.split('=').next().unwrap()), "{error}");
    }
}

#[test]
fn hopeless_problems_end_without_a_false_answer() {
    // A cycle of PGS on a P-matrix (Kostreva), and divergence on a P-matrix that is not H.
    let kostreva = Dense::from_rows(&[[1.0, 2.0, 0.0], [0.0, 1.0, 2.0], [2.0, 0.0, 1.0]]).unwrap();
    let kostreva = Lcp::new(kostreva, vec![-1.0; 3]).unwrap();
    let mut draw = Draw::seeded(70);
    let a = draw.square(20);
    let turning =
        Dense::from_fn(20, 20, |i, j| 3.0 * (a[(i, j)] - a[(j, i)]) + f64::from(u8::from(i == j)));
    let (q, _) = draw.plant(&turning);
    let turning = Lcp::new(turning, q).unwrap();
    for problem in [&kostreva, &turning] {
        for label in ["projected_jacobi", "pgs", "psor"] {
            let (outcome, z) = try_solve(problem, label, &limits(1e-8, 5000)).unwrap();
            assert_ne!(outcome.status, Status::Solved, "{label}");
            assert!(z.iter().all(|z| z.is_finite()), "{label}: the best point is a point");
        }
        // Regularisation mends both.
        solved(problem, "rpgs");
    }
}

// ------------------------------------------------------------------------------------------------ published optima

/// Solves with two methods that share nothing; the energy must be the published one to its last digit.
fn optimum<P>(
    title: &str,
    problem: &P,
    m: &Matrix,
    q: &[f64],
    published: f64,
    digits: i32,
) -> Vec<f64>
where
    P: Registered + Problem<Point = LcpPoint>,
{
    let (a, _) = solved(problem, "psor");
    let (b, _) = solved(problem, "mprgp");
    for z in [&a, &b] {
        let found = energy(m, q, z);
        let last = 10f64.powi(-digits);
        assert!((found - published).abs() < 1.01 * last, "{title}: {found} for {published}");
    }
    assert!(distance(&a, &b) < 1e-7, "{title}");
    b
}

#[test]
fn obstacle_problems_of_cutest() {
    let one = |x: f64, y: f64| (3.3 * x).sin() * (3.2 * y).sin();
    let two = |x: f64, y: f64| (9.3 * x).sin() * (9.2 * y).sin();
    // Points a side with the rim; OBSTCLAE, OBSTCLBL.
    let published = [
        (4, 0.753659753, -0.0081108),
        (10, 1.397897560, 2.87503823),
        (23, 1.678027027, 6.51932527),
        (32, 1.748270031, 6.88708670),
    ];
    for (side, a, b) in published {
        let membrane = Membrane { rim: 0.5, ..Membrane::square(side - 2) };
        let above = membrane.between(one, |_, _| 2000.0);
        optimum("OBSTCLAE", &above, &above.M, &above.q, a, 8);
        let between = membrane.between(|x, y| two(x, y).powi(3), |x, y| two(x, y).powi(2) + 0.02);
        optimum("OBSTCLBL", &between, &between.M, &between.q, b, 7);
    }
}

#[test]
fn elastic_plastic_torsion_of_cutest() {
    for (q, published) in [(2, -5.1851852e-1), (5, -4.9234185e-1), (11, -4.5608771e-1)] {
        let problem = torsion(2 * q - 2, 5.0);
        optimum("TORSION1", &problem, &problem.M, &problem.q, published, 8);
    }
}

#[test]
fn journal_bearings() {
    for (nx, ny, published, digits, zeros) in
        [(20, 20, -0.17997935, 8, 130), (50, 50, -0.180488, 6, 824), (50, 75, -0.18067495, 8, 1236)]
    {
        let problem = JournalBearing { nx, ny, ..JournalBearing::default() }.lcp();
        let z = optimum("bearing", &problem, &problem.M, &problem.q, published, digits);
        assert_eq!(z.iter().filter(|z| **z == 0.0).count(), zeros);
    }
}

#[test]
fn the_obstacle_problem_of_mcplib() {
    let s = |x: f64, y: f64| (9.2 * x).sin() * (9.3 * y).sin();
    let problem =
        Membrane::square(50).between(|x, y| s(x, y).powi(3), |x, y| s(x, y).powi(2) + 0.2);
    let z = optimum("obstacle", &problem, &problem.M, &problem.q, 5.8308523184, 9);
    let at = |bound: &[f64]| z.iter().zip(bound).filter(|(z, b)| z == b).count();
    assert_eq!((at(&problem.lower), at(&problem.upper)), (137, 294));
}

// ------------------------------------------------------------------------------------------------ size

/// An obstacle that a membrane under a downward load touches in a region with a wavy rim.
fn bump(x: f64, y: f64) -> f64 {
    let (x, y) = (x - 0.5, y - 0.5);
    0.3 - 4.0 * (x * x + y * y) + 0.02 * (20.0 * x).sin() * (17.0 * y).sin()
}

fn large(side: usize, steps: usize) {
    let membrane = Membrane { load: -1.0, ..Membrane::square(side) };
    let problem = membrane.above(bump);
    let (outcome, z) = try_solve(&problem, "psor", &limits(1e-8, steps)).unwrap();
    let Outcome { iterations, seconds, .. } = outcome;
    println!("psor, {side} x {side}: {iterations} sweeps, {seconds:.1} s");
    assert_eq!(outcome.status, Status::Solved, "{outcome:?}");
    let touching = z.iter().filter(|z| **z == 0.0).count();
    assert!(touching > side * side / 100 && touching < side * side / 2);
    // Products only, and from the solution of the sweeps: mprgp must agree that it is one.
    let by_products = membrane.above_by_products(bump);
    let mut point = LcpPoint { z };
    let outcome = session::<Lcp>("mprgp")
        .solve(&by_products, &mut point, &limits(1e-8, 2000), &mut |_| {})
        .unwrap();
    assert_eq!(outcome.status, Status::Solved, "{outcome:?}");
}

#[test]
fn a_hundred_thousand_variables() {
    large(300, 5000);
}

#[test]
#[ignore = "minutes: a million variables"]
fn a_million_variables() {
    large(1000, 20_000);
}

#[test]
fn an_operator_is_solved_by_its_products() {
    let membrane = Membrane { load: -1.0, ..Membrane::square(60) };
    let (known, _) = solved(&membrane.above(bump), "psor");
    for label in ["mprgp", "projected_jacobi"] {
        let (outcome, z) =
            try_solve(&membrane.above_by_products(bump), label, &limits(1e-9, 100_000)).unwrap();
        assert_eq!(outcome.status, Status::Solved, "{label}");
        assert!(distance(&z, &known) < 1e-5, "{label}");
    }
}

// ------------------------------------------------------------------------------------------------ workspaces

thread_local! {
    static WATCHED: Cell<bool> = const { Cell::new(false) };
    static CALLS: Cell<usize> = const { Cell::new(0) };
}

struct Counting;

#[global_allocator]
static ALLOCATOR: Counting = Counting;

// SAFETY: every request is passed on to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        if WATCHED.try_with(Cell::get).unwrap_or(false) {
            CALLS.set(CALLS.get() + 1);
        }
        // SAFETY: the caller's guarantees are those that `System` asks for.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(at, layout) }
    }
}

#[test]
fn a_second_solve_of_the_same_shape_allocates_nothing() {
    let problem = |load| Membrane { load, ..Membrane::square(12) }.above(bump);
    let (first, second) = (problem(-1.0), problem(-3.0));
    let other = Membrane { load: -1.0, ..Membrane::square(5) }.above(bump);
    for label in SYMMETRIC.into_iter().chain(["projected_jacobi"]) {
        let mut session = session::<Lcp>(label);
        let mut point = first.origin();
        let limits = limits(1e-8, 100_000);
        session.solve(&first, &mut point, &limits, &mut |_| {}).unwrap();
        let mut again = second.origin();
        CALLS.set(0);
        WATCHED.set(true);
        let outcome = session.solve(&second, &mut again, &limits, &mut |_| {});
        WATCHED.set(false);
        assert_eq!(outcome.unwrap().status, Status::Solved, "{label}");
        assert_eq!(CALLS.get(), 0, "{label}");
        assert!(distance(&again.z, &solved(&second, "psor").0) < 1e-4, "{label}");
        // Another shape in the same workspace.
        let mut smaller = other.origin();
        let outcome = session.solve(&other, &mut smaller, &limits, &mut |_| {}).unwrap();
        assert_eq!(outcome.status, Status::Solved, "{label}");
    }
}

// ------------------------------------------------------------------------------------------------ corpus

#[test]
fn the_corpus_problem_mmc() {
    let Ok(corpus) = std::env::var("NONSMOOTH_CORPUS") else {
        eprintln!("SKIPPED: NONSMOOTH_CORPUS is not set");
        return;
    };
    let text = std::fs::read_to_string(format!("{corpus}/lcp/lcp_mmc.dat")).unwrap();
    let mut numbers = text.split_whitespace().map_while(|t| t.parse::<f64>().ok());
    let n = numbers.next().unwrap() as usize;
    let mut numbers = numbers.skip(5);
    // By columns.
    let columns: Vec<_> = (0..n * n).map(|k| (k % n, k / n, numbers.next().unwrap())).collect();
    let m = Csc::from_triplets(n, n, columns.into_iter()).unwrap();
    let problem = Lcp::new(m, numbers.take(n).collect()).unwrap();
    let (z, _) = solved(&problem, "mprgp");
    for label in ["pgs", "psor", "rpsor", "rpgs"] {
        assert!(distance(&solved(&problem, label).0, &z) < 1e-6, "{label}");
    }
}

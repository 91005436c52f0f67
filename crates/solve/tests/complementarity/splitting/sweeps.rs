//! What single sweeps do: by hand, backward, down in energy, faster where the rate allows.

use nonsmooth_linalg::Dense;
use nonsmooth_problem::planted::{Membrane, Torsion, energy};
use nonsmooth_problem::{Lcp, LcpPoint, Problem};
use nonsmooth_solve::complementarity::quadratic::Mprgp;
use nonsmooth_solve::complementarity::splitting::{Direction, Psor, Rpsor, SplittingLs, Sweep};
use nonsmooth_solve::{Solver, Status};
use rand::RngExt;

use super::{Draw, SYMMETRIC, bump, gram, limits, session, solved, try_solve};

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
    let problem = Torsion { n: 20, load: 5.0 }.boxed();
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

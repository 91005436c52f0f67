//! `auto` on contact problems: whatever start it is given.

use nonsmooth_linalg::{Bsr, Csc};
use nonsmooth_problem::planted::Planted;
use nonsmooth_problem::{FrictionGlobal, FrictionLocal, LocalPoint, Problem};
use nonsmooth_solve::existence::decide;
use nonsmooth_solve::registry::{Registered, session};
use nonsmooth_solve::settings::SettingsMap;
use nonsmooth_solve::{Limits, Outcome, Status};

/// A solve by `auto` from a point, which it overwrites; and its account.
fn solve<P: Registered>(problem: &P, point: &mut P::Point) -> (Outcome, String) {
    let mut auto = session::<P>("auto", &SettingsMap::new()).unwrap();
    let outcome = auto.solve(problem, point, &Limits::default(), &mut |_| {}).unwrap();
    assert_eq!(outcome.status, Status::Solved);
    (outcome, auto.account().join("; "))
}

/// From zero, from the solution, from near it, and from far away. `impulses` gives those of a point.
fn starts<P: Registered>(problem: &P, impulses: fn(&mut P::Point) -> &mut Vec<f64>) {
    let mut solution = problem.origin();
    let (cold, account) = solve(problem, &mut solution);
    assert!(cold.iterations > 0 && !account.contains("started"), "{account}");

    let mut point = solution.clone();
    let (outcome, account) = solve(problem, &mut point);
    assert!(outcome.iterations <= 1 && account.contains("from the point given"), "{account}");

    let mut near = solution.clone();
    impulses(&mut near).iter_mut().for_each(|r| *r *= 1.0 + 1e-6);
    let (outcome, account) = solve(problem, &mut near);
    assert!(outcome.iterations <= cold.iterations && account.contains("point given"));

    // Whatever comes is no worse than nothing: the same steps as from zero.
    for far in [1e3, -1e3, 1e200] {
        let mut point = solution.clone();
        impulses(&mut point).iter_mut().enumerate().for_each(|(i, r)| *r += far * (i + 1) as f64);
        let (outcome, account) = solve(problem, &mut point);
        assert_eq!(outcome.iterations, cold.iterations, "{far:e}");
        assert!(account.contains("started from zero"), "{account}");
        assert_eq!(impulses(&mut point), impulses(&mut solution), "{far:e}");
    }
}

#[test]
fn a_start_is_taken_where_it_is_better_than_zero() {
    let planted = Planted { contacts: 30, dofs: 100, seed: 4, ..Planted::default() };
    let bilateral = Planted { bilateral: 2, ..planted };
    starts::<FrictionLocal<3>>(&planted.local().0, |p| &mut p.r);
    starts::<FrictionLocal<2>>(&bilateral.local().0, |p| &mut p.r);
    starts::<FrictionGlobal<3>>(&bilateral.global().0, |p| &mut p.r);
    starts::<FrictionGlobal<2>>(&planted.global().0, |p| &mut p.r);
}

#[test]
fn contacts_that_came_and_went_are_no_reason_to_refuse_a_neighbours_impulses() {
    for seed in 0..6 {
        let case = Planted { contacts: 200, dofs: 700, seed, ..Planted::default() };
        let (mut problem, _) = case.local::<3>();
        let mut near = problem.origin();
        solve(&problem, &mut near);
        // The next step: loads that differ by a hundredth, and every twentieth contact is new.
        problem.q.iter_mut().enumerate().for_each(|(i, q)| *q *= 1.0 + 0.01 * (i as f64).sin());
        (0..200).step_by(20).for_each(|c| near.r[3 * c..3 * c + 3].fill(0.0));
        let mut cold = problem.origin();
        let (cold, _) = solve(&problem, &mut cold);
        let (warm, account) = solve(&problem, &mut near);
        assert!(account.contains("started from the point given"), "{seed}: {account}");
        assert!(warm.iterations <= cold.iterations + 20, "{seed}: {account}");
    }
}

#[test]
fn of_several_solutions_the_one_given_stays() {
    // Two contacts of one body at one place share their load as they like; a sweep from zero gives the first all of it.
    let entries = (0..4).flat_map(|i| [(i, i % 2, 1.0), (i, i % 2 + 2, 1.0)]);
    let w = Bsr::from_csc(&Csc::from_triplets(4, 4, entries).unwrap());
    let problem = FrictionLocal::<2>::new(w, vec![-1.0, 0.0, -1.0, 0.0], vec![0.5, 0.5]).unwrap();
    let mut point = problem.origin();
    point.r.copy_from_slice(&[0.5, 0.0, 0.5, 0.0]);
    solve(&problem, &mut point);
    assert_eq!(point.r, [0.5, 0.0, 0.5, 0.0]);
}

#[test]
fn sweeps_that_run_away_end_no_solve() {
    // With this much friction Gauss–Seidel diverges, and a few dozen sweeps leave the range of numbers.
    for dofs in [100, 200] {
        let case = Planted { contacts: 200, dofs, mu: (2.0, 2.0), seed: 11, ..Planted::default() };
        let (problem, _) = case.local::<3>();
        let limits = Limits { max_iterations: 300, ..Limits::default() };
        let mut auto = session("auto", &SettingsMap::new()).unwrap();
        let outcome = auto.solve(&problem, &mut problem.origin(), &limits, &mut |_| {}).unwrap();
        assert!(matches!(outcome.status, Status::Limit(_) | Status::Solved), "{outcome:?}");
    }
}

#[test]
fn a_problem_at_rest_without_impulses_refuses_every_start() {
    let (mut problem, _) = Planted::default().local::<3>();
    problem.q.fill(0.0);
    let mut point = LocalPoint { r: vec![1.0; problem.q.len()], ..problem.origin() };
    let (_, account) = solve(&problem, &mut point);
    assert!(account.contains("started from zero") && point.r.iter().all(|r| *r == 0.0));
}

/// `W = B Bᵀ` and `q = u − W r`, of which r and u, which obey the law, are a solution.
fn planted_at<const D: usize, const N: usize, const RANK: usize>(
    b: [[f64; RANK]; N],
    mu: f64,
    [r, u]: [[f64; N]; 2],
) -> FrictionLocal<D> {
    let w = |i: usize, j: usize| (0..RANK).map(|k| b[i][k] * b[j][k]).sum::<f64>();
    let entries = (0..N * N).map(|k| (k / N, k % N, w(k / N, k % N)));
    let q = (0..N).map(|i| u[i] - (0..N).map(|j| w(i, j) * r[j]).sum::<f64>()).collect();
    let w = Bsr::from_csc(&Csc::from_triplets(N, N, entries).unwrap());
    FrictionLocal::new(w, q, vec![mu; N / D]).unwrap()
}

/// A solve that ends by convex problems with given sliding speeds, twice the same.
fn ends_by_speeds<P: Registered>(problem: &P, impulses: fn(&P::Point) -> &[f64]) {
    let mut point = problem.origin();
    let (outcome, account) = solve(problem, &mut point);
    assert!(account.contains("convex problems with given sliding speeds"), "{account}");
    // It needs no change of strategy, each of which takes hundreds of factorisations.
    assert!(outcome.iterations < 300 && !account.contains("strategy"), "{account}");
    let mut again = problem.origin();
    let (other, _) = solve(problem, &mut again);
    assert_eq!(other.iterations, outcome.iterations);
    assert_eq!(impulses(&again), impulses(&point));
}

#[test]
fn much_friction_on_few_degrees_of_freedom_ends_by_given_speeds() {
    // Sweeps diverge and Newton's iterations go round, for thousands of iterations of all other stages.
    let b =
        [[0.14, -0.26], [-0.59, -0.19], [0.07, 1.09], [0.06, -0.55], [0.07, 0.45], [0.28, -0.53]];
    let [x, y]: [f64; 2] = [-0.51, 0.53];
    let slide = 2.0 * 0.14 / x.hypot(y);
    let r = [0.56, 1.07, -0.15, 0.14, -slide * x, -slide * y];
    let u = [0.0, 0.0, 0.0, 0.0, x, y];
    ends_by_speeds::<FrictionLocal<3>>(&planted_at(b, 2.0, [r, u]), |p| p.r.as_slice());
    let b = [
        [0.311, 0.107, -0.138, -0.538, -0.07, -1.138],
        [0.183, 0.009, 0.072, 0.099, -0.209, -0.379],
        [-0.209, 0.037, 0.298, 0.122, 0.696, -0.534],
        [0.206, 0.363, 0.548, 0.34, 0.262, 0.691],
        [-0.014, -0.764, 0.005, 0.05, -0.026, 0.313],
        [-0.358, 0.177, 0.265, -0.836, -0.737, 0.211],
        [0.144, -0.266, 0.662, -0.098, -0.309, -0.538],
        [-0.21, 0.066, -0.085, -0.122, 0.921, -0.481],
        [0.206, 0.138, -0.289, -0.253, -0.117, 0.567],
        [-0.174, 0.15, -0.115, 0.879, -0.856, -0.629],
    ];
    let r = [0.648, 3.055, 1.145, 0.247, 0.006, 0.03, 0.266, 0.014, 0.123, -0.141];
    let u = [0.0, 0.0, 0.0, 0.0, 0.0, -0.601, 0.0, 0.0, 0.0, 0.0];
    ends_by_speeds::<FrictionLocal<2>>(&planted_at(b, 5.0, [r, u]), |p| p.r.as_slice());
}

/// W of rank one and q = u − W r of planted u and r, rounded: exactly there is no solution, by the last digit.
#[test]
fn what_rounding_made_inconsistent_is_solved() {
    let planar = |w: &[f64], q: &[f64], mu: f64| {
        let n = q.len();
        let entries = w.iter().enumerate().map(|(k, x)| (k / n, k % n, *x));
        let w = Bsr::from_csc(&Csc::from_triplets(n, n, entries).unwrap());
        FrictionLocal::<2>::new(w, q.to_vec(), vec![mu; n / 2]).unwrap()
    };
    let two = planar(
        &[
            0.10064162747049198,
            0.5778420547602496,
            -0.34126951572995845,
            -0.03500529473975491,
            0.5778420547602496,
            3.3177269549565547,
            -1.9594265628728362,
            -0.2009857347133901,
            -0.34126951572995845,
            -1.9594265628728362,
            1.1572237581383285,
            0.11870078300674584,
            -0.03500529473975491,
            -0.2009857347133901,
            0.11870078300674584,
            0.012175584702029884,
        ],
        &[0.3770723195021314, 3.11118015237501, -1.278628844802757, -0.9675141639705952],
        0.3,
    );
    let three = planar(
        &[
            1293485.675042144,
            384121.79550660576,
            252181.3847213012,
            -514309.0883638353,
            -113516.00357592764,
            608599.9559970534,
            384121.79550660576,
            114071.27008067655,
            74889.40013914897,
            -152732.52288723274,
            -33710.43990177851,
            180733.74321305304,
            252181.3847213012,
            74889.40013914897,
            49165.94905303523,
            -100271.05872209696,
            -22131.379977496006,
            118654.25540152144,
            -514309.0883638353,
            -152732.52288723274,
            -100271.05872209696,
            204496.92136329305,
            45135.646602301196,
            -241988.36878260478,
            -113516.00357592764,
            -33710.43990177851,
            -22131.379977496006,
            45135.646602301196,
            9962.138210328592,
            -53410.59133029825,
            608599.9559970534,
            180733.74321305304,
            118654.25540152144,
            -241988.36878260478,
            -53410.59133029825,
            286353.31151042494,
        ],
        &[
            -413200.42641820107,
            -122706.64666980805,
            -80558.64685024749,
            164294.61780917592,
            36262.37382283734,
            -194415.8604055121,
        ],
        0.3,
    );
    for problem in [two, three] {
        let existence = decide(&problem, &Limits::default());
        assert_eq!(existence.name(), "no_solution", "{existence}");
        solve(&problem, &mut problem.origin());
    }
}

/// Masses on the nodes of a grid of side `n`, coupled by springs to their neighbours, implicit in time: all of M is one component, so that W is condensed. The lowest layer is
/// on the ground, and all is pushed down and, more and more along one axis, to the side.
fn springs(n: usize, stiffness: f64) -> FrictionGlobal<3> {
    let node = |i: usize, j: usize, k: usize| i + n * (j + n * k);
    let all = || (0..n).flat_map(move |k| (0..n).flat_map(move |j| (0..n).map(move |i| (i, j, k))));
    let mut entries = vec![];
    for (i, j, k) in all() {
        let a = node(i, j, k);
        entries.extend((0..3).map(|d| (3 * a + d, 3 * a + d, 1.0)));
        let next = [(i + 1, j, k), (i, j + 1, k), (i, j, k + 1)];
        for (i, j, k) in next.into_iter().filter(|&(i, j, k)| i.max(j).max(k) < n) {
            let b = node(i, j, k);
            for d in 0..3 {
                let (a, b) = (3 * a + d, 3 * b + d);
                let ends = [(a, a, 1.0), (b, b, 1.0), (a, b, -1.0), (b, a, -1.0)];
                entries.extend(ends.map(|(i, j, x)| (i, j, stiffness * x)));
            }
        }
    }
    let (dofs, contacts) = (3 * n * n * n, n * n);
    let mass = Csc::from_triplets(dofs, dofs, entries.into_iter()).unwrap();
    // N, T1, T2 are z, x, y of a node of the lowest layer, whose places come first.
    let axes = |c: usize| [(3 * c + 2, 3 * c), (3 * c, 3 * c + 1), (3 * c + 1, 3 * c + 2)];
    let h = Csc::from_triplets(
        dofs,
        3 * contacts,
        (0..contacts).flat_map(|c| axes(c).map(|(row, column)| (row, column, 1.0))),
    )
    .unwrap();
    let f = all().flat_map(|(i, _, _)| [0.12 * i as f64, 0.02, -0.5]).collect();
    FrictionGlobal::new(mass, h, f, vec![0.0; 3 * contacts], vec![0.4; contacts]).unwrap()
}

#[test]
fn what_costs_more_than_a_step_is_not_looked_at_after_each() {
    let problem = springs(7, 300.0);
    let mut auto = session("auto", &SettingsMap::new()).unwrap();
    let mut point = problem.origin();
    let outcome = auto.solve(&problem, &mut point, &Limits::default(), &mut |_| {}).unwrap();
    let (looks, account) = (auto.history().len(), auto.account().join("; "));
    assert_eq!(outcome.status, Status::Solved);
    assert!(
        outcome.iterations >= 15 && 3 * looks < outcome.iterations,
        "{looks} of {}: {account}",
        outcome.iterations
    );
    // By another method, and in other coordinates.
    let mut other = problem.origin();
    let nsgs = session("condense/nsgs", &SettingsMap::new());
    let limits = Limits { tolerance: 1e-10, ..Limits::default() };
    nsgs.unwrap().solve(&problem, &mut other, &limits, &mut |_| {}).unwrap();
    let apart = point.v.iter().zip(&other.v).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart < 1e-5, "{apart:e}");
}

#[test]
fn a_stiff_mass_matrix_is_no_reason_to_miss_a_tight_tolerance() {
    // The condensed W is wrong by the condition of M; what the last look found makes up for it.
    for stiffness in [1e3, 1e6, 1e8] {
        let problem = springs(5, stiffness);
        let mut auto = session("auto", &SettingsMap::new()).unwrap();
        let limits = Limits { tolerance: 1e-12, max_iterations: 100, ..Limits::default() };
        let outcome = auto.solve(&problem, &mut problem.origin(), &limits, &mut |_| {}).unwrap();
        assert_eq!(outcome.status, Status::Solved, "{stiffness:e}: {:?}", auto.account());
    }
}

#[test]
fn what_an_interior_point_leaves_where_it_is_is_looked_at_once() {
    let mu = (0.9, 0.9);
    let case = Planted { contacts: 40, dofs: 30, mu, seed: 2, ..Planted::default() };
    let (problem, _) = case.local::<3>();
    let mut auto = session("auto", &SettingsMap::new()).unwrap();
    let mut point = problem.origin();
    let outcome = auto.solve(&problem, &mut point, &Limits::default(), &mut |_| {}).unwrap();
    let (looks, account) = (auto.history().len(), auto.account());
    let interior = account.iter().find(|line| line.contains("interior-point")).unwrap();
    let iterations: usize = interior.split(' ').next().unwrap().parse().unwrap();
    assert_eq!(outcome.status, Status::Solved);
    // One at the start, one as the sweeps end, one as the interior point ends.
    assert!(
        iterations >= 10 && looks + iterations <= outcome.iterations + 2,
        "{looks} of {}: {account:?}",
        outcome.iterations
    );
}

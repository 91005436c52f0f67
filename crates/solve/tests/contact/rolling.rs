//! Rolling friction, five rows a contact: every solver that takes it on planted problems, in local and global form, and what is known of it from elsewhere.

use nonsmooth_linalg::{Bsr, Csc, norm};
use nonsmooth_problem::check::Judged;
use nonsmooth_problem::planted::{Planted, PlantedMix};
use nonsmooth_problem::{FrictionLocal, Problem, RollingGlobal, RollingLocal, Weighed};
use nonsmooth_solve::registry::{self, Registered, session};
use nonsmooth_solve::settings::SettingsMap;
use nonsmooth_solve::{Limits, Outcome, Status};

fn solve<P: Registered>(
    problem: &P,
    name: &str,
    tolerance: f64,
    most: usize,
) -> (Outcome, P::Point) {
    let mut session = session::<P>(name, &SettingsMap::new()).unwrap();
    let mut point = problem.origin();
    let limits = Limits { tolerance, max_iterations: most, ..Limits::default() };
    let outcome = session.solve(problem, &mut point, &limits, &mut |_| {}).unwrap();
    (outcome, point)
}

fn mixed() -> PlantedMix {
    PlantedMix { open: 1.0, stick: 2.0, slip: 1.0, degenerate: 0.0 }
}

#[test]
fn every_solver_finds_planted_solutions_in_both_forms() {
    let base = Planted { contacts: 12, dofs: 90, mix: mixed(), ..Planted::default() };
    let names: Vec<&str> = registry::abouts::<RollingLocal>().iter().map(|a| a.name).collect();
    assert!(names.len() >= 10 && names.contains(&"auto") && names.contains(&"ip"), "{names:?}");
    for seed in 0..3 {
        let case = Planted { seed, ..base.clone() };
        let (local, known) = case.rolling_local();
        let (global, _) = case.rolling_global();
        for name in &names {
            // First-order methods take their time.
            let slow = ["de_saxce", "fixed_point", "extragradient", "hyperplane"].contains(name);
            let tolerance = if slow { 1e-6 } else { 1e-9 };
            let (outcome, point) = solve(&local, name, tolerance, 100_000);
            assert_eq!(outcome.status, Status::Solved, "{name} seed {seed}: {outcome:?}");
            let far = point.r.iter().zip(&known.r).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
            assert!(far < 1e4 * tolerance, "{name} seed {seed}: {far:e}");
            let (outcome, _) = solve(&global, name, tolerance, 100_000);
            assert_eq!(outcome.status, Status::Solved, "global {name} seed {seed}: {outcome:?}");
        }
        for name in ["proximal/nsgs", "proximal/newton_ac"] {
            let (outcome, _) = solve(&local, name, 1e-9, 100_000);
            assert_eq!(outcome.status, Status::Solved, "{name} seed {seed}: {outcome:?}");
        }
        let (outcome, _) = solve(&global, "condense/auto", 1e-9, 100_000);
        assert_eq!(outcome.status, Status::Solved);
    }
}

#[test]
fn auto_solves_planted_problems_of_all_kinds_to_1e_12() {
    let all = PlantedMix { open: 1.0, stick: 1.0, slip: 1.0, degenerate: 1.0 };
    let base = Planted { contacts: 40, dofs: 120, mix: all, ..Planted::default() };
    for case in [
        base.clone(),
        Planted { seed: 1, mu: (0.0, 0.0), ..base.clone() },
        Planted { seed: 2, mu_r: (0.0, 0.0), ..base.clone() },
        Planted { seed: 3, mu: (0.0, 0.3), mu_r: (0.0, 0.05), ..base.clone() },
        Planted { seed: 4, skew: 0.02, ..base.clone() },
        Planted { seed: 5, bilateral: 6, ..base.clone() },
        // Hyperstatic.
        Planted { seed: 6, dofs: 48, mix: mixed(), ..base.clone() },
        Planted { seed: 7, mu_r: (1e-4, 1e-3), mix: mixed(), ..base.clone() },
        Planted { seed: 8, mu_r: (3.0, 8.0), mix: mixed(), ..base },
    ] {
        let (outcome, _) = solve(&case.rolling_local().0, "auto", 1e-12, 20_000);
        assert_eq!(outcome.status, Status::Solved, "{case:?}: {outcome:?}");
        let (outcome, _) = solve(&case.rolling_global().0, "auto", 1e-12, 20_000);
        assert_eq!(outcome.status, Status::Solved, "global {case:?}: {outcome:?}");
    }
}

/// W of the sliding part, with angular rows of its own and none between: `[N, T]` and `[R]` apart but through r_N.
fn with_rolling(problem: &FrictionLocal<3>, mu_r: f64) -> RollingLocal {
    let nc = problem.contacts();
    let w = problem.W.to_csc();
    let place = |i: usize| 5 * (i / 3) + i % 3;
    let sliding = w.triplets().map(|(i, j, x)| (place(i), place(j), x));
    // What rolls is coupled to the sliding rows of its own contact, so that R is not idle.
    let rolling = (0..nc).flat_map(|c| {
        let i = 5 * c;
        [(i + 3, i + 3, 2.0), (i + 4, i + 4, 3.0), (i + 1, i + 3, 0.2), (i + 3, i + 1, 0.2)]
    });
    let w = Csc::from_triplets(5 * nc, 5 * nc, sliding.chain(rolling)).unwrap();
    let mut q = vec![0.0; 5 * nc];
    problem.q.iter().enumerate().for_each(|(i, x)| q[place(i)] = *x);
    (0..nc).for_each(|c| q[5 * c + 4] = 0.3 * (c as f64).cos());
    RollingLocal::rolling(Bsr::from_csc(&w), q, problem.mu.clone(), vec![mu_r; nc]).unwrap()
}

#[test]
fn no_rolling_friction_is_coulombs_law() {
    for seed in 0..5 {
        let case = Planted { contacts: 10, dofs: 90, mix: mixed(), seed, ..Planted::default() };
        let (plain, _) = case.local::<3>();
        let (outcome, coulomb) = solve(&plain, "auto", 1e-13, 20_000);
        assert_eq!(outcome.status, Status::Solved);
        let (outcome, point) = solve(&with_rolling(&plain, 0.0), "auto", 1e-13, 20_000);
        assert_eq!(outcome.status, Status::Solved);
        for (i, r) in coulomb.r.iter().enumerate() {
            let found = point.r[5 * (i / 3) + i % 3];
            assert!((found - r).abs() < 1e-10 * norm(&coulomb.r), "seed {seed} entry {i}");
        }
        assert!((0..10).all(|c| point.r[5 * c + 3] == 0.0 && point.r[5 * c + 4] == 0.0));
    }
}

/// With mu_r beyond what moments ask for nothing rolls where there is pressure: u_R = 0 is a bilateral constraint of the pressed contacts.
#[test]
fn unlimited_rolling_friction_is_a_clamp() {
    use nonsmooth_problem::RowsLocal;
    for seed in 0..5 {
        let mix = PlantedMix { open: 0.0, stick: 1.0, slip: 1.0, degenerate: 0.0 };
        let case = Planted { contacts: 8, dofs: 90, mix, seed, ..Planted::default() };
        let (plain, _) = case.local::<3>();
        let rolling = with_rolling(&plain, 1e2);
        let (outcome, point) = solve(&rolling, "auto", 1e-13, 20_000);
        assert_eq!(outcome.status, Status::Solved);
        if !(0..8).all(|c| point.r[5 * c] > 1e-6) {
            continue;
        }
        // The same with V, R of the angular rows.
        let w = rolling.W.to_csc();
        let (angular, sliding) = (|i: usize| i % 5 > 2, |i: usize| 3 * (i / 5) + i % 5);
        let row = |i: usize| 2 * (i / 5) + i % 5 - 3;
        let v = w.triplets().filter(|e| !angular(e.0) && angular(e.1));
        let v = Csc::from_triplets(
            24,
            16,
            v.map(|(i, j, x)| (sliding(i), row(j), x)).collect::<Vec<_>>().into_iter(),
        );
        let r = w.triplets().filter(|e| angular(e.0) && angular(e.1));
        let r = Csc::from_triplets(
            16,
            16,
            r.map(|(i, j, x)| (row(i), row(j), x)).collect::<Vec<_>>().into_iter(),
        );
        let s = (0..40).filter(|&i| angular(i)).map(|i| rolling.q[i]).collect();
        let rows = RowsLocal::bilateral(v.unwrap(), r.unwrap(), s);
        let clamped =
            FrictionLocal::<3>::with_rows(plain.W.clone(), plain.q.clone(), plain.mu.clone(), rows);
        let (outcome, other) = solve(&clamped.unwrap(), "auto", 1e-13, 20_000);
        assert_eq!(outcome.status, Status::Solved);
        for i in 0..24 {
            let found = point.r[5 * (i / 3) + i % 3];
            assert!((found - other.r[i]).abs() < 1e-10 * norm(&other.r), "seed {seed} entry {i}");
        }
    }
}

/// A ball of radius R on a plane, for one step of length h: M, and H of its one contact.
fn ball(
    mass: f64,
    radius: f64,
    force: [f64; 3],
    start: [f64; 6],
    mu: f64,
    mu_r: f64,
    h: f64,
) -> RollingGlobal {
    let inertia = 0.4 * mass * radius * radius;
    let m = Csc::diagonal(&[mass, mass, mass, inertia, inertia, inertia]);
    // v = (velocity, angular velocity); the plane is z = 0. At the contact u_T = v_x − ω_y R... with r = −R e_z: ω × r = (−R ω_y, R ω_x, 0).
    let entries = [
        (2, 0, 1.0),
        (0, 1, 1.0),
        (4, 1, -radius),
        (1, 2, 1.0),
        (3, 2, radius),
        (3, 3, 1.0),
        (4, 4, 1.0),
    ];
    let jacobian = Csc::from_triplets(6, 5, entries.into_iter()).unwrap();
    let mut f: Vec<f64> = (0..3).map(|k| mass * start[k] + h * force[k]).collect();
    f.extend((3..6).map(|k| inertia * start[k]));
    RollingGlobal::rolling(m, jacobian, f, vec![0.0; 5], vec![mu], vec![mu_r]).unwrap()
}

/// A ball that rolls without slip slows down by (5/7) mu_r g/R; it rests on slopes up to tan α = mu_r/R.
#[test]
fn a_rolling_ball_slows_down_by_five_sevenths() {
    let (mass, radius, g, h) = (2.0, 0.1, 9.81, 1e-3);
    for mu_r in [0.001, 0.004, 0.01] {
        // Rolling along x: v_x = R ω_y.
        let start = [1.0, 0.0, 0.0, 0.0, 1.0 / radius, 0.0];
        let problem = ball(mass, radius, [0.0, 0.0, -mass * g], start, 0.5, mu_r, h);
        for name in ["auto", "nsgs", "newton_ac", "newton_nm", "ip", "extragradient"] {
            let (outcome, point) = solve(&problem, name, 1e-12, 100_000);
            assert_eq!(outcome.status, Status::Solved, "{name}");
            let slower = (start[0] - point.v[0]) / h;
            let known = 5.0 / 7.0 * mu_r * g / radius;
            assert!((slower / known - 1.0).abs() < 1e-8, "{name} mu_r {mu_r}: {slower} {known}");
            let verdict = problem.judge(&point, 1e-10).unwrap();
            assert!(verdict.solved && verdict.statuses[0].rolls, "{name}");
        }
    }
}

#[test]
fn a_ball_rests_on_slopes_up_to_mu_r_over_radius() {
    let (mass, radius, g, h) = (2.0, 0.1, 9.81, 1e-3);
    let mu_r = 0.01;
    for (share, rests) in [(0.5, true), (0.999, true), (1.001, false), (2.0, false)] {
        let slope = share * mu_r / radius;
        let angle = f64::atan(slope);
        let force = [mass * g * angle.sin(), 0.0, -mass * g * angle.cos()];
        let problem = ball(mass, radius, force, [0.0; 6], 0.5, mu_r, h);
        let (outcome, point) = solve(&problem, "auto", 1e-13, 20_000);
        assert_eq!(outcome.status, Status::Solved);
        assert_eq!(point.v[0].abs() < 1e-14, rests, "{share}: {}", point.v[0]);
        if !rests {
            // a = (5/7) g (sin α − mu_r/R cos α).
            let known = 5.0 / 7.0 * g * (angle.sin() - mu_r / radius * angle.cos());
            assert!((point.v[0] / h / known - 1.0).abs() < 1e-8);
        }
    }
}

#[test]
fn the_change_of_units_changes_no_bit() {
    let (problem, point) = Planted::default().rolling_local();
    let arms = problem.arms().unwrap();
    assert!(arms.iter().all(|a| a.log2().fract() == 0.0));
    let weighed = problem.weighed(&arms);
    let mut r = point.r.clone();
    RollingLocal::weigh(&arms, &mut r);
    let mut back = r.clone();
    RollingLocal::unweigh(&arms, &mut back);
    assert_eq!(back, point.r);
    let mut u = weighed.partner(&nonsmooth_problem::LocalPoint { r, lambda: vec![] });
    RollingLocal::weigh(&arms, &mut u);
    assert_eq!(u, problem.partner(&point));
    // Coulomb's law has none.
    assert!(Planted::default().local::<3>().0.arms().is_none());
}

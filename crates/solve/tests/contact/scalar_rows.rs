//! Scalar rows with bounds: the methods that know them, held against planted points, a second method and a closed form; the others refuse them by name.

use nonsmooth_linalg::{Bsr, Csc, norm};
use nonsmooth_problem::check::{Existence, Judged};
use nonsmooth_problem::planted::Planted;
use nonsmooth_problem::{
    Bounds, BoxLcp, FrictionGlobal, FrictionLocal, Problem, RowsGlobal, RowsLocal,
};
use nonsmooth_solve::registry::{self, Registered};
use nonsmooth_solve::{Limits, Solve, SolveError, Status, existence};

fn cases() -> impl Iterator<Item = Planted> {
    (0..9).map(|seed| Planted {
        contacts: 6,
        dofs: 48,
        bilateral: [0, 3, 2][seed as usize % 3],
        bounded: 1 + seed as usize % 4,
        seed,
        ..Planted::default()
    })
}

fn solved<P>(problem: &P, solver: &str) -> P::Point
where
    P: Registered + Judged + nonsmooth_problem::OfAny,
{
    let answer = Solve::new().solver(solver).tolerance(1e-10).run(problem).unwrap();
    assert_eq!(answer.status, Status::Solved, "{solver}: {:?}", answer.verdict.measure);
    answer.point
}

#[test]
fn planted_problems_are_solved_in_every_form() {
    for case in cases() {
        let (global, planted) = case.global::<3>();
        let points = ["nsgs", "auto", "condense/nsgs"].map(|s| solved(&global, s));
        for point in &points {
            // M is definite and the Jacobian of all rows has full rank: there is one motion.
            let gap: Vec<f64> = point.v.iter().zip(&planted.v).map(|(a, b)| a - b).collect();
            assert!(norm(&gap) < 1e-6 * norm(&planted.v), "{case:?} {:e}", norm(&gap));
        }
        let (local, _) = case.local::<2>();
        solved(&local, "nsgs");
        solved(&local, "auto");
        let (local, _) = case.local::<3>();
        solved(&local, "nsgs");
    }
}

/// A row that no impulse moves, at 1: its impulse is at its lower bound.
#[test]
fn rows_that_nothing_moves_go_to_their_bounds() {
    for g in [0.0, 1e-170, 1e-16, 1e-9] {
        let h = Csc::from_triplets(1, 2, [(0, 0, 1.0)].into_iter()).unwrap();
        let m = Csc::diagonal(&[1.0]);
        let mut problem =
            FrictionGlobal::<2>::new(m, h, vec![2.0], vec![0.0; 2], vec![0.0]).unwrap();
        let along = Csc::from_triplets(1, 1, [(0, 0, g)].into_iter()).unwrap();
        let bounds = Bounds { lower: vec![-1.0], upper: vec![1.0] };
        problem.rows = Some(RowsGlobal { G: along, b: vec![1.0], bounds });
        for solver in ["auto", "nsgs", "condense/nsgs"] {
            assert_eq!(solved(&problem, solver).lambda, [-1.0], "{solver} {g:e}");
        }
    }
}

/// A motor holds a part 2²⁷ times lighter than the body that the contact carries: sweeps think that they have arrived, relative to what the part would do without the motor.
#[test]
fn what_a_motor_holds_is_no_measure_of_a_contact() {
    let m = 2f64.powi(-27);
    let h = Csc::from_triplets(2, 2, [(0, 0, 1.0), (1, 0, 1.0)].into_iter()).unwrap();
    let g = Csc::from_triplets(2, 1, [(0, 0, 1.0)].into_iter()).unwrap();
    let f = vec![1.0, -1.0];
    let mut problem =
        FrictionGlobal::<2>::new(Csc::diagonal(&[m, 1.0]), h, f, vec![0.0; 2], vec![0.0]).unwrap();
    let bounds = Bounds { lower: vec![-4.0], upper: vec![4.0] };
    problem.rows = Some(RowsGlobal { G: g, b: vec![0.0], bounds });
    let answer = Solve::new().max_iterations(100_000).run(&problem).unwrap();
    assert_eq!(answer.status, Status::Solved, "{:?} {:?}", answer.account, answer.verdict.measure);
    assert!((answer.point.r[0] - 1.0).abs() < 1e-6, "{:?}", answer.point);
}

/// A limit that a contact contradicts: one search, then the proof.
#[test]
fn rows_without_a_solution_are_asked_for_its_existence() {
    let h = Csc::from_triplets(1, 2, [(0, 0, 1.0)].into_iter()).unwrap();
    let g = Csc::from_triplets(1, 1, [(0, 0, -1.0)].into_iter()).unwrap();
    let w = vec![-1.0, 0.0];
    let mut problem =
        FrictionGlobal::<2>::new(Csc::diagonal(&[1.0]), h, vec![0.0], w, vec![0.3]).unwrap();
    // v ≥ 1 of the contact, v ≤ 0 of the row.
    let bounds = Bounds { lower: vec![0.0], upper: vec![f64::INFINITY] };
    problem.rows = Some(RowsGlobal { G: g, b: vec![0.0], bounds });
    let answer = Solve::new().max_iterations(10_000).run(&problem).unwrap();
    assert!(matches!(answer.status, Status::Infeasible(_)), "{:?}", answer.status);
}

/// Joints with motors and limits that nothing touches.
#[test]
fn rows_without_contacts_are_solved() {
    for seed in 0..4 {
        let case =
            Planted { contacts: 0, dofs: 30, bilateral: 3, bounded: 3, seed, ..Planted::default() };
        let (global, planted) = case.global::<3>();
        for solver in ["nsgs", "psor", "auto", "condense/nsgs", "condense/auto"] {
            let point = solved(&global, solver);
            let gap: Vec<f64> = point.v.iter().zip(&planted.v).map(|(a, b)| a - b).collect();
            assert!(norm(&gap) < 1e-6 * norm(&planted.v), "{solver} {case:?} {:e}", norm(&gap));
        }
        let (local, planted) = case.local::<2>();
        for solver in ["nsgs", "psor", "auto"] {
            let point = solved(&local, solver);
            for (a, b) in point.lambda.iter().zip(&planted.lambda) {
                assert!((a - b).abs() < 1e-6 * (1.0 + b.abs()), "{solver} {seed}: {a} {b}");
            }
        }
    }
}

/// Without friction a local problem in the plane is an LCP with two bounds in the normal impulses and the rows: another statement, other methods.
#[test]
fn frictionless_problems_agree_with_their_box_lcp() {
    for case in cases() {
        let case = Planted { mu: (0.0, 0.0), ..case };
        let (local, _) = case.local::<2>();
        let RowsLocal { V, R, s, bounds } = local.rows.as_ref().unwrap();
        let (nc, p) = (local.contacts(), s.len());
        let normal = |i: usize| i.is_multiple_of(2).then_some(i / 2);
        let w = local.W.to_csc();
        let of_w = w.triplets().filter_map(|(i, j, x)| Some((normal(i)?, normal(j)?, x)));
        let of_v = V.triplets().filter_map(|(i, j, x)| Some((normal(i)?, nc + j, x)));
        let turned = of_v.clone().map(|(i, j, x)| (j, i, x));
        let of_r = R.triplets().map(|(i, j, x)| (nc + i, nc + j, x));
        let all = of_w.chain(of_v).chain(turned).chain(of_r);
        let m = Csc::from_triplets(nc + p, nc + p, all).unwrap();
        let q = (0..nc).map(|c| local.q[2 * c]).chain(s.iter().copied()).collect();
        let sides = |side: usize, of_contact: f64| {
            let rows = (0..p).map(|j| bounds.of(j)[side]);
            std::iter::repeat_n(of_contact, nc).chain(rows).collect::<Vec<f64>>()
        };
        let (lower, upper) = (sides(0, 0.0), sides(1, f64::INFINITY));
        let boxed = BoxLcp::new(m, q, lower, upper).unwrap();
        let answer = Solve::new().tolerance(1e-10).run(&boxed).unwrap();
        assert_eq!(answer.status, Status::Solved);
        let point = solved(&local, "nsgs");
        for (k, z) in answer.point.z.iter().enumerate() {
            let ours = if k < nc { point.r[2 * k] } else { point.lambda[k - nc] };
            assert!((ours - z).abs() < 1e-6 * (1.0 + z.abs()), "{case:?} {k}: {ours} {z}");
        }
    }
}

/// R need not be symmetric where rows are eliminated.
#[test]
fn free_rows_are_eliminated_from_a_skew_problem() {
    for seed in 0..6 {
        let case =
            Planted { contacts: 4, dofs: 40, bilateral: 2, bounded: 3, seed, ..Planted::default() };
        let (mut local, planted) = case.local::<3>();
        let rows = local.rows.as_mut().unwrap();
        // A skew part, and the free velocities that keep the planted point.
        let p = rows.s.len();
        let skew = (0..p).flat_map(|i| {
            (0..p).filter(move |&j| j != i).map(move |j| {
                let size = 0.01 * (1 + i.min(j)) as f64;
                (i, j, if i < j { size } else { -size })
            })
        });
        let skew = Csc::from_triplets(p, p, skew).unwrap();
        skew.mul_add(-1.0, &planted.lambda, &mut rows.s);
        rows.R = Csc::from_triplets(p, p, rows.R.triplets().chain(skew.triplets())).unwrap();
        assert!(local.judge(&planted, 1e-10).unwrap().solved);
        let point = solved(&local, "nsgs");
        for (a, b) in point.lambda.iter().zip(&planted.lambda) {
            assert!((a - b).abs() < 1e-6 * (1.0 + b.abs()), "{seed}: {a} {b}");
        }
    }
}

/// Every other method says that it takes no bounds, and who does.
#[test]
fn methods_that_know_no_bounds_refuse_them_by_name() {
    fn check<P: Registered + Judged + nonsmooth_problem::OfAny>(problem: &P, takers: &[&str]) {
        let composed = registry::composed_names::<P>();
        let names = registry::abouts::<P>().into_iter().map(|a| a.name.to_string());
        for name in names.chain(composed) {
            let takes = takers.contains(&name.as_str());
            let ran = Solve::new().solver(&name).tolerance(1e-6).run(problem);
            match ran {
                Ok(answer) => {
                    assert!(takes, "{name} took bounds");
                    assert_eq!(answer.status, Status::Solved, "{name}");
                }
                Err(e) => {
                    assert!(!takes, "{name}: {e}");
                    assert!(matches!(e, SolveError::Needs { .. }), "{name}: {e}");
                    let said = e.to_string();
                    assert!(said.contains("bounds") && said.contains("nsgs"), "{name}: {said}");
                }
            }
        }
    }
    let case = Planted { contacts: 3, dofs: 24, bounded: 2, ..Planted::default() };
    let takers = ["nsgs", "psor", "auto", "condense/nsgs", "condense/psor", "condense/auto"];
    check(&case.local::<3>().0, &takers);
    check(&case.global::<2>().0, &takers);
}

/// Limits of a joint that leave no motion, and how existence is decided where rows have bounds.
#[test]
fn existence_with_bounds_is_decided_by_cases_or_left_open() {
    let h = Csc::from_triplets(2, 2, [(1, 0, 1.0), (0, 1, 1.0)].into_iter()).unwrap();
    let mut problem = FrictionGlobal::<2>::new(
        Csc::diagonal(&[1.0, 1.0]),
        h,
        vec![0.0, -2.0],
        vec![0.0; 2],
        vec![0.5],
    )
    .unwrap();
    let g = Csc::from_triplets(2, 2, [(0, 0, 1.0), (0, 1, -1.0)].into_iter()).unwrap();
    let bounds = Bounds { lower: vec![0.0; 2], upper: vec![f64::INFINITY; 2] };
    problem.rows = Some(RowsGlobal { G: g, b: vec![-1.0, 0.5], bounds });
    let verdict = existence::decide(&problem, &Limits::default());
    assert!(matches!(verdict, Existence::NoSolution { .. }), "{verdict}");
    problem.rows.as_mut().unwrap().b[1] = 2.0;
    let verdict = existence::decide(&problem, &Limits::default());
    assert!(matches!(verdict, Existence::Solved { .. }), "{verdict}");
    let many = Planted { contacts: 30, dofs: 90, bounded: 2, ..Planted::default() }.global::<3>().0;
    let verdict = existence::decide(&many, &Limits::default()).to_string();
    assert!(verdict.contains("bounds"), "{verdict}");
}

/// A session that meets a problem with bounds after one without, and the other way round.
#[test]
fn a_session_changes_between_problems_with_and_without_bounds() {
    let with = Planted { contacts: 4, dofs: 30, bounded: 2, ..Planted::default() };
    let without = Planted { bounded: 0, bilateral: 2, ..with.clone() };
    let problems: [FrictionLocal<3>; 2] = [with.local().0, without.local().0];
    for solver in ["nsgs", "auto"] {
        let mut session =
            registry::session::<FrictionLocal<3>>(solver, &Default::default()).unwrap();
        for k in [0, 1, 0, 0, 1] {
            let mut point = problems[k].origin();
            let limits = Limits { tolerance: 1e-10, ..Limits::default() };
            let outcome = session.solve(&problems[k], &mut point, &limits, &mut |_| {}).unwrap();
            assert_eq!(outcome.status, Status::Solved, "{solver} {k}");
        }
    }
}

/// One row alone, of any size.
#[test]
fn a_single_constraint_is_solved() {
    for s in [1.0, -3e-7, 1e5, 0.0, 0.049] {
        let one = |x: f64| Csc::from_triplets(1, 1, std::iter::once((0, 0, x))).unwrap();
        let rows = RowsLocal::bilateral(Csc::zeros(0, 1), one(1.000243), vec![s]);
        let problem = FrictionLocal::<3>::with_rows(
            nonsmooth_linalg::Bsr::from_rows(0, &[]),
            vec![],
            vec![],
            rows,
        )
        .unwrap();
        let point = solved(&problem, "auto");
        assert!((point.lambda[0] + s / 1.000243).abs() <= 1e-15 * s.abs());
    }
    // And by one session, from the last impulses.
    let mut session = registry::session::<FrictionLocal<3>>("auto", &Default::default()).unwrap();
    let mut point = nonsmooth_problem::LocalPoint::default();
    point.lambda.push(0.0);
    for k in 0..40 {
        let (r, s) = (1.0 + 1e-16 * f64::from(k % 3), f64::from(k).sin());
        let one = Csc::from_triplets(1, 1, std::iter::once((0, 0, r))).unwrap();
        let rows = RowsLocal::bilateral(Csc::zeros(0, 1), one, vec![s]);
        let w = nonsmooth_linalg::Bsr::from_rows(0, &[]);
        let problem = FrictionLocal::<3>::with_rows(w, vec![], vec![], rows).unwrap();
        let limits = Limits { tolerance: 1e-10, ..Limits::default() };
        let outcome = session.solve(&problem, &mut point, &limits, &mut |_| {}).unwrap();
        assert_eq!(outcome.status, Status::Solved, "{k} {:?}", outcome.measure);
        assert!((point.lambda[0] + s / r).abs() <= 1e-15 * s.abs());
    }
}

/// Where sweeps are slow `auto` seeks the rows at their bounds as a set: as many rows as contacts, and impulses that are not unique.
#[test]
fn auto_seeks_the_rows_at_their_bounds() {
    let mut searches = 0;
    for seed in 0..12 {
        let case = Planted {
            contacts: [40, 10, 25][seed as usize % 3],
            dofs: [60, 90][seed as usize % 2],
            bilateral: [0, 4][seed as usize % 2],
            bounded: [12, 20, 5][seed as usize % 3],
            seed,
            ..Planted::default()
        };
        let (global, _) = case.global::<3>();
        let (local, _) = case.local::<2>();
        for answer in [
            Solve::new()
                .tolerance(1e-10)
                .max_iterations(2000)
                .run(&global)
                .map(|a| (a.status, a.account)),
            Solve::new()
                .tolerance(1e-10)
                .max_iterations(2000)
                .run(&local)
                .map(|a| (a.status, a.account)),
        ] {
            let (status, account) = answer.unwrap();
            assert_eq!(status, Status::Solved, "{case:?} {account:?}");
            searches +=
                usize::from(account.iter().any(|line| line.contains("rows at their bounds")));
        }
    }
    assert!(searches > 4, "{searches}");
}

/// A row that its own impulse does not move, rows that say the same twice, and rows whose bounds are one number.
#[test]
fn rows_that_contradict_or_repeat_each_other_end_no_search() {
    for seed in 0..6 {
        let case = Planted { contacts: 20, dofs: 60, bounded: 6, seed, ..Planted::default() };
        let (mut global, _) = case.global::<3>();
        let rows = global.rows.as_mut().unwrap();
        let twice = rows.G.triplets().flat_map(|(i, j, x)| [(i, j, x), (i, j + 6, x)]);
        rows.G = Csc::from_triplets(rows.G.nrows(), 12, twice).unwrap();
        rows.b.extend_from_within(..);
        // Each of the pair may do half as much.
        rows.bounds.lower.iter_mut().chain(&mut rows.bounds.upper).for_each(|x| *x *= 0.5);
        rows.bounds.lower.extend_from_within(..);
        rows.bounds.upper.extend_from_within(..);
        let answer = Solve::new().tolerance(1e-9).max_iterations(20_000).run(&global).unwrap();
        assert_eq!(answer.status, Status::Solved, "{seed} {:?}", answer.account);
    }
}

/// A body whose motion is prescribed, against dry friction on the same coordinate, and a motor of limited strength: the bilateral row determines the velocities of both, so that their impulses are at
/// bounds.
#[test]
fn rows_that_bilateral_rows_determine_are_at_their_bounds() {
    for (mass, scale) in [(1.0, 1.0), (3.0, 0.7), (0.1, 1e3)] {
        // Prescribed: 1; friction: resists; the motor wants 2, so it drives as it can.
        let g = [1.0, scale, -0.3];
        let b = vec![-1.0, 0.0, 0.6];
        let bounds = Bounds {
            lower: vec![f64::NEG_INFINITY, -3.0, -0.5],
            upper: vec![f64::INFINITY, 3.0, 0.5],
        };
        let load = 0.2;
        // A contact holds the body up along the other coordinate, and slides.
        let entries = (0..3).map(|j| (0, j, g[j]));
        let rows = RowsGlobal {
            G: Csc::from_triplets(2, 3, entries).unwrap(),
            b: b.clone(),
            bounds: bounds.clone(),
        };
        let h = Csc::from_triplets(2, 2, [(0, 1, 1.0), (1, 0, 1.0)].into_iter()).unwrap();
        let m = Csc::diagonal(&[mass, mass]);
        let global = FrictionGlobal::<2> {
            rows: Some(rows),
            ..FrictionGlobal::new(m, h, vec![load, -mass], vec![0.0; 2], vec![0.4]).unwrap()
        };
        let w = Bsr::from_csc(&Csc::diagonal(&[1.0 / mass, 1.0 / mass]));
        let v = Csc::from_triplets(2, 3, (0..3).map(|j| (1, j, g[j] / mass))).unwrap();
        let products = (0..9).map(|k| (k / 3, k % 3, g[k / 3] * g[k % 3] / mass));
        let r = Csc::from_triplets(3, 3, products).unwrap();
        let s = g.iter().zip(&b).map(|(g, b)| g * load / mass + b).collect();
        let local = FrictionLocal::<2> {
            rows: Some(RowsLocal { V: v, R: r, s, bounds }),
            ..FrictionLocal::new(w, vec![-1.0, load / mass], vec![0.4]).unwrap()
        };
        for solver in ["nsgs", "auto"] {
            for lambda in [solved(&global, solver).lambda, solved(&local, solver).lambda] {
                assert_eq!(lambda[1..], [-3.0, -0.5], "{solver} {mass} {scale}");
            }
        }
    }
}

/// More rows than degrees of freedom: the search for those at their bounds ends far off, and sweeps go on from where it began.
#[test]
fn more_rows_than_degrees_of_freedom_are_solved() {
    let dense = |n: usize, m: usize, x: &[f64]| {
        Csc::from_triplets(n, m, x.iter().enumerate().map(|(k, x)| (k / m, k % m, *x))).unwrap()
    };
    let w = dense(
        6,
        6,
        &[
            4.666596753229523,
            1.0542059487497533,
            -2.534816901501674,
            0.39947084735887045,
            1.466149369397269,
            2.331961174267691,
            1.0542059487497535,
            0.6788724822537029,
            -0.29487885189591784,
            -1.0491938499419382,
            -0.641650806797831,
            1.0495330207441154,
            -2.5348169015016744,
            -0.29487885189591784,
            1.6756698121790843,
            -0.62425307724603,
            -1.5557056629755193,
            -1.0796513300822075,
            0.39947084735887056,
            -1.049193849941938,
            -0.62425307724603,
            3.7606797534205576,
            2.27352166914885,
            -1.5094748481622018,
            1.466149369397269,
            -0.641650806797831,
            -1.5557056629755193,
            2.27352166914885,
            2.780882830086784,
            -0.25300356197162727,
            2.331961174267691,
            1.0495330207441151,
            -1.0796513300822075,
            -1.509474848162202,
            -0.25300356197162716,
            1.9491636347186658,
        ],
    );
    let v = dense(
        6,
        2,
        &[
            3.5439914626352227,
            0.9860658935304313,
            0.5619767659708301,
            -0.39258383989056894,
            -2.3310333385112005,
            -0.7268035253287323,
            0.27836024857188424,
            2.1690663735907614,
            1.9421812142839348,
            1.4358486923663487,
            1.7820602412746238,
            -0.4633109840248827,
        ],
    );
    let q = vec![
        -3.869556595840461,
        -0.5973913677674862,
        2.402758214688672,
        -0.5746901406759148,
        -1.425593583531677,
        -1.4744310706251047,
    ];
    let r = dense(
        2,
        2,
        &[3.3485796580884886, 0.6759655549209789, 0.6759655549209789, 1.379830549086178],
    );
    let bounds = Bounds { lower: vec![-1.0; 2], upper: vec![1.0; 2] };
    let rows = RowsLocal { V: v, R: r, s: vec![-3.199985871931151, -1.516802819146191], bounds };
    let w = Bsr::from_csc(&w);
    let local =
        FrictionLocal::<2> { rows: Some(rows), ..FrictionLocal::new(w, q, vec![0.3; 3]).unwrap() };
    solved(&local, "auto");
}

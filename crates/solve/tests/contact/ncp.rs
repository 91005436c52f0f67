//! Friction as a nonlinear complementarity problem: reduce, solve, lift, and the word of the friction problem's own judge.

use std::time::{Duration, Instant};

use nonsmooth_linalg::budget::Budget;
use nonsmooth_problem::check::Judged;
use nonsmooth_problem::planted::{PendulumStep, Planted, PlantedMix};
use nonsmooth_problem::{FrictionLocal, LcpPoint, Mcp, Problem};
use nonsmooth_solve::bridges::{AsNcp, First, Formulation, Glocker};
use nonsmooth_solve::{Limit, Limits, Reformulation, SolveError, Status, registry};

const MIXED: PlantedMix = PlantedMix { open: 1.0, stick: 1.0, slip: 1.0, degenerate: 0.0 };

fn planted(contacts: usize, seed: u64) -> Planted {
    Planted { contacts, dofs: 6 * contacts, mix: MIXED, mu: (0.2, 0.6), seed, ..Planted::default() }
}

fn limits(tolerance: f64) -> Limits {
    Limits { tolerance, max_iterations: 2000, ..Limits::default() }
}

/// Solves, and tells by the problem's own judge whether it did.
fn solved<const D: usize>(problem: &FrictionLocal<D>, solver: &str, tolerance: f64) -> bool
where
    FrictionLocal<D>: registry::Registered,
{
    let mut session = registry::session::<FrictionLocal<D>>(solver, &Default::default()).unwrap();
    let mut point = problem.origin();
    let outcome = session.solve(problem, &mut point, &limits(tolerance), &mut |_| {}).unwrap();
    let solved = problem.judge(&point, tolerance).unwrap().solved;
    assert_eq!(outcome.status == Status::Solved, solved, "{solver}");
    solved
}

/// A planted solution, lowered, solves the other problem: nobody has moved it, and the way back gives it again.
fn keeps_solutions<F: Formulation<D>, const D: usize>() {
    for seed in 0..10 {
        for degenerate in [0.0, 0.5] {
            let mix = PlantedMix { degenerate, ..MIXED };
            let case = Planted { mix, mu: (0.0, 0.6), bilateral: 2, ..planted(5, seed) };
            let (problem, known) = case.local::<D>();
            let edge = AsNcp(F::default());
            let (reduced, mut memo) = edge.reduce(&problem).unwrap();
            let mut z = LcpPoint::default();
            edge.lower(&problem, &known, &memo, &mut z);
            let natural = reduced.judge(&z, 1e-9).unwrap().measure.absolute;
            assert!(natural < 1e-9, "{} {case:?}: {natural:e}", F::NAME);
            let mut back = problem.origin();
            edge.lift(&problem, &z, &mut memo, &mut back);
            let verdict = problem.judge(&back, 1e-10).unwrap();
            assert!(verdict.solved, "{} {case:?}: {:?}", F::NAME, verdict.measure);
        }
    }
}

#[test]
fn solutions_of_the_law_are_solutions_of_both_forms() {
    keeps_solutions::<First, 2>();
    keeps_solutions::<First, 3>();
    keeps_solutions::<Glocker, 2>();
    keeps_solutions::<Glocker, 3>();
}

/// Jacobians are those of F, by central differences at points away from kinks.
#[test]
fn jacobians_agree_with_differences() {
    fn agrees(problem: &Mcp) {
        let n = problem.dim();
        let pattern = problem.F.pattern();
        let mut run = problem.F.evaluator();
        let x: Vec<f64> = (0..n).map(|i| 1.0 + 0.5 * (1.7 * i as f64).sin()).collect();
        let (mut f, mut exact) = (vec![0.0; n], vec![0.0; pattern.len()]);
        assert!(run.jacobian(&x, &mut f, &mut exact));
        let mut dense = vec![0.0; n * n];
        pattern.places().zip(&exact).for_each(|((i, j), a)| dense[i * n + j] = *a);
        let (h, mut up, mut down) = (1e-5, vec![0.0; n], vec![0.0; n]);
        for j in 0..n {
            let mut y = x.clone();
            y[j] = x[j] + h;
            assert!(run.value(&y, &mut up));
            y[j] = x[j] - h;
            assert!(run.value(&y, &mut down));
            for i in 0..n {
                let difference = (up[i] - down[i]) / (2.0 * h);
                let error = (difference - dense[i * n + j]).abs();
                assert!(error < 1e-8 * (1.0 + difference.abs()), "{i} {j}: {error:e}");
            }
        }
    }
    let (problem, _) = planted(3, 4).local::<3>();
    agrees(&AsNcp(First).reduce(&problem).unwrap().0);
    agrees(&AsNcp(Glocker).reduce(&problem).unwrap().0);
}

#[test]
fn path_solves_planted_problems() {
    for contacts in 1..=5 {
        for seed in 0..10 {
            let case = planted(contacts, seed);
            for solver in ["glocker/path", "glocker/semismooth", "glocker/auto", "ncp/auto"] {
                assert!(solved(&case.local::<3>().0, solver, 1e-8), "{solver} {case:?}");
                assert!(solved(&case.local::<2>().0, solver, 1e-8), "{solver} 2D {case:?}");
            }
        }
    }
}

/// Of the constituents of `auto` and its kin, so many of 50 problems of one to five contacts: both forms are within their reach, and the root costs some of them.
#[test]
fn every_method_takes_both_forms() {
    for solver in ["path", "miles", "semismooth", "smooth", "proxi", "semicomp", "newton_fb"] {
        for form in ["glocker", "ncp"] {
            let name = format!("{form}/{solver}");
            let all = (1..=5).flat_map(|contacts| (0..10).map(move |seed| planted(contacts, seed)));
            let count = all.filter(|c| solved(&c.local::<3>().0, &name, 1e-8)).count();
            assert!(count >= 40, "{name}: {count} of 50");
        }
    }
}

/// Impulses that outnumber the degrees of freedom, W of rank 12 of 15.
#[test]
fn hyperstatic_problems_are_no_obstacle_by_themselves() {
    for form in ["glocker/path", "ncp/path"] {
        let cases = (0..10).map(|seed| Planted { dofs: 12, ..planted(5, seed) });
        let count = cases.filter(|c| solved(&c.local::<3>().0, form, 1e-8)).count();
        assert!(count >= 9, "{form}: {count} of 10");
    }
}

/// The units of masses and lengths, and so of impulses and velocities, change nothing.
#[test]
fn units_change_nothing() {
    let (problem, _) = planted(4, 2).local::<3>();
    let mut other = problem.clone();
    let scaled = problem.W.to_csc();
    let scaled: Vec<_> = scaled.triplets().map(|(i, j, x)| (i, j, x / 1024.0)).collect();
    let m = problem.q.len();
    let w = nonsmooth_linalg::Csc::from_triplets(m, m, scaled.into_iter()).unwrap();
    other.W = nonsmooth_linalg::Bsr::from_csc(&w);
    other.q.iter_mut().for_each(|q| *q *= 65536.0);
    let [a, b] = [&problem, &other].map(|p| AsNcp(Glocker).reduce(p).unwrap().0);
    // A power of 4 and one of 2: the expressions are the same to the last bit.
    assert_eq!(a, b);
}

#[test]
fn rows_with_bounds_are_refused_by_name() {
    let (problem, _) = Planted { bounded: 2, ..planted(3, 0) }.local::<3>();
    for solver in ["glocker/path", "ncp/path", "glocker/auto"] {
        let mut session =
            registry::session::<FrictionLocal<3>>(solver, &Default::default()).unwrap();
        let mut point = problem.origin();
        let refused = session.solve(&problem, &mut point, &limits(1e-8), &mut |_| {}).unwrap_err();
        assert!(matches!(refused, SolveError::Needs { .. }), "{refused}");
        assert!(refused.to_string().contains("scalar rows without bounds"), "{refused}");
    }
}

/// A second problem of the same shape, in a session that has met the first.
#[test]
fn a_session_takes_another_problem() {
    for solver in ["glocker/path", "glocker/auto"] {
        let mut session =
            registry::session::<FrictionLocal<3>>(solver, &Default::default()).unwrap();
        // Another number of contacts, and contacts that lose their friction.
        for (contacts, mu) in [(3, (0.2, 0.6)), (3, (0.1, 0.3)), (5, (0.2, 0.6)), (5, (0.0, 0.0))] {
            let (problem, _) = Planted { mu, ..planted(contacts, 1) }.local::<3>();
            let mut point = problem.origin();
            let outcome = session.solve(&problem, &mut point, &limits(1e-8), &mut |_| {}).unwrap();
            assert_eq!(outcome.status, Status::Solved, "{solver} {contacts} {mu:?}");
        }
    }
}

/// Steps of a pendulum, each solved by `path` from the one before: angles, speeds, whether the wall pushed.
fn swing(recipe: PendulumStep, steps: usize) -> (Vec<f64>, Vec<f64>, bool) {
    let mut session = registry::session::<Mcp>("path", &Default::default()).unwrap();
    let (mut angles, mut speeds) =
        (vec![recipe.angle; recipe.links], vec![recipe.speed; recipe.links]);
    let mut pushed = false;
    for step in 0..steps {
        let problem = recipe.after(&angles, &speeds);
        let mut point = problem.origin();
        let outcome = session.solve(&problem, &mut point, &limits(1e-10), &mut |_| {}).unwrap();
        assert_eq!(outcome.status, Status::Solved, "step {step}: {:?}", outcome.measure);
        let (v, impulses) = point.z.split_at(recipe.links);
        pushed |= impulses.iter().any(|p| *p > 0.0);
        speeds.copy_from_slice(v);
        angles.iter_mut().zip(v).for_each(|(q, v)| *q += recipe.step * v);
    }
    (angles, speeds, pushed)
}

/// The nonlinear step conserves energy up to the order of its length where nothing is hit, and an inelastic wall takes some and holds the masses back.
#[test]
fn a_pendulum_swings_against_a_wall() {
    let free = PendulumStep { links: 3, angle: 0.5, speed: 0.0, wall: 10.0, ..Default::default() };
    let before = free.energy(&[0.5; 3], &[0.0; 3]);
    let drift = |recipe: PendulumStep, steps: usize| {
        let (angles, speeds, pushed) = swing(recipe, steps);
        assert!(!pushed);
        (recipe.energy(&angles, &speeds) - before).abs()
    };
    let (coarse, fine) = (drift(free, 40), drift(PendulumStep { step: 0.0025, ..free }, 160));
    assert!(fine < 0.35 * coarse && coarse < 0.2, "{coarse:e} {fine:e}");

    // A straight pendulum that hits the wall with all its masses at once leaves it with e times their speeds.
    for links in [1, 4, 20] {
        let recipe = PendulumStep { links, ..Default::default() };
        let (_, speeds, pushed) = swing(recipe, 1);
        assert!(pushed && speeds.iter().all(|v| (v + 0.5).abs() < 1e-3), "{speeds:?}");
    }

    let hit = PendulumStep { speed: 3.0, wall: 0.6, restitution: 0.0, ..free };
    let (angles, speeds, pushed) = swing(hit, 40);
    assert!(pushed);
    assert!(hit.energy(&angles, &speeds) < hit.energy(&[0.5; 3], &[3.0; 3]) - 0.1);
    // What a step moves past the wall before its contact is forecast.
    let gaps = hit.gaps(&angles);
    assert!(gaps.iter().all(|gap| *gap > -3.0 * hit.step), "{gaps:?}");
}

/// A dense W takes a while to be stated: where a limit comes first, it is not stated to the end.
#[test]
fn stating_looks_at_the_limits() {
    let case = Planted { contacts: 250, dofs: 40, ..planted(250, 1) };
    let (problem, _) = case.local::<3>();
    let edge = AsNcp(Glocker);
    let begun = Instant::now();
    assert!(edge.reduce(&problem).is_ok());
    let whole = begun.elapsed();
    let begun = Instant::now();
    let over = Budget { deadline: Some(begun), ..Budget::default() };
    let scope = over.enter();
    let refused = edge.reduce(&problem).map(|_| ()).unwrap_err();
    assert!(refused.is_inapplicable() && scope.raised(), "{refused}");
    assert!(
        begun.elapsed() < whole / 2 + Duration::from_millis(20),
        "{:?} {whole:?}",
        begun.elapsed()
    );
    drop(scope);
    // The loop reads it as the limit.
    for name in ["glocker/path", "ncp/path"] {
        let limits = Limits { time_limit: Some(0.01), ..limits(1e-12) };
        let mut session = registry::session::<FrictionLocal<3>>(name, &Default::default()).unwrap();
        let mut point = problem.origin();
        let outcome = session.solve(&problem, &mut point, &limits, &mut |_| {}).unwrap();
        assert_eq!(outcome.status, Status::Limit(Limit::Time), "{name}");
    }
}

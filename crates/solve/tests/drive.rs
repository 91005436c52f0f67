//! The loop's promises, kept against solvers that lie, diverge, produce NaN or claim certificates.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use nonsmooth_linalg::{Bsr, Csc};
use nonsmooth_problem::check::{Impulses, Measure};
use nonsmooth_problem::planted::Planted;
use nonsmooth_problem::{FrictionGlobal, FrictionLocal, GlobalPoint, LocalPoint, Problem};
use nonsmooth_solve::registry;
use nonsmooth_solve::settings::{self, SettingsMap};
use nonsmooth_solve::{
    Driver, Limit, Limits, Observer, Outcome, Progress, Session, SolveError, Solver, Status, Step,
};

type P = FrictionLocal<3>;

/// A solver that does whatever a test says.
struct Scripted<F>(F);

impl<F: Fn(usize, &mut LocalPoint) -> Step + Send + Sync> Solver<P> for Scripted<F> {
    type Work = usize;
    fn work(&self, _: &P) -> Result<usize, SolveError> {
        Ok(0)
    }
    fn start(&self, _: &P, _: &mut LocalPoint, steps: &mut usize) {
        *steps = 0;
    }
    fn step(&self, _: &P, point: &mut LocalPoint, steps: &mut usize) -> Step {
        *steps += 1;
        self.0(*steps, point)
    }
}

fn run(
    problem: &P,
    limits: &Limits,
    script: impl Fn(usize, &mut LocalPoint) -> Step + Send + Sync,
) -> (Outcome, LocalPoint) {
    let mut point = problem.origin();
    let mut driver = Driver::new(Scripted(script));
    let outcome = driver.solve(problem, &mut point, limits, &mut |_| {}).unwrap();
    (outcome, point)
}

fn planted() -> (P, LocalPoint) {
    Planted { contacts: 5, dofs: 30, ..Planted::default() }.local::<3>()
}

const GO_ON: Step = Step::Continue { estimate: f64::NAN };

#[test]
fn a_solution_needs_no_solver() {
    let (problem, _) = planted();
    let (other, known) = Planted { contacts: 7, dofs: 30, ..Planted::default() }.local::<3>();
    let limits = Limits { tolerance: 1e-10, ..Limits::default() };
    for name in ["auto", "nsgs", "newton_ac", "ip"] {
        let mut session = registry::session::<P>(name, &SettingsMap::new()).unwrap();
        let mut solve = |problem: &P, point: &mut LocalPoint| {
            let outcome = session.solve(problem, point, &limits, &mut |_| {}).unwrap();
            assert_eq!(outcome.status, Status::Solved, "{name}");
            (outcome.iterations, session.account(), session.history().len())
        };
        let mut cold = problem.origin();
        let first = solve(&problem, &mut cold);
        assert!(first.0 > 0, "{name}");
        let mut again = cold.clone();
        let (iterations, account, visits) = solve(&problem, &mut again);
        assert_eq!((iterations, visits, &again), (0, 1, &cold), "{name}");
        assert!(account[0].contains("which is a solution"), "{name}: {account:?}");
        // Neither its own point nor that of another shape is touched, nor what the session does afterwards.
        let mut of_other = known.clone();
        assert_eq!(solve(&other, &mut of_other).0, 0, "{name}");
        assert_eq!(of_other, known);
        let mut once_more = problem.origin();
        assert_eq!(solve(&problem, &mut once_more), first, "{name}");
        assert_eq!(once_more, cold, "{name}");
    }
}

/// Starts whose squares overflow: what is returned is finite all the same, and so are its residuals.
#[test]
fn huge_starts_do_no_harm() {
    let (problem, _) = planted();
    let names = [
        "auto",
        "nsgs",
        "admm",
        "proximal/admm",
        "ncp/path",
        "glocker/path",
        "ncp/auto",
        "glocker/auto",
    ];
    for name in names {
        for size in [1e100, 1e160, 1e200, 1e300] {
            let mut session = registry::session::<P>(name, &SettingsMap::new()).unwrap();
            let mut point = problem.origin();
            point.r.fill(size);
            let limits = Limits { max_iterations: 20, ..Limits::default() };
            let outcome = session.solve(&problem, &mut point, &limits, &mut |_| {}).unwrap();
            assert!(point.r.iter().all(|r| r.is_finite()), "{name} {size:e}: {:?}", point.r);
            let merit = outcome.measure.merit();
            assert!(merit.is_finite(), "{name} {size:e}: {:?}", outcome.measure);
        }
    }
}

#[test]
fn a_solver_that_lies_is_not_believed() {
    let (problem, _) = planted();
    let (outcome, _) = run(&problem, &Limits::default(), |_, _| Step::Done);
    assert!(matches!(outcome.status, Status::Stalled(_)), "{outcome:?}");
    // An estimate of zero is a claim too.
    let limits = Limits { max_iterations: 7, ..Limits::default() };
    let (outcome, _) = run(&problem, &limits, |_, _| Step::Continue { estimate: 0.0 });
    assert_eq!((outcome.status, outcome.iterations), (Status::Limit(Limit::Iterations), 7));
}

#[test]
fn a_modest_solver_is_told_that_it_has_finished() {
    let (problem, known) = planted();
    let (outcome, _) = run(&problem, &Limits::default(), |step, point| {
        if step == 3 {
            point.clone_from(&known);
        }
        Step::Continue { estimate: 1e9 }
    });
    assert_eq!((outcome.status, outcome.iterations), (Status::Solved, 3));
    let (outcome, _) = run(&problem, &Limits::default(), |_, point| {
        point.clone_from(&known);
        Step::Stuck("so it says".into())
    });
    assert_eq!(outcome.status, Status::Solved);
}

#[test]
fn the_best_point_is_returned_whatever_comes_after() {
    let (problem, known) = planted();
    let near: Vec<f64> = known.r.iter().map(|r| r * (1.0 + 1e-5)).collect();
    for ending in 0..3 {
        let limits = Limits { max_iterations: 20, ..Limits::default() };
        let (outcome, point) = run(&problem, &limits, |step, point| {
            match step {
                4 => point.r.clone_from(&near),
                5.. => point.r.iter_mut().for_each(|r| *r = 2.0 * *r + 1.0),
                _ => {}
            }
            match (step, ending) {
                (9, 0) => Step::Stuck("worn out".into()),
                (9, 1) => {
                    point.r[0] = f64::NAN;
                    GO_ON
                }
                _ => GO_ON,
            }
        });
        assert_eq!(point.r, near, "ending {ending}");
        assert!(outcome.measure.relative < 1e-3, "{outcome:?}");
        let expected = match ending {
            0 => Status::Stalled("worn out".into()),
            1 => Status::Stalled("the iterates are no longer finite".into()),
            _ => Status::Limit(Limit::Iterations),
        };
        assert_eq!(outcome.status, expected);
    }
}

/// What a solver makes of its start, in a problem of another form or by its first step, may be worse.
#[test]
fn nothing_worse_than_the_start_is_returned() {
    let (problem, known) = planted();
    let mut gauge = problem.gauge().unwrap();
    let names = ["auto", "nsgs", "facet_inner/lemke", "admm", "newton_ac", "ip"];
    for name in names {
        let mut session = registry::session::<P>(name, &SettingsMap::new()).unwrap();
        // Twice: the second solve is one of a session that is warm.
        for off in [1e-3, 1e-4] {
            let mut start = known.clone();
            start.r.iter_mut().for_each(|r| *r *= 1.0 + off);
            let first = problem.certify(&start, &mut gauge).merit();
            for (max_iterations, time_limit) in [(0, None), (1, None), (100, Some(0.0))] {
                let limits = Limits { max_iterations, time_limit, ..Limits::default() };
                let mut point = start.clone();
                let outcome = session.solve(&problem, &mut point, &limits, &mut |_| {}).unwrap();
                let found = problem.certify(&point, &mut gauge).merit();
                let case = format!("{name}, {max_iterations} iterations, {outcome:?}");
                assert!(found <= first * (1.0 + 1e-9), "{case}: {found:e} after {first:e}");
                assert!(
                    (outcome.measure.merit() - found).abs() <= 1e-3 * found,
                    "{case}: {found:e}"
                );
            }
        }
    }
}

#[test]
fn limits_stop_and_are_named() {
    let (problem, _) = planted();
    let (outcome, _) =
        run(&problem, &Limits { time_limit: Some(0.0), ..Limits::default() }, |_, _| GO_ON);
    assert_eq!((outcome.status, outcome.iterations), (Status::Limit(Limit::Time), 0));
    let flag = Arc::new(AtomicBool::new(false));
    let limits = Limits { cancel: Some(flag.clone()), ..Limits::default() };
    let (outcome, _) = run(&problem, &limits, |step, _| {
        flag.store(step == 5, Ordering::Relaxed);
        GO_ON
    });
    assert_eq!((outcome.status, outcome.iterations), (Status::Limit(Limit::Cancelled), 5));
}

#[test]
fn certificates_are_verified() {
    // A mass of one, squeezed without friction between walls that approach each other: infeasible.
    let w = [(0, 0, 1.0), (0, 3, -1.0), (3, 0, -1.0), (3, 3, 1.0)].into_iter();
    let w = Bsr::from_csc(&Csc::from_triplets(6, 6, w).unwrap());
    let q = vec![-1.0, 0.0, 0.0, -1.0, 0.0, 0.0];
    let problem = P::new(w, q, vec![0.0; 2]).unwrap();
    let ray = |a: f64, b: f64| Impulses { r: vec![a, 0.0, 0.0, b, 0.0, 0.0], lambda: vec![] };
    let (outcome, _) =
        run(&problem, &Limits::default(), |_, _| Step::NoSolution(ray(1.0, 1.0).into()));
    assert!(matches!(outcome.status, Status::Infeasible(_)), "{}", outcome.status);
    assert_eq!(outcome.status.certificate(), Some(&ray(1.0, 1.0).into()));
    let (outcome, _) =
        run(&problem, &Limits::default(), |_, _| Step::NoSolution(ray(1.0, 2.0).into()));
    assert_eq!(outcome.status, Status::NoConclusion(ray(1.0, 2.0).into()));
}

/// Claims that there is no solution, and goes on or not; then has the point, if it is given one.
struct Doubted {
    goes_on: bool,
    point: Option<LocalPoint>,
}

impl Solver<P> for Doubted {
    type Work = usize;
    fn work(&self, _: &P) -> Result<usize, SolveError> {
        Ok(0)
    }
    fn start(&self, _: &P, _: &mut LocalPoint, steps: &mut usize) {
        *steps = 0;
    }
    fn step(&self, _: &P, point: &mut LocalPoint, steps: &mut usize) -> Step {
        *steps += 1;
        if *steps == 1 {
            let r = vec![1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
            return Step::NoSolution(Impulses { r, lambda: vec![] }.into());
        }
        if let (Some(known), 10..) = (&self.point, *steps) {
            point.clone_from(known);
        }
        GO_ON
    }
    fn go_on(&self, _: &P, _: &mut LocalPoint, _: &mut usize) -> bool {
        self.goes_on
    }
}

#[test]
fn a_point_that_passes_is_preferred_to_a_proof_by_rounding() {
    // The walls of `certificates_are_verified`, one fleeing the other but for so much, and a contact that is hit.
    let walls = |by: f64| {
        let w = [(0, 0, 1.0), (0, 3, -1.0), (3, 0, -1.0), (3, 3, 1.0), (6, 6, 1.0)].into_iter();
        let w = Bsr::from_csc(&Csc::from_triplets(9, 9, w).unwrap());
        P::new(w, vec![-1.0, 0.0, 0.0, 1.0 - by, 0.0, 0.0, -1.0, 0.0, 0.0], vec![0.0; 3]).unwrap()
    };
    let mut hit = walls(1.0).origin();
    (hit.r[0], hit.r[6]) = (1.0, 1.0);
    const LAST: f64 = f64::EPSILON / 2.0;
    let ends = |by: f64, goes_on: bool, point: Option<&LocalPoint>| {
        let problem = walls(by);
        let mut driver = Driver::new(Doubted { goes_on, point: point.cloned() });
        let mut point = problem.origin();
        let outcome = driver.solve(&problem, &mut point, &Limits::default(), &mut |_| {}).unwrap();
        if let Status::Infeasible(proof) = &outcome.status {
            assert!((proof.margin() / (by / 2.0) - 1.0).abs() < 1e-9, "{}", proof.margin());
        }
        (outcome.status.name(), outcome.iterations)
    };
    assert_eq!(ends(LAST, true, Some(&hit)), ("solved", 10));
    // Without a point the proof stands, after a modest search or none.
    let (name, iterations) = ends(LAST, true, None);
    assert!(name == "infeasible" && (100..10_000).contains(&iterations), "{name} {iterations}");
    assert_eq!(ends(LAST, false, Some(&hit)), ("infeasible", 1));
    // What no point that passes can miss ends the solve at once.
    assert_eq!(ends(1e-3, true, Some(&hit)), ("infeasible", 1));
}

#[test]
fn mistakes_of_the_caller_are_errors() {
    let (problem, _) = planted();
    let mut session = registry::session::<P>("nsgs", &SettingsMap::new()).unwrap();
    let mut solve = |point: &mut LocalPoint, limits: &Limits| {
        session.solve(&problem, point, limits, &mut |_| {}).unwrap_err().to_string()
    };
    let mut short = problem.origin();
    short.r.pop();
    assert!(solve(&mut short, &Limits::default()).starts_with("r: expected 15 entries"));
    let mut nan = problem.origin();
    nan.r[4] = f64::NAN;
    assert!(solve(&mut nan, &Limits::default()).starts_with("r[4]: expected a finite number"));
    for tolerance in [0.0, -1.0, 1.0 + f64::EPSILON, f64::NAN, f64::INFINITY] {
        let limits = Limits { tolerance, ..Limits::default() };
        assert!(solve(&mut problem.origin(), &limits).starts_with("tolerance: expected"));
    }
    let limits = Limits { time_limit: Some(-1.0), ..Limits::default() };
    assert!(solve(&mut problem.origin(), &limits).starts_with("time limit: expected"));
}

#[test]
fn the_same_input_gives_the_same_bits_and_a_warm_start_is_used() {
    let (problem, _) = Planted { contacts: 60, dofs: 360, ..Planted::default() }.local::<3>();
    for settings in [vec![], vec!["ordering=fully_shuffled"], vec!["freeze_after=3"]] {
        let map = settings::from_texts(&settings).unwrap();
        let mut session = registry::session::<P>("nsgs", &map).unwrap();
        let mut solve = |point: &mut LocalPoint| {
            session.solve(&problem, point, &Limits::default(), &mut |_| {}).unwrap()
        };
        let (mut first, mut second) = (problem.origin(), problem.origin());
        let (a, b) = (solve(&mut first), solve(&mut second));
        assert_eq!(first, second, "{settings:?}");
        assert_eq!((a.iterations, a.measure), (b.iterations, b.measure), "{settings:?}");
        assert_eq!(a.status, Status::Solved);
        assert_eq!(solve(&mut first).iterations, 0, "a solution needs no step");
    }
}

/// Of a problem with so many unknowns judge and workspace are prepared side by side.
#[test]
fn several_threads_change_neither_a_bit_nor_an_error() {
    let case = Planted { contacts: 500, dofs: 900, seed: 4, ..Planted::default() };
    let (problem, _) = case.global::<3>();
    let solve = |limits: Limits| {
        let mut session =
            registry::session::<FrictionGlobal<3>>("auto", &SettingsMap::new()).unwrap();
        let mut point = problem.origin();
        let outcome = session.solve(&problem, &mut point, &limits, &mut |_| {});
        (point, outcome)
    };
    let with = |threads| Limits { threads, ..Limits::default() };
    let (point, outcome) = solve(with(1));
    let outcome = outcome.unwrap();
    assert_eq!(outcome.status, Status::Solved);
    let refused =
        solve(Limits { memory_limit: Some(100_000), ..with(1) }).1.unwrap_err().to_string();
    assert!(refused.contains("memory limit"), "{refused}");
    for threads in [2, 3] {
        let (other_point, other) = solve(with(threads));
        let seconds = outcome.seconds;
        assert_eq!(Outcome { seconds, ..other.unwrap() }, outcome, "{threads} threads");
        assert_eq!(other_point, point);
        let other = solve(Limits { memory_limit: Some(100_000), ..with(threads) }).1;
        assert_eq!(other.unwrap_err().to_string(), refused);
        let late = solve(Limits { time_limit: Some(1e-9), ..with(threads) }).1.unwrap();
        assert_eq!(late.status, Status::Limit(Limit::Time));
    }
}

#[test]
fn it_stops_at_the_tolerance_and_not_far_below() {
    let (problem, _) =
        Planted { contacts: 200, dofs: 700, seed: 3, ..Planted::default() }.local::<3>();
    for tolerance in [1e-3, 1e-6, 1e-9] {
        let mut session = registry::session::<P>("nsgs", &SettingsMap::new()).unwrap();
        let limits = Limits { tolerance, ..Limits::default() };
        let outcome = session.solve(&problem, &mut problem.origin(), &limits, &mut |_| {}).unwrap();
        assert_eq!(outcome.status, Status::Solved);
        let history = session.history();
        let last = history[history.len() - 2..].iter().map(|s| s.iteration).collect::<Vec<_>>();
        assert!(last[1] - last[0] <= 50);
        assert!(outcome.measure.relative > 0.2 * tolerance, "{outcome:?}");
    }
}

#[test]
fn the_history_stays_bounded_and_keeps_its_ends() {
    let (problem, _) = planted();
    let mut driver = Driver::new(Scripted(|_, _: &mut LocalPoint| GO_ON));
    let limits = Limits { max_iterations: 100_000, ..Limits::default() };
    driver.solve(&problem, &mut problem.origin(), &limits, &mut |_| {}).unwrap();
    let history = driver.history();
    assert!(history.len() <= 4096 && history.len() > 1000, "{}", history.len());
    assert_eq!(history[0].iteration, 0);
    assert!(history.windows(2).all(|w| w[0].iteration < w[1].iteration));
    assert!(history.last().unwrap().iteration > 90_000);
}

#[test]
fn an_impulse_that_nothing_feels_is_not_the_best_where_it_is_infinite() {
    // W = 0: the residual of an infinite impulse is that of none.
    let w = Bsr::from_rows(1, &[vec![(0, [[0.0; 3]; 3])]]);
    let problem = P::new(w, vec![-1.0, 0.0, 0.0], vec![0.5]).unwrap();
    let limits = Limits { max_iterations: 400, ..Limits::default() };
    let (outcome, point) = run(&problem, &limits, |k, point| {
        point.r[0] = if k < 200 { 10.0_f64.powi(k as i32) } else { f64::INFINITY };
        GO_ON
    });
    assert!(outcome.status != Status::Solved);
    assert!(point.r.iter().all(|r| r.is_finite()), "{:?}", point.r);
    for solver in ["fixed_point", "extragradient", "hyperplane"] {
        let mut session = registry::session::<P>(solver, &SettingsMap::new()).unwrap();
        let mut point = problem.origin();
        let limits = Limits { max_iterations: 5000, ..Limits::default() };
        session.solve(&problem, &mut point, &limits, &mut |_| {}).unwrap();
        assert!(point.r.iter().all(|r| r.is_finite()), "{solver}: {:?}", point.r);
    }
}

/// The first point that an observer is told of.
struct First(Option<(GlobalPoint, Measure)>);

impl Observer<FrictionGlobal<3>> for First {
    fn step(&mut self, _: &Progress) {}
    fn keeps_best(&self) -> bool {
        true
    }
    fn best(&mut self, point: &GlobalPoint, measure: &Measure) {
        self.0.get_or_insert((point.clone(), *measure));
    }
}

#[test]
fn the_first_point_has_the_velocities_of_its_impulses() {
    let case = Planted { contacts: 5, dofs: 30, ..Planted::default() };
    let (problem, _) = case.global::<3>();
    let mut session = registry::session("nsgs", &SettingsMap::new()).unwrap();
    let (mut point, mut first) = (problem.origin(), First(None));
    session.observe(&problem, &mut point, &Limits::default(), &mut first).unwrap();
    let (first, measure) = first.0.unwrap();
    assert!(first.r.iter().all(|r| *r == 0.0) && first.v.iter().any(|v| *v != 0.0));
    assert!(measure.dynamics.unwrap() < 1e-12 && measure.velocity_gap.unwrap() < 1e-12);
}

/// A target of a proximal subproblem is no tighter than the tolerance, however loose that is.
#[test]
fn auto_takes_every_tolerance() {
    for tolerance in [1e-2, 0.1, 1.0] {
        let limits = Limits { tolerance, max_iterations: 2000, ..Limits::default() };
        let w = Bsr::from_rows(1, &[vec![(0, [[1.0, 0.0, 0.0], [0.0; 3], [0.0; 3]])]]);
        let stiff = P::new(w, vec![-1.0, 1.0, 0.0], vec![0.5]).unwrap();
        for problem in [stiff, planted().0] {
            let mut session = registry::session::<P>("auto", &SettingsMap::new()).unwrap();
            let mut point = problem.origin();
            session.solve(&problem, &mut point, &limits, &mut |_| {}).unwrap();
        }
    }
}

//! The one door: whatever the kind, and whatever is asked of the solve.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use nonsmooth_linalg::{Bsr, Dense};
use nonsmooth_problem::check::Measure;
use nonsmooth_problem::field::{Closures, Differences, Pattern};
use nonsmooth_problem::planted::{Planted, PlantedLcp, PlantedMlcp};
use nonsmooth_problem::{
    AnyProblem, FrictionGlobal, FrictionLocal, GlobalPoint, Lcp, Mcp, OfAny, Problem,
};
use nonsmooth_solve::contact::splitting::Nsgs;
use nonsmooth_solve::registry::{self, Registered};
use nonsmooth_solve::settings::SettingsMap;
use nonsmooth_solve::{
    Limit, Limits, Observer, Progress, Solvable, Solve, SolveError, Status, solve,
};

/// A problem solved by the door, as itself and without its kind: the same bits, judged alike.
fn goes_through<P: Registered + OfAny + Solvable>(problem: &P) {
    let answer = solve(problem).unwrap();
    assert!(answer.is_solved(), "{}: {}", problem.kind().name(), answer.status);
    assert_eq!(answer.certificate(), None);
    assert!(answer.verdict.solved && answer.verdict.measure.relative <= 1e-8);
    assert!(!answer.account.is_empty() && !answer.history.is_empty());
    let judged = problem.judge(&answer.point, 1e-8).unwrap();
    assert_eq!(judged.measure, answer.verdict.measure, "the judge alone says the same");
    assert_eq!(judged.velocity, answer.verdict.velocity);

    let any: AnyProblem = problem.clone().into();
    let other = solve(&any).unwrap();
    assert_eq!(other.point, answer.point.clone().into());
    assert_eq!((other.iterations, other.status), (answer.iterations, answer.status));
    assert_eq!(other.verdict.velocity, answer.verdict.velocity);
    assert_eq!(other.verdict.statuses.len(), answer.verdict.statuses.len());

    let again = Solve::new().warm(&other.point).max_iterations(5).run(&any).unwrap();
    assert!(again.is_solved(), "from its own solution");
}

#[test]
fn every_kind_goes_through() {
    let planted = Planted { contacts: 6, dofs: 36, bilateral: 2, ..Planted::default() };
    goes_through(&planted.local::<2>().0);
    goes_through(&planted.local::<3>().0);
    goes_through(&planted.global::<2>().0);
    goes_through(&planted.global::<3>().0);
    let planted = PlantedLcp { n: 12, ..PlantedLcp::default() };
    goes_through(&planted.lcp().0);
    goes_through(&PlantedMlcp::default().mlcp().0);
    goes_through(&planted.hlcp().0);
    goes_through(&planted.boxed().0);
}

#[test]
fn what_is_asked_is_done() {
    let (problem, _) = Planted::default().local::<3>();
    let by_name = Solve::new().solver("nsgs").set("omega", 0.9).tolerance(1e-10);
    let answer = by_name.run(&problem).unwrap();
    assert!(answer.is_solved() && answer.verdict.measure.relative <= 1e-10);
    let by_type = Solve::new().with(&Nsgs { omega: 0.9, ..Nsgs::default() }).tolerance(1e-10);
    assert_eq!(by_type.run(&problem).unwrap().point, answer.point);
    let other = Solve::new().solver("nsgs").tolerance(1e-10).run(&problem).unwrap();
    assert_ne!(other.point, answer.point, "omega is heard");
    let mut steps = 0;
    by_name.watched(&problem, &mut |_| steps += 1).unwrap();
    assert_eq!(steps, answer.iterations);
    let few = Solve::new().solver("nsgs").tolerance(1e-14).max_iterations(2).run(&problem).unwrap();
    assert_eq!((few.status, few.iterations), (Status::Limit(Limit::Iterations), 2));
}

#[test]
fn a_limit_leaves_an_answer_with_a_verdict() {
    let (problem, _) = Planted { contacts: 400, dofs: 600, ..Planted::default() }.global::<3>();
    let flag = Arc::new(AtomicBool::new(true));
    for how in [Solve::new().cancel(flag), Solve::new().time_limit(0.0)] {
        let answer = how.run(&problem).unwrap();
        assert!(matches!(answer.status, Status::Limit(Limit::Cancelled | Limit::Time)));
        assert!(!answer.verdict.solved);
        assert_eq!(answer.verdict.velocity.len(), problem.w.len());
    }
}

#[test]
fn a_solution_to_start_from_needs_no_time() {
    let limits = Limits { time_limit: Some(0.0), ..Limits::default() };
    let matrix = Dense::from_rows(&[[2.0, 1.0], [1.0, 2.0]]).unwrap();
    let lcp = Lcp::new(matrix, vec![-5.0, -7.0]).unwrap();
    for name in registry::solver_names::<Lcp>() {
        let mut session = registry::session(&name, &SettingsMap::new()).unwrap();
        let mut point = lcp.origin();
        point.z.copy_from_slice(&[1.0, 3.0]);
        match session.solve(&lcp, &mut point, &limits, &mut |_| ()) {
            Ok(outcome) => assert_eq!(outcome.status, Status::Solved, "{name}"),
            Err(e) => assert!(e.is_inapplicable(), "{name}: {e}"),
        }
        assert_eq!(point.z, [1.0, 3.0], "{name}");
    }
}

/// Fields are public: what was changed to data that are none is an error, no panic and no proof.
#[test]
fn changed_fields_are_checked() {
    let (mut problem, _) = Planted { contacts: 2, dofs: 6, ..Planted::default() }.local::<3>();
    let said = |p: &FrictionLocal<3>| solve(p).unwrap_err().to_string();
    let q = std::mem::take(&mut problem.q);
    assert!(said(&problem).starts_with("q: expected 6"), "{}", said(&problem));
    problem.q = q;
    problem.mu[0] = -0.5;
    assert!(said(&problem).starts_with("mu[0]"), "{}", said(&problem));
    let block = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for row in [vec![(3, block)], vec![(1, block), (0, block)], vec![(0, block), (0, block)]] {
        let w = Bsr::from_rows(2, &[row, vec![(1, block)]]);
        let error = FrictionLocal::<3>::new(w, vec![1.0; 6], vec![0.5; 2]).unwrap_err();
        assert!(error.to_string().starts_with("W, block row 0"), "{error}");
    }
    let (mut lcp, _) = PlantedLcp::default().lcp();
    lcp.q.pop();
    assert!(solve(&lcp).unwrap_err().to_string().starts_with("q: expected"));
}

/// Who is given up in the middle of a preparation has the start, judged: W of a large problem, or its other form, may take all the time there is.
#[test]
fn what_observes_has_a_point_before_any_preparation() {
    struct First(Option<Measure>);
    impl Observer<FrictionGlobal<3>> for First {
        fn step(&mut self, _: &Progress) {}
        fn keeps_best(&self) -> bool {
            true
        }
        fn best(&mut self, _: &GlobalPoint, measure: &Measure) {
            self.0.get_or_insert(*measure);
        }
    }
    let (problem, _) = Planted { contacts: 6, dofs: 36, ..Planted::default() }.global::<3>();
    let limits = Limits { time_limit: Some(0.0), ..Limits::default() };
    for name in registry::solver_names::<FrictionGlobal<3>>() {
        let mut session = registry::session(&name, &SettingsMap::new()).unwrap();
        let mut first = First(None);
        let outcome = session.observe(&problem, &mut problem.origin(), &limits, &mut first);
        let inapplicable = outcome.is_err_and(|e| e.is_inapplicable());
        let judged = first.0.is_some_and(|measure| measure != Measure::unknown());
        assert!(judged || inapplicable, "{name}");
    }
}

/// After a solve the session has the judge's gauge, in which M is factorised.
#[test]
fn nothing_is_prepared_twice() {
    let (problem, _) = Planted::default().global::<3>();
    let mut session = registry::session("nsgs", &Default::default()).unwrap();
    assert!(session.gauge().is_none());
    let mut point = problem.origin();
    session.solve(&problem, &mut point, &Default::default(), &mut |_| {}).unwrap();
    assert!(session.gauge().is_some());
}

#[test]
fn mistakes_are_named() {
    let (problem, _) = Planted::default().local::<3>();
    let refused = |how: Solve| how.run(&problem).unwrap_err();
    assert!(matches!(refused(Solve::new().solver("magic")), SolveError::UnknownSolver { .. }));
    let said = refused(Solve::new().solver("nsgs").set("omega", 3.0)).to_string();
    assert_eq!(said, "solver `nsgs`: omega: expected a number in (0, 2), found 3");
    assert!(refused(Solve::new().tolerance(2.0)).to_string().contains("tolerance"));
    let (lcp, point) = PlantedLcp::default().lcp();
    let said = refused(Solve::new().warm(&point)).to_string();
    assert_eq!(
        said,
        "the point to start from: expected one of a problem friction_local_3d, found one of another kind"
    );
    let said = Solve::new().warm(&problem.origin()).run(&lcp).unwrap_err().to_string();
    assert!(said.contains("of a problem lcp"), "{said}");
}

/// A caller's function that takes its time is asked no more than a few times after the limit, whoever solves.
#[test]
fn the_time_limit_holds_for_slow_functions() {
    let n = 40;
    let value = |x: &[f64], f: &mut [f64]| {
        std::thread::sleep(Duration::from_millis(10));
        let sum: f64 = x.iter().sum();
        f.iter_mut().zip(x).for_each(|(f, x)| *f = x.powi(3) - 2.0 + 0.01 * sum);
    };
    let slack: f64 =
        std::env::var("NONSMOOTH_SLACK").ok().and_then(|s| s.parse().ok()).unwrap_or(1.0);
    let field = Differences::new(Pattern::dense(n), value).unwrap();
    let free = f64::INFINITY;
    let problem = Mcp::new(field, vec![-free; n], vec![free; n], vec![3.0; n]).unwrap();
    // A Jacobian takes .8 s.
    let solvers = registry::solver_names::<Mcp>();
    let cases = solvers.iter().map(|name| (name.as_str(), 0.1)).chain([("auto", 1.2)]);
    for (name, limit) in cases {
        let begun = Instant::now();
        let answer = Solve::new().solver(name).time_limit(limit).run(&problem).unwrap();
        let spent = begun.elapsed().as_secs_f64();
        assert_eq!(answer.status, Status::Limit(Limit::Time), "{name}");
        assert!(spent < limit + 0.35 * slack, "{name} to {limit} s: {spent}");
        assert!(answer.point.z.iter().all(|x| x.is_finite()), "{name}");
    }
}

/// At whatever time a limit comes: F is as little zero as before, though its Jacobian says that its terms are large.
#[test]
fn a_time_limit_solves_nothing() {
    let field = Closures::new(Pattern::dense(1), |x, f| f[0] = x[0] - 8.0, |_, j| j[0] = 1e12);
    let free = f64::INFINITY;
    let problem = Mcp::new(field.unwrap(), vec![-free], vec![free], vec![1.0]).unwrap();
    for name in registry::solver_names::<Mcp>() {
        for limit in [0.0, 1e-5, 1e-3] {
            let answer = match Solve::new().solver(&*name).time_limit(limit).run(&problem) {
                Err(e) if e.is_inapplicable() => continue,
                answer => answer.unwrap(),
            };
            assert!(
                !answer.is_solved() || answer.point.z[0] == 8.0,
                "{name} to {limit} s: {:?}",
                answer.point
            );
            assert!(!answer.is_solved() || answer.verdict.solved, "{name} to {limit} s");
        }
    }
}

/// Each point by which the judge knows the size of F costs three values, and there are four of them.
#[test]
fn a_slow_function_is_not_asked_for_long_after_the_end() {
    for last in (1..60).step_by(3) {
        let (calls, flag) = (Arc::new(AtomicUsize::new(0)), Arc::new(AtomicBool::new(false)));
        let (count, end) = (calls.clone(), flag.clone());
        let value = move |x: &[f64], f: &mut [f64]| {
            let call = count.fetch_add(1, Ordering::Relaxed) + 1;
            end.store(call >= last, Ordering::Relaxed);
            f[0] = (x[0] - 1.0).powi(3) + 0.3 * x[0].sin();
        };
        let slope = |x: &[f64], j: &mut [f64]| j[0] = 3.0 * (x[0] - 1.0).powi(2) + 0.3 * x[0].cos();
        let field = Closures::new(Pattern::dense(1), value, slope).unwrap();
        let problem = Mcp::ncp(field, vec![50.0]).unwrap();
        let how = Solve::new().solver("semismooth").tolerance(1e-15).cancel(flag);
        let answer = how.run(&problem).unwrap();
        let after = calls.load(Ordering::Relaxed).saturating_sub(last);
        assert!(after <= 10, "{after} after call {last}: {}", answer.status);
    }
}

//! Limits: every registered solver of every kind, on a problem of that kind on which it would go on for long, ends soon after its time limit and after a cancellation, with a finite
//! point. And what is too large for the memory limit is refused before it begins.
//!
//! Times are those of the wall, so the tests run one after the other, and on a machine that does other work besides the environment variable
//! `NONSMOOTH_SLACK` allows them so many times as long.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use nonsmooth_linalg::{Csc, Dense};
use nonsmooth_problem::check::{Existence, Measure};
use nonsmooth_problem::planted::{PlantedClass, PlantedLcp, PlantedMlcp};
use nonsmooth_problem::{
    BoxLcp, Friction, FrictionGlobal, FrictionLocal, Hlcp, Kind, Lcp, LcpPoint, Mlcp, Problem,
};
use nonsmooth_scenes::SceneEntry;
use nonsmooth_solve::registry::{self, Registered};
use nonsmooth_solve::settings::{SettingsMap, from_texts};
use nonsmooth_solve::{Limit, Limits, Solve, Status, existence};

/// Seconds that a solve may take, and after which it is cancelled.
const LIMIT: f64 = 0.25;
const CANCEL: f64 = 0.2;

/// One test at a time.
fn alone() -> MutexGuard<'static, ()> {
    static ALONE: Mutex<()> = Mutex::new(());
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// How many times as long as allowed a loaded machine may take.
fn slack() -> f64 {
    std::env::var("NONSMOOTH_SLACK").ok().and_then(|s| s.parse().ok()).unwrap_or(1.0)
}

/// Waits until solves that were given up have ended by themselves, so that they take no time from the next one.
fn settle() {
    let threads = || std::fs::read_dir("/proc/self/task").map_or(0, Iterator::count);
    let before = Instant::now();
    // The main thread, this test's and those of its peers that wait.
    while threads() > 2 + std::thread::available_parallelism().map_or(1, usize::from)
        && before.elapsed() < Duration::from_secs(20)
    {
        std::thread::sleep(Duration::from_millis(10));
    }
}

trait Finite {
    fn is_finite(&self) -> bool;
}

impl Finite for LcpPoint {
    fn is_finite(&self) -> bool {
        self.z.iter().all(|z| z.is_finite())
    }
}

impl Finite for nonsmooth_problem::HlcpPoint {
    fn is_finite(&self) -> bool {
        self.x.iter().chain(&self.s).all(|x| x.is_finite())
    }
}

impl Finite for nonsmooth_problem::LocalPoint {
    fn is_finite(&self) -> bool {
        self.r.iter().chain(&self.lambda).all(|x| x.is_finite())
    }
}

impl Finite for nonsmooth_problem::GlobalPoint {
    fn is_finite(&self) -> bool {
        self.v.iter().chain(&self.r).chain(&self.lambda).all(|x| x.is_finite())
    }
}

/// All solvers of a kind, each within the time limit and after a cancellation.
fn all_end<P: Registered<Point: Finite>>(problem: &P, what: &str) {
    let _alone = alone();
    let mut late = vec![];
    let begun = Instant::now();
    drop(problem.gauge().unwrap());
    // Where the judge is not even prepared in time, nothing is judged.
    let judged = begun.elapsed().as_secs_f64() < 0.25 * CANCEL;
    for name in registry::solver_names::<P>() {
        let composed = name.contains('/');
        for cancelled in [false, true] {
            // The solver behind a prefix is cancelled as the same solver is without.
            if cancelled && composed {
                continue;
            }
            let flag = Arc::new(AtomicBool::new(false));
            let limits = Limits {
                // Out of reach, so that nobody is done before.
                tolerance: 1e-300,
                max_iterations: usize::MAX,
                time_limit: (!cancelled).then_some(LIMIT),
                cancel: cancelled.then(|| flag.clone()),
                ..Limits::default()
            };
            let mut session = registry::session::<P>(&name, &SettingsMap::new()).unwrap();
            let mut point = problem.origin();
            let begun = Instant::now();
            let timer = cancelled.then(|| {
                std::thread::spawn(move || {
                    std::thread::sleep(Duration::from_secs_f64(CANCEL));
                    flag.store(true, Ordering::Relaxed);
                })
            });
            let outcome = session.solve(problem, &mut point, &limits, &mut |_| {});
            let wall = begun.elapsed().as_secs_f64();
            let allowed = if cancelled { CANCEL + 0.2 } else { 1.1 * LIMIT + 0.2 };
            if wall > slack() * allowed {
                late.push(format!("{name} (cancelled: {cancelled}): {wall:.2} s of {allowed:.2}"));
            }
            match outcome {
                Ok(outcome) => {
                    assert!(point.is_finite(), "{name} on {what}: {outcome:?}");
                    let expected = if cancelled { Limit::Cancelled } else { Limit::Time };
                    if let Status::Limit(limit) = outcome.status {
                        assert_eq!(limit, expected, "{name} on {what}");
                    }
                    let known = outcome.measure != Measure::unknown();
                    assert!(known || !judged, "{name} on {what}");
                }
                Err(e) => assert!(e.is_inapplicable(), "{name} on {what}: {e}"),
            }
            if let Some(timer) = timer {
                timer.join().unwrap();
            }
            settle();
        }
    }
    assert!(late.is_empty(), "{what}:\n{}", late.join("\n"));
}

/// A sparse random M with a heavy diagonal: sweeps do not converge, and its LU fills up.
fn filling(n: usize) -> (Csc, Vec<f64>) {
    let mut state = 1_u64;
    let mut random = move || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut entries: Vec<(usize, usize, f64)> = (0..n).map(|i| (i, i, 6.0)).collect();
    for _ in 0..5 * n {
        let (i, j) = ((random() * n as f64) as usize, (random() * n as f64) as usize);
        entries.push((i.min(n - 1), j.min(n - 1), 4.0 * random() - 2.0));
    }
    let q = (0..n).map(|_| 2.0 * random() - 1.0).collect();
    (Csc::from_triplets(n, n, entries.into_iter()).unwrap(), q)
}

fn scene(name: &str, settings: &[&str]) -> FrictionGlobal<3> {
    let settings = from_texts(settings).unwrap();
    SceneEntry::find(name).unwrap().make(&settings).unwrap().problem().unwrap()
}

fn condensed(name: &str, settings: &[&str]) -> FrictionLocal<3> {
    let settings = from_texts(settings).unwrap();
    SceneEntry::find(name).unwrap().make(&settings).unwrap().condensed().unwrap()
}

#[test]
fn solvers_of_a_sparse_lcp() {
    let (m, q) = filling(6000);
    all_end(&Lcp::new(m, q).unwrap(), "a sparse LCP");
}

#[test]
fn solvers_of_a_dense_lcp() {
    let (problem, _) =
        PlantedLcp { n: 1200, class: PlantedClass::Spd, ..PlantedLcp::default() }.lcp();
    all_end(&problem, "a dense LCP");
}

#[test]
fn solvers_of_a_small_lcp_that_has_no_answer() {
    // No thread: the limits are looked at by the kernels alone.
    let (m, q) = filling(250);
    all_end(&Lcp::new(m, q).unwrap(), "a small LCP");
}

#[test]
fn certificates_that_hold_nearly_are_weighed_within_the_limits() {
    let _alone = alone();
    // M = B Bᵀ of low rank: rays of Lemke's method are Farkas vectors but for rounding. Up to 300 unknowns there is no thread that gives up what is late.
    for (n, rank) in [(120, 30), (200, 50), (300, 75)] {
        let entry = |i: usize, k: usize| ((i * 37 + k * 91 + 1) as f64 * 0.618).sin();
        let gram = |i: usize, j: usize| (0..rank).map(|k| entry(i, k) * entry(j, k)).sum::<f64>();
        let problem = Lcp::new(Dense::from_fn(n, n, gram), vec![-1.0; n]).unwrap();
        for solver in ["auto", "lemke", "ip_mehrotra"] {
            let begun = Instant::now();
            let answer = Solve::new().solver(solver).time_limit(LIMIT).run(&problem).unwrap();
            let wall = begun.elapsed().as_secs_f64();
            assert!(wall <= slack() * (1.1 * LIMIT + 0.2), "{solver} on {n}: {wall:.2} s");
            assert!(answer.point.is_finite(), "{solver} on {n}");
        }
    }
}

#[test]
fn solvers_of_an_mlcp() {
    let planted = PlantedMlcp { free: 300, pairs: 700, ..PlantedMlcp::default() };
    all_end::<Mlcp>(&planted.mlcp().0, "an MLCP");
}

#[test]
fn solvers_of_an_hlcp() {
    let (problem, _) = PlantedLcp { n: 500, ..PlantedLcp::default() }.hlcp();
    all_end::<Hlcp>(&problem, "a horizontal LCP");
}

#[test]
fn solvers_of_a_box_lcp() {
    let (m, q) = filling(3000);
    let bounds = (vec![0.0; 3000], vec![0.05; 3000]);
    all_end(&BoxLcp::new(m, q, bounds.0, bounds.1).unwrap(), "a box LCP");
}

#[test]
fn solvers_of_local_contacts() {
    let problem = condensed("sphere_pile", &["count=1200"]);
    assert_eq!(problem.kind(), Kind::FrictionLocal3d);
    all_end(&problem, "a pile of spheres, local");
}

#[test]
fn solvers_of_global_contacts() {
    all_end(&scene("sphere_pile", &["count=1200"]), "a pile of spheres, global");
}

#[test]
fn solvers_of_an_elastic_body() {
    all_end(&scene("elastic_cubes", &["elements=12", "support=ground"]), "elastic cubes");
}

#[test]
fn existence_ends_and_says_which_limit_came() {
    let _alone = alone();
    let problem = Friction::Global3(scene("sphere_pile", &["count=2500"]));
    let begun = Instant::now();
    let limits = Limits { time_limit: Some(0.1), ..Limits::default() };
    let decided = existence::of_contacts(&problem, &limits);
    assert!(begun.elapsed().as_secs_f64() <= slack() * 0.31, "{:?}", begun.elapsed());
    if let Existence::Unknown { why } = decided {
        assert!(why.contains("time limit"), "{why}");
    }
    settle();
    let flag = Arc::new(AtomicBool::new(true));
    let limits = Limits { cancel: Some(flag), ..Limits::default() };
    let begun = Instant::now();
    let Existence::Unknown { why } = existence::of_contacts(&problem, &limits) else {
        panic!("decided though cancelled");
    };
    assert!(begun.elapsed().as_secs_f64() <= slack() * 0.2, "{:?}", begun.elapsed());
    assert!(why.contains("cancelled"), "{why}");
}

#[test]
fn a_session_goes_on_after_it_was_given_up() {
    let _alone = alone();
    let problem = condensed("sphere_pile", &["count=300"]);
    let mut session = registry::session::<FrictionLocal<3>>("ip", &SettingsMap::new()).unwrap();
    let short = Limits { time_limit: Some(0.0), ..Limits::default() };
    let first = session.solve(&problem, &mut problem.origin(), &short, &mut |_| {}).unwrap();
    assert_eq!(first.status, Status::Limit(Limit::Time));
    let long = Limits { tolerance: 1e-4, time_limit: Some(60.0), ..Limits::default() };
    let second = session.solve(&problem, &mut problem.origin(), &long, &mut |_| {}).unwrap();
    assert_eq!(second.status, Status::Solved, "{second:?}");
    assert!(!session.history().is_empty());
}

#[test]
fn what_is_too_large_is_refused_by_name() {
    let _alone = alone();
    let (m, q) = filling(2000);
    let problem = Lcp::new(m, q).unwrap();
    let limits = Limits { memory_limit: Some(200_000), max_iterations: 300, ..Limits::default() };
    for name in ["criss_cross", "keller"] {
        let mut session = registry::session::<Lcp>(name, &SettingsMap::new()).unwrap();
        let e = session.solve(&problem, &mut problem.origin(), &limits, &mut |_| {}).unwrap_err();
        assert!(e.is_inapplicable(), "{e}");
        let e = e.to_string();
        assert!(e.contains("dense tableau would take about 61 MB"), "{e}");
        assert!(e.contains("the memory limit is 195 KB"), "{e}");
    }
    for (name, steps) in [("newton_min", 300), ("lemke", 100_000), ("ip_mehrotra", 300)] {
        let limits = Limits { max_iterations: steps, ..limits.clone() };
        let mut session = registry::session::<Lcp>(name, &SettingsMap::new()).unwrap();
        let said = match session.solve(&problem, &mut problem.origin(), &limits, &mut |_| {}) {
            Ok(outcome) if outcome.status == Status::Solved => continue,
            Ok(outcome) => outcome.status.to_string(),
            Err(e) => e.to_string(),
        };
        assert!(said.contains("of memory, and the memory limit is"), "{name}: {said}");
    }
    // What needs no factorisation goes on, and `auto` finds it.
    let mut session = registry::session::<Lcp>("auto", &SettingsMap::new()).unwrap();
    let limits = Limits { time_limit: Some(20.0), max_iterations: usize::MAX, ..limits };
    let outcome = session.solve(&problem, &mut problem.origin(), &limits, &mut |_| {}).unwrap();
    assert!(outcome.iterations > 0, "{outcome:?}");
}

//! The interior-point methods on real problems.

use crate::common::{run, within};
use nonsmooth_io::fclib;
use nonsmooth_problem::{Friction, Problem};
use nonsmooth_scenes::scenes::{Bridge, Family, State, Wall};
use nonsmooth_solve::{Limits, Status, registry};

/// The names of the problems among Siconos' that `ip` solves to 1e-12, and how many there are.
fn solved(setting: &str) -> (Vec<String>, usize) {
    let (mut names, mut all) = (vec![], 0);
    for path in crate::common::corpus_files(&["siconos/fc3d"]) {
        let Ok(Friction::Local3(problem)) = fclib::read_problem(&path) else { continue };
        all += 1;
        let settings = nonsmooth_solve::settings::from_texts(&[setting, "patience=60"]).unwrap();
        let mut session = registry::session("ip", &settings).unwrap();
        let limits = Limits { tolerance: 1e-12, max_iterations: 300, ..Limits::default() };
        let mut point = problem.origin();
        let outcome = session.solve(&problem, &mut point, &limits, &mut |_| {}).unwrap();
        if outcome.measure.relative <= 1e-12 {
            names.push(path.file_stem().unwrap().to_string_lossy().into_owned());
        }
    }
    (names, all)
}

/// Where contacts stick and slip in turn the path turns back, and has kinks that δ makes smooth.
#[test]
fn the_arc_length_goes_through_shaken_walls() {
    let wall = Wall { rows: 24, columns: 24, state: State::Perturbed, ..Wall::default() };
    let problem = wall.build().unwrap().problem().unwrap();
    let solved = |settings: &[&str]| {
        let limits = Limits { max_iterations: 200, ..within(1e-8, 60.0) };
        run(&problem, "ip", settings, &limits).outcome
    };
    let pursued = solved(&["path=continuation", "smoothing=0.5", "patience=60"]);
    assert_eq!(pursued.status, Status::Solved, "{}", pursued.measure.relative);
    let monotone = solved(&["path=mehrotra", "patience=60"]);
    assert!(monotone.measure.relative > 1e-5, "{}", monotone.measure.relative);
}

/// From the cones' units the equations lag behind sixtyfold here, and steps of a hundredth lead nowhere.
#[test]
fn interior_points_cross_large_mass_ratios() {
    for seed in [52, 53] {
        let bridge = Bridge { spans: 2, mass_ratio: 1e6, mu: 0.8, seed, ..Bridge::default() };
        let problem = bridge.build().unwrap().problem().unwrap();
        let whole = run(&problem, "auto", &[], &within(1e-8, 60.0)).outcome;
        assert_eq!(whole.status, Status::Solved, "{seed}: {}", whole.measure.relative);
        assert!(whole.iterations < 300, "{seed}: {}", whole.iterations);
        // Nothing slides with the first seed.
        if seed == 52 {
            let relaxed = run(&problem, "convex_relaxation", &[], &within(1e-8, 60.0)).outcome;
            assert_eq!(relaxed.status, Status::Solved, "{}", relaxed.measure.relative);
            assert!(relaxed.iterations <= 60, "{}", relaxed.iterations);
        }
    }
}

#[test]
fn the_arc_length_solves_what_mehrotras_steps_do_not() {
    let ((monotone, all), (pursued, _)) = (solved("path=mehrotra"), solved("path=continuation"));
    if all == 0 {
        return;
    }
    assert!(monotone.len() + 3 >= all, "{} of {all}: {monotone:?}", monotone.len());
    assert!(pursued.len() + 2 >= all, "{} of {all}: {pursued:?}", pursued.len());
    let rover = |names: &[String]| names.iter().any(|name| name == "Rover11035");
    assert!(rover(&pursued) && !rover(&monotone));
}

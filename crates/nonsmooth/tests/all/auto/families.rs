//! Each family solves what the literature says that it does, and methods that have nothing in common find the same velocities.

use crate::common::{Run, run, within};
use nonsmooth_analysis::Spectrum;
use nonsmooth_io::fclib;
use nonsmooth_linalg::norm;
use nonsmooth_problem::check::Judged;
use nonsmooth_problem::planted::{Planted, PlantedMix};
use nonsmooth_problem::{FrictionGlobal, FrictionLocal, with_friction};
use nonsmooth_scenes::scenes::{Chain, Family, Kapla, SpherePile, Stack, State, Wall};
use nonsmooth_solve::contact::Condense;
use nonsmooth_solve::registry::Registered;
use nonsmooth_solve::{Limits, Reformulation, Status};

const MIXED: PlantedMix = PlantedMix { open: 1.0, stick: 1.0, slip: 1.0, degenerate: 0.0 };

fn must_solve<P: Registered + Judged>(problem: &P, solver: &str, limits: &Limits, what: &str) {
    let end = run(problem, solver, &[], limits).outcome;
    let relative = end.measure.relative;
    assert_eq!(end.status, Status::Solved, "{what}, {solver}: {relative:e}, {}", end.iterations);
}

fn scene(family: &impl Family) -> FrictionGlobal<3> {
    family.build().unwrap().problem().unwrap()
}

fn local(p: &FrictionGlobal<3>) -> FrictionLocal<3> {
    Condense.reduce(p).unwrap().0
}

/// AlartCurnier1991: locally quadratic where the Jacobian is regular.
#[test]
fn newton_on_regular_problems_to_the_last_digit() {
    for seed in 0..10 {
        let case = Planted { contacts: 40, dofs: 240, mix: MIXED, seed, ..Planted::default() };
        let limits = Limits { max_iterations: 100, ..within(1e-12, 20.0) };
        must_solve(&case.local::<3>().0, "newton_ac", &limits, &format!("seed {seed}"));
        must_solve(&case.global::<3>().0, "newton_ac", &limits, &format!("seed {seed}"));
        must_solve(&case.local::<2>().0, "newton_ac", &limits, &format!("seed {seed}, plane"));
    }
}

/// Hyperstatic and rigid, loaded by their weight, disturbed, or falling.
fn rigid() -> Vec<(String, FrictionGlobal<3>)> {
    let mut all = vec![];
    for state in [State::Rest, State::Perturbed, State::Impact] {
        let wall = Wall { state, head_joints: true, ..Wall::default() };
        all.push((format!("wall, {state:?}"), scene(&wall)));
        let kapla = Kapla { layers: 8, planks: 3, state, ..Kapla::default() };
        all.push((format!("kapla, {state:?}"), scene(&kapla)));
    }
    all
}

/// AcaryBremondHuber2018: robust, and slow beyond a few digits.
#[test]
fn gauss_seidel_on_rigid_hyperstatic_scenes_to_a_loose_tolerance() {
    for (what, problem) in rigid() {
        let limits = Limits { max_iterations: 20_000, ..within(1e-4, 30.0) };
        must_solve(&local(&problem), "nsgs", &limits, &what);
        must_solve(&problem, "nsgs", &limits, &what);
    }
}

/// AcaryBremondHuber2018: the proximal term makes W regular, so that the inner method meets what it is good at.
#[test]
fn the_proximal_point_method_on_hyperstatic_scenes() {
    for (what, problem) in rigid() {
        must_solve(&local(&problem), "proximal/newton_ac", &within(1e-8, 30.0), &what);
        must_solve(&problem, "proximal/newton_ac", &within(1e-8, 30.0), &what);
    }
    let (what, problem) = &rigid()[0];
    must_solve(&local(problem), "proximal/nsgs", &within(1e-8, 30.0), what);
}

#[test]
fn projection_methods_on_small_problems() {
    for seed in 0..3 {
        let case = Planted { contacts: 8, dofs: 60, mix: MIXED, seed, ..Planted::default() };
        let tower = scene(&Stack { count: 1, ..Stack::default() });
        let limits = Limits { max_iterations: 100_000, ..within(1e-8, 30.0) };
        for solver in ["fixed_point", "extragradient", "hyperplane", "de_saxce"] {
            must_solve(&case.local::<3>().0, solver, &limits, &format!("seed {seed}"));
            must_solve(&tower, solver, &limits, "one box");
        }
    }
}

/// H has more columns than rows, and dependent ones.
#[test]
fn the_interior_point_where_h_has_no_full_rank() {
    for seed in 0..5 {
        let case = Planted { contacts: 30, dofs: 60, mix: MIXED, seed, ..Planted::default() };
        let limits = Limits { max_iterations: 200, ..within(1e-10, 20.0) };
        must_solve(&case.global::<3>().0, "ip", &limits, &format!("seed {seed}"));
    }
    for (what, problem) in rigid().iter().filter(|(what, _)| what.ends_with("Rest")) {
        must_solve(problem, "ip", &Limits { max_iterations: 200, ..within(1e-10, 20.0) }, what);
    }
}

/// Methods that share no idea with `auto`: sweeps, splitting, Newton's method alone, the central path alone.
const OTHERS: [&str; 4] = ["nsgs", "admm", "newton_ac", "ip"];

/// How far u may be off, relative to the free velocity.
const AGREE: f64 = 1e-8;

/// How many of the others reach 1e-10 where `auto` does; all must then have its velocities.
fn agreements<P: Registered + Judged>(problem: &P, what: &str, sweeps: usize) -> usize {
    let solve = |solver: &str| {
        let max_iterations = match solver {
            "nsgs" | "admm" => sweeps,
            _ => 200,
        };
        // What it reaches counts: some end between 1e-12 and 1e-10.
        let Run { outcome, verdict, .. } =
            run(problem, solver, &[], &Limits { max_iterations, ..within(1e-12, 5.0) });
        (outcome.measure.relative <= 1e-10).then_some((verdict.velocity, outcome.measure))
    };
    let Some((reference, measure)) = solve("auto") else { return 0 };
    // ‖q‖, or 1 where nothing moves.
    let scale = match measure.relative {
        0.0 => 1.0,
        relative => measure.absolute / relative,
    };
    let mut agreed = 0;
    // Rolling friction has fewer of them.
    let known = nonsmooth_solve::registry::solver_names::<P>();
    for solver in OTHERS.iter().filter(|name| known.iter().any(|k| k == *name)).copied() {
        let Some((u, _)) = solve(solver) else { continue };
        let apart: Vec<_> = u.iter().zip(&reference).map(|(a, b)| a - b).collect();
        let d = norm(&apart) / scale;
        assert!(d <= AGREE, "{what}: {solver} and auto differ by {d:e}");
        agreed += 1;
    }
    agreed
}

#[test]
fn methods_agree_on_made_problems_of_full_rank() {
    let mut agreed = 0;
    let mut problems = 0;
    for seed in 0..6 {
        let bilateral = if seed % 3 == 2 { 3 } else { 0 };
        let case = Planted {
            contacts: 15,
            dofs: 90,
            bilateral,
            mix: MIXED,
            mu: (0.0, 0.6),
            seed,
            ..Planted::default()
        };
        agreed += agreements(&case.local::<3>().0, &format!("local, seed {seed}"), 20_000);
        agreed += agreements(&case.global::<3>().0, &format!("global, seed {seed}"), 20_000);
        agreed += agreements(&case.local::<2>().0, &format!("plane, seed {seed}"), 20_000);
        problems += 3;
    }
    for state in [State::Rest, State::Perturbed, State::Impact] {
        let chain = scene(&Chain { links: 6, points: 1, state, ..Chain::default() });
        let pile = scene(&SpherePile { state, ..SpherePile::default() });
        for (name, problem) in [("chain", chain), ("pile", pile)] {
            let rank = Spectrum::of_global(&problem, 1000).unwrap();
            if rank.rank == rank.rows {
                agreed += agreements(&local(&problem), &format!("{name}, {state:?}"), 20_000);
                problems += 1;
            }
        }
    }
    eprintln!("{agreed} agreements on {problems} problems");
    assert!(agreed >= 3 * problems, "{agreed} agreements on {problems} problems");
}

#[test]
fn methods_agree_on_the_corpus() {
    let (mut problems, mut agreed) = (0, 0);
    for path in crate::common::corpus_files(&["siconos", "generated"]) {
        let Ok(problem) = fclib::read_problem(&path) else { continue };
        // The largest whose singular values are cheap.
        let Ok(spectrum) = Spectrum::of(&problem, 300) else { continue };
        if spectrum.rank < spectrum.rows {
            continue;
        }
        let what = path.display().to_string();
        problems += 1;
        agreed += with_friction!(&problem, p => agreements(p, &what, 2_000));
    }
    eprintln!("{agreed} agreements on {problems} problems");
    assert!(problems == 0 || agreed > 2 * problems, "{agreed} agreements on {problems} problems");
}

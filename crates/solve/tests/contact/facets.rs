//! Friction through facets: reduce, solve, lift, and the word of the friction problem's own judge.

use nonsmooth_linalg::{Bsr, Csc};
use nonsmooth_problem::check::Judged;
use nonsmooth_problem::planted::{Planted, PlantedMix};
use nonsmooth_problem::{FrictionLocal, LocalPoint, Problem};
use nonsmooth_solve::bridges::{FacetInner, FacetOuter, Facets};
use nonsmooth_solve::contact::Condense;
use nonsmooth_solve::{
    Driver, Limits, Outcome, Reformulation, Session, SolveError, Solver, Status, Via, registry,
};

use crate::plain_lemke::PlainLemke;

const SEEDS: std::ops::Range<u64> = 0..8;

fn limits() -> Limits {
    Limits { tolerance: 1e-10, max_iterations: 100_000, ..Limits::default() }
}

fn driver<const D: usize, R>(reformulation: R) -> Driver<FrictionLocal<D>, Via<R, PlainLemke>>
where
    R: Reformulation<FrictionLocal<D>>,
    PlainLemke: Solver<R::To>,
{
    Driver::new(Via { reformulation, solver: PlainLemke })
}

fn run<P: Problem>(session: &mut dyn Session<P>, problem: &P) -> (Outcome, P::Point) {
    let mut point = problem.origin();
    let outcome = session.solve(problem, &mut point, &limits(), &mut |_| {}).unwrap();
    (outcome, point)
}

fn inner<const D: usize>(facets: Facets, p: &FrictionLocal<D>) -> (Outcome, LocalPoint) {
    run(&mut driver(FacetInner::<D>(facets)), p)
}

fn outer<const D: usize>(facets: Facets, p: &FrictionLocal<D>) -> (Outcome, LocalPoint) {
    run(&mut driver(FacetOuter::<D>(facets)), p)
}

fn facets(facets: usize) -> Facets {
    Facets { facets, ..Facets::default() }
}

const MIXED: PlantedMix = PlantedMix { open: 1.0, stick: 1.0, slip: 1.0, degenerate: 0.0 };
const SLIDING: PlantedMix = PlantedMix { open: 0.0, stick: 0.0, slip: 1.0, degenerate: 0.0 };

/// As many degrees of freedom as W is regular with.
fn planted(seed: u64, mix: PlantedMix) -> Planted {
    Planted { contacts: 6, dofs: 36, mix, mu: (0.2, 0.6), seed, ..Planted::default() }
}

fn farthest(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |m, (a, b)| m.max((a - b).abs()))
}

#[test]
fn the_plane_is_exact() {
    for seed in SEEDS {
        for (bilateral, mu) in [(0, (0.2, 0.6)), (3, (0.2, 0.6)), (0, (0.0, 0.0))] {
            let case = Planted { bilateral, mu, ..planted(seed, MIXED) };
            let (problem, _) = case.local::<2>();
            let mut nsgs =
                registry::session::<FrictionLocal<2>>("nsgs", &Default::default()).unwrap();
            let mut reference = problem.origin();
            let fine = Limits { tolerance: 1e-13, ..limits() };
            nsgs.solve(&problem, &mut reference, &fine, &mut |_| {}).unwrap();
            for (outcome, point) in
                [inner(Facets::default(), &problem), outer(Facets::default(), &problem)]
            {
                assert_eq!(outcome.status, Status::Solved, "{case:?}");
                assert!(outcome.measure.relative < 1e-13, "{case:?}: {:?}", outcome.measure);
                let far = farthest(&point.r, &reference.r);
                assert!(far < 1e-10, "{case:?}: {far:e}");
            }
        }
    }
}

#[test]
fn contacts_without_friction_are_exact_in_space() {
    for seed in SEEDS {
        let case = Planted { mu: (0.0, 0.0), ..planted(seed, MIXED) };
        let (problem, known) = case.local::<3>();
        for (outcome, point) in [inner(facets(5), &problem), outer(facets(5), &problem)] {
            assert_eq!(outcome.status, Status::Solved);
            assert!(farthest(&point.r, &known.r) < 1e-10);
        }
        // Some with and some without.
        let (mut problem, _) = planted(seed, MIXED).local::<3>();
        problem.mu.iter_mut().step_by(2).for_each(|mu| *mu = 0.0);
        for (outcome, point) in [inner(facets(16), &problem), outer(facets(16), &problem)] {
            assert!(outcome.measure.relative < 0.1, "{:?}", outcome.measure);
            assert!((0..6).step_by(2).all(|c| point.r[3 * c + 1..3 * c + 3] == [0.0, 0.0]));
        }
    }
}

/// In space nothing is called solved that is not: the facets' answer comes with the residual of Coulomb's law, which is of the order of π/ω.
#[test]
fn in_space_the_residual_falls_like_the_width_of_a_facet() {
    for edge in [inner::<3>, outer::<3>] {
        let mut means = vec![];
        for count in [4, 8, 16, 32, 64] {
            let mut sum = 0.0;
            for seed in SEEDS {
                let (problem, _) = planted(seed, SLIDING).local::<3>();
                let (outcome, point) = edge(facets(count), &problem);
                let said = outcome.status.to_string();
                assert!(said.contains("the faceted problem is solved"), "{count} {seed}: {said}");
                let verdict = problem.judge(&point, 1e-10).unwrap();
                assert!(!verdict.solved && verdict.measure == outcome.measure);
                sum += outcome.measure.relative;
            }
            means.push(sum / SEEDS.end as f64);
        }
        // Sixteen times as many facets: about a sixteenth, and far from a 256th.
        assert!(means.windows(2).all(|m| m[1] < 0.75 * m[0]), "{means:?}");
        let gain = means[0] / means[4];
        assert!((8.0..40.0).contains(&gain), "{means:?}");
    }
}

/// One contact, `W = 1`, that slides along the angle given.
fn sliding(angle: f64) -> FrictionLocal<3> {
    let unit = std::array::from_fn(|k| std::array::from_fn(|l| f64::from(u8::from(k == l))));
    let q = vec![-1.0, 2.0 * angle.cos(), 2.0 * angle.sin()];
    FrictionLocal::new(Bsr::from_rows(1, &[vec![(0, unit)]]), q, vec![0.5]).unwrap()
}

/// Towards a vertex of the inner polygon or a normal of the outer one both are right; towards the middle between two, the size of the friction is
/// wrong by `1 − cos(π/ω)` and its direction right: second order.
#[test]
fn along_the_axes_of_the_polygon_the_error_is_of_second_order() {
    for edge in [inner::<3>, outer::<3>] {
        let mut errors = vec![];
        for count in [8, 16, 32, 64] {
            let angle = 0.4;
            let (aligned, _) = edge(Facets { facets: count, facet_angle: angle }, &sliding(angle));
            assert_eq!(aligned.status, Status::Solved, "{count}");
            let half = std::f64::consts::PI / count as f64;
            let (between, _) =
                edge(Facets { facets: count, facet_angle: angle + half }, &sliding(angle));
            errors.push(between.measure.relative);
        }
        for (k, pair) in errors.windows(2).enumerate() {
            let ratio = pair[0] / pair[1];
            assert!((3.5..4.5).contains(&ratio), "{k}: {errors:?}");
        }
    }
}

#[test]
fn the_inner_polygon_is_inside_the_cone_and_the_cone_inside_the_outer() {
    let mut outside = 0;
    for seed in SEEDS {
        let (problem, _) = planted(seed, SLIDING).local::<3>();
        for count in [3, 4, 7] {
            let (_, within) = inner(facets(count), &problem);
            let (_, around) = outer(facets(count), &problem);
            for (c, mu) in problem.mu.iter().enumerate() {
                let size = |r: &[f64]| r[3 * c + 1].hypot(r[3 * c + 2]);
                let normal = |r: &[f64]| mu * r[3 * c];
                let rounding = 1e-10;
                assert!(size(&within.r) <= normal(&within.r) + rounding);
                let far = 1.0 / (std::f64::consts::PI / count as f64).cos();
                assert!(size(&around.r) <= far * normal(&around.r) + rounding);
                outside += usize::from(size(&around.r) > normal(&around.r) + rounding);
            }
        }
    }
    assert!(outside > 0, "the outer polygon is larger than the disk");
}

/// Tangents turned by an angle together with the first facet: the same impulses, turned.
/// Contacts coupled in the normals alone: blocks store zeros, which the linear problem drops.
#[test]
fn a_second_problem_of_the_same_pattern_may_have_zeros_in_its_blocks() {
    let block = |c: usize, k: usize| {
        let normal = if c == k { 1.1 } else { 0.1 };
        let tangent = if c == k { 1.0 } else { 0.0 };
        [[normal, 0.0], [0.0, tangent]]
    };
    let rows: Vec<Vec<_>> =
        (0..4).map(|c| (0..4).map(|k| (k as u32, block(c, k))).collect()).collect();
    let q = |scale: f64| [-scale, 0.5 * scale].repeat(4);
    let of = |scale: f64| {
        FrictionLocal::<2>::new(Bsr::from_rows(4, &rows), q(scale), vec![0.5; 4]).unwrap()
    };
    for name in ["facet_outer/lemke", "facet_inner/lemke"] {
        let mut session = registry::session::<FrictionLocal<2>>(name, &Default::default()).unwrap();
        let solved = |(outcome, point): (Outcome, LocalPoint)| {
            assert_eq!(outcome.status, Status::Solved, "{name}");
            point.r
        };
        let first = solved(run(&mut *session, &of(1.0)));
        let second = solved(run(&mut *session, &of(2.0)));
        first.iter().zip(&second).for_each(|(a, b)| assert!((2.0 * a - b).abs() < 1e-9, "{name}"));
    }
}

/// A ray of the linear problem is no answer to the other.
#[test]
fn what_proves_nothing_does_not_replace_a_better_start() {
    let mut rays = 0;
    for seed in 0..60 {
        // Not monotone.
        let entry =
            |i: usize, j: usize| (1.3 + seed as f64 + 7.1 * i as f64 + 3.7 * j as f64).sin();
        let entries = (0..36).map(|k| (k / 6, k % 6, entry(k / 6, k % 6)));
        let matrix = Bsr::from_csc(&Csc::from_triplets(6, 6, entries).unwrap());
        let q = (0..6).map(|i| entry(i, 9)).collect();
        let problem = FrictionLocal::<3>::new(matrix, q, vec![0.6; 2]).unwrap();
        for name in ["facet_outer/lemke", "facet_inner/lemke"] {
            let mut session =
                registry::session::<FrictionLocal<3>>(name, &Default::default()).unwrap();
            let (outcome, _) = run(&mut *session, &problem);
            let start = problem.judge(&problem.origin(), 1e-10).unwrap().measure;
            if matches!(outcome.status, Status::NoConclusion(_)) {
                rays += 1;
                assert!(outcome.measure.relative <= start.relative, "{name} {seed}");
            }
        }
    }
    assert!(rays > 0);
}

#[test]
fn the_first_facet_turns_with_the_frame() {
    let turn = 0.7_f64;
    let (sin, cos) = turn.sin_cos();
    let t = [[1.0, 0.0, 0.0], [0.0, cos, -sin], [0.0, sin, cos]];
    let (problem, _) = planted(3, MIXED).local::<3>();
    let n = problem.q.len();
    let stated = |c: usize, k: usize, l: usize| (3 * c + k, 3 * c + l, t[k][l]);
    let entries: Vec<_> =
        (0..n / 3).flat_map(|c| (0..9).map(move |i| stated(c, i / 3, i % 3))).collect();
    let turned = Csc::from_triplets(n, n, entries.into_iter()).unwrap();
    let apply = |x: &[f64]| {
        let mut y = vec![0.0; n];
        turned.mul_add(1.0, x, &mut y);
        y
    };
    // T W Tᵀ, column by column.
    let w = problem.W.to_csc();
    let columns = (0..n).flat_map(|j| {
        let mut unit = vec![0.0; n];
        unit[j] = 1.0;
        let (mut back, mut x) = (vec![0.0; n], vec![0.0; n]);
        turned.mul_transpose_add(1.0, &unit, &mut back);
        w.mul_add(1.0, &back, &mut x);
        apply(&x).into_iter().enumerate().map(move |(i, x)| (i, j, x)).collect::<Vec<_>>()
    });
    let columns: Vec<_> = columns.collect();
    let matrix = Bsr::from_csc(&Csc::from_triplets(n, n, columns.into_iter()).unwrap());
    let other = FrictionLocal::new(matrix, apply(&problem.q), problem.mu.clone()).unwrap();
    for edge in [inner::<3>, outer::<3>] {
        let (_, a) = edge(Facets { facets: 6, facet_angle: 0.1 }, &problem);
        let (_, b) = edge(Facets { facets: 6, facet_angle: 0.1 + turn }, &other);
        assert!(farthest(&apply(&a.r), &b.r) < 1e-9);
        let (_, c) = edge(Facets { facets: 6, facet_angle: 0.1 }, &other);
        assert!(farthest(&b.r, &c.r) > 1e-3, "the first facet matters");
    }
}

/// The way down and up again; in the plane a solution goes down to a solution, multipliers included.
#[test]
fn a_solution_is_lowered_to_a_solution() {
    fn passes<R: Reformulation<FrictionLocal<2>>>(edge: R, case: &Planted) {
        let (problem, known) = case.local::<2>();
        let (reduced, mut memo) = edge.reduce(&problem).unwrap();
        let mut low = reduced.origin();
        edge.lower(&problem, &known, &memo, &mut low);
        let mut gauge = reduced.gauge().unwrap();
        let measure = reduced.certify(&low, &mut gauge);
        assert!(measure.passes(1e-10), "{case:?}: {measure:?}");
        let mut back = problem.origin();
        edge.lift(&problem, &low, &mut memo, &mut back);
        assert!(farthest(&back.r, &known.r) < 1e-12);
        assert!(farthest(&back.lambda, &known.lambda) < 1e-9);
    }
    for seed in SEEDS {
        let case = Planted { bilateral: 2, ..planted(seed, MIXED) };
        passes(FacetInner::<2>::default(), &case);
        passes(FacetOuter::<2>::default(), &case);
    }
}

/// A second problem in the same session, of the same shape and of another one.
#[test]
fn a_session_takes_other_values_and_other_shapes() {
    fn check(fresh: impl Fn() -> Box<dyn Session<FrictionLocal<3>>>) {
        let mut session = fresh();
        let (first, _) = planted(1, MIXED).local::<3>();
        let mut scaled = first.clone();
        scaled.q.iter_mut().for_each(|q| *q *= 3.0);
        scaled.mu.iter_mut().for_each(|mu| *mu *= 0.5);
        let mut smooth = first.clone();
        smooth.mu[2] = 0.0;
        let (bound, _) = Planted { bilateral: 2, ..planted(1, MIXED) }.local::<3>();
        let (larger, _) = Planted { contacts: 9, dofs: 60, ..planted(2, MIXED) }.local::<3>();
        for problem in [&first, &scaled, &smooth, &first, &bound, &larger, &scaled] {
            let (again, r) = run(&mut *session, problem);
            let (anew, s) = run(&mut *fresh(), problem);
            assert_eq!((r, again.measure), (s, anew.measure));
        }
    }
    check(|| Box::new(driver(FacetInner::<3>(facets(6)))));
    check(|| Box::new(driver(FacetOuter::<3>(facets(6)))));
}

/// A body between two walls that come nearer: normal impulses feel no motion, and the ray of the LCP becomes a proof about friction.
#[test]
fn normal_rays_refute_the_friction_problem() {
    let w = |sign: f64| {
        std::array::from_fn(|k| {
            std::array::from_fn(|l| match (k, l) {
                (0, 0) => sign,
                _ if k == l => 1.0,
                _ => 0.0,
            })
        })
    };
    let rows = [vec![(0, w(1.0)), (1, w(-1.0))], vec![(0, w(-1.0)), (1, w(1.0))]];
    let q = vec![-1.0, 0.3, 0.0, -1.0, 0.3, 0.0];
    let problem = FrictionLocal::<3>::new(Bsr::from_rows(2, &rows), q, vec![0.3; 2]).unwrap();
    let (outcome, _) = inner(facets(4), &problem);
    assert_eq!(outcome.status.name(), "infeasible", "{}", outcome.status);
}

#[test]
fn contradicting_constraints_are_refuted() {
    // λ would have to be 1 and 2 at once: V = 0, R = [1 1; 1 1], s = (−1, −2).
    let (mut problem, _) = planted(1, MIXED).local::<3>();
    let n = problem.q.len();
    problem.rows = Some(nonsmooth_problem::RowsLocal::bilateral(
        Csc::zeros(n, 2),
        Csc::from_triplets(2, 2, (0..4).map(|k| (k / 2, k % 2, 1.0))).unwrap(),
        vec![-1.0, -2.0],
    ));
    for outcome in [inner(facets(4), &problem).0, outer(facets(4), &problem).0] {
        assert_eq!(outcome.status.name(), "infeasible", "{}", outcome.status);
    }
}

#[test]
fn global_problems_are_condensed_first() {
    let case = planted(4, MIXED);
    let (problem, known) = case.global::<2>();
    let faceted = Via { reformulation: FacetInner::<2>::default(), solver: PlainLemke };
    let mut session = Driver::new(Via { reformulation: Condense, solver: faceted });
    let (outcome, point) = run(&mut session, &problem);
    assert_eq!(outcome.status, Status::Solved);
    assert!(farthest(&point.v, &known.v) < 1e-9);
}

#[test]
fn impossible_facets_are_refused() {
    let (problem, _) = planted(1, MIXED).local::<3>();
    for bad in [facets(2), Facets { facet_angle: f64::NAN, ..facets(4) }] {
        let mut session = driver(FacetInner::<3>(bad));
        let mut point = problem.origin();
        let e = session.solve(&problem, &mut point, &limits(), &mut |_| {}).unwrap_err();
        assert!(matches!(e, SolveError::Needs { .. }), "{e}");
    }
}

#[test]
fn the_account_tells_of_the_reduced_problem() {
    let (problem, _) = planted(1, SLIDING).local::<3>();
    let mut session = driver(FacetInner::<3>(facets(4)));
    run(&mut session, &problem);
    let account = session.account().join(" ");
    assert!(account.contains("36 unknowns") && account.contains("relative residual"), "{account}");
}

/// Through the registry: names, settings, and another Lemke than this file's.
#[test]
fn the_registry_composes() {
    use nonsmooth_problem::FrictionGlobal;
    use registry::Solves;
    let names = registry::solver_names::<FrictionLocal<3>>();
    let global = registry::solver_names::<FrictionGlobal<2>>();
    for edge in ["facet_inner", "facet_outer"] {
        let name = format!("{edge}/lemke");
        assert!(names.contains(&name), "{names:?}");
        assert!(global.contains(&format!("condense/{name}")), "{global:?}");
        assert_eq!(registry::solves::<FrictionLocal<3>>(&name), Some(Solves::Relaxation));
        assert_eq!(registry::solves::<FrictionLocal<2>>(&name), Some(Solves::Law));
        assert_eq!(registry::about::<FrictionLocal<3>>(&name).unwrap().family, "pivoting");

        let (problem, known) = planted(5, MIXED).global::<2>();
        let mut session = registry::session::<FrictionGlobal<2>>(
            &format!("condense/{name}"),
            &Default::default(),
        )
        .unwrap();
        let (outcome, point) = run(&mut *session, &problem);
        assert_eq!(outcome.status, Status::Solved, "{name}");
        assert!(farthest(&point.v, &known.v) < 1e-9);

        let settings =
            nonsmooth_solve::settings::from_texts(&["facets=12", "facet_angle=.2"]).unwrap();
        let (problem, _) = planted(5, MIXED).local::<3>();
        let mut session = registry::session::<FrictionLocal<3>>(&name, &settings).unwrap();
        let (outcome, point) = run(&mut *session, &problem);
        let chosen = Facets { facets: 12, facet_angle: 0.2 };
        let (plain, same) =
            if edge == "facet_inner" { inner(chosen, &problem) } else { outer(chosen, &problem) };
        assert_eq!(outcome.status, plain.status, "{name}");
        assert!(farthest(&point.r, &same.r) < 1e-9, "{name}");

        let refused = |text: &str| {
            let settings = nonsmooth_solve::settings::from_texts(&[text]).unwrap();
            registry::session::<FrictionLocal<3>>(&name, &settings).err().unwrap().to_string()
        };
        assert!(refused("facets=2").contains("from 3 to"));
        assert!(refused("facet_width=2").contains("there are: facets, facet_angle"));
        assert!(refused("omga=2").contains("unknown key `omga`"));
    }
    assert!(
        registry::session::<FrictionLocal<3>>("facet_inner/magic", &Default::default()).is_err()
    );
}

/// More contacts than degrees of freedom: W and its tangential part are singular, the motion is unique all the same.
#[test]
fn hyperstatic_contacts_in_the_plane() {
    for seed in SEEDS {
        let case = Planted { contacts: 12, dofs: 12, ..planted(seed, MIXED) };
        let (problem, _) = case.local::<2>();
        for name in ["facet_inner/lemke", "facet_outer/lemke"] {
            let mut session =
                registry::session::<FrictionLocal<2>>(name, &Default::default()).unwrap();
            let (outcome, point) = run(&mut *session, &problem);
            assert_eq!(outcome.status, Status::Solved, "{name} {seed}");
            assert!(problem.judge(&point, 1e-10).unwrap().solved);
        }
    }
}

/// The answer is the faceted problem's, even where the start obeys Coulomb's law better.
#[test]
fn a_better_start_does_not_replace_the_answer() {
    for seed in SEEDS {
        let (problem, known) = planted(seed, SLIDING).local::<3>();
        let start = LocalPoint { r: known.r.iter().map(|r| r * (1.0 + 1e-6)).collect(), ..known };
        for name in ["facet_inner/lemke", "facet_outer/lemke"] {
            let settings = nonsmooth_solve::settings::from_texts(&["facets=4"]).unwrap();
            let mut session = registry::session::<FrictionLocal<3>>(name, &settings).unwrap();
            let (_, cold) = run(&mut *session, &problem);
            let mut warm = start.clone();
            let outcome = session.solve(&problem, &mut warm, &limits(), &mut |_| {}).unwrap();
            assert!(outcome.measure.relative > 1e-4, "{name} {seed}");
            assert!(farthest(&warm.r, &cold.r) < 1e-9, "{name} {seed}");
        }
    }
}

/// A matrix that takes more memory than is allowed is refused by name before it is made.
#[test]
fn matrices_beyond_the_memory_are_refused() {
    let (problem, _) = Planted { contacts: 20, dofs: 90, ..Planted::default() }.local::<3>();
    let limits = Limits { memory_limit: Some(10_000), ..limits() };
    let refused = |session: &mut dyn Session<_>| {
        session.solve(&problem, &mut problem.origin(), &limits, &mut |_| {}).unwrap_err()
    };
    for error in [
        refused(&mut driver(FacetInner::<3>(facets(8)))),
        refused(&mut driver(FacetOuter::<3>(facets(8)))),
    ] {
        let says = error.to_string();
        assert!(says.contains("the matrix with facets would take about"), "{says}");
        assert!(says.contains("the memory limit is"), "{says}");
    }
}

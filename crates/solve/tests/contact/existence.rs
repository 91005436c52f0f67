//! Existence: planted problems, squeezed bodies, wedges that can jam, clamps at rest; in both forms, dimensions and any units.

use nonsmooth_linalg::{Bsr, Csc, Delassus, Inverse};
use nonsmooth_problem::check::{Certificate, Existence, Judged, Kinematic};
use nonsmooth_problem::planted::Planted;
use nonsmooth_problem::{
    FrictionGlobal, FrictionLocal, GlobalPoint, LocalPoint, Problem, RowsGlobal,
};
use nonsmooth_solve::contact::form::{Blockwise, Frictional};
use nonsmooth_solve::existence::{decide, glance_at};
use nonsmooth_solve::registry::{self, Registered};
use nonsmooth_solve::{Limits, Status};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// The verdict, its certificate verified once more.
fn verdict<P: Blockwise<D> + Frictional<D> + Kinematic<D>, const D: usize>(
    problem: &P,
) -> Existence {
    let existence = decide(problem, &Limits::default());
    let k = problem.kinematics();
    match &existence {
        Existence::Proved { motion, margin } => assert_eq!(k.exact_margin(motion), Some(*margin)),
        Existence::NearlyProved { motion, margin, .. } => {
            assert!(k.margin(motion).is_some() && *margin >= 0.0);
        }
        Existence::Solved { coefficients, .. } => {
            assert!(problem.cones().unwrap().solved_by(&coefficients.0));
        }
        Existence::Weak { ray } => assert!(k.refutes_interior(ray) && !k.refutes_criterion(ray)),
        Existence::CriterionRefuted { ray } => assert!(k.refutes_criterion(ray)),
        Existence::NoSolution { proof } => assert!(problem.verify(proof.certificate())),
        Existence::NearlyNoSolution { certificate, .. } => {
            assert!(problem.evidence(certificate).holds());
        }
        Existence::EveryQ { .. } | Existence::NearlySolved { .. } => {
            panic!("said of complementarity problems only")
        }
        Existence::Unknown { .. } => {}
    }
    existence
}

fn name<P: Blockwise<D> + Frictional<D> + Kinematic<D>, const D: usize>(
    problem: &P,
) -> &'static str {
    verdict(problem).name()
}

/// The same problem without its bodies.
fn condensed<const D: usize>(p: &FrictionGlobal<D>) -> FrictionLocal<D> {
    let inverse = Inverse::new(&p.M, "M").unwrap();
    let w = Delassus::<D>::condense(&p.H, &inverse);
    let mut v = p.f.clone();
    inverse.solve(&mut v);
    let mut q = vec![0.0; p.w.len()];
    p.velocity_into(&v, &mut q);
    FrictionLocal::new(w, q, p.mu.clone()).unwrap()
}

/// One body without rotation, a contact for each set of axes `[N, T, ...]`.
fn point_mass<const D: usize>(axes: &[[[f64; D]; D]], w: Vec<f64>, mu: f64) -> FrictionGlobal<D> {
    let mut h = vec![];
    for (c, axes) in axes.iter().enumerate() {
        for (k, axis) in axes.iter().enumerate() {
            h.extend(axis.iter().enumerate().map(|(i, &x)| (i, D * c + k, x)));
        }
    }
    let h = Csc::from_triplets(D, D * axes.len(), h.into_iter()).unwrap();
    let m = Csc::diagonal(&[2.0; D]);
    FrictionGlobal::new(m, h, vec![0.0; D], w, vec![mu; axes.len()]).unwrap()
}

const X: [f64; 3] = [1.0, 0.0, 0.0];
const Y: [f64; 3] = [0.0, 1.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];
const DOWN: [f64; 3] = [0.0, 0.0, -1.0];

/// Velocities in units of `velocity`, impulses in units of `impulse`.
fn in_units<const D: usize>(
    p: &FrictionGlobal<D>,
    velocity: f64,
    impulse: f64,
) -> FrictionGlobal<D> {
    let mut scaled = p.clone();
    let m = p.M.triplets().map(|(i, j, x)| (i, j, x * impulse / velocity));
    scaled.M = Csc::from_triplets(p.dofs(), p.dofs(), m).unwrap();
    scaled.f.iter_mut().for_each(|f| *f *= impulse);
    scaled.w.iter_mut().for_each(|w| *w *= velocity);
    if let Some(b) = &mut scaled.rows {
        b.b.iter_mut().for_each(|b| *b *= velocity);
    }
    scaled
}

#[test]
fn planted_problems_of_full_rank_have_a_solution() {
    for (seed, bilateral, skew) in [(0, 0, 0.0), (1, 4, 0.0), (2, 0, 0.2), (3, 2, 0.1)] {
        let case = Planted { contacts: 15, dofs: 120, bilateral, skew, seed, ..Planted::default() };
        for velocity in [1e-6, 1.0, 1e6] {
            assert_eq!(name(&in_units(&case.global::<3>().0, velocity, 1e3)), "proved", "{case:?}");
        }
        assert_eq!(name(&case.global::<2>().0), "proved", "{case:?}");
        assert_eq!(name(&case.local::<3>().0), "proved", "{case:?}");
        assert_eq!(name(&case.local::<2>().0), "proved", "{case:?}");
        assert_eq!(glance_at(&case.global::<3>().0).name(), "proved");
    }
}

/// Rank-deficient ones may be anything but without a solution: they have one.
#[test]
fn no_planted_problem_is_refuted() {
    let mut seen = vec![];
    for seed in 0..12 {
        let contacts = 10 + 3 * seed as usize;
        let case = Planted { contacts, dofs: 24, mu: (0.3, 1.2), seed, ..Planted::default() };
        for found in
            [name(&case.global::<3>().0), name(&case.local::<3>().0), name(&case.global::<2>().0)]
        {
            assert!(!found.ends_with("no_solution"), "{case:?} {seen:?}");
            seen.push(found);
        }
    }
    assert!(
        seen.iter().any(|s| s.ends_with("proved")) || seen.contains(&"criterion_refuted"),
        "{seen:?}"
    );
    assert!(seen.iter().filter(|s| **s == "unknown").count() <= 2, "{seen:?}");
}

#[test]
fn a_squeezed_body_has_no_solution_whatever_the_friction() {
    let w = vec![-1.0, 0.0, 0.0, -0.5, 0.2, 0.0, 0.3, 0.0, 0.0];
    for mu in [0.0, 0.4, 2.0] {
        let p = point_mass(&[[Z, X, Y], [DOWN, X, Y], [X, Y, Z]], w.clone(), mu);
        for (velocity, impulse) in [(1.0, 1.0), (1e6, 1e-6), (1e-6, 1.0)] {
            let p = in_units(&p, velocity, impulse);
            assert_eq!(name(&p), "no_solution", "mu = {mu}, {velocity:e}");
            assert_eq!(name(&condensed(&p)), "no_solution", "mu = {mu}, {velocity:e}");
        }
        let Existence::NoSolution { proof } = verdict(&p) else { unreachable!() };
        if let Some(impulses) = proof.certificate().impulses() {
            assert_eq!(impulses.pressed(3), [0, 1]);
        }
    }
    let plane = |mu| {
        point_mass(
            &[[[0.0, 1.0], [1.0, 0.0]], [[0.0, -1.0], [1.0, 0.0]]],
            vec![-1.0, 0.0, 0.9, 0.0],
            mu,
        )
    };
    assert_eq!((name(&plane(0.0)), name(&plane(0.7))), ("no_solution", "no_solution"));
}

/// A body that slides up between two steep walls: a solution by construction, yet impulses across the wedge balance
/// inside the friction cones and have negative power.
fn wedge(mu: f64) -> (FrictionGlobal<3>, GlobalPoint) {
    let (s, c) = 0.2_f64.sin_cos();
    let walls = [[[c, 0.0, s], [-s, 0.0, c], Y], [[-c, 0.0, s], [s, 0.0, c], Y]];
    // u is w at v = 0: sliding up. r against it, on the boundary of K.
    let w = vec![0.0, 1.0, 0.1, 0.0, 0.8, -0.1];
    let mut p = point_mass(&walls, w.clone(), mu);
    let mut r = vec![0.0; 6];
    for c in 0..2 {
        let t = w[3 * c + 1].hypot(w[3 * c + 2]);
        (0..3).for_each(|k| r[3 * c + k] = if k == 0 { 1.0 } else { -mu * w[3 * c + k] / t });
    }
    let mut load = vec![0.0; 3];
    p.H.mul_add(-1.0, &r, &mut load);
    p.f = load;
    (p, GlobalPoint { v: vec![0.0; 3], r, lambda: vec![] })
}

#[test]
fn in_a_wedge_the_criterion_is_refuted_and_yet_there_is_a_solution() {
    let (p, solution) = wedge(0.5);
    assert!(p.judge(&solution, 1e-12).unwrap().solved);
    for velocity in [1.0, 1e6, 1e-6] {
        assert_eq!(name(&in_units(&p, velocity, 1.0)), "criterion_refuted", "{velocity:e}");
    }
    let local = condensed(&p);
    let point = LocalPoint { r: solution.r, lambda: vec![] };
    assert!(local.judge(&point, 1e-12).unwrap().solved);
    let Existence::CriterionRefuted { ray } = verdict(&local) else {
        panic!("{:?}", verdict(&local))
    };
    assert!(ray.r[1].abs() > 0.1 && !local.verify(&ray.clone().into()), "{ray:?}");
    // With less friction than the walls are steep nothing jams.
    assert_eq!(name(&wedge(0.15).0), "proved");
}

fn solves<P: Registered + Judged>(problem: &P) -> bool {
    let mut session = registry::session::<P>("nsgs", &Default::default()).unwrap();
    let mut point = problem.origin();
    let limits = Limits { max_iterations: 100_000, ..Limits::default() };
    let outcome = session.solve(problem, &mut point, &limits, &mut |_| {}).unwrap();
    outcome.status == Status::Solved
}

#[test]
fn gauss_seidel_finds_the_solution_that_the_criterion_does_not_promise() {
    assert!(solves(&wedge(0.5).0) || solves(&condensed(&wedge(0.5).0)));
}

#[test]
fn a_clamp_at_rest_meets_the_criterion_weakly() {
    let clamp = |mu| point_mass(&[[Z, X, Y], [DOWN, X, Y]], vec![0.0; 6], mu);
    assert_eq!(name(&clamp(0.5)), "weak");
    // Half spaces are polyhedra: their boundary is enough. So are the cones of the plane.
    assert_eq!(name(&clamp(0.0)), "proved");
    let plane =
        point_mass(&[[[0.0, 1.0], [1.0, 0.0]], [[0.0, -1.0], [1.0, 0.0]]], vec![0.0; 4], 0.5);
    assert_eq!(name(&plane), "proved");
}

#[test]
fn bilateral_constraints_hold_a_body_in_place() {
    let mut p = point_mass(&[[Z, X, Y]], vec![-1.0, 0.0, 0.0], 0.3);
    assert_eq!(name(&p), "proved");
    let g = Csc::from_triplets(3, 1, [(2, 0, 1.0)].into_iter()).unwrap();
    p.rows = Some(RowsGlobal::bilateral(g, vec![0.0]));
    assert_eq!(name(&p), "no_solution");
    p.rows.as_mut().unwrap().b[0] = -2.0;
    assert_eq!(name(&p), "proved");
    // Two constraints that contradict each other.
    let g = Csc::from_triplets(3, 2, [(2, 0, 1.0), (2, 1, 1.0)].into_iter()).unwrap();
    p.rows = Some(RowsGlobal::bilateral(g, vec![-2.0, -3.0]));
    assert_eq!(name(&p), "no_solution");
}

#[test]
fn the_theorem_is_not_used_where_it_does_not_apply() {
    let w = Bsr::from_csc(&Csc::diagonal(&[1.0, -1.0, 1.0]));
    let p = FrictionLocal::<3>::new(w, vec![-1.0, 0.0, 0.0], vec![0.5]).unwrap();
    let Existence::Unknown { why } = verdict(&p) else { panic!() };
    assert!(why.contains("not positive definite"), "{why}");
    // Kernels: the skew part moves what has no energy, and u_N = -1 whatever the impulses.
    let skew = [(0, 1, -2.0), (1, 0, 2.0), (1, 1, 1.0)];
    let w = Bsr::from_csc(&Csc::from_triplets(2, 2, skew.into_iter()).unwrap());
    let p = FrictionLocal::<2>::new(w, vec![-1.0, 0.0], vec![0.0]).unwrap();
    assert_eq!(name(&p), "no_solution");
    // One small entry that a mean diagonal would hide.
    let hidden = [1e7, 1e7, 1e7, -1.0, 1.0, 1.0];
    let w = Bsr::from_csc(&Csc::diagonal(&hidden));
    let q = vec![1.0, 0.0, 0.0, -1.0, 0.0, 0.0];
    let p = FrictionLocal::<3>::new(w, q, vec![0.5; 2]).unwrap();
    assert_eq!(name(&p), "no_solution");
}

#[test]
fn a_limit_ends_the_investigation() {
    let (p, _) = wedge(0.5);
    let limits = Limits { time_limit: Some(0.0), ..Limits::default() };
    assert_eq!(decide(&p, &limits), Existence::Unknown { why: "the time limit came first".into() });
    let cancel = Some(std::sync::Arc::new(std::sync::atomic::AtomicBool::new(true)));
    let limits = Limits { cancel, ..Limits::default() };
    assert_eq!(decide(&p, &limits), Existence::Unknown { why: "it was cancelled".into() });
}

/// A body in the plane between contacts that close on it, and the same in space: the other direction of friction of each contact moves a mass of its own that nothing else moves, so that it
/// stays at rest in every solution, and both problems have the same ones.
fn grip(seed: u64, contacts: usize, mu: f64) -> (FrictionGlobal<2>, FrictionGlobal<3>) {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let (mut plane, mut space) = (vec![], vec![]);
    let mut w = (vec![], vec![]);
    for c in 0..contacts {
        let angle: f64 = random.random_range(0.0..std::f64::consts::TAU);
        let [n, t] = [[angle.cos(), angle.sin()], [-angle.sin(), angle.cos()]];
        let place =
            [-n[0] + random.random_range(-0.3..0.3), -n[1] + random.random_range(-0.3..0.3)];
        for (k, d) in [n, t].into_iter().enumerate() {
            for (i, x) in [d[0], d[1], place[0] * d[1] - place[1] * d[0]].into_iter().enumerate() {
                plane.push((i, 2 * c + k, x));
                space.push((i, 3 * c + k, x));
            }
        }
        space.push((3 + c, 3 * c + 2, 1.0));
        let closing = [-random.random_range(0.1..1.0), random.random_range(-0.5..0.5)];
        w.0.extend(closing);
        w.1.extend([closing[0], closing[1], 0.0]);
    }
    let m = [&[2.0, 2.0, 0.5][..], &vec![1.0; contacts]].concat();
    let h = Csc::from_triplets(3, 2 * contacts, plane.into_iter()).unwrap();
    let mus = vec![mu; contacts];
    let in_plane =
        FrictionGlobal::new(Csc::diagonal(&m[..3]), h, vec![0.0; 3], w.0, mus.clone()).unwrap();
    let h = Csc::from_triplets(m.len(), 3 * contacts, space.into_iter()).unwrap();
    let in_space = FrictionGlobal::new(Csc::diagonal(&m), h, vec![0.0; m.len()], w.1, mus).unwrap();
    (in_plane, in_space)
}

/// The enumeration in the plane is exact and complete, and knows nothing of sectors.
#[test]
fn what_has_no_solution_in_the_plane_is_refuted_in_space() {
    let (mut exactly, mut nearly, mut open, mut several, mut solvable) = (0, 0, 0, 0, 0);
    for seed in 0..60 {
        let (plane, space) = grip(seed, 2 + seed as usize % 3, 0.3 + 0.02 * seed as f64);
        let local = condensed(&space);
        let found = [name(&space), name(&local)];
        match verdict(&plane) {
            Existence::NoSolution { .. } => {
                for found in found {
                    match found {
                        "no_solution" => exactly += 1,
                        "nearly_no_solution" => nearly += 1,
                        // What misses by less than sectors of two degrees tell.
                        "criterion_refuted" => open += 1,
                        other => panic!("{seed}: {other}"),
                    }
                }
                several += usize::from(needs_all(&local));
            }
            solution => {
                assert!(solution.is_proved(), "{seed}: {solution}");
                assert!(found.iter().all(|f| !f.ends_with("no_solution")), "{seed}: {found:?}");
                solvable += 1;
            }
        }
    }
    println!(
        "{exactly} exactly, {nearly} nearly, {open} open; {several} by several, {solvable} solvable"
    );
    // Of W, as it is stored, rounding has left no kernel.
    assert!(exactly + nearly >= 30 && several >= 10 && solvable >= 10);
}

/// Whether a refutation has several vectors, of which some cannot be done without.
fn needs_all(problem: &FrictionLocal<3>) -> bool {
    let found = decide(problem, &Limits::default());
    let certificate = match &found {
        Existence::NoSolution { proof } => proof.certificate(),
        Existence::NearlyNoSolution { certificate, .. } => certificate,
        _ => return false,
    };
    let Certificate::Separating { vectors } = certificate else { return false };
    let without = |k: usize| {
        let mut vectors = vectors.clone();
        vectors.remove(k);
        Certificate::Separating { vectors }
    };
    (0..vectors.len().min(10)).any(|k| !problem.evidence(&without(k)).holds())
}

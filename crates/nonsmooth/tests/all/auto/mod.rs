//! Hard shapes for `auto`, which must need no setting: what has a solution is solved to 1e-12, what has none is refuted with a
//! verified certificate, and every solve ends.

mod families;

use crate::common::{run, within};
use nonsmooth_linalg::{Bsr, Csc, norm};
use nonsmooth_problem::check::{Existence, Judged};
use nonsmooth_problem::planted::{Planted, PlantedMix};
use nonsmooth_problem::{FrictionGlobal, FrictionLocal, GlobalPoint, Problem, RowsGlobal};
use nonsmooth_scenes::Scene;
use nonsmooth_scenes::scenes::{
    Arch, Chain, Family, Kapla, SlidingBox, SpherePile, Spheres, Stack, State, Wall,
};
use nonsmooth_solve::contact::Condense;
use nonsmooth_solve::registry::{self, Registered};
use nonsmooth_solve::{Limit, Limits, Outcome, Reformulation, Status, existence};

const TIGHT: f64 = 1e-12;
/// Far more than any of these needs.
const SECONDS: f64 = 10.0;

/// Solves, or names what is not solved.
fn solved<P: Registered + Judged>(problem: &P, solver: &str, what: &str) -> Vec<String> {
    solved_to(TIGHT, problem, solver, what)
}

fn solved_to<P: Registered + Judged>(
    tolerance: f64,
    problem: &P,
    solver: &str,
    what: &str,
) -> Vec<String> {
    let Outcome { status, measure, iterations, .. } =
        run(problem, solver, &[], &within(tolerance, SECONDS)).outcome;
    match status {
        Status::Solved => vec![],
        other => {
            let relative = measure.relative;
            let failed =
                format!("{what}, {solver}: {other} at {relative:.1e} after {iterations} steps");
            eprintln!("{failed}");
            vec![failed]
        }
    }
}

/// The global problem as it stands and condensed on the way, and the local one.
fn all_forms<const D: usize>(problem: &FrictionGlobal<D>, what: &str) -> Vec<String>
where
    FrictionGlobal<D>: Registered + Judged,
    FrictionLocal<D>: Registered + Judged,
{
    all_forms_to(TIGHT, problem, what)
}

fn all_forms_to<const D: usize>(
    tolerance: f64,
    problem: &FrictionGlobal<D>,
    what: &str,
) -> Vec<String>
where
    FrictionGlobal<D>: Registered + Judged,
    FrictionLocal<D>: Registered + Judged,
{
    let mut failed = solved_to(tolerance, problem, "auto", &format!("{what}, global"));
    failed.extend(solved_to(tolerance, problem, "condense/auto", &format!("{what}, global")));
    if problem.rows.is_none() {
        let (local, _) = Condense.reduce(problem).unwrap();
        failed.extend(solved_to(tolerance, &local, "auto", &format!("{what}, local")));
    }
    failed
}

fn planted(case: &Planted, what: &str) -> Vec<String> {
    planted_to(TIGHT, case, what)
}

fn planted_to(tolerance: f64, case: &Planted, what: &str) -> Vec<String> {
    let what = format!("{what}, seed {}", case.seed);
    let plane = format!("{what}, plane");
    let mut failed = all_forms_to(tolerance, &case.global::<3>().0, &what);
    failed.extend(all_forms_to(tolerance, &case.global::<2>().0, &plane));
    let (local, flat) = (case.local::<3>().0, case.local::<2>().0);
    failed.extend(solved_to(tolerance, &local, "auto", &format!("{what}, planted local")));
    failed.extend(solved_to(tolerance, &flat, "auto", &format!("{plane}, planted local")));
    failed
}

fn scene(family: &impl Family, what: &str) -> Vec<String> {
    all_forms(&family.build().unwrap().problem().unwrap(), what)
}

fn none(failed: Vec<String>) {
    assert!(failed.is_empty(), "{} failed:\n{}", failed.len(), failed.join("\n"));
}

const MIXED: PlantedMix = PlantedMix { open: 1.0, stick: 1.0, slip: 1.0, degenerate: 0.3 };

#[test]
fn friction_from_none_to_two() {
    let mut failed = vec![];
    // Of 120 (space) and 80 (plane) rows, W has the rank `dofs` at most. Of contacts at random, which no packing of bodies has, with a
    // friction of 2 and a W of low rank, some are beyond `auto`: the criterion of existence is refuted there.
    let any = [150, 60, 24].as_slice();
    for (seed, (mu, dofs, tolerance)) in [
        ((0.0, 0.0), any, TIGHT),
        ((0.0, 2.0), &any[..2], TIGHT),
        ((1e-6, 1e-3), any, 1e-11),
        ((0.1, 0.3), any, TIGHT),
        ((1.0, 1.0), any, TIGHT),
        ((2.0, 2.0), &any[..1], TIGHT),
    ]
    .into_iter()
    .enumerate()
    {
        for &dofs in dofs {
            let seed = seed as u64;
            let case = Planted { contacts: 40, dofs, mix: MIXED, mu, seed, ..Planted::default() };
            failed.extend(planted_to(tolerance, &case, &format!("mu {mu:?}, {dofs} dofs")));
        }
    }
    for mu in [0.0, 0.01, 0.3, 1.0, 2.0] {
        for state in [State::Rest, State::Perturbed, State::Impact] {
            let wall = Wall { mu, state, head_joints: true, ..Wall::default() };
            failed.extend(scene(&wall, &format!("wall, mu {mu}, {state:?}")));
        }
    }
    none(failed);
}

/// Impulses a million times those that the lightest body needs, rounded, leave velocities of 1e6 ε and more: 1e-12 is out of reach.
#[test]
fn masses_that_differ_by_a_million() {
    let mut failed = vec![];
    let rounded = |family: &dyn Fn() -> Scene, what: &str| {
        all_forms_to(1e-9, &family().problem().unwrap(), what)
    };
    for seed in 0..2 {
        for state in [State::Rest, State::Perturbed, State::Impact] {
            let mass_ratio = 1e6;
            let what = |name: &str| format!("{name}, seed {seed}, {state:?}");
            let tower = Stack { count: 10, mass_ratio, state, seed, ..Stack::default() };
            failed.extend(rounded(&|| tower.build().unwrap(), &what("stack")));
            let chain = Chain { links: 8, mass_ratio, state, seed, ..Chain::default() };
            failed.extend(rounded(&|| chain.build().unwrap(), &what("chain")));
            let wall = Wall { rows: 4, columns: 3, mass_ratio, state, seed, ..Wall::default() };
            failed.extend(rounded(&|| wall.build().unwrap(), &what("wall")));
        }
    }
    none(failed);
}

#[test]
fn hyperstatic_up_to_seven() {
    let mut failed = vec![];
    let density = |scene: &Scene| 3.0 * scene.contacts.len() as f64 / scene.dofs() as f64;
    for state in [State::Rest, State::Perturbed, State::Impact] {
        let kapla = Kapla { layers: 9, planks: 4, state, ..Kapla::default() };
        assert!(density(&kapla.build().unwrap()) >= 7.0);
        failed.extend(scene(&kapla, &format!("kapla, {state:?}")));
        let arch = Arch { state, ..Arch::default() };
        failed.extend(scene(&arch, &format!("arch, {state:?}")));
    }
    for seed in 0..3 {
        // 42 contacts in 18 dimensions.
        let case =
            Planted { contacts: 42, dofs: 18, mix: MIXED, mu: (0.1, 1.0), seed, ..<_>::default() };
        failed.extend(planted(&case, "planted"));
    }
    none(failed);
}

/// Newton's iterations and the interior point come to rest above 1e-4.
#[test]
fn a_shaken_wall_is_solved_along_its_central_path() {
    let wall = Wall { rows: 24, columns: 24, state: State::Perturbed, ..Wall::default() };
    let problem = wall.build().unwrap().problem().unwrap();
    let end = run(&problem, "auto", &[], &within(1e-8, 60.0));
    assert_eq!(end.outcome.status, Status::Solved, "{}", end.outcome.measure.relative);
    assert!(end.outcome.factorisations < 1000, "{}", end.outcome.factorisations);
    let along = end.account.iter().any(|line| line.contains("along the central path"));
    assert!(along, "{:?}", end.account);
}

/// Contacts between sticking and sliding, to which whole Newton steps give their sides at once: with a line search this took 826 and 500 iterations.
#[test]
fn shaken_walls_are_solved_by_whole_steps() {
    for (rows, columns, seed) in [(24, 24, 1), (20, 8, 24)] {
        let wall = Wall { rows, columns, state: State::Perturbed, seed, ..Wall::default() };
        let problem = wall.build().unwrap().problem().unwrap();
        let Outcome { status, measure, factorisations, .. } =
            run(&problem, "auto", &[], &within(1e-8, 60.0)).outcome;
        assert_eq!(status, Status::Solved, "{rows} {columns}: {}", measure.relative);
        assert!(factorisations < 300, "{rows} {columns}: {factorisations}");
    }
}

/// After the sweeps the weight of the upper rows has yet to come down to the lower ones, and contacts open.
#[test]
fn a_wall_with_head_joints_rests() {
    for mu in [0.3, 0.8] {
        let wall = Wall { rows: 24, columns: 24, head_joints: true, mu, ..Wall::default() };
        let problem = wall.build().unwrap().problem().unwrap();
        for solver in ["auto", "convex_relaxation"] {
            let end = run(&problem, solver, &[], &within(1e-10, 60.0));
            let Outcome { status, factorisations, .. } = end.outcome;
            assert_eq!(status, Status::Solved, "{solver}, {mu}");
            assert!(factorisations <= 3, "{solver}, {mu}: {factorisations}, {:?}", end.account);
        }
    }
}

/// `auto` solves the pyramid of spheres with this base, and says that it did so by `means`, and Newton's iterations not begun.
fn solves_pyramid(base: usize, mu: f64, means: &str) {
    let pyramid = Spheres { base, mu, ..Spheres::default() };
    let problem = pyramid.build().unwrap().problem().unwrap();
    let end = run(&problem, "auto", &[], &within(1e-8, 120.0));
    assert_eq!(end.outcome.status, Status::Solved, "{}", end.outcome.measure.relative);
    let by = end.account.iter().any(|line| line.contains(means));
    let newton = end.account.iter().any(|line| line.contains("proximal"));
    assert!(by && !newton, "{:?}", end.account);
}

/// Nothing slides at their solutions, but the exact law's path turns back.
#[test]
fn pyramids_of_rough_spheres_are_solved_by_the_convex_relaxation() {
    for base in 5..=8 {
        solves_pyramid(base, 0.8, "convex relaxation");
    }
}

/// Little slides: the relaxation says so, and Newton's iterations took seconds or did not end.
#[test]
fn pyramids_in_which_little_slides_are_solved_by_alternating_directions() {
    for base in [5, 6] {
        solves_pyramid(base, 0.6, "alternating directions");
    }
}

/// Exact sweeps circle at 2e-3, and all that comes before stays there too.
#[test]
fn a_pyramid_of_spheres_is_solved_by_projected_sweeps() {
    solves_pyramid(8, 0.6, "one projection a contact");
}

/// No method came nearer than 4e-4 in 20 s before: more than half of the spheres rest, which the sweeps and the interior point on the whole do not find out.
#[test]
fn a_larger_pyramid_of_spheres_is_solved_by_motion_and_impulses_in_turn() {
    solves_pyramid(10, 0.6, "in turn");
}

/// The same planted solution with `W + K`: entries of `W` moved by `size`, relatively; antisymmetrically where `skew`.
fn nonsymmetric(case: &Planted, size: f64, skew: bool) -> FrictionLocal<3> {
    let (mut problem, point) = case.local::<3>();
    let w = problem.W.to_csc();
    let noise =
        |i: usize, j: usize| ((12.9898 * i as f64 + 78.233 * j as f64).sin() * 43758.5).fract();
    let moved = w.triplets().map(|(i, j, x)| {
        let n = if skew {
            noise(i.min(j), i.max(j)) * (i as f64 - j as f64).signum()
        } else {
            noise(i, j)
        };
        let mean = (w.get(i, i) * w.get(j, j)).sqrt();
        (i, j, x + if i == j { 0.0 } else { size * n * mean })
    });
    let moved = Bsr::from_csc(&Csc::from_triplets(w.nrows(), w.ncols(), moved).unwrap());
    for c in 0..moved.nrows() {
        let (new, old) = (moved.row_product(c, &point.r), problem.W.row_product(c, &point.r));
        (0..3).for_each(|k| problem.q[3 * c + k] += old[k] - new[k]);
    }
    problem.W = moved;
    assert!(problem.judge(&point, TIGHT).unwrap().solved);
    problem
}

#[test]
fn nonsymmetric_dynamics() {
    let mut failed = vec![];
    for seed in 0..4 {
        for dofs in [150, 60] {
            let case = Planted { contacts: 30, dofs, mix: MIXED, seed, ..Planted::default() };
            for size in [1e-6, 1e-4, 1e-2] {
                let what = format!("seed {seed}, {dofs} dofs, {size:e}");
                let skew = nonsymmetric(&case, size, true);
                assert!(skew.W.asymmetry() > 0.05 * size, "{}", skew.W.asymmetry());
                failed.extend(solved(&skew, "auto", &format!("{what}, skew")));
                // Of full rank, so that W stays positive definite.
                if dofs == 150 && size < 1e-2 {
                    let any = nonsymmetric(&case, size, false);
                    failed.extend(solved(&any, "auto", &format!("{what}, any")));
                }
            }
            let case = Planted { skew: 0.01, ..case };
            failed.extend(planted(&case, "skew mass"));
        }
    }
    none(failed);
}

/// A planted problem with every contact twice, the copy's columns of H moved by `tilt`: the same velocities, half of
/// the impulses each.
fn doubled(case: &Planted, tilt: f64) -> (FrictionGlobal<3>, GlobalPoint) {
    let (p, point) = case.global::<3>();
    let m = p.w.len();
    let moved = |k: usize| 1.0 + tilt * (k as f64 * 1.7).sin();
    let copies = p.H.triplets().enumerate().map(|(k, (i, j, x))| (i, m + j, moved(k) * x));
    let h = p.H.triplets().chain(copies).collect::<Vec<_>>();
    let h = Csc::from_triplets(p.dofs(), 2 * m, h.into_iter()).unwrap();
    let half: Vec<f64> = point.r.iter().map(|r| 0.5 * r).collect();
    let r = [half.clone(), half].concat();
    let mut u = vec![0.0; m];
    p.velocity_into(&point.v, &mut u);
    let mut w = [u.clone(), u].concat();
    h.mul_transpose_add(-1.0, &point.v, &mut w);
    let mut f = vec![0.0; p.dofs()];
    p.M.mul_add(1.0, &point.v, &mut f);
    h.mul_add(-1.0, &r, &mut f);
    let mu = [p.mu.clone(), p.mu].concat();
    let doubled = FrictionGlobal::new(p.M, h, f, w, mu).unwrap();
    (doubled, GlobalPoint { v: point.v, r, lambda: vec![] })
}

#[test]
fn nearly_parallel_contacts() {
    let mut failed = vec![];
    for seed in 0..3 {
        for tilt in [0.0, 1e-14, 1e-12, 1e-9, 1e-6, 1e-3] {
            let case = Planted { contacts: 20, dofs: 90, mix: MIXED, seed, ..Planted::default() };
            let (problem, point) = doubled(&case, tilt);
            assert!(problem.judge(&point, TIGHT).unwrap().solved);
            failed.extend(all_forms(&problem, &format!("seed {seed}, tilt {tilt:e}")));
        }
    }
    none(failed);
}

#[test]
fn one_status_for_all() {
    let of = |open, stick, slip, degenerate| PlantedMix { open, stick, slip, degenerate };
    let mut failed = vec![];
    for (name, mix) in [
        ("open", of(1.0, 0.0, 0.0, 0.0)),
        ("stick", of(0.0, 1.0, 0.0, 0.0)),
        ("slip", of(0.0, 0.0, 1.0, 0.0)),
        ("degenerate", of(0.0, 0.0, 0.0, 1.0)),
    ] {
        for dofs in [120, 42] {
            let case = Planted { contacts: 30, dofs, mix, seed: 5, ..Planted::default() };
            failed.extend(planted(&case, &format!("all {name}, {dofs} dofs")));
        }
    }
    none(failed);
}

#[test]
fn nothing_moves() {
    let (local, _) = Planted::default().local::<3>();
    for size in [0.0, 1e-100, 1e-30] {
        let mut still = local.clone();
        still.q.iter_mut().enumerate().for_each(|(i, q)| *q = size * (i as f64).sin());
        none(solved(&still, "auto", &format!("q of size {size:e}")));
    }
    let (mut global, _) = Planted::default().global::<3>();
    global.f.fill(0.0);
    global.w.fill(0.0);
    none(all_forms(&global, "q = 0"));
    let end = run(&global, "auto", &[], &within(TIGHT, SECONDS));
    assert!(norm(&end.point.v) == 0.0 && norm(&end.point.r) == 0.0);
}

#[test]
fn bilateral_constraints() {
    let mut failed = vec![];
    for seed in 0..4 {
        for (contacts, dofs) in [(20, 120), (40, 60)] {
            let case = Planted {
                contacts,
                dofs,
                bilateral: 6,
                mix: MIXED,
                mu: (0.0, 1.0),
                seed,
                ..Planted::default()
            };
            failed.extend(planted(&case, &format!("{contacts} contacts")));
        }
    }
    none(failed);
}

/// A column of `n` point masses between two walls that approach each other: each touches the next along z, and the sides
/// of a chute lean on some.
fn squeezed(n: usize, mu: f64) -> FrictionGlobal<3> {
    let (mut h, mut w) = (vec![], vec![]);
    for c in 0..=n {
        for (axis, k) in [(2, 0), (0, 1), (1, 2)] {
            // The gap below mass c widens as c rises and c − 1 sinks.
            h.extend((c < n).then_some((3 * c + axis, 3 * c + k, 1.0)));
            h.extend((c > 0).then(|| (3 * (c - 1) + axis, 3 * c + k, -1.0)));
        }
        w.extend([if c == 0 || c == n { -0.5 } else { 0.0 }, 0.3 * (c as f64).sin(), 0.1]);
    }
    for side in 0..n / 2 {
        let c = n + 1 + side;
        h.extend([(0, 0), (1, 1), (2, 2)].map(|(axis, k)| (6 * side + axis, 3 * c + k, 1.0)));
        w.extend([0.2, 0.0, 0.1]);
    }
    let m: Vec<f64> = (0..3 * n).map(|i| 1.0 + (i / 3) as f64).collect();
    let f: Vec<f64> = (0..3 * n).map(|i| if i % 3 == 2 { -0.1 * m[i] } else { 0.0 }).collect();
    let contacts = w.len() / 3;
    let h = Csc::from_triplets(3 * n, w.len(), h.into_iter()).unwrap();
    FrictionGlobal::new(Csc::diagonal(&m), h, f, w, vec![mu; contacts]).unwrap()
}

fn refuted<P: Registered + Judged>(problem: &P, solver: &str, what: &str) {
    let end = run(problem, solver, &[], &within(1e-8, SECONDS));
    let status = end.outcome.status;
    // What the condensed problem says may hold of the bodies' own equations by less than rounding.
    let condensed = solver.starts_with("condense/") && status.certificate().is_some();
    assert!(status.refutes() || condensed, "{what}, {solver}: {status} {:?}", end.account);
    let holds = status.certificate().is_some_and(|c| problem.evidence(c).holds());
    assert!(solver.starts_with("condense/") || holds, "{what}, {solver}");
}

#[test]
fn a_problem_without_a_solution_is_refuted() {
    for n in [1, 2, 10] {
        for mu in [0.0, 0.4, 2.0] {
            let problem = squeezed(n, mu);
            let what = format!("{n} bodies, mu {mu}");
            refuted(&problem, "auto", &what);
            refuted(&problem, "condense/auto", &what);
            refuted(&Condense.reduce(&problem).unwrap().0, "auto", &what);
        }
    }
}

/// Problems as one, in which contacts and velocities of each stand between those of the others.
fn among_each_other(parts: &[FrictionGlobal<3>]) -> FrictionGlobal<3> {
    let places = |of: fn(&FrictionGlobal<3>) -> usize| {
        let numbers = parts.iter().enumerate().flat_map(|(k, p)| (0..of(p)).map(move |i| (i, k)));
        let mut all: Vec<_> = numbers.collect();
        all.sort_unstable();
        all
    };
    let (contacts, dofs) = (places(|p| p.mu.len()), places(|p| p.f.len()));
    let contact = |k: usize, c: usize| contacts.binary_search(&(c, k)).unwrap();
    let dof = |k: usize, i: usize| dofs.binary_search(&(i, k)).unwrap();
    let row = |k: usize, j: usize| 3 * contact(k, j / 3) + j % 3;
    let (mut m, mut h) = (vec![], vec![]);
    let (mut f, mut w) = (vec![0.0; dofs.len()], vec![0.0; 3 * contacts.len()]);
    let mut mu = vec![0.0; contacts.len()];
    for (k, p) in parts.iter().enumerate() {
        m.extend(p.M.triplets().map(|(i, j, x)| (dof(k, i), dof(k, j), x)));
        h.extend(p.H.triplets().map(|(i, j, x)| (dof(k, i), row(k, j), x)));
        p.f.iter().enumerate().for_each(|(i, x)| f[dof(k, i)] = *x);
        p.w.iter().enumerate().for_each(|(j, x)| w[row(k, j)] = *x);
        p.mu.iter().enumerate().for_each(|(c, x)| mu[contact(k, c)] = *x);
    }
    let m = Csc::from_triplets(dofs.len(), dofs.len(), m.into_iter()).unwrap();
    let h = Csc::from_triplets(dofs.len(), w.len(), h.into_iter()).unwrap();
    FrictionGlobal::new(m, h, f, w, mu).unwrap()
}

#[test]
fn islands_are_solved_apart() {
    let mut failed = vec![];
    for seed in 0..6 {
        // Of different sizes and loads, down to a ten-millionth of the largest; in the last nothing happens.
        let part = |(k, (contacts, loads)): (u64, (usize, f64))| {
            let dofs = 2 * contacts;
            let case =
                Planted { contacts, dofs, mix: MIXED, seed: 7 * seed + k, ..Planted::default() };
            let mut part = case.global::<3>().0;
            part.f.iter_mut().chain(&mut part.w).for_each(|x| *x *= loads);
            part
        };
        let sizes = [(14, 1.0), (9, 1e-3), (3, 30.0), (11, 1e-7), (2, 0.0)];
        let parts: Vec<_> = (0..).zip(sizes).map(part).collect();
        let whole = among_each_other(&parts);
        let what = format!("five islands, seed {seed}");
        for tolerance in [1e-4, 1e-8, TIGHT] {
            failed.extend(all_forms_to(tolerance, &whole, &what));
        }
        let (local, _) = Condense.reduce(&whole).unwrap();
        let end = run(&local, "auto", &[], &within(1e-8, SECONDS));
        let apart = end.account.iter().any(|line| line.contains(" islands, in "));
        assert!(apart, "{what}: {:?}", end.account);
        // One that has no solution leaves the others none.
        let hopeless = among_each_other(&[whole, squeezed(4, 0.4)]);
        refuted(&hopeless, "auto", &what);
        refuted(&Condense.reduce(&hopeless).unwrap().0, "auto", &what);
    }
    none(failed);
}

#[test]
fn contradictory_constraints_are_refuted() {
    let (mut problem, _) = Planted { bilateral: 3, ..Planted::default() }.global::<3>();
    let RowsGlobal { G, b, .. } = problem.rows.take().unwrap();
    // The last constraint once more, to be met at another velocity.
    let again = G.triplets().filter(|&(_, j, _)| j == 2).map(|(i, _, x)| (i, 3, x));
    let g =
        Csc::from_triplets(G.nrows(), 4, G.triplets().chain(again.collect::<Vec<_>>())).unwrap();
    problem.rows = Some(RowsGlobal::bilateral(g, [&b[..], &[b[2] + 1.0]].concat()));
    refuted(&problem, "auto", "a constraint twice");
}

/// A body that slides up between two steep walls: a solution by construction, though impulses across the wedge refute
/// the criterion of existence.
fn wedge(mu: f64) -> FrictionGlobal<3> {
    let (s, c) = 0.2_f64.sin_cos();
    let y = [0.0, 1.0, 0.0];
    let walls = [[[c, 0.0, s], [-s, 0.0, c], y], [[-c, 0.0, s], [s, 0.0, c], y]];
    let columns = walls.iter().flatten().enumerate();
    let h = columns.flat_map(|(j, axis)| (0..3).map(move |i| (i, j, axis[i]))).collect::<Vec<_>>();
    let h = Csc::from_triplets(3, 6, h.into_iter()).unwrap();
    let w: Vec<f64> = vec![0.0, 1.0, 0.1, 0.0, 0.8, -0.1];
    let along = |c: usize, k: usize| w[3 * c + k] / w[3 * c + 1].hypot(w[3 * c + 2]);
    let r = (0..2).flat_map(|c| [1.0, -mu * along(c, 1), -mu * along(c, 2)]).collect::<Vec<_>>();
    let mut f = vec![0.0; 3];
    h.mul_add(-1.0, &r, &mut f);
    FrictionGlobal::new(Csc::diagonal(&[2.0; 3]), h, f, w, vec![mu; 2]).unwrap()
}

#[test]
fn where_the_criterion_of_existence_fails_a_solution_is_found() {
    for mu in [0.25, 0.5, 1.0, 2.0] {
        let problem = wedge(mu);
        let known = existence::decide(&problem, &Limits::default());
        assert!(matches!(known, Existence::CriterionRefuted { .. }), "mu {mu}: {known:?}");
        none(all_forms(&problem, &format!("wedge, mu {mu}")));
    }
}

/// Of contacts at random with a friction of 2 and a W of low rank the criterion of existence holds for some.
#[test]
fn planted_problems_of_low_rank_with_a_friction_of_two() {
    let (mut all, mut failed) = (0, vec![]);
    for (contacts, dofs) in [(40, 100), (100, 240)] {
        for seed in 0..14 {
            let mu = (2.0, 2.0);
            let case = Planted { contacts, dofs, mix: MIXED, mu, seed, ..Planted::default() };
            let (problem, _) = case.local::<3>();
            let known = existence::decide(&problem, &Limits::default());
            if matches!(known, Existence::Proved { .. } | Existence::NearlyProved { .. }) {
                let what = format!("{contacts} contacts, {dofs} dofs, seed {seed}");
                all += 1;
                failed.extend(solved_to(1e-8, &problem, "auto", &what));
            }
        }
    }
    assert!(all >= 21 && failed.len() <= all / 20, "{} of {all} not: {failed:?}", failed.len());
}

/// The same problem with mass, length and time in other units: the first three unknowns of each body are velocities, the other
/// three angular ones.
fn in_units(p: &FrictionGlobal<3>, [mass, length, time]: [f64; 3]) -> FrictionGlobal<3> {
    let lever = |i: usize| if i % 6 < 3 { 1.0 } else { length };
    let m = p.M.triplets().map(|(i, j, x)| (i, j, mass * lever(i) * lever(j) * x));
    let h = p.H.triplets().map(|(i, j, x)| (i, j, lever(i) * x));
    let f = p.f.iter().enumerate().map(|(i, f)| mass * length / time * lever(i) * f).collect();
    let w = p.w.iter().map(|w| length / time * w).collect();
    let m = Csc::from_triplets(p.dofs(), p.dofs(), m).unwrap();
    let h = Csc::from_triplets(p.dofs(), p.w.len(), h).unwrap();
    FrictionGlobal::new(m, h, f, w, p.mu.clone()).unwrap()
}

/// Steps and factorisations, and the impulses in the first units.
fn effort<P: Registered + Judged>(
    problem: &P,
    impulses: fn(&P::Point) -> &[f64],
    unit: f64,
) -> (String, (usize, u64), Vec<f64>) {
    let end = run(problem, "auto", &[], &within(TIGHT, SECONDS));
    let Outcome { status, iterations, factorisations, .. } = end.outcome;
    let r = impulses(&end.point).iter().map(|r| r / unit).collect();
    (status.to_string(), (iterations, factorisations), r)
}

#[test]
fn units_change_nothing() {
    let big = 2.0_f64.powi(20);
    let kapla = Kapla { layers: 5, planks: 3, state: State::Perturbed, ..Kapla::default() };
    let wall = Wall { rows: 4, columns: 3, state: State::Impact, ..Wall::default() };
    let boxed = SlidingBox::default();
    let problems = [
        ("kapla", kapla.build().unwrap().problem().unwrap()),
        ("wall", wall.build().unwrap().problem().unwrap()),
        ("box", boxed.build().unwrap().problem().unwrap()),
    ];
    for (name, problem) in problems {
        let local = |p: &FrictionGlobal<3>| Condense.reduce(p).unwrap().0;
        let global = effort(&problem, |p| &p.r, 1.0);
        let condensed = effort(&local(&problem), |p| &p.r, 1.0);
        assert_eq!((&*global.0, &*condensed.0), ("solved", "solved"), "{name}");
        for unit in 0..3 {
            for a in [big, 1.0 / big, 1e6, 1e-6] {
                let mut units = [1.0; 3];
                units[unit] = a;
                let scaled = in_units(&problem, units);
                let impulse = units[0] * units[1] / units[2];
                let runs = [
                    ("global", &global, effort(&scaled, |p| &p.r, impulse)),
                    ("local", &condensed, effort(&local(&scaled), |p| &p.r, impulse)),
                ];
                for (form, (status, work, r), (other_status, other_work, other_r)) in runs {
                    let what = format!("{name}, {form}, unit {unit} by {a:e}");
                    assert_eq!((status, work), (&other_status, &other_work), "{what}");
                    // Powers of two are exact: then every bit is the same. But a unit of length makes velocities larger and
                    // angular ones not, so that M is factorised in another order.
                    let apart = r.iter().zip(&other_r).map(|(a, b)| a - b).collect::<Vec<_>>();
                    let exact = (a == big || a == 1.0 / big) && unit != 1;
                    let allowed = if exact { 0.0 } else { 1e-6 };
                    assert!(norm(&apart) <= allowed * norm(r), "{what}: {:e}", norm(&apart));
                }
            }
        }
    }
    // And a refutation is one in all units.
    for units in [[1e6, 1.0, 1.0], [1e-6, 1.0, 1.0], [1.0, 1e6, 1.0], [1.0, 1.0, 1e6]] {
        let p = squeezed(4, 0.5);
        let [mass, length, time] = units;
        let mut scaled = p.clone();
        let m = p.M.triplets().map(|(i, j, x)| (i, j, mass * x));
        scaled.M = Csc::from_triplets(p.dofs(), p.dofs(), m).unwrap();
        scaled.f.iter_mut().for_each(|f| *f *= mass * length / time);
        scaled.w.iter_mut().for_each(|w| *w *= length / time);
        refuted(&scaled, "auto", &format!("units {units:?}"));
    }
}

#[test]
fn limits_end_a_solve() {
    let heap = Spheres { state: State::Impact, ..Spheres::default() };
    let kapla = Kapla { layers: 30, planks: 4, state: State::Impact, ..Kapla::default() };
    for problem in [heap.build().unwrap().problem(), kapla.build().unwrap().problem()] {
        let problem = problem.unwrap();
        let limits =
            Limits { tolerance: f64::MIN_POSITIVE, time_limit: Some(1.0), ..<_>::default() };
        let end = run(&problem, "auto", &[], &limits).outcome;
        assert_ne!(end.status, Status::Solved);
        assert!(end.seconds < 5.0, "{} s", end.seconds);
        let limits = Limits { max_iterations: 7, ..limits };
        let end = run(&problem, "auto", &[], &limits).outcome;
        let ended = matches!(end.status, Status::Limit(Limit::Iterations | Limit::Time));
        assert!(ended && end.iterations <= 7, "{end:?}");
    }
}

/// The second solve of a session, and a solve by a new one, of the same problem.
fn same_bits<P: Registered>(problem: &P, other: &P, impulses: fn(&P::Point) -> &[f64], what: &str) {
    same_within(0.0, problem, other, impulses, what);
}

/// The same up to rounding: bodies that touch as they did before keep an analysis in which other pairs may have their place, so sums
/// are taken in another order.
fn same_within<P: Registered>(
    rounding: f64,
    problem: &P,
    other: &P,
    impulses: fn(&P::Point) -> &[f64],
    what: &str,
) {
    let limits = within(TIGHT, SECONDS);
    let session = || registry::session::<P>("auto", &<_>::default()).unwrap();
    let solve = |session: &mut Box<dyn nonsmooth_solve::Session<P>>, problem: &P| {
        let mut point = problem.origin();
        let outcome = session.solve(problem, &mut point, &limits, &mut |_| {}).unwrap();
        assert_eq!(outcome.status, Status::Solved, "{what}");
        (impulses(&point).to_vec(), outcome.iterations)
    };
    let fresh = solve(&mut session(), problem);
    let mut used = session();
    solve(&mut used, other);
    for round in ["", ", once more"] {
        let (r, iterations) = solve(&mut used, problem);
        assert_eq!(iterations, fresh.1, "{what}{round}");
        let far = r.iter().zip(&fresh.0).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
        assert!(far <= rounding, "{what}{round}: {far:e}");
    }
}

#[test]
fn a_session_that_is_used_again_gives_the_same_bits() {
    for (seed, dofs) in [(1, 120), (2, 48), (3, 24)] {
        let case = Planted { contacts: 30, dofs, mix: MIXED, seed, ..Planted::default() };
        let (global, _) = case.global::<3>();
        let mut other = global.clone();
        other.f.iter_mut().for_each(|f| *f *= 0.5);
        other.w.iter_mut().for_each(|w| *w *= 0.5);
        same_bits(&global, &other, |p| &p.r, &format!("global, {dofs} dofs"));
        let local = |p: &FrictionGlobal<3>| Condense.reduce(p).unwrap().0;
        same_bits(&local(&global), &local(&other), |p| &p.r, &format!("local, {dofs} dofs"));
        // A problem of another shape in between.
        let larger = Planted { contacts: 33, ..case.clone() };
        let what = format!("global, {dofs}, larger");
        same_within(1e-9, &global, &larger.global::<3>().0, |p| &p.r, &what);
        same_bits(
            &case.local::<2>().0,
            &larger.local::<2>().0,
            |p| &p.r,
            &format!("plane, {dofs}, larger"),
        );
    }
    let wall = |state| Wall { state, ..Wall::default() }.build().unwrap().problem().unwrap();
    same_bits(&wall(State::Impact), &wall(State::Perturbed), |p| &p.r, "wall");
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    // More than 20 000 contacts: sweeps are shared, of the wall in its own order and of the pile in one that lets them follow each other.
    let wall = Wall { rows: 54, columns: 52, state: State::Perturbed, ..Wall::default() };
    let pile = SpherePile { count: 7000, ..SpherePile::default() };
    let problems = [("wall", wall.build().unwrap()), ("pile", pile.build().unwrap())];
    for (what, problem) in problems.map(|(what, scene)| (what, scene.problem().unwrap())) {
        assert!(problem.mu.len() > 20_000, "{what}: {}", problem.mu.len());
        let [alone, two, three] = [1, 2, 3].map(|threads| {
            let limits = Limits { threads, max_iterations: 12, ..Limits::default() };
            let mut auto = registry::session("auto", &<_>::default()).unwrap();
            let mut point = problem.origin();
            let outcome = auto.solve(&problem, &mut point, &limits, &mut |_| {}).unwrap();
            (point.r, point.v, outcome.iterations)
        });
        assert!(alone == two && alone == three, "{what}");
        assert!(alone.0.iter().any(|r| *r != 0.0), "{what}");
    }
}

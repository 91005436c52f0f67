//! Every registered solver × every planted case of its kind. The verdict comes from the judge alone.

use nonsmooth_problem::check::Judged;
use nonsmooth_problem::planted::{Planted, PlantedMix};
use nonsmooth_problem::{FrictionLocal, Problem};

use nonsmooth_solve::registry::{self, Registered, Solves};
use nonsmooth_solve::{Limits, Outcome, Status};

/// Cases that every solver must solve: enough degrees of freedom for W to be regular, all statuses, `mu = 0`
/// included, and bilateral constraints.
fn cases() -> Vec<Planted> {
    let mixed = PlantedMix { open: 1.0, stick: 1.0, slip: 1.0, degenerate: 0.0 };
    let base = Planted { mix: mixed, mu: (0.0, 0.6), ..Planted::default() };
    vec![
        Planted { contacts: 1, dofs: 6, seed: 1, ..base.clone() },
        Planted { contacts: 5, dofs: 30, seed: 2, ..base.clone() },
        Planted { contacts: 20, dofs: 120, seed: 3, ..base.clone() },
        Planted { contacts: 20, dofs: 120, seed: 4, mu: (0.0, 0.0), ..base.clone() },
        Planted { contacts: 20, dofs: 120, seed: 5, skew: 0.02, ..base.clone() },
        Planted { contacts: 10, dofs: 90, bilateral: 4, seed: 6, ..base.clone() },
        // Joints alone.
        Planted { contacts: 0, dofs: 30, bilateral: 4, seed: 8, ..base.clone() },
        Planted {
            contacts: 12,
            dofs: 90,
            mix: PlantedMix { degenerate: 0.5, ..mixed },
            seed: 7,
            ..base
        },
    ]
}

/// Nothing slides or could: a relaxation's answers are then solutions of the law too.
fn nothing_slides(case: &Planted) -> bool {
    case.mu == (0.0, 0.0)
}

fn solves<P: Registered>(name: &str) -> Solves {
    registry::solves::<P>(name).expect("a listed solver is described")
}

/// The solvers of `P` by name with every set of settings that the registry asks to be tested.
fn runs<P: Registered>() -> Vec<(String, Vec<&'static str>)> {
    registry::solver_names::<P>()
        .into_iter()
        .flat_map(|name| {
            let about = registry::about::<P>(&name).expect("a listed solver is described");
            let variants = about.variants.iter().map(|v| vec![*v]);
            std::iter::once(vec![])
                .chain(variants)
                .map(move |v| (name.clone(), v))
                .collect::<Vec<_>>()
        })
        .collect()
}

fn solves_everything<P>(make: impl Fn(&Planted) -> P)
where
    P: Registered + Judged,
{
    let mut failures = Vec::new();
    for (name, settings) in runs::<P>() {
        let map = nonsmooth_solve::settings::from_texts(&settings).unwrap();
        let mut session = registry::session::<P>(&name, &map).unwrap();
        let relaxation = solves::<P>(&name) == Solves::Relaxation;
        for case in cases().into_iter().filter(|case| !relaxation || nothing_slides(case)) {
            let problem = make(&case);
            let mut point = problem.origin();
            let limits = Limits { tolerance: 1e-6, max_iterations: 200_000, ..Limits::default() };
            let outcome = match session.solve(&problem, &mut point, &limits, &mut |_| {}) {
                // There is nothing to restate as another problem.
                Err(e) if case.contacts == 0 => {
                    assert!(e.is_inapplicable() && e.to_string().contains("contact"), "{name} {e}");
                    continue;
                }
                outcome => outcome.unwrap(),
            };
            let verdict = problem.judge(&point, limits.tolerance).unwrap();
            assert_eq!(outcome.status == Status::Solved, verdict.solved, "{name} {case:?}");
            // What was accepted is bounded from above, and by little; all else is the same to the last bit.
            let (found, exact) = (outcome.measure, verdict.measure);
            if found != exact {
                let bounds =
                    problem.accept(&point, &mut problem.gauge().unwrap(), limits.tolerance);
                let (bounds, steered) = bounds.expect(&name);
                assert!(steered <= bounds.merit());
                assert_eq!(found, bounds, "{name} {settings:?} {case:?}");
                let excess = found.relative - exact.relative;
                assert!((0.0..1e-12).contains(&excess), "{name}: {found:?}, {exact:?}");
            }
            if !verdict.solved {
                let Outcome { status, iterations, .. } = outcome;
                failures.push(format!(
                    "{name} {settings:?} seed {}: {status} after {iterations}, {:.1e}",
                    case.seed, verdict.measure.relative
                ));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn local_problems_in_space() {
    solves_everything(|case| case.local::<3>().0);
}

#[test]
fn local_problems_in_the_plane() {
    solves_everything(|case| case.local::<2>().0);
}

#[test]
fn global_problems_in_space() {
    solves_everything(|case| case.global::<3>().0);
}

#[test]
fn global_problems_in_the_plane() {
    solves_everything(|case| case.global::<2>().0);
}

#[test]
fn a_relaxation_does_not_claim_to_solve_what_slides() {
    let sliding = PlantedMix { open: 0.0, stick: 0.0, slip: 1.0, degenerate: 0.0 };
    let case = Planted { contacts: 10, dofs: 60, mix: sliding, ..Planted::default() };
    let (problem, _) = case.local::<3>();
    let mut relaxations = 0;
    for about in registry::abouts::<FrictionLocal<3>>() {
        if about.solves == Solves::Law {
            continue;
        }
        relaxations += 1;
        let mut session = registry::session::<_>(about.name, &Default::default()).unwrap();
        let mut point = problem.origin();
        let outcome = session.solve(&problem, &mut point, &Limits::default(), &mut |_| {}).unwrap();
        let said = outcome.status.to_string();
        assert!(said.contains("the convex relaxation is solved"), "{}: {said}", about.name);
        assert!(outcome.measure.relative > 1e-3, "{}: {:?}", about.name, outcome.measure);
    }
    assert!(relaxations > 0);
}

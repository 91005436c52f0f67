//! Friction through facets: reduce, solve, lift, and the word of the friction problem's own judge.

mod plain_lemke;

use nonsmooth_problem::check::Judged;
use nonsmooth_problem::planted::{Planted, PlantedMix};
use nonsmooth_problem::{FrictionLocal, LocalPoint, Problem};
use nonsmooth_solve::reform::{FacetInner, FacetOuter, Facets};
use nonsmooth_solve::{Driver, Limits, Outcome, Reformulation, Session, Status, Via};
use plain_lemke::PlainLemke;

const SEEDS: std::ops::Range<u64> = 0..8;

fn solve<const D: usize, R>(reformulation: R, problem: &FrictionLocal<D>) -> (Outcome, LocalPoint)
where
    R: Reformulation<FrictionLocal<D>>,
    PlainLemke: nonsmooth_solve::Solver<R::To>,
{
    let mut session = Driver::new(Via { reformulation, solver: PlainLemke });
    let mut point = problem.origin();
    let limits = Limits { tolerance: 1e-10, max_iterations: 10, ..Limits::default() };
    let outcome = session.solve(problem, &mut point, &limits, &mut |_| {}).unwrap();
    (outcome, point)
}

fn planted(seed: u64) -> Planted {
    let mix = PlantedMix { open: 1.0, stick: 1.0, slip: 1.0, degenerate: 0.0 };
    Planted { contacts: 6, dofs: 36, mix, mu: (0.0, 0.6), seed, ..Planted::default() }
}

#[test]
fn the_plane_is_exact() {
    for seed in SEEDS {
        for bilateral in [0, 3] {
            let case = Planted { bilateral, ..planted(seed) };
            let (problem, known) = case.local::<2>();
            for (outcome, point) in [
                solve(FacetInner::<2>(Facets::default()), &problem),
                solve(FacetOuter::<2>(Facets::default()), &problem),
            ] {
                assert_eq!(outcome.status, Status::Solved, "{case:?}");
                let far = (point.r.iter().zip(&known.r)).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
                println!("{seed} {far:e} {:e}", outcome.measure.relative);
            }
        }
    }
}

#[test]
fn space_table() {
    for mix in [PlantedMix { open: 0.0, stick: 0.0, slip: 1.0, degenerate: 0.0 }, PlantedMix { open: 1.0, stick: 1.0, slip: 1.0, degenerate: 0.0 }] {
    for facets in [4, 6, 8, 16, 32, 64] {
        let mut line = String::new();
        for seed in SEEDS {
            let (problem, _) = Planted { mix, ..planted(seed) }.local::<3>();
            let f = Facets { facets, facet_angle: 0.0 };
            let (a, _) = solve(FacetInner::<3>(f), &problem);
            let (b, _) = solve(FacetOuter::<3>(f), &problem);
            line += &format!(" {:.1e}/{:.1e}", a.measure.relative, b.measure.relative);
            if a.measure.relative > 1e-10 { assert!(a.status.to_string().contains("the faceted problem is solved"), "{}", a.status); }
            if b.measure.relative > 1e-10 {assert!(b.status.to_string().contains("the faceted problem is solved"), "{}", b.status); }
        }
        println!("{facets}: {line}");
    }}
}

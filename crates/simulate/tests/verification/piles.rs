//! Scenes of `gen` in motion: what should stand stands.

use nonsmooth_problem::Friction;
use nonsmooth_scenes::scenes::{Arch, Family, SCENES, SpherePile, Stack};
use nonsmooth_simulate::{Body, Control, MoreauJean, SceneFile, Simulation, StepReport, World};
use nonsmooth_solve::settings::SettingsMap;
use nonsmooth_solve::{Limits, existence, solve};

use crate::{ball, check, simulation, world};

/// Runs a scene and returns how far its bodies have moved.
fn moved(scene: &nonsmooth_scenes::Scene, until: f64, h: f64) -> f64 {
    let world = World::try_from(scene).unwrap();
    let mut simulation = Simulation::new(world, MoreauJean::default()).unwrap();
    let mut far: f64 = 0.0;
    let mut watch = |s: &Simulation, _: &StepReport| {
        for (b, x) in scene.bodies.iter().zip(&s.state().position) {
            let square = (0..3).map(|k| (x[k] - b.position[k]).powi(2)).sum::<f64>();
            far = far.max(square.sqrt());
        }
        // What falls need not be followed to the ground.
        if far > 1e-2 { Control::Stop } else { Control::Continue }
    };
    check(&simulation.run(until, h, &mut watch).unwrap());
    far
}

#[test]
fn every_family_of_scenes_moves() {
    for entry in SCENES {
        let mut set = SettingsMap::new();
        if ["chute", "sphere_pile", "polyhedra"].contains(&entry.name) {
            set.insert("count".into(), 60.into());
        }
        let made = entry.make(&set).unwrap();
        let scene = SceneFile::of_family(entry.name, set, 2e-3, 0.02);
        let scene = SceneFile { gravity: made.gravity, ..scene };
        let built = scene.build();
        let mut simulation = built.unwrap_or_else(|e| panic!("{}: {e}", entry.name));
        // Walls, floor and ground: what else is fixed is an obstacle.
        let plane = |b: &&Body| b.parts.iter().any(|p| p.shape == nonsmooth_simulate::Shape::Plane);
        let planes = simulation.world().bodies.iter().filter(plane).count();
        assert!(planes <= 6, "{}: {planes} planes", entry.name);
        let report = simulation.run(4e-3, 2e-3, &mut ()).unwrap();
        assert!(report.is_solved(), "{}: {report}", entry.name);
        assert!(report.imbalance <= 1e-9, "{}: {report}", entry.name);
    }
}

#[test]
fn a_stack_of_a_scene_stands() {
    let scene = Stack { count: 6, ..Stack::default() }.build().unwrap();
    let far = moved(&scene, 1.0, 1e-2);
    assert!(far < 1e-9, "{far:e}");
}

/// An arch of so many voussoirs, its thickness a share of the mean radius.
fn arch(blocks: usize, share: f64, mu: f64) -> nonsmooth_scenes::Scene {
    let radius = 2.0;
    let thickness = share * radius / (1.0 - 0.5 * share);
    Arch { blocks, radius, thickness, mu, ..Arch::default() }.build().unwrap()
}

/// The least thickness without slip, which tends to Milankovitch's 0.1075 with the number of voussoirs, and the least friction, by linear programs. Voussoirs have straight sides, which
/// matters where they are few: of sectors of a ring 7 stand from 0.0962 on, 9 from 0.1021.
#[test]
fn arches_of_any_number_of_voussoirs_stand_or_fall_as_limit_analysis_says() {
    let least = [
        (7, 0.095703),
        (9, 0.101525),
        (11, 0.104589),
        (21, 0.106695),
        (31, 0.107130),
        (64, 0.107394),
        (128, 0.107468),
    ];
    let thick =
        least.map(|(n, share)| [(n, share * 1.005, 1.0, true), (n, share * 0.995, 1.0, false)]);
    let rough = [(15, 0.12, 0.37804), (15, 0.20, 0.30899), (31, 0.15, 0.35021)];
    let rough =
        rough.map(|(n, share, mu)| [(n, share, mu * 1.01, true), (n, share, mu * 0.99, false)]);
    for (n, share, mu, stands) in thick.into_iter().chain(rough).flatten() {
        let far = moved(&arch(n, share, mu), 3.0, 1e-2);
        assert_eq!(far < 1e-6, stands, "{n} {share} {mu}: {far:e}");
        assert!(stands || far > 1e-3, "{n} {share} {mu}: {far:e}");
    }
}

#[test]
fn an_arch_stands_or_falls_by_its_thickness_and_friction() {
    // 15 voussoirs without slip stand from t/R = 0.106266 on, R the mean radius; at t/R = 0.15 from mu = 0.34657 on.
    for (share, mu, stands) in [
        (0.106266 * 1.005, 1.0, true),
        (0.106266 * 0.995, 1.0, false),
        (0.15, 0.34657 * 1.01, true),
        (0.15, 0.34657 * 0.99, false),
    ] {
        let far = moved(&arch(15, share, mu), 3.0, 1e-2);
        assert_eq!(far < 1e-6, stands, "{share} {mu}: {far:e}");
        assert!(stands || far > 1e-3, "{share} {mu}: {far:e}");
    }
}

/// Nothing pushes from outside, so that both problems have solutions, and `exists` says so; with `v = 0`, equilibrium, only that of the arch which stands.
#[test]
fn a_solution_at_rest_is_an_equilibrium_of_an_arch() {
    for (share, stands) in [(0.106266 * 1.005, true), (0.106266 * 0.995, false)] {
        let problem = arch(15, share, 1.0).problem().unwrap();
        let existence =
            existence::of_contacts(&Friction::Global3(problem.clone()), &Limits::default());
        assert!(existence.is_proved(), "{existence:?}");
        let answer = solve(&problem).unwrap();
        assert!(answer.is_solved());
        let fastest = answer.point.v.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        assert_eq!(fastest < 1e-6, stands, "{share}: {fastest:e}");
    }
}

#[test]
fn a_pile_of_spheres_comes_to_rest() {
    let scene = SpherePile { count: 60, ..SpherePile::default() }.build().unwrap();
    let mut world = World::try_from(&scene).unwrap();
    // Four walls and the floor.
    assert_eq!(world.bodies.iter().filter(|b| !b.is_free()).count(), 5);
    world.law.e = 0.0;
    let mut simulation = Simulation::new(world, MoreauJean::default()).unwrap();
    let report = simulation.run(2.0, 5e-3, &mut ()).unwrap();
    check(&report);
    let fastest = simulation.state().velocity.iter().flatten().fold(0.0_f64, |m, v| m.max(v.abs()));
    assert!(fastest < 0.05, "{fastest}");
    assert!(report.penetration < 5e-3, "{report:?}");
}

#[test]
fn a_pyramid_of_balls_that_can_stand_stands() {
    // The line between the contacts of a ball with the floor and with the one above is at 22.5 degrees: mu = 0.8 holds it. The law has other solutions, which
    // roll apart.
    const ROWS: u32 = 5;
    let mut world = world(0.8, 0.0);
    world.add(Body::floor());
    for layer in 0..ROWS {
        for k in 0..(ROWS - layer).pow(2) {
            let (i, j) = (k / (ROWS - layer), k % (ROWS - layer));
            let at = |i: u32| f64::from(i) + 0.5 * f64::from(layer);
            world.add(ball(0.5).at([at(i), at(j), 0.5 + 0.5_f64.sqrt() * f64::from(layer)]));
        }
    }
    let mut simulation = simulation(world);
    for _ in 0..20 {
        let report = simulation.step(5e-3).unwrap();
        assert!(report.status.is_solved(), "{:?}", report.status);
        assert!(
            report.energy.kinetic < 1e-12 * report.energy.potential,
            "{:e}",
            report.energy.kinetic
        );
    }
}

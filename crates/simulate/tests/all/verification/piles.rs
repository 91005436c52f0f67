//! Scenes of `gen` in motion: what should stand stands.

use nonsmooth_problem::check::Judged;
use nonsmooth_problem::{Friction, FrictionLocal, LocalPoint};
use nonsmooth_scenes::scenes::{Arch, Family, SCENES, SpherePile, Stack};
use nonsmooth_scenes::vec3::sub;
use nonsmooth_simulate::{
    Body, Control, Law, MoreauJean, Polygon, SceneFile, Simulation, StepReport, World,
};
use nonsmooth_solve::settings::SettingsMap;
use nonsmooth_solve::{Limits, existence, solve};

use crate::verification::{ball, block, check, near, simulation, world};

/// Runs a world and returns how far its bodies have moved.
fn moved(world: World, until: f64, h: f64) -> f64 {
    let start = world.bodies.clone();
    let mut simulation = Simulation::new(world, MoreauJean::default()).unwrap();
    let mut far: f64 = 0.0;
    let mut watch = |s: &Simulation, _: &StepReport| {
        for (b, x) in start.iter().zip(&s.state().position) {
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
    let far = moved(World::try_from(&scene).unwrap(), 1.0, 1e-2);
    assert!(far < 1e-9, "{far:e}");
}

/// An arch of so many voussoirs, its thickness a share of the mean radius.
fn arch(blocks: usize, share: f64, mu: f64) -> nonsmooth_scenes::Scene {
    let radius = 2.0;
    let thickness = share * radius / (1.0 - 0.5 * share);
    Arch { blocks, radius, thickness, mu, ..Arch::default() }.build().unwrap()
}

/// The same in motion. As a `ring` voussoirs weigh what sectors of it do, at the mass centres of those, and not what blocks with straight sides do.
fn arch_in_motion(blocks: usize, share: f64, mu: f64, ring: bool) -> World {
    let mut world = World::try_from(&arch(blocks, share, mu)).unwrap();
    if ring {
        let Arch { radius, density, depth, .. } = Arch::default();
        let (inner, outer) = (radius, radius * (2.0 + share) / (2.0 - share));
        let half = 0.5 * std::f64::consts::PI / blocks as f64;
        let area = half * (outer.powi(2) - inner.powi(2));
        let far = 2.0 / 3.0 * half.sin() * (outer.powi(3) - inner.powi(3)) / area;
        for (k, body) in world.bodies.iter_mut().take(blocks).enumerate() {
            let (s, c) = ((2 * k + 1) as f64 * half).sin_cos();
            let centre = [far * c, 0.0, 0.3 * radius + far * s];
            let by = sub(centre, body.position);
            body.parts.iter_mut().for_each(|part| part.position = sub(part.position, by));
            (body.position, body.mass) = (centre, density * depth * area);
        }
    }
    world
}

/// Limit analysis without slip: the least thickness, as a share of the mean radius, for which a line of thrust passes between the ends of every joint; for sectors of a ring or blocks with
/// straight sides. By symmetry the thrust at the crown is horizontal, H at a height M/H. Its moment and that of the weight from the crown to a joint bound M at both ends of the joint; the room
/// between the bounds is concave in H.
fn least_thickness(n: usize, ring: bool) -> f64 {
    let a = 0.5 * std::f64::consts::PI / n as f64;
    let room = |t: f64, thrust: f64| {
        let (inner, outer) = (1.0 - 0.5 * t, 1.0 + 0.5 * t);
        let power = |k: i32| outer.powi(k) - inner.powi(k);
        // Of half a block: its area, and its first moments along its middle and across.
        let (area, along, across) = match ring {
            true => {
                (0.5 * a * power(2), a.sin() * power(3) / 3.0, (1.0 - a.cos()) * power(3) / 3.0)
            }
            false => {
                let (s, c) = a.sin_cos();
                (0.5 * s * c * power(2), s * c * c * power(3) / 3.0, s * s * c * power(3) / 6.0)
            }
        };
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        // Of an odd number half a block is on this side of the crown.
        let odd = n % 2;
        let (mut weight, mut moment) = (odd as f64 * area, odd as f64 * across);
        for joint in 0..=n / 2 {
            let (s, c) = ((2 * joint + odd) as f64 * a).sin_cos();
            let bound = |r: f64| r * (c * thrust + s * weight) - moment;
            (low, high) = (low.max(bound(inner)), high.min(bound(outer)));
            weight += 2.0 * area;
            moment += 2.0 * along * ((2 * joint + odd + 1) as f64 * a).sin();
        }
        high - low
    };
    let holds = |t: f64| {
        let (mut from, mut to) = (0.0, 4.0 * t);
        for _ in 0..100 {
            let (p, q) = ((2.0 * from + to) / 3.0, (from + 2.0 * to) / 3.0);
            if room(t, p) < room(t, q) { from = p } else { to = q }
        }
        room(t, from) >= 0.0
    };
    let (mut thin, mut thick) = (0.05, 0.2);
    for _ in 0..40 {
        let t = 0.5 * (thin + thick);
        if holds(t) { thick = t } else { thin = t }
    }
    thick
}

/// Whether an arch stands.
fn stands_or_falls(world: World, until: f64, stands: bool) {
    let far = moved(world, until, 1e-2);
    assert_eq!(far < 1e-8, stands, "{far:e}");
    assert!(stands || far > 1e-3, "{far:e}");
}

/// Tends to Milankovitch's 0.1075 with the number of voussoirs.
#[test]
fn arches_of_any_number_of_voussoirs_stand_or_fall_as_limit_analysis_says() {
    // Of sectors of a ring and of blocks with straight sides, which matters where they are few.
    for (n, sectors, straight) in [
        (7, 0.096245, 0.095703),
        (9, 0.102134, 0.101525),
        (11, 0.104910, 0.104589),
        (15, 0.106266, 0.106068),
        (21, 0.106790, 0.106695),
        (31, 0.107175, 0.107130),
        (64, 0.107394, 0.107383),
        (128, 0.107468, 0.107465),
    ] {
        for (ring, expected) in [(true, sectors), (false, straight)] {
            let least = least_thickness(n, ring);
            near(least, expected, 1e-6);
            // Of many both are nearly the same, and take long.
            if n < 64 || !ring {
                let until = if n < 64 { 10.0 } else { 2.0 };
                let world = |by: f64| arch_in_motion(n, least * by, 1.0, ring);
                stands_or_falls(world(1.005), until, true);
                stands_or_falls(world(0.995), until, false);
            }
        }
    }
}

/// The least friction, by linear programs.
#[test]
fn an_arch_stands_or_falls_by_its_friction() {
    for (n, share, mu) in
        [(15, 0.12, 0.37804), (15, 0.15, 0.34657), (15, 0.20, 0.30899), (31, 0.15, 0.35021)]
    {
        stands_or_falls(arch_in_motion(n, share, mu * 1.01, false), 10.0, true);
        stands_or_falls(arch_in_motion(n, share, mu * 0.99, false), 10.0, false);
    }
}

/// Nothing pushes from outside, so that both problems have solutions, and `exists` says so; with `v = 0`, equilibrium, only that of the arch which stands.
#[test]
fn a_solution_at_rest_is_an_equilibrium_of_an_arch() {
    for (share, mu, stands) in [
        (0.106266 * 1.005, 1.0, true),
        (0.106266 * 0.995, 1.0, false),
        (0.15, 0.34657 * 1.01, true),
        (0.15, 0.34657 * 0.99, false),
    ] {
        let problem = arch(15, share, mu).problem().unwrap();
        let existence =
            existence::of_contacts(&Friction::Global3(problem.clone()), &Limits::default());
        assert!(existence.is_proved(), "{existence:?}");
        let answer = solve(&problem).unwrap();
        assert!(answer.is_solved());
        let fastest = answer.point.v.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        assert_eq!(fastest < 1e-6, stands, "{share} {mu}: {fastest:e}");
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

/// Rows of so many boxes, one less, … 1, or of squares.
fn pyramid(plane: bool, base: u32) -> World {
    let mut world = if plane {
        World::in_plane([0.0, -9.81]).with_law(Law::friction(0.5))
    } else {
        world(0.5, 0.0)
    };
    world.add(if plane { Body::ground() } else { Body::floor() });
    for row in 0..base {
        for k in 0..base - row {
            let x = 1.05 * (f64::from(k) + 0.5 * f64::from(row));
            let z = 0.5 + f64::from(row);
            world.add(match plane {
                true => {
                    let square = Polygon::rectangle([0.5; 2]).unwrap();
                    Body::solid(square, 1.0).unwrap().at([x, z, 0.0])
                }
                false => block([0.5; 3]).at([x, 0.0, z]),
            });
        }
    }
    world
}

/// The relative residual of the last step's impulses, and whether they solve the problem.
fn judged<const D: usize>(
    problem: &FrictionLocal<D>,
    simulation: &Simulation,
    tolerance: f64,
) -> (f64, bool) {
    let active = simulation.contacts().iter().filter(|c| c.active);
    let r = active.flat_map(|c| c.impulse.into_iter().take(D)).collect();
    let verdict = problem.judge(&LocalPoint { r, lambda: vec![] }, tolerance).unwrap();
    (verdict.measure.relative, verdict.solved)
}

/// Of steps whose impulses those before have led to nobody has formed W: what was said of them is held against W, which the judge reads anew.
#[test]
fn what_is_told_without_w_holds_with_it() {
    // Velocities are taken where bodies have turned to, so that W is not symmetric.
    let mut turning = world(0.0, 0.0);
    turning.add(Body::floor());
    for level in 0..12 {
        let plate = block([0.5, 0.5, 0.1]).at([0.0, 0.0, 0.1 + 0.2 * f64::from(level)]);
        turning.add(plate.moving([0.0; 3], [0.0, 0.0, 1.0]));
    }
    let tolerance = 1e-8;
    for (world, symmetric) in
        [(pyramid(false, 6), true), (pyramid(true, 6), true), (turning, false)]
    {
        let mut simulation = simulation(world).with_tolerance(tolerance);
        let mut unasked = 0;
        for _ in 0..300 {
            let stated = simulation.problem(5e-3).unwrap().unwrap();
            let report = simulation.step(5e-3).unwrap();
            assert!(report.status.is_solved());
            if report.counts.iterations > 0 || report.newton > 1 {
                continue;
            }
            unasked += 1;
            let (relative, solved) = match stated {
                Friction::Local3(problem) => {
                    assert!(symmetric || problem.W.asymmetry() > 0.0);
                    judged(&problem, &simulation, tolerance)
                }
                Friction::Local2(problem) => judged(&problem, &simulation, tolerance),
                other => panic!("{:?}", other.kind()),
            };
            assert!(solved, "{relative:e}");
            // The same number, the step's with a bound of its rounding.
            assert!(relative <= report.residual && report.residual <= relative + 1e-11);
        }
        assert!(unasked > 100, "{unasked}");
    }
}

/// A shaken pyramid, whose island `auto` solves with its bodies: the impulses solve the problem with W, which the judge reads.
#[test]
fn islands_with_their_bodies_are_solved_as_by_w() {
    let tolerance = 1e-10;
    for (plane, base) in [(false, 6), (true, 10)] {
        let mut world = pyramid(plane, base);
        for (k, body) in world.bodies.iter_mut().enumerate().skip(1) {
            let (sin, cos) = (7.0 * k as f64).sin_cos();
            // Sideways, so that all goes on touching.
            body.velocity = [sin, if plane { 0.0 } else { cos }, 0.0];
        }
        let mut simulation = simulation(world).with_tolerance(tolerance);
        let mut asked = 0;
        for _ in 0..10 {
            let stated = simulation.problem(1e-3).unwrap().unwrap();
            let report = simulation.step(1e-3).unwrap();
            assert!(report.status.is_solved(), "{report:?}");
            if report.newton > 1 || report.counts.iterations == 0 || report.counts.largest < 128 {
                continue;
            }
            asked += 1;
            let (relative, _) = match stated {
                Friction::Local3(problem) => judged(&problem, &simulation, tolerance),
                Friction::Local2(problem) => judged(&problem, &simulation, tolerance),
                other => panic!("{:?}", other.kind()),
            };
            assert!(relative <= 10.0 * tolerance, "{relative:e}");
        }
        assert!(asked >= 3, "{asked}");
    }
}

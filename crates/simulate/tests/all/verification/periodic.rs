//! Worlds that repeat themselves: what crosses the boundary moves as what does not.

use nonsmooth_scenes::Rotation;
use nonsmooth_scenes::vec3::{Vec3, add, norm, scale, sub};
use nonsmooth_simulate::{
    Body, BodyId, Joint, Law, MoreauJean, Part, Period, Periodic, SceneFile, Shape, Simulation,
    World, plane,
};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::verification::{G, ball, block, near, run, simulation, v, weightless, world, x};

const LENGTHS: Vec3 = [1.2, 1.0, 1.1];

/// Balls and blocks that fill a good part of a cell and fly about.
fn crowd(periodic: Periodic) -> World {
    let mut rng = Pcg64::seed_from_u64(11);
    let mut world = weightless(0.4, 0.3).repeating(periodic);
    for k in 0..27 {
        let cell: Vec3 = std::array::from_fn(|i| f64::from(k / 3_i32.pow(i as u32) % 3));
        let at = std::array::from_fn(|i| LENGTHS[i] * (cell[i] + 0.5) / 3.0);
        let body = if k % 2 == 0 { ball(0.16) } else { block([0.12, 0.1, 0.07]) };
        let mut draw = |far: f64| std::array::from_fn(|_| rng.random_range(-far..far));
        world.add(body.at(at).moving(draw(3.0), draw(5.0)));
    }
    world
}

fn momentum(world: &World, simulation: &Simulation) -> Vec3 {
    let each = world.bodies.iter().zip(&simulation.state().velocity);
    each.fold([0.0; 3], |s, (b, &v)| add(s, scale(b.mass, v)))
}

/// Moves bodies by whole periods, with the velocities that belong there.
fn wound(mut world: World) -> (World, Vec<[i32; 3]>) {
    let mut rng = Pcg64::seed_from_u64(3);
    let mut turns = vec![];
    for body in &mut world.bodies {
        let turn: [i32; 3] = std::array::from_fn(|_| rng.random_range(-2..=2));
        for (n, p) in turn.into_iter().zip(&world.periodic.periods) {
            body.position = add(body.position, scale(f64::from(n), p.vector));
            body.velocity = add(body.velocity, scale(f64::from(n), p.velocity));
        }
        turns.push(turn);
    }
    (world, turns)
}

/// With bodies some periods away all moves as before, those periods away.
fn moves_alike_periods_away(periodic: Periodic, until: f64) {
    let world = crowd(periodic);
    let (far, turns) = wound(world.clone());
    let mut reference = simulation(world.clone());
    let mut found = simulation(far);
    let mut images = 0;
    for _ in 0..(until / 2e-3) as usize {
        let (first, second) = (reference.step(2e-3).unwrap(), found.step(2e-3).unwrap());
        assert!(first.status.is_solved() && second.status.is_solved());
        images += reference.contacts().iter().filter(|c| c.active && c.offset != [0.0; 3]).count();
    }
    assert!(images > 20, "{images}");
    let t = reference.state().t;
    for (k, turn) in turns.into_iter().enumerate() {
        let body = BodyId(k as u32);
        let (mut expected, mut speed) = (x(&reference, body), v(&reference, body));
        for (n, p) in turn.into_iter().zip(&world.periodic.periods) {
            expected = add(expected, scale(f64::from(n), add(p.vector, scale(t, p.velocity))));
            speed = add(speed, scale(f64::from(n), p.velocity));
        }
        (0..3).for_each(|i| near(x(&found, body)[i], expected[i], 1e-8));
        (0..3).for_each(|i| near(v(&found, body)[i], speed[i], 1e-7));
    }
}

#[test]
fn a_run_is_the_same_from_bodies_some_periods_away() {
    moves_alike_periods_away(Periodic::along_axes(LENGTHS), 0.1);
    // Not along all axes.
    moves_alike_periods_away(Periodic::along_axes([1.2, 0.0, 1.1]), 0.1);
}

#[test]
fn so_is_one_that_is_sheared_and_stretched() {
    let shear = [[-0.4, 0.0, 2.0], [0.0, 0.3, 0.0], [0.0, 0.0, -0.2]];
    moves_alike_periods_away(Periodic::sheared(LENGTHS, shear), 0.1);
    // Periods that are not along the axes, of which short ones are found.
    let skew = |vector: Vec3| Period { vector, velocity: [0.1, -0.2, 0.0] };
    let [a, b, c] = LENGTHS;
    let periods = vec![skew([a, 0.0, 0.0]), skew([3.0 * a, b, 0.0]), skew([-a, 2.0 * b, c])];
    moves_alike_periods_away(Periodic { periods, corner: [-0.3, 0.0, 0.0] }, 0.1);
}

#[test]
fn momentum_is_kept_across_the_boundary_and_energy_accounted_for() {
    for gradient in [[[0.0; 3]; 3], [[0.0, 0.0, 1.5], [0.0; 3], [0.0; 3]]] {
        let world = crowd(Periodic::sheared(LENGTHS, gradient));
        let mut simulation = simulation(world.clone());
        let before = momentum(&world, &simulation);
        run(&mut simulation, 0.2, 2e-3);
        let after = momentum(&world, &simulation);
        assert!(norm(sub(after, before)) <= 1e-12 * 27.0, "{after:?} from {before:?}");
    }
}

/// Two bodies that meet about `at`, obliquely and spinning, with the second one moved `by`.
fn met(make: fn() -> Body, periodic: Periodic, at: Vec3, by: Vec3) -> Simulation {
    let mut world = weightless(0.3, 0.6).repeating(periodic);
    let turned = Rotation::about([0.3, 1.0, 0.2], 0.5);
    let first = make().at(sub(at, [0.16, 0.02, 0.0])).turned(turned);
    world.add(first.moving([1.0, 0.2, 0.0], [0.0, 2.0, 1.0]));
    let second = make().at(add(add(at, [0.16, 0.01, 0.03]), by));
    world.add(second.moving([-1.5, 0.0, 0.1], [0.5, 0.0, -1.0]));
    let mut simulation = simulation(world);
    run(&mut simulation, 0.1, 1e-3);
    simulation
}

#[test]
fn what_meets_across_the_boundary_does_as_in_the_middle() {
    let capsule = || {
        let part = Part::new(Shape::Capsule { half_length: 0.05, radius: 0.08 });
        Body::with_mass(1.0, [[1e-2, 0.0, 0.0], [0.0, 1e-2, 0.0], [0.0, 0.0, 5e-3]], vec![part])
    };
    let cylinder =
        || Body::solid(Shape::Cylinder { half_length: 0.08, radius: 0.09 }, 400.0).unwrap();
    let prism = || block([0.1, 0.08, 0.09]);
    // Directions by the distance of convex sets are known to some 1e-9.
    let makes: [(fn() -> Body, f64); 4] =
        [(|| ball(0.12), 1e-12), (prism, 1e-11), (capsule, 1e-11), (cylinder, 1e-7)];
    for (make, tolerance) in makes {
        let period = [2.0, 0.0, 0.0];
        let inside = met(make, Periodic::default(), [1.0, 0.0, 0.0], [0.0; 3]);
        let across = met(make, Periodic::along_axes(period), [2.0, 0.0, 0.0], [-2.0, 0.0, 0.0]);
        assert!(norm(sub(v(&inside, BodyId(0)), [1.0, 0.2, 0.0])) > 0.1);
        for (k, by) in [(0, [1.0, 0.0, 0.0]), (1, [-1.0, 0.0, 0.0])] {
            let body = BodyId(k);
            let expected = add(x(&inside, body), by);
            (0..3).for_each(|i| near(x(&across, body)[i], expected[i], tolerance));
            (0..3).for_each(|i| near(v(&across, body)[i], v(&inside, body)[i], tolerance));
            let (p, q) = (across.state().spin[k as usize], inside.state().spin[k as usize]);
            (0..3).for_each(|i| near(p[i], q[i], tolerance));
        }
    }
}

/// One ball hits its neighbour's image: with e = 1 and equal masses velocities change places, and again on the other side.
#[test]
fn two_balls_on_a_ring_change_places_for_ever() {
    let mut world = weightless(0.0, 1.0).repeating(Periodic::along_axes([1.0, 0.0, 0.0]));
    let first = world.add(ball(0.1).at([0.2, 0.0, 0.0]).moving([1.0, 0.0, 0.0], [0.0; 3]));
    let second = world.add(ball(0.1).at([0.7, 0.0, 0.0]));
    let mut simulation = simulation(world);
    run(&mut simulation, 6.0, 1e-3);
    // Between impacts the moving one covers the gap, 0.3 m: 20 impacts, each late or early by less than a step.
    let sum = x(&simulation, first)[0] + x(&simulation, second)[0];
    near(sum, 0.9 + 6.0, 1e-11);
    near(v(&simulation, first)[0] + v(&simulation, second)[0], 1.0, 1e-13);
    let relative = (v(&simulation, first)[0] - v(&simulation, second)[0]).abs();
    near(relative, 1.0, 1e-12);
    assert!((x(&simulation, first)[0] - x(&simulation, second)[0]).abs() < 1.0);
}

/// A ball rolls down a slope that repeats itself, and falls all the way.
#[test]
fn a_ball_rolls_down_an_endless_slope() {
    let alpha = 0.3_f64;
    let mut world = world(1.0, 0.0).repeating(Periodic::along_axes([0.5, 0.5, 0.0]));
    world.gravity = [G * alpha.sin(), 0.0, -G * alpha.cos()];
    world.add(Body::floor());
    let b = world.add(ball(0.1).at([0.0, 0.0, 0.1]));
    let mut simulation = simulation(world);
    let report = run(&mut simulation, 2.0, 1e-3);
    assert_eq!(report.steps, 2000);
    let fall = 5.0 / 7.0 * G * alpha.sin();
    near(x(&simulation, b)[0], 0.5 * fall * 4.0, 1e-9);
    near(v(&simulation, b)[0], 2.0 * fall, 1e-10);
}

/// A ball between plates: the plane below moves with the cell that the ball is in.
#[test]
fn a_plate_has_the_velocity_of_the_cell() {
    let ball_in = |cell: f64| {
        let gradient = [[0.3, 0.0, 0.0], [0.0; 3], [0.0; 3]];
        let mut world = world(0.2, 0.0).repeating(Periodic::sheared([1.0, 0.0, 0.0], gradient));
        world.add(Body::floor());
        let b = world.add(ball(0.1).at([0.4 + cell, 0.0, 0.1]));
        world.bodies[1].velocity = [0.3 * cell, 0.0, 0.0];
        let mut simulation = simulation(world);
        run(&mut simulation, 0.2, 1e-3);
        (x(&simulation, b)[0], v(&simulation, b)[0])
    };
    let (here, there) = (ball_in(0.0), ball_in(2.0));
    near(there.1, here.1 + 0.6, 1e-12);
    near(there.0, here.0 + 2.0 + 0.6 * 0.2, 1e-12);
    near(here.1, 0.0, 1e-12);
}

#[test]
fn joints_hold_across_the_boundary() {
    let arm = |at: f64, periodic: Periodic| {
        let mut world = world(0.3, 0.0).repeating(periodic);
        let a = world.add(block([0.2, 0.02, 0.02]).at([at - 0.2, 0.0, 0.0]));
        let b = world.add(block([0.2, 0.02, 0.02]).at([at + 0.2, 0.0, 0.0]));
        let x = [0.0, 1.0, 0.0];
        world.join(Joint::spherical(None, a, [at - 0.4, 0.0, 0.0]));
        world.join(Joint::revolute(Some(a), b, [at, 0.0, 0.0], x));
        let mut simulation = simulation(world);
        run(&mut simulation, 0.3, 1e-3);
        [a, b].map(|k| sub(crate::verification::x(&simulation, k), [at, 0.0, 0.0]))
    };
    let (free, wrapped) =
        (arm(0.5, Periodic::default()), arm(2.0, Periodic::along_axes([2.0, 2.0, 0.0])));
    for (p, q) in free.iter().zip(&wrapped) {
        (0..3).for_each(|i| near(p[i], q[i], 1e-11));
    }
}

/// Partners of a joint do not touch each other, their images do.
#[test]
fn images_of_partners_touch() {
    let mut world = weightless(0.0, 0.0).repeating(Periodic::along_axes([1.0, 0.0, 0.0]));
    let a = world.add(ball(0.1).at([0.3, 0.0, 0.0]).moving([-1.0, 0.0, 0.0], [0.0; 3]));
    let b = world.add(ball(0.1).at([0.4, 0.0, 0.0]).moving([1.0, 0.0, 0.0], [0.0; 3]));
    world.join(Joint::prismatic(Some(a), b, [0.3, 0.0, 0.0], [1.0, 0.0, 0.0]));
    let mut simulation = simulation(world);
    run(&mut simulation, 0.5, 1e-3);
    near(x(&simulation, b)[0] - x(&simulation, a)[0], 0.8, 1e-3 + 1e-9);
    near(v(&simulation, b)[0] - v(&simulation, a)[0], 0.0, 1e-12);
}

#[test]
fn a_restart_and_any_number_of_threads_have_the_same_bits() {
    let make = || simulation(crowd(Periodic::along_axes(LENGTHS)));
    let mut whole = make();
    run(&mut whole, 0.1, 2e-3);
    let mut first = make();
    run(&mut first, 0.05, 2e-3);
    let mut second = make().with_threads(2);
    second.restore(&first.checkpoint()).unwrap();
    run(&mut second, 0.1, 2e-3);
    assert_eq!(whole.checkpoint(), second.checkpoint());
}

#[test]
fn discs_in_the_plane_go_round() {
    let inside = |periodic: Periodic, at: f64, by: f64| {
        let mut world = World::in_plane([0.0, -G])
            .with_law(Law { mu: 0.4, e: 0.3, ..Law::default() })
            .repeating(periodic);
        world.add(Body::ground());
        let disc = |x: f64| {
            Body::in_plane(1.0, 0.005, vec![Part::new(Shape::Disc { radius: 0.1 })])
                .at([x, 0.1, 0.0])
        };
        world.add(disc(at - 0.2).moving([1.0, 0.0, 0.0], [0.0; 3]));
        world.add(disc(at + 0.1 + by));
        let mut simulation = simulation(world);
        run(&mut simulation, 0.5, 1e-3);
        [1, 2].map(|k| x(&simulation, BodyId(k)))
    };
    let (free, across) = (
        inside(Periodic::default(), 0.5, 0.0),
        inside(Periodic::along_axes([3.0, 0.0, 0.0]), 3.0, -3.0),
    );
    near(across[0][0], free[0][0] + 2.5, 1e-12);
    near(across[1][0], free[1][0] - 0.5, 1e-12);
    assert!((free[1][0] - 0.6).abs() > 0.05);
}

#[test]
fn overlaps_across_the_boundary_are_refused_and_settled() {
    let make = || {
        let mut world = weightless(0.0, 0.0).repeating(Periodic::along_axes([1.0, 0.0, 0.0]));
        world.add(ball(0.1).at([0.05, 0.0, 0.0]).named("left"));
        world.add(ball(0.1).at([0.9, 0.0, 0.0]).named("right"));
        world
    };
    let error = Simulation::new(make(), MoreauJean::default()).err().unwrap().to_string();
    assert_eq!(error, "bodies overlap at the start: `left` and `right` by 5.000e-2 m");
    let (settled, said) = Simulation::settled(make(), MoreauJean::default()).unwrap();
    assert_eq!(said.pairs, 1);
    near(x(&settled, BodyId(0))[0], 0.075, 1e-9);
    near(x(&settled, BodyId(1))[0], 0.875, 1e-9);
}

#[test]
fn what_cannot_repeat_itself_is_refused() {
    let said =
        |world: World| Simulation::new(world, MoreauJean::default()).err().unwrap().to_string();
    let along = |lengths: Vec3| weightless(0.0, 0.0).repeating(Periodic::along_axes(lengths));
    let mut world = along([0.5, 0.0, 0.0]);
    world.add(ball(0.3).named("large"));
    assert_eq!(
        said(world),
        "periodic: expected periods longer than 0.6, twice the reach of `large`, which else may touch its own image, found one of 0.5 at t = 0 s"
    );
    let mut world = along([1.0, 0.0, 0.0]);
    world.add(ball(0.1));
    world.add(Body::fixed(vec![plane([0.0; 3], [1.0, 0.0, 1.0]).unwrap()]).named("slope"));
    assert!(said(world).starts_with("`slope`.parts[0]: expected a plane along all periods"));
    let twice = Period { vector: [1.0, 0.0, 0.0], velocity: [0.0; 3] };
    let periodic = Periodic { periods: vec![twice; 2], corner: [0.0; 3] };
    let mut world = weightless(0.0, 0.0).repeating(periodic);
    world.add(ball(0.1));
    assert!(said(world).starts_with("periodic: expected periods that are independent"));
    // A world that shrinks until a body would touch itself ends with words, not with a wrong contact.
    let squeeze = [[-1.0, 0.0, 0.0], [0.0; 3], [0.0; 3]];
    let mut world = weightless(0.0, 0.0).repeating(Periodic::sheared([1.0, 0.0, 0.0], squeeze));
    world.add(ball(0.3));
    let mut simulation = simulation(world);
    let error = simulation.run(1.0, 0.01, &mut ()).unwrap_err().to_string();
    assert!(error.starts_with("periodic: expected periods longer than 0.6"), "{error}");
    near(simulation.state().t, 0.39, 0.011);
}

/// The families of `gen` that repeat themselves: grains that are sheared and pressed, every step judged.
#[test]
fn periodic_boxes_are_sheared() {
    for (grains, periodic, dilation, fill) in [
        ("spheres", "all", 0.2, 0.62),
        ("spheres", "all", -0.1, 0.45),
        ("spheres", "plane", 0.2, 0.62),
        ("polyhedra", "all", 0.5, 1.0),
        ("polyhedra", "plane", 0.5, 1.0),
    ] {
        let set = serde_json::json!({
            "count": 30, "grains": grains, "periodic": periodic, "dilation": dilation, "fill": fill,
            "disturbance": if grains == "polyhedra" { 0.05 } else { 0.0 }
        });
        let set: nonsmooth_solve::settings::SettingsMap = serde_json::from_value(set).unwrap();
        let scene = SceneFile::of_family("periodic_box", set, 1e-3, 0.03);
        let scene = SceneFile { gravity: [0.0; 3], ..scene };
        let mut simulation = scene.build().unwrap();
        let (mut pressed, mut images) = (0, 0);
        for _ in 0..30 {
            let report = simulation.step(1e-3).unwrap();
            assert!(report.status.is_solved(), "{grains} {periodic} {dilation}: {report:?}");
            assert!(report.residual <= 1e-10, "{report:?}");
            assert!(report.energy.relative_imbalance() <= 1e-12, "{report:?}");
            let pressing = simulation.contacts().iter().filter(|c| c.impulse[0] > 0.0);
            pressed += pressing.clone().count();
            images += pressing.filter(|c| c.offset != [0.0; 3]).count();
        }
        assert!(pressed > 5 && images > 1, "{grains} {periodic}: {pressed}, {images}");
    }
}

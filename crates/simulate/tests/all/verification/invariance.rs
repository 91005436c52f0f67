//! What must not matter: place, orientation, names, units, the order of bodies; and what must be kept: momentum, bits.

use nonsmooth_scenes::Rotation;
use nonsmooth_scenes::vec3::{Vec3, add, apply, cross, scale, sub};
use nonsmooth_simulate::{
    Body, Geometry, Joint, Law, MoreauJean, Polygon, SceneFile, Shape, Simulation, Stabilisation,
    StepReport, Timings, World, plane,
};
use nonsmooth_solve::settings::SettingsMap;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::verification::{G, ball, block, near, run, simulation, weightless, world};

/// Bodies that fall on each other and on a floor: impacts, sliding, rolling, piling.
fn heap() -> World {
    let mut world = world(0.4, 0.3);
    world.add(Body::fixed(vec![plane([0.0; 3], [0.0, 0.0, 1.0]).unwrap()]));
    for k in 0..3 {
        let z = 0.3 + 0.5 * f64::from(k);
        let turned = Rotation::about([0.2, 1.0, 0.1], 0.4 + f64::from(k));
        let body = block([0.2, 0.1, 0.15]).at([0.02, 0.01 * f64::from(k), z]).turned(turned);
        world.add(body.moving([0.3, 0.0, -0.5], [0.5, 1.0, 0.2]));
        world.add(ball(0.12).at([0.5, 0.1, z]).moving([-1.0, 0.0, 0.0], [0.0, 2.0, 0.5]));
    }
    world
}

/// The world with every vector turned and then moved.
fn moved(world: &World, rotation: Rotation, by: Vec3) -> World {
    let r = rotation.matrix();
    let mut out = world.clone();
    out.gravity = apply(&r, world.gravity);
    for body in &mut out.bodies {
        body.position = add(by, apply(&r, body.position));
        body.rotation = rotation.after(body.rotation);
        body.velocity = apply(&r, body.velocity);
        body.angular_velocity = apply(&r, body.angular_velocity);
    }
    out
}

fn positions(mut simulation: Simulation, until: f64, h: f64) -> Vec<Vec3> {
    run(&mut simulation, until, h);
    simulation.state().position.clone()
}

const H: f64 = 2e-3;
const UNTIL: f64 = 0.4;

/// How near places are, m.
const SAME: f64 = 1e-9;

#[test]
fn a_turned_and_moved_world_moves_alike() {
    let reference = positions(simulation(heap()), UNTIL, H);
    let mut rng = Pcg64::seed_from_u64(319);
    let mut random = || rng.random_range(-1.0..1.0);
    let turns: [Rotation; 3] = std::array::from_fn(|_| {
        Rotation::about(std::array::from_fn(|_| random()), std::f64::consts::PI * random())
    });
    // Ten kilometres away places are known to some 2e-12 m.
    let far = (Rotation::IDENTITY, [1e4, -1e4, 1e4]);
    for (turn, by) in turns.map(|turn| (turn, [10.0, -20.0, 5.0])).into_iter().chain([far]) {
        let found = positions(simulation(moved(&heap(), turn, by)), UNTIL, H);
        for (p, q) in reference.iter().zip(&found) {
            let expected = add(by, apply(&turn.matrix(), *p));
            (0..3).for_each(|k| near(q[k], expected[k], SAME));
        }
    }
}

#[test]
fn bodies_in_another_order_move_alike() {
    let reference = positions(simulation(heap()), UNTIL, H);
    let mut world = heap();
    world.bodies.reverse();
    let found = positions(simulation(world), UNTIL, H);
    for (p, q) in reference.iter().zip(found.iter().rev()) {
        (0..3).for_each(|k| near(q[k], p[k], SAME));
    }
}

#[test]
fn a_mirrored_world_moves_alike() {
    let reference = positions(simulation(heap()), UNTIL, H);
    let mut world = heap();
    for body in &mut world.bodies {
        body.position[1] *= -1.0;
        body.velocity[1] *= -1.0;
        // Axial vectors turn the other way about the axes in the mirror; quaternions with them.
        let w = &mut body.angular_velocity;
        *w = [-w[0], w[1], -w[2]];
        let q = &mut body.rotation.0;
        *q = [q[0], -q[1], q[2], -q[3]];
    }
    let found = positions(simulation(world), UNTIL, H);
    for (p, q) in reference.iter().zip(&found) {
        near(q[0], p[0], SAME);
        near(q[1], -p[1], SAME);
        near(q[2], p[2], SAME);
    }
}

#[test]
fn units_do_not_matter() {
    let reference = positions(simulation(heap()), UNTIL, H);
    let scales =
        |k: usize| [1e3, 1e-3].map(|x| std::array::from_fn(|i| if i == k { x } else { 1.0 }));
    for [length, mass, time] in (0..3).flat_map(scales) {
        let mut world = heap();
        let speed = length / time;
        world.gravity = scale(speed / time, world.gravity);
        for body in &mut world.bodies {
            body.mass *= mass;
            body.inertia = body.inertia.map(|row| row.map(|j| mass * length * length * j));
            body.position = scale(length, body.position);
            body.velocity = scale(speed, body.velocity);
            body.angular_velocity = scale(1.0 / time, body.angular_velocity);
            for part in &mut body.parts {
                use nonsmooth_simulate::Shape;
                part.shape = match &part.shape {
                    Shape::Sphere { radius } => Shape::Sphere { radius: length * radius },
                    Shape::Box { half } => Shape::Box { half: half.map(|x| length * x) },
                    other => other.clone(),
                };
            }
        }
        let found = positions(simulation(world), UNTIL * time, H * time);
        for (p, q) in reference.iter().zip(&found) {
            (0..3).for_each(|k| near(q[k] / length, p[k], SAME));
        }
    }
}

/// Linear and angular momentum about the origin.
fn momenta(simulation: &Simulation) -> [Vec3; 2] {
    let (world, state) = (simulation.world(), simulation.state());
    let (mut linear, mut angular) = ([0.0; 3], [0.0; 3]);
    for (k, body) in world.bodies.iter().enumerate() {
        let p = scale(body.mass, state.velocity[k]);
        linear = add(linear, p);
        let r = state.rotation(nonsmooth_simulate::BodyId(k as u32)).matrix();
        let spin = apply(&r, apply(&body.inertia, state.spin[k]));
        angular = add(angular, add(cross(state.position[k], p), spin));
    }
    [linear, angular]
}

#[test]
fn collisions_of_free_bodies_keep_both_momenta() {
    let mut world = weightless(0.5, 0.4);
    for k in 0..5 {
        let at = f64::from(k);
        let turned = Rotation::about([0.2, 1.0, 0.1 * at], 0.4 + at);
        let body = block([0.2, 0.1, 0.15]).at([0.6 * at, 0.03 * at, 0.02]).turned(turned);
        world.add(body.moving([1.0 - 0.5 * at, 0.1, 0.0], [1.0, 2.0 - at, 3.0]));
        let b = ball(0.12).at([0.6 * at, 0.45, 0.1]);
        world.add(b.moving([0.0, -1.0, 0.0], [4.0, 0.0, at]));
    }
    let mut simulation = simulation(world);
    let start = momenta(&simulation);
    let mut impacts = 0;
    for _ in 0..300 {
        let before = momenta(&simulation);
        let report = simulation.step(2e-3).unwrap();
        assert!(report.status.is_solved());
        impacts += report.counts.stick + report.counts.slip;
        let now = momenta(&simulation);
        for (a, b) in before.iter().zip(&now) {
            (0..3).for_each(|k| near(b[k], a[k], 2e-12));
        }
    }
    assert!(impacts > 10, "{impacts}");
    for (a, b) in start.iter().zip(&momenta(&simulation)) {
        (0..3).for_each(|k| near(b[k], a[k], 1e-10));
    }
}

/// Both ends of an arm have to be at one point, in the middle of the motion. Extrapolated geometry has them there for joints and contacts, midpoint geometry for joints alone; the projection then
/// moves bodies, which keeps the linear momentum.
#[test]
fn a_free_chain_keeps_both_momenta() {
    // Angular momentum that a step may change by, kg m²/s, without a contact and with one.
    for (geometry, stabilisation, smooth, hit) in [
        (Geometry::Extrapolated, Stabilisation::None, 1e-12, 1e-12),
        (Geometry::Midpoint, Stabilisation::None, 1e-12, 1e-4),
        (Geometry::Extrapolated, Stabilisation::DirectProjection, 1e-7, 1e-5),
    ] {
        let mut world = weightless(0.5, 0.4);
        // A rigid motion to begin with, which fits the joints.
        let spin = [0.3, 1.0, 2.0];
        let links = [0.0, 1.0, 2.0, 3.0].map(|k| {
            let at = [0.5 * k, 0.0, 0.0];
            let v = add([0.0, 0.1, -0.2], cross(spin, at));
            world.add(block([0.2, 0.1, 0.15]).at(at).moving(v, spin))
        });
        let [p, q, r] = [0.25, 0.75, 1.25].map(|x| [x, 0.0, 0.0]);
        world.join(Joint::spherical(Some(links[0]), links[1], p));
        world.join(Joint::revolute(Some(links[1]), links[2], q, [0.0, 1.0, 0.0]));
        world.join(Joint::fixed(Some(links[2]), links[3], r));
        world.add(ball(0.12).at([0.1, 0.6, 0.05]).moving([0.0, -2.0, 0.0], [4.0, 0.0, 1.0]));
        let scheme = MoreauJean { geometry, stabilisation, ..MoreauJean::default() };
        let mut simulation = Simulation::new(world, scheme).unwrap();
        let mut impacts = 0;
        for _ in 0..500 {
            let [linear, angular] = momenta(&simulation);
            let report = simulation.step(2e-3).unwrap();
            assert!(report.status.is_solved());
            let touched = report.counts.stick + report.counts.slip;
            impacts += touched;
            let now = momenta(&simulation);
            let within = if touched > 0 { hit } else { smooth };
            (0..3).for_each(|k| near(now[0][k], linear[k], 1e-12));
            (0..3).for_each(|k| near(now[1][k], angular[k], within));
        }
        assert!(impacts > 0);
    }
}

#[test]
fn elastic_motion_without_friction_goes_back_in_time() {
    let mut world = weightless(0.0, 1.0);
    let spin = [0.3, 2.0, 0.5];
    world.add(block([0.2, 0.1, 0.15]).moving([0.2, 0.0, 0.1], spin));
    world.add(ball(0.1).at([2.0, 0.0, 0.0]).moving([0.0, 0.3, 0.0], [1.0, 0.0, 0.0]));
    let start = world.clone();
    let mut simulation = simulation(world);
    run(&mut simulation, 1.0, 1e-2);
    for k in 0..2 {
        let state = simulation.state_mut();
        state.velocity[k] = scale(-1.0, state.velocity[k]);
        state.spin[k] = scale(-1.0, state.spin[k]);
    }
    run(&mut simulation, 2.0, 1e-2);
    for (k, body) in start.bodies.iter().enumerate() {
        (0..3).for_each(|i| near(simulation.state().position[k][i], body.position[i], 1e-13));
        (0..4).for_each(|i| near(simulation.state().rotation[k][i], body.rotation.0[i], 1e-13));
    }
}

#[test]
fn a_boost_along_the_floor_changes_nothing() {
    use nonsmooth_simulate::Motion;
    let reference = positions(simulation(heap()), UNTIL, H);
    let boost = [3.0, -1.0, 0.0];
    let mut world = heap();
    world.bodies[0].motion = Motion::Surface { linear: boost, angular: [0.0; 3] };
    for body in &mut world.bodies[1..] {
        body.velocity = add(body.velocity, boost);
    }
    let found = positions(simulation(world), UNTIL, H);
    for (p, q) in reference.iter().zip(&found).skip(1) {
        let back = sub(*q, scale(UNTIL, boost));
        (0..3).for_each(|k| near(back[k], p[k], SAME));
    }
}

#[test]
fn a_run_that_is_interrupted_goes_on_bit_for_bit() {
    let mut whole = simulation(heap());
    run(&mut whole, 0.3, H);
    let checkpoint = whole.checkpoint();
    run(&mut whole, 0.9, H);
    let mut again = simulation(heap());
    again.restore(&checkpoint).unwrap();
    run(&mut again, 0.9, H);
    assert_eq!(whole.state(), again.state());
    assert_eq!(whole.contacts(), again.contacts());
    // And a run repeats itself.
    let mut twice = simulation(heap());
    run(&mut twice, 0.9, H);
    assert!(whole.checkpoint() == twice.checkpoint());
    // Looking at the problem of the next step changes nothing.
    let mut looked = simulation(heap());
    while looked.state().t < 0.9 - 1e-9 {
        looked.problem(H).unwrap();
        looked.step(H).unwrap();
    }
    assert_eq!(looked.state().position, twice.state().position);
    let refused = again.restore(b"{}").unwrap_err().to_string();
    assert!(refused.starts_with("checkpoint: expected one of a world of 7 bodies"), "{refused}");
}

#[test]
fn islands_together_move_as_they_do_apart() {
    let apart = |copies: &[f64]| {
        let mut world = world(0.4, 0.3);
        world.add(Body::floor());
        for &at in copies {
            for k in 0..4 {
                let z = 0.1 + 0.21 * f64::from(k);
                let speed = if at > 0.0 { 0.7 } else { -0.2 };
                let body = block([0.2, 0.15, 0.1]).at([at, 0.03 * f64::from(k), z]);
                world.add(body.moving([speed, 0.1, 0.0], [0.0; 3]));
            }
        }
        let mut simulation = simulation(world);
        run(&mut simulation, 0.5, H);
        simulation.state().position[1..].to_vec()
    };
    let (left, right, both) = (apart(&[-4.0]), apart(&[4.0]), apart(&[-4.0, 4.0]));
    assert_eq!([left, right].concat(), both);
}

#[test]
fn the_law_of_a_pair_of_materials_counts() {
    let mut world = World::new([0.0, 0.0, -G]).with_law(Law::friction(0.5));
    let ice = world.material("ice");
    world.pair(0, ice, Law::default());
    world.add(Body::floor());
    for material in [0, ice] {
        let at = [0.0, material as f64, 0.1];
        let body = block([0.3, 0.2, 0.1]).at(at).of(material);
        world.add(body.moving([1.0, 0.0, 0.0], [0.0; 3]));
    }
    let mut simulation = Simulation::new(world, MoreauJean::default()).unwrap();
    run(&mut simulation, 0.1, 1e-3);
    near(simulation.state().velocity[1][0], 1.0 - 0.5 * G * 0.1, 1e-10);
    near(simulation.state().velocity[2][0], 1.0, 1e-12);
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    // Small islands, some with two balls, and two large ones; more pairs than one thread looks at alone.
    let scene = || {
        let mut world = world(0.6, 0.3);
        world.add(Body::floor());
        for k in 0..400 {
            let at = |z: f64| [3.0 * f64::from(k % 20), 3.0 * f64::from(k / 20), z];
            world.add(ball(0.5).at(at(0.5)).moving([0.1, 0.0, -0.1], [0.0, 0.2, 0.0]));
            world.add(ball(0.5).at(at(1.502)).moving([0.0, 0.01, -0.5], [0.0; 3]));
        }
        for (rows, y) in [(5, -5.0), (7, -9.0)] {
            for k in 0..rows * (rows + 1) / 2 {
                let row = (0..rows).find(|r| k < (r + 1) * (2 * rows - r) / 2).unwrap();
                let place = k - row * (2 * rows - row + 1) / 2;
                let at =
                    [1.05 * (f64::from(place) + 0.5 * f64::from(row)), y, 0.5 + f64::from(row)];
                world.add(block([0.5; 3]).at(at));
            }
        }
        world
    };
    let moved = |threads: usize| {
        let mut simulation = simulation(scene()).with_threads(threads);
        for _ in 0..15 {
            let report = simulation.step(5e-3).unwrap();
            assert!(report.status.is_solved(), "{:?}", report.status);
            assert!(report.counts.islands > 300 && report.counts.largest > 100);
        }
        simulation.checkpoint()
    };
    let alone = moved(1);
    assert!(alone == moved(2) && alone == moved(3));
}

/// Steps by one, two and three threads: reports, contacts and states are the same to the last bit. At least so many contacts.
fn same_for_any_number_of_threads(world: &World, contacts: usize) {
    let moved = |threads: usize| {
        let simulation = Simulation::new(world.clone(), MoreauJean::default()).unwrap();
        let simulation = simulation.with_solver("nsgs", SettingsMap::new()).unwrap();
        let mut simulation = simulation.with_tolerance(1e-3).with_threads(threads);
        let mut told = vec![];
        for _ in 0..6 {
            let report = simulation.step(5e-3).unwrap();
            assert!(report.status.is_solved() && report.counts.active >= contacts, "{report:?}");
            let report = StepReport { timings: Timings::default(), ..report };
            told.push((report, simulation.contacts().to_vec(), simulation.joints().to_vec()));
        }
        (told, simulation.checkpoint())
    };
    let alone = moved(1);
    assert!(alone == moved(2) && alone == moved(3));
}

/// Balls side by side and upon each other, which jostle: one island of many contacts.
fn slab(mut world: World) -> World {
    world.add(Body::floor());
    for k in 0..14 * 14 * 3 {
        let (i, j, level) = (k % 14, k / 14 % 14, k / 196);
        let at = [i, j, level].map(|x| 0.2 * f64::from(x) + 0.1);
        let push = [0.3 * f64::from(k % 3) - 0.3, 0.2 * f64::from(k % 5) - 0.4, -0.1];
        world.add(ball(0.1).at(at).moving(push, [f64::from(k % 7) - 3.0, 1.0, 0.0]));
    }
    world
}

#[test]
fn the_number_of_threads_changes_no_bit_of_an_island() {
    same_for_any_number_of_threads(&slab(world(0.4, 0.0)), 600);
    let law = Law { mu: 0.4, mu_r: 0.01, ..Law::default() };
    same_for_any_number_of_threads(&slab(World::new([0.0, 0.0, -G]).with_law(law)), 600);
}

#[test]
fn nor_where_joints_and_elastic_solids_take_part() {
    let mut world = slab(world(0.4, 0.0));
    let mut last = None;
    for k in 0..8 {
        let at = [0.15 + 0.25 * f64::from(k), 0.5, 0.71];
        let link = world.add(block([0.1, 0.05, 0.05]).at(at));
        if let Some(last) = last {
            world.join(Joint::spherical(Some(last), link, [at[0] - 0.125, 0.5, 0.71]));
        }
        last = Some(link);
    }
    let scene = "format = 'nonsmooth-scene'
        version = 1
        time = { h = 0.005, end = 1 }
        [[elastic]]
        name = 'plate'
        half = [0.7, 0.7, 0.1]
        divisions = [7, 7, 1]
        young = 1e6
        density = 500
        position = [1.4, 1.9, 0.705]
        velocity = [0.1, 0, -0.2]";
    let plate = SceneFile::parse(scene, &[]).unwrap().build().unwrap();
    world.elastic.clone_from(&plate.world().elastic);
    same_for_any_number_of_threads(&world, 600);
}

#[test]
fn nor_in_the_plane() {
    let mut world = World::in_plane([0.0, -G]).with_law(Law::friction(0.3));
    world.add(Body::ground());
    for k in 0..30 * 10 {
        let (i, j) = (f64::from(k % 30), f64::from(k / 30));
        let body = match k % 2 {
            0 => Body::solid(Shape::Disc { radius: 0.1 }, 1000.0).unwrap(),
            _ => Body::solid(Polygon::rectangle([0.1; 2]).unwrap(), 1000.0).unwrap(),
        };
        world.add(
            body.at([0.2 * i, 0.1 + 0.2 * j, 0.0]).moving([0.01 * (15.0 - i), -0.2, 0.0], [0.0; 3]),
        );
    }
    same_for_any_number_of_threads(&world, 520);
}

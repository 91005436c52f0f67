//! Projection onto contacts: nothing penetrates, velocities stay, and what the combined one adds.

use nonsmooth_simulate::{
    Body, Control, Coordinate, Drive, Joint, JointLimits, MoreauJean, Motion, Simulation,
    Stabilisation, StepStatus, World,
};

use crate::verification::{G, ball, block, weightless, world};

fn with(world: World, stabilisation: Stabilisation) -> Simulation {
    Simulation::new(world, MoreauJean { stabilisation, ..MoreauJean::default() }).unwrap()
}

/// What penetrates after the steps, m: the next step is the one that sees it.
fn penetration(simulation: &mut Simulation, until: f64, h: f64) -> f64 {
    let mut worst: f64 = 0.0;
    let report = simulation
        .run(until, h, &mut |_: &Simulation, step: &nonsmooth_simulate::StepReport| {
            assert_eq!(step.status, StepStatus::Solved, "at t = {}", step.t);
            assert!(step.energy.relative_imbalance() <= 1e-12, "{:?}", step.energy);
            worst = worst.max(step.drift.penetration);
            Control::Continue
        })
        .unwrap();
    assert!(report.is_solved());
    worst
}

/// Three boxes that fall on a floor and on each other, the last one turned.
fn falling() -> World {
    let mut world = world(0.5, 0.0);
    world.add(Body::floor());
    for k in 0..3 {
        let z = 0.3 + 0.5 * f64::from(k);
        let turned = nonsmooth_scenes::Rotation::about([1.0, 2.0, 0.5], 0.2 * f64::from(k));
        world.add(block([0.2, 0.2, 0.1]).at([0.03 * f64::from(k), 0.0, z]).turned(turned));
    }
    world
}

#[test]
fn boxes_that_fall_do_not_penetrate() {
    let plain = penetration(&mut with(falling(), Stabilisation::DirectProjection), 0.8, 5e-3);
    assert!(plain > 1e-3, "{plain:e}");
    for stabilisation in [Stabilisation::ContactProjection, Stabilisation::CombinedProjection] {
        let left = penetration(&mut with(falling(), stabilisation), 0.8, 5e-3);
        assert!(left <= 1e-10, "{stabilisation:?} {left:e}");
    }
}

/// A ball that comes down at 1 m/s from `gap` above the floor.
fn coming(gap: f64) -> World {
    let mut world = weightless(0.0, 0.0);
    world.add(Body::floor());
    world.add(ball(0.1).at([0.0, 0.0, 0.1 + gap]).moving([0.0, 0.0, -1.0], [0.0; 3]));
    world
}

#[test]
fn what_the_forecast_missed_is_pushed_back_and_keeps_its_velocity() {
    // With γ = ½ a gap of 0.75 h |u| is open to the step, which comes to a penetration of a quarter of h |u|.
    const H: f64 = 0.01;
    let after = |stabilisation| {
        let mut simulation = with(coming(0.75 * H), stabilisation);
        let report = simulation.step(H).unwrap();
        assert_eq!(report.status, StepStatus::Solved);
        (simulation.state().position[1][2] - 0.1, simulation.state().velocity[1][2], report)
    };
    let (z, v, _) = after(Stabilisation::DirectProjection);
    assert!((z + 0.25 * H).abs() < 1e-15 && v == -1.0, "{z} {v}");
    let (z, v, report) = after(Stabilisation::ContactProjection);
    assert!(z.abs() < 1e-12 && v == -1.0, "{z} {v}");
    assert_eq!(report.counts.active, 0);
    // The combined one finds the contact by the push and stops the ball there: half of the step it moved.
    let (z, v, report) = after(Stabilisation::CombinedProjection);
    assert!((z - 0.25 * H).abs() < 1e-12 && v.abs() < 1e-12, "{z} {v}");
    assert_eq!(report.counts.active, 1);
}

#[test]
fn joints_and_contacts_are_closed_together() {
    // Two rods on hinges fall on a floor that they reach at different times.
    let mut world = world(0.3, 0.0);
    world.add(Body::floor());
    let rod = |x: f64| block([0.25, 0.05, 0.05]).at([x, 0.0, 0.6]);
    let (first, second) = (world.add(rod(0.25)), world.add(rod(0.75)));
    world.join(Joint::revolute(None, first, [0.0, 0.0, 0.6], [0.0, 1.0, 0.0]));
    world.join(Joint::revolute(Some(first), second, [0.5, 0.0, 0.6], [0.0, 1.0, 0.0]));
    for stabilisation in [Stabilisation::ContactProjection, Stabilisation::CombinedProjection] {
        let mut simulation = with(world.clone(), stabilisation);
        let left = penetration(&mut simulation, 1.5, 5e-3);
        assert!(left <= 1e-10, "{stabilisation:?} {left:e}");
        for joint in simulation.joints() {
            assert!(joint.violation <= 1e-12, "{stabilisation:?} {joint:?}");
        }
    }
}

#[test]
fn limits_of_joints_are_closed_too() {
    let limits = Some(JointLimits { lower: -0.5, upper: 0.3, e: 0.0 });
    let overshoot = |stabilisation| {
        let mut world = weightless(0.0, 0.0);
        let leaf = block([0.5, 0.05, 0.5]).at([0.5, 0.0, 0.0]);
        let door = world.add(leaf.moving([0.0, 1.5, 0.0], [0.0, 0.0, 3.0]));
        let hinge = Joint::revolute(None, door, [0.0; 3], [0.0, 0.0, 1.0]);
        world.join(hinge.driven(Drive { limits, ..Drive::along(Coordinate::Angle) }));
        let mut simulation = with(world, stabilisation);
        let mut worst: f64 = 0.0;
        for _ in 0..100 {
            assert_eq!(simulation.step(0.012).unwrap().status, StepStatus::Solved);
            worst = worst.max(simulation.joints()[0].angle - 0.3);
        }
        worst
    };
    let plain = overshoot(Stabilisation::DirectProjection);
    assert!(plain > 1e-3, "{plain:e}");
    let closed = overshoot(Stabilisation::ContactProjection);
    assert!(closed <= 1e-10, "{closed:e}");
}

/// What a projection lifts would fall again, with a restitution that throws it up, did the contact that it pushed not take part in the next step.
#[test]
fn a_tower_that_is_projected_comes_to_rest() {
    for (e, ratio, h) in [(0.5, 4.0, 2e-3), (0.5, 4.0, 5e-4), (0.5, 1.0, 2e-3), (0.1, 4.0, 2e-3)] {
        let mut world = world(0.3, e);
        world.add(Body::floor());
        for k in 0..6 {
            let body = Body::solid(
                nonsmooth_simulate::Shape::Box { half: [0.1; 3] },
                500.0 * f64::powi(ratio, k),
            );
            world.add(body.unwrap().at([0.0, 0.0, 0.11 + 0.25 * f64::from(k)]));
        }
        let mut simulation = with(world, Stabilisation::ContactProjection);
        let energy = |s: &nonsmooth_simulate::StepReport| s.energy.kinetic + s.energy.potential;
        let first = energy(&simulation.step(h).unwrap());
        let mut most = first;
        let report = simulation
            .run(2.0, h, &mut |_: &Simulation, step: &nonsmooth_simulate::StepReport| {
                most = most.max(energy(step));
                Control::Continue
            })
            .unwrap();
        assert!(report.is_solved());
        assert!(most < 1.001 * first, "{e} {ratio} {h}: {most} of {first}");
        let speeds = simulation.state().velocity.iter().map(|v| nonsmooth_scenes::vec3::norm(*v));
        let fastest = speeds.fold(0.0, f64::max);
        // But for the weight of a step.
        assert!(fastest < 1.01 * h * G, "{e} {ratio} {h}: {fastest:e}");
    }
}

#[test]
fn what_a_projection_cannot_close_is_said() {
    // A wall at 1 m/s that the forecast has open closes in on a ball that is held.
    const H: f64 = 0.01;
    let mut world = weightless(0.0, 0.0);
    let held = world.add(ball(0.1));
    let mut wall = block([0.1; 3]).at([0.2 + 0.75 * H, 0.0, 0.0]);
    wall.motion = Motion::Oscillating { amplitude: [-0.1, 0.0, 0.0], frequency: 10.0, phase: 0.0 };
    world.add(wall);
    world.join(Joint::fixed(None, held, [0.0; 3]));
    let mut simulation = with(world, Stabilisation::ContactProjection);
    let report = simulation.step(H).unwrap();
    assert_eq!(report.status, StepStatus::ProjectionLimit);
    assert!(simulation.state().position[0][0].abs() < H);
}

#[test]
fn contacts_that_give_way_keep_their_penetration() {
    let mut world = world(0.0, 0.0);
    world.add(Body::floor());
    world.add(ball(0.1).at([0.0, 0.0, 0.1]));
    world.comply(0, 0, nonsmooth_simulate::Compliance { stiffness: 981.0, damping: 200.0 });
    let mut simulation = with(world, Stabilisation::CombinedProjection);
    simulation.run(2.0, 1e-3, &mut ()).unwrap();
    // m g / k = 1 cm.
    let z = simulation.state().position[1][2];
    assert!((z - 0.09).abs() < 1e-6, "{z}");
}

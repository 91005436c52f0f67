//! Mechanisms with contacts or loops whose motion or rest is known: chain, ladder, Bricard's loop, a double pendulum that hits a wall, a block that is pushed.

use nonsmooth_scenes::Rotation;
use nonsmooth_scenes::vec3::{Vec3, add, apply, dot, scale, sub};
use nonsmooth_simulate::{
    Body, Control, Coordinate, Drive, Joint, Law, MoreauJean, Part, Shape, Simulation, Spring,
    StepReport, World,
};

use crate::verification::{G, block, check, near, run, simulation, world};

const Y: Vec3 = [0.0, 1.0, 0.0];

/// A uniform square bar of 1 kg and 1 m along the first axis.
fn bar(thickness: f64) -> Body {
    let (along, across) = (thickness * thickness / 6.0, (1.0 + thickness * thickness) / 12.0);
    let j = [[along, 0.0, 0.0], [0.0, across, 0.0], [0.0, 0.0, across]];
    Body::with_mass(1.0, j, vec![])
}

/// A chain of n rods of 1 m from the origin to `(span, 0)`, its first half straight down and its second straight up; each joint has a damper.
fn chain(n: usize, span: f64) -> Simulation {
    let slope = (span / n as f64).acos();
    let mut world = World::new([0.0, 0.0, -G]);
    let damper = Spring { stiffness: 0.0, damping: 4.0, rest: 0.0 };
    let drive = Drive { spring: Some(damper), ..Drive::along(Coordinate::Angle) };
    let (mut at, mut last) = ([0.0; 3], None);
    for k in 0..n {
        let angle = if k < n / 2 { -slope } else { slope };
        let along = [angle.cos(), 0.0, angle.sin()];
        let rod = bar(0.1).at(add(at, scale(0.5, along))).turned(Rotation::about(Y, -angle));
        let rod = world.add(rod);
        world.join(Joint::revolute(last, rod, at, Y).driven(drive));
        (at, last) = (add(at, along), Some(rod));
    }
    world.join(Joint::revolute(None, last.expect("links"), at, Y).driven(drive));
    simulation(world)
}

#[test]
fn a_chain_comes_to_hang_as_its_statics_say() {
    // tan β_k = (k − (N − 1)/2) m g/H: the pull over a weight, and the height of the lowest joint.
    const H: f64 = 2e-2;
    for (n, span, pull, lowest) in
        [(10, 6.0, 1.629119729686, -3.655450362994), (20, 12.0, 3.262052014328, -7.269052321309)]
    {
        let mut simulation = chain(n, span);
        simulation.run(150.0, H, &mut ()).unwrap();
        let force = scale(1.0 / H, simulation.joints()[0].impulse);
        near(force[0].abs() / G, pull, 1e-8);
        near(force[2] / G, 0.5 * n as f64, 1e-8);
        let state = simulation.state();
        let rod = n / 2 - 1;
        let along = Rotation(state.rotation[rod]).matrix().map(|row| row[0]);
        near(state.position[rod][2] + 0.5 * along[2], lowest, 1e-8);
    }
}

#[test]
fn a_smooth_ladder_leaves_the_wall_at_two_thirds_of_its_height() {
    // Feet as small balls shift floor and wall by their radius.
    const R: f64 = 1e-3;
    let start: f64 = 1.1;
    let foot = |x: f64| Part { position: [x, 0.0, 0.0], ..Part::new(Shape::Sphere { radius: R }) };
    let j = 1.0 / 3.0;
    let ladder = Body::with_mass(
        1.0,
        [[1e-3, 0.0, 0.0], [0.0, j, 0.0], [0.0, 0.0, j]],
        vec![foot(-1.0), foot(1.0)],
    );
    // Its head at the wall x = 0, its foot on the floor.
    let left_at = |h: f64| {
        let mut world = world(0.0, 0.0);
        world.add(Body::floor());
        world.add(Body::floor().turned(Rotation::about(Y, std::f64::consts::FRAC_PI_2)));
        let centre = [start.cos() + R, 0.0, start.sin() + R];
        let body = world.add(ladder.clone().at(centre).turned(Rotation::about(Y, start)));
        let mut simulation = simulation(world);
        let mut height = 0.0;
        let mut watch = |s: &Simulation, step: &StepReport| {
            assert!(step.status.is_solved());
            let z = s.state().position[body.index()][2] - R;
            let wall = s.contacts().iter().filter(|c| c.a.index() == 1);
            assert!(s.contacts().iter().all(|c| c.impulse[0] >= 0.0));
            if wall.map(|c| c.impulse[0]).sum::<f64>() > 0.0 {
                height = z;
            }
            if z > 0.3 { Control::Continue } else { Control::Stop }
        };
        simulation.run(3.0, h, &mut watch).unwrap();
        height / start.sin()
    };
    near(left_at(1e-3), 2.0 / 3.0, 4e-3);
    near(left_at(1e-4), 2.0 / 3.0, 4e-4);
}

#[test]
fn a_block_that_is_pushed_slides_or_tips_by_the_height_of_the_push() {
    let (mu, width, height) = (0.5, 0.2, 0.6);
    let critical = width / (2.0 * mu);
    for (y, tips) in [(0.98 * critical, false), (1.02 * critical, true)] {
        let mut world = world(mu, 0.0);
        world.add(Body::floor());
        let push = if tips { 0.5 * width * G / y } else { mu * G } * 1.005;
        let body = block([0.5 * width, 0.3, 0.5 * height]).at([0.0, 0.0, 0.5 * height]);
        let body = world.add(Body {
            force: [push, 0.0, 0.0],
            torque: [0.0, push * (y - 0.5 * height), 0.0],
            ..body
        });
        let mut simulation = simulation(world);
        run(&mut simulation, 0.3, 1e-3);
        let (v, spin) =
            (simulation.state().velocity[body.index()], simulation.state().spin[body.index()]);
        match tips {
            true => assert!(spin[1] > 1e-3, "{v:?} {spin:?}"),
            false => {
                near(v[0], 0.3 * 0.005 * mu * G, 1e-9);
                near(spin[1], 0.0, 1e-9);
            }
        }
    }
}

#[test]
fn bricards_loop_moves_though_it_has_an_equation_too_many() {
    // Six edges of a cube, one of them the ground; each axis is across the two rods that it joins.
    let corners: [Vec3; 6] = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [1.0, 1.0, 1.0],
        [0.0, 1.0, 1.0],
        [0.0, 0.0, 1.0],
    ];
    let axes: [Vec3; 6] = std::array::from_fn(|k| match k % 3 {
        0 => [0.0, 1.0, 0.0],
        1 => [0.0, 0.0, 1.0],
        _ => [1.0, 0.0, 0.0],
    });
    let mut world = World::new([0.0, -G, 0.0]);
    let mut last = None;
    for k in 0..5 {
        let (from, to) = (corners[k], corners[k + 1]);
        let along = sub(to, from);
        // From the first axis to the rod.
        let turn = match k % 3 {
            1 => Rotation::about([0.0, 0.0, 1.0], std::f64::consts::FRAC_PI_2),
            2 => Rotation::about(Y, -std::f64::consts::FRAC_PI_2),
            _ => Rotation::about(Y, 0.0),
        };
        let rod = world.add(bar(0.1).at(add(from, scale(0.5, along))).turned(turn));
        world.join(Joint::revolute(last, rod, from, axes[k]));
        last = Some(rod);
    }
    world.join(Joint::revolute(None, last.expect("rods"), corners[5], axes[5]));
    let mut simulation = Simulation::new(world, MoreauJean::default()).unwrap();
    let said = simulation.warnings().join(" ");
    assert!(said.contains("1 of 30 equations of joints"), "{said}");
    let mut start = None;
    let (mut worst, mut open, mut speed): (f64, f64, f64) = (0.0, 0.0, 0.0);
    let mut watch = |s: &Simulation, step: &StepReport| {
        let energy = step.energy.kinetic + step.energy.potential;
        let first = *start.get_or_insert(energy);
        worst = worst.max((energy - first).abs());
        open = open.max(step.drift.joints);
        speed = speed.max(s.state().velocity.iter().map(|v| dot(*v, *v)).fold(0.0, f64::max));
        Control::Continue
    };
    check(&simulation.run(10.0, 1e-3, &mut watch).unwrap());
    assert!(worst <= 1e-3, "{worst:e} J");
    assert!(open <= 1e-12, "{open:e}");
    assert!(speed > 1.0, "{speed}");
}

#[test]
fn a_double_pendulum_that_hits_a_wall_keeps_its_energy_to_second_order() {
    let off = |h: f64| {
        let mut world =
            World::new([0.0, 0.0, -G]).with_law(Law { mu: 0.0, e: 1.0, e_t: 0.0, mu_r: 0.0 });
        let wall = Body::floor().turned(Rotation::about(Y, -std::f64::consts::FRAC_PI_2));
        world.add(wall.at([0.4, 0.0, 0.0]));
        let tip = Part { position: [0.5, 0.0, 0.0], ..Part::new(Shape::Sphere { radius: 0.05 }) };
        let down = Rotation::about(Y, 0.3 + std::f64::consts::PI);
        let along = apply(&down.matrix(), [1.0, 0.0, 0.0]);
        let first = world.add(bar(0.05).at(scale(0.5, along)).turned(down));
        let second = Body { parts: vec![tip], ..bar(0.05) };
        let second = world.add(second.at(scale(1.5, along)).turned(down));
        world.join(Joint::revolute(None, first, [0.0; 3], Y));
        world.join(Joint::revolute(Some(first), second, along, Y));
        let mut simulation = simulation(world);
        let (mut start, mut last, mut hits) = (None, 0.0, 0);
        let mut watch = |s: &Simulation, step: &StepReport| {
            assert!(step.status.is_solved());
            last = step.energy.kinetic + step.energy.potential;
            start.get_or_insert(last);
            hits += usize::from(s.contacts().iter().any(|c| c.impulse[0] > 0.0));
            Control::Continue
        };
        simulation.run(2.0, h, &mut watch).unwrap();
        assert!(hits > 0);
        (last - start.expect("a step")).abs()
    };
    let (coarse, fine) = (off(1e-3), off(2.5e-4));
    assert!(fine < 1e-4 && fine < 0.1 * coarse, "{coarse:e} {fine:e}");
}

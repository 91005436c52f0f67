//! Blocks: sliding, sticking, tipping, carried, stacked, on a wedge; piles at the edge of equilibrium.

use nonsmooth_scenes::{Polyhedron, Rotation};
use nonsmooth_simulate::{
    Body, BodyId, Control, Law, MoreauJean, Motion, Part, Shape, Simulation, StepReport, World,
};

use crate::verification::{G, ball, block, near, omega, run, simulation, v, world, x};

const HALF: [f64; 3] = [0.5, 0.4, 0.1];

#[test]
fn a_block_slides_to_its_stop_and_never_lifts() {
    let (speed, mu) = (3.0, 0.6);
    let a = mu * G;
    let (far, time) = (0.5 * speed * speed / a, speed / a);
    near(far, 0.764525993884, 1e-12);
    near(time, 0.509683995923, 1e-12);
    // Errors of the place, to two digits.
    for (theta, h, error) in [
        (0.5, 1e-2, 9.0e-6),
        (0.5, 5e-3, 4.4e-6),
        (0.5, 1e-3, 6.4e-7),
        (1.0, 1e-2, -1.5e-2),
        (1.0, 5e-3, -7.5e-3),
        (1.0, 1e-3, -1.5e-3),
    ] {
        let mut world = world(mu, 0.0);
        world.add(Body::floor());
        let b = block(HALF).at([0.0, 0.0, HALF[2]]).moving([speed, 0.0, 0.0], [0.0; 3]);
        let b = world.add(b);
        let scheme = MoreauJean { theta, ..MoreauJean::default() };
        let mut simulation = Simulation::new(world, scheme).unwrap();
        let (mut lift, mut moving): (f64, f64) = (0.0, 0.0);
        let mut watch = |s: &Simulation, _: &StepReport| {
            if v(s, b)[0] > 1e-9 {
                moving = s.state().t;
            }
            lift = lift.max((s.state().position[b.index()][2] - HALF[2]).abs());
            Control::Continue
        };
        crate::verification::check(&simulation.run(1.0, h, &mut watch).unwrap());
        // What is left of the last step, f of one, brings it too far by a h² (f − f²)/2; at θ = 1 each step takes what it has lost already.
        let f = (time / h).fract();
        let late = 0.5 * a * h * h * (f - f * f);
        let expected = late - (2.0 * theta - 1.0) * 0.5 * speed * h;
        near(x(&simulation, b)[0] - far, expected, 2e-11);
        near(expected, error, 0.02 * error.abs());
        near(moving, time, h);
        assert!(lift < 1e-10, "{lift:e}");
        assert!(v(&simulation, b)[0].abs() < 1e-11);
    }
}

/// A block on an incline of slope tan α, for a second.
fn on_an_incline(mu: f64, slope: f64, half: [f64; 3]) -> (Simulation, BodyId) {
    let mut world = world(mu, 0.0);
    let c = 1.0 / (1.0 + slope * slope).sqrt();
    world.gravity = [G * slope * c, 0.0, -G * c];
    world.add(Body::floor());
    let b = world.add(block(half).at([0.0, 0.0, half[2]]));
    let mut simulation = simulation(world);
    run(&mut simulation, 1.0, 2e-3);
    (simulation, b)
}

#[test]
fn a_block_on_an_incline_sticks_without_creep_or_slides() {
    let mu = 0.5;
    for slope in [0.3, mu * (1.0 - 1e-6)] {
        let (simulation, b) = on_an_incline(mu, slope, HALF);
        near(v(&simulation, b)[0], 0.0, 1e-12);
        // The first steps rest to the solver's tolerance only: 1e-9 m/s at most, for 14 ms.
        near(x(&simulation, b)[0], 0.0, 2e-11);
    }
    let slope: f64 = 0.7;
    let (simulation, b) = on_an_incline(mu, slope, HALF);
    let c = 1.0 / (1.0 + slope * slope).sqrt();
    near(v(&simulation, b)[0], G * c * (slope - mu), 1e-10);
    near(x(&simulation, b)[0], 0.5 * G * c * (slope - mu), 1e-10);
}

#[test]
fn a_block_topples_beyond_its_width_over_its_height() {
    // Half width 0.1, half height 0.2: at tan α = ½ the lower edge carries everything.
    let half = [0.1, 0.1, 0.2];
    let (simulation, b) = on_an_incline(2.0, 0.5 * (1.0 - 1e-4), half);
    assert!(omega(&simulation, b)[1].abs() < 1e-10);
    let (simulation, b) = on_an_incline(2.0, 0.5 * (1.0 + 1e-3), half);
    assert!(omega(&simulation, b)[1] > 1e-2);
    let (simulation, b) = on_an_incline(2.0, 0.5, half);
    let carried = |upper: bool| {
        let side = move |c: &&nonsmooth_simulate::ContactReport| (c.point[0] < 0.0) == upper;
        simulation.contacts().iter().filter(side).map(|c| c.impulse[0]).sum::<f64>()
    };
    assert!(omega(&simulation, b)[1].abs() < 1e-9);
    assert!(carried(true) < 1e-8 * carried(false));
}

#[test]
fn a_conveyor_takes_a_block_to_its_speed() {
    let (speed, mu) = (2.0, 0.3);
    let mut world = world(mu, 0.0);
    let motion = Motion::Surface { linear: [speed, 0.0, 0.0], angular: [0.0; 3] };
    world.add(Body { motion, ..Body::floor() });
    let b = world.add(block(HALF).at([0.0, 0.0, HALF[2]]));
    let mut simulation = simulation(world);
    let h = 1e-3;
    let mut reached = 0.0;
    let mut watch = |s: &Simulation, _: &StepReport| {
        if s.state().velocity[b.index()][0] < speed - 1e-9 {
            reached = s.state().t;
        }
        Control::Continue
    };
    crate::verification::check(&simulation.run(1.0, h, &mut watch).unwrap());
    near(reached, 0.679578661230, h);
    near(v(&simulation, b)[0], speed, 1e-11);
    near(speed - x(&simulation, b)[0], 0.679578661230, 2e-6);
}

/// The sum of the normal impulses between two bodies.
fn carried(simulation: &Simulation, a: BodyId, b: BodyId) -> f64 {
    let of = simulation.contacts().iter().filter(|c| (c.a, c.b) == (a, b));
    of.map(|c| c.impulse[0]).sum()
}

#[test]
fn every_interface_of_a_stack_carries_what_is_above_it() {
    // Forces as shares of the whole weight.
    for (count, ratio, within, drift) in [
        (10_usize, 1.0, 1e-12, 1e-12),
        // Velocities within the tolerance of a step's load may come to 1.5e-11 in all steps.
        (3, 1e6, 2e-9, 3e-12),
        (3, 1e-6, 1e-10, 1e-12),
    ] {
        let mut world = world(0.5, 0.0);
        let mut ids = vec![world.add(Body::floor())];
        let mut masses = vec![];
        for k in 0..count {
            let mass: f64 = if k + 1 == count { ratio } else { 1.0 };
            let density = mass / (8.0 * HALF[0] * HALF[1] * HALF[2]);
            let body = Body::solid(Shape::Box { half: HALF }, density).unwrap();
            let z = HALF[2] * (2.0 * k as f64 + 1.0);
            ids.push(world.add(body.at([0.0, 0.0, z])));
            masses.push(mass);
        }
        let start = world.clone();
        // Beyond that rounding decides.
        let tolerance = if ratio > 1.0 { 1e-9 } else { 1e-10 };
        let total: f64 = masses.iter().sum();
        let mut simulation = simulation(world).with_tolerance(tolerance);
        let h = 5e-3;
        for step in 0..60 {
            let report = simulation.step(h).unwrap();
            assert!(report.status.is_solved(), "{count} {ratio} {report:?}");
            assert!(report.energy.relative_imbalance() < 1e-12, "{report:?}");
            assert_eq!(report.counts.active, 4 * count);
            assert!(step == 0 || report.counts.warm == 4 * count);
            for k in 0..count {
                let above: f64 = masses[k..].iter().sum();
                let force = carried(&simulation, ids[k], ids[k + 1]) / h;
                near(force / (total * G), above / total, within);
            }
        }
        for (k, body) in start.bodies.iter().enumerate() {
            (0..3).for_each(|i| near(simulation.state().position[k][i], body.position[i], drift));
        }
    }
}

#[test]
fn a_block_drives_the_wedge_from_under_it() {
    let alpha = 30f64.to_radians();
    let (wide, depth) = (2.0, 0.5);
    let tall = wide * alpha.tan();
    let mut world = world(0.0, 0.0);
    world.add(Body::floor());
    // Its slope goes down to the right.
    let base = [[0.0, -depth, 0.0], [wide, -depth, 0.0], [0.0, -depth, tall]];
    let wedge = Polyhedron::prism(&base, [0.0, 2.0 * depth, 0.0]).unwrap();
    let wedge = Body::solid(wedge, 2.0 / (0.5 * wide * tall * 2.0 * depth)).unwrap();
    near(wedge.mass, 2.0, 1e-12);
    let wedge = world.add(wedge);
    let (half, along) = (0.1, 0.7);
    // On the slope, its centre `half` above it.
    let (s, c) = alpha.sin_cos();
    let centre = [along * c + half * s, 0.0, tall - along * s + half * c];
    let rotation = Rotation::about([0.0, 1.0, 0.0], alpha);
    let b = world.add(block([0.2, 0.2, half]).at(centre).turned(rotation));
    let mut simulation = simulation(world);
    let (h, until) = (2e-3, 0.3);
    run(&mut simulation, until, h);
    let a = 1.887935380250;
    near(v(&simulation, wedge)[0], -a * until, 1e-9);
    near(x(&simulation, wedge)[0] - wide / 3.0, -0.5 * a * until * until, 1e-9);
    // Relative to the wedge, along the slope.
    let (p, q) = (v(&simulation, b), v(&simulation, wedge));
    near((p[0] - q[0]) * c - p[2] * s, 6.54 * until, 1e-8);
    near(carried(&simulation, wedge, b) / h, 7.551741521, 1e-8);
}

#[test]
fn three_logs_rest_or_fall_apart() {
    let critical = 15f64.to_radians().tan();
    let floor = critical / 3.0;
    near(critical, 0.267949192431, 1e-12);
    near(floor, 0.089316397477, 1e-12);
    let rests = |between: f64, below: f64| {
        let mut world = World::new([0.0, 0.0, -G]).with_law(Law::friction(between));
        let ground = world.material("ground");
        world.pair(0, ground, Law::friction(below));
        world.add(Body::floor().of(ground));
        let r = 0.2;
        let log = Body::solid(Shape::Capsule { half_length: 0.5, radius: r }, 1000.0).unwrap();
        let lying = Rotation::about([1.0, 0.0, 0.0], std::f64::consts::FRAC_PI_2);
        for at in [[-r, 0.0, r], [r, 0.0, r], [0.0, 0.0, r * (1.0 + 3f64.sqrt())]] {
            world.add(log.clone().turned(lying).at(at));
        }
        let mut simulation = simulation(world);
        let h = 5e-3;
        run(&mut simulation, 0.5, h);
        let fallen = r * (1.0 + 3f64.sqrt()) - simulation.state().position[3][2];
        assert!(!(1e-9..=1e-6).contains(&fallen), "{fallen:e}");
        if fallen < 1e-9 {
            // The lower logs press on each other with P only as far as friction goes beyond what is needed. With F at both contacts of a lower one and N at the upper,
            // F (1 + cos 30°) = N sin 30° + P.
            let pressed = carried(&simulation, BodyId(1), BodyId(2)) / h;
            let weight = simulation.world().bodies[3].mass * G;
            let (upper, lower) = (0.5 * weight, 1.5 * weight);
            let spare = ((between - critical) * upper).min((below - floor) * lower);
            let most = spare * (1.0 + 30f64.to_radians().cos());
            assert!(pressed < 1.01 * most, "{pressed:e} {most:e}");
        }
        fallen < 1e-9
    };
    assert!(rests(critical + 1e-4, 0.5) && rests(0.5, floor + 1e-4));
    assert!(!rests(critical - 1e-4, 0.5) && !rests(0.5, floor - 1e-4));
}

#[test]
fn four_balls_rest_or_fall_apart() {
    let critical = (0.5 * (1.0 / 3f64.sqrt()).asin()).tan();
    let floor = 0.25 * critical;
    near(critical, 0.317837245196, 1e-12);
    near(floor, 0.079459311299, 1e-12);
    let rests = |between: f64, below: f64| {
        let mut world = World::new([0.0, 0.0, -G]).with_law(Law::friction(between));
        let ground = world.material("ground");
        world.pair(0, ground, Law::friction(below));
        world.add(Body::floor().of(ground));
        let r = 0.2;
        let far = 2.0 * r / 3f64.sqrt();
        for k in 0..3 {
            let (s, c) = (f64::from(k) * std::f64::consts::TAU / 3.0).sin_cos();
            world.add(ball(r).at([far * c, far * s, r]));
        }
        let top = r + 2.0 * r * (2.0_f64 / 3.0).sqrt();
        world.add(ball(r).at([0.0, 0.0, top]));
        let mut simulation = simulation(world);
        let h = 5e-3;
        run(&mut simulation, 0.5, h);
        let fallen = top - simulation.state().position[4][2];
        assert!(!(1e-8..=1e-6).contains(&fallen), "{fallen:e}");
        if fallen < 1e-8 {
            // As with logs, no more than friction to spare.
            for (a, b) in [(1, 2), (2, 3), (1, 3)] {
                let pressed = carried(&simulation, BodyId(a), BodyId(b)) / h;
                assert!(pressed < 1e-4 * G, "{pressed:e}");
            }
        }
        fallen < 1e-8
    };
    assert!(rests(critical + 1e-4, 0.5) && rests(0.5, floor + 1e-4));
    assert!(!rests(critical - 1e-4, 0.5) && !rests(0.5, floor - 1e-4));
}

#[test]
fn a_tilted_column_overturns_as_one() {
    // n blocks of width b and height c each: tan α = b/(n c).
    let (b, c, n) = (0.2, 0.1, 4);
    let critical = b / (f64::from(n) * c);
    let stands = |slope: f64| {
        let mut world = world(2.0, 0.0);
        let k = 1.0 / (1.0 + slope * slope).sqrt();
        world.gravity = [G * slope * k, 0.0, -G * k];
        world.add(Body::floor());
        for i in 0..n {
            let z = c * (f64::from(i) + 0.5);
            world.add(block([0.5 * b, 0.5 * b, 0.5 * c]).at([0.0, 0.0, z]));
        }
        let mut simulation = simulation(world);
        run(&mut simulation, 1.0, 5e-3);
        let turned = simulation.state().spin[n as usize][1].abs();
        assert!(!(1e-8..=1e-4).contains(&turned), "{turned:e}");
        turned < 1e-8
    };
    assert!(stands(critical * (1.0 - 1e-3)) && !stands(critical * (1.0 + 1e-3)));
}

#[test]
fn prisms_of_every_number_of_sides_stand_on_each_other() {
    for sides in 5..=12 {
        let mut world = world(0.5, 0.0);
        world.add(Body::floor());
        let base: Vec<_> = (0..sides)
            .map(|k| {
                let (s, c) = (f64::from(k) * std::f64::consts::TAU / f64::from(sides)).sin_cos();
                [0.3 * c, 0.3 * s, 0.0]
            })
            .collect();
        let prism = Polyhedron::prism(&base, [0.0, 0.0, 0.2]).unwrap();
        let mut ids = vec![];
        for k in 0..3 {
            let turned = Rotation::about([0.0, 0.0, 1.0], 0.3 * f64::from(k));
            let body = Body::solid(prism.clone(), 500.0).unwrap();
            let z = body.position[2] + 0.2 * f64::from(k);
            ids.push(world.add(body.at([0.0, 0.0, z]).turned(turned)));
        }
        let slab = Part::new(Shape::Box { half: [0.5, 0.5, 0.05] });
        world.add(Body::composed(vec![(slab, 500.0)]).unwrap().at([0.0, 0.0, 0.65]));
        let mut simulation = simulation(world);
        run(&mut simulation, 0.5, 5e-3);
        for (k, id) in ids.iter().enumerate() {
            near(x(&simulation, *id)[2], 0.1 + 0.2 * k as f64, 1e-9);
            assert!(omega(&simulation, *id).iter().all(|w| w.abs() < 1e-9));
        }
        // All corners below, all crossings between prisms turned against each other, all corners of the top.
        let count = |a: u32, b: u32| {
            simulation.contacts().iter().filter(|c| (c.a.0, c.b.0) == (a, b)).count()
        };
        assert_eq!(count(0, 1), sides as usize);
        assert_eq!(count(1, 2), 2 * sides as usize);
        assert_eq!(count(3, 4), sides as usize);
    }
}

//! Limits of joints with restitution that are hit at the same time, or one after the other within a step: what is coupled through the masses must win no energy.

use nonsmooth_simulate::{
    Body, Coordinate, Dimension, Drive, Geometry, Impact, Joint, JointLimits, MoreauJean, Shape,
    World,
};

use crate::verification::{ACTIVATIONS, near, numbers, watched, weightless};

fn body(mass: f64) -> Body {
    let j = 0.02 * mass;
    let mut inertia = [[0.0; 3]; 3];
    (0..3).for_each(|k| inertia[k][k] = j * (1.0 + 0.1 * k as f64));
    Body::with_mass(mass, inertia, vec![])
}

fn limited(joint: Joint, along: Coordinate, [lower, upper]: [f64; 2], e: f64) -> Joint {
    let limits = Some(JointLimits { lower, upper, e });
    joint.driven(Drive { limits, ..Drive::along(along) })
}

/// Carts on one rail, each held by a stop on the one before it.
fn train(masses: &[f64], gaps: [f64; 2], e: f64) -> World {
    let mut world = World::new([0.0; 3]);
    let mut before = None;
    for (k, &mass) in masses.iter().enumerate() {
        let moving = body(mass).moving([-5.0, 0.0, 0.0], [0.0; 3]);
        let cart = world.add(moving);
        let joint = Joint::prismatic(before, cart, [0.0; 3], [1.0, 0.0, 0.0]);
        let gap = gaps[usize::from(k > 0)];
        world.join(limited(joint, Coordinate::Slide, [-gap, f64::INFINITY], e));
        before = Some(cart);
    }
    world
}

/// A cart between two stops, and rods that hang on one another from it between narrow limits, all moving with the cart.
fn linkage(rods: usize, dimension: Dimension, e: impl Fn(usize) -> f64, seed: u64) -> World {
    let mut random = numbers(seed);
    let mut world = World::new([0.0; 3]);
    world.dimension = dimension;
    let moving = |mass: f64| body(mass).moving([3.0, 0.0, 0.0], [0.0; 3]);
    let x = [1.0, 0.0, 0.0];
    let cart = world.add(moving(1.0 + random().abs()));
    let rail = Joint::prismatic(None, cart, [0.0; 3], x);
    world.join(limited(rail, Coordinate::Slide, [-0.03, 0.02], e(0)));
    let (mut before, mut at) = (cart, [0.0; 3]);
    for k in 0..rods {
        let turn = std::f64::consts::PI * random();
        let half = [0.15 * turn.cos(), 0.15 * turn.sin(), 0.0];
        let middle = [at[0] + half[0], at[1] + half[1], 0.0];
        let rod = world.add(moving((3.0 * random()).exp()).at(middle));
        let tilt = match dimension {
            Dimension::Two => [0.0; 2],
            Dimension::Three => [random(), random()],
        };
        let hinge = Joint::revolute(Some(before), rod, at, [tilt[0], tilt[1], 1.0]);
        let width = 0.05 * random().abs() + 0.01;
        world.join(limited(hinge, Coordinate::Angle, [-width, width], e(k + 1)));
        (before, at) = (rod, [middle[0] + half[0], middle[1] + half[1], 0.0]);
    }
    world
}

/// Kinetic energies after the steps, and the largest work of joints in one, as shares of the energy at the beginning.
fn energies(world: World, scheme: MoreauJean, until: f64) -> (Vec<f64>, f64) {
    let (mut all, mut most) = (vec![], f64::MIN);
    watched(world, scheme, until, |r| {
        all.push(r.energy.kinetic);
        most = most.max(r.energy.joints);
    });
    let whole = all[0];
    all.iter_mut().for_each(|e| *e /= whole);
    (all, most / whole)
}

/// The scene in which 4666 J came of 385: the second cart runs into its stop while the first one, in its own, comes back.
#[test]
fn carts_that_run_into_their_stops_one_after_the_other_win_no_energy() {
    for e in [0.0, 0.5, 0.7, 0.9, 1.0] {
        for impact in [Impact::Newton, Impact::Fremond] {
            for activation in ACTIVATIONS {
                for masses in [&[1.0, 1.0][..], &[1.0, 30.0], &[1.0, 30.0, 900.0], &[20.0, 1.0]] {
                    for gap in [2e-4, 3e-3] {
                        let scheme = MoreauJean { impact, activation, ..MoreauJean::default() };
                        let world = train(masses, [1.2e-3, gap], e);
                        let (_, most) = energies(world, scheme, 0.1);
                        assert!(most < 1e-12, "{e} {impact:?} {activation:?} {masses:?}: {most:e}");
                    }
                }
            }
        }
    }
}

/// Limits of one linkage with coefficients of their own.
#[test]
fn linkages_between_their_limits_win_no_energy() {
    for seed in 0..12 {
        for dimension in [Dimension::Two, Dimension::Three] {
            for geometry in [Geometry::Extrapolated, Geometry::Midpoint, Geometry::Frozen] {
                let e = |k: usize| [0.9, 0.2, 0.7, 1.0, 0.0][(k + seed as usize) % 5];
                let world = linkage(1 + seed as usize % 4, dimension, e, seed);
                let scheme = MoreauJean { geometry, ..MoreauJean::default() };
                let (_, most) = energies(world, scheme, 0.2);
                assert!(most < 1e-7, "{seed} {dimension:?} {geometry:?}: {most:e}");
            }
        }
    }
}

/// With e = 1 everywhere a linkage keeps its energy whatever limits it runs into at the same time, up to what the projection of velocities takes after impacts.
#[test]
fn a_linkage_with_elastic_limits_keeps_its_energy() {
    for seed in 0..6 {
        let world = linkage(1 + seed as usize % 4, Dimension::Two, |_| 1.0, seed);
        let scheme = MoreauJean { geometry: Geometry::Midpoint, ..MoreauJean::default() };
        let (all, _) = energies(world, scheme, 0.3);
        let last = *all.last().unwrap();
        near(last, 1.0, 1e-2);
    }
}

/// A contact and a limit in one island: a ball falls on a lid that comes back from its stop.
#[test]
fn a_ball_on_a_lid_that_comes_back_from_its_stop_wins_no_energy() {
    for e in [0.5, 0.7, 0.9, 1.0] {
        for (gap, mass) in [(2e-4, 1.0), (1e-3, 30.0), (3e-3, 30.0), (3e-3, 200.0)] {
            let mut world = weightless(0.0, e);
            let lid = Body::solid(Shape::Box { half: [0.5, 0.3, 0.02] }, 100.0).unwrap();
            let lid = world.add(lid.moving([0.0; 3], [0.0, 8.0, 0.0]));
            let hinge = Joint::revolute(None, lid, [0.0; 3], [0.0, 1.0, 0.0]);
            world.join(limited(hinge, Coordinate::Angle, [-1.0, 3e-3], e));
            let mut ball = crate::verification::ball_with(0.1, 0.004 * mass);
            ball.mass = mass;
            world.add(ball.at([0.4, 0.0, 0.12 + gap]).moving([0.0, 0.0, -3.2], [0.0; 3]));
            let (mut most, mut whole) = (f64::MIN, 0.0_f64);
            watched(world, MoreauJean::default(), 0.1, |r| {
                let e = r.energy;
                whole = whole.max(e.kinetic_before);
                most = most.max(e.normal + e.tangential + e.joints);
            });
            assert!(most < 1e-12 * whole, "{e} {gap} {mass}: {most:e} of {whole}");
        }
    }
}

//! Contacts that open after an impact, and are pressed by another one before they are out of the index set.

use nonsmooth_simulate::{Body, BodyId, Impact, MoreauJean, Shape, Simulation, World};

use crate::verification::{
    ACTIVATIONS, ball_with, check, near, numbers, v, watched, weightless, world, x,
};

const R: f64 = 0.1;

fn heavy(mass: f64) -> Body {
    let j = 0.4 * mass * R * R;
    let mut body = ball_with(R, j);
    body.mass = mass;
    body
}

/// Balls one over the other over a floor, a gap below each, all with the same velocity.
fn chain(mut world: World, masses: &[f64], gaps: [f64; 2], speed: f64) -> World {
    world.add(Body::floor());
    for (k, &mass) in masses.iter().enumerate() {
        let z = R + gaps[0] + k as f64 * (2.0 * R + gaps[1]);
        world.add(heavy(mass).at([0.0, 0.0, z]).moving([0.0, 0.0, -speed], [0.0; 3]));
    }
    world
}

/// Runs for a time; the largest gain of energy by contacts in a step, as a share of the energy at the beginning, and the deepest penetration.
fn most_gained(world: World, scheme: MoreauJean, until: f64) -> (f64, f64) {
    let (mut most, mut deepest, mut whole) = (f64::MIN, 0.0_f64, 0.0_f64);
    watched(world, scheme, until, |r| {
        let e = r.energy;
        whole = whole.max(e.kinetic_before);
        most = most.max(e.kinetic - e.kinetic_before - e.gravity - e.forces);
        deepest = deepest.max(r.drift.penetration);
    });
    (most / whole, deepest)
}

/// A heavy ball hits a light one that comes back from the floor, while this is still in its contact: what pressed it must not win energy.
#[test]
fn a_rebounding_ball_that_is_hit_wins_no_energy() {
    for e in [0.0, 0.5, 0.7, 0.9, 0.95, 1.0] {
        for impact in [Impact::Newton, Impact::Fremond] {
            for activation in ACTIVATIONS {
                for masses in [&[1.0, 1.0][..], &[1.0, 10.0], &[1.0, 30.0, 900.0], &[20.0, 1.0]] {
                    let scheme = MoreauJean { impact, activation, ..MoreauJean::default() };
                    let world = chain(weightless(0.0, e), masses, [1.2e-3, 1e-3], 5.0);
                    let (most, deepest) = most_gained(world, scheme, 0.2);
                    assert!(most < 1e-12, "{e} {impact:?} {activation:?} {masses:?}: {most:e}");
                    // No ball leaves through the floor.
                    assert!(deepest < 2.0 * R, "{e} {activation:?} {masses:?}: {deepest}");
                }
            }
        }
    }
}

/// Two balls fall from 1 m, one close over the other: the scene where 46 J came of nothing. Without weight nothing is gained; with it as much as a step's fall lifts.
#[test]
fn balls_that_fall_together_rise_no_higher() {
    for e in [0.5, 0.7, 0.9, 0.95, 1.0] {
        let world = chain(world(0.0, e), &[4.0, 4.0], [1.0, 1e-3], 0.0);
        let (most, deepest) = most_gained(world, MoreauJean::default(), 2.0);
        assert!(most < 1e-5, "{e}: {most:e}");
        assert!(deepest < 1e-2, "{e}: {deepest}");
    }
}

/// Contacts with and without restitution in one step: the blocks rest with e = 0, what falls on them rebounds.
#[test]
fn hail_on_blocks_wins_no_energy() {
    let mut world = weightless(0.0, 0.0);
    let hail = world.material("hail");
    for other in [0, hail] {
        world.pair(other, hail, nonsmooth_simulate::Law { mu: 0.0, e: 0.9, e_t: 0.0, mu_r: 0.0 });
    }
    world.add(Body::floor());
    let half = [0.2, 0.2, 0.05];
    for z in [0.05, 0.15] {
        world.add(Body::solid(Shape::Box { half }, 300.0).unwrap().at([0.0, 0.0, z]));
    }
    for k in 0..18 {
        let across = |k: usize| 0.12 * ((k % 3) as f64 - 1.0);
        let z = 0.32 + 0.21 * (k / 9) as f64;
        let mut body = heavy(if k % 2 == 0 { 0.3 } else { 3.0 });
        body.parts[0].shape = Shape::Sphere { radius: 0.05 };
        body.parts[0].material = hail;
        let at = [across(k) + 1e-3 * k as f64, across(k / 3), z];
        world.add(body.at(at).moving([0.3, -0.2, -4.0], [0.0; 3]));
    }
    let (most, _) = most_gained(world, MoreauJean::default(), 0.3);
    // Blocks that rest have their velocities where they come to, to first order of a step.
    assert!(most < 1e-4, "{most:e}");
}

/// With e = 1 and no friction a gas keeps its energy whatever touches at the same time.
#[test]
fn an_elastic_gas_keeps_its_energy() {
    let mut world = weightless(0.0, 1.0);
    for d in 0..3 {
        for s in [-1.0, 1.0] {
            let mut half = [0.6; 3];
            half[d] = 0.1;
            let mut at = [0.0; 3];
            at[d] = 0.45 * s;
            let part = nonsmooth_simulate::Part::new(Shape::Box { half });
            world.add(Body::fixed(vec![part]).at(at));
        }
    }
    let mut random = numbers(1);
    for k in 0..27 {
        let at = [k % 3, k / 3 % 3, k / 9].map(|k| 0.21 * (f64::from(k) - 1.0));
        let velocity = [4.0 * random(), 4.0 * random(), 4.0 * random()];
        let mass = if k % 2 == 0 { 1.0 } else { 10.0 };
        world.add(heavy(mass).at(at).moving(velocity, [0.0; 3]));
    }
    let mut energies = vec![];
    check(&watched(world, MoreauJean::default(), 0.5, |r| energies.push(r.energy.kinetic)));
    energies.iter().for_each(|&e| near(e / energies[0], 1.0, 1e-9));
}

/// What rests with restitution stays at rest, and does not sink.
#[test]
fn a_stack_with_restitution_stays_at_rest() {
    for e in [0.0, 0.5, 0.9] {
        let mut simulation = Simulation::new(
            chain(world(0.3, e), &[1.0, 10.0, 1.0], [0.0, 0.0], 0.0),
            MoreauJean::default(),
        )
        .unwrap();
        let report = simulation.run(1.0, 1e-3, &mut ()).unwrap();
        assert!(report.is_solved(), "{report}");
        for k in 0..3 {
            let top = BodyId(1 + k);
            near(x(&simulation, top)[2], R + 2.0 * R * f64::from(k), 2e-5);
            near(v(&simulation, top)[2], 0.0, 2e-2);
        }
    }
}

/// What moves so slowly that the squares of its velocity are no normal numbers is at rest.
#[test]
fn balls_slower_than_their_energy_can_say_rest() {
    for speed in [1e-60, 1e-90, 1e-140, 1e-160, 1e-191, 1e-300, f64::MIN_POSITIVE, 5e-324] {
        let world = chain(weightless(0.3, 0.5), &[1.0, 2.0], [0.0, 0.0], speed);
        let mut simulation = Simulation::new(world, MoreauJean::default()).unwrap();
        let report = simulation.run(0.01, 1e-3, &mut ()).unwrap();
        assert!(report.is_solved(), "{speed:e}: {report}");
        assert!(v(&simulation, BodyId(1))[2].abs() <= speed);
    }
}

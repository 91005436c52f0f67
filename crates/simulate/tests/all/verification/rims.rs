//! Cylinders, coins and cones that land on an end: the lowest point of a rim jumps across where the end turns past level.

use nonsmooth_scenes::Rotation;
use nonsmooth_simulate::{Body, BodyId, Control, MoreauJean, Part, Shape, Simulation, StepReport};

use crate::verification::{v, world, x};

const ROUND: [Shape; 3] = [
    Shape::Cylinder { half_length: 0.1, radius: 0.1 },
    Shape::Cylinder { half_length: 0.01, radius: 0.1 },
    Shape::Cone { half_length: 0.1, radius: 0.1 },
];

/// Drops a body on a fixed one whose top is at height `top`; the largest gain of energy in a step as a share of the largest kinetic energy.
fn most_gained(body: Body, on: (Shape, f64), mu: f64, scheme: MoreauJean, h: f64) -> f64 {
    let mut world = world(mu, 0.0);
    world.add(Body::fixed(vec![Part::new(on.0)]).at([0.0, 0.0, -on.1]));
    world.add(body);
    let mut simulation = Simulation::new(world, scheme).unwrap();
    let (mut most, mut whole) = (f64::MIN, 0.0_f64);
    let mut watch = |_: &Simulation, r: &StepReport| {
        let e = r.energy;
        whole = whole.max(e.kinetic);
        most = most.max(e.kinetic - e.kinetic_before - e.gravity);
        Control::Continue
    };
    let report = simulation.run(0.6, h, &mut watch).unwrap();
    assert!(report.is_solved(), "{report}");
    let body = BodyId(1);
    assert!(x(&simulation, body)[2] > 0.0, "{:?} {:?}", x(&simulation, body), v(&simulation, body));
    most / whole
}

/// The scene in which 138 J came of 2 J, and others like it.
#[test]
fn what_lands_on_an_end_wins_no_energy() {
    for on in [(Shape::Plane, 0.0), (Shape::Box { half: [0.4, 0.4, 0.1] }, 0.1)] {
        for shape in ROUND {
            for (angle, mu) in [(0.0, 0.5), (0.02, 0.5), (0.1, 0.5), (0.3, 0.5), (0.3, 0.0)] {
                for (theta, h) in [(0.5, 1e-3), (1.0, 1e-3), (0.5, 2e-4)] {
                    let body = Body::solid(shape.clone(), 1000.0).unwrap();
                    let z = 0.15 + body.position[2];
                    let axis = [1.0, 0.3, 0.0].map(|k: f64| k / 1.09_f64.sqrt());
                    let turn = Rotation::about(axis, angle);
                    let body = body.turned(turn).at([0.005, 0.003, z]);
                    let scheme = MoreauJean { theta, ..MoreauJean::default() };
                    let most = most_gained(body, on.clone(), mu, scheme, h);
                    let on = on.0.name();
                    assert!(most < 1e-3, "{on} {shape:?} {angle} {mu} {theta} {h}: {most:e}");
                }
            }
        }
    }
}

/// Ends on ends, level and tilted, with and without friction.
#[test]
fn an_end_that_lands_on_an_end_wins_no_energy() {
    let below = Shape::Cylinder { half_length: 0.1, radius: 0.1 };
    for shape in ROUND {
        for (angle, mu) in [(0.0, 0.0), (0.0, 0.5), (0.1, 0.5)] {
            let body = Body::solid(shape.clone(), 1000.0).unwrap();
            let z = 0.15 + body.position[2];
            let body = body.turned(Rotation::about([1.0, 0.0, 0.0], angle)).at([0.02, 0.01, z]);
            let most = most_gained(body, (below.clone(), 0.1), mu, MoreauJean::default(), 1e-3);
            assert!(most < 1e-3, "{shape:?} {angle} {mu}: {most:e}");
        }
    }
}

/// A coin that rolls round on its rim, ever flatter, loses energy only.
#[test]
fn a_wobbling_coin_comes_to_rest() {
    let shape = Shape::Cylinder { half_length: 0.01, radius: 0.1 };
    let body = Body::solid(shape, 1000.0).unwrap();
    let body = body.turned(Rotation::about([0.0, 1.0, 0.0], 0.3)).at([0.0, 0.0, 0.045]);
    let mut world = world(0.5, 0.0);
    world.add(Body::floor());
    let coin = world.add(body.moving([0.0; 3], [0.5, 0.0, 3.0]));
    let mut simulation = Simulation::new(world, MoreauJean::default()).unwrap();
    let mut most = f64::MIN;
    let mut watch = |_: &Simulation, r: &StepReport| {
        let e = r.energy;
        most = most.max((e.kinetic - e.kinetic_before - e.gravity) / e.kinetic.max(1e-3));
        Control::Continue
    };
    let report = simulation.run(2.0, 1e-3, &mut watch).unwrap();
    assert!(report.is_solved(), "{report}");
    assert!(most < 5e-3, "{most:e}");
    assert!((x(&simulation, coin)[2] - 0.01).abs() < 2e-3, "{:?}", x(&simulation, coin));
}

//! Bodies that overlap: at the start, where they are refused or moved apart, and in the course of a run.

use nonsmooth_scenes::{Polyhedron, Rotation};
use nonsmooth_simulate::{
    Body, MoreauJean, Shape, SimulateError, Simulation, StepStatus, World, plane,
};
use rand::{RngExt, SeedableRng};

use crate::verification::{G, ball, check, near, simulation, weightless, world, x};

#[test]
fn two_balls_are_moved_apart_by_their_masses() {
    // The smallest displacement in the norm of the masses: 3 to 1, and nothing more than the overlap.
    let mut world = weightless(0.0, 0.0);
    let light = world.add(ball(0.1).at([0.0; 3]));
    let heavy = world.add(Body { mass: 3.0, ..ball(0.1) }.at([0.16, 0.0, 0.0]));
    let refused = Simulation::new(world.clone(), MoreauJean::default()).err().unwrap();
    assert!(
        matches!(&refused, SimulateError::Overlap(pairs) if (pairs[0].depth - 0.04).abs() < 1e-15)
    );
    let (simulation, settled) = Simulation::settled(world, MoreauJean::default()).unwrap();
    near(x(&simulation, light)[0], -0.03, 1e-7);
    near(x(&simulation, heavy)[0], 0.17, 1e-7);
    assert_eq!((settled.pairs, settled.rounds), (1, 1));
    near(settled.depth, 0.04, 1e-15);
    near(settled.moved, 0.03, 1e-7);
    assert_eq!(simulation.state().velocity, [[0.0; 3]; 2]);
}

/// A box that falls on its equal, tilted a little, ends on it, at most about a step of its fall deep: edges that cross hide no faces that nearly lie on each other.
#[test]
fn a_box_that_falls_on_a_box_ends_on_it() {
    const H: f64 = 2e-3;
    let mut rng = rand_pcg::Pcg64::seed_from_u64(3);
    let half = [0.1, 0.1, 0.05];
    for drop in 0..12 {
        let mut any = |most: f64| rng.random_range(-most..most);
        let mut world = world(0.4, 0.0);
        world.add(Body::floor());
        let solid = || Body::solid(Shape::Box { half }, 1000.0).unwrap();
        world.add(solid().at([0.0, 0.0, 0.05]));
        let tilt = Rotation::about([any(1.0), any(1.0), 0.1], 0.12);
        let turn = tilt.after(Rotation::about([0.0, 0.0, 1.0], any(0.9)));
        let upper = world.add(solid().turned(turn).at([any(0.02), any(0.02), 0.21]));
        let mut simulation = simulation(world);
        let report = simulation.run(1.5, H, &mut ()).unwrap();
        assert!(report.is_solved() && report.deep == 0, "{drop}: {report}");
        let speed = (2.0 * G * 0.06_f64).sqrt();
        let z = x(&simulation, upper)[2];
        assert!((z - 0.15).abs() <= 2.0 * H * speed, "{drop}: {z}");
    }
}

#[test]
fn a_heap_of_solids_thrown_together_is_sorted_out() {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(6);
    let mut world = world(0.4, 0.0);
    world.add(Body::floor());
    for k in 0..60 {
        let shape = match k % 4 {
            0 => Shape::Sphere { radius: 0.15 },
            1 => Shape::Box { half: [0.15, 0.1, 0.12] },
            2 => Shape::Capsule { half_length: 0.15, radius: 0.08 },
            _ => Shape::Cylinder { half_length: 0.12, radius: 0.12 },
        };
        let mut any = |most: f64| rng.random_range(-most..most);
        let turn = Rotation::about([any(1.0), any(1.0), any(1.0)], any(3.0));
        let at = [any(0.5), any(0.5), 0.6 + any(0.6)];
        world.add(Body::solid(shape, 1000.0).unwrap().turned(turn).at(at));
    }
    let (mut simulation, settled) = Simulation::settled(world, MoreauJean::default()).unwrap();
    assert!(settled.pairs > 50 && settled.rounds < 50, "{settled:?}");
    let report = simulation.run(0.05, 1e-3, &mut ()).unwrap();
    assert!(report.is_solved() && report.deep == 0, "{report:?}");
}

#[test]
fn what_has_no_room_stays_an_error() {
    let mut world = World::new([0.0, 0.0, -G]);
    world.add(Body::floor());
    world.add(Body::fixed(vec![plane([0.0, 0.0, 0.15], [0.0, 0.0, -1.0]).unwrap()]));
    world.add(ball(0.1).at([0.0, 0.0, 0.08]).named("marble"));
    let error = Simulation::settled(world, MoreauJean::default()).err().unwrap().to_string();
    assert!(
        error.starts_with("bodies overlap at the start: ") && error.contains("`marble`"),
        "{error}"
    );
}

#[test]
fn what_is_deep_inside_keeps_the_normal_that_it_had() {
    let mut world = weightless(0.0, 0.0);
    world.add(Body::fixed(vec![nonsmooth_simulate::Part::new(Shape::Sphere { radius: 1.0 })]));
    let b = world.add(ball(0.5).at([0.0, 0.0, 1.5]));
    let mut simulation = simulation(world);
    let first = simulation.step(1e-3).unwrap();
    assert_eq!((first.status.clone(), first.counts.deep), (StepStatus::Solved, 0));
    // Through the centre of the other: the nearest way out would be downwards.
    simulation.state_mut().position[b.index()] = [0.0, 0.0, -0.2];
    simulation.state_mut().velocity[b.index()] = [0.0, 0.0, -1.0];
    let report = simulation.run(2e-3, 1e-3, &mut ()).unwrap();
    check(&report);
    assert_eq!((report.deep, report.first_deep), (1, Some(2e-3)));
    let contact = simulation.contacts()[0];
    near(contact.frame[0][2], 1.0, 1e-12);
    near(contact.impulse[0], 1.0, 1e-9);
}

/// Two pyramids cut off near their tips, on each other with the small faces that are left: nothing else separates them.
#[test]
fn bodies_that_touch_with_a_small_face_do_not_overlap() {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(3);
    for cut in [1e-2, 1e-4, 5e-6, 3e-6, 1e-7] {
        for _ in 0..20 {
            let mut world = weightless(0.3, 0.0);
            for side in [-1.0, 1.0] {
                let first = rng.random_range(0.0..std::f64::consts::TAU);
                let radius = rng.random_range(0.5..3.0);
                let mut vertices: Vec<[f64; 3]> = vec![];
                for k in 0..3 {
                    let turn = first + 2.094 * f64::from(k) + rng.random_range(-0.4..0.4);
                    vertices.push([radius * f64::cos(turn), radius * f64::sin(turn), side]);
                }
                let share = cut / (1.0 + cut);
                for k in 0..3 {
                    vertices.push([share * vertices[k][0], share * vertices[k][1], 0.0]);
                }
                let mut faces = vec![
                    vec![2, 1, 0],
                    vec![3, 4, 5],
                    vec![0, 1, 4, 3],
                    vec![1, 2, 5, 4],
                    vec![2, 0, 3, 5],
                ];
                if side > 0.0 {
                    faces.iter_mut().for_each(|f| f.reverse());
                }
                let solid = Polyhedron::new(vertices, faces).unwrap();
                world.add(Body::solid(solid, 1.0).unwrap());
            }
            let made = Simulation::new(world, MoreauJean::default());
            assert!(made.is_ok(), "{cut:e}: {}", made.err().unwrap());
        }
    }
}

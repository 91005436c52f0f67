//! Worlds in the plane: known motions, and the same worlds in space with a planar joint for each body.

use std::f64::consts::PI;

use nonsmooth_problem::Friction;
use nonsmooth_scenes::Rotation;
use nonsmooth_simulate::{
    Body, BodyId, Control, Coordinate, Drive, Joint, JointKind, JointLimits, Law, MoreauJean,
    Motor, Part, Polygon, Shape, Simulation, State, StepReport, StepStatus, World, Wrenches, plane,
};

use crate::verification::{G, frozen, near, omega, run, simulation, v, x};

fn flat(mu: f64, e: f64) -> World {
    World::in_plane([0.0, -G]).with_law(Law { mu, e, ..Law::default() })
}

/// A rectangle of 1 kg.
fn block([a, b]: [f64; 2]) -> Body {
    Body::solid(Polygon::rectangle([a, b]).unwrap(), 1.0 / (4.0 * a * b)).unwrap()
}

fn disc(radius: f64) -> Body {
    Body::solid(Shape::Disc { radius }, 1.0 / (PI * radius * radius)).unwrap()
}

fn about(angle: f64) -> Rotation {
    Rotation::about([0.0, 0.0, 1.0], angle)
}

#[test]
fn the_problem_of_a_step_in_the_plane_has_two_rows_a_contact() {
    let mut world = flat(0.5, 0.0);
    world.add(Body::ground());
    world.add(block([0.2, 0.1]).at([0.0, 0.1, 0.0]));
    let mut s = simulation(world);
    let Some(Friction::Local2(problem)) = s.problem(1e-3).unwrap() else { panic!("not in 2D") };
    assert_eq!((problem.mu.len(), problem.q.len()), (2, 4));
    // W of a corner at (±a, −b): 1/m + a²/J and 1/m + b²/J.
    let j = (0.2 * 0.2 + 0.1 * 0.1) / 3.0;
    let w = problem.W.row(0).1[0];
    near(w[0][0], 1.0 + 0.04 / j, 1e-12);
    near(w[1][1], 1.0 + 0.01 / j, 1e-12);
    run(&mut s, 0.1, 1e-3);
    let report = s.step(1e-3).unwrap();
    assert_eq!((report.counts.active, report.counts.stick), (2, 2));
    for c in s.contacts() {
        near(c.impulse[0], 0.5e-3 * G, 1e-12);
        assert_eq!(c.frame[2], [0.0, 0.0, 1.0]);
        assert_eq!(c.impulse[2], 0.0);
    }
}

#[test]
fn a_disc_slides_and_then_rolls() {
    // v* = 2 v₀/3 from t* = v₀/(3 mu g) on, for J = m R²/2.
    let (mu, speed, radius) = (0.2, 1.0, 0.1);
    let mut world = flat(mu, 0.0);
    world.add(Body::ground());
    let b = world.add(disc(radius).at([0.0, radius, 0.0]).moving([speed, 0.0, 0.0], [0.0; 3]));
    let mut s = simulation(world);
    let until = speed / (3.0 * mu * G);
    run(&mut s, 0.9 * until, 1e-3);
    near(v(&s, b)[0], speed * (1.0 - 0.3), 1e-11);
    run(&mut s, 0.5, 1e-3);
    near(v(&s, b)[0], 2.0 * speed / 3.0, 1e-12);
    near(omega(&s, b)[2], -2.0 * speed / (3.0 * radius), 1e-11);
    let way = until * (speed + 2.0 * speed / 3.0) / 2.0 + (0.5 - until) * 2.0 * speed / 3.0;
    near(x(&s, b)[0], way, 1e-6);
}

#[test]
fn a_rocking_block_loses_what_housner_says() {
    for (a, c, mu, eta) in [(0.1, 0.4, 0.6, 0.911764705882), (0.2, 0.4, 0.8, 0.7)] {
        let mut world = World::in_plane([0.0; 2]).with_law(Law::friction(mu));
        world.add(Body::ground());
        // It turns about its left corner, with the right one about to come down.
        let turn = 1e-9;
        let (s0, c0) = f64::sin_cos(turn);
        let centre = [a * c0 - c * s0, a * s0 + c * c0, 0.0];
        let spin = -1.0;
        let velocity = [-spin * centre[1], spin * centre[0], 0.0];
        let b = block([a, c]).at(centre).turned(about(turn));
        let b = world.add(b.moving(velocity, [0.0, 0.0, spin]));
        let mut s = simulation(world);
        s.step(1e-6).unwrap();
        near(omega(&s, b)[2], spin * eta, 1e-6);
    }
}

#[test]
fn a_force_across_the_plane_is_without_effect() {
    let mut world = flat(0.5, 0.0);
    world.add(Body::ground());
    let b = world.add(block([0.2, 0.1]).at([0.0, 0.5, 0.0]));
    let across = move |_: &State, w: &mut Wrenches| {
        w.force(b, [0.0, 0.0, 3.0]);
        w.torque(b, [1.0, 2.0, 0.0]);
    };
    let mut s = simulation(world).with_force(across);
    run(&mut s, 0.5, 1e-3);
    assert_eq!((x(&s, b)[2], v(&s, b)[2]), (0.0, 0.0));
    assert_eq!(omega(&s, b)[..2], [0.0; 2]);
    let nan = move |_: &State, w: &mut Wrenches| w.force(b, [0.0, 0.0, f64::NAN]);
    let mut s = s.with_force(nan);
    assert_eq!(s.step(1e-3).unwrap().status, StepStatus::NotFinite);
}

#[test]
fn a_block_slides_to_its_stop_in_the_plane_as_in_space() {
    let mut world = flat(0.6, 0.0);
    world.add(Body::ground());
    let b = world.add(block([0.5, 0.1]).at([0.0, 0.1, 0.0]).moving([3.0, 0.0, 0.0], [0.0; 3]));
    let mut s = simulation(world);
    run(&mut s, 1.0, 1e-3);
    near(x(&s, b)[0], 0.764525993884, 7e-7);
    near(x(&s, b)[1], 0.1, 1e-10);
}

/// A world of the plane with all that moves held in it by planar joints, discs as spheres and rectangles as boxes of the same mass and inertia.
fn in_space(flat: &World) -> World {
    let mut world = World::new(flat.gravity).with_law(flat.law);
    let mut planes = vec![];
    for body in &flat.bodies {
        let parts = body.parts.iter().map(|part| {
            let shape = match &part.shape {
                Shape::Disc { radius } => Shape::Sphere { radius: *radius },
                Shape::Stadium { half_length, radius } => {
                    Shape::Capsule { half_length: *half_length, radius: *radius }
                }
                Shape::Polygon(p) => {
                    let base: Vec<[f64; 3]> =
                        p.vertices().iter().map(|&[x, y]| [x, y, -0.05]).collect();
                    nonsmooth_scenes::Polyhedron::prism(&base, [0.0, 0.0, 0.1]).unwrap().into()
                }
                other => other.clone(),
            };
            let along = Rotation::about([0.0, 1.0, 0.0], PI / 2.0);
            let turned = match part.shape {
                Shape::Stadium { .. } => part.rotation.after(along),
                _ => part.rotation,
            };
            Part { shape, rotation: turned, ..part.clone() }
        });
        let id = world.add(Body { parts: parts.collect(), ..body.clone() });
        if body.is_free() {
            planes.push(Joint::new(JointKind::Planar, None, id, body.position));
        }
    }
    for joint in &flat.joints {
        world.join(joint.clone());
    }
    for joint in planes {
        world.join(joint);
    }
    world
}

/// How far the same world in the plane and in space come apart within a time, at steps of h. With geometry as it is at the beginning of a step the two schemes are
/// the same: else contacts of bodies with joints have one direction a step, and others two.
fn apart(world: World, until: f64, h: f64) -> f64 {
    let mut space = frozen(in_space(&world));
    let mut plane = frozen(world);
    let mut worst: f64 = 0.0;
    while plane.state().t < until - 0.5 * h {
        let (p, q) = (plane.step(h).unwrap(), space.step(h).unwrap());
        assert!(p.status.is_solved() && q.status.is_solved(), "{p:?} {q:?}");
        assert!(p.residual <= 1e-10 && p.energy.imbalance.abs() <= 1e-12 * p.energy.scale);
        assert_eq!(q.counts.active > 0, p.counts.active > 0);
        let (p, q) = (plane.state(), space.state());
        for k in 0..p.position.len() {
            for i in 0..3 {
                worst = worst.max((p.position[k][i] - q.position[k][i]).abs());
            }
            worst = worst.max((p.rotation[k][3] - q.rotation[k][3]).abs());
        }
    }
    worst
}

fn walls(world: &mut World, width: f64) {
    for (at, normal) in [(-width, 1.0), (width, -1.0)] {
        let side = plane([at, 0.0, 0.0], [normal, 0.0, 0.0]).unwrap();
        world.add(Body::fixed(vec![side]));
    }
}

#[test]
fn discs_in_the_plane_move_as_spheres_held_in_it() {
    let mut world = flat(0.3, 0.4);
    world.add(Body::ground());
    walls(&mut world, 1.0);
    for k in 0..8 {
        let (i, j) = (f64::from(k % 3), f64::from(k / 3));
        let body = disc(0.2).at([-0.6 + 0.55 * i + 0.13 * j, 0.4 + 0.5 * j, 0.0]);
        world.add(body.moving([1.0 - 0.5 * i, 0.3 * j, 0.0], [0.0, 0.0, 2.0 - i]));
    }
    let far = apart(world, 0.4, 2e-3);
    assert!(far < 1e-8, "{far:e}");
}

#[test]
fn blocks_in_the_plane_move_as_boxes_held_in_it() {
    let mut world = flat(0.5, 0.2);
    world.add(Body::ground());
    let table = Part::new(Polygon::rectangle([0.3, 0.05]).unwrap());
    world.add(Body::fixed(vec![table]).at([0.0, 0.4, 0.0]).turned(about(0.2)));
    world.add(block([0.2, 0.1]).at([0.1, 0.75, 0.0]).turned(about(0.4)));
    let hexagon: Vec<[f64; 2]> = (0..6)
        .map(|k| [0.15 * (f64::from(k) * PI / 3.0).cos(), 0.15 * (f64::from(k) * PI / 3.0).sin()])
        .collect();
    let hexagon = Body::solid(Polygon::new(&hexagon).unwrap(), 30.0).unwrap();
    world.add(hexagon.at([-0.7, 0.3, 0.0]).moving([1.0, 0.0, 0.0], [0.0, 0.0, 3.0]));
    let far = apart(world, 0.5, 1e-3);
    assert!(far < 1e-7, "{far:e}");
}

#[test]
fn capsules_in_the_plane_move_as_capsules_held_in_it() {
    let mut world = flat(0.4, 0.3);
    world.add(Body::ground());
    let rod = Shape::Stadium { half_length: 0.2, radius: 0.05 };
    let rod = |density: f64| Body::solid(rod.clone(), density).unwrap();
    world.add(rod(40.0).at([0.0, 0.4, 0.0]).turned(about(0.5)));
    world.add(rod(20.0).at([0.1, 0.7, 0.0]).turned(about(-0.3)));
    world.add(disc(0.1).at([-0.3, 0.6, 0.0]).moving([0.5, 0.0, 0.0], [0.0; 3]));
    let far = apart(world, 0.4, 1e-3);
    assert!(far < 1e-8, "{far:e}");
}

#[test]
fn mechanisms_in_the_plane_move_as_in_space() {
    let mut world = World::in_plane([0.0, -G]);
    let link = |at: f64| block([0.5, 0.05]).at([at, 0.0, 0.0]);
    let (a, b) = (world.add(link(0.5)), world.add(link(1.5)));
    let slider = world.add(block([0.1, 0.1]).at([2.0, 0.0, 0.0]));
    let z = [0.0, 0.0, 1.0];
    let motor = Motor::Velocity { velocity: 3.0, max: 40.0 };
    let motor = Drive { motor: Some(motor), ..Drive::along(Coordinate::Angle) };
    world.join(Joint::revolute(None, a, [0.0; 3], z).driven(motor));
    let limits = JointLimits { lower: -1.5, upper: 2.0, e: 0.3 };
    let limit = Drive { limits: Some(limits), friction: 0.2, ..Drive::along(Coordinate::Angle) };
    world.join(Joint::revolute(Some(a), b, [1.0, 0.0, 0.0], z).driven(limit));
    world.join(Joint::revolute(Some(b), slider, [2.0, 0.0, 0.0], z));
    world.join(Joint::prismatic(None, slider, [2.0, 0.0, 0.0], [1.0, 0.0, 0.0]));
    // Two rows for each turn and two for the slide: nothing is redundant, other than in space.
    let s = simulation(world.clone());
    assert!(s.warnings().is_empty(), "{:?}", s.warnings());
    let mut counted = s;
    let report = counted.step(1e-3).unwrap();
    // One of friction, one of the motor.
    assert_eq!(report.counts.rows, 3 * 2 + 2 + 2);
    let far = apart(world, 0.5, 1e-3);
    assert!(far < 1e-7, "{far:e}");
}

#[test]
fn joints_of_the_plane_leave_what_they_say() {
    // Weld, rod and a point on a line, each on a body of its own.
    let mut world = World::in_plane([0.0, -G]);
    let body = |k: f64| block([0.2, 0.1]).at([2.0 * k, 0.0, 0.0]);
    let [weld, rod, line] = [0.0, 1.0, 2.0].map(|k| world.add(body(k)));
    world.join(Joint::fixed(None, weld, [0.3, 0.2, 0.0]));
    world.join(Joint::distance(None, rod, [[2.0, 1.0, 0.0], [2.1, 0.1, 0.0]]));
    let slope = [1.0, -1.0, 0.0];
    world.join(Joint::new(JointKind::PointOnLine, None, line, [4.0, 0.0, 0.0]).along(slope));
    let mut s = simulation(world);
    let report = s.step(1e-3).unwrap();
    assert_eq!(report.counts.rows, 3 + 1 + 1);
    run(&mut s, 0.5, 1e-3);
    near(x(&s, weld)[1], 0.0, 1e-13);
    // Down a slope of 45° with g/√2 along it: x − x₀ = g t²/4.
    near(x(&s, line)[0] - 4.0, 0.25 * G * 0.25, 1e-9);
    near(x(&s, line)[1], -0.25 * G * 0.25, 1e-9);
    assert!(s.joints().iter().all(|j| j.violation < 1e-13));
}

#[test]
fn a_stack_in_the_plane_carries_what_is_above_and_stays() {
    let mut world = flat(0.5, 0.0);
    let mut ids = vec![world.add(Body::ground())];
    for k in 0..10 {
        ids.push(world.add(block([0.5, 0.1]).at([0.0, 0.1 + 0.2 * f64::from(k), 0.0])));
    }
    let mut s = simulation(world);
    let h = 2e-3;
    let mut watch = |s: &Simulation, _: &StepReport| {
        for k in 0..10 {
            let own = s.contacts().iter().filter(|c| (c.a, c.b) == (ids[k], ids[k + 1]));
            near(own.map(|c| c.impulse[0]).sum(), (10 - k) as f64 * h * G, 1e-9);
        }
        Control::Continue
    };
    crate::verification::check(&s.run(0.2, h, &mut watch).unwrap());
    near(x(&s, ids[10])[1], 1.9, 1e-11);
}

#[test]
fn a_checkpoint_of_the_plane_goes_on_bit_for_bit_and_threads_change_none() {
    let make = |threads: usize| {
        let mut world = flat(0.4, 0.1);
        world.add(Body::ground());
        walls(&mut world, 3.0);
        for k in 0..40 {
            let (i, j) = (f64::from(k % 8), f64::from(k / 8));
            let at = [-2.4 + 0.6 * i + 0.05 * j, 0.4 + 0.6 * j, 0.0];
            let body = if k % 3 == 0 { disc(0.2) } else { block([0.2, 0.12]) };
            world.add(body.at(at).turned(about(0.3 * i)));
        }
        Simulation::new(world, MoreauJean::default()).unwrap().with_threads(threads)
    };
    let (mut one, mut two) = (make(1), make(2));
    for _ in 0..150 {
        assert!(one.step(4e-3).unwrap().status.is_solved());
        two.step(4e-3).unwrap();
    }
    assert_eq!(one.state(), two.state());
    let mut again = make(1);
    again.restore(&one.checkpoint()).unwrap();
    for _ in 0..50 {
        one.step(4e-3).unwrap();
        again.step(4e-3).unwrap();
    }
    assert_eq!(one.state(), again.state());
    // Nothing leaves the plane.
    let state = one.state();
    assert!(state.position.iter().all(|x| x[2] == 0.0));
    assert!(state.rotation.iter().all(|q| q[1] == 0.0 && q[2] == 0.0));
    assert!(state.velocity.iter().all(|v| v[2] == 0.0));
    assert!(state.spin.iter().all(|w| w[0] == 0.0 && w[1] == 0.0));
}

#[test]
fn what_the_plane_does_not_have_is_refused_by_its_place() {
    let refused = |change: &dyn Fn(&mut World)| {
        let mut world = flat(0.5, 0.0);
        world.add(Body::ground());
        world.add(block([0.1; 2]).at([0.0, 1.0, 0.0]).named("b"));
        change(&mut world);
        Simulation::new(world, MoreauJean::default()).err().expect("refused").to_string()
    };
    let solid = || Body::solid(Shape::Sphere { radius: 0.1 }, 1.0).unwrap();
    type Change<'a> = &'a dyn Fn(&mut World);
    let cases: [(Change, &str); 9] = [
        (
            &|w| {
                w.add(solid().at([3.0, 1.0, 0.0]));
            },
            "bodies[2].parts[0].shape: expected a disc",
        ),
        (&|w| w.bodies[1].position[2] = 1.0, "bodies[1] (b).position: expected 0"),
        (&|w| w.bodies[1].velocity[2] = 1.0, "bodies[1] (b).velocity: expected 0"),
        (&|w| w.bodies[1].angular_velocity[0] = 1.0, "bodies[1] (b).angular_velocity: expected 0"),
        (
            &|w| w.bodies[1].rotation = Rotation::about([1.0, 0.0, 0.0], 0.1),
            "bodies[1] (b).rotation",
        ),
        (&|w| w.gravity[2] = -1.0, "gravity: expected 0"),
        (&|w| w.law.mu_r = 0.1, "law.mu_r: expected 0"),
        (
            &|w| {
                w.join(Joint::spherical(None, BodyId(1), [0.0; 3]));
            },
            "joints[0].kind: expected fixed",
        ),
        (
            &|w| {
                w.join(Joint::revolute(None, BodyId(1), [0.0; 3], [1.0, 0.0, 0.0]));
            },
            "joints[0].axis: expected the third axis",
        ),
    ];
    for (change, expected) in cases {
        let said = refused(change);
        assert!(said.starts_with(expected), "{said}");
    }
    let mut space = World::default();
    space.add(disc(0.1));
    let said = Simulation::new(space, MoreauJean::default()).err().expect("refused").to_string();
    assert!(said.starts_with("bodies[0].parts[0].shape: expected a solid"), "{said}");
}

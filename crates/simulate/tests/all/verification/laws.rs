//! Laws of impact, activation, statuses, and the energy of each step.

use nonsmooth_scenes::Rotation;
use nonsmooth_simulate::{
    Activation, Body, Control, Force, Geometry, Impact, Law, MoreauJean, Part, Shape,
    SimulateError, Simulation, State, StepReport, StepStatus, World, Wrenches,
};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::verification::{G, ball, block, check, near, run, weightless, world};

/// A plane body that touches two walls at random places and moves towards both: what an impact makes of its energy. None where there is no such body, or where
/// wedged bodies have no solution.
fn wedged(rng: &mut Pcg64, impact: Impact, e: f64) -> Option<f64> {
    let mu = rng.random_range(0.1..1.5);
    let mut world = weightless(mu, e);
    let radius = 0.01;
    let mut knob = || {
        let [x, z, angle]: [f64; 3] = [1.0, 1.0, 3.0].map(|most| rng.random_range(-most..most));
        let (at, n) = ([x, 0.0, z], [angle.sin(), 0.0, angle.cos()]);
        let foot = std::array::from_fn(|k| at[k] - radius * n[k]);
        let wall = nonsmooth_simulate::plane(foot, n).unwrap();
        (Part::new(Shape::Sphere { radius }).at(at, Rotation::IDENTITY), wall, at, n)
    };
    let (first, second) = (knob(), knob());
    let [vx, vz, w] = [0; 3].map(|_| rng.random_range(-1.0..1.0));
    let approaches =
        |at: [f64; 3], n: [f64; 3]| n[0] * (vx + w * at[2]) + n[2] * (vz - w * at[0]) < 0.0;
    if !approaches(first.2, first.3) || !approaches(second.2, second.3) {
        return None;
    }
    world.add(Body::fixed(vec![first.1, second.1]));
    let j = 0.3;
    let inertia = [[j, 0.0, 0.0], [0.0, j, 0.0], [0.0, 0.0, j]];
    let body = Body::with_mass(1.0, inertia, vec![first.0, second.0]);
    world.add(body.moving([vx, 0.0, vz], [0.0, w, 0.0]));
    let limits =
        nonsmooth_solve::Limits { tolerance: 1e-10, max_iterations: 500, ..Default::default() };
    let scheme = MoreauJean { impact, ..MoreauJean::default() };
    let mut simulation = Simulation::new(world, scheme).ok()?.with_limits(limits);
    let report = simulation.step(1e-9).unwrap();
    assert!(report.energy.relative_imbalance() < 1e-12);
    assert_eq!(report.counts.active, 2);
    let solved = report.status == StepStatus::Solved;
    solved.then(|| report.energy.kinetic / report.energy.kinetic_before)
}

#[test]
fn fremonds_law_never_gains_energy_where_newtons_does() {
    let mut rng = Pcg64::seed_from_u64(7);
    let (mut gains, mut impacts) = ([0, 0, 0], [0, 0, 0]);
    for _ in 0..6000 {
        let state = rng.clone();
        for (k, (impact, e)) in
            [(Impact::Newton, 0.7), (Impact::Fremond, 0.7), (Impact::Newton, 0.0)]
                .into_iter()
                .enumerate()
        {
            rng = state.clone();
            if let Some(ratio) = wedged(&mut rng, impact, e) {
                impacts[k] += 1;
                gains[k] += usize::from(ratio > 1.0 + 1e-7);
            }
        }
    }
    assert!(impacts.iter().all(|&n| n > 150), "{impacts:?}");
    assert!(gains[0] > 0, "{gains:?}");
    assert_eq!(gains[1..], [0, 0]);
}

#[test]
fn restitution_that_gaps_would_spend_is_a_warning() {
    let said = |e: f64, activation: Activation| {
        let mut world = world(0.4, e);
        world.add(ball(0.15));
        let scheme = MoreauJean { activation, ..MoreauJean::default() };
        Simulation::new(world, scheme).unwrap().warnings().join("\n")
    };
    let gap = said(0.5, Activation::Gap);
    assert!(gap.starts_with("integrator.activation: `gap` spends the approach"), "{gap}");
    assert_eq!(said(0.0, Activation::Gap) + &said(0.5, Activation::default()), "");
}

#[test]
fn the_energy_of_every_step_is_accounted_for() {
    // Bodies of all shapes fall into a trough, with restitution and without, by all schemes.
    for (theta, e, impact, activation) in [
        (0.5, 0.6, Impact::Newton, Activation::default()),
        (0.5, 0.6, Impact::Fremond, Activation::default()),
        (0.6, 0.3, Impact::Newton, Activation::default()),
        (1.0, 0.0, Impact::Newton, Activation::Gap),
    ] {
        let mut world = world(0.4, e);
        let plane = |p, n| nonsmooth_simulate::plane(p, n).unwrap();
        world.add(Body::fixed(vec![
            plane([0.0; 3], [0.5, 0.0, 1.0]),
            plane([0.0; 3], [-0.5, 0.0, 1.0]),
            plane([0.0; 3], [0.0, 0.5, 1.0]),
            plane([0.0; 3], [0.0, -0.5, 1.0]),
        ]));
        for k in 0..4 {
            let z = 0.8 + f64::from(k);
            let turned = Rotation::about([1.0, 0.3, 0.2], 0.7 + f64::from(k));
            world.add(block([0.2, 0.1, 0.15]).at([0.1, 0.0, z]).turned(turned));
            world.add(ball(0.15).at([-0.3, 0.2, z]).moving([0.0; 3], [3.0, 1.0, 2.0]));
        }
        let scheme = MoreauJean { theta, impact, activation, ..MoreauJean::default() };
        let mut simulation = Simulation::new(world, scheme).unwrap();
        let (mut passes, mut energy) = (0, f64::INFINITY);
        let mut watch = |_: &Simulation, r: &StepReport| {
            passes = passes.max(r.newton);
            let e = &r.energy;
            // A contact that persists has its velocity at the end of the step, so that its work is zero to second order only.
            assert!(e.numerical >= 0.0 && e.normal <= 1e-3 * e.scale, "{e:?}");
            let now = e.kinetic + e.potential;
            assert!(now <= energy + 1e-3 * e.scale, "{now} {energy}");
            energy = energy.min(now);
            Control::Continue
        };
        let report = simulation.run(1.5, 2e-3, &mut watch).unwrap();
        check(&report);
        assert!(passes > 1, "rotation and contact were never iterated");
        assert!(report.penetration < 0.04, "{report:?}");
    }
}

#[test]
fn the_form_with_gaps_stops_without_penetration() {
    let mut world = world(0.0, 0.0);
    world.add(Body::floor());
    let b = world.add(ball(0.1).at([0.0, 0.0, 0.5]));
    let scheme = MoreauJean { activation: Activation::Gap, theta: 1.0, ..MoreauJean::default() };
    let mut simulation = Simulation::new(world, scheme).unwrap();
    let report = run(&mut simulation, 1.0, 1e-2);
    assert!(report.penetration < 1e-12, "{report:?}");
    near(simulation.state().position[b.index()][2], 0.1, 1e-12);
}

#[test]
fn restitution_threshold_stops_small_bounces() {
    let mut world = world(0.0, 0.8);
    world.add(Body::floor());
    let b = world.add(ball(0.1).at([0.0, 0.0, 0.1]).moving([0.0, 0.0, -0.5], [0.0; 3]));
    let scheme = MoreauJean { restitution_threshold: 0.6, ..MoreauJean::default() };
    let mut simulation = Simulation::new(world, scheme).unwrap();
    simulation.step(1e-3).unwrap();
    near(simulation.state().velocity[b.index()][2], 0.0, 1e-12);
}

struct Bad;

impl Force for Bad {
    fn add(&mut self, state: &State, wrenches: &mut Wrenches) {
        let force = if state.t > 0.05 { f64::NAN } else { 0.0 };
        wrenches.force(nonsmooth_simulate::BodyId(0), [force, 0.0, 0.0]);
    }
}

#[test]
fn a_force_that_is_no_number_ends_the_run_with_a_status() {
    let mut world = world(0.0, 0.0);
    world.add(ball(0.1));
    let mut simulation = Simulation::new(world, MoreauJean::default()).unwrap().with_force(Bad);
    let report = simulation.run(1.0, 1e-2, &mut ()).unwrap();
    assert!(report.stopped && !report.is_solved());
    assert_eq!(report.statuses["not_finite"], 1);
    near(simulation.state().t, 0.05, 1e-12);
    assert!(simulation.state().position[0][2].is_finite());
}

#[test]
fn a_spinning_body_in_contact_that_does_not_settle_is_said_and_halved() {
    let spun = |halvings| {
        let mut world = world(0.5, 0.0);
        world.add(Body::floor());
        let body = block([0.3, 0.2, 0.1]).at([0.0, 0.0, 0.1]);
        world.add(body.moving([0.0; 3], [60.0, 80.0, 90.0]));
        let scheme = MoreauJean { halvings, ..MoreauJean::default() };
        Simulation::new(world, scheme).unwrap().step(0.05).unwrap()
    };
    assert_eq!(spun(0).status, StepStatus::NewtonLimit);
    let report = spun(12);
    assert!(matches!(report.status, StepStatus::Halved(n) if n > 0), "{report:?}");
    assert!(report.energy.relative_imbalance() < 1e-11);
    near(report.t, 0.05, 1e-15);
}

#[test]
fn a_solver_that_fails_is_a_status() {
    let mut world = world(0.5, 0.0);
    world.add(Body::floor());
    for k in 0..6 {
        let z = 0.1 + 0.2 * f64::from(k);
        world.add(block([0.3, 0.3, 0.1]).at([0.0, 0.0, z]).moving([1.0, 0.2, 0.0], [0.0; 3]));
    }
    let limits =
        nonsmooth_solve::Limits { tolerance: 1e-10, max_iterations: 1, ..Default::default() };
    let mut simulation = Simulation::new(world, MoreauJean::default()).unwrap();
    simulation = simulation.with_solver("nsgs", Default::default()).unwrap().with_limits(limits);
    let report = simulation.run(0.02, 1e-2, &mut ()).unwrap();
    assert!(!report.is_solved());
    assert_eq!(report.statuses["solver: iteration_limit"], 2);
    assert!(report.to_string().contains("2 solver: iteration_limit"), "{report}");
}

#[test]
fn mistakes_are_named_by_their_place() {
    let message = |edit: fn(&mut World)| {
        let mut world = world(0.5, 0.0);
        world.add(Body::floor());
        world.add(block([0.1; 3]).at([0.0, 0.0, 0.1]));
        world.add(ball(0.1).at([1.0, 0.0, 0.1]).named("ball"));
        edit(&mut world);
        Simulation::new(world, MoreauJean::default()).err().expect("a mistake").to_string()
    };
    assert!(message(|w| w.bodies[1].mass = 0.0).starts_with("bodies[1].mass: expected a positive"));
    assert!(
        message(|w| w.bodies[2].rotation = Rotation([1.0; 4]))
            .starts_with("bodies[2] (ball).rotation: expected a unit quaternion")
    );
    assert!(
        message(|w| w.bodies[1].inertia = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 3.0]])
            .contains("triangle inequality")
    );
    assert!(message(|w| w.bodies[1].parts[0].material = 4).contains("parts[0].material"));
    assert!(
        message(|w| w.law = Law { mu: 0.1, e: 1.1, e_t: 0.0, mu_r: 0.0 }).starts_with("law.e:")
    );
    assert!(
        message(|w| w.bodies[1].motion =
            nonsmooth_simulate::Motion::Surface { linear: [f64::NAN; 3], angular: [0.0; 3] })
        .contains("motion.linear")
    );
    let overlap = message(|w| {
        w.bodies[1].position[2] = 0.05;
        w.bodies[2].position = [0.15, 0.0, 0.1];
    });
    assert!(overlap.contains("bodies[0] and bodies[1] by 5.000e-2 m"), "{overlap}");
    assert!(overlap.contains("bodies[1] and `ball` by"), "{overlap}");
    let pair = message(|w| {
        let corners = [[0.0; 3], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]];
        let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2]];
        let mesh = Shape::from(nonsmooth_simulate::Mesh::new(&corners, &faces).unwrap());
        for x in [3.0, 4.0] {
            let part = nonsmooth_simulate::Part::new(mesh.clone());
            w.add(Body { parts: vec![part], ..block([0.1; 3]).at([x, 0.0, 1.0]) });
        }
    });
    assert_eq!(
        pair,
        "bodies[3].parts[0] and bodies[4].parts[0]: contact between a mesh that is not closed and a mesh that is not closed is not supported"
    );
    let mut spun = world(0.0, 0.0);
    spun.add(ball(0.1).turned(Rotation([1.0001, 0.0, 0.0, 0.0])));
    let simulation = Simulation::new(spun, MoreauJean::default()).unwrap();
    assert!(simulation.warnings()[0].starts_with("bodies[0].rotation"));
    assert_eq!(simulation.state().rotation[0], [1.0, 0.0, 0.0, 0.0]);
    let scheme = MoreauJean { theta: 0.4, ..MoreauJean::default() };
    let refused: Result<_, SimulateError> = Simulation::new(World::default(), scheme);
    assert!(refused.err().unwrap().to_string().starts_with("integrator.theta"));
    near(G, 9.81, 0.0);
}

/// A ball of 1 kg on a spring of 1e4 N/m sinks in by its weight over the stiffness; dropped, it is thrown back after half a period.
#[test]
fn a_contact_that_gives_way_has_its_stiffness() {
    let (k, mass) = (1e4, 1.0);
    let stand = |damping: f64, height: f64| {
        let mut world = crate::verification::world(0.3, 0.0);
        world.comply(0, 0, nonsmooth_simulate::Compliance { stiffness: k, damping });
        world.add(nonsmooth_simulate::Body::floor());
        world.add(crate::verification::ball(0.1).at([0.0, 0.0, 0.1 + height]));
        crate::verification::simulation(world)
    };
    let mut resting = stand(20.0, 0.0);
    crate::verification::run(&mut resting, 3.0, 1e-3);
    crate::verification::near(
        resting.state().position[1][2],
        0.1 - mass * crate::verification::G / k,
        1e-9,
    );
    crate::verification::near(
        resting.contacts()[0].impulse[0],
        mass * crate::verification::G * 1e-3,
        1e-12,
    );

    let mut dropped = stand(0.0, 0.05);
    let (mut began, mut ended) = (None, None);
    let h = 1e-5;
    while dropped.state().t < 0.2 {
        assert!(dropped.step(h).unwrap().status.is_solved());
        let touches = dropped.contacts().iter().any(|c| c.impulse[0] > 0.0);
        let t = dropped.state().t;
        match (touches, began) {
            (true, None) => began = Some(t),
            (false, Some(_)) if ended.is_none() => ended = Some(t),
            _ => {}
        }
    }
    // The time in contact: x = v/ω sin ωt + g/ω² (1 − cos ωt) back to zero.
    let (omega, v) = ((k / mass).sqrt(), (2.0 * crate::verification::G * 0.05).sqrt());
    let lasts = (std::f64::consts::TAU - 2.0 * (v * omega / crate::verification::G).atan()) / omega;
    crate::verification::near(ended.unwrap() - began.unwrap(), lasts, 3e-4 * lasts + 2.0 * h);
}

#[test]
fn a_compliance_leaves_no_room_for_restitution() {
    let mut world = crate::verification::world(0.3, 0.5);
    world.comply(0, 0, nonsmooth_simulate::Compliance { stiffness: 1e4, damping: 0.0 });
    let said = world.validate().unwrap_err().to_string();
    assert!(said.contains("pairs[default, default].e: expected 0"), "{said}");
}

/// A box that tumbles on a plane: contacts that open while others press the body have u_θ ≥ 0 too, and give no energy but for the turn of the body within a step, also without a rebound. Of 29 J they gave .4 in a step.
#[test]
fn no_contact_gives_energy_by_fremonds_law() {
    let turned = Rotation([
        -0.14594633953046865,
        0.6310772097431187,
        -0.03926664017548115,
        -0.7608543568185873,
    ]);
    let (v, omega) = ([-1.23, -0.59, 0.22], [-10.13, -3.0, -1.78]);
    for e in [0.0, 0.5] {
        for h in [2e-3, 1e-3, 5e-4] {
            let mut world = world(3.0, e);
            world.add(Body::floor());
            let body = block([0.1, 0.12, 0.08]).at([0.0, 0.0, 0.25]).turned(turned);
            world.add(body.moving(v, omega));
            let scheme = MoreauJean {
                impact: Impact::Fremond,
                geometry: Geometry::Frozen,
                ..MoreauJean::default()
            };
            let mut simulation = Simulation::new(world, scheme).unwrap();
            while simulation.state().t < 0.8 {
                let step = simulation.step(h).unwrap();
                assert_eq!(step.status, StepStatus::Solved);
                let given = step.energy.normal + step.energy.tangential;
                assert!(given < 1e-3, "{e} {h}: {given:e} J at {}", step.t);
            }
        }
    }
}

//! What is asked of a system and what is said of it: laws one by one, derivatives, limits, mistakes.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use nonsmooth_linalg::{Csc, Dense, factorisations};
use nonsmooth_simulate::{
    Activation, Control, Directions, Impact, Lagrangian, LagrangianScheme, LagrangianSimulation,
    Law, LinearContact, LinearSystem, RelationsAt, RowLaw, Size, StepReport, StepStatus,
};
use nonsmooth_solve::{Limit, Limits, Solve, Status};

use crate::lagrangian::{check, near, run, theta};

/// A point of 1 kg above a floor in the plane, with weight.
fn point(law: Law) -> LinearSystem<2> {
    let mut system = LinearSystem::new(Csc::diagonal(&[1.0, 1.0]), Csc::zeros(2, 2));
    system.load = vec![0.0, -9.81];
    let directions = [vec![(1, 1.0)], vec![(0, 1.0)]];
    system.with_contact(LinearContact { gap: 0.0, directions, law })
}

/// Velocities after an oblique impact at (2, −3) m/s on a very rough floor.
fn impact(law: Law, scheme: LagrangianScheme) -> [f64; 2] {
    let mut system = point(law);
    system.load = vec![0.0; 2];
    let mut point = LagrangianSimulation::new(system, scheme, &[0.0; 2], &[2.0, -3.0]).unwrap();
    let report = point.step(1e-3).unwrap();
    assert_eq!(report.status, StepStatus::Solved);
    [point.state().v[0], point.state().v[1]]
}

#[test]
fn the_laws_of_impact_are_those_of_newton_and_fremond() {
    let law = Law { mu: 10.0, e: 0.5, e_t: 0.0, mu_r: 0.0 };
    let newton = LagrangianScheme::default();
    let fremond = LagrangianScheme { impact: Impact::Fremond, ..newton };
    for (law, scheme, expected) in [
        (law, newton, [0.0, 1.5]),
        (Law { e_t: 0.25, ..law }, newton, [-0.5, 1.5]),
        // What sticks in the mean of the step is reflected.
        (law, fremond, [-2.0, 1.5]),
        (Law { mu: 0.1, ..law }, newton, [2.0 - 0.45, 1.5]),
        (law, LagrangianScheme { restitution_threshold: 4.0, ..newton }, [0.0, 0.0]),
    ] {
        let found = impact(law, scheme);
        near(found[0], expected[0], 1e-12);
        near(found[1], expected[1], 1e-12);
    }
}

#[test]
fn a_sliding_point_stops_and_rests_exactly() {
    let system = point(Law::friction(0.5));
    let mut point = LagrangianSimulation::new(system, theta(0.5), &[0.0; 2], &[1.0, 0.0]).unwrap();
    run(&mut point, 0.5, 1e-3);
    near(point.state().q[0], 1.0 / (2.0 * 0.5 * 9.81), 1e-5);
    assert_eq!(point.state().v, [0.0; 2]);
    near(point.contacts()[0].impulse[0], 9.81e-3, 1e-15);
}

#[test]
fn a_constant_system_is_factorised_once_for_each_step_size() {
    let mut system = point(Law::friction(0.5));
    system.stiffness = Csc::diagonal(&[4.0, 0.0]);
    system.damping = Csc::diagonal(&[0.1, 0.0]);
    let mut point = LagrangianSimulation::new(system, theta(0.5), &[1.0, 0.0], &[0.0; 2]).unwrap();
    point.step(1e-3).unwrap();
    let before = factorisations();
    for _ in 0..100 {
        assert_eq!(point.step(1e-3).unwrap().newton, 1);
    }
    // Those of the solver of contacts are counted too: none, for one contact.
    assert_eq!(factorisations(), before);
    point.step(5e-4).unwrap();
    assert_eq!(factorisations(), before + 1);
}

#[test]
fn changed_matrices_are_made_anew() {
    let system = LinearSystem { load: vec![1.0], ..LinearSystem::chain(&[1.0], &[]).unwrap() };
    let system: LinearSystem<2> = system;
    let mut point = LagrangianSimulation::new(system, theta(0.5), &[0.0], &[0.0]).unwrap();
    let mut step = |change: &dyn Fn(&mut LinearSystem<2>)| {
        let [q, v] = [point.state().q[0], point.state().v[0]];
        change(point.system_mut());
        assert!(point.step(1.0).unwrap().status.is_solved());
        let LinearSystem { mass, damping, stiffness, .. } = point.system();
        let [m, c, k] = [mass, damping, stiffness].map(|a| a.get(0, 0));
        // (m + c/2 + k/4) (v⁺ − v) = 1 − c v − k (q + v/2).
        let exact = v + (1.0 - c * v - k * (q + 0.5 * v)) / (m + 0.5 * c + 0.25 * k);
        near(point.state().v[0], exact, 1e-12);
    };
    step(&|_| ());
    step(&|s| s.mass = Csc::diagonal(&[4.0]));
    step(&|s| s.stiffness = Csc::diagonal(&[1e4]));
    step(&|s| s.damping = Csc::diagonal(&[3.0]));
    let before = factorisations();
    step(&|s| s.load[0] = 1.0);
    assert_eq!(factorisations(), before);
    point.system_mut().mass = Csc::diagonal(&[1.0, 1.0]);
    let text = point.step(1.0).unwrap_err().to_string();
    assert_eq!(text, "constant().mass: expected 1 × 1, found 2 × 2");
}

/// A rotor with a motor and a stop: one coordinate, two rows.
struct Rotor {
    torque: f64,
    speed: f64,
}

impl Lagrangian<3> for Rotor {
    fn size(&self) -> Size {
        Size::new(1).rows(2)
    }
    fn mass(&self, _: &[f64], mass: &mut Dense) {
        mass[(0, 0)] = 2.0;
    }
    fn force(&self, _: f64, _: &[f64], _: &[f64], _: &mut [f64]) {}
    fn rows(&self, _: f64, q: &[f64], x: &mut [f64]) {
        (x[0], x[1]) = (q[0], 1.0 - q[0]);
    }
    fn row_velocities(&self, _: f64, _: &[f64], b: &mut [f64]) {
        b[0] = -self.speed;
    }
    fn row_law(&self, row: usize, _: f64, _: &[f64], _: &[f64]) -> RowLaw {
        match row {
            0 => RowLaw::Force { lower: -self.torque, upper: self.torque },
            _ => RowLaw::Limit { e: 0.5 },
        }
    }
}

#[test]
fn a_motor_gives_what_it_can_until_it_has_its_speed_and_a_stop_turns_it_back() {
    let rotor = Rotor { torque: 4.0, speed: 0.5 };
    let mut rotor = LagrangianSimulation::new(rotor, theta(0.5), &[0.0], &[0.0]).unwrap();
    // It accelerates with 2 rad/s² for a quarter of a second.
    run(&mut rotor, 0.2, 1e-3);
    near(rotor.state().v[0], 0.4, 1e-12);
    near(rotor.row_impulses()[0], 4e-3, 1e-15);
    run(&mut rotor, 1.0, 1e-3);
    near(rotor.state().v[0], 0.5, 1e-12);
    near(rotor.row_impulses()[0], 0.0, 1e-14);
    // The stop is at 1 rad, where the motor pushes; it comes to rest against it.
    let mut back: f64 = 0.0;
    let mut watch = |s: &LagrangianSimulation<Rotor, 3>, _: &StepReport| {
        back = back.min(s.state().v[0]);
        Control::Continue
    };
    check(&rotor.run(5.0, 1e-3, &mut watch).unwrap());
    // Half of its speed, less what the motor does within the step.
    near(back, -0.25, 5e-3);
    near(rotor.state().q[0], 1.0, 1e-3);
    near(rotor.row_impulses()[1], 4e-3, 1e-12);
    // A weaker motor the other way, by a controller.
    *rotor.system_mut() = Rotor { torque: 1.0, speed: -10.0 };
    run(&mut rotor, 6.0, 1e-3);
    near(rotor.state().v[0], -0.5, 1e-9);
}

/// A block on a rough floor that is driven as told, `x = s(t)`.
struct Driven;

impl Driven {
    fn told(t: f64) -> f64 {
        t + 0.1 * (2.0 * t).sin()
    }
}

impl Lagrangian<2> for Driven {
    fn size(&self) -> Size {
        Size::new(2).contacts(1).relations(1)
    }
    fn mass(&self, _: &[f64], mass: &mut Dense) {
        (mass[(0, 0)], mass[(1, 1)]) = (3.0, 3.0);
    }
    fn force(&self, _: f64, _: &[f64], _: &[f64], force: &mut [f64]) {
        force[1] = -3.0 * 9.81;
    }
    fn gaps(&self, _: f64, q: &[f64], gaps: &mut [f64]) {
        gaps[0] = q[1];
    }
    fn directions(&self, _: f64, _: &[f64], h: &mut Dense) -> bool {
        (h[(0, 1)], h[(1, 0)]) = (1.0, 1.0);
        true
    }
    fn law(&self, _: usize, _: f64, _: &[f64], _: &[f64]) -> Law {
        Law::friction(0.4)
    }
    fn relations(&self, t: f64, q: &[f64], phi: &mut [f64]) {
        phi[0] = q[0] - Self::told(t);
    }
}

#[test]
fn a_driven_block_is_where_it_is_told_and_the_drive_pays_for_friction() {
    let mut work = 0.0;
    let mut block = LagrangianSimulation::new(Driven, theta(0.5), &[0.0; 2], &[1.2, 0.0]).unwrap();
    let mut friction = 0.0;
    let mut watch = |_: &LagrangianSimulation<Driven, 2>, r: &StepReport| {
        work += r.energy.joints;
        friction += r.energy.tangential;
        assert!(r.drift.joints <= 1e-12);
        Control::Continue
    };
    check(&block.run(2.0, 1e-3, &mut watch).unwrap());
    near(block.state().q[0], Driven::told(2.0), 1e-12);
    near(friction, -0.4 * 3.0 * 9.81 * Driven::told(2.0), 1e-6);
    let speed = 1.0 + 0.2 * 4.0_f64.cos();
    near(work, -friction + 1.5 * (speed * speed - 1.44), 1e-5);
    near(block.consistent_velocity().unwrap()[0], speed, 1e-6);
    // Half a step before the end: m s'' + mu m g.
    let pull = 3.0 * (-0.4 * (2.0 * 1.9995_f64).sin()) + 0.4 * 3.0 * 9.81;
    near(block.relation_impulses()[0] / 1e-3, pull, 1e-3);
}

/// A wall that moves with the velocity c pushes a point; it bounces off with 2 c.
struct Piston;

impl Lagrangian<2> for Piston {
    fn size(&self) -> Size {
        Size::new(1).contacts(1)
    }
    fn mass(&self, _: &[f64], mass: &mut Dense) {
        mass[(0, 0)] = 1.0;
    }
    fn force(&self, _: f64, _: &[f64], _: &[f64], _: &mut [f64]) {}
    fn gaps(&self, t: f64, q: &[f64], gaps: &mut [f64]) {
        gaps[0] = q[0] - 0.5 * t;
    }
    fn surface(&self, _: f64, _: &[f64], s: &mut [f64]) {
        s[0] = -0.5;
    }
    fn law(&self, _: usize, _: f64, _: &[f64], _: &[f64]) -> Law {
        Law { e: 1.0, ..Law::default() }
    }
}

#[test]
fn a_piston_does_work() {
    let mut point = LagrangianSimulation::new(Piston, theta(0.5), &[0.1], &[0.0]).unwrap();
    let mut work = 0.0;
    let mut watch = |_: &LagrangianSimulation<Piston, 2>, r: &StepReport| {
        work += r.energy.drives;
        Control::Continue
    };
    check(&point.run(1.0, 1e-3, &mut watch).unwrap());
    near(point.state().v[0], 1.0, 1e-12);
    near(work, 0.5, 1e-12);
}

/// Two rods in a row, with Coriolis' terms; derivatives of the force given or not.
struct Double {
    analytic: bool,
}

impl Lagrangian<2> for Double {
    fn size(&self) -> Size {
        Size::new(2)
    }
    fn mass(&self, q: &[f64], mass: &mut Dense) {
        let c = (q[0] - q[1]).cos();
        mass.values_mut().copy_from_slice(&[2.0, c, c, 1.0]);
    }
    fn force(&self, _: f64, q: &[f64], v: &[f64], f: &mut [f64]) {
        let s = (q[0] - q[1]).sin();
        f[0] = -s * v[1] * v[1] - 2.0 * 9.81 * q[0].sin();
        f[1] = s * v[0] * v[0] - 9.81 * q[1].sin();
    }
    fn force_by_position(&self, _: f64, q: &[f64], v: &[f64], out: &mut Dense) -> bool {
        let c = (q[0] - q[1]).cos();
        let (a, b) = (c * v[1] * v[1], c * v[0] * v[0]);
        let weight = [19.62 * q[0].cos(), 9.81 * q[1].cos()];
        out.values_mut().copy_from_slice(&[-a - weight[0], a, b, -b - weight[1]]);
        self.analytic
    }
    fn force_by_velocity(&self, _: f64, q: &[f64], v: &[f64], out: &mut Dense) -> bool {
        let s = (q[0] - q[1]).sin();
        out.values_mut().copy_from_slice(&[0.0, -2.0 * s * v[1], 2.0 * s * v[0], 0.0]);
        self.analytic
    }
    fn potential(&self, _: f64, q: &[f64]) -> f64 {
        -9.81 * (2.0 * q[0].cos() + q[1].cos())
    }
}

#[test]
fn differences_take_as_many_iterations_as_derivatives() {
    let [a, b] = [true, false].map(|analytic| {
        let mut double =
            LagrangianSimulation::new(Double { analytic }, theta(0.5), &[1.0, 2.0], &[0.0; 2])
                .unwrap();
        let start = -9.81 * (2.0 * 1.0_f64.cos() + 2.0_f64.cos());
        let mut iterations = 0;
        let mut watch = |_: &LagrangianSimulation<Double, 2>, r: &StepReport| {
            iterations += r.newton;
            near(r.energy.kinetic + r.energy.potential, start, 2e-3);
            Control::Continue
        };
        check(&double.run(2.0, 1e-3, &mut watch).unwrap());
        (double.state().clone(), iterations)
    });
    for k in 0..2 {
        near(a.0.q[k], b.0.q[k], 1e-9);
    }
    assert!(a.1 == b.1 && a.1 <= 4 * 2000, "{} and {}", a.1, b.1);
}

#[test]
fn a_step_that_fails_is_cut() {
    let scheme = LagrangianScheme { newton: 3, ..theta(0.5) };
    let double = |scheme| {
        let system = Double { analytic: true };
        LagrangianSimulation::new(system, scheme, &[1.0, 2.0], &[8.0, -8.0]).unwrap()
    };
    assert_eq!(double(scheme).step(0.02).unwrap().status, StepStatus::NewtonLimit);
    let mut halved = double(LagrangianScheme { halvings: 8, ..scheme });
    let report = halved.step(0.02).unwrap();
    assert!(matches!(report.status, StepStatus::Halved(n) if n > 0), "{report:?}");
    near(halved.state().t, 0.02, 1e-15);
}

/// A rod of one metre about a pin.
struct Rod;

impl Lagrangian<2> for Rod {
    fn size(&self) -> Size {
        Size::new(2).relations(1)
    }
    fn mass(&self, _: &[f64], mass: &mut Dense) {
        (mass[(0, 0)], mass[(1, 1)]) = (1.0, 1.0);
    }
    fn force(&self, _: f64, _: &[f64], _: &[f64], force: &mut [f64]) {
        force[1] = -9.81;
    }
    fn relations(&self, _: f64, q: &[f64], phi: &mut [f64]) {
        phi[0] = q[0].hypot(q[1]) - 1.0;
    }
}

#[test]
fn projection_holds_relations_for_ever() {
    let scheme = LagrangianScheme {
        directions: Directions::Extrapolated,
        projection: Some(1e-13),
        ..theta(0.5)
    };
    let mut rod = LagrangianSimulation::new(Rod, scheme, &[1.0, 0.0], &[0.0; 2]).unwrap();
    let mut far: f64 = 0.0;
    let mut watch = |_: &LagrangianSimulation<Rod, 2>, r: &StepReport| {
        far = far.max(r.drift.joints);
        Control::Continue
    };
    check(&rod.run(100.0, 1e-3, &mut watch).unwrap());
    assert!(rod.state().steps >= 100_000 && far <= 1e-12, "{far:e}");
}

#[test]
fn consistent_velocities_obey_the_relations() {
    let scheme = LagrangianScheme { relations: RelationsAt::Mean, ..theta(0.5) };
    let mut rod = LagrangianSimulation::new(Rod, scheme, &[0.6, 0.8], &[2.0, 1.0]).unwrap();
    let v = rod.consistent_velocity().unwrap();
    // The part along the rod is taken away.
    near(v[0], 2.0 - 2.0 * 0.6, 1e-12);
    near(v[1], 1.0 - 2.0 * 0.8, 1e-12);
}

#[test]
fn a_checkpoint_goes_on_as_if_nothing_had_happened() {
    let law = Law { mu: 0.3, e: 0.7, e_t: 0.0, mu_r: 0.0 };
    let new =
        || LagrangianSimulation::new(point(law), theta(0.5), &[0.0, 0.1], &[1.0, 0.0]).unwrap();
    let mut whole = new();
    whole.run(0.5, 1e-3, &mut ()).unwrap();
    let mut first = new();
    first.run(0.25, 1e-3, &mut ()).unwrap();
    let mut second = new();
    second.restore(&first.checkpoint()).unwrap();
    second.run(0.5, 1e-3, &mut ()).unwrap();
    assert_eq!(whole.state(), second.state());
    let said = second.restore(b"{}").unwrap_err().to_string();
    assert!(said.starts_with("checkpoint: expected one of this system"), "{said}");
    // A system with as many coordinates, and no contact.
    let mut rod = LagrangianSimulation::new(Rod, theta(0.5), &[0.6, 0.8], &[0.0; 2]).unwrap();
    let said = rod.restore(&first.checkpoint()).unwrap_err().to_string();
    assert!(said.contains("one of [2, 0, 1, 1] contact impulses"), "{said}");
    rod.restore(&new().checkpoint()).unwrap();
    let said = rod.run(-1.0, 1e-3, &mut ()).unwrap_err().to_string();
    assert_eq!(said, "until: expected a time of at least 0 s, found -1");
}

#[test]
fn the_problem_of_the_next_step_is_the_one_that_is_solved() {
    let mut point =
        LagrangianSimulation::new(point(Law::friction(0.5)), theta(0.5), &[0.0; 2], &[1.0, 0.0])
            .unwrap();
    let problem = point.problem(1e-3).unwrap().expect("it touches the floor");
    let state = point.state().clone();
    let answer = Solve::new().tolerance(1e-12).run(&problem).unwrap();
    assert_eq!(*point.state(), state);
    point.step(1e-3).unwrap();
    for (a, b) in answer.point.r.iter().zip(point.contacts()[0].impulse) {
        near(*a, b, 1e-12);
    }
    point.state_mut().q[1] = 1.0;
    assert_eq!(point.problem(1e-3).unwrap(), None);
    // Relations alone are a problem without contacts.
    let scheme = LagrangianScheme { directions: Directions::Extrapolated, ..theta(0.5) };
    let mut rod = LagrangianSimulation::new(Rod, scheme, &[0.6, 0.8], &[0.8, -0.6]).unwrap();
    let problem = rod.problem(1e-3).unwrap().expect("a relation");
    let answer = Solve::new().tolerance(1e-12).run(&problem).unwrap();
    rod.step(1e-3).unwrap();
    near(answer.point.lambda[0], rod.relation_impulses()[0], 1e-14);
}

#[test]
fn limits_pass_through() {
    let new = || {
        LagrangianSimulation::new(point(Law::friction(0.5)), theta(0.5), &[0.0; 2], &[1.0, 0.0])
            .unwrap()
    };
    let cancel = Arc::new(AtomicBool::new(false));
    let limits = Limits { tolerance: 1e-10, cancel: Some(cancel.clone()), ..Limits::default() };
    let mut point = new().with_limits(limits);
    let mut steps = 0;
    let mut watch = |_: &LagrangianSimulation<LinearSystem<2>, 2>, _: &StepReport| {
        steps += 1;
        cancel.store(steps == 3, Ordering::Relaxed);
        Control::Continue
    };
    let report = point.run(1.0, 1e-3, &mut watch).unwrap();
    assert!(report.stopped && report.steps == 3 && report.is_solved());
    let state = point.state().clone();
    let report = point.step(1e-3).unwrap();
    assert_eq!(report.status, StepStatus::Solver(Status::Limit(Limit::Cancelled)));
    assert_eq!(*point.state(), state);
    let limits = Limits { tolerance: 1e-10, time_limit: Some(0.0), ..Limits::default() };
    let report = new().with_limits(limits).step(1e-3).unwrap();
    assert_eq!(report.status, StepStatus::Solver(Status::Limit(Limit::Time)));
}

/// A system whose mistakes can be chosen.
#[derive(Clone, Copy, Default)]
struct Wrong {
    mass: f64,
    force: f64,
    rows: Option<[f64; 2]>,
    law: Option<Law>,
}

impl Lagrangian<2> for Wrong {
    fn size(&self) -> Size {
        let contacts = usize::from(self.law.is_some());
        Size::new(1).contacts(contacts).rows(usize::from(self.rows.is_some()))
    }
    fn mass(&self, q: &[f64], mass: &mut Dense) {
        mass[(0, 0)] = 1.0 + self.mass * q[0];
    }
    fn force(&self, t: f64, _: &[f64], _: &[f64], force: &mut [f64]) {
        force[0] = if t > 0.01 { self.force } else { 0.0 };
    }
    fn row_law(&self, _: usize, _: f64, _: &[f64], _: &[f64]) -> RowLaw {
        let [lower, upper] = self.rows.unwrap_or_default();
        RowLaw::Force { lower, upper }
    }
    fn law(&self, _: usize, _: f64, _: &[f64], _: &[f64]) -> Law {
        self.law.unwrap_or_default()
    }
}

#[test]
fn mistakes_are_named() {
    let new = |wrong: Wrong, q: &[f64], v: &[f64]| {
        LagrangianSimulation::new(wrong, theta(0.5), q, v).map(|_| ())
    };
    let said = |result: Result<(), nonsmooth_simulate::SimulateError>| {
        let text = result.unwrap_err().to_string();
        assert_eq!(text.lines().count(), 1);
        text
    };
    let right = Wrong::default();
    assert!(new(right, &[0.0], &[0.0]).is_ok());
    let length = "q: expected 1 entries, one for each degree of freedom, found 2";
    assert_eq!(said(new(right, &[0.0; 2], &[0.0])), length);
    assert!(said(new(right, &[0.0], &[f64::NAN])).starts_with("v: expected finite components"));
    let mass = "mass: expected a symmetric positive definite matrix";
    assert!(said(new(Wrong { mass: -1.0, ..right }, &[2.0], &[0.0])).starts_with(mass));
    let skew = LinearSystem::<2>::new(
        Csc::from_triplets(2, 2, [(0, 0, 2.0), (0, 1, 1.0), (1, 1, 2.0)].into_iter()).unwrap(),
        Csc::zeros(2, 2),
    );
    let text = said(LagrangianSimulation::new(skew, theta(0.5), &[0.0; 2], &[0.0; 2]).map(|_| ()));
    assert_eq!(text, "asymmetry of mass: expected 0, of a symmetric matrix, found 0.5, at t = 0");
    let tangents = Wrong { law: Some(Law::friction(0.5)), ..right };
    let text = said(new(tangents, &[0.0], &[0.0]));
    assert!(text.starts_with("law(0).mu: expected 0, since `directions` gives no"), "{text}");
    let mut scheme = theta(0.2);
    let text = said(LagrangianSimulation::new(right, scheme, &[0.0], &[0.0]).map(|_| ()));
    assert_eq!(text, "scheme.theta: expected a number from 0.5 to 1, found 0.2");
    scheme = LagrangianScheme { projection: Some(0.0), ..theta(0.5) };
    let text = said(LagrangianSimulation::new(right, scheme, &[0.0], &[0.0]).map(|_| ()));
    assert!(text.starts_with("scheme.projection"), "{text}");

    let step = |wrong: Wrong, v: f64, h: f64| {
        let mut s = LagrangianSimulation::new(wrong, theta(0.5), &[0.0], &[v]).unwrap();
        s.step(h).map(|_| ())
    };
    assert!(said(step(right, 1.0, 0.0)).starts_with("h: expected a positive number"));
    let text = said(step(Wrong { rows: Some([1.0, -1.0]), ..right }, 1.0, 0.1));
    assert!(text.starts_with("row_law(0): expected a lower bound"), "{text}");
    let text = said(step(
        Wrong { law: Some(Law { mu: 0.0, e: 2.0, e_t: 0.0, mu_r: 0.0 }), ..right },
        1.0,
        0.1,
    ));
    assert!(text.starts_with("law(0).e: expected a coefficient from 0 to 1"), "{text}");
    let text = said(step(Wrong { mass: -1.0, ..right }, 100.0, 0.1));
    assert!(text.starts_with(mass), "{text}");
}

#[test]
fn a_force_that_is_no_number_ends_the_run_before_its_step() {
    let wrong = Wrong { force: f64::NAN, ..Wrong::default() };
    let mut system = LagrangianSimulation::new(wrong, theta(0.5), &[0.0], &[1.0]).unwrap();
    let report = system.run(1.0, 1e-3, &mut ()).unwrap();
    assert!(report.stopped && !report.is_solved(), "{report}");
    assert_eq!(report.statuses["not_finite"], 1);
    assert!(system.state().q[0].is_finite() && (system.state().t - 0.01).abs() < 2e-3);
}

/// Two coordinates, functions of time, and mistakes that show only later.
#[derive(Clone, Copy, Default)]
struct Later {
    mu: f64,
    skew: f64,
    force: f64,
    e: f64,
    relations: &'static [fn(f64) -> f64],
}

impl Lagrangian<2> for Later {
    fn size(&self) -> Size {
        Size::new(2).contacts(1).relations(self.relations.len())
    }
    fn mass(&self, q: &[f64], mass: &mut Dense) {
        (mass[(0, 0)], mass[(1, 1)], mass[(0, 1)]) = (2.0, 2.0, self.skew * q[0]);
    }
    fn force(&self, t: f64, _: &[f64], _: &[f64], force: &mut [f64]) {
        force[0] = if t > 0.9 { self.force } else { 0.0 };
    }
    fn gaps(&self, _: f64, q: &[f64], gaps: &mut [f64]) {
        gaps[0] = 100.0 + q[1];
    }
    fn law(&self, _: usize, t: f64, _: &[f64], _: &[f64]) -> Law {
        Law { mu: if t > 0.0 { self.mu } else { 0.0 }, e: self.e, ..Law::default() }
    }
    fn relations(&self, t: f64, q: &[f64], phi: &mut [f64]) {
        self.relations.iter().zip(phi).for_each(|(f, phi)| *phi = q[0] - f(t));
    }
}

fn later(system: Later, scheme: LagrangianScheme) -> LagrangianSimulation<Later, 2> {
    LagrangianSimulation::new(system, scheme, &[0.0; 2], &[1.0, 0.0]).unwrap()
}

#[test]
fn mistakes_are_named_when_they_happen() {
    let mut friction = later(Later { mu: 0.5, ..Later::default() }, theta(0.5));
    friction.step(0.1).unwrap();
    let text = friction.step(0.1).unwrap_err().to_string();
    assert!(text.starts_with("law(0).mu: expected 0, since `directions` gives no"), "{text}");
    let mut skew = later(Later { skew: 0.5, ..Later::default() }, theta(0.5));
    for _ in 0..2 {
        let text = skew.step(0.1).unwrap_err().to_string();
        assert!(text.starts_with("asymmetry of mass: expected 0"), "{text}");
    }
    for (k, name) in ["q", "q", "v", "t"].into_iter().enumerate() {
        let mut wrong = later(Later::default(), theta(0.5));
        let state = wrong.state_mut();
        match k {
            0 => state.q.push(1.0),
            1 => state.q.clear(),
            2 => state.v[1] = f64::NAN,
            _ => state.t = f64::NAN,
        }
        let text = wrong.step(0.1).unwrap_err().to_string();
        assert!(text.starts_with(&format!("{name}: expected")), "{text}");
        assert!(wrong.run(1.0, 0.1, &mut ()).is_err() && wrong.problem(0.1).is_err());
    }
}

#[test]
fn half_a_step_is_none() {
    let scheme = LagrangianScheme { halvings: 2, ..theta(0.5) };
    // What fails is the second half, by a number that is none, or by a law that is none.
    let wrong = Later { force: f64::NAN, ..Later::default() };
    let mut whole = later(wrong, scheme);
    let before = whole.state().clone();
    let report = whole.step(1.0).unwrap();
    assert_eq!((report.status, report.t, report.h), (StepStatus::NotFinite, 0.0, 1.0));
    assert_eq!(*whole.state(), before);
    let mut whole = later(Later { mu: 0.5, ..wrong }, scheme);
    assert!(whole.step(1.0).is_err());
    assert_eq!(*whole.state(), before);
}

#[test]
fn consistent_velocities_are_those_of_fast_drives_or_none() {
    let of = |relations| later(Later { relations, ..Later::default() }, theta(0.5));
    let fast = &[(|t| 1e-3 * (1e3 * t).sin()) as fn(f64) -> f64];
    near(of(fast).consistent_velocity().unwrap()[0], 1.0, 1e-9);
    let twice: &'static [fn(f64) -> f64] = &[|t| 3.0 * t, |t| 3.0 * t];
    near(of(twice).consistent_velocity().unwrap()[0], 3.0, 1e-9);
    for (wrong, name) in [
        (
            &[(|t| t) as fn(f64) -> f64, |t| 2.0 * t] as &'static [_],
            "relations[0]: expected a rate",
        ),
        (&[(|_| f64::NAN) as fn(f64) -> f64], "∂φ/∂t of relations[0]: expected finite"),
    ] {
        let text = of(wrong).consistent_velocity().unwrap_err().to_string();
        assert!(text.starts_with(name), "{text}");
    }
}

#[test]
fn a_run_tells_violations_and_warns() {
    let fast: &'static [fn(f64) -> f64] = &[|t| 3.0 + t];
    let mut far = later(Later { relations: fast, ..Later::default() }, theta(0.5));
    let report = far.run(0.1, 1e-2, &mut ()).unwrap();
    near(report.joints, 3.0, 1e-6);
    assert!(report.to_string().contains("relations violated by at most 3.0e0"), "{report}");
    let scheme = LagrangianScheme { activation: Activation::Gap, ..theta(0.5) };
    let warned = |e| later(Later { e, ..Later::default() }, scheme).warnings().len();
    assert_eq!([warned(0.5), warned(0.0)], [1, 0]);
}

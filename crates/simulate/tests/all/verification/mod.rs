//! Motions whose results are known in closed form, or were computed by other means to the digits given.

mod balls;
mod blocks;
mod elastic;
mod elastic_pairs;
mod free_body;
mod governor;
mod grounds;
mod hertz;
mod impacts;
mod invariance;
mod joints;
mod laws;
mod mechanisms;
mod meshes;
mod opening;
mod overlap;
mod periodic;
mod piles;
mod plane;
mod projection;
mod rims;
mod rolling;
mod solids;
mod stops;
mod tops;

use nonsmooth_simulate::{
    Activation, Body, BodyId, Control, Geometry, Law, MoreauJean, RunReport, Shape, Simulation,
    StepReport, World,
};

const G: f64 = 9.81;

/// Rules by which contacts and limits take part.
const ACTIVATIONS: [Activation; 4] = [
    Activation::Forecast { gamma: 0.5, slack: 1e-9 },
    Activation::Forecast { gamma: 0.0, slack: 1e-9 },
    Activation::Forecast { gamma: 1.0, slack: 1e-9 },
    Activation::Gap,
];

/// Numbers between −1 and 1.
fn numbers(mut seed: u64) -> impl FnMut() -> f64 {
    move || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// A world with gravity downwards and one law.
fn world(mu: f64, e: f64) -> World {
    World::new([0.0, 0.0, -G]).with_law(Law { mu, e, ..Law::default() })
}

/// The same, without gravity.
fn weightless(mu: f64, e: f64) -> World {
    World::new([0.0; 3]).with_law(Law { mu, e, ..Law::default() })
}

/// A solid ball of 1 kg.
fn ball(radius: f64) -> Body {
    let j = 0.4 * radius * radius;
    ball_with(radius, j)
}

/// A ball of 1 kg with any moment of inertia.
fn ball_with(radius: f64, j: f64) -> Body {
    let part = nonsmooth_simulate::Part::new(Shape::Sphere { radius });
    Body::with_mass(1.0, [[j, 0.0, 0.0], [0.0, j, 0.0], [0.0, 0.0, j]], vec![part])
}

/// A homogeneous box of 1 kg.
fn block(half: [f64; 3]) -> Body {
    let density = 1.0 / (8.0 * half[0] * half[1] * half[2]);
    Body::solid(Shape::Box { half }, density).unwrap()
}

fn simulation(world: World) -> Simulation {
    Simulation::new(world, MoreauJean::default()).unwrap()
}

fn frozen(world: World) -> Simulation {
    let scheme = MoreauJean { geometry: Geometry::Frozen, ..MoreauJean::default() };
    Simulation::new(world, scheme).unwrap()
}

/// Runs until `until`; every step must be judged solved, and its energy accounted for.
fn run(simulation: &mut Simulation, until: f64, h: f64) -> RunReport {
    let report = simulation.run(until, h, &mut ()).unwrap();
    check(&report);
    report
}

/// Runs a world in steps of 1 ms, each of which is seen; every step must be judged solved.
fn watched(
    world: World,
    scheme: MoreauJean,
    until: f64,
    mut see: impl FnMut(&StepReport),
) -> RunReport {
    let mut simulation = Simulation::new(world, scheme).unwrap();
    let mut watch = |_: &Simulation, step: &StepReport| {
        see(step);
        Control::Continue
    };
    let report = simulation.run(until, 1e-3, &mut watch).unwrap();
    assert!(report.is_solved(), "{report}");
    report
}

fn check(report: &RunReport) {
    assert!(report.is_solved(), "{report}");
    assert!(report.residual <= 1e-10, "{report}");
    assert!(report.imbalance <= 1e-12, "{report}");
}

fn x(simulation: &Simulation, body: BodyId) -> [f64; 3] {
    simulation.state().position[body.index()]
}

fn v(simulation: &Simulation, body: BodyId) -> [f64; 3] {
    simulation.state().velocity[body.index()]
}

fn omega(simulation: &Simulation, body: BodyId) -> [f64; 3] {
    simulation.state().angular_velocity(body)
}

#[track_caller]
fn near(found: f64, expected: f64, tolerance: f64) {
    assert!(
        (found - expected).abs() <= tolerance,
        "{found} is not {expected} within {tolerance:e}"
    );
}

/// The slope of the least-squares line through (log h, log error).
fn order(points: &[(f64, f64)]) -> f64 {
    let logs: Vec<_> = points.iter().map(|p| (p.0.ln(), p.1.ln())).collect();
    let n = logs.len() as f64;
    let (mx, my) = logs.iter().fold((0.0, 0.0), |s, p| (s.0 + p.0 / n, s.1 + p.1 / n));
    let (xy, xx) = logs
        .iter()
        .fold((0.0, 0.0), |s, p| (s.0 + (p.0 - mx) * (p.1 - my), s.1 + (p.0 - mx) * (p.0 - mx)));
    xy / xx
}

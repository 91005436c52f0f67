//! Laws of granular matter that hold on average: many grains, tolerances of 10 to 20 %. Lengths in diameters of a grain, gravity 1.
//!
//! The steps are solved by sweeps to a residual that averages do not see; every one is judged, and its energy accounted for. The long versions take some twenty minutes on a core:
//! `cargo test --release -p nonsmooth-simulate --test all statistics -- --ignored --nocapture`.

mod collapse;
mod janssen;

use nonsmooth_simulate::{Activation, MoreauJean, RunReport, Simulation, World};
use nonsmooth_solve::settings::SettingsMap;

const TOLERANCE: f64 = 1e-3;
/// The step, of the time √(d/g) in which a grain falls by half its diameter.
const H: f64 = 0.05;

fn simulation(world: World) -> Simulation {
    // With θ = 1 friction never gains energy, and what a contact gives way by is what its law has.
    let scheme = MoreauJean { activation: Activation::Gap, theta: 1.0, ..MoreauJean::default() };
    let simulation = Simulation::new(world, scheme).unwrap();
    simulation.with_solver("nsgs", SettingsMap::new()).unwrap().with_tolerance(TOLERANCE)
}

#[track_caller]
fn check(report: &RunReport) {
    assert!(report.is_solved() && report.residual <= TOLERANCE, "{report}");
    assert!(report.imbalance <= 1e-11, "{report}");
}

//! Lagrangian systems written as a user would, against closed forms and published figures.

mod andrews;
mod bar;
mod four_bars;
mod laws;
mod oscillators;
mod painleve;
mod patch;
mod pendulum;
mod rattleback;
mod slider_crank;
mod stops;
mod woodpecker;

use nonsmooth_linalg::Dense;
use nonsmooth_simulate::{Lagrangian, LagrangianScheme, LagrangianSimulation, RunReport};

/// Runs until `until`; every step must be judged solved, and its energy accounted for.
#[track_caller]
fn run<L: Lagrangian<D>, const D: usize>(
    simulation: &mut LagrangianSimulation<L, D>,
    until: f64,
    h: f64,
) -> RunReport {
    let report = simulation.run(until, h, &mut ()).unwrap();
    check(&report);
    report
}

#[track_caller]
fn check(report: &RunReport) {
    assert!(report.is_solved(), "{report}");
    assert!(report.residual <= 1e-10 && report.imbalance <= 1e-10, "{report}");
}

#[track_caller]
fn near(found: f64, expected: f64, tolerance: f64) {
    let off = (found - expected).abs();
    assert!(off <= tolerance, "{found} is not {expected} within {tolerance:e}: off by {off:.2e}");
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

/// Of a scheme of second order with an expansion in h²: results of h and h/2 make one of fourth order.
fn extrapolated(coarse: &[f64], fine: &[f64]) -> Vec<f64> {
    coarse.iter().zip(fine).map(|(coarse, fine)| (4.0 * fine - coarse) / 3.0).collect()
}

/// Writes a symmetric matrix, given by its entries on and above the diagonal.
fn symmetric(out: &mut Dense, entries: &[(usize, usize, f64)]) {
    for &(i, j, x) in entries {
        (out[(i, j)], out[(j, i)]) = (x, x);
    }
}

fn theta(theta: f64) -> LagrangianScheme {
    LagrangianScheme { theta, ..LagrangianScheme::default() }
}

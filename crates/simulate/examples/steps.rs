//! How long a step takes: `cargo run --release -p nonsmooth-simulate --example steps -- [tolerance] [steps] [FOLDER]`.
//!
//! A pyramid of 55 boxes, the same of squares in the plane, piles of 500 and of 1000 spheres: medians in ms over steps of 5 ms once they have come to rest: processor time, wall clock,
//! and the phases by wall clock. The piles fall together first, where each step is a shock of a thousand contacts that slide: these steps are solved by sweeps to 1e-3, for
//! to 1e-8 each takes seconds. With a folder the worlds at rest are written there as JSON, for peers to do the same
//! (docs/benchmarks/simulation_mujoco.py).

use std::error::Error;

use cpu_time::ProcessTime;
use nonsmooth_scenes::scenes::{Family, SpherePile};
use nonsmooth_simulate::{
    Body, Law, MoreauJean, Polygon, Shape, SimulateError, Simulation, StepReport, World,
};
use nonsmooth_solve::settings::SettingsMap;

/// Rows of 10, 9, … 1 boxes, each box on two of the row below.
fn pyramid() -> Result<World, SimulateError> {
    let mut world = World::default().with_law(Law::friction(0.5));
    world.add(Body::floor());
    for row in 0..10 {
        for k in 0..10 - row {
            let x = 1.05 * (f64::from(k) + 0.5 * f64::from(row));
            let body = Body::solid(Shape::Box { half: [0.5; 3] }, 1000.0)?;
            world.add(body.at([x, 0.0, 0.5 + f64::from(row)]));
        }
    }
    Ok(world)
}

/// The same in the plane.
fn flat() -> Result<World, SimulateError> {
    let mut world = World::in_plane([0.0, -9.81]).with_law(Law::friction(0.5));
    world.add(Body::ground());
    for row in 0..10 {
        for k in 0..10 - row {
            let x = 1.05 * (f64::from(k) + 0.5 * f64::from(row));
            let body = Body::solid(Polygon::rectangle([0.5; 2])?, 1000.0)?;
            world.add(body.at([x, 0.5 + f64::from(row), 0.0]));
        }
    }
    Ok(world)
}

fn pile(count: usize) -> Result<World, SimulateError> {
    World::try_from(&SpherePile { count, mu: 0.4, ..SpherePile::default() }.build()?)
}

/// Bodies with their shapes and places, as JSON.
fn written(simulation: &Simulation) -> String {
    let (world, state) = (simulation.world(), simulation.state());
    let bodies = world.bodies.iter().enumerate().map(|(k, body)| {
        let parts = body.parts.iter().map(|part| match &part.shape {
            Shape::Sphere { radius } => format!(r#"{{"sphere": {radius}}}"#),
            Shape::Box { half } => format!(r#"{{"box": {half:?}}}"#),
            _ => r#"{"plane": true}"#.into(),
        });
        format!(
            r#"{{"free": {}, "mass": {:?}, "position": {:?}, "rotation": {:?}, "shapes": [{}]}}"#,
            body.is_free(),
            body.mass,
            state.position[k],
            state.rotation[k],
            parts.collect::<Vec<_>>().join(", ")
        )
    });
    format!("[\n{}\n]\n", bodies.collect::<Vec<_>>().join(",\n"))
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let tolerance: f64 = arguments.next().map_or(Ok(1e-8), |t| t.parse())?;
    let steps: usize = arguments.next().map_or(Ok(1000), |t| t.parse())?;
    let folder = arguments.next().map(std::path::PathBuf::from);
    println!(
        "{:<12} {:>7} {:>8} {:>8} {:>8} {:>8} {:>8} {:>6} {:>8} {:>7}",
        "scene",
        "active",
        "cpu",
        "wall",
        "detect",
        "assemble",
        "solve",
        "iters",
        "residual",
        "solved"
    );
    for (name, world, falling, settling) in [
        ("pyramid 55", pyramid()?, 0, 400),
        ("in the plane", flat()?, 0, 400),
        ("spheres 500", pile(500)?, 200, 800),
        ("spheres 1000", pile(1000)?, 200, 800),
    ] {
        let mut simulation = Simulation::new(world, MoreauJean::default())?
            .with_solver("nsgs", SettingsMap::new())?
            .with_tolerance(1e-3);
        for _ in 0..falling {
            simulation.step(5e-3)?;
        }
        simulation = simulation.with_solver("auto", SettingsMap::new())?.with_tolerance(tolerance);
        for _ in 0..settling {
            simulation.step(5e-3)?;
        }
        // Peers are engines of space.
        if let Some(folder) = folder.as_ref().filter(|_| name != "in the plane") {
            let file = folder.join(name.replace(' ', "-")).with_extension("json");
            std::fs::write(file, written(&simulation))?;
        }
        let mut cpu = vec![];
        let mut reports: Vec<StepReport> = vec![];
        for _ in 0..steps {
            let begun = ProcessTime::now();
            reports.push(simulation.step(5e-3)?);
            cpu.push(1e3 * begun.elapsed().as_secs_f64());
        }
        cpu.sort_by(f64::total_cmp);
        // Milliseconds.
        let quantile = |part: f64, of: fn(&StepReport) -> f64| {
            let mut all: Vec<f64> = reports.iter().map(of).collect();
            all.sort_by(f64::total_cmp);
            all[((all.len() - 1) as f64 * part) as usize]
        };
        let ms = |part: f64, of: fn(&StepReport) -> f64| 1e3 * quantile(part, of);
        println!(
            "{name:<12} {:>7} {:>8.3} {:>8.3} {:>8.3} {:>8.3} {:>8.3} {:>6} {:>8.1e} {:>7}",
            reports[steps - 1].counts.active,
            cpu[steps / 2],
            ms(0.5, |r| r.timings.total),
            ms(0.5, |r| r.timings.detection),
            ms(0.5, |r| r.timings.assembly),
            ms(0.5, |r| r.timings.solve),
            quantile(0.5, |r| r.counts.iterations as f64),
            quantile(1.0, |r| r.residual),
            reports.iter().filter(|r| r.status.is_solved()).count(),
        );
    }
    Ok(())
}

//! What threads save: `cargo run --release -p nonsmooth-simulate --example threads -- [SCENE] [THREADS] [steps] [skipped]`.
//!
//! `stacks`: 2000 stacks of five boxes that slide and come to rest, so many small islands. `pyramid`: 5050 boxes, one large island that stands. `spheres`: 10 000 soft spheres
//! that fall together, by sweeps to 1e-3. `columns`: 100 000 spheres in columns of ten. `beds`: 100 160 spheres, ten layers in each of 64 pits, every sphere in the pocket of four. Seconds by the wall's clock over all steps but those skipped, and of processor time; detection,
//! statement and solution by the wall's clock, and the rest: bodies moved, contacts remembered.

use std::error::Error;
use std::time::Instant;

use cpu_time::ProcessTime;
use nonsmooth_scenes::scenes::{Family, SpherePile};
use nonsmooth_simulate::{
    Body, Compliance, Law, MoreauJean, Part, Shape, SimulateError, Simulation, World,
};
use nonsmooth_solve::settings::SettingsMap;

fn stacks() -> Result<World, SimulateError> {
    let mut world = World::default().with_law(Law::friction(0.5));
    world.add(Body::floor());
    for k in 0..2000 {
        let (row, column) = (f64::from(k / 45), f64::from(k % 45));
        for level in 0..5 {
            let body = Body::solid(Shape::Box { half: [0.5, 0.4, 0.1] }, 1000.0)?
                .at([3.0 * column, 3.0 * row, 0.1 + 0.2 * f64::from(level)])
                .moving([0.5, 0.2, 0.0], [0.0; 3]);
            world.add(body);
        }
    }
    Ok(world)
}

fn pyramid() -> Result<World, SimulateError> {
    let mut world = World::default().with_law(Law::friction(0.5));
    world.add(Body::floor());
    for row in 0..100 {
        for k in 0..100 - row {
            let x = 1.05 * (f64::from(k) + 0.5 * f64::from(row));
            let body = Body::solid(Shape::Box { half: [0.5; 3] }, 1000.0)?;
            world.add(body.at([x, 0.0, 0.5 + f64::from(row)]));
        }
    }
    Ok(world)
}

fn spheres(count: usize) -> Result<World, Box<dyn Error>> {
    let mut world =
        World::try_from(&SpherePile { count, mu: 0.4, ..SpherePile::default() }.build()?)?;
    let mass = world.bodies.iter().filter(|b| b.is_free()).map(|b| b.mass).fold(0.0, f64::max);
    let radius = world
        .bodies
        .iter()
        .flat_map(|b| b.parts.iter().map(|p| p.shape.radius()))
        .filter(|r| r.is_finite())
        .fold(f64::INFINITY, f64::min);
    let stiffness = 1000.0 * mass * 9.81 / (2.0 * radius);
    world.comply(0, 0, Compliance { stiffness, damping: 0.0 });
    Ok(world)
}

fn columns() -> Result<World, SimulateError> {
    let mut world = World::default().with_law(Law::friction(0.5));
    world.add(Body::floor());
    for k in 0..10_000 {
        for level in 0..10 {
            let body = Body::solid(Shape::Sphere { radius: 0.5 }, 1000.0)?;
            let (x, y) = (f64::from(k % 100), f64::from(k / 100));
            world.add(body.at([1.5 * x, 1.5 * y, 0.5 + f64::from(level)]));
        }
    }
    Ok(world)
}

fn beds() -> Result<World, SimulateError> {
    const SPACING: f64 = 1.05;
    let mut world = World::default().with_law(Law::friction(0.5));
    world.add(Body::floor());
    // Layers of 13 × 13 and 12 × 12 spheres by turns; the deepest touch the walls.
    let (side, rise) = (12.0 * SPACING + 1.0, (1.0 - SPACING * SPACING / 2.0).sqrt());
    let (half, pit) = (0.5 * side, side + 1.0);
    for k in 0..64 {
        let origin = [pit * f64::from(k / 8), pit * f64::from(k % 8)];
        for (axis, sign) in [(0, -1.0), (0, 1.0), (1, -1.0), (1, 1.0)] {
            let (mut at, mut size) = ([origin[0], origin[1], 5.0], [half, half, 5.0]);
            at[axis] += sign * (half + 0.2);
            size[axis] = 0.2;
            let wall = Part::new(Shape::Box { half: size });
            world.add(Body::fixed(vec![wall]).at(at));
        }
        for layer in 0..10 {
            let count = 13 - layer % 2;
            let first = -0.5 * SPACING * f64::from(count - 1);
            for ball in 0..count * count {
                let (row, column) = (f64::from(ball / count), f64::from(ball % count));
                world.add(Body::solid(Shape::Sphere { radius: 0.5 }, 1000.0)?.at([
                    origin[0] + first + SPACING * row,
                    origin[1] + first + SPACING * column,
                    0.5 + rise * f64::from(layer),
                ]));
            }
        }
    }
    Ok(world)
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let scene = arguments.next().unwrap_or("stacks".into());
    let threads: usize = arguments.next().map_or(Ok(2), |t| t.parse())?;
    let steps: usize = arguments.next().map_or(Ok(80), |t| t.parse())?;
    let skipped: usize = arguments.next().map_or(Ok(0), |t| t.parse())?;
    let rigid = |world| Simulation::new(world, MoreauJean::default());
    let mut simulation = match scene.as_str() {
        "stacks" => rigid(stacks()?)?,
        "pyramid" => rigid(pyramid()?)?,
        "columns" => rigid(columns()?)?,
        "beds" => rigid(beds()?)?,
        "spheres" => {
            let scheme = MoreauJean { theta: 1.0, ..MoreauJean::default() };
            let simulation = Simulation::new(spheres(10_000)?, scheme)?;
            simulation.with_solver("nsgs", SettingsMap::new())?
        }
        other => {
            return Err(
                format!("{other} is none of stacks, pyramid, spheres, columns, beds").into()
            );
        }
    }
    .with_tolerance(if scene == "spheres" { 1e-3 } else { 1e-8 })
    .with_threads(threads);
    let mut sums = [0.0; 4];
    let (mut begun, mut cpu) = (Instant::now(), ProcessTime::now());
    let (mut solved, mut active) = (0, 0);
    for k in 0..steps + skipped {
        if k == skipped {
            (begun, cpu) = (Instant::now(), ProcessTime::now());
        }
        let report = simulation.step(5e-3)?;
        if k >= skipped {
            let t = report.timings;
            for (sum, of) in sums.iter_mut().zip([t.detection, t.assembly, t.solve, t.total]) {
                *sum += of;
            }
            solved += usize::from(report.status.is_solved());
            active = report.counts.active;
        }
    }
    let wall = begun.elapsed().as_secs_f64();
    let [detection, assembly, solve, total] = sums;
    println!(
        "{scene} threads {threads}: wall {wall:.3} s, cpu {:.3}; detection {detection:.3}, statement {assembly:.3}, solution {solve:.3}, rest {:.3}; {solved} of {steps} solved, {active} contacts",
        cpu.elapsed().as_secs_f64(),
        wall - total
    );
    Ok(())
}

//! Times Rapier's steps on the worlds that the example `steps` of nonsmooth-simulate writes: median processor time in ms of 1000 steps of 5 ms, one thread, single precision, the
//! engine's own settings, but that no body sleeps.
//!
//!     cargo run --release -p nonsmooth-simulate --example steps -- 1e-8 1000 FOLDER
//!     cargo run --release --manifest-path docs/benchmarks/rapier/Cargo.toml -- FOLDER

use cpu_time::ProcessTime;
use std::error::Error;
use std::path::PathBuf;

use rapier3d::prelude::*;
use serde::Deserialize;
use serde::de::IgnoredAny;

#[derive(Deserialize)]
struct Described {
    free: bool,
    mass: f32,
    position: [f32; 3],
    /// w, x, y, z.
    rotation: [f32; 4],
    shapes: Vec<Form>,
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum Form {
    Sphere(f32),
    Box([f32; 3]),
    Plane(IgnoredAny),
}

/// Steps before the medians begin, and those that they are taken over.
const STEPS: (usize, usize) = (400, 1000);

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).ok_or("expected a folder")?);
    println!("Rapier 0.36.1");
    println!("{:<14} {:>9} {:>9} {:>12}", "scene", "contacts", "median", "deepest, mm");
    for (name, mu) in [("pyramid-55", 0.5), ("spheres-500", 0.4), ("spheres-1000", 0.4)] {
        let file = std::fs::read_to_string(folder.join(name).with_extension("json"))?;
        let described: Vec<Described> = serde_json::from_str(&file)?;
        let mut world = PhysicsWorld::new();
        world.gravity = Vector::new(0.0, 0.0, -9.81);
        world.integration_parameters.dt = 5e-3;
        for body in described {
            let [x, y, z] = body.position;
            let [w, i, j, k] = body.rotation;
            let pose = Pose::from_parts(Vector::new(x, y, z), Rotation::from_xyzw(i, j, k, w));
            let builder =
                if body.free { RigidBodyBuilder::dynamic() } else { RigidBodyBuilder::fixed() };
            let handle = world.insert_body(builder.pose(pose).can_sleep(false));
            for shape in body.shapes {
                let collider = match shape {
                    Form::Sphere(radius) => ColliderBuilder::ball(radius).mass(body.mass),
                    Form::Box([x, y, z]) => ColliderBuilder::cuboid(x, y, z).mass(body.mass),
                    Form::Plane(_) => ColliderBuilder::new(SharedShape::halfspace(Vector::Z)),
                };
                world.insert_collider(collider.friction(mu).restitution(0.0), Some(handle));
            }
        }
        let mut taken = vec![];
        for _ in 0..STEPS.0 + STEPS.1 {
            let begun = ProcessTime::now();
            world.step();
            taken.push(1e3 * begun.elapsed().as_secs_f64());
        }
        let kept = &mut taken[STEPS.0..];
        kept.sort_by(f64::total_cmp);
        let points = || {
            let pairs = world.narrow_phase.contact_pairs();
            pairs.flat_map(|pair| pair.manifolds().iter()).flat_map(|m| m.points.iter())
        };
        let deepest = points().map(|p| -p.dist).fold(0.0, f32::max);
        println!(
            "{name:<14} {:>9} {:>9.3} {:>12.3}",
            points().count(),
            kept[STEPS.1 / 2],
            1e3 * deepest
        );
    }
    Ok(())
}

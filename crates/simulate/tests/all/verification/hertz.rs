//! A rigid sphere that is pressed onto an elastic box, against Hertz: `F = (4/3) E* √R δ^(3/2)` for a half space, `E* = E/(1 − ν²)`, over a circle of radius `a = √(R δ)`.
//!
//! The box is a cube of 2 m on a rigid floor: the floor makes it stiffer than a half space and its free sides softer, which nearly cancels (3 % are left at a = 0.3 m; a box half as high is 19 % stiffer at
//! a = 0.2 m). What else is off is the mesh: a sphere on few nodes is stiff just after the next ring of nodes has come to touch and soft just before.

use nonsmooth_scenes::{ElasticBox, Material};
use nonsmooth_simulate::{
    Activation, Body, Elastic, MoreauJean, Motion, Part, Shape, Simulation, World,
};

use crate::verification::order;

const R: f64 = 4.0;
const YOUNG: f64 = 1e6;
const POISSON: f64 = 0.3;

fn hertz(depth: f64) -> f64 {
    4.0 / 3.0 * YOUNG / (1.0 - POISSON * POISSON) * (R * depth.powi(3)).sqrt()
}

/// Depths, evenly up to the contact radius of 0.3 m, forces and radii there, on a cube of n³ elements.
fn press(n: usize) -> Vec<[f64; 3]> {
    const STEPS: u32 = 16;
    const DEEPEST: f64 = 0.09 / R;
    let material =
        Material { density: 1e-3, young: YOUNG, poisson: POISSON, alpha: 0.0, beta: 0.0 };
    let mut solid = ElasticBox::new([2.0; 3], [n; 3], material).unwrap();
    solid.position = [0.0, 0.0, -1.0];
    solid.lumped = true;
    solid.hold_bottom();
    let mut world = World::new([0.0; 3]);
    world.add_elastic(Elastic::new(solid));
    let ball = Body::fixed(vec![Part::new(Shape::Sphere { radius: R })]).at([0.0, 0.0, R]);
    // The beginning of a swing, which is nearly uniform; steps so long that inertia is nothing.
    let swing: f64 = 0.1;
    let amplitude = [0.0, 0.0, -DEEPEST / swing.sin()];
    let frequency = swing / f64::from(STEPS);
    world.add(Body { motion: Motion::Oscillating { amplitude, frequency, phase: 0.0 }, ..ball });
    let scheme = MoreauJean { theta: 1.0, activation: Activation::Gap, ..MoreauJean::default() };
    let mut simulation = Simulation::new(world, scheme).unwrap();
    (0..STEPS)
        .map(|_| {
            let report = simulation.step(1.0).unwrap();
            assert!(report.status.is_solved() && report.residual <= 1e-10, "{report:?}");
            assert!(report.drift.penetration < 1e-3 * DEEPEST, "{report:?}");
            let (mut force, mut spread) = (0.0, 0.0);
            for contact in simulation.contacts() {
                let p = contact.world_impulse()[2].abs();
                let [x, y, _] = contact.point;
                (force, spread) = (force + p, spread + p * (x * x + y * y));
            }
            // The mean of r² under p ∝ √(1 − r²/a²) is (2/5) a².
            [R - simulation.state().position[0][2], force, (2.5 * spread / force).sqrt()]
        })
        .collect()
}

#[test]
fn a_sphere_sinks_into_a_box_as_hertz_has_it_the_more_so_the_finer_the_mesh() {
    // Elements over the radius of the largest circle: 1.5, 2.1, 3. Shares by which forces and radii may be off, and exponents from 1.5, where the circle has at least half of that radius.
    for (n, off, off_radius, slope) in
        [(10, 0.4, 0.42, 0.3), (14, 0.08, 0.17, 0.06), (20, 0.035, 0.095, 0.03)]
    {
        let mut pressed = press(n);
        pressed.retain(|&[depth, ..]| (R * depth).sqrt() > 0.15);
        let off_by = |of: &dyn Fn(&[f64; 3]) -> f64| {
            pressed.iter().map(|p| (of(p) - 1.0).abs()).fold(0.0, f64::max)
        };
        let worst = off_by(&|&[depth, force, _]| force / hertz(depth));
        let wide = off_by(&|&[depth, _, radius]| radius / (R * depth).sqrt());
        let exponent = order(&pressed.iter().map(|p| (p[0], p[1])).collect::<Vec<_>>());
        println!("{n}: forces off by {worst:.4}, radii by {wide:.4}, exponent {exponent:.4}");
        assert!(wide < off_radius, "{n}: {wide}");
        assert!(worst < off && (exponent - 1.5).abs() < slope, "{n}: {worst} {exponent}");
    }
}

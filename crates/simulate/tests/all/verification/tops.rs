//! Tops: steady precession of a heavy one, and what the tippe top keeps.

use nonsmooth_scenes::Rotation;
use nonsmooth_simulate::{
    Body, BodyId, Joint, MoreauJean, Part, Shape, SimulateError, Simulation, World,
};

use crate::verification::{G, near, run, simulation};

const Y: [f64; 3] = [0.0, 1.0, 0.0];

fn symmetric(mass: f64, across: f64, along: f64, parts: Vec<Part>) -> Body {
    let j = [[across, 0.0, 0.0], [0.0, across, 0.0], [0.0, 0.0, along]];
    Body::with_mass(mass, j, parts)
}

/// The third axis of a body.
fn axis(simulation: &Simulation, body: BodyId) -> [f64; 3] {
    simulation.state().rotation(body).matrix().map(|row| row[2])
}

/// m = 1, l = 0.5, I₁ = 0.3 about the pivot, I₃ = 0.02, θ = 30°, ω₃ = 200: I₁ Ω² cos θ − I₃ ω₃ Ω + m g l = 0 has Ω = 1.343485082120 and 14.052522096270.
#[test]
fn a_heavy_top_precesses_steadily() {
    let (l, spin, tilt) = (0.5, 200.0, std::f64::consts::FRAC_PI_6);
    let (s, c) = tilt.sin_cos();
    let momentum: f64 = 0.02 * spin;
    let root = (momentum * momentum - 4.0 * 0.3 * c * G * l).sqrt();
    for (sign, expected) in [(-1.0, 1.343485082120), (1.0, 14.052522096270)] {
        let omega = (momentum + sign * root) / (2.0 * 0.3 * c);
        near(omega, expected, 1e-11);
        let error = |h: f64| {
            let mut world = World::new([0.0, 0.0, -G]);
            let e3 = [s, 0.0, c];
            let about = spin - omega * c;
            let angular = [about * e3[0], 0.0, omega + about * e3[2]];
            let top = symmetric(1.0, 0.3 - l * l, 0.02, vec![])
                .at([l * s, 0.0, l * c])
                .turned(Rotation::about(Y, tilt))
                .moving([0.0, omega * l * s, 0.0], angular);
            let top = world.add(top);
            world.join(Joint::spherical(None, top, [0.0; 3]));
            let mut simulation = simulation(world);
            run(&mut simulation, 0.2, h);
            let [x, y, z] = axis(&simulation, top);
            [y.atan2(x) / (omega * 0.2) - 1.0, z - c].map(f64::abs)
        };
        let (coarse, fine) = (error(1e-4), error(2.5e-5));
        // Of the rate, and of the tilt.
        for (coarse, fine) in coarse.into_iter().zip(fine) {
            assert!(fine < 2e-6, "{omega}: {fine:e}");
            assert!((15.0..18.0).contains(&(coarse / fine)), "{omega}: {coarse:e} {fine:e}");
        }
    }
}

/// Over the sphere of radius R₁, centre a₁ up the axis, the stem's end of radius R₂, centre a₂, hangs until `cos θ = −(R₁ − R₂)/(a₂ − a₁)`.
#[test]
fn the_stem_of_a_tippe_top_touches_at_140_degrees() {
    let (r1, a1, r2, a2) = (0.015, 0.003, 0.005, 0.016);
    let touches: f64 = -0.769231;
    let turned = |cosine: f64| {
        let mut world = World::new([0.0; 3]);
        world.add(Body::floor());
        let ball = |radius: f64, z: f64| Part {
            position: [0.0, 0.0, z],
            ..Part::new(Shape::Sphere { radius })
        };
        let top = symmetric(6e-3, 8e-7, 7e-7, vec![ball(r1, a1), ball(r2, a2)])
            .at([0.0, 0.0, r1 - a1 * cosine])
            .turned(Rotation::about(Y, cosine.acos()));
        world.add(top);
        Simulation::new(world, MoreauJean::default())
    };
    let gaps = |cosine: f64| {
        let mut simulation = turned(cosine).unwrap();
        assert!(simulation.step(1e-3).unwrap().status.is_solved());
        let mut gaps: Vec<f64> = simulation.contacts().iter().map(|c| c.gap).collect();
        gaps.sort_by(f64::total_cmp);
        gaps
    };
    let at = gaps(touches);
    assert!(at.len() == 2 && at.iter().all(|g| g.abs() < 1e-8), "{at:?}");
    // As much less turned it touches nothing, and turned further it would be deep, which is no start.
    assert_eq!(gaps(touches + 1e-4).len(), 1);
    match turned(touches - 1e-4) {
        Err(SimulateError::Overlap(pairs)) => near(pairs[0].depth, 1.3e-6, 1e-8),
        other => panic!("{:?}", other.map(|_| "no overlap")),
    }
    near(touches.acos().to_degrees(), 140.28, 5e-3);
}

/// Jellett's integral `L · (R₁ e_z − a₁ e₃)` is kept by every force at the contact of a sphere of radius R₁ about a point of the axis a₁ above the mass centre.
#[test]
fn a_tippe_top_keeps_jelletts_integral() {
    let (r1, a1, r2, a2, tilt) = (0.015, 0.003, 0.005, 0.016, 0.1_f64);
    let drift = |h: f64| {
        let mut world = World::new([0.0, 0.0, -G]).with_law(nonsmooth_simulate::Law::friction(0.3));
        world.add(Body::floor());
        let ball = |radius: f64, z: f64| Part {
            position: [0.0, 0.0, z],
            ..Part::new(Shape::Sphere { radius })
        };
        let top = symmetric(6e-3, 8e-7, 7e-7, vec![ball(r1, a1), ball(r2, a2)])
            .at([0.0, 0.0, r1 - a1 * tilt.cos()])
            .turned(Rotation::about(Y, tilt))
            .moving([0.0; 3], [180.0 * tilt.sin(), 0.0, 180.0 * tilt.cos()]);
        let top = world.add(top);
        let mut simulation = simulation(world);
        let jellett = |simulation: &Simulation| {
            let r = simulation.state().rotation(top).matrix();
            let spin = simulation.state().spin[top.index()];
            let momentum = [8e-7 * spin[0], 8e-7 * spin[1], 7e-7 * spin[2]];
            let l = r.map(|row| (0..3).map(|k| row[k] * momentum[k]).sum::<f64>());
            let e3 = axis(simulation, top);
            r1 * l[2] - a1 * (0..3).map(|k| l[k] * e3[k]).sum::<f64>()
        };
        let first = jellett(&simulation);
        run(&mut simulation, 0.3, h);
        (jellett(&simulation) / first - 1.0).abs()
    };
    // The second order even.
    let (coarse, fine) = (drift(2e-4), drift(5e-5));
    assert!(fine < 1e-10 && fine < coarse / 14.0, "{coarse:e} {fine:e}");
}

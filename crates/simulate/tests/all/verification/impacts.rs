//! Impacts in one step.

use nonsmooth_problem::check::Motion;
use nonsmooth_simulate::{Body, Simulation, World};

use crate::verification::{
    G, ball, block, frozen, near, omega, run, simulation, v, weightless, world, x,
};

#[test]
fn an_oblique_impact_sticks_or_slips() {
    let (mu, e, vn, radius) = (0.3, 0.5, 2.0, 0.1);
    let limit = 3.5 * mu * (1.0 + e) * vn;
    near(limit, 3.15, 1e-12);
    for vt in [3.0, limit * (1.0 - 1e-4), limit * (1.0 + 1e-4), 4.0, 6.0] {
        let mut world = weightless(mu, e);
        world.add(Body::floor());
        let b = world.add(ball(radius).at([0.0, 0.0, radius]).moving([vt, 0.0, -vn], [0.0; 3]));
        let mut simulation = simulation(world);
        run(&mut simulation, 1e-2, 1e-2);
        let lost = mu * (1.0 + e) * vn;
        // The velocities of both cases meet at the limit; which one it was, the contact says.
        let (motion, after, spin) = match vt <= limit {
            true => (Motion::Stick, vt / 1.4, vt / 1.4),
            false => (Motion::Slip, vt - lost, 2.5 * lost),
        };
        assert_eq!(simulation.contacts()[0].motion(), Some(motion), "{vt}");
        near(v(&simulation, b)[0], after, 1e-12);
        near(v(&simulation, b)[2], e * vn, 1e-12);
        near(radius * omega(&simulation, b)[1], spin, 1e-12);
    }
}

/// The block of half width b and half height c turns with Ω = 1 about its left lower edge and lands flat.
fn landing(b: f64, c: f64, mu: f64) -> (Simulation, nonsmooth_simulate::BodyId) {
    let mut world = weightless(mu, 0.0);
    world.add(Body::floor());
    // ω × (centre − edge) with ω = e_y and the edge at (−b, −c).
    let body = block([b, 0.3, c]).at([0.0, 0.0, c]).moving([c, 0.0, -b], [0.0, 1.0, 0.0]);
    let body = world.add(body);
    let mut simulation = frozen(world);
    run(&mut simulation, 1e-3, 1e-3);
    (simulation, body)
}

#[test]
fn a_rocking_block_loses_what_housner_says() {
    // Where nothing slips η = 1 − (3/2) sin²α, which b/c = √2 makes zero.
    let housner = |b: f64, c: f64| (1.0 - 1.5 * b * b / (b * b + c * c)).max(0.0);
    let [below, above] = [-1e-3, 1e-3].map(|share| 0.4 * 2f64.sqrt() * (1.0 + share));
    assert!(housner(below, 0.4) > 5e-4 && housner(above, 0.4) == 0.0);
    for (b, c, mu, eta, within) in [
        (0.1, 0.4, 0.3, 0.911764705882, 1e-11),
        (0.1, 0.4, 0.8, 0.911764705882, 1e-11),
        (0.2, 0.4, 0.8, 0.7, 1e-11),
        (0.2, 0.4, 0.3, 0.612903225806, 1e-11),
        (0.4, 0.4, 0.7, 0.25, 1e-10),
        // The impulse at the new edge is at the limit of friction and nothing slides: a residual of 1e-12 leaves a velocity of its root.
        (0.4, 0.4, 0.6, 0.25, 1e-6),
        (0.4, 0.4, 0.3, 0.0, 1e-11),
        (below, 0.4, 0.9, housner(below, 0.4), 2e-11),
        (above, 0.4, 0.9, 0.0, 1e-11),
        (0.6, 0.4, 0.9, 0.0, 1e-11),
    ] {
        let (simulation, body) = landing(b, c, mu);
        near(omega(&simulation, body)[1], eta, within);
        let sticks = (eta - housner(b, c)).abs() < 1e-9;
        assert_eq!(sticks, mu > 0.5 || b < 0.2, "{b} {c} {mu}");
        if sticks {
            let j = simulation.world().bodies[body.index()].inertia[1][1];
            let twice = |[x, _, z]: [f64; 3], turn: f64| x * x + z * z + j * turn * turn;
            let turn = omega(&simulation, body)[1];
            let kept = twice(v(&simulation, body), turn) / twice([c, 0.0, -b], 1.0);
            near(kept, eta * eta, within);
        }
    }
    // The impulse at the new edge.
    let (simulation, _) = landing(0.1, 0.4, 0.5);
    let (mut normal, mut tangential) = (0.0, 0.0);
    for contact in simulation.contacts() {
        let p = contact.world_impulse();
        if contact.point[0] > 0.0 {
            (normal, tangential) = (normal + p[2], tangential + p[0]);
        } else {
            assert!(contact.impulse[0].abs() < 1e-12);
        }
    }
    near(normal, 0.191176471, 1e-9);
    near(tangential, -0.0352941176, 1e-9);
}

#[test]
fn a_rocking_block_swings_in_the_time_of_its_pendulum() {
    let (b, c): (f64, f64) = (0.1, 0.4);
    let alpha = b.atan2(c);
    let p = (0.75 * G / b.hypot(c)).sqrt();
    // Four times the exact quarter swing, and Ω before the impact, from θ₀ = α/2 and α/4.
    for (part, period, before) in
        [(0.5, 1.249234300450, 0.893414307303), (0.25, 0.755515608751, 0.681821614076)]
    {
        let (h, theta) = (5e-4, part * alpha);
        near(p * (2.0 * ((alpha - theta).cos() - alpha.cos())).sqrt(), before, 1e-11);
        // ∫ dθ/Ω with θ = θ₀ − u², which has no singularity at rest, by the midpoint rule.
        let n = 100_000;
        let du = theta.sqrt() / f64::from(n);
        let slow = |u: f64| {
            2.0 * u / (p * (4.0 * (alpha - theta + 0.5 * u * u).sin() * (0.5 * u * u).sin()).sqrt())
        };
        let quarter: f64 = (0..n).map(|k| du * slow((f64::from(k) + 0.5) * du)).sum();
        near(4.0 * quarter, period, 1e-10);
        let mut world = world(0.9, 0.0);
        world.add(Body::floor());
        // Turned by θ about e_y, standing on the edge at the origin.
        let (s, k) = theta.sin_cos();
        let centre = [-b * k + c * s, 0.0, b * s + c * k];
        let rotation = nonsmooth_scenes::Rotation::about([0.0, 1.0, 0.0], theta);
        let body = world.add(block([b, 0.3, c]).at(centre).turned(rotation));
        let mut simulation = simulation(world);
        let tilt = |s: &Simulation| 2.0 * s.state().rotation[body.index()][2].asin();
        let (mut fastest, mut time, mut left) = (0.0_f64, 0.0, 0.0);
        for _ in 0..2000 {
            let report = simulation.step(h).unwrap();
            assert!(report.status.is_solved() && report.energy.relative_imbalance() < 1e-12);
            let now = omega(&simulation, body)[1].abs();
            if now < fastest {
                break; // the impact
            }
            (fastest, time, left) = (now, simulation.state().t, tilt(&simulation));
        }
        // What is left of the tilt before the impact takes so long yet, and makes it so much faster.
        let rest = left / fastest;
        near(4.0 * (time + rest), period, 1e-5);
        near(fastest + p * p * alpha.sin() * rest, before, 1e-5);
        // The edge has not moved.
        let tilt = tilt(&simulation);
        let edge = x(&simulation, body)[0] + b * tilt.cos() - c * tilt.sin();
        near(edge, 0.0, 1e-7);
    }
}

/// Balls in a row, `gap` between neighbours; the first comes with velocity 1.
fn cradle(count: usize, e: f64, gap: f64) -> World {
    let mut world = weightless(0.0, e);
    for k in 0..count {
        let at = [k as f64 * (0.2 + gap), 0.0, 0.0];
        let speed = if k == 0 { 1.0 } else { 0.0 };
        world.add(ball(0.1).at(at).moving([speed, 0.0, 0.0], [0.0; 3]));
    }
    world
}

#[test]
fn touching_balls_take_newtons_law_all_at_once() {
    for (count, e) in [(2, 1.0), (2, 0.5), (3, 1.0), (5, 1.0), (5, 0.3)] {
        let mut simulation = simulation(cradle(count, e, 0.0));
        run(&mut simulation, 1e-3, 1e-3);
        let n = count as f64;
        for k in 0..count {
            let expected = if k == 0 { (1.0 + e) / n - e } else { (1.0 + e) / n };
            near(simulation.state().velocity[k][0], expected, 1e-11);
        }
        for (c, contact) in simulation.contacts().iter().enumerate() {
            near(contact.impulse[0], (n - c as f64 - 1.0) * (1.0 + e) / n, 1e-11);
        }
    }
}

#[test]
fn balls_with_gaps_hand_the_velocity_on() {
    let mut simulation = simulation(cradle(5, 1.0, 0.01));
    run(&mut simulation, 0.2, 1e-3);
    for k in 0..5 {
        near(simulation.state().velocity[k][0], if k == 4 { 1.0 } else { 0.0 }, 1e-12);
    }
}

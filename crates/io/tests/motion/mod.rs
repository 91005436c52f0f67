//! A small run to be written: a floor, a ball that bounces and a box that slides.

use nonsmooth_io::trajectory::{
    Checkpoint, Contact, Energy, Frame, Joint, Named, State, Step, Trajectory,
};
use nonsmooth_problem::check::Motion;

/// `frames` frames of three bodies, every second step; contacts come and go.
pub fn run(frames: usize) -> Trajectory {
    let named = |name: &str, fixed| Named { name: name.into(), fixed };
    let frame = |k: usize| {
        let t = 0.01 * k as f64;
        let state = |x: f64, z: f64, angle: f64| State {
            position: [x, 0.0, z],
            rotation: [(0.5 * angle).cos(), 0.0, (0.5 * angle).sin(), 0.0],
            velocity: [1.0, 0.0, -t],
            angular_velocity: [0.0, angle, 0.0],
        };
        let contact = |c: usize| Contact {
            key: [0, 1 + c as u32, 7, u32::MAX - c as u32],
            a: 0,
            b: 1 + (c % 2) as u32,
            point: [t, c as f64, 0.0],
            offset: [0.0, 0.0, if c == 3 { 2.0 } else { 0.0 }],
            frame: [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            gap: -1e-9,
            mu: 0.3,
            r: [2.0, -0.5, 0.25],
            u: [0.0, 0.125, 0.0],
            mu_r: if c % 2 == 1 { 0.01 } else { 0.0 },
            moment: if c % 2 == 1 { [1e-3, -t] } else { [0.0; 2] },
            rolling: if c % 2 == 1 { [0.0, t] } else { [0.0; 2] },
            status: [None, Some(Motion::Open), Some(Motion::Stick), Some(Motion::Slip)][c % 4],
        };
        let bounce = (6.0 * t).sin().abs();
        Frame {
            step: 2 * k as u64,
            time: t,
            bodies: vec![state(0.0, 0.0, 0.0), state(t, 0.2 + bounce, t), state(-t, 0.5, 0.0)],
            contacts: (0..k % 5).map(contact).collect(),
            joints: vec![Joint {
                angle: t,
                slide: -t,
                impulse: [1.0, t, 0.0],
                moment: [0.0, 0.5, t],
                violation: 1e-16,
            }],
            elastic: vec![],
        }
    };
    let step = |k: usize| Step {
        number: k as u64 + 1,
        time: 0.005 * (k + 1) as f64,
        h: 0.005,
        status: ["solved", "solver: limit", "not_finite"][k * k % 3].into(),
        residual: if k == 3 { f64::NAN } else { 1e-12 },
        iterations: 3 * k as u64,
        newton: 2,
        near: 5,
        active: 4,
        open: 1,
        stick: 1,
        slip: 2,
        penetration: 1e-9,
        wall: 1e-4,
        energy: Energy {
            kinetic: 1.0,
            joints: -2.0,
            potential: k as f64,
            imbalance: -0.0,
            ..Energy::default()
        },
    };
    Trajectory {
        scene: "title = \"Käfer\"\n[[body]]\n".into(),
        program: "nonsmooth 0.1.0".into(),
        bodies: vec![named("floor", true), named("Kugel ⌀ 0.4", false), named("", false)],
        elastic: vec![],
        joints: vec!["Gelenk".into()],
        frames: (0..frames).map(frame).collect(),
        steps: (0..2 * frames).map(step).collect(),
        checkpoint: Some(Checkpoint {
            step: 2 * frames as u64,
            time: 0.1,
            state: (0..=255).collect(),
        }),
    }
}

//! A made-up motion with every form: a ball bounces over a floor, a box slides and turns, a capsule rolls, a prism tumbles against a fixed block.

use nonsmooth_problem::check::Motion;
use nonsmooth_scenes::draw::playback::{Drawn, Energy, Form, Moment, Placed, Playback};
use nonsmooth_scenes::draw::{Pose, Touch, View};
use nonsmooth_scenes::{Polyhedron, Rotation};

fn placed(form: Form) -> Placed {
    Placed { form, position: [0.0; 3], rotation: Rotation::IDENTITY }
}

/// Frames at 100 a second.
pub fn playback(frames: usize) -> Playback {
    let prism = Polyhedron::prism(
        &[[-0.15, -0.1, -0.1], [0.15, -0.1, -0.1], [0.0, 0.2, -0.1]],
        [0.0, 0.0, 0.2],
    )
    .unwrap();
    let drawn = |name: &str, fixed, parts| Drawn { name: name.into(), fixed, parts };
    let hammer = vec![
        Placed { position: [0.0, 0.0, 0.2], ..placed(Form::Box { half: [0.05, 0.12, 0.05] }) },
        placed(Form::Capsule { half_length: 0.15, radius: 0.03 }),
    ];
    let beside = |x: f64| move |form| Placed { position: [x, 0.0, 0.0], ..placed(form) };
    let block = vec![
        placed(Form::Box { half: [0.1, 0.5, 0.3] }),
        beside(0.4)(Form::Cylinder { half_length: 0.2, radius: 0.1 }),
        beside(0.8)(Form::Cone { half_length: 0.2, radius: 0.1 }),
        beside(1.2)(Form::Mesh {
            vertices: vec![[0.0; 3], [0.2, 0.0, 0.0], [0.0, 0.2, 0.1]],
            faces: vec![vec![0, 1, 2]],
        }),
    ];
    let bodies = vec![
        drawn("floor", true, vec![placed(Form::Plane)]),
        drawn("ball", false, vec![placed(Form::Sphere { radius: 0.2 })]),
        drawn("box", false, vec![placed(Form::Box { half: [0.2, 0.15, 0.1] })]),
        drawn("roll", false, vec![placed(Form::Capsule { half_length: 0.25, radius: 0.1 })]),
        drawn(
            "prism",
            false,
            vec![placed(Form::Polyhedron {
                vertices: prism.vertices().to_vec(),
                faces: prism.faces().to_vec(),
            })],
        ),
        drawn("hammer", false, hammer),
        drawn("block", true, block),
    ];
    let moment = |k: usize| {
        let t = 0.01 * k as f64;
        let at = |position, rotation: Rotation| Pose {
            position,
            rotation: rotation.0,
            velocity: [0.0; 3],
        };
        let bounce = (1.0 - t).abs() * (3.0 * t).cos().abs();
        let across = Rotation::about([1.0, 0.0, 0.0], 0.5 * std::f64::consts::PI);
        let poses = vec![
            at([0.0; 3], Rotation::IDENTITY),
            at([-0.8 + 0.4 * t, 0.0, 0.2 + bounce], Rotation::about([0.0, 1.0, 0.0], 4.0 * t)),
            at([0.3 * t, 0.6, 0.1], Rotation::about([0.0, 0.0, 1.0], t)),
            at(
                [-0.5 + 0.5 * t, -0.6, 0.1],
                Rotation::about([0.0, 1.0, 0.0], 5.0 * t).after(across),
            ),
            at([0.8, 0.0, 0.3 + 0.1 * (5.0 * t).sin()], Rotation::about([1.0, 1.0, 0.0], 3.0 * t)),
            at([0.0, -0.1, 0.9], Rotation::about([1.0, 0.0, 0.0], 2.0 * t)),
            at([1.3, 0.0, 0.3], Rotation::IDENTITY),
        ];
        let touch = |a, b: usize, point, r, status| Touch {
            a,
            b,
            point,
            offset: [0.0; 3],
            frame: [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            mu: 0.3,
            r: Some(r),
            u: None,
            status,
        };
        let (box_, roll) = (poses[2].position, poses[3].position);
        let mut contacts = vec![
            touch(Some(0), 3, [roll[0], roll[1], 0.0], [0.8, 0.0, 0.0], Some(Motion::Stick)),
            touch(
                Some(0),
                2,
                [box_[0] - 0.1, box_[1] - 0.1, 0.0],
                [0.4, -0.1, 0.0],
                Some(Motion::Slip),
            ),
            touch(
                Some(0),
                2,
                [box_[0] + 0.1, box_[1] + 0.1, 0.0],
                [0.6, -0.2, 0.0],
                Some(Motion::Slip),
            ),
            touch(Some(4), 6, [1.2, 0.0, 0.3], [0.0; 3], Some(Motion::Open)),
        ];
        if bounce < 0.05 {
            contacts.push(touch(
                Some(0),
                1,
                [poses[1].position[0], 0.0, 0.0],
                [6.0, 0.5, 0.0],
                Some(Motion::Slip),
            ));
        } else {
            contacts.push(touch(Some(0), 1, [poses[1].position[0], 0.0, 0.0], [0.0; 3], None));
        }
        Moment { time: t, poses, contacts, shapes: vec![] }
    };
    let energy = |k: usize| {
        let time = 0.01 * k as f64;
        let potential = 9.81 * (1.0 - time).abs() * (3.0 * time).cos().abs();
        Energy { time, kinetic: 12.0 * (-0.4 * time).exp() - potential, potential }
    };
    let residual = |k: usize| {
        [
            0.01 * k as f64,
            1e-11 * (1.5 + (0.7 * k as f64).sin()) * if k.is_multiple_of(37) { 300.0 } else { 1.0 },
        ]
    };
    Playback {
        title: "Everything that moves <b>".into(),
        view: View::default(),
        bodies,
        frames: (0..frames).map(moment).collect(),
        energy: (0..frames).map(energy).collect(),
        residual: (1..frames).map(residual).collect(),
        jump: None,
    }
}

//! Assembly against mechanics: Newton's third law, finite differences, definiteness.

use nonsmooth_linalg::Csc;
use nonsmooth_scenes::{Contact, Gyroscopic, Image, RigidBody, Rotation, Scene, Shape, Vec3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Three turned and moving bodies in contact with each other and with the ground, in general position.
fn tumbling() -> Scene {
    let mut rng = Pcg64::seed_from_u64(3);
    let mut vector = |size: f64| -> Vec3 { [(); 3].map(|()| size * rng.random_range(-1.0..=1.0)) };
    let shapes = [
        Shape::Box { half: [0.3, 0.5, 0.2] },
        Shape::Sphere { radius: 0.4 },
        Shape::Box { half: [0.1, 0.7, 0.4] },
    ];
    let bodies = shapes
        .into_iter()
        .map(|shape| RigidBody {
            position: vector(1.0),
            rotation: Rotation::about(vector(1.0), 2.0),
            velocity: vector(1.0),
            angular_velocity: vector(3.0),
            force: vector(50.0),
            ..RigidBody::solid(shape, 800.0).unwrap()
        })
        .collect();
    let contacts = [(None, 0), (Some(0), 1), (Some(1), 2), (None, 2), (Some(2), 0)]
        .map(|(a, b)| Contact::new(a, b, vector(1.0), vector(2.0), 0.3, 0.4))
        .to_vec();
    Scene {
        name: "tumbling".into(),
        bodies,
        solids: vec![],
        contacts,
        gravity: [0.0, 0.0, -9.81],
        h: 0.02,
        gyroscopic: Gyroscopic::Explicit,
        ground: None,
        obstacles: vec![],
        periods: vec![],
    }
}

fn dense(a: &Csc) -> Vec<Vec<f64>> {
    (0..a.nrows()).map(|i| (0..a.ncols()).map(|j| a.get(i, j)).collect()).collect()
}

/// The smallest pivot of a Cholesky factorisation without pivoting, negative where A is not definite.
fn least_pivot(mut a: Vec<Vec<f64>>) -> f64 {
    let n = a.len();
    let mut least = f64::INFINITY;
    for k in 0..n {
        least = least.min(a[k][k]);
        for i in k + 1..n {
            let f = a[i][k] / a[k][k];
            for j in k + 1..n {
                a[i][j] -= f * a[k][j];
            }
        }
    }
    least
}

#[test]
fn frames_are_orthonormal_and_right_handed() {
    let along_x = Contact::new(None, 0, [0.0; 3], [-2.0, 0.0, 0.0], 0.5, 0.0);
    let contacts = [tumbling().contacts, vec![along_x]].concat();
    for frame in contacts.iter().map(Contact::frame) {
        for i in 0..3 {
            for j in 0..3 {
                let dot: f64 = (0..3).map(|k| frame[i][k] * frame[j][k]).sum();
                assert!((dot - f64::from(u8::from(i == j))).abs() < 1e-14);
            }
        }
        let [n, s, t] = frame;
        assert!((s[0] * t[1] - s[1] * t[0] - n[2]).abs() < 1e-14);
        assert!((s[1] * t[2] - s[2] * t[1] - n[0]).abs() < 1e-14);
    }
}

#[test]
fn contacts_obey_newtons_third_law() {
    let scene = tumbling();
    let h = scene.problem().unwrap().H;
    for (c, contact) in scene.contacts.iter().enumerate() {
        let frame = contact.frame();
        for k in 0..3 {
            let mut linear = [0.0; 3];
            // Moment about the origin: that of the impulse on each body, and that of its mass centre's momentum.
            let mut moment = [0.0; 3];
            for (b, body) in scene.bodies.iter().enumerate() {
                let p: Vec3 = std::array::from_fn(|i| h.get(6 * b + i, 3 * c + k));
                let x = body.position;
                for i in 0..3 {
                    let (j, l) = ((i + 1) % 3, (i + 2) % 3);
                    linear[i] += p[i];
                    moment[i] += h.get(6 * b + 3 + i, 3 * c + k) + x[j] * p[l] - x[l] * p[j];
                }
            }
            let (p, d) = (contact.point, frame[k]);
            for i in 0..3 {
                let (j, l) = ((i + 1) % 3, (i + 2) % 3);
                // Two bodies: nothing remains. The ground: its reaction at the point.
                let outside = if contact.a.is_none() { 1.0 } else { 0.0 };
                assert!((linear[i] - outside * d[i]).abs() < 1e-14);
                let torque = p[j] * d[l] - p[l] * d[j];
                assert!((moment[i] - outside * torque).abs() < 1e-14);
            }
        }
    }
}

#[test]
fn relative_velocities_agree_with_finite_differences() {
    let scene = tumbling();
    let problem = scene.problem().unwrap();
    let mut u = vec![0.0; problem.w.len()];
    problem.H.mul_transpose_add(1.0, &scene.velocities(), &mut u);
    // Where the material point of a body that is at `p` now will be at time t.
    let moved = |body: Option<usize>, p: Vec3, t: f64| {
        let Some(b) = body.map(|b| &scene.bodies[b]) else {
            return p;
        };
        let speed = b.angular_velocity.iter().map(|w| w * w).sum::<f64>().sqrt();
        let turned = Rotation::about(b.angular_velocity, speed * t).after(b.rotation);
        let still = RigidBody { position: [0.0; 3], ..b.clone() };
        let r = b.rotation.matrix();
        let arm: Vec3 = std::array::from_fn(|k| p[k] - b.position[k]);
        let local = std::array::from_fn(|k| (0..3).map(|i| r[i][k] * arm[i]).sum());
        let rotated = RigidBody { rotation: turned, ..still }.to_world(local);
        std::array::from_fn(|k| b.position[k] + t * b.velocity[k] + rotated[k])
    };
    for (c, contact) in scene.contacts.iter().enumerate() {
        let gap = |t: f64| -> Vec3 {
            let (a, b) =
                (moved(contact.a, contact.point, t), moved(Some(contact.b), contact.point, t));
            std::array::from_fn(|k| b[k] - a[k])
        };
        let t = 1e-5;
        let (after, before) = (gap(t), gap(-t));
        for (k, axis) in contact.frame().iter().enumerate() {
            let rate: f64 = (0..3).map(|i| axis[i] * (after[i] - before[i]) / (2.0 * t)).sum();
            assert!((u[3 * c + k] - rate).abs() < 1e-8, "{} {rate}", u[3 * c + k]);
        }
    }
}

#[test]
fn the_mass_matrix_is_symmetric_positive_definite() {
    let scene = tumbling();
    let m = scene.problem().unwrap().M;
    assert_eq!(m.asymmetry(), 0.0);
    assert!(least_pivot(dense(&m)) > 0.0);
    // Kinetic energy in the body frame, where the inertia is diagonal.
    let v = scene.velocities();
    let mut p = vec![0.0; v.len()];
    m.mul_add(1.0, &v, &mut p);
    let energy: f64 = v.iter().zip(&p).map(|(v, p)| v * p).sum();
    let exact: f64 = scene
        .bodies
        .iter()
        .map(|b| {
            let r = b.rotation.matrix();
            let spin = (0..3).map(|k| {
                let omega: f64 = (0..3).map(|i| r[i][k] * b.angular_velocity[i]).sum();
                b.inertia[k][k] * omega * omega
            });
            b.mass * b.velocity.iter().map(|x| x * x).sum::<f64>() + spin.sum::<f64>()
        })
        .sum();
    assert!((energy - exact).abs() < 1e-12 * exact);
}

#[test]
fn the_delassus_operator_is_symmetric_positive_semidefinite() {
    let mut scene = tumbling();
    let w = scene.condensed().unwrap().W;
    assert!(w.asymmetry() < 1e-14);
    // Every body in two contacts more than once: W is singular, and definite on adding a little.
    scene.contacts.extend(scene.contacts.clone());
    let w = scene.condensed().unwrap().W;
    assert!(w.asymmetry() < 1e-14);
    let mut a = dense(&w.to_csc());
    let largest = (0..a.len()).map(|k| a[k][k]).fold(0.0, f64::max);
    (0..a.len()).for_each(|k| a[k][k] += 1e-9 * largest);
    assert!(least_pivot(a) > 0.0);
}

#[test]
fn free_motion_conserves_and_accelerates_as_it_should() {
    // Without contact impulses M v = f: gravity and the force change the momentum, gyroscopic terms turn ω.
    let scene = tumbling();
    let problem = scene.problem().unwrap();
    let (body, h) = (&scene.bodies[0], scene.h);
    let mut before = vec![0.0; problem.dofs()];
    problem.M.mul_add(1.0, &scene.velocities(), &mut before);
    for k in 0..3 {
        let force = body.mass * scene.gravity[k] + body.force[k];
        assert!((problem.f[k] - before[k] - h * force).abs() < 1e-12);
        // Euler's equations: J dω/dt = −ω × J ω, here from the angular momentum in f.
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let omega = body.angular_velocity;
        let turning = omega[i] * before[3 + j] - omega[j] * before[3 + i];
        assert!((problem.f[3 + k] - before[3 + k] + h * turning).abs() < 1e-12);
    }
}

#[test]
fn implicit_gyroscopic_terms_are_the_derivative_of_the_torque() {
    let explicit = tumbling();
    let implicit = Scene { gyroscopic: Gyroscopic::Implicit, ..explicit.clone() };
    let (e, i) = (explicit.problem().unwrap(), implicit.problem().unwrap());
    // The torque ω × J ω of a body, by the moment that f holds beside the momentum.
    let torque = |b: usize, omega: Vec3| -> Vec3 {
        let mut scene = explicit.clone();
        scene.bodies[b].angular_velocity = omega;
        let p = scene.problem().unwrap();
        let mut momentum = vec![0.0; p.dofs()];
        p.M.mul_add(1.0, &scene.velocities(), &mut momentum);
        std::array::from_fn(|k| (momentum[6 * b + 3 + k] - p.f[6 * b + 3 + k]) / scene.h)
    };
    let step = 1e-4;
    for (b, body) in explicit.bodies.iter().enumerate() {
        for l in 0..3 {
            let at = |s: f64| {
                let mut omega = body.angular_velocity;
                omega[l] += s;
                torque(b, omega)
            };
            let (after, before) = (at(step), at(-step));
            for k in 0..3 {
                let (row, column) = (6 * b + 3 + k, 6 * b + 3 + l);
                let added = (i.M.get(row, column) - e.M.get(row, column)) / explicit.h;
                // The torque is quadratic in ω: the central difference is exact but for rounding.
                let derivative = (after[k] - before[k]) / (2.0 * step);
                assert!((added - derivative).abs() < 1e-6, "{b} {k} {l}: {added} {derivative}");
            }
        }
    }
    // f is stated with the M in use, so that v_k still enters as M v_k.
    let forces = |p: &nonsmooth_problem::FrictionGlobal<3>| {
        let mut rest = p.f.clone();
        p.M.mul_add(-1.0, &explicit.velocities(), &mut rest);
        rest
    };
    assert!(forces(&e).iter().zip(forces(&i)).all(|(a, b)| (a - b).abs() < 1e-10));
    assert!(i.M.asymmetry() > 1e-3 && explicit.condensed().unwrap().W.asymmetry() < 1e-14);
    assert!(implicit.condensed().unwrap().W.asymmetry() > 1e-3);
}

#[test]
fn walls_and_images_move_as_given() {
    let mut scene = tumbling();
    let u = |scene: &Scene| {
        let p = scene.problem().unwrap();
        let mut u = p.w.clone();
        p.H.mul_transpose_add(1.0, &scene.velocities(), &mut u);
        u
    };
    scene.contacts.iter_mut().for_each(|c| c.e = 0.0);
    let before = u(&scene);
    let velocity = [0.3, -0.2, 0.5];
    scene.contacts.iter_mut().for_each(|c| c.image = Image { offset: [0.0; 3], velocity });
    let after = u(&scene);
    for (c, contact) in scene.contacts.iter().enumerate() {
        for (k, axis) in contact.frame().iter().enumerate() {
            let less: f64 = (0..3).map(|i| axis[i] * velocity[i]).sum();
            assert!((before[3 * c + k] - less - after[3 * c + k]).abs() < 1e-14);
        }
    }
    // Newton's law turns the whole approach around: u_N + e u_N,k.
    scene.contacts.iter_mut().for_each(|c| c.e = 0.5);
    let bounced = u(&scene);
    for c in 0..scene.contacts.len() {
        assert!((bounced[3 * c] - 1.5 * after[3 * c]).abs() < 1e-14);
        assert_eq!(bounced[3 * c + 1..3 * c + 3], after[3 * c + 1..3 * c + 3]);
    }
}

#[test]
fn a_body_may_touch_its_own_image_only() {
    let mut scene = tumbling();
    scene.contacts[4].a = Some(scene.contacts[4].b);
    let e = scene.problem().unwrap_err().to_string();
    assert!(e.starts_with("contacts[4]: expected two different bodies"), "{e}");
    scene.contacts[4].image.offset = [2.0, 0.0, 0.0];
    // The two impulses cancel and leave the couple offset × d.
    let h = scene.problem().unwrap().H;
    let b = scene.contacts[4].b;
    for (k, d) in scene.contacts[4].frame().iter().enumerate() {
        let couple = [0.0, -2.0 * d[2], 2.0 * d[1]];
        for i in 0..3 {
            assert!(h.get(6 * b + i, 12 + k).abs() < 1e-15);
            assert!((h.get(6 * b + 3 + i, 12 + k) - couple[i]).abs() < 1e-14);
        }
    }
    scene.contacts[4].image.velocity[2] = f64::NAN;
    assert!(scene.problem().unwrap_err().to_string().starts_with("contacts[4].image: expected"));
}

#[test]
fn impossible_scenes_name_what_is_wrong() {
    let spoilt = |spoil: &dyn Fn(&mut Scene)| {
        let mut scene = tumbling();
        spoil(&mut scene);
        scene.problem().unwrap_err().to_string()
    };
    let cases: [(&str, String); 8] = [
        ("bodies[1].mass: expected a positive", spoilt(&|s| s.bodies[1].mass = -1.0)),
        ("bodies[0].inertia: expected", spoilt(&|s| s.bodies[0].inertia[1][1] = 0.0)),
        ("bodies[2].rotation: expected a unit", spoilt(&|s| s.bodies[2].rotation.0 = [0.0; 4])),
        ("bodies[2].velocity: expected", spoilt(&|s| s.bodies[2].velocity[1] = f64::NAN)),
        ("contacts[4]: expected two different", spoilt(&|s| s.contacts[4].a = Some(0))),
        ("contacts[1]: expected two different", spoilt(&|s| s.contacts[1].b = 3)),
        ("contacts[3].normal: expected", spoilt(&|s| s.contacts[3].normal = [0.0; 3])),
        ("h: expected a positive number", spoilt(&|s| s.h = 0.0)),
    ];
    for (start, message) in cases {
        assert!(message.starts_with(start), "{message}");
    }
}

/// Five rows a contact: the first three are those without rolling friction, the others the angular velocity of b seen from a; and rolling balls end as the
/// law says.
#[test]
fn rolling_friction_adds_the_angular_velocities_of_the_bodies() {
    use nonsmooth_problem::{Friction, Problem};
    use nonsmooth_scenes::scenes::{Family, SpherePile};
    let pile = SpherePile { count: 30, spin: 2.0, ..SpherePile::default() };
    let plain = pile.build().unwrap();
    assert!(matches!(plain.stated(false).unwrap(), Friction::Global3(_)));
    let scene = SpherePile { mu_r: 0.01, ..pile }.build().unwrap();
    let Friction::RollingGlobal(problem) = scene.stated(false).unwrap() else { panic!() };
    let other = plain.problem().unwrap();
    let (v, nc) = (scene.velocities(), problem.contacts());
    let (mut u, mut without) = (vec![0.0; 5 * nc], vec![0.0; 3 * nc]);
    problem.velocity_into(&v, &mut u);
    other.velocity_into(&v, &mut without);
    for (c, contact) in scene.contacts.iter().enumerate() {
        assert_eq!(u[5 * c..5 * c + 3], without[3 * c..3 * c + 3]);
        let spin = |k: usize| scene.bodies[k].angular_velocity;
        let [_, tangents @ ..] = contact.frame();
        for (k, d) in tangents.iter().enumerate() {
            let dot = |x: [f64; 3]| (0..3).map(|i| d[i] * x[i]).sum::<f64>();
            let seen = dot(spin(contact.b)) - contact.a.map_or(0.0, |a| dot(spin(a)));
            assert!((u[5 * c + 3 + k] - seen).abs() < 1e-12);
        }
    }
    assert!(matches!(scene.stated(true).unwrap(), Friction::RollingLocal(_)));
    assert_eq!(problem.kind().dimension(), 5);
}

//! What holds for every family: geometry, the knobs that all share, and that its problem can be solved.

use nonsmooth_problem::check::Judged;
use nonsmooth_scenes::scenes::{Family, Grains, Periodic, PeriodicBox};
use nonsmooth_scenes::{
    Contact, ElasticBox, Image, Polyhedron, SCENES, Scene, SceneEntry, Shape, Vec3,
};
use nonsmooth_solve::registry::{self, Registered};
use nonsmooth_solve::{Limits, Status};
use serde_json::{Map, Value, json};

fn make(entry: &SceneEntry, settings: Value) -> Scene {
    entry.make(settings.as_object().expect("an object")).unwrap()
}

/// Every family as it comes, and the other kinds of periodic boxes.
fn scenes() -> Vec<Scene> {
    let mut all: Vec<_> = SCENES.iter().map(|s| s.make(&Map::new()).unwrap()).collect();
    // Plates shear a box full of polyhedra only if it may expand.
    for (periodic, dilation) in [(Periodic::All, 0.2), (Periodic::Plane, 0.4)] {
        let grains = Grains::Polyhedra;
        let scene = PeriodicBox { periodic, dilation, grains, ..PeriodicBox::default() };
        all.push(scene.build().unwrap());
    }
    all.push(PeriodicBox { periodic: Periodic::Plane, ..PeriodicBox::default() }.build().unwrap());
    // So few grains that they touch their own images.
    all.push(
        PeriodicBox { count: 2, grains: Grains::Polyhedra, ..PeriodicBox::default() }
            .build()
            .unwrap(),
    );
    all
}

fn dot(a: Vec3, b: Vec3) -> f64 {
    (0..3).map(|k| a[k] * b[k]).sum()
}

fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn add(a: Vec3, b: Vec3) -> Vec3 {
    [0, 1, 2].map(|k| a[k] + b[k])
}

fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [0, 1, 2].map(|k| a[k] - b[k])
}

fn norm(a: Vec3) -> f64 {
    dot(a, a).sqrt()
}

#[test]
fn a_rigid_motion_of_everything_moves_no_contact() {
    let (speed, omega) = ([0.3, -0.7, 0.2], [0.5, 0.4, -0.9]);
    let velocity = |p: Vec3| add(speed, cross(omega, p));
    for mut scene in scenes() {
        for body in &mut scene.bodies {
            body.velocity = velocity(body.position);
            body.angular_velocity = omega;
        }
        for solid in &mut scene.solids {
            solid.held.fill(false);
            solid.velocity = solid.places().map(velocity).collect();
        }
        // Images turn with the rest.
        for contact in &mut scene.contacts {
            let Image { offset, .. } = contact.image;
            contact.image = Image { offset, velocity: cross(omega, offset) };
            contact.e = 0.0;
        }
        let problem = scene.problem().unwrap();
        let mut u = problem.w.clone();
        problem.H.mul_transpose_add(1.0, &scene.velocities(), &mut u);
        for (c, contact) in scene.contacts.iter().enumerate() {
            // The ground does not take part.
            let expected = match contact.a {
                Some(_) => [0.0; 3],
                None => velocity(contact.point),
            };
            for (k, axis) in contact.frame().into_iter().enumerate() {
                let rest = u[3 * c + k] - dot(axis, expected);
                assert!(rest.abs() < 1e-12 * (1.0 + norm(contact.point)), "{} {c}", scene.name);
            }
        }
    }
}

/// The convex parts of a body or elastic solid in the world frame, by vertices.
fn parts(scene: &Scene, k: usize) -> Vec<Polyhedron> {
    let Some(body) = scene.bodies.get(k) else {
        let solid = &scene.solids[k - scene.bodies.len()];
        let half = solid.sides.map(|side| 0.5 * side);
        return vec![Polyhedron::cuboid(half).unwrap().mapped(|v| add(solid.position, v))];
    };
    let parts = match &body.shape {
        Shape::Box { half } => vec![Polyhedron::cuboid(*half).unwrap()],
        Shape::Polyhedron(p) => vec![p.clone()],
        Shape::Compound(parts) => parts.clone(),
        Shape::Sphere { .. } => vec![],
    };
    parts.into_iter().map(|p| p.mapped(|v| body.to_world(v))).collect()
}

#[test]
fn contacts_lie_between_their_bodies() {
    for scene in scenes() {
        for (c, contact) in scene.contacts.iter().enumerate() {
            let Contact { point, image, .. } = *contact;
            let normal = contact.frame()[0];
            // b lies in front of the plane of contact and reaches it at the point, a behind.
            let sides = [(Some(contact.b), [0.0; 3], 1.0), (contact.a, image.offset, -1.0)];
            for (body, offset, sign) in sides {
                let Some(k) = body else { continue };
                let size = match scene.bodies.get(k) {
                    Some(body) => body.shape.radius(),
                    None => scene.solids[k - scene.bodies.len()].radius(),
                };
                if let Some(&Shape::Sphere { radius }) = scene.bodies.get(k).map(|b| &b.shape) {
                    let d = sub(add(scene.bodies[k].position, offset), point);
                    let aligned = norm(sub(d, normal.map(|x| sign * norm(d) * x)));
                    assert!(aligned < 1e-9 * size, "{} {c}", scene.name);
                    assert!((norm(d) - radius).abs() < 0.05 * size, "{} {c}", scene.name);
                    continue;
                }
                let touches = |part: &Polyhedron| {
                    let at = |v: Vec3| sub(add(v, offset), point);
                    let outside = |f: usize| {
                        let (n, d) = part.plane(f);
                        dot(n, sub(point, offset)) - d
                    };
                    let behind = part.vertices().iter().map(|&v| sign * dot(normal, at(v)));
                    let small = 1e-6 * size;
                    // Faces of the size of rounding have no plane to speak of.
                    (0..part.faces().len()).all(|f| outside(f).max(0.0) < small)
                        && behind.fold(f64::INFINITY, f64::min).abs() < small
                };
                assert!(parts(&scene, k).iter().any(touches), "{} {c}", scene.name);
            }
        }
    }
}

#[test]
fn spheres_do_not_overlap_and_touch_within_the_gap() {
    let packed = ["sphere_pile", "chute", "periodic_box"];
    for scene in scenes().into_iter().filter(|s| packed.contains(&s.name.as_str())) {
        let radius = |k: usize| match scene.bodies[k].shape {
            Shape::Sphere { radius } => Some(radius),
            _ => None,
        };
        let n = scene.bodies.len();
        if radius(0).is_none() {
            continue;
        }
        let mean = (0..n).filter_map(radius).sum::<f64>() / n as f64;
        for b in 0..n {
            for a in 0..b {
                let d = norm(sub(scene.bodies[b].position, scene.bodies[a].position));
                let reach = radius(a).unwrap() + radius(b).unwrap();
                assert!(d > reach * (1.0 - 1e-9), "{} {a} {b}: {d} {reach}", scene.name);
            }
        }
        for contact in &scene.contacts {
            let Some(a) = contact.a else { continue };
            let image = add(scene.bodies[a].position, contact.image.offset);
            let d = norm(sub(scene.bodies[contact.b].position, image));
            let gap = d - radius(a).unwrap() - radius(contact.b).unwrap();
            assert!(gap > -1e-9 * mean && gap < 0.021 * mean, "{}: {gap}", scene.name);
        }
    }
}

#[test]
fn densities_spread_by_the_mass_ratio() {
    for entry in SCENES {
        let (even, spread) = (make(entry, json!({})), make(entry, json!({"mass_ratio": 50})));
        let masses = |scene: &Scene| -> Vec<f64> {
            let solids = scene.solids.iter().map(ElasticBox::mass);
            scene.bodies.iter().map(|b| b.mass).chain(solids).collect()
        };
        let factors: Vec<f64> =
            masses(&even).iter().zip(masses(&spread)).map(|(a, b)| b / a).collect();
        for ((a, b), f) in even.bodies.iter().zip(&spread.bodies).zip(&factors) {
            assert!(
                (0..3).all(
                    |k| (b.inertia[k][k] - f * a.inertia[k][k]).abs() <= 1e-9 * b.inertia[k][k]
                )
            );
        }
        let mut sorted = factors.clone();
        sorted.sort_by(f64::total_cmp);
        let n = sorted.len();
        for (k, f) in sorted.iter().enumerate().filter(|_| n > 1) {
            let exact = 50.0_f64.powf(k as f64 / (n - 1) as f64);
            assert!((f - exact).abs() < 1e-9 * exact, "{}", entry.name);
        }
        let ordered = ["sliding_box", "stack", "chain", "elastic_cubes"].contains(&entry.name);
        assert_eq!(sorted == factors, ordered, "{}", entry.name);
    }
}

/// The linear and angular velocity of each body and of each elastic solid that nothing holds.
fn motions(scene: &Scene) -> Vec<(Vec3, Vec3)> {
    let bodies = scene.bodies.iter().map(|b| (b.velocity, b.angular_velocity));
    let solids = scene.solids.iter().filter(|s| !s.is_held()).map(|solid| {
        let (v, [nx, ny, _]) = (&solid.velocity, solid.elements);
        let [along_x, along_y] = [(nx, solid.sides[0]), (ny * (nx + 1), solid.sides[1])]
            .map(|(last, side)| sub(v[last], v[0]).map(|x| x / side));
        let angular = [along_y[2], -along_x[2], along_x[1]];
        for (v, at) in v.iter().zip(solid.places()) {
            let rigid = add(solid.mean_velocity(), cross(angular, sub(at, solid.position)));
            assert!(norm(sub(*v, rigid)) < 1e-12 * (1.0 + norm(*v)));
        }
        (solid.mean_velocity(), angular)
    });
    bodies.chain(solids).collect()
}

#[test]
fn states_set_the_bodies_in_motion() {
    for entry in SCENES {
        let rest = make(entry, json!({}));
        let change = |settings: Value| -> Vec<(Vec3, Vec3)> {
            let moved = make(entry, settings);
            for (a, b) in rest.solids.iter().zip(&moved.solids).filter(|(a, _)| a.is_held()) {
                assert_eq!(a, b, "{}", entry.name);
            }
            let pairs = motions(&rest).into_iter().zip(motions(&moved));
            pairs.map(|(a, b)| (sub(b.0, a.0), sub(b.1, a.1))).collect()
        };
        let largest =
            |x: &[(Vec3, Vec3)]| x.iter().flat_map(|c| c.0).map(f64::abs).fold(0.0, f64::max);
        let perturbed = largest(&change(json!({"state": "perturbed"})));
        assert!(perturbed > 0.0 && perturbed <= 0.1 + 1e-12, "{}", entry.name);
        let impact = change(json!({"state": "impact", "impact_speed": 3}));
        let held = rest.solids.iter().any(ElasticBox::is_held);
        if held || rest.contacts.iter().any(|c| c.a.is_none()) {
            let falls = |c: &(Vec3, Vec3)| norm(sub(c.0, [0.0, 0.0, -3.0])) < 1e-12;
            assert!(impact.iter().all(falls), "{}", entry.name);
        } else {
            assert!(largest(&impact) > 1.0 && largest(&impact) <= 3.0);
        }
        let spun = change(json!({"spin": 20}));
        let turns = |c: &(Vec3, Vec3)| norm(c.0) < 1e-12 && c.1.iter().all(|w| w.abs() < 20.01);
        assert!(spun.iter().all(turns), "{}", entry.name);
        assert!(spun.iter().all(|c| norm(c.1) > 0.0));
    }
}

#[test]
fn contacts_are_thinned_to_the_density_asked_for() {
    for entry in SCENES {
        let full = make(entry, json!({}));
        let n = full.dofs() as f64;
        let density = |scene: &Scene| 3.0 * scene.contacts.len() as f64 / n;
        let target = 0.4 * density(&full);
        let thinned = make(entry, json!({"contact_density": target}));
        assert!((density(&thinned) - target).abs() <= 1.5 / n + 1e-12, "{}", entry.name);
        assert!(thinned.contacts.iter().all(|c| full.contacts.contains(c)));
        let too_much = json!({"contact_density": density(&full) + 3.0 / n});
        let e = entry.make(too_much.as_object().unwrap()).unwrap_err().to_string();
        let most = format!("contact_density: expected 0 or a number up to {:.4}, ", density(&full));
        assert!(e.starts_with(&most), "{e}");
    }
}

#[test]
fn implicit_gyroscopic_terms_make_w_nonsymmetric() {
    // Spheres and elastic solids have no such torque.
    let without = ["sphere_pile", "chute", "spheres", "elastic_cubes", "elastic_wall"];
    for entry in SCENES.iter().filter(|s| !without.contains(&s.name)) {
        let mut settings = json!({"spin": 10, "gyroscopic": "implicit"});
        let grains = settings.as_object_mut().unwrap();
        if entry.name == "periodic_box" {
            grains.insert("grains".into(), "polyhedra".into());
        }
        let asymmetry = make(entry, settings).condensed().unwrap().W.asymmetry();
        assert!(asymmetry > 1e-4, "{}: {asymmetry}", entry.name);
    }
}

fn solved<P: Registered + Judged>(problem: &P, name: &str) {
    let mut session = registry::session::<P>("nsgs", &Map::new()).unwrap();
    let mut point = problem.origin();
    let limits = Limits { tolerance: 1e-4, max_iterations: 500_000, ..Limits::default() };
    let outcome = session.solve(problem, &mut point, &limits, &mut |_| {}).unwrap();
    assert_eq!(outcome.status, Status::Solved, "{name}");
    assert!(problem.judge(&point, 1e-4).unwrap().solved, "{name}");
}

#[test]
fn every_family_is_solved_in_both_forms() {
    for scene in scenes() {
        scene.validate().unwrap();
        solved(&scene.problem().unwrap(), &scene.name);
        solved(&scene.condensed().unwrap(), &scene.name);
    }
}

//! Every family of scenes: builds, assembles, and refuses what is impossible.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use nonsmooth_linalg::budget::Budget;
use nonsmooth_problem::FrictionGlobal;
use nonsmooth_scenes::scenes::{Arch, Family, Layout, SlidingBox, Spheres, Stack, Wall};
use nonsmooth_scenes::{SCENES, Scene, SceneEntry, SceneError, Shape};
use serde_json::{Map, Value, json};

fn settings(value: Value) -> Map<String, Value> {
    value.as_object().expect("an object").clone()
}

fn defaults() -> impl Iterator<Item = Scene> {
    SCENES.iter().map(|s| s.make(&Map::new()).unwrap())
}

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// `r` of least norm with `H r = −f` in the sense of least squares, by conjugate gradients on the normal equations.
fn balance(p: &FrictionGlobal<3>) -> Vec<f64> {
    let mut r = vec![0.0; p.w.len()];
    let mut residual: Vec<f64> = p.f.iter().map(|f| -f).collect();
    let transposed = |x: &[f64]| {
        let mut s = vec![0.0; p.w.len()];
        p.H.mul_transpose_add(1.0, x, &mut s);
        s
    };
    let mut s = transposed(&residual);
    let mut d = s.clone();
    for _ in 0..20 * r.len() {
        let mut hd = vec![0.0; p.f.len()];
        p.H.mul_add(1.0, &d, &mut hd);
        let gamma = norm(&s).powi(2);
        let alpha = gamma / norm(&hd).powi(2);
        r.iter_mut().zip(&d).for_each(|(r, d)| *r += alpha * d);
        residual.iter_mut().zip(&hd).for_each(|(x, h)| *x -= alpha * h);
        s = transposed(&residual);
        if norm(&residual) < 1e-12 * norm(&p.f) {
            break;
        }
        let beta = norm(&s).powi(2) / gamma;
        d.iter_mut().zip(&s).for_each(|(d, s)| *d = s + beta * *d);
    }
    r
}

#[test]
fn every_default_builds_and_assembles() {
    // Where places are random, rounding may decide on a contact.
    let bounds = [
        ("sphere_pile", 600, 1.2..2.65),
        ("chute", 1200, 0.7..3.0),
        ("polyhedra", 240, 4.0..9.0),
        ("periodic_box", 600, 0.2..3.0),
    ];
    let (random, sizes): (Vec<_>, Vec<_>) = defaults()
        .map(|scene| {
            let (global, local) = (scene.problem().unwrap(), scene.condensed().unwrap());
            assert_eq!(local.contacts(), global.contacts(), "{}", scene.name);
            (scene.name, global.dofs(), global.contacts())
        })
        .partition(|size| bounds.iter().any(|b| b.0 == size.0));
    let expected = [
        ("sliding_box", 6, 4),
        ("stack", 30, 20),
        ("wall", 198, 220),
        ("kapla", 120, 152),
        ("arch", 90, 64),
        ("bridge", 138, 184),
        ("chain", 60, 20),
        ("spheres", 180, 112),
        ("elastic_cubes", 162, 4),
        ("elastic_wall", 1350, 112),
    ];
    let expected = expected.map(|(name, n, nc)| (name.to_string(), n, nc));
    assert_eq!(sizes, expected);
    assert_eq!(random.len(), bounds.len());
    for ((name, n, nc), (expected, dofs, allowed)) in random.into_iter().zip(bounds) {
        assert_eq!((name.as_str(), n), (expected, dofs));
        let density = 3.0 * nc as f64 / n as f64;
        assert!(allowed.contains(&density), "{name}: {density}");
    }
}

#[test]
fn settings_reach_the_scene_and_each_is_documented() {
    for entry in SCENES {
        let documented = entry.settings();
        let defaults = documented.iter().map(|s| (s.key.clone(), s.default.clone())).collect();
        assert_eq!(entry.make(&defaults).unwrap(), entry.make(&Map::new()).unwrap());
        assert!(documented.iter().all(|s| !s.help.is_empty()), "{}", entry.name);
    }
    let scene = SceneEntry::find("stack").unwrap().make(&settings(json!({"count": 2, "mu": 1})));
    let scene = scene.unwrap();
    assert_eq!((scene.bodies.len(), scene.contacts[0].mu), (2, 1.0));
    let direct = Stack { count: 2, mu: 1.0, ..Stack::default() }.build().unwrap();
    assert_eq!(scene, direct);
}

#[test]
fn mistakes_are_named_on_one_line() {
    let cases = [
        ("stack", json!({"count": 0}), "count: expected a count from 1 to 10000, found 0"),
        ("stack", json!({"count": -1}), "count: expected a whole number of at least 0, found -1"),
        ("stack", json!({"kicked": 6}), "kicked: expected a count from 1 to 5, found 6"),
        ("stack", json!({"density": -1.0}), "density: expected a positive number, found -1"),
        ("stack", json!({"mass_ratio": 0}), "mass_ratio: expected a positive number, found 0"),
        (
            "stack",
            json!({"mass_ratio": 1e300}),
            "bodies[2].inertia: expected a symmetric positive definite matrix",
        ),
        (
            "wall",
            json!({"rows": "many"}),
            "rows: expected a whole number of at least 0, found \"many\"",
        ),
        ("wall", json!({"columns": 100_000_000}), "columns: expected a count from 1 to 1000"),
        (
            "wall",
            json!({"row": 3}),
            "unknown key `row` (did you mean `rows`?); there are: rows, columns",
        ),
        ("arch", json!({"blocks": 2}), "blocks: expected a count from 3 to 10000, found 2"),
        ("arch", json!({"thickness": 0}), "thickness: expected a positive number"),
        ("arch", json!({"mu": -0.1}), "mu: expected a number of at least 0, found -0.1"),
        (
            "spheres",
            json!({"layout": "cubic"}),
            "layout: expected one of square, triangular, found \"cubic\"",
        ),
        ("spheres", json!({"radius": null}), "radius: expected a number, found null"),
        ("spheres", json!({"e": 1.5}), "e: expected a number from 0 to 1, found 1.5"),
        ("kapla", json!({"planks": 6}), "length: expected a length of at least `planks` widths"),
        ("bridge", json!({"opening": 180}), "opening: expected an angle above 0 and below 180"),
        ("bridge", json!({"pier": 0.8}), "pier: expected more than 0.8660, twice the reach"),
        ("chain", json!({"bar": 0.02}), "bar: expected a positive number below a third"),
        ("chain", json!({"points": 5}), "points: expected a count from 1 to 4, found 5"),
        ("sphere_pile", json!({"spread": 1}), "spread: expected a number from 0 to below 1"),
        ("sphere_pile", json!({"gap": 0}), "gap: expected a positive number up to 1, found 0"),
        (
            "sphere_pile",
            json!({"gap": 1e300}),
            "gap: expected a positive number up to 1, found 1000",
        ),
        ("chute", json!({"radius": 1e300}), "radius: expected a number from 1e-9 to 1e9"),
        ("polyhedra", json!({"size": 1e300}), "size: expected a number from 1e-9 to 1e9"),
        ("chute", json!({"depth": 0.5}), "depth: expected a number from 1 to 1000, found 0.5"),
        ("polyhedra", json!({"open": 1.5}), "open: expected a number from 0 to 1, found 1.5"),
        ("polyhedra", json!({"open": 1, "points": 0}), "points: expected a count from 1"),
        ("periodic_box", json!({"count": 1}), "count: expected a count from 2 to 1000000"),
        ("periodic_box", json!({"grains": "cubes"}), "grains: expected one of spheres, polyhedra"),
        ("wall", json!({"state": "moving"}), "state: expected one of rest, perturbed, impact"),
        ("wall", json!({"gyroscopic": "no"}), "gyroscopic: expected one of explicit, implicit"),
        ("wall", json!({"spin": -1}), "spin: expected a number of at least 0, found -1"),
        (
            "wall",
            json!({"contact_density": 4}),
            "contact_density: expected 0 or a number up to 3.3333, ",
        ),
        ("elastic_cubes", json!({"count": 1}), "count: expected a count of at least 2 where"),
        ("elastic_cubes", json!({"elements": 0}), "elements: expected a count from 1 to 100"),
        ("elastic_cubes", json!({"offset": 1}), "offset: expected a number from 0 to below 1"),
        ("elastic_cubes", json!({"poisson": 0.5}), "poisson: expected a number between -1 and 0.5"),
        ("elastic_wall", json!({"theta": 2}), "theta: expected a number from 0.5 to 1, found 2"),
        ("elastic_wall", json!({"rows": 0}), "rows: expected a count from 1 to 1000, found 0"),
        ("sliding_box", json!({"slope": 90}), "slope: expected an angle between"),
        ("sliding_box", json!({"h": 0}), "h: expected a positive number"),
        ("sliding_box", json!({"height": 1e-200}), "bodies[0]."),
        ("sliding_box", json!({"disturbance": -1}), "disturbance: expected a number of at least"),
        (
            "sliding_box",
            json!({"seed": 0.5}),
            "seed: expected a whole number of at least 0, found 0.5",
        ),
    ];
    for (name, values, start) in cases {
        let result = SceneEntry::find(name).unwrap().make(&settings(values));
        let message = result.unwrap_err().to_string();
        assert!(message.starts_with(start) && !message.contains('\n'), "{message}");
    }
    let message = SceneEntry::find("tower").err().unwrap().to_string();
    assert!(message.starts_with("unknown scene `tower`; there are: sliding_box, stack"));
    let nan = Wall { length: f64::NAN, ..Wall::default() }.build().unwrap_err().to_string();
    assert_eq!(nan, "length: expected a positive number, found NaN");
}

#[test]
fn a_resting_box_falls_freely_in_q() {
    let settings = SlidingBox { slope: 0.0, speed: 0.0, ..SlidingBox::default() };
    let scene = settings.build().unwrap();
    let q = scene.condensed().unwrap().q;
    for c in 0..4 {
        // The corners fall by h g in a step, and the solver's impulses have to stop them.
        let free = [-0.01 * 9.81, 0.0, 0.0];
        assert!((0..3).all(|k| (q[3 * c + k] - free[k]).abs() < 1e-15), "{q:?}");
    }
}

#[test]
fn a_box_on_a_slope_slides_along_its_first_tangent() {
    let settings = SlidingBox { e: 0.5, ..SlidingBox::default() };
    let q = settings.build().unwrap().condensed().unwrap().q;
    let (sin, cos) = 10.0_f64.to_radians().sin_cos();
    for c in 0..4 {
        // No normal velocity before the step: restitution adds nothing.
        let free = [-0.0981 * cos, 1.0 + 0.0981 * sin, 0.0];
        assert!((0..3).all(|k| (q[3 * c + k] - free[k]).abs() < 1e-14), "{q:?}");
    }
}

#[test]
fn restitution_enters_through_w() {
    let mut scene = SlidingBox { slope: 0.0, e: 0.5, ..SlidingBox::default() }.build().unwrap();
    scene.bodies[0].velocity = [0.0, 0.0, -2.0];
    let p = scene.problem().unwrap();
    assert!((0..4).all(|c| p.w[3 * c..3 * c + 3] == [-1.0, 0.0, 0.0]), "{:?}", p.w);
}

#[test]
fn a_resting_stack_is_in_equilibrium_under_its_weight() {
    let (h, g, n) = (0.01, 9.81, 7);
    let scene = Stack { count: n, mass_ratio: 20.0, ..Stack::default() }.build().unwrap();
    let mass: Vec<f64> = scene.bodies.iter().map(|b| b.mass).collect();
    assert!((mass[n - 1] / mass[0] - 20.0).abs() < 1e-12);
    let p = scene.problem().unwrap();
    let mut r = vec![0.0; 3 * p.contacts()];
    for c in 0..p.contacts() {
        // A quarter of what lies above the interface.
        r[3 * c] = 0.25 * h * g * mass[c / 4..].iter().sum::<f64>();
    }
    let mut impulse = p.f.clone();
    p.H.mul_add(1.0, &r, &mut impulse);
    assert!(norm(&impulse) < 1e-12 * norm(&p.f), "{impulse:?}");
}

#[test]
fn the_ground_can_carry_every_structure() {
    // Grains may lie loose, and an elastic solid carries its weight by its strain, not by contacts alone.
    let loose = ["sphere_pile", "chute", "periodic_box", "elastic_cubes", "elastic_wall"];
    for mut scene in defaults().filter(|s| !loose.contains(&s.name.as_str())) {
        scene.bodies.iter_mut().for_each(|b| b.velocity = [0.0; 3]);
        let p = scene.problem().unwrap();
        let r = balance(&p);
        let mut impulse = p.f.clone();
        p.H.mul_add(1.0, &r, &mut impulse);
        assert!(norm(&impulse) < 1e-9 * norm(&p.f), "{}: {:e}", scene.name, norm(&impulse));
        // The upward impulse of the ground is the weight during the step.
        let up: f64 = scene
            .contacts
            .iter()
            .enumerate()
            .filter(|(_, contact)| contact.a.is_none())
            .map(|(c, contact)| {
                let frame = contact.frame();
                (0..3).map(|k| r[3 * c + k] * frame[k][2]).sum::<f64>()
            })
            .sum();
        let weight = scene.h * 9.81 * scene.mass();
        assert!((up - weight).abs() < 1e-8 * weight, "{}: {up} {weight}", scene.name);
    }
}

#[test]
fn disturbances_repeat_with_their_seed() {
    for entry in SCENES {
        let make = |amplitude: f64, seed: u64| {
            let map = settings(json!({"disturbance": amplitude, "seed": seed}));
            entry.make(&map).unwrap()
        };
        let moved = make(0.1, 7);
        assert_eq!(moved, make(0.1, 7));
        assert_ne!(moved, make(0.1, 8));
        let still = make(0.0, 7);
        assert_ne!(still, moved);
        assert_eq!(still.contacts, moved.contacts);
        for (a, b) in still.bodies.iter().zip(&moved.bodies) {
            assert!((0..3).all(|k| (a.velocity[k] - b.velocity[k]).abs() <= 0.1));
        }
        // At the farthest point the rotation adds up to √3 times as much.
        for (a, b) in still.solids.iter().zip(&moved.solids) {
            let pairs = a.velocity.iter().flatten().zip(b.velocity.iter().flatten());
            assert!(pairs.into_iter().all(|(a, b)| (a - b).abs() <= 0.1 * (1.0 + 3.0_f64.sqrt())));
        }
    }
}

#[test]
fn bricks_fill_the_wall_and_bear_on_each_other() {
    for (rows, columns) in [(1, 1), (2, 1), (4, 3)] {
        let wall = Wall { rows, columns, ..Wall::default() };
        let scene = wall.build().unwrap();
        let volume = rows as f64 * columns as f64 * wall.length * wall.depth * wall.height;
        assert!((scene.mass() - wall.density * volume).abs() < 1e-9 * scene.mass());
        // Below each row but the first: two overlaps for each full brick, one for each half.
        let pairs = columns + (rows - 1) * 2 * columns;
        assert_eq!(scene.contacts.len(), 4 * pairs);
        let joints = Wall { head_joints: true, ..wall }.build().unwrap().contacts.len();
        let in_rows: usize = (0..rows).map(|row| columns + row % 2 - 1).sum();
        assert_eq!(joints, 4 * (pairs + in_rows));
    }
}

#[test]
fn voussoirs_make_up_the_ring() {
    let arch = Arch::default();
    let scene = arch.build().unwrap();
    let angle = std::f64::consts::PI / arch.blocks as f64;
    let outer = arch.radius + arch.thickness;
    let area = 0.5 * angle.sin() * (outer * outer - arch.radius * arch.radius);
    let mass = arch.density * area * arch.depth;
    assert!(scene.bodies.iter().all(|b| (b.mass - mass).abs() < 1e-10 * mass));
    assert_eq!(scene.contacts.len(), 4 * (arch.blocks + 1));
    // Each contact is a corner of both its bodies.
    for contact in &scene.contacts {
        for body in [contact.a, Some(contact.b)].into_iter().flatten().map(|k| &scene.bodies[k]) {
            let Shape::Polyhedron(p) = &body.shape else { panic!("a voussoir") };
            let distance = |&v| {
                let w = body.to_world(v);
                norm(&[0, 1, 2].map(|k| w[k] - contact.point[k]))
            };
            assert!(p.vertices().iter().map(distance).fold(1.0, f64::min) < 1e-12);
        }
    }
}

#[test]
fn spheres_touch_exactly_where_there_are_contacts() {
    for layout in [Layout::Square, Layout::Triangular] {
        let pile = Spheres { base: 5, layout, radius: 0.3, ..Spheres::default() };
        let scene = pile.build().unwrap();
        let distance = |a: usize, b: usize| {
            let (x, y) = (scene.bodies[a].position, scene.bodies[b].position);
            norm(&[0, 1, 2].map(|k| x[k] - y[k])) / 0.6
        };
        let n = scene.bodies.len();
        let mut touching = vec![];
        for b in 0..n {
            for a in 0..b {
                assert!(distance(a, b) > 1.0 - 1e-12);
                if distance(a, b) < 1.0 + 1e-9 {
                    touching.push((a, b));
                }
            }
        }
        let mut given: Vec<_> = scene.contacts.iter().filter_map(|c| Some((c.a?, c.b))).collect();
        given.sort_unstable_by_key(|&(a, b)| (b, a));
        assert_eq!(given, touching);
        let grounded = scene.contacts.iter().filter(|c| c.a.is_none()).count();
        assert_eq!(grounded, if layout == Layout::Square { 25 } else { 15 });
    }
}

#[test]
fn a_scene_without_contacts_is_no_problem() {
    let mut scene = Stack::default().build().unwrap();
    scene.contacts.clear();
    assert!(matches!(scene.problem(), Err(SceneError::Problem(_))));
}

/// Limits that are over end the making of every family, and of large ones soon.
#[test]
fn limits_end_the_making_of_scenes() {
    let slack = std::env::var("NONSMOOTH_SLACK").ok().and_then(|s| s.parse().ok()).unwrap_or(1.0);
    {
        let flag = Arc::new(AtomicBool::new(true));
        let _scope = Budget { cancel: Some(flag), ..Budget::default() }.enter();
        for entry in SCENES {
            assert_eq!(entry.make(&Map::new()), Err(SceneError::Stopped), "{}", entry.name);
        }
        // A mistake is told all the same.
        let wrong = SCENES[0].make(&settings(json!({"mu": -1})));
        assert!(matches!(wrong, Err(SceneError::Value { .. })));
    }
    for (name, values) in [
        ("sphere_pile", json!({"count": 200_000})),
        ("chute", json!({"count": 200_000})),
        ("periodic_box", json!({"count": 200_000})),
        ("periodic_box", json!({"count": 50_000, "grains": "polyhedra"})),
        ("polyhedra", json!({"count": 50_000})),
    ] {
        let begun = Instant::now();
        let deadline = Some(begun + Duration::from_millis(500));
        let _scope = Budget { deadline, ..Budget::default() }.enter();
        let made = SceneEntry::find(name).unwrap().make(&settings(values));
        assert_eq!(made, Err(SceneError::Stopped), "{name}");
        let seconds = begun.elapsed().as_secs_f64();
        assert!(seconds < 0.6 + slack, "{name}: {seconds} s");
    }
}

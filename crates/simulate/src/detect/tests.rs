use nonsmooth_scenes::Rotation;
use nonsmooth_scenes::vec3::{cross, dot, norm, normalise};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::*;
use crate::{Body, Part, plane};

const MARGIN: f64 = 0.05;

/// The contacts of two bodies, the second of which moves freely.
fn contacts(world: &World) -> Vec<Near> {
    let (mut state, mut out) = (State::of(world), vec![]);
    let margins = vec![MARGIN; world.bodies.len()];
    Detector::new(world).unwrap().detect(world, &mut state, &margins, &mut out);
    out
}

fn two(a: Body, b: Body) -> World {
    let mut world = World::default();
    world.add(a);
    world.add(b);
    world
}

fn solid(shape: impl Into<Shape>) -> Body {
    Body::solid(shape, 1.0).unwrap()
}

fn cuboid(half: Vec3) -> Body {
    solid(Shape::Box { half })
}

fn rotation(rng: &mut Pcg64) -> Rotation {
    let axis = std::array::from_fn(|_| rng.random_range(-1.0..1.0));
    Rotation::about(axis, rng.random_range(-3.0..3.0))
}

fn vector(rng: &mut Pcg64, most: f64) -> Vec3 {
    std::array::from_fn(|_| rng.random_range(-most..most))
}

/// The hull of some random points on an ellipsoid, by brute force: every plane through three points with all others behind it.
fn rock(rng: &mut Pcg64, count: usize) -> Polyhedron {
    let stretch: Vec3 = std::array::from_fn(|_| rng.random_range(0.5..1.0));
    let points: Vec<Vec3> = (0..count)
        .map(|_| {
            let p = normalise(vector(rng, 1.0));
            std::array::from_fn(|k| stretch[k] * p[k])
        })
        .collect();
    let mut faces = vec![];
    for i in 0..count {
        for j in i + 1..count {
            for k in j + 1..count {
                let n = cross(sub(points[j], points[i]), sub(points[k], points[i]));
                let side = |p: &Vec3| dot(n, sub(*p, points[i]));
                let others =
                    || (0..count).filter(|l| ![i, j, k].contains(l)).map(|l| side(&points[l]));
                if others().all(|d| d < 0.0) {
                    faces.push(vec![i, j, k]);
                } else if others().all(|d| d > 0.0) {
                    faces.push(vec![i, k, j]);
                }
            }
        }
    }
    Polyhedron::new(points, faces).unwrap()
}

/// The largest separation along any normal of a face and any product of edges, without any shortcut.
fn separation(world: &World) -> f64 {
    let of = |k: usize| {
        let body = &world.bodies[k];
        let part = &body.parts[0];
        let polyhedron = match &part.shape {
            Shape::Box { half } => Polyhedron::cuboid(*half).unwrap(),
            Shape::Polyhedron(p) => p.clone(),
            _ => unreachable!("polyhedra only"),
        };
        let r = body.rotation.matrix();
        let pose = Pose { x: body.position, r };
        polyhedron.mapped(|v| pose.point(add(part.position, v)))
    };
    let (p, q) = (of(0), of(1));
    let edges = |p: &Polyhedron| {
        let of_face = |f: &Vec<usize>| {
            (0..f.len())
                .map(|k| sub(p.vertices()[f[(k + 1) % f.len()]], p.vertices()[f[k]]))
                .collect::<Vec<_>>()
        };
        p.faces().iter().flat_map(of_face).collect::<Vec<_>>()
    };
    let mut axes: Vec<Vec3> = vec![];
    for polyhedron in [&p, &q] {
        axes.extend((0..polyhedron.faces().len()).map(|k| polyhedron.plane(k).0));
    }
    for u in edges(&p) {
        for v in edges(&q) {
            let n = cross(u, v);
            if norm(n) > 1e-6 * norm(u) * norm(v) {
                axes.push(normalise(n));
            }
        }
    }
    let mut best = f64::NEG_INFINITY;
    for n in axes {
        let reach = |p: &Polyhedron, sign: f64| {
            p.vertices().iter().map(|&v| sign * dot(n, v)).fold(f64::INFINITY, f64::min)
        };
        let apart = |sign: f64| reach(&q, sign) + reach(&p, -sign);
        best = best.max(apart(1.0)).max(apart(-1.0));
    }
    best
}

#[test]
fn closed_forms_of_round_shapes() {
    let ball = |r| solid(Shape::Sphere { radius: r });
    let rod = || solid(Shape::Capsule { half_length: 1.0, radius: 0.2 });
    let lying = Rotation::about([0.0, 1.0, 0.0], std::f64::consts::FRAC_PI_2);
    for (world, gaps, normal) in [
        (
            two(ball(0.5), ball(0.3).at([0.0, 0.6, 0.5])),
            vec![0.61_f64.sqrt() - 0.8],
            [0.0, 0.6, 0.5],
        ),
        (two(Body::floor(), ball(0.3).at([5.0, 1.0, 0.32])), vec![0.02], [0.0, 0.0, 1.0]),
        // A ball over a face, an edge and a corner of a box.
        (two(cuboid([1.0; 3]), ball(0.3).at([0.2, 0.3, 1.29])), vec![-0.01], [0.0, 0.0, 1.0]),
        (
            two(cuboid([1.0; 3]), ball(0.3).at([1.2, 0.3, 1.2])),
            vec![0.08_f64.sqrt() - 0.3],
            [1.0, 0.0, 1.0],
        ),
        (two(cuboid([1.0; 3]), ball(0.3).at([1.2, 1.1, 1.2])), vec![0.0], [2.0, 1.0, 2.0]),
        // Its centre inside.
        (two(cuboid([1.0; 3]), ball(0.3).at([0.2, 0.3, 0.95])), vec![-0.35], [0.0, 0.0, 1.0]),
        // Capsules: crossed, in line, side by side; with a ball; on the floor.
        (two(rod(), rod().turned(lying).at([0.0, 0.41, 0.5])), vec![0.01], [0.0, 1.0, 0.0]),
        (two(rod(), rod().at([0.0, 0.0, 2.41])), vec![0.01], [0.0, 0.0, 1.0]),
        (two(rod(), rod().at([0.4, 0.0, 0.5])), vec![0.0, 0.0], [1.0, 0.0, 0.0]),
        (two(rod(), ball(0.3).at([0.5, 0.0, 0.5])), vec![0.0], [1.0, 0.0, 0.0]),
        (
            two(Body::floor(), rod().turned(lying).at([0.0, 0.0, 0.19])),
            vec![-0.01, -0.01],
            [0.0, 0.0, 1.0],
        ),
    ] {
        let found = contacts(&world);
        assert_eq!(found.len(), gaps.len(), "{found:?}");
        for (near, gap) in found.iter().zip(gaps) {
            assert!((near.place.gap - gap).abs() < 1e-14, "{near:?} {gap}");
            assert!(norm(sub(near.place.normal, normalise(normal))) < 1e-14, "{near:?}");
        }
    }
}

#[test]
fn faces_touch_at_the_corners_of_their_common_area() {
    let bottom = || cuboid([1.0, 1.0, 0.5]);
    let turned = Rotation::about([0.0, 0.0, 1.0], 0.3);
    let corners = |b: Body| {
        let found = contacts(&two(bottom(), b));
        for n in &found {
            assert!((n.place.gap - 0.01).abs() < 1e-14, "{n:?}");
            assert!(norm(sub(n.place.normal, [0.0, 0.0, 1.0])) < 1e-14);
        }
        found.len()
    };
    let above = [0.0, 0.0, 1.01];
    assert_eq!(corners(bottom().at(above)), 4);
    assert_eq!(corners(cuboid([0.5, 0.3, 0.5]).at(above)), 4);
    assert_eq!(corners(cuboid([2.0, 0.3, 0.5]).at(above)), 4);
    assert_eq!(corners(bottom().turned(turned).at(above)), 8);
    assert_eq!(corners(bottom().at([1.5, 1.7, 1.01])), 4);
    // A quarter turn makes other names, not other points.
    assert_eq!(
        corners(
            bottom()
                .turned(Rotation::about([0.0, 0.0, 1.0], std::f64::consts::FRAC_PI_2 + 3e-7))
                .at(above)
        ),
        4
    );
    let prism = |sides: u32| {
        let corner = |k: u32| {
            let (s, c) = (f64::from(k) * std::f64::consts::TAU / f64::from(sides)).sin_cos();
            [0.5 * c, 0.5 * s, 0.0]
        };
        let base: Vec<_> = (0..sides).map(corner).collect();
        Polyhedron::prism(&base, [0.0, 0.0, 1.0]).unwrap()
    };
    for sides in 5..=12 {
        assert_eq!(corners(solid(prism(sides)).at(above)), sides as usize);
        assert_eq!(
            contacts(&two(Body::floor(), solid(prism(sides)).at([0.0, 0.0, 0.5]))).len(),
            sides as usize
        );
    }
}

#[test]
fn crossing_edges_have_the_normal_across_both() {
    let ridge = Rotation::about([1.0, 0.0, 0.0], std::f64::consts::FRAC_PI_4);
    let across = Rotation::about([0.0, 1.0, 0.0], std::f64::consts::FRAC_PI_4);
    let high = 2.0 * 0.5 * 2f64.sqrt();
    for gap in [0.01, 0.0, -0.01] {
        let upper = cuboid([0.5; 3]).turned(across).at([0.1, 0.05, high + gap]);
        let found = contacts(&two(cuboid([0.5; 3]).turned(ridge), upper));
        assert_eq!(found.len(), 1, "{found:?}");
        let place = found[0].place;
        assert!(
            (place.gap - gap).abs() < 1e-14 && norm(sub(place.normal, [0.0, 0.0, 1.0])) < 1e-14
        );
        assert!((place.point[0] - 0.1).abs() < 1e-14 && place.point[1].abs() < 1e-14);
    }
}

#[test]
fn random_polyhedra_agree_with_all_separating_axes() {
    let mut rng = Pcg64::seed_from_u64(11);
    let (mut touching, mut apart) = (0, 0);
    for round in 0..600 {
        let shape = |rng: &mut Pcg64| match round % 3 {
            0 => solid(rock(rng, 10)),
            _ => cuboid(std::array::from_fn(|_| rng.random_range(0.3..1.0))),
        };
        let (a, b) = (shape(&mut rng), shape(&mut rng));
        let (q, x) = (rotation(&mut rng), vector(&mut rng, 1.5));
        let turned = if round % 3 == 1 { Rotation::IDENTITY } else { rotation(&mut rng) };
        let world = two(a.turned(q), b.turned(turned).at(x));
        let truth = separation(&world);
        let found = contacts(&world);
        if truth > 2.0 * MARGIN {
            assert!(found.is_empty(), "{truth} {found:?}");
            apart += 1;
            continue;
        }
        touching += usize::from(truth < 0.0);
        let size = found.first().map_or(1.0, |n| n.size);
        assert!(!found.is_empty() || truth > 0.0, "{truth}");
        for (k, near) in found.iter().enumerate() {
            assert!(near.place.gap >= truth - 2e-6 * size, "{truth} {near:?}");
            assert!((norm(near.place.normal) - 1.0).abs() < 1e-14);
            for other in &found[..k] {
                let far = norm(sub(near.place.point, other.place.point));
                assert!(far > 1e-9 * size && near.key != other.key, "{near:?} {other:?}");
            }
        }
    }
    assert!(touching > 200 && apart > 50, "{touching} {apart}");
}

#[test]
fn the_rate_of_the_gap_is_the_normal_velocity() {
    let mut rng = Pcg64::seed_from_u64(5);
    let rod = || solid(Shape::Capsule { half_length: 0.6, radius: 0.2 });
    let mut checked = 0;
    for round in 0..400 {
        let (a, b) = match round % 7 {
            0 => (solid(Shape::Sphere { radius: 0.5 }), solid(Shape::Sphere { radius: 0.4 })),
            1 => (rod(), rod()),
            2 => (rod(), solid(Shape::Sphere { radius: 0.4 })),
            3 => (cuboid([0.4, 0.5, 0.6]), solid(Shape::Sphere { radius: 0.4 })),
            4 => (
                Body::fixed(vec![plane([0.0; 3], [0.3, 0.1, 1.0]).unwrap()]),
                cuboid([0.4, 0.5, 0.6]),
            ),
            5 => (Body::fixed(vec![Part::new(Shape::Plane)]), rod()),
            _ => (cuboid([0.4, 0.5, 0.6]), solid(rock(&mut rng, 8))),
        };
        let turn = rotation(&mut rng);
        let a = if a.is_free() { a.turned(turn) } else { a };
        let direction = normalise(vector(&mut rng, 1.0));
        let direction = if a.is_free() { direction } else { [0.0, 0.0, 1.0] };
        let world = two(a, b.turned(rotation(&mut rng)));
        // From afar until they are near.
        let mut start = State::of(&world);
        let mut far = 2.5;
        let mut detector = Detector::new(&world).unwrap();
        let (margins, mut found) = ([MARGIN; 2], vec![]);
        while far > 0.1 {
            start.position[1] = scale(far, direction);
            detector.detect(&world, &mut start, &margins, &mut found);
            if !found.is_empty() {
                break;
            }
            far -= 0.02;
        }
        let (v, w) = (
            [vector(&mut rng, 1.0), vector(&mut rng, 1.0)],
            [vector(&mut rng, 1.0), vector(&mut rng, 1.0)],
        );
        let mut at = |t: f64| {
            let mut state = start.clone();
            for k in (0..2).filter(|&k| world.bodies[k].is_free()) {
                state.position[k] = add(state.position[k], scale(t, v[k]));
                let turned = Rotation::about(w[k], t * norm(w[k]));
                state.rotation[k] = turned.after(Rotation(state.rotation[k])).0;
            }
            let mut out = vec![];
            detector.detect(&world, &mut state, &margins, &mut out);
            out
        };
        let t = 1e-5;
        let (before, now, after) = (at(-t), at(0.0), at(t));
        for near in now {
            if matches!(near.witness, Witness::Face { anchor: witness::Anchor::Both, .. }) {
                // Where edges cross the point is of neither body.
                continue;
            }
            let same = |list: &[Near]| list.iter().find(|n| n.key == near.key).map(|n| n.place.gap);
            let (Some(p), Some(q)) = (same(&before), same(&after)) else { continue };
            if matches!(near.witness, Witness::Face { anchor: witness::Anchor::Face, .. }) {
                continue;
            }
            let speed = |k: usize| match world.bodies[k].is_free() {
                true => add(v[k], cross(w[k], sub(near.place.point, start.position[k]))),
                false => [0.0; 3],
            };
            let rate = dot(near.place.normal, sub(speed(1), speed(0)));
            // The point lies midway, the gap turns with the bodies: what is left is of the size of the gap.
            // Edges that miss each other by a little have a gap between lines, not between points.
            let missed = if matches!(near.witness, Witness::Edges { .. }) { 2e-4 } else { 0.0 };
            let slack = 1e-8 + missed + 1e-3 * near.place.gap.abs();
            assert!(
                ((q - p) / (2.0 * t) - rate).abs() < slack,
                "{round} {near:?} {rate} {}",
                (q - p) / (2.0 * t)
            );
            checked += 1;
        }
    }
    assert!(checked > 300, "{checked}");
}

#[test]
fn witnesses_say_where_a_contact_is_when_bodies_have_moved() {
    // Moving both bodies together moves point and normal with them, and keeps the gap.
    let mut rng = Pcg64::seed_from_u64(2);
    for _ in 0..100 {
        let (a, b) = (solid(rock(&mut rng, 9)), cuboid([0.5, 0.4, 0.6]));
        let world =
            two(a, b.turned(rotation(&mut rng)).at(scale(0.9, normalise(vector(&mut rng, 1.0)))));
        let motion = Pose { x: vector(&mut rng, 3.0), r: rotation(&mut rng).matrix() };
        let state = State::of(&world);
        for near in contacts(&world) {
            let [p, q] = [0, 1].map(|k| motion.then(&state.pose(k)));
            let place = near.witness.place(&p, &q, motion.direction(near.place.normal));
            assert!(norm(sub(place.point, motion.point(near.place.point))) < 1e-13);
            assert!(norm(sub(place.normal, motion.direction(near.place.normal))) < 1e-13);
        }
    }
}

#[test]
fn groups_and_partners_do_not_touch() {
    let mut world = two(cuboid([0.5; 3]), cuboid([0.5; 3]).at([0.0, 0.0, 1.0]));
    assert_eq!(contacts(&world).len(), 4);
    world.bodies[0].membership = 1;
    world.bodies[1].collides_with = 2;
    assert!(contacts(&world).is_empty());
    world.bodies[1].collides_with = 3;
    assert_eq!(contacts(&world).len(), 4);
    world.keep_apart(BodyId(1), BodyId(0));
    assert!(contacts(&world).is_empty());
}

#[test]
fn no_pose_makes_it_panic() {
    let mut rng = Pcg64::seed_from_u64(17);
    let mut world = World::default();
    world.add(Body::floor());
    for k in 0..8 {
        let body = match k % 4 {
            0 => cuboid([0.5, 0.3, 0.2]),
            1 => solid(rock(&mut rng, 12)),
            _ => solid(Shape::Sphere { radius: 0.3 }),
        };
        world.add(body);
    }
    let mut detector = Detector::new(&world).unwrap();
    let (mut state, mut out) = (State::of(&world), vec![]);
    let margins = vec![MARGIN; world.bodies.len()];
    let mut seen = 0;
    for round in 0..20_000 {
        for k in 1..world.bodies.len() {
            // Poses that coincide or are aligned too.
            let coarse = round % 3 == 0;
            state.position[k] = vector(&mut rng, 1.0).map(|x| if coarse { x.round() } else { x });
            let q = if coarse { Rotation::IDENTITY } else { rotation(&mut rng) };
            state.rotation[k] = q.0;
        }
        detector.detect(&world, &mut state, &margins, &mut out);
        seen += out.len();
        let finite = |n: &Near| n.place.normal.iter().chain(&n.place.point).all(|x| x.is_finite());
        assert!(out.iter().all(finite));
        assert!(out.windows(2).all(|w| w[0].key < w[1].key));
    }
    assert!(seen > 20_000);
}

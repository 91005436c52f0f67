use nonsmooth_scenes::Rotation;
use nonsmooth_scenes::vec3::{cross, dot, norm, normalise};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::*;
use crate::{Body, Part, plane};

mod valleys;

const MARGIN: f64 = 0.05;

/// The contacts of two bodies, the second of which moves freely.
fn contacts(world: &World) -> Vec<Near> {
    let (mut state, mut out) = (State::of(world), vec![]);
    let margins = vec![MARGIN; world.bodies.len()];
    Detector::new(world).unwrap().detect(
        world,
        &mut state,
        &margins,
        &Crew::new(1),
        (&mut out, &mut vec![]),
    );
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
            detector.detect(&world, &mut start, &margins, &Crew::new(1), (&mut found, &mut vec![]));
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
            detector.detect(&world, &mut state, &margins, &Crew::new(1), (&mut out, &mut vec![]));
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
        detector.detect(&world, &mut state, &margins, &Crew::new(1), (&mut out, &mut vec![]));
        seen += out.len();
        let finite = |n: &Near| n.place.normal.iter().chain(&n.place.point).all(|x| x.is_finite());
        assert!(out.iter().all(finite));
        assert!(out.windows(2).all(|w| w[0].key < w[1].key));
    }
    assert!(seen > 20_000);
}

fn cylinder(half_length: f64, radius: f64) -> Body {
    solid(Shape::Cylinder { half_length, radius })
}

fn cone(half_length: f64, radius: f64) -> Body {
    solid(Shape::Cone { half_length, radius })
}

fn gaps(world: &World) -> Vec<f64> {
    let mut gaps: Vec<f64> = contacts(world).iter().map(|n| n.place.gap).collect();
    gaps.sort_by(f64::total_cmp);
    gaps
}

/// A turn of the third axis into the first.
fn lying() -> Rotation {
    Rotation::about([0.0, 1.0, 0.0], std::f64::consts::FRAC_PI_2)
}

#[test]
fn cylinders_and_cones_on_a_plane() {
    let floor = Body::floor;
    let near = |found: Vec<f64>, expected: &[f64]| {
        assert_eq!(found.len(), expected.len(), "{found:?} {expected:?}");
        for (x, y) in found.iter().zip(expected) {
            assert!((x - y).abs() < 1e-14, "{found:?} {expected:?}");
        }
    };
    // Upright on eight points, lying on two, inclined on one: z_c − h cos α − r sin α.
    near(gaps(&two(floor(), cylinder(0.5, 0.2).at([1.0, 2.0, 0.51]))), &[0.01; 8]);
    near(gaps(&two(floor(), cylinder(0.5, 0.2).turned(lying()).at([1.0, 2.0, 0.19]))), &[-0.01; 2]);
    for alpha in [1e-3, 0.3, 1.2] {
        let (s, c) = f64::sin_cos(alpha);
        let turn = Rotation::about([0.6, 0.8, 0.0], alpha);
        let disc = cylinder(0.005, 0.2).turned(turn).at([0.0, 0.0, 0.2 * s + 0.005 * c]);
        let found = gaps(&two(floor(), disc));
        assert!(found[0].abs() < 1e-14, "{found:?}");
        // Both rims of a thin disc; points to stand on where it is nearly flat only.
        assert_eq!(found.len() > 2, alpha < 0.01, "{found:?}");
    }
    // A cone on its base, on its point and on its side, whose line has the angle atan(r/2h) with the axis.
    near(gaps(&two(floor(), cone(0.5, 0.2).at([0.0, 0.0, 0.25]))), &[0.0; 8]);
    let over = Rotation::about([1.0, 0.0, 0.0], std::f64::consts::PI);
    near(gaps(&two(floor(), cone(0.5, 0.2).turned(over).at([0.0, 0.0, 0.76]))), &[0.01]);
    let (r, h): (f64, f64) = (0.2, 1.0);
    let angle = (r / h).atan();
    let turn = Rotation::about([0.0, 1.0, 0.0], std::f64::consts::FRAC_PI_2 + angle);
    let middle = 0.5 * h * angle.sin();
    near(
        gaps(&two(
            floor(),
            Body::with_mass(
                1.0,
                [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
                vec![Part::new(Shape::Cone { half_length: 0.5, radius: 0.2 })],
            )
            .turned(turn)
            .at([0.0, 0.0, middle]),
        )),
        &[0.0; 2],
    );
}

#[test]
fn balls_on_cylinders_and_cones() {
    let ball = |x: Vec3| solid(Shape::Sphere { radius: 0.3 }).at(x);
    let post = || Body::fixed(vec![Part::new(Shape::Cylinder { half_length: 1.0, radius: 0.5 })]);
    let spike = || Body::fixed(vec![Part::new(Shape::Cone { half_length: 1.0, radius: 0.5 })]);
    // The mantle of the cone rises by 2 over 0.5: its normal is (4, 0, 1).
    let mantle = normalise([4.0, 0.0, 1.0]);
    let beside = add([0.25, 0.0, 0.0], scale(0.31, mantle));
    for (body, at, gap, normal) in [
        (post(), [0.1, 0.2, 1.29], -0.01, [0.0, 0.0, 1.0]),
        (post(), [0.48, 0.64, 0.3], 0.0, [0.6, 0.8, 0.0]),
        (post(), [0.6 * 0.7, 0.8 * 0.7, 1.2], 0.08_f64.sqrt() - 0.3, [0.6, 0.8, 1.0]),
        (post(), [0.1, 0.0, 0.9], -0.4, [0.0, 0.0, 1.0]),
        (post(), [0.4, 0.0, 0.2], -0.4, [1.0, 0.0, 0.0]),
        (spike(), [0.0, 0.0, 1.31], 0.01, [0.0, 0.0, 1.0]),
        (spike(), beside, 0.01, mantle),
        (spike(), [0.1, 0.1, -1.29], -0.01, [0.0, 0.0, -1.0]),
    ] {
        let found = contacts(&two(body.clone(), ball(at)));
        assert_eq!(found.len(), 1, "{at:?} {found:?}");
        let place = found[0].place;
        assert!((place.gap - gap).abs() < 1e-14, "{at:?} {place:?}");
        assert!(norm(sub(place.normal, normalise(normal))) < 1e-14, "{at:?} {place:?}");
        // The other way round.
        let mut world = World::default();
        world.add(ball(at));
        world.add(body);
        let other = contacts(&world);
        assert!((other[0].place.gap - gap).abs() < 1e-14);
        assert!(norm(add(other[0].place.normal, place.normal)) < 1e-14);
    }
}

/// The signed distance of x = (ρ, z) from the profile of a solid with its base of radius r at −h and its top of radius s at h, by all sides of the polygon.
fn from_profile([r, s, h]: [f64; 3], x: [f64; 2]) -> f64 {
    let corners = [[0.0, -h], [r, -h], [s, h], [0.0, h]].map(|[rho, z]| [rho, z, 0.0]);
    let at = [x[0], x[1], 0.0];
    let far = corners.windows(2).map(|side| {
        let line = Segment::between(side[0], side[1]);
        norm(sub(at, line.at(line.nearest(at))))
    });
    let wide = r + 0.5 * (s - r) * (x[1] / h + 1.0);
    let sign = if x[1].abs() < h && x[0] < wide { -1.0 } else { 1.0 };
    sign * far.fold(f64::INFINITY, f64::min)
}

#[test]
fn balls_are_as_far_from_cylinders_and_cones_as_from_their_profiles() {
    let mut rng = Pcg64::seed_from_u64(31);
    let (mut outside, mut inside, mut behind) = (0, 0, 0);
    for round in 0..4000 {
        // From needles to discs; a cone has an acute rim, behind whose plane a ball may be.
        let [r, h] = [0.0, 0.0].map(|_: f64| 10_f64.powf(rng.random_range(-1.3..0.0)));
        let is_cone = round % 3 > 0;
        let shape = match is_cone {
            true => Shape::Cone { half_length: h, radius: r },
            false => Shape::Cylinder { half_length: h, radius: r },
        };
        let s = if is_cone { 0.0 } else { r };
        let radius = rng.random_range(0.05..0.5);
        let reach = radius + MARGIN;
        let rho = rng.random_range(0.0..r + reach);
        let z = rng.random_range(-h - reach..h + reach);
        let truth = from_profile([r, s, h], [rho, z]) - radius;
        if truth > MARGIN {
            continue;
        }
        let (turn, place) = (rotation(&mut rng), vector(&mut rng, 1.0));
        let around = rng.random_range(0.0..std::f64::consts::TAU);
        let local = |rho: f64, z: f64| [rho * around.cos(), rho * around.sin(), z];
        let pose = Pose { x: place, r: turn.matrix() };
        let fixed = Body::fixed(vec![Part::new(shape)]).turned(turn).at(place);
        let ball = solid(Shape::Sphere { radius }).at(pose.point(local(rho, z)));
        let found = contacts(&two(fixed, ball));
        assert_eq!(found.len(), 1, "{r} {h} {rho} {z} {truth}");
        let Place { normal, gap, .. } = found[0].place;
        assert!((gap - truth).abs() < 1e-12, "{r} {h} {is_cone} {rho} {z} {gap} {truth}");
        // Along the normal it goes out.
        let n = pose.local_direction(normal);
        let (out, step) = (n[0] * around.cos() + n[1] * around.sin(), 1e-6);
        let moved = from_profile([r, s, h], [(rho + step * out).abs(), z + step * n[2]]) - radius;
        assert!((moved - truth - step).abs() < 1e-3 * step, "{r} {h} {is_cone} {rho} {z} {n:?}");
        let is_inside = truth + radius < 0.0;
        *(if is_inside { &mut inside } else { &mut outside }) += 1;
        let at_rim = (rho - r).hypot(z + h) - radius - truth < 1e-12;
        behind += usize::from(!is_inside && at_rim && z > -h);
    }
    assert!(outside > 1000 && inside > 300 && behind > 50, "{outside} {inside} {behind}");
}

#[test]
fn flat_ends_and_lines_touch_as_wholes() {
    let plate = |half: Vec3| Body::fixed(vec![Part::new(Shape::Box { half })]);
    let table = || plate([1.0, 1.0, 0.5]);
    let post = || Body::fixed(vec![Part::new(Shape::Cylinder { half_length: 0.5, radius: 0.3 })]);
    let rod = || solid(Shape::Capsule { half_length: 0.4, radius: 0.1 });
    for (a, b, count, gap) in [
        // A cylinder upright on a face, on part of it (four of its points, and two where the edge cuts the rim), on a corner of it.
        (table(), cylinder(0.2, 0.3).at([0.1, 0.2, 0.71]), 8, 0.01),
        (table(), cylinder(0.2, 0.3).at([0.99, 0.0, 0.71]), 5 + 2, 0.01),
        (plate([0.1, 0.1, 0.5]), cylinder(0.2, 0.3).at([0.0, 0.0, 0.71]), 4, 0.01),
        (post(), cuboid([0.1, 0.1, 0.2]).at([0.0, 0.1, 0.71]), 4, 0.01),
        // Lying, and lying across the edge.
        (table(), cylinder(0.2, 0.3).turned(lying()).at([0.1, 0.2, 0.81]), 2, 0.01),
        (table(), cylinder(0.2, 0.3).turned(lying()).at([0.95, 0.2, 0.81]), 2, 0.01),
        // Ends on each other; a rod on an end; a lying one on an end.
        (post(), cylinder(0.5, 0.3).at([0.0, 0.0, 1.01]), 8, 0.01),
        (post(), cylinder(0.2, 0.1).at([0.1, 0.0, 0.71]), 8, 0.01),
        (post(), rod().turned(lying()).at([0.0, 0.1, 0.61]), 2, 0.01),
        (post(), cylinder(0.4, 0.1).turned(lying()).at([0.0, 0.1, 0.61]), 2, 0.01),
        // Side by side, crossed.
        (post(), cylinder(0.5, 0.2).at([0.51, 0.0, 0.3]), 2, 0.01),
        (post(), cylinder(0.5, 0.2).turned(lying()).at([0.0, 0.51, 0.3]), 1, 0.01),
        // Capsules with boxes: on a face, across an edge, end first, over a corner.
        (table(), rod().turned(lying()).at([0.0, 0.0, 0.61]), 2, 0.01),
        (table(), rod().at([0.0, 0.0, 1.01]), 1, 0.01),
        (table(), rod().turned(lying()).at([1.2, 0.0, 0.59]), 2, -0.01),
        (
            table(),
            rod().turned(Rotation::about([1.0, 0.0, 0.0], 0.3)).at([1.11, 0.0, 0.3]),
            2,
            0.01,
        ),
        // Cones.
        (table(), cone(0.2, 0.3).at([0.0, 0.0, 0.61]), 8, 0.01),
        (post(), cone(0.2, 0.3).at([0.0, 0.0, 0.61]), 8, 0.01),
    ] {
        let world = two(a, b);
        let found = contacts(&world);
        assert_eq!(found.len(), count, "{world:?} {found:#?}");
        for near in &found {
            assert!((near.place.gap - gap).abs() < 1e-12, "{gap} {near:?}");
        }
    }
}

#[test]
fn round_ends_touch_all_over_what_they_share() {
    let base = |radius: f64| Part::new(Shape::Cone { half_length: 0.5, radius });
    let over = Rotation::about([1.0, 0.0, 0.0], std::f64::consts::PI);
    let angles = |k: u32| f64::from(k) * std::f64::consts::TAU / 360.0;
    for (below, above, off) in [
        (0.2, 0.5, 0.0),
        (0.2, 0.5, 0.1),
        (0.2, 0.5, 0.4),
        (0.5, 0.2, 0.4),
        (0.5, 0.5, 0.0),
        (0.5, 0.5, 1e-9),
        (0.5, 0.5, 1e-7),
        (0.5, 0.5, 0.1),
        (0.5, 0.5, 0.4),
        (0.45, 0.5, 0.2),
        (0.3, 0.300_000_1, 0.0),
    ] {
        // Both rims, and what of them lies in the other end too.
        let centres = [[0.0; 3], [off, 0.0, 0.0]];
        let from = |k: usize, x: Vec3| (x[0] - centres[k][0]).hypot(x[1]);
        let rim = |k: usize, r: f64| {
            (0..360).map(angles).map(move |t| add(centres[k], [r * t.cos(), r * t.sin(), 0.0]))
        };
        let both = |x: &Vec3| from(0, *x) <= below + 1e-9 && from(1, *x) <= above + 1e-9;
        let shared: Vec<Vec3> = rim(0, below).chain(rim(1, above)).filter(both).collect();
        for (lower, upper) in [
            (Body::fixed(vec![base(below)]).turned(over), solid(base(above).shape)),
            (
                Body::fixed(vec![Part::new(Shape::Cylinder { half_length: 0.5, radius: below })]),
                cylinder(0.5, above),
            ),
        ] {
            // The centre of mass of a cone is half as high above the base.
            let high = 0.5 - upper.parts[0].position[2];
            let upper = upper.at([off, 0.0, 0.5 + high - 1e-3]);
            for swapped in [false, true] {
                let (a, b) = (lower.clone(), upper.clone());
                let found = contacts(&if swapped { two(b, a) } else { two(a, b) });
                assert!(found.len() >= 4 && found.len() <= 18, "{below} {above} {off} {found:#?}");
                for near in &found {
                    let x = near.place.point;
                    assert!((near.place.gap + 1e-3).abs() < 1e-12, "{near:?}");
                    assert!(from(0, x) < below + 1e-6 && from(1, x) < above + 1e-6, "{near:?}");
                }
                for t in (0..360).map(angles) {
                    let along = |x: &Vec3| x[0] * t.cos() + x[1] * t.sin();
                    let most = |xs: &mut dyn Iterator<Item = Vec3>| {
                        xs.map(|x| along(&x)).fold(f64::NEG_INFINITY, f64::max)
                    };
                    let reached = most(&mut found.iter().map(|n| n.place.point));
                    let whole = most(&mut shared.iter().copied());
                    // An eighth of a rim is higher than its chord by no more.
                    let rise = 0.08 * f64::max(below, above);
                    assert!(reached > whole - rise, "{below} {above} {off} {t} {reached} {whole}");
                }
            }
        }
    }
    // Inclined by so little that the other end is the face, the points are the same.
    let names = |lean: f64| -> Vec<Key> {
        let turn = Rotation::about([0.0, 1.0, 0.0], lean);
        let table = cylinder(0.05, 0.5).turned(turn).at([0.0, 0.0, 0.55]);
        contacts(&two(cylinder(0.5, 0.2), table)).iter().map(|n| n.key).collect()
    };
    assert_eq!(names(0.0).len(), 8);
    assert!(names(3e-6).iter().filter(|k| names(0.0).contains(k)).count() == 8);
}

/// The point of a convex body that is farthest along d.
fn farthest(body: &Body, d: Vec3) -> Vec3 {
    let r = body.rotation.matrix();
    let pose = Pose { x: body.position, r };
    let d = pose.local_direction(d);
    let part = &body.parts[0];
    let flat = d[0].hypot(d[1]).max(1e-300);
    let out = |r: f64| [r * d[0] / flat, r * d[1] / flat];
    let local = match &part.shape {
        Shape::Cylinder { half_length, radius } => {
            let [x, y] = out(*radius);
            [x, y, half_length * d[2].signum()]
        }
        Shape::Cone { half_length, radius } => {
            let [x, y] = out(*radius);
            let base = [x, y, -half_length];
            let point = [0.0, 0.0, *half_length];
            if dot(base, d) > dot(point, d) { base } else { point }
        }
        Shape::Capsule { half_length, radius } => {
            add([0.0, 0.0, half_length * d[2].signum()], scale(*radius, normalise(d)))
        }
        Shape::Box { half } => std::array::from_fn(|i| half[i] * d[i].signum()),
        Shape::Polyhedron(p) => {
            let by = |v: &Vec3| dot(*v, d);
            *p.vertices().iter().max_by(|v, w| by(v).total_cmp(&by(w))).unwrap()
        }
        _ => unreachable!(),
    };
    pose.point(add(part.position, local))
}

/// The largest separation of two convex shapes along any direction, by search.
fn searched(world: &World, rng: &mut Pcg64) -> f64 {
    let support = |k: usize, d: Vec3| farthest(&world.bodies[k], d);
    let separation = |n: Vec3| dot(n, sub(support(1, scale(-1.0, n)), support(0, n)));
    let mut starts: Vec<(f64, Vec3)> = (0..300)
        .map(|_| {
            let n = normalise(vector(rng, 1.0));
            (separation(n), n)
        })
        .collect();
    starts.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut best = f64::NEG_INFINITY;
    for (mut value, mut n) in starts.into_iter().take(8) {
        let mut step = 0.2;
        while step > 1e-9 {
            let better = (0..30).find_map(|_| {
                let m = normalise(add(n, scale(step, vector(rng, 1.0))));
                let now = separation(m);
                (now > value).then_some((now, m))
            });
            match better {
                Some((now, m)) => (value, n) = (now, m),
                None => step *= 0.5,
            }
        }
        best = best.max(value);
    }
    best
}

#[test]
fn round_solids_that_nearly_touch_are_as_far_apart_as_they_are() {
    let mut rng = Pcg64::seed_from_u64(41);
    for round in 0..300 {
        let shape = |kind: usize, rng: &mut Pcg64| -> Body {
            let mut x = || rng.random_range(0.3..0.8);
            match kind {
                0 => cylinder(x(), x()),
                1 => cone(x(), x()),
                _ => cuboid([x(), x(), x()]),
            }
        };
        let a = shape(round % 2, &mut rng).turned(rotation(&mut rng)).at([0.0; 3]);
        let b = shape(round % 3, &mut rng).turned(rotation(&mut rng)).at([0.0; 3]);
        let n = normalise(vector(&mut rng, 1.0));
        let at = sub(farthest(&a, n), farthest(&b, scale(-1.0, n)));
        for gap in [1e-3, 1.1e-4, 9e-5, 1e-5, 1e-6, -1e-6, -1e-5, -1e-4] {
            let found = gaps(&two(a.clone(), b.clone().at(add(at, scale(gap, n)))));
            assert!(!found.is_empty(), "{round} {gap}");
            // Solids that overlap along one normal may do so by less along another.
            let error = found[0] - gap;
            assert!(error > -1e-2 * gap.abs(), "{round} {gap} {found:?}");
            assert!(gap < 0.0 || error < 1e-4 * gap, "{round} {gap} {found:?}");
        }
    }
}

#[test]
fn round_solids_agree_with_a_search_of_all_directions() {
    let mut rng = Pcg64::seed_from_u64(23);
    let (mut touching, mut apart) = (0, 0);
    for round in 0..400 {
        let shape = |kind: usize, rng: &mut Pcg64| -> Body {
            let mut x = || rng.random_range(0.3..0.8);
            match kind {
                0 => cylinder(x(), x()),
                1 => cone(x(), x()),
                2 => cuboid([x(), x(), x()]),
                3 => solid(Shape::Capsule { half_length: x(), radius: 0.5 * x() }),
                _ => solid(rock(rng, 9)),
            }
        };
        let (a, b) = (shape(round % 2, &mut rng), shape(round % 5, &mut rng));
        // The second body first in every other pair.
        let (a, b) = if round % 4 < 2 { (a, b) } else { (b, a) };
        let (a, b) = match round % 3 {
            0 if round % 5 != 3 => (a, b),
            _ if round % 5 == 3 && round % 3 == 0 => {
                (solid(Shape::Capsule { half_length: 0.5, radius: 0.2 }), cuboid([0.5, 0.4, 0.3]))
            }
            _ => (a, b),
        };
        let direction = normalise(vector(&mut rng, 1.0));
        let far = rng.random_range(0.4..1.4);
        let world = two(
            a.turned(rotation(&mut rng)).at([0.0; 3]),
            b.turned(rotation(&mut rng)).at(scale(far, direction)),
        );
        let truth = searched(&world, &mut rng);
        let found = contacts(&world);
        if truth > 2.0 * MARGIN + 1e-6 {
            assert!(found.is_empty(), "{round} {truth} {found:?}");
            apart += 1;
            continue;
        }
        if truth < -0.1 {
            // Deep inside there are several local maxima: any of them is an answer.
            assert!(!found.is_empty(), "{round} {truth}");
            continue;
        }
        assert!(!found.is_empty(), "{round} {truth}\n{world:?}");
        let least = found.iter().map(|n| n.place.gap).fold(f64::INFINITY, f64::min);
        // The search comes near the maximum from below.
        assert!(
            least > truth - 1e-7 && least < truth + 1e-4,
            "{round} {least} {truth}\n{found:?}\n{world:?}"
        );
        touching += 1;
    }
    assert!(touching > 50 && apart > 30, "{touching} {apart}");
}

fn grid(n: usize, height: impl Fn(f64, f64) -> f64) -> Body {
    let at = |k: usize| 4.0 * (k as f64 / (n - 1) as f64 - 0.5);
    let row = |i: usize| (0..n).map(|j| height(at(j), at(i))).collect();
    let heights: Vec<Vec<f64>> = (0..n).map(row).collect();
    Body::fixed(vec![Part::new(crate::Mesh::heightfield(&heights, [4.0, 4.0]).unwrap())])
}

#[test]
fn triangulated_ground_is_like_the_ground() {
    // A flat field of 200 triangles and a wavy one of coplanar strips: what stands there has the contacts that it has on a plane.
    let flat = || grid(11, |_, _| 0.0);
    let shapes = [
        solid(Shape::Sphere { radius: 0.3 }),
        cuboid([0.7, 0.5, 0.3]),
        solid(Shape::Capsule { half_length: 0.9, radius: 0.3 }).turned(lying()),
        cylinder(0.3, 0.9),
        cylinder(0.9, 0.3).turned(lying()),
        cone(0.6, 0.5),
    ];
    for shape in shapes {
        for gap in [0.01, 0.0, -0.01] {
            let at = [0.13, -0.27, 0.3 + gap];
            let turn = Rotation::about([0.0, 0.0, 1.0], 0.4).after(shape.rotation);
            let there = shape.clone().turned(turn).at(at);
            let on_plane = contacts(&two(Body::floor(), there.clone()));
            let mut on_field = contacts(&two(flat(), there));
            assert_eq!(on_field.len(), on_plane.len(), "{gap} {:?} {on_field:#?}", shape.parts);
            for near in &on_plane {
                let p = near.place;
                let found = on_field.iter().position(|n| norm(sub(n.place.point, p.point)) < 1e-9);
                let place = on_field.swap_remove(found.expect("the same point")).place;
                assert!(
                    (place.gap - p.gap).abs() < 1e-12 && norm(sub(place.normal, p.normal)) < 1e-12
                );
            }
        }
    }
}

#[test]
fn inner_edges_do_not_stop_what_slides_over_them() {
    // All normals of a plane inclined field are the plane's, wherever the body is.
    let slope = |x: f64, y: f64| 0.3 * x - 0.2 * y;
    let n = normalise([-0.3, 0.2, 1.0]);
    let mut rng = Pcg64::seed_from_u64(8);
    let mut seen = 0;
    for round in 0..400 {
        let shape = match round % 5 {
            0 => solid(Shape::Sphere { radius: 0.2 }),
            1 => cuboid([0.2, 0.3, 0.1]),
            2 => solid(Shape::Capsule { half_length: 0.3, radius: 0.1 }),
            3 => cylinder(0.2, 0.2),
            _ => solid(rock(&mut rng, 8)),
        };
        let [x, y, _] = vector(&mut rng, 1.2);
        let z = slope(x, y) + rng.random_range(0.1..0.9);
        let there = shape.turned(rotation(&mut rng)).at([x, y, z]);
        for near in contacts(&two(grid(9, slope), there)) {
            assert!(norm(sub(near.place.normal, n)) < 1e-9, "{round} {near:?}");
            seen += 1;
        }
    }
    assert!(seen > 100, "{seen}");
}

/// A box as a closed mesh of twelve triangles.
fn crate_mesh(half: Vec3) -> crate::Mesh {
    let p = Polyhedron::cuboid(half).unwrap();
    let fan = |f: &Vec<usize>| [[f[0], f[1], f[2]], [f[0], f[2], f[3]]];
    let triangles: Vec<[usize; 3]> = p.faces().iter().flat_map(fan).collect();
    crate::Mesh::new(p.vertices(), &triangles).unwrap()
}

/// Triangulations of the ground z = 0: a sheet of two, a crate of twelve, fields with edges of 2 and 0.2 m.
fn flat_grounds() -> Vec<Body> {
    let sheet = [[-2.0, -2.0, 0.0], [2.0, -2.0, 0.0], [2.0, 2.0, 0.0], [-2.0, 2.0, 0.0]];
    let sheet = crate::Mesh::new(&sheet, &[[0, 1, 2], [0, 2, 3]]).unwrap();
    let block = crate_mesh([2.0, 2.0, 0.5]);
    let fixed = |mesh| Body::fixed(vec![Part::new(mesh)]);
    let mut out = vec![fixed(block).at([0.0, 0.0, -0.5]), fixed(sheet)];
    out.extend([3, 21].map(|n| grid(n, |_, _| 0.0)));
    out
}

#[test]
fn flat_meshes_and_fields_lose_no_contact_of_a_plane() {
    let mut rng = Pcg64::seed_from_u64(29);
    let heptagon = |k: i32| {
        let (s, c) = (f64::from(k) * std::f64::consts::TAU / 7.0).sin_cos();
        [0.4 * c, 0.4 * s, 0.0]
    };
    let heptagon: Vec<Vec3> = (0..7).map(heptagon).collect();
    let prism = Polyhedron::prism(&heptagon, [0.1, 0.0, 0.5]).unwrap();
    let (mut seen, grounds) = ([0; 8], flat_grounds());
    for round in 0..640 {
        let kind = round % 8;
        let shape = match kind {
            0 => solid(Shape::Sphere { radius: 0.3 }),
            1 => cuboid([0.3, 0.4, 0.2]),
            2 => solid(prism.clone()),
            3 => solid(Shape::Capsule { half_length: 0.3, radius: 0.1 }),
            4 => cylinder(0.3, 0.3),
            5 => cylinder(0.03, 0.4),
            6 => cone(0.3, 0.3),
            _ => solid(crate_mesh([0.3, 0.4, 0.2])),
        };
        // Flat, leaning a little, or anyhow; lying on its side every other time.
        let angle = [0.0, 1e-4, 1e-3, 0.01, 0.1, 3.0][rng.random_range(0..6)];
        let start = if round / 8 % 2 == 0 { Rotation::IDENTITY } else { lying() };
        let axis = normalise(vector(&mut rng, 1.0));
        let spun = Rotation::about([0.0, 0.0, 1.0], rng.random_range(-3.0..3.0)).after(start);
        let turn = Rotation::about(axis, angle * rng.random_range(-1.0..1.0)).after(spun);
        let [x, y, _] = vector(&mut rng, 1.0);
        // At a random gap, as the plane sees it from afar.
        let there = |z: f64| shape.clone().turned(turn).at([x, y, z]);
        let lowest = |z: f64| gaps(&two(Body::floor(), there(z))).first().copied();
        let z = (0..40).map(|k| 0.8 - 0.02 * f64::from(k)).find(|&z| lowest(z).is_some());
        let z = z.map(|z| z - lowest(z).unwrap() + rng.random_range(-0.01..0.03)).unwrap();
        let on_plane = contacts(&two(Body::floor(), there(z)));
        for (k, ground) in grounds.iter().enumerate() {
            if kind == 7 && k == 1 {
                continue; // A sheet does not meet surfaces.
            }
            let found = contacts(&two(ground.clone(), there(z)));
            for near in &found {
                let n = near.place.normal;
                assert!(norm(sub(n, [0.0, 0.0, 1.0])) < 2e-2, "{round} {k} {near:?}");
            }
            // The corners of the face that looks downwards, if not all; rounds at points a little aside.
            for near in on_plane.iter().filter(|n| n.place.gap < 0.02) {
                let p = near.place;
                let same = |n: &&Near| norm(sub(n.place.point, p.point)) < 1e-3;
                let same =
                    found.iter().filter(same).min_by(|a, b| a.place.gap.total_cmp(&b.place.gap));
                let Some(same) = same else { panic!("{round} {k} {near:#?} {found:#?}") };
                assert!((same.place.gap - p.gap).abs() < 1e-4, "{round} {k} {same:?} {p:?}");
                seen[kind] += 1;
            }
        }
    }
    assert!(seen.iter().all(|&n| n > 100), "{seen:?}");
}

#[test]
fn a_mesh_of_a_box_touches_as_the_box() {
    let half = [0.5, 0.4, 0.3];
    let mut rng = Pcg64::seed_from_u64(12);
    let (mut touching, mut same) = (0, 0);
    for round in 0..500 {
        let other = match round % 4 {
            0 => solid(Shape::Sphere { radius: 0.3 }),
            1 => cuboid([0.3, 0.4, 0.2]),
            2 => solid(Shape::Capsule { half_length: 0.3, radius: 0.2 }),
            _ => cylinder(0.3, 0.3),
        };
        let far = rng.random_range(0.5..0.9);
        let there = scale(far, normalise(vector(&mut rng, 1.0)));
        let other = other.turned(rotation(&mut rng)).at(there);
        let (turn, mesh) = (rotation(&mut rng), solid(crate_mesh(half)));
        assert!((mesh.mass - cuboid(half).mass).abs() < 1e-14);
        let as_box = contacts(&two(cuboid(half).turned(turn), other.clone()));
        let as_mesh = contacts(&two(mesh.turned(turn), other));
        let least = |list: &[Near]| list.iter().map(|n| n.place.gap).fold(f64::INFINITY, f64::min);
        let (p, q) = (least(&as_box), least(&as_mesh));
        if !(-0.05..0.05).contains(&p) {
            continue;
        }
        touching += 1;
        assert!(!as_mesh.is_empty(), "{round} {as_box:?}");
        // The surface knows one triangle at a time: inside, it may find another face than the nearest one.
        same += usize::from((p - q).abs() < 1e-6);
        if p > 0.0 {
            assert!((p - q).abs() < 1e-5, "{round} {p} {q}\n{as_box:#?}\n{as_mesh:#?}");
        }
    }
    assert!(touching > 60 && 10 * same > 8 * touching, "{same} of {touching}");
    // On a plane it stands on its corners, not on points inside its faces.
    assert_eq!(gaps(&two(Body::floor(), solid(crate_mesh(half)).at([0.0, 0.0, 0.31]))).len(), 4);
}

#[test]
fn a_corner_on_an_edge_of_a_mesh_is_not_met_by_the_faces_beside_it() {
    let mut rng = Pcg64::seed_from_u64(67);
    let mut seen = 0;
    for round in 0..120 {
        let [x, y] = [0.0; 2].map(|_: f64| rng.random_range(0.3..1.0));
        let (n, depth) = (normalise([x, y, 0.0]), [1e-7, 1e-5, 1e-3][round % 3]);
        let rest = sub([0.5, 0.5, rng.random_range(-0.4..0.4)], scale(depth, n));
        let body = cuboid([0.4, 0.3, 0.2]).turned(rotation(&mut rng));
        let body = body.clone().at(sub(rest, farthest(&body, scale(-1.0, n))));
        let block = cuboid([0.5; 3]);
        for near in contacts(&two(solid(crate_mesh([0.5; 3])), body.clone())) {
            // Along its normal the bodies overlap by no more than a slope's worth of their size.
            let m = near.place.normal;
            let apart = dot(m, sub(farthest(&body, scale(-1.0, m)), farthest(&block, m)));
            assert!(near.place.gap > 0.0 || apart > -0.1, "{round} {apart} {near:?}");
            seen += usize::from(near.place.gap < 0.0);
        }
    }
    assert!(seen >= 120, "{seen}");
}

#[test]
fn rims_and_points_that_have_sunk_into_a_mesh_touch_it() {
    let mut rng = Pcg64::seed_from_u64(53);
    for round in 0..400 {
        let p = rock(&mut rng, if round % 3 == 0 { 6 } else { 12 });
        let faces: Vec<_> = p.faces().iter().map(|f| [f[0], f[1], f[2]]).collect();
        let mesh = crate::Mesh::new(p.vertices(), &faces).unwrap();
        let (turn, n) = (rotation(&mut rng), normalise(vector(&mut rng, 1.0)));
        let [x, y] = [0.0; 2].map(|_: f64| rng.random_range(0.3..0.6));
        let body = if round % 2 == 0 { cylinder(x, y) } else { cone(x, y) };
        let body = body.turned(turn).at([0.0; 3]);
        let fixed = |shape: Shape| Body::fixed(vec![Part::new(shape)]);
        let hull = fixed(Shape::from(p));
        // By a hundredth of its size, without any motion.
        let rest = add(farthest(&hull, n), scale(-0.005, n));
        let body = body.clone().at(sub(rest, farthest(&body, scale(-1.0, n))));
        let least = |world: World| gaps(&world).first().copied();
        let as_hull = least(two(hull, body.clone())).expect("they overlap");
        let as_mesh = least(two(fixed(Shape::from(mesh)), body));
        if as_hull < -1e-4 {
            assert!(as_mesh.is_some(), "{round} {as_hull}");
        }
    }
}

#[test]
fn the_lowest_vertex_touches_though_its_faces_look_down_less_than_another() {
    // Two faces of 30 degrees beside the lowest vertex at one end of a keel, another one of 20 above it.
    let t = std::f64::consts::FRAC_PI_6.tan();
    let end = [[t, -1.0, 1.0], [-t, -1.0, 1.0], [t, 1.75, 1.0], [-t, 1.75, 1.0]];
    let vertices: Vec<Vec3> = [[0.0, -1.0, 0.0], [0.0, 1.0, 0.0]].into_iter().chain(end).collect();
    let faces =
        [vec![0, 2, 3], vec![1, 5, 4], vec![0, 1, 4, 2], vec![0, 3, 5, 1], vec![2, 4, 5, 3]];
    let keel = solid(Polyhedron::new(vertices, faces.into()).unwrap());
    let mut grounds = flat_grounds();
    grounds.push(
        Body::fixed(vec![Part::new(Shape::Box { half: [3.0, 3.0, 0.5] })]).at([0.0, 0.0, -0.5]),
    );
    let mut disc = cylinder(0.5, 3.0).at([0.0, 0.0, -0.5]);
    disc.motion = crate::Motion::Fixed;
    grounds.push(disc);
    for angle in [0.05, 0.2] {
        let there = |z: f64| {
            keel.clone().turned(Rotation::about([1.0, 0.0, 0.0], angle)).at([0.13, 0.07, z])
        };
        let lowest = gaps(&two(Body::floor(), there(0.0)))[0];
        for gap in [0.01, -0.003] {
            let on_plane = contacts(&two(Body::floor(), there(gap - lowest)));
            let p = on_plane.iter().min_by(|a, b| a.place.gap.total_cmp(&b.place.gap)).unwrap();
            for (k, ground) in grounds.iter().enumerate() {
                let found = contacts(&two(ground.clone(), there(gap - lowest)));
                let same = |n: &Near| norm(sub(n.place.point, p.place.point)) < 1e-9;
                assert!(found.iter().any(same), "{angle} {gap} {k} {found:#?}");
            }
        }
    }
}

#[test]
fn sharp_edges_are_met_from_all_sides() {
    // A wedge of 45 degrees as a mesh and as a polyhedron, and a ridge of 53.
    let ends = |y: f64| [[-2.0, y, 0.0], [0.0, y, 0.0], [-2.0, y, -2.0]];
    let vertices: Vec<Vec3> = ends(-1.0).into_iter().chain(ends(1.0)).collect();
    let sides = [[0, 2, 1], [3, 4, 5]];
    let quads = [[0, 1, 4, 3], [1, 2, 5, 4], [2, 0, 3, 5]];
    let halves = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
    let triangles: Vec<_> = sides.into_iter().chain(halves).collect();
    let faces = sides.iter().map(|f| f.to_vec()).chain(quads.iter().map(|f| f.to_vec()));
    let mesh = crate::Mesh::new(&vertices, &triangles).unwrap();
    let whole = Polyhedron::new(vertices, faces.collect()).unwrap();
    let fixed = |part: Part| Body::fixed(vec![part]);
    let (mesh, whole) = (fixed(Part::new(mesh)), fixed(Part::new(Shape::from(whole))));
    let ball = solid(Shape::Sphere { radius: 0.3 });
    let out = |degrees: f64| {
        let (s, c) = degrees.to_radians().sin_cos();
        [c, 0.0, s]
    };
    for degrees in [89.0, 70.0, 50.0, 20.0, -10.0, -40.0] {
        let n = out(degrees);
        let found = contacts(&two(mesh.clone(), ball.clone().at(scale(0.31, n))));
        assert_eq!(found.len(), 1, "{degrees} {found:?}");
        let place = found[0].place;
        assert!((place.gap - 0.01).abs() < 1e-9 && norm(sub(place.normal, n)) < 1e-9, "{place:?}");
        let others = [
            solid(Shape::Capsule { half_length: 0.4, radius: 0.3 }),
            cylinder(0.3, 0.3),
            cuboid([0.3, 0.2, 0.25]),
            solid(crate_mesh([0.3, 0.2, 0.25])),
        ];
        for (k, other) in others.into_iter().enumerate() {
            let other = other.turned(Rotation::about([0.3, 1.0, 0.1], 0.7));
            let at = |far: f64| other.clone().at(scale(far, n));
            let near =
                |&far: &f64| gaps(&two(whole.clone(), at(far))).first().is_some_and(|g| *g < 0.01);
            let far = (0..200).map(|k| 1.0 - 0.004 * f64::from(k)).find(near).unwrap();
            let [p, q] = [&whole, &mesh].map(|solid| gaps(&two(solid.clone(), at(far))));
            // Two meshes may meet elsewhere too.
            let count = if k < 3 { 1 } else { q.len() };
            let same = q.iter().take(count).any(|g| (g - p[0]).abs() < 1e-6);
            assert!(same, "{degrees} {k} {p:?} {q:?}");
        }
    }
    let field = |heights: [f64; 3]| {
        let heights = [heights.to_vec(), heights.to_vec()];
        fixed(Part::new(crate::Mesh::heightfield(&heights, [1.0, 4.0]).unwrap()))
    };
    for degrees in [90.0, 60.0, 35.0, 28.0, 150.0] {
        let n = out(degrees);
        let at = add([0.0, 0.1, 1.0], scale(0.31, n));
        let found = contacts(&two(field([0.0, 1.0, 0.0]), ball.clone().at(at)));
        assert_eq!(found.len(), 1, "{degrees} {found:?}");
        assert!(norm(sub(found[0].place.normal, n)) < 1e-9, "{degrees} {found:?}");
    }
    // The bottom of a valley is none: there the slopes alone are met.
    for z in [0.05, 0.11, 0.13] {
        let small = solid(Shape::Sphere { radius: 0.05 }).at([0.01, 0.1, z]);
        for near in contacts(&two(field([1.0, 0.0, 1.0]), small)) {
            let slope = near.place.normal[2] - 0.2_f64.sqrt();
            assert!(slope.abs() < 1e-9, "{z} {near:?}");
        }
    }
}

/// The separation of a point from a polygon, from below by sampled sides: brute force.
fn sampled(corners: &[Vec3], at: Vec3) -> f64 {
    const STEPS: usize = 2000;
    let n = corners.len();
    let points = (0..n).flat_map(|k| {
        let (p, q) = (corners[k], corners[(k + 1) % n]);
        (0..STEPS).map(move |i| add(p, scale(i as f64 / STEPS as f64, sub(q, p))))
    });
    let far = points.map(|p| norm(sub(at, p))).fold(f64::INFINITY, f64::min);
    let inside = (0..n).all(|k| {
        let (p, q) = (corners[k], corners[(k + 1) % n]);
        cross(sub(q, p), sub(at, p))[2] > 0.0
    });
    if inside { -far } else { far }
}

fn polygon(rng: &mut Pcg64) -> crate::Polygon {
    let count = rng.random_range(3..9);
    let turn = rng.random_range(0.0..1.0);
    let corners: Vec<[f64; 2]> = (0..count)
        .map(|k| {
            let angle = (f64::from(k) + turn) * std::f64::consts::TAU / f64::from(count);
            [0.5 * angle.cos(), 0.3 * angle.sin()]
        })
        .collect();
    crate::Polygon::new(&corners).unwrap()
}

#[test]
fn shapes_of_the_plane_are_as_far_apart_as_brute_force_says() {
    let mut rng = Pcg64::seed_from_u64(17);
    let (mut touching, mut deep) = (0, 0);
    for round in 0..600 {
        let mut world = World::in_plane([0.0, -1.0]);
        let shape = polygon(&mut rng);
        let mut turn = || Rotation::about([0.0, 0.0, 1.0], rng.random_range(-3.0..3.0));
        let (first, second) = (turn(), turn());
        let place = |corners: &[[f64; 2]], r: &Rotation, x: Vec3| -> Vec<Vec3> {
            let r = r.matrix();
            let point = |&[p, q]: &[f64; 2]| add(x, nonsmooth_scenes::vec3::apply(&r, [p, q, 0.0]));
            corners.iter().map(point).collect()
        };
        let angle = rng.random_range(0.0..6.3_f64);
        let far = rng.random_range(0.3..0.9);
        let at = [far * angle.cos(), far * angle.sin(), 0.0];
        let here = place(shape.vertices(), &first, [0.0; 3]);
        let body = |shape: Shape| Body::in_plane(1.0, 1.0, vec![Part::new(shape)]);
        let polygon_body = body(Shape::Polygon(shape.clone())).turned(first);
        // What is known of the gap: from a disc, a capsule, or as the best of all directions.
        let (other, gap) = match round % 3 {
            0 => (Shape::Disc { radius: 0.2 }, sampled(&here, at) - 0.2),
            1 => {
                let ends = place(&[[-0.3, 0.0], [0.3, 0.0]], &second, at);
                let along = |i: usize| add(ends[0], scale(i as f64 / 400.0, sub(ends[1], ends[0])));
                let least = (0..=400).map(|i| sampled(&here, along(i)));
                let least = least.fold(f64::INFINITY, f64::min);
                (Shape::Stadium { half_length: 0.3, radius: 0.1 }, least - 0.1)
            }
            _ => {
                let other = polygon(&mut rng);
                let there = place(other.vertices(), &second, at);
                let along = |k: usize| {
                    let (s, c) = (k as f64 * std::f64::consts::TAU / 20_000.0).sin_cos();
                    let n = [c, s, 0.0];
                    let low = there.iter().map(|&p| dot(n, p)).fold(f64::INFINITY, f64::min);
                    low - here.iter().map(|&p| dot(n, p)).fold(f64::NEG_INFINITY, f64::max)
                };
                let best = (0..20_000).map(along).fold(f64::NEG_INFINITY, f64::max);
                (Shape::Polygon(other), best)
            }
        };
        let swapped = round % 2 == 1;
        let other = body(other).turned(second).at(at);
        let (p, q) = if swapped { (other, polygon_body) } else { (polygon_body, other) };
        world.add(p);
        world.add(q);
        let found = contacts(&world);
        let least = found.iter().map(|n| n.place.gap).fold(f64::INFINITY, f64::min);
        // A capsule whose line crosses a polygon is deeper than its distance says.
        if gap > MARGIN || (round % 3 == 1 && gap < -0.099) {
            continue;
        }
        let Some(one) = found.first() else {
            // Corners that pass each other have no side between them.
            assert!(round % 3 == 2 && gap > 0.0, "{round} {gap}");
            continue;
        };
        touching += 1;
        deep += usize::from(gap < -0.01);
        assert!((least - gap).abs() < 2e-3, "{round} {least} {gap}");
        assert!(found.len() <= 2);
        let n = one.place.normal;
        assert!((norm(n) - 1.0).abs() < 1e-12 && n[2] == 0.0);
        let apart = sub(world.bodies[1].position, world.bodies[0].position);
        assert!(gap < 0.0 || dot(n, apart) > 0.0, "{round}");
    }
    assert!(touching > 250 && deep > 100, "{touching} {deep}");
}

#[test]
fn sides_of_the_plane_that_lie_on_each_other_touch_at_two_points() {
    let rectangle = |a, b| solid(crate::Polygon::rectangle([a, b]).unwrap());
    let stadium = || solid(Shape::Stadium { half_length: 0.3, radius: 0.1 });
    let flat = |a: Body, b: Body| {
        let mut world = World::in_plane([0.0, -1.0]);
        world.add(a);
        world.add(b);
        contacts(&world)
    };
    let table = || rectangle(0.5, 0.1);
    for (other, x, ends) in [
        (rectangle(0.2, 0.1), 0.1, [-0.1, 0.3]),
        // Beyond the table's end.
        (rectangle(0.2, 0.1), 0.4, [0.2, 0.5]),
        (rectangle(0.5, 0.1), 0.0, [-0.5, 0.5]),
        (stadium(), 0.1, [-0.2, 0.4]),
        (stadium(), 0.4, [0.1, 0.5]),
    ] {
        for gap in [0.01, 0.0, -0.003] {
            let mut found = flat(table(), other.clone().at([x, 0.2 + gap, 0.0]));
            found.sort_by(|p, q| p.place.point[0].total_cmp(&q.place.point[0]));
            assert_eq!(found.len(), 2, "{x} {gap} {found:?}");
            for (near, end) in found.iter().zip(ends) {
                assert!((near.place.point[0] - end).abs() < 1e-12, "{near:?}");
                assert!((near.place.gap - gap).abs() < 1e-12);
                assert!(norm(sub(near.place.normal, [0.0, 1.0, 0.0])) < 1e-15);
            }
        }
    }
    // A rounded end beside a corner meets it along the line between them.
    let end = flat(table(), stadium().at([0.83, 0.14, 0.0]));
    let n = normalise([0.03, 0.04, 0.0]);
    assert_eq!(end.len(), 1);
    assert!((end[0].place.gap + 0.05).abs() < 1e-12, "{end:?}");
    assert!(norm(sub(end[0].place.normal, n)) < 1e-12);
}

#[test]
fn a_mesh_on_a_mesh_touches_as_polyhedra_do() {
    let mut rng = Pcg64::seed_from_u64(23);
    let (half, other) = ([0.5, 0.4, 0.3], [0.3, 0.4, 0.2]);
    let (mut touching, mut same) = (0, 0);
    for round in 0..2500 {
        let far = rng.random_range(0.4..0.9);
        let there = scale(far, normalise(vector(&mut rng, 1.0)));
        let (first, second) = (rotation(&mut rng), rotation(&mut rng));
        let boxes =
            contacts(&two(cuboid(half).turned(first), cuboid(other).turned(second).at(there)));
        let meshes = contacts(&two(
            solid(crate_mesh(half)).turned(first),
            solid(crate_mesh(other)).turned(second).at(there),
        ));
        let least = |list: &[Near]| list.iter().map(|n| n.place.gap).fold(f64::INFINITY, f64::min);
        let (p, q) = (least(&boxes), least(&meshes));
        // The larger gaps are between features that do not face each other, which both pass by in ways of their own.
        if !(-0.03..0.0).contains(&p) {
            continue;
        }
        touching += 1;
        assert!(!meshes.is_empty(), "{round} {boxes:#?}");
        same += usize::from((p - q).abs() < 1e-6);
    }
    assert!(touching > 50 && 10 * same > 8 * touching, "{same} of {touching}");
}

#[test]
fn edges_of_meshes_that_nearly_lie_on_faces_are_met() {
    let (half, other) = ([0.5, 0.4, 0.3], [0.3, 0.2, 0.2]);
    let mut seen = 0;
    for angle in [0.005, 0.015, 0.03, 0.045, 0.06, 0.1] {
        // Its edge is inclined to the lower top, and the edge of that to its bottom; on the other side it is just above the top.
        let lean = Rotation::about([0.0, 1.0, 0.0], angle);
        let turned = Rotation::about([1.0, 0.0, 0.0], angle).after(lean);
        let at = |z: f64| [0.4, 0.0, z];
        let pair = |z: f64| {
            let boxes = two(cuboid(half), cuboid(other).turned(turned).at(at(z)));
            let mesh = |half| solid(crate_mesh(half));
            (boxes, two(mesh(half), mesh(other).turned(turned).at(at(z))))
        };
        for depth in [-0.002, 0.0002, 0.002, 0.004] {
            let gap = |z: f64| gaps(&pair(z).0)[0];
            let z = (0..3).fold(0.5 + angle * 0.3, |z, _| z - gap(z) - depth);
            let (boxes, meshes) = pair(z);
            let [p, q] = [boxes, meshes].map(|world| gaps(&world)[0]);
            assert!((p - q).abs() < 1e-6, "{angle} {depth} {p} {q}");
            seen += 1;
        }
    }
    assert_eq!(seen, 24);
}

#[test]
fn meshes_that_lie_on_each_other_touch_at_their_corners() {
    let mesh = |half| solid(crate_mesh(half));
    for gap in [0.01, 0.0, -0.002] {
        for turn in [0.0, 0.3] {
            let turned = Rotation::about([0.0, 0.0, 1.0], turn);
            let there = |body: Body| body.turned(turned).at([0.1, 0.05, 0.5 + gap]);
            let boxes = contacts(&two(cuboid([0.5, 0.4, 0.3]), there(cuboid([0.3, 0.2, 0.2]))));
            let meshes = contacts(&two(mesh([0.5, 0.4, 0.3]), there(mesh([0.3, 0.2, 0.2]))));
            assert_eq!(meshes.len(), boxes.len(), "{gap} {turn} {meshes:#?}");
            for near in &boxes {
                let p = near.place;
                let at = |n: &&Near| norm(sub(n.place.point, p.point)) < 1e-9;
                let q = meshes.iter().find(at).expect("the same point").place;
                assert!((p.gap - q.gap).abs() < 1e-12 && norm(sub(p.normal, q.normal)) < 1e-12);
            }
        }
    }
    // On a field of 200 triangles as on a plane; a face that hangs over an edge and faces that cross.
    let field = contacts(&two(grid(11, |_, _| 0.0), mesh([0.7, 0.5, 0.3]).at([0.13, 0.2, 0.3])));
    assert_eq!(field.len(), 4, "{field:#?}");
    let over = contacts(&two(mesh([0.5, 0.4, 0.3]), mesh([0.5, 0.2, 0.2]).at([0.4, 0.0, 0.4999])));
    assert_eq!(over.len(), 4, "{over:#?}");
    assert!(over.iter().all(|n| norm(sub(n.place.normal, [0.0, 0.0, 1.0])) < 1e-12));
}

#[test]
fn sheets_do_not_meet_surfaces() {
    let half = [0.5; 3];
    let p = Polyhedron::cuboid(half).unwrap();
    let lid =
        crate::Mesh::new(p.vertices(), &[[p.faces()[0][0], p.faces()[0][1], p.faces()[0][2]]]);
    let sheet = Body::with_mass(
        1.0,
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        vec![Part::new(lid.unwrap())],
    );
    let error = Detector::new(&two(grid(3, |_, _| 0.0), sheet)).err().unwrap().to_string();
    let says = "bodies[0].parts[0] and bodies[1].parts[0]: contact between a mesh and a mesh that is not closed is not supported";
    assert_eq!(error, says);
}

#[test]
fn any_number_of_threads_finds_the_same() {
    let mut rng = Pcg64::seed_from_u64(11);
    let mut world = World::default();
    world.add(Body::floor());
    for k in 0..500 {
        let at = [k % 10, k / 10 % 10, k / 100].map(|i| 0.35 * f64::from(i) + 0.2);
        let body = match k % 4 {
            0 => solid(Shape::Sphere { radius: 0.2 }),
            1 => cuboid([0.2, 0.15, 0.25]),
            2 => solid(Shape::Capsule { half_length: 0.1, radius: 0.15 }),
            _ => solid(Shape::Cylinder { half_length: 0.2, radius: 0.15 }),
        };
        world.add(body.at(at).turned(rotation(&mut rng)));
    }
    let margins = vec![MARGIN; world.bodies.len()];
    let found = |threads: usize| {
        let (crew, mut detector) = (Crew::new(threads), Detector::new(&world).unwrap());
        let (mut state, mut out) = (State::of(&world), vec![]);
        // The second time with the axes of the first, and another place for a body.
        for _ in 0..2 {
            detector.detect(&world, &mut state, &margins, &crew, (&mut out, &mut vec![]));
            state.position[7][2] += 0.01;
        }
        assert!(out.is_sorted_by_key(|near| near.key) && out.len() > 2000, "{}", out.len());
        (out, state)
    };
    let alone = found(1);
    assert!(alone == found(2) && alone == found(3));
}

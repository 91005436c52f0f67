//! Closed meshes on closed meshes and on fields of triangles.

use std::collections::BTreeSet;
use std::f64::consts::TAU;

use nonsmooth_scenes::{Polyhedron, Rotation};
use nonsmooth_simulate::{Body, BodyId, Mesh, Motion, Simulation, World};

use crate::verification::{G, ball, block, near, run, simulation, v, weightless, world, x};

/// A closed mesh of 1000 kg/m³.
fn solid(mesh: Mesh) -> Body {
    Body::solid(mesh, 1000.0).unwrap()
}

fn of(p: &Polyhedron) -> Mesh {
    cut(p, 0)
}

/// With the second face cut into triangles from its corner k.
fn cut(p: &Polyhedron, k: usize) -> Mesh {
    let mut faces = p.faces().to_vec();
    faces[1].rotate_left(k);
    let fan = |f: &Vec<usize>| -> Vec<[usize; 3]> {
        (1..f.len() - 1).map(|k| [f[0], f[k], f[k + 1]]).collect()
    };
    let triangles: Vec<[usize; 3]> = faces.iter().flat_map(fan).collect();
    Mesh::new(p.vertices(), &triangles).unwrap()
}

fn crate_of(half: [f64; 3]) -> Mesh {
    of(&Polyhedron::cuboid(half).unwrap())
}

/// A ring about the third axis, of `n` by `m` facets, flat lines on top.
fn torus(around: f64, tube: f64, (n, m): (usize, usize)) -> Mesh {
    let point = |i: usize, j: usize| {
        let (s, c) = (TAU * i as f64 / n as f64).sin_cos();
        let (z, y) = (TAU * j as f64 / m as f64).sin_cos();
        let r = around + tube * y;
        [r * c, r * s, tube * z]
    };
    let vertices: Vec<_> = (0..n * m).map(|k| point(k / m, k % m)).collect();
    let at = |i: usize, j: usize| (i % n) * m + j % m;
    let cell = |k: usize| {
        let (i, j) = (k / m, k % m);
        let [p, q, r, s] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        [[p, q, r], [p, r, s]]
    };
    let triangles: Vec<_> = (0..n * m).flat_map(cell).collect();
    Mesh::new(&vertices, &triangles).unwrap()
}

/// An L along the second axis, its foot from x = 0 to 2, its back from z = 0 to 2, both 1 thick.
fn angle_iron() -> Mesh {
    let outline = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]]
        .map(|[x, z]| (x, z));
    let vertices: Vec<[f64; 3]> =
        [0.0, 2.0].iter().flat_map(|&y| outline.map(|(x, z)| [x, y, z])).collect();
    let mut triangles = vec![];
    for [a, b, c] in [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]] {
        triangles.extend([[a, b, c], [6 + a, 6 + c, 6 + b]]);
    }
    for k in 0..6 {
        let l = (k + 1) % 6;
        triangles.extend([[k, 6 + k, 6 + l], [k, 6 + l, l]]);
    }
    Mesh::new(&vertices, &triangles).unwrap()
}

/// The sum of the normal impulses between two bodies over the weight of m in a step of h.
fn carried(s: &Simulation, a: BodyId, b: BodyId, m: f64, h: f64) -> f64 {
    let of = s.contacts().iter().filter(|c| (c.a, c.b) == (a, b));
    of.map(|c| c.impulse[0] * c.frame[0][2]).sum::<f64>() / (h * G * m)
}

/// Which features touch, of contacts that carry.
fn keys(s: &Simulation) -> BTreeSet<[u32; 4]> {
    let active = s.contacts().iter().filter(|c| c.active);
    active.map(|c| [c.key.shape_a, c.key.shape_b, c.key.feature_a, c.key.feature_b]).collect()
}

/// Crates with flush sides that fall on each other in coarse steps, and end far deeper in each other than triangles are looked for at rest; top and bottom have the same diagonals, or others.
#[test]
fn what_has_sunk_in_an_impact_is_met_again() {
    for (h, drops) in [(2e-3, [1.3, 1.6, 2.0]), (5e-3, [0.2, 0.5, 1.1])] {
        for (drop, off, upper) in drops
            .into_iter()
            .flat_map(|d| [(d, 0.0, [0.2; 3]), (d, 0.02, [0.2; 3]), (d, 0.0, [0.1, 0.2, 0.2])])
        {
            let end = |shape: &dyn Fn([f64; 3]) -> Body| {
                let mut world = world(0.5, 0.0);
                world.add(Body::floor());
                world.add(shape([0.2; 3]).at([0.0, 0.0, 0.2]));
                let top = world.add(shape(upper).at([off, 0.0, 0.6 + drop]));
                let mut simulation = simulation(world);
                run(&mut simulation, 1.2, h);
                x(&simulation, top)[2]
            };
            let as_box = end(&block);
            for k in 0..2 {
                let mesh = end(&|half| solid(cut(&Polyhedron::cuboid(half).unwrap(), k)));
                assert!((mesh - as_box).abs() < 0.01, "{h} {drop} {off} {k}: {mesh} {as_box}");
            }
        }
    }
}

/// Overlaps up to a quarter of the thinner body are seen before the first step, and refused.
#[test]
fn crates_that_overlap_are_refused() {
    for depth in [0.002, 0.0079, 0.0081, 0.02, 0.04, 0.09] {
        for off in [0.0, 0.03] {
            let mut world = world(0.5, 0.0);
            world.add(solid(crate_of([0.2; 3])).at([0.0, 0.0, 0.2]));
            world.add(solid(crate_of([0.2; 3])).at([off, 0.0, 0.6 - depth]));
            let found = Simulation::new(world, Default::default());
            assert!(found.is_err(), "{depth} {off}");
        }
    }
}

/// A crate at 10 m/s towards a ball at rest is met in the step in which its forecast closes the gap, as a box is.
#[test]
fn a_mesh_that_moves_is_met_in_time() {
    let (h, speed) = (1e-3, 10.0);
    for driven in [false, true] {
        for gap in [1e-3, 3e-3, 4.5e-3, 7e-3, 9.5e-3, 12e-3] {
            let gaps = |crate_: Body| {
                let mut world = weightless(0.0, 0.0);
                let ball = world.add(ball(0.25));
                let mut body = crate_.at([0.45 + gap, 0.0, 0.0]);
                match driven {
                    true => body.motion = Motion::Uniform { velocity: [-speed, 0.0, 0.0] },
                    false => body = body.moving([-speed, 0.0, 0.0], [0.0; 3]),
                }
                let body = world.add(body);
                let mut simulation = simulation(world);
                let mut all = vec![];
                for _ in 0..5 {
                    simulation.step(h).unwrap();
                    all.push(x(&simulation, body)[0] - x(&simulation, ball)[0]);
                }
                all
            };
            let (mesh, as_box) = (gaps(solid(crate_of([0.2; 3]))), gaps(block([0.2; 3])));
            mesh.iter().zip(&as_box).for_each(|(a, b)| near(*a, *b, 1e-9));
        }
    }
}

#[test]
fn a_crate_on_a_crate_rests_as_a_box_on_a_box() {
    let (half, h) = ([0.5, 0.4, 0.3], 2e-3);
    let turn = Rotation::about([0.0, 0.0, 1.0], 0.2);
    let pile = |body: &dyn Fn() -> Body| {
        let mut world = world(0.5, 0.0);
        world.add(Body::floor());
        let low = world.add(body().at([0.0, 0.0, half[2]]));
        let high = world.add(body().at([0.1, 0.05, 3.0 * half[2] + 0.01]).turned(turn));
        (simulation(world), low, high)
    };
    let (mut meshes, low, high) = pile(&|| solid(crate_of(half)));
    let (mut boxes, ..) =
        pile(&|| Body::solid(nonsmooth_simulate::Shape::Box { half }, 1000.0).unwrap());
    run(&mut meshes, 0.3, h);
    run(&mut boxes, 0.3, h);
    for k in 0..3 {
        near(x(&meshes, high)[k], x(&boxes, high)[k], 1e-9);
        near(v(&meshes, high)[k], 0.0, 1e-9);
    }
    assert_eq!(meshes.contacts().len(), boxes.contacts().len());
    let mass = meshes.world().bodies[high.index()].mass;
    near(carried(&meshes, low, high, mass, h), 1.0, 1e-9);
    let before = keys(&meshes);
    run(&mut meshes, 0.5, h);
    assert_eq!(before, keys(&meshes));
}

#[test]
fn a_ring_on_a_ring_stands_on_edges_that_cross() {
    let (around, tube, h) = (1.0, 0.3, 2e-3);
    let mesh = || solid(torus(around, tube, (24, 12)));
    let mut world = world(0.5, 0.0);
    world.add(Body::floor());
    let low = world.add(mesh().at([0.0, 0.0, tube]));
    let turn = Rotation::about([0.0, 0.0, 1.0], 0.5 * TAU / 24.0);
    let high = world.add(mesh().at([0.0, 0.0, 3.0 * tube]).turned(turn));
    let mut s = simulation(world);
    let mass = s.world().bodies[high.index()].mass;
    // Of facets inside the torus 2 π² R r².
    let whole = 2.0 * (0.5 * TAU).powi(2) * around * tube * tube * 1000.0;
    assert!(mass < whole && mass > 0.9 * whole, "{mass} {whole}");
    run(&mut s, 0.2, h);
    near(x(&s, high)[2], 3.0 * tube, 1e-6);
    near(x(&s, high)[0].hypot(x(&s, high)[1]), 0.0, 1e-6);
    near(carried(&s, low, high, mass, h), 1.0, 1e-8);
    let touching = s.contacts().iter().filter(|c| (c.a, c.b) == (low, high) && c.active);
    for c in touching {
        near(c.frame[0][2], 1.0, 1e-6);
    }
    let before = keys(&s);
    run(&mut s, 0.3, h);
    assert_eq!(before, keys(&s));
}

#[test]
fn a_ring_lies_on_a_crate_and_on_a_field() {
    let h = 2e-3;
    let heights = vec![vec![0.2; 9]; 9];
    let bases: [Body; 2] = [
        Body::fixed(vec![nonsmooth_simulate::Part::new(crate_of([2.0, 2.0, 0.2]))]),
        Body::fixed(vec![nonsmooth_simulate::Part::new(
            Mesh::heightfield(&heights, [4.0, 4.0]).unwrap(),
        )]),
    ];
    for base in bases {
        let mut world = world(0.4, 0.0);
        let ground = world.add(base);
        let start = [0.13, -0.21, 0.2 + 0.3 + 0.01];
        let ring = world.add(solid(torus(1.0, 0.3, (24, 12))).at(start));
        let mut s = simulation(world);
        run(&mut s, 0.3, h);
        // It stops within half of what it falls in a step.
        let depth = x(&s, ring)[2] - 0.5;
        assert!(depth.abs() < h * (2.0 * G * 0.01).sqrt(), "{depth}");
        let mass = s.world().bodies[ring.index()].mass;
        near(carried(&s, ground, ring, mass, h), 1.0, 1e-9);
        let active = s.contacts().iter().filter(|c| c.active).count();
        assert_eq!(active, 24);
    }
}

#[test]
fn an_angle_iron_rests_in_another_one_and_does_not_leave_its_corner() {
    // The upper one is turned upside down and hangs with its back in the corner of the lower one: a foot on a back, a back on a foot.
    let h = 2e-3;
    let mut world: World = world(0.3, 0.0);
    world.add(Body::floor());
    let low = solid(angle_iron());
    let centre = low.position;
    let low = world.add(low);
    let turn = Rotation::about([0.0, 1.0, 0.0], 0.5 * TAU);
    let [cx, cy, cz] = centre;
    let at = [2.0 - cx + 5e-4, cy + 0.1, 3.0 - cz];
    let high = world.add(solid(angle_iron()).at(at).turned(turn));
    let mut s = simulation(world);
    let start = x(&s, high);
    run(&mut s, 0.3, h);
    for k in 0..3 {
        near(x(&s, high)[k], start[k], 1e-4);
    }
    let mass = s.world().bodies[high.index()].mass;
    near(carried(&s, low, high, mass, h), 1.0, 1e-8);
}

#[test]
fn a_crate_slides_over_a_crate_without_stumbling() {
    // Over the diagonals of twelve triangles: it stops after v²/(2 mu g).
    let mut world = world(0.5, 0.0);
    let table = nonsmooth_simulate::Part::new(crate_of([3.0, 1.0, 0.2]));
    world.add(Body::fixed(vec![table]).at([0.0, 0.0, -0.2]));
    let half = [0.2, 0.15, 0.1];
    let b = solid(crate_of(half)).at([-1.0, 0.1, half[2]]).moving([3.0, 0.0, 0.0], [0.0; 3]);
    let b = world.add(b);
    let mut s = simulation(world);
    run(&mut s, 1.0, 1e-3);
    near(x(&s, b)[0], -1.0 + 9.0 / (2.0 * 0.5 * G), 1e-6);
    near(x(&s, b)[1], 0.1, 1e-9);
    near(x(&s, b)[2], half[2], 1e-9);
}

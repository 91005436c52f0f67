//! Flat ground of triangles is met as a plane is, and a ball at the rim of a cone as at any other corner.

use nonsmooth_scenes::{ElasticBox, Material, Polyhedron, Rotation};
use nonsmooth_simulate::{Body, Elastic, Mesh, MoreauJean, Part, Shape, Simulation};

use crate::verification::{run, simulation, v, weightless, world, x};

fn crate_of(half: [f64; 3]) -> Mesh {
    let p = Polyhedron::cuboid(half).unwrap();
    let fan = |f: &Vec<usize>| [[f[0], f[1], f[2]], [f[0], f[2], f[3]]];
    let triangles: Vec<[usize; 3]> = p.faces().iter().flat_map(fan).collect();
    Mesh::new(p.vertices(), &triangles).unwrap()
}

/// A sheet of two triangles, a closed mesh of twelve, fields with edges of 2 m and of 0.1 m, all with their top at z = 0.
fn flat() -> Vec<Body> {
    let corners = [[-2.0, -2.0, 0.0], [2.0, -2.0, 0.0], [2.0, 2.0, 0.0], [-2.0, 2.0, 0.0]];
    let fixed = |mesh: Mesh| Body::fixed(vec![Part::new(mesh)]);
    let field = |n: usize| Mesh::heightfield(&vec![vec![0.0; n]; n], [4.0, 4.0]).unwrap();
    vec![
        fixed(Mesh::new(&corners, &[[0, 1, 2], [0, 2, 3]]).unwrap()),
        fixed(crate_of([2.0, 2.0, 0.5])).at([0.0, 0.0, -0.5]),
        fixed(field(3)),
        fixed(field(41)),
    ]
}

/// How deep it is at most while it falls on the ground, leaning by an angle, and comes to rest.
fn deepest(ground: Body, body: Body) -> f64 {
    let mut world = world(0.5, 0.0);
    world.add(ground);
    world.add(body);
    let mut s = simulation(world);
    let mut deepest = 0.0;
    for _ in 0..400 {
        deepest = f64::max(deepest, s.step(1e-3).unwrap().drift.penetration);
    }
    deepest
}

#[test]
fn what_falls_on_triangles_is_no_deeper_than_on_a_plane() {
    let solid = |shape: Shape| Body::solid(shape, 1000.0).unwrap();
    let bodies = [
        solid(Shape::Sphere { radius: 0.1 }),
        solid(Shape::Box { half: [0.1; 3] }),
        solid(Shape::Capsule { half_length: 0.05, radius: 0.05 }),
        solid(crate_of([0.1; 3]).into()),
        solid(Shape::Cylinder { half_length: 0.01, radius: 0.1 }),
        solid(Shape::Cone { half_length: 0.1, radius: 0.1 }),
    ];
    for (k, body) in bodies.into_iter().enumerate() {
        for angle in [0.1, 0.02] {
            let turn = Rotation::about([1.0, 0.4, 0.0], angle);
            let body = body.clone().turned(turn).at([0.013, -0.021, 0.2]);
            let on_plane = deepest(Body::floor(), body.clone());
            for (j, ground) in flat().into_iter().enumerate() {
                if k == 3 && j == 0 {
                    continue; // A sheet does not meet meshes.
                }
                let on_mesh = deepest(ground, body.clone());
                assert!(on_mesh <= 1.2 * on_plane, "{k} {j} {angle}: {on_mesh} {on_plane}");
            }
        }
    }
}

/// Smaller than the way of a step, so that they end behind the triangles as a whole.
#[test]
fn what_is_smaller_than_its_way_does_not_fall_through_solid_ground() {
    let solid = |shape: Shape| Body::solid(shape, 1000.0).unwrap();
    let bodies = [
        solid(Shape::Sphere { radius: 1e-3 }),
        solid(Shape::Box { half: [2e-3; 3] }),
        solid(Shape::Box { half: [2e-2, 2e-2, 1.5e-3] }),
        solid(Shape::Cylinder { half_length: 2e-3, radius: 2e-3 }),
        solid(Shape::Cone { half_length: 2e-3, radius: 2e-3 }),
        solid(Shape::Capsule { half_length: 2e-3, radius: 1e-3 }),
    ];
    let (h, fast) = (1e-3, 5.0);
    for (k, body) in bodies.into_iter().enumerate() {
        for start in 0..6 {
            let at = [0.013, -0.021, 0.03 + 0.0011 * f64::from(start)];
            let turn = Rotation::about([1.0, 0.4, 0.0], 0.3);
            let body = body.clone().turned(turn).at(at).moving([0.0, 0.0, -fast], [0.0; 3]);
            for (j, ground) in flat().into_iter().enumerate().skip(1) {
                let mut world = world(0.5, 0.0);
                world.add(ground);
                let body = world.add(body.clone());
                let mut s = simulation(world);
                run(&mut s, 0.3, h);
                let [_, _, z] = x(&s, body);
                assert!(z > -1.1 * h * fast, "{k} {start} {j}: {z}");
            }
        }
    }
}

#[test]
fn elastic_boxes_stand_on_solid_triangles_and_sheets_are_refused() {
    let block = || {
        let material =
            Material { density: 1000.0, young: 1e6, poisson: 0.3, alpha: 0.0, beta: 0.0 };
        let mut solid = ElasticBox::new([0.2; 3], [2; 3], material).unwrap();
        solid.position = [0.013, -0.021, 0.1];
        solid.lumped = true;
        Elastic::new(solid)
    };
    for (j, ground) in flat().into_iter().enumerate() {
        let mut world = world(0.5, 0.0);
        world.add(ground);
        world.add_elastic(block());
        if j == 0 {
            let error = Simulation::new(world, MoreauJean::default()).err().unwrap().to_string();
            let expected = "contact between a mesh that is not closed and a box that is elastic";
            assert!(error.contains(expected), "{error}");
            continue;
        }
        let mut s = simulation(world);
        let mut deepest = 0.0;
        for _ in 0..300 {
            deepest = f64::max(deepest, s.step(1e-3).unwrap().drift.penetration);
        }
        assert!(deepest < 1e-4, "{j}: {deepest}");
        let moved = s.state().elastic[0].displacement.iter();
        let fallen = moved.fold(0.0, |d, x| f64::min(d, x[2]));
        assert!(fallen > -1e-2, "{j}: {fallen}");
    }
}

#[test]
fn a_ball_stops_at_the_rim_of_a_cone() {
    // Without friction and rebound what it keeps is the velocity along the plane that touches both.
    let (radius, h) = (0.1, 1e-3);
    for z in [-0.06, -0.08, -0.09, -0.099, -0.1, -0.101, -0.12] {
        let mut world = weightless(0.0, 0.0);
        world.add(Body::fixed(vec![Part::new(Shape::Cone { half_length: 0.1, radius: 0.1 })]));
        let ball = Body::solid(Shape::Sphere { radius }, 1000.0).unwrap();
        let ball = world.add(ball.at([0.3, 0.0, z]).moving([-1.0, 0.0, 0.0], [0.0; 3]));
        let mut s = simulation(world);
        let mut deepest = 0.0;
        for _ in 0..150 {
            deepest = f64::max(deepest, s.step(h).unwrap().drift.penetration);
        }
        assert!(deepest <= 1.01 * h, "{z} {deepest}");
        run(&mut s, 0.3, h);
        let [px, _, pz] = x(&s, ball);
        let [vx, _, vz] = v(&s, ball);
        // It leaves the rim upwards along the mantle, or goes below the base.
        assert!(vx.hypot(vz) <= 1.0 + 1e-12, "{z} {vx} {vz}");
        let above = (px - 0.1) * 2.0 + (pz + 0.1);
        assert!(above > 0.0 || pz < -0.1, "{z} {px} {pz}");
    }
}

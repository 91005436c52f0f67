//! Cylinders, cones and triangulated ground: rolling on rims and mantles, standing and tipping, sliding over edges that are none.

use nonsmooth_simulate::scene_file::SceneFile;
use nonsmooth_simulate::{
    Body, BodyId, Control, Mesh, MoreauJean, Part, RunReport, Shape, Simulation, StepReport,
};

use crate::verification::{G, block, check, near, omega, run, simulation, v, world, x};

fn cylinder(half_length: f64, radius: f64) -> Body {
    let density = 1.0 / (2.0 * std::f64::consts::PI * half_length * radius * radius);
    Body::solid(Shape::Cylinder { half_length, radius }, density).unwrap()
}

fn turned(body: Body, axis: [f64; 3], angle: f64) -> Body {
    body.turned(nonsmooth_scenes::Rotation::about(axis, angle))
}

/// The height of `f` over a square of side 8 with n × n knots.
fn field(n: usize, f: impl Fn(f64, f64) -> f64) -> Body {
    let at = |k: usize| 8.0 * (k as f64 / (n - 1) as f64 - 0.5);
    let row = |i: usize| (0..n).map(|j| f(at(j), at(i))).collect();
    let heights: Vec<Vec<f64>> = (0..n).map(row).collect();
    Body::fixed(vec![Part::new(Mesh::heightfield(&heights, [8.0, 8.0]).unwrap())])
}

#[test]
fn a_disc_rolls_steadily_on_its_rim() {
    // The centre rests, the point of contact runs round with Ω² = 4 g / (a sin α).
    let a = 0.1;
    for (degrees, expected) in [(10.0, 47.536738819), (30.0, 28.014282072), (60.0, 21.286251226)] {
        let (s, c) = f64::sin_cos(f64::to_radians(degrees));
        let rate = (4.0 * G / (a * s)).sqrt();
        near(rate, expected, 1e-9);
        let thin = 1e-6;
        let mut world = world(1.0, 0.0);
        world.add(Body::floor());
        // A flat disc: J = m a² (1/4, 1/4, 1/2). The axis leans towards x, the point of contact is at +x.
        let j = a * a;
        let inertia = [[j / 4.0, 0.0, 0.0], [0.0, j / 4.0, 0.0], [0.0, 0.0, j / 2.0]];
        let disc = Part::new(Shape::Cylinder { half_length: thin, radius: a });
        let disc = turned(
            Body::with_mass(1.0, inertia, vec![disc]),
            [0.0, 1.0, 0.0],
            f64::to_radians(degrees),
        );
        let spin = [-rate * s * c, 0.0, rate * s * s];
        let height = a * s + thin * c;
        let disc = world.add(disc.at([0.0, 0.0, height]).moving([0.0; 3], spin));
        let mut simulation = simulation(world);
        let (mut most, mut moved): (f64, f64) = (0.0, 0.0);
        let mut watch = |s: &Simulation, _: &StepReport| {
            let [px, py, pz] = x(s, disc);
            (most, moved) = (most.max((pz - height).abs()), moved.max(px.hypot(py)));
            Control::Continue
        };
        let report: RunReport = simulation.run(0.5, 2e-4, &mut watch).unwrap();
        check(&report);
        assert!(most < 3e-5 * a && moved < 3e-5 * a, "{degrees} {most} {moved}");
        // Two turns and more of the point of contact.
        assert!(rate * 0.5 > 2.0 * std::f64::consts::TAU * 0.8);
        let fall = 0.5 * v(&simulation, disc).iter().map(|v| v * v).sum::<f64>();
        let energy =
            kinetic(&simulation, disc, j) + fall + G * (x(&simulation, disc)[2] - thin * c);
        near(energy / (1.5 * G * a * s), 1.0, 5e-5);
    }
}

/// The energy of rotation of a flat disc of 1 kg with m a² = j.
fn kinetic(simulation: &Simulation, disc: BodyId, j: f64) -> f64 {
    let [p, q, r] = simulation.state().spin[disc.index()];
    0.5 * j * (p * p / 4.0 + q * q / 4.0 + r * r / 2.0)
}

#[test]
fn a_cylinder_rolls_down_an_incline() {
    // a = (2/3) g sin α, on a plane and on triangles.
    let alpha: f64 = 0.2;
    let (s, c) = alpha.sin_cos();
    for triangles in [false, true] {
        let mut world = world(0.6, 0.0);
        world.gravity = [G * s, 0.0, -G * c];
        world.add(if triangles { field(21, |_, _| 0.0) } else { Body::floor() });
        let (r, half) = (0.1, 0.3);
        // Its axis along y.
        let roller = turned(cylinder(half, r), [1.0, 0.0, 0.0], std::f64::consts::FRAC_PI_2);
        let roller = world.add(roller.at([-2.0, 0.1, r]));
        let mut simulation = simulation(world);
        run(&mut simulation, 1.0, 1e-3);
        near(v(&simulation, roller)[0], 2.0 / 3.0 * G * s, 1e-9);
        near(omega(&simulation, roller)[1], 2.0 / 3.0 * G * s / r, 1e-8);
        near(x(&simulation, roller)[2], r, 1e-9);
    }
}

#[test]
fn a_post_stands_until_its_weight_is_over_its_rim() {
    // Radius r, height 2 h: it tips where tan α > r/h, whichever way it leans.
    let (r, h): (f64, f64) = (0.1, 0.25);
    for (share, stands) in [(0.98, true), (1.02, false)] {
        for towards in [0.0_f64, 0.3, 0.39] {
            let alpha = (share * r / h).atan();
            let (s, c) = alpha.sin_cos();
            let mut world = world(1.0, 0.0);
            world.gravity = [G * s * towards.cos(), G * s * towards.sin(), -G * c];
            world.add(Body::floor());
            let post = world.add(cylinder(h, r).at([0.0, 0.0, h]));
            let mut simulation = simulation(world);
            let report = simulation.run(2.0, 2e-3, &mut ()).unwrap();
            assert!(report.is_solved(), "{report}");
            let [px, py, pz] = x(&simulation, post);
            let stood = px.hypot(py) < 1e-3 && (pz - h).abs() < 1e-3;
            assert_eq!(stood, stands, "{share} {towards} {:?}", x(&simulation, post));
        }
    }
}

#[test]
fn edges_between_triangles_of_a_plane_are_not_felt() {
    // A block that slides over 800 triangles stops where it would on a plane: v²/2 mu g.
    let (mu, speed) = (0.3, 2.0);
    let mut far = vec![];
    for triangles in [false, true] {
        let mut world = world(mu, 0.0);
        world.add(if triangles { field(21, |_, _| 0.0) } else { Body::floor() });
        let sliding = turned(block([0.3, 0.2, 0.1]), [0.0, 0.0, 1.0], 0.4);
        let sliding = world.add(sliding.at([-1.0, 0.05, 0.1]).moving([speed, 0.3, 0.0], [0.0; 3]));
        let mut simulation = simulation(world);
        run(&mut simulation, 1.0, 2e-3);
        far.push(x(&simulation, sliding));
    }
    for k in 0..3 {
        near(far[0][k], far[1][k], 1e-7);
    }
}

#[test]
fn a_ball_settles_at_the_bottom_of_a_bowl_of_triangles() {
    let mut world = world(0.4, 0.0);
    world.add(field(33, |x, y| 0.1 * (x * x + y * y)));
    let marble = world.add(crate::verification::ball(0.3).at([0.9, 0.0, 0.5]));
    let mut simulation = simulation(world);
    let report = simulation.run(3.0, 2e-3, &mut ()).unwrap();
    assert!(report.is_solved(), "{report}");
    let [px, py, pz] = x(&simulation, marble);
    assert!(px.hypot(py) < 0.95 && pz > 0.29 && pz < 0.5, "{:?}", x(&simulation, marble));
    // Half a step's fall at most: it hits with 2 m/s.
    assert!(report.penetration < 2.1e-3, "{report:?}");
}

#[test]
fn a_closed_mesh_falls_and_rests_as_the_box_that_it_is() {
    let half = [0.3, 0.2, 0.1];
    let p = nonsmooth_scenes::Polyhedron::cuboid(half).unwrap();
    let fan = |f: &Vec<usize>| [[f[0], f[1], f[2]], [f[0], f[2], f[3]]];
    let triangles: Vec<[usize; 3]> = p.faces().iter().flat_map(fan).collect();
    let mesh = Mesh::new(p.vertices(), &triangles).unwrap();
    let mut ends = vec![];
    for shape in [Shape::Box { half }, Shape::from(mesh)] {
        let mut world = world(0.5, 0.0);
        world.add(Body::floor());
        let body = world.add(Body::solid(shape, 1000.0).unwrap().at([0.0, 0.0, 0.11]));
        let mut simulation = Simulation::new(world, MoreauJean::default()).unwrap();
        run(&mut simulation, 0.3, 1e-3);
        ends.push(x(&simulation, body));
    }
    for k in 0..3 {
        near(ends[0][k], ends[1][k], 1e-9);
    }
    near(ends[1][2], 0.1, 5e-4);
}

#[test]
fn meshes_come_from_files_beside_the_scene() {
    let folder = std::env::temp_dir().join(format!("nonsmooth-mesh-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    // A tetrahedron of 1/6 of a cube with sides of 10 mm, in millimetres.
    let corners = [[0.0_f32; 3], [10.0, 0.0, 0.0], [0.0, 10.0, 0.0], [0.0, 0.0, 10.0]];
    let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let mut stl = vec![0_u8; 80];
    stl.extend((faces.len() as u32).to_le_bytes());
    for face in faces {
        stl.extend([0_u8; 12]);
        face.iter().flat_map(|&k| corners[k]).for_each(|x| stl.extend(x.to_le_bytes()));
        stl.extend([0_u8; 2]);
    }
    std::fs::write(folder.join("part.stl"), &stl).unwrap();
    std::fs::write(folder.join("cut.stl"), &stl[..150]).unwrap();
    let lines = corners.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n"));
    let numbered = faces.iter().map(|[a, b, c]| format!("f {} {} {}\n", a + 1, b + 1, c + 1));
    let obj: String = lines.chain(numbered).collect();
    std::fs::write(folder.join("part.obj"), obj).unwrap();
    std::fs::write(folder.join("part.txt"), "no mesh").unwrap();
    let scene = |file: &str, more: &str| {
        let text = format!(
            "format = \"nonsmooth-scene\"\nversion = 1\ntime = {{ h = 1e-3, end = 0.01 }}\npairs_default = {{}}\n\
             [[bodies]]\nname = \"part\"\nshape = {{ kind = \"mesh\", file = \"{file}\", scale = 1e-3 }}\n{more}\n"
        );
        SceneFile::parse(&text, &[]).unwrap()
    };
    for file in ["part.stl", "part.obj"] {
        let mut scene = scene(file, "density = 6000");
        let unread = scene.world().unwrap_err().to_string();
        assert!(unread.contains("bodies[0] (part).shape.file: expected a scene"), "{unread}");
        scene.load_meshes(&folder).unwrap();
        // Complete without its files.
        let again = SceneFile::parse(&scene.to_toml(), &[]).unwrap();
        assert_eq!(again, scene);
        let world = again.world().unwrap();
        near(world.bodies[0].mass, 6000.0 * 1e-6 / 6.0, 1e-12);
        again.build().unwrap();
    }
    for (file, says) in [
        ("gone.stl", "bodies[0].shape.file: expected a readable file, found `gone.stl`"),
        ("cut.stl", "too few for its triangles"),
        ("part.txt", "expected a mesh as .stl or .obj, found `part.txt`: a name that ends in .txt"),
    ] {
        let error = scene(file, "density = 1").load_meshes(&folder).unwrap_err().to_string();
        assert!(error.contains(says) && !error.contains('\n'), "{error}");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

/// Closed forms: m (3 r² + h²)/12 and m r²/2 of a cylinder; a cone's centre is a quarter of its height above its base, with 3 m (r² + h²/4)/20 and 3 m r²/10.
#[test]
fn round_solids_have_the_moments_of_the_tables() {
    let (r, half, density) = (0.3_f64, 0.4, 500.0);
    let h: f64 = 2.0 * half;
    let cylinder = Body::solid(Shape::Cylinder { half_length: half, radius: r }, density).unwrap();
    let m = std::f64::consts::PI * r * r * h * density;
    near(cylinder.mass, m, 1e-12 * m);
    let across = m * (3.0 * r * r + h * h) / 12.0;
    for (k, moment) in [across, across, 0.5 * m * r * r].into_iter().enumerate() {
        near(cylinder.inertia[k][k], moment, 1e-12 * m);
    }
    let cone = Body::solid(Shape::Cone { half_length: half, radius: r }, density).unwrap();
    near(cone.mass, m / 3.0, 1e-12 * m);
    near(cone.position[2], -half + h / 4.0, 1e-14);
    let across = 3.0 * (m / 3.0) * (r * r + 0.25 * h * h) / 20.0;
    for (k, moment) in [across, across, 0.3 * (m / 3.0) * r * r].into_iter().enumerate() {
        near(cone.inertia[k][k], moment, 1e-12 * m);
    }
}

//! A mechanics file of Siconos, made with h5py in its layout, becomes a scene that moves as it should.

use crate::common::{Folder, skipped};
use nonsmooth_io::trajectory::Trajectory;

/// Groups 0 (floor), 1 and 2; the ghosts of group 2 have no law with the floor. A door on a hinge with stops, a bead on a rod.
const MAKE: &str = r#"
import h5py, numpy as np, pickle, sys
with h5py.File(sys.argv[1], 'w') as f:
    f.attrs['dimension'] = 3
    data = f.create_group('data')
    ref, inp, laws, joints = (data.create_group(n) for n in ('ref', 'input', 'nslaws', 'joints'))
    def primitive(name, kind, *size):
        s = ref.create_dataset(name, (1, len(size)))
        s.attrs['id'] = len(ref); s.attrs['type'] = 'primitive'; s.attrs['primitive'] = kind
        s[:] = size
    primitive('Floor', 'Box', 20.0, 20.0, 1.0)
    primitive('Ball', 'Sphere', 0.5)
    primitive('Post', 'Cylinder', 0.25, 1.0)
    corners = np.array([[x, y, z] for x in (-.5, .5) for y in (-.5, .5) for z in (-.5, .5)])
    c = ref.create_dataset('Cube', corners.shape); c[:] = corners; c.attrs['type'] = 'convex'
    def thing(name, shape, place, mass=None, q=(1., 0., 0., 0.), v=np.zeros(6), group=0, inertia=None, at=(0., 0., 0.)):
        o = inp.create_group(name)
        if mass is not None:
            o.attrs['mass'] = mass
        o.attrs['type'] = 'static' if mass is None else 'dynamic'
        o.attrs['translation'] = place; o.attrs['orientation'] = q
        o.attrs['velocity'] = np.asarray(v, float); o.attrs['center_of_mass'] = np.zeros(3)
        if inertia is not None:
            o.attrs['inertia'] = inertia
        d = o.create_dataset(shape + '-0', (0, 0), maxshape=(None, 0))
        d.attrs['instance_name'] = shape + '-0'; d.attrs['shape_name'] = shape; d.attrs['group'] = group
        d.attrs['translation'] = at; d.attrs['orientation'] = [1., 0., 0., 0.]
        d.attrs['parameters'] = np.void(pickle.dumps({}))
        o.attrs['id'] = len(inp) if mass is not None else -len(inp)
    r = np.sqrt(0.5)
    thing('floor', 'Floor', [0., 0., -.5])
    # It slides with mu = 0.4 from 4 m/s.
    thing('cube', 'Cube', [0., 0., .5], 3.0, v=[4., 0, 0, 0, 0, 0], group=1)
    thing('ghost', 'Ball', [3., 3., 1.], 1.0, group=2)
    # Upright by a quarter turn about the first axis, which puts the second one up.
    thing('post', 'Post', [-3., 0., .5], 1.0, q=[r, r, 0., 0.], group=1)
    # Angular velocity in the frame of the body: its second axis is the world's third.
    thing('top', 'Ball', [-3., 3., .5], 1.0, q=[r, r, 0., 0.], v=[0, 0, 0, 0, 2., 0], group=1, inertia=np.diag([.1, .1, .1]))
    # On a hinge about the vertical through its edge, opened at 1 rad/s up to a stop.
    thing('door', 'Ball', [5., 0., 3.], 1.0, v=[0, -1., 0, 0, 0, -1.], group=2)
    thing('bead', 'Ball', [5., 5., 3.], 1.0, v=[0, 0, 1., 0, 0, 0], group=2)
    law = laws.create_dataset('floor and things', (0,))
    law.attrs['type'] = 'NewtonImpactFrictionNSL'; law.attrs['mu'] = .4; law.attrs['e'] = 0.
    law.attrs['gid1'] = 0; law.attrs['gid2'] = 1
    hard = laws.create_dataset('bounce', (0,))
    hard.attrs['type'] = 'NewtonImpactNSL'; hard.attrs['e'] = 1.; hard.attrs['gid1'] = 7; hard.attrs['gid2'] = 7
    dry = laws.create_dataset('dry', (0,))
    dry.attrs['type'] = 'RelayNSL'; dry.attrs['size'] = 1; dry.attrs['lb'] = -2.; dry.attrs['ub'] = 2.
    dry.attrs['gid1'] = 8; dry.attrs['gid2'] = 8
    def joint(name, kind, a, points=None, axes=None, **more):
        j = joints.create_dataset(name, (0,))
        j.attrs['object1'] = a; j.attrs['type'] = kind
        if points: j.attrs['points'] = points
        if axes: j.attrs['axes'] = axes
        for k, v in more.items(): j.attrs[k] = v
    # The world turns against the door by the angle that is stopped: upwards at 0.5.
    joint('hinge', 'PivotJointR', 'door', [[-1., 0., 0.]], [[0., 0., 1.]], absolute=False,
          stops=[[0, .5, -1], [0, -.1, 1]], nslaws=np.array('bounce', dtype='S'))
    joint('rod', 'PrismaticJointR', 'bead', None, [[0., 0., 1.]], absolute=True, friction=np.array(['dry'], dtype='S'))
    p = data.create_group('permanent_interactions'); p.create_dataset('held', (1,))
    data.create_dataset('solv', data=[[2e-3 * k, 1, 0, 0] for k in range(1, 501)])
"#;

#[test]
fn a_scene_of_siconos_moves_as_it_should() {
    let folder = Folder::new();
    let path = folder.path("scene.hdf5");
    let made = std::process::Command::new("python3").args(["-c", MAKE]).arg(&path).output();
    let Some(made) = made.ok().filter(|o| {
        o.status.success() || !String::from_utf8_lossy(&o.stderr).contains("ModuleNotFoundError")
    }) else {
        skipped("python3 with h5py is not here");
        return;
    };
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let run = folder.run("convert scene.hdf5 scene.toml");
    let said = &run.stderr;
    assert_eq!(run.code, Some(0), "{said}");
    for words in
        ["h = 0.002 and end = 1", "parameters of Cube-0", "permanent_interactions/held: left out"]
    {
        assert!(said.contains(words), "{words}: {said}");
    }
    let run = folder.run("simulate scene.toml --out run.h5");
    assert_eq!(run.code, Some(0), "{}{}", run.stdout, run.stderr);
    let run = Trajectory::read(folder.path("run.h5")).unwrap();
    let of = |name: &str| run.bodies.iter().position(|b| b.name == name).unwrap();
    let (start, end) = (&run.frames[0], run.frames.last().unwrap());
    let body = |name: &str| end.bodies[of(name)];
    let g = 9.80665;
    let near = |x: f64, y: f64| assert!((x - y).abs() < 1e-6, "{x} {y}");
    // It slides for 4 / (0.4 g) = 1.02 s: at 1 s still.
    near(body("cube").velocity[0], 4.0 - 0.4 * g);
    near(body("ghost").velocity[2], -g);
    near(body("post").position[2], 0.5);
    near(start.bodies[of("top")].angular_velocity[2], 2.0);
    // A bead on a vertical rod with 2 N of friction: up for 1 / (g + 2) s, then down.
    let up = 1.0 / (g + 2.0);
    assert!((body("bead").velocity[2] + (g - 2.0) * (1.0 - up)).abs() < 1e-2);
    // The door turns freely until the angle of the world against it is 0.5, then back.
    let hinge = run.joints.iter().position(|j| j == "hinge").unwrap();
    let angles: Vec<f64> = run.frames.iter().map(|f| f.joints[hinge].angle).collect();
    let most = angles.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let least = angles.iter().copied().fold(f64::INFINITY, f64::min);
    assert!((0.49..0.51).contains(&most) && least > -0.01, "{least} {most}");
    assert!(angles[angles.len() - 1].abs() < 0.01);

    // What cannot be is one line with its place.
    let deep = MAKE.replace("f.attrs['dimension'] = 3", "f.attrs['dimension'] = 4");
    let bad = MAKE.replace("'PrismaticJointR'", "'WheelJointR'");
    for (text, words) in [
        (deep, "dimension: expected 2 or 3, found 4"),
        (bad, "/data/joints/rod: expected PivotJointR, PrismaticJointR,"),
    ] {
        let made = std::process::Command::new("python3").args(["-c", &text]).arg(&path).output();
        assert!(made.unwrap().status.success());
        let run = folder.run("convert scene.hdf5 scene.toml");
        assert!(run.stderr.contains(words), "{}", run.stderr);
        run.exits(2);
    }
}

/// A floor, a disc that slides until it rolls, a box that slides, a triangle at rest, a rod that is thrown: places of two numbers, angles, rates of three.
const FLAT: &str = r#"
import h5py, numpy as np, pickle, sys
with h5py.File(sys.argv[1], 'w') as f:
    f.attrs['dimension'] = 2
    data = f.create_group('data')
    ref, inp, laws, joints = (data.create_group(n) for n in ('ref', 'input', 'nslaws', 'joints'))
    def shape(name, kind, numbers):
        numbers = np.array(numbers, float)
        s = ref.create_dataset(name, numbers.shape); s[:] = numbers
        s.attrs['type'] = 'convex' if kind == 'convex' else 'primitive'
        if kind != 'convex':
            s.attrs['primitive'] = kind
    shape('Floor', 'Box2d', [[40.0, 1.0]])
    shape('Wheel', 'Disk', [[0.5]])
    shape('Crate', 'Box2d', [[0.6, 0.4]])
    # In no order, with one in the middle.
    shape('Wedge', 'convex', [[0.3, -0.2], [0.0, 0.0], [0.0, 0.4], [-0.3, -0.2]])
    def thing(name, shape, place, angle=0.0, mass=None, v=(0., 0., 0.), **more):
        o = inp.create_group(name)
        if mass is not None:
            o.attrs['mass'] = mass
        o.attrs['translation'] = place; o.attrs['orientation'] = [angle]
        o.attrs['velocity'] = np.asarray(v, float); o.attrs['center_of_mass'] = np.zeros(3)
        for k, x in more.items(): o.attrs[k] = x
        d = o.create_dataset(shape + '-0', (0, 0), maxshape=(None, 0))
        d.attrs['instance_name'] = shape + '-0'; d.attrs['shape_name'] = shape; d.attrs['group'] = 0
        d.attrs['translation'] = [0., 0., 0.]; d.attrs['orientation'] = [1., 0., 0., 0.]
        o.attrs['id'] = len(inp) if mass is not None else -len(inp)
    thing('floor', 'Floor', [0., -.5])
    thing('wheel', 'Wheel', [-4., .5], mass=2.0, v=[3., 0., 0.], inertia=.25)
    thing('crate', 'Crate', [4., .2], mass=1.5, v=[2., 0., 0.])
    thing('wedge', 'Wedge', [0., .2], mass=1.0)
    thing('rod', 'Crate', [0., 9.], angle=np.pi / 2, mass=1.0, v=[0.5, 1., 2.], inertia=.02, fext=[1., 0., .04])
    law = laws.create_dataset('all', (0,))
    law.attrs['type'] = 'NewtonImpactFrictionNSL'; law.attrs['mu'] = .3; law.attrs['e'] = 0.
    law.attrs['gid1'] = 0; law.attrs['gid2'] = 0
    data.create_dataset('solv', data=[[1e-3 * k, 1, 0, 0] for k in range(1, 501)])
"#;

#[test]
fn a_scene_of_dimension_2_moves_in_the_plane() {
    let folder = Folder::new();
    let path = folder.path("flat.hdf5");
    let make =
        |text: &str| std::process::Command::new("python3").args(["-c", text]).arg(&path).output();
    let Some(made) = make(FLAT).ok().filter(|o| {
        o.status.success() || !String::from_utf8_lossy(&o.stderr).contains("ModuleNotFoundError")
    }) else {
        skipped("python3 with h5py is not here");
        return;
    };
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let run = folder.run("convert flat.hdf5 flat.toml");
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    let text = std::fs::read_to_string(folder.path("flat.toml")).unwrap();
    assert!(text.contains("dimension = 2"), "{text}");
    let run = folder.run("simulate flat.toml --out run.h5");
    assert_eq!(run.code, Some(0), "{}{}", run.stdout, run.stderr);
    let run = Trajectory::read(folder.path("run.h5")).unwrap();
    let body = |name: &str| {
        let k = run.bodies.iter().position(|b| b.name == name).unwrap();
        (run.frames[0].bodies[k], run.frames.last().unwrap().bodies[k])
    };
    let (g, t) = (9.80665, 0.5);
    let near = |x: f64, y: f64| assert!((x - y).abs() < 1e-6, "{x} {y}");
    // A disc with v and without spin rolls from v / (3 mu g) on, with 2 v / 3: 0.34 s.
    let (_, wheel) = body("wheel");
    near(wheel.velocity[0], 2.0);
    near(wheel.angular_velocity[2], -4.0);
    let (_, crate_) = body("crate");
    near(crate_.velocity[0], 2.0 - 0.3 * g * t);
    near(crate_.position[0], 4.0 + 2.0 * t - 0.15 * g * t * t);
    let (start, end) = body("wedge");
    (0..3).for_each(|k| near(start.position[k], end.position[k]));
    let (start, rod) = body("rod");
    near(start.rotation[3], std::f64::consts::FRAC_PI_4.sin());
    near(rod.position[0], 0.5 * t + 0.5 * t * t);
    near(rod.position[1], 9.0 + t - 0.5 * g * t * t);
    near(rod.angular_velocity[2], 2.0 + 0.04 / 0.02 * t);

    for (from, to, words) in [
        (
            "'Wheel', 'Disk', [[0.5]]",
            "'Wheel', 'Sphere', [[0.5]]",
            "/data/ref/Wheel: expected in dimension 2 a Disk or Box2d",
        ),
        (
            "[-4., .5]",
            "[-4., .5, 1.]",
            "/data/input/wheel: expected 2 numbers, or 3 with 0 as the third, as `translation`",
        ),
        (
            "'NewtonImpactFrictionNSL'",
            "'NewtonImpactRollingFrictionNSL'; law.attrs['mu_r'] = .1",
            "/data/nslaws/all: expected no rolling friction in dimension 2",
        ),
        (
            "[[0.3, -0.2], [0.0, 0.0], [0.0, 0.4], [-0.3, -0.2]]",
            "[[0.3, -0.2, 0.], [0.0, 0.0, 0.], [0.0, 0.4, 0.]]",
            "/data/ref/Wedge: expected in dimension 2 a primitive or a convex of rows of 2 numbers",
        ),
        (
            "[[0.3, -0.2], [0.0, 0.0], [0.0, 0.4], [-0.3, -0.2]]",
            "[[0., 0.], [1., 1.], [2., 2.]]",
            "/data/ref/Wedge: vertices: expected at least three corners",
        ),
        (
            "    law = laws",
            "    j = joints.create_dataset('hinge', (0,)); j.attrs['object1'] = 'rod'; j.attrs['type'] = 'PivotJointR'\n    law = laws",
            "/data/joints/hinge: expected none in dimension 2",
        ),
    ] {
        let text = FLAT.replace(from, to);
        assert_ne!(text, FLAT, "{from}");
        let made = make(&text).unwrap();
        assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
        let run = folder.run("convert flat.hdf5 flat.toml");
        assert!(run.stderr.contains(words), "{to}: {}", run.stderr);
        run.exits(2);
    }
}

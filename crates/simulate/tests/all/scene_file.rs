//! Scenes as files: what they mean, and what is said of mistakes.

use nonsmooth_scenes::SceneEntry;
use nonsmooth_simulate::scene_file::ShapeOrName;
use nonsmooth_simulate::{SceneFile, SimulateError};
use nonsmooth_solve::settings;

/// A ball, a box on a belt, a composed body, and a wall of `gen`.
const SCENE: &str = r#"
format = "nonsmooth-scene"
version = 1
name = "all kinds"
gravity = [0, 0, -9.81]

[time]
h = 1e-3
end = 0.01

[integrator]
theta = 0.5

[solver]
name = "nsgs"
tol = 1e-9
settings = { local = "quartic" }

[materials.stone]
density = 2400
[materials.rubber]

[[pairs]]
between = ["stone", "rubber"]
mu = 0.5
[[pairs]]
between = ["stone", "stone"]
mu = 0.6
e = 0.1
[pairs_default]
mu = 0.3

[[shapes]]
name = "brick"
kind = "box"
half = [0.1, 0.2, 0.05]

[[bodies]]
name = "belt"
shape = { kind = "box", half = [5, 5, 0.1] }
position = [0, 0, -0.1]
material = "rubber"
motion = { kind = "surface", velocity = [1, 0, 0] }

[[bodies]]
name = "block"
shape = "brick"
material = "stone"
position = [0, 0, 0.05]
rotation = { axis = [0, 0, 2], angle_deg = 90 }

[[bodies]]
name = "ball"
shape = { kind = "sphere", radius = 0.1 }
mass = 2.0
inertia = [0.008, 0.008, 0.008]
position = [2, 0, 0.1]
velocity = [1, 0, 0]
groups = ["balls"]

[[bodies]]
name = "dumbbell"
density = 1000
position = [0, 3, 0.1]
shapes = [
    { shape = { kind = "sphere", radius = 0.1 }, position = [-0.3, 0, 0] },
    { shape = { kind = "sphere", radius = 0.1 }, position = [0.3, 0, 0], material = "stone" },
]

[[bodies]]
name = "reel"
density = 700
position = [-2, 0, 0.3]
shapes = [
    { shape = { kind = "cylinder", half_length = 0.2, radius = 0.3 } },
    { shape = { kind = "cone", half_length = 0.1, radius = 0.2 }, position = [0, 0, 0.3] },
]

[[bodies]]
name = "wedge"
shape = { kind = "mesh", vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], triangles = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]] }
density = 500
position = [-4, 0, 0]
groups = ["wedges"]

[[bodies]]
name = "hills"
shape = { kind = "heightfield", heights = [[0, 0.1], [0.2, 0], [0, 0.1]], size = [2, 3] }
position = [0, 20, 0]
fixed = true
collides_with = ["balls"]

[[joints]]
name = "hook"
kind = "revolute"
a = "world"
b = "reel"
anchor = [-2, 0, 0.6]
axis = [0, 1, 0]
limits = { lower = -1, upper = 1 }

[[generate]]
scene = "wall"
set = { rows = 2, columns = 2, density = 1800.0 }
position = [10, 0, -1]

[[forces]]
body = "ball"
force = [0, 0.5, 0]
at = [0, 0, 0.1]
until = 0.005
"#;

#[test]
fn a_scene_of_all_kinds_moves() {
    let scene = SceneFile::parse(SCENE, &[]).unwrap();
    let world = scene.world().unwrap();
    let place = |name: &str| world.bodies.iter().position(|b| b.name == name).unwrap();
    let block = &world.bodies[place("block")];
    // A box of 2 × (0.1, 0.2, 0.05) m.
    let mass = 2400.0 * 0.2 * 0.4 * 0.1;
    assert!((block.mass - mass).abs() <= 1e-12 * mass);
    let dumbbell = &world.bodies[place("dumbbell")];
    let ball = 1000.0 * 4.0 / 3.0 * std::f64::consts::PI * 1e-3;
    assert!((dumbbell.mass - 2.0 * ball).abs() <= 1e-12 * ball);
    let across = 2.0 * ball * (0.4 * 0.01 + 0.09);
    assert!((dumbbell.inertia[2][2] - across).abs() <= 1e-12 * across);
    let [stone, rubber] =
        ["stone", "rubber"].map(|name| world.materials().iter().position(|m| m == name).unwrap());
    assert_eq!(world.law_between(rubber, stone).mu, 0.5);
    assert_eq!(world.law_between(rubber, rubber).mu, 0.3);
    assert_eq!(dumbbell.parts[1].material, stone);
    assert!(world.bodies.iter().any(|b| b.name == "wall 0" && b.position[0] > 5.0));

    let mut simulation = scene.build().unwrap();
    let run = simulation.run(scene.time.end, scene.time.h, &mut ()).unwrap();
    assert!(run.is_solved() && run.steps == 10, "{run}");
    let state = simulation.state();
    // The belt takes the block along: mu g t, and the ball is pushed sideways.
    let block = state.velocity[place("block")][0];
    assert!((block - 0.5 * 9.81 * 0.01).abs() < 1e-6, "{block}");
    assert!(state.velocity[place("ball")][1] > 0.0);
}

#[test]
fn the_completed_document_is_the_same_scene() {
    let scene = SceneFile::parse(SCENE, &[]).unwrap();
    let again = SceneFile::parse(&scene.to_toml(), &[]).unwrap();
    assert_eq!(scene, again);
    let json = serde_json::to_string(&scene).unwrap();
    assert_eq!(scene, SceneFile::parse(&json, &[]).unwrap());
}

#[test]
fn values_can_be_changed_by_their_paths() {
    let changes = ["time.end=0.5", "bodies[2].mass = 3", "solver.name=auto", "name=other"];
    let scene = SceneFile::parse(SCENE, &changes).unwrap();
    assert_eq!((scene.time.end, scene.bodies[2].mass), (0.5, Some(3.0)));
    assert_eq!((scene.solver.name.as_str(), scene.name.as_str()), ("auto", "other"));
    for (change, says) in [
        ("time.end", "--set: expected KEY=VALUE"),
        ("bodies[9].mass=1", "--set bodies[9].mass: expected a place below 7, found 9"),
        ("time.step=1", "time.step: unknown field `step`"),
    ] {
        let error = SceneFile::parse(SCENE, &[change]).unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
    }
}

/// What is said where one line is another one.
fn said(from: &str, to: &str) -> String {
    assert!(SCENE.contains(from), "{from}");
    let text = SCENE.replacen(from, to, 1);
    let made = SceneFile::parse(&text, &[]).and_then(|scene| scene.build());
    let error = made.err().unwrap_or_else(|| panic!("{to} is taken")).to_string();
    assert!(!error.contains('\n'), "{error}");
    error
}

#[test]
fn mistakes_are_named_by_their_place() {
    for (from, to, says) in [
        ("h = 1e-3", "h = 0.0", "time.h: expected a positive number of seconds, found 0"),
        ("h = 1e-3", "h = nan", "time.h"),
        ("h = 1e-3", "h = \"fast\"", "time.h: invalid type: string \"fast\""),
        ("h = 1e-3", "", "time: missing field `h`"),
        ("h = 1e-3", "h = = 2", "line 8: expected valid TOML"),
        ("theta = 0.5", "theta = 2.0", "integrator.theta: expected a number from 0.5 to 1"),
        ("version = 1", "version = 7", "version: expected 1, found 7"),
        ("\"nonsmooth-scene\"", "\"sdf\"", "format: expected \"nonsmooth-scene\""),
        ("name = \"nsgs\"", "name = \"ngs\"", "did you mean `nsgs`?"),
        ("name = \"nsgs\"", "name = \"ngs\"", "solver: unknown solver `ngs`"),
        ("local = \"quartic\"", "locl = \"quartic\"", "locl"),
        ("density = 2400", "density = -1", "materials.stone.density: expected a positive number"),
        (
            "[\"stone\", \"rubber\"]",
            "[\"stone\", \"ruber\"]",
            "pairs[0].between: expected the name of a material, found `ruber` (did you mean `rubber`?)",
        ),
        ("mu = 0.6", "mu = -0.6", "pairs[1].mu: expected a coefficient of at least 0"),
        (
            "shape = \"brick\"",
            "shape = \"bric\"",
            "bodies[1] (block).shape: expected the name of a shape of [[shapes]], found `bric` (did you mean `brick`?)",
        ),
        (
            "kind = \"sphere\", radius = 0.1 }\nmass",
            "kind = \"ball\", radius = 0.1 }\nmass",
            "bodies[2].shape.kind: unknown variant `ball`",
        ),
        (
            "radius = 0.1 }\nmass",
            "radius = -0.1 }\nmass",
            "bodies[2] (ball).shape.radius: expected a positive number, found -0.1",
        ),
        ("mass = 2.0", "mas = 2.0", "bodies[2].mas: unknown field `mas`"),
        ("mass = 2.0", "mass = -2.0", "bodies[2] (ball).mass"),
        (
            "inertia = [0.008, 0.008, 0.008]",
            "inertia = [0.008, 0.008]",
            "bodies[2] (ball).inertia: expected 3 or 6 numbers, found 2 numbers",
        ),
        (
            "inertia = [0.008, 0.008, 0.008]",
            "inertia = [0.001, 0.001, 0.008]",
            "bodies[2] (ball).inertia",
        ),
        (
            "inertia = [0.008, 0.008, 0.008]",
            "inertia = [inf, 0.008, 0.008]",
            "bodies[2] (ball).inertia: expected finite components",
        ),
        (
            "inertia = [0.008, 0.008, 0.008]",
            "",
            "bodies[2] (ball).inertia: expected 3 or 6 numbers",
        ),
        (
            "shape = { kind = \"sphere\", radius = 0.1 }\nmass = 2.0\ninertia = [0.008, 0.008, 0.008]",
            "density = 1",
            "bodies[2] (ball).shape: expected one, for its mass is to follow from a density, found none",
        ),
        (
            "velocity = [1, 0, 0] }",
            "velocity = [nan, 0, 0] }",
            "bodies[0] (belt).motion.velocity: expected finite components",
        ),
        (
            "axis = [0, 0, 2], angle_deg = 90",
            "axis = [0, 0, 0], angle = 1",
            "bodies[1] (block).rotation.axis: expected a direction",
        ),
        ("axis = [0, 0, 2], angle_deg = 90", "quaternion = [1, 1, 1, 1]", "bodies[1] (block)"),
        (
            "axis = [0, 0, 2], angle_deg = 90",
            "angle = 90",
            "bodies[1] (block).rotation: expected axis with angle or angle_deg, or quaternion, found no axis",
        ),
        ("position = [0, 0, 0.05]", "position = [0, 0]", "bodies[1].position"),
        (
            "position = [0, 0, 0.05]",
            "position = [0, 0, -0.05]",
            "bodies overlap at the start: `belt` and `block` by 1.000e-1 m",
        ),
        (
            "name = \"ball\"",
            "name = \"block\"",
            "name: expected a name that is not taken, found `block` again",
        ),
        (
            "body = \"ball\"",
            "body = \"bal\"",
            "forces[0].body: expected the name of a body, found `bal` (did you mean `ball`?)",
        ),
        (
            "force = [0, 0.5, 0]",
            "force = [0, inf, 0]",
            "forces[0].force: expected finite components",
        ),
        ("scene = \"wall\"", "scene = \"wal\"", "generate[0]"),
        ("rows = 2,", "row = 2,", "generate[0]"),
        (
            "half_length = 0.2, radius = 0.3",
            "half_length = 0.2, radius = 0",
            "bodies[4] (reel).shapes[0].shape.radius: expected a positive number, found 0",
        ),
        (
            "half_length = 0.1, radius",
            "half_length = nan, radius",
            "bodies[4] (reel).shapes[1].shape.half_length: expected a positive number",
        ),
        (
            ", [1, 2, 3]] }",
            "] }",
            "bodies[5] (wedge): mesh: expected a closed mesh where mass follows from a density, found 3 open edges: [1.0, 0.0, 0.0] to",
        ),
        (
            ", [1, 2, 3]] }",
            ", [1, 2, 4]] }",
            "bodies[5] (wedge).shape: triangles[3]: expected vertices below 4",
        ),
        (", [1, 2, 3]] }", ", [1, 3, 2]] }", "bodies[5] (wedge): mesh: expected a closed mesh"),
        (
            "[0, 0, 0], [1, 0, 0]",
            "[0, 0, inf], [1, 0, 0]",
            "bodies[5] (wedge).shape: vertices[0]: expected finite",
        ),
        (
            "[0.2, 0], [0, 0.1]",
            "[0.2], [0, 0.1]",
            "bodies[6] (hills).shape: heights[1]: expected 2 heights",
        ),
        (
            "size = [2, 3]",
            "size = [2, 0]",
            "bodies[6] (hills).shape: size[1]: expected a positive number",
        ),
        (
            "kind = \"mesh\", vertices",
            "kind = \"mesh\", file = \"a.stl\", vertices",
            "bodies[5] (wedge).shape.file: expected",
        ),
        ("[pairs_default]\nmu = 0.3", "", "pairs: expected a law between the materials"),
        ("motion = { kind = \"surface\", velocity = [1, 0, 0] }", "", "bodies[0] (belt)"),
    ] {
        let error = said(from, to);
        assert!(error.contains(says), "{to}: {error}");
    }
}

#[test]
fn keys_of_tables_are_refused_with_a_guess() {
    let error = said("[integrator]\ntheta", "[integrator]\ntheta = 0.6\nthetta");
    assert!(error.contains("(did you mean `theta`?)"), "{error}");
}

#[test]
fn the_schema_lists_what_is_read() {
    let schema = SceneFile::schema();
    let text = schema.to_string();
    for key in ["bodies", "pairs_default", "half_length", "restitution_threshold"] {
        assert!(text.contains(&format!("\"{key}\"")), "{key}");
    }
    // What may stand for a table of its own.
    let ways = schema["$defs"]["Activation"]["oneOf"].as_array().expect("ways to say it");
    for word in ["forecast", "gap"] {
        assert!(ways.iter().any(|way| way["const"] == word), "{word}");
        assert!(SceneFile::parse(SCENE, &[&format!("integrator.activation=\"{word}\"")]).is_ok());
    }
    let shape: ShapeOrName = serde_json::from_str("\"brick\"").unwrap();
    assert_eq!(shape, ShapeOrName::Name("brick".into()));
}

/// Every field of the scene, with a word, a number, a list or a table in its place: an error, if there is one, is a line that begins with the path.
#[test]
fn every_field_that_is_wrong_is_named() {
    let document: toml::Value = toml::from_str::<toml::Table>(SCENE).unwrap().into();
    let mut paths = vec![];
    leaves(&document, String::new(), &mut paths);
    assert!(paths.len() > 90, "{}", paths.len());
    let mut refused = 0;
    for path in &paths {
        for wrong in ["\"word\"", "-7.5", "[true]", "{ key = 1 }", "nan"] {
            let change = format!("{path}={wrong}");
            let made =
                SceneFile::parse(SCENE, &[&change]).and_then(|scene| scene.build().map(drop));
            let Err(error) = made else { continue };
            refused += 1;
            let said = error.to_string();
            assert!(!said.contains('\n') && said.contains(": "), "{change}: {said}");
            let place = said.split(": ").next().unwrap();
            // A name that is gone is missed where it is asked for, bodies that were moved overlap.
            let elsewhere = ["pairs", "forces", "joints", "bodies", "law", "generate"];
            let first = path.split(['.', '[']).next().unwrap();
            assert!(
                place.contains(first) || elsewhere.iter().any(|e| place.contains(e)),
                "{change}: {said}"
            );
        }
    }
    assert!(refused > 3 * paths.len(), "{refused} of {}", 5 * paths.len());
}

/// The paths of all values that are no tables or lists.
fn leaves(value: &toml::Value, path: String, out: &mut Vec<String>) {
    match value {
        toml::Value::Table(table) => {
            for (key, value) in table {
                let dot = if path.is_empty() { "" } else { "." };
                leaves(value, format!("{path}{dot}{key}"), out);
            }
        }
        toml::Value::Array(list) => {
            list.iter().enumerate().for_each(|(k, v)| leaves(v, format!("{path}[{k}]"), out));
        }
        _ => out.push(path),
    }
}

/// Whatever a scene says, the answer is a scene or one line. `NONSMOOTH_MUTATIONS` says how often it is asked.
#[test]
fn mutated_scenes_do_not_panic() {
    use rand::{RngExt, SeedableRng};
    let mut random = rand_pcg::Pcg64::seed_from_u64(7);
    let words = ["-1", "0", "nan", "inf", "1e308", "\"\"", "[]", "{}", "true", "[1, 2]", "x"];
    let count = std::env::var("NONSMOOTH_MUTATIONS").ok().and_then(|n| n.parse().ok());
    for round in 0..count.unwrap_or(2000) {
        let lines: Vec<&str> = if round % 4 == 0 { PLANE } else { SCENE }.lines().collect();
        let mut text: Vec<String> = lines.iter().map(|l| (*l).to_owned()).collect();
        for _ in 0..random.random_range(1..4) {
            let k = random.random_range(0..text.len());
            let word = words[random.random_range(0..words.len())];
            match random.random_range(0..4) {
                0 => drop(text.remove(k)),
                1 => text[k] = text[k].split('=').next().unwrap().to_owned() + "= " + word,
                2 => {
                    let other = text[random.random_range(0..text.len())].clone();
                    text.insert(k, other);
                }
                _ => {
                    let mut bytes: Vec<char> = text[k].chars().collect();
                    if !bytes.is_empty() {
                        let at = random.random_range(0..bytes.len());
                        bytes[at] = ['=', '[', '9', '"', '-', 'e'][random.random_range(0..6)];
                    }
                    text[k] = bytes.into_iter().collect();
                }
            }
        }
        let read = SceneFile::parse(&text.join("\n"), &[]);
        // Scenes of a million bodies are possible, and no matter of this test.
        let small = |scene: &SceneFile| {
            let sizes = scene.generate.iter().flat_map(|g| g.set.values());
            sizes.into_iter().all(|x| x.as_f64().is_none_or(|x| x.abs() < 10_000.0))
        };
        if let Err(error) = read.and_then(|s| if small(&s) { s.build().map(drop) } else { Ok(()) })
        {
            assert!(!error.to_string().contains('\n'), "{error}");
            assert!(!matches!(error, SimulateError::Checkpoint { .. }));
        }
    }
}

const PLANE: &str = r#"
format = "nonsmooth-scene"
version = 1
dimension = 2
time = { h = 1e-3, end = 0.05 }
pairs_default = { mu = 0.4, e = 0.2 }

[[shapes]]
name = "brick"
kind = "box"
half = [0.2, 0.1]

[[bodies]]
name = "slope"
shape = { kind = "plane", normal = [0.1, 1] }
fixed = true
[[bodies]]
name = "brick"
shape = "brick"
density = 10
position = [0, 0.5]
rotation = 0.3
velocity = [1, 0]
angular_velocity = -2.0
[[bodies]]
name = "pair"
mass = 2.0
inertia = 0.1
position = [1, 1]
torque = 0.5
force = [0, 1]
[[bodies.shapes]]
shape = { kind = "disc", radius = 0.1 }
position = [0.2, 0]
[[bodies.shapes]]
shape = { kind = "capsule", half_length = 0.2, radius = 0.05 }
rotation = 1.5
[[bodies]]
name = "three"
shape = { kind = "polygon", vertices = [[0, 0], [0.3, 0], [0, 0.3]] }
density = 5
position = [-1, 1]
[[joints]]
name = "pin"
kind = "revolute"
a = "world"
b = "three"
anchor = [-1, 1.2]
[[forces]]
body = "brick"
force = [0.1, 0]
at = [0.1, 0.1]
"#;

/// The weight of 2 kg half a metre from the anchor, and a turn by 0.1: of both it is said what the second partner has, though it is the world.
#[test]
fn a_joint_to_the_world_reports_what_acts_on_the_world() {
    let of = |kind: &str, [a, b]: [&str; 2]| {
        let scene = format!(
            r#"
            format = "nonsmooth-scene"
            version = 1
            time = {{ h = 1e-2, end = 0.1 }}
            joints = [{{ kind = "{kind}", a = "{a}", b = "{b}", axis = [0, 0, 1] }}]
            [[bodies]]
            name = "arm"
            mass = 2
            inertia = [0.1, 0.1, 0.1]
            position = [0.5, 0, 0]
            velocity = [0, {0}, 0]
            angular_velocity = [0, 0, {1}]
            "#,
            if kind == "fixed" { 0.0 } else { 0.5 },
            if kind == "fixed" { 0.0 } else { 1.0 },
        );
        let mut simulation = SceneFile::parse(&scene, &[]).unwrap().build().unwrap();
        let report = simulation.run(0.1, 1e-2, &mut ()).unwrap();
        assert!(report.is_solved(), "{report}");
        simulation.joints()[0]
    };
    for (bodies, sign) in [(["world", "arm"], 1.0), (["arm", "world"], -1.0)] {
        let weld = of("fixed", bodies);
        assert!((weld.impulse[2] - sign * 2.0 * 9.81e-2).abs() < 1e-12, "{weld:?}");
        assert!((weld.moment[1] + sign * 9.81e-2).abs() < 1e-12, "{weld:?}");
        let hinge = of("revolute", bodies);
        assert!((hinge.angle - sign * 0.1).abs() < 1e-5, "{hinge:?}");
        assert!((hinge.impulse[2] - sign * 2.0 * 9.81e-2).abs() < 1e-12, "{hinge:?}");
        // Centripetal, m ω² r towards the anchor on the arm.
        let (x, y) = (hinge.impulse[0], hinge.impulse[1]);
        assert!((x + sign * 1e-2 * 0.095_f64.cos()).abs() < 1e-5, "{hinge:?}");
        assert!((y + sign * 1e-2 * 0.095_f64.sin()).abs() < 1e-5, "{hinge:?}");
    }
}

#[test]
fn a_scene_in_the_plane_has_vectors_of_two_and_turns_of_one() {
    let scene = SceneFile::parse(PLANE, &["bodies[1].velocity=[2, 0]"]).unwrap();
    assert_eq!((scene.dimension, scene.gravity), (2, [0.0, -9.81, 0.0]));
    let again = SceneFile::parse(&scene.to_toml(), &[]).unwrap();
    assert_eq!(again, scene);
    let mut simulation = scene.build().unwrap();
    let world = simulation.world();
    assert_eq!(world.bodies[1].velocity, [2.0, 0.0, 0.0]);
    assert_eq!(world.bodies[1].angular_velocity, [0.0, 0.0, -2.0]);
    assert_eq!(world.bodies[2].inertia[2][2], 0.1);
    assert!((world.bodies[1].mass - 10.0 * 0.08).abs() < 1e-15);
    assert!((world.bodies[1].inertia[2][2] - 0.8 * (0.04 + 0.01) / 3.0).abs() < 1e-15);
    let [w, x, y, z] = world.bodies[1].rotation.0;
    assert_eq!((x, y), (0.0, 0.0));
    assert!((2.0 * z.atan2(w) - 0.3).abs() < 1e-15);
    let report = simulation.run(scene.time.end, scene.time.h, &mut ()).unwrap();
    assert!(report.is_solved() && report.residual <= 1e-10 && report.imbalance <= 1e-12);
}

#[test]
fn what_a_scene_in_the_plane_cannot_have_is_named_by_its_place() {
    let said = |change: &str| {
        let made = SceneFile::parse(PLANE, &[change]).and_then(|scene| scene.build().map(drop));
        made.err().unwrap_or_else(|| panic!("{change}")).to_string()
    };
    for (change, expected) in [
        ("dimension=4", "dimension: expected 2 or 3, found 4"),
        (
            "bodies[1].shape={ kind = \"sphere\", radius = 0.1 }",
            "bodies[1] (brick).shape: expected a disc",
        ),
        (
            "bodies[2].shapes[0].shape={ kind = \"cone\", half_length = 1, radius = 1 }",
            "bodies[2] (pair).shapes[0].shape: expected a disc",
        ),
        ("bodies[1].position=[0, 0, 1]", "bodies[1] (brick).position: expected 0"),
        ("bodies[1].position=[0]", "bodies[1].position: "),
        ("bodies[1].angular_velocity=[1, 0, 0]", "bodies[1] (brick).angular_velocity: expected 0"),
        (
            "bodies[1].rotation={ axis = [1, 0, 0], angle = 1 }",
            "bodies[1] (brick).rotation: expected",
        ),
        ("shapes[0].half=[0.1, 0.1, 0.1]", "bodies[1] (brick).shape.half: expected two half sides"),
        ("shapes[0].half=[0.1, -0.1]", "bodies[1] (brick).shape: half: expected a positive"),
        (
            "bodies[3].shape.vertices=[[0, 0], [0, 1], [1, 0]]",
            "bodies[3] (three).shape: vertices: expected the corners",
        ),
        ("joints[0].kind=spherical", "joints[0] (pin).kind: expected fixed"),
        ("joints[0].axis=[1, 0]", "joints[0] (pin).axis: expected the third axis"),
        ("joints[0].kind=prismatic", "joints[0] (pin).axis: expected a direction in the plane"),
        ("generate=[{ scene = \"wall\" }]", "generate[0]: expected none in the plane"),
        ("forces[0].force=[0, 0, 1]", "forces[0].force: expected 0"),
        ("forces[0].torque=[1, 0, 0]", "forces[0].torque: expected 0"),
        ("pairs_default.mu_rolling=0.1", "pairs_default.mu_rolling: expected 0 in the plane"),
    ] {
        let said = said(change);
        assert!(said.starts_with(expected), "{change}: {said}");
    }
    let space = PLANE.replace("dimension = 2", "dimension = 3");
    let said = SceneFile::parse(&space, &[]).unwrap_err().to_string();
    assert!(said.ends_with("invalid length 2, expected an array of length 3"), "{said}");
    let disc = "bodies[0].shape={ kind = \"disc\", radius = 0.1 }";
    let made = SceneFile::parse(SCENE, &[disc]).and_then(|scene| scene.build().map(drop));
    let said = made.unwrap_err().to_string();
    assert!(said.starts_with("bodies[0] (belt).shape: expected a solid"), "{said}");
}

/// What is wrong with a joint is one line that begins with its place.
#[test]
fn mistakes_in_joints_are_named_by_their_place() {
    let scene = |joints: &str| {
        let text = format!(
            r#"
            format = "nonsmooth-scene"
            version = 1
            time = {{ h = 1e-3, end = 1.0 }}
            bodies = [{{ name = "arm", mass = 1, inertia = [1, 1, 1] }}]
            {joints}
            "#
        );
        SceneFile::parse(&text, &[]).and_then(|s| s.build()).map(|_| ()).unwrap_err().to_string()
    };
    let cases = [
        (r#"joints = [{ kind = "revolut", a = "world", b = "arm" }]"#, "joints[0].kind"),
        (
            r#"joints = [{ kind = "revolute", a = "world", b = "arn" }]"#,
            "joints[0].b: expected the name of a body, found `arn` (did you mean `arm`?)",
        ),
        (r#"joints = [{ kind = "revolute", a = "world", b = "world" }]"#, "joints[0].b"),
        (
            r#"joints = [{ name = "h", kind = "screw", a = "world", b = "arm" }]"#,
            "joints[0] (h).pitch",
        ),
        (
            r#"joints = [{ kind = "fixed", a = "world", b = "arm", friction = 1 }]"#,
            "joints[0].friction: expected none, for a fixed joint has no coordinate, found one",
        ),
        (
            r#"joints = [{ kind = "revolute", a = "world", b = "arm", motor = { max = 1 } }]"#,
            "joints[0].motor",
        ),
        (
            r#"joints = [{ kind = "revolute", a = "world", b = "arm", axis = [0, 0, 0] }]"#,
            "joints[0].axis: expected a direction, and a reference across it, found [0.0, 0.0, 0.0]",
        ),
        (
            r#"joints = [{ kind = "prismatic", a = "world", b = "arm", friction = -1 }]"#,
            "joints[0].friction: expected a number of at least 0, found -1",
        ),
        (
            r#"joints = [{ kind = "cylindrical", a = "world", b = "arm", slide = { friction = -1 } }]"#,
            "joints[0].slide.friction: expected a number of at least 0, found -1",
        ),
        (
            r#"joints = [{ kind = "distance", a = "world", b = "arm" }]"#,
            "joints[0].anchor_b: expected the end on b of a `distance`, found none",
        ),
        (
            r#"joints = [{ kind = "revolute", a = "world", b = "arm", motor = { velocity = 1, position = 1 } }]"#,
            "joints[0].motor: expected a velocity alone, or a position with stiffness and damping, found both a velocity and a position",
        ),
        (
            r#"joints = [{ kind = "revolute", a = "world", b = "arm", motor = { velocity = 1, damping = 1 } }]"#,
            "joints[0].motor: expected a velocity alone, or a position with stiffness and damping, found a velocity with a damping",
        ),
        (
            r#"joints = [{ kind = "revolute", a = "world", b = "arm", motor = { position = 1 } }]"#,
            "joints[0].motor.stiffness: expected the stiffness with which it pulls to the position, found none",
        ),
        (
            r#"joints = [{ kind = "revolute", a = "world", b = "arm", motor = { velocity = 1 }, motion = { velocity = 1 } }]"#,
            "joints[0].motor.max: expected a bound, for the coordinate has a motion that is given, found inf",
        ),
        (
            r#"joints = [{ kind = "screw", pitch = 1, a = "world", b = "arm", motion = { velocity = 1 }, slide = { motor = { velocity = 1 } } }]"#,
            "joints[0].slide.motor.max: expected a bound",
        ),
        (
            r#"joints = [{ kind = "revolute", a = "world", b = "arm", limits = { lower = inf } }]"#,
            "joints[0].limits.lower: expected a number, or -inf for none, found inf",
        ),
        (
            r#"joints = [{ kind = "revolute", a = "world", b = "arm", limits = { lower = 1, upper = 0 } }]"#,
            "joints[0].limits.upper: expected a number of at least the lower limit, found 0",
        ),
        (
            r#"couplings = [{ terms = [{ joint = "x", weight = 1 }] }]"#,
            "couplings[0].terms[0].joint",
        ),
    ];
    for (joints, place) in cases {
        let said = scene(joints);
        assert!(said.starts_with(place), "{joints}: {said}");
        assert!(!said.contains('\n'), "{said}");
    }
}

/// A joint whose second body is the world is the one with the two exchanged.
#[test]
fn a_joint_to_the_world_may_be_told_either_way() {
    let angle = |a: &str, b: &str, sign: f64| {
        let text = format!(
            r#"
            format = "nonsmooth-scene"
            version = 1
            gravity = [0, 0, 0]
            time = {{ h = 1e-3, end = 0.1 }}
            bodies = [{{ name = "arm", mass = 1, inertia = [1, 1, 1], angular_velocity = [0, 0, {sign}] }}]
            joints = [{{ kind = "revolute", a = "{a}", b = "{b}" }}]
            "#
        );
        let mut simulation = SceneFile::parse(&text, &[]).unwrap().build().unwrap();
        simulation.run(0.1, 1e-3, &mut ()).unwrap();
        simulation.joints()[0].angle
    };
    assert!((angle("world", "arm", 1.0) - 0.1).abs() < 1e-6);
    assert!((angle("arm", "world", -1.0) - 0.1).abs() < 1e-6);
}

/// Of a universal joint each partner has its axis, whichever is named first; a line and a plane are the first one's.
#[test]
fn axes_stay_with_the_partner_that_they_are_of() {
    let joint = |joint: &str| {
        let text = format!(
            r#"
            format = "nonsmooth-scene"
            version = 1
            time = {{ h = 1e-3, end = 0.1 }}
            bodies = [{{ name = "arm", mass = 1, inertia = [1, 1, 1] }}]
            joints = [{{ {joint} }}]
            "#
        );
        let scene = SceneFile::parse(&text, &[]).unwrap();
        scene.build().map(|s| s.world().joints[0].clone()).map_err(|e| e.to_string())
    };
    let told =
        r#"kind = "universal", a = "arm", b = "world", axis = [1, 0, 0], reference = [0, 0, 1]"#;
    let turned =
        r#"kind = "universal", a = "world", b = "arm", axis = [0, 0, 1], reference = [1, 0, 0]"#;
    let (told, turned) = (joint(told).unwrap(), joint(turned).unwrap());
    assert_eq!(
        (told.axis, told.reference, told.a, told.b),
        (turned.axis, turned.reference, turned.a, turned.b)
    );
    for kind in ["point_on_line", "point_on_plane"] {
        let said = joint(&format!(r#"kind = "{kind}", a = "arm", b = "world""#)).unwrap_err();
        assert!(said.contains("joints[0].b: expected the body whose point it is"), "{said}");
        assert!(joint(&format!(r#"kind = "{kind}", a = "world", b = "arm""#)).is_ok());
    }
}

/// A ball in a world that repeats itself, with `more` in its table.
fn repeating(dimension: u8, more: &str) -> Result<nonsmooth_simulate::World, String> {
    let shape = if dimension == 2 { "disc" } else { "sphere" };
    let text = format!(
        r#"
        format = "nonsmooth-scene"
        version = 1
        dimension = {dimension}
        time = {{ h = 1e-3, end = 0.1 }}
        pairs_default = {{}}
        periodic = {{ {more} }}
        bodies = [{{ shape = {{ kind = "{shape}", radius = 0.1 }}, density = 1000 }}]
        "#
    );
    let scene = SceneFile::parse(&text, &[]).map_err(|e| e.to_string())?;
    let again = SceneFile::parse(&scene.to_toml(), &[]).map_err(|e| e.to_string())?;
    assert_eq!(scene.to_toml(), again.to_toml());
    scene.build().map(|s| s.world().clone()).map_err(|e| e.to_string())
}

#[test]
fn a_scene_may_repeat_itself() {
    let table = "lengths = [1, 0, 2], gradient = [[0, 0, 0.5], [0, 0, 0], [0, 0, 0.1]]";
    let periodic = repeating(3, table).unwrap().periodic;
    assert_eq!(periodic.periods.len(), 2);
    assert_eq!(periodic.periods[0].vector, [1.0, 0.0, 0.0]);
    assert_eq!(periodic.periods[1].vector, [0.0, 0.0, 2.0]);
    assert_eq!(periodic.periods[1].velocity, [1.0, 0.0, 0.2]);
    let table = "lengths = [1, 2], corner = [-0.5, 0], gradient = [[0, 0.5], [0, 0]]";
    let periodic = repeating(2, table).unwrap().periodic;
    assert_eq!(periodic.periods[1].vector, [0.0, 2.0, 0.0]);
    assert_eq!(periodic.periods[1].velocity, [1.0, 0.0, 0.0]);
    assert_eq!(periodic.corner, [-0.5, 0.0, 0.0]);
    for (dimension, table, says) in [
        (3, "lengths = [0, 0, 0]", "periodic.lengths: expected one that is not 0, found none"),
        (3, "lengths = [1, -1, 0]", "periodic.lengths: expected lengths of at least 0, found -1"),
        (3, "lengths = [1, nan, 0]", "periodic.lengths: expected lengths of at least 0"),
        (3, "lenghts = [1, 1, 0]", "unknown field `lenghts`"),
        (
            3,
            "lengths = [1, 1, 0], gradient = [[0, inf, 0], [0, 0, 0], [0, 0, 0]]",
            "periodic.gradient",
        ),
        (3, "lengths = [1, 1, 0], corner = [0, nan, 0]", "periodic.corner: expected finite"),
        (
            3,
            "lengths = [0.2, 1, 0]",
            "periodic: expected periods longer than 0.2, twice the reach of bodies[0]",
        ),
        (2, "lengths = [1, 0, 1]", "periodic.periods[1].vector: expected 0 as the third component"),
    ] {
        let error = repeating(dimension, table).unwrap_err();
        assert!(error.contains(says), "{table}: {error}");
    }
    let piston = r#"
        format = "nonsmooth-scene"
        version = 1
        gravity = [0, 0, 0]
        time = { h = 1e-3, end = 0.5 }
        pairs_default = {}
        bodies = [
            { name = "ball", shape = { kind = "sphere", radius = 0.1 }, density = 1000, position = [0, 0, 0.2] },
            { name = "piston", shape = { kind = "plane" }, motion = { kind = "uniform", velocity = [0, 0, 1] } },
        ]
    "#;
    let mut simulation = SceneFile::parse(piston, &[]).unwrap().build().unwrap();
    let report = simulation.run(0.5, 1e-3, &mut ()).unwrap();
    assert!(report.is_solved() && report.imbalance < 1e-12, "{report}");
    // It is met at t = 0.1 within half a step, and pushed from then on.
    let state = simulation.state();
    assert!((state.position[1][2] - 0.5).abs() < 1e-12);
    assert!((state.velocity[0][2] - 1.0).abs() < 1e-10);
    assert!((state.position[0][2] - 0.6).abs() < 1e-3);
}

/// An arm of 1 kg in space without weight, and `more` of the file.
fn arm(h: f64, end: f64, more: &str) -> Result<SceneFile, SimulateError> {
    let text = format!(
        r#"
        format = "nonsmooth-scene"
        version = 1
        gravity = [0, 0, 0]
        time = {{ h = {h}, end = {end} }}
        pairs_default = {{}}
        [[bodies]]
        name = "arm"
        mass = 1
        inertia = [1, 1, 1]
        {more}
        "#
    );
    SceneFile::parse(&text, &[])
}

/// A limit that is not given, or at infinity, is none.
#[test]
fn limits_may_be_open_on_either_side() {
    for kind in ["revolute", "prismatic", "cylindrical", "screw", "point_on_line"] {
        for (limits, ends) in [
            ("{ lower = -0.2 }", [-0.2, f64::INFINITY]),
            ("{ upper = 0.2 }", [f64::NEG_INFINITY, 0.2]),
            ("{ lower = -0.2, upper = inf }", [-0.2, f64::INFINITY]),
            ("{}", [f64::NEG_INFINITY, f64::INFINITY]),
        ] {
            for (direction, end) in [(-1.0, ends[0]), (1.0, ends[1])] {
                let pitch = if kind == "screw" { "pitch = 1.0" } else { "" };
                let more = format!(
                    r#"
                    velocity = [0, 0, {direction}]
                    angular_velocity = [0, 0, {direction}]
                    [[joints]]
                    kind = "{kind}"
                    a = "world"
                    b = "arm"
                    limits = {limits}
                    {pitch}
                    "#
                );
                let mut simulation = arm(1e-3, 0.5, &more).unwrap().build().unwrap();
                assert!(simulation.run(0.5, 1e-3, &mut ()).unwrap().is_solved());
                let report = simulation.joints()[0];
                let slides = ["prismatic", "point_on_line"].contains(&kind);
                let at = if slides { report.slide } else { report.angle };
                // It goes on for 0.5, or stays at its limit, which is met within a step.
                let goes = if end.is_finite() { 0.2 } else { 0.5 } * direction;
                assert!((at - goes).abs() < 2e-3, "{kind} {limits} {direction}: {at}");
            }
        }
    }
}

/// A force that acts from one time to another has the impulse of that time, however steps lie to it.
#[test]
fn forces_have_their_impulse_in_any_steps() {
    for (h, from, until) in [
        (1e-3, 0.2001, 0.2004),
        (1e-3, 0.2003, 0.2007),
        (1e-3, 0.2, 0.2006),
        (1e-3, 0.2004, 0.2016),
        (1e-3, 0.1, 0.25),
        (0.07, 0.2, 0.5),
    ] {
        let more = format!(
            r#"
            [[forces]]
            body = "arm"
            force = [1000, 0, 0]
            torque = [0, 0, 100]
            from = {from}
            until = {until}
            "#
        );
        let mut simulation = arm(h, 0.7, &more).unwrap().build().unwrap();
        assert!(simulation.run(0.7, h, &mut ()).unwrap().is_solved());
        let state = simulation.state();
        let impulse = 1000.0 * (until - from);
        let pushed = state.velocity[0][0];
        assert!((pushed - impulse).abs() < 1e-11 * impulse, "{h} {from} {until}: {pushed}");
        let turned = state.spin[0][2];
        assert!((turned - 0.1 * impulse).abs() < 1e-11 * impulse, "{h} {from} {until}: {turned}");
    }
}

/// What a scene says and nothing would come of is a mistake, too.
#[test]
fn what_would_be_ignored_is_refused() {
    let named = r#"
        [[bodies]]
        name = "world"
        fixed = true
        [[joints]]
        kind = "revolute"
        a = "world"
        b = "arm"
    "#;
    for (more, says) in [
        (
            "[[bodies]]\nfixed = true\nvelocity = [1, 0, 0]",
            "bodies[1].velocity: expected none of a fixed body, found [1.0, 0.0, 0.0]",
        ),
        (
            "[[bodies]]\nname = \"post\"\nfixed = true\nangular_velocity = [0, 2, 0]",
            "bodies[1] (post).angular_velocity: expected none of a fixed body",
        ),
        (
            "[[bodies]]\nfixed = true\nforce = [0, 0, 1]",
            "bodies[1].force: expected none of a fixed body",
        ),
        (
            "[[bodies]]\nmotion = { kind = \"uniform\", velocity = [1, 0, 0] }\nvelocity = [1, 0, 0]",
            "bodies[1].velocity: expected none of a body whose motion is given",
        ),
        (
            "[[bodies]]\nname = \"post\"\nfixed = true\n[[forces]]\nbody = \"post\"\nforce = [1, 0, 0]",
            "forces[0].body: expected the name of a body that moves freely, found `post`",
        ),
        (
            "collides_with = [\"bals\"]\ngroups = [\"balls\"]",
            "bodies[0] (arm).collides_with: expected the name of a group that a body is in, found `bals` (did you mean `balls`?)",
        ),
        (
            "groups = [\"nothing\"]",
            "bodies[0] (arm).groups: expected another name, for a group of nobody is meant",
        ),
        (
            named,
            "bodies[1].name: expected another name, for joints mean by `world` what is no body",
        ),
    ] {
        let said = arm(1e-3, 1.0, more).and_then(|s| s.build().map(drop)).unwrap_err().to_string();
        assert!(said.starts_with(says), "{more}: {said}");
    }
    // Of `nothing` is nobody; a body called `world` is one like others where no joint means the world.
    for more in ["collides_with = [\"nothing\"]", "[[bodies]]\nname = \"world\"\nfixed = true"] {
        arm(1e-3, 1.0, more).unwrap().build().unwrap();
    }
}

/// Laws are named by the place and the key in the file.
#[test]
fn laws_that_are_wrong_are_named_as_the_file_has_them() {
    let pair = |fields: &str| {
        format!("[materials.a]\n[materials.b]\n[[pairs]]\nbetween = [\"b\", \"a\"]\n{fields}")
    };
    let said = |more: &str, change: &[&str]| {
        let scene = arm(1e-3, 1.0, more).unwrap();
        let made = SceneFile::parse(&scene.to_toml(), change).and_then(|s| s.build().map(drop));
        made.unwrap_err().to_string()
    };
    for (change, says) in [
        ("pairs_default.mu=-1", "pairs_default.mu: expected a coefficient of at least 0, found -1"),
        ("pairs_default.e=2", "pairs_default.e: expected a coefficient from 0 to 1, found 2"),
        (
            "pairs_default.mu_rolling=-1",
            "pairs_default.mu_rolling: expected a length of at least 0, found -1",
        ),
        (
            "pairs_default.compliance.stiffness=0",
            "pairs_default.compliance.stiffness: expected a positive number, found 0",
        ),
    ] {
        assert_eq!(said("", &[change]), says);
    }
    for (fields, says) in [
        ("mu_rolling = -1", "pairs[0].mu_rolling: expected a length of at least 0, found -1"),
        ("e = -1", "pairs[0].e: expected a coefficient from 0 to 1, found -1"),
        ("compliance = { stiffness = -1 }", "pairs[0].compliance.stiffness: expected a positive"),
        (
            "e = 0.1\ncompliance = { stiffness = 1 }",
            "pairs[0].e: expected 0 where contacts have a compliance",
        ),
    ] {
        let said = said(&pair(fields), &[]);
        assert!(said.starts_with(says), "{fields}: {said}");
    }
}

/// The default law may have a compliance; pairs with a law of their own have that alone.
#[test]
fn pairs_that_are_not_listed_may_give_way() {
    let scene = SceneFile::parse(SCENE, &["pairs_default.compliance.stiffness=1e5"]).unwrap();
    let world = scene.world().unwrap();
    let number = |name: &str| world.materials().iter().position(|m| m == name).unwrap();
    let [stone, rubber, wall] = ["stone", "rubber", "wall"].map(number);
    for (a, b) in [(0, 0), (rubber, 0), (rubber, rubber), (wall, stone)] {
        assert_eq!(world.compliance_between(a, b).map(|c| c.stiffness), Some(1e5), "{a} {b}");
    }
    for (a, b) in [(stone, rubber), (stone, stone), (wall, wall)] {
        assert_eq!(world.compliance_between(a, b), None, "{a} {b}");
    }
}

/// Elastic boxes are refused by the keys of the file.
#[test]
fn mistakes_in_elastic_boxes_are_named() {
    let table = "[[elastic]]\nhalf = [1, 1, 1]\ndivisions = [1, 1, 1]\nyoung = 1e6\ndensity = 1";
    for (change, says) in [
        ("half=[1, -1, 1]", "half: expected positive numbers, found -1"),
        ("divisions=[0, 1, 1]", "divisions: expected at least 1 along each axis"),
        ("young=-1", "young: expected a positive number, found -1"),
        ("damping.mass=-1", "damping.mass: expected a number of at least 0, found -1"),
        ("damping.stiffness=-1", "damping.stiffness: expected a number of at least 0, found -1"),
    ] {
        let text = arm(1e-3, 1.0, table).unwrap().to_toml();
        let made = SceneFile::parse(&text, &[&format!("elastic[0].{change}")]);
        let said = made.and_then(|s| s.build().map(drop)).unwrap_err().to_string();
        assert!(said.starts_with(&format!("elastic[0].{says}")), "{change}: {said}");
    }
}

#[test]
fn the_forecast_may_be_asked_for_by_its_name() {
    let scene = SceneFile::parse(SCENE, &["integrator.activation=forecast"]).unwrap();
    assert_eq!(scene, SceneFile::parse(SCENE, &[]).unwrap());
    // Of its two numbers one may be left to its default.
    let half = SceneFile::parse(SCENE, &["integrator.activation.forecast.gamma=0.5"]).unwrap();
    assert_eq!(scene, half);
    let wrong = SceneFile::parse(SCENE, &["integrator.activation.forecast.gamma=-1"]).unwrap();
    let said = wrong.build().map(drop).unwrap_err().to_string();
    assert!(said.starts_with("integrator.activation.forecast.gamma: expected"), "{said}");
    let said =
        SceneFile::parse(SCENE, &["integrator.activation=forecats"]).unwrap_err().to_string();
    assert!(said.contains("(did you mean `forecast`?)"), "{said}");
}

/// What a family was made into is used for as long as it is that of the table, and is no part of the document.
#[test]
fn a_family_that_was_made_is_not_made_again() {
    let set = settings::from_texts(&["rows=2", "columns=2", "gravity=3"]).unwrap();
    let mut made = SceneEntry::find("wall").unwrap().make(&set).unwrap();
    let fresh = SceneFile {
        gravity: made.gravity,
        ..SceneFile::of_family("wall", set.clone(), made.h, 1.0)
    };
    // By this it is known again.
    made.bodies[0].position[2] += 5.0;
    let mut scene = SceneFile::of_made("wall", set, made, 1.0);
    assert_eq!(scene, fresh);
    assert_eq!(scene.to_toml(), fresh.to_toml());
    let top = |scene: &SceneFile| {
        let world = scene.world().unwrap();
        world.bodies.iter().map(|b| b.position[2]).fold(0.0, f64::max)
    };
    assert!(top(&scene) > 5.0 && top(&fresh) < 5.0);
    assert!(top(&scene.clone()) > 5.0);
    scene.generate[0].set.insert("rows".into(), 3.into());
    assert!(top(&scene) < 5.0);
}

/// Limits that are over end the making of a simulation: shapes, and the search for overlaps.
#[test]
fn limits_end_the_making_of_a_simulation() {
    use nonsmooth_linalg::budget::Budget;
    use nonsmooth_scenes::SceneError;
    use nonsmooth_simulate::SimulateError;
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;

    let scene = SceneFile::parse(SCENE, &[]).unwrap();
    let flag = Arc::new(AtomicBool::new(true));
    let _scope = Budget { cancel: Some(flag), ..Budget::default() }.enter();
    let stopped = SimulateError::Scene(SceneError::Stopped);
    assert_eq!(scene.build().map(drop).unwrap_err(), stopped);
    assert_eq!(scene.build_settled().map(drop).unwrap_err(), stopped);
}

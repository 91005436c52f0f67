//! Robots as scenes.

use nonsmooth_simulate::SceneFile;
use nonsmooth_simulate::import::urdf;

/// A base that nothing moves, an arm of two links that are one body, a wheel and a finger that follows it.
const ROBOT: &str = r#"<?xml version="1.0"?>
<robot name="arm">
  <link name="base">
    <collision><origin xyz="0 0 0.5"/><geometry><box size="1 2 1"/></geometry></collision>
  </link>
  <link name="arm">
    <inertial><origin xyz="0.5 0 0"/><mass value="2"/><inertia ixx="0.1" iyy="0.2" izz="0.3"/></inertial>
    <collision><origin xyz="0.5 0 0" rpy="0 1.5707963267948966 0"/><geometry><cylinder radius="0.1" length="1"/></geometry></collision>
  </link>
  <link name="hand">
    <inertial><mass value="1"/><inertia ixx="0.01" iyy="0.02" izz="0.03"/></inertial>
  </link>
  <link name="wheel">
    <inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01"/></inertial>
    <collision><geometry><sphere radius="0.2"/></geometry></collision>
  </link>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="arm"/><origin xyz="0 0 2" rpy="0 0 1.5707963267948966"/>
    <axis xyz="0 1 0"/><limit lower="-1" upper="2" effort="10" velocity="1"/><dynamics damping="0.5" friction="0.1"/>
  </joint>
  <joint name="wrist" type="fixed"><parent link="arm"/><child link="hand"/><origin xyz="1 0 0"/></joint>
  <joint name="axle" type="continuous">
    <parent link="hand"/><child link="wheel"/><origin xyz="0.5 0 0"/><axis xyz="0 0 2"/>
    <mimic joint="shoulder" multiplier="3"/>
  </joint>
</robot>"#;

fn near(found: &toml::Value, expected: &[f64]) {
    let found: Vec<f64> = found.as_array().unwrap().iter().map(|x| x.as_float().unwrap()).collect();
    assert_eq!(found.len(), expected.len());
    for (x, y) in found.iter().zip(expected) {
        assert!((x - y).abs() < 1e-12, "{found:?} {expected:?}");
    }
}

#[test]
fn links_are_bodies_and_joints_stand_where_they_are() {
    let made = urdf(ROBOT).unwrap();
    let scene: toml::Table = toml::from_str(&made.scene).unwrap();
    let [base, arm, wheel] = &scene["bodies"].as_array().unwrap()[..] else { panic!() };
    assert_eq!(base["fixed"].as_bool(), Some(true));
    near(&base["shapes"][0]["position"], &[0.0, 0.0, 0.5]);
    near(&base["shapes"][0]["shape"]["half"], &[0.5, 1.0, 0.5]);
    // Two links of 2 kg at 0.5 and 1 kg at 1: 3 kg at 2/3 along the arm, which points to y.
    assert_eq!(arm["mass"].as_float(), Some(3.0));
    near(&arm["position"], &[0.0, 2.0 / 3.0, 2.0]);
    let steiner = 2.0 / 36.0 + 1.0 / 9.0;
    near(&arm["inertia"], &[0.11, 0.22 + steiner, 0.33 + steiner, 0.0, 0.0, 0.0]);
    near(&arm["shapes"][0]["position"], &[0.5 - 2.0 / 3.0, 0.0, 0.0]);
    assert_eq!(arm["shapes"][0]["shape"]["half_length"].as_float(), Some(0.5));
    near(&wheel["position"], &[0.0, 1.5, 2.0]);
    let [shoulder, axle] = &scene["joints"].as_array().unwrap()[..] else { panic!() };
    assert_eq!((shoulder["a"].as_str(), shoulder["b"].as_str()), (Some("base"), Some("arm")));
    near(&shoulder["anchor"], &[0.0, 0.0, 2.0]);
    near(&shoulder["axis"], &[-1.0, 0.0, 0.0]);
    assert_eq!(shoulder["limits"]["upper"].as_float(), Some(2.0));
    assert_eq!(shoulder["spring"]["damping"].as_float(), Some(0.5));
    assert_eq!(shoulder["friction"].as_float(), Some(0.1));
    // The hand is part of the arm.
    assert_eq!((axle["a"].as_str(), axle["kind"].as_str()), (Some("arm"), Some("revolute")));
    assert!(axle.get("limits").is_none());
    assert_eq!(scene["couplings"][0]["terms"][1]["weight"].as_float(), Some(-3.0));
    assert!(made.warnings.iter().any(|w| w.contains("`shoulder`: effort")), "{:?}", made.warnings);
    assert!(made.warnings.iter().any(|w| w.contains("no law of contact")));
}

#[test]
fn a_robot_swings_as_its_joints_let_it() {
    // The wheel turns three times as fast as the shoulder.
    let scene = SceneFile::parse(&urdf(ROBOT).unwrap().scene, &[]).unwrap();
    let mut simulation = scene.build().unwrap();
    let run = simulation.run(0.2, 1e-3, &mut ()).unwrap();
    assert!(run.is_solved(), "{run}");
    let [shoulder, axle] = simulation.joints() else { panic!() };
    assert!(shoulder.angle.abs() > 0.05 && (axle.angle - 3.0 * shoulder.angle).abs() < 1e-6);
    assert!(shoulder.violation < 1e-8 && axle.violation < 1e-8);
}

/// Joints of scenes mean by `world` what is no body.
#[test]
fn a_link_that_is_called_world_is_a_body_of_another_name() {
    let text = ROBOT.replace("\"base\"", "\"world\"");
    let simulation = SceneFile::parse(&urdf(&text).unwrap().scene, &[]).unwrap().build().unwrap();
    let world = simulation.world();
    assert_eq!(world.bodies[0].name, "world_link");
    assert_eq!(world.joints[0].a.map(|a| a.index()), Some(0));
}

#[test]
fn a_robot_of_one_body_falls() {
    let cut = |text: &str, from: &str, to: &str| {
        let (i, j) = (text.find(from).unwrap(), text.find(to).unwrap());
        [&text[..i], &text[j..]].concat()
    };
    let text = cut(ROBOT, "  <joint name=\"axle\"", "</robot>");
    let text = cut(&text, "  <link name=\"wheel\"", "  <joint name=\"shoulder\"");
    let made = urdf(&text.replace("\"revolute\"", "\"floating\"")).unwrap();
    let scene = SceneFile::parse(&made.scene, &[]).unwrap();
    let mut simulation = scene.build().unwrap();
    let run = simulation.run(0.1, 1e-3, &mut ()).unwrap();
    assert!(run.is_solved() && simulation.state().velocity[1][2] < -0.97, "{run}");
}

/// The usual anchor: a link `world` without mass that a fixed joint holds the base at. Others, as `base_footprint` of vehicles, move with it.
#[test]
fn a_root_without_mass_that_is_called_world_stands_with_what_is_fixed_to_it() {
    let mass = r#"<inertial><mass value="5"/><inertia ixx="1" iyy="1" izz="1"/></inertial>"#;
    let anchored = |root: &str, shape: &str| {
        urdf(&format!(
            r#"<robot name="arm"><link name="base">{mass}{shape}</link><link name="world">{root}</link>
            <joint name="anchor" type="fixed"><parent link="world"/><child link="base"/><origin xyz="0 0 1"/></joint>
            <link name="arm">{mass}</link>
            <joint name="shoulder" type="continuous"><parent link="base"/><child link="arm"/></joint></robot>"#
        ))
        .unwrap()
    };
    let shape = r#"<collision><geometry><sphere radius="0.1"/></geometry></collision>"#;
    for (root, shape, bodies, fixed) in
        [("", shape, 2, true), ("", "", 1, false), (mass, shape, 2, false)]
    {
        let made = anchored(root, shape);
        let simulation = SceneFile::parse(&made.scene, &[]).unwrap().build().unwrap();
        assert_eq!(simulation.world().bodies.len(), bodies);
        let scene: toml::Table = toml::from_str(&made.scene).unwrap();
        let first = &scene["bodies"][0];
        assert_eq!(first.get("fixed").is_some(), fixed, "{first:?}");
        assert!(!made.warnings.iter().any(|w| w.contains("root")), "{:?}", made.warnings);
        let to = if bodies == 1 { "world" } else { "world_link" };
        assert_eq!(scene["joints"][0]["a"].as_str(), Some(to));
        if fixed {
            near(&first["position"], &[0.0; 3]);
            near(&first["shapes"][0]["position"], &[0.0, 0.0, 1.0]);
        }
    }
    let vehicle = urdf(&format!(
        r#"<robot name="car"><link name="base_footprint"/><link name="base_link">{mass}{shape}</link>
        <joint name="foot" type="fixed"><parent link="base_footprint"/><child link="base_link"/></joint></robot>"#
    ))
    .unwrap();
    let scene: toml::Table = toml::from_str(&vehicle.scene).unwrap();
    assert!(scene["bodies"][0].get("fixed").is_none() && scene["bodies"][0].get("mass").is_some());
    let said = "link `base_footprint`: a root without mass moves with what is fixed to it, as `base_link`; one called `world` would stand";
    assert!(vehicle.warnings.iter().any(|w| w == said), "{:?}", vehicle.warnings);
}

#[test]
fn what_planar_and_floating_joints_lose_is_said() {
    let with = |kind: &str, numbers: &str| {
        let text = ROBOT.replace("\"revolute\"", &format!("\"{kind}\""));
        let text = text.replace("<mimic joint=\"shoulder\" multiplier=\"3\"/>", "");
        urdf(&text.replace("damping=\"0.5\" friction=\"0.1\"", numbers)).unwrap().warnings
    };
    for kind in ["planar", "floating"] {
        let warnings = with(kind, "damping=\"0.5\"");
        for names in ["lower and upper", "damping and friction"] {
            let says = format!("joint `shoulder`: {names} of a {kind} joint are left out");
            assert!(warnings.contains(&says), "{warnings:?}");
        }
        assert!(!with(kind, "damping=\"0\"").iter().any(|w| w.contains("damping")));
    }
}

/// From version 1.1 on an orientation may be a quaternion.
#[test]
fn quaternions_have_a_meaning_in_later_versions() {
    let turned = "rpy=\"0 0 1.5707963267948966\"";
    let text = |version: &str| {
        let text = ROBOT.replace(turned, "quat_xyzw=\"0 0 3 3\"");
        text.replace(
            "name=\"arm\">\n  <link name=\"base",
            &format!("name=\"arm\"{version}>\n  <link name=\"base"),
        )
    };
    let place = |text: &str| {
        let made = urdf(text).unwrap();
        let scene: toml::Table = toml::from_str(&made.scene).unwrap();
        let warned = made
            .warnings
            .iter()
            .any(|w| w.starts_with("joint `shoulder`: `quat_xyzw` is left out"));
        (scene["bodies"][1]["position"].clone(), warned)
    };
    let (at, warned) = place(&text(" version=\"1.1\""));
    near(&at, &[0.0, 2.0 / 3.0, 2.0]);
    assert!(!warned);
    for version in ["", " version=\"1.0\""] {
        let (at, warned) = place(&text(version));
        near(&at, &[2.0 / 3.0, 0.0, 2.0]);
        assert!(warned);
    }
    for (own, says) in [
        (
            format!("{turned} quat_xyzw=\"0 0 1 1\""),
            "expected either `rpy` or `quat_xyzw`, found both",
        ),
        ("quat_xyzw=\"0 0 0 0\"".into(), "expected a quaternion as `quat_xyzw`, found zero"),
        ("quat_xyzw=\"0 0 0\"".into(), "origin.quat_xyzw: expected 4 numbers, found 3"),
    ] {
        let text = text(" version=\"1.1\"").replace("quat_xyzw=\"0 0 3 3\"", &own);
        let error = urdf(&text).unwrap_err().to_string();
        assert!(error.starts_with("joint `shoulder`") && error.ends_with(says), "{error}");
    }
}

#[test]
fn what_is_no_robot_is_refused_in_one_line() {
    for (from, to, says) in [
        ("<robot name=\"arm\">", "<robot", "robot: expected an XML document"),
        ("type=\"revolute\"", "type=\"hinge\"", "joint `shoulder`.type: expected fixed, revolute"),
        ("type=\"revolute\"", "", "joint `shoulder`: expected <joint> with `type`, found none"),
        (
            "<limit lower=\"-1\" upper=\"2\" effort=\"10\" velocity=\"1\"/>",
            "",
            "joint `shoulder`: expected <limit>, which a revolute joint has, found none",
        ),
        (
            "<child link=\"arm\"/>",
            "<child link=\"ram\"/>",
            "joint `shoulder`: expected a child that is a link, found `ram`",
        ),
        (
            "<child link=\"hand\"/>",
            "<child link=\"arm\"/>",
            "joint `wrist`: expected a tree of links, found another joint",
        ),
        (
            "<parent link=\"base\"/>",
            "<parent link=\"wheel\"/>",
            "expected a tree of links, found a ring",
        ),
        (
            "<mass value=\"2\"/>",
            "<mass value=\"two\"/>",
            "link `arm`.mass.value: expected finite numbers, found `two`",
        ),
        (
            "<mass value=\"2\"/>",
            "<mass value=\"-2\"/>",
            "link `arm`.mass.value: expected a mass of at least 0, found -2",
        ),
        (
            "<box size=\"1 2 1\"/>",
            "<box size=\"1 2\"/>",
            "link `base`.collision.box.size: expected 3 numbers, found 2",
        ),
        (
            "<box size=\"1 2 1\"/>",
            "<torus/>",
            "link `base`.collision: expected box, cylinder, sphere, capsule or mesh, found <torus>",
        ),
        (
            "<sphere radius=\"0.2\"/>",
            "<mesh filename=\"package://a/b.stl\" scale=\"1 1 2\"/>",
            "expected the same positive scale along all axes",
        ),
        (
            "<sphere radius=\"0.2\"/>",
            "<mesh filename=\"a.stl\" scale=\"0 0 0\"/>",
            "expected the same positive scale along all axes, found 0 0 0",
        ),
        (
            "<mass value=\"1\"/><inertia ixx=\"0.01\" iyy=\"0.01\" izz=\"0.01\"/>",
            "",
            "link `wheel`: expected a mass, for joint `axle` of type continuous moves it",
        ),
        (
            "<link name=\"base\">",
            "<link name=\"alone\"/><link name=\"base\">",
            "robot: expected one link above all others, found alone, base",
        ),
        ("<link name=\"base\">", "<xacro:macro/><link name=\"base\">", "robot: expected"),
    ] {
        assert!(ROBOT.contains(from), "{from}");
        let error = urdf(&ROBOT.replacen(from, to, 1)).unwrap_err().to_string();
        assert!(error.contains(says) && !error.contains('\n'), "{error}");
    }
}

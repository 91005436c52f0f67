//! Models of MuJoCo as scenes. What MuJoCo itself makes of models like these is compared by `compare_mujoco.py`.

use std::path::Path;

use nonsmooth_simulate::import::{Imported, mjcf};
use nonsmooth_simulate::{SceneFile, Simulation};

fn import(text: &str) -> Imported {
    mjcf(text, Path::new("")).unwrap()
}

fn table(made: &Imported) -> toml::Table {
    toml::from_str(&made.scene).unwrap()
}

fn simulation(made: &Imported) -> Simulation {
    SceneFile::parse(&made.scene, &[]).unwrap().build().unwrap()
}

fn near(found: &toml::Value, expected: &[f64]) {
    let found: Vec<f64> = found.as_array().unwrap().iter().map(|x| x.as_float().unwrap()).collect();
    assert_eq!(found.len(), expected.len());
    for (x, y) in found.iter().zip(expected) {
        assert!((x - y).abs() < 1e-12, "{found:?} {expected:?}");
    }
}

fn said(made: &Imported, words: &str) -> bool {
    made.warnings.iter().any(|w| w.contains(words))
}

#[test]
fn a_pendulum_swings_with_the_period_of_its_inertia() {
    // A ball of 3 kg on an arm without mass, 0.5 m below the pivot; degrees are the unit of ranges.
    let made = import(
        r#"<mujoco model="pendulum"><option timestep="0.001"/><worldbody>
             <body name="bob" pos="0 0 1">
               <joint name="pivot" axis="0 1 0" range="-90 45"/>
               <geom type="sphere" pos="0 0 -0.5" size="0.1" mass="3"/>
             </body>
           </worldbody>
           <keyframe><key qpos="0.02"/></keyframe></mujoco>"#,
    );
    let scene = table(&made);
    let body = &scene["bodies"][0];
    assert_eq!(body["mass"].as_float(), Some(3.0));
    let j = 0.4 * 3.0 * 0.01;
    near(&body["inertia"], &[j, j, j, 0.0, 0.0, 0.0]);
    let (sin, cos) = 0.02_f64.sin_cos();
    near(&body["position"], &[-0.5 * sin, 0.0, 1.0 - 0.5 * cos]);
    let joint = &scene["joints"][0];
    assert_eq!((joint["a"].as_str(), joint["kind"].as_str()), (Some("world"), Some("revolute")));
    let quarter = std::f64::consts::FRAC_PI_4;
    near(&toml::Value::Array(vec![joint["limits"]["lower"].clone()]), &[-2.0 * quarter - 0.02]);
    near(&toml::Value::Array(vec![joint["limits"]["upper"].clone()]), &[quarter - 0.02]);
    // After half a period it is on the other side.
    let omega = (3.0 * 9.81 * 0.5 / (j + 3.0 * 0.25)).sqrt();
    let mut simulation = simulation(&made);
    let run = simulation.run(std::f64::consts::PI / omega, 1e-3, &mut ()).unwrap();
    assert!(run.is_solved(), "{run}");
    assert!((simulation.joints()[0].angle + 0.04).abs() < 1e-5, "{}", simulation.joints()[0].angle);
}

#[test]
fn defaults_are_inherited_by_class_and_actuators_are_motors() {
    let made = import(
        r#"<mujoco model="cart-pole">
          <compiler angle="radian"/>
          <default>
            <joint damping="1"/><geom contype="0" conaffinity="0" density="500"/>
            <default class="pole"><joint damping="0.2" stiffness="3" springref="0.1"/></default>
          </default>
          <worldbody>
            <geom type="capsule" size="0.02 1" euler="0 1.57 0"/>
            <body name="cart">
              <joint name="slider" type="slide" axis="2 0 0" range="-1 1" armature="0.1"/>
              <geom type="box" size="0.1 0.2 0.3"/>
              <body name="pole" childclass="pole">
                <joint name="hinge" axis="0 1 0" ref="0.4"/>
                <geom type="capsule" fromto="0 0 0 0 0 0.6" size="0.05"/>
                <body pos="0 0 0.6"><geom size="0.1" mass="1"/></body>
              </body>
            </body>
          </worldbody>
          <actuator>
            <motor joint="slider" name="push"/>
            <position joint="hinge" kp="20" kv="2" gear="3" forcerange="-4 4"/>
          </actuator>
        </mujoco>"#,
    );
    let scene = table(&made);
    let [cart, pole] = &scene["bodies"].as_array().unwrap()[..] else { panic!() };
    assert!((cart["mass"].as_float().unwrap() - 500.0 * 0.048).abs() < 1e-12);
    assert!(cart.get("shapes").is_none() && pole.get("shapes").is_none());
    let capsule = 500.0 * std::f64::consts::PI * 0.0025 * (0.6 + 4.0 / 3.0 * 0.05);
    assert!((pole["mass"].as_float().unwrap() - capsule - 1.0).abs() < 1e-12);
    let [slider, hinge] = &scene["joints"].as_array().unwrap()[..] else { panic!() };
    assert_eq!(slider["kind"].as_str(), Some("prismatic"));
    near(&slider["axis"], &[1.0, 0.0, 0.0]);
    assert_eq!(slider["limits"]["upper"].as_float(), Some(1.0));
    assert_eq!(slider["spring"]["damping"].as_float(), Some(1.0));
    assert!(slider.get("motor").is_none());
    assert_eq!((hinge["a"].as_str(), hinge["b"].as_str()), (Some("cart"), Some("pole")));
    assert_eq!(hinge["spring"]["damping"].as_float(), Some(0.2));
    // Coordinates begin at zero in a scene, at the reference there.
    assert!((hinge["spring"]["rest"].as_float().unwrap() + 0.3).abs() < 1e-15);
    assert_eq!(hinge["motor"]["position"].as_float(), Some(-0.4));
    assert_eq!(hinge["motor"]["stiffness"].as_float(), Some(180.0));
    assert_eq!(hinge["motor"]["max"].as_float(), Some(12.0));
    for words in ["`armature` is left out", "<motor> `push`", "(line 10)", "solref"] {
        assert!(said(&made, words), "{words}: {:?}", made.warnings);
    }
    let run = simulation(&made).run(0.2, 2e-3, &mut ()).unwrap();
    assert!(run.is_solved(), "{run}");
}

#[test]
fn a_two_link_arm_keeps_its_energy_and_falls_as_both_frames_say() {
    let arm = |orientation: &str| {
        format!(
            r#"<mujoco><compiler angle="radian" eulerseq="XYZ"/><option timestep="1e-3"/><worldbody>
              <body name="upper" pos="0 0 1" {orientation}>
                <inertial pos="0.2 0 0" mass="2" fullinertia="0.02 0.04 0.05 0.001 0 0.002"/>
                <joint axis="0 0 1"/><geom contype="0" conaffinity="0" size="1"/>
                <frame pos="0.4 0 0"><body name="fore"><joint axis="0 1 0" pos="0 0 0"/>
                  <inertial pos="0.1 0 0" quat="1 1 0 0" mass="1" diaginertia="0.01 0.02 0.02"/></body></frame>
              </body></worldbody></mujoco>"#
        )
    };
    // One orientation in five ways.
    let (s, c) = 0.7_f64.sin_cos();
    let (s2, c2) = 0.35_f64.sin_cos();
    let ways = [
        "euler=\"0 0.7 0\"".to_owned(),
        format!("quat=\"{} 0 {} 0\"", 2.0 * c2, 2.0 * s2),
        "axisangle=\"0 3 0 0.7\"".to_owned(),
        format!("xyaxes=\"{c} 0 {} 0 2 0\"", -s),
        format!("zaxis=\"{s} 0 {c}\""),
    ];
    let positions = ways.map(|way| {
        let mut simulation = simulation(&import(&arm(&way)));
        let run = simulation.run(0.5, 1e-3, &mut ()).unwrap();
        assert!(run.is_solved() && run.imbalance < 1e-12, "{run}");
        simulation.state().position[1]
    });
    for other in &positions[1..] {
        for k in 0..3 {
            assert!((positions[0][k] - other[k]).abs() < 1e-9, "{positions:?}");
        }
    }
    assert!(positions[0][2] < 0.9, "{positions:?}");
}

#[test]
fn a_box_slides_on_a_plane_with_the_larger_friction_and_filters_hold() {
    let made = import(
        r#"<mujoco><option timestep="0.001" gravity="3 0 -10"/><worldbody>
          <geom type="plane" size="1 1 1" friction="0.1"/>
          <body name="box" pos="0 0 0.1"><freejoint/><geom type="box" size="0.1 0.1 0.1" friction="0.2"/></body>
          <body name="ghost" pos="1 0 0.1"><freejoint/><geom size="0.1" contype="2" conaffinity="4" friction="0.2"/></body>
          <body name="smooth" pos="0 1 0.1"><freejoint/><geom type="box" size="0.1 0.1 0.1" friction="0.9" condim="1" priority="1"/></body>
          <body name="left" pos="0 2 0.1"><freejoint/><geom size="0.1"/></body>
          <body name="right" pos="0.15 2 0.1"><freejoint/><geom size="0.1"/></body>
        </worldbody><contact><exclude body1="left" body2="right"/></contact></mujoco>"#,
    );
    let mut simulation = simulation(&made);
    let run = simulation.run(0.5, 1e-3, &mut ()).unwrap();
    assert!(run.is_solved(), "{run}");
    let scene = table(&made);
    let names: Vec<_> =
        scene["bodies"].as_array().unwrap().iter().map(|b| b["name"].as_str().unwrap()).collect();
    let of = |name: &str| names.iter().position(|n| *n == name).unwrap();
    let v = |name: &str| simulation.state().velocity[of(name)];
    // a = 3 − 0.2 · 10 of the box, 3 without friction; the ghost falls through the plane.
    assert!((v("box")[0] - 0.5).abs() < 1e-9 && (v("smooth")[0] - 1.5).abs() < 1e-9);
    assert!((v("ghost")[2] + 5.0).abs() < 1e-9);
    assert!(v("left")[2].abs() < 1e-9 && (v("left")[0] - v("right")[0]).abs() < 1e-9);
}

/// With `condim` 6 of one of two geoms the third number of `friction`, the larger one, is the coefficient of rolling friction: a = (5/7) g (sin α − mu_r/R cos α).
#[test]
fn balls_of_six_dimensions_resist_rolling() {
    let made = import(
        r#"<mujoco><option timestep="0.001" gravity="0.5 0 -10"/><worldbody>
          <geom type="plane" size="1 1 1" friction="0.5 0.005 0.002"/>
          <body name="held" pos="0 0 0.1"><freejoint/><geom size="0.1" condim="6" friction="0.5 0.005 0.006"/></body>
          <body name="slow" pos="0 1 0.1"><freejoint/><geom size="0.1" condim="6" friction="0.5 0.005 0.001"/></body>
          <body name="free" pos="0 2 0.1"><freejoint/><geom size="0.1" friction="0.5 0.005 0.006"/></body>
        </worldbody></mujoco>"#,
    );
    let mut simulation = simulation(&made);
    let run = simulation.run(0.5, 1e-3, &mut ()).unwrap();
    assert!(run.is_solved(), "{run}");
    let v = |k: usize| simulation.state().velocity[k][0];
    for (k, mu_r) in [(1, 0.006), (2, 0.002), (3, 0.0)] {
        let expected = 5.0 / 7.0 * (0.5_f64 - 10.0 * mu_r / 0.1).max(0.0) * 0.5;
        assert!((v(k) - expected).abs() < 1e-9, "{k}: {} {expected}", v(k));
    }
}

/// Of lists that end early MuJoCo keeps the numbers of the class, of the classes around it, and those built in.
#[test]
fn short_lists_keep_what_classes_say_beyond_their_end() {
    let model = |geom: &str| {
        import(&format!(
            r#"<mujoco><default>
              <geom type="capsule" size="0.1 0.5" friction="0.5 0.1 0.05" condim="6"/>
              <default class="wet"><geom friction="0.3"/></default>
            </default><worldbody><body><freejoint/><geom {geom}/></body></worldbody></mujoco>"#
        ))
    };
    for (geom, [radius, half, mu, rolling]) in [
        (r#"friction="0.8""#, [0.1, 0.5, 0.8, 0.05]),
        (r#"class="wet" size="0.2""#, [0.2, 0.5, 0.3, 0.05]),
        (r#"class="wet" size="0.2 0.3" friction="0.4 0 0.01""#, [0.2, 0.3, 0.4, 0.01]),
    ] {
        let scene = table(&model(geom));
        let shape = &scene["bodies"][0]["shapes"][0]["shape"];
        let law = &scene["pairs_default"];
        let found = [&shape["radius"], &shape["half_length"], &law["mu"], &law["mu_rolling"]];
        near(&found.map(toml::Value::clone).to_vec().into(), &[radius, half, mu, rolling]);
    }
    let follows = |poly: &str| {
        let made = import(&format!(
            r#"<mujoco><default><equality polycoef="0 2 0"/></default><worldbody>
              <body><joint name="h"/><geom pos="1 0 0" size="0.1"/></body>
              <body pos="0 3 0"><joint name="k"/><geom pos="1 0 0" size="0.1"/></body>
            </worldbody><equality><joint joint1="h" joint2="k" {poly}/></equality></mujoco>"#
        ));
        table(&made)["couplings"][0]["terms"][1]["weight"].as_float()
    };
    assert_eq!(follows(r#"polycoef="0""#), Some(-2.0));
    assert_eq!(follows(r#"polycoef="0 3""#), Some(-3.0));
    let long = "<mujoco><worldbody><geom size='1 1 1 1'/></worldbody></mujoco>";
    let error = mjcf(long, Path::new("")).unwrap_err().to_string();
    assert_eq!(error, "<geom> (line 1): expected at most 3 numbers as `size`, found 4");
}

/// Actuators of all kinds have one default in a class. Of gain and bias a shorthand takes over what the same or `general` said last, else what the classes around
/// say. The numbers are those that MuJoCo compiles.
#[test]
fn actuators_of_a_class_share_their_default() {
    let model = |defaults: &str, actuator: &str| {
        import(&format!(
            "<mujoco><default>{defaults}</default><worldbody><body><joint name='j'/>\
             <geom pos='1 0 0' size='0.1'/></body></worldbody>\
             <actuator><{actuator} joint='j'/></actuator></mujoco>"
        ))
    };
    let servo = "<position kp='20' kv='3'/>";
    let general = "<general gainprm='50' biasprm='0 -50 -5'/>";
    let inner = "<default class='c'><velocity kv='4'/></default>";
    for (defaults, actuator, stiffness, damping) in [
        ("<motor gear='3' forcerange='-1 1'/>", "position kp='10'", Some(90.0), 0.0),
        (general, "position", Some(50.0), 5.0),
        (general, "position kp='10'", Some(10.0), 5.0),
        (general, "velocity", None, 50.0),
        (servo, "position kv='2'", Some(20.0), 2.0),
        (servo, "velocity", None, 1.0),
        (&format!("{servo}<motor/>"), "position", Some(1.0), 0.0),
        (&format!("{servo}<general gainprm='5'/>"), "position", Some(5.0), 3.0),
        (&format!("{servo}{inner}"), "position class='c'", Some(20.0), 3.0),
        (&format!("{servo}{inner}"), "velocity class='c'", None, 4.0),
    ] {
        let made = model(defaults, actuator);
        let motor = &table(&made)["joints"][0]["motor"];
        let found = (motor.get("stiffness").and_then(toml::Value::as_float), &motor["damping"]);
        assert_eq!(found, (stiffness, &damping.into()), "{defaults} {actuator}");
        assert!(!said(&made, "is left out"), "{:?}", made.warnings);
        let max = motor.get("max").and_then(toml::Value::as_float);
        assert_eq!(max, defaults.contains("forcerange").then_some(3.0));
    }
    for (defaults, words) in [
        ("<general biasprm='0 -1 1'/>", "<position> (line 1): `dampratio` is left out"),
        ("<position timeconst='1'/>", "<position> (line 1): `timeconst` is left out"),
        ("<general gaintype='affine' gainprm='2 3'/>", ": what <general> (line 1) says of gain"),
        ("<muscle/><general gear='1'/>", ": what <muscle> (line 1) says of gain and bias is left"),
    ] {
        let made = model(defaults, "position");
        assert!(said(&made, words), "{words}: {:?}", made.warnings);
    }
}

/// A hinge with an actuator, at 0.3 rad with a control of 0.8.
fn hinge(head: &str, joint: &str, actuator: &str) -> Result<Imported, String> {
    let text = format!(
        "<mujoco>{head}<worldbody><body><joint name='j' axis='0 1 0' {joint}/><geom pos='1 0 0' size='0.1'/>\
         </body></worldbody><actuator>\n<{actuator} joint='j'/></actuator>\
         <keyframe><key qpos='0.3' ctrl='0.8'/></keyframe></mujoco>"
    );
    mjcf(&text, Path::new("")).map_err(|e| e.to_string())
}

/// What is limited is MuJoCo's: of a range that nothing is said of, one whose numbers rise.
#[test]
fn ranges_that_do_not_rise_are_none() {
    let by_hand = "<compiler autolimits='false'/>";
    let class = "<default><joint range='-9 9'/></default>";
    for (head, joint, limited) in [
        ("", "range='-9 9'", true),
        ("", "range='0 0'", false),
        (class, "range='0 0'", false),
        (class, "", true),
        ("", "range='9 -9'", false),
        ("", "range='-9 9' limited='false'", false),
        (by_hand, "range='-9 9' limited='true'", true),
        (by_hand, "range='0 0'", false),
    ] {
        let made = hinge(head, joint, "position kp='10'").unwrap();
        let found = table(&made)["joints"][0].get("limits").is_some();
        assert_eq!(found, limited, "{head} {joint}");
    }
    for (head, actuator, control, max) in [
        ("", "position kp='10' ctrlrange='0 0' forcerange='0 0'", 0.8, None),
        ("", "position kp='10' ctrlrange='0 0.5' forcerange='-1 1'", 0.5, Some(1.0)),
        ("", "position kp='10' ctrlrange='0 0.5' ctrllimited='false'", 0.8, None),
        (by_hand, "position kp='10' ctrlrange='0 0' forcerange='0 0'", 0.8, None),
        (by_hand, "position kp='10' forcerange='-1 1' forcelimited='true'", 0.8, Some(1.0)),
        (by_hand, "position kp='10' forcerange='-1 1' forcelimited='false'", 0.8, None),
        (
            "<option><flag clampctrl='disable'/></option>",
            "position kp='10' ctrlrange='0 0.5'",
            0.8,
            None,
        ),
    ] {
        let made = hinge(head, "", actuator).unwrap();
        let motor = &table(&made)["joints"][0]["motor"];
        let position = motor["position"].as_float().unwrap();
        assert!((position + 0.3 - control).abs() < 1e-15, "{actuator} {position}");
        assert_eq!(motor.get("max").and_then(toml::Value::as_float), max, "{actuator}");
    }
    for (head, joint, actuator, error) in [
        (
            by_hand,
            "range='-9 9'",
            "motor",
            "<joint> `j` (line 1): expected `limited` beside `range`, without autolimits, found none",
        ),
        (
            by_hand,
            "",
            "position ctrlrange='0 1'",
            "<position> (line 2): expected `ctrllimited` beside `ctrlrange`, without autolimits, found none",
        ),
        (
            by_hand,
            "",
            "position forcerange='0 1'",
            "<position> (line 2): expected `forcelimited` beside `forcerange`, without autolimits, found none",
        ),
        (
            "",
            "range='0 0' limited='true'",
            "motor",
            "<joint> `j` (line 1): expected a number and a larger one as `range`, found `0 0`",
        ),
        (
            "",
            "",
            "position forcelimited='true'",
            "<position> (line 2): expected a number and a larger one as `forcerange`, found none",
        ),
    ] {
        assert_eq!(hinge(head, joint, actuator).unwrap_err(), error);
    }
}

#[test]
fn actuators_that_are_left_out_are_said_to_act_where_they_do() {
    let idle =
        "<motor> (line 2): its control comes from outside, so it does nothing here: left out";
    let acts = "(line 2): left out, with what it does without a control: motors of scenes are";
    for (head, actuator, says) in [
        ("", "motor ctrlrange='-1 0'", idle),
        ("", "motor", "<motor> (line 2): left out, with its control of 0.8"),
        ("", "motor ctrlrange='1 2'", "<motor> (line 2): left out, with its control of 1"),
        ("", "motor armature='1'", "<motor> (line 2): `armature` is left out"),
        ("", "general biastype='affine' biasprm='1 -5 -.2'", acts),
        ("", "intvelocity kp='5' actrange='-1 1'", acts),
        ("", "position damping='1'", "<position> (line 2): `damping` is left out"),
        ("", "velocity delay='0.1' nsample='3'", "<velocity> (line 2): `delay` is left out"),
        ("", "position foo='1'", "<position> (line 2): `foo` is left out"),
        (
            "<option actuatorgroupdisable='1'/><option actuatorgroupdisable='2 3'/>",
            "position group='1'",
            "<position> (line 2): left out: its group is disabled",
        ),
    ] {
        let made = hinge(head, "", actuator).unwrap();
        assert!(said(&made, says), "{actuator}: {:?}", made.warnings);
        let motor = table(&made)["joints"][0].get("motor").is_some();
        let servo = actuator.starts_with("position") || actuator.starts_with("velocity");
        assert_eq!(motor, servo && head.is_empty());
    }
    let general = "<default><general dyntype='filter' dynprm='1'/></default>";
    let made = hinge(general, "", "position kp='10' armature='0' delay='0'").unwrap();
    assert!(!said(&made, "is left out"), "{:?}", made.warnings);
    let error = hinge("<option actuatorgroupdisable='31'/>", "", "motor").unwrap_err();
    assert!(error.starts_with("<option> (line 1): expected whole numbers of 0 to 30"), "{error}");
}

#[test]
fn attributes_of_options_frames_and_inertials_that_are_not_known_are_said() {
    let model = |head: &str| {
        import(&format!(
            "<mujoco>{head}<worldbody><frame poss='1 2 3'><body><freejoint/>\n\
             <inertial mas='3' pos='0 0 0' mass='1' diaginertia='1 1 1'/></body></frame></worldbody></mujoco>"
        ))
    };
    let made = model("<option foo='1' solver='CG' o_margin='1'/><compiler alignfree='true'/>");
    for words in [
        "<option> (line 1): `foo` is left out",
        "<option> (line 1): `o_margin` is left out",
        "<compiler> (line 1): `alignfree` is left out, for `qpos` of a keyframe",
        "<frame> (line 1): `poss` is left out",
        "<inertial> (line 2): `mas` is left out",
    ] {
        assert!(said(&made, words), "{words}: {:?}", made.warnings);
    }
    let made = model("<option cone='elliptic'/><compiler alignfree='false'/>");
    assert!(!said(&made, "<option>") && !said(&made, "alignfree"), "{:?}", made.warnings);
}

/// With the flag all contacts have the friction of the option, MuJoCo's 1 and 1e-4 where it ends early.
#[test]
fn a_flag_puts_the_friction_of_the_option_before_that_of_geoms() {
    let law = |option: &str| {
        let made = import(&format!(
            "<mujoco><option {option}</option><worldbody><geom type='plane' size='1 1 1' friction='0.5'/>\
             <body pos='0 0 1'><freejoint/><geom size='0.1' condim='6' friction='2 1 0.3' priority='1'/>\
             </body></worldbody></mujoco>"
        ));
        let scene = table(&made);
        let of_both = |pair: &&toml::Value| pair["between"][0] != pair["between"][1];
        let law = scene["pairs"].as_array().unwrap().iter().find(of_both).unwrap().clone();
        [law["mu"].as_float().unwrap(), law["mu_rolling"].as_float().unwrap()]
    };
    let on = "<flag override='enable'/>";
    assert_eq!(law("o_friction='.3 .4 .1 .02 .2'>"), [2.0, 0.3]);
    assert_eq!(law(&format!("o_friction='.3 .4 .1 .02 .2'>{on}")), [0.3, 0.02]);
    assert_eq!(law(&format!("o_friction='.3'>{on}")), [0.3, 1e-4]);
    assert_eq!(law(&format!(">{on}")), [1.0, 1e-4]);
}

/// MuJoCo lets a child and its parent pass through each other, also one that moves with all six coordinates.
#[test]
fn a_child_that_moves_freely_passes_through_its_parent() {
    let model = |option: &str| {
        import(&format!(
            "<mujoco><option gravity='0 0 0'>{option}</option><worldbody>\
             <body name='a'><joint axis='0 1 0'/><geom size='0.1' pos='0.01 0 0'/>\
             <body name='b' pos='0.15 0 0'><joint type='slide' axis='1 0 0'/><joint type='slide' axis='0 1 0'/>\
             <joint type='slide' axis='0 0 1'/><joint type='ball'/><geom size='0.1'/></body></body>\
             <body name='c' pos='0 0 1'><freejoint/><geom size='0.1'/></body></worldbody></mujoco>"
        ))
    };
    let made = model("");
    let scene = table(&made);
    let meets = |k: usize, l: usize| {
        let of = |k: usize, name: &str| scene["bodies"][k][name].as_array().unwrap().clone();
        of(k, "collides_with").contains(&of(l, "groups")[0])
    };
    assert!(!meets(0, 1) && !meets(1, 0) && meets(0, 2) && meets(2, 1));
    assert!(simulation(&made).run(0.01, 1e-3, &mut ()).unwrap().is_solved());
    let made = model("<flag filterparent='disable'/>");
    assert!(SceneFile::parse(&made.scene, &[]).unwrap().build().is_err());
}

#[test]
fn keyframes_place_bodies_that_are_led_and_open_welds_are_named() {
    let model = |key: &str| {
        format!(
            r#"<mujoco><worldbody>
              <body name="hand" mocap="true" pos="0 0 1"><geom size="0.1"/>
                <body name="finger" pos="1 0 0"><geom size="0.1"/></body></body>
              <body name="ball" pos="0 0 5"><freejoint/><geom size="0.1"/></body>
            </worldbody><equality><weld body1="hand" body2="ball"/></equality>
            <keyframe><key {key}/></keyframe></mujoco>"#
        )
    };
    let places = |key: &str| {
        let made = import(&model(key));
        let scene = table(&made);
        let of = |k: usize| scene["bodies"][k]["position"].clone();
        ([of(0), of(1), of(2)], made)
    };
    // Half a turn about the third axis.
    let (at, _) = places(r#"mpos="1 2 3" mquat="0 0 0 2""#);
    near(&at[0], &[1.0, 2.0, 3.0]);
    near(&at[1], &[0.0, 2.0, 3.0]);
    near(&at[2], &[0.0, 0.0, 5.0]);
    let (at, made) = places(r#"mpos="1 2 3" qpos="1 2 7 1 0 0 0""#);
    near(&at[1], &[2.0, 2.0, 3.0]);
    near(&at[2], &[1.0, 2.0, 7.0]);
    assert!(!said(&made, "open by"), "{:?}", made.warnings);
    let (_, made) = places(r#"qpos="0 0 5 0 2 0 0""#);
    assert!(said(&made, "<weld> (line 5): open by 8.0e0 m and 3.1e0 rad"), "{:?}", made.warnings);
    let (_, made) = places(r#"mquat="0 0 0 1""#);
    assert!(said(&made, "<weld> (line 5): open by 3.1e0 rad where"), "{:?}", made.warnings);
    for (key, error) in [
        (r#"mpos="1 2""#, "<key> (line 6): expected 3 numbers as `mpos`, found 2"),
        (r#"mquat="0 0 0 0""#, "<key> (line 6): expected a quaternion in the keyframe, found zero"),
    ] {
        assert_eq!(mjcf(&model(key), Path::new("")).unwrap_err().to_string(), error);
    }
}

/// Masses are always of the geoms in the range, but of a body that has none with a mass there.
#[test]
fn an_inertial_counts_where_no_geom_has_a_mass() {
    for (always, geom, mass) in [
        ("true", "group='0'", 7.0),
        ("true", "group='2' mass='3'", 3.0),
        ("true", "group='2' mass='0'", 7.0),
        ("auto", "group='2' mass='3'", 7.0),
        ("false", "group='2' mass='3'", 7.0),
    ] {
        let made = import(&format!(
            "<mujoco><compiler inertiafromgeom='{always}' inertiagrouprange='2 3'/><worldbody><body>\
             <freejoint/><frame pos='0 0 1'><inertial pos='1 2 3' mass='7' diaginertia='1 1 1'/></frame>\
             <geom size='0.1' {geom}/></body></worldbody></mujoco>"
        ));
        let body = &table(&made)["bodies"][0];
        assert_eq!(body["mass"].as_float(), Some(mass), "{always} {geom}");
        near(&body["position"], if mass == 7.0 { &[1.0, 2.0, 4.0] } else { &[0.0; 3] });
    }
}

#[test]
fn a_flag_takes_gravity_away_wherever_it_stands() {
    let gravity = |options: &str| {
        let made = import(&format!(
            "<mujoco>{options}<worldbody><body><freejoint/><geom size='1'/></body></worldbody></mujoco>"
        ));
        table(&made)["gravity"].clone()
    };
    let off = "<option><flag gravity='disable'/></option>";
    let down = "<option gravity='0 0 -1'/>";
    near(&gravity(&format!("{off}{down}")), &[0.0; 3]);
    near(&gravity(&format!("{down}{off}")), &[0.0; 3]);
    let on = "<option><flag gravity='enable'/></option>";
    near(&gravity(&format!("{off}{down}{on}")), &[0.0, 0.0, -1.0]);
}

#[test]
fn equalities_are_joints_and_couplings() {
    let made = import(
        r#"<mujoco><compiler angle="radian"/><default><geom contype="0" conaffinity="0"/></default><worldbody>
          <body name="crank" pos="0 0 1"><joint name="c" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0.2 0 0" size="0.02"/>
            <body name="rod" pos="0.2 0 0"><joint name="r" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0.6 0 0" size="0.02"/></body></body>
          <body name="slider" pos="0.8 0 1"><joint name="s" type="slide" axis="1 0 0"/><geom size="0.05"/></body>
          <body name="bolt" pos="0 1 1"><joint name="turn" axis="0 0 1"/><joint name="lift" type="slide" axis="0 0 1"/><geom type="cylinder" size="0.1 0.2"/></body>
          <body name="still" pos="0 2 1"><joint name="stuck" axis="1 0 0"/><geom pos="0 1 0" size="0.1"/></body>
        </worldbody><equality>
          <connect body1="rod" body2="slider" anchor="0.6 0 0"/>
          <joint joint1="lift" joint2="turn" polycoef="0 0.01"/>
          <joint joint1="stuck"/>
          <weld body1="bolt" body2="still" active="false"/>
        </equality></mujoco>"#,
    );
    let mut simulation = simulation(&made);
    let run = simulation.run(0.3, 1e-3, &mut ()).unwrap();
    assert!(run.is_solved(), "{run}");
    let joints = simulation.joints();
    let x = &simulation.state().position;
    // The slider stays on its line, the far end of the rod on the slider; the bolt turns as it sinks; what is stuck stays.
    assert!(x[2][2] - 1.0 < 1e-9 && (x[2][0] - 0.8).abs() > 1e-3, "{x:?}");
    assert!(joints[3].slide < -1e-5 && (joints[3].slide - 0.01 * joints[3].angle).abs() < 1e-9);
    assert!(joints[4].angle.abs() < 1e-12);
    assert!(said(&made, "<weld> (line 11): not active"), "{:?}", made.warnings);
}

#[test]
fn names_that_are_looked_up_are_of_one_element() {
    let model = |inner: &str| {
        let text = format!("<mujoco><worldbody>\n{inner}\n</worldbody></mujoco>");
        mjcf(&text, Path::new("")).map(|_| ()).map_err(|e| e.to_string())
    };
    let body = |name: &str, joint: &str, geom: &str| {
        format!(
            "<body name='{name}'><freejoint name='{joint}'/>\n<geom name='{geom}' size='1' contype='0' conaffinity='0'/></body>"
        )
    };
    let two = |second: [&str; 3]| {
        model(&format!("{}\n{}", body("a", "j", "g"), body(second[0], second[1], second[2])))
    };
    assert_eq!(two(["b", "k", "h"]), Ok(()));
    // Elements of different tags may share a name, and what has none is not looked up.
    assert_eq!(two(["g", "a", "j"]), Ok(()));
    assert_eq!(two(["", "", ""]), Ok(()));
    for (second, says) in [
        (
            ["a", "k", "h"],
            "<body> `a` (line 4): expected a name of its own, found that of <body> `a` (line 2)",
        ),
        (
            ["b", "j", "h"],
            "<freejoint> `j` (line 4): expected a name of its own, found that of <freejoint> `j` (line 2)",
        ),
        (
            ["b", "k", "g"],
            "<geom> `g` (line 5): expected a name of its own, found that of <geom> `g` (line 3)",
        ),
    ] {
        assert_eq!(two(second), Err(says.to_owned()));
    }
}

#[test]
fn meshes_and_height_fields_are_shapes_and_included_files_are_read() {
    let folder = std::env::temp_dir().join(format!("nonsmooth-mjcf-{}", std::process::id()));
    std::fs::create_dir_all(folder.join("parts")).unwrap();
    // A tetrahedron of volume 1/6, in text.
    let corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]];
    let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let mut stl = String::from("solid t\n");
    for face in faces {
        stl += "facet normal 0 0 0\nouter loop\n";
        for k in face {
            let [x, y, z]: [i32; 3] = corners[k];
            stl += &format!("vertex {x} {y} {z}\n");
        }
        stl += "endloop\nendfacet\n";
    }
    std::fs::write(folder.join("parts/tetra.stl"), stl + "endsolid t\n").unwrap();
    std::fs::write(
        folder.join("body.xml"),
        "<mujocoinclude>\n<body name='b' pos='0 0 2'><freejoint/><geom type='mesh' mesh='tetra' density='600'/></body>\n</mujocoinclude>",
    )
    .unwrap();
    let model = r#"<mujoco><compiler meshdir="parts/"/><asset>
          <mesh file="tetra.stl" scale="2 2 2"/>
          <mesh name="hull" vertex="0 0 0  1 0 0  0 1 0  0 0 1  0.1 0.1 0.1" scale="1 1 -1"/>
          <hfield name="hill" nrow="2" ncol="3" size="3 1 0.5 0.1" elevation="0 0 4  0 2 4"/>
        </asset><worldbody>
          <geom type="hfield" hfield="hill"/>
          <include file="body.xml"/>
          <body name="h" pos="3 0 2"><freejoint/><geom type="mesh" mesh="hull" mass="4"/></body>
        </worldbody></mujoco>"#;
    let made = mjcf(model, &folder).unwrap();
    let scene = table(&made);
    let [ground, mesh, hull] = &scene["bodies"].as_array().unwrap()[..] else { panic!() };
    let heights = ground["shapes"][0]["shape"]["heights"].as_array().unwrap();
    // The first row of the document is the far one.
    near(&heights[0], &[0.0, 0.25, 0.5]);
    near(&heights[1], &[0.0, 0.0, 0.5]);
    assert!((mesh["mass"].as_float().unwrap() - 600.0 * 8.0 / 6.0).abs() < 1e-9);
    near(&mesh["position"], &[0.5, 0.5, 2.5]);
    let shape = &mesh["shapes"][0]["shape"];
    assert_eq!(shape["file"].as_str(), Some("parts/tetra.stl"));
    assert_eq!(shape["scale"].as_float(), Some(2.0));
    near(&hull["position"], &[3.25, 0.25, 1.75]);
    assert_eq!(hull["shapes"][0]["shape"]["vertices"].as_array().unwrap().len(), 4);
    let stripped = model.replace("<mesh file=\"tetra", "<mesh file=\"C:\\else/where/tetra");
    assert!(mjcf(&stripped, &folder).is_err());
    let stripped = stripped.replace("<compiler ", "<compiler strippath=\"true\" ");
    assert_eq!(mjcf(&stripped, &folder).unwrap().scene, made.scene);
    // Mistakes in an included file name it.
    std::fs::write(folder.join("body.xml"), "<x>\n\n<body><geom size='-1'/></body></x>").unwrap();
    let error = mjcf(model, &folder).unwrap_err().to_string();
    assert!(error.starts_with("<geom> (body.xml line 3): expected 1 positive numbers"), "{error}");
    let error = mjcf(&model.replace("tetra.stl", "none.stl"), &folder).map(|_| ());
    assert!(error.is_err());
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn the_models_that_are_compared_with_mujoco_are_scenes() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/mjcf");
    let mut bodies = vec![];
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        let made = mjcf(&std::fs::read_to_string(&path).unwrap(), &folder).unwrap();
        let scene = SceneFile::parse(&made.scene, &[]).unwrap();
        assert!(scene.world().is_ok(), "{}: {:?}", path.display(), scene.world().err());
        bodies.push(scene.bodies.iter().filter(|body| !body.fixed).count());
    }
    bodies.sort_unstable();
    assert_eq!(bodies, [1, 1, 2, 2, 3, 9]);
}

#[test]
fn models_with_mistakes_are_one_line_and_never_a_panic() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/mjcf");
    let models: Vec<String> = ["arm", "cartpole", "loops", "misc"]
        .iter()
        .map(|name| std::fs::read_to_string(folder.join(format!("{name}.xml"))).unwrap())
        .collect();
    let mut random = 1_u64;
    let mut draw = |below: usize| {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (random >> 33) as usize % below
    };
    let words = ["", "-1", "1e308", "0", "nan", "1 2", "x", "\"", "<body>", "free", "ball", "mesh"];
    let mut refused = 0;
    for k in 0..4000 {
        let model = &models[k % models.len()];
        // A word of it becomes another one.
        let mut parts: Vec<&str> = model.split_inclusive([' ', '"', '\n', '>']).collect();
        let (at, word) = (draw(parts.len()), words[draw(words.len())]);
        let end = parts[at].chars().last();
        let kept = match draw(3) {
            0 => word.to_owned(),
            _ => format!("{word}{}", end.map_or(String::new(), String::from)),
        };
        parts[at] = &kept;
        match mjcf(&parts.concat(), &folder) {
            Ok(made) => assert!(SceneFile::parse(&made.scene, &[]).is_ok()),
            Err(error) => {
                refused += 1;
                assert!(!error.to_string().contains('\n'), "{error}");
            }
        }
    }
    assert!(refused > 1000 && refused < 3900, "{refused}");
}

#[test]
fn what_is_not_in_the_subset_is_one_line_with_element_and_line() {
    let body = |inner: &str| {
        format!(
            "<mujoco>\n<worldbody>\n<body name='b'><freejoint/>\n{inner}</body></worldbody></mujoco>"
        )
    };
    let cases = [
        ("<robot/>".to_owned(), "mujoco: expected an MJCF document, found <robot>"),
        ("<mujoco".to_owned(), "mujoco: expected an XML document, found "),
        ("<mujoco/>".to_owned(), "<mujoco> (line 1): expected <worldbody>, found none"),
        ("<mujoco>\n<wheel/></mujoco>".to_owned(), "<wheel> (line 2): expected a part of a model"),
        (body("<composite/>"), "<composite> (line 4): expected body, frame, "),
        (body("<geom type='ellipsoid' size='1 1 1'/>"), "<geom> (line 4): expected plane, sphere,"),
        (body("<geom name='g' type='box' size='1 2'/>"), "<geom> `g` (line 4): expected 3 positive numbers as `size`, found `1 2`"),
        (body("<geom name='g' size='1 x'/>"), "<geom> `g` (line 4): expected finite numbers as `size`, found `1 x`"),
        (body("<geom type='plane' size='1 1 1'/><geom size='1'/>"), "<geom> (line 4): expected a solid of a body that moves"),
        (body("<geom size='1' class='x'/>"), "<geom> (line 4): expected a class of <default>, found `x`"),
        (body(""), "<body> `b` (line 3): expected a mass"),
        (body("<geom size='1'/><body><freejoint/></body>"), "<freejoint> (line 4): expected a free joint of a body in the world"),
        (body("<geom type='mesh' mesh='m'/>"), "<geom> (line 4): expected a mesh of <asset>, found `m`"),
        (body("<geom size='1' quat='1 0 0 0' euler='0 0 0'/>"), "<geom> (line 4): expected one orientation"),
        (
            "<mujoco><asset>\n<mesh name='m' vertex='0 0 0 1 0 0 0 1 0 0 0 1' face='0 2 1 0 1 3.7 0 3 2 1 2 3'/></asset><worldbody><body><freejoint/><geom type='mesh' mesh='m'/></body></worldbody></mujoco>".to_owned(),
            "<mesh> `m` (line 2): expected whole numbers of at least 0 as `face`, found 3.7",
        ),
        (
            "<mujoco><worldbody>\n<body><joint/><joint type='ball'/><geom size='1'/></body></worldbody></mujoco>".to_owned(),
            "<body> (line 2): expected joints that are free, ball, hinge,",
        ),
        ("<mujoco>\n<include file='none.xml'/></mujoco>".to_owned(), "<include> (line 2): expected a readable file"),
        (
            "<mujoco><worldbody><body><freejoint/><geom size='1'/></body></worldbody>\n<keyframe><key qpos='0 0'/></keyframe></mujoco>".to_owned(),
            "<key> (line 2): expected 7 numbers as `qpos`, found 2",
        ),
    ];
    let two = |inner: &str| {
        format!(
            "<mujoco><worldbody>\n<body name='a'><freejoint/><geom name='g' size='1'/>\n<body name='c' pos='2 0 0'>{inner}</body></body>\n<body name='b'><freejoint/><geom name='h' size='1'/></body></worldbody>\n"
        )
    };
    let excluded = "<contact><exclude body1='c' body2='b'/></contact></mujoco>";
    let paired = "<contact><pair geom1='g' geom2='h'/></contact></mujoco>";
    let solid = "<geom name='s' size='.5'/>";
    let cases = cases.into_iter().chain([
        (
            two("<geom name='s' size='.5' contype='0' conaffinity='0'/>")
                + &paired.replace("'g'", "'s'"),
            "<pair> (line 5): expected a geom that touches by its bits as `geom1`",
        ),
        (
            two("<geom name='s' size='.5' mass='-1'/>") + "</mujoco>",
            "<geom> `s` (line 3): expected a mass of at least 0, found -1",
        ),
    ]);
    for (text, begins) in cases {
        let error = mjcf(&text, Path::new("")).unwrap_err().to_string();
        assert!(error.starts_with(begins) && !error.contains('\n'), "{error}\n{begins}");
    }
    let deep = format!(
        "<mujoco><worldbody>{}{}</worldbody></mujoco>",
        "<body>".repeat(300),
        "</body>".repeat(300)
    );
    assert!(mjcf(&deep, Path::new("")).is_err());
    // A body that excludes as a whole, and a pair that touches without saying so, are neither.
    let made = import(&(two("<site/>") + &excluded.replace("'c'", "'a'")));
    assert!(!said(&made, "exclude"), "{:?}", made.warnings);
    let lifted = two("<geom size='.5'/>").replace("name='c'", "name='c' gravcomp='1'");
    let made = import(&(lifted + "</mujoco>"));
    assert!(said(&made, "<body> `a` (line 2): `gravcomp` of a part"), "{:?}", made.warnings);
    let made = import(&(two(solid) + excluded));
    assert!(
        said(&made, "<exclude> (line 5): of `c` all that moves with it is excluded, too"),
        "{:?}",
        made.warnings
    );
    let made = import(&(two("<geom size='.5' contype='2'/>") + paired));
    assert!(said(&made, "<pair> (line 5): left out"), "{:?}", made.warnings);
    assert!(said(&made, "(line 3): other bits than those of other geoms"), "{:?}", made.warnings);
    let made = import(
        &body("<geom size='1' fluidshape='none' odd='1'/>")
            .replace("<freejoint/>", "<joint type='ball' damping='2'/>"),
    );
    assert!(said(&made, "<geom> (line 4): `odd` is left out"), "{:?}", made.warnings);
    assert!(said(&made, "<joint> (line 3): `damping` is left out"), "{:?}", made.warnings);
}

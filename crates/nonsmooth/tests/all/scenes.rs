//! The scenes of examples/scenes: each step solved, the energy accounted for, and the number that each has to meet.

use std::path::Path;

use nonsmooth::simulate::{RunReport, SceneFile, Simulation, StepReport};

/// A scene after its run; `watch` sees each step.
fn run(name: &str, mut watch: impl FnMut(&Simulation, &StepReport)) -> (Simulation, RunReport) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/scenes");
    let text = std::fs::read_to_string(folder.join(name).with_extension("toml")).unwrap();
    let scene = SceneFile::parse(&text, &[]).unwrap_or_else(|e| panic!("{name}: {e}"));
    let mut simulation = scene.build().unwrap_or_else(|e| panic!("{name}: {e}"));
    let mut see = |simulation: &Simulation, report: &StepReport| {
        watch(simulation, report);
        nonsmooth::simulate::Control::Continue
    };
    let report = simulation.run(scene.time.end, scene.time.h, &mut see).unwrap();
    assert!(report.is_solved(), "{name}: {report}");
    assert!(report.residual <= 1e-10, "{name}: {report}");
    assert!(report.imbalance <= 1e-12, "{name}: {report}");
    (simulation, report)
}

fn place(simulation: &Simulation, name: &str) -> usize {
    simulation.world().bodies.iter().position(|b| b.name == name).expect("a body of this name")
}

#[test]
fn every_scene_has_a_test() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/scenes");
    let tests = include_str!("scenes.rs");
    let mut count = 0;
    for file in std::fs::read_dir(folder).unwrap() {
        let path = file.unwrap().path();
        if path.extension().is_some_and(|e| e == "toml") {
            let name = path.file_stem().unwrap().to_string_lossy().into_owned();
            assert!(tests.contains(&format!("run(\"{name}\"")), "{name}");
            let page = include_str!("../../../../examples/scenes/README.md");
            assert!(page.contains(&format!("({name}.toml)")), "README.md: {name}");
            assert!(page.contains(&format!("({name}.svg)")), "README.md: {name}");
            assert!(path.with_extension("svg").exists(), "bash examples/scenes/make.sh: {name}");
            count += 1;
        }
    }
    assert!(count >= 10);
}

/// The threshold of friction between logs is tan 15°.
#[test]
fn a_log_pile_stands_just_above_its_friction_and_falls_just_below() {
    let top = |simulation: &Simulation| simulation.state().position[place(simulation, "top")];
    let (stands, _) = run("log_pile", |_, _| {});
    let start = 0.2 + 0.2 * 3.0_f64.sqrt();
    assert!((top(&stands)[1] - start).abs() < 1e-9, "{:?}", top(&stands));
    assert!(stands.state().velocity.iter().flatten().all(|v| v.abs() < 1e-8));
    let text = include_str!("../../../../examples/scenes/log_pile.toml");
    let scene = SceneFile::parse(text, &["pairs[0].mu=0.26785"]).unwrap();
    let mut falls = scene.build().unwrap();
    let report = falls.run(scene.time.end, scene.time.h, &mut ()).unwrap();
    assert!(report.is_solved() && top(&falls)[1] < start - 1e-3, "{:?}", top(&falls));
}

#[test]
fn dominoes_fall_on_each_other() {
    let (simulation, _) = run("dominoes", |_, _| {});
    for k in 1..=5 {
        let [w, _, _, z] = simulation.state().rotation[place(&simulation, &format!("domino {k}"))];
        let angle = 2.0 * z.atan2(w);
        assert!(-2.0 < angle && angle < -0.5, "{k}: {angle}");
    }
}

/// Its centre goes v²/(2 mu g), and it leans by millimetres on the way, and sways a little at the end.
#[test]
fn a_rubber_block_slides_to_a_stop() {
    let mut lean: f64 = 0.0;
    let (simulation, _) = run("rubber_block", |simulation, _| {
        let x = &simulation.state().elastic[0].displacement;
        lean = lean.max(x[x.len() - 1][0] - x[0][0]);
    });
    let state = &simulation.state().elastic[0];
    let mean = |x: &[[f64; 3]]| x.iter().map(|x| x[0]).sum::<f64>() / x.len() as f64;
    let way = 1.5 * 1.5 / (2.0 * 0.5 * 9.81);
    assert!((mean(&state.displacement) / way - 1.0).abs() < 0.02, "{}", mean(&state.displacement));
    assert!(mean(&state.velocity).abs() < 1e-2 && lean > 1e-3, "{lean}");
}

/// The centre rests, the inclination stays, the point of contact runs round with Ω² = 4 g / (a sin α).
#[test]
fn a_disc_rolls_on_its_rim() {
    let mut far: f64 = 0.0;
    let mut last = [0.1, 0.0];
    let mut turned = 0.0;
    run("rolling_disc", |simulation, _| {
        let [x, y, z] = simulation.state().position[1];
        far = far.max(x.hypot(y)).max((z - 0.05).abs());
        let [px, py, _] = simulation.contacts()[0].point;
        turned += (last[0] * py - last[1] * px).atan2(last[0] * px + last[1] * py);
        last = [px, py];
    });
    assert!(far < 2e-3, "{far}");
    let expected: f64 = 0.5 * 28.014282072;
    assert!((turned.abs() - expected).abs() < 5e-3 * expected, "{turned}");
}

/// At rest from t = √(2z/g) (1 + e)/(1 − e) = 1.354571 s on; half of the speed, so a quarter of the energy, after the first impact.
#[test]
fn a_bouncing_ball_comes_to_rest_in_time() {
    let mut last = 0.0;
    let (simulation, _) = run("bouncing_ball", |simulation, report| {
        if simulation.state().velocity[1][2].abs() > 1e-9 {
            last = report.t;
        }
    });
    assert!((last - 1.35457092295719).abs() < 0.01, "{last}");
    let height = simulation.state().position[1][2];
    assert!((height - 0.1).abs() < 1e-5, "{height}");
    let force = simulation.contacts()[0].impulse[0] / 1e-3;
    let weight = simulation.world().bodies[1].mass * 9.81;
    assert!((force - weight).abs() <= 1e-9 * weight);
}

#[test]
fn the_last_ball_of_a_cradle_leaves_with_the_speed() {
    let (simulation, _) = run("newtons_cradle", |_, _| {});
    let speeds: Vec<f64> = simulation.state().velocity.iter().map(|v| v[0]).collect();
    for (k, speed) in speeds.iter().enumerate() {
        let expected = if k == 4 { 1.0 } else { 0.0 };
        assert!((speed - expected).abs() < 1e-9, "{speeds:?}");
    }
}

/// η = 1 − (3/2) sin² α at the first impact on the other edge.
#[test]
fn a_rocking_block_loses_what_housner_says() {
    let mut spins = vec![];
    run("rocking_block", |simulation, _| {
        let block = place(simulation, "block");
        spins.push(simulation.state().spin[block][1]);
    });
    // The largest loss of angular velocity from one step to the next.
    let drop = |k: &usize| (spins[*k] - spins[*k - 1]).abs();
    let k = (1..spins.len() / 2).max_by(|a, b| drop(a).total_cmp(&drop(b))).unwrap();
    let eta = spins[k] / spins[k - 1];
    assert!((eta - 0.911764705882).abs() < 2e-3, "{eta}");
}

#[test]
fn a_sliding_ball_rolls_with_five_sevenths() {
    let mut rolls = None;
    let (simulation, _) = run("sliding_to_rolling", |simulation, report| {
        if report.counts.stick == 1 && rolls.is_none() {
            rolls = Some(simulation.state().t);
        }
    });
    let ball = place(&simulation, "ball");
    let [v, _, _] = simulation.state().velocity[ball];
    assert!((v - 15.0 / 7.0).abs() < 1e-10, "{v}");
    assert!((rolls.unwrap() - 0.291247997670).abs() <= 2e-3, "{rolls:?}");
}

#[test]
fn a_box_takes_the_speed_of_the_belt() {
    let mut arrives = f64::NAN;
    run("conveyor", |simulation, report| {
        let v = simulation.state().velocity[place(simulation, "box")][0];
        if arrives.is_nan() && v >= 2.0 - 1e-9 {
            arrives = report.t;
        }
    });
    assert!((arrives - 0.679578661230).abs() <= 2e-3, "{arrives}");
}

/// A ω² = 3.95 m/s² is more than mu g = 2.94: the blocks slide, but never faster than the table could make them.
#[test]
fn blocks_slide_on_a_shaking_table() {
    let mut slipping = 0;
    let (simulation, _) = run("shaking_table", |_, report| {
        slipping += usize::from(report.counts.slip > 0);
    });
    assert!(slipping > 100, "{slipping}");
    for name in ["lower block", "middle block", "upper block"] {
        let v = simulation.state().velocity[place(&simulation, name)];
        assert!(v[0].abs() <= 0.1 * std::f64::consts::TAU, "{name} {v:?}");
    }
}

#[test]
fn an_arch_stands() {
    let (simulation, report) = run("arch", |_, _| {});
    for (body, v) in simulation.world().bodies.iter().zip(&simulation.state().velocity) {
        assert!(v.iter().all(|v| v.abs() < 1e-8), "{} {v:?}", body.name);
    }
    assert!(report.penetration < 1e-9);
}

#[test]
fn a_ball_knocks_over_a_tower() {
    let (simulation, _) = run("kapla_tower", |_, _| {});
    let moved = simulation.world().bodies.iter().zip(&simulation.state().position);
    let moved = moved.filter(|(b, x)| b.is_free() && (b.position[0] - x[0]).abs() > 0.005);
    assert!(moved.count() > 2);
}

#[test]
fn a_heap_of_balls_runs_out() {
    let radius = |simulation: &Simulation| {
        let free = simulation.world().bodies.iter().zip(&simulation.state().position);
        let free = free.filter(|(b, _)| b.is_free());
        free.map(|(_, x)| x[0].hypot(x[1])).fold(0.0, f64::max)
    };
    let mut first = None;
    let (simulation, _) = run("granular_collapse", |simulation, _| {
        first.get_or_insert(radius(simulation));
    });
    assert!(radius(&simulation) > 1.05 * first.unwrap());
}

/// 600 N on four boxes of 8 kg: the friction of three boxes' weights and of four on the floor lets the lowest one slip away from under them.
#[test]
fn the_lowest_box_slips_out_under_the_others() {
    let (simulation, _) = run("pushed_stack", |_, _| {});
    let x = |name: &str| simulation.state().position[place(&simulation, name)][0];
    assert!(x("box 1") > x("box 2") + 0.01, "{} {}", x("box 1"), x("box 2"));
    assert!(x("box 2") > 0.001);
}

/// The motor turns the crank until the rocker is at its limit; where the crank then is follows from the lengths of the links.
#[test]
fn a_four_bar_stalls_at_its_limit() {
    let (simulation, report) = run("four_bar", |_, _| {});
    let joints = simulation.joints();
    assert!((joints[3].angle - 0.3).abs() < 2e-3, "{:?}", joints[3]);
    // The links from the pivots: crank at φ, rocker at ψ, 0.5 m between their heads.
    let z = (0.16 + 0.5824_f64.sqrt()) / 2.32;
    let first = z.atan2(0.4 * z - 0.2);
    let psi = first + joints[3].angle;
    let head = [0.5 + 0.4 * psi.cos(), 0.4 * psi.sin()];
    let phi = std::f64::consts::FRAC_PI_2 + joints[0].angle;
    let far = (head[0] - 0.2 * phi.cos()).hypot(head[1] - 0.2 * phi.sin());
    assert!((far - 0.5).abs() < 1e-8, "{far}");
    // It pushes with all it has: 2 N·m about −y.
    assert!((joints[0].moment[1] / 1e-3 + 2.0).abs() < 1e-9, "{:?}", joints[0]);
    assert!(simulation.state().spin.iter().flatten().all(|w| w.abs() < 1e-8));
    assert!(joints.iter().all(|j| j.violation < 1e-12) && report.steps == 1000);
}

#[test]
fn a_slider_follows_its_crank() {
    let (l1, l2): (f64, f64) = (0.153, 0.306);
    let mut worst: f64 = 0.0;
    run("slider_crank", |simulation, report| {
        let slider = place(simulation, "slider");
        let (s, c) = (10.0 * report.t).sin_cos();
        let exact = l1 * c + (l2 * l2 - l1 * l1 * s * s).sqrt();
        worst = worst.max((simulation.state().position[slider][0] - exact).abs());
    });
    assert!(worst < 1e-10, "{worst:e}");
}

/// A motor turns the arm at 1 rad/s, the arm pushes a box of 1.44 kg: friction on the floor takes mu m g along the way of the box, and more for what it turns and
/// for the hand that slides along it.
#[test]
fn an_arm_pushes_a_box() {
    let (mut way, mut friction, mut last) = (0.0, 0.0, None);
    let (simulation, _) = run("sweeper", |simulation, report| {
        let x = simulation.state().position[place(simulation, "box")];
        let last = last.replace(x).unwrap_or(x);
        way += (x[0] - last[0]).hypot(x[1] - last[1]);
        friction -= report.energy.tangential;
    });
    let share = friction / (0.4 * 1.44 * 9.81 * way);
    assert!((1.0..1.3).contains(&share) && way > 0.3, "{share} {way}");
    let shoulder = simulation.joints()[0];
    let spin = simulation.state().spin[place(&simulation, "arm")][2];
    assert!((spin - 1.0).abs() < 1e-6, "{spin}");
    // All its torque goes through the joint: friction, damper and push together.
    assert!(shoulder.violation < 1e-12 && shoulder.angle > 1.0, "{shoulder:?}");
}

/// Rolling friction slows each ball down by (5/7) mu_r g/R, until it rests.
#[test]
fn balls_roll_out() {
    let mut rolled = [0; 2];
    let (simulation, _) = run("rolling_resistance", |simulation, report| {
        let resting = simulation.state().velocity.iter().filter(|v| v[0].abs() < 1e-12).count();
        rolled[0] += usize::from(report.counts.roll == 2);
        // The floor rests too.
        rolled[1] += usize::from(resting == 3);
    });
    for (name, mu_r) in [("steel", 0.002), ("wood", 0.004)] {
        let [x, _, _] = simulation.state().position[place(&simulation, name)];
        let slower = 5.0 / 7.0 * mu_r * 9.81 / 0.1;
        let far = 0.25 / (2.0 * slower);
        assert!((x - far).abs() < 1e-3, "{name}: {x}, {far} expected");
    }
    let [x, _, _] = simulation.state().position[place(&simulation, "glass")];
    assert!((x - 0.5 * 3.75).abs() < 1e-8, "{x}");
    // Steps of 1 ms: both roll for 1.784 s, both rest after 3.568 s.
    assert!(
        (rolled[0] as f64 - 1784.0).abs() < 4.0 && (rolled[1] as f64 - 182.0).abs() < 4.0,
        "{rolled:?}"
    );
}

//! Elastic boxes of scenes against closed forms.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use nonsmooth_simulate::{BodyId, Control, SceneFile, Simulation, StepReport, StepStatus};
use nonsmooth_solve::{Limit, Limits, Status};

use crate::verification::near;

fn scene(text: &str) -> SceneFile {
    let head = "format = \"nonsmooth-scene\"\nversion = 1\n";
    SceneFile::parse(&format!("{head}{text}"), &[]).unwrap()
}

/// A bar that hits a plane with one of its ends: contact time and velocity of the centre after the rebound.
fn rebound(elements: usize) -> (f64, f64, f64) {
    const SPEED: f64 = -0.1;
    const DENSITY: f64 = 7800.0;
    let half = 0.5 * 3.14e-4_f64.sqrt();
    let scene = scene(&format!(
        "gravity = [0, 0, 0]
         time = {{ h = 1e-6, end = 1.2e-3 }}
         solver = {{ tol = 1e-12 }}
         pairs_default = {{}}
         [[bodies]]
         name = 'wall'
         shape = {{ kind = 'plane', normal = [1, 0, 0] }}
         fixed = true
         [[elastic]]
         name = 'bar'
         half = [0.5, {half}, {half}]
         divisions = [{elements}, 1, 1]
         young = 210e9
         density = {DENSITY}
         position = [0.50005, 0, 0]
         velocity = [{SPEED}, 0, 0]"
    ));
    let mut bar = scene.build().unwrap();
    let (mut first, mut last, mut impulse) = (0.0, 0.0, 0.0);
    let start = 0.5 * DENSITY * 3.14e-4 * SPEED * SPEED;
    let mut watch = |s: &Simulation, r: &StepReport| {
        assert!(r.energy.kinetic + r.energy.potential <= start * (1.0 + 1e-9));
        let force: f64 = s.contacts().iter().map(|c| c.impulse[0]).sum();
        if force > 0.0 {
            first = if impulse == 0.0 { r.t } else { first };
            last = r.t;
        }
        impulse += force;
        Control::Continue
    };
    let run = bar.run(scene.time.end, scene.time.h, &mut watch).unwrap();
    assert!(run.is_solved() && run.imbalance <= 1e-9, "{run}");
    let v = &bar.state().elastic[0].velocity;
    let sections: Vec<f64> = (0..=elements).map(|i| v[i][0]).collect();
    let ends = 0.5 * (sections[0] + sections[elements]);
    let mean = (sections.iter().sum::<f64>() - ends) / elements as f64;
    (last - first, mean, impulse)
}

#[test]
fn a_bar_rebounds_from_a_wall_by_its_own_waves() {
    let (contact, speed, _) = rebound(10);
    near(contact, 3.94e-4, 2e-6);
    near(speed, 0.0928, 1e-4);
    let (contact, speed, impulse) = rebound(100);
    near(contact, 3.88e-4, 2e-6);
    near(speed, 0.09844, 1e-5);
    near(impulse, 7800.0 * 3.14e-4 * (0.1 + speed), 1e-6);
}

const BLOCK: &str = "
    [[elastic]]
    name = 'block'
    half = [0.1, 0.05, 0.1]
    divisions = [4, 2, 4]
    young = 1e6
    density = 1000
    material = 'rubber'
    position = [0, 0, 0.1]
";
const FLOOR: &str = "
    [materials.rubber]
    [materials.stone]
    density = 2000
    [[pairs]]
    between = ['rubber', 'stone']
    mu = 0.5
    [[bodies]]
    name = 'floor'
    shape = { kind = 'plane' }
    material = 'stone'
    fixed = true
";
const WEIGHT: f64 = 1000.0 * 0.2 * 0.1 * 0.2 * 9.81;

#[test]
fn a_block_at_rest_presses_with_its_weight_and_is_lower_as_in_statics() {
    let time = "time = { h = 0.05, end = 4.0 }\nintegrator = { theta = 1.0 }";
    let scene = scene(&[time, FLOOR, BLOCK].concat());
    let mut block = scene.build().unwrap();
    let run = block.run(scene.time.end, scene.time.h, &mut ()).unwrap();
    assert!(run.is_solved() && run.imbalance <= 1e-10, "{run}");
    let pressed: f64 = block.contacts().iter().map(|c| c.impulse[0] / scene.time.h).sum();
    near(pressed / WEIGHT, 1.0, 1e-9);
    assert!(block.contacts().iter().all(|c| c.a == BodyId(0) && c.b == BodyId(1)));
    // ρ g L²/(2 E), for Poisson's ratio is zero.
    let top = block.state().elastic[0].displacement.last().unwrap()[2];
    near(top / (-1000.0 * 9.81 * 0.04 / 2e6), 1.0, 1e-6);
}

#[test]
fn a_block_slides_as_far_as_friction_lets_it() {
    let time = "time = { h = 1e-3, end = 0.5 }";
    let scene = scene(
        &[time, FLOOR, BLOCK, "velocity = [1, 0, 0]\ndamping = { stiffness = 2e-3 }"]
            .concat()
            .replace("young = 1e6", "young = 1e7"),
    );
    let mut block = scene.build().unwrap();
    let run = block.run(scene.time.end, scene.time.h, &mut ()).unwrap();
    assert!(run.is_solved() && run.imbalance <= 1e-10, "{run}");
    let state = &block.state().elastic[0];
    let n = state.displacement.len() as f64;
    let mean = |x: &[[f64; 3]]| x.iter().map(|x| x[0]).sum::<f64>() / n;
    // v²/(2 mu g)
    near(mean(&state.displacement) / (1.0 / (2.0 * 0.5 * 9.81)), 1.0, 0.01);
    near(mean(&state.velocity), 0.0, 1e-6);
}

#[test]
fn a_rigid_slab_lies_on_a_held_block() {
    let slab = "
        [[pairs]]
        between = ['stone', 'stone']
        [[bodies]]
        name = 'slab'
        shape = { kind = 'box', half = [0.2, 0.1, 0.02] }
        material = 'stone'
        position = [0, 0, 0.22]
    ";
    let time =
        "gravity = [0, 0, -9.81]\ntime = { h = 0.02, end = 3.0 }\nintegrator = { theta = 1.0 }";
    let scene = scene(&[time, FLOOR, slab, BLOCK, "held = ['-z']"].concat());
    let mut held = scene.build().unwrap();
    let run = held.run(scene.time.end, scene.time.h, &mut ()).unwrap();
    assert!(run.is_solved() && run.imbalance <= 1e-10, "{run}");
    let weight = 2000.0 * 0.4 * 0.2 * 0.04 * 9.81;
    let on_block = held.contacts().iter().filter(|c| c.b == BodyId(2) && c.a == BodyId(1));
    let pressed: f64 = on_block.map(|c| -c.world_impulse()[2] / scene.time.h).sum();
    near(pressed / weight, 1.0, 1e-9);
    // The weight of the slab on the section, and the block's own, on the way from the centre of the slab.
    let down = weight * 0.2 / (0.02 * 1e6) + 1000.0 * 9.81 * 0.04 / 2e6;
    near((0.22 - held.state().position[1][2]) / down, 1.0, 0.02);
}

#[test]
fn a_run_with_an_elastic_block_goes_on_from_a_checkpoint_bit_for_bit() {
    let time = "time = { h = 1e-3, end = 0.1 }";
    let scene = scene(&[time, FLOOR, BLOCK, "velocity = [1, 0, -1]"].concat());
    let mut whole = scene.build().unwrap();
    whole.run(0.05, 1e-3, &mut ()).unwrap();
    let mut second = scene.build().unwrap();
    second.restore(&whole.checkpoint()).unwrap();
    whole.run(0.1, 1e-3, &mut ()).unwrap();
    second.run(0.1, 1e-3, &mut ()).unwrap();
    assert_eq!(whole.state(), second.state());
}

#[test]
fn what_elastic_boxes_do_not_do_is_an_error_by_name() {
    let time = "time = { h = 1e-3, end = 0.5 }";
    let one = scene(&[time, FLOOR, BLOCK].concat());
    let error = one.build_settled().map(drop).unwrap_err().to_string();
    assert!(error.contains("rigid bodies alone"), "{error}");
    let sunk = BLOCK.replace("0, 0, 0.1]", "0, 0, 0.09]");
    let error = scene(&[time, FLOOR, &sunk].concat()).build().map(drop).unwrap_err().to_string();
    assert!(error.contains("`floor` and `block`"), "{error}");
    let rolling = FLOOR.replace("mu = 0.5", "mu = 0.5\nmu_rolling = 0.1");
    let error = scene(&[time, &rolling, BLOCK].concat()).build().map(drop).unwrap_err().to_string();
    assert!(error.starts_with("pairs[0].mu_rolling: expected 0, for elastic[0]"), "{error}");
    let all = [time, "\n[pairs_default]\nmu_rolling = 0.1", FLOOR, BLOCK].concat();
    let error = scene(&all).build().map(drop).unwrap_err().to_string();
    assert!(error.starts_with("pairs_default.mu_rolling: expected 0"), "{error}");
}

/// A limit that ends a step while the solids are prepared, which takes long where they are large, ends it as cancelled: nothing has lost its numbers.
#[test]
fn a_limit_while_solids_are_prepared_is_no_loss_of_numbers() {
    let scene = scene(
        "time = { h = 1e-3, end = 1 }
         pairs_default = {}
         [[bodies]]
         name = 'floor'
         shape = { kind = 'plane' }
         fixed = true
         [[elastic]]
         name = 'cube'
         half = [0.5, 0.5, 0.5]
         divisions = [8, 8, 8]
         young = 1e7
         density = 1000
         position = [0, 0, 0.5]",
    );
    let flag = Arc::new(AtomicBool::new(false));
    let limits = Limits { cancel: Some(flag.clone()), ..Limits::default() };
    let mut cube = scene.build().unwrap().with_limits(limits);
    flag.store(true, Ordering::Relaxed);
    let cancelled = StepStatus::Solver(Status::Limit(Limit::Cancelled));
    assert_eq!(cube.step(1e-3).unwrap().status, cancelled);
    flag.store(false, Ordering::Relaxed);
    assert_eq!(cube.step(1e-3).unwrap().status, StepStatus::Solved);
}

/// What moves far and strains nothing feels no spring back to where it began, and keeps its momentum however stiff it is for the step.
#[test]
fn a_stiff_box_that_flies_far_keeps_its_velocity_and_energy() {
    for h in [1e-2, 1e-3] {
        let scene = scene(&format!(
            "gravity = [0, 0, -9.81]
             time = {{ h = {h}, end = 2 }}
             pairs_default = {{}}
             [[elastic]]
             half = [0.001, 0.001, 0.001]
             divisions = [4, 4, 4]
             young = 2.1e11
             poisson = 0.3
             density = 7800
             velocity = [1, 0, 0]"
        ));
        let mut cube = scene.build().unwrap();
        let mut worst = 0.0_f64;
        let mut watch = |_: &Simulation, r: &StepReport| {
            let t = r.t;
            let kinetic = 0.5 * 7800.0 * 8e-9 * (1.0 + (9.81 * t).powi(2));
            worst = worst.max((r.energy.kinetic / kinetic - 1.0).abs());
            Control::Continue
        };
        let run = cube.run(scene.time.end, scene.time.h, &mut watch).unwrap();
        assert!(run.is_solved() && run.imbalance <= 1e-10, "{run}");
        assert!(worst < 1e-9, "h = {h}: {worst:e}");
        let state = &cube.state().elastic[0];
        // Of the mass of an element each of its eight nodes has the same part.
        let share = |node: usize| {
            let at = [node % 5, node / 5 % 5, node / 25];
            at.iter().map(|i| if i % 4 == 0 { 0.5 } else { 1.0 }).product::<f64>() / 64.0
        };
        let each = || state.velocity.iter().enumerate();
        let whole = |k: usize| each().map(|(node, v)| share(node) * v[k]).sum::<f64>();
        near(whole(0), 1.0, 1e-9);
        near(whole(2), -19.62, 1e-9);
        for (v, x) in state.velocity.iter().zip(&state.displacement) {
            // The nodes tremble by rounding, which nothing damps.
            near(v[0], 1.0, 1e-6);
            near(v[2], -19.62, 1e-6);
            near(x[0], 2.0, 1e-9);
            near(x[1], 0.0, 1e-9);
        }
    }
}

/// Damping by mass slows down what moves as a whole, by stiffness it does not.
#[test]
fn damping_by_mass_is_that_of_the_whole() {
    let (alpha, h) = (0.5_f64, 1e-2_f64);
    let scene = scene(&format!(
        "gravity = [0, 0, 0]
         time = {{ h = {h}, end = 1 }}
         pairs_default = {{}}
         [[elastic]]
         half = [0.1, 0.2, 0.1]
         divisions = [2, 4, 2]
         young = 1e9
         density = 1000
         damping = {{ mass = {alpha}, stiffness = 1e-3 }}
         velocity = [0, 3, 0]"
    ));
    let mut block = scene.build().unwrap();
    block.run(scene.time.end, scene.time.h, &mut ()).unwrap();
    // θ = 1/2.
    let step = (1.0 - 0.5 * h * alpha) / (1.0 + 0.5 * h * alpha);
    block.state().elastic[0].velocity.iter().for_each(|v| near(v[1], 3.0 * step.powi(100), 1e-10));
}

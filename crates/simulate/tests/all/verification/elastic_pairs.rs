//! Elastic boxes that touch each other, against closed forms.

use nonsmooth_scenes::{ElasticBox, Material};
use nonsmooth_simulate::{
    Activation, BodyId, Control, Elastic, Law, MoreauJean, RunReport, SceneFile, Simulation,
    StepReport, World,
};

use crate::verification::{G, near};

fn solid(
    sides: [f64; 3],
    elements: [usize; 3],
    centre: [f64; 3],
    material: Material,
) -> ElasticBox {
    let mut solid = ElasticBox::new(sides, elements, material).unwrap();
    solid.position = centre;
    solid.lumped = true;
    solid
}

fn material(density: f64, young: f64, poisson: f64) -> Material {
    Material { density, young, poisson, alpha: 0.0, beta: 0.0 }
}

/// Every step solved, and its energy accounted for.
#[track_caller]
fn check(run: &RunReport) {
    assert!(run.is_solved() && run.residual <= 1e-10 && run.imbalance <= 1e-9, "{run}");
}

const WIDE: f64 = 0.2;
const HIGH: f64 = 0.1;
const YOUNG: f64 = 1e6;
const DENSITY: f64 = 1000.0;
const WEIGHT: f64 = DENSITY * WIDE * WIDE * HIGH * G;

/// A block on one that is held, at rest; each has these elements along a horizontal axis.
fn stacked(below: usize, above: usize) -> Simulation {
    let mut world = World::new([0.0, 0.0, -G]).with_law(Law::friction(0.5));
    let sides = [WIDE, WIDE, HIGH];
    let stone = material(DENSITY, YOUNG, 0.0);
    let mut low = solid(sides, [below, below, 2], [0.0, 0.0, 0.5 * HIGH], stone);
    low.hold_bottom();
    world.add_elastic(Elastic::new(low));
    let high = solid(sides, [above, above, 2], [0.0, 0.0, 1.5 * HIGH], stone);
    world.add_elastic(Elastic::new(high));
    // Long implicit steps damp all that moves, and gaps are closed exactly.
    let scheme = MoreauJean { theta: 1.0, activation: Activation::Gap, ..MoreauJean::default() };
    let mut simulation = Simulation::new(world, scheme).unwrap();
    check(&simulation.run(60.0 * 0.05, 0.05, &mut ()).unwrap());
    simulation
}

/// Of the upper block on the nodes of the finer mesh, N, by their places.
fn pressed(s: &Simulation) -> Vec<([f64; 3], f64)> {
    let contacts = s.contacts().iter().filter(|c| c.active);
    contacts.map(|c| (c.point, c.world_impulse()[2].abs() / 0.05)).collect()
}

#[test]
fn a_block_on_a_block_presses_uniformly_where_the_meshes_match() {
    let n = 4;
    let simulation = stacked(n, n);
    let forces = pressed(&simulation);
    assert_eq!(forces.len(), (n + 1).pow(2));
    near(forces.iter().map(|f| f.1).sum::<f64>() / WEIGHT, 1.0, 1e-9);
    // A node has the pressure on its share of the area: all, half or a quarter of that of an element.
    for (x, force) in forces {
        let inner = |x: f64| if x.abs() > 0.49 * WIDE { 0.5 } else { 1.0 };
        let share = inner(x[0]) * inner(x[1]) / (n * n) as f64;
        near(force / (WEIGHT * share), 1.0, 1e-6);
    }
    // The lower one is shorter by W L/(E A) of the upper one and ρ g L²/(2 E) of its own, the top by as much more as the upper one is.
    let own = DENSITY * G * HIGH * HIGH / (2.0 * YOUNG);
    let state = &simulation.state().elastic;
    let top = |k: usize| state[k].displacement.last().unwrap()[2];
    near(top(0) / -(3.0 * own), 1.0, 1e-6);
    near(top(1) / -(4.0 * own), 1.0, 1e-6);
}

#[test]
fn where_meshes_do_not_match_the_weight_is_carried_but_not_uniformly() {
    for (below, above) in [(4, 6), (6, 4), (3, 5)] {
        let simulation = stacked(below, above);
        let forces = pressed(&simulation);
        near(forces.iter().map(|f| f.1).sum::<f64>() / WEIGHT, 1.0, 1e-9);
        let n = below.max(above);
        assert_eq!(forces.len(), (n + 1).pow(2));
        let off = forces.iter().map(|(x, force)| {
            let inner = |x: f64| if x.abs() > 0.49 * WIDE { 0.5 } else { 1.0 };
            force * (n * n) as f64 / (WEIGHT * inner(x[0]) * inner(x[1])) - 1.0
        });
        let off = off.fold(0.0_f64, |m, x| m.max(x.abs()));
        // What nodes at faces do to a uniform pressure: known, and not hidden.
        assert!((0.05..0.25).contains(&off), "{below} on {above}: {off}");
    }
}

#[test]
fn two_equal_bars_exchange_their_velocities() {
    const SPEED: f64 = 0.1;
    let exchange = |elements: usize| {
        let steel = material(7800.0, 210e9, 0.0);
        let mut world = World::new([0.0; 3]);
        let side = 3.14e-4_f64.sqrt();
        let bar = |x: f64| solid([1.0, side, side], [elements, 1, 1], [x, 0.0, 0.0], steel);
        let mut first = bar(-0.5);
        first.velocity.fill([SPEED, 0.0, 0.0]);
        world.add_elastic(Elastic::new(first));
        world.add_elastic(Elastic::new(bar(0.5 + 5e-5)));
        let mut simulation = Simulation::new(world, MoreauJean::default()).unwrap();
        let (mut impulse, mut began, mut ended) = (0.0, 0.0, 0.0);
        let mut watch = |s: &Simulation, r: &StepReport| {
            let pushed: f64 = s.contacts().iter().map(|c| c.impulse[0]).sum();
            if pushed > 0.0 {
                began = if impulse == 0.0 { r.t } else { began };
                ended = r.t;
            }
            impulse += pushed;
            Control::Continue
        };
        check(&simulation.run(1.2e-3, 1e-6, &mut watch).unwrap());
        assert!(simulation.contacts().iter().all(|c| (c.a, c.b) == (BodyId(1), BodyId(0))));
        let mean = |k: usize| {
            let v = &simulation.state().elastic[k].velocity;
            let sections: Vec<f64> = (0..=elements).map(|i| v[i][0]).collect();
            let ends = 0.5 * (sections[0] + sections[elements]);
            (sections.iter().sum::<f64>() - ends) / elements as f64
        };
        (mean(0), mean(1), ended - began, impulse)
    };
    // A bar that hits its equal is one that hits a wall at half the speed, and so is what is left in vibrations. 2 L/c and ρ S L v are the limits.
    let limit = 2.0 / (210e9_f64 / 7800.0).sqrt();
    near(limit, 3.854496446638e-4, 1e-15);
    for (n, within) in [(10, 0.04), (40, 0.015)] {
        let (first, second, lasted, impulse) = exchange(n);
        near(first + second, SPEED, 1e-10);
        near(second / SPEED, 1.0, within);
        near(lasted / limit, 1.0, within);
        near(impulse, 7800.0 * 3.14e-4 * second, 1e-8);
    }
}

/// A block of finer mesh that slides over the faces of one that is held.
fn sliding() -> Simulation {
    let mut world = World::new([0.0, 0.0, -G]).with_law(Law::friction(MU));
    let rubber = Material { beta: 2e-3, ..material(DENSITY, 1e7, 0.0) };
    let mut low = solid([0.6, 0.3, 0.1], [8, 4, 1], [0.0, 0.0, 0.05], rubber);
    low.hold_bottom();
    world.add_elastic(Elastic::new(low));
    let mut high = solid([0.1, 0.1, 0.05], [3, 3, 2], [-0.1, 0.01, 0.125], rubber);
    high.velocity.fill([SLIDE, 0.0, 0.0]);
    world.add_elastic(Elastic::new(high));
    Simulation::new(world, MoreauJean::default()).unwrap()
}

const MU: f64 = 0.5;
const SLIDE: f64 = 1.2;

#[test]
fn a_block_slides_over_the_faces_of_another_as_far_as_friction_lets_it() {
    let mut simulation = sliding();
    check(&simulation.run(0.35, 1e-3, &mut ()).unwrap());
    let state = &simulation.state().elastic[1];
    let n = state.displacement.len() as f64;
    let mean = |x: &[[f64; 3]]| x.iter().map(|x| x[0]).sum::<f64>() / n;
    // v²/(2 mu g): two elements of the lower one.
    let far = SLIDE * SLIDE / (2.0 * MU * G);
    assert!(
        (mean(&state.displacement) / far - 1.0).abs() < 0.02,
        "{}",
        mean(&state.displacement) / far
    );
    near(mean(&state.velocity), 0.0, 1e-4);
    assert_eq!(simulation.contacts().iter().filter(|c| c.active).count(), 16);
}

#[test]
fn boxes_that_touch_go_on_from_a_checkpoint_bit_for_bit() {
    let mut whole = sliding();
    whole.run(0.05, 1e-3, &mut ()).unwrap();
    let mut second = sliding();
    second.restore(&whole.checkpoint()).unwrap();
    let report = whole.step(1e-3).unwrap();
    second.step(1e-3).unwrap();
    // Sliding over a face or on to the next, contacts are those of the step before.
    assert!(report.counts.warm == report.counts.active && report.counts.active > 0, "{report:?}");
    whole.run(0.1, 1e-3, &mut ()).unwrap();
    second.run(0.1, 1e-3, &mut ()).unwrap();
    assert_eq!(whole.state(), second.state());
}

#[test]
fn boxes_that_overlap_at_the_start_are_an_error_by_name() {
    let mut world = World::new([0.0; 3]);
    for (name, z) in [("low", 0.0), ("high", 0.09)] {
        let part = solid([0.1; 3], [2; 3], [0.0, 0.0, z], material(1000.0, 1e6, 0.3));
        world.add_elastic(Elastic::new(part).named(name));
    }
    let error = Simulation::new(world, MoreauJean::default()).map(drop).unwrap_err().to_string();
    assert!(error.contains("`high`") && error.contains("`low`"), "{error}");
}

#[test]
fn a_box_that_is_narrower_than_the_elements_of_another_is_a_warning() {
    let mut world = World::new([0.0; 3]);
    let hard = material(1000.0, 1e6, 0.3);
    world.add_elastic(Elastic::new(solid([1.0; 3], [4; 3], [0.0; 3], hard)).named("cube"));
    let beam = solid([2.0, 0.2, 0.2], [2, 1, 1], [0.0, 0.0, 0.7], hard);
    world.add_elastic(Elastic::new(beam).named("beam"));
    let simulation = Simulation::new(world, MoreauJean::default()).unwrap();
    let warnings = simulation.warnings();
    assert!(warnings.iter().any(|w| w.contains("`beam` is narrower than the elements of `cube`")));
}

/// A family of elastic solids in motion: every step solved, no energy gained; the farthest that a node has moved.
fn family(name: &str, set: &str) -> (Simulation, f64) {
    let text = format!(
        "format = 'nonsmooth-scene'\nversion = 1\ntime = {{ h = 5e-4, end = 0.02 }}\npairs_default = {{}}
         [[generate]]\nscene = '{name}'\nset = {set}\nposition = [1, 0, 0]"
    );
    let scene = SceneFile::parse(&text, &[]).unwrap();
    let mut simulation = scene.build().unwrap();
    let mut start = None;
    let mut watch = |_: &Simulation, r: &StepReport| {
        let e = r.energy.kinetic + r.energy.potential;
        let first = *start.get_or_insert(e);
        assert!(e <= first + 1e-9 * r.energy.scale, "{e} of {first}");
        Control::Continue
    };
    check(&simulation.run(scene.time.end, scene.time.h, &mut watch).unwrap());
    let moved = simulation.state().elastic.iter().flat_map(|s| &s.displacement);
    let far = moved.flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
    (simulation, far)
}

#[test]
fn families_of_elastic_solids_stand() {
    for (name, set, count, high) in [
        ("elastic_cubes", "{ count = 3, elements = 3, mu = 0.5 }", 3, 3.0),
        ("elastic_wall", "{ rows = 3, columns = 3, mu = 0.6 }", 10, 0.6),
    ] {
        let (simulation, far) = family(name, set);
        let elastic = &simulation.world().elastic;
        assert_eq!(elastic.len(), count);
        assert_eq!(elastic[1].name, format!("{name} 1"));
        // What the weight suddenly put on shortens a column by: twice ρ g H²/(2 E).
        let stone = elastic[0].solid.material;
        let share = far / (stone.density * G * high * high / stone.young);
        assert!((0.1..1.1).contains(&share), "{name}: {share}");
        let open = simulation.contacts().iter().filter(|c| c.active && c.impulse[0] == 0.0).count();
        println!("{name}: {share:.3} of it, {open} contacts open");
    }
}

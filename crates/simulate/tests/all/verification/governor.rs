//! The flyball governor of the IFToMM benchmark of multibody systems (A05): two arms with balls on a turning shaft lift a slider by rods that are stiff
//! springs with strong dampers.
//!
//! Data of the benchmark: shaft and arms 1 × 0.01 × 0.01 m, slider a cube of 0.1 m, 3000 kg/m³, balls of 5 kg, K = 8e5 N/m, C = 4e4 N s/m, rest length
//! 0.5 m, the springs at s = 0.5 m from the hinges of the arms, α = 30°. Its initial coordinates are not at hand; chosen here: the shaft points down from the hinges,
//! which lie on its axis; arms at α to it and not opening; the slider on the axis where the springs have their rest length, cos α = 0.866 m down; all turning
//! at 2π rad/s about the shaft. Each spring is two telescoping rods of 0.15 kg, 0.5 × 0.01 × 0.01 m, whose centres meet at the start.
//!
//! With stiff springs one coordinate is left, α, and with the angular momentum L = I(α) Ω kept it moves in the potential V(α) + L²/(2 I(α)): between 30° and
//! the next angle where that is what it was at the start.

use nonsmooth_scenes::Rotation;
use nonsmooth_scenes::vec3::{Vec3, add, cross, dot, scale};
use nonsmooth_simulate::{
    Body, BodyId, Control, Coordinate, Drive, Joint, MoreauJean, Simulation, Spring, StepReport,
    World,
};

use crate::verification::{G, check, near};

const DENSITY: f64 = 3000.0;
const WIDTH: f64 = 0.01;
const BALL: f64 = 5.0;
const SPRING: Spring = Spring { stiffness: 8e5, damping: 4e4, rest: 0.0 };
const START: f64 = std::f64::consts::FRAC_PI_6;
const SPIN: f64 = std::f64::consts::TAU;
const Y: Vec3 = [0.0, 1.0, 0.0];
const Z: Vec3 = [0.0, 0.0, 1.0];

/// Mass, and moments of inertia across and along, of a rod of this length.
fn rod(length: f64) -> (f64, f64, f64) {
    let m = DENSITY * length * WIDTH * WIDTH;
    (m, m * (length * length + WIDTH * WIDTH) / 12.0, m * WIDTH * WIDTH / 6.0)
}

/// The arm with its ball: mass, mass centre from the hinge, moments across and along.
fn arm() -> (f64, f64, f64, f64) {
    let (m, across, along) = rod(1.0);
    let mass = m + BALL;
    let centre = (0.5 * m + BALL) / mass;
    (mass, centre, across + m * (0.5 - centre).powi(2) + BALL * (1.0 - centre).powi(2), along)
}

fn slider() -> (f64, f64) {
    let m = DENSITY * 1e-3;
    (m, m * 0.01 / 6.0)
}

/// A body about the axis `angle` from the third one, turning with the shaft.
fn turning(mass: f64, across: f64, along: f64, at: Vec3, angle: f64) -> Body {
    let j = [[across, 0.0, 0.0], [0.0, across, 0.0], [0.0, 0.0, along]];
    let body = Body::with_mass(mass, j, vec![]).at(at).turned(Rotation::about(Y, angle));
    body.moving(cross([0.0, 0.0, SPIN], at), [0.0, 0.0, SPIN])
}

struct Governor {
    simulation: Simulation,
    arms: [BodyId; 2],
    springs: [usize; 2],
}

impl Governor {
    fn new() -> Self {
        let mut world = World::new([0.0, 0.0, -G]);
        let (s, c) = START.sin_cos();
        let (m, across, along) = rod(1.0);
        let shaft = world.add(turning(m, across, along, [0.0, 0.0, -0.5], 0.0));
        world.join(Joint::revolute(None, shaft, [0.0; 3], Z));
        let (m, j) = slider();
        let foot = [0.0, 0.0, -c];
        let slider = world.add(turning(m, j, j, foot, 0.0));
        world.join(Joint::prismatic(Some(shaft), slider, foot, Z));
        let mut springs = [0; 2];
        let arms = [1.0, -1.0].map(|side: f64| {
            let down = std::f64::consts::PI - START;
            let (out, back) = ([side * s, 0.0, -c], [-side * s, 0.0, -c]);
            let (m, centre, across, along) = arm();
            let arm = world.add(turning(m, across, along, scale(centre, out), side * down));
            world.join(Joint::revolute(Some(shaft), arm, [0.0; 3], Y));
            let (m, across, along) = rod(0.5);
            let (head, middle) = (scale(0.5, out), scale(0.5, add(scale(0.5, out), foot)));
            let [upper, lower] =
                [0, 1].map(|_| world.add(turning(m, across, along, middle, -side * down)));
            world.join(Joint::spherical(Some(arm), upper, head));
            world.join(Joint::spherical(Some(slider), lower, foot));
            let spring = Drive { spring: Some(SPRING), ..Drive::along(Coordinate::Slide) };
            let spring = Joint::prismatic(Some(upper), lower, middle, back).driven(spring);
            springs[usize::from(side < 0.0)] = world.join(spring).index();
            arm
        });
        let simulation = Simulation::new(world, MoreauJean::default()).unwrap();
        Self { simulation, arms, springs }
    }
}

/// The third axis of a body in the world.
fn axis(s: &Simulation, b: BodyId) -> Vec3 {
    let r = Rotation(s.state().rotation[b.index()]).matrix();
    r.map(|row| row[2])
}

/// The angle of an arm to the shaft.
fn opening(s: &Simulation, arm: BodyId) -> f64 {
    let u = axis(s, arm);
    u[0].hypot(u[1]).atan2(-u[2])
}

/// Kinetic energy, weights and springs.
fn energy(s: &Simulation, springs: &[usize; 2]) -> f64 {
    let (world, state) = (s.world(), s.state());
    let bodies = world.bodies.iter().enumerate().map(|(k, b)| {
        let (v, w) = (state.velocity[k], state.spin[k]);
        let turn: f64 = (0..3).map(|i| w[i] * dot(b.inertia[i], w)).sum();
        0.5 * b.mass * dot(v, v) + 0.5 * turn + b.mass * G * state.position[k][2]
    });
    let slides = springs.iter().map(|&k| s.joints().get(k).map_or(0.0, |j| j.slide));
    bodies.sum::<f64>() + slides.map(|x| 0.5 * SPRING.stiffness * x * x).sum::<f64>()
}

/// About the shaft.
fn momentum(s: &Simulation) -> f64 {
    let (world, state) = (s.world(), s.state());
    let each = world.bodies.iter().enumerate().map(|(k, b)| {
        let r = Rotation(state.rotation[k]).matrix();
        let spin: Vec3 = std::array::from_fn(|i| dot(b.inertia[i], state.spin[k]));
        b.mass * cross(state.position[k], state.velocity[k])[2] + dot(r[2], spin)
    });
    each.sum()
}

/// Potential energy and moment of inertia about the shaft with springs at rest.
fn rigid(alpha: f64) -> (f64, f64) {
    let (s, c) = alpha.sin_cos();
    let ((arm, centre, across, along), (rod, rod_across, rod_along)) = (arm(), rod(0.5));
    let (slider, slider_j) = slider();
    let v = -G * c * (2.0 * arm * centre + 4.0 * rod * 0.75 + slider);
    let tilted = |across: f64, along: f64| across * s * s + along * c * c;
    let i = 2.0 * (arm * (centre * s).powi(2) + tilted(across, along))
        + 4.0 * (rod * (0.25 * s).powi(2) + tilted(rod_across, rod_along))
        + slider_j
        + self::rod(1.0).2;
    (v, i)
}

/// The angle beyond the start where the rigid governor turns back.
fn turning_point() -> f64 {
    let (v, i) = rigid(START);
    let excess = |alpha: f64| {
        let (w, j) = rigid(alpha);
        v + 0.5 * i * SPIN * SPIN - w - 0.5 * (i * SPIN).powi(2) / j
    };
    let (mut low, mut high) = (START + 1e-3, std::f64::consts::FRAC_PI_2);
    assert!(excess(low) > 0.0 && excess(high) < 0.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        *(if excess(middle) > 0.0 { &mut low } else { &mut high }) = middle;
    }
    low
}

#[test]
fn a_governor_with_stiff_springs_swings_between_its_turning_points() {
    let Governor { mut simulation, arms, springs } = Governor::new();
    let (first, l) = (energy(&simulation, &springs), momentum(&simulation));
    let (mut low, mut high) = (f64::INFINITY, 0.0_f64);
    let (mut stretch, mut gain, mut violation, mut apart) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
    let mut last = first;
    let mut watch = |s: &Simulation, r: &StepReport| {
        let [a, b] = arms.map(|arm| opening(s, arm));
        (low, high) = (low.min(a), high.max(a));
        apart = apart.max((a - b).abs());
        let now = energy(s, &springs);
        gain = gain.max(now - last);
        last = now;
        springs.iter().for_each(|&k| stretch = stretch.max(s.joints()[k].slide.abs()));
        violation = violation
            .max(r.drift.joints)
            .max(s.joints().iter().fold(0.0, |m, j| m.max(j.violation)));
        Control::Continue
    };
    let report = simulation.run(10.0, 1e-3, &mut watch).unwrap();
    check(&report);
    near(low, START, 1e-5);
    near(high, turning_point(), 2e-5);
    // Some 30 N of 8e5 N/m.
    assert!(stretch < 1e-4, "{stretch:e}");
    assert!(violation < 1e-13, "{violation:e}");
    // The dampers take little; what moving onto the joints after a step adds is of second order in h.
    assert!(gain < 1e-8 * first.abs(), "{gain:e}");
    assert!(last < first && last > first - 1e-2, "{first} {last}");
    near(momentum(&simulation) / l, 1.0, 1e-6);
    assert!(apart < 1e-12, "{apart:e}");
}

//! The rattleback: half an ellipsoid whose masses lie across its axes reverses its spin in one sense, not in the other.

use nonsmooth_linalg::Dense;
use nonsmooth_simulate::{
    Control, Lagrangian, LagrangianScheme, LagrangianSimulation, Law, Size, StepReport,
};

use crate::lagrangian::check;

type Vec3 = [f64; 3];

/// Semiaxes, moments of inertia, and how far the mass centre is below that of the ellipsoid: the data of Kane and Levinson.
const AXES: Vec3 = [0.2, 0.03, 0.02];
const J: [Vec3; 3] = [[2e-4, -2e-5, 0.0], [-2e-5, 1.6e-3, 0.0], [0.0, 0.0, 1.7e-3]];
const BELOW: f64 = 0.01;

/// Mass centre, and the angles roll, pitch, yaw: `R = Rz(yaw) Ry(pitch) Rx(roll)`. 1 kg.
struct Rattleback;

fn dot(a: Vec3, b: Vec3) -> f64 {
    (0..3).map(|i| a[i] * b[i]).sum()
}

/// `ω = E (roll', pitch', yaw')` in the frame of the body.
fn rates(q: &[f64]) -> [Vec3; 3] {
    let ((sr, cr), (sp, cp)) = (q[3].sin_cos(), q[4].sin_cos());
    [[1.0, 0.0, -sp], [0.0, cr, cp * sr], [0.0, -sr, cp * cr]]
}

/// `Eᵀ J E`.
fn turning(q: &[f64]) -> [Vec3; 3] {
    let e = rates(q);
    let je: [Vec3; 3] =
        J.map(|row| std::array::from_fn(|j| (0..3).map(|k| row[k] * e[k][j]).sum()));
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| e[k][i] * je[k][j]).sum()))
}

/// The axes of the world in the frame of the body.
fn axes(q: &[f64]) -> [Vec3; 3] {
    let ((sr, cr), (sp, cp), (sy, cy)) = (q[3].sin_cos(), q[4].sin_cos(), q[5].sin_cos());
    [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
}

/// The lowest point, from the mass centre, in the frame of the body.
fn lowest(up: Vec3) -> Vec3 {
    let stretched: Vec3 = std::array::from_fn(|i| AXES[i] * up[i]);
    let length = dot(stretched, stretched).sqrt();
    let mut p: Vec3 = std::array::from_fn(|i| -AXES[i] * stretched[i] / length);
    p[2] += BELOW;
    p
}

impl Lagrangian<3> for Rattleback {
    fn size(&self) -> Size {
        Size::new(6).contacts(1)
    }
    fn mass(&self, q: &[f64], mass: &mut Dense) {
        let turning = turning(q);
        for i in 0..3 {
            mass[(i, i)] = 1.0;
            (0..3).for_each(|j| mass[(3 + i, 3 + j)] = turning[i][j]);
        }
    }
    fn force(&self, _: f64, q: &[f64], v: &[f64], force: &mut [f64]) {
        force[2] = -9.81;
        // ½ ∂(v·M v)/∂q − M' v by differences; nothing depends on yaw.
        const STEP: f64 = 1e-5;
        for k in 0..2 {
            let at = |side: f64| {
                let mut q = q.to_vec();
                q[3 + k] += side * STEP;
                turning(&q)
            };
            let (after, before) = (at(1.0), at(-1.0));
            for i in 0..3 {
                for j in 0..3 {
                    let slope = (after[i][j] - before[i][j]) / (2.0 * STEP);
                    force[3 + k] += 0.5 * slope * v[3 + i] * v[3 + j];
                    force[3 + i] -= slope * v[3 + k] * v[3 + j];
                }
            }
        }
    }
    fn potential(&self, _: f64, q: &[f64]) -> f64 {
        9.81 * q[2]
    }
    fn gaps(&self, _: f64, q: &[f64], gaps: &mut [f64]) {
        let up = axes(q)[2];
        gaps[0] = q[2] + dot(up, lowest(up));
    }
    fn directions(&self, _: f64, q: &[f64], h: &mut Dense) -> bool {
        let (axes, e) = (axes(q), rates(q));
        let p = lowest(axes[2]);
        for (row, d) in [2, 0, 1].into_iter().enumerate() {
            let a = axes[d];
            let moment =
                [p[1] * a[2] - p[2] * a[1], p[2] * a[0] - p[0] * a[2], p[0] * a[1] - p[1] * a[0]];
            h[(row, d)] = 1.0;
            for j in 0..3 {
                h[(row, 3 + j)] = (0..3).map(|k| moment[k] * e[k][j]).sum();
            }
        }
        true
    }
    fn law(&self, _: usize, _: f64, _: &[f64], _: &[f64]) -> Law {
        Law::friction(2.0)
    }
}

/// The least spin in the sense of the start during 3 s, and the most energy gained over its start.
fn spun(spin: f64, h: f64) -> [f64; 2] {
    let mut q = [0.0, 0.0, 0.0, 0.0, 0.5_f64.to_radians(), 0.0];
    let up = axes(&q)[2];
    q[2] = -dot(up, lowest(up));
    // The point of contact is at rest: v = −ω × p.
    let p = lowest(up);
    let omega: Vec3 = std::array::from_fn(|i| rates(&q)[i][2] * spin);
    let v = [
        omega[2] * p[1] - omega[1] * p[2],
        omega[0] * p[2] - omega[2] * p[0],
        omega[1] * p[0] - omega[0] * p[1],
    ];
    let world = axes(&q).map(|axis| dot(axis, v));
    let start = [world[0], world[1], world[2], 0.0, 0.0, spin];
    let mut simulation =
        LagrangianSimulation::new(Rattleback, LagrangianScheme::default(), &q, &start).unwrap();
    let (mut first, mut least, mut gain) = (None, f64::INFINITY, 0.0_f64);
    let mut watch = |s: &LagrangianSimulation<Rattleback, 3>, step: &StepReport| {
        let energy = step.energy.kinetic + step.energy.potential;
        gain = gain.max(energy - *first.get_or_insert(energy));
        least = least.min(s.state().v[5] * spin.signum());
        Control::Continue
    };
    check(&simulation.run(3.0, h, &mut watch).unwrap());
    [least, gain]
}

/// What energy there is above that of the start, 0.12 J, goes to zero with h²: it rocks most where it reverses.
#[test]
fn a_rattleback_reverses_in_one_sense_only() {
    for h in [1e-3, 5e-4] {
        let [[goes_on, smooth], [reverses, rocks]] = [5.0, -5.0].map(|spin| spun(spin, h));
        assert!(reverses < -0.6 && goes_on > 4.9, "{reverses} {goes_on}");
        assert!(smooth <= 3.0 * h * h && rocks <= 170.0 * h * h, "{smooth} {rocks}");
    }
}

//! The slider-crank of Flores, Leine and Glocker, with clearance and without.

use nonsmooth_linalg::Dense;
use nonsmooth_simulate::{
    Control, Lagrangian, LagrangianScheme, LagrangianSimulation, Law, Size, StepReport,
};

use crate::lagrangian::{check, near, order, run, symmetric, theta};

const L: [f64; 2] = [0.153, 0.306];
const M: [f64; 3] = [0.038, 0.038, 0.076];
const J: [f64; 3] = [7.4e-5, 5.9e-4, 2.7e-6];
const HALF: [f64; 2] = [0.05, 0.025];
const G: f64 = 9.81;

/// Angles of crank, rod and slider; the four corners of the slider in its guide, or no clearance at all.
struct SliderCrank {
    clearance: Option<f64>,
}

impl SliderCrank {
    /// The height of a corner above the axis of the guide, and its place along it.
    fn corner(q: &[f64], corner: usize) -> [f64; 2] {
        let (a, b) = (HALF[0] * [1.0, -1.0, 1.0, -1.0][corner], HALF[1] * Self::side(corner));
        let pin = [L[0] * q[0].cos() + L[1] * q[1].cos(), L[0] * q[0].sin() + L[1] * q[1].sin()];
        let (s, c) = q[2].sin_cos();
        [pin[1] + a * s + b * c, pin[0] + a * c - b * s]
    }
    fn side(corner: usize) -> f64 {
        if corner < 2 { 1.0 } else { -1.0 }
    }
}

impl Lagrangian<2> for SliderCrank {
    fn size(&self) -> Size {
        match self.clearance {
            Some(_) => Size::new(3).contacts(4),
            None => Size::new(3).relations(2),
        }
    }
    fn mass(&self, q: &[f64], mass: &mut Dense) {
        let coupling = (M[1] / 2.0 + M[2]) * L[0] * L[1] * (q[1] - q[0]).cos();
        let crank = J[0] + (M[0] / 4.0 + M[1] + M[2]) * L[0] * L[0];
        let rod = J[1] + (M[1] / 4.0 + M[2]) * L[1] * L[1];
        symmetric(mass, &[(0, 0, crank), (1, 1, rod), (2, 2, J[2]), (0, 1, coupling)]);
    }
    fn force(&self, _: f64, q: &[f64], v: &[f64], force: &mut [f64]) {
        let turning = (M[1] / 2.0 + M[2]) * L[0] * L[1] * (q[1] - q[0]).sin();
        force[0] = turning * v[1] * v[1] - (M[0] / 2.0 + M[1] + M[2]) * G * L[0] * q[0].cos();
        force[1] = -turning * v[0] * v[0] - (M[1] / 2.0 + M[2]) * G * L[1] * q[1].cos();
    }
    fn potential(&self, _: f64, q: &[f64]) -> f64 {
        let crank = (M[0] / 2.0 + M[1] + M[2]) * L[0] * q[0].sin();
        G * (crank + (M[1] / 2.0 + M[2]) * L[1] * q[1].sin())
    }
    fn gaps(&self, _: f64, q: &[f64], gaps: &mut [f64]) {
        for (c, gap) in gaps.iter_mut().enumerate() {
            *gap = HALF[1] + self.clearance.unwrap_or(0.0) - Self::side(c) * Self::corner(q, c)[0];
        }
    }
    fn directions(&self, _: f64, q: &[f64], h: &mut Dense) -> bool {
        for c in 0..h.nrows() / 2 {
            let arms = [(L[0], q[0]), (L[1], q[1])];
            let [y, x] = Self::corner(q, c);
            let pin = arms.map(|(l, a)| [l * a.cos(), l * a.sin()]);
            let rod = [pin[0][0] + pin[1][0], pin[0][1] + pin[1][1]];
            let up = [pin[0][0], pin[1][0], x - rod[0]];
            let along = [-pin[0][1], -pin[1][1], -(y - rod[1])];
            h.row_mut(2 * c).copy_from_slice(&up.map(|x| -Self::side(c) * x));
            h.row_mut(2 * c + 1).copy_from_slice(&along);
        }
        true
    }
    fn law(&self, _: usize, _: f64, _: &[f64], _: &[f64]) -> Law {
        Law { mu: 0.01, e: 0.4, e_t: 0.0, mu_r: 0.0 }
    }
    fn relations(&self, _: f64, q: &[f64], phi: &mut [f64]) {
        if self.clearance.is_none() {
            (phi[0], phi[1]) = (L[0] * q[0].sin() + L[1] * q[1].sin(), q[2]);
        }
    }
}

fn start(clearance: Option<f64>) -> LagrangianSimulation<SliderCrank, 2> {
    let turning = if clearance.is_some() { -0.01 } else { 0.0 };
    let v = [150.0, -75.0, turning];
    let scheme =
        LagrangianScheme { projection: clearance.is_none().then_some(1e-13), ..theta(0.5) };
    LagrangianSimulation::new(SliderCrank { clearance }, scheme, &[0.0; 3], &v).unwrap()
}

/// The number of the last bounces before the slider lies on its guide depends on the step: with h from 2.5e-6 to 1e-5 the crank is up to 1.6e-3 rad and 0.06 rad/s apart at 0.0419 s.
/// At 1e-5 they are those of the reference, at 5e-6 they are others.
#[test]
fn the_slider_rattles_as_published() {
    let times = [0.01, 0.02, 0.0419];
    // θ₁ and θ₁' with what they may be off.
    let coarse = [(0.947971, 67.4734), (1.613346, 71.685), (4.137581, 100.21)];
    let fine = [(0.947946, 67.4715), (1.613292, 71.680), (4.137479, 100.22)];
    let close = [(5e-5, 0.02); 3];
    let apart = [(1e-4, 0.05), (4e-4, 0.05), (1.7e-3, 0.06)];
    for (h, exact, within, rod) in [(1e-5, coarse, close, 5e-3), (5e-6, fine, apart, 1e-2)] {
        let mut mechanism = start(Some(1e-3));
        for (k, t) in times.into_iter().enumerate() {
            run(&mut mechanism, t, h);
            let state = mechanism.state();
            near(state.q[0], exact[k].0, within[k].0);
            near(state.v[0], exact[k].1, within[k].1);
            if t == 0.02 {
                near(state.v[1], 1.38, rod);
            }
        }
        near(mechanism.state().q[2], 0.0, 1e-5);
        assert!(mechanism.contacts().iter().all(|c| c.gap > -1e-5));
    }
}

/// Six turns of the crank to 0.2 s: impacts take 7 % of the energy, and without clearance none is lost. What is above the start is of the order of h², the same with and without.
#[test]
fn the_slider_rattles_on_and_never_gains() {
    let mut ends = vec![];
    for (clearance, h) in [(Some(1e-3), 1e-5), (Some(1e-3), 5e-6), (None, 1e-5)] {
        let mut mechanism = start(clearance);
        let mut mass = Dense::zeros(3, 3);
        mechanism.system().mass(&[0.0; 3], &mut mass);
        let v = mechanism.state().v.clone();
        let doubled = |i: usize| (0..3).map(|j| v[i] * mass[(i, j)] * v[j]).sum::<f64>();
        let begin = 0.5 * (0..3).map(doubled).sum::<f64>();
        let mut energy = begin;
        let mut watch = |s: &LagrangianSimulation<SliderCrank, 2>, r: &StepReport| {
            energy = r.energy.kinetic + r.energy.potential;
            assert!(energy <= begin + 1.6e5 * h * h, "{energy} of {begin} at {}", r.t);
            assert!(r.t < 0.0419 || s.contacts().iter().all(|c| c.gap > -1e-5));
            Control::Continue
        };
        check(&mechanism.run(0.2, h, &mut watch).unwrap());
        near(mechanism.state().q[2], 0.0, 1e-7);
        let (left, within) = if clearance.is_some() { (0.934, 1e-3) } else { (1.0, 2e-6) };
        near(energy / begin, left, within);
        ends.push(mechanism.state().q[0]);
    }
    near(ends[0], ends[1], 5e-3);
}

#[test]
fn the_slider_without_clearance_is_what_it_tends_to() {
    let mut far = vec![];
    for clearance in [1e-3, 1e-4, 1e-5] {
        let (mut ideal, mut real) = (start(None), start(Some(clearance)));
        let mut off: f64 = 0.0;
        for k in 1..=20 {
            run(&mut ideal, 1e-3 * f64::from(k), 1e-5);
            run(&mut real, 1e-3 * f64::from(k), 1e-5);
            off = off.max((ideal.state().q[1] - real.state().q[1]).abs());
        }
        far.push((clearance, off));
    }
    assert!(far[0].1 < 5e-3);
    assert!((0.5..1.5).contains(&order(&far)), "{far:?}");
}

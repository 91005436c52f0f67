//! The slider-crank of Flores, Leine and Glocker, with clearance and without.

use nonsmooth_linalg::Dense;
use nonsmooth_simulate::{Lagrangian, LagrangianScheme, LagrangianSimulation, Law, Size};

use crate::{near, order, run, symmetric, theta};

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

/// The number of the last bounces before the slider lies on its guide depends on the step: what is left of it once it lies there is of the order of 1e-3.
#[test]
fn the_slider_rattles_as_published() {
    let coarse = [(0.01, 0.947971, 67.4734), (0.02, 1.613346, 71.685), (0.0419, 4.137581, 100.21)];
    let mut mechanism = start(Some(1e-3));
    for (t, angle, rate) in coarse {
        run(&mut mechanism, t, 1e-5);
        near(mechanism.state().q[0], angle, 2e-4);
        near(mechanism.state().v[0], rate, 0.05);
    }
    near(mechanism.state().q[2], 0.0, 1e-5);
    assert!(mechanism.contacts().iter().all(|c| c.gap > -1e-5));
    let fine = [(0.01, 0.947946, 2e-4), (0.02, 1.613292, 1e-3), (0.0419, 4.137479, 2e-3)];
    let mut mechanism = start(Some(1e-3));
    for (t, angle, within) in fine {
        run(&mut mechanism, t, 5e-6);
        near(mechanism.state().q[0], angle, within);
    }
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

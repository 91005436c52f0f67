//! Painlevé's rod: a rod that slides so steeply that Coulomb's law has no continuous solution.

use nonsmooth_linalg::Dense;
use nonsmooth_simulate::{
    Control, Lagrangian, LagrangianScheme, LagrangianSimulation, Law, Size, StepReport,
};

use crate::lagrangian::check;

/// A uniform rod of length 2 and mass 1 whose lower end slides over the ground: centre and angle to the ground.
struct Rod {
    mu: f64,
}

impl Lagrangian<2> for Rod {
    fn size(&self) -> Size {
        Size::new(3).contacts(1)
    }
    fn mass(&self, _: &[f64], mass: &mut Dense) {
        (mass[(0, 0)], mass[(1, 1)], mass[(2, 2)]) = (1.0, 1.0, 1.0 / 3.0);
    }
    fn force(&self, _: f64, _: &[f64], _: &[f64], force: &mut [f64]) {
        force[1] = -9.81;
    }
    fn potential(&self, _: f64, q: &[f64]) -> f64 {
        9.81 * q[1]
    }
    fn gaps(&self, _: f64, q: &[f64], gaps: &mut [f64]) {
        gaps[0] = q[1] - q[2].sin();
    }
    fn directions(&self, _: f64, q: &[f64], h: &mut Dense) -> bool {
        h.row_mut(0).copy_from_slice(&[0.0, 1.0, -q[2].cos()]);
        h.row_mut(1).copy_from_slice(&[1.0, 0.0, q[2].sin()]);
        true
    }
    fn law(&self, _: usize, _: f64, _: &[f64], _: &[f64]) -> Law {
        Law::friction(self.mu)
    }
}

/// Where it slides, and over all, energy never grows; where it sticks it does by up to h² in a step, since the rod turns about the point of contact and directions are those at the middle
/// of the step.
#[test]
fn a_rod_in_painleves_region_steps_on() {
    for h in [1e-3, 1e-4] {
        let jumps: usize = [1.4, 1.6, 1.8, 2.0].map(|mu| jumps(mu, h)).iter().sum();
        assert!(jumps >= 16, "{jumps}");
    }
}

/// How often sliding ends within one step from five states with this coefficient.
fn jumps(mu: f64, h: f64) -> usize {
    let mut jumps = 0;
    // A = 1 + 3 cos θ (cos θ − mu sin θ) < 0 about tan θ = 2.
    let angle = 2.0_f64.atan();
    let ease = 1.0 + 3.0 * angle.cos() * (angle.cos() - mu * angle.sin());
    assert!(ease < 0.0);
    for (speed, turn) in [(-5.0, 0.0), (-5.0, -1.0), (-5.0, 1.0), (-1.0, 2.0), (5.0, 1.0)] {
        // The lower end touches the ground and has the velocity (speed, 0).
        let q = [0.0, angle.sin(), angle];
        let v = [speed - turn * angle.sin(), turn * angle.cos(), turn];
        let mut rod =
            LagrangianSimulation::new(Rod { mu }, LagrangianScheme::default(), &q, &v).unwrap();
        let kinetic = 0.5 * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2] / 3.0);
        let start = kinetic + 9.81 * q[1];
        let (mut energy, mut slid) = (start, speed);
        let mut watch = |s: &LagrangianSimulation<Rod, 2>, r: &StepReport| {
            let now = r.energy.kinetic + r.energy.potential;
            let c = s.contacts()[0];
            let sticks = c.active && c.after[1].abs() < 1e-6;
            let most = if sticks { energy + h * h } else { energy * (1.0 + 1e-14) };
            assert!(
                now <= most.min(start * (1.0 + 1e-14)),
                "mu {mu}, t {}: {now} after {energy}",
                r.t
            );
            energy = now;
            assert!(c.impulse.iter().all(|r| r.is_finite()));
            if c.active {
                // Impact without collision: sliding ends within one step.
                jumps += usize::from(slid.abs() > 0.5 && c.after[1].abs() < 1e-9);
                slid = c.after[1];
            }
            Control::Continue
        };
        check(&rod.run(0.2, h, &mut watch).unwrap());
    }
    jumps
}

/// `A(θ) = e_Nᵀ H M⁻¹ Hᵀ (e_N − mu e_T)` reaches zero for mu ≥ 4/3 only, first where tan θ = 2.
#[test]
fn the_region_opens_at_four_thirds_and_63_degrees() {
    let ease = |mu: f64, angle: f64| {
        let (mut h, mut mass) = (Dense::zeros(2, 3), Dense::zeros(3, 3));
        let rod = Rod { mu };
        let q = [0.0, angle.sin(), angle];
        rod.mass(&q, &mut mass);
        assert!(rod.directions(0.0, &q, &mut h));
        let through = |k: usize| h[(0, k)] * (h[(0, k)] + mu * h[(1, k)]) / mass[(k, k)];
        (0..3).map(through).sum::<f64>()
    };
    let least = |mu: f64| {
        let angles = (0..=90_000).map(|k| (f64::from(k) * 1e-3).to_radians());
        angles
            .map(|angle| (ease(mu, angle), angle))
            .fold((f64::MAX, 0.0), |a, b| if b.0 < a.0 { b } else { a })
    };
    let (value, angle) = least(4.0 / 3.0);
    crate::lagrangian::near(value, 0.0, 1e-9);
    crate::lagrangian::near(angle.to_degrees(), 63.434949, 1e-3);
    crate::lagrangian::near(ease(4.0 / 3.0, 63.434949_f64.to_radians()), 0.0, 1e-12);
    assert!(least(4.0 / 3.0 - 1e-6).0 > 0.0 && least(4.0 / 3.0 + 1e-6).0 < 0.0);
}

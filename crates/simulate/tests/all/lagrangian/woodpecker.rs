//! The woodpecker toy of Glocker and Studer.

use nonsmooth_linalg::Dense;
use nonsmooth_simulate::{Control, Lagrangian, LagrangianSimulation, Law, Size, StepReport};

use crate::lagrangian::{check, near, symmetric, theta};

const R_O: f64 = 0.0025;
const R_M: f64 = 0.0031;
const H_M: f64 = 0.0058;
const L_M: f64 = 0.010;
const L_G: f64 = 0.015;
const H_S: f64 = 0.02;
const L_S: f64 = 0.0201;
const M_M: f64 = 0.0003;
const M_S: f64 = 0.0045;
const J_M: f64 = 5e-9;
const J_S: f64 = 7e-7;
const SPRING: f64 = 0.0056;
const G: f64 = 9.81;

/// Height of the sleeve, its angle, and that of the bird; contacts of the beak and of the two ends of the sleeve.
struct Woodpecker;

impl Lagrangian<2> for Woodpecker {
    fn size(&self) -> Size {
        Size::new(3).contacts(3)
    }
    fn mass(&self, _: &[f64], mass: &mut Dense) {
        let (sleeve, bird) = (J_M + M_S * L_M * L_M, J_S + M_S * L_G * L_G);
        let turns = [(1, 1, sleeve), (1, 2, M_S * L_M * L_G), (2, 2, bird)];
        symmetric(mass, &turns);
        symmetric(mass, &[(0, 0, M_S + M_M), (0, 1, M_S * L_M), (0, 2, M_S * L_G)]);
    }
    fn force(&self, _: f64, q: &[f64], _: &[f64], force: &mut [f64]) {
        let moment = SPRING * (q[1] - q[2]);
        force[0] = -G * (M_S + M_M);
        force[1] = -G * M_S * L_M - moment;
        force[2] = -G * M_S * L_G + moment;
    }
    fn gaps(&self, _: f64, q: &[f64], gaps: &mut [f64]) {
        gaps[0] = L_M + L_G - L_S - R_O - H_S * q[2];
        gaps[1] = R_M - R_O + H_M * q[1];
        gaps[2] = R_M - R_O - H_M * q[1];
    }
    fn directions(&self, _: f64, _: &[f64], h: &mut Dense) -> bool {
        h.row_mut(0).copy_from_slice(&[0.0, 0.0, -H_S]);
        h.row_mut(1).copy_from_slice(&[1.0, L_M, L_G - L_S]);
        for (row, sign) in [(2, 1.0), (4, -1.0)] {
            h.row_mut(row).copy_from_slice(&[0.0, sign * H_M, 0.0]);
            h.row_mut(row + 1).copy_from_slice(&[1.0, R_M, 0.0]);
        }
        true
    }
    fn law(&self, contact: usize, _: f64, _: &[f64], _: &[f64]) -> Law {
        Law { mu: 0.3, e: if contact == 0 { 0.5 } else { 0.0 }, e_t: 0.0, mu_r: 0.0 }
    }
}

fn woodpecker() -> LagrangianSimulation<Woodpecker, 2> {
    let (q, v) = ([0.0, -0.1036, -0.2788], [-0.3411, 4.8572e-15, -7.4583]);
    LagrangianSimulation::new(Woodpecker, theta(0.5), &q, &v).unwrap().with_tolerance(1e-13)
}

#[test]
fn the_woodpecker_is_where_the_reference_has_it() {
    let mut bird = woodpecker();
    let report = bird.run(0.29998, 2e-5, &mut ()).unwrap();
    check(&report);
    let (q, v) = (&bird.state().q, &bird.state().v);
    near(q[0], -0.04134818676834, 1e-13);
    near(v[0], -0.2601373308, 1e-9);
    near(q[1], -0.1034684683, 1e-10);
    near(q[2], -0.3409339755, 1e-10);
    near(v[2], -8.3275553532, 1e-9);
}

#[test]
fn the_woodpecker_comes_down_in_a_limit_cycle() {
    for h in [2e-5, 1e-5] {
        let mut bird = woodpecker();
        // A period begins where the bird swings away from the pole through the middle.
        let (mut last, mut passes) = (0.0, vec![]);
        let mut range = (f64::MAX, f64::MIN);
        let mut watch = |s: &LagrangianSimulation<Woodpecker, 2>, _: &StepReport| {
            let (q, v, t) = (&s.state().q, &s.state().v, s.state().t);
            if last > -0.2 && q[2] <= -0.2 {
                passes.push((t - h * (q[2] + 0.2) / (q[2] - last), q[0]));
            }
            if t > 1.0 {
                range = (range.0.min(q[2]), range.1.max(q[2]));
            }
            assert!(v.iter().all(|v| v.is_finite()));
            last = q[2];
            Control::Continue
        };
        check(&bird.run(2.0, h, &mut watch).unwrap());
        let late: Vec<_> = passes.into_iter().filter(|p| p.0 > 1.0).collect();
        for pair in late.windows(2) {
            near(pair[1].0 - pair[0].0, 0.1460, 1e-4);
            near(pair[0].1 - pair[1].1, 19.5e-3, 1e-4);
        }
        assert!(late.len() >= 6);
        near(range.0, -0.530, 2e-3);
        near(range.1, 0.120, 2e-3);
    }
}

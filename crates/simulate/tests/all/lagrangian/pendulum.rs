//! The pendulum of the IFToMM library, released horizontal: where directions are taken decides.

use nonsmooth_linalg::Dense;
use nonsmooth_simulate::{
    Control, Directions, Lagrangian, LagrangianScheme, LagrangianSimulation, Law, RelationsAt,
    Size, StepReport,
};

use crate::lagrangian::{near, order};

const G: f64 = 9.81;
const EXACT: [f64; 2] = [-0.275087462576, -0.961419205099];

/// A point mass at the end of a rod of one metre, or in a frictionless bowl.
struct Pendulum {
    bowl: bool,
}

impl Lagrangian<2> for Pendulum {
    fn size(&self) -> Size {
        if self.bowl { Size::new(2).contacts(1) } else { Size::new(2).relations(1) }
    }
    fn mass(&self, _: &[f64], mass: &mut Dense) {
        (mass[(0, 0)], mass[(1, 1)]) = (1.0, 1.0);
    }
    fn force(&self, _: f64, _: &[f64], _: &[f64], force: &mut [f64]) {
        force[1] = -G;
    }
    fn potential(&self, _: f64, q: &[f64]) -> f64 {
        G * q[1]
    }
    fn relations(&self, _: f64, q: &[f64], phi: &mut [f64]) {
        if !self.bowl {
            phi[0] = 0.5 * (q[0] * q[0] + q[1] * q[1] - 1.0);
        }
    }
    fn gaps(&self, _: f64, q: &[f64], gaps: &mut [f64]) {
        if self.bowl {
            gaps[0] = 1.0 - q[0].hypot(q[1]);
        }
    }
    fn law(&self, _: usize, _: f64, _: &[f64], _: &[f64]) -> Law {
        Law::default()
    }
}

/// Error at 10 s, largest drift of the length, largest error of the energy.
fn swing(bowl: bool, scheme: LagrangianScheme, h: f64) -> [f64; 3] {
    let mut pendulum =
        LagrangianSimulation::new(Pendulum { bowl }, scheme, &[-1.0, 0.0], &[0.0; 2]).unwrap();
    let (mut drift, mut energy) = (0.0_f64, 0.0_f64);
    let mut watch = |s: &LagrangianSimulation<Pendulum, 2>, r: &StepReport| {
        let q = &s.state().q;
        drift = drift.max((q[0].hypot(q[1]) - 1.0).abs());
        let e = r.energy.kinetic + r.energy.potential;
        energy = if e.abs() > energy.abs() { e } else { energy };
        // What is not iterated is linear.
        assert!(bowl || scheme.directions == Directions::Iterated || r.newton == 1);
        // The bead never leaves the bowl.
        assert!(!bowl || r.counts.active == 1, "{}", s.state().t);
        Control::Continue
    };
    let report = pendulum.run(10.0, h, &mut watch).unwrap();
    assert!(report.is_solved() && report.imbalance <= 1e-12, "{report}");
    let q = &pendulum.state().q;
    let error = (q[0] - EXACT[0]).abs().max((q[1] - EXACT[1]).abs());
    [error, drift, energy]
}

fn scheme(
    directions: Directions,
    relations: RelationsAt,
    projection: Option<f64>,
) -> LagrangianScheme {
    LagrangianScheme { directions, relations, projection, ..LagrangianScheme::default() }
}

#[test]
fn the_table_of_directions() {
    use Directions::{Extrapolated, Frozen, Iterated};
    use RelationsAt::{End, Mean};
    let table = [
        // Scheme, and error, drift and energy at h = 1e-2 and 1e-3.
        (scheme(Frozen, End, None), [0.58, 0.70, 6.6], [0.42, 0.085, 0.88]),
        (scheme(Frozen, End, Some(1e-13)), [0.91, 0.0, 2.1], [0.16, 0.0, 0.30]),
        (scheme(Iterated, End, None), [1.2e-3, 2.5e-4, 3.6e-3], [1.2e-5, 2.5e-6, 3.6e-5]),
        (scheme(Extrapolated, End, None), [6.3e-3, 7e-4, 1.1e-2], [7.0e-5, 3e-6, 1.1e-5]),
        (scheme(Extrapolated, Mean, None), [7.0e-3, 2.5e-4, 0.0], [7.0e-5, 2.5e-6, 0.0]),
        (scheme(Extrapolated, Mean, Some(1e-13)), [3.7e-3, 0.0, 1.6e-3], [3.5e-5, 0.0, 1.2e-5]),
        (scheme(Iterated, Mean, None), [4.6e-3, 0.0, 0.0], [4.6e-5, 0.0, 0.0]),
    ];
    for (scheme, coarse, fine) in table {
        for (h, row) in [(1e-2, coarse), (1e-3, fine)] {
            let found = swing(false, scheme, h);
            for (found, expected) in found.into_iter().zip(row) {
                near(found.abs(), expected, 0.06 * expected + 1e-11);
            }
        }
    }
}

#[test]
fn a_bead_in_a_bowl_stays_there() {
    let [error, drift, energy] = swing(true, LagrangianScheme::default(), 1e-3);
    assert!(error <= 1.5e-4 && drift <= 1e-5 && energy.abs() <= 1e-4);
}

#[test]
fn the_default_is_of_second_order() {
    let errors: Vec<_> = [8e-3, 4e-3, 2e-3, 1e-3]
        .map(|h| (h, swing(false, LagrangianScheme::default(), h)[0]))
        .into();
    near(order(&errors), 2.0, 0.1);
}

/// From horizontal to horizontal and back: `4 K(½)/√g`, 2.3678 s.
#[test]
fn the_period_from_horizontal_is_that_of_elliptic_functions() {
    let period: f64 = 2.367841947576;
    let errors: Vec<_> = [4e-3, 2e-3, 1e-3]
        .map(|steps| {
            let h = period / (period / steps).round();
            let start = LagrangianSimulation::new(
                Pendulum { bowl: false },
                LagrangianScheme::default(),
                &[-1.0, 0.0],
                &[0.0; 2],
            );
            let mut pendulum = start.unwrap();
            assert!(pendulum.run(period, h, &mut ()).unwrap().is_solved());
            // It stands still there: the velocity tells the time.
            let late = pendulum.state().v[1] / G;
            near(pendulum.state().q[0], -1.0, 1e-4);
            (h, late.abs())
        })
        .into();
    assert!(errors[2].1 < 1e-5, "{errors:?}");
    assert!(order(&errors) > 1.8, "{errors:?}");
}

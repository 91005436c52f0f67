//! Gaps with restitution that close one after the other within a step: what is coupled through M must win no energy.

use nonsmooth_linalg::{Csc, Dense};
use nonsmooth_simulate::{
    Activation, Control, Directions, Impact, Lagrangian, LagrangianScheme, LagrangianSimulation,
    Law, LinearContact, LinearSystem, RowLaw, Size, StepReport,
};

/// Runs for a time; the largest work of contacts and rows in a step as a share of the energy at the beginning.
fn most_gained<L: Lagrangian<2>>(
    system: L,
    scheme: LagrangianScheme,
    (q, v): (&[f64], &[f64]),
    until: f64,
) -> f64 {
    let mut simulation = LagrangianSimulation::new(system, scheme, q, v).unwrap();
    let (mut most, mut whole) = (f64::MIN, 0.0_f64);
    let mut watch = |_: &LagrangianSimulation<L, 2>, r: &StepReport| {
        let e = r.energy;
        whole = whole.max(e.kinetic_before);
        most = most.max(e.normal + e.tangential + e.joints);
        Control::Continue
    };
    let report = simulation.run(until, 1e-3, &mut watch).unwrap();
    assert!(report.is_solved(), "{report}");
    most / whole
}

/// Points in the plane, each over the one before it, as contacts or as limits; heights come first.
fn column(masses: &[f64], gaps: [f64; 2], e: f64, limits: bool) -> LinearSystem<2> {
    let n = masses.len();
    let mut system =
        LinearSystem::new(Csc::diagonal(&[masses, masses].concat()), Csc::zeros(2 * n, 2 * n));
    for k in 0..n {
        let gap = gaps[usize::from(k > 0)];
        let below = |first: usize| match k {
            0 => vec![(first, 1.0)],
            _ => vec![(first + k, 1.0), (first + k - 1, -1.0)],
        };
        system = match limits {
            true => system.with_limit(gap, &below(0), e),
            false => {
                let law = Law { e, ..Law::default() };
                let directions = [below(0), below(n)];
                system.with_contact(LinearContact { gap, directions, law })
            }
        };
    }
    system
}

#[test]
fn points_that_run_into_each_other_win_no_energy() {
    for e in [0.0, 0.5, 0.7, 0.9, 1.0] {
        for impact in [Impact::Newton, Impact::Fremond] {
            for activation in [Activation::Forecast { gamma: 0.5, slack: 0.0 }, Activation::Gap] {
                for masses in [&[1.0, 1.0][..], &[1.0, 30.0], &[1.0, 30.0, 900.0], &[20.0, 1.0]] {
                    for (gap, limits) in [(2e-4, true), (3e-3, true), (2e-4, false), (3e-3, false)]
                    {
                        let scheme =
                            LagrangianScheme { impact, activation, ..LagrangianScheme::default() };
                        let system = column(masses, [1.2e-3, gap], e, limits);
                        let n = masses.len();
                        let (q, v) = (vec![0.0; 2 * n], [vec![-5.0; n], vec![0.0; n]].concat());
                        let most = most_gained(system, scheme, (&q, &v), 0.1);
                        assert!(
                            most < 1e-12,
                            "{e} {impact:?} {activation:?} {masses:?} {gap} {limits}: {most:e}"
                        );
                    }
                }
            }
        }
    }
}

/// A double pendulum without weight between stops: its mass matrix couples them and turns with it.
struct Arms {
    masses: [f64; 2],
    e: [f64; 2],
    stops: [f64; 2],
}

impl Lagrangian<2> for Arms {
    fn size(&self) -> Size {
        Size::new(2).rows(4)
    }
    fn mass(&self, q: &[f64], mass: &mut Dense) {
        let [a, b] = self.masses;
        let c = b * (q[0] - q[1]).cos();
        (mass[(0, 0)], mass[(0, 1)], mass[(1, 0)], mass[(1, 1)]) = (a + b, c, c, b);
    }
    fn force(&self, _: f64, q: &[f64], v: &[f64], force: &mut [f64]) {
        let s = self.masses[1] * (q[0] - q[1]).sin();
        (force[0], force[1]) = (-s * v[1] * v[1], s * v[0] * v[0]);
    }
    fn rows(&self, _: f64, q: &[f64], x: &mut [f64]) {
        // The second stop is on the first arm.
        for (k, s) in [q[0], q[1] - q[0]].into_iter().enumerate() {
            (x[2 * k], x[2 * k + 1]) = (s + self.stops[k], self.stops[k] - s);
        }
    }
    fn row_law(&self, row: usize, _: f64, _: &[f64], _: &[f64]) -> RowLaw {
        RowLaw::Limit { e: self.e[row / 2] }
    }
}

#[test]
fn arms_between_stops_win_no_energy() {
    for masses in [[1.0, 1.0], [1.0, 20.0], [20.0, 1.0]] {
        for e in [[0.7, 0.7], [0.9, 0.3], [0.3, 0.9], [1.0, 1.0]] {
            for directions in [Directions::Iterated, Directions::Extrapolated, Directions::Frozen] {
                let scheme = LagrangianScheme { directions, ..LagrangianScheme::default() };
                let arms = Arms { masses, e, stops: [0.04, 0.03] };
                let most = most_gained(arms, scheme, (&[0.0, 0.0], &[4.0, -1.0]), 0.3);
                assert!(most < 1e-10, "{masses:?} {e:?} {directions:?}: {most:e}");
            }
        }
    }
}

//! Sweeps that go in circles, and impulses that run away.
//!
//! Exact local solves circled for ever on 2 of Siconos' 37 test problems. A smaller ω everywhere would slow down slow convergence, so it is lowered only where
//! [`WINDOW`] sweeps bring no progress at all. Where contacts without friction run away instead, the direction in which they run is offered to the judge as
//! a certificate of infeasibility.

use nonsmooth_problem::check::{Certificate, Impulses};

use crate::contact::form::Contacts;
use crate::contact::law::ContactLaw;

/// The relaxation of the present sweep, lowered where the sweeps go in circles.
///
/// Gauss–Seidel with exact local solves can enter a limit cycle (nonsymmetric W, status changes that chase each other);
/// a smaller ω breaks it. A cycle shows in two things: the smallest move of a window of sweeps is no smaller than that of
/// the window before, and one sweep does not move as the one before it did, which slow convergence and impulses that run
/// away do.
#[derive(Debug, Clone, Default)]
pub(super) struct Circles {
    omega: f64,
    omega_min: f64,
    sweeps: usize,
    smallest: f64,
    before: f64,
    /// The impulses before the last two sweeps of a window.
    marks: [Vec<f64>; 2],
}

const WINDOW: usize = 1000;
const NO_PROGRESS: f64 = 0.98;
const ALIGNED: f64 = 0.999;
const FACTOR: f64 = 0.8;

impl Circles {
    /// Prepares for impulses of length m.
    pub(super) fn resize(&mut self, m: usize) {
        for mark in &mut self.marks {
            mark.resize(m, 0.0);
        }
    }

    /// Begins a solve.
    pub(super) fn restart(&mut self, omega: f64, omega_min: f64) {
        (self.omega, self.omega_min) = (omega, omega_min);
        (self.sweeps, self.smallest, self.before) = (0, f64::INFINITY, f64::INFINITY);
    }

    /// The relaxation of the next sweep, which starts from `r`.
    pub(super) fn omega(&mut self, r: &[f64]) -> f64 {
        if let Some(last) = (self.sweeps + 2).checked_sub(WINDOW) {
            self.marks[last].copy_from_slice(r);
        }
        self.omega
    }

    /// Takes a sweep's result and its move. `unit(c)` turns impulses of contact c into velocities. A certificate that there is no
    /// solution, verified, where the impulses run away along one.
    pub(super) fn observe<P: Contacts<D>, const D: usize>(
        &mut self,
        problem: &P,
        unit: &dyn Fn(usize) -> f64,
        r: &[f64],
        estimate: f64,
    ) -> Option<Certificate> {
        self.smallest = self.smallest.min(estimate);
        self.sweeps += 1;
        if self.sweeps < WINDOW {
            return None;
        }
        let stuck = self.smallest > NO_PROGRESS * self.before;
        (self.sweeps, self.before, self.smallest) = (0, self.smallest, f64::INFINITY);
        if !stuck {
            return None;
        }
        let [first, second] = &self.marks;
        if alignment::<D>(unit, first, second, r) >= ALIGNED {
            return runaway(problem, second, r)
                .map(Certificate::from)
                .filter(|ray| problem.evidence(ray).holds());
        }
        if self.omega > self.omega_min {
            self.omega = (FACTOR * self.omega).max(self.omega_min);
        }
        None
    }
}

/// The cosine of the angle between two successive sweeps' moves, in units of velocity; 0 where nothing moved.
fn alignment<const D: usize>(
    unit: &dyn Fn(usize) -> f64,
    first: &[f64],
    second: &[f64],
    r: &[f64],
) -> f64 {
    let (mut product, mut a, mut b) = (0.0, 0.0, 0.0);
    for c in 0..r.len() / D {
        let unit = unit(c);
        for i in D * c..D * c + D {
            let x = unit * (second[i] - first[i]);
            let y = unit * (r[i] - second[i]);
            product += x * y;
            a += x * x;
            b += y * y;
        }
    }
    if a > 0.0 && b > 0.0 { product / (a * b).sqrt() } else { 0.0 }
}

/// The last move of the contacts without friction as a ray: where no motion is admissible, their impulses grow along one
/// for ever, while all others have settled. A candidate that the judge must verify.
fn runaway<P: Contacts<D>, const D: usize>(
    problem: &P,
    before: &[f64],
    r: &[f64],
) -> Option<Impulses> {
    let nc = problem.contacts();
    if !(0..nc).any(|c| problem.law(c).is_frictionless()) {
        return None;
    }
    let largest = before.iter().zip(r).fold(0.0_f64, |m, (b, r)| m.max((r - b).abs()));
    let mut ray = vec![0.0; r.len()];
    for c in 0..nc {
        let i = D * c;
        if problem.law(c).is_frictionless() {
            ray[i] = ((r[i] - before[i]) / largest).max(0.0);
        } else if (i..i + D).any(|i| (r[i] - before[i]).abs() > 1e-12 * largest) {
            return None;
        }
    }
    Some(Impulses { r: ray, lambda: vec![] })
}

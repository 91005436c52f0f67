//! The lecture's ball on a plane: a force of the size of the friction limit turns by 120° every third of its period.
//!
//! A ball of mass m lies on a horizontal plane with friction mu and does not roll: three degrees of freedom, one contact that stays closed. The force
//! (Acary2018, the example after (63)) is horizontal and of modulus `mu m g`: from rest it never moves the ball, whatever its direction. Friction of a
//! polygon in place of the disk yields in some directions sooner, and the ball creeps away; a moving ball is led astray.
//!
//! The exact motion is known ([`TurningBall::exact`]). With a = mu g, θ the angle from the force to the velocity and `s = tan(θ/2)`, during a phase of
//! constant force
//!
//! ```text
//! d|v|/dt = −a (1 − cos θ),   |v| dθ/dt = −a sin θ,     so  |v| (1 + cos θ) = C  does not change,
//! v = (C/2) (1 − s²) along the force,  C s across it,
//! t = (C/2a) (ln(s_0/s) + (s_0² − s²)/2),
//! x = (C²/4a) (ln(s_0/s) − (s_0⁴ − s⁴)/4) along,  (C²/2a) (s_0 − s + (s_0³ − s³)/3) across.
//! ```

use nonsmooth_linalg::Bsr;
use nonsmooth_problem::{FrictionLocal, Problem};
use nonsmooth_solve::{Limits, Session, SolveError};

/// The ball and what drives it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurningBall {
    /// m, kg.
    pub mass: f64,
    /// The coefficient of friction, which is also that of the force.
    pub mu: f64,
    /// g, m/s².
    pub gravity: f64,
    /// The time in which the force turns once, s.
    pub period: f64,
    /// The horizontal velocity at the beginning, m/s.
    pub velocity: [f64; 2],
}

impl Default for TurningBall {
    fn default() -> Self {
        Self { mass: 1.0, mu: 0.1, gravity: 9.81, period: 15.0, velocity: [0.0; 2] }
    }
}

/// Where the ball is, and how it moves.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BallState {
    /// s.
    pub time: f64,
    /// m.
    pub position: [f64; 2],
    /// m/s.
    pub velocity: [f64; 2],
    /// The judge's relative residual of the step that ended here: how nearly it obeys Coulomb's law. Zero at the start, and of exact motions.
    pub residual: f64,
}

impl TurningBall {
    /// The direction of the force in phase number k, counted from 0: 60°, 180°, 300° from the first axis, and again.
    pub fn direction(&self, k: usize) -> [f64; 2] {
        let half = 3.0_f64.sqrt() / 2.0;
        [[0.5, half], [-1.0, 0.0], [0.5, -half]][k % 3]
    }

    /// The exact motion with Coulomb's cone, `count` states a phase, from the start to the end of phase number `phases − 1`.
    pub fn exact(&self, phases: usize, count: usize) -> Vec<BallState> {
        let mut at = BallState { velocity: self.velocity, ..BallState::default() };
        let mut path = vec![at];
        let long = self.period / 3.0;
        for k in 0..phases {
            let phase =
                |j: usize| self.during(&at, self.direction(k), long * j as f64 / count as f64);
            path.extend((1..=count).map(phase));
            at = path[path.len() - 1];
        }
        path
    }

    /// The exact state a time t after `start`, the force pointing along the unit vector e all the while.
    fn during(&self, start: &BallState, e: [f64; 2], t: f64) -> BallState {
        let a = self.mu * self.gravity;
        let along = start.velocity[0] * e[0] + start.velocity[1] * e[1];
        let across = start.velocity[1] * e[0] - start.velocity[0] * e[1];
        let (v, x) = straight_or_turning(along, across, a, t);
        let out = |y: [f64; 2]| [y[0] * e[0] - y[1] * e[1], y[0] * e[1] + y[1] * e[0]];
        let [dx, dy] = out(x);
        let position = [start.position[0] + dx, start.position[1] + dy];
        BallState { time: start.time + t, position, velocity: out(v), residual: 0.0 }
    }

    /// The motion by Moreau–Jean's scheme with θ = 1/2 and `steps` steps a phase, the contact problem of each step solved by `session`; one state a step.
    ///
    /// A step whose problem is not solved is taken all the same, by the impulses found: facets obey Coulomb's law only nearly. How nearly,
    /// each state says.
    ///
    /// Errors: those of the session.
    pub fn path(
        &self,
        session: &mut dyn Session<FrictionLocal<3>>,
        limits: &Limits,
        phases: usize,
        steps: usize,
    ) -> Result<Vec<BallState>, SolveError> {
        let Self { mass, mu, gravity, .. } = *self;
        let h = self.period / (3 * steps) as f64;
        let diagonal: [[f64; 3]; 3] =
            std::array::from_fn(|k| std::array::from_fn(|l| if k == l { 1.0 / mass } else { 0.0 }));
        let w = Bsr::from_rows(1, &[vec![(0, diagonal)]]);
        // The contact's frame is [N, T1, T2] with T1 and T2 along the axes of the plane, so q is the free velocity.
        let mut problem = FrictionLocal::new(w, vec![0.0; 3], vec![mu])?;
        let mut point = problem.origin();
        let mut at = BallState { velocity: self.velocity, ..BallState::default() };
        let mut path = vec![at];
        for step in 0..phases * steps {
            let e = self.direction(step / steps);
            let [vx, vy] = at.velocity;
            let push = h * mu * gravity;
            problem.q.copy_from_slice(&[-h * gravity, vx + push * e[0], vy + push * e[1]]);
            let outcome = session.solve(&problem, &mut point, limits, &mut |_| {})?;
            let [qx, qy] = [problem.q[1], problem.q[2]];
            let v = [qx + point.r[1] / mass, qy + point.r[2] / mass];
            for k in 0..2 {
                at.position[k] += 0.5 * h * (v[k] + at.velocity[k]);
            }
            at.velocity = v;
            at.time = h * (step + 1) as f64;
            at.residual = outcome.measure.relative;
            path.push(at);
        }
        Ok(path)
    }
}

/// Velocity and displacement after t, in components along the force and across it.
fn straight_or_turning(along: f64, across: f64, a: f64, t: f64) -> ([f64; 2], [f64; 2]) {
    let speed = along.hypot(across);
    let c = speed + along; //                                 |v| (1 + cos θ)
    if c <= 1e-14 * speed {
        // Against the force: both slow the ball down, and it stays where it stops.
        let time = t.min(speed / (2.0 * a));
        let left = speed - 2.0 * a * time;
        return ([-left, 0.0], [-0.5 * (speed + left) * time, 0.0]);
    }
    let s0 = across.abs() / c; //                             tan(θ/2)
    if s0 < 1e-300 {
        return ([along, 0.0], [along * t, 0.0]);
    }
    // l = ln(s_0/s) grows with t; the left-hand side is concave in it, so Newton's method from 2at/C comes down monotonically.
    let target = 2.0 * a * t / c;
    let mut l = target;
    for _ in 0..200 {
        let square = s0 * s0 * (-2.0 * l).exp();
        let value = l + 0.5 * (s0 * s0 - square) - target;
        let step = value / (1.0 + square);
        l = (l - step).max(0.0);
        if step.abs() <= 1e-16 * l {
            break;
        }
    }
    let s = s0 * (-l).exp();
    let sign = across.signum();
    let x = c * c / (4.0 * a) * (l - (s0.powi(4) - s.powi(4)) / 4.0);
    let y = c * c / (2.0 * a) * (s0 - s + (s0.powi(3) - s.powi(3)) / 3.0);
    ([0.5 * c * (1.0 - s * s), sign * c * s], [x, sign * y])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Classical Runge–Kutta on `v' = a (e − v/|v|)`, `x' = v`.
    fn integrated(v: [f64; 2], a: f64, t: f64, steps: usize) -> ([f64; 2], [f64; 2]) {
        let rate = |y: [f64; 4]| {
            let speed = y[2].hypot(y[3]);
            [y[2], y[3], a * (1.0 - y[2] / speed), -a * y[3] / speed]
        };
        let h = t / steps as f64;
        let mut y = [0.0, 0.0, v[0], v[1]];
        for _ in 0..steps {
            let shifted = |k: [f64; 4], f: f64| std::array::from_fn(|i| y[i] + f * h * k[i]);
            let k1 = rate(y);
            let k2 = rate(shifted(k1, 0.5));
            let k3 = rate(shifted(k2, 0.5));
            let k4 = rate(shifted(k3, 1.0));
            y = std::array::from_fn(|i| {
                y[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])
            });
        }
        ([y[2], y[3]], [y[0], y[1]])
    }

    #[test]
    fn the_closed_form_solves_the_equation_of_motion() {
        for v in [[1.0, 2.0], [-1.5, 1.0], [-2.0, -0.3], [0.5, -3.0]] {
            for t in [0.1, 1.0, 5.0] {
                let (velocity, place) = straight_or_turning(v[0], v[1], 0.981, t);
                let (w, x) = integrated(v, 0.981, t, 200_000);
                for k in 0..2 {
                    assert!((velocity[k] - w[k]).abs() < 1e-8, "{v:?} {t}: {velocity:?} {w:?}");
                    assert!((place[k] - x[k]).abs() < 1e-8, "{v:?} {t}: {place:?} {x:?}");
                }
            }
        }
    }

    #[test]
    fn straight_ways() {
        assert_eq!(straight_or_turning(2.0, 0.0, 1.0, 3.0), ([2.0, 0.0], [6.0, 0.0]));
        assert_eq!(straight_or_turning(-2.0, 0.0, 1.0, 3.0), ([0.0, 0.0], [-1.0, 0.0]));
        assert_eq!(straight_or_turning(0.0, 0.0, 1.0, 3.0), ([0.0, 0.0], [0.0, 0.0]));
        let rest = TurningBall::default().exact(3, 4);
        assert!(rest.iter().all(|s| s.position == [0.0; 2] && s.velocity == [0.0; 2]));
    }
}

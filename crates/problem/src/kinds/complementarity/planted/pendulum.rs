//! A pendulum of many links beside a wall: a frictionless step that is nonlinear.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Mcp;
use crate::field::{Binary, Expressions, Graph, Id, Node, Unary};
use crate::planted::{Recipe, size};

/// A step of a pendulum of n links of mass and length 1/n, with a mass at the end of each, that swings against a wall: the frictionless step with Newton's impact law whose mass, forces and contact
/// directions are those of the end of the step, `θ⁺ = θ + h v⁺`,
///
/// ```text
/// M(θ⁺) (v⁺ − v) + h (C(θ⁺, v⁺) + G(θ⁺)) = H(θ⁺) P                   v⁺ free
/// 0 ≤ H_k(θ⁺)ᵀ v⁺ + e H_k(θ)ᵀ v  ⟂  P_k ≥ 0,   k with g_k(θ + h v/2) ≤ 0
/// ```
///
/// with `M_ij = l² m (n − max(i, j)) cos(θ_i − θ_j)` (i, j from 0), `C_i = Σ_j l² m (n − max(i, j)) sin(θ_i − θ_j) v_j²`, `G_i = m g l (n − i) sin θ_i`, gaps
/// `g_k = wall − Σ_{i ≤ k} l sin θ_i`, H_k their gradients, and θ from the vertical. The variables are v⁺, then the impulses of the contacts.
///
/// Source: Acary2018 (77), with the index set (2).
///
/// ```
/// use nonsmooth_problem::planted::PendulumStep;
///
/// let problem = PendulumStep { links: 3, ..PendulumStep::default() }.mcp();
/// // Three speeds, and three masses that touch the wall.
/// assert_eq!(problem.dim(), 6);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PendulumStep {
    /// The number of links n.
    pub links: usize,
    /// The angle of every link before the step, rad.
    pub angle: f64,
    /// The angular speed of every link before the step, rad/s.
    pub speed: f64,
    /// The distance of the wall from the hinge, m.
    pub wall: f64,
    /// The coefficient of restitution e.
    pub restitution: f64,
    /// The length of the step h, s.
    pub step: f64,
}

impl Default for PendulumStep {
    fn default() -> Self {
        Self { links: 5, angle: 0.0, speed: 1.0, wall: 0.0, restitution: 0.5, step: 0.01 }
    }
}

impl Recipe for PendulumStep {
    fn validate(&self) -> Result<(), String> {
        // Every link feels every other one.
        size("links", self.links, 1..=300)?;
        for (key, x) in [("angle", self.angle), ("speed", self.speed), ("wall", self.wall)] {
            if !x.is_finite() {
                return Err(format!("{key}: expected a finite number, found {x}"));
            }
        }
        if !(0.0..=1.0).contains(&self.restitution) {
            let found = self.restitution;
            return Err(format!("restitution: expected a number from 0 to 1, found {found}"));
        }
        match self.step > 0.0 && self.step.is_finite() {
            true => Ok(()),
            false => Err(format!("step: expected a positive number, found {}", self.step)),
        }
    }
}

/// m/s²
const GRAVITY: f64 = 9.81;

impl PendulumStep {
    /// The first step, of links in line; it starts at the speeds before the step, without impulses.
    pub fn mcp(&self) -> Mcp {
        self.after(&vec![self.angle; self.links], &vec![self.speed; self.links])
    }

    /// The length of a link, and its mass.
    fn link(&self) -> f64 {
        1.0 / self.links as f64
    }

    /// The factor of `cos(θ_i − θ_j)` in M.
    fn inertia(&self, i: usize, j: usize) -> f64 {
        self.link().powi(3) * (self.links - i.max(j)) as f64
    }

    /// The gaps of the masses at these angles.
    pub fn gaps(&self, angles: &[f64]) -> Vec<f64> {
        let mut gap = self.wall;
        let next = |angle: &f64| {
            gap -= self.link() * angle.sin();
            gap
        };
        angles.iter().map(next).collect()
    }

    /// The kinetic and potential energy.
    pub fn energy(&self, angles: &[f64], speeds: &[f64]) -> f64 {
        let l = self.link();
        let n = self.links;
        let pair = |i: usize, j: usize| {
            self.inertia(i, j) * (angles[i] - angles[j]).cos() * speeds[i] * speeds[j]
        };
        let kinetic: f64 = (0..n).flat_map(|i| (0..n).map(move |j| pair(i, j))).sum();
        let height = |i: usize| -l * l * (n - i) as f64 * angles[i].cos();
        0.5 * kinetic + GRAVITY * (0..n).map(height).sum::<f64>()
    }

    /// The step from these angles and speeds, n each.
    ///
    /// # Panics
    ///
    /// On other numbers of them, or some that are not finite.
    pub fn after(&self, angles: &[f64], speeds: &[f64]) -> Mcp {
        let (n, h, l) = (self.links, self.step, self.link());
        assert!(angles.len() == n && speeds.len() == n, "an angle and a speed for each link");
        let middle: Vec<f64> = angles.iter().zip(speeds).map(|(q, v)| q + 0.5 * h * v).collect();
        let gaps = self.gaps(&middle);
        let contacts: Vec<usize> = (0..n).filter(|&k| gaps[k] <= 0.0).collect();

        let mut g = Graph::new(n + contacts.len());
        let shifted = |g: &mut Graph, terms: Vec<(usize, f64)>, constant: f64| {
            let linear = g.add(Node::Linear(terms));
            let constant = g.constant(constant);
            g.binary(Binary::Add, linear, constant)
        };
        let scaled = |g: &mut Graph, c: f64, x: Id| {
            let c = g.constant(c);
            g.binary(Binary::Mul, c, x)
        };
        let ends: Vec<Id> = (0..n).map(|i| shifted(&mut g, vec![(i, h)], angles[i])).collect();
        let cosines: Vec<Id> = ends.iter().map(|q| g.unary(Unary::Cos, *q)).collect();
        let changes: Vec<Id> =
            (0..n).map(|j| shifted(&mut g, vec![(j, 1.0)], -speeds[j])).collect();
        let squares: Vec<Id> = (0..n)
            .map(|j| {
                let v = g.variable(j);
                g.unary(Unary::Square, v)
            })
            .collect();
        let mut rows = Vec::with_capacity(n + contacts.len());
        for i in 0..n {
            let mut terms = vec![scaled(&mut g, self.inertia(i, i), changes[i])];
            for j in (0..n).filter(|&j| j != i) {
                let between = vec![(i, h), (j, -h)];
                let angle = shifted(&mut g, between, angles[i] - angles[j]);
                let [cos, sin] = [Unary::Cos, Unary::Sin].map(|f| g.unary(f, angle));
                let inertial = g.binary(Binary::Mul, cos, changes[j]);
                let turning = g.binary(Binary::Mul, sin, squares[j]);
                terms.push(scaled(&mut g, self.inertia(i, j), inertial));
                terms.push(scaled(&mut g, h * self.inertia(i, j), turning));
            }
            let sin = g.unary(Unary::Sin, ends[i]);
            terms.push(scaled(&mut g, h * GRAVITY * l * l * (n - i) as f64, sin));
            // −H P, of the masses at this link and below.
            let below = contacts.iter().enumerate().filter(|(_, k)| **k >= i);
            let impulses: Vec<_> = below.map(|(c, _)| (n + c, l)).collect();
            if !impulses.is_empty() {
                let impulses = g.add(Node::Linear(impulses));
                terms.push(g.binary(Binary::Mul, cosines[i], impulses));
            }
            rows.push(g.sum(terms));
        }
        for &k in &contacts {
            let before: f64 = (0..=k).map(|i| -l * angles[i].cos() * speeds[i]).sum();
            let mut terms = vec![g.constant(self.restitution * before)];
            for i in 0..=k {
                let v = g.add(Node::Linear(vec![(i, -l)]));
                terms.push(g.binary(Binary::Mul, cosines[i], v));
            }
            rows.push(g.sum(terms));
        }
        let f = Expressions::new(g, rows).expect("as many rows as variables");
        let impulses = vec![0.0; contacts.len()];
        let lower = [vec![f64::NEG_INFINITY; n], impulses.clone()].concat();
        let start = [speeds, &impulses].concat();
        let upper = vec![f64::INFINITY; start.len()];
        Mcp::new(f, lower, upper, start).expect("finite angles and speeds")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LcpPoint;
    use crate::check::Judged;

    /// One link bounces off with e times its speed, as seen along the wall's normal at the end of the step.
    #[test]
    fn a_single_link_bounces() {
        for (angle, restitution) in [(0.3_f64, 0.5), (-0.2, 1.0), (0.5, 0.0)] {
            let recipe = PendulumStep {
                links: 1,
                angle,
                speed: 2.0,
                wall: angle.sin(),
                restitution,
                step: 0.02,
            };
            let problem = recipe.mcp();
            assert_eq!(problem.dim(), 2);
            let mut v = 0.0;
            for _ in 0..50 {
                v = -restitution * angle.cos() * 2.0 / (angle + 0.02 * v).cos();
            }
            let end = angle + 0.02 * v;
            let p = -((v - 2.0) + 0.02 * GRAVITY * end.sin()) / end.cos();
            let verdict = problem.judge(&LcpPoint { z: vec![v, p] }, 1e-12).unwrap();
            assert!(p > 0.0 && verdict.solved, "{angle} {restitution}: {:?}", verdict.measure);
            let through = LcpPoint { z: vec![2.0, 0.0] };
            assert!(!problem.judge(&through, 1e-3).unwrap().solved);
        }
    }

    /// Away from the wall no contact is stated; the masses that are forecast to have passed it are.
    #[test]
    fn contacts_are_those_that_are_forecast() {
        let recipe = PendulumStep { links: 4, wall: 0.3, ..PendulumStep::default() };
        assert_eq!(recipe.mcp().dim(), 4);
        // The gaps in the middle of the step are .3 − .25 k sin 0.405.
        let touching = PendulumStep { angle: 0.4, ..recipe };
        let gaps = touching.gaps(&[0.405; 4]);
        assert_eq!(gaps.iter().filter(|g| **g <= 0.0).count(), 1);
        assert_eq!(touching.mcp().dim(), 5);
    }
}

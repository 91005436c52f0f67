//! Variational inequalities of any size with a planted solution, by expressions.
//!
//! | maker | problem | set |
//! | --- | --- | --- |
//! | [`Traffic`] | drivers in a grid of streets, each on a way that no other beats | a polyhedron: flows that begin and end where they shall |
//! | [`BallsAndCones`] | `M x + D arctan x + q`, strongly monotone | a product of balls and second-order cones |

use nonsmooth_linalg::Csc;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::field::{Binary, Expressions, Graph, Node, Unary};
use crate::kinds::complementarity::planted::with_values;
use crate::planted::{Recipe, share, size};
use crate::{LcpPoint, Set, Vi};

/// Wardrop's equilibrium: of each stream k from one crossing of a grid to another, `x_ka ≥ 0` on street a, so that what a street takes, with all streams on it, makes no way in use
/// longer than another. A street's time is `t_a (1 + 0.15 ((v_a + γ v_b)/c_a)^4)`, `v_a = Σ_k x_ka`, b the other direction: for γ > 0 no gradient.
///
/// ```text
/// F_ka(x) = the time of a,   X = { x ≥ 0, what leaves a crossing less what arrives = what begins or ends there, for each k }
/// ```
///
/// The times at the equilibrium are drawn, all streams go the shortest ways, and t follows.
///
/// Source: Dafermos1980; FacchineiPang2003, section 1.4.5.
///
/// ```
/// use nonsmooth_problem::check::Judged;
/// use nonsmooth_problem::planted::Traffic;
///
/// let (problem, known) = Traffic::default().vi();
/// assert!(problem.judge(&known, 1e-12)?.solved);
/// # Ok::<(), nonsmooth_problem::ProblemError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Traffic {
    /// Crossings along each side of the grid, at least 2: 4 m (m - 1) streets.
    pub m: usize,
    /// Streams; each has a variable for each street.
    pub streams: usize,
    /// What a car in the other direction counts.
    pub gamma: f64,
    /// The seed: the same seed gives the same problem to the bit.
    pub seed: u64,
}

impl Default for Traffic {
    fn default() -> Self {
        Self { m: 3, streams: 3, gamma: 0.3, seed: 0 }
    }
}

impl Recipe for Traffic {
    fn validate(&self) -> Result<(), String> {
        size("m", self.m, 2..=15)?;
        size("streams", self.streams, 1..=10)?;
        share("gamma", self.gamma)
    }
}

impl Traffic {
    /// The streets, by the crossings where they begin and end; the other direction of one is its neighbour.
    fn streets(&self) -> Vec<(usize, usize)> {
        let m = self.m;
        let crossings = (0..m * m).flat_map(|k| {
            let right = (k % m + 1 < m).then_some((k, k + 1));
            let up = (k / m + 1 < m).then_some((k, k + m));
            right.into_iter().chain(up)
        });
        crossings.flat_map(|(a, b)| [(a, b), (b, a)]).collect()
    }

    /// `x[k,a,b]` of the stream k, from 1, on the street from crossing a to crossing b, from 0.
    pub fn names(&self) -> Vec<String> {
        let streets = self.streets();
        let of = |k: usize| streets.iter().map(move |(a, b)| format!("x[{k},{a},{b}]"));
        (1..=self.streams).flat_map(of).collect()
    }

    /// The problem and its equilibrium.
    pub fn vi(&self) -> (Vi, LcpPoint) {
        let (streets, crossings) = (self.streets(), self.m * self.m);
        let (count, n) = (streets.len(), streets.len() * self.streams);
        let mut rng = Pcg64::seed_from_u64(self.seed);
        let times: Vec<f64> = (0..count).map(|_| rng.random_range(1.0..2.0)).collect();
        let (mut x, mut rows, mut sums) = (vec![0.0; n], vec![], vec![]);
        for k in 0..self.streams {
            let from = rng.random_range(0..crossings);
            let to = (from + rng.random_range(1..crossings)) % crossings;
            let demand = rng.random_range(1.0..3.0);
            for a in shortest(&streets, &times, crossings, from, to) {
                x[k * count + a] = demand;
            }
            // The row of the end follows from the others.
            let first = sums.len();
            let row = |at: usize| (at != to).then(|| first + at - usize::from(at > to));
            for (a, &(begin, end)) in streets.iter().enumerate() {
                rows.extend(row(begin).map(|i| (i, k * count + a, 1.0)));
                rows.extend(row(end).map(|i| (i, k * count + a, -1.0)));
            }
            sums.resize(first + crossings - 1, 0.0);
            row(from).into_iter().for_each(|i| sums[i] = demand);
        }
        let flow = |a: usize| (0..self.streams).map(|k| x[k * count + a]).sum::<f64>();
        let mut g = Graph::new(n);
        let of_streets: Vec<_> = (0..count)
            .map(|a| {
                let capacity = rng.random_range(2.0..4.0);
                let load = (flow(a) + self.gamma * flow(a ^ 1)) / capacity;
                let least = times[a] / (1.0 + 0.15 * load.powi(4));
                let all = |a: usize, c: f64| (0..self.streams).map(move |k| (k * count + a, c));
                let mut terms: Vec<_> = all(a, 1.0 / capacity).collect();
                if self.gamma > 0.0 {
                    terms.extend(all(a ^ 1, self.gamma / capacity));
                }
                let load = g.add(Node::Linear(terms));
                let [four, slope, least] = [4.0, 0.15 * least, least].map(|x| g.constant(x));
                let power = g.binary(Binary::Pow, load, four);
                let more = g.binary(Binary::Mul, slope, power);
                g.binary(Binary::Add, least, more)
            })
            .collect();
        let all = (0..self.streams).flat_map(|_| of_streets.iter().copied()).collect();
        let field = Expressions::new(g, all).expect("as many rows as variables");
        let signs = (0..n).map(|i| (i, i, -1.0));
        let set = Set::Polyhedron {
            A: Csc::from_triplets(n, n, signs).expect("indices below n"),
            b: vec![0.0; n],
            C: Csc::from_triplets(sums.len(), n, rows.into_iter()).expect("indices below n"),
            d: sums,
        };
        let problem = Vi::new(field, set, vec![0.0; n]).expect("a valid set and start");
        (problem, LcpPoint { z: x })
    }
}

/// The streets of the shortest way between two crossings , street by street until no arrival is earlier.
fn shortest(
    streets: &[(usize, usize)],
    times: &[f64],
    crossings: usize,
    from: usize,
    to: usize,
) -> Vec<usize> {
    let mut arrival = vec![(f64::INFINITY, usize::MAX); crossings];
    arrival[from].0 = 0.0;
    let mut changed = true;
    while std::mem::take(&mut changed) {
        for (a, &(begin, end)) in streets.iter().enumerate() {
            let time = arrival[begin].0 + times[a];
            if time < arrival[end].0 {
                (arrival[end], changed) = ((time, a), true);
            }
        }
    }
    let mut way = vec![];
    let mut at = to;
    while at != from {
        way.push(arrival[at].1);
        at = streets[arrival[at].1].0;
    }
    way
}

/// `F(x) = M x + D arctan x + q` over a product of balls and second-order cones, M a positive diagonal with a skew matrix, D in (0, 1): strongly monotone, hence with one solution, which is planted: on the
/// border of a part of the sets (of every second such cone at its point), inside the others.
///
/// ```
/// use nonsmooth_problem::check::Judged;
/// use nonsmooth_problem::planted::BallsAndCones;
///
/// let (problem, known) = BallsAndCones::default().vi();
/// assert!(problem.judge(&known, 1e-12)?.solved);
/// # Ok::<(), nonsmooth_problem::ProblemError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct BallsAndCones {
    /// The number of balls.
    pub balls: usize,
    /// The number of second-order cones.
    pub cones: usize,
    /// The variables of each, at least 2.
    pub dimension: usize,
    /// The share of sets on whose border the solution is.
    pub active: f64,
    /// How large the skew matrix is beside the diagonal.
    pub turning: f64,
    /// The seed: the same seed gives the same problem to the bit.
    pub seed: u64,
}

impl Default for BallsAndCones {
    fn default() -> Self {
        Self { balls: 2, cones: 3, dimension: 3, active: 0.7, turning: 1.0, seed: 0 }
    }
}

impl Recipe for BallsAndCones {
    fn validate(&self) -> Result<(), String> {
        size("dimension", self.dimension, 2..=1000)?;
        size("balls", self.balls, 0..=1000)?;
        size("cones", self.cones, 0..=1000)?;
        let n = (self.balls + self.cones) * self.dimension;
        if !(1..=1000).contains(&n) {
            // The texts of a file are dense.
            return Err(format!(
                "balls, cones: expected from 1 to 1000 variables in all, found {n}"
            ));
        }
        if !(0.0..=100.0).contains(&self.turning) {
            return Err(format!(
                "turning: expected a number from 0 to 100, found {}",
                self.turning
            ));
        }
        share("active", self.active)
    }
}

impl BallsAndCones {
    /// The problem and its solution.
    pub fn vi(&self) -> (Vi, LcpPoint) {
        let (sets, d) = (self.balls + self.cones, self.dimension);
        let n = sets * d;
        let mut rng = Pcg64::seed_from_u64(self.seed);
        let (mut parts, mut x, mut w) = (vec![], vec![], vec![]);
        for k in 0..sets {
            let active = rng.random::<f64>() < self.active;
            let force = if active { rng.random_range(0.5..2.0) } else { 0.0 };
            if k < self.balls {
                let u = direction(&mut rng, d);
                let centre: Vec<f64> = (0..d).map(|_| rng.random_range(-1.0..1.0)).collect();
                let radius = rng.random_range(0.5..2.0);
                let far = if active { radius } else { 0.5 * radius };
                x.extend(centre.iter().zip(&u).map(|(c, u)| c + far * u));
                w.extend(u.iter().map(|u| -force * u));
                parts.push(Set::Ball { centre, radius });
                continue;
            }
            let u = direction(&mut rng, d - 1);
            let point = active && (k - self.balls) % 2 == 1;
            let height = if point { 0.0 } else { rng.random_range(0.5..2.0) };
            // At the point w is inside the dual cone, on the border on its border, opposite.
            let (far, push) = match (active, point) {
                (true, true) => (0.0, 0.5),
                (true, false) => (height, 1.0),
                (false, _) => (0.5 * height, 0.0),
            };
            x.push(height);
            x.extend(u.iter().map(|u| far * u));
            w.push(force);
            w.extend(u.iter().map(|u| -push * force * u));
            parts.push(Set::SecondOrderCone { dimension: d });
        }
        let mut m = vec![0.0; n * n];
        for i in 0..n {
            m[i * n + i] = rng.random_range(1.0..2.0);
            for j in 0..i {
                let skew = self.turning * rng.random_range(-1.0..1.0) / (n as f64).sqrt();
                (m[i * n + j], m[j * n + i]) = (skew, -skew);
            }
        }
        let bend: Vec<f64> = (0..n).map(|_| rng.random_range(0.0..1.0)).collect();
        let f = |q: &[f64]| {
            let mut g = Graph::new(n);
            let rows = (0..n).map(|i| {
                let row = m[i * n..(i + 1) * n].iter().copied().enumerate();
                let linear = g.add(Node::Linear(row.filter(|a| a.1 != 0.0).collect()));
                let (x, factor) = (g.variable(i), g.constant(bend[i]));
                let arctan = g.unary(Unary::Atan, x);
                let bent = g.binary(Binary::Mul, factor, arctan);
                let q = g.constant(q[i]);
                g.sum(vec![linear, bent, q])
            });
            let rows = rows.collect();
            Expressions::new(g, rows).expect("as many rows as variables")
        };
        let field = with_values(f, &x, &w);
        let problem = Vi::new(field, Set::Product(parts), vec![0.0; n]);
        (problem.expect("valid sets and start"), LcpPoint { z: x })
    }
}

/// A unit vector.
fn direction(rng: &mut Pcg64, n: usize) -> Vec<f64> {
    loop {
        let x: Vec<f64> = (0..n).map(|_| rng.random_range(-1.0..1.0)).collect();
        let size = nonsmooth_linalg::norm(&x);
        if size > 0.1 {
            return x.iter().map(|x| x / size).collect();
        }
    }
}

//! Nonlinear complementarity problems of any size, by expressions, and small ones of the literature.
//!
//! | maker | problem | solution |
//! | --- | --- | --- |
//! | [`HarkerPang`] | `M x + D arctan x + q`, strongly monotone, dense | planted |
//! | [`NashCournot`] | firms that choose their outputs, and the price of the market | planted |
//! | [`Bratu`] | a reaction that heats itself, between bounds, on a grid | not known |
//! | [`NonlinearClassic`] | worked examples | all, or one |

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::field::{Binary, Expressions, Field, Graph, Id, Node, Unary};
use crate::planted::{Recipe, share, size};
use crate::{LcpPoint, Mcp};

/// Adds what makes of F its value `w` at x: `F + (w − F(x))`, summed in doubled precision and rounded once.
pub(crate) fn with_values(f: impl Fn(&[f64]) -> Expressions, x: &[f64], w: &[f64]) -> Expressions {
    let mut at_zero = vec![0.0; x.len()];
    f(&at_zero).evaluator().precisely(x, &mut at_zero);
    f(&w.iter().zip(&at_zero).map(|(w, f)| w - f).collect::<Vec<_>>())
}

/// `0 ≤ x ⟂ M x + D arctan x + q ≥ 0` with `M = AᵀA + B + diag`, B skew, entries of A and B in (−5, 5), of the diagonal in (0, 0.3), and D in (0, 1): strongly
/// monotone, hence with one solution, which is planted.
///
/// Source: HarkerPang1990 for M.
///
/// ```
/// use nonsmooth_problem::check::Judged;
/// use nonsmooth_problem::planted::HarkerPang;
///
/// let (problem, known) = HarkerPang { n: 30, ..HarkerPang::default() }.mcp();
/// assert!(problem.judge(&known, 1e-12)?.solved);
/// # Ok::<(), nonsmooth_problem::ProblemError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct HarkerPang {
    /// The number of variables.
    pub n: usize,
    /// The share of variables with x > 0 among those that are not degenerate.
    pub active: f64,
    /// The share of variables with x = F = 0.
    pub degenerate: f64,
    /// The seed: the same seed gives the same problem to the bit.
    pub seed: u64,
}

impl Default for HarkerPang {
    fn default() -> Self {
        Self { n: 20, active: 0.5, degenerate: 0.0, seed: 0 }
    }
}

impl Recipe for HarkerPang {
    fn validate(&self) -> Result<(), String> {
        // The texts of a file are dense.
        size("n", self.n, 1..=1000)?;
        share("active", self.active)?;
        share("degenerate", self.degenerate)
    }
}

impl HarkerPang {
    /// The problem and its solution.
    pub fn mcp(&self) -> (Mcp, LcpPoint) {
        let n = self.n;
        let mut rng = Pcg64::seed_from_u64(self.seed);
        let a: Vec<f64> = (0..n * n).map(|_| rng.random_range(-5.0..5.0)).collect();
        let mut m = vec![0.0; n * n];
        for i in 0..n {
            for j in i..n {
                let dot: f64 = (0..n).map(|k| a[k * n + i] * a[k * n + j]).sum();
                let skew = if i == j { 0.0 } else { rng.random_range(-5.0..5.0) };
                (m[i * n + j], m[j * n + i]) = (dot + skew, dot - skew);
            }
            m[i * n + i] += rng.random_range(0.0..0.3);
        }
        let d: Vec<f64> = (0..n).map(|_| rng.random_range(0.0..1.0)).collect();
        let pairs = (0..n).map(|_| {
            let size = rng.random_range(1.0..2.0);
            match (rng.random::<f64>() < self.degenerate, rng.random::<f64>() < self.active) {
                (true, _) => (0.0, 0.0),
                (_, true) => (size, 0.0),
                (_, false) => (0.0, size),
            }
        });
        let (x, w): (Vec<f64>, Vec<f64>) = pairs.unzip();
        let f = |q: &[f64]| {
            let mut g = Graph::new(n);
            let variables: Vec<_> = (0..n).map(|i| g.variable(i)).collect();
            let rows = (0..n).map(|i| {
                let linear = (0..n).map(|j| (j, m[i * n + j])).collect();
                let linear = g.add(Node::Linear(linear));
                let arctan = g.unary(Unary::Atan, variables[i]);
                let factor = g.constant(d[i]);
                let bent = g.binary(Binary::Mul, factor, arctan);
                let q = g.constant(q[i]);
                g.sum(vec![linear, bent, q])
            });
            let rows = rows.collect();
            made(g, rows)
        };
        let f = with_values(f, &x, &w);
        (Mcp::ncp(f, vec![0.0; n]).expect("as many rows as variables"), LcpPoint { z: x })
    }
}

fn made(graph: Graph, rows: Vec<Id>) -> Expressions {
    Expressions::new(graph, rows).expect("as many rows as variables")
}

/// Firms `i = 1, …, n` that sell `q_i ≥ 0` of the same good so that no other output earns one of them more, and the price p at which a market of constant
/// elasticity takes the sum: marginal cost less marginal revenue, and supply less demand,
///
/// ```text
/// 0 ≤ q_i ⟂ c_i + (q_i/L_i)^{1/β_i} − p + q_i p^{γ+1}/(γ d) ≥ 0
/// 0 < p   ⟂ Σ q_i − d p^{−γ} ≥ 0
/// ```
///
/// The equilibrium is planted: outputs in (10, 20) or 0, `p = 20`; c, L and d follow. β is drawn from (0.6, 1.2).
///
/// Source: MurphySheraliSoyster1982.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct NashCournot {
    /// The number of firms, at least 2; there is one variable more.
    pub firms: usize,
    /// The share of firms that sell nothing at the equilibrium; two firms sell.
    pub idle: f64,
    /// The elasticity of the demand, above 1.
    pub elasticity: f64,
    /// The seed: the same seed gives the same problem to the bit.
    pub seed: u64,
}

impl Default for NashCournot {
    fn default() -> Self {
        Self { firms: 5, idle: 0.0, elasticity: 1.1, seed: 0 }
    }
}

impl Recipe for NashCournot {
    fn validate(&self) -> Result<(), String> {
        size("firms", self.firms, 2..=200_000)?;
        share("idle", self.idle)?;
        match self.elasticity > 1.0 && self.elasticity <= 10.0 {
            true => Ok(()),
            false => Err(format!(
                "elasticity: expected a number above 1, of at most 10, found {}",
                self.elasticity
            )),
        }
    }
}

impl NashCournot {
    /// The problem and its equilibrium.
    pub fn mcp(&self) -> (Mcp, LcpPoint) {
        const PRICE: f64 = 20.0;
        let (n, gamma) = (self.firms, self.elasticity);
        let mut rng = Pcg64::seed_from_u64(self.seed);
        let mut x: Vec<f64> = (0..n)
            .map(|i| match rng.random::<f64>() < self.idle && i > 1 {
                true => 0.0,
                false => rng.random_range(10.0..20.0),
            })
            .collect();
        let w: Vec<f64> = x.iter().map(|q| if *q > 0.0 { 0.0 } else { 1.0 }).chain([0.0]).collect();
        let demand = x.iter().sum::<f64>() * PRICE.powf(gamma);
        let firms: Vec<_> = x
            .iter()
            .map(|&q| {
                let beta: f64 = rng.random_range(0.6..1.2);
                // What the last unit costs beside c, where the firm sells.
                let last: f64 = rng.random_range(2.0..6.0);
                (if q > 0.0 { q / last.powf(beta) } else { 5.0 }, 1.0 / beta)
            })
            .collect();
        x.push(PRICE);
        let f = |c: &[f64]| {
            let mut g = Graph::new(n + 1);
            let p = g.variable(n);
            let exponent = g.constant(gamma + 1.0);
            let power = g.binary(Binary::Pow, p, exponent);
            let unit = g.constant(gamma * demand);
            let slope = g.binary(Binary::Div, power, unit);
            let mut rows: Vec<Id> = (0..n)
                .map(|i| {
                    let (q, c) = (g.variable(i), g.constant(c[i]));
                    let [scale, exponent] = [firms[i].0, firms[i].1].map(|x| g.constant(x));
                    let relative = g.binary(Binary::Div, q, scale);
                    let last = g.binary(Binary::Pow, relative, exponent);
                    let cost = g.binary(Binary::Add, c, last);
                    let margin = g.binary(Binary::Sub, cost, p);
                    let loss = g.binary(Binary::Mul, q, slope);
                    g.binary(Binary::Add, margin, loss)
                })
                .collect();
            let supply = g.add(Node::Linear((0..n).map(|i| (i, 1.0)).collect()));
            let [d, exponent] = [demand, -gamma].map(|x| g.constant(x));
            let power = g.binary(Binary::Pow, p, exponent);
            let sold = g.binary(Binary::Mul, d, power);
            let surplus = g.binary(Binary::Sub, supply, sold);
            let rest = g.constant(c[n]);
            rows.push(g.binary(Binary::Add, surplus, rest));
            made(g, rows)
        };
        let f = with_values(f, &x, &w);
        let lower = (0..n).map(|_| 0.0).chain([0.001]).collect();
        // A price at which the market takes what everybody begins with.
        let first = (demand / (10.0 * n as f64)).powf(1.0 / gamma);
        let start = (0..n).map(|_| 10.0).chain([first]).collect();
        let problem = Mcp::new(f, lower, vec![f64::INFINITY; n + 1], start);
        (problem.expect("valid bounds and start"), LcpPoint { z: x })
    }

    /// `q1, …, qn, p`.
    pub fn names(&self) -> Vec<String> {
        (1..=self.firms).map(|i| format!("q{i}")).chain(["p".into()]).collect()
    }
}

/// `0 ≤ u ≤ bound ⟂ −Δu − λ eᵘ` on the unit square, `u = 0` on its rim: Bratu's problem with an obstacle, by the five-point formula times h². Without the obstacle
/// there are two solutions up to `λ ≈ 6.81`, and none beyond.
///
/// Source: HoppeMittelmann1989.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Bratu {
    /// Interior points along each side: m^2 variables.
    pub m: usize,
    /// How strong the reaction is.
    pub lambda: f64,
    /// What u may not exceed.
    pub bound: f64,
}

impl Default for Bratu {
    fn default() -> Self {
        Self { m: 20, lambda: 6.0, bound: 4.0 }
    }
}

impl Recipe for Bratu {
    fn validate(&self) -> Result<(), String> {
        size("m", self.m, 1..=500)?;
        for (key, x) in [("lambda", self.lambda), ("bound", self.bound)] {
            if !(x >= 0.0 && x.is_finite()) {
                return Err(format!("{key}: expected a number of at least 0, found {x}"));
            }
        }
        Ok(())
    }
}

impl Bratu {
    /// The problem; it starts at 0.
    pub fn mcp(&self) -> Mcp {
        let m = self.m;
        let mut g = Graph::new(m * m);
        let h = 1.0 / (m + 1) as f64;
        let strength = g.constant(self.lambda * h * h);
        let rows = (0..m * m).map(|k| {
            let (i, j) = (k % m, k / m);
            let neighbours = [
                (j > 0).then(|| k - m),
                (i > 0).then(|| k - 1),
                Some(k),
                (i + 1 < m).then(|| k + 1),
                (j + 1 < m).then(|| k + m),
            ];
            let places = neighbours.into_iter().flatten();
            let terms = places.map(|at| (at, if at == k { 4.0 } else { -1.0 })).collect();
            let linear = g.add(Node::Linear(terms));
            let u = g.variable(k);
            let growth = g.unary(Unary::Exp, u);
            let source = g.binary(Binary::Mul, strength, growth);
            g.binary(Binary::Sub, linear, source)
        });
        let rows = rows.collect();
        let n = m * m;
        let problem = Mcp::new(made(g, rows), vec![0.0; n], vec![self.bound; n], vec![0.0; n]);
        problem.expect("valid bounds and start")
    }
}

/// A worked example of the literature, `0 ≤ x ⟂ F(x) ≥ 0`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ClassicName {
    /// Four quadratics with a degenerate solution and another one (KojimaShindo1986).
    KojimaShindo,
    /// Four quadratics with a degenerate solution (Josephy1979).
    Josephy,
    /// One quadratic whose natural and Fischer-Burmeister residuals have a minimum near 0 that is no solution (Billups1995).
    Billups,
    /// A Walrasian equilibrium, modified so that it is defined for prices of 0, with a segment of solutions (Mathiesen1987).
    Mathiesen,
}

impl ClassicName {
    /// Every example, for tests that go through them.
    pub const ALL: [Self; 4] = [Self::KojimaShindo, Self::Josephy, Self::Billups, Self::Mathiesen];
}

/// Worked examples of the literature, by name; each is written down from its definition.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct NonlinearClassic {
    /// Which example.
    pub name: ClassicName,
}

impl Default for NonlinearClassic {
    fn default() -> Self {
        Self { name: ClassicName::KojimaShindo }
    }
}

impl Recipe for NonlinearClassic {
    fn validate(&self) -> Result<(), String> {
        Ok(())
    }
}

impl NonlinearClassic {
    /// The problem, from the first of its customary starts.
    pub fn mcp(&self) -> Mcp {
        let (rows, start): (&[&str], &[f64]) = match self.name {
            ClassicName::KojimaShindo => (
                &[
                    "3*x1^2 + 2*x1*x2 + 2*x2^2 + x3 + 3*x4 - 6",
                    "2*x1^2 + x1 + x2^2 + 10*x3 + 2*x4 - 2",
                    "3*x1^2 + x1*x2 + 2*x2^2 + 2*x3 + 9*x4 - 9",
                    "x1^2 + 3*x2^2 + 2*x3 + 3*x4 - 3",
                ],
                &[0.0; 4],
            ),
            ClassicName::Josephy => (
                &[
                    "3*x1^2 + 2*x1*x2 + 2*x2^2 + x3 + 3*x4 - 6",
                    "2*x1^2 + x1 + x2^2 + 3*x3 + 2*x4 - 2",
                    "3*x1^2 + x1*x2 + 2*x2^2 + 2*x3 + 3*x4 - 1",
                    "x1^2 + 3*x2^2 + 2*x3 + 3*x4 - 3",
                ],
                &[0.0; 4],
            ),
            ClassicName::Billups => (&["(x1 - 1)^2 - 1.01"], &[0.0]),
            ClassicName::Mathiesen => (
                &[
                    "-x2 + x3 + x4",
                    "x1 - (4.5*x3 + 2.7*x4)/(x2 + 1)",
                    "5 - x1 - (0.5*x3 + 0.3*x4)/(x3 + 1)",
                    "3 - x1",
                ],
                &[1.0; 4],
            ),
        };
        let texts: Vec<_> = rows.iter().map(ToString::to_string).collect();
        let f = Expressions::parse(&texts, &[]).expect("expressions in x1, x2, …");
        Mcp::ncp(f, start.to_vec()).expect("as many numbers as rows")
    }

    /// Solutions: all of the first three, of the fourth the ends of the segment.
    pub fn solutions(&self) -> Vec<LcpPoint> {
        let degenerate = [6f64.sqrt() / 2.0, 0.0, 0.0, 0.5].to_vec();
        let all = match self.name {
            ClassicName::KojimaShindo => vec![degenerate, vec![1.0, 0.0, 3.0, 0.0]],
            ClassicName::Josephy => vec![degenerate],
            ClassicName::Billups => vec![vec![1.0 + 1.01f64.sqrt()]],
            ClassicName::Mathiesen => vec![vec![0.0; 4], vec![3.0, 0.0, 0.0, 0.0]],
        };
        all.into_iter().map(|z| LcpPoint { z }).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::Judged;

    #[test]
    fn planted_points_are_solutions() {
        for seed in 0..5 {
            for degenerate in [0.0, 0.3] {
                let (p, x) = HarkerPang { n: 25, degenerate, seed, ..Default::default() }.mcp();
                let verdict = p.judge(&x, 1e-12).unwrap();
                assert!(verdict.solved, "{:?}", verdict.measure);
                assert_eq!(verdict.counts.degenerate > 0, degenerate > 0.0);
            }
            for (firms, idle) in [(2, 0.5), (40, 0.0), (40, 0.4)] {
                let made = NashCournot { firms, idle, seed, ..Default::default() };
                let (p, x) = made.mcp();
                let verdict = p.judge(&x, 1e-12).unwrap();
                assert!(verdict.solved, "{firms} {idle} {:?}", verdict.measure);
                assert_eq!(verdict.counts.lower > 0, firms == 40 && idle > 0.0);
                assert_eq!(made.names().len(), p.dim());
                // Outputs that are not sold would cost more than they earn; all costs are positive.
                let texts = p.F.expressions().unwrap().texts(&made.names()).unwrap();
                assert!(texts[..firms].iter().all(|t| !t.starts_with('-')), "{texts:?}");
            }
        }
    }

    #[test]
    fn classics_have_their_solutions() {
        for name in ClassicName::ALL {
            let classic = NonlinearClassic { name };
            let problem = classic.mcp();
            for x in classic.solutions() {
                assert!(problem.judge(&x, 1e-12).unwrap().solved, "{name:?} {x:?}");
            }
        }
    }

    #[test]
    fn the_reaction_is_stated_on_the_grid() {
        let problem = Bratu { m: 3, lambda: 16.0, bound: 4.0 }.mcp();
        let texts = problem.F.expressions().unwrap().texts(&[]).unwrap();
        assert_eq!(texts[4], "-1*x2 - x4 + 4*x5 - x6 - x8 - 1*exp(x5)");
        assert_eq!(texts[0], "4*x1 - x2 - x4 - 1*exp(x1)");
        assert_eq!(problem.F.pattern().len(), 9 + 2 * 12);
    }
}

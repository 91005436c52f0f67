//! Line searches on a merit function `Ψ = ½‖Φ‖²` along a Newton direction, for which `Ψ'(0) = −2Ψ(0)`.
//!
//! | rule | accepts the step t where |
//! | --- | --- |
//! | none | always |
//! | Armijo | `Ψ(t) ≤ (1 − 2σt) Ψ(0)` (96) |
//! | Goldstein–Price | that, and `Ψ(t) ≥ (1 − 2(1 − σ)t) Ψ(0)` unless t = 1 |
//! | nonmonotone | Armijo against the largest of the last ten Ψ in place of `Ψ(0)` |
//!
//! References: Acary, lecture (95)(96); GoldsteinPrice1967; GrippoLamparielloLucidi1986. At most ten evaluations of Ψ.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a step length has to achieve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LineSearch {
    /// Full steps.
    None,
    /// Sufficient decrease.
    #[default]
    Armijo,
    /// Sufficient decrease by a step that is not needlessly short.
    GoldsteinPrice,
    /// Sufficient decrease below the largest of the last values.
    Nonmonotone,
}

/// σ of Armijo's rule.
const SIGMA: f64 = 1e-4;
/// σ of Goldstein's and Price's: both bounds must be worth something.
const SIGMA_GOLDSTEIN: f64 = 0.1;
const TRIALS: usize = 10;
const MEMORY: usize = 10;

/// A line search and what it remembers.
#[derive(Debug, Clone)]
pub struct Search {
    rule: LineSearch,
    memory: [f64; MEMORY],
    filled: usize,
}

/// What came of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    /// The step: the one accepted, else the best one tried.
    pub step: f64,
    /// Ψ there.
    pub merit: f64,
    /// The rule accepts it.
    pub accepted: bool,
}

impl Search {
    /// A search by the rule given.
    pub fn new(rule: LineSearch) -> Self {
        Self { rule, memory: [0.0; MEMORY], filled: 0 }
    }

    /// Forgets the values met: Ψ has changed.
    pub fn restart(&mut self) {
        self.filled = 0;
    }

    /// What the rule compares a merit with: the largest of those remembered and Ψ(0), or Ψ(0) itself.
    pub fn reference(&self, merit: f64) -> f64 {
        match self.rule {
            LineSearch::Nonmonotone => {
                self.memory[..self.filled.min(MEMORY)].iter().fold(merit, |m, v| m.max(*v))
            }
            _ => merit,
        }
    }

    /// Notes the merit at which a step begins that is taken without a search.
    pub fn remember(&mut self, merit: f64) {
        self.memory[self.filled % MEMORY] = merit;
        self.filled += 1;
    }

    /// Searches from `merit = Ψ(0)` with `trial(t) = Ψ(t)` along a Newton direction. The last call of `trial` is with the step returned.
    pub fn search(&mut self, merit: f64, trial: impl FnMut(f64) -> f64) -> Found {
        self.search_along(merit, -2.0 * merit, trial)
    }

    /// [`search`](Self::search) along any direction of descent: `slope = Ψ'(0)`.
    pub fn search_along(
        &mut self,
        merit: f64,
        slope: f64,
        mut trial: impl FnMut(f64) -> f64,
    ) -> Found {
        self.remember(merit);
        let reference = self.reference(merit);
        let sigma = match self.rule {
            LineSearch::GoldsteinPrice => SIGMA_GOLDSTEIN,
            _ => SIGMA,
        };
        let (mut step, mut shortest_bad, mut longest_timid) = (1.0, None, None);
        let mut best = Found { step: 0.0, merit: f64::INFINITY, accepted: false };
        let mut last = step;
        for _ in 0..TRIALS {
            last = step;
            let value = trial(step);
            if value < best.merit {
                best = Found { step, merit: value, accepted: false };
            }
            if self.rule == LineSearch::None {
                return Found { step, merit: value, accepted: value.is_finite() };
            }
            let enough = value <= reference + sigma * step * slope;
            let timid = self.rule == LineSearch::GoldsteinPrice
                && step < 1.0
                && value < merit + (1.0 - sigma) * step * slope;
            if enough && !timid {
                return Found { step, merit: value, accepted: true };
            }
            if enough {
                longest_timid = Some(step);
            } else {
                shortest_bad = Some(step);
            }
            step = match (longest_timid, shortest_bad) {
                (Some(a), Some(b)) => 0.5 * (a + b),
                (Some(a), None) => f64::min(1.0, 2.0 * a),
                _ => 0.5 * step,
            };
        }
        // Timid steps decrease enough, so the best of them is good.
        best.accepted = longest_timid.is_some();
        if best.step != last && best.step > 0.0 {
            best.merit = trial(best.step);
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_rule_accepts_what_it_should() {
        // Ψ(t) with Ψ(0) = 1, Ψ'(0) = −2 that rises beyond t = 1/8.
        let narrow = |t: f64| (1.0 - 8.0 * t).powi(2) * 0.9 + 0.1 * (1.0 - t).powi(2);
        for rule in [LineSearch::Armijo, LineSearch::GoldsteinPrice, LineSearch::Nonmonotone] {
            let mut last = f64::NAN;
            let found = Search::new(rule).search(1.0, |t| {
                last = t;
                narrow(t)
            });
            assert!(found.accepted && found.merit < 1.0, "{rule:?} {found:?}");
            assert_eq!((found.step, found.merit), (last, narrow(last)));
        }
        let full = Search::new(LineSearch::None).search(1.0, narrow);
        assert_eq!((full.step, full.accepted), (1.0, true));
    }

    #[test]
    fn the_nonmonotone_rule_remembers_and_forgets() {
        let mut search = Search::new(LineSearch::Nonmonotone);
        assert!(search.search(5.0, |_| 1.0).accepted);
        // Above Ψ(0) = 1 but below the 5 met before.
        assert_eq!(search.search(1.0, |_| 4.0).step, 1.0);
        search.restart();
        let found = search.search(1.0, |_| 4.0);
        assert!(!found.accepted && found.merit == 4.0);
    }

    #[test]
    fn where_nothing_decreases_the_best_trial_is_returned_and_was_evaluated_last() {
        let mut last = 0.0;
        let found = Search::new(LineSearch::Armijo).search(1.0, |t| {
            last = t;
            2.0 + (t - 0.25).abs()
        });
        assert!(!found.accepted);
        assert_eq!((found.step, last), (0.25, 0.25));
        let found = Search::new(LineSearch::Armijo).search(1.0, |_| f64::NAN);
        assert!(!found.accepted && found.step == 0.0);
    }

    #[test]
    fn goldstein_and_price_lengthen_a_timid_step() {
        // t = 1 fails, t = 1/2 is so good that a longer step is tried.
        let mut tried = vec![];
        let found = Search::new(LineSearch::GoldsteinPrice).search(1.0, |t| {
            tried.push(t);
            if t > 0.9 { 10.0 } else { (1.0 - t).powi(8) }
        });
        assert!(found.accepted && tried.contains(&0.5) && tried.contains(&0.75), "{tried:?}");
    }
}

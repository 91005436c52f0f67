//! **Principal pivoting** of Keller's and Cottle and Dantzig's kind: one distinguished variable at a time is driven to zero.
//!
//! Problem: `0 ≤ z ⟂ w = M z + q ≥ 0`, with free variables that equations determine; M positive semidefinite, or sufficient.
//!
//! Method: `v_r < 0` is distinguished and its complement grows until `v_r = 0` (exchange the pair r, done with r) or another basic variable i reaches its bound: 0, or λ below
//! everything for those that are negative as well. Where `t_ii > 0` the pair i is exchanged and the complement of r grows on; where `t_ii = 0` the pairs i and r are
//! exchanged together, and it is v_r itself that grows on. Where nothing stops the growth, row r proves that there is no solution.
//!
//! References: Keller1973; CottleDantzig1968; CottlePangStone2009, sections 4.2 and 4.3.
//!
//! Cost of a step: a column's ratio test and one pivot or two, some 5n². Storage: two n × n matrices.
//! Fails: finite for sufficient M without ties; with them the least index is taken, and a basis that comes back without progress is noticed. Matrices that are
//! not sufficient are noticed by the signs of the tableau.

use nonsmooth_problem::LcpPoint;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{NOT_SUFFICIENT, ended};
use crate::complementarity::form::{Complementary, system};
use crate::complementarity::parts::{Cycle, Polished, Tableau};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};
use crate::core::trace::Trace;
use crate::{SolveError, Solver, Step};

/// Which of the negative variables is distinguished: driven to zero, the others kept from falling.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Keller {
    /// Distinguish the negative variable of least index, in place of the most negative one.
    pub least_index: bool,
}

impl Settings for Keller {}

impl Described for Keller {
    const ABOUT: &'static About = &About {
        name: "keller",
        family: "pivoting",
        solves: Solves::Law,
        summary: "principal pivoting of Keller, Cottle and Dantzig: one negative variable at a time is driven to zero; proves infeasibility",
        needs: &["the entries of M", "a sufficient M (PSD or P, for instance): guaranteed"],
        cites: &["Keller1973", "CottleDantzig1968", "CottlePangStone2009"],
        variants: &["least_index=true"],
        settings: described::<Self>,
    };
}

/// The tableau with the values of both variables of each pair, and the bases visited.
pub struct KellerWork {
    tableau: Tableau,
    cycle: Cycle,
    /// The values of the basic and of the nonbasic variable of each pair.
    x: Vec<f64>,
    xi: Vec<f64>,
    /// Whether a variable of the pair is negative, and whether that is z.
    below: Vec<bool>,
    is_z: Vec<bool>,
    lambda: f64,
    distinguished: Option<usize>,
    restarts: usize,
}

/// λ in units of the most negative value: so far that it rarely blocks, and near enough for rounding.
const FAR: f64 = 1e3;
/// Ratios that differ by less, relatively, tie.
const TIE: f64 = 1e-12;

impl KellerWork {
    /// Begins from the tableau's values: the nonbasic variables are zero.
    fn begin(&mut self) {
        let n = self.tableau.dim();
        self.lambda = 0.0;
        for i in 0..n {
            let negative = self.tableau.is_negative(i);
            self.x[i] = self.tableau.value(i);
            self.xi[i] = 0.0;
            self.below[i] = negative;
            self.is_z[i] = self.tableau.basis()[i];
            self.lambda = self.lambda.min(if negative { FAR * self.x[i] } else { 0.0 });
        }
        self.distinguished = None;
        self.restarts = self.tableau.restarts();
        self.cycle.begin(self.tableau.basis());
    }

    /// Whether the negative variable of pair i is the basic one.
    fn basic_below(&self, i: usize) -> bool {
        self.below[i] && self.is_z[i] == self.tableau.basis()[i]
    }

    /// The value of the negative variable of pair i.
    fn negative_value(&self, i: usize) -> f64 {
        if self.basic_below(i) { self.x[i] } else { self.xi[i] }
    }

    /// Chooses the next variable to drive; none where nothing is negative.
    fn choose(&mut self, least_index: bool) -> Option<usize> {
        // The values anew, from those of the nonbasic variables.
        for i in 0..self.tableau.dim() {
            let row = self.tableau.row(i).iter().zip(&self.xi);
            self.x[i] = self.tableau.value(i) + row.map(|(t, x)| t * x).sum::<f64>();
            if self.basic_below(i) && self.x[i] >= 0.0 {
                self.below[i] = false;
            }
        }
        let negative = self.tableau.pairs().filter(|i| self.below[*i]);
        let by_value =
            |a: &usize, b: &usize| self.negative_value(*a).total_cmp(&self.negative_value(*b));
        let mut negative = negative;
        self.distinguished = if least_index { negative.next() } else { negative.min_by(by_value) };
        self.cycle.begin(self.tableau.basis());
        self.distinguished
    }

    fn swap_values(&mut self, i: usize) {
        std::mem::swap(&mut self.x[i], &mut self.xi[i]);
    }

    /// Lets the nonbasic variable of pair r grow as far as it may.
    fn drive(&mut self, r: usize) -> Step {
        let going_on = Step::Continue { estimate: f64::NAN };
        let basic = self.basic_below(r);
        let diagonal = self.tableau.diagonal(r);
        let own = match basic {
            true if diagonal > 0.0 => (-self.x[r] / diagonal).max(0.0),
            true => f64::INFINITY,
            false => -self.xi[r],
        };
        self.tableau.sizes_of_column(r);
        let mut block: Option<(f64, usize)> = None;
        for i in self.tableau.pairs().filter(|i| !(*i == r && basic)) {
            let slope = self.tableau.entry(i, r);
            if slope < -self.tableau.threshold(i) {
                let bound = if self.basic_below(i) { self.lambda } else { 0.0 };
                let ratio = ((self.x[i] - bound) / -slope).max(0.0);
                if block.is_none_or(|(least, _)| ratio < least * (1.0 - TIE)) {
                    block = Some((ratio, i));
                }
            }
        }
        let block = block.filter(|(ratio, _)| *ratio < own);
        let step = block.map_or(own, |(ratio, _)| ratio);
        if step == f64::INFINITY {
            self.tableau.sizes_of_row(r);
            let open = |j: usize| self.tableau.entry(r, j) > self.tableau.threshold(j);
            if self.tableau.pairs().any(open) {
                return Step::Stuck(NOT_SUFFICIENT.into());
            }
            return Step::NoSolution(self.tableau.farkas(r));
        }
        for i in 0..self.tableau.dim() {
            self.x[i] += step * self.tableau.entry(i, r);
            if i != r && self.basic_below(i) && self.x[i] >= 0.0 {
                self.below[i] = false;
            }
        }
        self.xi[r] += step;
        match block {
            None => {
                // v_r = 0.
                self.below[r] = false;
                self.distinguished = None;
                if basic {
                    self.x[r] = 0.0;
                    self.tableau.pivot(r);
                    self.swap_values(r);
                } else {
                    self.xi[r] = 0.0;
                }
                return going_on;
            }
            Some((_, i)) => {
                self.x[i] = if self.basic_below(i) { self.lambda } else { 0.0 };
                match self.tableau.diagonal(i) {
                    d if d > 0.0 && i != r => {
                        self.tableau.pivot(i);
                        self.swap_values(i);
                    }
                    0.0 if i != r && self.tableau.pivot_pair(i, r) => {
                        self.swap_values(i);
                        self.swap_values(r);
                    }
                    _ => return Step::Stuck(NOT_SUFFICIENT.into()),
                }
            }
        }
        if step > 0.0 {
            self.cycle.begin(self.tableau.basis());
        } else if self.cycle.returns(self.tableau.basis()) {
            return Step::Stuck("the pivots cycle without progress".into());
        }
        going_on
    }
}

impl<P: Complementary> Solver<P> for Keller {
    type Work = KellerWork;

    fn work(&self, problem: &P) -> Result<KellerWork, SolveError> {
        let tableau = Tableau::new(&problem.system()?)?;
        let n = tableau.dim();
        Ok(KellerWork {
            tableau,
            cycle: Cycle::default(),
            x: vec![0.0; n],
            xi: vec![0.0; n],
            below: vec![false; n],
            is_z: vec![false; n],
            lambda: 0.0,
            distinguished: None,
            restarts: 0,
        })
    }

    fn refill(&self, problem: &P, work: &mut KellerWork) -> Result<(), SolveError> {
        work.tableau.load(&problem.system()?)?;
        let n = work.tableau.dim();
        for x in [&mut work.x, &mut work.xi] {
            x.resize(n, 0.0);
        }
        for x in [&mut work.below, &mut work.is_z] {
            x.resize(n, false);
        }
        Ok(())
    }

    fn start(&self, problem: &P, point: &mut LcpPoint, work: &mut KellerWork) {
        work.tableau.warm(&system(problem), &point.z);
        work.begin();
    }

    fn step(&self, _: &P, _: &mut LcpPoint, work: &mut KellerWork) -> Step {
        if let Some(end) = ended(&mut work.tableau) {
            return end;
        }
        if work.restarts != work.tableau.restarts() {
            work.begin();
        }
        let chosen = work.distinguished.or_else(|| work.choose(self.least_index));
        if let Some(r) = chosen {
            let word = work.drive(r);
            // What is unpleasant is heard twice, the second time from a tableau fresh from the data.
            if !matches!(word, Step::Continue { .. }) && work.tableau.freshen() {
                work.begin();
                return Step::Continue { estimate: f64::NAN };
            }
            return word;
        }
        match work.tableau.polish() {
            Polished::Negative => {
                work.begin();
                Step::Continue { estimate: f64::NAN }
            }
            Polished::Feasible | Polished::Exhausted => Step::Done,
        }
    }

    fn publish(&self, _: &P, point: &mut LcpPoint, work: &mut KellerWork) {
        work.tableau.write(&mut point.z);
    }

    fn record(&self, on: bool, work: &mut KellerWork) {
        work.tableau.record.begin(on);
    }

    fn trace(&self, work: &KellerWork) -> Trace {
        Trace::Pivots(work.tableau.record.rows())
    }

    fn account(&self, work: &KellerWork) -> Vec<String> {
        vec![work.tableau.summary()]
    }

    fn check_every(&self, _: &Self::Work) -> usize {
        super::CHECK_EVERY
    }
}

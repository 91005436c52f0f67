//! Rows as they are needed: variational inequalities over polyhedra of many dense rows, by those that matter.
//!
//! Problem: `−F(x) ∈ N_X(x)`, X between bounds and inequalities `a_k x ≤ b_k` of which most are far from the solution. Method: over the polyhedron of a few of the inequalities, at first those nearest to the start, the
//! problem is solved behind multipliers; those that its solution violates most join them. Where it violates none it solves the problem, with multipliers that are zero elsewhere. Inequalities never leave, so the
//! method ends. Where F is not affine it is linearised anew in each round (Josephy1979), so that each round is a linear complementarity problem, as long as that comes nearer; else rounds are those of F itself. A proof that some of them leave no solution is one for all. Nothing of it grows with the number of rows but a product with all of them a round.
//!
//! References: FacchineiPang2003, prop. 1.2.1; Josephy1979. Cost: a dozen solves with about one and a half times as many rows as hold the solution. Fails: where F has no solution over fewer rows, as those that are not monotone may;
//! after twice as many rows each time it is left to the multipliers of all.

use std::sync::Arc;
use std::time::Instant;

use nonsmooth_linalg::Csc;
use nonsmooth_problem::check::{Certificate, Constraint, Evidence, Exact, ExactVector, ViGauge};
use nonsmooth_problem::field::{Binary, Expressions, Field, Graph, Node};
use nonsmooth_problem::{Constraints, LcpPoint, Problem, Set, Vi};

use super::Multipliers;
use crate::core::meter::Meter;
use crate::core::portfolio::{Candidate, Portfolio};
use crate::core::settings::SettingsMap;
use crate::{Limit, Limits, Observer, Outcome, Progress, Sample, Session, SolveError, Status};

/// Fewer rows, and rows with fewer entries in the mean, are no burden.
const MANY: usize = 100;
const DENSE: usize = 16;
/// The least number of rows that join at once, and the part of the number of variables that it is.
const LEAST: usize = 20;
const PART: usize = 2;
/// The factor between the tolerances of two tries.
const CLOSER: f64 = 1e-2;

/// Linearisations without half the residual, after which they lead nowhere.
const IDLE: usize = 4;

/// The session's memory.
#[derive(Default)]
pub(super) struct Rows {
    history: Vec<Sample>,
    account: Vec<String>,
    gauge: Option<Box<ViGauge>>,
}

/// Sees the solves over fewer rows: their steps, but not their points.
struct Part<'a> {
    observer: &'a mut dyn Observer<Vi>,
    iterations: usize,
}

impl Observer<Vi> for Part<'_> {
    fn step(&mut self, progress: &Progress) {
        let mut progress = *progress;
        progress.iteration += self.iterations;
        progress.judged.iteration += self.iterations;
        self.observer.step(&progress);
    }
}

/// The inequalities, and which are taken.
struct Taken {
    all: Vec<Constraint>,
    norms: Vec<f64>,
    is: Vec<bool>,
    count: usize,
}

impl Taken {
    fn new(all: Vec<Constraint>) -> Self {
        let norm = |c: &Constraint| c.terms.iter().map(|t| t.1 * t.1).sum::<f64>().sqrt();
        let norms = all.iter().map(norm).collect();
        // Equations hold always.
        let is: Vec<bool> = all.iter().map(|c| c.equation).collect();
        let count = is.iter().filter(|is| **is).count();
        Self { all, norms, is, count }
    }

    /// How far x is beyond constraint k.
    fn excess(&self, k: usize, x: &[f64]) -> f64 {
        let Constraint { terms, rhs, .. } = &self.all[k];
        let sum: f64 = terms.iter().map(|&(j, a)| a * x[j]).sum();
        if self.norms[k] > 0.0 { (sum - rhs) / self.norms[k] } else { -rhs }
    }

    /// Takes so many more, those that x is beyond most, as long as it is beyond `from`; how many.
    fn take(&mut self, x: &[f64], count: usize, from: f64) -> usize {
        let open = (0..self.all.len()).filter(|&k| !self.is[k]);
        let mut open: Vec<(f64, usize)> =
            open.map(|k| (self.excess(k, x), k)).filter(|e| e.0 > from).collect();
        open.sort_by(|a, b| b.0.total_cmp(&a.0));
        open.truncate(count);
        open.iter().for_each(|&(_, k)| self.is[k] = true);
        self.count += open.len();
        open.len()
    }

    /// Whether all are taken.
    fn is_full(&self) -> bool {
        self.count == self.all.len()
    }

    /// The vector over F's rows and those of the taken constraints, as one over all.
    fn spread<T: Clone + Default>(&self, y: &[T], n: usize) -> Vec<T> {
        let mut taken = y.iter().skip(n).cloned();
        let own = y.iter().take(n).cloned();
        let others = self.is.iter().map(|is| if *is { taken.next() } else { None });
        own.chain(others.map(Option::unwrap_or_default)).collect()
    }
}

/// `F(x) + JF(x)(y − x)` as a function of y; `None` where it is not defined at x.
fn linearised(field: &dyn Field, x: &[f64]) -> Option<Arc<dyn Field>> {
    let (n, pattern) = (x.len(), field.pattern());
    let (mut f, mut slopes) = (vec![0.0; n], vec![0.0; pattern.len()]);
    if !field.evaluator().jacobian(x, &mut f, &mut slopes) {
        return None;
    }
    let mut graph = Graph::new(n);
    let rows = (0..n).map(|i| {
        let terms = pattern.row(i).iter().copied().zip(slopes[pattern.range(i)].iter().copied());
        let terms: Vec<(usize, f64)> = terms.filter(|t| t.1 != 0.0).collect();
        let constant = terms.iter().fold(f[i], |c, &(j, a)| c - a * x[j]);
        let (linear, constant) = (graph.add(Node::Linear(terms)), graph.constant(constant));
        graph.binary(Binary::Add, linear, constant)
    });
    let rows = rows.collect();
    Some(Arc::new(Expressions::new(graph, rows).ok()?))
}

/// The polyhedron of bounds and of some constraints.
fn polyhedron(lower: &[f64], upper: &[f64], taken: &Taken) -> Option<Set> {
    let n = lower.len();
    let (mut entries, mut b) = ([vec![], vec![]], [vec![], vec![]]);
    for (side, sign) in [(lower, -1.0), (upper, 1.0)] {
        for (j, x) in side.iter().enumerate().filter(|(_, x)| x.is_finite()) {
            entries[0].push((b[0].len(), j, sign));
            b[0].push(sign * x);
        }
    }
    for (constraint, _) in taken.all.iter().zip(&taken.is).filter(|(_, is)| **is) {
        let kind = usize::from(constraint.equation);
        let row = b[kind].len();
        entries[kind].extend(constraint.terms.iter().map(|&(j, a)| (row, j, a)));
        b[kind].push(constraint.rhs);
    }
    let [of_a, of_c] = entries;
    let [b, d] = b;
    let matrix = |m: usize, entries: Vec<(usize, usize, f64)>| {
        Csc::from_triplets(m, n, entries.into_iter()).ok()
    };
    Some(Set::Polyhedron { A: matrix(b.len(), of_a)?, C: matrix(d.len(), of_c)?, b, d })
}

impl Rows {
    /// Whether there are more dense rows than is good for multipliers.
    pub(super) fn applies(problem: &Vi) -> bool {
        let stored = |set: &Set| match set {
            Set::Polyhedron { A, .. } => A.nnz(),
            _ => 0,
        };
        let entries: usize = problem.set.parts().into_iter().map(|(_, set)| stored(set)).sum();
        let (n, least) = (problem.dim(), MANY.max(problem.dim()));
        if entries < least * DENSE.min(n) || !Multipliers::applies(&problem.set) {
            return false;
        }
        let others = problem.set.constraints().others;
        let rows = others.iter().filter(|c| !c.equation);
        let (rows, entries) =
            rows.fold((0, 0), |(rows, entries), c| (rows + 1, entries + c.terms.len()));
        rows >= least && entries >= rows * DENSE
    }

    /// The solve; `None` where it leads nowhere.
    pub(super) fn observe(
        &mut self,
        problem: &Vi,
        point: &mut LcpPoint,
        limits: &Limits,
        iterations_each: usize,
        observer: &mut dyn Observer<Vi>,
    ) -> Result<Option<Outcome>, SolveError> {
        let begun = Instant::now();
        let (n, meter) = (problem.dim(), Meter::start(begun, limits));
        let scope = limits.budget(begun).enter();
        self.clear();
        let gauge = self.gauge.insert(Box::new(problem.gauge()?));
        let start = problem.certify(point, gauge);
        if observer.keeps_best() {
            observer.best(point, &start);
        }
        if start.passes(limits.tolerance) {
            return Ok(Some(meter.outcome(Status::Solved, start, 0)));
        }
        let mut best = start;
        let Constraints { lower, upper, others } = problem.set.constraints();
        let mut taken = Taken::new(others);
        let join = LEAST.max(n / PART);
        taken.take(&point.z, join, f64::NEG_INFINITY);
        let (mut x, mut tolerance) = (point.clone(), limits.tolerance);
        let (mut iterations, mut rounds, mut idle) = (0, 0, 0);
        let affine = problem.F.expressions().is_some_and(|f| f.affine().is_some());
        let mut linearises = !affine;
        let candidate = Candidate {
            name: "multipliers/auto".into(),
            settings: SettingsMap::new(),
            iterations: iterations_each,
            because: "over the rows that matter".into(),
            anew: true,
        };
        let status = loop {
            if let Some(limit) = limits.reached(begun) {
                break Status::Limit(limit);
            }
            let Some(set) = polyhedron(&lower, &upper, &taken) else { return Ok(None) };
            let straight = if linearises { linearised(&*problem.F, &x.z) } else { None };
            linearises &= straight.is_some();
            let field = straight.unwrap_or_else(|| problem.F.clone());
            let fewer = Vi { F: field, set, start: problem.start.clone() };
            let plan = candidate.clone();
            let mut session = Portfolio::new(
                move |_: &Vi, stage| {
                    if stage == 0 { vec![plan.clone()] } else { vec![] }
                },
            );
            let left = Limits {
                tolerance,
                max_iterations: limits.max_iterations.saturating_sub(iterations),
                ..limits.left(begun)
            };
            let mut part = Part { observer, iterations };
            let mut trial = x.clone();
            let outcome = session.observe(&fewer, &mut trial, &left, &mut part)?;
            iterations += outcome.iterations;
            rounds += 1;
            self.account = session.account();
            match outcome.status {
                Status::Solved => x = trial,
                Status::Limit(limit)
                    if limit != Limit::Iterations || iterations >= limits.max_iterations =>
                {
                    break Status::Limit(limit);
                }
                Status::Infeasible(proof) => {
                    let spread = |y: &[Exact]| ExactVector(taken.spread(y, n));
                    let lifted = match proof.certificate() {
                        Certificate::Farkas { y } => Certificate::Farkas { y: taken.spread(y, n) },
                        Certificate::Separating { vectors } => Certificate::Separating {
                            vectors: vectors.iter().map(|v| spread(&v.0)).collect(),
                        },
                        other => other.clone(),
                    };
                    if let Evidence::Proved(proof) = problem.evidence(&lifted) {
                        break Status::Infeasible(proof);
                    }
                    if !linearises {
                        return Ok(None);
                    }
                    linearises = false;
                    continue;
                }
                _ if linearises => {
                    linearises = false;
                    continue;
                }
                _ => {
                    // Where some of the rows do not do, twice as many.
                    let more = taken.count + join;
                    if taken.is_full() || taken.take(&x.z, more, f64::NEG_INFINITY) == 0 {
                        return Ok(None);
                    }
                    continue;
                }
            }
            if taken.take(&x.z, join, 0.0) > join / 4 {
                continue;
            }
            // Few were violated, perhaps by rounding, and all of them are taken.
            let measure = problem.certify(&x, gauge);
            self.history.push(Sample {
                iteration: iterations,
                seconds: meter.seconds(),
                relative: measure.relative,
            });
            let before = best;
            if measure.passes(limits.tolerance) || measure.is_better_than(&best) {
                point.z.copy_from_slice(&x.z);
                best = measure;
                if observer.keeps_best() {
                    observer.best(point, &best);
                }
            }
            if measure.passes(limits.tolerance) {
                break Status::Solved;
            }
            if linearises {
                idle = if best.merit() < 0.5 * before.merit() { 0 } else { idle + 1 };
                linearises = idle < IDLE;
                continue;
            }
            tolerance *= CLOSER;
            if tolerance < f64::EPSILON {
                return Ok(None);
            }
        };
        drop(scope);
        self.account.iter_mut().for_each(|line| line.insert_str(0, "  "));
        let said = format!(
            "rows as they are needed: {} of {} after {rounds} rounds; the last one:",
            taken.count,
            taken.all.len()
        );
        self.account.insert(0, said);
        Ok(Some(meter.outcome(status, best, iterations)))
    }

    pub(super) fn clear(&mut self) {
        self.history.clear();
        self.account.clear();
        self.gauge = None;
    }

    pub(super) fn history(&self) -> &[Sample] {
        &self.history
    }

    pub(super) fn account(&self) -> Vec<String> {
        self.account.clone()
    }

    pub(super) fn gauge(&mut self) -> Option<&mut ViGauge> {
        self.gauge.as_deref_mut()
    }
}

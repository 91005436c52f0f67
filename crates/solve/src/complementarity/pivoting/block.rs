//! **Block principal pivoting**: all variables of the wrong sign change sides at once.
//!
//! Problem: `0 ≤ z ⟂ w = M z + q ≥ 0`, with free variables that equations determine.
//!
//! Method: for the basis α solve `M_αα z_α = −q_α`, and let every i with `z_i < 0` or `w_i < 0` change sides. Where the number of those has not fallen below its
//! least for `patience` steps, only the one of least index changes sides, as in Murty's method, until it has fallen.
//! The first basis is the one that the caller's point suggests.
//!
//! References: JudicePires1994; Kostreva1978; Murty1974; BenGharbiaGilbert2012 for why the fallback is there.
//!
//! Cost of a step: an LU factorisation of `M_αα`, dense or sparse. Storage: `M_αα` and its factors.
//! Fails: finite for P-matrices, and on M-matrices and most others after 5 to 10 factorisations at any size. A singular `M_αα` in the way or a basis that comes back
//! among the single changes ends it, by name.

use nonsmooth_linalg::{Compensated, Csc, Dense, Matrix, SquareLu};
use nonsmooth_problem::LcpPoint;
use nonsmooth_problem::check::Certificate;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::complementarity::form::{Complementary, System, system};
use crate::complementarity::parts::{Cycle, Tableau, equilibrate, refuting_row};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};
use crate::core::trace::{Pivot, Recorder, Trace, Variable};
use crate::{SolveError, Solver, Step};

/// How long infeasibility may not fall before single pivots take over.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct BlockPivoting {
    /// Changes of all at once without a new least number of wrong signs, before single changes begin.
    pub patience: usize,
    /// Go on with single changes, which are finite for P-matrices; otherwise go on with all at once, and stop where they cycle.
    pub fallback: bool,
    /// Single changes after which the method ends, as each costs a factorisation; 0: as many as it takes.
    pub most_singles: usize,
}

impl Default for BlockPivoting {
    fn default() -> Self {
        Self { patience: 10, fallback: true, most_singles: 0 }
    }
}

impl Settings for BlockPivoting {}

impl Described for BlockPivoting {
    const ABOUT: &'static About = &About {
        name: "block_pivoting",
        family: "pivoting",
        solves: Solves::Law,
        summary: "block principal pivoting: every variable of the wrong sign changes sides, Murty's rule where that does not help; dense or sparse LU",
        needs: &["the entries of M", "regular principal submatrices (M a P-matrix: guaranteed)"],
        cites: &["JudicePires1994", "Kostreva1978", "Murty1974", "BenGharbiaGilbert2012"],
        variants: &["patience=1"],
        settings: described::<Self>,
    };
}

/// Up to this many variables a dense tableau says which pairs a singular A needs in the first basis.
const MOST_PAIRED: usize = 2000;

/// The principal block of the present basis with its factors, and the best basis seen.
pub struct BlockWork {
    free: usize,
    /// Powers of two that scale rows and columns.
    rows: Vec<f64>,
    columns: Vec<f64>,
    scratch: Vec<f64>,
    refuting: Option<usize>,
    lu: SquareLu,
    /// α, and the basis before the last change.
    basis: Vec<bool>,
    before: Vec<bool>,
    /// α as a list, and the place of its members there.
    alpha: Vec<usize>,
    place: Vec<usize>,
    entries: Vec<(usize, usize, f64)>,
    residual: Vec<f64>,
    z: Vec<f64>,
    w: Compensations,
    wrong: Vec<usize>,
    least: usize,
    left: usize,
    single: bool,
    /// Whether the last change was one of all at once.
    whole: bool,
    cycle: Cycle,
    steps: usize,
    singles: usize,
    record: Recorder<Pivot>,
}

/// `w = M z + q` with the rounding errors of its sums, and the size of their terms.
#[derive(Debug, Clone, Default)]
struct Compensations {
    sums: Vec<Compensated>,
    terms: Vec<f64>,
}

impl Compensations {
    fn fill(&mut self, system: &System, z: &[f64]) {
        let n = system.dim();
        self.sums.clear();
        self.sums.extend(system.q.iter().map(|q| Compensated::from(*q)));
        self.terms.clear();
        self.terms.extend(system.q.iter().map(|q| q.abs()));
        match system.matrix {
            Matrix::Sparse(a) => {
                for (j, &x) in z.iter().enumerate().filter(|(_, x)| **x != 0.0) {
                    let (rows, values) = a.column(j);
                    for (&i, &v) in rows.iter().zip(values) {
                        self.sums[i].add_product(v, x);
                        self.terms[i] += (v * x).abs();
                    }
                }
            }
            Matrix::Dense(a) => {
                for i in 0..n {
                    let (mut sum, mut terms) = (self.sums[i], self.terms[i]);
                    for (&v, &x) in a.row(i).iter().zip(z).filter(|(_, x)| **x != 0.0) {
                        sum.add_product(v, x);
                        terms += (v * x).abs();
                    }
                    (self.sums[i], self.terms[i]) = (sum, terms);
                }
            }
            Matrix::Operator(_) => {}
        }
    }
}

impl BlockWork {
    fn fill(&mut self, system: &System) -> Result<(), SolveError> {
        system.needs_entries()?;
        let n = system.dim();
        self.free = system.free();
        equilibrate(system.matrix, &mut self.rows, &mut self.columns, &mut self.scratch);
        self.refuting = refuting_row(system, &mut self.basis);
        for x in [&mut self.basis, &mut self.before] {
            x.clear();
            x.resize(n, false);
        }
        self.place.clear();
        self.place.resize(n, usize::MAX);
        self.z.clear();
        self.z.resize(n, 0.0);
        self.alpha.reserve(n);
        self.wrong.reserve(n);
        self.residual.reserve(n);
        Ok(())
    }

    /// `M_αα`, scaled.
    fn block(&mut self, system: &System) -> Matrix {
        let Self { alpha, place, rows, columns, entries, .. } = self;
        let k = alpha.len();
        match system.matrix {
            Matrix::Sparse(a) => {
                place.fill(usize::MAX);
                alpha.iter().enumerate().for_each(|(p, &i)| place[i] = p);
                entries.clear();
                for (p, &j) in alpha.iter().enumerate() {
                    let (row_idx, values) = a.column(j);
                    for (&i, &v) in row_idx.iter().zip(values) {
                        if place[i] != usize::MAX {
                            entries.push((place[i], p, v * rows[i] * columns[j]));
                        }
                    }
                }
                let block = Csc::from_triplets(k, k, entries.iter().copied());
                Matrix::Sparse(block.unwrap_or_else(|_| Csc::zeros(k, k)))
            }
            Matrix::Dense(a) => Matrix::Dense(Dense::from_fn(k, k, |p, s| {
                let (i, j) = (alpha[p], alpha[s]);
                a[(i, j)] * rows[i] * columns[j]
            })),
            Matrix::Operator(_) => Matrix::Dense(Dense::zeros(k, k)),
        }
    }

    /// z of the basis, and which variables have the wrong sign. False where `M_αα` is singular.
    fn solve(&mut self, system: &System) -> bool {
        let n = system.dim();
        self.alpha.clear();
        let basis = &self.basis;
        self.alpha.extend((0..n).filter(|i| basis[*i]));
        self.z.fill(0.0);
        let mut rounding = 0.0;
        if !self.alpha.is_empty() {
            let block = self.block(system);
            if self.lu.factorise(&block).is_err() {
                return false;
            }
            let (mut last, mut converged) = (f64::INFINITY, false);
            for pass in 0..8 {
                // z_α ← z_α − M_αα⁻¹ (M z + q)_α, the residual in doubled precision.
                self.w.fill(system, &self.z);
                let Self { residual, alpha, w, rows, .. } = self;
                residual.clear();
                residual.extend(alpha.iter().map(|&i| w.sums[i].value() * rows[i]));
                self.lu.solve(residual);
                let (mut moved, mut reach) = (0.0_f64, 0.0_f64);
                for (&i, d) in self.alpha.iter().zip(&self.residual) {
                    self.z[i] -= d * self.columns[i];
                    let size = (self.z[i] / self.columns[i]).abs();
                    if !size.is_finite() {
                        return false;
                    }
                    (moved, reach) = (moved.max(d.abs()), reach.max(size));
                }
                if pass > 0 {
                    converged = moved <= 1e-3 * reach;
                    rounding = 8.0 * moved.min(reach);
                    if moved <= 4.0 * f64::EPSILON * reach || moved > 0.5 * last {
                        break;
                    }
                }
                last = if pass > 0 { moved } else { f64::INFINITY };
            }
            if !converged {
                return false;
            }
            let largest = self.alpha.iter().map(|&i| (self.z[i] / self.columns[i]).abs());
            rounding += 8.0 * f64::EPSILON * largest.fold(0.0, f64::max);
        }
        self.w.fill(system, &self.z);
        self.wrong.clear();
        for i in self.free..n {
            let wrong = if self.basis[i] {
                self.z[i] / self.columns[i] < -rounding
            } else {
                self.w.sums[i].value() < -8.0 * f64::EPSILON * self.w.terms[i]
            };
            if wrong {
                self.wrong.push(i);
            }
        }
        true
    }

    /// Lets variables change sides.
    fn change(&mut self, whole: bool) {
        self.before.copy_from_slice(&self.basis);
        self.whole = whole;
        let count = if whole { self.wrong.len() } else { 1 };
        self.steps += 1;
        self.singles += usize::from(!whole);
        for &i in &self.wrong[..count] {
            let (z, w) = (Variable::Z(i), Variable::W(i));
            let (entering, leaving) = if self.basis[i] { (w, z) } else { (z, w) };
            self.basis[i] = !self.basis[i];
            let ratio = f64::NAN;
            self.record.push(Pivot { iteration: self.steps, entering, leaving, ratio, z0: None });
        }
    }
}

impl<P: Complementary> Solver<P> for BlockPivoting {
    type Work = BlockWork;

    fn work(&self, problem: &P) -> Result<BlockWork, SolveError> {
        let mut work = BlockWork {
            free: 0,
            rows: vec![],
            columns: vec![],
            scratch: vec![],
            refuting: None,
            lu: SquareLu::default(),
            basis: vec![],
            before: vec![],
            alpha: vec![],
            place: vec![],
            entries: vec![],
            residual: vec![],
            z: vec![],
            w: Compensations::default(),
            wrong: vec![],
            least: 0,
            left: 0,
            single: false,
            whole: false,
            cycle: Cycle::default(),
            steps: 0,
            singles: 0,
            record: Recorder::default(),
        };
        work.fill(&problem.system()?)?;
        Ok(work)
    }

    fn refill(&self, problem: &P, work: &mut BlockWork) -> Result<(), SolveError> {
        work.fill(&problem.system()?)
    }

    fn start(&self, problem: &P, point: &mut LcpPoint, work: &mut BlockWork) {
        let system = system(problem);
        let BlockWork { basis, rows, columns, w, z, .. } = work;
        z.copy_from_slice(&point.z);
        w.fill(&system, z);
        for i in 0..system.dim() {
            let scaled = z[i] / columns[i];
            basis[i] = i < work.free || (scaled > 0.0 && scaled > w.sums[i].value() * rows[i]);
        }
        work.before.copy_from_slice(&work.basis);
        (work.least, work.left) = (usize::MAX, self.patience);
        (work.single, work.whole) = (false, false);
        (work.steps, work.singles) = (0, 0);
        work.cycle.begin(&work.basis);
    }

    fn step(&self, problem: &P, _: &mut LcpPoint, work: &mut BlockWork) -> Step {
        let system = system(problem);
        if let Some(row) = work.refuting {
            return Step::NoSolution(Certificate::Row { row });
        }
        if !work.solve(&system) {
            let first = work.steps == 0;
            let all = || work.basis.iter().all(|b| *b);
            if first && !all() {
                // The point's basis is no good, or free variables need complementary ones.
                let plain = work.basis[work.free..].iter().all(|b| !*b);
                if plain {
                    let small = system.dim() <= MOST_PAIRED;
                    match small.then(|| Tableau::new(&system)) {
                        Some(Ok(tableau)) => work.basis.copy_from_slice(tableau.basis()),
                        _ => work.basis.fill(true),
                    }
                } else {
                    work.basis[work.free..].fill(false);
                }
                work.steps = usize::from(plain);
                work.before.copy_from_slice(&work.basis);
                return Step::Continue { estimate: f64::NAN };
            }
            if !work.whole {
                return Step::Stuck("a singular principal submatrix in the way".into());
            }
            // Back, and more carefully.
            work.basis.copy_from_slice(&work.before);
            work.single = true;
            if !work.solve(&system) || work.wrong.is_empty() {
                return Step::Stuck("a singular principal submatrix in the way".into());
            }
            work.cycle.begin(&work.basis);
            work.change(false);
            return Step::Continue { estimate: f64::NAN };
        }
        let count = work.wrong.len();
        if count == 0 {
            return Step::Done;
        }
        if count < work.least {
            (work.least, work.left, work.single) = (count, self.patience, false);
            work.cycle.begin(&work.basis);
        } else if !work.single {
            match work.left.checked_sub(1) {
                Some(left) => work.left = left,
                None if self.fallback => {
                    work.single = true;
                    work.cycle.begin(&work.basis);
                }
                None => {}
            }
        }
        if work.single && self.most_singles > 0 && work.singles >= self.most_singles {
            return Step::Stuck("single changes prevail: see `most_singles`".into());
        }
        work.change(!work.single);
        if work.cycle.returns(&work.basis) && (work.single || !self.fallback) {
            return Step::Stuck(if work.single {
                "single changes cycle: M is not a P-matrix".into()
            } else {
                "the blocks of changes cycle".into()
            });
        }
        Step::Continue { estimate: f64::NAN }
    }

    fn publish(&self, _: &P, point: &mut LcpPoint, work: &mut BlockWork) {
        for (i, (z, x)) in point.z.iter_mut().zip(&work.z).enumerate() {
            *z = if i < work.free { *x } else { x.max(0.0) };
        }
    }

    fn record(&self, on: bool, work: &mut BlockWork) {
        work.record.begin(on);
    }

    fn trace(&self, work: &BlockWork) -> Trace {
        Trace::Pivots(work.record.rows())
    }

    fn account(&self, work: &BlockWork) -> Vec<String> {
        let BlockWork { steps, singles, .. } = work;
        vec![format!("{steps} changes of basis, {singles} of them of a single variable.")]
    }
}

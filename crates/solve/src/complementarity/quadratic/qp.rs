//! **The convex quadratic program** whose optimality conditions the problem is.
//!
//! Problem: `−w_i ∈ N_[l_i, u_i](z_i)`, `w = M z + q`, M positive semidefinite. An LCP is `l = 0, u = ∞`.
//!
//! Method: with a symmetric M (form `energy`) the solutions are those of `min ½ zᵀM z + qᵀz`, `l ≤ z ≤ u` (lecture (18)). Without (form `gap`), those of
//! `min zᵀ(M z + q)`, `z ≥ 0`, `M z + q ≥ 0` with the value zero, which a monotone LCP that is feasible has; free variables have equations instead. Clarabel
//! solves the program; then the variables between their bounds are identified and their equations solved to rounding (proximal point
//! method, each step by Newton's method on the natural map, so redundant rows do not matter). A program that is unbounded (`energy`) or infeasible (`gap`) gives a Farkas vector.
//!
//! References: GoulartChen2024; CottlePangStone2009, section 1.4; Acary2018 (18).
//! Cost: one step is a whole solve of Clarabel (10 to 30 sparse LDLᵀ factorisations), the second polishes with a few
//! factorisations of the size of M. Storage: Clarabel's factors, a scaled copy of M. A given point is used where its own polish solves the problem.
//! Fails: M that is not positive semidefinite is refused. Where Clarabel cannot get near a solution, neither can the polish.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};
use nonsmooth_linalg::{Compensated, Csc, Dense, Matrix, SquareCholesky, budget};
use nonsmooth_problem::LcpPoint;
use nonsmooth_problem::check::Certificate;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::complementarity::form::{Bounded, Bounds, Equations, System, system};
use crate::complementarity::parts::pairs::{Newton, Scaled, Side, clean, hopeless_row};
use crate::core::clarabel::admit_program;
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};
use crate::{SolveError, Solver, Step};

/// The objective and the constraints of the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Form {
    /// `energy` of a symmetric M, else `gap`.
    Auto,
    /// `min ½ zᵀM z + qᵀz` between the bounds.
    Energy,
    /// `min zᵀ(M z + q)` where both factors are nonnegative.
    Gap,
}

/// The program that Clarabel gets; what follows it, identification and Newton's method, has no setting.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct QuadraticProgram {
    /// Which program: energy needs a symmetric M, gap needs variables that are free or nonnegative.
    pub form: Form,
    /// Clarabel's tolerance on gap and feasibility, in (0, 1e-3].
    pub inner_tolerance: f64,
    /// Clarabel's iterations at most, at least 1.
    pub inner_iterations: u32,
}

impl Default for QuadraticProgram {
    fn default() -> Self {
        Self { form: Form::Auto, inner_tolerance: 1e-9, inner_iterations: 200 }
    }
}

impl Settings for QuadraticProgram {
    fn validate(&self) -> Result<(), String> {
        if !(self.inner_tolerance > 0.0 && self.inner_tolerance <= 1e-3) {
            let found = self.inner_tolerance;
            return Err(format!("inner_tolerance: expected a number in (0, 1e-3], found {found}"));
        }
        if self.inner_iterations == 0 {
            return Err("inner_iterations: expected at least 1, found 0".into());
        }
        Ok(())
    }
}

impl Described for QuadraticProgram {
    const ABOUT: &'static About = &About {
        name: "qp",
        family: "quadratic",
        solves: Solves::Law,
        summary: "the convex quadratic program behind the problem, through Clarabel, polished",
        needs: &["M positive semidefinite; symmetric where variables have two bounds"],
        cites: &["GoulartChen2024", "CottlePangStone2009", "Acary2018"],
        variants: &["form=gap"],
        settings: described::<Self>,
    };
}

/// The scaled problem, and the Newton system that finishes the point.
pub struct QpWork {
    scaled: Scaled,
    newton: Newton,
    energy: bool,
    lower: Vec<f64>,
    upper: Vec<f64>,
    hopeless: Option<usize>,
    /// The iterate in scaled units, its w, the best one with its merit, the proximal centre, and the projection of the iterate.
    z: Vec<f64>,
    w: Vec<f64>,
    best: Vec<f64>,
    merit: f64,
    centre: Vec<f64>,
    trial: Vec<f64>,
    alpha: Vec<f64>,
    beta: Vec<f64>,
    t: Vec<f64>,
    sums: Vec<Compensated>,
    inside: Vec<bool>,
    stage: Stage,
    iterations: u32,
    status: &'static str,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    Given,
    Program,
    Polish,
}

/// Proximal terms, in units in which the entries of M are about one, and the most centres.
const SMALL: f64 = 1e-9;
const LARGE: f64 = 1e-3;
const CENTRES: usize = 15;
/// Sets of variables between their bounds that are tried for each centre.
const ROUNDS: usize = 12;
/// Solves with each factor.
const REFINEMENTS: usize = 3;
/// Below this, the symmetric part of the scaled M may be indefinite.
const SEMIDEFINITE: f64 = 1e-12;
/// A residual that counts as rounding.
const EXACT: f64 = 2e-15;
/// A given point with a residual below this is polished first.
const WARM: f64 = 0.1;

impl<P: Bounded> Solver<P> for QuadraticProgram {
    type Work = QpWork;

    fn work(&self, problem: &P) -> Result<QpWork, SolveError> {
        let mut work = QpWork {
            scaled: Scaled::congruent(),
            newton: Newton::default(),
            energy: true,
            lower: vec![],
            upper: vec![],
            hopeless: None,
            z: vec![],
            w: vec![],
            best: vec![],
            centre: vec![],
            trial: vec![],
            merit: f64::INFINITY,
            alpha: vec![],
            beta: vec![],
            t: vec![],
            sums: vec![],
            inside: vec![],
            stage: Stage::Given,
            iterations: 0,
            status: "",
        };
        self.fill(&problem.system()?, &mut work)?;
        Ok(work)
    }

    fn refill(&self, problem: &P, work: &mut QpWork) -> Result<(), SolveError> {
        self.fill(&problem.system()?, work)
    }

    fn start(&self, problem: &P, point: &mut LcpPoint, work: &mut QpWork) {
        let bounds = system(problem).bounds;
        work.z.copy_from_slice(&point.z);
        work.z.iter_mut().enumerate().for_each(|(i, z)| *z = bounds.project(i, *z));
        work.scaled.enter(&mut work.z, &mut []);
        work.merit = f64::INFINITY;
        work.stage = Stage::Given;
        work.iterations = 0;
        work.status = "not asked";
        work.judge();
    }

    fn step(&self, _: &P, _: &mut LcpPoint, work: &mut QpWork) -> Step {
        if let Some(row) = work.hopeless {
            return Step::NoSolution(Certificate::Row { row });
        }
        loop {
            match work.stage {
                Stage::Given => {
                    work.stage = Stage::Program;
                    if work.merit <= WARM {
                        if work.polish() {
                            return Step::Done;
                        }
                        return Step::Continue { estimate: work.merit };
                    }
                }
                Stage::Program => {
                    work.stage = Stage::Polish;
                    return match self.program(work) {
                        Ok(Some(y)) => Step::NoSolution(Certificate::Farkas { y }),
                        Ok(None) => Step::Continue { estimate: work.merit },
                        Err(why) => Step::Stuck(why.into()),
                    };
                }
                Stage::Polish => {
                    work.polish();
                    return if work.merit <= 1e-9 {
                        Step::Done
                    } else {
                        Step::Stuck(
                            "the answer of the quadratic program cannot be made accurate".into(),
                        )
                    };
                }
            }
        }
    }

    fn publish(&self, _: &P, point: &mut LcpPoint, work: &mut QpWork) {
        point.z.copy_from_slice(&work.best);
        work.scaled.leave(&mut point.z, &mut []);
    }

    fn account(&self, work: &QpWork) -> Vec<String> {
        let form = if work.energy { "energy" } else { "gap" };
        vec![format!("form {form}; Clarabel: {} in {} iterations", work.status, work.iterations)]
    }
}

impl QuadraticProgram {
    fn fill(&self, system: &System, work: &mut QpWork) -> Result<(), SolveError> {
        system.needs_entries()?;
        let n = system.dim();
        let equations =
            Equations { matrix: system.matrix, slack: None, q: system.q, free: system.free() };
        let boxed = matches!(system.bounds, Bounds::Box { .. });
        work.scaled.refill(&equations);
        work.energy = match self.form {
            Form::Auto => work.scaled.symmetric || boxed,
            Form::Energy => true,
            Form::Gap => false,
        };
        if work.energy && !work.scaled.symmetric {
            return Err(SolveError::needs("a symmetric M", "one that is not"));
        }
        if !work.energy && boxed {
            return Err(SolveError::needs(
                "variables that are free or nonnegative (form gap)",
                "a box",
            ));
        }
        if !semidefinite(work.scaled.matrix()) {
            return Err(SolveError::needs("a positive semidefinite M", "one that is not"));
        }
        work.newton.refill(&work.scaled);
        work.hopeless = if boxed { None } else { hopeless_row(&equations, &mut work.inside) };
        for (to, upper) in [(&mut work.lower, false), (&mut work.upper, true)] {
            to.clear();
            let bound = |i| if upper { system.bounds.upper(i) } else { system.bounds.lower(i) };
            to.extend((0..n).map(|i| work.scaled.bound(i, bound(i))));
        }
        work.scaled.bounded(&work.lower, &work.upper);
        for v in [
            &mut work.z,
            &mut work.w,
            &mut work.best,
            &mut work.centre,
            &mut work.alpha,
            &mut work.beta,
            &mut work.t,
        ] {
            v.resize(n, 0.0);
        }
        work.inside.clear();
        work.inside.resize(n, false);
        Ok(())
    }

    /// Solves the program. A vector that refutes the problem, if that is what comes out; an error where there is nothing to use.
    fn program(&self, work: &mut QpWork) -> Result<Option<Vec<f64>>, &'static str> {
        let program = if work.energy { energy(work) } else { gap(work) };
        let settings = DefaultSettings {
            max_iter: self.inner_iterations,
            verbose: false,
            max_threads: 1,
            presolve_enable: false,
            tol_gap_abs: self.inner_tolerance,
            tol_gap_rel: self.inner_tolerance,
            tol_feas: self.inner_tolerance,
            ..DefaultSettings::default()
        };
        let Program { quadratic, linear, constraints, bound, cones } = &program;
        admit_program(quadratic, constraints).map_err(|_| "there is not memory enough")?;
        let Ok(mut solver) =
            DefaultSolver::new(quadratic, linear, constraints, bound, cones, settings)
        else {
            return Err("Clarabel does not accept the program");
        };
        solver.set_termination_callback(|_: &_| budget::over());
        solver.solve();
        let solution = &solver.solution;
        work.iterations = solution.iterations;
        let n = work.z.len();
        let refuting = match solution.status {
            SolverStatus::DualInfeasible | SolverStatus::AlmostDualInfeasible if work.energy => {
                work.status = "unbounded";
                Some(solution.x.to_vec())
            }
            SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible
                if !work.energy =>
            {
                work.status = "infeasible";
                // The multipliers of the rows, which come first.
                Some(solution.z[..n].to_vec())
            }
            SolverStatus::Solved => {
                work.status = "solved";
                None
            }
            _ => {
                work.status = "roughly solved";
                None
            }
        };
        if let Some(mut y) = refuting {
            if !work.energy {
                // Of an equality `M z = −q` the multiplier has the other sign of that of `−M z ≤ q`.
                y[..work.scaled.free].iter_mut().for_each(|y| *y = -*y);
            }
            let sides: Vec<Side> = work.sides();
            let cleaned = clean(work.scaled.matrix(), &sides, &y);
            let mut y =
                cleaned.ok_or("the program seems to have no solution, but no proof was found")?;
            work.scaled.rows_leave(&mut y);
            return Ok(Some(y));
        }
        if solution.x.iter().any(|x| !x.is_finite()) {
            return Err("Clarabel has found no point");
        }
        work.z.copy_from_slice(&solution.x[..n]);
        work.judge();
        Ok(None)
    }
}

impl QpWork {
    fn sides(&self) -> Vec<Side> {
        let bounds = self.lower.iter().zip(&self.upper);
        bounds
            .map(|(l, u)| match (l.is_finite(), u.is_finite()) {
                (true, true) => Side::Both,
                (true, false) => Side::Lower,
                (false, true) => Side::Upper,
                (false, false) => Side::Free,
            })
            .collect()
    }

    /// Judges the projection of z, and keeps it if it is the best; its merit.
    fn judge(&mut self) -> f64 {
        let Self { scaled, z, trial, t, lower, upper, sums, best, merit, .. } = self;
        let bounds = lower.iter().zip(upper.iter());
        trial.clear();
        trial.extend(z.iter().zip(bounds).map(|(z, (l, u))| z.max(*l).min(*u)));
        scaled.product_precisely(trial, t, sums);
        let now = scaled.merit_between(trial, t, lower, upper);
        if now < *merit {
            *merit = now;
            best.copy_from_slice(trial);
        }
        now
    }

    /// The proximal point method from the best point, its steps by Newton's method on the natural map; whether the best point is exact.
    ///
    /// A small δ ends at once where the guess of the variables between their bounds is right. Where it is not (degenerate problems with redundant rows) it
    /// throws the iterate far off, so δ then comes down from a size at which the guess is corrected step by step.
    fn polish(&mut self) -> bool {
        self.centre.copy_from_slice(&self.best);
        self.proximal_step(SMALL);
        let mut shift = LARGE;
        self.centre.copy_from_slice(&self.best);
        for _ in 0..CENTRES {
            if self.merit <= EXACT {
                break;
            }
            if self.proximal_step(shift) {
                // The next centre is the solution, better or not.
                self.centre.copy_from_slice(&self.z);
                shift = (0.1 * shift).max(SMALL);
            } else {
                shift = (30.0 * shift).min(1.0);
            }
        }
        self.merit <= EXACT
    }

    /// Solves `−(w + δ (z − z_k)) ∈ N_[l, u](z)` for the centre z_k; whether it is solved.
    fn proximal_step(&mut self, shift: f64) -> bool {
        let n = self.z.len();
        self.z.copy_from_slice(&self.centre);
        for round in 0..ROUNDS {
            let Self { scaled, z, w, sums, .. } = self;
            scaled.product_precisely(z, w, sums);
            let mut same = round > 0;
            for i in 0..n {
                let target = self.z[i] - self.w[i] - shift * (self.z[i] - self.centre[i]);
                let inside = self.lower[i] < target && target < self.upper[i];
                same &= inside == self.inside[i];
                self.inside[i] = inside;
                if target <= self.lower[i] {
                    self.z[i] = self.lower[i];
                } else if target >= self.upper[i] {
                    self.z[i] = self.upper[i];
                }
                (self.alpha[i], self.beta[i]) = if inside { (1.0, shift) } else { (0.0, 1.0) };
            }
            let Self { scaled, newton, alpha, beta, .. } = self;
            if same || newton.factorise(scaled, alpha, beta, 0.0).is_err() {
                return same;
            }
            self.solve_inside(shift);
            if self.judge() <= EXACT {
                return true;
            }
        }
        false
    }

    /// Solves the equations of the variables between their bounds.
    fn solve_inside(&mut self, shift: f64) {
        let Self { scaled, newton, z, w, t, sums, inside, centre, .. } = self;
        let mut last = f64::INFINITY;
        for _ in 0..REFINEMENTS {
            scaled.product_precisely(z, w, sums);
            let mut error = 0.0_f64;
            for i in 0..z.len() {
                t[i] = if inside[i] { -w[i] - shift * (z[i] - centre[i]) } else { 0.0 };
                error = error.max(t[i].abs());
            }
            if error == 0.0 || error.is_nan() || error > 0.5 * last {
                return;
            }
            last = error;
            newton.solve_once(t);
            if t.iter().any(|t| !t.is_finite()) {
                return;
            }
            for ((z, t), inside) in z.iter_mut().zip(t.iter()).zip(inside.iter()) {
                if *inside {
                    *z += t;
                }
            }
        }
    }
}

/// Whether the symmetric part is positive semidefinite, within rounding; entries are about one.
fn semidefinite(m: &Matrix) -> bool {
    let n = m.nrows();
    let symmetric: Matrix = match m {
        Matrix::Dense(m) => Dense::from_fn(n, n, |i, j| {
            0.5 * (m[(i, j)] + m[(j, i)]) + if i == j { SEMIDEFINITE } else { 0.0 }
        })
        .into(),
        Matrix::Sparse(m) => {
            let halves = m.triplets().flat_map(|(i, j, x)| [(i, j, 0.5 * x), (j, i, 0.5 * x)]);
            let shift = (0..n).map(|i| (i, i, SEMIDEFINITE));
            Csc::from_triplets(n, n, halves.chain(shift)).expect("in range").into()
        }
        Matrix::Operator(_) => return false,
    };
    SquareCholesky::default().factorise(&symmetric).is_ok()
}

/// `min ½ xᵀPx + cᵀx`, `b − A x` in the cones.
struct Program {
    quadratic: CscMatrix<f64>,
    linear: Vec<f64>,
    constraints: CscMatrix<f64>,
    bound: Vec<f64>,
    cones: Vec<SupportedConeT<f64>>,
}

/// `min ½ zᵀM z + cᵀz`, `l ≤ z ≤ u`.
fn energy(work: &QpWork) -> Program {
    let n = work.z.len();
    let mut upper_triangle = vec![];
    work.scaled.matrix().for_each(|i, j, x| {
        if i <= j {
            upper_triangle.push((i, j, x));
        }
    });
    let (mut equal, mut below, mut above) = (vec![], vec![], vec![]);
    for (i, (&l, &u)) in work.lower.iter().zip(&work.upper).enumerate() {
        if l == u {
            equal.push((i, l));
        } else {
            if l.is_finite() {
                below.push((i, l));
            }
            if u.is_finite() {
                above.push((i, u));
            }
        }
    }
    let (mut entries, mut bound) = (vec![], vec![]);
    for (rows, sign) in [(&equal, 1.0), (&below, -1.0), (&above, 1.0)] {
        for &(i, b) in rows {
            entries.push((bound.len(), i, sign));
            bound.push(sign * b);
        }
    }
    let cones = cones(equal.len(), below.len() + above.len());
    Program {
        quadratic: matrix(n, n, &upper_triangle),
        linear: work.scaled.c.clone(),
        constraints: matrix(bound.len(), n, &entries),
        bound,
        cones,
    }
}

/// `min zᵀM z + cᵀz`, `−M z ≤ c` (`M z = −c` in the rows of free variables, which come first), `−x ≤ 0`.
fn gap(work: &QpWork) -> Program {
    let (n, free) = (work.z.len(), work.scaled.free);
    let (mut upper_triangle, mut entries) = (vec![], vec![]);
    work.scaled.matrix().for_each(|i, j, x| {
        // M + Mᵀ
        upper_triangle.push((i.min(j), i.max(j), if i == j { 2.0 * x } else { x }));
        entries.push((i, j, if i < free { x } else { -x }));
    });
    let c = &work.scaled.c;
    let mut bound: Vec<f64> =
        c.iter().enumerate().map(|(i, c)| if i < free { -c } else { *c }).collect();
    for i in free..n {
        entries.push((bound.len(), i, -1.0));
        bound.push(0.0);
    }
    Program {
        quadratic: matrix(n, n, &upper_triangle),
        linear: c.clone(),
        constraints: matrix(bound.len(), n, &entries),
        cones: cones(free, bound.len() - free),
        bound,
    }
}

fn cones(zero: usize, nonnegative: usize) -> Vec<SupportedConeT<f64>> {
    let mut cones = vec![];
    if zero > 0 {
        cones.push(SupportedConeT::ZeroConeT(zero));
    }
    if nonnegative > 0 {
        cones.push(SupportedConeT::NonnegativeConeT(nonnegative));
    }
    cones
}

fn matrix(rows: usize, columns: usize, entries: &[(usize, usize, f64)]) -> CscMatrix<f64> {
    let a = Csc::from_triplets(rows, columns, entries.iter().copied()).expect("indices in range");
    let (colptr, rowval) = (a.col_ptr().to_vec(), a.row_idx().to_vec());
    CscMatrix::new(rows, columns, colptr, rowval, a.values().to_vec())
}

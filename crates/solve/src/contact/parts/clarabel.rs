//! Convex problems of contact through the conic solver Clarabel.
//!
//! Problem: `min ½ rᵀ W_s r + bᵀ r` over r in a product of Coulomb cones or of cylinders, W_s the symmetric part of W as a
//! [`Model`] states it (entries of W, or of M and H with the velocities as further unknowns).
//!
//! Method: Clarabel's form `min ½ xᵀPx + cᵀx, b − A x ∈ cones`, in units where the mean diagonal of W and the velocities
//! are one. A Coulomb cone is the second-order cone of `(mu r_N, r_T)`; a contact without friction is a half line and
//! two equalities; a cylinder is a half line and the second-order cone of `(θ, r_T)`. A is laid out once a pattern: c, b and values
//! change in place between solves.
//!
//! References: GoulartChen2024. Cost: one sparse LDLᵀ an iteration, 10 to 30 iterations; no warm start. Storage: the factor.
//! Fails: in space u is right to about the square root of the tolerance and to 1e-7 at best (in the plane to 1e-12): whoever needs
//! more polishes. Where the objective is unbounded, the status says so.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};
use nonsmooth_linalg::Csc;
use nonsmooth_linalg::budget::{self, TooLarge};

use crate::contact::form::Model;
use crate::core::clarabel::admit_program;

/// The product of sets that r lies in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// `‖r_T‖ ≤ mu r_N`.
    Coulomb,
    /// `r_N ≥ 0`, `‖r_T‖ ≤ θ`; `r_T = 0` where mu = 0.
    Cylinder,
}

/// How a conic solve ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ended {
    /// At the tolerance asked for.
    Accurate,
    /// With a point that is less accurate than asked for.
    Roughly,
    /// The objective has no minimum: the set allows an impulse that costs nothing and gains power.
    Unbounded,
    /// Without a usable point.
    Failed,
}

/// Clarabel, prepared for one problem's data.
pub struct Clarabel<const D: usize> {
    solver: DefaultSolver<f64>,
    layout: Layout,
    quadratic: CscMatrix<f64>,
    constraints: CscMatrix<f64>,
    /// Clarabel's c and b.
    cost: Vec<f64>,
    bound: Vec<f64>,
    /// The unit of W.
    w: f64,
    /// The unit of velocities at the last solve.
    speed: f64,
}

/// Which rows of A belong to which contact.
#[derive(Debug, Clone, PartialEq)]
struct Layout {
    set: Shape,
    frictional: Vec<bool>,
    /// Rows of the model's equalities.
    equalities: usize,
    /// The first row of each frictional contact's second-order cone.
    cones: Vec<usize>,
    kinds: Vec<Rows>,
}

/// A run of rows of A.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Rows {
    Zero(usize),
    HalfLine(usize),
    SecondOrder(usize),
}

impl<const D: usize> Clarabel<D> {
    /// Prepares Clarabel for the problem that `model` states, with `w > 0` a typical diagonal entry of W.
    ///
    /// Errors: a factor that takes more memory than there is.
    ///
    /// # Panics
    ///
    /// Never on a model whose matrices fit each other and the number of contacts.
    pub fn new(model: &Model, mu: &[f64], w: f64, set: Shape) -> Result<Self, TooLarge> {
        let layout = Layout::new::<D>(model, mu, set);
        let (quadratic, constraints) = layout.matrices::<D>(model, mu, w);
        let (n, rows) = (model.quadratic.ncols(), constraints.m);
        let (cost, bound) = (vec![0.0; n], vec![0.0; rows]);
        admit_program(&quadratic, &constraints)?;
        let mut solver = DefaultSolver::new(
            &quadratic,
            &cost,
            &constraints,
            &bound,
            &layout.clarabel_cones(),
            settings(1e-8, 60),
        )
        .expect("the matrices fit each other");
        solver.set_termination_callback(|_: &_| budget::over());
        // Rounded as what is refilled is, so that the same data have the same answer again.
        let _ = solver.update_P(&quadratic).and_then(|()| solver.update_A(&constraints));
        Ok(Self { solver, layout, quadratic, constraints, cost, bound, w, speed: 1.0 })
    }

    /// Takes another problem's data; in place where its pattern is the same.
    ///
    /// Errors: as [`new`](Self::new).
    pub fn refill(&mut self, model: &Model, mu: &[f64], w: f64) -> Result<(), TooLarge> {
        let layout = Layout::new::<D>(model, mu, self.layout.set);
        let same = |a: &CscMatrix<f64>, b: &CscMatrix<f64>| {
            (a.m, a.n) == (b.m, b.n) && a.colptr == b.colptr && a.rowval == b.rowval
        };
        let (quadratic, constraints) = layout.matrices::<D>(model, mu, w);
        let fits = layout == self.layout
            && same(&quadratic, &self.quadratic)
            && same(&constraints, &self.constraints);
        let updated = fits
            && self.solver.update_P(&quadratic).is_ok()
            && self.solver.update_A(&constraints).is_ok();
        if updated {
            (self.quadratic, self.constraints, self.w) = (quadratic, constraints, w);
        } else {
            *self = Self::new(model, mu, w, self.layout.set)?;
        }
        Ok(())
    }

    /// Minimises `½ rᵀ W_s r + bᵀ r` to a relative tolerance, with `speed > 0` a typical size of b and `theta` the radii of the
    /// cylinders (unused for Coulomb cones). `r` is overwritten where there is a usable point.
    pub fn solve(
        &mut self,
        b: &[f64],
        theta: &[f64],
        speed: f64,
        tolerance: f64,
        iterations: u32,
        r: &mut [f64],
    ) -> Ended {
        self.speed = speed;
        for (c, b) in self.cost.iter_mut().zip(b) {
            *c = b / speed;
        }
        let impulse = speed / self.w;
        if self.layout.set == Shape::Cylinder {
            // A disk without an interior leaves the conic problem without one.
            let largest = theta.iter().fold(0.0_f64, |a, t| a.max(*t));
            let floor = 1e-10 * if largest > 0.0 { largest } else { impulse };
            let frictional = self.layout.frictional.iter().zip(theta).filter(|(f, _)| **f);
            for (row, (_, theta)) in self.layout.cones.iter().zip(frictional) {
                self.bound[*row] = theta.max(floor) / impulse;
            }
        }
        let taken = self.solver.update_q(&self.cost).is_ok()
            && self.solver.update_b(&self.bound).is_ok()
            && self.solver.update_settings(settings(tolerance, iterations)).is_ok();
        if !taken {
            return Ended::Failed;
        }
        self.solver.solve();
        let solution = &self.solver.solution;
        let x = &solution.x[..r.len()];
        match solution.status {
            SolverStatus::DualInfeasible | SolverStatus::AlmostDualInfeasible => Ended::Unbounded,
            SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible => Ended::Failed,
            _ if x.iter().any(|x| !x.is_finite()) => Ended::Failed,
            status => {
                for (r, x) in r.iter_mut().zip(x) {
                    *r = impulse * x;
                }
                if status == SolverStatus::Solved { Ended::Accurate } else { Ended::Roughly }
            }
        }
    }

    /// `W_s r` of the last solution: `(P x + Eᵀ y)_r` with the multipliers y of the model's equalities.
    pub fn product(&self, wr: &mut [f64]) {
        let solution = &self.solver.solution;
        wr.fill(0.0);
        let p = &self.quadratic;
        for j in 0..p.n {
            for k in p.colptr[j]..p.colptr[j + 1] {
                // The upper triangle; r comes first, so rows beyond it end the column.
                let (i, value) = (p.rowval[k], p.nzval[k]);
                if i < wr.len() {
                    wr[i] += value * solution.x[j];
                    if i != j && j < wr.len() {
                        wr[j] += value * solution.x[i];
                    }
                }
            }
        }
        let a = &self.constraints;
        for (j, wr) in wr.iter_mut().enumerate() {
            for k in a.colptr[j]..a.colptr[j + 1] {
                if a.rowval[k] < self.layout.equalities {
                    *wr += a.nzval[k] * solution.z[a.rowval[k]];
                }
            }
            *wr *= self.speed;
        }
    }

    /// Iterations of the last solve, each with one factorisation.
    pub fn iterations(&self) -> u32 {
        self.solver.solution.iterations
    }
}

impl Layout {
    fn new<const D: usize>(model: &Model, mu: &[f64], set: Shape) -> Self {
        let frictional: Vec<bool> = mu.iter().map(|mu| *mu > 0.0).collect();
        let equalities = model.linear.nrows();
        let with = frictional.iter().filter(|f| **f).count();
        let without = frictional.len() - with;
        let half_lines = match set {
            Shape::Coulomb => without,
            Shape::Cylinder => frictional.len(),
        };
        let zero = equalities + (D - 1) * without;
        let mut kinds = vec![];
        if zero > 0 {
            kinds.push(Rows::Zero(zero));
        }
        if half_lines > 0 {
            kinds.push(Rows::HalfLine(half_lines));
        }
        kinds.extend((0..with).map(|_| Rows::SecondOrder(D)));
        let cones = (0..with).map(|k| zero + half_lines + D * k).collect();
        Self { set, frictional, equalities, cones, kinds }
    }

    fn clarabel_cones(&self) -> Vec<SupportedConeT<f64>> {
        let cone = |rows: &Rows| match *rows {
            Rows::Zero(n) => SupportedConeT::ZeroConeT(n),
            Rows::HalfLine(n) => SupportedConeT::NonnegativeConeT(n),
            Rows::SecondOrder(n) => SupportedConeT::SecondOrderConeT(n),
        };
        self.kinds.iter().map(cone).collect()
    }

    /// Clarabel's P (its upper triangle) and A, in the units of the solve.
    fn matrices<const D: usize>(
        &self,
        model: &Model,
        mu: &[f64],
        w: f64,
    ) -> (CscMatrix<f64>, CscMatrix<f64>) {
        let (n, m) = (model.quadratic.ncols(), D * mu.len());
        // r = (speed/w) r̂; the further unknowns, velocities, are speed times theirs.
        let scale = |j: usize| if j < m { 1.0 / w } else { w };
        let upper = (model.quadratic.triplets())
            .filter(|(i, j, _)| i <= j)
            .map(|(i, j, x)| (i, j, x * if (i < m) == (j < m) { scale(j) } else { 1.0 }));
        let quadratic = clarabel_matrix(n, n, upper);
        let equalities =
            (model.linear.triplets()).map(|(i, j, x)| (i, j, if j < m { x } else { w * x }));
        let mut entries = vec![];
        let mut zero = self.equalities;
        let mut half_line = match self.kinds.first() {
            Some(Rows::Zero(rows)) => *rows,
            _ => 0,
        };
        let mut cones = self.cones.iter();
        for (c, &mu) in mu.iter().enumerate() {
            let n_column = D * c;
            if self.set == Shape::Cylinder || mu == 0.0 {
                entries.push((half_line, n_column, -1.0));
                half_line += 1;
            }
            let first = match cones.next_if_frictional(mu) {
                Some(first) => {
                    if self.set == Shape::Coulomb {
                        entries.push((first, n_column, -mu));
                    }
                    first + 1
                }
                None => {
                    zero += D - 1;
                    zero - (D - 1)
                }
            };
            entries.extend((1..D).map(|k| (first + k - 1, n_column + k, -1.0)));
        }
        let rows = self.kinds.iter().map(|kind| match *kind {
            Rows::Zero(n) | Rows::HalfLine(n) | Rows::SecondOrder(n) => n,
        });
        let constraints = clarabel_matrix(rows.sum(), n, equalities.chain(entries.iter().copied()));
        (quadratic, constraints)
    }
}

/// The next cone, where the contact has one.
trait NextIfFrictional {
    fn next_if_frictional(&mut self, mu: f64) -> Option<usize>;
}

impl NextIfFrictional for std::slice::Iter<'_, usize> {
    fn next_if_frictional(&mut self, mu: f64) -> Option<usize> {
        if mu > 0.0 { self.next().copied() } else { None }
    }
}

fn clarabel_matrix(
    rows: usize,
    columns: usize,
    entries: impl Iterator<Item = (usize, usize, f64)> + Clone,
) -> CscMatrix<f64> {
    let a = Csc::from_triplets(rows, columns, entries).expect("indices in range");
    let (colptr, rowval) = (a.col_ptr().to_vec(), a.row_idx().to_vec());
    CscMatrix::new(rows, columns, colptr, rowval, a.values().to_vec())
}

fn settings(tolerance: f64, iterations: u32) -> DefaultSettings<f64> {
    DefaultSettings {
        max_iter: iterations,
        verbose: false,
        max_threads: 1,
        presolve_enable: false,
        tol_gap_abs: tolerance,
        tol_gap_rel: tolerance,
        tol_feas: tolerance,
        ..DefaultSettings::default()
    }
}

#[cfg(test)]
mod tests {
    use nonsmooth_linalg::small::{block, tangential_norm};
    use nonsmooth_problem::Problem;
    use nonsmooth_problem::planted::Planted;

    use super::*;
    use crate::contact::form::{Access, Contacts, Explicit, Frictional};
    use crate::contact::law::cone;

    fn cases() -> impl Iterator<Item = Planted> {
        let base = Planted { contacts: 12, dofs: 60, ..Planted::default() };
        let plain = (0..4).map({
            let base = base.clone();
            move |seed| Planted { seed, ..base.clone() }
        });
        plain.chain([
            Planted { mu: (0.0, 0.0), ..base.clone() },
            Planted { bilateral: 4, ..base.clone() },
            Planted { dofs: 18, ..base }, //               W of rank 18
        ])
    }

    /// `q + mu‖u_T*‖e_N` with the planted velocities makes the planted impulses the convex problem's solution.
    fn finds_planted<const D: usize, P: Explicit<D> + Frictional<D>>(
        problem: &P,
        planted: &[f64],
        at: &str,
    ) {
        let mut state = problem.state(Access::Products).unwrap();
        let m = planted.len();
        let (mut q, mut u, mut r) = (vec![0.0; m], vec![0.0; m], vec![0.0; m]);
        problem.velocities(&mut state, &r, &mut q);
        problem.velocities(&mut state, planted, &mut u);
        let mut b = q.clone();
        for (c, mu) in problem.mu().iter().enumerate() {
            b[D * c] += mu * tangential_norm(&block::<D>(&u, c));
        }
        let model = problem.model(&state);
        assert!(model.symmetric, "{at}");
        let other = Model { quadratic: model.quadratic.clone(), ..model.clone() };
        let mut conic = Clarabel::<D>::new(&model, problem.mu(), 1.0, Shape::Coulomb).unwrap();
        for speed in [1.0, 7.0] {
            let ended = conic.solve(&b, &[], speed, 1e-11, 60, &mut r);
            assert!(matches!(ended, Ended::Accurate | Ended::Roughly), "{at}: {ended:?}");
            let mut found = vec![0.0; m];
            problem.velocities(&mut state, &r, &mut found);
            let wrong = found.iter().zip(&u).fold(0.0_f64, |a, (x, y)| a.max((x - y).abs()));
            assert!(wrong < 2e-5, "{at}: u off by {wrong:.1e}, {ended:?}");
            let mut product = vec![0.0; m];
            conic.product(&mut product);
            let off = (0..m).fold(0.0_f64, |a, i| a.max((product[i] + q[i] - found[i]).abs()));
            assert!(off < 1e-5, "{at}: W r off by {off:.1e}");
            conic.refill(&other, problem.mu(), 2.0).unwrap();
        }
        // Cylinders through the planted normal impulses: Tresca's problem has the Coulomb solution.
        let theta: Vec<f64> =
            (problem.mu().iter().enumerate()).map(|(c, mu)| mu * planted[D * c]).collect();
        let mut conic = Clarabel::<D>::new(&model, problem.mu(), 1.0, Shape::Cylinder).unwrap();
        let ended = conic.solve(&q, &theta, 1.0, 1e-11, 60, &mut r);
        assert!(matches!(ended, Ended::Accurate | Ended::Roughly), "{at}: {ended:?}");
        let mut found = vec![0.0; m];
        problem.velocities(&mut state, &r, &mut found);
        let wrong = found.iter().zip(&u).fold(0.0_f64, |a, (x, y)| a.max((x - y).abs()));
        assert!(wrong < 2e-5, "{at}: Tresca's u off by {wrong:.1e}, {ended:?}");
        for (c, &mu) in problem.mu().iter().enumerate() {
            let x: [f64; D] = block(&r, c);
            let p = cone::project(&x, mu);
            assert!((0..D).all(|k| (p[k] - x[k]).abs() < 1e-4), "{at}: {x:?}");
        }
    }

    #[test]
    fn planted_solutions_of_the_convex_problems_are_found() {
        for case in cases() {
            let at = format!("{case:?}");
            let (problem, point) = case.local::<3>();
            finds_planted(&problem, &point.r, &format!("local 3D {at}"));
            let (problem, point) = case.local::<2>();
            finds_planted(&problem, &point.r, &format!("local 2D {at}"));
            let (problem, point) = case.global::<3>();
            finds_planted(&problem, &point.r, &format!("global 3D {at}"));
            let (problem, point) = case.global::<2>();
            finds_planted(&problem, &point.r, &format!("global 2D {at}"));
        }
    }

    #[test]
    fn an_unbounded_problem_is_told() {
        // No motion can separate this contact: W = 0, q_N < 0.
        let w = nonsmooth_linalg::Bsr::<3>::from_csc(&Csc::diagonal(&[0.0; 3]));
        let problem =
            nonsmooth_problem::FrictionLocal::new(w, vec![-1.0, 0.0, 0.0], vec![0.5]).unwrap();
        assert!(problem.validate_point(&problem.origin()).is_ok());
        let state = problem.state(Access::Products).unwrap();
        let model = problem.model(&state);
        let mut conic = Clarabel::<3>::new(&model, problem.mu(), 1.0, Shape::Coulomb).unwrap();
        let ended = conic.solve(&problem.q, &[], 1.0, 1e-8, 60, &mut [0.0; 3]);
        assert_eq!(ended, Ended::Unbounded);
    }
}

//! The second-order cone program `max t`, `u − t e_N ∈ K*`, `t ≤ 1`, in the self-dual cone and without units; its multipliers
//! as impulses, and their projection onto those that feel no motion.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};
use nonsmooth_linalg::{Csc, budget};
use nonsmooth_problem::check::{Impulses, Kinematics};

use super::Clock;
use crate::core::clarabel::admit_program;

/// The program `min −t + ½ δ‖x‖²`, `s = S (A x + c) − t e ∈ L`, `E x + e = 0`, `t ≤ 1`, with S = diag(1, mu, mu): a contact with
/// friction has D rows, one without its normal row.
///
/// Unknowns are in units that make the largest entry of each column 1, velocities in units of the largest constant. The small
/// term in δ keeps motions bounded which go to infinity otherwise.
pub(super) struct Program<'a, const D: usize> {
    kinematics: &'a Kinematics<D>,
    /// Of each row: the row of `[A; E]` and its factor; rows with a nonnegative slack first, then cones of D rows, then equations.
    rows: Vec<(usize, f64)>,
    nonnegative: usize,
    cones: usize,
    /// The scaled rows, a column for each unknown that appears.
    matrix: Csc,
    /// `x_j = unit_j · scaled`.
    columns: Vec<(usize, f64)>,
    constant: Vec<f64>,
}

/// The answer of a [`Program`].
pub(super) struct Widest<'a, const D: usize> {
    program: Program<'a, D>,
    /// x.
    pub(super) motion: Vec<f64>,
    multipliers: Vec<f64>,
}

/// The weight δ of the size of the motion.
const WEIGHT: f64 = 1e-8;
/// What is asked of the program's residuals.
const TOLERANCE: f64 = 1e-9;

impl<'a, const D: usize> Program<'a, D> {
    /// States the program with `factor` times the coefficients of friction, of rolling friction in the same cone.
    pub(super) fn new(kinematics: &'a Kinematics<D>, factor: f64) -> Self {
        let m = kinematics.contact_rows();
        let contacts = 0..kinematics.mu.len();
        let is_plain = |c: usize| kinematics.coefficients(c).all(|mu| factor * mu == 0.0);
        let plain = contacts.clone().filter(|&c| is_plain(c));
        let mut rows: Vec<(usize, f64)> = plain.map(|c| (D * c, 1.0)).collect();
        let nonnegative = rows.len();
        for c in contacts.filter(|&c| !is_plain(c)) {
            let of = |k: usize| if k == 0 { 1.0 } else { factor * kinematics.coefficient(c, k) };
            rows.extend((0..D).map(|k| (D * c + k, of(k))));
        }
        let cones = (rows.len() - nonnegative) / D;
        for i in m..kinematics.constant.len() {
            let largest = kinematics.rows.column(i).1.iter().fold(0.0_f64, |l, a| l.max(a.abs()));
            rows.push((i, if largest > 0.0 { 1.0 / largest } else { 1.0 }));
        }
        let mut units = vec![0.0_f64; kinematics.rows.nrows()];
        let entries = rows.iter().enumerate().flat_map(|(k, &(i, factor))| {
            let (columns, values) = kinematics.rows.column(i);
            columns.iter().zip(values).map(move |(&j, &a)| (k, j, factor * a))
        });
        entries.clone().for_each(|(_, j, a)| units[j] = units[j].max(a.abs()));
        let mut columns = vec![];
        let mut place = vec![usize::MAX; units.len()];
        for (j, &unit) in units.iter().enumerate().filter(|(_, unit)| **unit > 0.0) {
            place[j] = columns.len();
            columns.push((j, 1.0 / unit));
        }
        let scaled = entries.filter(|e| e.2 != 0.0).map(|(k, j, a)| (k, place[j], a / units[j]));
        let matrix = Csc::from_triplets(rows.len(), columns.len(), scaled).expect("in range");
        let mut constant: Vec<f64> =
            rows.iter().map(|&(i, factor)| factor * kinematics.constant[i]).collect();
        let largest = constant.iter().fold(0.0_f64, |l, c| l.max(c.abs()));
        if largest > 0.0 {
            constant.iter_mut().for_each(|c| *c /= largest);
            columns.iter_mut().for_each(|(_, unit)| *unit *= largest);
        }
        Self { kinematics, rows, nonnegative, cones, matrix, columns, constant }
    }

    /// Solves it; whatever it ends with is returned, to be verified. `None` if it is refused.
    pub(super) fn solve(self, clock: &Clock) -> Option<Widest<'a, D>> {
        let (n, rows) = (self.columns.len(), self.rows.len());
        let equations = self.nonnegative + D * self.cones;
        // A x + s = b: the contacts with −A, the equations with +E, and t below 1 as the first row.
        let mut entries = vec![(0, n, 1.0)];
        entries.extend(
            self.matrix.triplets().map(|(i, j, a)| (1 + i, j, if i < equations { -a } else { a })),
        );
        let normal = |k: usize| k < self.nonnegative || (k - self.nonnegative).is_multiple_of(D);
        entries.extend((0..equations).filter(|&k| normal(k)).map(|k| (1 + k, n, 1.0)));
        let a = Csc::from_triplets(1 + rows, n + 1, entries.into_iter()).ok()?;
        let mut b = vec![1.0];
        let constants = self.constant.iter().enumerate();
        b.extend(constants.map(|(k, c)| if k < equations { *c } else { -c }));
        let p = Csc::diagonal(&[vec![WEIGHT; n], vec![0.0]].concat());
        let mut q = vec![0.0; n + 1];
        q[n] = -1.0;
        let mut cones = vec![SupportedConeT::NonnegativeConeT(1 + self.nonnegative)];
        cones.extend((0..self.cones).map(|_| SupportedConeT::SecondOrderConeT(D)));
        if rows > equations {
            cones.push(SupportedConeT::ZeroConeT(rows - equations));
        }
        let settings = DefaultSettings {
            verbose: false,
            max_iter: 100,
            max_threads: 1,
            time_limit: clock.left().unwrap_or(f64::INFINITY).max(0.0),
            tol_gap_abs: TOLERANCE,
            tol_gap_rel: TOLERANCE,
            tol_feas: TOLERANCE,
            tol_infeas_abs: TOLERANCE,
            tol_infeas_rel: TOLERANCE,
            ..DefaultSettings::default()
        };
        admit_program(&theirs(&p), &theirs(&a)).ok()?;
        let mut solver =
            DefaultSolver::new(&theirs(&p), &q, &theirs(&a), &b, &cones, settings).ok()?;
        solver.set_termination_callback(|_: &_| budget::over());
        solver.solve();
        let solution = &solver.solution;
        if matches!(solution.status, SolverStatus::Unsolved) {
            return None;
        }
        let mut motion = vec![0.0; self.kinematics.rows.nrows()];
        for (&(j, unit), x) in self.columns.iter().zip(&solution.x) {
            motion[j] = unit * x;
        }
        let mut multipliers = solution.z[1..].to_vec();
        multipliers[equations..].iter_mut().for_each(|z| *z = -*z);
        Some(Widest { program: self, motion, multipliers })
    }
}

fn theirs(a: &Csc) -> CscMatrix<f64> {
    let (ptr, rows, values) = (a.col_ptr(), a.row_idx(), a.values());
    CscMatrix::new(a.nrows(), a.ncols(), ptr.to_vec(), rows.to_vec(), values.to_vec())
}

/// Impulses below these shares of the largest are taken for zero, one after the other.
const SUPPORTS: [f64; 4] = [1e-8, 1e-6, 1e-4, 1e-2];
/// Iterations of a projection, those without progress that it may do, and the residual that is enough.
const PROJECTION: usize = 2000;
const PATIENCE: usize = 100;
const ROUNDING: f64 = 2e-15;

impl<const D: usize> Widest<'_, D> {
    /// Candidates for impulses that refute: the multipliers without those that are nearly zero, projected onto those that
    /// feel no motion.
    pub(super) fn rays<'b>(&'b self, clock: &'b Clock) -> impl Iterator<Item = Impulses> + 'b {
        SUPPORTS.iter().filter_map(|share| self.ray(*share, clock))
    }

    fn ray(&self, share: f64, clock: &Clock) -> Option<Impulses> {
        let Program { kinematics, rows, nonnegative, matrix, .. } = &self.program;
        let equations = nonnegative + D * self.program.cones;
        // The normal row of each row.
        let normal = |k: usize| match k {
            k if k < *nonnegative => k,
            k if k < equations => k - (k - nonnegative) % D,
            k => k,
        };
        let z = &self.multipliers;
        let largest = z.iter().fold(0.0_f64, |l, z| l.max(z.abs()));
        if !(largest > 0.0 && largest.is_finite()) || clock.over() {
            return None;
        }
        let kept: Vec<usize> =
            (0..rows.len()).filter(|&k| k >= equations || z[normal(k)] > share * largest).collect();
        let mut place = vec![usize::MAX; rows.len()];
        kept.iter().enumerate().for_each(|(new, &k)| place[k] = new);
        let entries = matrix.triplets().filter(|e| place[e.0] != usize::MAX);
        let entries = entries.map(|(k, j, a)| (place[k], j, a));
        let restricted = Csc::from_triplets(kept.len(), matrix.ncols(), entries).ok()?;
        let mut y: Vec<f64> = kept.iter().map(|&k| z[k] / largest).collect();
        for _ in 0..2 {
            project(&restricted, &mut y, clock);
        }
        let m = kinematics.contact_rows();
        let mut ray =
            Impulses { r: vec![0.0; m], lambda: vec![0.0; kinematics.constant.len() - m] };
        for (&k, y) in kept.iter().zip(&y) {
            let (i, factor) = rows[k];
            *if i < m { &mut ray.r[i] } else { &mut ray.lambda[i - m] } = factor * y;
        }
        Some(ray)
    }
}

/// The nearest y with `Aᵀ y = 0` up to rounding: the residual of the least-squares problem `min ‖y − A x‖` by conjugate
/// gradients. Where A has no full rank they run away once they have reached rounding, so the best y counts.
fn project(a: &Csc, y: &mut Vec<f64>, clock: &Clock) {
    let square = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>();
    let mut s = vec![0.0; a.ncols()];
    a.mul_transpose_add(1.0, y, &mut s);
    let mut p = s.clone();
    let mut left = square(&s);
    // Columns are of size about 1.
    let enough = (ROUNDING * square(y).sqrt()).powi(2);
    let mut product = vec![0.0; y.len()];
    let (mut best, mut least, mut since) = (y.clone(), left, 0);
    for k in 0..PROJECTION {
        if least <= enough || since > PATIENCE || (k % 64 == 63 && clock.over()) {
            break;
        }
        product.fill(0.0);
        a.mul_add(1.0, &p, &mut product);
        let curvature = square(&product);
        if curvature <= 0.0 || !curvature.is_finite() {
            break;
        }
        let step = left / curvature;
        y.iter_mut().zip(&product).for_each(|(y, d)| *y -= step * d);
        s.fill(0.0);
        a.mul_transpose_add(1.0, y, &mut s);
        let next = square(&s);
        let turn = next / left;
        p.iter_mut().zip(&s).for_each(|(p, s)| *p = s + turn * *p);
        left = next;
        since += 1;
        if left < least {
            (least, since) = (left, 0);
            best.clone_from(y);
        }
    }
    *y = best;
}

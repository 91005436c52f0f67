//! Variational inequalities over polyhedra, balls, second-order cones and products.
//!
//! The unknowns are x and a multiplier for each row of a polyhedron, each ball and each cone; y are F, then `F + normals`, then the constraints. Which piece a set is in is read off where x is the projection
//! of: `p = x − γ F(x)` with the judge's γ.

use nonsmooth_linalg::{Csc, Matrix, SquareLu, budget};
use nonsmooth_problem::check::Held;
use nonsmooth_problem::{LcpPoint, Problem, ProblemError, Set, Vi};

use super::DerivativeError;
use super::equations::{Column, Columns, Equation};
use super::stated::{Load, Matrices, Pieces, Side, Statement, jacobian, solved};

/// The equations of a solution.
pub(super) fn over(
    problem: &Vi,
    point: &LcpPoint,
    tolerance: f64,
) -> Result<Pieces, DerivativeError> {
    solved(problem, point, tolerance)?;
    let held = problem.gauge()?.held(problem, point).ok_or(match budget::over() {
        true => DerivativeError::Interrupted,
        false => DerivativeError::Undefined,
    })?;
    let (f, jacobian) = jacobian(&*problem.F, &point.z)?;
    let parts = problem.set.parts();
    let polyhedra = parts.iter().filter(|(_, set)| matches!(set, Set::Polyhedron { .. })).count();
    let mut making = Making {
        n: problem.dim(),
        near: tolerance * held.size,
        held: &held,
        f: &f,
        point: point.z.clone(),
        rows: vec![true; problem.dim()],
        columns: vec![Column::Zero; problem.dim()],
        pieces: vec![],
        matrices: Matrices::default(),
        loads: LETTERS.map(|letter| Load { letter, len: 0, entries: vec![] }),
        bounds: 0,
        alone: polyhedra == 1,
        degenerate: 0,
    };
    for (&(first, set), held) in parts.iter().zip(&held.rows) {
        making.part(first, set, held)?;
    }
    Ok(making.made(&jacobian)?)
}

/// The letters of the data of sets, but for bounds.
const LETTERS: [&str; 4] = ["b", "d", "centre", "radius"];
const B: usize = 0;
const D: usize = 1;
const CENTRE: usize = 2;
const RADIUS: usize = 3;

struct Making<'a> {
    n: usize,
    /// What is nearer than this is at the border.
    near: f64,
    held: &'a Held,
    f: &'a [f64],
    /// x with the multipliers as far as they are known.
    point: Vec<f64>,
    /// Whether `F + normals` stands in the row of a variable.
    rows: Vec<bool>,
    columns: Vec<Column>,
    pieces: Vec<Equation>,
    matrices: Matrices,
    loads: [Load; 4],
    bounds: usize,
    /// Whether there is one polyhedron.
    alone: bool,
    degenerate: usize,
}

/// A column that follows from the equations, until all are counted.
const FREE: Column = Column::Free(0);

impl Making<'_> {
    /// A multiplier more; its column, and that is its constraint's row as well, n further.
    fn multiplier(&mut self, value: f64, free: bool) -> usize {
        let column = self.columns.len();
        self.columns.push(if free { FREE } else { Column::Zero });
        self.point.push(value);
        if free {
            self.pieces.push(Equation::zero(self.n + column));
        }
        column
    }

    /// `F + normals = 0` of these variables.
    fn free(&mut self, variables: std::ops::Range<usize>) {
        for j in variables {
            self.columns[j] = FREE;
            self.pieces.push(Equation::zero(self.n + j));
        }
    }

    fn entry(&mut self, row: usize, column: usize, x: f64) {
        self.matrices.entries.push((row, column, x));
    }

    /// A constraint g with a multiplier, in its row and, as normal, in the column of that.
    fn gradient(&mut self, multiplier: usize, j: usize, slope: f64, sign: f64) {
        self.entry(self.n + multiplier, j, slope);
        self.entry(self.n + j, multiplier, sign * slope);
    }

    fn part(&mut self, first: usize, set: &Set, held: &[usize]) -> Result<(), DerivativeError> {
        match set {
            Set::Box { lower, upper } => self.bounded(first, lower, upper),
            Set::Polyhedron { A, b, C, d } => {
                let all = self.loads[B].len;
                self.polyhedron(first, [A, C], b, held)?;
                self.loads[B].len = all + b.len();
                self.loads[D].len += d.len();
            }
            Set::Ball { centre, radius } => {
                self.ball(first, centre, *radius);
                self.loads[CENTRE].len += centre.len();
                self.loads[RADIUS].len += 1;
            }
            Set::SecondOrderCone { dimension } => self.cone(first, *dimension),
            Set::Product(_) => {}
        }
        Ok(())
    }

    fn bounded(&mut self, first: usize, lower: &[f64], upper: &[f64]) {
        for (j, (&l, &u)) in lower.iter().zip(upper).enumerate() {
            let p = self.held.from[first + j];
            let at_border = (p - l).abs().min((p - u).abs()) <= self.near;
            self.degenerate += usize::from(at_border);
            if p <= l {
                self.columns[first + j] = Column::Lower(self.bounds + j);
            } else if p >= u {
                self.columns[first + j] = Column::Upper(self.bounds + j);
            } else {
                self.free(first + j..first + j + 1);
            }
        }
        self.bounds += lower.len();
    }

    #[allow(non_snake_case)]
    fn polyhedron(
        &mut self,
        first: usize,
        [A, C]: [&Csc; 2],
        b: &[f64],
        held: &[usize],
    ) -> Result<(), DerivativeError> {
        let (m, k, size) = (A.nrows(), C.nrows(), A.ncols());
        let f = &self.f[first..first + size];
        let lambda = multipliers([A, C], held, f)?;
        let (mut slack, mut squares) = (b.to_vec(), vec![0.0; m]);
        for (i, j, a) in A.triplets() {
            slack[i] -= a * self.point[first + j];
            squares[i] += a * a;
        }
        self.free(first..first + size);
        let at = self.columns.len();
        let [of_b, of_d] = [self.loads[B].len, self.loads[D].len];
        for i in 0..m + k {
            let holds = held.binary_search(&i).is_ok();
            self.multiplier(lambda[i], holds);
            let row = self.n + at + i;
            if i >= m {
                self.degenerate += usize::from(!holds);
                self.loads[D].entries.push((row, of_d + i - m, -1.0));
                continue;
            }
            self.loads[B].entries.push((row, of_b + i, -1.0));
            let norm = squares[i].sqrt();
            let force = self.held.gamma * lambda[i] * norm;
            let on = norm > 0.0 && slack[i] <= self.near * norm;
            self.degenerate += usize::from(on && force <= self.near);
        }
        for (letter, matrix, at) in [("A", A, at), ("C", C, at + m)] {
            if self.alone {
                self.matrices.add(letter, matrix, [self.n + at, first], 1.0);
                self.matrices.add_transposed(letter, matrix, [self.n + first, at]);
            } else {
                for (i, j, a) in matrix.triplets() {
                    self.gradient(at + i, first + j, a, 1.0);
                }
            }
        }
        Ok(())
    }

    fn ball(&mut self, first: usize, centre: &[f64], radius: f64) {
        let p = &self.held.from[first..first + centre.len()];
        let outside = norm(p.iter().zip(centre).map(|(p, c)| p - c)) - radius;
        let away: Vec<f64> =
            centre.iter().enumerate().map(|(j, c)| self.point[first + j] - c).collect();
        let of = self.loads[CENTRE].len;
        self.degenerate += usize::from(outside.abs() <= self.near || radius == 0.0);
        self.free(first..first + centre.len());
        if radius == 0.0 {
            // x is the centre.
            for j in 0..centre.len() {
                self.rows[first + j] = false;
                self.entry(self.n + first + j, first + j, 1.0);
                self.loads[CENTRE].entries.push((self.n + first + j, of + j, -1.0));
            }
            return;
        }
        let on = outside > 0.0;
        let power: f64 = away.iter().zip(&self.f[first..]).map(|(e, f)| e * f).sum();
        let lambda = if on { -power / (radius * radius) } else { 0.0 };
        let multiplier = self.multiplier(lambda, on);
        let row = self.n + multiplier;
        for (j, &e) in away.iter().enumerate() {
            self.entry(self.n + first + j, first + j, lambda);
            self.gradient(multiplier, first + j, e, 1.0);
            let entries = &mut self.loads[CENTRE].entries;
            entries.push((self.n + first + j, of + j, -lambda));
            entries.push((row, of + j, -e));
        }
        let ball = self.loads[RADIUS].len;
        self.loads[RADIUS].entries.push((row, ball, -radius));
    }

    fn cone(&mut self, first: usize, dimension: usize) {
        let all = first..first + dimension;
        let p = &self.held.from[all.clone()];
        let rest = norm(p[1..].iter().copied());
        // The spectral values, of which x has the positive parts.
        let (least, most) = (p[0] - rest, p[0] + rest);
        let at_border = least.abs().min(most.abs()) <= self.near;
        self.degenerate += usize::from(at_border);
        if most <= self.near {
            // At the point, where its columns are fixed as they are.
            return;
        }
        let on = least < 0.0;
        // The projection, which is on the border exactly: what x misses it by would count as much as the multiplier is large, near the tip.
        let x: Vec<f64> = match on {
            true => (0..dimension)
                .map(|j| 0.5 * most * if j == 0 { 1.0 } else { p[j] / rest })
                .collect(),
            false => self.point[all.clone()].to_vec(),
        };
        let square: f64 = x.iter().map(|x| x * x).sum();
        let signed = |j: usize, x: f64| if j == 0 { x } else { -x };
        let power: f64 =
            x.iter().zip(&self.f[first..]).enumerate().map(|(j, (x, f))| signed(j, x * f)).sum();
        let lambda = if on { power / square } else { 0.0 };
        self.free(all);
        if !on {
            return;
        }
        let multiplier = self.multiplier(lambda, true);
        for (j, &x) in x.iter().enumerate() {
            self.entry(self.n + first + j, first + j, signed(j, -lambda));
            self.gradient(multiplier, first + j, signed(j, x), -1.0);
        }
    }

    fn made(mut self, jacobian: &Csc) -> Result<Pieces, ProblemError> {
        let n = self.n;
        for (i, j, x) in jacobian.triplets() {
            self.entry(i, j, x);
            if self.rows[i] {
                self.entry(n + i, j, x);
            }
        }
        let mut columns = Columns::default();
        for column in &self.columns {
            match *column {
                Column::Free(_) => columns.free(1),
                fixed => columns.fixed(fixed),
            }
        }
        let mut statement = Statement { bounds: self.bounds, ..Statement::default() };
        let free: Vec<_> = (0..n).filter(|&j| self.rows[j]).collect();
        let of_f = (0..n).map(|j| (j, j, 1.0)).chain(free.into_iter().map(|j| (n + j, j, 1.0)));
        statement.loads.push(Load { letter: "F", len: n, entries: of_f.collect() });
        statement.loads.extend(self.loads.into_iter().filter(|load| load.len > 0));
        statement.part("x", Side::X, 0..n);
        statement.part("F", Side::Y, 0..n);
        let all = self.columns.len();
        let matrix = self.matrices.made(&mut statement, n + all, all)?;
        // An empty matrix is no data.
        statement.blocks.retain(|block| block.shape[0] > 0);
        let (point, pieces, degenerate) = (self.point, self.pieces, self.degenerate);
        Ok(Pieces { statement, matrix, point, columns, pieces, degenerate })
    }
}

fn norm(x: impl Iterator<Item = f64>) -> f64 {
    x.fold(0.0, f64::hypot)
}

/// λ of the rows of `[A; C]` that hold x, `min ‖Aᵀλ + Cᵀν + F‖`, zero of the others.
///
/// Source: `[I, Gᵀ; G, 0] (z, λ) = (−F, 0)` with rows G of norm 1, whose z is the residual. Cost: a sparse factorisation.
fn multipliers(
    matrices: [&Csc; 2],
    held: &[usize],
    f: &[f64],
) -> Result<Vec<f64>, DerivativeError> {
    let (n, m) = (f.len(), matrices[0].nrows());
    let mut out = vec![0.0; m + matrices[1].nrows()];
    if held.is_empty() {
        return Ok(out);
    }
    let mut place = vec![usize::MAX; out.len()];
    held.iter().enumerate().for_each(|(k, &row)| place[row] = k);
    let (mut rows, mut squares) = (vec![], vec![0.0; held.len()]);
    for (matrix, first) in matrices.into_iter().zip([0, m]) {
        for (i, j, a) in matrix.triplets().filter(|(i, ..)| place[first + i] < usize::MAX) {
            rows.push((place[first + i], j, a));
            squares[place[first + i]] += a * a;
        }
    }
    let norms: Vec<f64> = squares.into_iter().map(f64::sqrt).collect();
    let all = n + held.len();
    let entries = (0..n).map(|j| (j, j, 1.0)).chain(rows.iter().flat_map(|&(k, j, a)| {
        let a = a / norms[k];
        [(n + k, j, a), (j, n + k, a)]
    }));
    let system = Csc::from_triplets(all, all, entries).map_err(ProblemError::from)?;
    let mut lu = SquareLu::default();
    super::equations::admitted(|| lu.factorise(&Matrix::from(system)))?;
    let mut x: Vec<f64> = f.iter().map(|f| -f).collect();
    x.resize(all, 0.0);
    lu.solve(&mut x);
    for (k, &row) in held.iter().enumerate() {
        out[row] = x[n + k] / norms[k];
    }
    Ok(out)
}

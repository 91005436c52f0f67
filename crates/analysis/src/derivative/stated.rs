//! How each kind of problem states the equations of its solution.

use std::ops::Range;

use nonsmooth_linalg::{Csc, Matrix, budget};
use nonsmooth_problem::check::{ContactStatus, Judged, Motion, RowCounts, RowStatus, VerdictOf};
use nonsmooth_problem::field::{Evaluator, Field, Pattern, tentatively};
use nonsmooth_problem::{
    Bounds, BoxLcp, FrictionGlobal, FrictionLocal, GlobalPoint, Hlcp, HlcpPoint, Lcp, LcpPoint,
    LocalPoint, Mcp, Mlcp, ProblemError,
};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::DerivativeError;
use super::equations::{Column, Columns, Equation, LOWER, UPPER};

/// The letter of the coefficients of friction.
pub(super) const MU: &str = "mu";

/// Of what a part of the solution is a part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Side {
    X,
    Y,
}

/// A part of the solution.
#[derive(Debug, Clone)]
pub(super) struct Part {
    pub(super) name: &'static str,
    pub(super) side: Side,
    pub(super) range: Range<usize>,
}

/// A matrix of the data in S.
#[derive(Debug, Clone)]
pub(super) struct Block {
    pub(super) letter: &'static str,
    /// Rows and columns of the matrix.
    pub(super) shape: [usize; 2],
    /// Where its first entry stands.
    at: [usize; 2],
    pub(super) transposed: bool,
    pub(super) sign: f64,
}

impl Block {
    /// Its rows in S.
    pub(super) fn rows(&self) -> Range<usize> {
        let [m, n] = self.shape;
        self.at[0]..self.at[0] + if self.transposed { n } else { m }
    }

    /// Its columns in S.
    pub(super) fn columns(&self) -> Range<usize> {
        let [m, n] = self.shape;
        self.at[1]..self.at[1] + if self.transposed { m } else { n }
    }
}

/// A vector of the data in p: entries (row, k, factor) of the matrix that takes it there.
#[derive(Debug, Clone)]
pub(super) struct Load {
    pub(super) letter: &'static str,
    pub(super) len: usize,
    pub(super) entries: Vec<(usize, usize, f64)>,
}

/// Where the data stand in S and p, and the parts of the solution in x and y.
#[derive(Debug, Clone, Default)]
pub(super) struct Statement {
    pub(super) blocks: Vec<Block>,
    pub(super) loads: Vec<Load>,
    pub(super) contacts: usize,
    /// The variables that have bounds.
    pub(super) bounds: usize,
    pub(super) parts: Vec<Part>,
}

impl Statement {
    /// The vectors of the data by letter, with a range as long as they are.
    pub(super) fn vectors(&self) -> impl Iterator<Item = (&'static str, Range<usize>)> + '_ {
        let few = |letters: &'static [&'static str], n: usize| {
            letters.iter().filter(move |_| n > 0).map(move |letter| (*letter, 0..n))
        };
        let loads = self.loads.iter().map(|load| (load.letter, 0..load.len));
        loads.chain(few(&[MU], self.contacts)).chain(few(&[LOWER, UPPER], self.bounds))
    }

    fn load(&mut self, letter: &'static str, range: Range<usize>, sign: f64) {
        let entries = range.clone().enumerate().map(|(k, row)| (row, k, sign)).collect();
        self.loads.push(Load { letter, len: range.len(), entries });
    }

    pub(super) fn part(&mut self, name: &'static str, side: Side, range: Range<usize>) {
        if !range.is_empty() {
            self.parts.push(Part { name, side, range });
        }
    }
}

/// A solution with the equations of its pieces.
pub(super) struct Pieces {
    pub(super) statement: Statement,
    pub(super) matrix: Csc,
    pub(super) point: Vec<f64>,
    pub(super) columns: Columns,
    pub(super) pieces: Vec<Equation>,
    pub(super) degenerate: usize,
}

/// S in the making.
#[derive(Default)]
pub(super) struct Matrices {
    blocks: Vec<Block>,
    pub(super) entries: Vec<(usize, usize, f64)>,
}

impl Matrices {
    pub(super) fn add(&mut self, letter: &'static str, matrix: &Csc, at: [usize; 2], sign: f64) {
        let entries = matrix.triplets();
        self.entries.extend(entries.map(|(i, j, x)| (at[0] + i, at[1] + j, sign * x)));
        let shape = [matrix.nrows(), matrix.ncols()];
        self.blocks.push(Block { letter, shape, at, transposed: false, sign });
    }

    pub(super) fn add_transposed(&mut self, letter: &'static str, matrix: &Csc, at: [usize; 2]) {
        let entries = matrix.triplets();
        self.entries.extend(entries.map(|(i, j, x)| (at[0] + j, at[1] + i, x)));
        let shape = [matrix.nrows(), matrix.ncols()];
        self.blocks.push(Block { letter, shape, at, transposed: true, sign: 1.0 });
    }

    pub(super) fn made(
        self,
        statement: &mut Statement,
        m: usize,
        n: usize,
    ) -> Result<Csc, ProblemError> {
        statement.blocks = self.blocks;
        Ok(Csc::from_triplets(m, n, self.entries.into_iter())?)
    }
}

/// The verdict on a point that is a solution.
pub(super) fn solved<P: Judged>(
    problem: &P,
    point: &P::Point,
    tolerance: f64,
) -> Result<VerdictOf<P>, DerivativeError> {
    let verdict = problem.judge(point, tolerance)?;
    let found = verdict.measure.relative;
    if !verdict.solved && budget::over() {
        return Err(DerivativeError::Interrupted);
    }
    if verdict.solved { Ok(verdict) } else { Err(DerivativeError::NotSolved { tolerance, found }) }
}

fn entries(name: &str, matrix: &Matrix) -> Result<Csc, ProblemError> {
    matrix.to_csc().ok_or_else(|| ProblemError::Shape {
        place: name.into(),
        expected: "a matrix with entries".into(),
        found: "one that is known by its products".into(),
    })
}

/// `w = M z + q`.
fn in_z(matrix: &Matrix) -> Result<(Statement, Csc), ProblemError> {
    let (mut statement, mut matrices) = (Statement::default(), Matrices::default());
    let (m, n) = (matrix.nrows(), matrix.ncols());
    matrices.add("M", &entries("M", matrix)?, [0, 0], 1.0);
    statement.load("q", 0..m, 1.0);
    let s = matrices.made(&mut statement, m, n)?;
    Ok((statement, s))
}

/// A variable and its row, each of this number: at a bound, or the row vanishes. Without bounds among the data the lower one is zero.
fn pairs(statuses: &[RowStatus], bounded: bool) -> (Columns, Vec<Equation>) {
    let (mut columns, mut pieces) = (Columns::default(), vec![]);
    for (i, status) in statuses.iter().enumerate() {
        match status {
            RowStatus::Lower if !bounded => columns.fixed(Column::Zero),
            RowStatus::Lower => columns.fixed(Column::Lower(i)),
            RowStatus::Upper => columns.fixed(Column::Upper(i)),
            RowStatus::Inside | RowStatus::Equality => {
                columns.free(1);
                pieces.push(Equation::zero(i));
            }
        }
    }
    (columns, pieces)
}

/// The pairs at the border of two pieces; of equal bounds these are that of the one and that of the other.
fn at_border(counts: &RowCounts) -> usize {
    counts.degenerate + counts.fixed
}

pub(super) fn lcp(
    problem: &Lcp,
    point: &LcpPoint,
    tolerance: f64,
) -> Result<Pieces, DerivativeError> {
    Ok(in_pairs(&problem.M, false, &solved(problem, point, tolerance)?, point)?)
}

pub(super) fn boxed(
    problem: &BoxLcp,
    point: &LcpPoint,
    tolerance: f64,
) -> Result<Pieces, DerivativeError> {
    Ok(in_pairs(&problem.M, true, &solved(problem, point, tolerance)?, point)?)
}

/// Of a problem in z and `w = M z + q` alone, with its bounds among the data or without.
fn in_pairs(
    matrix: &Matrix,
    bounded: bool,
    verdict: &VerdictOf<BoxLcp>,
    point: &LcpPoint,
) -> Result<Pieces, ProblemError> {
    let n = point.z.len();
    let (mut statement, matrix) = in_z(matrix)?;
    statement.bounds = if bounded { n } else { 0 };
    statement.part("z", Side::X, 0..n);
    statement.part("w", Side::Y, 0..n);
    let (columns, pieces) = pairs(&verdict.statuses, bounded);
    let (point, degenerate) = (point.z.clone(), at_border(&verdict.counts));
    Ok(Pieces { statement, matrix, point, columns, pieces, degenerate })
}

pub(super) fn mlcp(
    problem: &Mlcp,
    point: &LcpPoint,
    tolerance: f64,
) -> Result<Pieces, DerivativeError> {
    let verdict = solved(problem, point, tolerance)?;
    let (e, free, n) = (problem.equalities, problem.free, point.z.len());
    let (mut statement, matrix) = in_z(&problem.M)?;
    statement.part("u", Side::X, 0..free);
    statement.part("v", Side::X, free..n);
    statement.part("w", Side::Y, e..problem.q.len());
    let mut columns = Columns::default();
    columns.free(free);
    let mut pieces: Vec<_> = (0..e).map(Equation::zero).collect();
    for (i, status) in verdict.statuses.iter().enumerate().skip(e) {
        match status {
            RowStatus::Lower => columns.fixed(Column::Zero),
            _ => {
                columns.free(1);
                pieces.push(Equation::zero(i));
            }
        }
    }
    let (point, degenerate) = (point.z.clone(), verdict.counts.degenerate);
    Ok(Pieces { statement, matrix, point, columns, pieces, degenerate })
}

pub(super) fn hlcp(
    problem: &Hlcp,
    point: &HlcpPoint,
    tolerance: f64,
) -> Result<Pieces, DerivativeError> {
    let verdict = solved(problem, point, tolerance)?;
    let n = problem.dim();
    let (mut statement, mut matrices) = (Statement::default(), Matrices::default());
    matrices.add("Q", &entries("Q", &problem.Q)?, [0, 0], 1.0);
    matrices.add("R", &entries("R", &problem.R)?, [0, n], 1.0);
    statement.load("q", 0..n, -1.0);
    statement.part("x", Side::X, 0..n);
    statement.part("s", Side::X, n..2 * n);
    let matrix = matrices.made(&mut statement, n, 2 * n)?;
    // The statuses of the pairs follow those of the rows.
    let is_zero: Vec<_> = verdict.statuses[n..].iter().map(|s| *s == RowStatus::Lower).collect();
    let mut columns = Columns::default();
    for fixed in is_zero.iter().copied().chain(is_zero.iter().map(|zero| !zero)) {
        match fixed {
            true => columns.fixed(Column::Zero),
            false => columns.free(1),
        }
    }
    let pieces = (0..n).map(Equation::zero).collect();
    let point = [&point.x[..], &point.s].concat();
    let degenerate = verdict.counts.degenerate;
    Ok(Pieces { statement, matrix, point, columns, pieces, degenerate })
}

pub(super) fn mcp(
    problem: &Mcp,
    point: &LcpPoint,
    tolerance: f64,
) -> Result<Pieces, DerivativeError> {
    let verdict = solved(problem, point, tolerance)?;
    let n = problem.dim();
    let (_, matrix) = jacobian(&*problem.F, &point.z)?;
    let mut statement = Statement { bounds: n, ..Statement::default() };
    statement.load("F", 0..n, 1.0);
    statement.part("x", Side::X, 0..n);
    statement.part("F", Side::Y, 0..n);
    let (columns, pieces) = pairs(&verdict.statuses, true);
    let (point, degenerate) = (point.z.clone(), at_border(&verdict.counts));
    Ok(Pieces { statement, matrix, point, columns, pieces, degenerate })
}

/// F(x) and JF(x).
pub(super) fn jacobian(field: &dyn Field, x: &[f64]) -> Result<(Vec<f64>, Csc), DerivativeError> {
    let (n, pattern) = (field.dim(), field.pattern());
    let (mut f, mut values) = (vec![0.0; n], vec![0.0; pattern.len()]);
    let mut run = field.evaluator();
    let defined = run.jacobian(x, &mut f, &mut values);
    if !defined || values.iter().any(|a| !a.is_finite()) {
        return Err(DerivativeError::Undefined);
    }
    if field.expressions().is_none() {
        covers(&mut *run, pattern, x, &f)?;
    }
    let entries = pattern.places().zip(&values).map(|((i, j), &a)| (i, j, a));
    let jacobian = Csc::from_triplets(n, n, entries).map_err(ProblemError::from)?;
    Ok((f, jacobian))
}

/// Changes of variables, in parts of their size, that rows do not feel whose pattern has none of them: but for this part of the largest row.
const CHANGE: f64 = 1.0 / 65536.0;
const UNFELT: f64 = 1e-9;
/// At most so many sets of variables are changed; up to as many variables each by itself.
const SETS: usize = 64;

/// A pattern that was found elsewhere, or stated, may lack a variable that a row depends on here; what differences make of the row is then wrong. Sets of variables are changed, to both sides: rows whose pattern has none
/// of them stay as they are. Beyond [`SETS`] variables the sets are of no order, and such that about a third of the rows have none.
///
/// Cost: at most 2 [`SETS`] values of F, none of a dense pattern.
fn covers(
    run: &mut dyn Evaluator,
    pattern: &Pattern,
    x: &[f64],
    f: &[f64],
) -> Result<(), DerivativeError> {
    let n = x.len();
    let widest = (0..n).map(|i| pattern.row(i).len()).max().unwrap_or(0);
    if (0..n).all(|i| pattern.row(i).len() == n) {
        return Ok(());
    }
    let mean = x.iter().map(|x| x.abs()).sum::<f64>() / n as f64;
    let unit = |j: usize| match (x[j].abs(), mean) {
        (own, _) if own > 0.0 => own,
        (_, mean) if mean > 0.0 => mean,
        _ => 1.0,
    };
    let mut lot = Pcg64::seed_from_u64(1);
    let share = 1.0 / (widest as f64 + 1.0);
    let (mut y, mut there, mut among) = (x.to_vec(), vec![0.0; n], vec![false; n]);
    for set in 0..n.min(SETS) {
        for (j, among) in among.iter_mut().enumerate() {
            *among = if n <= SETS { j == set } else { lot.random_bool(share) };
        }
        for sign in [1.0, -1.0] {
            if budget::over() {
                return Err(DerivativeError::Interrupted);
            }
            for (j, (y, x)) in y.iter_mut().zip(x).enumerate() {
                *y = if among[j] { x + sign * CHANGE * unit(j) } else { *x };
            }
            if !tentatively(|| run.value(&y, &mut there)) {
                continue;
            }
            let sizes = f.iter().chain(&there).map(|f| f.abs()).filter(|f| f.is_finite());
            let largest = sizes.fold(0.0, f64::max);
            let changed = |i: &usize| (there[*i] - f[*i]).abs() > UNFELT * largest;
            let feels = |i: &usize| pattern.row(*i).iter().any(|&j| among[j]);
            if let Some(row) = (0..n).filter(changed).find(|i| !feels(i)) {
                return Err(DerivativeError::Uncovered { row });
            }
        }
    }
    Ok(())
}

/// Contacts with their places in x and y, both from `first` on.
struct Contacts<'a, const D: usize> {
    mu: &'a [f64],
    statuses: &'a [ContactStatus],
    r: &'a [f64],
    u: &'a [f64],
    first: usize,
}

impl<const D: usize> Contacts<'_, D> {
    /// Their equations; how many are at a border.
    fn state(&self, columns: &mut Columns, pieces: &mut Vec<Equation>) -> usize {
        for (k, status) in self.statuses.iter().enumerate() {
            let at = self.first + k * D;
            match status.status {
                Motion::Open => (0..D).for_each(|_| columns.fixed(Column::Zero)),
                Motion::Stick => {
                    columns.free(D);
                    pieces.extend((at..at + D).map(Equation::zero));
                }
                Motion::Slip => {
                    columns.free(D);
                    pieces.push(Equation::zero(at));
                    pieces.extend((1..D).map(|i| self.sliding(k, i)));
                }
            }
        }
        self.statuses.iter().filter(|s| s.degenerate || s.at_limit).count()
    }

    /// `r_T + mu r_N t = 0`, component i, of contact k.
    fn sliding(&self, k: usize, i: usize) -> Equation {
        let (u, at) = (&self.u[k * D..k * D + D], self.first + k * D);
        let (mu, normal) = (self.mu[k], self.r[k * D]);
        let size = u[1..].iter().fold(0.0_f64, |size, x| size.hypot(*x));
        // A frictionless contact may slide at no speed.
        let t = |j: usize| if size > 0.0 { u[j] / size } else { 0.0 };
        let mut equation = Equation {
            x: at,
            y: at,
            width: D,
            a: [0.0; 3],
            b: [0.0; 3],
            c: normal * t(i),
            contact: k,
        };
        equation.a[0] = mu * t(i);
        equation.a[i] = 1.0;
        for j in (1..D).filter(|_| size > 0.0) {
            let same = if i == j { 1.0 } else { 0.0 };
            equation.b[j] = mu * normal * ((same - t(i) * t(j)) / size);
        }
        equation
    }
}

/// Scalar rows with their places in x and y, both from `first` on.
struct Rows<'a> {
    bounds: &'a Bounds,
    lambda: &'a [f64],
    /// c, and the size of its terms.
    velocity: Vec<f64>,
    sizes: Vec<f64>,
    first: usize,
}

impl Rows<'_> {
    /// Their equations, with the velocity `w(j)` that a unit impulse makes of row j; how many are zero on both sides at the tolerance.
    fn state(
        &self,
        w: impl Fn(usize) -> f64,
        tolerance: f64,
        columns: &mut Columns,
        pieces: &mut Vec<Equation>,
    ) -> usize {
        let mut degenerate = 0;
        for (j, (&lambda, &c)) in self.lambda.iter().zip(&self.velocity).enumerate() {
            let ([l, u], w) = (self.bounds.of(j), w(j));
            // The piece of the projection of λ − c/w.
            let target = lambda - c / w;
            if target <= l {
                columns.fixed(Column::Lower(j));
            } else if target >= u {
                columns.fixed(Column::Upper(j));
            } else {
                columns.free(1);
                pieces.push(Equation::zero(self.first + j));
            }
            let margin = tolerance * (self.sizes[j] + (w * lambda).abs());
            let nearest = w * (lambda - l).abs().min((u - lambda).abs());
            degenerate += usize::from(c.abs() <= margin && nearest <= margin);
        }
        degenerate
    }
}

/// The modulus of what a unit impulse makes of a row; 1 where nothing does.
fn positive(w: f64) -> f64 {
    if w.abs() > 0.0 { w.abs() } else { 1.0 }
}

/// `y ← y + A x`, and the moduli of the terms.
fn add(a: &Csc, x: &[f64], y: &mut [f64], sizes: &mut [f64]) {
    for (i, j, a) in a.triplets() {
        y[i] += a * x[j];
        sizes[i] += (a * x[j]).abs();
    }
}

/// `y ← y + Aᵀ x`, and the moduli of the terms.
fn add_transposed(a: &Csc, x: &[f64], y: &mut [f64], sizes: &mut [f64]) {
    for (i, j, a) in a.triplets() {
        y[j] += a * x[i];
        sizes[j] += (a * x[i]).abs();
    }
}

pub(super) fn local<const D: usize>(
    problem: &FrictionLocal<D>,
    point: &LocalPoint,
    tolerance: f64,
) -> Result<Pieces, DerivativeError>
where
    FrictionLocal<D>: Judged<Point = LocalPoint, Status = ContactStatus>,
{
    let verdict = solved(problem, point, tolerance)?;
    let (m, p) = (point.r.len(), point.lambda.len());
    let (mut statement, mut matrices) = (Statement::default(), Matrices::default());
    if m > 0 {
        matrices.add("W", &problem.W.to_csc(), [0, 0], 1.0);
        statement.load("q", 0..m, 1.0);
        statement.contacts = problem.contacts();
    }
    let (mut columns, mut pieces) = (Columns::default(), vec![]);
    let contacts = Contacts::<D> {
        mu: &problem.mu,
        statuses: &verdict.statuses,
        r: &point.r,
        u: &verdict.velocity,
        first: 0,
    };
    let mut degenerate = contacts.state(&mut columns, &mut pieces);
    if let Some(rows) = &problem.rows {
        matrices.add("V", &rows.V, [0, m], 1.0);
        matrices.add_transposed("V", &rows.V, [m, 0]);
        matrices.add("R", &rows.R, [m, m], 1.0);
        statement.load("s", m..m + p, 1.0);
        statement.bounds = rows.bounds.lower.len();
        let mut velocity = rows.s.clone();
        let mut sizes: Vec<f64> = velocity.iter().map(|s| s.abs()).collect();
        add_transposed(&rows.V, &point.r, &mut velocity, &mut sizes);
        add(&rows.R, &point.lambda, &mut velocity, &mut sizes);
        let (bounds, lambda) = (&rows.bounds, &point.lambda);
        let of = Rows { bounds, lambda, velocity, sizes, first: m };
        let w = |j: usize| positive(rows.R.get(j, j));
        degenerate += of.state(w, tolerance, &mut columns, &mut pieces);
    }
    statement.part("r", Side::X, 0..m);
    statement.part("u", Side::Y, 0..m);
    statement.part("l", Side::X, m..m + p);
    statement.part("c", Side::Y, m..m + p);
    let matrix = matrices.made(&mut statement, m + p, m + p)?;
    let point = [&point.r[..], &point.lambda].concat();
    Ok(Pieces { statement, matrix, point, columns, pieces, degenerate })
}

pub(super) fn global<const D: usize>(
    problem: &FrictionGlobal<D>,
    point: &GlobalPoint,
    tolerance: f64,
) -> Result<Pieces, DerivativeError>
where
    FrictionGlobal<D>: Judged<Point = GlobalPoint, Status = ContactStatus>,
{
    let verdict = solved(problem, point, tolerance)?;
    let (n, m, p) = (point.v.len(), point.r.len(), point.lambda.len());
    let (mut statement, mut matrices) = (Statement::default(), Matrices::default());
    matrices.add("M", &problem.M, [0, 0], 1.0);
    statement.load("f", 0..n, -1.0);
    if m > 0 {
        matrices.add("H", &problem.H, [0, n], -1.0);
        matrices.add_transposed("H", &problem.H, [n, 0]);
        statement.load("w", n..n + m, 1.0);
        statement.contacts = problem.contacts();
    }
    let mut columns = Columns::default();
    columns.free(n);
    let mut pieces: Vec<_> = (0..n).map(Equation::zero).collect();
    let contacts = Contacts::<D> {
        mu: &problem.mu,
        statuses: &verdict.statuses,
        r: &point.r,
        u: &verdict.velocity,
        first: n,
    };
    let mut degenerate = contacts.state(&mut columns, &mut pieces);
    if let Some(rows) = &problem.rows {
        matrices.add("G", &rows.G, [0, n + m], -1.0);
        matrices.add_transposed("G", &rows.G, [n + m, 0]);
        statement.load("b", n + m..n + m + p, 1.0);
        statement.bounds = rows.bounds.lower.len();
        let mut velocity = rows.b.clone();
        let mut sizes: Vec<f64> = velocity.iter().map(|b| b.abs()).collect();
        add_transposed(&rows.G, &point.v, &mut velocity, &mut sizes);
        let (bounds, lambda) = (&rows.bounds, &point.lambda);
        let of = Rows { bounds, lambda, velocity, sizes, first: n + m };
        // gᵀ g by the diagonal of M: its size is enough.
        let w = |j: usize| {
            let (at, values) = rows.G.column(j);
            positive(
                at.iter().zip(values).map(|(&i, g)| g * g / positive(problem.M.get(i, i))).sum(),
            )
        };
        degenerate += of.state(w, tolerance, &mut columns, &mut pieces);
    }
    statement.part("v", Side::X, 0..n);
    statement.part("r", Side::X, n..n + m);
    statement.part("u", Side::Y, n..n + m);
    statement.part("l", Side::X, n + m..n + m + p);
    statement.part("c", Side::Y, n + m..n + m + p);
    let matrix = matrices.made(&mut statement, n + m + p, n + m + p)?;
    let point = [&point.v[..], &point.r, &point.lambda].concat();
    Ok(Pieces { statement, matrix, point, columns, pieces, degenerate })
}

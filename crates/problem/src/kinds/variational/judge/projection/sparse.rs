//! The projection on polyhedra of many rows with few entries each, by Newton's method on the dual.
//!
//! ```text
//! s(w) = clip(Gᵀ w, l, u)                                   y = p + s,  rows of one entry are bounds
//! r(w) = h + z(w) − G s(w),  z_i(w) = max(0, z̄_i − σ w_i)   of inequalities, 0 of equations
//! (G_F G_Fᵀ + σ I_Z + ε I) Δ = r − ε (w − w̄)               F: the s between their bounds, Z: the z > 0
//! ```
//!
//! The right side of the last line is the gradient of a strictly concave function, quadratic on each piece, along which the step is searched; z̄ and w̄ follow z and w (the proximal method of multipliers, which
//! dependent rows do not disturb) until r = 0, and w = 0 where z > 0. What is returned satisfies the conditions of the projection: s is of that form by construction, so that only `r = 0`, and `w_i ≥ 0` with
//! `w_i z_i = 0`, are asked, up to what rounding makes of their terms.
//! Source: Rockafellar1976. Cost: a sparse Cholesky factorisation a step, of the order of the rows that are no bounds.

use nonsmooth_linalg::{Csc, Matrix, SquareCholesky, budget, uncounted};

use super::{Found, Rows};

/// Steps before another method is asked.
const STEPS: usize = 300;
/// ε, in units of the rows' squares, which are 1.
const SHIFT: f64 = 1e-6;
/// A problem beside z̄ and w̄ is solved where so much is left of r.
const INNER: f64 = 0.1;
/// σ, in units of the rows' squares, which are 1.
const SLACK: f64 = 1e3;
/// An inequality is no farther from p, in units of what p violates; one that would hold nearer than that is not known.
const FARTHEST: f64 = 1e6;
/// What is not much more than rounding, where no step makes it less.
const NEARLY: f64 = 64.0;
/// Steps that make nothing less.
const IDLE: usize = 4;
/// Moves to the rows at the end.
const REFINED: usize = 3;
/// Products of entries of one column, which make the matrix.
const PRODUCTS: usize = 2_000_000;
/// A factorisation of that order may be dense.
const SMALL: usize = 1000;

/// The rows with several entries, inequalities first, and what Newton's method needs.
pub(super) struct Sparse {
    /// Of norm 1, with their names.
    names: Vec<usize>,
    inequalities: usize,
    /// Names from here on are equations.
    first_equation: usize,
    starts: Vec<usize>,
    columns: Vec<usize>,
    values: Vec<f64>,
    /// Rows with one entry: name, variable, whether it is 1 (else −1), whether it is an equation.
    bounds: Vec<(usize, usize, bool, bool)>,
    /// Rows without entries.
    empty: Vec<usize>,
    /// `G_F G_Fᵀ + …`, its lower triangle, where the diagonal is in it, and by variables the products that are summed up to it.
    matrix: Matrix,
    diagonal: Vec<usize>,
    product_starts: Vec<usize>,
    products: Vec<(usize, f64)>,
    factor: SquareCholesky,
    /// Of the last projection.
    w: Vec<f64>,
    work: Work,
}

#[derive(Default)]
struct Work {
    lower: Vec<f64>,
    upper: Vec<f64>,
    /// The same less p.
    low: Vec<f64>,
    high: Vec<f64>,
    h: Vec<f64>,
    noise: Vec<f64>,
    centre: Vec<f64>,
    s: Vec<f64>,
    /// `Gᵀ w`, and the sizes of its terms.
    along: Vec<f64>,
    moduli: Vec<f64>,
    z: Vec<f64>,
    r: Vec<f64>,
    step: Vec<f64>,
    /// `Gᵀ Δ`.
    slope: Vec<f64>,
    best: Vec<f64>,
    /// w̄, and `r − ε (w − w̄)`.
    anchor: Vec<f64>,
    inner: Vec<f64>,
}

impl Sparse {
    /// `None` where the matrix would not be sparse.
    pub(super) fn new(rows: &Rows) -> Option<Self> {
        let (mut names, mut starts, mut columns, mut values) = (vec![], vec![0], vec![], vec![]);
        let (mut bounds, mut empty, mut inequalities) = (vec![], vec![], 0);
        for k in 0..rows.len() {
            let is_equation = k >= rows.inequalities;
            match rows.row(k) {
                ([], _) => empty.push(k),
                (&[j], g) => bounds.push((k, j, g[0] > 0.0, is_equation)),
                (of, g) => {
                    names.push(k);
                    inequalities += usize::from(!is_equation);
                    columns.extend_from_slice(of);
                    values.extend_from_slice(g);
                    starts.push(columns.len());
                }
            }
        }
        let (n, m) = (rows.variables, names.len());
        let range = |i: usize| starts[i]..starts[i + 1];
        let mut by_column: Vec<Vec<(usize, f64)>> = vec![vec![]; n];
        for i in 0..m {
            range(i).for_each(|at| by_column[columns[at]].push((i, values[at])));
        }
        let pairs = by_column.iter().map(|c| c.len() * (c.len() + 1) / 2).sum::<usize>();
        if pairs > PRODUCTS {
            return None;
        }
        let lower = |column: &[(usize, f64)]| {
            let of = column.to_vec();
            (0..of.len()).flat_map(move |a| (0..=a).map(move |b| (a, b))).map(move |(a, b)| {
                // The rows of a column ascend.
                (of[a].0, of[b].0, of[a].1 * of[b].1)
            })
        };
        let entries: Vec<_> = by_column.iter().flat_map(|c| lower(c)).collect();
        let diagonal = (0..m).map(|i| (i, i, 0.0));
        let all = entries.iter().copied().chain(diagonal);
        let matrix = Csc::from_triplets(m, m, all).ok()?;
        if m > SMALL && matrix.nnz() > m * m / 8 {
            return None;
        }
        let (of_columns, of_rows) = (matrix.col_ptr(), matrix.row_idx());
        let place = |i: usize, j: usize| {
            let column = of_columns[j]..of_columns[j + 1];
            column.start + of_rows[column].partition_point(|&row| row < i)
        };
        let products = entries.iter().map(|&(i, j, x)| (place(i, j), x)).collect();
        let mut product_starts = vec![0];
        for column in &by_column {
            product_starts.push(
                product_starts[product_starts.len() - 1] + column.len() * (column.len() + 1) / 2,
            );
        }
        let diagonal = (0..m).map(|i| place(i, i)).collect();
        Some(Self {
            names,
            inequalities,
            first_equation: rows.inequalities,
            starts,
            columns,
            values,
            bounds,
            empty,
            matrix: Matrix::Sparse(matrix),
            diagonal,
            product_starts,
            products,
            factor: SquareCholesky::default(),
            w: vec![0.0; m],
            work: Work::default(),
        })
    }

    /// `y = P(p)`. [`Found::Unknown`] where another method has to tell.
    pub(super) fn onto(&mut self, rhs: &[f64], p: &[f64], y: &mut [f64]) -> Found {
        let Some(size) = self.state(rhs, p) else { return Found::Unknown };
        if size == 0.0 {
            self.w.fill(0.0);
        }
        let warm = self.w.iter().any(|w| *w != 0.0);
        let mut found = self.newton();
        if found == Found::Unknown && warm {
            self.w.fill(0.0);
            found = self.newton();
        }
        // One that is not known to be as far away as it is must not hold.
        let Work { h, z, .. } = &self.work;
        let far = -FARTHEST * size;
        let met = |i: usize| h[i] == far && far < 0.0 && z[i] == 0.0;
        if found == Found::Yes && (0..self.inequalities).any(met) {
            found = Found::Unknown;
        }
        if found != Found::Yes {
            self.w.fill(0.0);
            return found;
        }
        let Work { lower, upper, low, high, s, .. } = &self.work;
        for j in 0..y.len() {
            y[j] = if s[j] == low[j] {
                lower[j]
            } else if s[j] == high[j] {
                upper[j]
            } else {
                (p[j] + s[j]).clamp(lower[j], upper[j])
            };
        }
        if size > 0.0 {
            self.refine(rhs, y);
        }
        if y.iter().all(|y| y.is_finite()) { Found::Yes } else { Found::Unknown }
    }

    /// The rounding of p and w is in y, and adds up along chains of rows: y moves to the rows that hold, by the least that does it, as far as that makes them nearer.
    fn refine(&mut self, rhs: &[f64], y: &mut [f64]) {
        let mut best = self.excess(rhs, y);
        if best == 0.0 || !self.factorise() {
            return;
        }
        for _ in 0..REFINED {
            let Work { r, step, slope, low, high, along, lower, upper, .. } = &mut self.work;
            step.clone_from(r);
            self.factor.solve(step);
            slope.clear();
            slope.extend_from_slice(y);
            for (i, step) in step.iter().enumerate() {
                for at in self.starts[i]..self.starts[i + 1] {
                    slope[self.columns[at]] += self.values[at] * step;
                }
            }
            for j in 0..y.len() {
                let is_free = low[j] < along[j] && along[j] < high[j];
                slope[j] = if is_free { slope[j].clamp(lower[j], upper[j]) } else { y[j] };
            }
            let moved = std::mem::take(slope);
            let off = self.excess(rhs, &moved);
            if off < best {
                y.copy_from_slice(&moved);
            }
            let ends = off >= 0.5 * best || off == 0.0;
            self.work.slope = moved;
            if ends {
                break;
            }
            best = off;
        }
    }

    /// r of y, of the rows that hold; the largest in units of what rounding makes of its terms.
    fn excess(&mut self, rhs: &[f64], y: &[f64]) -> f64 {
        let Work { r, z, .. } = &mut self.work;
        let mut off = 0.0_f64;
        for (i, &name) in self.names.iter().enumerate() {
            let range = self.starts[i]..self.starts[i + 1];
            let rounding = (range.len() + 3) as f64 * f64::EPSILON;
            let terms = range.map(|at| self.values[at] * y[self.columns[at]]);
            let (sum, sizes) = terms.fold((0.0, 0.0), |(s, a), x: f64| (s + x, a + x.abs()));
            r[i] = if z[i] > 0.0 { 0.0 } else { rhs[name] - sum };
            if i < self.inequalities && self.w[i] <= 0.0 {
                r[i] = r[i].max(0.0);
            }
            if r[i] != 0.0 {
                off = off.max(r[i].abs() / (rounding * (sizes + rhs[name].abs())));
            }
        }
        off
    }

    /// The rows that the last projection met with a force, but for equations.
    pub(super) fn pushing(&self, rhs: &[f64], to: &mut Vec<usize>) {
        let Work { lower, upper, low, high, along, moduli, .. } = &self.work;
        for &(name, j, is_low, is_equation) in &self.bounds {
            let (force, holds) = if is_low {
                (low[j] - along[j], rhs[name] == lower[j])
            } else {
                (along[j] - high[j], -rhs[name] == upper[j])
            };
            if !is_equation && holds && force > NEARLY * f64::EPSILON * moduli[j] {
                to.push(name);
            }
        }
        let most = self.w.iter().fold(0.0_f64, |most, w| most.max(w.abs()));
        let pushes = |i: &usize| self.w[*i] > NEARLY * f64::EPSILON * most;
        to.extend((0..self.inequalities).filter(pushes).map(|i| self.names[i]));
    }

    /// Bounds and right sides less p, and the largest violation. `None` where bounds contradict each other, or an empty row is violated.
    fn state(&mut self, rhs: &[f64], p: &[f64]) -> Option<f64> {
        let n = p.len();
        let Work { lower, upper, low, high, h, noise, .. } = &mut self.work;
        lower.clear();
        lower.resize(n, f64::NEG_INFINITY);
        upper.clear();
        upper.resize(n, f64::INFINITY);
        for &(name, j, is_low, is_equation) in &self.bounds {
            let at = if is_low { rhs[name] } else { -rhs[name] };
            if is_low || is_equation {
                lower[j] = lower[j].max(at);
            }
            if !is_low || is_equation {
                upper[j] = upper[j].min(at);
            }
        }
        let first_equation = self.first_equation;
        let violated = |&k: &usize| rhs[k] > 0.0 || (k >= first_equation && rhs[k] < 0.0);
        if lower.iter().zip(&*upper).any(|(l, u)| l > u) || self.empty.iter().any(violated) {
            return None;
        }
        low.clear();
        low.extend(lower.iter().zip(p).map(|(l, p)| l - p));
        high.clear();
        high.extend(upper.iter().zip(p).map(|(u, p)| u - p));
        h.clear();
        noise.clear();
        let mut size = low.iter().zip(&*high).fold(0.0_f64, |size, (l, u)| size.max(*l).max(-u));
        for (i, &name) in self.names.iter().enumerate() {
            let range = self.starts[i]..self.starts[i + 1];
            let terms = range.clone().map(|at| self.values[at] * p[self.columns[at]]);
            let (sum, sizes) = terms.fold((0.0, 0.0), |(s, a), x: f64| (s + x, a + x.abs()));
            let rounding = (range.len() + 3) as f64 * f64::EPSILON;
            let own = rounding * (rhs[name].abs() + sizes);
            let excess = rhs[name] - sum;
            // What rounding leaves of a row on which p lies is no violation.
            h.push(if excess.abs() <= own { 0.0 } else { excess });
            noise.push(own);
            size = size.max(if i < self.inequalities { h[i] } else { h[i].abs() });
        }
        let far = -FARTHEST * size;
        h[..self.inequalities].iter_mut().for_each(|h| *h = h.max(far));
        size.is_finite().then_some(size)
    }

    fn newton(&mut self) -> Found {
        let m = self.names.len();
        let mut best = f64::INFINITY;
        let mut idle = 0;
        self.work.centre.clear();
        self.work.centre.resize(m, 0.0);
        self.move_to_rows();
        for _ in 0..STEPS {
            if budget::over() {
                return Found::Over;
            }
            let off = self.residual();
            if off.is_nan() {
                return Found::Unknown;
            }
            idle = if off < 0.5 * best { 0 } else { idle + 1 };
            if off < best {
                best = off;
                self.work.best.clone_from(&self.w);
            }
            let nearly = off <= NEARLY;
            if off <= 1.0 || (nearly && idle >= IDLE) {
                if off > best {
                    self.w.clone_from(&self.work.best);
                    self.residual();
                }
                if self.settles() {
                    return Found::Yes;
                }
                (best, idle) = (f64::INFINITY, 0);
                self.work.anchor.clone_from(&self.w);
                self.move_to_slacks();
                continue;
            }
            if !self.anchored() {
                continue;
            }
            let Some(rising) = self.direction() else {
                return if budget::over() { Found::Over } else { Found::Unknown };
            };
            // So near to the solution rounding hides what rises.
            let Some(length) = (if nearly { Some(1.0) } else { self.length(rising) }) else {
                return Found::Unknown;
            };
            for (w, step) in self.w.iter_mut().zip(&self.work.step) {
                *w += length * step;
            }
        }
        Found::Unknown
    }

    /// The residual of the problem beside z̄ and w̄; false where that is solved, and these have moved.
    fn anchored(&mut self) -> bool {
        let Work { anchor, inner, r, z, centre, .. } = &mut self.work;
        let largest = |x: &[f64]| x.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        inner.clear();
        inner.extend(r.iter().zip(&self.w).zip(&*anchor).map(|((r, w), a)| r - SHIFT * (w - a)));
        if largest(inner) > INNER * largest(r) {
            return true;
        }
        inner.clone_from(r);
        anchor.clone_from(&self.w);
        let mut moved = false;
        for i in 0..self.inequalities {
            moved |= z[i] != centre[i];
            centre[i] = z[i];
            if z[i] > 0.0 {
                (self.w[i], anchor[i]) = (0.0, 0.0);
            }
        }
        !moved
    }

    /// z̄ of the inequalities as far as p + s lies beyond them.
    fn move_to_rows(&mut self) {
        self.residual();
        let Work { centre, r, z, anchor, .. } = &mut self.work;
        anchor.clone_from(&self.w);
        for i in 0..self.inequalities {
            centre[i] = (z[i] - r[i]).max(0.0);
        }
    }

    /// z̄ to z, with w = 0 where these are positive.
    fn move_to_slacks(&mut self) {
        let Work { centre, z, .. } = &mut self.work;
        for i in 0..self.inequalities {
            centre[i] = z[i];
            if z[i] > 0.0 {
                self.w[i] = 0.0;
            }
        }
    }

    /// Whether no inequality has both a distance and a force.
    fn settles(&self) -> bool {
        let most = self.w.iter().fold(0.0_f64, |most, w| most.max(w.abs()));
        let none = NEARLY * f64::EPSILON * most;
        (0..self.inequalities)
            .all(|i| self.w[i] >= -none && (self.work.z[i] == 0.0 || self.w[i] <= none))
    }

    /// s, z and r at w; the largest |r| in units of what rounding makes of its terms.
    fn residual(&mut self) -> f64 {
        let Work { low, high, h, noise, centre, s, along, moduli, z, r, .. } = &mut self.work;
        for of in [&mut *along, moduli] {
            of.clear();
            of.resize(low.len(), 0.0);
        }
        for (i, w) in self.w.iter().enumerate() {
            for at in self.starts[i]..self.starts[i + 1] {
                let term = self.values[at] * w;
                along[self.columns[at]] += term;
                moduli[self.columns[at]] += term.abs();
            }
        }
        s.clear();
        s.extend(along.iter().zip(&*low).zip(&*high).map(|((a, l), u)| a.max(*l).min(*u)));
        z.clear();
        r.clear();
        let mut off = 0.0_f64;
        for i in 0..self.names.len() {
            let (mut sum, mut sizes) = (0.0, 0.0);
            let range = self.starts[i]..self.starts[i + 1];
            let rounding = (range.len() + 3) as f64 * f64::EPSILON;
            for at in range {
                let (j, g) = (self.columns[at], self.values[at]);
                sum += g * s[j];
                let size = if s[j] == along[j] { moduli[j] } else { s[j].abs() };
                sizes += g.abs() * size;
            }
            let is_bound = i < self.inequalities;
            z.push(if is_bound { (centre[i] - SLACK * self.w[i]).max(0.0) } else { 0.0 });
            r.push(h[i] + z[i] - sum);
            let least = noise[i] + rounding * (sizes + z[i] + h[i].abs());
            if r[i] != 0.0 {
                off = if r[i].is_finite() { off.max(r[i].abs() / least) } else { f64::NAN };
            }
            if off.is_nan() {
                return off;
            }
        }
        off
    }

    /// Factorises the matrix of the present pieces. False where that fails.
    fn factorise(&mut self) -> bool {
        let Work { low, high, along, z, .. } = &self.work;
        let Matrix::Sparse(matrix) = &mut self.matrix else { return false };
        let values = matrix.values_mut();
        values.fill(0.0);
        for j in 0..low.len() {
            if low[j] < along[j] && along[j] < high[j] {
                for &(at, x) in &self.products[self.product_starts[j]..self.product_starts[j + 1]] {
                    values[at] += x;
                }
            }
        }
        for (&at, z) in self.diagonal.iter().zip(z) {
            values[at] += SHIFT + if *z > 0.0 { SLACK } else { 0.0 };
        }
        uncounted(|| self.factor.factorise(&self.matrix)).is_ok()
    }

    /// Δ, and how the dual function rises along it; `None` where it does not.
    fn direction(&mut self) -> Option<f64> {
        if !self.factorise() {
            return None;
        }
        let Work { s, step, slope, inner, .. } = &mut self.work;
        step.clone_from(inner);
        self.factor.solve(step);
        slope.clear();
        slope.resize(s.len(), 0.0);
        for (i, step) in step.iter().enumerate() {
            for at in self.starts[i]..self.starts[i + 1] {
                slope[self.columns[at]] += self.values[at] * step;
            }
        }
        let rising = step.iter().zip(&*inner).map(|(d, r)| d * r).sum::<f64>();
        (rising > 0.0 && rising.is_finite()).then_some(rising)
    }

    /// `Δᵀ r(w + t Δ)`, which falls as t grows.
    fn rising(&self, first: f64, t: f64) -> f64 {
        let Work { low, high, s, centre, along, z, step, slope, .. } = &self.work;
        // Only what changes, so that little cancels.
        let mut sum = first - SHIFT * t * step.iter().map(|d| d * d).sum::<f64>();
        for (i, step) in step.iter().enumerate().take(self.inequalities) {
            sum += step * ((centre[i] - SLACK * (self.w[i] + t * step)).max(0.0) - z[i]);
        }
        for j in 0..low.len() {
            if slope[j] != 0.0 {
                sum -= slope[j] * ((along[j] + t * slope[j]).max(low[j]).min(high[j]) - s[j]);
            }
        }
        sum
    }

    /// The t at which the dual function rises no more; `None` where it always does, as over an empty set.
    fn length(&self, first: f64) -> Option<f64> {
        let enough = 0.01 * first;
        let (mut low, mut high) = ((0.0, first), (1.0, self.rising(first, 1.0)));
        while high.1 > enough {
            if high.0 > 1e30 {
                return None;
            }
            low = high;
            high = (4.0 * low.0, self.rising(first, 4.0 * low.0));
        }
        // Bisection of exponents while these differ, then secants between points of which none stays for long.
        let (mut stayed_low, mut stayed_high) = (0, 0);
        for _ in 0..100 {
            if high.1 >= -enough {
                return Some(high.0);
            }
            let t = if low.0 == 0.0 {
                high.0 / 64.0
            } else if high.0 > 4.0 * low.0 {
                (low.0 * high.0).sqrt()
            } else if stayed_low > 1 || stayed_high > 1 {
                0.5 * (low.0 + high.0)
            } else {
                low.0 + (high.0 - low.0) * low.1 / (low.1 - high.1)
            };
            if t <= 0.0 || !(t > low.0 && t < high.0) {
                break;
            }
            let at = self.rising(first, t);
            if at.abs() <= enough {
                return Some(t);
            }
            if at > 0.0 {
                (low, stayed_low, stayed_high) = ((t, at), 0, stayed_high + 1);
            } else {
                (high, stayed_low, stayed_high) = ((t, at), stayed_low + 1, 0);
            }
        }
        let t = if low.0 > 0.0 { low.0 } else { high.0 };
        (t > 0.0).then_some(t)
    }
}

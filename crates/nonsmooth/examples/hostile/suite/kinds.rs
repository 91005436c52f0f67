//! What the suite asks of each kind of problem: its union of polyhedra, and how far a point is from solving it, exactly.

use std::path::Path;

use nonsmooth::{
    BoxLcp, Friction, FrictionGlobal, FrictionLocal, GlobalPoint, Hlcp, HlcpPoint, Lcp, LcpPoint,
    LocalPoint, Matrix, Mlcp,
};
use nonsmooth_io::{IoError, ProblemFile};
use nonsmooth_problem::check::Judged;
use nonsmooth_solve::registry::Registered;

use super::exact::{Dyadic, Sum};
use super::oracle::{Cell, Union};

/// A kind of problem under attack.
pub trait Hostile: Registered + Judged + Sync {
    /// The problem as a union of polyhedra; none where its cones are round.
    fn union(&self) -> Option<Union>;

    /// The criterion by which a point is called solved, computed exactly: at most the tolerance.
    fn error(&self, point: &Self::Point) -> f64;

    /// The same for a point whose velocities are taken as they are given, not as they follow from the impulses: where constraints nearly repeat each other,
    /// these are velocities of a neighbouring problem.
    fn error_as_given(&self, point: &Self::Point) -> f64 {
        self.error(point)
    }

    /// All numbers of a point.
    fn numbers(point: &Self::Point) -> Vec<f64>;

    /// The point of these numbers, in the order of `numbers`.
    fn point(&self, numbers: &[f64]) -> Self::Point;

    /// The question of existence is asked of contacts only.
    fn contacts(&self) -> Option<Friction>;

    /// Writes the problem; the extension is added.
    fn save(&self, path: &Path) -> Result<(), IoError>;
}

/// Rows of entries, by row.
fn rows(m: &Matrix) -> Vec<Vec<(usize, f64)>> {
    let mut rows = vec![vec![]; m.nrows()];
    assert!(m.for_each(|i, j, x| rows[i].push((j, x))), "a matrix with entries");
    rows
}

/// The largest share that a change of variable j by `distance` has in any row.
fn felt(columns: &[Vec<(usize, f64)>], j: usize, distance: &Dyadic, rows: &[Sum]) -> f64 {
    let share = |&(k, a): &(usize, f64)| ratio(&(&Dyadic::from(a) * distance), &rows[k].size);
    columns[j].iter().map(share).fold(0.0, f64::max)
}

/// `|a| / b`; 0 of 0/0.
fn ratio(a: &Dyadic, b: &Dyadic) -> f64 {
    match (a.is_zero(), b.is_zero()) {
        (true, _) => 0.0,
        (false, true) => f64::INFINITY,
        (false, false) => a.abs().over(b).to_f64(),
    }
}

fn negative(x: &Dyadic) -> Dyadic {
    (-x).max(Dyadic::zero())
}

fn transposed(rows: &[Vec<(usize, f64)>], ncols: usize) -> Vec<Vec<(usize, f64)>> {
    let mut columns = vec![vec![]; ncols];
    for (i, row) in rows.iter().enumerate() {
        row.iter().for_each(|&(j, a)| columns[j].push((i, a)));
    }
    columns
}

/// A problem in z: rows `w = M z + q`, some of them equations, others of a variable with bounds.
struct InZ<'a> {
    matrix: &'a Matrix,
    q: &'a [f64],
    equalities: usize,
    free: usize,
    bounds: Option<(&'a [f64], &'a [f64])>,
}

impl InZ<'_> {
    fn bounds(&self, i: usize) -> (f64, f64) {
        self.bounds.map_or((0.0, f64::INFINITY), |(l, u)| (l[i], u[i]))
    }

    fn union(&self) -> Union {
        let mut union = Union::new(self.matrix.ncols());
        for (i, row) in rows(self.matrix).iter().enumerate() {
            let w = union.form(row, self.q[i]);
            let Some(k) = i.checked_sub(self.equalities) else {
                union.zero.push(w);
                continue;
            };
            let j = self.free + k;
            let (l, u) = self.bounds(i);
            let lower = l.is_finite().then(|| union.form(&[(j, 1.0)], -l));
            let upper = u.is_finite().then(|| union.form(&[(j, -1.0)], u));
            let mut cells = vec![];
            if l == u {
                cells.push(Cell { zero: vec![lower.expect("finite")], nonnegative: vec![] });
            } else {
                let at = |form, sign| Cell { zero: vec![form], nonnegative: vec![(w, sign)] };
                cells.extend(lower.map(|form| at(form, 1)));
                cells.extend(upper.map(|form| at(form, -1)));
                let between = lower.into_iter().chain(upper).map(|form| (form, 1)).collect();
                cells.push(Cell { zero: vec![w], nonnegative: between });
            }
            union.choices.push(cells);
        }
        union
    }

    /// The largest componentwise backward error of a row: every row is measured in units of its own terms `|M||z| + |q|`, a bound that is kept
    /// only nearly by what keeping it exactly would change in any row.
    fn error(&self, z: &[f64]) -> f64 {
        let entries = rows(self.matrix);
        let columns = transposed(&entries, z.len());
        let sums: Vec<Sum> = entries
            .iter()
            .zip(self.q)
            .map(|(row, &q)| {
                let mut sum = Sum::of(q);
                row.iter().for_each(|&(j, a)| sum.add(a, z[j]));
                sum
            })
            .collect();
        let mut worst = 0.0_f64;
        for (i, sum) in sums.iter().enumerate() {
            let Some(k) = i.checked_sub(self.equalities) else {
                worst = worst.max(ratio(&sum.value, &sum.size));
                continue;
            };
            let j = self.free + k;
            let (l, u) = self.bounds(i);
            let x = Dyadic::from(z[j]);
            let beyond = |bound: f64, sign: f64| {
                let gap = &Dyadic::from(bound) - &x;
                if bound.is_finite() { &gap * &Dyadic::from(sign) } else { Dyadic::zero() }
            };
            let below = beyond(if l.is_finite() { l } else { 0.0 }, f64::from(l.is_finite()));
            let above = beyond(if u.is_finite() { u } else { 0.0 }, -f64::from(u.is_finite()));
            let moved = |distance: &Dyadic| felt(&columns, j, &distance.abs(), &sums);
            let outside = moved(&below.clone().max(above.clone()).max(Dyadic::zero()));
            let mut best = outside.max(ratio(&sum.value, &sum.size));
            if l == u {
                best = moved(&below);
            } else {
                if l.is_finite() {
                    best = best.min(moved(&below).max(ratio(&negative(&sum.value), &sum.size)));
                }
                if u.is_finite() {
                    best = best.min(moved(&above).max(ratio(&negative(&-&sum.value), &sum.size)));
                }
            }
            worst = worst.max(best);
        }
        worst
    }
}

macro_rules! hostile_in_z {
    ($kind:ident, $variant:ident, $problem:ident => $data:expr) => {
        impl Hostile for $kind {
            fn union(&self) -> Option<Union> {
                let $problem = self;
                Some($data.union())
            }
            fn error(&self, point: &LcpPoint) -> f64 {
                let $problem = self;
                $data.error(&point.z)
            }
            fn numbers(point: &LcpPoint) -> Vec<f64> {
                point.z.clone()
            }
            fn point(&self, numbers: &[f64]) -> LcpPoint {
                LcpPoint { z: numbers.to_vec() }
            }
            fn contacts(&self) -> Option<Friction> {
                None
            }
            fn save(&self, path: &Path) -> Result<(), IoError> {
                ProblemFile::new(self.clone()).write(path.with_extension("toml"))
            }
        }
    };
}

hostile_in_z!(Lcp, Lcp, p => InZ { matrix: &p.M, q: &p.q, equalities: 0, free: 0, bounds: None });
hostile_in_z!(Mlcp, Mlcp, p => InZ {
    matrix: &p.M,
    q: &p.q,
    equalities: p.equalities,
    free: p.free,
    bounds: None,
});
hostile_in_z!(BoxLcp, Box, p => InZ {
    matrix: &p.M,
    q: &p.q,
    equalities: 0,
    free: 0,
    bounds: Some((&p.lower, &p.upper)),
});

impl Hostile for Hlcp {
    fn union(&self) -> Option<Union> {
        let n = self.dim();
        let mut union = Union::new(2 * n);
        let (q, r) = (rows(&self.Q), rows(&self.R));
        for i in 0..n {
            let mut entries = q[i].clone();
            entries.extend(r[i].iter().map(|&(j, a)| (n + j, a)));
            let row = union.form(&entries, -self.q[i]);
            union.zero.push(row);
        }
        for i in 0..n {
            let (x, s) = (union.form(&[(i, 1.0)], 0.0), union.form(&[(n + i, 1.0)], 0.0));
            union.pair(x, s);
        }
        Some(union)
    }

    fn error(&self, point: &HlcpPoint) -> f64 {
        let n = self.dim();
        let (q, r) = (rows(&self.Q), rows(&self.R));
        let sums: Vec<Sum> = (0..n)
            .map(|i| {
                let mut sum = Sum::of(-self.q[i]);
                q[i].iter().for_each(|&(j, a)| sum.add(a, point.x[j]));
                r[i].iter().for_each(|&(j, a)| sum.add(a, point.s[j]));
                sum
            })
            .collect();
        let (q, r) = (transposed(&q, n), transposed(&r, n));
        let mut worst = sums.iter().map(|s| ratio(&s.value, &s.size)).fold(0.0, f64::max);
        for i in 0..n {
            let (x, s) = (Dyadic::from(point.x[i]), Dyadic::from(point.s[i]));
            let gone = |a: &Dyadic, columns| felt(columns, i, &a.abs(), &sums);
            let closed = gone(&x, &q).max(gone(&negative(&s), &r));
            let open = gone(&s, &r).max(gone(&negative(&x), &q));
            worst = worst.max(closed.min(open));
        }
        worst
    }

    fn numbers(point: &HlcpPoint) -> Vec<f64> {
        [&point.x[..], &point.s].concat()
    }

    fn point(&self, numbers: &[f64]) -> HlcpPoint {
        let (x, s) = numbers.split_at(self.dim());
        HlcpPoint { x: x.to_vec(), s: s.to_vec() }
    }

    fn contacts(&self) -> Option<Friction> {
        None
    }

    fn save(&self, path: &Path) -> Result<(), IoError> {
        ProblemFile::new(self.clone()).write(path.with_extension("toml"))
    }
}

/// The cells of a contact with the forms of r and u, in the plane or without friction; `r_at` is the column of its r_N.
fn contact(union: &mut Union, d: usize, mu: f64, r_at: usize, u: &[usize]) -> Vec<Cell> {
    let r: Vec<_> = (0..d).map(|k| union.form(&[(r_at + k, 1.0)], 0.0)).collect();
    let open = Cell { zero: r.clone(), nonnegative: vec![(u[0], 1)] };
    if mu == 0.0 {
        let mut zero = vec![u[0]];
        zero.extend(&r[1..]);
        return vec![open, Cell { zero, nonnegative: vec![(r[0], 1)] }];
    }
    let edge = |union: &mut Union, sign| union.form(&[(r_at, mu), (r_at + 1, sign)], 0.0);
    let (plus, minus) = (edge(union, 1.0), edge(union, -1.0));
    let stick = Cell { zero: u.to_vec(), nonnegative: vec![(plus, 1), (minus, 1)] };
    let slip =
        |edge, sign| Cell { zero: vec![u[0], edge], nonnegative: vec![(r[0], 1), (u[1], sign)] };
    vec![open, stick, slip(plus, 1), slip(minus, -1)]
}

fn polyhedral<const D: usize>(mu: &[f64]) -> bool {
    D == 2 || mu.iter().all(|&mu| mu == 0.0)
}

/// `‖(x_c − P_K(x_c − ũ_c))_c‖ / ‖q‖`, `x_c = w_c r_c`.
fn law<const D: usize>(w: &[Dyadic], r: &[f64], u: &[Dyadic], mu: &[f64], q: &[Dyadic]) -> f64 {
    let nc = mu.len();
    let mean = w.iter().fold(Dyadic::zero(), |sum, w| &sum + w);
    let mean = mean.over(&Dyadic::from(nc as f64));
    let stand_in = if mean.sign() > 0 { mean } else { Dyadic::from(1.0) };
    let norm = |v: &[Dyadic]| v.iter().fold(Dyadic::zero(), |s, v| &s + &(v * v)).sqrt();
    let mut map = vec![];
    for c in 0..nc {
        let w = if w[c].sign() > 0 { &w[c] } else { &stand_in };
        let mu = Dyadic::from(mu[c]);
        let x: Vec<_> = (0..D).map(|k| w * &Dyadic::from(r[D * c + k])).collect();
        let mut modified = u[D * c..D * c + D].to_vec();
        modified[0] = &modified[0] + &(&mu * &norm(&modified[1..]));
        let y: Vec<_> = x.iter().zip(&modified).map(|(x, u)| x - u).collect();
        let t = norm(&y[1..]);
        let outside = &t - &(&mu * &y[0]);
        if outside.sign() <= 0 && y[0].sign() >= 0 {
            map.extend(modified);
        } else if (&y[0] + &(&mu * &t)).sign() <= 0 {
            map.extend(x);
        } else {
            let secant = &Dyadic::from(1.0) + &(&mu * &mu);
            let scale = outside.over(&secant);
            map.push(&modified[0] - &(&mu * &scale));
            for k in 1..D {
                map.push(&modified[k] + &(&scale * &y[k]).over(&t));
            }
        }
    }
    let q = norm(q);
    let q = if q.is_zero() { Dyadic::from(1.0) } else { q };
    norm(&map).over(&q).to_f64()
}

/// What the judge forgives of a constraint whose terms are rounding themselves, over those of typical unknowns.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

impl<const D: usize> FrictionParts for FrictionLocal<D> {
    fn union_of(&self) -> Option<Union> {
        if !polyhedral::<D>(&self.mu) {
            return None;
        }
        let m = self.q.len();
        let mut union = Union::new(m + self.multipliers());
        let mut entries: Vec<Vec<(usize, f64)>> = vec![vec![]; m];
        self.W.to_csc().triplets().for_each(|(i, j, x)| entries[i].push((j, x)));
        if let Some(b) = &self.rows {
            b.V.triplets().for_each(|(i, j, x)| entries[i].push((m + j, x)));
            for j in 0..b.s.len() {
                let (at, values) = b.V.column(j);
                let mut row: Vec<_> = at.iter().copied().zip(values.iter().copied()).collect();
                row.extend(b.R.triplets().filter(|e| e.0 == j).map(|(_, k, x)| (m + k, x)));
                let form = union.form(&row, b.s[j]);
                union.zero.push(form);
            }
        }
        let u: Vec<_> = (0..m).map(|i| union.form(&entries[i], self.q[i])).collect();
        for (c, &mu) in self.mu.iter().enumerate() {
            let cells = contact(&mut union, D, mu, D * c, &u[D * c..D * c + D]);
            union.choices.push(cells);
        }
        Some(union)
    }
}

/// The union of a contact problem.
trait FrictionParts {
    fn union_of(&self) -> Option<Union>;
}

impl<const D: usize> FrictionParts for FrictionGlobal<D> {
    fn union_of(&self) -> Option<Union> {
        if !polyhedral::<D>(&self.mu) {
            return None;
        }
        let (n, m) = (self.dofs(), self.w.len());
        let mut union = Union::new(n + m + self.multipliers());
        let mut entries: Vec<Vec<(usize, f64)>> = vec![vec![]; n];
        self.M.triplets().for_each(|(i, j, x)| entries[i].push((j, x)));
        self.H.triplets().for_each(|(i, j, x)| entries[i].push((n + j, -x)));
        if let Some(b) = &self.rows {
            b.G.triplets().for_each(|(i, j, x)| entries[i].push((n + m + j, -x)));
            for j in 0..b.b.len() {
                let (at, values) = b.G.column(j);
                let row: Vec<_> = at.iter().copied().zip(values.iter().copied()).collect();
                let form = union.form(&row, b.b[j]);
                union.zero.push(form);
            }
        }
        for i in 0..n {
            let form = union.form(&entries[i], -self.f[i]);
            union.zero.push(form);
        }
        let u: Vec<_> = (0..m)
            .map(|j| {
                let (at, values) = self.H.column(j);
                let row: Vec<_> = at.iter().copied().zip(values.iter().copied()).collect();
                union.form(&row, self.w[j])
            })
            .collect();
        for (c, &mu) in self.mu.iter().enumerate() {
            let cells = contact(&mut union, D, mu, n + D * c, &u[D * c..D * c + D]);
            union.choices.push(cells);
        }
        Some(union)
    }
}

/// Rows of coefficients of the unknowns, then of constants: the constants of `forms` after `equations = 0` has eliminated the unknowns. `None` where
/// the equations contradict each other or leave a form undetermined.
fn eliminated(
    mut equations: Vec<Vec<Dyadic>>,
    mut forms: Vec<Vec<Dyadic>>,
    width: usize,
) -> Option<Vec<Vec<Dyadic>>> {
    let mut divisor = Dyadic::from(1.0);
    while let Some(row) = equations.pop() {
        let Some(k) = (0..width).find(|&k| !row[k].is_zero()) else {
            if row.iter().any(|x| !x.is_zero()) {
                return None;
            }
            continue;
        };
        for other in equations.iter_mut().chain(&mut forms) {
            let factor = other[k].clone();
            for j in 0..other.len() {
                let minor = &(&other[j] * &row[k]) - &(&factor * &row[j]);
                other[j] = minor.over_divisor(&divisor);
            }
        }
        divisor = row[k].clone();
    }
    if forms.iter().any(|f| f[..width].iter().any(|x| !x.is_zero())) {
        return None;
    }
    let value = |x: &Dyadic| x.over(&divisor);
    Some(forms.iter().map(|f| f[width..].iter().map(value).collect()).collect())
}

/// A row of so many zeros and a constant.
fn with_constant(width: usize, constant: f64) -> Vec<Dyadic> {
    let mut row = vec![Dyadic::zero(); width];
    row.push(Dyadic::from(constant));
    row
}

/// What a residual is relative to: q or, where the constraints determine it, q with them in force. The judge takes the second where its own factors tell, else the first, and never more than the larger.
fn larger(q: Vec<Dyadic>, enforced: Option<Vec<Dyadic>>) -> Vec<Dyadic> {
    let square = |v: &[Dyadic]| v.iter().fold(Dyadic::zero(), |s, x| &s + &(x * x));
    match enforced {
        Some(other) if (&square(&other) - &square(&q)).sign() > 0 => other,
        _ => q,
    }
}

/// The largest violation of an equation in units of its terms; an equation whose terms are all the rounding of `typical` ones counts with the others.
fn violation(sums: &[Sum], typical: impl Fn(usize) -> f64) -> f64 {
    let share = |(j, s): (usize, &Sum)| {
        let floor = Dyadic::from(ROUNDING * typical(j));
        let beyond = &s.value.abs() - &floor;
        ratio(&beyond.max(Dyadic::zero()), &s.size)
    };
    sums.iter().enumerate().map(share).fold(0.0, f64::max)
}

/// The root of a diagonal entry, the unit of its row; 1 where it vanishes.
fn unit(diagonal: f64) -> f64 {
    match diagonal.abs().sqrt() {
        unit if unit > 0.0 => unit,
        _ => 1.0,
    }
}

impl<const D: usize> Judge for FrictionLocal<D> {
    fn exactly(&self, point: &LocalPoint, _as_given: bool) -> f64 {
        let (m, nc) = (self.q.len(), self.contacts());
        let mut sums: Vec<Sum> = self.q.iter().map(|&q| Sum::of(q)).collect();
        self.W.to_csc().triplets().for_each(|(i, j, a)| sums[i].add(a, point.r[j]));
        let mut bilateral = 0.0;
        if let Some(b) = &self.rows {
            b.V.triplets().for_each(|(i, j, a)| sums[i].add(a, point.lambda[j]));
            let mut rows: Vec<Sum> = b.s.iter().map(|&s| Sum::of(s)).collect();
            b.V.triplets().for_each(|(i, j, a)| rows[j].add(a, point.r[i]));
            b.R.triplets().for_each(|(i, j, a)| rows[i].add(a, point.lambda[j]));
            // Rounding of a typical impulse or multiplier: r_c √w_c and λ_j √|R_jj| are comparable.
            let of_contact = |i: usize| {
                let block = self.W.diagonal_block(i / D);
                unit(block.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs())))
            };
            let of_row = |j: usize| unit(b.R.get(j, j));
            let largest = |x: &[f64], unit: &dyn Fn(usize) -> f64| {
                (0..x.len()).fold(0.0_f64, |m, i| m.max(x[i].abs() * unit(i)))
            };
            let typical = [largest(&point.r, &of_contact), largest(&point.lambda, &of_row)];
            let mut weights = vec![0.0; b.s.len()];
            let mut add = |j: usize, share: f64| weights[j] += share;
            b.V.triplets().for_each(|(i, j, a)| add(j, typical[0] * a.abs() / of_contact(i)));
            b.R.triplets().for_each(|(i, j, a)| add(i, typical[1] * a.abs() / of_row(j)));
            bilateral = violation(&rows, |j| weights[j]);
        }
        let w: Vec<_> = (0..nc)
            .map(|c| {
                let block = self.W.diagonal_block(c);
                let trace = (0..D).fold(Dyadic::zero(), |t, k| &t + &Dyadic::from(block[k][k]));
                trace.over(&Dyadic::from(D as f64))
            })
            .collect();
        let u: Vec<_> = sums.into_iter().map(|s| s.value).collect();
        let q: Vec<_> = (0..m).map(|i| Dyadic::from(self.q[i])).collect();
        let enforced = self.rows.as_ref().and_then(|b| {
            // R λ + s = 0, and q + V λ.
            let p = b.s.len();
            let mut equations: Vec<_> = b.s.iter().map(|&s| with_constant(p, s)).collect();
            let mut forms: Vec<_> = self.q.iter().map(|&q| with_constant(p, q)).collect();
            let add = |rows: &mut [Vec<Dyadic>], i: usize, j: usize, x: f64| {
                rows[i][j] = &rows[i][j] + &Dyadic::from(x);
            };
            b.R.triplets().for_each(|(i, j, x)| add(&mut equations, i, j, x));
            b.V.triplets().for_each(|(i, j, x)| add(&mut forms, i, j, x));
            eliminated(equations, forms, p)
        });
        let q = larger(q, enforced.map(|rows| rows.into_iter().flatten().collect()));
        law::<D>(&w, &point.r, &u, &self.mu, &q).max(bilateral)
    }
}

impl<const D: usize> Judge for FrictionGlobal<D> {
    fn exactly(&self, point: &GlobalPoint, as_given: bool) -> f64 {
        let (n, m, p) = (self.dofs(), self.w.len(), self.multipliers());
        let entry = |rows: &mut [Vec<Dyadic>], i: usize, j: usize, x: f64| {
            rows[i][j] = &rows[i][j] + &Dyadic::from(x);
        };
        // q and w_c are those of the free dynamics: M X = [f, H].
        let zeros = |rows: usize, columns: usize| vec![vec![Dyadic::zero(); columns]; rows];
        let (mut equations, mut forms) = (zeros(n, n + 1 + m), zeros(m, n + 1 + m));
        self.M.triplets().for_each(|(i, j, x)| entry(&mut equations, i, j, x));
        for i in 0..n {
            entry(&mut equations, i, n, -self.f[i]);
        }
        self.H.triplets().for_each(|(i, j, x)| {
            entry(&mut equations, i, n + 1 + j, -x);
            entry(&mut forms, j, i, x);
        });
        for j in 0..m {
            entry(&mut forms, j, n, self.w[j]);
        }
        let Some(free) = eliminated(equations, forms, n) else { return f64::INFINITY };
        let q: Vec<_> = free.iter().map(|row| row[0].clone()).collect();
        let mean = |c: usize| {
            let trace = (0..D).fold(Dyadic::zero(), |t, k| &t + &free[D * c + k][1 + D * c + k]);
            trace.over(&Dyadic::from(D as f64))
        };
        let w: Vec<_> = (0..self.contacts()).map(mean).collect();
        // The velocities that follow from r, the constraints kept.
        // Without impulses beside.
        let (mut equations, mut forms) = (zeros(n + p, n + p + 2), zeros(m, n + p + 2));
        self.M.triplets().for_each(|(i, j, x)| entry(&mut equations, i, j, x));
        let mut load: Vec<Sum> = self.f.iter().map(|&f| Sum::of(f)).collect();
        self.H.triplets().for_each(|(i, j, x)| {
            load[i].add(x, point.r[j]);
            entry(&mut forms, j, i, x);
        });
        for (i, load) in load.iter().enumerate() {
            equations[i][n + p] = -&load.value;
            equations[i][n + p + 1] = Dyadic::from(-self.f[i]);
        }
        let mut given: Vec<Sum> = self.w.iter().map(|&w| Sum::of(w)).collect();
        self.H.triplets().for_each(|(i, j, x)| given[j].add(x, point.v[i]));
        for j in 0..m {
            (0..2).for_each(|k| entry(&mut forms, j, n + p + k, self.w[j]));
        }
        let mut bilateral = 0.0;
        if let Some(b) = &self.rows {
            let mut rows: Vec<Sum> = b.b.iter().map(|&b| Sum::of(b)).collect();
            let mut weights = vec![0.0; p];
            b.G.triplets().for_each(|(i, j, x)| {
                entry(&mut equations, i, n + j, -x);
                entry(&mut equations, n + j, i, x);
                rows[j].add(x, point.v[i]);
                weights[j] += x.abs() / unit(self.M.get(i, i));
            });
            for j in 0..p {
                (0..2).for_each(|k| entry(&mut equations, n + j, n + p + k, b.b[j]));
            }
            let kinetic = |(i, v): (usize, &f64)| v.abs() * unit(self.M.get(i, i));
            let typical = point.v.iter().enumerate().map(kinetic).fold(0.0, f64::max);
            bilateral = violation(&rows, |j| weights[j] * typical);
        }
        let given: Vec<_> = given.into_iter().map(|s| s.value).collect();
        let followed = eliminated(equations, forms, n + p);
        let of = |k: usize| {
            let column = |rows: &Vec<Vec<Dyadic>>| rows.iter().map(|row| row[k].clone()).collect();
            followed.as_ref().map(column)
        };
        let q = larger(q, of(1));
        if as_given {
            for (j, &v) in point.v.iter().enumerate() {
                let (at, values) = self.M.column(j);
                at.iter().zip(values).for_each(|(&i, &x)| load[i].add(-x, v));
            }
            if let Some(b) = &self.rows {
                b.G.triplets().for_each(|(i, j, x)| load[i].add(x, point.lambda[j]));
            }
            let dynamics = violation(&load, |_| 0.0);
            return law::<D>(&w, &point.r, &given, &self.mu, &q).max(bilateral).max(dynamics);
        }
        // Where r does not determine the velocities, those given count.
        let Some(u): Option<Vec<Dyadic>> = of(0) else {
            return self.exactly(point, true);
        };
        let square = |s: Dyadic, x: &Dyadic| &s + &(x * x);
        let size = q.iter().fold(Dyadic::zero(), square).sqrt();
        // The last bits of v are no gap.
        let mut bits = vec![0.0; m];
        self.H.triplets().for_each(|(i, j, x)| bits[j] += ROUNDING * (x * point.v[i]).abs());
        let gaps = u
            .iter()
            .zip(&given)
            .zip(&bits)
            .map(|((u, g), bits)| (&(u - g).abs() - &Dyadic::from(*bits)).max(Dyadic::zero()));
        let gap = gaps.fold(Dyadic::zero(), |s, x| square(s, &x)).sqrt();
        let gap = if size.is_zero() { gap.to_f64() } else { ratio(&gap, &size) };
        law::<D>(&w, &point.r, &u, &self.mu, &q).max(bilateral).max(gap)
    }
}

/// The residual of a contact problem, exactly.
trait Judge: nonsmooth::Problem {
    fn exactly(&self, point: &Self::Point, as_given: bool) -> f64;
}

macro_rules! hostile_contact {
    ($kind:ty, $variant:ident, $point:ident, [$($part:ident: $length:expr),*], $problem:ident) => {
        impl Hostile for $kind {
            fn union(&self) -> Option<Union> {
                self.union_of()
            }
            fn error(&self, point: &$point) -> f64 {
                self.exactly(point, false)
            }
            fn error_as_given(&self, point: &$point) -> f64 {
                self.exactly(point, true)
            }
            fn numbers(point: &$point) -> Vec<f64> {
                [$(&point.$part[..]),*].concat()
            }
            fn point(&self, numbers: &[f64]) -> $point {
                let $problem = self;
                let mut rest = numbers;
                let mut next = |length: usize| {
                    let (part, others) = rest.split_at(length);
                    rest = others;
                    part.to_vec()
                };
                $point { $($part: next($length)),* }
            }
            fn contacts(&self) -> Option<Friction> {
                Some(Friction::$variant(self.clone()))
            }
            fn save(&self, path: &Path) -> Result<(), IoError> {
                ProblemFile::new(self.clone()).write(path.with_extension("hdf5"))
            }
        }
    };
}

hostile_contact!(FrictionLocal<2>, Local2, LocalPoint, [r: p.q.len(), lambda: p.multipliers()], p);
hostile_contact!(FrictionLocal<3>, Local3, LocalPoint, [r: p.q.len(), lambda: p.multipliers()], p);
hostile_contact!(FrictionGlobal<2>, Global2, GlobalPoint, [v: p.dofs(), r: p.w.len(), lambda: p.multipliers()], p);
hostile_contact!(FrictionGlobal<3>, Global3, GlobalPoint, [v: p.dofs(), r: p.w.len(), lambda: p.multipliers()], p);

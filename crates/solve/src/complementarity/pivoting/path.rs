//! The almost complementary path: pivots on `B x_B = q` in which the complement of what has left enters next.

use nonsmooth_linalg::Compensated;

use super::basis::{Basis, Data};
use crate::complementarity::parts::cycles::{Cycles, word};
use crate::core::trace::Variable;

/// How ties of the ratio test are broken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Breaking {
    /// By the rows of B⁻¹ (relative to the first basis), lexicographically.
    Lexicographic,
    /// By a random right-hand side times an ε, then by the rows: lexicographic as well, with one column more in front.
    Perturbed,
    /// By the rows of B⁻¹, but the first pivot is the first of those tied: those rows are then not positive to begin with, and nothing is guaranteed.
    Rows,
    /// The first slot, whatever it is.
    First,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum End {
    /// z0 leaves: Lemke.
    Artificial,
    /// A variable of this pair leaves: Lemke–Howson.
    Pair(usize),
}

/// What a pivot came to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Event {
    /// A variable has entered, another has left.
    Pivoted(Exchange),
    /// As before; the path has ended in a solution.
    Ended(Exchange),
    /// Nothing bounds the entering variable.
    Ray,
    /// It cannot go on.
    Trouble(&'static str),
}

/// One exchange.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Exchange {
    pub entering: Variable,
    pub leaving: Variable,
    /// The value of the entering variable, in the problem's own units.
    pub ratio: f64,
}

/// The path and its basis.
pub(super) struct Path {
    pub data: Data,
    pub basis: Box<dyn Basis>,
    /// The variable of each slot.
    pub basic: Vec<Variable>,
    /// Their values.
    pub x: Vec<f64>,
    pub breaking: Breaking,
    pub end: End,
    /// An entry of a column is zero below this, in units of its largest.
    pub pivot_tolerance: f64,
    /// Exchanges between two renewals of the basis.
    pub renew_every: usize,
    driving: Variable,
    /// The basic variables where the path began: the columns of the lexicographic order.
    start: Vec<Variable>,
    /// Values under the perturbation: coefficients of ε.
    p: Vec<f64>,
    /// What x is measured by: a value below [`TIE`] of it is rounding.
    size: Vec<f64>,
    y: Vec<f64>,
    buffer: Vec<f64>,
    correction: Vec<f64>,
    sums: Vec<Compensated>,
    tied: Vec<usize>,
    rows: [Vec<f64>; 2],
    cycles: Cycles,
    /// z0 of the problem over that of the scaled one.
    pub artificial_unit: f64,
}

/// A value below this, in units of its size, is zero; two ratios closer than this are tied.
const TIE: f64 = 1e-12;
/// A pivot below this, in units of its column, is looked at again with a fresh basis.
const SUSPECT: f64 = 1e-7;
/// The size that makes a correction of x by refinement count as rounding.
const ROUNDING: f64 = 1e13;
/// Entries of lexicographic rows that are closer than this are the same.
const SAME: f64 = 1e-9;

/// A random word for each variable.
fn word_of(v: Variable) -> u64 {
    word(match v {
        Variable::Z(i) => 2 * i as u64,
        Variable::W(i) => 2 * i as u64 + 1,
        Variable::Artificial => u64::MAX,
    })
}

pub(super) fn complement(v: Variable) -> Variable {
    match v {
        Variable::Z(i) => Variable::W(i),
        Variable::W(i) => Variable::Z(i),
        Variable::Artificial => Variable::Artificial,
    }
}

impl Path {
    pub fn new(data: Data, basis: Box<dyn Basis>) -> Self {
        let none = Vec::new;
        Self {
            data,
            basis,
            basic: vec![],
            x: none(),
            breaking: Breaking::Lexicographic,
            end: End::Artificial,
            pivot_tolerance: 1e-11,
            renew_every: 64,
            driving: Variable::Artificial,
            start: vec![],
            p: none(),
            size: none(),
            y: none(),
            buffer: none(),
            correction: none(),
            sums: vec![],
            tied: Vec::new(),
            rows: [none(), none()],
            cycles: Cycles::default(),
            artificial_unit: 1.0,
        }
    }

    /// Whether a variable must not become negative: neither a free z nor the w of an equality.
    pub fn bounded(&self, v: Variable) -> bool {
        match v {
            Variable::Z(i) | Variable::W(i) => i >= self.data.free,
            Variable::Artificial => true,
        }
    }

    /// The factor from the scaled to the problem's own unit.
    pub fn unit(&self, v: Variable) -> f64 {
        match v {
            Variable::Z(j) => self.data.col[j],
            Variable::W(i) => 1.0 / self.data.row[i],
            Variable::Artificial => self.artificial_unit,
        }
    }

    /// Puts the basis where the w are basic, except those of `alpha`, whose z are.
    pub fn place(&mut self, alpha: &[bool]) -> Result<(), &'static str> {
        let n = self.data.n;
        self.basic.clear();
        let variable = |i: usize| if alpha[i] { Variable::Z(i) } else { Variable::W(i) };
        self.basic.extend((0..n).map(variable));
        self.prepare()
    }

    /// Renews the basis of `self.basic`, which is complementary, and begins there.
    pub fn prepare(&mut self) -> Result<(), &'static str> {
        let n = self.data.n;
        self.data.p.fill(0.0);
        let rows = self.rows.iter_mut();
        for v in [&mut self.x, &mut self.p, &mut self.size, &mut self.y, &mut self.buffer]
            .into_iter()
            .chain([&mut self.correction])
            .chain(rows)
        {
            v.clear();
            v.resize(n, 0.0);
        }
        self.sums.clear();
        self.sums.resize(n, Compensated::default());
        self.tied.clear();
        self.tied.reserve(n);
        self.start.clear();
        self.start.extend_from_slice(&self.basic);
        self.cycles.begin();
        self.renew()?;
        // Signs decide here whether there is a path at all: they are those of the data.
        self.refine()
    }

    /// Makes the basis anew, and the values from it.
    pub fn renew(&mut self) -> Result<(), &'static str> {
        const SINGULAR: &str = "the basis has become singular to working accuracy";
        self.basis.renew(&self.data, &self.basic).map_err(|_| SINGULAR)?;
        let Self { data, basis, basic, x, p, size, buffer, correction, .. } = self;
        basis.solve(data, &data.q, x);
        buffer.copy_from_slice(&data.q);
        for (&v, &x) in basic.iter().zip(x.iter()).filter(|e| *e.1 != 0.0) {
            data.add_column(v, -x, buffer);
        }
        basis.solve(data, buffer, correction);
        for ((x, dx), size) in x.iter_mut().zip(correction.iter()).zip(size.iter_mut()) {
            *x += dx;
            *size = x.abs().max(ROUNDING * dx.abs());
        }
        if self.breaking == Breaking::Perturbed {
            basis.solve(data, &data.p, p);
        }
        let fine = self.x.iter().chain(&self.size).all(|x| x.is_finite());
        fine.then_some(()).ok_or(SINGULAR)
    }

    /// Refines the values with the basis as it is, against the data; makes it anew where that does not converge.
    pub fn refine(&mut self) -> Result<(), &'static str> {
        const STEPS: usize = 3;
        const CONVERGED: f64 = 1e-12;
        for _ in 0..2 {
            let Self { data, basis, basic, x, buffer, correction, sums, size, .. } = self;
            let largest = |v: &[f64]| v.iter().fold(0.0_f64, |l, x| l.max(x.abs()));
            let mut last = f64::INFINITY;
            for _ in 0..STEPS {
                data.residual(basic, &data.q, x, sums, buffer);
                basis.solve(data, buffer, correction);
                last = largest(correction);
                if last.is_nan() || last > largest(x) {
                    break;
                }
                x.iter_mut().zip(correction.iter()).for_each(|(x, dx)| *x += dx);
                if last <= f64::EPSILON * largest(x) {
                    break;
                }
            }
            x.iter().zip(size.iter_mut()).for_each(|(x, s)| *s = x.abs());
            if last <= CONVERGED * largest(x) {
                return Ok(());
            }
            self.renew()?;
        }
        Ok(())
    }

    /// The error that one pass of the basis makes on a known vector, in units of its largest entry.
    pub fn accuracy(&mut self) -> f64 {
        let Self { data, basis, basic, buffer, correction, .. } = self;
        buffer.fill(0.0);
        let known = |slot: usize| 1.0 + (slot as f64 * 0.618_033_988_749_895).fract();
        for (slot, &v) in basic.iter().enumerate() {
            data.add_column(v, known(slot), buffer);
        }
        basis.solve(data, buffer, correction);
        let error = correction.iter().enumerate().map(|(slot, x)| (x - known(slot)).abs());
        error.fold(0.0, |l, e| if e.is_nan() { f64::INFINITY } else { l.max(e) })
    }

    /// Whether no bounded variable is negative beyond rounding.
    pub fn feasible(&self) -> bool {
        let values = self.basic.iter().zip(&self.x).zip(&self.size);
        values.into_iter().all(|((&v, &x), &s)| !self.bounded(v) || x >= -TIE * s)
    }

    /// How far the values miss the problem, as the judge has it by rows: in units of `|q_i| + Σ_j |M_ij| ‖z‖_∞`.
    pub fn violation(&mut self) -> f64 {
        let Self { data, basic, x, buffer, .. } = self;
        buffer.fill(0.0);
        for j in 0..data.n {
            data.each(j, |i, m| buffer[i] += m.abs());
        }
        // The largest z in its own unit would be the judge's; in scaled units small variables count more.
        let z = basic.iter().zip(x.iter()).filter(|e| matches!(e.0, Variable::Z(_)));
        let reach = z.fold(0.0_f64, |l, (_, x)| l.max(x.abs()));
        let mut worst = 0.0_f64;
        for (&v, &x) in basic.iter().zip(x.iter()) {
            let (i, off) = match v {
                Variable::W(i) if i < data.free => (i, x.abs()),
                Variable::Z(i) if i < data.free => continue,
                Variable::W(i) => (i, -x),
                Variable::Z(i) => (i, -x * buffer[i]),
                Variable::Artificial => continue,
            };
            let size = data.q[i].abs() + buffer[i] * reach;
            if off > 0.0 {
                worst = worst.max(off / size);
            }
        }
        worst
    }

    /// z0 enters, with the covering vector `d = B g`; g by slots, positive for bounded variables. `random` gives the perturbation of a slot.
    pub fn cover(&mut self, g: &[f64], mut random: impl FnMut() -> f64) -> Event {
        let Self { data, basic, p, .. } = self;
        data.d.fill(0.0);
        data.p.fill(0.0);
        p.fill(0.0);
        for (slot, &v) in basic.iter().enumerate() {
            let bounded = matches!(v, Variable::Z(i) | Variable::W(i) if i >= data.free);
            if bounded {
                let mut d = std::mem::take(&mut data.d);
                data.add_column(v, g[slot], &mut d);
                data.d = d;
            }
            if bounded && self.breaking == Breaking::Perturbed {
                let mut all = std::mem::take(&mut data.p);
                p[slot] = random();
                data.add_column(v, p[slot], &mut all);
                data.p = all;
            }
        }
        for slot in 0..self.x.len() {
            self.y[slot] = if self.bounded(self.basic[slot]) { -g[slot] } else { 0.0 };
        }
        // The tableau holds the column of d, too.
        if self.basis.renew(&self.data, &self.basic).is_err() {
            return Event::Trouble("the first basis is singular to working accuracy");
        }
        // z0 is the largest of −x_i/g_i: (26) with the argmax.
        let needed = |s: &usize| self.y[*s] < 0.0;
        let slots = (0..self.x.len()).filter(needed);
        let largest = slots.map(|s| self.x[s] / self.y[s]).fold(0.0_f64, f64::max);
        self.tied.clear();
        for s in 0..self.x.len() {
            if self.y[s] < 0.0
                && self.x[s] - largest * self.y[s] <= TIE * self.size[s].max(self.x[s].abs())
            {
                self.tied.push(s);
            }
        }
        if self.breaking == Breaking::Perturbed {
            let ratio = |s: usize| self.p[s] / -self.y[s];
            let least = self.tied.iter().map(|&s| ratio(s)).fold(f64::INFINITY, f64::min);
            let (p, y) = (&self.p, &self.y);
            self.tied.retain(|&s| p[s] / -y[s] <= least * (1.0 + SAME));
        }
        let chosen = match self.breaking {
            Breaking::First | Breaking::Rows => self.tied.first(),
            // The rows are unit vectors: the last one is the least.
            _ => self.tied.last(),
        };
        match chosen {
            Some(&r) => self.exchange(r, Variable::Artificial),
            None => Event::Trouble("no row is negative: nothing to cover"),
        }
    }

    /// A variable outside the basis enters next.
    pub fn drive(&mut self, v: Variable) {
        self.driving = v;
    }

    pub fn driving(&self) -> Variable {
        self.driving
    }

    /// The slot of a variable, if it is basic.
    pub fn slot(&self, v: Variable) -> Option<usize> {
        self.basic.iter().position(|&b| b == v)
    }

    /// Row `slot` of B⁻¹.
    pub fn row(&mut self, slot: usize, out: &mut [f64]) {
        self.basis.row(&self.data, slot, out);
    }

    /// The column of the last pivot or ray.
    pub fn last_column(&self) -> &[f64] {
        &self.y
    }

    /// The driving variable enters, what blocks it first leaves.
    pub fn pivot(&mut self) -> Event {
        if self.basis.age() >= self.renew_every
            && let Err(why) = self.renew()
        {
            return Event::Trouble(why);
        }
        loop {
            let Self { data, basis, y, driving, .. } = self;
            basis.column(data, *driving, y);
            let largest =
                y.iter().fold(0.0_f64, |l, y| if y.is_nan() { f64::NAN } else { l.max(y.abs()) });
            if !largest.is_finite() {
                return Event::Trouble("the basis has become singular to working accuracy");
            }
            let blocking = self.ratio_test(self.pivot_tolerance * largest);
            let sure = blocking.is_some_and(|r| self.y[r] >= SUSPECT * largest);
            if !sure && self.basis.age() > 0 {
                if let Err(why) = self.renew() {
                    return Event::Trouble(why);
                }
                continue;
            }
            return match blocking {
                Some(r) => self.exchange(r, self.driving),
                None => Event::Ray,
            };
        }
    }

    /// The slot that blocks first. A tie goes to what ends the path, then as [`Breaking`] says.
    fn ratio_test(&mut self, least: f64) -> Option<usize> {
        let mut theta = f64::INFINITY;
        for s in 0..self.x.len() {
            let y = self.y[s];
            if y > least && self.bounded(self.basic[s]) {
                theta = theta.min(self.x[s].max(0.0) / y);
            }
        }
        if theta == f64::INFINITY {
            return None;
        }
        let mut tied = std::mem::take(&mut self.tied);
        tied.clear();
        for s in 0..self.x.len() {
            let y = self.y[s];
            if y > least
                && self.bounded(self.basic[s])
                && self.x[s] - theta * y <= TIE * self.size[s].max(theta * y)
            {
                tied.push(s);
            }
        }
        let chosen = self.among(&mut tied);
        self.tied = tied;
        chosen
    }

    fn ends(&self, v: Variable) -> bool {
        match self.end {
            End::Artificial => v == Variable::Artificial,
            End::Pair(k) => v == Variable::Z(k) || v == Variable::W(k),
        }
    }

    fn among(&mut self, tied: &mut Vec<usize>) -> Option<usize> {
        let last = tied.iter().copied().find(|&s| self.ends(self.basic[s]));
        if last.is_some() || tied.len() == 1 || self.breaking == Breaking::First {
            return last.or(tied.first().copied());
        }
        if self.breaking == Breaking::Perturbed {
            let ratio = |s: usize| self.p[s] / self.y[s];
            let least = tied.iter().map(|&s| ratio(s)).fold(f64::INFINITY, f64::min);
            tied.retain(|&s| ratio(s) <= least + SAME * least.abs());
        }
        let mut best = *tied.first()?;
        if tied.len() > 1 {
            self.lexicographic(best, 0);
            for &s in &tied[1..] {
                self.lexicographic(s, 1);
                if less(&self.rows[1], &self.rows[0]) {
                    best = s;
                    self.rows.swap(0, 1);
                }
            }
        }
        Some(best)
    }

    /// Row s of B⁻¹ times the first basis, over y_s, into a buffer.
    fn lexicographic(&mut self, s: usize, which: usize) {
        let Self { data, basis, buffer, rows, start, y, .. } = self;
        basis.row(data, s, buffer);
        for (out, &v) in rows[which].iter_mut().zip(start.iter()) {
            let bounded = matches!(v, Variable::Z(i) | Variable::W(i) if i >= data.free);
            *out = if bounded { data.column_dot(v, buffer) / y[s] } else { 0.0 };
        }
    }

    fn exchange(&mut self, r: usize, entering: Variable) -> Event {
        let leaving = self.basic[r];
        let pivot = self.y[r];
        // A covering pivot is negative, as the value that it makes nonnegative.
        let theta = (self.x[r] / pivot).max(0.0);
        for s in 0..self.x.len() {
            let y = self.y[s];
            if s == r || y == 0.0 {
                continue;
            }
            let by = theta * y;
            self.size[s] = self.size[s].max(by.abs());
            let x = self.x[s] - by;
            let zero = x.abs() <= TIE * self.size[s] && self.bounded(self.basic[s]);
            self.x[s] = if zero { 0.0 } else { x };
        }
        self.x[r] = theta;
        self.size[r] = theta.max(self.size[r] / pivot.abs());
        if self.breaking == Breaking::Perturbed {
            let phi = self.p[r] / pivot;
            for s in 0..self.p.len() {
                self.p[s] -= phi * self.y[s];
            }
            self.p[r] = phi;
        }
        self.basis.exchange(r, entering, &self.y);
        self.basic[r] = entering;
        self.driving = complement(leaving);
        let exchange = Exchange { entering, leaving, ratio: theta * self.unit(entering) };
        if self.ends(leaving) {
            return Event::Ended(exchange);
        }
        if self.cycles.exchange(word_of(entering) ^ word_of(leaving)) {
            return Event::Trouble(match self.breaking {
                Breaking::First | Breaking::Rows => "it cycles: a basis has come back",
                _ => "a basis has come back: ties are decided by rounding",
            });
        }
        Event::Pivoted(exchange)
    }
}

/// Whether a is lexicographically less than b, up to rounding.
fn less(a: &[f64], b: &[f64]) -> bool {
    let size = a.iter().chain(b).fold(0.0_f64, |l, x| l.max(x.abs()));
    for (&a, &b) in a.iter().zip(b) {
        let difference = a - b;
        if difference.abs() > SAME * (a.abs() + b.abs()) + 1e-13 * size {
            return difference < 0.0;
        }
    }
    false
}

//! The judge of horizontal problems.

use crate::check::proof::{Exactly, columns, exactly_near, exacts, just, worth_a_look};
use crate::check::rows::Rows;
use crate::check::{ConeSystem, Judged, Measure, Verdict};
use crate::kinds::complementarity::judge::{
    Noise, Pair, ROUNDING, RowCounts, RowStatus, Sum, distance, find_effects, find_units, finite,
    floor, matters, put, rounding, share, unseen, verdict,
};
use crate::{Hlcp, HlcpPoint, Problem};
use nonsmooth_linalg::{Matrix, norm};

/// The judge's constants and buffers for a horizontal LCP.
///
/// As for [`LinearGauge`](crate::check::LinearGauge): the rows `Q x + R s − q` are equalities with `D_i = min(Σ_j |Q_ij||x_j| + Σ_j |R_ij||s_j| + |q_i|, ω_i)`, and a pair is as good as the
/// better one of x and s is zero: `min(max_k |Q_kj| x_j / D_k, max_k |R_kj| s_j / D_k)`. `absolute` is that of the equalities and of `min(c_j x_j, d_j s_j)`, with
/// `c_j`, `d_j` the largest moduli in column j of Q and R. The rows of pairs follow those of the equalities.
#[derive(Debug, Clone, Default)]
pub struct HlcpGauge {
    norm_q: f64,
    c: Vec<f64>,
    d: Vec<f64>,
    units: Vec<f64>,
    columns: [Vec<f64>; 2],
    closed: bool,
    scales: Vec<f64>,
    effects: [Vec<f64>; 2],
    w: Vec<f64>,
    noise: Noise,
    rows: Rows,
}

impl HlcpGauge {
    pub(crate) fn new(problem: &Hlcp) -> Self {
        let mut gauge = Self::default();
        gauge.refill(problem);
        gauge
    }

    pub(crate) fn refill(&mut self, problem: &Hlcp) {
        let n = problem.q.len();
        self.norm_q = norm(&problem.q);
        for (m, size) in [(&problem.Q, &mut self.c), (&problem.R, &mut self.d)] {
            size.clear();
            size.resize(m.ncols(), 0.0);
            m.for_each(|_, j, x| size[j] = size[j].max(x.abs()));
            size.iter_mut().filter(|x| **x == 0.0).for_each(|x| *x = 1.0);
        }
        for v in self.effects.iter_mut().chain([&mut self.w, &mut self.scales]) {
            v.resize(n, 0.0);
        }
        for v in &mut self.columns {
            v.clear();
            v.resize(n, 0.0);
        }
        self.units.clear();
        self.units.extend(problem.q.iter().map(|q| q.abs()));
        let [of_q, of_r] = &mut self.columns;
        let parts = [&problem.Q, &problem.R];
        let (units, room) = (&mut self.units, &mut self.w);
        self.closed = find_units(&parts, units, &mut [of_q, of_r], &mut self.noise, room);
        // Room that served for columns.
        self.w.resize(n, 0.0);
        self.rows.start(&problem.q);
    }

    pub(crate) fn measure(
        &mut self,
        problem: &Hlcp,
        point: &HlcpPoint,
        precisely: bool,
    ) -> Measure {
        if !(finite(&point.x) && finite(&point.s)) {
            return Measure::unknown();
        }
        let parts = [(&problem.Q, &point.x), (&problem.R, &point.s)];
        self.rows.precisely(precisely);
        self.rows.start_at_zero(problem.q.len());
        self.w.iter_mut().zip(&problem.q).for_each(|(w, q)| *w = -q);
        self.rows.add_vector(&self.w);
        for (m, x) in parts {
            if !self.rows.add_matrix(1.0, m, x) {
                m.mul(x, &mut self.w);
                self.rows.add_vector(&self.w);
            }
        }
        self.w.iter_mut().zip(self.rows.values()).for_each(|(w, sum)| *w = sum);
        let operators = parts.iter().any(|(m, _)| matches!(m, Matrix::Operator(_)));
        let terms = self.rows.sizes().iter().zip(&self.units);
        for (d, (terms, unit)) in self.scales.iter_mut().zip(terms) {
            *d = if operators { *terms } else { terms.min(*unit) };
        }
        let mut visible = true;
        for ((m, x), effects) in parts.into_iter().zip(&mut self.effects) {
            if let Matrix::Operator(_) = m {
                effects.iter_mut().zip(&self.scales).for_each(|(e, d)| *e = 1.0 / d);
            } else {
                visible &= find_effects(m, x, &self.scales, effects);
            }
        }
        let mut sum = Sum::new(self.norm_q);
        for (i, (&w, &scale)) in self.w.iter().zip(&self.scales).enumerate() {
            sum.equality(i, w, share(w, scale));
        }
        let n = self.w.len();
        for i in 0..n {
            let (pair, d) = (self.pair(point, i), self.d[i]);
            sum.pair(n + i, &Pair { w: d * pair.w, ..pair }, self.c[i]);
        }
        let measure = Measure { floor: precisely.then(|| self.floor()), ..sum.measure() };
        let exactly = |error| is_rounded_pair(problem, point, error);
        let measure = if visible { measure } else { unseen(measure, precisely, exactly) };
        rounding(measure, 2 * n + 1, exactly)
    }

    fn floor(&self) -> f64 {
        floor(self.rows.sizes(), &self.scales)
    }

    fn pair(&self, point: &HlcpPoint, i: usize) -> Pair {
        let (x, s) = (point.x[i], point.s[i]);
        let [effect, of_s] = [self.effects[0][i], self.effects[1][i]];
        Pair { z: x, l: 0.0, u: f64::INFINITY, w: s, error: distance(s.abs(), of_s), effect }
    }

    /// As [`LinearGauge`](crate::check::LinearGauge)'s: of each pair the side is put to zero whose size matters less, and what is negative.
    pub(crate) fn tidy(&self, point: &mut HlcpPoint, boldly: bool) -> bool {
        let mut changed = false;
        let [of_x, of_s] = if boldly { &self.columns } else { &self.effects };
        for i in 0..self.w.len() {
            let (x, s) = (point.x[i].max(0.0), point.s[i].max(0.0));
            let (by_x, by_s) = (matters(x, of_x[i]), matters(s, of_s[i]));
            let (x, s) = if boldly && by_x.max(by_s) <= ROUNDING && self.closed {
                (0.0, 0.0)
            } else if by_x <= by_s {
                (0.0, s)
            } else {
                (x, 0.0)
            };
            changed |= put(x, &mut point.x[i]);
            changed |= put(s, &mut point.s[i]);
        }
        changed
    }
}

/// The same of a horizontal problem.
fn is_rounded_pair(problem: &Hlcp, HlcpPoint { x, s }: &HlcpPoint, error: f64) -> bool {
    let n = x.len();
    let mut rows = vec![vec![]; n];
    let known = worth_a_look(2 * n, error)
        && problem.Q.for_each(|i, j, a| rows[i].push((j, a)))
        && problem.R.for_each(|i, j, a| rows[i].push((n + j, a)));
    let complementary = x.iter().zip(s).all(|(x, s)| x.min(*s) == 0.0);
    if !(known && complementary) {
        return false;
    }
    let values = [&x[..], s].concat();
    let movable: Vec<bool> = values.iter().map(|x| *x > 0.0).collect();
    let equations = rows.into_iter().zip(&problem.q).map(|(row, q)| (row, -q));
    // Within the last bit of a positive number all are positive.
    exactly_near(equations.collect(), &values, &movable).is_some()
}

impl Judged for Hlcp {
    type Status = RowStatus;
    type Counts = RowCounts;

    /// The counts are those of the pairs; what is called w here is `Q x + R s − q`.
    fn verdict(
        &self,
        point: &HlcpPoint,
        gauge: &mut HlcpGauge,
        tolerance: f64,
    ) -> Verdict<RowStatus, RowCounts> {
        let measure = self.certify(point, gauge);
        let equalities = gauge.w.iter().zip(&gauge.scales).map(|(w, d)| Err(share(*w, *d)));
        let pairs = (0..self.dim()).map(|i| Ok(gauge.pair(point, i)));
        verdict(measure, equalities.chain(pairs), gauge.w.clone(), tolerance)
    }
}

/// `Q x + R s = q`.
impl Exactly for Hlcp {
    fn system(&self, wanted: Option<&[bool]>) -> Option<ConeSystem> {
        let mut system = ConeSystem::new(exacts(&self.q), wanted);
        let [x, s] = [&self.Q, &self.R].map(|m| columns(m, 1, &|i| system.wants(i)));
        let x: Vec<_> = x?.into_iter().map(|c| system.column(c)).collect();
        let s: Vec<_> = s?.into_iter().map(|c| system.column(c)).collect();
        system.unknowns = x.iter().chain(&s).map(|&j| just(j)).collect();
        system.pairs = x.into_iter().zip(s).map(|(x, s)| [x, s]).collect();
        Some(system)
    }

    fn rows(&self) -> usize {
        self.q.len()
    }
}

//! The judge of nonlinear problems.

use super::super::judge::{
    Pair, finite, hand_on, lesser, natural, put, share, size_of_row, verdict, worse,
};
use super::Mcp;
use crate::LcpPoint;
use crate::Problem;
use crate::check::{Measure, RowCounts, RowStatus, Verdict};
use crate::field::Evaluator;

/// The judge's constants and buffers for a nonlinear problem.
///
/// The error of row i is `|F_i| / D_i` (0/0 = 0), where D_i is the size of the row's terms at x: of a polynomial the sum of the moduli of its monomials, of
/// other expressions the same to first order, of functions without expressions `|F_i − Σ_j J_ij x_j| + Σ_j |J_ij x_j|`; of rows that vanish with all their terms at least
/// a ten-thousandth of ω_i, the size at the start or, where that is zero, what a change of the other rows by their own ω makes of the row through the variables that they share; of expressions
/// the size at the point nearest to zero that the bounds allow, if that is smaller: a start far off makes nothing small. That a variable is d away from a bound
/// counts as much as what it does to the rows, `max_k |J_kj| d / D_k`; where the Jacobian does not see it, d over the largest of `|x_j|`, `|start_j|` and the
/// finite bounds. Therefore neither changes when rows or variables are multiplied by numbers.
///
/// | field of [`Measure`] | formula |
/// | --- | --- |
/// | `primal` | the largest error of a variable beyond a bound |
/// | `dual` | the largest error of an F whose sign no bound allows |
/// | `complementarity` | the largest error of a pair: the smaller of that of F and that of the distance from the bound that the sign of F asks for |
/// | `relative` | the largest of the three; **decides** |
/// | `own` | the largest `|F_i|` of those errors in units of ω_i (near zero beyond what the last bits of x make of it): x that runs away excuses nothing |
/// | `absolute`, `literature`, `siconos` | the natural residual `‖x − mid(l, u, x − F(x))‖_∞` |
///
/// [`certify`](Problem::certify) evaluates sums, products, quotients and roots of expressions in doubled precision.
pub struct McpGauge {
    field: Box<dyn Evaluator>,
    f: Vec<f64>,
    jacobian: Vec<f64>,
    /// D at the point last measured.
    scales: Vec<f64>,
    /// ω, and what it is at the point nearest to zero that the bounds allow; zero where that is not known.
    units: Vec<f64>,
    near: Vec<f64>,
    /// The unit of each variable, but for its own value.
    lengths: Vec<f64>,
    /// What a distance counts at the point last measured.
    effects: Vec<f64>,
}

impl McpGauge {
    pub(super) fn new(problem: &Mcp) -> Self {
        let n = problem.dim();
        let finite = |x: f64| if x.is_finite() { x.abs() } else { 0.0 };
        let start = problem.origin().z;
        let length =
            |i: usize| finite(problem.lower[i]).max(finite(problem.upper[i])).max(start[i].abs());
        let mut gauge = Self {
            field: problem.F.evaluator(),
            f: vec![0.0; n],
            jacobian: vec![0.0; problem.F.pattern().len()],
            scales: vec![0.0; n],
            units: vec![],
            near: vec![0.0; n],
            lengths: (0..n).map(length).collect(),
            effects: vec![0.0; n],
        };
        gauge.units = vec![0.0; n];
        gauge.look(problem, &start, false);
        let own = gauge.scales.clone();
        gauge.units = own.clone();
        hand_on(&mut gauge.units, problem.F.pattern(), &gauge.jacobian);
        // Where no function of a caller's is asked: it may know the neighbourhood of the start alone.
        let near = problem.lower.iter().zip(&problem.upper).map(|(l, u)| 0.0_f64.max(*l).min(*u));
        let near: Vec<f64> = near.collect();
        if problem.F.expressions().is_some() && near != start {
            let units = std::mem::replace(&mut gauge.units, vec![0.0; n]);
            if gauge.look(problem, &near, false) {
                gauge.near = gauge.scales.clone();
                hand_on(&mut gauge.near, problem.F.pattern(), &gauge.jacobian);
                // What neighbours hand on depends on the Jacobian there: it replaces no unit of the same kind.
                let handed = gauge.near.iter_mut().zip(&own).filter(|(_, own)| **own == 0.0);
                handed.for_each(|(near, _)| *near = 0.0);
            }
            gauge.units = units;
        }
        gauge
    }

    /// F, D and what distances count at x. False where F is not defined.
    fn look(&mut self, problem: &Mcp, x: &[f64], precisely: bool) -> bool {
        let Self { field, f, jacobian, scales, units, near, lengths, effects } = self;
        let pattern = problem.F.pattern();
        let smooth = field.jacobian(x, f, jacobian);
        let defined = match (precisely, smooth) {
            (true, _) => field.precisely(x, f),
            (false, true) => true,
            (false, false) => field.value(x, f),
        };
        if !defined {
            scales.fill(0.0);
            return false;
        }
        if !field.sizes(x, scales) {
            for i in 0..f.len() {
                let terms = || jacobian[pattern.range(i)].iter().zip(pattern.row(i));
                let linear: f64 = terms().map(|(a, &j)| a * x[j]).sum();
                let sizes: f64 = terms().map(|(a, &j)| (a * x[j]).abs()).sum();
                scales[i] = if smooth { (f[i] - linear).abs() + sizes } else { 0.0 };
            }
        }
        for (i, (d, f)) in scales.iter_mut().zip(&*f).enumerate() {
            *d = size_of_row(*d, *f).max(VANISHING * lesser(units[i], near[i]));
        }
        effects.fill(0.0);
        if smooth {
            for (i, d) in scales.iter().enumerate().filter(|(_, d)| **d > 0.0) {
                for (a, &j) in jacobian[pattern.range(i)].iter().zip(pattern.row(i)) {
                    effects[j] = effects[j].max(a.abs() / d);
                }
            }
        }
        for (j, effect) in effects.iter_mut().enumerate().filter(|(_, e)| **e == 0.0) {
            let length = lengths[j].max(x[j].abs());
            *effect = if length > 0.0 { 1.0 / length } else { 0.0 };
        }
        true
    }

    pub(super) fn measure(&mut self, problem: &Mcp, point: &LcpPoint, precisely: bool) -> Measure {
        let x = &point.z;
        if !finite(x) {
            return Measure::unknown();
        }
        if !self.look(problem, x, precisely) {
            return Measure::never();
        }
        let mut measure = Measure {
            absolute: 0.0,
            relative: 0.0,
            primal: 0.0,
            dual: 0.0,
            complementarity: 0.0,
            own: Some(0.0),
            worst: -1.0,
            ..Measure::never()
        };
        let mut own: f64 = 0.0;
        for i in 0..x.len() {
            let pair = self.pair(problem, x, i);
            let residual = natural(x[i], self.f[i], pair.l, pair.u).abs();
            measure.absolute = worse(measure.absolute, residual);
            measure.primal = worse(measure.primal, pair.primal());
            measure.dual = worse(measure.dual, pair.dual());
            measure.complementarity = worse(measure.complementarity, pair.complementarity());
            let worst = pair.worst();
            if worst > measure.worst || worst.is_nan() {
                (measure.worst_contact, measure.worst) = (i, worst);
            }
            // The error of F, where that is the error of the pair.
            let of_f = pair.dual().max(pair.complementarity());
            let unit = self.units[i];
            if of_f >= pair.error && unit > 0.0 {
                let (mut share_of_own, near) = (share(self.f[i], unit), self.near[i]);
                if near > 0.0 && near < unit {
                    // What no double near x does better is no error.
                    let beyond = (self.f[i].abs() - 4.0 * self.rounding(problem, x, i)).max(0.0);
                    share_of_own = share_of_own.max(share(beyond, near));
                }
                if share_of_own > own {
                    (own, measure.own_contact) = (share_of_own, Some(i));
                }
            }
        }
        measure.own = Some(own);
        measure.relative = worse(worse(measure.primal, measure.dual), measure.complementarity);
        (measure.literature, measure.siconos) = (measure.absolute, measure.absolute);
        measure.floor = precisely.then(|| self.floor(problem, x));
        measure
    }

    /// Row i at the point last looked at.
    fn pair(&self, problem: &Mcp, x: &[f64], i: usize) -> Pair {
        let (w, error) = (self.f[i], share(self.f[i], self.scales[i]));
        let (l, u) = (problem.lower[i], problem.upper[i]);
        Pair { z: x[i], l, u, w, error, effect: self.effects[i] }
    }

    /// The largest error that a change of all variables by half their last bit makes.
    fn floor(&self, problem: &Mcp, x: &[f64]) -> f64 {
        let scaled = self.scales.iter().enumerate().filter(|(_, d)| **d > 0.0);
        scaled.fold(0.0, |most, (i, d)| most.max(self.rounding(problem, x, i) / d))
    }

    /// What such a change makes of `F_i`.
    fn rounding(&self, problem: &Mcp, x: &[f64], i: usize) -> f64 {
        let pattern = problem.F.pattern();
        let terms = self.jacobian[pattern.range(i)].iter().zip(pattern.row(i));
        0.5 * f64::EPSILON * terms.map(|(a, &j)| (a * x[j]).abs()).sum::<f64>()
    }

    pub(super) fn tidy(&self, problem: &Mcp, point: &mut LcpPoint, boldly: bool) -> bool {
        let mut changed = false;
        for i in 0..point.z.len() {
            let pair = self.pair(problem, &point.z, i);
            let scale = self.scales[i];
            let x = match boldly {
                false => pair.tidied(),
                true => {
                    let size = if scale > 0.0 { 1.0 / scale } else { 0.0 };
                    pair.boldly_tidied(self.effects[i], size)
                }
            };
            changed |= put(x, &mut point.z[i]);
        }
        changed
    }

    pub(super) fn verdict(
        &mut self,
        problem: &Mcp,
        point: &LcpPoint,
        tolerance: f64,
    ) -> Verdict<RowStatus, RowCounts> {
        let measure = problem.certify(point, self);
        let rows = (0..problem.dim()).map(|i| {
            let pair = self.pair(problem, &point.z, i);
            let bounded = pair.l.is_finite() || pair.u.is_finite();
            if bounded { Ok(pair) } else { Err(pair.worst()) }
        });
        verdict(measure, rows, self.f.clone(), tolerance)
    }
}

/// The part of ω that a row's terms count at least.
const VANISHING: f64 = 1e-4;

//! The judge of nonlinear problems.

use super::super::judge::{
    NEVER, Pair, Terms, Units, finite, natural, put, reach, share, verdict, worse,
};
use super::Mcp;
use crate::LcpPoint;
use crate::Problem;
use crate::check::{Measure, RowCounts, RowStatus, Verdict};
use crate::field::tentatively;

/// The judge's constants and buffers for a nonlinear problem.
///
/// The error of row i is `|F_i| / D_i` (0/0 = 0), where D_i is the size of the row's terms at x: of a polynomial the sum of the moduli of its monomials, of
/// other expressions the same to first order, of functions without expressions `|F_i − Σ_j J_ij x_j| + Σ_j |J_ij x_j|` (where F does not change as J says, `|F_i|` and its change along a vector of the size of x, if that is smaller); of rows that vanish with all their terms at least
/// a ten-thousandth of ω_i, the size at the start or, where that is zero, what a change of the other rows by their own ω makes of the row through the variables that they share, as far as those reach (the smaller modulus of a variable's bounds that is not zero) and no more than the other rows' sizes at x make of it; or
/// the size at the point nearest to zero that the bounds allow, or far beyond the start, if that is smaller; where a row is smaller than that ten-thousandth, also the size on the way to these points where it no longer falls, what its last power there makes of it where it leaves that (at the start, if nowhere), or the size where the variables are as large as rows with a constant tie them, if that is a smaller
/// part: a start far off, or near a pole at zero, makes nothing small. Of a row that along a change of x by a
/// thousandth does not change as J says, that change counts in place of the terms that it should have had. That a variable is d away from a bound
/// counts as much as what it does to the rows, `max_k |J_kj| d / D_k`; where the Jacobian does not see it, d over the largest of `|x_j|`, `|start_j|` and the modulus of
/// that bound, or, beyond it, over the larger of `|x_j|` and its modulus alone. Therefore neither changes when rows or variables are multiplied by numbers.
///
/// | field of [`Measure`] | formula |
/// | --- | --- |
/// | `primal` | the largest error of a variable beyond a bound |
/// | `dual` | the largest error of an F whose sign no bound allows |
/// | `complementarity` | the largest error of a pair: the smaller of that of F and that of the distance from the bound that the sign of F asks for |
/// | `relative` | the largest of the three; **decides** |
/// | `own` | the largest `|F_i|` of those errors in units of ω_i (near zero beyond what the last bits of x make of it): x that runs away excuses nothing; where the error is that of a distance, the smaller of that of F and the distance over the larger of `|start_j|` and the modulus of the bound, and all errors at the point with these variables on their bounds, the distances by what they do there |
/// | `absolute`, `literature`, `siconos` | the natural residual `‖x − mid(l, u, x − F(x))‖_∞` |
///
/// [`certify`](Problem::certify) evaluates sums, products, quotients and roots of expressions in doubled precision.
pub struct McpGauge {
    terms: Terms,
    /// D at the point last measured.
    scales: Vec<f64>,
    units: Units,
    /// `|start|`
    lengths: Vec<f64>,
    /// What a distance counts at the point last measured.
    effects: Vec<f64>,
    /// That point with the variables on their bounds whose distance from them is their error.
    bounded: Vec<f64>,
}

/// The unit of a variable, but for its own value: the larger of its start and a bound.
fn unit_of(start: f64, bound: f64) -> f64 {
    if bound.is_finite() { start.max(bound.abs()) } else { start }
}

/// No tolerance is larger: F is not asked on the bounds at points that no one accepts.
const LOOSEST: f64 = 0.1;

impl McpGauge {
    pub(super) fn new(problem: &Mcp) -> Self {
        let n = problem.dim();
        let start = problem.origin().z;
        let bounds = || problem.lower.iter().zip(&problem.upper);
        let zero = bounds().map(|(l, u)| 0.0_f64.max(*l).min(*u)).collect();
        let reach = start.iter().zip(bounds()).map(|(s, (l, u))| reach(*s, *l, *u)).collect();
        let mut terms = Terms::new(&*problem.F);
        Self {
            units: Units::new(&*problem.F, &mut terms, &start, zero, reach),
            terms,
            scales: vec![0.0; n],
            lengths: start.iter().map(|s| s.abs()).collect(),
            effects: vec![0.0; n],
            bounded: vec![0.0; n],
        }
    }

    /// F, D and what distances count at x. False where F is not defined.
    fn look(&mut self, problem: &Mcp, x: &[f64], precisely: bool) -> bool {
        let Self { terms, scales, units, lengths, effects, .. } = self;
        let pattern = problem.F.pattern();
        if !units.look(&*problem.F, terms, x, precisely) {
            scales.fill(0.0);
            return false;
        }
        for (i, (d, size)) in scales.iter_mut().zip(&terms.sizes).enumerate() {
            *d = size.max(units.least(i));
        }
        effects.fill(0.0);
        if terms.smooth {
            for (i, d) in scales.iter().enumerate().filter(|(_, d)| **d > 0.0) {
                for (a, &j) in terms.jacobian[pattern.range(i)].iter().zip(pattern.row(i)) {
                    effects[j] = effects[j].max(a.abs() / d);
                }
            }
        }
        for (j, effect) in effects.iter_mut().enumerate().filter(|(_, e)| **e == 0.0) {
            // A bound that nothing asks for, however far, makes no distance small; nor does a start what lies beyond a bound.
            let nearest = x[j].max(problem.lower[j]).min(problem.upper[j]);
            let towards = if terms.f[j] > 0.0 { problem.lower[j] } else { problem.upper[j] };
            let length = match nearest == x[j] {
                true => unit_of(lengths[j], towards).max(x[j].abs()),
                false => nearest.abs().max(x[j].abs()),
            };
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
            let residual = natural(x[i], pair.w, pair.l, pair.u).abs();
            measure.absolute = worse(measure.absolute, residual);
            measure.primal = worse(measure.primal, pair.primal());
            measure.dual = worse(measure.dual, pair.dual());
            measure.complementarity = worse(measure.complementarity, pair.complementarity());
            let worst = pair.worst();
            if worst > measure.worst || worst.is_nan() {
                (measure.worst_contact, measure.worst) = (i, worst);
            }
            let (unit, near) = self.units.at(i, self.terms.sizes[i]);
            if unit.is_nan() || unit <= 0.0 {
                continue;
            }
            let mut share_of_own = share(pair.w, unit);
            if pair.is_excused() {
                // Nor is a distance none for a derivative that hardly feels it, where F is as large as it was: on the bound F may be another.
                let length = unit_of(self.lengths[i], pair.towards());
                let way = (pair.z - pair.towards()).abs() / length;
                share_of_own = if length > 0.0 { share_of_own.min(way) } else { 0.0 };
            } else if near > 0.0 && near < unit {
                // What no double near x does better is no error.
                let rounding = self.terms.rounding(problem.F.pattern(), x, i);
                let beyond = (pair.w.abs() - 4.0 * rounding).max(0.0);
                share_of_own = share_of_own.max(share(beyond, near));
            }
            if share_of_own > own {
                (own, measure.own_contact) = (share_of_own, Some(i));
            }
        }
        measure.floor = precisely.then(|| self.floor(problem, x));
        let passes = [measure.primal, measure.dual, measure.complementarity];
        if precisely && passes.into_iter().all(|error| error <= LOOSEST) {
            let (there, worst) = self.at_bounds(problem, x);
            if there > own {
                (own, measure.own_contact) = (there, Some(worst));
            }
        }
        // What is not known cannot be held against the point, nor the point be accepted without it.
        measure.own = Some(if precisely && self.units.cut_short { NEVER } else { own });
        measure.relative = worse(worse(measure.primal, measure.dual), measure.complementarity);
        (measure.literature, measure.siconos) = (measure.absolute, measure.absolute);
        measure
    }

    /// The largest error at the point y, x with the variables on their bounds whose nearness excuses their rows, or distance of y from x by what it does there, and its row: where F
    /// hardly feels a distance, as in the flat tail of an exponential, it may yet be another on the bound. Nothing where F is not defined there, or y is x, the point last looked at.
    fn at_bounds(&mut self, problem: &Mcp, x: &[f64]) -> (f64, usize) {
        let mut y = std::mem::take(&mut self.bounded);
        for (i, y) in y.iter_mut().enumerate() {
            let pair = self.pair(problem, x, i);
            let at = if pair.is_excused() { pair.towards() } else { x[i] };
            *y = at.max(pair.l).min(pair.u);
        }
        let worst = if y == x { (0.0, 0) } else { self.instead(problem, x, &y) };
        self.bounded = y;
        worst
    }

    /// What [`at_bounds`](Self::at_bounds) finds at y; looks at x again.
    fn instead(&mut self, problem: &Mcp, x: &[f64], y: &[f64]) -> (f64, usize) {
        let mut worst = (0.0, 0);
        if tentatively(|| self.look(problem, y, true)) {
            for i in 0..y.len() {
                let moved = share((x[i] - y[i]).abs() * self.effects[i], 1.0);
                let error = self.pair(problem, y, i).worst().max(moved);
                worst = if error > worst.0 { (error, i) } else { worst };
            }
        }
        let cut_short = self.units.cut_short;
        self.look(problem, x, true);
        self.units.cut_short |= cut_short;
        worst
    }

    /// Row i at the point last looked at.
    fn pair(&self, problem: &Mcp, x: &[f64], i: usize) -> Pair {
        let w = self.terms.f[i];
        let error = share(w, self.scales[i]);
        let (l, u) = (problem.lower[i], problem.upper[i]);
        Pair { z: x[i], l, u, w, error, effect: self.effects[i] }
    }

    /// The largest error that a change of all variables by half their last bit makes.
    fn floor(&self, problem: &Mcp, x: &[f64]) -> f64 {
        let scaled = self.scales.iter().enumerate().filter(|(_, d)| **d > 0.0);
        let rounding = |i: usize| self.terms.rounding(problem.F.pattern(), x, i);
        scaled.fold(0.0, |most, (i, d)| most.max(rounding(i) / d))
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
        verdict(measure, rows, self.terms.f.clone(), tolerance)
    }
}

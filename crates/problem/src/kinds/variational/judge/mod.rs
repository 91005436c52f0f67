//! The judge of variational inequalities.

mod projection;

use nonsmooth_linalg::{Groups, budget};
use serde::Serialize;

use super::{Set, Vi};
use crate::LcpPoint;
use crate::Problem;
use crate::check::{Measure, Verdict};
use crate::field::tentatively;
use crate::kinds::complementarity::judge::{
    NEVER, Terms, Units, lesser, natural, reach, to_the_edge,
};
pub(super) use projection::Projection;

/// Where x is with respect to a constraint of the set: a bounded variable of a box, an inequality of a polyhedron, a ball, a cone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SetStatus {
    /// Away from the border.
    Inside,
    /// On it.
    Border,
    /// At the point of a cone.
    Apex,
}

/// How many constraints of the set are where.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct SetCounts {
    /// Away from the border.
    pub inside: usize,
    /// On it, the points of cones included.
    pub border: usize,
}

/// The judge's constants and buffers for a variational inequality.
///
/// `r = x − P_X(x − γ F(x))` vanishes at solutions, for any γ > 0. It is taken with `γ = ξ/φ` and divided by ξ, where ξ is the size of x (the largest modulus in x, in the projection of the start onto X and in
/// [`Set::size`]; where all are zero, φ and γ = 1; a start or a set that is ten thousand times as large as x, the other one and the length that F has near zero, its terms there over their slopes, counts as large as
/// these only: a bound of 1e20 is none) and φ that of F (the largest size of a row's terms at x, as the [`McpGauge`](crate::check::McpGauge) has it; at least a ten-thousandth of that at the start). So it does not change
/// where F, or x with the set, is multiplied by a positive number. Variables and rows of one problem share their unit: a set that mixes variables knows no other.
///
/// | field of [`Measure`] | formula |
/// | --- | --- |
/// | `primal` | how far x violates a constraint: of a bound, a half-space, a ball the distance from it, of a cone `(‖x̄‖ − x_1)/√2`; the largest over ξ |
/// | `dual`, `relative` | `‖r‖_∞ / ξ`, and what the projection violates added; **decides** |
/// | `complementarity` | `|F(x)ᵀ r| / (n φ ξ)` |
/// | `own` | the same residual of each part of the set (each variable of a box, the variables that rows of a polyhedron join) by itself, with the φ of its rows at the start or at zero, the smaller: x that runs away, or larger rows, excuse nothing. Where x is inside of all that joins a variable to others, by a thousandth of ξ, also `|F_i|` (but for what the last bits of x make of it) over the φ of that row alone |
/// | `absolute`, `literature`, `siconos` | `‖x − P_X(x − F(x))‖_∞` |
///
/// The projections are the judge's own: of cones in the half-plane of the axis and the norm of the rest, of polyhedra by nonnegative least squares
/// (LawsonHanson1974, ch. 23) or, of many rows with few entries, by the proximal method of multipliers with Newton steps (Rockafellar1976), exact but for rounding after finitely many steps. [`certify`](Problem::certify) evaluates expressions in doubled precision.
pub struct ViGauge {
    terms: Terms,
    /// φ that is known beforehand, of each row and of all.
    units: Units,
    /// `x − γ F`, and its projection.
    from: Vec<f64>,
    y: Vec<f64>,
    /// x less the projection, of boxes to the last digit.
    moved: Vec<f64>,
    kept: Vec<f64>,
    /// For γ = 1 and for the two others: the points to be projected are far from each other, the active rows too.
    projections: [Vec<Projection>; 3],
    /// The variables that each part of the set ties to each other, counted from its first: those of a polyhedron that no chain of rows joins are projected each by itself.
    tied: Vec<Vec<Vec<usize>>>,
    /// The projection of the start.
    start: Vec<f64>,
    /// Whether it is known, or that there is none.
    projected: bool,
    /// The sizes of it and of the set, and the length that F has near zero.
    size_of_start: f64,
    size_of_set: f64,
    length: Length,
    /// How they count at the point last looked at.
    known: Known,
    /// The time was over before all was known that this point is to be measured by.
    cut_short: bool,
    /// γ of each variable.
    gammas: Vec<f64>,
}

/// What a solution is held by: where it is the projection of, and which rows of polyhedra hold it back.
#[derive(Debug, Clone, PartialEq)]
pub struct Held {
    /// `x − γ F(x)`, whose projection x is.
    pub from: Vec<f64>,
    /// γ
    pub gamma: f64,
    /// ξ, the size of x; both as the [`ViGauge`] has them.
    pub size: f64,
    /// Of each part of the set that is no product the rows of `[A; C]`, ascending, whose multipliers may be other than zero: equations, and inequalities that the projection meets with a force; of dependent ones some that are
    /// not. Empty where the part is no polyhedron.
    pub rows: Vec<Vec<usize>>,
}

/// The length that F has near zero, where only this tells whether the start or the set is far off.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Length {
    NotAsked,
    /// Neither F nor its slopes are known there.
    Unknown,
    Known(f64),
}

/// The sizes of start and set as they count at a point.
#[derive(Debug, Clone, Copy, Default)]
struct Known {
    start: f64,
    set: f64,
}

impl Known {
    fn size(self) -> f64 {
        self.start.max(self.set)
    }
}

/// A residual below which each part is looked at by itself.
const LOOKED_AT: f64 = 1e-3;

/// So far from the border, in parts of the size of x, a point is inside.
const INSIDE: f64 = 1e-3;

/// The part of the size of the start and the set that each part of x has at least.
const OF_OTHERS: f64 = 1e-4;
/// A start or a set that is so many times as large as all else is far off.
const FAR_OFF: f64 = 1e4;
/// How near to zero, in parts of the start and powers of two, a function without expressions is asked for its length, as long as that falls.
const NEAR: [i32; 6] = [60, 120, 240, 480, 720, 1020];

impl ViGauge {
    pub(super) fn new(problem: &Vi) -> Self {
        let n = problem.dim();
        let zeros = || vec![0.0; n];
        let mut terms = Terms::new(&*problem.F);
        let mut out = Self {
            units: Units::new(&*problem.F, &mut terms, &problem.start, zeros(), reaches(problem)),
            terms,
            from: zeros(),
            y: zeros(),
            moved: zeros(),
            kept: zeros(),
            projections: [0, 1, 2]
                .map(|_| problem.set.parts().iter().map(|(_, set)| Projection::new(set)).collect()),
            tied: problem.set.parts().iter().map(|(_, set)| tied(set)).collect(),
            size_of_start: 0.0,
            size_of_set: problem.set.size(),
            start: problem.start.clone(),
            projected: false,
            length: Length::NotAsked,
            known: Known::default(),
            cut_short: false,
            gammas: zeros(),
        };
        out.project_start(problem);
        out
    }

    /// The projection of the start, where the set has one.
    fn project_start(&mut self, problem: &Vi) {
        self.start.clone_from(&problem.start);
        self.projected = true;
        for (first, set) in problem.set.parts() {
            let range = first..first + set.dim();
            let from = &problem.start[range.clone()];
            if violation(set, from) == 0.0 {
                continue;
            }
            let mut y = vec![0.0; range.len()];
            if Projection::new(set).onto(set, from, from, &mut y) && y.iter().all(|y| y.is_finite())
            {
                self.start[range].copy_from_slice(&y);
            } else if budget::over() {
                // Another time: until then nothing is decided.
                self.projected = false;
            }
        }
        self.size_of_start = largest(&self.start);
    }

    /// F at x, and φ. `None` where F is not defined.
    fn look(&mut self, problem: &Vi, x: &[f64], precisely: bool) -> Option<f64> {
        if !self.projected {
            self.project_start(problem);
        }
        self.cut_short = !self.projected;
        self.known = self.count(problem, largest(x));
        let Self { terms, units, cut_short, .. } = self;
        let defined = units.look(&*problem.F, terms, x, precisely);
        *cut_short |= units.cut_short;
        defined.then(|| largest(&terms.sizes).max(units.least_of_all()))
    }

    /// How start and set count at a point of this size: far beyond all else, F's length near zero included, as large as that.
    fn count(&mut self, problem: &Vi, size: f64) -> Known {
        let (start, set) = (self.size_of_start, self.size_of_set);
        let all = Known { start, set };
        let is_far = |one: f64, others: f64| one > FAR_OFF * others;
        if !is_far(start, size.max(set)) && !is_far(set, size.max(start)) {
            return all;
        }
        if self.length == Length::NotAsked {
            match self.length_of(problem) {
                Some(length) => self.length = length,
                // Another time: until then nothing is decided.
                None => self.cut_short = true,
            }
        }
        let Length::Known(length) = self.length else { return all };
        let base = size.max(length);
        if base == 0.0 {
            return all;
        }
        let near = if is_far(set, base) { base } else { base.max(set) };
        let start = if is_far(start, near) { near } else { start };
        let near = base.max(start);
        Known { start, set: if is_far(set, near) { near } else { set } }
    }

    /// The size of F's terms near zero over their slopes. `None` where the time is over.
    fn length_of(&mut self, problem: &Vi) -> Option<Length> {
        let mut over = false;
        let Self { terms, start, size_of_start, .. } = self;
        let pattern = problem.F.pattern();
        let at_zero = problem.F.expressions().is_some() || *size_of_start == 0.0;
        let parts = NEAR.map(|k| 2.0_f64.powi(-k));
        let parts = if at_zero { &[0.0][..] } else { &parts };
        let mut length_at = |part: f64| {
            let near: Vec<f64> = start.iter().map(|s| part * s).collect();
            over |= budget::over();
            let asked = !over && tentatively(|| terms.look(pattern, &near, false));
            if !asked || !terms.smooth {
                return None;
            }
            Some(terms.sizes.iter().enumerate().fold(0.0_f64, |length, (i, d)| {
                let slope = largest(&terms.jacobian[pattern.range(i)]);
                if slope > 0.0 { length.max(d / slope) } else { length }
            }))
        };
        let mut found = Length::Unknown;
        for &part in parts {
            let Some(length) = length_at(part) else { break };
            let falls = !matches!(found, Length::Known(before) if length >= 0.5 * before);
            found = Length::Known(length);
            if !falls {
                break;
            }
        }
        if found == Length::Unknown {
            // F ends on the way to zero: the least length as far as it is defined.
            to_the_edge(0.0, |part| {
                let length = length_at(part);
                length.is_some_and(|length| {
                    let least = match found {
                        Length::Known(least) => least.min(length),
                        _ => length,
                    };
                    found = Length::Known(least);
                    true
                })
            });
        }
        (!over).then_some(found)
    }

    /// `‖x − P_X(x − γ F)‖_∞` with what the projection violates, for F as it was looked at and the γ of each variable; the projection is left in y, the difference in `moved`.
    fn natural(&mut self, problem: &Vi, x: &[f64], which: usize) -> f64 {
        let Self { terms, from, y, moved, gammas, projections, .. } = self;
        let f = &terms.f;
        for (i, from) in from.iter_mut().enumerate() {
            *from = x[i] - gammas[i] * f[i];
        }
        let mut missed = 0.0_f64;
        let projections = &mut projections[which];
        for ((first, set), projection) in problem.set.parts().into_iter().zip(projections) {
            let range = first..first + set.dim();
            if !projection.onto(set, &from[range.clone()], &x[range.clone()], &mut y[range.clone()])
            {
                return f64::INFINITY;
            }
            missed = missed.max(violation(set, &y[range.clone()]));
            for i in range {
                moved[i] = match set {
                    // However large x is, nothing cancels.
                    Set::Box { lower, upper } => {
                        natural(x[i], gammas[i] * f[i], lower[i - first], upper[i - first])
                    }
                    _ => x[i] - y[i],
                };
            }
        }
        largest(moved) + missed
    }

    /// What F makes of x in the units of its rows that are known beforehand: `max ‖x − P_X(x − γ F)‖_∞ / ξ` over the parts of the set, with `γ = ξ/φ` of each part (of a box, each variable; of a polyhedron, those
    /// that its rows join) by its own φ, and ξ the size of the part's x, start and set, as far as they count; of parts without a unit nothing.
    fn own(&mut self, problem: &Vi, x: &[f64]) -> f64 {
        let mut sizes = vec![0.0; x.len()];
        let (units, terms) = (&self.units, &self.terms);
        let phi = |i: usize| {
            let (start, near) = units.at(i, terms.sizes[i]);
            lesser(start, near)
        };
        // What has no size of its own, as a cone that begins at its point, has a part of the others'.
        let known = self.known;
        let least = if known.size() > 0.0 { OF_OTHERS * known.size() } else { largest(x) };
        // Of a start far off a part counts.
        let share = if self.size_of_start > 0.0 { known.start / self.size_of_start } else { 1.0 };
        for ((first, set), tied) in problem.set.parts().into_iter().zip(&self.tied) {
            let whole = first..first + set.dim();
            let Set::Box { lower, upper } = set else {
                for tied in tied {
                    let these = || tied.iter().map(|i| first + i);
                    let of = |x: &[f64]| these().fold(0.0_f64, |size, i| size.max(x[i].abs()));
                    let stated = (share * of(&self.start)).max(set.size().min(known.set));
                    let size = stated.max(of(x)).max(least);
                    let phi = these().map(phi).fold(0.0, f64::max);
                    for i in these() {
                        (sizes[i], self.gammas[i]) = scaled(size, phi);
                    }
                }
                continue;
            };
            for i in whole {
                let bounds = [lower[i - first], upper[i - first]].into_iter();
                let bounds = bounds.filter(|b| b.is_finite()).map(|b| b.abs().min(known.set));
                let sizes_of = bounds.chain([share * self.start[i].abs(), x[i].abs()]);
                let size = sizes_of.fold(least, f64::max);
                (sizes[i], self.gammas[i]) = scaled(size, phi(i));
            }
        }
        let mut alone = 0.0_f64;
        let near = INSIDE * largest(x).max(known.size());
        let pattern = problem.F.pattern();
        for (first, set) in problem.set.parts() {
            let held = held_near(set, &x[first..first + set.dim()], near);
            // There the condition is F = 0, row by row, whatever the others are as large as.
            for i in (first..).zip(held).filter(|(_, held)| !held).map(|(i, _)| i) {
                let rounding = if terms.smooth { terms.rounding(pattern, x, i) } else { 0.0 };
                let beyond = (terms.f[i].abs() - 4.0 * rounding).max(0.0);
                if phi(i) > 0.0 {
                    alone = alone.max(beyond / phi(i));
                }
            }
        }
        if !self.natural(problem, x, 2).is_finite() {
            return f64::INFINITY;
        }
        let shares = self.moved.iter().zip(&sizes).zip(&self.gammas);
        shares.filter(|(_, g)| **g > 0.0).fold(alone, |own, ((r, xi), _)| own.max(r.abs() / xi))
    }

    /// ξ and γ at a point where the terms of F are φ.
    fn units(&self, x: &[f64], phi: f64) -> (f64, f64) {
        let size = largest(x).max(self.known.size());
        match (size > 0.0, phi > 0.0) {
            (true, true) => (size, size / phi),
            (false, true) => (phi, 1.0),
            (true, false) => (size, 0.0),
            // x = 0 and F = 0
            (false, false) => (1.0, 0.0),
        }
    }

    /// What a point is held by. `None` where F is not defined there, or the projection is not found.
    ///
    /// Cost: a projection, and the orthogonalisation of the rows.
    pub fn held(&mut self, problem: &Vi, point: &LcpPoint) -> Option<Held> {
        let x = &point.z;
        let phi = self.look(problem, x, true)?;
        let (size, gamma) = self.units(x, phi);
        self.gammas.fill(gamma);
        if !self.natural(problem, x, 1).is_finite() {
            return None;
        }
        let rows = self.projections[1].iter().map(Projection::held).collect();
        (!budget::over()).then(|| Held { from: self.from.clone(), gamma, size, rows })
    }

    pub(super) fn measure(&mut self, problem: &Vi, point: &LcpPoint, precisely: bool) -> Measure {
        let (x, n) = (&point.z, problem.dim() as f64);
        if x.iter().any(|x| !x.is_finite()) {
            return Measure::unknown();
        }
        let Some(phi) = self.look(problem, x, precisely) else { return Measure::never() };
        let (xi, gamma) = self.units(x, phi);
        self.gammas.fill(gamma);
        let relative = self.natural(problem, x, 1) / xi;
        self.kept.copy_from_slice(&self.moved);
        // Of a point that is far from a solution it says nothing new.
        let own = match precisely && self.cut_short {
            true => Some(NEVER),
            false => (relative < LOOKED_AT).then(|| self.own(problem, x)),
        };
        self.gammas.fill(1.0);
        let absolute = self.natural(problem, x, 0);
        std::mem::swap(&mut self.moved, &mut self.kept);
        if !(absolute.is_finite() && relative.is_finite()) {
            // Nothing projects onto an empty set.
            return Measure::never();
        }
        let gap: f64 = self.moved.iter().zip(&self.terms.f).map(|(r, f)| r * f).sum();
        let worst = self
            .moved
            .iter()
            .map(|r| r.abs())
            .enumerate()
            .fold((0, 0.0), |worst, (i, r)| if r > worst.1 { (i, r) } else { worst });
        let outside = problem.set.parts().into_iter().fold(0.0_f64, |outside, (first, set)| {
            outside.max(violation(set, &x[first..first + set.dim()]))
        });
        Measure {
            absolute,
            relative,
            literature: absolute,
            siconos: absolute,
            primal: outside / xi,
            dual: relative,
            complementarity: if phi > 0.0 { gap.abs() / (n * phi * xi) } else { 0.0 },
            own,
            worst_contact: worst.0,
            worst: worst.1 / xi,
            ..Measure::unknown()
        }
    }

    pub(super) fn verdict(
        &mut self,
        problem: &Vi,
        point: &LcpPoint,
        tolerance: f64,
    ) -> Verdict<SetStatus, SetCounts> {
        let measure = self.measure(problem, point, true);
        let near = tolerance * largest(&point.z).max(self.known.size());
        let mut statuses = vec![];
        for (first, set) in problem.set.parts() {
            statuses_of(set, &point.z[first..first + set.dim()], near, &mut statuses);
        }
        let inside = statuses.iter().filter(|s| **s == SetStatus::Inside).count();
        let counts = SetCounts { inside, border: statuses.len() - inside };
        // Of the last projection, in the unit of the worst.
        let moved = self.moved.iter().map(|r| r.abs());
        let most = moved.clone().fold(0.0, f64::max);
        let mut worst: Vec<_> = moved.enumerate().filter(|(_, r)| *r > 0.0).collect();
        worst.sort_by(|a, b| b.1.total_cmp(&a.1));
        worst.truncate(10);
        worst.iter_mut().for_each(|(_, r)| *r *= measure.worst / most);
        Verdict {
            measure,
            solved: measure.passes(tolerance),
            counts,
            statuses,
            velocity: problem.partner(point),
            worst,
        }
    }
}

/// How far each variable reaches in its bounds.
fn reaches(problem: &Vi) -> Vec<f64> {
    let mut out = vec![f64::INFINITY; problem.dim()];
    for (first, set) in problem.set.parts() {
        if let Set::Box { lower, upper } = set {
            for (k, (l, u)) in lower.iter().zip(upper).enumerate() {
                out[first + k] = reach(problem.start[first + k], *l, *u);
            }
        }
    }
    out
}

/// Which variables of a set that is no product a constraint that is no farther than `near` may hold together with others; of a box, which joins none, nothing.
fn held_near(set: &Set, x: &[f64], near: f64) -> Vec<bool> {
    let held = match set {
        Set::Box { .. } | Set::Product(_) => return vec![],
        Set::Ball { centre, radius } => distance(x, centre) >= radius - near,
        Set::SecondOrderCone { .. } => (x[0] - norm(&x[1..])) / 2f64.sqrt() <= near,
        Set::Polyhedron { A, C, .. } => {
            let mut holds = vec![];
            rows(set, x, |excess, bound| holds.push(!bound || excess >= -near));
            let mut held = vec![false; x.len()];
            for (i, j, _) in A.triplets().chain(C.triplets().map(|(i, j, a)| (A.nrows() + i, j, a)))
            {
                held[j] |= holds[i];
            }
            return held;
        }
    };
    vec![held; x.len()]
}

/// ξ and `γ = ξ/φ` of a part of this size.
fn scaled(size: f64, phi: f64) -> (f64, f64) {
    let size = if size > 0.0 { size } else { phi };
    (size, if phi > 0.0 { size / phi } else { 0.0 })
}

fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |size, x| size.max(x.abs()))
}

/// The groups of variables of a set that is no product, each of which it projects by itself.
fn tied(set: &Set) -> Vec<Vec<usize>> {
    match set {
        // Looked at one by one.
        Set::Box { .. } => vec![],
        Set::Polyhedron { A, C, .. } => {
            let mut groups = Groups::new(set.dim());
            for rows in [A, C] {
                let of_rows = rows.transpose();
                for i in 0..of_rows.ncols() {
                    groups.join_all(of_rows.column(i).0);
                }
            }
            groups.members()
        }
        _ => vec![(0..set.dim()).collect()],
    }
}

/// How far x violates a set that is no product.
fn violation(set: &Set, x: &[f64]) -> f64 {
    let mut worst = 0.0_f64;
    match set {
        Set::Box { lower, upper } => {
            for ((x, l), u) in x.iter().zip(lower).zip(upper) {
                worst = worst.max(l - x).max(x - u);
            }
        }
        Set::Polyhedron { .. } => {
            rows(set, x, |excess, bound| {
                worst = worst.max(if bound { excess } else { excess.abs() })
            });
        }
        Set::Ball { centre, radius } => worst = distance(x, centre) - radius,
        Set::SecondOrderCone { .. } => worst = (norm(&x[1..]) - x[0]) / 2f64.sqrt(),
        Set::Product(_) => {}
    }
    worst.max(0.0)
}

/// `(m_i x − rhs_i) / ‖m_i‖` of each row of a polyhedron, and whether it is an inequality; of rows without entries `−rhs_i`.
fn rows(set: &Set, x: &[f64], mut each: impl FnMut(f64, bool)) {
    let Set::Polyhedron { A, b, C, d } = set else { return };
    for (m, rhs, bound) in [(A, b, true), (C, d, false)] {
        let (mut excess, mut squares) = (vec![0.0; rhs.len()], vec![0.0_f64; rhs.len()]);
        for (i, j, a) in m.triplets() {
            excess[i] += a * x[j];
            squares[i] += a * a;
        }
        for i in 0..rhs.len() {
            let size = if squares[i] > 0.0 { squares[i].sqrt() } else { 1.0 };
            each((excess[i] - rhs[i]) / size, bound);
        }
    }
}

fn norm(x: &[f64]) -> f64 {
    // By the largest entry, so that nothing overflows.
    let size = largest(x);
    if size == 0.0 {
        return 0.0;
    }
    size * x.iter().map(|x| (x / size).powi(2)).sum::<f64>().sqrt()
}

pub(super) fn distance(x: &[f64], y: &[f64]) -> f64 {
    norm(&x.iter().zip(y).map(|(x, y)| x - y).collect::<Vec<_>>())
}

fn statuses_of(set: &Set, x: &[f64], near: f64, to: &mut Vec<SetStatus>) {
    let on = |border: bool| if border { SetStatus::Border } else { SetStatus::Inside };
    match set {
        Set::Box { lower, upper } => {
            let bounded = x.iter().zip(lower).zip(upper);
            let bounded = bounded.filter(|((_, l), u)| l.is_finite() || u.is_finite());
            to.extend(bounded.map(|((x, l), u)| on(x - l <= near || u - x <= near)));
        }
        Set::Polyhedron { .. } => rows(set, x, |excess, bound| {
            if bound {
                to.push(on(excess >= -near));
            }
        }),
        Set::Ball { centre, radius } => to.push(on(distance(x, centre) >= radius - near)),
        Set::SecondOrderCone { .. } => to.push(match x[0] {
            t if t.abs().max(norm(&x[1..])) <= near => SetStatus::Apex,
            t => on(t - norm(&x[1..]) <= near),
        }),
        Set::Product(_) => {}
    }
}

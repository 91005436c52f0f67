//! F at a point and the sizes of its rows' terms, as the judges of nonlinear problems measure them.

use nonsmooth_linalg::budget;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::{hand_on, lesser, size_of_row};
use crate::field::{Evaluator, Field, Pattern, tentatively};

/// The part of a row's unit that its terms count at least: where F vanishes with all its terms, these give no unit.
const VANISHING: f64 = 1e-4;
/// How near to zero, in parts of the start, a function without expressions is asked: not at zero, where logarithms and quotients end. Of two points, since sizes that
/// still become smaller from the one to the other vanish.
const NEAR: [f64; 2] = [1.0 / (1_u64 << 30) as f64, 1.0 / (1_u64 << 40) as f64];
/// How far from zero, in parts of the start: for rows that are large near a pole, where a start may lie.
const FAR: [f64; 2] = [(1_u64 << 40) as f64, (1_u64 << 50) as f64];
/// Where a row that vanishes with all its terms counts as large as it was elsewhere, it is asked on the way to zero and away from it, in steps of a factor 4, where it no longer becomes smaller: sizes
/// that fall by less than this from one point to the next. So near to zero, in powers of two, and so far.
const LEVEL: f64 = 0.9;
const STEPS: i32 = 60;
/// Near zero, and far off, rows are sums of powers of which one is left: sizes whose ratio from one step to the next has changed by less than this follow it.
const SETTLED: f64 = 1e-3;
/// A row leaves its last power, or its level where it has a constant, where it is so many times that: there the next power is as large, and the variables as the row ties them.
const LEAVES: f64 = 2.0;
/// Then in longer steps, down to the smallest numbers and up to the largest, of which the last two are near each other; where a size rises along one of them, in short ones again.
const LONGER_STEPS: [i32; 9] = [64, 72, 88, 120, 184, 312, 568, 1016, 1020];
/// Where F ends on the way, so many points halve the way to there.
const EDGE: usize = 40;
/// Changes of the variables, in parts of their size, along which a Jacobian is held against F. So far at least is a point from a solution that its own distance from a pole makes seem near:
/// of `3 − 1/(x − 1)` close to 1, a change of x by as little as that distance changes F by all that it is.
const STEP: f64 = 1.0 / 1024.0;
/// What a Jacobian may miss of F's change, in parts of its terms.
const ALLOWED: f64 = 0.1;

/// F, its Jacobian and D, the sizes of its rows' terms, at the point last looked at.
pub(crate) struct Terms {
    field: Box<dyn Evaluator>,
    pub(crate) f: Vec<f64>,
    pub(crate) jacobian: Vec<f64>,
    /// At least `|F_i|`.
    pub(crate) sizes: Vec<f64>,
    /// Whether there is a Jacobian.
    pub(crate) smooth: bool,
    /// The point last looked at, and whether precisely: it is not asked twice, for a caller's F may take its time. Empty where F was not defined, or the time was over.
    at: Vec<f64>,
    exactly: bool,
    /// The time was over before the Jacobian was known, so that sizes and distances say less than they might.
    pub(crate) cut_short: bool,
    moved: [Vec<f64>; 4],
}

impl Terms {
    pub(crate) fn new(field: &dyn Field) -> Self {
        let zeros = || vec![0.0; field.dim()];
        Self {
            field: field.evaluator(),
            f: zeros(),
            jacobian: vec![0.0; field.pattern().len()],
            sizes: zeros(),
            smooth: false,
            at: vec![],
            exactly: false,
            cut_short: false,
            moved: [zeros(), zeros(), zeros(), zeros()],
        }
    }

    /// Looks at x; `precisely` F is evaluated as exactly as it can be, and a Jacobian that says the sizes is held against F. False where F is not defined.
    pub(crate) fn look(&mut self, pattern: &Pattern, x: &[f64], precisely: bool) -> bool {
        // What decides does so whether or not the time is over: plain arithmetic takes 1/∞ for a value.
        if self.at == x && (self.exactly || !precisely) {
            return true;
        }
        self.at.clear();
        let Self { field, f, jacobian, sizes, smooth, cut_short, .. } = self;
        *smooth = field.jacobian(x, f, jacobian);
        *cut_short = !*smooth && budget::over();
        let known = field.sizes(x, sizes);
        // Who does not know the terms has no better value of F either.
        let defined = match (*smooth, precisely && known) {
            (_, true) => field.precisely(x, f),
            (true, false) => true,
            (false, false) => field.value(x, f),
        };
        if !defined || f.iter().any(|f| !f.is_finite()) {
            sizes.fill(0.0);
            return false;
        }
        for (i, size) in sizes.iter_mut().enumerate() {
            if !known {
                let linear = along(pattern, jacobian, i, x, |ax| ax);
                let moduli = along(pattern, jacobian, i, x, f64::abs);
                *size = if *smooth { (f[i] - linear).abs() + moduli } else { 0.0 };
            }
            *size = size_of_row(*size, f[i]);
        }
        if precisely && *smooth {
            self.distrust(pattern, x);
        }
        if !budget::over() {
            self.at.extend_from_slice(x);
            self.exactly = precisely;
        }
        true
    }

    /// The units of rows by the point last looked at: the sizes, or what neighbours hand on; and the largest size.
    fn units(&self, pattern: &Pattern) -> (Vec<f64>, f64) {
        let mut units = self.sizes.clone();
        hand_on(&mut units, pattern, &self.jacobian, |_| f64::INFINITY);
        (units, self.sizes.iter().fold(0.0, |most, d| most.max(*d)))
    }

    /// What a change of all variables by half their last bit makes of `F_i`.
    pub(crate) fn rounding(&self, pattern: &Pattern, x: &[f64], i: usize) -> f64 {
        0.5 * f64::EPSILON * along(pattern, &self.jacobian, i, x, f64::abs)
    }

    /// A Jacobian is a claim, and of this point alone: of a row of which F does not change as it says, `|F_i|` and the change count in place of its terms, if they are smaller.
    ///
    /// `|F_i(x ± h d) − F_i(x) ∓ h Σ_j J_ij d_j| > h Σ_j |J_ij x_j| / 10` on both sides (at kinks one is enough), for d_j of random sign between `|x_j|/2` and `|x_j|`. Two values of F.
    fn distrust(&mut self, pattern: &Pattern, x: &[f64]) {
        let Self { field, f, jacobian, sizes, moved: [y, up, down, d], .. } = self;
        let mut random = Pcg64::seed_from_u64(1);
        for (d, x) in d.iter_mut().zip(x) {
            *d = x * random.random_range(0.5..1.0) * if random.random() { 1.0 } else { -1.0 };
        }
        let mut side = |h: f64, there: &mut Vec<f64>| {
            y.iter_mut().zip(x).zip(&*d).for_each(|((y, x), d)| *y = x + h * d);
            tentatively(|| field.value(y, there));
        };
        side(STEP, up);
        side(-STEP, down);
        for (i, size) in sizes.iter_mut().enumerate() {
            let said = along(pattern, jacobian, i, d, |ad| ad);
            let moduli = along(pattern, jacobian, i, x, f64::abs);
            let changes = [(up[i] - f[i]) / STEP, (f[i] - down[i]) / STEP];
            let seen = changes.into_iter().filter(|change| change.is_finite());
            let agrees = |change: f64| (change - said).abs() <= ALLOWED * moduli;
            if seen.clone().count() > 0 && !seen.clone().any(agrees) {
                *size = size
                    .min(f[i].abs() + seen.fold(0.0_f64, |most, change| most.max(change.abs())));
            }
        }
    }
}

/// Halves the way from 1, where F is defined, to `outside`, where it is not; `look` says whether it is defined at a point of the way.
pub(crate) fn to_the_edge(mut outside: f64, mut look: impl FnMut(f64) -> bool) {
    let mut inside = 1.0;
    for _ in 0..EDGE {
        let middle = 0.5 * (inside + outside);
        *(if look(middle) { &mut inside } else { &mut outside }) = middle;
    }
}

/// Takes the sizes for units that lie level, or rise, from one point to the next.
fn note_level(least: &mut [f64], before: &[f64], now: &[f64]) {
    for ((least, before), now) in least.iter_mut().zip(before).zip(now) {
        if *now >= LEVEL * before && *before > 0.0 {
            *least = least.min(now.max(*before));
        }
    }
}

/// Of sizes that fall, one list for each short step, what the last power of a row makes of it where it leaves that, or, where it never does, at the start.
fn note_last_power(least: &mut [f64], whole: &[f64], steps: &[Vec<f64>]) {
    let [.., first, before, now] = steps else { return };
    for (i, least) in least.iter_mut().enumerate() {
        let (earlier, ratio) = (first[i] / before[i], before[i] / now[i]);
        let falls = ratio.is_finite() && ratio > 1.0 / LEVEL;
        if !falls || (earlier / ratio - 1.0).abs() > SETTLED {
            continue;
        }
        let mut power = now[i];
        for there in steps.iter().rev().skip(1).map(|step| step[i]).chain([whole[i]]) {
            power *= ratio;
            if !(there <= LEAVES * power && LEAVES * there >= power) {
                power = power.min(there);
                break;
            }
        }
        if power > 0.0 {
            *least = least.min(power);
        }
    }
}

/// The short step, from 0 for the start, before which a row with a constant has come to its level.
fn tied_at(i: usize, whole: &[f64], steps: &[Vec<f64>]) -> Option<usize> {
    let [.., before, now] = steps else { return None };
    let is_level = |sizes: &[f64]| sizes[i] <= LEAVES * now[i];
    match now[i] > 0.0 && now[i] >= LEVEL * before[i] {
        true if is_level(whole) => Some(0),
        true => steps.iter().position(|sizes| is_level(sizes)),
        false => None,
    }
}

/// `Σ_j of(J_ij d_j)`
fn along(pattern: &Pattern, jacobian: &[f64], i: usize, d: &[f64], of: impl Fn(f64) -> f64) -> f64 {
    let terms = jacobian[pattern.range(i)].iter().zip(pattern.row(i));
    terms.map(|(a, &j)| of(a * d[j])).sum()
}

/// ω: the sizes of rows that are known beforehand.
pub(crate) struct Units {
    /// Those at the start or, where they vanish there, what a change of the other rows by their own makes of the row.
    start: Vec<f64>,
    /// The smaller of the same at the point nearest to zero that is allowed, and far beyond the start; zero where they are not known. Of rows that vanish at the start what the
    /// neighbours' sizes at the point last looked at make of them, as far as the variables reach.
    elsewhere: Vec<f64>,
    /// The sizes on the way between these points at which rows lie level, far below both; zero where there are none, or none were asked for.
    level: Vec<f64>,
    /// The largest sizes at the start, and elsewhere.
    largest: (f64, f64),
    /// Sizes at the start, and the points near zero and far from it until they are asked: sizes that become smaller from one to the next vanish there.
    own: Vec<f64>,
    unasked: Vec<Vec<Vec<f64>>>,
    /// How far variables reach, and the Jacobian at the start, where rows vanish there.
    handed: Option<(Vec<f64>, Vec<f64>)>,
    /// The start and the point nearest to zero, until the way between them is asked.
    way: Option<[Vec<f64>; 2]>,
    expressions: bool,
    /// The time was over before all was known that the point last looked at is to be measured by.
    pub(crate) cut_short: bool,
}

impl Units {
    /// Of a problem that begins at `start`; `zero` is what is nearest to zero of all that is allowed, `reach` how far each variable reaches.
    ///
    /// Expressions are asked there at once; functions of a caller's, which may be slow or know their neighbourhood alone, only where it matters, and a bit beside it.
    pub(crate) fn new(
        field: &dyn Field,
        terms: &mut Terms,
        start: &[f64],
        zero: Vec<f64>,
        reach: Vec<f64>,
    ) -> Self {
        let zeros = || vec![0.0; start.len()];
        let mut units = Self {
            start: zeros(),
            elsewhere: zeros(),
            level: zeros(),
            largest: (0.0, 0.0),
            own: vec![],
            unasked: vec![],
            handed: None,
            way: None,
            expressions: field.expressions().is_some(),
            cut_short: false,
        };
        terms.look(field.pattern(), start, !units.expressions);
        (units.start, units.largest.0) = terms.units(field.pattern());
        units.own.clone_from(&terms.sizes);
        if terms.smooth && units.own.contains(&0.0) {
            units.handed = Some((reach, terms.jacobian.clone()));
            units.hand_on(field.pattern(), &terms.sizes);
        }
        if zero != start {
            let beside =
                |part: f64| zero.iter().zip(start).map(|(z, s)| z + part * (s - z)).collect();
            let near =
                if units.expressions { vec![zero.clone()] } else { NEAR.map(beside).to_vec() };
            units.unasked = vec![near, FAR.map(beside).to_vec()];
        }
        if units.expressions {
            units.ask(field, terms);
        }
        units.way = Some([start.to_vec(), zero]);
        units
    }

    /// [`Terms::look`]; where sizes there are so small beside those of the start that those near zero matter, they are asked for before.
    pub(crate) fn look(
        &mut self,
        field: &dyn Field,
        terms: &mut Terms,
        x: &[f64],
        precisely: bool,
    ) -> bool {
        self.cut_short = false;
        let mut defined = terms.look(field.pattern(), x, precisely);
        let mut rows = terms.sizes.iter().zip(&self.start);
        if defined && !self.unasked.is_empty() && rows.any(|(d, unit)| *d < VANISHING * unit) {
            self.cut_short = !self.ask(field, terms);
            defined = terms.look(field.pattern(), x, precisely);
        }
        let mut rows = terms.sizes.iter().enumerate();
        let vanishes = rows.any(|(i, d)| self.own[i] > 0.0 && *d < self.least(i))
            || terms.sizes.iter().all(|d| *d < self.least_of_all());
        if defined
            && vanishes
            && let Some(way) = self.way.take()
        {
            if !self.ask_on_the_way(&way, field, terms) {
                // Another time: until then nothing is decided.
                (self.way, self.cut_short) = (Some(way), true);
            }
            defined = terms.look(field.pattern(), x, precisely);
        }
        self.cut_short |= terms.cut_short;
        if defined {
            self.hand_on(field.pattern(), &terms.sizes);
        }
        defined
    }

    /// A start may lie far off, or near a pole that is at zero, and no point that was asked say how large the rows are between: where their sizes lie level on the way, or rise again, and are a small
    /// part of those known, they are the units. False where the time is over before they are known.
    fn ask_on_the_way(
        &mut self,
        [start, zero]: &[Vec<f64>; 2],
        field: &dyn Field,
        terms: &mut Terms,
    ) -> bool {
        let n = start.len();
        let mut over = false;
        let mut least = vec![f64::INFINITY; n + 1];
        let whole = [&self.own[..], &[self.largest.0]].concat();
        for inwards in [true, false] {
            let sign = if inwards { 1 } else { -1 };
            // Where nothing is between, away from zero itself.
            let from = if zero == start { vec![0.0; n] } else { zero.clone() };
            if inwards && zero == start || *start == from {
                continue;
            }
            let mut before = whole.clone();
            let mut sizes_at = |k: i32, beyond: f64| {
                let part = 2.0_f64.powi(-sign * k) * beyond;
                let point: Vec<f64> =
                    from.iter().zip(start).map(|(z, s)| z + part * (s - z)).collect();
                over |= budget::over();
                let asked = !over
                    && point.iter().all(|x| x.is_finite())
                    && tentatively(|| terms.look(field.pattern(), &point, !self.expressions));
                let largest = terms.sizes.iter().fold(0.0_f64, |most, d| most.max(*d));
                asked.then(|| [&terms.sizes[..], &[largest]].concat())
            };
            let short = (1..=STEPS / 2).map(|k| 2 * k);
            let (mut last, mut edge) = (0, None);
            let mut steps: Vec<Vec<f64>> = vec![];
            for k in short.chain(LONGER_STEPS) {
                let Some(now) = sizes_at(k, 1.0) else {
                    edge = Some((last, f64::from(last - k).exp2()));
                    break;
                };
                // Between the two there may be a size that is a unit, and smaller than those that are known.
                let least_of = least.iter().zip(&whole).map(|(least, d)| least.min(VANISHING * d));
                let mut rows = now.iter().zip(&before).zip(least_of);
                let rises = rows.any(|((now, before), least)| {
                    *before > 0.0 && *now > 2.0 * before && *before < least
                });
                let between = (last + 2..k).step_by(2).filter(|_| rises);
                let between = between.filter_map(|k| sizes_at(k, 1.0));
                for now in between.chain([now]) {
                    note_level(&mut least, &before, &now);
                    before = now;
                }
                if k <= STEPS {
                    steps.push(before.clone());
                }
                last = k;
            }
            // F ends there: sizes may be level at the edge of where it is defined.
            if let Some((last, outside)) = edge
                && inwards
            {
                to_the_edge(outside, |part| {
                    let now = sizes_at(last, part);
                    now.is_some_and(|now| {
                        note_level(&mut least, &before, &now);
                        before = now;
                        true
                    })
                });
            }
            // All short ones.
            if steps.len() == STEPS as usize / 2 {
                note_last_power(&mut least, &whole, &steps);
                if inwards {
                    let way = [&from[..], start];
                    over |= !self.ask_where_tied(way, (&whole, &steps), (field, terms), &mut least);
                }
            }
        }
        // These are no sizes of the point last looked at any more.
        terms.at.clear();
        if over {
            return false;
        }
        let known = lesser(self.largest.0, self.largest.1);
        if least[n] < VANISHING * known {
            self.largest.1 = least[n];
        }
        for (i, least) in least[..n].iter().enumerate() {
            if self.own[i] > 0.0 && *least < VANISHING * lesser(self.start[i], self.elsewhere[i]) {
                self.level[i] = *least;
            }
        }
        true
    }

    /// Takes for units the sizes where the variables are as large as rows with a constant, those of which they make a good part of its size, tie them. False where the time is over before.
    fn ask_where_tied(
        &self,
        [from, start]: [&[f64]; 2],
        (whole, steps): (&[f64], &[Vec<f64>]),
        (field, terms): (&dyn Field, &mut Terms),
        least: &mut [f64],
    ) -> bool {
        let (n, pattern) = (start.len(), field.pattern());
        let tied: Vec<Option<usize>> = (0..n).map(|i| tied_at(i, whole, steps)).collect();
        let mut parts = vec![0.0_f64; n];
        let point = |part: &dyn Fn(usize) -> f64| -> Vec<f64> {
            (0..n).map(|j| from[j] + part(j) * (start[j] - from[j])).collect()
        };
        let look = |terms: &mut Terms, x: &[f64]| {
            !budget::over() && tentatively(|| terms.look(pattern, x, !self.expressions))
        };
        for k in 0..steps.len() {
            let part = 4.0_f64.powi(-(k as i32));
            if !tied.contains(&Some(k)) || !look(terms, &point(&|_| part)) || !terms.smooth {
                continue;
            }
            for i in (0..n).filter(|&i| tied[i] == Some(k)) {
                let entries = terms.jacobian[pattern.range(i)].iter().zip(pattern.row(i));
                let good = steps[steps.len() - 1][i] / pattern.row(i).len() as f64;
                for (_, &j) in
                    entries.filter(|(a, j)| (*a * part * (start[**j] - from[**j])).abs() >= good)
                {
                    parts[j] = parts[j].max(part);
                }
            }
        }
        let part = |j: usize| if parts[j] > 0.0 { parts[j] } else { 1.0 };
        if (0..n).any(|j| part(j) < 1.0) && look(terms, &point(&part)) {
            let sizes = least.iter_mut().zip(&terms.sizes).filter(|(_, size)| **size > 0.0);
            sizes.for_each(|(least, size)| *least = least.min(*size));
        }
        !budget::over()
    }

    /// False where the time is over first: what is unasked then remains so.
    fn ask(&mut self, field: &dyn Field, terms: &mut Terms) -> bool {
        while !self.unasked.is_empty() {
            let points = self.unasked.remove(0);
            if !self.ask_at(&points, field, terms) {
                self.unasked.insert(0, points);
                break;
            }
        }
        // These are no sizes of the point last looked at any more.
        terms.at.clear();
        self.unasked.is_empty()
    }

    /// Takes the units at these points, where F is defined at all of them. False where the time is over first.
    fn ask_at(&mut self, points: &[Vec<f64>], field: &dyn Field, terms: &mut Terms) -> bool {
        let mut before: Option<Vec<f64>> = None;
        for point in points {
            if budget::over() {
                return false;
            }
            if !tentatively(|| terms.look(field.pattern(), point, !self.expressions)) {
                return true;
            }
            if let Some(before) = before.replace(terms.sizes.clone()) {
                let sizes = terms.sizes.iter_mut().zip(before);
                sizes.filter(|(d, before)| **d < 0.5 * before).for_each(|(d, _)| *d = 0.0);
            }
        }
        let (units, largest) = terms.units(field.pattern());
        self.largest.1 = lesser(self.largest.1, largest);
        // What neighbours hand on depends on the Jacobian there: it replaces no unit of the same kind.
        let rows = self.elsewhere.iter_mut().zip(units).zip(&self.own);
        for ((unit, there), _) in rows.filter(|(_, own)| **own > 0.0) {
            *unit = lesser(*unit, there);
        }
        true
    }

    /// What neighbours of these sizes hand on to rows that vanish at the start. Those that are large at a start far off alone, or by terms that no variable within its bounds can balance, make
    /// nothing small.
    fn hand_on(&mut self, pattern: &Pattern, sizes: &[f64]) {
        let Some((reach, jacobian)) = &self.handed else { return };
        let rows = self.own.iter().zip(sizes);
        let mut units: Vec<f64> =
            rows.map(|(own, size)| if *own > 0.0 { *size } else { 0.0 }).collect();
        hand_on(&mut units, pattern, jacobian, |j| reach[j]);
        for (i, unit) in units.into_iter().enumerate().filter(|(i, _)| self.own[*i] == 0.0) {
            self.elsewhere[i] = unit;
        }
    }

    /// ω of row i, whose terms have this size; whichever points were measured before, it is the same.
    pub(crate) fn at(&self, i: usize, size: f64) -> (f64, f64) {
        let known = lesser(self.start[i], self.elsewhere[i]);
        if self.level[i] > 0.0 && size < VANISHING * known {
            return (self.start[i], self.level[i]);
        }
        let matters = self.expressions || size < VANISHING * self.start[i];
        (self.start[i], if matters { self.elsewhere[i] } else { 0.0 })
    }

    /// The size that terms of row i count at least.
    pub(crate) fn least(&self, i: usize) -> f64 {
        match self.level[i] {
            level if level > 0.0 => VANISHING * level,
            _ => VANISHING * lesser(self.start[i], self.elsewhere[i]),
        }
    }

    /// As [`least`](Self::least), of the largest row.
    pub(crate) fn least_of_all(&self) -> f64 {
        VANISHING * lesser(self.largest.0, self.largest.1)
    }
}

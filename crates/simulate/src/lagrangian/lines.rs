//! Lines: the directions of contacts, the gradients of relations and of scalar rows, and which of them take part in a step.

use nonsmooth_linalg::Dense;
use nonsmooth_problem::Bounds;

use super::gradients::{Gradients, dot, given};
use super::state::LagrangianState;
use super::{Lagrangian, LagrangianScheme, RelationsAt, RowLaw};
use crate::error::require;
use crate::restitution::Restitution;
use crate::{Activation, Directions, Impact, Law, SimulateError};

/// A line that takes part in the step: its impulse acts along the gradient a at the middle of the step, and the velocity in its law is stated as `s·v⁺ + offset`, where s is
/// a, or in problems of relations alone the gradient at the end of the step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Line {
    /// Its place among all lines.
    pub index: usize,
    /// Whether its velocity is taken with the gradient at the end of the step.
    pub later: bool,
    /// Whether s is that gradient.
    pub steep: bool,
    /// A relation on the mean velocity of the step.
    pub mean: bool,
    /// Of the normal of a contact, and of a limit.
    restitution: Option<Restitution>,
    /// The part of its velocity that does not come from v: at the end of the step, and weighted by θ.
    pub given: f64,
    pub given_mean: f64,
    /// The velocity before the step.
    pub before: f64,
    /// What the law adds to the velocity after it.
    pub shift: f64,
    /// The velocity in its law at the present iterate, that which the law was solved with, and what is added to `s·v⁺` in it.
    pub value: f64,
    pub velocity: f64,
    pub offset: f64,
    /// Its impulse.
    pub impulse: f64,
}

/// A contact of the index set; its lines are D of those of the step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Touching {
    pub contact: usize,
    pub law: Law,
    /// Persisted from the last step and sticking in it.
    pub stuck: bool,
}

/// The lines of a step.
#[derive(Default)]
pub(super) struct Lines<const D: usize> {
    pub start: Gradients,
    pub now: Gradients,
    pub end: Gradients,
    pub gaps: Vec<f64>,
    pub coordinates: Vec<f64>,
    /// s and b at the beginning of the step, and where velocities are taken.
    given: [Vec<f64>; 2],
    pub touching: Vec<Touching>,
    pub lines: Vec<Line>,
    pub bounds: Bounds,
    /// The largest restitution of an impact.
    hit: f64,
    /// Whether a gap closes with more than what forces make in a step.
    pub impact: bool,
    /// M̂⁻¹ of the gradients `now`, line by line, whether that is so, and the gradients that they were made of.
    pub solved: Dense,
    pub fresh: Vec<bool>,
    pub last: Gradients,
    /// The lines that the matrices of the problem are made of.
    pub stated: Vec<usize>,
    phi: [Vec<f64>; 2],
    pub relations: usize,
    pub warm: usize,
    pub sums: Vec<f64>,
}

impl<const D: usize> Lines<D> {
    /// The gaps and gradients at the beginning of a step.
    pub fn begin<L: Lagrangian<D> + ?Sized>(
        &mut self,
        system: &L,
        state: &LagrangianState,
        q: &mut [f64],
        work: &mut Vec<f64>,
    ) {
        let size = system.size();
        self.start.evaluate(system, state.t, q, work);
        for (out, len) in [(&mut self.gaps, size.contacts), (&mut self.coordinates, size.rows)] {
            out.clear();
            out.resize(len, 0.0);
        }
        system.gaps(state.t, q, &mut self.gaps);
        system.rows(state.t, q, &mut self.coordinates);
        given(system, state.t, q, &mut self.given[0]);
    }

    pub fn is_finite(&self) -> bool {
        let vectors = [&self.gaps, &self.coordinates, &self.given[0], &self.given[1]];
        self.start.is_finite()
            && self.now.is_finite()
            && vectors.into_iter().flatten().all(|x| x.is_finite())
    }

    /// The gradients at the middle and the end of the step.
    pub fn evaluate<L: Lagrangian<D> + ?Sized>(
        &mut self,
        system: &L,
        scheme: &LagrangianScheme,
        (t, h): (f64, f64),
        (middle, end): (&mut [f64], &mut [f64]),
        work: &mut Vec<f64>,
    ) {
        let at = match scheme.directions {
            Directions::Frozen => t,
            _ => t + 0.5 * h,
        };
        self.now.evaluate(system, at, middle, work);
        if scheme.directions == Directions::Frozen {
            given(system, t + h, middle, &mut self.given[1]);
            self.end.clone_from(&self.now);
        } else {
            given(system, t + h, end, &mut self.given[1]);
            self.end.evaluate(system, t + h, end, work);
        }
    }

    /// Chooses the contacts and rows that take part; `kick` is the velocity that forces make in the step.
    pub fn choose<L: Lagrangian<D> + ?Sized>(
        &mut self,
        system: &L,
        scheme: &LagrangianScheme,
        state: &LagrangianState,
        h: f64,
        kick: &[f64],
    ) -> Result<(), SimulateError> {
        let size = system.size();
        let (t, q, v, memory) = (state.t, &state.q, &state.v, &state.memory);
        let scaled = if memory.h > 0.0 { h / memory.h } else { 0.0 };
        let turning = scheme.directions != Directions::Frozen;
        self.touching.clear();
        self.lines.clear();
        self.bounds.lower.clear();
        self.bounds.upper.clear();
        (self.impact, self.warm, self.hit) = (false, 0, 0.0);
        let rule = scheme.restitution();
        // Whether a gap takes part, whether it did in the last step and still rests there, whether it closes with an impact, its restitution, and that as an impact.
        let unilateral = |place: usize, line: usize, gap: f64, given: f64, e: f64| {
            let rate = dot(self.start.line(line), v) + given;
            let known = memory.active.get(place).copied().unwrap_or(false);
            let rest = 2.0 * dot(self.start.line(line), kick).abs();
            let active = match scheme.activation {
                Activation::Gap => true,
                Activation::Forecast { gamma, slack } => {
                    let slack = slack.max(scheme.projection.unwrap_or(0.0));
                    let beyond = gap + gamma * h * rate - slack;
                    // What runs along a curved surface leaves it by as much as a step is curved: that is no separation.
                    let curved = || {
                        let turned = dot(self.end.line(line), v) - dot(self.start.line(line), v);
                        beyond <= h * turned.abs()
                    };
                    beyond <= 0.0 || (known && turning && curved())
                }
            };
            let closes = rate < -rest && gap + h * rate <= 0.0;
            let persists = known && (e == 0.0 || rate >= -rest);
            let lasts = persists && (e == 0.0 || rate <= rest);
            let waits = scheme.activation == Activation::Gap && gap > 0.0;
            let restitution = Restitution::new(e, lasts, waits);
            (active, persists, closes, restitution, restitution.hit(rate, rest, rule))
        };
        for c in 0..size.contacts {
            let law = system.law(c, t, q, v);
            if law.validate("").is_err() {
                law.validate(&format!("law({c})"))?;
            }
            for gradients in [&self.start, &self.now, &self.end] {
                gradients.admit(c, &law)?;
            }
            if law.mu_r != 0.0 {
                let expected = "0 (only bodies of a world have rolling friction)";
                return Err(SimulateError::value(format!("law({c}).mu_r"), expected, law.mu_r));
            }
            let (gap, given) = (self.gaps[c], self.given[0][D * c]);
            let (active, persists, impact, restitution, hit) =
                unilateral(c, D * c, gap, given, law.e);
            if !active {
                continue;
            }
            self.impact |= impact;
            self.hit = self.hit.max(hit);
            let stuck = persists && memory.stuck.get(c).copied().unwrap_or(false);
            self.touching.push(Touching { contact: c, law, stuck });
            let old = memory.contacts.get(D * c..D * (c + 1)).unwrap_or(&[]);
            self.warm += usize::from(old.first().is_some_and(|r| *r > 0.0));
            for i in 0..D {
                let impulse = scaled * old.get(i).copied().unwrap_or(0.0);
                self.lines.push(Line {
                    later: turning && persists,
                    restitution: (i == 0).then_some(restitution),
                    impulse,
                    ..Line::of(D * c + i)
                });
            }
        }
        self.relations = size.relations;
        let first = D * size.contacts;
        let old = |k: usize| scaled * memory.scalars.get(k).copied().unwrap_or(0.0);
        for k in 0..size.relations {
            self.lines.push(Line { impulse: old(k), ..Line::of(first + k) });
            self.bounds.lower.push(f64::NEG_INFINITY);
            self.bounds.upper.push(f64::INFINITY);
        }
        for k in 0..size.rows {
            let index = first + size.relations + k;
            let line = Line { impulse: old(size.relations + k), ..Line::of(index) };
            match system.row_law(k, t, q, v) {
                RowLaw::Limit { e } => {
                    let ok = (0.0..=1.0).contains(&e);
                    require(|| format!("row_law({k}).e"), e, ok, "a coefficient from 0 to 1")?;
                    let (gap, given) = (self.coordinates[k], self.given[0][first + k]);
                    let (active, persists, impact, restitution, hit) =
                        unilateral(size.contacts + k, index, gap, given, e);
                    if active {
                        self.impact |= impact;
                        self.hit = self.hit.max(hit);
                        self.lines.push(Line {
                            later: turning && persists,
                            restitution: Some(restitution),
                            ..line
                        });
                        self.bounds.lower.push(0.0);
                        self.bounds.upper.push(f64::INFINITY);
                    }
                }
                RowLaw::Force { lower, upper } => {
                    if !(lower <= upper && lower < f64::INFINITY && upper > f64::NEG_INFINITY) {
                        return Err(SimulateError::value(
                            format!("row_law({k})"),
                            "a lower bound of at most the upper one",
                            format!("[{lower}, {upper}]"),
                        ));
                    }
                    self.lines.push(Line { later: turning, ..line });
                    self.bounds.lower.push(h * lower);
                    self.bounds.upper.push(h * upper);
                }
            }
        }
        Ok(())
    }

    /// What the laws add to the velocities, about the velocity `v` of this iteration.
    pub fn shift<L: Lagrangian<D> + ?Sized>(
        &mut self,
        system: &L,
        scheme: &LagrangianScheme,
        state: &LagrangianState,
        h: f64,
        (q, v): ([&[f64]; 2], &[f64]),
    ) {
        let size = system.size();
        let theta = scheme.theta;
        let first = D * size.contacts;
        // What moves relations by itself: over the step for mean velocities, about its end for those there.
        let mean = scheme.relations == RelationsAt::Mean && !self.impact;
        let (place, times) = match mean {
            true => (q[0], [state.t, state.t + h]),
            false => (q[1], [state.t, state.t + 2.0 * h]),
        };
        for (phi, t) in self.phi.iter_mut().zip(times) {
            phi.clear();
            phi.resize(size.relations, 0.0);
            system.relations(t, place, phi);
        }
        let span = times[1] - times[0];
        let Self { now, end, given, phi, lines, touching, gaps, coordinates, hit, .. } = self;
        for line in lines.iter_mut() {
            let a = now.line(line.index);
            line.before = dot(a, &state.v);
            if (first..first + size.relations).contains(&line.index) {
                let k = line.index - first;
                let rate = (phi[1][k] - phi[0][k]) / span;
                (line.given, line.given_mean, line.mean, line.later) =
                    (rate, rate, mean, !mean && scheme.directions != Directions::Frozen);
                continue;
            }
            let k = if line.index < first { line.index } else { line.index - size.relations };
            line.before += given[0][k];
            line.given = given[1][k];
            line.given_mean = theta * given[1][k] + (1.0 - theta) * given[0][k];
        }
        let rule = scheme.restitution();
        let waiting = scheme.activation == Activation::Gap;
        for line in lines.iter_mut() {
            let Some(restitution) = line.restitution else { continue };
            let gap = match line.index.checked_sub(first + size.relations) {
                Some(row) => coordinates[row],
                None => gaps[line.index / D],
            };
            let wait = if waiting { gap.max(0.0) / h } else { 0.0 };
            line.shift = wait + restitution.share(line.before, *hit, rule) * line.before;
        }
        for (touch, lines) in touching.iter().zip(lines.chunks_exact_mut(D)) {
            let tangential = match scheme.impact {
                Impact::Fremond if touch.stuck => 0.0,
                Impact::Fremond => (1.0 - theta) / theta,
                Impact::Newton => touch.law.e_t,
            };
            for line in &mut lines[1..] {
                line.shift = tangential * line.before;
            }
        }
        let alone = lines.len() == size.relations && scheme.directions != Directions::Frozen;
        for line in lines.iter_mut() {
            let (a, b) = (now.line(line.index), end.line(line.index));
            let (at_middle, at_end) = (dot(a, v), dot(b, v));
            line.value = match line.mean {
                true => at_middle + ((1.0 - theta) * line.before + line.given) / theta,
                false => line.given + line.shift + if line.later { at_end } else { at_middle },
            };
            // The derivative by v of a mean velocity, with the gradient at the middle of what v makes, is the gradient at the end.
            line.steep = alone && (!line.mean || scheme.directions == Directions::Iterated);
            line.offset = line.value - if line.steep { at_end } else { at_middle };
        }
    }

    /// How much the velocities in the laws differ from those that the laws were solved with, relative to what velocities along lines may be, `‖a‖_{M̂⁻¹} ‖v‖_M`, and to what
    /// is given.
    pub fn change(&self, speed: f64) -> f64 {
        let (mut change, mut size) = (0.0_f64, f64::MIN_POSITIVE);
        for line in &self.lines {
            let by = (line.value - line.velocity).abs();
            change = if by > change || by.is_nan() { by } else { change };
            size = size.max(self.ease(line) * speed + line.offset.abs());
        }
        change / size
    }

    /// The sum of `‖a‖_{M̂⁻¹} |r|` of the lines, which is not small where impulses cancel.
    pub fn strength(&self) -> f64 {
        self.lines.iter().map(|l| self.ease(l) * l.impulse.abs()).sum()
    }

    /// `‖a‖_{M̂⁻¹}`.
    fn ease(&self, line: &Line) -> f64 {
        dot(self.now.line(line.index), self.solved.row(line.index)).abs().sqrt()
    }

    /// Adds `H r + G λ` to `out`.
    pub fn push(&self, out: &mut [f64]) {
        for line in self.lines.iter().filter(|l| l.impulse != 0.0) {
            let a = self.now.line(line.index);
            out.iter_mut().zip(a).for_each(|(out, a)| *out += line.impulse * a);
        }
    }

    /// The normals of the contacts and the limits that take part, among all lines.
    pub fn unilateral(&self) -> impl Iterator<Item = usize> + '_ {
        self.lines.iter().filter(|line| line.restitution.is_some()).map(|line| line.index)
    }

    /// The velocity of a line after the step, without what its law adds.
    pub fn after(&self, line: &Line, v: &[f64]) -> f64 {
        let at = if line.later { &self.end } else { &self.now };
        dot(at.line(line.index), v) + line.given
    }
}

impl Line {
    fn of(index: usize) -> Self {
        Self {
            index,
            later: false,
            steep: false,
            mean: false,
            restitution: None,
            given: 0.0,
            given_mean: 0.0,
            before: 0.0,
            shift: 0.0,
            value: 0.0,
            velocity: 0.0,
            offset: 0.0,
            impulse: 0.0,
        }
    }
}

//! The residuals of the contact law, which all judges of contacts share.

use super::contact::{Law, Share, length};
use super::loads::{Loads, ROUNDING};
use crate::check::{Measure, Motion, StatusCounts, Verdict, over};
use nonsmooth_linalg::{Real, norm, norm_of, power_of_two, small};

/// The rounding of a stored double, over its size, in the root mean square.
pub(crate) const HALF_ULP: f64 = 0.3 * f64::EPSILON;

/// What plain arithmetic makes of x and ũ is wrong by less than this, over `‖x‖ + ‖ũ‖`.
const PLAIN: f64 = 16.0 * f64::EPSILON;
/// Terms below this share of ‖q‖ have lost digits to underflow.
const LEAST: f64 = 1e-280;
/// Terms are no smaller than this part of the largest load that reaches a contact, the square of its rounding: what decays to 1e-130 on its way is not heard there.
const UNHEARD: f64 = f64::EPSILON * f64::EPSILON;

/// `√|d|` of a diagonal entry, the unit of what belongs to it; 1 where it vanishes.
pub(crate) fn unit(d: f64) -> f64 {
    match d.abs().sqrt() {
        unit if unit > 0.0 => unit,
        _ => 1.0,
    }
}

/// The largest ratio of violation to size; infinite if any is NaN.
pub(crate) fn worst(shares: impl Iterator<Item = (f64, f64)>) -> f64 {
    shares.fold(0.0, |worst: f64, (violation, size)| match over(violation.abs(), size) {
        share if share.is_nan() => f64::INFINITY,
        share => worst.max(share),
    })
}

/// The largest modulus in a block.
pub(crate) fn largest<const D: usize>(block: &[[f64; D]; D]) -> f64 {
    block.iter().flatten().fold(0.0, |l, x| l.max(x.abs()))
}

/// The mean diagonal of a block W_cc that is rounding, over its largest entry; of all blocks, over the mean of the moduli.
const NOISE: f64 = 1e-12;

/// `w_c`, the mean diagonal of W_cc; zero where that is a trace of rounding, as of a skew matrix.
#[inline]
pub(crate) fn trace<const D: usize>(block: &[[f64; D]; D]) -> f64 {
    let mean = small::mean_diagonal(block);
    if mean.abs() > NOISE * largest(block) { mean } else { 0.0 }
}

/// A contact whose impulse is below this part of what friction can hold sticks for certain.
const STICKS: f64 = 0.999;

/// What the square of the rounding of each entry of u counts in that of ũ, for the impulse `r` of the contact: as it is, and where it sticks those of a disk also the square of its coefficient, by which they
/// come back in ũ_N. Of what slides or is open the natural map feels ũ_N no more.
pub(crate) fn felt<L: Law<D>, const D: usize>(law: L, r: &[f64; D]) -> [f64; D] {
    let rows = (D - 1) / L::DISKS;
    std::array::from_fn(|k| {
        let Some(disk) = k.checked_sub(1).map(|k| k / rows) else { return 1.0 };
        let coefficient = law.coefficient(disk);
        let sticks = norm(&r[1 + disk * rows..][..rows]) < STICKS * coefficient * r[0];
        if sticks { 1.0 + coefficient * coefficient } else { 1.0 }
    })
}

/// What a measurement that decides knows of the velocities that it is given.
pub(crate) struct Care<'a, F> {
    /// The sizes of the terms of each entry.
    pub(crate) sizes: &'a [f64],
    /// By how much entry i may be wrong.
    pub(crate) doubt: F,
}

/// No care: of a measurement to steer by.
type NoCare = Care<'static, fn(usize) -> f64>;

/// A measurement to steer by.
pub(crate) const STEERING: Option<NoCare> = None;

/// What the contact law's residual needs of a problem: `w_c` and `‖q‖`, and what stands for both where a contact is measured by itself.
#[derive(Debug, Clone, Default)]
pub(crate) struct LawGauge {
    pub(crate) w: Vec<f64>,
    /// The largest modulus of W_cc, which is there where the trace is not, or what a neighbour makes of an impulse; zero where nothing is. Others may follow.
    pub(crate) strength: Vec<f64>,
    pub(crate) loads: Loads,
    /// Moduli of loads, and room for as many.
    pub(crate) amounts: Vec<f64>,
    pub(crate) impulses: Vec<f64>,
    pub(crate) norm_q: f64,
    /// Where scalar rows take part: the size of q with them in force, as far as it is known without a point, and that of all loads.
    with_rows: Option<(f64, f64)>,
}

/// Solvers leave at most so much of the loads where there is nothing: what rounding makes of matrices that are ill conditioned by 1e3.
const AT_MOST: f64 = 1e-12;

/// The part of the loads that q counts at least where scalar rows take up some of them.
const OF_LOADS: f64 = 1e-6;

impl LawGauge {
    pub(crate) fn new(diagonal: impl Iterator<Item = f64>) -> Self {
        let mut gauge = Self::default();
        gauge.refill(diagonal, 0.0);
        gauge
    }

    pub(crate) fn refill(&mut self, diagonal: impl Iterator<Item = f64>, norm_q: f64) {
        self.norm_q = norm_q;
        self.with_rows = None;
        self.w.clear();
        self.w.extend(diagonal);
        let (sum, moduli) = self.w.iter().fold((0.0, 0.0), |(s, m), w| (s + w, m + w.abs()));
        let stand_in = if sum > NOISE * moduli { sum / self.w.len() as f64 } else { 1.0 };
        for w in &mut self.w {
            if *w <= 0.0 {
                *w = stand_in;
            }
        }
    }

    /// What residuals are relative to where scalar rows take part: the size of q with the free rows in force, as far as it is known. Without them it may be rounding, as of what rests on a table that
    /// a joint holds and that would fall with it, or so large that contacts hide behind it. No less than a millionth of the loads that reach the contacts, of which the rest may be rounding, and no more than they are.
    pub(crate) fn measure_by(&mut self, enforced: Option<f64>) {
        let reaching = norm_of((0..self.w.len()).map(|c| self.loads.reaching(c)));
        let loads = self.norm_q.max(reaching);
        let known = enforced.filter(|q| q.is_finite()).unwrap_or(self.norm_q);
        self.with_rows = (loads > 0.0 && loads.is_finite()).then_some((known, loads));
        self.measure_at(known);
    }

    /// The same at a point whose multipliers leave so much of q, if that is less: rows between their bounds are in force there, and without them a light part would make velocities behind which contacts hide.
    pub(crate) fn measure_at(&mut self, left: f64) {
        if let Some((known, loads)) = self.with_rows {
            self.norm_q = known.min(left).max(OF_LOADS * loads).min(loads);
        }
    }

    /// What stands for w_c where contact c is measured by itself.
    pub(crate) fn own_w(&self, c: usize) -> f64 {
        match self.strength.get(c) {
            Some(&strength) if strength > 0.0 => strength,
            _ => self.w[c],
        }
    }

    /// What the residual is relative to.
    pub(crate) fn unit(&self) -> f64 {
        if self.norm_q > 0.0 { self.norm_q } else { 1.0 }
    }

    /// Sets impulses to zero whose answer, by what a contact does to itself, is lost in the rounding of the loads that reach it: beside others of any size they are zero but for rounding, and yet all that
    /// their contact is measured by. Whether there are any.
    pub(crate) fn tidy<L: Law<D>, const D: usize>(&self, r: &mut [f64], boldly: bool) -> bool {
        let rounding = if boldly { AT_MOST } else { ROUNDING };
        // Moments are in other units, and no larger than the impulses allow.
        let of_force = 1 + (D - 1) / L::DISKS;
        let mut changed = false;
        for (c, block) in r.chunks_exact_mut(D).enumerate() {
            let (answer, load) = (self.own_w(c) * norm(&block[..of_force]), self.loads.reaching(c));
            if answer > 0.0 && answer <= rounding * load && load.is_finite() {
                block.fill(0.0);
                changed = true;
            }
        }
        changed
    }

    /// Whether the sum of the natural map's squares in plain arithmetic, the first that decides, lets the impulses pass at `tolerance`.
    pub(crate) fn may_pass<L: Law<D>, const D: usize>(
        &self,
        (r, u): (&[f64], &[f64]),
        law: impl Fn(usize) -> L,
        tolerance: f64,
    ) -> bool {
        let squares = self.w.iter().enumerate().map(|(c, &w)| {
            let modified = law(c).modified_velocity(&small::block(u, c));
            let map = law(c).natural_map(&small::block(r, c).map(|r: f64| w * r), &modified);
            map.iter().map(|x| x * x).sum::<f64>()
        });
        // Where squares leave the range of double precision, the measurement tells.
        squares.sum::<f64>() <= (1.01 * tolerance * self.unit()).powi(2).max(f64::MIN_POSITIVE)
    }

    /// What is beside the relative residual at large mu must not profit from the rounding of u, `doubt` times the `sizes` of its terms.
    pub(crate) fn rounding_of_dual<L: Law<D>, const D: usize>(
        &self,
        laws: impl Iterator<Item = L>,
        doubt: f64,
        sizes: &[f64],
    ) -> f64 {
        let steepest = laws.map(|law| law.softened().growth()).fold(0.0, f64::max);
        over(steepest * doubt * norm(sizes), self.norm_q)
    }

    /// The residuals of the impulses `r` with the velocities `u`, to steer by or, with `care`, to decide by. There what the arithmetic T leaves in doubt is added to the
    /// residuals that decide, so that they never promise too much.
    ///
    /// All is done in units of a power of two near its scale, so that no square leaves the range of double precision
    /// before the data do.
    pub(crate) fn measure<T: Real, L: Law<D>, const D: usize>(
        &self,
        at: (&[f64], &[T]),
        care: Option<Care<impl Fn(usize) -> f64>>,
        law: impl Fn(usize) -> L,
    ) -> Measure {
        self.measure_apart(at, care, law).0
    }

    /// As [`measure`](Self::measure), and the relative residual without what is left in doubt.
    pub(crate) fn measure_apart<T: Real, L: Law<D>, const D: usize>(
        &self,
        (r, u): (&[f64], &[T]),
        care: Option<Care<impl Fn(usize) -> f64>>,
        law: impl Fn(usize) -> L,
    ) -> (Measure, f64) {
        let unit = power_of_two(self.unit());
        let largest = u.iter().map(|u| u.value() / unit);
        let plain = match self.norm_q.max(norm(r)).max(unit * norm_of(largest)) {
            largest if largest > 0.0 => largest,
            _ => 1.0,
        };
        let plain_unit = power_of_two(plain);
        let (per, plain_per) = (1.0 / unit, 1.0 / plain_unit);
        let (mut scaled, mut plain_map, mut doubts) = (0.0, 0.0, 0.0);
        let (mut primal, mut dual, mut complementarity) = (0.0, 0.0, 0.0);
        let (mut worst_contact, mut worst) = (0, 0.0);
        let (mut own_contact, mut own) = (0, 0.0);
        for (c, &w) in self.w.iter().enumerate() {
            let law = law(c);
            let rc: [f64; D] = small::block(r, c);
            let uc: [T; D] = std::array::from_fn(|k| u[D * c + k]);
            let plain_u = uc.map(|u| u.value());
            let plain_modified = law.modified_velocity(&plain_u);
            let near = (rc.map(|r| w * r * per), plain_modified.map(|u| u * per));
            let plainly = || Share::new(law, &near.0, &plain_u.map(|u| u * per), &near.1);
            let (share, left) = if care.is_none() {
                (plainly(), 0.0)
            } else {
                let size = length(&near.0) + length(&near.1);
                // Of most contacts the natural map is ũ or x: once these are known, plain arithmetic is right to the last bits.
                if law.is_at_rest_or_open(&near.0, &near.1, PLAIN * size) {
                    let share = plainly();
                    let left = PLAIN * share.residual.sqrt();
                    (share, left)
                } else {
                    let x = rc.map(|r| T::of_product(w, r).times_power(per));
                    let u = uc.map(|u| u.times_power(per));
                    let modified = law.modified_velocity(&u);
                    (Share::new(law, &x, &u, &modified), T::DOUBT * size)
                }
            };
            if share.residual > worst || share.residual.is_nan() {
                (worst_contact, worst) = (c, share.residual);
            }
            scaled += share.residual;
            // A measurement to steer by leaves out what only decides.
            if let Some(Care { sizes, doubt }) = &care {
                let of_u = norm_of((D * c..D * c + D).map(|i| doubt(i) * per));
                let left = left + law.growth() * of_u;
                doubts += left * left;
                // Impulses that run away along the kernel of W make terms of any size: no more than the loads excuse.
                let load = self.loads.reaching(c) * per;
                let strength = self.own_w(c);
                let own_x = rc.map(|r| strength * r * per);
                let own_u = plain_u.map(|u| u * per);
                // A sliding direction is wrong by 2‖δu‖/‖u_T‖, and what lies across it by no more than the sliding itself.
                let astray = (2.0 * law.growth() * norm(&own_x) * of_u).sqrt();
                let apart = law.apart(&own_x, &own_u) + astray.min(small::tangential_norm(&own_u));
                // Of an empty block the impulse is no term, but may be all there is.
                let terms = norm_of((D * c..D * c + D).map(|i| sizes[i] * per));
                let heard = (UNHEARD * load).max(LEAST);
                let terms = terms.max(norm(&own_x)).min(load).max(heard);
                let normal = (sizes[D * c] * per).min(load).max(heard);
                // Below the range of double precision there are no digits to be right.
                let error = share.residual.sqrt().max(apart) + left;
                // No sliding, however fast, excuses a velocity into the obstacle, but for what a frame turned by its rounding makes of the
                // contact's terms.
                let rounding = f64::EPSILON * terms.max(norm(&own_u));
                let sinking = (doubt(D * c) - plain_u[0]) * per - rounding;
                let sinking = over(sinking.max(0.0), normal);
                let of_own = over(error, terms).max(sinking);
                if load > 0.0 && (of_own > own || of_own.is_nan()) {
                    (own_contact, own) = (c, of_own);
                }
            }
            let plain_r = rc.map(|r| r * plain_per);
            let map = law.natural_map(&plain_r, &plain_modified.map(|u| u * plain_per));
            plain_map += map.iter().map(|v| v * v).sum::<f64>();
            primal += share.primal;
            dual += share.dual;
            complementarity += share.complementarity;
        }
        // From units of a power of two to those of q.
        let q = unit / self.unit();
        let relative = (scaled.sqrt() + doubts.sqrt()) * q;
        let measure = Measure {
            absolute: relative * self.unit(),
            relative,
            literature: plain_map.sqrt() * (plain_unit / self.unit()),
            siconos: plain_map.sqrt() * (plain_unit / plain),
            primal: primal.sqrt() * q,
            dual: dual.sqrt() * q,
            complementarity: complementarity * q * q,
            own: care.is_some().then_some(own),
            own_contact: care.is_some().then_some(own_contact),
            worst_contact,
            worst: worst.sqrt() * q,
            ..Measure::unknown()
        };
        (measure, scaled.sqrt() * q)
    }
}

/// The verdict on impulses and velocities that have been measured.
pub(crate) fn verdict<L: Law<D>, const D: usize>(
    measure: Measure,
    gauge: &LawGauge,
    r: &[f64],
    u: &[f64],
    law: impl Fn(usize) -> L,
    tolerance: f64,
) -> Verdict {
    let margin = if gauge.norm_q > 0.0 { tolerance * gauge.norm_q } else { tolerance };
    let mut counts = StatusCounts::default();
    let mut statuses = Vec::with_capacity(gauge.w.len());
    let mut worst = Vec::with_capacity(gauge.w.len());
    for (c, &w) in gauge.w.iter().enumerate() {
        let law = law(c);
        let x = small::block::<D>(r, c).map(|v| w * v);
        let modified = law.modified_velocity(&small::block(u, c));
        let s = law.status(&x, &modified, margin);
        match s.status {
            Motion::Open => counts.open += 1,
            Motion::Stick => counts.stick += 1,
            Motion::Slip => counts.slip += 1,
        }
        counts.at_limit += usize::from(s.at_limit);
        counts.degenerate += usize::from(s.degenerate);
        counts.rolling += usize::from(s.rolls);
        statuses.push(s);
        let share = law.natural_map(&x, &modified).iter().map(|v| v * v).sum::<f64>().sqrt();
        worst.push((c, over(share, gauge.norm_q)));
    }
    worst.sort_by(|a, b| b.1.total_cmp(&a.1));
    worst.truncate(10);
    Verdict {
        measure,
        solved: measure.passes(tolerance),
        counts,
        statuses,
        velocity: u.to_vec(),
        worst,
    }
}

//! The judge of the global problem.

use crate::check::proof::{Exactly, bounded, exacts, just, monotone};
use crate::check::rows::{Rows, doubt};
use crate::check::{
    ConeSystem, ContactStatus, Judged, Kinematic, Kinematics, Law, Measure, Monotone, StatusCounts,
    Verdict, over,
};
use crate::kinds::contact::judge::Weighed;
use crate::kinds::contact::judge::gauge::{
    Care, HALF_ULP, LawGauge, STEERING, felt, largest, trace, unit, worst,
};
use crate::kinds::contact::judge::loads::ROUNDING;
use crate::kinds::contact::judge::statement::{contacts, opposite, under};
use crate::kinds::contact::judge::weighed::{
    arm, as_given, divide, multiply, verdict_weighed, weight,
};
use crate::kinds::contact::law::RollingData;
use crate::{Dynamics, FrictionGlobal, GlobalPoint, Problem, ProblemError};
use nonsmooth_linalg::{Csc, Delassus, Doubled, Inverse, Refine, norm, norm_of, small};

/// The judge's constants and buffers for a [`FrictionGlobal`]: among them its own factorisation of the dynamics.
#[derive(Debug, Clone)]
pub struct GlobalGauge {
    law: LawGauge,
    dynamics: Dynamics,
    /// `M⁻¹` alone and its scratch, where bilateral constraints border the dynamics.
    free: Option<(Inverse, Vec<f64>)>,
    /// w_c belongs to this H.
    h: Csc,
    reach: Reach,
    q: Vec<f64>,
    u: Vec<f64>,
    /// u with all its digits.
    exact: Vec<Doubled>,
    own: State,
    buffer: Vec<f64>,
    /// The units of the velocities of contacts, constraints and motions.
    units: Vec<f64>,
    rows: Rows,
    /// `H r + f` of the point that is measured.
    load: Rows,
}

/// The judge's own v and λ: high and low parts, what is not known of them, and room for more.
#[derive(Debug, Clone)]
struct State {
    high: Vec<f64>,
    low: Vec<f64>,
    last: Vec<f64>,
    spare: Vec<f64>,
}

/// What it takes to know the size of the terms of each velocity: `|w| + |H|ᵀ|M⁻¹|(|f| + |H||r| + |G||λ|)`.
#[derive(Debug, Clone, Default)]
struct Reach {
    /// Small components of M: their unknowns and `|M⁻¹|` there.
    small: Vec<(Vec<usize>, Vec<f64>)>,
    /// Contacts of large components, whose inverse is not known by entries, by component.
    large: Vec<Vec<usize>>,
    sizes: Vec<f64>,
    /// `|f| + |H||r| + |G||λ|`.
    load: Vec<f64>,
}

/// A velocity q without impulses below this part of its terms may be rounding.
const SMALL_REST: f64 = 1e-12;

/// One below this part of them is that of doubled precision.
const NO_REST: f64 = 1e-26;

/// A last correction of this size, over that of the largest velocity, is below all that is compared.
const KNOWN: f64 = 1e-24;

/// Components of M whose inverse is formed.
const SMALL: usize = 48;

impl Reach {
    fn new<const D: usize>(h: &Csc, inverse: &Inverse) -> Self {
        let mut reach = Self { load: vec![0.0; h.nrows()], ..Self::default() };
        reach.sizes.resize(h.ncols(), 0.0);
        let (mut column, mut scratch) = (vec![], vec![0.0; inverse.scratch_len()]);
        let mut place = vec![usize::MAX; inverse.component_sizes().len()];
        for (k, n) in inverse.component_sizes().enumerate() {
            if n > SMALL {
                place[k] = reach.large.len();
                reach.large.push(vec![]);
                continue;
            }
            let mut entries = vec![0.0; n * n];
            for j in 0..n {
                column.clear();
                column.resize(n, 0.0);
                column[j] = 1.0;
                inverse.solve_component(k, &mut column, &mut scratch, Refine::Once);
                column.iter().enumerate().for_each(|(i, x)| entries[i * n + j] = x.abs());
            }
            reach.small.push((inverse.component(k).to_vec(), entries));
        }
        for i in 0..h.ncols() {
            for &row in h.column(i).0 {
                let component = place[inverse.component_of(row)];
                if component != usize::MAX && reach.large[component].last() != Some(&(i / D)) {
                    reach.large[component].push(i / D);
                }
            }
        }
        reach.large.iter_mut().for_each(Vec::dedup);
        reach
    }

    /// The sizes of the terms of each velocity for the impulses r and the multipliers; `loads` are those of `H r + f`.
    fn update<const D: usize, L: Law<D>>(
        &mut self,
        problem: &FrictionGlobal<D, L>,
        w: &[f64],
        (r, loads): (&[f64], &[f64]),
        (v, lambda): (&[f64], &[f64]),
        spare: &mut [f64],
    ) {
        let Self { small, large, sizes, load } = self;
        load.copy_from_slice(loads);
        for (b, j) in problem.rows.iter().flat_map(|b| (0..lambda.len()).map(move |j| (b, j))) {
            let (rows, values) = b.G.column(j);
            rows.iter().zip(values).for_each(|(&i, g)| load[i] += (g * lambda[j]).abs());
        }
        // Of a large component at least what comes of it.
        spare.copy_from_slice(v);
        for (index, entries) in &*small {
            let n = index.len();
            for (row, &i) in entries.chunks(n).zip(index) {
                spare[i] = row.iter().zip(index).map(|(m, &j)| m * load[j]).sum();
            }
        }
        for (i, size) in sizes.iter_mut().enumerate() {
            let (rows, values) = problem.H.column(i);
            let terms = rows.iter().zip(values).map(|(&j, h)| (h * spare[j]).abs());
            *size = problem.w[i].abs() + terms.sum::<f64>();
        }
        // |W_cj| ≤ √(w_c w_j).
        for contacts in &*large {
            let of = |c: usize| w[c].sqrt() * norm(&r[D * c..D * c + D]);
            let sum: f64 = contacts.iter().map(|&c| of(c)).sum();
            contacts.iter().for_each(|&c| sizes[D * c] += w[c].sqrt() * sum);
        }
    }
}

impl GlobalGauge {
    pub(crate) fn new<const D: usize, L: Law<D>>(
        problem: &FrictionGlobal<D, L>,
    ) -> Result<Self, ProblemError> {
        let dynamics = Dynamics::new(problem)?;
        // W = Hᵀ M⁻¹ H and q = Hᵀ M⁻¹ f + w are those of the free dynamics, with bilateral rows apart.
        let free = match problem.rows {
            Some(_) => {
                let free = Inverse::new(&problem.M, "M")?;
                let scratch = vec![0.0; free.scratch_len()];
                Some((free, scratch))
            }
            None => None,
        };
        let inverse = free.as_ref().map_or(&dynamics.inverse, |f| &f.0);
        let diagonal = Delassus::<D>::diagonal(&problem.H, inverse);
        let (m, n) = (problem.w.len(), problem.dofs() + problem.multipliers());
        let zeros = vec![0.0; n];
        let mut gauge = Self {
            law: LawGauge::new(diagonal.iter().map(trace)),
            reach: Reach::new::<D>(&problem.H, inverse),
            dynamics,
            free,
            h: problem.H.clone(),
            q: vec![0.0; m],
            u: vec![0.0; m],
            exact: vec![Doubled::default(); m],
            own: State {
                high: zeros.clone(),
                low: zeros.clone(),
                last: zeros,
                spare: vec![0.0; n.max(m)],
            },
            buffer: vec![0.0; problem.dofs()],
            units: vec![],
            rows: Rows::default(),
            load: Rows::default(),
        };
        gauge.law.strength = diagonal.iter().map(largest).collect();
        gauge.couple(problem);
        gauge.rescale(problem);
        // The longest use of the rows, so that a measurement allocates nothing.
        let longest = problem.dofs().max(problem.w.len()).max(problem.multipliers());
        gauge.rows.start_at_zero(longest);
        gauge.load.start_at_zero(problem.dofs());
        Ok(gauge)
    }

    pub(crate) fn refill<const D: usize, L: Law<D>>(
        &mut self,
        problem: &FrictionGlobal<D, L>,
    ) -> Result<(), ProblemError> {
        if self.dynamics.serves(problem) && self.h == problem.H {
            self.rescale(problem);
        } else {
            *self = Self::new(problem)?;
        }
        Ok(())
    }

    /// q from the present f and w, in doubled precision before it is rounded: of a body nearly at rest its terms cancel.
    fn rescale<const D: usize, L: Law<D>>(&mut self, problem: &FrictionGlobal<D, L>) {
        let Self { dynamics, free, own, rows, q, law, units, .. } = self;
        let n = problem.dofs();
        let State { high, low, last, .. } = own;
        match free {
            None => {
                // Without impulses.
                dynamics.solve_doubled(problem, &[], [high, low, last]);
            }
            Some((free, scratch)) => {
                high[..n].copy_from_slice(&problem.f);
                low.fill(0.0);
                let parts = [&mut high[..n], &mut low[..n], &mut last[..n]];
                let [high, low, last] = parts;
                free.solve_doubled(high, low, last, scratch);
            }
        }
        rows.precisely(true);
        rows.start(&problem.w);
        rows.add_transposed(&problem.H, &high[..n]);
        rows.add_transposed(&problem.H, &low[..n]);
        q.iter_mut().zip(rows.values()).for_each(|(q, x)| *q = x);
        law.norm_q = norm(q);
        let terms = norm(rows.sizes());
        if law.norm_q <= SMALL_REST * terms {
            // Of a q that is zero the sum leaves its rounding, and what is not known of v.
            let unknown = (0..q.len()).map(|i| {
                let (at, values) = problem.H.column(i);
                at.iter().zip(values).map(|(&j, h)| (h * last[j]).abs()).sum::<f64>()
            });
            if law.norm_q <= NO_REST * terms + norm_of(unknown) {
                q.fill(0.0);
                law.norm_q = 0.0;
            }
        }
        let motion = problem.contacts() + problem.multipliers();
        let violations = problem.rows.iter().flat_map(|b| {
            // An impulse that has to be there is a load too.
            let given = |j: usize| of_impulse(problem, &b.G, j) * b.bounds.least(j).abs();
            b.b.iter().enumerate().map(move |(j, b)| b.abs().max(given(j)))
        });
        let forces = problem.f.iter().zip(&units[motion..]).map(|(f, unit)| f.abs() * unit * unit);
        law.loads.spread(q.chunks(D).map(norm).chain(violations).chain(forces));
        if let Some(b) = &problem.rows {
            law.amounts.clear();
            law.amounts.extend((0..b.b.len()).map(|j| b.bounds.least(j)));
            dynamics.hold(&law.amounts);
            dynamics.solve_doubled(problem, &[], [high, low, last]);
            rows.start(&problem.w);
            rows.add_transposed(&problem.H, &high[..n]);
            rows.add_transposed(&problem.H, &low[..n]);
            law.measure_by(Some(rows.norm()));
        }
    }

    /// Velocities of bodies carry the loads from contact to contact. The unit of a velocity is 1/√M_ii, that of a row of Hᵀ or Gᵀ the most that it
    /// makes of such velocities: w_c would be too small where its terms cancel.
    fn couple<const D: usize, L: Law<D>>(&mut self, problem: &FrictionGlobal<D, L>) {
        let Self { law, units, .. } = self;
        let (n, nc, p) = (problem.dofs(), problem.contacts(), problem.multipliers());
        let motion = nc + p;
        let of_contacts = problem.H.triplets().map(|(i, j, x)| (j / D, motion + i, x));
        let constraints = problem.rows.iter().flat_map(|b| b.G.triplets());
        let rows = of_contacts.chain(constraints.map(|(i, j, x)| (nc + j, motion + i, x)));
        let rows = || rows.clone().filter(|(_, _, x)| *x != 0.0);
        units.clear();
        units.resize(motion, 0.0);
        units.extend((0..n).map(|i| 1.0 / unit(problem.M.get(i, i))));
        for (row, i, x) in rows() {
            units[row] = units[row].max(x.abs() * units[i]);
        }
        let loads = &mut law.loads;
        loads.start(units.len());
        for (row, i, _) in rows() {
            loads.couple(row, i, || units[row] / units[i]);
        }
        for (i, j, _) in problem.M.triplets().filter(|e| e.2 != 0.0) {
            loads.couple(motion + i, motion + j, || units[motion + i] / units[motion + j]);
        }
    }

    pub(crate) fn measure<const D: usize, L: Law<D>>(
        &mut self,
        problem: &FrictionGlobal<D, L>,
        point: &GlobalPoint,
        precisely: bool,
    ) -> Measure {
        let Self { law, dynamics, free, reach, u, exact, own: state, buffer, rows, load, .. } =
            self;
        let n = problem.dofs();
        load.precisely(precisely);
        load.start(&problem.f);
        load.add(1.0, &problem.H, &point.r);
        // ‖H r‖ but for rounding, which matters where it is smaller than ‖f‖ alone.
        let of_impulses = load.values().zip(&problem.f).map(|(load, f)| load - f);
        let force = norm(&problem.f).max(norm_of(of_impulses));
        dynamics.hold(&point.lambda);
        let given = imbalance(problem, (&point.v, &[]), &point.lambda, force, (load, rows));
        let State { high, low, last, spare } = state;
        if precisely {
            dynamics.solve_doubled_under(problem, load.parts(), [high, low, last]);
        } else {
            let (v, lambda) = dynamics.solve_under(problem, load.values(), Refine::Fully);
            high[..n].copy_from_slice(v);
            high[n..].copy_from_slice(lambda);
            low.fill(0.0);
        }
        let ((v, lambda), (v_low, _)) = (high.split_at(n), low.split_at(n));
        // A solution that is known to the last digit leaves nothing.
        let size = high.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
        let known = precisely && last.iter().all(|x| x.abs() <= KNOWN * size);
        let own = if known {
            Imbalance { residual: 0.0, ..given }
        } else {
            imbalance(problem, (v, v_low), lambda, force, (load, rows))
        };
        let bounded = problem.rows.as_ref().filter(|b| !b.bounds.are_free());
        if let (Some(b), Some((free, scratch))) = (bounded, free) {
            rows.start(&problem.f);
            rows.add(1.0, &b.G, lambda);
            spare[..n].iter_mut().zip(rows.values()).for_each(|(x, f)| *x = f);
            free.solve_with(&mut spare[..n], scratch, Refine::Once);
            rows.start(&problem.w);
            rows.add_transposed(&problem.H, &spare[..n]);
            law.measure_at(rows.norm());
        }
        rows.start(&problem.w);
        rows.add_transposed(&problem.H, v);
        let mut measure = if precisely {
            let of_r = (&point.r[..], load.sizes());
            reach.update(problem, &law.w, of_r, (v, lambda), &mut spare[..n]);
            rows.add_transposed(&problem.H, v_low);
            exact.iter_mut().zip(rows.doubled()).for_each(|(u, x)| *u = x);
            u.iter_mut().zip(rows.values()).for_each(|(u, x)| *u = x);
            let all = doubt(n + u.len());
            let (h, sums, sizes) = (&problem.H, rows.sizes(), &reach.sizes);
            let doubt = |i: usize| {
                let (at, values) = h.column(i);
                let of_v: f64 = at.iter().zip(values).map(|(&j, h)| (h * last[j]).abs()).sum();
                of_v + all * (sums[i] + sizes[i])
            };
            law.measure::<_, _, D>((&point.r, exact), Some(Care { sizes, doubt }), |c| {
                problem.law(c)
            })
        } else {
            u.iter_mut().zip(rows.values()).for_each(|(u, x)| *u = x);
            law.measure::<_, _, D>((&point.r, u), STEERING, |c| problem.law(c))
        };

        let worse = |a: f64, b: f64| if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) };
        measure.dynamics = Some(worse(given.residual, own.residual));
        measure.dynamics_rounding = Some(given.rounding.max(own.rounding));
        for (i, gap) in buffer.iter_mut().enumerate() {
            let missing = (point.v[i] - v[i]) - v_low[i];
            // The last bits of v are no gap.
            *gap = if missing.abs() <= ROUNDING * v[i].abs() { 0.0 } else { missing };
        }
        rows.start_at_zero(problem.w.len());
        if buffer.iter().any(|gap| *gap != 0.0) {
            rows.add_transposed(&problem.H, buffer);
        }
        measure.velocity_gap = Some(over(rows.norm(), law.norm_q));

        if let Some(b) = &problem.rows {
            // |Gᵀ v + b|, or what the bounds make of it, against its terms, beyond what the rounding of velocities of a typical size makes of them: at rest these are what is
            // left of the forces' terms.
            let unit = |i: usize| unit(problem.M.get(i, i));
            let of_motion = point.v.iter().zip(load.sizes()).enumerate();
            let of_motion = of_motion.map(|(i, (v, f))| (v.abs() * unit(i)).max(f / unit(i)));
            let of_rows = b.G.triplets().map(|(i, j, g)| (g * point.lambda[j]).abs() / unit(i));
            let typical = of_motion.chain(of_rows).fold(0.0, f64::max);
            rows.start(&b.b);
            rows.add_transposed(&b.G, &point.v);
            let shares = rows.values().zip(rows.sizes()).enumerate().map(|(j, (sum, &size))| {
                let (at, values) = b.G.column(j);
                let weight: f64 = at.iter().zip(values).map(|(&i, g)| g.abs() / unit(i)).sum();
                let (lambda, w) = (point.lambda[j], of_impulse(problem, &b.G, j));
                law.loads.excused(problem.contacts() + j, typical * weight, |rounding| {
                    b.bounds.violation(j, (lambda, sum), w, (size, rounding))
                })
            });
            measure.bilateral = Some(worst(shares));
        }
        if precisely {
            let signed = &mut spare[..problem.w.len()];
            measure.floor = Some(floor(problem, &point.r, law, dynamics, signed));
        }
        measure
    }

    /// The residuals in units of velocity, where rolling friction needs an arm for that.
    pub(crate) fn measure_weighed<const D: usize, L: Law<D>>(
        &mut self,
        problem: &FrictionGlobal<D, L>,
        point: &GlobalPoint,
        precisely: bool,
    ) -> Measure {
        let Some(arms) = problem.arms() else { return self.measure(problem, point, precisely) };
        let mut inner = point.clone();
        divide::<D>(&arms, &mut inner.r);
        let mut measure = self.measure(&problem.weighed(&arms), &inner, precisely);
        let (mut u, mut q) = (self.u.clone(), self.q.clone());
        divide::<D>(&arms, &mut u);
        divide::<D>(&arms, &mut q);
        as_given(&mut measure, (&point.r, &u, norm(&q)), |c| problem.law(c));
        measure
    }

    /// The velocities of the n degrees of freedom and the multipliers that follow from the impulses of the last point measured.
    pub(super) fn motion(&self, n: usize) -> (&[f64], &[f64]) {
        self.own.high.split_at(n)
    }

    /// What the contact law's residual needs.
    pub(super) fn law(&self) -> &LawGauge {
        &self.law
    }

    /// The velocity of the last point measured.
    pub(super) fn velocity(&self) -> &[f64] {
        &self.u
    }
}

/// The velocity that a unit impulse of row j makes of itself, as if M were diagonal: a unit; 1 of a row that no impulse moves.
fn of_impulse<const D: usize, L: Law<D>>(problem: &FrictionGlobal<D, L>, g: &Csc, j: usize) -> f64 {
    let (rows, values) = g.column(j);
    match rows.iter().zip(values).map(|(&i, g)| (g / unit(problem.M.get(i, i))).powi(2)).sum() {
        w if w > 0.0 => w,
        _ => 1.0,
    }
}

/// What the rounding of r to doubles alone makes of the residual, in the root mean square: by one response to
/// impulses of the size of that rounding with signs in no order, since W itself is not known.
fn floor<const D: usize, L: Law<D>>(
    problem: &FrictionGlobal<D, L>,
    r: &[f64],
    law: &LawGauge,
    dynamics: &mut Dynamics,
    signed: &mut [f64],
) -> f64 {
    for (i, (signed, r)) in signed.iter_mut().zip(r).enumerate() {
        // The sign of a fixed hash of the place.
        let hash = (i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_mul(i as u64 | 1);
        *signed = if hash >> 63 == 0 { *r } else { -r };
    }
    let response = dynamics.respond(problem, signed, Refine::Once);
    let of_contact = |c: usize| {
        let felt = felt::<L, D>(problem.law(c), &small::block(r, c));
        (0..D).map(move |k| problem.H.column_dot(D * c + k, response) * felt[k].sqrt())
    };
    HALF_ULP * norm_of((0..problem.contacts()).flat_map(of_contact)) / law.unit()
}

/// The residual of the dynamics and what of it the rounding of v explains.
struct Imbalance {
    residual: f64,
    rounding: f64,
}

/// `‖M v − H r − f − G λ‖` over `force = max(‖f‖, ‖H r‖)`, of `load = H r + f`; v may have a low part.
fn imbalance<const D: usize, L: Law<D>>(
    problem: &FrictionGlobal<D, L>,
    (v, v_low): (&[f64], &[f64]),
    lambda: &[f64],
    force: f64,
    (load, rows): (&Rows, &mut Rows),
) -> Imbalance {
    rows.start_from(load);
    if let Some(b) = &problem.rows {
        rows.add(1.0, &b.G, lambda);
    }
    rows.add(-1.0, &problem.M, v);
    rows.add(-1.0, &problem.M, v_low);
    Imbalance {
        residual: over(rows.norm(), force),
        rounding: over(16.0 * f64::EPSILON * norm(rows.sizes()), force),
    }
}

impl<const D: usize, L: Law<D>> Judged for FrictionGlobal<D, L> {
    type Status = ContactStatus;
    type Counts = StatusCounts;

    fn verdict(&self, point: &GlobalPoint, gauge: &mut Self::Gauge, tolerance: f64) -> Verdict {
        let measure = self.certify(point, gauge);
        let (law, u) = (&gauge.law, gauge.velocity());
        verdict_weighed(self, Self::law, measure, law, (&point.r, u), tolerance)
    }
}

impl<const D: usize, L: Law<D>> Kinematic<D> for FrictionGlobal<D, L> {
    fn kinematics(&self) -> Kinematics<D> {
        let m = self.w.len();
        let mut rows = vec![];
        rows.extend(self.H.triplets().map(|(i, j, x)| (j, i, x)));
        let mut constant = self.w.clone();
        if let Some(b) = &self.rows {
            rows.extend(b.G.triplets().map(|(i, j, x)| (m + j, i, x)));
            constant.extend_from_slice(&b.b);
        }
        Kinematics::new(&rows, self.dofs(), constant, (&self.mu, self.mu_r.values()), 0.0)
    }

    fn motion(point: &GlobalPoint) -> Vec<f64> {
        point.v.clone()
    }

    fn monotone(&self) -> Monotone {
        match monotone(&self.M) {
            // The motions of a semidefinite M need not be bounded; that of an invertible M cannot be nearly definite.
            Monotone::Proved { definite: false } | Monotone::Nearly { .. } => Monotone::Unknown,
            known => known,
        }
    }
}

/// `M v − H r − G λ = f`, `u − Hᵀ v = w`, `c − Gᵀ v = b`.
impl<const D: usize, L: Law<D>> Exactly for FrictionGlobal<D, L> {
    fn system(&self, wanted: Option<&[bool]>) -> Option<ConeSystem> {
        let (n, m) = (self.dofs(), self.w.len());
        let mut rhs = exacts(&[&self.f[..], &self.w].concat());
        rhs.extend(self.rows.iter().flat_map(|b| exacts(&b.b)));
        let mut system = ConeSystem::new(rhs, wanted);
        let mut velocities = opposite(&self.M, 0, &system);
        velocities.iter_mut().flatten().for_each(|(_, x)| *x = -std::mem::take(x));
        velocities = under(velocities, opposite(&self.H.transpose(), n, &system));
        let mut multipliers = vec![];
        if let Some(b) = &self.rows {
            velocities = under(velocities, opposite(&b.G.transpose(), n + m, &system));
            multipliers = opposite(&b.G, 0, &system);
        }
        let velocities: Vec<_> = velocities.into_iter().map(|c| system.column(c)).collect();
        system.free.extend(&velocities);
        let bounds = self.rows.iter().flat_map(|b| (0..b.b.len()).map(|j| b.bounds.of(j)));
        let multipliers = multipliers.into_iter().zip(bounds).enumerate();
        let of_row = |(j, (c, bounds))| bounded(&mut system, n + m + j, c, bounds);
        let multipliers: Vec<_> = multipliers.map(of_row).collect();
        let impulses = opposite(&self.H, 0, &system);
        let laws: Vec<L> = (0..self.contacts()).map(|c| self.law(c)).collect();
        let impulses = contacts::<L, D>(&mut system, n, impulses, &laws);
        system.unknowns = velocities.into_iter().map(just).collect();
        system.unknowns.extend(impulses);
        system.unknowns.extend(multipliers);
        Some(system)
    }

    fn rows(&self) -> usize {
        self.dofs() + self.w.len() + self.multipliers()
    }

    fn weight(&self, row: usize) -> f64 {
        let mass = if row < self.dofs() { self.M.get(row, row) } else { 1.0 };
        if mass > 0.0 { mass } else { 1.0 }
    }

    fn impulses_from(&self) -> Option<usize> {
        Some(self.dofs())
    }
}

impl<const D: usize, L: Law<D>> Weighed for FrictionGlobal<D, L> {
    /// With the diagonal of M for M: of free bodies in their own axes that is M.
    fn arms(&self) -> Option<Vec<f64>> {
        (L::DISKS > 1).then(|| {
            let half = (D - 1) / 2;
            let of = |i: usize| {
                let (rows, values) = self.H.column(i);
                let terms = rows.iter().zip(values);
                terms.map(|(&j, h)| (h / unit(self.M.get(j, j))).powi(2)).sum::<f64>()
            };
            let trace = |rows: std::ops::Range<usize>| rows.map(of).sum::<f64>();
            let of_contact = |c: usize| {
                let first = D * c + 1;
                arm(trace(first..first + half), trace(first + half..D * (c + 1)))
            };
            (0..self.contacts()).map(of_contact).collect()
        })
    }

    fn weighed(&self, arms: &[f64]) -> Self {
        let entries = self.H.triplets().map(|(i, j, x)| (i, j, weight::<D>(arms, j) * x));
        let h = Csc::from_triplets(
            self.H.nrows(),
            self.H.ncols(),
            entries.collect::<Vec<_>>().into_iter(),
        );
        let mut out = Self {
            H: h.expect("in range"),
            mu_r: self.mu_r.scaled(|c| 1.0 / arms[c]),
            ..self.clone()
        };
        multiply::<D>(arms, &mut out.w);
        out
    }

    fn weigh(arms: &[f64], r: &mut [f64]) {
        divide::<D>(arms, r);
    }

    fn unweigh(arms: &[f64], r: &mut [f64]) {
        multiply::<D>(arms, r);
    }
}

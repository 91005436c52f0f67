//! The judge of the local problem.

use crate::check::proof::{Exactly, bounded, exacts, monotone, principal};
use crate::check::rows::{Rows, add_blocks_plainly, doubt};
use crate::check::{
    ConeSystem, ContactStatus, Judged, Kinematic, Kinematics, Law, Measure, Monotone, StatusCounts,
    Verdict,
};
use crate::kinds::contact::judge::Weighed;
use crate::kinds::contact::judge::gauge::{
    Care, HALF_ULP, LawGauge, STEERING, felt, largest, trace, unit, worst,
};
use crate::kinds::contact::judge::statement::{contacts, opposite, under};
use crate::kinds::contact::judge::weighed::{
    arm, as_given, divide, multiply, verdict_weighed, weight,
};
use crate::kinds::contact::law::RollingData;
use crate::{FrictionLocal, LocalPoint, Problem, RowsLocal};
use nonsmooth_linalg::{Csc, Doubled, Inverse, Real, Refine, norm, power_of_two, small};

/// The judge's constants and buffers for a [`FrictionLocal`].
#[derive(Debug, Clone)]
pub struct LocalGauge {
    law: LawGauge,
    u: Vec<f64>,
    /// u with all its digits and the size of its terms, when it was last certified.
    exact: Vec<Doubled>,
    sizes: Vec<f64>,
    rows: Rows,
    /// The most terms of an entry of u.
    terms: usize,
}

impl LocalGauge {
    pub(crate) fn new<const D: usize, L: Law<D>>(problem: &FrictionLocal<D, L>) -> Self {
        let mut gauge = Self {
            law: LawGauge::default(),
            u: Vec::new(),
            exact: Vec::new(),
            sizes: Vec::new(),
            rows: Rows::default(),
            terms: 0,
        };
        gauge.refill(problem);
        gauge
    }

    pub(crate) fn refill<const D: usize, L: Law<D>>(&mut self, problem: &FrictionLocal<D, L>) {
        let contacts = problem.contacts();
        let diagonal = (0..contacts).map(|c| trace(&problem.W.diagonal_block(c)));
        self.law.refill(diagonal, norm(&problem.q));
        self.mark_loads(problem);
        if let Some(rows) = &problem.rows {
            self.law.measure_by(enforced(&problem.q, rows));
        }
        let blocks = (0..contacts).map(|c| problem.W.row(c).0.len()).max().unwrap_or(0);
        self.terms = 1 + D * blocks + problem.multipliers();
        let m = problem.q.len();
        self.u.resize(m, 0.0);
        self.exact.resize(m, Doubled::default());
        self.sizes.clear();
        self.sizes.reserve(m.max(problem.multipliers()));
        self.sizes.resize(m, 0.0);
        // The longest use of the rows, so that a measurement allocates nothing.
        self.rows.start_at_zero(m.max(problem.multipliers()));
    }

    /// What stands for `w_c` of each contact by itself, and the loads that reach it through `[W, V; Vᵀ, R]`.
    fn mark_loads<const D: usize, L: Law<D>>(&mut self, problem: &FrictionLocal<D, L>) {
        let all = Saddle(problem);
        let LawGauge { strength, loads, amounts, impulses, .. } = &mut self.law;
        amounts.clear();
        amounts.extend(problem.q.chunks(D).map(norm));
        amounts.extend(problem.rows.iter().flat_map(|b| {
            // An impulse that has to be there is a load too.
            let given = |j: usize| (b.R.get(j, j) * b.bounds.least(j)).abs();
            b.s.iter().enumerate().map(move |(j, s)| s.abs().max(given(j)))
        }));
        let n = amounts.len();
        strength.clear();
        strength.extend((0..n).map(|i| all.entry(i, i)));
        if strength.contains(&0.0) {
            // Of an empty block what an impulse does through a neighbour, or the velocity that loads make over the impulse that answers them.
            let (known, missing) = (&mut *impulses, |x: f64| x == 0.0);
            known.clear();
            known.extend_from_slice(strength);
            all.each(|i, j, size| {
                if missing(known[i]) && known[j] > 0.0 {
                    strength[i] = strength[i].max(size() * all.entry(j, i) / known[j]);
                }
                true
            });
            known.fill(0.0);
            all.each(|i, j, size| {
                let a = size();
                if a > 0.0 {
                    known[j] = known[j].max(amounts[i] / a);
                }
                true
            });
            for i in 0..n {
                if missing(strength[i]) && known[i] > 0.0 {
                    strength[i] = amounts[i] / known[i];
                }
            }
        }
        loads.start(n);
        all.each(|i, j, size| {
            // Most of those that touch are coupled already.
            if loads.are_coupled(i, j) {
                return true;
            }
            let a = size();
            if a > 0.0 {
                loads.couple(i, j, || match (strength[i], strength[j], all.entry(j, i)) {
                    (_, s, 0.0) if s > 0.0 => a / s,
                    (r, s, back) if r > 0.0 && s > 0.0 => (r / s * (a / back)).sqrt(),
                    _ => amounts[i] / amounts[j],
                });
            }
            !loads.are_joined()
        });
        loads.spread(amounts.iter().copied());
        // A neighbour that answers may do more to a contact than that does to itself: √(W_cc |W_cj W_jc| / W_jj), and |W_cj W_jc| / W_jj where j is a free row, whatever the units of both.
        // Not where [W, V; Vᵀ, R] is positive semidefinite: there |W_cj|² ≤ W_cc W_jj.
        let nc = problem.contacts();
        let is_free = |j: usize| {
            j >= nc && problem.rows.as_ref().is_some_and(|rows| rows.bounds.is_free(j - nc))
        };
        let own = impulses;
        own.clear();
        own.extend_from_slice(strength);
        all.each(|i, j, size| {
            let a = size();
            if a / own[i] * (a / own[j]) > 4.0 {
                let through = a * (all.entry(j, i) / own[j]);
                let stands = if is_free(j) { through } else { (own[i] * through).sqrt() };
                if stands.is_finite() {
                    strength[i] = strength[i].max(stands);
                }
            }
            true
        });
    }

    /// Measures by the size of `q + V λ` at the point where rows have bounds.
    fn measure_at<const D: usize, L: Law<D>>(
        &mut self,
        problem: &FrictionLocal<D, L>,
        lambda: &[f64],
    ) {
        let Some(rows) = problem.rows.as_ref().filter(|rows| !rows.bounds.are_free()) else {
            return;
        };
        self.rows.start(&problem.q);
        self.rows.add(1.0, &rows.V, lambda);
        self.law.measure_at(self.rows.norm());
    }

    /// The residuals; `precisely` in doubled precision from the data to the last comparison.
    pub(crate) fn measure<const D: usize, L: Law<D>>(
        &mut self,
        problem: &FrictionLocal<D, L>,
        point: &LocalPoint,
        precisely: bool,
    ) -> Measure {
        self.rows.precisely(precisely);
        self.measure_at(problem, &point.lambda);
        let mut measure = if precisely {
            self.update_velocity_precisely(problem, point);
            let Self { law, exact, sizes, terms, .. } = self;
            let doubt = doubt(*terms);
            let care = Care { sizes, doubt: |i: usize| doubt * sizes[i] };
            let mut measure =
                law.measure::<_, _, D>((&point.r, exact), Some(care), |c| problem.law(c));
            measure.floor = Some(self.floor(problem, point));
            measure
        } else {
            self.update_velocity(problem, point);
            self.law.measure::<_, _, D>((&point.r, &self.u), STEERING, |c| problem.law(c))
        };
        measure.bilateral = self.violation(problem, point);
        measure
    }

    /// See [`Problem::accept`]: one plain pass over W, which knows the size of what it adds up.
    ///
    /// `|û − u|_i ≤ (n + 2) ε (|q| + |W||r|)_i` for n terms, twice the classical bound of a sum of products in any order (Higham2002, section 3.1); the law is evaluated with the
    /// relative error of plain arithmetic in place of the doubled one's. Where scalar rows or rolling friction take part nothing is said.
    pub(crate) fn accept<const D: usize, L: Law<D>>(
        &mut self,
        problem: &FrictionLocal<D, L>,
        point: &LocalPoint,
        tolerance: f64,
    ) -> Option<(Measure, f64)> {
        if problem.rows.is_some() || L::DISKS > 1 {
            return None;
        }
        let Self { law, u, sizes, terms, .. } = self;
        u.copy_from_slice(&problem.q);
        sizes.iter_mut().zip(&problem.q).for_each(|(size, q)| *size = q.abs());
        add_blocks_plainly(u, sizes, &problem.W, &point.r);
        let doubt = f64::EPSILON * (*terms + 2) as f64;
        let care = Care { sizes, doubt: |i: usize| doubt * sizes[i] };
        let (mut measure, relative) =
            law.measure_apart::<_, _, D>((&point.r, u), Some(care), |c| problem.law(c));
        let merit = Measure { relative, ..measure }.merit();
        let laws = (0..problem.contacts()).map(|c| problem.law(c));
        measure.dual += law.rounding_of_dual(laws, doubt, sizes);
        measure.passes(tolerance).then_some((measure, merit))
    }

    /// The residuals in units of velocity, where rolling friction needs an arm for that.
    pub(crate) fn measure_weighed<const D: usize, L: Law<D>>(
        &mut self,
        problem: &FrictionLocal<D, L>,
        point: &LocalPoint,
        precisely: bool,
    ) -> Measure {
        let Some(arms) = problem.arms() else { return self.measure(problem, point, precisely) };
        let mut inner = point.clone();
        divide::<D>(&arms, &mut inner.r);
        let mut measure = self.measure(&problem.weighed(&arms), &inner, precisely);
        let mut u = self.u.clone();
        divide::<D>(&arms, &mut u);
        as_given(&mut measure, (&point.r, &u, norm(&problem.q)), |c| problem.law(c));
        measure
    }

    /// The largest `|c_j|`, `c = Vᵀ r + R λ + s`, or of a row with bounds what [`Bounds::residual`](crate::Bounds::residual) makes of it, over the size of its terms, beyond what the rounding of impulses and multipliers of a typical
    /// size makes in row j: of a constraint without load all terms are rounding. A row without coefficients has no such excuse.
    fn violation<const D: usize, L: Law<D>>(
        &mut self,
        problem: &FrictionLocal<D, L>,
        point: &LocalPoint,
    ) -> Option<f64> {
        let RowsLocal { V, R, s, bounds } = problem.rows.as_ref()?;
        self.rows.start(s);
        self.rows.add_transposed(V, &point.r);
        self.rows.add(1.0, R, &point.lambda);
        // λ_j √|R_jj| and r_c √w_c are comparable, whatever the scale of a row or a contact.
        let unit = |j: usize| unit(R.get(j, j));
        let typical = |x: &[f64], unit: &dyn Fn(usize) -> f64| {
            (0..x.len()).fold(0.0_f64, |m, j| m.max(x[j].abs() * unit(j)))
        };
        let of_contact = |i: usize| self.law.own_w(i / D).sqrt();
        let typical_r = typical(&point.r, &of_contact);
        let typical_lambda = typical(&point.lambda, &unit);
        // R by rows through its columns: it need not be symmetric.
        let excuse = &mut self.sizes;
        excuse.clear();
        excuse.resize(s.len().max(point.r.len()), 0.0);
        for j in 0..s.len() {
            let (rows, values) = V.column(j);
            let v: f64 = rows.iter().zip(values).map(|(&i, v)| v.abs() / of_contact(i)).sum();
            excuse[j] += v * typical_r;
            let (rows, values) = R.column(j);
            for (&i, v) in rows.iter().zip(values) {
                excuse[i] += v.abs() / unit(j) * typical_lambda;
            }
        }
        let nc = problem.contacts();
        let shares = self.rows.values().zip(self.rows.sizes()).zip(&*excuse).enumerate();
        let share = worst(shares.map(|(j, ((sum, &size), excuse))| {
            let (lambda, w) = (point.lambda[j], unit(j).powi(2));
            self.law.loads.excused(nc + j, *excuse, |rounding| {
                bounds.violation(j, (lambda, sum), w, (size, rounding))
            })
        }));
        self.sizes.truncate(point.r.len());
        Some(share)
    }

    /// What the contact law's residual needs.
    pub(super) fn law(&self) -> &LawGauge {
        &self.law
    }

    /// The velocity of the last point measured.
    pub(super) fn velocity(&self) -> &[f64] {
        &self.u
    }

    /// `u = W r + q + V λ`, entry by entry, without the solvers' kernels.
    fn update_velocity<const D: usize, L: Law<D>>(
        &mut self,
        problem: &FrictionLocal<D, L>,
        point: &LocalPoint,
    ) {
        let u = &mut self.u;
        for i in 0..problem.contacts() {
            let (cols, blocks) = problem.W.row(i);
            let mut sum: [f64; D] = small::block(&problem.q, i);
            for (&j, b) in cols.iter().zip(blocks) {
                for k in 0..D {
                    for l in 0..D {
                        sum[k] += b[k][l] * point.r[D * j as usize + l];
                    }
                }
            }
            u[D * i..D * i + D].copy_from_slice(&sum);
        }
        each_term(problem.rows.as_ref().map(|b| &b.V), &point.lambda, |i, a, x| u[i] += a * x);
    }

    /// The same, each entry as one sum in doubled precision.
    fn update_velocity_precisely<const D: usize, L: Law<D>>(
        &mut self,
        problem: &FrictionLocal<D, L>,
        point: &LocalPoint,
    ) {
        let Self { u, exact, sizes, rows, .. } = self;
        rows.start(&problem.q);
        rows.add_blocks(&problem.W, &point.r);
        if let Some(b) = &problem.rows {
            rows.add(1.0, &b.V, &point.lambda);
        }
        sizes.copy_from_slice(rows.sizes());
        for ((u, exact), sum) in u.iter_mut().zip(exact).zip(rows.doubled()) {
            (*u, *exact) = (sum.value(), sum);
        }
    }

    /// What the rounding of r and λ to doubles alone makes of the residual, in the root mean square.
    fn floor<const D: usize, L: Law<D>>(
        &mut self,
        problem: &FrictionLocal<D, L>,
        point: &LocalPoint,
    ) -> f64 {
        let unit = power_of_two(self.law.unit());
        let per = 1.0 / unit;
        let squares = &mut self.u;
        squares.fill(0.0);
        for i in 0..problem.contacts() {
            let (cols, blocks) = problem.W.row(i);
            for (&j, b) in cols.iter().zip(blocks) {
                for k in 0..D {
                    for l in 0..D {
                        let product = b[k][l] * point.r[D * j as usize + l] * per;
                        squares[D * i + k] += product * product;
                    }
                }
            }
        }
        each_term(problem.rows.as_ref().map(|b| &b.V), &point.lambda, |i, a, x| {
            squares[i] += (a * x * per).powi(2);
        });
        let of_contact = |(c, squares): (usize, &[f64])| {
            let felt = felt::<L, D>(problem.law(c), &small::block(&point.r, c));
            squares.iter().zip(felt).map(|(square, felt)| square * felt).sum::<f64>()
        };
        let all = squares.chunks_exact(D).enumerate().map(of_contact).sum::<f64>();
        let spread = all.sqrt() * (unit / self.law.unit());
        squares.iter_mut().zip(&self.exact).for_each(|(u, x)| *u = x.value());
        HALF_ULP * spread
    }
}

/// The size of q with the free rows in force, and the others at their least impulses: `q + V λ`, `R λ + s = 0`. `None` where R does not say.
fn enforced(q: &[f64], RowsLocal { V, R, s, bounds }: &RowsLocal) -> Option<f64> {
    let mut lambda: Vec<f64> = (0..s.len()).map(|j| bounds.least(j)).collect();
    let free = bounds.free(s.len());
    if !free.is_empty() {
        let mut c = s.clone();
        R.mul_add(1.0, &lambda, &mut c);
        let inverse = Inverse::new(&principal(R, &free), "R");
        let inverse = inverse.ok()?;
        let mut x: Vec<f64> = free.iter().map(|&j| -c[j]).collect();
        let mut scratch = vec![0.0; inverse.scratch_len()];
        inverse.solve_with(&mut x, &mut scratch, Refine::Fully);
        free.iter().zip(&x).for_each(|(&j, x)| lambda[j] = *x);
    }
    let mut all = q.to_vec();
    V.mul_add(1.0, &lambda, &mut all);
    Some(norm(&all))
}

/// Calls `term(i, A_ij, x_j)` for the entries of A.
fn each_term(a: Option<&Csc>, x: &[f64], mut term: impl FnMut(usize, f64, f64)) {
    let Some(a) = a else { return };
    for (j, &xj) in x.iter().enumerate() {
        let (rows, values) = a.column(j);
        rows.iter().zip(values).for_each(|(&i, &v)| term(i, v, xj));
    }
}

/// The matrix `[W, V; Vᵀ, R]` by contacts and constraints.
struct Saddle<'a, const D: usize, L: Law<D>>(&'a FrictionLocal<D, L>);

impl<const D: usize, L: Law<D>> Saddle<'_, D, L> {
    /// The largest modulus in row i and column j.
    fn entry(&self, i: usize, j: usize) -> f64 {
        let nc = self.0.contacts();
        let Some(b) = self.0.rows.as_ref().filter(|_| i.max(j) >= nc) else {
            return self.0.W.get(i, j).map_or(0.0, largest);
        };
        match (i.checked_sub(nc), j.checked_sub(nc)) {
            (Some(i), Some(j)) => b.R.get(i, j).abs(),
            (c, k) => {
                let (c, k) = (c.map_or(i, |_| j), c.or(k).unwrap_or(0));
                (0..D).fold(0.0, |most, l| most.max(b.V.get(D * c + l, k).abs()))
            }
        }
    }

    /// Calls with row, column and what tells the modulus for all that is stored beside the diagonal, as long as the call wants more; entries of a block of V one by one.
    fn each(&self, mut call: impl FnMut(usize, usize, &dyn Fn() -> f64) -> bool) {
        let nc = self.0.contacts();
        for i in 0..nc {
            let (cols, blocks) = self.0.W.row(i);
            for (&j, block) in cols.iter().zip(blocks).filter(|(j, _)| **j as usize != i) {
                if !call(i, j as usize, &|| largest(block)) {
                    return;
                }
            }
        }
        let Some(b) = &self.0.rows else { return };
        for (i, j, v) in b.V.triplets() {
            let size = || v.abs();
            if !(call(i / D, nc + j, &size) && call(nc + j, i / D, &size)) {
                return;
            }
        }
        for (i, j, x) in b.R.triplets().filter(|e| e.0 != e.1) {
            if !call(nc + i, nc + j, &|| x.abs()) {
                return;
            }
        }
    }
}

impl<const D: usize, L: Law<D>> Judged for FrictionLocal<D, L> {
    type Status = ContactStatus;
    type Counts = StatusCounts;

    fn verdict(&self, point: &LocalPoint, gauge: &mut Self::Gauge, tolerance: f64) -> Verdict {
        let measure = self.certify(point, gauge);
        let (law, u) = (&gauge.law, gauge.velocity());
        verdict_weighed(self, Self::law, measure, law, (&point.r, u), tolerance)
    }
}

impl<const D: usize, L: Law<D>> FrictionLocal<D, L> {
    /// `[W, V; Vᵀ, R]` by entries.
    fn bordered(&self) -> Vec<(usize, usize, f64)> {
        let m = self.q.len();
        let mut entries: Vec<_> = self.W.to_csc().triplets().collect();
        if let Some(b) = &self.rows {
            entries.extend(b.V.triplets().flat_map(|(i, j, x)| [(i, m + j, x), (m + j, i, x)]));
            entries.extend(b.R.triplets().map(|(i, j, x)| (m + i, m + j, x)));
        }
        entries
    }
}

impl<const D: usize, L: Law<D>> Kinematic<D> for FrictionLocal<D, L> {
    fn kinematics(&self) -> Kinematics<D> {
        let mut constant = self.q.clone();
        if let Some(b) = &self.rows {
            constant.extend_from_slice(&b.s);
        }
        // W is computed: where it should be symmetric, its asymmetry tells its rounding.
        let noise = match self.W.asymmetry() {
            a if a < NOISE => a,
            _ => 0.0,
        };
        Kinematics::new(
            &self.bordered(),
            constant.len(),
            constant,
            (&self.mu, self.mu_r.values()),
            noise,
        )
    }

    fn motion(point: &LocalPoint) -> Vec<f64> {
        [&point.r[..], &point.lambda].concat()
    }

    fn monotone(&self) -> Monotone {
        let size = self.q.len() + self.multipliers();
        monotone(&Csc::from_triplets(size, size, self.bordered().into_iter()).expect("in range"))
    }
}

/// An asymmetry of W below this is rounding, above it is meant.
const NOISE: f64 = 1e-8;

/// `u − W r − V λ = q`, `c − Vᵀ r − R λ = s`.
impl<const D: usize, L: Law<D>> Exactly for FrictionLocal<D, L> {
    fn system(&self, wanted: Option<&[bool]>) -> Option<ConeSystem> {
        let m = self.q.len();
        let mut rhs = exacts(&self.q);
        rhs.extend(self.rows.iter().flat_map(|b| exacts(&b.s)));
        let mut system = ConeSystem::new(rhs, wanted);
        let mut impulses = opposite(&self.W.to_csc(), 0, &system);
        let mut multipliers = vec![];
        if let Some(b) = &self.rows {
            impulses = under(impulses, opposite(&b.V.transpose(), m, &system));
            let all = under(opposite(&b.V, 0, &system), opposite(&b.R, m, &system));
            let all = all.into_iter().enumerate();
            multipliers =
                all.map(|(j, c)| bounded(&mut system, m + j, c, b.bounds.of(j))).collect();
        }
        let laws: Vec<L> = (0..self.contacts()).map(|c| self.law(c)).collect();
        system.unknowns = contacts::<L, D>(&mut system, 0, impulses, &laws);
        system.unknowns.extend(multipliers);
        Some(system)
    }

    fn rows(&self) -> usize {
        self.q.len() + self.multipliers()
    }

    fn impulses_from(&self) -> Option<usize> {
        Some(0)
    }
}

impl<const D: usize, L: Law<D>> Weighed for FrictionLocal<D, L> {
    fn arms(&self) -> Option<Vec<f64>> {
        (L::DISKS > 1).then(|| {
            let half = (D - 1) / 2;
            let of = |c: usize| {
                let w = self.W.diagonal_block(c);
                let trace = |rows: std::ops::Range<usize>| rows.map(|k| w[k][k]).sum::<f64>();
                arm(trace(1..1 + half), trace(1 + half..D))
            };
            (0..self.contacts()).map(of).collect()
        })
    }

    fn weighed(&self, arms: &[f64]) -> Self {
        let mut out = self.clone();
        out.W.change(|i, j, block| {
            for (k, row) in block.iter_mut().enumerate() {
                for (l, x) in row.iter_mut().enumerate() {
                    *x *= weight::<D>(arms, D * i + k) * weight::<D>(arms, D * j + l);
                }
            }
        });
        multiply::<D>(arms, &mut out.q);
        out.mu_r = self.mu_r.scaled(|c| 1.0 / arms[c]);
        if let Some(rows) = &mut out.rows {
            let entries = rows.V.triplets().map(|(i, j, x)| (i, j, weight::<D>(arms, i) * x));
            rows.V = Csc::from_triplets(
                rows.V.nrows(),
                rows.V.ncols(),
                entries.collect::<Vec<_>>().into_iter(),
            )
            .expect("in range");
        }
        out
    }

    fn weigh(arms: &[f64], r: &mut [f64]) {
        divide::<D>(arms, r);
    }

    fn unweigh(arms: &[f64], r: &mut [f64]) {
        multiply::<D>(arms, r);
    }
}

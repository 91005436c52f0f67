//! The judge of the local problem.

use super::contact::{Law, Share, length};
use super::loads::Loads;
use super::rows::{Rows, doubt};
use super::{Measure, over};
use crate::{FrictionLocal, LocalPoint, RowsLocal};
use nonsmooth_linalg::{Csc, Doubled, Real, norm, norm_of, power_of_two, small};

/// The judge's constants and buffers for a [`FrictionLocal`].
#[derive(Debug, Clone)]
pub struct LocalGauge {
    pub(super) law: LawGauge,
    u: Vec<f64>,
    /// u with all its digits and the size of its terms, when it was last certified.
    exact: Vec<Doubled>,
    sizes: Vec<f64>,
    rows: Rows,
    /// The most terms of an entry of u.
    terms: usize,
}

impl LocalGauge {
    pub(crate) fn new<const D: usize>(problem: &FrictionLocal<D>) -> Self {
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

    pub(crate) fn refill<const D: usize>(&mut self, problem: &FrictionLocal<D>) {
        let contacts = problem.contacts();
        let diagonal = (0..contacts).map(|c| small::mean_diagonal(&problem.W.diagonal_block(c)));
        self.law.refill(diagonal, norm(&problem.q));
        self.mark_loads(problem);
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
    fn mark_loads<const D: usize>(&mut self, problem: &FrictionLocal<D>) {
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
            let (known, missing) = (impulses, |x: f64| x == 0.0);
            known.clear();
            known.extend_from_slice(strength);
            all.each(|i, j, a| {
                if missing(known[i]) && known[j] > 0.0 {
                    strength[i] = strength[i].max(a * all.entry(j, i) / known[j]);
                }
                true
            });
            known.fill(0.0);
            all.each(|i, j, a| {
                known[j] = known[j].max(amounts[i] / a);
                true
            });
            for i in 0..n {
                if missing(strength[i]) && known[i] > 0.0 {
                    strength[i] = amounts[i] / known[i];
                }
            }
        }
        loads.start(n);
        all.each(|i, j, a| {
            loads.couple(i, j, || match (strength[i], strength[j], all.entry(j, i)) {
                (_, s, 0.0) if s > 0.0 => a / s,
                (r, s, back) if r > 0.0 && s > 0.0 => (r / s * (a / back)).sqrt(),
                _ => amounts[i] / amounts[j],
            });
            !loads.are_joined()
        });
        loads.spread(amounts.iter().copied());
    }

    /// The residuals; `precisely` in doubled precision from the data to the last comparison.
    pub(crate) fn measure<const D: usize>(
        &mut self,
        problem: &FrictionLocal<D>,
        point: &LocalPoint,
        precisely: bool,
    ) -> Measure {
        self.rows.precisely(precisely);
        let mut measure = if precisely {
            self.update_velocity_precisely(problem, point);
            let Self { law, exact, sizes, terms, .. } = self;
            let doubt = doubt(*terms);
            let of = |i: usize| doubt * sizes[i];
            let mut measure =
                law.measure::<_, _, D>(&point.r, exact, sizes, of, |c| problem.law(c));
            measure.floor = Some(self.floor(problem, point));
            measure
        } else {
            self.update_velocity(problem, point);
            self.law.measure::<_, _, D>(&point.r, &self.u, &[], |_| 0.0, |c| problem.law(c))
        };
        measure.bilateral = self.violation(problem, point);
        measure
    }

    /// The largest `|c_j|`, `c = Vᵀ r + R λ + s`, or of a row with bounds what [`Bounds::residual`](crate::Bounds::residual) makes of it, over the size of its terms, beyond what the rounding of impulses and multipliers of a typical
    /// size makes in row j: of a constraint without load all terms are rounding. A row without coefficients has no such excuse.
    fn violation<const D: usize>(
        &mut self,
        problem: &FrictionLocal<D>,
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
            let left = bounds.residual(j, point.lambda[j], sum, unit(j).powi(2));
            self.law.loads.excused(nc + j, left, size, *excuse)
        }));
        self.sizes.truncate(point.r.len());
        Some(share)
    }

    /// The velocity of the last point measured.
    pub(super) fn velocity(&self) -> &[f64] {
        &self.u
    }

    /// `u = W r + q + V λ`, entry by entry, without the solvers' kernels.
    fn update_velocity<const D: usize>(&mut self, problem: &FrictionLocal<D>, point: &LocalPoint) {
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
    fn update_velocity_precisely<const D: usize>(
        &mut self,
        problem: &FrictionLocal<D>,
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
    fn floor<const D: usize>(&mut self, problem: &FrictionLocal<D>, point: &LocalPoint) -> f64 {
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
        let spread = squares.iter().sum::<f64>().sqrt() * (unit / self.law.unit());
        squares.iter_mut().zip(&self.exact).for_each(|(u, x)| *u = x.value());
        HALF_ULP * spread
    }
}

/// The rounding of a stored double, over its size, in the root mean square.
pub(super) const HALF_ULP: f64 = 0.3 * f64::EPSILON;

/// What plain arithmetic makes of x and ũ is wrong by less than this, over `‖x‖ + ‖ũ‖`.
const PLAIN: f64 = 16.0 * f64::EPSILON;
/// Terms below this share of ‖q‖ have lost digits to underflow.
const LEAST: f64 = 1e-280;

/// Calls `term(i, A_ij, x_j)` for the entries of A.
fn each_term(a: Option<&Csc>, x: &[f64], mut term: impl FnMut(usize, f64, f64)) {
    let Some(a) = a else { return };
    for (j, &xj) in x.iter().enumerate() {
        let (rows, values) = a.column(j);
        rows.iter().zip(values).for_each(|(&i, &v)| term(i, v, xj));
    }
}

/// `√|d|` of a diagonal entry, the unit of what belongs to it; 1 where it vanishes.
pub(super) fn unit(d: f64) -> f64 {
    match d.abs().sqrt() {
        unit if unit > 0.0 => unit,
        _ => 1.0,
    }
}

/// The largest ratio of violation to size, beyond what each is excused for; infinite if any is NaN.
pub(super) fn worst(shares: impl Iterator<Item = (f64, f64, f64)>) -> f64 {
    shares.fold(0.0, |worst: f64, (violation, size, excuse)| {
        match over((violation.abs() - excuse).max(0.0), size) {
            _ if violation.is_nan() => f64::INFINITY,
            share if share.is_nan() => f64::INFINITY,
            share => worst.max(share),
        }
    })
}

/// The matrix `[W, V; Vᵀ, R]` by contacts and constraints.
struct Saddle<'a, const D: usize>(&'a FrictionLocal<D>);

impl<const D: usize> Saddle<'_, D> {
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

    /// Calls with row, column and modulus for all that is not zero beside the diagonal, as long as the call wants more; entries of a block of V one by one.
    fn each(&self, mut call: impl FnMut(usize, usize, f64) -> bool) {
        let nc = self.0.contacts();
        for i in 0..nc {
            let (cols, blocks) = self.0.W.row(i);
            for (&j, block) in cols.iter().zip(blocks).filter(|(j, _)| **j as usize != i) {
                let a = largest(block);
                if a > 0.0 && !call(i, j as usize, a) {
                    return;
                }
            }
        }
        let Some(b) = &self.0.rows else { return };
        for (i, j, v) in b.V.triplets().filter(|e| e.2 != 0.0) {
            if !(call(i / D, nc + j, v.abs()) && call(nc + j, i / D, v.abs())) {
                return;
            }
        }
        for (i, j, x) in b.R.triplets().filter(|e| e.2 != 0.0 && e.0 != e.1) {
            if !call(nc + i, nc + j, x.abs()) {
                return;
            }
        }
    }
}

/// The largest modulus in a block.
pub(super) fn largest<const D: usize>(block: &[[f64; D]; D]) -> f64 {
    block.iter().flatten().fold(0.0, |l, x| l.max(x.abs()))
}

/// What the contact law's residual needs of a problem: `w_c` and `‖q‖`, and what stands for both where a contact is measured by itself.
#[derive(Debug, Clone, Default)]
pub(super) struct LawGauge {
    pub(super) w: Vec<f64>,
    /// The largest modulus of W_cc, which is there where the trace is not; zero where nothing is. Others may follow.
    pub(super) strength: Vec<f64>,
    pub(super) loads: Loads,
    /// Moduli of loads, and room for as many.
    amounts: Vec<f64>,
    impulses: Vec<f64>,
    pub(super) norm_q: f64,
}

impl LawGauge {
    pub(super) fn new(diagonal: impl Iterator<Item = f64>) -> Self {
        let mut gauge = Self::default();
        gauge.refill(diagonal, 0.0);
        gauge
    }

    pub(super) fn refill(&mut self, diagonal: impl Iterator<Item = f64>, norm_q: f64) {
        self.norm_q = norm_q;
        self.w.clear();
        self.w.extend(diagonal);
        let mean = self.w.iter().sum::<f64>() / self.w.len().max(1) as f64;
        let stand_in = if mean > 0.0 { mean } else { 1.0 };
        for w in &mut self.w {
            if *w <= 0.0 {
                *w = stand_in;
            }
        }
    }

    /// What stands for w_c where contact c is measured by itself.
    fn own_w(&self, c: usize) -> f64 {
        match self.strength.get(c) {
            Some(&strength) if strength > 0.0 => strength,
            _ => self.w[c],
        }
    }

    /// What the residual is relative to.
    pub(super) fn unit(&self) -> f64 {
        if self.norm_q > 0.0 { self.norm_q } else { 1.0 }
    }

    /// The residuals of the impulses `r` with the velocities `u`, whose terms have the `sizes` and whose entries may be wrong by
    /// `doubt(i)`. What the arithmetic T leaves in doubt is added to the residuals that decide, so that they never
    /// promise too much.
    ///
    /// All is done in units of a power of two near its scale, so that no square leaves the range of double precision
    /// before the data do.
    pub(super) fn measure<T: Real, L: Law<D>, const D: usize>(
        &self,
        r: &[f64],
        u: &[T],
        sizes: &[f64],
        doubt: impl Fn(usize) -> f64,
        law: impl Fn(usize) -> L,
    ) -> Measure {
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
        let (mut worst_contact, mut worst) = (0, -1.0);
        let (mut own_contact, mut own) = (0, 0.0);
        for (c, &w) in self.w.iter().enumerate() {
            let law = law(c);
            let rc: [f64; D] = small::block(r, c);
            let uc: [T; D] = std::array::from_fn(|k| u[D * c + k]);
            let plain_u = uc.map(|u| u.value());
            let plain_modified = law.modified_velocity(&plain_u);
            let near = (rc.map(|r| w * r * per), plain_modified.map(|u| u * per));
            let plainly = || Share::new(law, &near.0, &plain_u.map(|u| u * per), &near.1);
            let (share, left) = if T::DOUBT == 0.0 {
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
            // Plain arithmetic decides nothing: it leaves out what only decides.
            if T::DOUBT > 0.0 {
                let of_u = norm_of((D * c..D * c + D).map(|i| doubt(i) * per));
                let left = left + law.growth() * of_u;
                doubts += left * left;
                // Impulses that run away along the kernel of W make terms of any size: no more than the loads excuse.
                let load = self.loads.reaching(c) * per;
                let strength = self.own_w(c);
                let own_x = rc.map(|r| strength * r * per);
                let apart = law.apart(&own_x, &plain_u.map(|u| u * per));
                // Of an empty block the impulse is no term, but may be all there is.
                let terms = norm_of((D * c..D * c + D).map(|i| sizes[i] * per));
                let terms = terms.max(norm(&own_x)).min(load);
                let normal = (sizes[D * c] * per).min(load);
                // Below the range of double precision there are no digits to be right.
                let error = share.residual.sqrt().max(apart) + left;
                // No sliding, however fast, excuses a velocity into the obstacle.
                let sinking = over((-plain_u[0] * per).max(0.0), normal.max(LEAST));
                let of_own = over(error, terms.max(LEAST)).max(sinking);
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
        Measure {
            absolute: relative * self.unit(),
            relative,
            literature: plain_map.sqrt() * (plain_unit / self.unit()),
            siconos: plain_map.sqrt() * (plain_unit / plain),
            primal: primal.sqrt() * q,
            dual: dual.sqrt() * q,
            complementarity: complementarity * q * q,
            own: (T::DOUBT > 0.0).then_some(own),
            own_contact: (T::DOUBT > 0.0).then_some(own_contact),
            worst_contact,
            worst: worst.sqrt() * q,
            ..Measure::unknown()
        }
    }
}

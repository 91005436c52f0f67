//! The local problem by its contacts: rows of W.
//!
//! Bilateral rows `0 = Vᵀ r + R λ + s` are eliminated once: `W ← W − V R⁻¹ Vᵀ`, `q ← q − V R⁻¹ s`. Redundant
//! constraints (a singular, positive semidefinite R) are honoured. Rows with bounds stay ([`Bounded`]); the q of the view holds what they do.

use nonsmooth_linalg::{
    Block, Bsr, Compensated, Csc, Delassus, Groups, Inverse, Refine, Singular, norm_or_one, small,
};
use nonsmooth_problem::check::{Certificate, Impulses, Kinematic};
use nonsmooth_problem::{Bounds, FrictionLocal, LocalPoint, RowsLocal};

use super::linearised::{ContactForm, Form, Once, System, made, there, unaffordable};
use super::rows::Bounded;
use super::{
    Access, Blockwise, Concurrent, Contacts, Costs, Frictional, Linear, Linearised, Parted, Rows,
    held_and_left, lifted, of_contacts, of_each, rolling_of, rows_of,
};
use crate::SolveError;
use crate::contact::law::DiskLaw;

/// What the view keeps: the norm of q, the problem without its bilateral rows where it has any, and the linear system.
pub struct LocalState<const D: usize> {
    access: Access,
    scale: f64,
    eliminated: Option<Eliminated<D>>,
    /// Made when it is first asked for.
    system: Once<System<ContactForm<D>, D>>,
    /// Room for velocities in doubled precision.
    sums: Vec<Compensated>,
}

struct Eliminated<const D: usize> {
    w: Bsr<D>,
    q: Vec<f64>,
    r_inverse: Inverse,
    /// V R⁻¹ Vᵀ, and the matrices that it belongs to.
    schur: Bsr<D>,
    v: Csc,
    r: Csc,
    lambda: Vec<f64>,
    scratch: Vec<f64>,
    residual: Vec<f64>,
    /// λ in doubled precision: high, low, the last correction.
    precise: [Vec<f64>; 3],
    contradiction: Option<Impulses>,
    /// The places of the rows that are eliminated; and what is left of the others.
    free: Vec<usize>,
    bounded: Option<Bounded>,
}

impl<const D: usize> Eliminated<D> {
    fn new<L: DiskLaw<D>>(
        problem: &FrictionLocal<D, L>,
        b: &RowsLocal,
    ) -> Result<Self, SolveError> {
        let free = b.bounds.free(b.s.len());
        let (v, r) = match free.len() == b.s.len() {
            true => (b.V.clone(), b.R.clone()),
            false => {
                (b.V.columns(&free), b.R.columns(&free).transpose().columns(&free).transpose())
            }
        };
        let r_inverse = Inverse::of_multipliers(&r, "R")?;
        let bounded = match b.bounds.are_free() {
            true => None,
            false => Some(Bounded::new(b, &free, &r_inverse)?),
        };
        // V R⁻¹ Vᵀ is the Delassus operator of "H = Vᵀ, M = R".
        let schur = Delassus::condense(&v.transpose(), &r_inverse);
        let p = free.len();
        let mut eliminated = Self {
            w: problem.W.minus(&schur),
            q: vec![0.0; problem.q.len()],
            schur,
            v,
            r,
            lambda: vec![0.0; p],
            scratch: vec![0.0; r_inverse.scratch_len()],
            r_inverse,
            residual: vec![0.0; p],
            precise: [0; 3].map(|_| vec![0.0; p]),
            contradiction: None,
            free,
            bounded,
        };
        eliminated.update_free_velocity(problem, b);
        Ok(eliminated)
    }

    /// Takes another problem with the same V and R and the same pattern of W; false where it is not so, or rows have bounds.
    fn refill<L: DiskLaw<D>>(&mut self, problem: &FrictionLocal<D, L>, b: &RowsLocal) -> bool {
        let same = self.v == b.V
            && self.r == b.R
            && b.bounds.are_free()
            && self.w.set_difference(&problem.W, &self.schur);
        if same {
            self.update_free_velocity(problem, b);
        }
        same
    }

    fn update_free_velocity<L: DiskLaw<D>>(
        &mut self,
        problem: &FrictionLocal<D, L>,
        b: &RowsLocal,
    ) {
        let s = || self.free.iter().map(|&j| b.s[j]);
        self.lambda.iter_mut().zip(s()).for_each(|(x, s)| *x = s);
        self.r_inverse.solve_with(&mut self.lambda, &mut self.scratch, Refine::Fully);
        // What R λ = s leaves, where the constraints contradict each other.
        self.residual.iter_mut().zip(s()).for_each(|(x, s)| *x = s);
        self.r.mul_add(-1.0, &self.lambda, &mut self.residual);
        // Where rows repeat each other some of s may be rounding: each by the size of all, in the units √R_jj of velocities.
        let unit = |k: usize| self.r.get(k, k).abs().sqrt();
        let size = |(k, s): (usize, f64)| if unit(k) > 0.0 { s.abs() / unit(k) } else { 0.0 };
        let typical = s().enumerate().map(size).fold(0.0, f64::max);
        let violated = |(k, (left, s)): (usize, (&f64, f64))| {
            left.abs() > 1e-10 * s.abs().max(unit(k) * typical)
        };
        self.contradiction = None;
        if self.residual.iter().zip(s()).enumerate().any(violated) {
            let mut multipliers = self.residual.clone();
            self.r_inverse.null_direction(&mut multipliers);
            let mut all = vec![0.0; b.s.len()];
            self.free.iter().zip(&multipliers).for_each(|(&j, x)| all[j] = *x);
            let r = vec![0.0; problem.q.len()];
            self.contradiction =
                Impulses::toward(r, all, &[], &b.s, |c| problem.kinematics().refutes(c));
        }
        self.without_rows(&problem.q);
    }

    /// q without impulses of rows that have bounds.
    fn without_rows(&mut self, q: &[f64]) {
        self.q.copy_from_slice(q);
        self.v.mul_add(-1.0, &self.lambda, &mut self.q);
    }
}

impl<const D: usize> LocalState<D> {
    /// W and q, without the bilateral constraints where the problem has any.
    #[inline(always)]
    pub fn operator<'a, L: DiskLaw<D>>(
        &'a self,
        problem: &'a FrictionLocal<D, L>,
    ) -> (&'a Bsr<D>, &'a [f64]) {
        match &self.eliminated {
            None => (&problem.W, &problem.q),
            Some(e) => (&e.w, &e.q),
        }
    }

    fn bounded(&self) -> Option<&Bounded> {
        self.eliminated.as_ref()?.bounded.as_ref()
    }

    /// The multipliers with which the bilateral constraints feel no motion from the impulses r: `Vᵀ r + R λ = 0`. Allocates.
    pub fn multipliers(&self, r: &[f64]) -> Vec<f64> {
        let Some(e) = &self.eliminated else { return vec![] };
        let mut lambda = vec![0.0; e.lambda.len()];
        e.v.mul_transpose_add(-1.0, r, &mut lambda);
        let mut scratch = vec![0.0; e.scratch.len()];
        e.r_inverse.solve_with(&mut lambda, &mut scratch, Refine::Fully);
        lambda
    }
}

impl<const D: usize, L: DiskLaw<D>> Contacts<D> for FrictionLocal<D, L> {
    type Law = L;
    type State = LocalState<D>;

    fn state(&self, access: Access) -> Result<Self::State, SolveError> {
        access.admit(self.bounds())?;
        let eliminated = self.rows.as_ref().map(|b| Eliminated::new(self, b)).transpose()?;
        let scale = norm_or_one(&self.q);
        // Newton's methods ask for doubled precision near their end.
        let precise = if access == Access::Newton { self.q.len() } else { 0 };
        let sums = Vec::with_capacity(precise);
        Ok(LocalState { access, scale, eliminated, system: None, sums })
    }

    fn refill(&self, state: &mut Self::State) -> Result<(), SolveError> {
        state.scale = norm_or_one(&self.q);
        let kept = match (&mut state.eliminated, &self.rows) {
            (None, None) => true,
            (Some(eliminated), Some(b)) => eliminated.refill(self, b),
            _ => false,
        };
        if !kept {
            *state = self.state(state.access)?;
        }
        let LocalState { eliminated, system, .. } = state;
        let w = eliminated.as_ref().map_or(&self.W, |e| &e.w);
        if there(system).is_none_or(|system| !system.form().refill(w)) {
            *system = None;
        }
        Ok(())
    }

    fn contradiction<'a>(&self, state: &'a Self::State) -> Option<&'a Impulses> {
        state.eliminated.as_ref()?.contradiction.as_ref()
    }

    fn contacts(&self) -> usize {
        self.mu.len()
    }

    #[inline(always)]
    fn law(&self, c: usize) -> L {
        L::of(&self.mu, &self.mu_r, c)
    }

    fn diagonal_block(&self, state: &Self::State, c: usize) -> [[f64; D]; D] {
        state.operator(self).0.diagonal_block(c)
    }

    fn velocity_scale(&self, state: &Self::State) -> f64 {
        state.scale
    }

    fn impulses(point: &mut LocalPoint) -> &mut [f64] {
        &mut point.r
    }

    fn enter(&self, state: &mut Self::State, point: &LocalPoint) {
        let Some(e) = state.eliminated.as_mut().filter(|e| e.bounded.is_some()) else { return };
        e.without_rows(&self.q);
        if let Some(bounded) = &e.bounded {
            bounded.effect.mul_add(1.0, &point.lambda, &mut e.q);
        }
    }

    fn complete(&self, state: &mut Self::State, point: &mut LocalPoint) {
        let (Some(b), Some(e)) = (&self.rows, &mut state.eliminated) else { return };
        // λ_F = −R_FF⁻¹ (V_Fᵀ r + R_FB λ_B + s_F).
        let multipliers = &mut e.residual;
        multipliers.iter_mut().zip(&e.free).for_each(|(x, &j)| *x = -b.s[j]);
        e.v.mul_transpose_add(-1.0, &point.r, multipliers);
        for j in b.bounds.bounded() {
            for (x, &i) in multipliers.iter_mut().zip(&e.free) {
                *x -= b.R.get(i, j) * point.lambda[j];
            }
        }
        e.r_inverse.solve_with(multipliers, &mut e.scratch, Refine::Fully);
        e.free.iter().zip(&*multipliers).for_each(|(&j, x)| point.lambda[j] = *x);
    }
}

impl<const D: usize> Frictional<D> for FrictionLocal<D> {
    fn mu(&self) -> &[f64] {
        &self.mu
    }
}

impl<const D: usize, L: DiskLaw<D>> Rows<D> for FrictionLocal<D, L> {
    fn bounds(&self) -> Option<&Bounds> {
        self.rows.as_ref().map(|b| &b.bounds)
    }

    fn all_impulses(point: &mut LocalPoint) -> (&mut [f64], &mut [f64]) {
        (&mut point.r, &mut point.lambda)
    }

    fn row_response(&self, state: &Self::State, j: usize) -> f64 {
        state.bounded().map_or(0.0, |rows| rows.response(j))
    }

    fn row_velocity(&self, state: &Self::State, r: &[f64], lambda: &[f64], j: usize) -> f64 {
        state.bounded().map_or(0.0, |rows| rows.velocity(r, lambda, j))
    }

    fn row_moved(&self, state: &mut Self::State, j: usize, by: f64) {
        let Some(Eliminated { q, bounded: Some(rows), .. }) = &mut state.eliminated else { return };
        let (at, values) = rows.effect.column(j);
        at.iter().zip(values).for_each(|(&i, v)| q[i] += by * v);
    }
}

impl<const D: usize, L: DiskLaw<D>> Parted<D> for FrictionLocal<D, L> {
    fn holding(&self, held: &[Option<f64>]) -> Self {
        let Some(b) = &self.rows else { return self.clone() };
        let (loads, left) = held_and_left(held);
        let (mut q, mut s) = (self.q.clone(), b.s.clone());
        b.V.mul_add(1.0, &loads, &mut q);
        b.R.mul_add(1.0, &loads, &mut s);
        let own = b.R.columns(&left).transpose().columns(&left).transpose();
        let s = left.iter().map(|&j| s[j]).collect();
        let rows = RowsLocal::bilateral(b.V.columns(&left), own, s);
        Self { q, rows: (!left.is_empty()).then_some(rows), ..self.clone() }
    }

    fn join(&self, groups: &mut Groups) {
        groups.restart(self.mu.len());
        for c in 0..self.mu.len() {
            for &other in self.W.row(c).0 {
                groups.join(c, other as usize);
            }
            if groups.count() == 1 {
                return;
            }
        }
    }

    fn island(&self, contacts: &[usize]) -> Self {
        let (w, mu_r) = (Bsr::from_rows(contacts.len(), &[]), L::Rolling::default());
        let mut island = Self { W: w, q: vec![], mu: vec![], mu_r, rows: None };
        self.island_again(contacts, &mut island);
        island
    }

    fn island_again(&self, contacts: &[usize], island: &mut Self) {
        let rows = contacts.iter().map(|&c| self.W.row(c));
        let lengths = rows.clone().map(|(columns, _)| columns.len());
        let (_, columns, blocks) = island.W.lay_out(contacts.len(), lengths);
        let place = |c: u32| contacts.binary_search(&(c as usize)).expect("one group") as u32;
        let entries = rows.flat_map(|(columns, blocks)| columns.iter().zip(blocks));
        for ((column, block), (&c, given)) in columns.iter_mut().zip(blocks).zip(entries) {
            (*column, *block) = (place(c), *given);
        }
        of_contacts::<D>(&self.q, contacts, &mut island.q);
        of_each(&self.mu, contacts.iter().copied(), &mut island.mu);
        island.mu_r = rolling_of(&self.mu_r, contacts);
    }

    fn lifted(&self, contacts: &[usize], certificate: Certificate) -> Certificate {
        let laws: Vec<L> = (0..self.mu.len()).map(|c| Contacts::law(self, c)).collect();
        let given: Vec<usize> = rows_of::<D>(0, contacts).collect();
        lifted(&laws, contacts, (&given, self.q.len()), certificate)
    }
}

impl<const D: usize, L: DiskLaw<D>> Blockwise<D> for FrictionLocal<D, L> {
    #[inline(always)]
    fn velocity(&self, state: &Self::State, r: &[f64], c: usize) -> [f64; D] {
        let (w, q) = state.operator(self);
        let mut u = w.row_product(c, r);
        let q: [f64; D] = small::block(q, c);
        for k in 0..D {
            u[k] += q[k];
        }
        u
    }

    #[inline(always)]
    fn moved(&self, _: &mut Self::State, _: usize, _: &[f64; D]) {}
}

impl<const D: usize, L: DiskLaw<D>> Concurrent<D> for FrictionLocal<D, L> {
    /// Places are impulses.
    fn places(&self, state: &Self::State, c: usize, reads: &mut Vec<u32>, writes: &mut Vec<u32>) {
        reads.extend_from_slice(state.operator(self).0.row(c).0);
        writes.push(c as u32);
    }
}

impl<const D: usize, L: DiskLaw<D>> Linear<D> for FrictionLocal<D, L> {
    fn velocities(&self, state: &mut Self::State, r: &[f64], u: &mut [f64]) {
        let (w, q) = state.operator(self);
        w.mul_plus(r, q, u);
    }

    /// With bilateral rows by way of the multipliers, `u = W r + V λ + q`: the eliminated W carries the rounding of its elimination.
    fn velocities_precisely(&self, state: &mut Self::State, r: &[f64], u: &mut [f64]) {
        let sums = &mut state.sums;
        sums.clear();
        sums.extend(self.q.iter().map(|&q| Compensated::from(q)));
        for (i, sum) in sums.chunks_mut(D).enumerate() {
            let (columns, blocks) = self.W.row(i);
            for (&j, block) in columns.iter().zip(blocks) {
                for (sum, row) in sum.iter_mut().zip(block) {
                    row.iter()
                        .enumerate()
                        .for_each(|(l, &w)| sum.add_product(w, r[D * j as usize + l]));
                }
            }
        }
        if let (Some(RowsLocal { V, s, .. }), Some(e)) = (&self.rows, &mut state.eliminated) {
            // λ = −R⁻¹ (Vᵀ r + s), high and low.
            let [high, low, last] = &mut e.precise;
            for j in 0..s.len() {
                let mut sum = Compensated::from(-s[j]);
                let (rows, values) = V.column(j);
                rows.iter().zip(values).for_each(|(&i, &v)| sum.add_product(-v, r[i]));
                (high[j], low[j]) = sum.into_parts();
            }
            e.r_inverse.solve_doubled(high, low, last, &mut e.scratch);
            for j in 0..s.len() {
                let (rows, values) = V.column(j);
                for (&i, &v) in rows.iter().zip(values) {
                    sums[i].add_product(v, high[j]);
                    sums[i].add_product(v, low[j]);
                }
            }
        }
        u.iter_mut().zip(&*sums).for_each(|(u, sum)| *u = sum.value());
    }
}

impl<const D: usize, L: DiskLaw<D>> Linearised<D> for FrictionLocal<D, L> {
    fn linearise(
        &self,
        state: &mut Self::State,
        p: &[Block<D>],
        q: &[Block<D>],
    ) -> Result<(), Singular> {
        let LocalState { eliminated, system, .. } = state;
        let w = eliminated.as_ref().map_or(&self.W, |e| &e.w);
        let unit = (0..w.nrows()).map(|c| small::mean_diagonal(&w.diagonal_block(c)));
        let make = || Ok(System::new(ContactForm::new(w)?, w.nrows()));
        made(system, make).ok_or(Singular)?.factorise(unit, p, q)
    }

    fn orientation(&self, state: &mut Self::State) -> f64 {
        there(&mut state.system).map_or(f64::NAN, |system| system.sign())
    }

    fn solve_linearised(
        &self,
        state: &mut Self::State,
        b: &[f64],
        x: &mut [f64],
        wx: &mut [f64],
    ) -> f64 {
        let LocalState { eliminated, system, .. } = state;
        let w = eliminated.as_ref().map_or(&self.W, |e| &e.w);
        let apply = |x: &[f64], wx: &mut [f64]| {
            for (c, wx) in wx.chunks_mut(D).enumerate() {
                wx.copy_from_slice(&w.row_product(c, x));
            }
        };
        there(system).map_or(f64::NAN, |system| system.solve(b, x, wx, apply))
    }

    fn costs(&self, state: &mut Self::State) -> Costs {
        let LocalState { eliminated, system, .. } = state;
        let w = eliminated.as_ref().map_or(&self.W, |e| &e.w);
        let system = made(system, || Ok(System::new(ContactForm::new(w)?, w.nrows())));
        let sweep = 30.0 * w.nrows() as f64 + 2.0 * w.nblocks() as f64;
        system.map_or_else(|| unaffordable(sweep), |system| system.form().costs(sweep))
    }

    /// By the entries of W, in one pass.
    fn spread(&self, state: &mut Self::State, unit: &mut Vec<f64>) -> f64 {
        let w = state.eliminated.as_ref().map_or(&self.W, |e| &e.w);
        unit.clear();
        unit.extend((0..w.nrows()).map(|c| small::mean_diagonal(&w.diagonal_block(c))));
        let (mut rows, mut squares) = (0, 0.0);
        for (i, &of_row) in unit.iter().enumerate().filter(|u| *u.1 > 0.0) {
            rows += D;
            let (cols, blocks) = w.row(i);
            for (&j, block) in cols.iter().zip(blocks).filter(|e| unit[*e.0 as usize] > 0.0) {
                let size: f64 = block.iter().flatten().map(|x| x * x).sum();
                squares += size / (of_row * unit[j as usize]);
            }
        }
        rows as f64 / squares
    }
}

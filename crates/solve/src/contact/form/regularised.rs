//! A problem with a proximal term: `u_α = W r + q + α_c w_c (r − r_k)`, as another problem with the same capabilities.
//!
//! Everything is the base problem's, but for multiples of the identity on the diagonal blocks and what follows from them. The judge is
//! the base problem's too: it tells how well a point solves *that*, which is what a proximal method is after.

use nonsmooth_linalg::{Block, Singular};
use nonsmooth_problem::check::{Certificate, ConeSystem, Evidence, Impulses, Measure};
use nonsmooth_problem::{Bounds, FrictionGlobal, FrictionLocal, Kind, Problem, ProblemError};

use super::{Access, Blockwise, Concurrent, Contacts, Costs, Frictional, Linear, Linearised, Rows};
use crate::SolveError;
use crate::contact::law::DiskLaw;

/// `P` with a proximal term.
#[derive(Debug, Clone)]
pub struct Regularised<P> {
    /// The problem with its own W.
    pub base: P,
    /// `α_c w_c`, for each contact.
    pub weight: Vec<f64>,
    /// r_k.
    pub center: Vec<f64>,
}

/// Problems that can take another's data into their own memory.
pub trait Overwrite: Clone {
    /// Becomes a copy of `other`; allocates nothing where the shape is the same and, for global problems, the matrices are.
    fn overwrite(&mut self, other: &Self);
}

impl<const D: usize, L: DiskLaw<D>> Overwrite for FrictionLocal<D, L> {
    fn overwrite(&mut self, other: &Self) {
        self.W = other.W.clone();
        self.q.clone_from(&other.q);
        self.mu.clone_from(&other.mu);
        self.mu_r.clone_from(&other.mu_r);
        if self.rows != other.rows {
            self.rows.clone_from(&other.rows);
        }
    }
}

impl<const D: usize, L: DiskLaw<D>> Overwrite for FrictionGlobal<D, L> {
    fn overwrite(&mut self, other: &Self) {
        if self.M != other.M || self.H != other.H {
            self.M.clone_from(&other.M);
            self.H.clone_from(&other.H);
        }
        self.f.clone_from(&other.f);
        self.w.clone_from(&other.w);
        self.mu.clone_from(&other.mu);
        self.mu_r.clone_from(&other.mu_r);
        match (&mut self.rows, &other.rows) {
            (Some(mine), Some(others)) if mine.G == others.G && mine.bounds == others.bounds => {
                mine.b.clone_from(&others.b);
            }
            (mine, others) => mine.clone_from(others),
        }
    }
}

impl<P: Problem> Problem for Regularised<P> {
    type Point = P::Point;
    type Gauge = P::Gauge;

    fn kind(&self) -> Kind {
        self.base.kind()
    }

    fn unknowns(&self) -> usize {
        self.base.unknowns()
    }

    fn origin(&self) -> Self::Point {
        self.base.origin()
    }

    fn validate(&self) -> Result<(), ProblemError> {
        self.base.validate()
    }

    fn validate_point(&self, point: &Self::Point) -> Result<(), ProblemError> {
        self.base.validate_point(point)
    }

    fn copy_point(from: &Self::Point, to: &mut Self::Point) {
        P::copy_point(from, to);
    }

    fn gauge(&self) -> Result<Self::Gauge, ProblemError> {
        self.base.gauge()
    }

    fn regauge(&self, gauge: &mut Self::Gauge) -> Result<(), ProblemError> {
        self.base.regauge(gauge)
    }

    fn measure(&self, point: &Self::Point, gauge: &mut Self::Gauge) -> Measure {
        self.base.measure(point, gauge)
    }

    fn certify(&self, point: &Self::Point, gauge: &mut Self::Gauge) -> Measure {
        self.base.certify(point, gauge)
    }

    fn accept(
        &self,
        point: &P::Point,
        gauge: &mut P::Gauge,
        tolerance: f64,
    ) -> Option<(Measure, f64)> {
        self.base.accept(point, gauge, tolerance)
    }

    /// Of the problem without the regularisation.
    fn partner(&self, point: &Self::Point) -> Vec<f64> {
        self.base.partner(point)
    }

    fn evidence(&self, certificate: &Certificate) -> Evidence {
        self.base.evidence(certificate)
    }

    /// Of the problem without the regularisation.
    fn cones(&self) -> Option<ConeSystem> {
        self.base.cones()
    }

    fn assembled(&self, unknowns: &[f64]) -> Self::Point {
        self.base.assembled(unknowns)
    }
}

/// The base problem's view, and room for `Q + P α w`.
pub struct RegularisedState<S, const D: usize> {
    base: S,
    shifted: Vec<Block<D>>,
}

impl<P: Contacts<D>, const D: usize> Contacts<D> for Regularised<P> {
    type Law = P::Law;
    type State = RegularisedState<P::State, D>;

    fn state(&self, access: Access) -> Result<Self::State, SolveError> {
        Ok(RegularisedState { base: self.base.state(access)?, shifted: vec![] })
    }

    fn refill(&self, state: &mut Self::State) -> Result<(), SolveError> {
        self.base.refill(&mut state.base)
    }

    fn contradiction<'a>(&self, state: &'a Self::State) -> Option<&'a Impulses> {
        self.base.contradiction(&state.base)
    }

    fn contacts(&self) -> usize {
        self.base.contacts()
    }

    #[inline(always)]
    fn law(&self, c: usize) -> P::Law {
        self.base.law(c)
    }

    fn diagonal_block(&self, state: &Self::State, c: usize) -> [[f64; D]; D] {
        let mut block = self.base.diagonal_block(&state.base, c);
        for k in 0..D {
            block[k][k] += self.weight[c];
        }
        block
    }

    fn velocity_scale(&self, state: &Self::State) -> f64 {
        self.base.velocity_scale(&state.base)
    }

    fn impulses(point: &mut Self::Point) -> &mut [f64] {
        P::impulses(point)
    }

    fn enter(&self, state: &mut Self::State, point: &Self::Point) {
        self.base.enter(&mut state.base, point);
    }

    fn complete(&self, state: &mut Self::State, point: &mut Self::Point) {
        self.base.complete(&mut state.base, point);
    }
}

impl<P: Frictional<D>, const D: usize> Frictional<D> for Regularised<P> {
    fn mu(&self) -> &[f64] {
        self.base.mu()
    }
}

impl<P: Rows<D>, const D: usize> Rows<D> for Regularised<P> {
    fn bounds(&self) -> Option<&Bounds> {
        self.base.bounds()
    }

    fn all_impulses(point: &mut Self::Point) -> (&mut [f64], &mut [f64]) {
        P::all_impulses(point)
    }

    fn row_response(&self, state: &Self::State, j: usize) -> f64 {
        self.base.row_response(&state.base, j)
    }

    fn row_velocity(&self, state: &Self::State, r: &[f64], lambda: &[f64], j: usize) -> f64 {
        self.base.row_velocity(&state.base, r, lambda, j)
    }

    fn row_moved(&self, state: &mut Self::State, j: usize, by: f64) {
        self.base.row_moved(&mut state.base, j, by);
    }
}

impl<P: Blockwise<D>, const D: usize> Blockwise<D> for Regularised<P> {
    #[inline(always)]
    fn velocity(&self, state: &Self::State, r: &[f64], c: usize) -> [f64; D] {
        let mut u = self.base.velocity(&state.base, r, c);
        for k in 0..D {
            let i = D * c + k;
            u[k] += self.weight[c] * (r[i] - self.center[i]);
        }
        u
    }

    #[inline(always)]
    fn moved(&self, state: &mut Self::State, c: usize, dr: &[f64; D]) {
        self.base.moved(&mut state.base, c, dr);
    }

    #[inline(always)]
    fn foresee(&self, state: &Self::State, c: usize) {
        self.base.foresee(&state.base, c);
    }
}

impl<P: Concurrent<D>, const D: usize> Concurrent<D> for Regularised<P> {
    fn places(&self, state: &Self::State, c: usize, reads: &mut Vec<u32>, writes: &mut Vec<u32>) {
        self.base.places(&state.base, c, reads, writes);
    }
}

impl<P: Linear<D>, const D: usize> Linear<D> for Regularised<P> {
    fn velocities(&self, state: &mut Self::State, r: &[f64], u: &mut [f64]) {
        self.base.velocities(&mut state.base, r, u);
        for (i, u) in u.iter_mut().enumerate() {
            *u += self.weight[i / D] * (r[i] - self.center[i]);
        }
    }

    fn velocities_precisely(&self, state: &mut Self::State, r: &[f64], u: &mut [f64]) {
        self.base.velocities_precisely(&mut state.base, r, u);
        for (i, u) in u.iter_mut().enumerate() {
            *u += self.weight[i / D] * (r[i] - self.center[i]);
        }
    }
}

impl<P: Linearised<D>, const D: usize> Linearised<D> for Regularised<P> {
    /// `Q + P (W + α w) = (Q + P α w) + P W`.
    fn linearise(
        &self,
        state: &mut Self::State,
        p: &[Block<D>],
        q: &[Block<D>],
    ) -> Result<(), Singular> {
        let RegularisedState { base, shifted } = state;
        shifted.clear();
        shifted.extend(self.weight.iter().zip(p).zip(q).map(|((weight, p), q)| {
            let mut sum = *q;
            for k in 0..D {
                for l in 0..D {
                    sum[k][l] += weight * p[k][l];
                }
            }
            sum
        }));
        self.base.linearise(base, p, shifted)
    }

    fn orientation(&self, state: &mut Self::State) -> f64 {
        self.base.orientation(&mut state.base)
    }

    fn solve_linearised(
        &self,
        state: &mut Self::State,
        b: &[f64],
        x: &mut [f64],
        wx: &mut [f64],
    ) -> f64 {
        let left = self.base.solve_linearised(&mut state.base, b, x, wx);
        for (i, wx) in wx.iter_mut().enumerate() {
            *wx += self.weight[i / D] * x[i];
        }
        left
    }

    fn costs(&self, state: &mut Self::State) -> Costs {
        self.base.costs(&mut state.base)
    }
}

#[cfg(test)]
mod tests {
    use nonsmooth_linalg::{Bsr, Csc, small};
    use nonsmooth_problem::planted::Planted;

    use super::*;

    /// The view of `W + α w`, `q − α w r_k` against that problem written out, and the linear systems against both.
    #[test]
    fn the_view_is_the_problem_written_out() {
        let (base, _) = Planted { contacts: 6, dofs: 30, ..Planted::default() }.local::<3>();
        let weight: Vec<f64> = (0..6).map(|c| 0.5 + c as f64).collect();
        let center: Vec<f64> = (0..18).map(|i| (i as f64).sin()).collect();
        let shift = (0..18).map(|i| (i, i, weight[i / 3]));
        let w = Csc::from_triplets(18, 18, base.W.to_csc().triplets().chain(shift)).unwrap();
        let q = (0..18).map(|i| base.q[i] - weight[i / 3] * center[i]).collect();
        let explicit = FrictionLocal::<3>::new(Bsr::from_csc(&w), q, base.mu.clone()).unwrap();
        let view = Regularised { base, weight, center };
        let mut a = view.state(Access::Newton).unwrap();
        let mut b = explicit.state(Access::Newton).unwrap();
        let r: Vec<f64> = (0..18).map(|i| (0.3 * i as f64).cos()).collect();
        let near = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-10);
        let (mut u, mut v) = (vec![0.0; 18], vec![0.0; 18]);
        view.velocities(&mut a, &r, &mut u);
        explicit.velocities(&mut b, &r, &mut v);
        assert!(near(&u, &v));
        for c in 0..6 {
            assert!(near(&view.velocity(&a, &r, c), &small::block::<3>(&v, c)));
            let (x, y) = (view.diagonal_block(&a, c), explicit.diagonal_block(&b, c));
            assert!((0..3).all(|k| near(&x[k], &y[k])));
        }
        let p: Vec<Block<3>> =
            (0..6).map(|c| [[1.0, 0.1, 0.0], [0.0, 2.0, c as f64], [0.2, 0.0, 1.0]]).collect();
        let identity = vec![[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]; 6];
        view.linearise(&mut a, &p, &identity).unwrap();
        explicit.linearise(&mut b, &p, &identity).unwrap();
        let (mut x, mut y) = (vec![0.0; 18], vec![0.0; 18]);
        assert!(view.solve_linearised(&mut a, &r, &mut x, &mut u) < 1e-10);
        assert!(explicit.solve_linearised(&mut b, &r, &mut y, &mut v) < 1e-10);
        assert!(near(&x, &y) && near(&u, &v));
    }

    /// The spread by products, which the view has, against that by entries; never above the share of directions that the unknowns leave.
    #[test]
    fn the_spread_by_products_is_that_by_entries() {
        let mut last = 0.0;
        for dofs in [40, 120, 400] {
            let (base, _) = Planted { contacts: 60, dofs, ..Planted::default() }.local::<3>();
            let mut state = base.state(Access::Newton).unwrap();
            let (mut units, mut room) = (vec![], vec![]);
            let exact = base.spread(&mut state, &mut units);
            let (weight, center) = (vec![0.0; 60], vec![0.0; 180]);
            let view = Regularised { base, weight, center };
            let mut state = view.state(Access::Newton).unwrap();
            let probed = view.spread(&mut state, &mut room);
            assert!((probed / exact - 1.0).abs() < 0.3, "{dofs}: {probed} {exact}");
            assert!(exact > last && exact <= (dofs as f64 / 180.0).min(1.0) * (1.0 + 1e-9));
            last = exact;
        }
    }
}

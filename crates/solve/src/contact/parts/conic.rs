//! The convex problem with s given, solved by the primal–dual interior-point method of [`Central`].
//!
//! ```text
//! min ½ rᵀW r + (q + mu s e_N)ᵀ r,  r ∈ K,     or     K* ∋ W r + q + mu s e_N  ⟂  r ∈ K
//! ```
//!
//! (the second where W is not symmetric: it is solved with W as it is). s = 0 is the convex relaxation of Coulomb's law;
//! `s = ‖u_T‖` at the solution is the law itself. r is not unique where W is rank deficient: u is.

use nonsmooth_linalg::{Singular, budget};

use super::central::{Central, Iterate};
use crate::contact::form::{Disked, Linearised};
use crate::contact::law::{Coulomb, DiskLaw};

/// A solver of convex problems, with its workspace; a second problem of the same shape allocates nothing.
///
/// ```text
/// begin ── iterate … iterate ── r(), u()        or at once:   solve
/// ```
#[derive(Debug, Clone)]
pub struct ConvexIp<const D: usize, L = Coulomb> {
    core: Central<L, D>,
}

/// How [`ConvexIp::solve`] ended. Its answer is the best iterate whatever ended it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConvexEnd {
    /// `‖w r − P_K(w r − ũ)‖/‖q‖` of the convex problem at the answer.
    pub error: f64,
    /// Iterations, each with one factorisation.
    pub iterations: usize,
}

impl<L, const D: usize> Default for ConvexIp<D, L> {
    fn default() -> Self {
        Self { core: Central::default() }
    }
}

impl<L: DiskLaw<D>, const D: usize> ConvexIp<D, L> {
    /// A solver without a workspace yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Begins the problem with the given s, a velocity for each disk of each contact. `state` must be made with `Access::Newton`.
    ///
    /// `start`: impulses to begin near, and by how much (in units of the free velocity, say 1e-2) to stay inside the
    /// cones at first; else the start is cold. A good start saves some iterations, not most of them.
    pub fn begin<P: Linearised<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        s: &[f64],
        start: Option<(&[f64], f64)>,
    ) -> Iterate {
        self.core.begin_convex(problem, state, s, start)
    }

    /// Begins the convex relaxation, s = 0, for one factorisation.
    pub fn begin_relaxed<P: Linearised<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
    ) -> Iterate {
        self.core.begin_relaxed(problem, state)
    }

    /// One iteration. `Err`: the matrix is numerically singular, the iterate has not moved.
    pub fn iterate<P: Linearised<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
    ) -> Result<Iterate, Singular> {
        self.core.iterate(problem, state)
    }

    /// Iterates until the error is at most `tolerance`, at most `most` times, and not on where it has stalled.
    pub fn solve<P: Linearised<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        tolerance: f64,
        most: usize,
    ) -> ConvexEnd {
        let (mut iterations, mut since_best) = (0, 0);
        let goes_on = |since_best| since_best < PATIENCE && !budget::over();
        while self.core.best().1 > tolerance && iterations < most && goes_on(since_best) {
            let before = self.core.best().1;
            match self.core.iterate(problem, state) {
                Ok(now) if now.alpha > 0.0 => {}
                _ => break,
            }
            iterations += 1;
            since_best = if self.core.best().1 < 0.9 * before { 0 } else { since_best + 1 };
        }
        self.core.restore(problem, state);
        ConvexEnd { error: self.core.best().1, iterations }
    }

    /// The impulses of the present iterate; after [`solve`](Self::solve), the answer.
    pub fn r(&self) -> &[f64] {
        self.core.r()
    }

    /// The velocities `W r + q` that belong to [`r`](Self::r).
    pub fn u(&self) -> &[f64] {
        self.core.u()
    }
}

/// Iterations without a better iterate after which a solve has stalled.
const PATIENCE: usize = 12;

#[cfg(test)]
mod tests {
    use nonsmooth_linalg::norm_of;
    use nonsmooth_problem::planted::{Planted, PlantedMix};
    use nonsmooth_problem::{FrictionLocal, Problem};

    use super::*;
    use crate::contact::form::{Access, Contacts, Frictional, Linear};
    use crate::contact::law::cone;

    fn mixes() -> Vec<Planted> {
        let all = PlantedMix { open: 1.0, stick: 1.0, slip: 1.0, degenerate: 0.0 };
        let base = Planted { mix: all, ..Planted::default() };
        vec![
            base.clone(),
            // Full rank.
            Planted { contacts: 15, dofs: 90, seed: 1, ..base.clone() },
            // Hyperstatic: 90 unknowns, rank 12.
            Planted { contacts: 30, dofs: 12, seed: 2, ..base.clone() },
            Planted { contacts: 40, dofs: 24, seed: 3, mu: (0.0, 0.8), ..base.clone() },
            Planted { contacts: 20, dofs: 120, seed: 4, mu: (0.0, 0.0), ..base.clone() },
            Planted { contacts: 20, dofs: 60, seed: 5, bilateral: 4, ..base.clone() },
            Planted { contacts: 20, dofs: 60, seed: 6, skew: 0.05, ..base.clone() },
            Planted {
                contacts: 30,
                dofs: 60,
                mix: PlantedMix { degenerate: 1.0, ..all },
                seed: 7,
                ..base
            },
        ]
    }

    /// The sliding speeds of a planted point, which make its convex problem Coulomb's.
    fn speeds<P: Linear<D> + Frictional<D>, const D: usize>(
        problem: &P,
        state: &mut P::State,
        r: &[f64],
    ) -> (Vec<f64>, Vec<f64>) {
        let mut u = vec![0.0; r.len()];
        problem.velocities(state, r, &mut u);
        let s = u.chunks(D).map(|u| cone::tangential_norm::<D>(u.try_into().unwrap())).collect();
        (u, s)
    }

    fn reaches<P: Linearised<D> + Frictional<D>, const D: usize>(
        problem: &P,
        r: &[f64],
        what: &str,
    ) {
        let mut state = problem.state(Access::Newton).unwrap();
        let (planted, s) = speeds::<P, D>(problem, &mut state, r);
        let mut ip = ConvexIp::<D>::new();
        ip.begin(problem, &mut state, &s, None);
        let end = ip.solve(problem, &mut state, 1e-13, 80);
        assert!(end.error <= 1e-13 && end.iterations <= 60, "{what}: {end:?}");
        // u is unique where W is symmetric and positive semidefinite.
        let apart = norm_of(ip.u().iter().zip(&planted).map(|(a, b)| a - b));
        assert!(apart <= 1e-5, "{what}: u is {apart:e} apart");
    }

    #[test]
    fn planted_solutions_are_found_to_1e_13() {
        for (k, case) in mixes().iter().enumerate() {
            let (problem, point) = case.local::<3>();
            reaches::<_, 3>(&problem, &point.r, &format!("local, space, case {k}"));
            let (problem, point) = case.local::<2>();
            reaches::<_, 2>(&problem, &point.r, &format!("local, plane, case {k}"));
            let (problem, point) = case.global::<3>();
            reaches::<_, 3>(&problem, &point.r, &format!("global, space, case {k}"));
            let (problem, point) = case.global::<2>();
            reaches::<_, 2>(&problem, &point.r, &format!("global, plane, case {k}"));
        }
    }

    /// The relaxation by projected gradients, very many of them.
    fn projected_gradient(problem: &FrictionLocal<3>, s: &[f64]) -> Vec<f64> {
        let mut state = problem.state(Access::Products).unwrap();
        let m = problem.q.len();
        let unit = (0..m / 3)
            .map(|c| {
                let row: f64 = problem
                    .W
                    .row(c)
                    .1
                    .iter()
                    .map(|b| norm_of(b.as_flattened().iter().copied()))
                    .sum();
                row
            })
            .fold(0.0, f64::max);
        let (mut r, mut y, mut u) = (vec![0.0; m], vec![0.0; m], vec![0.0; m]);
        let mut momentum = 1.0_f64;
        for _ in 0..200_000 {
            problem.velocities(&mut state, &y, &mut u);
            let old = r.clone();
            for c in 0..m / 3 {
                let mut x: [f64; 3] = y[3 * c..3 * c + 3].try_into().unwrap();
                u[3 * c] += problem.mu[c] * s[c];
                (0..3).for_each(|k| x[k] -= u[3 * c + k] / unit);
                r[3 * c..3 * c + 3].copy_from_slice(&cone::project(&x, problem.mu[c]));
            }
            let next = 0.5 * (1.0 + (1.0 + 4.0 * momentum * momentum).sqrt());
            let moved: f64 = (0..m).map(|i| (y[i] - r[i]) * (r[i] - old[i])).sum();
            let beta = if moved > 0.0 { 0.0 } else { (momentum - 1.0) / next };
            momentum = if moved > 0.0 { 1.0 } else { next };
            (0..m).for_each(|i| y[i] = r[i] + beta * (r[i] - old[i]));
        }
        r
    }

    #[test]
    fn the_relaxation_is_that_of_projected_gradients() {
        for seed in 0..3 {
            let case = Planted { contacts: 12, dofs: 24, seed, ..Planted::default() };
            let (problem, _) = case.local::<3>();
            let s = vec![0.0; 12];
            let r = projected_gradient(&problem, &s);
            let mut state = problem.state(Access::Newton).unwrap();
            let mut u = vec![0.0; r.len()];
            problem.velocities(&mut state, &r, &mut u);
            let mut ip = ConvexIp::<3>::new();
            ip.begin(&problem, &mut state, &s, None);
            let end = ip.solve(&problem, &mut state, 1e-13, 80);
            assert!(end.error <= 1e-13, "{end:?}");
            let apart = norm_of(ip.u().iter().zip(&u).map(|(a, b)| a - b));
            assert!(apart <= 1e-6, "seed {seed}: {apart:e}");
        }
    }

    #[test]
    fn a_start_at_the_solution_saves_iterations() {
        let (problem, point) =
            Planted { contacts: 30, dofs: 90, ..Planted::default() }.local::<3>();
        let mut state = problem.state(Access::Newton).unwrap();
        let (_, s) = speeds::<_, 3>(&problem, &mut state, &point.r);
        let mut ip = ConvexIp::<3>::new();
        ip.begin(&problem, &mut state, &s, None);
        let cold = ip.solve(&problem, &mut state, 1e-10, 80);
        ip.begin(&problem, &mut state, &s, Some((&point.r, 1e-3)));
        let warm = ip.solve(&problem, &mut state, 1e-10, 80);
        assert!(cold.error <= 1e-10 && warm.error <= 1e-10, "{cold:?} {warm:?}");
        assert!(warm.iterations < cold.iterations, "{cold:?} {warm:?}");
    }

    #[test]
    fn units_do_not_matter() {
        let (problem, point) =
            Planted { contacts: 20, dofs: 60, ..Planted::default() }.local::<3>();
        let iterations = |problem: &FrictionLocal<3>, r: &[f64]| {
            let mut state = problem.state(Access::Newton).unwrap();
            let (_, s) = speeds::<_, 3>(problem, &mut state, r);
            let mut ip = ConvexIp::<3>::new();
            ip.begin(problem, &mut state, &s, None);
            ip.solve(problem, &mut state, 1e-9, 80)
        };
        let first = iterations(&problem, &point.r);
        for (w, q) in [(1e6, 1.0), (1e-6, 1.0), (1.0, 1e6), (1e6, 1e-6)] {
            let mut other = problem.clone();
            other.W = scaled(&problem, w);
            other.q.iter_mut().for_each(|x| *x *= q);
            let r: Vec<f64> = point.r.iter().map(|r| r * q / w).collect();
            let end = iterations(&other, &r);
            assert_eq!(end.iterations, first.iterations, "W × {w:e}, q × {q:e}: {end:?}");
        }
        assert!(first.error <= 1e-9 && problem.unknowns() == 60);
    }

    fn scaled(problem: &FrictionLocal<3>, factor: f64) -> nonsmooth_linalg::Bsr<3> {
        let w = problem.W.to_csc();
        let entries = w.triplets().map(|(i, j, x)| (i, j, factor * x));
        let w = nonsmooth_linalg::Csc::from_triplets(w.nrows(), w.ncols(), entries);
        nonsmooth_linalg::Bsr::from_csc(&w.expect("in range"))
    }

    #[test]
    fn a_problem_without_a_solution_ends() {
        // One contact pushed in by q with W = 0: r grows without bound.
        let w = nonsmooth_linalg::Csc::from_triplets(3, 3, std::iter::empty()).unwrap();
        let w = nonsmooth_linalg::Bsr::from_csc(&w);
        let problem = FrictionLocal::<3>::new(w, vec![-1.0, 0.0, 0.0], vec![0.5]).unwrap();
        let mut state = problem.state(Access::Newton).unwrap();
        let mut ip = ConvexIp::<3>::new();
        ip.begin(&problem, &mut state, &[0.0], None);
        let end = ip.solve(&problem, &mut state, 1e-10, 80);
        assert!(end.error > 0.5, "{end:?}");
        assert!(ip.r().iter().all(|r| r.is_finite()));
    }
}

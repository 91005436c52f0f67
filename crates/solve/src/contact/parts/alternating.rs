//! Alternating directions: the impulses that the dynamics asks for, and those that the cones allow.
//!
//! Problem: `u = W r + q`, `K* ∋ u + s ⟂ r ∈ K`, `s = shift(u) e_N` for each contact, under any law whose cone is made of disks; W of any rank.
//!
//! Method: ADMM in the metric `w_c = tr(W_cc)/D`, that of the solver `admm`:
//!
//! ```text
//! (W + ρ w) r = ρ w (z − y) − q − s,    s = shift(u) e_N with the dual velocity u = −ρ w y,
//! t = α r + (1 − α) z + y,    z = P_K(t),    y = t − z.
//! ```
//!
//! It is run in two ways. *Rest*: s = 0, the convex relaxation, which has the same solutions at rest; ρ = 1e-6, α = 1, from nothing. As ρ vanishes it is the Douglas–Rachford iteration
//! between the impulses that leave nothing moving (`W r + q = 0`) and the cones: the static problem of limit analysis. It ends after finitely many iterations where such impulses lie within
//! the cones (within all of them: `P_K` is linear there), few however tall the structure; with s of the law some of them circle. *General*: the law itself, ρ about 0.1, balanced between
//! the two residuals at a few steps, α = 1.6.
//!
//! References: EcksteinBertsekas1992 (Douglas–Rachford and ADMM); Carpentier2024 (the exact law); BoydParikhChuPeleatoEckstein2011 (α, balancing).
//! Cost: one factorisation of `W + ρ w` for each ρ; an iteration one solve with it, refined with products with W, and nc projections.
//! Fails: slow where contacts slide or nothing is at rest; the caller watches the rate.

use nonsmooth_linalg::{Block, Singular, small};

use crate::contact::form::{Disked, Linearised};
use crate::contact::law::ContactLaw;
use crate::contact::law::cone::ConvexSet;

/// ρ is balanced after so many steps, where the residuals differ by more than [`BALANCED`].
const BALANCE_AFTER: [usize; 5] = [20, 60, 150, 400, 1000];
const BALANCED: f64 = 5.0;

/// A search for rest may cost this many factorisations.
pub const REST: f64 = 10.0;
/// It is given up where the first iteration leaves more than this (at rest 1e-6 to 2), or the second more than a part of that (at rest up to .75, else mostly .95 and more). What it leaves may lie still for a
/// dozen iterations and then vanish, when all impulses lie within their cones at last, so that its rate is not asked before so many; or so many where the first one came near.
const FAR: f64 = 2.5;
const FALL: f64 = 0.8;
const YOUNG: usize = 16;
const NEAR: f64 = 0.1;
const YOUNG_NEAR: usize = 6;

/// The ways of running it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Way {
    /// s = 0, with a penalty that vanishes.
    #[default]
    Rest,
    /// The law, with a penalty that is balanced.
    General,
}

impl Way {
    /// ρ, and α. Walls and towers of up to 540 layers at rest take the same few iterations with ρ from 1e-4 to 1e-7.
    fn parameters(self) -> (f64, f64) {
        match self {
            Way::Rest => (1e-6, 1.0),
            Way::General => (0.1, 1.6),
        }
    }
}

/// The iterate.
#[derive(Debug, Default)]
pub struct Alternating<const D: usize> {
    way: Way,
    rho: f64,
    steps: usize,
    /// What the first iteration left.
    first: f64,
    /// `w_c`, positive, and ‖q‖.
    unit: Vec<f64>,
    scale: f64,
    identity: Vec<Block<D>>,
    penalty: Vec<Block<D>>,
    q: Vec<f64>,
    r: Vec<f64>,
    z: Vec<f64>,
    y: Vec<f64>,
    right: Vec<f64>,
    wr: Vec<f64>,
}

impl<const D: usize> Alternating<D> {
    /// Allocates for so many contacts, where that has not been done.
    pub fn make_room(&mut self, contacts: usize) {
        for x in [&mut self.q, &mut self.r, &mut self.z, &mut self.y, &mut self.right, &mut self.wr]
        {
            x.resize(D * contacts, 0.0);
        }
        self.unit.resize(contacts, 0.0);
        self.identity.resize(contacts, [[0.0; D]; D]);
        self.penalty.resize(contacts, [[0.0; D]; D]);
    }

    /// Factorises, and begins at the impulses `start`, or at none. Errors: a matrix that cannot be factorised.
    pub fn begin<P: Linearised<D> + Disked<D>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        way: Way,
        start: Option<&[f64]>,
    ) -> Result<(), Singular> {
        self.make_room(problem.contacts());
        (self.way, self.rho, self.steps) = (way, way.parameters().0, 0);
        self.scale = problem.velocity_scale(state);
        problem.units(state, &mut self.unit);
        self.z.fill(0.0);
        self.y.fill(0.0);
        problem.velocities(state, &self.z, &mut self.q);
        if let Some(start) = start {
            self.start_at(problem, state, start);
        }
        self.factorise(problem, state)
    }

    /// z on the cones, and the dual velocity of its velocities.
    fn start_at<P: Linearised<D> + Disked<D>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        start: &[f64],
    ) {
        problem.velocities(state, start, &mut self.wr);
        for (c, w) in self.unit.iter().enumerate() {
            let law = problem.law(c);
            let z = law.project(&small::block(start, c));
            let mut u: [f64; D] = small::block(&self.wr, c);
            u[0] += law.shift(&u);
            // P_K*(ũ) = ũ + P_K(−ũ).
            let polar = law.project(&u.map(|x| -x));
            for k in 0..D {
                self.z[D * c + k] = z[k];
                self.y[D * c + k] = -(u[k] + polar[k]) / (self.rho * w);
            }
        }
    }

    fn factorise<P: Linearised<D> + Disked<D>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
    ) -> Result<(), Singular> {
        let diagonal = |x: f64| {
            let mut block = [[0.0; D]; D];
            (0..D).for_each(|k| block[k][k] = x);
            block
        };
        self.identity.clear();
        self.identity.resize(self.unit.len(), diagonal(1.0));
        self.penalty.clear();
        self.penalty.extend(self.unit.iter().map(|w| diagonal(self.rho * w)));
        problem.linearise(state, &self.identity, &self.penalty)
    }

    /// One iteration; returns the larger of the residuals of the splitting, relative to ‖q‖: infinite where a matrix cannot be factorised.
    pub fn iterate<P: Linearised<D> + Disked<D>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
    ) -> f64 {
        let alpha = self.way.parameters().1;
        let shifted = self.way == Way::General;
        let Self { unit, scale, rho, q, r, z, y, right, wr, .. } = self;
        for (c, w) in unit.iter().enumerate() {
            let dual: [f64; D] = small::block::<D>(y, c).map(|y| -*rho * w * y);
            for i in D * c..D * c + D {
                right[i] = *rho * w * (z[i] - y[i]) - q[i];
            }
            if shifted {
                right[D * c] -= problem.law(c).shift(&dual);
            }
        }
        problem.solve_linearised(state, right, r, wr);
        let (mut primal, mut dual) = (0.0, 0.0);
        for (c, w) in unit.iter().enumerate() {
            let i = D * c;
            let t: [f64; D] =
                std::array::from_fn(|k| alpha * r[i + k] + (1.0 - alpha) * z[i + k] + y[i + k]);
            let new = problem.law(c).project(&t);
            for k in 0..D {
                primal += (w * (r[i + k] - new[k])).powi(2);
                dual += (*rho * w * (new[k] - z[i + k])).powi(2);
                z[i + k] = new[k];
                y[i + k] = t[k] - new[k];
            }
        }
        let (primal, dual) = (primal.sqrt() / *scale, dual.sqrt() / *scale);
        self.steps += 1;
        let estimate = primal.max(dual);
        if self.steps == 1 {
            self.first = estimate;
        }
        match self.balance(problem, state, primal / dual) {
            Ok(()) => estimate,
            Err(Singular) => f64::INFINITY,
        }
    }

    /// Another ρ where one residual is much larger than the other.
    fn balance<P: Linearised<D> + Disked<D>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        ratio: f64,
    ) -> Result<(), Singular> {
        let due = self.way == Way::General && BALANCE_AFTER.contains(&self.steps);
        let balanced = (1.0 / BALANCED..=BALANCED).contains(&ratio);
        let sensible = ratio > 0.0 && ratio.is_finite();
        if !due || balanced || !sensible {
            return Ok(());
        }
        let factor = ratio.sqrt().clamp(0.1, 10.0);
        self.rho *= factor;
        // The multipliers are scaled by ρ.
        self.y.iter_mut().for_each(|y| *y /= factor);
        self.factorise(problem, state)
    }

    /// Whether so few iterations are no reason to give up.
    pub fn is_young(&self) -> bool {
        self.steps < if self.first > NEAR { YOUNG } else { YOUNG_NEAR }
    }

    /// Whether what the last iteration left says that there is no rest, or a slow way to it.
    pub fn is_hopeless(&self, estimate: f64) -> bool {
        let most = match self.steps {
            1 => FAR,
            2 => FALL * self.first,
            _ => f64::INFINITY,
        };
        estimate > most || estimate.is_nan()
    }

    /// The steps done since it began.
    pub fn steps(&self) -> usize {
        self.steps
    }

    /// The impulses, within the cones.
    pub fn impulses(&self) -> &[f64] {
        &self.z
    }
}

#[cfg(test)]
mod tests {
    use nonsmooth_linalg::{Bsr, Csc};
    use nonsmooth_problem::FrictionLocal;
    use nonsmooth_problem::planted::{Planted, PlantedMix};

    use super::*;
    use crate::contact::form::Access;
    use crate::contact::law::cfun::natural_residual;

    /// The iterations to 1e-10, and the natural residual of what they come to.
    fn run<P: Linearised<3> + Disked<3>>(problem: &P, way: Way, start: bool) -> (usize, f64) {
        let mut state = problem.state(Access::Newton).unwrap();
        let mut splitting = Alternating::<3>::default();
        let zero = vec![0.0; 3 * problem.contacts()];
        splitting.begin(problem, &mut state, way, start.then_some(&zero)).unwrap();
        while splitting.steps() < 3000 && splitting.iterate(problem, &mut state) > 1e-10 {}
        let r = splitting.impulses();
        let mut u = zero.clone();
        problem.velocities(&mut state, r, &mut u);
        let residual = |c: usize| {
            let unit = small::mean_diagonal(&problem.diagonal_block(&state, c));
            natural_residual(unit, &small::block(r, c), &small::block(&u, c), problem.law(c))
        };
        let sum: f64 = (0..problem.contacts()).map(residual).sum();
        (splitting.steps(), sum.sqrt() / problem.velocity_scale(&state))
    }

    /// Each contact twice: rank half, and the impulses of least norm are halves.
    fn twice(problem: &FrictionLocal<3>) -> FrictionLocal<3> {
        let (w, m) = (problem.W.to_csc(), problem.q.len());
        let four = |(i, j, x): (usize, usize, f64)| {
            [(0, 0), (0, m), (m, 0), (m, m)].map(|(a, b)| (i + a, j + b, x))
        };
        let w = Csc::from_triplets(2 * m, 2 * m, w.triplets().flat_map(four)).unwrap();
        let (q, mu) = (problem.q.repeat(2), problem.mu.repeat(2));
        FrictionLocal::new(Bsr::from_csc(&w), q, mu).unwrap()
    }

    #[test]
    fn what_rests_is_found_in_a_few_iterations_whatever_the_rank() {
        let mix = PlantedMix { open: 0.0, stick: 1.0, slip: 0.0, degenerate: 0.0 };
        let case = Planted { mix, contacts: 40, dofs: 150, ..Planted::default() };
        let (local, _) = case.local::<3>();
        for (steps, residual) in [
            run(&case.global::<3>().0, Way::Rest, false),
            run(&local, Way::Rest, false),
            run(&twice(&local), Way::Rest, false),
        ] {
            assert!(steps <= 10 && residual < 1e-9, "{steps} {residual:e}");
        }
    }

    #[test]
    fn in_general_the_fixed_points_obey_the_law() {
        let case = Planted { contacts: 15, dofs: 90, seed: 8, ..Planted::default() };
        for start in [false, true] {
            let (steps, residual) = run(&case.global::<3>().0, Way::General, start);
            assert!(steps < 3000 && residual < 1e-8, "{steps} {residual:e}");
        }
    }
}

//! The sliding speeds of Cadoux' fixed point: s, their image F(s), and Newton's method on `F(s) − s`.
//!
//! Problem: the law as `F(s) = s`, where F(s) are the speeds `‖u_k‖` in the disks of the contacts at the solution of the convex problem with `Σ_k mu_k s_k` in place of `Σ_k mu_k ‖u_k‖`,
//! which is the caller's to solve.
//!
//! Newton needs F'(s), which is not available column by column at a reasonable price, but is not needed either: implicit
//! differentiation of the natural map `r = P_K(r − ρ(u + mu s e_N))` gives `(I − J) dr + ρJ (W dr + mu ds e_N) = 0`, and Newton asks
//! for `ds = F(s) − s + nᵀ du_T`, `n = u_T/‖u_T‖`. With ds eliminated the two are one sparse system,
//! `[I − J + ρJ (I + mu e_N nᵀ) W] dr = −ρJ mu (F(s) − s) e_N`: one factorisation, no Krylov method.
//! A step that does not lower ‖F(s) − s‖ is taken back and replaced by fixed-point steps, one more each time up to ten.
//!
//! References: Cadoux2009; AcaryCadouxLemarechalMalick2011.
//! Cost of a step: one factorisation and one solve. Storage: 3 vectors, two blocks and five numbers a contact.

use nonsmooth_linalg::{Block, small};

use crate::contact::form::{Disked, Linearised};
use crate::contact::law::DiskLaw;

/// ρ of the natural map, in units of 1/w_c.
const RHO: f64 = 10.0;
/// Slower than this part of ‖q‖ is no direction.
const STILL: f64 = 1e-14;
/// Newton steps on a convex problem whose interior point did not reach its tolerance, and halvings of one.
const POLISH: usize = 5;
const HALVINGS: i32 = 8;
/// A solve that leaves more than this of its right-hand side is none.
const SOLVED: f64 = 1e-2;
/// Fixed-point steps after a Newton step that was taken back: one more each time, at most so many.
const WAIT: usize = 10;

/// The speeds and the workspace of their Newton steps, of each disk of each contact.
#[derive(Debug, Clone)]
pub struct Speeds<L, const D: usize> {
    laws: Vec<L>,
    /// `w_c`, positive.
    unit: Vec<f64>,
    /// `‖q‖`.
    scale: f64,
    /// s, F(s).
    pub(in crate::contact) s: Vec<f64>,
    pub(in crate::contact) image: Vec<f64>,
    /// F(s) − s, and the Newton step.
    gap: Vec<f64>,
    ds: Vec<f64>,
    /// F(s) where the last Newton step began.
    held: Vec<f64>,
    /// ‖F(s) − s‖ before the Newton step that led here.
    before: Option<f64>,
    /// Newton steps taken back so far, and fixed-point steps to go before the next one.
    refused: usize,
    wait: usize,
    p: Vec<Block<D>>,
    q: Vec<Block<D>>,
    b: Vec<f64>,
    dr: Vec<f64>,
    du: Vec<f64>,
}

impl<L: DiskLaw<D>, const D: usize> Speeds<L, D> {
    /// For `problem`.
    pub fn new<P: Linearised<D> + Disked<D, Law = L>>(problem: &P, state: &P::State) -> Self {
        let mut out = Self {
            laws: vec![],
            unit: vec![],
            scale: 1.0,
            s: vec![],
            image: vec![],
            gap: vec![],
            ds: vec![],
            held: vec![],
            before: None,
            refused: 0,
            wait: 0,
            p: vec![],
            q: vec![],
            b: vec![],
            dr: vec![],
            du: vec![],
        };
        out.fill(problem, state);
        out
    }

    /// Takes another problem; allocates nothing where there are no more contacts than before.
    pub fn fill<P: Linearised<D> + Disked<D, Law = L>>(&mut self, problem: &P, state: &P::State) {
        let n = problem.contacts();
        self.scale = problem.velocity_scale(state);
        self.laws.clear();
        self.laws.extend((0..n).map(|c| problem.law(c)));
        problem.units(state, &mut self.unit);
        let speeds = [&mut self.s, &mut self.image, &mut self.gap, &mut self.ds, &mut self.held];
        for x in speeds {
            x.clear();
            x.resize(L::DISKS * n, 0.0);
        }
        for x in [&mut self.b, &mut self.dr, &mut self.du] {
            x.clear();
            x.resize(D * n, 0.0);
        }
        for blocks in [&mut self.p, &mut self.q] {
            blocks.clear();
            blocks.resize(n, [[0.0; D]; D]);
        }
        self.begin();
    }

    /// Begins at s = 0, the convex relaxation.
    pub fn begin(&mut self) {
        self.s.fill(0.0);
        (self.before, self.refused, self.wait) = (None, 0, 0);
    }

    /// Begins at the image that was last [`seen`](Self::see).
    pub fn begin_at_image(&mut self) {
        self.begin();
        self.s.copy_from_slice(&self.image);
    }

    /// F(s), from the velocities at the solution of the convex problem.
    pub fn see(&mut self, u: &[f64]) {
        for (i, image) in self.image.iter_mut().enumerate() {
            let u: [f64; D] = small::block(u, i / L::DISKS);
            *image = size(&u[L::rows(i % L::DISKS)]);
        }
    }

    /// After the convex problem with s has the solution `r` with velocities `u`, whose image was seen: back from a Newton step in vain, or a Newton step if
    /// `newton` says so. False where it is the caller's turn, with a step of the fixed point.
    pub fn newton<P: Linearised<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        (r, u): (&[f64], &[f64]),
        newton: bool,
    ) -> bool {
        let mut square = 0.0;
        for (i, gap) in self.gap.iter_mut().enumerate() {
            *gap = self.image[i] - self.s[i];
            // The speed of a contact without friction does not matter.
            let mu = self.laws[i / L::DISKS].coefficient(i % L::DISKS);
            square += if mu > 0.0 { *gap * *gap } else { 0.0 };
        }
        let merit = square.sqrt();
        let refused = self.before.take().is_some_and(|before| merit.is_nan() || merit >= before);
        if refused {
            // Back to where it began, and on by the fixed point.
            self.refused += 1;
            self.wait = self.refused.min(WAIT);
            self.s.copy_from_slice(&self.held);
            return true;
        }
        if newton && self.wait == 0 && self.solve(problem, state, r, u) {
            self.before = Some(merit);
            self.held.copy_from_slice(&self.image);
            self.s.iter_mut().zip(&self.ds).for_each(|(s, ds)| *s = (*s + ds).max(0.0));
            return true;
        }
        self.wait = self.wait.saturating_sub(1);
        false
    }

    /// A step of the fixed point, this share of the way to F(s).
    pub fn advance(&mut self, share: f64) {
        for (s, image) in self.s.iter_mut().zip(&self.image) {
            *s += share * (image - *s);
        }
    }

    /// Semismooth Newton steps on the natural map of the convex problem with s, from `r` with velocities `u`, a few, while its relative residual is above `tolerance`: the interior point
    /// ends short of it where W lacks the range for its last steps. Returns the factorisations.
    pub fn polish<P: Linearised<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        (r, u): (&mut [f64], &mut [f64]),
        tolerance: f64,
    ) -> usize {
        for steps in 0..POLISH {
            if self.map(r, u, 1.0, 0.0) <= tolerance {
                return steps;
            }
            let merit = self.map(r, u, RHO, 0.0);
            for c in 0..self.laws.len() {
                let rho = RHO / self.unit[c];
                let [at, x] = self.argument(c, r, u, rho, 0.0);
                let (p, jacobian) = (self.laws[c].project(&x), self.laws[c].jacobian(&x));
                for k in 0..D {
                    self.b[D * c + k] = p[k] - at[k];
                    for l in 0..D {
                        self.p[c][k][l] = rho * jacobian[k][l];
                        self.q[c][k][l] = f64::from(u8::from(k == l)) - jacobian[k][l];
                    }
                }
            }
            if problem.linearise(state, &self.p, &self.q).is_err() {
                return steps;
            }
            problem.solve_linearised(state, &self.b, &mut self.dr, &mut self.du);
            let falls = |t: &f64| self.map(r, u, RHO, *t) <= (1.0 - 1e-4 * t) * merit;
            let Some(t) = (0..=HALVINGS).map(|k| 0.5_f64.powi(k)).find(falls) else {
                return steps + 1;
            };
            r.iter_mut().zip(&self.dr).for_each(|(r, d)| *r += t * d);
            problem.velocities(state, r, u);
        }
        POLISH
    }

    /// `r_c` and `r_c − ρ ũ_c` with s, a step t along (dr, du) from r and u.
    fn argument(&self, c: usize, r: &[f64], u: &[f64], rho: f64, t: f64) -> [[f64; D]; 2] {
        let (mut at, mut y): ([f64; D], [f64; D]) = (small::block(r, c), small::block(u, c));
        // What an earlier step left need not be finite.
        if t > 0.0 {
            for k in 0..D {
                at[k] += t * self.dr[D * c + k];
                y[k] += t * self.du[D * c + k];
            }
        }
        for disk in 0..L::DISKS {
            y[0] += self.laws[c].coefficient(disk) * self.s[L::DISKS * c + disk];
        }
        [at, std::array::from_fn(|k| at[k] - rho * y[k])]
    }

    /// The natural map there with `ρ/w_c`, as a velocity, relative to ‖q‖.
    fn map(&self, r: &[f64], u: &[f64], rho: f64, t: f64) -> f64 {
        let of = |c: usize| {
            let w = self.unit[c];
            let [at, x] = self.argument(c, r, u, rho / w, t);
            let p = self.laws[c].project(&x);
            (0..D).map(|k| (w / rho * (at[k] - p[k])).powi(2)).sum::<f64>()
        };
        (0..self.laws.len()).map(of).sum::<f64>().sqrt() / self.scale
    }

    /// ds from the gap, by the one system `Q + P W` with `P = ρ J (I + e_N Σ mu_k n_kᵀ)`. False where it is singular.
    fn solve<P: Linearised<D> + Disked<D, Law = L>>(
        &mut self,
        problem: &P,
        state: &mut P::State,
        r: &[f64],
        u: &[f64],
    ) -> bool {
        for (c, (law, &w)) in self.laws.iter().zip(&self.unit).enumerate() {
            let rho = RHO / w;
            let u: [f64; D] = small::block(u, c);
            let (mut y, mut bias, mut slope) = (u, 0.0, direction::<L, D>(&u, self.scale));
            for disk in 0..L::DISKS {
                let (mu, i) = (law.coefficient(disk), L::DISKS * c + disk);
                y[0] += mu * self.s[i];
                bias += mu * self.gap[i];
                slope[L::rows(disk)].iter_mut().for_each(|n| *n *= mu);
            }
            let x: [f64; D] = std::array::from_fn(|k| r[D * c + k] - rho * y[k]);
            let jacobian = law.jacobian(&x);
            for (k, row) in jacobian.iter().enumerate() {
                self.b[D * c + k] = -rho * row[0] * bias;
                for l in 0..D {
                    self.p[c][k][l] = rho * (row[l] + row[0] * slope[l]);
                    self.q[c][k][l] = f64::from(u8::from(k == l)) - row[l];
                }
            }
        }
        if problem.linearise(state, &self.p, &self.q).is_err() {
            return false;
        }
        let left = problem.solve_linearised(state, &self.b, &mut self.dr, &mut self.du);
        for (i, ds) in self.ds.iter_mut().enumerate() {
            let (c, rows) = (i / L::DISKS, L::rows(i % L::DISKS));
            let n = direction::<L, D>(&small::block(u, c), self.scale);
            *ds = self.gap[i] + rows.map(|k| n[k] * self.du[D * c + k]).sum::<f64>();
        }
        left <= SOLVED && self.ds.iter().all(|x| x.is_finite())
    }
}

fn size(u: &[f64]) -> f64 {
    u.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// `u_k/‖u_k‖` in the rows of each disk k, zero where nothing slides.
fn direction<L: DiskLaw<D>, const D: usize>(u: &[f64; D], scale: f64) -> [f64; D] {
    let mut n = [0.0; D];
    for disk in 0..L::DISKS {
        let size = size(&u[L::rows(disk)]);
        if size > STILL * scale {
            L::rows(disk).for_each(|k| n[k] = u[k] / size);
        }
    }
    n
}

#[cfg(test)]
mod tests {
    use nonsmooth_problem::planted::Planted;
    use nonsmooth_problem::{Coulomb, FrictionLocal};

    use super::*;
    use crate::contact::form::{Access, Contacts};
    use crate::contact::parts::ConvexIp;

    type State = <FrictionLocal<3> as Contacts<3>>::State;

    /// The solution of the convex problem with the speeds `s`, whose image `speeds` sees, and its velocities.
    fn answer(
        problem: &FrictionLocal<3>,
        state: &mut State,
        speeds: &mut Speeds<Coulomb, 3>,
    ) -> (Vec<f64>, Vec<f64>) {
        let mut ip = ConvexIp::<3>::new();
        ip.begin(problem, state, &speeds.s, None);
        let end = ip.solve(problem, state, 1e-14, 80);
        assert!(end.error <= 1e-12, "{end:?}");
        speeds.see(ip.u());
        (ip.r().to_vec(), ip.u().to_vec())
    }

    #[test]
    fn the_newton_step_solves_the_linearised_fixed_point() {
        for seed in 1..5 {
            let case =
                Planted { contacts: 12, dofs: 60, seed, mu: (0.1, 0.6), ..Planted::default() };
            let problem = case.local::<3>().0;
            let mut state = problem.state(Access::Newton).unwrap();
            let mut speeds = Speeds::new(&problem, &state);
            speeds.s.iter_mut().enumerate().for_each(|(c, s)| *s = 0.3 + 0.1 * c as f64);
            let (r, u) = answer(&problem, &mut state, &mut speeds);
            let (s, image) = (speeds.s.clone(), speeds.image.clone());
            assert!(speeds.newton(&problem, &mut state, (&r, &u), true));
            // F(s) + F'(s) ds = s + ds.
            let h = 1e-5;
            let (gap, ds) = (speeds.gap.clone(), speeds.ds.clone());
            (0..12).for_each(|c| speeds.s[c] = s[c] + h * ds[c]);
            answer(&problem, &mut state, &mut speeds);
            for c in 0..12 {
                // Where nothing slides, F is zero and not differentiable.
                if image[c] > 1e-6 {
                    let slope = (speeds.image[c] - image[c]) / h;
                    let expected = ds[c] - gap[c];
                    assert!((slope - expected).abs() < 1e-3, "{seed} {c}: {slope} {expected}");
                }
            }
        }
    }

    #[test]
    fn a_solution_is_polished() {
        let case =
            Planted { contacts: 12, dofs: 60, seed: 1, mu: (0.1, 0.6), ..Planted::default() };
        let problem = case.local::<3>().0;
        let mut state = problem.state(Access::Newton).unwrap();
        let mut speeds = Speeds::new(&problem, &state);
        speeds.s.fill(0.5);
        let mut ip = ConvexIp::<3>::new();
        ip.begin(&problem, &mut state, &speeds.s, None);
        let end = ip.solve(&problem, &mut state, 1e-6, 80);
        assert!(end.error <= 1e-6, "{end:?}");
        let (mut r, mut u) = (ip.r().to_vec(), ip.u().to_vec());
        let steps = speeds.polish(&problem, &mut state, (&mut r, &mut u), 1e-12);
        let left = speeds.map(&r, &u, 1.0, 0.0);
        assert!(steps <= POLISH && left <= 1e-12, "{steps} steps, {left:e}");
        assert_eq!(speeds.polish(&problem, &mut state, (&mut r, &mut u), 1e-12), 0);
    }

    #[test]
    fn a_step_in_vain_is_taken_back() {
        let case = Planted { contacts: 12, dofs: 60, seed: 1, ..Planted::default() };
        let problem = case.local::<3>().0;
        let mut state = problem.state(Access::Newton).unwrap();
        let mut speeds = Speeds::new(&problem, &state);
        let (r, u) = answer(&problem, &mut state, &mut speeds);
        let image = speeds.image.clone();
        assert!(speeds.newton(&problem, &mut state, (&r, &u), true));
        // As if the speeds had grown.
        speeds.image.iter_mut().for_each(|f| *f += 1e3);
        assert!(speeds.newton(&problem, &mut state, (&r, &u), true));
        assert_eq!(speeds.s, image);
        // The next step is the fixed point's.
        assert!(!speeds.newton(&problem, &mut state, (&r, &u), true));
        speeds.advance(1.0);
        assert_eq!(speeds.s, speeds.image);
    }
}

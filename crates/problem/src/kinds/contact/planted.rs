//! Frictional contact problems with a planted solution.
//!
//! Velocities `v*` and, contact by contact, a pair `(u*, r*)` that obeys the law are drawn first; then the data
//! that makes them a solution: `w = u* − Hᵀ v*`, `f = M v* − H r* − G λ*`, `b = −Gᵀ v*`, and for the local form
//! `q = u* − W r* − V λ*`, `s = −Vᵀ r* − R λ*`. The structure is that of rigid bodies: blocks of six degrees of freedom, contacts
//! between two bodies or a body and the ground.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::check::Law;
use crate::kinds::contact::law::RollingData;
use crate::{
    Bounds, FrictionGlobal, FrictionLocal, GlobalPoint, LocalPoint, RollingGlobal, RollingLocal,
    RowsGlobal, RowsLocal,
};
use nonsmooth_linalg::{Csc, Delassus, Inverse};

/// The sizes and the state of a contact problem with a known solution.
#[derive(Debug, Clone, PartialEq)]
pub struct Planted {
    /// The number of contacts nc, at least 1 where there are no rows.
    pub contacts: usize,
    /// The number of degrees of freedom n, at least 1. W has rank `min(n, D·nc)` when every body is touched.
    pub dofs: usize,
    /// The number of bilateral constraints; keep it below n.
    pub bilateral: usize,
    /// The number of scalar rows with bounds (half lines and boxes in turn), which lie between those without.
    pub bounded: usize,
    /// The shares of the contact statuses.
    pub mix: PlantedMix,
    /// Coefficients of friction are drawn between these.
    pub mu: (f64, f64),
    /// Coefficients of rolling friction, of problems that have any, likewise.
    pub mu_r: (f64, f64),
    /// The relative size of a skew-symmetric part in the blocks of M, and so in W.
    pub skew: f64,
    /// The seed: the same seed gives the same problem to the bit.
    pub seed: u64,
}

/// Weights (they need not add up to 1) with which the status of each planted contact is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlantedMix {
    /// `r = 0`, `u_N > 0`.
    pub open: f64,
    /// `u = 0`, r inside the cone.
    pub stick: f64,
    /// `u_N = 0`, sliding, r on the boundary.
    pub slip: f64,
    /// `u = 0` with r on the boundary or zero: between two statuses.
    pub degenerate: f64,
}

impl Default for Planted {
    fn default() -> Self {
        Self {
            contacts: 20,
            dofs: 60,
            bilateral: 0,
            bounded: 0,
            mix: PlantedMix { open: 1.0, stick: 1.0, slip: 1.0, degenerate: 0.0 },
            mu: (0.2, 0.9),
            mu_r: (0.05, 0.5),
            skew: 0.0,
            seed: 0,
        }
    }
}

impl Planted {
    /// A global problem and a solution of it.
    pub fn global<const D: usize>(&self) -> (FrictionGlobal<D>, GlobalPoint) {
        self.global_of()
    }

    /// A global problem with rolling friction and a solution of it. Rolling is drawn as sliding is, by itself.
    pub fn rolling_global(&self) -> (RollingGlobal, GlobalPoint) {
        self.global_of()
    }

    /// A local problem and a solution of it: the condensed form of [`global`](Self::global), with
    /// `q` and `s` recomputed so that rounding in W does not disturb the solution.
    pub fn local<const D: usize>(&self) -> (FrictionLocal<D>, LocalPoint) {
        Self::condensed(self.global())
    }

    /// The same of [`rolling_global`](Self::rolling_global).
    pub fn rolling_local(&self) -> (RollingLocal, LocalPoint) {
        Self::condensed(self.rolling_global())
    }

    fn global_of<const D: usize, L: Law<D>>(&self) -> (FrictionGlobal<D, L>, GlobalPoint) {
        let mut rng = Pcg64::seed_from_u64(self.seed);
        let p = self.bilateral + self.bounded;
        let (n, m) = (self.dofs.max(1), D * self.contacts.max(usize::from(p == 0)));
        let mut normal = || {
            // The sum of four uniforms is normal enough to plant with.
            (0..4).map(|_| rng.random_range(-1.0..1.0)).sum::<f64>() * 0.866
        };

        let mass = mass_matrix(n, self.skew, &mut normal);
        let v: Vec<f64> = (0..n).map(|_| normal()).collect();
        let mut lambda: Vec<f64> = (0..p).map(|_| normal()).collect();
        let jacobian_rows = |c: usize, bodies: usize, normal: &mut dyn FnMut() -> f64| {
            let pick = |x: f64| ((x.abs() * 7919.0) as usize) % bodies;
            // Contacts visit the bodies in turn, so that each is touched when there are enough contacts.
            let (a, b) = (c % bodies, pick(normal()));
            let mut rows: Vec<usize> = (6 * a..(6 * a + 6).min(n)).collect();
            if b != a && !c.is_multiple_of(3) {
                rows.extend(6 * b..(6 * b + 6).min(n));
            }
            rows
        };
        let bodies = n.div_ceil(6);
        let mut h = Vec::new();
        for c in 0..m / D {
            for i in jacobian_rows(c, bodies, &mut normal) {
                for k in 0..D {
                    h.push((i, D * c + k, normal()));
                }
            }
        }
        let mut g = Vec::new();
        for j in 0..p {
            for i in jacobian_rows(j, bodies, &mut normal) {
                g.push((i, j, normal()));
            }
        }
        let (mut u, mut r) = (vec![0.0; m], vec![0.0; m]);
        let (mut mu, mut mu_r) = (Vec::new(), Vec::new());
        for c in 0..m / D {
            mu.push(rng.random_range(self.mu.0..=self.mu.1));
            if L::DISKS > 1 {
                mu_r.push(rng.random_range(self.mu_r.0..=self.mu_r.1));
            }
            let range = D * c..D * c + D;
            let coefficients: Vec<f64> =
                mu.last().into_iter().chain(mu_r.last()).copied().collect();
            self.plant(&coefficients, &mut rng, &mut u[range.clone()], &mut r[range]);
        }
        let (bounds, mut b) = self.bounds(&mut rng, &mut lambda);

        let h = Csc::from_triplets(n, m, h.into_iter()).expect("rows and columns in range");
        let g = Csc::from_triplets(n, p, g.into_iter()).expect("rows and columns in range");
        let mut w = u;
        h.mul_transpose_add(-1.0, &v, &mut w);
        let mut f = vec![0.0; n];
        mass.mul_add(1.0, &v, &mut f);
        h.mul_add(-1.0, &r, &mut f);
        g.mul_add(-1.0, &lambda, &mut f);
        g.mul_transpose_add(-1.0, &v, &mut b);
        let rows = (p > 0).then_some(RowsGlobal { G: g, b, bounds });
        let mu_r = L::Rolling::of(mu_r);
        let problem = FrictionGlobal { M: mass, H: h, f, w, mu, mu_r, rows };
        problem.validate().expect("a planted problem is valid");
        (problem, GlobalPoint { v, r, lambda })
    }

    fn condensed<const D: usize, L: Law<D>>(
        (global, GlobalPoint { v, r, lambda }): (FrictionGlobal<D, L>, GlobalPoint),
    ) -> (FrictionLocal<D, L>, LocalPoint) {
        let inverse = Inverse::new(&global.M, "M").expect("a planted M is invertible");
        let mut q = vec![0.0; r.len()];
        global.velocity_into(&v, &mut q);
        let rows = global.rows.as_ref().map(|RowsGlobal { G, b, bounds }| {
            let (n, p) = (G.nrows(), G.ncols());
            let (mut vv, mut rr) = (Vec::new(), Vec::new());
            let mut x = vec![0.0; n];
            for j in 0..p {
                x.fill(0.0);
                let (rows, values) = G.column(j);
                rows.iter().zip(values).for_each(|(&i, &g)| x[i] = g);
                inverse.solve(&mut x);
                vv.extend((0..r.len()).map(|i| (i, j, global.H.column_dot(i, &x))));
                rr.extend((0..p).map(|i| (i, j, G.column_dot(i, &x))));
            }
            let stored = |(_, _, x): &(usize, usize, f64)| *x != 0.0;
            let vv =
                Csc::from_triplets(r.len(), p, vv.into_iter().filter(stored)).expect("in range");
            let rr = Csc::from_triplets(p, p, rr.into_iter().filter(stored)).expect("in range");
            let velocity = |j: usize| match bounds.is_free(j) {
                true => 0.0,
                false => G.column_dot(j, &v) + b[j],
            };
            let mut s: Vec<f64> = (0..p).map(velocity).collect();
            vv.mul_transpose_add(-1.0, &r, &mut s);
            rr.mul_add(-1.0, &lambda, &mut s);
            vv.mul_add(-1.0, &lambda, &mut q);
            RowsLocal { V: vv, R: rr, s, bounds: bounds.clone() }
        });
        let w = Delassus::<D>::condense(&global.H, &inverse);
        for i in 0..w.nrows() {
            let product = w.row_product(i, &r);
            for k in 0..D {
                q[D * i + k] -= product[k];
            }
        }
        let (mu, mu_r) = (global.mu, global.mu_r);
        let problem = FrictionLocal { W: w, q, mu, mu_r, rows };
        problem.validate().expect("a planted problem is valid");
        (problem, LocalPoint { r, lambda })
    }

    /// Draws bounds for the rows that have some, so that λ, moved where need be, obeys them; and the velocities that it obeys them with.
    fn bounds(&self, rng: &mut Pcg64, lambda: &mut [f64]) -> (Bounds, Vec<f64>) {
        let mut velocities = vec![0.0; lambda.len()];
        if self.bounded == 0 {
            return (Bounds::default(), velocities);
        }
        let mut bounds = Bounds {
            lower: vec![f64::NEG_INFINITY; lambda.len()],
            upper: vec![f64::INFINITY; lambda.len()],
        };
        // Every other row as long as there are two kinds of them, the rest at the end.
        let odd = (0..lambda.len()).filter(|j| j % 2 == 1);
        let even = (0..lambda.len()).filter(|j| j % 2 == 0);
        for (k, j) in odd.chain(even).take(self.bounded).enumerate() {
            let (size, speed) = (rng.random_range(0.2..1.0), rng.random_range(0.1..1.0));
            let (l, u) = match k % 3 {
                0 => (0.0, f64::INFINITY),
                1 => (-size, size),
                _ => (f64::NEG_INFINITY, size),
            };
            // At the lower bound, at the upper one, or between.
            let (at, velocity) = match rng.random_range(0..3) {
                0 if l.is_finite() => (l, speed),
                1 if u.is_finite() => (u, -speed),
                _ => (lambda[j].clamp(l, u), 0.0),
            };
            (bounds.lower[j], bounds.upper[j]) = (l, u);
            (lambda[j], velocities[j]) = (at, velocity);
        }
        (bounds, velocities)
    }

    /// Draws `(u, r)` of one contact that obeys the law with the coefficients given, one a disk.
    fn plant(&self, coefficients: &[f64], rng: &mut Pcg64, u: &mut [f64], r: &mut [f64]) {
        let PlantedMix { open, stick, slip, degenerate } = self.mix;
        let rows = (u.len() - 1) / coefficients.len();
        let mut opened = false;
        for (disk, &mu) in coefficients.iter().enumerate() {
            let mut draw = rng.random_range(0.0..open + stick + slip + degenerate);
            let direction = direction(rows, rng);
            let size = rng.random_range(0.1..1.0);
            let sliding = rng.random_range(0.1..1.0);
            let inside = rng.random_range(0.0..0.9);
            let apex = rng.random_range(0.0..1.0) < 0.5;
            let part = 1 + disk * rows..1 + (disk + 1) * rows;
            let tangential = |x: &mut [f64], a: f64| {
                x[part.clone()].iter_mut().zip(&direction).for_each(|(x, d)| *x = a * d);
            };
            // The first disk says whether the contact is pressed, and how much.
            let pressed = if disk == 0 { size } else { r[0] };
            if opened || (disk == 0 && draw < open) {
                if disk == 0 {
                    u[0] = size;
                    opened = true;
                }
                tangential(u, sliding);
                continue;
            }
            draw = if disk == 0 { draw - open } else { draw.min(stick + slip) };
            if draw < stick {
                r[0] = pressed;
                tangential(r, inside * mu * pressed);
            } else if draw - stick < slip && (disk == 0 || pressed > 0.0) {
                r[0] = pressed;
                tangential(r, -mu * pressed);
                tangential(u, sliding);
            } else if !apex && (disk == 0 || pressed > 0.0) {
                r[0] = pressed;
                tangential(r, mu * pressed);
            }
        }
    }
}

/// A random unit vector of dimension 1 or 2.
fn direction(dimension: usize, rng: &mut Pcg64) -> Vec<f64> {
    let angle = rng.random_range(0.0..std::f64::consts::TAU);
    match dimension {
        1 => vec![angle.cos().signum()],
        _ => vec![angle.cos(), angle.sin()],
    }
}

/// Blocks of six degrees of freedom: SPD (a random Gram matrix plus the identity) plus `skew` times a skew part.
fn mass_matrix(n: usize, skew: f64, normal: &mut dyn FnMut() -> f64) -> Csc {
    let mut entries = Vec::new();
    for start in (0..n).step_by(6) {
        let size = 6.min(n - start);
        let a: Vec<f64> = (0..size * size).map(|_| 0.4 * normal()).collect();
        for i in 0..size {
            for j in 0..size {
                let gram: f64 = (0..size).map(|k| a[i * size + k] * a[j * size + k]).sum();
                let identity = f64::from(u8::from(i == j));
                let turn = skew * (a[i * size + j] - a[j * size + i]);
                entries.push((start + i, start + j, identity + gram + turn));
            }
        }
    }
    Csc::from_triplets(n, n, entries.into_iter()).expect("rows and columns in range")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::{Judged, Motion};

    fn cases() -> impl Iterator<Item = Planted> {
        (0..12).map(|seed| Planted {
            contacts: 1 + 9 * seed as usize,
            dofs: 6 + 20 * (seed as usize % 4),
            bilateral: (seed as usize % 3) * 2,
            mix: PlantedMix {
                open: 1.0,
                stick: 1.0,
                slip: 1.0,
                degenerate: f64::from(seed as u8 % 2),
            },
            skew: if seed % 4 == 3 { 0.1 } else { 0.0 },
            seed,
            ..Planted::default()
        })
    }

    #[test]
    fn the_judge_accepts_planted_solutions() {
        for case in cases() {
            let (problem, point) = case.global::<3>();
            let verdict = problem.judge(&point, 1e-12).unwrap();
            assert!(verdict.solved, "{case:?}: {verdict:?}");
            let (problem, point) = case.local::<3>();
            assert!(problem.judge(&point, 1e-12).unwrap().solved, "{case:?}");
            let (problem, point) = case.local::<2>();
            assert!(problem.judge(&point, 1e-12).unwrap().solved, "{case:?}");
            let (problem, point) = case.global::<2>();
            assert!(problem.judge(&point, 1e-12).unwrap().solved, "{case:?}");
        }
    }

    #[test]
    fn rolling_friction_is_planted_and_judged_as_sliding_is() {
        for case in cases() {
            let (problem, point) = case.rolling_global();
            let verdict = problem.judge(&point, 1e-12).unwrap();
            assert!(verdict.solved, "{case:?}: {verdict:?}");
            let (problem, point) = case.rolling_local();
            let verdict = problem.judge(&point, 1e-12).unwrap();
            assert!(verdict.solved, "{case:?}: {verdict:?}");
            assert!(case.contacts < 20 || verdict.counts.rolling > 0);
            for i in 0..point.r.len() {
                let mut wrong = point.clone();
                wrong.r[i] += 1e-3;
                assert!(!problem.judge(&wrong, 1e-8).unwrap().solved, "{case:?} entry {i}");
            }
        }
    }

    /// A length in other units: angular rows of W and q, moments and mu_r change, and no residual but those that are reported as given.
    #[test]
    fn the_unit_of_length_of_rolling_does_not_matter() {
        let (problem, mut point) = Planted::default().rolling_local();
        point.r.iter_mut().enumerate().for_each(|(i, r)| *r += 1e-4 * (i as f64).sin());
        let reference = problem.judge(&point, 1e-8).unwrap().measure;
        let mut other = problem.clone();
        let factor = |i: usize| if i % 5 > 2 { 1024.0 } else { 1.0 };
        other.W.change(|i, j, block| {
            for (k, row) in block.iter_mut().enumerate() {
                let at = |j: usize, l: usize| factor(5 * j + l);
                row.iter_mut().enumerate().for_each(|(l, x)| *x *= at(i, k) * at(j, l));
            }
        });
        other.q.iter_mut().enumerate().for_each(|(i, q)| *q *= factor(i));
        point.r.iter_mut().enumerate().for_each(|(i, r)| *r /= factor(i));
        other.mu_r.iter_mut().for_each(|m| *m /= 1024.0);
        let found = other.judge(&point, 1e-8).unwrap().measure;
        assert_eq!(found.relative, reference.relative);
        assert_eq!(found.own, reference.own);
        assert_ne!(found.literature, reference.literature);
    }

    #[test]
    fn the_judge_refuses_every_perturbed_impulse() {
        let (problem, point) = Planted::default().local::<3>();
        for i in 0..point.r.len() {
            let mut wrong = point.clone();
            wrong.r[i] += 1e-3;
            assert!(!problem.judge(&wrong, 1e-8).unwrap().solved, "entry {i}");
        }
    }

    #[test]
    fn statuses_are_those_planted() {
        for (mix, motion) in [
            (PlantedMix { open: 1.0, stick: 0.0, slip: 0.0, degenerate: 0.0 }, Motion::Open),
            (PlantedMix { open: 0.0, stick: 1.0, slip: 0.0, degenerate: 0.0 }, Motion::Stick),
            (PlantedMix { open: 0.0, stick: 0.0, slip: 1.0, degenerate: 0.0 }, Motion::Slip),
        ] {
            let (problem, point) = Planted { mix, ..Planted::default() }.local::<3>();
            let verdict = problem.judge(&point, 1e-10).unwrap();
            assert!(verdict.statuses.iter().all(|s| s.status == motion && !s.degenerate));
        }
        let mix = PlantedMix { open: 0.0, stick: 0.0, slip: 0.0, degenerate: 1.0 };
        let (problem, point) = Planted { mix, ..Planted::default() }.local::<3>();
        assert_eq!(problem.judge(&point, 1e-10).unwrap().counts.degenerate, 20);
    }

    #[test]
    fn a_violated_dynamics_is_refused() {
        let (problem, mut point) = Planted::default().global::<3>();
        point.v[0] += 1e-6;
        assert!(!problem.judge(&point, 1e-3).unwrap().solved);
    }

    #[test]
    fn the_residual_does_not_depend_on_units() {
        // Impulses in other units: W → W/a, r → a r; velocities in other units: q → b q.
        let (problem, mut point) = Planted::default().local::<3>();
        point.r.iter_mut().enumerate().for_each(|(i, r)| *r += 1e-4 * (i as f64).sin());
        let reference = problem.judge(&point, 1e-8).unwrap().measure;
        let (a, b) = (1e6, 1e-3);
        let scaled = FrictionLocal::<3>::new(
            nonsmooth_linalg::Bsr::from_csc(&{
                let w = problem.W.to_csc();
                Csc::from_triplets(60, 60, w.triplets().map(|(i, j, x)| (i, j, x / a))).unwrap()
            }),
            problem.q.iter().map(|q| b * q).collect(),
            problem.mu.clone(),
        )
        .unwrap();
        point.r.iter_mut().for_each(|r| *r *= a * b);
        let other = scaled.judge(&point, 1e-8).unwrap().measure;
        assert!((other.relative / reference.relative - 1.0).abs() < 1e-9);
        assert!((other.absolute / reference.absolute - b).abs() < 1e-9 * b);
        assert!(
            (other.literature / reference.literature - 1.0).abs() > 0.5,
            "the literature's does depend"
        );
    }
}

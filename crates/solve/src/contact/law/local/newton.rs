//! One frictional contact by a safeguarded semismooth Newton method.
//!
//! Solves `Φ(W r + q, r) = 0` with the Alart–Curnier or Jean–Moreau function: `(A W + B) dr = −Φ`, `ρ_N = 1/W_NN`,
//! `ρ_T = 1/λ_max(W_TT)` (bounded). The step is halved until ‖Φ‖ decreases. Without convergence in 20 steps, or where the
//! Newton matrix is singular, the exact local solver answers instead, so that no sweep is lost.
//!
//! Source: AlartCurnier1991; Acary, lecture (88)–(96). Cost: about 150 flops a step, 2 to 5 steps.

use nonsmooth_linalg::small;

use super::{LocalSolver, norm_bound, velocity};
use crate::contact::law::DiskLaw;
use crate::contact::law::cfun::{Disk, Radii, alart_curnier};

/// The function, by its disk, and how exactly its root is found.
#[derive(Debug, Clone, Copy)]
pub struct Newton {
    /// The radius of the friction disk.
    pub disk: Disk,
    /// The residual in units of velocity below which it stops; 0: to rounding.
    pub tolerance: f64,
}

impl Newton {
    /// With the disk given, to rounding.
    pub fn new(disk: Disk) -> Self {
        Self { disk, tolerance: 0.0 }
    }
}

/// The scaling parameters and the exact solver's memo.
#[derive(Debug, Clone)]
pub struct NewtonMemo<L: DiskLaw<D>, const D: usize> {
    rho: Option<Radii>,
    exact: <L::Local as LocalSolver<D, L>>::Memo,
}

const STEPS: usize = 20;
const HALVINGS: usize = 6;

impl<L: DiskLaw<D>, const D: usize> LocalSolver<D, L> for Newton {
    type Memo = NewtonMemo<L, D>;

    fn tolerate(&mut self, velocity: f64) {
        self.tolerance = velocity;
    }

    fn prepare(&self, w: &[[f64; D]; D], law: L) -> NewtonMemo<L, D> {
        NewtonMemo { rho: radii::<L, D>(w), exact: L::Local::default().prepare(w, law) }
    }

    fn solve(
        &self,
        memo: &mut NewtonMemo<L, D>,
        w: &[[f64; D]; D],
        q: &[f64; D],
        law: L,
        r: &[f64; D],
    ) -> [f64; D] {
        memo.rho
            .and_then(|rho| newton(self, w, q, law, rho, r))
            .unwrap_or_else(|| L::Local::default().solve(&mut memo.exact, w, q, law, r))
    }
}

/// `ρ_N = 1/W_NN` and `ρ = 1/λ_max` (bounded) of each disk's block, where they are numbers.
pub(super) fn radii<L: DiskLaw<D>, const D: usize>(w: &[[f64; D]; D]) -> Option<Radii> {
    let rho = Radii::of::<L, D>(w, |w| 1.0 / w[0][0], |part| 1.0 / norm_bound(part));
    rho.are_positive().then_some(rho)
}

pub(super) fn newton<L: DiskLaw<D>, const D: usize>(
    solver: &Newton,
    w: &[[f64; D]; D],
    q: &[f64; D],
    law: L,
    rho: Radii,
    start: &[f64; D],
) -> Option<[f64; D]> {
    let linearise = |r: &[f64; D]| alart_curnier(solver.disk, &velocity(w, q, r), r, law, rho);
    let size = |x: &[f64; D]| x.iter().map(|v| v * v).sum::<f64>().sqrt();
    // Rounding in Φ is that of ρ q and of r.
    let impulse = rho.normal.max(rho.tangential).max(rho.rolling);
    let floor = impulse * (4.0 * f64::EPSILON * size(q)).max(solver.tolerance);
    let mut r = *start;
    let mut at = linearise(&r);
    for _ in 0..STEPS {
        let merit = size(&at.phi);
        if merit <= floor + 4.0 * f64::EPSILON * size(&r) {
            return Some(r);
        }
        // B + A W: a row of A has entries along the normal and in its own disk.
        let mut jacobian = at.b;
        for j in 0..D {
            jacobian[0][j] += at.a[0][0] * w[0][j];
        }
        for disk in 0..L::DISKS {
            for i in L::rows(disk) {
                for j in 0..D {
                    jacobian[i][j] += at.a[i][0] * w[0][j];
                    for k in L::rows(disk) {
                        jacobian[i][j] += at.a[i][k] * w[k][j];
                    }
                }
            }
        }
        let step = small::solve(&jacobian, &at.phi)?;
        let mut length = 1.0;
        let mut trial = r;
        for _ in 0..HALVINGS {
            for k in 0..D {
                trial[k] = r[k] - length * step[k];
            }
            at = linearise(&trial);
            if size(&at.phi) < (1.0 - 1e-4 * length) * merit {
                break;
            }
            length *= 0.5;
        }
        r = trial;
    }
    None
}

//! One contact with rolling friction by cases, and Newton where a disk binds.
//!
//! 1. **Open**: `q_N ≥ 0` ⇒ `r = 0`.
//! 2. **At rest**: `r = −W⁻¹ q`, accepted if it lies in K.
//! 3. **Sliding, rolling or both**: safeguarded Newton on the Alart–Curnier function ([`Newton`](super::Newton)), from the impulse of the last visit, then
//!    from that of the contact at rest; without convergence projection steps with an adapted length, which take longer but need no start.
//!
//! With two disks the sliding parameters are two, so that no polynomial of one variable is left.
//! W may be nonsymmetric. Source: AlartCurnier1991; Khobotov1987. Cost: 100 to 1000 flops where a disk binds.

use super::newton::{newton, radii};
use super::{LocalSolver, Newton, ProjectionIterated, Rest};
use crate::contact::law::Rolling;
use crate::contact::law::cfun::{Disk, Radii};
use crate::contact::law::cone::ConvexSet;

/// Solves to rounding, so there is nothing to set.
#[derive(Debug, Clone, Copy, Default)]
pub struct RollingExact;

/// What depends on the block alone, and the step length of the projections.
#[derive(Debug, Clone)]
pub struct RollingMemo<const D: usize> {
    rest: Option<Rest<D>>,
    rho: Option<Radii>,
    step: f64,
}

impl<const D: usize> LocalSolver<D, Rolling> for RollingExact {
    type Memo = RollingMemo<D>;

    fn prepare(&self, w: &[[f64; D]; D], law: Rolling) -> RollingMemo<D> {
        let step = ProjectionIterated::default().prepare(w, law);
        RollingMemo { rest: Rest::new(w), rho: radii::<Rolling, D>(w), step }
    }

    fn solve(
        &self,
        memo: &mut RollingMemo<D>,
        w: &[[f64; D]; D],
        q: &[f64; D],
        law: Rolling,
        r: &[f64; D],
    ) -> [f64; D] {
        if q[0] >= 0.0 {
            return [0.0; D];
        }
        let rest = memo.rest.as_ref().and_then(|rest| rest.impulse(w, q));
        if let Some(rest) = rest.filter(|rest| rest[0] > 0.0 && law.project(rest) == *rest) {
            return rest;
        }
        let starts = [Some(*r), rest.map(|rest| law.project(&rest))];
        let found = memo.rho.and_then(|rho| {
            let solver = Newton::new(Disk::AlartCurnier);
            starts.iter().flatten().find_map(|start| newton(&solver, w, q, law, rho, start))
        });
        found.unwrap_or_else(|| ProjectionIterated::default().solve(&mut memo.step, w, q, law, r))
    }
}

#[cfg(test)]
mod tests {
    use nonsmooth_problem::planted::Planted;

    use super::*;
    use crate::contact::law::ContactLaw;
    use nonsmooth_linalg::{norm, small};

    /// On planted contacts of every status, with strongly coupled blocks: the law holds to rounding.
    #[test]
    fn contacts_are_solved_to_rounding() {
        let mut missed = 0;
        for seed in 0..40 {
            let case = Planted { contacts: 20, dofs: 60, seed, ..Planted::default() };
            let (problem, _) = case.rolling_local();
            for c in 0..20 {
                let (w, law) = (problem.W.diagonal_block(c), problem.law(c));
                let q: [f64; 5] = small::block(&problem.q, c);
                let mut memo = RollingExact.prepare(&w, law);
                let r = RollingExact.solve(&mut memo, &w, &q, law, &[0.0; 5]);
                let mut u = small::mul(&w, &r);
                (0..5).for_each(|k| u[k] += q[k]);
                u[0] += law.shift(&u);
                let unit = small::mean_diagonal(&w);
                let left = norm(&law.natural(&r.map(|r| unit * r), &u)) / norm(&q);
                missed += usize::from(left > 1e-12);
                assert!(left < 1e-2, "seed {seed} contact {c}: {left:e}");
            }
        }
        assert!(missed <= 8, "{missed} of 800 were left to the next visit");
    }
}

//! **Outer faceting**: contact with friction → MLCP in `(r_T; r_N, κ)`.
//!
//! ```text
//! σ_i = mu r_N − c_iᵀ r_T ≥ 0,             c_i unit vectors, the outward normals of the polygon, i = 1 … ω
//!
//! u_T + Σ κ_i c_i = 0                       r_T free
//! 0 ≤ u_N                  ⟂  r_N ≥ 0
//! 0 ≤ mu r_N − c_iᵀ r_T    ⟂  κ_i ≥ 0       u = W r + q
//! ```
//!
//! The sliding velocity is opposed to the normal cone of the polygon at r_T. With the equations solved for r_T the matrix is copositive where W is
//! positive definite: `zᵀ M z = rᵀ W r + mu r_N Σ κ_i`. The block of r_T is `W_TT`; it is singular where W has a null vector without normal part, and
//! methods that begin by eliminating the free variables then say that they do not apply.
//!
//! References: Acary2018 (52)–(57); Klarbring1986.
//!
//! Cost: one copy of W and 2ω entries a contact. Unknowns: ω + 1 and D − 1 free ones a contact, 1 where mu = 0.
//! Fails: in space the answer is that of another law, see [the page of the family](super); its impulses may lie outside the cone.

use nonsmooth_linalg::small;
use nonsmooth_problem::check::Certificate;
use nonsmooth_problem::{FrictionLocal, LcpPoint, LocalPoint, Mlcp};

use super::{Entries, Facets, KEYS, LISTED, approximates};
use crate::SolveError;
use crate::bridges::kept::{Kept, decompose, normal_impulses, tangential, velocity};
use crate::contact::form::Contacts;
use crate::core::reformulation::Reformulation;
use crate::core::register::Composed;
use crate::{Boxed, Via};
use nonsmooth_problem::Kind;

/// The edge from contacts of dimension D to the MLCP of their outer facets.
#[derive(Debug, Clone, Copy, Default)]
pub struct FacetOuter<const D: usize>(pub Facets);

impl<const D: usize> Composed<FrictionLocal<D>> for FacetOuter<D> {
    type To = Mlcp;
    type Settings = Facets;
    const NAME: &'static str = "facet_outer";
    const SUMMARY: &'static str = "contact to MLCP: the disk of friction becomes a circumscribed polygon; exact in the plane, an approximation in space";
    const FROM: &'static [Kind] = &[Kind::FrictionLocal2d, Kind::FrictionLocal3d];
    const CITES: &'static [&'static str] = &["Klarbring1986", "Acary2018"];
    const KEYS: &'static str = KEYS;
    const NEARLY: bool = approximates::<D>().is_some();

    fn compose(facets: Facets, solver: Boxed<Mlcp>) -> Boxed<FrictionLocal<D>> {
        Boxed::new(Via { reformulation: Self(facets), solver })
    }

    fn lists(solver: &str) -> bool {
        LISTED.contains(&solver)
    }
}

/// What the way back needs.
pub struct OuterMemo<const D: usize> {
    kept: Kept<D>,
    /// The first free variable and the first pair of each contact, and their numbers; pairs count from 0 here.
    free: Vec<usize>,
    pairs: Vec<usize>,
    entries: Entries,
}

impl<const D: usize> OuterMemo<D> {
    /// The number of free variables.
    fn tangents(&self) -> usize {
        self.free[self.free.len() - 1]
    }

    fn len(&self) -> usize {
        self.tangents() + self.pairs[self.pairs.len() - 1]
    }

    fn number(&mut self, mu: &[f64]) {
        self.free.clear();
        self.pairs.clear();
        let (mut free, mut pairs) = (0, 0);
        for &mu in mu {
            self.free.push(free);
            self.pairs.push(pairs);
            free += if mu > 0.0 { D - 1 } else { 0 };
            pairs += if mu > 0.0 { 1 + self.kept.directions.len() } else { 1 };
        }
        self.free.push(free);
        self.pairs.push(pairs);
    }

    fn numbers(&self, mu: &[f64]) -> bool {
        let free = |mu: f64| if mu > 0.0 { D - 1 } else { 0 };
        self.free.len() == mu.len() + 1
            && mu.iter().zip(self.free.windows(2)).all(|(&mu, f)| f[1] - f[0] == free(mu))
    }

    fn slides(&self, c: usize) -> bool {
        self.free[c + 1] > self.free[c]
    }

    /// The variable of r_N of contact c; its κ follow.
    fn normal(&self, c: usize) -> usize {
        self.tangents() + self.pairs[c]
    }

    /// The variable of component k of contact c's impulse, if there is one.
    fn component(&self, c: usize, k: usize) -> Option<usize> {
        match k {
            0 => Some(self.normal(c)),
            _ => self.slides(c).then(|| self.free[c] + k - 1),
        }
    }

    fn state(&self, problem: &FrictionLocal<D>, push: &mut dyn FnMut(usize, usize, f64)) {
        let (w, _) = self.kept.state.operator(problem);
        for (c, &mu) in problem.mu.iter().enumerate() {
            let (columns, blocks) = w.row(c);
            for (&d, block) in columns.iter().zip(blocks) {
                for k in 0..D {
                    let Some(row) = self.component(c, k) else { continue };
                    for l in 0..D {
                        if let Some(column) = self.component(d as usize, l) {
                            push(row, column, block[k][l]);
                        }
                    }
                }
            }
            if !self.slides(c) {
                continue;
            }
            let (unit, normal, tangent) = (self.kept.unit[c], self.normal(c), self.free[c]);
            for (i, direction) in self.kept.directions.iter().enumerate() {
                let kappa = normal + 1 + i;
                push(kappa, normal, mu * unit);
                for (k, x) in direction[..D - 1].iter().enumerate() {
                    push(tangent + k, kappa, unit * x);
                    push(kappa, tangent + k, -unit * x);
                }
            }
        }
    }

    fn free_velocity(&self, problem: &FrictionLocal<D>, q: &mut [f64]) {
        let (_, free) = self.kept.state.operator(problem);
        q.fill(0.0);
        for c in 0..problem.mu.len() {
            for k in 0..D {
                if let Some(row) = self.component(c, k) {
                    q[row] = free[D * c + k];
                }
            }
        }
    }
}

impl<const D: usize> Reformulation<FrictionLocal<D>> for FacetOuter<D> {
    type To = Mlcp;
    type Memo = OuterMemo<D>;

    fn reduce(&self, problem: &FrictionLocal<D>) -> Result<(Mlcp, OuterMemo<D>), SolveError> {
        let kept = self.0.keep(problem)?;
        let mut entries = Entries::default();
        let mut memo = OuterMemo { kept, free: vec![], pairs: vec![], entries: Entries::default() };
        memo.number(&problem.mu);
        let matrix = entries.assemble(memo.len(), |push| memo.state(problem, push))?;
        memo.entries = entries;
        let mut q = vec![0.0; memo.len()];
        memo.free_velocity(problem, &mut q);
        Ok((Mlcp::new(matrix, q, memo.tangents())?, memo))
    }

    fn reduce_again(
        &self,
        problem: &FrictionLocal<D>,
        reduced: &mut Mlcp,
        memo: &mut OuterMemo<D>,
    ) -> Result<(), SolveError> {
        memo.kept.refill(problem)?;
        if memo.numbers(&problem.mu)
            && memo.entries.overwrite(&mut reduced.M, |push| memo.state(problem, push))
        {
            memo.free_velocity(problem, &mut reduced.q);
            return Ok(reduced.validate()?);
        }
        (*reduced, *memo) = self.reduce(problem)?;
        Ok(())
    }

    fn contradiction(&self, memo: &OuterMemo<D>) -> Option<Certificate> {
        memo.kept.contradiction.clone().map(Certificate::from)
    }

    fn lift_certificate(&self, certificate: Certificate, memo: &OuterMemo<D>) -> Certificate {
        let contacts = memo.free.len() - 1;
        normal_impulses(certificate, &memo.kept, contacts, |c| memo.normal(c), |_| 1.0)
    }

    fn approximates(&self) -> Option<&'static str> {
        approximates::<D>()
    }

    /// The impulses as they are, and for κ the sliding velocity by the two facets that are nearest to it.
    fn lower(
        &self,
        problem: &FrictionLocal<D>,
        point: &LocalPoint,
        memo: &OuterMemo<D>,
        reduced: &mut LcpPoint,
    ) {
        let z = &mut reduced.z;
        z.resize(memo.len(), 0.0);
        z.fill(0.0);
        for c in 0..problem.mu.len() {
            let (normal, r) = (memo.normal(c), small::block::<D>(&point.r, c));
            z[normal] = r[0].max(0.0);
            if !memo.slides(c) {
                continue;
            }
            z[memo.free[c]..memo.free[c + 1]].copy_from_slice(&r[1..]);
            let against = tangential(&velocity(problem, point, c)).map(|u| -u);
            let unit = memo.kept.unit[c];
            decompose(&memo.kept.directions, against, |i, k| z[normal + 1 + i] = k / unit);
        }
    }

    fn lift(
        &self,
        problem: &FrictionLocal<D>,
        reduced: &LcpPoint,
        memo: &mut OuterMemo<D>,
        point: &mut LocalPoint,
    ) {
        for c in 0..problem.mu.len() {
            for k in 0..D {
                point.r[D * c + k] = memo.component(c, k).map_or(0.0, |i| reduced.z[i]);
            }
        }
        problem.complete(&mut memo.kept.state, point);
    }
}

//! **Inner faceting**: contact with friction → LCP in `(r_N, β, λ)`.
//!
//! ```text
//! r_T = D β,   β ≥ 0,   1ᵀβ ≤ mu r_N,      D = (d_1 … d_ω) unit vectors, the vertices of the polygon
//!
//! 0 ≤ u_N                ⟂  r_N ≥ 0
//! 0 ≤ λ 1 + Dᵀ u_T       ⟂  β   ≥ 0        u = W r + q
//! 0 ≤ mu r_N − 1ᵀ β      ⟂  λ   ≥ 0
//! ```
//!
//! so that of the vertices with impulse each is one whose direction the sliding opposes most, and λ is the speed seen along it.
//! The matrix of lecture (62), `[W_NN, W_NT D, 0; Dᵀ W_TN, Dᵀ W_TT D, E; mu, −Eᵀ, 0]`, is copositive where W is positive semidefinite,
//! `zᵀ M z = rᵀ W r + Σ λ mu r_N`, and for positive definite W Lemke's method with anti-cycling ends in a solution.
//!
//! References: Acary2018 (58)–(63) with `β ∈ R^ω`; StewartTrinkle1996; AnitescuPotra1997.
//!
//! Cost: `(ω + 1)²` products a block of W. Storage: as many entries. Unknowns: ω + 2 a contact, 1 where mu = 0.
//! Fails: in space the answer is that of another law, see [the page of the family](super).

use nonsmooth_linalg::{Block, small};
use nonsmooth_problem::check::Certificate;
use nonsmooth_problem::{FrictionLocal, Lcp, LcpPoint, LocalPoint};

use super::{Entries, Facets, KEYS, LISTED, approximates};
use crate::SolveError;
use crate::bridges::kept::{Kept, decompose, dot, normal_impulses, tangential, velocity};
use crate::contact::form::Contacts;
use crate::core::reformulation::Reformulation;
use crate::core::register::Composed;
use crate::{Boxed, Via};
use nonsmooth_problem::Kind;

/// The edge from contacts of dimension D to the LCP of their inner facets.
#[derive(Debug, Clone, Copy, Default)]
pub struct FacetInner<const D: usize>(pub Facets);

impl<const D: usize> Composed<FrictionLocal<D>> for FacetInner<D> {
    type To = Lcp;
    type Settings = Facets;
    const NAME: &'static str = "facet_inner";
    const SUMMARY: &'static str = "contact to LCP: the disk of friction becomes an inscribed polygon; exact in the plane, an approximation in space";
    const FROM: &'static [Kind] = &[Kind::FrictionLocal2d, Kind::FrictionLocal3d];
    const CITES: &'static [&'static str] =
        &["StewartTrinkle1996", "AnitescuPotra1997", "Acary2018"];
    const KEYS: &'static str = KEYS;
    const NEARLY: bool = approximates::<D>().is_some();

    fn compose(facets: Facets, solver: Boxed<Lcp>) -> Boxed<FrictionLocal<D>> {
        Boxed::new(Via { reformulation: Self(facets), solver })
    }

    fn lists(solver: &str) -> bool {
        LISTED.contains(&solver)
    }
}

/// What the way back needs.
pub struct InnerMemo<const D: usize> {
    kept: Kept<D>,
    /// The first variable of each contact, and their number.
    starts: Vec<usize>,
    entries: Entries,
}

impl<const D: usize> InnerMemo<D> {
    fn faces(&self) -> usize {
        self.kept.directions.len()
    }

    /// Numbers the variables; returns how many there are.
    fn number(&mut self, mu: &[f64]) -> usize {
        let wide = self.faces() + 2;
        self.starts.clear();
        self.starts.push(0);
        let mut at = 0;
        for &mu in mu {
            at += if mu > 0.0 { wide } else { 1 };
            self.starts.push(at);
        }
        at
    }

    /// Whether the variables of these contacts are numbered as they are.
    fn numbers(&self, mu: &[f64]) -> bool {
        let wide = self.faces() + 2;
        let width = |mu: f64| if mu > 0.0 { wide } else { 1 };
        self.starts.len() == mu.len() + 1
            && mu.iter().zip(self.starts.windows(2)).all(|(&mu, s)| s[1] - s[0] == width(mu))
    }

    /// The direction that a unit of variable a of a contact adds to its impulse: e_N, or d_i.
    fn column(&self, a: usize) -> [f64; D] {
        let mut e = [0.0; D];
        match a.checked_sub(1) {
            None => e[0] = 1.0,
            Some(i) => e[1..].copy_from_slice(&self.kept.directions[i][..D - 1]),
        }
        e
    }

    /// The entries of M, contact by contact.
    fn state(&self, problem: &FrictionLocal<D>, push: &mut dyn FnMut(usize, usize, f64)) {
        let (w, _) = self.kept.state.operator(problem);
        let impulses = |c: usize| match self.starts[c + 1] - self.starts[c] {
            1 => 1,
            all => all - 1,
        };
        for (c, &mu) in problem.mu.iter().enumerate() {
            let o = self.starts[c];
            let (columns, blocks) = w.row(c);
            for (&d, block) in columns.iter().zip(blocks) {
                let d = d as usize;
                for b in 0..impulses(d) {
                    let y = times(block, &self.column(b));
                    for a in 0..impulses(c) {
                        let x = self.column(a).iter().zip(&y).map(|(x, y)| x * y).sum();
                        push(o + a, self.starts[d] + b, x);
                    }
                }
            }
            if impulses(c) > 1 {
                let (unit, faces) = (self.kept.unit[c], self.faces());
                let lambda = o + 1 + faces;
                push(lambda, o, mu * unit);
                for beta in o + 1..lambda {
                    push(beta, lambda, unit);
                    push(lambda, beta, -unit);
                }
            }
        }
    }

    fn free(&self, problem: &FrictionLocal<D>, q: &mut [f64]) {
        let (_, free) = self.kept.state.operator(problem);
        q.fill(0.0);
        for c in 0..problem.mu.len() {
            let (o, u) = (self.starts[c], small::block::<D>(free, c));
            q[o] = u[0];
            if self.starts[c + 1] - o > 1 {
                for (i, d) in self.kept.directions.iter().enumerate() {
                    q[o + 1 + i] = dot(*d, tangential(&u));
                }
            }
        }
    }
}

fn times<const D: usize>(block: &Block<D>, x: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|k| block[k].iter().zip(x).map(|(a, x)| a * x).sum())
}

impl<const D: usize> Reformulation<FrictionLocal<D>> for FacetInner<D> {
    type To = Lcp;
    type Memo = InnerMemo<D>;

    fn reduce(&self, problem: &FrictionLocal<D>) -> Result<(Lcp, InnerMemo<D>), SolveError> {
        let kept = self.0.keep(problem)?;
        let mut memo = InnerMemo { kept, starts: vec![], entries: Entries::default() };
        let n = memo.number(&problem.mu);
        let mut entries = Entries::default();
        let matrix = entries.assemble(n, |push| memo.state(problem, push))?;
        memo.entries = entries;
        let mut q = vec![0.0; n];
        memo.free(problem, &mut q);
        Ok((Lcp::new(matrix, q)?, memo))
    }

    fn reduce_again(
        &self,
        problem: &FrictionLocal<D>,
        reduced: &mut Lcp,
        memo: &mut InnerMemo<D>,
    ) -> Result<(), SolveError> {
        memo.kept.refill(problem)?;
        if memo.numbers(&problem.mu)
            && memo.entries.overwrite(&mut reduced.M, |push| memo.state(problem, push))
        {
            memo.free(problem, &mut reduced.q);
            return Ok(reduced.validate()?);
        }
        (*reduced, *memo) = self.reduce(problem)?;
        Ok(())
    }

    fn contradiction(&self, memo: &InnerMemo<D>) -> Option<Certificate> {
        memo.kept.contradiction.clone().map(Certificate::from)
    }

    fn lift_certificate(&self, certificate: Certificate, memo: &InnerMemo<D>) -> Certificate {
        let contacts = memo.starts.len() - 1;
        normal_impulses(certificate, &memo.kept, contacts, |c| memo.starts[c], |_| 1.0)
    }

    fn approximates(&self) -> Option<&'static str> {
        approximates::<D>()
    }

    /// The impulses in the polygon, and for λ the largest speed along a vertex.
    fn lower(
        &self,
        problem: &FrictionLocal<D>,
        point: &LocalPoint,
        memo: &InnerMemo<D>,
        reduced: &mut LcpPoint,
    ) {
        let z = &mut reduced.z;
        z.resize(memo.starts[memo.starts.len() - 1], 0.0);
        z.fill(0.0);
        for (c, &mu) in problem.mu.iter().enumerate() {
            let (o, r) = (memo.starts[c], small::block::<D>(&point.r, c));
            z[o] = r[0].max(0.0);
            if memo.starts[c + 1] - o == 1 {
                continue;
            }
            let (directions, end) = (&memo.kept.directions, memo.starts[c + 1] - 1);
            decompose(directions, tangential(&r), |i, a| z[o + 1 + i] = a);
            let (sum, most) = (z[o + 1..end].iter().sum::<f64>(), mu * z[o]);
            if sum > most {
                z[o + 1..end].iter_mut().for_each(|beta| *beta *= most / sum);
            }
            let u = tangential(&velocity(problem, point, c));
            let speed = directions.iter().fold(0.0_f64, |s, d| s.max(-dot(*d, u)));
            z[end] = speed / memo.kept.unit[c];
        }
    }

    fn lift(
        &self,
        problem: &FrictionLocal<D>,
        reduced: &LcpPoint,
        memo: &mut InnerMemo<D>,
        point: &mut LocalPoint,
    ) {
        for c in 0..problem.mu.len() {
            let o = memo.starts[c];
            let r = &mut point.r[D * c..D * c + D];
            r.fill(0.0);
            r[0] = reduced.z[o];
            if memo.starts[c + 1] - o > 1 {
                for (i, d) in memo.kept.directions.iter().enumerate() {
                    let beta = reduced.z[o + 1 + i];
                    r[1..].iter_mut().zip(d).for_each(|(r, d)| *r += beta * d);
                }
            }
        }
        problem.complete(&mut memo.kept.state, point);
    }
}

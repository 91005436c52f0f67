//! **Lemke–Howson**: one equilibrium of a bimatrix game, by complementary pivots from the artificial one.
//!
//! Problem: payoffs A and B, m × n, of a row and a column player. Mixed strategies (x, y) such that neither gains by another one:
//! `xᵀ A y ≥ x'ᵀ A y`, `xᵀ B y ≥ xᵀ B y'`.
//!
//! Method: with payoffs made positive, an equilibrium is a solution other than zero of the LCP with `M = [0 −A; −Bᵀ 0]`, `q = 1`: w are the slacks of
//! `A y ≤ 1`, `Bᵀ x ≤ 1`, and x, y are scaled to sum up to 1 at last. From `z = 0` a z_k is made basic (the label k is dropped), and complementary pivots follow until
//! z_k or w_k leaves. The polytopes are bounded, so nothing is a ray; ties go lexicographically. Each label leads to an equilibrium, not always to another one.
//!
//! References: LemkeHowson1964; CottlePangStone2009, section 4.4.
//!
//! Cost of a pivot: that of Lemke's method. Storage: as there.
//! Fails: exponentially many pivots at worst; equilibria that no label reaches from the artificial one.

use nonsmooth_linalg::Dense;
use nonsmooth_problem::Lcp;

use super::basis::{Basis, Data, Factored, Tableau};
use super::path::{Breaking, End, Event, Path};
use crate::SolveError;
use crate::complementarity::form::Bounded;
use crate::core::trace::Variable;

/// Strategies of the two players; each sums up to 1.
#[derive(Debug, Clone, PartialEq)]
pub struct Equilibrium {
    /// Of the row player, m.
    pub x: Vec<f64>,
    /// Of the column player, n.
    pub y: Vec<f64>,
}

/// Beyond this, the basis is factorised.
const TABLEAU_LIMIT: usize = 60;

/// The LCP of a game with payoffs `a` and `b` (m × n, made positive): every solution other than zero, scaled, is an equilibrium.
///
/// Errors: payoffs of different shapes, empty or not finite.
pub fn game(a: &Dense, b: &Dense) -> Result<Lcp, SolveError> {
    let (m, n) = (a.nrows(), a.ncols());
    if (b.nrows(), b.ncols()) != (m, n) || m * n == 0 {
        let found = format!("{m} × {n} and {} × {}", b.nrows(), b.ncols());
        return Err(SolveError::needs("payoffs of one shape, with a row and a column", found));
    }
    // Payoffs from 1 to 2: equilibria do not depend on units.
    let unit = |p: &Dense| {
        let least = p.values().iter().copied().fold(f64::INFINITY, f64::min);
        let most = p.values().iter().copied().fold(f64::NEG_INFINITY, f64::max);
        (least, if most > least { most - least } else { 1.0 })
    };
    let ((la, ra), (lb, rb)) = (unit(a), unit(b));
    let entry = |i: usize, j: usize| match (i < m, j < m) {
        (true, false) => -1.0 - (a[(i, j - m)] - la) / ra,
        (false, true) => -1.0 - (b[(j, i - m)] - lb) / rb,
        _ => 0.0,
    };
    Ok(Lcp::new(Dense::from_fn(m + n, m + n, entry), vec![1.0; m + n])?)
}

/// The equilibrium to which label `k` leads: `k < m` a row of the row player, else a column. `None` where rounding spoils the path.
///
/// Errors: as [`game`]; a label that does not exist.
pub fn lemke_howson(a: &Dense, b: &Dense, k: usize) -> Result<Option<Equilibrium>, SolveError> {
    let lcp = game(a, b)?;
    let (m, n) = (a.nrows(), lcp.dim());
    if k >= n {
        return Err(SolveError::needs("a label below the number of strategies", k.to_string()));
    }
    let basis: Box<dyn Basis> = if n <= TABLEAU_LIMIT {
        Box::new(Tableau::default())
    } else {
        Box::new(Factored::default())
    };
    let mut path = Path::new(Data::new(&lcp.system()?, true), basis);
    path.breaking = Breaking::Lexicographic;
    path.end = End::Pair(k);
    if path.place(&vec![false; n]).is_err() {
        return Ok(None);
    }
    path.drive(Variable::Z(k));
    loop {
        match path.pivot() {
            Event::Pivoted(_) => {}
            Event::Ended(_) => break,
            Event::Ray | Event::Trouble(_) => return Ok(None),
        }
    }
    if path.refine().is_err() {
        return Ok(None);
    }
    let mut z = vec![0.0; n];
    for (&v, &x) in path.basic.iter().zip(&path.x) {
        if let Variable::Z(j) = v {
            z[j] = x.max(0.0) * path.unit(v);
        }
    }
    let share = |part: &[f64]| {
        let sum: f64 = part.iter().sum();
        (sum > 0.0).then(|| part.iter().map(|z| z / sum).collect::<Vec<_>>())
    };
    // x and y are not both zero, and where one is not, neither is the other.
    Ok(share(&z[..m]).zip(share(&z[m..])).map(|(x, y)| Equilibrium { x, y }))
}

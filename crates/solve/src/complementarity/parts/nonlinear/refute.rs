//! Proofs that a nonlinear problem has no solution, as far as they cost no more than a glance.

use nonsmooth_problem::check::{Certificate, Evidence, Exact, ExactVector, Proof};
use nonsmooth_problem::{Mcp, Problem};

/// A row whose values have, over the whole box, a sign that no bound of its variable allows: `F_i < 0` where `u_i = ∞`, `F_i > 0` where `l_i = −∞`.
///
/// Cost: F in interval arithmetic.
pub fn by_a_row(problem: &Mcp) -> Option<Proof> {
    let ranges = problem.F.expressions()?.ranges(&problem.lower, &problem.upper)?;
    let refutes = |&(i, sign): &(usize, i8)| match sign {
        1 => ranges[i].high < 0.0 && problem.upper[i].is_infinite(),
        _ => ranges[i].low > 0.0 && problem.lower[i].is_infinite(),
    };
    let (row, sign) = (0..problem.dim()).flat_map(|i| [(i, 1), (i, -1)]).find(refutes)?;
    let mut y = vec![Exact::ZERO; problem.dim()];
    y[row] = Exact::from(sign);
    match problem.evidence(&Certificate::Separating { vectors: vec![ExactVector(y)] }) {
        Evidence::Proved(proof) => Some(proof),
        _ => None,
    }
}

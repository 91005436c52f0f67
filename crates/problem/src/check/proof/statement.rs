//! What the kinds of problem share that state themselves as a [`ConeSystem`].

use super::cones::{Column, ConeSystem};
use super::evidence::Claim;
use super::exact::{Exact, exact};
use nonsmooth_linalg::Matrix;

/// The columns of M times `sign`, moved down by `row`; `None` of an operator.
pub(crate) fn columns(m: &Matrix, sign: i8, wanted: &dyn Fn(usize) -> bool) -> Option<Vec<Column>> {
    let mut out = vec![Column::new(); m.ncols()];
    let sign = f64::from(sign);
    let known = m.for_each(|i, j, x| {
        if wanted(i) {
            out[j].push((i, exact(sign * x)));
        }
    });
    known.then_some(out)
}

/// Doubles as they are.
pub(crate) fn exacts(x: &[f64]) -> Vec<Exact> {
    x.iter().map(|&x| exact(x)).collect()
}

/// `x = t_j`.
pub(crate) fn just(j: usize) -> (Exact, Vec<(usize, Exact)>) {
    (Exact::ZERO, vec![(j, Exact::ONE)])
}

/// A problem that can be stated in exact numbers. `wanted`: the rows of the problem whose entries matter; all without it.
pub(crate) trait Exactly {
    /// `None` where the problem's matrix is known by its products only.
    fn system(&self, wanted: Option<&[bool]>) -> Option<ConeSystem>;

    /// The rows of the system, but for those that define bounds.
    fn rows(&self) -> usize;

    /// What the unit of a row is worth, where those of the problem's rows differ: of a row that balances impulses, the mass that makes velocities of them.
    fn weight(&self, _row: usize) -> f64 {
        1.0
    }

    /// Of a contact problem: the row where the velocities of its contacts begin; those of bilateral constraints follow.
    fn impulses_from(&self) -> Option<usize> {
        None
    }

    /// Whether the vector, where it is the only one, may separate all, by a look in plain arithmetic.
    fn is_plausible(&self, _: &Claim) -> bool {
        true
    }
}

/// The variable z of a row whose `w = M z + q` is its partner, with the column of −M: `−w ∈ N_[l, u](z)`. A variable between two bounds has its distances from
/// both, x and y with `x + y = u − l`, and `w = w⁺ − w⁻`: pairs (w⁺, x) and (w⁻, y).
pub(crate) fn bounded(
    system: &mut ConeSystem,
    row: usize,
    column: Column,
    [l, u]: [f64; 2],
) -> (Exact, Vec<(usize, Exact)>) {
    let origin = exact(if l.is_finite() { l } else { u });
    for (i, x) in &column {
        system.rhs[*i] -= x * &origin;
    }
    let opposite = |c: &Column| c.iter().map(|(i, x)| (*i, -x)).collect::<Column>();
    let unknown = match (l.is_finite(), u.is_finite()) {
        (false, false) => {
            let z = system.column(column);
            system.free.push(z);
            vec![(z, Exact::ONE)]
        }
        (true, false) => {
            let pair = [system.unit(row, 1), system.column(column)];
            system.pairs.push(pair);
            vec![(pair[1], Exact::ONE)]
        }
        (false, true) => {
            let pair = [system.unit(row, -1), system.column(opposite(&column))];
            system.pairs.push(pair);
            vec![(pair[1], -Exact::ONE)]
        }
        (true, true) if l == u => {
            let w = system.unit(row, 1);
            system.free.push(w);
            vec![]
        }
        (true, true) => {
            let bound = system.row(exact(u) - exact(l));
            let x = system.column([column, vec![(bound, Exact::ONE)]].concat());
            let y = system.unit(bound, 1);
            let pairs = [[system.unit(row, 1), x], [system.unit(row, -1), y]];
            system.pairs.extend(pairs);
            system.slack_rows.push((bound, [x, y]));
            vec![(x, Exact::ONE)]
        }
    };
    (origin, unknown)
}

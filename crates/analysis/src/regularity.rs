//! Whether a solution of a complementarity problem is an isolated one: the rank of the Jacobian on its active set.

use nonsmooth_linalg::Csc;
use nonsmooth_problem::Mcp;
use nonsmooth_problem::check::RowStatus;
use serde::Serialize;

use crate::spectrum::{DENSE, rank_above};

/// The rank of the Jacobian `JF_αα` of the variables α whose rows are equations at a point: those strictly between their bounds, and free ones.
///
/// At a solution without degenerate pairs (`x_i` on a bound and `F_i = 0`) a nonsingular JF_αα makes the solution isolated, and strongly regular: it moves
/// smoothly with the data (Robinson1980). Rows are taken in units of their terms or, where those are less, of their largest entry, columns in units of `max(|x_j|, 1)`, and singular values count where they are above `4 √ρ` times
/// the largest, ρ the relative residual: at a double root a point is that far off, and so is the derivative from zero. The rank holds up to rounding and to the accuracy of the point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Regularity {
    /// The rank of JF_αα.
    pub rank: usize,
    /// |α|
    pub of: usize,
}

impl Regularity {
    /// At x (n) with these statuses (n) and this relative residual. `None` where F or its Jacobian is not defined, or JF_αα has more than 10⁵ entries.
    ///
    /// Cost: one Jacobian, and the singular values of a dense matrix.
    pub fn of(problem: &Mcp, x: &[f64], statuses: &[RowStatus], residual: f64) -> Option<Self> {
        let inside = |s: &RowStatus| matches!(s, RowStatus::Inside | RowStatus::Equality);
        let mut place = vec![None; x.len()];
        let mut of = 0;
        for (place, _) in place.iter_mut().zip(statuses).filter(|(_, s)| inside(s)) {
            *place = Some(of);
            of += 1;
        }
        if of * of > DENSE {
            return None;
        }
        let (n, pattern) = (x.len(), problem.F.pattern());
        let mut run = problem.F.evaluator();
        let (mut f, mut jacobian) = (vec![0.0; n], vec![0.0; pattern.len()]);
        if !run.jacobian(x, &mut f, &mut jacobian) || !jacobian.iter().all(|x| x.is_finite()) {
            return None;
        }
        let mut sizes = vec![0.0; n];
        if !run.sizes(x, &mut sizes) {
            sizes.fill(0.0);
        }
        let column = |j: usize| x[j].abs().max(1.0);
        let mut entries = vec![];
        for (i, row) in place.iter().enumerate().filter_map(|(i, p)| Some((i, (*p)?))) {
            let scaled =
                pattern.range(i).zip(pattern.row(i)).map(|(at, &j)| (j, jacobian[at] * column(j)));
            // Of a row whose terms all vanish the derivatives tell the unit.
            let terms = if sizes[i].is_finite() { sizes[i] } else { 0.0 };
            let unit = scaled.clone().fold(terms, |most, (_, a)| most.max(a.abs()));
            let unit = if unit > 0.0 { unit } else { 1.0 };
            entries.extend(scaled.filter_map(|(j, a)| Some((row, place[j]?, a / unit))));
        }
        let a = Csc::from_triplets(of, of, entries.into_iter()).ok()?;
        Some(Self { rank: rank_above(&a, 4.0 * residual.sqrt())?, of })
    }

    /// Whether the Jacobian is nonsingular there.
    pub fn is_regular(&self) -> bool {
        self.rank == self.of
    }
}

#[cfg(test)]
mod tests {
    use nonsmooth_problem::field::Expressions;

    use super::*;

    /// Equations in x₀, x₁ at a point that has this residual.
    fn at(rows: [&str; 2], x: [f64; 2], residual: f64) -> Regularity {
        let [rows, names] = [rows, ["x", "y"]].map(|all| all.map(String::from));
        let f = Expressions::parse(&rows, &names).unwrap();
        let free = vec![f64::INFINITY; 2];
        let lower = free.iter().map(|x| -x).collect();
        let problem = Mcp::new(f, lower, free, vec![0.0; 2]).unwrap();
        Regularity::of(&problem, &x, &[RowStatus::Inside; 2], residual).unwrap()
    }

    #[test]
    fn a_double_root_is_not_regular_as_far_as_the_point_can_tell() {
        for error in [1e-3, 1e-5, 1e-7] {
            let x = [1.0 + error; 2];
            assert_eq!(at(["x - 1", "y - x"], x, error * error).rank, 2, "{error}");
            assert_eq!(at(["x^2 - 2*x + 1", "y - x"], x, error * error).rank, 1, "{error}");
        }
    }

    #[test]
    fn units_of_rows_change_nothing() {
        for scale in ["1e-8", "1", "1e8"] {
            let rows = [format!("{scale}*(x^2 - 2*x + 1)"), "y - x".into()];
            assert_eq!(at([&rows[0], &rows[1]], [1.0 + 1e-6; 2], 1e-12).rank, 1);
            let rows = [format!("{scale}*(x^2 - 3*x + 2)"), "y - x".into()];
            assert_eq!(at([&rows[0], &rows[1]], [1.0 + 1e-12; 2], 1e-12).rank, 2);
        }
    }

    #[test]
    fn a_row_whose_terms_vanish_hides_no_other() {
        for b in [0.0, 4e-16, -2e-12] {
            assert_eq!(at(["y", "y - x^2 + 2"], [2.0_f64.sqrt(), b], 1e-12).rank, 2, "{b}");
        }
    }

    #[test]
    fn variables_on_their_bounds_are_left_out() {
        let f =
            Expressions::parse(&["x*y".into(), "y + 1".into()], &["x".into(), "y".into()]).unwrap();
        let problem = Mcp::ncp(f, vec![0.0; 2]).unwrap();
        let of = |x: [f64; 2], statuses: [RowStatus; 2]| {
            Regularity::of(&problem, &x, &statuses, 0.0).unwrap()
        };
        use RowStatus::{Inside, Lower};
        // On x ≥ 0, y = 0 every point is a solution: ∂F₀/∂x = y = 0.
        assert_eq!(of([3.0, 0.0], [Inside, Lower]), Regularity { rank: 0, of: 1 });
        assert_eq!(of([0.0, 0.0], [Lower, Lower]), Regularity { rank: 0, of: 0 });
    }
}

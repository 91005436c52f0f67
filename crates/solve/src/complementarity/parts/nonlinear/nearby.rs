//! The best of the doubles around a solution.
//!
//! Newton's method ends where x is right to its last bits. A row of large terms then is not zero: `F_i(x)` moves by `|J_ij|` times the distance of doubles at x_j, for terms of 1e6 by some 1e-10. Which
//! of the points around x has the smallest natural residual `‖x − mid(l, u, x − F(x))‖_∞` is decided row by row: of the worst one each variable between its bounds is tried at the doubles that its own slope
//! says, and the one that lowers the largest entry most is taken. F is in doubled precision. Cost: an evaluation a trial, bounded by [`WORK`].

use nonsmooth_linalg::budget;
use nonsmooth_problem::Mcp;
use nonsmooth_problem::field::tentatively;

/// Trials, and places of the Jacobian and rows that they may look at together: some hundredths of a second.
const TRIALS: usize = 5000;
const WORK: usize = 5_000_000;

/// Moves x to such points until the residual is at most `target`, as long as it falls; whether it fell.
pub fn nearby(problem: &Mcp, x: &mut [f64], target: f64) -> bool {
    let n = x.len();
    let pattern = problem.F.pattern();
    let mut field = problem.F.evaluator();
    let (mut f, mut slopes) = (vec![0.0; n], vec![0.0; pattern.len()]);
    if !field.jacobian(x, &mut f, &mut slopes) || !field.precisely(x, &mut f) {
        return false;
    }
    let (lower, upper) = (&problem.lower, &problem.upper);
    let entry = |i: usize, x: f64, f: f64| match () {
        () if x - f <= lower[i] => x - lower[i],
        () if x - f >= upper[i] => x - upper[i],
        () => f,
    };
    let worst = |x: &[f64], f: &[f64]| {
        let sizes = (0..n).map(|i| (i, entry(i, x[i], f[i]).abs()));
        sizes.fold((0, 0.0), |most, e| if e.1 > most.1 || e.1.is_nan() { e } else { most })
    };
    let mut left = TRIALS.min(WORK / (pattern.len() + n).max(1));
    let (mut i, mut error) = worst(x, &f);
    let first = error;
    while error > target && !budget::over() {
        let own = entry(i, x[i], f[i]);
        if own != f[i] {
            break;
        }
        let mut best: Option<(usize, f64, usize, f64)> = None;
        for (&j, &a) in pattern.row(i).iter().zip(&slopes[pattern.range(i)]) {
            let here = x[j];
            let aim = here - own / a;
            if a == 0.0 || here <= lower[j] || here >= upper[j] {
                continue;
            }
            for there in [aim, aim.next_up(), aim.next_down()] {
                let inside = there > lower[j] && there < upper[j];
                if there == here || !inside || left == 0 {
                    continue;
                }
                left -= 1;
                x[j] = there;
                if tentatively(|| field.precisely(x, &mut f)) {
                    let (at, size) = worst(x, &f);
                    if size < best.map_or(error, |b| b.3) {
                        best = Some((j, there, at, size));
                    }
                }
            }
            x[j] = here;
        }
        let Some((j, there, at, size)) = best else { break };
        x[j] = there;
        field.precisely(x, &mut f);
        (i, error) = (at, size);
    }
    error < first
}

#[cfg(test)]
mod tests {
    use super::*;
    use nonsmooth_problem::field::Expressions;

    #[test]
    fn a_row_of_large_terms_is_met_by_the_doubles_around_its_solution() {
        // x3 is near 2e6, where doubles are 2^-32 apart, and x2, which the first row leaves free by its last bits, has a slope of 1180 in the last one.
        let rows = ["3*x1 - 1000", "7*x2 + 0.001*x1 - 3100", "x3 - 1180*x2 - 938*x1 - 1300000.1"];
        let rows: Vec<_> = rows.iter().map(ToString::to_string).collect();
        let free = f64::INFINITY;
        let f = Expressions::parse(&rows, &[]).unwrap();
        let problem = Mcp::new(f, vec![-free; 3], vec![free; 3], vec![0.0; 3]).unwrap();
        let x1 = 1000.0 / 3.0;
        let x2 = (3100.0 - 0.001 * x1) / 7.0;
        let mut x = [x1, x2, 1180.0 * x2 + 938.0 * x1 + 1_300_000.1];
        x[2] = f64::next_up(x[2]);
        let residual = |x: &[f64]| {
            let mut f = [0.0; 3];
            problem.F.evaluator().precisely(x, &mut f);
            f.iter().fold(0.0_f64, |most, f| most.max(f.abs()))
        };
        let before = residual(&x);
        assert!(before > 1e-10, "{before:e}");
        assert!(nearby(&problem, &mut x, 1e-10));
        assert!(residual(&x) <= 1e-10, "{before:e} {:e}", residual(&x));
        assert!(!nearby(&problem, &mut x, 1e-10), "content");
    }
}

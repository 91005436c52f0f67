//! The verification of certificates that a linear complementarity problem has no solution.

use super::Certificate;
use super::linear::{Data, Stated};
use crate::Hlcp;
use crate::linalg::{Compensated, Matrix, norm};

/// What of a product `Σ a_i y_i` is rounding, in units of the size of its terms: such a sum counts as zero.
const ZERO: f64 = 1e-13;
/// How negative the sum that must be negative is at least, in units of the size of its terms.
const NEGATIVE: f64 = -1e-9;

/// `Aᵀ y` by columns in doubled precision, with what is rounding set to zero. `None` of an operator.
fn combination(a: &Matrix, y: &[f64]) -> Option<Vec<f64>> {
    let n = a.ncols();
    let (mut sums, mut sizes) = (vec![Compensated::default(); n], vec![0.0; n]);
    let known = a.for_each(|i, j, x| {
        sums[j].add_product(x, y[i]);
        sizes[j] += (x * y[i]).abs();
    });
    let cleaned = sums.iter().zip(&sizes).map(|(sum, size)| match sum.value() {
        value if value.abs() <= ZERO * size => 0.0,
        value => value,
    });
    known.then(|| cleaned.collect())
}

/// `qᵀ y` is negative beyond rounding, together with other `terms` of the same sum.
fn negative(q: &[f64], y: &[f64], terms: impl Iterator<Item = f64>) -> bool {
    let mut sum = Compensated::default();
    let mut size = 0.0;
    for (q, y) in q.iter().zip(y) {
        sum.add_product(*q, *y);
        size += (q * y).abs();
    }
    for term in terms {
        sum.add(term);
        size += term.abs();
    }
    size > 0.0 && sum.value() <= NEGATIVE * size
}

/// Whether the certificate proves from M and q alone that there is no solution.
pub(crate) fn refutes(problem: &impl Stated, certificate: &Certificate) -> bool {
    let data = problem.data();
    match certificate {
        Certificate::Impulses(_) => false,
        &Certificate::Row { row } => {
            let mut y = vec![0.0; data.q.len()];
            match y.get_mut(row) {
                Some(entry) => *entry = 1.0,
                None => return false,
            }
            row >= data.equalities && farkas(&data, &y)
        }
        Certificate::Farkas { y } => farkas(&data, y),
        // Only a square problem has a Lemke ray; its rows then are numbered as its variables.
        Certificate::Ray { z, z0 } => {
            *z0 == 0.0 && data.equalities == data.free && farkas(&data, z)
        }
        Certificate::Cones { separating } => data.bounds.is_none() && cones(&data, separating),
    }
}

fn shaped(y: &[f64], len: usize) -> bool {
    y.len() == len && norm(y).is_finite()
}

fn farkas(data: &Data, y: &[f64]) -> bool {
    if !shaped(y, data.q.len()) {
        return false;
    }
    let signs = y.iter().enumerate().all(|(i, &y)| match data.bounds(i) {
        _ if i < data.equalities => true,
        (l, u) if l.is_finite() && u.is_finite() => y == 0.0,
        (l, _) if l.is_finite() => y >= 0.0,
        (_, u) if u.is_finite() => y <= 0.0,
        _ => true,
    });
    let Some(slope) = combination(data.matrix, y).filter(|_| signs) else {
        return false;
    };
    // The least upper bound of yᵀ M z over the box, column by column.
    let terms = slope.iter().enumerate().map(|(j, &g)| match data.column_bounds(j) {
        _ if g == 0.0 => 0.0,
        (_, u) if g > 0.0 => g * u,
        (l, _) => g * l,
    });
    terms.clone().all(f64::is_finite) && negative(data.q, y, terms)
}

/// Whether the vectors separate all complementary cones from q.
fn cones(data: &Data, separating: &[Vec<f64>]) -> bool {
    let pairs = data.q.len() - data.equalities;
    // Which cones a vector separates: those with w_j where it allows w_j, and z_j where it allows z_j.
    let allowed: Option<Vec<[Vec<bool>; 2]>> = separating
        .iter()
        .map(|y| {
            let slope = combination(data.matrix, y).filter(|_| shaped(y, data.q.len()))?;
            let free = slope[..data.free].iter().all(|g| *g == 0.0);
            let proper = free && negative(data.q, y, std::iter::empty());
            let w = y[data.equalities..].iter().map(|y| *y >= 0.0).collect();
            let z = slope[data.free..].iter().map(|g| *g <= 0.0).collect();
            proper.then_some([w, z])
        })
        .collect();
    let Some(allowed) = allowed else { return false };
    covered(&allowed, &(0..allowed.len()).collect::<Vec<_>>(), 0, pairs)
}

/// Whether the vectors left separate all cones whose first `depth` pairs are chosen.
fn covered(allowed: &[[Vec<bool>; 2]], left: &[usize], depth: usize, pairs: usize) -> bool {
    let all = |k: &usize| (depth..pairs).all(|j| allowed[*k][0][j] && allowed[*k][1][j]);
    if left.iter().any(all) {
        return true;
    }
    depth < pairs
        && [0, 1].into_iter().all(|side| {
            let still: Vec<_> = left.iter().copied().filter(|&k| allowed[k][side][depth]).collect();
            !still.is_empty() && covered(allowed, &still, depth + 1, pairs)
        })
}

/// As [`refutes`], for the horizontal problem.
pub(crate) fn refutes_horizontal(problem: &Hlcp, certificate: &Certificate) -> bool {
    let Certificate::Farkas { y } = certificate else { return false };
    let fine = |m: &Matrix| combination(m, y).is_some_and(|g| g.iter().all(|g| *g >= 0.0));
    shaped(y, problem.q.len())
        && fine(&problem.Q)
        && fine(&problem.R)
        && negative(&problem.q, y, std::iter::empty())
}

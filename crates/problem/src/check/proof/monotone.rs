//! Whether dynamics are monotone, proved or up to rounding.

use super::exact::{Exact, exact, negative};
use nonsmooth_linalg::{Csc, Groups, Matrix, SquareCholesky, is_positive_definite, norm};

/// What is known of a matrix A with the symmetric part S = (A + Aᵀ)/2: positive definite, or semidefinite with ker S ⊆ ker A, so that
/// `A = Lᵀ K L` with K positive definite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Monotone {
    /// It is so, proved: by exact elimination, or by a Cholesky factorisation of A less what rounding can amount to (Rump2006).
    Proved {
        /// Whether S is positive definite.
        definite: bool,
    },
    /// It is so up to rounding only.
    Nearly {
        /// What had to be added to the diagonal, in units of each diagonal entry.
        shift: f64,
    },
    /// It is not, or is not known to be.
    Unknown,
}

/// Components up to this order are decided by exact elimination where floating point does not decide.
const EXACT: usize = 24;
/// The shifts that are tried: the first is rounding, the last the seven digits with which some files store W.
const SHIFTS: [f64; 3] = [1e-12, 1e-9, 1e-6];
/// An asymmetry below this is rounding, above it is meant.
const NOISE: f64 = 1e-8;

/// Whether the matrix is monotone.
///
/// Cost: a sparse Cholesky factorisation, or a few; small components that are not definite an exact elimination.
pub(crate) fn monotone(a: &Csc) -> Monotone {
    let mut groups = Groups::new(a.nrows());
    a.triplets().filter(|e| e.2 != 0.0).for_each(|(i, j, _)| groups.join(i, j));
    let small = |m: &Vec<usize>| m.len() <= EXACT;
    let (small, large): (Vec<_>, Vec<_>) = groups.members().into_iter().partition(small);
    let mut definite = true;
    let mut all_proved = is_surely_definite(&principal(a, &large.concat()));
    if !is_surely_definite(&principal(a, &small.concat())) {
        // Which of the small ones is to blame?
        for component in &small {
            let block = principal(a, component);
            if is_surely_definite(&block) {
                continue;
            }
            match by_elimination(&block) {
                Some(true) => {}
                Some(false) => definite = false,
                None => all_proved = false,
            }
        }
    }
    if all_proved { Monotone::Proved { definite } } else { nearly(a) }
}

/// The rows and columns given.
pub(crate) fn principal(a: &Csc, members: &[usize]) -> Csc {
    if members.len() == a.nrows() && members.is_sorted() {
        return a.clone();
    }
    let mut place = vec![usize::MAX; a.nrows()];
    members.iter().enumerate().for_each(|(k, &i)| place[i] = k);
    let inside = a.triplets().filter(|e| place[e.0] != usize::MAX && place[e.1] != usize::MAX);
    let entries: Vec<_> = inside.map(|(i, j, x)| (place[i], place[j], x)).collect();
    Csc::from_triplets(members.len(), members.len(), entries.into_iter()).expect("in range")
}

/// `D (A + Aᵀ) D` with D powers of two such that the diagonal is in [1, 4). `None` where a diagonal entry is not positive.
fn scaled(a: &Csc) -> Option<Csc> {
    let n = a.nrows();
    let mut d = Vec::with_capacity(n);
    for i in 0..n {
        let diagonal = 2.0 * a.get(i, i);
        if !(diagonal > 0.0 && diagonal.is_finite()) {
            return None;
        }
        d.push((-0.5 * diagonal.log2()).ceil().exp2());
    }
    let both =
        a.triplets().flat_map(|(i, j, x)| [(i, j, x * d[i] * d[j]), (j, i, x * d[i] * d[j])]);
    Csc::from_triplets(n, n, both).ok()
}

/// Positive definite for certain: Cholesky of the scaled matrix less `c I` succeeds in floating point, where c exceeds what its rounding
/// amounts to, `γ_{n+1}/(1 − γ_{n+1}) tr`, and that of forming the matrix (Rump2006).
fn is_surely_definite(a: &Csc) -> bool {
    let n = a.nrows();
    if n == 0 {
        return true;
    }
    let Some(s) = scaled(a) else { return false };
    let trace: f64 = (0..n).map(|i| s.get(i, i)).sum();
    let mut rows = vec![0.0_f64; n];
    s.triplets().for_each(|(i, _, x)| rows[i] += x.abs());
    let largest = rows.iter().fold(0.0_f64, |l, x| l.max(*x));
    let epsilon = f64::EPSILON;
    let c = 4.0 * epsilon * ((n as f64 + 4.0) * trace + largest);
    c < 0.5 && is_positive_definite(&s, -c * n as f64 / trace)
}

/// Positive definite (true), or semidefinite with ker S ⊆ ker A (false); `None` otherwise. Exact.
fn by_elimination(a: &Csc) -> Option<bool> {
    let n = a.nrows();
    let mut s = vec![vec![Exact::ZERO; n]; n];
    let mut k = s.clone();
    for (i, j, x) in a.triplets() {
        let x = exact(x);
        s[i][j] += &x;
        s[j][i] += &x;
        k[i][j] += &x;
        k[j][i] -= x;
    }
    // Rows of eliminated unknowns: x_i + Σ row_j x_j = 0 on the kernel.
    let mut eliminated: Vec<(usize, Vec<Exact>)> = vec![];
    let mut left: Vec<usize> = (0..n).collect();
    loop {
        if left.iter().any(|&i| negative(&s[i][i])) {
            return None;
        }
        let Some(at) = left.iter().position(|&i| !s[i][i].is_zero()) else { break };
        let i = left.swap_remove(at);
        let row: Vec<Exact> = (0..n).map(|j| &s[i][j] / &s[i][i]).collect();
        for &j in &left {
            if s[j][i].is_zero() {
                continue;
            }
            let factor = s[j][i].clone();
            for &l in &left {
                let product = &factor * &row[l];
                s[j][l] -= product;
            }
        }
        let row = (0..n).map(|j| if left.contains(&j) { row[j].clone() } else { Exact::ZERO });
        eliminated.push((i, row.collect()));
    }
    // What is left has no diagonal, so it must be nothing.
    if left.iter().any(|&i| left.iter().any(|&j| !s[i][j].is_zero())) {
        return None;
    }
    for &free in &left {
        let mut x = vec![Exact::ZERO; n];
        x[free] = Exact::ONE;
        for (i, row) in eliminated.iter().rev() {
            x[*i] = -row.iter().zip(&x).fold(Exact::ZERO, |sum, (a, x)| sum + a * x);
        }
        let product =
            |row: &Vec<Exact>| row.iter().zip(&x).fold(Exact::ZERO, |sum, (a, x)| sum + a * x);
        if k.iter().any(|row| !product(row).is_zero()) {
            return None;
        }
    }
    Some(left.is_empty())
}

/// As above, up to rounding: the symmetric part with a share of its own diagonal added is positive definite, and vectors that
/// it nearly annuls are nearly annulled by A.
fn nearly(a: &Csc) -> Monotone {
    // Unknowns that do not appear are in both kernels.
    let mut appears = vec![false; a.nrows()];
    a.triplets().filter(|e| e.2 != 0.0).for_each(|(i, j, _)| {
        (appears[i], appears[j]) = (true, true);
    });
    let there: Vec<usize> = (0..a.nrows()).filter(|&i| appears[i]).collect();
    let a = principal(a, &there);
    let Some(s) = scaled(&a) else { return Monotone::Unknown };
    let shifted = |shift: f64| {
        let more = (0..s.nrows()).map(|i| (i, i, shift * s.get(i, i)));
        Csc::from_triplets(s.nrows(), s.ncols(), s.triplets().chain(more)).expect("in range")
    };
    let definite = |shift: &f64| is_positive_definite(&shifted(*shift), 0.0);
    let Some(shift) = SHIFTS.into_iter().find(definite) else { return Monotone::Unknown };
    if a.asymmetry() <= NOISE || kernels_agree(&a, &shifted(shift)) {
        Monotone::Nearly { shift }
    } else {
        Monotone::Unknown
    }
}

/// Inverse iterations from vectors without any pattern lead to vectors of the kernel of S, if it has one: A must annul them as well.
fn kernels_agree(a: &Csc, shifted: &Csc) -> bool {
    let mut factor = SquareCholesky::default();
    if factor.factorise(&Matrix::Sparse(shifted.clone())).is_err() {
        return false;
    }
    let n = a.nrows();
    let d: Vec<f64> = (0..n).map(|i| (shifted.get(i, i) / (2.0 * a.get(i, i))).sqrt()).collect();
    let mut state = 1u64;
    for _ in 0..4 {
        let mut x: Vec<f64> = (0..n)
            .map(|_| {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
            })
            .collect();
        let mut before = norm(&x);
        for _ in 0..3 {
            factor.solve(&mut x);
            let size = norm(&x);
            x.iter_mut().for_each(|x| *x /= size);
            before = 1.0 / size;
        }
        // The energy of x: without a kernel it is not small.
        if before > 1e-5 {
            continue;
        }
        // In the scaled unknowns A is D A D.
        let scaled: Vec<f64> = x.iter().zip(&d).map(|(x, d)| x * d).collect();
        let mut image = vec![0.0; n];
        a.mul_add(1.0, &scaled, &mut image);
        image.iter_mut().zip(&d).for_each(|(y, d)| *y *= d);
        if norm(&image) > 1e-4 {
            return false;
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix<const N: usize>(a: [[f64; N]; N]) -> Csc {
        let entries = (0..N * N).map(|k| (k / N, k % N, a[k / N][k % N]));
        Csc::from_triplets(N, N, entries).unwrap()
    }

    #[test]
    fn definite_semidefinite_and_neither() {
        let proved = |definite| Monotone::Proved { definite };
        assert_eq!(monotone(&matrix([[2.0, -1.0], [-1.0, 2.0]])), proved(true));
        assert_eq!(monotone(&matrix([[1e12, 0.0], [0.0, 1e-12]])), proved(true));
        assert_eq!(monotone(&matrix([[1.0, -1.0], [-1.0, 1.0]])), proved(false));
        assert_eq!(monotone(&matrix([[0.0, 0.0], [0.0, 1.0]])), proved(false));
        assert_eq!(monotone(&matrix([[1.0, 5.0], [-5.0, 1.0]])), proved(true));
        // Positive definite by one unit of the last place: exact elimination sees it.
        let d = 1.0 + f64::EPSILON;
        assert_eq!(monotone(&matrix([[d, -1.0], [-1.0, d]])), proved(true));
        // The kernel of the symmetric part is moved by the skew part.
        assert_eq!(monotone(&matrix([[0.0, -2.0], [2.0, 1.0]])), Monotone::Unknown);
        // A mean diagonal of 1e6 would hide the entry that is negative.
        let hidden = [[1e7, 0.0, 0.0], [0.0, 1e7, 0.0], [0.0, 0.0, -1.0]];
        assert_eq!(monotone(&matrix(hidden)), Monotone::Unknown);
        // Indefinite by rounding: a product of rank one as stored.
        let v = [0.1, 0.2, 0.7];
        let product: [[f64; 3]; 3] = v.map(|a| v.map(|b| a * b));
        let found = monotone(&matrix(product));
        assert!(matches!(found, Monotone::Nearly { .. } | Monotone::Proved { .. }), "{found:?}");
    }

    #[test]
    fn large_matrices_are_proved_definite_in_floating_point() {
        let n = 400;
        let chain = (0..n).flat_map(|i| {
            let s = [1.0, 1e3][i % 2];
            let t = [1.0, 1e3][(i + 1) % 2];
            [(i, i, 2.1 * s * s), ((i + 1) % n, i, -s * t), (i, (i + 1) % n, -s * t)]
        });
        let chain = Csc::from_triplets(n, n, chain).unwrap();
        assert_eq!(monotone(&chain), Monotone::Proved { definite: true });
    }

    #[test]
    fn a_large_skew_part_on_the_kernel_is_found() {
        // Ones have no energy; a skew part that moves them makes the difference.
        let n = 60;
        let laplace = |skew: f64| {
            let entries = (0..n).flat_map(move |i| {
                let (j, skew) = ((i + 1) % n, if i == 0 { skew } else { 0.0 });
                [(i, i, 2.0), (i, j, skew - 1.0), (j, i, -skew - 1.0)]
            });
            Csc::from_triplets(n, n, entries).unwrap()
        };
        assert!(matches!(monotone(&laplace(0.0)), Monotone::Nearly { .. }));
        assert_eq!(monotone(&laplace(0.3)), Monotone::Unknown);
    }
}

//! The exact solution of one frictional contact by cases and a bracketed one-parameter root.
//!
//! 1. **Open**: `q_N ≥ 0` ⇒ `r = 0`.
//! 2. **Stick**: `r = −W⁻¹ q`, accepted if it lies in K.
//! 3. **Slip**: `u_N = 0`, `u_T = −α r_T` with α > 0. Eliminating `r_N`, with the Schur complement
//!    `W̃ = W_TT − W_TN W_NT / W_NN`, `q̃ = q_T − W_TN q_N / W_NN`:
//!    `r_T(α) = −(W̃ + αI)⁻¹ q̃`, and `g(α) = ‖r_T(α)‖ − mu r_N(α)` has `g(0) > 0` (stick failed), `g(∞) < 0`.
//!    Multiplied by det(W̃ + αI) this is `‖A + α q̃‖ = c(α)`, c a parabola; squared, a quartic's root where c > 0: no square root an
//!    evaluation. It is found by Halley's method inside a bracket, from the α of the last visit.
//!
//! In the plane the direction of sliding is one of two, each a linear equation.
//! W may be nonsymmetric. Cost: 30 to 150 flops, some 10 ns where the contact does not slide, 40 to 120 where it does;
//! [`Quartic`](super::Quartic), which finds all sliding solutions, takes longer. Source: DBB11, section 4 (the polynomial behind it is in
//! [`Quartic`](super::Quartic)); JourdanAlartJean1998 for the block Gauss–Seidel that it serves.

use crate::contact::law::Coulomb;

use super::{LocalSolver, Rest};

/// Solves to rounding, so there is nothing to set; each visit begins from the last one's root.
#[derive(Debug, Clone, Copy, Default)]
pub struct Exact;

/// What depends on the block alone, and the sliding parameter of the last visit.
#[derive(Debug, Clone)]
pub struct ExactMemo<const D: usize> {
    rest: Option<Rest<D>>,
    schur: Option<Schur>,
    alpha: f64,
}

impl<const D: usize> LocalSolver<D> for Exact {
    type Memo = ExactMemo<D>;

    fn prepare(&self, w: &[[f64; D]; D], _: Coulomb) -> ExactMemo<D> {
        let schur = if D == 3 { Schur::new(w) } else { None };
        ExactMemo { rest: Rest::new(w), schur, alpha: 0.0 }
    }

    #[inline(always)]
    fn solve(
        &self,
        memo: &mut ExactMemo<D>,
        w: &[[f64; D]; D],
        q: &[f64; D],
        law: Coulomb,
        r: &[f64; D],
    ) -> [f64; D] {
        let Coulomb { mu } = law;
        if q[0] >= 0.0 {
            return [0.0; D];
        }
        let Some(rest) = &memo.rest else {
            return *r;
        };
        if let Some(stuck) = stick(rest, w, q, mu) {
            return stuck;
        }
        let sliding = if D == 2 {
            slide_plane(w, q, mu)
        } else {
            match &memo.schur {
                Some(schur) => {
                    let found = Sliding::new(schur, q, mu).root(memo.alpha);
                    found.map(|(r, alpha)| {
                        memo.alpha = alpha;
                        embed(r)
                    })
                }
                None => slide_free(w, q, mu),
            }
        };
        sliding.unwrap_or(*r)
    }
}

/// `r = −W⁻¹ q` if it lies in K.
#[inline(always)]
pub(super) fn stick<const D: usize>(
    rest: &Rest<D>,
    w: &[[f64; D]; D],
    q: &[f64; D],
    mu: f64,
) -> Option<[f64; D]> {
    let r = rest.impulse(w, q)?;
    let tangential: f64 = r[1..].iter().map(|x| x * x).sum();
    (r[0] > 0.0 && tangential <= (mu * r[0]) * (mu * r[0])).then_some(r)
}

/// The sliding contact in the plane: `r_T = s mu r_N`, `u_N = 0`, `s u_T ≤ 0` for s = 1 or −1.
#[inline(always)]
fn slide_plane<const D: usize>(w: &[[f64; D]; D], q: &[f64; D], mu: f64) -> Option<[f64; D]> {
    let mut best: Option<([f64; D], f64)> = None;
    for s in [1.0, -1.0] {
        let n = -q[0] / (w[0][0] + s * mu * w[0][1]);
        if !(n > 0.0 && n.is_finite()) {
            continue;
        }
        let mut r = [0.0; D];
        (r[0], r[1]) = (n, s * mu * n);
        let against = s * (w[1][0] * r[0] + w[1][1] * r[1] + q[1]);
        if best.is_none_or(|(_, other)| against < other) {
            best = Some((r, against));
        }
    }
    best.map(|(r, _)| r)
}

/// The sliding contact whose tangential motion follows from the normal one (W̃ = 0): `u_T = q̃`, `r_T = −mu r_N q̃ / ‖q̃‖`, `u_N = 0`.
#[cold]
fn slide_free<const D: usize>(w: &[[f64; D]; D], q: &[f64; D], mu: f64) -> Option<[f64; D]> {
    let mut along = [0.0; D];
    for k in 1..D {
        along[k] = w[k][0] * (q[0] / w[0][0]) - q[k];
    }
    let size = along.iter().map(|x| x * x).sum::<f64>().sqrt();
    let mut r = along.map(|x| mu * x / size);
    r[0] = 1.0;
    let n = -q[0] / (0..D).map(|k| w[0][k] * r[k]).sum::<f64>();
    r = r.map(|x| n * x);
    (n > 0.0 && r.iter().all(|x| x.is_finite())).then_some(r)
}

/// The elimination of `r_N` by `u_N = 0` from a 3×3 block.
#[derive(Debug, Clone)]
pub(super) struct Schur {
    /// 1 / W_NN.
    inv: f64,
    /// W_NT / W_NN and W_TN.
    row: [f64; 2],
    column: [f64; 2],
    /// W̃ = W_TT − W_TN W_NT / W_NN, its trace and determinant.
    w: [[f64; 2]; 2],
    trace: f64,
    det: f64,
}

impl Schur {
    /// `None` where the normal or the tangential motion is impossible.
    pub(super) fn new<const D: usize>(w: &[[f64; D]; D]) -> Option<Self> {
        let inv = 1.0 / w[0][0];
        let (row, column) = ([w[0][1] * inv, w[0][2] * inv], [w[1][0], w[2][0]]);
        let schur = |k: usize, l: usize| w[k + 1][l + 1] - column[k] * row[l];
        let w = [[schur(0, 0), schur(0, 1)], [schur(1, 0), schur(1, 1)]];
        let trace = w[0][0] + w[1][1];
        let det = (w[0][0] * w[1][1] - w[0][1] * w[1][0]).max(0.0);
        (inv > 0.0 && inv.is_finite() && trace > 0.0).then_some(Self {
            inv,
            row,
            column,
            w,
            trace,
            det,
        })
    }
}

/// Squares in this range have products with each other that neither vanish nor overflow.
const TINY: f64 = 1e-280;
const HUGE: f64 = 1e280;

/// The sliding contact in space as the scalar equation `‖A + α q̃‖ = c(α)`.
pub(super) struct Sliding<'a> {
    schur: &'a Schur,
    /// q_N / W_NN.
    q0: f64,
    mu: f64,
    /// q̃ and A = adj(W̃) q̃.
    qt: [f64; 2],
    a: [f64; 2],
    /// c(α) = c2 α² + c1 α + c0.
    c: [f64; 3],
}

impl<'a> Sliding<'a> {
    #[inline(always)]
    pub(super) fn new<const D: usize>(schur: &'a Schur, q: &[f64; D], mu: f64) -> Self {
        let Schur { inv, row, column, w, trace, det } = schur;
        let q0 = q[0] * inv;
        let qt = [q[1] - column[0] * q0, q[2] - column[1] * q0];
        let a = [w[1][1] * qt[0] - w[0][1] * qt[1], w[0][0] * qt[1] - w[1][0] * qt[0]];
        let c = [
            mu * (row[0] * a[0] + row[1] * a[1] - q0 * det),
            mu * (row[0] * qt[0] + row[1] * qt[1] - q0 * trace),
            -mu * q0,
        ];
        Self { schur, q0, mu, qt, a, c }
    }

    /// `‖A + α q̃‖²` as coefficients of 1, α, α².
    fn square(&self) -> [f64; 3] {
        let dot = |x: [f64; 2], y: [f64; 2]| x[0] * y[0] + x[1] * y[1];
        [dot(self.a, self.a), 2.0 * dot(self.a, self.qt), dot(self.qt, self.qt)]
    }

    /// The quartic `‖A + α q̃‖² − c(α)²`, coefficients of 1 … α⁴, and a scale for α.
    pub(super) fn quartic(&self) -> ([f64; 5], f64) {
        let (s, c) = (self.square(), self.c);
        let p = [
            s[0] - c[0] * c[0],
            s[1] - 2.0 * c[0] * c[1],
            s[2] - c[1] * c[1] - 2.0 * c[0] * c[2],
            -2.0 * c[1] * c[2],
            -c[2] * c[2],
        ];
        (p, self.schur.trace)
    }

    /// c(α): the sign of r_N.
    pub(super) fn pressure(&self, alpha: f64) -> f64 {
        (self.c[2] * alpha + self.c[1]) * alpha + self.c[0]
    }

    /// The impulse that belongs to a root α, put on the cone exactly.
    #[inline(always)]
    pub(super) fn impulse(&self, alpha: f64) -> Option<[f64; 3]> {
        // r_T = −t/det(α) along t = A + α q̃; r_N from u_N = 0; then r_T is stretched to mu r_N. One division serves all.
        let t = [self.a[0] + alpha * self.qt[0], self.a[1] + alpha * self.qt[1]];
        let size = (t[0] * t[0] + t[1] * t[1]).sqrt();
        let det = (alpha + self.schur.trace) * alpha + self.schur.det;
        let inv = 1.0 / (det * size);
        let coupling = self.schur.row[0] * t[0] + self.schur.row[1] * t[1];
        let n = coupling * (inv * size) - self.q0;
        let onto = -self.mu * n * (inv * det);
        if n > 0.0 && onto.is_finite() {
            return Some([n, onto * t[0], onto * t[1]]);
        }
        // Without a tangential load (size = 0) the contact only presses. Loads that are all but zero, whose
        // products underflow, end here too.
        (size == 0.0 && self.q0 < 0.0).then_some([-self.q0, 0.0, 0.0])
    }

    /// The root of `p(α) = ‖A + α q̃‖² − c(α)²` with `c(α) > 0` by safeguarded steps of Halley's from `guess`, and its impulse.
    #[inline(always)]
    pub(super) fn root(&self, guess: f64) -> Option<([f64; 3], f64)> {
        let [s0, s1, s2] = self.square();
        let [c0, c1, c2] = self.c;
        // The root lies in (low, high), high once it is finite: below it ‖A + α q̃‖ > c, above it less.
        let (mut low, mut high) = (0.0_f64, f64::INFINITY);
        let mut x = if guess > 0.0 { guess } else { self.schur.trace };
        for _ in 0..100 {
            let (c, slope) = ((c2 * x + c1) * x + c0, 2.0 * c2 * x + c1);
            // p, p' and p''/2.
            let value = (s2 * x + s1) * x + s0 - c * c;
            let first = 2.0 * (s2 * x - c * slope) + s1;
            let second = s2 - slope * slope - 2.0 * c * c2;
            if value > 0.0 || c <= 0.0 {
                low = x;
            } else {
                high = x;
            }
            // Halley's step p p' / (p'² − p p''/2) where it is at most twice Newton's, and where its products stay in range.
            let (square, bend) = (first * first, value * second);
            let curved = 2.0 * bend.abs() <= square && (TINY..HUGE).contains(&square);
            let step = if curved { value * first / (square - bend) } else { value / first };
            let next = x - step;
            // Halley's error becomes its cube, Newton's its square: the next one is below rounding.
            if step.abs() <= if curved { 5e-6 } else { 1e-8 } * x && c > 0.0 {
                x = next;
                break;
            }
            x = if next > low && next < high {
                next
            } else if high == f64::INFINITY {
                4.0 * x
            } else if low > 0.0 {
                (low * high).sqrt()
            } else {
                1e-2 * high
            };
            if high - low <= f64::EPSILON * low {
                break;
            }
        }
        self.impulse(x).map(|r| (r, x))
    }
}

/// The three-dimensional vector as the D-dimensional one that it is (D = 3).
#[inline(always)]
pub(super) fn embed<const D: usize>(r: [f64; 3]) -> [f64; D] {
    let mut out = [0.0; D];
    out.copy_from_slice(&r[..D]);
    out
}

#[cfg(test)]
mod tests {
    use nonsmooth_linalg::{Bsr, small};
    use nonsmooth_problem::check::Judged;
    use nonsmooth_problem::{FrictionLocal, LocalPoint};
    use proptest::prelude::*;

    use crate::contact::law::Coulomb;
    use crate::contact::law::cfun::Disk;
    use crate::contact::law::local::{Exact, LocalSolver, Newton, ProjectionIterated, Quartic};

    /// What the judge says of a local solver's answer to one contact.
    fn residual<const D: usize, L: LocalSolver<D>>(
        solver: &L,
        w: &[[f64; D]; D],
        q: &[f64; D],
        mu: f64,
    ) -> f64 {
        let mut memo = solver.prepare(w, Coulomb { mu });
        let r = solver.solve(&mut memo, w, q, Coulomb { mu }, &[0.0; D]);
        let w = Bsr::from_rows(1, &[vec![(0, *w)]]);
        let problem = FrictionLocal::new(w, q.to_vec(), vec![mu]).unwrap();
        let point = LocalPoint { r: r.to_vec(), lambda: vec![] };
        problem.judge(&point, 1e-12).map_or(f64::INFINITY, |v| v.measure.relative)
    }

    /// SPD blocks `AᵀA + shift` with a small skew part, of any scale.
    fn block<const D: usize>() -> impl Strategy<Value = [[f64; D]; D]> {
        let a = prop::array::uniform::<_, D>(prop::array::uniform::<_, D>(-1.0..1.0));
        (a, -3.0..3.0_f64, 0.01..0.3_f64).prop_map(|(a, scale, shift)| {
            let mut w = [[0.0; D]; D];
            for i in 0..D {
                for j in 0..D {
                    w[i][j] = (0..D).map(|k| a[k][i] * a[k][j]).sum::<f64>()
                        + 1e-3 * (a[i][j] - a[j][i])
                        + if i == j { shift } else { 0.0 };
                    w[i][j] *= 10.0_f64.powf(2.0 * scale);
                }
            }
            w
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        #[test]
        fn solves_every_contact_in_space(
            w in block::<3>(),
            q in prop::array::uniform3(-1.0..1.0_f64),
            mu in 0.01..1.5_f64,
        ) {
            let r = residual(&Exact, &w, &q, mu);
            prop_assert!(r < 1e-11, "exact {r:e}");
            let r = residual(&Quartic, &w, &q, mu);
            prop_assert!(r < 1e-9, "quartic {r:e}");
        }

        #[test]
        fn solves_every_contact_in_the_plane(
            w in block::<2>(),
            q in prop::array::uniform2(-1.0..1.0_f64),
            mu in 0.01..1.0_f64,
        ) {
            // Where mu |W_NT| > W_NN a solution need not exist (Painlevé).
            prop_assume!(mu * w[0][1].abs() < 0.9 * w[0][0]);
            let r = residual(&Exact, &w, &q, mu);
            prop_assert!(r < 1e-11, "{r:e}");
        }

        #[test]
        fn newton_agrees(
            w in block::<3>(),
            q in prop::array::uniform3(-1.0..1.0_f64),
            mu in 0.01..1.5_f64,
        ) {
            for disk in [Disk::AlartCurnier, Disk::JeanMoreau] {
                let r = residual(&Newton::new(disk), &w, &q, mu);
                prop_assert!(r < 1e-11, "{disk:?} {r:e}");
            }
        }
    }

    #[test]
    fn iterated_projection_solves_a_well_conditioned_contact() {
        let w = [[1.0, 0.1, -0.05], [0.1, 0.8, 0.02], [-0.05, 0.02, 1.2]];
        for q in [[-1.0, 0.1, 0.1], [-1.0, 2.0, -1.0], [1.0, 2.0, -1.0]] {
            assert!(
                residual(&ProjectionIterated { steps: 500, tolerance: 0.0 }, &w, &q, 0.4) < 1e-12
            );
        }
    }

    #[test]
    fn blocks_that_cannot_move_do_no_harm() {
        for w in [[[0.0; 3]; 3], [[1.0, 0.0, 0.0], [0.0; 3], [0.0; 3]]] {
            let mut memo = Exact.prepare(&w, Coulomb { mu: 0.5 });
            let r = Exact.solve(&mut memo, &w, &[-1.0, 0.5, 0.0], Coulomb { mu: 0.5 }, &[0.0; 3]);
            assert!(r.iter().all(|x| x.is_finite()), "{r:?}");
        }
        assert!(small::inverse(&[[0.0; 3]; 3]).is_none());
    }

    /// `W = Jᵀ J` with fewer rows than columns and a load that an impulse answers.
    #[test]
    fn singular_blocks_are_solved_to_rounding() {
        fn check<const D: usize>(rows: &[[f64; D]]) {
            let mut w = [[0.0; D]; D];
            for i in 0..D {
                for j in 0..D {
                    w[i][j] = rows.iter().map(|row| row[i] * row[j]).sum();
                }
            }
            for tangential in [0.0, 0.7, -0.4] {
                let mut impulse = [0.0; D];
                (impulse[0], impulse[1]) = (-1.6, tangential);
                let q = small::mul(&w, &impulse);
                for mu in [0.3, 1.0, 2.0] {
                    let found = [
                        residual(&Exact, &w, &q, mu),
                        residual(&Quartic, &w, &q, mu),
                        residual(&Newton::new(Disk::AlartCurnier), &w, &q, mu),
                    ];
                    assert!(found.iter().all(|r| *r < 1e-12), "{rows:?} {q:?} {mu}: {found:?}");
                }
            }
        }
        for row in [[2.0, -1.0], [1.0, -1.0], [1.0, 1.0], [1.0, 0.0]] {
            check(&[row]);
        }
        for row in [[2.0, -1.0, 0.0], [1.0, -1.0, 0.0], [3.0, 0.1, 0.7]] {
            check(&[row]);
        }
        check(&[[1.0, 1.0, 1.0], [0.0, 1.0, -1.0]]);
        check(&[[1.0, 2.0, 0.0], [0.0, 0.0, 1.0]]);
        check(&[[0.3, 0.7, 0.1], [0.9, -0.2, 0.6]]);
    }

    /// Contacts that once were answered wrongly, by origin.
    #[test]
    fn trophies() {
        // The bracket test compared infinities and ended the search at its first guess.
        let w = [[1.0, 0.2, 0.1], [0.2, 2.0, -0.3], [0.1, -0.3, 0.5]];
        for q in [[-1.0, 3.0, 0.5], [-0.1, 30.0, -0.5]] {
            assert!(residual(&Exact, &w, &q, 0.3) < 1e-12);
        }
        // From kaplaring-12-i000592-1462: a load of subnormal numbers, whose products underflow, gave NaN.
        let w = [
            [2.579172796803895, -0.9289108501326886, 1.0260699007046812],
            [-0.9289108501326886, 7.939394965104379, -0.10318262759041308],
            [1.0260699007046814, -0.10318262759041308, 11.182318943370722],
        ];
        let mut memo = Exact.prepare(&w, Coulomb { mu: 0.5 });
        let q = [-1e-323, 2.17e-322, -1.53e-322];
        let r = Exact.solve(&mut memo, &w, &q, Coulomb { mu: 0.5 }, &[5e-324, 0.0, 0.0]);
        assert!(r.iter().all(|x| x.is_finite()), "{r:?}");
    }
}

//! The exact solution of one frictional contact by cases and a bracketed one-parameter root.
//!
//! 1. **Open**: `q_N ≥ 0` ⇒ `r = 0`.
//! 2. **Stick**: `r = −W⁻¹ q`, accepted if it lies in K.
//! 3. **Slip**: `u_N = 0`, `u_T = −α r_T` with α > 0. Eliminating `r_N`, with the Schur complement
//!    `W̃ = W_TT − W_TN W_NT / W_NN`, `q̃ = q_T − W_TN q_N / W_NN`:
//!    `r_T(α) = −(W̃ + αI)⁻¹ q̃`, and `g(α) = ‖r_T(α)‖ − mu r_N(α)` has `g(0) > 0` (stick failed), `g(∞) < 0`.
//!    Multiplied by det(W̃ + αI) this is `‖A + α q̃‖ = c(α)`, c a parabola: one square root an evaluation. The root is found by
//!    Newton's method inside a bracket, from the α of the last visit.
//!
//! In the plane the direction of sliding is one of two, each a linear equation.
//! W may be nonsymmetric. Cost: 30 to 150 flops. Source: DBB11, section 4 (the polynomial behind it is in
//! [`Quartic`](super::Quartic)); JourdanAlartJean1998 for the block Gauss–Seidel that it serves.

use nonsmooth_problem::linalg::small::{mul, tangential_norm};

use super::{LocalSolver, inverse_or_regularised};

/// The exact local solver.
#[derive(Debug, Clone, Copy, Default)]
pub struct Exact;

/// The inverse of the block, and the sliding parameter of the last visit.
#[derive(Debug, Clone)]
pub struct ExactMemo<const D: usize> {
    inverse: Option<[[f64; D]; D]>,
    alpha: f64,
}

impl<const D: usize> LocalSolver<D> for Exact {
    type Memo = ExactMemo<D>;

    fn prepare(&self, w: &[[f64; D]; D], _mu: f64) -> ExactMemo<D> {
        ExactMemo {
            inverse: inverse_or_regularised(w),
            alpha: 0.0,
        }
    }

    #[inline(always)]
    fn solve(
        &self,
        memo: &mut ExactMemo<D>,
        w: &[[f64; D]; D],
        q: &[f64; D],
        mu: f64,
        r: &[f64; D],
    ) -> [f64; D] {
        if q[0] >= 0.0 {
            return [0.0; D];
        }
        let Some(inverse) = &memo.inverse else {
            return *r;
        };
        if let Some(stuck) = stick(inverse, q, mu) {
            return stuck;
        }
        let sliding = if D == 2 {
            slide_plane(w, q, mu)
        } else {
            Sliding::new(w, q, mu)
                .and_then(|s| s.root(memo.alpha))
                .map(|(r, alpha)| {
                    memo.alpha = alpha;
                    embed(r)
                })
        };
        sliding.unwrap_or(*r)
    }
}

/// `r = −W⁻¹ q` if it lies in K.
#[inline(always)]
pub(super) fn stick<const D: usize>(
    inverse: &[[f64; D]; D],
    q: &[f64; D],
    mu: f64,
) -> Option<[f64; D]> {
    let r = mul(inverse, q).map(|x| -x);
    (r[0] > 0.0 && tangential_norm(&r) <= mu * r[0]).then_some(r)
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

/// The sliding contact in space as the scalar equation `‖A + α q̃‖ = c(α)`.
pub(super) struct Sliding {
    /// Row N of the block over W_NN, q_N / W_NN.
    w01: f64,
    w02: f64,
    q0: f64,
    mu: f64,
    /// q̃ and A = adj(W̃) q̃.
    qt: [f64; 2],
    a: [f64; 2],
    /// tr W̃ and det W̃.
    trace: f64,
    det: f64,
    /// c(α) = c2 α² + c1 α + c0.
    c: [f64; 3],
}

impl Sliding {
    #[inline(always)]
    pub(super) fn new<const D: usize>(w: &[[f64; D]; D], q: &[f64; D], mu: f64) -> Option<Self> {
        let inv = 1.0 / w[0][0];
        if !(inv > 0.0 && inv.is_finite()) {
            return None;
        }
        let (w01, w02, q0) = (w[0][1] * inv, w[0][2] * inv, q[0] * inv);
        let a11 = w[1][1] - w[1][0] * w01;
        let a12 = w[1][2] - w[1][0] * w02;
        let a21 = w[2][1] - w[2][0] * w01;
        let a22 = w[2][2] - w[2][0] * w02;
        let qt = [q[1] - w[1][0] * q0, q[2] - w[2][0] * q0];
        let a = [a22 * qt[0] - a12 * qt[1], a11 * qt[1] - a21 * qt[0]];
        let (trace, det) = (a11 + a22, (a11 * a22 - a12 * a21).max(0.0));
        let c = [
            mu * (w01 * a[0] + w02 * a[1] - q0 * det),
            mu * (w01 * qt[0] + w02 * qt[1] - q0 * trace),
            -mu * q0,
        ];
        (trace > 0.0).then_some(Self {
            w01,
            w02,
            q0,
            mu,
            qt,
            a,
            trace,
            det,
            c,
        })
    }

    /// `‖A + α q̃‖²` as coefficients of 1, α, α².
    fn square(&self) -> [f64; 3] {
        let dot = |x: [f64; 2], y: [f64; 2]| x[0] * y[0] + x[1] * y[1];
        [
            dot(self.a, self.a),
            2.0 * dot(self.a, self.qt),
            dot(self.qt, self.qt),
        ]
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
        (p, self.trace)
    }

    /// c(α): the sign of r_N.
    pub(super) fn pressure(&self, alpha: f64) -> f64 {
        (self.c[2] * alpha + self.c[1]) * alpha + self.c[0]
    }

    /// The impulse that belongs to a root α, put on the cone exactly.
    #[inline(always)]
    pub(super) fn impulse(&self, alpha: f64) -> Option<[f64; 3]> {
        let inv = 1.0 / ((alpha + self.trace) * alpha + self.det);
        let t = [
            -(self.a[0] + alpha * self.qt[0]) * inv,
            -(self.a[1] + alpha * self.qt[1]) * inv,
        ];
        let n = -(self.q0 + self.w01 * t[0] + self.w02 * t[1]);
        let size = (t[0] * t[0] + t[1] * t[1]).sqrt();
        if !(n > 0.0 && n.is_finite() && size.is_finite()) {
            return None;
        }
        let onto = if size > 0.0 { self.mu * n / size } else { 0.0 };
        Some([n, onto * t[0], onto * t[1]])
    }

    /// The root of `‖A + α q̃‖ − c(α)` by safeguarded Newton from `guess`, and its impulse.
    #[inline(always)]
    pub(super) fn root(&self, guess: f64) -> Option<([f64; 3], f64)> {
        let [s0, s1, s2] = self.square();
        let [c0, c1, c2] = self.c;
        let eval = |x: f64| {
            let size = ((s2 * x + s1) * x + s0).max(0.0).sqrt();
            let value = size - ((c2 * x + c1) * x + c0);
            let slope = if size > 0.0 {
                (s2 * x + 0.5 * s1) / size
            } else {
                0.0
            } - (2.0 * c2 * x + c1);
            (value, slope, size)
        };
        // The root lies in (low, high); high is not known to be above it while infinite.
        let (mut low, mut high) = (0.0_f64, f64::INFINITY);
        let mut x = if guess > 0.0 { guess } else { self.trace };
        for _ in 0..100 {
            let (value, slope, size) = eval(x);
            if value > 0.0 {
                low = x;
            } else {
                high = x;
            }
            if value.abs() <= 4.0 * f64::EPSILON * size
                || (high < f64::INFINITY && high - low <= f64::EPSILON * high)
            {
                break;
            }
            let newton = x - value / slope;
            x = if newton > low && newton < high {
                if (newton - x).abs() <= f64::EPSILON * x {
                    break;
                }
                newton
            } else if high.is_infinite() {
                // NaN data must not loop for ever: 100 doublings are the most.
                4.0 * x
            } else if low > 0.0 {
                (low * high).sqrt()
            } else {
                1e-2 * high
            };
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

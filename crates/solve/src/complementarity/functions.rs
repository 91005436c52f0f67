//! Scalar complementarity functions (74a–f): `ψ(z, w) = 0` exactly where `0 ≤ z ⟂ w ≥ 0`.
//!
//! | lecture | here, positive where z and w are | type |
//! | --- | --- | --- |
//! | (74a) `min(w, z)` | the same | [`Min`] |
//! | (74b) `max(0, w − ρz) − w` | `min(w, ρz)` | [`MinRho`] with [`Side::Z`] |
//! | (74c) `max(0, z − ρw) − z` | `min(z, ρw)` | [`MinRho`] with [`Side::W`] |
//! | (74d) `√(w² + z²) − z − w` | `z + w − √(z² + w²)` | [`FischerBurmeister`] |
//! | (74e) `λ(√(w² + z²) − z − w) − (1 − λ) w₊ z₊` | its negative | [`Penalised`] |
//! | (74f) `−wz + ½ min(0, w + z)²` | its negative | [`EvtushenkoPurtov`] |
//!
//! The sign is that of the minimum throughout, so that a function nests in itself. Two bounds (Billups): `l ≤ z ≤ u` with `w ≥ 0` at l, `w ≤ 0` at u is
//!
//! ```text
//! Φ(z, w) = ψ(z − l, −ψ(u − z, −w)),   one bound: ψ(z − l, w), −ψ(u − z, −w),   none: w
//! ```
//!
//! Each comes with an element of its B-subdifferential: the derivative where there is one, at a kink the derivative of a piece that meets
//! there. All of them but Evtushenko's and Purtov's increase in z and in w: their derivatives are not negative.
//!
//! References: Acary2018 (74); Fischer1992; ChenChenKanzow2000; EvtushenkoPurtov1984; Billups1995 (two bounds).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::core::ranges::{positive, up_to};
use crate::core::register::Named;
use crate::core::settings::Settings;

/// The value of a function of (z, w) and its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slope {
    /// ψ.
    pub value: f64,
    /// ∂ψ/∂z.
    pub z: f64,
    /// ∂ψ/∂w.
    pub w: f64,
}

/// A complementarity function of two numbers.
pub trait ScalarFunction: Copy + Send + Sync {
    /// ψ(z, w) and an element of its B-subdifferential.
    fn at(&self, z: f64, w: f64) -> Slope;

    /// ψ(z, w).
    #[inline]
    fn value(&self, z: f64, w: f64) -> f64 {
        self.at(z, w).value
    }
}

/// A function that has a Newton method. The struct is its hyperparameters.
pub trait NewtonFunction: ScalarFunction + Settings + 'static {
    /// The function whose half square is the merit.
    type Merit: ScalarFunction + 'static;
    /// Whether steps on `min(z, w)` come first.
    const MINIMUM_FIRST: bool = false;
    /// What the registry says of the method that has this function: name, summary, citations.
    const METHOD: Named;

    /// The merit's function.
    fn merit(&self) -> Self::Merit;
}

/// `min(z, w)`: on the tie z counts as the smaller.
///
/// Newton's method on it is `newton_min`: `z_i = 0` where `z_i ≤ w_i`, `w_i = 0` elsewhere, solved for z. The plain method (a primal–dual active set) is finite where
/// M is an M-matrix, and cycles on some P-matrices (BenGharbiaGilbert2012): where its full steps stop helping, they must decrease the merit of Fischer's and
/// Burmeister's function (DeLucaFacchineiKanzow1996), and give way to that function's direction where they do not. Ends with the exact solution of the active set.
/// Fails: stationary points of the merit, where M is not P0.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Min {}

impl Settings for Min {}

impl NewtonFunction for Min {
    type Merit = FischerBurmeister;
    const MINIMUM_FIRST: bool = true;
    const METHOD: Named = Named {
        name: "newton_min",
        summary: "semismooth Newton on min(z, w), globalised by the Fischer-Burmeister merit",
        cites: &["Acary2018", "BenGharbiaGilbert2012", "DeLucaFacchineiKanzow1996"],
        variants: &["line_search=armijo"],
    };

    fn merit(&self) -> FischerBurmeister {
        FischerBurmeister {}
    }
}

impl ScalarFunction for Min {
    #[inline]
    fn at(&self, z: f64, w: f64) -> Slope {
        if z <= w { Slope { value: z, z: 1.0, w: 0.0 } } else { Slope { value: w, z: 0.0, w: 1.0 } }
    }
}

/// Which of the two is multiplied by rho.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// `min(w, rho z)`, lecture (74b).
    #[default]
    Z,
    /// `min(z, rho w)`, lecture (74c).
    W,
}

/// The minimum with one side multiplied by `ρ > 0`.
///
/// Newton's method on it is `newton_min_rho`: `z_i = 0` where `ρ z_i ≤ w_i` (or `z_i ≤ ρ w_i`), `w_i = 0` elsewhere, so ρ is a trade of the units of z and w: with the side `w`
/// it does what 1/ρ does with the side `z`. A step must decrease the merit of Fischer's and Burmeister's function of the arguments so multiplied.
/// Fails: as Newton's method on the minimum; where ρ is far from the ratio of w to z, the sets of the first steps are bad guesses.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct MinRho {
    /// The factor rho, positive; 1: the minimum itself.
    pub rho: f64,
    /// The argument of the minimum that rho multiplies.
    pub side: Side,
}

impl Default for MinRho {
    fn default() -> Self {
        Self { rho: 2.0, side: Side::Z }
    }
}

impl Settings for MinRho {
    fn validate(&self) -> Result<(), String> {
        positive("rho", self.rho)
    }
}

impl MinRho {
    /// Another function of the arguments as this one multiplies them.
    fn weigh<F: ScalarFunction>(&self, function: F) -> Weighted<F> {
        let (of_z, of_w) = match self.side {
            Side::Z => (self.rho, 1.0),
            Side::W => (1.0, self.rho),
        };
        Weighted { function, of_z, of_w }
    }
}

impl NewtonFunction for MinRho {
    type Merit = Weighted<FischerBurmeister>;
    const MINIMUM_FIRST: bool = true;
    const METHOD: Named = Named {
        name: "newton_min_rho",
        summary: "semismooth Newton on min(w, rho z) or min(z, rho w), globalised by the Fischer-Burmeister merit",
        cites: &["Acary2018", "DeLucaFacchineiKanzow1996"],
        variants: &["side=w"],
    };

    fn merit(&self) -> Self::Merit {
        self.weigh(FischerBurmeister {})
    }
}

impl ScalarFunction for MinRho {
    #[inline]
    fn at(&self, z: f64, w: f64) -> Slope {
        self.weigh(Min {}).at(z, w)
    }
}

/// `ψ(α z, β w)` with `α, β > 0`: of a complementarity function another one.
#[derive(Debug, Clone, Copy)]
pub struct Weighted<F> {
    function: F,
    of_z: f64,
    of_w: f64,
}

impl<F: ScalarFunction> ScalarFunction for Weighted<F> {
    #[inline]
    fn at(&self, z: f64, w: f64) -> Slope {
        let at = self.function.at(self.of_z * z, self.of_w * w);
        Slope { z: self.of_z * at.z, w: self.of_w * at.w, ..at }
    }
}

/// `z + w − √(z² + w²)`.
///
/// No digits are lost where the sum cancels with the root: for `z + w > 0` the value is `2zw / (z + w + √(z² + w²))`, and `1 − z/r` with `z > 0` is
/// `(w/r) (w/(r + z))`. At the origin the derivative along (1, 1) is taken.
///
/// Newton's method on it is `newton_fb` (Fischer1992; DeLucaFacchineiKanzow1996): its merit is differentiable and, for M of class P0, has no stationary point but
/// solutions; equalities in any number. Fails: stationary points of the merit, where M is not P0; merits that decrease forever, where there is no solution.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct FischerBurmeister {}

impl Settings for FischerBurmeister {}

impl NewtonFunction for FischerBurmeister {
    type Merit = Self;
    const METHOD: Named = Named {
        name: "newton_fb",
        summary: "semismooth Newton on the Fischer-Burmeister function; equalities in any number",
        cites: &["Acary2018", "Fischer1992", "DeLucaFacchineiKanzow1996"],
        variants: &["line_search=armijo"],
    };

    fn merit(&self) -> Self {
        *self
    }
}

impl ScalarFunction for FischerBurmeister {
    #[inline]
    fn at(&self, z: f64, w: f64) -> Slope {
        let r = z.hypot(w);
        if r == 0.0 {
            let slope = 1.0 - std::f64::consts::FRAC_1_SQRT_2;
            return Slope { value: 0.0, z: slope, w: slope };
        }
        let sum = z + w;
        let value = if sum > 0.0 { 2.0 * (z / (sum + r)) * w } else { sum - r };
        let one_minus = |x: f64, y: f64| {
            if x > 0.0 { (y / r) * (y / (r + x)) } else { 1.0 - x / r }
        };
        Slope { value, z: one_minus(z, w), w: one_minus(w, z) }
    }
}

/// `λ(z + w − √(z² + w²)) + (1 − λ) z₊ w₊`: grows in the positive quadrant, where Fischer's and Burmeister's function is flat.
///
/// Newton's method on it is `newton_pfb` (ChenChenKanzow2000). Where z and w are both large and positive the function sees it, which Fischer's and Burmeister's hardly
/// does; its level sets are bounded for more matrices. Fails: as Newton's method on Fischer's and Burmeister's function.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Penalised {
    /// The weight of the Fischer-Burmeister function, in (0, 1]; the rest is the penalty's.
    pub lambda: f64,
}

impl Default for Penalised {
    fn default() -> Self {
        Self { lambda: 0.8 }
    }
}

impl Settings for Penalised {
    fn validate(&self) -> Result<(), String> {
        up_to("lambda", self.lambda, 1.0)
    }
}

impl NewtonFunction for Penalised {
    type Merit = Self;
    const METHOD: Named = Named {
        name: "newton_pfb",
        summary: "semismooth Newton on the penalised Fischer-Burmeister function",
        cites: &["Acary2018", "ChenChenKanzow2000"],
        variants: &["lambda=0.95"],
    };

    fn merit(&self) -> Self {
        *self
    }
}

impl ScalarFunction for Penalised {
    #[inline]
    fn at(&self, z: f64, w: f64) -> Slope {
        let fb = FischerBurmeister {}.at(z, w);
        let (lambda, rest) = (self.lambda, 1.0 - self.lambda);
        // On the axes the derivative is taken from within the quadrant.
        let (z_plus, w_plus) = if z >= 0.0 && w >= 0.0 { (z, w) } else { (0.0, 0.0) };
        Slope {
            value: lambda * fb.value + rest * z_plus * w_plus,
            z: lambda * fb.z + rest * w_plus,
            w: lambda * fb.w + rest * z_plus,
        }
    }
}

/// `zw − ½ min(0, z + w)²`: differentiable everywhere, but its derivative vanishes at (0, 0).
///
/// Newton's method on it is `newton_ep`, smooth where F is. Between two bounds it nests as the others do, since it has the sign of w where z is positive. Fails: at degenerate solutions
/// the Jacobian is singular and the method slow; it does not increase in z and w where their sum is negative, so its merit has more stationary points than that of Fischer and Burmeister.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct EvtushenkoPurtov {}

impl Settings for EvtushenkoPurtov {}

impl NewtonFunction for EvtushenkoPurtov {
    type Merit = Self;
    const METHOD: Named = Named {
        name: "newton_ep",
        summary: "Newton on the function of Evtushenko and Purtov, which is differentiable",
        cites: &["Acary2018", "EvtushenkoPurtov1984"],
        variants: &["line_search=armijo"],
    };

    fn merit(&self) -> Self {
        *self
    }
}

impl ScalarFunction for EvtushenkoPurtov {
    #[inline]
    fn at(&self, z: f64, w: f64) -> Slope {
        let below = (z + w).min(0.0);
        Slope { value: z * w - 0.5 * below * below, z: w - below, w: z - below }
    }
}

/// Φ for a variable z in `[l, u]` with its w: nested where both bounds are finite.
#[inline]
pub fn boxed<F: ScalarFunction>(f: &F, z: f64, w: f64, l: f64, u: f64) -> Slope {
    match (l.is_finite(), u.is_finite()) {
        (false, false) => Slope { value: w, z: 0.0, w: 1.0 },
        (true, false) => f.at(z - l, w),
        (false, true) => {
            let at = f.at(u - z, -w);
            Slope { value: -at.value, ..at }
        }
        (true, true) if l == u => Slope { value: z - l, z: 1.0, w: 0.0 },
        (true, true) => {
            let upper = f.at(u - z, -w);
            let at = f.at(z - l, -upper.value);
            Slope { value: at.value, z: at.z + at.w * upper.z, w: at.w * upper.w }
        }
    }
}

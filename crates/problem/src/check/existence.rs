//! Whether a problem has a solution, as far as the motions that it admits tell: the criterion, its certificates, and
//! their verification from the data alone.
//!
//! With `x = v` (global) or `x = (r', λ')` (local) the motions of the contacts are `u = A x + c`, `0 = E x + e`.
//!
//! - **Existence.** If some x has `u ∈ int K*` at every contact, `K* = {mu‖u_T‖ ≤ u_N}`, and the dynamics is monotone (M,
//!   or W with its bilateral rows, has a positive semidefinite symmetric part), a solution exists. For fixed s ≥ 0 let
//!   v(s) solve the convex problem with `u + mu s e_N ∈ K*`; x is feasible for all of them, so v(s) is bounded
//!   independently of s, the map `s → ‖u_T(s)‖` takes a ball into itself, and its fixed point (Brouwer) with the
//!   multipliers (Slater's condition) is a solution. Where K* is a polyhedron (D = 2, or mu = 0) multipliers need no interior: `u ∈ K*` is
//!   enough there.
//! - **The criterion fails** exactly where impulses `r ∈ K`, `r ≠ 0` feel no motion, `(r, λ)ᵀ [A; E] = 0`, and have no
//!   positive power, `cᵀ r + eᵀ λ ≤ 0`. That says nothing of the problem itself: a solution has `ũ ∈ K*`, not `u ∈ K*`, and
//!   `rᵀ u ≥ −Σ mu r_N ‖u_T‖` may be negative while bodies slide.
//! - **No solution.** Every solution has `u_N ≥ 0`. Normal impulses (`r_N ≥ 0`, `r_T = 0`) that feel no motion and have negative
//!   power contradict that, whatever the friction ([`Impulses`]).
//!
//! References: AcaryCadouxLemarechalMalick2011; KlarbringPang1998.

use serde::Serialize;

use super::proof::{Equation, exact, negative, satisfying};
use super::{Certificate, Exact, ExactVector, Impulses, Law, Monotone, Proof, rounded};
use crate::{Coulomb, Problem, Rolling};
use nonsmooth_linalg::small;
use nonsmooth_linalg::{Compensated, Csc, norm};

/// What is known of the existence of a solution. *Proved* is what holds in exact arithmetic on the stored doubles; what holds up to rounding is *nearly* so.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "verdict", rename_all = "snake_case")]
pub enum Existence {
    /// A solution exists: the criterion holds, with a motion and a monotony that are proved.
    Proved {
        /// `v` of a global problem; the impulses and multipliers `(r', λ')` of a local one, which need not obey any law.
        motion: ExactVector,
        /// The least of `(u_N − mu‖u_T‖)` over the size of the terms of u, over all contacts: a pure number. Zero is
        /// enough at contacts whose K* is a polyhedron.
        margin: f64,
    },
    /// A solution exists: here it is, exactly.
    #[serde(rename = "proved")]
    Solved {
        /// The coefficients of the columns of the problem's [`crate::check::ConeSystem`].
        coefficients: ExactVector,
        /// Whether it passes the check when it is rounded to doubles, at 1e-8. Data that are rounded may have a solution where those that were meant have none: a huge one.
        representable: bool,
    },
    /// A solution exists for every right-hand side q.
    #[serde(rename = "proved")]
    EveryQ {
        /// Why, in words: a theorem on the class of the matrix, or on the bounds.
        because: String,
    },
    /// A point passes the check: a solution of a problem whose rows differ by its relative residual, which may be more than rounding. (`exp(-x) = 0` has such points and no solution.)
    #[serde(rename = "nearly_proved")]
    NearlySolved {
        /// Its relative residual.
        relative: f64,
    },
    /// The criterion holds up to rounding.
    NearlyProved {
        /// As above, in doubles.
        motion: Vec<f64>,
        /// The margin of [`Self::Proved`], in doubles.
        margin: f64,
        /// What has to be added to the diagonal of M or W, in units of each entry, for the dynamics to be monotone: rounding at most,
        /// or the digits with which W was stored. Zero where only the motion is not exact.
        shift: f64,
    },
    /// The criterion holds at most weakly: motions may touch K*, but impulses keep them out of its interior, up to rounding.
    /// A solution may or may not exist.
    Weak {
        /// `r ∈ K` that feels no motion and has no power.
        ray: Impulses,
    },
    /// The criterion does not hold, by impulses, up to rounding. A solution may or may not exist.
    CriterionRefuted {
        /// `r ∈ K` that feels no motion and has negative power.
        ray: Impulses,
    },
    /// There is no solution: proved.
    NoSolution {
        /// Normal impulses that feel no motion and have negative power (then there is none whatever the friction), or vectors that separate all cases.
        proof: Proof,
    },
    /// There is no solution, up to rounding.
    NearlyNoSolution {
        /// Normal impulses that nearly feel no motion and have negative power, or vectors that nearly close all cases.
        certificate: Certificate,
        /// The relative change of the data that would make it true.
        change: f64,
    },
    /// Nothing could be verified.
    Unknown {
        /// Why.
        why: String,
    },
}

impl Existence {
    /// The verdict's name: `proved`, `nearly_proved`, `weak`, `criterion_refuted`, `no_solution`, `nearly_no_solution`, `unknown`.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Proved { .. } | Self::Solved { .. } | Self::EveryQ { .. } => "proved",
            Self::NearlyProved { .. } | Self::NearlySolved { .. } => "nearly_proved",
            Self::Weak { .. } => "weak",
            Self::CriterionRefuted { .. } => "criterion_refuted",
            Self::NoSolution { .. } => "no_solution",
            Self::NearlyNoSolution { .. } => "nearly_no_solution",
            Self::Unknown { .. } => "unknown",
        }
    }

    /// Whether a solution is proved to exist.
    pub fn is_proved(&self) -> bool {
        matches!(self, Self::Proved { .. } | Self::Solved { .. } | Self::EveryQ { .. })
    }

    /// What a motion that meets the criterion, by this margin, proves of the problem.
    pub fn by_motion<P: Kinematic<D>, const D: usize>(
        problem: &P,
        kinematics: &Kinematics<D>,
        motion: Vec<f64>,
        margin: f64,
    ) -> Self {
        let exact = kinematics.exact_motion(&motion);
        match (problem.monotone(), exact) {
            (Monotone::Proved { .. }, Some((motion, margin))) => Self::Proved { motion, margin },
            (Monotone::Proved { .. }, None) => Self::NearlyProved { motion, margin, shift: 0.0 },
            (Monotone::Nearly { shift }, _) => {
                // A shift of W moves u by as much, unless nothing moves.
                if margin >= SHIFTED * shift || motion.iter().all(|&x| x == 0.0) {
                    return Self::NearlyProved { motion, margin, shift };
                }
                Self::Unknown { why: "the criterion holds, but by less than W is indefinite".into() }
            }
            (Monotone::Unknown, _) => Self::Unknown {
                why: "the criterion holds, but its theorem asks for more: M, or W on its range, is not positive definite".into(),
            },
        }
    }
}

/// The margin must exceed the shift that makes W semidefinite by this factor.
const SHIFTED: f64 = 10.0;

impl std::fmt::Display for Existence {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let cone = "a motion keeps all contacts in the dual cone";
        match self {
            Self::Proved { margin, .. } => {
                write!(f, "proved: {cone} (relative margin {margin:.1e})")
            }
            Self::Solved { representable: true, .. } => {
                f.write_str("proved: an exact solution is known")
            }
            Self::Solved { representable: false, .. } => f.write_str(
                "proved: an exact solution is known, but no double holds it: rounded, it fails the check",
            ),
            Self::EveryQ { because } => write!(f, "proved: {because}"),
            Self::NearlySolved { relative } => {
                write!(f, "nearly proved: a point passes the check (relative residual {relative:.1e})")
            }
            Self::NearlyProved { margin, shift, .. } => {
                write!(f, "nearly proved: {cone} (relative margin {margin:.1e}), up to rounding only")?;
                match shift {
                    0.0 => f.write_str(": the motion meets the bilateral constraints nearly"),
                    _ => write!(
                        f,
                        ": W is positive semidefinite for data that differ by {shift:.0e} of its diagonal"
                    ),
                }
            }
            Self::Weak { .. } => f.write_str(
                "not known: motions reach the dual cone at most at its boundary (up to rounding), which is not enough",
            ),
            Self::CriterionRefuted { .. } => f.write_str(
                "not known: no motion keeps all contacts in the dual cone (up to rounding); sliding may still make a solution",
            ),
            Self::NoSolution { proof } => match proof.certificate().impulses() {
                Some(_) => f.write_str(
                    "none, proved: normal impulses that no motion feels show that bodies are forced into each other, whatever the friction",
                ),
                None => write!(f, "none, proved: {proof}"),
            },
            Self::NearlyNoSolution { certificate, change } => {
                let what = match certificate {
                    Certificate::Impulses(_) => {
                        "normal impulses that hardly feel any motion force bodies into each other"
                    }
                    Certificate::Separating { vectors } if vectors.len() > 1 => {
                        "vectors contradict all cases, up to rounding"
                    }
                    _ => "a vector separates all cases up to rounding",
                };
                write!(
                    f,
                    "not known, nearly none: {what}; a relative change of the data by {change:.0e} would prove it"
                )
            }
            Self::Unknown { why } => write!(f, "not known: {why}"),
        }
    }
}

/// A problem that can say which motions it admits.
pub trait Kinematic<const D: usize>: Problem {
    /// The motions `u = A x + c`, `0 = E x + e`. Cost: a copy of H and G, or of W, V and R.
    fn kinematics(&self) -> Kinematics<D>;

    /// The x of a point: v, or the impulses and multipliers.
    fn motion(point: &Self::Point) -> Vec<f64>;

    /// Whether the dynamics are monotone as the theorem asks: the symmetric part of M positive definite, or that of `[W, V; Vᵀ, R]`
    /// semidefinite with its kernel in that of the matrix. Cost: a few sparse Cholesky factorisations.
    fn monotone(&self) -> Monotone;
}

/// The relative rounding that "equals zero" forgives.
const ZERO: f64 = 1e-10;
/// The relative margin by which a power must be negative.
const NEGATIVE: f64 = 1e-8;
/// Solutions that move so many times faster than the data say are not excluded by a certificate that holds up to rounding.
const REACH: f64 = 1e4;
/// What is forgiven where impulses should be in a cone.
const INSIDE: f64 = 1e-14;
/// The relative margin that no sum of fewer than 10⁷ terms in doubled precision, rounded a few times, can be mistaken about.
const SURE: f64 = 1e-13;
/// Rational operations that making a motion exact may cost.
const REPAIR: usize = 200_000;
/// The uncertainty of each number of the data, and of what is made of them.
const UNCERTAINTY: f64 = 64.0 * f64::EPSILON;

/// The motions of the contacts, `u = A x + c`, `0 = E x + e`; see the [module](self::super).
#[derive(Debug, Clone, PartialEq)]
pub struct Kinematics<const D: usize> {
    /// `[A; E]` by rows, stored as its transpose: column i holds row i.
    pub rows: Csc,
    /// `[c; e]`.
    pub constant: Vec<f64>,
    /// The coefficients of friction.
    pub mu: Vec<f64>,
    /// The coefficients of rolling friction, or empty.
    pub mu_r: Vec<f64>,
    /// The relative uncertainty of `[A; E]`.
    pub noise: f64,
}

impl<const D: usize> Kinematics<D> {
    pub(crate) fn new(
        entries: &[(usize, usize, f64)],
        columns: usize,
        constant: Vec<f64>,
        (mu, mu_r): (&[f64], &[f64]),
        noise: f64,
    ) -> Self {
        let transposed = entries.iter().map(|&(i, j, x)| (j, i, x));
        let rows = Csc::from_triplets(columns, constant.len(), transposed).expect("in range");
        let (mu, mu_r) = (mu.to_vec(), mu_r.to_vec());
        Self { rows, constant, mu, mu_r, noise: noise.max(UNCERTAINTY) }
    }

    /// The number of components of u.
    pub fn contact_rows(&self) -> usize {
        D * self.mu.len()
    }

    /// The coefficients of the disks of contact c: of friction, and of rolling friction if there is any.
    pub fn coefficients(&self, c: usize) -> impl Iterator<Item = f64> + Clone + use<'_, D> {
        std::iter::once(self.mu[c]).chain(self.mu_r.get(c).copied())
    }

    /// The coefficient of the disk that row k ≥ 1 of contact c is of.
    pub fn coefficient(&self, c: usize, k: usize) -> f64 {
        match self.mu_r.get(c) {
            Some(&mu_r) if k > (D - 1) / 2 => mu_r,
            _ => self.mu[c],
        }
    }

    /// The components of u in each disk of contact c, with the disk's coefficient.
    fn disks<'a, T>(&'a self, c: usize, u: &'a [T; D]) -> impl Iterator<Item = (f64, &'a [T])> {
        let rows = if self.mu_r.is_empty() { D - 1 } else { (D - 1) / 2 };
        self.coefficients(c).zip(u[1..].chunks(rows))
    }

    /// `u_N − mu‖u_T‖ − mu_r‖u_R‖`.
    fn gap(&self, c: usize, u: &[f64; D]) -> f64 {
        self.disks(c, u).fold(u[0], |gap, (mu, part)| gap - mu * norm(part))
    }

    /// Whether K* of contact c is a polyhedron.
    fn is_polyhedral(&self, c: usize) -> bool {
        D == 2 || self.coefficients(c).all(|mu| mu == 0.0)
    }

    /// Row i of `[A x + c; E x + e]` in doubled precision, and the size of its terms.
    fn row(&self, i: usize, x: &[f64]) -> (f64, f64) {
        let mut sum = Compensated::from(self.constant[i]);
        let mut size = self.constant[i].abs();
        let (columns, values) = self.rows.column(i);
        for (&j, &a) in columns.iter().zip(values) {
            sum.add_product(a, x[j]);
            size += (a * x[j]).abs();
        }
        (sum.value(), size)
    }

    /// The relative margin by which the motion x meets the criterion, if it does; see [`Existence::Proved`].
    ///
    /// u is computed in doubled precision. The margin of each contact must exceed what relative errors of the data of `64 ε` (or, for a
    /// local problem, of W's own asymmetry) can change, so that a huge x proves nothing. Scaling all velocities, all
    /// impulses or any unknown changes nothing.
    pub fn margin(&self, x: &[f64]) -> Option<f64> {
        if x.len() != self.rows.nrows() || x.iter().any(|x| !x.is_finite()) {
            return None;
        }
        let m = self.contact_rows();
        for i in m..self.constant.len() {
            let (left, size) = self.row(i, x);
            if left.abs() > ZERO * size {
                return None;
            }
        }
        let constrained = self.constant.len() > m;
        let still = x.iter().all(|&x| x == 0.0);
        let mut least = f64::INFINITY;
        for c in 0..self.mu.len() {
            let mut u = [0.0; D];
            let mut size = 0.0;
            for k in 0..D {
                let (value, terms) = self.row(D * c + k, x);
                u[k] = value;
                size += if k == 0 { terms } else { self.coefficient(c, k) * terms };
            }
            let gap = self.gap(c, &u);
            // Multipliers of a polyhedron need no interior; without motion u is the data themselves.
            let polyhedral = self.is_polyhedral(c);
            if polyhedral && still && gap >= 0.0 {
                least = least.min(if size > 0.0 { gap / size } else { 0.0 });
                continue;
            }
            let uncertain = if constrained { self.noise.max(10.0 * ZERO) } else { self.noise };
            let certain = gap > uncertain * size;
            if !certain {
                return None;
            }
            least = least.min(gap / size);
        }
        Some(least)
    }

    /// The motion with its constraints satisfied exactly, and the relative margin by which it then meets the criterion, if it does, in exact
    /// arithmetic: `u ∈ int K*`, or `u ∈ K*` at contacts whose K* is a polyhedron.
    pub fn exact_motion(&self, x: &[f64]) -> Option<(ExactVector, f64)> {
        if x.len() != self.rows.nrows() || x.iter().any(|x| !x.is_finite()) {
            return None;
        }
        let m = self.contact_rows();
        let terms = |i: usize| {
            let (columns, values) = self.rows.column(i);
            columns.iter().zip(values).map(|(&j, &a)| (j, exact(a))).collect()
        };
        let equations = (m..self.constant.len())
            .map(|i| Equation { terms: terms(i), constant: exact(self.constant[i]) });
        let given: Vec<Exact> = x.iter().map(|&x| exact(x)).collect();
        let largest = x.iter().fold(0.0_f64, |l, x| l.max(x.abs())).max(1.0);
        // Unknowns that are not used are the last to be moved.
        let weights: Vec<f64> = x.iter().map(|x| x.abs().max(1e-3 * largest)).collect();
        let x = ExactVector(satisfying(equations.collect(), &given, &weights, REPAIR)?);
        let margin = self.exact_margin(&x)?;
        Some((x, margin))
    }

    /// The relative margin by which a motion meets the criterion, if it does, in exact arithmetic.
    pub fn exact_margin(&self, ExactVector(x): &ExactVector) -> Option<f64> {
        let m = self.contact_rows();
        if x.len() != self.rows.nrows() {
            return None;
        }
        let row = |i: usize| {
            let (columns, values) = self.rows.column(i);
            let terms = columns.iter().zip(values).map(|(&j, &a)| exact(a) * &x[j]);
            terms.fold(exact(self.constant[i]), |sum, term| sum + term)
        };
        if !(m..self.constant.len()).all(|i| row(i).is_zero()) {
            return None;
        }
        let mut least = f64::INFINITY;
        let near: Vec<f64> = x.iter().map(rounded).collect();
        let doubles = near.iter().zip(x).all(|(near, x)| exact(*near) == *x);
        for c in 0..self.mu.len() {
            // A margin beyond all rounding of doubled precision needs no closer look where x is made of doubles.
            if doubles {
                let rows: [(f64, f64); D] = std::array::from_fn(|k| self.row(D * c + k, &near));
                let of = |k: usize| self.coefficient(c, k) * rows[k].1;
                let size = rows[0].1 + (1..D).map(of).sum::<f64>();
                let gap = self.gap(c, &rows.map(|r| r.0));
                if gap > SURE * size && size.is_finite() {
                    least = least.min(gap / size);
                    continue;
                }
            }
            let u: [Exact; D] = std::array::from_fn(|k| row(D * c + k));
            // The squares of mu‖u_T‖ and mu_r‖u_R‖.
            let squares = self.disks(c, &u).map(|(mu, part)| {
                let square = part.iter().fold(Exact::ZERO, |sum, t| sum + t * t);
                exact(mu) * exact(mu) * square
            });
            let squares: Vec<Exact> = squares.collect();
            let gap = squares.iter().fold(&u[0] * &u[0], |gap, square| gap - square);
            // u_N² > (a + b)² where u_N² − a² − b² > 0 and its square exceeds (2ab)²: no root is taken.
            let crossed = match &squares[..] {
                [a, b] => &gap * &gap - exact(4.0) * a * b,
                _ => gap.clone(),
            };
            let inside = !negative(&u[0]) && !negative(&gap) && !negative(&crossed);
            let touches = u[0].is_zero() || gap.is_zero() || crossed.is_zero();
            if !inside || (!self.is_polyhedral(c) && touches) {
                return None;
            }
            let normal = rounded(&u[0]);
            let sliding: f64 = squares.iter().map(|square| rounded(square).sqrt()).sum();
            let gap = normal - sliding;
            let size = self.row(D * c, &near).1 + sliding;
            least = least.min(if size > 0.0 { (gap / size).max(0.0) } else { 0.0 });
        }
        Some(least)
    }

    /// Whether `ray` proves, up to rounding, that no motion has `u ∈ K*` at every contact.
    pub fn refutes_criterion(&self, ray: &Impulses) -> bool {
        self.felt(ray, true).is_some_and(|felt| self.power(ray).is_negative(felt))
    }

    /// Whether `ray` proves, up to rounding, that no motion has `u ∈ int K*` at every contact.
    pub fn refutes_interior(&self, ray: &Impulses) -> bool {
        let power = self.power(ray);
        let some = ray.r.iter().any(|&r| r != 0.0);
        some && self.felt(ray, true).is_some() && power.sum <= NEGATIVE * power.size
    }

    /// Whether `certificate` proves, up to rounding, that no motion has `u_N ≥ 0` at every contact, and so that there is no solution.
    pub fn refutes(&self, certificate: &Impulses) -> bool {
        let felt = self.felt(certificate, false);
        felt.is_some_and(|felt| self.power(certificate).is_negative(felt))
    }

    /// Where `r ∈ K`, without friction `r_N ≥ 0` and nothing else, and `(r, λ)ᵀ [A; E] = 0` up to rounding: the power that the rest of these products
    /// can still have, with motions that are [`REACH`] times as fast as the largest velocity given.
    fn felt(&self, ray: &Impulses, friction: bool) -> Option<f64> {
        let (r, lambda) = (&ray.r, &ray.lambda);
        let m = self.contact_rows();
        let scale = norm(r);
        let shaped = r.len() == m && m + lambda.len() == self.constant.len();
        if !shaped || !scale.is_finite() || !norm(lambda).is_finite() {
            return None;
        }
        let inside = |c: usize| {
            let r = small::block::<D>(r, c);
            let outside = match (friction, self.mu_r.get(c)) {
                (false, _) => Coulomb { mu: 0.0 }.distance_to_cone(&r),
                (true, None) => Coulomb { mu: self.mu[c] }.distance_to_cone(&r),
                (true, Some(&mu_r)) => Rolling { mu: self.mu[c], mu_r }.distance_to_cone(&r),
            };
            outside <= INSIDE * scale
        };
        if !(0..self.mu.len()).all(inside) {
            return None;
        }
        // Contacts are all in m/s; each equation is in units of its own largest entry.
        let row_unit = |i: usize| {
            let values = self.rows.column(i).1.iter();
            let largest = if i < m { 0.0 } else { values.fold(0.0_f64, |l, a| l.max(a.abs())) };
            if largest > 0.0 { largest } else { 1.0 }
        };
        let n = self.rows.nrows();
        let (mut sums, mut sizes) = (vec![Compensated::default(); n], vec![0.0; n]);
        let mut units = vec![0.0_f64; n];
        let mut fastest = 0.0_f64;
        for (i, constant) in self.constant.iter().enumerate() {
            let y = if i < m { r[i] } else { lambda[i - m] };
            let unit = row_unit(i);
            fastest = fastest.max(constant.abs() / unit);
            let (columns, values) = self.rows.column(i);
            for (&j, &a) in columns.iter().zip(values) {
                sums[j].add_product(a, y);
                sizes[j] += (a * y).abs();
                units[j] = units[j].max(a.abs() / unit);
            }
        }
        let in_units = |x: f64, j: usize| if units[j] > 0.0 { x / units[j] } else { 0.0 };
        let left: Vec<_> = (0..n).map(|j| in_units(sums[j].value(), j)).collect();
        let size: Vec<_> = (0..n).map(|j| in_units(sizes[j], j)).collect();
        let vanishes = norm(&left) <= ZERO.max(self.noise) * norm(&size);
        vanishes.then(|| REACH * fastest * left.iter().map(|x| x.abs()).sum::<f64>())
    }

    /// `cᵀ r + eᵀ λ`.
    fn power(&self, ray: &Impulses) -> Power {
        let mut sum = Compensated::default();
        let mut size = 0.0;
        for (y, c) in ray.r.iter().chain(&ray.lambda).zip(&self.constant) {
            sum.add_product(*y, *c);
            size += (y * c).abs();
        }
        Power { sum: sum.value(), size }
    }
}

/// A sum of products and of their sizes.
struct Power {
    sum: f64,
    size: f64,
}

impl Power {
    /// Negative beyond its own rounding and beyond what is `felt` of the motion.
    fn is_negative(&self, felt: f64) -> bool {
        self.sum < -(NEGATIVE * self.size).max(felt)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planted::Planted;
    use crate::{FrictionGlobal, FrictionLocal, RowsGlobal, RowsLocal};
    use nonsmooth_linalg::Bsr;

    /// One body of unit mass in space that touches planes with the normals given.
    fn touching(normals: &[[f64; 3]], w: &[f64], mu: f64) -> FrictionGlobal<3> {
        let mut h = vec![];
        for (c, n) in normals.iter().enumerate() {
            // Any two unit vectors orthogonal to n and each other.
            let helper = if n[0].abs() < 0.9 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
            let cross = |a: &[f64; 3], b: &[f64; 3]| {
                [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
            };
            let t = cross(n, &helper);
            let size = norm(&t);
            let t = t.map(|x| x / size);
            let axes = [*n, t, cross(n, &t)];
            for (k, axis) in axes.iter().enumerate() {
                h.extend((0..3).map(|i| (i, 3 * c + k, axis[i])));
            }
        }
        let h = Csc::from_triplets(3, 3 * normals.len(), h.into_iter()).unwrap();
        let mu = vec![mu; normals.len()];
        FrictionGlobal::new(Csc::diagonal(&[1.0; 3]), h, vec![0.0; 3], w.to_vec(), mu).unwrap()
    }

    const UP: [f64; 3] = [0.0, 0.0, 1.0];
    const DOWN: [f64; 3] = [0.0, 0.0, -1.0];

    #[test]
    fn a_body_on_a_floor_can_leave_it() {
        let p = touching(&[UP], &[-1.0, 0.3, 0.0], 0.5);
        let k = p.kinematics();
        assert_eq!(p.monotone(), Monotone::Proved { definite: true });
        assert_eq!(k.margin(&[0.0, 0.0, 0.5]), None);
        let margin = k.margin(&[0.0, 0.0, 2.0]).unwrap();
        assert!((0.1..1.0).contains(&margin), "{margin}");
        // A huge motion whose tangential part cannot be told from rounding proves nothing.
        assert_eq!(k.margin(&[1e20, 0.0, 2.0]), None);
        assert_eq!(k.margin(&[0.0; 2]), None);
        assert_eq!(k.margin(&[0.0, 0.0, f64::NAN]), None);
    }

    #[test]
    fn where_the_dual_cone_is_a_polyhedron_its_boundary_is_enough() {
        let closed = |mu| touching(&[UP, DOWN], &[0.0; 6], mu).kinematics();
        assert_eq!(closed(0.0).margin(&[0.0; 3]), Some(0.0));
        assert_eq!(closed(0.5).margin(&[0.0; 3]), None);
        let ray = Impulses { r: vec![1.0, 0.0, 0.0, 1.0, 0.0, 0.0], lambda: vec![] };
        assert!(closed(0.5).refutes_interior(&ray) && !closed(0.5).refutes_criterion(&ray));
    }

    #[test]
    fn certificates_do_not_depend_on_units() {
        let p = touching(&[UP, DOWN], &[-1.0, 0.0, 0.0, 0.2, 0.1, 0.0], 0.4);
        for unit in [1e-6, 1.0, 1e6] {
            // Velocities in another unit, then one degree of freedom in another unit.
            let mut scaled = p.clone();
            scaled.w.iter_mut().for_each(|w| *w *= unit);
            let h = scaled.H.triplets().map(|(i, j, x)| (i, j, if i == 2 { x * unit } else { x }));
            scaled.H = Csc::from_triplets(3, 6, h).unwrap();
            let k = scaled.kinematics();
            for (size, proves) in [([1.0, 1.0], true), ([1.0, 1.001], false)] {
                let r = vec![size[0], 0.0, 0.0, size[1], 0.0, 0.0];
                let ray = Impulses { r, lambda: vec![] };
                assert_eq!((k.refutes(&ray), k.refutes_criterion(&ray)), (proves, proves));
            }
            let floor = touching(&[UP], &[-unit, 0.3 * unit, 0.0], 0.5).kinematics();
            let margin = floor.margin(&[0.0, 0.0, 2.0 * unit]).unwrap();
            assert!((margin - 0.85 / 3.15).abs() < 1e-12, "{margin} at {unit:e}");
        }
    }

    #[test]
    fn tangential_impulses_refute_the_criterion_but_not_the_problem() {
        // A wedge whose walls are closer to upright than the friction cone is wide.
        let (s, c) = (0.2_f64.sin(), 0.2_f64.cos());
        let p = touching(&[[c, 0.0, s], [-c, 0.0, s]], &[0.0; 6], 0.5);
        // Along the line between the contacts the impulses balance: in each frame (N, T).
        let along = |c: usize, d: [f64; 3]| -> Vec<f64> {
            (0..3).map(|k| (0..3).map(|i| p.H.get(i, 3 * c + k) * d[i]).sum()).collect()
        };
        let r = [along(0, [1.0, 0.0, 0.0]), along(1, [-1.0, 0.0, 0.0])].concat();
        let ray = Impulses { r: r.clone(), lambda: vec![] };
        let mut squeezed = p.clone();
        squeezed.w = r.iter().map(|r| -0.1 * r).collect();
        let k = squeezed.kinematics();
        assert!(k.refutes_criterion(&ray) && !k.refutes(&ray));
        // With less friction the same impulses are outside of K.
        squeezed.mu = vec![0.1; 2];
        assert!(!squeezed.kinematics().refutes_criterion(&ray));
    }

    #[test]
    fn a_local_problem_admits_the_motions_of_its_global_one() {
        for (bilateral, skew) in [(0, 0.0), (0, 0.1), (3, 0.0)] {
            let case = Planted { contacts: 4, dofs: 18, bilateral, skew, ..Planted::default() };
            let (local, point) = case.local::<3>();
            assert_ne!(local.monotone(), Monotone::Unknown);
            let k = local.kinematics();
            let x = FrictionLocal::<3>::motion(&point);
            let u = local.partner(&point);
            assert!((0..12).all(|i| (k.row(i, &x).0 - u[i]).abs() < 1e-12));
            assert!((12..12 + bilateral).all(|i| k.row(i, &x).0.abs() < 1e-12));
        }
        let (mut local, _) = Planted { contacts: 2, ..Planted::default() }.local::<2>();
        let mut with = |d: [f64; 4]| {
            local.W = Bsr::from_csc(&Csc::diagonal(&d));
            local.monotone()
        };
        assert_eq!(with([1.0, 1.0, -1.0, 1.0]), Monotone::Unknown);
        assert_eq!(with([1.0, 0.0, 0.0, 1.0]), Monotone::Proved { definite: false });
        assert_eq!(with([1e9, -1e-8, 0.0, 1.0]), Monotone::Unknown, "no mean hides it");
        with([1.0; 4]);
        let (v, r) = (Csc::zeros(4, 1), Csc::diagonal(&[-1.0]));
        local.rows = Some(RowsLocal::bilateral(v, r, vec![0.0]));
        assert_eq!(local.monotone(), Monotone::Unknown);
    }

    #[test]
    fn bilateral_constraints_take_part() {
        // The floor would be left, but the body is held.
        let mut p = touching(&[UP], &[-1.0, 0.0, 0.0], 0.3);
        let g = Csc::from_triplets(3, 1, [(2, 0, 1.0)].into_iter()).unwrap();
        p.rows = Some(RowsGlobal::bilateral(g, vec![0.0]));
        let k = p.kinematics();
        assert_eq!(k.margin(&[0.0, 0.0, 2.0]), None);
        let ray = |lambda| Impulses { r: vec![1.0, 0.0, 0.0], lambda: vec![lambda] };
        assert!(k.refutes(&ray(-1.0)) && !k.refutes(&ray(1.0)) && !k.refutes(&ray(0.0)));
        p.rows.as_mut().unwrap().b[0] = -3.0;
        assert!(p.kinematics().margin(&[0.0, 0.0, 3.0]).is_some());
        assert!(!p.kinematics().refutes(&ray(-1.0)));
    }
}

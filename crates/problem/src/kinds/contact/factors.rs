//! The judge of a local problem whose W nobody has formed: it is known by its factors, body by body.

use crate::Coulomb;
use crate::check::Measure;
use crate::kinds::contact::judge::gauge::{Care, LawGauge, largest};
use nonsmooth_linalg::{norm, small};

/// `W = Σ_b A_b B_b` of contacts between bodies of K = 6 or 3 components of velocity, each contact with at most two of them, which differ.
///
/// With impulses r the bodies move by `v_b = Σ_c B_bc r_c`, and the contacts by `u_c = q_c + Σ_b A_cb v_b`. No scalar
/// rows, no compliance.
pub trait Factors<const D: usize> {
    /// nc.
    fn contacts(&self) -> usize;

    /// Whether `A_cb = B_bcᵀ M_b` with symmetric M_b, up to rounding.
    fn is_symmetric(&self) -> bool;

    /// How many bodies move.
    fn bodies(&self) -> usize;

    /// The bodies of a contact, below [`bodies`](Self::bodies); `None` for one that impulses do not move.
    fn of(&self, contact: usize) -> [Option<usize>; 2];

    /// For each component of velocity of the body on that side, at most [`COMPONENTS`], what it makes of the contact's relative velocity (a column of A_cb), and what the contact's impulse
    /// makes of it (a row of B_bc).
    fn side(&self, contact: usize, side: usize) -> impl Iterator<Item = ([f64; D], [f64; D])>;
}

/// The most components of velocity of a body.
pub const COMPONENTS: usize = 6;

/// The judge's buffers for problems by factors, one after the other.
#[derive(Debug, Clone, Default)]
pub struct FactorsGauge {
    law: LawGauge,
    bodies: Vec<Moved>,
    u: Vec<f64>,
    /// Bounds from above and from below of `(|q| + |W||r|)_i`: for the rounding, and for what a contact's error is compared with.
    most: Vec<f64>,
    least: Vec<f64>,
    diagonal: Vec<f64>,
}

/// A body with its impulses: its velocity, the size of its terms and their number, and the last contact that was seen at it.
#[derive(Debug, Clone, Copy, Default)]
struct Moved {
    velocity: [f64; COMPONENTS],
    size: [f64; COMPONENTS],
    terms: usize,
    last: Option<usize>,
}

impl FactorsGauge {
    /// As [`Problem::accept`](crate::Problem::accept) for the local problem with W, `q` and `mu`, of the impulses `r`, without forming W: the residuals, none below what
    /// [`Problem::certify`](crate::Problem::certify) finds but for what decides nothing, where that is enough to see that r passes at `tolerance`. `None` says nothing of it.
    ///
    /// `|û − u|_i ≤ (n + 2) ε (|q| + Σ_b |A_b||B_b||r|)_i` for the n terms of both sums one after the other, twice the classical bound (Higham2002, section 3.1). A contact's own error is compared with
    /// less than the terms that W would show, `|q_c| + |W_cc||r_c|`. It allocates nothing after the first call of a size.
    ///
    /// Cost: O(nc), of W it would be one pass over its blocks.
    ///
    /// Panics where lengths do not agree.
    pub fn accept<const D: usize>(
        &mut self,
        factors: &impl Factors<D>,
        (q, mu): (&[f64], &[f64]),
        r: &[f64],
        tolerance: f64,
    ) -> Option<Measure> {
        self.move_by(factors, q, r);
        let law = |c: usize| Coulomb { mu: mu[c] };
        self.law.refill(self.diagonal.iter().copied(), norm(q));
        if !self.law.may_pass::<_, D>((r, &self.u), law, tolerance) {
            return None;
        }
        let terms = self.bound(factors, q, r);
        if !self.mark_loads(factors, q) {
            return None;
        }
        let doubt = f64::EPSILON * (terms + 2) as f64;
        let Self { law: gauge, u, most, least, .. } = self;
        let care = Care { sizes: least, doubt: |i: usize| doubt * most[i] };
        let mut measure = gauge.measure::<_, _, D>((r, &u[..]), Some(care), law);
        measure.dual += gauge.rounding_of_dual::<_, D>((0..mu.len()).map(law), doubt, most);
        measure.passes(tolerance).then_some(measure)
    }

    /// The velocities that the impulses make, and the mean of the diagonal of W at each contact.
    fn move_by<const D: usize>(&mut self, factors: &impl Factors<D>, q: &[f64], r: &[f64]) {
        let Self { bodies, u, diagonal, .. } = self;
        let contacts = factors.contacts();
        bodies.clear();
        bodies.resize(factors.bodies(), Moved::default());
        diagonal.clear();
        for c in 0..contacts {
            let rc: [f64; D] = small::block(r, c);
            let mut trace = 0.0;
            for (side, body) in each_side(factors.of(c)) {
                let velocity = bodies[body].velocity.iter_mut();
                for ((left, right), v) in factors.side(c, side).zip(velocity) {
                    for l in 0..D {
                        *v += right[l] * rc[l];
                        trace += left[l] * right[l];
                    }
                }
            }
            diagonal.push(trace / D as f64);
        }
        u.clear();
        for c in 0..contacts {
            let mut sum: [f64; D] = small::block(q, c);
            for (side, body) in each_side(factors.of(c)) {
                for ((left, _), v) in factors.side(c, side).zip(bodies[body].velocity) {
                    (0..D).for_each(|i| sum[i] += left[i] * v);
                }
            }
            u.extend(sum);
        }
    }

    /// Bounds of the terms of the velocities, and how many each has at most.
    fn bound<const D: usize>(&mut self, factors: &impl Factors<D>, q: &[f64], r: &[f64]) -> usize {
        let Self { law: LawGauge { strength, .. }, bodies, most, least, .. } = self;
        let contacts = factors.contacts();
        strength.clear();
        least.clear();
        for c in 0..contacts {
            let rc: [f64; D] = small::block(r, c);
            let mut own = [[0.0; D]; D];
            for (side, body) in each_side(factors.of(c)) {
                let body = &mut bodies[body];
                body.terms += D;
                for ((left, right), size) in factors.side(c, side).zip(&mut body.size) {
                    for l in 0..D {
                        *size += (right[l] * rc[l]).abs();
                        (0..D).for_each(|i| own[i][l] += left[i] * right[l]);
                    }
                }
            }
            strength.push(largest(&own));
            let of_own = |i: usize| (0..D).map(|l| (own[i][l] * rc[l]).abs()).sum::<f64>();
            least.extend((0..D).map(|i| q[D * c + i].abs() + of_own(i)));
        }
        most.clear();
        for c in 0..contacts {
            let mut sum = small::block::<D>(q, c).map(f64::abs);
            for (side, body) in each_side(factors.of(c)) {
                for ((left, _), size) in factors.side(c, side).zip(bodies[body].size) {
                    (0..D).for_each(|i| sum[i] += left[i].abs() * size);
                }
            }
            most.extend(sum);
        }
        let longest = bodies.iter().map(|body| body.terms).max().unwrap_or(0);
        longest + 2 * COMPONENTS + 1
    }

    /// The loads that reach the contacts; whether all of them are found to be coupled, each to the one before at one of its bodies.
    fn mark_loads<const D: usize>(&mut self, factors: &impl Factors<D>, q: &[f64]) -> bool {
        let Self { law: LawGauge { strength, loads, .. }, bodies, .. } = self;
        if strength.contains(&0.0) {
            return false;
        }
        loads.start(strength.len());
        for c in 0..strength.len() {
            for body in factors.of(c).into_iter().flatten() {
                let Some(other) = bodies[body].last.replace(c) else { continue };
                if other == c || loads.are_in_one_group(c, other) {
                    continue;
                }
                let there = largest(&coupling(factors, c, other));
                if there > 0.0 {
                    let (r, s) = (strength[c], strength[other]);
                    loads.couple(c, other, || match factors.is_symmetric() {
                        true => (r / s).sqrt(),
                        false => match largest(&coupling(factors, other, c)) {
                            0.0 => there / s,
                            back => (r / s * (there / back)).sqrt(),
                        },
                    });
                }
            }
        }
        if !loads.are_joined() {
            return false;
        }
        loads.spread(q.chunks(D).map(norm));
        true
    }
}

/// The sides of a contact whose bodies move.
#[inline(always)]
fn each_side(of: [Option<usize>; 2]) -> impl Iterator<Item = (usize, usize)> {
    (0..).zip(of).filter_map(|(side, body)| Some((side, body?)))
}

/// The block of W of two contacts.
fn coupling<const D: usize>(factors: &impl Factors<D>, own: usize, other: usize) -> [[f64; D]; D] {
    let mut block = [[0.0; D]; D];
    let there = factors.of(other);
    for (side, body) in each_side(factors.of(own)) {
        let Some(beside) = there.iter().position(|b| *b == Some(body)) else { continue };
        let both = factors.side(own, side).zip(factors.side(other, beside));
        for ((left, _), (_, right)) in both {
            for i in 0..D {
                (0..D).for_each(|j| block[i][j] += left[i] * right[j]);
            }
        }
    }
    block
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{FrictionLocal, LocalPoint, Problem};
    use nonsmooth_linalg::Bsr;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    fn draw(rng: &mut Pcg64) -> f64 {
        rng.random_range(-1.0..1.0)
    }

    type Columns = [([f64; 3], [f64; 3]); COMPONENTS];

    /// Contacts of a chain of bodies with its neighbours and with the ground, velocities taken somewhat elsewhere than impulses where W need not be symmetric.
    struct Chain {
        of: Vec<[Option<usize>; 2]>,
        sides: Vec<[Columns; 2]>,
        bodies: usize,
        symmetric: bool,
    }

    impl Factors<3> for Chain {
        fn contacts(&self) -> usize {
            self.of.len()
        }

        fn is_symmetric(&self) -> bool {
            self.symmetric
        }

        fn bodies(&self) -> usize {
            self.bodies
        }

        fn of(&self, contact: usize) -> [Option<usize>; 2] {
            self.of[contact]
        }

        fn side(&self, contact: usize, side: usize) -> impl Iterator<Item = ([f64; 3], [f64; 3])> {
            self.sides[contact][side].iter().copied()
        }
    }

    impl Chain {
        fn new(bodies: usize, turned: f64, rng: &mut Pcg64) -> Self {
            let mut of = vec![[None, Some(0)]; 2];
            for b in 1..bodies {
                of.extend([[Some(b - 1), Some(b)], [Some(b), Some(b - 1)], [Some(b), None]]);
            }
            let sides = of.iter().map(|of| {
                of.map(|body| {
                    let mass = body.map_or(1.0, |b| 1.0 + b as f64);
                    std::array::from_fn(|_| {
                        let row: [f64; 3] = std::array::from_fn(|_| draw(rng));
                        let other = row.map(|x| (x + turned * draw(rng)) / mass);
                        (row, other)
                    })
                })
            });
            let sides = sides.collect();
            Self { of, sides, bodies, symmetric: turned == 0.0 }
        }

        /// The local problem whose solution is r where contacts stick, slip and are open in turn, and r.
        fn problem(&self, rng: &mut Pcg64) -> (FrictionLocal<3>, LocalPoint) {
            let contacts = self.contacts();
            let rows: Vec<Vec<(u32, [[f64; 3]; 3])>> = (0..contacts)
                .map(|i| {
                    let meets = |j: &usize| {
                        let there = self.of[*j];
                        self.of[i].iter().any(|b| b.is_some() && there.contains(b))
                    };
                    (0..contacts).filter(meets).map(|j| (j as u32, coupling(self, i, j))).collect()
                })
                .collect();
            let w = Bsr::from_rows(contacts, &rows);
            let (mut r, mut u) = (vec![], vec![]);
            for c in 0..contacts {
                let (n, x, y) = (1.0 + draw(rng).abs(), draw(rng), draw(rng));
                let length = x.hypot(y);
                let (ru, uu) = match c % 3 {
                    0 => ([n, 0.2 * n * x / length, 0.2 * n * y / length], [0.0; 3]),
                    1 => ([n, -0.5 * n * x / length, -0.5 * n * y / length], [0.0, x, y]),
                    _ => ([0.0; 3], [n, 0.1 * x, 0.1 * y]),
                };
                r.extend(ru);
                u.extend(uu);
            }
            let mut q = vec![0.0; r.len()];
            w.mul_plus(&r, &vec![0.0; r.len()], &mut q);
            q.iter_mut().zip(&u).for_each(|(q, u)| *q = u - *q);
            let problem = FrictionLocal::new(w, q, vec![0.5; contacts]).unwrap();
            (problem, LocalPoint { r, lambda: vec![] })
        }
    }

    #[test]
    fn what_passes_by_factors_passes_by_its_matrix_no_better() {
        let mut rng = Pcg64::seed_from_u64(7);
        let mut gauge = FactorsGauge::default();
        let (mut passed, mut refused) = (0, 0);
        for trial in 0..200 {
            let turned = if trial % 2 == 0 { 0.0 } else { 1e-3 };
            let chain = Chain::new(1 + trial % 9, turned, &mut rng);
            let (problem, mut point) = chain.problem(&mut rng);
            let away = 10.0_f64.powi(-4 - (trial % 11) as i32);
            point.r.iter_mut().for_each(|r| *r *= 1.0 + away * draw(&mut rng));
            let tolerance = 1e-8;
            let accepted = gauge.accept(&chain, (&problem.q, &problem.mu), &point.r, tolerance);
            let mut by_matrix = problem.gauge().unwrap();
            let certified = problem.certify(&point, &mut by_matrix);
            match accepted {
                Some(measure) => {
                    passed += 1;
                    assert!(certified.passes(tolerance), "{certified:?}");
                    assert!(measure.relative >= certified.relative);
                    assert!(
                        measure.relative <= certified.relative + 1e-12,
                        "{measure:?} {certified:?}"
                    );
                    assert!(measure.own >= certified.own, "{measure:?} {certified:?}");
                    assert_eq!(measure.worst_contact, certified.worst_contact);
                }
                // Nothing is refused that clearly passes.
                None => {
                    refused += 1;
                    assert!(certified.relative > 0.9 * tolerance, "{certified:?}");
                }
            }
        }
        assert!(passed > 50 && refused > 50, "{passed} {refused}");
    }

    #[test]
    fn nothing_is_said_where_contacts_may_not_feel_each_other() {
        let mut rng = Pcg64::seed_from_u64(8);
        let mut chain = Chain::new(4, 0.0, &mut rng);
        let (problem, point) = chain.problem(&mut rng);
        let mut gauge = FactorsGauge::default();
        let mut accept = |chain: &Chain, r: &[f64]| {
            gauge.accept(chain, (&problem.q, &problem.mu), r, 1e-8).is_some()
        };
        assert!(accept(&chain, &point.r));
        let mut wrong = point.r.clone();
        wrong[4] = f64::NAN;
        assert!(!accept(&chain, &wrong));
        wrong[4] = 1e300;
        assert!(!accept(&chain, &wrong));
        // Two halves that share no body: whether a load of one reaches the other is for the judge of the matrix.
        for of in &mut chain.of {
            if of.contains(&Some(2)) && of.contains(&Some(1)) {
                *of = [None, Some(1)];
            }
        }
        let (problem, point) = chain.problem(&mut rng);
        assert!(gauge.accept(&chain, (&problem.q, &problem.mu), &point.r, 1e-8).is_none());
    }
}

//! Whether a few contacts in space have no solution: branch and bound over their states.
//!
//! Problem: `u = W r + q` and Coulomb's law, where each contact is open, sticks, or slides in some direction; see `check/proof/sectors.rs` of the judge's crate for what a vector says of such a choice.
//!
//! Method: a case leaves each contact all states, one, or sliding in a sector of directions. Its impulses and velocities are nonnegative multiples of a few generators (of cones about the law's own, wider by a thousandth), and
//! `min ‖u − W r − q‖` over them is a least-squares problem with nonnegative unknowns. Where the least is positive, what is left is minus a vector that closes the case. Else there are
//! impulses and velocities that the case allows: of the contacts with all states the one whose impulse and velocity are both largest is told apart, then the widest sector is halved. A case in narrow sectors
//! that stays open ends the search: something like a solution is there. Vectors that have closed other cases are tried first.
//!
//! The cones are wider so that what closes a case does so with room for rounding. Where W has a kernel that presses contacts against each other there is none: z has to vanish, which exact elimination makes of a
//! problem that is stated by its bodies, while of a W that is stored it holds up to rounding only.
//!
//! References: LawsonHanson1974 (ch. 23) for the least squares.
//! Cost: some ten microseconds a case and generator that comes or goes; problems without a solution of 2 to 8 contacts take some 30 to 3000 cases.

use nonsmooth_linalg::{budget, dot, norm};
use nonsmooth_problem::check::{Case, Certificate, Evidence, ExactVector, Existence, Law, Sector};

use super::least_squares::LeastSquares;
use crate::contact::form::{Access, Blockwise, Disked};

/// Of more contacts the choices are too many.
const FEW: usize = 8;
/// Cases that are looked at.
const CASES: usize = 4000;
/// What is left of loads of length 1 where there are impulses that a case allows.
const SOLVED: f64 = 1e-7;
/// Directions that hold the disk of friction of a contact that sticks.
const CORNERS: usize = 16;
/// So much wider cones are: coefficients of friction, and sectors as a part of their width.
const WIDER: f64 = 1e-3;
/// The last vectors, which are tried before a new one is sought.
const AGAIN: usize = 100;
/// By so much at least a vector that is used again is inside.
const SURELY: f64 = 1e-9;
/// Parts of a vector of length 1 that are rounding, and room for that of the others.
const NOTHING: f64 = 1e-10;
const ROOM: f64 = 1e-13;
/// A contact whose impulse or velocity is below this has only one of them.
const IDLE: f64 = 1e-9;

/// What the investigation finds, if anything.
pub(super) fn investigate<P: Blockwise<D> + Disked<D>, const D: usize>(
    problem: &P,
) -> Option<Existence> {
    let n = problem.contacts();
    if D != 3 || <P::Law as Law<D>>::DISKS != 1 || n == 0 || n > FEW {
        return None;
    }
    let vectors = Search::new(problem)?.run()?;
    let system = problem.cones()?;
    let exact = |p: &Vec<f64>| (!budget::over()).then(|| system.balanced(p)).flatten();
    let vectors: Vec<ExactVector> = vectors.iter().map(exact).collect::<Option<_>>()?;
    let certificate = Certificate::Separating { vectors };
    match problem.evidence(&certificate) {
        Evidence::Proved(proof) => Some(Existence::NoSolution { proof }),
        Evidence::Nearly { change } => Some(Existence::NearlyNoSolution { certificate, change }),
        Evidence::Nothing => None,
    }
}

/// The problem with each contact in units where `w_c = 1`, and `‖q‖ = 1`.
struct Search {
    mu: Vec<f64>,
    /// `√w_c`.
    unit: Vec<f64>,
    /// `W` by columns.
    w: Vec<f64>,
    q: Vec<f64>,
    /// Vectors that have closed cases, with their z.
    found: Vec<Vector>,
}

/// p, and `z = −Wᵀp`.
struct Vector {
    p: Vec<f64>,
    z: Vec<f64>,
}

/// A case that is to be looked at, and the generators that its parent used, by contact and number.
struct Open {
    cases: Vec<Case>,
    used: Vec<(usize, usize)>,
}

/// A generator of a case: which contact it is of, and which of its generators it is, with the impulse, zero of a motion.
struct Generator {
    name: (usize, usize),
    r: [f64; 3],
}

impl Search {
    /// `None` of loads that are none.
    fn new<P: Blockwise<D> + Disked<D>, const D: usize>(problem: &P) -> Option<Self> {
        let n = problem.contacts();
        let mut state = problem.state(Access::Visits).ok()?;
        let mut unit = vec![];
        problem.units(&state, &mut unit);
        unit.iter_mut().for_each(|w| *w = w.sqrt());
        let origin = problem.origin();
        let mut r = vec![0.0; D * n];
        let mut velocities = |moved: Option<usize>| -> Vec<f64> {
            problem.enter(&mut state, &origin);
            if let Some(i) = moved {
                let mut dr = [0.0; D];
                (r[i], dr[i % D]) = (1.0, 1.0);
                problem.moved(&mut state, i / D, &dr);
            }
            let u = (0..n).flat_map(|c| problem.velocity(&state, &r, c)).collect();
            r.fill(0.0);
            u
        };
        let free = velocities(None);
        let mut w = vec![];
        for j in 0..D * n {
            let u = velocities(Some(j));
            let column = u.iter().zip(&free).enumerate();
            w.extend(column.map(|(i, (u, free))| (u - free) / (unit[i / D] * unit[j / D])));
        }
        let mut q: Vec<f64> = free.iter().enumerate().map(|(i, u)| u / unit[i / D]).collect();
        let size = norm(&q);
        q.iter_mut().for_each(|x| *x /= size);
        let mu = (0..n).map(|c| problem.law(c).coefficient(0)).collect();
        let usable = size > 0.0 && q.iter().chain(&w).all(|x| x.is_finite());
        usable.then_some(Self { mu, unit, w, q, found: vec![] })
    }

    /// The vectors that close all cases, in the problem's units; `None` where a case stays open, or there are too many.
    fn run(mut self) -> Option<Vec<Vec<f64>>> {
        let n = self.mu.len();
        let mut open = vec![Open { cases: vec![Case::Any; n], used: vec![] }];
        let mut squares = LeastSquares::default();
        let mut seen = 0;
        while let Some(Open { cases, used }) = open.pop() {
            seen += 1;
            if seen > CASES || budget::over() {
                return None;
            }
            if self.found.iter().rev().take(AGAIN).any(|v| self.closes(v, &cases, SURELY)) {
                continue;
            }
            let generators = self.state(&cases, &used, &mut squares);
            if squares.solve() > SOLVED {
                let vector = self.closing(&cases, squares.residual());
                if self.closes(&vector, &cases, -NOTHING) {
                    self.found.push(vector);
                    continue;
                }
            }
            let c = self.branch(&cases, &generators, &squares)?;
            let positive = (0..generators.len()).filter(|&j| squares.coefficient(j) > 0.0);
            let used: Vec<(usize, usize)> =
                positive.map(|j| generators[j].name).filter(|u| u.0 != c).collect();
            for part in cases[c].parts(self.mu[c] > 0.0) {
                let mut cases = cases.clone();
                cases[c] = part;
                open.push(Open { cases, used: used.clone() });
            }
        }
        let unscaled = |v: &Vector| (0..3 * n).map(|i| v.p[i] / self.unit[i / 3]).collect();
        Some(self.found.iter().map(unscaled).collect())
    }

    /// Puts a case as a least-squares problem, with a column for each of these generators.
    fn state(
        &self,
        cases: &[Case],
        used: &[(usize, usize)],
        squares: &mut LeastSquares,
    ) -> Vec<Generator> {
        let k = self.q.len();
        squares.begin(&self.q);
        let mut generators = vec![];
        let mut column = vec![0.0; k];
        for (c, &case) in cases.iter().enumerate() {
            let mut number = 0;
            let mut push = |column: &[f64], r: [f64; 3], squares: &mut LeastSquares| {
                squares.push(column);
                generators.push(Generator { name: (c, number), r });
                number += 1;
            };
            for u in motions(case) {
                column.fill(0.0);
                column[3 * c..3 * c + 3].copy_from_slice(&u);
                push(&column, [0.0; 3], squares);
            }
            for r in impulses(case, self.mu[c]) {
                column.fill(0.0);
                for (l, r) in r.into_iter().enumerate().filter(|e| e.1 != 0.0) {
                    let of_w = &self.w[k * (3 * c + l)..][..k];
                    column.iter_mut().zip(of_w).for_each(|(x, w)| *x -= r * w);
                }
                push(&column, r, squares);
            }
            // A velocity that may be anything.
            if is_free(case, self.mu[c]) {
                squares.leave_out(3 * c + 1..3 * c + 3);
            }
        }
        squares.start((0..generators.len()).filter(|&j| used.contains(&generators[j].name)));
        generators
    }

    /// The contact whose states are to be told apart; `None` where all are told apart well enough.
    fn branch(
        &self,
        cases: &[Case],
        generators: &[Generator],
        squares: &LeastSquares,
    ) -> Option<usize> {
        let k = self.q.len();
        let mut r = vec![0.0; k];
        for (j, generator) in generators.iter().enumerate() {
            let (c, t) = (generator.name.0, squares.coefficient(j));
            (0..3).for_each(|l| r[3 * c + l] += t * generator.r[l]);
        }
        let mut u = self.q.clone();
        for (w, r) in self.w.chunks(k).zip(&r).filter(|(_, r)| **r != 0.0) {
            u.iter_mut().zip(w).for_each(|(u, w)| *u += w * r);
        }
        let both = |c: usize| norm(&r[3 * c..][..3]).min(norm(&u[3 * c..][..3]));
        let undecided = (0..cases.len()).filter(|&c| cases[c] == Case::Any && both(c) > IDLE);
        let worst = undecided.max_by(|&a, &b| both(a).total_cmp(&both(b)));
        let depth = |c: usize| match cases[c] {
            Case::Slide(sector) if sector.halves().is_some() => Some(sector.depth()),
            _ => None,
        };
        let sliding = (0..cases.len()).filter(|&c| depth(c).is_some());
        worst.or_else(|| sliding.min_by_key(|&c| depth(c)))
    }

    /// The vector that closes the case, from what is left.
    fn closing(&self, cases: &[Case], residual: &[f64]) -> Vector {
        let k = self.q.len();
        let size = norm(residual);
        let mut p: Vec<f64> = residual.iter().map(|x| -x / size).collect();
        for (c, &case) in cases.iter().enumerate() {
            let p = &mut p[3 * c..3 * c + 3];
            // What has to vanish, or to have a sign, is not left to rounding.
            if matches!(case, Case::Any | Case::Open) {
                p[0] = if p[0] < NOTHING { 0.0 } else { p[0] };
            }
            if let Case::Slide(sector) = case {
                let [x, y] = away(sector, [p[1], p[2]]);
                (p[1], p[2]) = (x, y);
            }
            if is_free(case, self.mu[c]) {
                p[1..].fill(0.0);
            }
        }
        let z = self.w.chunks(k).map(|w| -dot(w, &p)).collect();
        Vector { p, z }
    }

    /// Whether a vector closes the case with this room for rounding.
    fn closes(&self, v: &Vector, cases: &[Case], room: f64) -> bool {
        cases.iter().enumerate().all(|(c, case)| {
            let (p, z, mu) = (&v.p[3 * c..3 * c + 3], &v.z[3 * c..3 * c + 3], self.mu[c]);
            let still = p[1] == 0.0 && p[2] == 0.0;
            let opens = still && p[0] >= 0.0;
            let sticks = || (still || mu > 0.0) && z[0] - mu * z[1].hypot(z[2]) >= room;
            match case {
                Case::Any => opens && sticks(),
                Case::Open => opens,
                Case::Stick => sticks(),
                Case::Slide(sector) => {
                    let away = |e: &[f64; 2]| p[1] * e[0] + p[2] * e[1] <= -room.max(0.0);
                    sector.ends().iter().all(away)
                        && impulses(*case, mu).iter().all(|g| dot(g, z) >= room)
                }
            }
        })
    }
}

/// The nearest vector that has no positive product with any direction of the sector: by more than rounding, or zero.
fn away(sector: Sector, p: [f64; 2]) -> [f64; 2] {
    if p[0].hypot(p[1]) < NOTHING {
        return [0.0; 2];
    }
    let [from, to] = sector.ends();
    let area = from[0] * to[1] - from[1] * to[0];
    let along = |e: [f64; 2]| (-(p[0] * e[0] + p[1] * e[1])).max(ROOM);
    let (a, b) = (along(from), along(to));
    [-(a * to[1] - b * from[1]) / area, -(b * from[0] - a * to[0]) / area]
}

/// Whether a case says nothing of a contact's tangential velocity.
fn is_free(case: Case, mu: f64) -> bool {
    matches!(case, Case::Any | Case::Open) || (case == Case::Stick && mu == 0.0)
}

/// The ends of a sector that is a little wider.
fn wider(sector: Sector) -> [[f64; 2]; 2] {
    let [from, to] = sector.ends();
    let add =
        |a: [f64; 2], b: [f64; 2]| [a[0] + WIDER * (a[0] - b[0]), a[1] + WIDER * (a[1] - b[1])];
    [add(from, to), add(to, from)]
}

/// Generators of the velocities of a contact, but for a tangential one that is free.
fn motions(case: Case) -> Vec<[f64; 3]> {
    match case {
        Case::Any | Case::Open => vec![[1.0, 0.0, 0.0]],
        Case::Stick => vec![],
        Case::Slide(sector) => wider(sector).map(|e| [0.0, -e[0], -e[1]]).to_vec(),
    }
}

/// Generators of the impulses.
fn impulses(case: Case, mu: f64) -> Vec<[f64; 3]> {
    match case {
        Case::Open => vec![],
        Case::Any | Case::Stick if mu == 0.0 => vec![[1.0, 0.0, 0.0]],
        Case::Any | Case::Stick => {
            let half = std::f64::consts::PI / CORNERS as f64;
            let radius = (1.0 + WIDER) * mu / half.cos();
            let corner = |k: usize| {
                let angle = 2.0 * half * k as f64;
                [1.0, radius * angle.cos(), radius * angle.sin()]
            };
            (0..CORNERS).map(corner).collect()
        }
        Case::Slide(sector) => {
            // The ends, and where the tangents there meet.
            let [from, to] = wider(sector);
            let size = [from, to].map(|e| e[0].hypot(e[1]));
            let between = size[0] * size[1] + from[0] * to[0] + from[1] * to[1];
            let factor = (1.0 + WIDER) * mu * size[0] * size[1] / between;
            let meet = [
                1.0,
                factor * (from[0] / size[0] + to[0] / size[1]),
                factor * (from[1] / size[0] + to[1] / size[1]),
            ];
            let end = |k: usize, e: [f64; 2]| [1.0, mu * e[0] / size[k], mu * e[1] / size[k]];
            vec![end(0, from), end(1, to), meet]
        }
    }
}

#[cfg(test)]
mod tests {
    use nonsmooth_linalg::{Bsr, Csc};
    use nonsmooth_problem::planted::Planted;
    use nonsmooth_problem::{FrictionLocal, Problem};

    use super::*;

    #[test]
    fn what_has_a_solution_is_never_refuted() {
        for seed in 0..60 {
            let case = Planted {
                contacts: 2 + seed as usize % 4,
                dofs: 3 + seed as usize % 7,
                mu: (0.2, 0.4 + 0.05 * seed as f64),
                seed,
                ..Planted::default()
            };
            assert_eq!(investigate(&case.global::<3>().0), None, "{case:?}");
            assert_eq!(investigate(&case.local::<3>().0), None, "{case:?}");
        }
    }

    /// Two contacts share one body that only moves along the y-axis, which each of them sees as half normal, half tangential; they close on it by 1.
    fn closing(mu: [f64; 2]) -> FrictionLocal<3> {
        let h = [0.6, 0.8, 0.0, -0.6, 0.8, 0.0];
        let w = (0..36).map(|k| (k / 6, k % 6, h[k / 6] * h[k % 6]));
        let w = Bsr::from_csc(&Csc::from_triplets(6, 6, w).unwrap());
        FrictionLocal::new(w, vec![-1.0, 0.0, 0.0, -1.0, 0.0, 0.0], mu.to_vec()).unwrap()
    }

    #[test]
    fn bodies_driven_into_each_other_are_refuted_case_by_case() {
        // u_N = 0.6 v - 1 and -0.6 v - 1 are not both positive, whatever v is.
        for mu in [[0.5, 0.5], [2.0, 0.0], [0.0, 0.0]] {
            let problem = closing(mu);
            let found = investigate(&problem);
            let Some(Existence::NoSolution { proof }) = found else { panic!("{mu:?}: {found:?}") };
            assert!(problem.verify(proof.certificate()) && proof.margin() > 0.0);
        }
    }

    #[test]
    fn vectors_that_leave_a_case_open_are_no_proof() {
        let problem = closing([0.5, 0.5]);
        let system = problem.cones().unwrap();
        let vectors = Search::new(&problem).unwrap().run().unwrap();
        let all: Vec<_> = vectors.iter().map(|p| system.balanced(p).unwrap()).collect();
        let evidence = |vectors| problem.evidence(&Certificate::Separating { vectors });
        let Evidence::Proved(proof) = evidence(all) else { panic!("all cases are closed") };
        let Certificate::Separating { vectors } = proof.certificate().clone() else { panic!() };
        // Of those that were taken each is needed somewhere, or others close what it does.
        let without = |k: usize| {
            let mut fewer = vectors.clone();
            fewer.remove(k);
            evidence(fewer)
        };
        assert!((0..vectors.len()).any(|k| !without(k).holds()));
        assert_eq!(evidence(vec![]), Evidence::Nothing);
        let turned = |y: &ExactVector| ExactVector(y.0.iter().map(|y| -y).collect());
        assert_eq!(evidence(vectors.iter().map(turned).collect()), Evidence::Nothing);
    }
}

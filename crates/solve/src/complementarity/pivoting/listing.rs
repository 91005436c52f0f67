//! Every solution of a linear complementarity problem, decided in exact arithmetic.
//!
//! Problem: as of [`enumeration`](super::Enumeration).
//!
//! Method: branch and bound over the complementary cones in doubles, which proposes; nothing is dropped on its word. That a case has no point is proved by a vector whose signs are verified
//! exactly, and else decided by the simplex method in rational numbers, in which the case goes on where it has one. A case in which all pairs are decided is a
//! polyhedron; rational numbers say whether it has points, and its extreme points, rays and lines.
//!
//! Cost: at most 2ᵐ cases for m pairs. One that is closed by a vector costs what it does in doubles; one for the rational numbers a pivot for each pair that is decided in it, each O(rows · columns)
//! products of integers of up to 53 · rows bits.

use nonsmooth_linalg::budget;
use nonsmooth_problem::check::{ConeSystem, Entries, Exact};

use super::enumeration::{Case, Closed, Data};
use crate::SolveError;
use crate::complementarity::form::Complementary;
use crate::core::exact_cones::{Case as ExactCase, ExactCones, ExactFace, LARGE};

/// Pairs that are taken on at most.
const PAIRS: usize = 40;
/// Extreme points and rays of a pattern that are looked for at most.
const EXTREMES: usize = 1000;

/// Every solution of a problem, as [`all_solutions`] lists them.
#[derive(Debug, Clone, PartialEq)]
pub struct Solutions {
    /// Isolated solutions and families, none contained in another.
    pub faces: Vec<Face>,
    /// True if every case was decided, in exact arithmetic, and all of their solutions are listed: there are no others.
    pub complete: bool,
    /// Else: what is not known, in words.
    pub lacks: Vec<String>,
}

/// A solution, or a family of solutions: those of one pattern of `z_i = 0` and `w_i = 0`, a convex polyhedron. It is the set of all
/// convex combinations of the ends, plus nonnegative multiples of the rays, plus any multiples of the lines; each is computed in rational numbers and rounded once.
#[derive(Debug, Clone, PartialEq)]
pub struct Face {
    /// The solution; of a family one in its relative interior.
    pub z: Vec<f64>,
    /// 0 of a solution that is alone in its pattern.
    pub dimension: usize,
    /// Of a family: its extreme points, both ends of a segment. Where it has lines: one of the points that differ by these alone.
    pub ends: Vec<Vec<f64>>,
    /// Of an unbounded family: the extreme directions in which it goes on for ever; the largest entry is ±1.
    pub rays: Vec<Vec<f64>>,
    /// Directions in which it goes on for ever both ways, which only free variables have; independent, the largest entry is ±1.
    pub lines: Vec<Vec<f64>>,
    allowed: Vec<bool>,
    support: Vec<bool>,
}

impl Solutions {
    /// Faces of dimension 0.
    pub fn isolated(&self) -> impl Iterator<Item = &Face> {
        self.faces.iter().filter(|face| face.dimension == 0)
    }

    /// The families of more than one solution.
    pub fn families(&self) -> impl Iterator<Item = &Face> {
        self.faces.iter().filter(|face| face.dimension > 0)
    }
}

/// Lists every solution of an LCP or MLCP: isolated ones as points, in lexicographic order, then families. Stops, and says so, after `limit` patterns with solutions.
///
/// ```
/// use nonsmooth_problem::Lcp;
/// use nonsmooth_linalg::Dense;
/// use nonsmooth_solve::complementarity::pivoting::all_solutions;
///
/// // w = −z + 1 has the solutions 0 and 1.
/// let m = Dense::from_rows(&[[-1.0]]).expect("even rows");
/// let found = all_solutions(&Lcp::new(m, vec![1.0])?, 100)?;
/// let z: Vec<_> = found.isolated().map(|face| face.z[0]).collect();
/// assert_eq!((z, found.complete), (vec![0.0, 1.0], true));
///
/// // z₁ + z₂ = 1 is a family, a segment.
/// let m = Dense::from_rows(&[[1.0, 1.0], [1.0, 1.0]]).expect("even rows");
/// let found = all_solutions(&Lcp::new(m, vec![-1.0, -1.0])?, 100)?;
/// let family = found.families().next().expect("a family");
/// assert_eq!((found.faces.len(), family.dimension, family.ends.len()), (1, 1, 2));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// Errors: an operator, more than 40 pairs, more rows or columns than are taken on in rational numbers.
pub fn all_solutions(problem: &impl Complementary, limit: usize) -> Result<Solutions, SolveError> {
    let data = Data::new(&problem.rowwise(), PAIRS)?;
    let needs = || SolveError::needs("the entries of M (dense or sparse)", "an operator");
    let system = problem.cones().ok_or_else(needs)?;
    let [rows, columns] = LARGE;
    let size = (system.rhs.len(), system.columns.len());
    if size.0 > rows || size.1 > columns {
        return Err(SolveError::needs(
            "few rows and variables, for rational numbers",
            format!(
                "{} rows and {} columns of z and w (at most {rows} and {columns} are taken on)",
                size.0, size.1
            ),
        ));
    }
    Ok(Listing::new(data, system).run(limit))
}

/// A case that is still open.
enum Open {
    /// Has a point as far as doubles say.
    Likely(Case),
    /// Has a point.
    Exact(ExactCase),
}

/// The search.
struct Listing {
    data: Data,
    entries: Entries,
    exact: ExactCones,
    /// Where all cases begin, if it has a point.
    root: Option<ExactCase>,
    open: Vec<Open>,
    faces: Vec<Face>,
    /// Patterns with more extreme points and rays than are looked for.
    large: usize,
    /// Solutions beyond the range of doubles.
    beyond: usize,
}

impl Listing {
    fn new(data: Data, system: ConeSystem) -> Self {
        let entries = system.entries();
        let mut exact = ExactCones::new(system);
        let root = exact.root();
        let first = |root: &ExactCase| match Case::root(&data) {
            Ok(case) => Open::Likely(case),
            Err(_) => Open::Exact(root.clone()),
        };
        let open = root.iter().map(first).collect();
        Self { data, entries, exact, root, open, faces: vec![], large: 0, beyond: 0 }
    }

    fn run(mut self, limit: usize) -> Solutions {
        let mut lacks = vec![];
        while !self.exact.is_cut_short() {
            let Some(case) = self.open.pop() else { break };
            if self.faces.len() >= limit {
                lacks.push(format!("the list ends after {limit} patterns"));
                break;
            }
            if budget::over() {
                self.open.push(case);
                break;
            }
            match case {
                Open::Likely(case) => self.propose(&case),
                Open::Exact(case) => self.decide(&case),
            }
        }
        if self.exact.is_cut_short() || (lacks.is_empty() && !self.open.is_empty()) {
            lacks.push("a limit ended the search before all cases were decided".into());
        }
        if self.large > 0 {
            lacks.push(format!(
                "left out are {} patterns with more than {EXTREMES} extreme points and rays",
                self.large
            ));
        }
        if self.beyond > 0 {
            lacks.push(format!("left out are {} beyond the range of doubles", self.beyond));
        }
        Solutions { faces: maximal(self.faces), complete: lacks.is_empty(), lacks }
    }

    /// Goes on from a case in doubles.
    fn propose(&mut self, case: &Case) {
        match case.conflict(&self.data).or_else(|| case.undecided(&self.data)) {
            None => self.doubt(case),
            Some(j) => {
                for side in case.sides(&self.data, j) {
                    match case.without(&self.data, side) {
                        Ok(case) => self.open.push(Open::Likely(case)),
                        Err(closed) if self.is_proved(&closed) => {}
                        Err(closed) => self.doubt(&closed.case),
                    }
                }
            }
        }
    }

    /// The columns of the system that a case in doubles does not allow.
    fn excluded(&self, case: &Case) -> Vec<usize> {
        let pairs = self.exact.system().pairs.iter().enumerate();
        let sides = pairs.flat_map(|(k, &[w, z])| [(self.data.w(k), w), (self.data.z(k), z)]);
        sides.filter(|(ours, _)| !case.allowed[*ours]).map(|(_, theirs)| theirs).collect()
    }

    /// Whether it is certain that a case has no point.
    fn is_proved(&self, closed: &Closed) -> bool {
        let Some(y) = closed.strict_proof(&self.data) else { return false };
        let mut excluded = vec![false; self.exact.system().columns.len()];
        self.excluded(&closed.case).iter().for_each(|&j| excluded[j] = true);
        self.exact.system().closed_by(&self.entries, &y, &excluded)
    }

    /// Leaves a case to rational numbers.
    fn doubt(&mut self, case: &Case) {
        let excluded = self.excluded(case);
        let exact = self.root.as_ref().and_then(|root| self.exact.without(root, &excluded));
        self.open.extend(exact.map(Open::Exact));
    }

    /// Goes on from a case in rational numbers.
    fn decide(&mut self, case: &ExactCase) {
        match self.exact.conflict(case).or_else(|| self.exact.undecided(case)) {
            Some(pair) => {
                for j in pair {
                    self.open.extend(self.exact.without(case, &[j]).map(Open::Exact));
                }
            }
            None => match self.exact.face(case, EXTREMES) {
                Some(exact) => {
                    let face = Face::new(self.exact.system(), exact);
                    match face.is_finite() {
                        true => self.faces.push(face),
                        false => self.beyond += 1,
                    }
                }
                None if self.exact.is_cut_short() => {}
                None => self.large += 1,
            },
        }
    }
}

impl Face {
    fn new(system: &ConeSystem, exact: ExactFace) -> Self {
        let ExactFace { points, rays, lines, dimension, allowed, support } = exact;
        let unit = |t: Vec<Exact>| {
            let length = largest(system, &t).unwrap_or(Exact::ONE);
            t.into_iter().map(|t| t / &length).collect::<Vec<_>>()
        };
        let [rays, lines] = [rays, lines].map(|all| all.into_iter().map(unit).collect::<Vec<_>>());
        let list = |all: &[Vec<Exact>]| all.iter().map(|t| system.unknowns_at(t)).collect();
        let z = system.unknowns_at(&interior(system, &points, &rays));
        let ends = if dimension == 0 { vec![] } else { list(&points) };
        Self { z, dimension, ends, rays: list(&rays), lines: list(&lines), allowed, support }
    }

    fn is_finite(&self) -> bool {
        let parts = [&self.ends, &self.rays, &self.lines].into_iter().flatten();
        parts.chain([&self.z]).flatten().all(|x| x.is_finite())
    }
}

/// The largest modulus of the unknowns of a direction or point, where not all are zero.
fn largest(system: &ConeSystem, t: &[Exact]) -> Option<Exact> {
    let size = |x: Exact| if x < Exact::ZERO { -x } else { x };
    let value = |terms: &[(usize, Exact)]| {
        terms.iter().fold(Exact::ZERO, |sum, (j, factor)| sum + factor * &t[*j])
    };
    let sizes = system.unknowns.iter().map(|(_, terms)| size(value(terms)));
    sizes.max().filter(|x| !x.is_zero())
}

/// A point where everything is positive that is so anywhere: the mean of some extreme points, plus some rays as long as these points are large.
fn interior(system: &ConeSystem, points: &[Vec<Exact>], rays: &[Vec<Exact>]) -> Vec<Exact> {
    let mut seen = vec![false; system.columns.len()];
    let mut adds = |t: &Vec<Exact>| {
        let mut new = false;
        for &j in system.pairs.iter().flatten().filter(|j| !t[**j].is_zero()) {
            new |= !std::mem::replace(&mut seen[j], true);
        }
        new
    };
    let mut number = 0_u32;
    let mut middle = vec![Exact::ZERO; system.columns.len()];
    for (k, t) in points.iter().enumerate() {
        if adds(t) || k == 0 {
            number += 1;
            middle.iter_mut().zip(t).for_each(|(m, t)| *m += t);
        }
    }
    let number = Exact::from(number.max(1));
    middle.iter_mut().for_each(|m| *m = &*m / &number);
    let length = points.iter().filter_map(|t| largest(system, t)).max().unwrap_or(Exact::ONE);
    for t in rays.iter().filter(|t| adds(t)) {
        middle.iter_mut().zip(t).for_each(|(m, t)| *m += t * &length);
    }
    middle
}

/// Without those that are contained in another; isolated ones first, in the order of z.
fn maximal(faces: Vec<Face>) -> Vec<Face> {
    let inside = |a: &Face, b: &Face| a.support.iter().zip(&b.allowed).all(|(s, a)| !s || *a);
    let keep: Vec<bool> = (0..faces.len())
        .map(|i| {
            !(0..faces.len()).any(|k| {
                k != i && inside(&faces[i], &faces[k]) && (k < i || !inside(&faces[k], &faces[i]))
            })
        })
        .collect();
    let kept = faces.into_iter().zip(keep).filter(|(_, keep)| *keep);
    let mut faces: Vec<Face> = kept.map(|(face, _)| face).collect();
    let earlier = |a: &Face, b: &Face| {
        let first = a.z.iter().zip(&b.z).map(|(a, b)| a.total_cmp(b)).find(|o| o.is_ne());
        a.dimension.cmp(&b.dimension).then(first.unwrap_or(std::cmp::Ordering::Equal))
    };
    faces.sort_by(earlier);
    faces
}

//! **Lemke's method**: an artificial variable z0 makes the problem feasible, and complementary pivots drive it out.
//!
//! Problem: `w = M z + q`, `0 ≤ z ⟂ w ≥ 0`, the first variables perhaps free with `w = 0` (MLCP).
//!
//! Method: `w = M z + d z0 + q` with a covering vector `d > 0`. z0 enters at the least value that makes w nonnegative, in place of `w_r`, `r = argmax −q_i/d_i`;
//! from then on the complement of what has just left enters, what blocks it first leaves, until z0 leaves (a solution) or nothing blocks (a secondary ray).
//! Ties go by the lexicographic order of the rows of B⁻¹, so that no basis comes back.
//!
//! The basis is a plain tableau, or an LU of its z-block with product-form updates, dense or sparse. Free variables are basic from the start, where need be
//! with complementary ones that make the block regular; a caller's point gives the first basis in the same way, with the covering vector `d = B g`.
//! The data are equilibrated by powers of two, which does not change the path; the last basis is refined against them in doubled precision.
//!
//! References: Acary2018 (25)–(32), with the argmax in (27)(28); Lemke1965; CottlePangStone2009, section 4.4; Kostreva1979 (cycling).
//!
//! Cost of a step (a pivot), k basic z: `4 n²` (tableau), `2 k² + 2 k (n − k)` (dense), in proportion to the entries (sparse); for each tied row, one
//! solve more with the transpose. Storage: M again, and the tableau or the LU with at most `renew_every` columns.
//! Fails: 2ⁿ pivots at worst. A ray proves that there is no solution where M is copositive-plus, and nothing elsewhere. Needs the entries of M.

use nonsmooth_linalg::Matrix;
use nonsmooth_problem::LcpPoint;
use nonsmooth_problem::check::Certificate;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::basis::{Basis, Data, Factored, Tableau};
use super::path::{Breaking, Event, Exchange, Path};
use super::start::with_free_variables;
use crate::complementarity::form::{Complementary, System, system};
use crate::core::register::{About, Described, Solves};
use crate::core::settings::{Settings, described};
use crate::core::trace::{Pivot, Recorder, Trace, Variable};
use crate::{SolveError, Solver, Step};

/// The covering vector d.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Covering {
    /// `ones`, or `scaled` where the sizes of the rows differ by more than 1000.
    Auto,
    /// `d_i = 1`.
    Ones,
    /// `d_i = 1` in the units in which M is equilibrated.
    Scaled,
    /// `d_i = |q_i| + Σ_j |M_ij|`: does not depend on the scale of a row.
    RowNorms,
    /// `d_i` random in [1/2, 2] (its logarithm even), by `seed`.
    Random,
}

/// How ties of the ratio test are broken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Ties {
    /// Lexicographically up to 300 variables, beyond by perturbation.
    Auto,
    /// By the rows of B⁻¹, lexicographically.
    Lexicographic,
    /// By a random right-hand side in front of those rows: as safe, and many ties cost no more than one.
    Perturbed,
    /// As the lexicographic rule, but the first pivot is the first of those tied. Textbooks' counts of pivots are often these; it may cycle, which is noticed.
    Rows,
    /// The first row, whatever it is: may cycle, which is noticed.
    First,
}

/// How the basis is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BasisKind {
    /// The tableau up to 40 variables, beyond as M is stored.
    Auto,
    /// All of `B⁻¹ [I, −M, −d]`: 2n² numbers, each changed by every pivot.
    Tableau,
    /// LU of the z-block, dense.
    Dense,
    /// LU of the z-block, sparse.
    Sparse,
}

/// How z0 covers the infeasibility, how ties break, and how the basis is kept.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Lemke {
    /// The covering vector d.
    pub covering: Covering,
    /// A covering vector `d > 0` of the caller's own, one entry a row; those of equalities are not used. Not a setting of the command line.
    #[serde(skip)]
    pub covering_vector: Option<Vec<f64>>,
    /// Seed of random covering vectors and of the perturbation.
    pub seed: u64,
    /// How ties are broken.
    pub ties: Ties,
    /// How the basis is kept.
    pub basis: BasisKind,
    /// A pivot below this is zero, in units of the largest entry of its column; in [0, 1e-3].
    pub pivot_tolerance: f64,
    /// Pivots between two factorisations of the basis, at least 1; not of the tableau.
    pub renew_every: usize,
    /// After a ray that proves nothing: how many other covering vectors are tried.
    pub restarts: usize,
    /// Whether a starting point other than zero gives the first basis.
    pub warm: bool,
}

impl Default for Lemke {
    fn default() -> Self {
        Self {
            covering: Covering::Auto,
            covering_vector: None,
            seed: 1,
            ties: Ties::Auto,
            basis: BasisKind::Auto,
            pivot_tolerance: 1e-11,
            renew_every: 64,
            restarts: 3,
            warm: true,
        }
    }
}

impl Settings for Lemke {
    fn validate(&self) -> Result<(), String> {
        if !(0.0..=1e-3).contains(&self.pivot_tolerance) {
            let found = self.pivot_tolerance;
            return Err(format!("pivot_tolerance: expected a number in [0, 1e-3], found {found}"));
        }
        if self.renew_every == 0 {
            return Err("renew_every: expected at least 1, found 0".into());
        }
        Ok(())
    }
}

impl Described for Lemke {
    const ABOUT: &'static About = &About {
        name: "lemke",
        family: "pivoting",
        solves: Solves::Law,
        summary: "Lemke: complementary pivoting on a factorised basis; decides solvability for copositive-plus M",
        needs: &["the entries of M"],
        cites: &["Acary2018", "CottlePangStone2009", "Lemke1965", "Kostreva1979"],
        variants: &[
            "basis=tableau",
            "basis=dense",
            "basis=sparse",
            "ties=perturbed",
            "covering=row_norms",
            "covering=random",
        ],
        settings: described::<Self>,
    };
}

/// Beyond this, ties are broken by perturbation.
const LEXICOGRAPHIC_LIMIT: usize = 300;
/// Up to this, the tableau is fastest.
const TABLEAU_LIMIT: usize = 40;
/// A sparse matrix with more entries than this share of all is treated as dense.
const DENSITY: f64 = 0.2;
/// The elimination of a singular A is dense.
const ELIMINATION_LIMIT: usize = 3000;
/// Rows whose sizes differ by less are covered by ones.
const EVEN: f64 = 1e3;
/// A basis that reproduces a known vector less well is not one to start from.
const REGULAR: f64 = 1e-6;
/// A last basis that misses the problem by more is mended: it becomes the first basis of another path.
const MENDED: f64 = 1e-12;
/// An equality without a free variable that misses its right-hand side by less than this fraction of its terms repeats others, but for rounding.
const CONTRADICTS: f64 = 1e-12;
/// What counts as solved in the end, in the measure of `Path::violation`.
const SOLVED: f64 = 1e-9;
/// How often a path is tried again for reasons of rounding.
const TRIES: usize = 3;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// The first basis is to be made: from the caller's point.
    Warm,
    /// As before, from the rows in which q is negative.
    Negative,
    /// As before, from nothing.
    Cold,
    /// As before, from the basis where it stands.
    Here,
    /// On the path.
    Running,
    /// At its end.
    Finished,
}

/// The path with its basis, kept for problems of the same shape.
pub struct LemkeWork {
    path: Path,
    kind: BasisKind,
    phase: Phase,
    /// Rays that proved nothing, so far.
    rays: usize,
    first_ray: Option<Certificate>,
    /// Paths tried again for reasons of rounding, and last bases mended.
    again: usize,
    mended: usize,
    warm: bool,
    pivots: usize,
    dropped: usize,
    z: Vec<f64>,
    /// g, by slots.
    g: Vec<f64>,
    by_slot: Vec<f64>,
    alpha: Vec<bool>,
    /// w of the caller's point, and the largest modulus of each row.
    w: Vec<f64>,
    sizes: Vec<f64>,
    rng: Pcg64Mcg,
    record: Recorder<Pivot>,
}

impl<P: Complementary> Solver<P> for Lemke {
    type Work = LemkeWork;

    fn work(&self, problem: &P) -> Result<LemkeWork, SolveError> {
        let system = self.applies(problem)?;
        let kind = self.kind(&system);
        let data = Data::new(&system, kind != BasisKind::Sparse);
        let basis: Box<dyn Basis> = match kind {
            BasisKind::Tableau => Box::new(Tableau::default()),
            _ => Box::new(Factored::default()),
        };
        Ok(LemkeWork {
            path: Path::new(data, basis),
            kind,
            phase: Phase::Cold,
            rays: 0,
            first_ray: None,
            again: 0,
            mended: 0,
            warm: false,
            pivots: 0,
            dropped: 0,
            z: vec![],
            g: vec![],
            by_slot: vec![],
            alpha: vec![],
            w: vec![],
            sizes: vec![],
            rng: Pcg64Mcg::seed_from_u64(self.seed),
            record: Recorder::default(),
        })
    }

    fn refill(&self, problem: &P, work: &mut LemkeWork) -> Result<(), SolveError> {
        let system = self.applies(problem)?;
        if self.kind(&system) != work.kind {
            *work = self.work(problem)?;
            return Ok(());
        }
        work.path.data.fill(&system);
        Ok(())
    }

    fn start(&self, _: &P, point: &mut LcpPoint, work: &mut LemkeWork) {
        let settings = self;
        let free = work.path.data.free;
        let somewhere = point.z[free..].iter().any(|z| *z > 0.0);
        work.phase = if settings.warm && somewhere { Phase::Warm } else { Phase::Cold };
        (work.rays, work.again, work.mended, work.pivots, work.dropped) = (0, 0, 0, 0, 0);
        work.first_ray = None;
        work.rng = Pcg64Mcg::seed_from_u64(settings.seed);
        work.path.breaking = match settings.ties {
            Ties::Auto if work.path.data.n <= LEXICOGRAPHIC_LIMIT => Breaking::Lexicographic,
            Ties::Auto | Ties::Perturbed => Breaking::Perturbed,
            Ties::Lexicographic => Breaking::Lexicographic,
            Ties::Rows => Breaking::Rows,
            Ties::First => Breaking::First,
        };
        work.path.pivot_tolerance = settings.pivot_tolerance;
        work.path.renew_every = match work.kind {
            BasisKind::Tableau => usize::MAX,
            _ => settings.renew_every,
        };
    }

    fn step(&self, problem: &P, point: &mut LcpPoint, work: &mut LemkeWork) -> Step {
        let event = match work.phase {
            Phase::Running => work.path.pivot(),
            Phase::Finished => return Step::Done,
            Phase::Cold | Phase::Warm | Phase::Negative | Phase::Here => {
                match self.begin(problem, point, work) {
                    Ok(event) => event,
                    Err(step) => return step,
                }
            }
        };
        match event {
            Event::Pivoted(exchange) => {
                work.keep(exchange);
                Step::Continue { estimate: f64::NAN }
            }
            Event::Ended(exchange) => {
                work.keep(exchange);
                work.finish()
            }
            Event::Ray => self.ray(problem, work),
            Event::Trouble(why) => work.try_again(why),
        }
    }

    fn publish(&self, _: &P, point: &mut LcpPoint, work: &mut LemkeWork) {
        match work.phase {
            Phase::Finished => point.z.copy_from_slice(&work.z),
            Phase::Running => work.values(&mut point.z),
            Phase::Cold | Phase::Warm | Phase::Negative | Phase::Here => {}
        }
    }

    fn record(&self, on: bool, work: &mut LemkeWork) {
        work.record.begin(on);
    }

    fn trace(&self, work: &LemkeWork) -> Trace {
        Trace::Pivots(work.record.rows())
    }

    fn account(&self, work: &LemkeWork) -> Vec<String> {
        let kind = match work.kind {
            BasisKind::Tableau => "a dense tableau",
            BasisKind::Sparse => "a sparse factorised basis",
            _ => "a dense factorised basis",
        };
        let mut said = vec![format!("{} pivots on {kind}", work.pivots)];
        if work.dropped > 0 {
            said.push(format!("{} free variables are undetermined and stay zero", work.dropped));
        }
        if work.rays > 0 {
            said.push(format!("{} rays that prove nothing", work.rays));
        }
        if work.again + work.mended > 0 {
            let times = work.again + work.mended;
            said.push(format!("began again {times} times for reasons of rounding"));
        }
        said
    }

    /// Bases between are no approximations: the judge need not look.
    fn check_every(&self, _: &Self::Work) -> usize {
        usize::MAX
    }
}

impl Lemke {
    fn applies<'a, P: Complementary>(&self, problem: &'a P) -> Result<System<'a>, SolveError> {
        let system = problem.system()?;
        system.needs_entries()?;
        let fits =
            |d: &[f64]| d.len() == system.dim() && d.iter().all(|d| *d > 0.0 && d.is_finite());
        match &self.covering_vector {
            Some(d) if !fits(d) => Err(SolveError::needs(
                "a covering vector with a positive entry for each row",
                "another",
            )),
            _ => Ok(system),
        }
    }

    /// The basis that `Auto` stands for.
    fn kind(&self, system: &System) -> BasisKind {
        let n = system.dim();
        match (self.basis, system.matrix) {
            (BasisKind::Auto, _) if n <= TABLEAU_LIMIT => BasisKind::Tableau,
            (BasisKind::Auto, Matrix::Sparse(m)) if (m.nnz() as f64) < DENSITY * (n * n) as f64 => {
                BasisKind::Sparse
            }
            (BasisKind::Auto, _) => BasisKind::Dense,
            (kind, _) => kind,
        }
    }

    /// The first basis, and z0 into it; or the end, where there is nothing to do.
    fn begin<P: Complementary>(
        &self,
        problem: &P,
        point: &LcpPoint,
        work: &mut LemkeWork,
    ) -> Result<Event, Step> {
        let system = &system(problem);
        let phase = work.phase;
        work.warm = phase == Phase::Warm;
        let placed = match phase {
            Phase::Here => work.path.prepare().is_ok(),
            Phase::Warm => {
                work.active(system, point);
                work.place()
            }
            Phase::Negative => {
                let free = system.free();
                work.alpha.clear();
                work.alpha.extend(system.q.iter().enumerate().map(|(i, q)| i < free || *q < 0.0));
                work.place()
            }
            _ => {
                if let Some(row) = blocked_row(system, &mut work.alpha) {
                    work.phase = Phase::Finished;
                    work.z.clear();
                    work.z.extend_from_slice(&point.z);
                    return Err(Step::NoSolution(Certificate::Row { row }));
                }
                work.cold()
            }
        };
        if !placed {
            if phase == Phase::Cold && system.free() == 0 {
                return Err(Step::Stuck(
                    "the values of the first basis are beyond the range of double precision".into(),
                ));
            }
            if phase == Phase::Cold {
                return Err(Step::Stuck(
                    "no regular basis holds the free variables: A is singular, and complementary variables do not mend it".into(),
                ));
            }
            work.phase = Phase::Cold;
            return Err(Step::Continue { estimate: f64::NAN });
        }
        if let Some(certificate) = work.contradiction()
            && problem.evidence(&certificate).holds()
        {
            work.phase = Phase::Finished;
            work.z.clear();
            work.z.extend_from_slice(&point.z);
            return Err(Step::NoSolution(certificate));
        }
        work.phase = Phase::Running;
        if work.path.feasible() {
            return Err(work.finish());
        }
        self.choose_covering(system, work);
        let LemkeWork { path, g, rng, .. } = work;
        Ok(path.cover(g, || rng.random_range(1.0..2.0)))
    }

    /// g, in the order of the slots: `R d` for basic w, 1 for basic z.
    fn choose_covering(&self, system: &System, work: &mut LemkeWork) {
        let LemkeWork { path, g, by_slot, rng, rays, .. } = work;
        let n = path.data.n;
        // By rows first.
        g.clear();
        g.resize(n, 0.0);
        let rows = &path.data.row;
        let kinds = [self.covering, Covering::RowNorms, Covering::Random];
        let mut kind = kinds[(*rays).min(2)];
        if kind == Covering::Auto {
            let range = |of: fn(f64, f64) -> f64| rows.iter().copied().reduce(of).unwrap_or(1.0);
            let even = range(f64::max) <= EVEN * range(f64::min);
            kind = if even { Covering::Ones } else { Covering::Scaled };
        }
        match (&self.covering_vector, kind) {
            (Some(d), _) if *rays == 0 => g.copy_from_slice(d),
            (_, Covering::Auto | Covering::Ones) => g.fill(1.0),
            (_, Covering::Scaled) => g.iter_mut().zip(rows).for_each(|(g, r)| *g = 1.0 / r),
            (_, Covering::RowNorms) => {
                g.iter_mut().zip(system.q).for_each(|(g, q)| *g = q.abs());
                system.matrix.for_each(|i, _, x| g[i] += x.abs());
                g.iter_mut().filter(|g| **g == 0.0).for_each(|g| *g = 1.0);
            }
            (_, Covering::Random) => {
                g.iter_mut().for_each(|g| *g = rng.random_range(-1.0_f64..1.0).exp2());
            }
        }
        g.iter_mut().zip(rows).for_each(|(g, r)| *g *= r);
        let largest = g.iter().fold(0.0_f64, |l, g| l.max(*g));
        // A power of two, so that the ratios stay as they are.
        let unit = (-largest.log2().round()).exp2();
        g.iter_mut().for_each(|g| *g *= unit);
        path.artificial_unit = unit;
        let in_slots = by_slot;
        in_slots.clear();
        in_slots.extend(path.basic.iter().map(|v| match v {
            Variable::W(i) => g[*i],
            _ => 1.0,
        }));
        std::mem::swap(g, in_slots);
    }

    /// At the end of a ray: a proof, another covering vector, or nothing.
    fn ray<P: Complementary>(&self, problem: &P, work: &mut LemkeWork) -> Step {
        let ray = work.secondary_ray();
        if problem.verify(&ray) {
            return Step::NoSolution(ray);
        }
        work.phase = Phase::Cold;
        if !work.warm || work.rays > 0 {
            work.rays += 1;
            if work.rays > self.restarts {
                work.phase = Phase::Running;
                return Step::NoSolution(work.first_ray.take().unwrap_or(ray));
            }
            // Every third time from where the negative rows are equations.
            if work.rays.is_multiple_of(3) {
                work.phase = Phase::Negative;
            }
            work.first_ray.get_or_insert(ray);
        }
        Step::Continue { estimate: f64::NAN }
    }
}

impl LemkeWork {
    fn keep(&mut self, exchange: Exchange) {
        self.pivots += 1;
        let z0 = self.path.slot(Variable::Artificial).map_or(0.0, |s| self.path.x[s]);
        self.record.push(Pivot {
            iteration: self.pivots,
            entering: exchange.entering,
            leaving: exchange.leaving,
            ratio: exchange.ratio,
            z0: Some(z0 * self.path.artificial_unit),
        });
    }

    /// α of a caller's point: the z that weigh more than their w.
    fn active(&mut self, system: &System, point: &LcpPoint) {
        let Self { path, alpha, w, sizes, .. } = self;
        let (n, free) = (system.dim(), path.data.free);
        sizes.clear();
        sizes.resize(n, 0.0_f64);
        system.matrix.for_each(|i, _, x| sizes[i] = sizes[i].max(x.abs()));
        w.resize(n, 0.0);
        system.matrix.mul(&point.z, w);
        alpha.clear();
        alpha.extend(
            (0..n).map(|i| {
                i < free || (point.z[i] > 0.0 && sizes[i] * point.z[i] > w[i] + system.q[i])
            }),
        );
    }

    /// The basis of α; false where it is not regular.
    fn place(&mut self) -> bool {
        let Self { path, alpha, .. } = self;
        path.place(alpha).is_ok() && path.accuracy() <= REGULAR
    }

    /// The basis of the free variables.
    fn cold(&mut self) -> bool {
        let (n, free) = (self.path.data.n, self.path.data.free);
        self.alpha.clear();
        self.alpha.extend((0..n).map(|i| i < free));
        self.dropped = 0;
        if self.place() {
            return true;
        }
        if n > ELIMINATION_LIMIT {
            return false;
        }
        self.path.basic = with_free_variables(&self.path.data);
        let open = |v: &&Variable| matches!(v, Variable::W(i) if *i < free);
        self.dropped = self.path.basic.iter().filter(open).count();
        self.path.prepare().is_ok()
    }

    /// An equality without a free variable that no variable can satisfy: its row of B⁻¹.
    fn contradiction(&mut self) -> Option<Certificate> {
        if self.dropped == 0 {
            return None;
        }
        let Self { path, .. } = self;
        let free = path.data.free;
        let open = |s: &usize| matches!(path.basic[*s], Variable::W(i) if i < free);
        let worst = (0..path.basic.len())
            .filter(open)
            .max_by(|&a, &b| path.x[a].abs().total_cmp(&path.x[b].abs()))?;
        let x = path.x[worst];
        let mut y = vec![0.0; path.data.n];
        path.row(worst, &mut y);
        let terms: f64 = y.iter().zip(&path.data.q).map(|(y, q)| (y * q).abs()).sum();
        if x.abs() <= CONTRADICTS * terms {
            return None;
        }
        let largest = y.iter().fold(0.0_f64, |l, y| l.max(y.abs()));
        for (i, (y, r)) in y.iter_mut().zip(&path.data.row).enumerate() {
            let rounding = y.abs() <= 1e-12 * largest;
            *y = if rounding { 0.0 } else { -x.signum() * *y * r };
            if i >= free {
                *y = y.max(0.0);
            }
        }
        Some(Certificate::Farkas { y })
    }

    /// z of the basis where it stands, in the problem's units.
    fn values(&self, z: &mut [f64]) {
        z.fill(0.0);
        for (&v, &x) in self.path.basic.iter().zip(&self.path.x) {
            if let Variable::Z(j) = v {
                let x = if self.path.bounded(v) { x.max(0.0) } else { x };
                z[j] = x * self.path.unit(v);
            }
        }
    }

    /// The answer of a complementary basis.
    fn finish(&mut self) -> Step {
        if let Err(why) = self.path.refine() {
            return self.try_again(why);
        }
        let violation = self.path.violation();
        let mendable = violation > MENDED && self.mended < TRIES;
        let mut z = std::mem::take(&mut self.z);
        z.resize(self.path.data.n, 0.0);
        self.values(&mut z);
        self.z = z;
        if mendable && self.dropped == 0 {
            self.mended += 1;
            self.phase = Phase::Here;
            return Step::Continue { estimate: f64::NAN };
        }
        self.phase = Phase::Finished;
        if violation <= SOLVED {
            Step::Done
        } else if self.dropped > 0 {
            Step::Stuck(
                "an equality has no free variable of its own, and the path does not satisfy it"
                    .into(),
            )
        } else {
            Step::Stuck("the last basis is not feasible to working accuracy".into())
        }
    }

    /// From the beginning, with larger pivots, more factorisations and ties that depend less on rounding.
    fn try_again(&mut self, why: &'static str) -> Step {
        self.again += 1;
        if self.again >= TRIES || self.path.breaking == Breaking::First {
            return Step::Stuck(why.into());
        }
        if self.path.breaking == Breaking::Lexicographic {
            self.path.breaking = Breaking::Perturbed;
        }
        self.path.pivot_tolerance = (self.path.pivot_tolerance * 30.0).min(1e-7);
        self.path.renew_every = (self.path.renew_every / 4).max(4);
        self.phase = Phase::Cold;
        Step::Continue { estimate: f64::NAN }
    }

    /// The direction of the ray, in the problem's units, without what is rounding.
    fn secondary_ray(&self) -> Certificate {
        const ROUNDING: f64 = 1e-12;
        let path = &self.path;
        let y = path.last_column();
        let size = y.iter().fold(1.0_f64, |l, y| l.max(y.abs()));
        let (mut z, mut z0) = (vec![0.0; path.data.n], 0.0);
        let each = path.basic.iter().copied().zip(y.iter().map(|y| -y));
        for (v, x) in each.chain([(path.driving(), 1.0)]) {
            let x = if x.abs() <= ROUNDING * size { 0.0 } else { x };
            match v {
                Variable::Z(j) if path.bounded(v) => z[j] = x.max(0.0) * path.unit(v),
                Variable::Z(j) => z[j] = x * path.unit(v),
                Variable::Artificial => z0 = x.max(0.0) * path.artificial_unit,
                Variable::W(_) => {}
            }
        }
        Certificate::Ray { z, z0 }
    }
}

/// A row with `q_i < 0` that no variable lifts: (19).
fn blocked_row(system: &System, lifted: &mut Vec<bool>) -> Option<usize> {
    let free = system.free();
    lifted.clear();
    lifted.extend(system.q.iter().enumerate().map(|(i, q)| i < free || *q >= 0.0));
    let lifts = |j: usize, x: f64| x > 0.0 || (j < free && x != 0.0);
    match system.matrix {
        Matrix::Dense(a) => {
            for (i, lifted) in lifted.iter_mut().enumerate().filter(|l| !*l.1) {
                *lifted = a.row(i).iter().enumerate().any(|(j, &x)| lifts(j, x));
            }
        }
        m => {
            m.for_each(|i, j, x| lifted[i] |= lifts(j, x));
        }
    }
    lifted.iter().position(|l| !l)
}

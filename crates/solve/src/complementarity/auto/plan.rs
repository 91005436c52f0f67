//! Which solvers `auto` tries on a linear complementarity problem, in which order, and why.

use std::borrow::Cow;

use nonsmooth_analysis::{Class, Classes};
use nonsmooth_linalg::Matrix;
use nonsmooth_problem::{BoxLcp, Hlcp, Lcp, Mlcp};

use super::{Auto, Candidate};
use crate::complementarity::parts::game::is_game;
use crate::core::portfolio::DECIDES;
use crate::core::settings::SettingsMap;

/// Up to this many variables a dense pivoting method is affordable.
const DENSE: usize = 2000;
/// Up to this many variables a pivot on a sparse basis is.
const SPARSE: usize = 10_000;
/// Beyond this many variables of a sparse matrix an interior point's few factorisations are cheaper than many pivots, and Newton's than blocks of pivots that
/// move a front from row to row.
const LARGE: usize = 1000;
/// Beyond this many variables the class is not asked for.
const HUGE: usize = 50_000;

/// What a plan goes by.
#[derive(Debug, Clone)]
struct Facts {
    n: usize,
    sparse: bool,
    symmetric: bool,
    positive_diagonal: bool,
    /// What O(nnz) operations and at most two Cholesky factorisations show; none of huge matrices.
    classes: Option<Classes>,
}

impl Facts {
    /// `None` of an operator.
    fn of(m: &Matrix) -> Option<Self> {
        let n = m.nrows();
        let sparse = matches!(m, Matrix::Sparse(a) if a.nnz() < n * n / 4);
        let symmetric = m.asymmetry()? == 0.0;
        let positive_diagonal = m.diagonal()?.iter().all(|d| *d > 0.0);
        let classes = (n <= HUGE).then(|| Classes::quick(m));
        Some(Self { n, sparse, symmetric, positive_diagonal, classes })
    }

    fn is_not(&self, class: Class) -> bool {
        self.classes.as_ref().is_some_and(|c| c.is_not(class))
    }

    fn is(&self, class: Class) -> bool {
        self.classes.as_ref().is_some_and(|c| c.is(class))
    }

    /// Positive semidefinite, at least up to rounding.
    fn monotone(&self) -> bool {
        self.classes.as_ref().is_some_and(|c| c.is_likely(Class::PositiveSemidefinite))
    }

    /// Whether factorisations are so cheap, and pivots so many, that the fewest of them win.
    fn large(&self) -> bool {
        self.sparse && self.n > LARGE
    }

    /// Whether Lemke's method is affordable.
    fn pivotal(&self) -> bool {
        self.n <= if self.sparse { SPARSE } else { DENSE }
    }

    /// The class that the choice goes by, in words.
    fn class(&self) -> &'static str {
        if self.symmetric && self.is(Class::PositiveDefinite) {
            "M is symmetric positive definite"
        } else if self.is(Class::PositiveDefinite) {
            "M is positive definite"
        } else if self.is(Class::HPlus) {
            "M is in H+"
        } else if self.is(Class::P) {
            "M is a P-matrix"
        } else if self.monotone() {
            "M is positive semidefinite"
        } else if self.is(Class::CopositivePlus) {
            "M is copositive-plus"
        } else if self.classes.is_none() && self.symmetric {
            "M is symmetric"
        } else {
            "M is of unknown class"
        }
    }
}

/// A plan that grows.
pub(super) struct Plan(pub(super) Vec<Candidate>);

impl Plan {
    pub(super) fn new() -> Self {
        Self(vec![])
    }

    pub(super) fn then(
        mut self,
        name: impl Into<Cow<'static, str>>,
        iterations: usize,
        because: impl Into<String>,
    ) -> Self {
        let (name, settings, because) = (name.into(), SettingsMap::new(), because.into());
        self.0.push(Candidate { name, settings, iterations, because, anew: false });
        self
    }

    /// A candidate that begins where the solve began.
    pub(super) fn anew(
        self,
        name: impl Into<Cow<'static, str>>,
        iterations: usize,
        because: impl Into<String>,
    ) -> Self {
        let mut plan = self.then(name, iterations, because);
        plan.0.iter_mut().next_back().into_iter().for_each(|last| last.anew = true);
        plan
    }

    /// The same with a setting for the last candidate.
    pub(super) fn with(mut self, key: &str, value: impl Into<serde_json::Value>) -> Self {
        if let Some(last) = self.0.last_mut() {
            last.settings.insert(key.into(), value.into());
        }
        self
    }

    fn when(self, condition: bool, more: impl FnOnce(Self) -> Self) -> Self {
        if condition { more(self) } else { self }
    }
}

/// A budget for pivots: Lemke's method takes some n to 3n of them where all goes well.
fn pivots(n: usize) -> usize {
    20 * n + 200
}

/// As many pivots as are needed where all goes well: on a longer path other methods have their turn first.
fn short_path(n: usize) -> usize {
    5 * n + 50
}

/// Single changes of block pivoting, each at the price of a factorisation, after which others have their turn.
const SINGLES: usize = 20;

/// Where Lemke's method is sure to end in a solution, and Newton's and interior points are not, it has so many times the usual pivots.
const SURE: usize = 2;
const SURE_AGAIN: usize = 4;

/// Iterations of an interior point, which takes some thirty where all goes well, before pivots.
const INTERIOR: usize = 60;

/// No entry of M + Mᵀ is negative, and the diagonal is positive: strictly copositive, so that Lemke's path ends in a solution.
fn is_plainly_copositive(m: &Matrix) -> bool {
    let n = m.nrows();
    let nonnegative = match m {
        Matrix::Dense(a) => (0..n).all(|i| (0..i).all(|j| a.row(i)[j] + a.row(j)[i] >= 0.0)),
        Matrix::Sparse(a) => (0..n).all(|j| {
            let (rows, values) = a.column(j);
            rows.iter().zip(values).all(|(&i, &x)| {
                let (across, opposite) = a.column(i);
                x >= 0.0 || across.binary_search(&j).is_ok_and(|k| x + opposite[k] >= 0.0)
            })
        }),
        Matrix::Operator(_) => false,
    };
    nonnegative && m.diagonal().is_some_and(|d| d.iter().all(|d| *d > 0.0))
}

/// Bases to enumerate: all of them.
pub(super) const ALL: usize = usize::MAX;

/// Up to so many pairs exact arithmetic decides in milliseconds. It comes after the methods that may solve what rounding alone makes contradictory, such as
/// equations that repeat each other nearly.
const EXACT: usize = 12;

fn exactly(plan: Plan) -> Plan {
    plan.then(DECIDES, ALL, "decides, whatever the class and the scaling").with("max_pairs", 40)
}

/// Of bimatrix games: every label leads to an equilibrium.
fn games(n: usize) -> Plan {
    let game = "a bimatrix game";
    let mut plan = Plan::new().then("lemke_howson", PATIENT * pivots(n), game);
    for label in (1..n).take(LABELS) {
        plan = plan.then("lemke_howson", PATIENT * pivots(n), "another label").with("label", label);
    }
    plan.then("lemke", pivots(n), game).then("newton_fb", 500, "globalised")
}

/// Labels that are tried, and so many times the usual pivots: paths may be long, but each ends.
const LABELS: usize = 7;
const PATIENT: usize = 10;

/// The stage before any look at the matrix, and that of the plan by class and structure; later ones spend what time is left.
const AT_ONCE: usize = 0;
const BY_CLASS: usize = 1;
/// Up to this many variables of a dense matrix pivots begin at zero; up to [`DENSE`] and, of sparse matrices, up to the second a class costs as much as a solve by pivots.
const SMALL: usize = 1000;
const SMALL_SPARSE: usize = 500;
/// From this many variables on a few sweeps over a dense matrix are cheap beside pivots.
const SWEPT: usize = 60;

/// Sweeps that cost less than pivots and factorisations: on grids of n points over-relaxation takes O(√n), and n pivots on a dense tableau cost as much as some
/// 30 sweeps.
fn sweeps(m: &Matrix) -> usize {
    let n = m.nrows() as f64;
    match m {
        Matrix::Sparse(_) => (50.0 + 10.0 * n.sqrt()).min(3000.0) as usize,
        _ => 30,
    }
}

/// Sweeps that are cheaper than the levels of multigrid.
const FEW_SWEEPS: usize = 40;
/// Steps of multigrid: on grids a dozen or two is enough, and where it gets no further it ends by itself.
const MULTIGRID: usize = 100;

/// Over-relaxation of huge matrices without symmetry, by factors that stay: what adapts goes by a relation that convection does not obey, and on a grid the right factor takes a tenth of the sweeps of one
/// that is a little off.
fn relaxed(plan: Plan) -> Plan {
    [1.8, 1.6].into_iter().fold(plan, |plan, omega| {
        let why = "not symmetric, by a factor that stays";
        let plan = plan.anew("psor", FIXED_SWEEPS, why).with("patience", FIXED_SWEEPS);
        plan.with("omega", omega).with("adapt", false)
    })
}

/// Sweeps that a factor that stays may promise.
const FIXED_SWEEPS: usize = 1200;

/// Whether pivots come before any look at the class, where `size` pairs and equations are pivoted on.
fn is_small(m: &Matrix, size: usize) -> bool {
    match m {
        Matrix::Dense(_) => size <= DENSE,
        Matrix::Sparse(_) => size <= SMALL_SPARSE,
        Matrix::Operator(_) => false,
    }
}

/// What needs no look at the class: sweeps, as long as their rate promises an end, and pivots, where these are cheap.
fn at_once(m: &Matrix, dense_from: usize, pivoting: &'static str, size: usize) -> Plan {
    let n = m.nrows();
    let small = is_small(m, size);
    let sweepable = match m {
        Matrix::Dense(_) => n >= dense_from,
        Matrix::Sparse(_) => true,
        Matrix::Operator(_) => false,
    };
    let sweepable = sweepable && m.diagonal().is_some_and(|d| d.iter().all(|d| *d > 0.0));
    let sparse = matches!(m, Matrix::Sparse(_));
    let symmetric = sparse && m.asymmetry() == Some(0.0);
    let (large, most) = (sparse && n > LARGE, sweeps(m));
    let relaxed = |p: Plan, omega: f64, adapt: bool, patience: usize| {
        let p = p.then("psor", patience, "as long as its rate is good").with("patience", patience);
        p.with("omega", omega).with("adapt", adapt)
    };
    // Where a few sweeps do not do, multigrid from zero, then over-relaxation. Without symmetry that may do harm, and waves take their time.
    let first = match (large, symmetric) {
        (true, true) => FEW_SWEEPS,
        (true, false) => most / 3,
        _ => most,
    };
    Plan::new()
        .when(sweepable, |p| relaxed(p, 1.0, symmetric && !large, first))
        .when(sweepable && large && symmetric, |p| {
            p.anew("tnnmg", MULTIGRID, "large and symmetric")
        })
        .when(sweepable && large, |p| relaxed(p, 1.3, true, most))
        // From zero: the basis that sweeps without an end leave is far from the path. Of larger matrices it is often near, and pivots are dear.
        .when(small && size <= SMALL, |p| {
            p.anew(pivoting, short_path(size), "small").with("restarts", 0)
        })
        .when(small && size > SMALL, |p| {
            p.then(pivoting, short_path(size), "dense").with("restarts", 0)
        })
}

/// The names by which the methods of [`patiently`] solve a kind of problem.
struct Patient {
    pivoting: Option<&'static str>,
    newton: [&'static str; 2],
    enumeration: &'static str,
}

/// As long as the limits allow: pivots from other covering vectors, Newton's method from other starts, with more patience each time, and all cases of few pairs.
fn patiently(by: Patient, m: &Matrix, pairs: usize, stage: usize) -> Vec<Candidate> {
    let (n, turn) = (m.nrows(), stage - BY_CLASS);
    let pivotal = match m {
        Matrix::Dense(_) => n <= DENSE,
        Matrix::Sparse(_) => n <= SPARSE,
        Matrix::Operator(_) => return vec![],
    };
    let times = 1 << turn.min(MOST_PATIENT);
    let mut plan = Plan::new();
    // Few pairs have few cases that are not closed early, and their number has no bound but 2ⁿ: as many more each turn, until it ends.
    if pairs <= MOST_PAIRS {
        plan = plan.then(by.enumeration, CASES << turn.min(MOST_PAIRS / 2), "decides, if it ends");
        plan = plan.with("max_pairs", MOST_PAIRS);
    }
    if let Some(lemke) = by.pivoting.filter(|_| pivotal) {
        let more = pivots(n).saturating_mul(times);
        plan = plan.then(lemke, more, "with patience").then(lemke, more, "other covering vectors");
        plan = plan.with("covering", "random").with("seed", turn + 1).with("restarts", RESTARTS);
    }
    for newton in by.newton {
        plan = plan.then(newton, NEWTON * times, "from other starts");
        plan = plan.with("seed", turn).with("restarts", RESTARTS);
    }
    plan.0
}

/// Budgets double with each turn up to this one.
const MOST_PATIENT: usize = 10;
/// Starts that a method may use up in a turn, more than it comes to.
const RESTARTS: usize = 1000;
/// Newton's steps of a turn, which take about as long as the pivots.
const NEWTON: usize = 15;
/// Batches of 64 cases.
const CASES: usize = 4;
const MOST_PAIRS: usize = 40;

const OF_PAIRS: Patient = Patient {
    pivoting: Some("lemke"),
    newton: ["newton_pfb", "newton_min"],
    enumeration: "enumeration",
};

pub(super) fn of_lcp(problem: &Lcp, settings: &Auto, stage: usize) -> Vec<Candidate> {
    match stage {
        AT_ONCE if is_game(problem) => return games(problem.dim()).0,
        AT_ONCE => {
            let Plan(mut plan) = at_once(&problem.M, SWEPT, "lemke", problem.dim());
            if problem.dim() <= SMALL && is_plainly_copositive(&problem.M) {
                let lemke = plan.iter_mut().filter(|c| c.name == "lemke");
                lemke.for_each(|c| c.iterations = SURE * pivots(problem.dim()));
            }
            return plan;
        }
        BY_CLASS => {}
        _ => return patiently(OF_PAIRS, &problem.M, problem.dim(), stage),
    }
    let Some(facts) = Facts::of(&problem.M) else {
        return of_operator();
    };
    let (n, tried) = (facts.n, facts.n <= SMALL && is_small(&problem.M, facts.n));
    // Finite for P; and a Z-matrix with a positive diagonal may well be one.
    let blocks = facts.is(Class::P) || (facts.is(Class::Z) && facts.positive_diagonal);
    let transport = facts.large() && !facts.symmetric && facts.is_not(Class::Z);
    let plan = Plan::new()
        .when(blocks && transport, |p| p.then("newton_fb", 100, "large and not symmetric"))
        .when(blocks, |p| {
            p.then("block_pivoting", 300, facts.class()).with("most_singles", SINGLES)
        })
        // Where there is no point with all of z and w positive, as of linear programs with variables that cost nothing, it does not end; pivots do.
        .when(facts.monotone() && facts.large(), |p| {
            p.then("ip_mehrotra", if facts.pivotal() { INTERIOR } else { 200 }, facts.class())
        })
        // A long path ends all the same.
        .when(tried && !facts.monotone() && facts.is(Class::CopositivePlus), |p| {
            p.anew("lemke", SURE_AGAIN * pivots(n), facts.class())
        })
        .when(tried && !facts.monotone(), |p| {
            p.anew("newton_pfb", 12, "globalised, superlinear where it converges").anew(
                "ip_mehrotra",
                60,
                "as long as it goes well",
            )
        })
        .when(tried && !facts.monotone(), |p| p.anew("newton_pfb", 200, "with patience"))
        .when(facts.pivotal(), |p| p.then("lemke", pivots(n), facts.class()))
        .when(n > HUGE && facts.positive_diagonal && !facts.symmetric, relaxed)
        .when(n > HUGE, |p| p.then("psor", 3000, "sweeps cost less than factorisations"))
        .when(!facts.pivotal(), |p| {
            p.then("newton_min", 30, "from the face that sweeps have found")
        })
        .when(n > HUGE && !facts.symmetric, |p| p.anew("newton_fb", 150, "globalised"))
        .then("ip_mehrotra", if facts.monotone() || n > DENSE { 200 } else { 50 }, facts.class())
        .then("newton_min", 300, "superlinear where it converges")
        .then("newton_fb", 500, "globalised")
        .when(n <= EXACT, exactly)
        .when(facts.pivotal(), |p| {
            p.then("lemke", pivots(n), "another covering vector").with("covering", "random")
        })
        .when(facts.monotone() && n <= DENSE, |p| p.then("keller", pivots(n), facts.class()))
        .when(n <= settings.enumerate_below, |p| {
            p.then("enumeration", ALL, "decides, whatever the class")
        })
        .when(n <= DENSE, |p| p.then("criss_cross", pivots(n), "finite for sufficient M"))
        .then("rpsor", 100_000, "needs no factorisation");
    plan.0
}

pub(super) fn of_mlcp(problem: &Mlcp, settings: &Auto, stage: usize) -> Vec<Candidate> {
    let pairs = problem.pairs();
    let square = problem.equalities == problem.free;
    match stage {
        AT_ONCE if square && is_game(problem) => return games(problem.q.len()).0,
        AT_ONCE if square => {
            return at_once(&problem.M, usize::MAX, "lemke", problem.q.len()).0;
        }
        AT_ONCE => return vec![],
        BY_CLASS => {}
        _ => {
            let pivoting = OF_PAIRS.pivoting.filter(|_| square);
            return patiently(Patient { pivoting, ..OF_PAIRS }, &problem.M, pairs, stage);
        }
    }
    let enumeration = |p: Plan| p.then("enumeration", ALL, "decides, whatever the class");
    let few = pairs <= EXACT && problem.q.len() + problem.free <= 4 * EXACT;
    if !square {
        let why = "more or fewer equalities than free variables";
        return Plan::new()
            .then("newton_fb", 500, why)
            .when(few, exactly)
            .when(pairs <= settings.enumerate_below, enumeration)
            .0;
    }
    let n = problem.q.len();
    let Some(facts) = Facts::of(&problem.M) else {
        return of_operator();
    };
    let tried = is_small(&problem.M, n);
    Plan::new()
        .when(facts.monotone() && facts.large(), |p| p.then("ip_mehrotra", 200, facts.class()))
        // Pivots have had their turn: where free variables are not determined, an interior point that takes some nearby loses nothing by it.
        .when(facts.monotone() && tried, |p| p.then("ip_mehrotra", 200, facts.class()))
        .when(facts.pivotal(), |p| p.then("lemke", pivots(n), facts.class()))
        .when(facts.monotone() && !tried, |p| p.then("ip_mehrotra", 200, facts.class()))
        .then("newton_min", 300, "superlinear where it converges")
        .then("newton_fb", 500, "globalised")
        .when(few, exactly)
        .when(pairs <= settings.enumerate_below, enumeration)
        .when(facts.pivotal(), |p| {
            p.then("lemke", pivots(n), "another covering vector").with("covering", "random")
        })
        .when(n <= DENSE, |p| p.then("reduce/lemke", pivots(n), "without the free variables"))
        .when(!facts.monotone(), |p| p.then("ip_mehrotra", 200, facts.class()))
        .then("newton_pfb", 500, "another merit function")
        .then("rpsor", 100_000, "needs no factorisation")
        .0
}

pub(super) fn of_box(problem: &BoxLcp, settings: &Auto, stage: usize) -> Vec<Candidate> {
    let bounds = problem.lower.iter().zip(&problem.upper);
    // Second bounds become pairs of their own.
    let twice = bounds.clone().filter(|(l, u)| l.is_finite() && u.is_finite() && l != u).count();
    let finite: usize =
        bounds.map(|(l, u)| usize::from(l.is_finite()) + usize::from(u.is_finite())).sum();
    let n = problem.dim();
    let split = n + twice;
    match stage {
        AT_ONCE => {
            let m = &problem.M;
            let Plan(mut plan) = at_once(m, SWEPT_BOX, "split/lemke", split);
            if n <= SMALL && m.asymmetry() == Some(0.0) {
                // Conjugate gradients where sweeps are slow; pivots come after them.
                let most =
                    if matches!(m, Matrix::Sparse(_)) { CONJUGATE.max(2 * n) } else { CONJUGATE };
                let cg = Plan::new().then("mprgp", most, "symmetric");
                let at = plan.len() - plan.iter().filter(|c| c.name == "split/lemke").count();
                plan.splice(at..at, cg.0);
            }
            return plan;
        }
        BY_CLASS => {}
        _ => {
            let by = Patient {
                pivoting: Some("split/lemke"),
                enumeration: "split/enumeration",
                ..OF_PAIRS
            };
            return patiently(by, &problem.M, problem.dim(), stage);
        }
    }
    let Some(facts) = Facts::of(&problem.M) else {
        return of_operator();
    };
    Plan::new()
        .when(split <= SMALL, |p| p.anew("newton_pfb", 100, "globalised, whatever the class"))
        .when(split <= SMALL || (facts.monotone() && facts.large()), |p| {
            p.then("split/ip_mehrotra", 100, facts.class())
        })
        .when(facts.monotone() && !facts.large() && split > SMALL, |p| {
            p.then("newton_min", FEW_STEPS, "as long as few steps do").then(
                "split/ip_mehrotra",
                100,
                facts.class(),
            )
        })
        .then("newton_min", 100, facts.class())
        .then("newton_fb", 200, "globalised")
        .when(finite <= 2 * EXACT && n <= EXACT, exactly)
        .when(facts.pivotal(), |p| p.then("split/lemke", pivots(split), "decides more classes"))
        .then("split/ip_mehrotra", 200, facts.class())
        .then("newton_pfb", 500, "another merit function")
        .when(finite <= settings.enumerate_below, |p| {
            p.then("split/enumeration", ALL, "decides, whatever the class")
        })
        .then("rpsor", 100_000, "needs no factorisation")
        .0
}

/// From this many variables on a few sweeps over a dense box problem are cheap beside pivots with all bounds.
const SWEPT_BOX: usize = 8;
/// Steps of conjugate gradients that are cheap beside pivots, over a dense matrix; over a sparse one more of them are.
const CONJUGATE: usize = 150;

/// Newton's steps after which an interior point, which takes some twenty whatever the problem, has its turn.
const FEW_STEPS: usize = 12;

pub(super) fn of_hlcp(problem: &Hlcp, settings: &Auto, stage: usize) -> Vec<Candidate> {
    match stage {
        AT_ONCE => return vec![],
        BY_CLASS => {}
        _ => {
            let by = Patient {
                pivoting: Some("mixed/lemke"),
                newton: ["mixed/newton_pfb", "mixed/newton_min"],
                enumeration: "mixed/enumeration",
            };
            return patiently(by, &problem.Q, problem.dim(), stage);
        }
    }
    let n = problem.dim();
    Plan::new()
        .then("ip_mehrotra", 200, "the method of horizontal problems")
        .when(n <= DENSE, |p| p.then("mixed/lemke", pivots(2 * n), "pivots where monotony fails"))
        .then("mixed/newton_fb", 500, "globalised")
        .when(n <= EXACT, exactly)
        .when(n <= settings.enumerate_below, |p| {
            p.then("mixed/enumeration", ALL, "decides, whatever the class")
        })
        .then("ip_mty", 1000, "short steps")
        .0
}

/// Products are all there is.
fn of_operator() -> Vec<Candidate> {
    Plan::new()
        .then("mprgp", 20_000, "needs products only")
        .then("projected_jacobi", 100_000, "needs products and the diagonal only")
        .0
}

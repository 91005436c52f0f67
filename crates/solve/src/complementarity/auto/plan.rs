//! Which solvers `auto` tries on a linear complementarity problem, in which order, and why.

use nonsmooth_analysis::{Class, Classes};
use nonsmooth_linalg::Matrix;
use nonsmooth_problem::{BoxLcp, Hlcp, Lcp, Mlcp};

use super::portfolio::DECIDES;
use super::{Candidate, LinearAuto};
use crate::core::settings::SettingsMap;

/// Up to this many variables a dense pivoting method is affordable.
const DENSE: usize = 2000;
/// Up to this many variables a pivot on a sparse basis is.
const SPARSE: usize = 10_000;
/// Beyond this many variables sweeps over a sparse symmetric matrix come before its factorisation.
const LARGE: usize = 2000;
/// Sweeps that cost no more than a few factorisations.
const SWEEPS: usize = 2000;
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

    fn is(&self, class: Class) -> bool {
        self.classes.as_ref().is_some_and(|c| c.is(class))
    }

    /// Positive semidefinite, at least up to rounding.
    fn monotone(&self) -> bool {
        self.classes.as_ref().is_some_and(|c| c.is_likely(Class::PositiveSemidefinite))
    }

    /// Whether sweeps may well be the fastest.
    fn sweepable(&self) -> bool {
        self.symmetric && self.positive_diagonal && self.sparse && self.n > LARGE
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
struct Plan(Vec<Candidate>);

impl Plan {
    fn new() -> Self {
        Self(vec![])
    }

    fn then(mut self, name: &'static str, iterations: usize, because: impl Into<String>) -> Self {
        let because = because.into();
        self.0.push(Candidate { name, settings: SettingsMap::new(), iterations, because });
        self
    }

    /// The same with a setting for the last candidate.
    fn with(mut self, key: &str, value: impl Into<serde_json::Value>) -> Self {
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

/// Bases to enumerate: all of them.
const ALL: usize = usize::MAX;

/// Up to so many pairs exact arithmetic decides in milliseconds. It comes after the methods that may solve what rounding alone makes contradictory, such as
/// equations that repeat each other nearly.
const EXACT: usize = 12;

fn exactly(plan: Plan) -> Plan {
    plan.then(DECIDES, ALL, "decides, whatever the class and the scaling").with("max_pairs", 40)
}

pub(super) fn of_lcp(problem: &Lcp, settings: &LinearAuto) -> Vec<Candidate> {
    let Some(facts) = Facts::of(&problem.M) else {
        return of_operator();
    };
    let n = facts.n;
    let mut plan = Plan::new();
    if facts.sweepable() {
        plan = plan.then("psor", SWEEPS, format!("{}, sparse and large", facts.class()));
    }
    // Finite for P; and a Z-matrix with a positive diagonal may well be one.
    if facts.is(Class::P) || (facts.is(Class::Z) && facts.positive_diagonal) {
        plan = plan.then("block_pivoting", 300, facts.class());
    }
    plan = plan
        .when(facts.pivotal(), |p| p.then("lemke", pivots(n), facts.class()))
        .when(facts.monotone() || n > DENSE, |p| p.then("ip_mehrotra", 200, facts.class()))
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

pub(super) fn of_mlcp(problem: &Mlcp, settings: &LinearAuto) -> Vec<Candidate> {
    let pairs = problem.pairs();
    let enumeration = |p: Plan| p.then("enumeration", ALL, "decides, whatever the class");
    let few = pairs <= EXACT && problem.q.len() + problem.free <= 4 * EXACT;
    if problem.equalities != problem.free {
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
    Plan::new()
        .when(facts.pivotal(), |p| p.then("lemke", pivots(n), facts.class()))
        .when(facts.monotone(), |p| p.then("ip_mehrotra", 200, facts.class()))
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

pub(super) fn of_box(problem: &BoxLcp, settings: &LinearAuto) -> Vec<Candidate> {
    let Some(facts) = Facts::of(&problem.M) else {
        return of_operator();
    };
    let bounds = problem.lower.iter().chain(&problem.upper);
    let finite = bounds.filter(|b| b.is_finite()).count();
    let n = facts.n;
    Plan::new()
        .when(facts.sweepable(), |p| {
            p.then("psor", SWEEPS, format!("{}, sparse and large", facts.class()))
        })
        .then("newton_min", 300, facts.class())
        .then("newton_fb", 500, "globalised")
        .when(finite <= 2 * EXACT && n <= EXACT, exactly)
        .when(facts.pivotal(), |p| {
            p.then("split/lemke", pivots(n + finite), "decides more classes")
        })
        .when(facts.monotone(), |p| p.then("split/ip_mehrotra", 200, facts.class()))
        .when(finite <= settings.enumerate_below, |p| {
            p.then("split/enumeration", ALL, "decides, whatever the class")
        })
        .then("rpsor", 100_000, "needs no factorisation")
        .0
}

pub(super) fn of_hlcp(problem: &Hlcp, settings: &LinearAuto) -> Vec<Candidate> {
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

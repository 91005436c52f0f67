//! Which solvers `auto` tries on a linear complementarity problem, in which order, and why.

use nonsmooth_problem::linalg::{Matrix, is_positive_definite};
use nonsmooth_problem::{BoxLcp, Hlcp, Lcp, Mlcp};

use super::{Candidate, LinearAuto};
use crate::settings::SettingsMap;

/// A symmetric part is taken as positive semidefinite if this much of its mean diagonal makes it definite.
const SEMIDEFINITE: f64 = 1e-11;
/// Up to this many variables a dense pivoting method is affordable.
const DENSE: usize = 2000;
/// Up to this many variables a pivot on a sparse basis is.
const SPARSE: usize = 10_000;
/// Beyond this many variables a factorisation of a sparse matrix is worth many sweeps.
const HUGE: usize = 200_000;

/// What a plan goes by.
#[derive(Debug, Clone, Copy)]
struct Facts {
    n: usize,
    symmetric: bool,
    positive_diagonal: bool,
    /// No positive entry off the diagonal.
    is_z: bool,
    /// Strictly diagonally dominant by rows.
    dominant: bool,
    definite: Definite,
    sparse: bool,
}

/// What a Cholesky factorisation of the symmetric part says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Definite {
    Yes,
    Semi,
    No,
    /// Not asked.
    Unknown,
}

impl Facts {
    /// Cost: O(nnz) and at most two Cholesky factorisations. `None` of an operator.
    fn of(m: &Matrix) -> Option<Self> {
        let n = m.nrows();
        let (mut diagonal, mut others) = (vec![0.0; n], vec![0.0; n]);
        let mut is_z = true;
        let known = m.for_each(|i, j, x| {
            if i == j {
                diagonal[i] = x;
            } else {
                others[i] += x.abs();
                is_z &= x <= 0.0;
            }
        });
        let csc = m.to_csc().filter(|_| known)?;
        let positive_diagonal = diagonal.iter().all(|d| *d > 0.0);
        let dominant = diagonal.iter().zip(&others).all(|(d, o)| d > o);
        let definite = if n > HUGE {
            Definite::Unknown
        } else if diagonal.iter().any(|d| *d < 0.0) {
            Definite::No
        } else if positive_diagonal && is_positive_definite(&csc, 0.0) {
            Definite::Yes
        } else if is_positive_definite(&csc, SEMIDEFINITE) {
            Definite::Semi
        } else {
            Definite::No
        };
        Some(Self {
            n,
            symmetric: m.asymmetry() == Some(0.0),
            positive_diagonal,
            is_z,
            dominant,
            definite,
            sparse: matches!(m, Matrix::Sparse(a) if a.nnz() < n * n / 4),
        })
    }

    fn monotone(&self) -> bool {
        matches!(self.definite, Definite::Yes | Definite::Semi)
    }

    /// Whether Lemke's method is affordable.
    fn pivotal(&self) -> bool {
        self.n <= if self.sparse { SPARSE } else { DENSE }
    }

    /// The class that the choice went by, in words.
    fn class(&self) -> &'static str {
        match self.definite {
            _ if self.dominant && self.positive_diagonal => "M is diagonally dominant",
            Definite::Yes if self.symmetric => "M is symmetric positive definite",
            Definite::Yes => "M is positive definite",
            Definite::Semi => "M is positive semidefinite",
            Definite::No => "M is not monotone",
            Definite::Unknown if self.symmetric => "M is symmetric",
            Definite::Unknown => "M is of unknown class",
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
    fn with(mut self, key: &str, value: &str) -> Self {
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

pub(super) fn of_lcp(problem: &Lcp, settings: &LinearAuto) -> Vec<Candidate> {
    let Some(facts) = Facts::of(&problem.M) else {
        return of_operator();
    };
    let n = facts.n;
    let sure = facts.definite == Definite::Yes || (facts.dominant && facts.positive_diagonal);
    let mut plan = Plan::new();
    if facts.symmetric && facts.positive_diagonal && n > HUGE {
        plan = plan.then("mprgp", 20_000, format!("{}, and large", facts.class())).then(
            "ip_mehrotra",
            200,
            "few factorisations, whatever the condition",
        );
    }
    if sure || (facts.is_z && facts.positive_diagonal) {
        plan = plan.then("block_pivoting", 300, facts.class());
    }
    plan = plan
        .when(facts.pivotal(), |p| p.then("lemke", pivots(n), facts.class()))
        .when(facts.monotone() || n > DENSE, |p| p.then("ip_mehrotra", 200, facts.class()))
        .then("newton_min", 300, "superlinear where it converges")
        .then("newton_fb", 500, "globalised")
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
    if problem.equalities != problem.free {
        let why = "more or fewer equalities than free variables";
        return Plan::new()
            .then("newton_fb", 500, why)
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
        .when(facts.symmetric && facts.positive_diagonal && n > HUGE, |p| {
            p.then("psor", 5_000, format!("{}, and large", facts.class()))
        })
        .then("newton_min", 300, facts.class())
        .then("newton_fb", 500, "globalised")
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

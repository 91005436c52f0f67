//! What the commands say of each kind of problem.

use nonsmooth_bench::plural as count;
use nonsmooth_io::{ProblemFile, StoredPoint};
use nonsmooth_problem::check::VerdictOf;
use nonsmooth_problem::{
    AnyCounts, AnyPoint, AnyProblem, GlobalPoint, Kind, LocalPoint, OfAny, Problem, Stated,
    each_kind, with_complementarity, with_problem,
};
use nonsmooth_solve::registry::{self, About, Prefix, Registered};
use serde_json::json;

use crate::json::{Object, fields};

/// What the judge says of a point of any problem.
pub type AnyVerdict = VerdictOf<AnyProblem>;

/// The size of a problem, in words.
pub fn size(problem: &AnyProblem) -> String {
    match problem {
        AnyProblem::Friction(p) => {
            let (contacts, unknowns) = (p.contacts(), p.unknowns());
            format!("{}, {}", count(contacts, "contact"), count(unknowns, "unknown"))
        }
        AnyProblem::Complementarity(linear) => with_complementarity!(linear, p => p.size()),
    }
}

/// The start of a problem whose unknowns are one vector; of others none.
pub fn start_of(problem: &AnyProblem) -> Vec<f64> {
    match problem.origin() {
        AnyPoint::Lcp(point) => point.z,
        _ => vec![],
    }
}

/// The size of a problem by name, for JSON.
pub fn sizes(problem: &AnyProblem) -> Object {
    let unknowns = problem.unknowns();
    match problem {
        AnyProblem::Friction(p) => fields(json!({"contacts": p.contacts(), "unknowns": unknowns})),
        AnyProblem::Complementarity(linear) => {
            let (rows, others) = with_complementarity!(linear, p => (p.equations(), p.sizes()));
            let mut all = fields(json!({"rows": rows, "unknowns": unknowns}));
            all.extend(others.into_iter().map(|(name, n)| (name.into(), json!(n))));
            all
        }
    }
}

/// What two problems have in common where a point of one is a start for the other: of contacts, their number alone.
pub fn alike(problem: &AnyProblem) -> String {
    match problem {
        AnyProblem::Friction(p) => {
            let space = match p.kind().dimension() {
                5 => "3D with rolling friction".into(),
                d => format!("{d}D"),
            };
            format!("{} in {space}", count(p.contacts(), "contact"))
        }
        AnyProblem::Complementarity(_) => format!("{}, {}", problem.kind().name(), size(problem)),
    }
}

/// A stored point, perhaps of another problem that is [`alike`], to start from. Of contacts these are the impulses, and the multipliers if they fit;
/// the rest follows from them.
pub fn start(problem: &AnyProblem, stored: &StoredPoint) -> AnyPoint {
    let mut origin = problem.origin();
    let (impulses, multipliers) = match &stored.point {
        AnyPoint::Local(LocalPoint { r, lambda }) => (r, lambda),
        AnyPoint::Global(GlobalPoint { r, lambda, .. }) => (r, lambda),
        point => return point.clone(),
    };
    if let AnyPoint::Local(LocalPoint { r, lambda })
    | AnyPoint::Global(GlobalPoint { r, lambda, .. }) = &mut origin
    {
        r.clone_from(impulses);
        if multipliers.len() == lambda.len() {
            lambda.clone_from(multipliers);
        }
    }
    origin
}

/// How many contacts, rows or constraints do what.
pub struct Counted {
    /// What is counted.
    pub what: &'static str,
    /// What the residuals belong to.
    pub judged: &'static str,
    /// The unit of the absolute residual, after a blank.
    pub unit: &'static str,
    /// The numbers with their names; all that is counted is in one of them.
    pub all: Vec<(usize, &'static str)>,
    /// Those of the second that stick at the limit of friction.
    pub at_limit: usize,
    /// Those near another status.
    pub degenerate: usize,
    /// Those that roll against rolling friction, whatever else they do.
    pub rolling: usize,
}

/// The names of the rows that the judge speaks of: those of the variables, where each has a row of F.
pub fn names_of_rows(content: &ProblemFile) -> &[String] {
    let by_function = match &content.problem {
        AnyProblem::Complementarity(p) => with_complementarity!(p, p => p.function().is_some()),
        AnyProblem::Friction(_) => false,
    };
    if by_function { &content.info.names } else { &[] }
}

/// The counts of a verdict.
pub fn counted(counts: &AnyCounts) -> Counted {
    match counts {
        AnyCounts::Contacts(c) => Counted {
            what: "contact",
            judged: "contact",
            unit: " m/s",
            all: vec![(c.open, "open"), (c.stick, "stick"), (c.slip, "slip")],
            at_limit: c.at_limit,
            degenerate: c.degenerate,
            rolling: c.rolling,
        },
        AnyCounts::Rows(c) => {
            let mut all = vec![(c.inside, "inside"), (c.lower, "at the lower bound")];
            let others = [(c.upper, "at the upper bound"), (c.equalities, "equalities")];
            all.extend(others.into_iter().filter(|c| c.0 > 0));
            let degenerate = c.degenerate;
            let (at_limit, rolling) = (0, 0);
            Counted { what: "row", judged: "row", unit: "", all, at_limit, degenerate, rolling }
        }
        AnyCounts::Sets(c) => Counted {
            what: "constraint",
            judged: "variable",
            unit: "",
            all: vec![(c.inside, "inside"), (c.border, "on the border")],
            at_limit: 0,
            degenerate: 0,
            rolling: 0,
        },
    }
}

/// What the registry says of a solver, perhaps behind prefixes, of such problems.
pub fn about(problem: &AnyProblem, solver: &str) -> Option<&'static About> {
    fn of<P: Registered>(_: &P, solver: &str) -> Option<&'static About> {
        registry::about::<P>(solver)
    }
    with_problem!(problem, p => of(p, solver))
}

/// Classes of problems: their solvers are listed apart, and may have the same names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Class {
    /// Frictional contact.
    Contact,
    /// Complementarity.
    Complementarity,
    /// Variational inequalities.
    Variational,
}

impl Class {
    /// All.
    pub const ALL: [Self; 3] = [Self::Contact, Self::Complementarity, Self::Variational];

    /// The class of a kind.
    pub fn of(kind: Kind) -> Self {
        match kind {
            Kind::Vi => Self::Variational,
            kind if kind.is_complementarity() => Self::Complementarity,
            _ => Self::Contact,
        }
    }

    /// In JSON and in anchors.
    pub fn name(self) -> &'static str {
        match self {
            Self::Contact => "contact",
            Self::Complementarity => "complementarity",
            Self::Variational => "variational",
        }
    }

    /// As a title.
    pub fn title(self) -> &'static str {
        match self {
            Self::Contact => "Frictional contact",
            Self::Complementarity => "Complementarity",
            Self::Variational => "Variational inequalities",
        }
    }
}

/// What the registry has for one kind of problem.
pub struct Offer {
    /// The kind.
    pub kind: Kind,
    /// The solvers.
    pub solvers: Vec<&'static About>,
    /// What may stand before a solver's name.
    pub prefixes: Vec<&'static Prefix>,
    /// The names of solvers behind a reformulation.
    pub composed: Vec<String>,
}

/// What the registry has, kind by kind.
pub fn offers() -> impl Iterator<Item = Offer> {
    let all = each_kind!(P => Offer {
        kind: P::KIND,
        solvers: registry::abouts::<P>(),
        prefixes: registry::prefixes::<P>(),
        composed: registry::composed_names::<P>(),
    });
    all.into_iter()
}

/// The problems that a solver takes, in words such as `global`; `None` if no kind of problem has it.
pub fn takes(solver: &str) -> Option<String> {
    let has = |offer: &Offer| {
        offer.solvers.iter().any(|a| a.name == solver) || offer.composed.iter().any(|c| c == solver)
    };
    let (with, without): (Vec<_>, Vec<_>) = offers().partition(has);
    let words = |offer: &Offer| offer.kind.name().split('_').collect::<Vec<_>>();
    let shared = with.iter().map(words).reduce(|mut all, kind| {
        all.retain(|word| kind.contains(word));
        all
    })?;
    // One word that tells these kinds from all the others, else several, else their names.
    let tells = |all: &[&str]| {
        let has_all = |o: &Offer| all.iter().all(|word| words(o).contains(word));
        !all.is_empty() && !without.iter().any(has_all)
    };
    let alone = shared.iter().find(|word| tells(&[word]));
    Some(match alone {
        Some(word) => (*word).into(),
        None if tells(&shared) => shared.join(" "),
        None => with.iter().map(|o| o.kind.name()).collect::<Vec<_>>().join(", "),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_solver_takes_is_said_in_few_words() {
        assert_eq!(takes("condense/nsgs").as_deref(), Some("global"));
        assert_eq!(takes("nsgs").as_deref(), Some("friction"));
        assert_eq!(takes("projected_jacobi").as_deref(), Some("lcp, mlcp, box_lcp"));
        assert_eq!(takes("magic"), None);
    }
}

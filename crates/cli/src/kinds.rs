//! What the commands need of a kind of problem.

use nonsmooth_bench::plural as count;
use nonsmooth_io::fclib::StoredPoint;
use nonsmooth_io::linear::LinearPoint;
use nonsmooth_problem::check::{Judged, RowCounts, StatusCounts};
use nonsmooth_problem::{
    BoxLcp, FrictionGlobal, FrictionLocal, Hlcp, HlcpPoint, Kind, Lcp, LcpPoint, Mlcp, Problem,
};
use nonsmooth_solve::registry::{self, About, Prefix, Registered};
use serde::Serialize;
use serde_json::json;

use crate::json::{Object, fields};

/// A problem that has a judge and a place in a file.
pub trait Form: Judged<Counts: Counts> {
    /// How files store its points.
    type Stored;

    /// Its size, in words.
    fn size(&self) -> String;

    /// Its size by name, for JSON.
    fn sizes(&self) -> Object;

    /// A stored point as it is, to be judged.
    fn point(&self, stored: &Self::Stored) -> Self::Point;

    /// A stored point to start from; the rest is the solver's to recompute.
    fn start(&self, stored: &Self::Stored) -> Self::Point;

    /// A point to store, with the relative velocity u, or w, that the judge computed.
    fn store(&self, point: Self::Point, w: Vec<f64>) -> Self::Stored;
}

/// How many contacts, or rows, do what.
pub trait Counts: Serialize + Default + Send + 'static {
    /// What is counted.
    const WHAT: &'static str;
    /// The unit of the absolute residual, after a blank.
    const UNIT: &'static str;

    /// The numbers with their names; all that is counted is in one of them.
    fn all(&self) -> Vec<(usize, &'static str)>;

    /// Those near another status.
    fn degenerate(&self) -> usize;
}

impl Counts for StatusCounts {
    const WHAT: &'static str = "contact";
    const UNIT: &'static str = " m/s";

    fn all(&self) -> Vec<(usize, &'static str)> {
        vec![(self.open, "open"), (self.stick, "stick"), (self.slip, "slip")]
    }

    fn degenerate(&self) -> usize {
        self.degenerate
    }
}

impl Counts for RowCounts {
    const WHAT: &'static str = "row";
    const UNIT: &'static str = "";

    fn all(&self) -> Vec<(usize, &'static str)> {
        let mut all = vec![(self.inside, "inside"), (self.lower, "at the lower bound")];
        let others = [(self.upper, "at the upper bound"), (self.equalities, "equalities")];
        all.extend(others.into_iter().filter(|c| c.0 > 0));
        all
    }

    fn degenerate(&self) -> usize {
        self.degenerate
    }
}

impl<const D: usize> Form for FrictionLocal<D> {
    type Stored = StoredPoint;

    fn size(&self) -> String {
        contact_size(self.contacts(), self)
    }

    fn sizes(&self) -> Object {
        contact_sizes(self.contacts(), self)
    }

    fn point(&self, stored: &StoredPoint) -> Self::Point {
        stored.to_local()
    }

    fn start(&self, stored: &StoredPoint) -> Self::Point {
        let Self::Point { lambda, .. } = self.origin();
        Self::Point { r: stored.r.clone(), lambda: multipliers(stored, lambda) }
    }

    fn store(&self, point: Self::Point, u: Vec<f64>) -> StoredPoint {
        StoredPoint { v: None, u, r: point.r, lambda: some(point.lambda) }
    }
}

impl<const D: usize> Form for FrictionGlobal<D> {
    type Stored = StoredPoint;

    fn size(&self) -> String {
        contact_size(self.contacts(), self)
    }

    fn sizes(&self) -> Object {
        contact_sizes(self.contacts(), self)
    }

    fn point(&self, stored: &StoredPoint) -> Self::Point {
        stored.to_global()
    }

    fn start(&self, stored: &StoredPoint) -> Self::Point {
        let Self::Point { v, lambda, .. } = self.origin();
        Self::Point { v, r: stored.r.clone(), lambda: multipliers(stored, lambda) }
    }

    fn store(&self, point: Self::Point, u: Vec<f64>) -> StoredPoint {
        StoredPoint { v: some(point.v), u, r: point.r, lambda: some(point.lambda) }
    }
}

fn contact_size(contacts: usize, problem: &impl Problem) -> String {
    format!("{}, {}", count(contacts, "contact"), count(problem.unknowns(), "unknown"))
}

fn contact_sizes(contacts: usize, problem: &impl Problem) -> Object {
    fields(json!({"contacts": contacts, "unknowns": problem.unknowns()}))
}

/// The multipliers of a point, which may be another problem's, else `origin`: they follow from the impulses.
fn multipliers(stored: &StoredPoint, origin: Vec<f64>) -> Vec<f64> {
    let fits = stored.lambda.as_ref().filter(|l| l.len() == origin.len());
    fits.cloned().unwrap_or(origin)
}

fn some(x: Vec<f64>) -> Option<Vec<f64>> {
    Some(x).filter(|x| !x.is_empty())
}

/// The parts of [`Form`] that LCP, MLCP and box LCP share: their point is z, and w follows from it.
macro_rules! points_of_z {
    () => {
        type Stored = LinearPoint;

        fn point(&self, stored: &LinearPoint) -> LcpPoint {
            stored.to_lcp()
        }

        fn start(&self, stored: &LinearPoint) -> LcpPoint {
            stored.to_lcp()
        }
    };
}

impl Form for Lcp {
    points_of_z!();

    fn size(&self) -> String {
        count(self.dim(), "variable")
    }

    fn sizes(&self) -> Object {
        fields(json!({"rows": self.dim(), "unknowns": self.unknowns()}))
    }

    fn store(&self, point: LcpPoint, w: Vec<f64>) -> LinearPoint {
        LinearPoint { z: point.z, w: Some(w) }
    }
}

impl Form for BoxLcp {
    points_of_z!();

    fn size(&self) -> String {
        let bounded = |all: &[f64]| all.iter().filter(|x| x.is_finite()).count();
        let variables = count(self.dim(), "variable");
        let (lower, upper) = (bounded(&self.lower), bounded(&self.upper));
        format!("{variables}, {} and {upper} upper", count(lower, "lower bound"))
    }

    fn sizes(&self) -> Object {
        fields(json!({"rows": self.dim(), "unknowns": self.unknowns()}))
    }

    fn store(&self, point: LcpPoint, w: Vec<f64>) -> LinearPoint {
        LinearPoint { z: point.z, w: Some(w) }
    }
}

impl Form for Mlcp {
    points_of_z!();

    fn size(&self) -> String {
        format!(
            "{}, {}, {}",
            match self.equalities {
                1 => "1 equality".into(),
                n => format!("{n} equalities"),
            },
            count(self.free, "free variable"),
            count(self.pairs(), "pair")
        )
    }

    fn sizes(&self) -> Object {
        fields(json!({
            "rows": self.q.len(),
            "unknowns": self.unknowns(),
            "equalities": self.equalities,
            "free": self.free,
            "pairs": self.pairs(),
        }))
    }

    fn store(&self, point: LcpPoint, mut w: Vec<f64>) -> LinearPoint {
        w.drain(..self.equalities.min(w.len()));
        LinearPoint { z: point.z, w: Some(w) }
    }
}

impl Form for Hlcp {
    type Stored = LinearPoint;

    fn size(&self) -> String {
        count(self.dim(), "pair")
    }

    fn sizes(&self) -> Object {
        fields(json!({"rows": self.dim(), "unknowns": self.unknowns(), "pairs": self.dim()}))
    }

    fn point(&self, stored: &LinearPoint) -> HlcpPoint {
        stored.to_hlcp()
    }

    fn start(&self, stored: &LinearPoint) -> HlcpPoint {
        stored.to_hlcp()
    }

    fn store(&self, point: HlcpPoint, _: Vec<f64>) -> LinearPoint {
        LinearPoint { z: point.x, w: Some(point.s) }
    }
}

/// Classes of problems: their solvers are listed apart, and may have the same names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Class {
    /// Frictional contact.
    Contact,
    /// Linear complementarity.
    Linear,
}

impl Class {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Contact, Self::Linear];

    /// The class of a kind.
    pub fn of(kind: Kind) -> Self {
        if kind.is_linear() { Self::Linear } else { Self::Contact }
    }

    /// In JSON and in anchors.
    pub fn name(self) -> &'static str {
        match self {
            Self::Contact => "contact",
            Self::Linear => "linear",
        }
    }

    /// As a title.
    pub fn title(self) -> &'static str {
        match self {
            Self::Contact => "Frictional contact",
            Self::Linear => "Linear complementarity",
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
pub fn offers() -> [Offer; 8] {
    fn of<P: Registered>(kind: Kind) -> Offer {
        Offer {
            kind,
            solvers: registry::abouts::<P>(),
            prefixes: registry::prefixes::<P>(),
            composed: registry::composed_names::<P>(),
        }
    }
    [
        of::<FrictionLocal<2>>(Kind::FrictionLocal2d),
        of::<FrictionLocal<3>>(Kind::FrictionLocal3d),
        of::<FrictionGlobal<2>>(Kind::FrictionGlobal2d),
        of::<FrictionGlobal<3>>(Kind::FrictionGlobal3d),
        of::<Lcp>(Kind::Lcp),
        of::<Mlcp>(Kind::Mlcp),
        of::<Hlcp>(Kind::Hlcp),
        of::<BoxLcp>(Kind::BoxLcp),
    ]
}

/// The problems that a solver takes, in words such as `global`; `None` if no kind of problem has it.
pub fn takes(solver: &str) -> Option<String> {
    let has = |offer: &Offer| {
        offer.solvers.iter().any(|a| a.name == solver) || offer.composed.iter().any(|c| c == solver)
    };
    let (with, without): (Vec<_>, Vec<_>) = offers().into_iter().partition(has);
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

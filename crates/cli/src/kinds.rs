//! What the commands need of a kind of problem.

use nonsmooth_io::fclib::StoredPoint;
use nonsmooth_problem::check::{ContactStatus, Judged, StatusCounts};
use nonsmooth_problem::{FrictionGlobal, FrictionLocal, Kind, Problem};
use nonsmooth_solve::registry::{self, About, Registered};

/// A problem that has a judge and a place in a file.
pub trait Form: Judged<Status = ContactStatus, Counts = StatusCounts> {
    /// The number of contacts.
    fn contacts(&self) -> usize;

    /// The components of a contact.
    fn dimension(&self) -> usize;

    /// A stored point as it is, to be judged.
    fn point(&self, stored: &StoredPoint) -> Self::Point;

    /// The impulses and multipliers of a stored point, to start from; the rest is the solver's to recompute.
    fn start(&self, stored: &StoredPoint) -> Self::Point;

    /// A point to store, with the relative velocity `u` that the judge computed.
    fn store(&self, point: Self::Point, u: Vec<f64>) -> StoredPoint;
}

impl<const D: usize> Form for FrictionLocal<D> {
    fn contacts(&self) -> usize {
        self.contacts()
    }

    fn dimension(&self) -> usize {
        D
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
    fn contacts(&self) -> usize {
        self.contacts()
    }

    fn dimension(&self) -> usize {
        D
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

/// The multipliers of a point, which may be another problem's, else `origin`: they follow from the impulses.
fn multipliers(stored: &StoredPoint, origin: Vec<f64>) -> Vec<f64> {
    let fits = stored.lambda.as_ref().filter(|l| l.len() == origin.len());
    fits.cloned().unwrap_or(origin)
}

fn some(x: Vec<f64>) -> Option<Vec<f64>> {
    Some(x).filter(|x| !x.is_empty())
}

/// What the registry has for one kind of problem.
pub struct Offer {
    /// The kind.
    pub kind: Kind,
    /// The solvers.
    pub solvers: Vec<&'static About>,
    /// The names of solvers behind a reformulation.
    pub composed: Vec<String>,
}

/// What the registry has, kind by kind.
pub fn offers() -> [Offer; 4] {
    fn of<P: Registered>(kind: Kind) -> Offer {
        Offer { kind, solvers: registry::abouts::<P>(), composed: P::composed_names() }
    }
    [
        of::<FrictionLocal<2>>(Kind::FrictionLocal2d),
        of::<FrictionLocal<3>>(Kind::FrictionLocal3d),
        of::<FrictionGlobal<2>>(Kind::FrictionGlobal2d),
        of::<FrictionGlobal<3>>(Kind::FrictionGlobal3d),
    ]
}

/// The problems that a solver takes, in words such as `global`; `None` if no kind of problem has it.
pub fn takes(solver: &str) -> Option<String> {
    let has = |offer: &Offer| {
        offer.solvers.iter().any(|a| a.name == solver) || offer.composed.iter().any(|c| c == solver)
    };
    let (with, without): (Vec<_>, Vec<_>) = offers().into_iter().partition(has);
    let words = |offer: &Offer| offer.kind.name().split('_').collect::<Vec<_>>();
    // The words that tell all these kinds from all the others, else their names.
    let shared = with.iter().map(words).reduce(|mut all, kind| {
        all.retain(|word| kind.contains(word));
        all
    })?;
    let tells = |word: &&&str| !without.iter().all(|o| words(o).contains(*word));
    let telling: Vec<_> = shared.iter().filter(tells).copied().collect();
    let also = |o: &Offer| telling.iter().all(|word| words(o).contains(word));
    Some(if without.iter().any(also) {
        with.iter().map(|o| o.kind.name()).collect::<Vec<_>>().join(", ")
    } else {
        telling.join(" ")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_solver_takes_is_said_in_few_words() {
        assert_eq!(takes("condense/nsgs").as_deref(), Some("global"));
        assert_eq!(takes("nsgs").as_deref(), Some(""));
        assert_eq!(takes("magic"), None);
    }
}

//! What the commands need of a kind of problem.

use nonsmooth_io::fclib::StoredPoint;
use nonsmooth_problem::check::Judged;
use nonsmooth_problem::{FrictionGlobal, FrictionLocal, Problem};
use nonsmooth_solve::registry::Registered;

/// A problem that has solvers, a judge and a place in a file.
pub trait Form: Registered + Judged {
    /// The number of contacts.
    fn contacts(&self) -> usize;

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

    fn point(&self, stored: &StoredPoint) -> Self::Point {
        stored.to_local()
    }

    fn start(&self, stored: &StoredPoint) -> Self::Point {
        stored.to_local()
    }

    fn store(&self, point: Self::Point, u: Vec<f64>) -> StoredPoint {
        StoredPoint { v: None, u, r: point.r, lambda: some(point.lambda) }
    }
}

impl<const D: usize> Form for FrictionGlobal<D> {
    fn contacts(&self) -> usize {
        self.contacts()
    }

    fn point(&self, stored: &StoredPoint) -> Self::Point {
        stored.to_global()
    }

    fn start(&self, stored: &StoredPoint) -> Self::Point {
        let v = self.origin().v;
        Self::Point { v, ..stored.to_global() }
    }

    fn store(&self, point: Self::Point, u: Vec<f64>) -> StoredPoint {
        StoredPoint { v: some(point.v), u, r: point.r, lambda: some(point.lambda) }
    }
}

fn some(x: Vec<f64>) -> Option<Vec<f64>> {
    Some(x).filter(|x| !x.is_empty())
}

//! Which solvers there are for variational inequalities: one line each.

use nonsmooth_problem::Vi;

use super::auto::VariationalAuto;
use super::projection::{Extragradient, FixedPoint, Hyperplane};
use super::reform::Multipliers;
use crate::core::register::{Edge, Entry, Registered};

impl Registered for Vi {
    fn solvers() -> Vec<Entry<Self>> {
        vec![
            Entry::session(VariationalAuto::session),
            Entry::of::<FixedPoint>(),
            Entry::of::<Extragradient>(),
            Entry::of::<Hyperplane>(),
        ]
    }

    fn edges() -> Vec<Edge<Self>> {
        vec![Edge::new::<Multipliers>()]
    }
}

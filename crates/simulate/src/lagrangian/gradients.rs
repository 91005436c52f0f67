//! The lines of a system at one configuration.

use nonsmooth_linalg::Dense;

use super::{Lagrangian, Size, differences};
use crate::error::require;
use crate::{Law, SimulateError};

/// All lines of a system at one configuration: D of each contact, then relations, then scalar rows.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Gradients {
    contacts: Dense,
    relations: Dense,
    rows: Dense,
    /// Whether the system gives tangents, which friction needs.
    tangents: bool,
}

impl Gradients {
    /// Evaluates all of them at t, q; q is as before afterwards.
    pub fn evaluate<L: Lagrangian<D> + ?Sized, const D: usize>(
        &mut self,
        system: &L,
        t: f64,
        q: &mut [f64],
        work: &mut Vec<f64>,
    ) {
        let Size { dofs: n, contacts, relations, rows } = system.size();
        let typical = system.typical();
        self.contacts.reset(D * contacts, n);
        self.tangents = contacts > 0 && system.directions(t, q, &mut self.contacts);
        if contacts > 0 && !self.tangents {
            let mut normals = Dense::zeros(contacts, n);
            differences::jacobian(q, typical, work, &mut normals, |q, g| system.gaps(t, q, g));
            self.contacts.reset(D * contacts, n);
            for c in 0..contacts {
                self.contacts.row_mut(D * c).copy_from_slice(normals.row(c));
            }
        }
        self.relations.reset(relations, n);
        if relations > 0 && !system.relation_gradients(t, q, &mut self.relations) {
            self.relations.reset(relations, n);
            let phi = |q: &[f64], phi: &mut [f64]| system.relations(t, q, phi);
            differences::jacobian(q, typical, work, &mut self.relations, phi);
        }
        self.rows.reset(rows, n);
        if rows > 0 && !system.row_gradients(t, q, &mut self.rows) {
            self.rows.reset(rows, n);
            let rows = |q: &[f64], x: &mut [f64]| system.rows(t, q, x);
            differences::jacobian(q, typical, work, &mut self.rows, rows);
        }
    }

    /// The law of contact c is without friction or has tangents to act along.
    pub fn admit(&self, c: usize, law: &Law) -> Result<(), SimulateError> {
        let ok = self.tangents || law.mu == 0.0;
        require(|| format!("law({c}).mu"), law.mu, ok, "0, since `directions` gives no tangents")
    }

    /// Line i of all.
    pub fn line(&self, i: usize) -> &[f64] {
        let (a, b) = (self.contacts.nrows(), self.relations.nrows());
        if i < a {
            self.contacts.row(i)
        } else if i < a + b {
            self.relations.row(i - a)
        } else {
            self.rows.row(i - a - b)
        }
    }

    pub fn len(&self) -> usize {
        self.contacts.nrows() + self.relations.nrows() + self.rows.nrows()
    }

    pub fn is_finite(&self) -> bool {
        let all = [&self.contacts, &self.relations, &self.rows];
        all.iter().flat_map(|a| a.values()).all(|x| x.is_finite())
    }
}

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// s of contacts, then b of rows, at t and q.
pub(super) fn given<L: Lagrangian<D> + ?Sized, const D: usize>(
    system: &L,
    t: f64,
    q: &[f64],
    out: &mut Vec<f64>,
) {
    let size = system.size();
    out.clear();
    out.resize(D * size.contacts + size.rows, 0.0);
    let (s, b) = out.split_at_mut(D * size.contacts);
    system.surface(t, q, s);
    system.row_velocities(t, q, b);
}

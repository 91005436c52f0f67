//! Linear systems: M, C, K constant.

use nonsmooth_linalg::{Csc, Dense, MatrixError};

use super::{Constant, Lagrangian, RowLaw, Size};
use crate::{Law, SimulateError};

/// `M v' + C v + K q = load`, with contacts and limits whose gaps are linear in q: elastic bodies after discretisation, trains of masses and springs.
///
/// M̂ = M + hθ C + h²θ² K is sparse and factorised once for each h; a step is one contact problem.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearSystem<const D: usize> {
    /// M, n × n, symmetric positive definite.
    pub mass: Csc,
    /// C, n × n.
    pub damping: Csc,
    /// K, n × n.
    pub stiffness: Csc,
    /// Constant forces, n.
    pub load: Vec<f64>,
    /// Contacts with friction.
    pub contacts: Vec<LinearContact<D>>,
    /// Limits `gap + aᵀq ≥ 0` without friction.
    pub limits: Vec<(LinearRow, RowLaw)>,
}

/// `constant + Σ weight · q_dof`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LinearRow {
    /// Its value at q = 0.
    pub constant: f64,
    /// The degrees of freedom that it depends on, and how.
    pub weights: Vec<(usize, f64)>,
}

/// A contact of a linear system: `g = gap + Nᵀq`, u = `[Nᵀv, Tᵀv]`.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearContact<const D: usize> {
    /// The gap at q = 0.
    pub gap: f64,
    /// `[N, T…]`, each as degrees of freedom and weights.
    pub directions: [Vec<(usize, f64)>; D],
    /// Friction and restitution.
    pub law: Law,
}

impl LinearRow {
    /// Its value at q.
    pub fn value(&self, q: &[f64]) -> f64 {
        self.constant + self.weights.iter().map(|&(i, w)| w * q[i]).sum::<f64>()
    }
}

impl<const D: usize> LinearSystem<D> {
    /// A system without damping, load and contacts.
    pub fn new(mass: Csc, stiffness: Csc) -> Self {
        let n = mass.nrows();
        let (contacts, limits) = (vec![], vec![]);
        Self { mass, damping: Csc::zeros(n, n), stiffness, load: vec![0.0; n], contacts, limits }
    }

    /// A chain of masses, each joined to the next one by a spring: the bar of linear elements with lumped masses.
    ///
    /// Errors: fewer masses than one, another number of springs than one less.
    pub fn chain(masses: &[f64], springs: &[f64]) -> Result<Self, MatrixError> {
        let n = masses.len();
        if n == 0 {
            let (place, expected, found) = ("masses".into(), "at least one".into(), "none".into());
            return Err(MatrixError::Shape { place, expected, found });
        }
        if springs.len() + 1 != n {
            let expected = format!("{}, one fewer than masses", n - 1);
            let found = springs.len().to_string();
            return Err(MatrixError::Shape { place: "springs".into(), expected, found });
        }
        let entries = springs
            .iter()
            .enumerate()
            .flat_map(|(i, &k)| [(i, i, k), (i + 1, i + 1, k), (i, i + 1, -k), (i + 1, i, -k)]);
        let stiffness = Csc::from_triplets(n, n, entries)?;
        Ok(Self::new(Csc::diagonal(masses), stiffness))
    }

    /// The same with a limit `gap + aᵀq ≥ 0`.
    #[must_use]
    pub fn with_limit(mut self, gap: f64, weights: &[(usize, f64)], e: f64) -> Self {
        let row = LinearRow { constant: gap, weights: weights.to_vec() };
        self.limits.push((row, RowLaw::Limit { e }));
        self
    }

    /// The same with a contact.
    #[must_use]
    pub fn with_contact(mut self, contact: LinearContact<D>) -> Self {
        self.contacts.push(contact);
        self
    }
}

impl<const D: usize> Lagrangian<D> for LinearSystem<D> {
    fn size(&self) -> Size {
        Size::new(self.load.len()).contacts(self.contacts.len()).rows(self.limits.len())
    }

    /// Weights of contacts and limits are of degrees of freedom, and finite.
    fn validate(&self) -> Result<(), SimulateError> {
        let n = self.load.len();
        let contacts = self.contacts.iter().enumerate();
        let contacts = contacts.flat_map(|(k, c)| {
            c.directions.iter().map(move |weights| (format!("contacts[{k}].directions"), weights))
        });
        let limits = self.limits.iter().enumerate();
        let limits = limits.map(|(k, (row, _))| (format!("limits[{k}].weights"), &row.weights));
        for (key, weights) in contacts.chain(limits) {
            if let Some((i, _)) = weights.iter().find(|(i, _)| *i >= n) {
                let expected = format!("degrees of freedom below {n}");
                return Err(SimulateError::value(key, expected, i));
            }
            if let Some((_, w)) = weights.iter().find(|(_, w)| !w.is_finite()) {
                return Err(SimulateError::value(key, "finite weights", w));
            }
        }
        Ok(())
    }

    fn mass(&self, _q: &[f64], mass: &mut Dense) {
        self.mass.triplets().for_each(|(i, j, m)| mass[(i, j)] += m);
    }

    fn force(&self, _t: f64, q: &[f64], v: &[f64], force: &mut [f64]) {
        force.copy_from_slice(&self.load);
        self.stiffness.mul_add(-1.0, q, force);
        self.damping.mul_add(-1.0, v, force);
    }

    fn potential(&self, _t: f64, q: &[f64]) -> f64 {
        let mut elastic = vec![0.0; q.len()];
        self.stiffness.mul_add(0.5, q, &mut elastic);
        q.iter().zip(elastic.iter().zip(&self.load)).map(|(q, (e, f))| q * (e - f)).sum()
    }

    fn constant(&self) -> Option<Constant<'_>> {
        let Self { mass, damping, stiffness, .. } = self;
        Some(Constant { mass, damping, stiffness })
    }

    fn gaps(&self, _t: f64, q: &[f64], gaps: &mut [f64]) {
        for (gap, contact) in gaps.iter_mut().zip(&self.contacts) {
            let moved: f64 = contact.directions[0].iter().map(|&(i, w)| w * q[i]).sum();
            *gap = contact.gap + moved;
        }
    }

    fn directions(&self, _t: f64, _q: &[f64], directions: &mut Dense) -> bool {
        let all = self.contacts.iter().flat_map(|c| &c.directions);
        for (row, weights) in all.enumerate() {
            weights.iter().for_each(|&(i, w)| directions[(row, i)] += w);
        }
        true
    }

    fn law(&self, contact: usize, _t: f64, _q: &[f64], _v: &[f64]) -> Law {
        self.contacts[contact].law
    }

    fn rows(&self, _t: f64, q: &[f64], coordinates: &mut [f64]) {
        let all = coordinates.iter_mut().zip(&self.limits);
        all.for_each(|(x, (row, _))| *x = row.value(q));
    }

    fn row_gradients(&self, _t: f64, _q: &[f64], gradients: &mut Dense) -> bool {
        for (k, (row, _)) in self.limits.iter().enumerate() {
            row.weights.iter().for_each(|&(i, w)| gradients[(k, i)] += w);
        }
        true
    }

    fn row_law(&self, row: usize, _t: f64, _q: &[f64], _v: &[f64]) -> RowLaw {
        self.limits[row].1
    }
}

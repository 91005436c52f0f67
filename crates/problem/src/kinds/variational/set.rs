//! The sets over which variational inequalities are stated.

use std::fmt::{Display, Formatter};

use nonsmooth_linalg::Csc;

use crate::ProblemError;
use crate::error::{all_finite, bounds, vector};

/// A closed convex set in ℝⁿ.
// One a problem: its size does not matter.
#[allow(clippy::large_enum_variant)]
#[derive(Debug, Clone, PartialEq)]
#[allow(non_snake_case)]
pub enum Set {
    /// `{l ≤ x ≤ u}`; bounds may be infinite.
    Box {
        /// l, n
        lower: Vec<f64>,
        /// u, n
        upper: Vec<f64>,
    },
    /// `{A x ≤ b, C x = d}`
    Polyhedron {
        /// m×n
        A: Csc,
        /// m
        b: Vec<f64>,
        /// k×n
        C: Csc,
        /// k
        d: Vec<f64>,
    },
    /// `{‖x − c‖ ≤ r}`, in the Euclidean norm.
    Ball {
        /// c, n
        centre: Vec<f64>,
        /// r ≥ 0
        radius: f64,
    },
    /// `{x_1 ≥ ‖(x_2, …, x_n)‖}`
    SecondOrderCone {
        /// n ≥ 1
        dimension: usize,
    },
    /// Of these sets, each in variables of its own, one after the other.
    Product(Vec<Set>),
}

impl Set {
    /// `{x ≥ 0}` in ℝⁿ.
    pub fn orthant(n: usize) -> Self {
        Self::Box { lower: vec![0.0; n], upper: vec![f64::INFINITY; n] }
    }

    /// `{A x ≤ b}`
    #[allow(non_snake_case)]
    pub fn inequalities(A: Csc, b: Vec<f64>) -> Self {
        let C = Csc::zeros(0, A.ncols());
        Self::Polyhedron { A, b, C, d: vec![] }
    }

    /// Whether this is bounded and not empty, as far as it shows at once: balls, and boxes with finite bounds.
    pub fn is_compact(&self) -> bool {
        self.parts().into_iter().all(|(_, set)| match set {
            Self::Box { lower, upper } => lower.iter().chain(upper).all(|x| x.is_finite()),
            Self::Ball { .. } => true,
            Self::Polyhedron { .. } | Self::SecondOrderCone { .. } | Self::Product(_) => false,
        })
    }

    /// l and u, where this is a box or a product of boxes.
    pub fn bounds(&self) -> Option<(Vec<f64>, Vec<f64>)> {
        let (mut l, mut u) = (vec![], vec![]);
        for (_, set) in self.parts() {
            let Self::Box { lower, upper } = set else { return None };
            l.extend(lower);
            u.extend(upper);
        }
        Some((l, u))
    }

    /// n
    pub fn dim(&self) -> usize {
        match self {
            Self::Box { lower, .. } => lower.len(),
            Self::Polyhedron { A, .. } => A.ncols(),
            Self::Ball { centre, .. } => centre.len(),
            Self::SecondOrderCone { dimension } => *dimension,
            Self::Product(parts) => parts.iter().map(Self::dim).sum(),
        }
    }

    /// The sets that are no products, each with its first variable.
    pub fn parts(&self) -> Vec<(usize, &Self)> {
        let (mut parts, mut left, mut first) = (vec![], vec![self], 0);
        while let Some(set) = left.pop() {
            match set {
                Self::Product(inner) => left.extend(inner.iter().rev()),
                set => {
                    parts.push((first, set));
                    first += set.dim();
                }
            }
        }
        parts
    }

    /// Checks shapes and values. That a polyhedron is not empty is not checked.
    pub fn validate(&self) -> Result<(), ProblemError> {
        if self.dim() == 0 {
            return Err(ProblemError::shape("set", "at least one variable", "none"));
        }
        for (_, set) in self.parts() {
            match set {
                Self::Box { lower, upper } => bounds([lower, upper], lower.len(), "variables")?,
                Self::Polyhedron { A, b, C, d } => {
                    let n = A.ncols();
                    C.check_shape("C", C.nrows(), n, "columns of A")?;
                    A.check_finite("A")?;
                    C.check_finite("C")?;
                    vector("b", b, A.nrows(), "rows of A")?;
                    vector("d", d, C.nrows(), "rows of C")?;
                }
                Self::Ball { centre, radius } => {
                    all_finite("centre", centre)?;
                    if !(*radius >= 0.0 && radius.is_finite()) {
                        return Err(ProblemError::value("radius", "a number ≥ 0", radius));
                    }
                }
                Self::SecondOrderCone { dimension: 0 } => {
                    return Err(ProblemError::value("dimension", "at least 1", 0));
                }
                Self::SecondOrderCone { .. } | Self::Product(_) => {}
            }
        }
        Ok(())
    }

    /// The largest modulus of a finite bound, of a coordinate of a centre, of a radius, and of the distance of a polyhedron's planes from the origin: what is known of the size of x.
    pub fn size(&self) -> f64 {
        let largest = |x: &[f64]| {
            x.iter().filter(|x| x.is_finite()).fold(0.0_f64, |size, x| size.max(x.abs()))
        };
        let of = |set: &Self| match set {
            Self::Box { lower, upper } => largest(lower).max(largest(upper)),
            Self::Polyhedron { A, b, C, d } => planes(A, b).max(planes(C, d)),
            Self::Ball { centre, radius } => largest(centre).max(*radius),
            Self::SecondOrderCone { .. } | Self::Product(_) => 0.0,
        };
        self.parts().into_iter().fold(0.0, |size, (_, set)| of(set).max(size))
    }
}

/// In words, `a box` or `a ball x 2 second-order cones`, equal sorts together.
impl Display for Set {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        let mut sorts: Vec<(&str, usize)> = vec![];
        for (_, part) in self.parts() {
            let sort = match part {
                Self::Box { .. } => "box",
                Self::Polyhedron { .. } => "polyhedron",
                Self::Ball { .. } => "ball",
                Self::SecondOrderCone { .. } => "second-order cone",
                Self::Product(_) => continue,
            };
            match sorts.iter_mut().find(|known| known.0 == sort) {
                Some(known) => known.1 += 1,
                None => sorts.push((sort, 1)),
            }
        }
        let each = sorts.iter().map(|&(sort, count)| match (sort, count) {
            (sort, 1) => format!("a {sort}"),
            ("box", count) => format!("{count} boxes"),
            ("polyhedron", count) => format!("{count} polyhedra"),
            (sort, count) => format!("{count} {sort}s"),
        });
        f.write_str(&each.collect::<Vec<_>>().join(" x "))
    }
}

/// The largest distance from the origin of the planes `m_i x = rhs_i`; rows without entries have none.
fn planes(m: &Csc, rhs: &[f64]) -> f64 {
    let mut squares = vec![0.0; rhs.len()];
    m.triplets().for_each(|(i, _, x)| squares[i] += x * x);
    let distance =
        |(b, square): (&f64, &f64)| if *square > 0.0 { b.abs() / square.sqrt() } else { 0.0 };
    rhs.iter().zip(&squares).map(distance).fold(0.0, f64::max)
}

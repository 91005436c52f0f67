//! What a complementarity problem or a variational inequality says of itself. Files, pictures and reports are made of it and know no kinds.

use super::{LcpPoint, Mcp};
use crate::field::{Expressions, Field};
use crate::kinds::variational::Set;
use crate::{AnyPoint, OfAny, OfAnyPoint, ProblemError};
use nonsmooth_linalg::{Dense, Matrix};

/// A part of a problem's data.
#[derive(Debug, Clone, Copy)]
pub enum Part<'a> {
    /// A matrix.
    Matrix(&'a Matrix),
    /// A vector.
    Vector(&'a [f64]),
    /// A number of rows or columns.
    Count(usize),
    /// A function, one expression a row.
    Expressions(&'a Expressions),
    /// A convex set.
    Set(&'a Set),
}

/// What a part is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Shape {
    /// A matrix.
    Matrix,
    /// A vector.
    Vector,
    /// A number of rows or columns.
    Count,
    /// A function, one expression a row.
    Expressions,
    /// A convex set.
    Set,
}

/// Where the parts come from that a problem is made of, by their names: a file. A part that is not there is an error.
pub trait Parts {
    /// Whether a part is there.
    fn has(&self, name: &str) -> bool;

    /// The matrix of a name.
    fn matrix(&mut self, name: &'static str) -> Result<Matrix, ProblemError>;

    /// The vector of a name.
    fn vector(&mut self, name: &'static str) -> Result<Vec<f64>, ProblemError>;

    /// The number of a name.
    fn count(&mut self, name: &'static str) -> Result<usize, ProblemError>;

    /// The function of a name.
    fn expressions(&mut self, name: &'static str) -> Result<Expressions, ProblemError>;

    /// The set of a name, in so many variables.
    fn set(&mut self, name: &'static str, variables: usize) -> Result<Set, ProblemError>;
}

/// A complementarity problem or a variational inequality by its parts, and those of its points, by the names that files have for them.
pub trait Stated: OfAny {
    /// The statement, in a line of ASCII.
    const STATEMENT: &'static str;
    /// The parts that a problem may be made of.
    const PARTS: &'static [(&'static str, Shape)];
    /// The parts that a solution may have.
    const SOLUTION: &'static [&'static str];
    /// Which of them is the partner of the point.
    const PARTNER: &'static str = "w";
    /// What has a row of its own in a table of the solution.
    const ROW: &'static str = "variable";

    /// The parts, numbers and vectors in the order in which they are written.
    fn parts(&self) -> Vec<(&'static str, Part<'_>)>;

    /// The problem of its parts, validated.
    ///
    /// Errors: a part that is not there, parts that do not fit each other.
    fn from_parts(parts: &mut dyn Parts) -> Result<Self, ProblemError>;

    /// The parts of a valid point, with its partner (as [`kept`](Self::kept)) where it is known.
    fn point_parts<'a>(
        &self,
        point: &'a Self::Point,
        partner: Option<&'a [f64]>,
    ) -> Vec<(&'static str, &'a [f64])>;

    /// The parts of a point whose kind was forgotten; none where it is another's.
    fn parts_of<'a>(
        &self,
        any: &'a AnyPoint,
        partner: Option<&'a [f64]>,
    ) -> Vec<(&'static str, &'a [f64])> {
        OfAnyPoint::of(any).map_or(vec![], |point| self.point_parts(point, partner))
    }

    /// The point of its parts, which `part` gives by name.
    ///
    /// Errors: those of `part`.
    fn point_from_parts<E>(
        part: impl FnMut(&'static str) -> Result<Vec<f64>, E>,
    ) -> Result<Self::Point, E>;

    /// What of [`Problem::partner`](crate::Problem::partner) is kept beside the point: what belongs to pairs and is no part of the point.
    fn kept(&self, partner: Vec<f64>) -> Option<Vec<f64>> {
        Some(partner)
    }

    /// The number of complementary pairs.
    fn pairs(&self) -> usize;

    /// How many variables may have a name; of two that are a pair, one.
    fn variables(&self) -> usize {
        self.pairs()
    }

    /// The number of rows.
    fn equations(&self) -> usize {
        self.right().len()
    }

    /// The size, in words.
    fn size(&self) -> String;

    /// The numbers that make up the size beside those of rows and unknowns, by name.
    fn sizes(&self) -> Vec<(&'static str, usize)> {
        vec![]
    }

    /// The matrix whose class says which methods work, where there is one.
    fn classified(&self) -> Option<&Matrix> {
        None
    }

    /// The problem itself, where it is a nonlinear complementarity problem.
    fn nonlinear(&self) -> Option<&Mcp> {
        None
    }

    /// The function that the problem is of, where it is not stated by matrices.
    fn function(&self) -> Option<&dyn Field> {
        None
    }

    /// The blocks by which the problem is written where its matrix is made of such; those that are known by entries.
    fn blocks(&self) -> Vec<(&'static str, Dense)> {
        vec![]
    }

    /// The matrices among the parts.
    fn matrices(&self) -> Vec<(&'static str, &Matrix)> {
        let matrix = |(name, part)| match part {
            Part::Matrix(m) => Some((name, m)),
            Part::Vector(_) | Part::Count(_) | Part::Expressions(_) | Part::Set(_) => None,
        };
        self.parts().into_iter().filter_map(matrix).collect()
    }

    /// The right-hand side q.
    fn right(&self) -> &[f64] {
        let vector = |(name, part)| match part {
            Part::Vector(x) if name == "q" => Some(x),
            _ => None,
        };
        self.parts().into_iter().find_map(vector).unwrap_or_default()
    }
}

/// A point of a nonlinear problem, with F there where it is known.
pub(crate) fn x_and_f<'a>(
    point: &'a LcpPoint,
    f: Option<&'a [f64]>,
) -> Vec<(&'static str, &'a [f64])> {
    std::iter::once(("x", &point.z[..])).chain(f.map(|f| ("F", f))).collect()
}

/// `1 entry of the Jacobian`, `2 entries of the Jacobian`.
pub(crate) fn of_jacobian(field: &dyn Field) -> String {
    match field.pattern().len() {
        1 => "1 entry of the Jacobian".into(),
        k => format!("{k} entries of the Jacobian"),
    }
}

/// `1 contact`, `2 contacts`.
pub fn plural(count: usize, what: &str) -> String {
    if count == 1 { format!("1 {what}") } else { format!("{count} {what}s") }
}

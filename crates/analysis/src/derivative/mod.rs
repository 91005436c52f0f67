//! Derivatives of solutions with respect to the data, by implicit differentiation on the active set.
//!
//! A solution satisfies, piece by piece, smooth equations of the unknowns x and of `y(x)`, whose change is `dy = S dx + dS x + dp`:
//!
//! | problem | x | y | S | p |
//! | --- | --- | --- | --- | --- |
//! | LCP, box LCP, MLCP | z | `w = M z + q` | M | q |
//! | HLCP | (x, s) | `Q x + R s − q` | `[Q, R]` | −q |
//! | MCP, VI over a box | x | F(x) | JF(x) | what is added to F |
//! | VI over another set | (x, λ) | (F, F + normals, constraints) | their derivative, see below | what is added to F, and the set's data |
//! | local contacts | (r, λ) | (u, c) | `[W, V; Vᵀ, R]` | (q, s) |
//! | global contacts | (v, r, λ) | `(M v − H r − G λ − f, u, c)` | `[M, −H, −G; Hᵀ, 0, 0; Gᵀ, 0, 0]` | (−f, w, b) |
//!
//! | piece | equations | A | B | c |
//! | --- | --- | --- | --- | --- |
//! | a variable at a bound `l_i` (`u_i`); an open contact | `x = l_i`; `x = 0` | | | |
//! | a variable between its bounds, a free one, an equality; a sticking contact | `y = 0` | 0 | I | 0 |
//! | sliding contact, `t = u_T/‖u_T‖` | `u_N = 0` | 0 | `e_Nᵀ` | 0 |
//! | | `r_T + mu r_N t = 0` | `[mu t, I]` | `[0, mu r_N (I − t tᵀ)/‖u_T‖]` | `r_N t` |
//!
//! | polyhedron: a row that holds x, an equation | `a_i x − b_i = 0` | 0 | I | 0 |
//! | | a row that does not | `λ_i = 0` | | |
//! | ball with x on its border; cone likewise, `J = diag(1, −1, …)` | `(‖x − c‖² − r²)/2 = 0`; `xᵀJ x/2 = 0` | 0 | I | 0 |
//! | ball or cone with x inside, cone with x at its point | `λ = 0`; `x = 0` | | |
//!
//! The normals of a set are `Aᵀλ + Cᵀν`, `λ (x − c)` of a ball and `−λ J x` of a cone, with `F + normals = 0` where x is no bound's.
//!
//! Unknowns at a bound change with it, `dx_i = dl_i`; the others by
//!
//! ```text
//! (A + B S) dx = −B (dS x + dp) − c dmu,        dy = S dx + dS x + dp.
//! ```
//!
//! With the adjoint `(A + B S)ᵀ λ = −(g_x + Sᵀ g_y)` a function of the solution with gradients `(g_x, g_y)` has, with `s = Bᵀ λ + g_y`, the gradients
//! `∂p = s`, `∂S = s xᵀ`, `∂mu = cᵀ λ` (contact by contact), `∂l_i = (g_x + Sᵀ s)_i`. A matrix that stands twice in S, as H, has both gradients.
//!
//! Where no pair is zero on both sides, no contact is at the border of two pieces and the matrix is regular, the solution is strongly regular and this is its
//! derivative (Robinson1980; FacchineiPang2003, sections 4.1 and 5.4; for contacts KlarbringPang1998). At a *degenerate* solution it is that of one of the pieces that meet there: one element of the
//! B-subdifferential if that piece is one of the solution map's, and a directional derivative in general in no direction.
//!
//! Rows of a polyhedron that x is on and that follow from others count as degenerate: what moves one of them alone changes the piece, a change of F does not, so that with respect to F it is the derivative all the same.
//! So does a variable with equal bounds whose row vanishes: it follows the one bound or the other.
//!
//! Where impulses are not unique the matrix is singular, and there is no derivative of them.
//! Entries of matrices are data each by itself: a change of a symmetric matrix has both of a pair.
//! Cost: a sparse factorisation of the equations that are not `x = l`; then two triangular solves a direction.

mod equations;
mod set;
mod stated;

use nonsmooth_linalg::budget::TooLarge;
use nonsmooth_linalg::{Csc, Matrix};
use nonsmooth_problem::check::{ContactStatus, Judged};
use nonsmooth_problem::{
    AnyPoint, AnyProblem, BoxLcp, Complementarity, Friction, FrictionGlobal, FrictionLocal,
    GlobalPoint, Hlcp, HlcpPoint, Lcp, LcpPoint, LocalPoint, Mcp, Mlcp, Problem as _, ProblemError,
    Vi,
};

use equations::Equations;
use stated::{Pieces, Side, Statement};

/// Why a solution has no derivative here, or a change is none of its data.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DerivativeError {
    /// The point, the problem or a change is at fault.
    #[error(transparent)]
    Problem(#[from] ProblemError),
    /// The judge does not accept the point.
    #[error(
        "the point: expected a solution at tolerance {tolerance:e}, found a relative residual of {found:e}"
    )]
    NotSolved {
        /// The tolerance asked for.
        tolerance: f64,
        /// The residual found.
        found: f64,
    },
    /// The equations of the active set are singular: impulses are not unique.
    #[error(
        "the solution: expected one that the data determine, found others beside it (the equations of the active set are singular)"
    )]
    Singular,
    /// F has no Jacobian at the solution.
    #[error("F: expected a Jacobian at the solution, found none")]
    Undefined,
    /// A row of F depends on a variable that its pattern lacks.
    #[error(
        "row {} of F: expected to depend at the solution on the variables of its pattern alone, found that others change it: state the pattern, or a Jacobian",
        row + 1
    )]
    Uncovered {
        /// From 0.
        row: usize,
    },
    /// The factorisation needs more memory than there is.
    #[error(transparent)]
    TooLarge(TooLarge),
    /// A limit of time, or the flag that cancels.
    #[error("the derivative: expected time for a factorisation, found its limit")]
    Interrupted,
}

/// A change of one part of the data.
#[derive(Debug, Clone, Copy)]
pub enum Change<'a> {
    /// Of a vector, as long as it is.
    Vector(&'a [f64]),
    /// Of a matrix, of its shape.
    Matrix(&'a Matrix),
}

/// How a solution changes: its parts by their names.
#[derive(Debug, Clone, PartialEq)]
pub struct Moved {
    /// Name and change, in the order of [`Derivative::solution`].
    pub parts: Vec<(&'static str, Vec<f64>)>,
}

impl Moved {
    /// The change of a part; `None` where the solution has none of this name.
    pub fn part(&self, name: &str) -> Option<&[f64]> {
        self.parts.iter().find(|part| part.0 == name).map(|part| &part.1[..])
    }
}

/// The gradient of a function of the solution with respect to all data.
#[derive(Debug, Clone, PartialEq)]
pub struct Gradient {
    /// With respect to the vectors, by their letters.
    pub vectors: Vec<(&'static str, Vec<f64>)>,
    /// With respect to the matrices: `Σ a bᵀ` over the pairs (a, b).
    pub matrices: Vec<(&'static str, Vec<[Vec<f64>; 2]>)>,
}

impl Gradient {
    /// With respect to a vector.
    pub fn vector(&self, letter: &str) -> Option<&[f64]> {
        self.vectors.iter().find(|v| v.0 == letter).map(|v| &v.1[..])
    }

    /// With respect to a matrix, as pairs (a, b) of `Σ a bᵀ`.
    pub fn matrix(&self, letter: &str) -> Option<&[[Vec<f64>; 2]]> {
        self.matrices.iter().find(|m| m.0 == letter).map(|m| &m.1[..])
    }
}

/// The derivative of a solution with respect to the data of its problem; see the [module's head](self).
#[derive(Debug)]
pub struct Derivative {
    statement: Statement,
    equations: Equations,
    /// S.
    matrix: Csc,
    /// x.
    point: Vec<f64>,
    /// Pairs or contacts at the border of two pieces: where there is one the derivative is that of one piece.
    pub degenerate: usize,
}

/// Each errs for a point that the judge does not accept at the tolerance, for matrices that are known by their products only, and where the equations are singular.
impl Derivative {
    /// That of a solution of a problem of any kind.
    ///
    /// Errors, besides: rolling friction.
    pub fn of(
        problem: &AnyProblem,
        point: &AnyPoint,
        tolerance: f64,
    ) -> Result<Self, DerivativeError> {
        use Complementarity as C;
        match (problem, point) {
            (AnyProblem::Complementarity(C::Lcp(p)), AnyPoint::Lcp(z)) => {
                Self::of_lcp(p, z, tolerance)
            }
            (AnyProblem::Complementarity(C::Box(p)), AnyPoint::Lcp(z)) => {
                Self::of_boxed(p, z, tolerance)
            }
            (AnyProblem::Complementarity(C::Mlcp(p)), AnyPoint::Lcp(z)) => {
                Self::of_mlcp(p, z, tolerance)
            }
            (AnyProblem::Complementarity(C::Hlcp(p)), AnyPoint::Hlcp(z)) => {
                Self::of_hlcp(p, z, tolerance)
            }
            (AnyProblem::Complementarity(C::Mcp(p)), AnyPoint::Lcp(x)) => {
                Self::of_mcp(p, x, tolerance)
            }
            (AnyProblem::Complementarity(C::Vi(p)), AnyPoint::Lcp(x)) => {
                Self::of_vi(p, x, tolerance)
            }
            (AnyProblem::Friction(Friction::Local2(p)), AnyPoint::Local(r)) => {
                Self::of_local(p, r, tolerance)
            }
            (AnyProblem::Friction(Friction::Local3(p)), AnyPoint::Local(r)) => {
                Self::of_local(p, r, tolerance)
            }
            (AnyProblem::Friction(Friction::Global2(p)), AnyPoint::Global(r)) => {
                Self::of_global(p, r, tolerance)
            }
            (AnyProblem::Friction(Friction::Global3(p)), AnyPoint::Global(r)) => {
                Self::of_global(p, r, tolerance)
            }
            (AnyProblem::Friction(Friction::RollingLocal(_) | Friction::RollingGlobal(_)), _) => {
                Err(ProblemError::Shape {
                    place: "the law".into(),
                    expected: "Coulomb's (with rolling friction no derivative is known)".into(),
                    found: problem.kind().name().into(),
                }
                .into())
            }
            _ => Err(ProblemError::Shape {
                place: "the point".into(),
                expected: format!("one of a problem {}", problem.kind().name()),
                found: "one of another kind".into(),
            }
            .into()),
        }
    }

    /// That of a solution z of a linear complementarity problem: of z and w with respect to M and q.
    pub fn of_lcp(
        problem: &Lcp,
        point: &LcpPoint,
        tolerance: f64,
    ) -> Result<Self, DerivativeError> {
        Self::made(stated::lcp(problem, point, tolerance)?)
    }

    /// That of a solution z of a problem with two bounds: of z and w with respect to M, q, lower and upper.
    pub fn of_boxed(
        problem: &BoxLcp,
        point: &LcpPoint,
        tolerance: f64,
    ) -> Result<Self, DerivativeError> {
        Self::made(stated::boxed(problem, point, tolerance)?)
    }

    /// That of a solution of a mixed problem: of u, v and w with respect to M and q, of all rows and variables.
    ///
    /// Errors, besides: another number of equalities than of free variables, as singular.
    pub fn of_mlcp(
        problem: &Mlcp,
        point: &LcpPoint,
        tolerance: f64,
    ) -> Result<Self, DerivativeError> {
        Self::made(stated::mlcp(problem, point, tolerance)?)
    }

    /// That of a solution of a horizontal problem: of x and s with respect to Q, R and q.
    pub fn of_hlcp(
        problem: &Hlcp,
        point: &HlcpPoint,
        tolerance: f64,
    ) -> Result<Self, DerivativeError> {
        Self::made(stated::hlcp(problem, point, tolerance)?)
    }

    /// That of a solution x of a nonlinear problem: of x and F(x) with respect to a constant that is added to F, lower and upper. Where F depends on parameters p, their
    /// change dp is one of `F` by `∂F/∂p dp`.
    ///
    /// Errors, besides: an F without a Jacobian at x.
    pub fn of_mcp(
        problem: &Mcp,
        point: &LcpPoint,
        tolerance: f64,
    ) -> Result<Self, DerivativeError> {
        Self::made(stated::mcp(problem, point, tolerance)?)
    }

    /// That of a solution x of a variational inequality: of x and F(x) with respect to a constant that is added to F and to the data of the set. These are `lower`, `upper`, `b`, `d`, `centre` and
    /// `radius`, of a product those of its parts one after the other, and `A` and `C` where there is one polyhedron.
    ///
    /// Errors, besides: an F without a Jacobian at x.
    pub fn of_vi(problem: &Vi, point: &LcpPoint, tolerance: f64) -> Result<Self, DerivativeError> {
        Self::made(match problem.mcp() {
            Some(mcp) => stated::mcp(&mcp, point, tolerance)?,
            None => set::over(problem, point, tolerance)?,
        })
    }

    /// That of a solution of a local problem: of r, u and, of scalar rows, of their impulses l and velocities c, with respect to W, q, mu, V, R, s, lower and upper.
    pub fn of_local<const D: usize>(
        problem: &FrictionLocal<D>,
        point: &LocalPoint,
        tolerance: f64,
    ) -> Result<Self, DerivativeError>
    where
        FrictionLocal<D>: Judged<Point = LocalPoint, Status = ContactStatus>,
    {
        Self::made(stated::local(problem, point, tolerance)?)
    }

    /// That of a solution of a global problem: of v, r, u and, of scalar rows, of their impulses l and velocities c, with respect to M, H, f, w, mu, G, b, lower and upper.
    pub fn of_global<const D: usize>(
        problem: &FrictionGlobal<D>,
        point: &GlobalPoint,
        tolerance: f64,
    ) -> Result<Self, DerivativeError>
    where
        FrictionGlobal<D>: Judged<Point = GlobalPoint, Status = ContactStatus>,
    {
        Self::made(stated::global(problem, point, tolerance)?)
    }

    fn made(pieces: Pieces) -> Result<Self, DerivativeError> {
        let Pieces { statement, matrix, point, columns, pieces, degenerate } = pieces;
        let equations = Equations::factorised(&matrix, columns, pieces)?;
        Ok(Self { statement, equations, matrix, point, degenerate })
    }

    /// The parts of the solution by name, with their lengths.
    pub fn solution(&self) -> impl Iterator<Item = (&'static str, usize)> + '_ {
        self.statement.parts.iter().map(|part| (part.name, part.range.len()))
    }

    /// The vectors among the data by letter, with their lengths.
    pub fn vectors(&self) -> impl Iterator<Item = (&'static str, usize)> + '_ {
        self.statement.vectors().map(|(letter, range)| (letter, range.len()))
    }

    /// The matrices among the data by letter, with rows and columns.
    pub fn matrices(&self) -> impl Iterator<Item = (&'static str, [usize; 2])> + '_ {
        let mut seen: Vec<&str> = vec![];
        self.statement.blocks.iter().filter_map(move |block| {
            let new = !seen.contains(&block.letter);
            seen.push(block.letter);
            new.then_some((block.letter, block.shape))
        })
    }

    /// How the solution changes with the data: those that are not named do not change.
    ///
    /// Errors: a letter that the problem has not, another shape than that of its part, a number that is not finite.
    pub fn forward(&self, changes: &[(&str, Change<'_>)]) -> Result<Moved, DerivativeError> {
        let Self { statement, matrix, point, equations, .. } = self;
        // dS x + dp
        let mut load = vec![0.0; matrix.nrows()];
        let mut dx = vec![0.0; matrix.ncols()];
        let mut mu = None;
        for &(letter, change) in changes {
            match change {
                Change::Vector(d) => {
                    self.check_length(letter, d.len())?;
                    finite(&format!("d{letter}"), d)?;
                    for part in statement.loads.iter().filter(|part| part.letter == letter) {
                        part.entries.iter().for_each(|&(row, k, a)| load[row] += a * d[k]);
                    }
                    equations.columns.at_bounds(letter, d, &mut dx);
                    mu = mu.or((letter == stated::MU).then_some(d));
                }
                Change::Matrix(d) => {
                    self.check_shape(letter, [d.nrows(), d.ncols()])?;
                    d.check_finite(&format!("d{letter}")).map_err(ProblemError::from)?;
                    for block in statement.blocks.iter().filter(|block| block.letter == letter) {
                        let x = &point[block.columns()];
                        let mut product = vec![0.0; block.rows().len()];
                        match block.transposed {
                            true => d.mul_transpose(x, &mut product),
                            false => d.mul(x, &mut product),
                        }
                        let into = &mut load[block.rows()];
                        into.iter_mut().zip(&product).for_each(|(l, p)| *l += block.sign * p);
                    }
                }
            }
        }
        // Of the bounds first: what is between them follows.
        matrix.mul_add(1.0, &dx, &mut load);
        let moved = equations.forward(&load, mu);
        matrix.mul_add(1.0, &moved, &mut load);
        dx.iter_mut().zip(&moved).for_each(|(dx, moved)| *dx += moved);
        let dy = load;
        let parts = statement.parts.iter().map(|part| {
            let from = if part.side == Side::X { &dx } else { &dy };
            (part.name, from[part.range.clone()].to_vec())
        });
        Ok(Moved { parts: parts.collect() })
    }

    /// The gradient with respect to all data of a function of the solution whose gradients with respect to its parts are these, zero where none is given.
    ///
    /// Errors: a name that the solution has not, another length than that of its part, a number that is not finite.
    pub fn backward(&self, gradients: &[(&str, &[f64])]) -> Result<Gradient, DerivativeError> {
        let Self { statement, matrix, point, equations, .. } = self;
        let (mut gx, mut gy) = (vec![0.0; matrix.ncols()], vec![0.0; matrix.nrows()]);
        for &(name, g) in gradients {
            let part = statement.parts.iter().find(|part| part.name == name);
            let part = part.ok_or_else(|| self.unknown(name, self.solution().map(|p| p.0)))?;
            length(name, part.range.len(), g.len())?;
            finite(name, g)?;
            let into = if part.side == Side::X { &mut gx } else { &mut gy };
            into[part.range.clone()].iter_mut().zip(g).for_each(|(x, g)| *x += g);
        }
        let mut through = gx.clone();
        matrix.mul_transpose_add(1.0, &gy, &mut through);
        // s
        let mut s = gy;
        let mut mu = vec![0.0; statement.contacts];
        equations.backward(&through, &mut s, &mut mu);
        let mut at_bounds = gx;
        matrix.mul_transpose_add(1.0, &s, &mut at_bounds);
        let vectors = statement.vectors().map(|(letter, range)| {
            let gradient = if letter == stated::MU {
                mu.clone()
            } else if let Some(part) = statement.loads.iter().find(|part| part.letter == letter) {
                let mut gradient = vec![0.0; part.len];
                part.entries.iter().for_each(|&(row, k, a)| gradient[k] += a * s[row]);
                gradient
            } else {
                equations.columns.of_bounds(letter, range.len(), &at_bounds)
            };
            (letter, gradient)
        });
        let matrices = self.matrices().map(|(letter, _)| {
            let blocks = statement.blocks.iter().filter(|block| block.letter == letter);
            let pairs = blocks.map(|block| {
                let left = s[block.rows()].iter().map(|s| block.sign * s).collect();
                let right = point[block.columns()].to_vec();
                if block.transposed { [right, left] } else { [left, right] }
            });
            (letter, pairs.collect())
        });
        Ok(Gradient { vectors: vectors.collect(), matrices: matrices.collect() })
    }

    fn check_length(&self, letter: &str, found: usize) -> Result<(), DerivativeError> {
        match self.vectors().find(|v| v.0 == letter) {
            Some((_, n)) => length(&format!("d{letter}"), n, found),
            None => Err(self.unknown(letter, self.vectors().map(|v| v.0))),
        }
    }

    fn check_shape(&self, letter: &str, found: [usize; 2]) -> Result<(), DerivativeError> {
        let Some((_, shape)) = self.matrices().find(|m| m.0 == letter) else {
            return Err(self.unknown(letter, self.matrices().map(|m| m.0)));
        };
        if shape == found {
            return Ok(());
        }
        let words = |[m, n]: [usize; 2]| format!("{m} × {n}");
        Err(ProblemError::Shape {
            place: format!("d{letter}"),
            expected: words(shape),
            found: words(found),
        }
        .into())
    }

    fn unknown<'a>(&self, name: &str, known: impl Iterator<Item = &'a str>) -> DerivativeError {
        let known: Vec<_> = known.collect();
        ProblemError::Shape {
            place: "derivative".into(),
            expected: format!("one of {}", known.join(", ")),
            found: name.into(),
        }
        .into()
    }
}

fn finite(place: &str, x: &[f64]) -> Result<(), DerivativeError> {
    match x.iter().position(|x| !x.is_finite()) {
        None => Ok(()),
        Some(k) => Err(ProblemError::Value {
            place: format!("{place}[{k}]"),
            expected: "a finite number".into(),
            found: x[k].to_string(),
        }
        .into()),
    }
}

fn length(place: &str, expected: usize, found: usize) -> Result<(), DerivativeError> {
    match expected == found {
        true => Ok(()),
        false => Err(ProblemError::Shape {
            place: place.into(),
            expected: format!("{expected} entries"),
            found: found.to_string(),
        }
        .into()),
    }
}

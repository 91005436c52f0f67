//! Variational inequality over boxes and polyhedra → mixed complementarity problem: the constraints get multipliers.
//!
//! ```text
//! l ≤ x ≤ u  ⟂  F(x) + Aᵀλ + Cᵀμ,     0 ≤ λ  ⟂  b − A x,     μ free,  d − C x = 0
//! ```
//!
//! An inequality of one variable is a bound and needs no multiplier. Equivalent, since the constraints are affine (FacchineiPang2003, prop. 1.2.1); monotone where F is. F by expressions stays so: the result keeps its doubled precision, and where F is
//! affine it is a linear problem. Cost: a copy of the constraints, and of the graph. Fails: balls and cones, whose multipliers belong to functions that are not affine.

use std::sync::Arc;

use nonsmooth_problem::field::{Binary, Evaluator, Expressions, Field, Graph, Node, Pattern};
use nonsmooth_problem::{Kind, LcpPoint, Mcp, Set, Vi};

use crate::core::reformulation::Reformulation;
use crate::core::register::{Composed, Over};
use crate::core::settings::NoSettings;
use crate::{Boxed, SolveError, Via, ViaSession};

/// The constraints' multipliers as variables.
#[derive(Debug, Clone, Copy, Default)]
pub struct Multipliers;

impl Multipliers {
    /// Whether it applies: to products of boxes and polyhedra.
    pub fn applies(set: &Set) -> bool {
        let affine = |set: &Set| matches!(set, Set::Box { .. } | Set::Polyhedron { .. });
        set.parts().iter().all(|(_, set)| affine(set))
    }
}

impl Composed<Vi> for Multipliers {
    type To = Mcp;
    type Settings = NoSettings;
    const NAME: &'static str = "multipliers";
    const SUMMARY: &'static str =
        "variational inequality over boxes and polyhedra to MCP: multipliers are variables";
    const FROM: &'static [Kind] = &[Kind::Vi];
    const CITES: &'static [&'static str] = &["FacchineiPang2003"];

    const SESSION: Option<Over<NoSettings, Mcp, Vi>> =
        Some(|_, session| Box::new(ViaSession::new(Multipliers, session)));

    fn compose(_: NoSettings, solver: Boxed<Mcp>) -> Boxed<Vi> {
        Boxed::new(Via { reformulation: Multipliers, solver })
    }
}

/// `M x + q` with the multipliers' rows of M, −A and −C, each by its entries.
#[derive(Debug, Clone, Default)]
struct Constraints {
    rows: Vec<Vec<(usize, f64)>>,
    rhs: Vec<f64>,
    /// Whether the multiplier is free.
    free: Vec<bool>,
}

impl Constraints {
    /// The constraints that are no bounds, and the bounds of x.
    fn of(set: &Set) -> (Self, [Vec<f64>; 2]) {
        let mut out = Self::default();
        let [mut lower, mut upper] = [f64::NEG_INFINITY, f64::INFINITY].map(|x| vec![x; set.dim()]);
        for (first, set) in set.parts() {
            match set {
                Set::Box { lower: l, upper: u } => {
                    lower[first..first + l.len()].copy_from_slice(l);
                    upper[first..first + u.len()].copy_from_slice(u);
                }
                Set::Polyhedron { A, b, C, d } => {
                    for (m, rhs, free) in [(A, b, false), (C, d, true)] {
                        let mut rows = vec![vec![]; m.nrows()];
                        m.triplets().for_each(|(i, j, x)| rows[i].push((first + j, -x)));
                        for (row, &rhs) in rows.into_iter().zip(rhs) {
                            match row[..] {
                                [(j, x)]
                                    if !free && bound(-x, rhs, &mut lower[j], &mut upper[j]) => {}
                                _ => {
                                    out.rows.push(row);
                                    out.rhs.push(rhs);
                                    out.free.push(free);
                                }
                            }
                        }
                    }
                }
                Set::Ball { .. } | Set::SecondOrderCone { .. } | Set::Product(_) => {}
            }
        }
        (out, [lower, upper])
    }

    /// The constraints of each of n variables, with minus their coefficients.
    fn transposed(&self, n: usize) -> Vec<Vec<(usize, f64)>> {
        let mut columns = vec![vec![]; n];
        for (k, row) in self.rows.iter().enumerate() {
            row.iter().for_each(|&(j, x)| columns[j].push((n + k, -x)));
        }
        columns
    }
}

/// Tightens l and u by `a x ≤ b`. False where that is no bound between which there is a number.
fn bound(a: f64, b: f64, l: &mut f64, u: &mut f64) -> bool {
    let x = b / a;
    let (low, high) = if a > 0.0 { (*l, u.min(x)) } else { (l.max(x), *u) };
    let is = a != 0.0 && x.is_finite() && low <= high;
    if is {
        (*l, *u) = (low, high);
    }
    is
}

impl Reformulation<Vi> for Multipliers {
    type To = Mcp;
    type Memo = ();

    fn reduce(&self, problem: &Vi) -> Result<(Mcp, ()), SolveError> {
        if !Self::applies(&problem.set) {
            return Err(SolveError::needs("a set of boxes and polyhedra", "a ball or a cone"));
        }
        let (constraints, [mut lower, mut upper]) = Constraints::of(&problem.set);
        lower.extend(
            constraints.free.iter().map(|free| if *free { f64::NEG_INFINITY } else { 0.0 }),
        );
        upper.resize(lower.len(), f64::INFINITY);
        let mut start = problem.start.clone();
        start.resize(lower.len(), 0.0);
        let field: Arc<dyn Field> = match problem.F.expressions() {
            _ if constraints.rows.is_empty() => problem.F.clone(),
            Some(f) => Arc::new(expressions(f, &constraints)?),
            None => Arc::new(Multiplied::new(problem.F.clone(), constraints)),
        };
        Ok((Mcp::of(field, lower, upper, start)?, ()))
    }

    fn lower(&self, problem: &Vi, point: &LcpPoint, (): &(), reduced: &mut LcpPoint) {
        reduced.z[..problem.dim()].copy_from_slice(&point.z);
        reduced.z[problem.dim()..].fill(0.0);
    }

    fn lift(&self, problem: &Vi, reduced: &LcpPoint, (): &mut (), point: &mut LcpPoint) {
        point.z.copy_from_slice(&reduced.z[..problem.dim()]);
    }
}

/// The rows as expressions of x and the multipliers.
fn expressions(f: &Expressions, constraints: &Constraints) -> Result<Expressions, SolveError> {
    let n = f.dim();
    let mut graph = Graph::new(n + constraints.rows.len());
    for node in f.graph().nodes() {
        graph.add(node.clone());
    }
    let mut rows = f.rows().to_vec();
    for (row, terms) in rows.iter_mut().zip(constraints.transposed(n)) {
        if !terms.is_empty() {
            let forces = graph.add(Node::Linear(terms));
            *row = graph.binary(Binary::Add, *row, forces);
        }
    }
    for (terms, rhs) in constraints.rows.iter().zip(&constraints.rhs) {
        let linear = graph.add(Node::Linear(terms.clone()));
        let rhs = graph.constant(*rhs);
        rows.push(graph.binary(Binary::Add, linear, rhs));
    }
    Ok(Expressions::new(graph, rows)?)
}

/// Any F with multipliers.
#[derive(Debug, Clone)]
struct Multiplied {
    inner: Arc<dyn Field>,
    constraints: Arc<Constraints>,
    columns: Arc<Vec<Vec<(usize, f64)>>>,
    pattern: Pattern,
}

impl Multiplied {
    fn new(inner: Arc<dyn Field>, constraints: Constraints) -> Self {
        let n = inner.dim();
        let columns = constraints.transposed(n);
        let of_x = (0..n).map(|i| {
            let forces = columns[i].iter().map(|term| term.0);
            inner.pattern().row(i).iter().copied().chain(forces).collect::<Vec<_>>()
        });
        let of_multipliers =
            constraints.rows.iter().map(|row| row.iter().map(|term| term.0).collect());
        let rows = of_x.chain(of_multipliers).map(Vec::into_iter);
        let pattern = Pattern::new(rows);
        let (constraints, columns) = (Arc::new(constraints), Arc::new(columns));
        Self { inner, constraints, columns, pattern }
    }
}

impl Field for Multiplied {
    fn dim(&self) -> usize {
        self.pattern.rows()
    }

    fn pattern(&self) -> &Pattern {
        &self.pattern
    }

    fn evaluator(&self) -> Box<dyn Evaluator> {
        let slopes = vec![0.0; self.inner.pattern().len()];
        Box::new(Running { inner: self.inner.evaluator(), field: self.clone(), slopes })
    }

    fn source(&self) -> String {
        format!("{}, with multipliers", self.inner.source())
    }
}

struct Running {
    inner: Box<dyn Evaluator>,
    field: Multiplied,
    slopes: Vec<f64>,
}

impl Running {
    /// What the multipliers add to F, and the constraints.
    fn add_constraints(&self, x: &[f64], f: &mut [f64]) {
        let Multiplied { constraints, columns, .. } = &self.field;
        let product = |terms: &[(usize, f64)]| terms.iter().map(|&(j, a)| a * x[j]).sum::<f64>();
        let (of_x, of_multipliers) = f.split_at_mut(columns.len());
        of_x.iter_mut().zip(&**columns).for_each(|(f, terms)| *f += product(terms));
        for ((f, terms), rhs) in
            of_multipliers.iter_mut().zip(&constraints.rows).zip(&constraints.rhs)
        {
            *f = product(terms) + rhs;
        }
    }
}

impl Evaluator for Running {
    fn value(&mut self, x: &[f64], f: &mut [f64]) -> bool {
        let n = self.field.columns.len();
        let defined = self.inner.value(&x[..n], &mut f[..n]);
        self.add_constraints(x, f);
        defined
    }

    fn jacobian(&mut self, x: &[f64], f: &mut [f64], jacobian: &mut [f64]) -> bool {
        let n = self.field.columns.len();
        let defined = self.inner.jacobian(&x[..n], &mut f[..n], &mut self.slopes);
        self.add_constraints(x, f);
        let inner = self.field.inner.pattern();
        let of_x = (0..n).flat_map(|i| {
            let forces = self.field.columns[i].iter().map(|term| term.1);
            self.slopes[inner.range(i)].iter().copied().chain(forces)
        });
        let of_multipliers = self.field.constraints.rows.iter().flatten().map(|term| term.1);
        jacobian.iter_mut().zip(of_x.chain(of_multipliers)).for_each(|(to, from)| *to = from);
        defined
    }
}

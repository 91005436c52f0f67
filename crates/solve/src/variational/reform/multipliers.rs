//! Variational inequality over boxes and polyhedra → mixed complementarity problem: the constraints get multipliers.
//!
//! ```text
//! l ≤ x ≤ u  ⟂  F(x) + Aᵀλ + Cᵀμ,     0 ≤ λ  ⟂  b − A x,     μ free,  d − C x = 0
//! ```
//!
//! An inequality of one variable whose quotient b/a is a double is a bound and needs no multiplier. Equivalent, since the constraints are affine (FacchineiPang2003, prop. 1.2.1); monotone where F is. F by expressions stays so: the result keeps its doubled precision, and where F is
//! affine it is a linear problem. A certificate of the result is one of the inequality as it stands: both judges state the same system. Cost: a copy of the constraints, and of the graph. Fails: balls and cones, whose multipliers belong to functions that are not affine.

use std::sync::Arc;

use nonsmooth_problem::check::Constraint;
use nonsmooth_problem::field::{Binary, Evaluator, Expressions, Field, Graph, Node, Pattern};
use nonsmooth_problem::{Constraints, Kind, LcpPoint, Mcp, Set, Vi};

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

/// The constraints of each of n variables, by the variables that are their multipliers.
fn forces(constraints: &[Constraint], n: usize) -> Vec<Vec<(usize, f64)>> {
    let mut columns = vec![vec![]; n];
    for (k, constraint) in constraints.iter().enumerate() {
        constraint.terms.iter().for_each(|&(j, a)| columns[j].push((n + k, a)));
    }
    columns
}

impl Reformulation<Vi> for Multipliers {
    type To = Mcp;
    type Memo = ();

    fn reduce(&self, problem: &Vi) -> Result<(Mcp, ()), SolveError> {
        if !Self::applies(&problem.set) {
            return Err(SolveError::needs("a set of boxes and polyhedra", "a ball or a cone"));
        }
        let Constraints { mut lower, mut upper, others } = problem.set.constraints();
        let least = |c: &Constraint| if c.equation { f64::NEG_INFINITY } else { 0.0 };
        lower.extend(others.iter().map(least));
        upper.resize(lower.len(), f64::INFINITY);
        let mut start = problem.start.clone();
        start.resize(lower.len(), 0.0);
        let field: Arc<dyn Field> = match problem.F.expressions() {
            _ if others.is_empty() => problem.F.clone(),
            Some(f) => Arc::new(expressions(f, &others)?),
            None => Arc::new(Multiplied::new(problem.F.clone(), others)),
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
fn expressions(f: &Expressions, constraints: &[Constraint]) -> Result<Expressions, SolveError> {
    let n = f.dim();
    let mut graph = Graph::new(n + constraints.len());
    for node in f.graph().nodes() {
        graph.add(node.clone());
    }
    let mut rows = f.rows().to_vec();
    for (row, terms) in rows.iter_mut().zip(forces(constraints, n)) {
        if !terms.is_empty() {
            let forces = graph.add(Node::Linear(terms));
            *row = graph.binary(Binary::Add, *row, forces);
        }
    }
    for constraint in constraints {
        let opposite = constraint.terms.iter().map(|&(j, a)| (j, -a)).collect();
        let linear = graph.add(Node::Linear(opposite));
        let rhs = graph.constant(constraint.rhs);
        rows.push(graph.binary(Binary::Add, linear, rhs));
    }
    Ok(Expressions::new(graph, rows)?)
}

/// Any F with multipliers.
#[derive(Debug, Clone)]
struct Multiplied {
    inner: Arc<dyn Field>,
    constraints: Arc<[Constraint]>,
    columns: Arc<Vec<Vec<(usize, f64)>>>,
    pattern: Pattern,
}

impl Multiplied {
    fn new(inner: Arc<dyn Field>, constraints: Vec<Constraint>) -> Self {
        let n = inner.dim();
        let columns = forces(&constraints, n);
        let of_x = (0..n).map(|i| {
            let forces = columns[i].iter().map(|term| term.0);
            inner.pattern().row(i).iter().copied().chain(forces).collect::<Vec<_>>()
        });
        let of_multipliers =
            constraints.iter().map(|c| c.terms.iter().map(|term| term.0).collect());
        let rows = of_x.chain(of_multipliers).map(Vec::into_iter);
        let pattern = Pattern::new(rows);
        let (constraints, columns) = (constraints.into(), Arc::new(columns));
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
        for (f, constraint) in of_multipliers.iter_mut().zip(&**constraints) {
            *f = constraint.rhs - product(&constraint.terms);
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
        let of_multipliers =
            self.field.constraints.iter().flat_map(|c| &c.terms).map(|term| -term.1);
        jacobian.iter_mut().zip(of_x.chain(of_multipliers)).for_each(|(to, from)| *to = from);
        defined
    }
}

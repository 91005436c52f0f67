//! Nonlinear problems in exact numbers: a relaxation in which each term that is not linear is a variable of its own, between the bounds of its values.
//!
//! ```text
//! F_i(x) = Σ_j c_ij x_j + Σ_t c_it N_t(x) + b_i     becomes     Σ_j c_ij x_j + Σ_t c_it y_t + b_i,   y_t ∈ [α_t, β_t] ⊇ N_t(box)
//! ```
//!
//! Every solution of the problem is one of the relaxation with `y_t = N_t(x)`, so what refutes the relaxation refutes the problem, for any F. Where the bounds `l ≤ x ≤ u` have directions d that
//! lead to infinity, one vector `y = d` over the rows says that `F(x)ᵀd < 0` on the whole set, against `F(x)ᵀd ≥ 0` at a solution; several vectors close the cases of the
//! pairs. Without terms that are not linear nothing is relaxed. The bounds α and β are rounded outwards ([`Range`]), over a box that was first made smaller by what rows with a known sign say of
//! single variables. Inequalities between terms and variables that always hold are rows of their own
//! ([`cuts`]).

use std::collections::BTreeMap;

use super::cones::{Column, ConeSystem};
use super::cuts::cuts;
use super::exact::{Exact, exact, negative, rounded};
use super::statement::bounded;
use crate::field::{Combination, Expressions, Range, Term};

/// `−F(x) − Aᵀλ ∈ N(x)`, `l ≤ x ≤ u`, `0 ≤ λ ⟂ b − A x ≥ 0` (`λ` free, `b − A x = 0`).
pub(crate) struct Relaxed<'a> {
    pub(crate) field: &'a Expressions,
    pub(crate) lower: &'a [f64],
    pub(crate) upper: &'a [f64],
    /// Of each variable whether nothing is said of its row of F: that of a ball, or of a cone.
    pub(crate) silent: Vec<bool>,
    /// Constraints with multipliers.
    pub(crate) constraints: &'a [Constraint],
    /// Variables that are one second-order cone each, two at least.
    pub(crate) cones: Vec<std::ops::Range<usize>>,
}

/// `Σ a_j x_j ≤ b`, or `= b`.
#[derive(Debug, Clone, PartialEq)]
pub struct Constraint {
    /// Variables with their coefficients.
    pub terms: Vec<(usize, f64)>,
    /// b
    pub rhs: f64,
    /// Whether it is an equation.
    pub equation: bool,
}

/// More variables have their box as it is.
const CONTRACTED: usize = 500;
/// Rounds of contraction.
const ROUNDS: usize = 4;
/// Rows beyond which no cut is added: what is searched has no more.
const ROOM: usize = 240;

/// What is known of a row's sign at a solution: at least zero, at most zero.
type Sign = [bool; 2];

impl Relaxed<'_> {
    /// The relaxation; with `wanted`, of these rows (those of constraints come after F's). `None` where the time is over before.
    pub(crate) fn system(&self, wanted: Option<&[bool]>) -> Option<ConeSystem> {
        let n = self.lower.len();
        let small = n <= CONTRACTED;
        let chosen: Vec<usize> = (0..n).filter(|&i| small || wanted.is_none_or(|w| w[i])).collect();
        let mut rows = vec![Combination::default(); n];
        for (&i, row) in chosen.iter().zip(self.field.combinations(&chosen)?) {
            rows[i] = row;
        }
        let (mut lower, mut upper) = (self.lower.to_vec(), self.upper.to_vec());
        if small {
            self.contract(&rows, &mut lower, &mut upper)?;
        }
        let ranges = self.field.graph().ranges(&lower, &upper)?;

        let rhs = rows.iter().map(|row| row.constant.clone());
        let rhs = rhs.chain(self.constraints.iter().map(|c| exact(c.rhs))).collect();
        let mut system = ConeSystem::new(rhs, wanted);
        let mut columns: Vec<Column> = vec![vec![]; n];
        let mut terms: BTreeMap<Term, Column> = BTreeMap::new();
        for (i, row) in rows.iter().enumerate() {
            for (term, c) in &row.terms {
                match term {
                    Term::Variable(j) => columns[*j].push((i, -c)),
                    Term::Node(_) => terms.entry(*term).or_default().push((i, -c)),
                }
            }
        }
        for (k, constraint) in self.constraints.iter().enumerate() {
            constraint.terms.iter().for_each(|&(j, a)| columns[j].push((n + k, exact(a))));
        }
        system.complete = terms.is_empty() && self.cones.is_empty() && !self.silent.contains(&true);
        let mut partners = vec![None; n];
        for (j, mut column) in columns.into_iter().enumerate() {
            column.retain(|(i, _)| system.wants(*i));
            let bounds = [self.lower[j], self.upper[j]];
            let unknown = if self.silent[j] {
                let w = system.unit(j, 1);
                system.free.push(w);
                partners[j] = Some(w);
                between(&mut system, column, bounds)
            } else {
                bounded(&mut system, j, column, bounds)
            };
            system.unknowns.push(unknown);
        }
        for (k, constraint) in self.constraints.iter().enumerate() {
            let forces = constraint.terms.iter().map(|&(j, a)| (j, exact(-a)));
            let column = forces.filter(|(i, _)| system.wants(*i)).collect();
            let least = if constraint.equation { f64::NEG_INFINITY } else { 0.0 };
            bounded(&mut system, n + k, column, [least, f64::INFINITY]);
        }
        let mut values = BTreeMap::new();
        for (term, mut column) in terms {
            let Term::Node(node) = term else { continue };
            column.retain(|(i, _)| system.wants(*i));
            let range = ranges[node.index()];
            values.insert(term, between(&mut system, column, [range.low, range.high]));
        }
        if small && !values.is_empty() {
            let room = ROOM.saturating_sub(system.rhs.len());
            for cut in cuts(self.field, &rows, &lower, &upper)?.into_iter().take(room) {
                // Σ c_t t − slack = least
                let row = system.row(cut.least);
                for (term, c) in cut.terms {
                    let (origin, parts) = match term {
                        Term::Variable(j) => system.unknowns[j].clone(),
                        Term::Node(_) => values[&term].clone(),
                    };
                    system.rhs[row] -= &c * origin;
                    for (t, factor) in parts {
                        system.columns[t].push((row, &c * factor));
                    }
                }
                let slack = system.unit(row, -1);
                system.rays.push(slack);
            }
        }
        for cone in &self.cones {
            // x_1 ≥ |x_j|, and of its dual cone likewise.
            let axis = system.unknowns[cone.start].1.first().map(|t| t.0);
            for j in cone.clone().skip(1) {
                let x = system.unknowns[j].1.first().map(|t| t.0);
                for pair in [[axis, x], [partners[cone.start], partners[j]]] {
                    let [Some(first), Some(other)] = pair else { continue };
                    for sign in [1i8, -1] {
                        let row = system.row(Exact::ZERO);
                        system.columns[first].push((row, Exact::ONE));
                        system.columns[other].push((row, Exact::from(sign)));
                        let slack = system.unit(row, -1);
                        system.rays.push(slack);
                    }
                }
            }
        }
        Some(system)
    }

    /// What is known of the signs of F's rows at a solution.
    fn signs(&self) -> Vec<Sign> {
        let mut signs: Vec<Sign> = self
            .lower
            .iter()
            .zip(self.upper)
            .map(|(l, u)| [u.is_infinite(), l.is_infinite()])
            .collect();
        signs.iter_mut().zip(&self.silent).filter(|(_, s)| **s).for_each(|(s, _)| *s = [false; 2]);
        // Multipliers may be anything.
        let forced = self.constraints.iter().flat_map(|c| &c.terms);
        forced.for_each(|&(j, _)| signs[j] = [false; 2]);
        signs
    }

    /// Makes the box smaller, without a solution being lost: by the sign of each row and the bounds of all its terms but one, and where a row has one sign everywhere.
    fn contract(&self, rows: &[Combination], l: &mut [f64], u: &mut [f64]) -> Option<()> {
        let mut conditions: Vec<(Option<usize>, Combination, Sign)> = vec![];
        for (i, (row, sign)) in rows.iter().zip(self.signs()).enumerate() {
            let own = !self.silent[i]
                && !self.constraints.iter().any(|c| c.terms.iter().any(|t| t.0 == i));
            conditions.push((own.then_some(i), row.clone(), sign));
        }
        for c in self.constraints {
            let terms = c.terms.iter().map(|&(j, a)| (Term::Variable(j), exact(-a))).collect();
            let row = Combination { terms, constant: exact(c.rhs) };
            conditions.push((None, row, [true, c.equation]));
        }
        for _ in 0..ROUNDS {
            let ranges = self.field.graph().ranges(l, u)?;
            let mut changed = false;
            for (own, row, sign) in &conditions {
                let value = |term: &Term, l: &[f64], u: &[f64]| match term {
                    Term::Variable(j) => Range::new(l[*j], u[*j]),
                    Term::Node(node) => ranges[node.index()],
                };
                let parts: Vec<(&Term, Range)> =
                    row.terms.iter().map(|(t, c)| (t, around(c))).collect();
                let part = |k: usize, l: &[f64], u: &[f64]| parts[k].1.mul(value(parts[k].0, l, u));
                // Sums of the parts after each.
                let mut after = vec![around(&row.constant)];
                for k in (0..parts.len()).rev() {
                    after.push(after[after.len() - 1].add(part(k, l, u)));
                }
                let total = after[parts.len()];
                if let Some(i) = *own {
                    let (from, to) = (self.lower[i], self.upper[i]);
                    if total.low > 0.0 && from.is_finite() && u[i] > from {
                        (l[i], u[i], changed) = (from, from, true);
                    } else if total.high < 0.0 && to.is_finite() && l[i] < to {
                        (l[i], u[i], changed) = (to, to, true);
                    }
                }
                if *sign == [false; 2] {
                    continue;
                }
                let mut before = Range::point(0.0);
                for (k, (term, c)) in parts.iter().enumerate() {
                    let rest = before.add(after[parts.len() - 1 - k]);
                    before = before.add(part(k, l, u));
                    let Term::Variable(j) = **term else { continue };
                    let low = if sign[0] { -rest.high } else { f64::NEG_INFINITY };
                    let high = if sign[1] { -rest.low } else { f64::INFINITY };
                    let x = Range::new(low, high).div(*c);
                    let (low, high) = (x.low.max(l[j]), x.high.min(u[j]));
                    // An empty box would say nothing of which row refutes the problem: the larger one stays.
                    if low <= high && (gains(l[j], low) || gains(u[j], high)) {
                        (l[j], u[j], changed) = (low, high, true);
                    }
                }
            }
            if !changed {
                break;
            }
        }
        Some(())
    }
}

/// Whether a bound has moved so far that another look is worth it.
fn gains(old: f64, new: f64) -> bool {
    old != new && (old.is_infinite() || (old - new).abs() > 1e-3 * old.abs().max(new.abs()))
}

/// The double next to a number, or the two around it.
pub(super) fn around(x: &Exact) -> Range {
    let near = rounded(x);
    match exact(near) == *x {
        _ if !near.is_finite() => Range::new(f64::NEG_INFINITY, f64::INFINITY),
        true => Range::point(near),
        false if negative(&(x - exact(near))) => Range::new(near.next_down(), near),
        false => Range::new(near, near.next_up()),
    }
}

/// A variable between two bounds, with its column, and without a partner: `x = origin + Σ factor · t_j`.
fn between(
    system: &mut ConeSystem,
    column: Column,
    [l, u]: [f64; 2],
) -> (Exact, Vec<(usize, Exact)>) {
    let origin = exact(if l.is_finite() { l } else { u });
    for (i, x) in &column {
        system.rhs[*i] -= x * &origin;
    }
    let unknown = match (l.is_finite(), u.is_finite()) {
        (false, false) => {
            let x = system.column(column);
            system.free.push(x);
            vec![(x, Exact::ONE)]
        }
        (true, false) => {
            let x = system.column(column);
            system.rays.push(x);
            vec![(x, Exact::ONE)]
        }
        (false, true) => {
            let x = system.column(column.into_iter().map(|(i, x)| (i, -x)).collect());
            system.rays.push(x);
            vec![(x, -Exact::ONE)]
        }
        (true, true) if l == u => vec![],
        (true, true) => {
            let bound = system.row(exact(u) - exact(l));
            let x = system.column([column, vec![(bound, Exact::ONE)]].concat());
            let slack = system.unit(bound, 1);
            system.rays.extend([x, slack]);
            system.slack_rows.push((bound, [x, slack]));
            vec![(x, Exact::ONE)]
        }
    };
    (origin, unknown)
}

//! Boxes and polyhedra as bounds of variables and constraints between them.

use super::Set;
use crate::check::Constraint;

/// `{l ≤ x ≤ u, Σ a_j x_j ≤ b or = b}`
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Constraints {
    /// l
    pub lower: Vec<f64>,
    /// u
    pub upper: Vec<f64>,
    /// Those that are no bounds.
    pub others: Vec<Constraint>,
}

impl Set {
    /// The bounds and the other constraints of a product of boxes and polyhedra; an inequality of one variable whose quotient `b/a` is a double is a bound. What balls and cones ask for is not among
    /// them, but for bounds of each variable that follow from it: a ball's are rounded outwards, of a cone `x_1 ≥ 0`.
    pub fn constraints(&self) -> Constraints {
        let n = self.dim();
        let mut out = Constraints {
            lower: vec![f64::NEG_INFINITY; n],
            upper: vec![f64::INFINITY; n],
            others: vec![],
        };
        for (first, set) in self.parts() {
            match set {
                Self::Box { lower: l, upper: u } => {
                    out.lower[first..first + l.len()].copy_from_slice(l);
                    out.upper[first..first + u.len()].copy_from_slice(u);
                }
                Self::Polyhedron { A, b, C, d } => {
                    for (m, rhs, equation) in [(A, b, false), (C, d, true)] {
                        let mut rows = vec![vec![]; m.nrows()];
                        m.triplets().for_each(|(i, j, x)| rows[i].push((first + j, x)));
                        for (terms, &rhs) in rows.into_iter().zip(rhs) {
                            let is_bound = match terms[..] {
                                [(j, a)] if !equation => {
                                    bound(a, rhs, &mut out.lower[j], &mut out.upper[j])
                                }
                                _ => false,
                            };
                            if !is_bound {
                                out.others.push(Constraint { terms, rhs, equation });
                            }
                        }
                    }
                }
                Self::Ball { centre, radius } => {
                    for (k, c) in centre.iter().enumerate() {
                        out.lower[first + k] = (c - radius).next_down();
                        out.upper[first + k] = (c + radius).next_up();
                    }
                }
                Self::SecondOrderCone { .. } => out.lower[first] = 0.0,
                Self::Product(_) => {}
            }
        }
        out
    }
}

/// Tightens l and u by `a x ≤ b`. False where that is no bound between which there is a number, or the bound would be rounded.
fn bound(a: f64, b: f64, l: &mut f64, u: &mut f64) -> bool {
    let x = b / a;
    let exact = b == 0.0 || ((-x).mul_add(a, b) == 0.0 && b.abs() > 1e-280 && x.abs() > 1e-280);
    let (low, high) = if a > 0.0 { (*l, u.min(x)) } else { (l.max(x), *u) };
    let is = a != 0.0 && x.is_finite() && exact && low <= high;
    if is {
        (*l, *u) = (low, high);
    }
    is
}

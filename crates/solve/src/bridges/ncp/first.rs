//! The first formulation of friction as an NCP.
//!
//! ```text
//! 0 ≤ u_N                ⟂  r_N ≥ 0
//! κ r_T + mu r_N u_T = 0     r_T free
//! 0 ≤ mu r_N − ‖r_T‖     ⟂  κ ≥ 0
//! ```
//!
//! A contact that slides has `‖r_T‖ = mu r_N` and hence `κ = ‖u_T‖`, `r_T` opposed to u_T; one that is pressed and has κ = 0 has u_T = 0. The lecture's (79) writes ‖r_T‖ for the mu r_N
//! of the equation and states `κ = ‖u_T‖` besides: one equation more than unknowns; without it `r_T = 0`, κ = 0 would solve the rest whatever u_T. With mu r_N, which (80) hints at,
//! it follows from the rest wherever r_N > 0, and where r_N = 0 nothing asks for it.
//!
//! References: Acary2018 (78)–(80).
//! Cost: as many entries as W has, twice for the tangential rows. Unknowns: D + 1 a contact.
//! Fails: σ has no derivative at r_T = 0, where the slope of ‖·‖ is read as 0; the Jacobian is singular at open contacts, see [the page of the family](super).

use nonsmooth_linalg::small;
use nonsmooth_problem::field::{Binary, Graph, Id, Node, Unary};

use super::{Formulation, LIMIT, Law, Slot, affine};

/// `κ r_T + mu r_N u_T = 0`, `0 ≤ κ ⟂ mu r_N − ‖r_T‖ ≥ 0`.
#[derive(Debug, Clone, Copy, Default)]
pub struct First;

impl<const D: usize> Formulation<D> for First {
    const NAME: &'static str = "ncp";
    const SUMMARY: &'static str = "contact to MCP: Coulomb's law by the speed of sliding, one multiplier a contact; with a root";
    const CITES: &'static [&'static str] = &["Acary2018"];
    const MULTIPLIERS: usize = 1;

    fn state(graph: &mut Graph, slot: &Slot<D>, _: &[[f64; 2]], rows: &mut Vec<Id>) {
        let kappa = graph.variable(slot.kappa(0));
        let most = graph.add(Node::Linear(vec![(slot.first, slot.law.mu)]));
        let mut squares = vec![];
        for (k, (terms, constant)) in slot.velocity.iter().enumerate().skip(1) {
            let r = graph.variable(slot.first + k);
            let u = affine(graph, terms.clone(), *constant);
            let turned = graph.binary(Binary::Mul, kappa, r);
            let opposed = graph.binary(Binary::Mul, most, u);
            rows.push(graph.sum(vec![turned, opposed]));
            squares.push(graph.unary(Unary::Square, r));
        }
        // The slope of the root at 0 is left out.
        let square = graph.sum(squares);
        let root = graph.unary(Unary::Sqrt, square);
        let zero = graph.constant(0.0);
        let norm = graph.add(Node::If([square, root, zero]));
        rows.push(graph.binary(Binary::Sub, most, norm));
    }

    /// `κ = ‖u_T‖` where the impulse is on the cone's boundary.
    fn multipliers(law: Law, _: &[[f64; 2]], r: &[f64; D], u: &[f64; D], kappa: &mut [f64]) {
        if small::tangential_norm(r) >= LIMIT * law.mu * r[0] {
            kappa[0] = small::tangential_norm(u);
        }
    }
}

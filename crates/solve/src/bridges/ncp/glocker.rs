//! **Glocker's** formulation of friction as an NCP, with a smooth F.
//!
//! ```text
//! 0 ≤ u_N                          ⟂  r_N ≥ 0
//! u_T + Σ κ_i e_i + 2 κ_D r_T = 0      r_T free
//! 0 ≤ mu r_N − e_iᵀ r_T            ⟂  κ_i ≥ 0,   i = 1, 2, 3,   e_i at the angles π/6, 5π/6, 3π/2
//! 0 ≤ (mu r_N)² − ‖r_T‖²           ⟂  κ_D ≥ 0
//! ```
//!
//! The three half-planes hold the disk, so they change no law; where the disk is the point 0 its own gradient is zero, and their normals carry the sliding of a contact without
//! impulse. A contact that slides has `κ_D = ‖u_T‖ / (2 mu r_N)`; σ_D is stated in units of the usual
//! mu r_N ([`Law::usual`](super::Law::usual)), and κ_D in those of its inverse, because a square says little of contacts with small impulses: an error ε of σ_D is one of ε/(2 mu r_N) of r_T. In the plane the disk is the segment between two half-lines, `e_1 = 1, e_2 = −1`; there is no κ_D, F is affine, and the problem is that of
//! [`FacetOuter`](crate::bridges::FacetOuter) for the methods of nonlinear ones.
//!
//! References: Glocker1999; Acary2018 (81)–(86).
//! Cost: as many entries as W has. Unknowns: 7 a contact in space, 4 in the plane.
//! Fails: the Jacobian is singular at open contacts and at hyperstatic ones that stick, see [the page of the family](super).

use nonsmooth_problem::field::{Binary, Graph, Id, Node, Unary};

use super::{Formulation, LIMIT, Law, Slot};
use crate::bridges::kept::{decompose, dot, tangential};

/// `u_T + Σ κ_i e_i + 2 κ_D r_T = 0`, `0 ≤ κ_j ⟂ σ_j ≥ 0`.
#[derive(Debug, Clone, Copy, Default)]
pub struct Glocker;

impl<const D: usize> Formulation<D> for Glocker {
    const NAME: &'static str = "glocker";
    const SUMMARY: &'static str =
        "contact to MCP: Coulomb's law by Glocker's four saturations a contact, quadratic";
    const CITES: &'static [&'static str] = &["Glocker1999", "Acary2018"];
    const MULTIPLIERS: usize = if D > 2 { 4 } else { 2 };

    fn directions() -> Vec<[f64; 2]> {
        if D == 2 {
            return vec![[1.0, 0.0], [-1.0, 0.0]];
        }
        let (x, y) = (0.75_f64.sqrt(), 0.5);
        vec![[x, y], [-x, y], [0.0, -1.0]]
    }

    fn state(graph: &mut Graph, slot: &Slot<D>, directions: &[[f64; 2]], rows: &mut Vec<Id>) {
        let disk = (D > 2).then(|| graph.variable(slot.kappa(directions.len())));
        let mut squares = vec![];
        for (k, (velocity, constant)) in slot.velocity.iter().enumerate().skip(1) {
            let mut terms = velocity.clone();
            let normals = directions.iter().enumerate().map(|(i, e)| (slot.kappa(i), e[k - 1]));
            terms.extend(normals.filter(|(_, e)| *e != 0.0));
            let linear = graph.add(Node::Linear(terms));
            let constant = graph.constant(*constant);
            let mut all = vec![linear, constant];
            if let Some(kappa) = disk {
                let r = graph.variable(slot.first + k);
                let twice = graph.add(Node::Linear(vec![(slot.first + k, 2.0 / slot.law.usual)]));
                all.push(graph.binary(Binary::Mul, kappa, twice));
                squares.push(graph.unary(Unary::Square, r));
            }
            rows.push(graph.sum(all));
        }
        for e in directions {
            let against = (1..D).map(|k| (slot.first + k, -e[k - 1])).filter(|(_, e)| *e != 0.0);
            let terms = std::iter::once((slot.first, slot.law.mu)).chain(against).collect();
            rows.push(graph.add(Node::Linear(terms)));
        }
        if D > 2 {
            let most = graph.add(Node::Linear(vec![(slot.first, slot.law.mu)]));
            let most = graph.unary(Unary::Square, most);
            let square = graph.sum(squares);
            let saturation = graph.binary(Binary::Sub, most, square);
            let per_unit = graph.constant(1.0 / slot.law.usual);
            rows.push(graph.binary(Binary::Mul, per_unit, saturation));
        }
    }

    /// κ_D that opposes u_T along an impulse on the boundary of the disk; where that is a point, or in the plane, the κ_i of the neighbours of −u_T.
    fn multipliers(
        law: Law,
        directions: &[[f64; 2]],
        r: &[f64; D],
        u: &[f64; D],
        kappa: &mut [f64],
    ) {
        let (r_t, u_t) = (tangential(r), tangential(u));
        let (most, square) = (law.mu * r[0], dot(r_t, r_t));
        if square < (LIMIT * most).powi(2) {
            return;
        }
        match kappa.get_mut(directions.len()) {
            Some(disk) if square > 0.0 => {
                *disk = (-law.usual * dot(u_t, r_t) / (2.0 * square)).max(0.0)
            }
            _ => decompose(directions, u_t.map(|u| -u), |i, a| kappa[i] = a),
        }
    }
}

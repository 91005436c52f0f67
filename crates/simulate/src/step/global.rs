//! The problem of an island with its bodies, `M v = H r`, `u = Hᵀ v + q`, of which W = Hᵀ M⁻¹ H is never formed.
//!
//! Where many contacts share few bodies (walls, polyhedra, piles of boxes) W has a block for each pair of contacts of a body, while Newton's matrices of the global form have
//! six rows a body: they take a third to a tenth of the time. Of spheres, three contacts a body, W is as soon solved.

use nonsmooth_linalg::Csc;
use nonsmooth_problem::FrictionGlobal;

use super::are_finite;
use super::couple::Sided;
use super::problem::Parts;
use crate::crew::Slot;

/// Fewer contacts are solved as soon by W.
const LEAST: usize = 128;
/// More than this many rows of contacts for a component of velocity are solved sooner with the bodies: in space, some five contacts a body.
const ROWS: f64 = 2.4;

impl Parts<'_> {
    /// Whether island k is to be solved with its bodies: W has as many blocks as that is worth, and is Hᵀ M⁻¹ H.
    pub(super) fn is_global<const D: usize, S: Sided<D>>(&self, k: usize, slot: &Slot<D>) -> bool {
        let contacts = self.touching.island(k).len();
        let components = S::COMPONENTS * self.touching.members(k);
        contacts >= LEAST
            && (D * contacts) as f64 > ROWS * components as f64
            && slot.symmetric
            && self.has_contacts_alone(k, slot)
    }

    /// States it so; whether all is finite.
    #[allow(non_snake_case)]
    pub(super) fn state_global<const D: usize, S: Sided<D>>(
        &self,
        k: usize,
        slot: &mut Slot<D>,
        sides: &[[S; 2]],
    ) -> bool {
        let places = self.touching.island(k);
        let n = S::COMPONENTS * self.touching.members(k);
        let entries = 2 * S::COMPONENTS * D * places.len();
        let mut pointers = Vec::with_capacity(D * places.len() + 1);
        let (mut rows, mut values) = (Vec::with_capacity(entries), Vec::with_capacity(entries));
        pointers.push(0);
        let mut body_of = vec![0; self.touching.members(k)];
        for (place, sides) in places.zip(sides) {
            let arms = &self.rows[self.touching.order[place] as usize].arms;
            let [one, other] = self.touching.members_at(place);
            let mut members = [one.zip(Some(0)), other.zip(Some(1))];
            members.sort_unstable();
            for (number, side) in members.into_iter().flatten() {
                body_of[number] = arms[side].body as usize;
            }
            for i in 0..D {
                for (number, side) in members.into_iter().flatten() {
                    rows.extend((0..S::COMPONENTS).map(|c| S::COMPONENTS * number + c));
                    values.extend(sides[side].columns().map(|(row, _)| row[i]));
                }
                pointers.push(rows.len());
            }
        }
        let finite = are_finite(values.iter().copied());
        let masses = body_of.iter().enumerate().flat_map(|(number, &b)| {
            let at = S::COMPONENTS * number;
            S::masses(&self.bodies[b]).map(move |(i, j, m)| (at + i, at + j, m))
        });
        let M = Csc::from_triplets(n, n, masses).expect("in range");
        let H = Csc::from_vecs(n, slot.problem.q.len(), pointers, rows, values).expect("sorted");
        let (f, w) = (vec![0.0; n], slot.problem.q.clone());
        let mu = slot.problem.mu.clone();
        slot.global = Some(FrictionGlobal { M, H, f, w, mu, mu_r: (), rows: None });
        slot.leave_rows_out();
        finite
    }
}

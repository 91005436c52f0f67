//! Elastic boxes as linear systems.

use nonsmooth_linalg::Csc;
use nonsmooth_scenes::vec3::{Vec3, cross, dot, norm, scale, sub};
use nonsmooth_scenes::{ElasticBox, SceneError};

use super::{LinearContact, LinearSystem};
use crate::Law;

impl LinearSystem<3> {
    /// An elastic box under `gravity`: q are the displacements of its nodes, three each, in the order of its nodes; damping is Rayleigh's. Held nodes do not move.
    ///
    /// Errors: those of assembly, never of a valid box.
    pub fn elastic(solid: &ElasticBox, gravity: Vec3) -> Result<Self, SceneError> {
        let mass = solid.mass_matrix()?;
        let mut load = vec![0.0; solid.dofs()];
        let weight: Vec<f64> = (0..solid.dofs()).map(|i| gravity[i % 3]).collect();
        mass.mul_add(1.0, &weight, &mut load);
        let held = |i: usize| solid.held[i / 3];
        (0..load.len()).filter(|&i| held(i)).for_each(|i| load[i] = 0.0);
        let n = solid.dofs();
        let free = |a: &Csc| {
            let entries = a.triplets().filter(|&(i, j, _)| i == j || !(held(i) || held(j)));
            Csc::from_triplets(n, n, entries)
        };
        let (mass, stiffness) = (free(&mass)?, free(&solid.stiffness_matrix()?)?);
        let (alpha, beta) = (solid.material.alpha, solid.material.beta);
        let damped = mass.triplets().map(|(i, j, x)| (i, j, alpha * x));
        let all = damped.chain(stiffness.triplets().map(|(i, j, x)| (i, j, beta * x)));
        let damping = Csc::from_triplets(n, n, all.collect::<Vec<_>>().into_iter())?;
        Ok(Self { damping, load, ..Self::new(mass, stiffness) })
    }

    /// The same with a contact between the half space `normal · x ≤ offset` and each node of the box that is not held and lies within `reach` of it.
    #[must_use]
    pub fn against_plane(
        mut self,
        solid: &ElasticBox,
        (normal, offset): (Vec3, f64),
        reach: f64,
        law: Law,
    ) -> Self {
        let n = scale(1.0 / norm(normal), normal);
        let least = (0..3).min_by(|&a, &b| n[a].abs().total_cmp(&n[b].abs())).unwrap_or(0);
        let mut axis = [0.0; 3];
        axis[least] = 1.0;
        let tangent = sub(axis, scale(n[least], n));
        let tangent = scale(1.0 / norm(tangent), tangent);
        let frame = [n, tangent, cross(n, tangent)];
        for (node, place) in solid.places().enumerate() {
            let gap = dot(n, place) - offset / norm(normal);
            if gap > reach || solid.held[node] {
                continue;
            }
            let directions = frame.map(|d| (0..3).map(|k| (3 * node + k, d[k])).collect());
            self.contacts.push(LinearContact { gap, directions, law });
        }
        self
    }
}

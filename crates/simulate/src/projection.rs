//! Direct projection onto contacts and joints together: after a step the smallest displacement in the norm of the masses,
//!
//! ```text
//! min ½ ‖Δ‖²_M   s.t.   φ(q ⊕ Δ) = 0,   g^α(q ⊕ Δ) ≥ 0   for all contacts that are near,
//! ```
//!
//! by Newton's method: each iterate is a frictionless problem `0 ≤ H_NᵀΔ + g ⟂ ν ≥ 0`, `GᵀΔ = 0`, `M Δ = H_N ν + G κ`, which the contact solver of the steps
//! solves; then the joints are closed. Configurations move, velocities do not. Limits of joints count as contacts; contacts that give way are left to their springs.
//!
//! Combined projection: a contact that pushes here but was open in the problem of velocities would be approached and pushed back again and again. It is taken into the
//! index set and the step is tried anew, until no more come.
//!
//! Reference: Acary2013. Cost: a detection and a frictionless problem an iteration, two as a rule; the combined one also a step for each time the index set grows.
//! Fails (a status) where contacts and joints contradict each other, or where normals change so much that iterates do not contract.

use crate::crew::Inner;
use crate::detect::Key;
use crate::state::State;
use crate::step::Tools;
use crate::{SimulateError, World};

/// Contacts that penetrate by less than this share of the smaller body, and limits violated by less, are closed.
const TOLERANCE: f64 = 1e-10;
const ITERATIONS: usize = 20;

/// The projection of a world with its memory.
pub(crate) struct Projection {
    rest: World,
    tools: Tools,
}

/// What it came to.
#[derive(Default)]
pub(crate) struct Projected {
    /// Whether no gap and no limit is violated.
    pub closed: bool,
    /// Whether anything had to be moved.
    pub moved: bool,
    /// The contacts that pushed.
    pub pushed: Vec<Key>,
}

impl Projection {
    pub fn new(world: &World, state: &State, threads: usize) -> Result<Self, SimulateError> {
        let rest = world.at_rest();
        let mut tools = Tools::new(&rest, state)?;
        tools.set_threads(threads);
        Ok(Self { rest, tools })
    }

    /// Moves the bodies of `world` out of each other.
    pub fn project(
        &mut self,
        world: &World,
        state: &mut State,
        inner: &Inner,
    ) -> Result<Projected, SimulateError> {
        let mut found = Projected::default();
        for iteration in 0..=ITERATIONS {
            let pairs = self.tools.overlaps(&self.rest, state, TOLERANCE);
            let depth = pairs.iter().map(|pair| pair.2).fold(0.0, f64::max);
            found.closed =
                pairs.is_empty() && self.tools.joints.overshoot(world, state) <= TOLERANCE;
            if found.closed || iteration == ITERATIONS {
                break;
            }
            found.moved = true;
            if !self.tools.part(&self.rest, state, depth, inner)? {
                break;
            }
            let pushing = self.tools.contacts.iter().filter(|c| c.impulse[0] > 0.0);
            found.pushed.extend(pushing.map(|c| c.key));
            self.tools.joints.project(world, state);
        }
        Ok(found)
    }
}

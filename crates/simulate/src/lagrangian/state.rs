//! What a Lagrangian simulation knows at a time.

use serde::{Deserialize, Serialize};

use super::Size;

/// Time, coordinates, velocities, and what is remembered of the last step. All that the next step depends on.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct LagrangianState {
    /// s.
    pub t: f64,
    /// Steps done.
    pub steps: u64,
    /// Coordinates, n.
    pub q: Vec<f64>,
    /// Velocities, n.
    pub v: Vec<f64>,
    /// What is remembered of the last step.
    pub(super) memory: Memory,
}

/// Impulses of the last step, first guesses of the next one, and which contacts took part.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Memory {
    /// The length of the last step; 0 before the first.
    pub h: f64,
    /// D·nc.
    pub contacts: Vec<f64>,
    /// p, then rows.
    pub scalars: Vec<f64>,
    /// nc, then rows: whether it took part.
    pub active: Vec<bool>,
    /// nc: whether it had an impulse inside its cone.
    pub stuck: Vec<bool>,
}

impl Memory {
    /// Of impulses of contacts and others, and of flags.
    pub fn lengths(&self) -> [usize; 4] {
        [self.contacts.len(), self.scalars.len(), self.active.len(), self.stuck.len()]
    }

    /// What these are after a step of a system of this size, in dimension d.
    pub fn lengths_of(size: Size, d: usize) -> [usize; 4] {
        let Size { contacts, relations, rows, .. } = size;
        [d * contacts, relations + rows, contacts + rows, contacts]
    }
}

/// What a contact did in the last step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LagrangianContact<const D: usize> {
    /// The gap at the beginning of the step.
    pub gap: f64,
    /// Whether the contact took part in the step; else its impulse is zero.
    pub active: bool,
    /// `[r_N, r_T…]`, N·s; the force is r/h unless there was an impact.
    pub impulse: [f64; D],
    /// u before the step; known of active contacts.
    pub before: [f64; D],
    /// u after it.
    pub after: [f64; D],
}

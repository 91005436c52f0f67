//! What a simulation knows at a time.

use nonsmooth_scenes::Rotation;
use nonsmooth_scenes::vec3::{Vec3, apply};
use serde::{Deserialize, Serialize};

use crate::detect::Key;
use crate::periodic::Pair;
use crate::rotation::{Pose, apply_transposed};
use crate::{BodyId, World};

/// Time, configuration, velocities, and what is remembered of contacts. All that the next step depends on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// s.
    pub t: f64,
    /// Steps done.
    pub steps: u64,
    /// Mass centres, m.
    pub position: Vec<Vec3>,
    /// Orientations, as unit quaternions `[w, x, y, z]`.
    pub rotation: Vec<[f64; 4]>,
    /// Velocities of the mass centres, m/s.
    pub velocity: Vec<Vec3>,
    /// Angular velocities Ω in the **body** frame, rad/s; [`State::angular_velocity`] has them in the world frame.
    pub spin: Vec<Vec3>,
    /// What is remembered of contacts.
    pub memory: ContactMemory,
    /// The elastic solids.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub elastic: Vec<ElasticState>,
}

/// An elastic solid at a time, node by node.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ElasticState {
    /// From the places without strain, m.
    pub displacement: Vec<Vec3>,
    /// m/s.
    pub velocity: Vec<Vec3>,
}

impl State {
    /// That of a world before its first step.
    pub(crate) fn of(world: &World) -> Self {
        let bodies = &world.bodies;
        Self {
            t: 0.0,
            steps: 0,
            position: bodies.iter().map(|b| b.position).collect(),
            rotation: bodies.iter().map(|b| b.rotation.0).collect(),
            velocity: bodies.iter().map(|b| b.velocity).collect(),
            spin: bodies
                .iter()
                .map(|b| apply_transposed(&b.rotation.matrix(), b.angular_velocity))
                .collect(),
            memory: ContactMemory::default(),
            elastic: world.elastic.iter().map(|e| e.start()).collect(),
        }
    }

    /// The rotation of a body.
    pub fn rotation(&self, body: BodyId) -> Rotation {
        Rotation(self.rotation[body.index()])
    }

    /// The angular velocity of a body in the world frame, rad/s.
    pub fn angular_velocity(&self, body: BodyId) -> Vec3 {
        apply(&self.rotation(body).matrix(), self.spin[body.index()])
    }

    /// Sets it.
    pub fn set_angular_velocity(&mut self, body: BodyId, omega: Vec3) {
        self.spin[body.index()] = apply_transposed(&self.rotation(body).matrix(), omega);
    }

    pub(crate) fn pose(&self, body: usize) -> Pose {
        Pose { x: self.position[body], r: Rotation(self.rotation[body]).matrix() }
    }
}

/// What is remembered from step to step: impulses by key, for warm starts; frames and separating axes, which change only for a reason.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ContactMemory {
    /// The contacts of the last step, by key.
    pub(crate) contacts: Vec<Remembered>,
    /// The separating axis of each pair of polyhedra that was near, by pair of shapes.
    pub(crate) axes: Vec<(Pair, Axis)>,
    /// The step that the impulses are of, s.
    pub(crate) h: f64,
    /// The angle of each joint, which goes on beyond a full turn.
    #[serde(default)]
    pub(crate) angles: Vec<f64>,
    /// The impulses of scalar rows, by joint and row.
    #[serde(default)]
    pub(crate) impulses: Vec<((u32, u32), f64)>,
}

impl ContactMemory {
    /// What an impulse of the last step is worth in one of length h.
    pub(crate) fn scaled(&self, h: f64) -> f64 {
        if self.h > 0.0 { h / self.h } else { 0.0 }
    }

    /// How deep two shapes may be in each other, m; zero where they were not near in the last step.
    pub(crate) fn depth(&self, pair: (u32, u32)) -> f64 {
        let first = self.contacts.partition_point(|m| m.key.pair() < pair);
        let same = self.contacts[first..].iter().take_while(|m| m.key.pair() == pair);
        same.fold(0.0, |most, m| most.max(m.depth))
    }

    /// Notes which contacts the projection pushed.
    pub(crate) fn note_pushed(&mut self, pushed: &[Key]) {
        for key in pushed {
            if let Ok(k) = self.contacts.binary_search_by_key(key, |m| m.key) {
                self.contacts[k].pushed = true;
            }
        }
    }

    /// The impulse of a scalar row in the last step.
    pub(crate) fn impulse(&self, key: (u32, u32)) -> f64 {
        let place = self.impulses.binary_search_by_key(&key, |e| e.0);
        place.map_or(0.0, |k| self.impulses[k].1)
    }
}

/// One contact of the last step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Remembered {
    pub key: Key,
    /// In the world frame, N·s, on b.
    pub impulse: Vec3,
    /// Of rolling friction, N·m·s, on b.
    #[serde(default)]
    pub moment: Vec3,
    pub normal: Vec3,
    pub point: Vec3,
    /// The axis of the world that the first tangent is nearest to.
    pub axis: u8,
    /// Whether it took part in the step.
    pub active: bool,
    pub stuck: bool,
    /// Whether rolling friction held it.
    #[serde(default)]
    pub unrolled: bool,
    /// How deep the bodies may be there after the step, m: what they could come nearer, less the gap before.
    #[serde(default)]
    pub depth: f64,
    /// Whether the projection behind the step pushed it.
    #[serde(default)]
    pub pushed: bool,
}

/// The kind of separating axis of two polyhedra.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Axis {
    /// The normal of a face of the first.
    FaceA(u32),
    /// The normal of a face of the second.
    FaceB(u32),
    /// Across two edges.
    Edges(u32, u32),
}

/// Velocities that are all below this, m/s or rad/s, are rest. Squares of what is off in them by rounding, of which errors are made, would be no normal numbers.
const STILL: f64 = 1e-100;

/// Whether these velocities are rest.
pub(crate) fn is_rest(v: &[f64]) -> bool {
    v.iter().all(|x| x.abs() < STILL)
}

/// A velocity, or rest.
pub(crate) fn or_rest(v: Vec3) -> Vec3 {
    if is_rest(&v) { [0.0; 3] } else { v }
}

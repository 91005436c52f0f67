//! What contacts remember from step to step: impulses to begin with, normals where bodies are deep inside each other, axes of frames.

use nonsmooth_scenes::vec3::{Vec3, dot, norm, sub};

use super::contact::Row;
use crate::detect::Near;
use crate::report::ContactReport;
use crate::rolling;
use crate::state::Remembered;

/// For each point near what is remembered of it, the axis of the tangents, and the velocity of the gap; for each contact remembered whether it was recalled.
#[derive(Default)]
pub(super) struct Met {
    pub known: Vec<Option<Remembered>>,
    pub taken: Vec<bool>,
    pub axes: Vec<u8>,
    pub approach: Vec<f64>,
}

/// For each contact near what is remembered of it: by its key, else the nearest of the same two shapes with nearly the same normal. Where bodies are deep inside each
/// other the normal is that remembered. `taken` is for each that is remembered, at first false.
pub(super) fn recall(
    memory: &[Remembered],
    near: &mut [Near],
    known: &mut [Option<Remembered>],
    taken: &mut [bool],
) {
    let mut m = 0;
    for (near, known) in near.iter().zip(&mut *known) {
        while m < memory.len() && memory[m].key < near.key {
            m += 1;
        }
        let same = m < memory.len() && memory[m].key == near.key;
        if same {
            taken[m] = true;
        }
        *known = same.then(|| memory[m]);
    }
    for (near, known) in near.iter().zip(&mut *known).filter(|n| n.1.is_none()) {
        if let Some(k) = nearest(near, memory, taken) {
            taken[k] = true;
            *known = Some(memory[k]);
        }
    }
    for (near, known) in near.iter_mut().zip(known).filter(|n| n.0.deep) {
        if let Some(m) = known.filter(|m| m.key == near.key) {
            near.place.normal = m.normal;
        }
    }
}

/// The contact of the same two shapes that is nearest, of those not taken.
fn nearest(near: &Near, memory: &[Remembered], taken: &[bool]) -> Option<usize> {
    let first = memory.partition_point(|m| m.key.pair() < near.key.pair());
    let same = memory[first..].iter().take_while(|m| m.key.pair() == near.key.pair());
    let mut best = (0.05 * near.size, None);
    for (k, m) in (first..).zip(same) {
        let far = norm(sub(m.point, near.place.point));
        if !taken[k] && far < best.0 && dot(m.normal, near.place.normal) > 0.95 {
            best = (far, Some(k));
        }
    }
    best.1
}

impl Remembered {
    /// The impulse along the directions of a frame, `scaled`, within the cone.
    pub(super) fn impulse_along(&self, frame: &[Vec3; 3], scaled: f64, mu: f64) -> [f64; 3] {
        clipped(frame.map(|d| scaled * dot(d, self.impulse)), mu)
    }

    /// The moment about the tangents, `scaled`, within what the normal impulse allows.
    pub(super) fn moment_along(
        &self,
        frame: &[Vec3; 3],
        scaled: f64,
        (mu_r, normal): (f64, f64),
    ) -> [f64; 2] {
        rolling::clipped([1, 2].map(|i| scaled * dot(frame[i], self.moment)), mu_r, normal)
    }

    /// Of a contact after a step, in which the bodies could come nearer to each other by `prediction`.
    pub(super) fn of(
        near: &Near,
        (axis, prediction): (u8, f64),
        row: Option<&Row>,
        report: &ContactReport,
    ) -> Self {
        Self {
            key: near.key,
            impulse: report.world_impulse(),
            moment: report.world_moment(),
            normal: near.place.normal,
            point: near.place.point,
            axis,
            active: row.is_some(),
            stuck: row.is_some_and(|row| sticks(row.r[0], [row.r[1], row.r[2]], row.mu)),
            unrolled: row.is_some_and(|row| sticks(row.r[0], row.moment, row.mu_r)),
            depth: (prediction - near.place.gap).max(0.0),
            pushed: false,
        }
    }
}

/// An impulse moved into the cone: none where it pulls, friction cut to its bound.
fn clipped(r: [f64; 3], mu: f64) -> [f64; 3] {
    if r[0] <= 0.0 {
        return [0.0; 3];
    }
    let (tangential, bound) = (r[1].hypot(r[2]), mu * r[0]);
    let cut = if tangential > bound { bound / tangential } else { 1.0 };
    [r[0], cut * r[1], cut * r[2]]
}

/// Whether friction, or the moment of rolling friction, of what pushes lies within its disk, not on the boundary.
fn sticks(normal: f64, [one, two]: [f64; 2], mu: f64) -> bool {
    normal > 0.0 && one.hypot(two) < (1.0 - 1e-6) * mu * normal
}

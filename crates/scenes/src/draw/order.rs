//! The painter's order of convex solids.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::camera::Camera;
use super::paper::Colour;
use crate::polyhedron::Polyhedron;
use crate::vec3::{Vec3, add, cross, dot, mean, norm, normalise, scale, sub};

/// A convex solid in the world frame.
pub(super) enum Solid {
    /// A polyhedron with the planes of its faces.
    Convex { polyhedron: Polyhedron, planes: Vec<(Vec3, f64)>, colour: Colour },
    /// A ball.
    Ball { centre: Vec3, radius: f64, colour: Colour },
}

impl Solid {
    pub fn convex(polyhedron: Polyhedron, colour: Colour) -> Self {
        let planes = (0..polyhedron.faces().len()).map(|k| polyhedron.plane(k)).collect();
        Self::Convex { polyhedron, planes, colour }
    }

    pub fn centre(&self) -> Vec3 {
        match self {
            Solid::Convex { polyhedron, .. } => mean(polyhedron.vertices()),
            Solid::Ball { centre, .. } => *centre,
        }
    }

    /// The least and the largest `n · x` over the solid.
    pub fn extent(&self, n: Vec3) -> (f64, f64) {
        match self {
            Solid::Convex { polyhedron, .. } => polyhedron
                .vertices()
                .iter()
                .map(|&v| dot(n, v))
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x))),
            Solid::Ball { centre, radius, .. } => {
                let (x, r) = (dot(n, *centre), radius * norm(n));
                (x - r, x + r)
            }
        }
    }

    /// Points whose convex hull holds the solid: what must fit the picture.
    pub fn hull(&self) -> Vec<Vec3> {
        match self {
            Solid::Convex { polyhedron, .. } => polyhedron.vertices().to_vec(),
            Solid::Ball { centre, radius, .. } => (0..8)
                .map(|k| [k & 1, k >> 1 & 1, k >> 2].map(|bit| radius * (2.0 * bit as f64 - 1.0)))
                .map(|d| add(*centre, d))
                .collect(),
        }
    }

    /// Points whose shadows along `light` outline the shadow of the solid.
    pub fn silhouette(&self, light: Vec3) -> Vec<Vec3> {
        match self {
            Solid::Convex { polyhedron, .. } => polyhedron.vertices().to_vec(),
            Solid::Ball { centre, radius, .. } => {
                // The circle across the light.
                let axis = if light[0].abs() < 0.9 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
                let a = normalise(cross(light, axis));
                let b = cross(light, a);
                (0..32)
                    .map(|k| (std::f64::consts::TAU * f64::from(k) / 32.0).sin_cos())
                    .map(|(s, c)| add(*centre, scale(*radius, add(scale(c, a), scale(s, b)))))
                    .collect()
            }
        }
    }

    /// Whether `other` must be painted after this solid: `Some(false)` the reverse, `None` either.
    ///
    /// Beyond any plane that separates the two, the one on the eye's side hides and is not hidden.
    fn before(&self, other: &Self, eye: Vec3, tolerance: f64) -> Option<bool> {
        let splits = |inner: &Self, outer: &Self| {
            let beyond = |&(n, d): &(Vec3, f64)| {
                (outer.extent(n).0 >= d - tolerance).then(|| dot(n, eye) > d)
            };
            match inner {
                Solid::Convex { planes, .. } => planes.iter().find_map(beyond),
                Solid::Ball { centre, .. } => {
                    let n = normalise(sub(outer.centre(), *centre));
                    beyond(&(n, inner.extent(n).1))
                }
            }
        };
        splits(self, other).or_else(|| splits(other, self).map(|hides| !hides))
    }
}

/// The solids from the farthest to the nearest.
///
/// A topological order of "is hidden by" among the solids whose frames overlap in the picture, by distance where
/// that leaves a choice, and across a cycle (possible in principle, not met in piles).
pub(super) fn paint_order(solids: &[Solid], camera: &Camera) -> Vec<usize> {
    let n = solids.len();
    let frames: Vec<_> = solids.iter().map(|s| frame(s, camera)).collect();
    let mut by_left: Vec<usize> = (0..n).collect();
    by_left.sort_by(|&i, &j| frames[i].0[0].total_cmp(&frames[j].0[0]));
    let mut after: Vec<Vec<usize>> = vec![Vec::new(); n];
    let mut waits = vec![0usize; n];
    for (k, &i) in by_left.iter().enumerate() {
        let (low, high) = frames[i];
        for &j in by_left[k + 1..].iter().take_while(|&&j| frames[j].0[0] <= high[0]) {
            if frames[j].0[1] > high[1] || frames[j].1[1] < low[1] {
                continue;
            }
            let tolerance = 1e-6 * norm(sub(solids[i].centre(), solids[j].centre()));
            if let Some(before) = solids[i].before(&solids[j], camera.eye, tolerance) {
                let (first, then) = if before { (i, j) } else { (j, i) };
                after[first].push(then);
                waits[then] += 1;
            }
        }
    }
    // Distances are positive, so that their bits are ordered as they are.
    let far = |i: usize| (norm(sub(solids[i].centre(), camera.eye)).to_bits(), Reverse(i));
    let mut ready: BinaryHeap<_> = (0..n).filter(|&i| waits[i] == 0).map(far).collect();
    let mut done = vec![false; n];
    let mut order = Vec::with_capacity(n);
    while order.len() < n {
        let next = match ready.pop() {
            Some((_, Reverse(i))) => i,
            // A cycle: its farthest solid goes first.
            None => (0..n).filter(|&i| !done[i]).max_by_key(|&i| far(i)).expect("some are left"),
        };
        if std::mem::replace(&mut done[next], true) {
            continue;
        }
        order.push(next);
        for &j in &after[next] {
            waits[j] -= 1;
            if waits[j] == 0 {
                ready.push(far(j));
            }
        }
    }
    order
}

/// The corners of a frame around the solid in the picture, never too small.
fn frame(solid: &Solid, camera: &Camera) -> ([f64; 2], [f64; 2]) {
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for p in solid.hull() {
        let at = camera.project(p);
        for k in 0..2 {
            low[k] = low[k].min(at[k]);
            high[k] = high[k].max(at[k]);
        }
    }
    (low, high)
}

//! Frames `[N, T1, T2]` of contacts that turn with them and with nothing else.

use nonsmooth_scenes::vec3::{Vec3, add, cross, dot, norm, scale, sub};

use crate::Dimension;

/// In place of an axis: the first tangent lies in the plane of a world that is one.
pub(super) const IN_PLANE: u8 = 3;

/// The axis of the world whose part across the normal makes the first tangent: that of the last step unless it has come near the normal.
pub(super) fn tangent_axis(n: Vec3, last: Option<u8>, dimension: Dimension) -> u8 {
    const NEAR: f64 = 0.9;
    if dimension == Dimension::Two {
        return IN_PLANE;
    }
    if let Some(axis) = last.filter(|&axis| axis < IN_PLANE)
        && n[axis as usize].abs() <= NEAR
    {
        return axis;
    }
    let least = |a: u8, b: u8| if n[b as usize].abs() < n[a as usize].abs() { b } else { a };
    least(least(0, 1), 2)
}

/// `[N, T1, T2]`, right-handed.
pub(super) fn frame(n: Vec3, axis: u8) -> [Vec3; 3] {
    if axis == IN_PLANE {
        return [n, [-n[1], n[0], 0.0], [0.0, 0.0, 1.0]];
    }
    let mut e = [0.0; 3];
    e[axis as usize] = 1.0;
    let t = sub(e, scale(n[axis as usize], n));
    let t = scale(1.0 / norm(t), t);
    [n, t, cross(n, t)]
}

/// The frame turned so that its normal becomes n, on the shortest way: what a frame built anew would turn about the normal would turn friction with it.
pub(super) fn transported(frame: &[Vec3; 3], n: Vec3) -> [Vec3; 3] {
    let sum = add(frame[0], n);
    let tangent = |t: Vec3| sub(t, scale(dot(n, t) / (1.0 + dot(frame[0], n)), sum));
    [n, tangent(frame[1]), tangent(frame[2])]
}

/// The largest distance between vectors of two frames, or of arms along them.
pub(super) fn apart(p: &[Vec3; 3], q: &[Vec3; 3]) -> f64 {
    let square = |i: usize| {
        let d = sub(p[i], q[i]);
        dot(d, d)
    };
    (0..3).map(square).fold(0.0, f64::max).sqrt()
}

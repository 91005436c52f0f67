//! Rotations and 3×3 matrices beyond what scenes need.
//!
//! The Cayley map `cay(a) = (I − ½ â)⁻¹ (I + ½ â)` is a rotation by `2 atan(‖a‖/2)` about a. As a quaternion it is `(1, a/2)/√(1 + ‖a‖²/4)`: neither a
//! sine nor a case near zero.

use nonsmooth_scenes::Rotation;
use nonsmooth_scenes::vec3::{Mat3, Vec3, cross, dot, scale};

/// `cay(a)`.
pub fn cayley(a: Vec3) -> Rotation {
    let s = 1.0 / (1.0 + 0.25 * dot(a, a)).sqrt();
    let [x, y, z] = scale(0.5 * s, a);
    Rotation([s, x, y, z])
}

/// The same rotation with a quaternion of length one.
pub fn unit(q: Rotation) -> Rotation {
    let length = q.0.iter().map(|x| x * x).sum::<f64>().sqrt();
    Rotation(q.0.map(|x| x / length))
}

/// `Aᵀ x`.
#[inline]
pub(crate) fn apply_transposed(a: &Mat3, x: Vec3) -> Vec3 {
    std::array::from_fn(|k| a[0][k] * x[0] + a[1][k] * x[1] + a[2][k] * x[2])
}

/// `A B`.
pub(crate) fn product(a: &Mat3, b: &Mat3) -> Mat3 {
    a.map(|row| std::array::from_fn(|j| row[0] * b[0][j] + row[1] * b[1][j] + row[2] * b[2][j]))
}

/// `A⁻¹`, by cofactors.
pub(crate) fn inverse(a: &Mat3) -> Mat3 {
    let c = [cross(a[1], a[2]), cross(a[2], a[0]), cross(a[0], a[1])];
    let d = 1.0 / dot(a[0], c[0]);
    std::array::from_fn(|i| std::array::from_fn(|j| d * c[j][i]))
}

/// `â`, with `â x = a × x`.
pub(crate) fn hat(a: Vec3) -> Mat3 {
    [[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]]
}

/// A position and an orientation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pose {
    pub x: Vec3,
    pub r: Mat3,
}

impl Pose {
    /// Unturned, at x.
    pub fn at(x: Vec3) -> Self {
        Self { x, r: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] }
    }

    #[inline]
    pub fn point(&self, p: Vec3) -> Vec3 {
        let q = self.direction(p);
        [self.x[0] + q[0], self.x[1] + q[1], self.x[2] + q[2]]
    }

    #[inline]
    pub fn direction(&self, d: Vec3) -> Vec3 {
        self.r.map(|row| row[0] * d[0] + row[1] * d[1] + row[2] * d[2])
    }

    #[inline]
    pub fn local_point(&self, p: Vec3) -> Vec3 {
        apply_transposed(&self.r, [p[0] - self.x[0], p[1] - self.x[1], p[2] - self.x[2]])
    }

    #[inline]
    pub fn local_direction(&self, d: Vec3) -> Vec3 {
        apply_transposed(&self.r, d)
    }

    /// `self` with a frame that stands at `inner` in it.
    pub fn then(&self, inner: &Pose) -> Pose {
        Pose { x: self.point(inner.x), r: product(&self.r, &inner.r) }
    }
}

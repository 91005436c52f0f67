//! Vectors and 3×3 matrices of space, as arrays.

/// A vector of space.
pub type Vec3 = [f64; 3];
/// A 3×3 matrix by rows.
pub type Mat3 = [[f64; 3]; 3];

pub(crate) const X: Vec3 = [1.0, 0.0, 0.0];
pub(crate) const Y: Vec3 = [0.0, 1.0, 0.0];
pub(crate) const Z: Vec3 = [0.0, 0.0, 1.0];

/// `a · b`.
#[inline]
pub fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `a × b`.
#[inline]
pub fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `a + b`.
#[inline]
pub fn add(a: Vec3, b: Vec3) -> Vec3 {
    std::array::from_fn(|k| a[k] + b[k])
}

/// `a − b`.
#[inline]
pub fn sub(a: Vec3, b: Vec3) -> Vec3 {
    std::array::from_fn(|k| a[k] - b[k])
}

/// `s a`.
#[inline]
pub fn scale(s: f64, a: Vec3) -> Vec3 {
    a.map(|x| s * x)
}

/// `‖a‖`.
#[inline]
pub fn norm(a: Vec3) -> f64 {
    dot(a, a).sqrt()
}

/// `a/‖a‖`; components that are not finite where a is zero.
#[inline]
pub fn normalise(a: Vec3) -> Vec3 {
    scale(1.0 / norm(a), a)
}

/// `A x`.
#[inline]
pub fn apply(a: &Mat3, x: Vec3) -> Vec3 {
    a.map(|row| dot(row, x))
}

/// `A B Aᵀ`.
pub fn congruence(a: &Mat3, b: &Mat3) -> Mat3 {
    let ab: Mat3 = a.map(|row| std::array::from_fn(|j| (0..3).map(|k| row[k] * b[k][j]).sum()));
    ab.map(|row| std::array::from_fn(|j| dot(row, a[j])))
}

/// The mean of some points, which must not be empty.
pub fn mean(points: &[Vec3]) -> Vec3 {
    scale(1.0 / points.len() as f64, points.iter().fold([0.0; 3], |s, &p| add(s, p)))
}

/// The four corners `centre ± a ± b`, in order around the rectangle.
pub(crate) fn rectangle(centre: Vec3, a: Vec3, b: Vec3) -> [Vec3; 4] {
    [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
        .map(|(s, t)| add(centre, add(scale(s, a), scale(t, b))))
}

/// `points` × `points` points spread evenly over the rectangle `centre ± a ± b`: its corners for 2, its centre for 1.
pub(crate) fn grid(centre: Vec3, a: Vec3, b: Vec3, points: usize) -> Vec<Vec3> {
    let at = |k: usize| match points {
        1 => 0.0,
        _ => 2.0 * k as f64 / (points - 1) as f64 - 1.0,
    };
    (0..points * points)
        .map(|k| add(centre, add(scale(at(k % points), a), scale(at(k / points), b))))
        .collect()
}

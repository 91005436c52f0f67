//! Convex polygons: the shapes of worlds in the plane.

use nonsmooth_scenes::MassProperties;
use nonsmooth_scenes::vec3::{Vec3, cross, sub};

use crate::SimulateError;
use crate::error::{finite, require};

/// Corners on the line between their neighbours, up to this share of the size, are left out.
const STRAIGHT: f64 = 1e-12;

/// A convex polygon in the plane of the first two axes, corners counterclockwise.
#[derive(Debug, Clone, PartialEq)]
pub struct Polygon {
    vertices: Vec<[f64; 2]>,
}

impl Polygon {
    /// Of its corners, m, counterclockwise. Corners on straight sides are left out. Cost: the square of their number.
    ///
    /// Errors: fewer than three corners, coordinates that are not finite, corners that are not those of a convex polygon in this order.
    pub fn new(corners: &[[f64; 2]]) -> Result<Self, SimulateError> {
        for (k, corner) in corners.iter().enumerate() {
            finite(|| format!("vertices[{k}]"), corner)?;
        }
        let size = corners.iter().map(|p| apart(corners[0], *p)).fold(0.0, f64::max);
        let mut vertices = corners.to_vec();
        let mut k = 0;
        while vertices.len() > 2 && k < vertices.len() {
            let n = vertices.len();
            let [p, q, r] = [k + n - 1, k, k + 1].map(|i| vertices[i % n]);
            let chord = apart(p, r).max(f64::MIN_POSITIVE);
            let forwards = along(p, q, r) > 0.0 || apart(p, q).min(apart(q, r)) == 0.0;
            if turn(p, q, r).abs() <= STRAIGHT * size * chord && forwards {
                vertices.remove(k);
            } else {
                k += 1;
            }
        }
        let n = vertices.len();
        if n < 3 {
            let expected = "at least three corners that are not on a line";
            return Err(SimulateError::value("vertices", expected, n));
        }
        // All corners to the left of every side: left turns alone may go round twice.
        for k in 0..n {
            let (p, q) = (vertices[k], vertices[(k + 1) % n]);
            let wrong = |r: &[f64; 2]| *r != p && *r != q && turn(p, q, *r) <= 0.0;
            if let Some(r) = vertices.iter().find(|r| wrong(r)) {
                let expected = "the corners of a convex polygon, counterclockwise";
                let found = format!("{r:?} to the right of the side from {p:?} to {q:?}");
                return Err(SimulateError::value("vertices", expected, found));
            }
        }
        Ok(Self { vertices })
    }

    /// The convex hull of points, m, by Andrew's chain. Cost: O(n log n), and the square of the number of corners.
    ///
    /// Errors: those of [`new`](Self::new).
    pub fn hull(points: &[[f64; 2]]) -> Result<Self, SimulateError> {
        for (k, point) in points.iter().enumerate() {
            finite(|| format!("vertices[{k}]"), point)?;
        }
        let mut sorted = points.to_vec();
        sorted.sort_by(|p, q| p[0].total_cmp(&q[0]).then(p[1].total_cmp(&q[1])));
        sorted.dedup();
        let mut corners: Vec<[f64; 2]> = vec![];
        // Below from left to right, then above back; each chain ends where the other begins.
        let backwards: Vec<_> = sorted.iter().rev().copied().collect();
        for chain in [sorted, backwards] {
            let first = corners.len();
            for p in chain {
                while let [.., a, b] = corners[first..] {
                    if turn(a, b, p) > 0.0 {
                        break;
                    }
                    corners.pop();
                }
                corners.push(p);
            }
            corners.pop();
        }
        Self::new(&corners)
    }

    /// A rectangle about the origin with these half sides, m.
    ///
    /// Errors: a half side that is not positive.
    pub fn rectangle([a, b]: [f64; 2]) -> Result<Self, SimulateError> {
        for x in [a, b] {
            require(|| "half".into(), x, x > 0.0, "a positive number")?;
        }
        Self::new(&[[-a, -b], [a, -b], [a, b], [-a, b]])
    }

    /// The corners, counterclockwise, m.
    pub fn vertices(&self) -> &[[f64; 2]] {
        &self.vertices
    }

    /// The corners as points of space.
    pub(crate) fn points(&self) -> impl Iterator<Item = Vec3> + '_ {
        self.vertices.iter().map(|&[x, y]| [x, y, 0.0])
    }

    /// Mass, mass centre and inertia about it for a density in kg/m²: by triangles about the first corner,
    /// `∫ x xᵀ = A/12 (p pᵀ + q qᵀ + (p + q)(p + q)ᵀ)` of that with sides p and q.
    pub(crate) fn mass_properties(&self, density: f64) -> MassProperties {
        let [x0, y0] = self.vertices[0];
        let (mut area, mut first, mut second) = (0.0, [0.0; 2], [[0.0; 2]; 2]);
        for pair in self.vertices[1..].windows(2) {
            let [p, q] = [pair[0], pair[1]].map(|[x, y]| [x - x0, y - y0]);
            let a = 0.5 * (p[0] * q[1] - p[1] * q[0]);
            area += a;
            for i in 0..2 {
                first[i] += a / 3.0 * (p[i] + q[i]);
                for j in 0..2 {
                    let both = (p[i] + q[i]) * (p[j] + q[j]);
                    second[i][j] += a / 12.0 * (p[i] * p[j] + q[i] * q[j] + both);
                }
            }
        }
        let [x, y] = first.map(|s| s / area);
        let about = |i: usize, j: usize, c: [f64; 2]| density * (second[i][j] - area * c[i] * c[j]);
        let of = |i: usize, j: usize| about(i, j, [x, y]);
        lamina(density * area, [x0 + x, y0 + y], [of(0, 0), of(0, 1), of(1, 1)])
    }
}

/// A thin sheet in the plane, of its mass, its mass centre and its moments `∫ x x`, `∫ x y`, `∫ y y` about that.
pub(crate) fn lamina(mass: f64, [x, y]: [f64; 2], [xx, xy, yy]: [f64; 3]) -> MassProperties {
    MassProperties {
        mass,
        centre: [x, y, 0.0],
        inertia: [[yy, -xy, 0.0], [-xy, xx, 0.0], [0.0, 0.0, xx + yy]],
    }
}

fn apart(p: [f64; 2], q: [f64; 2]) -> f64 {
    (q[0] - p[0]).hypot(q[1] - p[1])
}

/// Positive where r lies to the left of the line from p to q.
fn turn(p: [f64; 2], q: [f64; 2], r: [f64; 2]) -> f64 {
    let lift = |[x, y]: [f64; 2]| [x, y, 0.0];
    cross(sub(lift(q), lift(p)), sub(lift(r), lift(p)))[2]
}

/// Positive where the way from p over q to r does not turn back.
fn along(p: [f64; 2], q: [f64; 2], r: [f64; 2]) -> f64 {
    (q[0] - p[0]) * (r[0] - q[0]) + (q[1] - p[1]) * (r[1] - q[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn masses_of_polygons_are_those_of_closed_forms() {
        // A rectangle off the origin, with a corner on a side.
        let corners = [[1.0, 2.0], [3.0, 2.0], [5.0, 2.0], [5.0, 3.0], [1.0, 3.0]];
        let polygon = Polygon::new(&corners).unwrap();
        assert_eq!(polygon.vertices().len(), 4);
        let p = polygon.mass_properties(3.0);
        assert!((p.mass - 12.0).abs() < 1e-13, "{p:?}");
        assert!((p.centre[0] - 3.0).abs() < 1e-13 && (p.centre[1] - 2.5).abs() < 1e-13, "{p:?}");
        let (xx, yy) = (12.0 * 16.0 / 12.0, 12.0 / 12.0);
        assert!((p.inertia[0][0] - yy).abs() < 1e-12 && (p.inertia[1][1] - xx).abs() < 1e-12);
        assert!((p.inertia[2][2] - xx - yy).abs() < 1e-12 && p.inertia[0][1].abs() < 1e-12);
        // A right triangle: ∫ x y about the mass centre is −A a b / 36.
        let t = Polygon::new(&[[0.0, 0.0], [2.0, 0.0], [0.0, 3.0]]).unwrap().mass_properties(1.0);
        assert!((t.inertia[0][1] - 3.0 * 6.0 / 36.0).abs() < 1e-13, "{t:?}");
    }

    #[test]
    fn what_is_no_convex_polygon_is_refused() {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let mut clockwise = square;
        clockwise.reverse();
        let star: Vec<[f64; 2]> = (0..5)
            .map(|k| {
                let angle = f64::from(2 * k) * std::f64::consts::TAU / 5.0;
                [angle.cos(), angle.sin()]
            })
            .collect();
        let dent = [[0.0, 0.0], [2.0, 0.0], [1.0, 0.5], [2.0, 2.0]];
        let back = [[0.0, 0.0], [2.0, 0.0], [1.0, 0.0]];
        for wrong in [&clockwise[..], &star, &dent, &back, &square[..2], &[]] {
            let said = Polygon::new(wrong).unwrap_err().to_string();
            assert!(said.starts_with("vertices: expected"), "{said}");
        }
        assert!(Polygon::new(&[[f64::NAN, 0.0], [1.0, 0.0], [0.0, 1.0]]).is_err());
    }
}

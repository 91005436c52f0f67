//! Convex polyhedra: faces for drawing, exact mass properties for dynamics.

use std::collections::{BTreeMap, BTreeSet};

use crate::SceneError;
use crate::error::positive;
use crate::vec3::{Mat3, Vec3, add, cross, dot, mean, norm, rectangle, scale, sub};

/// A convex polyhedron by its vertices and its faces, each counter-clockwise seen from outside.
#[derive(Debug, Clone, PartialEq)]
pub struct Polyhedron {
    vertices: Vec<Vec3>,
    faces: Vec<Vec<usize>>,
}

/// Mass, mass centre and inertia of a homogeneous solid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassProperties {
    /// Mass, kg.
    pub mass: f64,
    /// Mass centre, m.
    pub centre: Vec3,
    /// Inertia about the mass centre, in the axes of the vertices, kg·m².
    pub inertia: Mat3,
}

impl MassProperties {
    /// Those of the solid inside a closed surface of triangles, counter-clockwise from outside, for a density in kg/m³, exact; a volume of zero makes them NaN.
    ///
    /// The solid is the signed union of the tetrahedra between `inner`, best a point in the middle, and the triangles;
    /// over one with corners 0, a, b, c and volume V, with s = a + b + c:
    /// `∫x = V s/4` and `∫x xᵀ = V/20 (a aᵀ + b bᵀ + c cᵀ + s sᵀ)`.
    pub fn inside(triangles: impl Iterator<Item = [Vec3; 3]>, inner: Vec3, density: f64) -> Self {
        let (mut volume, mut first, mut second) = (0.0, [0.0; 3], [[0.0; 3]; 3]);
        for triangle in triangles {
            let [a, b, c] = triangle.map(|p| sub(p, inner));
            let v = dot(a, cross(b, c)) / 6.0;
            let s = add(a, add(b, c));
            volume += v;
            first = add(first, scale(v / 4.0, s));
            for k in 0..3 {
                for l in 0..3 {
                    second[k][l] +=
                        v / 20.0 * (a[k] * a[l] + b[k] * b[l] + c[k] * c[l] + s[k] * s[l]);
                }
            }
        }
        let centre = scale(1.0 / volume, first);
        for k in 0..3 {
            for l in 0..3 {
                second[k][l] -= volume * centre[k] * centre[l];
            }
        }
        let trace = second[0][0] + second[1][1] + second[2][2];
        let mut inertia = second.map(|row| scale(-density, row));
        for k in 0..3 {
            inertia[k][k] += density * trace;
        }
        Self { mass: density * volume, centre: add(inner, centre), inertia }
    }

    /// Those of some solids, at least one, taken as one body.
    pub fn joined(parts: &[Self]) -> Self {
        let mass = parts.iter().map(|p| p.mass).sum();
        let first = parts.iter().fold([0.0; 3], |s, p| add(s, scale(p.mass, p.centre)));
        let centre = scale(1.0 / mass, first);
        let mut inertia = [[0.0; 3]; 3];
        for part in parts {
            // Steiner: J + m (|d|² I − d dᵀ).
            let d = sub(part.centre, centre);
            for k in 0..3 {
                inertia[k][k] += part.mass * dot(d, d);
                for l in 0..3 {
                    inertia[k][l] += part.inertia[k][l] - part.mass * d[k] * d[l];
                }
            }
        }
        Self { mass, centre, inertia }
    }
}

impl Polyhedron {
    /// Checks that the faces bound a convex solid.
    ///
    /// Errors: fewer than 4 faces, a face with fewer than 3 vertices or a vertex that does not exist, coordinates
    /// that are not finite, a vertex in front of a face (not convex, or a face seen from inside), no volume.
    pub fn new(vertices: Vec<Vec3>, faces: Vec<Vec<usize>>) -> Result<Self, SceneError> {
        if let Some(k) = vertices.iter().position(|v| v.iter().any(|x| !x.is_finite())) {
            let found = format!("{:?}", vertices[k]);
            return Err(SceneError::value(format!("vertices[{k}]"), "finite coordinates", found));
        }
        let bad = |f: &Vec<usize>| f.len() < 3 || f.iter().any(|&k| k >= vertices.len());
        if faces.len() < 4 || faces.iter().any(bad) {
            let expected = "at least 4 faces, each of at least 3 of the vertices";
            return Err(SceneError::value("faces", expected, format!("{faces:?}")));
        }
        let out = Self { vertices, faces };
        let size = out.radius_about(mean(&out.vertices));
        for k in 0..out.faces.len() {
            let (normal, offset) = out.plane(k);
            let front = out.vertices.iter().map(|&v| dot(normal, v) - offset).fold(0.0, f64::max);
            // A face without area has no normal.
            if front > 1e-9 * size || normal.iter().any(|x| x.is_nan()) {
                let expected = "a face of a convex solid, counter-clockwise from outside";
                return Err(SceneError::value(format!("faces[{k}]"), expected, "another"));
            }
        }
        let volume = out.mass_properties(1.0).mass;
        if volume.is_nan() || volume <= 1e-12 * size.powi(3) {
            return Err(SceneError::value("vertices", "a solid with a volume", volume));
        }
        Ok(out)
    }

    /// A solid whose faces are known to bound it; some may be so small that rounding hides their planes.
    pub(crate) fn trusted(vertices: Vec<Vec3>, faces: Vec<Vec<usize>>) -> Self {
        Self { vertices, faces }
    }

    /// The convex hull of points, its faces triangles; points within 1e-10 of the size of what others span are left out. Points are added one by one, each in place of
    /// the faces that it sees: O(n f) for n points and a hull of f faces.
    ///
    /// Errors: coordinates that are not finite; points of a plane; those of [`Polyhedron::new`], where points lie so that rounding hides which are outside.
    pub fn hull(points: &[Vec3]) -> Result<Self, SceneError> {
        if let Some(k) = points.iter().position(|v| v.iter().any(|x| !x.is_finite())) {
            let found = format!("{:?}", points[k]);
            return Err(SceneError::value(format!("vertices[{k}]"), "finite coordinates", found));
        }
        let flat = || {
            let found = format!("{} in a plane", points.len());
            SceneError::value("vertices", "points that span a solid", found)
        };
        // A large simplex to begin with: each corner the farthest point from what the corners before it span.
        let far = |distance: &dyn Fn(Vec3) -> f64| {
            let distances = points.iter().map(|&p| distance(p)).enumerate();
            distances.fold((0, 0.0), |best, d| if d.1 > best.1 { d } else { best })
        };
        let Some(&first) = points.first() else { return Err(flat()) };
        let (a, _) = far(&|p| norm(sub(p, first)));
        let (b, size) = far(&|p| norm(sub(p, points[a])));
        let slack = 1e-10 * size;
        let along = sub(points[b], points[a]);
        let (c, width) = far(&|p| norm(cross(sub(p, points[a]), along)) / size);
        let normal = cross(along, sub(points[c], points[a]));
        let (d, height) = far(&|p| (dot(normal, sub(p, points[a])) / norm(normal)).abs());
        if !(width > slack && height > slack) {
            return Err(flat());
        }
        let front = |[a, b, c]: [usize; 3], p: Vec3| {
            let n = cross(sub(points[b], points[a]), sub(points[c], points[a]));
            dot(n, sub(p, points[a])) / norm(n)
        };
        let (b, c) = if front([a, b, c], points[d]) > 0.0 { (c, b) } else { (b, c) };
        let mut faces = vec![[a, b, c], [a, c, d], [c, b, d], [b, a, d]];
        for (k, &p) in points.iter().enumerate() {
            let (seen, kept): (Vec<_>, Vec<_>) =
                faces.iter().partition(|&&face| front(face, p) > slack);
            let edges = |&[a, b, c]: &[usize; 3]| [(a, b), (b, c), (c, a)];
            let around: BTreeSet<_> = seen.iter().flat_map(edges).collect();
            faces = kept;
            // What it sees ends at edges whose other side it does not see.
            let rim = around.iter().filter(|(a, b)| !around.contains(&(*b, *a)));
            faces.extend(rim.map(|&(a, b)| [a, b, k]));
        }
        let corners: BTreeSet<usize> = faces.iter().flatten().copied().collect();
        let number: BTreeMap<usize, usize> =
            corners.iter().enumerate().map(|(new, &old)| (old, new)).collect();
        let faces = faces.iter().map(|face| face.iter().map(|k| number[k]).collect()).collect();
        Self::new(corners.iter().map(|&k| points[k]).collect(), faces)
    }

    /// The plane convex polygon `base` (either sense) extruded by `along`, for example a voussoir.
    ///
    /// Errors: those of [`Polyhedron::new`].
    pub fn prism(base: &[Vec3], along: Vec3) -> Result<Self, SceneError> {
        let n = base.len();
        let top = base.iter().map(|&p| add(p, along));
        let vertices: Vec<Vec3> = base.iter().copied().chain(top).collect();
        let mut faces = vec![(0..n).rev().collect::<Vec<_>>(), (n..2 * n).collect()];
        faces.extend((0..n).map(|k| vec![k, (k + 1) % n, (k + 1) % n + n, k + n]));
        // The faces above suit a base that turns counter-clockwise about `along`.
        let turning = (1..n.max(2) - 1)
            .fold([0.0; 3], |s, k| add(s, cross(sub(base[k], base[0]), sub(base[k + 1], base[0]))));
        if dot(turning, along) < 0.0 {
            faces.iter_mut().for_each(|f| f.reverse());
        }
        Self::new(vertices, faces)
    }

    /// The box of half sides `half` about the origin.
    ///
    /// Errors: a half side that is not positive.
    pub fn cuboid(half: Vec3) -> Result<Self, SceneError> {
        // Two negative sides would make the box of their sizes, which nobody has asked for.
        for (k, &side) in half.iter().enumerate() {
            positive(&format!("half[{k}]"), side)?;
        }
        let [a, b, c] = half;
        let base = rectangle([0.0, 0.0, -c], [a, 0.0, 0.0], [0.0, b, 0.0]);
        Self::prism(&base, [0.0, 0.0, 2.0 * c])
    }

    /// The box of sides along the axes between two opposite corners.
    ///
    /// Errors: a side without length.
    pub(crate) fn between(low: Vec3, high: Vec3) -> Result<Self, SceneError> {
        let centre = scale(0.5, add(low, high));
        Ok(Self::cuboid(scale(0.5, sub(high, low)))?.mapped(|v| add(centre, v)))
    }

    /// The vertices, m.
    pub fn vertices(&self) -> &[Vec3] {
        &self.vertices
    }

    /// The faces, by indices of vertices, counter-clockwise seen from outside.
    pub fn faces(&self) -> &[Vec<usize>] {
        &self.faces
    }

    /// The same solid with every vertex mapped by `f`, a rigid motion.
    pub fn mapped(&self, f: impl Fn(Vec3) -> Vec3) -> Self {
        let vertices = self.vertices.iter().map(|&v| f(v)).collect();
        Self { vertices, faces: self.faces.clone() }
    }

    /// The unit outward normal `n` and offset `d` of the plane `n · x = d` of face `k`.
    pub fn plane(&self, k: usize) -> (Vec3, f64) {
        let p = |i: usize| self.vertices[self.faces[k][i]];
        let sum = (1..self.faces[k].len() - 1)
            .fold([0.0; 3], |s, i| add(s, cross(sub(p(i), p(0)), sub(p(i + 1), p(0)))));
        let normal = scale(1.0 / norm(sum), sum);
        (normal, dot(normal, p(0)))
    }

    /// The largest distance of a vertex from `point`, m.
    pub fn radius_about(&self, point: Vec3) -> f64 {
        self.vertices.iter().map(|&v| norm(sub(v, point))).fold(0.0, f64::max)
    }

    /// Mass, mass centre and inertia for a density in kg/m³, exact.
    pub fn mass_properties(&self, density: f64) -> MassProperties {
        // About an inner point, so that a solid far from the origin loses no digits.
        let fan = |face: &'_ Vec<usize>| -> Vec<[Vec3; 3]> {
            let p = |i: usize| self.vertices[face[i]];
            (1..face.len() - 1).map(|i| [p(0), p(i), p(i + 1)]).collect()
        };
        MassProperties::inside(self.faces.iter().flat_map(fan), mean(&self.vertices), density)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_has_positive_sides() {
        for half in [[-1.0, 1.0, 1.0], [-1.0, -1.0, 1.0], [0.0, 1.0, 1.0], [f64::NAN, 1.0, 1.0]] {
            let error = Polyhedron::cuboid(half).unwrap_err().to_string();
            assert!(error.starts_with("half[0]: expected a positive number"), "{error}");
        }
    }

    #[test]
    fn a_hull_is_what_its_points_span() {
        // A grid in a box, most points on its faces or inside.
        let half = [0.5, 0.2, 1.1];
        let knots = (0..5 * 5 * 5).map(|k| [k % 5, k / 5 % 5, k / 25]);
        let grid: Vec<Vec3> = knots
            .map(|k| std::array::from_fn(|i| half[i] * (0.5 * f64::from(k[i]) - 1.0)))
            .collect();
        let hull = Polyhedron::hull(&grid).unwrap();
        let exact = 8.0 * half[0] * half[1] * half[2];
        assert!((hull.mass_properties(1.0).mass - exact).abs() < 1e-14);
        // Points on a ball are all corners, and inside of nothing.
        let ball: Vec<Vec3> = (0..200)
            .map(|k| {
                let (z, angle) = (-0.995 + 0.01 * f64::from(k), 2.4 * f64::from(k));
                let r = (1.0_f64 - z * z).sqrt();
                [r * angle.cos(), r * angle.sin(), z]
            })
            .collect();
        let hull = Polyhedron::hull(&ball).unwrap();
        assert_eq!((hull.vertices().len(), hull.faces().len()), (200, 2 * 200 - 4));
        let volume = hull.mass_properties(1.0).mass;
        assert!(volume < 4.19 && volume > 4.0, "{volume}");
        let flat: Vec<Vec3> = grid.iter().map(|p| [p[0], p[1], 0.5]).collect();
        let error = Polyhedron::hull(&flat).unwrap_err().to_string();
        assert!(error.contains("points that span a solid, found 125 in a plane"), "{error}");
        assert!(Polyhedron::hull(&[]).is_err() && Polyhedron::hull(&[[1.0; 3]; 9]).is_err());
    }

    #[test]
    fn inertia_of_a_box_has_its_closed_form_anywhere() {
        let half = [0.5, 0.2, 1.1];
        let at = [30.0, -4.0, 7.0];
        let p = Polyhedron::cuboid(half).unwrap().mapped(|v| add(v, at)).mass_properties(700.0);
        let mass = 700.0 * 8.0 * half[0] * half[1] * half[2];
        assert!((p.mass - mass).abs() < 1e-11 * mass);
        assert!(norm(sub(p.centre, at)) < 1e-12);
        for k in 0..3 {
            for l in 0..3 {
                let (a, b) = (half[(k + 1) % 3], half[(k + 2) % 3]);
                let exact = if k == l { mass * (a * a + b * b) / 3.0 } else { 0.0 };
                assert!((p.inertia[k][l] - exact).abs() < 1e-11 * mass, "{k} {l}");
            }
        }
    }

    #[test]
    fn inertia_of_a_tetrahedron_has_its_closed_form() {
        // Corners 0, x, y, z: V = 1/6, centre (1, 1, 1)/4, ∫x² = V/10, ∫xy = V/20.
        let vertices = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let faces = vec![vec![0, 2, 1], vec![0, 1, 3], vec![0, 3, 2], vec![1, 2, 3]];
        let p = Polyhedron::new(vertices, faces).unwrap().mass_properties(6.0);
        assert!((p.mass - 1.0).abs() < 1e-15 && p.centre.iter().all(|x| (x - 0.25).abs() < 1e-15));
        let (xx, xy) = (1.0 / 10.0 - 1.0 / 16.0, 1.0 / 20.0 - 1.0 / 16.0);
        for k in 0..3 {
            for l in 0..3 {
                let exact = if k == l { 2.0 * xx } else { -xy };
                assert!((p.inertia[k][l] - exact).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn what_is_no_convex_solid_is_refused() {
        let base = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let good = Polyhedron::prism(&base, [0.0, 0.0, 1.0]).unwrap();
        let turned: Vec<_> = base.iter().rev().copied().collect();
        assert_eq!(Polyhedron::prism(&turned, [0.0, 0.0, 1.0]).unwrap().faces().len(), 6);
        let mut faces = good.faces().to_vec();
        faces[2].reverse();
        let e = Polyhedron::new(good.vertices().to_vec(), faces).unwrap_err().to_string();
        assert!(e.starts_with("faces[2]: expected a face of a convex solid"), "{e}");
        assert!(Polyhedron::prism(&base, [1.0, 0.0, 0.0]).is_err());
        let mut faces = good.faces().to_vec();
        faces[2] = vec![0, 1, 1];
        assert!(Polyhedron::new(good.vertices().to_vec(), faces).is_err());
        assert!(Polyhedron::prism(&base[..2], [0.0, 0.0, 1.0]).is_err());
        assert!(Polyhedron::cuboid([1.0, 0.0, 1.0]).is_err());
    }
}

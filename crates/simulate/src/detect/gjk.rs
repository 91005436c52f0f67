//! Distance of two convex sets that are known by their support points.
//!
//! `min ‖q − p‖, p ∈ A, q ∈ B`: the point v of the difference `B − A` nearest to the origin. Each iterate adds the point of the difference that is lowest
//! along v to a simplex and takes the point of the simplex nearest to the origin, found among all of its at most 15 faces.
//!
//! Reference: GilbertJohnsonKeerthi1988. Cost: an iterate is two support points and at most 15 systems of order 3; polytopes need few, curved sets some ten.
//! Fails (`None`) where the sets overlap or touch.

use nonsmooth_scenes::vec3::{Vec3, add, cross, dot, norm, scale, sub};

/// The gap between lower and upper bound of the square of the distance at which an answer is taken, relative.
const CLOSE: f64 = 1e-14;
/// What is nearer than this share of the size touches.
const TOUCH: f64 = 1e-12;
/// Faces of the simplex with a smaller square of the sine are flat: another face has their nearest point.
const FLAT: f64 = 1e-20;
const ITERATIONS: usize = 100;

/// Where two sets are nearest to each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Closest {
    pub distance: f64,
    /// Of length 1, from the first set to the second.
    pub normal: Vec3,
    /// On the first and on the second set.
    pub on: [Vec3; 2],
}

/// A point of the difference with the points of the two sets that it comes from.
type Vertex = (Vec3, [Vec3; 2]);

/// At most four vertices, with the weights of a point between them.
#[derive(Debug, Clone, Copy)]
struct Simplex {
    vertices: [Vertex; 4],
    weights: [f64; 4],
    count: usize,
}

/// The closest points of two sets, none where they overlap or touch. `size` is a length of theirs, `start` any direction.
pub(crate) fn closest(
    a: impl Fn(Vec3) -> Vec3,
    b: impl Fn(Vec3) -> Vec3,
    start: Vec3,
    size: f64,
) -> Option<Closest> {
    let support = |v: Vec3| -> Vertex {
        let (p, q) = (a(v), b(scale(-1.0, v)));
        (sub(q, p), [p, q])
    };
    let first = support(start);
    let mut simplex = Simplex { vertices: [first; 4], weights: [1.0, 0.0, 0.0, 0.0], count: 1 };
    let mut v = first.0;
    for _ in 0..ITERATIONS {
        let square = dot(v, v);
        if square <= (TOUCH * size) * (TOUCH * size) {
            return None;
        }
        let new = support(v);
        let known = simplex.vertices[..simplex.count].iter().any(|w| w.0 == new.0);
        if known || square - dot(v, new.0) <= CLOSE * square {
            break;
        }
        simplex.vertices[simplex.count] = new;
        simplex.count += 1;
        let (next, nearest) = simplex.reduced();
        if next.count == 4 {
            return None;
        }
        // Rounding may keep it from coming nearer: then it is as near as it will be.
        if next.count == 0 || dot(nearest, nearest) >= square {
            simplex.count -= 1;
            break;
        }
        (simplex, v) = (next, nearest);
    }
    let distance = norm(v);
    let mixed = |side: usize| {
        let weighted = simplex.vertices.iter().zip(simplex.weights).take(simplex.count);
        weighted.fold([0.0; 3], |s, (w, x)| add(s, scale(x, w.1[side])))
    };
    Some(Closest { distance, normal: scale(1.0 / distance, v), on: [mixed(0), mixed(1)] })
}

impl Simplex {
    /// The face that carries the point nearest to the origin, and that point.
    fn reduced(&self) -> (Self, Vec3) {
        let mut best = (f64::INFINITY, Self { count: 0, ..*self }, [0.0; 3]);
        for subset in 1_usize..1 << self.count {
            let mut face = Self { count: 0, ..*self };
            for k in (0..self.count).filter(|k| subset >> k & 1 == 1) {
                face.vertices[face.count] = self.vertices[k];
                face.count += 1;
            }
            let Some(point) = face.nearest() else { continue };
            let square = if face.count == 4 { 0.0 } else { dot(point, point) };
            if square < best.0 {
                best = (square, face, point);
            }
        }
        (best.1, best.2)
    }

    /// The point nearest to the origin of the plane through all vertices, where it lies between them; its weights are kept.
    fn nearest(&mut self) -> Option<Vec3> {
        let origin = self.vertices[0].0;
        let edge = |k: usize| sub(self.vertices[k].0, origin);
        let o = scale(-1.0, origin);
        let mut rest = [0.0; 3];
        match self.count {
            1 => {}
            2 => {
                let e = edge(1);
                rest[0] = dot(e, o) / dot(e, e);
            }
            3 => {
                let (e, f) = (edge(1), edge(2));
                // By products across: squares would lose half of the digits of thin triangles.
                let n = cross(e, f);
                let d = dot(n, n);
                if d <= FLAT * dot(e, e) * dot(f, f) {
                    return None;
                }
                (rest[0], rest[1]) = (dot(cross(o, f), n) / d, dot(cross(e, o), n) / d);
            }
            _ => {
                let (e, f, g) = (edge(1), edge(2), edge(3));
                let d = dot(e, cross(f, g));
                if d * d <= FLAT * dot(e, e) * dot(f, f) * dot(g, g) {
                    return None;
                }
                rest = [dot(o, cross(f, g)) / d, dot(o, cross(g, e)) / d, dot(o, cross(e, f)) / d];
            }
        }
        self.weights = [1.0 - rest.iter().sum::<f64>(), rest[0], rest[1], rest[2]];
        // A quotient of zeros is no weight.
        if !self.weights[..self.count].iter().all(|x| *x > 0.0) {
            return None;
        }
        let weighted = self.vertices.iter().zip(self.weights).take(self.count);
        Some(weighted.fold([0.0; 3], |s, (w, x)| add(s, scale(x, w.0))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::turned::Turned;
    use crate::rotation::Pose;
    use nonsmooth_scenes::Rotation;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn the_distance_of_a_disc_and_a_line_is_exact_to_rounding() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(4);
        let mut worst: f64 = 0.0;
        for _ in 0..500 {
            let mut vector =
                |most: f64| -> Vec3 { std::array::from_fn(|_| rng.random_range(-most..most)) };
            let pose = Pose { x: [0.0; 3], r: Rotation::about(vector(1.0), 1.3).matrix() };
            let cone = Turned::new(&pose, 0.5, [0.4, 0.0]);
            let p = add([1.2, 0.0, 0.0], vector(0.3));
            let q = add(p, vector(0.6));
            let end = |d: Vec3| if dot(d, p) > dot(d, q) { p } else { q };
            let Some(found) = closest(|d| cone.support(d), end, [1.0, 0.0, 0.0], 0.5) else {
                continue;
            };
            // What separates along the normal is a lower bound, what lies between the points an upper one.
            let n = found.normal;
            let low = dot(n, sub(end(scale(-1.0, n)), cone.support(n)));
            worst = worst.max(found.distance - low);
            let between = norm(sub(found.on[1], found.on[0]));
            assert!((between - found.distance).abs() < 1e-12);
        }
        assert!(worst < 1e-9, "{worst}");
    }
}

//! Surfaces of solids as polygons, for what knows nothing else.

use std::f64::consts::PI;

use super::playback::{Drawn, Form};
use crate::vec3::{Vec3, add, apply};

/// Meridians of what is round.
const MERIDIANS: usize = 16;

/// Faces about vertices, counter-clockwise seen from outside.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// m.
    pub vertices: Vec<Vec3>,
    /// By indices of vertices.
    pub faces: Vec<Vec<usize>>,
    /// Whether it stands for one that is round, so that its edges are to be shaded away.
    pub smooth: bool,
}

impl Drawn {
    /// The surfaces of its parts in the frame of the body; round ones with 16 meridians and 8 or 9 parallels, of a plane a square sheet with sides of `sheet`.
    pub fn surfaces(&self, sheet: f64) -> Vec<Surface> {
        let of = |part: &super::playback::Placed| {
            let mut surface = part.form.surface(sheet);
            let turn = part.rotation.matrix();
            for v in &mut surface.vertices {
                *v = add(part.position, apply(&turn, *v));
            }
            surface
        };
        self.parts.iter().map(of).collect()
    }
}

impl Form {
    fn surface(&self, sheet: f64) -> Surface {
        match self {
            Form::Sphere { radius } => round(*radius, 0.0),
            Form::Capsule { half_length, radius } => round(*radius, *half_length),
            Form::Box { half: [x, y, z] } => {
                let vertex = |k: usize| {
                    let sign = |bit: usize| if k >> bit & 1 == 0 { -1.0 } else { 1.0 };
                    [x * sign(0), y * sign(1), z * sign(2)]
                };
                let faces = [
                    [0, 4, 6, 2],
                    [1, 3, 7, 5],
                    [0, 1, 5, 4],
                    [2, 6, 7, 3],
                    [0, 2, 3, 1],
                    [4, 5, 7, 6],
                ];
                let faces = faces.map(|face| face.to_vec()).to_vec();
                Surface { vertices: (0..8).map(vertex).collect(), faces, smooth: false }
            }
            Form::Plane => {
                let s = 0.5 * sheet;
                let vertices = vec![[-s, -s, 0.0], [s, -s, 0.0], [s, s, 0.0], [-s, s, 0.0]];
                Surface { vertices, faces: vec![vec![0, 1, 2, 3]], smooth: false }
            }
            Form::Cylinder { half_length, radius } => turned(*half_length, *radius, *radius),
            Form::Cone { half_length, radius } => turned(*half_length, *radius, 0.0),
            Form::Polyhedron { vertices, faces } | Form::Mesh { vertices, faces } => {
                Surface { vertices: vertices.clone(), faces: faces.clone(), smooth: false }
            }
        }
    }
}

/// A cylinder, or a cone where the upper radius is zero, with flat ends.
fn turned(half_length: f64, lower: f64, upper: f64) -> Surface {
    let ring = |z: f64, radius: f64| {
        (0..MERIDIANS).map(move |k| {
            let (s, c) = (2.0 * PI * k as f64 / MERIDIANS as f64).sin_cos();
            [radius * c, radius * s, z]
        })
    };
    let mut vertices: Vec<Vec3> = ring(-half_length, lower).collect();
    let mut faces = vec![(0..MERIDIANS).rev().collect::<Vec<_>>()];
    let next = |k: usize| (k + 1) % MERIDIANS;
    if upper > 0.0 {
        vertices.extend(ring(half_length, upper));
        faces.push((MERIDIANS..2 * MERIDIANS).collect());
        let side = |k: usize| vec![k, next(k), MERIDIANS + next(k), MERIDIANS + k];
        faces.extend((0..MERIDIANS).map(side));
    } else {
        vertices.push([0.0, 0.0, half_length]);
        faces.extend((0..MERIDIANS).map(|k| vec![k, next(k), MERIDIANS]));
    }
    Surface { vertices, faces, smooth: false }
}

/// A ball whose halves are `2 half_length` apart along the third axis.
fn round(radius: f64, half_length: f64) -> Surface {
    // Angles from the pole; the equator twice where the halves are apart.
    let parallels = MERIDIANS / 2;
    let ring = |k: usize| (PI * k as f64 / parallels as f64, k <= parallels / 2);
    let mut rings: Vec<(f64, bool)> = (1..parallels).map(ring).collect();
    if half_length > 0.0 {
        rings.insert(parallels / 2, (0.5 * PI, false));
    }
    let mut vertices = vec![[0.0, 0.0, half_length + radius]];
    for &(angle, above) in &rings {
        let z = radius * angle.cos() + if above { half_length } else { -half_length };
        for k in 0..MERIDIANS {
            let (s, c) = (2.0 * PI * k as f64 / MERIDIANS as f64).sin_cos();
            vertices.push([radius * angle.sin() * c, radius * angle.sin() * s, z]);
        }
    }
    let last = vertices.len();
    vertices.push([0.0, 0.0, -half_length - radius]);
    let mut faces = vec![];
    for k in 0..MERIDIANS {
        let next = (k + 1) % MERIDIANS;
        let at = |ring: usize, k: usize| 1 + ring * MERIDIANS + k;
        faces.push(vec![0, at(0, k), at(0, next)]);
        for r in 0..rings.len() - 1 {
            faces.push(vec![at(r, k), at(r + 1, k), at(r + 1, next), at(r, next)]);
        }
        let r = rings.len() - 1;
        faces.push(vec![at(r, k), last, at(r, next)]);
    }
    Surface { vertices, faces, smooth: true }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vec3::{cross, dot, scale, sub};
    use crate::{Polyhedron, Rotation};

    /// The volume inside, by the divergence theorem: negative if faces look inwards.
    fn volume(s: &Surface) -> f64 {
        let fan = |face: &Vec<usize>| {
            let [o, rest @ ..] = &face[..] else { unreachable!() };
            let triangle = |w: &[usize]| {
                let [a, b, c] = [*o, w[0], w[1]].map(|k| s.vertices[k]);
                dot(a, cross(b, c)) / 6.0
            };
            rest.windows(2).map(triangle).sum::<f64>()
        };
        s.faces.iter().map(fan).sum()
    }

    #[test]
    fn surfaces_are_closed_look_outwards_and_enclose_the_solid() {
        let (r, l) = (0.3, 0.5);
        let cube = Polyhedron::cuboid([0.1, 0.2, 0.3]).unwrap();
        let (vertices, faces) = (cube.vertices().to_vec(), cube.faces().to_vec());
        let forms = [
            (Form::Sphere { radius: r }, 4.0 / 3.0 * PI * r.powi(3), 0.08),
            (Form::Box { half: [0.1, 0.2, 0.3] }, 8.0 * 0.006, 1e-14),
            (Form::Polyhedron { vertices, faces }, 8.0 * 0.006, 1e-14),
            (
                Form::Capsule { half_length: l, radius: r },
                4.0 / 3.0 * PI * r.powi(3) + 2.0 * l * PI * r * r,
                0.08,
            ),
            (Form::Cylinder { half_length: l, radius: r }, 2.0 * l * PI * r * r, 0.08),
            (Form::Cone { half_length: l, radius: r }, 2.0 * l * PI * r * r / 3.0, 0.08),
        ];
        for (form, expected, share) in forms {
            let part = super::super::playback::Placed {
                form,
                position: [1.0, -2.0, 0.5],
                rotation: Rotation::about([1.0, 1.0, 0.0], 0.7),
            };
            let drawn = Drawn { name: String::new(), fixed: false, parts: vec![part] };
            let [surface] = &drawn.surfaces(1.0)[..] else { panic!() };
            let found = volume(surface);
            assert!((found - expected).abs() <= share * expected, "{found} {expected}");
            // Each edge once in either direction.
            let mut edges: Vec<(usize, usize)> = vec![];
            for face in &surface.faces {
                for (k, &from) in face.iter().enumerate() {
                    edges.push((from, face[(k + 1) % face.len()]));
                }
            }
            for &(from, to) in &edges {
                assert_eq!(edges.iter().filter(|e| **e == (to, from)).count(), 1);
            }
            let sum = surface.vertices.iter().fold([0.0; 3], |s, v| add(s, *v));
            let middle = scale(1.0 / surface.vertices.len() as f64, sum);
            let part = &drawn.parts[0];
            let symmetric = !matches!(part.form, Form::Cone { .. });
            assert!(!symmetric || dot(sub(middle, part.position), [1.0; 3]).abs() < 1e-12);
        }
    }
}

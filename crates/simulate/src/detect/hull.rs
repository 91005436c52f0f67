//! Convex polyhedra as detection needs them: whole faces, edges with the faces beside them.

use std::collections::BTreeMap;

use nonsmooth_scenes::Polyhedron;
use nonsmooth_scenes::vec3::{Vec3, add, cross, dot, norm, scale, sub};

use crate::rotation::Pose;

/// Vertices nearer to each other than this share of the size are one.
const WELD: f64 = 1e-10;
/// Faces whose unit normals differ by less than this are parts of one face.
const COPLANAR: f64 = 1e-9;
/// Corners that are higher than the lowest one by less than this share of the size are as low.
const LOWEST: f64 = 1e-9;

/// An edge: its ends, and the faces on both sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Edge {
    pub ends: [u32; 2],
    pub faces: [u32; 2],
}

/// A convex polyhedron in the frame of its body.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Hull {
    pub vertices: Vec<Vec3>,
    /// Loops of vertices, counter-clockwise from outside.
    pub faces: Vec<Vec<u32>>,
    /// For each face the edges that begin at its vertices.
    pub face_edges: Vec<Vec<u32>>,
    pub normals: Vec<Vec3>,
    pub edges: Vec<Edge>,
    pub centre: Vec3,
    /// The largest distance of a vertex from the centre.
    pub size: f64,
}

impl Hull {
    /// Of a polyhedron that stands at `pose` in the frame of its body; coplanar faces are joined, slivers left out.
    pub fn new(polyhedron: &Polyhedron, pose: &Pose) -> Self {
        let given: Vec<Vec3> = polyhedron.vertices().iter().map(|&v| pose.point(v)).collect();
        let centre =
            scale(1.0 / given.len() as f64, given.iter().fold([0.0; 3], |s, &v| add(s, v)));
        let size = given.iter().map(|&v| norm(sub(v, centre))).fold(0.0, f64::max);
        let mut vertices: Vec<Vec3> = vec![];
        let index: Vec<u32> = given
            .iter()
            .map(|&v| {
                let known = vertices.iter().position(|&p| norm(sub(p, v)) <= WELD * size);
                known.unwrap_or_else(|| {
                    vertices.push(v);
                    vertices.len() - 1
                }) as u32
            })
            .collect();
        let at = |k: u32| vertices[k as usize];
        let mut loops = vec![];
        for face in polyhedron.faces() {
            let mut corners: Vec<u32> = face.iter().map(|&k| index[k]).collect();
            corners.dedup();
            while corners.len() > 1 && corners[0] == corners[corners.len() - 1] {
                corners.pop();
            }
            if corners.len() < 3 {
                continue;
            }
            let (area, first) = (area(&corners, at), at(corners[0]));
            let length = corners.iter().map(|&k| norm(sub(at(k), first))).fold(0.0, f64::max);
            // A small face that is no sliver may be all that separates two bodies.
            if norm(area) > WELD * size * length {
                loops.push((corners, area));
            }
        }
        let faces = join(loops, at);
        let normals = faces
            .iter()
            .map(|f| {
                let n = area(f, at);
                scale(1.0 / norm(n), n)
            })
            .collect();
        let mut sides: BTreeMap<(u32, u32), Vec<u32>> = BTreeMap::new();
        for (f, corners) in faces.iter().enumerate() {
            for (i, j) in around(corners) {
                sides.entry((i.min(j), i.max(j))).or_default().push(f as u32);
            }
        }
        let edges: Vec<Edge> = sides
            .iter()
            .map(|(&(i, j), of)| Edge { ends: [i, j], faces: [of[0], of[of.len() - 1]] })
            .collect();
        let number = |i: u32, j: u32| {
            let pair = [i.min(j), i.max(j)];
            edges.binary_search_by_key(&pair, |e| e.ends).map_or(0, |k| k as u32)
        };
        let face_edges =
            faces.iter().map(|f| around(f).map(|(i, j)| number(i, j)).collect()).collect();
        Self { vertices, faces, face_edges, normals, edges, centre, size }
    }
}

/// The directed edges of a loop.
fn around(corners: &[u32]) -> impl Iterator<Item = (u32, u32)> + '_ {
    (0..corners.len()).map(|k| (corners[k], corners[(k + 1) % corners.len()]))
}

/// Twice the area of a loop, along its normal.
fn area(corners: &[u32], at: impl Fn(u32) -> Vec3) -> Vec3 {
    let o = at(corners[0]);
    (1..corners.len() - 1)
        .fold([0.0; 3], |s, k| add(s, cross(sub(at(corners[k]), o), sub(at(corners[k + 1]), o))))
}

/// Joins neighbours with the same normal: a face that is cut to triangles would hold at some of its corners only.
fn join(loops: Vec<(Vec<u32>, Vec3)>, at: impl Fn(u32) -> Vec3) -> Vec<Vec<u32>> {
    let unit: Vec<Vec3> = loops.iter().map(|(_, a)| scale(1.0 / norm(*a), *a)).collect();
    let mut group: Vec<usize> = (0..loops.len()).collect();
    let mut owner: BTreeMap<(u32, u32), usize> = BTreeMap::new();
    for (f, (corners, _)) in loops.iter().enumerate() {
        owner.extend(around(corners).map(|edge| (edge, f)));
    }
    for (&(i, j), &f) in &owner {
        if let Some(&g) = owner.get(&(j, i))
            && norm(sub(unit[f], unit[g])) < COPLANAR
        {
            let (from, to) = (group[f].max(group[g]), group[f].min(group[g]));
            group.iter_mut().filter(|x| **x == from).for_each(|x| *x = to);
        }
    }
    let mut faces = vec![];
    for g in 0..loops.len() {
        let members: Vec<usize> = (0..loops.len()).filter(|&f| group[f] == g).collect();
        match members.as_slice() {
            [] => {}
            [one] => faces.push(loops[*one].0.clone()),
            several => {
                // The directed edges without their opposite are the boundary.
                let mut next = BTreeMap::new();
                for &f in several {
                    for (i, j) in around(&loops[f].0) {
                        let inner = owner.get(&(j, i)).is_some_and(|h| group[*h] == g);
                        if !inner {
                            next.insert(i, j);
                        }
                    }
                }
                let start = *next.keys().next().expect("a group has a boundary");
                let (mut corners, mut here) = (vec![start], next[&start]);
                while here != start && corners.len() <= next.len() {
                    corners.push(here);
                    here = next.get(&here).copied().unwrap_or(start);
                }
                // Corners between collinear edges are none.
                let n = corners.len();
                let kept = (0..n).filter(|&k| {
                    let [p, q, r] = [k + n - 1, k, k + 1].map(|i| at(corners[i % n]));
                    let (u, v) = (sub(q, p), sub(r, q));
                    norm(cross(u, v)) > COPLANAR * norm(u) * norm(v)
                });
                faces.push(kept.map(|k| corners[k]).collect());
            }
        }
    }
    faces
}

/// A hull where its body is.
#[derive(Debug, Clone, Default)]
pub(crate) struct PosedHull {
    pub vertices: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    /// `n · x` on each face.
    pub offsets: Vec<f64>,
    pub centre: Vec3,
}

impl PosedHull {
    /// The face that looks against n most, of those with a vertex that is lowest along n: another one may look against n more and be higher as a whole.
    pub fn facing(&self, hull: &Hull, n: Vec3) -> usize {
        let lowest = |f: usize| {
            let heights = hull.faces[f].iter().map(|&k| dot(n, self.vertices[k as usize]));
            heights.fold(f64::INFINITY, f64::min)
        };
        let heights = self.vertices.iter().map(|&v| dot(n, v));
        let level = heights.fold(f64::INFINITY, f64::min) + LOWEST * hull.size;
        let mut best = (0, f64::INFINITY);
        for (f, &m) in self.normals.iter().enumerate() {
            let now = dot(n, m);
            if now < best.1 && lowest(f) <= level {
                best = (f, now);
            }
        }
        best.0
    }

    /// A vertex farthest along d.
    pub fn support(&self, d: Vec3) -> Vec3 {
        let mut best = (f64::NEG_INFINITY, [0.0; 3]);
        for &v in &self.vertices {
            let now = dot(d, v);
            if now > best.0 {
                best = (now, v);
            }
        }
        best.1
    }

    /// The same elsewhere.
    pub fn set_moved(&mut self, other: &Self, by: Vec3) {
        self.vertices.clear();
        self.vertices.extend(other.vertices.iter().map(|&v| add(v, by)));
        self.normals.clone_from(&other.normals);
        self.offsets.clear();
        let far = |(&d, &n): (&f64, &Vec3)| d + dot(n, by);
        self.offsets.extend(other.offsets.iter().zip(&other.normals).map(far));
        self.centre = add(other.centre, by);
    }

    pub fn set(&mut self, hull: &Hull, pose: &Pose) {
        self.vertices.clear();
        self.vertices.extend(hull.vertices.iter().map(|&v| pose.point(v)));
        self.normals.clear();
        self.normals.extend(hull.normals.iter().map(|&n| pose.direction(n)));
        self.offsets.clear();
        let corner = |f: usize| self.vertices[hull.faces[f][0] as usize];
        self.offsets.extend((0..hull.faces.len()).map(|f| dot(self.normals[f], corner(f))));
        self.centre = pose.point(hull.centre);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nonsmooth_scenes::Rotation;

    #[test]
    fn triangles_of_a_face_are_joined() {
        let cube = Polyhedron::cuboid([1.0, 2.0, 3.0]).unwrap();
        let triangles = cube
            .faces()
            .iter()
            .flat_map(|f| (1..f.len() - 1).map(|k| vec![f[0], f[k], f[k + 1]]).collect::<Vec<_>>());
        let cut = Polyhedron::new(cube.vertices().to_vec(), triangles.collect()).unwrap();
        let pose = Pose { x: [0.5, 0.0, 0.0], r: Rotation::about([1.0, 1.0, 0.3], 0.4).matrix() };
        let (whole, joined) = (Hull::new(&cube, &pose), Hull::new(&cut, &pose));
        assert_eq!((joined.faces.len(), joined.edges.len(), joined.vertices.len()), (6, 12, 8));
        assert!(joined.faces.iter().all(|f| f.len() == 4));
        assert_eq!(whole.edges.len(), 12);
        assert!(whole.edges.iter().all(|e| e.faces[0] != e.faces[1]));
    }
}

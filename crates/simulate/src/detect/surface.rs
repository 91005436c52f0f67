//! Surfaces of triangles with convex solids.
//!
//! Triangles near a solid are found in a tree of boxes. Each is a polyhedron without thickness for the narrow phase of polyhedra and round solids; for balls there is a
//! closed form. The surface is more than its triangles: a normal is one of the surface where it lies in the cone of normals of the feature that touches, so that what slides over the edge
//! between two triangles does not stumble. Points on edges between coplanar triangles are left out: they are there because of the triangulation, not of the surface. A feature that
//! two triangles share touches once.
//!
//! What separates a triangle most from a solid need not be anything of the surface: an edge between coplanar triangles that an edge of the solid crosses, or a face of the solid that is larger
//! than the triangle and nearly parallel to it. A triangle that is near and is met by nothing that the surface has is met with its own normal, so that a flat field has the contacts of a plane.
//!
//! What is behind a closed mesh or below a heightfield is solid: there the outward normals alone are possible.

use std::collections::BTreeMap;

use nonsmooth_scenes::vec3::{Vec3, cross, dot, norm, scale, sub};

use crate::Mesh;
use crate::detect::broad::Aabb;
use crate::detect::clip::Clip;
use crate::detect::convex::{self, Side};
use crate::detect::hull::{Edge, Hull, PosedHull};
use crate::detect::segments::Segment;
use crate::detect::witness::{Anchor, Feature, Place, Witness};
use crate::rotation::Pose;
use crate::state::Axis;

/// A normal that leaves its cone by less is one of the surface.
pub(super) const CONE: f64 = 1e-6;
/// Triangles whose normals differ by less are coplanar.
const COPLANAR: f64 = 1e-6;
/// A normal that differs from that of a face by less than this is the face's.
pub(super) const FACING: f64 = 1e-2;
/// A triangle is met with its own normal where it is not deeper than this share of the size of the other solid.
pub(super) const DEEP: f64 = 0.25;
/// The same where nothing says that another triangle is nearer.
const SHALLOW: f64 = 0.01;
/// A vertex touches a face although the surface goes on beyond it, if it does so at this slope or less: corners of a body that leans a little are there before they are lowest.
const SLOPE: f64 = 0.05;
/// Triangles in a leaf of the tree.
const LEAF: usize = 4;
pub(super) const NONE: u32 = u32::MAX;

/// A surface in the frame of its body.
#[derive(Debug, Clone)]
pub(crate) struct Surface {
    pub vertices: Vec<Vec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) one_sided: bool,
    pub(super) normals: Vec<Vec3>,
    /// Side k of a triangle, from its corner k to the next one.
    pub(super) sides: Vec<[u32; 3]>,
    /// The two triangles of each edge, the second one may be none, and whether they are coplanar.
    pub(super) edges: Vec<([u32; 2], bool)>,
    /// For each triangle the first of those that make a plane face with it, after which that is named: what moves over the edges between them stays the same contact.
    pub(super) faces: Vec<u32>,
    /// Whether the solid is reflex at an edge: it lies in a valley.
    pub(super) valleys: Vec<bool>,
    /// For each vertex the vertices that it has an edge with, and whether all its triangles are coplanar.
    pub(super) around: Vec<(Vec<u32>, bool)>,
    /// For each vertex whether it is at the end of a valley.
    pub(super) hollows: Vec<bool>,
    pub(super) tree: Vec<Node>,
    pub(super) order: Vec<u32>,
    pub size: f64,
    /// The least side of the box about it, m; of a heightfield no bound.
    pub(super) thickness: f64,
    /// Where the solid below a heightfield lies.
    pub(super) below: Option<Vec3>,
}

/// A box and what is in it: two nodes from `first` on, or `count` triangles.
#[derive(Debug, Clone, Copy)]
pub(super) struct Node {
    pub bounds: Aabb,
    pub first: u32,
    pub count: u32,
}

/// Memory for one triangle, or a pair of them, at a time.
#[derive(Debug, Clone, Default)]
pub(crate) struct Scratch {
    pub(super) thin: Thin,
    pub(super) other: Thin,
    pub(super) near: Vec<u32>,
    pub(super) pairs: Vec<(u32, u32)>,
    pub(super) stack: Vec<(u32, u32)>,
    pub(super) found: Vec<([Feature; 2], Witness)>,
    /// Points of two surfaces on faces of each other, the pairs of faces that do not meet in them, and triangles that lie on each other.
    pub(super) hits: Vec<Hit>,
    pub(super) dropped: Vec<Faces>,
    pub(super) lying: Vec<(u32, u32)>,
    /// Where surfaces meet, and pairs of edges, with their gaps, that count where they do not.
    pub(super) met: Vec<Vec3>,
    pub(super) held: Vec<(f64, [Feature; 2], Witness)>,
    /// What two surfaces met with, and vertices that may be inside the other one.
    pub(super) said: Vec<Said>,
    pub(super) vertices: Vec<u32>,
}

/// Whether the normal is one of the first of two surfaces, the plane face that it is of, and that of the other surface.
pub(super) type Faces = (bool, u32, u32);

/// A point where a triangle of one surface is in front of one of another, or behind it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hit {
    pub faces: Faces,
    pub features: [Feature; 2],
    pub witness: Witness,
    /// It is at a diagonal of a plane face, where the surfaces have nothing.
    pub flat: bool,
}

/// The features of two surfaces that met, and where.
pub(super) type Said = ([Feature; 2], Place);

/// A triangle as a polyhedron without thickness.
#[derive(Debug, Clone)]
pub(super) struct Thin {
    pub hull: Hull,
    pub posed: PosedHull,
}

impl Default for Thin {
    fn default() -> Self {
        // Front, back and three sides without area; each edge is there twice, between a side and the front or the back.
        let faces = vec![vec![0, 1, 2], vec![0, 2, 1], vec![0, 1], vec![1, 2], vec![2, 0]];
        let ends = |k: u32| [k, (k + 1) % 3];
        let edges = (0..6).map(|e| Edge { ends: ends(e % 3), faces: [e / 3, 2 + e % 3] });
        let face_edges = vec![vec![0, 1, 2], vec![5, 4, 3], vec![0, 3], vec![1, 4], vec![2, 5]];
        let hull = Hull {
            vertices: vec![[0.0; 3]; 3],
            faces,
            face_edges,
            normals: vec![[0.0; 3]; 5],
            edges: edges.collect(),
            centre: [0.0; 3],
            size: 1.0,
        };
        Self { hull, posed: PosedHull::default() }
    }
}

/// Whether the face that a contact is at is of the first solid; none where it is at no face.
fn reference(witness: &Witness) -> Option<bool> {
    match witness {
        Witness::Face { on_a, .. } | Witness::Rim { on_a, .. } => Some(*on_a),
        _ => None,
    }
}

impl Surface {
    /// Of a mesh that stands at `pose` in the frame of its body.
    pub fn new(mesh: &Mesh, pose: &Pose) -> Self {
        let vertices: Vec<Vec3> = mesh.vertices().iter().map(|&v| pose.point(v)).collect();
        let triangles = mesh.triangles().to_vec();
        let at = |v: u32| vertices[v as usize];
        let unit = |[a, b, c]: &[u32; 3]| {
            let n = cross(sub(at(*b), at(*a)), sub(at(*c), at(*a)));
            scale(1.0 / norm(n), n)
        };
        let normals: Vec<Vec3> = triangles.iter().map(unit).collect();
        let mut numbers: BTreeMap<[u32; 2], u32> = BTreeMap::new();
        let mut edges: Vec<([u32; 2], bool)> = vec![];
        let mut around = vec![(vec![], true); vertices.len()];
        let mut sides = vec![];
        for (t, corners) in triangles.iter().enumerate() {
            let side = |k: usize| {
                let (i, j) = (corners[k], corners[(k + 1) % 3]);
                let e = *numbers.entry([i.min(j), i.max(j)]).or_insert_with(|| {
                    edges.push(([t as u32, NONE], false));
                    edges.len() as u32 - 1
                });
                let (of, flat) = &mut edges[e as usize];
                if of[0] != t as u32 && of[1] == NONE {
                    of[1] = t as u32;
                    *flat = norm(sub(normals[of[0] as usize], normals[t])) < COPLANAR;
                }
                e
            };
            sides.push([0, 1, 2].map(side));
        }
        for ([i, j], &e) in &numbers {
            for (v, w) in [(*i, *j), (*j, *i)] {
                let (others, flat) = &mut around[v as usize];
                others.push(w);
                *flat &= edges[e as usize].1;
            }
        }
        let mut faces = vec![NONE; triangles.len()];
        for first in 0..triangles.len() as u32 {
            let mut stack = vec![first];
            while let Some(t) = stack.pop() {
                if faces[t as usize] != NONE {
                    continue;
                }
                faces[t as usize] = first;
                let flat = sides[t as usize].map(|e: u32| edges[e as usize]);
                stack.extend(flat.into_iter().filter(|e| e.1).flat_map(|e| e.0));
            }
        }
        let middle = scale(
            0.5,
            [0, 1, 2].map(|d| {
                let x = || vertices.iter().map(|v| v[d]);
                x().fold(f64::INFINITY, f64::min) + x().fold(f64::NEG_INFINITY, f64::max)
            }),
        );
        let size = vertices.iter().map(|&v| norm(sub(v, middle))).fold(0.0, f64::max);
        let extent = |d: usize| {
            let x = || vertices.iter().map(|v| v[d]);
            x().fold(f64::NEG_INFINITY, f64::max) - x().fold(f64::INFINITY, f64::min)
        };
        let thickness = match mesh.open_edges().is_empty() {
            true => (0..3).map(extent).fold(f64::INFINITY, f64::min),
            false => f64::INFINITY,
        };
        let mut out = Self {
            vertices,
            triangles,
            one_sided: mesh.is_one_sided(),
            normals,
            sides,
            edges,
            faces,
            valleys: vec![],
            around,
            hollows: vec![],
            tree: vec![],
            order: vec![],
            size,
            thickness,
            below: (mesh.is_one_sided() && thickness.is_infinite())
                .then(|| pose.direction([0.0, 0.0, -1.0])),
        };
        out.hollow();
        out.grow();
        out
    }

    /// Notes where the surface is not convex.
    fn hollow(&mut self) {
        let is_valley = |e: usize| {
            let ([t, u], flat) = self.edges[e];
            let rises = || {
                let far =
                    self.triangles[u as usize].map(|v| self.height(t, self.vertices[v as usize]));
                far.into_iter().fold(0.0, f64::max) > COPLANAR * self.size
            };
            self.one_sided && !flat && u != NONE && rises()
        };
        self.valleys = (0..self.edges.len()).map(is_valley).collect();
        let mut hollows = vec![false; self.vertices.len()];
        for (corners, sides) in self.triangles.iter().zip(&self.sides) {
            for k in (0..3).filter(|&k| self.valleys[sides[k] as usize]) {
                hollows[corners[k] as usize] = true;
                hollows[corners[(k + 1) % 3] as usize] = true;
            }
        }
        self.hollows = hollows;
    }

    /// Vertices that are more than points of a plane.
    pub fn corners(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.vertices.len()).filter(|&v| !self.around[v].1 && !self.around[v].0.is_empty())
    }

    /// Makes the tree: boxes are cut in two at the median along their longest side.
    fn grow(&mut self) {
        let bounds_of = |t: u32| self.bounds(t);
        let mut order: Vec<u32> = (0..self.triangles.len() as u32).collect();
        let mut tree = vec![Node {
            bounds: Aabb { low: [0.0; 3], high: [0.0; 3] },
            first: 0,
            count: order.len() as u32,
        }];
        let mut k = 0;
        while k < tree.len() {
            let Node { first, count, .. } = tree[k];
            let members = &mut order[first as usize..(first + count) as usize];
            let start = Aabb { low: [f64::INFINITY; 3], high: [f64::NEG_INFINITY; 3] };
            let bounds = members.iter().fold(start, |all, &t| {
                let one = bounds_of(t);
                Aabb {
                    low: std::array::from_fn(|d| all.low[d].min(one.low[d])),
                    high: std::array::from_fn(|d| all.high[d].max(one.high[d])),
                }
            });
            tree[k].bounds = bounds;
            if members.len() > LEAF {
                let extent = |d: &usize| bounds.high[*d] - bounds.low[*d];
                let longest = (0..3).max_by(|a, b| extent(a).total_cmp(&extent(b))).unwrap_or(0);
                let middle = |t: u32| {
                    let one = bounds_of(t);
                    one.low[longest] + one.high[longest]
                };
                let half = members.len() / 2;
                members.select_nth_unstable_by(half, |&a, &b| {
                    middle(a).total_cmp(&middle(b)).then(a.cmp(&b))
                });
                let children = tree.len() as u32;
                (tree[k].first, tree[k].count) = (children, 0);
                let half = half as u32;
                for (first, count) in [(first, half), (first + half, count - half)] {
                    tree.push(Node { bounds, first, count });
                }
            }
            k += 1;
        }
        (self.tree, self.order) = (tree, order);
    }

    /// The box of a triangle.
    pub(super) fn bounds(&self, t: u32) -> Aabb {
        let corners = self.triangles[t as usize].map(|v| self.vertices[v as usize]);
        let by = |f: fn(f64, f64) -> f64| {
            std::array::from_fn(|d| f(f(corners[0][d], corners[1][d]), corners[2][d]))
        };
        Aabb { low: by(f64::min), high: by(f64::max) }
    }

    /// The triangles whose boxes meet a box of the world, in order.
    pub(super) fn near(&self, pose: &Pose, bounds: &Aabb, out: &mut Vec<u32>) {
        let middle = std::array::from_fn(|d| 0.5 * (bounds.low[d] + bounds.high[d]));
        let half: Vec3 = std::array::from_fn(|d| 0.5 * (bounds.high[d] - bounds.low[d]));
        let middle = pose.local_point(middle);
        let reach: Vec3 =
            std::array::from_fn(|d| (0..3).map(|k| pose.r[k][d].abs() * half[k]).sum());
        let mine = Aabb {
            low: std::array::from_fn(|d| middle[d] - reach[d]),
            high: std::array::from_fn(|d| middle[d] + reach[d]),
        };
        out.clear();
        let mut stack = vec![0_u32];
        while let Some(k) = stack.pop() {
            let node = &self.tree[k as usize];
            if !node.bounds.meets(&mine) {
                continue;
            }
            match node.count {
                0 => stack.extend([node.first, node.first + 1]),
                n => out.extend(&self.order[node.first as usize..(node.first + n) as usize]),
            }
        }
        out.sort_unstable();
    }

    /// From edge k of a triangle into it, across the edge, not of unit length.
    pub(super) fn inwards(&self, t: u32, e: u32) -> Vec3 {
        let sides = self.sides[t as usize];
        let k = sides.iter().position(|&s| s == e).unwrap_or(0);
        let [p, q] = [k, k + 1].map(|i| self.vertices[self.triangles[t as usize][i % 3] as usize]);
        cross(self.normals[t as usize], sub(q, p))
    }

    /// Whether n, in the frame of the body, is a normal of the surface at a feature: it goes into no triangle there. At an edge between triangles with normals n₁ and n₂ these are
    /// ±(a n₁ + b n₂), a, b ≥ 0, with + where it is convex: there `n · (n₁ + n₂) ≥ 0`, though `n · n₁ < 0` may be where it is sharp.
    pub(super) fn has_normal(&self, feature: Feature, n: Vec3) -> bool {
        let away = |d: Vec3| dot(n, d) <= CONE * norm(d);
        match feature {
            Feature::Edge(e) => {
                let of = self.edges[e as usize].0;
                let of = || of.iter().copied().filter(|&t| t != NONE);
                let outwards = || of().map(|t| dot(n, self.normals[t as usize])).sum::<f64>();
                of().all(|t| away(self.inwards(t, e))) && (!self.one_sided || outwards() >= -CONE)
            }
            Feature::Vertex(v) => self.is_top(v, n, CONE),
            Feature::Face(_) | Feature::Curved(_) => false,
        }
    }

    /// Whether no edge at a vertex goes along n, in the frame of the body, by more than a slope.
    pub(super) fn is_top(&self, v: u32, n: Vec3, slope: f64) -> bool {
        let at = |v: u32| self.vertices[v as usize];
        let away = |d: Vec3| dot(n, d) <= slope * norm(d);
        self.around[v as usize].0.iter().all(|&w| away(sub(at(w), at(v))))
    }

    pub(super) fn is_flat(&self, feature: Feature) -> bool {
        match feature {
            Feature::Edge(e) => self.edges[e as usize].1,
            Feature::Vertex(v) => self.around[v as usize].1,
            Feature::Face(_) | Feature::Curved(_) => false,
        }
    }

    /// A feature of triangle t as one of the surface.
    pub(super) fn named(&self, t: u32, feature: Feature) -> Feature {
        let sides = self.sides[t as usize];
        match feature {
            Feature::Vertex(k) => Feature::Vertex(self.triangles[t as usize][k as usize]),
            Feature::Edge(e) => Feature::Edge(sides[e as usize % 3]),
            Feature::Face(f) if f < 2 => Feature::Face(2 * self.faces[t as usize] + f),
            Feature::Face(f) => Feature::Edge(sides[f as usize - 2]),
            curved @ Feature::Curved(_) => curved,
        }
    }

    /// All points where the surface is nearer to another solid than `prediction`; `bounds` is the box of that, in the world. The surface is the first of the two.
    pub fn collide(
        &self,
        (pose, other, bounds): (&Pose, &Side, &Aabb),
        prediction: f64,
        (clip, scratch): (&mut Clip, &mut Scratch),
        mut found: impl FnMut([Feature; 2], Witness),
    ) {
        let mut deepest: Option<Place> = None;
        let note = |features: [Feature; 2], witness: Witness| {
            if self.one_sided {
                let place = witness.place(pose, other.pose(), [0.0, 0.0, 1.0]);
                if deepest.is_none_or(|d| place.gap < d.gap) {
                    deepest = Some(place);
                }
            }
            found(features, witness);
        };
        let is_near = self.meet((pose, other, bounds), prediction, (clip, scratch), note);
        // What is deep is met by some triangles at most, not where it is deepest.
        let is_all = deepest.is_some_and(|place| {
            let surface = sub(place.point, scale(0.5 * place.gap, place.normal));
            let lowest = dot(place.normal, sub(other.lowest(place.normal), surface));
            lowest >= place.gap - SHALLOW * other.size()
        });
        if !self.one_sided {
            return;
        }
        let solid = (pose, other, bounds);
        if !is_all {
            let is_cut = is_near && deepest.is_none_or(|place| place.gap > 0.0);
            self.catch(solid, is_cut, prediction, (clip, scratch), &mut found);
        }
        if let Some(place) = deepest {
            let depth = f64::max(0.0, -place.gap) + SHALLOW * other.size();
            self.tips((pose, other), depth, &scratch.near, &mut found);
        }
    }

    /// The points where triangles near the other solid have normals of the surface; whether any triangle is near.
    fn meet(
        &self,
        (pose, other, bounds): (&Pose, &Side, &Aabb),
        prediction: f64,
        (clip, scratch): (&mut Clip, &mut Scratch),
        mut found: impl FnMut([Feature; 2], Witness),
    ) -> bool {
        let mut near = std::mem::take(&mut scratch.near);
        self.near(pose, bounds, &mut near);
        if let Side::Rod { local, world, radius, .. } = other
            && world.d == [0.0; 3]
        {
            for &t in &near {
                self.ball(t, (local.p, pose.local_point(world.p), *radius), &mut found);
            }
            scratch.near = near;
            return false;
        }
        let mut any = false;
        scratch.met.clear();
        scratch.held.clear();
        for &t in &near {
            self.template(t, pose, &mut scratch.thin);
            let Scratch { thin: Thin { hull, posed }, found: list, met: points, held, .. } =
                &mut *scratch;
            list.clear();
            let triangle = Side::Hull { hull, posed, pose };
            // The side of the triangle that separates, if one does.
            let (is_near, across) = match other {
                Side::Hull { hull: h, posed: p, pose: q } => {
                    let (first, second) = ((&*hull, &*posed, pose), (*h, *p, *q));
                    let push = |f, w| list.push((f, w));
                    let axis = clip.collide(first, second, None, prediction, push);
                    let across = match axis {
                        Some(Axis::FaceA(f)) => Some(self.named(t, Feature::Face(f))),
                        Some(Axis::Edges(e, _)) => Some(self.named(t, Feature::Edge(e))),
                        _ => None,
                    };
                    (axis.is_some(), across)
                }
                _ => {
                    let push = |f, w| list.push((f, w));
                    (convex::collide(&triangle, other, prediction, push), None)
                }
            };
            any |= is_near;
            // Whether the surface is met here, with a normal of another triangle or solid that it does not have, or at a point of a plane.
            let (mut met, mut foreign, mut inner) = (false, false, false);
            let count = list.len();
            for ([feature, own], witness) in list.drain(..) {
                let Place { normal, point, .. } =
                    witness.place(pose, other.pose(), [0.0, 0.0, 1.0]);
                let n = pose.local_direction(normal);
                let front = dot(n, self.normals[t as usize]);
                let facing =
                    if self.one_sided { front } else { front.abs() } > 1.0 - FACING * FACING;
                let feature = self.named(t, feature);
                let by = reference(&witness);
                let surface = match feature {
                    // A triangle that lies on a face of the other solid, or is its reference.
                    _ if facing => true,
                    Feature::Vertex(v) if by == Some(false) && !self.is_flat(feature) => {
                        self.is_top(v, n, SLOPE)
                    }
                    _ => self.has_normal(feature, n),
                };
                // The normal of a plane is its own rather than that of a face that nearly lies on it.
                let on_it = by == Some(false) && matches!(feature, Feature::Face(_));
                if !surface {
                    foreign = true;
                } else if facing && (self.is_flat(feature) || on_it) {
                    // All that touches the triangle is in the list if that is the reference; else such points stand for what is above it.
                    *(if by == Some(true) { &mut met } else { &mut inner }) = true;
                } else {
                    met = true;
                    points.push(point);
                    // In a valley both sides are met: each has its name.
                    let named = match feature {
                        Feature::Edge(e) if facing && self.valleys[e as usize] => {
                            self.named(t, Feature::Face(0))
                        }
                        _ => feature,
                    };
                    found([named, own], witness);
                }
            }
            let deepest = match (count, across) {
                _ if inner || (foreign && !met) => DEEP,
                // Edges that pass beside each other: of an edge that is none of the surface it says nothing.
                (0, Some(edge)) if is_near && self.is_flat(edge) => DEEP,
                (0, _) if is_near => SHALLOW,
                _ => continue,
            };
            let deepest = -deepest * other.size();
            // Another triangle is nearer there; with its own normal this one may touch elsewhere.
            let middle = other.middle();
            let behind = dot(posed.normals[0], middle) < posed.offsets[0];
            let face = usize::from(behind && !self.one_sided);
            // What goes on far below the plane of the triangle does not lie on it: where it is met with another normal, that is the one.
            let n = posed.normals[face];
            let lowest = dot(n, other.lowest(n)) - posed.offsets[face];
            let keep = |features: [Feature; 2], witness: Witness| {
                let Place { gap, point, .. } = witness.place(pose, other.pose(), [0.0, 0.0, 1.0]);
                if gap < deepest {
                    return;
                }
                if self.one_sided && lowest < gap - SLOPE * other.size() {
                    held.push((gap, features, witness));
                } else {
                    points.push(point);
                    found(features, witness);
                }
            };
            let both = ((&*hull, &*posed, pose), other);
            self.on_triangle((t, face), both, prediction, clip, keep);
        }
        let Scratch { met: points, held, .. } = scratch;
        let reach = DEEP * other.size();
        for (_, features, witness) in held.drain(..) {
            let x = witness.place(pose, other.pose(), [0.0, 0.0, 1.0]).point;
            if !points.iter().any(|&p| norm(sub(p, x)) <= reach) {
                found(features, witness);
            }
        }
        scratch.near = near;
        any
    }

    /// Where the other solid is nearer than `prediction` to a side of triangle t, of which `face` is its number, along the normal of that; points of planes are left out.
    pub(super) fn on_triangle(
        &self,
        (t, face): (u32, usize),
        (triangle, other): ((&Hull, &PosedHull, &Pose), &Side),
        prediction: f64,
        clip: &mut Clip,
        mut found: impl FnMut([Feature; 2], Witness),
    ) {
        let mut keep = |[feature, own]: [Feature; 2], witness: Witness| {
            let feature = self.named(t, feature);
            if !self.is_flat(feature) {
                found([feature, own], witness);
            }
        };
        let (hull, posed, pose) = triangle;
        if let Side::Hull { hull: h, posed: p, pose: q } = other {
            clip.on_face(triangle, (*h, *p, *q), face, prediction, keep);
        } else if let Some(flat) = (Side::Hull { hull, posed, pose }).flat(posed.normals[face]) {
            convex::on_flat(&flat, true, other, prediction, &mut keep);
        }
    }

    /// Makes the polyhedron without thickness that triangle t is.
    pub(super) fn template(&self, t: u32, pose: &Pose, Thin { hull, posed }: &mut Thin) {
        let corners = self.triangles[t as usize].map(|v| self.vertices[v as usize]);
        let n = self.normals[t as usize];
        hull.vertices.copy_from_slice(&corners);
        hull.centre = scale(1.0 / 3.0, std::array::from_fn(|d| corners.iter().map(|c| c[d]).sum()));
        hull.size = corners.iter().map(|&c| norm(sub(c, hull.centre))).fold(0.0, f64::max);
        (hull.normals[0], hull.normals[1]) = (n, scale(-1.0, n));
        for k in 0..3 {
            let edge = sub(corners[(k + 1) % 3], corners[k]);
            hull.normals[2 + k] = scale(1.0 / norm(edge), cross(edge, n));
        }
        posed.set(hull, pose);
    }

    /// A ball with triangle t: its nearest point, if no other triangle is nearer there.
    fn ball(
        &self,
        t: u32,
        (centre, at, radius): (Vec3, Vec3, f64),
        found: &mut impl FnMut([Feature; 2], Witness),
    ) {
        let corners = self.triangles[t as usize];
        let n = self.normals[t as usize];
        let own = Feature::Curved(0);
        if self.is_over(t, at) {
            let height = self.height(t, at);
            let back = height < 0.0 && !self.one_sided;
            // A ball that is below the ground as a whole is met by what it is deepest behind.
            if height >= -radius || !self.one_sided {
                self.ball_on(t, back, (centre, at, radius), found);
            }
            return;
        }
        let (k, x, far) = self.on_sides(t, at);
        let [p, q] = [k, (k + 1) % 3].map(|i| self.vertices[corners[i] as usize]);
        let (feature, line) = match x {
            0.0 => (Feature::Vertex(corners[k]), Segment::point(p)),
            1.0 => (Feature::Vertex(corners[(k + 1) % 3]), Segment::point(q)),
            _ => (Feature::Edge(self.sides[t as usize][k]), Segment::between(p, q)),
        };
        let toward = sub(at, Segment::between(p, q).at(x));
        let outside = !self.one_sided || dot(toward, n) >= -CONE * far;
        if far > 0.0 && outside && self.has_normal(feature, scale(1.0 / far, toward)) {
            let ball = Segment::point(centre);
            let witness = Witness::Rounds { s: line, s_radius: 0.0, t: ball, t_radius: radius };
            found([feature, own], witness);
        }
    }

    /// A ball that touches triangle t itself, or its back.
    pub(super) fn ball_on(
        &self,
        t: u32,
        back: bool,
        (centre, at, radius): (Vec3, Vec3, f64),
        found: &mut impl FnMut([Feature; 2], Witness),
    ) {
        let n = self.normals[t as usize];
        let normal = if back { scale(-1.0, n) } else { n };
        let foot = sub(at, scale(self.height(t, at), n));
        let anchor = Anchor::Other;
        let witness = Witness::Face { on_a: true, normal, other: centre, foot, radius, anchor };
        let face = self.named(t, Feature::Face(u32::from(back)));
        found([face, Feature::Curved(0)], witness);
    }

    /// How far x, in the frame of the body, is in front of the plane of triangle t.
    pub(super) fn height(&self, t: u32, x: Vec3) -> f64 {
        let first = self.triangles[t as usize][0];
        dot(self.normals[t as usize], sub(x, self.vertices[first as usize]))
    }

    /// Whether the foot of x on the plane of triangle t is in the triangle.
    pub(super) fn is_over(&self, t: u32, x: Vec3) -> bool {
        let corner = |k: usize| self.vertices[self.triangles[t as usize][k % 3] as usize];
        let n = self.normals[t as usize];
        let beyond = |k| dot(cross(sub(corner(k + 1), corner(k)), n), sub(x, corner(k))) > 0.0;
        !(0..3).any(beyond)
    }

    /// The point of the sides of triangle t that is nearest to x: the number of the side, where on it the point is, and how far from x.
    pub(super) fn on_sides(&self, t: u32, x: Vec3) -> (usize, f64, f64) {
        let corner = |k: usize| self.vertices[self.triangles[t as usize][k % 3] as usize];
        let mut best = (0, 0.0, f64::INFINITY);
        for k in 0..3 {
            let side = Segment::between(corner(k), corner(k + 1));
            let s = side.nearest(x);
            let far = norm(sub(x, side.at(s)));
            if far < best.2 {
                best = (k, s, far);
            }
        }
        best
    }
}

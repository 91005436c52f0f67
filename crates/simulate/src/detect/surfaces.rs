//! Two surfaces with something solid behind them, at most one of which is a heightfield.
//!
//! Pairs of triangles that are near come from going down both trees together. A triangle is met by another one with the normal of the first, with that of the second unless the two
//! lie on each other, and by pairs of edges with the normal across both. Each point is named by the features of both surfaces and taken where its normal is in the cones of normals of both
//! features, so that nothing is met across an edge that is not there.
//!
//! A triangle does not say how deep a body is behind it. What is deeper than a share of the thinner body is no contact; and of two faces that a point is behind the nearer one is
//! met: a corner that has sunk a little into the top of a box is not far behind its side. That is asked of all points of two plane faces together, by their mean and each, however they are cut into triangles: those of a triangle
//! may all be at the edge of its face, which is flush with one of the other body. Two edges that are near a face so are met all the same, the least deep first, where nothing
//! else is met within their depth.
//!
//! What is behind a valley is below neither of its sides: the faces beside it are met by all vertices that are nearer to the valley than to what else there is, and edges that end there by what their lines cross
//! beyond the end before the surface goes on. Vertices deep inside the other surface that nothing says so of are met by the plane face nearest to them.
//!
//! Cost: the pairs of triangles that are near each other, times the logarithm of all; a ray and a descent for each vertex in the box about the other surface that has no contact.

use nonsmooth_scenes::vec3::{Vec3, add, cross, dot, norm, scale, sub};

use crate::detect::broad::Aabb;
use crate::detect::clip::Clip;
use crate::detect::segments::{Segment, closest};
use crate::detect::surface::{CONE, DEEP, FACING, Faces, Hit, Said, Scratch, Surface, Thin};
use crate::detect::witness::{Anchor, Feature, Witness};
use crate::rotation::{Pose, product};

/// Penetrations below this share of the thinner body are not looked at twice.
const SHALLOW: f64 = 1e-3;
/// Triangles that have sunk in by this share of the thinner body are looked for at least: a triangle that lies behind another one has no box in common with it.
const SUNK: f64 = 0.02;
/// By which share of the depth of a point the surface must be away from it: of faces, and of edges, which are less deep than they separate.
const NEARER: [f64; 2] = [0.5, 0.05];
/// The slope at which edges may go on beyond a corner that meets a face.
const STEEP: f64 = 0.5;
/// Edges that are parallel up to this have no common normal.
const PARALLEL: f64 = 1e-6;

/// Pairs of triangles, or of nodes of two trees.
type Pairs = Vec<(u32, u32)>;

/// A surface with the pose of its body.
type Placed<'a> = (&'a Surface, &'a Pose);

/// All points where the first surface is nearer to the second than `prediction`; `depth` is how deep they may be in each other.
pub(crate) fn collide(
    (a, a_pose): Placed,
    (b, b_pose): Placed,
    (prediction, depth): (f64, f64),
    (clip, scratch): (&mut Clip, &mut Scratch),
    mut found: impl FnMut([Feature; 2], Witness),
) {
    let Scratch { thin, other, pairs, stack, hits, dropped, lying, held, said, vertices, .. } =
        scratch;
    let thin_body = a.thickness.min(b.thickness);
    let margin = prediction.max(depth.max(SUNK * thin_body).min(DEEP * thin_body));
    near(a, b, &relative(a_pose, b_pose), margin, (pairs, stack));
    let reach = (prediction, margin);
    let mut last = u32::MAX;
    let place = |witness: &Witness| witness.place(a_pose, b_pose, [0.0, 0.0, 1.0]);
    let mut take = |said: &mut Vec<Said>, features: [Feature; 2], witness: Witness| {
        said.push((features, place(&witness)));
        found(features, witness);
    };
    said.clear();
    held.clear();
    hits.clear();
    lying.clear();
    for &(t, u) in &*pairs {
        if t != last {
            a.template(t, a_pose, thin);
            last = t;
        }
        b.template(u, b_pose, other);
        let facing = dot(thin.posed.normals[0], other.posed.normals[0]);
        if facing < CONE {
            let (one, two) = ((a, t, &*thin, a_pose), (b, u, &*other, b_pose));
            on_face(one, two, true, clip, reach, hits);
            // What lies on each other is met with the normal of the first.
            match facing < FACING * FACING - 1.0 {
                true => lying.push((t, u)),
                false => on_face(two, one, false, clip, reach, hits),
            }
        }
        for (e, f) in edges((a, t), (b, u)) {
            let Some(Across { witness, gap, near_a_face }) =
                across((a, a_pose, e), (b, b_pose, f), reach, thin_body)
            else {
                continue;
            };
            let features = [Feature::Edge(e), Feature::Edge(f)];
            if near_a_face {
                held.push((gap, features, witness));
            } else {
                take(said, features, witness);
            }
        }
    }
    dropped.clear();
    let both = ((a, a_pose), (b, b_pose));
    settle(hits, both, thin_body, dropped, &mut |features, witness| take(said, features, witness));
    if !dropped.is_empty() {
        lying.retain(|&(t, u)| dropped.contains(&(true, a.faces[t as usize], b.faces[u as usize])));
        hits.clear();
        for &(t, u) in &*lying {
            a.template(t, a_pose, thin);
            b.template(u, b_pose, other);
            on_face((b, u, other, b_pose), (a, t, thin, a_pose), false, clip, reach, hits);
        }
        let mut take = |features, witness| take(said, features, witness);
        settle(hits, both, thin_body, dropped, &mut take);
    }
    held.sort_unstable_by(|x, y| y.0.total_cmp(&x.0));
    for (gap, features, witness) in held.drain(..) {
        let here = place(&witness).point;
        if said.iter().all(|s| norm(sub(s.1.point, here)) > -gap) {
            take(said, features, witness);
        }
    }
    for on_a in [true, false] {
        sunk(both, on_a, thin_body, (said, vertices, stack), &mut take);
    }
}

/// Vertices of one surface that are inside the other, and where nothing says so: with the plane face that is nearest to them. `on_a` says whether that is of the first surface.
fn sunk(
    (a, b): (Placed, Placed),
    on_a: bool,
    thickness: f64,
    (said, vertices, stack): (&mut Vec<Said>, &mut Vec<u32>, &mut Pairs),
    take: &mut impl FnMut(&mut Vec<Said>, [Feature; 2], Witness),
) {
    if thickness.is_infinite() {
        return;
    }
    let ((first, first_pose), (second, second_pose)) = if on_a { (a, b) } else { (b, a) };
    let shallow = SHALLOW * thickness;
    let mut bounds = first.tree[0].bounds.grown(-shallow);
    if let Some(below) = first.below {
        for (d, down) in scale(first.size, below).into_iter().enumerate() {
            bounds.low[d] += down.min(0.0);
            bounds.high[d] += down.max(0.0);
        }
    }
    let there = carried(&bounds, &relative(second_pose, first_pose), 0.0);
    vertices.clear();
    stack.clear();
    stack.push((0, 0));
    while let Some((k, _)) = stack.pop() {
        let node = &second.tree[k as usize];
        if !node.bounds.meets(&there) {
            continue;
        }
        match node.count {
            0 => stack.extend([(node.first, 0), (node.first + 1, 0)]),
            n => {
                let own = &second.order[node.first as usize..(node.first + n) as usize];
                vertices.extend(own.iter().flat_map(|&t| second.triangles[t as usize]));
            }
        }
    }
    vertices.sort_unstable();
    vertices.dedup();
    let side = usize::from(on_a);
    for &v in &*vertices {
        let feature = Feature::Vertex(v);
        let local = second.vertices[v as usize];
        let here = second_pose.point(local);
        let x = first_pose.local_point(here);
        if bounds.distance(x) > 0.0
            || second.is_flat(feature)
            || said.iter().any(|s| s.0[side] == feature)
            || !first.may_hold(x)
        {
            continue;
        }
        let Some(foot) = first.foot(x).filter(|f| f.far > shallow && f.is_below(x)) else {
            continue;
        };
        let (face, witness) = first.behind(&foot, x, local, 0.0);
        let witness = if on_a { witness } else { witness.swapped() };
        let (n, far) = (witness.place(a.1, b.1, [0.0, 0.0, 1.0]).normal, foot.far);
        // Another contact says so where it is nearly as deep beside the vertex; one from which the surface goes on deeper counts where nothing else is near.
        let towards = second_pose.local_direction(scale(if on_a { -1.0 } else { 1.0 }, n));
        let is_last = second.is_top(v, towards, STEEP);
        let says = |(_, place): &Said| {
            let depth = -place.gap;
            let reach = if is_last { depth.max(far) } else { DEEP * thickness };
            depth >= NEARER[0] * far && norm(sub(place.point, here)) <= reach
        };
        if said.iter().any(says) {
            continue;
        }
        take(said, if on_a { [face, feature] } else { [feature, face] }, witness);
    }
}

/// The pose of b in the frame of a.
fn relative(a: &Pose, b: &Pose) -> Pose {
    let back = std::array::from_fn(|i| std::array::from_fn(|j| a.r[j][i]));
    Pose { x: a.local_point(b.x), r: product(&back, &b.r) }
}

/// The box about a box that has this pose, larger by `margin`.
fn carried(bounds: &Aabb, pose: &Pose, margin: f64) -> Aabb {
    let middle = pose.point(std::array::from_fn(|d| 0.5 * (bounds.low[d] + bounds.high[d])));
    let half: Vec3 = std::array::from_fn(|d| 0.5 * (bounds.high[d] - bounds.low[d]));
    let reach: Vec3 =
        pose.r.map(|row| margin + (0..3).map(|k| row[k].abs() * half[k]).sum::<f64>());
    Aabb {
        low: std::array::from_fn(|d| middle[d] - reach[d]),
        high: std::array::from_fn(|d| middle[d] + reach[d]),
    }
}

/// The triangles whose boxes are within `margin` of each other, in order; `pose` is that of b in the frame of a.
fn near(
    a: &Surface,
    b: &Surface,
    pose: &Pose,
    margin: f64,
    (out, stack): (&mut Pairs, &mut Pairs),
) {
    let carried = |bounds: &Aabb| carried(bounds, pose, margin);
    out.clear();
    stack.clear();
    stack.push((0, 0));
    while let Some((i, j)) = stack.pop() {
        let (p, q) = (&a.tree[i as usize], &b.tree[j as usize]);
        if !p.bounds.meets(&carried(&q.bounds)) {
            continue;
        }
        match (p.count, q.count) {
            (0, 0) => {
                for i in [p.first, p.first + 1] {
                    stack.extend([(i, q.first), (i, q.first + 1)]);
                }
            }
            (0, _) => stack.extend([(p.first, j), (p.first + 1, j)]),
            (_, 0) => stack.extend([(i, q.first), (i, q.first + 1)]),
            (m, n) => {
                for &u in &b.order[q.first as usize..(q.first + n) as usize] {
                    let own = carried(&b.bounds(u));
                    let all = &a.order[p.first as usize..(p.first + m) as usize];
                    let met = all.iter().filter(|t| a.bounds(**t).meets(&own));
                    out.extend(met.map(|&t| (t, u)));
                }
            }
        }
    }
    out.sort_unstable();
}

/// A triangle of a surface with its polyhedron and the pose of its body.
type Triangle<'a> = (&'a Surface, u32, &'a Thin, &'a Pose);

/// Where a triangle of the second surface is nearer than `prediction` in front of one of the first, along the normal of that; `on_a` says whether the first is that of the pair.
fn on_face(
    (a, t, first, a_pose): Triangle,
    (b, u, second, b_pose): Triangle,
    on_a: bool,
    clip: &mut Clip,
    (prediction, margin): (f64, f64),
    hits: &mut Vec<Hit>,
) {
    let faces = (on_a, a.faces[t as usize], b.faces[u as usize]);
    let n = first.posed.normals[0];
    let against = b_pose.local_direction(scale(-1.0, n));
    let facing = dot(against, b.normals[u as usize]) > 1.0 - FACING * FACING;
    let reference = (&first.hull, &first.posed, a_pose);
    let incident = (&second.hull, &second.posed, b_pose);
    clip.on_face(reference, incident, 0, prediction, |[f, g], witness| {
        let (f, g) = (a.named(t, f), b.named(u, g));
        // An edge that is inclined to the face is nearest to it at one of its ends, or where it crosses an edge.
        let along = match g {
            Feature::Edge(e) => {
                let d = b.edge(e).d;
                dot(against, d).abs() <= FACING * norm(d)
            }
            _ => true,
        };
        let normal = || match g {
            // The normal is that of the face: a corner that leans over it is at it before it is the lowest.
            Feature::Vertex(v) => b.is_top(v, against, STEEP),
            _ => along && b.has_normal(g, against),
        };
        if facing || normal() {
            hits.push(Hit { faces, features: [f, g], witness, flat: a.is_flat(f) || b.is_flat(g) });
        }
    });
    // Below a valley is a wedge that is below neither of its sides: what is there is behind both.
    if !a.is_hollow(t) {
        return;
    }
    for (&v, &here) in b.triangles[u as usize].iter().zip(&second.posed.vertices) {
        let height = dot(n, here) - first.posed.offsets[0];
        if !(-margin..0.0).contains(&height) {
            continue;
        }
        let x = a_pose.local_point(here);
        if a.is_in_wedge(t, x, margin) && (facing || b.is_top(v, against, STEEP)) {
            let g = Feature::Vertex(v);
            let (normal, foot) =
                (a.normals[t as usize], sub(x, scale(height, a.normals[t as usize])));
            let (other, anchor) = (b.vertices[v as usize], Anchor::Other);
            let witness = Witness::Face { on_a: true, normal, other, foot, radius: 0.0, anchor };
            let features = [a.named(t, Feature::Face(0)), g];
            hits.push(Hit { faces, features, witness, flat: b.is_flat(g) });
        }
    }
}

/// Hands on the points of faces that meet, and notes those of the others.
fn settle(
    hits: &mut [Hit],
    (a, b): (Placed, Placed),
    thickness: f64,
    dropped: &mut Vec<Faces>,
    take: &mut impl FnMut([Feature; 2], Witness),
) {
    hits.sort_unstable_by_key(|hit| hit.faces);
    for points in hits.chunk_by(|p, q| p.faces == q.faces) {
        let on_a = points[0].faces.0;
        let (first, second) = if on_a { (a, b) } else { (b, a) };
        if too_deep(points, first, second.1, thickness) {
            dropped.push(points[0].faces);
            continue;
        }
        for &Hit { features: [f, g], witness, .. } in points.iter().filter(|hit| !hit.flat) {
            match on_a {
                true => take([f, g], witness),
                false => take([g, f], witness.swapped()),
            }
        }
    }
}

/// Whether points that a face of the surface was met at are not behind that face, but behind another one, or behind nothing.
fn too_deep(points: &[Hit], (a, pose): Placed, other: &Pose, thickness: f64) -> bool {
    let (mut mean, mut depth) = ([0.0; 3], 0.0);
    let share = 1.0 / points.len() as f64;
    let place = |hit: &Hit| match &hit.witness {
        Witness::Face { other: point, .. } => Some(pose.local_point(other.point(*point))),
        _ => None,
    };
    for (hit, place) in points.iter().filter_map(|hit| place(hit).map(|place| (hit, place))) {
        mean = add(mean, scale(share, place));
        depth -= share * hit.witness.place(pose, other, [0.0, 0.0, 1.0]).gap;
    }
    // In the middle of a face that goes round a corner, or a hole, another one may be near that few of the points are.
    let own = points[0].faces.1;
    depth > DEEP * thickness
        || (depth > SHALLOW * thickness
            && a.is_within(mean, NEARER[0] * depth)
            && a.another_is_near(own, points.iter().filter_map(place), depth))
}

/// The edges of two triangles, each of the pairs of a surface once.
fn edges((a, t): (&Surface, u32), (b, u): (&Surface, u32)) -> impl Iterator<Item = (u32, u32)> {
    // An edge belongs to the first of its triangles; where it is flat, or between triangles that look inwards, nothing is across it.
    let own = |s: &Surface, t: u32| {
        s.sides[t as usize].map(|e| {
            let (of, flat) = s.edges[e as usize];
            (of[0] == t && !flat).then_some(e)
        })
    };
    let (first, second) = (own(a, t), own(b, u));
    first.into_iter().flatten().flat_map(move |e| second.into_iter().flatten().map(move |f| (e, f)))
}

/// How two edges meet.
struct Across {
    witness: Witness,
    gap: f64,
    /// Each has sunk in behind the other, and a face of one is much nearer to the other than that.
    near_a_face: bool,
}

/// Two edges that cross, with their common normal.
fn across(
    (a, a_pose, e): (&Surface, &Pose, u32),
    (b, b_pose, f): (&Surface, &Pose, u32),
    (prediction, margin): (f64, f64),
    thickness: f64,
) -> Option<Across> {
    let (s, t) = (a.edge(e), b.edge(f));
    let (p, q) = (s.placed(a_pose), t.placed(b_pose));
    let (x, y) = closest(&p, &q);
    let inside = |x: f64| x > 0.0 && x < 1.0;
    let cross_within = inside(x) && inside(y);
    let d = sub(q.at(y), p.at(x));
    let most = if cross_within { prediction.max(DEEP * thickness) } else { margin };
    if norm(d) > most {
        return None;
    }
    // Edges that miss each other's ends meet where a valley begins there.
    let hollow = |s: &Surface, e: u32, x: f64| {
        inside(x) || s.hollows[s.ends(e)[usize::from(x > 0.5)] as usize]
    };
    if !(hollow(a, e, x) && hollow(b, f, y)) {
        return None;
    }
    let product = cross(p.d, q.d);
    let length = norm(product);
    if length <= PARALLEL * norm(p.d) * norm(q.d) {
        return None;
    }
    let of_both = |sign: &f64| {
        let n = scale(sign / length, product);
        a.has_normal(Feature::Edge(e), a_pose.local_direction(n))
            && b.has_normal(Feature::Edge(f), b_pose.local_direction(scale(-1.0, n)))
    };
    let sign = [1.0, -1.0].into_iter().find(of_both)?;
    let n = scale(sign / length, product);
    let gap = dot(n, d);
    if !cross_within {
        // Where the lines cross, each beyond the end of its edge perhaps.
        let across = sub(q.p, p.p);
        let x = dot(cross(across, q.d), product) / (length * length);
        let y = dot(cross(across, p.d), product) / (length * length);
        let below = |s: &Surface, pose: &Pose, e: u32, x: f64, there: Vec3, n: Vec3| {
            inside(x) || s.is_before(e, x > 0.5, pose.local_point(there), pose.local_direction(n))
        };
        if gap >= 0.0
            || !below(a, a_pose, e, x, q.at(y), n)
            || !below(b, b_pose, f, y, p.at(x), scale(-1.0, n))
        {
            return None;
        }
    }
    let near_a_face = -gap > SHALLOW * thickness
        && (a.is_within(a_pose.local_point(q.at(y)), -NEARER[1] * gap)
            || b.is_within(b_pose.local_point(p.at(x)), -NEARER[1] * gap));
    let witness = Witness::Edges { s, t, sign };
    (gap <= prediction).then_some(Across { witness, gap, near_a_face })
}

impl Surface {
    /// The vertices that an edge goes between.
    fn ends(&self, e: u32) -> [u32; 2] {
        let t = self.edges[e as usize].0[0] as usize;
        let k = self.sides[t].iter().position(|&s| s == e).unwrap_or(0);
        [k, k + 1].map(|i| self.triangles[t][i % 3])
    }

    /// An edge, in the frame of the body.
    fn edge(&self, e: u32) -> Segment {
        let [p, q] = self.ends(e).map(|v| self.vertices[v as usize]);
        Segment::between(p, q)
    }

    /// Whether a triangle ends at a valley.
    fn is_hollow(&self, t: u32) -> bool {
        self.triangles[t as usize].iter().any(|&v| self.hollows[v as usize])
    }

    /// Whether x, behind triangle t by at most `margin` and not below it, is nearest to the surface at a valley at its side, or at a corner of it.
    fn is_in_wedge(&self, t: u32, x: Vec3, margin: f64) -> bool {
        if self.is_over(t, x) {
            return false;
        }
        let depth = -self.height(t, x);
        let (k, s, far) = self.on_sides(t, x);
        if far > margin {
            return false;
        }
        let corner = |k: usize| self.triangles[t as usize][k % 3];
        let is_nearest_of_it = match s {
            0.0 | 1.0 => {
                let v = corner(if s == 0.0 { k } else { k + 1 });
                let from = sub(x, self.vertices[v as usize]);
                self.hollows[v as usize] && self.is_top(v, from, CONE * far)
            }
            _ => {
                let e = self.sides[t as usize][k];
                let from = sub(x, self.vertices[corner(k) as usize]);
                let beyond = |&u: &u32| {
                    let inwards = self.inwards(u, e);
                    dot(inwards, from) <= CONE * norm(inwards) * depth
                };
                self.valleys[e as usize] && self.edges[e as usize].0.iter().all(beyond)
            }
        };
        // Far behind it may be something else of the surface.
        is_nearest_of_it
            && self.foot(x).is_some_and(|f| f.far >= far * (1.0 - CONE) && f.is_below(x))
    }

    /// Whether the surface goes on from the end of an edge, its second one perhaps, in front of x, which is beyond that end and behind the edge along n.
    fn is_before(&self, e: u32, second: bool, x: Vec3, n: Vec3) -> bool {
        let at = |v: u32| self.vertices[v as usize];
        let [p, q] = self.ends(e);
        let (from, end) = if second { (p, q) } else { (q, p) };
        let along = sub(at(end), at(from));
        let rises = |&w: &u32| {
            let d = sub(at(w), at(end));
            dot(d, n) > 0.0 && dot(d, along) > 0.0 && dot(sub(x, at(end)), d) <= 0.0
        };
        self.around[end as usize].0.iter().any(rises)
    }

    /// Whether some triangle is nearer to x, in the frame of the body, than `radius`.
    fn is_within(&self, x: Vec3, radius: f64) -> bool {
        self.some_within(x, radius, |_| true)
    }

    /// Whether one plane face, not `own`, is nearer to all these points than `radius`.
    fn another_is_near(
        &self,
        own: u32,
        mut points: impl Iterator<Item = Vec3> + Clone,
        radius: f64,
    ) -> bool {
        points.next().is_some_and(|first| {
            self.some_within(first, radius, |t| {
                let face = self.faces[t as usize];
                let is_of_it = |t: u32| self.faces[t as usize] == face;
                face != own && points.clone().all(|x| self.some_within(x, radius, is_of_it))
            })
        })
    }

    /// Whether `which` is true of some triangle that is nearer to x than `radius`.
    fn some_within(&self, x: Vec3, radius: f64, which: impl Fn(u32) -> bool) -> bool {
        let mut stack = vec![0_u32];
        while let Some(k) = stack.pop() {
            let node = &self.tree[k as usize];
            let bounds = &node.bounds;
            let beyond: Vec3 =
                std::array::from_fn(|d| (bounds.low[d] - x[d]).max(x[d] - bounds.high[d]).max(0.0));
            if norm(beyond) >= radius {
                continue;
            }
            match node.count {
                0 => stack.extend([node.first, node.first + 1]),
                n => {
                    let own = &self.order[node.first as usize..(node.first + n) as usize];
                    if own.iter().any(|&t| self.distance(t, x) < radius && which(t)) {
                        return true;
                    }
                }
            }
        }
        false
    }

    /// The distance of x from a triangle.
    fn distance(&self, t: u32, x: Vec3) -> f64 {
        let corners = self.triangles[t as usize].map(|v| self.vertices[v as usize]);
        let n = self.normals[t as usize];
        let sides = [0, 1, 2].map(|k| (corners[k], corners[(k + 1) % 3]));
        if sides.iter().all(|&(p, q)| dot(cross(n, sub(q, p)), sub(x, p)) >= 0.0) {
            return dot(n, sub(x, corners[0])).abs();
        }
        let to = |(p, q): (Vec3, Vec3)| {
            let side = Segment::between(p, q);
            norm(sub(x, side.at(side.nearest(x))))
        };
        sides.into_iter().map(to).fold(f64::INFINITY, f64::min)
    }
}

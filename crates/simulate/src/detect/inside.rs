//! Solids that lie deep inside a closed mesh or below a heightfield, where no triangle says more by itself than that it is far.
//!
//! A body that moves farther in a step than it is large ends behind the surface as a whole, as it would behind a plane, and so does a point that has sunk by rounding. It touches then
//! along the normal of the plane face nearest to its middle, however deep, so that it goes no deeper. The nearest point of the surface tells the side: the mean of the normals there, each by the angle
//! of its triangle, points outwards from it exactly if it is seen from outside.
//!
//! In a valley a body that one side meets may go on behind the other: what of it is lowest along the normals near it is looked for, too, where it is deeper inside than all that was met.
//!
//! References: BaerentzenAanaes2005.
//! Cost: O(log n), a ray through the tree of triangles for a solid that is near none of them, and a descent to the nearest one where that meets something.

use nonsmooth_scenes::vec3::{Vec3, add, cross, dot, norm, scale, sub};

use crate::detect::broad::Aabb;
use crate::detect::clip::Clip;
use crate::detect::convex::{Meeting, Side, climbed, measured};
use crate::detect::gjk::closest;
use crate::detect::segments::Segment;
use crate::detect::surface::{CONE, NONE, Scratch, Surface, Thin};
use crate::detect::witness::{Anchor, Feature, Witness};
use crate::rotation::Pose;

/// Feet nearer to each other than this share of the surface's size are one.
const SAME: f64 = 1e-9;
/// The number of a tip of a round solid.
const TIP: u32 = 1 << 19;

/// The point of a surface that is nearest to a given one.
pub(super) struct Foot {
    pub far: f64,
    pub at: Vec3,
    /// The triangle at it whose plane is farthest from the given point, and how far in front of that it is.
    pub triangle: u32,
    pub height: f64,
    /// The normals of the triangles at it, each by its angle.
    outwards: Vec3,
    /// Whether it is in the inner of a triangle, and whether at an edge with a triangle on one side only.
    within: bool,
    on_border: bool,
}

impl Foot {
    pub fn is_below(&self, x: Vec3) -> bool {
        match self.within {
            true => self.height < 0.0,
            false => !self.on_border && dot(self.outwards, sub(x, self.at)) < 0.0,
        }
    }
}

impl Surface {
    /// The points where a solid touches that overlaps the surface and that no triangle has met where it is deepest; `bounds` is the box of the solid, in the world. With `is_cut`
    /// triangles are near it, and none has met it where it overlaps the surface.
    pub(super) fn catch(
        &self,
        (pose, other, bounds): (&Pose, &Side, &Aabb),
        is_cut: bool,
        prediction: f64,
        (clip, scratch): (&mut Clip, &mut Scratch),
        found: &mut impl FnMut([Feature; 2], Witness),
    ) {
        let middle = pose.local_point(other.middle());
        if scratch.near.is_empty() && !self.may_hold(middle) {
            return;
        }
        let Some(foot) = self.foot(middle) else { return };
        let is_below = foot.is_below(middle);
        if let Side::Rod { local, world, radius, .. } = other
            && world.d == [0.0; 3]
        {
            if is_below {
                self.ball_on(foot.triangle, false, (local.p, middle, *radius), found);
            }
            return;
        }
        let mut near = std::mem::take(&mut scratch.near);
        let mut caught = false;
        // Above the surface the way from the middle to a point of the solid behind the triangle leads through that.
        if is_below || foot.within {
            let reach = foot.far + other.size();
            self.near(pose, &bounds.grown(reach), &mut near);
            let face = self.faces[foot.triangle as usize];
            for &t in near.iter().filter(|&&t| self.faces[t as usize] == face) {
                self.template(t, pose, &mut scratch.thin);
                let Thin { hull, posed } = &scratch.thin;
                let both = ((hull, posed, pose), other);
                self.on_triangle((t, 0), both, prediction, clip, |features, witness| {
                    caught = true;
                    found(features, witness);
                });
            }
        }
        if is_cut && !caught {
            let outwards = match foot.within {
                true => self.normals[foot.triangle as usize],
                false if is_below => foot.outwards,
                false => sub(middle, foot.at),
            };
            self.near(pose, bounds, &mut near);
            self.cut((pose, other), &near, outwards, found);
        }
        scratch.near = near;
    }

    /// The points of a solid, lowest along the normals of triangles near it, that are deeper inside the surface than `depth`: in a valley what is met at one side may go on behind
    /// the other. They are met by the plane face nearest to them.
    pub(super) fn tips(
        &self,
        (pose, other): (&Pose, &Side),
        depth: f64,
        near: &[u32],
        found: &mut impl FnMut([Feature; 2], Witness),
    ) {
        if matches!(other, Side::Rod { world, .. } if world.is_point()) {
            return;
        }
        let mut last = NONE;
        for &t in near {
            if std::mem::replace(&mut last, self.faces[t as usize]) == self.faces[t as usize] {
                continue;
            }
            let n = pose.direction(self.normals[t as usize]);
            let x = pose.local_point(other.lowest(n));
            if self.height(t, x) >= -depth {
                continue;
            }
            let Some(foot) = self.foot(x).filter(|f| f.far > depth && f.is_below(x)) else {
                continue;
            };
            let tip = other.support(scale(-1.0, n));
            let own = match other {
                Side::Hull { posed, .. } => {
                    let k = posed.vertices.iter().position(|&v| v == tip).unwrap_or(0);
                    Feature::Vertex(k as u32)
                }
                _ => Feature::Curved(TIP),
            };
            let (radius, tip) = (other.radius(), other.pose().local_point(tip));
            let (face, witness) = self.behind(&foot, x, tip, radius);
            found([face, own], witness);
        }
    }

    /// The contact of a point of another body with the plane face at its foot, or along the way there; x is the point, in the frame of the surface, and `other`, in its own frame, what it is
    /// the end of by `radius`.
    pub(super) fn behind(
        &self,
        foot: &Foot,
        x: Vec3,
        other: Vec3,
        radius: f64,
    ) -> (Feature, Witness) {
        let t = foot.triangle;
        let (normal, foot) = match foot.height < 0.0 {
            true => {
                let n = self.normals[t as usize];
                (n, sub(x, scale(foot.height, n)))
            }
            false => (scale(1.0 / foot.far, sub(foot.at, x)), foot.at),
        };
        let anchor = Anchor::Other;
        let witness = Witness::Face { on_a: true, normal, other, foot, radius, anchor };
        (self.named(t, Feature::Face(0)), witness)
    }

    /// The point where a solid touches that triangles cut without a normal of the surface: where many thin ones meet, each is separated best along itself. All that are near together
    /// separate along a normal that a climb finds, which begins outwards, a direction in the frame of the body.
    fn cut(
        &self,
        (pose, other): (&Pose, &Side),
        near: &[u32],
        outwards: Vec3,
        found: &mut impl FnMut([Feature; 2], Witness),
    ) {
        let at = |v: u32| self.vertices[v as usize];
        let top = |corners: &mut dyn Iterator<Item = u32>, d: Vec3| {
            corners.max_by(|&v, &w| dot(d, at(v)).total_cmp(&dot(d, at(w)))).unwrap_or(0)
        };
        let size = other.size().min(self.size);
        let overlaps = |&t: &u32| {
            let corners = self.triangles[t as usize];
            let highest =
                |d| pose.point(at(top(&mut corners.into_iter(), pose.local_direction(d))));
            let start = sub(other.middle(), pose.point(at(corners[0])));
            let c = closest(highest, |d| other.support(d), start, size);
            c.is_none_or(|c| c.distance < other.radius())
        };
        if norm(outwards) == 0.0 || !near.iter().any(overlaps) {
            return;
        }
        let corners = || near.iter().flat_map(|&t| self.triangles[t as usize]);
        let highest = |d| pose.point(at(top(&mut corners(), pose.local_direction(d))));
        let n = pose.direction(scale(1.0 / norm(outwards), outwards));
        let Meeting { normal: n, on, .. } =
            climbed(highest, other, measured(highest, other, n), size);
        let normal = pose.local_direction(n);
        let v = top(&mut corners(), normal);
        if self.is_top(v, normal, CONE) {
            let [s, t] = [on[0], sub(on[1], scale(other.radius(), n))];
            let (s, t) = (pose.local_point(s), other.pose().local_point(t));
            let witness = Witness::Points { s, t, normal, on_a: true };
            found([Feature::Vertex(v), Feature::Curved(4)], witness);
        }
    }

    /// False where x, in the frame of the body, is not inside: then a ray from there meets nothing. It goes up from below a heightfield, and else to the nearest side of the box about the mesh.
    pub(super) fn may_hold(&self, x: Vec3) -> bool {
        let mut ray = [0.0; 3];
        if let Some(below) = self.below {
            ray = scale(-1.0, below);
        } else {
            let Aabb { low, high } = self.tree[0].bounds;
            let ways = (0..3).flat_map(|k| [(x[k] - low[k], k, -1.0), (high[k] - x[k], k, 1.0)]);
            let Some((_, k, sign)) = ways.min_by(|a, b| a.0.total_cmp(&b.0)) else { return true };
            ray[k] = sign;
        }
        let mut stack = vec![0_u32];
        while let Some(k) = stack.pop() {
            let node = &self.tree[k as usize];
            if node.bounds.is_on(x, ray, SAME * self.size) {
                if node.count > 0 {
                    return true;
                }
                stack.extend([node.first, node.first + 1]);
            }
        }
        false
    }

    /// The point of the surface that is nearest to x, in the frame of the body.
    pub(super) fn foot(&self, x: Vec3) -> Option<Foot> {
        let same = SAME * self.size;
        let mut best: Option<Foot> = None;
        let mut stack = vec![(0.0, 0_u32)];
        while let Some((far, k)) = stack.pop() {
            if best.as_ref().is_some_and(|b| far > b.far + same) {
                continue;
            }
            let node = &self.tree[k as usize];
            if node.count > 0 {
                for &t in &self.order[node.first as usize..(node.first + node.count) as usize] {
                    self.compare(t, x, same, &mut best);
                }
                continue;
            }
            let mut children = [node.first, node.first + 1]
                .map(|child| (self.tree[child as usize].bounds.distance(x), child));
            // The nearer one comes first off the stack.
            children.sort_by(|a, b| b.0.total_cmp(&a.0));
            stack.extend(children);
        }
        best
    }

    /// Takes triangle t for the nearest one, or adds its normal where it has the same foot.
    fn compare(&self, t: u32, x: Vec3, same: f64, best: &mut Option<Foot>) {
        let n = self.normals[t as usize];
        let height = self.height(t, x);
        let border = |k: usize| self.edges[self.sides[t as usize][k] as usize].0[1] == NONE;
        let within = self.is_over(t, x);
        let (at, on_border, angle) = if within {
            (sub(x, scale(height, n)), false, 0.0)
        } else {
            let (k, s, _) = self.on_sides(t, x);
            let [p, q] =
                [k, (k + 1) % 3].map(|i| self.vertices[self.triangles[t as usize][i] as usize]);
            // At a corner two sides of the triangle end, of which either may be a border.
            let (on_border, angle) = match s {
                0.0 => (border(k) || border((k + 2) % 3), self.angle(t, k)),
                1.0 => (border(k) || border((k + 1) % 3), self.angle(t, (k + 1) % 3)),
                _ => (border(k), std::f64::consts::PI),
            };
            (Segment::between(p, q).at(s), on_border, angle)
        };
        let far = norm(sub(x, at));
        let outwards = scale(angle, n);
        match best {
            Some(b) if far > b.far + same => {}
            Some(b) if !within && !b.within && norm(sub(at, b.at)) <= same => {
                b.outwards = add(b.outwards, outwards);
                b.on_border |= on_border;
                if height.abs() > b.height.abs() {
                    (b.triangle, b.height) = (t, height);
                }
            }
            Some(b) if far >= b.far => {}
            _ => *best = Some(Foot { far, at, triangle: t, height, outwards, within, on_border }),
        }
    }

    /// The angle of triangle t at its corner k.
    fn angle(&self, t: u32, k: usize) -> f64 {
        let corner = |i: usize| self.vertices[self.triangles[t as usize][i % 3] as usize];
        let (u, v) = (sub(corner(k + 1), corner(k)), sub(corner(k + 2), corner(k)));
        norm(cross(u, v)).atan2(dot(u, v))
    }
}

//! Solids of revolution: cylinders and cones, as frusta of which one radius may be zero.

use nonsmooth_scenes::vec3::{Vec3, add, cross, dot, norm, scale, sub};

use crate::detect::witness::{Feature, Witness};
use crate::rotation::Pose;

/// Points at fixed angles of the body on which a flat end stands, besides the lowest one.
pub(crate) const STANDING: usize = 8;
/// Ends that are inclined by less have no lowest point.
pub(crate) const LEVEL: f64 = 1e-6;

/// `{c + z a + ρ : |z| ≤ half, ‖ρ‖ ≤ r(z)}`, ρ across the axis a, r linear from `radii[0]` at z = −half to `radii[1]` at z = half.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Turned {
    pub centre: Vec3,
    /// Of length 1.
    pub axis: Vec3,
    /// Across the axis, of length 1, where angles begin.
    pub side: Vec3,
    pub half: f64,
    pub radii: [f64; 2],
}

impl Turned {
    /// About the third axis of a frame.
    pub fn new(pose: &Pose, half: f64, radii: [f64; 2]) -> Self {
        let axis = |d: usize| std::array::from_fn(|k| pose.r[k][d]);
        Self { centre: pose.x, axis: axis(2), side: axis(0), half, radii }
    }

    pub fn size(&self) -> f64 {
        self.half.hypot(self.radii[0].max(self.radii[1]))
    }

    pub fn placed(&self, pose: &Pose) -> Self {
        Self {
            centre: pose.point(self.centre),
            axis: pose.direction(self.axis),
            side: pose.direction(self.side),
            ..*self
        }
    }

    /// The centre of end k.
    pub fn end(&self, k: usize) -> Vec3 {
        add(self.centre, scale(if k == 0 { -self.half } else { self.half }, self.axis))
    }

    /// The outward normal of end k.
    pub fn outwards(&self, k: usize) -> Vec3 {
        scale(if k == 0 { -1.0 } else { 1.0 }, self.axis)
    }

    /// The direction across the axis that goes farthest along d, and how far d is from the axis: the sine of the angle for a d of length 1.
    pub fn across(&self, d: Vec3) -> (Vec3, f64) {
        let rest = sub(d, scale(dot(d, self.axis), self.axis));
        let length = norm(rest);
        if length > 1e-12 * norm(d) {
            (scale(1.0 / length, rest), length)
        } else {
            (self.side, 0.0)
        }
    }

    /// A point farthest along d.
    pub fn support(&self, d: Vec3) -> Vec3 {
        let (out, sine) = self.across(d);
        let along = self.half * dot(d, self.axis);
        let upper = along + self.radii[1] * sine >= -along + self.radii[0] * sine;
        let k = usize::from(upper);
        add(self.end(k), scale(self.radii[k], out))
    }

    /// Point `i` of those on which end k stands.
    pub fn standing(&self, k: usize, i: usize) -> Vec3 {
        let (s, c) = (std::f64::consts::TAU * i as f64 / STANDING as f64).sin_cos();
        let out = add(scale(c, self.side), scale(s, cross(self.axis, self.side)));
        add(self.end(k), scale(self.radii[k], out))
    }

    /// Whether direction d leaves the mantle at a right angle, up to `angle`.
    pub fn is_mantle(&self, d: Vec3, angle: f64) -> bool {
        norm(sub(d, self.mantle(self.across(d).0))) < angle
    }

    /// The normal of the mantle on the side of `out`, a direction across the axis.
    pub fn mantle(&self, out: Vec3) -> Vec3 {
        let fall = self.radii[0] - self.radii[1];
        let length = fall.hypot(2.0 * self.half);
        add(scale(2.0 * self.half / length, out), scale(fall / length, self.axis))
    }

    /// The three lines in the half plane (ρ, z) that make its surface: the ends and the mantle.
    fn profile(&self) -> [[[f64; 2]; 2]; 3] {
        let ([r, s], h) = (self.radii, self.half);
        [[[0.0, -h], [r, -h]], [[r, -h], [s, h]], [[s, h], [0.0, h]]]
    }

    /// The line of the profile that is nearest to a point (ρ, z). The profile is convex: a point is outside if it is before one of its lines, and then one of these is
    /// nearest; else it is inside, and least deep behind the nearest line. Two lines that meet at an end are equally near there, but the point is before one of them perhaps.
    fn nearest(&self, x: [f64; 2]) -> usize {
        let profile = self.profile();
        // An end without radius is no surface.
        let lines = || profile.iter().enumerate().filter(|(_, line)| line[0] != line[1]);
        let outside = lines().filter(|(_, line)| height(line, x) > 0.0);
        let before = outside.min_by(|(_, l), (_, m)| beside(l, x).0.total_cmp(&beside(m, x).0));
        let inside = || lines().max_by(|(_, l), (_, m)| height(l, x).total_cmp(&height(m, x)));
        before.or_else(inside).map_or(0, |(k, _)| k)
    }
}

/// A ball, its centre in the frame of its body and where it is: the line of the profile that is nearest, from inside the one that is least deep.
pub(crate) fn ball(
    (centre, at, radius): (Vec3, Vec3, f64),
    (local, world): (&Turned, &Turned),
    on_a: bool,
    mut found: impl FnMut([Feature; 2], Witness),
) {
    let d = sub(at, world.centre);
    let z = dot(d, world.axis);
    let rho = norm(sub(d, scale(z, world.axis)));
    let line = world.nearest([rho, z]);
    let witness = Witness::Revolved {
        on_a,
        centre: local.centre,
        axis: local.axis,
        side: local.side,
        line: local.profile()[line],
        ball: centre,
        radius,
    };
    let pair = [Feature::Curved(line as u32), Feature::Curved(0)];
    found(if on_a { pair } else { [pair[1], pair[0]] }, witness);
}

/// The signed distance of a point of the half plane from a line of a profile whose outside is on its right, and its gradient. The line is one that [`Turned::nearest`]
/// gives: what is nearest to an end of that is outside, also behind the line, as at the rim of a cone, where the profile turns by more than a right angle.
pub(crate) fn beside([p, q]: &[[f64; 2]; 2], x: [f64; 2]) -> (f64, [f64; 2]) {
    let (u, v) = ([q[0] - p[0], q[1] - p[1]], [x[0] - p[0], x[1] - p[1]]);
    let length = u[0].hypot(u[1]);
    let outwards = [u[1] / length, -u[0] / length];
    let t = (u[0] * v[0] + u[1] * v[1]) / (length * length);
    if (0.0..=1.0).contains(&t) {
        return (outwards[0] * v[0] + outwards[1] * v[1], outwards);
    }
    let end = if t < 0.0 { p } else { q };
    let w = [x[0] - end[0], x[1] - end[1]];
    let distance = w[0].hypot(w[1]);
    if distance == 0.0 {
        return (0.0, outwards);
    }
    (distance, w.map(|x| x / distance))
}

/// How far a point of the half plane is on the right of a line of a profile.
fn height([p, q]: &[[f64; 2]; 2], x: [f64; 2]) -> f64 {
    let (u, v) = ([q[0] - p[0], q[1] - p[1]], [x[0] - p[0], x[1] - p[1]]);
    (u[1] * v[0] - u[0] * v[1]) / u[0].hypot(u[1])
}

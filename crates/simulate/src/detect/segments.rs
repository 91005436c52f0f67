//! Closest points of segments; a point is a segment without length.

use nonsmooth_scenes::vec3::{Vec3, add, dot, scale, sub};

/// `p + t d`, `0 ≤ t ≤ 1`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Segment {
    pub p: Vec3,
    pub d: Vec3,
}

impl Segment {
    pub fn point(p: Vec3) -> Self {
        Self { p, d: [0.0; 3] }
    }

    pub fn between(p: Vec3, q: Vec3) -> Self {
        Self { p, d: sub(q, p) }
    }

    pub fn is_point(&self) -> bool {
        self.d == [0.0; 3]
    }

    #[inline]
    pub fn at(&self, t: f64) -> Vec3 {
        add(self.p, scale(t, self.d))
    }

    /// The parameter of the point nearest to x.
    pub fn nearest(&self, x: Vec3) -> f64 {
        let length = dot(self.d, self.d);
        if length > 0.0 { (dot(sub(x, self.p), self.d) / length).clamp(0.0, 1.0) } else { 0.0 }
    }
}

/// The parameters of the closest points of two segments (of parallel ones, of some of them).
pub(crate) fn closest(s: &Segment, t: &Segment) -> (f64, f64) {
    let r = sub(s.p, t.p);
    let (a, e) = (dot(s.d, s.d), dot(t.d, t.d));
    if a == 0.0 {
        return (0.0, t.nearest(s.p));
    }
    if e == 0.0 {
        return (s.nearest(t.p), 0.0);
    }
    let (b, c, f) = (dot(s.d, t.d), dot(s.d, r), dot(t.d, r));
    let denominator = a * e - b * b;
    let x = match denominator > 1e-12 * a * e {
        true => ((b * f - c * e) / denominator).clamp(0.0, 1.0),
        false => 0.0,
    };
    let y = (b * x + f) / e;
    if y < 0.0 {
        ((-c / a).clamp(0.0, 1.0), 0.0)
    } else if y > 1.0 {
        (((b - c) / a).clamp(0.0, 1.0), 1.0)
    } else {
        (x, y)
    }
}

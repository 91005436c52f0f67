//! Perspective.

use crate::SceneError;
use crate::error::require;
use crate::vec3::{Vec3, Z, add, cross, dot, normalise, scale, sub};

/// Where a scene is seen from.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct View {
    /// Direction of the eye around the vertical, degrees from the x axis.
    pub azimuth: f64,
    /// Height of the eye, degrees above the horizon.
    pub elevation: f64,
    /// Distance of the eye from the centre, in radii of the scene; large for a parallel projection.
    pub distance: f64,
}

impl Default for View {
    fn default() -> Self {
        Self { azimuth: -60.0, elevation: 20.0, distance: 5.0 }
    }
}

impl View {
    pub(super) fn validate(&self) -> Result<(), SceneError> {
        require("azimuth", self.azimuth, true, "an angle in degrees")?;
        let e = self.elevation;
        require("elevation", e, e.abs() <= 89.0, "an angle from -89 to 89 degrees")?;
        let d = self.distance;
        require("distance", d, (1.5..=1e4).contains(&d), "a number from 1.5 to 10000")
    }
}

/// The map from space to the picture.
pub(super) struct Camera {
    /// Where the eye is.
    pub eye: Vec3,
    right: Vec3,
    up: Vec3,
    forward: Vec3,
    distance: f64,
    /// Pixels for a metre at the centre.
    scale: f64,
    origin: [f64; 2],
}

impl Camera {
    pub fn new(view: &View, centre: Vec3, radius: f64) -> Self {
        let (sa, ca) = view.azimuth.to_radians().sin_cos();
        let (se, ce) = view.elevation.to_radians().sin_cos();
        let out = [ce * ca, ce * sa, se];
        let distance = view.distance * radius;
        let forward = scale(-1.0, out);
        let right = normalise(cross(forward, Z));
        let eye = add(centre, scale(distance, out));
        let up = cross(right, forward);
        Self { eye, right, up, forward, distance, scale: 1.0, origin: [0.0; 2] }
    }

    /// The direction to the light: from above, over the left shoulder.
    pub fn light(&self) -> Vec3 {
        let back = cross(self.right, Z);
        normalise(add(scale(-0.5, self.right), add(scale(0.35, back), Z)))
    }

    /// The place in the picture, px.
    pub fn project(&self, p: Vec3) -> [f64; 2] {
        let (d, k) = (sub(p, self.eye), self.magnification(p));
        [self.origin[0] + k * dot(d, self.right), self.origin[1] - k * dot(d, self.up)]
    }

    /// Pixels for a metre across the line of sight at `p`.
    pub fn magnification(&self, p: Vec3) -> f64 {
        // Points beside or behind the eye, in no sensible view, stay finite.
        self.scale * self.distance / self.depth(p).max(0.05 * self.distance)
    }

    /// The distance along the line of sight.
    pub fn depth(&self, p: Vec3) -> f64 {
        dot(sub(p, self.eye), self.forward)
    }

    /// Scales and shifts so that `points` fill `width` but for `margin`; returns the height that they need.
    pub fn fit(&mut self, points: &[Vec3], width: f64, margin: f64) -> f64 {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for &p in points {
            let at = self.project(p);
            for k in 0..2 {
                low[k] = low[k].min(at[k]);
                high[k] = high[k].max(at[k]);
            }
        }
        // A tall scene is kept as high as wide.
        let inner = (width - 2.0 * margin).max(1.0);
        let size = [high[0] - low[0], high[1] - low[1]];
        let s = inner / size[0].max(size[1]);
        self.scale *= s;
        self.origin = [0.5 * (width - s * (low[0] + high[0])), margin - s * low[1]];
        s * size[1] + 2.0 * margin
    }
}

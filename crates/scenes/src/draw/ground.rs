//! The ground: a plane with a grid and the shadows of the solids.

use super::camera::Camera;
use super::order::Solid;
use super::paper::Paper;
use crate::Ground;
use crate::vec3::{Vec3, add, cross, dot, normalise, scale, sub};

/// The piece of ground below the scene, in lines of a grid.
pub(super) struct Floor {
    origin: Vec3,
    normal: Vec3,
    axes: [Vec3; 2],
    /// The first and last line along each axis.
    lines: [[i64; 2]; 2],
    step: f64,
}

impl Floor {
    pub fn new(ground: &Ground, solids: &[Solid], light: Vec3) -> Self {
        let normal = normalise(ground.normal);
        let along = sub(ground.along, scale(dot(ground.along, normal), normal));
        let along = normalise(along);
        let axes = [along, cross(normal, along)];
        let mut floor = Self { origin: ground.point, normal, axes, lines: [[0; 2]; 2], step: 1.0 };
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for p in solids.iter().flat_map(|s| s.hull()) {
            for at in [floor.coordinates(p), floor.coordinates(floor.shadow(p, light))] {
                for k in 0..2 {
                    low[k] = low[k].min(at[k]);
                    high[k] = high[k].max(at[k]);
                }
            }
        }
        let size = (high[0] - low[0]).max(high[1] - low[1]);
        floor.step = round_step(size / 9.0);
        let margin = 0.08 * size;
        for k in 0..2 {
            floor.lines[k] = [
                ((low[k] - margin) / floor.step).floor() as i64,
                ((high[k] + margin) / floor.step).ceil() as i64,
            ];
        }
        floor
    }

    pub fn corners(&self) -> [Vec3; 4] {
        let [[a, b], [c, d]] = self.lines.map(|l| l.map(|k| k as f64));
        [[a, c], [b, c], [b, d], [a, d]].map(|at| self.at(at[0] * self.step, at[1] * self.step))
    }

    pub fn draw(&self, solids: &[Solid], light: Vec3, camera: &Camera, paper: &mut Paper) {
        paper.open(r##"fill="#7f8a96" fill-opacity="0.10" stroke="none""##);
        paper.polygon(self.corners().map(|p| camera.project(p)).into_iter());
        paper.close();
        paper.open(r##"stroke="#7f8a96" stroke-opacity="0.32" stroke-width="0.7""##);
        let [u, v] = self.lines.map(|l| l.map(|k| k as f64 * self.step));
        for k in self.lines[0][0]..=self.lines[0][1] {
            let x = k as f64 * self.step;
            paper.line(camera.project(self.at(x, v[0])), camera.project(self.at(x, v[1])));
        }
        for k in self.lines[1][0]..=self.lines[1][1] {
            let y = k as f64 * self.step;
            paper.line(camera.project(self.at(u[0], y)), camera.project(self.at(u[1], y)));
        }
        paper.close();
        // The opacity is that of the group, so that shadows do not add up where they overlap.
        paper.open(r##"fill="#20262d" stroke="none" opacity="0.22""##);
        for solid in solids {
            let outline = solid.silhouette(light).into_iter();
            let shadow = outline.map(|p| self.coordinates(self.shadow(p, light))).collect();
            let hull = convex_hull(shadow).into_iter();
            paper.polygon(hull.map(|[x, y]| camera.project(self.at(x, y))));
        }
        paper.close();
    }

    fn at(&self, x: f64, y: f64) -> Vec3 {
        add(self.origin, add(scale(x, self.axes[0]), scale(y, self.axes[1])))
    }

    fn coordinates(&self, p: Vec3) -> [f64; 2] {
        self.axes.map(|axis| dot(axis, sub(p, self.origin)))
    }

    /// Where the shadow of `p` falls; below `p` where the light grazes the ground or comes from below.
    fn shadow(&self, p: Vec3, light: Vec3) -> Vec3 {
        let height = dot(self.normal, sub(p, self.origin));
        let sine = dot(self.normal, light);
        if sine > 0.2 {
            sub(p, scale(height / sine, light))
        } else {
            sub(p, scale(height, self.normal))
        }
    }
}

/// The largest of 1, 2, 5 × 10ᵏ up to `x`.
fn round_step(x: f64) -> f64 {
    let decade = 10.0_f64.powf(x.log10().floor());
    [5.0, 2.0].into_iter().find(|s| s * decade <= x).unwrap_or(1.0) * decade
}

/// The convex hull of points of the plane, counter-clockwise (monotone chain).
fn convex_hull(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let left = |o: [f64; 2], a: [f64; 2], b: [f64; 2]| {
        (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]) > 0.0
    };
    let chain = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut out: Vec<[f64; 2]> = Vec::new();
        for p in points {
            while out.len() > 1 && !left(out[out.len() - 2], out[out.len() - 1], p) {
                out.pop();
            }
            out.push(p);
        }
        out.pop();
        out
    };
    let mut hull = chain(&mut points.iter().copied());
    hull.extend(chain(&mut points.iter().rev().copied()));
    hull
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_of_the_grid_are_round() {
        for (x, step) in [(1.0, 1.0), (0.34, 0.2), (7.0, 5.0), (0.0019, 0.001), (23.0, 20.0)] {
            assert!((round_step(x) - step).abs() < 1e-12 * step, "{x}");
        }
    }

    #[test]
    fn the_hull_drops_inner_points() {
        let points = vec![[0.0, 0.0], [2.0, 0.0], [1.0, 0.5], [2.0, 2.0], [0.0, 2.0], [1.0, 0.0]];
        assert_eq!(convex_hull(points), [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]);
    }
}

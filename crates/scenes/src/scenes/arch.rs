//! A semicircular masonry arch.

use super::{Family, Spread, count};
use crate::error::positive;
use crate::polyhedron::Polyhedron;
use crate::vec3::Vec3;
use crate::{RigidBody, Scene, SceneError, Shape};

settings! {
    /// A semicircular arch of equal voussoirs between two fixed abutments, under its own weight: four contacts at
    /// the corners of each joint. Under self weight it can stand only if `thickness` exceeds about a tenth of the
    /// mean radius and `mu` about 0.3.
    Arch {
        /// Number of voussoirs.
        blocks: usize = 15,
        /// Inner radius, m.
        radius: f64 = 2.0,
        /// Radial thickness, m.
        thickness: f64 = 0.5,
        /// Depth along the axis of the arch, m.
        depth: f64 = 0.8,
    }
}

impl Family for Arch {
    const NAME: &'static str = "arch";
    const SUMMARY: &'static str = "a semicircular arch of voussoirs between abutments";

    fn build(&self) -> Result<Scene, SceneError> {
        let common = self.common();
        let mut scene = common.scene(Self::NAME)?;
        // The flat outer face of one or two voussoirs would cut the opening.
        count("blocks", self.blocks, 3..=10_000)?;
        positive("radius", self.radius)?;
        positive("thickness", self.thickness)?;
        positive("depth", self.depth)?;

        // Springings at height `foot`, on the abutments; joint i at the angle i π / blocks from the x axis.
        let foot = 0.3 * self.radius;
        let outer = self.radius + self.thickness;
        let joint = |i: usize| {
            let angle = std::f64::consts::PI * i as f64 / self.blocks as f64;
            // The last joint is the mirror image of the first, without the rounding of π.
            let (sin, cos) = if i == self.blocks { (0.0, -1.0) } else { angle.sin_cos() };
            let at = move |r: f64, y: f64| [r * cos, y, foot + r * sin];
            ([-sin, 0.0, cos], at)
        };
        let near = -0.5 * self.depth;
        let extruded = |base: &[Vec3]| Polyhedron::prism(base, [0.0, self.depth, 0.0]);
        for i in 0..self.blocks {
            let ((_, from), (_, to)) = (joint(i), joint(i + 1));
            let base = [
                from(self.radius, near),
                from(outer, near),
                to(outer, near),
                to(self.radius, near),
            ];
            scene.push(RigidBody::solid(Shape::Polyhedron(extruded(&base)?), self.density)?);
        }
        for i in 0..=self.blocks {
            let (normal, at) = joint(i);
            // The last joint is seen from the other side: the ground comes first.
            let (a, b, normal) = match i {
                0 => (None, 0, normal),
                i if i == self.blocks => (None, i - 1, normal.map(|x| -x)),
                i => (Some(i - 1), i, normal),
            };
            for (r, y) in [(self.radius, near), (outer, near), (outer, -near), (self.radius, -near)]
            {
                scene.contacts.push(common.contact(a, b, at(r, y), normal));
            }
        }
        // Abutments a little wider than the springings, drawn only.
        let margin = 0.2 * self.thickness;
        let near = near - margin;
        for side in [1.0, -1.0] {
            let (x0, x1) = (side * (self.radius - margin), side * (outer + 3.0 * margin));
            let base = [[x0, near, 0.0], [x1, near, 0.0], [x1, near, foot], [x0, near, foot]];
            scene.obstacles.push(Polyhedron::prism(&base, [0.0, -2.0 * near, 0.0])?.into());
        }
        common.finish(scene, Spread::Random)
    }
}

//! A tower of planks.

use super::{Family, Spread, count, crosswise};
use crate::error::{positive, require};
use crate::vec3::{Z, rectangle};
use crate::{RigidBody, Scene, SceneError, Shape};

settings! {
    /// Planks lie in layers whose direction alternates between x and y, spread over the length of a plank, so that each
    /// plank crosses all of the next layer: four contacts at each crossing, and four below each plank of the lowest layer.
    /// With m planks a layer the contact density tends to 2m.
    Kapla {
        /// Number of layers.
        layers: usize = 10,
        /// Planks in a layer.
        planks: usize = 2,
        /// Length of a plank, m; `planks` widths or more.
        length: f64 = 0.12,
        /// Width of a plank, m.
        width: f64 = 0.024,
        /// Thickness of a plank, m.
        thickness: f64 = 0.008,
    } with {
        density: 600.0,
    }
}

impl Family for Kapla {
    const NAME: &'static str = "kapla";
    const SUMMARY: &'static str = "a tower of planks, layers crosswise";

    fn build(&self) -> Result<Scene, SceneError> {
        let common = self.common();
        let mut scene = common.scene(Self::NAME)?;
        count("layers", self.layers, 1..=10_000)?;
        count("planks", self.planks, 1..=100)?;
        positive("width", self.width)?;
        positive("thickness", self.thickness)?;
        let (length, full) = (self.length, self.width * self.planks as f64);
        require("length", length, length >= full, "a length of at least `planks` widths")?;

        // Vectors are stated for a layer along x.
        let half = [0.5 * length, 0.5 * self.width, 0.5 * self.thickness];
        // A single plank lies in the middle, the outer ones of several flush with the ends of those below.
        let gaps = (self.planks.max(2) - 1) as f64;
        let across = |k: usize| match self.planks {
            1 => 0.0,
            _ => (length - self.width) * (k as f64 / gaps - 0.5),
        };
        for layer in 0..self.layers {
            let bottom = self.thickness * layer as f64;
            for k in 0..self.planks {
                let shape = Shape::Box { half: crosswise(layer, half) };
                let at = crosswise(layer, [0.0, across(k), bottom + half[2]]);
                let body = scene.push(RigidBody::solid(shape, self.density)?.at(at));
                if layer == 0 {
                    let foot = crosswise(layer, [0.0, across(k), 0.0]);
                    for p in rectangle(foot, [half[0], 0.0, 0.0], [0.0, half[1], 0.0]) {
                        scene.contacts.push(common.contact(None, body, p, Z));
                    }
                    continue;
                }
                for below in 0..self.planks {
                    let a = (layer - 1) * self.planks + below;
                    let crossing = crosswise(layer, [across(below), across(k), bottom]);
                    for p in rectangle(crossing, [half[1], 0.0, 0.0], [0.0, half[1], 0.0]) {
                        scene.contacts.push(common.contact(Some(a), body, p, Z));
                    }
                }
            }
        }
        common.finish(scene, Spread::Random)
    }
}

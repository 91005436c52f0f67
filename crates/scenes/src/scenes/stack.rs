//! A tower of boxes.

use super::{Family, Spread, count};
use crate::error::{positive, require};
use crate::vec3::{Z, rectangle};
use crate::{RigidBody, Scene, SceneError, Shape};

settings! {
    /// Boxes on each other on the ground, four contacts for each interface. `mass_ratio` is that of the top box to the
    /// bottom box; far from 1 it makes the problem ill conditioned. A kick makes one box slide under its load.
    Stack {
        /// Number of boxes.
        count: usize = 5,
        /// Horizontal sides of a box, m.
        width: f64 = 1.0,
        /// Vertical side of a box, m.
        height: f64 = 0.6,
        /// Horizontal velocity of the box that is kicked, m/s.
        kick: f64 = 0.0,
        /// The box that is kicked, 1 at the bottom.
        kicked: usize = 1,
    }
}

impl Family for Stack {
    const NAME: &'static str = "stack";
    const SUMMARY: &'static str = "boxes on each other, and a kick";

    fn build(&self) -> Result<Scene, SceneError> {
        let common = self.common();
        let mut scene = common.scene(Self::NAME)?;
        count("count", self.count, 1..=10_000)?;
        positive("width", self.width)?;
        positive("height", self.height)?;
        require("kick", self.kick, true, "a finite number")?;
        count("kicked", self.kicked, 1..=self.count)?;

        let (a, c) = (0.5 * self.width, 0.5 * self.height);
        for k in 0..self.count {
            let bottom = self.height * k as f64;
            let body = RigidBody::solid(Shape::Box { half: [a, a, c] }, self.density)?;
            let body = scene.push(body.at([0.0, 0.0, bottom + c]));
            for point in rectangle([0.0, 0.0, bottom], [a, 0.0, 0.0], [0.0, a, 0.0]) {
                scene.contacts.push(common.contact(k.checked_sub(1), body, point, Z));
            }
        }
        scene.bodies[self.kicked - 1].velocity[0] = self.kick;
        common.finish(scene, Spread::ByIndex)
    }
}

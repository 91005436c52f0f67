//! One box on a plane.

use super::{Family, Spread, count};
use crate::error::{positive, require};
use crate::vec3::{Y, Z, add, apply, rectangle, scale};
use crate::{Contact, Ground, RigidBody, Rotation, Scene, SceneError, Shape};

settings! {
    /// A box on a plane that slopes down along x, thrown along the slope: four contacts for six degrees of
    /// freedom, the smallest hyperstatic problem. T1 points down the slope. Several boxes slide side by side.
    SlidingBox {
        /// Number of boxes.
        count: usize = 1,
        /// Side along the slope, m.
        length: f64 = 0.4,
        /// Side across the slope, m.
        width: f64 = 0.3,
        /// Side along the normal, m.
        height: f64 = 0.2,
        /// Angle of the slope, degrees.
        slope: f64 = 10.0,
        /// Initial velocity down the slope, m/s.
        speed: f64 = 1.0,
    }
}

impl Family for SlidingBox {
    const NAME: &'static str = "sliding_box";
    const SUMMARY: &'static str = "boxes thrown along a sloping plane, four contacts each";

    fn build(&self) -> Result<Scene, SceneError> {
        let common = self.common();
        let mut scene = common.scene(Self::NAME)?;
        count("count", self.count, 1..=100_000)?;
        positive("length", self.length)?;
        positive("width", self.width)?;
        positive("height", self.height)?;
        let slope = self.slope;
        require("slope", slope, slope.abs() < 90.0, "an angle between -90 and 90 degrees")?;
        require("speed", self.speed, true, "a finite number")?;

        let rotation = Rotation::about(Y, slope.to_radians());
        let turned = rotation.matrix();
        let [down, normal] = [[1.0, 0.0, 0.0], Z].map(|d| apply(&turned, d));
        let [a, b, c] = [self.length, self.width, self.height].map(|side| 0.5 * side);
        let body = RigidBody::solid(Shape::Box { half: [a, b, c] }, self.density)?;
        let velocity = scale(self.speed, down);
        for k in 0..self.count {
            let foot = scale(1.5 * self.width * k as f64, Y);
            let position = add(foot, scale(c, normal));
            let body = scene.push(RigidBody { position, rotation, velocity, ..body.clone() });
            for point in rectangle(foot, scale(a, down), scale(b, Y)) {
                let contact = common.contact(None, body, point, normal);
                scene.contacts.push(Contact { tangent: down, ..contact });
            }
        }
        scene.ground = Some(Ground { point: [0.0; 3], normal, along: down });
        common.finish(scene, Spread::Random)
    }
}

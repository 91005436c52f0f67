//! Spheres poured into a box.

use super::{Family, Purpose, Spread, count, gap};
use crate::domain::{Domain, Sides};
use crate::error::{require, within_limits};
use crate::packing::{Neighbour, Packing, volume};
use crate::vec3::sub;
use crate::{RigidBody, Scene, SceneError, Shape};

settings! {
    /// Spheres of random radii in a box with a floor and four walls, settled by relaxation of their overlaps under their
    /// weight: contacts wherever two surfaces are closer than `gap`. Nothing overlaps.
    SpherePile {
        /// Number of spheres.
        count: usize = 100,
        /// Mean radius, m.
        radius: f64 = 0.1,
        /// Radii are spread evenly within ± this share of the mean.
        spread: f64 = 0.3,
        /// Height of the pile over the side of the box, about.
        aspect: f64 = 1.0,
        /// Surfaces closer than this share of the mean radius are in contact; a larger one gives more contacts.
        gap: f64 = 0.02,
    }
}

impl Family for SpherePile {
    const NAME: &'static str = "sphere_pile";
    const SUMMARY: &'static str = "spheres of random radii, poured into a box";

    fn build(&self) -> Result<Scene, SceneError> {
        let common = self.common();
        let mut scene = common.scene(Self::NAME)?;
        count("count", self.count, 1..=1_000_000)?;
        let aspect = self.aspect;
        require("aspect", aspect, (1e-3..=1e3).contains(&aspect), "a number from 0.001 to 1000")?;
        gap(self.gap)?;
        let radii = common.radii(self.count, self.radius, self.spread)?;

        // Random packings fill about six tenths of their room.
        let largest = radii.iter().copied().fold(0.0, f64::max);
        let side = (volume(&radii) / (0.6 * aspect)).cbrt().max(2.0 * largest);
        let domain = Domain {
            size: [side, side, aspect * side],
            sides: [Sides::Walls, Sides::Walls, Sides::Floor],
        };
        let mut rng = common.random(Purpose::Places);
        let centres = radii.iter().map(|_| domain.point(&mut rng)).collect();
        let mut packing = Packing { domain, centres, radii, fixed: 0 };
        packing.relax(true);
        within_limits()?;

        let middle = [0.5 * packing.domain.size[0], 0.5 * packing.domain.size[1], 0.0];
        for (&centre, &radius) in packing.centres.iter().zip(&packing.radii) {
            let body = RigidBody::solid(Shape::Sphere { radius }, self.density)?;
            scene.push(body.at(sub(centre, middle)));
        }
        for touch in packing.touching(self.gap * self.radius) {
            let a = match touch.a {
                Neighbour::Sphere(i, _) => Some(i),
                Neighbour::Wall(_) => None,
            };
            let point = sub(touch.point, middle);
            scene.contacts.push(common.contact(a, touch.b, point, touch.normal));
        }
        common.finish(scene, Spread::Random)
    }
}

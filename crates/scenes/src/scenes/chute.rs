//! Spheres that flow down a rough incline.

use rand::RngExt;

use super::{Family, Purpose, Spread, count, gap};
use crate::domain::{Domain, Sides};
use crate::error::{require, within_limits};
use crate::packing::{Neighbour, Packing, volume};
use crate::vec3::{Vec3, Y, Z, add, apply, scale, sub};
use crate::{Ground, Obstacle, RigidBody, Rotation, Scene, SceneError, Shape};

settings! {
    /// A layer of spheres of random radii flows down a plane that slopes along x and is rough by half spheres, between two
    /// side walls, open at both ends. At the height z above the plane it has Bagnold's velocity
    /// `speed (1 − (1 − z/H)^1.5)`, H the height of the flow, and turns with half its curl.
    Chute {
        /// Number of spheres that flow.
        count: usize = 200,
        /// Mean radius, m.
        radius: f64 = 0.05,
        /// Radii are spread evenly within ± this share of the mean.
        spread: f64 = 0.2,
        /// Height of the flow in mean diameters, about.
        depth: f64 = 4.0,
        /// Distance of the side walls in mean diameters, about.
        width: f64 = 6.0,
        /// Angle of the slope, degrees.
        slope: f64 = 25.0,
        /// Velocity of the surface, m/s.
        speed: f64 = 1.0,
        /// Surfaces closer than this share of the mean radius are in contact.
        gap: f64 = 0.02,
    } with {
        mu: 1.0,
    }
}

impl Family for Chute {
    const NAME: &'static str = "chute";
    const SUMMARY: &'static str = "spheres that flow down a rough incline";

    fn build(&self) -> Result<Scene, SceneError> {
        let common = self.common();
        let mut scene = common.scene(Self::NAME)?;
        count("count", self.count, 1..=1_000_000)?;
        for (key, x) in [("depth", self.depth), ("width", self.width)] {
            require(key, x, (1.0..=1e3).contains(&x), "a number from 1 to 1000")?;
        }
        let slope = self.slope;
        require("slope", slope, slope.abs() < 90.0, "an angle between -90 and 90 degrees")?;
        require("speed", self.speed, true, "a finite number")?;
        gap(self.gap)?;
        let flowing = common.radii(self.count, self.radius, self.spread)?;

        // Packed on the level; the plane is tilted afterwards.
        let diameter = 2.0 * self.radius;
        let largest = flowing.iter().copied().fold(0.0, f64::max);
        let width = (self.width * diameter).max(2.0 * largest);
        let depth = self.depth * diameter;
        let length = (volume(&flowing) / (0.6 * width * depth)).max(2.0 * largest);
        let domain = Domain {
            size: [length, width, depth],
            sides: [Sides::Walls, Sides::Walls, Sides::Floor],
        };
        let mut rng = common.random(Purpose::Places);
        let bumps = [length, width].map(|x| (x / diameter).ceil() as usize);
        let mut centres = vec![];
        for k in 0..bumps[0] * bumps[1] {
            let (i, j) = (k % bumps[0], k / bumps[0]);
            let place = |k: usize, n: usize, size: f64, jitter: f64| {
                size * (k as f64 + 0.5 + 0.3 * jitter) / n as f64
            };
            let mut jitter = || rng.random_range(-1.0..=1.0);
            let x = place(i, bumps[0], length, jitter());
            let y = place(j, bumps[1], width, jitter());
            centres.push([x, y, 0.3 * self.radius * jitter() - 0.3 * self.radius]);
        }
        let fixed = centres.len();
        centres.extend(flowing.iter().map(|_| domain.point(&mut rng)));
        let radii = [vec![self.radius; fixed], flowing].concat();
        let mut packing = Packing { domain, centres, radii, fixed };
        packing.relax(true);
        within_limits()?;

        let rotation = Rotation::about(Y, slope.to_radians());
        let turned = rotation.matrix();
        let middle = [0.5 * packing.domain.size[0], 0.5 * packing.domain.size[1], 0.0];
        let placed = |p: Vec3| apply(&turned, sub(p, middle));
        let moving = || packing.centres.iter().zip(&packing.radii).skip(fixed);
        let top = moving().map(|(c, r)| c[2] + r).fold(0.0, f64::max);
        for (&centre, &radius) in moving() {
            // The share of the height left above, and the profile with its slope.
            let left = 1.0 - centre[2] / top;
            let velocity = self.speed * (1.0 - left.powf(1.5));
            let shear = 1.5 * self.speed * left.sqrt() / top;
            let body = RigidBody::solid(Shape::Sphere { radius }, self.density)?;
            scene.push(RigidBody {
                velocity: apply(&turned, [velocity, 0.0, 0.0]),
                angular_velocity: [0.0, 0.5 * shear, 0.0],
                ..body.at(placed(centre))
            });
        }
        for touch in packing.touching(self.gap * self.radius) {
            let a = match touch.a {
                // The ends are open.
                Neighbour::Wall(wall) if wall.axis == 0 => continue,
                Neighbour::Wall(_) => None,
                Neighbour::Sphere(i, _) => i.checked_sub(fixed),
            };
            let (point, normal) = (placed(touch.point), apply(&turned, touch.normal));
            scene.contacts.push(common.contact(a, touch.b - fixed, point, normal));
        }
        let plane = apply(&turned, Z);
        // The plane is drawn below the bumps, which are half sunk.
        let below = scale(-1.6 * self.radius, plane);
        let along = apply(&turned, [1.0, 0.0, 0.0]);
        scene.ground = Some(Ground { point: add(placed(middle), below), normal: plane, along });
        let shape = Shape::Sphere { radius: self.radius };
        scene.obstacles = packing.centres[..fixed]
            .iter()
            .map(|&c| Obstacle { shape: shape.clone(), position: placed(c) })
            .collect();
        common.finish(scene, Spread::Random)
    }
}

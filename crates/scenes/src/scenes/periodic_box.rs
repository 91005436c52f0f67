//! Grains in a periodic box that is sheared.

use super::polyhedra::{Faces, tessellation};
use super::{Common, Family, Purpose, Spread, count, gap, length};
use crate::domain::{Domain, Sides, Wall};
use crate::error::{require, within_limits};
use crate::packing::{Neighbour, Packing, volume};
use crate::vec3::{Mat3, Vec3, apply};
use crate::voronoi::Beyond;
use crate::{Contact, Image, RigidBody, Scene, SceneError, Shape};

settings! {
    /// Grains without weight in a box whose sides x and y (and z, or else plates there) are periodic, driven by the velocity
    /// gradient `L = dilation I + shear e_x e_zᵀ`: grains begin with the velocity `L x` and half its curl, and the
    /// image of a grain a period p away moves with `L p` relative to the grain, which enters through w. A
    /// dilation of half the shear opens or slides every contact of the affine motion; the less of it, the more contacts press,
    /// and a box too full for the motion asked of it has no solution.
    PeriodicBox {
        /// Number of grains.
        count: usize = 100,
        /// What the grains are.
        grains: Grains = Grains::Spheres,
        /// Which sides are periodic.
        periodic: Periodic = Periodic::All,
        /// Mean radius of spheres, half the side of a cube of the mean volume of polyhedra, m.
        radius: f64 = 0.05,
        /// Radii of spheres are spread evenly within ± this share of the mean.
        spread: f64 = 0.3,
        /// Share of the box that spheres are to fill; above about 0.63 they jam and the box becomes larger.
        fill: f64 = 0.62,
        /// Spheres closer than this share of the mean radius are in contact.
        gap: f64 = 0.02,
        /// Contacts of a face of polyhedra, at most.
        points: usize = 3,
        /// Share of the faces of polyhedra that are open, by lot.
        open: f64 = 0.7,
        /// Rate of shear, 1/s.
        shear: f64 = 1.0,
        /// Rate of expansion along each axis, 1/s; negative to compress.
        dilation: f64 = 0.2,
    } with {
        gravity: 0.0,
        mu: 0.8,
    }
}

/// The grains of a [`PeriodicBox`].
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Grains {
    /// A random packing of spheres.
    Spheres,
    /// Voronoi cells.
    Polyhedra,
}

/// The periodic sides of a [`PeriodicBox`].
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Periodic {
    /// All sides.
    All,
    /// Those along x and y; plates at both ends of z move with the given velocity.
    Plane,
}

impl Family for PeriodicBox {
    const NAME: &'static str = "periodic_box";
    const SUMMARY: &'static str = "spheres or polyhedra in a periodic box, sheared";

    fn build(&self) -> Result<Scene, SceneError> {
        let common = self.common();
        let mut scene = common.scene(Self::NAME)?;
        scene.ground = None;
        count("count", self.count, 2..=1_000_000)?;
        require("fill", self.fill, (0.01..=1.0).contains(&self.fill), "a number from 0.01 to 1")?;
        gap(self.gap)?;
        require("shear", self.shear, true, "a finite number")?;
        require("dilation", self.dilation, true, "a finite number")?;
        let last = match self.periodic {
            Periodic::All => Sides::Periodic,
            Periodic::Plane => Sides::Walls,
        };
        let domain =
            |side: f64| Domain { size: [side; 3], sides: [Sides::Periodic, Sides::Periodic, last] };
        match self.grains {
            Grains::Spheres => self.spheres(&common, domain, &mut scene)?,
            Grains::Polyhedra => self.polyhedra(&common, domain, &mut scene)?,
        }
        let gradient = self.gradient();
        for body in &mut scene.bodies {
            body.velocity = apply(&gradient, body.position);
            body.angular_velocity = [0.0, 0.5 * self.shear, 0.0];
        }
        common.finish(scene, Spread::Random)
    }
}

impl PeriodicBox {
    fn gradient(&self) -> Mat3 {
        let d = self.dilation;
        [[d, 0.0, self.shear], [0.0, d, 0.0], [0.0, 0.0, d]]
    }

    fn image(&self, offset: Vec3) -> Image {
        Image { offset, velocity: apply(&self.gradient(), offset) }
    }

    /// The periods of the domain.
    fn periods(&self, domain: &Domain) -> Vec<Image> {
        let along = |k: usize| std::array::from_fn(|i| if i == k { domain.size[k] } else { 0.0 });
        (0..3).filter(|&k| domain.periodic(k)).map(|k| self.image(along(k))).collect()
    }

    fn plate(&self, wall: Wall) -> Image {
        Image { offset: [0.0; 3], velocity: apply(&self.gradient(), wall.point()) }
    }

    fn spheres(
        &self,
        common: &Common,
        domain: impl Fn(f64) -> Domain,
        scene: &mut Scene,
    ) -> Result<(), SceneError> {
        let radii = common.radii(self.count, self.radius, self.spread)?;
        let largest = radii.iter().copied().fold(0.0, f64::max);
        let domain = domain((volume(&radii) / self.fill).cbrt().max(2.0 * largest));
        let mut rng = common.random(Purpose::Places);
        let centres = radii.iter().map(|_| domain.point(&mut rng)).collect();
        let mut packing = Packing { domain, centres, radii, fixed: 0 };
        packing.relax(false);
        within_limits()?;
        scene.periods = self.periods(&packing.domain);
        for (&centre, &radius) in packing.centres.iter().zip(&packing.radii) {
            scene.push(RigidBody::solid(Shape::Sphere { radius }, self.density)?.at(centre));
        }
        for touch in packing.touching(self.gap * self.radius) {
            let (a, image) = match touch.a {
                Neighbour::Sphere(i, offset) => (Some(i), self.image(offset)),
                Neighbour::Wall(wall) => (None, self.plate(wall)),
            };
            let contact = common.contact(a, touch.b, touch.point, touch.normal);
            scene.contacts.push(Contact { image, ..contact });
        }
        Ok(())
    }

    fn polyhedra(
        &self,
        common: &Common,
        domain: impl Fn(f64) -> Domain,
        scene: &mut Scene,
    ) -> Result<(), SceneError> {
        length("radius", self.radius)?;
        let domain = domain(2.0 * self.radius * (self.count as f64).cbrt());
        scene.periods = self.periods(&domain);
        let cells = tessellation(common, &domain, self.count, 2)?;
        for cell in &cells {
            within_limits()?;
            scene.push(RigidBody::solid(Shape::Polyhedron(cell.polyhedron()), self.density)?);
        }
        let faces = Faces { points: self.points, open: self.open };
        faces.touch(common, &cells, |b, beyond, point, normal| {
            let (a, image) = match beyond {
                Beyond::Cell(a, offset) => (Some(a), self.image(offset)),
                Beyond::Wall(wall) => (None, self.plate(wall)),
                Beyond::Start => return,
            };
            let contact = common.contact(a, b, point, normal);
            scene.contacts.push(Contact { image, ..contact });
        })
    }
}

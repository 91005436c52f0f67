//! A pile of convex polyhedra.

use rand::RngExt;
use rand_pcg::Pcg64;

use super::{Common, Family, Purpose, Spread, count, length};
use crate::domain::{Domain, Sides};
use crate::error::{require, within_limits};
use crate::vec3::{Vec3, add, cross, norm, scale, sub};
use crate::voronoi::{self, Beyond, Cell};
use crate::{RigidBody, Scene, SceneError, Shape};

settings! {
    /// The Voronoi cells of random points fill a box with a floor and four walls: blocks of rubble that fit each other.
    /// Where two share a face, or one lies on the floor or a wall, there are up to `points` contacts at corners of the face,
    /// unless the face is open.
    Polyhedra {
        /// Number of polyhedra.
        count: usize = 40,
        /// Mean size of a polyhedron: the side of a cube of the same volume, m.
        size: f64 = 0.2,
        /// Height of the pile over the side of the box.
        aspect: f64 = 1.0,
        /// Sweeps of Lloyd's relaxation; more make the polyhedra rounder and more equal.
        relaxation: usize = 2,
        /// Contacts of a face, at most: 1 is in its middle, more are at its corners.
        points: usize = 3,
        /// Share of the faces between polyhedra that are open, by lot.
        open: f64 = 0.3,
    }
}

impl Family for Polyhedra {
    const NAME: &'static str = "polyhedra";
    const SUMMARY: &'static str = "convex polyhedra (Voronoi cells) that fill a box";

    fn build(&self) -> Result<Scene, SceneError> {
        let common = self.common();
        let mut scene = common.scene(Self::NAME)?;
        count("count", self.count, 1..=100_000)?;
        length("size", self.size)?;
        let aspect = self.aspect;
        require("aspect", aspect, (1e-3..=1e3).contains(&aspect), "a number from 0.001 to 1000")?;
        count("relaxation", self.relaxation, 0..=1000)?;

        let side = self.size * (self.count as f64 / aspect).cbrt();
        let domain = Domain { size: [side, side, aspect * side], sides: [Sides::Walls; 3] };
        let cells = tessellation(&common, &domain, self.count, self.relaxation)?;
        let middle = [0.5 * side, 0.5 * side, 0.0];
        for cell in &cells {
            within_limits()?;
            let solid = cell.polyhedron().mapped(|v| sub(v, middle));
            scene.push(RigidBody::solid(Shape::Polyhedron(solid), self.density)?);
        }
        let faces = Faces { points: self.points, open: self.open };
        faces.touch(&common, &cells, |b, beyond, point, normal| {
            let a = match beyond {
                Beyond::Cell(a, _) => Some(a),
                // The top is free.
                Beyond::Wall(wall) if wall.axis == 2 && wall.inward < 0.0 => return,
                Beyond::Wall(_) | Beyond::Start => None,
            };
            scene.contacts.push(common.contact(a, b, sub(point, middle), normal));
        })?;
        common.finish(scene, Spread::Random)
    }
}

/// The cells of random seeds.
///
/// Errors: limits that are over.
pub(super) fn tessellation(
    common: &Common,
    domain: &Domain,
    count: usize,
    relaxation: usize,
) -> Result<Vec<Cell>, SceneError> {
    let mut rng = common.random(Purpose::Places);
    let mut seeds: Vec<Vec3> = (0..count).map(|_| domain.point(&mut rng)).collect();
    voronoi::relax(domain, &mut seeds, relaxation);
    let cells = voronoi::cells(domain, &seeds);
    within_limits().map(|()| cells)
}

/// Which faces of cells touch, and where.
pub(super) struct Faces {
    pub points: usize,
    pub open: f64,
}

impl Faces {
    /// Calls `contact` with b, what lies beyond its face, a point of the face and the normal into b.
    ///
    /// Errors: settings that cannot be, by the keys `points` and `open`; limits that are over.
    pub fn touch(
        &self,
        common: &Common,
        cells: &[Cell],
        mut contact: impl FnMut(usize, Beyond, Vec3, Vec3),
    ) -> Result<(), SceneError> {
        count("points", self.points, 1..=1000)?;
        let open = self.open;
        require("open", open, (0.0..=1.0).contains(&open), "a number from 0 to 1")?;
        let mut rng: Pcg64 = common.random(Purpose::Faces);
        for (b, cell) in cells.iter().enumerate() {
            within_limits()?;
            for (corners, beyond) in cell.faces() {
                if let Beyond::Cell(a, offset) = beyond {
                    // Each face once, from the later of its two cells; a share of them stays open.
                    let once = a < b || (a == b && offset > [0.0; 3]);
                    if !once || rng.random::<f64>() < open {
                        continue;
                    }
                }
                // Twice the area, along the outward normal; slivers do not touch.
                let turning = (1..corners.len() - 1).fold([0.0; 3], |s: Vec3, k| {
                    let (p, q) = (sub(corners[k], corners[0]), sub(corners[k + 1], corners[0]));
                    add(s, cross(p, q))
                });
                let size = corners.iter().map(|&p| norm(sub(p, corners[0]))).fold(0.0, f64::max);
                if norm(turning) < 1e-3 * size * size {
                    continue;
                }
                for point in voronoi::spread_points(&corners, self.points) {
                    contact(b, beyond, point, scale(-1.0, turning));
                }
            }
        }
        Ok(())
    }
}

//! A pile of spheres.

use super::{Family, Spread, count};
use crate::error::positive;
use crate::vec3::{Vec3, Z, add, scale, sub};
use crate::{RigidBody, Scene, SceneError, Shape};

settings! {
    /// A pyramid of equal spheres on the ground, a contact at each point where two touch.
    Spheres {
        /// Spheres along a side of the lowest layer.
        base: usize = 4,
        /// How the spheres of a layer are arranged.
        layout: Layout = Layout::Square,
        /// Radius of a sphere, m.
        radius: f64 = 0.1,
    }
}

/// The arrangement of a layer of spheres.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Layout {
    /// Squares; each sphere rests on four.
    Square,
    /// Equilateral triangles; each sphere rests on three.
    Triangular,
}

impl Layout {
    /// The steps of the lattice, in diameters: along a row, to the next row, to the next layer.
    fn steps(self) -> [Vec3; 3] {
        match self {
            Layout::Square => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.5, 0.5, 0.5_f64.sqrt()]],
            Layout::Triangular => {
                let row = 0.75_f64.sqrt();
                [[1.0, 0.0, 0.0], [0.5, row, 0.0], [0.5, row / 3.0, (2.0 / 3.0_f64).sqrt()]]
            }
        }
    }

    /// The number of spheres in row `j` of a layer whose side counts `side`.
    fn row(self, side: usize, j: usize) -> usize {
        match self {
            Layout::Square => side,
            Layout::Triangular => side - j,
        }
    }

    /// Earlier neighbours as steps of `(layer, row, place)`: in the layer, then those below.
    fn neighbours(self) -> &'static [(usize, isize, isize)] {
        match self {
            Layout::Square => &[(0, 0, -1), (0, -1, 0), (1, 0, 0), (1, 0, 1), (1, 1, 0), (1, 1, 1)],
            Layout::Triangular => {
                &[(0, 0, -1), (0, -1, 0), (0, -1, 1), (1, 0, 0), (1, 0, 1), (1, 1, 0)]
            }
        }
    }
}

impl Family for Spheres {
    const NAME: &'static str = "spheres";
    const SUMMARY: &'static str = "a pyramid of touching spheres, square or triangular";

    fn build(&self) -> Result<Scene, SceneError> {
        let common = self.common();
        let mut scene = common.scene(Self::NAME)?;
        count("base", self.base, 1..=100)?;
        positive("radius", self.radius)?;

        let [along, across, up] = self.layout.steps().map(|s| scale(2.0 * self.radius, s));
        let at = |layer: usize, j: usize, i: usize| {
            let in_layer = add(scale(i as f64, along), scale(j as f64, across));
            add(in_layer, add(scale(layer as f64, up), scale(self.radius, Z)))
        };
        // The index of each sphere: by layer, then row, then place.
        let mut index: Vec<Vec<Vec<usize>>> = Vec::new();
        for layer in 0..self.base {
            let side = self.base - layer;
            index.push(Vec::new());
            for j in 0..side {
                index[layer].push(Vec::new());
                for i in 0..self.layout.row(side, j) {
                    let position = at(layer, j, i);
                    let shape = Shape::Sphere { radius: self.radius };
                    let b = scene.push(RigidBody::solid(shape, self.density)?.at(position));
                    index[layer][j].push(b);
                    if layer == 0 {
                        let touching = sub(position, scale(self.radius, Z));
                        scene.contacts.push(common.contact(None, b, touching, Z));
                    }
                    for &(down, dj, di) in self.layout.neighbours() {
                        let a = (|| {
                            let rows = index.get(layer.checked_sub(down)?)?;
                            let row = rows.get(j.checked_add_signed(dj)?)?;
                            row.get(i.checked_add_signed(di)?).copied()
                        })();
                        if let Some(a) = a {
                            let other = scene.bodies[a].position;
                            let middle = scale(0.5, add(position, other));
                            let normal = sub(position, other);
                            scene.contacts.push(common.contact(Some(a), b, middle, normal));
                        }
                    }
                }
            }
        }
        common.finish(scene, Spread::Random)
    }
}

//! A brick wall of elastic bricks.

use super::elastic::elastic_settings;
use super::{Family, Spread, Wall, count};
use crate::error::within_limits;
use crate::vec3::scale;
use crate::{Scene, SceneError, Shape};

elastic_settings! {
    /// The wall in running bond with elastic bricks: contacts at the corners of each overlap, between nodes where
    /// `elements` is even. With `rows` 8, `columns` 11 and `mu` 0.83 the problem has about the size of LowWall_FEM
    /// of the FCLIB collection.
    ElasticWall {
        /// Number of rows.
        rows: usize = 4,
        /// Bricks in a full row.
        columns: usize = 4,
        /// Side of a brick along the wall, m.
        length: f64 = 0.4,
        /// Side of a brick across the wall, m.
        depth: f64 = 0.2,
        /// Vertical side of a brick, m.
        height: f64 = 0.2,
        /// Contacts also between neighbours in a row, four for each.
        head_joints: bool = false,
        /// Elements along each side of a brick; half of them along a half brick.
        elements: usize = 2,
    }
}

impl Family for ElasticWall {
    const NAME: &'static str = "elastic_wall";
    const SUMMARY: &'static str = "a brick wall in running bond, each brick of finite elements";

    fn build(&self) -> Result<Scene, SceneError> {
        count("elements", self.elements, 1..=100)?;
        let Self { rows, columns, length, depth, height, head_joints, .. } = *self;
        // The bricks and their contacts are those of the rigid wall.
        let common = self.common();
        let rigid =
            Wall { rows, columns, length, depth, height, head_joints, ..Wall::with(common) };
        let mut scene = Scene { name: Self::NAME.into(), ..rigid.laid()? };
        for body in std::mem::take(&mut scene.bodies) {
            within_limits()?;
            let Shape::Box { half } = body.shape else { unreachable!("a wall is of bricks") };
            let sides = scale(2.0, half);
            let part = (sides[0] / length * self.elements as f64).round().max(1.0);
            let elements = [part as usize, self.elements, self.elements];
            scene.push_solid(self.solid(sides, elements, body.position)?);
        }
        common.finish(scene, Spread::Random)
    }
}

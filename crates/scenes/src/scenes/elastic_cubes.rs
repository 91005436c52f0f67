//! Elastic cubes on each other.

use super::elastic::elastic_settings;
use super::{Family, Spread, count};
use crate::error::{positive, require, within_limits};
use crate::vec3::Z;
use crate::{Scene, SceneError};

elastic_settings! {
    /// Elastic cubes on each other: a contact at each node of a cube's bottom that stands on the cube below. Every
    /// second cube is shifted, so that some nodes overhang and the others meet faces. W has full rank.
    /// `mass_ratio` is that of the top cube to the lowest. With `elements` 2, 5 and 20 and `mu` 0.3 the problems have the
    /// sizes of Cubes_H8_2, Cubes_H8_5 and Cubes_H8_20 of the FCLIB collection.
    ElasticCubes {
        /// Number of cubes.
        count: usize = 2,
        /// Elements along each side of a cube.
        elements: usize = 2,
        /// Side of a cube, m.
        side: f64 = 1.0,
        /// Shift of every second cube along x and y, in sides, from 0 to below 1.
        offset: f64 = 0.1,
        /// What the lowest cube stands on.
        support: Support = Support::Held,
    }
}

/// What the lowest cube stands on.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Support {
    /// Its bottom is held.
    Held,
    /// The ground, with a contact at each node.
    Ground,
}

impl Family for ElasticCubes {
    const NAME: &'static str = "elastic_cubes";
    const SUMMARY: &'static str = "finite element cubes on each other, W of full rank";

    fn build(&self) -> Result<Scene, SceneError> {
        let common = self.common();
        let mut scene = common.scene(Self::NAME)?;
        count("count", self.count, 1..=100)?;
        count("elements", self.elements, 1..=100)?;
        positive("side", self.side)?;
        let offset = self.offset;
        require("offset", offset, (0.0..1.0).contains(&offset), "a number from 0 to below 1")?;
        let held = self.support == Support::Held;
        if held && self.count == 1 {
            let expected = "a count of at least 2 where the lowest cube is held";
            return Err(SceneError::value("count", expected, self.count));
        }

        for k in 0..self.count {
            within_limits()?;
            let shift = if k % 2 == 1 { offset * self.side } else { 0.0 };
            let position = [shift, shift, self.side * (k as f64 + 0.5)];
            let mut solid = self.solid([self.side; 3], [self.elements; 3], position)?;
            if k == 0 && held {
                solid.hold_bottom();
            }
            let below = k.checked_sub(1).map(|a| &scene.solids[a]);
            let points: Vec<_> = solid
                .bottom()
                .filter(|&p| below.is_none_or(|below| below.weights(p).is_some()))
                .collect();
            let b = scene.push_solid(solid);
            if k > 0 || !held {
                let contact = |p| common.contact(k.checked_sub(1), b, p, Z);
                scene.contacts.extend(points.into_iter().map(contact));
            }
        }
        common.finish(scene, Spread::ByIndex)
    }
}

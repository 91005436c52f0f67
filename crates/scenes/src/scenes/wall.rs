//! A brick wall in running bond.

use super::{Family, Spread, count};
use crate::error::positive;
use crate::vec3::{X, Z, rectangle};
use crate::{RigidBody, Scene, SceneError, Shape};

settings! {
    /// A dry wall along x in running bond: every second row is shifted by half a brick and closed by half bricks.
    /// Four contacts for each pair of bricks that overlap, so eight below each brick of the interior.
    Wall {
        /// Number of rows.
        rows: usize = 6,
        /// Bricks in a full row.
        columns: usize = 5,
        /// Side of a brick along the wall, m.
        length: f64 = 0.4,
        /// Side of a brick across the wall, m.
        depth: f64 = 0.2,
        /// Vertical side of a brick, m.
        height: f64 = 0.2,
        /// Contacts also between neighbours in a row, four for each.
        head_joints: bool = false,
    }
}

impl Family for Wall {
    const NAME: &'static str = "wall";
    const SUMMARY: &'static str = "a dry brick wall in running bond";

    fn build(&self) -> Result<Scene, SceneError> {
        self.common().finish(self.laid()?, Spread::Random)
    }
}

impl Wall {
    /// The bricks and their contacts, not yet finished by the common settings.
    pub(super) fn laid(&self) -> Result<Scene, SceneError> {
        let common = self.common();
        let mut scene = common.scene(Self::NAME)?;
        count("rows", self.rows, 1..=1000)?;
        count("columns", self.columns, 1..=1000)?;
        positive("length", self.length)?;
        positive("depth", self.depth)?;
        positive("height", self.height)?;

        // Ends of bricks are counted in half bricks, so that overlaps are decided in integers.
        let x = |halves: usize| 0.5 * self.length * (halves as f64 - self.columns as f64);
        let (b, c) = (0.5 * self.depth, 0.5 * self.height);
        let mut below: Vec<(usize, usize, usize)> = Vec::new();
        for row in 0..self.rows {
            let bottom = self.height * row as f64;
            let shift = row % 2;
            let mut bricks: Vec<(usize, usize, usize)> = Vec::new();
            for k in 0..self.columns + shift {
                let start = (2 * k).saturating_sub(shift);
                let end = (2 * k + 2 - shift).min(2 * self.columns);
                let half = [0.5 * (x(end) - x(start)), b, c];
                let body = RigidBody::solid(Shape::Box { half }, self.density)?;
                let at = [0.5 * (x(start) + x(end)), 0.0, bottom + c];
                bricks.push((scene.push(body.at(at)), start, end));
            }
            for &(body, start, end) in &bricks {
                let mut rests_on = |a: Option<usize>, from: usize, to: usize| {
                    let centre = [0.5 * (x(from) + x(to)), 0.0, bottom];
                    for p in rectangle(centre, [0.5 * (x(to) - x(from)), 0.0, 0.0], [0.0, b, 0.0]) {
                        scene.contacts.push(common.contact(a, body, p, Z));
                    }
                };
                if row == 0 {
                    rests_on(None, start, end);
                }
                for &(a, from, to) in below.iter().filter(|&&(_, f, t)| f < end && t > start) {
                    rests_on(Some(a), from.max(start), to.min(end));
                }
            }
            if self.head_joints {
                for pair in bricks.windows(2) {
                    let centre = [x(pair[1].1), 0.0, bottom + c];
                    for p in rectangle(centre, [0.0, b, 0.0], [0.0, 0.0, c]) {
                        scene.contacts.push(common.contact(Some(pair[0].0), pair[1].0, p, X));
                    }
                }
            }
            below = bricks;
        }
        Ok(scene)
    }
}

//! A masonry bridge.

use super::{Family, Spread, count};
use crate::error::{positive, require};
use crate::polyhedron::Polyhedron;
use crate::vec3::{Vec3, add, grid, scale, sub};
use crate::{RigidBody, Scene, SceneError, Shape};

settings! {
    /// Segmental arches between fixed piers carry blocks of filling, one above each voussoir and one above each pier, and
    /// slabs of a deck across them. Every joint between neighbours, and between a block and its pier, has `points` ×
    /// `points` contacts; many points make the problem strongly hyperstatic.
    Bridge {
        /// Voussoirs of an arch.
        voussoirs: usize = 9,
        /// Number of arches side by side.
        spans: usize = 1,
        /// Slabs of the deck above each arch; 0 for none.
        slabs: usize = 3,
        /// Contacts along each side of a joint: 2 for its corners.
        points: usize = 2,
        /// Angle that an arch spans at its centre, degrees.
        opening: f64 = 120.0,
        /// Inner radius, m.
        radius: f64 = 4.0,
        /// Thickness of the ring, m.
        thickness: f64 = 0.5,
        /// Filling above the crown, m.
        cover: f64 = 0.3,
        /// Thickness of the deck, m.
        deck: f64 = 0.2,
        /// Width of a pier at the springing, m; more than twice the horizontal reach of the ring's thickness.
        pier: f64 = 1.6,
        /// Height of the springing, m.
        height: f64 = 1.5,
        /// Width of the bridge, m.
        depth: f64 = 2.0,
    } with {
        mu: 0.9,
    }
}

/// A point of the plane of the arch, x along the bridge and z upwards.
type Point = [f64; 2];

impl Family for Bridge {
    const NAME: &'static str = "bridge";
    const SUMMARY: &'static str = "arches on piers with their filling and a deck";

    fn build(&self) -> Result<Scene, SceneError> {
        let common = self.common();
        let mut scene = common.scene(Self::NAME)?;
        count("voussoirs", self.voussoirs, 3..=10_000)?;
        count("spans", self.spans, 1..=1000)?;
        count("slabs", self.slabs, 0..=10_000)?;
        count("points", self.points, 1..=100)?;
        let opening = self.opening;
        let expected = "an angle above 0 and below 180 degrees";
        require("opening", opening, opening > 0.0 && opening < 180.0, expected)?;
        for (key, x) in [
            ("radius", self.radius),
            ("thickness", self.thickness),
            ("cover", self.cover),
            ("deck", self.deck),
            ("height", self.height),
            ("depth", self.depth),
        ] {
            positive(key, x)?;
        }
        let (sin, cos) = (0.5 * opening.to_radians()).sin_cos();
        let reach = self.thickness * sin;
        let expected = format!("more than {:.4}, twice the reach of the ring", 2.0 * reach);
        require("pier", self.pier, self.pier > 2.0 * reach, &expected)?;

        let outer = self.radius + self.thickness;
        let centre = self.height - self.radius * cos;
        let bay = 2.0 * self.radius * sin + self.pier;
        let top = centre + outer + self.cover;
        // Joint i of an arch, from left to right, at the distance r from its centre.
        let joint = |span: usize, i: usize, r: f64| {
            let share = 2.0 * i as f64 / self.voussoirs as f64 - 1.0;
            let (s, c) = (share * 0.5 * opening.to_radians()).sin_cos();
            [bay * span as f64 + r * s, centre + r * c]
        };
        // Where the ring's back springs from pier `k`, to its left and to its right.
        let shoulder = self.height + self.thickness * cos;
        let shoulders = |k: usize| {
            let middle = bay * (k as f64 - 0.5);
            let half = 0.5 * self.pier - reach;
            [middle - half, middle + half]
        };

        let mut masonry = Masonry { scene: &mut scene, bridge: self, columns: vec![] };
        for k in 0..=self.spans {
            let [left, right] = shoulders(k);
            let base = [[left, shoulder], [right, shoulder], [right, top], [left, top]];
            let block = masonry.block(&base)?;
            masonry.joint(None, block, base[0], base[1]);
            if let Some(&(last, ..)) = masonry.columns.last() {
                masonry.joint(Some(last), block, [left, top], [left, shoulder]);
            }
            masonry.columns.push((block, left, right));
            let foot = 0.5 * self.pier;
            let middle = 0.5 * (left + right);
            let pier = [
                [middle - foot, 0.0],
                [middle + foot, 0.0],
                [middle + foot, self.height],
                [right, shoulder],
                [left, shoulder],
                [middle - foot, self.height],
            ];
            let pier = masonry.prism(&pier)?;
            masonry.scene.obstacles.push(pier.into());
            if k == self.spans {
                break;
            }
            let mut ring = None;
            for i in 0..self.voussoirs {
                let [inner_from, outer_from] = [self.radius, outer].map(|r| joint(k, i, r));
                let [inner_to, outer_to] = [self.radius, outer].map(|r| joint(k, i + 1, r));
                let voussoir = masonry.block(&[inner_from, inner_to, outer_to, outer_from])?;
                masonry.joint(ring, voussoir, outer_from, inner_from);
                ring = Some(voussoir);
                let [x, z] = outer_from;
                let filling =
                    masonry.block(&[outer_from, outer_to, [outer_to[0], top], [x, top]])?;
                masonry.joint(Some(voussoir), filling, outer_from, outer_to);
                let (last, ..) = *masonry.columns.last().expect("the pier's block");
                masonry.joint(Some(last), filling, [x, top], [x, z]);
                masonry.columns.push((filling, x, outer_to[0]));
            }
            let [inner, back] = [self.radius, outer].map(|r| joint(k, self.voussoirs, r));
            let last = ring.expect("an arch has voussoirs");
            masonry.joint(None, last, inner, back);
        }
        let ends = [shoulders(0)[0], shoulders(self.spans)[1]];
        masonry.deck(ends, top)?;
        common.finish(scene, Spread::Random)
    }
}

/// The bridge under construction.
struct Masonry<'a> {
    scene: &'a mut Scene,
    bridge: &'a Bridge,
    /// Blocks that carry the deck, with their ends along x, from left to right.
    columns: Vec<(usize, f64, f64)>,
}

impl Masonry<'_> {
    fn prism(&self, base: &[Point]) -> Result<Polyhedron, SceneError> {
        let depth = self.bridge.depth;
        let base: Vec<Vec3> = base.iter().map(|&[x, z]| [x, -0.5 * depth, z]).collect();
        Polyhedron::prism(&base, [0.0, depth, 0.0])
    }

    fn block(&mut self, base: &[Point]) -> Result<usize, SceneError> {
        let shape = Shape::Polyhedron(self.prism(base)?);
        Ok(self.scene.push(RigidBody::solid(shape, self.bridge.density)?))
    }

    /// The joint along the segment between two points; b lies to the left of the way from the first to the second.
    fn joint(&mut self, a: Option<usize>, b: usize, from: Point, to: Point) {
        let [from, to] = [from, to].map(|[x, z]| [x, 0.0, z]);
        let along = sub(to, from);
        let normal = [-along[2], 0.0, along[0]];
        let across = [0.0, 0.5 * self.bridge.depth, 0.0];
        let middle = scale(0.5, add(from, to));
        let common = self.bridge.common();
        for p in grid(middle, scale(0.5, along), across, self.bridge.points) {
            self.scene.contacts.push(common.contact(a, b, p, normal));
        }
    }

    /// Equal slabs between the `ends` of the bridge, each on all the columns below it.
    fn deck(&mut self, ends: [f64; 2], bottom: f64) -> Result<(), SceneError> {
        let slabs = self.bridge.slabs * self.bridge.spans;
        let (length, top) = (ends[1] - ends[0], bottom + self.bridge.deck);
        let mut last = None;
        for k in 0..slabs {
            let [left, right] = [k, k + 1].map(|k| ends[0] + length * k as f64 / slabs as f64);
            let slab = self.block(&[[left, bottom], [right, bottom], [right, top], [left, top]])?;
            if let Some(last) = last {
                self.joint(Some(last), slab, [left, top], [left, bottom]);
            }
            last = Some(slab);
            for (column, from, to) in self.columns.clone() {
                let (from, to) = (from.max(left), to.min(right));
                // A joint as thin as rounding is none.
                if to - from > 1e-9 * length {
                    self.joint(Some(column), slab, [from, bottom], [to, bottom]);
                }
            }
        }
        Ok(())
    }
}

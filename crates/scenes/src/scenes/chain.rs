//! A hanging chain.

use super::{Family, Spread, count, crosswise};
use crate::error::{positive, require};
use crate::polyhedron::Polyhedron;
use crate::vec3::{Vec3, Z, grid};
use crate::{RigidBody, Scene, SceneError, Shape};

settings! {
    /// Links hang in each other from a fixed hook. A link is a rectangular frame of square bars; each is turned by a
    /// quarter about the vertical against the one above, and its upper bar rests on the lower bar of that one, in the square
    /// where they cross. `mass_ratio` is that of the lowest link to the uppermost.
    Chain {
        /// Number of links.
        links: usize = 10,
        /// Contacts of each joint, from 1 (in the middle of the square) to 4 (its corners); 2 lie on a diagonal.
        points: usize = 2,
        /// Outer length of a link, m.
        length: f64 = 0.06,
        /// Outer width of a link, m.
        width: f64 = 0.04,
        /// Side of a bar, m; less than a third of the width, so that a bar passes through a link.
        bar: f64 = 0.01,
    } with {
        density: 7800.0,
        mu: 0.3,
    }
}

impl Family for Chain {
    const NAME: &'static str = "chain";
    const SUMMARY: &'static str = "links that hang in each other";

    fn build(&self) -> Result<Scene, SceneError> {
        let common = self.common();
        let mut scene = common.scene(Self::NAME)?;
        count("links", self.links, 1..=100_000)?;
        count("points", self.points, 1..=4)?;
        positive("width", self.width)?;
        let (length, t) = (self.length, self.bar);
        let thin = t > 0.0 && t < self.width / 3.0;
        require("bar", t, thin, "a positive number below a third of the width")?;
        require("length", length, length > 3.0 * t, "a number above three times `bar`")?;

        // The hook is a bar along y at the height of the top of the first link's opening.
        let pitch = length - 2.0 * t;
        let top = pitch * self.links as f64 + 2.0 * t + 0.5 * length;
        // Odd links lie in the plane of y and z.
        let (a, b, c) = (0.5 * length, 0.5 * self.width, 0.5 * t);
        for k in 0..self.links {
            let at = [0.0, 0.0, top - a - pitch * k as f64];
            let bar =
                |low: Vec3, high: Vec3| Polyhedron::between(crosswise(k, low), crosswise(k, high));
            let parts = vec![
                bar([-b, -c, a - t], [b, c, a])?,
                bar([-b, -c, -a], [b, c, t - a])?,
                bar([-b, -c, t - a], [t - b, c, a - t])?,
                bar([b - t, -c, t - a], [b, c, a - t])?,
            ];
            let body = scene.push(RigidBody::solid(Shape::Compound(parts), self.density)?.at(at));
            let joint = [0.0, 0.0, at[2] + a - t];
            for p in self.square(joint) {
                scene.contacts.push(common.contact(k.checked_sub(1), body, p, Z));
            }
        }
        let hook = [[-c, -2.0 * b, top - 2.0 * t], [c, 2.0 * b, top - t]];
        scene.obstacles.push(Polyhedron::between(hook[0], hook[1])?.into());
        common.finish(scene, Spread::ByIndex)
    }
}

impl Chain {
    /// The contacts of the joint around `centre`.
    fn square(&self, centre: Vec3) -> Vec<Vec3> {
        if self.points == 1 {
            return vec![centre];
        }
        let (c, corners) = (0.5 * self.bar, [0, 3, 1, 2]);
        let square = grid(centre, [c, 0.0, 0.0], [0.0, c, 0.0], 2);
        corners[..self.points].iter().map(|&k| square[k]).collect()
    }
}

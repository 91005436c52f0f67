//! Worlds that repeat themselves.
//!
//! With the periods `p_k + t V_k` a body at x with velocity v has images at `x + Σ n_k (p_k + t V_k)` with velocities `v + Σ n_k V_k`, turned and turning as the body
//! itself, for all whole n; images touch as bodies do. With V = 0 what moves out on one side comes in on the other. With velocities these are Lees and Edwards'
//! conditions: `V_k = L p_k` shears or stretches the world at the rate L.
//!
//! Positions are never wrapped: a body that has gone round n times is n periods away, with its velocity there. So paths, potential energy and joints need to know nothing of
//! periods, and the image of one body that touches another stays the same number while they touch. Only detection and pictures bring bodies into the cell of the
//! reduced periods.
//!
//! Reference: LeesEdwards1972.

use nonsmooth_scenes::vec3::{Mat3, Vec3, add, apply, cross, dot, norm, scale, sub};
use serde::{Deserialize, Serialize};

use crate::error::{finite, require};
use crate::rotation::inverse;
use crate::{Body, Dimension, Shape, SimulateError, World};

/// How many of each period an image is away from its body.
pub(crate) type Image = [i32; 3];

/// A direction along which a world repeats itself.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Period {
    /// From a body to its image at t = 0, m.
    pub vector: Vec3,
    /// Of the image relative to the body, m/s.
    pub velocity: Vec3,
}

/// How a world repeats itself.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Periodic {
    /// The periods, at most as many as there are dimensions; none: the world does not repeat itself.
    pub periods: Vec<Period>,
    /// A corner of the cell in which pictures show the bodies, m.
    pub corner: Vec3,
}

/// Periods whose parallelepiped, parallelogram or length is smaller than this share of that of orthogonal ones of the same lengths are dependent.
const FLAT: f64 = 1e-6;

/// A plane is the same in all images where its normal has a smaller share along a period.
const ALONG: f64 = 1e-12;

impl Periodic {
    /// A world that repeats itself after these lengths along the axes, m, where they are not zero.
    pub fn along_axes(lengths: Vec3) -> Self {
        Self::sheared(lengths, [[0.0; 3]; 3])
    }

    /// The same, where the image a period p away moves with `gradient p` relative to the body, 1/s.
    pub fn sheared(lengths: Vec3, gradient: Mat3) -> Self {
        let along = |k: usize| std::array::from_fn(|i| if i == k { lengths[k] } else { 0.0 });
        let period = |k: usize| Period { vector: along(k), velocity: apply(&gradient, along(k)) };
        let periods = (0..3).filter(|&k| lengths[k] != 0.0).map(period).collect();
        Self { periods, corner: [0.0; 3] }
    }

    /// Whether images move relative to each other.
    pub(crate) fn moves(&self) -> bool {
        self.periods.iter().any(|p| p.velocity != [0.0; 3])
    }

    /// From a body to an image of it at t, and the velocity of the image relative to the body.
    pub(crate) fn offset(&self, image: Image, t: f64) -> (Vec3, Vec3) {
        let mut out = ([0.0; 3], [0.0; 3]);
        for (n, p) in image.into_iter().zip(&self.periods).filter(|n| n.0 != 0) {
            out.0 = add(out.0, scale(f64::from(n), add(p.vector, scale(t, p.velocity))));
            out.1 = add(out.1, scale(f64::from(n), p.velocity));
        }
        out
    }

    /// The velocity of the cell of a point relative to that of the lattice's corner, m/s.
    pub(crate) fn velocity_at(&self, lattice: &Lattice, x: Vec3) -> Vec3 {
        self.offset(lattice.image(lattice.cell(x)), 0.0).1
    }

    /// A bound on the velocity of neighbouring cells relative to each other, m/s.
    pub(crate) fn closing(&self, lattice: &Lattice) -> f64 {
        let unit = |k: usize| std::array::from_fn(|i| i32::from(i == k));
        let speed = |k: usize| norm(self.offset(lattice.image(unit(k)), 0.0).1);
        (0..self.periods.len()).map(speed).sum()
    }

    /// The lattice of images at t.
    pub(crate) fn lattice(&self, t: f64) -> Lattice {
        let mut lattice =
            Lattice { corner: self.corner, periods: vec![], numbers: vec![], duals: vec![] };
        for (k, p) in self.periods.iter().enumerate() {
            lattice.periods.push(add(p.vector, scale(t, p.velocity)));
            lattice.numbers.push(std::array::from_fn(|i| i64::from(i == k)));
        }
        lattice.reduce();
        lattice
    }

    /// Errors: periods that are none, at the start.
    pub(crate) fn validate(world: &World) -> Result<(), SimulateError> {
        let Self { periods, corner } = &world.periodic;
        finite(|| "periodic.corner".into(), corner)?;
        let most = if world.dimension == Dimension::Two { 2 } else { 3 };
        if periods.len() > most {
            let expected = format!("at most {most}, as there are dimensions");
            return Err(SimulateError::value("periodic.periods", expected, periods.len()));
        }
        for (k, p) in periods.iter().enumerate() {
            let key = |of: &str| format!("periodic.periods[{k}].{of}");
            finite(|| key("vector"), &p.vector)?;
            finite(|| key("velocity"), &p.velocity)?;
            require(|| key("vector"), norm(p.vector), p.vector != [0.0; 3], "a length")?;
            if world.dimension == Dimension::Two {
                let across = p.vector[2].abs() + p.velocity[2].abs();
                let expected = "0 as the third component, for the world is a plane";
                require(|| key("vector"), across, across == 0.0, expected)?;
            }
        }
        if periods.is_empty() {
            return Ok(());
        }
        if let Some(solid) = world.elastic.first() {
            let expected = "none in a periodic world: images of elastic boxes are not found";
            let found = format!("`{}`", solid.name);
            return Err(SimulateError::value("elastic[0]", expected, found));
        }
        for (k, body) in world.bodies.iter().enumerate() {
            for (s, part) in body.parts.iter().enumerate().filter(|p| p.1.shape == Shape::Plane) {
                let turn = body.rotation.after(part.rotation).matrix();
                let n: Vec3 = std::array::from_fn(|i| turn[i][2]);
                let across = |p: &Period| {
                    dot(n, p.vector).abs() > ALONG * norm(p.vector)
                        || dot(n, p.velocity).abs() > ALONG * norm(p.velocity)
                };
                if let Some(p) = periods.iter().find(|p| across(p)) {
                    let expected = format!(
                        "a plane along all periods, for its images fill the world: a normal across {:?}",
                        p.vector
                    );
                    let key = format!("{}.parts[{s}]", world.label(k));
                    return Err(SimulateError::value(key, expected, format!("{n:?}")));
                }
            }
        }
        world.periods_hold(0.0)
    }
}

/// The radius of the ball about the mass centre that holds what is finite of a body, m.
fn reach(body: &Body) -> f64 {
    let finite = body.parts.iter().filter(|p| p.shape.radius().is_finite());
    finite.map(|p| norm(p.position) + p.shape.radius()).fold(0.0, f64::max)
}

impl World {
    /// A position as pictures show it: that of the image in the cell at the corner of [`Periodic`], at time t; with the velocity that belongs to it.
    pub fn in_cell(&self, position: Vec3, velocity: Vec3, t: f64) -> (Vec3, Vec3) {
        if self.periodic.periods.is_empty() {
            return (position, velocity);
        }
        let lattice = self.periodic.lattice(t);
        let image = lattice.cell(position).map(|n| -n);
        let (offset, drift) = self.periodic.offset(lattice.image(image), t);
        (add(position, offset), add(velocity, drift))
    }

    /// The image of a point that is nearest to another one, or nearly so, and the way that it was moved.
    pub fn nearest_image(&self, point: Vec3, to: Vec3, t: f64) -> (Vec3, Vec3) {
        if self.periodic.periods.is_empty() {
            return (point, [0.0; 3]);
        }
        let lattice = self.periodic.lattice(t);
        let image = lattice.share(sub(to, point)).map(|x| x.round() as i32);
        let offset = self.periodic.offset(lattice.image(image), t).0;
        (add(point, offset), offset)
    }

    /// The periods at time t, m, reduced: of all that make the same images short ones.
    pub fn periods_at(&self, t: f64) -> Vec<Vec3> {
        self.periodic.lattice(t).periods
    }

    /// Errors: at time t periods are dependent, or so short that a body touches its own image, which is not done.
    pub(crate) fn periods_hold(&self, t: f64) -> Result<(), SimulateError> {
        if self.periodic.periods.is_empty() {
            return Ok(());
        }
        let lattice = self.periodic.lattice(t);
        let found = || format!("{:?} at t = {t} s", lattice.periods);
        if lattice.is_flat() {
            let expected = "periods that are independent of each other";
            return Err(SimulateError::value("periodic", expected, found()));
        }
        let shortest = lattice.shortest();
        let mut free = self.bodies.iter().enumerate().filter(|b| b.1.is_free());
        let Some((k, body)) = free.find(|b| 2.0 * reach(b.1) >= shortest) else { return Ok(()) };
        let expected = format!(
            "periods longer than {}, twice the reach of {}, which else may touch its own image",
            2.0 * reach(body),
            self.label(k)
        );
        let found = format!("one of {shortest} at t = {t} s");
        Err(SimulateError::value("periodic", expected, found))
    }
}

/// All images of a point at a time.
#[derive(Debug, Clone)]
pub(crate) struct Lattice {
    corner: Vec3,
    /// Periods that make the same images as those of the world and are short.
    pub periods: Vec<Vec3>,
    /// Of each how many of the periods of the world.
    numbers: Vec<[i64; 3]>,
    /// `duals[k] · periods[l] = δ_kl`, in the space that the periods span.
    duals: Vec<Vec3>,
}

impl Lattice {
    /// Takes whole multiples of periods from each other until none becomes shorter (Lagrange's and Gauss' reduction, by pairs), then makes the duals.
    fn reduce(&mut self) {
        let n = self.periods.len();
        let mut again = true;
        while again {
            again = false;
            for k in 0..n {
                for l in (0..n).filter(|&l| l != k) {
                    let (p, q) = (self.periods[k], self.periods[l]);
                    let times = (dot(p, q) / dot(q, q)).round();
                    let shorter = sub(p, scale(times, q));
                    // By more than rounding, else two of one length would change places for ever.
                    if dot(shorter, shorter) < (1.0 - 1e-9) * dot(p, p) {
                        self.periods[k] = shorter;
                        let other = self.numbers[l];
                        (0..3).for_each(|i| self.numbers[k][i] -= times as i64 * other[i]);
                        again = true;
                    }
                }
            }
        }
        // The inverse of Gram's matrix, which is that of the identity where there is no period.
        let mut gram = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        for k in 0..n {
            for l in 0..n {
                gram[k][l] = dot(self.periods[k], self.periods[l]);
            }
        }
        let back = inverse(&gram);
        let sum = |k: usize| {
            let each = self.periods.iter().enumerate();
            each.fold([0.0; 3], |s, (l, &p)| add(s, scale(back[k][l], p)))
        };
        self.duals = (0..n).map(sum).collect();
    }

    fn is_flat(&self) -> bool {
        let lengths: f64 = self.periods.iter().map(|&p| norm(p)).product();
        let content = match self.periods[..] {
            [p, q] => norm(cross(p, q)),
            [p, q, r] => dot(cross(p, q), r).abs(),
            _ => lengths,
        };
        content.is_nan() || content <= FLAT * lengths
    }

    /// The distance of the nearest two images, m.
    fn shortest(&self) -> f64 {
        let steps = |k: usize| if k < self.periods.len() { -1..=1 } else { 0..=0 };
        let mut least = f64::INFINITY;
        for i in steps(0) {
            for j in steps(1) {
                for k in steps(2) {
                    let sum = self.along([i, j, k]);
                    if [i, j, k] != [0; 3] {
                        least = least.min(norm(sum));
                    }
                }
            }
        }
        least
    }

    /// So many of each of the short periods.
    pub fn along(&self, image: Image) -> Vec3 {
        let each = image.into_iter().zip(&self.periods);
        each.fold([0.0; 3], |s, (n, &p)| add(s, scale(f64::from(n), p)))
    }

    /// The same image by the periods of the world.
    pub fn image(&self, reduced: Image) -> Image {
        let mut out = [0; 3];
        for (n, numbers) in reduced.into_iter().zip(&self.numbers) {
            (0..3).for_each(|i| out[i] += n * numbers[i] as i32);
        }
        out
    }

    /// How many of each of the short periods a way is, zero where there is none.
    pub fn share(&self, way: Vec3) -> Vec3 {
        std::array::from_fn(|k| self.duals.get(k).map_or(0.0, |&d| dot(d, way)))
    }

    /// The cell of a point.
    pub fn cell(&self, x: Vec3) -> Image {
        self.share(sub(x, self.corner)).map(|s| s.floor() as i32)
    }

    /// The least and the largest share of the points of a box.
    pub fn bounds(&self, low: Vec3, high: Vec3) -> [Vec3; 2] {
        let (middle, half) = (scale(0.5, add(low, high)), scale(0.5, sub(high, low)));
        let at = self.share(middle);
        let around: Vec3 = std::array::from_fn(|k| {
            self.duals.get(k).map_or(0.0, |d| (0..3).map(|i| d[i].abs() * half[i]).sum())
        });
        [sub(at, around), add(at, around)]
    }
}

/// Two shapes that may be near each other: the given image of the first and the second.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
pub(crate) struct Pair {
    pub first: u32,
    pub second: u32,
    #[serde(default)]
    pub image: Image,
}

impl Pair {
    /// Of two shapes where they are.
    pub fn of(i: u32, j: u32) -> Self {
        Self { first: i.min(j), second: i.max(j), image: [0; 3] }
    }
}

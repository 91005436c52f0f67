//! The broad phase of a world that repeats itself: pairs of a box along the axes and an image of another.
//!
//! Boxes are brought into the cell at the corner of the lattice. The images of the small ones that may reach what is in the cell are boxes like others, and the broad
//! phase finds which of them meet; of the two ways to see a pair, that with an image of the earlier box is kept. What is wider than half the cell would have every other box
//! make many images, and is compared with all instead. Cost: that of the broad phase with the images, some `6 (V/cell)^{1/3}` of the boxes where these are small.

use nonsmooth_scenes::vec3::{Vec3, add, scale};

use super::broad::{Aabb, Broad};
use crate::crew::Crew;
use crate::periodic::{Image, Lattice, Pair};

/// What is wider than this share of a period is compared with all.
const WIDE: f64 = 0.5;

/// Buffers.
#[derive(Debug, Clone, Default)]
pub(crate) struct Images {
    /// The boxes in the cell, then images of the small ones.
    boxes: Vec<Aabb>,
    /// Where these are, in shares of the periods.
    bounds: Vec<[Vec3; 2]>,
    moves: Vec<bool>,
    /// The place of each box, and which image of it.
    of: Vec<(u32, Image)>,
    /// Of each place the cell that it was brought from.
    cells: Vec<Image>,
    wide: Vec<u32>,
    found: Vec<(u32, u32)>,
    broad: Broad,
}

impl Aabb {
    /// Moved by an offset.
    pub fn moved(&self, by: Vec3) -> Self {
        Self { low: add(self.low, by), high: add(self.high, by) }
    }
}

impl Images {
    /// Appends all pairs of a box and an image of an earlier one that meet, by the periods of the world, not sorted; `centres` are the bodies' that boxes belong to, and one of the two must move.
    pub fn pairs(
        &mut self,
        lattice: &Lattice,
        (boxes, moves): (&[Aabb], &[bool]),
        centres: impl Fn(usize) -> Vec3,
        crew: &Crew,
        out: &mut Vec<Pair>,
    ) {
        self.wrap(lattice, boxes, centres);
        let Self { boxes: wrapped, bounds, cells, of, wide, broad, found, moves: all, .. } = self;
        let mut tell = |i: u32, j: u32, m: Image| {
            let (c, d) = (cells[i as usize], cells[j as usize]);
            let image = std::array::from_fn(|k| m[k] - c[k] + d[k]);
            out.push(Pair { first: i, second: j, image: lattice.image(image) });
        };
        for (place, &w) in wide.iter().enumerate() {
            // Those wide ones that come later see this one.
            for j in (0..boxes.len() as u32).filter(|j| !wide[place..].contains(j)) {
                let (i, j) = (w.min(j), w.max(j));
                if !(moves[i as usize] || moves[j as usize]) {
                    continue;
                }
                let (p, q) = (bounds[i as usize], bounds[j as usize]);
                images_between(p, q, |m| {
                    let there = wrapped[i as usize].moved(lattice.along(m));
                    if there.meets(&wrapped[j as usize]) {
                        tell(i, j, m);
                    }
                });
            }
        }
        // What the small ones cover together.
        let small = |k: &usize| !wide.contains(&(*k as u32));
        let mut region = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for k in (0..boxes.len()).filter(small) {
            for i in 0..3 {
                region[0][i] = region[0][i].min(bounds[k][0][i]);
                region[1][i] = region[1][i].max(bounds[k][1][i]);
            }
        }
        let here = std::mem::take(wrapped);
        of.clear();
        for k in (0..boxes.len()).filter(small) {
            of.push((k as u32, [0; 3]));
        }
        for k in (0..boxes.len()).filter(small) {
            images_between(bounds[k], region, |m| {
                if m != [0; 3] {
                    of.push((k as u32, m));
                }
            });
        }
        all.clear();
        for &(k, m) in of.iter() {
            let own = &here[k as usize];
            wrapped.push(if m == [0; 3] { *own } else { own.moved(lattice.along(m)) });
            all.push(moves[k as usize]);
        }
        found.clear();
        broad.pairs(wrapped, all, crew, found);
        for &(p, q) in found.iter() {
            let ((j, here), (i, m)) = (of[p as usize], of[q as usize]);
            match (here == [0; 3], m == [0; 3]) {
                (true, true) => tell(j, i, [0; 3]),
                (true, false) if i < j => tell(i, j, m),
                _ => {}
            }
        }
    }

    fn wrap(&mut self, lattice: &Lattice, boxes: &[Aabb], centres: impl Fn(usize) -> Vec3) {
        let Self { boxes: wrapped, bounds, cells, wide, .. } = self;
        wrapped.clear();
        bounds.clear();
        cells.clear();
        wide.clear();
        for (k, own) in boxes.iter().enumerate() {
            let cell = lattice.cell(centres(k));
            let there = own.moved(scale(-1.0, lattice.along(cell)));
            let reach = lattice.bounds(there.low, there.high);
            if (0..3).any(|i| reach[1][i] - reach[0][i] > WIDE) {
                wide.push(k as u32);
            }
            wrapped.push(there);
            bounds.push(reach);
            cells.push(cell);
        }
    }
}

/// The images of what lies between the bounds p that may meet what lies between q.
fn images_between(p: [Vec3; 2], q: [Vec3; 2], mut each: impl FnMut(Image)) {
    // Rounding must not lose what just touches.
    const SLACK: f64 = 1e-9;
    let ends: [[i32; 2]; 3] = std::array::from_fn(|k| {
        let least = (q[0][k] - p[1][k] - SLACK).ceil() as i32;
        let most = (q[1][k] - p[0][k] + SLACK).floor() as i32;
        [least, most]
    });
    for x in ends[0][0]..=ends[0][1] {
        for y in ends[1][0]..=ends[1][1] {
            for z in ends[2][0]..=ends[2][1] {
                each([x, y, z]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::periodic::{Period, Periodic};
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    /// Against all images near the boxes, of boxes in any cells, in lattices of one to three periods, some of them skew.
    #[test]
    fn every_image_that_meets_is_found_once() {
        let mut rng = Pcg64::seed_from_u64(5);
        let skew = |k: usize, x: Vec3| Period {
            vector: std::array::from_fn(|i| if i == k { 4.0 } else { x[i] }),
            velocity: [0.0; 3],
        };
        let cases = [
            (80, vec![skew(0, [0.0; 3])], 1.0, [9.0, 1.0, 1.0], 6),
            (150, vec![skew(0, [0.0; 3]), skew(1, [0.0; 3]), skew(2, [0.0; 3])], 0.9, [9.0; 3], 6),
            (
                40,
                vec![skew(0, [0.0; 3]), skew(1, [0.0; 3]), skew(2, [9.7, 0.5, 0.0])],
                1.2,
                [9.0; 3],
                20,
            ),
            (
                30,
                vec![skew(1, [0.3, 0.0, 0.0]), skew(2, [0.0, 6.5, 0.0])],
                3.0,
                [1.0, 9.0, 9.0],
                20,
            ),
        ];
        for (n, periods, size, spread, most) in cases {
            let periodic = Periodic { periods, corner: [-1.0, 0.5, 0.0] };
            let lattice = periodic.lattice(0.0);
            let mut boxes: Vec<Aabb> = vec![];
            for _ in 0..n {
                let low: Vec3 = spread.map(|far| rng.random_range(-far..far));
                let side = rng.random_range(0.2..=1.0) * size;
                boxes.push(Aabb { low, high: low.map(|x| x + side) });
            }
            let moves: Vec<bool> = (0..n).map(|k| k % 5 != 0).collect();
            let mut found = vec![];
            let centre = |k: usize| boxes[k].low;
            Images::default().pairs(&lattice, (&boxes, &moves), centre, &Crew::new(1), &mut found);
            found.sort_unstable();
            let mut truth = vec![];
            let used = |k: usize| if k < periodic.periods.len() { -most..=most } else { 0..=0 };
            for (i, p) in boxes.iter().enumerate() {
                for (j, q) in boxes.iter().enumerate().skip(i + 1) {
                    for image in used(0)
                        .flat_map(|x| used(1).flat_map(move |y| used(2).map(move |z| [x, y, z])))
                    {
                        let there = p.moved(periodic.offset(image, 0.0).0);
                        if (moves[i] || moves[j]) && there.meets(q) {
                            truth.push(Pair { first: i as u32, second: j as u32, image });
                        }
                    }
                }
            }
            truth.sort_unstable();
            assert!(truth.len() > 10, "{}", truth.len());
            assert_eq!(found, truth);
        }
    }
}

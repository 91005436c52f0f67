//! The broad phase: pairs of boxes along the axes that meet.
//!
//! A grid whose cells are as large as the largest of the boxes whose sizes are alike; those that are much larger (floors, walls) ask it for the rows of cells that they lie in, and have
//! a coarser grid among themselves. Cost: O(n log n) and the pairs in neighbouring cells.

use nonsmooth_scenes::vec3::Vec3;

use crate::crew::Crew;

/// A box along the axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Aabb {
    pub low: Vec3,
    pub high: Vec3,
}

impl Aabb {
    #[inline]
    pub fn meets(&self, other: &Self) -> bool {
        (0..3).all(|k| self.low[k] <= other.high[k] && other.low[k] <= self.high[k])
    }

    /// Larger by so much on all sides.
    pub fn grown(&self, by: f64) -> Self {
        Self { low: self.low.map(|x| x - by), high: self.high.map(|x| x + by) }
    }

    /// How far x is from it; zero within.
    pub fn distance(&self, x: Vec3) -> f64 {
        let beyond = |k: usize| (self.low[k] - x[k]).max(x[k] - self.high[k]).max(0.0);
        (0..3).map(|k| beyond(k) * beyond(k)).sum::<f64>().sqrt()
    }

    /// Whether a ray from x meets it, made larger by `margin`.
    pub fn is_on(&self, x: Vec3, ray: Vec3, margin: f64) -> bool {
        let (mut from, mut to) = (0.0, f64::INFINITY);
        for k in 0..3 {
            let (low, high) = (self.low[k] - margin - x[k], self.high[k] + margin - x[k]);
            if ray[k] == 0.0 {
                if low > 0.0 || high < 0.0 {
                    return false;
                }
            } else {
                let (a, b) = (low / ray[k], high / ray[k]);
                (from, to) = (f64::max(from, a.min(b)), f64::min(to, a.max(b)));
            }
        }
        from <= to
    }

    fn extent(&self) -> f64 {
        (0..3).map(|k| self.high[k] - self.low[k]).fold(0.0, f64::max)
    }
}

/// Below this number a sweep is as fast as anything.
const FEW: usize = 64;
/// Boxes larger than this many times the median wait for a grid of their own.
const LARGE: f64 = 4.0;
/// A row of cells costs as much to find as so many boxes to compare with.
const ROW: usize = 16;

/// Buffers of the broad phase.
#[derive(Debug, Clone, Default)]
pub(crate) struct Broad {
    extents: Vec<f64>,
    rest: Vec<u32>,
    large: Vec<u32>,
    grid: Grid,
    /// What is found in each part of the cells.
    parts: Vec<Vec<(u32, u32)>>,
}

impl Broad {
    /// Appends all pairs `(i, j)`, `i < j`, of boxes that meet, in any order; `moves` says which can move: pairs of which neither does are left out.
    pub fn pairs(
        &mut self,
        boxes: &[Aabb],
        moves: &[bool],
        crew: &Crew,
        out: &mut Vec<(u32, u32)>,
    ) {
        let note = |out: &mut Vec<(u32, u32)>, i: u32, j: u32| {
            let (p, q) = (i.min(j), i.max(j));
            if (moves[p as usize] || moves[q as usize])
                && boxes[p as usize].meets(&boxes[q as usize])
            {
                out.push((p, q));
            }
        };
        let Self { extents, rest, large, grid, parts } = self;
        rest.clear();
        rest.extend(0..boxes.len() as u32);
        while rest.len() > FEW {
            extents.clear();
            extents.extend(rest.iter().map(|&i| boxes[i as usize].extent()));
            let (_, median, _) = extents.select_nth_unstable_by(rest.len() / 2, f64::total_cmp);
            let most = LARGE * *median;
            large.clear();
            rest.retain(|&i| {
                let is_large = boxes[i as usize].extent() > most;
                if is_large {
                    large.push(i);
                }
                !is_large
            });
            grid.fill(boxes, rest, crew);
            let count = crew.parts(grid.cells.len());
            parts.resize_with(parts.len().max(count), Vec::new);
            let (grid, larger) = (&*grid, &large[..]);
            let own = |all: usize, k: usize| {
                let share = all.div_ceil(count).max(1);
                all.min(share * k)..all.min(share * (k + 1))
            };
            let all = (0..count, &mut parts[..count]);
            crew.spread(all, grid.cells.len(), |(numbers, parts)| {
                for (k, part) in numbers.zip(parts) {
                    part.clear();
                    neighbours(&grid.cells, own(grid.cells.len(), k), &mut |i, j| {
                        note(part, i, j);
                    });
                    for &i in &larger[own(larger.len(), k)] {
                        grid.beside(&boxes[i as usize], &mut |j| note(part, i, j));
                    }
                }
            });
            parts[..count].iter().for_each(|part| out.extend_from_slice(part));
            std::mem::swap(rest, large);
        }
        sweep(boxes, rest, &mut |i, j| note(out, i, j));
    }
}

fn sweep(boxes: &[Aabb], order: &mut [u32], found: &mut impl FnMut(u32, u32)) {
    let low = |i: u32| boxes[i as usize].low[0];
    order.sort_unstable_by(|&i, &j| low(i).total_cmp(&low(j)).then(i.cmp(&j)));
    for (k, &i) in order.iter().enumerate() {
        let high = boxes[i as usize].high[0];
        order[k + 1..].iter().take_while(|&&j| low(j) <= high).for_each(|&j| found(i, j));
    }
}

/// Boxes by the cells that their middles are in; none is larger than a cell.
#[derive(Debug, Clone, Default)]
struct Grid {
    /// Sorted. Cells have three numbers of 20 bits, the first in the lowest; one is never the last, so neighbours do not wrap.
    cells: Vec<(u64, u32)>,
    low: Vec3,
    high: Vec3,
    side: f64,
}

impl Grid {
    fn fill(&mut self, boxes: &[Aabb], which: &[u32], crew: &Crew) {
        const MOST: f64 = 1_000_000.0;
        let middle =
            |i: u32, k: usize| 0.5 * (boxes[i as usize].low[k] + boxes[i as usize].high[k]);
        let (mut low, mut high, mut side) = ([f64::MAX; 3], [f64::MIN; 3], 0.0_f64);
        for &i in which {
            side = side.max(boxes[i as usize].extent());
            for k in 0..3 {
                low[k] = low[k].min(middle(i, k));
                high[k] = high[k].max(middle(i, k));
            }
        }
        // A body that flew far away must not run out of numbers, nor two that just touch be two cells apart by rounding.
        let side = (0..3).map(|k| (high[k] - low[k]) / MOST).fold(side, f64::max);
        let mut cells = std::mem::take(&mut self.cells);
        *self = Self { cells: vec![], low, high, side: side * (1.0 + 1e-9) };
        cells.clear();
        cells.extend(which.iter().map(|&i| {
            let [x, y, z] = [0, 1, 2].map(|k| self.number(middle(i, k), k));
            (x | y << 20 | z << 40, i)
        }));
        crew.sort_by_key(&mut cells, |c| *c);
        self.cells = cells;
    }

    /// The number of the cell along axis k.
    fn number(&self, x: f64, k: usize) -> u64 {
        1 + ((x - self.low[k]) / self.side) as u64
    }

    /// Calls with the boxes that may meet one that is larger than a cell.
    fn beside(&self, large: &Aabb, found: &mut impl FnMut(u32)) {
        // Middles are at most half a cell away.
        let number = |x: f64, k: usize| self.number(x.clamp(self.low[k], self.high[k]), k);
        let first = [0, 1, 2].map(|k| number(large.low[k] - 0.5 * self.side, k));
        let last = [0, 1, 2].map(|k| number(large.high[k] + 0.5 * self.side, k));
        let rows = (1..3).map(|k| (last[k] - first[k] + 1) as f64).product::<f64>();
        if rows * ROW as f64 > self.cells.len() as f64 {
            return self.cells.iter().for_each(|c| found(c.1));
        }
        for z in first[2]..=last[2] {
            for y in first[1]..=last[1] {
                let row = y << 20 | z << 40;
                let start = self.cells.partition_point(|c| c.0 < first[0] | row);
                let within = self.cells[start..].iter().take_while(|c| c.0 <= last[0] | row);
                within.for_each(|c| found(c.1));
            }
        }
    }
}

/// The pairs of the boxes at these places with those that come later in the same or a neighbouring cell.
fn neighbours(cells: &[(u64, u32)], own: std::ops::Range<usize>, found: &mut impl FnMut(u32, u32)) {
    // Neighbouring rows that come later: (0, +1), (+1, −1), (+1, 0), (+1, +1) in the second and third direction.
    let rows = [1_u64 << 20, (1 << 40) - (1 << 20), 1 << 40, (1 << 40) + (1 << 20)];
    let begin = cells.get(own.start).map_or(0, |c| c.0);
    let mut starts = rows.map(|row| cells.partition_point(|c| c.0 < begin + row - 1));
    for k in own {
        let (here, i) = cells[k];
        cells[k + 1..].iter().take_while(|c| c.0 <= here + 1).for_each(|c| found(i, c.1));
        for (row, start) in rows.iter().zip(&mut starts) {
            // Cells are visited in order, so the beginning of a row only moves forwards.
            let first = here + row - 1;
            while *start < cells.len() && cells[*start].0 < first {
                *start += 1;
            }
            cells[*start..].iter().take_while(|c| c.0 <= first + 2).for_each(|c| found(i, c.1));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    #[test]
    fn every_pair_that_meets_is_found_once() {
        let mut rng = Pcg64::seed_from_u64(3);
        for (n, spread, large) in
            [(40, 6.0, 0), (500, 1.0, 2), (500, 8.0, 0), (700, 1.0, 100), (3000, 0.1, 300)]
        {
            let mut boxes = vec![];
            for k in 0..n {
                // Some much larger, and of these a few much larger still.
                let size = match k {
                    k if k < large && k % 40 == 0 => 20.0,
                    k if k < large => rng.random_range(3.0..4.0),
                    _ => rng.random_range(0.5..=0.5 + spread),
                };
                let low: Vec3 = std::array::from_fn(|_| rng.random_range(-9.0..9.0));
                boxes.push(Aabb { low, high: low.map(|x| x + size) });
            }
            let moves: Vec<bool> = (0..n).map(|k| k % 7 != 0).collect();
            let found_by = |threads: usize| {
                let mut found = vec![];
                Broad::default().pairs(&boxes, &moves, &Crew::new(threads), &mut found);
                found.sort_unstable();
                found
            };
            let all = (0..n as u32).flat_map(|i| (i + 1..n as u32).map(move |j| (i, j)));
            let truth: Vec<_> = all
                .filter(|&(i, j)| {
                    (moves[i as usize] || moves[j as usize])
                        && boxes[i as usize].meets(&boxes[j as usize])
                })
                .collect();
            assert!(truth.len() > 10);
            assert!([1, 2, 3].iter().all(|&threads| found_by(threads) == truth));
        }
    }

    /// In floating point the middles of two that touch may be a little farther apart than either is long.
    #[test]
    fn boxes_that_just_touch_are_found_wherever_cells_begin() {
        for (start, side) in [(1.7, 0.1), (-3.3, 0.1), (10.1, 0.3), (0.0, 0.017), (100.1, 1.1)] {
            let mut at = start;
            let boxes: Vec<Aabb> = (0..100)
                .map(|_| {
                    let low = [at, 0.0, 0.0];
                    at += side;
                    Aabb { low, high: [at, side, side] }
                })
                .collect();
            let mut found = vec![];
            Broad::default().pairs(&boxes, &[true; 100], &Crew::new(1), &mut found);
            found.sort_unstable();
            assert!(found.into_iter().eq((0..99).map(|k| (k, k + 1))));
        }
    }
}

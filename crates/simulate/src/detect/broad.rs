//! The broad phase: pairs of boxes along the axes that meet.
//!
//! A grid whose cells are as large as the largest box where sizes are alike, a sweep along the first axis else; a few boxes that are much larger than the
//! rest (floors, walls) are compared with all. Cost: O(n log n) and the pairs in neighbouring cells.

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

    fn extent(&self) -> f64 {
        (0..3).map(|k| self.high[k] - self.low[k]).fold(0.0, f64::max)
    }
}

/// Below this number a sweep is as fast as anything.
const FEW: usize = 64;
/// Boxes larger than this many times the median are compared with all.
const LARGE: f64 = 4.0;

/// Buffers of the broad phase.
#[derive(Debug, Clone, Default)]
pub(crate) struct Broad {
    extents: Vec<f64>,
    large: Vec<u32>,
    rest: Vec<u32>,
    cells: Vec<(u64, u32)>,
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
        let mut found = |i, j| note(out, i, j);
        let n = boxes.len();
        self.rest.clear();
        self.large.clear();
        if n <= FEW {
            self.rest.extend(0..n as u32);
            sweep(boxes, &mut self.rest, &mut found);
        } else {
            self.extents.clear();
            self.extents.extend(boxes.iter().map(Aabb::extent));
            let (_, median, _) = self.extents.select_nth_unstable_by(n / 2, f64::total_cmp);
            let most = LARGE * *median;
            for (k, b) in boxes.iter().enumerate() {
                if b.extent() > most { &mut self.large } else { &mut self.rest }.push(k as u32);
            }
            if self.large.len() > FEW {
                self.rest.extend_from_slice(&self.large);
                self.large.clear();
                sweep(boxes, &mut self.rest, &mut found);
            } else {
                for (k, &i) in self.large.iter().enumerate() {
                    self.large[k + 1..].iter().chain(&self.rest).for_each(|&j| found(i, j));
                }
                let Self { rest, cells, parts, .. } = self;
                sort_into_cells(boxes, rest, cells, crew);
                let count = crew.parts(cells.len());
                parts.resize_with(parts.len().max(count), Vec::new);
                let share = cells.len().div_ceil(count).max(1);
                crew.spread((0..count, &mut parts[..count]), cells.len(), |(numbers, parts)| {
                    for (k, part) in numbers.zip(parts) {
                        part.clear();
                        let all = cells.len();
                        let own = all.min(share * k)..all.min(share * (k + 1));
                        neighbours(cells, own, &mut |i, j| note(part, i, j));
                    }
                });
                parts[..count].iter().for_each(|part| out.extend_from_slice(part));
            }
        }
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

/// Cells have three numbers of 20 bits, the first in the lowest; one is never the last, so neighbours do not wrap.
fn sort_into_cells(boxes: &[Aabb], which: &[u32], cells: &mut Vec<(u64, u32)>, crew: &Crew) {
    const MOST: f64 = 1_000_000.0;
    let centre = |i: u32, k: usize| 0.5 * (boxes[i as usize].low[k] + boxes[i as usize].high[k]);
    let (mut low, mut high, mut side) = ([f64::MAX; 3], [f64::MIN; 3], 0.0_f64);
    for &i in which {
        side = side.max(boxes[i as usize].extent());
        for k in 0..3 {
            low[k] = low[k].min(centre(i, k));
            high[k] = high[k].max(centre(i, k));
        }
    }
    // A body that flew far away must not run out of numbers.
    let side = (0..3).map(|k| (high[k] - low[k]) / MOST).fold(side, f64::max);
    let cell = |i: u32| {
        let [x, y, z] = [0, 1, 2].map(|k| 1 + ((centre(i, k) - low[k]) / side) as u64);
        x | y << 20 | z << 40
    };
    cells.clear();
    cells.extend(which.iter().map(|&i| (cell(i), i)));
    crew.sort_by_key(cells, |c| *c);
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
        for (n, spread, large) in [(40, 6.0, 0), (500, 1.0, 2), (500, 8.0, 0), (700, 1.0, 100)] {
            let mut boxes = vec![];
            for k in 0..n {
                let size = if k < large { 20.0 } else { rng.random_range(0.5..=0.5 + spread) };
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
}

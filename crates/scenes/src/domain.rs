//! A box with walls or periodic sides, and the grid of cells by which points find their neighbours in it.

use nonsmooth_linalg::budget;
use rand::RngExt;
use rand_pcg::Pcg64;

use crate::vec3::{Vec3, add, dot, sub};

/// What bounds a domain along one axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sides {
    /// A wall at 0 and one at the size.
    Walls,
    /// A wall at 0 alone.
    Floor,
    /// The upper side is the lower one again.
    Periodic,
}

/// The box from 0 to `size`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Domain {
    pub size: Vec3,
    pub sides: [Sides; 3],
}

/// One wall of a domain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Wall {
    pub axis: usize,
    /// Where it is along the axis.
    pub at: f64,
    /// The inward normal along the axis, 1 or −1.
    pub inward: f64,
}

impl Wall {
    /// The distance of a point, positive inside.
    pub fn distance(&self, p: Vec3) -> f64 {
        self.inward * (p[self.axis] - self.at)
    }

    /// Its point on the axis.
    pub fn point(&self) -> Vec3 {
        std::array::from_fn(|k| if k == self.axis { self.at } else { 0.0 })
    }

    /// The inward normal.
    pub fn normal(&self) -> Vec3 {
        std::array::from_fn(|k| if k == self.axis { self.inward } else { 0.0 })
    }
}

impl Domain {
    pub fn periodic(&self, axis: usize) -> bool {
        self.sides[axis] == Sides::Periodic
    }

    /// The walls, the lower one of each axis first.
    pub fn walls(&self) -> impl Iterator<Item = Wall> + '_ {
        (0..6).filter_map(|k| {
            let (axis, upper) = (k / 2, k % 2 == 1);
            match (self.sides[axis], upper) {
                (Sides::Walls | Sides::Floor, false) => Some(Wall { axis, at: 0.0, inward: 1.0 }),
                (Sides::Walls, true) => Some(Wall { axis, at: self.size[axis], inward: -1.0 }),
                _ => None,
            }
        })
    }

    /// A uniform random point.
    pub fn point(&self, rng: &mut Pcg64) -> Vec3 {
        self.size.map(|x| x * rng.random::<f64>())
    }

    /// The image of a point inside the domain.
    pub fn wrap(&self, mut p: Vec3) -> Vec3 {
        for k in (0..3).filter(|&k| self.periodic(k)) {
            p[k] = p[k].rem_euclid(self.size[k]);
            // A tiny negative number comes out as the size itself.
            if p[k] >= self.size[k] {
                p[k] = 0.0;
            }
        }
        p
    }
}

/// Points between two looks at the limits.
const CHUNK: usize = 1024;

/// Points sorted into cells, by index.
pub(crate) struct Grid {
    domain: Domain,
    low: Vec3,
    /// The sides of a cell.
    pub cell: Vec3,
    count: [usize; 3],
    start: Vec<u32>,
    order: Vec<u32>,
}

impl Grid {
    /// Sorts points of a domain (wrapped, where it is periodic) into cells of at least `side`.
    pub fn new(domain: &Domain, points: &[Vec3], side: f64) -> Self {
        let (mut low, mut high) = ([0.0; 3], domain.size);
        for k in (0..3).filter(|&k| !domain.periodic(k)) {
            for p in points {
                low[k] = f64::min(low[k], p[k]);
                high[k] = f64::max(high[k], p[k]);
            }
        }
        // No more cells than points need, else a stray point would make millions.
        let most = (2.0 * (points.len() as f64).cbrt()).ceil() as usize + 2;
        let extent = sub(high, low);
        let count = extent.map(|x| ((x / side) as usize).clamp(1, 8 * most));
        let cell = std::array::from_fn(|k| extent[k] / count[k] as f64);
        let mut grid =
            Self { domain: *domain, low, cell, count, start: vec![], order: vec![0; points.len()] };
        let places: Vec<usize> = points.iter().map(|&p| grid.flat(grid.cell_of(p))).collect();
        let mut start = vec![0u32; count.iter().product::<usize>() + 1];
        places.iter().for_each(|&c| start[c + 1] += 1);
        for c in 1..start.len() {
            start[c] += start[c - 1];
        }
        let mut next = start.clone();
        for (i, &c) in places.iter().enumerate() {
            grid.order[next[c] as usize] = i as u32;
            next[c] += 1;
        }
        grid.start = start;
        grid
    }

    /// The cell of a point.
    pub fn cell_of(&self, p: Vec3) -> [isize; 3] {
        std::array::from_fn(|k| {
            let at = ((p[k] - self.low[k]) / self.cell[k]) as isize;
            at.clamp(0, self.count[k] as isize - 1)
        })
    }

    /// The points of a cell and the offset of the image in which it lies; nothing beyond a wall.
    pub fn points_of(&self, cell: [isize; 3]) -> Option<(&[u32], Vec3)> {
        let mut offset = [0.0; 3];
        let mut inside = cell;
        for k in 0..3 {
            let n = self.count[k] as isize;
            if self.domain.periodic(k) {
                inside[k] = cell[k].rem_euclid(n);
                offset[k] = cell[k].div_euclid(n) as f64 * self.domain.size[k];
            } else if !(0..n).contains(&cell[k]) {
                return None;
            }
        }
        let c = self.flat(inside);
        Some((&self.order[self.start[c] as usize..self.start[c + 1] as usize], offset))
    }

    /// Whether no cell lies `ring` cells away from any other: only walls do.
    pub fn ends_before(&self, ring: usize) -> bool {
        (0..3).all(|k| !self.domain.periodic(k) && ring >= self.count[k])
    }

    fn flat(&self, cell: [isize; 3]) -> usize {
        let [i, j, k] = cell.map(|x| x as usize);
        (k * self.count[1] + j) * self.count[0] + i
    }

    /// All pairs closer than `reach`, as `(i, j, offset)` with j's image at its point plus the offset; each once. Some of them where the limits in force are over.
    pub fn pairs(&self, points: &[Vec3], reach: f64) -> Vec<(u32, u32, Vec3)> {
        let m: [isize; 3] = self.cell.map(|x| (reach / x).ceil().max(1.0) as isize);
        let mut out = vec![];
        for (i, &p) in points.iter().enumerate() {
            if i % CHUNK == 0 && budget::over() {
                break;
            }
            let at = self.cell_of(p);
            for dz in -m[2]..=m[2] {
                for dy in -m[1]..=m[1] {
                    for dx in -m[0]..=m[0] {
                        let cell = [at[0] + dx, at[1] + dy, at[2] + dz];
                        let Some((near, offset)) = self.points_of(cell) else { continue };
                        for &j in near {
                            // Of a body and its own image one of the two directions.
                            let first = i < j as usize || (i == j as usize && offset > [0.0; 3]);
                            let d = sub(add(points[j as usize], offset), p);
                            if first && dot(d, d) < reach * reach {
                                out.push((i as u32, j, offset));
                            }
                        }
                    }
                }
            }
        }
        out
    }
}

//! Voronoi cells of points in a box, with walls or periodic.
//!
//! The cell of a seed is the box cut by the planes midway to the other seeds, from the nearest outwards, until the rest is too
//! far to reach it: a seed farther than twice the farthest vertex cuts nothing.
//!
//! Where the limits in force ([`budget`]) are over, the cells end early: whoever makes a scene of them looks at them, too.

use nonsmooth_linalg::budget;

use crate::domain::{Domain, Grid, Wall};
use crate::polyhedron::Polyhedron;
use crate::vec3::{Vec3, add, dot, mean, norm, scale, sub};

/// What lies beyond a face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Beyond {
    /// The image of the cell of a seed, shifted by the offset.
    Cell(usize, Vec3),
    Wall(Wall),
    /// Nothing: the box from which the cutting starts, along periodic axes.
    Start,
}

/// A convex cell with what lies beyond each face.
#[derive(Debug, Clone)]
pub(crate) struct Cell {
    vertices: Vec<Vec3>,
    faces: Vec<(Vec<usize>, Beyond)>,
}

/// The cells of the seeds, which must lie inside the domain (a floor counts as two walls); of the first ones alone where the limits in force are over.
pub(crate) fn cells(domain: &Domain, seeds: &[Vec3]) -> Vec<Cell> {
    let volume: f64 = domain.size.iter().product();
    let grid = Grid::new(domain, seeds, (volume / seeds.len() as f64).cbrt());
    let mut near = vec![];
    let cell = |(i, &seed): (usize, &Vec3)| {
        let mut cell = Cell::start(domain, seed);
        let at = grid.cell_of(seed);
        let side = grid.cell.iter().copied().fold(f64::INFINITY, f64::min);
        for ring in 0_usize.. {
            // Whatever is in this ring or farther out is at least so far away.
            let distance = side * ring.saturating_sub(1) as f64;
            if distance > 2.0 * cell.radius_about(seed) || grid.ends_before(ring) {
                break;
            }
            near.clear();
            for step in shell(ring as isize) {
                let there = std::array::from_fn(|k| at[k] + step[k]);
                let Some((points, offset)) = grid.points_of(there) else { continue };
                for &j in points.iter().filter(|&&j| j as usize != i || offset != [0.0; 3]) {
                    let d = sub(add(seeds[j as usize], offset), seed);
                    near.push((dot(d, d), j as usize, offset, d));
                }
            }
            near.sort_by(|a, b| a.0.total_cmp(&b.0));
            for &(square, j, offset, d) in &near {
                if square.sqrt() > 2.0 * cell.radius_about(seed) {
                    break;
                }
                let normal = scale(1.0 / square.sqrt(), d);
                let plane = dot(normal, seed) + 0.5 * square.sqrt();
                cell.cut(normal, plane, Beyond::Cell(j, offset));
            }
        }
        cell
    };
    seeds.iter().enumerate().take_while(|_| !budget::over()).map(cell).collect()
}

/// The steps to the cells of a cubic shell.
fn shell(ring: isize) -> impl Iterator<Item = [isize; 3]> {
    let all = -ring..=ring;
    all.clone().flat_map(move |k| {
        let all = all.clone();
        all.clone().flat_map(move |j| {
            let outer = k.abs() == ring || j.abs() == ring;
            let step = if outer || ring == 0 { 1 } else { 2 * ring as usize };
            all.clone().step_by(step).map(move |i| [i, j, k])
        })
    })
}

impl Cell {
    /// The domain, along periodic axes as far as the cell may reach.
    fn start(domain: &Domain, seed: Vec3) -> Self {
        let reach = |k: usize| match domain.periodic(k) {
            true => [seed[k] - domain.size[k], seed[k] + domain.size[k]],
            false => [0.0, domain.size[k]],
        };
        let [x, y, z] = [0, 1, 2].map(reach);
        let vertices = (0..8).map(|k| [x[k & 1], y[k >> 1 & 1], z[k >> 2]]).collect();
        let loops =
            [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let faces = loops.iter().enumerate().map(|(f, corners)| {
            let (axis, upper) = (f / 2, f % 2);
            let beyond = match domain.periodic(axis) {
                true => Beyond::Start,
                false => Beyond::Wall(Wall {
                    axis,
                    at: domain.size[axis] * upper as f64,
                    inward: 1.0 - 2.0 * upper as f64,
                }),
            };
            (corners.to_vec(), beyond)
        });
        Self { vertices, faces: faces.collect() }
    }

    fn radius_about(&self, p: Vec3) -> f64 {
        self.vertices.iter().map(|&v| norm(sub(v, p))).fold(0.0, f64::max)
    }

    /// Takes away what lies beyond the plane `n · x = d`.
    fn cut(&mut self, n: Vec3, d: f64, beyond: Beyond) {
        let height: Vec<f64> = self.vertices.iter().map(|&v| dot(n, v) - d).collect();
        if height.iter().all(|&h| h <= 0.0) {
            return;
        }
        let mut vertices: Vec<Vec3> = vec![];
        let mut kept = vec![usize::MAX; height.len()];
        for (k, &v) in self.vertices.iter().enumerate().filter(|(k, _)| height[*k] <= 0.0) {
            kept[k] = vertices.len();
            vertices.push(v);
        }
        // The new vertex of each edge that is cut, found again by the face on the edge's other side.
        let mut cuts: Vec<(usize, usize, usize)> = vec![];
        let mut cut = |inside: usize, outside: usize| {
            if let Some(c) = cuts.iter().find(|c| (c.0, c.1) == (inside, outside)) {
                return c.2;
            }
            let share = height[inside] / (height[inside] - height[outside]);
            let (a, b) = (self.vertices[inside], self.vertices[outside]);
            vertices.push(add(a, scale(share, sub(b, a))));
            cuts.push((inside, outside, vertices.len() - 1));
            vertices.len() - 1
        };
        let mut rim: Vec<(usize, usize)> = vec![];
        let mut faces = vec![];
        for (corners, side) in &self.faces {
            let mut left = vec![];
            let (mut out, mut back) = (None, None);
            for (k, &i) in corners.iter().enumerate() {
                let j = corners[(k + 1) % corners.len()];
                if height[i] <= 0.0 {
                    left.push(kept[i]);
                }
                match (height[i] <= 0.0, height[j] <= 0.0) {
                    (true, false) => {
                        left.push(cut(i, j));
                        out = left.last().copied();
                    }
                    (false, true) => {
                        left.push(cut(j, i));
                        back = left.last().copied();
                    }
                    _ => {}
                }
            }
            if let (Some(out), Some(back)) = (out, back) {
                // The cap runs along the new edge the other way.
                rim.push((back, out));
            }
            if left.len() > 2 {
                faces.push((left, *side));
            }
        }
        let mut cap = vec![];
        let first = rim.first().map(|e| e.0);
        let mut at = first;
        while let Some(k) = at
            && cap.len() < rim.len()
        {
            cap.push(k);
            at = rim.iter().find(|e| e.0 == k).map(|e| e.1);
        }
        if cap.len() > 2 {
            faces.push((cap, beyond));
        }
        (self.vertices, self.faces) = (vertices, faces);
    }

    /// The faces, each with its vertices and what lies beyond.
    pub fn faces(&self) -> impl Iterator<Item = (Vec<Vec3>, Beyond)> + '_ {
        let points = |corners: &[usize]| corners.iter().map(|&k| self.vertices[k]).collect();
        self.faces.iter().map(move |(corners, beyond)| (points(corners), *beyond))
    }

    /// The cell as a solid.
    pub fn polyhedron(&self) -> Polyhedron {
        let faces = self.faces.iter().map(|(corners, _)| corners.clone()).collect();
        Polyhedron::trusted(self.vertices.clone(), faces)
    }
}

/// Moves each seed to the mass centre of its cell, some times over (Lloyd's relaxation): cells become rounder and more equal.
pub(crate) fn relax(domain: &Domain, seeds: &mut [Vec3], sweeps: usize) {
    for _ in 0..sweeps {
        let all = cells(domain, seeds);
        if budget::over() {
            break;
        }
        for (seed, cell) in seeds.iter_mut().zip(&all) {
            *seed = domain.wrap(cell.polyhedron().mass_properties(1.0).centre);
        }
    }
}

/// Up to `most` of the corners of a face, evenly around it; its middle if that is one.
pub(crate) fn spread_points(corners: &[Vec3], most: usize) -> Vec<Vec3> {
    let n = corners.len();
    match most {
        1 => vec![mean(corners)],
        _ if most >= n => corners.to_vec(),
        _ => (0..most).map(|k| corners[k * n / most]).collect(),
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;
    use crate::domain::Sides;
    use crate::vec3::cross;

    const KINDS: [[Sides; 3]; 3] =
        [[Sides::Walls; 3], [Sides::Periodic, Sides::Periodic, Sides::Walls], [Sides::Periodic; 3]];

    /// Random seeds in random boxes of every kind, few and many, as they come and relaxed.
    fn cases() -> Vec<(Domain, Vec<Vec3>)> {
        let mut rng = Pcg64::seed_from_u64(11);
        let mut all = vec![];
        for case in 0..60 {
            let size = [(); 3].map(|()| rng.random_range(0.5..=3.0));
            let domain = Domain { size, sides: KINDS[case % 3] };
            let count = [1, 2, 3, 10, 60, 200][case / 3 % 6];
            let mut seeds: Vec<Vec3> = (0..count).map(|_| domain.point(&mut rng)).collect();
            relax(&domain, &mut seeds, case % 2);
            all.push((domain, seeds));
        }
        all
    }

    #[test]
    fn volumes_add_up_to_the_box() {
        for (domain, seeds) in cases() {
            let cells = cells(&domain, &seeds);
            let volume = |c: &Cell| c.polyhedron().mass_properties(1.0).mass;
            let sum: f64 = cells.iter().map(volume).sum();
            let exact: f64 = domain.size.iter().product();
            assert!((sum - exact).abs() < 1e-11 * exact, "{} {sum} {exact}", seeds.len());
        }
    }

    #[test]
    fn a_point_lies_in_the_cell_of_the_nearest_seed() {
        let mut rng = Pcg64::seed_from_u64(12);
        for (domain, seeds) in cases() {
            let cells = cells(&domain, &seeds);
            for _ in 0..20 {
                let p = domain.point(&mut rng);
                // The image of a seed nearest to p, by all images.
                let steps = |k: usize| if domain.periodic(k) { -2..=2 } else { 0..=0 };
                let images = (0..seeds.len()).flat_map(|i| {
                    let seed = seeds[i];
                    steps(0)
                        .flat_map(move |x| {
                            steps(1).flat_map(move |y| {
                                let at = move |z| [f64::from(x), f64::from(y), f64::from(z)];
                                steps(2).map(at)
                            })
                        })
                        .map(move |n| {
                            (i, add(seed, std::array::from_fn(|k| n[k] * domain.size[k])))
                        })
                });
                let distance = |image: &(usize, Vec3)| norm(sub(p, image.1));
                let (i, image) = images.min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap();
                let inside = sub(p, sub(image, seeds[i]));
                let solid = cells[i].polyhedron();
                for f in 0..solid.faces().len() {
                    let (n, d) = solid.plane(f);
                    assert!(dot(n, inside) - d < 1e-6, "{} {i} {f}", seeds.len());
                }
            }
        }
    }

    #[test]
    fn cells_are_closed_and_see_each_other() {
        for (domain, seeds) in cases() {
            let cells = cells(&domain, &seeds);
            for (i, cell) in cells.iter().enumerate() {
                let corners: usize = cell.faces.iter().map(|f| f.0.len()).sum();
                // Euler: every edge belongs to two faces.
                assert_eq!(cell.vertices.len() + cell.faces.len(), corners / 2 + 2);
                for (corners, beyond) in cell.faces() {
                    let Beyond::Cell(j, offset) = beyond else {
                        assert!(matches!(beyond, Beyond::Wall(_)));
                        continue;
                    };
                    // A cell that touches another at an edge may see it by rounding.
                    let turn = |k: usize| {
                        cross(sub(corners[k], corners[0]), sub(corners[k + 1], corners[0]))
                    };
                    if norm((1..corners.len() - 1).map(turn).fold([0.0; 3], add)) < 1e-9 {
                        continue;
                    }
                    let back = Beyond::Cell(i, scale(-1.0, offset));
                    assert!(cells[j].faces.iter().any(|f| f.1 == back), "{i} {j}");
                }
            }
        }
    }

    #[test]
    fn a_lattice_gives_cubes() {
        for sides in KINDS {
            let domain = Domain { size: [4.0; 3], sides };
            let place = |k: usize| [k % 4, k / 4 % 4, k / 16].map(|x| x as f64 + 0.5);
            let seeds: Vec<Vec3> = (0..64).map(place).collect();
            for (cell, &seed) in cells(&domain, &seeds).iter().zip(&seeds) {
                let p = cell.polyhedron().mass_properties(1.0);
                assert!((p.mass - 1.0).abs() < 1e-12 && norm(sub(p.centre, seed)) < 1e-12);
            }
        }
    }
}

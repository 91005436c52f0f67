//! Random packings of spheres: overlaps are relaxed like springs, if wanted under a weight that becomes ever lighter.
//!
//! The energy is `Σ k δ²/2 + Σ w_i z_i`, δ each overlap of two spheres or of a sphere and a wall, and w_i the weight in
//! proportion to the volume. It is minimised by the inertial relaxation FIRE (Bitzek2006). What overlap is left is taken away
//! exactly: the packing is blown up until nothing overlaps, while the spheres keep their radii.
//!
//! Where the limits in force ([`budget`]) are over, all of it ends early with what it has: whoever makes a scene of it looks at them, too.

use nonsmooth_linalg::budget;

use crate::domain::{Domain, Grid, Wall};
use crate::vec3::{Vec3, add, dot, norm, scale, sub};

/// Spheres in a domain.
pub(crate) struct Packing {
    pub domain: Domain,
    pub centres: Vec<Vec3>,
    pub radii: Vec<f64>,
    /// How many of the first spheres do not move.
    pub fixed: usize,
}

/// What a sphere touches.
pub(crate) enum Neighbour {
    /// The image of another sphere at its centre plus the offset.
    Sphere(usize, Vec3),
    Wall(Wall),
}

/// Two surfaces that are close.
pub(crate) struct Touch {
    pub a: Neighbour,
    pub b: usize,
    /// In the middle between the surfaces.
    pub point: Vec3,
    /// The unit normal from a to b.
    pub normal: Vec3,
}

/// The overlap that the weight is to leave at the bottom, in mean radii, from stage to stage.
const STAGES: [f64; 4] = [0.1, 0.02, 0.004, 0.001];
/// Steps of the relaxation in a stage, at most.
const STEPS: usize = 500;
/// The overlap at which spheres without weight are relaxed, in mean radii.
const OVERLAP: f64 = 1e-3;
/// How often a box may grow.
const GROWTHS: usize = 50;
/// Pairs between two looks at the limits.
const CHUNK: usize = 1 << 16;
/// The room around a sphere in which neighbours are kept on the list, in mean radii.
const SKIN: f64 = 0.4;

/// The volume of spheres.
pub(crate) fn volume(radii: &[f64]) -> f64 {
    radii.iter().map(|r| 4.0 / 3.0 * std::f64::consts::PI * r.powi(3)).sum()
}

impl Packing {
    /// Relaxes the overlaps; spheres that are heavy sink.
    pub fn relax(&mut self, heavy: bool) {
        let unit = self.mean_radius();
        self.radii.iter_mut().for_each(|r| *r /= unit);
        self.grow(1.0 / unit);

        if heavy {
            // The column above the bottom carries as many spheres as there are diameters in the height.
            let base = self.domain.size[0] * self.domain.size[1];
            let layers = (0.8 * volume(&self.radii) / base).max(1.0);
            for overlap in STAGES {
                self.minimise(overlap / layers);
            }
        }
        // Without weight overlaps vanish where there is room; a box too full grows a little until there is.
        let mut overlap = self.minimise(0.0);
        for _ in 0..GROWTHS {
            if overlap <= OVERLAP || budget::over() {
                break;
            }
            self.grow(1.0 + 0.25 * overlap);
            overlap = self.minimise(0.0);
        }

        let domain = self.domain;
        self.centres.iter_mut().for_each(|c| *c = domain.wrap(*c));
        let clear = self.clearance();
        self.grow(unit * if clear < 1.0 { (1.0 + 1e-12) / clear } else { 1.0 });
        self.radii.iter_mut().for_each(|r| *r *= unit);
    }

    /// Blows the packing up, but not the spheres.
    fn grow(&mut self, factor: f64) {
        self.centres.iter_mut().for_each(|c| *c = scale(factor, *c));
        self.domain.size = scale(factor, self.domain.size);
    }

    fn mean_radius(&self) -> f64 {
        self.radii.iter().sum::<f64>() / self.radii.len() as f64
    }

    /// Everything closer than `gap` to touching.
    pub fn touching(&self, gap: f64) -> Vec<Touch> {
        let (mut out, domain) = (vec![], self.domain);
        for (b, (&centre, &radius)) in
            self.centres.iter().zip(&self.radii).enumerate().skip(self.fixed)
        {
            for wall in domain.walls() {
                let d = wall.distance(centre);
                if d < radius + gap {
                    let normal = wall.normal();
                    let point = sub(centre, scale(0.5 * (radius + d), normal));
                    out.push(Touch { a: Neighbour::Wall(wall), b, point, normal });
                }
            }
        }
        for (i, j, offset) in self.near(gap) {
            let (i, j) = (i as usize, j as usize);
            // j, the later one, is b: the image is i, seen from the other side.
            let offset = scale(-1.0, offset);
            let d = sub(self.centres[j], add(self.centres[i], offset));
            let (length, reach) = (norm(d), self.radii[i] + self.radii[j]);
            if length < reach + gap {
                let normal = scale(1.0 / length, d);
                let back = self.radii[j] + 0.5 * (length - reach);
                let point = sub(self.centres[j], scale(back, normal));
                out.push(Touch { a: Neighbour::Sphere(i, offset), b: j, point, normal });
            }
        }
        out
    }

    /// The least ratio of a distance to the one at which the two touch.
    fn clearance(&self) -> f64 {
        let walls = (self.fixed..self.centres.len()).flat_map(|i| {
            self.domain.walls().map(move |w| w.distance(self.centres[i]) / self.radii[i])
        });
        let pairs = self.near(0.0).into_iter().map(|(i, j, offset)| {
            let (i, j) = (i as usize, j as usize);
            let d = sub(add(self.centres[j], offset), self.centres[i]);
            norm(d) / (self.radii[i] + self.radii[j])
        });
        walls.chain(pairs).fold(f64::INFINITY, f64::min)
    }

    /// Pairs of spheres, not both fixed, that may be closer than `gap`.
    fn near(&self, gap: f64) -> Vec<(u32, u32, Vec3)> {
        let largest = self.radii.iter().copied().fold(0.0, f64::max);
        let grid = Grid::new(&self.domain, &self.centres, 2.0 * largest + gap);
        let mut pairs = grid.pairs(&self.centres, 2.0 * largest + gap);
        pairs.retain(|&(i, j, offset)| {
            let (i, j) = (i as usize, j as usize);
            let d = sub(add(self.centres[j], offset), self.centres[i]);
            let reach = self.radii[i] + self.radii[j] + gap;
            j >= self.fixed && dot(d, d) < reach * reach
        });
        pairs
    }

    /// FIRE with unit stiffness, unit masses and the weight `weight` of a sphere of unit radius; returns the largest
    /// overlap.
    fn minimise(&mut self, weight: f64) -> f64 {
        let n = self.centres.len();
        let (mut dt, mut alpha, mut downhill) = (0.1, 0.1, 0);
        let mut velocity = vec![[0.0; 3]; n];
        let mut force = vec![[0.0; 3]; n];
        let mut listed: Vec<Vec3> = vec![];
        let (mut pairs, mut overlap) = (vec![], f64::INFINITY);
        for _ in 0..STEPS {
            if budget::over() {
                break;
            }
            let moved = |(a, b): (&Vec3, &Vec3)| norm(sub(*a, *b));
            if listed.is_empty()
                || self.centres.iter().zip(&listed).map(moved).fold(0.0, f64::max) > 0.5 * SKIN
            {
                let domain = self.domain;
                self.centres.iter_mut().for_each(|c| *c = domain.wrap(*c));
                listed.clone_from(&self.centres);
                pairs = self.near(SKIN);
            }
            overlap = self.forces(weight, &pairs, &mut force);
            let size = |x: &[Vec3]| x.iter().map(|x| dot(*x, *x)).sum::<f64>().sqrt();
            let (f, v) = (size(&force), size(&velocity));
            let rest = 0.01 * weight * (n as f64).sqrt();
            if f <= rest || (weight == 0.0 && overlap <= OVERLAP) {
                break;
            }
            let power: f64 = force.iter().zip(&velocity).map(|(f, v)| dot(*f, *v)).sum();
            if power > 0.0 {
                for (v_i, f_i) in velocity.iter_mut().zip(&force) {
                    *v_i = add(scale(1.0 - alpha, *v_i), scale(alpha * v / f, *f_i));
                }
                downhill += 1;
                if downhill > 5 {
                    dt = f64::min(1.1 * dt, 0.5);
                    alpha *= 0.99;
                }
            } else {
                velocity.fill([0.0; 3]);
                (dt, alpha, downhill) = (0.5 * dt, 0.1, 0);
            }
            for i in self.fixed..n {
                velocity[i] = add(velocity[i], scale(dt, force[i]));
                // No further than a fraction of the skin, however far spheres overlap at first.
                let step = scale(dt, velocity[i]);
                let length = norm(step);
                let step = if length > 0.1 { scale(0.1 / length, step) } else { step };
                self.centres[i] = add(self.centres[i], step);
            }
        }
        overlap
    }

    /// The forces on the spheres that move; returns the largest overlap.
    fn forces(&self, weight: f64, pairs: &[(u32, u32, Vec3)], force: &mut [Vec3]) -> f64 {
        let mut largest = 0.0_f64;
        for i in self.fixed..self.centres.len() {
            force[i] = [0.0, 0.0, -weight * self.radii[i].powi(3)];
            for wall in self.domain.walls() {
                let overlap = self.radii[i] - wall.distance(self.centres[i]);
                if overlap > 0.0 {
                    largest = largest.max(overlap);
                    force[i] = add(force[i], scale(overlap, wall.normal()));
                }
            }
        }
        for pairs in pairs.chunks(CHUNK).take_while(|_| !budget::over()) {
            for &(i, j, offset) in pairs {
                let (i, j) = (i as usize, j as usize);
                let d = sub(add(self.centres[j], offset), self.centres[i]);
                let (reach, square) = (self.radii[i] + self.radii[j], dot(d, d));
                if square < reach * reach {
                    let length = square.sqrt().max(1e-9);
                    let overlap = reach - length;
                    largest = largest.max(overlap);
                    let push = scale(overlap / length, d);
                    force[j] = add(force[j], push);
                    if i >= self.fixed {
                        force[i] = sub(force[i], push);
                    }
                }
            }
        }
        largest
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;
    use crate::domain::Sides;

    #[test]
    fn relaxed_packings_do_not_overlap() {
        let mut rng = Pcg64::seed_from_u64(5);
        let kinds = [
            [Sides::Walls, Sides::Walls, Sides::Floor],
            [Sides::Periodic, Sides::Periodic, Sides::Walls],
            [Sides::Periodic; 3],
        ];
        for case in 0..18 {
            let sides = kinds[case % 3];
            let count = [2, 20, 150][case / 3 % 3];
            // Also boxes far too full.
            let fill = [0.4, 0.9][case % 2];
            let radii: Vec<f64> = (0..count).map(|_| rng.random_range(0.6..=1.4)).collect();
            let domain = Domain { size: [(volume(&radii) / fill).cbrt().max(2.8); 3], sides };
            let centres = (0..count).map(|_| domain.point(&mut rng)).collect();
            let mut packing = Packing { domain, centres, radii: radii.clone(), fixed: 0 };
            packing.relax(sides[2] == Sides::Floor);
            assert_eq!(packing.radii.len(), radii.len());
            assert!(packing.radii.iter().zip(&radii).all(|(a, b)| (a - b).abs() < 1e-12));
            for (i, p) in packing.centres.iter().enumerate() {
                for wall in packing.domain.walls() {
                    assert!(wall.distance(*p) > radii[i] * (1.0 - 1e-9));
                }
                for (j, q) in packing.centres.iter().enumerate() {
                    // All images in reach, the sphere's own among them.
                    for image in 0..27 {
                        let n = [image % 3, image / 3 % 3, image / 9].map(|x| f64::from(x) - 1.0);
                        let through = (0..3).all(|k| n[k] == 0.0 || packing.domain.periodic(k));
                        let itself = i == j && n == [0.0; 3];
                        if itself || !through {
                            continue;
                        }
                        let shift: Vec3 = std::array::from_fn(|k| n[k] * packing.domain.size[k]);
                        let d = norm(sub(add(*q, shift), *p));
                        assert!(d > (radii[i] + radii[j]) * (1.0 - 1e-9), "{case}: {i} {j} {d}");
                    }
                }
            }
        }
    }

    #[test]
    fn heavy_spheres_come_to_rest_on_something() {
        // One sphere in a narrow box: on the floor. Two: one on the other or beside it.
        let domain =
            Domain { size: [2.2, 2.2, 9.0], sides: [Sides::Walls, Sides::Walls, Sides::Floor] };
        let mut packing = Packing {
            domain,
            centres: vec![[1.1, 1.1, 5.0], [1.0, 1.1, 8.0]],
            radii: vec![1.0; 2],
            fixed: 0,
        };
        packing.relax(true);
        let heights: Vec<f64> = packing.centres.iter().map(|c| c[2]).collect();
        assert!((heights[0] - 1.0).abs() < 0.05 && (heights[1] - 3.0).abs() < 0.1, "{heights:?}");
        let touching = packing.touching(0.05);
        let pair = |t: &&Touch| matches!(t.a, Neighbour::Sphere(0, _)) && t.b == 1;
        let touch = touching.iter().find(pair).unwrap();
        assert!(touch.normal[2] > 0.9 && (touch.point[2] - 2.0).abs() < 0.1);
    }
}

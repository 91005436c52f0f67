//! The cone of friction with rolling friction, `K = {‖x_T‖ ≤ mu x_N, ‖x_R‖ ≤ mu_r x_N}`: two disks over one normal part.
//!
//! `P_K(x) = (n, x_T min(1, mu n/a), x_R min(1, mu_r n/b))` with `a = ‖x_T‖`, `b = ‖x_R‖` and the n ≥ 0 for which
//! `n − x_N = mu (a − mu n)⁺ + mu_r (b − mu_r n)⁺`. The right-hand side falls with n, piecewise linearly: with the disks that bind known, n is a quotient,
//! `n = (x_N + Σ mu_k a_k)/(1 + Σ mu_k²)` over those. The disk that lets go first is the one with the smaller `a_k/mu_k`.

use nonsmooth_linalg::norm;
use nonsmooth_problem::Rolling;

use super::ConvexSet;

/// The projection by its pieces.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Piece {
    /// n, zero in the polar cone.
    normal: f64,
    /// Which disks bind, their coefficients and the sizes of x there.
    binds: [bool; 2],
    mu: [f64; 2],
    sizes: [f64; 2],
}

fn rows<const D: usize>(disk: usize) -> std::ops::Range<usize> {
    let half = (D - 1) / 2;
    1 + disk * half..1 + (disk + 1) * half
}

impl Piece {
    #[inline(always)]
    fn of<const D: usize>(law: Rolling, x: &[f64; D]) -> Self {
        let mu = [law.mu, law.mu_r];
        let sizes = [0, 1].map(|disk| norm(&x[rows::<D>(disk)]));
        let with = |binds: [bool; 2]| {
            let (mut above, mut below) = (x[0], 1.0);
            for disk in 0..2 {
                if binds[disk] {
                    above += mu[disk] * sizes[disk];
                    below += mu[disk] * mu[disk];
                }
            }
            above / below
        };
        let free = [0, 1].map(|disk| sizes[disk] <= mu[disk] * x[0]);
        let mut piece = Self { normal: x[0], binds: [false; 2], mu, sizes };
        if free == [true; 2] && x[0] >= 0.0 {
            return piece;
        }
        // n is no smaller than x_N, so a disk that is free at x_N stays so. Of two that are not, one binds alone where it leaves the other inside.
        piece.binds = match free {
            [false, false] => {
                let leaves =
                    |bound: [bool; 2], other: usize| sizes[other] <= mu[other] * with(bound);
                [!leaves([false, true], 0), !leaves([true, false], 1)]
            }
            [first, second] => [!first, !second],
        };
        piece.normal = with(piece.binds).max(0.0);
        piece
    }
}

/// K.
impl<const D: usize> ConvexSet<D> for Rolling {
    #[inline(always)]
    fn project(&self, x: &[f64; D]) -> [f64; D] {
        let Piece { normal, binds, mu, sizes } = Piece::of(*self, x);
        if normal <= 0.0 {
            return [0.0; D];
        }
        let mut p = *x;
        p[0] = normal;
        for disk in 0..2 {
            if binds[disk] && sizes[disk] > 0.0 {
                let factor = mu[disk] * normal / sizes[disk];
                p[rows::<D>(disk)].iter_mut().for_each(|p| *p *= factor);
            }
        }
        p
    }

    fn jacobian(&self, x: &[f64; D]) -> [[f64; D]; D] {
        let Piece { normal, binds, mu, sizes } = Piece::of(*self, x);
        let mut out = [[0.0; D]; D];
        if normal <= 0.0 && !(x[0] == 0.0 && binds == [false; 2]) {
            return out;
        }
        // dn = (dx_N + Σ mu_k t_kᵀdx_k)/(1 + Σ mu_k²) over the disks that bind, t_k = x_k/‖x_k‖.
        let below: f64 = 1.0 + (0..2).filter(|&k| binds[k]).map(|k| mu[k] * mu[k]).sum::<f64>();
        let mut slope = [0.0; D];
        slope[0] = 1.0 / below;
        for disk in (0..2).filter(|&k| binds[k] && sizes[k] > 0.0) {
            for k in rows::<D>(disk) {
                slope[k] = mu[disk] * (x[k] / sizes[disk]) / below;
            }
        }
        out[0] = slope;
        for disk in 0..2 {
            for k in rows::<D>(disk) {
                if !binds[disk] {
                    out[k][k] = 1.0;
                    continue;
                }
                if sizes[disk] <= 0.0 {
                    continue;
                }
                // d(mu n t) = mu t dn + mu n/‖x‖ (I − t tᵀ) dx.
                let t = x[k] / sizes[disk];
                for l in 0..D {
                    out[k][l] = mu[disk] * t * slope[l];
                }
                let across = mu[disk] * normal / sizes[disk];
                for l in rows::<D>(disk) {
                    let identity = f64::from(u8::from(k == l));
                    out[k][l] += across * (identity - t * x[l] / sizes[disk]);
                }
            }
        }
        out
    }
}

/// `x − P_K(x − ũ)` by pieces, so that a large x does not round ũ away: ũ inside, x in the polar cone, and else what each disk that binds cuts off.
#[inline(always)]
pub fn rolling_natural_map<const D: usize>(
    law: Rolling,
    x: &[f64; D],
    modified: &[f64; D],
) -> [f64; D] {
    let mut y = *x;
    for k in 0..D {
        y[k] -= modified[k];
    }
    let Piece { normal, binds, mu, sizes } = Piece::of(law, &y);
    if normal <= 0.0 && y[0] < 0.0 {
        return *x;
    }
    let mut map = *modified;
    // α_k = ‖y_k‖ − mu_k n where disk k binds, from differences with mu_k y_N: n itself may be far larger.
    let over = [0, 1].map(|k| sizes[k] - mu[k] * y[0]);
    let excess = match binds {
        [true, true] => {
            let below = 1.0 + mu[0] * mu[0] + mu[1] * mu[1];
            let both = mu[0] * mu[1];
            [
                ((1.0 + mu[1] * mu[1]) * over[0] - both * over[1]) / below,
                ((1.0 + mu[0] * mu[0]) * over[1] - both * over[0]) / below,
            ]
        }
        [first, second] => [
            if first { over[0] / (1.0 + mu[0] * mu[0]) } else { 0.0 },
            if second { over[1] / (1.0 + mu[1] * mu[1]) } else { 0.0 },
        ],
    };
    for disk in (0..2).filter(|&k| binds[k]) {
        map[0] -= mu[disk] * excess[disk];
        if sizes[disk] > 0.0 {
            for k in rows::<D>(disk) {
                map[k] += excess[disk] * (y[k] / sizes[disk]);
            }
        }
    }
    map
}

#[cfg(test)]
mod tests {
    use nonsmooth_problem::check::Law;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;

    fn laws() -> [Rolling; 5] {
        [(0.5, 0.2), (0.0, 0.3), (0.7, 0.0), (0.0, 0.0), (2.0, 3.0)]
            .map(|(mu, mu_r)| Rolling { mu, mu_r })
    }

    fn point(rng: &mut Pcg64) -> [f64; 5] {
        std::array::from_fn(|_| rng.random_range(-1.0..1.0))
    }

    /// The judge, who shares no line with this file, finds the same map, and the projection is as far as he says.
    #[test]
    fn the_judge_projects_to_the_same_point() {
        let mut rng = Pcg64::seed_from_u64(3);
        for law in laws() {
            for _ in 0..2000 {
                let (x, modified) = (point(&mut rng), point(&mut rng));
                let theirs = Law::<5>::natural_map(law, &x, &modified);
                let ours = rolling_natural_map(law, &x, &modified);
                let y: [f64; 5] = std::array::from_fn(|k| x[k] - modified[k]);
                let p = law.project(&y);
                for k in 0..5 {
                    assert!((ours[k] - theirs[k]).abs() < 1e-14, "{law:?} {x:?} {modified:?}");
                    assert!((x[k] - p[k] - theirs[k]).abs() < 1e-14, "{law:?} {x:?}");
                }
            }
        }
    }

    #[test]
    fn the_projection_is_idempotent_nonexpansive_and_homogeneous() {
        let mut rng = Pcg64::seed_from_u64(4);
        for law in laws() {
            for _ in 0..1000 {
                let (x, y) = (point(&mut rng), point(&mut rng));
                let (p, q) = (law.project(&x), law.project(&y));
                let gap = |a: &[f64; 5], b: &[f64; 5]| {
                    norm(&std::array::from_fn::<f64, 5, _>(|k| a[k] - b[k]))
                };
                assert!(gap(&law.project(&p), &p) < 1e-14);
                assert!(gap(&p, &q) <= gap(&x, &y) + 1e-14);
                let scaled = law.project(&x.map(|x| 8.0 * x));
                assert!(gap(&scaled, &p.map(|p| 8.0 * p)) < 1e-13);
            }
        }
    }

    #[test]
    fn the_jacobian_is_the_derivative() {
        let mut rng = Pcg64::seed_from_u64(5);
        for law in laws() {
            let mut smooth = 0;
            for _ in 0..1000 {
                let x = point(&mut rng);
                let at = law.jacobian(&x);
                let h = 1e-6;
                let step = |l: usize, h: f64| {
                    let mut y = x;
                    y[l] += h;
                    y
                };
                // Away from the boundaries of the pieces.
                let pieces = (0..5).flat_map(|l| [step(l, h), step(l, -h)]);
                let here = Piece::of(law, &x);
                let same =
                    |p: Piece| p.binds == here.binds && (p.normal > 0.0) == (here.normal > 0.0);
                if !pieces.map(|y| Piece::of(law, &y)).all(same) {
                    continue;
                }
                smooth += 1;
                for l in 0..5 {
                    let (up, down) = (law.project(&step(l, h)), law.project(&step(l, -h)));
                    for k in 0..5 {
                        let found = (up[k] - down[k]) / (2.0 * h);
                        assert!((found - at[k][l]).abs() < 1e-8, "{law:?} {x:?} [{k}][{l}]");
                    }
                }
            }
            assert!(smooth > 900);
        }
    }
}

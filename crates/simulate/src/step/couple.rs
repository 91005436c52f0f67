//! Two contacts feel each other through the bodies that they share: columns of the bodies, and blocks of W as their products.

use nonsmooth_scenes::vec3::{Vec3, apply};

use super::NONE;
use super::contact::{Arm, Row};
use crate::moving::Moving;

/// Six components of a body for each direction of a contact; the fourth place is for the processor.
pub(super) type Columns = [[f64; 4]; 6];

/// What one side of a contact is in the problem, in the frames of a pass. Apart from the contact, for it is written later, and large.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Side {
    /// Velocities of the body to relative velocities, and impulses to velocities of the body.
    pub rows: Columns,
    pub solved: Columns,
}

/// What a side of a contact with D rows is in a problem.
pub(super) trait Sided<const D: usize>: Copy + Default + Send + Sync {
    /// Of a body's velocity.
    const COMPONENTS: usize;

    /// The entries of a body's matrix of masses.
    fn masses(b: &Moving) -> impl Iterator<Item = (usize, usize, f64)> + Clone + use<'_, D, Self>;

    /// Writes the side of a contact with a body that moves freely.
    fn write(&mut self, row: &Row, arm: &Arm, b: &Moving);

    /// Component i of the relative velocity that the body makes with these velocities.
    fn velocity(&self, i: usize, of: (Vec3, Vec3)) -> f64;

    /// The terms of that, of whichever component they are largest.
    fn terms(&self, of: (Vec3, Vec3)) -> f64;

    /// The same with velocities as six numbers.
    fn rate(&self, i: usize, velocities: &[f64; 6]) -> f64;

    /// For each component of the body's velocity what it makes of the relative velocity, and what the impulse makes of it.
    fn columns(&self) -> impl Iterator<Item = ([f64; D], [f64; D])>;

    /// The block of W of two contacts, a sum over the free bodies that they share.
    fn coupling(own: &[Self; 2], other: &[Self; 2], shared: Shared) -> [[f64; D]; D];
}

impl Sided<3> for Side {
    const COMPONENTS: usize = 6;

    fn masses(b: &Moving) -> impl Iterator<Item = (usize, usize, f64)> + Clone + use<'_> {
        let turning = (0..9).map(|e| (3 + e / 3, 3 + e % 3, b.inertia[e / 3][e % 3]));
        (0..3).map(|k| (k, k, b.mass)).chain(turning)
    }

    fn write(&mut self, row: &Row, arm: &Arm, b: &Moving) {
        for i in 0..3 {
            let column = apply(&b.frame, arm.moment[i]);
            let turned = match row.later {
                true => apply(&b.frame_end, arm.moment_end[i]),
                false => column,
            };
            let solved = apply(&b.inverse, column);
            for k in 0..3 {
                self.rows[k][i] = arm.sign * row.frame_end[i][k];
                self.rows[3 + k][i] = arm.sign * turned[k];
                self.solved[k][i] = arm.sign * row.frame[i][k] / b.mass;
                self.solved[3 + k][i] = arm.sign * solved[k];
            }
        }
    }

    fn velocity(&self, i: usize, (v, spin): (Vec3, Vec3)) -> f64 {
        (0..3).map(|k| self.rows[k][i] * v[k] + self.rows[3 + k][i] * spin[k]).sum()
    }

    fn terms(&self, (v, spin): (Vec3, Vec3)) -> f64 {
        let most = |row: &[f64; 4]| row[0].abs().max(row[1].abs()).max(row[2].abs());
        let each = self.rows.iter().zip(v.iter().chain(&spin));
        each.map(|(row, v)| most(row) * v.abs()).sum()
    }

    fn rate(&self, i: usize, velocities: &[f64; 6]) -> f64 {
        (0..6).map(|k| self.rows[k][i] * velocities[k]).sum()
    }

    #[inline]
    fn columns(&self) -> impl Iterator<Item = ([f64; 3], [f64; 3])> {
        let three = |[x, y, z, _]: [f64; 4]| [x, y, z];
        self.rows.iter().zip(&self.solved).map(move |(row, solved)| (three(*row), three(*solved)))
    }

    #[inline]
    fn coupling(own: &[Self; 2], other: &[Self; 2], shared: Shared) -> [[f64; 3]; 3] {
        coupling(own, other, shared)
    }
}

/// What one side of a contact is in a problem in the plane: for each of its two directions two components of velocity and the turn.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct FlatSide {
    rows: [[f64; 2]; 3],
    solved: [[f64; 2]; 3],
}

impl Sided<2> for FlatSide {
    const COMPONENTS: usize = 3;

    fn masses(b: &Moving) -> impl Iterator<Item = (usize, usize, f64)> + Clone + use<'_> {
        [b.mass, b.mass, b.inertia[2][2]].into_iter().enumerate().map(|(k, m)| (k, k, m))
    }

    fn write(&mut self, row: &Row, arm: &Arm, b: &Moving) {
        for i in 0..2 {
            let (moment, later) = (arm.moment[i][2], arm.moment_end[i][2]);
            for k in 0..2 {
                self.rows[k][i] = arm.sign * row.frame_end[i][k];
                self.solved[k][i] = arm.sign * row.frame[i][k] / b.mass;
            }
            self.rows[2][i] = arm.sign * if row.later { later } else { moment };
            self.solved[2][i] = arm.sign * b.inverse[2][2] * moment;
        }
    }

    fn velocity(&self, i: usize, (v, spin): (Vec3, Vec3)) -> f64 {
        self.rows[0][i] * v[0] + self.rows[1][i] * v[1] + self.rows[2][i] * spin[2]
    }

    fn terms(&self, (v, spin): (Vec3, Vec3)) -> f64 {
        let each = self.rows.iter().zip([v[0], v[1], spin[2]]);
        each.map(|(row, v)| row[0].abs().max(row[1].abs()) * v.abs()).sum()
    }

    fn rate(&self, i: usize, velocities: &[f64; 6]) -> f64 {
        let [x, y, .., turn] = velocities;
        self.rows[0][i] * x + self.rows[1][i] * y + self.rows[2][i] * turn
    }

    #[inline]
    fn columns(&self) -> impl Iterator<Item = ([f64; 2], [f64; 2])> {
        self.rows.iter().copied().zip(self.solved)
    }

    #[inline]
    fn coupling(own: &[Self; 2], other: &[Self; 2], shared: Shared) -> [[f64; 2]; 2] {
        let mut sum = [[0.0; 2]; 2];
        for (left, side) in own.iter().zip(shared).filter(|s| s.1 != NONE) {
            for (left, right) in left.rows.iter().zip(&other[side as usize].solved) {
                for i in 0..2 {
                    for j in 0..2 {
                        sum[i][j] += left[i] * right[j];
                    }
                }
            }
        }
        sum
    }
}

/// For each side of a contact the side of another one that has the same free body, or [`NONE`].
pub(super) type Shared = [u32; 2];

/// The block of W of two contacts, a sum over the free bodies that they share. With AVX2 (found at run time) four numbers at once and the same bits: nothing is fused.
#[inline]
fn coupling(own: &[Side; 2], other: &[Side; 2], shared: Shared) -> [[f64; 3]; 3] {
    let mut sum = [[0.0; 4]; 3];
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has what the function is compiled for.
        unsafe { couple_avx2(&mut sum, own, other, shared) };
        return sum.map(|[x, y, z, _]| [x, y, z]);
    }
    for (left, side) in own.iter().zip(shared).filter(|s| s.1 != NONE) {
        for (left, right) in left.rows.iter().zip(&other[side as usize].solved) {
            for i in 0..3 {
                for j in 0..4 {
                    sum[i][j] += left[i] * right[j];
                }
            }
        }
    }
    sum.map(|[x, y, z, _]| [x, y, z])
}

/// The same, with the sum in registers.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn couple_avx2(sum: &mut [[f64; 4]; 3], own: &[Side; 2], other: &[Side; 2], shared: Shared) {
    use std::arch::x86_64::{
        _mm256_add_pd, _mm256_loadu_pd, _mm256_mul_pd, _mm256_set1_pd, _mm256_setzero_pd,
        _mm256_storeu_pd,
    };
    let mut rows = [_mm256_setzero_pd(); 3];
    for (left, side) in own.iter().zip(shared).filter(|s| s.1 != NONE) {
        for (left, right) in left.rows.iter().zip(&other[side as usize & 1].solved) {
            // SAFETY: the pointer is to an array of four numbers.
            let right = unsafe { _mm256_loadu_pd(right.as_ptr()) };
            for i in 0..3 {
                rows[i] = _mm256_add_pd(rows[i], _mm256_mul_pd(_mm256_set1_pd(left[i]), right));
            }
        }
    }
    for (sum, row) in sum.iter_mut().zip(rows) {
        // SAFETY: as above.
        unsafe { _mm256_storeu_pd(sum.as_mut_ptr(), row) };
    }
}

//! Products of sets: one factor for each block of D entries.

use nonsmooth_linalg::small;

use super::ConvexSet;

/// The product of sets, in the order of a stacked vector's blocks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Product<'a, S>(pub &'a [S]);

impl<S> Product<'_, S> {
    /// `out = P(x)`, block by block. Both hold D entries for each factor.
    pub fn project<const D: usize>(&self, x: &[f64], out: &mut [f64])
    where
        S: ConvexSet<D>,
    {
        for (c, set) in self.0.iter().enumerate() {
            let p = set.project(&small::block(x, c));
            out[D * c..D * c + D].copy_from_slice(&p);
        }
    }

    /// The blocks of the block-diagonal Jacobian.
    pub fn jacobian<const D: usize>(&self, x: &[f64], out: &mut [[[f64; D]; D]])
    where
        S: ConvexSet<D>,
    {
        for (c, (set, block)) in self.0.iter().zip(out).enumerate() {
            *block = set.jacobian(&small::block(x, c));
        }
    }
}

//! The factors of Newton's matrices.
//!
//! Matrices of a nearly symmetric sparse pattern go to the multifrontal LU with a fixed order of elimination ([`BlockLu`]), which is much the faster; its pivots are
//! static, so the caller looks at residuals and, where they are bad, asks for row pivoting ([`SquareLu`]) from then on.

use nonsmooth_linalg::budget::TooLarge;
use nonsmooth_linalg::{BlockLu, Csc, Matrix, Slot, SquareLu};

/// The multifrontal LU is used where at least this part of the entries has its mirror image in the pattern.
const SYMMETRIC: f64 = 0.9;

/// LU factors of matrices of one pattern.
pub struct Factor {
    pivoting: SquareLu,
    fixed: Option<Fixed>,
    /// The fixed order is in use.
    trusted: bool,
}

struct Fixed {
    lu: BlockLu,
    /// Where the entries go.
    slots: Vec<Slot>,
}

impl Factor {
    /// For matrices with the pattern of `a`.
    pub fn new(a: &Matrix) -> Self {
        let fixed = match a {
            // Where the memory is short, row pivoting is refused in its turn.
            Matrix::Sparse(a) if symmetric(a) => Fixed::new(a).ok(),
            _ => None,
        };
        Self { pivoting: SquareLu::default(), trusted: fixed.is_some(), fixed }
    }

    /// Factorises; false where the matrix is singular.
    pub fn factorise(&mut self, a: &Matrix) -> bool {
        match (&mut self.fixed, a) {
            (Some(fixed), Matrix::Sparse(a)) if self.trusted => {
                fixed.lu.clear();
                for (slot, x) in fixed.slots.iter().zip(a.values()) {
                    fixed.lu.add_at(*slot, &[*x]);
                }
                fixed.lu.factorise().is_ok()
            }
            _ => self.pivoting.factorise(a).is_ok(),
        }
    }

    /// `b ← A⁻¹ b`.
    pub fn solve(&mut self, b: &mut [f64]) {
        match &mut self.fixed {
            Some(fixed) if self.trusted => fixed.lu.solve(b),
            _ => self.pivoting.solve(b),
        }
    }

    /// The last solution was bad: pivots from now on. False where it did already.
    pub fn distrust(&mut self) -> bool {
        std::mem::take(&mut self.trusted)
    }

    /// Back to the fixed order.
    pub fn trust(&mut self) {
        self.trusted = self.fixed.is_some();
    }
}

fn symmetric(a: &Csc) -> bool {
    if a.nrows() != a.ncols() {
        return false;
    }
    let there = |i: usize, j: usize| a.column(j).0.binary_search(&i).is_ok();
    let mirrored = a.triplets().filter(|&(i, j, _)| there(j, i)).count();
    mirrored as f64 >= SYMMETRIC * a.nnz() as f64
}

impl Fixed {
    fn new(a: &Csc) -> Result<Self, TooLarge> {
        let edges = a.triplets().filter(|(i, j, _)| i != j).map(|(i, j, _)| (i as u32, j as u32));
        let lu = BlockLu::new(&vec![1; a.nrows()], edges)?;
        let slots = a.triplets().map(|(i, j, _)| lu.slot(i, j)).collect();
        Ok(Self { lu, slots })
    }
}

//! The disk `{‖x‖ ≤ R}` (an interval for D = 1), the section of the Coulomb cone and of Tresca's cylinder.
//!
//! Source: Acary, lecture (89), (118).

use super::ConvexSet;

/// The disk of a given radius about zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disk {
    /// R; a negative radius is none.
    pub radius: f64,
}

/// The pieces of the projection.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Piece {
    Inside,
    /// Outside, at this distance from the centre.
    Outside(f64),
    /// The disk is a point.
    Point,
}

impl Disk {
    fn piece<const D: usize>(self, x: &[f64; D]) -> Piece {
        let size = x.iter().map(|v| v * v).sum::<f64>().sqrt();
        if self.radius <= 0.0 {
            Piece::Point
        } else if size <= self.radius {
            Piece::Inside
        } else {
            Piece::Outside(size)
        }
    }
}

impl<const D: usize> ConvexSet<D> for Disk {
    fn project(&self, x: &[f64; D]) -> [f64; D] {
        match self.piece(x) {
            Piece::Inside => *x,
            Piece::Outside(size) => x.map(|v| self.radius * (v / size)),
            Piece::Point => [0.0; D],
        }
    }

    fn jacobian(&self, x: &[f64; D]) -> [[f64; D]; D] {
        let mut out = [[0.0; D]; D];
        match self.piece(x) {
            Piece::Inside => (0..D).for_each(|k| out[k][k] = 1.0),
            Piece::Outside(size) => {
                // R Γ(x), Γ = (I − t tᵀ)/‖x‖.
                for k in 0..D {
                    for l in 0..D {
                        let identity = f64::from(u8::from(k == l));
                        out[k][l] = self.radius / size * (identity - x[k] * x[l] / (size * size));
                    }
                }
            }
            Piece::Point => {}
        }
        out
    }
}

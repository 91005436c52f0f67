//! The three ways to W = Hᵀ M⁻¹ H are one operator.

use nonsmooth_linalg::{Delassus, Inverse};
use nonsmooth_problem::planted::Planted;

#[test]
fn diagonal_condensation_and_factors_are_one_operator() {
    let (problem, _) = Planted { contacts: 9, dofs: 20, ..Planted::default() }.global::<3>();
    let inverse = Inverse::new(&problem.M, "M").unwrap();
    let w = Delassus::<3>::condense(&problem.H, &inverse);
    let diagonal = Delassus::<3>::diagonal(&problem.H, &inverse);
    let factors = Delassus::<3>::new(&problem.H, &inverse);
    let r: Vec<f64> = (0..27).map(|i| (i as f64).cos()).collect();
    let mut v = vec![0.0; 20];
    for c in 0..9 {
        assert_eq!(w.get(c, c), Some(&diagonal[c]));
        assert_eq!(factors.diagonal_block(c), &diagonal[c]);
        factors.apply_impulse(c, &[r[3 * c], r[3 * c + 1], r[3 * c + 2]], &mut v);
    }
    for c in 0..9 {
        let (product, velocity) = (w.row_product(c, &r), factors.local_velocity(c, &v));
        assert!((0..3).all(|k| (product[k] - velocity[k]).abs() < 1e-12));
    }
}

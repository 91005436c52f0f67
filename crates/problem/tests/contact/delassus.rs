//! The three ways to W = Hᵀ M⁻¹ H are one operator.

use nonsmooth_linalg::{Delassus, Inverse};
use nonsmooth_problem::planted::Planted;

#[test]
fn diagonal_condensation_and_factors_are_one_operator() {
    let (problem, _) = Planted { contacts: 9, dofs: 20, ..Planted::default() }.global::<3>();
    let inverse = Inverse::new(&problem.M, "M").unwrap();
    let w = Delassus::<3>::condense(&problem.H, &inverse);
    let diagonal = Delassus::<3>::diagonal(&problem.H, &inverse);
    let r: Vec<f64> = (0..27).map(|i| (i as f64).cos()).collect();
    for factors in [Delassus::new(&problem.H, &inverse), Delassus::direct(&problem.H, &inverse)] {
        // From some velocities on.
        let start: Vec<f64> = (0..20).map(|i| (i as f64).sin()).collect();
        let mut y = vec![0.0; 20];
        factors.enter(&inverse, &start, &mut y);
        for c in 0..9 {
            assert_eq!(w.get(c, c), Some(&diagonal[c]));
            let (own, known) = (factors.diagonal_block(c), &diagonal[c]);
            let close = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-12;
            assert!(own.as_flattened().iter().zip(known.as_flattened()).all(close));
            factors.apply_impulse(c, &[r[3 * c], r[3 * c + 1], r[3 * c + 2]], &mut y);
        }
        for c in 0..9 {
            let (product, velocity) = (w.row_product(c, &r), factors.local_velocity(c, &y));
            for k in 0..3 {
                let expected = product[k] + problem.H.column_dot(3 * c + k, &start);
                assert!((expected - velocity[k]).abs() < 1e-12);
            }
        }
    }
}

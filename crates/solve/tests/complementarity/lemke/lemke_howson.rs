//! Equilibria of bimatrix games.

use nonsmooth_linalg::Dense;
use rand::RngExt;

use super::{assert_close, rng};

#[test]
fn games_have_their_equilibria() {
    use nonsmooth_solve::complementarity::pivoting::{game, lemke_howson};
    let dense = |rows: &[[f64; 2]]| Dense::from_rows(rows).unwrap();
    // Two pure equilibria, and a mixed one that no label reaches from the artificial one.
    let (a, b) = (dense(&[[2.0, 0.0], [0.0, 1.0]]), dense(&[[1.0, 0.0], [0.0, 2.0]]));
    let mut pure = [false; 2];
    for label in 0..4 {
        let e = lemke_howson(&a, &b, label).unwrap().unwrap();
        let which = usize::from(e.x == [0.0, 1.0]);
        assert_eq!(e.x, e.y);
        assert_eq!(e.x[which], 1.0);
        pure[which] = true;
    }
    assert_eq!(pure, [true; 2]);
    // Matching pennies, and a 3 × 2 game (von Stengel) with a mixed equilibrium (0, 1/3, 2/3), (1/3, 2/3).
    let (a, b) = (dense(&[[1.0, -1.0], [-1.0, 1.0]]), dense(&[[-1.0, 1.0], [1.0, -1.0]]));
    for label in 0..4 {
        let e = lemke_howson(&a, &b, label).unwrap().unwrap();
        assert_close(&e.x, &[0.5, 0.5], "pennies");
        assert_close(&e.y, &[0.5, 0.5], "pennies");
    }
    let (a, b) = (
        dense(&[[3.0, 3.0], [2.0, 5.0], [0.0, 6.0]]),
        dense(&[[3.0, 2.0], [2.0, 6.0], [3.0, 1.0]]),
    );
    let known = [
        (vec![1.0, 0.0, 0.0], vec![1.0, 0.0]),
        (vec![0.8, 0.2, 0.0], vec![2.0 / 3.0, 1.0 / 3.0]),
        (vec![0.0, 1.0 / 3.0, 2.0 / 3.0], vec![1.0 / 3.0, 2.0 / 3.0]),
    ];
    for label in 0..5 {
        let e = lemke_howson(&a, &b, label).unwrap().unwrap();
        let near = |x: &[f64], y: &[f64]| x.iter().zip(y).all(|(x, y)| (x - y).abs() < 1e-12);
        assert!(known.iter().any(|(x, y)| near(x, &e.x) && near(y, &e.y)), "{label}: {e:?}");
    }
    assert!(lemke_howson(&a, &b, 5).is_err());
    // Larger ones, by what an equilibrium is; the last with a factorised basis.
    for n in [10, 45] {
        let mut rng = rng(n as u64);
        let a = Dense::from_fn(n, n, |_, _| rng.random_range(-3.0..5.0));
        let b = Dense::from_fn(n, n, |_, _| rng.random_range(0.0..1.0));
        let e = lemke_howson(&a, &b, 3).unwrap().unwrap();
        let (mut rows, mut columns) = (vec![0.0; n], vec![0.0; n]);
        a.mul_add(1.0, &e.y, &mut rows);
        b.mul_transpose_add(1.0, &e.x, &mut columns);
        for (payoff, s) in [(rows, &e.x), (columns, &e.y)] {
            let now: f64 = payoff.iter().zip(s).map(|(p, s)| p * s).sum();
            assert!(payoff.iter().all(|p| *p <= now + 1e-12), "{n}");
        }
        assert_eq!(game(&a, &b).unwrap().dim(), 2 * n);
    }
}

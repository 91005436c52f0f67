//! Free variables, equalities and boxes.

use nonsmooth_linalg::Dense;
use nonsmooth_problem::planted::Torsion;
use nonsmooth_problem::{BoxLcp, Mlcp};

use super::{Draw, SYMMETRIC, distance, gram, solved};

#[test]
fn free_variables_are_relaxed_without_projection() {
    let mut draw = Draw::seeded(60);
    let m = gram(&draw.square(30), 0.1);
    let (q, _) = draw.plant(&m);
    let problem = Mlcp::new(m, q, 8).unwrap();
    let (z, _) = solved(&problem, "mprgp");
    assert!(z[..8].iter().any(|z| *z < -1e-3), "some free variable is negative: {z:?}");
    for label in SYMMETRIC {
        assert!(distance(&solved(&problem, label).0, &z) < 1e-6, "{label}");
    }
    // The sign of an equality is free.
    let mut turned = problem.M.to_dense().unwrap();
    let mut q = problem.q.clone();
    for i in 0..8 {
        turned.row_mut(i).iter_mut().for_each(|x| *x = -*x);
        q[i] = -q[i];
    }
    let turned = Mlcp::new(turned, q, 8).unwrap();
    for label in ["pgs", "psor", "rpgs", "rpsor"] {
        assert!(distance(&solved(&turned, label).0, &z) < 1e-6, "{label}");
    }
}

#[test]
fn saddle_points_are_solved_whatever_the_sign_of_their_equalities() {
    let mut draw = Draw::seeded(61);
    let (h, a) = (gram(&draw.square(20), 0.2), draw.square(20));
    let mut found = vec![];
    for sign in [1.0, -1.0] {
        // Free multipliers first: [0 ±A; −Aᵀ H].
        let m = Dense::from_fn(25, 25, |i, j| match (i < 5, j < 5) {
            (true, true) => 0.0,
            (true, false) => sign * a[(i, j - 5)],
            (false, true) => -a[(j, i - 5)],
            (false, false) => h[(i - 5, j - 5)],
        });
        let q = (0..25).map(|i| if i < 5 { -sign } else { (i as f64).sin() }).collect::<Vec<_>>();
        for problem in [Mlcp::new(m.clone(), q.clone(), 5), Mlcp::new(m.to_csc(), q.clone(), 5)] {
            for label in ["rpgs", "rpsor"] {
                found.push(solved(&problem.clone().unwrap(), label).0);
            }
        }
    }
    for other in &found[1..] {
        assert!(distance(other, &found[0]) < 1e-6);
    }
}

#[test]
fn boxes() {
    let problem = Torsion { n: 14, load: 5.0 }.boxed();
    let (z, _) = solved(&problem, "mprgp");
    for label in SYMMETRIC {
        assert!(distance(&solved(&problem, label).0, &z) < 1e-6, "{label}");
    }
    assert!((0..z.len()).any(|i| z[i] == problem.upper[i]));
    // A fixed variable needs no diagonal; an infinite bound is none.
    let m = Dense::from_rows(&[[0.0, 1.0], [1.0, 2.0]]).unwrap();
    let (lower, upper) = (vec![3.0, f64::NEG_INFINITY], vec![3.0, 5.0]);
    let fixed = BoxLcp::new(m, vec![7.0, 1.0], lower, upper).unwrap();
    for label in ["pgs", "psor", "rpgs", "rpsor", "splitting_ls", "mprgp"] {
        assert!(distance(&solved(&fixed, label).0, &[3.0, -2.0]) < 1e-9, "{label}");
    }
}

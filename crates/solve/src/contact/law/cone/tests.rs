//! What every set obeys: projections are idempotent and nonexpansive, cones obey Moreau's decomposition, the Jacobian is
//! the derivative, and the projections agree with the judge's notion of nearness (the definition).

use super::*;
use crate::contact::law::Coulomb;

fn points() -> Vec<[f64; 3]> {
    let mut points = vec![[0.0; 3], [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.3, -0.4]];
    for i in 0..60 {
        let a = f64::from(i);
        points.push([2.0 * (0.7 * a).sin(), 1.5 * (1.3 * a).cos(), (0.9 * a).sin()]);
    }
    points
}

fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).map(|k| a[k] * b[k]).sum()
}

/// Idempotent, nonexpansive, and `(x − p)ᵀ(z − p) ≤ 0` for every z of the set: the definition of the nearest point.
fn is_a_projection(set: &impl ConvexSet<3>, contains: impl Fn(&[f64; 3]) -> bool) {
    for x in points() {
        let p = set.project(&x);
        assert!(contains(&p), "{x:?} {p:?}");
        assert!(distance(&set.project(&p), &p) < 1e-15);
        if contains(&x) {
            assert!(distance(&p, &x) < 1e-15);
        }
        for y in points() {
            let z = set.project(&y);
            assert!(distance(&p, &z) <= distance(&x, &y) + 1e-14);
            let normal: [f64; 3] = std::array::from_fn(|k| x[k] - p[k]);
            let along: [f64; 3] = std::array::from_fn(|k| z[k] - p[k]);
            assert!(dot(&normal, &along) < 1e-13, "{x:?} {y:?}");
        }
    }
}

/// The Jacobian against central differences, at points that no kink is near.
fn is_differentiated(set: &impl ConvexSet<3>) {
    let mut compared = 0;
    for x in points() {
        let at = set.jacobian(&x);
        let near = |h: f64, l: usize| {
            let mut y = x;
            y[l] += h;
            y
        };
        let smooth = (0..3).all(|l| {
            [1e-5, -1e-5].iter().all(|h| {
                let other = set.jacobian(&near(*h, l));
                (0..3).all(|k| distance(&other[k], &at[k]) < 1e-3)
            })
        });
        // Symmetric with eigenvalues in [0, 1], kink or not: checked through 0 ≤ dᵀJd ≤ ‖d‖².
        for d in points() {
            let j: [f64; 3] = std::array::from_fn(|k| dot(&at[k], &d));
            assert!(dot(&j, &d) > -1e-13 && dot(&j, &d) <= dot(&d, &d) + 1e-13);
        }
        if !smooth {
            continue;
        }
        compared += 1;
        for l in 0..3 {
            let (up, down) = (set.project(&near(1e-6, l)), set.project(&near(-1e-6, l)));
            for k in 0..3 {
                let slope = (up[k] - down[k]) / 2e-6;
                assert!((slope - at[k][l]).abs() < 1e-8, "{x:?} {k} {l}");
            }
        }
    }
    assert!(compared > 40, "{compared}");
}

#[test]
fn the_coulomb_cone_and_its_dual() {
    for mu in [0.0, 0.3, 1.0, 2.0] {
        let (primal, dual) = (Coulomb { mu }, Dual { mu });
        let tolerance = 1e-14;
        is_a_projection(&primal, |x| x[0] >= 0.0 && tangential_norm(x) <= mu * x[0] + tolerance);
        is_a_projection(&dual, |x| mu * tangential_norm(x) <= x[0] + tolerance);
        is_differentiated(&primal);
        is_differentiated(&dual);
        // Moreau: x = P_K(x) − P_K*(−x), and the two are orthogonal.
        for x in points() {
            let (p, d) = (primal.project(&x), dual.project(&x.map(|v| -v)));
            let sum: [f64; 3] = std::array::from_fn(|k| p[k] - d[k]);
            assert!(distance(&sum, &x) < 1e-14 && dot(&p, &d).abs() < 1e-14, "{mu} {x:?}");
        }
    }
}

#[test]
fn the_second_order_cone_is_the_coulomb_cone_with_mu_one() {
    for x in points() {
        assert!(distance(&jordan::project(&x), &project(&x, 1.0)) < 1e-15);
    }
}

#[test]
fn the_disk_and_the_cylinder() {
    for radius in [0.0, 0.4, 1.3] {
        let size = |x: &[f64; 3]| dot(x, x).sqrt();
        is_a_projection(&Disk { radius }, |x| size(x) <= radius + 1e-15);
        is_differentiated(&Disk { radius });
        let cylinder = Cylinder { threshold: radius };
        is_a_projection(&cylinder, |x| x[0] >= 0.0 && tangential_norm(x) <= radius + 1e-15);
        is_differentiated(&cylinder);
    }
}

#[test]
fn a_product_projects_block_by_block() {
    let sets = [Coulomb { mu: 0.5 }, Coulomb { mu: 0.0 }];
    let x = [1.0, 2.0, 0.0, -1.0, 0.5, 0.5];
    let mut p = [0.0; 6];
    Product(&sets).project::<3>(&x, &mut p);
    assert_eq!(p[..3], project(&[1.0, 2.0, 0.0], 0.5));
    assert_eq!(p[3..], [0.0; 3]);
    let mut blocks = [[[0.0; 3]; 3]; 2];
    Product(&sets).jacobian(&x, &mut blocks);
    assert_eq!(blocks[0], projection_jacobian(&[1.0, 2.0, 0.0], 0.5));
}

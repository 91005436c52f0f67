//! Enumeration lists every solution.

use nonsmooth_linalg::Dense;
use nonsmooth_problem::check::{Exact, rounded};
use nonsmooth_problem::planted::classics::{self, Known};
use nonsmooth_problem::{Lcp, Mlcp};
use nonsmooth_solve::complementarity::pivoting::{Face, all_solutions};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::{close, eliminate, largest, solve};
use crate::common::w_of;

#[test]
fn every_solution_of_every_example_is_listed() {
    for example in classics::all() {
        let found = all_solutions(&example.problem, 1000).unwrap();
        assert!(found.complete, "{}", example.name);
        match &example.known {
            Known::Solutions(all) => {
                assert_eq!(found.faces.len(), all.len(), "{}: {found:?}", example.name);
                for face in &found.faces {
                    assert_eq!(face.dimension, 0, "{}", example.name);
                    assert!(example.has(&face.z, 1e-11 * largest(&face.z).max(1e-3)));
                }
                for z in all {
                    assert!(found.faces.iter().any(
                        |f| close(&f.z, z, 1e-10) || largest(z) == 0.0 && largest(&f.z) == 0.0
                    ));
                }
            }
            Known::Segment(ends) => {
                let [face] = &found.faces[..] else { panic!("{found:?}") };
                assert_eq!((face.dimension, face.ends.len(), face.rays.len()), (1, 2, 0));
                assert!(ends.iter().all(|e| face.ends.iter().any(|f| close(f, e, 1e-12))));
                assert!(example.has(&face.z, 1e-12));
            }
            Known::HalfLine([end, direction]) => {
                let [face] = &found.faces[..] else { panic!("{found:?}") };
                assert_eq!((face.dimension, face.ends.len(), face.rays.len()), (1, 1, 1));
                assert!(close(&face.ends[0], end, 1e-12) && close(&face.rays[0], direction, 1e-12));
                assert!(example.has(&face.z, 1e-12));
            }
            Known::Nothing => assert_eq!(found.faces, []),
        }
    }
    let three = all_solutions(&classics::floudas_10_2_4().problem, 100).unwrap();
    assert_eq!((three.isolated().count(), three.families().count()), (3, 0));
    let stopped = all_solutions(&classics::floudas_10_2_4().problem, 1).unwrap();
    assert!(!stopped.complete && stopped.faces.len() == 1);
}

/// Enumeration against plain testing of all 2ⁿ bases by elimination.
#[test]
fn all_solutions_against_all_bases() {
    let mut rng = Pcg64::seed_from_u64(5);
    for _ in 0..200 {
        let n = rng.random_range(1..6);
        let m = Dense::from_fn(n, n, |_, _| rng.random_range(-1.0..1.0));
        let q: Vec<f64> = (0..n).map(|_| rng.random_range(-1.0..1.0)).collect();
        let problem = Lcp::new(m.clone(), q.clone()).unwrap();
        let mut all = vec![];
        for set in 0..1_usize << n {
            let alpha: Vec<usize> = (0..n).filter(|i| set >> i & 1 == 1).collect();
            let mut z = vec![0.0; n];
            if let Some(x) = eliminate(&m, &q, &alpha) {
                alpha.iter().zip(x).for_each(|(i, x)| z[*i] = x);
                let w = w_of(&problem, &z);
                if z.iter().all(|z| *z >= 0.0) && w.iter().all(|w| *w >= -1e-12) {
                    all.push(z);
                }
            }
        }
        let found = all_solutions(&problem, 1000).unwrap();
        assert_eq!(found.isolated().count(), all.len(), "{m:?} {q:?}");
        for face in &found.faces {
            assert!(all.iter().any(|z| close(z, &face.z, 1e-8) || largest(z) == 0.0));
        }
        let solved = solve("enumeration", &[], &problem);
        assert_eq!(solved.status(), if all.is_empty() { "infeasible" } else { "solved" });
    }
}

/// The solution of the basis of a set in rational numbers, rounded once, if it is one and the basis is regular.
fn exactly(m: &Dense, q: &[f64], alpha: &[usize]) -> Option<Vec<f64>> {
    let exact = |x: f64| Exact::try_from(x).unwrap();
    let mut a: Vec<Vec<Exact>> = alpha
        .iter()
        .map(|&i| alpha.iter().map(|&j| exact(m[(i, j)])).chain([exact(-q[i])]).collect())
        .collect();
    for k in 0..alpha.len() {
        let p = (k..alpha.len()).find(|&p| !a[p][k].is_zero())?;
        a.swap(k, p);
        let row: Vec<Exact> = a[k].iter().map(|x| x / &a[k][k]).collect();
        for (_, other) in a.iter_mut().enumerate().filter(|(i, _)| *i != k) {
            let factor = other[k].clone();
            other.iter_mut().zip(&row).for_each(|(x, r)| *x -= &factor * r);
        }
        a[k] = row;
    }
    let mut z = vec![Exact::ZERO; q.len()];
    alpha.iter().zip(a).for_each(|(i, mut row)| z[*i] = row.pop().unwrap());
    let w = |i: usize| (0..q.len()).fold(exact(q[i]), |sum, j| sum + exact(m[(i, j)]) * &z[j]);
    let is = (0..q.len()).all(|i| z[i] >= Exact::ZERO && w(i) >= Exact::ZERO);
    is.then(|| z.iter().map(rounded).collect())
}

/// Small and large numbers side by side, and many that vanish: all solutions of regular bases are listed, and nothing else that is alone.
#[test]
fn all_solutions_of_problems_that_are_badly_scaled_or_degenerate() {
    let mut rng = Pcg64::seed_from_u64(11);
    let tiny = 2f64.powi(-45);
    let entries = [0.0, 0.0, 1.0, -1.0, 2.0, 1.0 + tiny, tiny, -tiny, 1e12];
    for _ in 0..3000 {
        let n = rng.random_range(1..4);
        let mut draw = || entries[rng.random_range(0..entries.len())];
        let m = Dense::from_fn(n, n, |_, _| draw());
        let q: Vec<f64> = (0..n).map(|_| -draw()).collect();
        let found = all_solutions(&Lcp::new(m.clone(), q.clone()).unwrap(), 1000).unwrap();
        assert!(found.complete && found.lacks.is_empty(), "{m:?} {q:?}");
        let points = |face: &Face| {
            if face.dimension == 0 { vec![face.z.clone()] } else { face.ends.clone() }
        };
        let listed: Vec<Vec<f64>> = found.faces.iter().flat_map(points).collect();
        for set in 0..1_usize << n {
            let alpha: Vec<usize> = (0..n).filter(|i| set >> i & 1 == 1).collect();
            if let Some(z) = exactly(&m, &q, &alpha) {
                assert!(listed.contains(&z), "{z:?} of {m:?} {q:?}: {found:?}");
            }
        }
        let judge = |z: &[f64]| {
            let w = w_of(&Lcp::new(m.clone(), q.clone()).unwrap(), z);
            z.iter().zip(&w).enumerate().all(|(i, (z_i, w_i))| {
                let terms = (0..n).map(|j| (m[(i, j)] * z[j]).abs());
                let noise = 1e-14 * terms.fold(q[i].abs(), f64::max);
                *z_i >= 0.0 && *w_i >= -noise && (*z_i == 0.0 || *w_i <= noise)
            })
        };
        assert!(listed.iter().all(|z| judge(z)), "{m:?} {q:?}: {found:?}");
    }
}

#[test]
fn nothing_is_taken_for_zero() {
    let list = |m: [[f64; 2]; 2], q: [f64; 2]| {
        let found = all_solutions(&Lcp::new(Dense::from_rows(&m).unwrap(), q.into()).unwrap(), 10);
        let found = found.unwrap();
        assert!(found.complete, "{found:?}");
        found.faces.iter().map(|f| (f.dimension, f.z.clone())).collect::<Vec<_>>()
    };
    assert_eq!(list([[1.0, 0.0], [0.0, 1.0]], [1e15, -1.0]), [(0, vec![0.0, 1.0])]);
    let [(0, large)] = &list([[1e-12, -1.0], [1.0, 0.0]], [-1.0, -1.0])[..] else { panic!() };
    assert!(close(large, &[1e12, 0.0], 1e-15));
    let nearly = 1.0 + f64::EPSILON;
    assert_eq!(list([[1.0, 1.0], [1.0, nearly]], [-1.0, -1.0]), [(0, vec![1.0, 0.0])]);
    let whole = |q| list([[0.0, -1.0], [0.0, 1.0]], [q, -1e13]).len();
    assert_eq!((whole(1e13 - 1.0), whole(1e13)), (0, 1));
    // A solution beyond doubles is not listed, and that is said.
    let m = Dense::from_rows(&[[1e-300]]).unwrap();
    let found = all_solutions(&Lcp::new(m, vec![-1e300]).unwrap(), 10).unwrap();
    assert!(found.faces.is_empty() && !found.complete && found.lacks[0].contains("range"));
}

#[test]
fn families_are_whole() {
    // z ≥ 0 with sum 1, of five variables: a simplex; any z ≥ 0 of three: a cone; a square.
    let one = |m: Dense, q: Vec<f64>| {
        let found = all_solutions(&Lcp::new(m, q).unwrap(), 1000).unwrap();
        let [face] = &found.faces[..] else { panic!("{found:?}") };
        assert!(found.complete);
        (face.dimension, face.ends.len(), face.rays.len(), face.lines.len())
    };
    assert_eq!(one(Dense::from_fn(5, 5, |_, _| 1.0), vec![-1.0; 5]), (4, 5, 0, 0));
    assert_eq!(one(Dense::zeros(3, 3), vec![0.0; 3]), (3, 1, 3, 0));
    let square = Dense::from_fn(4, 4, |i, j| if i / 2 == j / 2 { 1.0 } else { 0.0 });
    assert_eq!(one(square, vec![-1.0; 4]), (2, 4, 0, 0));
    // Free variables that nothing determines: u is any number, v = 1; and u₁ + 2 u₂ = v.
    let m = Dense::from_rows(&[[0.0, 0.0], [0.0, 1.0]]).unwrap();
    let found = all_solutions(&Mlcp::new(m, vec![0.0, -1.0], 1).unwrap(), 10).unwrap();
    let [face] = &found.faces[..] else { panic!("{found:?}") };
    assert_eq!((face.dimension, &face.ends, &face.rays), (1, &vec![vec![0.0, 1.0]], &vec![]));
    assert_eq!(face.lines, [[1.0, 0.0]]);
    let m = Dense::from_rows(&[[1.0, 2.0, -1.0], [0.0, 0.0, 0.0]]).unwrap();
    let found = all_solutions(&Mlcp::rectangular(m, vec![0.0; 2], 1, 2).unwrap(), 10).unwrap();
    let [face] = &found.faces[..] else { panic!("{found:?}") };
    assert_eq!((face.dimension, face.ends.len(), face.rays.len()), (2, 1, 1));
    assert_eq!(face.lines, [[-1.0, 0.5, 0.0]]);
}

//! Enumeration lists every solution.

use nonsmooth_linalg::Dense;
use nonsmooth_problem::Lcp;
use nonsmooth_problem::planted::classics::{self, Known};
use nonsmooth_solve::complementarity::pivoting::all_solutions;
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

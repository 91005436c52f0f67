//! Siconos' files.

use nonsmooth_problem::{Lcp, LcpPoint, Problem};
use nonsmooth_solve::registry::{self, Registered};
use nonsmooth_solve::settings::from_texts;
use nonsmooth_solve::{Limits, Status};

use super::{ALL, from};
use crate::common::{corpus, siconos_lcp, siconos_mlcp};

/// The residual that the files' precision allows is reached, or the end has a name.
fn try_all<P: Registered + Problem<Point = LcpPoint>>(
    file: &str,
    problem: &P,
) -> Vec<&'static str> {
    let mut solved_by = vec![];
    for name in ALL.into_iter().chain(["enumeration_exact"]) {
        match from(name, &[], problem, problem.origin().z) {
            Err(refused) => {
                assert!(refused.is_inapplicable(), "{file} {name}: {refused}");
                println!("{file:36} {name:15} {refused}");
            }
            Ok(solved) => {
                println!("{file:36} {name:15} {:5} {}", solved.pivots, solved.outcome.status);
                match solved.outcome.status {
                    Status::Solved => solved_by.push(name),
                    Status::Infeasible(proof) => assert!(problem.verify(proof.certificate())),
                    Status::NearlyInfeasible { certificate, .. } => {
                        assert!(problem.evidence(&certificate).holds());
                    }
                    Status::Stalled(_) | Status::NoConclusion(_) => {}
                    Status::Limit(limit) => panic!("{file} {name}: {limit:?}"),
                }
            }
        }
    }
    solved_by
}

#[test]
fn lcp_files() {
    let Some(files) = corpus("lcp") else { return };
    for (file, text) in files {
        let Some(problem) = siconos_lcp(&text) else { continue };
        let n = problem.dim();
        let solved_by = try_all(&file, &problem);
        if file.contains("isolated_sol_perturbed") {
            assert!(solved_by.is_empty());
        } else if file.contains("tobenna") {
            // Neither P nor sufficient, and too many pairs unless they are asked for.
            let mut session =
                registry::session::<Lcp>("enumeration", &from_texts(&["max_pairs=40"]).unwrap());
            let mut point = problem.origin();
            let limits = Limits { max_iterations: 500, tolerance: 1e-10, ..Limits::default() };
            let session = session.as_mut().unwrap();
            let outcome = session.solve(&problem, &mut point, &limits, &mut |_| {}).unwrap();
            assert_eq!(outcome.status, Status::Solved);
        } else {
            assert!(!solved_by.is_empty(), "{file}");
            assert!(n > 20 || solved_by.contains(&"enumeration"), "{file}");
        }
    }
}

#[test]
fn mlcp_files() {
    let Some(files) = corpus("mlcp") else { return };
    for (file, text) in files {
        let Some(problem) = siconos_mlcp(&text) else { continue };
        let solved_by = try_all(&file, &problem);
        // In BuckConverter powers of ten divide the rows: only fractions tell its cases apart.
        let enumerated = ["enumeration", "enumeration_exact"].iter().any(|n| solved_by.contains(n));
        assert!(problem.pairs() > 20 || enumerated, "{file}");
    }
}

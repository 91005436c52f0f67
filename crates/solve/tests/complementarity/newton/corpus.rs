//! Siconos' files.

use nonsmooth_problem::{LcpPoint, Problem};
use nonsmooth_solve::Status;
use nonsmooth_solve::registry::Registered;

use super::{METHODS, solve_with};
use crate::common::{corpus, siconos_lcp, siconos_mlcp};

/// Every method on every file of a folder of the corpus; what it did not solve.
fn unsolved_of<P: Registered + Problem<Point = LcpPoint>>(
    folder: &str,
    read: impl Fn(&str) -> Option<P>,
) -> Option<(usize, Vec<String>)> {
    let (mut count, mut unsolved) = (0, vec![]);
    for (file, text) in corpus(folder)? {
        let Some(problem) = read(&text) else { continue };
        count += 1;
        for name in METHODS {
            let (outcome, _, account) = solve_with(name, &[], &problem, &problem.origin().z, 1e-10);
            println!("{name:10} {file:36} {:4} {} {account:?}", outcome.iterations, outcome.status);
            if outcome.status != Status::Solved {
                unsolved.push(format!("{name} {file}: {}", outcome.status));
            }
        }
    }
    Some((count, unsolved))
}

#[test]
fn corpus_lcp() {
    let Some((count, unsolved)) = unsolved_of("lcp", siconos_lcp) else { return };
    assert!(count >= 14, "{count} problems");
    let impossible = |u: &String| u.contains("Pang_isolated_sol_perturbed.dat: infeasible");
    assert!(unsolved.iter().all(impossible), "{unsolved:#?}");
}

#[test]
fn corpus_mlcp() {
    let Some((count, unsolved)) = unsolved_of("mlcp", siconos_mlcp) else { return };
    assert!(count >= 17, "{count} problems");
    // Rows of 1e-12 beside rows of 1: what the merit of the whole does not see, the componentwise judge does. `newton_min` solves them.
    let spread = |u: &String| u.contains("Buck") && !u.starts_with("newton_min");
    assert!(unsolved.iter().all(spread), "{unsolved:#?}");
}

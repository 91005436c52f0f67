//! Real contact problems as nonlinear complementarity problems: how many of the small ones are solved, by the word of the contact problem's judge.

use nonsmooth_io::fclib;
use nonsmooth_problem::Friction;
use nonsmooth_problem::check::Judged;
use nonsmooth_solve::registry::Registered;

/// The files of docs/friction-ncp.md.
const MOST: usize = 20;

fn solved<P: Registered + Judged>(problem: &P, prefix: &str, solver: &str) -> bool {
    let limits = crate::common::within(1e-8, 10.0);
    crate::common::run(problem, &format!("{prefix}{solver}"), &[], &limits).verdict.solved
}

#[test]
fn small_files_of_the_corpus() {
    let solvers = ["glocker/path", "glocker/semismooth", "ncp/path", "glocker/auto", "ncp/auto"];
    let mut counts = [0; 5];
    let mut all = 0;
    for path in crate::common::corpus_files(&["siconos", "generated"]) {
        let Ok(problem) = fclib::read_problem(&path) else { continue };
        let (contacts, bounds) = match &problem {
            Friction::Local2(p) => (p.contacts(), p.rows.as_ref().map(|r| &r.bounds)),
            Friction::Local3(p) => (p.contacts(), p.rows.as_ref().map(|r| &r.bounds)),
            Friction::Global2(p) => (p.contacts(), p.rows.as_ref().map(|r| &r.bounds)),
            Friction::Global3(p) => (p.contacts(), p.rows.as_ref().map(|r| &r.bounds)),
            // The formulations are of Coulomb's law.
            Friction::RollingLocal(_) | Friction::RollingGlobal(_) => continue,
        };
        if contacts > MOST || bounds.is_some_and(|b| !b.are_free()) {
            continue;
        }
        all += 1;
        for (count, solver) in counts.iter_mut().zip(solvers) {
            let solved = match &problem {
                Friction::Local2(p) => solved(p, "", solver),
                Friction::Local3(p) => solved(p, "", solver),
                Friction::Global2(p) => solved(p, "condense/", solver),
                Friction::Global3(p) => solved(p, "condense/", solver),
                Friction::RollingLocal(_) | Friction::RollingGlobal(_) => unreachable!(),
            };
            if !solved {
                eprintln!("{solver} does not solve {}", path.display());
            }
            *count += usize::from(solved);
        }
    }
    println!("of {all} files: {solvers:?} {counts:?}");
    // 61, 51 and 64 of 64.
    for (count, share) in counts.iter().zip([0.85, 0.75, 0.95, 0.85, 0.95]) {
        assert!(*count as f64 >= share * all as f64, "of {all}: {solvers:?} {counts:?}");
    }
}

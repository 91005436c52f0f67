//! Problems made to deceive: by hand (`deceptions`), and by chance, with every claim tested exactly (`suite`, which the example
//! `hostile` runs for hours).

mod deceptions;
mod oracle;
#[path = "../../../examples/hostile/suite/mod.rs"]
mod suite;

use suite::claims::{Effort, Tally};
use suite::{All, KINDS};

/// Of every kind so many problems, asked of every solver.
const PROBLEMS: u64 = 40;

#[test]
fn no_claim_is_false() {
    let effort = Effort { steps: 200, default_steps: 5000, seconds: 10.0 };
    let mut all = All::new();
    let mut total = Tally::default();
    for kind in KINDS {
        for index in 0..PROBLEMS {
            total.add(all.run(kind, 2026, index, &effort, &|_| {}));
        }
    }
    println!("{} solves", total.solves);
    assert!(total.lies.is_empty(), "{} of {}:\n{:?}", total.lies.len(), total.solves, total.lies);
}

#[test]
fn damaged_files_are_read_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    for index in 0..50 {
        let tally = suite::files::run(folder.path(), 2026, index, 20);
        assert!(tally.lies.is_empty(), "{:?}", tally.lies);
    }
}

//! Files of runs. Their two modules are compiled in here: the crate around them would bring all solvers along, and know no more about files.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;

#[allow(dead_code)]
#[path = "../../crates/bench/src/record.rs"]
mod record;
#[allow(dead_code)]
#[path = "../../crates/bench/src/runs.rs"]
mod runs;

fuzz_target!(|data: &[u8]| {
    let file = Path::new("fuzz.jsonl");
    let text = String::from_utf8_lossy(data);
    match runs::Runs::parse(file, &text) {
        Ok(mut all) => {
            all.torn = false;
            let text = all.clone().text();
            let again = runs::Runs::parse(file, &text).expect("what is written can be read");
            assert!(all == again, "{all:?}\n{again:?}");
            all.remarks();
            all.tolerances();
            all.common_tolerance();
            let solvers = all.solvers().len();
            let number = all.runs.len();
            // All runs are known already.
            assert_eq!(all.join(again).twice, number);
            assert_eq!((all.solvers().len(), all.runs.len()), (solvers, number));
        }
        Err(e) => assert!(!e.to_string().contains('\n'), "{e}"),
    }
});

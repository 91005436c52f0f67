//! Files of runs, mutated at random: read or refused with one line, never a panic, and what is read reads the same once written.

use std::path::Path;

use nonsmooth_bench::runs::Runs;

/// The project's own file of runs: its campaign, a problem and three runs.
fn seed() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../.ci/outcomes.jsonl");
    let text = std::fs::read_to_string(path).unwrap();
    let of = |kind: &str, n: usize| {
        let mark = format!("{{\"line\":\"{kind}\"");
        let lines = text.lines().filter(move |line| line.starts_with(&mark));
        lines.take(n).map(|line| format!("{line}\n")).collect::<String>()
    };
    of("campaign", 1) + &of("problem", 1) + &of("run", 3)
}

#[test]
fn mutated_runs_are_read_or_refused() {
    let file = Path::new("x.jsonl");
    let seed = seed();
    let whole = Runs::parse(file, &seed).unwrap();
    assert_eq!((whole.problems.len(), whole.runs.len()), (1, 3));
    let mut state = 5_u64;
    let mut below = |n: usize| {
        // Knuth's linear congruence, of which the high half is random enough.
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % n
    };
    let words =
        ["null", "-1", "1e400", "18446744073709551616", "\n", "[]", "{}", "\"run\"", "1e-8"];
    for _ in 0..5000 {
        let mut bytes = seed.clone().into_bytes();
        for _ in 0..=below(3) {
            let at = below(bytes.len());
            let end = (at + below(12)).min(bytes.len());
            match below(4) {
                0 => bytes[at] ^= 1 << below(8),
                1 => drop(bytes.drain(at..end)),
                2 => drop(bytes.splice(at..end, words[below(words.len())].bytes())),
                _ => bytes.truncate(at.max(1)),
            }
        }
        match Runs::parse(file, &String::from_utf8_lossy(&bytes)) {
            Ok(mut all) => {
                all.torn = false;
                let again = Runs::parse(file, &all.clone().text()).unwrap();
                assert_eq!(again, all);
                drop((all.unfinished(), all.missing_parts(), all.differing_plans()));
                let number = all.runs.len();
                assert_eq!(all.join(again).twice, number);
            }
            Err(e) => assert!(!e.to_string().contains('\n'), "{e}"),
        }
    }
}

#[test]
fn what_a_file_says_does_not_break_a_message_into_lines() {
    let kind = r#"{"line":"cam\npaign"}"#;
    let program = r#"{"line":"campaign","format":"nonsmooth-runs","version":99,"program":"a\nb"}"#;
    let known = seed().replacen("\"version\":1", "\"version\":99", 1);
    let known = known.replacen("\"program\":\"", "\"program\":\"a\\n", 1);
    for text in [kind, program, &known] {
        let message = Runs::parse(Path::new("x.jsonl"), text).unwrap_err().to_string();
        assert!(!message.contains('\n'), "{message}");
    }
}

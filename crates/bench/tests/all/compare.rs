//! Comparisons of campaigns whose differences are known.

use crate::common::{campaign, failed, run};
use nonsmooth_bench::compare::{Options, compare};
use nonsmooth_bench::record::{Ending, Machine, Run};
use nonsmooth_bench::runs::Runs;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// A campaign of two solvers on 40 problems, five repeats each: every repeat takes the true time, which is `factor` times that
/// of the problem for solver A, and up to `noise` more.
fn noisy(seed: u64, factor: f64, noise: f64) -> Runs {
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut runs = campaign("a");
    for p in 0..40 {
        for (solver, factor) in [("A", factor), ("B", 1.0)] {
            let truth = 1e-4 * f64::from(1 + p) * factor;
            let mut times: Vec<f64> =
                (0..5).map(|_| truth * (1.0 + noise * rng.random::<f64>())).collect();
            times.sort_by(f64::total_cmp);
            let new = run(&format!("f/p{p}"), solver, times[0]);
            runs.runs.push(Run {
                seconds_median: Some(times[2]),
                seconds_max: Some(times[4]),
                ..new
            });
        }
    }
    runs
}

#[test]
fn one_per_cent_under_five_per_cent_of_noise_is_silent_and_thirty_is_not() {
    for slower in [1.1, 1.05] {
        let options = Options { slower, ..Options::default() };
        for seed in 0..20 {
            let old = noisy(seed, 1.0, 0.05);
            let same = compare(&old, &noisy(seed + 100, 1.01, 0.05), &options);
            assert!(
                !same.worse && same.slower.is_empty() && same.faster.is_empty(),
                "{}",
                same.text()
            );
            let slow = compare(&old, &noisy(seed + 100, 1.3, 0.05), &options);
            assert!(slow.worse && slow.slower.len() == 40);
            assert!(slow.slower.iter().all(|t| t.pair.solver == "A"));
            assert_eq!(slow.slower_solvers, ["A"]);
            let back = compare(&noisy(seed + 100, 1.3, 0.05), &old, &options);
            assert!(!back.worse && back.faster.len() == 40);
        }
    }
}

#[test]
fn thirty_per_cent_within_the_noise_of_a_run_still_shows_in_the_mean() {
    // Every run alone is too noisy to tell, all together are not.
    let slow = compare(&noisy(1, 1.0, 1.0), &noisy(2, 1.3, 1.0), &Options::default());
    assert!(slow.slower.len() < 20);
    assert_eq!(slow.slower_solvers, ["A"]);
    assert!(slow.worse);
    let a = &slow.solvers[0];
    let (low, high) = a.interval.unwrap();
    assert!(low < 1.3 && 1.3 < high && a.sign_test < 0.01, "{a:?}");
    let (low, high) = slow.solvers[1].interval.unwrap();
    assert!(low < 1.0 && 1.0 < high, "{:?}", slow.solvers[1]);
}

#[test]
fn the_interval_and_the_sign_test_computed_by_hand() {
    // Ratios 1, 2 and 4: mean of the logarithms ln 2, deviation ln 2, t(2 degrees, 0.975) = 4.302653.
    let (mut old, mut new) = (campaign("a"), campaign("a"));
    for (p, ratio) in [("f/p", 1.0), ("f/q", 2.0), ("f/r", 4.0)] {
        old.runs.push(run(p, "A", 1.0));
        new.runs.push(run(p, "A", ratio));
    }
    let all = compare(&old, &new, &Options::default());
    let a = &all.solvers[0];
    let half = 4.302653 * 2f64.ln() / 3f64.sqrt();
    let (low, high) = a.interval.unwrap();
    assert!((a.ratio - 2.0).abs() < 1e-12);
    assert!((low / (2f64.ln() - half).exp() - 1.0).abs() < 1e-6, "{low}");
    assert!((high / (2f64.ln() + half).exp() - 1.0).abs() < 1e-6, "{high}");
    // Two signs, both plus: 2 · (1/2)².
    assert_eq!((a.faster, a.slower), (0, 2));
    assert!((a.sign_test - 0.5).abs() < 1e-12, "{}", a.sign_test);
    assert!(all.slower_solvers.is_empty() && all.slower.len() == 2);
    assert_eq!(all.slower[0].ratio, 4.0);
}

#[test]
fn outcomes_iterations_and_accuracy() {
    let (mut old, mut new) = (campaign("a"), campaign("a"));
    let iterations = |p: &str, k| Run { iterations: Some(k), ..run(p, "A", 1.0) };
    let lost = |p: &str, ending, reached| failed(p, "A", ending, reached);
    use Ending::{Stalled, TimeLimit};
    old.runs = vec![
        run("f/breaks", "A", 1.0),
        lost("f/mends", TimeLimit, 1e-3),
        iterations("f/same", 10),
        iterations("f/changes", 10),
        lost("f/nearer", TimeLimit, 1e-3),
        lost("f/farther", TimeLimit, 1e-5),
        lost("f/alike", TimeLimit, 1e-5),
        run("f/gone", "A", 1.0),
    ];
    new.runs = vec![
        lost("f/breaks", Stalled, 1e-4),
        run("f/mends", "A", 1.0),
        iterations("f/same", 10),
        iterations("f/changes", 12),
        lost("f/nearer", TimeLimit, 1e-4),
        lost("f/farther", Stalled, 1e-4),
        lost("f/alike", TimeLimit, 9e-5),
        run("f/fresh", "A", 1.0),
    ];
    for outcomes in [false, true] {
        let all = compare(&old, &new, &Options { outcomes, ..Options::default() });
        let names = |found: Vec<&str>| found.into_iter().map(String::from).collect::<Vec<_>>();
        let of = |c: &[nonsmooth_bench::compare::Change]| {
            names(c.iter().map(|c| c.pair.problem.as_str()).collect())
        };
        let ended = |c: &[nonsmooth_bench::compare::Outcome]| {
            names(c.iter().map(|c| c.pair.problem.as_str()).collect())
        };
        assert_eq!(ended(&all.newly_unsolved), ["f/breaks"]);
        assert_eq!(ended(&all.newly_solved), ["f/mends"]);
        assert_eq!(ended(&all.other_failure), ["f/farther"]);
        assert_eq!(of(&all.iterations), ["f/changes"]);
        assert_eq!(
            (of(&all.more_accurate), of(&all.less_accurate)),
            (names(vec!["f/nearer"]), names(vec!["f/farther"]))
        );
        assert_eq!((all.pairs, all.missing, all.additional), (7, 1, 1));
        assert_eq!(all.timed, if outcomes { 0 } else { 2 });
        assert!(all.worse);
        let text = all.text();
        assert!(text.contains("f/breaks  A  1e-8: solved -> stalled"), "{text}");
        assert!(text.ends_with("worse: less accurate, newly unsolved\n"), "{text}");
        assert!(text.contains("warning: 1 run of the old campaign missing"), "{text}");
    }
    assert!(!compare(&old, &old, &Options::default()).worse);
}

#[test]
fn times_of_different_machines_or_plans_are_not_compared() {
    let old = noisy(1, 1.0, 0.05);
    let changed = |change: &dyn Fn(&mut Runs)| {
        let mut new = noisy(2, 3.0, 0.05);
        change(&mut new);
        compare(&old, &new, &Options::default())
    };
    assert!(changed(&|_| {}).worse);
    let other = changed(&|r| {
        r.campaigns[0].machine = Machine { cpu: "another".into(), ..Machine::default() }
    });
    assert_eq!(other.warnings, ["different machines: times are not compared (80 pairs)"]);
    assert!(!other.worse && other.timed == 0 && other.pairs == 80);
    let other = changed(&|r| r.campaigns[0].plan.as_mut().unwrap().jobs = 2);
    assert_eq!(other.warnings, ["different plans: times are not compared (80 pairs)"]);
    // Further solvers in the plan change nothing.
    assert!(changed(&|r| r.campaigns[0].plan.as_mut().unwrap().solvers.push("C".into())).worse);
    // A problem that is another one under the same name is no pair.
    let mut old = noisy(1, 1.0, 0.05);
    old.runs[0].digest = "1".into();
    let mut new = old.clone();
    new.runs[0].digest = "2".into();
    let all = compare(&old, &new, &Options::default());
    assert_eq!((all.pairs, all.warnings.len()), (79, 1));
}

#[test]
fn a_run_timed_once_is_as_noisy_as_the_others() {
    let once = |factor| {
        let mut runs = noisy(1, 1.0, 0.4);
        let seconds = Some(2.0 * factor);
        let single = run("f/long", "A", 2.0);
        runs.runs.push(Run { seconds, seconds_max: seconds, repeats: 1, ..single });
        runs
    };
    let slower = |factor| compare(&once(1.0), &once(factor), &Options::default()).slower.len();
    assert_eq!((slower(1.2), slower(1.5)), (0, 1));
}

/// Of ten runs nine are half as slow again at their slowest, and the tenth ten times as slow.
#[test]
fn the_usual_spread_is_that_of_nine_tenths_of_the_runs() {
    let repeated = (0..10).map(|p| {
        let slowest = if p == 0 { 10.0 } else { 1.5 };
        Run { seconds_max: Some(slowest), ..run(&format!("f/p{p}"), "A", 1.0) }
    });
    let mut old = campaign("a");
    old.runs = repeated.collect();
    let mut new = campaign("a");
    let once = |seconds| Run { repeats: 1, ..run("f/long", "A", seconds) };
    old.runs.push(once(1.0));
    new.runs.push(once(2.0));
    let all = compare(&old, &new, &Options::default());
    assert_eq!((all.slower.len(), all.slower[0].noise), (1, 1.5));
    assert!(all.text().contains(", 1 pair: 0 faster, 1 slower"), "{}", all.text());
}

#[test]
fn as_json_it_is_valid_also_where_nothing_was_reached() {
    let (mut old, mut new) = (campaign("a"), campaign("a"));
    old.runs = vec![failed("f/p", "A", Ending::TimeLimit, 1e-3)];
    new.runs = vec![failed("f/p", "A", Ending::Crashed, 1.0)];
    new.runs[0].residuals.reached = None;
    let all = compare(&old, &new, &Options::default());
    let json: serde_json::Value =
        serde_json::from_str(&serde_json::to_string(&all).unwrap()).unwrap();
    assert_eq!(json["worse"], true);
    assert_eq!(json["less_accurate"][0]["problem"], "f/p");
    assert_eq!(json["less_accurate"][0]["new"], serde_json::Value::Null);
    assert_eq!(json["other_failure"][0]["new"], "crashed");
}

#[test]
fn a_name_on_two_kinds_is_two_solvers() {
    let (old, mut new) = (noisy(1, 1.0, 0.01), noisy(1, 1.0, 0.01));
    let linear = |runs: &Runs, factor: f64| -> Vec<Run> {
        let timed = |x: Option<f64>| x.map(|x| factor * x);
        let one = |r: &Run| Run {
            kind: "lcp".into(),
            problem: r.problem.replace("f/", "l/"),
            seconds: timed(r.seconds),
            seconds_max: timed(r.seconds_max),
            ..r.clone()
        };
        runs.runs.iter().filter(|r| r.solver == "A").map(one).collect()
    };
    let mut both = old.clone();
    both.runs.extend(linear(&old, 1.0));
    new.runs.extend(linear(&old, 1.3));
    let all = compare(&both, &new, &Options::default());
    let paces: Vec<_> =
        all.solvers.iter().map(|p| (p.solver.as_str(), p.kind.as_str(), p.worse)).collect();
    let friction = "friction_local_3d";
    assert_eq!(paces, [("A", friction, false), ("A", "lcp", true), ("B", friction, false)]);
    assert_eq!(all.slower_solvers, ["A"]);
    assert!(all.text().contains("  A on lcp: 1.3"), "{}", all.text());
}

#[test]
fn a_proof_counts_as_solved_and_in_the_place_of_a_solution_it_is_worse() {
    let ended = |ending| {
        let mut runs = campaign("a");
        runs.runs = vec![Run { ending, ..run("f/p", "A", 1.0) }];
        runs
    };
    let [solved, proved, stalled] =
        [Ending::Solved, Ending::Infeasible, Ending::Stalled].map(ended);
    let compared = |a, b| compare(a, b, &Options::default());
    assert!(!compared(&proved, &proved).worse);
    for (a, b) in [(&stalled, &proved), (&proved, &solved)] {
        let all = compared(a, b);
        assert!(!all.worse && all.newly_solved.len() == 1, "{}", all.text());
    }
    for (a, b) in [(&proved, &stalled), (&solved, &proved)] {
        let all = compared(a, b);
        assert!(all.worse && all.newly_unsolved.len() == 1, "{}", all.text());
    }
}

/// Files that were written before the residuals had the field's names.
#[test]
fn old_names_of_residuals_are_read() {
    let mut runs = campaign("a");
    let mut one = run("f/p", "A", 0.5);
    (one.residuals.literature, one.residuals.siconos) = (Some(1e-9), Some(2e-9));
    runs.runs = vec![one];
    let text = runs.clone().text();
    let old = text.replace("\"literature\"", "\"paper\"").replace("\"siconos\"", "\"peer\"");
    assert!(text != old && old.contains("\"peer\":2e-9"), "{old}");
    let read = Runs::parse(std::path::Path::new("old.jsonl"), &old).unwrap();
    assert_eq!(read.runs, runs.runs);
}

//! Profiles and tables against examples computed by hand and against an independent implementation.

use std::process::Command;

use crate::common::{campaign, failed, run};
use nonsmooth_bench::figures::figures;
use nonsmooth_bench::profile::{
    Cost, Costs, Curve, DECADES, Progress, Selection, VIRTUAL_BEST, performance,
    performance_of_best, success,
};
use nonsmooth_bench::record::{Ending, Run, SIZES};
use nonsmooth_bench::runs::Runs;
use nonsmooth_bench::tables::{
    By, competitive, runs_table, summary, summary_page, summary_table, unsolved, unsolved_table,
};
use proptest::prelude::*;
use rand::RngExt;
use rand::SeedableRng;
use rand_pcg::Pcg64;

/// Three solvers, four problems. Times (– failed):
///
/// |     |  A  |  B  |  C  | best |
/// | --- | --- | --- | --- | --- |
/// | p   |  1  |  2  |  4  | 1 |
/// | q   |  3  |  3  |  –  | 3 (a tie) |
/// | r   |  –  |  5  |  1  | 1 |
/// | s   |  –  |  –  |  –  | nobody |
///
/// so A has ratios 1, 1; B 2, 1, 5; C 4, 1.
fn example() -> Runs {
    let mut runs = campaign("a");
    runs.runs = vec![
        run("f/p", "A", 1.0),
        run("f/p", "B", 2.0),
        run("f/p", "C", 4.0),
        run("f/q", "A", 3.0),
        run("f/q", "B", 3.0),
        failed("f/q", "C", Ending::TimeLimit, 1e-3),
        failed("g/r", "A", Ending::Stalled, 1e-5),
        run("g/r", "B", 5.0),
        run("g/r", "C", 1.0),
        failed("g/s", "A", Ending::TimeLimit, 1e-2),
        failed("g/s", "B", Ending::Crashed, 1e-4),
        // C was not run on s.
    ];
    runs
}

const KIND: &str = "friction_local_3d";

fn curve(solver: &str, steps: &[(f64, f64)]) -> Curve {
    Curve { solver: solver.into(), steps: steps.into(), before: 0.0 }
}

#[test]
fn a_profile_computed_by_hand() {
    let costs = Costs::of(&example(), &Selection::at(KIND, 1e-8), Cost::Seconds);
    assert_eq!(costs.problems, ["f/p", "f/q", "g/r", "g/s"]);
    assert_eq!(costs.best(), [1.0, 3.0, 1.0, f64::INFINITY]);
    assert_eq!((costs.missing.as_slice(), costs.unknown.as_slice()), (&[0, 0, 1][..], &[0; 3][..]));
    let expected = [
        curve("A", &[(1.0, 0.5)]),
        curve("B", &[(1.0, 0.25), (2.0, 0.5), (5.0, 0.75)]),
        curve("C", &[(1.0, 0.25), (4.0, 0.5)]),
    ];
    let curves = performance(&costs);
    assert_eq!(curves, expected);
    assert_eq!(performance_of_best(&costs), curve(VIRTUAL_BEST, &[(1.0, 0.75)]));
    // Continuous from the right.
    let at = |x: f64| curves[1].at(x);
    assert_eq!(
        (at(0.5), at(1.0), at(1.9), at(2.0), at(4.9), at(5.0)),
        (0.0, 0.25, 0.25, 0.5, 0.5, 0.75)
    );
}

#[test]
fn selections_narrow_the_problems_and_the_competition() {
    let runs = example();
    let only = |solvers: &[&str]| Selection {
        solvers: solvers.iter().map(|s| (*s).into()).collect(),
        ..Selection::at(KIND, 1e-8)
    };
    // Without A, B is the best on p and C, not run on s, leaves B's failure there in P.
    let costs = Costs::of(&runs, &only(&["B", "C"]), Cost::Seconds);
    assert_eq!(performance(&costs)[0], curve("B", &[(1.0, 0.5), (5.0, 0.75)]));
    let costs = Costs::of(&runs, &only(&["C"]), Cost::Seconds);
    assert_eq!(costs.problems, ["f/p", "f/q", "g/r"]);
    let g = Selection { families: vec!["g".into()], ..Selection::at(KIND, 1e-8) };
    assert_eq!(Costs::of(&runs, &g, Cost::Seconds).problems, ["g/r", "g/s"]);
    assert!(Costs::of(&runs, &Selection::at(KIND, 1e-4), Cost::Seconds).problems.is_empty());
    let large = Selection { sizes: vec![SIZES[2]], ..Selection::at(KIND, 1e-8) };
    assert!(Costs::of(&runs, &large, Cost::Seconds).problems.is_empty());
}

#[test]
fn costs_that_are_zero_or_not_known() {
    let mut runs = campaign("a");
    let with = |solver: &str, factorisations| Run { factorisations, ..run("f/p", solver, 0.0) };
    runs.runs = vec![with("A", Some(0)), with("B", Some(3)), with("C", None)];
    let costs = Costs::of(&runs, &Selection::at(KIND, 1e-8), Cost::Factorisations);
    assert_eq!(costs.t, [[1.0], [3.0], [f64::INFINITY]]);
    assert_eq!(costs.unknown, [0, 0, 1]);
    // What is solved is so without its time.
    runs.runs[1].seconds = None;
    let table = competitive(&runs, &Selection::at(KIND, 1e-8)).markdown();
    assert!(
        table.ends_with("| A | 1 | 1 | 1 | 1 |\n| B | 1 | 1 | 0 | 0 |\n| C | 1 | 1 | 1 | 1 |\n"),
        "{table}"
    );
    runs.runs[1].seconds = Some(0.0);
    // Times of zero tie.
    let costs = Costs::of(&runs, &Selection::at(KIND, 1e-8), Cost::Seconds);
    assert!(performance(&costs).iter().all(|c| c.steps == [(1.0, 1.0)]));
}

#[test]
fn tables_computed_by_hand() {
    let runs = example();
    let selection = Selection::at(KIND, 1e-8);
    let rows = summary(&runs, &selection, By::All);
    let find = |solver: &str| rows.iter().find(|r| r.solver == solver).unwrap();
    let b = find("B");
    assert_eq!((b.problems, b.solved, b.fastest, b.missing), (4, 3, 1, 0));
    assert_eq!(b.ratio_median, Some(2.0));
    assert!((b.ratio_mean.unwrap() - 10f64.powf(1.0 / 3.0)).abs() < 1e-15);
    assert_eq!(b.seconds, 20.0);
    let c = find("C");
    assert_eq!((c.solved, c.missing, c.ratio_median), (2, 1, Some(2.5)));
    let best = find(VIRTUAL_BEST);
    assert_eq!((best.solved, best.fastest, best.seconds), (3, 3, 5.0));
    // Every pair is solved, failed for a cause, or missing.
    for row in rows.iter().filter(|r| r.endings.is_some()) {
        assert_eq!(row.endings.unwrap().iter().sum::<usize>() + row.missing, row.problems);
    }
    let groups = summary(&runs, &selection, By::Family);
    assert_eq!(
        groups.iter().map(|r| r.group.as_str()).collect::<Vec<_>>(),
        ["f"; 4].into_iter().chain(["g"; 4]).collect::<Vec<_>>()
    );
    assert_eq!(summary(&runs, &selection, By::Size).len(), 4);

    let nobody = unsolved(&runs, &selection);
    assert_eq!(nobody.len(), 1);
    assert_eq!(nobody[0].closest, Some(("B".into(), 1e-4)));
    assert_eq!(
        unsolved_table(&nobody).csv().lines().nth(1).unwrap(),
        "g/s,g,friction_local_3d,10,B,1e-4,\"1 time_limit, 1 crashed\""
    );

    let page = summary_page(&rows).markdown();
    assert!(
        page.contains("| A | 4 | 2 | 50.0 | 50.0 | 1.00 | 1.00 | 24.0 | 1 | 1 | 0 | 0 |"),
        "{page}"
    );
    assert!(page.contains("| virtual best | 4 | 3 | 75.0 | 75.0 |"), "{page}");
    let csv = summary_table(&rows).csv();
    let mut read = csv::Reader::from_reader(csv.as_bytes());
    assert_eq!(read.records().map(|r| r.unwrap().len()).collect::<Vec<_>>(), [22; 4]);
}

#[test]
fn refusals_leave_the_shares_and_proofs_are_answers() {
    let mut runs = campaign("a");
    let lcp = |solver: &str| Run { kind: "lcp".into(), ..run("l/1", solver, 9.0) };
    runs.runs = vec![
        run("f/p", "A", 1.0),
        run("f/q", "A", 1.0),
        run("f/p", "B", 2.0),
        failed("f/q", "B", Ending::Refused, 1.0),
        failed("f/p", "C", Ending::Refused, 1.0),
        failed("f/q", "C", Ending::Refused, 1.0),
        failed("f/r", "B", Ending::Refused, 1.0),
        failed("f/s", "A", Ending::NearlyInfeasible, 1.0),
        failed("f/s", "B", Ending::Infeasible, 1.0),
        lcp("A"),
        lcp("C"),
    ];
    let selection = Selection::at(KIND, 1e-8);
    // C takes no problem of the kind; its runs on another kind say nothing here.
    assert_eq!(selection.solvers(&runs), ["A", "B"]);
    assert_eq!(selection.refusing(&runs), ["C"]);
    let costs = Costs::of(&runs, &selection, Cost::Seconds);
    assert_eq!(costs.problems, ["f/p", "f/q", "f/r", "f/s"]);
    assert_eq!(
        (&costs.refused, costs.refused_by_all, &costs.missing),
        (&vec![0, 2], 1, &vec![1, 0])
    );
    let curves = performance(&costs);
    assert_eq!(curves, [curve("A", &[(1.0, 0.5)]), curve("B", &[(1.0, 0.5), (2.0, 1.0)])]);
    assert_eq!(performance_of_best(&costs), curve(VIRTUAL_BEST, &[(1.0, 1.0)]));
    let rows = summary(&runs, &selection, By::All);
    let shares: Vec<_> = rows.iter().map(|r| (r.solved, r.refused, r.solved_share())).collect();
    assert_eq!(shares, [(2, 0, Some(0.5)), (2, 2, Some(1.0)), (3, 1, Some(1.0))]);
    // A proof answers at every tolerance.
    let (classes, left_out) = success(&runs, &selection);
    let tightest = |k: usize| (classes[0].shares[k].0.as_str(), classes[0].shares[k].1[11]);
    assert_eq!([tightest(0), tightest(1)], [("A", 0.0), ("B", 0.5)]);
    assert_eq!(left_out, [""; 0]);
    assert_eq!(Progress::of(&runs, &selection).data_profile(1e-14)[1].steps, [(10.0, 0.5)]);
    // Nobody solves r, but nobody who was asked takes it.
    assert_eq!(unsolved(&runs, &selection), []);
}

#[test]
fn a_foreign_proof_is_no_proof() {
    let mut runs = campaign("a");
    runs.runs = vec![failed("f/p", "A", Ending::Infeasible, 1.0)];
    let read = |runs: &Runs| Runs::parse("r.jsonl".as_ref(), &runs.clone().text()).unwrap();
    assert_eq!(read(&runs).runs[0].ending, Ending::Infeasible);
    runs.campaigns[0].foreign = true;
    assert_eq!(read(&runs).runs[0].ending, Ending::NearlyInfeasible);
}

#[test]
fn texts_cannot_break_a_table() {
    let mut runs = campaign("a");
    let message = "a \"quoted\", comma\nand a line | pipe";
    runs.runs = vec![Run { message: Some(message.into()), ..run("f/p", "a|b,c", 1.0) }];
    let csv = runs_table(&runs).csv();
    let mut reader = csv::Reader::from_reader(csv.as_bytes());
    let head = reader.headers().unwrap().clone();
    let row = reader.records().next().unwrap().unwrap();
    let cell =
        |name: &str| row.get(head.iter().position(|h| h == name).unwrap()).unwrap().to_owned();
    assert_eq!((cell("message"), cell("solver")), (message.into(), "a|b,c".into()));
    assert_eq!(
        (cell("tolerance"), cell("seconds"), cell("reached")),
        ("1e-8".into(), "1".into(), "1e-9".into())
    );
    let markdown = runs_table(&runs).markdown();
    let cells = |l: &str| l.replace("\\|", "").matches('|').count();
    assert_eq!(markdown.lines().count(), 3);
    assert!(markdown.lines().all(|l| cells(l) == cells(markdown.lines().next().unwrap())));
}

#[test]
fn data_profiles_and_quantiles_computed_by_hand() {
    let mut runs = campaign("a");
    let traced = |problem: &str, tolerance, trace: &[(u64, f64, f64)], seconds, reached| {
        let mut run = Run { tolerance, trace: trace.into(), ..run(problem, "A", seconds) };
        run.residuals.reached = Some(reached);
        run
    };
    runs.runs = vec![
        traced("f/p", 1e-4, &[(1, 1.0, 1e-2), (2, 2.0, 1e-1), (3, 3.0, 1e-3)], 4.0, 1e-5),
        traced("f/p", 1e-8, &[(1, 1.5, 1e-3)], 9.0, 1e-8),
        traced("f/q", 1e-4, &[], 2.0, 1e-4),
        traced("f/r", 1e-4, &[(1, 5.0, f64::NAN)], 8.0, 1e-1),
    ];
    let progress = Progress::of(&runs, &Selection::at(KIND, 1e-4));
    let p = [(1.0, 1e-2), (1.5, 1e-3), (4.0, 1e-5), (9.0, 1e-8)];
    assert_eq!(progress.steps[0][0], p);
    let third = 1.0 / 3.0;
    let at = |e: f64| progress.data_profile(e)[0].steps.clone();
    assert_eq!(at(1e-4), [(2.0, third), (4.0, 2.0 * third)]);
    assert_eq!(at(1e-2), [(1.0, third), (2.0, 2.0 * third)]);
    assert_eq!(at(1e-8), [(9.0, third)]);
    assert_eq!(at(1e-12), []);
    // The median of three is the second best: that of q or of p.
    let median = &progress.quantile(0.5)[0];
    assert_eq!(median.before, f64::INFINITY);
    assert_eq!(median.steps, [(2.0, 1e-3), (4.0, 1e-4)]);
    assert_eq!(progress.quantile(0.9)[0].steps, [(8.0, 1e-1)]);
    assert_eq!(progress.best().steps, progress.steps);
}

#[test]
fn success_computed_by_hand() {
    let mut runs = campaign("a");
    let sized = |problem: &str, solver: &str, contacts, reached| {
        let mut run = Run { contacts, ..run(problem, solver, 1.0) };
        run.residuals.reached = reached;
        run
    };
    runs.runs = vec![
        sized("f/p", "A", 5, Some(1e-9)),
        Run { tolerance: 1e-12, ..sized("f/p", "A", 5, Some(2e-12)) },
        sized("f/p", "B", 5, None),
        sized("f/q", "A", 2000, Some(1e-3)),
        sized("f/q", "B", 2000, Some(1e-5)),
    ];
    let (all, _) = success(&runs, &Selection::at(KIND, 1e-8));
    let classes: Vec<_> = all.iter().map(|s| (s.size.map(|s| s.name), s.problems)).collect();
    assert_eq!(classes, [(None, 2), (Some("1-10"), 1), (Some("over 1000"), 1)]);
    let share = |class: usize, solver: &str, eps: f64| {
        let (_, shares) = all[class].shares.iter().find(|(s, _)| s == solver).unwrap();
        shares[DECADES.iter().position(|d| *d == eps).unwrap()]
    };
    assert_eq!((share(0, "A", 1e-3), share(0, "A", 1e-4), share(0, "A", 1e-11)), (1.0, 0.5, 0.5));
    assert_eq!((share(0, "A", 1e-12), share(0, "B", 1e-5), share(0, "B", 1e-6)), (0.0, 0.5, 0.0));
    assert_eq!(
        (share(2, "B", 1e-5), share(2, VIRTUAL_BEST, 1e-5), share(0, VIRTUAL_BEST, 1e-5)),
        (1.0, 1.0, 1.0)
    );
}

// ------------------------------------------------------------------------------------- random campaigns

/// A campaign of so many solvers and problems with failures, gaps, ties, traces and several tolerances.
fn random(seed: u64, solvers: usize, problems: usize) -> Runs {
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut runs = campaign("a");
    for p in 0..problems {
        let contacts = 1 + rng.random_range(0..2000);
        for s in 0..solvers {
            for tolerance in [1e-4, 1e-8] {
                let (problem, solver) = (format!("f{}/p{p}", p % 3), format!("s{s}"));
                let chance: f64 = rng.random();
                if chance < 0.1 {
                    continue;
                }
                // Few values, so that there are ties.
                let seconds = f64::from(rng.random_range(0..40)) * 0.25 * (1.0 + s as f64);
                let mut new = match chance < 0.35 {
                    true => failed(
                        &problem,
                        &solver,
                        Ending::ALL[1 + p % 10],
                        10f64.powi(-(p as i32 % 8)),
                    ),
                    false => run(&problem, &solver, seconds),
                };
                new.tolerance = tolerance;
                new.contacts = contacts;
                new.iterations = Some(rng.random_range(0..1000));
                let step =
                    |k: u64| (k, 0.1 * k as f64, 10f64.powf(-(k as f64) * rng.random::<f64>()));
                new.trace = (1..6).map(step).collect();
                runs.runs.push(new);
            }
        }
    }
    runs
}

#[test]
fn profiles_agree_with_an_independent_implementation() {
    // D. Steck's perfprof, after that of D. J. and N. J. Higham's MATLAB Guide; its curves are read off the plot.
    const PERFPROF: &str = r#"
import sys, json
import matplotlib
matplotlib.use('Agg')
import numpy as np
from perfprof import perfprof
t = np.array([[np.inf if x is None else x for x in row] for row in json.load(sys.stdin)]).T
taus, h = json.loads(sys.argv[1]), None
_, h = perfprof(t, ['-'] * t.shape[1])
def at(line, tau):
    if line is None: return 0.0
    x, y = line[0].get_data()
    k = np.searchsorted(x, tau, side='right')
    return float(y[k - 1]) if k > 0 else 0.0
print(json.dumps([[at(line, tau) for tau in taus] for line in h]))
"#;
    let here = Command::new("python3").args(["-c", "import perfprof"]).output();
    if !here.is_ok_and(|o| o.status.success()) {
        crate::common::skipped("python3 with perfprof is not here");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    for (seed, cost) in [(1, Cost::Seconds), (2, Cost::Seconds), (3, Cost::Iterations)] {
        let costs = Costs::of(&random(seed, 5, 60), &Selection::at(KIND, 1e-8), cost);
        let curves = performance(&costs);
        // At every step, and between them; the package shows ratios up to the largest.
        let mut taus: Vec<f64> = curves.iter().flat_map(|c| c.steps.iter().map(|s| s.0)).collect();
        taus.sort_by(f64::total_cmp);
        taus.dedup();
        let between: Vec<f64> = taus.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect();
        taus.extend(between);
        let times = serde_json::to_string(&costs.t).unwrap();
        let input =
            std::fs::File::open(crate::common::write(folder.path(), "t.json", &times)).unwrap();
        let taus_text = serde_json::to_string(&taus).unwrap();
        let mut python = Command::new("python3");
        let out = python.args(["-c", PERFPROF, &taus_text]).stdin(input).output().unwrap();
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        let theirs: Vec<Vec<f64>> = serde_json::from_slice(&out.stdout).unwrap();
        assert!(taus.len() > 100 && theirs.len() == curves.len());
        for (s, (curve, theirs)) in curves.iter().zip(theirs).enumerate() {
            // The package knows no refusals: its shares are of all problems.
            let part = costs.applicable(s) as f64 / costs.problems.len() as f64;
            for (&tau, rho) in taus.iter().zip(theirs) {
                let ours = part * curve.at(tau);
                assert!((ours - rho).abs() < 1e-12, "{} at {tau}: {ours} {rho}", curve.solver);
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, ..ProptestConfig::default() })]

    #[test]
    fn properties_of_profiles(seed: u64, solvers in 1..6usize, problems in 1..20usize) {
        let runs = random(seed, solvers, problems);
        let selection = Selection::at(KIND, 1e-8);
        let costs = Costs::of(&runs, &selection, Cost::Seconds);
        let any = costs.applicable_to_any() as f64;
        let best = performance_of_best(&costs);
        let curves = performance(&costs);
        for (s, curve) in curves.iter().enumerate() {
            let n = costs.applicable(s) as f64;
            let rising = |w: &[(f64, f64)]| w[0].0 < w[1].0 && w[0].1 < w[1].1;
            prop_assert!(curve.steps.windows(2).all(rising));
            prop_assert!(curve.steps.first().is_none_or(|s| s.0 >= 1.0));
            let at = |r: &&Run| r.solver == curve.solver && r.tolerance == 1e-8 && r.solved();
            prop_assert_eq!((curve.last() * n).round() as usize, runs.runs.iter().filter(at).count());
            for tau in [1.0, 1.5, 3.0, 100.0] {
                prop_assert!(n * curve.at(tau) <= any * best.at(tau) + 1e-9);
            }
        }
        let first = |(s, c): (usize, &Curve)| costs.applicable(s) as f64 * c.at(1.0);
        let first: f64 = curves.iter().enumerate().map(first).sum();
        prop_assert!(first >= any * best.last() - 1e-9);

        let progress = Progress::of(&runs, &selection);
        let bound = progress.best();
        for (eps, t) in [(1e-1, 0.3), (1e-2, 1.0), (1e-8, 20.0)] {
            let top = progress.applicable_to_any as f64 * bound.data_profile(eps)[0].at(t);
            let both = progress.data_profile(eps).into_iter().zip(progress.quantile(0.5));
            for ((d, q), n) in both.zip(&progress.applicable) {
                prop_assert!(*n as f64 * d.at(t) <= top + 1e-9);
                // Two ways to ask the same: half the problems are within eps by t.
                prop_assert_eq!(d.at(t) >= 0.5, q.at(t) <= eps);
            }
        }
        for class in success(&runs, &selection).0 {
            for (_, shares) in &class.shares {
                prop_assert!(shares.windows(2).all(|w| w[0] >= w[1]));
                prop_assert!(shares.iter().all(|share| (0.0..=1.0).contains(share)));
            }
        }
    }
}

// ------------------------------------------------------------------------------------------------ figures

#[test]
fn figures_are_drawn_and_carry_their_data() {
    let runs = random(7, 5, 40);
    let all = figures(&runs, &Selection::at(KIND, 1e-8)).unwrap();
    let names: Vec<&str> = all.iter().map(|f| f.name.as_str()).collect();
    let expected = [
        "profile-seconds",
        "profile-iterations",
        "profile-factorisations",
        "data-profile",
        "success",
        "residual",
    ];
    assert_eq!(names, expected);
    for figure in &all {
        assert!(figure.svg.starts_with("<svg ") && figure.svg.trim_end().ends_with("</svg>"));
        assert!(!figure.svg.contains("NaN") && !figure.svg.contains("inf"), "{}", figure.name);
        for solver in ["s0", "s4", VIRTUAL_BEST] {
            assert!(figure.svg.contains(&format!("{solver}\n")), "{solver} in {}", figure.name);
            assert!(figure.csv.contains(solver), "{solver} in {}", figure.name);
        }
        assert!(figure.svg.len() < 400_000, "{}: {}", figure.name, figure.svg.len());
    }
    // The data of the picture are those of the profile.
    let costs = Costs::of(&runs, &Selection::at(KIND, 1e-8), Cost::Seconds);
    let mut reader = csv::Reader::from_reader(all[0].csv.as_bytes());
    let mut points = 0;
    for row in reader.records() {
        let row = row.unwrap();
        let value = |k: usize| row[k].parse::<f64>().unwrap();
        if let Some(curve) = performance(&costs).iter().find(|c| c.solver == row[0]) {
            assert_eq!(curve.at(value(1)), value(2));
            points += 1;
        }
    }
    assert!(points > 50);
}

#[test]
fn sizes_are_of_contacts_or_of_pairs() {
    for (kind, counted) in [(KIND, "contacts"), ("mcp", "pairs"), ("vi", "variables")] {
        let sized = |problem: &str, contacts: usize| Run {
            kind: kind.into(),
            contacts,
            ..run(problem, "A", 1.0)
        };
        let mut runs = campaign("a");
        runs.runs = vec![sized("f/p", 5), sized("f/q", 2000), sized("f/r", 3000)];
        let drawn = nonsmooth_bench::figures::success(&runs, &Selection::at(kind, 1e-8));
        let svg = drawn.unwrap().unwrap().svg;
        for title in
            [format!("1-10 {counted} (1 problem)"), format!("over 1000 {counted} (2 problems)")]
        {
            assert!(svg.contains(&title), "{title}");
        }
    }
}

#[test]
fn figures_are_xml_and_labels_that_are_cut_differ() {
    let label = |a: &str, b: &str| format!("{a}{}{b}", "x".repeat(60));
    let labels =
        ["a\u{1}\u{fffe}<b>\nc".into(), label("p", "1"), label("p", "2"), label("pp", "2")];
    let mut runs = campaign("a");
    runs.runs = labels.iter().map(|label| run("f/p", label, 1.0)).collect();
    let all = figures(&runs, &Selection::at(KIND, 1e-8)).unwrap();
    assert_eq!(all.len(), 6);
    for figure in all {
        let barred = |c: char| c.is_control() && c != '\n' || c == '\u{fffe}';
        assert!(!figure.svg.contains(barred), "{}", figure.name);
        let x = |n| "x".repeat(n);
        for label in [
            "a\u{fffd}\u{fffd}&lt;b&gt;".into(),
            format!("p{}…{}1\n", x(18), x(18)),
            format!("p{}…{}2\n", x(18), x(18)),
            format!("pp{}…{}2\n", x(17), x(18)),
        ] {
            assert!(figure.svg.contains(&label), "{label} in {}", figure.name);
        }
        assert!(!figure.svg.contains("1 problems"), "{}", figure.name);
    }
    // Alike at both ends.
    runs.runs = ["1", "2"]
        .map(|k| run("f/p", &format!("{}{k}{}", label("", ""), label("", "")), 1.0))
        .into();
    let svg = &figures(&runs, &Selection::at(KIND, 1e-8)).unwrap()[0].svg;
    let cut = format!("{0}…{0}", "x".repeat(19));
    assert!(svg.contains(&format!("{cut}\n")) && svg.contains(&format!("{cut}-2\n")), "{svg}");
}

#[test]
fn figures_are_of_the_tolerances_of_their_kind() {
    let mut runs = campaign("a");
    let other = Run { kind: "lcp".into(), tolerance: 1e-12, ..run("l/p", "A", 1.0) };
    runs.runs = vec![run("f/p", "A", 1.0), other];
    let all = figures(&runs, &Selection::at(KIND, 1e-8)).unwrap();
    let svg = |name: &str| &all.iter().find(|f| f.name == name).unwrap().svg;
    assert!(svg("success").contains("the tightest is 1e-8"));
    assert!(!svg("data-profile").contains("residual 1e-12"));
}

#[test]
fn a_tolerance_is_common_to_the_runs_of_a_selection() {
    let mut runs = campaign("a");
    let at = |tolerance: f64, of: Run| Run { tolerance, ..of };
    let lcp = |solver: &str| Run { kind: "lcp".into(), ..run("l/p", solver, 1.0) };
    runs.runs = vec![
        at(1e-4, run("f/p", "A", 1.0)),
        run("f/p", "A", 1.0),
        at(1e-4, run("g/p", "B", 1.0)),
        at(1e-10, lcp("C")),
        at(1e-12, lcp("C")),
    ];
    let common = |selection: &Selection| selection.common_tolerance(&runs);
    let all = Selection::at(KIND, 1e-8);
    assert_eq!((common(&all), common(&Selection::at("lcp", 1.0))), (Some(1e-4), Some(1e-12)));
    assert_eq!(common(&Selection { solvers: vec!["A".into()], ..all.clone() }), Some(1e-8));
    assert_eq!(common(&Selection { families: vec!["g".into()], ..all.clone() }), Some(1e-4));
    assert_eq!(common(&Selection::at("mcp", 1e-8)), None);
    assert_eq!(all.without_runs(&runs), ["B"]);
}

#[test]
fn figures_of_little_or_nothing() {
    let selection = Selection::at(KIND, 1e-8);
    assert_eq!(figures(&campaign("a"), &selection).unwrap(), []);
    let mut runs = campaign("a");
    runs.runs = vec![run("f/p", "A", 1e-3)];
    assert_eq!(figures(&runs, &selection).unwrap().len(), 6);
    // Nothing solved, nothing known.
    let mut lost = failed("f/p", "A", Ending::Crashed, 1.0);
    (lost.seconds, lost.residuals.reached) = (None, None);
    runs.runs = vec![lost];
    let names: Vec<String> =
        figures(&runs, &selection).unwrap().into_iter().map(|f| f.name).collect();
    assert_eq!(names, ["success"]);
    // A cost that a solver does not report is no failure of its: it is left out, with a word.
    runs.runs = vec![run("f/p", "A", 1.0), Run { iterations: None, ..run("f/p", "B", 2.0) }];
    let all = figures(&runs, &selection).unwrap();
    assert!(all[1].svg.contains("without B: iterations not reported"));
    assert!(!all[1].csv.contains('B'));
}

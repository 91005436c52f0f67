//! Campaigns with solvers that crash, hang, eat the memory and lie; and journals that were torn, locked or changed.
//!
//! This program is its own worker, so that solvers which exist for the tests alone can be run in processes of their own.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::atomic::AtomicBool;

use libtest_mimic::{Arguments, Trial};
use nonsmooth_bench::campaign::{
    Event, Journal, Registry, Setup, Solvers, Summary, WorkerCommand, inputs, machine, run, serve,
};
use nonsmooth_bench::record::{Campaign, Ending, FORMAT, Key, Line, Plan, Run, VERSION};
use nonsmooth_bench::runs::{Joined, Runs, RunsError};
use nonsmooth_io::ProblemFile;
use nonsmooth_problem::Problem;
use nonsmooth_problem::planted::Planted;
use nonsmooth_solve::registry::Registered;
use nonsmooth_solve::settings::SettingsMap;
use nonsmooth_solve::{Driver, Session, SolveError, Solver, Step};

const WORKER: &str = "be-the-worker";

fn main() {
    if std::env::args().nth(1).as_deref() == Some(WORKER) {
        serve(&WithFaulty).unwrap();
        return;
    }
    macro_rules! trials {
        ($($name:ident),* $(,)?) => {
            vec![$(Trial::test(stringify!($name), || { $name(); Ok(()) })),*]
        };
    }
    let trials = trials![
        faulty_solvers_cost_their_own_runs_only,
        a_campaign_goes_on_where_it_was_cut_off,
        shards_add_up_to_the_whole,
        a_plan_that_differs_is_refused,
        a_problem_that_changed_is_left_out,
        a_further_folder_changes_no_name_that_is_there,
        labels_have_one_spelling_in_a_file,
        a_journal_has_one_writer,
        files_of_another_version_are_refused_by_name,
        lines_survive_the_way_to_the_file_and_back,
        an_unreadable_problem_is_recorded_and_the_rest_goes_on,
        parts_that_do_not_fit_are_told,
        a_file_that_changes_or_goes_meanwhile_costs_its_runs_only,
        numbers_that_cannot_be_are_named_by_their_line,
    ];
    libtest_mimic::run(&Arguments::from_args(), trials).exit();
}

/// The registry, and solvers that misbehave.
struct WithFaulty;

impl Solvers for WithFaulty {
    fn session<P: Registered>(
        &self,
        name: &str,
        settings: &SettingsMap,
    ) -> Result<Box<dyn Session<P>>, SolveError> {
        match FAULTS.iter().find(|f| f.name == name) {
            Some(fault) => Ok(Box::new(Driver::new(Faulty(fault.kind)))),
            None => Registry.session(name, settings),
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Abort,
    Panic,
    Overflow,
    Hang,
    Eat,
    Lie,
    Exit,
}

/// A way to misbehave, how its run must end, and what must be told of it.
struct Fault {
    name: &'static str,
    kind: Kind,
    ending: Ending,
    told: &'static str,
}

const fn fault(name: &'static str, kind: Kind, ending: Ending, told: &'static str) -> Fault {
    Fault { name, kind, ending, told }
}

const FAULTS: [Fault; 7] = [
    fault("abort", Kind::Abort, Ending::Crashed, "signal 6"),
    fault("panic", Kind::Panic, Ending::Crashed, "a fault of the test's own making"),
    fault("overflow", Kind::Overflow, Ending::Crashed, "stack overflow"),
    fault("hang", Kind::Hang, Ending::Hung, "did not stop at the limit of 0.5 s"),
    fault("eat", Kind::Eat, Ending::OutOfMemory, "(limit 0.50 GiB)"),
    fault("lie", Kind::Lie, Ending::Stalled, "fails the check"),
    fault("exit", Kind::Exit, Ending::Crashed, "exit status: 0"),
];

struct Faulty(Kind);

impl<P: Problem> Solver<P> for Faulty {
    type Work = Vec<Vec<u8>>;

    fn work(&self, _: &P) -> Result<Self::Work, SolveError> {
        Ok(vec![])
    }

    fn refill(&self, _: &P, _: &mut Self::Work) -> Result<(), SolveError> {
        Ok(())
    }

    fn start(&self, _: &P, _: &mut P::Point, _: &mut Self::Work) {}

    fn step(&self, _: &P, _: &mut P::Point, work: &mut Self::Work) -> Step {
        match self.0 {
            Kind::Abort => std::process::abort(),
            Kind::Panic => panic!("a fault of the test's own making"),
            Kind::Overflow => Step::Continue { estimate: deep(1.0) },
            Kind::Hang => loop {
                std::hint::spin_loop();
            },
            Kind::Eat => loop {
                work.push(vec![1; 1 << 24]);
            },
            Kind::Lie => Step::Done,
            Kind::Exit => std::process::exit(0),
        }
    }
}

/// Recursion that ends only with the stack, and that no optimiser turns into a loop.
fn deep(x: f64) -> f64 {
    let frame = std::hint::black_box([x; 512]);
    if frame[7] < 0.0 { 0.0 } else { deep(frame[0] + 1.0) + frame[511] }
}

/// A folder with `count` small problems in the families `one` and `two`.
fn problems(folder: &Path, count: u64) {
    for seed in 0..count {
        let family = folder.join(if seed % 2 == 0 { "one" } else { "two" });
        std::fs::create_dir_all(&family).unwrap();
        problem(&family.join(format!("p{seed}.hdf5")), 3 + seed as usize, seed);
    }
}

fn problem(file: &Path, contacts: usize, seed: u64) {
    let planted = Planted { contacts, dofs: 12, seed, ..Planted::default() };
    ProblemFile::new(planted.local::<3>().0).write(file).unwrap();
}

fn plan(solvers: &[&str]) -> Plan {
    Plan {
        solvers: solvers.iter().map(ToString::to_string).collect(),
        tolerances: vec![1e-4, 1e-6],
        time_limit: 0.5,
        memory_limit: 1 << 29,
        repeats: 2,
        repeat_below: 1.0,
        trace: true,
        jobs: 2,
        shard: None,
    }
}

fn header(id: &str, plan: &Plan) -> Campaign {
    Campaign {
        format: FORMAT.into(),
        version: VERSION,
        id: id.into(),
        program: "test 0".into(),
        foreign: false,
        started: Some(1),
        machine: machine(),
        plan: Some(plan.clone()),
    }
}

/// Runs what the file lacks.
fn go_on(folder: &Path, file: &Path, plan: &Plan) -> Result<Summary, String> {
    go_on_watched(folder, file, plan, &mut |_| {})
}

fn go_on_watched(
    folder: &Path,
    file: &Path,
    plan: &Plan,
    watch: &mut dyn FnMut(Event<'_>),
) -> Result<Summary, String> {
    let id = file.file_name().unwrap().to_string_lossy();
    let (mut journal, there) = Journal::resume(file, &header(&id, plan))?;
    let program = std::env::current_exe().unwrap();
    let worker = WorkerCommand { program, arguments: vec![WORKER.into()] };
    let (inputs, mistakes) = inputs(&[folder.into()]);
    assert!(mistakes.is_empty(), "{mistakes:?}");
    let setup = Setup { worker, inputs, plan: plan.clone(), named: true, grace: 3.0 };
    let cancel = AtomicBool::new(false);
    run(&setup, &WithFaulty, &there, &mut journal, &cancel, watch)
}

fn keys(runs: &Runs) -> BTreeSet<Key> {
    let keys: BTreeSet<_> = runs.runs.iter().map(Run::key).collect();
    assert_eq!(keys.len(), runs.runs.len(), "a run stands twice");
    keys
}

fn faulty_solvers_cost_their_own_runs_only() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("problems");
    problems(&folder, 2);
    let mut names: Vec<_> = FAULTS.iter().map(|f| f.name).collect();
    names.insert(3, "nsgs");
    names.push("condense/nsgs");
    let plan = Plan { tolerances: vec![1e-6], ..plan(&names) };
    let file = dir.path().join("runs.jsonl");
    let summary = go_on(&folder, &file, &plan).unwrap();
    let runs = Runs::read(&file).unwrap();
    assert_eq!((summary.all, summary.done, runs.runs.len()), (18, 18, 18));
    for run in &runs.runs {
        let message = run.message.as_deref().unwrap_or_default();
        match FAULTS.iter().find(|f| f.name == run.solver) {
            // Elsewhere nothing keeps a process from eating the memory.
            Some(fault) if fault.kind == Kind::Eat && !cfg!(target_os = "linux") => {}
            Some(fault) => {
                assert_eq!(run.ending, fault.ending, "{run:?}");
                assert!(message.contains(fault.told), "{}: {message}", run.solver);
                if fault.kind == Kind::Hang {
                    assert!((3.4..30.0).contains(&run.seconds.unwrap()), "{run:?}");
                }
            }
            None if run.solver == "nsgs" => {
                assert_eq!(run.ending, Ending::Solved, "{run:?}");
                assert!(run.residuals.reached.unwrap() <= 1e-6 && run.message.is_none());
                assert!(run.repeats >= 2 && run.iterations.unwrap() > 0);
                let times = [run.seconds, run.seconds_median, run.seconds_max].map(Option::unwrap);
                assert!(0.0 < times[0] && times.is_sorted(), "{times:?}");
                assert!(!run.trace.is_empty());
            }
            None => {
                assert_eq!(run.ending, Ending::Refused, "{run:?}");
                assert_eq!(message, "takes no friction_local_3d problems");
            }
        }
    }
}

fn a_campaign_goes_on_where_it_was_cut_off() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("problems");
    problems(&folder, 4);
    let plan = plan(&["nsgs", "extragradient"]);
    let file = dir.path().join("runs.jsonl");
    let all = go_on(&folder, &file, &plan).unwrap();
    assert_eq!((all.all, all.new, all.endings.get("solved")), (16, 16, Some(&16)));
    let whole = Runs::read(&file).unwrap();
    let text = std::fs::read(&file).unwrap();
    let ends = text.iter().enumerate().filter(|(_, b)| **b == b'\n').map(|(k, _)| k + 1);
    let ends: Vec<usize> = ends.collect();
    // Cut after a whole line, within a line, at and in the first line, to nothing, and before the very last byte.
    for cut in [ends[10], ends[12] + 17, ends[0] - 1, 20, 0, text.len() - 1] {
        std::fs::write(&file, &text[..cut]).unwrap();
        let there = Runs::read(&file).map(|r| r.runs.len()).unwrap_or(0);
        let summary = go_on(&folder, &file, &plan).unwrap();
        assert_eq!((summary.done, summary.new), (16, 16 - there), "cut at {cut}");
        let again = Runs::read(&file).unwrap();
        assert!(std::fs::read(&file).unwrap().ends_with(b"\n"));
        assert_eq!(keys(&again), keys(&whole), "cut at {cut}");
        assert_eq!(again.problems, whole.problems);
    }
    assert_eq!(go_on(&folder, &file, &plan).unwrap().new, 0);
    // More solvers and tolerances are welcome.
    let solvers = vec!["nsgs".into(), "fixed_point".into()];
    let more = Plan { solvers, tolerances: vec![1e-4, 1e-5], ..plan };
    let summary = go_on(&folder, &file, &more).unwrap();
    assert_eq!((summary.all, summary.new), (16, 12));
}

fn shards_add_up_to_the_whole() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("problems");
    problems(&folder, 5);
    let whole = plan(&["nsgs", "fixed_point"]);
    let file = dir.path().join("whole.jsonl");
    go_on(&folder, &file, &whole).unwrap();
    let parts = [3, 1, 2].map(|i| {
        let part = dir.path().join(format!("{i}.jsonl"));
        go_on(&folder, &part, &Plan { shard: Some((i, 3)), ..whole.clone() }).unwrap();
        Runs::read(&part).unwrap()
    });
    let mut joined = Runs::default();
    for part in &parts[..2] {
        assert_eq!(joined.join(part.clone()), Joined::default());
    }
    assert_eq!(joined.missing_parts(), ["missing parts 2/3"]);
    joined.join(parts[2].clone());
    assert_eq!((joined.missing_parts(), joined.unfinished()), (vec![], vec![]));
    assert_eq!(keys(&joined), keys(&Runs::read(&file).unwrap()));
    // What a campaign that was ended has not done, and what the end tore, is told.
    let text = std::fs::read_to_string(&file).unwrap();
    let cut = |lines: usize, end: &str| {
        let kept: String = text.split_inclusive('\n').take(lines).collect();
        Runs::parse(&file, &(kept + end)).unwrap().unfinished()
    };
    assert_eq!(cut(26, ""), [""; 0]);
    assert_eq!(cut(25, ""), ["missing 1 of 20 runs of the plan"]);
    let torn = "the last line is torn, and left out";
    assert_eq!(cut(8, "{\"line\":\"run"), [torn, "missing 18 of 20 runs of the plan"]);
    // All runs of a problem are made by one part.
    let mut makers = BTreeMap::new();
    for run in &joined.runs {
        assert_eq!(makers.entry(&run.problem).or_insert(&run.campaign), &&run.campaign);
    }
    let again = joined.clone().join(parts[2].clone());
    assert_eq!((again.twice, again.conflicts.len()), (parts[2].runs.len(), 0));
}

fn a_plan_that_differs_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("runs.jsonl");
    let plan = plan(&["nsgs"]);
    drop(Journal::create(&file, &header("c", &plan)).unwrap());
    let refusal = |other: Plan| Journal::resume(&file, &header("d", &other)).unwrap_err();
    let longer = refusal(Plan { time_limit: 2.0, ..plan.clone() });
    assert!(longer.ends_with("to resume, expected a time limit of 0.5, found 2"), "{longer}");
    let part = refusal(Plan { shard: Some((1, 2)), ..plan.clone() });
    assert!(part.ends_with("expected shard none, found 1/2"), "{part}");
    // Foreign runs that were joined have no plan, and hide none.
    let text = std::fs::read_to_string(&file).unwrap();
    let foreign = Campaign { plan: None, foreign: true, ..header("theirs", &plan) };
    let line = serde_json::to_string(&Line::Campaign(foreign)).unwrap();
    std::fs::write(&file, format!("{text}{line}\n")).unwrap();
    let longer = refusal(Plan { time_limit: 2.0, ..plan.clone() });
    assert!(longer.ends_with("expected a time limit of 0.5, found 2"), "{longer}");
    std::fs::write(&file, text).unwrap();
    let e = Journal::create(&file, &header("c", &plan)).unwrap_err();
    assert!(e.contains("expected a new file") && e.contains("--resume"), "{e}");
    // On another machine the runs to come name another campaign.
    let mut other = header("elsewhere", &plan);
    other.machine.cpu = "another".into();
    let (journal, _) = Journal::resume(&file, &other).unwrap();
    assert_eq!(journal.campaign(), "elsewhere");
    drop(journal);
    assert_eq!(Runs::read(&file).unwrap().campaigns.len(), 2);
    let (journal, _) = Journal::resume(&file, &header("again", &plan)).unwrap();
    assert_eq!(journal.campaign(), "c");
}

fn a_problem_that_changed_is_left_out() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("problems");
    problems(&folder, 2);
    let file = dir.path().join("runs.jsonl");
    go_on(&folder, &file, &plan(&["nsgs"])).unwrap();
    let before = std::fs::read(&file).unwrap();
    problem(&folder.join("one/p0.hdf5"), 7, 9);
    let more = plan(&["nsgs", "extragradient"]);
    let summary = go_on(&folder, &file, &more).unwrap();
    assert_eq!((summary.unreadable, summary.all, summary.new), (1, 4, 2));
    std::fs::write(folder.join("one/p0.hdf5"), "no problem").unwrap();
    let summary = go_on(&folder, &file, &more).unwrap();
    assert_eq!((summary.unreadable, summary.all, summary.new), (1, 4, 0));
    // What was known stays as it was.
    assert!(std::fs::read(&file).unwrap().starts_with(&before));
    let runs = Runs::read(&file).unwrap();
    assert!(runs.problems["one/p0"].error.is_none());
    assert_eq!(runs.runs.len(), 6);
}

fn a_further_folder_changes_no_name_that_is_there() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("first");
    problems(&folder, 2);
    let file = dir.path().join("runs.jsonl");
    let plan = plan(&["nsgs"]);
    go_on(&folder, &file, &plan).unwrap();
    // Another problem of the same family and name.
    std::fs::create_dir_all(dir.path().join("second/one")).unwrap();
    problem(&dir.path().join("second/one/p0.hdf5"), 7, 9);
    let summary = go_on(dir.path(), &file, &plan).unwrap();
    assert_eq!((summary.unreadable, summary.all, summary.new), (0, 6, 2));
    let runs = Runs::read(&file).unwrap();
    let names: Vec<_> = runs.problems.keys().map(String::as_str).collect();
    assert_eq!(names, ["one/p0", "second/one/p0", "two/p1"]);
    assert_eq!(go_on(dir.path(), &file, &plan).unwrap().new, 0);
    // Nor does a folder less, whose names take in fewer folders.
    for folder in ["first", "second"] {
        let summary = go_on(&dir.path().join(folder), &file, &plan).unwrap();
        assert_eq!((summary.unreadable, summary.new), (0, 0), "{folder}");
    }
    assert_eq!(Runs::read(&file).unwrap().problems.len(), 3);
}

fn labels_have_one_spelling_in_a_file() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("problems");
    problems(&folder, 1);
    let file = dir.path().join("runs.jsonl");
    let (one, another) = ("nsgs:omega=0.9,local=quartic", "nsgs: local=quartic,omega=0.90");
    assert_eq!(go_on(&folder, &file, &plan(&[one])).unwrap().new, 2);
    assert_eq!(go_on(&folder, &file, &plan(&[another])).unwrap().new, 0);
    let label = "nsgs:local=quartic,omega=0.9";
    let text = std::fs::read_to_string(&file).unwrap();
    assert_eq!(text.matches(&format!("\"solver\":\"{label}\"")).count(), 2, "{text}");
    // So are those of older files read.
    let old = Runs::parse(&file, &text.replace(label, one)).unwrap();
    assert_eq!((old.solvers(), old.unfinished()), (vec![label], vec![]));
}

fn a_journal_has_one_writer() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("runs.jsonl");
    let header = header("c", &plan(&["nsgs"]));
    let held = Journal::create(&file, &header).unwrap();
    let e = Journal::resume(&file, &header).unwrap_err();
    assert!(e.contains("another campaign writes"), "{e}");
    drop(held);
    Journal::resume(&file, &header).unwrap();
}

fn files_of_another_version_are_refused_by_name() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("runs.jsonl");
    drop(Journal::create(&file, &header("c", &plan(&["nsgs"]))).unwrap());
    let text = std::fs::read_to_string(&file).unwrap();
    let said = |text: &str| Runs::parse(Path::new("f"), text).unwrap_err();
    let newer = text.replace("\"version\":1", "\"version\":2");
    // A later version may have lines that this one does not know.
    for newer in [newer.clone(), newer.replace("\"id\"", "\"identity\"")] {
        let e = said(&newer);
        assert!(matches!(e, RunsError::Version { found: 2, .. }), "{e}");
        let expected =
            "f: expected version 1 of nonsmooth-runs, found version 2; it was written by test 0";
        assert_eq!(e.to_string(), expected);
    }
    assert!(matches!(said(""), RunsError::Empty { .. }));
    let e = said("{\"a\":1}\n").to_string();
    assert!(e.starts_with("f, line 1: expected a line of nonsmooth-runs"), "{e}");
    let middle = format!("{text}rubbish\n{text}");
    assert!(said(&middle).to_string().starts_with("f, line 2: "));
    let e = Runs::read(&dir.path().join("none")).unwrap_err().to_string();
    assert!(e.contains("No such file"), "{e}");
}

fn lines_survive_the_way_to_the_file_and_back() {
    let plan = Plan { shard: Some((2, 3)), ..plan(&["nsgs:omega=0.9"]) };
    let run = Run {
        campaign: "c".into(),
        problem: "a/b".into(),
        solver: "nsgs:omega=0.9".into(),
        tolerance: 1.0 / 3.0 * 1e-7,
        ending: Ending::Hung,
        seconds: Some(0.1 + 0.2),
        trace: vec![(1, 0.5, 1e-300)],
        ..Run::default()
    };
    for line in [Line::Campaign(header("c", &plan)), Line::Run(Box::new(run))] {
        let text = serde_json::to_string(&line).unwrap();
        assert_eq!(serde_json::from_str::<Line>(&text).unwrap(), line, "{text}");
    }
    for ending in Ending::ALL {
        assert_eq!(serde_json::to_value(ending).unwrap(), ending.name());
    }
    // Fields that are added later are passed over.
    let extra = r#"{"line":"run","campaign":"c","problem":"p","solver":"s","tolerance":1,"ending":"solved","new":3}"#;
    assert!(serde_json::from_str::<Line>(extra).is_ok());
}

fn an_unreadable_problem_is_recorded_and_the_rest_goes_on() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("problems");
    problems(&folder, 3);
    std::fs::write(folder.join("one/broken.hdf5"), "no HDF5 at all").unwrap();
    let file = dir.path().join("runs.jsonl");
    let summary = go_on(&folder, &file, &plan(&["nsgs"])).unwrap();
    assert_eq!((summary.unreadable, summary.done), (1, 6));
    let runs = Runs::read(&file).unwrap();
    let error = runs.problems["one/broken"].error.as_deref().unwrap();
    assert!(error.contains("broken.hdf5"), "{error}");
    // Mended, it is run on resumption.
    std::fs::copy(folder.join("one/p0.hdf5"), folder.join("one/broken.hdf5")).unwrap();
    let summary = go_on(&folder, &file, &plan(&["nsgs"])).unwrap();
    assert_eq!((summary.unreadable, summary.new, summary.done), (0, 2, 8));
    assert!(Runs::read(&file).unwrap().problems["one/broken"].error.is_none());
}

fn parts_that_do_not_fit_are_told() {
    let dir = tempfile::tempdir().unwrap();
    let [a, b] = ["a", "b"].map(|n| dir.path().join(n));
    problems(&a, 2);
    problems(&b, 1);
    problem(&b.join("one/p0.hdf5"), 9, 5);
    let files = ["a.jsonl", "b.jsonl"].map(|n| dir.path().join(n));
    go_on(&a, &files[0], &plan(&["nsgs"])).unwrap();
    go_on(&b, &files[1], &Plan { time_limit: 0.7, ..plan(&["nsgs"]) }).unwrap();
    let mut joined = Runs::read(&files[0]).unwrap();
    let told = joined.join(Runs::read(&files[1]).unwrap());
    assert_eq!((told.twice, told.conflicts), (0, vec!["one/p0".to_owned()]));
    assert_eq!(joined.runs.len(), 4);
    assert_eq!(joined.differing_plans(), ["plans differ: a time limit of 0.5, found 0.7"]);
}

fn a_file_that_changes_or_goes_meanwhile_costs_its_runs_only() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("problems");
    problems(&folder, 3);
    let [changed, gone] = ["two/p1.hdf5", "one/p2.hdf5"].map(|name| folder.join(name));
    let before = [&changed, &gone].map(|file| std::fs::read(file).unwrap());
    let file = dir.path().join("runs.jsonl");
    let plan = Plan { jobs: 1, ..plan(&["nsgs"]) };
    let mut told = vec![];
    let summary = go_on_watched(&folder, &file, &plan, &mut |event| match event {
        Event::Described { done: 3, .. } => {
            problem(&changed, 7, 9);
            std::fs::remove_file(&gone).unwrap();
        }
        Event::Lost { why } => told.push(why.to_owned()),
        _ => {}
    });
    let summary = summary.unwrap();
    assert_eq!((summary.all, summary.done, summary.new, summary.lost), (6, 2, 2, 4));
    told.sort();
    assert_eq!(told.len(), 2, "{told:?}");
    assert!(told[0].ends_with("p2.hdf5: expected the problem, found that its file is gone"));
    assert!(told[1].ends_with("found that its file has changed"), "{told:?}");
    assert!(Runs::read(&file).unwrap().runs.iter().all(|r| r.problem == "one/p0"));
    // With the files as they were the campaign is completed.
    std::fs::write(&changed, &before[0]).unwrap();
    std::fs::write(&gone, &before[1]).unwrap();
    let summary = go_on(&folder, &file, &plan).unwrap();
    assert_eq!((summary.done, summary.new, summary.lost), (6, 4, 0));
}

fn numbers_that_cannot_be_are_named_by_their_line() {
    let header = serde_json::to_string(&Line::Campaign(header("c", &plan(&[])))).unwrap();
    let run = |rest: &str| {
        format!(
            "{header}\n{{\"line\":\"run\",\"campaign\":\"c\",\"problem\":\"p\",\"solver\":\"s\",\"ending\":\"solved\",{rest}}}\n"
        )
    };
    let read = |text: &str| Runs::parse(Path::new("f"), text);
    for (rest, found) in [
        ("\"tolerance\":0.0", "a tolerance of 0e0"),
        ("\"tolerance\":-0.0", "a tolerance of -0e0"),
        ("\"tolerance\":-1", "a tolerance of -1e0"),
        ("\"tolerance\":1,\"seconds\":-2", "seconds of -2e0"),
        ("\"tolerance\":1,\"residuals\":{\"reached\":-1e-9}", "a residual of -1e-9"),
    ] {
        let e = read(&run(rest)).unwrap_err().to_string();
        let expected = "f, line 2: expected a line of nonsmooth-runs, found ";
        assert_eq!(e, format!("{expected}{found}"));
    }
    let good = run("\"tolerance\":1,\"seconds\":0");
    assert_eq!(read(&good).unwrap(), read(&format!("\u{feff}{good}")).unwrap());
    // A part of absurdly many is told in one line.
    let mut many = read(&good).unwrap();
    many.campaigns[0].plan.as_mut().unwrap().shard = Some((usize::MAX, usize::MAX));
    let remarks = many.missing_parts();
    assert!(remarks.len() == 1 && remarks[0].ends_with("more"), "{remarks:?}");
}

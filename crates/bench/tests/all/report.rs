//! The report: what is embedded in the page, and what a real browser makes of it.

use std::path::Path;
use std::time::Duration;

use crate::browser::Browser;
use nonsmooth_bench::profile::{
    Cost, Costs, Curve, Progress, Selection, VIRTUAL_BEST, performance, performance_of_best,
    success,
};
use nonsmooth_bench::record::{
    Campaign, Ending, FORMAT, Machine, Plan, Problem, Residuals, Run, SIZES, VERSION,
};
use nonsmooth_bench::report::{Options, html};
use nonsmooth_bench::runs::Runs;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde_json::{Value, json};

fn campaign(id: &str, foreign: bool) -> Campaign {
    let plan = Plan {
        solvers: vec![],
        tolerances: vec![1e-4, 1e-8],
        time_limit: 20.0,
        memory_limit: 4 << 30,
        repeats: 5,
        repeat_below: 1.0,
        trace: true,
        jobs: 1,
        shard: None,
    };
    Campaign {
        format: FORMAT.into(),
        version: VERSION,
        id: id.into(),
        program: if foreign { "Another 4.5".into() } else { "nonsmooth 0.1.0".into() },
        foreign,
        started: Some(1_790_000_000),
        machine: Machine {
            cpu: format!("processor of {id}"),
            cores: 2,
            memory: 8 << 30,
            os: "Debian".into(),
        },
        plan: (!foreign).then_some(plan),
    }
}

fn run(problem: &str, solver: &str, tolerance: f64, ending: Ending, seconds: f64) -> Run {
    let reached = if ending == Ending::Solved { 0.7 * tolerance } else { 900.0 * tolerance };
    Run {
        campaign: "here".into(),
        problem: problem.into(),
        digest: String::new(),
        family: problem.split('/').next().unwrap_or_default().into(),
        kind: "friction_local_3d".into(),
        contacts: 50,
        solver: solver.into(),
        tolerance,
        ending,
        message: None,
        iterations: Some(10),
        factorisations: None,
        seconds: Some(seconds),
        seconds_median: None,
        seconds_max: None,
        repeats: 1,
        cpu_seconds: None,
        peak_memory: None,
        loaded_memory: None,
        residuals: Residuals { reached: Some(reached), ..Residuals::default() },
        trace: vec![],
    }
}

fn runs(campaigns: Vec<Campaign>, runs: Vec<Run>) -> Runs {
    Runs { campaigns, runs, ..Runs::default() }
}

/// A campaign like a real one: problems of four families and all sizes, solvers that are good at different things,
/// failures of every kind. The same for the same arguments.
fn synthetic(problems: usize, solvers: usize, tolerances: &[f64], traced: bool) -> Runs {
    let mut random = Pcg64::seed_from_u64(7);
    let mut uniform = || random.random::<f64>();
    let mut all = runs(vec![campaign("here", false), campaign("there", true)], vec![]);
    for p in 0..problems {
        let family = ["spheres", "wall", "arch", "impact"][p % 4];
        let name = format!("{family}/{family}-{p:05}");
        let contacts = 10f64.powf(3.6 * uniform()).ceil() as usize;
        let hard = 1.0 + 3.0 * uniform();
        all.problems.insert(
            name.clone(),
            Problem {
                name: name.clone(),
                family: family.into(),
                kind: "friction_local_3d".into(),
                contacts,
                unknowns: 3 * contacts,
                mu_min: Some(0.3),
                mu_max: Some(0.3 + 0.01 * (p % 40) as f64),
                ..Problem::default()
            },
        );
        for s in 0..solvers {
            let foreign = s + 1 == solvers;
            for &tolerance in tolerances {
                let digits = -tolerance.log10();
                let newton = s % 3 == 1;
                let iterations = match newton {
                    true => 5.0 + digits * hard,
                    false => 10f64.powf(0.3 * digits * hard * (0.6 + 0.8 * uniform())),
                };
                let cost = contacts as f64 * if newton { 2e-5 } else { 3e-7 };
                let seconds = iterations * cost * (1.0 + 0.3 * s as f64 / solvers as f64);
                let ending = match uniform() {
                    _ if seconds > 20.0 => Ending::TimeLimit,
                    u if u < 0.04 => Ending::Stalled,
                    u if u < 0.05 => Ending::Crashed,
                    u if u < 0.06 => Ending::OutOfMemory,
                    _ => Ending::Solved,
                };
                // Clocks count nanoseconds.
                let seconds = (1e9 * seconds.min(20.0)).round() / 1e9;
                let mut one = run(&name, &format!("solver-{s:02}"), tolerance, ending, seconds);
                one.contacts = contacts;
                one.iterations = Some(iterations as u64);
                one.factorisations = newton.then_some(iterations as u64 + 1);
                one.peak_memory = Some((1 << 22) + 1000 * contacts as u64);
                if foreign {
                    one.campaign = "there".into();
                    one.solver += " (another)";
                }
                if ending != Ending::Solved {
                    one.message = Some(format!("ended after {seconds:.1} s"));
                }
                if traced && !foreign {
                    one.trace = (0..30)
                        .map(|k| {
                            let part = k as f64 / 29.0;
                            let jump = 1.0 + 2.0 * uniform();
                            let residual = jump * (0.7 * tolerance).powf(part);
                            ((part * iterations) as u64, part * seconds, residual)
                        })
                        .collect();
                }
                all.runs.push(one);
            }
        }
    }
    all
}

fn page(runs: &Runs) -> String {
    html(runs, &Options::default())
}

/// The data of a page, by the rules for elements of HTML that hold no markup: until the first `</script`.
fn embedded(page: &str) -> Value {
    let (_, rest) = page.split_once("id=\"data\">").expect("the element of the data");
    let (text, _) = rest.split_once("</script").expect("its end");
    assert!(!text.contains('<'));
    serde_json::from_str(text).expect("JSON")
}

// ------------------------------------------------------------------------------------------------ without a browser

#[test]
fn the_page_holds_every_run() {
    let all = synthetic(40, 5, &[1e-4, 1e-8], true);
    let data = embedded(&page(&all));
    let text = |table: &str, k: &Value| {
        let at = &data[table][k.as_u64().unwrap() as usize];
        at.as_str().or(at["label"].as_str()).unwrap().to_owned()
    };
    let columns = &data["runs"];
    assert_eq!(columns["problem"].as_array().unwrap().len(), 400);
    for (k, run) in all.runs.iter().enumerate() {
        let p = columns["problem"][k].as_u64().unwrap() as usize;
        let problems = &data["problems"];
        assert_eq!(problems["name"][p], run.problem);
        assert_eq!(text("families", &problems["family"][p]), run.family);
        assert_eq!(problems["contacts"][p], run.contacts);
        assert_eq!(text("solvers", &columns["solver"][k]), run.solver);
        let tolerance = columns["tolerance"][k].as_u64().unwrap() as usize;
        assert_eq!(data["tolerances"][tolerance], run.tolerance);
        assert_eq!(text("endings", &columns["ending"][k]), run.ending.name());
        assert_eq!(columns["seconds"][k].as_f64(), run.seconds);
        assert_eq!(columns["reached"][k].as_f64(), run.residuals.reached);
        assert_eq!(columns["iterations"][k].as_u64(), run.iterations);
        assert_eq!(columns["factorisations"][k].as_u64(), run.factorisations);
        match &run.message {
            Some(message) => assert_eq!(&text("messages", &columns["message"][k]), message),
            None => assert!(columns["message"][k].is_null()),
        }
        let trace = &data["traces"][k.to_string()];
        assert_eq!(trace.is_null(), run.trace.is_empty());
        if !run.trace.is_empty() {
            let residuals = trace[1].as_array().unwrap();
            assert!((2..=42).contains(&residuals.len()));
            let last = run.trace.last().unwrap().2;
            let kept = residuals.last().unwrap().as_f64().unwrap();
            assert!((last..=1.001 * last).contains(&kept), "{kept} for {last}");
        }
    }
}

#[test]
fn the_stamp_names_machines_versions_and_limits() {
    let text = page(&synthetic(3, 3, &[1e-8], false));
    for said in [
        "3 problems, 3 solvers, 9 runs at the tolerance 1e-8.",
        "Measured: nonsmooth 0.1.0 on processor of here (2 cores, 8.0 GiB, Debian), started 2026-09-21.",
        "At most 20 s and 4.0 GiB a run, 1 run at a time.",
        "A time is the least of at most 5 solves after one to warm up",
        "† Foreign measurements: Another 4.5 on processor of there",
        "<td>solver-01</td><td class=\"n\">",
    ] {
        assert!(text.contains(said), "{said}");
    }
    // Nothing of the page points outside.
    let namespace = "http://www.w3.org/2000/svg";
    assert!(!text.replace(namespace, "").contains("://"));
}

#[test]
fn a_campaign_without_a_limit_of_memory_names_none() {
    let mut free = campaign("here", false);
    free.plan.as_mut().unwrap().memory_limit = 0;
    let text = page(&runs(vec![free], vec![run("a", "b", 1e-8, Ending::Solved, 1.0)]));
    assert!(text.contains("At most 20 s a run, 1 run at a time."));
}

const NASTY: &str = "</script><script>window.bad = 1</script><img src=x onerror='window.bad = 1'>\u{1}&amp;\"{{data}}";

fn nasty() -> Runs {
    let mut one = run(NASTY, NASTY, 1e-8, Ending::Stalled, 1.0);
    one.family = NASTY.into();
    one.kind = NASTY.into();
    one.message = Some(NASTY.into());
    let mut other = run("plain", "<!--<script>", 1e-8, Ending::Solved, 1.0);
    other.trace = vec![(1, 0.5, 1e-3), (2, 1.0, 1e-9)];
    let mut measured = campaign("here", false);
    measured.machine.cpu = NASTY.into();
    measured.program = NASTY.into();
    let mut all = runs(vec![measured], vec![one, other]);
    let error = Some(NASTY.into());
    all.problems.insert("no".into(), Problem { name: "no".into(), error, ..Problem::default() });
    all
}

#[test]
fn texts_do_not_become_markup() {
    let all = nasty();
    let text = html(&all, &Options { title: NASTY.into() });
    assert_eq!(text.matches("</script").count(), 2);
    assert!(!text.contains("<img"));
    assert_eq!(embedded(&text)["solvers"][0]["label"], NASTY);
    assert_eq!(embedded(&text)["unreadable"][0][1], NASTY);
}

// ------------------------------------------------------------------------------------------------ in a browser

#[test]
fn texts_stay_texts_in_the_browser() {
    let Some(mut browser) = Browser::start() else { return };
    browser.open(&html(&nasty(), &Options { title: NASTY.into() }));
    for name in FIGURES {
        let valid = format!(
            "!new DOMParser().parseFromString(report.svg('{name}'), 'image/svg+xml').querySelector('parsererror')"
        );
        assert_eq!(browser.value(&valid), true, "{name}");
    }
    browser.value("document.querySelector('#runs .link').click()");
    assert_eq!(browser.value("document.querySelector('#problem').open"), true);
    let clean = NASTY.replace('\u{1}', "\u{fffd}");
    assert_eq!(browser.value("document.querySelector('#problem h2').textContent"), clean);
    assert_eq!(browser.value("window.bad === undefined"), true);
    assert_eq!(browser.value("document.images.length"), 0);
    assert_eq!(browser.complaints(), [""; 0]);
}

const FIGURES: [&str; 6] = [
    "profile-time",
    "profile-iterations",
    "profile-factorisations",
    "data-profile",
    "median-residual",
    "success",
];

/// Three solvers on four problems, with a failure, a tie, a missing run, and a problem that none solves.
///
/// | seconds | a/1 | a/2 | b/3 | b/4 |
/// | ------- | --- | --- | --- | --- |
/// | x       | 1   | 4   | ∞   | ∞   |
/// | y       | 2   | 4   | 3   | ∞   |
/// | z       | 4   | –   | 1   | ∞   |
fn by_hand() -> Runs {
    use Ending::{IterationLimit, Solved, TimeLimit};
    let cases = [
        ("a/1", "x", Solved, 1.0),
        ("a/2", "x", Solved, 4.0),
        ("b/3", "x", TimeLimit, 20.0),
        ("b/4", "x", TimeLimit, 20.0),
        ("a/1", "y", Solved, 2.0),
        ("a/2", "y", Solved, 4.0),
        ("b/3", "y", Solved, 3.0),
        ("b/4", "y", IterationLimit, 5.0),
        ("a/1", "z", Solved, 4.0),
        ("b/3", "z", Solved, 1.0),
        ("b/4", "z", IterationLimit, 6.0),
    ];
    let mut all: Vec<Run> = cases.iter().map(|&(p, s, e, t)| run(p, s, 1e-8, e, t)).collect();
    all[0].iterations = Some(0);
    all[0].trace = vec![(1, 0.25, 1e-3), (2, 0.5, 1e-2), (3, 0.75, 1e-6), (4, 1.0, 1e-8)];
    runs(vec![campaign("here", false)], all)
}

/// Shows a view and gives the curves of a figure's first panel.
fn shown(browser: &mut Browser, asked: &Value, figure: &str) -> Value {
    browser.value(&format!("report.select({asked}), report.curves('{figure}')[0]"))
}

fn curve<'a>(curves: &'a Value, solver: &str) -> &'a Value {
    let curves = curves.as_array().expect("curves");
    curves.iter().find(|c| c["solver"] == solver).expect("the solver's curve")
}

/// A column of a table of the page, without its head.
fn column(browser: &mut Browser, table: &str, k: usize) -> Value {
    browser.value(&format!(
        "[...document.querySelectorAll('#{table} tbody tr')].map(r => r.cells[{k}].textContent)"
    ))
}

/// The page has points on a grid of a thousand a decade, rounded up.
fn assert_near(found: &Value, expected: &[f64], what: &str) {
    let found: Vec<f64> =
        found.as_array().expect(what).iter().map(|v| v.as_f64().unwrap()).collect();
    let near = |(a, b): (&f64, &f64)| (a / b > 1.0 - 1e-9) && (a / b < 1.0024);
    assert!(
        found.len() == expected.len() && found.iter().zip(expected).all(near),
        "{what}: expected {expected:?}, found {found:?}"
    );
}

#[test]
fn the_numbers_are_those_computed_by_hand() {
    let Some(mut browser) = Browser::start() else { return };
    browser.open(&page(&by_hand()));

    let whole = json!({"tolerance": 1e-8});
    let time = shown(&mut browser, &whole, "profile-time");
    for (solver, tau, rho) in [
        ("x", &[1.0][..], json!([0.5])),
        ("y", &[1.0, 2.0, 3.0], json!([0.25, 0.5, 0.75])),
        ("z", &[1.0, 4.0], json!([0.25, 0.5])),
        ("virtual best", &[1.0], json!([0.75])),
    ] {
        let found = curve(&time, solver);
        assert_near(&found["x"], tau, solver);
        assert_eq!(found["y"], rho, "{solver}");
    }

    // Hiding the fastest on b/3 hides its curve and changes no other; on family b alone y has 3 on one of two.
    let family = json!({"solvers": ["x", "y"], "family": "b"});
    let two = shown(&mut browser, &family, "profile-time");
    assert_eq!(two.as_array().map(Vec::len), Some(3));
    assert_eq!(curve(&two, "x")["x"], json!([]));
    assert_near(&curve(&two, "y")["x"], &[3.0], "y on b");
    assert_eq!(curve(&two, "y")["y"], json!([0.5]));

    // No iterations count as one; factorisations are not known.
    let iterations = shown(&mut browser, &whole, "profile-iterations");
    assert_near(&curve(&iterations, "y")["x"], &[1.0, 10.0], "iterations");
    assert_eq!(curve(&iterations, "y")["y"], json!([0.5, 0.75]));
    assert_eq!(shown(&mut browser, &whole, "profile-factorisations"), json!([]));
    let note = "document.querySelector('#figure-profile-factorisations figcaption').textContent";
    let note = browser.value(note);
    assert!(note.as_str().unwrap().ends_with("are not known: x, y, z."), "{note}");

    // Where there is a trace it says when a residual was reached; failures count by what they reached, 9e-6 here.
    let loose = json!({"tolerance": 1e-8, "epsilon": 1e-3});
    let data = shown(&mut browser, &loose, "data-profile");
    assert_near(&curve(&data, "x")["x"], &[0.25, 4.0, 20.0], "x to 1e-3");
    assert_eq!(curve(&data, "x")["y"], json!([0.25, 0.5, 1]));
    assert_near(&curve(&data, "virtual best")["x"], &[0.25, 1.0, 4.0, 5.0], "any to 1e-3");
    let tight = shown(&mut browser, &whole, "data-profile");
    assert_near(&curve(&tight, "x")["x"], &[1.0, 4.0], "x to 1e-8");

    // All problems have 50 contacts; 0.7e-8 where solved.
    let success = browser.value("report.curves('success')");
    assert_eq!(success.as_array().map(Vec::len), Some(1));
    let shares = [1.0, 1.0, 1.0, 0.75, 0.75, 0.75, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    assert_eq!(curve(&success[0], "y")["y"], json!(shares.map(|v: f64| json_number(v))));

    // The lower median over four is infinite until two have an answer.
    let median = shown(&mut browser, &whole, "median-residual");
    assert_near(&curve(&median, "y")["x"], &[3.0], "median");

    let summary = browser.value("report.summary().map(r => [r[0], r[2], r[3], r[4], r.at(-1)])");
    assert_eq!(
        summary,
        json!([
            ["solver", "solved", "fastest", "median_ratio", "missing"],
            ["x", 2, 2, 1, 0],
            ["y", 3, 1, 2, 0],
            ["z", 2, 1, 2.5, 1],
            ["virtual best", 3, 3, 1, ""]
        ])
    );
    assert_eq!(column(&mut browser, "unsolved", 0), json!(["b/4"]));
    assert_eq!(browser.complaints(), [""; 0]);
}

/// The same name in two kinds, refusals, and a problem that is proved to have no solution.
#[test]
fn kinds_stay_apart_refusals_cost_nothing_and_proofs_count() {
    let Some(mut browser) = Browser::start() else { return };
    use Ending::{Infeasible, NearlyInfeasible, Refused, Solved, Stalled};
    let lcp = |problem, solver, ending| Run {
        kind: "lcp".into(),
        ..run(problem, solver, 1e-8, ending, 2.0)
    };
    let all = vec![
        run("f/1", "psor", 1e-8, Solved, 1.0),
        run("f/1", "nsgs", 1e-8, Solved, 2.0),
        run("f/1", "lemke", 1e-8, Refused, 0.0),
        run("f/2", "psor", 1e-8, Solved, 1.0),
        run("f/2", "nsgs", 1e-8, Stalled, 2.0),
        run("f/2", "lemke", 1e-8, Refused, 0.0),
        run("f/3", "psor", 1e-8, Refused, 0.0),
        run("f/3", "nsgs", 1e-8, Solved, 2.0),
        lcp("l/1", "psor", Stalled),
        lcp("l/1", "lemke", Infeasible),
        lcp("l/2", "psor", NearlyInfeasible),
        lcp("l/2", "lemke", Solved),
    ];
    browser.open(&page(&runs(vec![campaign("here", false)], all)));
    let rows = "report.summary().map(r => [r[0], r[1], r[2]])";
    let friction = shown(&mut browser, &json!({"kind": "friction_local_3d"}), "profile-time");
    assert_eq!(
        browser.value(rows),
        json!([
            ["solver", "problems", "solved"],
            ["psor", 3, 2],
            ["nsgs", 3, 2],
            ["virtual best", 3, 3]
        ])
    );
    // psor solves both that it does not refuse.
    assert_eq!(curve(&friction, "psor")["y"], json!([1]));
    assert_near(&curve(&friction, "nsgs")["x"], &[1.0, 2.0], "nsgs");
    let shown_shares = column(&mut browser, "summary", 2);
    assert_eq!(shown_shares, json!(["100 %", "66.7 %", "100 %"]));
    let ended =
        "[...document.querySelectorAll('#summary thead th')].slice(6).map(c => c.textContent)";
    assert_eq!(browser.value(ended), json!(["stalled", "refused"]));
    assert_eq!(column(&mut browser, "summary", 7), json!(["1", "", ""]));
    let refusing = "document.querySelector('#filter-solvers details').textContent";
    assert_eq!(browser.value(refusing), "1 takes no problem of this kindlemke");

    let linear = shown(&mut browser, &json!({"kind": "lcp"}), "profile-time");
    assert_eq!(curve(&linear, "lemke")["y"], json!([1]));
    assert_eq!(
        browser.value(rows),
        json!([
            ["solver", "problems", "solved"],
            ["psor", 2, 0],
            ["lemke", 2, 2],
            ["virtual best", 2, 2]
        ])
    );
    assert_eq!(column(&mut browser, "unsolved", 0), json!([]));
    // Sizes are called what they are of this kind.
    let words = "[document.querySelector('#runs thead').textContent, report.svg('success'), \
                 document.querySelector('#filter-group').textContent].map(t => [/contacts/i.test(t), /pairs/.test(t)])";
    assert_eq!(browser.value(words), json!([[false, true], [false, true], [false, false]]));
    // A proof is an answer at any tolerance, from its end on.
    let data = shown(&mut browser, &json!({"kind": "lcp", "epsilon": 1e-14}), "data-profile");
    assert_near(&curve(&data, "lemke")["x"], &[2.0], "a proof");
    assert_eq!(browser.complaints(), [""; 0]);
}

#[test]
fn the_page_begins_with_the_figure() {
    let text = page(&by_hand());
    let place = |part: &str| text.find(part).unwrap_or_else(|| panic!("{part}"));
    let parts = [
        "<h1>",
        "id=\"first\"",
        "id=\"summary-place\"",
        "id=\"figures\"",
        "id=\"runs-place\"",
        "<h2>Measured",
    ];
    assert!(parts.map(place).is_sorted(), "{:?}", parts.map(place));
}

/// A number as JavaScript writes it.
fn json_number(v: f64) -> Value {
    if v.fract() == 0.0 { json!(v as i64) } else { json!(v) }
}

#[test]
fn filters_tables_and_the_address_work_together() {
    let Some(mut browser) = Browser::start() else { return };
    let all = synthetic(60, 7, &[1e-4, 1e-8], true);
    browser.open(&page(&all));
    let drawn = |b: &mut Browser| {
        b.value("[...document.querySelectorAll('#figure-profile-time path.curve')].map(c => c.dataset.solver + c.getAttribute('d'))")
    };
    let rows = |b: &mut Browser, k: usize| column(b, "runs", k);
    let choose = |b: &mut Browser, id: &str, text: &str| {
        b.value(&format!(
            "(s => {{ s.value = [...s.options].find(o => o.textContent.startsWith('{text}')).value;
            s.dispatchEvent(new Event('change')); }})(document.querySelector('#filter-{id}'))"
        ))
    };
    let before = drawn(&mut browser);
    assert_eq!(before.as_array().map(Vec::len), Some(8));

    // A family, then a solver alone, beside the best of all.
    choose(&mut browser, "group", "spheres");
    assert_ne!(before, drawn(&mut browser));
    let fewer = browser.value("report.curves('profile-time')[0]");
    assert_eq!(browser.value("[...document.querySelectorAll('#heat-place thead th')].length"), 2);
    browser.value("document.querySelectorAll('#filter-solvers .only')[1].click()");
    let alone = drawn(&mut browser);
    assert_eq!(alone.as_array().map(Vec::len), Some(2));
    let still = browser.value("report.curves('profile-time')[0]");
    for solver in ["solver-01", VIRTUAL_BEST] {
        assert_eq!(curve(&still, solver), curve(&fewer, solver));
    }
    assert_eq!(browser.value("document.querySelectorAll('#summary tbody tr').length"), 2);
    let hash = browser.value("location.hash");
    assert_eq!(hash, "#family=spheres&only=solver-01");

    // The address brings the state back.
    let file = browser.folder.path().join("report.html");
    let address = format!("{}{}", crate::browser::address(&file), hash.as_str().unwrap());
    browser.open_at(&address);
    assert_eq!(drawn(&mut browser), alone);
    browser.value("[...document.querySelectorAll('#filters button')].find(b => b.textContent === 'Reset').click()");
    assert_eq!(drawn(&mut browser), before);
    assert_eq!(browser.value("location.hash"), "");

    // Another tolerance.
    choose(&mut browser, "tolerance", "1e-4");
    assert_ne!(drawn(&mut browser), before);
    assert_eq!(rows(&mut browser, 3)[0], "1e-4");

    // Sorting by seconds, both ways; what is empty stays last.
    for (click, up) in [(1, true), (2, false)] {
        browser.value("[...document.querySelectorAll('#runs thead button')].find(b => b.textContent.startsWith('seconds')).click()");
        let shown = rows(&mut browser, 7);
        let times: Vec<f64> = shown
            .as_array()
            .unwrap()
            .iter()
            .map(|t| t.as_str().unwrap().parse().unwrap())
            .collect();
        assert_eq!(times.len(), 50);
        assert!(times.is_sorted_by(|a, b| if up { a <= b } else { a >= b }), "click {click}");
    }
    // Words.
    browser.value("(i => { i.value = 'solver-03 stalled'; i.dispatchEvent(new Event('input')); })(document.querySelector('#runs-text'))");
    browser.until("[...document.querySelectorAll('#runs tbody tr')].every(r => r.cells[4].textContent === 'stalled')");
    let stalled =
        |r: &&Run| r.solver == "solver-03" && r.tolerance == 1e-4 && r.ending == Ending::Stalled;
    let expected = all.runs.iter().filter(stalled).count();
    assert_eq!(rows(&mut browser, 2).as_array().map(Vec::len), Some(expected));

    // The pointer and the keys read the curves.
    let value = "(() => { const d = document.querySelector('#figure-profile-time .drawing'); const b = d.getBoundingClientRect();
        d.dispatchEvent(new PointerEvent('pointermove', { clientX: b.left + b.width / 2, clientY: b.top + b.height / 2 }));
        return document.querySelectorAll('#figure-profile-time .tip div').length; })()";
    assert_eq!(browser.value(value), 9);
    let key = "(() => { const f = document.querySelector('#figure-success'); const d = f.querySelector('.drawing'); d.focus();
        d.dispatchEvent(new KeyboardEvent('keydown', { key: 'ArrowRight' })); return f.querySelector('.tip .at').textContent; })()";
    assert_eq!(browser.value(key), "all (60), ε = 1e-3");

    // On paper the filters are gone and the legends are there.
    browser.call("Emulation.setEmulatedMedia", json!({"media": "print"}));
    let shows = |b: &mut Browser, what: &str| {
        b.value(&format!("getComputedStyle(document.querySelector('{what}')).display !== 'none'"))
    };
    assert_eq!(shows(&mut browser, "aside"), false);
    assert_eq!(shows(&mut browser, ".exports"), false);
    assert_eq!(shows(&mut browser, "#figure-success .key"), true);
    assert_eq!(browser.complaints(), [""; 0]);
}

#[test]
fn figures_and_tables_are_saved_as_valid_files() {
    let Some(mut browser) = Browser::start() else { return };
    browser.open(&page(&synthetic(30, 6, &[1e-8], true)));
    for name in FIGURES {
        // Chromium drops downloads beyond ten a second.
        std::thread::sleep(Duration::from_millis(500));
        let buttons = format!("document.querySelectorAll('#figure-{name} .exports button')");
        browser.value(&format!("{buttons}.forEach(b => b.click())"));
        let svg = String::from_utf8(browser.saved(&format!("{name}.svg"))).expect("UTF-8");
        assert!(svg.starts_with("<?xml") && svg.contains("xmlns=\"http://www.w3.org/2000/svg\""));
        // Nothing of the page's style is needed, and the legend is in it.
        assert!(!svg.contains("var(") && svg.contains("#ffffff") && svg.contains(">solver-01<"));
        let png = browser.saved(&format!("{name}.png"));
        assert!(png.starts_with(b"\x89PNG\r\n\x1a\n"));
        let width = u32::from_be_bytes(png[16..20].try_into().unwrap());
        assert_eq!(width, if name == "success" { 2880 } else { 1920 });
        let csv = String::from_utf8(browser.saved(&format!("{name}.csv"))).expect("UTF-8");
        let mut lines = csv.lines();
        let columns = lines.next().unwrap().split(',').count();
        assert!(lines.clone().count() > 2, "{name}");
        assert!(lines.all(|l| l.split(',').count() == columns || l.contains('"')), "{name}");
    }
    let drawn = browser.value("report.csv('profile-time')");
    let rho = browser.value("report.curves('profile-time')[0][0].y.at(-1)");
    let last = drawn.as_str().unwrap().lines().rfind(|l| l.starts_with("solver-00,")).unwrap();
    assert_eq!(last.rsplit(',').next().unwrap().parse::<f64>().ok(), rho.as_f64());

    std::thread::sleep(Duration::from_millis(500));
    browser.value(
        "document.querySelectorAll('section > .head .exports button').forEach(b => b.click())",
    );
    for (name, lines) in [("summary", 1 + 7), ("families", 1 + 24), ("runs", 1 + 180)] {
        let csv = String::from_utf8(browser.saved(&format!("{name}.csv"))).expect("UTF-8");
        assert_eq!(csv.lines().count(), lines, "{name}");
    }
    assert_eq!(browser.complaints(), [""; 0]);
}

#[test]
fn poor_data_makes_no_errors() {
    let Some(mut browser) = Browser::start() else { return };
    let here = || vec![campaign("here", false)];
    let bare = |ending| {
        let mut one = run("p", "s", 1e-8, ending, 1.0);
        (one.seconds, one.iterations, one.residuals) = (None, None, Residuals::default());
        one
    };
    let mut foreign = run("p", "s", 1e-8, Ending::Solved, 1.0);
    foreign.campaign = "there".into();
    let mut waiting = runs(here(), vec![run("a/1", "s", 1e-8, Ending::Solved, 0.0)]);
    waiting.problems.insert("a/2".into(), Problem { name: "a/2".into(), ..Problem::default() });
    let mut moved = vec![run("a/1", "s", 1e-8, Ending::Solved, 0.0); 2];
    moved[1].family = "elsewhere".into();
    let cases = [
        ("two families of one problem", runs(here(), moved)),
        ("one run", runs(here(), vec![run("p", "s", 1e-8, Ending::Solved, 1.0)])),
        ("none solved", runs(here(), vec![run("p", "s", 1e-8, Ending::Hung, 20.0)])),
        ("nothing known", runs(here(), vec![bare(Ending::Crashed)])),
        ("solved, nothing known", runs(here(), vec![bare(Ending::Solved)])),
        ("foreign alone", runs(vec![campaign("there", true)], vec![foreign])),
        ("unfinished", waiting),
        ("strange tolerance", runs(here(), vec![run("p", "s", 0.0, Ending::Solved, 1.0)])),
        ("no runs", runs(here(), vec![])),
        ("nothing", Runs::default()),
    ];
    for (name, runs) in cases {
        browser.open(&page(&runs));
        let clicks = "document.querySelectorAll('#filters button, #runs thead button, #runs .link').forEach(b => b.click())";
        browser.value(clicks);
        let all = "document.querySelectorAll('#filters select').forEach(s => [...s.options].forEach(o => {
            s.value = o.value; s.dispatchEvent(new Event('change')); }))";
        browser.value(all);
        let none = "document.querySelectorAll('fieldset .exports button:last-child').forEach(b => b.click())";
        browser.value(none);
        assert_eq!(browser.complaints(), [""; 0], "{name}");
        let broken = "/NaN|undefined/.test(document.querySelector('#page').innerHTML)";
        assert_eq!(browser.value(broken), false, "{name}");
    }
}

#[test]
fn twenty_thousand_runs_open_in_two_seconds() {
    let Some(mut browser) = Browser::start() else { return };
    for traced in [false, true] {
        let all = synthetic(500, 20, &[1e-4, 1e-8], traced);
        assert_eq!(all.runs.len(), 20_000);
        let page = page(&all);
        let mut best = f64::INFINITY;
        let mut filter = f64::INFINITY;
        for _ in 0..3 {
            browser.open(&page);
            // Milliseconds from the navigation to the last line of the script.
            best = best.min(browser.value("report.ready").as_f64().expect("a time"));
            let one = "(() => { const t = performance.now(); const s = document.querySelector('#filter-group');
                s.value = s.value === '0' ? '1' : '0'; s.dispatchEvent(new Event('change')); return performance.now() - t; })()";
            filter = filter.min(browser.value(one).as_f64().expect("a time"));
        }
        println!(
            "20 000 runs, traced {traced}: {:.1} MB, open in {best:.0} ms, a filter takes {filter:.0} ms",
            page.len() as f64 / 1e6
        );
        assert!(best < 2000.0, "{best} ms");
        assert!(filter < 1000.0, "{filter} ms");
    }
    assert_eq!(browser.complaints(), [""; 0]);
}

#[test]
fn runs_files_lead_to_the_same_page() {
    let all = synthetic(5, 3, &[1e-8], true);
    let read = Runs::parse(Path::new("runs.jsonl"), &all.clone().text()).unwrap();
    assert!(page(&read) == page(&all));
}

/// The page's curves are the crate's, step by step.
fn assert_same(page: &Value, ours: &[Curve], what: &str) {
    for curve in ours {
        let curves = page.as_array().expect("curves");
        let Some(theirs) = curves.iter().find(|c| c["solver"] == curve.solver) else {
            // A solver whose costs are not known is not drawn, nor the best of one.
            let alone = curve.solver == VIRTUAL_BEST && curves.len() == 1;
            assert!(alone || curve.steps.is_empty(), "{what}: no curve of {}", curve.solver);
            continue;
        };
        // Steps that fall on one point of the grid are one there.
        let on_grid = |x: f64| (1000.0 * x.log10()).ceil() as i64;
        let mut steps: Vec<(f64, f64)> = vec![];
        for &(x, y) in &curve.steps {
            let x = x.max(1e-9);
            steps.pop_if(|last| on_grid(last.0) == on_grid(x));
            steps.push((x, y));
        }
        let what = format!("{what}: {}", curve.solver);
        let (x, y): (Vec<f64>, Vec<f64>) = steps.into_iter().unzip();
        assert_near(&theirs["x"], &x, &what);
        assert_near(&theirs["y"], &y, &what);
    }
}

#[test]
fn the_numbers_are_those_of_the_crate() {
    let Some(mut browser) = Browser::start() else { return };
    let all = synthetic(120, 7, &[1e-4, 1e-8], true);
    browser.open(&page(&all));
    const KIND: &str = "friction_local_3d";
    let views = [
        (Selection::at(KIND, 1e-8), json!({})),
        (
            Selection { families: vec!["wall".into()], ..Selection::at(KIND, 1e-4) },
            json!({"family": "wall"}),
        ),
        (
            Selection { sizes: vec![SIZES[1]], ..Selection::at(KIND, 1e-8) },
            json!({"size": SIZES[1].name}),
        ),
    ];
    for (k, (selection, mut asked)) in views.into_iter().enumerate() {
        asked["tolerance"] = json!(selection.tolerance);
        for (cost, name) in Cost::ALL.into_iter().zip(&FIGURES[..3]) {
            let costs = Costs::of(&all, &selection, cost);
            let mut ours = performance(&costs);
            ours.push(performance_of_best(&costs));
            let found = shown(&mut browser, &asked, name);
            assert_same(&found, &ours, &format!("view {k} by {}", cost.name()));
        }
        let progress = Progress::of(&all, &selection);
        let found = shown(&mut browser, &asked, "median-residual");
        assert_same(&found, &progress.quantile(0.5), &format!("view {k}, median"));
        for epsilon in [1e-3, 1e-6, 1e-8] {
            let mut ours = progress.data_profile(epsilon);
            ours.extend(progress.best().data_profile(epsilon));
            asked["epsilon"] = json!(epsilon);
            let found = shown(&mut browser, &asked, "data-profile");
            assert_same(&found, &ours, &format!("view {k}, data at {epsilon}"));
        }
        let found = browser.value("report.curves('success')");
        let mut ours = success(&all, &selection).0;
        ours.retain(|class| class.size.is_some() || k != 2);
        assert_eq!(found.as_array().map(Vec::len), Some(ours.len()));
        for (class, found) in ours.iter().zip(found.as_array().unwrap()) {
            for (solver, shares) in &class.shares {
                let theirs = curve(found, solver)["y"].as_array().unwrap();
                let close = |(a, b): (&f64, &Value)| (a - b.as_f64().unwrap()).abs() <= 1e-3;
                assert_eq!(theirs.len(), shares.len());
                assert!(shares.iter().zip(theirs).all(close), "view {k}, {solver}");
            }
        }
    }
}

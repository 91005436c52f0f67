//! What each command prints, writes and answers when all is well.

use crate::common::{Folder, has_keys};
use nonsmooth_io::{ProblemFile, StoredPoint};
use nonsmooth_linalg::Csc;
use nonsmooth_problem::planted::Planted;
use nonsmooth_problem::{AnyPoint, Friction, FrictionGlobal, RowsGlobal};
use nonsmooth_scenes::SceneEntry;

const JUDGED: &str = "file kind contacts unknowns status message tolerance residual/absolute residual/relative \
    residual/literature residual/siconos residual/primal residual/dual residual/complementarity failing contacts_by_status/open \
    contacts_by_status/stick contacts_by_status/slip degenerate worst_contacts";

#[test]
fn solve_reports_as_text_and_as_json() {
    let folder = Folder::with_problems();
    let text = folder.run("solve wall.hdf5").exits(0).stdout;
    assert!(text.starts_with("wall.hdf5: solved (relative residual "), "{text}");
    let account = "\n  account    ";
    for part in
        ["friction_global_3d", "auto", account, "literature", "siconos", "dynamics", "stick"]
    {
        assert!(text.contains(part), "{part} in {text}");
    }
    let text = folder.run("solve wall.hdf5 --solver nsgs").exits(0).stdout;
    assert!(text.contains("nsgs") && !text.contains(account), "{text}");
    let line = folder.run("solve wall.hdf5 --json").exits(0).json().remove(0);
    assert!(line["account"].as_array().unwrap().iter().all(|says| says.is_string()));
    assert!(!line["account"].as_array().unwrap().is_empty());
    let run = "solve wall.hdf5 box.hdf5 --solver nsgs --tol 1e-9 --set omega=0.9 --json";
    let run = folder.run(run).exits(0);
    let lines = run.json();
    assert_eq!(lines.len(), 2);
    for line in &lines {
        has_keys(line, JUDGED);
        has_keys(line, "solver settings/omega iterations seconds account");
        assert_eq!((&line["status"], &line["solver"]), (&"solved".into(), &"nsgs".into()));
        assert!(line["residual"]["relative"].as_f64().unwrap() <= 1e-9);
        let counts = &line["contacts_by_status"];
        let sum: u64 = ["open", "stick", "slip"].map(|s| counts[s].as_u64().unwrap()).iter().sum();
        assert_eq!(Some(sum), line["contacts"].as_u64());
    }
    assert!(lines[0]["residual"]["dynamics"].as_f64().unwrap() <= 1e-10);
    assert!(lines[1]["residual"].get("dynamics").is_none());
    assert_eq!(folder.run("solve wall.hdf5 --quiet --max-iter 1e6").exits(0).stdout, "");
}

#[test]
fn an_unsolved_problem_exits_with_1_and_says_what_to_try() {
    let folder = Folder::with_problems();
    let text = folder.run("solve wall.hdf5 box.hdf5 --tol 1e-13 --max-iter 2").exits(1).stdout;
    for part in ["iteration limit", "worst", "--max-iter 20", "`nonsmooth diagnose`"] {
        assert!(text.contains(part), "{part} in {text}");
    }
    // Who is named has solved it.
    let text = folder.run("solve wall.hdf5 --solver de_saxce --max-iter 2").exits(1).stdout;
    assert!(text.contains("--solver auto, which solved it on trial"), "{text}");
    folder.run("solve wall.hdf5 --solver auto").exits(0);
    // Rounding: more iterations would bring nothing.
    let stuck = "solve wall.hdf5 --solver de_saxce --tol 1e-17 --max-iter 2e4";
    let text = folder.run(stuck).exits(1).stdout;
    assert!(
        (text.contains("no progress since iteration ")
            || text.contains("the rounding of the unknowns"))
            && text.contains("`nonsmooth diagnose` says what makes the problem hard"),
        "{text}"
    );
    // No solver gets there.
    assert!(!text.contains("--max-iter") && !text.contains("--solver"), "{text}");
    let line = folder.run("solve wall.hdf5 --time-limit 0 --json").exits(1).json().remove(0);
    assert_eq!(line["status"], "time_limit");
    assert!(!line["worst_contacts"].as_array().unwrap().is_empty());
}

#[test]
fn what_fails_besides_the_relative_residual_is_named() {
    let folder = Folder::with_problems();
    folder.run("solve wall.hdf5 --out off.hdf5 --quiet").exits(0);
    let mut file = ProblemFile::read(folder.path("off.hdf5")).unwrap();
    let Some(AnyPoint::Global(point)) = file.solution.as_mut().map(|s| &mut s.point) else {
        panic!("a solution with velocities")
    };
    point.v.iter_mut().for_each(|v| *v += 1.0);
    file.write(folder.path("off.hdf5")).unwrap();
    let text = folder.run("check off.hdf5").exits(1).stdout;
    let (headline, rows) = text.split_once('\n').unwrap();
    assert!(headline.contains("; fails ") && headline.contains("dynamics "), "{text}");
    assert!(rows.contains("\n  fails      ") && rows.contains(" (limit 1e-10)"), "{text}");
    assert!(!rows.contains("worst"), "the contacts are as they should be: {text}");
    let line = folder.run("check off.hdf5 --json").exits(1).json().remove(0);
    has_keys(&line, "failing/0/what failing/0/value failing/0/limit");
    let line = folder.run("solve wall.hdf5 --json").exits(0).json().remove(0);
    assert_eq!(line["failing"].as_array().map(Vec::len), Some(0));
}

#[test]
fn contradictory_constraints_are_named_and_no_iterations_proposed() {
    let folder = Folder::new();
    let (mut problem, _) = Planted { bilateral: 1, ..Planted::default() }.global::<3>();
    let old = problem.rows.take().unwrap();
    let twice = old.G.triplets().flat_map(|(i, j, x)| [(i, j, x), (i, j + 1, x)]);
    problem.rows = Some(RowsGlobal::bilateral(
        Csc::from_triplets(problem.dofs(), 2, twice).unwrap(),
        vec![old.b[0], old.b[0] + 1.0],
    ));
    ProblemFile::new(Friction::Global3(problem)).write(folder.path("a.hdf5")).unwrap();
    let text = folder.run("solve a.hdf5 --max-iter 1e3").exits(1).stdout;
    assert!(text.contains("; fails bilateral constraints "), "{text}");
    assert!(!text.contains("--max-iter"), "{text}");
}

#[test]
fn a_singular_mass_matrix_is_described() {
    let folder = Folder::new();
    let (mut problem, point) = Planted::default().global::<3>();
    let (n, a) = (problem.dofs(), problem.M.triplets().filter(|t| t.0 != 0 && t.1 != 0));
    problem.M = Csc::from_triplets(n, n, a).unwrap();
    let mut file = ProblemFile::new(Friction::Global3(problem));
    for stored in [false, true] {
        file.solution = stored.then(|| StoredPoint {
            point: point.clone().into(),
            partner: Some(vec![0.0; point.r.len()]),
            statuses: vec![],
        });
        file.write(folder.path("a.hdf5")).unwrap();
        let text = folder.run("info a.hdf5").exits(0).stdout;
        assert!(text.contains("M is singular: M "), "{text}");
        let line = folder.run("info a.hdf5 --json").exits(0).json().remove(0);
        assert!(line["singular"].is_string() && line["solution"].is_null());
    }
    folder.run("solve a.hdf5").refused(&["a.hdf5", "M", "invertible"]);
}

#[test]
fn check_agrees_with_solve() {
    let folder = Folder::with_problems();
    for tol in ["1e-3", "1e-11"] {
        let solve = format!("solve wall.hdf5 box.hdf5 --out solved/ --json --tol {tol}");
        let solved = folder.run(&solve).exits(0).json();
        let check = format!("check solved/wall.hdf5 solved/box.hdf5 --json --tol {tol}");
        let checked = folder.run(&check).exits(0).json();
        for (a, b) in solved.iter().zip(&checked) {
            has_keys(b, JUDGED);
            for key in ["status", "residual", "contacts_by_status", "degenerate"] {
                assert_eq!(a[key], b[key], "{key}");
            }
        }
    }
    folder.run("solve wall.hdf5 --tol 1e-3 --out rough.hdf5").exits(0);
    let text = folder.run("check rough.hdf5 --worst 2").exits(1).stdout;
    assert!(text.contains("not solved") && text.contains("worst"), "{text}");
    let line = folder.run("check rough.hdf5 --json --worst 2").exits(1).json().remove(0);
    assert_eq!(line["worst_contacts"].as_array().unwrap().len(), 2);
    assert_eq!(line["status"], "not_solved");
}

#[test]
fn a_written_file_keeps_everything_else() {
    let folder = Folder::with_problems();
    let before = ProblemFile::read(folder.path("wall.hdf5")).unwrap();
    folder.run("solve wall.hdf5 --out copy.hdf5 --quiet").exits(0);
    let copy = ProblemFile::read(folder.path("copy.hdf5")).unwrap();
    assert_eq!((&copy.problem, &copy.info), (&before.problem, &before.info));
    assert!(copy.info.title.as_deref().unwrap().starts_with("wall rows=3"));

    // In place, and through another name of the same file.
    let mut with_guess = before.clone();
    with_guess.guesses = copy.solution.clone().into_iter().collect();
    with_guess.write(folder.path("wall.hdf5")).unwrap();
    folder.run("solve wall.hdf5 --out ./wall.hdf5 --quiet").exits(0);
    let after = ProblemFile::read(folder.path("wall.hdf5")).unwrap();
    assert_eq!(after, ProblemFile { solution: copy.solution, ..with_guess });

    // Again and again, without a larger file; what a killed writer left goes.
    let size = || std::fs::metadata(folder.path("wall.hdf5")).unwrap().len();
    let first = size();
    let left = folder.path(".wall.hdf5.1-0-0000000000000001.nonsmooth-tmp");
    let long_ago = std::time::SystemTime::now() - std::time::Duration::from_secs(100_000);
    std::fs::File::create(&left).unwrap().set_modified(long_ago).unwrap();
    for _ in 0..20 {
        folder.run("solve wall.hdf5 --out wall.hdf5 --quiet").exits(0);
        assert_eq!(size(), first);
    }

    // Nothing else is left in the folder.
    let mut names: Vec<_> = std::fs::read_dir(&folder)
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    assert_eq!(names, ["box.hdf5", "copy.hdf5", "wall.hdf5"]);
}

#[test]
fn two_solves_give_the_same_bytes() {
    let folder = Folder::with_problems();
    for solver in ["auto", "nsgs --set ordering=shuffled", "nsgs_colored --set threads=2"] {
        let bytes = ["a.hdf5", "b.hdf5"].map(|name| {
            let solve = format!("solve wall.hdf5 --solver {solver} --quiet --out {name}");
            folder.run(&solve).exits(0);
            std::fs::read(folder.path(name)).unwrap()
        });
        assert!(bytes[0] == bytes[1], "{solver}");
    }
}

#[test]
fn every_kind_is_solved_warm_started_and_checked() {
    let folder = Folder::new();
    let planted = Planted::default();
    let cases = [
        Friction::Local2(planted.local::<2>().0),
        Friction::Local3(planted.local::<3>().0),
        Friction::Global2(planted.global::<2>().0),
        Friction::Global3(planted.global::<3>().0),
    ];
    for problem in cases {
        let kind = problem.kind().name();
        ProblemFile::new(problem).write(folder.path("a.hdf5")).unwrap();
        let cold = folder.run("solve a.hdf5 --out b.hdf5 --json").exits(0).json().remove(0);
        assert_eq!(cold["kind"], kind);
        folder.run("check b.hdf5").exits(0);
        folder.run("info b.hdf5").exits(0);

        // The solution as a guess, with a velocity that must not be believed.
        let mut file = ProblemFile::read(folder.path("b.hdf5")).unwrap();
        let mut guess: StoredPoint = file.solution.take().unwrap();
        if let AnyPoint::Global(point) = &mut guess.point {
            point.v.fill(7.0);
        }
        file.guesses = vec![guess];
        file.write(folder.path("c.hdf5")).unwrap();
        let warm = folder.run("solve c.hdf5 --warm-start --json").exits(0).json().remove(0);
        assert_eq!(warm["iterations"], 0, "{kind}");
        assert!(cold["iterations"].as_u64() > Some(0));

        // The solution of another file, or of the file of the same name in a directory.
        std::fs::create_dir_all(folder.path("solved")).unwrap();
        std::fs::copy(folder.path("b.hdf5"), folder.path("solved/a.hdf5")).unwrap();
        for from in ["b.hdf5", "c.hdf5", "solved"] {
            let solve = format!("solve a.hdf5 --warm-start={from} --json");
            let warm = folder.run(&solve).exits(0).json().remove(0);
            assert_eq!(warm["iterations"], 0, "{kind} {from}");
            assert_eq!(warm["account"][0], "started from the point given", "{kind} {from}");
        }
    }
    // The impulses of a problem in one form start the other.
    let wall = "gen wall --set rows=3 --set columns=2 --out";
    folder.run(&format!("{wall} global.hdf5 --solve --tol 1e-11")).exits(0);
    folder.run(&format!("{wall} local.hdf5 --form local")).exits(0);
    let across = "solve local.hdf5 --warm-start=global.hdf5 --tol 1e-9 --json";
    assert_eq!(folder.run(across).exits(0).json()[0]["iterations"], 0);
}

#[test]
fn a_bad_start_costs_nothing() {
    let folder = Folder::with_problems();
    folder.run("solve wall.hdf5 --out bad.hdf5 --quiet").exits(0);
    let mut file = ProblemFile::read(folder.path("bad.hdf5")).unwrap();
    let Some(AnyPoint::Global(point)) = file.solution.as_mut().map(|s| &mut s.point) else {
        panic!("a solution with velocities")
    };
    point.r.fill(-1e4);
    file.write(folder.path("bad.hdf5")).unwrap();
    let cold = folder.run("solve wall.hdf5 --json").exits(0).json().remove(0);
    let warm = folder.run("solve wall.hdf5 --warm-start=bad.hdf5 --json").exits(0).json().remove(0);
    assert_eq!(warm["iterations"], cold["iterations"]);
    assert!(warm["account"][0].as_str().unwrap().contains("from zero"), "{warm}");
}

#[test]
fn auto_says_whether_a_solution_exists_where_it_finds_none() {
    let folder = Folder::new();
    // Two immovable walls drive a frictionless body together: normal impulses prove that there is no solution.
    let (mut problem, _) = Planted { contacts: 2, dofs: 6, ..Planted::default() }.global::<3>();
    let n = problem.dofs();
    let columns = [(0, 0, 1.0), (1, 1, 1.0), (2, 2, 1.0), (0, 3, -1.0), (1, 4, 1.0), (2, 5, 1.0)];
    problem.H = Csc::from_triplets(n, 6, columns.into_iter()).unwrap();
    problem.w = vec![-1.0, 0.0, 0.0, -1.0, 0.0, 0.0];
    ProblemFile::new(Friction::Global3(problem)).write(folder.path("a.hdf5")).unwrap();
    let text = folder.run("solve a.hdf5").exits(1).stdout;
    assert!(text.contains("infeasible: no admissible motion exists; proved in exact"), "{text}");
    assert!(text.contains("existence of a solution: "), "{text}");
    folder.run("exists a.hdf5").exits(1);
}

#[test]
fn info_describes() {
    let folder = Folder::with_problems();
    let text = folder.run("info wall.hdf5 box.hdf5").exits(0).stdout;
    for part in ["contact density c = ", "hyperstatic", "mu = 0.6", "if condensed", "stored"] {
        assert!(text.contains(part), "{part} in {text}");
    }
    let lines = folder.run("info wall.hdf5 box.hdf5 --json").exits(0).json();
    for line in &lines {
        has_keys(
            line,
            "file kind contacts unknowns form dimension dofs contact_density mu/min mu/max mu/frictionless \
             bilateral_rows asymmetry W/blocks W/blocks_per_row/mean W/connected_groups guesses title solution",
        );
    }
    has_keys(&lines[0], "entries/M entries/H components/0/size");
    has_keys(&lines[1], "solution/residual/relative solution/contacts_by_status/slip");
    assert_eq!((&lines[1]["dofs"], &lines[1]["contact_density"]), (&6.into(), &2.0.into()));
    assert_eq!(lines[1]["W"]["blocks"], 16);
    assert!(lines[1].get("spectrum").is_none());
}

#[test]
fn info_computes_the_spectrum_when_asked() {
    let folder = Folder::with_problems();
    // A box on its four corners: 12 rows that six velocities span.
    let text = folder.run("info box.hdf5 --spectrum").exits(0).stdout;
    assert!(text.contains("rank 6 of 12, rank ratio 2.000, condition number "), "{text}");
    let line = folder.run("info box.hdf5 --spectrum --json").exits(0).json().remove(0);
    has_keys(&line, "spectrum/condition spectrum/least spectrum/largest spectrum/skew solution");
    assert_eq!(
        (&line["spectrum"]["rank"], &line["spectrum"]["rank_ratio"]),
        (&6.into(), &2.0.into())
    );
    assert!(line["spectrum_refused"].is_null());

    let large = "info box.hdf5 --spectrum --spectrum-limit 11";
    let text = folder.run(large).exits(0).stdout;
    assert!(text.contains("none: W: expected at most 11 rows"), "{text}");
    let line = folder.run(&format!("{large} --json")).exits(0).json().remove(0);
    assert!(line["spectrum"].is_null() && line["spectrum_refused"].is_string());
    folder.run("info box.hdf5 --spectrum-limit 11").refused(&["--spectrum"]);
}

#[test]
fn list_has_every_solver() {
    let folder = Folder::new();
    let text = folder.run("list").exits(0).stdout;
    assert!(text.contains("auto (the default)") && text.contains("condense/nsgs"));
    let list = folder.run("list --json").exits(0).json().remove(0);
    has_keys(&list, "default reformulations/0/name composed/0");
    for solver in list["solvers"].as_array().unwrap() {
        has_keys(solver, "name class family summary kinds/0 needs cites settings");
        for setting in solver["settings"].as_array().unwrap() {
            has_keys(setting, "key default choices help");
        }
    }
    let page = folder.run("list --markdown").exits(0).stdout;
    assert!(page.starts_with("<!-- Generated by `nonsmooth list --markdown`"));
    assert_eq!(page, folder.run("list --markdown").stdout);
    assert!(folder.run("list nsgs").exits(0).stdout.starts_with("nsgs"));
}

#[test]
fn every_scene_is_generated_solved_and_drawn() {
    let folder = Folder::new();
    let text = folder.run("gen").exits(0).stdout;
    assert_eq!(text, folder.run("gen --list").exits(0).stdout);
    let (scenes, _) = text.split_once("\nComplementarity problems").unwrap();
    let scenes = scenes.lines().filter_map(|line| line.split_once(": "));
    let scenes: Vec<_> = scenes.filter(|(name, _)| !name.contains([' ', '='])).collect();
    assert!(scenes.len() >= 12);
    for (scene, _) in scenes {
        let one = folder.run(&format!("gen {scene} --list")).exits(0).stdout;
        assert!(one.contains(&format!("\n{scene}: ")) && one.len() < text.len());
        let plain = format!("gen {scene} --out a.hdf5 --draw a.svg");
        assert!(folder.run(&plain).exits(0).stdout.contains("friction_global_3d"));
        assert!(ProblemFile::read(folder.path("a.hdf5")).unwrap().solution.is_none());

        // The chute of seed 0 is one that `auto` does not solve in a minute (NSGS takes 16000 sweeps).
        let seed = if scene == "chute" { "--set seed=1" } else { "" };
        let solved = format!(
            "gen {scene} {seed} --form local --solve --tol 1e-4 --time-limit 60 --out b.hdf5 \
             --draw b.svg"
        );
        assert!(folder.run(&solved).exits(0).stdout.contains("friction_local_3d"));
        folder.run("check b.hdf5 --tol 1e-4").exits(0);
        let file = ProblemFile::read(folder.path("b.hdf5")).unwrap();
        let settings = SceneEntry::find(scene).unwrap().settings();
        let default = |key: &str| settings.iter().find(|s| s.key == key).unwrap().default.clone();
        let density = format!("density={}", default("density"));
        assert!(file.info.description.as_ref().unwrap().contains(&density));
        assert_eq!(file.info.dofs.unwrap() % 6, 0);
        let problem = file.contacts(&folder.path("b.hdf5")).unwrap();
        assert!(problem.mu().iter().all(|&mu| default("mu") == mu));
        let [plain, impulses] =
            ["a.svg", "b.svg"].map(|name| std::fs::read_to_string(folder.path(name)).unwrap());
        assert!(plain.starts_with("<svg") && impulses.contains("impulses: "));
        assert!(plain.contains(">contact</text>"));
    }
    folder.run("gen wall --solve --time-limit 0 --out c.hdf5").exits(1);
    folder.run("gen wall --solve --tol 1e-3 --out d.hdf5").exits(0);
    for file in ["c.hdf5", "d.hdf5"] {
        assert!(ProblemFile::read(folder.path(file)).unwrap().solution.is_some());
    }
}

#[test]
fn suites_expand_to_files_by_family() {
    let folder = Folder::new();
    let suite = "[[problem]]\nfamily = \"stack\"\nform = [\"local\", \"global\"]\n\
                 settings = { count = [2, 3], seed = 1 }\n\
                 [[problem]]\nfamily = \"chain\"\nname = \"one\"\nsettings = { points = 1 }\n";
    std::fs::write(folder.path("suite.toml"), suite).unwrap();
    let text = folder.run("gen --suite suite.toml --out all").exits(0).stdout;
    assert_eq!(text.lines().count(), 5);
    for (name, contacts) in [
        ("stack/stack-count2-seed1-local", 8),
        ("stack/stack-count2-seed1-global", 8),
        ("stack/stack-count3-seed1-local", 12),
        ("stack/stack-count3-seed1-global", 12),
        ("chain/one", 10),
    ] {
        let file = ProblemFile::read(folder.path(&format!("all/{name}.hdf5"))).unwrap();
        let problem = file.contacts(&folder.path(name)).unwrap();
        assert_eq!(problem.contacts(), contacts, "{name}");
        let local = problem.kind().name().contains("local");
        assert_eq!(local, name.ends_with("local"), "{name}");
    }
}

#[test]
fn plots_and_several_outputs_go_where_they_are_sent() {
    let folder = Folder::with_problems();
    folder.run("solve wall.hdf5 --plot one.svg --quiet").exits(0);
    folder.run("solve wall.hdf5 box.hdf5 --plot new/plots/ --out new/out/ --quiet").exits(0);
    for name in ["one.svg", "new/plots/wall.svg", "new/plots/box.svg"] {
        let svg = std::fs::read_to_string(folder.path(name)).unwrap();
        assert!(svg.starts_with("<svg") && svg.contains("relative residual"), "{name}");
    }
    folder.run("check new/out/wall.hdf5 new/out/box.hdf5").exits(0);
}

#[test]
fn help_shows_examples() {
    let folder = Folder::new();
    for command in ["", "solve", "check", "info", "list", "gen"] {
        let help = folder.run(&format!("{command} --help")).exits(0).stdout;
        assert!(help.contains("Examples:"), "{command}");
    }
    assert!(folder.run("--version").exits(0).stdout.starts_with("nonsmooth "));
}

/// A mass pressed between two walls that approach each other, in the plane.
fn squeezed(mu: f64) -> Friction {
    let h = [(0, 0, 1.0), (1, 1, 1.0), (0, 2, -1.0), (1, 3, -1.0)];
    let h = Csc::from_triplets(2, 4, h.into_iter()).unwrap();
    let (m, w) = (Csc::diagonal(&[1.0, 1.0]), vec![-1.0, 0.0, -1.0, 0.0]);
    Friction::Global2(FrictionGlobal::new(m, h, vec![0.0; 2], w, vec![mu; 2]).unwrap())
}

#[test]
fn exists_proves_refutes_and_writes_its_certificate() {
    let folder = Folder::with_problems();
    let text = folder.run("exists wall.hdf5").exits(0).stdout;
    assert!(text.starts_with("wall.hdf5: existence of a solution proved: a motion "), "{text}");
    // W of the local problem is singular and rounded: what is true of it nearly is no proof.
    let run = folder.run("exists wall.hdf5 box.hdf5 --json --certificate out/").exits(1);
    let lines = run.json();
    for (line, verdict) in lines.iter().zip(["proved", "nearly_proved"]) {
        has_keys(line, "file kind contacts unknowns verdict margin message seconds");
        assert_eq!(line["verdict"], verdict);
    }
    assert!(lines[1]["shift"].as_f64().is_some_and(|shift| shift > 0.0 && shift < 1e-8));
    let kept = std::fs::read_to_string(folder.path("out/wall.certificate.json")).unwrap();
    let kept: serde_json::Value = serde_json::from_str(&kept).unwrap();
    assert!(kept["motion"].as_array().is_some_and(|v| v.len() > 6), "{kept}");

    for mu in [0.0, 0.8] {
        ProblemFile::new(squeezed(mu)).write(folder.path("squeezed.hdf5")).unwrap();
        let text = folder.run("exists squeezed.hdf5").exits(1).stdout;
        assert!(text.contains("solution none, proved: ") && text.contains("2 contacts"), "{text}");
        let line = folder.run("exists squeezed.hdf5 --json").exits(1).json().remove(0);
        assert_eq!(
            (&line["verdict"], &line["pressed_contacts"]),
            (&"no_solution".into(), &vec![0, 1].into())
        );
    }
    folder.run("exists nothing.hdf5").refused(&["nothing.hdf5"]);
    folder.run("exists wall.hdf5 --time-limit -1").refused(&["--time-limit"]);
}

#[test]
fn info_says_whether_a_solution_exists() {
    let folder = Folder::with_problems();
    let text = folder.run("info wall.hdf5").exits(0).stdout;
    assert!(text.contains("  existence  proved: "), "{text}");
    ProblemFile::new(squeezed(0.3)).write(folder.path("squeezed.hdf5")).unwrap();
    let short = folder.run("info squeezed.hdf5 --json").exits(0).json().remove(0);
    assert_eq!(short["existence"]["verdict"], "unknown");
    let long = folder.run("info squeezed.hdf5 --existence --json").exits(0).json().remove(0);
    assert_eq!(long["existence"]["verdict"], "no_solution");
}

#[test]
fn diagnose_explains_and_names_solvers_that_exist() {
    let folder = Folder::with_problems();
    let text = folder.run("diagnose box.hdf5").exits(0).stdout;
    for part in [
        "hard by its ",
        "W has rank 6 of 12",
        "  existence  nearly proved",
        "  try        --solver ",
    ] {
        assert!(text.contains(part), "{part} in {text}");
    }
    let list = folder.run("list --json").exits(0).json().remove(0);
    let known: Vec<_> = list["solvers"].as_array().unwrap().iter().map(|s| &s["name"]).collect();
    for line in folder.run("diagnose wall.hdf5 box.hdf5 --json").exits(0).json() {
        has_keys(&line, "file contacts findings/0/about findings/0/says findings/0/hard suits/0");
        for name in line["suits"].as_array().unwrap() {
            assert!(known.contains(&name), "{name}");
        }
    }
    ProblemFile::new(squeezed(1.5)).write(folder.path("squeezed.hdf5")).unwrap();
    let text = folder.run("diagnose squeezed.hdf5").exits(0).stdout;
    assert!(text.contains("No solver can succeed") && !text.contains("--solver"), "{text}");
}

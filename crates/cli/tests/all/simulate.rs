//! `simulate` and `play`: what a run says, what it leaves, and how it goes on.

use crate::common::Folder;
use serde_json::Value;

/// A box that is dropped on its edge and comes to rest.
const BOX: &str = r#"
format = "nonsmooth-scene"
version = 1
name = "a box"
time = { h = 1e-3, end = 0.2 }
pairs_default = { mu = 0.4, e = 0.1 }

[[bodies]]
name = "floor"
shape = { kind = "plane" }
fixed = true

[[bodies]]
name = "box"
shape = { kind = "box", half = [0.1, 0.1, 0.1] }
density = 1000
position = [0, 0, 0.2]
rotation = { axis = [0, 1, 0], angle = 0.3 }
"#;

fn folder() -> Folder {
    let folder = Folder::new();
    std::fs::write(folder.path("box.toml"), BOX).unwrap();
    folder
}

#[test]
fn a_run_says_whether_every_step_is_solved() {
    let folder = folder();
    let run = folder.run("simulate box.toml --csv box.csv --html box.html --out box.h5 --timings");
    let text = run.exits(0).stdout;
    let last = text.trim_end().lines().last().unwrap();
    assert!(last.contains("every one of 200 steps solved"), "{text}");
    for says in
        ["200 steps to t = 0.2", "2 bodies, 1 of them free", "penetration at most", "box.h5"]
    {
        assert!(text.contains(says), "{says}: {text}");
    }
    let table = std::fs::read_to_string(folder.path("box.csv")).unwrap();
    assert_eq!(table.lines().count(), 201);
    let columns = table.lines().next().unwrap().split(',').count();
    assert!(table.lines().all(|line| line.split(',').count() == columns));
    let page = std::fs::read_to_string(folder.path("box.html")).unwrap();
    assert!(page.contains("a box") && !page.contains("https://"), "no network");

    let json = folder.run("simulate box.toml --json --end 0.05");
    let json: Value = serde_json::from_str(&json.exits(0).stdout).unwrap();
    assert_eq!(json["status"], "solved");
    assert_eq!(json["statuses"]["solved"], 50);
    assert!(json["residual"].as_f64().unwrap() <= 1e-10);
    assert!(json["imbalance"].as_f64().unwrap() <= 1e-12);
}

#[test]
fn a_run_that_is_not_solved_says_so_and_exits_1() {
    let folder = folder();
    let run = folder.run(
        "simulate box.toml --set solver.name=nsgs --set solver.tol=1e-300 --end 0.15 --dump-fclib steps",
    );
    let text = run.exits(1).stdout;
    let last = text.trim_end().lines().last().unwrap();
    assert!(last.contains("NOT SOLVED") && last.contains("the first at t = "), "{text}");
    let dumped = std::fs::read_dir(folder.path("steps")).unwrap().next();
    let name = dumped.unwrap().unwrap().file_name();
    folder.run(&format!("solve steps/{} --tol 1e-8", name.to_string_lossy())).exits(0);
}

#[test]
fn a_run_goes_on_where_it_ended_as_if_it_had_not() {
    let folder = folder();
    folder.run("simulate box.toml --out whole.h5 --csv whole.csv").exits(0);
    folder.run("simulate box.toml --end 0.07 --out part.h5").exits(0);
    let resumed = folder.run("simulate box.toml --resume part.h5 --csv resumed.csv").exits(0);
    assert!(resumed.stdout.contains("every one of 130 steps"), "{}", resumed.stdout);
    let [whole, resumed] = ["whole.csv", "resumed.csv"]
        .map(|name| std::fs::read_to_string(folder.path(name)).unwrap());
    assert_eq!(whole, resumed, "to the last bit");
    folder.run("play part.h5 --html again.html --vtk again.pvd --glb again.glb").exits(0);
    for name in ["again.html", "again.pvd", "again.glb"] {
        assert!(folder.path(name).exists(), "{name}");
    }

    std::fs::create_dir(folder.path("runs")).unwrap();
    folder.run("play runs").refused(&["runs: /: expected a trajectory", "found a directory"]);
    folder.run("play part.h5 --svg last.svg").exits(0);
    folder.run("play part.h5 --svg frames").exits(0);
    let drawn = std::fs::read_to_string(folder.path("last.svg")).unwrap();
    assert!(drawn.starts_with("<svg") && drawn.contains("</svg>"));
    let frames = std::fs::read_dir(folder.path("frames")).unwrap().count();
    assert!(frames > 1 && !folder.path("last.html").exists(), "{frames}");
    let last = std::fs::read_to_string(folder.path(&format!("frames/frame-{:06}.svg", frames - 1)));
    assert_eq!(last.unwrap(), drawn);
    folder.run("play part.h5 --svg last.png").refused(&["--svg last.png", ".svg"]);

    let other = folder.run("simulate box.toml --resume part.h5 --set bodies[1].density=500");
    other.refused(&["a trajectory of the same scene"]);

    let before = std::fs::read(folder.path("part.h5")).unwrap();
    for (says, place) in [("--end 0.05", "--end"), ("--set time.end=0.05", "time.end")] {
        let back = folder.run(&format!("simulate box.toml --resume part.h5 {says}"));
        back.refused(&[&format!("{place}: expected a time of at least"), "part.h5", "0.05"]);
    }
    assert!(before == std::fs::read(folder.path("part.h5")).unwrap());
    folder.run("simulate box.toml --resume part.h5").exits(0);
    for command in ["info part.h5", "solve part.h5"] {
        folder.run(command).refused(&["found a trajectory, which `nonsmooth play` reads"]);
    }
}

#[test]
fn an_end_may_be_said_where_the_scene_states_none() {
    let folder = folder();
    std::fs::write(folder.path("open.toml"), BOX.replace(", end = 0.2", "")).unwrap();
    let run = folder.run("simulate open.toml --end 0.01").exits(0);
    assert!(run.stdout.contains("every one of 10 steps"), "{}", run.stdout);
    let says = "open.toml: time: missing field `end`; --end T gives it";
    folder.run("simulate open.toml").refused(&[says]);
}

#[test]
fn trajectories_keep_joints() {
    let folder = Folder::new();
    let scene = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let scene = scene.join("../../examples/scenes/four_bar.toml");
    let run =
        format!("simulate {} --every 50 --out run.h5 --html run.html --end 0.5", scene.display());
    // Equations that are redundant are said in the report.
    let ran = folder.run(&run);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    assert!(ran.stdout.contains("3 of 20 equations of joints are redundant"), "{}", ran.stdout);
    let run = nonsmooth_io::trajectory::Trajectory::read(folder.path("run.h5")).unwrap();
    assert_eq!(run.joints, ["motor", "elbow", "wrist", "bearing"]);
    let (first, last) = (&run.frames[0].joints, &run.frames[run.frames.len() - 1].joints);
    assert!(first.len() == 4 && first[0].angle == 0.0 && last[0].angle > 0.1, "{last:?}");
    assert!(last.iter().all(|j| j.violation < 1e-12));
    // Resumed, it begins where the file ends.
    let more = format!("simulate {} --every 50 --resume run.h5 --end 0.6", scene.display());
    assert_eq!(folder.run(&more).code, Some(0));
}

#[test]
fn elastic_boxes_move_in_all_files() {
    let folder = Folder::new();
    let scene = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let scene = scene.join("../../examples/scenes/rubber_block.toml").display().to_string();
    let files = "--out run.h5 --html run.html --vtk run.pvd --svg run.svg";
    let ran = folder.run(&format!("simulate {scene} --every 10 --end 0.1 {files}")).exits(0);
    assert!(ran.stdout.contains("1 elastic solid"), "{}", ran.stdout);
    let read = || nonsmooth_io::trajectory::Trajectory::read(folder.path("run.h5")).unwrap();
    let run = read();
    assert_eq!((&run.elastic[..], run.bodies.len()), (&["block".to_string()][..], 2));
    let last = run.frames.last().unwrap();
    let nodes = &last.elastic[0];
    assert_eq!(nodes.len(), 7 * 5 * 7);
    let mean = nodes.iter().map(|x| x[0]).sum::<f64>() / nodes.len() as f64;
    assert!((mean - last.bodies[1].position[0]).abs() < 1e-12 && mean > 0.1, "{mean}");
    assert!(last.contacts.iter().all(|c| (c.a, c.b) == (0, 1)) && !last.contacts.is_empty());
    // What is gone on from is what would have been.
    folder.run(&format!("simulate {scene} --every 10 --end 0.2 --out whole.h5")).exits(0);
    folder.run(&format!("simulate {scene} --every 10 --end 0.2 --resume run.h5")).exits(0);
    let whole = nonsmooth_io::trajectory::Trajectory::read(folder.path("whole.h5")).unwrap();
    assert_eq!(read().frames, whole.frames);
    folder.run("play run.h5 --html again.html --vtk again.pvd --glb again.glb").exits(0);
    let settle = folder.run(&format!("simulate {scene} --settle"));
    settle.refused(&["elastic", "rigid bodies alone"]);
    let typo = folder.run(&format!("simulate {scene} --set elastic[0].yung=1"));
    typo.refused(&["elastic[0].yung", "young"]);
}

#[test]
fn families_of_gen_move() {
    let folder = Folder::new();
    let run = folder.run("simulate stack --set count=3 --end 0.05").exits(0);
    assert!(run.stdout.contains("every one of 5 steps solved"), "{}", run.stdout);
}

/// A step that takes longer than there is time is not taken.
#[test]
fn threads_change_no_digit() {
    let folder = Folder::new();
    let table = |threads: usize| {
        let run = format!(
            "simulate wall --set rows=3 --set columns=3 --end 0.03 --threads {threads} --csv {threads}.csv"
        );
        folder.run(&run).exits(0);
        std::fs::read_to_string(folder.path(&format!("{threads}.csv"))).unwrap()
    };
    let one = table(1);
    assert!(one.lines().count() > 2);
    assert_eq!(one, table(2));
    assert_eq!(one, table(0));
}

#[test]
fn time_limits_hold_within_a_step() {
    let folder = Folder::new();
    let begun = std::time::Instant::now();
    let run = folder.run("simulate spheres --set base=7 --time-limit 0.5 --json");
    let json: Value = serde_json::from_str(&run.exits(1).stdout).unwrap();
    let slack = std::env::var("NONSMOOTH_SLACK").ok().and_then(|s| s.parse().ok()).unwrap_or(1.0);
    assert!(begun.elapsed().as_secs_f64() < 0.55 + 0.5 * slack);
    assert_eq!(json["stopped"], true);
    assert!(json["residual"].as_f64().unwrap() <= 1e-10, "no step that is not solved: {json}");
}

/// A scene that takes longer to make than there is time is not made.
#[test]
fn time_limits_hold_while_a_scene_is_made() {
    let folder = Folder::new();
    let begun = std::time::Instant::now();
    let run = folder.run("simulate sphere_pile --set count=200000 --time-limit 0.5").exits(1);
    let slack = std::env::var("NONSMOOTH_SLACK").ok().and_then(|s| s.parse().ok()).unwrap_or(1.0);
    assert!(begun.elapsed().as_secs_f64() < 0.6 + slack);
    assert_eq!(run.stdout, "sphere_pile: stopped before the scene was made\n");
    let run =
        folder.run("simulate sphere_pile --set count=200000 --time-limit 0.1 --json").exits(1);
    assert_eq!((&run.json()[0]["stopped"], &run.json()[0]["steps"]), (&true.into(), &0.into()));
    // No time is no step, not a race against the clock.
    let run = folder.run("simulate stack --time-limit 0").exits(1);
    assert_eq!(run.stdout, "stack: stopped before the scene was made\n");
}

#[test]
fn scenes_are_explained() {
    let folder = folder();
    let explained = folder.run("simulate box.toml --explain").exits(0).stdout;
    std::fs::write(folder.path("explained.toml"), &explained).unwrap();
    let again = folder.run("simulate explained.toml --explain").exits(0).stdout;
    assert_eq!(explained, again);
    assert!(explained.contains("theta = 0.5"), "{explained}");
    let schema = folder.run("simulate --schema").exits(0).stdout;
    let schema: Value = serde_json::from_str(&schema).unwrap();
    assert!(schema["properties"]["bodies"].is_object());
}

#[test]
fn energies_beyond_the_range_of_numbers_are_no_solution() {
    let folder = folder();
    for changed in ["gravity=[0,0,-1e170]", "bodies[1].velocity=[0,0,-1e308]"] {
        let run = folder.run(&format!("simulate box.toml --end 0.02 --set {changed} --json"));
        let json: Value = serde_json::from_str(&run.exits(1).stdout).unwrap();
        assert_eq!(json["status"], "not_solved", "{changed}");
        assert_eq!(json["statuses"]["not_finite"], 1, "{changed}");
    }
}

#[test]
fn a_step_longer_than_the_run_is_shortened() {
    let folder = folder();
    for h in ["1e3", "1e300"] {
        let run = folder.run(&format!("simulate box.toml --end 0.002 --set time.h={h} --json"));
        let json: Value = serde_json::from_str(&run.exits(0).stdout).unwrap();
        assert_eq!((&json["steps"], &json["t"]), (&1.into(), &0.002.into()), "{h}");
    }
    let run = folder.run("simulate box.toml --end 0.2 --set time.h=1e-20");
    run.refused(&["h: expected a step that moves the time"]);
}

#[test]
fn frames_of_a_longer_run_do_not_stay() {
    let folder = folder();
    let frames = || std::fs::read_dir(folder.path("film")).unwrap().count();
    folder.run("simulate box.toml --end 0.01 --svg film/").exits(0);
    assert_eq!(frames(), 11);
    folder.run("simulate box.toml --end 0.003 --svg film/").exits(0);
    assert_eq!(frames(), 4);
}

#[test]
#[cfg(unix)]
fn names_that_are_no_text_and_files_that_cannot_be_written_cost_no_report() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;

    let folder = folder();
    let name = OsStr::from_bytes(b"b\xfex.toml");
    std::fs::write(folder.as_ref().join(name), BOX).unwrap();
    for (more, code) in [(vec!["--end", "0.01"], 0), (vec!["--time-limit", "0"], 1)] {
        let run = folder.command().arg("simulate").arg(name).args(more).arg("--json").output();
        let json: Value =
            serde_json::from_str(&crate::common::Run::from(run.unwrap()).exits(code).stdout)
                .unwrap();
        assert_eq!(json["scene"], "b\u{fffd}x.toml");
    }

    // A disk that is full for one of the files: writing beyond the limit fails in place of killing.
    let program = env!("CARGO_BIN_EXE_nonsmooth");
    let script = format!(
        "trap '' XFSZ; ulimit -f 76; exec {program} simulate box.toml --end 0.2 --every 1 --out big.h5 --csv small.csv"
    );
    let run = std::process::Command::new("sh").args(["-c", &script]).current_dir(&folder).output();
    let run = crate::common::Run::from(run.unwrap());
    assert_eq!(run.code, Some(2), "{}{}", run.stdout, run.stderr);
    assert!(run.stderr.starts_with("error: --out big.h5"), "{}", run.stderr);
    assert!(run.stdout.contains("every one of 200 steps solved"), "{}", run.stdout);
    let table = std::fs::read_to_string(folder.path("small.csv")).unwrap();
    assert_eq!(table.lines().count(), 201);
}

#[test]
fn mistakes_are_one_line() {
    let folder = folder();
    std::fs::write(folder.path("broken.toml"), "bodies = [").unwrap();
    std::fs::write(folder.path("bytes.h5"), b"\x89HDF\r\n").unwrap();
    std::fs::write(folder.path("robot.urdf"), "<robot/>").unwrap();
    std::fs::write(folder.path("robot.xml"), "<mujoco/>").unwrap();
    for (command, says) in [
        ("simulate", "SCENE"),
        (
            "simulate robot.urdf",
            "robot.urdf: expected a scene as TOML or JSON, found URDF, of which `nonsmooth convert robot.urdf robot.toml` makes one",
        ),
        ("simulate robot.xml", "found MJCF, of which `nonsmooth convert robot.xml robot.toml`"),
        ("simulate no.xml", "no.xml: expected a readable file"),
        ("simulate nowhere.toml", "nowhere.toml: expected a readable file"),
        ("simulate wal", "wal: expected a file or a family of scenes"),
        ("simulate broken.toml", "broken.toml: line 1: expected valid TOML"),
        ("simulate box.toml --set time.h=-1", "box.toml: time.h: expected a positive number"),
        ("simulate box.toml --set bodies[1].hight=3", "bodies[1].hight: unknown field"),
        (
            "simulate box.toml --set bodies[1].position=[0,0,0]",
            "bodies overlap at the start: `floor` and `box` by",
        ),
        ("simulate box.toml --set solver.name=atuo", "did you mean `auto`?"),
        ("simulate box.toml --out nowhere/run.h5", "--out nowhere/run.h5"),
        ("simulate box.toml --time-limit -1", "--time-limit: expected a number of seconds"),
        ("simulate box.toml --out box.h5 --flush -1", "--flush: expected a number of seconds"),
        ("simulate box.toml --threads -1", "invalid value '-1' for '--threads <N>'"),
        ("simulate box.toml --every -1", "invalid value '-1' for '--every <STEPS>'"),
        (
            "simulate bytes.h5",
            "bytes.h5: expected a scene as TOML or JSON, found a file that is no",
        ),
        ("simulate stack --set cuont=3", "cuont"),
        ("play box.toml", "box.toml"),
        ("solve box.toml", "found a scene, which `nonsmooth simulate` moves"),
    ] {
        folder.run(command).refused(&[says]);
    }
}

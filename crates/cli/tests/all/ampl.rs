//! The program as AMPL and Pyomo call it.

use std::path::Path;
use std::process::Command;

use crate::common::{Folder, Run};

const PROGRAM: &str = env!("CARGO_BIN_EXE_nonsmooth-ampl");

/// `x0 + x1 = 3` for x0 free, `x1 ≥ 0 ⟂ x1 − x0 + 1`: (2, 1).
const MODEL: &str = "g3 1 1 0	# problem two
 2 2 0 0 1
 0 0 1 0
 0 0
 0 0 0
 0 0 0 1
 0 0 0 0 0
 4 0
 0 0
 0 0 0 0 0
C0
n0
C1
n1
r
4 3
5 1 2
b
3
2 0
k1
2
J0 2
0 1
1 1
J1 2
0 -1
1 1
";

struct Place(Folder);

impl Place {
    fn new(model: &str) -> Self {
        let folder = Folder::new();
        std::fs::write(folder.path("m.nl"), model).unwrap();
        Self(folder)
    }

    /// The program, with nothing in its environment that it asks for.
    fn command(&self, program: impl AsRef<Path>) -> Command {
        let mut command = Command::new(program.as_ref());
        command.current_dir(&self.0);
        for name in ["nonsmooth_options", "path_options", "pathampl_options", "solver_msg"] {
            command.env_remove(name);
        }
        command
    }

    fn run(&self, arguments: &[&str]) -> Run {
        self.command(PROGRAM).args(arguments).output().unwrap().into()
    }

    /// The lines of the solution, which is taken away.
    fn solution(&self) -> Vec<String> {
        let path = self.0.path("m.sol");
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::remove_file(path).unwrap();
        text.lines().map(Into::into).collect()
    }

    /// Runs it as AMPL does, and gives the values and how it ended.
    fn solved(&self, options: &[&str]) -> (Vec<f64>, String) {
        self.run(&[&["m", "-AMPL"], options].concat()).exits(0);
        values(&self.solution())
    }
}

fn values(lines: &[String]) -> (Vec<f64>, String) {
    let (end, lines) = lines.split_last().unwrap();
    let at = lines.iter().position(|l| l == "Options").unwrap();
    let options: usize = lines[at + 1].parse().unwrap();
    let values = lines[at + 6 + options..].iter().map(|l| l.parse().unwrap());
    (values.collect(), end.clone())
}

fn near(x: &[f64], y: &[f64]) -> bool {
    x.len() == y.len() && x.iter().zip(y).all(|(x, y)| (x - y).abs() < 1e-6)
}

#[test]
fn a_call_of_ampl_is_answered_in_the_solution() {
    let place = Place::new(MODEL);
    for stub in ["m", "m.nl"] {
        let run = place.run(&[stub, "-AMPL", "tol=1e-10"]).exits(0);
        assert_eq!(run.stdout, "tol=1e-10\n");
        let lines = place.solution();
        assert_eq!(lines[0], "nonsmooth-ampl: Solution found.", "{lines:?}");
        assert!(lines[1].ends_with("factorisations."), "{lines:?}");
        let at = lines.iter().position(|l| l == "Options").unwrap();
        assert_eq!(lines[at - 1], "");
        assert_eq!(lines[at + 1..at + 9], ["3", "1", "1", "0", "2", "0", "2", "2"]);
        let (x, end) = values(&lines);
        assert!(near(&x, &[2.0, 1.0]), "{x:?}");
        assert_eq!(end, "objno 0 0");
    }
    // The other program does the same where it is called so.
    place.0.run("m -AMPL -e").exits(0);
    let lines = place.solution();
    assert_eq!(lines[0].split(' ').next(), Some("nonsmooth:"));
}

#[test]
fn binary_models_have_binary_solutions() {
    let folder = Folder::new();
    for name in ["pairs-little.nl", "pairs-big.nl"] {
        let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../io/tests/nl").join(name);
        std::fs::copy(data, folder.path(name)).unwrap();
        let place = Place(Folder::new());
        std::fs::copy(folder.path(name), place.0.path("m.nl")).unwrap();
        place.run(&["m", "-AMPL"]).exits(0);
        let bytes = std::fs::read(place.0.path("m.sol")).unwrap();
        assert_eq!(&bytes[4..10], b"binary");
        let result: [u8; 4] = bytes[bytes.len() - 8..bytes.len() - 4].try_into().unwrap();
        assert_eq!(i32::from_le_bytes(result), 0, "{name}");
    }
}

#[test]
fn options_come_from_the_environment_and_then_from_arguments() {
    let place = Place::new(MODEL);
    let link = place.0.path("pathampl");
    #[cfg(unix)]
    std::os::unix::fs::symlink(PROGRAM, &link).unwrap();
    #[cfg(not(unix))]
    std::fs::copy(PROGRAM, &link).unwrap();
    let run: Run = place
        .command(&link)
        .args(["m", "-AMPL", "tol=1e-9"])
        .env("nonsmooth_options", "solver=auto")
        .env("path_options", "tol 1e-3 crash_method=none")
        .env("pathampl_options", "time_limit = '30'")
        .output()
        .unwrap()
        .into();
    let said = "solver=auto\ntol=1e-3\ncrash_method=none\ntime_limit=30\ntol=1e-9\n";
    assert_eq!(run.exits(0).stdout, said);
    let lines = place.solution();
    assert_eq!(lines[0], "pathampl: Solution found.");
    assert!(lines.contains(&"crash_method has no meaning here".to_owned()), "{lines:?}");
}

#[test]
fn how_it_ended_has_a_number() {
    let place = Place::new(MODEL);
    let (x, end) = place.solved(&["time_limit=0"]);
    assert_eq!((x.len(), &end[..]), (2, "objno 0 402"));
    for mistake in ["magic=1", "solver=magic", "tol=0", "tol=often", "tol"] {
        let (x, end) = place.solved(&[mistake]);
        assert_eq!((x.len(), &end[..]), (0, "objno 0 501"), "{mistake}");
        // Pyomo shows a user nothing of the file.
        let run = place.run(&["m", "-AMPL", mistake]).exits(0);
        assert!(run.stdout.contains(&place.solution()[0]), "{}", run.stdout);
    }
    let refused = |from: &str, to: &str| Place::new(&MODEL.replacen(from, to, 1)).solved(&[]).1;
    assert_eq!(refused("2 0\nk1", "0 3 2\nk1"), "objno 0 200");
    assert_eq!(refused("4 3", "5 1 2"), "objno 0 501");
    assert_eq!(refused("4 3", "3"), "objno 0 504");
    assert_eq!(refused("4 3", "2 3"), "objno 0 505");
    let side = Place::new(&MODEL.replacen("3\n2 0\nk1", "2 0.5\n2 0\nk1", 1));
    assert_eq!(side.solved(&[]).1, "objno 0 505");
    // Only x0 ≥ 0.5 is asked of the solution, whose multiplier is not sent.
    let (x, end) = side.solved(&["sideineq=1"]);
    assert!(near(&x, &[2.0, 1.0]) && end == "objno 0 0", "{x:?} {end}");
}

#[test]
fn without_the_flag_the_answer_is_printed() {
    let place = Place::new(MODEL);
    std::fs::write(place.0.path("m.col"), "first\nsecond\n").unwrap();
    let run = place.run(&["-e", "m", "wantsol=2"]).exits(0);
    assert!(run.stdout.starts_with("nonsmooth-ampl: Solution found.\n"), "{}", run.stdout);
    let printed: Vec<_> = run.stdout.lines().rev().take(2).collect();
    assert!(printed[1].starts_with("first ") && printed[0].starts_with("second "), "{printed:?}");
    assert!(!place.0.path("m.sol").exists());
    assert_eq!(place.run(&["-e", "-s", "m", "wantsol=8"]).exits(0).stdout, "");
    place.solution();
    place.run(&["-e", "-oother.sol", "m", "wantsol=9"]).exits(0);
    assert!(place.0.path("other.sol").exists() && !place.0.path("m.sol").exists());
    // x1 ≤ 0.5 of a file of bounds: x0 = 2.5.
    std::fs::write(place.0.path("bounds"), "1 0 0.5\n").unwrap();
    place.run(&["-bbounds", "m", "-AMPL"]).exits(0);
    let (x, _) = values(&place.solution());
    assert!(near(&x, &[2.5, 0.5]), "{x:?}");
}

#[test]
fn a_file_of_bounds_is_as_the_bounds_of_the_model() {
    let place = Place::new(MODEL);
    let end = |bounds: &str, options: &[&str]| {
        std::fs::write(place.0.path("bounds"), bounds).unwrap();
        place.run(&[&["-bbounds", "m", "-AMPL"], options].concat()).exits(0);
        values(&place.solution())
    };
    // x0 belongs to the equation, which bounds do not replace.
    assert_eq!(end("0 5 inf\n", &[]).1, "objno 0 505");
    let (x, ended) = end("0 1.5 inf\n", &["sideineq=1"]);
    assert!(near(&x, &[2.0, 1.0]) && ended == "objno 0 0", "{x:?} {ended}");
    assert_eq!(end("1 3 2\n", &[]).1, "objno 0 200");
    assert_eq!(end("1 0 nan\n", &[]).1, "objno 0 501");
    assert_eq!(end("2 0 1\n", &[]).1, "objno 0 501");
    // −1 ends at an upper bound: 1e30 is none, but where infinity is beyond.
    let falling = MODEL.replacen("J1 2\n0 -1\n1 1\n", "J1 2\n0 0\n1 0\n", 1);
    std::fs::write(place.0.path("m.nl"), falling.replacen("C1\nn1", "C1\nn-1", 1)).unwrap();
    assert_eq!(end("1 0 1e10\n", &[]).0[1], 1e10);
    assert_ne!(end("1 0 1e30\n", &[]).1, "objno 0 0");
    assert_eq!(end("1 0 1e30\n", &["infinity=1e40"]).0[1], 1e30);
}

#[test]
fn questions_are_answered_and_mistakes_are_one_line() {
    let place = Place::new(MODEL);
    let version = place.run(&["-v"]).exits(0).stdout;
    assert!(version.contains(env!("CARGO_PKG_VERSION")), "{version}");
    assert_eq!(place.0.run("-v").exits(0).stdout.replace("nonsmooth ", "nonsmooth-ampl "), version);
    assert!(place.run(&["-="]).exits(0).stdout.contains("sideineq"));
    assert!(place.run(&["-?"]).exits(0).stdout.starts_with("usage: nonsmooth-ampl"));
    place.run(&[]).refused(&["expected a stub", "usage: nonsmooth-ampl"]);
    place.run(&["-x", "m"]).refused(&["found `-x`"]);
    place.run(&["none", "-AMPL"]).refused(&["none"]);
    // No answer over what is read.
    place.run(&["-om.nl", "m", "-AMPL"]).refused(&["-o m.nl", "a file of its own"]);
    assert_eq!(std::fs::read_to_string(place.0.path("m.nl")).unwrap(), MODEL);
    let trimmed = place.run(&["m", "-AMPL", "tol = 1e-9"]).exits(0).stdout;
    assert!(!trimmed.contains("unknown key"), "{trimmed}");
    std::fs::write(place.0.path("bad.nl"), MODEL.replacen("n1", "o99", 1)).unwrap();
    place.run(&["bad", "-AMPL"]).refused(&["bad.nl: line 14, segment C1", "found `o99`"]);
    assert!(!place.0.path("bad.sol").exists());
}

#[test]
fn pyomo_finds_and_calls_it() {
    let installed = Command::new("python3").args(["-c", "import pyomo.environ"]).output();
    if !installed.is_ok_and(|run| run.status.success()) {
        crate::common::skipped("python3 has no pyomo");
        return;
    }
    let folder = Folder::new();
    let script = r#"
from pyomo.environ import *
from pyomo.mpec import Complementarity, complements
import sys

for name in sys.argv[1:]:
    m = ConcreteModel()
    m.x = Var(bounds=(0, None), initialize=1.0)
    m.y = Var(bounds=(0, None), initialize=1.0)
    m.z = Var(bounds=(0, None), initialize=1.0)
    m.first = Complementarity(expr=complements(m.x >= 0, m.x + 2 * m.y - 3 >= 0))
    m.second = Complementarity(expr=complements(m.y >= 0, exp(m.y) - m.x >= 0))
    m.third = Complementarity(expr=complements(m.z >= 0, 1 + m.z + m.x >= 0))
    solver = SolverFactory(name)
    assert solver.available(), name
    result = solver.solve(m, options={"tol": 1e-10, "solver": "auto"} if name == "path" else {"tol": 1e-10})
    assert str(result.solver.termination_condition) == "optimal", result
    print(value(m.x), value(m.y), value(m.z))
"#;
    std::fs::write(folder.path("model.py"), script).unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink(PROGRAM, folder.path("pathampl")).unwrap();
    let own = Path::new(PROGRAM).parent().unwrap().to_owned();
    let path = std::env::var_os("PATH").unwrap_or_default();
    let paths = [folder.as_ref().to_owned(), own].into_iter().chain(std::env::split_paths(&path));
    let mut names = vec!["asl:nonsmooth-ampl"];
    if cfg!(unix) {
        names.push("path");
    }
    let run: Run = Command::new("python3")
        .arg("model.py")
        .args(&names)
        .current_dir(&folder)
        .env("PATH", std::env::join_paths(paths).unwrap())
        .output()
        .unwrap()
        .into();
    assert_eq!(run.code, Some(0), "{}{}", run.stdout, run.stderr);
    for line in run.stdout.lines() {
        let numbers: Vec<f64> = line.split(' ').map(|w| w.parse().unwrap()).collect();
        let [x, y, z] = numbers[..] else { panic!("{line}") };
        assert!((x + 2.0 * y - 3.0).abs() < 1e-6 && (y.exp() - x).abs() < 1e-6 && z.abs() < 1e-6);
    }
    assert_eq!(run.stdout.lines().count(), names.len());
}

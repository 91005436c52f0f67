//! What is checked in beside the code is what the program makes.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use nonsmooth_io::ProblemFile;
use nonsmooth_problem::Friction;
use nonsmooth_problem::check::Judged;
use nonsmooth_scenes::SCENES;

use crate::common::{Folder, Run};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

#[test]
fn the_page_of_solvers_is_what_the_registry_prints() {
    let page = std::fs::read_to_string(root().join("docs/solvers.md")).unwrap();
    let printed = Folder::new().run("list --markdown");
    assert!(
        page == printed.stdout,
        "docs/solvers.md is stale: nonsmooth list --markdown > docs/solvers.md"
    );
}

/// The project's own suite: of every family, small and large, in both forms.
#[test]
fn the_suite_can_be_generated() {
    let suite = root().join("docs/benchmarks/suite.toml");
    let folder = Folder::new();
    let out = folder.path("all");
    let mut command = folder.command();
    command.args(["gen", "--suite"]).arg(suite).arg("--out").arg(&out);
    let run = Run::from(command.output().unwrap()).exits(0);
    assert!((90..=120).contains(&run.stdout.lines().count()), "{}", run.stdout);
    let (mut least, mut most, mut kinds) = (usize::MAX, 0, BTreeSet::new());
    for scene in SCENES {
        for entry in std::fs::read_dir(out.join(scene.name)).expect(scene.name) {
            let path = entry.unwrap().path();
            assert!(path.metadata().unwrap().len() < 20_000_000, "{}", path.display());
            let file = ProblemFile::read(&path).unwrap();
            let problem = file.contacts(&path).unwrap();
            if let Friction::Global3(problem) = problem {
                assert_eq!(file.info.dofs, Some(problem.dofs()), "{}", path.display());
            }
            least = least.min(problem.contacts());
            most = most.max(problem.contacts());
            kinds.insert(problem.kind().name());
        }
    }
    assert!(least == 3 && (4000..5000).contains(&most) && kinds.len() == 2, "{least} {most}");
}

/// The texts of a picture: captions, keys, axes.
fn texts(svg: &str) -> Vec<&str> {
    let each = svg.split("<text").skip(1).filter_map(|t| t.split_once('>')?.1.split('<').next());
    each.map(str::trim).collect()
}

/// Runs examples/make.sh, which runs the commands of examples/README.md. On another machine the data may differ in the last bits, so the stored
/// solution is judged on the problem made anew, and of the pictures the texts are compared: how many contacts stick and slip, how large the impulses are.
#[test]
#[cfg(unix)]
fn the_examples_are_what_their_commands_make() {
    let readme = std::fs::read_to_string(root().join("examples/README.md")).unwrap();
    let folder = Folder::new();
    let program = Path::new(env!("CARGO_BIN_EXE_nonsmooth")).parent().unwrap();
    let path = std::env::join_paths(
        std::iter::once(program.to_owned())
            .chain(std::env::split_paths(&std::env::var_os("PATH").unwrap_or_default())),
    );
    let mut script = std::process::Command::new("bash");
    script.arg(root().join("examples/make.sh")).arg(folder.path("")).env("PATH", path.unwrap());
    Run::from(script.output().unwrap()).exits(0);
    let mut made = 0;
    for line in readme.lines().filter(|l| l.starts_with("nonsmooth gen ") && l.contains("--out")) {
        let after = |option: &str| {
            let mut words = line.split_whitespace().skip_while(|w| *w != option);
            words.nth(1).unwrap_or_else(|| panic!("{line}: no {option}"))
        };
        let (problem, picture) = (after("--out"), after("--draw"));
        let anew = ProblemFile::read(folder.path(problem)).unwrap();
        let kept = ProblemFile::read(root().join("examples").join(problem)).unwrap();
        assert_eq!(anew.info, kept.info, "{line}");
        let solution = kept.solution.expect("the examples hold solutions");
        // The velocities of a global problem follow from r; the residual looks at r alone.
        let verdict = anew.problem.judge(&solution.point, 1e-8).unwrap();
        assert!(verdict.measure.relative <= 1e-9, "{line}: {:?}", verdict.measure);
        let [anew, kept] = [folder.path(picture), root().join("examples").join(picture)]
            .map(|path| std::fs::read_to_string(path).expect(line));
        assert_eq!(texts(&anew), texts(&kept), "{line}: bash examples/make.sh");
        made += 1;
    }
    let kept = std::fs::read_dir(root().join("examples")).unwrap();
    let hdf5 = |e: &std::fs::DirEntry| e.path().extension().is_some_and(|e| e == "hdf5");
    assert_eq!(kept.filter(|e| hdf5(e.as_ref().unwrap())).count(), made);
}

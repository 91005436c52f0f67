//! The files of a corpus, if `NONSMOOTH_CORPUS` names one (with a `manifest.csv`).

use std::path::Path;

use nonsmooth_io::fclib::{self, Fclib};
use nonsmooth_io::{Format, ProblemFile};
use nonsmooth_problem::with_friction;

#[test]
fn every_file_loads_and_passes_through_unchanged() {
    let Some(corpus) = std::env::var_os("NONSMOOTH_CORPUS") else {
        crate::common::skipped("NONSMOOTH_CORPUS is not set");
        return;
    };
    let corpus = Path::new(&corpus);
    let folder = tempfile::tempdir().unwrap();
    let copy = folder.path().join("copy.hdf5");
    let manifest = std::fs::read_to_string(corpus.join("manifest.csv")).unwrap();
    let (mut loaded, mut rolling) = (0, 0);
    for line in manifest.lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let (name, kind, nc, m) = (fields[0], fields[1], fields[2], fields[4]);
        let path = corpus.join(name);
        if kind.starts_with("fclib") {
            let content = ProblemFile::read(&path).unwrap_or_else(|e| panic!("{e}"));
            let problem = crate::common::contacts(&content);
            assert_eq!(problem.contacts().to_string(), nc, "{name}");
            assert_eq!(crate::common::sizes(&content.problem).1.to_string(), m, "{name}");
            with_friction!(problem, p => assert!(p.rows.is_none(), "{name}"));
            assert_eq!(&fclib::read_problem(&path).unwrap(), problem);
            Fclib.write(&copy, &content).unwrap();
            crate::common::assert_same(&ProblemFile::read(&copy).unwrap(), &content);
            loaded += 1;
            rolling += usize::from(kind.contains("rolling"));
        }
    }
    eprintln!("{loaded} files loaded, {rolling} of them with rolling friction");
    assert!(loaded > 200 && rolling > 5, "{loaded} loaded, {rolling} with rolling friction");
}

//! The problems of a campaign: files found under folders, with names that stay the same on every machine.

use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};

use nonsmooth_analysis::Traits;
use nonsmooth_io::{FORMATS, ProblemFile, holds_problem, parts as files_of};
use nonsmooth_problem::{AnyProblem, Problem as _, Stated, with_complementarity};
use sha2::{Digest, Sha256};

use crate::finite;
use crate::record::Problem;

/// A file that holds a problem.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Input {
    /// Where it is.
    pub path: PathBuf,
    /// `family/name`: as few of the last folders as tell it from the others, at least one.
    pub name: String,
    /// The folder that holds it.
    pub family: String,
    /// Its length, bytes.
    pub bytes: u64,
}

/// All files that look like problems of one of the [`FORMATS`] (see [`holds_problem`]) under the given
/// files and folders, each once, the smallest first. A link to a file has the name and the folder of the link.
///
/// Second: what is wrong with them, one line each: a root that does not exist, cannot be listed, or holds no problem; a
/// device or a pipe, whose end nobody knows; a name that is not UTF-8.
pub fn inputs(roots: &[PathBuf]) -> (Vec<Input>, Vec<String>) {
    let mut mistakes = vec![];
    let mut found = BTreeMap::new();
    for root in roots {
        let before = mistakes.len();
        let mut here = vec![];
        walk(root, root, &mut here, &mut mistakes);
        if here.is_empty() && mistakes.len() == before {
            let root = root.display();
            let reads = FORMATS.iter().filter(|f| !f.about().reads.is_empty());
            let named: Vec<_> = reads.map(|f| format!("*.{}", f.about().extensions[0])).collect();
            let named = named.join(", ");
            mistakes.push(format!("{root}: expected problems ({named}), found none"));
        }
        for path in here {
            // The same file may be reached from two roots.
            let real = path.canonicalize().unwrap_or_else(|_| path.clone());
            found.entry(real).or_insert(path);
        }
    }
    // `a/b.h5` beside `a/b.hdf5`: no folder tells them apart.
    let mut seen = HashSet::new();
    found.retain(|_, path| {
        let parts = parts(path);
        let name = tail(&parts, 2);
        let first = seen.insert(parts);
        if !first {
            let path = path.display();
            mistakes.push(format!("{path}: expected a name of its own, found `{name}` twice"));
        }
        first
    });
    let parts: Vec<Vec<String>> = found.values().map(|path| parts(path)).collect();
    let mut depth = vec![2; parts.len()];
    // Names that are the same for two files take in one more folder, until all differ.
    loop {
        let mut count = BTreeMap::new();
        parts.iter().zip(&depth).for_each(|(p, &d)| *count.entry(tail(p, d)).or_insert(0) += 1);
        let mut longer = false;
        for (p, d) in parts.iter().zip(&mut depth) {
            if count[&tail(p, *d)] > 1 && *d < p.len() {
                *d += 1;
                longer = true;
            }
        }
        if !longer {
            break;
        }
    }
    let mut inputs = vec![];
    for ((parts, depth), path) in parts.iter().zip(depth).zip(found.into_values()) {
        let name = tail(parts, depth);
        let family = parts.iter().rev().nth(1).cloned().unwrap_or_default();
        let bytes = std::fs::metadata(&path).map_or(0, |m| m.len());
        inputs.push(Input { path, name, family, bytes });
    }
    inputs.sort_by(|a, b| (a.bytes, &a.name).cmp(&(b.bytes, &b.name)));
    (inputs, mistakes)
}

/// What the problem of a file is; its name and family are left empty.
///
/// Errors: a file that cannot be read, by name.
pub fn describe(file: &Path) -> Result<Problem, String> {
    let mut digest = Sha256::new();
    for part in files_of(file) {
        let bytes = std::fs::read(&part).map_err(|e| format!("{}: {e}", part.display()))?;
        digest.update(&bytes);
    }
    let digest: String = digest.finalize().iter().take(8).map(|b| format!("{b:02x}")).collect();
    let content = ProblemFile::read(file).map_err(|e| e.to_string())?;
    let problem = &content.problem;
    let all = Problem {
        digest,
        kind: problem.kind().name().into(),
        unknowns: problem.unknowns(),
        ..Problem::default()
    };
    Ok(match problem {
        AnyProblem::Friction(contacts) => {
            let traits = Traits::of(contacts, content.info.dofs);
            Problem {
                contacts: traits.contacts,
                dofs: traits.dofs,
                density: traits.density(),
                asymmetry: finite(traits.asymmetry),
                mu_min: finite(traits.mu.min),
                mu_max: finite(traits.mu.max),
                ..all
            }
        }
        AnyProblem::Complementarity(linear) => {
            // Pairs stand where contacts do.
            let (contacts, matrices) =
                with_complementarity!(linear, p => (Stated::pairs(p), p.matrices()));
            let first = matrices.first().filter(|(_, m)| m.nrows() == m.ncols());
            let asymmetry = first.and_then(|(_, m)| m.asymmetry());
            Problem { contacts, asymmetry: asymmetry.and_then(finite), ..all }
        }
    })
}

/// The folders and the name of a file, without extension. Stores of large files keep them under their checksums and link
/// to them: what names a file is the link.
fn parts(path: &Path) -> Vec<String> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let folder = folder.canonicalize().unwrap_or_else(|_| folder.into());
    let named = folder.join(path.file_stem().unwrap_or_default());
    named
        .components()
        .filter_map(|c| match c {
            std::path::Component::Normal(part) => Some(part.to_string_lossy().into_owned()),
            _ => None,
        })
        .collect()
}

fn tail(parts: &[String], depth: usize) -> String {
    parts[parts.len().saturating_sub(depth)..].join("/")
}

fn walk(root: &Path, path: &Path, found: &mut Vec<PathBuf>, mistakes: &mut Vec<String>) {
    let refused = |e: std::io::Error| format!("{}: {e}", path.display());
    if path.is_dir() {
        let listed = std::fs::read_dir(path).and_then(|all| all.collect::<Result<Vec<_>, _>>());
        match listed {
            Ok(entries) => {
                for entry in entries {
                    // Links to folders may lead in circles.
                    let circle = entry.path().is_dir() && entry.path().is_symlink();
                    if !circle {
                        walk(root, &entry.path(), found, mistakes);
                    }
                }
            }
            Err(e) => mistakes.push(refused(e)),
        }
    } else if path == root || holds_problem(path) {
        // A file that is named is meant, whatever its extension.
        let expected = |what: &str| format!("{}: expected {what}", path.display());
        match std::fs::metadata(path) {
            Ok(there) if !there.is_file() => {
                mistakes.push(expected("a file, found a device or a pipe"));
            }
            // Runs are kept as JSON, and jobs sent as such.
            Ok(_) if path.to_str().is_none() => {
                mistakes.push(expected("a path in UTF-8, found other bytes"));
            }
            Ok(_) => found.push(path.into()),
            Err(e) => mistakes.push(refused(e)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_take_in_as_many_folders_as_they_need() {
        let dir = tempfile::tempdir().unwrap();
        let make = |name: &str, bytes: usize| {
            let path = dir.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, vec![0; bytes]).unwrap();
        };
        make("one/wall/a.hdf5", 3);
        make("two/wall/a.hdf5", 2);
        make("two/wall/b.h5", 1);
        make("two/wall/b.hdf5", 1);
        make("two/wall/notes.txt", 1);
        let all = [dir.path().to_path_buf(), dir.path().join("two/wall/b.h5")];
        let (found, mistakes) = inputs(&all);
        let names: Vec<_> = found.iter().map(|i| (i.name.as_str(), i.family.as_str())).collect();
        assert_eq!(names, [("wall/b", "wall"), ("two/wall/a", "wall"), ("one/wall/a", "wall")]);
        assert_eq!(mistakes.len(), 1, "{mistakes:?}");
        assert!(mistakes[0].ends_with("expected a name of its own, found `wall/b` twice"));
    }

    #[test]
    fn linear_problems_are_found_among_other_texts() {
        let dir = tempfile::tempdir().unwrap();
        let make = |name: &str, text: &str| std::fs::write(dir.path().join(name), text).unwrap();
        let matrix = "%%MatrixMarket matrix array real general\n1 1\n";
        make("a.toml", "# x >= 0\nkind = \"lcp\"\nq = [-1]\nM = [[2]]\n");
        make("suite.toml", "[[problem]]\nfamily = \"wall\"\n");
        make("b.mtx", &format!("{matrix}2\n"));
        make("b_q.mtx", &format!("{matrix}-1\n"));
        make("c.dat", "1\n0\n1\n1\n1 1\n2\n-1\n");
        make("d.dat", "time force\n0 1\n");
        let (found, mistakes) = inputs(&[dir.path().into()]);
        assert!(mistakes.is_empty(), "{mistakes:?}");
        let mut names: Vec<_> = found.iter().map(|i| i.path.file_name().unwrap()).collect();
        names.sort();
        assert_eq!(names, ["a.toml", "b.mtx", "c.dat"]);
        let described: Vec<_> = found.iter().map(|i| describe(&i.path).unwrap()).collect();
        assert!(
            described.iter().all(|d| (d.kind.as_str(), d.contacts, d.unknowns) == ("lcp", 1, 1))
        );
        // The vectors belong to the problem.
        let before = describe(&dir.path().join("b.mtx")).unwrap().digest;
        make("b_q.mtx", &format!("{matrix}-3\n"));
        assert_ne!(before, describe(&dir.path().join("b.mtx")).unwrap().digest);
    }

    #[cfg(unix)]
    #[test]
    fn links_name_their_files_and_what_is_no_file_is_named() {
        use std::os::unix::ffi::OsStrExt;
        use std::os::unix::fs::symlink;
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        std::fs::create_dir_all(at("store")).unwrap();
        std::fs::create_dir_all(at("wall")).unwrap();
        std::fs::write(at("store/0f3a"), "content").unwrap();
        symlink(at("store/0f3a"), at("wall/a.hdf5")).unwrap();
        symlink(at("store/0f3a"), at("wall/b.hdf5")).unwrap();
        symlink(at("wall"), at("wall/circle")).unwrap();
        symlink("/dev/zero", at("wall/endless.hdf5")).unwrap();
        symlink("nowhere", at("wall/gone.hdf5")).unwrap();
        std::fs::write(at("wall").join(std::ffi::OsStr::from_bytes(b"\xff.hdf5")), "x").unwrap();
        let (found, mut mistakes) = inputs(&[at("wall")]);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(["wall/a", "wall/b"].contains(&found[0].name.as_str()), "{found:?}");
        mistakes.sort();
        assert_eq!(mistakes.len(), 3, "{mistakes:?}");
        assert!(mistakes[0].ends_with("endless.hdf5: expected a file, found a device or a pipe"));
        assert!(mistakes[1].contains("gone.hdf5: No such file"), "{mistakes:?}");
        assert!(mistakes[2].ends_with("expected a path in UTF-8, found other bytes"));
    }

    #[test]
    fn roots_without_problems_are_named() {
        let dir = tempfile::tempdir().unwrap();
        let (found, mistakes) = inputs(&[dir.path().into(), dir.path().join("nowhere")]);
        assert!(found.is_empty());
        assert!(
            mistakes[0]
                .ends_with("expected problems (*.hdf5, *.toml, *.mtx, *.nl, *.dat), found none"),
            "{mistakes:?}"
        );
        assert!(mistakes[1].contains("nowhere: No such file"), "{mistakes:?}");
    }
}

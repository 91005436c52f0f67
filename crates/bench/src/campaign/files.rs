//! The problems of a campaign: files found under folders, with names that stay the same on every machine.

use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};

use nonsmooth_io::fclib;
use nonsmooth_problem::traits::Traits;
use sha2::{Digest, Sha256};

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

/// All `.hdf5` and `.h5` files under the given files and folders, each once, the smallest first.
///
/// Second: what is wrong with the roots, one line each: it does not exist, cannot be listed, or holds no problem.
pub fn inputs(roots: &[PathBuf]) -> (Vec<Input>, Vec<String>) {
    let mut mistakes = vec![];
    let mut found = BTreeMap::new();
    for root in roots {
        let before = mistakes.len();
        let mut here = vec![];
        walk(root, root, &mut here, &mut mistakes);
        if here.is_empty() && mistakes.len() == before {
            let root = root.display();
            mistakes.push(format!("{root}: expected problems (*.hdf5), found none"));
        }
        for path in here {
            // The same file may be reached from two roots.
            let real = path.canonicalize().unwrap_or_else(|_| path.clone());
            found.entry(real).or_insert(path);
        }
    }
    let parts: Vec<Vec<String>> = found.keys().map(|real| parts(real)).collect();
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
    let mut seen = HashSet::new();
    let mut inputs = vec![];
    for ((parts, depth), path) in parts.iter().zip(depth).zip(found.into_values()) {
        let name = tail(parts, depth);
        if !seen.insert(name.clone()) {
            // `a/b.h5` beside `a/b.hdf5`.
            let path = path.display();
            mistakes.push(format!("{path}: expected a name of its own, found `{name}` twice"));
            continue;
        }
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
    let bytes = std::fs::read(file).map_err(|e| format!("{}: {e}", file.display()))?;
    let digest = Sha256::digest(&bytes);
    let digest: String = digest.iter().take(8).map(|b| format!("{b:02x}")).collect();
    let content = fclib::read(file).map_err(|e| e.to_string())?;
    let traits = Traits::of(&content.problem, content.info.dofs);
    let finite = |x: f64| Some(x).filter(|x| x.is_finite());
    Ok(Problem {
        kind: traits.kind.name().into(),
        digest,
        contacts: traits.contacts,
        unknowns: traits.unknowns,
        dofs: traits.dofs,
        density: traits.density(),
        asymmetry: finite(traits.asymmetry),
        mu_min: finite(traits.mu.min),
        mu_max: finite(traits.mu.max),
        ..Problem::default()
    })
}

/// The folders and the name of a file, without extension.
fn parts(path: &Path) -> Vec<String> {
    let named = path.with_extension("");
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
    } else if path == root {
        // A file that is named is meant, whatever its extension.
        match std::fs::metadata(path) {
            Ok(_) => found.push(path.into()),
            Err(e) => mistakes.push(refused(e)),
        }
    } else if path.extension().is_some_and(|e| e == "hdf5" || e == "h5") {
        found.push(path.into());
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
        make("two/wall/notes.txt", 1);
        let all = [dir.path().to_path_buf(), dir.path().join("two/wall/b.h5")];
        let (found, mistakes) = inputs(&all);
        let names: Vec<_> = found.iter().map(|i| (i.name.as_str(), i.family.as_str())).collect();
        assert_eq!(names, [("wall/b", "wall"), ("two/wall/a", "wall"), ("one/wall/a", "wall")]);
        assert!(mistakes.is_empty());
    }

    #[test]
    fn roots_without_problems_are_named() {
        let dir = tempfile::tempdir().unwrap();
        let (found, mistakes) = inputs(&[dir.path().into(), dir.path().join("nowhere")]);
        assert!(found.is_empty());
        assert!(mistakes[0].ends_with("expected problems (*.hdf5), found none"), "{mistakes:?}");
        assert!(mistakes[1].contains("nowhere: No such file"), "{mistakes:?}");
    }
}

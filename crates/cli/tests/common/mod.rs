//! Runs the program in a folder of its own.
#![allow(dead_code)]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;
use tempfile::TempDir;

/// Says that a test did not run; past the capture of the output of tests.
pub fn skipped(why: &str) {
    let line = format!("SKIPPED: {why}\n");
    std::io::Write::write_all(&mut std::io::stderr(), line.as_bytes()).unwrap();
}

/// A folder and what is run in it.
pub struct Folder(TempDir);

/// What a run came to.
pub struct Run {
    /// The exit code.
    pub code: Option<i32>,
    /// The results.
    pub stdout: String,
    /// The errors.
    pub stderr: String,
}

impl Folder {
    /// An empty folder.
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    /// A folder with `wall.hdf5` (global) and `box.hdf5` (local, with a solution).
    pub fn with_problems() -> Self {
        let folder = Self::new();
        folder.run("gen wall --set rows=3 --set columns=2 --out wall.hdf5").exits(0);
        folder.run("gen sliding_box --form local --solve --out box.hdf5").exits(0);
        folder
    }

    /// A file of the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// The program in the folder.
    pub fn command(&self) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_nonsmooth"));
        command.current_dir(self.0.path());
        command
    }

    /// Runs the program with arguments that hold no blanks.
    pub fn run(&self, arguments: &str) -> Run {
        self.command().args(arguments.split_whitespace()).output().unwrap().into()
    }
}

impl AsRef<Path> for Folder {
    fn as_ref(&self) -> &Path {
        self.0.path()
    }
}

impl From<Output> for Run {
    fn from(output: Output) -> Self {
        Self {
            code: output.status.code(),
            stdout: String::from_utf8(output.stdout).unwrap(),
            stderr: String::from_utf8(output.stderr).unwrap(),
        }
    }
}

impl Run {
    /// It ends with `code`, and with not a word on stderr unless by mistake.
    pub fn exits(self, code: i32) -> Self {
        assert_eq!(self.code, Some(code), "{}{}", self.stdout, self.stderr);
        assert!(code == 2 || self.stderr.is_empty(), "{}", self.stderr);
        self
    }

    /// It is refused with one line that names `all`.
    pub fn refused(self, all: &[&str]) -> Self {
        let run = self.exits(2);
        assert_eq!(run.stderr.lines().count(), 1, "{}", run.stderr);
        assert!(run.stderr.starts_with("error: "), "{}", run.stderr);
        for part in all {
            assert!(run.stderr.contains(part), "{part} in {}", run.stderr);
        }
        run
    }

    /// Stdout as lines of JSON.
    pub fn json(&self) -> Vec<Value> {
        let parse = |line| serde_json::from_str(line).unwrap_or_else(|e| panic!("{e}: {line}"));
        self.stdout.lines().map(parse).collect()
    }
}

/// Each of the keys, `outer/inner` for those within, is there.
pub fn has_keys(value: &Value, keys: &str) {
    for key in keys.split_whitespace() {
        assert!(value.pointer(&format!("/{key}")).is_some(), "{key} in {value}");
    }
}

//! A run in one file and parts beside it, so that writing what is new costs no more than what is new.
//!
//! Beside `run.h5` stands, while the run goes on, the folder `run.h5.parts` with files `STEP.h5` named by their first step, each a trajectory of its own whose scene is
//! `part of SHA-256`. As in a log-structured merge tree, parts of like size are joined to a larger one, eight at a time: n flushes leave some 7 log₈ n files, and each row is
//! written some log₈ n times. A part is made beside its place and renamed, and only then are those removed that it covers; reading passes over what is covered already. So at every
//! moment file and parts together are the run up to some flush.

use std::path::{Path, PathBuf};

use super::write::View;
use super::{Frame, Step, Trajectory, digest, write};
use crate::IoError;
use crate::replace::{WRITABLE, clean};

/// So many parts of like size are joined.
const LIKE: usize = 8;

/// How often the folder of parts is read anew while somebody writes there.
const AGAIN: usize = 100;

/// Writes a run as it grows.
#[derive(Debug)]
pub struct Writer {
    path: PathBuf,
    /// Whether the file that stands there is the beginning of the run.
    resumed: bool,
    /// Whether the file is written.
    begun: bool,
    parts: Vec<Part>,
    /// What file and parts have together.
    reached: Extent,
}

/// How much of a run a file reaches.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Extent {
    frames: usize,
    steps: usize,
}

#[derive(Debug)]
struct Part {
    from: Extent,
    /// How many flushes are in it: a power of [`LIKE`].
    flushes: usize,
    file: PathBuf,
}

impl Writer {
    /// Writes to a file; `resumed` if what stands there, with its parts, is the beginning of the run, so that nothing of it is removed before it is written anew.
    pub fn new(path: impl Into<PathBuf>, resumed: bool) -> Self {
        Self { path: path.into(), resumed, begun: false, parts: vec![], reached: Extent::default() }
    }

    /// Writes what came since the last call: into a part beside the file, or the first time the file itself. The steps of `run` must be those of the last call and more.
    /// Costs time in proportion to what is new, times the logarithm of the number of calls on average.
    ///
    /// Errors: as of [`Trajectory::write`].
    pub fn flush(&mut self, run: &Trajectory) -> Result<(), IoError> {
        if !self.begun {
            return self.whole(run);
        }
        let all = Extent { frames: run.frames.len(), steps: run.steps.len() };
        if all.steps == self.reached.steps {
            return Ok(());
        }
        // Where as many parts of a size are there as are joined, the new one begins with the first of them, and so on with the next size.
        let (mut kept, mut flushes) = (self.parts.len(), 1);
        while kept + 1 >= LIKE
            && self.parts[kept + 1 - LIKE..kept].iter().all(|p| p.flushes == flushes)
        {
            kept -= LIKE - 1;
            flushes *= LIKE;
        }
        let from = self.parts.get(kept).map_or(self.reached, |part| part.from);
        let folder = folder(&self.path);
        std::fs::create_dir_all(&folder).map_err(|e| IoError::os(&folder, WRITABLE, e))?;
        let file = folder.join(format!("{:012}.h5", run.steps[from.steps].number));
        let scene = reference(&run.digest());
        let view = View {
            scene: &scene,
            frames: &run.frames[from.frames..],
            steps: &run.steps[from.steps..],
            ..run.into()
        };
        crate::format::put(&file, &write::to_bytes(&file, &view)?)?;
        for part in self.parts.drain(kept..).filter(|part| part.file != file) {
            // What is left is covered, and passed over.
            let _ = std::fs::remove_file(part.file);
        }
        self.parts.push(Part { from, flushes, file });
        self.reached = all;
        Ok(())
    }

    /// Writes the whole file and removes the parts.
    ///
    /// Errors: as of [`Trajectory::write`].
    pub fn finish(&mut self, run: &Trajectory) -> Result<(), IoError> {
        self.whole(run)
    }

    fn whole(&mut self, run: &Trajectory) -> Result<(), IoError> {
        // Parts of another run must not be taken for those of this one.
        if !self.begun && !self.resumed {
            remove(&self.path);
        }
        run.write(&self.path)?;
        self.parts.clear();
        self.begun = true;
        self.reached = Extent { frames: run.frames.len(), steps: run.steps.len() };
        Ok(())
    }
}

/// What a part has in place of the scene.
fn reference(digest: &str) -> String {
    format!("part of {digest}")
}

/// Where the parts of a file are.
fn folder(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".parts");
    name.into()
}

/// The parts beside a file in the order of their first steps.
fn beside(path: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder(path)).into_iter().flatten().flatten();
    let mut found: Vec<(u64, PathBuf)> = entries
        .filter_map(|entry| {
            let name = entry.file_name();
            let first = name.to_str()?.strip_suffix(".h5")?;
            let digits = first.len() == 12 && first.bytes().all(|c| c.is_ascii_digit());
            digits.then(|| Some((first.parse().ok()?, entry.path())))?
        })
        .collect();
    found.sort();
    found.into_iter().map(|(_, file)| file).collect()
}

/// Removes the parts of a file. That they cannot be is no mistake: what a file covers is passed over.
pub(super) fn remove(path: &Path) {
    for file in beside(path) {
        let _ = std::fs::remove_file(file);
    }
    let folder = folder(path);
    // A part that a killed writer had begun; whatever else stands there stays.
    clean(&folder);
    let _ = std::fs::remove_dir(folder);
}

/// Between the steps of a run and those of its next part: the last before it and the first after it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Gap {
    done: u64,
    first: u64,
}

/// Adds what stands in parts beside a file, also while these are written. Where file and folder changed in between there may be a gap, and both have to be read
/// anew; `known` is the gap of the time before, and where it is there again no writer has made it.
pub(super) fn join(
    path: &Path,
    run: &mut Trajectory,
    known: Option<Gap>,
) -> Result<Option<Gap>, IoError> {
    let scene = reference(&digest(&run.scene));
    let last = |steps: &[Step]| steps.last().map_or(0, |step| step.number);
    let mut files = beside(path).into_iter();
    // A part that has gone is covered by one that was not there when the folder was read.
    let mut again = AGAIN;
    while let Some(file) = files.next() {
        let bytes = match crate::format::bytes(&file) {
            Err(_) if again > 0 && !file.exists() => {
                again -= 1;
                files = beside(path).into_iter();
                continue;
            }
            bytes => bytes?,
        };
        let part = Trajectory::parse(&file, &bytes)?;
        let (done, first) = (last(&run.steps), part.steps.first().map_or(0, |step| step.number));
        if part.scene != scene || part.program != run.program || last(&part.steps) <= done {
            continue;
        }
        let gap = (first > done + 1).then_some(Gap { done, first });
        if gap.is_some() && gap != known {
            return Ok(gap);
        }
        if gap.is_some()
            || part.bodies != run.bodies
            || part.joints != run.joints
            || part.elastic != run.elastic
        {
            let expected = format!("a part of the same run that goes on after step {done}");
            return Err(IoError::data(&file, "/steps/number", expected, first));
        }
        let seen = run.frames.last().map(|frame| frame.step);
        let fresh = |frame: &Frame| seen.is_none_or(|seen| frame.step > seen);
        run.frames.extend(part.frames.into_iter().filter(fresh));
        run.steps.extend(part.steps.into_iter().filter(|step| step.number > done));
        run.checkpoint = part.checkpoint;
    }
    Ok(None)
}

//! What a campaign and its workers say to each other: one [`Job`] in, lines of [`Said`] out, as JSON.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::record::{Problem, Run};

/// What a worker is to do.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Job {
    /// The file of the problem.
    pub file: PathBuf,
    /// What to do with it.
    pub task: Task,
    /// Bytes of memory that the process may take.
    pub memory_limit: u64,
    /// The processors to stay on; any, where empty.
    pub processors: Vec<usize>,
}

/// What to do with a problem.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Task {
    /// Say what it is.
    Describe,
    /// Solve it.
    Solve {
        /// The solver's label.
        solver: String,
        /// The relative residual to reach.
        tolerance: f64,
        /// Seconds that a solve may take.
        time_limit: f64,
        /// Timed solves, after one to warm up.
        repeats: u32,
        /// Seconds from which on a solve is not repeated.
        repeat_below: f64,
        /// Keep the residual against time.
        trace: bool,
    },
}

/// What a worker says.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Said {
    /// The file cannot be used, for the reason given. The last word.
    Unreadable(String),
    /// What the problem is; name and family are left to the campaign. The last word on [`Task::Describe`].
    Described(Problem),
    /// The problem is read; preparing the judge took so many seconds.
    Loaded {
        /// Seconds that the judge needs before each solve.
        judge: f64,
    },
    /// The solver does not take the problem, for the reason given. The last word.
    Refused(String),
    /// A solve begins.
    Solving,
    /// A sign of life during a solve, at most one a second.
    Progress {
        /// Steps done.
        iteration: u64,
        /// Seconds of the solve.
        seconds: f64,
        /// The smallest residual so far, if any is finite.
        best: Option<f64>,
    },
    /// The result, with nothing said of what was run on what: the campaign knows. The last word.
    Done(Box<Run>),
}

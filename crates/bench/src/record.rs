//! What a campaign writes down: one line of JSON for the campaign, one for each problem, one for each run.
//!
//! The format is open to other programs: every field is named, unknown fields are passed over, and fields that are
//! not known are left out. Numbers that are not finite are left out too: JSON has none.

use serde::{Deserialize, Serialize};

/// The name of the format, in the first line of every file.
pub const FORMAT: &str = "nonsmooth-runs";

/// The version of the format. Files of another version are refused by name.
pub const VERSION: u32 = 1;

/// One line of a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "line", rename_all = "snake_case")]
pub enum Line {
    /// Who measured, on what machine, and how. Stands before the runs that name it.
    Campaign(Campaign),
    /// A problem. Stands before its runs.
    Problem(Problem),
    /// A run: one problem, one solver, one tolerance.
    Run(Box<Run>),
}

/// Who measured, on what machine, and how.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Campaign {
    /// [`FORMAT`].
    pub format: String,
    /// [`VERSION`].
    pub version: u32,
    /// A name for this campaign on this machine, unlike that of any other.
    pub id: String,
    /// The program that was measured, with its version.
    pub program: String,
    /// Whether another program was measured by other means: its times and residuals are its own word.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub foreign: bool,
    /// The start, in seconds since 1970.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub started: Option<u64>,
    /// The machine.
    pub machine: Machine,
    /// What is measured, and how.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plan: Option<Plan>,
}

/// The machine that measured. Empty texts and zeros: not known.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Machine {
    /// The processor's name, or all there is to say of the machine.
    pub cpu: String,
    /// Physical cores.
    pub cores: usize,
    /// Bytes of memory.
    pub memory: u64,
    /// The operating system.
    pub os: String,
}

/// What a campaign measures, and how. Two campaigns with equal plans can be joined.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Labels of solvers: a name, perhaps with settings, as `nsgs:local=quartic,omega=0.9`.
    pub solvers: Vec<String>,
    /// Relative residuals to reach.
    pub tolerances: Vec<f64>,
    /// Seconds of wall clock that a solve may take.
    pub time_limit: f64,
    /// Bytes of memory that a run may take.
    pub memory_limit: u64,
    /// Timed solves of a run, after one to warm up; the fastest counts. Very short solves are repeated more often.
    pub repeats: u32,
    /// Seconds from which on a solve is not repeated: then the first one counts.
    pub repeat_below: f64,
    /// Whether the residual against time is kept.
    pub trace: bool,
    /// Runs at a time.
    pub jobs: usize,
    /// `(i, n)`: this is part i of n, counted from 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shard: Option<(usize, usize)>,
}

impl Plan {
    /// What keeps runs of another plan from being measured in the same way, in words: anything but solvers, tolerances
    /// and jobs.
    pub fn difference(&self, other: &Plan) -> Option<String> {
        let shard = |plan: &Plan| plan.shard.map_or("none".into(), |(i, n)| format!("{i}/{n}"));
        let of = |plan: &Plan| {
            [
                ("a time limit of", plan.time_limit.to_string()),
                ("a memory limit of", plan.memory_limit.to_string()),
                ("repeats", plan.repeats.to_string()),
                ("repeats below seconds of", plan.repeat_below.to_string()),
                ("traces", plan.trace.to_string()),
                ("shard", shard(plan)),
            ]
        };
        let mut pairs = of(self).into_iter().zip(of(other));
        let ((what, expected), (_, found)) = pairs.find(|(a, b)| a != b)?;
        Some(format!("{what} {expected}, found {found}"))
    }
}

/// A problem, described before anything is run on it.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Problem {
    /// `family/name`: the folder and the name of the file, without extension.
    pub name: String,
    /// The folder that holds the file.
    pub family: String,
    /// The kind, such as `friction_local_3d`; empty where it is not known.
    pub kind: String,
    /// The first 16 hexadecimal digits of the file's SHA-256; empty where it is not known.
    pub digest: String,
    /// Contacts nc; of a complementarity problem its pairs.
    pub contacts: usize,
    /// Unknowns.
    pub unknowns: usize,
    /// Degrees of freedom n.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dofs: Option<usize>,
    /// Contact density c = D nc / n.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub density: Option<f64>,
    /// Relative asymmetry of W or M.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub asymmetry: Option<f64>,
    /// The least coefficient of friction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mu_min: Option<f64>,
    /// The largest coefficient of friction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mu_max: Option<f64>,
    /// Why it cannot be read; then there are no runs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
}

/// How a run ended.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize,
)]
#[serde(rename_all = "snake_case")]
pub enum Ending {
    /// The judge accepts the answer. For foreign runs: the program's own error is at most the tolerance.
    Solved,
    /// There is no solution: proved, and the judge has verified the proof.
    Infeasible,
    /// There is no solution up to rounding, or by a foreign program's word: not proved.
    NearlyInfeasible,
    /// The solver ended on a ray that proves nothing.
    NoConclusion,
    /// Iterations ran out.
    IterationLimit,
    /// The solver was told to stop when its time was over, and did.
    TimeLimit,
    /// The solver could not go on, or its claim to have finished failed the check.
    Stalled,
    /// The solver does not take this kind of problem, or refused it.
    Refused,
    /// The process did not stop when its time was over, and was ended.
    Hung,
    /// The process ran into the limit of memory.
    OutOfMemory,
    /// The process died.
    Crashed,
    /// A failure of which no more is known, such as a foreign program's.
    #[default]
    Failed,
}

impl Ending {
    /// Every ending, in the order of the tables.
    pub const ALL: [Ending; 12] = [
        Ending::Solved,
        Ending::Infeasible,
        Ending::NearlyInfeasible,
        Ending::NoConclusion,
        Ending::IterationLimit,
        Ending::TimeLimit,
        Ending::Stalled,
        Ending::Refused,
        Ending::Hung,
        Ending::OutOfMemory,
        Ending::Crashed,
        Ending::Failed,
    ];

    /// Whether it is an answer: a solution, or a proof that there is none.
    pub fn answers(self) -> bool {
        matches!(self, Ending::Solved | Ending::Infeasible)
    }

    /// The name in files, such as `out_of_memory`.
    pub fn name(self) -> &'static str {
        match self {
            Ending::Solved => "solved",
            Ending::Infeasible => "infeasible",
            Ending::NearlyInfeasible => "nearly_infeasible",
            Ending::NoConclusion => "no_conclusion",
            Ending::IterationLimit => "iteration_limit",
            Ending::TimeLimit => "time_limit",
            Ending::Stalled => "stalled",
            Ending::Refused => "refused",
            Ending::Hung => "hung",
            Ending::OutOfMemory => "out_of_memory",
            Ending::Crashed => "crashed",
            Ending::Failed => "failed",
        }
    }
}

/// The judge's residuals of the answer (see `nonsmooth_problem::check::Measure` for the formulas). A foreign program's
/// own error stands as `reached`, and under the definition that it uses if that is one of these.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Residuals {
    /// The smallest tolerance at which the answer passes every criterion.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reached: Option<f64>,
    /// The relative residual.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relative: Option<f64>,
    /// In velocity units, m/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub absolute: Option<f64>,
    /// The natural map with ρ = 1 over ‖q‖.
    #[serde(alias = "paper", skip_serializing_if = "Option::is_none")]
    pub literature: Option<f64>,
    /// The same over max(‖q‖, ‖r‖, ‖u‖), as Siconos has it.
    #[serde(alias = "peer", skip_serializing_if = "Option::is_none")]
    pub siconos: Option<f64>,
    /// Distance of the impulses to their cones.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub primal: Option<f64>,
    /// Distance of the velocities to the dual cones.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dual: Option<f64>,
    /// Complementarity.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub complementarity: Option<f64>,
    /// Dynamics, of global problems.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dynamics: Option<f64>,
    /// Bilateral constraints.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bilateral: Option<f64>,
}

/// A run: one problem, one solver, one tolerance.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Run {
    /// The [`Campaign::id`] that it belongs to.
    pub campaign: String,
    /// [`Problem::name`].
    pub problem: String,
    /// [`Problem::digest`].
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub digest: String,
    /// [`Problem::family`].
    #[serde(default)]
    pub family: String,
    /// [`Problem::kind`].
    #[serde(default)]
    pub kind: String,
    /// [`Problem::contacts`].
    #[serde(default)]
    pub contacts: usize,
    /// The solver's label, as in [`Plan::solvers`].
    pub solver: String,
    /// The relative residual to reach.
    pub tolerance: f64,
    /// How it ended.
    pub ending: Ending,
    /// More on how it ended.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub message: Option<String>,
    /// Iterations of the solve that counts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub iterations: Option<u64>,
    /// Factorisations of matrices that grow with the problem, set-up included.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub factorisations: Option<u64>,
    /// Wall clock of the fastest solve, s: set-up of the workspace and steps, but no reading of files and no final
    /// judgement. Of a run that was ended from outside: until then, at least.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seconds: Option<f64>,
    /// The median of the timed solves, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seconds_median: Option<f64>,
    /// The slowest timed solve, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seconds_max: Option<f64>,
    /// Timed solves.
    #[serde(default)]
    pub repeats: u32,
    /// Processor time of the fastest solve, all threads, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cpu_seconds: Option<f64>,
    /// The most memory that the process ever held, bytes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub peak_memory: Option<u64>,
    /// The same before the first solve: the program, the problem and the judge.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub loaded_memory: Option<u64>,
    /// The judge's residuals.
    #[serde(default)]
    pub residuals: Residuals,
    /// `(iteration, seconds, residual)` at the judge's visits, on request.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub trace: Vec<(u64, f64, f64)>,
}

impl Run {
    /// Whether it counts as solved: the judge accepts the answer, or the proof that there is none.
    pub fn solved(&self) -> bool {
        self.ending.answers()
    }

    /// The residual down to which it answers the problem: what it reached; 0 for a proof that there is no solution, none
    /// for a refusal.
    pub fn reached(&self) -> Option<f64> {
        match self.ending {
            Ending::Infeasible => Some(0.0),
            Ending::Refused => None,
            _ => self.residuals.reached,
        }
    }

    /// What makes it one run among those of a plan.
    pub fn key(&self) -> Key {
        Key {
            problem: self.problem.clone(),
            solver: self.solver.clone(),
            tolerance: self.tolerance.to_bits(),
        }
    }
}

/// What makes a run one among those of a plan.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Key {
    /// [`Run::problem`].
    pub problem: String,
    /// [`Run::solver`].
    pub solver: String,
    /// The bits of [`Run::tolerance`].
    pub tolerance: u64,
}

/// The classes of size, by number of contacts, that the literature on interior points uses.
pub const SIZES: [Size; 4] = [
    Size { name: "1-10", least: 0, most: 10 },
    Size { name: "11-100", least: 11, most: 100 },
    Size { name: "101-1000", least: 101, most: 1000 },
    Size { name: "over 1000", least: 1001, most: usize::MAX },
];

/// A class of size.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size {
    /// Its name.
    pub name: &'static str,
    /// The fewest contacts.
    pub least: usize,
    /// The most contacts.
    pub most: usize,
}

impl Size {
    /// The class of a problem with so many contacts.
    pub fn of(contacts: usize) -> Size {
        SIZES.into_iter().find(|s| contacts <= s.most).unwrap_or(SIZES[3])
    }
}

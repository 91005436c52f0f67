//! The program as AMPL calls it: `NAME stub -AMPL key=value …` reads `stub.nl` and answers in `stub.sol`.
//!
//! NAME is that of the program's file, so that a link called `pathampl` is what Pyomo looks for as `path`. Options come from the variables `nonsmooth_options`,
//! `BASE_options` and `NAME_options` of the environment (BASE is NAME without `ampl`), then from the arguments; the last of a key counts. With `-AMPL` the exit code is
//! 0 whenever there is an answer: how the solve ended stands in the `.sol`.

mod options;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};
use std::time::Instant;

use nonsmooth_io::nl::{Echo, Model, Solution};
use nonsmooth_io::{IoError, nl};
use nonsmooth_problem::{AnyPoint, AnyProblem};
use nonsmooth_solve::{Limit, Status};

use crate::solve::{Plan, Solved, limits, solve};
use crate::{Exit, files, output};
use options::{KEYS, Options, pairs_in, pairs_of};

/// Numbers of results, after the driver of the solver PATH.
mod result {
    pub const SOLVED: u16 = 0;
    pub const INFEASIBLE: u16 = 201;
    pub const ITERATIONS: u16 = 400;
    pub const TIME: u16 = 402;
    pub const INTERRUPTED: u16 = 403;
    pub const ERROR: u16 = 501;
    pub const UNDEFINED: u16 = 503;
    pub const NO_PROGRESS: u16 = 510;
}

/// Whether arguments are those of AMPL's calls: with `-AMPL`, or the question for the version that Pyomo asks.
pub fn calls(arguments: &[String]) -> bool {
    let asks = matches!(arguments, [_, flag] if flag == "-v" || flag == "-=");
    asks || arguments.iter().skip(2).any(|word| word == "-AMPL")
}

/// What stands before and behind the stub.
#[derive(Debug, Default, PartialEq)]
struct Call {
    /// What is asked for in place of a solve.
    question: Option<char>,
    /// Whether options are repeated.
    silent: bool,
    /// Whether a `.sol` is wanted without `-AMPL`.
    writes: bool,
    solution: Option<PathBuf>,
    bounds: Option<PathBuf>,
    stub: Option<String>,
    ampl: bool,
    words: Vec<String>,
}

impl Call {
    fn new(arguments: &[String]) -> Result<Self, String> {
        let mut call = Self::default();
        let mut words = arguments.iter();
        let mut flags = true;
        for word in words.by_ref() {
            let flag = word.strip_prefix('-').filter(|_| flags);
            let value = |flag: &str, name: char| {
                let value = flag.strip_prefix(name).filter(|v| !v.is_empty())?;
                Some(PathBuf::from(value))
            };
            match flag {
                Some("-") => flags = false,
                Some("v") => call.question = Some('v'),
                Some("=") => call.question = Some('='),
                Some("?" | "-help" | "h") => call.question = Some('?'),
                Some("e") => call.silent = true,
                Some("s") => call.writes = true,
                Some(flag) if value(flag, 'o').is_some() => call.solution = value(flag, 'o'),
                Some(flag) if value(flag, 'b').is_some() => call.bounds = value(flag, 'b'),
                Some(_) => {
                    let known = "-v, -=, -?, -e, -s, -oFILE, -bFILE or -- before the stub";
                    return Err(format!("expected {known}, found `{word}`"));
                }
                None => {
                    call.stub = Some(word.clone());
                    break;
                }
            }
        }
        call.words = words.cloned().collect();
        if call.words.first().is_some_and(|word| word == "-AMPL") {
            call.ampl = true;
            call.words.remove(0);
        }
        Ok(call)
    }
}

/// Runs a call: the name of the program and its arguments.
///
/// Errors: unknown flags, a file that cannot be read or is not as the format says, an answer that cannot be written.
pub fn run(arguments: &[String]) -> Result<Exit, String> {
    let begun = Instant::now();
    let (program, arguments) = arguments.split_first().ok_or("expected the name of the program")?;
    let name = Path::new(program).file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let call = Call::new(arguments)?;
    let version = format!("{name} {} (nonsmooth)\n", env!("CARGO_PKG_VERSION"));
    match (call.question, &call.stub) {
        (Some('v'), _) => output::print(&version),
        (Some('='), _) => {
            KEYS.iter().for_each(|(key, means)| output::print(&format!("{key:22} {means}\n")));
        }
        (Some(_), _) => output::print(&usage(&name)),
        (None, None) => {
            return Err(format!("expected a stub, found none; {}", usage(&name).trim()));
        }
        (None, Some(stub)) => return answer(&name, stub, &call, &version, begun),
    }
    Ok(Exit::Solved)
}

fn usage(name: &str) -> String {
    format!(
        "usage: {name} [-v] [-=] [-?] [-e] [-s] [-oFILE] [-bFILE] [--] stub[.nl] [-AMPL] [key=value ...]\n"
    )
}

/// The variables of the environment that hold options, the last being the most particular.
fn variables(name: &str) -> Vec<String> {
    let base = name.strip_suffix("ampl").unwrap_or(name).trim_end_matches(['-', '_']);
    let mut all = vec!["nonsmooth_options".to_owned()];
    for name in [base, name] {
        let variable = format!("{name}_options");
        if !base.is_empty() && !all.contains(&variable) {
            all.push(variable);
        }
    }
    all
}

/// Solves and answers.
fn answer(
    name: &str,
    stub: &str,
    call: &Call,
    version: &str,
    begun: Instant,
) -> Result<Exit, String> {
    let base = stub.strip_suffix(".nl").unwrap_or(stub);
    let with = |extension: &str| PathBuf::from(format!("{base}.{extension}"));
    let file = if with("nl").exists() { with("nl") } else { stub.into() };
    let solution = call.solution.clone().unwrap_or(with("sol"));
    let read = [Some(file.as_path()), call.bounds.as_deref()];
    files::apart(read.into_iter().flatten(), [("-o", solution.as_path())])?;
    let mut pairs = vec![];
    let mut mistake = None;
    for variable in variables(name) {
        let text = std::env::var(&variable).unwrap_or_default();
        match pairs_of(&text) {
            Ok(more) => pairs.extend(more),
            Err(e) => mistake = Some(format!("{variable}: {e}")),
        }
    }
    match pairs_in(&call.words) {
        Ok(more) => pairs.extend(more),
        Err(e) => mistake = Some(e),
    }
    let mut options = Options::default();
    mistake = mistake.or(options.set(&pairs).err());
    if options.version {
        output::print(version);
    }
    if !call.silent && std::env::var("solver_msg").as_deref() != Ok("0") {
        let said = pairs.iter().filter(|(_, value)| !value.is_empty());
        said.for_each(|(key, value)| output::print(&format!("{key}={value}\n")));
    }
    let said = match (Model::read_within(&file, call.bounds.as_deref(), &options.model), mistake) {
        (Ok(model), mistake) => {
            let Model { problem, names, echo, remarks, .. } = model;
            let mut said = Said { x: vec![], ..Said::error("", &echo) };
            match mistake {
                Some(e) => said.message = format!("Error: {e}"),
                None => {
                    let undefined = problem_is_undefined(&problem);
                    said.of(solved(&file, &problem.into(), &options, begun), undefined);
                }
            }
            said.remarks.extend(remarks);
            said.names = names;
            said
        }
        (Err(nl::Refusal { error, answer: None }), _) => return Err(error.to_string()),
        (Err(nl::Refusal { error, answer: Some(answer) }), mistake) => {
            let (echo, result) = *answer;
            let (message, result) = match mistake {
                Some(e) => (e, result::ERROR),
                None => (error.to_string(), result),
            };
            Said { result, ..Said::error(&message, &echo) }
        }
    };
    let mut message = format!("{name}: {}", said.message);
    let ignored = options.ignored.iter().map(|key| format!("{key} has no meaning here"));
    for remark in ignored.chain(said.remarks.iter().cloned()) {
        message += &format!("\n{remark}");
    }
    if call.ampl || call.writes || options.wantsol & 1 != 0 {
        let written =
            Solution { echo: &said.echo, message: &message, x: &said.x, result: said.result };
        written.write(&solution).map_err(|e: IoError| e.to_string())?;
    }
    let shown = match call.ampl {
        // Pyomo shows a user nothing of a message that refuses.
        true => said.result >= result::ERROR,
        false => options.wantsol & 8 == 0,
    };
    if shown {
        output::print(&format!("{message}\n"));
    }
    if !call.ampl && options.wantsol & 2 != 0 {
        for (j, x) in said.x.iter().enumerate() {
            let name = said.names.get(j).cloned().unwrap_or_else(|| format!("_svar[{}]", j + 1));
            output::print(&format!("{name:22} {x:?}\n"));
        }
    }
    Ok(Exit::Solved)
}

/// What is answered.
struct Said {
    message: String,
    result: u16,
    x: Vec<f64>,
    names: Vec<String>,
    remarks: Vec<String>,
    echo: Echo,
}

impl Said {
    fn error(message: &str, echo: &Echo) -> Self {
        Self {
            message: format!("Error: {message}"),
            result: result::ERROR,
            x: vec![],
            names: vec![],
            remarks: vec![],
            echo: echo.clone(),
        }
    }

    /// What came of the solve of a problem whose function is perhaps not defined at the start.
    fn of(&mut self, solved: Result<Solved, String>, undefined: bool) {
        let solved = match solved {
            Ok(solved) => solved,
            Err(e) => {
                self.message = format!("Error: {e}");
                return;
            }
        };
        let (result, text) = match &solved.status {
            Status::Solved => (result::SOLVED, "Solution found.".to_owned()),
            status if status.refutes() => (result::INFEASIBLE, format!("No solution: {status}.")),
            Status::Limit(Limit::Iterations) => {
                (result::ITERATIONS, "Major iteration limit.".into())
            }
            Status::Limit(Limit::Time) => (result::TIME, "Time limit.".into()),
            Status::Limit(Limit::Cancelled) => (result::INTERRUPTED, "User interrupt.".into()),
            status if undefined => {
                (result::UNDEFINED, format!("Domain error at the start: {status}."))
            }
            status => (result::NO_PROGRESS, format!("No progress: {status}.")),
        };
        let (iterations, factorisations) = (solved.iterations, solved.factorisations);
        self.message = format!(
            "{text}\n{iterations} iterations; {factorisations} factorisations.\nRelative residual {:.1e}.",
            solved.verdict.measure.relative
        );
        self.result = result;
        if let AnyPoint::Lcp(point) = &solved.point {
            // Multipliers of side inequalities are no variables of the file.
            self.x = point.z.iter().take(self.echo.variables).copied().collect();
        }
    }
}

fn solved(
    file: &Path,
    problem: &AnyProblem,
    options: &Options,
    begun: Instant,
) -> Result<Solved, String> {
    let limits = limits(options.tolerance, options.iterations, options.seconds)?;
    let plan = Plan {
        solver: &options.solver,
        settings: &options.settings,
        limits,
        begun,
        progress: false,
    };
    solve(file, problem, None, &plan).map_err(|e| {
        let unknown = options.settings.keys().find(|key| e.contains(&format!("`{key}`")));
        let meant = unknown.map_or_else(String::new, |key| Options::meant(key));
        e + &meant
    })
}

/// Whether F has no value where the solve begins.
fn problem_is_undefined(problem: &nonsmooth_problem::Mcp) -> bool {
    let x = nonsmooth_problem::Problem::origin(problem).z;
    !problem.F.evaluator().value(&x, &mut vec![0.0; x.len()])
}

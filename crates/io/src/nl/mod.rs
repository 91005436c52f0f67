//! AMPL's files: models (`.nl`, read as text and binary, written as text) and the solutions that answer them (`.sol`).
//!
//! A file states rows `c_i(x) = e_i(x) + Σ_j a_ij x_j`, each of them an equation `c_i(x) = v`, an inequality, or *complementary* to a variable x_j whose bounds it
//! shares:
//!
//! ```text
//! l_j ≤ x_j ≤ u_j:  c_i(x) ≥ 0 where x_j = l_j,  c_i(x) ≤ 0 where x_j = u_j,  c_i(x) = 0 between
//! ```
//!
//! That is the row `F_j` of an [`Mcp`]; F has its rows in the order of the variables. `docs/nonlinear/nl.md` says what is read, how rows and variables are paired and
//! what is refused.
//!
//! | file | what |
//! | --- | --- |
//! | `input`, `header`, `read` | letters and numbers; the ten lines of the header; the segments |
//! | `operators`, `expression` | the table of operators; expressions in prefix notation |
//! | `pairing` | which row belongs to which variable |
//! | `write`, `sol` | models and solutions |
//!
//! Formats after the public descriptions of AMPL's solver library (`jac0dim`, `fg_read`, `writesol`) and of Pyomo.

mod expression;
mod header;
mod input;
mod operators;
mod pairing;
mod read;
mod sol;
mod write;

use std::path::{Path, PathBuf};

use nonsmooth_problem::{AnyPoint, AnyProblem, Complementarity, Kind, LcpPoint, Mcp, Problem};

use crate::error::one_line;
use crate::format::{About, bytes, put};
use crate::{Format, Info, IoError, ProblemFile};

pub use header::Echo;
pub use input::Form;
pub use pairing::Refusal;
pub use sol::Solution;

/// How a file is understood.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Whether inequalities without a variable become rows with multipliers of their own: else they are refused.
    pub side_inequalities: bool,
    /// The modulus from which on bounds are infinite.
    pub infinity: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self { side_inequalities: false, infinity: 1e20 }
    }
}

/// A model as an MCP.
#[derive(Debug, Clone)]
pub struct Model {
    /// The problem. Its first variables are those of the file, in their order; multipliers of side inequalities follow.
    pub problem: Mcp,
    /// The title in the first line.
    pub title: Option<String>,
    /// The names of the variables, from the file `.col` beside the model; empty: none.
    pub names: Vec<String>,
    /// What a solution repeats.
    pub echo: Echo,
    /// What is odd in the file, and how it is understood.
    pub remarks: Vec<String>,
}

/// Names from files beside a model.
#[derive(Debug, Clone, Default)]
struct Names {
    variables: Vec<String>,
    rows: Vec<String>,
}

impl Model {
    /// Reads a file, and the names in the files `.col` and `.row` beside it.
    ///
    /// Errors: what the system refuses; whatever is not as the format says, by line or byte; what is no MCP.
    pub fn read(path: &Path, options: &Options) -> Result<Self, Refusal> {
        Self::read_within(path, None, options)
    }

    /// As [`read`](Self::read), with bounds from a file of triples `variable lower upper`, variables counted from 0, in place of those of the model.
    ///
    /// Errors: likewise, of either file.
    pub fn read_within(
        path: &Path,
        bounds: Option<&Path>,
        options: &Options,
    ) -> Result<Self, Refusal> {
        Self::with_names(path, &bytes(path)?, bounds, options, |echo| Names {
            variables: names(&path.with_extension("col"), echo.variables),
            rows: names(&path.with_extension("row"), echo.rows),
        })
    }

    /// As [`read`](Self::read), of the bytes of a file without names; `path` stands for it in messages.
    ///
    /// Errors: likewise.
    pub fn parse(path: &Path, bytes: &[u8], options: &Options) -> Result<Self, Refusal> {
        Self::with_names(path, bytes, None, options, |_| Names::default())
    }

    fn with_names(
        path: &Path,
        bytes: &[u8],
        bounds: Option<&Path>,
        options: &Options,
        names: impl Fn(&Echo) -> Names,
    ) -> Result<Self, Refusal> {
        let mut contents = read::contents(path, bytes, options.infinity)?;
        if let Some(bounds) = bounds {
            // Before rows and variables are paired: which bounds are conditions of their own goes by them.
            contents.rebound(bounds, options.infinity).map_err(|error| Refusal {
                error: Box::new(error),
                answer: Some(Box::new((contents.echo.clone(), pairing::MISSTATED))),
            })?;
        }
        let names = names(&contents.echo);
        pairing::model(path, contents, names, options)
    }

    /// As files of any format.
    fn file(self) -> ProblemFile {
        let info = Info { title: self.title, names: self.names, ..Info::default() };
        ProblemFile { info, ..ProblemFile::new(self.problem) }
    }
}

/// The lines of a file that has one for each of n things; objectives may follow those of rows.
fn names(path: &Path, n: usize) -> Vec<String> {
    if !path.is_file() {
        return vec![];
    }
    let text = bytes(path).map(|b| String::from_utf8_lossy(&b).into_owned()).unwrap_or_default();
    let names: Vec<_> = text.lines().map(|line| line.trim().to_owned()).take(n).collect();
    if names.len() == n { names } else { vec![] }
}

/// The format, with names in the file `.col` beside it and the solution in `.sol`, each written too where there is one. A `.sol` that answers another model is passed by.
///
/// Errors: whatever is not as the format says, by line or byte; what is no MCP: inequalities without a variable, not as many rows as variables, discrete variables,
/// logical constraints, external functions. Written: a function that is not made of expressions.
#[derive(Debug, Clone, Copy)]
pub struct Nl;

impl Format for Nl {
    fn about(&self) -> &'static About {
        const ABOUT: About = About {
            name: "AMPL's model",
            extensions: &["nl"],
            reads: &[Kind::Mcp],
            writes: &[Kind::Mcp],
            solution: "a .sol beside the file",
            ..About::TEXT
        };
        &ABOUT
    }

    /// With `g` or `b` and the number of options.
    fn begins(&self, bytes: &[u8]) -> bool {
        let line = bytes.split(|&b| b == b'\n').next().unwrap_or_default();
        let options = line.strip_prefix(b"g").or(line.strip_prefix(b"b")).unwrap_or_default();
        let numbers = options.split(|&b| b == b'#').next().unwrap_or_default();
        let plain = |b: &u8| b.is_ascii_digit() || b.is_ascii_whitespace() || *b == b'-';
        options.first().is_some_and(u8::is_ascii_digit) && numbers.iter().all(plain)
    }

    fn parts(&self, path: &Path) -> Vec<PathBuf> {
        let names = ["col", "row", "sol"].map(|e| path.with_extension(e)).into_iter();
        std::iter::once(path.into()).chain(names.filter(|p| p.is_file())).collect()
    }

    fn parse(&self, name: &Path, bytes: &[u8]) -> Result<ProblemFile, IoError> {
        let model = Model::parse(name, bytes, &Options::default());
        model.map(Model::file).map_err(|refusal| *refusal.error)
    }

    fn read(&self, path: &Path) -> Result<ProblemFile, IoError> {
        let model = Model::read(path, &Options::default()).map_err(|refusal| *refusal.error)?;
        let solution = path.with_extension("sol");
        let x = match solution.is_file() {
            true => sol::values(&model.echo, &bytes(&solution)?),
            false => None,
        };
        let solution = x.map(|z| LcpPoint { z }.into());
        Ok(ProblemFile { solution, ..model.file() })
    }

    fn to_bytes(&self, name: &Path, file: &ProblemFile) -> Result<Vec<u8>, IoError> {
        match &file.problem {
            AnyProblem::Complementarity(Complementarity::Mcp(problem)) => {
                write::text(name, problem, &file.info).map(String::into_bytes)
            }
            other => {
                let found = other.kind().name();
                Err(IoError::data(name, "the kind", "a problem mcp", found))
            }
        }
    }

    /// The names go into `.col`, and the solution into `.sol` beside the model; what is left there of another model is removed.
    fn write(&self, path: &Path, file: &ProblemFile) -> Result<(), IoError> {
        let text = self.to_bytes(path, file)?;
        let [names, solution] = ["col", "sol"].map(|e| path.with_extension(e));
        if path.is_file() {
            // Names and solution of the model that is written over are none of this one. What cannot be removed is written over, or does not fit.
            let _ = [&names, &solution].map(std::fs::remove_file);
        }
        put(path, &text)?;
        if !file.info.names.is_empty() {
            let lines: String = file.info.names.iter().map(|n| one_line(n) + "\n").collect();
            put(&names, lines.as_bytes())?;
        }
        match file.solution {
            Some(_) => self.write_solution(path, file),
            None => Ok(()),
        }
    }

    /// Into `.sol`; the model stays as it is.
    fn write_solution(&self, path: &Path, file: &ProblemFile) -> Result<(), IoError> {
        let Some(AnyPoint::Lcp(LcpPoint { z })) = file.solution.as_ref().map(|s| &s.point) else {
            return Err(IoError::data(path, "the solution", "a point x", "none"));
        };
        let model = Model::read(path, &Options::default()).map_err(|refusal| *refusal.error)?;
        if z.len() != model.echo.variables {
            let expected = format!("{} values, as the model has variables", model.echo.variables);
            return Err(IoError::data(path, "the solution", expected, z.len()));
        }
        let message = "A point kept with the model";
        let solution = Solution { echo: &model.echo, message, x: z, result: UNJUDGED };
        solution.write(&path.with_extension("sol"))
    }
}

/// How a point ends of which a file does not say how accurate it is: AMPL calls it `solved?`.
const UNJUDGED: u16 = 100;

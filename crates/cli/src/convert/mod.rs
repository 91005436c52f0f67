//! `nonsmooth convert`.

mod scene;

use std::path::{Path, PathBuf};

use nonsmooth_io::{Format, Info, ProblemFile};
use nonsmooth_problem::{AnyPoint, AnyProblem, Complementarity, GlobalPoint, LocalPoint, Problem};
use nonsmooth_record::Origin;
use nonsmooth_solve::Reformulation;
use nonsmooth_solve::variational::reform::Multipliers;

use crate::report::{self, row};
use crate::{Exit, files, output};

/// Write the problem of a file in another format, or a robot of URDF or MJCF or a scene of Siconos as a scene.
///
/// The solution, the guesses and the texts that stand beside the problem go along as far as the new format has room for them; what is lost is
/// said. The formats go by the extensions; of `-`, the standard input or output, by the first bytes or by --format.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    #[arg(value_name = "FROM", help = files::help("A file with a problem", |_| true))]
    from: PathBuf,
    /// The file to write: .hdf5 for contacts; .toml, or .mtx with vectors beside, for linear complementarity; .toml or .nl for nonlinear; .toml for variational inequalities; .csv for the solution alone
    #[arg(value_name = "TO")]
    to: PathBuf,
    /// The format of TO, whatever its name: hdf5, toml, mtx, nl or csv
    #[arg(long, value_name = "EXTENSION", value_parser = files::format_named)]
    format: Option<&'static dyn Format>,
    /// Write a variational inequality over boxes and polyhedra as a mixed complementarity problem: over a box it is one, over a polyhedron multipliers are variables behind x
    #[arg(long)]
    as_mcp: bool,
}

const EXAMPLES: &str = "\
Examples:
  nonsmooth convert diodes_mlcp.dat diodes.toml        Siconos' text as TOML
  nonsmooth convert GFC3D_step.dat step.hdf5           Siconos' text as FCLIB's HDF5
  nonsmooth convert solved.hdf5 contacts.csv           the solution as a table
  nonsmooth convert rectifier.toml - --format csv
  nonsmooth convert obstacle_vi.toml obstacle.nl       over boxes and polyhedra as AMPL's model
  nonsmooth convert robot.urdf robot.toml              a scene for `nonsmooth simulate`
  nonsmooth convert robot.xml robot.toml               the same of a model of MuJoCo
  nonsmooth convert run.hdf5 scene.toml                the same of a mechanics file of Siconos

Exit codes: 0 written; 2 a mistake in a file or an option.";

/// Runs the command.
pub fn run(args: &Args) -> Result<Exit, String> {
    let Args { from, to, format, as_mcp } = args;
    if let Some(origin) = Origin::of(from) {
        return scene::write(args, &origin);
    }
    files::apart([from.as_path()], [("TO", to.as_path())])?;
    files::writable_or_stream("TO", to)?;
    let read = files::read(from)?;
    let format_of = |content: &ProblemFile| {
        files::target_format("TO", to, *format, content.problem.kind(), None)
    };
    let (content, format, rewritten) = match (as_mcp, format_of(&read)) {
        (false, Ok(format)) => (read, format, None),
        (false, Err(refused)) => {
            // A format may hold the same problem under its other name.
            let (content, how) = rewritten(read).ok_or_else(|| refused.clone())?;
            let format = format_of(&content).map_err(|_| refused)?;
            (content, format, Some(how))
        }
        (true, _) => {
            let found = read.problem.kind().name();
            let (content, how) = rewritten(read).ok_or_else(|| {
                let expected = "expected a problem vi over boxes and polyhedra";
                let found = if found == "vi" { "vi over other sets" } else { found };
                format!("{}: --as-mcp: {expected}, found {found}", from.display())
            })?;
            let format = format_of(&content)?;
            (content, format, Some(how))
        }
    };
    let there = content.guesses.len();
    let mut room = content.clone();
    if format.about().guess.is_none() {
        // Formats refuse what they have no place for.
        room.guesses.clear();
    }
    let kept = match files::is_stream(to) {
        true => {
            let name = Path::new("standard output");
            let bytes = format.to_bytes(name, &room).map_err(|e| e.to_string())?;
            output::print_bytes(&bytes);
            format.about().holds_problems.then(|| format.parse(name, &bytes))
        }
        false => {
            files::write(to, format, &room)?;
            format.about().holds_problems.then(|| format.read(to))
        }
    };
    // What can be read again is kept, whatever the format promises.
    let kept = kept.transpose().map_err(|e| e.to_string())?;
    let mut text = format!("{}: {}\n", to.display(), report::problem_text(&content.problem));
    row(&mut text, "from", format!("{} ({})", from.display(), files::about(from)?.name));
    row(&mut text, "format", format.about().name);
    if let Some(how) = rewritten {
        row(&mut text, "as", how);
    }
    let (kept, lost): (Vec<_>, Vec<_>) =
        parts(&content, kept.as_ref()).into_iter().partition(|part| part.1);
    for (label, all) in [("kept", kept), ("lost", lost)] {
        let names: Vec<_> = all
            .into_iter()
            .map(|(name, _)| match name {
                "guesses" => format!("{there} guesses"),
                name => name.into(),
            })
            .collect();
        if !names.is_empty() {
            row(&mut text, label, names.join(", "));
        }
    }
    match files::is_stream(to) {
        true => output::remark(&text),
        false => output::print(&text),
    }
    Ok(Exit::Solved)
}

/// A variational inequality over boxes and polyhedra as a mixed complementarity problem, and how; of others none.
fn rewritten(content: ProblemFile) -> Option<(ProblemFile, String)> {
    let AnyProblem::Complementarity(Complementarity::Vi(problem)) = &content.problem else {
        return None;
    };
    let (mcp, ()) = Multipliers.reduce(problem).ok()?;
    let multipliers = mcp.dim() - problem.dim();
    let mut info = content.info.clone();
    if !info.names.is_empty() {
        info.names.extend((1..=multipliers).map(|k| format!("multiplier[{k}]")));
    }
    let how = match (multipliers, &content.solution) {
        (0, _) => "mcp, as the variational inequality over a box is one".to_owned(),
        (n, solution) => {
            let without =
                if solution.is_some() { "; without the solution, which knows none" } else { "" };
            format!("mcp, with {} as variables behind x{without}", report::count(n, "multiplier"))
        }
    };
    let solution = content.solution.filter(|_| multipliers == 0);
    Some((ProblemFile { info, solution, ..ProblemFile::new(mcp) }, how))
}

/// Whether a solution has velocities of bodies.
fn bodies(file: &ProblemFile) -> bool {
    matches!(file.solution.as_ref().map(|s| &s.point), Some(AnyPoint::Global(_)))
}

/// Whether a solution has multipliers of scalar rows.
fn multipliers(file: &ProblemFile) -> bool {
    match file.solution.as_ref().map(|s| &s.point) {
        Some(
            AnyPoint::Local(LocalPoint { lambda, .. })
            | AnyPoint::Global(GlobalPoint { lambda, .. }),
        ) => !lambda.is_empty(),
        _ => false,
    }
}

/// What a file holds, and whether another one has it too; `None`: a table of its solution.
fn parts(file: &ProblemFile, kept: Option<&ProblemFile>) -> Vec<(&'static str, bool)> {
    let has = |of: fn(&ProblemFile) -> bool| kept.is_some_and(of);
    let info = |of: fn(&Info) -> bool, name| {
        of(&file.info).then(|| (name, kept.is_some_and(|kept| of(&kept.info))))
    };
    let solved = file.solution.is_some();
    let partner = |f: &ProblemFile| f.solution.as_ref().is_some_and(|s| s.partner.is_some());
    let follows = if file.problem.kind().is_complementarity() { "its w" } else { "its u" };
    let all = [
        Some(("problem", kept.is_some())),
        solved.then(|| ("solution", kept.is_none() || has(|f| f.solution.is_some()))),
        partner(file).then(|| (follows, kept.is_none_or(partner))),
        bodies(file).then(|| ("velocities of the bodies", has(bodies))),
        multipliers(file).then(|| ("multipliers", has(multipliers))),
        (!file.guesses.is_empty()).then(|| ("guesses", has(|f| !f.guesses.is_empty()))),
        file.drawing.is_some().then(|| ("drawing of the bodies", has(|f| f.drawing.is_some()))),
        info(|i| i.title.is_some(), "title"),
        info(|i| i.description.is_some(), "description"),
        info(|i| i.math_info.is_some(), "remarks on the mathematics"),
        info(|i| i.dofs.is_some(), "number of degrees of freedom"),
        info(|i| i.involved_ds.is_some(), "number of bodies"),
        // A table has them beside the values.
        (!file.info.names.is_empty())
            .then(|| ("names of the variables", kept.is_none_or(|f| !f.info.names.is_empty()))),
    ];
    all.into_iter().flatten().collect()
}

//! `nonsmooth check`.

use std::path::PathBuf;

use nonsmooth_problem::check::Judged;
use serde_json::json;

use crate::{Exit, certificate, files, jacobian, output, report};

/// Judge the solutions stored in files, or a certificate.
///
/// The residual of the solution is recomputed from the problem's data: from the impulses `r` (and the multipliers
/// `l`), through the dynamics for a global contact problem, or from z of a complementarity problem. The stored
/// `u` or `w` is not used.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    #[arg(required = true, value_name = "FILE", help = files::help("Files with a solution", |_| true))]
    files: Vec<PathBuf>,
    /// The relative residual that passes
    #[arg(long, value_name = "TOL", default_value = "1e-8", allow_hyphen_values = true)]
    tol: f64,
    /// List the N contacts, or rows, with the largest residuals (at most 10)
    #[arg(long, value_name = "N", value_parser = files::whole)]
    worst: Option<usize>,
    /// Verify this certificate (JSON, from `solve` or `exists` with --certificate) for the problem in FILE, in exact arithmetic, in
    /// place of a solution
    #[arg(long, value_name = "FILE.json", conflicts_with_all = ["tol", "worst"])]
    certificate: Option<PathBuf>,
    /// Compare the Jacobian of a nonlinear complementarity problem, entry by entry, with central differences of F at the start, and at the solution if there is
    /// one, in place of judging it
    #[arg(long, conflicts_with_all = ["tol", "worst", "certificate"])]
    jacobian: bool,
    /// Print one line of JSON for each file in place of the report
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  nonsmooth check solved.hdf5
  nonsmooth check solved.toml
  nonsmooth check solved.hdf5 --tol 1e-12 --worst 10
  nonsmooth check impossible.toml --certificate proof.json
  nonsmooth check nash_cournot.toml --jacobian

Exit codes: 0 all pass, the certificate is a proof, the Jacobian agrees; 1 some do not, or it is none; 2 a file without a solution, or at fault.";

/// Runs the command.
pub fn run(args: &Args) -> Result<Exit, String> {
    if let Some(path) = &args.certificate {
        return certificate::check(&args.files, path, args.json);
    }
    if args.jacobian {
        return Ok(jacobian::check(&args.files, args.json));
    }
    let tol = files::tolerance(args.tol)?;
    Ok(files::each(&args.files, args.json, |_, file| {
        let content = files::read(file)?;
        let Some(stored) = &content.solution else {
            let (file, place) = (file.display(), files::about(file)?.solution);
            return Err(format!("{file}: {place}: expected a solution to check, found none"));
        };
        let problem = &content.problem;
        let verdict = problem.judge(&stored.point, tol);
        let verdict = verdict.map_err(|e| format!("{}: {e}", file.display()))?;
        let (name, says) = match verdict.solved {
            true => ("solved", "solved"),
            false => ("not_solved", "not solved: the stored solution does not pass"),
        };
        if args.json {
            let mut all = report::problem_json(file, problem);
            all.extend(report::fields(json!({"tolerance": tol, "status": name, "message": says})));
            let worst = args.worst.unwrap_or(verdict.worst.len());
            all.extend(report::verdict_json(&verdict, tol, worst));
            all.extend(report::uniqueness_json(&content, &stored.point, &verdict));
            output::print(&format!("{}\n", json!(all)));
        } else {
            let mut text = report::headline(file, says, &verdict.measure, tol);
            report::row(&mut text, "problem", report::problem_text(problem));
            let worst = args.worst.unwrap_or(if verdict.solved { 0 } else { 3 });
            report::verdict_text(&mut text, &content, &verdict, tol, worst);
            report::uniqueness_text(&mut text, &content, &stored.point, &verdict);
            output::print(&text);
        }
        Ok(Exit::solved(verdict.solved))
    }))
}

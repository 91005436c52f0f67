//! Linear complementarity problems: every registered solver × every planted case of its kind, `auto` on what is hard, and the corpus. The
//! verdict comes from the judge alone.

use std::path::{Path, PathBuf};

use nonsmooth_linalg::Dense;
use nonsmooth_problem::check::Judged;
use nonsmooth_problem::planted::classics::{self, Classic, Known};
use nonsmooth_problem::planted::{PlantedBlocks, PlantedClass, PlantedLcp, PlantedMlcp};
use nonsmooth_problem::{
    AnyProblem, BoxLcp, Complementarity, Hlcp, Lcp, LcpPoint, Mlcp, with_complementarity,
};
use nonsmooth_solve::registry::{self, Registered};
use nonsmooth_solve::{Limits, Outcome, SolveError, Status};

/// How a solver ended on a problem; `solved` is confronted with the judge, a certificate with the verification.
fn attempt<P: Registered + Judged>(
    problem: &P,
    solver: &str,
    settings: &[&str],
    limits: &Limits,
) -> Result<(Outcome, P::Point), SolveError> {
    let map = nonsmooth_solve::settings::from_texts(settings).unwrap();
    let mut session = registry::session::<P>(solver, &map).unwrap();
    let mut point = problem.origin();
    let outcome = session.solve(problem, &mut point, limits, &mut |_| {})?;
    let verdict = problem.judge(&point, limits.tolerance).unwrap();
    assert_eq!(outcome.status == Status::Solved, verdict.solved, "{solver}: {outcome:?}");
    assert_eq!(outcome.measure, verdict.measure, "{solver}");
    if let Status::Infeasible(proof) = &outcome.status {
        let certificate = proof.certificate();
        assert!(problem.verify(certificate), "{solver}: {certificate:?}");
    }
    Ok((outcome, point))
}

/// Every solver of `P` by name, with every set of settings that the registry asks to be tested.
fn runs<P: Registered>() -> Vec<(String, Vec<&'static str>)> {
    let mut all = vec![];
    for name in registry::solver_names::<P>() {
        let about = registry::about::<P>(&name).expect("a listed solver is described");
        all.push((name.clone(), vec![]));
        all.extend(about.variants.iter().map(|v| (name.clone(), vec![*v])));
    }
    all
}

/// Every solver solves the problems, but for those whose names end as in `excused`: they need not converge, or say why they do not apply.
fn all_solve<P: Registered + Judged>(problems: &[P], excused: &[&str]) {
    let limits = Limits { max_iterations: 200_000, time_limit: Some(60.0), ..Limits::default() };
    let mut failures = vec![];
    for (solver, settings) in runs::<P>() {
        for (k, problem) in problems.iter().enumerate() {
            match attempt(problem, &solver, &settings, &limits) {
                Ok((outcome, _)) if outcome.status == Status::Solved => {}
                Ok(_) if excused.iter().any(|e| solver.ends_with(e)) => {}
                Ok((outcome, _)) => failures.push(format!(
                    "{solver} {settings:?} on {k}: {}, {:.1e}",
                    outcome.status, outcome.measure.relative
                )),
                Err(e) if e.is_inapplicable() && excused.iter().any(|a| solver.ends_with(a)) => {}
                // Games only.
                Err(e) if e.is_inapplicable() && solver.ends_with("lemke_howson") => {}
                Err(e) => failures.push(format!("{solver} {settings:?} on {k}: {e}")),
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

fn easy(class: PlantedClass) -> PlantedLcp {
    PlantedLcp { n: 16, class, ..PlantedLcp::default() }
}

#[test]
fn every_solver_solves_symmetric_dominant_problems() {
    // Symmetric and strictly dominant: all theorems of convergence apply.
    let dominant = |seed| {
        let (mut problem, known) = PlantedLcp { seed, ..easy(PlantedClass::Spd) }.lcp();
        let mut m = problem.M.to_dense().unwrap();
        for i in 0..m.nrows() {
            m[(i, i)] += m.row(i).iter().map(|x| x.abs()).sum::<f64>();
        }
        let mut product = vec![0.0; problem.q.len()];
        problem.M.mul(&known.z, &mut product);
        let w: Vec<f64> = problem.q.iter().zip(&product).map(|(q, p)| q + p).collect();
        problem.M = m.into();
        problem.M.mul(&known.z, &mut product);
        problem.q = w.iter().zip(&product).map(|(w, p)| w - p).collect();
        problem
    };
    all_solve::<Lcp>(&[dominant(1), dominant(2)], &[]);
}

/// Sweeps have no reason to converge where equalities and free variables are coupled by a skew part; with `D = −Cᵀ` M is not symmetric.
const SWEEPS: [&str; 8] =
    ["projected_jacobi", "pgs", "psor", "rpgs", "rpsor", "splitting_ls", "tnnmg", "mprgp"];
/// Pivoting rules for P-matrices have no reason to end with a solution where diagonals vanish; some forms of the quadratic program take no box.
const RULES: [&str; 4] = ["murty", "bard", "block_pivoting", "qp"];

#[test]
fn every_solver_solves_regular_mixed_problems_or_says_why_not() {
    let problem = |seed| PlantedMlcp { seed, free: 4, pairs: 9, ..PlantedMlcp::default() }.mlcp().0;
    all_solve::<Mlcp>(&[problem(1), problem(2)], &SWEEPS);
}

#[test]
fn every_solver_solves_horizontal_problems_or_says_why_not() {
    let problem = PlantedLcp { seed: 1, n: 8, ..easy(PlantedClass::Spd) }.hlcp().0;
    all_solve::<Hlcp>(&[problem], &[&SWEEPS[..], &RULES].concat());
}

#[test]
fn every_solver_solves_problems_with_two_bounds_or_says_why_not() {
    let problem = PlantedLcp { seed: 3, n: 10, ..easy(PlantedClass::Spd) }.boxed().0;
    let split: Vec<String> = SWEEPS.iter().map(|s| format!("split/{s}")).collect();
    let excused: Vec<&str> = split.iter().map(String::as_str).chain(RULES).collect();
    all_solve::<BoxLcp>(&[problem], &excused);
}

#[test]
fn no_solver_lies_on_hard_problems() {
    let limits = Limits { max_iterations: 3000, time_limit: Some(5.0), ..Limits::default() };
    let mut problems: Vec<Lcp> = PlantedClass::ALL
        .iter()
        .map(|&class| PlantedLcp { degenerate: 0.3, decades: 4.0, seed: 5, ..easy(class) }.lcp().0)
        .collect();
    problems.extend(classics::all().into_iter().map(|classic| classic.problem));
    for problem in problems {
        for solver in registry::solver_names::<Lcp>() {
            match attempt(&problem, &solver, &[], &limits) {
                Ok(_) => {}
                Err(e) => assert!(e.is_inapplicable(), "{solver}: {e}"),
            }
        }
    }
}

#[test]
fn auto_solves_every_class_to_the_last_digits() {
    let limits = Limits { tolerance: 1e-10, time_limit: Some(60.0), ..Limits::default() };
    let mut failures = vec![];
    let cases = [(12, 0.0, 0.0), (60, 0.5, 0.0), (60, 0.1, 3.0), (200, 0.2, 0.0)];
    for &class in &PlantedClass::ALL {
        for &(n, degenerate, decades) in &cases {
            let case =
                PlantedLcp { n, class, degenerate, decades, seed: 7, ..PlantedLcp::default() };
            let (outcome, _) = attempt(&case.lcp().0, "auto", &[], &limits).unwrap();
            if outcome.status != Status::Solved {
                failures.push(format!("{case:?}: {}, {:?}", outcome.status, outcome.measure));
            }
        }
    }
    for &blocks in &PlantedBlocks::ALL {
        for (redundant, degenerate) in [(0, 0.0), (0, 0.4), (2, 0.0)] {
            let case = PlantedMlcp { blocks, redundant, degenerate, ..PlantedMlcp::default() };
            let (outcome, _) = attempt(&case.mlcp().0, "auto", &[], &limits).unwrap();
            if outcome.status != Status::Solved {
                failures.push(format!("{case:?}: {}, {:?}", outcome.status, outcome.measure));
            }
        }
    }
    for class in [PlantedClass::Spd, PlantedClass::Lcprand, PlantedClass::Psd] {
        let case = PlantedLcp { class, n: 40, ..PlantedLcp::default() };
        let horizontal = attempt(&case.hlcp().0, "auto", &[], &limits).unwrap().0;
        let boxed = attempt(&case.boxed().0, "auto", &[], &limits).unwrap().0;
        for outcome in [horizontal, boxed] {
            if outcome.status != Status::Solved {
                failures.push(format!("{case:?}: {}", outcome.status));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn auto_proves_that_planted_infeasible_problems_have_no_solution() {
    for class in [PlantedClass::Psd, PlantedClass::Kkt, PlantedClass::CopositivePlus] {
        for n in [10, 60] {
            let case = PlantedLcp { class, n, seed: 3, ..PlantedLcp::default() };
            let (problem, _) = case.infeasible().expect("a class with infeasible problems");
            let limits = Limits { time_limit: Some(30.0), ..Limits::default() };
            let (outcome, _) = attempt(&problem, "auto", &[], &limits).unwrap();
            // The planted vector is a proof of the problem before it was rounded to doubles.
            assert!(outcome.status.refutes(), "{case:?}: {}", outcome.status);
        }
    }
}

#[test]
fn auto_settles_every_worked_example() {
    let limits = Limits { tolerance: 1e-12, ..Limits::default() };
    for Classic { name, problem, known } in classics::all() {
        let (outcome, point) = attempt(&problem, "auto", &[], &limits).unwrap();
        let classic = Classic { name, problem, known };
        match (&outcome.status, &classic.known) {
            (Status::Infeasible(_), Known::Nothing) => {}
            (Status::Solved, Known::Nothing) => panic!("{name} has no solution"),
            (Status::Solved, _) => assert!(classic.has(&point.z, 1e-9), "{name}: {:?}", point.z),
            (status, _) => panic!("{name}: {status}"),
        }
    }
}

/// The problems of a folder of the corpus that can be read, by name; none, said visibly, where it is not set.
fn corpus(folder: &str) -> Vec<(PathBuf, Complementarity)> {
    let Some(root) = std::env::var_os("NONSMOOTH_CORPUS") else {
        crate::common::skipped("NONSMOOTH_CORPUS is not set");
        return vec![];
    };
    let folder = Path::new(&root).join(folder);
    let mut files: Vec<_> =
        std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    assert!(files.len() > 10, "{}", folder.display());
    let content = |file: PathBuf| match nonsmooth_io::read(&file) {
        Ok(AnyProblem::Complementarity(problem)) => Some((file, problem)),
        Ok(AnyProblem::Friction(_)) => panic!("{}", file.display()),
        Err(e) => {
            // Two entries of q for three rows.
            assert!(file.ends_with("Rectangular_mlcp.dat"), "{e}");
            None
        }
    };
    files.into_iter().filter_map(content).collect()
}

#[test]
fn auto_settles_the_corpus_to_ten_digits() {
    let limits = Limits { tolerance: 1e-10, time_limit: Some(60.0), ..Limits::default() };
    let mut infeasible = vec![];
    for (file, problem) in ["lcp", "mlcp"].into_iter().flat_map(corpus) {
        let status = with_complementarity!(&problem, p => attempt(p, "auto", &[], &limits).unwrap().0.status);
        let name = file.file_stem().unwrap().to_string_lossy().into_owned();
        match status {
            Status::Solved => {}
            Status::Infeasible(_) => infeasible.push(name),
            other => panic!("{name}: {other}"),
        }
    }
    if std::env::var_os("NONSMOOTH_CORPUS").is_some() {
        assert_eq!(infeasible, ["lcp_Pang_isolated_sol_perturbed"]);
    }
}

#[test]
fn every_solver_is_honest_on_the_corpus() {
    let limits = Limits {
        tolerance: 1e-8,
        max_iterations: 5000,
        time_limit: Some(5.0),
        ..Limits::default()
    };
    fn honest<P: Registered + Judged>(problem: &P, limits: &Limits) -> usize {
        let mut solved = 0;
        for solver in registry::solver_names::<P>() {
            match attempt(problem, &solver, &[], limits) {
                Ok((outcome, _)) => solved += usize::from(outcome.status == Status::Solved),
                Err(e) => assert!(e.is_inapplicable(), "{solver}: {e}"),
            }
        }
        solved
    }
    for (file, problem) in ["lcp", "mlcp"].into_iter().flat_map(corpus) {
        let solved = with_complementarity!(&problem, p => honest(p, &limits));
        eprintln!("{}: solved by {solved} solvers", file.display());
    }
}

/// The first row is a sum of 4e-275, whose rounding no double holds: the exact solution passes by exact arithmetic, what is only near it does not.
#[test]
fn rows_of_hardly_anything_are_judged_exactly() {
    let rows = [[4.0, 1.75e-274], [1.75e-274, 4.0]];
    let m = Dense::from_rows(&rows).unwrap();
    let lcp = Lcp::new(m.clone(), vec![0.0, -1.0]).unwrap();
    let answer = nonsmooth::solve(&lcp).unwrap();
    assert!(answer.is_solved(), "{}", answer.status);
    assert_eq!(answer.point.z, [0.0, 0.25]);
    let judged = |z: [f64; 2]| lcp.judge(&LcpPoint { z: z.to_vec() }, 1e-8).unwrap().solved;
    assert!(judged([0.0, 0.25]));
    assert!(!judged([1.6e-16, 0.25]) && !judged([0.0, 0.2500001]) && !judged([0.0, 0.0]));
    let minus = Dense::from_rows(&[[-1.0, 0.0], [0.0, -1.0]]).unwrap();
    let hlcp = Hlcp::new(m, minus, vec![0.0, 1.0]).unwrap();
    // s = M z, of which the first entry is exact: a power of two times it.
    let at = |x: [f64; 2], s: [f64; 2]| {
        let point = nonsmooth_problem::HlcpPoint { x: x.to_vec(), s: s.to_vec() };
        hlcp.judge(&point, 1e-8).unwrap().solved
    };
    let s = 0.25 * rows[0][1];
    assert!(at([0.0, 0.25], [s, 0.0]));
    assert!(!at([0.0, 0.25], [2.0 * s, 0.0]) && !at([0.0, 0.25], [0.0, 0.0]));
}

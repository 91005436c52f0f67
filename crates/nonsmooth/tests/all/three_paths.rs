//! Global problems by three paths: condensed (W formed), velocity space (Gauss–Seidel on v), and product form
//! (projection with `W r = Hᵀ M⁻¹ H r`). The same solution comes out.

use nonsmooth_io::fclib;
use nonsmooth_linalg::norm;
use nonsmooth_problem::check::Judged;
use nonsmooth_problem::planted::Planted;
use nonsmooth_problem::{Friction, FrictionGlobal, GlobalPoint, Problem};
use nonsmooth_solve::contact::Condense;
use nonsmooth_solve::contact::form::{Access, Contacts, Linear};
use nonsmooth_solve::contact::law::DiskLaw;
use nonsmooth_solve::registry::{self, Registered};
use nonsmooth_solve::{Limits, Reformulation, Status};

/// The velocity u at the end of a run and whether the run reached 1e-12; and that run's impulses.
fn run<const D: usize, L: DiskLaw<D>>(
    problem: &FrictionGlobal<D, L>,
    path: &str,
) -> (Vec<f64>, bool, Vec<f64>)
where
    FrictionGlobal<D, L>: Problem<Point = GlobalPoint> + Registered,
{
    let limits = Limits { tolerance: 1e-12, max_iterations: 5_000, ..Limits::default() };
    let mut session = registry::session::<FrictionGlobal<D, L>>(path, &Default::default()).unwrap();
    let mut point = problem.origin();
    let outcome = session.solve(problem, &mut point, &limits, &mut |_| {}).unwrap();
    let verdict = problem.judge(&point, limits.tolerance).unwrap();
    (verdict.velocity, outcome.status == Status::Solved, point.r)
}

/// Returns how many paths beside the condensed one reached the solution.
fn agree<const D: usize, L: DiskLaw<D>>(problem: &FrictionGlobal<D, L>, name: &str) -> usize
where
    FrictionGlobal<D, L>: Problem<Point = GlobalPoint> + Registered,
{
    let (condensed, _) = Condense.reduce(problem).unwrap();
    let scale = norm(&condensed.q).max(f64::MIN_POSITIVE);
    let difference = |a: &[f64], b: &[f64]| {
        norm(&a.iter().zip(b).map(|(x, y)| x - y).collect::<Vec<_>>()) / scale
    };
    let (reference, solved, r) = run(problem, "condense/nsgs");
    let mut agreed = 0;
    for path in ["nsgs", "extragradient"] {
        let (u, also, _) = run(problem, path);
        if solved && also {
            let d = difference(&reference, &u);
            assert!(d < 1e-10, "{name}: {path} differs by {d:e}");
            agreed += 1;
        }
    }
    // The three forms of the operator at that point, converged or not; the judge's velocity is a fourth.
    let mut state = problem.state(Access::Products).unwrap();
    let mut product = vec![0.0; r.len()];
    problem.velocities(&mut state, &r, &mut product);
    let mut explicit = vec![0.0; r.len()];
    condensed.W.mul_plus(&r, &condensed.q, &mut explicit);
    for (form, u) in [("product form", product), ("explicit W", explicit)] {
        let d = difference(&reference, &u);
        assert!(d < 1e-10, "{name}: {form} differs by {d:e}");
    }
    agreed
}

#[test]
fn planted_problems() {
    for seed in 0..8 {
        let bilateral = if seed % 2 == 0 { 0 } else { 5 };
        let case = Planted { contacts: 15, dofs: 90, bilateral, seed, ..Planted::default() };
        assert_eq!(agree(&case.global::<3>().0, &format!("seed {seed} in space")), 2);
        assert_eq!(agree(&case.global::<2>().0, &format!("seed {seed} in the plane")), 2);
        // Projections take their time.
        assert!(agree(&case.rolling_global().0, &format!("seed {seed} rolling")) >= 1);
    }
}

#[test]
fn the_global_corpus() {
    let (mut files, mut agreed) = (0, 0);
    for path in crate::common::corpus_files(&["siconos/gfc3d", "siconos/gfc2d", "generated"]) {
        let name = path.display().to_string();
        agreed += match fclib::read_problem(&path) {
            Ok(Friction::Global3(problem)) => agree(&problem, &name),
            Ok(Friction::Global2(problem)) => agree(&problem, &name),
            Ok(Friction::RollingGlobal(problem)) => agree(&problem, &name),
            _ => continue,
        };
        files += 1;
    }
    assert!(files == 0 || agreed > files, "{agreed} agreements on {files} files");
}

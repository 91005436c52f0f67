//! Problems made to deceive: without solution, contradictory, nearly singular, stiff, in absurd units. Whatever a solver
//! believes, nothing is called solved that is not, and what can be solved is.

use nonsmooth_linalg::{Bsr, Csc, Dense};
use nonsmooth_problem::check::Judged;
use nonsmooth_problem::{
    FrictionGlobal, FrictionLocal, LocalPoint, Mlcp, Problem, RowsGlobal, RowsLocal,
};
use nonsmooth_solve::registry::{self, Registered, Solves};
use nonsmooth_solve::{Limits, Status};

/// The status of every solver of the law on `problem`, by name, each confronted with the judge.
fn statuses<P: Registered + Judged>(problem: &P) -> Vec<(String, Status)> {
    let solve = |name: String| {
        let mut session = registry::session::<P>(&name, &Default::default()).unwrap();
        let limits = Limits { max_iterations: 20_000, ..Limits::default() };
        let mut point = problem.origin();
        let outcome = session.solve(problem, &mut point, &limits, &mut |_| {}).unwrap();
        let verdict = problem.judge(&point, limits.tolerance).unwrap();
        assert_eq!(outcome.status == Status::Solved, verdict.solved, "{name}");
        (name, outcome.status)
    };
    let of_the_law = |name: &String| registry::solves::<P>(name) == Some(Solves::Law);
    registry::solver_names::<P>().into_iter().filter(of_the_law).map(solve).collect()
}

/// Whether much is asked of a solver: the default and plain Gauss-Seidel.
fn robust(name: &str) -> bool {
    ["auto", "nsgs", "condense/auto", "condense/nsgs"].contains(&name)
}

fn all_solve<P: Registered + Judged>(problem: &P) {
    for (name, status) in statuses(problem) {
        assert_eq!(status, Status::Solved, "{name}");
    }
}

fn none_solves<P: Registered + Judged>(problem: &P) -> Vec<(String, Status)> {
    let all = statuses(problem);
    assert!(all.iter().all(|(_, status)| *status != Status::Solved), "{all:?}");
    all
}

fn csc(nrows: usize, ncols: usize, entries: &[(usize, usize, f64)]) -> Csc {
    Csc::from_triplets(nrows, ncols, entries.iter().copied()).unwrap()
}

/// A mass of 1 between two walls that approach each other: no motion is admissible.
fn squeezed(mu: f64) -> (FrictionGlobal<3>, FrictionLocal<3>) {
    let h: Vec<_> = (0..3).flat_map(|k| [(k, k, 1.0), (k, 3 + k, -1.0)]).collect();
    let w = vec![-1.0, 0.0, 0.0, -1.0, 0.0, 0.0];
    let m = Csc::diagonal(&[1.0; 3]);
    let f = vec![0.0, 0.3, 0.0];
    let global = FrictionGlobal::new(m, csc(3, 6, &h), f, w, vec![mu; 2]).unwrap();
    let blocks: Vec<_> = (0..3)
        .flat_map(|k| [(k, k, 1.0), (k, 3 + k, -1.0), (3 + k, k, -1.0), (3 + k, 3 + k, 1.0)])
        .collect();
    let q = vec![-1.0, 0.3, 0.0, -1.0, -0.3, 0.0];
    let local = FrictionLocal::new(Bsr::from_csc(&csc(6, 6, &blocks)), q, vec![mu; 2]).unwrap();
    (global, local)
}

#[test]
fn a_body_squeezed_without_friction_is_never_solved_and_proved_to_be_so() {
    let (global, local) = squeezed(0.0);
    for all in [none_solves(&global), none_solves(&local)] {
        for (name, status) in all.iter().filter(|(name, _)| robust(name)) {
            assert!(matches!(status, Status::Infeasible(_)), "{name} {status}");
        }
    }
    // Impulses so large that rounding swallows the velocities.
    for size in [1e8, 1e16, 1e17, 1e30, 1e200] {
        let r = vec![size, 0.0, 0.0, size, 0.0, 0.0];
        let point = LocalPoint { r, lambda: vec![] };
        assert!(!local.judge(&point, 1e-3).unwrap().solved, "{size:e}");
    }
}

/// A body on the floor, with the constraints given.
fn constrained(g: &[(usize, usize, f64)], b: Vec<f64>) -> FrictionGlobal<3> {
    let h = csc(6, 3, &[(2, 0, 1.0), (0, 1, 1.0), (1, 2, 1.0)]);
    let f = vec![0.5, 0.1, -1.0, 0.0, 0.0, 0.2];
    let g = csc(6, b.len(), g);
    let bilateral = Some(RowsGlobal::bilateral(g, b));
    let m = Csc::diagonal(&[1.0, 1.0, 1.0, 0.2, 0.2, 0.3]);
    let problem =
        FrictionGlobal { M: m, H: h, f, w: vec![0.0; 3], mu: vec![0.4], mu_r: (), rows: bilateral };
    problem.validate().unwrap();
    problem
}

#[test]
fn contradictory_constraints_are_proved_to_be_so_whatever_their_scale() {
    for scale in [1.0, 1e8, 1e-8] {
        let g = [(0, 0, 1.0), (0, 1, 1.0), (1, 2, scale)];
        let problem = constrained(&g, vec![0.0, 1.0, scale]);
        for (name, status) in none_solves(&problem) {
            assert!(matches!(status, Status::Infeasible(_)), "{name} {status} at {scale:e}");
        }
    }
}

#[test]
fn redundant_and_nearly_redundant_constraints_are_satisfied() {
    let exactly = [(0, 0, 1.0), (5, 0, 0.3), (0, 1, 2.0), (5, 1, 0.6)];
    all_solve(&constrained(&exactly, vec![-0.1, -0.2]));
    for tilt in [1e-3, 1e-5] {
        let nearly = [(0, 0, 1.0), (5, 0, 0.3), (0, 1, 1.0), (5, 1, 0.3 + tilt)];
        all_solve(&constrained(&nearly, vec![-0.1, -0.1]));
    }
}

/// One contact with one bilateral row, `R` as given.
fn local_with(r: f64, s: f64) -> FrictionLocal<3> {
    let w = Bsr::from_rows(1, &[vec![(0, [[2.0, 0.1, 0.0], [0.1, 1.5, 0.0], [0.0, 0.0, 1.0]])]]);
    let bilateral =
        RowsLocal::bilateral(csc(3, 1, &[(1, 0, 0.5)]), csc(1, 1, &[(0, 0, r)]), vec![s]);
    FrictionLocal::with_rows(w, vec![-1.0, 0.2, 0.1], vec![0.3], bilateral).unwrap()
}

#[test]
fn any_invertible_r_is_taken_and_solved_below_the_regularisation() {
    for r in [1.0, 1e6, -1.0, -1e3] {
        let problem = local_with(r, 0.4);
        let mut session =
            registry::session::<FrictionLocal<3>>("nsgs", &Default::default()).unwrap();
        let limits = Limits { tolerance: 1e-13, ..Limits::default() };
        let mut point = problem.origin();
        let outcome = session.solve(&problem, &mut point, &limits, &mut |_| {}).unwrap();
        assert_eq!(outcome.status, Status::Solved, "R = {r}: {outcome:?}");
    }
}

#[test]
fn a_constraint_that_nothing_can_meet_is_not_hidden_by_a_larger_one() {
    let mut problem = local_with(1.0, 0.0);
    problem.rows =
        Some(RowsLocal::bilateral(csc(3, 2, &[]), csc(2, 2, &[(1, 1, 1e10)]), vec![1.0, 1e10]));
    none_solves(&problem);
}

#[test]
fn a_stiff_mass_is_solved_and_the_rounding_of_its_dynamics_allowed_for() {
    for k in [1e6, 1e10, 1e12] {
        // A contact on the first of two degrees of freedom that a spring of stiffness k holds together, D = 2.
        let m = csc(2, 2, &[(0, 0, 1.0 + k), (0, 1, -k), (1, 0, -k), (1, 1, 1.0 + k)]);
        let h = csc(2, 2, &[(0, 0, 1.0), (1, 1, 0.3)]);
        let problem =
            FrictionGlobal::<2>::new(m, h, vec![-1.0, 0.37], vec![0.1, 0.2], vec![0.5]).unwrap();
        for (name, status) in statuses(&problem) {
            if robust(&name) {
                assert_eq!(status, Status::Solved, "{name}, k = {k:e}");
            }
        }
    }
}

#[test]
fn a_singular_mass_is_a_mistake_that_is_named() {
    // Rank one, up to rounding.
    let a = [0.3, 0.7, 1.1];
    let m: Vec<_> = (0..9).map(|k| (k / 3, k % 3, a[k / 3] * a[k % 3] * (1.0 / 3.0))).collect();
    let h = csc(3, 3, &[(0, 0, 1.0), (1, 1, 1.0), (2, 2, 1.0)]);
    let problem =
        FrictionGlobal::<3>::new(csc(3, 3, &m), h, vec![1.0; 3], vec![0.0; 3], vec![0.5]).unwrap();
    let mistake = problem.gauge().unwrap_err().to_string();
    assert!(
        mistake.starts_with("M (component of row 0): expected an invertible matrix"),
        "{mistake}"
    );
}

#[test]
fn units_do_not_decide() {
    for unit in [1e-170, 1e-30, 1.0, 1e30, 1e150] {
        let w =
            Bsr::from_rows(1, &[vec![(0, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])]]);
        let q = vec![-unit, 0.0, 0.0];
        let problem = FrictionLocal::new(w, q, vec![0.5]).unwrap();
        assert!(!problem.judge(&problem.origin(), 1e-8).unwrap().solved, "{unit:e}");
        for (name, status) in statuses(&problem).iter().filter(|(name, _)| robust(name)) {
            assert_eq!(*status, Status::Solved, "{name}, {unit:e}");
        }
    }
}

#[test]
fn a_contact_that_nothing_can_move() {
    let zero = || Bsr::from_rows(1, &[vec![(0, [[0.0; 3]; 3])]]);
    all_solve(&FrictionLocal::new(zero(), vec![1.0, 2.0, 0.0], vec![0.5]).unwrap());
    none_solves(&FrictionLocal::new(zero(), vec![-1.0, 2.0, 0.0], vec![0.5]).unwrap());
    all_solve(&FrictionLocal::new(zero(), vec![0.0; 3], vec![0.5]).unwrap());
}

/// The equation has no entry for its free variable, and the pair that it is solved with is singular up to rounding: the tableau begins anew before it was
/// ever complete.
#[test]
fn a_pair_that_turns_out_singular_is_no_panic() {
    let m =
        [[0.0, 1e-8, 1.0, 0.0], [1e-8, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 0.0, 1.0]];
    let problem = Mlcp::new(Dense::from_rows(&m).unwrap(), vec![1.0, -1.0, 1.0, 1.0], 1).unwrap();
    // Before it, in the same session, a problem of another size.
    let other = Dense::from_rows(&[[2.0, 1.0], [-1.0, 1.0]]).unwrap();
    let other = Mlcp::new(other, vec![-1.0, 1.0], 1).unwrap();
    for name in ["bard", "murty", "keller", "criss_cross"] {
        let mut session = registry::session::<Mlcp>(name, &Default::default()).unwrap();
        for problem in [&problem, &other, &problem] {
            let mut point = problem.origin();
            match session.solve(problem, &mut point, &Limits::default(), &mut |_| {}) {
                Ok(_) => assert!(point.z.iter().all(|z| z.is_finite()), "{name}"),
                Err(e) => assert!(e.is_inapplicable(), "{name}: {e}"),
            }
        }
    }
}

/// A weight on a table that a joint holds: both fall alike, so that q without the joint is rounding, or as large as one likes.
fn on_a_jointed_table(q: f64, s: f64) -> FrictionLocal<3> {
    let w = Bsr::from_rows(1, &[vec![(0, [[2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]])]]);
    let rows = RowsLocal::bilateral(csc(3, 1, &[(0, 0, -1.0)]), csc(1, 1, &[(0, 0, 1.0)]), vec![s]);
    FrictionLocal::with_rows(w, vec![q, 0.3 * 0.00981, 0.0], vec![0.3], rows).unwrap()
}

#[test]
fn what_a_joint_takes_up_is_no_measure_of_the_contacts() {
    for q in [0.0, 1e-18, -1e-18] {
        let problem = on_a_jointed_table(q, -0.00981);
        for solver in ["auto", "nsgs"] {
            let mut session =
                registry::session::<FrictionLocal<3>>(solver, &Default::default()).unwrap();
            let mut point = problem.origin();
            let outcome =
                session.solve(&problem, &mut point, &Limits::default(), &mut |_| {}).unwrap();
            assert_eq!(outcome.status, Status::Solved, "{solver}, q = {q:e}");
            // u_N = 2 r_N + q_N − λ and λ = r_N − s.
            assert!((point.r[0] - 0.00981).abs() < 1e-9, "{:?}", point.r);
        }
    }
    // The same velocity of the contact beside a million that the joint takes up: no impulse is no answer.
    let problem = on_a_jointed_table(-1e6 - 0.00981, 1e6);
    let point = LocalPoint { r: vec![0.0; 3], lambda: vec![-1e6] };
    assert!(!problem.judge(&point, 1e-8).unwrap().solved);
}

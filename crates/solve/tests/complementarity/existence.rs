//! Whether a complementarity problem has a solution, on problems of which it is known.

use nonsmooth_linalg::Dense;
use nonsmooth_problem::check::{Existence, Judged};
use nonsmooth_problem::planted::{PlantedClass, PlantedLcp};
use nonsmooth_problem::{AnyProblem, BoxLcp, Hlcp, Lcp, Mlcp, Problem};
use nonsmooth_solve::existence::of;
use nonsmooth_solve::{Limits, Solve, Status};

fn decided(problem: impl Into<AnyProblem>) -> Existence {
    of(&problem.into(), &Limits { time_limit: Some(60.0), ..Limits::default() })
}

fn dense<const N: usize>(rows: [[f64; N]; N]) -> Dense {
    Dense::from_rows(&rows).unwrap()
}

/// A solution that is called exact passes the judge's check, rounded, at the last digits.
fn check_solution(problem: &AnyProblem, existence: &Existence) {
    if let Existence::Solved { coefficients, representable } = existence {
        let system = problem.cones().unwrap();
        assert!(system.solved_by(&coefficients.0));
        let point = problem.assembled(&system.unknowns_at(&coefficients.0));
        let passes = problem.judge(&point, 1e-12).is_ok_and(|v| v.solved);
        assert_eq!(passes, *representable, "{existence}");
    }
}

#[test]
fn what_is_planted_has_a_solution() {
    for class in PlantedClass::ALL {
        for (n, degenerate) in [(6, 0.0), (18, 0.3), (40, 0.0)] {
            let case = PlantedLcp { n, class, degenerate, ..PlantedLcp::default() };
            let mut problems: Vec<AnyProblem> = vec![case.lcp().0.into(), case.boxed().0.into()];
            problems.push(case.hlcp().0.into());
            for problem in problems {
                let existence = decided(problem.clone());
                let said = format!("{class:?} {n} {}: {existence}", problem.kind().name());
                // Planted digits are rounded once: of singular matrices that may cost the solution.
                assert!(existence.name() != "no_solution" || class == PlantedClass::Psd, "{said}");
                check_solution(&problem, &existence);
                let sure = matches!(
                    class,
                    PlantedClass::Spd
                        | PlantedClass::MMatrix
                        | PlantedClass::HPlus
                        | PlantedClass::P
                        | PlantedClass::Lcprand
                );
                assert!(existence.is_proved() || !sure, "{said}");
            }
        }
    }
}

#[test]
fn what_is_planted_without_one_has_none() {
    for class in [PlantedClass::Psd, PlantedClass::Kkt, PlantedClass::CopositivePlus] {
        for n in [6, 15] {
            let case = PlantedLcp { n, class, ..PlantedLcp::default() };
            let problem: AnyProblem = case.infeasible().unwrap().0.into();
            let existence = decided(problem.clone());
            check_solution(&problem, &existence);
            // Entries are rounded once, so that there may be a solution after all, a huge one: then it is verified.
            let none = ["no_solution", "nearly_no_solution", "unknown"].contains(&existence.name());
            let exact = matches!(existence, Existence::Solved { .. });
            assert!(none || exact, "{class:?} {n}: {existence}");
        }
    }
}

#[test]
fn small_problems_are_decided_by_their_theorem_or_in_fractions() {
    let name = |p: AnyProblem| {
        let existence = decided(p.clone());
        check_solution(&p, &existence);
        (existence.name(), existence.to_string())
    };
    // 0 ≤ z ⟂ −z − 1 ≥ 0 has no solution; 0 ≤ z ⟂ −z + 1 ≥ 0 has two.
    let negative = |q: f64| Lcp::new(dense([[-1.0]]), vec![q]).unwrap();
    assert_eq!(name(negative(-1.0).into()).0, "no_solution");
    let (verdict, said) = name(negative(1.0).into());
    assert!(verdict == "proved" && said.contains("exact solution"), "{said}");
    // A P-matrix that is not definite, and a box without an end.
    let p = dense([[1.0, 3.0], [0.0, 1.0]]);
    let said = name(Lcp::new(p.clone(), vec![-1.0, -1.0]).unwrap().into()).1;
    assert!(said.contains("M is P"), "{said}");
    let inf = f64::INFINITY;
    let boxed = |l: f64, u: f64| {
        BoxLcp::new(dense([[0.0, 1.0], [1.0, 0.0]]), vec![-1.0; 2], vec![l; 2], vec![u; 2]).unwrap()
    };
    assert!(name(boxed(-1.0, 2.0).into()).1.contains("all bounds are finite"));
    assert_eq!(name(boxed(-inf, inf).into()).0, "proved");
    // x = −1 has no nonnegative solution, x − s = −1 has.
    let pair = |r: f64| Hlcp::new(dense([[1.0]]), dense([[r]]), vec![-1.0]).unwrap();
    assert_eq!(name(pair(1.0).into()).0, "no_solution");
    assert_eq!(name(pair(-1.0).into()).0, "proved");
}

/// Two equations that are the same, with a right-hand side that rounding has left: exactly there is no solution.
#[test]
fn a_point_that_passes_is_preferred_to_a_proof_by_rounding() {
    let row = [-0.2, 0.3, -0.6, 0.7, -1.2, 0.2, 1.2];
    let equations = (0..2).flat_map(|i| (0..7).map(move |j| (i, 2 + j, row[j])));
    let turned = (0..2).flat_map(|i| (0..7).map(move |j| (2 + j, i, -row[j])));
    let mut m = Dense::zeros(9, 9);
    equations.chain(turned).for_each(|(i, j, x)| m[(i, j)] = x);
    let rounding = 5.773159728050814e-17;
    let q = vec![
        rounding,
        rounding,
        0.30405750482311816,
        -0.4560862572346772,
        0.9121725144693544,
        -0.9118038344488234,
        1.8243450289387089,
        -0.30405750482311816,
        -1.8243450289387089,
    ];
    let problem = Mlcp::new(m, q, 2).unwrap();
    let lemke = Solve::new().solver("lemke").run(&problem).unwrap();
    let Status::Infeasible(proof) = &lemke.status else { panic!("{}", lemke.status) };
    assert!(proof.margin() < 1e-16, "{}", proof.margin());
    let answer = Solve::new().run(&problem).unwrap();
    assert_eq!(answer.status, Status::Solved, "{:?}", answer.account);
}

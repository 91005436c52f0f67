//! A hundred thousand variables and more; products in place of entries.

use nonsmooth_problem::planted::Membrane;
use nonsmooth_solve::Status;

use super::{bump, distance, large, limits, solved, try_solve};

#[test]
fn a_hundred_thousand_variables() {
    large(300, 5000);
}

#[test]
#[ignore = "minutes: a million variables"]
fn a_million_variables() {
    large(1000, 20_000);
}

#[test]
fn an_operator_is_solved_by_its_products() {
    let membrane = Membrane { load: -1.0, ..Membrane::square(60) };
    let (known, _) = solved(&membrane.above(bump), "psor");
    for label in ["mprgp", "projected_jacobi"] {
        let (outcome, z) =
            try_solve(&membrane.above_by_products(bump), label, &limits(1e-9, 100_000)).unwrap();
        assert_eq!(outcome.status, Status::Solved, "{label}");
        assert!(distance(&z, &known) < 1e-5, "{label}");
    }
}

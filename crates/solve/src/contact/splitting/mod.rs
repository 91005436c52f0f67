//! Splitting methods: block Gauss–Seidel over contacts.

mod circles;
mod colored;
mod coloring;
mod contact;
// The example of docs/adding-a-solver.md, for the tests below only.
#[cfg(test)]
mod jacobi;
mod nsgs;
mod ordering;
mod psor;
mod team;

pub use colored::{Colored, ColoredSweeps};
pub use nsgs::{LocalChoice, LocalTolerance, Nsgs, Sweeps};
pub use ordering::{Order, Ordering};
pub use psor::Psor;

#[cfg(test)]
mod tests {
    use nonsmooth_problem::Problem;
    use nonsmooth_problem::planted::Planted;

    use super::jacobi::Jacobi;
    use crate::contact::form::OnContacts;
    use crate::core::register::Described;
    use crate::core::settings::Settings;
    use crate::{Driver, Limits, Session, Status};

    /// A contributor copies it.
    #[test]
    fn the_documented_example_is_this_one_and_solves() {
        let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/adding-a-solver.md");
        let page = std::fs::read_to_string(page).unwrap().replace("\r\n", "\n");
        let code = format!("```rust\n{}```\n", include_str!("jacobi.rs"));
        assert!(page.contains(&code), "the page and splitting/jacobi.rs differ");

        assert!(Jacobi::default().validate().is_ok());
        assert!(Jacobi { omega: 0.0, ..Jacobi::default() }.validate().is_err());
        assert_eq!((Jacobi::ABOUT.name, Jacobi::ABOUT.family), ("jacobi", "splitting"));
        let (problem, _) = Planted { contacts: 15, dofs: 90, ..Planted::default() }.global::<3>();
        let mut driver = Driver::new(OnContacts::<_, 3>(Jacobi::default()));
        let limits = Limits { tolerance: 1e-6, max_iterations: 100_000, ..Limits::default() };
        for _ in 0..2 {
            let mut point = problem.origin();
            let end = driver.solve(&problem, &mut point, &limits, &mut |_| {}).unwrap();
            assert_eq!(end.status, Status::Solved, "{:e}", end.measure.relative);
        }
    }
}

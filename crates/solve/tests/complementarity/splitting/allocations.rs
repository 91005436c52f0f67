//! A second solve of the same shape allocates nothing.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use nonsmooth_problem::planted::Membrane;
use nonsmooth_problem::{Lcp, Problem};
use nonsmooth_solve::Status;

use super::{SYMMETRIC, bump, distance, limits, session, solved};

thread_local! {
    static WATCHED: Cell<bool> = const { Cell::new(false) };
    static CALLS: Cell<usize> = const { Cell::new(0) };
}

struct Counting;

#[global_allocator]
static ALLOCATOR: Counting = Counting;

// SAFETY: every request is passed on to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        if WATCHED.try_with(Cell::get).unwrap_or(false) {
            CALLS.set(CALLS.get() + 1);
        }
        // SAFETY: the caller's guarantees are those that `System` asks for.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(at, layout) }
    }
}

#[test]
fn a_second_solve_of_the_same_shape_allocates_nothing() {
    let problem = |load| Membrane { load, ..Membrane::square(12) }.above(bump);
    let (first, second) = (problem(-1.0), problem(-3.0));
    let other = Membrane { load: -1.0, ..Membrane::square(5) }.above(bump);
    for label in SYMMETRIC.into_iter().chain(["projected_jacobi"]) {
        let mut session = session::<Lcp>(label);
        let mut point = first.origin();
        let limits = limits(1e-8, 100_000);
        session.solve(&first, &mut point, &limits, &mut |_| {}).unwrap();
        let mut again = second.origin();
        CALLS.set(0);
        WATCHED.set(true);
        let outcome = session.solve(&second, &mut again, &limits, &mut |_| {});
        WATCHED.set(false);
        assert_eq!(outcome.unwrap().status, Status::Solved, "{label}");
        assert_eq!(CALLS.get(), 0, "{label}");
        assert!(distance(&again.z, &solved(&second, "psor").0) < 1e-4, "{label}");
        // Another shape in the same workspace.
        let mut smaller = other.origin();
        let outcome = session.solve(&other, &mut smaller, &limits, &mut |_| {}).unwrap();
        assert_eq!(outcome.status, Status::Solved, "{label}");
    }
}

//! A pile at rest allocates nothing: all memory of a step is kept for the next one.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use nonsmooth_simulate::{Body, Law, MoreauJean, Polygon, Shape, Simulation, World};

thread_local! {
    static CALLS: Cell<usize> = const { Cell::new(0) };
}

struct Counting;

#[global_allocator]
static ALLOCATOR: Counting = Counting;

// SAFETY: every request is passed on to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let _ = CALLS.try_with(|c| c.set(c.get() + 1));
        // SAFETY: the caller's guarantees are those that `System` asks for.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(at, layout) }
    }
}

#[test]
fn a_resting_stack_in_the_plane_allocates_nothing() {
    let mut world = World::in_plane([0.0, -9.81]).with_law(Law::friction(0.5));
    world.add(Body::ground());
    for k in 0..5 {
        let block = Body::solid(Polygon::rectangle([0.5, 0.1]).unwrap(), 1000.0).unwrap();
        world.add(block.at([0.0, 0.1 + 0.2 * f64::from(k), 0.0]));
        let disc = Body::solid(Shape::Disc { radius: 0.2 }, 1000.0).unwrap();
        world.add(disc.at([3.0 + f64::from(k), 0.2, 0.0]));
    }
    let mut simulation = Simulation::new(world, MoreauJean::default()).unwrap();
    for _ in 0..20 {
        simulation.step(5e-3).unwrap();
    }
    let before = CALLS.get();
    for _ in 0..200 {
        let report = simulation.step(5e-3).unwrap();
        assert!(report.status.is_solved());
        assert_eq!((report.counts.active, report.counts.islands), (15, 6));
    }
    assert_eq!(CALLS.get() - before, 0);
}

#[test]
fn a_resting_stack_allocates_nothing() {
    let mut world = World::default().with_law(Law::friction(0.5));
    world.add(Body::floor());
    for k in 0..5 {
        let block = Body::solid(Shape::Box { half: [0.5, 0.4, 0.1] }, 1000.0).unwrap();
        world.add(block.at([0.0, 0.0, 0.1 + 0.2 * f64::from(k)]));
        let ball = Body::solid(Shape::Sphere { radius: 0.2 }, 1000.0).unwrap();
        world.add(ball.at([3.0 + f64::from(k), 0.0, 0.2]));
    }
    let mut simulation = Simulation::new(world, MoreauJean::default()).unwrap();
    for _ in 0..20 {
        simulation.step(5e-3).unwrap();
    }
    let before = CALLS.get();
    for _ in 0..200 {
        let report = simulation.step(5e-3).unwrap();
        assert!(report.status.is_solved());
        assert_eq!((report.counts.active, report.counts.islands), (25, 6));
    }
    assert_eq!(CALLS.get() - before, 0);
}

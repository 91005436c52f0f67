//! What a session may allocate: nothing in a second solve of the same shape, and nothing that grows with the
//! number of iterations.

use std::alloc::{GlobalAlloc, Layout, System};
use std::backtrace::Backtrace;
use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;

use nonsmooth::{FrictionGlobal, FrictionLocal, Lcp, Limits, Planted, Session};
use nonsmooth_linalg::{BlockLu, Bsr, Csc};
use nonsmooth_problem::planted::PlantedLcp;
use nonsmooth_solve::registry::{self, Registered};

/// What the present thread allocated while it was watched.
#[derive(Clone, Copy, Default)]
struct Count {
    calls: usize,
    bytes: usize,
}

thread_local! {
    static WATCHED: Cell<bool> = const { Cell::new(false) };
    static TRACED: Cell<bool> = const { Cell::new(false) };
    static COUNT: Cell<Count> = const { Cell::new(Count { calls: 0, bytes: 0 }) };
    static FIRST: RefCell<Option<Backtrace>> = const { RefCell::new(None) };
}

struct Counting;

#[global_allocator]
static ALLOCATOR: Counting = Counting;

impl Counting {
    fn note(bytes: usize) {
        // `replace`: what the noting itself allocates is not counted.
        if !WATCHED.try_with(|w| w.replace(false)).unwrap_or(false) {
            return;
        }
        let Count { calls, bytes: sum } = COUNT.get();
        COUNT.set(Count { calls: calls + 1, bytes: sum + bytes });
        if TRACED.replace(false) {
            FIRST.set(Some(Backtrace::force_capture()));
        }
        WATCHED.set(true);
    }
}

// SAFETY: every request is passed on to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        Self::note(layout.size());
        // SAFETY: the caller's guarantees are those that `System` asks for.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        Self::note(layout.size());
        // SAFETY: as above.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        Self::note(size);
        // SAFETY: as above.
        unsafe { System.realloc(at, layout, size) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(at, layout) }
    }
}

/// What `f` allocates on this thread.
fn counted(f: impl FnOnce()) -> Count {
    COUNT.set(Count::default());
    WATCHED.set(true);
    f();
    WATCHED.set(false);
    COUNT.get()
}

/// What `f` allocates, and the project's frames under its first allocation.
fn traced(f: impl FnOnce()) -> (Count, String) {
    TRACED.set(true);
    let count = counted(f);
    TRACED.set(false);
    let first = FIRST.take().map(|b| b.to_string()).unwrap_or_default();
    let places: Vec<_> = first
        .lines()
        .map(str::trim)
        .filter(|l| l.starts_with("at ") && l.contains("crates/") && !l.contains("allocations.rs"))
        .collect();
    (count, places.join("\n      "))
}

/// Runs that allocate for a reason, by the end of their name.
const EXCEPTIONS: &[(&str, &str)] = &[
    (
        "nsgs_colored threads=2",
        "rayon allocates the jobs that it hands to its threads, once a sweep",
    ),
    ("inner=conic", "Clarabel allocates vectors and a copy of its settings in every solve"),
    ("inner=clarabel", "as above"),
    ("/lemke ", FACTORS),
    ("/lemke basis=tableau", "the last basis is refined, once, in a buffer of its own"),
    ("/lemke basis=dense", FACTORS),
    ("/lemke basis=sparse", FACTORS),
    ("/lemke ties=perturbed", FACTORS),
    ("/lemke covering=row_norms", FACTORS),
    ("/lemke covering=random", FACTORS),
];

/// The same by a part of the name.
const COMPOSED_EXCEPTIONS: &[(&str, &str)] =
    &[("ncp/", "expressions are stated anew, and sparse factors made"), ("glocker/", "as above")];

/// Why Lemke's method on a factorised basis allocates; the tableau does not.
const FACTORS: &str =
    "faer's factors are made anew when the basis is renewed, and solve in buffers of their own";

/// The same of linear problems, by the beginning of their name.
const LINEAR_EXCEPTIONS: &[(&str, &str)] = &[
    ("auto", "asks for the class of M, and keeps its plan"),
    ("qp", "Clarabel, and faer's factors of the polish"),
    ("newton_", FACTORS),
    ("block_pivoting", FACTORS),
    ("ip_", "what could refute the problem is gathered in short vectors of its own"),
    ("enumeration", "a tableau for each case that is open"),
    ("tnnmg", "matrices of the levels, which are those of the face, are made anew when it changes"),
];

fn excepted(kind: &str, name: &str) -> bool {
    let linear =
        kind == LINEAR && LINEAR_EXCEPTIONS.iter().any(|(begin, _)| name.starts_with(begin));
    let composed = COMPOSED_EXCEPTIONS.iter().any(|(part, _)| name.contains(part));
    linear || composed || EXCEPTIONS.iter().any(|(end, _)| name.ends_with(end))
}

/// The kind of problem that `LINEAR_EXCEPTIONS` are of.
const LINEAR: &str = "LCP";

/// Every solver of `P`, each with its default settings and with every variant that the registry lists.
fn sessions<P: Registered>() -> Vec<(String, Box<dyn Session<P>>)> {
    let mut all = vec![];
    // Of games, which these problems are not, it makes the strategies anew.
    let names = registry::solver_names::<P>().into_iter().filter(|n| !n.ends_with("lemke_howson"));
    for name in names {
        let about = registry::about::<P>(&name).expect("listed");
        let variants = about.variants.iter().map(|v| vec![*v]);
        for texts in std::iter::once(vec![]).chain(variants) {
            let settings =
                nonsmooth_solve::settings::from_texts(&texts).expect("a variant is key=value");
            let session = registry::session::<P>(&name, &settings).expect("a variant is valid");
            all.push((format!("{name} {}", texts.join(" ")), session));
        }
    }
    all
}

/// A tolerance out of reach, so that the iterations decide.
fn limits(max_iterations: usize) -> Limits {
    Limits { tolerance: f64::MIN_POSITIVE, max_iterations, ..Limits::default() }
}

/// What is wrong, and with whom.
type Found = Vec<(String, String)>;

/// Solves `first`, then `second`, with every solver; what the second solve allocated.
fn second_solves<P: Registered>(kind: &str, first: &P, second: &P) -> Found {
    let mut found = vec![];
    for (name, mut session) in sessions::<P>() {
        let mut point = first.origin();
        let mut watched = 0;
        session.solve(first, &mut point, &limits(30), &mut |_| {}).expect("valid");
        let mut point = second.origin();
        let (count, places) = traced(|| {
            session.solve(second, &mut point, &limits(30), &mut |_| watched += 1).expect("valid");
        });
        assert!(watched > 0, "{kind}, {name}: no iterations");
        if count.calls > 0 && !excepted(kind, &name) {
            found.push((
                format!("{kind}: the first at\n      {places}"),
                format!("{name} ({}, {} bytes)", count.calls, count.bytes),
            ));
        }
    }
    found
}

/// What the first solve of every solver allocates in a short and in a long solve, where they differ.
fn growing<P: Registered>(kind: &str, problem: &P) -> Found {
    let mut found = vec![];
    for ((name, mut short), (_, mut long)) in sessions::<P>().into_iter().zip(sessions::<P>()) {
        let mut iterations = [0; 2];
        let mut count = |session: &mut Box<dyn Session<P>>, k: usize, max: usize| {
            let mut point = problem.origin();
            let count = counted(|| {
                let outcome = session.solve(problem, &mut point, &limits(max), &mut |_| {});
                iterations[k] = outcome.expect("valid").iterations;
            });
            (count, iterations[k])
        };
        // Some end by themselves after a few steps; some factorise for the first time after more than ten, and `auto` may make its interior point after thirty.
        let (many, most) = count(&mut long, 1, 200);
        let (few, _) = count(&mut short, 0, 50.min(most / 2));
        assert!(iterations[0] < iterations[1], "{kind}, {name}: too easy");
        if few.calls != many.calls && !excepted(kind, &name) {
            found.push((
                format!("{kind}: they grow with the iterations"),
                format!(
                    "{name} ({} in {} iterations, {} in {})",
                    few.calls, iterations[0], many.calls, iterations[1]
                ),
            ));
        }
    }
    found
}

fn report(found: impl IntoIterator<Item = Found>) {
    let mut by_place = BTreeMap::<_, Vec<_>>::new();
    for (what, who) in found.into_iter().flatten() {
        by_place.entry(what).or_default().push(who);
    }
    let lines: Vec<_> = (by_place.iter())
        .map(|(what, who)| format!("allocations, {what}\n   by {}", who.join(", ")))
        .collect();
    assert!(lines.is_empty(), "\n{}", lines.join("\n"));
}

fn planted(bilateral: usize) -> Planted {
    Planted { bilateral, seed: 3, ..Planted::default() }
}

/// A local problem, and one of its shape with every value different.
fn locals<const D: usize>() -> [FrictionLocal<D>; 2] {
    let (first, _) = planted(0).local::<D>();
    let w = first.W.to_csc();
    let scaled = w.triplets().map(|(i, j, x)| (i, j, 1.25 * x));
    let scaled = Csc::from_triplets(w.nrows(), w.ncols(), scaled).expect("in range");
    let second = FrictionLocal::new(
        Bsr::from_csc(&scaled),
        first.q.iter().map(|q| 0.5 * q - 0.1).collect(),
        first.mu.iter().map(|mu| 0.9 * mu).collect(),
    );
    [first, second.expect("valid")]
}

/// A global problem, and one with the same matrices and every vector different.
fn globals<const D: usize>(bilateral: usize) -> [FrictionGlobal<D>; 2] {
    let (first, _) = planted(bilateral).global::<D>();
    let mut second = first.clone();
    second.f.iter_mut().for_each(|f| *f = 0.5 * *f - 0.1);
    second.w.iter_mut().for_each(|w| *w = 0.5 * *w - 0.1);
    second.mu.iter_mut().for_each(|mu| *mu *= 0.9);
    if let Some(b) = &mut second.rows {
        b.b.iter_mut().for_each(|b| *b *= 0.5);
    }
    [first, second]
}

#[test]
fn the_counter_counts() {
    let mut kept = None;
    let (count, places) = traced(|| kept = Some(vec![0.0_f64; 100]));
    assert_eq!((count.calls, count.bytes), (1, 800));
    assert!(places.is_empty(), "no frame of the project's sources: {places}");
    assert_eq!(counted(|| kept = None).calls, 0);
    assert!(kept.is_none());
}

#[test]
fn a_second_local_solve_of_the_same_shape_allocates_nothing() {
    let ([a2, b2], [a3, b3]) = (locals::<2>(), locals::<3>());
    report([second_solves("local 2D", &a2, &b2), second_solves("local 3D", &a3, &b3)]);
}

/// An LCP that every method takes, and another with the same pattern.
fn linear() -> [Lcp; 2] {
    let (first, _) = PlantedLcp { n: 16, seed: 3, ..PlantedLcp::default() }.lcp();
    let mut m = first.M.to_dense().expect("entries");
    m.values_mut().iter_mut().for_each(|x| *x *= 1.25);
    let q = first.q.iter().map(|q| 0.5 * q - 0.1).collect();
    let second = Lcp::new(m, q).expect("valid");
    [first, second]
}

#[test]
fn a_second_solve_of_a_linear_problem_allocates_nothing() {
    let [a, b] = linear();
    report([second_solves(LINEAR, &a, &b)]);
}

#[test]
fn a_second_global_solve_with_the_same_matrices_allocates_nothing() {
    let ([a2, b2], [a3, b3]) = (globals::<2>(0), globals::<3>(0));
    let [a, b] = globals::<3>(4);
    report([
        second_solves("global 2D", &a2, &b2),
        second_solves("global 3D", &a3, &b3),
        second_solves("global 3D with bilateral constraints", &a, &b),
    ]);
}

#[test]
fn iterations_allocate_nothing() {
    report([
        growing("local 2D", &planted(0).local::<2>().0),
        growing("local 3D", &planted(0).local::<3>().0),
        growing("local 3D with bilateral constraints", &planted(4).local::<3>().0),
        growing("global 2D", &planted(0).global::<2>().0),
        growing("global 3D", &planted(0).global::<3>().0),
        growing("global 3D with bilateral constraints", &planted(4).global::<3>().0),
    ]);
}

#[test]
fn factorising_and_solving_allocate_nothing() {
    // A grid of bodies that is large enough for fronts of all sizes.
    let n = 20_u32;
    let right = (0..n * n).filter(|k| (k + 1) % n != 0).map(|k| (k, k + 1));
    let up = (0..n * n - n).map(|k| (k, k + n));
    let edges: Vec<_> = right.chain(up).collect();
    let mut lu = BlockLu::new(&vec![6; (n * n) as usize], edges.iter().copied()).unwrap();
    let block: [f64; 36] = std::array::from_fn(|k| (k as f64).sin());
    let strong: [f64; 36] = std::array::from_fn(|k| if k % 7 == 0 { 100.0 } else { 0.0 });
    let slots: Vec<_> = edges.iter().map(|&(i, j)| lu.slot(i as usize, j as usize)).collect();
    let diagonal: Vec<_> = (0..(n * n) as usize).map(|i| lu.slot(i, i)).collect();
    let mut x = vec![1.0; lu.dim()];
    let mut once = || {
        lu.clear();
        slots.iter().for_each(|&s| lu.add_at(s, &block));
        diagonal.iter().for_each(|&s| lu.add_at(s, &strong));
        lu.factorise().expect("diagonally dominant");
        lu.solve(&mut x);
    };
    // The first one makes room.
    once();
    let count = counted(|| (0..2).for_each(|_| once()));
    assert_eq!((count.calls, lu.perturbed()), (0, 0));
    assert!(x.iter().all(|x| x.is_finite()));
}

//! `auto` as long as the limits allow, and verdicts within them.

use nonsmooth_linalg::{Csc, Dense, Matrix};
use nonsmooth_problem::field::Expressions;
use nonsmooth_problem::{AnyProblem, BoxLcp, Lcp, LcpPoint, Mcp, Mlcp, Problem};
use nonsmooth_solve::{Limit, Solve, Status};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// M of independent entries, of no class at all, and z, w that solve the problem.
fn planted(n: usize, seed: u64) -> [AnyProblem; 3] {
    let mut rng = Pcg64::seed_from_u64(seed);
    let dense = Dense::from_fn(n, n, |_, _| (0..6).map(|_| rng.random_range(-1.0..1.0)).sum());
    let m = Matrix::from(dense);
    let q = |z: &[f64], w: &[f64]| {
        let mut product = vec![0.0; n];
        m.mul(z, &mut product);
        w.iter().zip(product).map(|(w, p)| w - p).collect::<Vec<f64>>()
    };
    let (mut z, mut w) = (vec![0.0; n], vec![0.0; n]);
    for i in 0..n {
        *if rng.random_bool(0.5) { &mut z[i] } else { &mut w[i] } = rng.random_range(0.1..2.0);
    }
    let lcp = Lcp::new(m.clone(), q(&z, &w)).unwrap();
    let free = n / 3;
    w[..free].fill(0.0);
    let mlcp = Mlcp::new(m.clone(), q(&z, &w), free).unwrap();
    let (lower, upper) = (vec![-1.0; n], vec![1.0; n]);
    for i in 0..n {
        let x: f64 = rng.random_range(-2.0..2.0);
        (z[i], w[i]) = (x.clamp(-1.0, 1.0), x.clamp(-1.0, 1.0) - x);
    }
    let boxed = BoxLcp::new(m.clone(), q(&z, &w), lower, upper).unwrap();
    [lcp.into(), mlcp.into(), boxed.into()]
}

#[test]
fn auto_goes_on_with_other_starts_until_its_time_is_over() {
    let mut longest = 0;
    for seed in 0..4 {
        for problem in planted(70, seed) {
            let answer = Solve::new().time_limit(0.7).run(&problem).unwrap();
            let kind = problem.kind().name();
            let ended = matches!(answer.status, Status::Solved | Status::Limit(Limit::Time));
            assert!(ended, "{kind} {seed}: {} {:#?}", answer.status, answer.account);
            assert!(answer.verdict.measure.relative.is_finite());
            longest = longest.max(answer.account.len());
        }
    }
    assert!(longest > 10, "{longest}");
}

#[test]
fn what_has_ended_by_itself_is_not_tried_again_from_the_same_point() {
    let [problem, ..] = planted(70, 1);
    let answer = Solve::new().time_limit(0.7).run(&problem).unwrap();
    let heads: Vec<&String> = answer.account.iter().filter(|l| !l.starts_with(' ')).collect();
    let patient = heads.iter().filter(|l| l.starts_with("lemke (with patience)")).count();
    assert!(patient <= 3, "{heads:#?}");
}

#[test]
fn a_plan_is_the_same_each_time() {
    // Within its iterations, which no clock decides.
    let [problem, ..] = planted(25, 3);
    let run = || Solve::new().max_iterations(3000).run(&problem).unwrap();
    let (a, b) = (run(), run());
    assert_eq!((a.status, a.iterations, a.account), (b.status, b.iterations, b.account));
}

#[test]
fn units_of_rows_do_not_matter_to_methods_of_nonlinear_problems() {
    for (first, second) in [(-500, -500), (-60, 0), (0, -400), (510, 490), (-300, 300)] {
        let [a, b] = [first, second].map(|k| 2_f64.powi(k));
        let rows =
            [format!("{a:e}*x1^2 - {a:e}"), format!("{b:e}*x2^3 + {b:e}*x1 - {:e}", 3.0 * b)];
        let f = Expressions::parse(&rows, &[]).unwrap();
        let problem = Mcp::new(f, vec![0.0; 2], vec![f64::INFINITY; 2], vec![0.0; 2]).unwrap();
        let answer = Solve::new().time_limit(10.0).run(&problem).unwrap();
        assert!(answer.is_solved(), "{first} {second}: {} {:#?}", answer.status, answer.account);
    }
}

#[test]
fn a_verdict_does_not_contradict_a_solve_that_its_limit_has_ended() {
    // The rounding of the solution is 1e140 units of q, and only exact arithmetic, which is over by then, tells that there is nothing else.
    let n = 300;
    let entry = |i: usize, j: usize| match j.cmp(&i) {
        std::cmp::Ordering::Less => -2.0,
        std::cmp::Ordering::Equal => 1.0,
        std::cmp::Ordering::Greater => 0.0,
    };
    let problem = Lcp::new(Dense::from_fn(n, n, entry), vec![-1.0; n]).unwrap();
    let solved = Solve::new().run(&problem).unwrap();
    assert!(solved.is_solved() && solved.verdict.solved, "{:#?}", solved.account);
    let again = Solve::new().solver("lemke").warm(&solved.point).time_limit(0.0);
    let late = again.run(&problem).unwrap();
    assert_eq!(late.is_solved(), late.verdict.solved, "{}", late.status);
    let zero = LcpPoint { z: vec![0.0; n] };
    assert!(!Solve::new().warm(&zero).time_limit(0.0).run(&problem).unwrap().verdict.solved);
}

/// `−Δu = λ eᵘ` on m × m points with `0 ≤ u ≤ bound`.
fn bratu(m: usize, lambda: f64, bound: f64) -> Mcp {
    let h = ((m + 1) * (m + 1)) as f64;
    let rows = (0..m * m).map(|k| {
        let (i, j) = (k / m, k % m);
        let sides = [(i > 0, k.wrapping_sub(m)), (i + 1 < m, k + m)];
        let sides = sides.into_iter().chain([(j > 0, k.wrapping_sub(1)), (j + 1 < m, k + 1)]);
        let sides = sides.filter(|side| side.0).map(|(_, k)| format!(" - {h}*x{}", k + 1));
        format!("{}*x{1} - {lambda}*exp(x{1}){2}", 4.0 * h, k + 1, sides.collect::<String>())
    });
    let f = Expressions::parse(&rows.collect::<Vec<_>>(), &[]).unwrap();
    Mcp::new(f, vec![0.0; m * m], vec![bound; m * m], vec![0.0; m * m]).unwrap()
}

/// A crash finds the face row of points by row of points, and leaves no iterations for the rest.
#[test]
fn auto_takes_few_steps_on_grids_whose_face_moves() {
    let answer = Solve::new().run(&bratu(32, 6.8, 4.0)).unwrap();
    assert!(answer.is_solved(), "{}", answer.status);
    assert!(answer.iterations < 50, "{} {:#?}", answer.iterations, answer.account);
}

/// Drivers to two destinations in a ring of streets and as many across, some at random: flows f of each street to each destination, and the times T that they have to go, `a + b (f/c)⁴ + T_j − T_i ≥ 0 ⟂ f ≥ 0` and
/// what comes in and starts goes out, T ≥ 0 (Aashtiani and Magnanti's form). Streets, costs a, b and capacities c with the problem.
struct Traffic {
    problem: Mcp,
    streets: Vec<(usize, usize)>,
    costs: Vec<[f64; 3]>,
    nodes: usize,
}

const DESTINATIONS: usize = 2;

impl Traffic {
    fn new(nodes: usize, across: usize, seed: u64) -> Self {
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut streets: Vec<_> = (0..nodes).map(|i| (i, (i + 1) % nodes)).collect();
        streets.extend((0..across).map(|_| {
            let from = rng.random_range(0..nodes);
            (from, (from + rng.random_range(1..nodes)) % nodes)
        }));
        let mut uniform = |low: f64, high: f64| rng.random_range(low..high);
        let costs: Vec<[f64; 3]> = streets
            .iter()
            .map(|_| [uniform(1.0, 5.0), uniform(0.1, 1.0), uniform(1.0, 5.0)])
            .collect();
        let flow = |street: usize, to: usize| format!("x{}", street * DESTINATIONS + to + 1);
        let flows = streets.len() * DESTINATIONS;
        // No time to go at the destination itself.
        let places = (0..DESTINATIONS).flat_map(|to| (0..nodes).map(move |i| (i, to)));
        let places: Vec<_> = places.filter(|(i, to)| i != to).collect();
        let time = |place: (usize, usize), sign: &str| {
            let at = places.iter().position(|p| *p == place);
            at.map_or(String::new(), |k| format!(" {sign} x{}", flows + k + 1))
        };
        let mut rows = vec![];
        for (k, (&(i, j), [a, b, c])) in streets.iter().zip(&costs).enumerate() {
            for to in 0..DESTINATIONS {
                let cost = format!("{a} + {b}*(({} + {})/{c})^4", flow(k, 0), flow(k, 1));
                rows.push(format!("{cost}{}{}", time((j, to), "+"), time((i, to), "-")));
            }
        }
        for &(i, to) in &places {
            let ends = streets.iter().enumerate().flat_map(|(k, s)| {
                [(s.0, "+"), (s.1, "-")].map(|(end, sign)| (end, sign, flow(k, to)))
            });
            let balance = ends.filter(|e| e.0 == i).map(|(_, sign, f)| format!("{sign} {f} "));
            rows.push(format!("0 {}- {}", balance.collect::<String>(), uniform(0.0, 4.0)));
        }
        let n = rows.len();
        let f = Expressions::parse(&rows, &[]).unwrap();
        let problem = Mcp::new(f, vec![0.0; n], vec![f64::INFINITY; n], vec![1.0; n]).unwrap();
        Self { problem, streets, costs, nodes }
    }

    /// By how much drivers take longer than on the quickest way, which Bellman and Ford find.
    fn detour(&self, x: &[f64]) -> f64 {
        let flow = |k: usize, to: usize| x[k * DESTINATIONS + to];
        let taken = |k: usize| flow(k, 0) + flow(k, 1);
        let costs: Vec<f64> =
            (0..).zip(&self.costs).map(|(k, [a, b, c])| a + b * (taken(k) / c).powi(4)).collect();
        let mut worst: f64 = 0.0;
        for to in 0..DESTINATIONS {
            let mut time = vec![f64::INFINITY; self.nodes];
            time[to] = 0.0;
            for _ in 0..self.nodes {
                for (&(i, j), cost) in self.streets.iter().zip(&costs) {
                    time[i] = time[i].min(cost + time[j]);
                }
            }
            for (k, (&(i, j), cost)) in self.streets.iter().zip(&costs).enumerate() {
                if flow(k, to) > 1e-6 {
                    worst = worst.max(cost + time[j] - time[i]);
                }
            }
        }
        worst
    }
}

#[test]
fn auto_finds_equilibria_of_traffic() {
    let mut late = 0;
    for seed in 0..24 {
        let traffic = Traffic::new(8 + seed as usize % 4 * 2, 12, seed);
        let answer = Solve::new().max_iterations(4000).run(&traffic.problem).unwrap();
        assert!(answer.is_solved(), "{seed}: {} {:#?}", answer.status, answer.account);
        let detour = traffic.detour(&answer.point.z);
        assert!(detour < 1e-5, "{seed}: {detour:e}");
        late += usize::from(answer.iterations > 1000);
    }
    // Some are not for the first methods.
    assert!(late > 0);
}

/// A linear program with its dual, some of whose variables cost nothing: the prices of what they yield are zero, and no point has all of z and w positive.
#[test]
fn auto_leaves_interior_points_in_time_where_there_is_no_interior() {
    let (n, m) = (800, 400);
    let mut rng = Pcg64::seed_from_u64(1);
    let mut entries = vec![];
    for j in 0..n {
        for _ in 0..4 {
            let (i, a) = (rng.random_range(0..m), rng.random_range(0.1..1.0));
            entries.extend([(n + i, j, a), (j, n + i, -a)]);
        }
    }
    const FREE: usize = 40;
    let unpriced: Vec<usize> = entries.iter().filter(|e| e.1 < FREE).map(|e| e.0).collect();
    let matrix = Csc::from_triplets(n + m, n + m, entries.into_iter()).unwrap();
    let pair = |_| match rng.random_range(0..4) {
        0 => (0.0, 0.0),
        1 => (0.0, rng.random_range(0.0..1.0)),
        _ => (rng.random_range(0.0..1.0), 0.0),
    };
    let (mut z, mut w): (Vec<f64>, Vec<f64>) = (0..n + m).map(pair).unzip();
    z[..FREE].fill(0.5);
    w[..FREE].fill(0.0);
    unpriced.iter().for_each(|&i| z[i] = 0.0);
    let mut q = vec![0.0; n + m];
    matrix.mul_add(1.0, &z, &mut q);
    q.iter_mut().zip(&w).for_each(|(q, w)| *q = w - *q);
    let answer = Solve::new().run(&Lcp::new(matrix, q).unwrap()).unwrap();
    assert!(answer.is_solved(), "{} {:#?}", answer.status, answer.account);
    // Its own end comes after some hundred and twenty.
    let left = |line: &String| {
        line.starts_with("ip_mehrotra") && line.contains("limit reached after 60 iterations")
    };
    assert!(answer.account.iter().any(left), "{:#?}", answer.account);
}

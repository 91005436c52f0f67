//! Small problems of integers, in all units: what is called solved has a solution, what is called infeasible has none. Who is right says an enumeration of all
//! complementary bases in exact arithmetic.

use std::collections::BTreeMap;

use nonsmooth_linalg::Dense;
use nonsmooth_problem::{BoxLcp, Hlcp, Lcp, Mlcp, Problem};
use nonsmooth_solve::registry::{self, Registered};
use nonsmooth_solve::settings::SettingsMap;
use nonsmooth_solve::{Limits, Status};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

type Column = Vec<i64>;

/// The nonnegative combination of the columns that is b, if they are independent and there is one: by elimination without fractions.
fn combines(columns: &[&Column], b: &[i64]) -> bool {
    let (m, k) = (b.len(), columns.len());
    let entry = |i: usize, j: usize| i128::from(if j < k { columns[j][i] } else { b[i] });
    let mut a: Vec<Vec<i128>> = (0..m).map(|i| (0..=k).map(|j| entry(i, j)).collect()).collect();
    let mut last = 1;
    for step in 0..k {
        let Some(pivot) = (step..m).find(|&i| a[i][step] != 0) else { return false };
        a.swap(step, pivot);
        let pivotal = a[step].clone();
        for (_, row) in a.iter_mut().enumerate().filter(|e| e.0 != step) {
            let factor = row[step];
            for (x, p) in row.iter_mut().zip(&pivotal) {
                // Bareiss: the division is exact, above the pivot as well.
                *x = (*x * pivotal[step] - factor * p) / last;
            }
        }
        last = pivotal[step];
    }
    // What is left is diagonal: last · x = a[·][k].
    (k..m).all(|i| a[i][k] == 0) && (0..k).all(|i| a[i][k] * last.signum() >= 0)
}

/// Whether b is a nonnegative combination of at most one column of each group: basic solutions are enough.
fn solvable(groups: &[Vec<Column>], b: &[i64]) -> bool {
    fn go<'a>(groups: &'a [Vec<Column>], chosen: &mut Vec<&'a Column>, b: &[i64]) -> bool {
        let Some((first, rest)) = groups.split_first() else { return combines(chosen, b) };
        if go(rest, chosen, b) {
            return true;
        }
        first.iter().any(|column| {
            chosen.push(column);
            let found = chosen.len() <= b.len() && go(rest, chosen, b);
            chosen.pop();
            found
        })
    }
    go(groups, &mut vec![], b)
}

fn unit(m: usize, i: usize, sign: i64) -> Column {
    (0..m).map(|k| if k == i { sign } else { 0 }).collect()
}

/// Column j of M times a sign.
fn column(m: &[Vec<i64>], j: usize, sign: i64) -> Column {
    m.iter().map(|row| sign * row[j]).collect()
}

/// Whether `w = M z + q` has a solution with these equalities and free variables.
fn mixed_solvable(m: &[Vec<i64>], q: &[i64], free: usize) -> bool {
    let n = q.len();
    let groups: Vec<_> = (0..n)
        .map(|j| match j < free {
            true => vec![column(m, j, 1), column(m, j, -1)],
            false => vec![unit(n, j, 1), column(m, j, -1)],
        })
        .collect();
    solvable(&groups, q)
}

/// The same between bounds. A variable with two of them is tried at each, and between: `z − l + slack = u − l`, one more row.
fn box_solvable(m: &[Vec<i64>], q: &[i64], bounds: &[(Option<i64>, Option<i64>)]) -> bool {
    let n = q.len();
    let both: Vec<_> = (0..n).filter(|&j| matches!(bounds[j], (Some(_), Some(_)))).collect();
    (0..3_usize.pow(both.len() as u32)).any(|code| {
        let choice = |j: usize| {
            both.iter().position(|&k| k == j).map(|at| code / 3_usize.pow(at as u32) % 3)
        };
        let between: Vec<_> = both.iter().copied().filter(|&j| choice(j) == Some(2)).collect();
        let size = n + between.len();
        let long = |mut c: Column| {
            c.resize(size, 0);
            c
        };
        // From where each variable is counted.
        let from = |j: usize| match (bounds[j], choice(j)) {
            ((_, Some(u)), Some(1)) | ((None, Some(u)), _) => u,
            ((Some(l), _), _) => l,
            _ => 0,
        };
        let mut b: Column =
            (0..n).map(|i| q[i] + (0..n).map(|j| m[i][j] * from(j)).sum::<i64>()).collect();
        let mut groups = vec![];
        for j in 0..n {
            let there = |sign| long(column(m, j, sign));
            let group = match (bounds[j], choice(j)) {
                (_, Some(0)) => vec![unit(size, j, 1)],
                (_, Some(1)) => vec![unit(size, j, -1)],
                ((Some(l), Some(u)), _) => {
                    let row = n + between.iter().position(|&k| k == j).unwrap();
                    let mut inside = there(-1);
                    inside[row] = 1;
                    b.resize(size, 0);
                    b[row] = u - l;
                    groups.push(vec![unit(size, row, 1)]);
                    vec![inside]
                }
                ((Some(_), None), _) => vec![unit(size, j, 1), there(-1)],
                ((None, Some(_)), _) => vec![unit(size, j, -1), there(1)],
                ((None, None), _) => vec![there(1), there(-1)],
            };
            groups.push(group);
        }
        solvable(&groups, &long(b))
    })
}

/// How solvers ended, by solver, whether there is a solution, and status.
type Counts = BTreeMap<(String, bool, &'static str), usize>;

fn ask<P: Registered>(
    problem: &P,
    solvers: &[&str],
    exists: bool,
    what: &str,
    counts: &mut Counts,
) -> Vec<&'static str> {
    let limits = Limits { max_iterations: 20_000, ..Limits::default() };
    let mut said = vec![];
    for solver in solvers {
        let mut session = registry::session::<P>(solver, &SettingsMap::new()).unwrap();
        let mut point = problem.origin();
        let status = match session.solve(problem, &mut point, &limits, &mut |_| {}) {
            Ok(outcome) => outcome.status,
            Err(e) if e.is_inapplicable() => continue,
            Err(e) => panic!("{e}"),
        };
        assert!(status != Status::Solved || exists, "{solver} says solved: {what}");
        assert!(!matches!(status, Status::Infeasible(_)) || !exists, "{solver} refutes: {what}");
        *counts.entry(((*solver).to_owned(), exists, status.name())).or_default() += 1;
        said.push(status.name());
    }
    said
}

fn integers(rng: &mut Pcg64Mcg, m: usize, n: usize, most: i64, zeros: f64) -> Vec<Vec<i64>> {
    let entry = |rng: &mut Pcg64Mcg| {
        if rng.random_bool(zeros) { 0 } else { rng.random_range(-most..=most) }
    };
    (0..m).map(|_| (0..n).map(|_| entry(rng)).collect()).collect()
}

fn powers(rng: &mut Pcg64Mcg, n: usize, most: i32) -> Vec<f64> {
    (0..n).map(|_| f64::from(rng.random_range(-most..=most)).exp2()).collect()
}

fn dense(m: &[Vec<i64>], rows: &[f64], columns: &[f64]) -> Dense {
    Dense::from_fn(m.len(), columns.len(), |i, j| rows[i] * m[i][j] as f64 * columns[j])
}

fn times(q: &[i64], rows: &[f64]) -> Vec<f64> {
    q.iter().zip(rows).map(|(q, r)| *q as f64 * r).collect()
}

const LCP: [&str; 10] = [
    "auto",
    "lemke",
    "enumeration",
    "ip_mehrotra",
    "newton_min",
    "newton_fb",
    "psor",
    "keller",
    "block_pivoting",
    "ip_mty",
];
const MLCP: [&str; 7] =
    ["auto", "lemke", "enumeration", "ip_mehrotra", "newton_min", "newton_fb", "ip_mty"];
const BOX: [&str; 6] =
    ["auto", "newton_min", "newton_fb", "psor", "split/lemke", "split/ip_mehrotra"];
const HLCP: [&str; 5] = ["auto", "ip_mehrotra", "ip_mty", "mixed/lemke", "mixed/newton_fb"];

#[test]
fn solved_and_infeasible_are_true_in_all_units() {
    let cases = std::env::var("NONSMOOTH_CASES").map_or(150, |n| n.parse().unwrap());
    let mut counts: [Counts; 4] = Default::default();
    let mut changed = [0; 4];
    for seed in 0..cases {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let n = rng.random_range(2..=4);
        let zeros = [0.2, 0.5][rng.random_range(0..2)];
        let (m, r) = (integers(&mut rng, n, n, 3, zeros), integers(&mut rng, n, n, 3, zeros));
        let q: Vec<i64> = (0..n).map(|_| rng.random_range(-3..=3)).collect();
        let free = rng.random_range(1..n);
        let bounds: Vec<_> = (0..n)
            .map(|_| match rng.random_range(0..4) {
                0 => (None, Some(rng.random_range(-1..=1_i64))),
                1 => (None, None),
                2 => (Some(0), Some(rng.random_range(1..=2))),
                _ => (Some(rng.random_range(-1..=1)), None),
            })
            .collect();
        let exists = [
            mixed_solvable(&m, &q, 0),
            mixed_solvable(&m, &q, free),
            box_solvable(&m, &q, &bounds),
            solvable(
                &(0..n).map(|j| vec![column(&m, j, 1), column(&r, j, 1)]).collect::<Vec<_>>(),
                &q,
            ),
        ];
        let mut said = vec![];
        for most in [0, 8, 40] {
            let (rows, columns) = (powers(&mut rng, n, most), powers(&mut rng, n, most));
            let (a, b) = (dense(&m, &rows, &columns), times(&q, &rows));
            let what = format!("{m:?} {q:?}, seed {seed}, 2^{most}");
            let lcp = Lcp::new(a.clone(), b.clone()).unwrap();
            let one = ask(&lcp, &LCP, exists[0], &what, &mut counts[0]);
            let mlcp = Mlcp::new(a.clone(), b.clone(), free).unwrap();
            let two = ask(&mlcp, &MLCP, exists[1], &format!("{what}, {free} free"), &mut counts[1]);
            let bound =
                |j: usize, b: Option<i64>, none: f64| b.map_or(none, |b| b as f64 / columns[j]);
            let l = (0..n).map(|j| bound(j, bounds[j].0, f64::NEG_INFINITY)).collect();
            let u = (0..n).map(|j| bound(j, bounds[j].1, f64::INFINITY)).collect();
            let boxed = BoxLcp::new(a.clone(), b.clone(), l, u).unwrap();
            let three = ask(&boxed, &BOX, exists[2], &format!("{what} {bounds:?}"), &mut counts[2]);
            let of_s = powers(&mut rng, n, most);
            let hlcp = Hlcp::new(a, dense(&r, &rows, &of_s), b).unwrap();
            let four = ask(&hlcp, &HLCP, exists[3], &format!("{what} {r:?}"), &mut counts[3]);
            said.push([one[0], two[0], three[0], four[0]]);
        }
        for (k, changed) in changed.iter_mut().enumerate() {
            *changed += usize::from(said.iter().any(|s| s[k] != said[0][k]));
        }
    }
    for (k, kind) in ["LCP", "MLCP", "box LCP", "horizontal LCP"].iter().enumerate() {
        println!("{kind}: auto's status depends on the units in {} of {cases}", changed[k]);
        for ((solver, exists, status), count) in &counts[k] {
            println!("  {solver:18} solvable {exists:5} {status:16} {count}");
        }
    }
}

#[test]
fn a_tolerance_beyond_doubles_is_named_and_not_chased() {
    // Thirds and sevenths are no doubles: whatever z is, some rows keep a last bit.
    let n = 40;
    let m = Dense::from_fn(n, n, |i, j| match i.abs_diff(j) {
        0 => 7.0 / 3.0,
        1 => -1.0 / 3.0,
        k => 0.1 / (7 * k * k) as f64,
    });
    let q = (0..n).map(|i| -1.0 / (i + 3) as f64).collect();
    let problem = Lcp::new(m, q).unwrap();
    let limits = Limits { tolerance: 1e-19, max_iterations: 1_000_000, ..Limits::default() };
    for solver in ["psor", "pgs", "projected_jacobi"] {
        let mut session = registry::session::<Lcp>(solver, &SettingsMap::new()).unwrap();
        let mut point = problem.origin();
        let outcome = session.solve(&problem, &mut point, &limits, &mut |_| {}).unwrap();
        let said = outcome.status.to_string();
        assert!(said.contains("rounding of the unknowns"), "{solver}: {said}");
        assert!(outcome.iterations < 10_000 && outcome.measure.relative < 1e-14, "{outcome:?}");
    }
}

#[test]
fn units_do_not_make_a_solution() {
    // Integers without a solution, in units that made the residual of the whole problem small.
    let p = f64::exp2;
    let two = Dense::from_rows(&[[0.0, p(34.0)], [3.0 * p(-16.0), 3.0]]).unwrap();
    let three = [[0.0, p(37.0), p(36.0)], [0.0, p(25.0), 3.0 * p(25.0)], [0.0, 0.0, 0.0]];
    let problems = [
        Lcp::new(two, vec![-p(17.0), -p(-17.0)]).unwrap(),
        Lcp::new(Dense::from_rows(&three).unwrap(), vec![-3.0 * p(14.0), 24.0, p(-21.0)]).unwrap(),
    ];
    for problem in problems {
        let said = ask(&problem, &LCP, false, "in units", &mut Counts::new());
        assert_eq!(said[0], "infeasible");
    }
}

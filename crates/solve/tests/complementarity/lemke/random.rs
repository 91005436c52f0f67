//! Random problems of known class: every basis takes the same pivots, whatever the scales and the ties.

use nonsmooth_linalg::{Csc, Dense, Matrix, norm};
use nonsmooth_problem::{Lcp, Problem};
use nonsmooth_solve::complementarity::pivoting::{Covering, Lemke, Ties};
use nonsmooth_solve::{Driver, Limits, Session, Solve, Status};
use rand::RngExt;

use super::{BASES, assert_close, from_fn, plain, rng, run, run_with, same_pivots};

#[derive(Debug, Clone, Copy, PartialEq)]
enum Class {
    /// A positive definite matrix that is not symmetric, so a P-matrix.
    Definite,
    /// `B Bᵀ` of half the rank, with redundant rows, and a skew part.
    Semidefinite,
    /// `B Bᵀ + N`, N ≥ 0 with few entries: copositive-plus on what matters.
    CopositivePlus,
    /// Entries of a P-matrix that is not definite: upper triangular, permuted.
    Triangular,
}

/// A problem with a planted solution: `share` of the pairs are zero on both sides.
fn planted(n: usize, class: Class, share: f64, seed: u64) -> (Lcp, Vec<f64>) {
    let mut rng = rng(seed);
    let mut uniform = || rng.random_range(-1.0..1.0_f64);
    let rank = if class == Class::Semidefinite { n.div_ceil(2) } else { n };
    let b = Dense::from_fn(n, rank, |_, _| uniform());
    let skew = Dense::from_fn(n, n, |_, _| uniform());
    let product = |i: usize, j: usize| -> f64 {
        b.row(i).iter().zip(b.row(j)).map(|(x, y)| x * y).sum::<f64>() / n as f64
    };
    let m = Dense::from_fn(n, n, |i, j| match class {
        Class::Definite => {
            product(i, j) + 0.5 * (skew[(i, j)] - skew[(j, i)]) + if i == j { 0.1 } else { 0.0 }
        }
        Class::Semidefinite => product(i, j) + 0.5 * (skew[(i, j)] - skew[(j, i)]),
        Class::CopositivePlus => product(i, j) + skew[(i, j)].abs() + f64::from(u8::from(i == j)),
        Class::Triangular => {
            let (a, b) = ((7 * i + 3) % n, (7 * j + 3) % n);
            if i == j {
                1.0
            } else if a < b {
                skew[(i, j)]
            } else {
                0.0
            }
        }
    });
    let (mut z, mut w) = (vec![0.0; n], vec![0.0; n]);
    for i in 0..n {
        let at = 0.5 + 0.5 * uniform();
        if at >= share {
            let which = if uniform() > 0.0 { &mut z } else { &mut w };
            which[i] = 1.5 + 0.5 * uniform();
        }
    }
    let m = Matrix::from(m);
    let mut q = vec![0.0; n];
    m.mul(&z, &mut q);
    q.iter_mut().zip(&w).for_each(|(q, w)| *q = w - *q);
    (Lcp::new(m, q).unwrap(), z)
}

#[test]
fn planted_problems_are_solved_by_the_same_pivots() {
    for class in [Class::Definite, Class::Semidefinite, Class::CopositivePlus, Class::Triangular] {
        for (n, share) in [(5, 0.0), (30, 0.1), (80, 0.5), (120, 0.0)] {
            for ties in [Ties::Lexicographic, Ties::Perturbed] {
                let (problem, z) = planted(n, class, share, n as u64);
                let what = format!("{class:?}, n = {n}, {share} degenerate, {ties:?}");
                let found = same_pivots(&problem, Lemke { ties, ..plain() }, &what);
                assert_eq!(found.outcome.status, Status::Solved, "{what}");
                if matches!(class, Class::Definite | Class::Triangular) {
                    let off: Vec<f64> = z.iter().zip(&found.z).map(|(a, b)| a - b).collect();
                    assert!(norm(&off) <= 1e-8 * norm(&z), "{what}: {}", norm(&off));
                }
                assert!(found.z.iter().all(|z| *z >= 0.0));
            }
        }
    }
}

#[test]
fn many_ties_are_broken() {
    // All rows tied at the start, and most of them ever after.
    for n in [20, 60, 150] {
        let mut rng = rng(n as u64);
        let signs = Dense::from_fn(n, n, |_, _| f64::from(rng.random_range(-1..2_i32)));
        let m = |i: usize, j: usize| signs[(i, j)] - signs[(j, i)] + if i == j { 1.0 } else { 0.0 };
        let problem = from_fn(n, m, |_| -1.0);
        for ties in [Ties::Lexicographic, Ties::Perturbed] {
            if n <= 60 {
                same_pivots(&problem, Lemke { ties, ..plain() }, "ties");
            }
            for basis in BASES {
                let found = run(&problem, Lemke { ties, basis, ..plain() });
                assert_eq!(found.outcome.status, Status::Solved, "n = {n}, {ties:?}, {basis:?}");
            }
        }
    }
}

#[test]
fn scales_of_rows_and_columns_do_not_matter() {
    for class in [Class::Definite, Class::Semidefinite] {
        for (n, seed) in [(30, 1), (100, 2)] {
            let (problem, _) = planted(n, class, 0.2, seed);
            let m = problem.M.to_dense().unwrap();
            let mut rng = rng(seed);
            let mut scale = || 10.0_f64.powf(rng.random_range(-8.0..8.0));
            let rows: Vec<f64> = (0..n).map(|_| scale()).collect();
            let columns: Vec<f64> = (0..n).map(|_| scale()).collect();
            let scaled =
                from_fn(n, |i, j| rows[i] * m[(i, j)] * columns[j], |i| rows[i] * problem.q[i]);
            for covering in [Covering::Auto, Covering::RowNorms, Covering::Ones] {
                let found = same_pivots(&scaled, Lemke { covering, ..plain() }, "scaled");
                assert_eq!(found.outcome.status, Status::Solved, "{class:?}, {n}, {covering:?}");
            }
        }
    }
}

#[test]
fn a_solution_is_a_first_basis() {
    let (problem, z) = planted(60, Class::Definite, 0.0, 5);
    let cold = run(&problem, Lemke::default());
    let warm = run_with(
        &problem,
        Lemke::default(),
        &z.iter().map(|z| 1.01 * z).collect::<Vec<_>>(),
        1e-11,
    );
    assert_eq!(warm.outcome.status, Status::Solved);
    assert!(warm.pivots.is_empty() && cold.pivots.len() > 10);
    // A few of the signs are wrong: a few pivots.
    let mut off = z.clone();
    for i in [3, 17, 40] {
        off[i] = if off[i] > 0.0 { 0.0 } else { 10.0 };
    }
    for basis in BASES {
        let settings = Lemke { basis, ..Lemke::default() };
        let warm = run_with(&problem, settings, &off, 1e-11);
        assert_eq!(warm.outcome.status, Status::Solved);
        assert!(
            warm.pivots.len() < cold.pivots.len(),
            "{} pivots, {} before",
            warm.pivots.len(),
            cold.pivots.len()
        );
        assert_close(&warm.z, &cold.z, "warm");
    }
}

#[test]
fn sparse_problems_of_some_size() {
    // The obstacle problem on a grid, and a random sparse matrix with a dominant diagonal.
    let k = 40_usize;
    let n = k * k;
    let mut entries = vec![];
    for i in 0..n {
        entries.push((i, i, 4.0));
        for j in [i.wrapping_sub(k), i + k] {
            if j < n {
                entries.push((i, j, -1.0));
            }
        }
        if i % k > 0 {
            entries.push((i, i - 1, -1.0));
        }
        if i % k + 1 < k {
            entries.push((i, i + 1, -1.0));
        }
    }
    let q: Vec<f64> = (0..n)
        .map(|i| {
            let (x, y) = ((i % k) as f64 / k as f64, (i / k) as f64 / k as f64);
            0.1 - 0.8 * (9.0 * x).sin() * (7.0 * y).cos()
        })
        .collect();
    let m = Csc::from_triplets(n, n, entries.iter().copied()).unwrap();
    let problem = Lcp::new(m, q).unwrap();
    let found = run(&problem, Lemke::default());
    assert_eq!(found.outcome.status, Status::Solved);
    assert!(found.outcome.measure.relative <= 1e-13);
    println!("{} pivots, {} factorisations", found.pivots.len(), found.outcome.factorisations);
}

/// All solutions of a small LCP whose complementary bases are regular: `None` where one is singular.
fn enumerated(problem: &Lcp) -> Option<Vec<Vec<f64>>> {
    let n = problem.dim();
    let m = problem.M.to_dense().unwrap();
    let mut found = vec![];
    for set in 0..1_u32 << n {
        let basic = |i: usize| set >> i & 1 == 1;
        // [I or −M] x = q.
        let mut t = Dense::from_fn(n, n + 1, |i, j| match j {
            _ if j == n => problem.q[i],
            _ if basic(j) => -m[(i, j)],
            _ => f64::from(u8::from(i == j)),
        });
        for c in 0..n {
            let r = (c..n).max_by(|&a, &b| t[(a, c)].abs().total_cmp(&t[(b, c)].abs())).unwrap();
            if t[(r, c)].abs() < 1e-9 {
                return None;
            }
            for j in 0..=n {
                (t[(r, j)], t[(c, j)]) = (t[(c, j)], t[(r, j)]);
            }
            let pivot = t[(c, c)];
            (0..=n).for_each(|j| t[(c, j)] /= pivot);
            for i in (0..n).filter(|&i| i != c) {
                let y = t[(i, c)];
                (0..=n).for_each(|j| t[(i, j)] -= y * t[(c, j)]);
            }
        }
        if (0..n).all(|i| t[(i, n)] >= -1e-9) {
            found.push((0..n).map(|i| if basic(i) { t[(i, n)].max(0.0) } else { 0.0 }).collect());
        }
    }
    Some(found)
}

#[test]
fn small_problems_of_any_class_agree_with_enumeration() {
    let (mut solved, mut refuted, mut open) = (0, 0, 0);
    for seed in 0..600 {
        let mut rng = rng(seed);
        let n = rng.random_range(2..6_usize);
        let m = Dense::from_fn(n, n, |_, _| f64::from(rng.random_range(-4..6_i32)));
        let q = (0..n).map(|_| f64::from(rng.random_range(-5..4_i32))).collect();
        let problem = Lcp::new(m, q).unwrap();
        let Some(all) = enumerated(&problem) else { continue };
        for basis in BASES {
            let found = run(&problem, Lemke { basis, ..Lemke::default() });
            match found.outcome.status {
                Status::Solved => {
                    solved += 1;
                    let near = |z: &Vec<f64>| {
                        z.iter().zip(&found.z).all(|(a, b)| (a - b).abs() < 1e-7 * (1.0 + a.abs()))
                    };
                    assert!(all.iter().any(near), "{seed}: {:?} is none of {all:?}", found.z);
                }
                Status::Infeasible(_) => {
                    refuted += 1;
                    assert!(all.is_empty(), "{seed}: {all:?}");
                }
                Status::NoConclusion(_) => open += 1,
                other => panic!("{seed}: {other:?}"),
            }
        }
    }
    println!("{solved} solved, {refuted} refuted, {open} open");
    assert!(solved > 500 && refuted > 50);
}

#[test]
fn almost_singular_problems_end() {
    for seed in 0..30 {
        let n = 40;
        let mut rng = rng(seed);
        let (problem, _) = planted(n, Class::Semidefinite, 0.3, seed);
        let m = problem.M.to_dense().unwrap();
        // Rows and columns twice, up to rounding, in scales that differ by 1e16.
        let mut noise = || 1.0 + 1e-14 * rng.random_range(-1.0..1.0_f64);
        let size = |i: usize| {
            if i.is_multiple_of(3) {
                1e-8
            } else if i.is_multiple_of(5) {
                1e8
            } else {
                1.0
            }
        };
        let twice =
            Dense::from_fn(2 * n, 2 * n, |i, j| size(i) * size(j) * m[(i % n, j % n)] * noise());
        let q = (0..2 * n).map(|i| size(i) * problem.q[i % n]).collect();
        let problem = Lcp::new(twice, q).unwrap();
        for basis in BASES {
            let found = run_with(&problem, Lemke { basis, ..plain() }, &[], 1e-8);
            let named = match &found.outcome.status {
                Status::Stalled(why) => !why.is_empty(),
                Status::Solved | Status::NoConclusion(_) => true,
                // It has a solution.
                _ => false,
            };
            assert!(named && found.outcome.iterations < 5000, "{:?}", found.outcome.status);
            if seed == 0 {
                println!("{basis:?}: {}", found.outcome.status);
            }
        }
    }
}

#[test]
fn a_session_solves_one_problem_after_another() {
    let mut driver = Driver::new(Lemke::default());
    for (n, seed) in [(20, 1), (20, 2), (60, 3), (20, 4), (60, 5)] {
        let (problem, z) = planted(n, Class::Definite, 0.0, seed);
        let mut point = problem.origin();
        let limits = Limits { tolerance: 1e-10, ..Limits::default() };
        let outcome = driver.solve(&problem, &mut point, &limits, &mut |_| {}).unwrap();
        assert_eq!(outcome.status, Status::Solved);
        let off: Vec<f64> = z.iter().zip(&point.z).map(|(a, b)| a - b).collect();
        assert!(norm(&off) <= 1e-8 * norm(&z));
        assert_eq!(driver.account().len(), 1, "{:?}", driver.account());
    }
}

#[test]
fn auto_leaves_long_paths_of_positive_matrices_to_this_method() {
    // Strictly copositive, neither monotone nor P: the path ends in a solution, and is longer than 5 n.
    for (seed, skew) in (0..3).flat_map(|seed| [(seed, 0.0), (seed, 3.0)]) {
        let n = 120;
        let mut rng = rng(seed);
        let mut m = Dense::from_fn(n, n, |_, _| rng.random_range(0.01..1.0));
        // What is skew changes no square.
        for (i, j) in (0..n).flat_map(|i| (0..i).map(move |j| (i, j))) {
            let x = skew * rng.random_range(-1.0..1.0);
            m.row_mut(i)[j] += x;
            m.row_mut(j)[i] -= x;
        }
        let mut z = vec![0.0; n];
        let mut slack = vec![0.0; n];
        for (z, w) in z.iter_mut().zip(&mut slack) {
            let x: f64 = rng.random_range(-1.0..1.0);
            (*z, *w) = (x.max(0.0), (-x).max(0.0));
        }
        let m = Matrix::from(m);
        let mut q = vec![0.0; n];
        m.mul(&z, &mut q);
        q.iter_mut().zip(&slack).for_each(|(q, w)| *q = w - *q);
        let answer = Solve::new().run(&Lcp::new(m, q).unwrap()).unwrap();
        assert_eq!(answer.status, Status::Solved, "{seed} {skew}");
        let others = ["newton", "ip_"];
        let other = |line: &String| others.iter().any(|name| line.starts_with(name));
        assert!(!answer.account.iter().any(other), "{seed} {skew}: {:#?}", answer.account);
    }
}

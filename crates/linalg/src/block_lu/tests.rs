use super::*;
use crate::budget::Budget;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// A matrix by blocks, and the same in full by rows.
struct Sample {
    lu: BlockLu,
    dense: Vec<f64>,
    n: usize,
}

/// Values by (node, row, node, column).
fn sample(
    sizes: &[usize],
    edges: &[(u32, u32)],
    mut value: impl FnMut(usize, usize, usize, usize) -> f64,
) -> Sample {
    let mut lu = BlockLu::new(sizes, edges.iter().copied()).unwrap();
    let first: Vec<usize> = sizes
        .iter()
        .scan(0, |sum, s| {
            *sum += s;
            Some(*sum - s)
        })
        .collect();
    let n = lu.dim();
    let mut dense = vec![0.0; n * n];
    let mut pairs: Vec<(usize, usize)> = (0..sizes.len()).map(|i| (i, i)).collect();
    for &(i, j) in edges {
        pairs.extend([(i as usize, j as usize), (j as usize, i as usize)]);
    }
    pairs.sort_unstable();
    pairs.dedup();
    for (i, j) in pairs {
        let mut block = vec![];
        for r in 0..sizes[i] {
            for c in 0..sizes[j] {
                let x = value(i, r, j, c);
                block.push(x);
                dense[(first[i] + r) * n + first[j] + c] = x;
            }
        }
        lu.add(i, j, &block);
    }
    Sample { lu, dense, n }
}

impl Sample {
    fn times(&self, x: &[f64]) -> Vec<f64> {
        self.dense.chunks(self.n).map(|row| row.iter().zip(x).map(|(a, x)| a * x).sum()).collect()
    }

    /// The solution for a right-hand side, by dense elimination with partial pivoting; and the sign of the determinant.
    fn dense_solution(&self, b: &[f64]) -> (Vec<f64>, f64) {
        let n = self.n;
        let (mut a, mut x) = (self.dense.clone(), b.to_vec());
        let mut sign = 1.0;
        for k in 0..n {
            let p = (k..n)
                .max_by(|&i, &j| a[i * n + k].abs().total_cmp(&a[j * n + k].abs()))
                .expect("not empty");
            sign *= if p == k { 1.0 } else { -1.0 } * a[p * n + k].signum();
            for j in 0..n {
                a.swap(k * n + j, p * n + j);
            }
            x.swap(k, p);
            for i in k + 1..n {
                let l = a[i * n + k] / a[k * n + k];
                for j in k..n {
                    a[i * n + j] -= l * a[k * n + j];
                }
                x[i] -= l * x[k];
            }
        }
        for i in (0..n).rev() {
            let tail: f64 = (i + 1..n).map(|j| a[i * n + j] * x[j]).sum();
            x[i] = (x[i] - tail) / a[i * n + i];
        }
        (x, sign)
    }

    /// ‖b − A x‖ / ‖b‖ after a solve, with `steps` of refinement.
    fn residual(&mut self, b: &[f64], steps: usize) -> (Vec<f64>, f64) {
        let mut x = b.to_vec();
        self.lu.solve(&mut x);
        for _ in 0..steps {
            let mut r: Vec<f64> = b.iter().zip(self.times(&x)).map(|(b, y)| b - y).collect();
            self.lu.solve(&mut r);
            x.iter_mut().zip(r).for_each(|(x, r)| *x += r);
        }
        let r: Vec<f64> = b.iter().zip(self.times(&x)).map(|(b, y)| b - y).collect();
        let relative = crate::norm(&r) / crate::norm(b);
        (x, relative)
    }
}

fn random_edges(rng: &mut Pcg64, n: usize, per_node: f64) -> Vec<(u32, u32)> {
    let count = (n as f64 * per_node) as usize;
    (0..count)
        .map(|_| (rng.random_range(0..n as u32), rng.random_range(0..n as u32)))
        .filter(|(i, j)| i != j)
        .collect()
}

/// A name, the sizes of the nodes, and the edges.
type Pattern = (&'static str, Vec<usize>, Vec<(u32, u32)>);

fn patterns(rng: &mut Pcg64) -> Vec<Pattern> {
    let mut mixed = |n: usize| (0..n).map(|_| rng.random_range(1..7)).collect::<Vec<usize>>();
    let all = |n: u32| (0..n).flat_map(|i| (0..i).map(move |j| (i, j))).collect::<Vec<_>>();
    let grid = |n: u32| {
        (0..n * n)
            .flat_map(|k| [(k, k + 1, (k + 1) % n != 0), (k, k + n, k + n < n * n)])
            .filter(|e| e.2)
            .map(|e| (e.0, e.1))
            .collect::<Vec<_>>()
    };
    let mut out = vec![
        ("a single unknown", vec![1], vec![]),
        ("a single node", vec![5], vec![]),
        ("no edges", mixed(9), vec![]),
        ("dense", mixed(23), all(23)),
        ("dense, larger than the depth of a product", vec![6; 50], all(50)),
        ("a chain", mixed(60), (1..60).map(|i| (i - 1, i)).collect()),
        ("an arrow", mixed(40), (0..39).map(|i| (i, 39)).collect()),
        ("a reversed arrow", mixed(40), (1..40).map(|i| (0, i)).collect()),
        ("a grid", mixed(144), grid(12)),
        ("a grid of threes", vec![3; 400], grid(20)),
        (
            "two chains and islands",
            mixed(31),
            (1..30).filter(|i| *i != 14).map(|i| (i, i - 1)).collect(),
        ),
        ("edges twice, both ways", vec![2; 4], vec![(0, 1), (1, 0), (0, 1), (3, 2)]),
    ];
    for (n, per_node) in [(20, 1.0), (50, 2.0), (80, 0.6), (60, 6.0)] {
        let sizes = (0..n).map(|_| rng.random_range(1..7)).collect();
        out.push(("random", sizes, random_edges(rng, n, per_node)));
    }
    out
}

#[test]
fn every_pattern_agrees_with_dense_elimination_on_every_instruction_set() {
    let mut rng = Pcg64::seed_from_u64(1);
    for (name, sizes, edges) in patterns(&mut rng) {
        let mut s = sample(&sizes, &edges, |i, r, j, c| {
            let x: f64 = rng.random_range(-1.0..1.0);
            // Not dominant, not symmetric.
            if (i, r) == (j, c) { x + 4.0 } else { x }
        });
        let b: Vec<f64> = (0..s.n).map(|_| rng.random_range(-1.0..1.0)).collect();
        let (expected, sign) = s.dense_solution(&b);
        for simd in Simd::all() {
            s.lu.simd = simd;
            s.lu.factorise().unwrap();
            assert_eq!(s.lu.perturbed(), 0, "{name}");
            assert_eq!(s.lu.sign(), sign, "{name}, {simd:?}");
            let (x, residual) = s.residual(&b, 0);
            assert!(residual < 1e-11, "{name}, {simd:?}: {residual:e}");
            let (_, refined) = s.residual(&b, 1);
            assert!(refined < 1e-13, "{name}, {simd:?}: {refined:e}");
            let error = x.iter().zip(&expected).fold(0.0_f64, |m, (x, y)| m.max((x - y).abs()));
            assert!(error < 1e-8, "{name}, {simd:?}: {error:e}");
            let mut product = vec![0.0; s.n];
            s.lu.multiply(&x, &mut product);
            assert!(product.iter().zip(s.times(&x)).all(|(a, b)| (a - b).abs() < 1e-11));
        }
    }
}

/// Diagonally dominant values on a pattern.
fn dominant(rng: &mut Pcg64, sizes: &[usize], edges: &[(u32, u32)]) -> Sample {
    let mut degree = vec![1; sizes.len()];
    for &(i, j) in edges {
        degree[i as usize] += 1;
        degree[j as usize] += 1;
    }
    sample(sizes, edges, |i, r, j, c| {
        let x: f64 = rng.random_range(-1.0..1.0);
        if (i, r) == (j, c) { 7.0 * f64::from(degree[i]) + x } else { x }
    })
}

proptest::proptest! {
    #[test]
    fn dominant_matrices_are_solved_to_rounding(seed: u64, n in 1_usize..40, per_node in 0.0..5.0) {
        let mut rng = Pcg64::seed_from_u64(seed);
        let sizes: Vec<usize> = (0..n).map(|_| rng.random_range(1..7)).collect();
        let edges = random_edges(&mut rng, n, per_node);
        let mut s = dominant(&mut rng, &sizes, &edges);
        s.lu.factorise().unwrap();
        let b: Vec<f64> = (0..s.n).map(|_| rng.random_range(-1.0..1.0)).collect();
        let (_, residual) = s.residual(&b, 0);
        proptest::prop_assert!(residual < 1e-10, "{:e}", residual);
        proptest::prop_assert_eq!(s.lu.perturbed(), 0);
    }
}

/// Rows that change places change the sign, one pair after the other; so does one that is turned round.
#[test]
fn the_sign_of_the_determinant_is_that_of_dense_elimination() {
    let mut rng = Pcg64::seed_from_u64(6);
    let mut of_each = [0; 2];
    for (name, sizes, edges) in patterns(&mut rng) {
        for k in 0..4 {
            // Pivots of either sign, to be sought within their block.
            let mut s = sample(&sizes, &edges, |i, r, j, c| {
                let x: f64 = rng.random_range(-1.0..1.0);
                let pivot = i == j && (r + 1 + k) % sizes[i] == c;
                if pivot { x + if (i + c) % 3 == 0 { -4.0 } else { 4.0 } } else { x }
            });
            s.lu.factorise().unwrap();
            if s.lu.perturbed() > 0 {
                continue;
            }
            let (_, sign) = s.dense_solution(&vec![1.0; s.n]);
            assert_eq!(s.lu.sign(), sign, "{name}, {k}");
            of_each[usize::from(sign > 0.0)] += 1;
        }
    }
    assert!(of_each[0] >= 20 && of_each[1] >= 20, "{of_each:?}");
}

#[test]
fn rows_and_columns_of_any_size_do_no_harm() {
    let mut rng = Pcg64::seed_from_u64(2);
    let (sizes, edges) = (vec![3; 100], random_edges(&mut rng, 100, 2.0));
    let mut power =
        || -> Vec<f64> { (0..300).map(|_| 10.0_f64.powi(rng.random_range(-8..9))).collect() };
    let (rows, columns) = (power(), power());
    let plain = dominant(&mut rng, &sizes, &edges);
    let n = plain.n;
    let mut s = sample(&sizes, &edges, |i, r, j, c| {
        let (row, column) = (3 * i + r, 3 * j + c);
        plain.dense[row * n + column] * rows[row] * columns[column]
    });
    s.lu.factorise().unwrap();
    assert_eq!(s.lu.perturbed(), 0);
    // Row by row, each against its own size: x = C⁻¹ y.
    let y: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
    let x: Vec<f64> = y.iter().zip(&columns).map(|(y, c)| y / c).collect();
    let mut found = s.times(&x);
    s.lu.solve(&mut found);
    for i in 0..n {
        assert!((found[i] * columns[i] - y[i]).abs() < 1e-10, "{i}: {} {}", found[i], x[i]);
    }
}

#[test]
fn zeros_on_the_diagonal_of_a_block_are_pivoted_away() {
    let mut rng = Pcg64::seed_from_u64(3);
    let (sizes, edges) = (vec![3; 60], random_edges(&mut rng, 60, 1.5));
    // Each diagonal block is a cyclic permutation, and more.
    let mut s = sample(&sizes, &edges, |i, r, j, c| {
        let x: f64 = rng.random_range(-0.05..0.05);
        if i != j {
            x
        } else if c == (r + 1) % 3 {
            2.0 + x
        } else {
            0.0
        }
    });
    s.lu.factorise().unwrap();
    assert_eq!(s.lu.perturbed(), 0);
    let b: Vec<f64> = (0..s.n).map(|i| (i as f64).cos()).collect();
    let (_, residual) = s.residual(&b, 0);
    assert!(residual < 1e-13, "{residual:e}");
}

#[test]
fn a_singular_matrix_is_perturbed_and_said_so() {
    // The graph Laplacian of a chain with two unknowns a node: constant vectors are its null space.
    let n = 50_u32;
    let edges: Vec<_> = (1..n).map(|i| (i - 1, i)).collect();
    let mut s = sample(&vec![2; n as usize], &edges, |i, r, j, c| {
        let ends = if i == 0 || i + 1 == n as usize { 1.0 } else { 2.0 };
        if r != c {
            0.0
        } else if i == j {
            ends
        } else {
            -1.0
        }
    });
    for simd in Simd::all() {
        s.lu.simd = simd;
        s.lu.factorise().unwrap();
        assert_eq!(s.lu.perturbed(), 2);
        // A consistent right-hand side is solved all the same.
        let known: Vec<f64> = (0..s.n).map(|i| (i as f64).sin()).collect();
        let b = s.times(&known);
        let (x, residual) = s.residual(&b, 3);
        assert!(residual < 1e-10, "{residual:e}");
        assert!(x.iter().all(|x| x.is_finite()));
    }
}

#[test]
fn an_empty_row_is_perturbed() {
    let mut lu = BlockLu::new(&[1, 1], [(0, 1)].into_iter()).unwrap();
    lu.add(0, 0, &[2.0]);
    lu.factorise().unwrap();
    assert_eq!(lu.perturbed(), 1);
    let mut x = [4.0, 0.0];
    lu.solve(&mut x);
    assert_eq!(x, [2.0, 0.0]);
}

#[test]
fn what_is_not_a_matrix_is_refused() {
    let mut lu = BlockLu::new(&[2, 3], [(0, 1)].into_iter()).unwrap();
    assert_eq!(lu.factorise(), Err(Singular));
    for bad in [f64::NAN, f64::INFINITY] {
        lu.clear();
        lu.add(0, 0, &[1.0, 0.0, 0.0, 1.0]);
        lu.add(1, 1, &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, bad, 0.0, 1.0]);
        assert_eq!(lu.factorise(), Err(Singular));
    }
    lu.clear();
    lu.add(0, 0, &[1.0, 0.0, 0.0, 1.0]);
    lu.add(1, 1, &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
    assert_eq!(lu.factorise(), Ok(()));
}

#[test]
fn a_second_factorisation_is_as_good_as_a_fresh_one() {
    let mut rng = Pcg64::seed_from_u64(4);
    let (sizes, edges) = (vec![3; 80], random_edges(&mut rng, 80, 3.0));
    let first = dominant(&mut rng, &sizes, &edges);
    let second = dominant(&mut rng, &sizes, &edges);
    let refill = |lu: &mut BlockLu, dense: &[f64]| {
        lu.clear();
        let coupled = |i: u32, j: u32| i == j || edges.contains(&(i, j)) || edges.contains(&(j, i));
        let all = (0..80_u32).flat_map(|i| (0..80_u32).map(move |j| (i, j)));
        let slots = all.filter(|&(i, j)| coupled(i, j));
        for (i, j) in slots.map(|(i, j)| (i as usize, j as usize)) {
            let at = |k: usize| (3 * i + k / 3) * 240 + 3 * j + k % 3;
            let block: [f64; 9] = std::array::from_fn(|k| dense[at(k)]);
            // In two halves: blocks add up.
            let slot = lu.slot(i, j);
            let half = block.map(|x| 0.5 * x);
            lu.add_at(slot, &half);
            lu.add_at(slot, &half);
        }
    };
    let mut reused = first.lu.clone();
    reused.factorise().unwrap();
    refill(&mut reused, &second.dense);
    reused.factorise().unwrap();
    let mut again = reused.clone();
    again.factorise().unwrap();
    let mut fresh = second.lu.clone();
    fresh.factorise().unwrap();
    let solve = |lu: &mut BlockLu| {
        let mut x: Vec<f64> = (0..240).map(|i| (i as f64).sin()).collect();
        lu.solve(&mut x);
        x
    };
    let expected = solve(&mut fresh);
    assert_eq!(solve(&mut reused), expected);
    assert_eq!(solve(&mut again), expected);
}

#[test]
fn operations_of_a_dense_matrix_are_those_of_the_textbook() {
    let n = 30;
    let all: Vec<_> = (0..n).flat_map(|i| (0..i).map(move |j| (i, j))).collect();
    let lu = BlockLu::new(&vec![3; n as usize], all.into_iter()).unwrap();
    assert_eq!(lu.fronts(), 1);
    assert!((lu.flops() / (2.0 / 3.0 * 90.0_f64.powi(3)) - 1.0).abs() < 1e-12);
    assert_eq!(lu.factor_len(), 8100);
    // A chain costs what its blocks cost, within what merging adds.
    let chain = BlockLu::new(&vec![6; 1000], (1..1000).map(|i| (i - 1, i))).unwrap();
    let blocks = 1000.0 * (2.0 / 3.0 + 4.0) * 216.0;
    assert!(
        chain.flops() > 0.9 * blocks && chain.flops() < 20.0 * blocks,
        "{}",
        chain.flops() / blocks
    );
}

#[test]
fn each_factorisation_is_counted() {
    let mut lu = BlockLu::new(&[1], std::iter::empty()).unwrap();
    lu.add(0, 0, &[1.0]);
    let before = crate::factorisations();
    lu.factorise().unwrap();
    lu.factorise().unwrap();
    assert_eq!(crate::factorisations() - before, 2);
}

#[test]
fn no_unknowns_are_solved_at_once() {
    let mut lu = BlockLu::new(&[], std::iter::empty()).unwrap();
    assert_eq!(lu.dim(), 0);
    assert_eq!(lu.factorise(), Ok(()));
    lu.solve(&mut []);
}

/// A cube of nodes of `size`, with fronts that are worth sharing.
fn cube(n: u32, size: usize) -> (Vec<usize>, Vec<(u32, u32)>) {
    let step = |k: u32, by: u32| ((k / by) % n + 1 < n).then_some((k, k + by));
    let edges =
        (0..n * n * n).flat_map(|k| [1, n, n * n].into_iter().filter_map(move |s| step(k, s)));
    (vec![size; (n * n * n) as usize], edges.collect())
}

#[test]
fn the_bits_do_not_depend_on_the_number_of_threads() {
    let mut rng = Pcg64::seed_from_u64(5);
    let (sizes, edges) = cube(13, 6);
    let mut lu = BlockLu::new(&sizes, edges.iter().copied()).unwrap();
    for (i, j) in (0..sizes.len() as u32).map(|i| (i, i)).chain(edges.iter().copied()) {
        let mut block = [0.0; 36];
        block.iter_mut().for_each(|x| *x = rng.random_range(-1.0..1.0));
        if i == j {
            (0..6).for_each(|k| block[7 * k] += 8.0);
        } else {
            lu.add(j as usize, i as usize, &block);
        }
        lu.add(i as usize, j as usize, &block);
    }
    assert!(lu.flops() > 2.0 * SHARED);
    let bits = |x: &[f64]| x.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    for simd in Simd::all() {
        lu.simd = simd;
        let mut alone = lu.clone();
        alone.factorise().unwrap();
        assert!(alone.factor_len() > substitute::SHARED, "{}", alone.factor_len());
        let b: Vec<f64> = (0..alone.dim()).map(|_| rng.random_range(-1.0..1.0)).collect();
        let solution = |lu: &mut BlockLu| {
            let mut x = b.clone();
            lu.solve(&mut x);
            bits(&x)
        };
        let x = solution(&mut alone);
        for threads in [2, 3] {
            let mut shared = lu.clone();
            let budget = Budget { threads, ..Budget::default() }.enter();
            shared.factorise().unwrap();
            assert!(shared.symbolic.plan.tasks.len() > 3, "{:?}", shared.symbolic.plan.tasks);
            assert!(shared.symbolic.plan.others(shared.fronts()).count() < shared.fronts() / 10);
            assert!(solution(&mut shared) == x);
            // The plan stays, and a thread alone can follow it.
            drop(budget);
            assert!(solution(&mut shared) == x);
            for _ in 0..2 {
                assert_eq!(bits(&shared.lower), bits(&alone.lower));
                assert_eq!(bits(&shared.upper), bits(&alone.upper));
                assert_eq!(bits(&shared.inverses), bits(&alone.inverses));
                assert_eq!((&shared.swaps, shared.perturbed), (&alone.swaps, alone.perturbed));
                assert_eq!(shared.sign(), alone.sign());
                shared.factorise().unwrap();
            }
        }
    }
}

#[test]
fn threads_stop_at_limits_and_say_so() {
    let (sizes, edges) = cube(13, 6);
    let mut lu = BlockLu::new(&sizes, edges.into_iter()).unwrap();
    let unit: Vec<f64> = (0..36).map(|k| if k % 7 == 0 { 1.0 } else { 0.0 }).collect();
    (0..sizes.len()).for_each(|i| lu.add(i, i, &unit));
    let over = Some(std::time::Instant::now());
    let scope = Budget { deadline: over, threads: 2, ..Budget::default() }.enter();
    assert_eq!(lu.factorise(), Err(Singular));
    assert!(scope.raised());
}

use std::time::Instant;

use nonsmooth_linalg::Csc;
use nonsmooth_linalg::budget::Budget;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::*;
use crate::Problem;
use crate::planted::Traffic;

/// The only block of all rows, with its right sides.
#[allow(non_snake_case)]
fn whole(set: &Set) -> (Block, Vec<f64>) {
    let Set::Polyhedron { A, b, C, d } = set else { panic!("a polyhedron") };
    let mut rows = vec![vec![]; A.nrows() + C.nrows()];
    A.triplets().for_each(|(i, j, a)| rows[i].push((j, -a)));
    C.triplets().for_each(|(i, j, a)| rows[A.nrows() + i].push((j, a)));
    let mut rhs: Vec<f64> = b.iter().map(|b| -b).chain(d.iter().copied()).collect();
    for (row, rhs) in rows.iter_mut().zip(&mut rhs) {
        let size = norm(&row.iter().map(|(_, g)| *g).collect::<Vec<_>>());
        if size > 0.0 {
            row.iter_mut().for_each(|(_, g)| *g /= size);
            *rhs /= size;
        }
    }
    let n = A.ncols();
    let all: Vec<usize> = (0..n).collect();
    (Block::new(all.clone(), (0..rows.len()).collect(), A.nrows(), &rows, &all), rhs)
}

/// Bounds, inequalities and equations with few entries through or beside one point, a vertex of many of them; some twice, some combinations of others.
fn random_polyhedron(n: usize, seed: u64) -> Set {
    let mut random = Pcg64::seed_from_u64(seed);
    let inside: Vec<f64> = (0..n).map(|_| f64::from(random.random_range(0..4))).collect();
    let (mut a, mut b, mut c, mut d) = (vec![], vec![], vec![], vec![]);
    let mut row = |random: &mut Pcg64, equation: bool, entries: Vec<(usize, f64)>, off: f64| {
        let (to, rhs) = if equation { (&mut c, &mut d) } else { (&mut a, &mut b) };
        let at: f64 = entries.iter().map(|(j, x)| x * inside[*j]).sum();
        for _ in 0..1 + random.random_range(0..8) / 7 {
            let size = f64::from(random.random_range(1..4));
            to.extend(entries.iter().map(|(j, x)| (rhs.len(), *j, size * x)));
            rhs.push(size * (at + off));
        }
    };
    let entries = |random: &mut Pcg64| -> Vec<(usize, f64)> {
        let first = random.random_range(0..n);
        let next = (first + 1 + random.random_range(0..7)) % n;
        let last = (next + 1 + random.random_range(0..n / 3)) % n;
        let mut entries = vec![(first, 1.0), (next, -1.0)];
        if last != first {
            entries.push((last, f64::from(random.random_range(-2..3))));
        }
        entries.retain(|e| e.1 != 0.0);
        entries
    };
    for j in 0..n {
        let off = f64::from(random.random_range(0..3));
        match random.random_range(0..8) {
            0 => {}
            1 => row(&mut random, false, vec![(j, 1.0)], off),
            2 => row(&mut random, j % 9 == 0, vec![(j, 2.0)], 0.0),
            _ => row(&mut random, false, vec![(j, -1.0)], off),
        }
    }
    for _ in 0..n / 3 {
        let off = f64::from(random.random_range(0..2));
        let these = entries(&mut random);
        row(&mut random, false, these, off);
    }
    for _ in 0..n / 4 {
        let these = entries(&mut random);
        row(&mut random, true, these, 0.0);
    }
    let csc = |m: usize, entries: Vec<_>| Csc::from_triplets(m, n, entries.into_iter()).unwrap();
    Set::Polyhedron { A: csc(b.len(), a), b, C: csc(d.len(), c), d }
}

fn far(x: &[f64], y: &[f64]) -> f64 {
    x.iter().zip(y).fold(0.0, |far: f64, (x, y)| far.max((x - y).abs()))
}

/// The methods share nothing but the rows; one begins anew each time, the other where it ended.
#[test]
fn the_methods_find_the_same_projections() {
    for seed in 0..40 {
        let n = 40 + 3 * seed as usize;
        let set = random_polyhedron(n, seed);
        let (block, rhs) = whole(&set);
        let mut sparse = Sparse::new(&block.rows).unwrap();
        let mut random = Pcg64::seed_from_u64(seed);
        let mut p = vec![0.0; n];
        for size in [10.0, 1e-3, 1e-9, 0.3, 1e4, 1e-14, 1.0] {
            p.iter_mut().for_each(|p| *p += size * random.random_range(-1.0..1.0));
            let [mut y, mut z] = [p.clone(), p.clone()];
            assert!(Dense::new(&block.rows).onto(&rhs, &p, &p, &mut y), "{seed} {size:e}");
            assert_eq!(sparse.onto(&rhs, &p, &mut z), Found::Yes, "{seed} {size:e}");
            let unit = p.iter().fold(1.0, |most: f64, p| most.max(p.abs()));
            assert!(far(&y, &z) < 1e-12 * unit, "{seed} {size:e}: {:e}", far(&y, &z));
            // p − y is a combination of the rows that are said to hold.
            let held =
                Block { sparse: Some(sparse), by_dense: false, rhs: rhs.clone(), ..whole(&set).0 };
            let span = held.held();
            let dense: Vec<Vec<f64>> = Dense::new(&block.rows).into_rows();
            let columns = |k: &usize| dense[*k].iter().copied();
            let off: Vec<f64> = p.iter().zip(&z).map(|(p, z)| p - z).collect();
            let before = Span::of(span.iter().map(columns)).r.iter().flatten().count();
            assert_eq!(before, span.len(), "independent");
            let all = span.iter().map(columns).map(|c| c.collect::<Vec<_>>()).chain([off.clone()]);
            let last = Span::of(all.map(Vec::into_iter)).r.pop().flatten();
            let beyond = last.map_or(0.0, |r| r[r.len() - 1]);
            assert!(beyond < 1e-10 * unit, "{seed} {size:e}: {beyond:e} of {:e}", norm(&off));
            sparse = held.sparse.unwrap();
        }
    }
}

/// Contradictions are left to the other method.
#[test]
#[allow(non_snake_case)]
fn empty_polyhedra_of_many_rows_are_found_empty() {
    for seed in 0..10 {
        let n = 120;
        let Set::Polyhedron { A, b, C, mut d } = random_polyhedron(n, seed) else {
            panic!("a polyhedron")
        };
        // A chain of equations from the first variable to the last, and one against it.
        let chain =
            (1..n).flat_map(|i| [(C.nrows() + i - 1, i - 1, 1.0), (C.nrows() + i - 1, i, -1.0)]);
        let last = C.nrows() + n - 1;
        let all: Vec<_> =
            C.triplets().chain(chain).chain([(last, 0, 1.0), (last, n - 1, -1.0)]).collect();
        d.extend(std::iter::repeat_n(0.0, n - 1));
        d.push(1.0);
        let C = Csc::from_triplets(d.len(), n, all.into_iter()).unwrap();
        let set = Set::Polyhedron { A, b, C, d };
        let p = vec![0.5; n];
        assert!(!Projection::new(&set).onto(&set, &p, &p, &mut p.clone()), "{seed}");
    }
}

/// Of parts that no row joins, each as if it were alone; what no row touches stays.
#[test]
fn parts_are_projected_each_by_itself() {
    let sets = [random_polyhedron(90, 1), random_polyhedron(70, 2)];
    let (n, free) = (160, 40);
    let (mut a, mut rhs_a, mut c, mut rhs_c) = (vec![], vec![], vec![], vec![]);
    for (set, first) in sets.iter().zip([0, 90]) {
        let Set::Polyhedron { A, b, C, d } = set else { panic!("a polyhedron") };
        a.extend(A.triplets().map(|(i, j, x)| (rhs_a.len() + i, first + j, x)));
        c.extend(C.triplets().map(|(i, j, x)| (rhs_c.len() + i, first + j, x)));
        rhs_a.extend(b);
        rhs_c.extend(d);
    }
    let csc = |m: usize, e: Vec<_>| Csc::from_triplets(m, n + free, e.into_iter()).unwrap();
    let set =
        Set::Polyhedron { A: csc(rhs_a.len(), a), b: rhs_a, C: csc(rhs_c.len(), c), d: rhs_c };
    let mut random = Pcg64::seed_from_u64(3);
    let p: Vec<f64> = (0..n + free).map(|_| random.random_range(-5.0..5.0)).collect();
    let mut y = vec![0.0; n + free];
    assert!(Projection::new(&set).onto(&set, &p, &p, &mut y));
    assert_eq!(y[n..], p[n..]);
    for (set, range) in sets.iter().zip([0..90, 90..n]) {
        let (block, rhs) = whole(set);
        let mut own = vec![0.0; range.len()];
        let p = &p[range.clone()];
        assert!(Dense::new(&block.rows).onto(&rhs, p, p, &mut own));
        assert!(far(&y[range], &own) < 1e-11);
    }
}

/// Some thousand variables, of which all but a few lie on bounds, and multipliers are not unique.
#[test]
fn a_large_network_is_judged_at_its_equilibrium() {
    let (problem, known) = Traffic { m: 12, ..Traffic::default() }.vi();
    let mut gauge = problem.gauge().unwrap();
    let measure = problem.certify(&known, &mut gauge);
    assert!(measure.passes(1e-12), "{measure:?}");
    // Beside it, and far from it.
    for (size, passes) in [(1e-12, true), (1e-6, false), (1.0, false)] {
        let mut random = Pcg64::seed_from_u64(4);
        let mut beside = known.clone();
        beside.z.iter_mut().for_each(|x| *x += size * random.random_range(0.0..1.0));
        let measure = problem.certify(&beside, &mut gauge);
        assert!(measure.relative.is_finite(), "{size:e} {measure:?}");
        assert_eq!(measure.passes(1e-8), passes, "{size:e} {measure:?}");
    }
}

/// What is cut short says nothing, and the next time all is as if it had not been.
#[test]
fn a_deadline_ends_projections() {
    let (problem, known) = Traffic { m: 8, ..Traffic::default() }.vi();
    let mut expected = problem.certify(&known, &mut problem.gauge().unwrap());
    let over = || Budget { deadline: Some(Instant::now()), ..Budget::default() };
    let mut gauge = {
        let _scope = over().enter();
        problem.gauge().unwrap()
    };
    let mut off = known.clone();
    off.z.iter_mut().for_each(|x| *x += 0.5);
    for _ in 0..2 {
        let _scope = over().enter();
        assert!(!problem.certify(&off, &mut gauge).passes(1e10));
    }
    assert!(problem.certify(&off, &mut gauge).relative.is_finite());
    let mut found = problem.certify(&known, &mut gauge);
    // But for the rounding of a projection that began elsewhere.
    for measure in [&mut expected, &mut found] {
        assert!(measure.relative < 1e-13, "{measure:?}");
    }
}

/// A point of the set stays to the bit; a plane far beyond, and bounds that are not the tightest, hold nothing.
#[test]
#[allow(non_snake_case)]
fn what_is_inside_stays_and_what_is_far_holds_nothing() {
    let n = 200;
    let row = |i: usize, entries: [(usize, f64); 2]| entries.map(|(j, x)| (i, j, x));
    let bounds = (0..2 * n).map(|i| (i, i % n, -1.0));
    let sums = (0..n - 1).flat_map(|j| row(2 * n + j, [(j, 1.0), (j + 1, 1.0)]));
    let A = Csc::from_triplets(3 * n - 1, n, bounds.chain(sums)).unwrap();
    for beyond in [10.0, 1e6, 1e15, 1e300] {
        let mut b = vec![0.0; 3 * n - 1];
        b[..n].fill(7.0);
        b[2 * n..].fill(beyond);
        let set = Set::inequalities(A.clone(), b);
        let mut projection = Projection::new(&set);
        let mut y = vec![0.0; n];
        let inside: Vec<f64> = (0..n).map(|j| 0.1 * (j % 7) as f64).collect();
        let p: Vec<f64> = inside.iter().enumerate().map(|(j, x)| x - (j % 2) as f64).collect();
        for _ in 0..2 {
            assert!(projection.onto(&set, &p, &p, &mut y));
            let clipped: Vec<f64> = p.iter().map(|p| p.max(0.0)).collect();
            assert_eq!(y, clipped, "{beyond:e}");
            let pushed: Vec<usize> = (0..n).filter(|&j| p[j] < 0.0).map(|j| n + j).collect();
            assert_eq!(projection.held(), pushed, "{beyond:e}");
            assert!(projection.onto(&set, &inside, &inside, &mut y));
            assert_eq!(y, inside, "{beyond:e}");
        }
    }
}

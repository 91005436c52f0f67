//! The cost of the factorisations that Newton methods do, against faer's general sparse LU on the same matrix in the same run.
//!
//! `cargo run --release -p nonsmooth-bench --example factorisation -- FILE_OR_FOLDER…`
//!
//! Local files give the matrix `D + W` over the contacts, D the blocks of W's diagonal; global files give `M + H Hᵀ` over the bodies
//! (connected components of M). Columns: unknowns, blocks a row, entries of the factors over entries of the matrix, fronts; milliseconds of
//! analysis, factorisation and solve; Gflop/s of the factorisation by the operations that it does; the same
//! of faer (symbolic analysis reused, supernodal or simplicial as it chooses) as multiples of ours; relative residuals of both
//! without refinement. Each time is the fastest of several.

use std::collections::BTreeMap;
use std::hint::black_box;
use std::path::PathBuf;
use std::time::Instant;

use nonsmooth_io::fclib;
use nonsmooth_linalg::{BlockLu, Csc, Groups};
use nonsmooth_problem::{Friction, FrictionGlobal, FrictionLocal};
use nonsmooth_solve::contact::law::DiskLaw;

/// A matrix by blocks: sizes of nodes, blocks by rows.
struct Blocks {
    sizes: Vec<usize>,
    blocks: BTreeMap<(u32, u32), Vec<f64>>,
}

fn of_contacts<const D: usize, L: DiskLaw<D>>(problem: &FrictionLocal<D, L>) -> Blocks {
    let nc = problem.contacts();
    let mut blocks = BTreeMap::new();
    for i in 0..nc {
        let (columns, values) = problem.W.row(i);
        for (&j, block) in columns.iter().zip(values) {
            let mut block = block.as_flattened().to_vec();
            if i == j as usize {
                block.iter_mut().for_each(|x| *x *= 2.0);
            }
            blocks.insert((i as u32, j), block);
        }
    }
    Blocks { sizes: vec![D; nc], blocks }
}

fn of_bodies<const D: usize, L: DiskLaw<D>>(problem: &FrictionGlobal<D, L>) -> Blocks {
    let n = problem.M.nrows();
    let mut groups = Groups::new(n);
    problem.M.triplets().filter(|e| e.2 != 0.0).for_each(|(i, j, _)| groups.join(i, j));
    let (node_of, sizes, mut place) = (groups.numbers(), groups.sizes(), vec![0; n]);
    for members in groups.members() {
        members.iter().enumerate().for_each(|(p, &i)| place[i] = p);
    }
    let mut blocks = BTreeMap::new();
    let mut add = |i: usize, j: usize, x: f64| {
        let (a, b) = (node_of[i], node_of[j]);
        let block = blocks.entry((a as u32, b as u32));
        let block: &mut Vec<f64> = block.or_insert_with(|| vec![0.0; sizes[a] * sizes[b]]);
        block[place[i] * sizes[b] + place[j]] += x;
    };
    problem.M.triplets().for_each(|(i, j, x)| add(i, j, x));
    for c in 0..problem.H.ncols() {
        let (rows, values) = problem.H.column(c);
        for (&i, x) in rows.iter().zip(values) {
            for (&j, y) in rows.iter().zip(values) {
                add(i, j, x * y);
            }
        }
    }
    // Contacts couple whole bodies, whatever the zeros of H say.
    let present: Vec<(u32, u32)> = blocks.keys().copied().collect();
    for (i, j) in present {
        let len = sizes[i as usize] * sizes[j as usize];
        blocks.entry((j, i)).or_insert_with(|| vec![0.0; len]);
    }
    Blocks { sizes, blocks }
}

/// The fastest of enough calls to fill a while.
fn fastest(mut f: impl FnMut()) -> f64 {
    let (mut best, mut spent, mut calls) = (f64::INFINITY, 0.0, 0);
    while calls < 3 || (spent < 0.5 && calls < 2000) {
        let start = Instant::now();
        f();
        let seconds = start.elapsed().as_secs_f64();
        best = best.min(seconds);
        spent += seconds;
        calls += 1;
    }
    best
}

fn report(a: &Blocks, kind: &str, name: &str) -> Result<(), Box<dyn std::error::Error>> {
    let edges: Vec<_> = a.blocks.keys().copied().filter(|(i, j)| i != j).collect();
    let analysis = fastest(|| {
        drop(black_box(BlockLu::new(&a.sizes, edges.iter().copied())));
    });
    let mut lu = BlockLu::new(&a.sizes, edges.iter().copied())?;
    for (&(i, j), block) in &a.blocks {
        lu.add(i as usize, j as usize, block);
    }
    let factor = fastest(|| lu.factorise().unwrap_or(()));
    let n = lu.dim();
    let known: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
    let mut b = vec![0.0; n];
    lu.multiply(&known, &mut b);
    let mut x = b.clone();
    let solve = fastest(|| {
        x.copy_from_slice(&b);
        lu.solve(&mut x);
    });
    let mut start = vec![0];
    a.sizes.iter().for_each(|s| start.push(start[start.len() - 1] + s));
    let entries = a.blocks.iter().flat_map(|(&(i, j), block)| {
        let (i, j) = (i as usize, j as usize);
        let (rows, columns, width) = (start[i], start[j], a.sizes[j]);
        block.iter().enumerate().map(move |(k, &x)| (rows + k / width, columns + k % width, x))
    });
    let matrix = Csc::from_triplets(n, n, entries)?;
    let residual = |x: &[f64]| {
        let mut r = b.clone();
        matrix.mul_add(-1.0, x, &mut r);
        let norm = |x: &[f64]| x.iter().map(|v| v * v).sum::<f64>().sqrt();
        norm(&r) / norm(&b)
    };
    let ours = residual(&x);
    print!(
        "{kind} {n:6} {:5.1} {:6.1} {:6} {:9.3} {:9.3} {:8.3} {:6.1}",
        a.blocks.len() as f64 / a.sizes.len() as f64,
        lu.factor_len() as f64 / matrix.nnz() as f64,
        lu.fronts(),
        analysis * 1e3,
        factor * 1e3,
        solve * 1e3,
        lu.flops() / factor / 1e9,
    );
    let peer = peer::times(&matrix, &b, &mut x)?;
    println!(
        " {:7.1} {:7.1} {:7.1} {ours:8.0e} {:8.0e}  {name}",
        peer.0 / analysis,
        peer.1 / factor,
        peer.2 / solve,
        residual(&x)
    );
    Ok(())
}

mod peer {
    use faer::dyn_stack::{MemBuffer, MemStack};
    use faer::sparse::SparseColMatRef;
    use faer::sparse::SymbolicSparseColMatRef;
    use faer::sparse::linalg::lu::{LuRef, LuSymbolicParams, NumericLu, factorize_symbolic_lu};
    use faer::{Conj, MatMut, Par};
    use nonsmooth_linalg::Csc;

    use super::fastest;

    /// Seconds of analysis, factorisation and solve; `x` becomes the solution.
    pub fn times(
        a: &Csc,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<(f64, f64, f64), Box<dyn std::error::Error>> {
        let n = a.nrows();
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, a.col_ptr(), None, a.row_idx());
        let matrix = SparseColMatRef::new(pattern, a.values());
        let analyse = || factorize_symbolic_lu(pattern, LuSymbolicParams::default());
        let symbolic = analyse().map_err(|e| format!("{e:?}"))?;
        let analysis = fastest(|| {
            std::hint::black_box(analyse().is_ok());
        });
        let mut numeric = NumericLu::new();
        let par = Par::Seq;
        let need = symbolic.factorize_numeric_lu_scratch::<f64>(par, Default::default());
        let mut memory = MemBuffer::new(need);
        let mut outcome = Ok(());
        let factor = fastest(|| {
            let stack = MemStack::new(&mut memory);
            let done =
                symbolic.factorize_numeric_lu(&mut numeric, matrix, par, stack, Default::default());
            outcome = done.map(|_| ()).map_err(|e| format!("{e:?}"));
        });
        outcome?;
        let mut memory = MemBuffer::new(symbolic.solve_in_place_scratch::<f64>(1, par));
        let lu = LuRef::new_unchecked(&symbolic, &numeric);
        let solve = fastest(|| {
            x.copy_from_slice(b);
            let x = MatMut::from_column_major_slice_mut(x, n, 1);
            lu.solve_in_place_with_conj(Conj::No, x, par, MemStack::new(&mut memory));
        });
        Ok((analysis, factor, solve))
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let roots: Vec<PathBuf> = std::env::args().skip(1).map(PathBuf::from).collect();
    if roots.is_empty() {
        return Err("usage: factorisation FILE_OR_FOLDER…".into());
    }
    println!(
        "       {:>6} {:>5} {:>6} {:>6} {:>9} {:>9} {:>8} {:>6} {:>7} {:>7} {:>7} {:>8} {:>8}",
        "n",
        "blk/r",
        "fill",
        "fronts",
        "analysis",
        "factor",
        "solve",
        "Gfl/s",
        "/anal",
        "/fact",
        "/solve",
        "residual",
        "faer"
    );
    let (inputs, mistakes) = nonsmooth_bench::campaign::inputs(&roots);
    mistakes.iter().for_each(|mistake| eprintln!("{mistake}"));
    for input in inputs {
        let name = input.name.rsplit('/').next().unwrap_or_default();
        match fclib::read_problem(&input.path) {
            Ok(Friction::Local2(p)) => report(&of_contacts(&p), "local ", name)?,
            Ok(Friction::Local3(p)) => report(&of_contacts(&p), "local ", name)?,
            Ok(Friction::Global2(p)) => report(&of_bodies(&p), "global", name)?,
            Ok(Friction::Global3(p)) => report(&of_bodies(&p), "global", name)?,
            Ok(Friction::RollingLocal(p)) => report(&of_contacts(&p), "local ", name)?,
            Ok(Friction::RollingGlobal(p)) => report(&of_bodies(&p), "global", name)?,
            Err(e) => eprintln!("{e}"),
        }
    }
    Ok(())
}

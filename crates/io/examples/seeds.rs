//! Writes valid files of every format to fuzz/seeds: what the fuzzers start from. `cargo run --release -p nonsmooth-io --example seeds`
//!
//! HDF5 files of many layouts come from Python's h5py, where it is; see seeds.py.

#![allow(non_snake_case)]

use std::path::Path;
use std::process::Command;

use nonsmooth_io::fclib::Fclib;
use nonsmooth_io::linear::toml::Toml;
use nonsmooth_io::{Format, Info, ProblemFile, StoredPoint};
use nonsmooth_linalg::{Bsr, Csc, Dense, Matrix};
use nonsmooth_problem::{
    BoxLcp, FrictionGlobal, FrictionLocal, GlobalPoint, Hlcp, HlcpPoint, Lcp, LcpPoint, LocalPoint,
    Mlcp, RowsGlobal, RowsLocal,
};

fn diagonal(rows: usize, columns: usize) -> Csc {
    let entries = (0..rows.min(columns)).map(|k| (k, k, 1.0 + k as f64));
    Csc::from_triplets(rows, columns, entries).expect("entries inside the matrix")
}

fn local<const D: usize>(bilateral: bool) -> FrictionLocal<D> {
    let bilateral =
        bilateral.then(|| RowsLocal::bilateral(diagonal(D, 1), diagonal(1, 1), vec![0.5]));
    FrictionLocal {
        W: Bsr::from_csc(&diagonal(D, D)),
        q: vec![-1.0; D],
        mu: vec![0.5],
        mu_r: (),
        rows: bilateral,
    }
}

fn global<const D: usize>(bilateral: bool) -> FrictionGlobal<D> {
    let bilateral = bilateral.then(|| RowsGlobal::bilateral(diagonal(4, 1), vec![0.25]));
    let (M, H) = (diagonal(4, 4), diagonal(4, D));
    FrictionGlobal {
        M,
        H,
        f: vec![1.0; 4],
        w: vec![-1.0; D],
        mu: vec![0.5],
        mu_r: (),
        rows: bilateral,
    }
}

fn contact() -> Vec<ProblemFile> {
    let info = Info { title: Some("a seed".into()), dofs: Some(4), ..Info::default() };
    let (v, r, lambda) = (vec![0.5; 4], vec![1.0; 3], vec![0.5]);
    let of_local = LocalPoint { r: r.clone(), lambda: lambda.clone() };
    let of_global = GlobalPoint { v, r, lambda };
    let with = |file: ProblemFile, point| {
        let point = StoredPoint { point, partner: Some(vec![0.0; 3]), statuses: vec![] };
        let guesses = vec![point.clone()];
        ProblemFile { info: info.clone(), guesses, solution: Some(point), ..file }
    };
    vec![
        ProblemFile::new(local::<2>(false)),
        with(ProblemFile::new(local::<3>(true)), of_local.into()),
        ProblemFile::new(global::<2>(false)),
        with(ProblemFile::new(global::<3>(true)), of_global.into()),
    ]
}

fn linear() -> Vec<ProblemFile> {
    let dense = |m: &Csc| Matrix::from(Dense::from_fn(m.nrows(), m.ncols(), |i, j| m.get(i, j)));
    let sparse = || Matrix::from(diagonal(2, 2));
    let full = || dense(&diagonal(2, 2));
    let q = || vec![-1.0, 2.0];
    let sound = "a valid problem";
    let lcp = |m| ProblemFile::new(Lcp::new(m, q()).expect(sound));
    let mixed = Mlcp::rectangular(full(), q(), 1, 1).expect(sound);
    let bounded = BoxLcp::new(sparse(), q(), vec![0.0, f64::NEG_INFINITY], vec![1.0, 2.0]);
    let horizontal = Hlcp::new(full(), sparse(), q()).expect(sound);
    let point = || LcpPoint { z: vec![1.0, 0.0] }.into();
    let (title, description) = (Some("a \"seed\"\n".into()), Some("for fuzzers".into()));
    let slack = HlcpPoint { x: vec![1.0, 0.0], s: vec![0.0, 1.0] };
    let solved = |file, solution| ProblemFile { solution: Some(solution), ..file };
    vec![
        ProblemFile { info: Info { title, description, ..Info::default() }, ..lcp(full()) },
        solved(lcp(sparse()), StoredPoint { point: point(), partner: Some(q()), statuses: vec![] }),
        solved(
            ProblemFile::new(mixed),
            StoredPoint { point: point(), partner: None, statuses: vec![] },
        ),
        ProblemFile::new(bounded.expect(sound)),
        solved(ProblemFile::new(horizontal), slack.into()),
    ]
}

/// M, q, l, u and z, with a byte 1 between them.
const MARKET: [&str; 4] = [
    "%%MatrixMarket matrix array real general\n2 2\n1\n0\n0\n2\n\u{1}%%MatrixMarket matrix array real general\n2 1\n-1\n2\n\u{1}\u{1}\u{1}1 0",
    "%%MatrixMarket matrix coordinate real symmetric\n% a remark\n2 2 3\n1 1 2.5\n2 1 -1\n2 2 2\n\u{1}-1 2\n\u{1}-inf 0\n\u{1}1 inf\n",
    "%%MatrixMarket matrix coordinate integer skew-symmetric\n2 2 1\n2 1 3\n\u{1}-1 2\n",
    "%%MatrixMarket matrix array real symmetric\n2 2\n1\n3\n2\n\u{1}%%MatrixMarket matrix coordinate real general\n2 1 1\n2 1 -4\n",
];

const SICONOS: [&str; 8] = [
    "2\n0\n2 2\n2 2\n2 1\n1 2\n-5 -6\n",
    "2\n0\n2 2\n2 2\n2 1\n1 2\n-5 -6\n-1 -1\n1 1\n",
    "2\n1\n2 2\n1\n1\n1\n2\n2\n2\n1\n0 1\n0\n0\n2 1\n1 2\n-5 -6\n",
    "2\n2\n2 2\n2 2\n1\nCSparse Version 3.1.1\ntriplet: 2-by-2, nzmax: 2 nnz: 2\n0 0 : 1\n1 1 : 2\n-5 -6\n",
    "2\n2\n2 2\n2 2\n3\nCSparse Version 3.1.1\n2-by-2, nzmax: 2 nnz: 2, 1-norm: 2\ncol 0 : locations 0 to 0\n0 : 1\ncol 1 : locations 1 to 1\n1 : 2\n-5 -6\n",
    "1 0\n1\n1\n0 1 2\n0 1\n0\n2 2\n2 2\n2 1\n1 2\n-5 -6\n",
    "0 1\n1\n1\n2\n3\n4\n5\n-1\n-2\n",
    "1 1 2\n2\n3\n4\n5\n-1\n-2\n",
];

fn main() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz");
    let put = |target: &str, name: usize, bytes: &[u8]| {
        for folder in ["seeds", "corpus"] {
            std::fs::create_dir_all(here.join(folder).join(target)).expect("a folder can be made");
        }
        let path = here.join("seeds").join(target).join(name.to_string());
        std::fs::write(path, bytes).expect("a file can be written");
    };
    for (k, file) in contact().iter().enumerate() {
        put("fclib", k, &Fclib.to_bytes(Path::new("seed"), file).expect("a valid problem"));
    }
    for (k, file) in linear().iter().enumerate() {
        put("toml", k, &Toml.to_bytes(Path::new("seed"), file).expect("a valid problem"));
    }
    let blocks = "kind = \"mlcp\"\na = [1]\nb = [2]\nA = [[1]]\n[B]\nshape = [1, 1]\nentries = [[0, 0, 2.0]]\n";
    put("toml", 100, blocks.as_bytes());
    MARKET.iter().enumerate().for_each(|(k, text)| put("market", k, text.as_bytes()));
    SICONOS.iter().enumerate().for_each(|(k, text)| put("siconos", k, text.as_bytes()));
    let models = [
        &include_bytes!("../tests/nl/pairs.nl")[..],
        include_bytes!("../tests/nl/ampl.nl"),
        include_bytes!("../tests/nl/pairs-little.nl"),
        include_bytes!("../tests/nl/pairs-big.nl"),
    ];
    models.iter().enumerate().for_each(|(k, bytes)| put("nl", k, bytes));
    let runs = std::fs::read_to_string(here.join("../.ci/outcomes.jsonl")).expect("a file of runs");
    let lines: Vec<&str> = runs.lines().collect();
    let of = |kind: &str, n: usize| {
        let mark = format!("{{\"line\":\"{kind}\"");
        lines
            .iter()
            .filter(move |l| l.starts_with(&mark))
            .take(n)
            .map(|l| format!("{l}\n"))
            .collect::<String>()
    };
    put("runs", 0, of("campaign", 1).as_bytes());
    put("runs", 1, (of("campaign", 1) + &of("problem", 1) + &of("run", 1)).as_bytes());
    put("runs", 2, (of("campaign", 1) + &of("problem", 2) + &of("run", 3)).as_bytes());

    let made =
        Command::new("python3").arg(here.join("seeds.py")).arg(here.join("seeds/fclib")).status();
    if !made.is_ok_and(|status| status.success()) {
        eprintln!("SKIPPED: python3 with h5py is not here: no seeds of other HDF5 layouts");
    }
}

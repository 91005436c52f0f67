//! Valid files of every format, mutated at random: read or refused, never a panic, and what is read is valid and reads the same once written.
//!
//! The fuzzers in `fuzz/` do the same, guided by what the code visits; what they found stands below.

use std::path::Path;

use nonsmooth_io::fclib::Fclib;
use nonsmooth_io::linear::market;
use nonsmooth_io::linear::toml::Toml;
use nonsmooth_io::nl::{Model, Nl, Options};
use nonsmooth_io::siconos::Siconos;
use nonsmooth_io::{Format, IoError, ProblemFile};
use nonsmooth_problem::{AnyProblem, Friction, Problem, with_problem};

/// Mutations of each format: `NONSMOOTH_MUTATIONS` says otherwise.
fn rounds() -> usize {
    std::env::var("NONSMOOTH_MUTATIONS").map_or(20_000, |n| n.parse().unwrap())
}

/// SplitMix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let x = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ x >> 31
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }

    /// One of the seeds, changed in a few places: bytes, numbers, words, parts left out, doubled or taken from another seed.
    fn mutation(&mut self, seeds: &[Vec<u8>], words: &[&str]) -> Vec<u8> {
        let mut bytes = seeds[self.below(seeds.len())].clone();
        for _ in 0..=self.below(4) {
            let at = self.below(bytes.len());
            let end = (at + 1 + self.below(16)).min(bytes.len());
            match self.below(8) {
                0 | 1 if at < bytes.len() => bytes[at] ^= 1 << self.below(8),
                2 if at < bytes.len() => bytes[at] = [0, 1, 0x7f, 0x80, 0xff][self.below(5)],
                3 => drop(bytes.drain(at..end)),
                4 => {
                    let part = bytes[at..end].to_vec();
                    drop(bytes.splice(at..at, part));
                }
                5 => {
                    let other = &seeds[self.below(seeds.len())];
                    let from = self.below(other.len());
                    let part = other[from..(from + 64).min(other.len())].to_vec();
                    drop(bytes.splice(at..end, part));
                }
                6 if !words.is_empty() => {
                    let word = words[self.below(words.len())].bytes();
                    drop(bytes.splice(at..end, word));
                }
                _ => {
                    let number = [0, 1, u64::MAX, 1 << 31, 1 << 60, self.next()][self.below(6)];
                    let width = [1, 2, 4, 8][self.below(4)].min(bytes.len() - at.min(bytes.len()));
                    bytes[at..at + width].copy_from_slice(&number.to_le_bytes()[..width]);
                }
            }
        }
        bytes
    }
}

fn refused(message: &str) {
    assert!(!message.contains('\n'), "{message}");
}

/// What was read is valid, is written in a format and read again.
fn again(format: &dyn Format, result: Result<ProblemFile, IoError>) {
    match result {
        Ok(content) => {
            with_problem!(&content.problem, p => p.validate()).unwrap();
            let name = Path::new("x");
            let bytes = format.to_bytes(name, &content).unwrap();
            assert_eq!(format.parse(name, &bytes).unwrap(), content);
        }
        Err(e) => refused(&e.to_string()),
    }
}

/// Small files in layouts that this crate does not write, made with h5py 3.16 (HDF5 2.0) by `fuzz/seeds.py`.
fn layouts() -> Vec<(String, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/layouts");
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    let mut all: Vec<_> = files
        .map(|entry| {
            (entry.file_name().into_string().unwrap(), std::fs::read(entry.path()).unwrap())
        })
        .collect();
    all.sort();
    all
}

#[test]
fn layouts_of_other_writers_are_read() {
    for (name, bytes) in layouts() {
        let content = Fclib.parse(Path::new(&name), &bytes).unwrap_or_else(|e| panic!("{e}"));
        let AnyProblem::Friction(Friction::Local2(p)) = content.problem else { panic!("{name}") };
        let w = p.W.to_csc();
        assert_eq!([w.get(0, 0), w.get(0, 1), w.get(1, 0), w.get(1, 1)], [2.0, 0.0, 0.0, 3.5]);
        assert_eq!((&p.q[..], &p.mu[..]), (&[-1.0, 0.5][..], &[0.5][..]), "{name}");
    }
}

#[test]
fn hdf5_files() {
    let seeds: Vec<_> = layouts().into_iter().map(|(_, bytes)| bytes).collect();
    let mut random = Random(1);
    for _ in 0..rounds() {
        let bytes = random.mutation(&seeds, &[]);
        again(&Fclib, Fclib.parse(Path::new("x"), &bytes));
    }
}

const TOML: [&str; 7] = [
    "kind = \"lcp\"\ntitle = \"a\"\nq = [-4.0, -7.0]\nM = [[2.0, 1.0], [1.0, 3.0]]\n[solution]\nz = [1.0, 2.0]\nw = [0.0, 0.0]\n",
    "kind = \"lcp\"\nq = [-1, 2]\n[M]\nshape = [2, 2]\nentries = [[0, 0, 1.0], [1, 1, 2.0]]\n",
    "kind = \"mlcp\"\nA = [[1]]\nC = [[2]]\nD = [[3]]\nB = [[4]]\na = [1]\nb = [2]\n[solution]\nu = [1.0]\nv = [2.0]\n",
    "kind = \"hlcp\"\nQ = [[1.0]]\nR = [[-1.0]]\nq = [2.0]\n[solution]\nx = [2.0]\ns = [0.0]\n",
    "kind = \"box_lcp\"\nM = [[1.0, 0.0], [0.0, 1.0]]\nq = [1, -1]\nlower = [-inf, 0.0]\nupper = [inf, 1.0]\n",
    "kind = \"mcp\"\nnames = [\"a[1]\", \"p\"]\nF = [\"2*a[1]^2 - exp(-p/3)\", \"max(a[1], p, 1e-3) - if(p >= 0, sqrt(p), 2)\"]\nlower = [0, -inf]\nstart = [1, 2]\n[solution]\nx = [0.5, 1]\nF = [0, 0]\n",
    "kind = \"mcp\"\nF = [\"-x1^-2^x2*pi + `x1`\", \"!(x1 < x2 || x2 != 3) - piecewise(x1, -1, 0, 2)\"]\nupper = [inf, 3.0]\n",
];

#[test]
fn toml_files() {
    let seeds: Vec<_> = TOML.iter().map(|text| text.as_bytes().to_vec()).collect();
    let words = [
        "inf",
        "nan",
        "-0.0",
        "1e308",
        "18446744073709551615",
        "free = ",
        "[[",
        "\"mlcp\"",
        "1_0",
        "((",
        "^",
        "`",
        "x1",
        "-",
        "atan2(",
        ", ",
    ];
    let mut random = Random(2);
    for _ in 0..rounds() {
        let bytes = random.mutation(&seeds, &words);
        again(&Toml, Toml.parse(Path::new("x"), &bytes));
    }
}

/// M, q, l, u and z.
const MARKET: [[&str; 5]; 3] = [
    ["%%MatrixMarket matrix array real general\n2 2\n1\n0\n0\n2\n", "-1\n2\n", "", "", "1 0"],
    [
        "%%MatrixMarket matrix coordinate real symmetric\n% a\n2 2 3\n1 1 2.5\n2 1 -1\n2 2 2\n",
        "%%MatrixMarket matrix array real general\n2 1\n-1\n2\n",
        "-inf 0\n",
        "1 inf\n",
        "",
    ],
    [
        "%%MatrixMarket matrix coordinate integer skew-symmetric\n2 2 1\n2 1 3\n",
        "-1 2\n",
        "",
        "",
        "",
    ],
];

#[test]
fn market_files() {
    let seeds: Vec<_> = MARKET.iter().map(|files| files.join("\u{1}").into_bytes()).collect();
    let words = ["array", "coordinate", "symmetric", "general", "1048576", "-1", "\u{1}", "nan"];
    let mut random = Random(3);
    for _ in 0..rounds() {
        let bytes = random.mutation(&seeds, &words);
        let text = String::from_utf8_lossy(&bytes);
        let mut files = text.split('\u{1}');
        let matrix = files.next().unwrap_or_default();
        let parts = [(); 4].map(|()| files.next().filter(|part| !part.is_empty()));
        again(&Toml, market::parse("x.mtx", matrix, parts));
    }
}

const SICONOS: [&str; 9] = [
    "2\n0\n2 2\n2 2\n2 1\n1 2\n-5 -6\n",
    "2\n0\n2 2\n2 2\n2 1\n1 2\n-5 -6\n-1 -1\n1 1\n",
    "2\n1\n2 2\n1\n1\n1\n2\n2\n2\n1\n0 1\n0\n0\n2 1\n1 2\n-5 -6\n",
    "2\n2\n2 2\n1\nCSparse Version 3\ntriplet: 2-by-2, nzmax: 2 nnz: 2\n0 0 : 1\n1 1 : 2\n-5 -6\n",
    "2\n2\n2 2\n3\nCSparse Version 3\n2-by-2, nzmax: 2 nnz: 2, 1-norm: 2\ncol 0 : locations 0 to 0\n0 : 1\ncol 1 : locations 1 to 1\n1 : 2\n-5 -6\n",
    "1 0\n1\n1\n0 1 2\n0 1\n0\n2 2\n2 2\n2 1\n1 2\n-5 -6\n",
    "0 1\n1\n1\n2\n3\n4\n5\n-1\n-2\n",
    "2\n1\n0\n2\n2\n2 2\n2 0\n1 3\n-4 -5\n0.7\n",
    "2\n1\n0\n1\n1\n1 1\n2\n0\n1\n2\n1 2\n1 1\n-1\n0 0\n0.3\n",
];

#[test]
fn siconos_files() {
    let seeds: Vec<_> = SICONOS.iter().map(|text| text.as_bytes().to_vec()).collect();
    let words = ["0 ", "1 ", "2 ", "\n", "18446744073709551615", "4294967296", "nan", "col", " : "];
    let mut random = Random(4);
    for _ in 0..rounds() {
        let bytes = random.mutation(&seeds, &words);
        for name in ["lcp.dat", "relay.dat", "x.dat"] {
            let read = Siconos.parse(Path::new(name), &bytes);
            let contacts =
                read.as_ref().is_ok_and(|file| !file.problem.kind().is_complementarity());
            let keeps: &dyn Format = if contacts { &Fclib } else { &Toml };
            again(keeps, read);
        }
    }
}

#[test]
fn nl_files() {
    let seeds = [
        &include_bytes!("../nl/pairs.nl")[..],
        include_bytes!("../nl/ampl.nl"),
        include_bytes!("../nl/pairs-little.nl"),
        include_bytes!("../nl/pairs-big.nl"),
    ]
    .map(<[u8]>::to_vec);
    let words = [
        "\nC2\n",
        "\nV3 1 0\n",
        "\no54\n3\n",
        "\no64\n2\n",
        "\no11\n",
        "\no35\n",
        "\nv3\n",
        "\nn1e308\n",
        "nan",
        "inf",
        "1e30",
        "-1",
        "4294967296",
        "99999999999999999999",
        "\nh3:abc\n",
        "\nf0 1\n",
        "\nO0 0\n",
        "\n5 3 2\n",
        "\n4 1\n",
        "\n3\n",
        "#",
    ];
    let mut random = Random(5);
    let allowed = Options { side_inequalities: true, ..Options::default() };
    for _ in 0..rounds() {
        let bytes = random.mutation(&seeds, &words);
        again(&Nl, Nl.parse(Path::new("x"), &bytes));
        match Model::parse(Path::new("x"), &bytes, &allowed) {
            Ok(model) => model.problem.validate().unwrap(),
            Err(e) => refused(&e.to_string()),
        }
    }
}

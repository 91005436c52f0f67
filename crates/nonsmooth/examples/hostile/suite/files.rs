//! Damaged files of every format: a reader answers with a problem that is valid or with an error, soon, and never panics.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::Instant;

use nonsmooth::{
    AnyProblem, BoxLcp, FrictionGlobal, FrictionLocal, Hlcp, Lcp, Matrix, Mlcp, with_problem,
};
use nonsmooth_io::{ProblemFile, read};

use super::cases::Made;
use super::claims::{Lie, Tally};
use super::draft::Rng;
use super::kinds::Hostile;

/// The formats, by extension.
const FORMATS: [&str; 4] = ["toml", "mtx", "dat", "hdf5"];

/// Words that sizes and numbers hold in damaged files.
const WORDS: [&str; 14] = [
    "nan",
    "inf",
    "-inf",
    "1e999",
    "-1",
    "0",
    "4294967296",
    "18446744073709551615",
    "1e-400",
    "",
    "0x10",
    "[[",
    "=",
    "\n\n",
];

/// Writes a problem of the seed and index in every format, damages it `rounds` times and reads it.
pub fn run(folder: &Path, seed: u64, index: u64, rounds: usize) -> Tally {
    let mut tally = Tally::default();
    let mut rng = Rng::of(seed, 50, index);
    for format in FORMATS {
        let path = folder.join(format!("damaged.{format}"));
        // The vectors beside a matrix would become parts of the next problem.
        for part in ["q", "l", "u"] {
            let _ = std::fs::remove_file(folder.join(format!("damaged_{part}.mtx")));
        }
        write(&path, format, seed, index, &mut rng);
        let original = std::fs::read(&path).expect("what was written");
        for _ in 0..rounds {
            std::fs::write(&path, damaged(&original, &mut rng)).expect("a folder of our own");
            let begun = Instant::now();
            let read = catch_unwind(AssertUnwindSafe(|| read(&path).map(|p| is_valid(&p))));
            let mut lie = |claim, why: String| {
                tally.lies.push(Lie {
                    kind: "files",
                    seed,
                    index,
                    solver: format.into(),
                    claim,
                    why,
                    recipe: String::new(),
                    size: original.len(),
                });
                let kept =
                    folder.join(format!("{}-{seed}-{index}.{format}", claim.replace(' ', "-")));
                let _ = std::fs::copy(&path, kept);
            };
            let status = match read {
                Ok(Ok(true)) => "read",
                Ok(Ok(false)) => {
                    lie("invalid", "a problem that is not valid".into());
                    "invalid"
                }
                Ok(Err(e)) => {
                    let message = e.to_string();
                    if message.contains('\n') || message.contains("stopped the HDF5 reader") {
                        lie("message", message);
                    }
                    "refused"
                }
                Err(_) => {
                    lie("panic", "a panic".into());
                    "panic"
                }
            };
            if begun.elapsed().as_secs_f64() > 1.0 {
                lie("late", format!("{:?}", begun.elapsed()));
            }
            *tally
                .counts
                .entry(("files", format.into()))
                .or_default()
                .entry(status)
                .or_default() += 1;
        }
    }
    tally
}

fn is_valid(problem: &AnyProblem) -> bool {
    with_problem!(problem, p => p.validate().is_ok())
}

fn write(path: &Path, format: &str, seed: u64, index: u64, rng: &mut Rng) {
    let lcp = || AnyProblem::from(Lcp::case(seed, index).problem);
    let boxed = || AnyProblem::from(BoxLcp::case(seed, index).problem);
    match format {
        "hdf5" => match rng.below(4) {
            0 => FrictionLocal::<2>::case(seed, index).problem.save(path),
            1 => FrictionLocal::<3>::case(seed, index).problem.save(path),
            2 => FrictionGlobal::<2>::case(seed, index).problem.save(path),
            _ => FrictionGlobal::<3>::case(seed, index).problem.save(path),
        },
        "dat" => {
            let text = match rng.below(2) {
                0 => siconos(&Lcp::case(seed, index).problem.M, &Lcp::case(seed, index).problem.q),
                _ => {
                    let p = BoxLcp::case(seed, index).problem;
                    let bounds = [&p.lower[..], &p.upper].concat();
                    siconos(&p.M, &[&p.q[..], &bounds].concat())
                }
            };
            std::fs::write(path, text).expect("a folder of our own");
            return;
        }
        "mtx" => {
            let problem = if rng.chance(50) { lcp() } else { boxed() };
            ProblemFile::new(problem).write(path)
        }
        _ => {
            let problem = match rng.below(4) {
                0 => lcp(),
                1 => boxed(),
                2 => Mlcp::case(seed, index).problem.into(),
                _ => Hlcp::case(seed, index).problem.into(),
            };
            ProblemFile::new(problem).write(path)
        }
    }
    .expect("a valid problem");
}

/// Siconos' text of a dense matrix, by columns, and what follows it.
fn siconos(m: &Matrix, rest: &[f64]) -> String {
    let dense = m.to_dense().expect("entries");
    let n = dense.nrows();
    let numbers = |x: Vec<f64>| x.iter().map(|x| format!("{x:?} ")).collect::<String>();
    let mut text = format!("{n}\n0 {n} {n}\n{n} {n}\n");
    for j in 0..n {
        text += &numbers((0..n).map(|i| dense[(i, j)]).collect());
        text.push('\n');
    }
    for part in rest.chunks(n) {
        text += &numbers(part.to_vec());
        text.push('\n');
    }
    text
}

/// A copy with a few bytes, words or pieces changed.
fn damaged(original: &[u8], rng: &mut Rng) -> Vec<u8> {
    let mut bytes = original.to_vec();
    for _ in 0..=rng.below(4) {
        if bytes.is_empty() {
            return bytes;
        }
        let at = rng.below(bytes.len());
        match rng.below(7) {
            0 | 1 => bytes[at] = rng.pick(&[0, 1, 0x7f, 0x80, 0xff, b' ', b'-', b'e', b'9']),
            2 => bytes[at] ^= 1 << rng.below(8),
            3 => bytes.truncate(at),
            4 => {
                let end = (at + rng.below(40)).min(bytes.len());
                let piece = bytes[at..end].to_vec();
                let to = rng.below(bytes.len());
                bytes.splice(to..to, piece);
            }
            5 => {
                let end = (at + rng.below(16)).min(bytes.len());
                bytes.drain(at..end);
            }
            _ => {
                // The word here becomes another.
                let blank = |b: &u8| !b.is_ascii_graphic() || b",=[]".contains(b);
                let start = bytes[..at].iter().rposition(blank).map_or(0, |i| i + 1);
                let end = bytes[at..].iter().position(blank).map_or(bytes.len(), |i| at + i);
                let word = rng.pick(&WORDS).as_bytes().to_vec();
                bytes.splice(start..end.max(start), word);
            }
        }
    }
    bytes
}

//! Times against n of the methods for linear complementarity problems, as a table and a log–log plot.
//!
//! `cargo run --release -p nonsmooth-figures --example scaling -- [DIRECTORY]` measures, `... -- --draw DIRECTORY` draws the times of `scaling.csv` in the directory
//! again.
//!
//! Two families with about half of the variables active: dense nonsymmetric positive definite M, and the obstacle problem (5-point Laplacian, sparse, symmetric). A
//! method leaves a family after its first solve of more than two seconds. One thread; each figure is the faster of two solves to 1e-8, set-up included. With a
//! directory, `scaling.svg` and `scaling.csv` are written there.

use std::path::{Path, PathBuf};

use nonsmooth_bench::figures::{Family, Scaling, scaling};
use nonsmooth_linalg::{Csc, Dense};
use nonsmooth_problem::{Lcp, Problem};
use nonsmooth_solve::registry;
use nonsmooth_solve::settings;
use nonsmooth_solve::{Limits, Status};

/// A solver leaves after a solve that took longer, s.
const ENOUGH: f64 = 2.0;
/// The longest solve, s.
const LONGEST: f64 = 15.0;

/// Pseudo-random in (−1, 1), the same for the same index.
fn noise(k: usize) -> f64 {
    2.0 * ((k as f64 * 0.754_877_666 + 0.1).sin() * 43_758.545).fract().abs() - 1.0
}

/// `M = I + S/4 + (A − Aᵀ)/2`, S and A with entries of the order of `1/√n`; half of z positive.
fn dense(n: usize) -> Lcp {
    let scale = 1.0 / (n as f64).sqrt();
    let entry = |i: usize, j: usize| noise(i * n + j) * scale;
    let m = Dense::from_fn(n, n, |i, j| {
        let symmetric = 0.125 * (entry(i, j) + entry(j, i));
        let skew = 0.5 * (entry(i, j) - entry(j, i));
        symmetric + skew + if i == j { 1.0 } else { 0.0 }
    });
    planted(m)
}

fn planted(m: Dense) -> Lcp {
    let n = m.nrows();
    let z = |i: usize| noise(7 * i + 3).max(0.0);
    let w = |i: usize| (-noise(7 * i + 3)).max(0.0);
    let q = (0..n).map(|i| w(i) - (0..n).map(|j| m[(i, j)] * z(j)).sum::<f64>()).collect();
    Lcp::new(m, q).expect("valid")
}

/// The 5-point Laplacian on k × k points over an obstacle that half of the membrane touches.
fn obstacle(k: usize) -> Lcp {
    let h = 1.0 / (k + 1) as f64;
    let mut entries = vec![];
    let mut q = vec![];
    for i in 0..k * k {
        let (x, y) = (i % k, i / k);
        entries.push((i, i, 4.0));
        let mut couple = |there: bool, j: usize| {
            if there {
                entries.push((i, j, -1.0));
            }
        };
        couple(x > 0, i.wrapping_sub(1));
        couple(x + 1 < k, i + 1);
        couple(y > 0, i.wrapping_sub(k));
        couple(y + 1 < k, i + k);
        let (x, y) = ((x + 1) as f64 * h, (y + 1) as f64 * h);
        q.push(-h * h * 50.0 * ((3.0 * x).sin() * (9.0 * y).sin() - 0.1));
    }
    Lcp::new(Csc::from_triplets(k * k, k * k, entries.into_iter()).expect("in range"), q)
        .expect("valid")
}

/// The faster of two solves, s; `None` if it is not solved.
fn seconds(problem: &Lcp, label: &str) -> Option<f64> {
    let (name, texts) = label
        .split_once(':')
        .map_or((label, vec![]), |(name, rest)| (name, rest.split(',').collect()));
    let settings = settings::from_texts(&texts).expect("key=value");
    let limits = Limits { time_limit: Some(LONGEST), ..Limits::default() };
    let solve = || {
        let mut session = registry::session::<Lcp>(name, &settings).expect(label);
        let mut point = problem.origin();
        let outcome = session.solve(problem, &mut point, &limits, &mut |_| {}).ok()?;
        (outcome.status == Status::Solved).then_some(outcome.seconds)
    };
    let first = solve()?;
    Some(if first < ENOUGH { first.min(solve()?) } else { first })
}

fn family(title: &str, labels: &[&str], sizes: &[usize], make: fn(usize) -> Lcp) -> Scaling {
    let mut curves: Vec<(String, Vec<(f64, f64)>)> =
        labels.iter().map(|l| (l.to_string(), vec![])).collect();
    let mut done = vec![false; labels.len()];
    for &size in sizes {
        let problem = make(size);
        let n = problem.q.len();
        for (k, label) in labels.iter().enumerate() {
            if done[k] {
                continue;
            }
            let found = seconds(&problem, label);
            let text = found.map_or("not solved".into(), |t| format!("{t:.3e} s"));
            println!("{title:12} n = {n:8} {label:24} {text}");
            if let Some(t) = found {
                curves[k].1.push((n as f64, t));
            }
            done[k] = found.is_none_or(|t| t > ENOUGH);
        }
    }
    curves.retain(|(_, points)| !points.is_empty());
    Scaling { title: title.into(), curves }
}

/// The families, one a row of panels.
const FAMILIES: &[Family] = &[
    Family {
        title: "pivoting",
        labels: &[
            "lemke:basis=tableau",
            "lemke:basis=dense",
            "lemke:basis=sparse",
            "keller",
            "block_pivoting",
        ],
    },
    Family {
        title: "interior points, quadratic programs",
        labels: &["ip_mehrotra", "ip_mty", "qp"],
    },
    Family { title: "semismooth Newton", labels: &["newton_min", "newton_fb"] },
    Family { title: "splitting, projected gradients", labels: &["pgs", "psor", "mprgp"] },
];

/// The times that an earlier run kept.
fn kept(path: &Path) -> Result<Vec<Scaling>, String> {
    let bad = |e: csv::Error| format!("{}: {e}", path.display());
    let mut all: Vec<Scaling> = vec![];
    for row in csv::Reader::from_path(path).map_err(bad)?.deserialize() {
        let (title, label, n, seconds): (String, String, f64, f64) = row.map_err(bad)?;
        if all.last().is_none_or(|problem| problem.title != title) {
            all.push(Scaling { title, curves: vec![] });
        }
        let curves = &mut all.last_mut().expect("one is there").curves;
        if curves.last().is_none_or(|curve| curve.0 != label) {
            curves.push((label, vec![]));
        }
        curves.last_mut().expect("one is there").1.push((n, seconds));
    }
    Ok(all)
}

fn main() -> Result<(), String> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (panels, directory) = match &arguments[..] {
        [] => (measured(), None),
        [directory] => (measured(), Some(PathBuf::from(directory))),
        [draw, directory] if draw == "--draw" => {
            let directory = PathBuf::from(directory);
            (kept(&directory.join("scaling.csv"))?, Some(directory))
        }
        other => return Err(format!("expected [--draw] DIRECTORY, found {}", other.join(" "))),
    };
    let notes = ["the faster of two solves to 1e-8, one thread, set-up included; a method leaves after its first solve of more than 2 s".to_owned()];
    let title = "Linear complementarity: time against size";
    let figure = scaling("scaling", title, &notes, &panels, FAMILIES, "auto")?;
    if let Some(directory) = directory {
        for (end, text) in [("svg", &figure.svg), ("csv", &figure.csv)] {
            let path = directory.join(format!("scaling.{end}"));
            std::fs::write(&path, text).map_err(|e| format!("{}: {e}", path.display()))?;
        }
    }
    Ok(())
}

fn measured() -> Vec<Scaling> {
    let on_dense = [
        "auto",
        "lemke:basis=tableau",
        "lemke:basis=dense",
        "keller",
        "block_pivoting",
        "ip_mehrotra",
        "ip_mty",
        "qp",
        "newton_min",
        "newton_fb",
        "pgs",
    ];
    let on_sparse = [
        "auto",
        "lemke:basis=sparse",
        "block_pivoting",
        "ip_mehrotra",
        "ip_mty",
        "qp",
        "newton_min",
        "newton_fb",
        "pgs",
        "psor",
        "mprgp",
    ];
    vec![
        family("dense", &on_dense, &[10, 20, 50, 100, 200, 500, 1000, 2000], dense),
        family("obstacle", &on_sparse, &[4, 10, 32, 71, 100, 316, 1000], obstacle),
    ]
}

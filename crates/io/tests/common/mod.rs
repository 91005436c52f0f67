//! What the tests share: problems at random, and files made by hand.
#![allow(dead_code, non_snake_case)]

use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

use hdf5_pure::{FileBuilder, GroupBuilder};
use nonsmooth_io::{Info, ProblemFile, StoredPoint};
use nonsmooth_linalg::{Bsr, Csc};
use nonsmooth_problem::{
    AnyPoint, AnyProblem, Friction, FrictionGlobal, FrictionLocal, GlobalPoint, LocalPoint,
    RowsGlobal, RowsLocal,
};
use proptest::collection::{btree_map, vec};
use proptest::option;
use proptest::prelude::*;

/// Says that a test, or a part of it, did not run; past the capture of the output of tests.
pub fn skipped(why: &str) {
    let line = format!("SKIPPED: {why}\n");
    std::io::stderr().write_all(line.as_bytes()).unwrap();
}

/// Any finite number: zeros of both signs and subnormals included.
pub fn real() -> impl Strategy<Value = f64> + Clone {
    use proptest::num::f64::{NEGATIVE, NORMAL, POSITIVE, SUBNORMAL, ZERO};
    POSITIVE | NEGATIVE | NORMAL | SUBNORMAL | ZERO
}

fn csc(rows: usize, columns: usize) -> impl Strategy<Value = Csc> {
    // Of an empty matrix no entry exists to choose.
    let most = if rows * columns == 0 { 0 } else { 30 };
    btree_map((0..rows.max(1), 0..columns.max(1)), real(), 0..=most).prop_map(move |entries| {
        let entries = entries.iter().map(|(&(i, j), &x)| (i, j, x));
        Csc::from_triplets(rows, columns, entries).unwrap()
    })
}

fn mu(nc: usize) -> impl Strategy<Value = Vec<f64>> {
    vec(prop_oneof![Just(0.0), 0.0..2.0], nc)
}

fn local<const D: usize>() -> impl Strategy<Value = FrictionLocal<D>> {
    (1..5_usize, 0..4_usize).prop_flat_map(|(nc, p)| {
        let m = D * nc;
        let bilateral = (csc(m, p), csc(p, p), vec(real(), p));
        (csc(m, m), vec(real(), m), mu(nc), option::of(bilateral)).prop_map(|(w, q, mu, b)| {
            let bilateral = b.map(|(V, R, s)| RowsLocal::bilateral(V, R, s));
            FrictionLocal { W: Bsr::from_csc(&w), q, mu, mu_r: (), rows: bilateral }
        })
    })
}

fn global<const D: usize>() -> impl Strategy<Value = FrictionGlobal<D>> {
    (1..5_usize, 1..8_usize, 0..4_usize).prop_flat_map(|(nc, n, p)| {
        let m = D * nc;
        let bilateral = option::of((csc(n, p), vec(real(), p)));
        (csc(n, n), csc(n, m), vec(real(), n), vec(real(), m), mu(nc), bilateral).prop_map(
            |(M, H, f, w, mu, b)| {
                let bilateral = b.map(|(G, b)| RowsGlobal::bilateral(G, b));
                FrictionGlobal { M, H, f, w, mu, mu_r: (), rows: bilateral }
            },
        )
    })
}

fn problem() -> impl Strategy<Value = AnyProblem> {
    prop_oneof![
        local::<2>().prop_map(AnyProblem::from),
        local::<3>().prop_map(AnyProblem::from),
        global::<2>().prop_map(AnyProblem::from),
        global::<3>().prop_map(AnyProblem::from),
    ]
}

/// A point as FCLIB stores it; with v, of a global problem.
pub fn stored(v: Option<Vec<f64>>, u: Vec<f64>, r: Vec<f64>, lambda: Vec<f64>) -> StoredPoint {
    let point = match v {
        None => LocalPoint { r, lambda }.into(),
        Some(v) => GlobalPoint { v, r, lambda }.into(),
    };
    StoredPoint { point, partner: Some(u), statuses: vec![] }
}

/// The impulses and the multipliers of a point of contacts.
pub fn impulses(stored: &mut StoredPoint) -> (&mut Vec<f64>, &mut Vec<f64>) {
    match &mut stored.point {
        AnyPoint::Local(LocalPoint { r, lambda }) => (r, lambda),
        AnyPoint::Global(GlobalPoint { r, lambda, .. }) => (r, lambda),
        other => panic!("{other:?}"),
    }
}

fn point((v, m, p): (Option<usize>, usize, usize)) -> impl Strategy<Value = StoredPoint> {
    let v_real = vec(real(), v.unwrap_or(0));
    (v_real, vec(real(), m), vec(real(), m), vec(real(), p))
        .prop_map(move |(x, u, r, l)| stored(v.map(|_| x), u, r, l))
}

fn info() -> impl Strategy<Value = Info> {
    let text = || option::of("[a-zà-ž ∈\n]{0,20}");
    let count = || option::of(0..100_usize);
    (text(), text(), text(), count(), count()).prop_map(
        |(title, description, math_info, dofs, involved_ds)| Info {
            title,
            description,
            math_info,
            dofs,
            involved_ds,
            names: vec![],
        },
    )
}

/// The problem of contacts in a file.
pub fn contacts(file: &ProblemFile) -> &Friction {
    file.contacts(Path::new("the file")).unwrap()
}

/// The lengths of v, of u and r, and of l.
pub fn sizes(problem: &AnyProblem) -> (Option<usize>, usize, usize) {
    let AnyProblem::Friction(problem) = problem else { panic!("{problem:?}") };
    match problem {
        Friction::Local2(p) => (None, p.q.len(), p.multipliers()),
        Friction::Local3(p) => (None, p.q.len(), p.multipliers()),
        Friction::RollingLocal(p) => (None, p.q.len(), p.multipliers()),
        Friction::Global2(p) => (Some(p.dofs()), p.w.len(), p.multipliers()),
        Friction::Global3(p) => (Some(p.dofs()), p.w.len(), p.multipliers()),
        Friction::RollingGlobal(p) => (Some(p.dofs()), p.w.len(), p.multipliers()),
    }
}

/// A whole file at random.
pub fn content() -> impl Strategy<Value = ProblemFile> {
    (problem(), info()).prop_flat_map(|(problem, info)| {
        let sizes = sizes(&problem);
        let drawing = option::of("[^\0]*");
        (option::of(point(sizes)), vec(point(sizes), 0..12), drawing).prop_map(
            move |(solution, guesses, drawing)| {
                let (problem, info) = (problem.clone(), info.clone());
                ProblemFile { problem, info, solution, guesses, drawing }
            },
        )
    })
}

/// Equality bit for bit: `Debug` tells -0.0 from 0.0, and its digits are those of one number only.
pub fn assert_same(a: &ProblemFile, b: &ProblemFile) {
    assert_eq!(format!("{a:?}"), format!("{b:?}"));
}

/// A dataset of a file made by hand.
#[derive(Clone)]
pub enum Data {
    /// 32-bit integers, rank 1.
    I(Vec<i32>),
    /// 64-bit integers, rank 1.
    I64(Vec<i64>),
    /// Unsigned 64-bit integers, rank 1.
    U64(Vec<u64>),
    /// One 16-bit integer in a scalar dataspace.
    Scalar(i16),
    /// 64-bit reals, rank 1.
    F(Vec<f64>),
    /// 32-bit reals, rank 1.
    F32(Vec<f32>),
    /// Unsigned 8-bit integers, rank 1.
    U8(Vec<u8>),
    /// A variable-length string.
    Text(&'static str),
}

/// A file made by hand: datasets by their path, without the leading slash. A path that ends in a slash makes
/// an empty group.
#[derive(Clone)]
pub struct Tree(pub BTreeMap<String, Data>);

impl Tree {
    pub fn set(mut self, path: &str, data: Data) -> Self {
        self.0.insert(path.into(), data);
        self
    }

    /// Without the dataset, or the whole group, of that path.
    pub fn without(mut self, path: &str) -> Self {
        let before = self.0.len();
        self.0.retain(|key, _| key != path && !key.starts_with(&format!("{path}/")));
        assert!(self.0.len() < before, "{path} is not there");
        self
    }

    /// The same with a group renamed.
    pub fn renamed(self, from: &str, to: &str) -> Self {
        Self(self.0.into_iter().map(|(k, v)| (k.replacen(from, to, 1), v)).collect())
    }

    pub fn matrix(
        self,
        path: &str,
        (m, n, nz): (i32, i32, i32),
        (p, i, x): (&[i32], &[i32], &[f64]),
    ) -> Self {
        let int = |x| Data::I(vec![x]);
        self.set(&format!("{path}/m"), int(m))
            .set(&format!("{path}/n"), int(n))
            .set(&format!("{path}/nz"), int(nz))
            .set(&format!("{path}/nzmax"), int(x.len() as i32))
            .set(&format!("{path}/p"), Data::I(p.into()))
            .set(&format!("{path}/i"), Data::I(i.into()))
            .set(&format!("{path}/x"), Data::F(x.into()))
    }

    pub fn save(&self, folder: &Path) -> PathBuf {
        let path = folder.join("hand-made.hdf5");
        let mut root = Node::default();
        for (key, data) in &self.0 {
            let mut node = &mut root;
            for part in key.split('/').filter(|part| !part.is_empty()) {
                node = node.children.entry(part.into()).or_default();
            }
            node.data = (!key.ends_with('/')).then_some(data);
        }
        let mut file = FileBuilder::new();
        for (name, node) in &root.children {
            match node.data {
                Some(data) => put(file.create_dataset(name), data),
                None => {
                    let mut group = file.create_group(name);
                    node.build(&mut group);
                    file.add_group(group.finish());
                }
            }
        }
        file.write(&path).unwrap();
        path
    }
}

#[derive(Default)]
struct Node<'a> {
    data: Option<&'a Data>,
    children: BTreeMap<String, Node<'a>>,
}

impl Node<'_> {
    fn build(&self, group: &mut GroupBuilder) {
        for (name, node) in &self.children {
            match node.data {
                Some(data) => put(group.create_dataset(name), data),
                None => {
                    let mut child = group.create_group(name);
                    node.build(&mut child);
                    group.add_group(child.finish());
                }
            }
        }
    }
}

fn put(dataset: &mut hdf5_pure::DatasetBuilder, data: &Data) {
    match data {
        Data::I(x) => dataset.with_i32_data(x),
        Data::I64(x) => dataset.with_i64_data(x),
        Data::U64(x) => dataset.with_u64_data(x),
        Data::Scalar(x) => dataset.with_i16_data(&[*x]).with_shape(&[]),
        Data::F(x) => dataset.with_f64_data(x),
        Data::F32(x) => dataset.with_f32_data(x),
        Data::U8(x) => dataset.with_u8_data(x),
        Data::Text(x) => dataset.with_vlen_strings(&[x]),
    };
}

/// The 4 × 4 W of [`local_tree`] by rows, and its storages: `(p, i, x)`.
pub const W: [[f64; 4]; 4] =
    [[2.0, 0.5, -1.0, 0.0], [0.25, 3.0, 0.0, 0.0], [-1.5, 0.0, 4.0, 0.125], [0.0, 0.0, 0.75, 5.0]];

/// Two contacts in the plane, W as sorted triplets.
pub fn local_tree() -> Tree {
    let f = |x: &[f64]| Data::F(x.into());
    Tree(BTreeMap::new())
        .set("fclib_local/spacedim", Data::I(vec![2]))
        .matrix(
            "fclib_local/W",
            (4, 4, 10),
            (
                &[0, 0, 0, 1, 1, 2, 2, 2, 3, 3],
                &[0, 1, 2, 0, 1, 0, 2, 3, 2, 3],
                &[2.0, 0.25, -1.5, 0.5, 3.0, -1.0, 4.0, 0.75, 0.125, 5.0],
            ),
        )
        .set("fclib_local/vectors/q", f(&[-1.0, 0.5, -2.0, 0.25]))
        .set("fclib_local/vectors/mu", f(&[0.5, 0.0]))
        .set("fclib_local/info/title", Data::Text("hand-made"))
}

/// [`local_tree`] with one bilateral constraint.
pub fn bilateral_tree() -> Tree {
    local_tree()
        .matrix("fclib_local/V", (4, 1, 2), (&[0, 0], &[3, 1], &[0.5, -0.5]))
        .matrix("fclib_local/R", (1, 1, 1), (&[0], &[0], &[2.0]))
        .set("fclib_local/vectors/s", Data::F(vec![0.125]))
}

/// One contact in space, three degrees of freedom, one bilateral constraint; a solution and a guess.
pub fn global_tree() -> Tree {
    let f = |x: &[f64]| Data::F(x.into());
    let tree = Tree(BTreeMap::new())
        .set("fclib_global/spacedim", Data::I(vec![3]))
        .matrix("fclib_global/M", (2, 2, 2), (&[0, 1], &[0, 1], &[1.0, 2.0]))
        .matrix("fclib_global/H", (2, 3, 3), (&[0, 1, 2], &[0, 1, 0], &[1.0, 1.0, 0.5]))
        .matrix("fclib_global/G", (2, 1, 1), (&[0], &[1], &[1.0]))
        .set("fclib_global/vectors/f", f(&[-1.0, 1.0]))
        .set("fclib_global/vectors/w", f(&[0.0, 0.0, 0.5]))
        .set("fclib_global/vectors/mu", f(&[0.25]))
        .set("fclib_global/vectors/b", f(&[0.0]))
        .set("guesses/number_of_guesses", Data::I(vec![1]));
    ["solution", "guesses/1"].iter().fold(tree, |tree, group| {
        tree.set(&format!("{group}/v"), f(&[1.0, 2.0]))
            .set(&format!("{group}/u"), f(&[0.0, 0.0, 0.0]))
            .set(&format!("{group}/r"), f(&[1.0, 0.0, 0.125]))
            .set(&format!("{group}/l"), f(&[3.0]))
    })
}

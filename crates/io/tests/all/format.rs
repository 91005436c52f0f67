//! FCLIB's format: its storages and types, and one clear line for each way to get it wrong.

use std::path::Path;

use crate::common::{Data, Tree, bilateral_tree, global_tree, local_tree};
use nonsmooth_io::fclib::{self, Fclib};
use nonsmooth_io::{Format, ProblemFile};
use nonsmooth_problem::Friction;

/// The problem of contacts in a tree.
fn problem(tree: &Tree) -> Friction {
    fclib::read_problem(tree.save(tempfile::tempdir().unwrap().path())).unwrap()
}

fn read(tree: &Tree) -> ProblemFile {
    let folder = tempfile::tempdir().unwrap();
    Fclib.read(&tree.save(folder.path())).unwrap_or_else(|e| panic!("{e}"))
}

/// The message of reading that file, without the file's name.
fn message(path: &Path) -> String {
    let message = Fclib.read(path).expect_err("a bad file").to_string();
    assert!(!message.contains('\n'), "{message}");
    message.strip_prefix(&format!("{}: ", path.display())).expect(&message).to_string()
}

#[track_caller]
fn refused(tree: &Tree, expected: &str) {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(message(&tree.save(folder.path())), expected);
}

#[test]
fn hand_made_files_read_as_stated() {
    let content = read(&local_tree());
    let Friction::Local2(p) = crate::common::contacts(&content) else {
        panic!("{:?}", content.problem)
    };
    let w = p.W.to_csc();
    for (i, row) in crate::common::W.iter().enumerate() {
        for (j, &x) in row.iter().enumerate() {
            assert_eq!(w.get(i, j), x, "W[{i}, {j}]");
        }
    }
    assert_eq!(content.info.title.as_deref(), Some("hand-made"));

    let content = read(&global_tree());
    let Friction::Global3(p) = crate::common::contacts(&content) else {
        panic!("{:?}", content.problem)
    };
    assert_eq!((p.H.nrows(), p.H.ncols(), p.H.get(0, 2)), (2, 3, 0.5));
    assert_eq!(content.guesses, [content.solution.unwrap()]);
    let mut guess = content.guesses[0].clone();
    assert_eq!(crate::common::impulses(&mut guess).1, &[3.0]);

    let Friction::Local2(p) = problem(&bilateral_tree()) else { panic!() };
    let b = p.rows.unwrap();
    assert_eq!((b.V.get(3, 0), b.V.get(1, 0), b.R.get(0, 0), b.s[0]), (0.5, -0.5, 2.0, 0.125));
}

#[test]
fn all_storages_of_a_matrix_read_alike() {
    let expected = read(&local_tree());
    let path = "fclib_local/W";
    let shape = |nz| (4, 4, nz);
    // Columns and rows unsorted within themselves; room behind the last entry; row indices there are not read.
    let columns: (&[i32], &[i32], &[f64]) = (
        &[0, 3, 5, 8, 10],
        &[2, 0, 1, 1, 0, 3, 2, 0, 3, 2, -7, 99],
        &[-1.5, 2.0, 0.25, 3.0, 0.5, 0.75, 4.0, -1.0, 5.0, 0.125, 1.0, 1.0],
    );
    let rows: (&[i32], &[i32], &[f64]) = (
        &[0, 3, 5, 8, 10],
        &[2, 0, 1, 0, 1, 0, 3, 2, 2, 3],
        &[-1.0, 2.0, 0.5, 0.25, 3.0, -1.5, 0.125, 4.0, 0.75, 5.0],
    );
    // Duplicates (2 = 1 + 1, 0.25 = 1 - 0.75), disorder, an explicit zero, x longer than nz.
    let triplets: (&[i32], &[i32], &[f64]) = (
        &[3, 0, 0, 2, 0, 0, 1, 1, 2, 0, 2, 3, 2],
        &[3, 0, 1, 3, 0, 2, 0, 1, 2, 1, 0, 2, 1],
        &[5.0, 1.0, 1.0, 0.75, 1.0, -1.5, 0.5, 3.0, 4.0, -0.75, -1.0, 0.125, 0.0, 7.0],
    );
    for (nz, storage) in [(-1, columns), (-2, rows), (13, triplets)] {
        let tree = local_tree().matrix(path, shape(nz), storage);
        assert_eq!(read(&tree), expected, "nz = {nz}");
        // nzmax is only the room that a writer had; of triplets it says how many entries more than nz there may be.
        let tree = tree.set("fclib_local/W/nzmax", Data::I(vec![1000]));
        match nz {
            13 => refused(&tree, "/fclib_local/W/x: expected 13 entries (nz), found 14 entries"),
            _ => assert_eq!(read(&tree), expected, "nz = {nz}"),
        }
    }
}

#[test]
fn a_matrix_that_is_not_square_tells_rows_from_columns() {
    let expected = read(&global_tree());
    for (nz, p, i) in [(-1, &[0, 1, 2, 3][..], [0, 1, 0]), (-2, &[0, 2, 3][..], [0, 2, 1])] {
        let x = if nz == -1 { [1.0, 1.0, 0.5] } else { [1.0, 0.5, 1.0] };
        let tree = global_tree().matrix("fclib_global/H", (2, 3, nz), (p, &i, &x));
        assert_eq!(read(&tree), expected, "nz = {nz}");
    }
}

#[test]
fn duplicates_are_added_in_the_order_of_the_file() {
    // 1e16 + 1 + 1 rounds to 1e16 from the left; 1 + 1 + 1e16 does not.
    for (nz, p) in [(3, vec![0; 3]), (-1, vec![0, 3, 3]), (-2, vec![0, 3, 3])] {
        for (x, sum) in [([1e16, 1.0, 1.0], 1e16), ([1.0, 1.0, 1e16], 1e16 + 2.0)] {
            let tree = global_tree().matrix("fclib_global/M", (2, 2, nz), (&p, &[0; 3], &x));
            let Friction::Global3(problem) = problem(&tree) else { panic!() };
            assert_eq!(problem.M.get(0, 0), sum, "nz = {nz}");
        }
    }
}

#[test]
fn other_widths_and_scalars_are_read() {
    let expected = read(&local_tree());
    let tree = local_tree()
        .set("fclib_local/spacedim", Data::Scalar(2))
        .set("fclib_local/W/m", Data::I64(vec![4]))
        .set("fclib_local/W/n", Data::U64(vec![4]))
        .set("fclib_local/W/p", Data::U64(vec![0, 0, 0, 1, 1, 2, 2, 2, 3, 3]))
        .set("fclib_local/vectors/mu", Data::F32(vec![0.5, 0.0]))
        .without("fclib_local/W/nzmax");
    assert_eq!(read(&tree), expected);
}

#[test]
fn integers_and_whole_reals_stand_for_each_other() {
    let q = |data| {
        let tree = local_tree().set("fclib_local/vectors/q", data);
        let Friction::Local2(p) = problem(&tree) else { panic!() };
        p.q
    };
    assert_eq!(q(Data::I(vec![-1, 0, 2, i32::MIN])), [-1.0, 0.0, 2.0, -2147483648.0]);
    assert_eq!(q(Data::U8(vec![255, 0, 1, 2])), [255.0, 0.0, 1.0, 2.0]);
    // What is beyond the digits of a real rounds as in C.
    let wide = [i64::MIN, i64::MAX, (1 << 53) + 1, -3];
    assert_eq!(q(Data::I64(wide.into())), wide.map(|x| x as f64));
    assert_eq!(q(Data::U64(vec![u64::MAX, 0, 1, 2])), [18446744073709551616.0, 0.0, 1.0, 2.0]);

    let p = [0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 2.0, 3.0, 3.0];
    let with = |path: &str, data| local_tree().set(&format!("fclib_local/{path}"), data);
    let tree = with("spacedim", Data::F(vec![2.0]))
        .set("fclib_local/W/nz", Data::F32(vec![10.0]))
        .set("fclib_local/W/m", Data::U8(vec![4]))
        .set("fclib_local/W/p", Data::F(p.into()));
    assert_eq!(read(&tree), read(&local_tree()));
    for bad in [0.5, f64::NAN, f64::INFINITY, 1e300, 9223372036854775808.0, -9.3e18] {
        let mut p = p;
        p[3] = bad;
        let expected = "expected a whole number of at most 64 bits";
        let message = format!("/fclib_local/W/p[3]: {expected}, found {bad}");
        refused(&with("W/p", Data::F(p.into())), &message);
        let message = format!("/fclib_local/spacedim[0]: {expected}, found {bad}");
        refused(&with("spacedim", Data::F(vec![bad])), &message);
    }
    // The least 64-bit integer is one, and then out of range.
    refused(
        &with("spacedim", Data::F(vec![-9223372036854775808.0])),
        "/fclib_local/spacedim: expected 2 or 3, found -9223372036854775808",
    );
}

#[test]
fn what_follows_the_last_entry_means_nothing() {
    let expected = read(&local_tree());
    let path = "fclib_local/W";
    let tail = [f64::NAN, f64::INFINITY, 0.5];
    let reals = |x: &[f64]| Data::F([x, &tail].concat());
    let with = |nz, p: Data, i: &[f64], x: &[f64]| {
        local_tree()
            .set(&format!("{path}/nz"), Data::I(vec![nz]))
            .set(&format!("{path}/nzmax"), Data::I(vec![13]))
            .set(&format!("{path}/p"), p)
            .set(&format!("{path}/i"), reals(i))
            .set(&format!("{path}/x"), reals(x))
    };
    let i = [0.0, 1.0, 2.0, 0.0, 1.0, 0.0, 2.0, 3.0, 2.0, 3.0];
    let p = [0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 2.0, 3.0, 3.0];
    let columns = [2.0, 0.25, -1.5, 0.5, 3.0, -1.0, 4.0, 0.75, 0.125, 5.0];
    let rows = [2.0, 0.5, -1.0, 0.25, 3.0, -1.5, 4.0, 0.125, 0.75, 5.0];
    let pointers = || Data::I(vec![0, 3, 5, 8, 10]);
    assert_eq!(read(&with(10, reals(&p), &i, &columns)), expected);
    assert_eq!(read(&with(-1, pointers(), &i, &columns)), expected);
    // The pattern is symmetric: the same indices by rows.
    assert_eq!(read(&with(-2, pointers(), &i, &rows)), expected);
    // The entries themselves must still be finite.
    let mut x = columns;
    x[9] = f64::NAN;
    refused(
        &with(10, reals(&p), &i, &x),
        "/fclib_local/W/x[9]: expected a finite number, found NaN",
    );
}

#[test]
fn multipliers_without_entries_may_be_there_or_not() {
    let empty = || Data::F(vec![]);
    let tree = global_tree()
        .matrix("fclib_global/G", (2, 0, 0), (&[], &[], &[]))
        .set("fclib_global/vectors/b", empty())
        .set("solution/l", empty())
        .without("guesses/1/l");
    let content = read(&tree);
    let mut solution = content.solution.clone().unwrap();
    assert!(crate::common::impulses(&mut solution).1.is_empty());
    assert_eq!(content.guesses, [content.solution.unwrap()]);
    refused(
        &tree.set("solution/l", Data::F(vec![1.0])),
        "/solution/l: expected 0 entries (bilateral constraints), found 1 entries",
    );
}

#[test]
fn what_is_no_fclib_file_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        message(&path)
    };
    assert_eq!(
        message(&folder.path().join("absent.hdf5")),
        "expected a readable file, found: No such file or directory (os error 2)"
    );
    assert_eq!(
        message(folder.path()),
        format!("expected a file of {}, found a directory", nonsmooth_io::listed(|_| true))
    );
    assert_eq!(file("empty", b""), "expected an HDF5 file, found an empty file");
    assert_eq!(file("text", b"vectors 1 2 3\n"), "expected an HDF5 file, found other data");
    let bytes = std::fs::read(local_tree().save(folder.path())).unwrap();
    let cut = file("cut", &bytes[..bytes.len() - 9]);
    assert!(cut.starts_with("/: expected intact HDF5 data, found: "), "{cut}");

    let root = "/: expected one group of a problem (/fclib_local, /fclib_global, or the same of rolling friction), found ";
    let tree = global_tree().without("fclib_global").without("guesses");
    refused(&tree, &format!("{root}only /solution"));
    let both = Tree(local_tree().0.into_iter().chain(global_tree().0).collect());
    refused(&both, &format!("{root}both /fclib_local and /fclib_global"));
    let empty = Tree(Default::default()).set("x", Data::F(vec![1.0]));
    refused(&empty, &format!("{root}no group"));
}

#[test]
fn rolling_files_have_five_rows_a_contact() {
    let planar = "rolling friction in the plane is not known";
    let what = &format!("/fclib_global_rolling/spacedim: expected 5 ({planar}), found 3");
    let tree = global_tree().renamed("fclib_global", "fclib_global_rolling");
    refused(&tree, what);
    let tree = local_tree().renamed("fclib_local", "fclib_local_rolling");
    refused(&tree, "/fclib_local_rolling/spacedim: expected 5, found 2");
}

#[test]
fn missing_parts_are_named() {
    for tree in [bilateral_tree(), global_tree()] {
        for key in tree.0.keys() {
            let optional = key.ends_with("nzmax") || key.ends_with("title");
            if optional {
                read(&tree.clone().without(key));
                continue;
            }
            let expected = match &key[..] {
                "fclib_local/vectors/s" => {
                    "it beside /fclib_local/V and /fclib_local/R (bilateral constraints)"
                }
                "fclib_global/vectors/b" => "it beside /fclib_global/G (bilateral constraints)",
                _ => "a dataset",
            };
            refused(
                &tree.clone().without(key),
                &format!("/{key}: expected {expected}, found nothing of that name"),
            );
        }
    }
    let nothing = "found nothing of that name";
    for group in ["fclib_local/W", "fclib_local/vectors"] {
        let expected = format!("/{group}: expected a group, {nothing}");
        refused(&local_tree().without(group), &expected);
        refused(
            &local_tree().without(group).set(group, Data::I(vec![1])),
            &format!("/{group}: expected a group, found a dataset"),
        );
    }
    refused(
        &bilateral_tree().without("fclib_local/R"),
        &format!(
            "/fclib_local/R: expected it beside /fclib_local/V and /fclib_local/vectors/s \
             (bilateral constraints), {nothing}"
        ),
    );
    refused(
        &bilateral_tree().without("fclib_local/V").without("fclib_local/R"),
        &format!(
            "/fclib_local/V and /fclib_local/R: expected it beside /fclib_local/vectors/s \
             (bilateral constraints), {nothing}"
        ),
    );
    refused(
        &global_tree().without("fclib_global/G"),
        &format!(
            "/fclib_global/G: expected it beside /fclib_global/vectors/b (bilateral constraints), \
             {nothing}"
        ),
    );
    // Bounds of rows that are not there.
    let bounds = |tree: Tree, at: &str| {
        let bound =
            |tree: Tree, side| tree.set(&format!("{at}/vectors/{side}"), Data::F(vec![0.0]));
        bound(bound(tree, "lower"), "upper")
    };
    refused(
        &bounds(local_tree(), "fclib_local"),
        &format!(
            "/fclib_local/V and /fclib_local/R and /fclib_local/vectors/s: expected it beside \
             /fclib_local/vectors/lower and /fclib_local/vectors/upper (bilateral constraints), {nothing}"
        ),
    );
    let rowless = global_tree().without("fclib_global/G").without("fclib_global/vectors/b");
    let global = bounds(rowless, "fclib_global");
    refused(
        &global,
        &format!(
            "/fclib_global/G and /fclib_global/vectors/b: expected it beside \
             /fclib_global/vectors/lower and /fclib_global/vectors/upper (bilateral constraints), {nothing}"
        ),
    );
    refused(
        &local_tree().without("fclib_local/W/x").set("fclib_local/W/x/", Data::Scalar(0)),
        "/fclib_local/W/x: expected a dataset, found a group",
    );
}

#[test]
fn wrong_types_are_named() {
    let with = |path: &str, data| local_tree().set(&format!("fclib_local/{path}"), data);
    refused(&with("W/i", Data::Text("0")), "/fclib_local/W/i: expected integers, found a text");
    refused(
        &with("vectors/q", Data::Text("0")),
        "/fclib_local/vectors/q: expected reals, found a text",
    );
    refused(
        &with("spacedim", Data::Text("2")),
        "/fclib_local/spacedim: expected integers, found a text",
    );
    refused(
        &with("spacedim", Data::I(vec![2, 2])),
        "/fclib_local/spacedim: expected one integer, found 2 entries",
    );
    refused(
        &with("info/title", Data::F(vec![0.0])),
        "/fclib_local/info/title: expected a text, found reals",
    );
}

#[test]
fn wrong_shapes_are_named() {
    let with = |path: &str, data| local_tree().set(&format!("fclib_local/{path}"), data);
    for d in [5, 1, 0, -3] {
        let expected = format!("/fclib_local/spacedim: expected 2 or 3, found {d}");
        refused(&with("spacedim", Data::I(vec![d])), &expected);
    }
    // Four rows are no multiple of three; and the two friction coefficients want six.
    refused(
        &with("spacedim", Data::I(vec![3])),
        "/fclib_local/W: expected 6 × 6 (3 for each entry of vectors/mu), found 4 × 4",
    );
    refused(
        &with("W/n", Data::I(vec![i32::MAX])),
        "/fclib_local/W: expected 4 × 4 (2 for each entry of vectors/mu), found 4 × 2147483647",
    );
    refused(
        &local_tree().matrix("fclib_local/W", (0, 0, 0), (&[], &[], &[])),
        "/fclib_local/W: expected 4 × 4 (2 for each entry of vectors/mu), found 0 × 0",
    );
    refused(
        &with("vectors/mu", Data::F(vec![])),
        "/fclib_local/vectors/mu: expected at least one contact, found none",
    );
    refused(
        &with("vectors/q", Data::F(vec![0.0; 3])),
        "/fclib_local/vectors/q: expected 4 entries (2 for each entry of vectors/mu), found 3 entries",
    );
    refused(
        &global_tree().set("fclib_global/vectors/f", Data::F(vec![])),
        "/fclib_global/vectors/f: expected 2 entries (the rows of M and H), found 0 entries",
    );
    refused(
        &with("W/x", Data::F(vec![1.0; 9])),
        "/fclib_local/W/x: expected 10 entries (nz), found 9 entries",
    );
    refused(
        &with("W/nz", Data::I(vec![-3])),
        "/fclib_local/W/nz: expected a number of triplets, -1 (columns) or -2 (rows), found -3",
    );
    refused(
        &with("W/nz", Data::I(vec![-1])),
        "/fclib_local/W/p: expected 5 pointers (one more than columns or rows), found 10 entries",
    );
    refused(
        &global_tree().set("solution/u", Data::F(vec![0.0; 4])),
        "/solution/u: expected 3 entries (components of the contacts), found 4 entries",
    );
    refused(
        &global_tree().set("guesses/number_of_guesses", Data::I(vec![3])),
        "/guesses/2: expected a group, found nothing of that name",
    );
    refused(
        &global_tree().set("guesses/number_of_guesses", Data::I(vec![-1])),
        "/guesses/number_of_guesses: expected a number of at least 0, found -1",
    );
}

#[test]
fn wrong_indices_are_named() {
    let with = |path: &str, data| local_tree().set(&format!("fclib_local/{path}"), data);
    let p = |k: usize, x: i32| {
        let mut p = vec![0, 0, 0, 1, 1, 2, 2, 2, 3, 3];
        p[k] = x;
        Data::I(p)
    };
    refused(
        &with("W/p", p(3, 4)),
        "/fclib_local/W/p[3]: expected a column index of at least 0 and below 4, found 4",
    );
    refused(
        &with("W/i", p(9, -1)),
        "/fclib_local/W/i[9]: expected a row index of at least 0 and below 4, found -1",
    );
    let columns =
        |p: &[i32]| local_tree().matrix("fclib_local/W", (4, 4, -1), (p, &[0; 3], &[1.0; 3]));
    refused(&columns(&[0, 2, 1, 3, 3]), "/fclib_local/W/p[2]: expected at least 2 (p[1]), found 1");
    refused(&columns(&[1, 2, 2, 3, 3]), "/fclib_local/W/p[0]: expected 0, found 1");
    refused(
        &columns(&[0, 2, 2, 3, i32::MAX]),
        "/fclib_local/W/i: expected 2147483647 entries (p[4]), found 3 entries",
    );
    refused(
        &local_tree().matrix("fclib_local/W", (4, 4, -2), (&[0, 1, 1, 1, 1], &[4], &[1.0])),
        "/fclib_local/W/i[0]: expected a column index of at least 0 and below 4, found 4",
    );
}

#[test]
fn wrong_values_are_named() {
    let with = |path: &str, data| local_tree().set(&format!("fclib_local/{path}"), data);
    let mut x = vec![1.0; 10];
    x[7] = f64::INFINITY;
    refused(&with("W/x", Data::F(x)), "/fclib_local/W/x[7]: expected a finite number, found inf");
    refused(
        &with("vectors/q", Data::F(vec![0.0, f64::NAN, 0.0, 0.0])),
        "/fclib_local/vectors/q[1]: expected a finite number, found NaN",
    );
    refused(
        &with("vectors/mu", Data::F(vec![0.5, -0.25])),
        "/fclib_local/vectors/mu[1]: expected a coefficient of friction of at least 0, found -0.25",
    );
    // Finite entries whose sum is not.
    refused(
        &local_tree().matrix("fclib_local/W", (4, 4, 2), (&[3; 2], &[2; 2], &[1.5e308; 2])),
        "/fclib_local/W[2, 3]: expected a finite number, found inf",
    );
    let mut r = vec![0.0; 3];
    r[2] = f64::NAN;
    let tree = global_tree().set("solution/r", Data::F(r.clone()));
    refused(&tree, "/solution/r[2]: expected a finite number, found NaN");
    refused(
        &global_tree().set("guesses/1/r", Data::F(r)),
        "/guesses/1/r[2]: expected a finite number, found NaN",
    );
    // The problem of such a file is still to be had.
    let folder = tempfile::tempdir().unwrap();
    assert!(fclib::read_problem(tree.save(folder.path())).is_ok());
}

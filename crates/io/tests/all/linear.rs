//! Files of complementarity problems: round trips, formats, the mistakes, and damage.
#![allow(non_snake_case)]

use std::path::{Path, PathBuf};

use crate::common::real;
use nonsmooth_io::table::Table;
use nonsmooth_io::{About, FORMATS, Format, Info, ProblemFile, StoredPoint, holds_problem, parts};
use nonsmooth_linalg::{Csc, Dense, Matrix};
use nonsmooth_problem::field::{Evaluator, Expressions, Field, Pattern};
use nonsmooth_problem::{
    AnyPoint, AnyProblem, BoxLcp, Complementarity, Friction, Hlcp, HlcpPoint, Lcp, LcpPoint, Mcp,
    Mlcp, Set, Vi,
};
use proptest::collection::{btree_map, vec};
use proptest::option;
use proptest::prelude::*;
use tempfile::TempDir;

struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn put(&self, name: &str, text: &str) -> PathBuf {
        std::fs::write(self.path(name), text).unwrap();
        self.path(name)
    }

    /// What a file of this content is.
    fn read(&self, name: &str, text: &str) -> Complementarity {
        linear(ProblemFile::read(self.put(name, text)).unwrap_or_else(|e| panic!("{e}")))
    }

    /// The message that refuses this content: one line that names the file and `all`.
    fn refused(&self, name: &str, text: &str, all: &[&str]) {
        let path = self.put(name, text);
        let message = ProblemFile::read(&path).expect_err(text).to_string();
        assert!(
            message.starts_with(path.to_str().unwrap()) && !message.contains('\n'),
            "{message}"
        );
        for part in all {
            assert!(message.contains(part), "{part} in {message}");
        }
    }
}

/// The problem of a file.
fn linear(file: ProblemFile) -> Complementarity {
    match file.problem {
        AnyProblem::Complementarity(problem) => problem,
        AnyProblem::Friction(_) => panic!("contacts"),
    }
}

/// The dense matrix with these rows.
fn rows<const N: usize>(rows: &[[f64; N]]) -> Dense {
    Dense::from_rows(rows).unwrap()
}

fn dense(p: &Complementarity) -> Dense {
    match p {
        Complementarity::Lcp(p) => p.M.to_dense(),
        Complementarity::Mlcp(p) => p.M.to_dense(),
        Complementarity::Box(p) => p.M.to_dense(),
        Complementarity::Hlcp(p) => p.Q.to_dense(),
        Complementarity::Mcp(p) => p.affine().and_then(|(linear, _)| linear.M.to_dense()),
        Complementarity::Vi(_) => None,
    }
    .unwrap()
}

/// Of a file that somebody wrote, only the solution changes.
#[test]
fn a_solution_leaves_the_text_of_a_file_as_it_is() {
    let folder = Folder::new();
    let before =
        "# two diodes\nkind = \"lcp\" # of circuits\nM = [\n  [2.0, 1e0], # first\n  [1, 2],\n]\n";
    let (q, after) = ("q = [-5, -6.50]\n", "# the end\n");
    let solution = |z: f64| StoredPoint::from(LcpPoint { z: vec![z, 0.1 + 0.2] });
    let write = |path: &Path, z: f64| {
        let mut file = ProblemFile::read(path).unwrap();
        file.solution = Some(solution(z));
        file.write_solution(path).unwrap();
        let again = ProblemFile::read(path).unwrap();
        assert_eq!(again.solution.unwrap().point, solution(z).point);
        assert_eq!(again.problem, file.problem);
        std::fs::read_to_string(path).unwrap()
    };
    for old in ["", "\n[solution]\nz = [ # a guess\n  0.5,\n  0.25,\n]\nw = [0, 0]\n"] {
        let path = folder.put("a.toml", &format!("{before}{q}{after}{old}"));
        let once = write(&path, 1.0);
        assert!(once.starts_with(&format!("{before}{q}{after}")), "{once}");
        assert_eq!(once.matches("[solution]").count(), 1, "{once}");
        let twice = write(&path, 2.0);
        assert_eq!(twice, once.replace("z = [1.0,", "z = [2.0,"));
    }
    // Before other tables, of dotted keys, in one line.
    let vi = "kind = \"vi\"\nF = [\"x1 - 2\"]\n[solution]\nx = [0.5]\n[set] # of x\nbox = { lower = [0], upper = [1] }\n";
    let path = folder.put("b.toml", vi);
    let mut file = ProblemFile::read(&path).unwrap();
    let Some(StoredPoint { point, .. }) = file.solution.clone() else { panic!() };
    file.solution = Some(StoredPoint::from(point));
    file.write_solution(&path).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(
        text.contains("[set] # of x\nbox = { lower = [0], upper = [1] }\n\n[solution]"),
        "{text}"
    );
    let inline = format!("solution = {{ z = [0, 0] }}\n{before}{q}");
    assert!(write(&folder.put("c.toml", &inline), 1.0).starts_with(before));
    let dotted = format!("{before}solution.z = [0, 0]\n{q}");
    assert!(write(&folder.put("d.toml", &dotted), 1.0).starts_with(&format!("{before}{q}")));
}

/// A pipe without a name that tells its format is read once.
#[cfg(unix)]
#[test]
fn a_pipe_is_read_once() {
    let folder = Folder::new();
    let path = folder.path("pipe");
    let made = std::process::Command::new("mkfifo").arg(&path).status();
    assert!(made.unwrap().success());
    let text = "kind = \"lcp\"\nM = [[2]]\nq = [-1]\n";
    let writer = {
        let path = path.clone();
        std::thread::spawn(move || std::fs::write(path, text).unwrap())
    };
    let Complementarity::Lcp(p) = linear(ProblemFile::read(&path).unwrap()) else { panic!() };
    writer.join().unwrap();
    assert_eq!(p.q, [-1.0]);
}

// ------------------------------------------------------------------------------------------------ round trips

fn matrix(rows: usize, columns: usize) -> BoxedStrategy<Matrix> {
    let most = if rows * columns == 0 { 0 } else { 12 };
    let entries = btree_map((0..rows.max(1), 0..columns.max(1)), real(), 0..=most);
    let sparse = entries.prop_map(move |all| {
        let all = all.iter().map(|(&(i, j), &x)| (i, j, x));
        Csc::from_triplets(rows, columns, all).unwrap().into()
    });
    let dense = vec(real(), rows * columns)
        .prop_map(move |x| Dense::from_fn(rows, columns, |i, j| x[i * columns + j]).into());
    prop_oneof![sparse, dense].boxed()
}

fn problem() -> impl Strategy<Value = Complementarity> {
    let reals = |n: usize| vec(real(), n);
    let lcp = (1..5usize).prop_flat_map(move |n| (matrix(n, n), reals(n)));
    let lcp = lcp.prop_map(|(m, q)| Complementarity::Lcp(Lcp::new(m, q).unwrap()));
    let mixed = (0..3usize, 0..4usize, 1..4usize)
        .prop_flat_map(move |(p, n, m)| (matrix(p + m, n + m), reals(p + m), Just((p, n))));
    let mixed = mixed
        .prop_map(|(m, q, (p, n))| Complementarity::Mlcp(Mlcp::rectangular(m, q, p, n).unwrap()));
    let horizontal = (1..4usize).prop_flat_map(move |n| (matrix(n, n), matrix(n, n), reals(n)));
    let horizontal =
        horizontal.prop_map(|(a, b, q)| Complementarity::Hlcp(Hlcp::new(a, b, q).unwrap()));
    let bound = || {
        (option::of(real()), option::of(real())).prop_map(|(a, b)| {
            let (a, b) = (a.unwrap_or(f64::NEG_INFINITY), b.unwrap_or(f64::INFINITY));
            (a.min(b), a.max(b))
        })
    };
    let boxed = (1..4usize).prop_flat_map(move |n| (matrix(n, n), reals(n), vec(bound(), n)));
    let boxed = boxed.prop_map(|(m, q, bounds)| {
        let (l, u) = bounds.into_iter().unzip();
        Complementarity::Box(BoxLcp::new(m, q, l, u).unwrap())
    });
    let row = prop_oneof![
        Just("2*x1 - exp(-x1)"),
        Just("x1^3 + 0.1*x1"),
        Just("-1.5"),
        Just("max(x1, -x1^2)/(1 + x1^2)"),
        Just("if(x1 >= 1, log(x1), 0)"),
    ];
    let expressions = |rows: Vec<&str>| {
        let texts: Vec<_> = rows.iter().map(ToString::to_string).collect();
        Expressions::parse(&texts, &[]).unwrap()
    };
    let of_sets = row.clone();
    let inequality = set().prop_flat_map(move |set| {
        let n = set.dim();
        (vec(of_sets.clone(), n), reals(n), Just(set))
    });
    let inequality = inequality.prop_map(move |(rows, start, set)| {
        Complementarity::Vi(Vi::new(expressions(rows), set, start).unwrap())
    });
    let nonlinear =
        (1..4usize).prop_flat_map(move |n| (vec(row.clone(), n), reals(n), vec(bound(), n)));
    let nonlinear = nonlinear.prop_map(move |(rows, start, bounds)| {
        let (l, u) = bounds.into_iter().unzip();
        Complementarity::Mcp(Mcp::new(expressions(rows), l, u, start).unwrap())
    });
    prop_oneof![lcp, mixed, horizontal, boxed, nonlinear, inequality]
}

/// A set, or a product of a few.
fn set() -> impl Strategy<Value = Set> {
    let sparse = |m: Matrix| match m {
        Matrix::Sparse(m) => m,
        m => {
            let mut entries: Vec<(usize, usize, f64)> = vec![];
            m.for_each(|i, j, x| entries.push((i, j, x)));
            Csc::from_triplets(m.nrows(), m.ncols(), entries.into_iter()).unwrap()
        }
    };
    let bounds = (1..4usize).prop_flat_map(|n| (vec(real(), n), vec(option::of(real()), n)));
    let bounds = bounds.prop_map(|(lower, above)| {
        let upper = lower.iter().zip(above).map(|(l, u)| u.map_or(f64::INFINITY, |u| u.max(*l)));
        Set::Box { upper: upper.collect(), lower }
    });
    let polyhedron = (0..3usize, 0..3usize, 1..4usize)
        .prop_flat_map(|(m, k, n)| (matrix(m, n), vec(real(), m), matrix(k, n), vec(real(), k)));
    let polyhedron = polyhedron.prop_map(move |(a, b, c, d)| Set::Polyhedron {
        A: sparse(a),
        b,
        C: sparse(c),
        d,
    });
    let ball = ((1..4usize).prop_flat_map(|n| vec(real(), n)), real());
    let ball = ball.prop_map(|(centre, r)| Set::Ball { centre, radius: r.abs() });
    let cone = (1..4usize).prop_map(|dimension| Set::SecondOrderCone { dimension });
    let one = prop_oneof![bounds, polyhedron, ball, cone].boxed();
    prop_oneof![one.clone(), vec(one, 1..4).prop_map(Set::Product)]
}

/// The lengths of z and w.
fn sizes(p: &Complementarity) -> (usize, usize) {
    match p {
        Complementarity::Lcp(p) => (p.dim(), p.dim()),
        Complementarity::Mlcp(p) => (p.M.ncols(), p.pairs()),
        Complementarity::Hlcp(p) => (p.dim(), p.dim()),
        Complementarity::Box(p) => (p.dim(), p.dim()),
        Complementarity::Mcp(p) => (p.dim(), p.dim()),
        Complementarity::Vi(p) => (p.dim(), p.dim()),
    }
}

fn content() -> impl Strategy<Value = ProblemFile> {
    let point = |problem: Complementarity| {
        let (n, m) = sizes(&problem);
        let horizontal = matches!(problem, Complementarity::Hlcp(_));
        let solution =
            (any::<bool>(), vec(real(), n), vec(real(), m)).prop_map(move |(there, z, w)| {
                match horizontal {
                    true => HlcpPoint { x: z, s: w }.into(),
                    false => {
                        let point = AnyPoint::from(LcpPoint { z });
                        StoredPoint { point, partner: there.then_some(w), statuses: vec![] }
                    }
                }
            });
        (Just(problem), option::of(solution))
    };
    let texts = (option::of(any::<String>()), option::of(any::<String>()));
    (problem().prop_flat_map(point), texts).prop_map(
        |((problem, solution), (title, description))| ProblemFile {
            info: Info { title, description, ..Info::default() },
            solution,
            ..ProblemFile::new(problem)
        },
    )
}

/// Equal bit for bit: `0 == -0`, but they are two numbers.
fn same(a: &ProblemFile, b: &ProblemFile) {
    assert_eq!(a, b);
    assert_eq!(format!("{a:?}"), format!("{b:?}"));
}

proptest! {
    #[test]
    fn our_format_keeps_every_bit(content in content()) {
        let folder = Folder::new();
        let path = folder.path("a.toml");
        content.write(&path).unwrap();
        same(&ProblemFile::read(&path).unwrap(), &content);
        prop_assert!(holds_problem(&path));
    }

    #[test]
    fn matrix_market_keeps_every_bit(content in content()) {
        let folder = Folder::new();
        let path = folder.path("a.mtx");
        let content = ProblemFile { info: Info::default(), ..content };
        let problem = linear(content.clone());
        let fits = matches!(problem, Complementarity::Lcp(_) | Complementarity::Box(_));
        let written = content.write(&path);
        prop_assert_eq!(written.is_ok(), fits, "{:?}", written);
        if fits {
            let solution = content.solution.clone().map(|s| StoredPoint { partner: None, ..s });
            same(&ProblemFile::read(&path).unwrap(), &ProblemFile { solution, ..content });
            prop_assert!(holds_problem(&path) && !holds_problem(&folder.path("a_q.mtx")));
            prop_assert!(parts(&path).len() >= 2);
        }
    }

    /// Whatever a file holds, it is read or refused.
    #[test]
    fn garbage_is_refused_without_a_panic(bytes in vec(any::<u8>(), 0..200), words in "([ 0-9.e\\-:\n]|col|triplet){0,60}") {
        let folder = Folder::new();
        for name in ["a.toml", "a.mtx", "a.dat", "a", "a.hdf5"] {
            let path = folder.path(name);
            for content in [&bytes[..], words.as_bytes()] {
                std::fs::write(&path, content).unwrap();
                holds_problem(&path);
                if let Err(e) = ProblemFile::read(&path) {
                    let message = e.to_string();
                    assert!(!message.contains('\n') && message.starts_with(path.to_str().unwrap()), "{message}");
                }
            }
        }
    }
}

/// The table in docs/formats.md is the list of formats.
#[test]
fn the_page_of_formats_lists_them() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/formats.md");
    let page = std::fs::read_to_string(page).unwrap();
    let (_, table) = page.split_once("| --- | --- | --- | --- |\n").unwrap();
    let stated: Vec<_> = table.lines().take_while(|line| line.starts_with('|')).collect();
    let code = |all: &mut dyn Iterator<Item = &str>| {
        all.map(|one| format!("`{one}`")).collect::<Vec<_>>().join(", ")
    };
    let row = |format: &dyn Format| {
        let About { name, extensions, reads, writes, .. } = *format.about();
        let endings: Vec<_> = extensions.iter().map(|e| format!(".{e}")).collect();
        let endings = code(&mut endings.iter().map(String::as_str));
        let kinds = match reads {
            [] => "none".into(),
            _ => code(&mut reads.iter().map(|kind| kind.name())),
        };
        let written = match writes {
            [] => "none".into(),
            _ if writes == reads => "the same".into(),
            _ => code(&mut writes.iter().map(|kind| kind.name())),
        };
        format!("| {name} | {endings} | {kinds} | {written} |")
    };
    assert_eq!(stated, FORMATS.map(row));
}

// ------------------------------------------------------------------------------------------------ our format

#[test]
fn our_format_as_people_write_it() {
    let folder = Folder::new();
    let text = "\
kind = 'lcp'
title = \"two rows\"
q = [-5, -6.0]
M = [[2, 1], [1, 2]]
[solution]
z = [1.25, 2]
";
    let file = ProblemFile::read(folder.put("a.toml", text)).unwrap();
    let lcp = Lcp::new(rows(&[[2.0, 1.0], [1.0, 2.0]]), vec![-5.0, -6.0]).unwrap();
    assert_eq!(file.problem, lcp.clone().into());
    assert_eq!(file.info.title.as_deref(), Some("two rows"));
    assert_eq!(file.solution, Some(LcpPoint { z: vec![1.25, 2.0] }.into()));

    let sparse = "kind = 'lcp'\nq = [-5, -6]\n[M]\nshape = [2, 2]\nentries = [[0, 0, 2], [0, 1, 1.0], [1, 0, 1], [1, 1, 2]]\n";
    let Complementarity::Lcp(read) = folder.read("b.toml", sparse) else { panic!() };
    assert!(matches!(read.M, Matrix::Sparse(_)));
    assert_eq!(read.M.to_dense(), lcp.M.to_dense());

    // By blocks, what is not stated being zero; and as one matrix.
    let blocks = "kind = 'mlcp'\nA = [[1, 2]]\nD = [[3, 4]]\na = [5]\nb = [6]\n";
    let Complementarity::Mlcp(by_blocks) = folder.read("c.toml", blocks) else { panic!() };
    assert_eq!(by_blocks.M, rows(&[[1.0, 2.0, 0.0], [3.0, 4.0, 0.0]]).into());
    assert_eq!((by_blocks.equalities, by_blocks.free, by_blocks.q.len()), (1, 2, 2));
    let whole = "kind = 'mlcp'\nM = [[1, 2, 0], [3, 4, 0]]\nq = [5, 6]\nfree = 2\nequalities = 1\n";
    assert_eq!(folder.read("d.toml", whole), Complementarity::Mlcp(by_blocks));

    let boxed = "kind = 'box_lcp'\nM = [[1]]\nq = [2]\nlower = [-inf]\nupper = [3]\n";
    let Complementarity::Box(boxed) = folder.read("e.toml", boxed) else { panic!() };
    assert_eq!((boxed.lower[0], boxed.upper[0]), (f64::NEG_INFINITY, 3.0));
}

#[test]
fn variational_inequalities_as_people_write_them() {
    let folder = Folder::new();
    let inf = f64::INFINITY;
    let set = |names: &str, n: usize, set: &str| {
        let f = vec!["'1'"; n].join(", ");
        let text = format!("kind = 'vi'\n{names}\nF = [{f}]\n{set}\n");
        let Complementarity::Vi(problem) = folder.read("a.toml", &text) else { panic!() };
        assert_eq!(problem.start, vec![0.0; n]);
        problem.set
    };
    let ball = |centre: &[f64], radius| Set::Ball { centre: centre.to_vec(), radius };
    let cone = |dimension| Set::SecondOrderCone { dimension };
    let free = |n| Set::Box { lower: vec![-inf; n], upper: vec![inf; n] };
    assert_eq!(
        set("", 2, "set = { ball = { centre = [0, 1], radius = 2 } }"),
        ball(&[0.0, 1.0], 2.0)
    );
    assert_eq!(set("", 2, "[set.ball]\nradius = 2"), ball(&[0.0, 0.0], 2.0));
    assert_eq!(set("", 3, "set = { second_order_cone = {} }"), cone(3));
    assert_eq!(set("", 2, "set = { box = {} }"), Set::orthant(2));
    let bounds = Set::Box { lower: vec![-inf, 1.0], upper: vec![inf, 2.0] };
    assert_eq!(set("", 2, "set.box = { lower = [-inf, 1], upper = [inf, 2] }"), bounds);
    // Bounds are rows behind those that are stated.
    let Set::Polyhedron { A, b, C, d } = set(
        "",
        2,
        "set.polyhedron = { A = [[1, 2]], b = [3], C = { shape = [1, 2], entries = [[0, 1, 5]] }, d = [6], lower = [0, -inf], upper = [inf, 7] }",
    ) else {
        panic!()
    };
    let all: Vec<_> = A.triplets().collect();
    assert_eq!(all, [(0, 0, 1.0), (1, 0, -1.0), (0, 1, 2.0), (2, 1, 1.0)]);
    assert_eq!((b, C.triplets().collect(), d), (vec![3.0, 0.0, 7.0], vec![(0, 1, 5.0)], vec![6.0]));
    // One after the other; by their variables, the others free.
    let two = "set = [{ ball = { radius = 1, centre = [0, 0] } }, { second_order_cone = {} }]";
    assert_eq!(set("", 5, two), Set::Product(vec![ball(&[0.0; 2], 1.0), cone(3)]));
    let placed = "[[set]]\nfrom = 'd'\nto = 'e'\nsecond_order_cone = {}\n[[set]]\nto = 'b'\nball = { radius = 1, centre = [0] }\n";
    let names = "names = ['a', 'b', 'c', 'd', 'e', 'f']";
    let product = Set::Product(vec![free(1), ball(&[0.0], 1.0), free(1), cone(2), free(1)]);
    assert_eq!(set(names, 6, placed), product);
    assert_eq!(
        set("", 3, "set = { from = 'x2', ball = { radius = 1 } }"),
        Set::Product(vec![free(1), ball(&[0.0; 2], 1.0)])
    );

    for (rest, said) in [
        ("", "set: expected this key, as the kind is \"vi\", found none"),
        (
            "set = 3",
            "line 3: expected a problem as docs/formats.md describes it, found invalid type: integer `3`, expected a set: a table with box, polyhedron, ball or second_order_cone, or an array of such",
        ),
        (
            "set = {}",
            "set: expected one of box, polyhedron, ball, second_order_cone; several sets are an array, found none",
        ),
        (
            "set = { box = {}, ball = { radius = 1 } }",
            "set: expected one of box, polyhedron, ball, second_order_cone; several sets are an array, found box and ball",
        ),
        ("set = { bowl = {} }", "unknown field `bowl`"),
        ("set = { ball = { radius = -1 } }", "set.ball.radius: expected a number ≥ 0, found -1"),
        ("set = { ball = {} }", "missing field `radius`"),
        (
            "set = { ball = { centre = [0, nan], radius = 1 } }",
            "set.ball.centre[1]: expected a finite number, found NaN",
        ),
        (
            "set = { ball = { centre = [0, 0, 0], radius = 1 } }",
            "set.ball: expected 1 to 2 of the 2 variables, found 3",
        ),
        (
            "set = { ball = { centre = [0], radius = 1 } }",
            "set: expected a set of all 2 variables, found 1",
        ),
        (
            "set = { box = { lower = [0, 0], upper = [1] } }",
            "set.box.u: expected 2 entries (variables), found 1 entries",
        ),
        (
            "set = { box = { lower = [0, 3], upper = [1, 2] } }",
            "set.box.[l, u][1]: expected l ≤ u, l < ∞, u > −∞, found [3, 2]",
        ),
        (
            "set = { second_order_cone = { dimension = 0 } }",
            "set.second_order_cone: expected 1 to 2 of the 2 variables, found 0",
        ),
        (
            "set = { second_order_cone = { dimension = 999999999999 } }",
            "set.second_order_cone: expected 1 to 2 of the 2 variables, found 999999999999",
        ),
        (
            "set = [{ second_order_cone = {} }, { box = {} }]",
            "set[1].box: expected some of the 2 variables to be left for it, found 0",
        ),
        ("set = { from = 'x3', box = {} }", "set.from: expected a variable (x1, x2), found `x3`"),
        (
            "set = { from = 'x2', to = 'x1', box = {} }",
            "set.to: expected `x2` or one behind it, found `x1`",
        ),
        (
            "set = [{ from = 'x1', to = 'x2', box = {} }, { from = 'x2', second_order_cone = {} }]",
            "set[1]: expected variables of no other part, found x2",
        ),
        (
            "set = { polyhedron = { A = [[1, 1]] } }",
            "set.polyhedron.b: expected 1 entries (rows of A), found 0",
        ),
        (
            "set = { polyhedron = { A = [[1, 1], [1]], b = [1, 1] } }",
            "set.polyhedron.A[1]: expected 2 entries, as in A[0], found 1",
        ),
        ("set = { polyhedron = { A = [[1, inf]], b = [1] } }", "set.polyhedron.A"),
        ("set = { polyhedron = { A = [[1, 1]], b = [1], C = [[1]], d = [1] } }", "set.polyhedron"),
        (
            "set = { polyhedron = { A = [[1, 1]], b = [1], lower = [inf, 0] } }",
            "set.polyhedron.lower[0]: expected a number or -inf, found inf",
        ),
        (
            "set = { polyhedron = { A = [[1, 1]], b = [1], upper = [1] } }",
            "set.polyhedron.upper: expected 2 entries, found 1",
        ),
        (
            "set = { box = {} }\nlower = [0, 0]",
            "lower: expected the keys of kind \"vi\": F, set, start, found this one",
        ),
    ] {
        folder.refused("d.toml", &format!("kind = 'vi'\nF = ['x1', 'x2']\n{rest}\n"), &[said]);
    }
}

#[test]
fn nonlinear_problems_as_people_write_them() {
    let folder = Folder::new();
    let text = "\
kind = 'mcp'
names = ['q[1]', 'p']
F = ['2 + q[1] - p', 'q[1] - 10/p^1.1']
lower = [0, -inf]
start = [1, 2]
[solution]
x = [1.5, 3.5]
F = [0.0, 1]
";
    let file = ProblemFile::read(folder.put("a.toml", text)).unwrap();
    let stored = file.solution.as_ref().unwrap();
    assert_eq!(stored.point, LcpPoint { z: vec![1.5, 3.5] }.into());
    assert_eq!(stored.partner, Some(vec![0.0, 1.0]));
    let written = folder.path("b.toml");
    file.write(&written).unwrap();
    let again = ProblemFile::read(&written).unwrap();
    assert_eq!(again, file);
    let said = std::fs::read_to_string(&written).unwrap();
    assert!(said.contains("F = [\n  \"2 + q[1] - p\",\n  \"q[1] - 10/p^1.1\",\n]\n"), "{said}");
    let table = Table::new(&file.problem, stored, &file.info.names).unwrap();
    assert_eq!(table.csv(), "variable,name,x,F\n0,q[1],1.5,0.0\n1,p,3.5,1.0\n");
    let Complementarity::Mcp(problem) = linear(file) else { panic!() };
    assert_eq!(problem.lower, [0.0, f64::NEG_INFINITY]);
    assert_eq!(problem.upper, [f64::INFINITY; 2]);
    assert_eq!(problem.start, [1.0, 2.0]);

    let Complementarity::Mcp(plain) = folder.read("c.toml", "kind = 'mcp'\nF = ['x1^2 - 2']\n")
    else {
        panic!()
    };
    assert_eq!((plain.lower[0], plain.upper[0], plain.start[0]), (0.0, f64::INFINITY, 0.0));
    for (rest, said) in [
        (
            "F = ['x1 +']",
            "F[0], column 5: expected a number, a name, a function or `(`, found the end",
        ),
        ("F = ['1', 'y']", "F[1], column 1: expected a variable (x1, x2), found `y`"),
        ("F = []", "F: expected 1 expressions (variables, at least one), found 0"),
        (
            "F = [1]",
            "line 2: expected a problem as docs/formats.md describes it, found invalid type: integer `1`, expected a string",
        ),
        (
            "names = ['a', 'a']\nF = ['1', '1']",
            "names[1]: expected a name of its own, found `a`, as names[0]",
        ),
        (
            "names = ['a']\nF = ['1', '1']",
            "F: expected 1 expressions, as there are as many names, found 2",
        ),
        ("F = ['x1']\nlower = [1, 2]", "l: expected 1 entries (rows of F), found 2 entries"),
        ("F = ['x1']\nstart = [nan]", "start[0]: expected a finite number, found NaN"),
        (
            "F = ['x1']\nM = [[1]]",
            "M: expected the keys of kind \"mcp\": F, lower, upper, start, found this one",
        ),
        ("lower = [0]", "F: expected this key, as the kind is \"mcp\", found none"),
        (
            "F = ['x1']\n[solution]\nx = [1]\nF = [nan]",
            "solution.F[0]: expected a finite number, found NaN",
        ),
        (
            "F = ['x1']\n[solution]\nz = [1]",
            "solution.z: expected the keys of kind \"mcp\": x, F, found this one",
        ),
    ] {
        folder.refused("d.toml", &format!("kind = 'mcp'\n{rest}\n"), &[&format!(": {said}")]);
    }
    let values = Mcp::ncp(Values(Pattern::new(std::iter::once(std::iter::once(0)))), vec![0.0]);
    let message = ProblemFile::new(values.unwrap()).write(folder.path("e.toml")).unwrap_err();
    let said = "F: expected expressions, found a function that is known by its values only";
    assert!(message.to_string().ends_with(said), "{message}");
}

/// `F(x) = x` without expressions.
#[derive(Debug)]
struct Values(Pattern);

impl Field for Values {
    fn dim(&self) -> usize {
        1
    }
    fn pattern(&self) -> &Pattern {
        &self.0
    }
    fn evaluator(&self) -> Box<dyn Evaluator> {
        struct Same;
        impl Evaluator for Same {
            fn value(&mut self, x: &[f64], f: &mut [f64]) -> bool {
                f.copy_from_slice(x);
                true
            }
            fn jacobian(&mut self, x: &[f64], f: &mut [f64], jacobian: &mut [f64]) -> bool {
                jacobian.fill(1.0);
                self.value(x, f)
            }
        }
        Box::new(Same)
    }
    fn source(&self) -> String {
        "closures".into()
    }
}

#[test]
fn mistakes_in_our_format_are_named() {
    let folder = Folder::new();
    let lcp = "kind = 'lcp'\nq = [1, 2]\nM = [[1, 0], [0, 1]]\n";
    folder.read("a.toml", lcp);
    let cases: [(&str, &[&str]); 14] = [
        ("", &["line 1", "kind"]),
        ("kind = 'lcp'\nq = [1\n", &["line 2"]),
        ("kind = 'lcq'\n", &["kind: expected one of \"lcp\"", "found \"lcq\""]),
        ("kind = 'lcp'\nq = [1]\n", &["M: expected this key", "found none"]),
        ("kind = 'lcp'\nq = [1, 'x']\nM = [[1, 0], [0, 1]]\n", &["line 2", "f64"]),
        (
            "kind = 'lcp'\nq = [1, nan]\nM = [[1, 0], [0, 1]]\n",
            &["q[1]: expected a finite number, found NaN"],
        ),
        ("kind = 'lcp'\nq = [1]\nM = [[1, 0], [0, 1]]\n", &["q: expected 2 entries", "found 1"]),
        (
            "kind = 'lcp'\nq = [1, 2]\nM = [[1, 0], [0]]\n",
            &["M[1]: expected 2 entries, as in M[0], found 1"],
        ),
        ("kind = 'lcp'\nq = [1, 2]\nM = 3\n", &["line 3", "array of rows"]),
        (
            "kind = 'lcp'\nq = [1]\n[M]\nshape = [1, 1]\nentries = [[0, 1, 2]]\n",
            &["M.entries[0]", "counted from 0", "0 and 1"],
        ),
        (
            "kind = 'lcp'\nq = [1]\n[M]\nshape = [1, 99999999999]\nentries = []\n",
            &["M.shape", "99999999999"],
        ),
        ("kind = 'lcp'\nq = [1]\nM = [[1]]\nfree = 1\n", &["free", "kind \"lcp\"", "M, q"]),
        ("kind = 'mlcp'\nA = [[1]]\na = [1]\nb = []\nfree = 1\n", &["A: expected either", "free"]),
        ("kind = 'lcp'\nq = [1]\nM = [[1]]\ncolour = 3\n", &["line 4", "colour"]),
    ];
    for (text, all) in cases {
        folder.refused("a.toml", text, all);
    }
    for (text, all) in [
        ("[solution]\nz = [1]\n", ["z: expected 2 entries", "found 1"]),
        ("[solution]\nz = [1, 2]\nw = [1]\n", ["solution.w", "2 entries"]),
        ("[solution]\nu = [1, 2]\n", ["solution.u", "z, w"]),
        ("[solution]\nw = [1, 2]\n", ["solution.z", "none"]),
    ] {
        folder.refused("a.toml", &format!("{lcp}{text}"), &all);
    }
    let operator = Matrix::Operator(std::sync::Arc::new(Identity));
    let operator = ProblemFile::new(Lcp::new(operator, vec![0.0]).unwrap());
    for name in ["o.toml", "o.mtx"] {
        let message = operator.write(folder.path(name)).unwrap_err().to_string();
        assert!(message.contains("found an operator"), "{message}");
        assert!(!folder.path(name).exists());
    }
    let message = operator.write(folder.path("o.txt")).unwrap_err().to_string();
    let expected = "o.txt: expected a file name that ends in .toml, .mtx or .csv for a problem lcp";
    assert!(message.ends_with(expected), "{message}");
    let guesses = vec![LcpPoint { z: vec![0.0] }.into()];
    let message = ProblemFile { guesses, ..operator }.write(folder.path("o.toml"));
    assert!(message.unwrap_err().to_string().contains("guesses: expected none"));
}

#[derive(Debug)]
struct Identity;

impl nonsmooth_linalg::Operator for Identity {
    fn nrows(&self) -> usize {
        1
    }
    fn ncols(&self) -> usize {
        1
    }
    fn mul(&self, x: &[f64], y: &mut [f64]) {
        y.copy_from_slice(x);
    }
    fn mul_transpose(&self, x: &[f64], y: &mut [f64]) {
        y.copy_from_slice(x);
    }
}

// ------------------------------------------------------------------------------------------------ Matrix Market

#[test]
fn layouts_and_symmetries_of_matrix_market() {
    let folder = Folder::new();
    folder.put("a_q.mtx", "1 2\n3\n");
    let read = |text: &str| match folder.read("a.mtx", text) {
        Complementarity::Lcp(p) => p.M,
        other => panic!("{other:?}"),
    };
    let head = "%%MatrixMarket matrix";
    let symmetric = rows(&[[1.0, 2.0, 0.0], [2.0, 0.0, 5.0], [0.0, 5.0, 0.0]]);
    let sparse = read(&format!(
        "{head} coordinate real symmetric\n% remark\n%\n3 3 3\n1 1 1\n2 1 2e0\n3 2 5\n"
    ));
    assert!(matches!(sparse, Matrix::Sparse(_)));
    assert_eq!(sparse.to_dense().unwrap(), symmetric);
    assert_eq!(
        read(&format!("{head} array integer symmetric\n3 3\n1\n2\n0\n0\n5\n0\n")),
        symmetric.into()
    );
    let skew = rows(&[[0.0, -2.0, 0.0], [2.0, 0.0, -5.0], [0.0, 5.0, 0.0]]);
    let from = read(&format!("{head} coordinate real skew-symmetric\n3 3 2\n2 1 2\n3 2 5\n"));
    assert_eq!(from.to_dense().unwrap(), skew);
    assert_eq!(
        read(&format!("{head} array real skew-symmetric\n3 3\n2\n-0\n5\n")).to_dense(),
        Some(skew)
    );
    // By columns.
    let general = read(&format!("{head} array real general\n3 3\n1\n2\n3\n4\n5\n6\n7\n8\n9\n"));
    assert_eq!(general, rows(&[[1.0, 4.0, 7.0], [2.0, 5.0, 8.0], [3.0, 6.0, 9.0]]).into());

    for (text, all) in [
        ("%%MatrixMarket vector array real general\n3 3\n", ["line 1", "matrix LAYOUT"]),
        ("%%MatrixMarket matrix array complex general\n3 3\n", ["line 1", "`complex`"]),
        (
            "%%MatrixMarket matrix array real general\n3 3\n1\n2\n",
            ["expected", "the end of the file"],
        ),
        (
            "%%MatrixMarket matrix array real general\n99999999999 99999999999\n",
            ["line 2", "number of rows"],
        ),
        (
            "%%MatrixMarket matrix coordinate real general\n3 3 1\n4 1 1\n",
            ["line 3", "from 1 to 3"],
        ),
        ("%%MatrixMarket matrix coordinate real general\n3 3 1\n0 1 1\n", ["line 3", "`0`"]),
        ("%%MatrixMarket matrix coordinate real general\n3 3 1\n1 1 x\n", ["line 3", "`x`"]),
        (
            "%%MatrixMarket matrix coordinate real general\n3 3 1\n1 1 1\n2 2 2\n",
            ["line 4", "end of the file"],
        ),
        ("%%MatrixMarket matrix coordinate real symmetric\n3 2 0\n", ["square", "3 × 2"]),
        (
            "%%MatrixMarket matrix coordinate real symmetric\n2 2 4\n1 1 2\n2 1 1\n1 2 1\n2 2 2\n",
            ["line 5", "one triangle"],
        ),
        (
            "%%MatrixMarket matrix coordinate real skew-symmetric\n2 2 2\n2 1 1\n2 2 3\n",
            ["line 4", "no diagonal"],
        ),
        ("%%MatrixMarket matrix coordinate real general\n2 2 0\n", ["q", "2 entries"]),
    ] {
        folder.refused("a.mtx", text, &all);
    }
    let alone = format!("{head} array real general\n1 1\n1\n");
    folder.refused("b.mtx", &alone, &["b_q.mtx beside"]);
    folder.put("b_q.mtx", "%%MatrixMarket matrix array real general\n1 1\n-3\n");
    folder.read("b.mtx", &alone);
    folder.put("b_l.mtx", "-1");
    folder.refused("b.mtx", &alone, &["b_u.mtx beside b_l.mtx"]);
    folder.put("b_u.mtx", "inf");
    assert!(matches!(folder.read("b.mtx", &alone), Complementarity::Box(_)));
    // What is there would become a part of an LCP.
    let lcp = ProblemFile::new(Lcp::new(rows(&[[1.0]]), vec![1.0]).unwrap());
    let message = lcp.write(folder.path("b.mtx")).unwrap_err().to_string();
    assert!(message.contains("b_l.mtx"), "{message}");
}

// ------------------------------------------------------------------------------------------------ Siconos

const BLOCKS: &str = "3\n1\n3\n3\n3\n2 2\n1 3\n2 3\n3 3\n0 1 3\n1 0 1\n\
    0\n1\n2\n1\n3\n4\n2\n5\n6\n7\n8\n-1 -2 -3\n";

#[test]
fn siconos_matrices_of_all_storages() {
    let folder = Folder::new();
    // A line of the file is a column of M.
    let text = "2\n0\n2\n2\n2\t2\n 1.0 2.0\n 3.0 4.0\n -5 -6\n\nRemark 7 in CPS\n";
    let Complementarity::Lcp(p) = folder.read("a.dat", text) else { panic!() };
    assert_eq!(p.M, rows(&[[1.0, 3.0], [2.0, 4.0]]).into());
    assert_eq!(p.q, [-5.0, -6.0]);

    // Two rows of blocks, of 2 and 1 rows; two columns of blocks, of 1 and 2 columns.
    let blocks = "3\n1\n3\n3\n3\n2 2\n2 3\n1 3\n3 3\n0 1 3\n1 0 1\n\
        0\n1\n2\n3\n4\n1\n5\n2\n6\n7\n-1 -2 -3\n";
    let Complementarity::Lcp(p) = folder.read("a.dat", blocks) else { panic!() };
    let expected = rows(&[[0.0, 1.0, 3.0], [0.0, 2.0, 4.0], [5.0, 6.0, 7.0]]);
    assert_eq!(p.M.to_dense().unwrap(), expected);
    folder.refused("a.dat", BLOCKS, &["line "]);

    let triplets = "2\n2\n2\n2\n1\nCSparse Version 3.2.0, Sept 12, 2017.  Copyright\n\
        triplet: 2-by-2, nzmax: 4 nnz: 3\n    0 1 : 3\n    1 0 : 2\n    1 1 : 4e-1\n-5 -6\n";
    let Complementarity::Lcp(p) = folder.read("a.dat", triplets) else { panic!() };
    assert_eq!(p.M.to_dense().unwrap(), rows(&[[0.0, 3.0], [2.0, 0.4]]));
    let columns = "2\n2\n2\n2\n3\nCSparse Version 3.2.0\n2-by-2, nzmax: 4 nnz: 2, 1-norm: 7\n\
        col 0 : locations 0 to -1\ncol 1 : locations 0 to 1\n 0 : 3\n 1 : 4\n-5 -6\n";
    let Complementarity::Lcp(p) = folder.read("a.dat", columns) else { panic!() };
    assert_eq!(p.M.to_dense().unwrap(), rows(&[[0.0, 3.0], [0.0, 4.0]]));
    assert_eq!(p.q, [-5.0, -6.0]);
}

#[test]
fn siconos_mixed_problems_and_relays() {
    let folder = Folder::new();
    // A = [1 2; 0 5], C = (3; 6), D = (7 8), B = 9.
    let parts = "0 1 2 1\n 1 2\n0 5\n 9\n 3\n6\n 7 8\n -1 -2\n -3\n";
    let Complementarity::Mlcp(p) = folder.read("a.dat", parts) else { panic!() };
    let expected = rows(&[[1.0, 2.0, 3.0], [0.0, 5.0, 6.0], [7.0, 8.0, 9.0]]);
    assert_eq!((p.M.clone(), p.free, p.equalities), (expected.clone().into(), 2, 2));
    assert_eq!(p.q, [-1.0, -2.0, -3.0]);
    let whole = "1\n0\n2\n1\n0 2 3\n0 1\n0\n3\n3\n3 3\n1 0 7\n2 5 8\n3 6 9\n-1 -2 -3\n";
    assert_eq!(folder.read("b.dat", whole), Complementarity::Mlcp(p.clone()));
    // The pair first.
    let turned = "1\n0\n2\n1\n0 1 3\n1 0\n0\n3\n3\n3 3\n9 3 6\n7 1 0\n8 2 5\n-3 -1 -2\n";
    assert_eq!(folder.read("c.dat", turned), Complementarity::Mlcp(p));
    // The old format, with more equalities than free variables.
    let old = "1 1 3\n 1\n2\n 3\n 4\n5\n 6\n -1 -2\n -3\n";
    let Complementarity::Mlcp(p) = folder.read("d.dat", old) else { panic!() };
    assert_eq!(p.M, rows(&[[1.0, 4.0], [2.0, 5.0], [6.0, 3.0]]).into());
    assert_eq!((p.equalities, p.free), (2, 1));

    let relay = "2\n0\n2\n2\n2 2\n 1 2\n 3 4\n -5 -6\n -1 -1\n 1 1\n";
    let Complementarity::Box(p) = folder.read("a.dat", relay) else { panic!() };
    assert_eq!((p.lower, p.upper), (vec![-1.0, -1.0], vec![1.0, 1.0]));
    // Bounds or a solution? The name may say.
    let either = "2\n0\n2\n2\n2 2\n 1 2\n 3 4\n -5 -6\n 0 0\n 1 1\n";
    folder.refused("a.dat", either, &["after q", "`lcp` or `relay`"]);
    assert!(matches!(folder.read("relay_a.dat", either), Complementarity::Box(_)));
    assert!(matches!(folder.read("lcp_a.dat", either), Complementarity::Lcp(_)));
    // What the name says to be a relay problem is no LCP because its bounds are damaged.
    let damaged = |bounds: &str| format!("2\n0\n2\n2\n2 2\n 1 2\n 3 4\n -5 -6\n{bounds}");
    for (bounds, all) in [
        ("", ["line 9, l[0]", "the end of the file"]),
        ("-1 -1\n1\n", ["line 11, u[1]", "the end of the file"]),
        ("-1 x\n1 1\n", ["line 9, l[1]", "`x`"]),
        ("-1 nan\n1 1\n", ["[1]", "NaN"]),
        ("1 1\n-1 2\n", ["[0]", "-1"]),
        ("-1 -1\n1 1\n3\n", ["after u", "`3`"]),
    ] {
        folder.refused("relay_b.dat", &damaged(bounds), &all);
    }
}

#[test]
fn mistakes_in_siconos_files_are_named() {
    let folder = Folder::new();
    let cases: [(&str, &[&str]); 9] = [
        (
            "2\n0\n2\n2\n2 2\n1 2\n3 4\n-5\n",
            &["line 9, q[1]: expected a number, found the end of the file"],
        ),
        ("2\n0\n2\n2\n2 2\n1 2\n3 x\n-5 -6\n", &["line 7, M[1, 1]: expected a number, found `x`"]),
        ("2\n0\n3\n2\n2 2\n1 2\n3 4\n-5 -6\n", &["line 3, the rows of M: expected 2, found `3`"]),
        ("2\n7\n2\n2\n", &["line 2", "0 (dense), 1 (blocks) or 2 (sparse)", "`7`"]),
        ("99999999999\n0\n2\n2\n", &["line 1", "has room", "`99999999999`"]),
        ("1 0 1 1\n0 1 2\n0 0\n", &["blocks with 1 equalities", "2 equalities"]),
        (
            "1 1 1 1\n0 1 2\n0 1\n0\n2\n2\n2 2\n1 2 3 4\n5 6\n1\n4\n3\n2\n5\n7\n",
            &["row 1", "the same data"],
        ),
        ("2\n0\n2\n2\n2 2\n1 2\n3 nan\n-5 -6\n", &["M[1, 1]", "NaN"]),
        ("1 1 3\n1\n2\n3\n4\n5\n6\n-1 -2\n-3\nmore\n", &["line 10", "`more`"]),
    ];
    for (text, all) in cases {
        folder.refused("a.dat", text, all);
    }
    folder.refused("a.dat", "some text", &["HDF5", "another text"]);
    folder.refused("a.dat", "", &["an empty file"]);
    folder.refused("a.dat", "\u{0}\u{1}", &["another text"]);
    std::fs::write(folder.path("b.dat"), [0xff, 0xfe, 0x00]).unwrap();
    assert!(
        ProblemFile::read(folder.path("b.dat")).unwrap_err().to_string().contains("other data")
    );
    assert!(ProblemFile::read(folder.path("")).unwrap_err().to_string().contains("a directory"));
    assert!(
        ProblemFile::read(folder.path("none.dat")).unwrap_err().to_string().contains("none.dat")
    );
}

#[test]
fn siconos_problems_of_contacts() {
    let folder = Folder::new();
    let read = |text: &str| match ProblemFile::read(folder.put("a.dat", text)) {
        Ok(ProblemFile { problem: AnyProblem::Friction(problem), .. }) => problem,
        other => panic!("{other:?}"),
    };
    // By columns: W = [2 1; 0 3].
    let Friction::Local2(p) = read("2\n1\n0\n2\n2\n2 2\n2 0\n1 3\n-4 -5\n0.7\n") else { panic!() };
    assert_eq!(p.W.diagonal_block(0), [[2.0, 1.0], [0.0, 3.0]]);
    assert_eq!((p.q, p.mu), (vec![-4.0, -5.0], vec![0.7]));
    // Blocks, of two contacts of which the second has none beside the diagonal.
    let blocks = "2\n2\n1\n4\n4\n2\n2 2\n2 4\n2 4\n3 2\n0 1 2\n0 1\n0\n1 0 0 2\n1\n3 0 0 4\n-1 0 -1 0\n0.5 0.6\n";
    let Friction::Local2(p) = read(blocks) else { panic!() };
    assert_eq!((p.W.nblocks(), p.W.diagonal_block(1)), (2, [[3.0, 0.0], [0.0, 4.0]]));
    // A sparse M, a dense H (2 × 3, by columns), more after mu. All numbers of a local problem stand there as well.
    let mut global = "3\n1\n2\n2\n2\n1\nCSparse Version 3.2.0\ntriplet: 2-by-2, nzmax: 2 nnz: 2\n0 0 : 2\n1 1 : 5\n\
        0\n2\n3\n2 3\n1 0\n0 1\n0 6\n-1 -2\n7 8 9\n0.1\n0\n".to_owned();
    let Friction::Global3(p) = read(&global) else { panic!() };
    assert_eq!(Matrix::from(p.M).to_dense().unwrap(), rows(&[[2.0, 0.0], [0.0, 5.0]]));
    assert_eq!(Matrix::from(p.H).to_dense().unwrap(), rows(&[[1.0, 0.0, 0.0], [0.0, 1.0, 6.0]]));
    assert_eq!((p.f, p.w, p.mu), (vec![-1.0, -2.0], vec![7.0, 8.0, 9.0], vec![0.1]));

    global.truncate(global.len() - 8);
    folder.refused("a.dat", &global, &["b[2]", "a number", "the end of the file"]);
    // Of as many freedoms as rows of contacts: with q the head of H and mu its next number it would be a local problem.
    let square =
        "3\n1\n0\n3\n3\n3 3\n2 0 0 0 2 0 0 0 2\n0\n3\n3\n3 3\n1 0 0 0 1 0 0 0 1\n-1 0 0\n0 0 0\n";
    assert!(matches!(read(&format!("{square}0.3\n")), Friction::Global3(_)));
    folder.refused("a.dat", square, &["mu[0]", "the end of the file"]);
    folder.refused("a.dat", &format!("{square}-0.3\n"), &["mu", "-0.3"]);
    folder.refused("a.dat", &format!("{square}0,3\n"), &["mu[0]", "`0,3`"]);
    // A local one whose q looks like a head, with remarks after mu.
    let local = "3\n1\n0\n3\n3\n3 3\n2 0 0 0 2 0 0 0 2\n0 3 3\n0.3\nby hand\n";
    let Friction::Local3(p) = read(local) else { panic!() };
    assert_eq!((p.q, p.mu), (vec![0.0, 3.0, 3.0], vec![0.3]));
    for (text, all) in [
        (
            "5\n1\n0\n1\n1\n1 1\n2\n0\n1\n5\n1 5\n1 1 1 1 1\n1\n1 1 1 1 1\n0.3\n",
            &["mu_r[0]", "the end of the file"][..],
        ),
        ("3\n1\n0\n3\n3\n3 3\n1 0 0 0 1 0 0 0 1\n-1 0 0\n", &["mu[0]", "the end of the file"]),
        ("3\n1\n0\n3\n3\n3 3\n1 0 0 0 1 0 0 0 1\n-1 0 0\n-0.5\n", &["mu"]),
        (
            "3\n1\n0\n4\n4\n4 4\n1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n-1 0 0 0\n0.5\n",
            &["the storage of H", "`-1`"],
        ),
    ] {
        folder.refused("a.dat", text, all);
    }
}

// ------------------------------------------------------------------------------------------------ damage

/// Every beginning of a file, and every file with one letter changed, is read or refused.
#[test]
fn damaged_files_never_panic() {
    let folder = Folder::new();
    let point = LcpPoint { z: vec![1.0, 2.0, 3.0] }.into();
    let file = ProblemFile {
        info: Info { title: Some("a \"title\"".into()), ..Info::default() },
        solution: Some(StoredPoint { point, partner: Some(vec![4.0]), statuses: vec![] }),
        ..ProblemFile::new(
            Mlcp::new(rows(&[[1.0, 2.0, 3.0], [0.0, 5.0, 6.0], [7.0, 8.0, 9.0]]), vec![-1.0; 3], 2)
                .unwrap(),
        )
    };
    file.write(folder.path("m.toml")).unwrap();
    folder.put("s_q.mtx", "1\n2\n");
    let mixed = std::fs::read_to_string(folder.path("m.toml")).unwrap();
    let texts = [
        ("a.toml", mixed.as_str()),
        ("s.mtx", "%%MatrixMarket matrix coordinate real symmetric\n% x\n2 2 2\n1 1 1.5\n2 1 2\n"),
        ("a.dat", BLOCKS),
        ("a.dat", "1\n1\n1\n1\n0 1 2\n0 1\n0\n2\n2\n2 2\n1 2\n3 4\n5 6\n1\n4\n3\n2\n5\n6\n"),
        (
            "a.dat",
            "2\n2\n2\n2\n1\nCSparse V\ntriplet: 2-by-2, nzmax: 4 nnz: 3\n0 1 : 3\n1 0 : 2\n1 1 : 4\n-5 -6\n",
        ),
    ];
    for (name, text) in texts {
        let path = folder.path(name);
        let read = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            if let Err(e) = ProblemFile::read(&path) {
                assert!(!e.to_string().contains('\n'), "{e}");
            }
        };
        for end in 0..text.len() {
            read(&text.as_bytes()[..end]);
        }
        for at in 0..text.len() {
            for letter in *b"09-x \n[\xff" {
                let mut bytes = text.as_bytes().to_vec();
                bytes[at] = letter;
                read(&bytes);
            }
        }
    }
}

// ------------------------------------------------------------------------------------------------ the corpus

fn corpus(folder: &str) -> Option<Vec<PathBuf>> {
    let Some(corpus) = std::env::var_os("NONSMOOTH_CORPUS") else {
        crate::common::skipped("NONSMOOTH_CORPUS is not set");
        return None;
    };
    let all = std::fs::read_dir(Path::new(&corpus).join(folder)).unwrap();
    let mut all: Vec<_> = all.map(|e| e.unwrap().path()).collect();
    all.sort();
    Some(all)
}

#[test]
fn every_lcp_of_the_corpus_is_read() {
    let Some(files) = corpus("lcp") else { return };
    let mut read = std::collections::BTreeMap::new();
    for path in &files {
        assert!(holds_problem(path), "{}", path.display());
        let file = ProblemFile::read(path).unwrap_or_else(|e| panic!("{e}"));
        let Complementarity::Lcp(lcp) = linear(file) else { panic!("{}", path.display()) };
        let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
        read.insert(name, lcp);
    }
    assert_eq!(read.len(), 20);
    let mut blocks = 0;
    for (name, lcp) in &read {
        if let Some(plain) = name.strip_suffix("_block") {
            assert!(matches!(lcp.M, Matrix::Sparse(_)));
            assert_eq!(lcp.M.to_dense(), read[plain].M.to_dense(), "{name}");
            assert_eq!(lcp.q, read[plain].q, "{name}");
            blocks += 1;
        }
    }
    assert_eq!(blocks, 3);
    // Murty's U_6, not its transpose.
    let murty = read["lcp_exp_murty"].M.to_dense().unwrap();
    assert_eq!((murty[(0, 1)], murty[(1, 0)]), (2.0, 0.0));
    assert_eq!(
        read["lcp_Pang_isolated_sol"].M,
        rows(&[[0.0, -1.0, -1.0], [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]).into()
    );
}

#[test]
fn every_mlcp_of_the_corpus_is_read() {
    let Some(files) = corpus("mlcp") else { return };
    let sizes = [
        ("deudeu", 1, 1),
        ("RCD", 2, 1),
        ("RLCD", 6, 2),
        ("m2n1", 1, 2),
        ("m3n2", 2, 3),
        ("PD", 3, 4),
        ("PDSym", 3, 4),
        ("diodeBridge", 3, 4),
        ("relay2", 4, 2),
        ("relay3", 4, 2),
        ("diodeBridge20", 11, 20),
        ("diodeBridge40", 21, 40),
        ("Buck2", 20, 12),
        ("BuckConverter", 20, 12),
        ("BuckFirstStep", 20, 12),
        ("deltasigma", 65, 156),
        ("deltasigma2", 65, 156),
    ];
    assert_eq!(files.len(), sizes.len() + 1);
    for path in &files {
        let name = path.file_stem().unwrap().to_str().unwrap().trim_end_matches("_mlcp").to_owned();
        let content = ProblemFile::read(path);
        if name == "Rectangular" {
            let message = content.unwrap_err().to_string();
            assert!(
                message.contains("the shape of M: expected 2 × 2, as the file states n = 1")
                    && message.ends_with("found `3 × 2`"),
                "{message}"
            );
            continue;
        }
        let file = content.unwrap_or_else(|e| panic!("{e}"));
        let problem = linear(file.clone());
        let Complementarity::Mlcp(p) = &problem else { panic!("{name}") };
        let (_, n, m) = sizes.iter().find(|s| s.0 == name).expect(&name);
        assert_eq!((p.free, p.equalities, p.pairs()), (*n, *n, *m), "{name}");
        // What is read can be kept in our format.
        let folder = Folder::new();
        file.write(folder.path("a.toml")).unwrap();
        same(&ProblemFile::read(folder.path("a.toml")).unwrap(), &file);
        assert_eq!(dense(&problem).nrows(), n + m);
    }
}

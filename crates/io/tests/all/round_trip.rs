//! What is written is read back bit for bit, here and by other readers of HDF5.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use crate::common::{assert_same, contacts, impulses, sizes, stored};
use nonsmooth_io::fclib::{self, Fclib};
use nonsmooth_io::{Format, ProblemFile, StoredPoint};
use nonsmooth_linalg::{Bsr, Csc};
use nonsmooth_problem::{
    AnyPoint, AnyProblem, Bounds, Friction, FrictionGlobal, FrictionLocal, GlobalPoint, LocalPoint,
    Problem, RowsGlobal, RowsLocal,
};
use proptest::prelude::*;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn files_pass_through_unchanged(content in crate::common::content()) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file.hdf5");
        Fclib.write(&path, &content).unwrap();
        let back = Fclib.read(&path).unwrap();
        assert_same(&back, &content);
        prop_assert_eq!(AnyProblem::from(fclib::read_problem(&path).unwrap()), content.problem);
        prop_assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_solution_is_added_or_replaced(content in crate::common::content()) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file.hdf5");
        Fclib.write(&path, &content).unwrap();
        let (v, m, p) = sizes(&content.problem);
        let v = v.map(|n| vec![-0.0; n]);
        let mut solution = stored(v, vec![1.5; m], vec![5e-324; m], vec![-0.0; p]);
        for _ in 0..2 {
            fclib::write_solution(&path, &solution).unwrap();
            let expected = ProblemFile { solution: Some(solution.clone()), ..content.clone() };
            assert_same(&Fclib.read(&path).unwrap(), &expected);
            impulses(&mut solution).0[0] = 2.0;
        }
        prop_assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}

/// Numbers whose bits are easily lost.
const AWKWARD: [f64; 8] = [-0.0, 5e-324, -2.225e-308, 0.1, f64::MAX, 1.0 / 3.0, 0.0, -1e-17];

fn csc(rows: usize, columns: usize) -> Csc {
    let cells = (0..columns).flat_map(|j| (0..rows).map(move |i| (i, j)));
    let entries = cells.filter(|(i, j)| (i + 2 * j) % 3 != 1);
    Csc::from_triplets(rows, columns, entries.map(|(i, j)| (i, j, AWKWARD[(i + j) % 8]))).unwrap()
}

fn local() -> FrictionLocal<2> {
    FrictionLocal {
        W: Bsr::from_csc(&csc(4, 4)),
        q: AWKWARD[..4].into(),
        mu: vec![0.0, 0.7],
        mu_r: (),
        rows: Some(RowsLocal::bilateral(csc(4, 2), csc(2, 2), AWKWARD[4..6].into())),
    }
}

fn global() -> FrictionGlobal<3> {
    FrictionGlobal {
        M: csc(5, 5),
        H: csc(5, 3),
        f: AWKWARD[..5].into(),
        w: AWKWARD[5..].into(),
        mu: vec![0.3],
        mu_r: (),
        rows: Some(RowsGlobal::bilateral(csc(5, 1), vec![-0.0])),
    }
}

fn contents() -> [ProblemFile; 2] {
    let mut local = ProblemFile::new(Friction::Local2(local()));
    let x = AWKWARD[..4].to_vec();
    local.solution = Some(stored(None, x.clone(), x, vec![1.0, -0.0]));
    local.info.title = Some("a title".into());
    local.info.math_info = Some(String::new());
    local.info.dofs = Some(12);
    local.drawing = Some("{\"größer\": 1}".into());
    let mut global = ProblemFile::new(Friction::Global3(global()));
    // M is no matter here: u overflows where v meets f64::MAX.
    let point = stored(Some(AWKWARD[..5].into()), vec![0.5; 3], vec![1.0, 0.0, -0.0], vec![0.1]);
    global.guesses = vec![point; 11];
    global.info.description = Some("friction, größer".into());
    [local, global]
}

#[test]
fn velocities_that_are_not_given_are_computed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("file.hdf5");
    let written = |problem: AnyProblem, point: AnyPoint| {
        let solution = Some(StoredPoint::from(point));
        ProblemFile { solution, ..ProblemFile::new(problem) }.write(&path).unwrap();
        ProblemFile::read(&path).unwrap().solution.unwrap()
    };
    let w = Csc::diagonal(&[2.0, 4.0]);
    let problem = FrictionLocal::<2>::new(Bsr::from_csc(&w), vec![-1.0, 0.5], vec![0.5]).unwrap();
    let point = LocalPoint { r: vec![0.5, 0.25], lambda: vec![] };
    let kept = written(problem.into(), point.clone().into());
    assert_eq!(kept, stored(None, vec![0.0, 1.5], point.r, vec![]));

    let mut problem = global();
    problem.H = Csc::from_triplets(5, 3, [(0, 0, 2.0), (4, 2, -1.0)].into_iter()).unwrap();
    problem.w = vec![1.0, 2.0, 3.0];
    let point =
        GlobalPoint { v: vec![1.0, 0.0, 0.0, 0.0, 5.0], r: vec![1.0, 0.0, 0.0], lambda: vec![7.0] };
    let kept = written(problem.into(), point.clone().into());
    assert_eq!(kept.partner, Some(vec![3.0, 2.0, -2.0]));
    assert_eq!(kept.point, point.into());
    // A point of another kind.
    let file = ProblemFile {
        solution: Some(LocalPoint { r: vec![0.0; 3], lambda: vec![0.0] }.into()),
        ..ProblemFile::new(global())
    };
    let message = file.write(&path).unwrap_err().to_string();
    assert!(message.contains("/solution/v: expected 5 entries"), "{message}");
}

#[test]
fn an_existing_file_is_replaced_and_a_failure_leaves_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("file.hdf5");
    let [local, global] = contents();
    Fclib.write(&path, &local).unwrap();
    Fclib.write(&path, &global).unwrap();
    assert_same(&Fclib.read(&path).unwrap(), &global);

    let mut bad = local;
    impulses(bad.solution.as_mut().unwrap()).0[3] = f64::NAN;
    let message = Fclib.write(&path, &bad).unwrap_err().to_string();
    assert!(
        message.ends_with(": /solution/r[3]: expected a finite number, found NaN"),
        "{message}"
    );
    let message = fclib::write_solution(&path, &bad.solution.unwrap()).unwrap_err().to_string();
    let expected = ": /solution/v: expected 5 entries (degrees of freedom), found 0 entries";
    assert!(message.ends_with(expected), "{message}");
    assert_same(&Fclib.read(&path).unwrap(), &global);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn what_cannot_be_written_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("file.hdf5");
    let [local, _] = contents();
    let refused = |path: &Path, content: &ProblemFile, expected: &str| {
        let message = Fclib.write(path, content).unwrap_err().to_string();
        assert_eq!(message, format!("{}: {expected}", path.display()));
    };
    let mut bad = local.clone();
    bad.info.description = Some("a\0b".into());
    refused(
        &path,
        &bad,
        "/fclib_local/info/description: expected a text without NUL characters, found one with",
    );
    let mut bad = local.clone();
    bad.info.dofs = Some(1 << 31);
    refused(
        &path,
        &bad,
        "/fclib_local/info/@numberOfDegreeOfFreedom: expected at most 2147483647 (a C int), found 2147483648",
    );
    let mut bad = local.clone();
    let AnyProblem::Friction(Friction::Local2(p)) = &mut bad.problem else { unreachable!() };
    p.mu[1] = -0.5;
    refused(
        &path,
        &bad,
        "/fclib_local/vectors/mu[1]: expected a coefficient of friction of at least 0, found -0.5",
    );
    let mut bad = local.clone();
    let AnyProblem::Friction(Friction::Local2(p)) = &mut bad.problem else { unreachable!() };
    let rows = p.rows.as_mut().unwrap();
    (rows.bounds.lower, rows.bounds.upper) = (vec![0.0, 2.0], vec![1.0; 2]);
    let crossing = "/fclib_local/vectors/[l, u][1]: expected l ≤ u, l < ∞, u > −∞, found [2, 1]";
    refused(&path, &bad, crossing);
    let writable = "expected a file that can be written, found: ";
    let absent = folder.path().join("absent/file.hdf5");
    refused(&absent, &local, &format!("{writable}No such file or directory (os error 2)"));
    refused(folder.path(), &local, &format!("{writable}is a directory"));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    #[cfg(unix)]
    {
        // With the rights to do so, renaming would replace the device.
        let socket = folder.path().join("socket");
        let _listener = std::os::unix::net::UnixListener::bind(&socket).unwrap();
        let device = format!("{writable}no regular file (a device, pipe or socket)");
        refused(&socket, &local, &device);
        refused(Path::new("/dev/null"), &local, &device);
        for path in [&socket, Path::new("/dev/null")] {
            let nothing = stored(None, vec![], vec![], vec![]);
            let message = fclib::write_solution(path, &nothing).unwrap_err().to_string();
            assert_eq!(message, format!("{}: {device}", path.display()));
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}

/// Reads every dataset and attribute with h5py: path, type, shape and bytes, one a line.
const DUMP: &str = r#"
import sys, h5py
def bits(v):
    # numpy drops the trailing NUL of a string, except of an empty one.
    return bytes(v).rstrip(b'\0').hex() if isinstance(v, bytes) else v.tobytes().hex()
def show(path, x):
    for name, v in sorted(x.attrs.items()):
        print(f'{path}@{name}', v.dtype, v.shape, bits(v))
    if isinstance(x, h5py.Dataset):
        t = h5py.check_string_dtype(x.dtype)
        kind = f'{t.encoding}{t.length}' if t else x.dtype
        print(path, kind, x.shape, bits(x[()]))
for path in sys.argv[1:]:
    with h5py.File(path) as f:
        f.visititems(lambda name, x: show('/' + name, x))
"#;

/// The lines that [`DUMP`] prints for the problem parts of a file.
fn expected_dump(content: &ProblemFile) -> String {
    let mut lines = vec![];
    fn hex(bytes: impl IntoIterator<Item = u8>) -> String {
        bytes.into_iter().fold(String::new(), |mut s, b| {
            write!(s, "{b:02x}").unwrap();
            s
        })
    }
    let int = |x: &[usize]| hex(x.iter().flat_map(|&x| (x as i32).to_le_bytes()));
    let real = |x: &[f64]| hex(x.iter().flat_map(|x| x.to_le_bytes()));
    let mut ints = |path: &str, x: &[usize]| {
        lines.push(format!("{path} int32 ({},) {}", x.len(), int(x)));
    };
    let (root, mut matrices, vectors) = match contacts(content) {
        Friction::Local2(p) => {
            let b = p.rows.as_ref().unwrap();
            let matrices = vec![("W", p.W.to_csc()), ("V", b.V.clone()), ("R", b.R.clone())];
            ("/fclib_local", matrices, vec![("q", &p.q), ("mu", &p.mu), ("s", &b.s)])
        }
        Friction::Global3(p) => {
            let b = p.rows.as_ref().unwrap();
            let matrices = vec![("M", p.M.clone()), ("H", p.H.clone()), ("G", b.G.clone())];
            ("/fclib_global", matrices, vec![("f", &p.f), ("w", &p.w), ("mu", &p.mu), ("b", &b.b)])
        }
        _ => unreachable!(),
    };
    ints(&format!("{root}/spacedim"), &[if root == "/fclib_local" { 2 } else { 3 }]);
    for (name, a) in &mut matrices {
        let triplets: Vec<_> = a.triplets().collect();
        ints(&format!("{root}/{name}/m"), &[a.nrows()]);
        ints(&format!("{root}/{name}/n"), &[a.ncols()]);
        ints(&format!("{root}/{name}/nz"), &[a.nnz()]);
        ints(&format!("{root}/{name}/nzmax"), &[a.nnz()]);
        ints(&format!("{root}/{name}/i"), &triplets.iter().map(|t| t.0).collect::<Vec<_>>());
        ints(&format!("{root}/{name}/p"), &triplets.iter().map(|t| t.1).collect::<Vec<_>>());
    }
    if !content.guesses.is_empty() {
        ints("/guesses/number_of_guesses", &[content.guesses.len()]);
    }
    if let Some(dofs) = content.info.dofs {
        ints(&format!("{root}/info@numberOfDegreeOfFreedom"), &[dofs]);
    }
    let mut reals = |path: &str, x: &[f64]| {
        lines.push(format!("{path} float64 ({},) {}", x.len(), real(x)));
    };
    for (name, a) in &matrices {
        reals(&format!("{root}/{name}/x"), a.values());
    }
    for (name, x) in vectors {
        reals(&format!("{root}/vectors/{name}"), x);
    }
    let mut point = |path: &str, point: &StoredPoint| {
        let (v, r, lambda) = match &point.point {
            AnyPoint::Local(p) => (None, &p.r, &p.lambda),
            AnyPoint::Global(p) => (Some(&p.v), &p.r, &p.lambda),
            other => panic!("{other:?}"),
        };
        for (name, x) in
            [("u", point.partner.as_ref()), ("r", Some(r)), ("v", v), ("l", Some(lambda))]
        {
            if let Some(x) = x {
                reals(&format!("{path}/{name}"), x);
            }
        }
    };
    if let Some(solution) = &content.solution {
        point("/solution", solution);
    }
    for (k, guess) in content.guesses.iter().enumerate() {
        point(&format!("/guesses/{}", k + 1), guess);
    }
    let info = &content.info;
    let texts = [
        (format!("{root}/info/title"), &info.title),
        (format!("{root}/info/description"), &info.description),
        (format!("{root}/info/math_info"), &info.math_info),
        ("/nonsmooth/drawing".into(), &content.drawing),
    ];
    for (path, text) in texts {
        if let Some(text) = text {
            let encoding = if text.is_ascii() { "ascii" } else { "utf-8" };
            let line = format!("{path} {encoding}{} () {}", text.len() + 1, hex(text.bytes()));
            lines.push(line.trim_end().into());
        }
    }
    lines.sort();
    lines.join("\n")
}

fn sorted_lines(command: &mut Command) -> String {
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    let mut lines: Vec<&str> = text.lines().map(str::trim_end).collect();
    lines.sort();
    lines.join("\n")
}

/// Whether there is h5py; says so if not.
fn h5py() -> bool {
    let mut python = Command::new("python3");
    let here = python.args(["-c", "import h5py"]).output().is_ok_and(|o| o.status.success());
    if !here {
        crate::common::skipped("python3 with h5py is not here");
    }
    here
}

#[test]
fn h5py_reads_what_is_written() {
    if !h5py() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("file.hdf5");
    for mut content in contents() {
        Fclib.write(&path, &content).unwrap();
        let dump = || sorted_lines(Command::new("python3").args(["-c", DUMP]).arg(&path));
        assert_eq!(dump(), expected_dump(&content));
        // The same after a solution was added to the file.
        let mut solution = content.solution.take().unwrap_or_else(|| content.guesses[0].clone());
        impulses(&mut solution).0[1] = 0.625;
        fclib::write_solution(&path, &solution).unwrap();
        content.solution = Some(solution);
        assert_eq!(dump(), expected_dump(&content));
    }
}

#[test]
fn the_c_library_adds_to_what_is_written() {
    const APPEND: &str = r#"
import sys, h5py, numpy as np
with h5py.File(sys.argv[1], 'r+') as f:
    for k, n in dict(v=5, u=3, r=3, l=1).items(): f[f'solution/{k}'] = np.full(n, -0.0)
"#;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("file.hdf5");
    let [_, mut content] = contents();
    Fclib.write(&path, &content).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    assert_eq!((&bytes[..8], bytes[8]), (&b"\x89HDF\r\n\x1a\n"[..], 2), "superblock of HDF5 1.8");
    let appended = Command::new("python3").args(["-c", APPEND]).arg(&path).output();
    if !appended.is_ok_and(|o| o.status.success()) {
        crate::common::skipped("python3 with h5py is not here");
        return;
    }
    let zeros = |n| vec![-0.0; n];
    content.solution = Some(stored(Some(zeros(5)), zeros(3), zeros(3), zeros(1)));
    assert_same(&Fclib.read(&path).unwrap(), &content);
}

#[test]
fn a_solution_is_added_to_files_of_the_c_library() {
    // Old superblock, symbol-table groups, and parts that this crate does not know.
    const MAKE: &str = r#"
import sys, h5py, numpy as np
with h5py.File(sys.argv[1], 'w', libver=('earliest', 'v108')) as f:
    g = f.create_group('fclib_local')
    g['spacedim'] = np.array([2], 'i4')
    W = g.create_group('W')
    for k, v in dict(m=2, n=2, nz=2, nzmax=2).items(): W[k] = np.array([v], 'i4')
    W['p'] = W['i'] = np.arange(2, dtype='i4')
    W['x'] = np.array([2.0, 4.0])
    W['conditioning'] = np.array([2.0])
    g['vectors/q'] = np.array([-1.0, 0.5])
    g['vectors/mu'] = np.array([0.5])
    g.create_group('info').attrs['numberOfInvolvedDS'] = 3
    f['notes'] = 'kept'
    if sys.argv[2] == 'with': f['solution/r'] = np.zeros(7)
"#;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("file.hdf5");
    for old in ["with", "without"] {
        let made = Command::new("python3").args(["-c", MAKE]).arg(&path).arg(old).output();
        if !made.is_ok_and(|o| o.status.success()) {
            crate::common::skipped("python3 with h5py is not here");
            return;
        }
        assert_eq!(std::fs::read(&path).unwrap()[8], 0, "superblock");
        let dump = || sorted_lines(Command::new("python3").args(["-c", DUMP]).arg(&path));
        let before = dump();
        assert!(before.contains("/notes utf-8"), "{before}");
        let x = vec![0.5, 0.25];
        let solution = stored(None, x.clone(), x, vec![]);
        fclib::write_solution(&path, &solution).unwrap();
        let content = Fclib.read(&path).unwrap();
        assert_eq!((content.solution, content.info.involved_ds), (Some(solution), Some(3)));
        let rest = |dump: &str| {
            let lines = dump.lines().filter(|line| !line.starts_with("/solution"));
            lines.map(String::from).collect::<Vec<_>>()
        };
        assert_eq!(rest(&dump()), rest(&before));
        assert_eq!(dump().lines().count(), rest(&before).len() + 2);
    }
}

#[test]
fn empty_multipliers_are_written_where_fclib_expects_them() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("file.hdf5");
    let problem =
        FrictionGlobal { rows: Some(RowsGlobal::bilateral(csc(5, 0), vec![])), ..global() };
    let point = stored(Some(vec![0.5; 5]), vec![0.0; 3], vec![1.0; 3], vec![]);
    let length = || {
        let file = hdf5_pure::File::open(&path).unwrap();
        file.dataset("solution/l").map(|l| l.shape().unwrap()).ok()
    };
    let mut content = ProblemFile::new(Friction::Global3(problem));
    content.solution = Some(point.clone());
    Fclib.write(&path, &content).unwrap();
    assert_eq!(length(), Some(vec![0]));
    assert_same(&Fclib.read(&path).unwrap(), &content);
    fclib::write_solution(&path, &point).unwrap();
    assert_eq!(length(), Some(vec![0]));
    assert_same(&Fclib.read(&path).unwrap(), &content);

    let AnyProblem::Friction(Friction::Global3(p)) = &mut content.problem else { unreachable!() };
    p.rows = None;
    Fclib.write(&path, &content).unwrap();
    assert_eq!(length(), None);
    assert_same(&Fclib.read(&path).unwrap(), &content);
}

/// Those of a mechanism whose joints alone act.
#[test]
fn problems_without_contacts_are_read_back() {
    let empty = |rows, columns| Csc::zeros(rows, columns);
    let local = FrictionLocal::<3> {
        W: Bsr::from_csc(&empty(0, 0)),
        q: vec![],
        mu: vec![],
        mu_r: (),
        rows: Some(RowsLocal::bilateral(empty(0, 2), csc(2, 2), vec![0.5, -0.0])),
    };
    let global = FrictionGlobal::<3> { H: empty(5, 0), w: vec![], mu: vec![], ..self::global() };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("file.hdf5");
    for problem in [Friction::Local3(local), Friction::Global3(global)] {
        let content = ProblemFile::new(problem);
        Fclib.write(&path, &content).unwrap();
        assert_same(&Fclib.read(&path).unwrap(), &content);
    }
}

#[test]
fn soft_links_are_followed() {
    // Moves what stands at `name` to `to`, if anything, and puts a link to `target` in its place.
    const LINK: &str = r#"
import sys, h5py
source, copy, format, name, to, target = sys.argv[1:]
def put(x, y):
    for k, v in x.items():
        if isinstance(v, h5py.Group): put(v, y.create_group(k))
        else: y[k] = v[()]
with h5py.File(source) as f, h5py.File(copy, 'w', libver=(format, 'latest')) as g:
    put(f, g)
    if to: g.move(name, to)
    elif name in g: del g[name]
    g[name] = h5py.SoftLink(target)
    g['chain'] = h5py.SoftLink(name)
    g['near'] = h5py.SoftLink('./chain')
"#;
    if !h5py() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let [written, path] = ["written.hdf5", "linked.hdf5"].map(|name| folder.path().join(name));
    let tree = crate::common::local_tree().set("solution/u", crate::common::Data::F(vec![0.5; 4]));
    let tree = tree.set("solution/r", crate::common::Data::F(vec![0.25; 4]));
    std::fs::rename(tree.save(folder.path()), &written).unwrap();
    let content = Fclib.read(&written).unwrap();
    let solution = stored(None, vec![1.5; 4], vec![1.25; 4], vec![]);
    let link = |format: &str, name: &str, to: &str, target: &str| {
        let mut python = Command::new("python3");
        python.args(["-c", LINK]).args([&written, &path]).args([format, name, to, target]);
        let made = python.output().unwrap();
        assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    };
    let message = || {
        let message = Fclib.read(&path).unwrap_err().to_string();
        message.strip_prefix(&format!("{}: ", path.display())).unwrap().to_string()
    };
    for format in ["earliest", "latest"] {
        for (name, to, target) in [
            ("/fclib_local/W/p", "/store/p", "/store/p"),
            ("/fclib_local/W/p", "/fclib_local/W/q", "q"),
            ("/fclib_local/W/p", "/fclib_local/W/deep/p", "./deep//p/"),
            ("/fclib_local/vectors", "/store/vectors", "/store/vectors"),
            ("/fclib_local", "/problem", "problem"),
            ("/solution", "/points/last", "/points/last"),
            ("/notes", "", "/nowhere"),
        ] {
            link(format, name, to, target);
            assert_same(&Fclib.read(&path).unwrap(), &content);
        }
        // To itself by way of a link that exists.
        link(format, "/fclib_local/W/p", "", "/near");
        let expected = "/fclib_local/W/p: expected a soft link that leads somewhere, found ";
        assert!(
            message().starts_with(&format!("{expected}more than 16 soft links in a row")),
            "{}",
            message()
        );
        link(format, "/fclib_local/W/p", "", "/fclib_local/W/gone");
        let dangling = "a soft link to `/fclib_local/W/gone`, where nothing stands";
        assert_eq!(message(), format!("{expected}{dangling}"));
        // What is optional is not passed over either.
        link(format, "/solution", "", "/gone");
        assert!(message().starts_with("/solution: expected a soft link that leads somewhere"));
        // A solution is not written through a link, nor at the price of one.
        let refusals = [("/solution", "/points/last"), ("/notes", "/fclib_local/info")];
        for (name, target) in refusals {
            link(format, name, if name == "/solution" { target } else { "" }, target);
            let before = std::fs::read(&path).unwrap();
            match fclib::write_solution(&path, &solution) {
                Ok(()) => {
                    assert_eq!(name, "/notes");
                    assert_eq!(Fclib.read(&path).unwrap().solution.as_ref(), Some(&solution));
                }
                Err(e) => {
                    let what =
                        "writing a solution into a group with soft links is not supported yet";
                    assert!(e.to_string().ends_with(what), "{e}");
                    assert_eq!(std::fs::read(&path).unwrap(), before);
                }
            }
        }
    }
}

/// Problems of contacts in the plane by h5py, one for each layout of data that Python states.
const LAYOUTS: &str = r#"
import sys, h5py, numpy as np
folder, *layouts = sys.argv[1:]
nc = 700; m = 2 * nc
k = np.arange(m)
for format in ['earliest', 'v108', 'v110', 'latest']:
    for number, layout in enumerate(layouts):
        with h5py.File(f'{folder}/{format}-{number}', 'w', libver=(format, 'latest')) as f:
            options = eval(layout)
            g = f.create_group('fclib_local')
            g['spacedim'] = np.array([2], 'i4')
            W = g.create_group('W')
            for name, value in dict(m=m, n=m, nz=m).items(): W[name] = np.array([value], 'i4')
            for name, x in dict(p=k.astype('i4'), i=k.astype('>i8')[::-1], x=(k * 0.5 + 1)).items():
                # For integers it is a number of bits, 0 for as many as they need.
                if 'scaleoffset' in options: options['scaleoffset'] = 2 if name == 'x' else 0
                W.create_dataset(name, data=x, **options)
            g.create_dataset('vectors/q', data=-(k % 7.0), **options)
            if 'scaleoffset' in options: options = {}
            g.create_dataset('vectors/mu', data=(k[:nc] % 8) * 0.125, dtype='f2', **options)
            g['info/title'] = 'layout'
            for j in range(20): g['info'].attrs[f'more{j}'] = j
            if format != 'earliest': g['info'].attrs['long'] = np.zeros(20000)
            g['info'].attrs['numberOfDegreeOfFreedom'] = np.array([7], 'i4')
            # More than a C int, which no file of ours could hold.
            g['info'].attrs['numberOfInvolvedDS'] = np.array([4160749567], 'u4')
            for j in range(40): W[f'more{j}'] = j
"#;

#[test]
fn every_layout_of_hdf5_is_read() {
    if !h5py() {
        return;
    }
    let layouts = [
        "{}",
        "dict(chunks=(7,), maxshape=(None,), compression='gzip', shuffle=True, fletcher32=True)",
        "dict(chunks=(2000,), maxshape=(2000,))",
        "dict(chunks=(64,))",
        "dict(chunks=(1,), maxshape=(5000,))",
        "dict(chunks=(1,), maxshape=(None,))",
        "dict(chunks=(7,), compression='gzip')",
        "dict(chunks=(2000,), maxshape=(2000,), compression='gzip', shuffle=True)",
        "dict(chunks=(50,), compression='lzf', fletcher32=True)",
        "dict(chunks=(64,), scaleoffset=2)",
    ];
    let folder = tempfile::tempdir().unwrap();
    let mut python = Command::new("python3");
    let made = python.args(["-c", LAYOUTS]).arg(folder.path()).args(layouts).output().unwrap();
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    for format in ["earliest", "v108", "v110", "latest"] {
        for (number, layout) in layouts.iter().enumerate() {
            let path = folder.path().join(format!("{format}-{number}"));
            let content = Fclib.read(&path).unwrap_or_else(|e| panic!("{format} {layout}: {e}"));
            assert_eq!(content.info.title.as_deref(), Some("layout"));
            assert_eq!((content.info.dofs, content.info.involved_ds), (Some(7), None));
            let Friction::Local2(p) = contacts(&content) else { panic!("{format} {layout}") };
            let m = 1400;
            let w = p.W.to_csc();
            for k in 0..m {
                assert_eq!(w.get(m - 1 - k, k), k as f64 * 0.5 + 1.0, "{format} {layout} {k}");
                assert_eq!((p.q[k], p.mu[k / 2]), (-((k % 7) as f64), (k / 2 % 8) as f64 * 0.125));
            }
            if number > 1 {
                continue;
            }
            // What is added keeps the rest, as the C library reads it.
            let dump = || sorted_lines(Command::new("python3").args(["-c", DUMP]).arg(&path));
            let rest = |dump: String| -> Vec<String> {
                let lines = dump.lines().filter(|line| !line.starts_with("/solution"));
                lines.map(String::from).collect()
            };
            let before = rest(dump());
            let solution = stored(None, vec![0.5; m], vec![0.25; m], vec![]);
            fclib::write_solution(&path, &solution).unwrap_or_else(|e| panic!("{layout}: {e}"));
            assert_eq!(rest(dump()), before, "{format} {layout}");
            assert_eq!(Fclib.read(&path).unwrap().solution, Some(solution));
        }
    }
}

#[test]
fn indices_of_chunks_in_many_parts_are_read() {
    // Mostly empty: entries that were not written are zeros at (0, 0). Secondary blocks and pages of both kinds of arrays; a B-tree of several levels.
    const MAKE: &str = r#"
import sys, h5py, numpy as np
folder, last = sys.argv[1], 200000
at = [0, 3, 4, 50, 1000, 70000, 131072, 150000, last - 1]
for format in ['earliest', 'v110', 'latest']:
    for kind, options in dict(endless=dict(maxshape=(None,)), fixed={}, plane={}).items():
        with h5py.File(f'{folder}/{format}-{kind}', 'w', libver=(format, 'latest')) as f:
            g = f.create_group('fclib_local')
            g['spacedim'] = np.array([2], 'i4')
            W = g.create_group('W')
            for name, value in dict(m=20, n=20, nz=last).items(): W[name] = np.array([value], 'i4')
            for name in 'pix':
                kind_of = 'f8' if name == 'x' else 'i4'
                if kind == 'plane':
                    d = W.create_dataset(name, shape=(400, last // 400), dtype=kind_of, chunks=(3, 50), maxshape=(None, None))
                else:
                    d = W.create_dataset(name, shape=(last,), dtype=kind_of, chunks=(1,), **options)
                for k, place in enumerate(at):
                    d[np.unravel_index(place, d.shape)] = k + 1
            g['vectors/q'] = np.zeros(20)
            g['vectors/mu'] = np.ones(10)
"#;
    if !h5py() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let made = Command::new("python3").args(["-c", MAKE]).arg(folder.path()).output().unwrap();
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    for format in ["earliest", "v110", "latest"] {
        for kind in ["endless", "fixed", "plane"] {
            let path = folder.path().join(format!("{format}-{kind}"));
            let content = Fclib.read(&path).unwrap_or_else(|e| panic!("{format} {kind}: {e}"));
            let Friction::Local2(p) = contacts(&content) else { panic!("{format} {kind}") };
            let w = p.W.to_csc();
            for k in 0..20 {
                let expected = if (1..10).contains(&k) { k as f64 } else { 0.0 };
                assert_eq!(w.get(k, k), expected, "{format} {kind} {k}");
            }
        }
    }
}

#[test]
fn a_solution_written_again_does_not_make_the_file_larger() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("again.hdf5");
    for mut content in contents() {
        content.solution = None;
        Fclib.write(&path, &content).unwrap();
        let (v, m, p) = crate::common::sizes(&content.problem);
        let point = |x: f64| {
            let v = v.map(|n| vec![x; n]);
            stored(v, vec![x + 1.0; m], vec![x + 2.0; m], vec![x; p])
        };
        fclib::write_solution(&path, &point(0.0)).unwrap();
        let first = std::fs::read(&path).unwrap();
        for k in 1..=20 {
            fclib::write_solution(&path, &point(k.into())).unwrap();
            let bytes = std::fs::read(&path).unwrap();
            assert_eq!(bytes.len(), first.len(), "at the {k}th time");
            content.solution = Some(point(k.into()));
            assert_same(&Fclib.read(&path).unwrap(), &content);
        }
        // Bytes change where the values stand, and nowhere else.
        fclib::write_solution(&path, &point(0.0)).unwrap();
        assert!(std::fs::read(&path).unwrap() == first);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}

#[test]
fn other_names_of_a_solution_keep_their_values() {
    const MAKE: &str = r#"
import sys, h5py, numpy as np
path, kind = sys.argv[1:]
with h5py.File(path, 'r+') as f:
    u, r = np.full(4, 0.5), np.full(4, 0.25)
    f['solution/u'] = u
    f['solution/r'] = f['solution/u'] if kind == 'one for both' else r
    if kind == 'shared': f['mine'] = f['solution/r']
    if kind == 'group': f['mine'] = f['solution']
    if kind == 'more': f['solution/notes'] = 1
    if kind == 'single': del f['solution/u']; f['solution/u'] = u.astype('f4')
"#;
    if !h5py() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    for kind in ["one for both", "shared", "group", "more", "single"] {
        let path = crate::common::local_tree().save(folder.path());
        let mut python = Command::new("python3");
        let made = python.args(["-c", MAKE]).arg(&path).arg(kind).output().unwrap();
        assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
        let dump = || sorted_lines(Command::new("python3").args(["-c", DUMP]).arg(&path));
        let mine = |dump: &str| -> Vec<String> {
            dump.lines().filter(|line| line.starts_with("/mine")).map(String::from).collect()
        };
        let before = mine(&dump());
        let mut size = None;
        for k in 0..3 {
            let x = f64::from(k);
            let solution = stored(None, vec![x; 4], vec![-x; 4], vec![]);
            fclib::write_solution(&path, &solution).unwrap();
            assert_eq!(Fclib.read(&path).unwrap().solution, Some(solution), "{kind}");
            assert_eq!(mine(&dump()), before, "{kind}");
            let now = std::fs::metadata(&path).unwrap().len();
            assert_eq!(*size.get_or_insert(now), now, "{kind}");
        }
    }
}

#[test]
fn h5dump_reads_what_is_written() {
    if Command::new("h5dump").arg("--version").output().is_err() {
        crate::common::skipped("h5dump is not here");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("file.hdf5");
    for content in contents() {
        Fclib.write(&path, &content).unwrap();
        let dump = |dataset: &str| {
            sorted_lines(Command::new("h5dump").args(["-m", "%a", "-d", dataset]).arg(&path))
        };
        let root = if content.problem.kind().name().contains("local") { "local" } else { "global" };
        let spacedim = dump(&format!("/fclib_{root}/spacedim"));
        assert!(
            spacedim.contains("H5T_STD_I32LE") && spacedim.contains("( 1 ) / ( 1 )"),
            "{spacedim}"
        );
        let title = if root == "local" { "title" } else { "description" };
        let title = dump(&format!("/fclib_{root}/info/{title}"));
        assert!(title.contains("H5T_STR_NULLTERM") && title.contains("SCALAR"), "{title}");
        // Every dataset of the file is readable.
        let all = sorted_lines(Command::new("h5dump").arg(&path));
        assert!(all.contains("DATASET \"mu\"") && !all.contains("error"), "{all}");
    }
}

/// Rows with bounds, infinite ones too, come back bit for bit; half of the bounds, or too few, are refused by name.
#[test]
fn bounds_of_scalar_rows_pass_through() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rows.hdf5");
    let mut rows = local();
    let bounds =
        Bounds { lower: vec![f64::NEG_INFINITY, -0.0], upper: vec![1e-300, f64::INFINITY] };
    rows.rows.as_mut().unwrap().bounds = bounds;
    let mut wide = global();
    wide.rows.as_mut().unwrap().bounds = Bounds { lower: vec![-2.5], upper: vec![2.5] };
    let files =
        [ProblemFile::new(Friction::Local2(rows)), ProblemFile::new(Friction::Global3(wide))];
    for file in files {
        file.write(&path).unwrap();
        assert_eq!(ProblemFile::read(&path).unwrap(), file);
    }
}

//! The file of a simulation: what is written is read, by us and by h5py; what is damaged or does not fit is one line.

use std::path::Path;
use std::process::Command;

use crate::motion::run;
use nonsmooth_io::Format;
use nonsmooth_io::IoError;
use nonsmooth_io::fclib::Fclib;
use nonsmooth_io::trajectory::{Named, Trajectory, Writer, holds};

const NAME: &str = "run.h5";

fn bytes(run: &Trajectory) -> Vec<u8> {
    run.to_bytes(Path::new(NAME)).unwrap()
}

fn parse(bytes: &[u8]) -> Result<Trajectory, IoError> {
    Trajectory::parse(Path::new(NAME), bytes)
}

/// `Debug` tells NaN from all else and -0 from 0, and its digits are those of one number only.
fn assert_same(a: &Trajectory, b: &Trajectory) {
    assert_eq!(format!("{a:?}"), format!("{b:?}"));
}

#[test]
fn what_is_written_is_read_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(NAME);
    let whole = run(40);
    let bare = Trajectory { checkpoint: None, steps: vec![], ..run(3) };
    for content in [&whole, &run(0), &run(1), &bare, &Trajectory::default()] {
        content.write(&path).unwrap();
        assert_same(&Trajectory::read(&path).unwrap(), content);
        assert!(holds(&std::fs::read(&path).unwrap()));
    }
    assert_eq!(whole.frames[3].contacts[1].world_impulse(), [-0.5, 0.25, 2.0]);
    // Nothing is left beside it.
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    // The same run is the same file.
    assert_eq!(bytes(&whole), bytes(&run(40)));
}

/// The run with an elastic solid of two nodes.
fn with_elastic(frames: usize) -> Trajectory {
    let mut run = run(frames);
    run.elastic = vec!["Gummi".into()];
    run.bodies.push(Named { name: "Gummi".into(), fixed: false });
    for frame in &mut run.frames {
        frame.bodies.push(frame.bodies[1]);
        frame.elastic = vec![vec![[frame.time, 0.0, -0.0], [1.0, f64::NAN, frame.time]]];
    }
    run
}

#[test]
fn nodes_of_elastic_solids_are_read_bit_for_bit() {
    for content in [with_elastic(40), with_elastic(0)] {
        assert_same(&parse(&bytes(&content)).unwrap(), &content);
    }
    let mut other = with_elastic(3);
    other.frames[2].elastic[0].pop();
    let error = other.to_bytes(Path::new(NAME)).unwrap_err().to_string();
    assert!(error.contains("/frames[2]"), "{error}");
    let unnamed = Trajectory { elastic: vec!["other".into()], ..with_elastic(1) };
    let error = unnamed.to_bytes(Path::new(NAME)).unwrap_err().to_string();
    assert!(error.contains("/elastic"), "{error}");
}

#[test]
fn long_runs_fill_several_chunks_and_are_compressed() {
    let long = run(4000);
    let file = bytes(&long);
    assert_same(&parse(&file).unwrap(), &long);
    // 13 reals of each body and 26 of each contact, not compressed.
    let contacts: usize = long.frames.iter().map(|f| f.contacts.len()).sum();
    let plain = 8 * (4000 * 3 * 13 + 26 * contacts);
    assert!(2 * file.len() < plain, "{} of {plain} bytes", file.len());
}

/// What stands in a folder, by name.
fn files(folder: &Path) -> Vec<(std::ffi::OsString, Vec<u8>)> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().map(Result::unwrap);
    let mut all: Vec<_> =
        entries.map(|e| (e.file_name(), std::fs::read(e.path()).unwrap())).collect();
    all.sort();
    all
}

#[test]
fn a_run_that_grows_is_written_by_parts_and_read_as_one() {
    let folder = tempfile::tempdir().unwrap();
    let (path, parts) = (folder.path().join(NAME), folder.path().join("run.h5.parts"));
    let all = run(140);
    let until = |k: usize| Trajectory {
        frames: all.frames[..k].to_vec(),
        steps: all.steps[..2 * k].to_vec(),
        ..all.clone()
    };
    let mut writer = Writer::new(&path, false);
    let (mut written, mut before) = (0, vec![]);
    for k in 1..=140 {
        let now = until(k);
        writer.flush(&now).unwrap();
        assert_same(&Trajectory::read(&path).unwrap(), &now);
        let left = files(&parts);
        assert!(left.len() <= 7 * 3, "{} parts of {k} flushes", left.len());
        let fresh = left.iter().filter(|file| !before.contains(*file));
        written += fresh.map(|file| parse(&file.1).unwrap().steps.len()).sum::<usize>();
        // A writer that is killed before it removes what it has joined leaves both.
        for (name, content) in &before {
            if !left.iter().any(|(other, _)| other == name) {
                std::fs::write(parts.join(name), content).unwrap();
                assert_same(&Trajectory::read(&path).unwrap(), &now);
                std::fs::remove_file(parts.join(name)).unwrap();
            }
        }
        before = left;
    }
    // Each row is written a few times, not once a flush.
    assert!(written <= 3 * all.steps.len(), "{written} rows");
    // Nothing new is nothing written; the end is one file.
    writer.flush(&all).unwrap();
    assert_eq!(files(&parts), before);
    // What a writer had begun that was killed goes with the parts: no process has this number.
    let begun = nonsmooth_io::beside(&parts.join("000000000007.h5")).unwrap();
    let name = begun.file_name().unwrap().to_str().unwrap();
    let own = format!(".{}-", std::process::id());
    let left = name.replace(&own, &format!(".{}-", u32::MAX));
    assert_ne!(left, name);
    std::fs::write(parts.join(left), "half of a part").unwrap();
    writer.finish(&all).unwrap();
    assert!(!parts.exists());
    assert_same(&Trajectory::parse(&path, &std::fs::read(&path).unwrap()).unwrap(), &all);

    // Another run in the same place has nothing of the one before, nor are its parts taken for its own.
    let mut writer = Writer::new(&path, true);
    writer.flush(&until(1)).unwrap();
    writer.flush(&until(9)).unwrap();
    assert_eq!(files(&parts).len(), 1);
    let other = Trajectory { scene: "another".into(), ..until(1) };
    Writer::new(&path, false).flush(&other).unwrap();
    assert_same(&Trajectory::read(&path).unwrap(), &other);
    std::fs::create_dir_all(&parts).unwrap();
    std::fs::write(parts.join("000000000003.h5"), &before[0].1).unwrap();
    assert_same(&Trajectory::read(&path).unwrap(), &other);
    // What a person put there stays; a part with a gap before it is an error that names it.
    std::fs::write(parts.join("notes.txt"), "mine").unwrap();
    until(1).write(&path).unwrap();
    assert_eq!(files(&parts).len(), 1);
    let last = before.last().unwrap();
    std::fs::write(parts.join(&last.0), &last.1).unwrap();
    let error = Trajectory::read(&path).unwrap_err().to_string();
    assert!(error.contains("a part of the same run that goes on after step 2"), "{error}");
}

#[test]
fn a_scene_that_was_changed_is_noticed() {
    let mut other = run(2);
    let digest = other.digest();
    assert_eq!(digest.len(), 64);
    other.scene = other.scene.replace("Käfer", "Kälte");
    assert_ne!(digest, other.digest());
    let mut file = bytes(&run(2));
    let at = file.windows(6).position(|w| w == "Käfer".as_bytes()).unwrap();
    file[at..at + 6].copy_from_slice("Kälte".as_bytes());
    let message = parse(&file).unwrap_err().to_string();
    let (expected, found) = (digest, other.digest());
    assert_eq!(
        message,
        format!("run.h5: /scene/text: expected a scene of SHA-256 {expected}, found {found}")
    );
}

#[test]
fn what_does_not_fit_is_refused_and_the_old_file_stays() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(NAME);
    run(5).write(&path).unwrap();
    let mut body = run(5);
    body.frames[3].bodies.pop();
    let mut contact = run(5);
    contact.frames[4].contacts[2].b = 3;
    let mut name = run(5);
    name.bodies[1].name = "a\0b".into();
    let mut scene = run(5);
    scene.scene.push('\0');
    let wrong = [
        (body, "/frames[3]: expected 3 bodies, as in /bodies/name, found 2"),
        (contact, "/contacts of frame 4, [2]: expected one of 3 bodies, found 3"),
        (name, "/bodies/name[1]: expected a text without NUL characters, found one with"),
        (scene, "/scene/text: expected a text without NUL characters, found one with"),
    ];
    for (run, expected) in wrong {
        let message = run.write(&path).unwrap_err().to_string();
        assert_eq!(message, format!("{}: {expected}", path.display()));
    }
    assert_same(&Trajectory::read(&path).unwrap(), &run(5));
    let nowhere = folder.path().join("no such folder").join(NAME);
    assert!(run(1).write(nowhere).unwrap_err().to_string().contains("a file that can be written"));
}

#[test]
fn other_files_are_told_what_they_are() {
    for other in [&b""[..], b"\x89HDF\r\n\x1a\n", b"title = 1"] {
        assert!(!holds(other));
        let message = parse(other).unwrap_err().to_string();
        assert!(message.starts_with("run.h5: ") && !message.contains('\n'), "{message}");
    }
    // And a trajectory is no problem.
    let message = Fclib.parse(Path::new(NAME), &bytes(&run(1))).unwrap_err().to_string();
    assert!(message.contains("found a trajectory, which `nonsmooth play` reads"), "{message}");
}

#[test]
fn damaged_files_are_one_line_that_names_the_place() {
    let file = bytes(&run(6));
    for length in (0..file.len()).step_by(97).chain([file.len() - 1]) {
        let message = parse(&file[..length]).unwrap_err().to_string();
        assert!(message.starts_with("run.h5: ") && !message.contains('\n'), "{message}");
    }
    // Each byte once, by turns in several ways: what is read all the same must not be data that a checksum covers.
    let (mut noticed, mut read) = (0, 0);
    for at in (0..file.len()).step_by(3) {
        let mut damaged = file.clone();
        damaged[at] ^= [0xff, 0x01, 0x80][at / 3 % 3];
        match parse(&damaged) {
            Ok(_) => read += 1,
            Err(e) => {
                let message = e.to_string();
                assert!(message.starts_with("run.h5: ") && !message.contains('\n'), "{message}");
                noticed += 1;
            }
        }
    }
    assert!(noticed > 4 * read, "{noticed} noticed, {read} read");
    // In the middle of the compressed positions.
    let long = bytes(&run(4000));
    let mut damaged = long.clone();
    damaged[long.len() / 3] ^= 0x10;
    let message = parse(&damaged).unwrap_err().to_string();
    assert!(
        message.starts_with("run.h5: /bodies/") || message.starts_with("run.h5: /contacts/"),
        "{message}"
    );
}

/// The snippet of docs/simulation/output.md in other words.
const READ: &str = r#"
import sys, h5py, numpy as np
with h5py.File(sys.argv[1]) as f:
    z = f["bodies/position"][:, 1, 2]
    first, last = f["contacts/offset"][3:5]
    names = [name.decode() for name in f["bodies/name"]]
    statuses = [f["steps/status_name"][k].decode() for k in f["steps/status"][:3]]
    print(f["trajectory_version"][0], f["scene/text"][()].decode().splitlines()[0])
    print(names, z.shape, repr(float(z[4])))
    print(f["contacts/r"][first:last][1].tolist(), f["contacts/status"][first:last].tolist(), f["contacts/key"][last - 1].tolist())
    print(statuses, np.isnan(f["steps/residual"][3]), f["energy/potential"][7])
    print(bytes(f["checkpoint/state"][:3]), f["frames/time"][39], f["bodies/fixed"][:].tolist())
    print(f["bodies/position"].compression, f["bodies/position"].fletcher32)
"#;

#[test]
fn h5py_reads_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(NAME);
    let run = run(40);
    run.write(&path).unwrap();
    let here = Command::new("python3").args(["-c", "import h5py"]).output();
    if !here.is_ok_and(|o| o.status.success()) {
        crate::common::skipped("python3 with h5py is not here");
        return;
    }
    let output = Command::new("python3").args(["-c", READ]).arg(&path).output().unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    let z = run.frames[4].bodies[1].position[2];
    let expected = format!(
        "2 title = \"Käfer\"\n\
         ['floor', 'Kugel ⌀ 0.4', ''] (40,) {z:?}\n\
         [-0.5, 0.25, 2.0] [0, 1, 2] [0, 3, 7, 4294967293]\n\
         ['solved', 'solver: limit', 'solver: limit'] True 7.0\n\
         b'\\x00\\x01\\x02' {:?} [1, 0, 0]\n\
         gzip True\n",
        run.frames[39].time
    );
    assert_eq!(said, expected, "{}", String::from_utf8_lossy(&output.stderr));
}

/// Chunks of more than 65 535 rows or columns are none that libhdf5 2.0 opens as the library writes them.
#[test]
fn long_tables_are_read_by_all() {
    let mut long = run(2);
    long.checkpoint.as_mut().unwrap().state = (0..200_000_u32).map(|k| (k % 251) as u8).collect();
    for _ in 0..70_000 {
        long.bodies.push(Named { name: String::new(), fixed: false });
    }
    for frame in &mut long.frames {
        let (body, count) = (frame.bodies[1], long.bodies.len());
        frame.bodies.resize(count, body);
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(NAME);
    long.write(&path).unwrap();
    assert_same(&Trajectory::read(&path).unwrap(), &long);
    let walk = "import h5py, sys\nwith h5py.File(sys.argv[1]) as f:\n    f.visititems(lambda *_: None)\n    print(f['checkpoint/state'].shape, f['bodies/position'][1, 70002].shape)";
    let here = Command::new("python3").args(["-c", "import h5py"]).output();
    if !here.is_ok_and(|o| o.status.success()) {
        crate::common::skipped("python3 with h5py is not here");
        return;
    }
    let output = Command::new("python3").args(["-c", walk]).arg(&path).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert_eq!(said, "(200000,) (3,)\n", "{}", String::from_utf8_lossy(&output.stderr));
}

//! Input files one by one, and output files that are sure to be writable before any work is done.

use std::collections::{HashMap, HashSet};
use std::fs::{self, OpenOptions};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use nonsmooth_bench::campaign::Journal;
use nonsmooth_io::{
    About, FORMATS, Format, ProblemFile, beside, format, listed, named, sniffed, writer,
};
use nonsmooth_problem::Kind;
use nonsmooth_solve::{Limit, Limits, Status, guard, spelling};
use serde_json::json;

use crate::{Exit, output};

/// Runs a command on each file. A mistake in one is reported and the others still run; the worst exit counts.
pub fn each(
    files: &[PathBuf],
    json: bool,
    mut one: impl FnMut(usize, &Path) -> Result<Exit, String>,
) -> Exit {
    let mut worst = Exit::Solved;
    for (k, file) in files.iter().enumerate() {
        let exit = one(k, file).unwrap_or_else(|mistake| {
            output::error(&mistake);
            if json {
                let line = json!({"file": file.to_string_lossy(), "error": mistake});
                output::print(&format!("{line}\n"));
            }
            Exit::Mistake
        });
        worst = worst.max(exit);
    }
    worst
}

/// The help of an argument that names files of problems of some kinds.
pub fn help(what: &str, kinds: impl Fn(Kind) -> bool) -> String {
    format!("{what}: {}", listed(kinds))
}

/// The name that stands for a standard stream.
const STREAM: &str = "-";
/// What the standard input is called in messages.
const INPUT: &str = "standard input";

/// Whether a name stands for a standard stream: where files are read the input, where they are written the output.
pub fn is_stream(path: &Path) -> bool {
    path.as_os_str() == STREAM
}

/// All that comes on the standard input, which is read once.
fn input() -> Result<&'static [u8], String> {
    static BYTES: OnceLock<Result<Vec<u8>, String>> = OnceLock::new();
    let read = || {
        let mut bytes = vec![];
        let done = std::io::stdin().lock().read_to_end(&mut bytes);
        done.map(|_| bytes).map_err(|e| format!("{INPUT}: expected a problem, found: {e}"))
    };
    BYTES.get_or_init(read).as_deref().map_err(Clone::clone)
}

/// Reads a file, or the standard input.
pub fn read(file: &Path) -> Result<ProblemFile, String> {
    if is_stream(file) {
        return ProblemFile::parse(INPUT, input()?).map_err(|e| e.to_string());
    }
    ProblemFile::read(file).map_err(|e| format!("{e}{}", meant(file).unwrap_or_default()))
}

/// What the format of a file that was read is.
pub fn about(file: &Path) -> Result<&'static About, String> {
    let format = match is_stream(file) {
        true => sniffed(Path::new(INPUT), input()?),
        false => format(file),
    };
    format.map(|format| format.about()).map_err(|e| e.to_string())
}

/// A format by its extension, as `--format` names it.
pub fn format_named(extension: &str) -> Result<&'static dyn Format, String> {
    named(extension).ok_or_else(|| {
        let known = FORMATS.into_iter().filter(|f| !f.about().writes.is_empty());
        let known: Vec<_> = known.flat_map(|f| f.about().extensions).copied().collect();
        format!("expected one of {}", known.join(", "))
    })
}

/// The format in which a problem of a kind is written to `path`: the one that is asked for, or that of the name. To the standard output: that of the
/// file that was read, or the first that can hold the problem.
pub fn target_format(
    option: &str,
    path: &Path,
    asked: Option<&'static dyn Format>,
    kind: Kind,
    read: Option<&Path>,
) -> Result<&'static dyn Format, String> {
    let writes = |format: &&dyn Format| format.about().writes.contains(&kind);
    if let Some(format) = asked {
        return Some(format).filter(writes).ok_or_else(|| {
            let (name, kind) = (format.about().name, kind.name());
            let path = path.display();
            format!("{option} {path}: expected a format that holds a problem {kind}, found {name}")
        });
    }
    if !is_stream(path) {
        return writer(path, kind).map_err(|e| format!("{option} {e}"));
    }
    let same = read.and_then(|file| about(file).ok()).and_then(|about| named(about.extensions[0]));
    // Matrix Market has several files.
    let one_file = |format: &&dyn Format| writes(format) && format.about().one_file;
    let found = same.filter(one_file).or_else(|| FORMATS.into_iter().find(one_file));
    found.ok_or_else(|| format!("{option} {STREAM}: expected a format that holds {}", kind.name()))
}

/// Writes a file, or to the standard output.
pub fn write(
    path: &Path,
    format: &'static dyn Format,
    content: &ProblemFile,
) -> Result<(), String> {
    if !is_stream(path) {
        return format.write(path, content).map_err(|e| e.to_string());
    }
    let bytes = format.to_bytes(Path::new("standard output"), content);
    output::print_bytes(&bytes.map_err(|e| e.to_string())?);
    Ok(())
}

/// A whole number, written as `1000` or `1e3`.
pub fn whole(text: &str) -> Result<usize, String> {
    // Up to 2^53 a float says which whole number it is.
    let is_whole = |x: &f64| x.fract() == 0.0 && (0.0..=9e15).contains(x);
    let float = || text.parse().ok().filter(is_whole).map(|x| x as usize);
    let number = text.parse().ok().or_else(float);
    number.ok_or_else(|| "expected a whole number such as 1000 or 1e3".into())
}

/// A limit on the wall clock.
pub fn time_limit(seconds: Option<f64>) -> Result<Option<f64>, String> {
    match seconds {
        Some(t) if t.is_nan() || t < 0.0 => {
            Err(format!("--time-limit: expected a number of seconds of at least 0, found {t}"))
        }
        t => Ok(t),
    }
}

/// A size such as `500M` or `4G`, in bytes.
pub fn size(text: &str) -> Result<u64, String> {
    let expected = || "expected a size such as 500M or 4G".to_owned();
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let unit = match text[digits.len()..].to_uppercase().trim_end_matches(['I', 'B']) {
        "" => 1.0,
        "K" => 1024.0,
        "M" => 1024.0 * 1024.0,
        "G" => 1024.0 * 1024.0 * 1024.0,
        "T" => 1024.0 * 1024.0 * 1024.0 * 1024.0,
        _ => return Err(expected()),
    };
    match digits.parse::<f64>().map_err(|_| expected())? * unit {
        bytes if (1.0..1e18).contains(&bytes) => Ok(bytes as u64),
        _ => Err(expected()),
    }
}

/// Bytes of a file that are read in no time.
const SHORT: u64 = 1 << 20;

/// Reads a file within the limits; the limit if it came first.
pub fn read_within(file: &Path, limits: &Limits) -> Result<Result<ProblemFile, Limit>, String> {
    // A pipe may keep a reader waiting.
    let short = |m: fs::Metadata| m.is_file() && m.len() <= SHORT;
    if fs::metadata(file).map_or(!is_stream(file), short) {
        return read(file).map(Ok);
    }
    let path = file.to_path_buf();
    match guard::run(limits, || {}, move |_| read(&path)) {
        Ok(content) => content.map(Ok),
        Err(limit) => Ok(Err(limit)),
    }
}

/// ` (did you mean …?)` of a file that is not there and has one of nearly its name beside it.
fn meant(missing: &Path) -> Option<String> {
    if missing.exists() {
        return None;
    }
    let folder = missing.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let names = fs::read_dir(folder).ok()?.flatten();
    let names = names.map(|entry| entry.file_name().to_string_lossy().into_owned());
    let near = spelling::nearest(&missing.file_name()?.to_string_lossy(), names)?;
    Some(format!(" (did you mean `{}`?)", missing.with_file_name(near).display()))
}

/// When a limit came that came early.
pub const WHILE_READ: &str = "while the file was read";

/// Says that a limit came before there was anything else to say of a file.
pub fn late(file: &Path, json: bool, limit: Limit, meanwhile: &str) -> Exit {
    let status = Status::Limit(limit);
    let message = format!("{status} {meanwhile}");
    let name = file.to_string_lossy();
    output::print(&if json {
        let line = json!({"file": name, "status": status.name(), "message": message});
        format!("{line}\n")
    } else {
        format!("{name}: {message}\n")
    });
    Exit::NotSolved
}

/// A name says what the file is: it ends in one of `extensions`.
pub fn ends_in(option: &str, path: &Path, extensions: &[&str]) -> Result<(), String> {
    let is = |end: &&str| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(end));
    if extensions.iter().any(is) {
        return Ok(());
    }
    let ends = match extensions {
        [one] => format!(".{one}, the one format there is"),
        several => several.iter().map(|e| format!(".{e}")).collect::<Vec<_>>().join(" or "),
    };
    Err(format!("{option} {}: expected a file name that ends in {ends}", path.display()))
}

/// A tolerance on the relative residual.
pub fn tolerance(tol: f64) -> Result<f64, String> {
    match is_tolerance(tol) {
        true => Ok(tol),
        false => Err(format!("--tol: expected {TOLERANCE}, found {tol:?}")),
    }
}

/// What a tolerance is.
pub const TOLERANCE: &str = "a positive number of at most 1";

/// Whether it is one that solves take.
pub fn is_tolerance(tol: f64) -> bool {
    Limits { tolerance: tol, ..Limits::default() }.validate().is_ok()
}

/// Where the results of `files` go: `to` itself for one file, else a file of the same name in the directory
/// `to`, with `extension` in place of its own where one is given. Each place is checked to be writable; problems alone, which keep their extension, may go to
/// the standard output.
pub fn targets(
    option: &str,
    to: &Path,
    files: &[PathBuf],
    extension: Option<&str>,
) -> Result<Vec<PathBuf>, String> {
    if is_stream(to) && files.len() == 1 && extension.is_none() {
        return Ok(vec![to.into()]);
    }
    let is_folder = to.is_dir() || to.to_string_lossy().ends_with(std::path::is_separator);
    if !is_folder {
        if files.len() > 1 {
            return Err(format!(
                "{option} {}: expected a directory (existing or ending in `/`) for {} files, found a file name",
                to.display(),
                files.len()
            ));
        }
        writable(option, to)?;
        return Ok(vec![to.into()]);
    }
    folder(option, to)?;
    let mut seen = HashSet::new();
    files
        .iter()
        .map(|file| {
            let name = file
                .file_name()
                .ok_or_else(|| format!("{}: expected a file, found a directory", file.display()))?;
            let mut path = to.join(name);
            if let Some(extension) = extension {
                path.set_extension(extension);
            }
            if !seen.insert(path.clone()) {
                let path = path.display();
                return Err(format!(
                    "{option} {path}: expected one input for it, found two of that name"
                ));
            }
            writable(option, &path)?;
            Ok(path)
        })
        .collect()
}

/// Makes the directory `path` unless it exists.
pub fn folder(option: &str, path: &Path) -> Result<(), String> {
    no_stream(option, path)?;
    fs::create_dir_all(path).map_err(|e| refusal(option, path, "a directory", e))
}

/// What cannot be written to the standard output is not taken for a file of that name.
pub fn no_stream(option: &str, path: &Path) -> Result<(), String> {
    match is_stream(path) {
        true => Err(format!(
            "{option} {STREAM}: expected a name, found that of the standard output, where only problems, scenes and pictures of `draw` go"
        )),
        false => Ok(()),
    }
}

/// As [`writable`], or the standard output.
pub fn writable_or_stream(option: &str, path: &Path) -> Result<(), String> {
    if is_stream(path) { Ok(()) } else { writable(option, path) }
}

/// A file can be put at `path`: found out before hours of work, not after.
pub fn writable(option: &str, path: &Path) -> Result<(), String> {
    no_stream(option, path)?;
    let refused = |e| refusal(option, path, "a file that can be written", e);
    match fs::metadata(path) {
        Ok(there) if !there.is_file() => {
            let path = path.display();
            let what = if there.is_dir() { "a directory" } else { "a device" };
            return Err(format!("{option} {path}: expected a file, found {what}"));
        }
        Ok(_) => {
            let there = OpenOptions::new().append(true).open(path).map_err(refused)?;
            if matches!(there.try_lock(), Err(fs::TryLockError::WouldBlock)) {
                let found = match Journal::is(path) {
                    true => "a campaign writes",
                    false => "another program has open",
                };
                let path = path.display();
                return Err(format!(
                    "{option} {path}: expected a file of its own, found one that {found}"
                ));
            }
        }
        Err(_) => {}
    }
    // New files are completed beside the old ones, so the directory must let them in.
    let Some(probe) = beside(path) else {
        let path = path.display();
        return Err(format!("{option} {path}: expected a file name, found none"));
    };
    let made = OpenOptions::new().write(true).create_new(true).open(&probe);
    made.map_err(refused)?;
    fs::remove_file(&probe).map_err(refused)
}

/// Writes a text file. It is completed beside the old one and then renamed: a full disk costs the new text only.
pub fn write_text(option: &str, path: &Path, text: &str) -> Result<(), String> {
    let plain = !path.exists() || path.is_file();
    // A link stays a link to the new content.
    let target = path.canonicalize().unwrap_or_else(|_| path.into());
    let written = match beside(&target).filter(|_| plain) {
        Some(temporary) => {
            let done = fs::write(&temporary, text).and_then(|()| fs::rename(&temporary, &target));
            done.inspect_err(|_| drop(fs::remove_file(&temporary)))
        }
        None => fs::write(path, text),
    };
    written.map_err(|e| refusal(option, path, "a file that can be written", e))
}

fn refusal(option: &str, path: &Path, expected: &str, cause: std::io::Error) -> String {
    let path = path.display();
    format!("{option} {path}: expected {expected}, found: {cause}")
}

/// The place that a path leads to, where there need not be a file. Standard streams have none.
fn resolved(path: &Path) -> Option<PathBuf> {
    if is_stream(path) {
        return None;
    }
    path.canonicalize().ok().or_else(|| {
        let parent = path.parent().filter(|p| !p.as_os_str().is_empty());
        let parent = parent.unwrap_or(Path::new(".")).canonicalize().ok()?;
        Some(parent.join(path.file_name().unwrap_or_default()))
    })
}

/// Whether two paths lead to the same file, which need not exist. Standard streams are none.
pub fn same(a: &Path, b: &Path) -> bool {
    resolved(a).is_some_and(|a| resolved(b) == Some(a))
}

/// What is written leads to files of their own, and so do those that stand there beside it and are written too: to none that is read, and no two options to the same.
pub fn apart<'a, 'b>(
    read: impl IntoIterator<Item = &'a Path>,
    written: impl IntoIterator<Item = (&'b str, &'b Path)>,
) -> Result<(), String> {
    let mut taken: HashMap<PathBuf, String> = read
        .into_iter()
        .filter_map(resolved)
        .map(|path| (path, "one that is read".into()))
        .collect();
    for (option, path) in written {
        for part in nonsmooth_io::parts(path) {
            let Some(place) = resolved(&part) else { continue };
            if let Some(other) = taken.insert(place, format!("that of {option}")) {
                let beside = match part == path {
                    true => String::new(),
                    false => format!(" for {} beside it", part.display()),
                };
                let path = path.display();
                return Err(format!(
                    "{option} {path}: expected a file of its own{beside}, found {other}"
                ));
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn locked_files_are_of_a_campaign_only_where_they_begin_as_one() {
        let path = std::env::temp_dir().join(format!("nonsmooth-locked-{}", std::process::id()));
        for (text, words) in [
            ("\u{89}HDF", "found one that another program has open"),
            ("{\"line\":\"campaign\",\"id\":\"a\"}\n", "found one that a campaign writes"),
        ] {
            fs::write(&path, text).unwrap();
            let held = fs::File::open(&path).unwrap();
            held.try_lock().unwrap();
            let said = writable("--out", &path).unwrap_err();
            // Where locks keep readers away nothing is known of the file.
            assert!(said.ends_with(words) || cfg!(windows), "{said}");
            drop(held);
            assert!(writable("--out", &path).is_ok());
        }
        fs::remove_file(&path).unwrap();
    }

    #[test]
    fn sizes_have_units() {
        assert_eq!(size("500M"), Ok(500 << 20));
        assert_eq!(size("1.5GiB"), Ok(3 << 29));
        assert_eq!((size("64k"), size("1000")), (Ok(64 << 10), Ok(1000)));
        for text in ["", "G", "4X", "-4G", "0", "nan", "inf", "1e30"] {
            assert!(size(text).is_err(), "{text}");
        }
    }

    #[test]
    fn whole_numbers_are_integers_or_floats_without_fraction() {
        for (text, n) in
            [("0", 0), ("1000", 1000), ("1e3", 1000), ("2.5E1", 25), ("1e15", 1e15 as usize)]
        {
            assert_eq!(whole(text), Ok(n));
        }
        assert_eq!(whole(&usize::MAX.to_string()), Ok(usize::MAX));
        for text in ["1.5", "-1", "1e400", "nan", "inf", "", "ten"] {
            assert!(whole(text).is_err(), "{text}");
        }
    }
}

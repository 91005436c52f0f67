//! Files come whole: completed beside the old one, then renamed.

use std::ffi::{OsStr, OsString};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant, SystemTime};

use crate::IoError;

/// What a writer needs of the system.
pub(crate) const WRITABLE: &str = "a file that can be written";

/// What marks a file as one that this crate completes.
const MARK: &str = ".nonsmooth-tmp";
/// No file takes as long to write: what is older was left by a writer of which nothing else is known.
const ABANDONED: Duration = Duration::from_secs(24 * 3600);

/// A folder is looked through once in this time.
const AGAIN: Duration = Duration::from_secs(1);

/// What stands at `path`, if anything, may be replaced by a file.
pub(crate) fn check_target(path: &Path) -> Result<(), IoError> {
    let refuse = |cause| Err(IoError::os(path, WRITABLE, cause));
    match std::fs::metadata(path) {
        Ok(target) if target.is_dir() => refuse(ErrorKind::IsADirectory.into()),
        Ok(target) if !target.is_file() => {
            refuse(std::io::Error::other("no regular file (a device, pipe or socket)"))
        }
        // If there is nothing, or it cannot be asked, then writing shows what the system allows.
        _ => Ok(()),
    }
}

/// Lets `fill` make a file beside `path`, then gives it that name.
pub(crate) fn replace(
    path: &Path,
    fill: impl FnOnce(&Path) -> Result<(), IoError>,
) -> Result<(), IoError> {
    struct Temporary(PathBuf);
    impl Drop for Temporary {
        fn drop(&mut self) {
            // After the renaming there is nothing of that name left to remove.
            let _ = std::fs::remove_file(&self.0);
        }
    }

    check_target(path)?;
    let os = |e| IoError::os(path, WRITABLE, e);
    // A link stays a link to the new content.
    let target = path.canonicalize().unwrap_or_else(|_| path.into());
    let Some(temporary) = beside(&target) else {
        return Err(os(ErrorKind::IsADirectory.into()));
    };
    let temporary = Temporary(temporary);
    fill(&temporary.0)?;
    // The content must be on the disk before the name is.
    std::fs::OpenOptions::new()
        .write(true)
        .open(&temporary.0)
        .and_then(|f| f.sync_all())
        .map_err(os)?;
    std::fs::rename(&temporary.0, &target).map_err(os)
}

/// A new name in the folder of a file, under which to complete what is then renamed to it; `None` if the path names no file.
///
/// Removes what killed processes left in that folder under such names: those whose process is gone, if it ran on this machine, and those older than
/// a day. The name is `.FILE.PROCESS-NUMBER-MACHINE.nonsmooth-tmp`; files of other names are never touched.
pub fn beside(path: &Path) -> Option<PathBuf> {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let mut name = OsString::from(".");
    name.push(path.file_name()?);
    let count = COUNT.fetch_add(1, Ordering::Relaxed);
    name.push(format!(".{}-{count}-{:016x}{MARK}", std::process::id(), machine()));
    let path = path.with_file_name(name);
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    // Who writes thousands of files there need not look at all of them each time.
    static LAST: Mutex<Option<(PathBuf, Instant)>> = Mutex::new(None);
    let mut last = LAST.lock().unwrap_or_else(PoisonError::into_inner);
    if !last.as_ref().is_some_and(|(at, when)| at == folder && when.elapsed() < AGAIN) {
        clean(folder);
        *last = Some((folder.into(), Instant::now()));
    }
    Some(path)
}

/// Tells machines, and spaces of process numbers on them, from each other; 0 where nothing is known.
fn machine() -> u64 {
    static MACHINE: OnceLock<u64> = OnceLock::new();
    *MACHINE.get_or_init(|| {
        let boot = std::fs::read("/proc/sys/kernel/random/boot_id");
        let space = std::fs::read_link("/proc/self/ns/pid");
        let (Ok(boot), Ok(space)) = (boot, space) else { return 0 };
        let bytes = boot.iter().chain(space.as_os_str().as_encoded_bytes());
        // FNV-1a: the same for every build.
        let hash = bytes.fold(0xcbf2_9ce4_8422_2325, |hash: u64, &byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
        });
        hash.max(1)
    })
}

/// Removes what killed processes left in a folder. That it cannot be is no mistake of who writes there.
pub(crate) fn clean(folder: &Path) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let Some((process, machine)) = writer(&entry.file_name()) else { continue };
        let Ok(file) = entry.metadata() else { continue };
        let age = file.modified().ok().and_then(|t| SystemTime::now().duration_since(t).ok());
        let old = age.is_some_and(|age| age > ABANDONED);
        if file.is_file() && (old || gone(process, machine)) {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// The process and the machine in the name of a file that is being completed; `None`: it is another's.
fn writer(name: &OsStr) -> Option<(u32, u64)> {
    let name = name.to_str()?.strip_prefix('.')?.strip_suffix(MARK)?;
    let (_, tag) = name.rsplit_once('.')?;
    let mut parts = tag.split('-');
    let (process, count, machine) = (parts.next()?, parts.next()?, parts.next()?);
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|c| c.is_ascii_digit());
    if parts.next().is_some() || !digits(process) || !digits(count) || machine.len() != 16 {
        return None;
    }
    Some((process.parse().ok()?, u64::from_str_radix(machine, 16).ok()?))
}

/// Whether a process is known to have ended.
fn gone(process: u32, on: u64) -> bool {
    on != 0 && on == machine() && !Path::new(&format!("/proc/{process}")).exists()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_killed_process_left_is_removed_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let here = format!("{:016x}", machine());
        // No Linux has a process of this number.
        let dead = u32::MAX;
        let own = std::process::id();
        let left = format!(".a.toml.{dead}-0-{here}{MARK}");
        let kept = [
            format!(".a.toml.{own}-7-{here}{MARK}"),
            format!(".a.toml.{dead}-0-00000000deadbeef{MARK}"),
            format!(".a.toml.{dead}.tmp"),
            format!("a.toml.{dead}-0-{here}{MARK}"),
            format!(".a.toml.{dead}-x-{here}{MARK}"),
            format!(".{MARK}"),
            "a.toml".into(),
        ];
        for name in kept.iter().chain([&left]) {
            std::fs::write(at(name), "").unwrap();
        }
        std::fs::create_dir(at(&format!(".b.{dead}-0-{here}{MARK}"))).unwrap();
        replace(&at("a.toml"), |path| {
            std::fs::write(path, "new").unwrap();
            Ok(())
        })
        .unwrap();
        let exists = |name: &String| at(name).exists();
        assert!(kept.iter().all(exists) && at(&format!(".b.{dead}-0-{here}{MARK}")).exists());
        // Elsewhere nothing is known of processes.
        assert_eq!(exists(&left), machine() == 0);
        assert_eq!(
            std::fs::read_dir(folder.path()).unwrap().count(),
            kept.len() + 1 + usize::from(machine() == 0)
        );

        // Of another machine only what is old goes.
        let old = SystemTime::now() - 2 * ABANDONED;
        let foreign = at(&kept[1]);
        std::fs::File::options().write(true).open(&foreign).unwrap().set_modified(old).unwrap();
        clean(folder.path());
        assert!(!foreign.exists() && exists(&kept[0]));
    }
}

//! Files come whole: completed beside the old one, then renamed.

use std::ffi::OsString;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use crate::IoError;

/// What a writer needs of the system.
pub(crate) const WRITABLE: &str = "a file that can be written";

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
    static COUNT: AtomicU64 = AtomicU64::new(0);

    check_target(path)?;
    let os = |e| IoError::os(path, WRITABLE, e);
    // A link stays a link to the new content.
    let target = path.canonicalize().unwrap_or_else(|_| path.into());
    let Some(name) = target.file_name() else {
        return Err(os(ErrorKind::IsADirectory.into()));
    };
    let mut temporary = OsString::from(".");
    temporary.push(name);
    temporary.push(format!(
        ".{}-{}.tmp",
        std::process::id(),
        COUNT.fetch_add(1, Ordering::Relaxed)
    ));
    let temporary = Temporary(target.with_file_name(temporary));
    fill(&temporary.0)?;
    // The content must be on the disk before the name is.
    std::fs::OpenOptions::new()
        .write(true)
        .open(&temporary.0)
        .and_then(|f| f.sync_all())
        .map_err(os)?;
    std::fs::rename(&temporary.0, &target).map_err(os)
}

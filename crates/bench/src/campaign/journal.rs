//! The file of a campaign: lines are appended and never lost, and a campaign that was ended goes on from it.

use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use crate::record::{Campaign, Line};
use crate::runs::Runs;

/// How every file of runs begins.
const BEGINNING: &[u8] = b"{\"line\":\"campaign\"";

/// A file of runs that is open for more. Nobody else can open it as a journal meanwhile.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
    campaign: String,
}

impl Journal {
    /// Begins a new file with `campaign`.
    ///
    /// Errors: the file exists and is not empty; what the system refuses.
    pub fn create(path: &Path, campaign: &Campaign) -> Result<Self, String> {
        let mut journal = Self::open(path)?;
        unused(path).map_err(|e| format!("{e}; --resume goes on with it"))?;
        journal.campaign.clone_from(&campaign.id);
        journal.append(&Line::Campaign(campaign.clone()))?;
        Ok(journal)
    }

    /// Opens a file to go on with it; a file that does not exist, or is empty, is begun. Returns what is in it.
    ///
    /// A last line that is torn is cut off. The plan must be the same except for solvers, tolerances and jobs. On
    /// another machine, or with another version of the program, the runs to come name a campaign of their own.
    /// Errors: the plan differs, by what; a file that does not read; what the system refuses.
    pub fn resume(path: &Path, campaign: &Campaign) -> Result<(Self, Runs), String> {
        if std::fs::metadata(path).map_or(0, |m| m.len()) == 0 {
            return Ok((Self::create(path, campaign)?, Runs::default()));
        }
        let mut journal = Self::open(path)?;
        let text = std::fs::read(path).map_err(|e| refusal(path, &e))?;
        let whole = text.iter().rposition(|&b| b == b'\n').map_or(0, |k| k + 1);
        let cut = |file: &File| file.set_len(whole as u64).map_err(|e| refusal(path, &e));
        if whole == 0 && (text.starts_with(BEGINNING) || BEGINNING.starts_with(&text)) {
            // Killed within the very first line: nothing is lost by beginning again.
            cut(&journal.file)?;
            drop(journal);
            return Ok((Self::create(path, campaign)?, Runs::default()));
        }
        let there =
            Runs::parse(path, &String::from_utf8_lossy(&text)).map_err(|e| e.to_string())?;
        cut(&journal.file)?;
        journal.file.seek(SeekFrom::End(0)).map_err(|e| refusal(path, &e))?;
        // Campaigns without a plan are foreign, and joined.
        let plan = there.campaigns.iter().rev().find_map(|c| c.plan.as_ref());
        if let (Some(plan), Some(new)) = (plan, campaign.plan.as_ref())
            && let Some(differs) = plan.difference(new)
        {
            return Err(format!("{}: to resume, expected {differs}", path.display()));
        }
        let same = |c: &&Campaign| c.machine == campaign.machine && c.program == campaign.program;
        match there.campaigns.iter().rfind(same) {
            Some(same) => journal.campaign.clone_from(&same.id),
            None => {
                journal.campaign.clone_from(&campaign.id);
                journal.append(&Line::Campaign(campaign.clone()))?;
            }
        }
        Ok((journal, there))
    }

    fn open(path: &Path) -> Result<Self, String> {
        // A device or a pipe keeps nothing, and may never end.
        if std::fs::metadata(path).is_ok_and(|m| !m.is_file()) {
            let path = path.display();
            return Err(format!("{path}: expected a file, found a directory, device or pipe"));
        }
        let file = OpenOptions::new()
            .read(true)
            .append(true)
            .create(true)
            .open(path)
            .map_err(|e| refusal(path, &e))?;
        file.try_lock().map_err(|e| match e {
            std::fs::TryLockError::WouldBlock => {
                let path = path.display();
                format!(
                    "{path}: expected a file of its own, found one that another campaign writes"
                )
            }
            std::fs::TryLockError::Error(e) => refusal(path, &e),
        })?;
        Ok(Self { path: path.into(), file, campaign: String::new() })
    }

    /// Whether a file can be read and begins as one of runs does.
    pub fn is(path: &Path) -> bool {
        let mut begins = [0; BEGINNING.len()];
        let read = File::open(path).and_then(|mut file| file.read_exact(&mut begins));
        read.is_ok() && begins == BEGINNING
    }

    /// The name of the campaign that new runs belong to.
    pub fn campaign(&self) -> &str {
        &self.campaign
    }

    /// Appends a line; it is on the disk when this returns.
    ///
    /// Errors: what the system refuses, such as a full disk. Half a line is cut off again.
    pub fn append(&mut self, line: &Line) -> Result<(), String> {
        let mut text = serde_json::to_string(line).map_err(|e| e.to_string())?;
        text.push('\n');
        let before = self.file.metadata().map(|m| m.len());
        let written = self.file.write_all(text.as_bytes()).and_then(|()| self.file.sync_data());
        written.map_err(|e| {
            let _ = before.and_then(|before| self.file.set_len(before));
            refusal(&self.path, &e)
        })
    }
}

/// Refuses a file that is there and not empty: it may be a campaign.
pub fn unused(path: &Path) -> Result<(), String> {
    match std::fs::metadata(path).map_or(0, |m| m.len()) {
        0 => Ok(()),
        length => Err(format!("{}: expected a new file, found {length} bytes", path.display())),
    }
}

fn refusal(path: &Path, cause: &std::io::Error) -> String {
    format!("{}: {cause}", path.display())
}

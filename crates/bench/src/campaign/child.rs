//! One job in one worker process, watched from outside.

use std::collections::VecDeque;
use std::ffi::OsString;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use super::job::{Job, Said, Task};

/// Seconds that reading a problem and preparing the judge may take.
const LOADING: f64 = 600.0;
/// How often a watcher looks whether the campaign goes on.
const LOOK: Duration = Duration::from_millis(50);
/// Bytes of a worker's last words that are kept.
const LAST_WORDS: usize = 2000;

/// How a worker is started: a program that calls [`serve`](super::serve).
#[derive(Debug, Clone)]
pub struct WorkerCommand {
    /// The program.
    pub program: PathBuf,
    /// Its arguments.
    pub arguments: Vec<OsString>,
}

/// What became of a job.
#[derive(Debug, Clone, PartialEq)]
pub enum End {
    /// The worker did it, with this last word.
    Said(Said),
    /// The worker did not stop in time and was ended; its last sign of life, and seconds in the solve.
    Hung {
        /// Iterations done at the last sign of life.
        iteration: Option<u64>,
        /// The smallest residual by then.
        best: Option<f64>,
        /// Seconds from the beginning of the solve to its end.
        seconds: f64,
        /// Whether it hung before any solve began.
        loading: bool,
    },
    /// The worker ran out of memory.
    OutOfMemory(String),
    /// The worker died.
    Crashed(String),
    /// The campaign was cancelled, and the worker ended.
    Cancelled,
}

/// Has a worker do a job; `grace` as in [`Setup`](super::Setup).
///
/// Errors: the worker cannot be started.
pub fn work(
    command: &WorkerCommand,
    job: &Job,
    grace: f64,
    cancel: &AtomicBool,
) -> std::io::Result<End> {
    let mut process = Command::new(&command.program);
    process.args(&command.arguments);
    process.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    // A terminal's Ctrl-C is for the campaign, which then ends its workers; it is no crash of theirs.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut process, 0);
    let mut child = process.spawn()?;
    // The worker lives as long as its standard input is open.
    let mut stdin = child.stdin.take();
    if let Some(stdin) = &mut stdin {
        let text = serde_json::to_string(job).unwrap_or_default();
        // If it is gone already, its exit status tells why.
        let _ = writeln!(stdin, "{text}").and_then(|()| stdin.flush());
    }
    let said = lines(&mut child);
    let last_words = last_words(&mut child);
    let end = listen(&said, job, grace, cancel);
    let ended_here = !matches!(end, Some(End::Said(_)) | None);
    if ended_here {
        let _ = child.kill();
    }
    // With its standard input closed a worker that is done, or hangs while it ends, goes.
    drop(stdin);
    let status = child.wait()?;
    let words = last_words.join().unwrap_or_default();
    Ok(end.unwrap_or_else(|| autopsy(status, &words, job.memory_limit)))
}

/// Listens until the last word, the deadline or the end; `None` if the worker went without a last word.
fn listen(said: &Receiver<Said>, job: &Job, grace: f64, cancel: &AtomicBool) -> Option<End> {
    let seconds = |s: f64| Duration::try_from_secs_f64(s).unwrap_or(Duration::MAX);
    let far = |now: Instant, s: f64| now.checked_add(seconds(s));
    let limit = match job.task {
        Task::Describe => 0.0,
        Task::Solve { time_limit, .. } => time_limit,
    };
    let mut deadline = far(Instant::now(), LOADING);
    let mut solving: Option<Instant> = None;
    let mut judge = 0.0;
    let (mut iteration, mut best) = (None, None);
    loop {
        if cancel.load(Ordering::Relaxed) {
            return Some(End::Cancelled);
        }
        if deadline.is_some_and(|d| Instant::now() > d) {
            let seconds = solving.map_or(0.0, |s| s.elapsed().as_secs_f64());
            return Some(End::Hung { iteration, best, seconds, loading: solving.is_none() });
        }
        match said.recv_timeout(LOOK) {
            Ok(Said::Loaded { judge: s }) => judge = s,
            Ok(Said::Solving) => {
                let now = Instant::now();
                solving = Some(now);
                (iteration, best) = (None, None);
                // Each solve prepares the judge again, on a machine that may be busier now.
                deadline = far(now, limit + limit.max(grace) + 2.0 * judge);
            }
            Ok(Said::Progress { iteration: i, best: b, .. }) => {
                (iteration, best) = (Some(i), b);
            }
            Ok(last) => return Some(End::Said(last)),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return None,
        }
    }
}

/// The worker's lines as they come. Lines that are none of ours are passed over.
fn lines(child: &mut Child) -> Receiver<Said> {
    let (send, receive) = channel();
    if let Some(out) = child.stdout.take() {
        std::thread::spawn(move || {
            for line in BufReader::new(out).lines().map_while(Result::ok) {
                if let Ok(said) = serde_json::from_str(&line)
                    && send.send(said).is_err()
                {
                    break;
                }
            }
        });
    }
    receive
}

/// The end of what the worker writes to its standard error.
fn last_words(child: &mut Child) -> std::thread::JoinHandle<String> {
    let err = child.stderr.take();
    std::thread::spawn(move || {
        let mut kept = VecDeque::new();
        let mut buffer = [0; 1024];
        let Some(mut err) = err else { return String::new() };
        while let Ok(n @ 1..) = err.read(&mut buffer) {
            kept.extend(&buffer[..n]);
            kept.drain(..kept.len().saturating_sub(LAST_WORDS));
        }
        let kept: Vec<u8> = kept.into();
        String::from_utf8_lossy(&kept).into_owned()
    })
}

/// What a worker died of.
fn autopsy(status: ExitStatus, words: &str, memory_limit: u64) -> End {
    let gib = memory_limit as f64 / f64::from(1 << 30);
    // What Rust's allocator and the system's loader say where memory is refused.
    let memory = ["memory allocation of", "Cannot allocate memory", "capacity overflow"];
    if let Some(line) = words.lines().find(|l| memory.iter().any(|m| l.contains(m))) {
        return End::OutOfMemory(format!("{} (limit {gib:.2} GiB)", line.trim()));
    }
    #[cfg(unix)]
    if let Some(signal) = std::os::unix::process::ExitStatusExt::signal(&status) {
        if signal == nix::libc::SIGKILL {
            let message = "killed from outside (signal 9), as systems do where memory is short";
            return End::OutOfMemory(message.into());
        }
        // Ctrl-C reaches the whole group: a worker that has yet to learn to ignore it dies of it, before the campaign is told.
        if signal == nix::libc::SIGINT {
            return End::Cancelled;
        }
        return End::Crashed(format!("signal {signal}{}", said(words)));
    }
    End::Crashed(format!("{status}{}", said(words)))
}

/// The first line of the last words that tells something.
fn said(words: &str) -> String {
    let lines = || words.lines().map(str::trim).filter(|l| !l.is_empty());
    // A panic says where, then what.
    let panicked = lines().skip_while(|l| !l.contains("panicked at")).take(2);
    let telling: Vec<_> = panicked.collect();
    let text = match telling.as_slice() {
        [] => lines().next_back().unwrap_or_default().to_owned(),
        all => all.join(" "),
    };
    if text.is_empty() { text } else { format!(": {text}") }
}

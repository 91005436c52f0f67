//! The two streams: results on stdout, mistakes on stderr. Neither ever makes the program panic.

use std::io::{ErrorKind, Write};
use std::sync::atomic::{AtomicBool, Ordering};

/// What a shell reports of a program that a closed pipe has ended.
const BROKEN_PIPE: i32 = 128 + 13;

/// Whether results go to files too.
static FILED: AtomicBool = AtomicBool::new(false);

/// What is computed goes to files too: the program goes on where nobody reads any more what it prints.
pub fn results_are_filed() {
    FILED.store(true, Ordering::Relaxed);
}

/// Prints a result. Ends the program, without a word, where nobody reads any more (`| head -1`) and nothing goes to files.
pub fn print(text: &str) {
    print_bytes(text.as_bytes());
}

/// As [`print()`], of a result that need not be text.
pub fn print_bytes(bytes: &[u8]) {
    printed(std::io::stdout().lock().write_all(bytes));
}

/// Ends the program as [`print()`] does where what was written to stdout did not arrive.
pub fn printed(written: std::io::Result<()>) {
    if let Err(e) = written.and_then(|()| std::io::stdout().flush()) {
        if e.kind() == ErrorKind::BrokenPipe {
            if FILED.load(Ordering::Relaxed) {
                return;
            }
            std::process::exit(BROKEN_PIPE);
        }
        error(&format!("standard output: {e}"));
        std::process::exit(crate::Exit::Mistake as i32);
    }
}

/// Prints what is no mistake and must not stand among the results.
pub fn remark(text: &str) {
    let _ = std::io::stderr().lock().write_all(text.as_bytes());
}

/// Prints one line `error: ...`.
pub fn error(message: &str) {
    // Texts from files and arguments may hold anything; a message is one line.
    let line = message.replace(char::is_control, " ");
    let _ = writeln!(std::io::stderr().lock(), "error: {line}");
}

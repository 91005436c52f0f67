//! The two streams: results on stdout, mistakes on stderr. Neither ever makes the program panic.

use std::io::{ErrorKind, Write};

/// What a shell reports of a program that a closed pipe has ended.
const BROKEN_PIPE: i32 = 128 + 13;

/// Prints a result. Ends the program, without a word, where nobody reads any more (`| head -1`).
pub fn print(text: &str) {
    print_bytes(text.as_bytes());
}

/// As [`print()`], of a result that need not be text.
pub fn print_bytes(bytes: &[u8]) {
    let mut out = std::io::stdout().lock();
    let written = out.write_all(bytes).and_then(|()| out.flush());
    if let Err(e) = written {
        if e.kind() == ErrorKind::BrokenPipe {
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

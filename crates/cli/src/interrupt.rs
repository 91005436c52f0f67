//! Ctrl-C: the first press ends the solve with the best iterate, the second ends the program.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

const INTERRUPTED: i32 = 128 + 2;

/// A flag that the first Ctrl-C sets. To be called once.
pub fn flag() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let pressed = flag.clone();
    // Without a handler Ctrl-C ends the program at once, which is no mistake of the caller's.
    let _ = ctrlc::set_handler(move || {
        if pressed.swap(true, Ordering::Relaxed) {
            std::process::exit(INTERRUPTED);
        }
    });
    flag
}

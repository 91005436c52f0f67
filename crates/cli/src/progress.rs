//! The progress bar of a solve: on a terminal only, and cheap between two pictures.

use std::io::IsTerminal;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use nonsmooth_solve::Progress;

use crate::report::number;

/// Seconds between two pictures.
const INTERVAL: f64 = 1.0 / 12.0;
/// A solve that is done sooner needs no bar.
const PATIENCE: f64 = 0.25;
/// The bar's full length.
const FULL: u64 = 1000;

/// Shows how many of the orders of magnitude between the first residual and the tolerance are won.
pub struct Bar {
    bar: Option<ProgressBar>,
    tolerance: f64,
    first: Option<f64>,
    next: f64,
}

impl Bar {
    /// A bar for one solve; none unless stderr is a terminal and `wanted`.
    pub fn new(name: &str, tolerance: f64, wanted: bool) -> Self {
        let bar = (wanted && std::io::stderr().is_terminal()).then(|| {
            let bar = ProgressBar::with_draw_target(Some(FULL), ProgressDrawTarget::hidden());
            let style = ProgressStyle::with_template("{prefix} [{bar:24.blue}] {msg}");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            bar.set_prefix(name.to_owned());
            bar
        });
        Self {
            next: if bar.is_some() { PATIENCE } else { f64::INFINITY },
            bar,
            tolerance,
            first: None,
        }
    }

    /// Takes note of a step. Mostly one comparison: a step may take 100 ns.
    #[inline]
    pub fn watch(&mut self, progress: &Progress) {
        if progress.seconds >= self.next {
            self.show(progress);
        }
    }

    #[cold]
    fn show(&mut self, progress: &Progress) {
        self.next = progress.seconds + INTERVAL;
        let Some(bar) = &self.bar else { return };
        if self.first.is_none() {
            bar.set_draw_target(ProgressDrawTarget::stderr_with_hz(15));
        }
        let first = *self.first.get_or_insert(progress.best.max(1.0));
        let won = (first / progress.best).ln() / (first / self.tolerance).ln();
        bar.set_message(format!(
            "{} iterations, residual {} (best {}, target {:e}), {}",
            progress.iteration,
            number(progress.judged.relative),
            number(progress.best),
            self.tolerance,
            clock(progress.seconds)
        ));
        bar.set_position((won.clamp(0.0, 1.0) * FULL as f64) as u64);
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

fn clock(seconds: f64) -> String {
    if seconds < 60.0 {
        return format!("{seconds:.1} s");
    }
    let whole = Duration::from_secs_f64(seconds).as_secs();
    format!("{}:{:02} min", whole / 60, whole % 60)
}

//! The progress bar of a solve: on a terminal only, and cheap between two pictures.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use nonsmooth_solve::Progress;

use crate::report::number;

/// Seconds between two pictures.
const INTERVAL: f64 = 1.0 / 12.0;
/// A solve that is done sooner needs no bar.
const PATIENCE: f64 = 0.25;
/// Letters that the name of a file may take.
const NAME: usize = 16;
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
        let bar = bar(name, wanted);
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
            "{}, iteration {}, best {} of {:e}",
            clock(progress.seconds),
            progress.iteration,
            number(progress.best),
            self.tolerance,
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

/// How far a run of a simulation has come.
pub struct RunBar {
    bar: Option<ProgressBar>,
    end: f64,
    begun: Instant,
    next: f64,
}

impl RunBar {
    /// A bar for a run until `end`, s; none unless stderr is a terminal and `wanted`.
    pub fn new(name: &str, end: f64, wanted: bool) -> Self {
        let bar = bar(name, wanted);
        let next = if bar.is_some() { PATIENCE } else { f64::INFINITY };
        Self { bar, end, begun: Instant::now(), next }
    }

    /// Takes note of a step that ended at t, with so many active contacts and this residual.
    pub fn watch(&mut self, t: f64, active: usize, residual: f64) {
        let Some(bar) = &self.bar else { return };
        let seconds = self.begun.elapsed().as_secs_f64();
        if seconds < self.next {
            return;
        }
        self.next = seconds + INTERVAL;
        bar.set_draw_target(ProgressDrawTarget::stderr_with_hz(15));
        let share = (t / self.end).clamp(0.0, 1.0);
        let left = if share > 0.0 { seconds / share - seconds } else { f64::NAN };
        let left = if left.is_finite() { format!(", {} left", clock(left)) } else { String::new() };
        let residual = number(residual);
        bar.set_message(format!(
            "t = {t:.4} of {} s, {active} contacts, residual {residual}{left}",
            self.end
        ));
        bar.set_position((share * FULL as f64) as u64);
    }
}

impl Drop for RunBar {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// A bar that is not shown yet; none unless stderr is a terminal and `wanted`.
fn bar(name: &str, wanted: bool) -> Option<ProgressBar> {
    (wanted && std::io::stderr().is_terminal()).then(|| {
        let bar = ProgressBar::with_draw_target(Some(FULL), ProgressDrawTarget::hidden());
        // The wide message is cut to what is left of the line.
        let style = ProgressStyle::with_template("{prefix} [{bar:8.blue}] {wide_msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        bar.set_prefix(shortened(name));
        bar
    })
}

/// A name with its middle left out where it is long.
fn shortened(name: &str) -> String {
    let letters: Vec<char> = name.chars().collect();
    let Some(excess) = letters.len().checked_sub(NAME).filter(|&n| n > 0) else {
        return name.into();
    };
    let begin = &letters[..(NAME - 1) / 2];
    let end = &letters[begin.len() + excess + 1..];
    begin.iter().chain(&['…']).chain(end).collect()
}

fn clock(seconds: f64) -> String {
    if seconds < 60.0 {
        return format!("{seconds:.1} s");
    }
    let whole = Duration::from_secs_f64(seconds).as_secs();
    format!("{}:{:02} min", whole / 60, whole % 60)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_names_lose_their_middle() {
        let whole = "of-16-letters.h5";
        assert_eq!(shortened(whole), whole);
        assert_eq!(shortened("Capsules-i3062-1800-é.hdf5"), "Capsule…0-é.hdf5");
        let long = "x".repeat(300);
        assert_eq!(shortened(&long).chars().count(), NAME);
    }
}

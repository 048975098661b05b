//! How far the work has come and how long it will still take, on stderr.

use std::io::IsTerminal;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// When to show progress.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum ProgressMode {
    /// Only when stderr is a terminal.
    Auto,
    /// Always: a bar on a terminal, lines elsewhere.
    On,
    /// Never.
    Off,
}

/// Seconds between two lines where there is no terminal.
const LINE_EVERY_S: u64 = 2;

/// Shows progress.
pub enum Progress {
    /// Shows nothing.
    Silent,
    /// A bar that redraws itself.
    Bar(ProgressBar),
    /// A line now and then, for logs.
    Lines {
        /// When the work began.
        start: Instant,
        /// Seconds from then until the next line.
        next_s: AtomicU64,
    },
}

impl Progress {
    /// Begins to count.
    pub fn start(mode: ProgressMode) -> Self {
        let terminal = std::io::stderr().is_terminal();
        match mode {
            ProgressMode::Off => return Self::Silent,
            ProgressMode::Auto if !terminal => return Self::Silent,
            ProgressMode::On if !terminal => {
                return Self::Lines {
                    start: Instant::now(),
                    next_s: AtomicU64::new(LINE_EVERY_S),
                }
            }
            ProgressMode::Auto | ProgressMode::On => {}
        }
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr_with_hz(10));
        // The template is ours and right; a bar in another style is no reason to stop.
        if let Ok(style) = ProgressStyle::with_template("{wide_bar} {percent:>3} %  {eta} left") {
            bar.set_style(style);
        }
        Self::Bar(bar)
    }

    /// Takes note of the work done so far and in all; from any thread.
    pub fn report(&self, done: u64, total: u64) {
        match self {
            Self::Silent => {}
            Self::Bar(bar) => {
                if bar.length() != Some(total) {
                    bar.set_length(total);
                }
                bar.set_position(done);
            }
            Self::Lines { start, next_s } => {
                let elapsed = start.elapsed();
                let due = next_s.load(Ordering::Relaxed);
                if elapsed.as_secs() < due || done == 0 {
                    return;
                }
                let next = elapsed.as_secs() + LINE_EVERY_S;
                let order = Ordering::Relaxed;
                // Of all the threads that see the line due, one writes it.
                if next_s.compare_exchange(due, next, order, order).is_ok() {
                    let share = done as f64 / total as f64;
                    let left_s = elapsed.as_secs_f64() * (1.0 - share) / share;
                    eprintln!("progress: {:.0} %, {left_s:.0} s left", 100.0 * share);
                }
            }
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        if let Self::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.finish();
    }
}

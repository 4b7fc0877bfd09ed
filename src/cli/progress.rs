//! Progress on a terminal, warnings, and interruption.

use std::io::{IsTerminal, Write};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::progress::Progress;

/// How often a second the bar is drawn at most.
const REDRAWS_PER_S: u8 = 10;

/// Whether the user has asked the program to stop.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Lets Ctrl-C, and a request to terminate, end the work in good order: what is half-written is removed. The
/// second one ends the program at once.
pub(super) fn catch_interrupts() {
    let caught = ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::Relaxed) {
            std::process::exit(super::INTERRUPTED_STATUS.into());
        }
    });
    // Without a handler Ctrl-C ends the program at once: worse, but no reason not to work.
    drop(caught);
}

/// Whether the user has asked the program to stop.
pub(super) fn interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}

/// A bar for each stage where standard error is a terminal, and warnings as lines; nothing where quiet.
pub(super) struct Terminal {
    quiet: bool,
    draws: bool,
    bar: Mutex<Option<ProgressBar>>,
}

impl Terminal {
    pub(super) fn new(quiet: bool) -> Self {
        Self {
            quiet,
            draws: !quiet && std::io::stderr().is_terminal(),
            bar: Mutex::new(None),
        }
    }

    /// A line about what was done, for whoever is watching; not where quiet.
    pub(super) fn note(&self, sentence: &str) {
        self.with_bar(finish);
        self.warn(sentence);
    }

    fn with_bar<R>(&self, task: impl FnOnce(&mut Option<ProgressBar>) -> R) -> R {
        // A thread that panicked while it held a bar has left nothing in a bad state.
        task(&mut self.bar.lock().unwrap_or_else(std::sync::PoisonError::into_inner))
    }
}

impl Progress for Terminal {
    fn begin(&self, stage: &str, total: u64) {
        if !self.draws {
            return;
        }
        self.with_bar(|bar| {
            finish(bar);
            let target = ProgressDrawTarget::stderr_with_hz(REDRAWS_PER_S);
            let next = ProgressBar::with_draw_target(Some(total), target).with_message(stage.to_string());
            let style = "{msg:>12} {wide_bar} {percent:>3} %  {per_sec}, {eta} left";
            next.set_style(
                ProgressStyle::with_template(style).unwrap_or_else(|_| ProgressStyle::default_bar()),
            );
            *bar = Some(next);
        });
    }

    fn advance(&self, steps: u64) {
        if self.draws {
            self.with_bar(|bar| {
                if let Some(bar) = bar {
                    bar.inc(steps);
                }
            });
        }
    }

    fn warn(&self, sentence: &str) {
        if self.quiet {
            return;
        }
        let line = || {
            // A warning that cannot be shown must not end the work.
            let _ = writeln!(std::io::stderr(), "clipscape: {sentence}");
        };
        self.with_bar(|bar| match bar {
            Some(bar) => bar.suspend(line),
            None => line(),
        });
    }

    fn cancelled(&self) -> bool {
        interrupted()
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        self.with_bar(finish);
    }
}

/// Leaves a stage that was completed on the screen, and wipes one that was not.
fn finish(bar: &mut Option<ProgressBar>) {
    if let Some(bar) = bar.take() {
        if bar.length().is_some_and(|total| bar.position() >= total) {
            bar.abandon();
        } else {
            bar.finish_and_clear();
        }
    }
}

//! What is shown on a terminal while something runs: bars on stderr, nothing where stderr is no
//! terminal or `--quiet` was given.

use std::io::IsTerminal;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::replan;
use crate::vehicle::replace::Step;
use crate::vehicle::transfer::{Direction, Progress};

/// One line of progress.
#[derive(Debug, Clone)]
pub struct Shown {
    bar: ProgressBar,
    quiet: bool,
}

impl Shown {
    /// Progress on stderr, if that is a terminal.
    #[must_use]
    pub fn new(quiet: bool) -> Self {
        let target = if quiet || !std::io::stderr().is_terminal() {
            ProgressDrawTarget::hidden()
        } else {
            ProgressDrawTarget::stderr()
        };
        let bar = ProgressBar::with_draw_target(None, target);
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg}") {
            bar.set_style(style);
        }
        Self { bar, quiet }
    }

    /// Whether only results and errors are wanted.
    #[must_use]
    pub fn is_quiet(&self) -> bool {
        self.quiet
    }

    /// Says what is being done.
    pub fn doing(&self, what: impl Into<String>) {
        self.bar.enable_steady_tick(Duration::from_millis(100));
        self.bar.set_message(what.into());
    }

    /// Removes the line.
    pub fn clear(&self) {
        self.bar.finish_and_clear();
    }

    /// Warnings, on stderr, above the line.
    pub fn warn<'a>(&self, warnings: impl IntoIterator<Item = &'a String>) {
        for warning in warnings {
            if !self.quiet {
                tracing::warn!("{warning}");
            }
        }
    }

    /// A transfer's progress.
    pub fn transfer(&self, progress: Progress) {
        let what = match progress.direction {
            Direction::Download => "downloading",
            Direction::Upload => "uploading",
        };
        let Progress { mission_type, done, total, .. } = progress;
        self.doing(format!("{what} {mission_type} {done}/{total}"));
    }

    /// A replacement's progress.
    pub fn step(&self, step: Step) {
        let (what, progress) = match step {
            Step::Reading(progress) => ("reading", progress),
            Step::Uploading(progress) => ("uploading", progress),
            Step::Proving(progress) => ("reading back", progress),
            Step::PuttingBack(progress) => ("putting back", progress),
        };
        let Progress { mission_type, done, total, .. } = progress;
        self.doing(format!("{what} {mission_type} {done}/{total}"));
    }

    /// Planning's progress.
    pub fn planning(&self, progress: &replan::Progress<'_>) {
        self.doing(progress.to_string());
    }
}

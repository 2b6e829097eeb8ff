//! What a command knows about its run besides the outcome.

use std::time::Duration;

use crate::replan::Options;

/// The circumstances of one run of a command.
#[derive(Debug, Clone, Copy)]
pub struct Run<'a> {
    /// What it was planned or judged with.
    pub options: &'a Options,
    /// What was odd about the input, a sentence each, besides what the verdict says itself.
    pub warnings: &'a [String],
    /// The time that reading the input took.
    pub load: Duration,
    /// The time of the whole run.
    pub total: Duration,
}

//! What is said and shown about a plan or a judgement: values in, text out.
//!
//! - [`run`]: what a command knows about its run besides the outcome;
//! - [`stretch`]: each leg of the original mission with what is now flown for it;
//! - [`json`]: the documents of `--json`;
//! - [`summary`]: the same for people, on a terminal of 80 columns;
//! - [`picture`]: the map with obstacles, candidates, old and new route, as SVG or PNG;
//! - `page`: the HTML report, with a map to zoom, tables and all rounds;
//! - [`files`]: both, for commands that write files.
//!
//! Nothing here plans, judges or does I/O.

pub mod files;
pub mod json;
pub(crate) mod page;
pub mod picture;
pub mod run;
pub mod stretch;
pub mod summary;
pub mod text;

pub use files::{Report, ReportError};
pub use run::Run;

#[cfg(test)]
pub(crate) mod samples;

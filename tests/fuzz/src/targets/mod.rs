//! What is fuzzed: everything that takes bytes from outside. Each function must return for any
//! bytes at all; what it checks besides is that what was let in is sound. The integration tests run
//! the same functions over the corpora in this directory.

mod files;
mod items;
mod line;
mod service;

/// A target by the name of its corpus.
pub(crate) type Target = (&'static str, fn(&[u8]));

/// All of them.
pub(crate) const ALL: [Target; 11] = [
    ("files", files::scenario),
    ("configuration", files::configuration),
    ("mission_items", items::mission),
    ("fence_items", items::fence),
    ("frames", line::frames),
    ("download", line::download),
    ("upload", line::upload),
    ("plan_files", line::plan_files),
    ("device", service::device),
    ("results", service::results),
    ("service", service::service),
];

/// Equality in which NaN is NaN.
fn debug(value: &impl std::fmt::Debug) -> String {
    format!("{value:?}")
}

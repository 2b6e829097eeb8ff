//! libFuzzer's entry: the target is the one that `QUAV_FUZZ_TARGET` names. One program for all of
//! them, as each further one would link PROJ again.

#![no_main]

use std::sync::LazyLock;

mod targets;

static TARGET: LazyLock<fn(&[u8])> = LazyLock::new(|| {
    let wanted = std::env::var("QUAV_FUZZ_TARGET").unwrap_or_default();
    let target = targets::ALL.iter().find(|(name, _)| *name == wanted);
    let names: Vec<&str> = targets::ALL.iter().map(|(name, _)| *name).collect();
    target.unwrap_or_else(|| panic!("QUAV_FUZZ_TARGET must be one of {names:?}")).1
});

libfuzzer_sys::fuzz_target!(|data: &[u8]| TARGET(data));

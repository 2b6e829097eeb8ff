//! libFuzzer's entry: the target is the one that `QUAV_FUZZ_TARGET` names. One program for all of
//! them, as each further one would link PROJ again. `main` is libFuzzer's own; see `../run`.

#![no_main]

use std::ffi::c_int;
use std::sync::LazyLock;

mod targets;

static TARGET: LazyLock<fn(&[u8])> = LazyLock::new(|| {
    let wanted = std::env::var("QUAV_FUZZ_TARGET").unwrap_or_default();
    let target = targets::ALL.iter().find(|(name, _)| *name == wanted);
    let names: Vec<&str> = targets::ALL.iter().map(|(name, _)| *name).collect();
    target.unwrap_or_else(|| panic!("QUAV_FUZZ_TARGET must be one of {names:?}")).1
});

/// Called by libFuzzer for each input. A panic ends the process here, and libFuzzer keeps the input.
#[unsafe(no_mangle)]
extern "C" fn LLVMFuzzerTestOneInput(data: *const u8, size: usize) -> c_int {
    let input = if size == 0 {
        &[]
    } else {
        // SAFETY: libFuzzer hands over `size` readable bytes that nobody writes during the call.
        unsafe { std::slice::from_raw_parts(data, size) }
    };
    TARGET(input);
    0
}

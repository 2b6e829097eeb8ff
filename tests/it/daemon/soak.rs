//! A minute of everything at once, of which `make soak` does an hour.

use std::path::Path;
use std::process::Command;

use crate::sitl::python;

#[test]
fn a_short_soak_holds() {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("sitl/soak.py");
    let output = Command::new(python())
        .arg(script)
        .args(["--quavd", env!("CARGO_BIN_EXE_quavd"), "--minutes", "0.3", "--rest", "20"])
        .output()
        .unwrap();
    let text = [&output.stdout[..], &output.stderr[..]].concat();
    let text = String::from_utf8_lossy(&text);
    assert!(output.status.success() && text.contains("soak: held"), "{text}");
}

//! The systemd unit, as systemd itself judges it, and the files that go with it.

use std::path::{Path, PathBuf};
use std::process::Command;

use tempfile::TempDir;

/// What `systemd-analyze security` may find at the most (0 safe, 10 open).
const EXPOSURE: f64 = 1.5;

fn source(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("systemd").join(name)
}

/// The unit as installed, with the program that was built in place of the installed one.
fn unit() -> (TempDir, PathBuf) {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("quavd.service");
    let text = std::fs::read_to_string(source("quavd.service")).unwrap();
    assert!(text.contains("ExecStart=/usr/bin/quavd run "));
    std::fs::write(&path, text.replace("/usr/bin/quavd", env!("CARGO_BIN_EXE_quavd"))).unwrap();
    (directory, path)
}

fn systemd_analyze(arguments: &[&str], unit: &Path) -> String {
    let output = Command::new("systemd-analyze").args(arguments).arg(unit).output();
    let output = output.expect("systemd-analyze runs: `make system` installs it");
    let said = [&output.stdout[..], &output.stderr[..]].concat();
    let said = String::from_utf8_lossy(&said).into_owned();
    assert!(output.status.success(), "{said}");
    said
}

#[test]
fn systemd_finds_nothing_wrong_with_the_unit() {
    let (_directory, unit) = unit();
    assert_eq!(systemd_analyze(&["verify", "--man=no"], &unit).trim(), "");
}

#[test]
fn the_unit_is_exposed_to_next_to_nothing() {
    let (_directory, unit) = unit();
    let said = systemd_analyze(&["security", "--offline=true", "--no-pager"], &unit);
    let level = said
        .split_once("Overall exposure level")
        .and_then(|(_, rest)| rest.split_whitespace().find_map(|word| word.parse::<f64>().ok()));
    assert!(level.is_some_and(|level| level <= EXPOSURE), "{said}");
}

#[test]
fn manual_pages_and_completions_cover_every_command() {
    let directory = tempfile::tempdir().unwrap();
    let made = Command::new(env!("CARGO_BIN_EXE_quavd"))
        .arg("generate")
        .arg(directory.path())
        .output()
        .unwrap();
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    for command in ["run", "status", "trigger", "once", "plan", "check", "compare", "qaoa"] {
        let page = directory.path().join(format!("man/quavd-{command}.1"));
        assert!(std::fs::read_to_string(&page).unwrap().contains(".SH"), "{}", page.display());
        for shell in ["quavd.bash", "_quavd", "quavd.fish"] {
            let path = directory.path().join("completions").join(shell);
            let text = std::fs::read_to_string(&path).unwrap();
            assert!(text.contains(command), "{shell} knows no {command}");
        }
    }
    let example = std::fs::read_to_string(directory.path().join("quavd.toml")).unwrap();
    assert_eq!(example, std::fs::read_to_string(source("quavd.toml")).unwrap());
}

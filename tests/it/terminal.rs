//! What a terminal is shown, and what is kept from everything else.

use std::process::{Command, Output, Stdio};

use crate::sitl::python;

/// Runs quavd with all three streams on a pseudo-terminal of 80 by 24; what it shows goes to our
/// stdout, its exit code is ours.
const ON_A_TERMINAL: &str = r"
import fcntl, os, pty, struct, sys, termios
pid, master = pty.fork()
if pid == 0:
    fcntl.ioctl(1, termios.TIOCSWINSZ, struct.pack('HHHH', 24, 80, 0, 0))
    os.execv(sys.argv[1], sys.argv[1:])
shown = b''
while True:
    try:
        part = os.read(master, 65536)
    except OSError:
        break
    if not part:
        break
    shown += part
sys.stdout.buffer.write(shown)
sys.exit(os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]))
";

fn quavd() -> &'static str {
    env!("CARGO_BIN_EXE_quavd")
}

fn example() -> String {
    format!("{}/fence_examples/inclusion-with-hole.plan", env!("CARGO_MANIFEST_DIR"))
}

/// What is shown on a terminal.
fn on_a_terminal(arguments: &[&str], environment: &[(&str, &str)]) -> String {
    let mut command = Command::new(python());
    command.args(["-c", ON_A_TERMINAL, quavd()]).args(arguments);
    command.env("LC_ALL", "C.UTF-8").env("TERM", "xterm-256color").env_remove("NO_COLOR");
    let output = command.envs(environment.iter().copied()).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stdout));
    String::from_utf8(output.stdout).unwrap()
}

fn through_pipes(arguments: &[&str]) -> Output {
    let mut command = Command::new(quavd());
    command.args(arguments).stdin(Stdio::null()).env("LC_ALL", "C.UTF-8").output().unwrap()
}

fn has_dots(text: &str) -> bool {
    text.chars().any(|c| ('\u{2801}'..='\u{28ff}').contains(&c))
}

fn has_colours(text: &str) -> bool {
    ["\u{1b}[0;34m", "\u{1b}[0;31m", "\u{1b}[0;90m", "\u{1b}[1m", "\u{1b}[33m"]
        .iter()
        .any(|code| text.contains(code))
}

#[test]
fn a_terminal_is_shown_progress_a_map_and_a_summary_of_eighty_columns() {
    let plan = example();
    let shown = on_a_terminal(&["plan", &plan], &[]);
    assert!(shown.contains("leg 1/2"), "progress: {shown}");
    assert!(shown.contains("round") && shown.contains("loss"), "progress: {shown}");
    assert!(has_dots(&shown) && shown.contains("S start, E end"), "{shown}");
    assert!(shown.contains("\u{1b}[0;34m"), "colours: {shown}");
    assert!(shown.contains("re-planned"));
    // The result is what stands below the last line of progress.
    let plain = on_a_terminal(&["plan", &plan], &[("NO_COLOR", "1")]);
    let result = plain.rsplit("\u{1b}[2K").next().unwrap();
    for line in result.lines() {
        assert!(line.trim_end().chars().count() <= 80, "{line}");
    }
}

#[test]
fn no_color_and_a_dumb_terminal_are_respected() {
    let plan = example();
    let plain = on_a_terminal(&["plan", &plan], &[("NO_COLOR", "1")]);
    assert!(has_dots(&plain) && !has_colours(&plain), "{plain}");
    let dumb = on_a_terminal(&["plan", &plan], &[("TERM", "dumb")]);
    assert!(!has_colours(&dumb) && !dumb.contains("S start"), "{dumb}");
    let ascii = on_a_terminal(&["plan", &plan], &[("LC_ALL", "C")]);
    assert!(!ascii.contains("S start"), "no dots where there is no UTF-8: {ascii}");
}

#[test]
fn quiet_shows_the_result_alone() {
    let shown = on_a_terminal(&["--quiet", "plan", &example()], &[]);
    assert!(shown.starts_with("2 of 4 legs re-planned"), "{shown:?}");
    assert!(!shown.contains("loss") && !shown.contains('\u{1b}'), "{shown}");
}

#[test]
fn a_pipe_gets_neither_progress_nor_map_nor_colours() {
    let output = through_pipes(&["plan", &example()]);
    let (out, err) = (String::from_utf8(output.stdout).unwrap(), output.stderr);
    assert!(out.starts_with("2 of 4 legs re-planned"), "{out}");
    assert!(!out.contains('\u{1b}') && !out.contains("S start"), "{out}");
    let err = String::from_utf8(err).unwrap();
    assert!(!err.contains('\u{1b}') && !err.contains("loss"), "{err}");
}

#[test]
fn json_on_a_terminal_is_json_alone() {
    let shown = on_a_terminal(&["--quiet", "plan", &example(), "--json"], &[]);
    let document: serde_json::Value = serde_json::from_str(&shown).unwrap();
    assert_eq!(document["feasible"], true);
}

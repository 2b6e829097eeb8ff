//! Every command in the documentation. A shell block says how it is tried:
//!
//! - `sh run`: as it stands, in a directory with `fence_examples`; `exit=3` where that is its end;
//! - `sh vehicle`: against the fake vehicle instead of the address that it names;
//! - `sh hardware`: not run; its `quavd` commands are parsed.
//!
//! And every link from one page to another leads somewhere.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use clap::Parser;
use quav::cli::Cli;
use tempfile::TempDir;

use crate::sitl::FakeVehicle;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn pages() -> Vec<PathBuf> {
    let docs = std::fs::read_dir(root().join("docs")).unwrap();
    let mut pages: Vec<_> = docs
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|suffix| suffix == "md"))
        .collect();
    pages.push(root().join("README.md"));
    pages.push(root().join("fence_examples/README.md"));
    pages.sort();
    pages
}

struct Block {
    /// For messages: page and line.
    place: String,
    /// What stands behind the backticks.
    kind: String,
    text: String,
}

fn blocks() -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::new();
    for page in pages() {
        let text = std::fs::read_to_string(&page).unwrap();
        let mut open: Option<Block> = None;
        for (index, line) in text.lines().enumerate() {
            match (line.strip_prefix("```"), &mut open) {
                (Some(_), Some(_)) => blocks.extend(open.take()),
                (Some(kind), None) => {
                    let place = format!("{}:{}", page.display(), index + 1);
                    open = Some(Block { place, kind: kind.to_owned(), text: String::new() });
                }
                (None, Some(block)) => {
                    block.text.push_str(line);
                    block.text.push('\n');
                }
                (None, None) => {}
            }
        }
        assert!(open.is_none(), "{}: a block is not closed", page.display());
    }
    blocks
}

/// A directory in which the commands of the documentation work.
fn directory() -> TempDir {
    let directory = tempfile::tempdir().unwrap();
    let examples = directory.path().join("fence_examples");
    std::os::unix::fs::symlink(root().join("fence_examples"), examples).unwrap();
    let bin = directory.path().join("target/release");
    std::fs::create_dir_all(&bin).unwrap();
    std::os::unix::fs::symlink(env!("CARGO_BIN_EXE_quavd"), bin.join("quavd")).unwrap();
    directory
}

fn shell(directory: &TempDir, text: &str) -> Output {
    let path = std::env::var("PATH").unwrap();
    let path = format!("{}:{path}", directory.path().join("target/release").display());
    Command::new("bash")
        .args(["-euo", "pipefail", "-c", text])
        .current_dir(directory.path())
        .env("PATH", path)
        .env("XDG_STATE_HOME", directory.path().join("state"))
        .output()
        .unwrap()
}

fn assert_ends(block: &Block, output: &Output, code: i32) {
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{}\n{}{said}", block.place, block.text);
}

#[test]
fn every_block_of_commands_says_how_it_is_tried() {
    let mut tried = 0;
    for block in blocks() {
        let mut words = block.kind.split_whitespace();
        match words.next() {
            Some("sh") => {
                let how = words.next().unwrap_or_default();
                assert!(["run", "vehicle", "hardware"].contains(&how), "{}", block.place);
                tried += 1;
            }
            // Not commands; `quavd` in the first place of a line would be one.
            other => {
                let command = block.text.lines().find(|line| line.trim().starts_with("quavd "));
                assert!(command.is_none(), "{}: {other:?} with {command:?}", block.place);
            }
        }
    }
    assert!(tried >= 15, "{tried}");
    // A command that is indented instead of fenced would be missed.
    for page in pages() {
        let text = std::fs::read_to_string(&page).unwrap();
        let indented = text.lines().find(|line| {
            line.starts_with("    ") && (line.contains("quavd ") || line.contains("make "))
        });
        assert!(indented.is_none(), "{}: {indented:?} is not in a fence", page.display());
    }
}

#[test]
fn what_needs_no_vehicle_does_what_it_says() {
    let directory = directory();
    for block in blocks().iter().filter(|block| block.kind.starts_with("sh run")) {
        let code = block.kind.split("exit=").nth(1).map_or(0, |code| code.parse().unwrap());
        assert_ends(block, &shell(&directory, &block.text), code);
    }
}

#[test]
fn what_needs_a_vehicle_works_with_one() {
    for block in blocks().iter().filter(|block| block.kind.starts_with("sh vehicle")) {
        let plan = root().join("fence_examples/one-polygon.plan");
        let directory = directory();
        let vehicle = FakeVehicle::start(&["--mission", plan.to_str().unwrap()]);
        let url = vehicle.endpoint().to_string();
        let on = |text: &str| {
            let mut out = String::new();
            for line in text.lines() {
                let (before, rest) = line.split_once("--connect ").unwrap();
                let after = rest.split_once(' ').map_or("", |(_, after)| after);
                out += &format!("{before}--connect {url} --state-dir state {after}\n");
            }
            out
        };
        // A restore needs something to put back.
        if block.text.contains("--restore") && !block.text.contains("921600\n") {
            let first = on("quavd once --connect X");
            assert_ends(block, &shell(&directory, &first), 0);
        }
        assert_ends(block, &shell(&directory, &on(&block.text)), 0);
    }
}

#[test]
fn what_needs_hardware_is_parsed() {
    let mut parsed = 0;
    for block in blocks().iter().filter(|block| block.kind.starts_with("sh hardware")) {
        for line in block.text.lines() {
            let line = line.split(" #").next().unwrap().trim();
            let line = line.strip_prefix("sudo ").unwrap_or(line);
            if !line.starts_with("quavd ") {
                continue;
            }
            let words = line.split(['|', '>', '&']).next().unwrap().split_whitespace();
            match Cli::try_parse_from(words) {
                Ok(_) => parsed += 1,
                Err(error) if error.exit_code() == 0 => parsed += 1, // --version, --help
                Err(error) => panic!("{}: {line}: {error}", block.place),
            }
        }
    }
    assert!(parsed > 0);
}

#[test]
fn links_between_pages_lead_somewhere() {
    for page in pages() {
        let text = std::fs::read_to_string(&page).unwrap();
        for target in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            if target.starts_with("http") {
                continue;
            }
            let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
            let path =
                if file.is_empty() { page.clone() } else { page.parent().unwrap().join(file) };
            assert!(path.exists(), "{}: {target}", page.display());
            if !anchor.is_empty() {
                let text = std::fs::read_to_string(&path).unwrap();
                let headings = text.lines().filter(|line| line.starts_with('#'));
                let slug = |line: &str| -> String {
                    let words = line.trim_start_matches('#').trim().to_lowercase();
                    let kept = words.chars().filter(|c| c.is_alphanumeric() || " -".contains(*c));
                    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
                };
                assert!(headings.map(slug).any(|s| s == anchor), "{}: {target}", page.display());
            }
        }
    }
}

/// The words of messages that the troubleshooting page explains are in the program.
#[test]
fn messages_that_are_explained_exist() {
    let page = std::fs::read_to_string(root().join("docs/troubleshooting.md")).unwrap();
    let mut sources = String::new();
    let mut folders = vec![root().join("src")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            match path.extension() {
                _ if path.is_dir() => folders.push(path),
                Some(suffix) if suffix == "rs" => {
                    sources += &std::fs::read_to_string(path).unwrap();
                }
                _ => {}
            }
        }
    }
    // Strings go on over lines with a backslash.
    let flat = sources.replace("\\\n", " ");
    let flat = flat.split_whitespace().collect::<Vec<_>>().join(" ");
    let mut explained = 0;
    for message in page.split("**").skip(1).step_by(2) {
        for words in message.split('`').skip(1).step_by(2) {
            for part in words.split('…').map(str::trim).filter(|part| part.len() > 3) {
                let part = part.split_whitespace().collect::<Vec<_>>().join(" ");
                let known = flat.contains(&part) || is_pieced(&flat, &part);
                assert!(known, "{part:?} is in no message");
                explained += 1;
            }
        }
    }
    assert!(explained > 20, "{explained}");
}

/// Whether a message's words are there with a value in the place of one of them.
fn is_pieced(flat: &str, part: &str) -> bool {
    let words: Vec<&str> = part.split(' ').collect();
    (1..words.len()).any(|gap| {
        let (before, after) = (words[..gap].join(" "), words[gap + 1..].join(" "));
        before.len() > 5 && flat.contains(&before) && (after.is_empty() || flat.contains(&after))
    })
}

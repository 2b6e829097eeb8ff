//! `docs/configuration.md` is what the code says. `make reference` writes it again.

use std::fmt::Write as _;
use std::path::Path;

use quav::config::reference::{OptionDoc, options};

const HEAD: &str = "\
# Configuration reference

<!-- Written by `make reference` from the declarations in src/config: change those, not this. -->

The daemon, `quavd run`, reads a TOML file: `--config FILE`, `/etc/quavd/quavd.toml` where it is
installed as a service. Every key is also an option of the commands that have it (`state_dir` is
`--state-dir`), with the same meaning and the same default. Only what has no default and is marked so
must be given. `quavd run --check` reads a file and says what is wrong with it.
";

fn reference() -> String {
    let mut text = HEAD.to_owned();
    let mut group = String::new();
    for option in options() {
        if option.group != group {
            group.clone_from(&option.group);
            // Writing to a String cannot fail.
            let _ = write!(
                text,
                "\n## {group}\n\n| key | takes | default | meaning |\n|---|---|---|---|\n"
            );
        }
        text += &row(&option);
    }
    text
}

fn row(option: &OptionDoc) -> String {
    let takes =
        if option.is_list { format!("list of {}", option.takes) } else { option.takes.clone() };
    let default = match (&option.default, option.is_required) {
        (Some(default), _) => format!("`{default}`"),
        (None, true) => "must be given".to_owned(),
        (None, false) => "none".to_owned(),
    };
    let cell = |text: &str| text.replace('|', "\\|").replace('\n', " ");
    format!(
        "| `{}` | {} | {} | {} |\n",
        option.key,
        cell(&takes),
        cell(&default),
        cell(&option.text)
    )
}

#[test]
fn the_configuration_reference_is_what_the_code_says() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/configuration.md");
    let written = reference();
    if std::env::var_os("QUAV_WRITE_REFERENCE").is_some() {
        std::fs::write(&path, &written).unwrap();
    }
    let kept = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        kept == written,
        "docs/configuration.md is not what the code says; run `make reference`"
    );
}

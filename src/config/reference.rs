//! What options there are, read from their declarations: for the commented example that is
//! installed with quavd, and for whatever document lists them.

use std::fmt::Write as _;

use clap::{Arg, ArgAction, Args, Command};

use super::document::names;
use super::options::DaemonOptions;

/// Values to show for options that have no default.
const EXAMPLES: &[(&str, &str)] = &[
    ("connect", "serial:/dev/ttyAMA0:921600"),
    ("system", "1"),
    ("state_dir", "/var/lib/quavd"),
    ("socket", "/run/quavd/status.sock"),
    ("fence", "field.geojson"),
    ("obstacles", "buildings.kml"),
    ("signing_key", "credential:signing-key"),
    ("deadline", "10"),
    ("ground_relief", "3"),
    ("cvar", "0.2"),
    ("max_items", "650"),
    ("max_waypoints", "40"),
    ("backend", "least_busy"),
    ("api_key_file", "ibm-api-key"),
    ("crn_file", "ibm-crn"),
    ("iam_url", "https://iam.cloud.ibm.com"),
    ("api_url", "https://quantum.cloud.ibm.com/api"),
];
/// The width of comments in the example.
const WIDTH: usize = 96;

/// One option of the configuration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OptionDoc {
    /// Its key in the file; on the command line with `-` for `_`.
    pub key: String,
    /// The group it belongs to.
    pub group: String,
    /// What it takes: a unit, a kind of value, or the names to choose from.
    pub takes: String,
    /// What holds where it is left out; `None` where there is no value then.
    pub default: Option<String>,
    /// A value as it is written in the file.
    pub example: Option<String>,
    /// Whether a list of values can be given.
    pub is_list: bool,
    /// Whether it has to be given.
    pub is_required: bool,
    /// What it does, with its unit and its range.
    pub text: String,
}

/// The options as a clap command whose arguments are those of the file and nothing else.
pub(super) fn command() -> Command {
    let command = Command::new("quavd.toml").no_binary_name(true).disable_help_flag(true);
    DaemonOptions::augment_args(command).args_override_self(false)
}

/// The key of an option.
pub(super) fn key_of(arg: &Arg) -> Option<String> {
    arg.get_long().map(|long| long.replace('-', "_"))
}

/// All options, in the order of their declaration.
#[must_use]
pub fn options() -> Vec<OptionDoc> {
    let command = command();
    command.get_arguments().filter_map(described).collect()
}

fn described(arg: &Arg) -> Option<OptionDoc> {
    let key = key_of(arg)?;
    let is_switch = matches!(arg.get_action(), ArgAction::SetTrue);
    let takes = match (is_switch, names(arg)) {
        (true, _) => "true|false".to_owned(),
        (false, names) if names.is_empty() => {
            // clap names the value after the option where nothing else is said.
            let names = arg.get_value_names().unwrap_or_default();
            names.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ")
        }
        (false, names) => names.join("|"),
    };
    let given = arg.get_default_values().first().map(|value| value.to_string_lossy().into_owned());
    let default = if is_switch { Some("false".to_owned()) } else { given.map(|text| toml(&text)) };
    let shown = EXAMPLES.iter().find(|(name, _)| *name == key).map(|(_, value)| toml(value));
    let example = default.clone().or(shown);
    let text = arg.get_long_help().or_else(|| arg.get_help()).map(ToString::to_string);
    Some(OptionDoc {
        group: arg.get_help_heading().unwrap_or("Connection").to_owned(),
        takes,
        default,
        example,
        is_list: matches!(arg.get_action(), ArgAction::Append),
        is_required: arg.is_required_set(),
        text: text.unwrap_or_default(),
        key,
    })
}

/// A default of the command line as TOML writes it.
fn toml(value: &str) -> String {
    if value.parse::<f64>().is_ok() || matches!(value, "true" | "false") {
        value.to_owned()
    } else {
        toml::Value::String(value.to_owned()).to_string()
    }
}

/// The commented example: every option with its text and its default, ready to be changed.
#[must_use]
pub fn example() -> String {
    let mut out = "# The configuration of quavd, the daemon. Every option there is, with its default; only\n\
                   # `connect` has to be given. Check a changed file with `quavd run --check`, and let a\n\
                   # running daemon read it with `systemctl reload quavd`.\n"
        .to_owned();
    let mut group = String::new();
    for option in options() {
        if option.group != group {
            group.clone_from(&option.group);
            // Writing to a string cannot fail.
            let _ = write!(out, "\n## {group}\n");
        }
        out.push('\n');
        for line in wrapped(&sentence(&option.text)) {
            let _ = writeln!(out, "# {line}");
        }
        let value = option.example.as_deref().unwrap_or_default();
        let value = if option.is_list { format!("[{value}]") } else { value.to_owned() };
        let comment = if option.is_required { "" } else { "# " };
        let _ = writeln!(out, "{comment}{} = {value}", option.key);
    }
    out
}

/// clap drops the full stop at the end.
fn sentence(text: &str) -> String {
    if text.ends_with('.') { text.to_owned() } else { format!("{text}.") }
}

fn wrapped(text: &str) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let full = lines.last().is_some_and(|line| {
            !line.is_empty() && line.chars().count() + 1 + word.chars().count() > WIDTH - 2
        });
        if full {
            lines.push(String::new());
        }
        if let Some(line) = lines.last_mut() {
            if !line.is_empty() {
                line.push(' ');
            }
            line.push_str(word);
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::config::{Overrides, document};

    #[test]
    fn the_installed_example_is_what_the_options_say() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("systemd/quavd.toml");
        let installed = std::fs::read_to_string(path).unwrap();
        assert_eq!(
            installed,
            example(),
            "make it again: target/release/quavd run --example > systemd/quavd.toml"
        );
    }

    #[test]
    fn the_example_is_valid_as_it_is_and_line_by_line() {
        let directory = Path::new("/etc/quavd");
        let parse = |text: &str| document::parse(text, directory, &Overrides::new());
        parse(&example()).unwrap();
        let mut seen = 0;
        for line in example().lines().filter_map(|line| line.strip_prefix("# ")) {
            let Some((key, _)) = line.split_once(" = ") else { continue };
            if options().iter().any(|option| option.key == key) {
                seen += 1;
                // Options that only make sense with another one.
                let key = if key.starts_with("signing_") && key != "signing_key" {
                    "signing_key = \"credential:signing-key\"\n"
                } else {
                    ""
                };
                let text = format!("connect = \"udpin:0.0.0.0:1\"\n{key}{line}\n");
                parse(&text).unwrap_or_else(|problems| panic!("{line}: {problems:?}"));
            }
        }
        assert_eq!(seen + 1, options().len());
    }

    #[test]
    fn every_option_is_explained_and_has_a_value_to_show() {
        for option in options() {
            assert!(option.text.len() > 10, "{option:?}");
            assert!(option.example.is_some(), "{} wants a value in EXAMPLES", option.key);
            assert!(!option.takes.is_empty(), "{option:?}");
        }
    }
}

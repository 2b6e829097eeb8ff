//! From the text of a configuration to [`DaemonOptions`]: TOML for the syntax and the lines, clap
//! for the values, so that a value is right in the file exactly where it is on the command line.

use std::any::TypeId;
use std::path::{Path, PathBuf};

use clap::builder::PossibleValue;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Arg, ArgAction, Command, FromArgMatches};
use toml::de::{DeTable, DeValue};

use super::reference::{command, key_of};
use super::{DaemonOptions, Overrides, Problem};

/// Names that resemble each other at least this much are taken for a slip of the keyboard.
const SIMILAR: f64 = 0.75;

/// Reads a configuration. Relative paths are taken from `directory`; `overrides` count more than
/// the text.
///
/// # Errors
/// Everything that is wrong with it.
pub fn parse(
    text: &str,
    directory: &Path,
    overrides: &Overrides,
) -> Result<DaemonOptions, Vec<Problem>> {
    let table = DeTable::parse(text).map_err(|error| {
        let line = error.span().map(|span| line_at(text, span.start));
        vec![Problem { line, message: error.message().to_owned() }]
    })?;
    let command = command();
    let mut problems = Vec::new();
    let mut arguments = Vec::new();
    let mut lines = Vec::new();
    let mut entries: Vec<_> = table.get_ref().iter().collect();
    entries.sort_by_key(|(key, _)| key.span().start);
    for (key, value) in entries {
        let line = line_at(text, key.span().start);
        match entry(&command, key.get_ref(), value.get_ref(), directory) {
            Ok(given) => {
                lines.push((key.get_ref().clone(), line));
                if !overrides.contains_key(key.get_ref().as_ref()) {
                    arguments.extend(given);
                }
            }
            Err(message) => problems.push(Problem { line: Some(line), message }),
        }
    }
    if !problems.is_empty() {
        return Err(problems);
    }
    for (key, value) in overrides {
        let value = DeValue::String(value.as_str().into());
        match entry(&command, key, &value, directory) {
            Ok(given) => arguments.extend(given),
            Err(message) => return Err(vec![Problem { line: None, message }]),
        }
    }
    let line_of = |key: &str| lines.iter().find(|(name, _)| name == key).map(|(_, line)| *line);
    let parsed = command
        .clone()
        .try_get_matches_from(arguments)
        .and_then(|matches| DaemonOptions::from_arg_matches(&matches));
    parsed.map_err(|error| vec![together(&command, &error, line_of)])
}

/// One entry of the file as arguments, each tried by itself.
fn entry(
    command: &Command,
    key: &str,
    value: &DeValue<'_>,
    directory: &Path,
) -> Result<Vec<String>, String> {
    let arg = command.get_arguments().find(|arg| key_of(arg).as_deref() == Some(key));
    let arg = arg.ok_or_else(|| unknown(command, key, value))?;
    let flag = format!("--{}", arg.get_long().unwrap_or_default());
    let is_switch = matches!(arg.get_action(), ArgAction::SetTrue);
    let values = match value {
        DeValue::Boolean(on) if is_switch => {
            return Ok(on.then_some(flag).into_iter().collect());
        }
        _ if is_switch => return Err(format!("{key} is either true or false")),
        DeValue::Array(values) if matches!(arg.get_action(), ArgAction::Append) => {
            values.iter().map(|value| scalar(key, value.get_ref())).collect::<Result<_, _>>()?
        }
        DeValue::Array(_) => return Err(format!("{key} takes one value, not a list")),
        value => vec![scalar(key, value)?],
    };
    let is_path = arg.get_value_parser().type_id() == TypeId::of::<PathBuf>();
    let mut arguments = Vec::new();
    for value in values {
        let value = if is_path { absolute(directory, &value) } else { value };
        let argument = format!("{flag}={value}");
        // Nothing but this value: what goes with what is asked when all are together.
        let alone = command.clone().mut_args(|arg| arg.required(false));
        if let Err(error) = alone.try_get_matches_from([&argument])
            && error.kind() != ErrorKind::MissingRequiredArgument
        {
            return Err(format!("{key}: {}", reason(&error)));
        }
        arguments.push(argument);
    }
    Ok(arguments)
}

fn absolute(directory: &Path, value: &str) -> String {
    directory.join(value).to_string_lossy().into_owned()
}

fn scalar(key: &str, value: &DeValue<'_>) -> Result<String, String> {
    match value {
        DeValue::String(text) => Ok(text.clone().into_owned()),
        DeValue::Integer(number) => i64::from_str_radix(number.as_str(), number.radix())
            .map(|number| number.to_string())
            .map_err(|_| format!("{key}: {number} is too large")),
        DeValue::Float(number) => Ok(number.as_str().to_owned()),
        DeValue::Boolean(on) => Ok(on.to_string()),
        other => Err(format!("{key} takes no {}", other.type_str())),
    }
}

/// What to say about a key that is no option.
fn unknown(command: &Command, key: &str, value: &DeValue<'_>) -> String {
    if value.is_table() {
        return format!("there are no sections such as [{key}]; write the options without one");
    }
    let similar = command
        .get_arguments()
        .filter_map(key_of)
        .map(|name| (strsim::jaro_winkler(&name, key), name))
        .filter(|(likeness, _)| *likeness >= SIMILAR)
        .max_by(|a, b| a.0.total_cmp(&b.0));
    match similar {
        Some((_, name)) => format!("there is no option {key}; did you mean {name}?"),
        None => format!("there is no option {key}; `quavd run --example` shows all there are"),
    }
}

/// Why clap refused a value, without the words for a command line.
fn reason(error: &clap::Error) -> String {
    if let (ErrorKind::ValueValidation, Some(source)) =
        (error.kind(), std::error::Error::source(error))
    {
        return source.to_string();
    }
    let text = error.to_string();
    let first = text.lines().next().unwrap_or_default();
    first.strip_prefix("error: ").unwrap_or(first).to_owned()
}

/// What is wrong with options that are right one by one: one is missing, or two exclude each other.
fn together(
    command: &Command,
    error: &clap::Error,
    line_of: impl Fn(&str) -> Option<usize>,
) -> Problem {
    let named = |kind| match error.get(kind) {
        Some(ContextValue::String(name)) => vec![name.clone()],
        Some(ContextValue::Strings(names)) => names.clone(),
        _ => Vec::new(),
    };
    let keys = |names: Vec<String>| -> Vec<String> {
        let keys = command.get_arguments().filter_map(|arg| {
            let flag = format!("--{}", arg.get_long()?);
            let is_named = names.iter().any(|name| name.split(' ').next() == Some(&flag));
            is_named.then(|| key_of(arg)).flatten()
        });
        keys.collect()
    };
    let first = keys(named(ContextKind::InvalidArg));
    let line = first.iter().find_map(|key| line_of(key));
    let message = match error.kind() {
        ErrorKind::MissingRequiredArgument => {
            format!("{} is missing; it has to be given", first.join(", "))
        }
        ErrorKind::ArgumentConflict => {
            let others = keys(named(ContextKind::PriorArg));
            format!("{} cannot be given together with {}", first.join(", "), others.join(", "))
        }
        _ => reason(error),
    };
    Problem { line, message }
}

/// The line, from 1, of a place in a text.
fn line_at(text: &str, at: usize) -> usize {
    text.bytes().take(at).filter(|&byte| byte == b'\n').count() + 1
}

/// The values an option can have, where they are a few names.
pub(super) fn names(arg: &Arg) -> Vec<String> {
    arg.get_possible_values().iter().map(PossibleValue::get_name).map(str::to_owned).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Policy;
    use crate::link::Endpoint;

    fn problems(text: &str) -> Vec<String> {
        parse(text, Path::new(""), &Overrides::new())
            .unwrap_err()
            .iter()
            .map(ToString::to_string)
            .collect()
    }

    #[test]
    fn three_lines_are_a_configuration() {
        let text = "# the Pi's UART\nconnect = \"serial:/dev/ttyAMA0:921600\"\nbuffer = 8\n";
        let options = parse(text, Path::new("/etc/quavd"), &Overrides::new()).unwrap();
        let serial = Endpoint::Serial { path: "/dev/ttyAMA0".to_owned(), baud: 921_600 };
        assert_eq!(options.connect, [serial]);
        assert!((options.planning.safety.buffer - 8.0).abs() < 1e-9);
        assert_eq!(options.service.policy, Policy::OnChange);
        assert_eq!(options.service.plan_command(), 31_010);
    }

    #[test]
    fn every_kind_of_value_is_taken() {
        let text = r#"
            connect = ["udpin:0.0.0.0:14550", "tcpout:127.0.0.1:5760"]
            policy = "on_command"
            enable = false
            rounds = 12
            paper = true
            seed = 0x10
            obstacles = ["city.geojson", "/srv/trees.kml"]
            debounce = 2
        "#;
        let options = parse(text, Path::new("/etc/quavd"), &Overrides::new()).unwrap();
        assert_eq!(options.connect.len(), 2);
        assert_eq!(options.service.policy, Policy::OnCommand);
        assert!(!options.service.enable && options.planning.paper);
        assert_eq!(options.planning.seed, 16);
        let obstacles = ["/etc/quavd/city.geojson", "/srv/trees.kml"].map(PathBuf::from);
        assert_eq!(options.planning.safety.obstacles, obstacles);
    }

    #[test]
    fn everything_that_is_wrong_is_said_at_once_with_its_line() {
        let text = "connect = \"carrier-pigeon:1\"\nbufer = 5\n\nqubits = 1\ndebounce = \"soon\"\n\
                    policy = [\"manual\"]\n[planning]\nbuffer = 5\n";
        let said = problems(text);
        assert_eq!(said.len(), 6, "{said:#?}");
        for (said, begins, names) in [
            (&said[0], "line 1: connect: ", "names no kind of link"),
            (&said[1], "line 2: there is no option bufer", "did you mean buffer?"),
            (&said[2], "line 4: qubits: ", "2..=2000"),
            (&said[3], "line 5: debounce: ", "not a number from 0.1 to 60"),
            (&said[4], "line 6: policy takes one value", "not a list"),
            (&said[5], "line 7: there are no sections", "[planning]"),
        ] {
            assert!(said.starts_with(begins) && said.contains(names), "{said}");
        }
    }

    #[test]
    fn options_that_do_not_go_together_are_refused_by_name() {
        assert_eq!(problems("buffer = 5\n"), ["connect is missing; it has to be given"]);
        let said = problems("connect = \"udpin:0.0.0.0:1\"\nqubits = 9\npaper = true\n");
        assert!(said[0].contains("paper") && said[0].contains("qubits"), "{said:?}");
        assert!(said[0].starts_with("line "), "{said:?}");
    }

    #[test]
    fn what_is_set_over_the_file_counts_more_and_is_checked_alike() {
        let text = "connect = \"udpin:0.0.0.0:1\"\nbuffer = 5\n";
        let over = |value: &str| {
            let overrides = [("buffer".to_owned(), value.to_owned())].into();
            parse(text, Path::new(""), &overrides)
        };
        assert!((over("12.5").unwrap().planning.safety.buffer - 12.5).abs() < 1e-9);
        assert!(over("-1").unwrap_err()[0].message.starts_with("buffer: "));
    }

    #[test]
    fn a_file_that_is_no_toml_is_refused_with_its_line() {
        let said = problems("connect = \"udpin:0.0.0.0:1\"\nbuffer 5\n");
        assert!(said[0].starts_with("line 2: "), "{said:?}");
        assert!(problems("a = 1\na = 2\n")[0].starts_with("line 2: "));
    }
}

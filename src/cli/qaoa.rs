//! `quavd qaoa`: runs QAOA alone on an Ising problem from a file. [`told`] is what it prints.

mod told;

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::{Args, ValueEnum};
use serde::Deserialize;

use super::memory;
use crate::qaoa::angles::AnglesError;
use crate::qaoa::statevector::Precision;
use crate::qaoa::{
    Angles, AnglesSource, EngineChoice, EngineError, Ising, IsingError, Objective, Qaoa,
    RunSettings, Scale, TrainSettings,
};
use crate::stop::Stop;
pub(in crate::cli) use told::{document, summary};

/// The largest file that is read: room for a million couplings.
const MAX_FILE_BYTES: u64 = 64 << 20;

/// The arguments of `quavd qaoa`.
#[derive(Debug, Args)]
pub struct QaoaArgs {
    /// The problem: {"h": [..], "J": [[i, j, value], ..], "constant": 0}; - reads it from stdin.
    #[arg(value_name = "ISING.json")]
    pub ising: PathBuf,
    /// Layers of the circuit [default: 5, or as many as there are gammas].
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub layers: Option<u16>,
    /// Adam steps.
    #[arg(long, default_value_t = 60, value_parser = clap::value_parser!(u32).range(0..=100_000))]
    pub steps: u32,
    /// Adam's learning rate.
    #[arg(long, default_value_t = 0.1, value_parser = learning_rate)]
    pub learning_rate: f64,
    /// Train on the mean of this share of the best measurements (CVaR) instead of ⟨H⟩: exact with the
    /// statevector engine, estimated from --shots samples at every step with the chain engine.
    #[arg(long, value_parser = super::options::cvar, value_name = "ALPHA", conflicts_with = "gammas")]
    pub cvar: Option<f64>,
    /// Measurements of the trained circuit.
    #[arg(long, default_value_t = 1024, value_parser = clap::value_parser!(u32).range(0..=1_000_000))]
    pub shots: u32,
    /// Seed of the measurements; the same seed gives the same samples.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// QAOA engine: auto (chain where the problem is one), chain or statevector.
    #[arg(long, default_value = "auto", value_name = "ENGINE")]
    pub engine: EngineChoice,
    /// Numbers of the statevector engine.
    #[arg(long, value_enum, default_value_t)]
    pub precision: PrecisionArg,
    /// What the angles apply to: the problem as given, or centred and divided by its standard deviation.
    #[arg(long, value_enum, default_value_t)]
    pub scale: ScaleArg,
    /// Evaluate at these γ (comma-separated, radians) without training; needs --betas.
    #[arg(long, value_delimiter = ',', allow_hyphen_values = true, requires = "betas")]
    pub gammas: Option<Vec<f64>>,
    /// Evaluate at these β (comma-separated, radians) without training; needs --gammas.
    #[arg(long, value_delimiter = ',', allow_hyphen_values = true, requires = "gammas")]
    pub betas: Option<Vec<f64>>,
    /// Print one JSON document on stdout.
    #[arg(long)]
    pub json: bool,
}

/// `--scale`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum ScaleArg {
    /// As given.
    None,
    /// Centred and divided by σ.
    #[default]
    Sigma,
}

/// `--precision`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum PrecisionArg {
    /// Double.
    #[default]
    F64,
    /// Single.
    F32,
}

fn learning_rate(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (1e-6..=10.0).contains(&value) => Ok(value),
        _ => Err(format!("'{text}' is not a number from 0.000001 to 10")),
    }
}

/// Why there is no result. All of these are exit code 2.
#[derive(Debug, thiserror::Error)]
pub enum QaoaCommandError {
    /// The file cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The file is too large.
    #[error("{} is larger than {} MiB; no engine takes such a problem", .0.display(), MAX_FILE_BYTES >> 20)]
    TooLarge(PathBuf),
    /// The file is no JSON document of the right form.
    #[error("{}: {source}; expected {{\"h\": [..], \"J\": [[i, j, value], ..], \"constant\": 0}}", path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// Where and why.
        source: serde_json::Error,
    },
    /// The problem cannot be used.
    #[error("{}: {source}", path.display())]
    Ising {
        /// The file.
        path: PathBuf,
        /// Why.
        source: IsingError,
    },
    /// The angles cannot be used.
    #[error("--gammas and --betas: {0}")]
    Angles(#[from] AnglesError),
    /// `--layers` contradicts the angles.
    #[error("--layers {layers} but {gammas} gammas; leave --layers out")]
    Layers {
        /// Layers asked for.
        layers: usize,
        /// Gammas given.
        gammas: usize,
    },
    /// No engine can run it.
    #[error(transparent)]
    Engine(#[from] EngineError),
}

/// The problem file. Unknown fields are refused: a misspelt "J" must not run as a problem without one.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct IsingFile {
    h: Vec<f64>,
    #[serde(default, rename = "J")]
    j: Vec<(usize, usize, f64)>,
    #[serde(default)]
    constant: f64,
}

/// Runs the command; returns what goes to stdout.
///
/// # Errors
/// [`QaoaCommandError`], saying what to change.
pub fn run(args: &QaoaArgs) -> Result<String, QaoaCommandError> {
    let began = Instant::now();
    let ising = read(&args.ising)?;
    let settings = settings(args)?;
    let precision = match args.precision {
        PrecisionArg::F64 => Precision::Double,
        PrecisionArg::F32 => Precision::Single,
    };
    let mut qaoa = Qaoa::new(memory::available()).with_precision(precision);
    let run = qaoa.run(&ising, &settings, &Stop::new())?;
    let time_ms = began.elapsed().as_secs_f64() * 1e3;
    Ok(if args.json { format!("{:#}\n", document(&run, time_ms)) } else { summary(&run, time_ms) })
}

fn settings(args: &QaoaArgs) -> Result<RunSettings, QaoaCommandError> {
    let layers = args.layers.map(usize::from);
    let angles = match (&args.gammas, &args.betas) {
        (Some(gammas), Some(betas)) => {
            let angles = Angles::new(gammas.clone(), betas.clone())?;
            match layers {
                Some(layers) if layers != angles.layers() => {
                    return Err(QaoaCommandError::Layers { layers, gammas: angles.layers() });
                }
                _ => AnglesSource::Given(angles),
            }
        }
        _ => AnglesSource::Ramp(layers.unwrap_or(5)),
    };
    Ok(RunSettings {
        engine: args.engine,
        scale: match args.scale {
            ScaleArg::None => Scale::None,
            ScaleArg::Sigma => Scale::Sigma,
        },
        angles,
        train: TrainSettings {
            steps: args.steps as usize,
            learning_rate: args.learning_rate,
            settled: None,
            objective: args.cvar.map_or(Objective::Mean, |alpha| {
                // No samples at all would give nothing to estimate from.
                Objective::Cvar { alpha, shots: args.shots.max(1), seed: args.seed }
            }),
        },
        shots: args.shots,
        seed: args.seed,
    })
}

pub(super) fn read(path: &Path) -> Result<Ising, QaoaCommandError> {
    let failed = |source| QaoaCommandError::Read { path: path.to_owned(), source };
    let mut bytes = Vec::new();
    let input: Box<dyn Read> = if path == Path::new("-") {
        Box::new(io::stdin())
    } else {
        Box::new(File::open(path).map_err(failed)?)
    };
    input.take(MAX_FILE_BYTES + 1).read_to_end(&mut bytes).map_err(failed)?;
    if bytes.len() as u64 > MAX_FILE_BYTES {
        return Err(QaoaCommandError::TooLarge(path.to_owned()));
    }
    let file: IsingFile = serde_json::from_slice(&bytes)
        .map_err(|source| QaoaCommandError::Json { path: path.to_owned(), source })?;
    Ising::new(file.constant, file.h, file.j)
        .map_err(|source| QaoaCommandError::Ising { path: path.to_owned(), source })
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use clap::Parser;
    use serde_json::Value;

    use super::*;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        args: QaoaArgs,
    }

    const PROBLEM: &str = r#"{"h": [0.345584, 0.821618, 0.330437],
        "J": [[0, 1, -1.303157], [1, 2, 0.905356]], "constant": 2}"#;

    fn with_problem(problem: &str, options: &[&str]) -> Result<String, QaoaCommandError> {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(problem.as_bytes()).unwrap();
        let path = file.path().to_str().unwrap().to_owned();
        let line = ["qaoa", &path].into_iter().chain(options.iter().copied());
        run(&Line::try_parse_from(line).unwrap().args)
    }

    fn printed(options: &[&str]) -> Value {
        let options: Vec<&str> = options.iter().copied().chain(["--json"]).collect();
        serde_json::from_str(&with_problem(PROBLEM, &options).unwrap()).unwrap()
    }

    #[test]
    fn given_angles_are_evaluated_with_their_gradient_on_both_engines() {
        for engine in ["chain", "statevector"] {
            let options = ["--scale", "none", "--gammas", "0.135114", "--betas", "-0.581159"];
            let document = printed(&[options.as_slice(), &["--engine", engine]].concat());
            assert_eq!(document["engine"], engine);
            let close = |value: &Value, expected: f64| {
                assert!((value.as_f64().unwrap() - expected).abs() < 1e-9, "{value}");
            };
            close(&document["expectation"], 2.0 - 0.684_036_893_824_778_5);
            close(&document["gradient"]["gammas"][0], -4.490_762_794_892_976_5);
            close(&document["gradient"]["betas"][0], -1.577_602_453_145_165_1);
            close(&document["p_optimum"], 0.206_621_003_968_583_4);
            close(&document["exact_optimum"], 2.0 - 3.045_278);
        }
    }

    #[test]
    fn training_prints_the_whole_contract() {
        let document = printed(&["--layers", "2", "--shots", "100"]);
        let keys = [
            "engine",
            "expectation",
            "loss",
            "gammas",
            "betas",
            "best",
            "exact_optimum",
            "p_optimum",
            "samples",
            "time_ms",
        ];
        for key in keys {
            assert!(!document[key].is_null(), "{key}");
        }
        assert_eq!(document["engine"], "chain");
        assert_eq!(document["loss"].as_array().unwrap().len(), 61);
        assert_eq!(document["gammas"].as_array().unwrap().len(), 2);
        assert_eq!(document["best"]["bits"], "110");
        let shots: u64 =
            document["samples"].as_object().unwrap().values().filter_map(Value::as_u64).sum();
        assert_eq!(shots, 100);
        assert!(document.get("gradient").is_none());
    }

    #[test]
    fn the_same_seed_prints_the_same_samples() {
        let samples = |seed: &str| printed(&["--steps", "0", "--seed", seed])["samples"].clone();
        assert_eq!(samples("7"), samples("7"));
        assert_ne!(samples("7"), samples("8"));
    }

    #[test]
    fn the_summary_names_optimum_and_best_sample() {
        let text = with_problem(PROBLEM, &["--shots", "50"]).unwrap();
        assert!(text.contains("3 qubits, 5 layers, chain engine"));
        assert!(text.contains("best sample   -1.045278  110"));
        assert!(text.contains("exact optimum -1.045278"));
    }

    #[test]
    fn unusable_input_says_where_and_what_to_do() {
        let error = |problem: &str, options: &[&str]| {
            with_problem(problem, options).unwrap_err().to_string()
        };
        assert!(error(r#"{"h": [1], "j": []}"#, &[]).contains("unknown field `j`"));
        assert!(error("{\"h\": [1,\n}", &[]).contains("line 2"));
        assert!(error(r#"{"h": [1], "J": [[0, 5, 1]]}"#, &[]).contains("qubits run from 0 to 0"));
        assert!(error(r#"{"h": []}"#, &[]).contains("no qubit"));
        assert!(error(r#"{"h": [1e999]}"#, &[]).contains("number out of range"));
        let ring = r#"{"h": [1, 1, 1], "J": [[0, 2, 1]]}"#;
        assert!(error(ring, &["--engine", "chain"]).contains("use --engine statevector"));
        assert!(error(PROBLEM, &["--gammas", "0.1,0.2", "--betas", "0.1"]).contains("2 gammas"));
        let layers = ["--layers", "2", "--gammas", "0.1", "--betas", "0.1"];
        assert!(error(PROBLEM, &layers).contains("leave --layers out"));
        assert!(error(PROBLEM, &["--gammas", "NaN", "--betas", "0.1"]).contains("must be finite"));
    }

    #[test]
    fn a_problem_too_large_for_the_machine_is_an_error_with_the_figure() {
        let problem = format!(r#"{{"h": {:?}, "J": [[0, 49, 1]]}}"#, vec![1.0; 50]);
        let error = with_problem(&problem, &[]).unwrap_err().to_string();
        assert!(error.contains("needs 34493956112 MiB for 50 qubits"), "{error}");
    }
}

//! Files that a command reads and writes.

use std::fs::File;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use super::CliError;
use super::options::SafetyArgs;
use crate::fence::FenceSet;
use crate::formats::{
    Fences, MAX_FILE_BYTES, Scenario, read_fences, read_mission, read_scenario, write_fence_text,
    write_geojson, write_kml, write_kmz, write_plan, write_waypoints, write_waypoints_fence,
    write_waypoints_rally,
};
use crate::mission::Mission;
use crate::replan::Verdict;
use crate::report::{Report, ReportError};
use crate::units::Metres;

/// A file that cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// Reading failed.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// Writing failed.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A suffix that no format has.
    #[error(
        "cannot tell the format of {}: the name must end in .plan, .waypoints, .fence, .rally, .fen, \
         .geojson, .kml, .kmz, .svg, .png or .html", .0.display()
    )]
    Suffix(PathBuf),
    /// A scenario without a mission.
    #[error("{}: there is no mission or route in it; add one, or give a file that has both", .0.display())]
    NoMission(PathBuf),
}

/// What the bytes of `--out FILE` are made from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OutFormat {
    /// QGroundControl `.plan`.
    Plan,
    /// `QGC WPL 110`.
    Waypoints,
    /// The fences as `QGC WPL 110`.
    Fence,
    /// The rally points as `QGC WPL 110`.
    Rally,
    /// The fence as ArduPilot's old fence text, which Mission Planner calls `.fen`.
    FenceText,
    /// GeoJSON.
    GeoJson,
    /// KML.
    Kml,
    /// Compressed KML.
    Kmz,
    /// A picture.
    Svg,
    /// The same in pixels.
    Png,
    /// The report.
    Html,
}

impl OutFormat {
    /// Whether it shows what a command came to, instead of holding a mission.
    #[must_use]
    pub fn is_shown(self) -> bool {
        matches!(self, Self::Svg | Self::Png | Self::Html)
    }
}

/// The format that a file's suffix asks for.
///
/// # Errors
/// [`FileError::Suffix`].
pub fn out_format(path: &Path) -> Result<OutFormat, FileError> {
    match path.extension().and_then(|suffix| suffix.to_str()) {
        Some("plan") => Ok(OutFormat::Plan),
        Some("waypoints") => Ok(OutFormat::Waypoints),
        Some("fence") => Ok(OutFormat::Fence),
        Some("rally") => Ok(OutFormat::Rally),
        Some("fen") => Ok(OutFormat::FenceText),
        Some("geojson") => Ok(OutFormat::GeoJson),
        Some("kml") => Ok(OutFormat::Kml),
        Some("kmz") => Ok(OutFormat::Kmz),
        Some("svg") => Ok(OutFormat::Svg),
        Some("png") => Ok(OutFormat::Png),
        Some("html") => Ok(OutFormat::Html),
        _ => Err(FileError::Suffix(path.to_owned())),
    }
}

/// Reads a scenario and the further fences that the options name.
///
/// # Errors
/// [`CliError::Usage`] naming the file and the place in it.
pub fn scenario(path: &Path, safety: &SafetyArgs) -> Result<Scenario, CliError> {
    let mut scenario = read_scenario(&path.to_string_lossy(), &bytes(path)?)?;
    for more in further_fences(safety) {
        let more = more?;
        add(&mut scenario.fences, &mut scenario.warnings, more.fences, more.warnings);
        scenario.kept.add_fences_of(more.kept);
    }
    Ok(scenario)
}

/// Reads the mission of a file.
///
/// # Errors
/// [`CliError::Usage`] naming the file and the place in it.
pub fn mission(path: &Path) -> Result<Mission, CliError> {
    Ok(read_mission(&path.to_string_lossy(), &bytes(path)?)?)
}

/// Adds the fences of `--fence` and `--obstacles`.
///
/// # Errors
/// [`CliError::Usage`] naming the file and the place in it.
pub fn add_fences(
    fences: &mut FenceSet,
    warnings: &mut Vec<String>,
    safety: &SafetyArgs,
) -> Result<(), CliError> {
    for more in further_fences(safety) {
        let more = more?;
        add(fences, warnings, more.fences, more.warnings);
    }
    Ok(())
}

/// What says that the files are most likely not the ones that were meant.
#[must_use]
pub fn doubt(fences: &FenceSet, verdict: &Verdict) -> Option<String> {
    /// Farther than missions go.
    const FAR: Metres = Metres(20_000.0);
    if fences.regions.is_empty() {
        let text = "no fence or obstacle was given, so nothing is in the way; name the files that \
                    hold them with --fence or --obstacles";
        return Some(text.to_owned());
    }
    let clearance = verdict.clearance();
    (clearance > FAR && clearance.0.is_finite()).then(|| {
        let km = clearance.0 / 1000.0;
        format!(
            "the nearest fence is {km:.0} km from the mission: are the files of the same place?"
        )
    })
}

/// The fences of `--fence` and `--obstacles`, file by file.
fn further_fences(safety: &SafetyArgs) -> impl Iterator<Item = Result<Fences, CliError>> {
    let files = safety.fence.iter().chain(&safety.obstacles);
    files.map(|path| Ok(read_fences(&path.to_string_lossy(), &bytes(path)?)?))
}

fn add(fences: &mut FenceSet, warnings: &mut Vec<String>, more: FenceSet, odd: Vec<String>) {
    fences.regions.extend(more.regions);
    fences.return_point = fences.return_point.or(more.return_point);
    warnings.extend(odd);
}

/// A file's bytes; one byte more than any reader takes, at the most.
///
/// # Errors
/// [`FileError::Read`].
pub fn bytes(path: &Path) -> Result<Vec<u8>, FileError> {
    let fail = |source| FileError::Read { path: path.to_owned(), source };
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(fail)?;
    file.take(MAX_FILE_BYTES as u64 + 1).read_to_end(&mut bytes).map_err(fail)?;
    Ok(bytes)
}

/// Writes a scenario (or the report on it, where the format is one) to each file, whole or not at all.
///
/// # Errors
/// [`CliError::Usage`] where a file cannot be written or its format cannot hold the mission.
pub fn write_all(
    paths: &[PathBuf],
    scenario: &Scenario,
    report: &Report<'_>,
) -> Result<(), CliError> {
    for path in paths {
        let undrawn = |error: ReportError| {
            CliError::Usage(format!("cannot draw {}: {error}", path.display()))
        };
        let unusable = |error: crate::formats::WriteError| {
            CliError::Usage(format!("cannot write {}: {error}", path.display()))
        };
        let bytes = match out_format(path)? {
            OutFormat::Plan => write_plan(scenario).map(String::into_bytes),
            OutFormat::Waypoints => write_waypoints(&scenario.mission).map(String::into_bytes),
            OutFormat::Fence => write_waypoints_fence(&scenario.fences).map(String::into_bytes),
            OutFormat::Rally => Ok(write_waypoints_rally(&scenario.rally).into_bytes()),
            OutFormat::FenceText => write_fence_text(&scenario.fences).map(String::into_bytes),
            OutFormat::GeoJson => write_geojson(scenario).map(String::into_bytes),
            OutFormat::Kml => write_kml(scenario).map(String::into_bytes),
            OutFormat::Kmz => write_kmz(scenario),
            OutFormat::Svg => Ok(report.svg().map_err(undrawn)?.into_bytes()),
            OutFormat::Png => Ok(report.png().map_err(undrawn)?),
            OutFormat::Html => Ok(report.html().map_err(undrawn)?.into_bytes()),
        };
        write(path, &bytes.map_err(unusable)?)?;
    }
    Ok(())
}

/// Writes the report to those of the files that are pictures or pages.
///
/// # Errors
/// As [`write_all`].
pub fn write_shown(paths: &[PathBuf], report: &Report<'_>) -> Result<(), CliError> {
    let is_shown = |path: &&PathBuf| out_format(path).is_ok_and(OutFormat::is_shown);
    let shown: Vec<PathBuf> = paths.iter().filter(is_shown).cloned().collect();
    write_all(&shown, &Scenario::default(), report)
}

/// The system's error alone: the place that `tempfile` adds is the temporary file's, which says
/// nothing to a reader.
fn without_place(error: io::Error) -> io::Error {
    match error.to_string().split_once(" at path ") {
        Some((what, _)) => io::Error::new(error.kind(), what),
        None => error,
    }
}

/// Replaces a file by new content, whole or not at all.
///
/// # Errors
/// [`FileError::Write`].
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    let fail = |error| FileError::Write { path: path.to_owned(), source: without_place(error) };
    let directory = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o644));
    }
    let mut file = builder.tempfile_in(directory).map_err(fail)?;
    file.write_all(bytes).map_err(fail)?;
    file.persist(path).map_err(|error| fail(error.error))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_cannot_be_written_is_named_and_no_other() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("missing").join("x.html");
        let told = write(&path, b"").unwrap_err().to_string();
        let expected =
            format!("cannot write {}: No such file or directory (os error 2)", path.display());
        assert_eq!(told, expected);
    }
}

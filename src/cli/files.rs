//! Files that a command reads and writes.

use std::fs::File;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use super::CliError;
use super::options::SafetyArgs;
use crate::fence::FenceSet;
use crate::formats::{
    MAX_FILE_BYTES, Scenario, read_fences, read_mission, read_scenario, write_geojson, write_kml,
    write_plan, write_waypoints,
};
use crate::geodesy::ProjectionError;
use crate::mission::Mission;

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
        "cannot tell the format of {}: the name must end in .plan, .waypoints, .geojson, .kml or \
         .svg", .0.display()
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
    /// GeoJSON.
    GeoJson,
    /// KML.
    Kml,
    /// A picture.
    Svg,
}

/// The format that a file's suffix asks for.
///
/// # Errors
/// [`FileError::Suffix`].
pub fn out_format(path: &Path) -> Result<OutFormat, FileError> {
    match path.extension().and_then(|suffix| suffix.to_str()) {
        Some("plan") => Ok(OutFormat::Plan),
        Some("waypoints") => Ok(OutFormat::Waypoints),
        Some("geojson") => Ok(OutFormat::GeoJson),
        Some("kml") => Ok(OutFormat::Kml),
        Some("svg") => Ok(OutFormat::Svg),
        _ => Err(FileError::Suffix(path.to_owned())),
    }
}

/// Reads a scenario and the further fences that the options name.
///
/// # Errors
/// [`CliError::Usage`] naming the file and the place in it.
pub fn scenario(path: &Path, safety: &SafetyArgs) -> Result<Scenario, CliError> {
    let mut scenario = read_scenario(&path.to_string_lossy(), &bytes(path)?)?;
    add_fences(&mut scenario.fences, &mut scenario.warnings, safety)?;
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
    for path in safety.fence.iter().chain(&safety.obstacles) {
        let more = read_fences(&path.to_string_lossy(), &bytes(path)?)?;
        fences.regions.extend(more.fences.regions);
        fences.return_point = fences.return_point.or(more.fences.return_point);
        warnings.extend(more.warnings);
    }
    Ok(())
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

/// Writes a scenario (or the picture, where the format is one) to each file, whole or not at all.
///
/// # Errors
/// [`CliError::Usage`] where a file cannot be written or its format cannot hold the mission.
pub fn write_all(
    paths: &[PathBuf],
    scenario: &Scenario,
    picture: impl Fn() -> Result<String, ProjectionError>,
) -> Result<(), CliError> {
    for path in paths {
        let unusable = |error: crate::formats::WriteError| {
            CliError::Usage(format!("cannot write {}: {error}", path.display()))
        };
        let text = match out_format(path)? {
            OutFormat::Plan => write_plan(scenario).map_err(unusable)?,
            OutFormat::Waypoints => write_waypoints(&scenario.mission).map_err(unusable)?,
            OutFormat::GeoJson => write_geojson(scenario).map_err(unusable)?,
            OutFormat::Kml => write_kml(scenario).map_err(unusable)?,
            OutFormat::Svg => picture().map_err(|error| {
                CliError::Usage(format!("cannot draw {}: {error}", path.display()))
            })?,
        };
        write(path, text.as_bytes())?;
    }
    Ok(())
}

/// Writes the picture to those of the files that are pictures.
///
/// # Errors
/// As [`write_all`].
pub fn write_pictures(
    paths: &[PathBuf],
    picture: impl Fn() -> Result<String, ProjectionError>,
) -> Result<(), CliError> {
    let pictures: Vec<PathBuf> = paths
        .iter()
        .filter(|path| matches!(out_format(path), Ok(OutFormat::Svg)))
        .cloned()
        .collect();
    write_all(&pictures, &Scenario::default(), picture)
}

/// Replaces a file by new content, whole or not at all.
///
/// # Errors
/// [`FileError::Write`].
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    let fail = |source| FileError::Write { path: path.to_owned(), source };
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

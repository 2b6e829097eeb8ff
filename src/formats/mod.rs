//! Files that people already have, read into missions and fences, and written back.
//!
//! Bytes in, values out, and the reverse; nothing here opens a file. [`read_scenario`] tells the
//! formats apart by their content, never by a suffix. What cannot be used is an error that names
//! the file, the place in it and what to do; nothing is dropped without a word: what was read
//! differently from how it may have been meant is in [`Scenario::warnings`].
//!
//! All positions are rounded to the 1e-7 degrees that a flight controller stores, so a mission
//! planned from a file and one planned from the vehicle are the same. Frames are those in degrees
//! (0, 3, 10), read as well as written: their `_INT` twins differ only on the wire.

pub mod error;
mod feature;
mod fence_text;
mod geojson;
mod item;
mod kept;
mod kml;
mod kmz;
mod plan;
mod waypoints;

pub use error::{FormatError, Place, Problem, WriteError};
pub use feature::DEFAULT_ROUTE_ALTITUDE;
pub use fence_text::write_fence_text;
pub use geojson::write_geojson;
pub use kept::Kept;
pub use kml::write_kml;
pub use kmz::write_kmz;
pub use plan::{plan_flattened, write_plan};
pub use waypoints::{write_waypoints, write_waypoints_fence, write_waypoints_rally};

use crate::fence::FenceSet;
use crate::mission::{Autopilot, Mission, MissionItem};
use error::Located;
use feature::Want;

/// The largest file that is read, bytes.
pub const MAX_FILE_BYTES: usize = 32 << 20;
/// The most mission items, fence items or rally points in a file: a sequence number has 16 bits.
pub const MAX_ITEMS: usize = 65_535;
/// The most regions in a file.
pub const MAX_REGIONS: usize = 65_536;
/// The most fence vertices in a file.
pub const MAX_VERTICES: usize = 1_000_000;

/// Everything that a file holds.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scenario {
    /// The mission; without items where the file holds none.
    pub mission: Mission,
    /// The fences; without regions where the file holds none.
    pub fences: FenceSet,
    /// The rally points: `MAV_CMD_NAV_RALLY_POINT` items, numbered from 0.
    pub rally: Vec<MissionItem>,
    /// For which vehicle it was drawn, where the file says so.
    pub vehicle: VehicleHint,
    /// What else the file holds, to be written back.
    pub kept: Kept,
    /// What was read differently from how it may have been meant, a sentence each.
    pub warnings: Vec<String>,
}

/// What a `.plan` says about the vehicle it was drawn for. Kept so that a plan written back opens
/// for the same vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VehicleHint {
    /// The autopilot.
    pub autopilot: Autopilot,
    /// `MAV_TYPE` of the vehicle; 2 is a quadrotor.
    pub vehicle_type: u8,
    /// Planned speed of a fixed wing, metres per second.
    pub cruise_speed: f64,
    /// Planned speed of a multirotor, metres per second.
    pub hover_speed: f64,
}

impl Default for VehicleHint {
    /// QGroundControl's own defaults: a multirotor, 15 m/s cruise, 5 m/s hover.
    fn default() -> Self {
        Self {
            autopilot: Autopilot::Unknown,
            vehicle_type: 2,
            cruise_speed: 15.0,
            hover_speed: 5.0,
        }
    }
}

/// The fences of a file, and what its reader should be told.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Fences {
    /// The regions and the return point.
    pub fences: FenceSet,
    /// What else the file holds about them, to be written back.
    pub kept: Kept,
    /// What was read differently from how it may have been meant, a sentence each.
    pub warnings: Vec<String>,
}

/// Reads any of the formats, told apart by content. `name` is what messages call the file.
///
/// # Errors
/// [`FormatError`] says where and why, and what to do.
pub fn read_scenario(name: &str, bytes: &[u8]) -> Result<Scenario, FormatError> {
    read_for(name, bytes, Want::Everything)
}

fn read_for(name: &str, bytes: &[u8], want: Want) -> Result<Scenario, FormatError> {
    let mut scenario = read(name, bytes, want).map_err(|located| located.in_file(name))?;
    for warning in &mut scenario.warnings {
        if !warning.starts_with(name) {
            *warning = format!("{name}, {warning}");
        }
    }
    Ok(scenario)
}

/// Reads the fences of a file for `--fence` and `--obstacles`. A mission in it is left out with a
/// warning.
///
/// # Errors
/// [`FormatError`] as [`read_scenario`], and where the file holds no region at all.
pub fn read_fences(name: &str, bytes: &[u8]) -> Result<Fences, FormatError> {
    let Scenario { mission, fences, kept, mut warnings, .. } = read_for(name, bytes, Want::Fences)?;
    if fences.regions.is_empty() {
        let what = "fence or obstacle in it".to_owned();
        let advice = "give a file with polygons or circles";
        return Err(Located::from(Problem::Missing { what, advice }).in_file(name));
    }
    if !mission.items.is_empty() {
        warnings.push(format!(
            "{name}: its route of {} items is not used, only its fences",
            mission.items.len()
        ));
    }
    Ok(Fences { fences, kept, warnings })
}

/// Reads the mission of a file; fences in it are left out.
///
/// # Errors
/// [`FormatError`] as [`read_scenario`], and where the file holds no mission.
pub fn read_mission(name: &str, bytes: &[u8]) -> Result<Mission, FormatError> {
    let Scenario { mission, .. } = read_scenario(name, bytes)?;
    if mission.items.is_empty() {
        let what = "mission in it".to_owned();
        let advice = "give a file with waypoints or a route";
        return Err(Located::from(Problem::Missing { what, advice }).in_file(name));
    }
    Ok(mission)
}

fn read(name: &str, bytes: &[u8], want: Want) -> Result<Scenario, Located> {
    if bytes.len() > MAX_FILE_BYTES {
        return Err(Problem::TooLarge { bytes: bytes.len(), limit: MAX_FILE_BYTES }.into());
    }
    if bytes.starts_with(kmz::MAGIC) {
        let (document, further) = kmz::unpacked(bytes)?;
        let mut scenario = kml::read(name, text_of(&document)?, want)?;
        if further > 0 {
            scenario.warnings.push(format!(
                "{further} further KML documents in the archive are not read; if there are \
                 obstacles in them, give each file with --obstacles"
            ));
        }
        return Ok(scenario);
    }
    let text = text_of(bytes)?;
    let start = text.trim_start();
    if start.starts_with('{') {
        return read_json(name, text, want);
    }
    if start.starts_with('<') {
        return kml::read(name, text, want);
    }
    let first = text.lines().map(str::trim).find(|line| !line.is_empty() && !line.starts_with('#'));
    match first {
        Some(line) if line.starts_with("QGC WPL") => waypoints::read(name, text),
        Some(line) if fence_text::is_position(line) => fence_text::read(name, text),
        Some(line) if fence_text::is_rally(line) => fence_text::read_rally(text),
        Some(_) => Err(Problem::UnknownFormat.into()),
        None => Err(Problem::Empty.into()),
    }
}

/// The bytes as text, without a byte order mark.
fn text_of(bytes: &[u8]) -> Result<&str, Located> {
    let text =
        std::str::from_utf8(bytes).map_err(|error| Problem::NotText { at: error.valid_up_to() })?;
    Ok(text.strip_prefix('\u{feff}').unwrap_or(text))
}

/// What tells the JSON formats apart; the rest of the document is passed over.
#[derive(serde::Deserialize)]
struct JsonKind {
    #[serde(rename = "fileType")]
    file_type: Option<serde_json::Value>,
    #[serde(rename = "type")]
    kind: Option<serde_json::Value>,
}

fn read_json(name: &str, text: &str, want: Want) -> Result<Scenario, Located> {
    let JsonKind { file_type, kind } =
        serde_json::from_str(text).map_err(|error| Problem::Json(error.to_string()))?;
    match (file_type.as_ref().and_then(|v| v.as_str()), kind.as_ref().and_then(|v| v.as_str())) {
        (Some("Plan"), _) => plan::read(name, text),
        (Some(other), _) => Err(Problem::NotSupported {
            what: format!("this is a QGroundControl file of type {other:?}, not a Plan"),
            advice: "open it in QGroundControl and save it as a plan",
        }
        .into()),
        (None, Some(_)) => geojson::read(name, text, want),
        (None, None) => Err(Problem::UnknownFormat.into()),
    }
}

#[cfg(test)]
mod tests;

//! Landing patterns: the complex items of a `.plan` that do not hold what is flown but what it is
//! computed from. QGroundControl turns one into `DO_LAND_START`, the commands that stop the
//! camera, the final approach and the landing. (QGroundControl, LandingComplexItem.)

use serde::Deserialize;

use crate::formats::error::Problem;
use crate::formats::item::FileItem;

pub(super) const WAYPOINT: u16 = 16;
const LAND: u16 = 21;
const LOITER_TO_ALT: u16 = 31;
const VTOL_LAND: u16 = 85;
const DO_LAND_START: u16 = 189;
pub(super) const DO_SET_CAM_TRIGG_DIST: u16 = 206;
const IMAGE_STOP_CAPTURE: u16 = 2001;
const VIDEO_STOP_CAPTURE: u16 = 2501;
const FRAME_GLOBAL: u8 = 0;
pub(super) const FRAME_MISSION: u8 = 2;
pub(super) const FRAME_RELATIVE: u8 = 3;
pub(super) const NAN: f64 = f64::NAN;

/// The keys of `fwLandingPattern` and `vtolLandingPattern`. Coordinates are `[lat, lon, altitude]`.
#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct LandingPattern {
    landing_approach_coordinate: Option<Vec<f64>>,
    /// The approach's key in older plans.
    loiter_coordinate: Option<Vec<f64>>,
    land_coordinate: Option<Vec<f64>>,
    loiter_radius: Option<f64>,
    loiter_clockwise: Option<bool>,
    altitudes_are_relative: Option<bool>,
    use_loiter_to_alt: Option<bool>,
    stop_taking_photos: Option<bool>,
    #[serde(alias = "stopVideoPhotos")]
    stop_taking_video: Option<bool>,
}

pub(super) fn is_landing_pattern(kind: &str) -> bool {
    matches!(kind, "fwLandingPattern" | "vtolLandingPattern")
}

impl LandingPattern {
    /// The items that QGroundControl uploads for this pattern.
    pub(super) fn items(&self, kind: &str) -> Result<Vec<FileItem>, Problem> {
        let missing = |key: &str| Problem::Missing {
            what: format!("{key} in this {kind} item"),
            advice: "open the plan in a current QGroundControl and save it again",
        };
        let approach =
            self.landing_approach_coordinate.as_ref().or(self.loiter_coordinate.as_ref());
        let approach = coordinate(approach).ok_or_else(|| missing("landingApproachCoordinate"))?;
        let land = coordinate(self.land_coordinate.as_ref());
        let land = land.ok_or_else(|| missing("landCoordinate"))?;
        let relative = self.altitudes_are_relative;
        let relative = relative.ok_or_else(|| missing("altitudesAreRelative"))?;
        let frame = if relative { FRAME_RELATIVE } else { FRAME_GLOBAL };

        let mut items = vec![item(DO_LAND_START, FRAME_MISSION, [0.0; 4], [0.0; 3])];
        if self.stop_taking_photos.unwrap_or(false) {
            items.push(item(DO_SET_CAM_TRIGG_DIST, FRAME_MISSION, [0.0; 4], [0.0; 3]));
            items.push(item(IMAGE_STOP_CAPTURE, FRAME_MISSION, [0.0, NAN, NAN, NAN], [NAN; 3]));
        }
        if self.stop_taking_video.unwrap_or(false) {
            items.push(item(VIDEO_STOP_CAPTURE, FRAME_MISSION, [0.0, NAN, NAN, NAN], [NAN; 3]));
        }
        items.push(if self.use_loiter_to_alt.unwrap_or(true) {
            let radius = self.loiter_radius.ok_or_else(|| missing("loiterRadius"))?;
            let clockwise = self.loiter_clockwise.ok_or_else(|| missing("loiterClockwise"))?;
            let radius = if clockwise { radius } else { -radius };
            item(LOITER_TO_ALT, frame, [1.0, radius, 0.0, 1.0], approach)
        } else {
            item(WAYPOINT, frame, [0.0, 0.0, 0.0, NAN], approach)
        });
        let command = if kind == "fwLandingPattern" { LAND } else { VTOL_LAND };
        items.push(item(command, frame, [0.0; 4], land));
        Ok(items)
    }
}

fn coordinate(values: Option<&Vec<f64>>) -> Option<[f64; 3]> {
    values?.as_slice().try_into().ok()
}

pub(super) fn item(command: u16, frame: u8, params: [f64; 4], place: [f64; 3]) -> FileItem {
    let [p1, p2, p3, p4] = params;
    let [p5, p6, p7] = place;
    FileItem { command, frame, params: [p1, p2, p3, p4, p5, p6, p7], autocontinue: true }
}

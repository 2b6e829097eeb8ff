//! One mission item as files write it (seven numbers, positions in degrees) to and from a
//! [`MissionItem`] (positions in 1e-7 degrees), and jump targets to and from a file's numbering.

use serde_json::Value;

use super::error::{Problem, WriteError};
use crate::geodesy::{LatLon, PositionError};
use crate::mission::{Command, Frame, Mission, MissionItem};

/// `MAV_CMD_DO_DIGICAM_CONFIGURE`.
const DO_DIGICAM_CONFIGURE: u16 = 202;
/// `MAV_CMD_DO_DIGICAM_CONTROL`.
const DO_DIGICAM_CONTROL: u16 = 203;
/// `MAV_CMD_NAV_ATTITUDE_TIME`.
const NAV_ATTITUDE_TIME: u16 = 42703;

/// An item as a file holds it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FileItem {
    pub(super) command: u16,
    pub(super) frame: u8,
    /// `param1` to `param7`; NaN where the file says "unset". 5 and 6 are degrees where the item
    /// has a place.
    pub(super) params: [f64; 7],
    pub(super) autocontinue: bool,
}

impl FileItem {
    /// The item for the wire, with `seq`. `current` is 0: which item to start with is not a
    /// matter of a file, and 2 or 3 would make ArduPilot fly there at once.
    pub(super) fn to_item(&self, seq: u16) -> Result<MissionItem, Problem> {
        let frame = in_degrees(Frame(self.frame));
        let command = Command(self.command);
        let [p1, p2, p3, p4, p5, p6, p7] = self.params;
        let mut params = [0.0; 4];
        for (number, (param, value)) in params.iter_mut().zip([p1, p2, p3, p4]).enumerate() {
            *param = float(value, || format!("param {}", number + 1))?;
        }
        let (x, y) = if holds_degrees(command, frame) {
            if command <= Command::NAV_LAST && !p5.is_nan() && !p6.is_nan() {
                place("position", p5, p6)?;
            }
            (scaled(p5, "param 5 (latitude)")?, scaled(p6, "param 6 (longitude)")?)
        } else {
            (whole(p5, "param 5")?, whole(p6, "param 6")?)
        };
        let z = if p7.is_nan() && command <= Command::NAV_LAST && (x, y) != (0, 0) {
            return Err(Problem::Missing {
                what: "altitude".to_owned(),
                advice: "give the item an altitude",
            });
        } else {
            float(p7, || "param 7 (altitude)".to_owned())?
        };
        let autocontinue = u8::from(self.autocontinue);
        Ok(MissionItem { seq, frame, command, current: 0, autocontinue, params, x, y, z })
    }

    /// The item as files hold it.
    pub(super) fn from_item(item: &MissionItem) -> Self {
        let [p1, p2, p3, p4] = item.params.map(decimal);
        let (p5, p6) = if holds_degrees(item.command, item.frame) {
            (f64::from(item.x) / 1e7, f64::from(item.y) / 1e7)
        } else {
            (f64::from(item.x), f64::from(item.y))
        };
        Self {
            command: item.command.0,
            frame: in_degrees(item.frame).0,
            params: [p1, p2, p3, p4, p5, p6, decimal(item.z)],
            autocontinue: item.autocontinue != 0,
        }
    }
}

/// The frame without its `_INT`: a file holds degrees, and ground stations edit only these.
pub(super) fn in_degrees(frame: Frame) -> Frame {
    match frame {
        Frame::GLOBAL_INT => Frame::GLOBAL,
        Frame::GLOBAL_RELATIVE_ALT_INT => Frame::GLOBAL_RELATIVE_ALT,
        Frame::GLOBAL_TERRAIN_ALT_INT => Frame::GLOBAL_TERRAIN_ALT,
        other => other,
    }
}

/// Whether x and y are degrees times 1e7: in a global frame, but for the three commands whose
/// params 5 and 6 ArduPilot and ground stations carry unscaled in any frame.
pub(super) fn holds_degrees(command: Command, frame: Frame) -> bool {
    let unscaled = [DO_DIGICAM_CONFIGURE, DO_DIGICAM_CONTROL, NAV_ATTITUDE_TIME];
    frame.is_global() && !unscaled.contains(&command.0)
}

/// A position rounded to 1e-7 degrees, as a vehicle stores it.
pub(super) fn place(what: &str, lat: f64, lon: f64) -> Result<LatLon, Problem> {
    rounded(lat, lon).map_err(|error| Problem::Position { what: what.to_owned(), error })
}

fn rounded(lat: f64, lon: f64) -> Result<LatLon, PositionError> {
    LatLon::new(lat, lon)?.to_e7().to_degrees()
}

/// A finite `f32`, or NaN for "unset".
pub(super) fn float(value: f64, what: impl Fn() -> String) -> Result<f32, Problem> {
    let narrow = value as f32;
    if narrow.is_infinite() {
        return Err(Problem::Value {
            what: what(),
            found: value.to_string(),
            expected: "a number that a 32-bit float can hold",
        });
    }
    Ok(narrow)
}

/// The `f64` with the same shortest decimal as an `f32`, so that 0.1 is written 0.1.
pub(super) fn decimal(value: f32) -> f64 {
    value.to_string().parse().unwrap_or(f64::from(value))
}

/// A JSON number as people write it: `5`, not `5.0`; `null` for NaN.
pub(super) fn json_number(value: f64) -> Value {
    let exact = value.fract() == 0.0 && value.abs() < 1e15;
    if exact && value.to_bits() != (-0.0f64).to_bits() {
        return Value::from(value as i64); // below 1e15, so exact
    }
    Value::from(value)
}

fn scaled(degrees: f64, what: &str) -> Result<i32, Problem> {
    whole(degrees * 1e7, what)
}

/// The nearest `i32`; NaN ("unset") is 0, MAVLink's own way to say "here" in an integer.
fn whole(value: f64, what: &str) -> Result<i32, Problem> {
    let nearest = value.round();
    if nearest.abs() > f64::from(i32::MAX) {
        return Err(Problem::Value {
            what: what.to_owned(),
            found: value.to_string(),
            expected: "small enough for a 32-bit integer",
        });
    }
    Ok(if nearest.is_nan() { 0 } else { nearest as i32 })
}

/// Rewrites every `DO_JUMP` target from a file's numbers to indices. `index_of` finds the index
/// that a file's number stands for. An error comes with the index of the jumping item.
pub(super) fn jumps_to_indices(
    items: &mut [MissionItem],
    index_of: impl Fn(f64) -> Option<usize>,
) -> Result<(), (usize, Problem)> {
    for item in items.iter_mut().filter(|item| item.command == Command::DO_JUMP) {
        let target = decimal(item.params[0]);
        let Some(index) = index_of(target) else {
            let problem = Problem::Value {
                what: "the target of DO_JUMP (param 1)".to_owned(),
                found: target.to_string(),
                expected: "the number of another item of this mission",
            };
            return Err((usize::from(item.seq), problem));
        };
        item.params[0] = index as f32; // at most 65535: exact
    }
    Ok(())
}

/// The mission's items with `DO_JUMP` targets counted from `first` instead of 0.
pub(super) fn jumps_from_indices(
    mission: &Mission,
    first: usize,
) -> Result<Vec<MissionItem>, WriteError> {
    let mut items = mission.items.clone();
    for (index, item) in items.iter_mut().enumerate() {
        if item.command == Command::DO_JUMP {
            let target = item.params[0];
            if !index_in(mission.items.len(), f64::from(target)) {
                let target = f64::from(target) + 1.0;
                return Err(WriteError::JumpTarget { item: index + 1, target });
            }
            item.params[0] = target + first as f32;
        }
    }
    Ok(items)
}

/// Whether `value` is an index below `len`.
pub(super) fn index_in(len: usize, value: f64) -> bool {
    value.fract() == 0.0 && value >= 0.0 && value < len as f64
}

/// A whole number from 0 to `max`, as JSON may write it (`16` or `16.0`).
pub(super) fn natural(value: f64, max: u16, what: &str) -> Result<u16, Problem> {
    if value.fract() == 0.0 && (0.0..=f64::from(max)).contains(&value) {
        Ok(value as u16)
    } else {
        Err(Problem::Value {
            what: what.to_owned(),
            found: value.to_string(),
            expected: if max == 255 {
                "a whole number from 0 to 255"
            } else {
                "a whole number from 0 to 65535"
            },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn item(command: u16, frame: u8, params: [f64; 7]) -> MissionItem {
        FileItem { command, frame, params, autocontinue: true }.to_item(0).unwrap()
    }

    #[test]
    fn an_integer_frame_becomes_its_twin_in_degrees() {
        let place = [0.0, 0.0, 0.0, 0.0, 47.0, 8.0, 30.0];
        let frames = [5, 6, 11].map(|frame| item(16, frame, place).frame.0);
        assert_eq!(frames, [0, 3, 10]);
        let from_vehicle = MissionItem { frame: Frame(6), ..item(16, 3, place) };
        assert_eq!(FileItem::from_item(&from_vehicle).frame, 3);
    }

    #[test]
    fn camera_commands_and_frames_without_a_place_are_not_scaled() {
        let shoot = [0.0, 0.0, 0.0, 0.0, 1.0, 7.0, 0.0];
        assert_eq!((item(203, 3, shoot).x, item(203, 3, shoot).y), (1, 7));
        assert_eq!(item(205, 2, shoot).x, 1);
        assert_eq!(item(16, 3, shoot).x, 10_000_000);
    }

    #[test]
    fn an_unset_place_is_here_and_needs_no_altitude() {
        const UNSET: f64 = f64::NAN;
        let land = item(21, 3, [0.0, 0.0, 0.0, UNSET, UNSET, UNSET, UNSET]);
        assert_eq!((land.x, land.y), (0, 0));
    }

    #[test]
    fn a_decimal_stays_the_decimal_it_was() {
        assert_eq!(decimal(0.1), 0.1);
        assert_eq!(json_number(5.0).to_string(), "5");
        assert_eq!(json_number(-0.0).to_string(), "-0.0");
        assert_eq!(json_number(f64::NAN), Value::Null);
    }

    #[test]
    fn numbers_that_do_not_fit_are_errors() {
        let too_large = |params| {
            let item = FileItem { command: 178, frame: 3, params, autocontinue: true };
            item.to_item(0).unwrap_err().to_string()
        };
        assert!(too_large([0.0, 1e39, 0.0, 0.0, 0.0, 0.0, 0.0]).starts_with("param 2 is"));
        assert!(too_large([0.0, 0.0, 0.0, 0.0, 215.0, 0.0, 0.0]).starts_with("param 5"));
        assert!(
            too_large(
                [0.0; 6]
                    .iter()
                    .copied()
                    .chain([f64::INFINITY])
                    .collect::<Vec<_>>()
                    .try_into()
                    .unwrap()
            )
            .starts_with("param 7")
        );
    }
}

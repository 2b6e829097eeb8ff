//! Reading a `.plan`.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use serde::Deserialize;

use super::fence::{GeoFence, read_fence};
use super::kept::KeptPlan;
use super::{OBJECT_VERSION, complex, structure_scan};
use crate::formats::error::{Located, Place, Problem};
use crate::formats::item::{FileItem, float, jumps_to_indices, natural, place};
use crate::formats::{MAX_ITEMS, Scenario, VehicleHint};
use crate::geodesy::LatLon;
use crate::mission::Autopilot;
use crate::mission::{Command, Frame, Home, Mission, MissionItem};

/// `null` is NaN, as QGroundControl writes "unset".
pub(super) type Number = Option<f64>;

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct PlanFile {
    mission: Option<PlanMission>,
    geo_fence: Option<GeoFence>,
    rally_points: Option<RallyPoints>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct PlanMission {
    version: Number,
    #[serde(default)]
    items: Vec<PlanItem>,
    planned_home_position: Option<Vec<Number>>,
    firmware_type: Number,
    vehicle_type: Number,
    cruise_speed: Number,
    hover_speed: Number,
}

/// An item of any type; which keys it must have depends on `type`.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct PlanItem {
    #[serde(rename = "type")]
    kind: Option<String>,
    command: Number,
    frame: Number,
    params: Option<Vec<Number>>,
    /// Version 2 items keep params 5 to 7 here.
    coordinate: Option<Vec<Number>>,
    auto_continue: Option<bool>,
    do_jump_id: Number,
    complex_item_type: Option<String>,
    #[serde(rename = "TransectStyleComplexItem")]
    transect: Option<Transect>,
    #[serde(flatten)]
    landing: complex::LandingPattern,
    #[serde(flatten)]
    scan: structure_scan::StructureScan,
}

#[derive(Deserialize)]
struct Transect {
    #[serde(rename = "Items")]
    items: Option<Vec<PlanItem>>,
}

#[derive(Deserialize)]
struct RallyPoints {
    #[serde(default)]
    points: Vec<Vec<Number>>,
}

pub(in crate::formats) fn read(name: &str, text: &str) -> Result<Scenario, Located> {
    let file: PlanFile =
        serde_json::from_str(text).map_err(|error| Problem::Json(error.to_string()))?;
    let mut scenario = Scenario::default();
    if let Some(mission) = file.mission {
        scenario.vehicle = vehicle(&mission);
        let (mission, counts) = read_mission(mission)?;
        scenario.kept.plan = KeptPlan::new(text, &counts, &mission.items);
        scenario.mission = mission;
    }
    if let Some(fence) = file.geo_fence {
        scenario.fences = read_fence(name, fence, &mut scenario.warnings)?;
    }
    let points = file.rally_points.map(|rally| rally.points).unwrap_or_default();
    scenario.rally = read_rally(&points)?;
    Ok(scenario)
}

fn vehicle(mission: &PlanMission) -> VehicleHint {
    let default = VehicleHint::default();
    let speed = |value: Number, default| value.filter(|v| v.is_finite()).unwrap_or(default);
    VehicleHint {
        autopilot: match mission.firmware_type {
            Some(3.0) => Autopilot::ArduPilot,
            Some(12.0) => Autopilot::Px4,
            _ => Autopilot::Unknown,
        },
        vehicle_type: mission
            .vehicle_type
            .and_then(|value| natural(value, 255, "vehicleType").ok())
            .map_or(default.vehicle_type, |value| value as u8), // at most 255
        cruise_speed: speed(mission.cruise_speed, default.cruise_speed),
        hover_speed: speed(mission.hover_speed, default.hover_speed),
    }
}

pub(super) fn check_version(version: Number, what: &str) -> Result<(), Located> {
    match version {
        Some(number) if number != OBJECT_VERSION => Err(Problem::NotSupported {
            what: format!("{what} has version {number}, quavd reads version {OBJECT_VERSION}"),
            advice: "open it in a current QGroundControl and save it again",
        }
        .into()),
        _ => Ok(()),
    }
}

/// The mission, and how many of its items each entry of the file's list stands for.
fn read_mission(mission: PlanMission) -> Result<(Mission, Vec<usize>), Located> {
    check_version(mission.version, "the mission")?;
    let home = match mission.planned_home_position.as_deref() {
        None => None,
        Some(position) => home(position).map_err(|problem| problem.at(Place::Home))?,
    };
    let mut flat = Flat::default();
    let mut counts = Vec::with_capacity(mission.items.len());
    for (index, item) in mission.items.into_iter().enumerate() {
        let before = flat.items.len();
        flat.add(index + 1, item)?;
        counts.push(flat.items.len() - before);
    }
    let Flat { mut items, numbers, ids } = flat;
    let index_of = |target: f64| ids.get(&target.to_bits()).copied().flatten();
    jumps_to_indices(&mut items, index_of).map_err(|(index, problem)| {
        problem.at(numbers.get(index).map_or(Place::File, |number| Place::MissionItem(*number)))
    })?;
    Ok((Mission { home, items }, counts))
}

/// Home; zeros, as a plan without a home has them, are no home.
fn home(coordinate: &[Number]) -> Result<Option<Home>, Problem> {
    let home = place_with_altitude("home", coordinate)?
        .map(|(position, altitude_amsl)| Home { position, altitude_amsl });
    Ok(home.filter(|home| (home.position.lat(), home.position.lon()) != (0.0, 0.0)))
}

/// `[lat, lon, altitude]`, and nothing where a null says so.
pub(super) fn place_with_altitude(
    what: &str,
    coordinate: &[Number],
) -> Result<Option<(LatLon, f32)>, Problem> {
    match coordinate {
        [None, ..] | [_, None, ..] => Ok(None),
        [Some(lat), Some(lon), rest @ ..] => {
            let position = place(what, *lat, *lon)?;
            let altitude = rest.first().copied().flatten().unwrap_or(0.0);
            Ok(Some((position, float(altitude, || format!("the altitude of {what}"))?)))
        }
        _ => Err(Problem::Value {
            what: what.to_owned(),
            found: format!("{} numbers", coordinate.len()),
            expected: "[latitude, longitude, altitude]",
        }),
    }
}

/// The items as they would be uploaded: complex ones as the items they stand for.
#[derive(Default)]
struct Flat {
    items: Vec<MissionItem>,
    /// For each item, the number under which messages know it: its place in the file's list.
    numbers: Vec<usize>,
    /// Index by `doJumpId` (the bits of the number); `None` where two items share one.
    ids: HashMap<u64, Option<usize>>,
}

impl Flat {
    fn add(&mut self, number: usize, item: PlanItem) -> Result<(), Located> {
        let at = |problem: Problem| problem.at(Place::MissionItem(number));
        match item.kind.as_deref() {
            // Items of the very first versions have no type or a lower-case one.
            None | Some("SimpleItem" | "missionItem") => {
                let simple = simple(&item).map_err(at)?;
                self.push(number, item.do_jump_id, &simple)
            }
            Some("ComplexItem") => self.add_complex(number, item),
            Some(other) => Err(at(Problem::NotSupported {
                what: format!("this item is of type {other:?}, which quavd does not know"),
                advice: "replace it by waypoints in QGroundControl",
            })),
        }
    }

    fn add_complex(&mut self, number: usize, item: PlanItem) -> Result<(), Located> {
        let at = |problem: Problem| problem.at(Place::MissionItem(number));
        let kind = item.complex_item_type.as_deref().unwrap_or("");
        if let Some(items) = item.transect.and_then(|transect| transect.items) {
            for inner in items {
                let simple = simple(&inner).map_err(at)?;
                self.push(number, inner.do_jump_id, &simple)?;
            }
            return Ok(());
        }
        let computed = if complex::is_landing_pattern(kind) {
            item.landing.items(kind)
        } else if structure_scan::is_structure_scan(kind) {
            item.scan.items()
        } else {
            Err(Problem::NotSupported {
                what: format!("the complex item {kind:?} does not say what is flown"),
                advice: "upload the plan to a vehicle and read it from there, or replace the item \
                         by waypoints in QGroundControl",
            })
        };
        computed.map_err(at)?.iter().try_for_each(|simple| self.push(number, None, simple))
    }

    fn push(&mut self, number: usize, id: Number, item: &FileItem) -> Result<(), Located> {
        let index = self.items.len();
        if index >= MAX_ITEMS {
            let problem = Problem::TooMany { what: "mission items", limit: MAX_ITEMS };
            return Err(problem.at(Place::MissionItem(number)));
        }
        // Below MAX_ITEMS, so it fits 16 bits.
        let item = item.to_item(index as u16);
        self.items.push(item.map_err(|problem| problem.at(Place::MissionItem(number)))?);
        self.numbers.push(number);
        // Without an id QGroundControl counts from 1: home is 0.
        let id = id.unwrap_or(index as f64 + 1.0);
        match self.ids.entry(id.to_bits()) {
            Entry::Occupied(mut taken) => drop(taken.insert(None)),
            Entry::Vacant(free) => drop(free.insert(Some(index))),
        }
        Ok(())
    }
}

fn simple(item: &PlanItem) -> Result<FileItem, Problem> {
    let missing = |key: &str| Problem::Missing {
        what: format!("{key} in this item"),
        advice: "open the plan in QGroundControl and save it again",
    };
    let command = natural(item.command.ok_or_else(|| missing("command"))?, u16::MAX, "command")?;
    let frame = natural(item.frame.ok_or_else(|| missing("frame"))?, 255, "frame")?;
    let mut values = item.params.clone().ok_or_else(|| missing("params"))?;
    values.extend(item.coordinate.iter().flatten());
    let Ok(params) = <[Number; 7]>::try_from(values.as_slice()) else {
        return Err(Problem::Value {
            what: "the number of params".to_owned(),
            found: values.len().to_string(),
            expected: "7",
        });
    };
    Ok(FileItem {
        command,
        frame: frame as u8, // at most 255
        params: params.map(|param| param.unwrap_or(f64::NAN)),
        autocontinue: item.auto_continue.unwrap_or(true),
    })
}

fn read_rally(points: &[Vec<Number>]) -> Result<Vec<MissionItem>, Located> {
    if points.len() > MAX_ITEMS {
        return Err(Problem::TooMany { what: "rally points", limit: MAX_ITEMS }.into());
    }
    let point = |(index, point): (usize, &Vec<Number>)| {
        let &[Some(lat), Some(lon), Some(altitude)] = point.as_slice() else {
            return Err(Problem::Value {
                what: "the point".to_owned(),
                found: format!("{point:?}"),
                expected: "[latitude, longitude, altitude]",
            }
            .at(Place::RallyPoint(index + 1)));
        };
        let item = FileItem {
            command: Command::NAV_RALLY_POINT.0,
            frame: Frame::GLOBAL_RELATIVE_ALT.0,
            params: [0.0, 0.0, 0.0, 0.0, lat, lon, altitude],
            autocontinue: true,
        };
        place("position", lat, lon)
            .and_then(|_| item.to_item(index as u16)) // at most MAX_ITEMS
            .map_err(|problem| problem.at(Place::RallyPoint(index + 1)))
    };
    points.iter().enumerate().map(point).collect()
}

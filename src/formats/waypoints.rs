//! `QGC WPL 110`, the text format of waypoint files: one item per line, `seq current frame command
//! param1-4 latitude longitude altitude autocontinue`, separated by tabs or spaces.
//!
//! Item 0 of a mission is home; `DO_JUMP` targets count it. MAVProxy and Mission Planner use the
//! same format for fences (commands 5000 to 5004) and rally points (5100), there without home.

use std::fmt::Write as _;

use super::error::{Located, Place, Problem, WriteError};
use super::item::{FileItem, jumps_from_indices, jumps_to_indices, natural, place};
use super::{MAX_ITEMS, Scenario};
use crate::fence::{DecodedFence, FenceSet, decode_fence, encode_fence};
use crate::mission::{Command, Home, Mission, MissionItem};

const HEADER: &str = "QGC WPL 110";

/// A line of the file.
struct Row {
    line: usize,
    seq: u16,
    item: FileItem,
}

pub(super) fn read(name: &str, text: &str) -> Result<Scenario, Located> {
    let rows = rows(text)?;
    let is_fence = |row: &Row| (5000..=5004).contains(&row.item.command);
    let is_rally = |row: &Row| row.item.command == Command::NAV_RALLY_POINT.0;
    if !rows.iter().any(|row| is_fence(row) || is_rally(row)) {
        return Ok(Scenario { mission: mission(&rows)?, ..Scenario::default() });
    }
    // A home line at the top of a fence or rally file is no part of it.
    let rest = match rows.first() {
        Some(row) if matches!(row.item.command, 0 | 16) => &rows[1..],
        _ => &rows[..],
    };
    if let Some(row) = rest.iter().find(|row| !is_fence(row) && !is_rally(row)) {
        let what = format!("command {} stands among fence or rally items", row.item.command);
        let advice = "keep mission, fence and rally points in separate files";
        return Err(Problem::Conflict { what, advice }.at(Place::Line(row.line)));
    }
    let (fence_rows, rally_rows): (Vec<_>, Vec<_>) = rest.iter().partition(|row| is_fence(row));
    let DecodedFence { fences, warnings } = fence(name, &fence_rows)?;
    let rally = items(&rally_rows)?;
    for (row, item) in rally_rows.iter().zip(&rally) {
        if !item.frame.is_global() {
            let problem = Problem::Value {
                what: "the frame of a rally point".to_owned(),
                found: row.item.frame.to_string(),
                expected: "one with latitude and longitude (0, 3 or 10)",
            };
            return Err(problem.at(Place::Line(row.line)));
        }
        let [.., lat, lon, _] = row.item.params;
        place("rally point", lat, lon).map_err(|problem| problem.at(Place::Line(row.line)))?;
        if item.z.is_nan() {
            let problem = Problem::Missing {
                what: "altitude".to_owned(),
                advice: "give the rally point an altitude",
            };
            return Err(problem.at(Place::Line(row.line)));
        }
    }
    Ok(Scenario { fences, rally, warnings, ..Scenario::default() })
}

fn rows(text: &str) -> Result<Vec<Row>, Located> {
    let mut rows = Vec::new();
    let lines = text.lines().enumerate().map(|(index, line)| (index + 1, line.trim()));
    let mut lines = lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let (number, header) = lines.next().unwrap_or((1, ""));
    if header.split_whitespace().ne(HEADER.split_whitespace()) {
        let what = format!("the header is {header:?}, not {HEADER:?}");
        let advice = "save the file again from a current ground station";
        return Err(Problem::NotSupported { what, advice }.at(Place::Line(number)));
    }
    for (line, content) in lines {
        if rows.len() > MAX_ITEMS {
            let problem = Problem::TooMany { what: "items", limit: MAX_ITEMS };
            return Err(problem.at(Place::Line(line)));
        }
        rows.push(row(line, content).map_err(|problem| problem.at(Place::Line(line)))?);
    }
    Ok(rows)
}

fn row(line: usize, content: &str) -> Result<Row, Problem> {
    let mut values = [0.0; 12];
    let mut count = 0;
    for word in content.split_whitespace() {
        let value: f64 = word.parse().map_err(|_| Problem::Value {
            what: format!("value {}", count + 1),
            found: format!("{word:?}"),
            expected: "a number with a decimal point",
        })?;
        if let Some(slot) = values.get_mut(count) {
            *slot = value;
        }
        count += 1;
    }
    if count != values.len() {
        return Err(Problem::Value {
            what: "the number of values on this line".to_owned(),
            found: count.to_string(),
            expected: "12: seq current frame command param1-4 latitude longitude altitude \
                       autocontinue",
        });
    }
    let [seq, current, frame, command, p1, p2, p3, p4, p5, p6, p7, autocontinue] = values;
    natural(current, 255, "current")?;
    let item = FileItem {
        command: natural(command, u16::MAX, "command")?,
        frame: natural(frame, 255, "frame")? as u8, // at most 255, just checked
        params: [p1, p2, p3, p4, p5, p6, p7],
        autocontinue: natural(autocontinue, 255, "autocontinue")? != 0,
    };
    Ok(Row { line, seq: natural(seq, u16::MAX, "seq")?, item })
}

fn items(rows: &[&Row]) -> Result<Vec<MissionItem>, Located> {
    let item = |(index, row): (usize, &&Row)| {
        // Never more than MAX_ITEMS rows after home.
        row.item.to_item(index as u16).map_err(|problem| problem.at(Place::Line(row.line)))
    };
    rows.iter().enumerate().map(item).collect()
}

fn fence(name: &str, rows: &[&Row]) -> Result<DecodedFence, Located> {
    decode_fence(&items(rows)?, Some(name)).map_err(|error| {
        let line = rows.get(error.index).map_or(Place::File, |row| Place::Line(row.line));
        Problem::Fence { index: error.index, problem: error.problem }.at(line)
    })
}

fn mission(rows: &[Row]) -> Result<Mission, Located> {
    for (index, row) in rows.iter().enumerate() {
        if usize::from(row.seq) != index {
            let problem = Problem::Value {
                what: "the item's number".to_owned(),
                found: row.seq.to_string(),
                expected: "one more than on the line before, from 0 on; number the items again",
            };
            return Err(problem.at(Place::Line(row.line)));
        }
    }
    let Some((first, rest)) = rows.split_first() else { return Ok(Mission::default()) };
    let home = home(first)?;
    let rest: Vec<_> = rest.iter().collect();
    let mut items = items(&rest)?;
    let count = items.len();
    let index_of =
        |target: f64| super::item::index_in(count, target - 1.0).then_some((target - 1.0) as usize);
    jumps_to_indices(&mut items, index_of).map_err(|(index, problem)| {
        problem.at(rest.get(index).map_or(Place::File, |row| Place::Line(row.line)))
    })?;
    Ok(Mission { home, items })
}

/// Item 0: home, and unknown where it is all zeros (no GPS yet when the file was saved).
/// Mission Planner writes it with command 0.
fn home(row: &Row) -> Result<Option<Home>, Located> {
    let at = |problem: Problem| problem.at(Place::Line(row.line));
    if !matches!(row.item.command, 0 | 16) {
        return Err(at(Problem::Value {
            what: "the command of item 0".to_owned(),
            found: row.item.command.to_string(),
            expected: "16, as item 0 is the home position; insert a line for home and number the \
                       items again",
        }));
    }
    let [.., lat, lon, altitude] = row.item.params;
    let position = place("home", lat, lon).map_err(at)?;
    if (position.lat(), position.lon()) == (0.0, 0.0) {
        return Ok(None);
    }
    let altitude_amsl =
        super::item::float(altitude, || "altitude of home".to_owned()).map_err(at)?;
    let altitude_amsl = if altitude_amsl.is_nan() { 0.0 } else { altitude_amsl };
    Ok(Some(Home { position, altitude_amsl }))
}

/// The mission as `QGC WPL 110`: home as item 0 (zeros where it is unknown), jump targets counting
/// it.
///
/// # Errors
/// [`WriteError::JumpTarget`] where a jump leads nowhere.
pub fn write_waypoints(mission: &Mission) -> Result<String, WriteError> {
    let mut text = format!("{HEADER}\n");
    let (lat, lon, altitude) = mission.home.map_or((0.0, 0.0, 0.0), |home| {
        (home.position.lat(), home.position.lon(), super::item::decimal(home.altitude_amsl))
    });
    let params = [0.0, 0.0, 0.0, 0.0, lat, lon, altitude];
    let home = FileItem { command: 16, frame: 0, params, autocontinue: true };
    line(&mut text, 0, 1, &home);
    for (index, item) in jumps_from_indices(mission, 1)?.iter().enumerate() {
        line(&mut text, index + 1, 0, &FileItem::from_item(item));
    }
    Ok(text)
}

/// The fence as `QGC WPL 110`, as MAVProxy's `fence load` and Mission Planner take it.
///
/// # Errors
/// [`WriteError::Fence`] where a region is no fence.
pub fn write_waypoints_fence(fences: &FenceSet) -> Result<String, WriteError> {
    let items = encode_fence(fences).map_err(|error| WriteError::Fence {
        origin: format!("fence item {}", error.index),
        problem: error.problem,
    })?;
    Ok(write_items(&items))
}

/// The rally points as `QGC WPL 110`.
#[must_use]
pub fn write_waypoints_rally(rally: &[MissionItem]) -> String {
    write_items(rally)
}

fn write_items(items: &[MissionItem]) -> String {
    let mut text = format!("{HEADER}\n");
    for (index, item) in items.iter().enumerate() {
        line(&mut text, index, 0, &FileItem::from_item(item));
    }
    text
}

fn line(text: &mut String, seq: usize, current: u8, item: &FileItem) {
    let FileItem { command, frame, params, autocontinue } = item;
    // Writing into a String cannot fail.
    let _ = write!(text, "{seq}\t{current}\t{frame}\t{command}");
    for param in params {
        let _ = write!(text, "\t{param}");
    }
    let _ = writeln!(text, "\t{}", u8::from(*autocontinue));
}

//! What can be wrong with a file, where in it, and what to do about it.

use std::fmt;

use crate::fence::items::FenceItemProblem;
use crate::geodesy::PositionError;

/// Why a file could not be read. Displays as `city.geojson, feature 3: what; what to do`.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{file}{}: {problem}", Within(.place))]
pub struct FormatError {
    /// The file's name as the caller gave it.
    pub file: String,
    /// Where in the file.
    pub place: Place,
    /// What is wrong.
    pub problem: Box<Problem>,
}

/// Where in a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    File,
    /// A line of a text file, from 1.
    Line(usize),
    /// A mission item as ground stations number them: the first after home is 1.
    MissionItem(usize),
    /// `plannedHomePosition` of a `.plan`.
    Home,
    /// A polygon of a `.plan`'s geoFence, from 1.
    FencePolygon(usize),
    /// A circle of a `.plan`'s geoFence, from 1.
    FenceCircle(usize),
    /// The return point of a fence.
    ReturnPoint,
    /// A rally point, from 1.
    RallyPoint(usize),
    /// A GeoJSON feature or KML placemark, from 1, with its name where it has one.
    Feature {
        /// `feature` or `placemark`.
        kind: &'static str,
        /// Which, from 1.
        number: usize,
        /// Its name property, where there is one.
        name: Option<String>,
    },
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File => f.write_str("the file"),
            Self::Line(line) => write!(f, "line {line}"),
            Self::MissionItem(item) => write!(f, "mission item {item}"),
            Self::Home => f.write_str("plannedHomePosition"),
            Self::FencePolygon(number) => write!(f, "geoFence polygon {number}"),
            Self::FenceCircle(number) => write!(f, "geoFence circle {number}"),
            Self::ReturnPoint => f.write_str("fence return point"),
            Self::RallyPoint(number) => write!(f, "rally point {number}"),
            Self::Feature { kind, number, name: None } => write!(f, "{kind} {number}"),
            Self::Feature { kind, number, name: Some(name) } => {
                write!(f, "{kind} {number} ({name})")
            }
        }
    }
}

/// `, PLACE` in a message, and nothing for the file as a whole.
struct Within<'a>(&'a Place);

impl fmt::Display for Within<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Place::File => Ok(()),
            place => write!(f, ", {place}"),
        }
    }
}

/// What is wrong with a file, and what to do about it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Problem {
    /// Larger than [`super::MAX_FILE_BYTES`].
    #[error("{bytes} bytes, more than the {limit} that quavd reads; split it or cut the area out")]
    TooLarge {
        /// The file's size.
        bytes: usize,
        /// The largest that is read.
        limit: usize,
    },
    /// More of something than quavd handles.
    #[error("more than {limit} {what}; split the file or simplify it")]
    TooMany {
        /// What there is too much of.
        what: &'static str,
        /// The most that is read.
        limit: usize,
    },
    /// Not UTF-8 text.
    #[error(
        "byte {at} is not UTF-8 text: a picture, a shapefile or the like is none of the formats \
         quavd reads; text has to be saved as UTF-8"
    )]
    NotText {
        /// Offset of the first bad byte.
        at: usize,
    },
    /// Nothing at all, or comments only.
    #[error("the file is empty; was it saved, and copied whole?")]
    Empty,
    /// None of the formats.
    #[error(
        "this is none of the formats quavd reads: QGroundControl .plan, QGC WPL 110 waypoints, \
         GeoJSON, KML, KMZ, ArduPilot fence and rally text"
    )]
    UnknownFormat,
    /// A format that is recognised but not read.
    #[error("{what}; {advice}")]
    NotSupported {
        /// What was found.
        what: String,
        /// What to do instead.
        advice: &'static str,
    },
    /// Broken JSON, or JSON of another shape; the parser's words with line and column.
    #[error("{0}; correct the JSON there")]
    Json(String),
    /// A broken archive, in the reader's words.
    #[error("this KMZ cannot be read: {0}; save it again, or give the .kml in it")]
    Archive(String),
    /// Broken XML, in the parser's words.
    #[error("{0}; correct the XML there")]
    Xml(String),
    /// Something that must be there is not.
    #[error("there is no {what}; {advice}")]
    Missing {
        /// What is missing.
        what: String,
        /// What to do.
        advice: &'static str,
    },
    /// A value of the wrong kind or out of range.
    #[error("{what} is {found}; it must be {expected}")]
    Value {
        /// Which value.
        what: String,
        /// What it is.
        found: String,
        /// What it must be.
        expected: &'static str,
    },
    /// Not a position on the globe.
    #[error("{what}: {error}; correct it")]
    Position {
        /// Which position.
        what: String,
        /// Why it is none.
        error: PositionError,
    },
    /// Two things that contradict each other, or one that stands twice.
    #[error("{what}; {advice}")]
    Conflict {
        /// The contradiction.
        what: String,
        /// What to do.
        advice: &'static str,
    },
    /// A fence item that cannot be used.
    #[error("fence item {index}: {problem}")]
    Fence {
        /// Index in the fence plan, from 0.
        index: usize,
        /// Why.
        problem: FenceItemProblem,
    },
}

impl Problem {
    /// This problem at `place`, still without its file.
    pub(super) fn at(self, place: Place) -> Located {
        Located { place, problem: self }
    }
}

/// A problem with its place; the reader that knows the file's name makes a [`FormatError`] of it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Located {
    pub(super) place: Place,
    pub(super) problem: Problem,
}

impl Located {
    pub(super) fn in_file(self, name: &str) -> FormatError {
        FormatError { file: name.to_owned(), place: self.place, problem: Box::new(self.problem) }
    }
}

impl From<Problem> for Located {
    fn from(problem: Problem) -> Self {
        problem.at(Place::File)
    }
}

/// Why a mission or fence cannot be written in a format.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum WriteError {
    /// A rally point whose altitude the format cannot express.
    #[error(
        "rally point {number} is in frame {frame}, but a .plan holds heights above home (frame 3) \
         only; write it as .geojson or as .waypoints"
    )]
    RallyFrame {
        /// Which, from 1.
        number: usize,
        /// Its frame.
        frame: u8,
    },
    /// A position off the globe.
    #[error("{place}: {error}; correct it before writing")]
    Position {
        /// Whose position.
        place: Place,
        /// Why it is none.
        error: PositionError,
    },
    /// A region that is no fence.
    #[error("{origin}: {problem}")]
    Fence {
        /// The region.
        origin: String,
        /// Why.
        problem: FenceItemProblem,
    },
    /// A fence that the old text cannot express.
    #[error(
        "the old fence text holds one inclusion polygon with a return point, and here is {what}; \
         write it as .fence (QGC WPL 110)"
    )]
    FenceText {
        /// What is there instead.
        what: String,
    },
    /// An archive that could not be made.
    #[error("the archive could not be made: {0}")]
    Archive(String),
    /// A jump to an item that does not exist.
    #[error(
        "mission item {item} jumps to item {target}, which does not exist; correct the jump's \
         target"
    )]
    JumpTarget {
        /// The jumping item, from 1.
        item: usize,
        /// The target, from 1.
        target: f64,
    },
}

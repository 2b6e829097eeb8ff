//! The legs of a mission: every stretch between two places that its items can make a vehicle fly.
//!
//! The types are here; `itinerary` follows the items. What is inside the rules and what is not:
//!
//! - A mission that begins with a takeoff begins where the vehicle stands (or at home); any other
//!   begins at its first place, and the way there is not the mission's.
//! - Each place is joined to every place that can come next: by falling through, and by each jump
//!   (however often it is taken; a jump of zero repeats is none).
//! - A return goes to home (as the mission has it, and as every `DO_SET_HOME` makes it), to each
//!   rally point, and to each `DO_LAND_START` sequence: which one is decided in the air. What comes
//!   after a return is flown from there, as ArduPilot's fixed wings do.
//! - After a landing only a takeoff goes on. Items that nothing leads to (a landing sequence after
//!   a landing) still are legs among themselves; how a failsafe gets to them is not judged, and a
//!   warning says so.
//! - The way up at a takeoff, down at a landing, and what happens after the last item are not legs.

use std::fmt;

use super::altitude::Altitude;
use super::autopilot::Autopilot;
use super::commands::LoiterHabit;
use super::item::{Command, Frame};
use super::{Mission, itinerary};
use crate::geodesy::{LatLon, PositionError};
use crate::units::Metres;

/// What the path of a mission depends on besides its items.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FlightContext<'a> {
    /// Where the vehicle stands; [`Mission::home`] is taken where this is not known.
    pub start: Option<LatLon>,
    /// The rally points, any of which a return may go to.
    pub rally: &'a [LatLon],
    /// The autopilot that flies the mission.
    pub autopilot: Autopilot,
    /// How the vehicle loiters.
    pub loiter: LoiterHabit,
}

/// One end of a leg.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LegEnd {
    /// Index of the item; `None` before the first. For a return it is the returning item. For a
    /// start it is the last item of navigation before the leg, which need not be the one whose
    /// place this is (a takeoff or a delay where the vehicle happens to be).
    pub item: Option<usize>,
    /// Where.
    pub position: LatLon,
    /// The altitude flown at; `None` at the end of a return or landing and where none is given.
    pub altitude: Option<Altitude>,
    /// Radius of the circle that is flown around the position; zero for none. The vehicle arrives
    /// at and leaves from anywhere on it.
    pub circle: Metres,
}

/// Why a leg is flown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LegKind {
    /// From one place of the mission to the next.
    Flown,
    /// From where the vehicle stands to the place of a takeoff.
    Takeoff,
    /// By an item that returns.
    Return(ReturnTo),
    /// No stretch: a place that no leg leads to or from, or that is circled where the vehicle is.
    Stay,
}

/// Where a return may go.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReturnTo {
    /// Home, or what a `DO_SET_HOME` made home.
    Home,
    /// A rally point, by its index.
    Rally(usize),
    /// The landing sequence that this `DO_LAND_START` item begins.
    LandingSequence(usize),
}

/// Where the vehicle is between the ends of a leg.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LegShape {
    /// On the straight line.
    Straight,
    /// On a curve (spline or arc).
    Curved {
        /// No point of the curve is further than this from the straight line, seen from above;
        /// `None` where that cannot be told.
        within: Option<Metres>,
        /// No point is further than this above or below both ends; `None` likewise.
        overshoot: Option<Metres>,
    },
}

/// A stretch between two places.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Leg {
    /// Where it starts.
    pub from: LegEnd,
    /// Where it ends.
    pub to: LegEnd,
    /// Why it is flown.
    pub kind: LegKind,
    /// How it is flown.
    pub shape: LegShape,
    /// The jump item that it goes through, the first where there are several.
    pub jump: Option<usize>,
    /// The item that waypoints for this leg are inserted before; `None` where the leg cannot be
    /// re-planned, only judged. Legs with the same number share the inserted waypoints: at most
    /// one of them can be re-planned, and the result decides about the others.
    pub insert_before: Option<usize>,
    /// How waypoints can be put into a leg that is flown by a jump.
    pub by_jump: Option<JumpInsertion>,
    /// Whether only a jump leads to where it starts.
    pub behind_jump: bool,
}

/// Waypoints for a leg that is flown by a jump stand before the jump's target. The jump goes to the
/// first of them; another jump, always taken, leads whoever falls through past them:
///
/// > ..., `DO_JUMP` to the target, new waypoints, target, ..., `DO_JUMP` to the new waypoints, ...
///
/// So nothing but this jump flies them, and other jumps to the target still go there straight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JumpInsertion {
    /// The item that jumps.
    pub jump: usize,
    /// Where it jumps to.
    pub target: usize,
    /// The number of repeats (`param2`) that this autopilot takes for always.
    pub always: f32,
}

/// What a message calls a leg.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LegName {
    from: Option<usize>,
    to: Option<usize>,
    kind: LegKind,
    jump: Option<usize>,
}

impl Leg {
    /// What a message calls this leg, such as `leg from item 2 to item 3`.
    #[must_use]
    pub fn name(&self) -> LegName {
        LegName { from: self.from.item, to: self.to.item, kind: self.kind, jump: self.jump }
    }

    /// How far the vehicle may be from the straight line between the ends: the larger circle, or
    /// the bound of the curve. The hull of the two circles is a tighter bound for a straight leg.
    /// `None` where there is no bound.
    #[must_use]
    pub fn sweep(&self) -> Option<Metres> {
        let circles = self.from.circle.max(self.to.circle);
        match self.shape {
            LegShape::Straight => Some(circles),
            LegShape::Curved { within, .. } => within.map(|within| within + circles),
        }
    }
}

impl fmt::Display for LegName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let item = |item: Option<usize>| match item {
            Some(item) => format!("item {}", number(item)),
            None => "the start".to_owned(),
        };
        let (from, to) = (item(self.from), item(self.to));
        match self.kind {
            LegKind::Flown => write!(f, "leg from {from} to {to}"),
            LegKind::Takeoff => write!(f, "leg to the takeoff at {to}"),
            LegKind::Stay => write!(f, "place of {to}"),
            LegKind::Return(ReturnTo::Home) => write!(f, "return home from {from}"),
            LegKind::Return(ReturnTo::Rally(rally)) => {
                write!(f, "return to rally point {} from {from}", rally + 1)
            }
            LegKind::Return(ReturnTo::LandingSequence(entry)) => {
                let entry = number(entry);
                write!(f, "return to the landing sequence at item {entry} from {from}")
            }
        }?;
        match self.jump {
            Some(jump) => write!(f, " by the jump at item {}", number(jump)),
            None => Ok(()),
        }
    }
}

/// What a message calls an item: ground stations count home as 0 and the first command as 1.
pub fn number(index: usize) -> usize {
    index + 1
}

/// The legs of a mission and what is to be said about them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MissionLegs {
    /// The legs in the order of the items whose places they start from, those from the start
    /// first; places that no leg touches last.
    pub legs: Vec<Leg>,
    /// What was assumed, in the order of the items.
    pub warnings: Vec<LegWarning>,
}

/// Something about the path that was assumed rather than known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LegWarning {
    /// A navigation command that is not known; its place is taken for a waypoint.
    UnknownNavigation {
        /// The item.
        item: usize,
        /// Its command.
        command: Command,
    },
    /// A command that is not known; assumed not to move the vehicle.
    UnknownCommand {
        /// The item.
        item: usize,
        /// Its command.
        command: Command,
    },
    /// A loiter with the vehicle's own radius, which is not known: only the place is judged.
    LoiterRadius {
        /// The item.
        item: usize,
    },
    /// A sequence that can be entered from anywhere; only the sequence itself is judged.
    EnteredFromAnywhere {
        /// The item that begins it.
        item: usize,
    },
}

impl LegWarning {
    /// The item it is about.
    #[must_use]
    pub fn item(self) -> usize {
        match self {
            Self::UnknownNavigation { item, .. }
            | Self::UnknownCommand { item, .. }
            | Self::LoiterRadius { item }
            | Self::EnteredFromAnywhere { item } => item,
        }
    }
}

impl fmt::Display for LegWarning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "mission item {}: ", number(self.item()))?;
        match self {
            Self::UnknownNavigation { command, .. } => {
                write!(f, "navigation command {} is not known; taken for a waypoint", command.0)
            }
            Self::UnknownCommand { command, .. } => {
                let command = command.0;
                write!(
                    f,
                    "command {command} is not known; left as it is, assumed not to move the \
                           vehicle"
                )
            }
            Self::LoiterRadius { .. } => f.write_str(
                "the loiter has the vehicle's own radius, which is not known; only \
                             its centre is judged",
            ),
            Self::EnteredFromAnywhere { .. } => f.write_str(
                "a sequence that can be entered from anywhere; the way to it is not \
                             judged",
            ),
        }
    }
}

/// Why the path of a mission is not known.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum LegError {
    /// A place that is not in latitude and longitude.
    #[error(
        "mission item {}: its place is in frame {}, which has no latitude and longitude; give it \
         in a global frame",
        number(*item), frame.0
    )]
    Frame {
        /// The item.
        item: usize,
        /// Its frame.
        frame: Frame,
    },
    /// A place that is not on the globe.
    #[error("mission item {}: {source}; correct the item", number(*item))]
    Position {
        /// The item.
        item: usize,
        /// What is wrong with it.
        source: PositionError,
    },
    /// A loiter radius that is infinite.
    #[error("mission item {}: the loiter radius is infinite; correct the item", number(*item))]
    Radius {
        /// The item.
        item: usize,
    },
    /// A jump to an item that there is not.
    #[error(
        "mission item {}: jumps to item {}, but the mission has items 1 to {items}; correct the \
         jump",
        number(*item), target + 1.0
    )]
    JumpTarget {
        /// The jump.
        item: usize,
        /// Its target as given.
        target: f32,
        /// How many items there are.
        items: usize,
    },
    /// A jump to a tag that there is not.
    #[error("mission item {}: jumps to tag {tag}, which no item has; add the tag", number(*item))]
    JumpTag {
        /// The jump.
        item: usize,
        /// The tag as given.
        tag: f32,
    },
    /// A takeoff where the vehicle stands, and that is not known.
    #[error(
        "mission item {}: takes off where the vehicle is, which is not known; give home or the \
         vehicle's position",
        number(*item)
    )]
    StartUnknown {
        /// The takeoff, or the last item before the leg.
        item: usize,
    },
    /// A return to home, and home is not known.
    #[error("mission item {}: returns home, and home is not known; set home", number(*item))]
    HomeUnknown {
        /// The item that returns.
        item: usize,
    },
    /// A command that moves the vehicle along a path that is not in the mission.
    #[error(
        "mission item {}: command {} moves the vehicle along a path that the mission does not \
         give, so that it cannot be judged; remove the item",
        number(*item), command.0
    )]
    PathNotGiven {
        /// The item.
        item: usize,
        /// Its command.
        command: Command,
    },
    /// So many jumps or returns that the legs are not counted out.
    #[error("the mission's jumps and returns make more than {limit} legs; remove some of them")]
    TooManyLegs {
        /// The most that are followed.
        limit: usize,
    },
}

/// The legs of a mission. See the module for which there are.
///
/// # Errors
/// [`LegError`], naming the item, where the path cannot be known.
pub fn legs(mission: &Mission, context: &FlightContext<'_>) -> Result<MissionLegs, LegError> {
    itinerary::follow(mission, context)
}

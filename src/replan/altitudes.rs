//! What the altitudes of legs decide: which obstacles a leg is flown over or under, and whether it
//! keeps the lowest and highest altitude that the vehicle's fence allows.
//!
//! **Heights.** An obstacle is left out of a leg's airspace only where the whole leg is proven to
//! be clear of it by the vertical margin. The leg's altitudes are those of its two ends and
//! everything between; what cannot be compared bars the way at all altitudes:
//!
//! | the leg is flown above | obstacle above its ground | obstacle above mean sea level |
//! |---|---|---|
//! | terrain | compared: near the obstacle it is the same ground | not |
//! | home | with `ground_relief`: how far any ground may be above or below home | with home's altitude |
//! | mean sea level | with both | compared |
//!
//! The altitudes of a leg are not known, and heights do not count for it, where
//! - it is a return (how high is a parameter's choice), leads to a landing or to a takeoff, or an
//!   end has no altitude or 0 (which ArduPilot takes for "as before");
//! - the mission changes altitudes on the way (`CONDITION_CHANGE_ALT`, `DO_CHANGE_ALTITUDE`), moves
//!   home, or has a command that quavd does not know.
//!
//! A vehicle that is not known to hover may pass a waypoint before it has climbed to it
//! (ArduPlane does): all altitudes of its mission are then possible on each leg.
//!
//! **Limits** are judged by the altitudes of the items themselves. A leg that breaks one is not
//! re-planned, since quavd does not change altitudes. How high a return is flown is not judged.

use std::fmt;

use super::Options;
use super::reason::ReplanError;
use crate::airspace::RegionId;
use crate::fence::{FenceRegion, FenceRole, FenceSet, HeightRange, HeightReference, Limit, Limits};
use crate::mission::altitude::{Altitude, AltitudeReference};
use crate::mission::commands::{Destination, Role};
use crate::mission::legs::{LegKind, LegShape, number};
use crate::mission::{Command, Leg, LoiterHabit, Mission, MissionItem};
use crate::units::Metres;

/// How heights are compared with altitudes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vertical {
    /// What a leg keeps from an obstacle that it is flown over or under.
    pub margin: Metres,
    /// How far the ground at any obstacle may be above or below home, where somebody vouches for
    /// that.
    pub ground_relief: Option<Metres>,
}

impl Default for Vertical {
    /// 10 m: a GPS altitude is easily 5 m off, a barometer drifts by some metres in an hour.
    fn default() -> Self {
        Self { margin: Metres(10.0), ground_relief: None }
    }
}

/// The altitudes that a leg may be flown at.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Band {
    reference: AltitudeReference,
    low: f64,
    high: f64,
}

/// Why heights cannot be compared with a leg's altitudes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Incomparable {
    /// The leg has no altitudes that could be relied on.
    Leg,
    /// This item makes all altitudes of the mission unsure.
    Item(usize),
    /// Nobody said how even the ground is.
    Relief,
    /// Home's altitude is not known.
    Home,
    /// Terrain and mean sea level.
    Terrain,
    /// The places of the mission are not all measured from the same.
    Mixed,
}

impl Incomparable {
    /// A sentence about so many legs.
    pub(super) fn told(self, legs: usize) -> String {
        let legs = if legs == 1 { "1 leg".to_owned() } else { format!("{legs} legs") };
        let why = match self {
            Self::Leg => "how high it is flown there is not known".to_owned(),
            Self::Item(item) => {
                format!("item {} makes the altitudes of the mission unsure", number(item))
            }
            Self::Relief => "the obstacle's height is above ground, the altitude above home; say \
                             with --ground-relief how far the ground may be above or below home"
                .to_owned(),
            Self::Home => "the altitude of home above mean sea level is not known".to_owned(),
            Self::Terrain => {
                "altitudes above terrain and heights above mean sea level do not compare".to_owned()
            }
            Self::Mixed => {
                "the vehicle is not known to hover, so that every altitude of the mission counts, \
                 and they do not all compare"
                    .to_owned()
            }
        };
        format!("for {legs} an obstacle counts at all altitudes although it has heights: {why}")
    }
}

/// How a leg passes an obstacle with heights.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Passage {
    /// Over or under it, by the margin.
    Clear,
    /// Not by the margin.
    TooNear,
    /// There is no telling.
    Incomparable(Incomparable),
}

impl Passage {
    pub(super) fn is_clear(self) -> bool {
        self == Self::Clear
    }

    pub(super) fn incomparable(self) -> Option<Incomparable> {
        match self {
            Self::Incomparable(why) => Some(why),
            _ => None,
        }
    }
}

/// What is wrong with a leg's altitudes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LimitFinding {
    /// It reaches or exceeds the ceiling.
    Above {
        /// How high it is flown above home.
        flown: Metres,
        /// The limit.
        limit: Limit,
    },
    /// It reaches or undercuts the floor.
    Below {
        /// How low it is flown above home.
        flown: Metres,
        /// The limit.
        limit: Limit,
    },
    /// Its altitudes cannot be compared with the limit.
    NotComparable {
        /// The limit.
        limit: Limit,
    },
}

impl fmt::Display for LimitFinding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Above { flown, limit } => write!(
                f,
                "is flown at {:.1} m above home, and the vehicle's fence ends at {limit}; lower its \
                 waypoints, or raise the limit",
                flown.0
            ),
            Self::Below { flown, limit } => write!(
                f,
                "is flown at {:.1} m above home, and the vehicle's fence begins at {limit}; raise its \
                 waypoints, or lower the limit",
                flown.0
            ),
            Self::NotComparable { limit } => write!(
                f,
                "has altitudes that cannot be compared with {limit} above home; give them above \
                 home, or say with --ground-relief how far the ground may be above or below home"
            ),
        }
    }
}

/// The altitudes of a mission, as far as they are known.
#[derive(Debug)]
pub(super) struct Altitudes {
    vertical: Vertical,
    limits: Limits,
    /// Home's altitude above mean sea level.
    home: Option<f32>,
    /// The first item that makes altitudes unsure.
    unsure: Option<usize>,
    /// For a vehicle that is not known to hover: every altitude of the mission.
    lagging: Option<Vec<Altitude>>,
}

impl Altitudes {
    /// # Errors
    /// [`ReplanError::Limit`] where home is not known or moves and there are limits around it.
    pub(super) fn of(mission: &Mission, options: &Options) -> Result<Self, ReplanError> {
        let limits = options.rules.limits;
        let items = mission.items.as_slice();
        let moves_home = items.iter().position(|item| item.command == Command::DO_SET_HOME);
        if let Some(limit) = limits.radius.or(limits.ceiling).or(limits.floor) {
            let why = match (moves_home, mission.home) {
                (Some(item), _) => format!(
                    "mission item {} moves home; remove it, or switch the limit off",
                    number(item)
                ),
                (None, None) => "home is not known; set home".to_owned(),
                (None, Some(_)) => String::new(),
            };
            if !why.is_empty() {
                return Err(ReplanError::Limit { limit: limit.to_string(), why });
            }
        }
        let unsure = items.iter().position(is_unsure);
        // Files write 0 where they do not know home's altitude.
        let home = mission.home.map(|home| home.altitude_amsl);
        let home = home.filter(|home| home.is_finite() && *home != 0.0 && moves_home.is_none());
        let lagging = match options.loiter {
            LoiterHabit::Hover { .. } => None,
            _ => Some(items.iter().filter_map(flown_altitude).collect()),
        };
        Ok(Self { vertical: options.vertical, limits, home, unsure, lagging })
    }

    /// Whether a leg is clear of an obstacle by its altitudes.
    pub(super) fn compare(&self, leg: &Leg, heights: &HeightRange) -> Passage {
        let band = match self.band(leg) {
            Ok(band) => band,
            Err(why) => return Passage::Incomparable(why),
        };
        let Band { low, high, .. } = match self.relative_to(band, heights.reference) {
            Ok(band) => band,
            Err(why) => return Passage::Incomparable(why),
        };
        let margin = self.vertical.margin.0;
        let over = heights.top.is_some_and(|top| low >= top.0 + margin);
        let under = heights.bottom.is_some_and(|bottom| high <= bottom.0 - margin);
        if over || under { Passage::Clear } else { Passage::TooNear }
    }

    /// The obstacles that a leg is clear of by its altitudes, rising.
    pub(super) fn cleared(&self, leg: &Leg, fences: &FenceSet) -> Vec<RegionId> {
        let clear = |region: &FenceRegion| {
            region.role == FenceRole::Exclusion
                && region.heights.is_some_and(|heights| self.compare(leg, &heights).is_clear())
        };
        let regions = (0..).map(RegionId).zip(&fences.regions);
        regions.filter(|(_, region)| clear(region)).map(|(id, _)| id).collect()
    }

    /// The altitudes of a leg as heights above what a region is measured from.
    fn relative_to(&self, band: Band, reference: HeightReference) -> Result<Band, Incomparable> {
        use AltitudeReference as A;
        match (band.reference, reference) {
            (A::Terrain, HeightReference::Ground)
            | (A::MeanSeaLevel, HeightReference::MeanSeaLevel) => Ok(band),
            (A::Terrain, HeightReference::MeanSeaLevel) => Err(Incomparable::Terrain),
            (A::Home, HeightReference::MeanSeaLevel) => {
                let home = f64::from(self.home.ok_or(Incomparable::Home)?);
                Ok(Band { low: band.low + home, high: band.high + home, ..band })
            }
            (A::Home | A::MeanSeaLevel, HeightReference::Ground) => {
                let relief = self.vertical.ground_relief.ok_or(Incomparable::Relief)?.0;
                let home = match band.reference {
                    A::MeanSeaLevel => f64::from(self.home.ok_or(Incomparable::Home)?),
                    _ => 0.0,
                };
                Ok(Band { low: band.low - home - relief, high: band.high - home + relief, ..band })
            }
        }
    }

    /// The altitudes that a leg is flown at.
    fn band(&self, leg: &Leg) -> Result<Band, Incomparable> {
        if let Some(item) = self.unsure {
            return Err(Incomparable::Item(item));
        }
        if !matches!(leg.kind, LegKind::Flown | LegKind::Stay) {
            return Err(Incomparable::Leg);
        }
        let is_set = |altitude: &Altitude| altitude.metres != 0.0;
        let (Some(from), Some(to)) =
            (leg.from.altitude.filter(is_set), leg.to.altitude.filter(is_set))
        else {
            return Err(Incomparable::Leg);
        };
        let reference = to.reference();
        let above = |altitude: Altitude| altitude.above(reference, self.home).map(f64::from);
        let mut altitudes = vec![above(from).ok_or(Incomparable::Mixed)?, f64::from(to.metres)];
        for &altitude in self.lagging.iter().flatten() {
            altitudes.push(above(altitude).ok_or(Incomparable::Mixed)?);
        }
        let overshoot = match leg.shape {
            LegShape::Straight => 0.0,
            LegShape::Curved { overshoot, .. } => overshoot.ok_or(Incomparable::Leg)?.0,
        };
        let low = altitudes.iter().copied().fold(f64::INFINITY, f64::min) - overshoot;
        let high = altitudes.iter().copied().fold(f64::NEG_INFINITY, f64::max) + overshoot;
        Ok(Band { reference, low, high })
    }

    /// The altitudes of a leg's ends above home, as far as they are given: lowest and highest.
    /// `None`: they are not comparable.
    fn above_home(&self, leg: &Leg) -> Option<Vec<(f64, f64)>> {
        let ends = [leg.from.altitude, leg.to.altitude].into_iter().flatten();
        let above = |altitude: Altitude| {
            let metres = altitude.above(AltitudeReference::Home, self.home).map(f64::from);
            match (metres, altitude.reference(), self.vertical.ground_relief) {
                (Some(metres), ..) => Some((metres, metres)),
                (None, AltitudeReference::Terrain, Some(Metres(relief))) => {
                    let metres = f64::from(altitude.metres);
                    Some((metres - relief, metres + relief))
                }
                _ => None,
            }
        };
        ends.filter(|altitude| altitude.metres != 0.0).map(above).collect()
    }

    /// The altitude limit that a leg breaks or cannot be judged by.
    pub(super) fn limit(&self, leg: &Leg) -> Option<LimitFinding> {
        let limit = self.limits.ceiling.or(self.limits.floor)?;
        let Some(ends) = self.above_home(leg) else {
            return Some(LimitFinding::NotComparable { limit });
        };
        let overshoot = match leg.shape {
            LegShape::Straight => 0.0,
            LegShape::Curved { overshoot: Some(overshoot), .. } => overshoot.0,
            LegShape::Curved { overshoot: None, .. } => {
                return Some(LimitFinding::NotComparable { limit });
            }
        };
        let high = ends.iter().map(|(_, high)| *high).reduce(f64::max)? + overshoot;
        let low = ends.iter().map(|(low, _)| *low).reduce(f64::min)? - overshoot;
        // At the limit is a breach: AC_Fence compares with >= and <=, PX4 with <.
        if let Some(limit) = self.limits.ceiling.filter(|limit| high >= limit.metres.0) {
            return Some(LimitFinding::Above { flown: Metres(high), limit });
        }
        if let Some(limit) = self.limits.floor.filter(|limit| low <= limit.metres.0) {
            return Some(LimitFinding::Below { flown: Metres(low), limit });
        }
        None
    }

    /// A warning for a leg that keeps a limit by less than the vehicle's margin.
    pub(super) fn near_limit(&self, leg: &Leg) -> Option<String> {
        if self.limit(leg).is_some() {
            return None;
        }
        let margin = self.limits.margin.0;
        let ends = self.above_home(leg)?;
        let near = |limit: &Limit| {
            ends.iter().any(|(low, high)| {
                (low - limit.metres.0).abs() < margin || (high - limit.metres.0).abs() < margin
            })
        };
        let limit = [self.limits.ceiling, self.limits.floor].into_iter().flatten().find(near)?;
        let name = leg.name();
        Some(format!("the {name} is flown within FENCE_MARGIN ({margin} m) of {limit}"))
    }
}

/// Whether an item makes it unsure how high anything is flown.
fn is_unsure(item: &MissionItem) -> bool {
    matches!(
        item.command,
        Command::CONDITION_CHANGE_ALT | Command::DO_CHANGE_ALTITUDE | Command::DO_SET_HOME
    ) || matches!(item.command.role(), Role::Unknown | Role::Place(Destination::Unknown))
}

/// The altitude of an item that is flown at, where it sets one.
fn flown_altitude(item: &MissionItem) -> Option<Altitude> {
    match item.command.role() {
        Role::Place(Destination::Land | Destination::PayloadPlace) => None,
        Role::Place(_) => Altitude::of(item).filter(|altitude| altitude.metres != 0.0),
        _ => None,
    }
}

#[cfg(test)]
mod tests;

//! The vehicle as a walk through the items has it.

use crate::geodesy::LatLon;
use crate::mission::altitude::Altitude;
use crate::mission::legs::{JumpInsertion, LegEnd};
use crate::units::Metres;

/// Whether the vehicle can fly on to a waypoint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Status {
    /// Before the first place or takeoff.
    Before,
    Flying,
    Landed,
}

/// A return that goes on in a landing sequence: the item that returned and where waypoints for it
/// go.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Landing {
    pub(super) entry: usize,
    pub(super) insert_before: Option<usize>,
}

/// Where a walk is: the vehicle's state as execution arrives at an item.
#[derive(Debug, Clone, Copy)]
pub(super) struct State {
    pub(super) index: usize,
    /// The last item of navigation.
    pub(super) navigation: Option<usize>,
    pub(super) position: Option<LatLon>,
    pub(super) altitude: Option<Altitude>,
    pub(super) circle: Metres,
    pub(super) status: Status,
    /// The first jump since the place.
    pub(super) jump: Option<usize>,
    /// Whether there was a jump since the last item of navigation.
    pub(super) jumped: bool,
    pub(super) landing: Option<Landing>,
    /// The only jump since the last item of navigation, where it can be given waypoints.
    pub(super) by_jump: Option<JumpInsertion>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct StateKey {
    pub(super) index: usize,
    pub(super) by_jump: bool,
    pub(super) jumped: bool,
    pub(super) status: Status,
    pub(super) position: Option<[u64; 2]>,
    pub(super) circle: u64,
    pub(super) landing: Option<usize>,
}

pub(super) fn bits(position: LatLon) -> [u64; 2] {
    [position.lat().to_bits(), position.lon().to_bits()]
}

impl State {
    pub(super) fn start(position: Option<LatLon>) -> Self {
        Self {
            index: 0,
            navigation: None,
            position,
            altitude: None,
            circle: Metres::ZERO,
            status: Status::Before,
            jump: None,
            jumped: false,
            landing: None,
            by_jump: None,
        }
    }

    pub(super) fn after(item: usize, position: LatLon) -> Self {
        Self {
            index: item + 1,
            navigation: Some(item),
            status: Status::Flying,
            ..Self::start(Some(position))
        }
    }

    /// On to the next item, the one at hand being an item of navigation that does not change where
    /// the vehicle is.
    pub(super) fn past_item(self) -> Self {
        Self {
            index: self.index + 1,
            navigation: Some(self.index),
            jumped: false,
            by_jump: None,
            ..self
        }
    }

    /// What tells apart the ways of being at an item within one walk.
    pub(super) fn key(&self) -> StateKey {
        StateKey {
            index: self.index,
            by_jump: self.jump.is_some(),
            jumped: self.jumped,
            status: self.status,
            position: self.position.map(bits),
            circle: self.circle.0.to_bits(),
            landing: self.landing.map(|landing| landing.entry),
        }
    }

    pub(super) fn end(&self, position: LatLon) -> LegEnd {
        LegEnd { item: self.navigation, position, altitude: self.altitude, circle: self.circle }
    }
}

//! Where a plan begins and is measured from: the vehicle on the ground, and its home.
//!
//! The first leg of a mission begins where the vehicle stands, a return ends at home, and altitudes
//! are above home. So a vehicle that is carried to another place, gets its first fix, or is given
//! another home has a plan for another flight. It is looked at again when it has come to rest there.
//! What a receiver makes up while it stands still is less than [`MOVED`]; in flight only home counts.

use std::time::Duration;

use tokio::time::Instant;

use crate::geodesy::{LatLon, geodesic_distance};
use crate::mission::Home;
use crate::vehicle::VehicleState;

/// Nearer than this is the same place, metres.
const MOVED: f64 = 10.0;
/// How far it may sway while it is at rest, metres.
const SWAY: f64 = 3.0;
/// It is at rest when it has not left a place for this long.
const AT_REST: Duration = Duration::from_secs(3);

/// A place to plan from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    home: Option<Home>,
    stands_at: Option<LatLon>,
}

impl Place {
    /// Of a vehicle as it was last heard.
    pub(super) fn of(state: &VehicleState) -> Self {
        let stands_at = state.position.map(|position| position.position);
        Self { home: state.home, stands_at }
    }

    /// The same as far as it can have changed for a plan that was made at `planned`: where the
    /// vehicle flies is no matter.
    fn seen_from(self, planned: Self, is_armed: bool) -> Self {
        let stands_at = if is_armed { planned.stands_at } else { self.stands_at };
        Self { stands_at, ..self }
    }

    /// How far something of it is from where it was, metres. What is not known any more has not
    /// moved, what was not known before has.
    fn moved_from(self, before: Self) -> f64 {
        let moved = |before: Option<LatLon>, now: Option<LatLon>| match (before, now) {
            (Some(before), Some(now)) => geodesic_distance(before, now).0,
            (None, Some(_)) => f64::INFINITY,
            (_, None) => 0.0,
        };
        let rise = match (before.home, self.home) {
            (Some(before), Some(now)) => f64::from(now.altitude_amsl - before.altitude_amsl).abs(),
            _ => 0.0,
        };
        let position = |home: Option<Home>| home.map(|home| home.position);
        moved(position(before.home), position(self.home))
            .max(moved(before.stands_at, self.stands_at))
            .max(rise)
    }
}

/// Watches for a vehicle that has moved since it was planned for.
#[derive(Debug, Default)]
pub(super) struct Moves {
    rests: Option<(Place, Instant)>,
}

impl Moves {
    /// Whether it has come to rest in another place than it was `planned` for.
    pub(super) fn has_moved(&mut self, now: Instant, planned: Place, state: &VehicleState) -> bool {
        let place = Place::of(state).seen_from(planned, state.is_armed());
        if place.moved_from(planned) <= MOVED {
            self.rests = None;
            return false;
        }
        match self.rests {
            Some((rests, since)) if place.moved_from(rests) <= SWAY => {
                now.duration_since(since) >= AT_REST
            }
            _ => {
                self.rests = Some((place, now));
                false
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::message::Heartbeat;
    use crate::vehicle::Position;

    /// A vehicle that stands some metres north of its first home, with a home as far to the north.
    fn vehicle(stands: Option<f64>, home: f64, armed: bool) -> VehicleState {
        /// A metre of latitude, degrees.
        const METRE: f64 = 1.0 / 111_000.0;
        let base_mode = if armed { 128 } else { 0 };
        let heartbeat =
            Heartbeat { custom_mode: 0, kind: 2, autopilot: 3, base_mode, system_status: 4 };
        let north = |metres: f64| LatLon::new(47.0 + METRE * metres, 8.0).unwrap();
        let at = |metres| Position {
            position: north(metres),
            altitude_amsl: 400.0,
            altitude_relative: 0.0,
        };
        VehicleState {
            heartbeat,
            heartbeat_at: Instant::now(),
            heard_at: Instant::now(),
            home: Some(Home { position: north(home), altitude_amsl: 400.0 }),
            position: stands.map(at),
            mission_current: None,
        }
    }

    /// Whether it is seen to have moved when it is looked at once a second for five seconds.
    fn moves(planned: &VehicleState, now: impl Fn(u32) -> VehicleState) -> bool {
        let (planned, start) = (Place::of(planned), Instant::now());
        let mut watch = Moves::default();
        (0..5).any(|second| {
            watch.has_moved(start + Duration::from_secs(second.into()), planned, &now(second))
        })
    }

    #[tokio::test(start_paused = true)]
    async fn a_vehicle_that_was_carried_away_has_moved_when_it_is_put_down() {
        let planned = vehicle(Some(0.0), 0.0, false);
        assert!(
            !moves(&planned, |second| vehicle(Some(f64::from(second)), 0.0, false)),
            "it sways"
        );
        assert!(moves(&planned, |_| vehicle(Some(40.0), 0.0, false)));
        let carried = |second| vehicle(Some(20.0 + 5.0 * f64::from(second)), 0.0, false);
        assert!(!moves(&planned, carried), "it is still carried");
        assert!(
            moves(&vehicle(None, 0.0, false), |_| vehicle(Some(1.0), 0.0, false)),
            "a first fix"
        );
        assert!(!moves(&planned, |_| vehicle(None, 0.0, false)), "the fix is lost");
    }

    #[tokio::test(start_paused = true)]
    async fn in_flight_only_home_counts() {
        let planned = vehicle(Some(0.0), 0.0, false);
        assert!(!moves(&planned, |_| vehicle(Some(500.0), 0.0, true)));
        assert!(moves(&planned, |_| vehicle(Some(500.0), 30.0, true)));
        let mut higher = vehicle(Some(0.0), 0.0, false);
        higher.home = higher.home.map(|home| Home { altitude_amsl: 430.0, ..home });
        assert!(moves(&planned, |_| higher.clone()), "altitudes are above home");
    }
}

//! Altitudes of mission items with what they are measured from, and how the altitudes of inserted
//! waypoints follow from those of a leg's ends.

use super::item::{Frame, MissionItem};

/// What an altitude is measured from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AltitudeReference {
    /// Mean sea level.
    MeanSeaLevel,
    /// Home.
    Home,
    /// The ground below.
    Terrain,
}

/// An altitude in a global mission frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Altitude {
    /// Metres above the frame's reference, finite.
    pub metres: f32,
    /// The item's frame: tells the reference, and is what an inserted waypoint gets.
    pub frame: Frame,
}

/// Why the altitudes between two ends are not known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum AltitudeError {
    /// Neither end has an altitude.
    #[error(
        "neither end of the leg has an altitude; give the item before it a place and an altitude"
    )]
    NotGiven,
    /// The ends are measured from different references and there is no telling how they differ.
    #[error(
        "one end of the leg is measured above {}, the other above {}, and how far they are apart \
         is not known; give both items the same altitude frame",
        name(*from), name(*to)
    )]
    MixedReferences {
        /// The reference at the leg's start.
        from: AltitudeReference,
        /// The reference at its end.
        to: AltitudeReference,
    },
}

fn name(reference: AltitudeReference) -> &'static str {
    match reference {
        AltitudeReference::MeanSeaLevel => "mean sea level",
        AltitudeReference::Home => "home",
        AltitudeReference::Terrain => "terrain",
    }
}

impl Altitude {
    /// The altitude of an item; `None` where its frame has none or the number is not finite.
    #[must_use]
    pub fn of(item: &MissionItem) -> Option<Self> {
        (item.frame.is_global() && item.z.is_finite())
            .then_some(Self { metres: item.z, frame: item.frame })
    }

    /// What it is measured from.
    #[must_use]
    pub fn reference(self) -> AltitudeReference {
        match self.frame {
            Frame::GLOBAL | Frame::GLOBAL_INT => AltitudeReference::MeanSeaLevel,
            Frame::GLOBAL_TERRAIN_ALT | Frame::GLOBAL_TERRAIN_ALT_INT => AltitudeReference::Terrain,
            _ => AltitudeReference::Home,
        }
    }

    /// The same altitude in metres above another reference; `home` is home's altitude above mean
    /// sea level where it is known and does not change during the mission.
    #[must_use]
    pub fn above(self, reference: AltitudeReference, home: Option<f32>) -> Option<f32> {
        use AltitudeReference as R;
        match (self.reference(), reference) {
            (own, other) if own == other => Some(self.metres),
            (R::MeanSeaLevel, R::Home) => home.map(|home| self.metres - home),
            (R::Home, R::MeanSeaLevel) => home.map(|home| self.metres + home),
            _ => None,
        }
        .filter(|metres| metres.is_finite())
    }

    /// An altitude of exactly 0 says "keep the altitude" to ArduPilot (`loc_from_cmd`) and is
    /// what ground and surface vehicles have everywhere. Nothing is to descend towards it.
    fn is_set(self) -> bool {
        self.metres != 0.0
    }
}

/// Altitudes along a leg, linear in the fraction of the distance flown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AltitudeProfile {
    start: f32,
    end: f32,
    frame: Frame,
}

impl AltitudeProfile {
    /// The altitudes between the ends of a leg.
    ///
    /// Linear, in the frame of the leg's end, where both ends have an altitude. An end without one
    /// (a landing, a return, or the number 0) does not count: the vehicle keeps the altitude of the
    /// other end, in that end's frame, so that it never descends before it is there.
    ///
    /// # Errors
    /// [`AltitudeError`] where no altitude is known, or the references cannot be converted.
    pub fn between(
        from: Option<Altitude>,
        to: Option<Altitude>,
        home: Option<f32>,
    ) -> Result<Self, AltitudeError> {
        let level = |altitude: Altitude| Self {
            start: altitude.metres,
            end: altitude.metres,
            frame: altitude.frame,
        };
        match (from.filter(|a| a.is_set()), to.filter(|a| a.is_set())) {
            (Some(from), Some(to)) => {
                let start =
                    from.above(to.reference(), home).ok_or(AltitudeError::MixedReferences {
                        from: from.reference(),
                        to: to.reference(),
                    })?;
                Ok(Self { start, end: to.metres, frame: to.frame })
            }
            (Some(only), None) | (None, Some(only)) => Ok(level(only)),
            (None, None) => to.or(from).map(level).ok_or(AltitudeError::NotGiven),
        }
    }

    /// The altitude after a fraction (0 to 1) of the leg.
    #[must_use]
    pub fn at(self, fraction: f64) -> Altitude {
        let (start, end) = (f64::from(self.start), f64::from(self.end));
        Altitude { metres: (start + (end - start) * fraction) as f32, frame: self.frame }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn altitude(metres: f32, frame: Frame) -> Option<Altitude> {
        Some(Altitude { metres, frame })
    }

    fn halfway(
        from: Option<Altitude>,
        to: Option<Altitude>,
        home: Option<f32>,
    ) -> Result<Altitude, AltitudeError> {
        AltitudeProfile::between(from, to, home).map(|profile| profile.at(0.5))
    }

    #[test]
    fn altitudes_of_one_reference_are_interpolated_in_the_frame_of_the_end() {
        let middle = halfway(
            altitude(20.0, Frame::GLOBAL_RELATIVE_ALT),
            altitude(60.0, Frame::GLOBAL_RELATIVE_ALT_INT),
            None,
        );
        assert_eq!(middle.ok(), altitude(40.0, Frame::GLOBAL_RELATIVE_ALT_INT));
    }

    #[test]
    fn sea_level_and_home_are_converted_by_the_altitude_of_home() {
        let (sea, home) = (altitude(520.0, Frame::GLOBAL), altitude(40.0, Frame(6)));
        assert_eq!(halfway(sea, home, Some(500.0)).ok(), altitude(30.0, Frame(6)));
        assert_eq!(halfway(home, sea, Some(500.0)).ok(), altitude(530.0, Frame::GLOBAL));
        assert!(matches!(halfway(sea, home, None), Err(AltitudeError::MixedReferences { .. })));
    }

    #[test]
    fn terrain_is_never_converted() {
        let (terrain, home) = (altitude(30.0, Frame(10)), altitude(40.0, Frame(3)));
        assert!(halfway(terrain, home, Some(0.0)).is_err());
        assert_eq!(
            halfway(terrain, altitude(50.0, Frame(11)), None).ok(),
            altitude(40.0, Frame(11))
        );
    }

    #[test]
    fn nothing_descends_towards_an_end_without_an_altitude() {
        let fifty = altitude(50.0, Frame::GLOBAL_TERRAIN_ALT);
        assert_eq!(halfway(fifty, None, None).ok(), fifty);
        assert_eq!(halfway(fifty, altitude(0.0, Frame::GLOBAL), None).ok(), fifty);
        assert_eq!(halfway(altitude(0.0, Frame(3)), fifty, None).ok(), fifty);
        assert_eq!(halfway(None, None, None), Err(AltitudeError::NotGiven));
    }

    #[test]
    fn a_surface_vehicle_stays_at_zero() {
        let zero = altitude(0.0, Frame(3));
        assert_eq!(halfway(zero, zero, None).ok(), zero);
        assert_eq!(halfway(zero, None, None).ok(), zero);
    }
}

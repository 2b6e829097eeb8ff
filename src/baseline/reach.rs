//! The part of the plane that is searched.

use crate::airspace::Outline;
use crate::geodesy::Xy;
use crate::planner::leg_space::LegSpace;
use crate::planner::polyline::distance;

/// Room left around the outermost regions besides twice the margin, metres.
const ROOM: f64 = 10.0;

/// What a leg is long at least for [`Reach::of`], metres.
const SHORTEST: f64 = 100.0;

/// A box around the leg and all regions, with room to go round each of them; but not further from
/// the leg than the leg is long (at least 100 m).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Reach {
    /// South-western corner.
    pub(super) low: Xy,
    /// North-eastern corner.
    pub(super) high: Xy,
}

impl Reach {
    /// The box of a leg.
    pub(super) fn of(space: &LegSpace<'_>, start: Xy, goal: Xy) -> Self {
        let leg = Self { low: start, high: start }.with(goal, 0.0);
        let room = 2.0 * space.margin() + ROOM;
        let outlines = space.airspace().outlines().iter();
        let all =
            outlines.fold(leg.with(start, room).with(goal, room), |all, outline| match outline {
                Outline::Solid(rings) => {
                    rings.iter().flatten().fold(all, |all, &point| all.with(point, room))
                }
                Outline::Zone(ring) => ring.iter().fold(all, |all, &point| all.with(point, room)),
                Outline::SolidDisc { centre, radius } | Outline::ZoneDisc { centre, radius } => {
                    all.with(*centre, radius + room)
                }
            });
        let length = distance(start, goal).max(SHORTEST);
        let most = leg.with(leg.low, length).with(leg.high, length);
        Self {
            low: Xy { x: all.low.x.max(most.low.x), y: all.low.y.max(most.low.y) },
            high: Xy { x: all.high.x.min(most.high.x), y: all.high.y.min(most.high.y) },
        }
    }

    /// Whether a point is in the box.
    pub(super) fn contains(&self, point: Xy) -> bool {
        (self.low.x..=self.high.x).contains(&point.x)
            && (self.low.y..=self.high.y).contains(&point.y)
    }

    /// The box with everything up to `room` metres from a point.
    fn with(self, point: Xy, room: f64) -> Self {
        let (low, high) = (self.low, self.high);
        Self {
            low: Xy { x: low.x.min(point.x - room), y: low.y.min(point.y - room) },
            high: Xy { x: high.x.max(point.x + room), y: high.y.max(point.y + room) },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::baseline::scenes::Scene;

    const START: Xy = Xy { x: 0.0, y: 0.0 };
    const GOAL: Xy = Xy { x: 60.0, y: 0.0 };

    fn square(x: f64, y: f64) -> [(f64, f64); 4] {
        [(x, y), (x + 10.0, y), (x + 10.0, y + 10.0), (x, y + 10.0)]
    }

    fn reach(obstacle: [(f64, f64); 4]) -> [f64; 4] {
        let Reach { low, high } = Reach::of(&Scene::new(&[obstacle]).space(5.0), START, GOAL);
        [low.x, low.y, high.x, high.y].map(f64::round)
    }

    #[test]
    fn a_region_near_the_leg_can_be_passed_on_all_sides() {
        assert_eq!(reach(square(25.0, 30.0)), [-20.0, -20.0, 80.0, 60.0]);
    }

    #[test]
    fn a_region_far_from_the_leg_does_not_lead_the_search_there() {
        assert_eq!(reach(square(9000.0, 9000.0)), [-20.0, -20.0, 160.0, 100.0]);
    }
}

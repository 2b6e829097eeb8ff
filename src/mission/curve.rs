//! Legs that are not straight: how far a curve can be from the straight line between its ends,
//! whatever the items before and after it are.

use geo::{Distance, Geodesic, Point};

use super::legs::LegEnd;
use crate::units::Metres;

fn ground_distance(from: &LegEnd, to: &LegEnd) -> f64 {
    let point = |end: &LegEnd| Point::new(end.position.lon(), end.position.lat());
    Geodesic.distance(point(from), point(to))
}

/// ArduPilot's spline (`SplineCurve`, `SPLINE_FACTOR` 4) is a cubic Hermite curve whose end
/// velocities together are at most four times as long as the straight line, in three dimensions.
/// Its distance to the line is therefore at most 4 L · max t(1−t)² = 16/27 L. One per cent is
/// added for ArduPilot's flat Earth.
pub(super) fn spline_bound(from: &LegEnd, to: &LegEnd) -> Option<Metres> {
    let (start, end) = (from.altitude?, to.altitude?);
    let climb = f64::from(end.metres) - f64::from(start.above(end.reference(), None)?);
    (start.metres != 0.0 && end.metres != 0.0)
        .then(|| Metres(1.01 * 16.0 / 27.0 * ground_distance(from, to).hypot(climb)))
}

/// The sagitta of an arc of so many degrees over the straight line: ½ L tan(θ/4).
pub(super) fn arc_bound(degrees: f64, from: &LegEnd, to: &LegEnd) -> Option<Metres> {
    (degrees.abs() < 350.0).then(|| {
        Metres(1.01 * 0.5 * ground_distance(from, to) * (degrees.abs().to_radians() / 4.0).tan())
    })
}

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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::mission::Frame;
    use crate::mission::altitude::Altitude;
    use crate::mission::testing::at;

    type Vector = [f64; 3];

    fn length(vector: Vector) -> f64 {
        vector.iter().map(|x| x * x).sum::<f64>().sqrt()
    }

    /// The point of ArduPilot's spline at a time, as an offset from the point of the straight line
    /// that a spline with no velocities would be at.
    fn offset(chord: f64, mut start: Vector, mut end: Vector, time: f64) -> Vector {
        let speed = length(start) + length(end);
        if speed > 4.0 * chord {
            start = start.map(|x| x * 4.0 * chord / speed);
            end = end.map(|x| x * 4.0 * chord / speed);
        }
        let (early, late) = (time * (1.0 - time).powi(2), time.powi(2) * (1.0 - time));
        [0, 1, 2].map(|axis| start[axis] * early - end[axis] * late)
    }

    fn end(north: i32, metres: f32) -> LegEnd {
        let altitude = Some(Altitude { metres, frame: Frame::GLOBAL_RELATIVE_ALT });
        LegEnd { item: None, position: at(north, 0), altitude, circle: Metres::ZERO }
    }

    proptest! {
        #[test]
        fn no_spline_is_further_from_its_chord_than_the_bound(
            start in prop::array::uniform3(-2000.0..2000.0_f64),
            end_velocity in prop::array::uniform3(-2000.0..2000.0_f64),
            climb in -100.0..100.0_f32,
            time in 0.0..1.0_f64,
        ) {
            let (from, to) = (end(0, 200.0), end(3, 200.0 + climb));
            let chord = ground_distance(&from, &to).hypot(f64::from(climb));
            let bound = spline_bound(&from, &to).unwrap();
            let [north, east, _] = offset(chord, start, end_velocity, time);
            prop_assert!(north.hypot(east) <= bound.0);
        }
    }

    #[test]
    fn the_bound_of_a_spline_is_reached_but_for_its_one_per_cent() {
        let (from, to) = (end(0, 50.0), end(3, 50.0));
        let chord = ground_distance(&from, &to);
        let [north, east, _] = offset(chord, [0.0, 9.0 * chord, 0.0], [0.0; 3], 1.0 / 3.0);
        let bound = spline_bound(&from, &to).unwrap();
        assert!((bound.0 / north.hypot(east) - 1.01).abs() < 1e-9);
    }

    #[test]
    fn an_arc_is_no_further_from_its_chord_than_its_sagitta() {
        let (from, to) = (end(0, 50.0), end(3, 50.0));
        let chord = ground_distance(&from, &to);
        let quarter = arc_bound(-90.0, &from, &to).unwrap();
        let sagitta = chord / 2.0_f64.sqrt() * (1.0 - 45_f64.to_radians().cos());
        assert!((quarter.0 / sagitta - 1.01).abs() < 1e-9);
        assert_eq!(arc_bound(f64::NAN, &from, &to), None);
        assert_eq!(arc_bound(360.0, &from, &to), None);
    }
}

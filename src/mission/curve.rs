//! Legs that are not straight: how far a curve can be from the straight line between its ends.
//!
//! ArduPilot's spline (`AC_WPNav`, `SplineCurve`; no other autopilot flies `NAV_SPLINE_WAYPOINT`)
//! from O to D is the cubic Hermite curve with end velocities p and n, t from 0 to 1:
//!
//! > O + (D − O)(3t² − 2t³) + p t(1−t)² − n t²(1−t)
//!
//! Its first part is on the straight line, so that the others are what takes it off. Two bounds
//! are proven for them, and the smaller counts:
//!
//! - [`spline_bound`], whatever is flown before and after. Velocities that together are longer than
//!   4 L are scaled down to that (L the length of the line in three dimensions), and both factors
//!   are at most 4/27: no further off than 16/27 L.
//! - [`bend_splines`], from the legs before and after. ArduPilot sets p to where the leg before
//!   leads: the whole of a straight one, or the velocity at the end of a spline; zero or D − O
//!   where the vehicle stopped. It sets n to the leg after where that is straight, and to the
//!   end of the leg after minus O where that is a spline; zero where it stops. Scaling only shortens
//!   them. For any t the distance to the line is convex in what is left of p and of n, between
//!   nothing and all: its maximum is at one of those four corners, which are sampled. Between
//!   samples the curve is nearer than its top speed, 1.5 L + |p| + |n|, times half a step.

use std::collections::HashMap;

use geo::{Distance, Euclidean, Geodesic, Line, Point};
use nalgebra::Vector2;

use super::commands::{Destination, Role};
use super::item::MissionItem;
use super::legs::{Leg, LegEnd, LegShape};
use crate::geodesy::{LatLon, wrapped};
use crate::units::Metres;

/// For ArduPilot's flat Earth.
const FLAT: f64 = 1.01;

/// The most of t(1−t)², and of t²(1−t).
const FACTOR: f64 = 4.0 / 27.0;

fn ground_distance(from: &LegEnd, to: &LegEnd) -> f64 {
    let point = |end: &LegEnd| Point::new(end.position.lon(), end.position.lat());
    Geodesic.distance(point(from), point(to))
}

/// How far any spline can be from the straight line, in any direction.
pub(super) fn spline_bound(from: &LegEnd, to: &LegEnd) -> Option<Metres> {
    let (start, end) = (from.altitude?, to.altitude?);
    let climb = f64::from(end.metres) - f64::from(start.above(end.reference(), None)?);
    (start.metres != 0.0 && end.metres != 0.0)
        .then(|| Metres(FLAT * 4.0 * FACTOR * ground_distance(from, to).hypot(climb)))
}

/// The sagitta of an arc of so many degrees over the straight line: ½ L tan(θ/4).
pub(super) fn arc_bound(degrees: f64, from: &LegEnd, to: &LegEnd) -> Option<Metres> {
    (degrees.abs() < 350.0).then(|| {
        Metres(FLAT * 0.5 * ground_distance(from, to) * (degrees.abs().to_radians() / 4.0).tan())
    })
}

/// Longer legs keep the bound that does not look at their neighbours, metres: over them the Earth
/// is not flat.
const LONGEST: f64 = 20_000.0;

/// Samples of a curve.
const STEPS: u32 = 256;

/// Metres for a degree of latitude, as ArduPilot has it.
const DEGREE: f64 = 111_318.845;

/// North and east, metres.
fn vector(from: LatLon, to: LatLon) -> Vector2<f64> {
    let turn = wrapped(to.lon() - from.lon());
    let middle = (to.lat() + from.lat()) / 2.0;
    Vector2::new(to.lat() - from.lat(), turn * middle.to_radians().cos()) * DEGREE
}

/// Tightens the bounds of splines by the legs before and after each.
pub(super) fn bend_splines(items: &[MissionItem], legs: &mut [Leg]) {
    let destination = |item: Option<usize>| match items.get(item?)?.command.role() {
        Role::Place(destination) => Some(destination),
        _ => None,
    };
    let role = |item: &MissionItem| item.command.role();
    // What is read as the next place behind an item of navigation that has none is not known; nor
    // is where the vehicle comes from as it flies to the first place.
    if items.iter().any(|item| matches!(role(item), Role::Hold | Role::PathNotGiven)) {
        return;
    }
    let Some(first) = items.iter().position(|item| role(item).is_navigation()) else { return };
    let takes_off = role(&items[first]) == Role::Place(Destination::Takeoff);
    if items[..first].iter().any(|item| role(item).is_jump()) {
        return;
    }
    let mut before: HashMap<usize, Vec<Leg>> = HashMap::new();
    let mut after: HashMap<usize, Vec<Leg>> = HashMap::new();
    for leg in legs.iter() {
        if let Some(item) = leg.to.item {
            before.entry(item).or_default().push(*leg);
        }
        if let Some(item) = leg.from.item {
            after.entry(item).or_default().push(*leg);
        }
    }
    let none = Vec::new();
    for leg in legs.iter_mut() {
        let (Some(from), Some(to)) = (leg.from.item, leg.to.item) else { continue };
        if destination(Some(to)) != Some(Destination::Spline) {
            continue;
        }
        let into = before.get(&from).unwrap_or(&none);
        let known = match destination(Some(from)) {
            Some(Destination::Takeoff) => true,
            _ => !into.is_empty() && (from != first || takes_off),
        };
        if known {
            tighten(leg, into, after.get(&to).unwrap_or(&none), &|leg| {
                destination(leg.to.item) == Some(Destination::Spline)
            });
        }
    }
}

fn tighten(leg: &mut Leg, before: &[Leg], after: &[Leg], is_spline: &dyn Fn(&Leg) -> bool) {
    let (from, to) = (leg.from.position, leg.to.position);
    let chord = vector(from, to);
    let starts: Vec<(Vector2<f64>, Option<f64>)> = before
        .iter()
        .map(|into| {
            // A spline into a spline ends along the line from its start to the end of this one.
            let end = if is_spline(into) { &leg.to } else { &leg.from };
            (vector(into.from.position, end.position), climb(&into.from, end))
        })
        .chain([(chord, climb(&leg.from, &leg.to)), (Vector2::zeros(), Some(0.0))])
        .collect();
    let ends: Vec<(Vector2<f64>, Option<f64>)> = after
        .iter()
        .map(|on| {
            let start = if is_spline(on) { &leg.from } else { &leg.to };
            (vector(start.position, on.to.position), climb(start, &on.to))
        })
        .chain([(Vector2::zeros(), Some(0.0))])
        .collect();
    let reach = |vectors: &[(Vector2<f64>, Option<f64>)]| {
        vectors.iter().map(|(v, _)| v.norm()).fold(chord.norm(), f64::max)
    };
    if reach(&starts).max(reach(&ends)) > LONGEST {
        return;
    }
    let mut aside: f64 = 0.0;
    for (p, _) in &starts {
        for (n, _) in &ends {
            aside = aside.max(farthest(chord, *p, *n));
        }
    }
    let steepest = |vectors: &[(Vector2<f64>, Option<f64>)]| {
        let climbs: Option<Vec<f64>> = vectors.iter().map(|(_, climb)| *climb).collect();
        climbs.map(|climbs| climbs.into_iter().map(f64::abs).fold(0.0, f64::max))
    };
    let rise = steepest(&starts).zip(steepest(&ends));
    let rise = rise.map(|(p, n)| Metres(FLAT * FACTOR * (p + n)));
    let smaller = |a: Option<Metres>, b: Option<Metres>| match (a, b) {
        (Some(a), Some(b)) => Some(a.min(b)),
        (a, b) => a.or(b),
    };
    if let LegShape::Curved { within, overshoot } = &mut leg.shape {
        *within = smaller(*within, Some(Metres(FLAT * aside)));
        *overshoot = smaller(*overshoot, rise);
    }
}

/// The difference of two altitudes, where both are given and comparable.
fn climb(from: &LegEnd, to: &LegEnd) -> Option<f64> {
    let (start, end) = (from.altitude?, to.altitude?);
    let start = start.above(end.reference(), None)?;
    (start != 0.0 && end.metres != 0.0).then(|| f64::from(end.metres) - f64::from(start))
}

/// How far any curve along `chord` whose end velocities are `p` and `n`, or zero, can be from the
/// chord, metres.
fn farthest(chord: Vector2<f64>, p: Vector2<f64>, n: Vector2<f64>) -> f64 {
    let line = Line::new((0.0, 0.0), (chord.x, chord.y));
    let mut most: f64 = 0.0;
    for (a, b) in [(0.0, 1.0), (1.0, 0.0), (1.0, 1.0)] {
        for step in 0..=STEPS {
            let t = f64::from(step) / f64::from(STEPS);
            let along = t * t * (3.0 - 2.0 * t);
            let (early, late) = (a * t * (1.0 - t).powi(2), b * t * t * (1.0 - t));
            let at = chord * along + p * early - n * late;
            most = most.max(Euclidean.distance(&Point::new(at.x, at.y), &line));
        }
    }
    most + (1.5 * chord.norm() + p.norm() + n.norm()) / f64::from(2 * STEPS)
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;
    use proptest::prelude::*;

    use super::*;
    use crate::mission::Frame;
    use crate::mission::altitude::Altitude;
    use crate::mission::testing::{at, item_at, mission, takeoff, waypoint};

    /// North, east and up, metres.
    type Space = Vector3<f64>;

    /// The point of ArduPilot's spline at a time, as an offset from the point of the straight line
    /// that a spline with no velocities would be at.
    fn offset(chord: f64, mut start: Space, mut end: Space, time: f64) -> Space {
        let speed = start.norm() + end.norm();
        if speed > 4.0 * chord {
            start *= 4.0 * chord / speed;
            end *= 4.0 * chord / speed;
        }
        let (early, late) = (time * (1.0 - time).powi(2), time.powi(2) * (1.0 - time));
        start * early - end * late
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
            let aside = offset(chord, start.into(), end_velocity.into(), time);
            prop_assert!(aside.xy().norm() <= bound.0);
        }
    }

    /// The curve of one spline as ArduPilot computes it, from its own velocities.
    fn flown(o: Space, d: Space, p: Space, n: Space) -> Vec<Space> {
        let chord = d - o;
        (0..=300)
            .map(|step| {
                let t = f64::from(step) / 300.0;
                o + chord * t * t * (3.0 - 2.0 * t) + offset(chord.norm(), p, n, t)
            })
            .collect()
    }

    proptest! {
        #[test]
        fn a_spline_among_its_neighbours_stays_within_its_bounds(
            places in prop::collection::vec((0..30_i32, 0..30_i32, 20.0..90.0_f32), 4),
            kinds in prop::array::uniform4(any::<bool>()),
        ) {
            let item = |k: usize| {
                let (north, east, z) = places[k];
                let command = if k > 0 && kinds[k] { 82 } else { 16 };
                MissionItem { z, ..item_at(command, north, east) }
            };
            let mission = mission([takeoff(), item(0), item(1), item(2), item(3)]);
            let legs = crate::mission::legs(&mission, &Default::default()).unwrap().legs;
            let place = |k: usize| {
                let ground = vector(at(0, 0), at(places[k].0, places[k].1));
                ground.push(f64::from(places[k].2))
            };
            // The middle leg, 1 to 2, with its neighbours 0 to 1 and 2 to 3.
            let (from, to) = (place(1), place(2));
            prop_assume!((to - from).norm() > 1.0);
            let middle = legs
                .iter()
                .find(|leg| (leg.from.item, leg.to.item) == (Some(2), Some(3)))
                .unwrap();
            let LegShape::Curved { within: Some(within), overshoot: Some(overshoot) } = middle.shape
            else {
                prop_assert!(!kinds[2]);
                return Ok(());
            };
            let p = if kinds[1] { to } else { from } - place(0);
            let n = place(3) - if kinds[3] { from } else { to };
            let line = Line::new((from.x, from.y), (to.x, to.y));
            let (low, high) = (from.z.min(to.z), from.z.max(to.z));
            let none = Space::zeros();
            for (p, n) in [(p, n), (p, none), (none, n), (p * 0.6, n)] {
                for place in flown(from, to, p, n) {
                    let off = Euclidean.distance(&Point::new(place.x, place.y), &line);
                    prop_assert!(off <= within.0, "{} of {}", off, within);
                    prop_assert!(place.z <= high + overshoot.0 + 1e-6);
                    prop_assert!(place.z >= low - overshoot.0 - 1e-6);
                }
            }
            let general = spline_bound(&middle.from, &middle.to).unwrap();
            prop_assert!(within <= general);
        }
    }

    #[test]
    fn a_spline_that_hardly_bends_has_a_narrow_bound() {
        let spline = |north, east| MissionItem { z: 50.0, ..item_at(82, north, east) };
        let straight = mission([takeoff(), waypoint(0, 1), spline(0, 2), spline(0, 3)]);
        let legs = crate::mission::legs(&straight, &Default::default()).unwrap().legs;
        for leg in &legs[1..] {
            let LegShape::Curved { within: Some(within), overshoot: Some(overshoot) } = leg.shape
            else {
                panic!("{leg:?}")
            };
            assert!(within < Metres(2.0), "{within}");
            assert!(overshoot < Metres(0.01), "{overshoot}");
        }
    }

    #[test]
    fn the_bound_of_a_spline_is_reached_but_for_its_one_per_cent() {
        let (from, to) = (end(0, 50.0), end(3, 50.0));
        let chord = ground_distance(&from, &to);
        let start = Space::new(0.0, 9.0 * chord, 0.0);
        let aside = offset(chord, start, Space::zeros(), 1.0 / 3.0).xy().norm();
        let bound = spline_bound(&from, &to).unwrap();
        assert!((bound.0 / aside - 1.01).abs() < 1e-9);
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

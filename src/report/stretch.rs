//! Each leg of the original mission with what is now flown for it.

use crate::geodesy::{LatLon, geodesic_distance};
use crate::mission::Leg;
use crate::mission::legs::LegKind;
use crate::replan::{LegRecord, LegVerdict, Replanned, Verdict};
use crate::units::Metres;

/// A leg of the original mission and what is now flown for it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stretch<'a> {
    /// The verdict on the leg as it was.
    pub before: &'a LegVerdict,
    /// How it was planned, where it was planned itself.
    pub record: Option<&'a LegRecord>,
    /// Whether it is flown over inserted waypoints: its own, or those of a leg that it shares
    /// them with.
    pub replanned: bool,
    /// The length of what is flown now.
    pub length: Metres,
    /// Its least clearance.
    pub clearance: Metres,
}

impl<'a> Stretch<'a> {
    /// A leg that is flown as it was.
    pub(super) fn unchanged(before: &'a LegVerdict) -> Self {
        let &LegVerdict { length, clearance, .. } = before;
        Self { before, record: None, replanned: false, length, clearance }
    }
}

/// The legs of the original mission, in the order of its verdict.
#[must_use]
pub fn stretches(result: &Replanned) -> Vec<Stretch<'_>> {
    result.before.legs.iter().map(|before| stretch(before, result)).collect()
}

fn stretch<'a>(before: &'a LegVerdict, result: &'a Replanned) -> Stretch<'a> {
    let leg = &before.leg;
    let shares = |record: &&LegRecord| {
        leg.insert_before.is_some() && record.leg.insert_before == leg.insert_before
    };
    let Some(record) = result.legs.iter().find(shares) else { return Stretch::unchanged(before) };
    let own = record.leg == *leg;
    let places = places(leg, record);
    let clearance = match flown_clearance(&places, &result.after) {
        Some(clearance) => clearance,
        // Not more than the truth.
        None if own => result.after.clearance(),
        None => return Stretch::unchanged(before),
    };
    let length = places.windows(2).map(|edge| geodesic_distance(edge[0], edge[1])).sum();
    Stretch { before, record: own.then_some(record), replanned: true, length, clearance }
}

/// A leg's ends with the inserted waypoints between them.
fn places(leg: &Leg, record: &LegRecord) -> Vec<LatLon> {
    let inserted = record.waypoints.iter().filter_map(|waypoint| waypoint.to_degrees().ok());
    std::iter::once(leg.from.position).chain(inserted).chain([leg.to.position]).collect()
}

/// The least clearance of the legs between these places; `None` where two of them in a row are
/// joined by no leg.
fn flown_clearance(places: &[LatLon], after: &Verdict) -> Option<Metres> {
    places.windows(2).try_fold(Metres::INFINITY, |least, edge| {
        let joins = |verdict: &&LegVerdict| {
            let Leg { from, to, kind, .. } = verdict.leg;
            from.position == edge[0] && to.position == edge[1] && kind != LegKind::Stay
        };
        let flown = after.legs.iter().filter(joins).map(|verdict| verdict.clearance);
        flown.reduce(Metres::min).map(|clearance| least.min(clearance))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mission::legs::ReturnTo;
    use crate::replan::Options;
    use crate::report::samples;

    #[test]
    fn legs_that_share_inserted_waypoints_are_all_flown_over_them() {
        let result = samples::planned_there_and_back(&Options::default());
        let stretches = stretches(&result);
        let to = |kind: LegKind| {
            stretches.iter().find(|stretch| stretch.before.leg.kind == kind).unwrap()
        };
        let home = to(LegKind::Return(ReturnTo::Home));
        let rally = to(LegKind::Return(ReturnTo::Rally(0)));
        assert_eq!(home.before.leg.insert_before, rally.before.leg.insert_before);
        assert_eq!(u8::from(home.record.is_some()) + u8::from(rally.record.is_some()), 1);
        for stretch in [home, rally] {
            assert!(stretch.replanned);
            assert!(stretch.before.clearance.0 == 0.0 && stretch.clearance.0 >= 5.0);
            assert!(stretch.length > stretch.before.length);
        }
    }
}

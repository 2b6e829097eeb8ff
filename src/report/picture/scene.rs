//! What is drawn, in the local metres of the zone with the most legs.

use std::collections::HashSet;

use geo::MultiPolygon;

use super::Subject;
use crate::airspace::Outline;
use crate::geodesy::{LocalFrame, ProjectionError, Xy, Zone};
use crate::mission::Leg;
use crate::mission::legs::{LegKind, number as item_number};
use crate::planner::candidates::Source;
use crate::replan::{Field, LegRecord, LegVerdict, Verdict};
use crate::report::text::clearance;

/// The share of the route's extent that is shown around it.
const AROUND: f64 = 0.06;

/// What is near to the route is shown whole as long as that makes the map at most this many times
/// as long as the route: where there is a new route, and where what bars the way matters more.
const WIDENED: f64 = 1.4;
const WIDENED_JUDGED: f64 = 2.0;

/// The least height of the map over its width, and its least width over its height: what is
/// visible beside a route that is a straight line.
const SLIM: f64 = 0.37;

/// A straight leg.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Edge {
    pub(super) from: Xy,
    pub(super) to: Xy,
}

/// What a place of the mission is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    /// An item of the original.
    Item,
    /// A waypoint that was inserted.
    Inserted,
}

/// A place of the mission.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Place {
    pub(super) at: Xy,
    /// The item's number as ground stations count; `None`: home, a rally point or the start.
    pub(super) number: Option<usize>,
    pub(super) role: Role,
    /// Radius of the circle that is flown around it, metres.
    pub(super) circle: f64,
    /// The least clearance of the leg that ends here, metres.
    pub(super) clearance: Option<f64>,
}

/// Everything on the map.
#[derive(Debug)]
pub(super) struct Scene<'a> {
    pub(super) outlines: &'a [Outline],
    pub(super) union: Option<&'a MultiPolygon>,
    pub(super) margin: f64,
    /// Whether there is a new mission besides the original.
    pub(super) is_planned: bool,
    /// What is not flown any more, or is not clear.
    pub(super) old: Vec<Edge>,
    /// What is flown, or is clear.
    pub(super) new: Vec<Edge>,
    /// The legs planned in this zone.
    pub(super) records: Vec<&'a LegRecord>,
    pub(super) places: Vec<Place>,
    /// What is flown, or was judged, leg by leg in words.
    pub(super) tips: Vec<(Edge, String)>,
    pub(super) start: Option<Xy>,
    pub(super) goal: Option<Xy>,
}

impl<'a> Scene<'a> {
    pub(super) fn new(subject: &Subject<'a>) -> Result<Self, ProjectionError> {
        let mut scene = Self {
            outlines: &[],
            union: None,
            margin: 0.0,
            is_planned: false,
            old: Vec::new(),
            new: Vec::new(),
            records: Vec::new(),
            places: Vec::new(),
            tips: Vec::new(),
            start: None,
            goal: None,
        };
        let Some(field) = main_field(subject) else { return Ok(scene) };
        let frame = LocalFrame::new(field.zone, field.origin)?;
        let only = subject.fields.len() == 1;
        let is_here = |leg: &Leg| leg.kind != LegKind::Stay && (only || zone_of(leg) == field.zone);
        let edges = |verdict: &Verdict, wanted: &dyn Fn(&LegVerdict) -> bool| {
            let legs = verdict.legs.iter().filter(|v| is_here(&v.leg) && wanted(v));
            legs.map(|v| edge(&v.leg, &frame)).collect::<Result<Vec<_>, _>>().map(without_repeats)
        };
        scene.outlines = &field.outlines;
        scene.union = field.union.as_ref();
        scene.margin = field.margin;
        let (flown, inserted) = match subject.after {
            None => {
                scene.old = edges(subject.before, &|verdict| verdict.blocker.is_some())?;
                scene.new = edges(subject.before, &|verdict| verdict.blocker.is_none())?;
                (subject.before, [].as_slice())
            }
            Some((after, inserted, records)) => {
                scene.old = edges(subject.before, &|_| true)?;
                scene.new = edges(after, &|_| true)?;
                scene.records = records.iter().filter(|r| r.zone == field.zone).collect();
                (after, inserted)
            }
        };
        scene.is_planned = subject.after.is_some();
        scene.places = places(flown, inserted, &frame, is_here)?;
        for verdict in flown.legs.iter().filter(|v| is_here(&v.leg)) {
            scene.tips.push((edge(&verdict.leg, &frame)?, told(verdict)));
        }
        let way = flown.places();
        let end = |place: Option<&crate::geodesy::LatLon>| {
            place.map(|&place| frame.to_local(place)).transpose()
        };
        (scene.start, scene.goal) = (end(way.first())?, end(way.last())?);
        Ok(scene)
    }

    /// Candidates besides the straight lines.
    pub(super) fn candidates(&self, source: Source) -> impl Iterator<Item = &'a [Xy]> + '_ {
        let all = self.records.iter().flat_map(|record| &record.candidates);
        all.filter(move |candidate| candidate.source == source).map(|c| c.points.as_slice())
    }

    /// The corners of what is shown, never without area.
    pub(super) fn extent(&self) -> (Xy, Xy) {
        let mut extent = Extent::default();
        for edge in self.old.iter().chain(&self.new) {
            extent.add(edge.from);
            extent.add(edge.to);
        }
        for source in [Source::Corners, Source::Grid] {
            self.candidates(source).flatten().for_each(|&point| extent.add(point));
        }
        for place in self.places.iter().filter(|place| place.circle > 0.0) {
            let reach = Xy { x: place.circle, y: place.circle };
            extent.add(place.at - reach);
            extent.add(place.at + reach);
        }
        let route = extent.grown(2.0 * self.margin).at_least(SLIM);
        // What is near, and for a judged mission what is near to that.
        let (passes, widened) = if self.is_planned { (1, WIDENED) } else { (2, WIDENED_JUDGED) };
        let limit = widened * route.longer();
        let mut shown = route;
        for _ in 0..passes {
            let near = shown;
            for outline in self.outlines.iter().map(Extent::of).filter(|o| o.overlaps(&near)) {
                let wider = shown.with(&outline.grown(self.margin));
                if wider.longer() <= limit {
                    shown = wider;
                }
            }
        }
        let shown = shown.grown(AROUND * route.longer());
        (shown.low, shown.high)
    }
}

/// A bounding box.
#[derive(Debug, Clone, Copy)]
struct Extent {
    low: Xy,
    high: Xy,
}

impl Default for Extent {
    fn default() -> Self {
        let far = f64::INFINITY;
        Self { low: Xy { x: far, y: far }, high: Xy { x: -far, y: -far } }
    }
}

impl Extent {
    fn add(&mut self, point: Xy) {
        self.low = Xy { x: self.low.x.min(point.x), y: self.low.y.min(point.y) };
        self.high = Xy { x: self.high.x.max(point.x), y: self.high.y.max(point.y) };
    }

    fn of(outline: &Outline) -> Self {
        let mut extent = Self::default();
        match outline {
            Outline::Solid(rings) => rings.iter().flatten().for_each(|&point| extent.add(point)),
            Outline::Zone(ring) => ring.iter().for_each(|&point| extent.add(point)),
            &Outline::SolidDisc { centre, radius } | &Outline::ZoneDisc { centre, radius } => {
                let reach = Xy { x: radius, y: radius };
                extent.add(centre - reach);
                extent.add(centre + reach);
            }
        }
        extent
    }

    fn longer(&self) -> f64 {
        (self.high.x - self.low.x).max(self.high.y - self.low.y)
    }

    fn overlaps(&self, other: &Self) -> bool {
        self.low.x < other.high.x
            && other.low.x < self.high.x
            && self.low.y < other.high.y
            && other.low.y < self.high.y
    }

    fn with(mut self, other: &Self) -> Self {
        self.add(other.low);
        self.add(other.high);
        self
    }

    /// With some metres around it, at least 10 m; around the origin where it is empty.
    fn grown(self, around: f64) -> Self {
        let around = around.max(10.0);
        let by = Xy { x: around, y: around };
        if self.low.x > self.high.x {
            return Self { low: -by, high: by };
        }
        Self { low: self.low - by, high: self.high + by }
    }

    /// No side shorter than a share of the other.
    fn at_least(self, share: f64) -> Self {
        let least = share * self.longer();
        let size = self.high - self.low;
        let lacking = |length: f64| (least - length).max(0.0) / 2.0;
        let by = Xy { x: lacking(size.x), y: lacking(size.y) };
        Self { low: self.low - by, high: self.high + by }
    }
}

/// The field with the most legs.
fn main_field<'a>(subject: &Subject<'a>) -> Option<&'a Field> {
    let legs = |field: &&Field| {
        subject.before.legs.iter().filter(|verdict| zone_of(&verdict.leg) == field.zone).count()
    };
    subject.fields.iter().max_by_key(legs)
}

fn zone_of(leg: &Leg) -> Zone {
    Zone::of_leg(leg.from.position, leg.to.position)
}

fn edge(leg: &Leg, frame: &LocalFrame) -> Result<Edge, ProjectionError> {
    let (from, to) = (frame.to_local(leg.from.position)?, frame.to_local(leg.to.position)?);
    Ok(Edge { from, to })
}

fn told(verdict: &LegVerdict) -> String {
    let LegVerdict { leg, length, blocker, .. } = verdict;
    let near = blocker.as_ref().map_or_else(String::new, |(region, meets)| {
        format!(", {} {region}", if *meets { "meets" } else { "too near to" })
    });
    format!("{}: {length:.1}, clearance {}{near}", leg.name(), clearance(verdict.clearance))
}

/// One edge for all between the same places, whatever their direction: dashes of two would fill
/// each other's gaps.
fn without_repeats(mut edges: Vec<Edge>) -> Vec<Edge> {
    let bits = |at: Xy| (at.x.to_bits(), at.y.to_bits());
    let mut known = HashSet::new();
    edges.retain(|edge| {
        let (from, to) = (bits(edge.from), bits(edge.to));
        known.insert((from.min(to), from.max(to)))
    });
    edges
}

/// Where the legs that are flown end, and where the first one starts.
fn places(
    flown: &Verdict,
    inserted: &[usize],
    frame: &LocalFrame,
    is_here: impl Fn(&Leg) -> bool,
) -> Result<Vec<Place>, ProjectionError> {
    let mut places: Vec<Place> = Vec::new();
    let mut add = |place: Place| {
        let same = |known: &&mut Place| known.at == place.at && known.number == place.number;
        match places.iter_mut().find(same) {
            Some(known) => {
                known.circle = known.circle.max(place.circle);
                known.clearance =
                    [known.clearance, place.clearance].into_iter().flatten().reduce(f64::min);
            }
            None => places.push(place),
        }
    };
    for (k, verdict) in flown.legs.iter().filter(|v| is_here(&v.leg)).enumerate() {
        let leg = &verdict.leg;
        if k == 0 {
            // A start that is an item's place: the mission begins there.
            let number = leg.from.item.map(item_number);
            let (at, circle) = (frame.to_local(leg.from.position)?, leg.from.circle.0);
            add(Place { at, number, role: Role::Item, circle, clearance: None });
        }
        let item = match leg.kind {
            LegKind::Return(_) => None,
            _ => leg.to.item,
        };
        let is_new = item.is_some_and(|item| inserted.binary_search(&item).is_ok());
        let role = if is_new { Role::Inserted } else { Role::Item };
        let (at, circle) = (frame.to_local(leg.to.position)?, leg.to.circle.0);
        let clearance = verdict.clearance.0.is_finite().then_some(verdict.clearance.0);
        add(Place { at, number: item.map(item_number), role, circle, clearance });
    }
    Ok(places)
}

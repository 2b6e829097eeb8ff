//! A scene: fences, a start and a goal, in the metres of a tangent plane somewhere on Earth.

use std::f64::consts::TAU;

use quav::fence::{FenceRegion, FenceRole, FenceSet, FenceShape, InclusionRule};
use quav::geodesy::{LatLon, LatLonE7};
use quav::units::Metres;

use super::ground::{Ground, P};
use super::plane::{add, crossing, edges, inside, mul, rotated, sub};

/// The sides of a round inclusion that is one of several.
const SIDES: f64 = 1440.0;

#[derive(Debug, Clone)]
pub(crate) enum Shape {
    /// Not closed.
    Ring(Vec<P>),
    Disc(P, f64),
}

#[derive(Debug, Clone)]
pub(crate) struct Region {
    pub(crate) inclusion: bool,
    pub(crate) shape: Shape,
}

/// What is known of a scene beforehand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Known {
    Nothing,
    Solvable,
    Infeasible,
}

#[derive(Debug, Clone)]
pub(crate) struct Scene {
    pub(crate) name: String,
    /// Where on Earth the plane's origin is: latitude and longitude.
    pub(crate) at: (f64, f64),
    pub(crate) start: P,
    pub(crate) goal: P,
    pub(crate) regions: Vec<Region>,
    /// Whether the inclusions all hold, or one of them is enough.
    pub(crate) rule: InclusionRule,
    pub(crate) known: Known,
}

impl Scene {
    pub(crate) fn ground(&self) -> Ground {
        Ground::new(self.at.0, self.at.1)
    }

    /// Start and goal as a vehicle holds them.
    pub(crate) fn ends(&self) -> (LatLonE7, LatLonE7) {
        let ground = self.ground();
        (ground.position(self.start).to_e7(), ground.position(self.goal).to_e7())
    }

    pub(crate) fn fences(&self) -> FenceSet {
        let ground = self.ground();
        let place = |p: &P| -> LatLon { ground.position(*p) };
        let regions = self.regions.iter().enumerate().map(|(i, region)| FenceRegion {
            heights: None,
            role: if region.inclusion { FenceRole::Inclusion } else { FenceRole::Exclusion },
            shape: match &region.shape {
                Shape::Ring(ring) => FenceShape::Polygon(ring.iter().map(place).collect()),
                Shape::Disc(centre, radius) => {
                    FenceShape::Circle { centre: place(centre), radius: Metres(*radius) }
                }
            },
            origin: format!("region {i}"),
        });
        FenceSet { regions: regions.collect(), return_point: None }
    }

    /// Whether one of several inclusions is enough.
    pub(crate) fn is_union(&self) -> bool {
        self.rule == InclusionRule::Any
    }

    /// The inclusions as rings; round ones with so many sides that it makes no difference.
    pub(crate) fn zones(&self) -> Vec<Vec<P>> {
        let zones = self.regions.iter().filter(|region| region.inclusion);
        zones
            .map(|region| match &region.shape {
                Shape::Ring(ring) => ring.clone(),
                Shape::Disc(centre, radius) => {
                    let side = |k: u32| rotated([*radius, 0.0], TAU * f64::from(k) / SIDES);
                    (0..SIDES as u32).map(|k| add(*centre, side(k))).collect()
                }
            })
            .collect()
    }

    /// The edge of all inclusions together, where one of them is enough: the pieces of their
    /// edges that lie in no other one, and the points where two of these meet.
    pub(crate) fn union_edge(&self) -> (Vec<(P, P)>, Vec<P>) {
        let zones = self.zones();
        let (mut pieces, mut meetings) = (Vec::new(), Vec::new());
        for (k, zone) in zones.iter().enumerate() {
            let others = || zones.iter().enumerate().filter(|(j, _)| *j != k).map(|(_, z)| z);
            for (a, b) in edges(zone) {
                let met = others().flat_map(|z| edges(z)).filter_map(|(c, d)| crossing(a, b, c, d));
                let mut cuts: Vec<f64> = met.chain([0.0, 1.0]).collect();
                cuts.sort_by(f64::total_cmp);
                let at = |t: f64| add(a, mul(sub(b, a), t));
                for pair in cuts.windows(2) {
                    if !others().any(|z| inside(at(f64::midpoint(pair[0], pair[1])), z)) {
                        pieces.push((at(pair[0]), at(pair[1])));
                        let met = pair.iter().filter(|&&t| t > 0.0 && t < 1.0);
                        meetings.extend(met.map(|&t| at(t)));
                    }
                }
            }
        }
        (pieces, meetings)
    }

    /// All edges, and the discs that are obstacles as a point with a radius.
    pub(crate) fn walls(&self) -> Vec<(P, P, f64)> {
        let mut walls = Vec::new();
        if self.is_union() {
            walls.extend(self.union_edge().0.into_iter().map(|(a, b)| (a, b, 0.0)));
        }
        for region in self.regions.iter().filter(|region| !(region.inclusion && self.is_union())) {
            match &region.shape {
                Shape::Ring(ring) => walls.extend(edges(ring).map(|(a, b)| (a, b, 0.0))),
                Shape::Disc(centre, radius) if !region.inclusion => {
                    walls.push((*centre, *centre, *radius));
                }
                Shape::Disc(..) => {}
            }
        }
        walls
    }
}

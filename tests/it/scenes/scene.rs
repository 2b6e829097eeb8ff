//! A scene: fences, a start and a goal, in the metres of a tangent plane somewhere on Earth.

use quav::fence::{FenceRegion, FenceRole, FenceSet, FenceShape};
use quav::geodesy::{LatLon, LatLonE7};
use quav::units::Metres;

use super::ground::{Ground, P};
use super::plane::edges;

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

    /// All edges, and the discs that are obstacles as a point with a radius.
    pub(crate) fn walls(&self) -> Vec<(P, P, f64)> {
        let mut walls = Vec::new();
        for region in &self.regions {
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

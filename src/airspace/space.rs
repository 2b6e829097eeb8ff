//! The airspace of a leg: all regions as barriers, and the two questions a path asks of it, "how
//! near does this segment come?" and "which region is it?".

use std::collections::{BTreeSet, HashMap};

use geo::{Line, MultiPolygon, Polygon, unary_union};
use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};

use super::barrier::{Barrier, BarrierIndex, BarrierShape};
use super::outline::{AirspaceError, Outline, RegionProblem, contains, edges, outline};
use super::slabs::Slabs;
use crate::fence::{FenceRegion, FenceRole, FenceSet, InclusionRule};
use crate::geodesy::{LocalFrame, Xy};

/// A region's index in the [`FenceSet`] that the airspace was built from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct RegionId(pub u32);

/// A boundary that a path may have to go round, with the forbidden side on the left of its
/// edges (a counter-clockwise obstacle, or a clockwise inclusion).
#[derive(Debug, Clone, PartialEq)]
pub enum Boundary {
    /// A ring of walls.
    Ring(Vec<Xy>),
    /// A round obstacle.
    Disc {
        /// Its centre.
        centre: Xy,
        /// Its radius, metres.
        radius: f64,
    },
}

/// The bounding box of one ring of an obstacle: its region, and which of the region's rings.
type SolidBox = GeomWithData<Rectangle<[f64; 2]>, (RegionId, usize)>;

/// Fences as planar barriers in the metres of one local frame, unbuffered.
#[derive(Debug)]
pub struct Airspace {
    outlines: Vec<Outline>,
    barriers: BarrierIndex,
    solids: RTree<SolidBox>,
    /// Of rings with many vertices, by their region and which of its rings they are.
    slabs: HashMap<(RegionId, usize), Slabs>,
    /// With [`InclusionRule::Any`]: the union of the inclusions, where there are several, and the
    /// first of them.
    union: Option<(MultiPolygon, RegionId)>,
    /// The inclusions that each have to be kept.
    zones: Vec<RegionId>,
    warnings: Vec<String>,
}

impl Airspace {
    /// Makes every region of a fence set planar and indexes it.
    ///
    /// # Errors
    /// [`AirspaceError`] naming the first region that cannot be used.
    pub fn new(
        fences: &FenceSet,
        frame: &LocalFrame,
        rule: InclusionRule,
    ) -> Result<Self, AirspaceError> {
        Self::with_limits(fences, &[], frame, rule)
    }

    /// The same with limits: inclusions that have to be kept besides the others, whatever the
    /// rule for those is. Their ids follow on those of the fence set.
    ///
    /// # Errors
    /// As [`Airspace::new`].
    pub fn with_limits(
        fences: &FenceSet,
        limits: &[FenceRegion],
        frame: &LocalFrame,
        rule: InclusionRule,
    ) -> Result<Self, AirspaceError> {
        let mut outlines = Vec::with_capacity(fences.regions.len() + limits.len());
        let mut warnings = Vec::new();
        for region in fences.regions.iter().chain(limits) {
            let (shape, warning) = outline(region, frame)?;
            if rule == InclusionRule::Any
                && warning.is_some()
                && region.role == FenceRole::Inclusion
            {
                let origin = region.origin.clone();
                return Err(AirspaceError { origin, problem: RegionProblem::CrossingZone });
            }
            outlines.push(shape);
            warnings.extend(warning);
        }
        let mut zones: Vec<RegionId> = regions(&outlines)
            .filter(|(_, outline)| matches!(outline, Outline::Zone(_) | Outline::ZoneDisc { .. }))
            .map(|(id, _)| id)
            .collect();
        let limits_from = zones.partition_point(|id| (id.0 as usize) < fences.regions.len());
        let union = (rule == InclusionRule::Any && limits_from > 1).then(|| {
            let joined: Vec<RegionId> = zones.drain(..limits_from).collect();
            (unary_union(&zone_polygons(&outlines, &joined)), joined[0])
        });
        Ok(Self::assembled(outlines, union, zones, warnings))
    }

    /// The same airspace without some of its obstacles. All others keep their ids.
    #[must_use]
    pub fn without(&self, obstacles: &[RegionId]) -> Self {
        let outline = |(id, outline): (RegionId, &Outline)| match outline {
            Outline::Solid(_) | Outline::SolidDisc { .. } if obstacles.contains(&id) => {
                Outline::Solid(Vec::new())
            }
            other => other.clone(),
        };
        let outlines = regions(&self.outlines).map(outline).collect();
        Self::assembled(outlines, self.union.clone(), self.zones.clone(), self.warnings.clone())
    }

    fn assembled(
        outlines: Vec<Outline>,
        union: Option<(MultiPolygon, RegionId)>,
        zones: Vec<RegionId>,
        warnings: Vec<String>,
    ) -> Self {
        let mut space = Self {
            barriers: BarrierIndex::new(Vec::new()),
            solids: RTree::bulk_load(solid_boxes(&outlines)),
            slabs: slabs(&outlines),
            outlines,
            union,
            zones,
            warnings,
        };
        let mut barriers = Vec::new();
        for (region, boundary) in space.boundaries() {
            match boundary {
                Boundary::Ring(ring) => {
                    barriers.extend(edges(&ring).map(|(a, b)| Barrier {
                        shape: BarrierShape::Wall(Line::new(a, b)),
                        region,
                    }))
                }
                Boundary::Disc { centre, radius } => {
                    barriers.push(Barrier { shape: BarrierShape::Disc { centre, radius }, region })
                }
            }
        }
        space.barriers = BarrierIndex::new(barriers);
        space
    }

    /// What was odd about the regions, a sentence each.
    #[must_use]
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// The regions in the plane, by their index in the fence set.
    #[must_use]
    pub fn outlines(&self) -> &[Outline] {
        &self.outlines
    }

    /// Every boundary, with the forbidden side on the left. Inclusion circles are not among
    /// them: being convex, they are judged by the end points of a segment.
    #[must_use]
    pub fn boundaries(&self) -> Vec<(RegionId, Boundary)> {
        let mut boundaries = Vec::new();
        for (id, outline) in regions(&self.outlines) {
            match outline {
                Outline::Solid(rings) => {
                    boundaries.extend(rings.iter().map(|ring| (id, Boundary::Ring(ring.clone()))));
                }
                Outline::SolidDisc { centre, radius } => {
                    boundaries.push((id, Boundary::Disc { centre: *centre, radius: *radius }));
                }
                Outline::Zone(ring) if self.zones.contains(&id) => {
                    boundaries.push((id, Boundary::Ring(ring.iter().rev().copied().collect())));
                }
                Outline::Zone(_) | Outline::ZoneDisc { .. } => {}
            }
        }
        if let &Some((ref union, first)) = &self.union {
            // Outlines of the union belong to no single region: they are blamed on the first.
            for polygon in union {
                for ring in std::iter::once(polygon.exterior()).chain(polygon.interiors()) {
                    let outer = std::ptr::eq(ring, polygon.exterior());
                    let mut points: Vec<Xy> = ring.coords().skip(1).copied().collect();
                    let counter_clockwise = super::outline::signed_area(&points) > 0.0;
                    if counter_clockwise == outer {
                        points.reverse();
                    }
                    boundaries.push((first, Boundary::Ring(points)));
                }
            }
        }
        boundaries
    }

    /// How near a segment comes to any boundary, metres, looked for up to `at_most`; 0 where it
    /// meets or is beyond one. `None`: nothing is nearer than `at_most`.
    #[must_use]
    pub fn nearest(&self, a: Xy, b: Xy, at_most: f64) -> Option<(f64, RegionId)> {
        self.search(a, b, at_most, 0.0)
    }

    /// The clearance of a segment in metres: [`Airspace::nearest`] without its region, and
    /// without a limit. Infinite in an airspace without regions.
    #[must_use]
    pub fn clearance(&self, a: Xy, b: Xy) -> f64 {
        // Small radii first, so that the search is a small one wherever something is near.
        [32.0, 1024.0, f64::INFINITY]
            .into_iter()
            .find_map(|at_most| self.nearest(a, b, at_most))
            .map_or(f64::INFINITY, |(distance, _)| distance)
    }

    /// The region that a segment comes nearer to than `margin` metres (or meets, or is on the
    /// wrong side of), or `None` where the segment is clear. With several, any of them.
    #[must_use]
    pub fn blocker(&self, a: Xy, b: Xy, margin: f64) -> Option<RegionId> {
        // A wall that is met bars the way also where no margin is asked for.
        let margin = margin.max(f64::MIN_POSITIVE);
        self.search(a, b, margin, margin).map(|(_, region)| region)
    }

    /// The same for a segment whose start is known to be on the allowed side of everything.
    #[must_use]
    pub fn blocker_from_inside(&self, a: Xy, b: Xy, margin: f64) -> Option<RegionId> {
        let margin = margin.max(f64::MIN_POSITIVE);
        self.nearest_wall(a, b, margin, margin).map(|(_, region)| region)
    }

    /// Whether a segment keeps at least `margin` metres from everything.
    #[must_use]
    pub fn is_clear(&self, a: Xy, b: Xy, margin: f64) -> bool {
        self.blocker(a, b, margin).is_none()
    }

    /// With [`InclusionRule::Any`], the union of several inclusions: inside it is allowed.
    #[must_use]
    pub fn union(&self) -> Option<&MultiPolygon> {
        self.union.as_ref().map(|(union, _)| union)
    }

    /// The inclusions that each have to be kept, be there a union of others or not.
    pub fn zones(&self) -> impl Iterator<Item = &Outline> {
        self.zones.iter().map(|id| &self.outlines[id.0 as usize])
    }

    /// Every obstacle that comes nearer to a segment than `margin` metres.
    #[must_use]
    pub fn obstacles_near(&self, a: Xy, b: Xy, margin: f64) -> BTreeSet<RegionId> {
        let near = self.barriers.within(Line::new(a, b), margin).map(|(_, barrier)| barrier.region);
        let here = AABB::from_point([a.x, a.y]);
        let around = self.solids.locate_in_envelope_intersecting(&here).filter_map(|entry| {
            let (region, ring) = entry.data;
            match &self.outlines[region.0 as usize] {
                Outline::Solid(rings) => contains(&rings[ring], a).then_some(region),
                _ => None,
            }
        });
        let is_obstacle = |id: &RegionId| {
            matches!(self.outlines[id.0 as usize], Outline::Solid(_) | Outline::SolidDisc { .. })
        };
        near.chain(around).filter(is_obstacle).collect()
    }

    /// The obstacles that are at least in part in a box, by any one point of each of their parts.
    pub fn obstacles_in(&self, low: Xy, high: Xy) -> impl Iterator<Item = (RegionId, Xy)> {
        let envelope = AABB::from_corners([low.x, low.y], [high.x, high.y]);
        self.solids.locate_in_envelope_intersecting(&envelope).filter_map(|entry| {
            let (region, ring) = entry.data;
            let point = match &self.outlines[region.0 as usize] {
                Outline::Solid(rings) => *rings.get(ring)?.first()?,
                Outline::SolidDisc { centre, .. } => *centre,
                Outline::Zone(_) | Outline::ZoneDisc { .. } => return None,
            };
            Some((region, point))
        })
    }

    /// The index over the barriers.
    #[must_use]
    pub fn barriers(&self) -> &BarrierIndex {
        &self.barriers
    }

    fn search(&self, a: Xy, b: Xy, at_most: f64, enough: f64) -> Option<(f64, RegionId)> {
        // Side first: a segment that meets no wall is on one side with its whole length.
        if let Some(region) = self.forbidden_side(a) {
            return Some((0.0, region));
        }
        self.nearest_wall(a, b, at_most, enough)
    }

    fn nearest_wall(&self, a: Xy, b: Xy, at_most: f64, enough: f64) -> Option<(f64, RegionId)> {
        let mut nearest = self.barriers.nearest(Line::new(a, b), at_most, enough);
        for &region in &self.zones {
            if let Outline::ZoneDisc { centre, radius } = self.outlines[region.0 as usize] {
                let reach = |p: Xy| (p.x - centre.x).hypot(p.y - centre.y);
                let distance = (radius - reach(a).max(reach(b))).max(0.0);
                if distance < nearest.map_or(at_most, |(best, _)| best) {
                    nearest = Some((distance, region));
                }
            }
        }
        nearest
    }

    /// The region whose forbidden side a point is on. Discs are left to the distances.
    fn forbidden_side(&self, point: Xy) -> Option<RegionId> {
        let here = AABB::from_point([point.x, point.y]);
        for entry in self.solids.locate_in_envelope_intersecting(&here) {
            let (region, ring) = entry.data;
            if let Outline::Solid(rings) = &self.outlines[region.0 as usize]
                && self.ring_contains(region, ring, &rings[ring], point)
            {
                return Some(region);
            }
        }
        if let Some((union, first)) = &self.union {
            let inside = union.iter().any(|polygon| {
                let within = |ring: &geo::LineString| contains(&ring.0[..ring.0.len() - 1], point);
                within(polygon.exterior()) && !polygon.interiors().iter().any(within)
            });
            if !inside {
                return Some(*first);
            }
        }
        self.zones.iter().copied().find(|region| match &self.outlines[region.0 as usize] {
            Outline::Zone(ring) => !self.ring_contains(*region, 0, ring, point),
            _ => false,
        })
    }

    fn ring_contains(&self, region: RegionId, number: usize, ring: &[Xy], point: Xy) -> bool {
        match self.slabs.get(&(region, number)) {
            Some(slabs) => slabs.contain(point),
            None => contains(ring, point),
        }
    }
}

fn slabs(outlines: &[Outline]) -> HashMap<(RegionId, usize), Slabs> {
    let mut found = HashMap::new();
    for (id, outline) in regions(outlines) {
        let rings = match outline {
            Outline::Solid(rings) => rings.as_slice(),
            Outline::Zone(ring) => std::slice::from_ref(ring),
            Outline::SolidDisc { .. } | Outline::ZoneDisc { .. } => &[],
        };
        for (number, ring) in rings.iter().enumerate() {
            found.extend(Slabs::of(ring).map(|slabs| ((id, number), slabs)));
        }
    }
    found
}

fn regions(outlines: &[Outline]) -> impl Iterator<Item = (RegionId, &Outline)> {
    outlines.iter().enumerate().map(|(i, outline)| (RegionId(i as u32), outline))
}

fn solid_boxes(outlines: &[Outline]) -> Vec<SolidBox> {
    let mut boxes = Vec::new();
    for (id, outline) in regions(outlines) {
        if let Outline::SolidDisc { centre, radius } = outline {
            let reach = Xy { x: *radius, y: *radius };
            let (low, high) = (*centre - reach, *centre + reach);
            boxes.push(GeomWithData::new(
                Rectangle::from_corners([low.x, low.y], [high.x, high.y]),
                (id, 0),
            ));
        }
        if let Outline::Solid(rings) = outline {
            for (k, ring) in rings.iter().enumerate() {
                let mut envelope = AABB::from_point([ring[0].x, ring[0].y]);
                for point in ring {
                    use rstar::Envelope;
                    envelope.merge(&AABB::from_point([point.x, point.y]));
                }
                boxes.push(GeomWithData::new(
                    Rectangle::from_corners(envelope.lower(), envelope.upper()),
                    (id, k),
                ));
            }
        }
    }
    boxes
}

fn zone_polygons(outlines: &[Outline], zones: &[RegionId]) -> Vec<Polygon> {
    zones
        .iter()
        .filter_map(|id| match &outlines[id.0 as usize] {
            Outline::Zone(ring) => Some(Polygon::new(ring.iter().copied().collect(), vec![])),
            Outline::ZoneDisc { centre, radius } => {
                // Inscribed: nothing outside the circle is allowed.
                let sides = super::buffered::sides(*radius);
                let rim = (0..sides).map(|i| {
                    let angle = std::f64::consts::TAU * f64::from(i) / f64::from(sides);
                    *centre + Xy { x: angle.cos(), y: angle.sin() } * *radius
                });
                Some(Polygon::new(rim.collect(), vec![]))
            }
            _ => None,
        })
        .collect()
}

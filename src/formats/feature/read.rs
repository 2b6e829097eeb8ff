//! From features to a scenario.

use super::order::{NumberedItem, RoutePoint, ordered_items, ordered_points};
use super::properties::{Role, altitude, circle, fence_role, number, numbered_item, role};
use super::{Feature, Shape, Want};
use crate::fence::items::distinct_ring;
use crate::fence::{FenceRegion, FenceRole, FenceShape};
use crate::formats::error::{Located, Place, Problem};
use crate::formats::item::{FileItem, float, natural};
use crate::formats::kept::Properties;
use crate::formats::{MAX_ITEMS, MAX_REGIONS, MAX_VERTICES, Scenario};
use crate::geodesy::LatLon;
use crate::mission::{Command, Frame, Home, MissionItem};

/// Collects the parts of a scenario.
#[derive(Default)]
struct Reader<'a> {
    name: &'a str,
    scenario: Scenario,
    items: Vec<NumberedItem>,
    points: Vec<RoutePoint>,
    lines: Vec<(Place, Vec<LatLon>, f32, Properties)>,
    vertices: usize,
    /// Points and lines that say nothing of what they are, where that is no route.
    unused: usize,
    /// Features without a shape.
    shapeless: Vec<Place>,
    /// Obstacles with a hole that is filled, once for each hole.
    filled: Vec<Place>,
}

/// Makes a scenario of the features of the file `name`. `pins_are_route`: whether points that say
/// nothing of themselves are the route (GeoJSON) or just pins on a map (KML).
pub(in crate::formats) fn scenario(
    name: &str,
    features: Vec<Feature>,
    want: Want,
    pins_are_route: bool,
) -> Result<Scenario, Located> {
    let mut reader = Reader { name, ..Reader::default() };
    for feature in features {
        let here = feature.place.clone();
        reader.add(feature, want, pins_are_route).map_err(|problem| problem.at(here))?;
    }
    if want == Want::Everything {
        reader.scenario.mission.items = reader.mission_items()?;
    }
    if reader.unused > 0 {
        reader.scenario.warnings.push(format!(
            "{} points or lines are neither route nor obstacle and are left out; draw obstacles \
             as polygons, or points with a radius",
            reader.unused
        ));
    }
    let warnings = &mut reader.scenario.warnings;
    if !reader.shapeless.is_empty() {
        warnings.push(format!("{}: without a geometry, left out", listed(&reader.shapeless)));
    }
    if !reader.filled.is_empty() {
        warnings.push(format!(
            "{}: a hole in an obstacle is filled, quavd does not plan inside it",
            listed(&reader.filled)
        ));
    }
    Ok(reader.scenario)
}

/// The first few places of a long list.
fn listed(places: &[Place]) -> String {
    const SHOWN: usize = 5;
    let names: Vec<_> = places.iter().take(SHOWN).map(ToString::to_string).collect();
    let more = places.len().saturating_sub(SHOWN);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    names.join(", ") + &more
}

impl Reader<'_> {
    fn add(&mut self, feature: Feature, want: Want, pins_are_route: bool) -> Result<(), Problem> {
        let role = role(&feature)?;
        if role == Role::Item {
            if want == Want::Everything {
                let item = numbered_item(&feature)?;
                if self.items.len() >= MAX_ITEMS {
                    return Err(Problem::TooMany { what: "mission items", limit: MAX_ITEMS });
                }
                self.items.push(item);
            }
            return Ok(());
        }
        if feature.shapes.is_empty() {
            self.shapeless.push(feature.place.clone());
        }
        if let Some(circle) = circle(&feature, role)? {
            return self.add_region(&feature, role, circle);
        }
        for shape in &feature.shapes {
            match shape {
                Shape::Polygon { outer, holes } => {
                    self.add_polygon(&feature, role, outer, holes)?;
                }
                Shape::Line(_) | Shape::Point(_) if matches!(role, Role::Area(_)) => {
                    return Err(Problem::Value {
                        what: "the shape of this fence or obstacle".to_owned(),
                        found: "a point or line without an area".to_owned(),
                        expected: "a polygon, or a point with a radius in metres",
                    });
                }
                Shape::Line(_) if role == Role::Track => {
                    self.scenario.kept.route.clone_from(&feature.properties);
                }
                Shape::Line(_) if want == Want::Fences => self.unused += 1,
                Shape::Line(line) => {
                    let here = feature.place.clone();
                    let properties = feature.properties.clone();
                    self.lines.push((here, line.clone(), altitude(&feature)?, properties));
                }
                Shape::Point(point) => {
                    self.add_point(&feature, role, *point, want, pins_are_route)?
                }
            }
        }
        Ok(())
    }

    fn add_point(
        &mut self,
        feature: &Feature,
        role: Role,
        position: LatLon,
        want: Want,
        pins_are_route: bool,
    ) -> Result<(), Problem> {
        match role {
            Role::Home => {
                let altitude_amsl = number(feature, "altitude_amsl")?.unwrap_or(0.0);
                let altitude_amsl = float(altitude_amsl, || "altitude_amsl".to_owned())?;
                let home = Home { position, altitude_amsl };
                if self.scenario.mission.home.replace(home).is_some() {
                    return Err(twice("home"));
                }
                self.scenario.kept.home.clone_from(&feature.properties);
            }
            Role::Return => {
                let altitude = number(feature, "altitude")?.unwrap_or(0.0);
                let altitude = float(altitude, || "altitude".to_owned())?;
                if self.scenario.fences.return_point.replace((position, altitude)).is_some() {
                    return Err(twice("return point"));
                }
                self.scenario.kept.return_point.clone_from(&feature.properties);
            }
            Role::Rally => {
                let seq = self.scenario.rally.len();
                if seq >= MAX_ITEMS {
                    return Err(Problem::TooMany { what: "rally points", limit: MAX_ITEMS });
                }
                let frame = number(feature, "frame")?;
                let frame = frame.map(|frame| natural(frame, 255, "frame")).transpose()?;
                let frame = frame.unwrap_or(u16::from(Frame::GLOBAL_RELATIVE_ALT.0));
                let altitude = f64::from(altitude(feature)?);
                let params = [0.0, 0.0, 0.0, 0.0, position.lat(), position.lon(), altitude];
                let item = FileItem {
                    command: Command::NAV_RALLY_POINT.0,
                    frame: frame as u8, // at most 255
                    params,
                    autocontinue: true,
                };
                let item = item.to_item(seq as u16)?; // below MAX_ITEMS
                self.scenario.rally.push(item);
                self.scenario.kept.rally.push((item, feature.properties.clone()));
            }
            Role::None if want == Want::Fences || !pins_are_route => self.unused += 1,
            _ if want == Want::Fences => {}
            _ => {
                if self.points.len() >= MAX_ITEMS {
                    return Err(Problem::TooMany { what: "route points", limit: MAX_ITEMS });
                }
                let seq = number(feature, "seq")?;
                let seq = seq.map(|seq| natural(seq, u16::MAX, "seq")).transpose()?;
                let place = feature.place.clone();
                let altitude = altitude(feature)?;
                let properties = feature.properties.clone();
                self.points.push(RoutePoint { place, position, role, seq, altitude, properties });
            }
        }
        Ok(())
    }

    fn add_polygon(
        &mut self,
        feature: &Feature,
        role: Role,
        outer: &[LatLon],
        holes: &[Vec<LatLon>],
    ) -> Result<(), Problem> {
        let outer = FenceShape::Polygon(ring(outer, "the outline")?);
        self.add_region(feature, role, outer)?;
        for hole in holes {
            if fence_role(role) == FenceRole::Exclusion {
                self.filled.push(feature.place.clone());
                continue;
            }
            let hole = ring(hole, "the hole")?;
            let shape = FenceShape::Polygon(hole);
            self.add_region(feature, Role::Area(FenceRole::Exclusion), shape)?;
        }
        Ok(())
    }

    fn add_region(
        &mut self,
        feature: &Feature,
        role: Role,
        shape: FenceShape,
    ) -> Result<(), Problem> {
        if self.scenario.fences.regions.len() >= MAX_REGIONS {
            return Err(Problem::TooMany { what: "fence regions", limit: MAX_REGIONS });
        }
        if let FenceShape::Polygon(ring) = &shape {
            self.vertices += ring.len();
        }
        if self.vertices > MAX_VERTICES {
            return Err(Problem::TooMany { what: "fence vertices", limit: MAX_VERTICES });
        }
        let origin = format!("{} {}", self.name, feature.place);
        self.scenario.kept.regions.insert(origin.clone(), feature.properties.clone());
        self.scenario.fences.regions.push(FenceRegion { role: fence_role(role), shape, origin });
        Ok(())
    }

    /// The mission in the order of its numbers. A route sets home where nothing else did.
    fn mission_items(&mut self) -> Result<Vec<MissionItem>, Located> {
        if !self.items.is_empty() {
            if let Some(place) =
                self.points.first().map(|p| &p.place).or(self.lines.first().map(|l| &l.0))
            {
                let what = "a route point or line among mission items".to_owned();
                let advice = "give it command, frame and params, or remove it";
                return Err(Problem::Conflict { what, advice }.at(place.clone()));
            }
            let items = ordered_items(std::mem::take(&mut self.items))?;
            self.scenario.kept.items.clone_from(&items);
            return Ok(items.into_iter().map(|(item, _)| item).collect());
        }
        let route = self.route()?;
        if let [RoutePoint { place, .. }] = &route[..] {
            self.scenario.warnings.push(format!("{place}: a single point is no route; left out"));
            return Ok(Vec::new());
        }
        if let (None, Some(start)) = (self.scenario.mission.home, route.first()) {
            let position = start.position;
            self.scenario.mission.home = Some(Home { position, altitude_amsl: 0.0 });
        }
        let item = |(index, point): (usize, &RoutePoint)| {
            let RoutePoint { place, position, altitude, .. } = point;
            let command = if index == 0 { Command::NAV_TAKEOFF } else { Command::NAV_WAYPOINT };
            let item = FileItem {
                command: command.0,
                frame: Frame::GLOBAL_RELATIVE_ALT.0,
                params: [
                    0.0,
                    0.0,
                    0.0,
                    f64::NAN, // yaw: as the autopilot does by default
                    position.lat(),
                    position.lon(),
                    f64::from(*altitude),
                ],
                autocontinue: true,
            };
            item.to_item(index as u16).map_err(|problem| problem.at(place.clone()))
        };
        let items: Vec<_> = route.iter().enumerate().map(item).collect::<Result<_, Located>>()?;
        let properties = route.into_iter().map(|point| point.properties);
        self.scenario.kept.items = items.iter().copied().zip(properties).collect();
        Ok(items)
    }

    /// The route's points in order: from one line, or from points.
    fn route(&mut self) -> Result<Vec<RoutePoint>, Located> {
        let mut lines = std::mem::take(&mut self.lines).into_iter();
        let points = std::mem::take(&mut self.points);
        let Some((place, line, altitude, properties)) = lines.next() else {
            return ordered_points(points);
        };
        let second = lines.next().map(|line| line.0);
        if let Some(second) = second.or(points.first().map(|point| point.place.clone())) {
            let what = format!("a second route; the first is the line of {place}");
            let advice = "keep one of them, or give this one the role \"track\"";
            return Err(Problem::Conflict { what, advice }.at(second));
        }
        if line.len() > MAX_ITEMS {
            return Err(Problem::TooMany { what: "route points", limit: MAX_ITEMS }.at(place));
        }
        self.scenario.kept.route = properties;
        let point = |position| RoutePoint {
            place: place.clone(),
            position,
            role: Role::None,
            seq: None,
            altitude,
            properties: Properties::new(),
        };
        Ok(line.into_iter().map(point).collect())
    }
}

fn ring(vertices: &[LatLon], what: &str) -> Result<Vec<LatLon>, Problem> {
    if vertices.len() < 3 {
        return Err(Problem::Value {
            what: format!("the number of vertices of {what}"),
            found: vertices.len().to_string(),
            expected: "at least 3; draw it again or delete it",
        });
    }
    Ok(distinct_ring(vertices.to_vec()))
}

fn twice(what: &str) -> Problem {
    Problem::Conflict { what: format!("a second {what}"), advice: "keep one of them" }
}

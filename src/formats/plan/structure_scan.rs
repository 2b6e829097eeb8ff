//! Structure scans: the complex item of a `.plan` that circles a building, layer above layer, with
//! the camera turned to its walls. The file holds the building and the camera's footprint; what is
//! flown is computed here as QGroundControl computes it when it opens the file: the outline moved
//! outwards by the scan distance, flown once in each layer. (QGroundControl,
//! StructureScanComplexItem.cc, `appendMissionItems`; QGCMapPolygon.cc, `offset`; version 3 of the
//! item, which releases since 4.0 write.)

use std::f64::consts::TAU;

use serde::Deserialize;

use super::complex::{DO_SET_CAM_TRIGG_DIST, FRAME_MISSION, FRAME_RELATIVE, NAN, WAYPOINT, item};
use super::read::Number;
use crate::formats::MAX_ITEMS;
use crate::formats::error::Problem;
use crate::formats::item::{FileItem, place};
use crate::geodesy::wrapped;

const DO_SET_ROI_WPNEXT_OFFSET: u16 = 196;
const DO_SET_ROI_NONE: u16 = 197;
/// The version of the item that says all of what is flown.
const VERSION: f64 = 3.0;
/// QGroundControl's sphere, metres.
const EARTH_RADIUS: f64 = 6_371_000.0;
/// A longer scan distance or a larger structure than any that is scanned, metres.
const LARGEST: f64 = 10_000.0;

/// The keys of `StructureScan`.
#[derive(Deserialize, Default)]
#[serde(rename_all = "PascalCase", default)]
pub(super) struct StructureScan {
    #[serde(rename = "version")]
    version: Option<f64>,
    /// The structure's outline, `[lat, lon]` each; a survey's area has the same key.
    #[serde(rename = "polygon")]
    polygon: Option<Vec<Vec<Number>>>,
    camera_calc: Option<CameraCalc>,
    entrance_altitude: Option<f64>,
    scan_bottom_alt: Option<f64>,
    structure_height: Option<f64>,
    layers: Option<f64>,
    gimbal_pitch: Option<f64>,
    start_from_top: Option<bool>,
}

/// What the camera sees at the scan distance, metres.
#[derive(Deserialize, Default)]
#[serde(rename_all = "PascalCase", default)]
struct CameraCalc {
    adjusted_footprint_frontal: Option<f64>,
    adjusted_footprint_side: Option<f64>,
    distance_to_surface: Option<f64>,
}

pub(super) fn is_structure_scan(kind: &str) -> bool {
    kind == "StructureScan"
}

impl StructureScan {
    /// The items that QGroundControl uploads for this scan.
    pub(super) fn items(&self) -> Result<Vec<FileItem>, Problem> {
        if self.version != Some(VERSION) {
            return Err(Problem::NotSupported {
                what: "this StructureScan item is not of version 3, and does not say all of what \
                       is flown"
                    .to_owned(),
                advice: "open the plan in a current QGroundControl and save it again",
            });
        }
        let camera = self.camera_calc.as_ref().ok_or_else(|| missing("CameraCalc"))?;
        let layer = number("AdjustedFootprintFrontal", camera.adjusted_footprint_frontal)?;
        let trigger = number("AdjustedFootprintSide", camera.adjusted_footprint_side)?;
        let distance = number("DistanceToSurface", camera.distance_to_surface)?;
        let entrance = number("EntranceAltitude", self.entrance_altitude)?;
        let bottom = number("ScanBottomAlt", self.scan_bottom_alt)?;
        let top = number("StructureHeight", self.structure_height)?;
        let pitch = number("GimbalPitch", self.gimbal_pitch)?;
        let from_top = self.start_from_top.ok_or_else(|| missing("StartFromTop"))?;
        let layers = self.layers(layer, top - bottom)?;
        let outline = self.outline()?;
        if layers.saturating_mul(outline.len() + 3) > MAX_ITEMS {
            return Err(Problem::TooMany { what: "mission items", limit: MAX_ITEMS });
        }
        let route = moved_outwards(&outline, distance)?;
        let Some(&entry) = route.first() else { return Err(missing("polygon")) };

        let waypoint = |[lat, lon]: [f64; 2], altitude: f64| {
            item(WAYPOINT, FRAME_RELATIVE, [0.0, 0.0, 0.0, NAN], [lat, lon, altitude])
        };
        let camera = |every: f64, at_once: f64| {
            item(DO_SET_CAM_TRIGG_DIST, FRAME_MISSION, [every, 0.0, at_once, 0.0], [0.0; 3])
        };
        let mut items = vec![
            waypoint(entry, entrance),
            // To the right of the way round: to the structure.
            item(DO_SET_ROI_WPNEXT_OFFSET, FRAME_MISSION, [0.0; 4], [pitch, 0.0, 90.0]),
        ];
        for number in 0..layers {
            let above = layer * (number as f64 + 0.5);
            let altitude = if from_top { top - above } else { bottom + above };
            for (corner, &vertex) in route.iter().chain([&entry]).enumerate() {
                items.push(waypoint(vertex, altitude));
                if corner == 0 {
                    items.push(camera(trigger, 1.0));
                }
            }
            items.push(camera(0.0, 0.0));
        }
        items.push(item(DO_SET_ROI_NONE, FRAME_MISSION, [0.0; 4], [0.0; 3]));
        items.push(waypoint(entry, entrance));
        Ok(items)
    }

    /// How many layers there are. QGroundControl counts them anew from the heights, so that a file
    /// that says otherwise is not flown as it says.
    fn layers(&self, layer: f64, surface: f64) -> Result<usize, Problem> {
        let told = number("Layers", self.layers)?;
        let counted = (surface.max(0.0) / layer).ceil().max(1.0);
        if told == counted && counted <= MAX_ITEMS as f64 {
            return Ok(counted as usize);
        }
        Err(Problem::NotSupported {
            what: format!(
                "Layers in this StructureScan item is {told}, its heights and its camera give {counted}"
            ),
            advice: "open the plan in QGroundControl, look at the scan, and save it again",
        })
    }

    /// The structure's corners, `[lat, lon]` each.
    fn outline(&self) -> Result<Vec<[f64; 2]>, Problem> {
        let polygon = self.polygon.as_deref().unwrap_or_default();
        let corners: Vec<[f64; 2]> = polygon
            .iter()
            .map(|corner| {
                let &[Some(lat), Some(lon), ..] = corner.as_slice() else {
                    return Err(missing("polygon"));
                };
                place("polygon", lat, lon).map(|_| [lat, lon])
            })
            .collect::<Result<_, _>>()?;
        if corners.len() < 3 {
            return Err(missing("polygon with three corners or more"));
        }
        Ok(corners)
    }
}

fn missing(key: &str) -> Problem {
    Problem::Missing {
        what: format!("{key} in this StructureScan item"),
        advice: "open the plan in a current QGroundControl and save it again",
    }
}

fn number(key: &str, value: Option<f64>) -> Result<f64, Problem> {
    let value = value.ok_or_else(|| missing(key))?;
    if value.is_finite() && value.abs() <= LARGEST {
        return Ok(value);
    }
    Err(Problem::Value {
        what: format!("{key} in this StructureScan item"),
        found: value.to_string(),
        expected: "at most 10 km",
    })
}

/// The corners of an outline whose edges have been moved outwards by a distance, metres, each to
/// where its two edges meet.
fn moved_outwards(outline: &[[f64; 2]], distance: f64) -> Result<Vec<[f64; 2]>, Problem> {
    let refused = |what: &str| Problem::NotSupported {
        what: format!("the outline of this StructureScan item {what}"),
        advice: "open the plan in QGroundControl, draw the structure again, and save it",
    };
    let metres_per_degree = EARTH_RADIUS * TAU / 360.0;
    let &[lat, lon] = outline.first().ok_or_else(|| missing("polygon"))?;
    let scale = [metres_per_degree, metres_per_degree * lat.to_radians().cos()];
    // North and east of the first corner.
    let corners: Vec<[f64; 2]> = outline
        .iter()
        .map(|corner| {
            let east = wrapped(corner[1] - lon);
            [(corner[0] - lat) * scale[0], east * scale[1]]
        })
        .collect();
    if corners.iter().flatten().any(|metres| metres.abs() > LARGEST) {
        return Err(refused("is larger than 10 km"));
    }
    let next = |k: usize| corners[(k + 1) % corners.len()];
    let cross = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
    let area: f64 = corners.iter().enumerate().map(|(k, &corner)| cross(corner, next(k))).sum();
    if area <= 0.0 {
        // QGroundControl, which draws them clockwise, would fly inside the structure.
        return Err(refused("does not run clockwise"));
    }
    // Each edge: its direction, and a point of it moved to the left of it.
    let edges: Vec<([f64; 2], [f64; 2])> = corners
        .iter()
        .enumerate()
        .map(|(k, &[north, east])| {
            let [to_north, to_east] = next(k);
            let (dn, de) = (to_north - north, to_east - east);
            let length = dn.hypot(de);
            let along = [dn / length, de / length];
            (along, [north + along[1] * distance, east - along[0] * distance])
        })
        .collect();
    (0..edges.len())
        .map(|k| {
            let (before, at) = edges[(k + edges.len() - 1) % edges.len()];
            let (after, to) = edges[k];
            let along = cross([to[0] - at[0], to[1] - at[1]], after) / cross(before, after);
            let corner = [at[0] + before[0] * along, at[1] + before[1] * along];
            // Also where an edge has no length or two lie in one line.
            if !corner.iter().all(|metres| metres.abs() <= 2.0 * LARGEST) {
                return Err(refused("has a corner twice, or one that is none"));
            }
            Ok([lat + corner[0] / scale[0], lon + corner[1] / scale[1]])
        })
        .collect()
}

#[cfg(test)]
pub(super) mod tests {
    use serde_json::{Value, json};

    use super::*;
    use crate::geodesy::{LatLon, geodesic_distance};

    /// A tower scanned in two layers, 18 items: 30 m to the north and 20 m to the east of a corner at 47 N 8 E, clockwise.
    pub(in super::super) fn tower() -> Value {
        let (north, east) = (47.0 + 30.0 / 111_194.93, 8.0 + 20.0 / 75_835.07);
        json!({
            "type": "ComplexItem", "complexItemType": "StructureScan", "version": 3,
            "CameraCalc": {
                "AdjustedFootprintFrontal": 25, "AdjustedFootprintSide": 10,
                "CameraName": "Manual (no camera specs)", "DistanceMode": 1,
                "DistanceToSurface": 15, "version": 2
            },
            "EntranceAltitude": 80, "GimbalPitch": -10, "Layers": 2, "ScanBottomAlt": 4,
            "StartFromTop": false, "StructureHeight": 54,
            "polygon": [[47.0, 8.0], [north, 8.0], [north, east], [47.0, east]]
        })
    }

    fn items(scan: &Value) -> Result<Vec<FileItem>, Problem> {
        serde_json::from_value::<StructureScan>(scan.clone()).unwrap().items()
    }

    #[test]
    fn a_tower_is_circled_in_each_layer_at_the_scan_distance() {
        let items = items(&tower()).unwrap();
        let commands: Vec<_> = items.iter().map(|item| item.command).collect();
        let layer = [16, 206, 16, 16, 16, 16, 206];
        assert_eq!(commands, [&[16, 196][..], &layer, &layer, &[197, 16]].concat());
        assert_eq!(items[1].params, [0.0, 0.0, 0.0, 0.0, -10.0, 0.0, 90.0]);
        assert_eq!(items[3].params[..3], [10.0, 0.0, 1.0]);
        assert_eq!(items[8].params[..3], [0.0; 3]);
        let altitudes: Vec<f64> =
            items.iter().filter(|item| item.command == 16).map(|item| item.params[6]).collect();
        let expected = [&[80.0][..], &[16.5; 5], &[41.5; 5], &[80.0]].concat();
        assert_eq!(altitudes, expected);
        // 15 m outside of both walls at each corner, on the ellipsoid to a thousandth or three.
        let corner = |item: &FileItem| LatLon::new(item.params[4], item.params[5]).unwrap();
        let walls = &tower()["polygon"];
        for (k, number) in [2, 4, 5, 6].into_iter().enumerate() {
            let wall = |axis: usize| walls[k][axis].as_f64().unwrap();
            let wall = LatLon::new(wall(0), wall(1)).unwrap();
            let away = geodesic_distance(wall, corner(&items[number])).0;
            assert!((away - 15.0 * 2.0_f64.sqrt()).abs() < 0.08, "{away}");
        }
        let side = geodesic_distance(corner(&items[2]), corner(&items[4])).0;
        assert!((side - 60.0).abs() < 0.2, "{side}");
        let south_of = items[2].params[4] < 47.0 && items[2].params[5] < 8.0;
        assert!(south_of, "outside: {:?}", items[2]);
    }

    #[test]
    fn from_the_top_the_first_layer_is_the_highest() {
        let mut scan = tower();
        scan["StartFromTop"] = json!(true);
        let items = items(&scan).unwrap();
        assert_eq!((items[2].params[6], items[9].params[6]), (41.5, 16.5));
    }

    #[test]
    fn a_scan_that_would_not_be_flown_as_it_says_is_refused() {
        let refused = |key: &str, value: Value| {
            let mut scan = tower();
            scan[key] = value;
            items(&scan).unwrap_err().to_string()
        };
        assert!(refused("version", json!(2)).contains("version 3"));
        assert!(refused("Layers", json!(3)).contains("Layers"));
        assert!(refused("Layers", json!(1e300)).contains("Layers"));
        assert!(refused("StructureHeight", json!(1e9)).contains("StructureHeight"));
        assert!(refused("GimbalPitch", Value::Null).contains("GimbalPitch"));
        assert!(refused("CameraCalc", json!({})).contains("AdjustedFootprintFrontal"));
        let mut backwards = tower()["polygon"].clone();
        backwards.as_array_mut().unwrap().reverse();
        assert!(refused("polygon", backwards).contains("clockwise"));
        assert!(refused("polygon", json!([[47.0, 8.0], [47.1]])).contains("polygon"));
        assert!(
            refused("polygon", json!([[47.0, 8.0], [47.0, 8.0], [47.0, 8.0]])).contains("outline")
        );
        let mut repeated = tower()["polygon"].clone();
        repeated.as_array_mut().unwrap().insert(1, json!([47.0, 8.0]));
        assert!(refused("polygon", repeated).contains("twice"));
    }
}

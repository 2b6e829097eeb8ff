use crate::fence::{FenceRole, FenceShape};
use crate::formats::{Scenario, read_fences, read_scenario};
use crate::mission::Command;

const SQUARE: &str = "[[8,47],[8.01,47],[8.01,47.01],[8,47.01],[8,47]]";
const HOLE: &str = "[[8.004,47.004],[8.006,47.004],[8.005,47.006],[8.004,47.004]]";

fn collection(features: &[&str]) -> String {
    format!(r#"{{"type":"FeatureCollection","features":[{}]}}"#, features.join(","))
}

fn feature(properties: &str, geometry: &str, coordinates: &str) -> String {
    format!(
        r#"{{"type":"Feature","properties":{properties},
            "geometry":{{"type":"{geometry}","coordinates":{coordinates}}}}}"#
    )
}

fn read(features: &[&str]) -> Scenario {
    read_scenario("map", collection(features).as_bytes()).unwrap()
}

fn error_of(features: &[&str]) -> String {
    read_scenario("map", collection(features).as_bytes()).unwrap_err().to_string()
}

fn polygon(properties: &str) -> String {
    feature(properties, "Polygon", &format!("[{SQUARE},{HOLE}]"))
}

fn point(properties: &str, lon: f64) -> String {
    feature(properties, "Point", &format!("[{lon},47]"))
}

/// Longitudes of the route, in 1e-7 degrees.
fn route(scenario: &Scenario) -> Vec<i32> {
    scenario.mission.items.iter().map(|item| item.y).collect()
}

#[test]
fn the_hole_of_an_obstacle_is_filled_with_a_warning() {
    let scenario = read(&[&polygon(r#"{"name":"Block 7"}"#)]);
    assert_eq!(scenario.fences.regions.len(), 1);
    assert_eq!(scenario.fences.regions[0].origin, "map feature 1 (Block 7)");
    assert!(scenario.warnings[0].starts_with("map, feature 1 (Block 7): a hole"));
}

#[test]
fn the_hole_of_an_inclusion_is_an_obstacle() {
    for properties in
        [r#"{"fence":"inclusion"}"#, r#"{"role":"Inclusion"}"#, r#"{"inclusion":true}"#]
    {
        let roles: Vec<_> =
            read(&[&polygon(properties)]).fences.regions.iter().map(|r| r.role).collect();
        assert_eq!(roles, [FenceRole::Inclusion, FenceRole::Exclusion], "{properties}");
    }
}

#[test]
fn properties_that_contradict_each_other_or_are_unknown_to_fence_are_errors() {
    let error = error_of(&[&polygon(r#"{"fence":"inclusion","role":"obstacle"}"#)]);
    assert!(error.starts_with("map, feature 1: role, fence and inclusion contradict"), "{error}");
    let error = error_of(&[&polygon(r#"{"fence":"keep in"}"#)]);
    assert!(error.contains(r#"the property fence is "keep in""#), "{error}");
    // Anything else that an area says of itself leaves it an obstacle.
    let scenario = read(&[&polygon(r#"{"role":"building","fence":null}"#)]);
    assert_eq!(scenario.fences.regions[0].role, FenceRole::Exclusion);
}

#[test]
fn a_point_with_a_radius_is_a_circle_and_an_obstacle_without_area_is_an_error() {
    let scenario = read(&[&point(r#"{"radius":12.5}"#, 8.0)]);
    let FenceShape::Circle { radius, .. } = scenario.fences.regions[0].shape else { panic!() };
    assert_eq!(radius.0, 12.5);
    for radius in ["0", "-3", "1e9"] {
        let error = error_of(&[&point(&format!(r#"{{"radius":{radius}}}"#), 8.0)]);
        assert!(error.starts_with("map, feature 1: the radius is"), "{error}");
    }
    assert!(error_of(&[&point(r#"{"radius":"12 m"}"#, 8.0)]).contains("must be a number"));
    for (geometry, coordinates) in [("Point", "[8,47]"), ("LineString", "[[8,47],[8,48]]")] {
        let error = error_of(&[&feature(r#"{"role":"obstacle"}"#, geometry, coordinates)]);
        assert!(error.contains("without an area"), "{error}");
    }
}

#[test]
fn points_are_a_route_in_the_order_of_seq_or_of_the_file() {
    let by_seq = [r#"{"seq":7}"#, r#"{"seq":1}"#, r#"{"seq":3}"#];
    let points: Vec<_> = by_seq.iter().zip([8.3, 8.1, 8.2]).map(|(p, lon)| point(p, lon)).collect();
    let scenario = read(&[&points[0], &points[1], &points[2]]);
    assert_eq!(route(&scenario), [81_000_000, 82_000_000, 83_000_000]);
    let commands: Vec<_> = scenario.mission.items.iter().map(|item| item.command).collect();
    assert_eq!(commands, [Command::NAV_TAKEOFF, Command::NAV_WAYPOINT, Command::NAV_WAYPOINT]);
    assert_eq!(scenario.mission.home.unwrap().position.lon(), 8.1);

    let goal_first = read(&[
        &point(r#"{"role":"goal"}"#, 8.3),
        &point("{}", 8.2),
        &point(r#"{"role":"start"}"#, 8.1),
    ]);
    assert_eq!(route(&goal_first), [81_000_000, 82_000_000, 83_000_000]);
}

#[test]
fn an_order_that_is_not_clear_is_an_error() {
    let some = error_of(&[&point(r#"{"seq":0}"#, 8.1), &point("{}", 8.2)]);
    assert!(some.starts_with("map, feature 2: there is no seq"), "{some}");
    let twice = error_of(&[&point(r#"{"seq":1}"#, 8.1), &point(r#"{"seq":1}"#, 8.2)]);
    assert!(twice.starts_with("map, feature 2: its seq stands twice"), "{twice}");
    let late = error_of(&[&point(r#"{"seq":0}"#, 8.1), &point(r#"{"seq":1,"role":"start"}"#, 8.2)]);
    assert!(late.starts_with("map, feature 2: a start that is not the first"), "{late}");
    let starts =
        error_of(&[&point(r#"{"role":"start"}"#, 8.1), &point(r#"{"role":"start"}"#, 8.2)]);
    assert!(starts.starts_with("map, feature 2: a start"), "{starts}");
}

#[test]
fn a_second_route_is_an_error_and_a_track_is_a_picture() {
    let line = |properties| feature(properties, "LineString", "[[8,47],[8.1,47],[8.2,47]]");
    assert_eq!(route(&read(&[&line("{}")])).len(), 3);
    let error = error_of(&[&line("{}"), &line("{}")]);
    assert!(error.starts_with("map, feature 2: a second route"), "{error}");
    let error = error_of(&[&line("{}"), &point("{}", 8.1)]);
    assert!(error.starts_with("map, feature 2: a second route"), "{error}");
    let track = line(r#"{"role":"track"}"#);
    let scenario = read(&[&track, &point("{}", 8.1), &point("{}", 8.2)]);
    assert_eq!(route(&scenario).len(), 2);
}

#[test]
fn lines_and_points_among_fences_are_left_out_with_a_warning() {
    let line = feature("{}", "LineString", "[[8,47],[8.1,47]]");
    let text = collection(&[&polygon("{}"), &line, &line, &point("{}", 8.0)]);
    let read = read_fences("map", text.as_bytes()).unwrap();
    assert_eq!(read.fences.regions.len(), 1);
    assert!(read.warnings.iter().any(|w| w.starts_with("map, 3 points or lines")));
}

#[test]
fn what_is_no_position_is_an_error_that_names_feature_and_vertex() {
    let text = feature("{}", "Polygon", "[[[8,47],[8.1,97],[8.1,47.1],[8,47]]]");
    assert!(error_of(&[&text]).starts_with("map, feature 1: vertex 2: latitude 97"));
    let text = feature("{}", "Polygon", "[[[8,47],[8.1],[8.1,47.1],[8,47]]]");
    assert!(error_of(&[&text]).starts_with("map, feature 1: vertex 2"));
    let text = feature("{}", "Polygon", "[[[8,47],[8.1,47]]]");
    assert!(error_of(&[&text]).contains("the number of vertices of the outline is 2"));
    let text = feature("{}", "Polygon", "[]");
    assert!(error_of(&[&text]).contains("there is no outline"));
    // UTM metres given for degrees.
    let text = feature("{}", "Point", "[731878.4,2559613.0]");
    assert!(error_of(&[&text]).contains("outside ±90 and ±180"));
}

#[test]
fn another_coordinate_reference_system_is_refused() {
    let text = format!(
        r#"{{"type":"FeatureCollection","crs":{{"type":"name","properties":
        {{"name":"urn:ogc:def:crs:EPSG::25832"}}}},"features":[{}]}}"#,
        polygon("{}")
    );
    let error = read_scenario("map", text.as_bytes()).unwrap_err().to_string();
    assert!(error.contains("25832") && error.contains("convert the file"), "{error}");
    let text = text.replace("EPSG::25832", "OGC:1.3:CRS84");
    assert!(read_scenario("map", text.as_bytes()).is_ok());
}

#[test]
fn a_bare_geometry_and_a_collection_inside_a_feature_are_read() {
    let bare = format!(r#"{{"type":"MultiPolygon","coordinates":[[{SQUARE}],[{HOLE}]]}}"#);
    assert_eq!(read_scenario("map", bare.as_bytes()).unwrap().fences.regions.len(), 2);
    let inside = format!(r#"{{"type":"Polygon","coordinates":[{SQUARE}]}}"#);
    let nested = format!(
        r#"{{"type":"Feature","geometry":{{"type":"GeometryCollection","geometries":[{inside},
        {{"type":"GeometryCollection","geometries":[{inside}]}}]}}}}"#
    );
    assert_eq!(read_scenario("map", nested.as_bytes()).unwrap().fences.regions.len(), 2);
}

#[test]
fn a_feature_without_a_geometry_is_left_out_with_a_warning() {
    let scenario = read(&[r#"{"type":"Feature","properties":{},"geometry":null}"#]);
    assert!(scenario.warnings[0].starts_with("map, feature 1: without a geometry"));
}

#[test]
fn mission_items_need_their_numbers_in_order() {
    let item = |seq: usize| {
        point(
            &format!(
                r#"{{"seq":{seq},"command":16,"frame":3,"params":[0,0,0,null],"altitude":30}}"#
            ),
            8.0,
        )
    };
    assert_eq!(read(&[&item(1), &item(0)]).mission.items.len(), 2);
    assert!(error_of(&[&item(0), &item(2)]).starts_with("map, feature 2: seq is 2"));
    assert!(error_of(&[&item(0), &point("{}", 8.1)]).contains("among mission items"));
    let lame = point(r#"{"seq":0,"command":16,"frame":3,"params":[0]}"#, 8.0);
    assert!(error_of(&[&lame]).contains("there is no altitude"));
}

use crate::fence::{FenceRole, HeightRange, HeightReference};
use crate::formats::{Scenario, read_scenario};
use crate::units::Metres;

const RING: &str = "8,47,0 8.01,47,0\n 8.01,47.01,0 8,47,0";

fn polygon(inside: &str) -> String {
    format!(
        "<Polygon><outerBoundaryIs><LinearRing><coordinates>{inside}</coordinates></LinearRing>\
         </outerBoundaryIs></Polygon>"
    )
}

fn document(content: &str) -> String {
    format!(
        "<?xml version='1.0'?><kml xmlns='http://www.opengis.net/kml/2.2'>\
         <Document>\n{content}</Document></kml>"
    )
}

fn read(content: &str) -> Scenario {
    read_scenario("map.kml", document(content).as_bytes()).unwrap()
}

fn error_of(text: &str) -> String {
    read_scenario("map.kml", text.as_bytes()).unwrap_err().to_string()
}

#[test]
fn every_polygon_of_a_placemark_is_an_obstacle() {
    let two = format!(
        "<Folder><Placemark><name>A &amp; B</name><MultiGeometry>{0}{0}</MultiGeometry></Placemark>\
         </Folder>",
        polygon(RING)
    );
    let regions = read(&two).fences.regions;
    assert_eq!(regions.len(), 2);
    assert_eq!(regions[0].origin, "map.kml placemark 1 (A & B)");
    // Not valid KML, but an obstacle all the same.
    let bare = format!("<Placemark>{0}{0}</Placemark>{0}", polygon(RING));
    assert_eq!(read(&bare).fences.regions.len(), 3);
}

#[test]
fn a_ring_of_its_own_is_an_obstacle() {
    let ring = format!("<LinearRing><coordinates>{RING}</coordinates></LinearRing>");
    assert_eq!(read(&format!("<Placemark>{ring}</Placemark>")).fences.regions.len(), 1);
}

#[test]
fn extended_data_says_what_a_polygon_is() {
    let data = "<ExtendedData><Data name='fence'><value>inclusion</value></Data></ExtendedData>";
    let schema = "<ExtendedData><SchemaData><SimpleData name='fence'>inclusion</SimpleData></SchemaData>\
         </ExtendedData>";
    for data in [data, schema] {
        let text = format!("<Placemark>{data}{}</Placemark>", polygon(RING));
        assert_eq!(read(&text).fences.regions[0].role, FenceRole::Inclusion, "{data}");
    }
}

#[test]
fn coordinates_may_stand_in_cdata_and_comments_are_passed_over() {
    let text =
        format!("<!-- x --><Placemark>{}</Placemark>", polygon("<![CDATA[8,47 8.1,47 8,48]]>"));
    assert_eq!(read(&text).fences.regions.len(), 1);
}

#[test]
fn pins_are_left_out_with_a_warning_and_a_line_is_the_route() {
    let text = "<Placemark><Point><coordinates>8,47</coordinates></Point></Placemark>\
                <Placemark><LineString><coordinates>8,47 8.1,47</coordinates></LineString>\
                </Placemark>";
    let scenario = read(text);
    assert_eq!(scenario.mission.items.len(), 2);
    assert!(scenario.warnings[0].starts_with("map.kml, 1 points or lines"));
}

#[test]
fn what_is_elsewhere_is_said() {
    let text = format!(
        "<NetworkLink><Link><href>more.kml</href></Link></NetworkLink><Placemark>{}</Placemark>",
        polygon(RING)
    );
    assert!(read(&text).warnings[0].contains("<NetworkLink>"));
}

#[test]
fn a_file_that_ends_too_early_is_an_error() {
    let whole = document(&format!("<Placemark>{}</Placemark>", polygon(RING)));
    for end in [whole.find("</kml>"), whole.find("</Polygon>"), whole.find("8.01,47.01")] {
        let error = error_of(&whole[..end.unwrap()]);
        assert!(error.contains("the file ends inside <"), "{error}");
    }
}

#[test]
fn broken_geometry_is_an_error_that_names_the_placemark() {
    let placemark =
        |content: &str| document(&format!("<Placemark><name>Mast</name>{content}</Placemark>"));
    let error = error_of(&placemark(&polygon("8,47 8.1,x 8,48")));
    assert!(error.starts_with("map.kml, placemark 1 (Mast): vertex 2 is \"8.1,x\""), "{error}");
    let error = error_of(&placemark(&polygon("8,47 8.1,147 8,48")));
    assert!(error.starts_with("map.kml, placemark 1 (Mast): vertex 2: latitude 147"), "{error}");
    let error = error_of(&placemark("<Polygon/>"));
    assert!(error.contains("there is no outline of a polygon"), "{error}");
    let error = error_of(&placemark(&polygon("8,47")));
    assert!(error.contains("the number of vertices"), "{error}");
    let error = error_of(&document("\n<Placemark></Folder>"));
    assert!(error.starts_with("map.kml, line 3:"), "{error}");
}

#[test]
fn deep_nesting_is_refused_without_recursion() {
    let error = error_of(&format!("<kml>{}", "<Folder>".repeat(100_000)));
    assert!(error.contains("more than 256 XML elements"), "{error}");
}

/// A polygon with this mode whose vertices have these altitudes.
fn tall(mode: &str, altitudes: [&str; 3]) -> String {
    let [a, b, c] = altitudes;
    let ring = format!("8,47{a} 8.01,47{b} 8.01,47.01{c} 8,47{a}");
    let mode = match mode {
        "" => String::new(),
        mode => format!("<altitudeMode>{mode}</altitudeMode>"),
    };
    polygon(&ring).replace("<Polygon>", &format!("<Polygon><extrude>1</extrude>{mode}"))
}

fn heights_of(content: &str) -> Option<HeightRange> {
    read(&format!("<Placemark>{content}</Placemark>")).fences.regions[0].heights
}

fn up_to(reference: HeightReference, top: f64) -> Option<HeightRange> {
    Some(HeightRange { reference, bottom: None, top: Some(Metres(top)) })
}

#[test]
fn a_polygon_reaches_as_high_as_its_highest_vertex_above_what_its_mode_says() {
    let (ground, amsl) = (HeightReference::Ground, HeightReference::MeanSeaLevel);
    let heights = |mode| heights_of(&tall(mode, [",30", ",42.5", ",30"]));
    assert_eq!(heights("relativeToGround"), up_to(ground, 42.5));
    assert_eq!(heights("absolute"), up_to(amsl, 42.5));
    // Google Earth writes altitudes also where its mode makes nothing of them.
    for clamped in ["", "clampToGround", "clampToSeaFloor", "relativeToSeaFloor", "odd"] {
        assert_eq!(heights(clamped), None, "{clamped}");
    }
    // Two parts of one placemark: the higher.
    let two = |one: &str, other: &str| {
        let geometry = tall(one, [",10", ",10", ",10"]) + &tall(other, [",20", ",20", ",20"]);
        heights_of(&format!("<MultiGeometry>{geometry}</MultiGeometry>"))
    };
    assert_eq!(two("absolute", "absolute"), up_to(amsl, 20.0));
    assert_eq!(two("relativeToGround", "absolute"), None);
    assert_eq!(two("absolute", ""), None);
}

#[test]
fn what_is_not_given_for_every_vertex_is_not_known() {
    for altitudes in [["", "", ""], [",30", "", ",30"], [",30", ",0", ",30"], [",30", ",-2", ",30"]]
    {
        assert_eq!(heights_of(&tall("relativeToGround", altitudes)), None, "{altitudes:?}");
    }
    // What is said in words counts more than what is drawn.
    let said = "<ExtendedData><Data name='height'><value>12</value></Data></ExtendedData>";
    let drawn = tall("absolute", [",30", ",30", ",30"]);
    assert_eq!(heights_of(&(said.to_owned() + &drawn)), up_to(HeightReference::Ground, 12.0));
}

#[test]
fn the_mode_of_one_geometry_is_not_that_of_the_next() {
    let mode = "<altitudeMode>absolute</altitudeMode>";
    let clamped = tall("", [",30", ",30", ",30"]);
    for before in [
        format!("<Point>{mode}<coordinates>8,47,5</coordinates></Point>"),
        format!("<LineString>{mode}<coordinates>8,47,5 9,47,5</coordinates></LineString>"),
    ] {
        let both = format!("<MultiGeometry>{before}{clamped}</MultiGeometry>");
        assert_eq!(heights_of(&both), None, "{before}");
    }
    let ring = |mode: &str| {
        format!(
            "<LinearRing>{mode}<coordinates>8,47,9 8.1,47,9 8.1,47.1,9</coordinates></LinearRing>"
        )
    };
    let two =
        |second: &str| format!("<MultiGeometry>{}{}</MultiGeometry>", ring(mode), ring(second));
    assert_eq!(heights_of(&two(mode)), up_to(HeightReference::MeanSeaLevel, 9.0));
    assert_eq!(heights_of(&two("")), None);
}

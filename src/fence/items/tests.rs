use proptest::prelude::*;

use super::*;
use crate::geodesy::LatLonE7;

fn vertex(command: Command, count: f32, lat: i32, lon: i32) -> MissionItem {
    let place = LatLonE7 { lat, lon }.to_degrees().unwrap();
    item(command, count, place, 0.0)
}

fn triangle(command: Command) -> Vec<MissionItem> {
    [(0, 0), (0, 9000), (9000, 0)].map(|(lat, lon)| vertex(command, 3.0, lat, lon)).to_vec()
}

const EXCLUSION: Command = Command::NAV_FENCE_POLYGON_VERTEX_EXCLUSION;
const INCLUSION: Command = Command::NAV_FENCE_POLYGON_VERTEX_INCLUSION;

#[test]
fn two_polygons_of_the_same_kind_and_size_stay_two() {
    let items = [triangle(EXCLUSION), triangle(EXCLUSION)].concat();
    let decoded = decode_fence(&items, None).unwrap();
    let origins: Vec<_> = decoded.fences.regions.iter().map(|r| r.origin.as_str()).collect();
    assert_eq!(origins, ["fence items 0-2", "fence items 3-5"]);
}

#[test]
fn a_polygon_cut_short_is_an_error_at_its_first_item() {
    let items = [triangle(EXCLUSION), triangle(EXCLUSION)[..2].to_vec()].concat();
    let error = decode_fence(&items, None).unwrap_err();
    let problem = FenceItemProblem::Truncated { count: 3, left: 2 };
    assert_eq!(error, FenceItemError { index: 3, problem });
}

#[test]
fn a_count_that_lies_is_an_error_at_the_item_that_shows_it() {
    for count in [f32::NAN, f32::INFINITY, -3.0, 0.0, 2.0, 3.5, 1e9] {
        let mut items = triangle(EXCLUSION);
        items[0].params[0] = count;
        let error = decode_fence(&items, None).unwrap_err();
        assert_eq!(error.index, 0, "{count}");
        assert!(matches!(error.problem, FenceItemProblem::Count(_)), "{error}");
    }
    let mut items = triangle(EXCLUSION);
    items[1].params[0] = 4.0;
    assert!(decode_fence(&items, None).unwrap_err().to_string().starts_with("fence item 1:"));
}

#[test]
fn a_vertex_of_another_kind_inside_a_polygon_is_an_error() {
    let mut items = triangle(EXCLUSION);
    items[2].command = INCLUSION;
    let error = decode_fence(&items, None).unwrap_err();
    assert_eq!(error.index, 2);
    assert!(matches!(error.problem, FenceItemProblem::ForeignVertex { first: 0, .. }));
}

#[test]
fn a_position_off_the_globe_is_an_error_naming_the_vertex() {
    let mut items = triangle(INCLUSION);
    items[2].x = 900_000_001;
    let error = decode_fence(&items, None).unwrap_err();
    assert_eq!(error.index, 2);
    assert!(matches!(error.problem, FenceItemProblem::Position(_)));
}

#[test]
fn a_radius_that_is_no_length_is_an_error() {
    for radius in [0.0, -5.0, f32::NAN, f32::INFINITY, 9e6] {
        let items = [vertex(Command::NAV_FENCE_CIRCLE_EXCLUSION, radius, 1, 2)];
        let error = decode_fence(&items, None).unwrap_err();
        assert!(matches!(error.problem, FenceItemProblem::Radius(_)), "{radius}: {error}");
    }
}

#[test]
fn a_mission_command_or_local_frame_or_second_return_point_is_an_error() {
    let waypoint = vertex(Command::NAV_WAYPOINT, 0.0, 1, 2);
    assert!(matches!(
        decode_fence(&[waypoint], None).unwrap_err().problem,
        FenceItemProblem::NotAFenceCommand(Command::NAV_WAYPOINT)
    ));
    let mut local = triangle(EXCLUSION);
    local[1].frame = Frame(1);
    assert_eq!(decode_fence(&local, None).unwrap_err().index, 1);
    let point = vertex(Command::NAV_FENCE_RETURN_POINT, 0.0, 1, 2);
    let error = decode_fence(&[point, point], None).unwrap_err();
    assert_eq!(error.problem, FenceItemProblem::SecondReturnPoint { first: 0 });
}

#[test]
fn a_group_is_left_out_with_a_warning() {
    let mut items = triangle(INCLUSION);
    items.iter_mut().for_each(|item| item.params[1] = 2.0);
    let decoded = decode_fence(&items, Some("field.txt")).unwrap();
    assert_eq!(decoded.fences.regions.len(), 1);
    assert!(decoded.warnings[0].starts_with("field.txt fence items 0-2: inclusion group 2"));
}

#[test]
fn a_repeated_closing_vertex_is_dropped() {
    let corners = [(0, 0), (0, 9000), (9000, 0), (0, 0)];
    let items = corners.map(|(lat, lon)| vertex(EXCLUSION, 4.0, lat, lon));
    let decoded = decode_fence(&items, None).unwrap();
    let FenceShape::Polygon(ring) = &decoded.fences.regions[0].shape else { panic!() };
    assert_eq!(ring.len(), 3);
}

#[test]
fn a_ring_of_fewer_than_three_places_stays_a_polygon() {
    let [a, b] = [1, 2].map(|lat| LatLonE7 { lat, lon: 0 }.to_degrees().unwrap());
    assert_eq!(distinct_ring(vec![a, a, b, b, a, a]), [a, b, b]);
    assert_eq!(distinct_ring(vec![a, b, b]), [a, b, b]);
    assert_eq!(distinct_ring(vec![a, a, a, a]), [a, a, a]);
}

#[test]
fn a_radius_is_rounded_to_the_side_that_forbids_no_less() {
    assert!(f64::from(wire_radius(Metres(30.3), FenceRole::Exclusion)) >= 30.3);
    assert!(f64::from(wire_radius(Metres(30.3), FenceRole::Inclusion)) <= 30.3);
    assert_eq!(wire_radius(Metres(30.5), FenceRole::Exclusion), 30.5);
}

proptest! {
    #[test]
    fn what_is_encoded_decodes_to_the_same_fence(fences in crate::fence::samples::fence_set()) {
        let items = encode_fence(&fences).unwrap();
        let again = decode_fence(&items, None).unwrap().fences;
        prop_assert_eq!(again.return_point, fences.return_point);
        let plain = |set: &FenceSet| -> Vec<_> {
            set.regions.iter().map(|r| (r.role, r.shape.clone())).collect()
        };
        prop_assert_eq!(plain(&again), plain(&fences));
    }

    #[test]
    fn no_list_of_items_makes_the_decoder_panic(
        raw in prop::collection::vec(
            (4999u16..5006, 0u8..12, any::<f32>(), any::<i32>(), any::<i32>(), 0usize..5),
            0..12,
        )
    ) {
        let items: Vec<_> = raw.into_iter().map(|(command, frame, value, x, y, small)| {
            let param1 = [3.0, 4.0, 5.0, 2.5, value][small];
            MissionItem {
                seq: 0, frame: Frame(frame), command: Command(command), current: 0,
                autocontinue: 0, params: [param1, value, value, value], x, y, z: value,
            }
        }).collect();
        let _ = decode_fence(&items, None);
    }
}

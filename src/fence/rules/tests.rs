use proptest::prelude::*;

use super::*;

fn ardupilot(changed: &[(&str, f64)]) -> VehicleRules {
    let table = [
        ("FENCE_ENABLE", 1.0),
        ("FENCE_TYPE", 7.0),
        ("FENCE_OPTIONS", 1.0),
        ("FENCE_MARGIN", 2.0),
        ("FENCE_RADIUS", 300.0),
        ("FENCE_ALT_MAX", 100.0),
        ("FENCE_ALT_MIN", -10.0),
    ];
    let find = |list: &[(&str, f64)], name: &str| {
        list.iter().find(|(known, _)| *known == name).map(|(_, value)| *value)
    };
    VehicleRules::read(Autopilot::ArduPilot, |name| {
        find(changed, name).or_else(|| find(&table, name)).filter(|value| *value != -99.0)
    })
}

fn limits(rules: &VehicleRules) -> [Option<f64>; 3] {
    let Limits { radius, ceiling, floor, .. } = rules.limits;
    [radius, ceiling, floor].map(|limit| limit.map(|limit| limit.metres.0))
}

#[test]
fn an_enabled_fence_limits_what_its_type_says() {
    let rules = ardupilot(&[]);
    assert_eq!(limits(&rules), [Some(300.0), Some(100.0), None]);
    assert_eq!(rules.drawn, Enforcement::On);
    assert_eq!(rules.inclusion, Some(InclusionRule::All));
    assert!(rules.missing.is_empty(), "{:?}", rules.missing);
    assert_eq!(limits(&ardupilot(&[("FENCE_TYPE", 8.0)])), [None, None, Some(-10.0)]);
    assert_eq!(ardupilot(&[("FENCE_TYPE", 3.0)]).drawn, Enforcement::Off);
    let union = ardupilot(&[("FENCE_OPTIONS", 3.0)]);
    assert_eq!(union.inclusion, Some(InclusionRule::Any));
}

#[test]
fn limits_that_are_switched_off_do_not_count_and_that_is_said() {
    let off = ardupilot(&[("FENCE_ENABLE", 0.0)]);
    assert!(off.limits.is_empty());
    assert_eq!(off.drawn, Enforcement::Off);
    assert!(off.applied[0].contains("FENCE_ENABLE 0"), "{:?}", off.applied);
    // Switched on by the takeoff.
    let auto = ardupilot(&[("FENCE_ENABLE", 0.0), ("FENCE_AUTOENABLE", 2.0)]);
    assert_eq!(limits(&auto), [Some(300.0), Some(100.0), None]);
}

#[test]
fn what_the_vehicle_does_not_tell_is_said() {
    let rules = ardupilot(&[("FENCE_ENABLE", -99.0), ("FENCE_MARGIN", -99.0)]);
    assert_eq!(rules.drawn, Enforcement::Unknown);
    assert!(rules.limits.is_empty());
    assert!(rules.missing[0].starts_with("FENCE_ENABLE is not known"), "{:?}", rules.missing);
    assert!(rules.missing.iter().any(|missing| missing.starts_with("FENCE_MARGIN")));
    let rules = ardupilot(&[("FENCE_RADIUS", -5.0), ("FENCE_TYPE", 6.5)]);
    assert!(rules.missing.iter().any(|missing| missing.contains("no set of bits")));
    let unknown = VehicleRules::read(Autopilot::Unknown, |_| Some(1.0));
    assert_eq!(unknown.missing.len(), 1);
}

#[test]
fn px4_limits_count_whatever_its_action_is() {
    let table = [
        ("GF_ACTION", 0.0),
        ("GF_MAX_HOR_DIST", 250.0),
        ("GF_MAX_VER_DIST", 0.0),
        ("NAV_LOITER_RAD", -80.0),
    ];
    let rules = VehicleRules::read(Autopilot::Px4, |name| {
        table.iter().find(|(known, _)| *known == name).map(|(_, value)| *value)
    });
    assert_eq!(limits(&rules), [Some(250.0), None, None]);
    assert_eq!(rules.drawn, Enforcement::Off);
    assert_eq!(rules.loiter_radius, Some(Metres(80.0)));
    assert!(rules.missing.is_empty(), "{:?}", rules.missing);
}

fn triangle(north: f64) -> FenceRegion {
    let corner = |lat: f64, lon: f64| LatLon::new(lat + north, lon).unwrap();
    let shape = FenceShape::Polygon(vec![corner(0., 0.), corner(1., 0.), corner(0., 1.)]);
    let origin = "fence items 0-2".to_owned();
    FenceRegion { role: FenceRole::Inclusion, shape, heights: None, origin }
}

#[test]
fn a_disabled_fence_is_left_out_only_where_it_is_known_to_be() {
    let left = |rules: &VehicleRules| {
        let mut fences = FenceSet { regions: vec![triangle(0.0)], return_point: None };
        (rules.leave_out_disabled(&mut fences).is_some(), fences.regions.len())
    };
    assert_eq!(left(&ardupilot(&[])), (false, 1));
    assert_eq!(left(&ardupilot(&[("FENCE_ENABLE", 0.0)])), (true, 0));
    assert_eq!(left(&ardupilot(&[("FENCE_ENABLE", -99.0)])), (false, 1), "not known");
}

#[test]
fn an_inclusion_that_px4_would_leave_out_is_named() {
    let fences = FenceSet { regions: vec![triangle(0.0), triangle(5.0)], return_point: None };
    let home = LatLon::new(0.2, 0.2).unwrap();
    let px4 = VehicleRules::read(Autopilot::Px4, |_| None);
    assert_eq!(px4.odd_inclusions(&fences, Some(home)).len(), 1);
    assert!(ardupilot(&[]).odd_inclusions(&fences, Some(home)).is_empty());
}

#[test]
fn the_circle_of_a_multirotor_is_read_in_either_unit() {
    assert_eq!(ardupilot(&[("CIRCLE_RADIUS", 1000.0)]).circle_radius, Some(Metres(10.0)));
    let both = [("CIRCLE_RADIUS", 1000.0), ("CIRCLE_RADIUS_M", 12.0)];
    assert_eq!(ardupilot(&both).circle_radius, Some(Metres(12.0)));
    let plane = [("WP_LOITER_RAD", -60.0), ("RTL_RADIUS", 90.0)];
    assert_eq!(ardupilot(&plane).loiter_radius, Some(Metres(90.0)));
}

proptest! {
    #[test]
    fn whatever_the_values_are_each_limit_is_a_finite_length(
        values in prop::collection::vec(any::<f64>(), ARDUPILOT.len()),
        autopilot in prop::sample::select(vec![Autopilot::ArduPilot, Autopilot::Px4]),
    ) {
        let names = VehicleRules::parameters(autopilot);
        let rules = VehicleRules::read(autopilot, |name| {
            names.iter().position(|known| *known == name).map(|k| values[k])
        });
        let lengths = [rules.limits.radius, rules.limits.ceiling].into_iter().flatten();
        for limit in lengths {
            prop_assert!(limit.metres.0 > 0.0 && limit.metres.0 <= FARTHEST);
        }
        for radius in [rules.loiter_radius, rules.circle_radius].into_iter().flatten() {
            prop_assert!(radius.0 > 0.0 && radius.0.is_finite());
        }
    }
}

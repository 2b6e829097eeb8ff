//! Parameters are read by name, as each autopilot puts an integer into a float.

use quav::vehicle::ParameterValue;

use crate::sitl::{FakeVehicle, Session, search};

#[tokio::test]
async fn integers_and_reals_of_both_autopilots_are_read_also_on_a_lossy_link() {
    for (persona, names, expected) in [
        (
            "ardupilot",
            ["FENCE_TYPE", "FENCE_ALT_MIN", "FENCE_OPTIONS", "GF_ACTION"],
            [Some(7.0), Some(-10.0), Some(1.0), None],
        ),
        (
            "px4",
            ["GF_ACTION", "MIS_DIST_1WP", "MAV_SYS_ID", "FENCE_ENABLE"],
            [Some(2.0), Some(10_000.0), Some(1.0), None],
        ),
    ] {
        let mut fake = FakeVehicle::start(&["--persona", persona]);
        let session = Session::open(&fake.endpoint(), search()).await;
        fake.fault("drop:p=0.3");
        let read = session.vehicle.parameters(&names).await.unwrap();
        let values: Vec<_> = read.iter().map(|value| value.map(ParameterValue::as_f64)).collect();
        assert_eq!(values, expected, "{persona}");
        let is_integer = matches!(read[0], Some(ParameterValue::Integer(_)));
        assert!(is_integer, "{persona}: {read:?}");
        session.close().await;
    }
}

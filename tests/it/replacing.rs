//! A plan is replaced as a whole or not at all, and quavd knows which, whatever happens on the
//! way.

use quav::mission::{MissionItem, MissionType};
use quav::store::{Outcome, Store};
use quav::vehicle::replace::{
    Aftermath, Failure, Obstacle, ReplaceError, Replacement, Settled, WhileArmed, pilots_own,
    replace, restore, settle,
};
use quav::vehicle::transfer::TransferError;
use quav::vehicle::{MissionResult, Timing, Vehicle};
use serde_json::{Value, json};

use crate::sitl::{FakeVehicle, PERSONAS, Session, search, waypoint};

const MISSION: MissionType = MissionType::Mission;

/// A vehicle with a mission of twelve items on it, found, with an empty store beside it.
struct Scene {
    fake: FakeVehicle,
    session: Session,
    directory: tempfile::TempDir,
    before: Vec<MissionItem>,
    dumped: Vec<Value>,
}

impl Scene {
    async fn new(persona: &str) -> Self {
        Self::scripted(persona, &[]).await
    }

    async fn scripted(persona: &str, more: &[&str]) -> Self {
        let mut fake = FakeVehicle::start(&[&["--persona", persona], more].concat());
        fake.set(MISSION, &(0..12).map(waypoint).collect::<Vec<_>>());
        let session = Session::open(&fake.endpoint(), quick()).await;
        let before = download(&session.vehicle).await;
        let dumped = fake.held(MISSION);
        Self { fake, session, directory: tempfile::tempdir().unwrap(), before, dumped }
    }

    fn vehicle(&self) -> &Vehicle {
        &self.session.vehicle
    }

    fn store(&self) -> Store {
        Store::open(self.directory.path()).unwrap()
    }

    /// What is to replace the mission: 16 items, all in other places.
    fn replacement(&self) -> Replacement {
        let moved = |item: MissionItem| MissionItem { y: item.y + 500, ..item };
        let home = self.before.len() - 12;
        let home = self.before[..home].iter().copied();
        let intended = home.chain((0..16).map(waypoint).map(moved)).zip(0..);
        Replacement {
            mission_type: MISSION,
            original: self.before.clone(),
            before: self.before.clone(),
            intended: intended.map(|(item, seq)| MissionItem { seq, ..item }).collect(),
        }
    }

    async fn replace(&self, store: &Store) -> Result<quav::store::Record, ReplaceError> {
        replace(self.vehicle(), store, self.replacement(), WhileArmed::Refuse, &mut |_| {}).await
    }

    async fn again(&mut self) {
        let endpoint = self.fake.endpoint();
        let session = Session::open(&endpoint, quick()).await;
        std::mem::replace(&mut self.session, session).close().await;
    }

    /// Whether the vehicle itself holds what it held at first, field by field.
    fn is_as_before(&mut self) -> bool {
        self.fake.held(MISSION) == self.dumped
    }
}

/// Shorter waits than in the field: the fake vehicle is near.
fn quick() -> quav::vehicle::Search {
    let second = std::time::Duration::from_secs(1);
    let timing = Timing {
        patience: 2 * second,
        silence: 3 * second,
        stragglers: second / 10,
        ..Timing::default()
    };
    quav::vehicle::Search { timing, ..search() }
}

async fn download(vehicle: &Vehicle) -> Vec<MissionItem> {
    vehicle.download(MISSION, &mut |_| {}).await.unwrap().items
}

#[tokio::test]
async fn a_proven_replacement_is_remembered_with_the_pilots_own_plan() {
    for persona in PERSONAS {
        let scene = Scene::new(persona).await;
        let store = scene.store();
        let record = scene.replace(&store).await.unwrap();
        assert_eq!(record.outcome, Outcome::Verified);
        let held = download(scene.vehicle()).await;
        let own = pilots_own(scene.vehicle(), &store, MISSION, &held).await.unwrap();
        assert_eq!(own, scene.before);

        let back = restore(scene.vehicle(), &store, MISSION, WhileArmed::Refuse, &mut |_| {}).await;
        assert_eq!(back.unwrap().outcome, Outcome::Verified);
        assert_eq!(download(scene.vehicle()).await, scene.before);
        scene.session.close().await;
    }
}

#[tokio::test]
async fn a_refusal_in_the_middle_ends_with_the_old_plan_back() {
    for persona in PERSONAS {
        let mut scene = Scene::new(persona).await;
        let store = scene.store();
        scene.fake.fault("refuse-item:type=mission,item=7,code=5,times=1");
        let error = scene.replace(&store).await.unwrap_err();
        let Obstacle::Transfer(TransferError::Refused { result, item, .. }) = &error.obstacle
        else {
            panic!("{error}");
        };
        assert_eq!((*result, *item), (MissionResult(5), Some(7)));
        assert_eq!(error.failure(), Failure::Refused);
        // ArduPilot has written items 0 to 6 by then; PX4 writes all or nothing.
        let settled = if persona == "px4" { Settled::Untouched } else { Settled::PutBack };
        assert!(matches!(error.aftermath, Aftermath::Settled(s) if s == settled), "{error}");
        assert!(scene.is_as_before());
        assert_eq!(store.open_record(&scene.vehicle().id(), MISSION).unwrap(), None);
        scene.session.close().await;
    }
}

#[tokio::test]
async fn a_vehicle_that_keeps_half_of_what_it_accepted_gets_the_old_plan_back() {
    for persona in PERSONAS {
        let mut scene = Scene::new(persona).await;
        let store = scene.store();
        scene.fake.fault("half-write:type=mission,item=5,times=1");
        let error = scene.replace(&store).await.unwrap_err();
        assert!(matches!(error.obstacle, Obstacle::Mismatch { .. }), "{error}");
        assert!(matches!(error.aftermath, Aftermath::Settled(Settled::PutBack)), "{error}");
        assert!(scene.is_as_before());
        scene.session.close().await;
    }
}

#[tokio::test]
async fn a_link_lost_in_mid_upload_is_said_and_the_next_start_puts_the_old_plan_back() {
    for persona in PERSONAS {
        let mut scene = Scene::new(persona).await;
        let store = scene.store();
        scene.fake.fault("vanish:item=6,when=upload");
        let error = scene.replace(&store).await.unwrap_err();
        assert_eq!(error.failure(), Failure::Unreachable, "{error}");
        assert!(matches!(error.aftermath, Aftermath::Unsettled { .. }), "{error}");
        let open = store.open_record(&scene.vehicle().id(), MISSION).unwrap().unwrap();
        assert_eq!(open.before, scene.before);
        drop(store);

        // The vehicle comes back from the power cut with what its storage held.
        let left = scene.fake.held(MISSION).split_off(scene.before.len() - 12);
        scene.fake = FakeVehicle::start(&["--persona", persona]);
        scene.fake.control(&json!({"cmd": "set", "mission": left}));
        scene.again().await;
        let store = scene.store();
        let refused = scene.replace(&store).await.unwrap_err();
        assert!(matches!(refused.obstacle, Obstacle::Unsettled { .. }), "{refused}");
        let settled =
            settle(scene.vehicle(), &store, MISSION, WhileArmed::Refuse, &mut |_| {}).await;
        let wanted = if persona == "px4" { Settled::Untouched } else { Settled::PutBack };
        assert_eq!(settled.unwrap(), Some(wanted));
        assert_eq!(download(scene.vehicle()).await, scene.before);
        scene.session.close().await;
    }
}

#[tokio::test]
async fn a_plan_that_somebody_uploaded_since_is_left_alone() {
    let mut scene = Scene::new("ardupilot").await;
    let store = scene.store();
    scene.fake.fault("vanish:item=6,when=upload");
    scene.replace(&store).await.unwrap_err();
    let theirs: Vec<_> = (100..105).map(waypoint).collect();
    scene.fake = FakeVehicle::start(&["--persona", "ardupilot"]);
    scene.fake.set(MISSION, &theirs);
    let dumped = scene.fake.held(MISSION);
    scene.again().await;
    let settled = settle(scene.vehicle(), &store, MISSION, WhileArmed::Refuse, &mut |_| {}).await;
    assert_eq!(settled.unwrap(), Some(Settled::LeftAlone));
    assert_eq!(scene.fake.held(MISSION), dumped);
    scene.session.close().await;
}

#[tokio::test]
async fn a_plan_that_was_changed_while_planning_is_not_overwritten() {
    let mut scene = Scene::new("px4").await;
    let store = scene.store();
    scene.fake.set(MISSION, &(0..3).map(waypoint).collect::<Vec<_>>());
    let error = scene.replace(&store).await.unwrap_err();
    assert!(matches!(error.obstacle, Obstacle::Changed { .. }), "{error}");
    assert!(matches!(error.aftermath, Aftermath::NotBegun));
    assert_eq!(scene.fake.held(MISSION).len(), 3);
    scene.session.close().await;
}

#[tokio::test]
async fn an_armed_vehicle_is_not_written_to() {
    let mut scene = Scene::new("ardupilot").await;
    let store = scene.store();
    scene.fake.control(&json!({"cmd": "set", "armed": true}));
    let armed = scene.vehicle().wait_for(std::time::Duration::from_secs(5), |s| s.is_armed()).await;
    assert!(armed.is_some());
    let error = scene.replace(&store).await.unwrap_err();
    assert!(matches!(error.obstacle, Obstacle::Armed), "{error}");
    assert_eq!(error.failure(), Failure::Refused);
    assert!(scene.is_as_before());
    scene.session.close().await;
}

#[tokio::test]
async fn what_another_ground_station_uploads_while_quavd_begins_is_not_overwritten() {
    // It comes between the last look at the plan and the upload, which is then denied.
    let theirs: Vec<_> = (100..103).map(waypoint).collect();
    let items: Vec<_> = theirs.iter().map(crate::sitl::item_json).collect();
    let script = json!({
        "on": "download_done", "nth": 2, "cmd": "gcs-upload", "items": items, "pace": 0.05
    });
    for persona in PERSONAS {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("script");
        std::fs::write(&path, script.to_string()).unwrap();
        let mut scene = Scene::scripted(persona, &["--script", path.to_str().unwrap()]).await;
        let store = scene.store();
        let error = scene.replace(&store).await.unwrap_err();
        assert!(matches!(error.obstacle, Obstacle::Changed { .. }), "{persona}: {error}");
        assert!(
            matches!(error.aftermath, Aftermath::Settled(Settled::LeftAlone)),
            "{persona}: {error}"
        );
        let held = scene.fake.held(MISSION);
        let last = |items: &[Value]| items.last().map(|item| item["x"].clone());
        assert_eq!(last(&held), last(&items), "{persona}");
        assert_eq!(held.len(), 3, "{persona}");
        let record = store.last(&scene.vehicle().id(), MISSION).unwrap().unwrap();
        assert_eq!(record.outcome, Outcome::Superseded);
        scene.session.close().await;
    }
}

#[tokio::test]
async fn an_item_that_storage_falsified_is_noticed_kept_on_disk_and_put_right() {
    for persona in PERSONAS {
        for (field, value) in [("x", "473977421"), ("z", "30.5"), ("frame", "0"), ("command", "19")]
        {
            let mut scene = Scene::new(persona).await;
            let store = scene.store();
            scene.fake.fault(&format!("mis-store:item=9,field={field},value={value},times=1"));
            let error = scene.replace(&store).await.unwrap_err();
            assert!(matches!(error.obstacle, Obstacle::Mismatch { .. }), "{field}: {error}");
            assert!(matches!(error.aftermath, Aftermath::Settled(Settled::PutBack)), "{error}");
            assert!(scene.is_as_before(), "{persona} {field}");
            let record = store.last(&scene.vehicle().id(), MISSION).unwrap().unwrap();
            let found = record.found.expect("what was overwritten is kept");
            assert_eq!(found.len(), scene.replacement().intended.len());
            scene.session.close().await;
        }
    }
}

#[tokio::test]
async fn a_record_of_another_flight_controller_with_the_same_system_id_is_not_applied() {
    let mut scene = Scene::new("ardupilot").await;
    let store = scene.store();
    scene.fake.fault("vanish:item=6,when=upload");
    scene.replace(&store).await.unwrap_err();
    // Another vehicle, by chance with the same half of a mission on it.
    let left = scene.fake.held(MISSION).split_off(1);
    scene.fake = FakeVehicle::start(&["--persona", "ardupilot", "--uid", "77"]);
    scene.fake.control(&json!({"cmd": "set", "mission": left}));
    let dumped = scene.fake.held(MISSION);
    scene.again().await;
    let settled = settle(scene.vehicle(), &store, MISSION, WhileArmed::Refuse, &mut |_| {}).await;
    assert_eq!(settled.unwrap(), None);
    assert_eq!(scene.fake.held(MISSION), dumped);
    scene.session.close().await;
}

#[tokio::test]
async fn too_many_items_are_refused_with_the_numbers_and_nothing_is_written() {
    let mut scene = Scene::scripted("ardupilot", &["--capacity", "mission=14"]).await;
    let store = scene.store();
    let error = scene.replace(&store).await.unwrap_err();
    let Obstacle::Transfer(TransferError::NoSpace { count, most, .. }) = &error.obstacle else {
        panic!("{error}");
    };
    assert_eq!((*count, *most), (17, Some(14)));
    assert_eq!(error.failure(), Failure::Refused);
    assert!(matches!(error.aftermath, Aftermath::Settled(Settled::Untouched)), "{error}");
    assert!(scene.is_as_before());
    scene.session.close().await;
}

#[tokio::test]
async fn nothing_is_sent_where_the_old_plan_cannot_be_saved() {
    let mut scene = Scene::new("ardupilot").await;
    let store = scene.store();
    std::fs::remove_dir_all(scene.directory.path()).unwrap();
    let error = scene.replace(&store).await.unwrap_err();
    assert!(matches!(error.obstacle, Obstacle::Store(_)), "{error}");
    assert_eq!(error.failure(), Failure::Local);
    assert!(scene.is_as_before());
    assert_eq!(scene.fake.dump()["events"]["counts"]["upload_start"], Value::Null);
    scene.session.close().await;
}

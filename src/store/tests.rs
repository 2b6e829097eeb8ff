//! Records are kept, found again, and never mistaken.

use super::*;
use crate::mission::{Command, Frame};
use crate::vehicle::Autopilot;

const VEHICLE: VehicleId =
    VehicleId { system: SystemId(1), autopilot: Autopilot::ArduPilot, uid: None };

fn item(seq: u16) -> MissionItem {
    MissionItem {
        seq,
        frame: Frame::GLOBAL,
        command: Command::NAV_WAYPOINT,
        current: 0,
        autocontinue: 1,
        params: [0.0; 4],
        x: 10,
        y: 20,
        z: 30.0,
    }
}

fn beginning(items: u16) -> Beginning {
    let original: Vec<_> = (0..items).map(item).collect();
    Beginning {
        vehicle: VEHICLE,
        mission_type: MissionType::Mission,
        before: original.clone(),
        intended: original.iter().rev().copied().collect(),
        original,
    }
}

fn store() -> (tempfile::TempDir, Store) {
    let directory = tempfile::tempdir().unwrap();
    let store = Store::open(directory.path()).unwrap();
    (directory, store)
}

fn open_record(store: &Store) -> Option<Record> {
    store.open_record(&VEHICLE, MissionType::Mission).unwrap()
}

#[test]
fn an_upload_is_open_until_it_is_closed_also_after_a_restart() {
    let (directory, store) = store();
    let mut record = store.begin(beginning(3)).unwrap();
    drop(store);
    let store = Store::open(directory.path()).unwrap();
    assert_eq!(open_record(&store).as_ref(), Some(&record));
    let other = VehicleId { system: SystemId(2), ..VEHICLE };
    assert_eq!(store.open_record(&other, MissionType::Mission).unwrap(), None);
    assert_eq!(store.open_record(&VEHICLE, MissionType::Fence).unwrap(), None);

    store.close(&mut record, Outcome::Verified).unwrap();
    assert_eq!(open_record(&store), None);
    let verified = store.last_verified(&VEHICLE, MissionType::Mission).unwrap();
    assert_eq!(verified.as_ref(), Some(&record));
}

#[test]
fn two_processes_do_not_share_a_directory() {
    let (directory, store) = store();
    let second = Store::open(directory.path());
    assert!(matches!(second, Err(StoreError::InUse { .. })), "{second:?}");
    drop(store);
    Store::open(directory.path()).unwrap();
}

#[test]
fn old_records_go_but_none_that_is_needed() {
    let (directory, store) = store();
    let unsettled = store.begin(beginning(1)).unwrap();
    let mut verified = store.begin(beginning(2)).unwrap();
    store.close(&mut verified, Outcome::Verified).unwrap();
    for _ in 0..2 * KEPT {
        let mut record = store.begin(beginning(3)).unwrap();
        store.close(&mut record, Outcome::Restored).unwrap();
    }
    let newest = store.begin(beginning(4)).unwrap();
    assert_eq!(fs::read_dir(directory.path()).unwrap().count(), KEPT + 4, "with the lock");
    assert_eq!(open_record(&store), Some(newest));
    let kept = store.last_verified(&VEHICLE, MissionType::Mission).unwrap();
    assert_eq!(kept, Some(verified));
    assert!(store.path_of(&unsettled).exists());
}

#[test]
fn an_upload_to_another_flight_controller_with_the_same_system_id_is_not_this_ones() {
    let uid = |number| Uid::from_version(number, [0; 18]);
    let (_directory, store) = store();
    let theirs = VehicleId { uid: uid(7), ..VEHICLE };
    let record = store.begin(Beginning { vehicle: theirs, ..beginning(3) }).unwrap();
    let open = |vehicle| store.open_record(&vehicle, MissionType::Mission).unwrap();
    assert_eq!(open(VehicleId { uid: uid(8), ..VEHICLE }), None);
    assert_eq!(open(VehicleId { autopilot: Autopilot::Px4, ..theirs }), None);
    assert_eq!(open(theirs), Some(record.clone()));
    assert_eq!(open(VEHICLE), Some(record), "it has not told who it is");
}

#[test]
fn a_directory_that_takes_no_file_is_an_error_before_anything_else_happens() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("records");
    let store = Store::open(&path).unwrap();
    fs::remove_dir_all(&path).unwrap();
    let error = store.begin(beginning(2)).unwrap_err();
    assert!(matches!(error, StoreError::Io { .. }), "{error}");
}

#[test]
fn a_directory_is_made_with_those_above_it_for_its_owner_only() {
    use std::os::unix::fs::PermissionsExt;
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("state/quavd");
    let store = Store::open(&path).unwrap();
    assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o700);
    let record = store.begin(beginning(1)).unwrap();
    assert!(store.path_of(&record).starts_with(&path));
}

#[test]
fn a_damaged_record_is_an_error_and_not_forgotten() {
    let (_directory, store) = store();
    let record = store.begin(beginning(2)).unwrap();
    let path = store.path_of(&record);
    let bytes = fs::read(&path).unwrap();
    fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    let read = store.open_record(&VEHICLE, MissionType::Mission);
    let error = read.unwrap_err().to_string();
    assert!(error.contains("mission-1-000001.json") && error.contains("move it away"), "{error}");
    assert_eq!(store.begin(beginning(2)).unwrap().number, 2, "its number is not used again");
}

#[test]
fn what_a_dying_process_left_behind_is_no_record() {
    let directory = tempfile::tempdir().unwrap();
    let unfinished = directory.path().join(format!("{UNFINISHED}Ab12"));
    let foreign = directory.path().join("notes.txt");
    fs::write(&unfinished, b"{\"version\":1").unwrap();
    fs::write(&foreign, b"mine").unwrap();
    let store = Store::open(directory.path()).unwrap();
    assert!(!unfinished.exists() && foreign.exists());
    assert_eq!(open_record(&store), None);
    let record = store.begin(beginning(1)).unwrap();
    assert_eq!(open_record(&store), Some(record));
}

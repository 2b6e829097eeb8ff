//! Settling an upload whose outcome is not known: what did it leave, and what is to be done?

use super::guard::{Permit, may_clean_up, may_write};
use super::outcome::{Obstacle, Settled};
use super::put::{Putting, What};
use super::{OnStep, WhileArmed, close, held, on_disk, open_record};
use crate::mission::{MissionItem, MissionType};
use crate::store::{Outcome, Record, Store};
use crate::vehicle::readback::{changes, differences};
use crate::vehicle::{Autopilot, Vehicle, VehicleId};

/// Who may have put an unknown plan on the vehicle.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Suspect {
    /// The upload that has just failed, most likely.
    Ourselves,
    /// Anybody: time has passed.
    Anybody,
}

/// Ends what an earlier run left open, after a lost link, a crash or a power cut. `None` where
/// nothing was open.
///
/// A plan that is neither the old one, nor the new one, nor made of parts of both has been put
/// there by somebody else, and is left alone.
///
/// # Errors
/// [`Obstacle`]: the record is then still open.
pub async fn settle(
    vehicle: &Vehicle,
    store: &Store,
    mission_type: MissionType,
    while_armed: WhileArmed,
    on_step: OnStep<'_>,
) -> Result<Option<Settled>, Obstacle> {
    let Some(mut record) = open_record(vehicle, store, mission_type).await? else {
        return Ok(None);
    };
    let suspect = Suspect::Anybody;
    settle_record(vehicle, store, &mut record, while_armed, suspect, on_step).await.map(Some)
}

pub(super) async fn settle_record(
    vehicle: &Vehicle,
    store: &Store,
    record: &mut Record,
    while_armed: WhileArmed,
    suspect: Suspect,
    on_step: OnStep<'_>,
) -> Result<Settled, Obstacle> {
    let mission_type = record.mission_type;
    if !vehicle.is_alive() {
        return Err(Obstacle::Silent { seconds: vehicle.silent_for().as_secs_f64() });
    }
    tokio::time::sleep(vehicle.timing.stragglers).await;
    let held = held(vehicle, mission_type, on_step).await?;
    let (settled, outcome) = match finding(&vehicle.id(), record, &held, suspect) {
        Finding::Old => (Settled::Untouched, Outcome::Restored),
        Finding::New => {
            record.read_back = Some(held);
            (Settled::Finished, Outcome::Verified)
        }
        Finding::SomebodyElses => (Settled::LeftAlone, Outcome::Superseded),
        found @ (Finding::Mixture | Finding::Mangled) => {
            match suspect {
                Suspect::Ourselves => may_clean_up(vehicle, while_armed).await?,
                Suspect::Anybody => may_write(vehicle, while_armed).await?,
            };
            if found == Finding::Mangled {
                // Not known to be ours to the last item: it is not overwritten unsaved.
                record.found = Some(held);
                let with_found = record.clone();
                on_disk(store, move |store| store.update(&with_found)).await?;
            }
            let (what, permit) = (What::Old, Permit::CleaningUp);
            Putting { vehicle, record, what, permit }.put(on_step).await?;
            (Settled::PutBack, Outcome::Restored)
        }
    };
    close(store, record, outcome).await?;
    tracing::info!(plan = %mission_type, outcome = %settled, "upload settled");
    Ok(settled)
}

/// What a vehicle is found to hold after an upload of which the outcome is not known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Finding {
    /// The plan of before.
    Old,
    /// The new plan, whole.
    New,
    /// Each item that of the old plan or of the new one.
    Mixture,
    /// Mostly the new plan, with something in it that is in neither.
    Mangled,
    /// Another plan.
    SomebodyElses,
}

/// What is found, for one who suspects the given party.
pub(super) fn finding(
    vehicle: &VehicleId,
    record: &Record,
    held: &[MissionItem],
    suspect: Suspect,
) -> Finding {
    let Record { mission_type, before, intended, found, .. } = record;
    let (autopilot, mission_type) = (vehicle.autopilot, *mission_type);
    if changes(autopilot, mission_type, before, held).is_empty() {
        return Finding::Old;
    }
    if differences(autopilot, mission_type, intended, held).is_empty() {
        return Finding::New;
    }
    if differences(autopilot, mission_type, before, held).is_empty() {
        return Finding::Old;
    }
    let home_slot = usize::from(home_slot(autopilot, mission_type));
    let ours = match suspect {
        Suspect::Ourselves => true,
        // An empty plan tells nothing where it may be another vehicle's. On the same one, ArduPilot
        // has erased the fence or cut the mission; PX4 does neither, so that somebody has cleared it.
        Suspect::Anybody if held.len() <= home_slot => {
            autopilot == Autopilot::ArduPilot && vehicle.is(&record.vehicle)
        }
        Suspect::Anybody => true,
    };
    // What was found right after the upload is what the vehicle made of it.
    let plans = [before, intended, found.as_ref().unwrap_or(before)];
    let longest = plans.iter().map(|plan| plan.len()).max().unwrap_or(0);
    let is_either =
        |k: usize| plans.iter().any(|plan| is_at(autopilot, mission_type, plan, held, k));
    if ours && held.len() <= longest && (home_slot..held.len()).all(is_either) {
        return Finding::Mixture;
    }
    let same = (home_slot..held.len()).filter(|&k| is_alike(intended, held, k)).count();
    if suspect == Suspect::Ourselves && 2 * same >= held.len() - home_slot.min(held.len()) {
        return Finding::Mangled;
    }
    Finding::SomebodyElses
}

fn home_slot(autopilot: Autopilot, mission_type: MissionType) -> bool {
    autopilot == Autopilot::ArduPilot && mission_type == MissionType::Mission
}

/// Whether item `k` of what is held is that of `plan`. (ArduPilot cuts the mission to the new
/// length at once, then overwrites item by item.)
fn is_at(
    autopilot: Autopilot,
    mission_type: MissionType,
    plan: &[MissionItem],
    held: &[MissionItem],
    k: usize,
) -> bool {
    // Compared as a plan of one item, behind a slot that stands for those before it.
    let of = |item: MissionItem| [MissionItem { seq: 0, ..item }, MissionItem { seq: 1, ..item }];
    plan.get(k).is_some_and(|item| {
        differences(autopilot, mission_type, &of(*item), &of(held[k])).is_empty()
    })
}

/// Whether item `k` of what is held is that of `plan` with something wrong about it: of command,
/// latitude, longitude and altitude, three are the same.
fn is_alike(plan: &[MissionItem], held: &[MissionItem], k: usize) -> bool {
    let alike = |item: &MissionItem| {
        let held = &held[k];
        let same =
            [item.command == held.command, item.x == held.x, item.y == held.y, item.z == held.z];
        same.into_iter().filter(|&same| same).count() >= 3
    };
    plan.get(k).is_some_and(alike)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::SystemId;
    use crate::mission::{Command, Frame};
    use crate::vehicle::Uid;

    fn item(seq: u16, place: i32) -> MissionItem {
        MissionItem {
            seq,
            frame: Frame::GLOBAL_RELATIVE_ALT,
            command: Command::NAV_WAYPOINT,
            current: 0,
            autocontinue: 1,
            params: [0.0; 4],
            x: place,
            y: 7 * place,
            z: 30.0,
        }
    }

    /// A plan with an item at each place.
    fn plan(places: &[i32]) -> Vec<MissionItem> {
        places.iter().zip(0..).map(|(&place, seq)| item(seq, place)).collect()
    }

    fn vehicle(uid: u64) -> VehicleId {
        VehicleId {
            system: SystemId(1),
            autopilot: Autopilot::ArduPilot,
            uid: Uid::from_version(uid, [0; 18]),
        }
    }

    fn record(mission_type: MissionType) -> Record {
        Record {
            number: 1,
            outcome: Outcome::Started,
            vehicle: vehicle(5),
            mission_type,
            began: 0,
            original: vec![],
            before: plan(&[0, 1, 2, 3, 4]),
            intended: plan(&[0, 11, 12, 13, 14, 15]),
            read_back: None,
            found: None,
        }
    }

    fn found(held: &[i32], suspect: Suspect) -> Finding {
        finding(&vehicle(5), &record(MissionType::Mission), &plan(held), suspect)
    }

    #[test]
    fn each_state_that_an_upload_can_leave_is_told() {
        use Finding::{Mixture, New, Old};
        for suspect in [Suspect::Ourselves, Suspect::Anybody] {
            assert_eq!(found(&[0, 1, 2, 3, 4], suspect), Old);
            assert_eq!(found(&[9, 1, 2, 3, 4], suspect), Old, "home has moved");
            assert_eq!(found(&[0, 11, 12, 13, 14, 15], suspect), New);
            assert_eq!(found(&[0, 11, 12, 3, 4], suspect), Mixture);
            assert_eq!(found(&[0, 11, 12, 13, 14], suspect), Mixture);
            assert_eq!(found(&[0, 1, 12], suspect), Mixture);
        }
    }

    #[test]
    fn what_somebody_else_put_there_is_left_alone_even_right_after_our_upload() {
        use Finding::{Mangled, SomebodyElses};
        for suspect in [Suspect::Ourselves, Suspect::Anybody] {
            assert_eq!(found(&[0, 21, 22, 23], suspect), SomebodyElses);
            assert_eq!(found(&[0, 1, 2, 33, 4], suspect), SomebodyElses, "the pilot moved one");
            assert_eq!(found(&[0, 1, 2, 3, 4, 5, 6], suspect), SomebodyElses, "and added two");
        }
        assert_eq!(found(&[0, 11, 12, 99, 14, 15], Suspect::Ourselves), Mangled);
        assert_eq!(found(&[0, 11, 12, 99, 14, 15], Suspect::Anybody), SomebodyElses);
    }

    #[test]
    fn what_the_vehicle_made_of_our_plan_is_known_again_later() {
        let record =
            Record { found: Some(plan(&[0, 11, 12, 99, 14, 15])), ..record(MissionType::Mission) };
        let later = |held: &[i32]| finding(&vehicle(5), &record, &plan(held), Suspect::Anybody);
        assert_eq!(later(&[0, 11, 12, 99, 14, 15]), Finding::Mixture);
        assert_eq!(later(&[0, 1, 2, 99, 14, 15]), Finding::Mixture, "putting it back broke off");
        assert_eq!(later(&[0, 11, 12, 98, 14, 15]), Finding::SomebodyElses);
    }

    #[test]
    fn an_empty_plan_is_put_back_only_where_it_is_known_to_be_our_doing() {
        assert_eq!(found(&[], Suspect::Ourselves), Finding::Mixture);
        assert_eq!(found(&[0], Suspect::Anybody), Finding::Mixture, "cut by a failed upload");
        for plan in [MissionType::Mission, MissionType::Fence] {
            let mut record = record(plan);
            let empty = |record: &Record, vehicle: VehicleId| {
                finding(&vehicle, record, &[], Suspect::Anybody)
            };
            assert_eq!(empty(&record, vehicle(5)), Finding::Mixture, "ArduPilot erases some");
            assert_eq!(empty(&record, vehicle(0)), Finding::SomebodyElses, "who is that?");
            record.vehicle.autopilot = Autopilot::Px4;
            let px4 = VehicleId { autopilot: Autopilot::Px4, ..vehicle(5) };
            assert_eq!(empty(&record, px4), Finding::SomebodyElses, "cleared by somebody");
        }
    }
}

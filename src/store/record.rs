//! One upload on disk: what the vehicle held, what it was to hold, and how that ended.

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use sha2::{Digest, Sha256};

use crate::link::SystemId;
use crate::mission::{Command, Frame, MissionItem, MissionType};
use crate::vehicle::identity::UidError;
use crate::vehicle::{Autopilot, Uid, VehicleId};

/// How an upload ended, as far as is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Outcome {
    /// Begun; the vehicle may hold the old plan, the new one, or parts of both.
    Started,
    /// The vehicle holds the new plan: read back and compared.
    Verified,
    /// The vehicle holds the plan it held before: read back and compared.
    Restored,
    /// Somebody else has put another plan there since; it was left alone.
    Superseded,
}

/// One upload. All lists are in the vehicle's own numbering, bit by bit as downloaded or sent.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// Rises with each record of a store.
    pub number: u32,
    /// How it ended.
    pub outcome: Outcome,
    /// Which vehicle.
    pub vehicle: VehicleId,
    /// Which of its plans.
    pub mission_type: MissionType,
    /// When it began, seconds since 1970 by this machine's clock.
    pub began: u64,
    /// The pilot's own plan.
    pub original: Vec<MissionItem>,
    /// What the vehicle held right before the upload, and gets back if that fails: the pilot's
    /// own plan, or an earlier one of quavd's.
    pub before: Vec<MissionItem>,
    /// What is uploaded.
    pub intended: Vec<MissionItem>,
    /// What was read back when the new plan was proven. It differs from [`Record::intended`] where
    /// the autopilot's storage does not keep everything.
    pub read_back: Option<Vec<MissionItem>>,
    /// What was on the vehicle before the old plan was put back, where that was not only parts of
    /// the two.
    pub found: Option<Vec<MissionItem>>,
}

/// Why a file is no record.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// Not the JSON that was written.
    #[error("not a record of an upload: {0}")]
    Format(#[from] serde_json::Error),
    /// Written by another version.
    #[error("written in format {0}, which this version does not know")]
    Version(u32),
    /// Changed since it was written.
    #[error("its checksum is wrong: the file was damaged")]
    Checksum,
    /// The number of a flight controller is none.
    #[error("its vehicle is {0}")]
    Uid(#[from] UidError),
}

const VERSION: u32 = 1;

impl Record {
    /// The bytes to store.
    ///
    /// # Errors
    /// [`RecordError::Format`]; no record that can exist makes this fail.
    pub fn to_json(&self) -> Result<Vec<u8>, RecordError> {
        let upload = Upload::from(self);
        let sha256 = checksum(&upload)?;
        Ok(serde_json::to_vec_pretty(&File { version: VERSION, sha256, upload })?)
    }

    /// Reads what [`Record::to_json`] wrote.
    ///
    /// # Errors
    /// [`RecordError`] where it is not that, to the last bit.
    pub fn from_json(bytes: &[u8]) -> Result<Self, RecordError> {
        #[derive(Deserialize)]
        struct Version {
            version: u32,
        }
        let Version { version } = serde_json::from_slice(bytes)?;
        if version != VERSION {
            return Err(RecordError::Version(version));
        }
        let File { sha256, upload, .. } = serde_json::from_slice(bytes)?;
        if checksum(&upload)? != sha256 {
            return Err(RecordError::Checksum);
        }
        upload.try_into()
    }
}

/// SHA-256 over the compact JSON, in hexadecimal.
fn checksum(upload: &Upload) -> Result<String, RecordError> {
    let digest = Sha256::digest(serde_json::to_vec(upload)?);
    Ok(digest.iter().map(|byte| format!("{byte:02x}")).collect())
}

#[derive(Serialize, Deserialize)]
struct File {
    version: u32,
    sha256: String,
    upload: Upload,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Upload {
    number: u32,
    outcome: Outcome,
    system_id: u8,
    mav_autopilot: u8,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    uid: Option<String>,
    #[serde(with = "MissionTypeName")]
    mission_type: MissionType,
    began: u64,
    original: Vec<Item>,
    /// Left out where it is the original.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    before: Option<Vec<Item>>,
    intended: Vec<Item>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    read_back: Option<Vec<Item>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    found: Option<Vec<Item>>,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "MissionType", rename_all = "lowercase")]
enum MissionTypeName {
    Mission,
    Fence,
    Rally,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Item {
    seq: u16,
    frame: u8,
    command: u16,
    current: u8,
    autocontinue: u8,
    params: [ExactF32; 4],
    x: i32,
    y: i32,
    z: ExactF32,
}

/// An `f32` that keeps every bit: a JSON number where that reads back as the same bits, else (NaN,
/// infinities) its bits as a hexadecimal string.
#[derive(Clone, Copy)]
struct ExactF32(f32);

impl Serialize for ExactF32 {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let read_back = serde_json::to_string(&self.0)
            .ok()
            .and_then(|text| serde_json::from_str::<f64>(&text).ok())
            .map(|value| (value as f32).to_bits());
        if read_back == Some(self.0.to_bits()) {
            serializer.serialize_f32(self.0)
        } else {
            serializer.serialize_str(&format!("{:08x}", self.0.to_bits()))
        }
    }
}

impl<'de> Deserialize<'de> for ExactF32 {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged)]
        enum Number {
            Value(f64),
            Bits(String),
        }
        match Number::deserialize(deserializer)? {
            Number::Value(value) => Ok(Self(value as f32)),
            Number::Bits(bits) => u32::from_str_radix(&bits, 16)
                .map(|bits| Self(f32::from_bits(bits)))
                .map_err(serde::de::Error::custom),
        }
    }
}

impl From<&MissionItem> for Item {
    fn from(item: &MissionItem) -> Self {
        Self {
            seq: item.seq,
            frame: item.frame.0,
            command: item.command.0,
            current: item.current,
            autocontinue: item.autocontinue,
            params: item.params.map(ExactF32),
            x: item.x,
            y: item.y,
            z: ExactF32(item.z),
        }
    }
}

impl From<Item> for MissionItem {
    fn from(item: Item) -> Self {
        Self {
            seq: item.seq,
            frame: Frame(item.frame),
            command: Command(item.command),
            current: item.current,
            autocontinue: item.autocontinue,
            params: item.params.map(|ExactF32(value)| value),
            x: item.x,
            y: item.y,
            z: item.z.0,
        }
    }
}

fn to_items(items: &[MissionItem]) -> Vec<Item> {
    items.iter().map(Item::from).collect()
}

fn from_items(items: Vec<Item>) -> Vec<MissionItem> {
    items.into_iter().map(MissionItem::from).collect()
}

impl From<&Record> for Upload {
    fn from(record: &Record) -> Self {
        Self {
            number: record.number,
            outcome: record.outcome,
            system_id: record.vehicle.system.0,
            mav_autopilot: record.vehicle.autopilot.number(),
            uid: record.vehicle.uid.map(|uid| uid.to_string()),
            mission_type: record.mission_type,
            began: record.began,
            original: to_items(&record.original),
            // A NaN makes equal lists unequal; they are then written twice, which is no harm.
            before: (record.before != record.original).then(|| to_items(&record.before)),
            intended: to_items(&record.intended),
            read_back: record.read_back.as_deref().map(to_items),
            found: record.found.as_deref().map(to_items),
        }
    }
}

impl TryFrom<Upload> for Record {
    type Error = RecordError;

    fn try_from(upload: Upload) -> Result<Self, RecordError> {
        let uid = upload.uid.map(|text| text.parse::<Uid>()).transpose()?;
        let original = from_items(upload.original);
        Ok(Self {
            number: upload.number,
            outcome: upload.outcome,
            vehicle: VehicleId {
                system: SystemId(upload.system_id),
                autopilot: Autopilot::from(upload.mav_autopilot),
                uid,
            },
            mission_type: upload.mission_type,
            began: upload.began,
            before: upload.before.map_or_else(|| original.clone(), from_items),
            original,
            intended: from_items(upload.intended),
            read_back: upload.read_back.map(from_items),
            found: upload.found.map(from_items),
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn item() -> impl Strategy<Value = MissionItem> {
        (any::<[u32; 5]>(), any::<[u16; 2]>(), any::<[u8; 3]>(), any::<[i32; 2]>()).prop_map(
            |(floats, [seq, command], [frame, current, autocontinue], [x, y])| {
                let [p1, p2, p3, p4, z] = floats.map(f32::from_bits);
                MissionItem {
                    seq,
                    frame: Frame(frame),
                    command: Command(command),
                    current,
                    autocontinue,
                    params: [p1, p2, p3, p4],
                    x,
                    y,
                    z,
                }
            },
        )
    }

    fn record(original: Vec<MissionItem>, before: Vec<MissionItem>) -> Record {
        Record {
            number: 3,
            outcome: Outcome::Started,
            vehicle: VehicleId {
                system: SystemId(7),
                autopilot: Autopilot::Px4,
                uid: Uid::from_version(9, [0; 18]),
            },
            mission_type: MissionType::Fence,
            began: 1_700_000_000,
            intended: original.iter().rev().copied().collect(),
            read_back: Some(before.clone()),
            found: (!original.is_empty()).then(|| original.clone()),
            original,
            before,
        }
    }

    fn bits(items: &[MissionItem]) -> Vec<[u32; 5]> {
        let of = |item: &MissionItem| {
            let [a, b, c, d] = item.params.map(f32::to_bits);
            [a, b, c, d, item.z.to_bits()]
        };
        items.iter().map(of).collect()
    }

    proptest! {
        #[test]
        fn every_bit_of_every_item_comes_back(
            original in prop::collection::vec(item(), 0..6),
            before in prop::collection::vec(item(), 0..6),
        ) {
            let written = record(original, before);
            let read = Record::from_json(&written.to_json().unwrap()).unwrap();
            prop_assert_eq!(bits(&read.original), bits(&written.original));
            prop_assert_eq!(bits(&read.before), bits(&written.before));
            prop_assert_eq!(bits(&read.intended), bits(&written.intended));
            prop_assert_eq!(read.vehicle, written.vehicle);
            for (read, written) in
                [(&read.read_back, &written.read_back), (&read.found, &written.found)]
            {
                prop_assert_eq!(read.as_deref().map(bits), written.as_deref().map(bits));
            }
            let plain = |record: &Record| {
                let ints = |item: &MissionItem| {
                    (item.seq, item.frame, item.command, item.current, item.autocontinue, item.e7())
                };
                let lists = [&record.original, &record.before, &record.intended];
                lists.map(|list| list.iter().map(ints).collect::<Vec<_>>())
            };
            prop_assert_eq!(plain(&read), plain(&written));
        }
    }

    #[test]
    fn ordinary_numbers_are_readable_and_nan_is_not_lost() {
        let mut item = MissionItem {
            seq: 0,
            frame: Frame::GLOBAL,
            command: Command::NAV_WAYPOINT,
            current: 0,
            autocontinue: 1,
            params: [0.0, -0.0, 1.5, f32::from_bits(0xffc0_0001)],
            x: 1,
            y: 2,
            z: 30.12,
        };
        let json = String::from_utf8(record(vec![item], vec![]).to_json().unwrap()).unwrap();
        assert!(json.contains("30.12") && json.contains("\"ffc00001\""), "{json}");
        item.z = 30.13;
        assert!(
            !String::from_utf8(record(vec![item], vec![]).to_json().unwrap())
                .unwrap()
                .contains("30.12")
        );
    }

    #[test]
    fn a_damaged_record_is_refused() {
        let json = String::from_utf8(record(vec![], vec![]).to_json().unwrap()).unwrap();
        let changed = json.replace("\"system_id\": 7", "\"system_id\": 8");
        assert!(matches!(Record::from_json(changed.as_bytes()), Err(RecordError::Checksum)));
        let half = &json.as_bytes()[..json.len() / 2];
        assert!(matches!(Record::from_json(half), Err(RecordError::Format(_))));
        let newer = json.replace("\"version\": 1", "\"version\": 2");
        assert!(matches!(Record::from_json(newer.as_bytes()), Err(RecordError::Version(2))));
    }
}

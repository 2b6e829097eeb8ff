use mavlink::dialects::ardupilotmega as dialect;

use super::*;

const TARGET: Node = Node { system: SystemId(7), component: ComponentId(195) };

fn payload(message: &impl MessageData) -> Vec<u8> {
    let mut bytes = [0; 255];
    let length = message.ser(MavlinkVersion::V2, &mut bytes);
    bytes[..length].to_vec()
}

/// Reads with the generated type what our type wrote, and the other way round.
fn agrees<Ours, Theirs>(ours: Ours) -> Theirs
where
    Ours: MessageData + PartialEq + std::fmt::Debug,
    Theirs: MessageData,
{
    assert_eq!(Ours::ID, Theirs::ID);
    assert_eq!(Ours::EXTRA_CRC, Theirs::EXTRA_CRC);
    assert_eq!(Ours::ENCODED_LEN, Theirs::ENCODED_LEN);
    let theirs = Theirs::deser(MavlinkVersion::V2, &payload(&ours)).unwrap();
    assert_eq!(Ours::deser(MavlinkVersion::V2, &payload(&theirs)).unwrap(), ours);
    theirs
}

#[test]
fn an_item_has_the_layout_of_the_dialect() {
    let ours = MissionItemInt {
        item: MissionItem {
            seq: 300,
            frame: Frame::GLOBAL_RELATIVE_ALT_INT,
            command: Command::NAV_LOITER_TIME,
            current: 1,
            autocontinue: 1,
            params: [1.5, -2.0, 3.25, 4.0],
            x: 221_965_146,
            y: -1_135_411_031,
            z: 12.5,
        },
        target: TARGET,
        mission_type: 1,
    };
    let theirs: dialect::MISSION_ITEM_INT_DATA = agrees(ours);
    assert_eq!(
        (theirs.seq, theirs.x, theirs.y, theirs.z),
        (300, 221_965_146, -1_135_411_031, 12.5)
    );
    assert_eq!((theirs.param1, theirs.param4), (1.5, 4.0));
    assert_eq!((theirs.target_system, theirs.target_component), (7, 195));
    assert_eq!(theirs.command, dialect::MavCmd::MAV_CMD_NAV_LOITER_TIME);
}

#[test]
#[allow(deprecated)] // MISSION_REQUEST, which ArduPilot sends to this day
fn the_rest_of_the_mission_protocol_has_the_layout_of_the_dialect() {
    agrees::<_, dialect::MISSION_REQUEST_LIST_DATA>(MissionRequestList {
        target: TARGET,
        mission_type: 2,
    });
    agrees::<_, dialect::MISSION_CLEAR_ALL_DATA>(MissionClearAll {
        target: TARGET,
        mission_type: 2,
    });
    let count = MissionCount { count: 513, target: TARGET, mission_type: 1, opaque_id: 9 };
    let theirs: dialect::MISSION_COUNT_DATA = agrees(count);
    assert_eq!((theirs.count, theirs.opaque_id), (513, 9));
    let request = MissionRequestInt { seq: 258, target: TARGET, mission_type: 1 };
    agrees::<_, dialect::MISSION_REQUEST_INT_DATA>(request);
    agrees::<_, dialect::MISSION_REQUEST_DATA>(MissionRequest(request));
    let ack = MissionAck { target: TARGET, result: 13, mission_type: 1, opaque_id: 77 };
    let theirs: dialect::MISSION_ACK_DATA = agrees(ack);
    assert_eq!(theirs.opaque_id, 77);
}

#[test]
fn the_other_messages_have_the_layout_of_the_dialect() {
    agrees::<_, dialect::HEARTBEAT_DATA>(Heartbeat {
        custom_mode: 3,
        kind: 2,
        autopilot: 3,
        base_mode: 128 | 1,
        system_status: 4,
    });
    let ack = CommandAck { command: 512, result: 5, progress: 40, target: TARGET };
    let theirs: dialect::COMMAND_ACK_DATA = agrees(ack);
    assert_eq!(theirs.progress, 40);
    let long = CommandLong { param1: 148.0, command: 512, target: TARGET, confirmation: 2 };
    let theirs: dialect::COMMAND_LONG_DATA = agrees(long);
    assert_eq!((theirs.param1, theirs.confirmation), (148.0, 2));
    agrees::<_, dialect::COMMAND_INT_DATA>(CommandInt(CommandLong { confirmation: 0, ..long }));
    let text = StatusText { severity: 4, text: [b'x'; 50], id: 5, chunk: 2 };
    agrees::<_, dialect::STATUSTEXT_DATA>(text);
    let plan_ids = [7, 8, 1 << 31];
    let current = MissionCurrent { seq: 4, total: 9, state: 3, mode: 1, plan_ids };
    let theirs: dialect::MISSION_CURRENT_DATA = agrees(current);
    assert_eq!((theirs.seq, theirs.total), (4, 9));
    assert_eq!([theirs.mission_id, theirs.fence_id, theirs.rally_points_id], plan_ids);
}

#[test]
fn an_item_of_an_unknown_command_and_frame_with_a_nan_survives() {
    let ours = MissionItemInt {
        item: MissionItem {
            seq: 0,
            frame: Frame(99),
            command: Command(60_001),
            current: 0,
            autocontinue: 7,
            params: [f32::from_bits(0x7fc0_1234), f32::INFINITY, -0.0, 0.0],
            x: i32::MIN,
            y: i32::MAX,
            z: f32::NAN,
        },
        target: TARGET,
        mission_type: 0,
    };
    let read = MissionItemInt::deser(MavlinkVersion::V2, &payload(&ours)).unwrap();
    assert_eq!(read.encode(), ours.encode());
}

#[test]
fn the_parameter_messages_have_the_layout_of_the_dialect() {
    let name = ParamName::new("FENCE_ALT_MAX_16").unwrap();
    let request = ParamRequestRead { target: TARGET, index: -1, name };
    let theirs: dialect::PARAM_REQUEST_READ_DATA = agrees(request);
    assert_eq!((theirs.param_index, theirs.param_id.to_str()), (-1, Ok("FENCE_ALT_MAX_16")));
    let bits = 100.5_f32.to_bits();
    let value = ParamValue { bits, count: 900, index: 65_535, name, kind: 9 };
    let theirs: dialect::PARAM_VALUE_DATA = agrees(value);
    assert_eq!((theirs.param_value, theirs.param_count), (100.5, 900));
    let error = ParamError { target: TARGET, index: -1, name, error: 1 };
    let theirs: dialect::PARAM_ERROR_DATA = agrees(error);
    assert_eq!(theirs.error, dialect::MavParamError::MAV_PARAM_ERROR_DOES_NOT_EXIST);
}

#[test]
fn a_parameter_name_is_1_to_16_characters_and_ends_at_a_zero() {
    assert!(ParamName::new("").is_none());
    assert!(ParamName::new("SEVENTEEN_LETTERS").is_none());
    assert!(ParamName::new("WITH SPACE").is_none());
    let padded = ParamName::decode(&Fields(b"GF_ACTION\0rubbish"), 0);
    assert_eq!(padded, ParamName::new("GF_ACTION").unwrap());
    assert_eq!(padded.to_string(), "GF_ACTION");
}

#[test]
fn a_file_transfer_has_the_layout_of_the_guide() {
    let mut data = [0; FileTransfer::MOST_DATA];
    data[238] = 9;
    let ours = FileTransfer {
        target: TARGET,
        seq: 0x0201,
        session: 3,
        opcode: 4,
        size: 239,
        req_opcode: 6,
        offset: 0x0d0c_0b0a,
        data,
    };
    let theirs: dialect::FILE_TRANSFER_PROTOCOL_DATA = agrees(ours);
    assert_eq!((theirs.target_system, theirs.target_component), (7, 195));
    let head = [1, 2, 3, 4, 239, 6, 0, 0, 10, 11, 12, 13, 0];
    assert_eq!(theirs.payload[..13], head);
    assert_eq!(theirs.payload[250], 9);
    assert_eq!(FileTransfer { size: 255, ..ours }.bytes().len(), 239, "a lie about the size");
}

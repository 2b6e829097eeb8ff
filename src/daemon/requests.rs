//! What others ask of quavd as a MAVLink component: which frames are meant for it, and what it
//! answers at once. What takes longer is handed on as a [`Request`].

use mavlink::MessageData;
use mavlink::dialects::ardupilotmega::{
    AUTOPILOT_VERSION_DATA, MavProtocolCapability, PARAM_REQUEST_LIST_DATA,
};

use super::own::Own;
use crate::link::message::{CommandAck, CommandInt, CommandLong, ParamRequestRead, ParamSet};
use crate::link::{Link, LinkError, Node, Received};

/// `MAV_CMD_REQUEST_MESSAGE`.
const REQUEST_MESSAGE: u16 = 512;
/// `MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES`, the older way to ask for AUTOPILOT_VERSION.
const REQUEST_CAPABILITIES: u16 = 520;

/// What somebody wants of the daemon.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Request {
    /// To plan now, and to be told how it went.
    Plan(Asker),
    /// One of its parameters has been set to another value.
    Set,
    /// A parameter was set to what it cannot be.
    BadValue(String),
}

/// Who asked by which command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Asker {
    pub(super) node: Node,
    pub(super) command: u16,
}

impl Asker {
    /// The answer to the command.
    pub(super) fn ack(self, result: u8, progress: u8) -> CommandAck {
        CommandAck { command: self.command, result, progress, target: self.node }
    }
}

/// Answers a frame that is meant for us, or hands on what it asks for.
pub(super) async fn answer(
    link: &Link,
    own: &mut Own,
    frame: &Received,
) -> Result<Option<Request>, LinkError> {
    let us = link.node();
    let exactly = |node: Node| node == us;
    let also = |node: Node| {
        (node.system == us.system || node.system.0 == 0)
            && (node.component == us.component || node.component.0 == 0)
    };
    if let Some(command) = command_in(frame) {
        return answer_command(link, own, frame, command, exactly(command.target), also).await;
    }
    if let Some(asked) = frame.decode::<PARAM_REQUEST_LIST_DATA>() {
        if also(node(asked.target_system, asked.target_component)) {
            for value in own.all() {
                link.send(&value).await?;
            }
        }
    } else if let Some(asked) = frame.decode::<ParamRequestRead>() {
        if exactly(asked.target) {
            let value = match usize::try_from(asked.index) {
                Ok(index) => own.by_index(index),
                Err(_) => own.by_name(asked.name),
            };
            if let Some(value) = value {
                link.send(&value).await?;
            }
        }
    } else if let Some(set) = frame.decode::<ParamSet>()
        && exactly(set.target)
    {
        let outcome = own.set(set.name, f32::from_bits(set.bits));
        // The value that holds now is the answer, also to one that was refused.
        if let Some(value) = own.by_name(set.name) {
            link.send(&value).await?;
        }
        return Ok(match outcome {
            Ok(true) => Some(Request::Set),
            Ok(false) => None,
            Err(why) => Some(Request::BadValue(why)),
        });
    }
    Ok(None)
}

fn node(system: u8, component: u8) -> Node {
    Node { system: crate::link::SystemId(system), component: crate::link::ComponentId(component) }
}

fn command_in(frame: &Received) -> Option<CommandLong> {
    match frame.message_id() {
        CommandLong::ID => frame.decode(),
        CommandInt::ID => frame.decode::<CommandInt>().map(|CommandInt(command)| command),
        _ => None,
    }
}

async fn answer_command(
    link: &Link,
    own: &Own,
    frame: &Received,
    command: CommandLong,
    for_us_alone: bool,
    also: impl Fn(Node) -> bool,
) -> Result<Option<Request>, LinkError> {
    let asker = Asker { node: frame.from, command: command.command };
    if command.command == own.options.service.plan_command() && also(command.target) {
        return Ok(Some(Request::Plan(asker)));
    }
    let message = match command.command {
        REQUEST_MESSAGE => command.param1 as u32,
        REQUEST_CAPABILITIES => AUTOPILOT_VERSION_DATA::ID,
        _ => 0,
    };
    let told = also(command.target) && tell(link, message).await?;
    // What is meant for everybody and nothing to us is somebody else's to refuse.
    if told || for_us_alone {
        let result = if told { CommandAck::ACCEPTED } else { CommandAck::UNSUPPORTED };
        link.send(&asker.ack(result, 255)).await?;
    }
    Ok(None)
}

/// Sends a message that was asked for. `false` where it is none that we have.
async fn tell(link: &Link, message: u32) -> Result<bool, LinkError> {
    if message != AUTOPILOT_VERSION_DATA::ID {
        return Ok(false);
    }
    link.send(&version()).await?;
    Ok(true)
}

/// AUTOPILOT_VERSION of a component that has parameters and takes no missions.
fn version() -> AUTOPILOT_VERSION_DATA {
    let part = |text: &str| text.parse::<u32>().unwrap_or(0) & 0xff;
    let version = (part(env!("CARGO_PKG_VERSION_MAJOR")) << 24)
        | (part(env!("CARGO_PKG_VERSION_MINOR")) << 16)
        | (part(env!("CARGO_PKG_VERSION_PATCH")) << 8)
        // FIRMWARE_VERSION_TYPE_OFFICIAL.
        | 255;
    AUTOPILOT_VERSION_DATA {
        capabilities: MavProtocolCapability::MAV_PROTOCOL_CAPABILITY_MAVLINK2
            | MavProtocolCapability::MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST,
        flight_sw_version: version,
        ..AUTOPILOT_VERSION_DATA::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::frame::Packet;
    use crate::link::message::ParamName;

    #[test]
    fn the_name_of_a_parameter_to_set_is_read_as_it_was_written() {
        let name = ParamName::new("QUAV_BUFFER").unwrap();
        let set = ParamSet { bits: 7.5_f32.to_bits(), target: node(1, 195), name, kind: 9 };
        let frame = Received::from_packet(node(255, 190), &Packet::new(&set));
        assert_eq!(frame.decode::<ParamSet>(), Some(set));
    }

    #[test]
    fn our_version_says_which_release_and_that_parameters_are_floats() {
        let version = version();
        assert_eq!(version.flight_sw_version & 0xff, 255);
        assert_ne!(version.capabilities.bits() & (1 << 17), 0, "PARAM_ENCODE_C_CAST");
    }
}

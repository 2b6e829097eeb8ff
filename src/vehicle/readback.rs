//! Does the vehicle hold what it was sent? Field by field, and nothing is excused but what the
//! autopilots are known to do to an item on its way through their storage.

use std::fmt;

use super::discovery::Autopilot;
use crate::mission::{Command, Frame, MissionItem, MissionType};

/// One field that is not as it was sent.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// The item, in the vehicle's numbering.
    pub seq: usize,
    /// Which of its fields.
    pub field: Field,
    /// What was sent.
    pub sent: String,
    /// What the vehicle holds.
    pub held: String,
}

/// A part of a plan that can differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Field {
    /// The number of items.
    Count,
    /// `seq`.
    Seq,
    /// `command`.
    Command,
    /// `frame`.
    Frame,
    /// `param1` (0) to `param4` (3).
    Param(usize),
    /// `x`, latitude times 1e7.
    X,
    /// `y`, longitude times 1e7.
    Y,
    /// `z`, altitude in metres.
    Z,
    /// `autocontinue`.
    Autocontinue,
}

impl fmt::Display for Field {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Count => f.write_str("count"),
            Self::Seq => f.write_str("seq"),
            Self::Command => f.write_str("command"),
            Self::Frame => f.write_str("frame"),
            Self::Param(k) => write!(f, "param{}", k + 1),
            Self::X => f.write_str("x"),
            Self::Y => f.write_str("y"),
            Self::Z => f.write_str("z"),
            Self::Autocontinue => f.write_str("autocontinue"),
        }
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.field {
            Field::Count => write!(f, "{} items sent, {} held", self.sent, self.held),
            field => {
                write!(f, "item {} {field}: {} sent, {} held", self.seq, self.sent, self.held)
            }
        }
    }
}

/// All differences between what was sent and what the vehicle holds, in the order of the items.
/// None: the vehicle holds it.
///
/// Excused, per autopilot (as read in their sources and seen in ArduCopter 4.7):
/// - both: `current`, which is the vehicle's state and not the plan's content; a frame and its
///   `_INT` twin, which mean the same in a MISSION_ITEM_INT;
/// - ArduPilot: home in slot 0 of a mission; altitudes to the centimetre, those of rally points to
///   the metre; `autocontinue`; the frame, position and altitude of commands that have no place; in
///   navigation commands the parameters that it drops or packs (`ardupilot_keeps` below); in a fence
///   everything but command, position and `param1`;
/// - PX4: yaw, kept in radians; in a fence all that a fence item has no use for.
#[must_use]
pub fn differences(
    autopilot: Autopilot,
    mission_type: MissionType,
    sent: &[MissionItem],
    held: &[MissionItem],
) -> Vec<Difference> {
    found(Plan { autopilot, mission_type, exact: false }, sent, held)
}

/// All changes between two downloads of a plan, in the order of the items. Both have been through
/// the vehicle's storage, so nothing is excused but what is no content of a plan: `current`, and
/// ArduPilot's home in slot 0 of a mission.
#[must_use]
pub fn changes(
    autopilot: Autopilot,
    mission_type: MissionType,
    earlier: &[MissionItem],
    now: &[MissionItem],
) -> Vec<Difference> {
    found(Plan { autopilot, mission_type, exact: true }, earlier, now)
}

/// Which plan of whom is compared, and how.
#[derive(Clone, Copy)]
struct Plan {
    autopilot: Autopilot,
    mission_type: MissionType,
    /// Nothing is excused.
    exact: bool,
}

fn found(plan: Plan, sent: &[MissionItem], held: &[MissionItem]) -> Vec<Difference> {
    let mut found = Vec::new();
    let has_home_slot =
        plan.autopilot == Autopilot::ArduPilot && plan.mission_type == MissionType::Mission;
    if has_home_slot && sent.len() <= 1 && held.len() <= 1 {
        // No commands, whether home is counted or not.
        return found;
    }
    if sent.len() != held.len() {
        found.push(Difference {
            seq: sent.len().min(held.len()),
            field: Field::Count,
            sent: sent.len().to_string(),
            held: held.len().to_string(),
        });
    }
    for (seq, (sent, held)) in sent.iter().zip(held).enumerate() {
        if !(has_home_slot && seq == 0) {
            compare(plan, seq, sent, held, &mut found);
        }
    }
    found
}

fn compare(
    plan: Plan,
    seq: usize,
    sent: &MissionItem,
    held: &MissionItem,
    found: &mut Vec<Difference>,
) {
    let rules = Rules { plan, command: sent.command };
    let mut check = |same: bool, field: Field, sent: &dyn fmt::Display, held: &dyn fmt::Display| {
        if !same {
            found.push(Difference { seq, field, sent: sent.to_string(), held: held.to_string() });
        }
    };
    check(usize::from(held.seq) == seq, Field::Seq, &seq, &held.seq);
    check(sent.command == held.command, Field::Command, &sent.command.0, &held.command.0);
    check(rules.same_frame(sent.frame, held.frame), Field::Frame, &sent.frame.0, &held.frame.0);
    for k in 0..4 {
        let (sent, held) = (sent.params[k], held.params[k]);
        check(rules.same_param(k, sent, held), Field::Param(k), &sent, &held);
    }
    check(rules.same_place(sent.x, held.x), Field::X, &sent.x, &held.x);
    check(rules.same_place(sent.y, held.y), Field::Y, &sent.y, &held.y);
    check(rules.same_altitude(sent.z, held.z), Field::Z, &sent.z, &held.z);
    check(
        rules.same_autocontinue(sent.autocontinue, held.autocontinue),
        Field::Autocontinue,
        &sent.autocontinue,
        &held.autocontinue,
    );
}

/// What counts as the same, for one item.
struct Rules {
    plan: Plan,
    command: Command,
}

impl Rules {
    fn is_ardupilot(&self) -> bool {
        self.plan.autopilot == Autopilot::ArduPilot
    }

    /// ArduPilot keeps no frame, position or altitude with a mission command that has no place.
    fn has_no_place(&self) -> bool {
        self.is_ardupilot()
            && self.plan.mission_type == MissionType::Mission
            && !ARDUPILOT_WITH_PLACE.contains(&self.command.0)
    }

    fn same_frame(&self, sent: Frame, held: Frame) -> bool {
        if self.plan.exact {
            return sent == held;
        }
        let either_global = sent.is_global() && held.is_global();
        plain(sent) == plain(held)
            || self.has_no_place()
            || (self.plan.mission_type == MissionType::Fence && either_global)
            // ArduPilot reads frame 2 with a place as altitude above mean sea level.
            || (self.is_ardupilot() && sent == Frame::MISSION && plain(held) == Frame::GLOBAL)
    }

    fn same_place(&self, sent: i32, held: i32) -> bool {
        sent == held || (!self.plan.exact && self.has_no_place() && held == 0)
    }

    fn same_altitude(&self, sent: f32, held: f32) -> bool {
        if self.plan.exact || same_number(sent, held) {
            return same_number(sent, held);
        }
        if self.has_no_place() && held == 0.0 {
            return true;
        }
        match self.plan.mission_type {
            MissionType::Fence => held == 0.0,
            // Cut to whole centimetres, or metres, towards zero; the rest is f32's own rounding.
            MissionType::Mission => self.is_ardupilot() && cut_to(0.01, sent, held),
            MissionType::Rally => self.is_ardupilot() && cut_to(1.0, sent, held),
        }
    }

    fn same_autocontinue(&self, sent: u8, held: u8) -> bool {
        let excused = self.is_ardupilot() || self.plan.mission_type == MissionType::Fence;
        sent == held || (!self.plan.exact && excused)
    }

    fn same_param(&self, k: usize, sent: f32, held: f32) -> bool {
        if self.plan.exact || same_number(sent, held) {
            return same_number(sent, held);
        }
        match (self.plan.mission_type, self.plan.autopilot) {
            (MissionType::Fence, _) => k > 0 && held == 0.0,
            (MissionType::Rally, _) => held == 0.0,
            (MissionType::Mission, Autopilot::ArduPilot) => {
                let keeps = ardupilot_keeps(self.command);
                keeps.is_some_and(|keeps| keeps[k].allows(sent, held))
            }
            (MissionType::Mission, Autopilot::Px4) => {
                k == 3 && PX4_WITH_YAW.contains(&self.command) && same_angle(sent, held)
            }
            (MissionType::Mission, Autopilot::Other(_)) => false,
        }
    }
}

/// Equal as numbers (so 0 and -0 are one), or the same NaN or infinity.
fn same_number(a: f32, b: f32) -> bool {
    a == b || (a.is_nan() && b.is_nan())
}

fn plain(frame: Frame) -> Frame {
    match frame {
        Frame::GLOBAL_INT => Frame::GLOBAL,
        Frame::GLOBAL_RELATIVE_ALT_INT => Frame::GLOBAL_RELATIVE_ALT,
        Frame::GLOBAL_TERRAIN_ALT_INT => Frame::GLOBAL_TERRAIN_ALT,
        other => other,
    }
}

/// Whether `held` is `sent` cut to whole `unit`s, towards zero.
fn cut_to(unit: f32, sent: f32, held: f32) -> bool {
    let rounding = 4.0 * f32::EPSILON * sent.abs().max(1.0);
    let cut_off = (sent - held) * 1.0_f32.copysign(sent);
    held * sent >= 0.0 && (-rounding..=unit + rounding).contains(&cut_off)
}

fn same_angle(sent: f32, held: f32) -> bool {
    let apart = (sent - held).rem_euclid(360.0);
    apart.min(360.0 - apart) < 1e-3
}

/// Commands with which PX4 keeps `param4` as a yaw, in radians.
const PX4_WITH_YAW: [Command; 6] = [
    Command::NAV_WAYPOINT,
    Command::NAV_LOITER_UNLIM,
    Command::NAV_LAND,
    Command::NAV_TAKEOFF,
    Command::NAV_VTOL_TAKEOFF,
    Command::NAV_VTOL_LAND,
];

/// Commands with which ArduPilot keeps a location (`AP_Mission::stored_in_location`, and those
/// that keep x and y in another form).
const ARDUPILOT_WITH_PLACE: [u16; 20] =
    [16, 17, 18, 19, 21, 22, 30, 31, 82, 84, 85, 94, 179, 188, 189, 191, 195, 201, 42_702, 43_003];

/// What ArduPilot's storage makes of a parameter, where it does not keep it.
#[derive(Clone, Copy)]
enum Keeps {
    /// Dropped by Copter; Plane keeps a whole number up to 255.
    Nothing,
    /// Cut to a whole number.
    Whole,
    /// A radius in eight bits: whole metres up to 255, then tens of metres; the sign is kept.
    Radius,
    /// Only its sign: 1 or -1.
    Sign,
    /// Only whether it is positive: 1 or 0.
    Positive,
}

impl Keeps {
    fn allows(self, sent: f32, held: f32) -> bool {
        let whole = if sent.is_finite() { sent.trunc() } else { 0.0 };
        match self {
            Self::Nothing => held == 0.0 || held == whole.clamp(0.0, 255.0),
            Self::Whole => held == whole,
            Self::Radius => {
                let tens = (whole.abs() / 10.0).floor().min(255.0) * 10.0;
                held == whole || held == tens.copysign(sent)
            }
            Self::Sign => held == if sent < 0.0 { -1.0 } else { 1.0 },
            Self::Positive => held == if sent > 0.0 { 1.0 } else { 0.0 },
        }
    }
}

/// How ArduPilot packs `param1` to `param4` of navigation commands. `None`: bit by bit.
///
/// quavd sends back what it downloaded and adds plain waypoints, so these few are all that a
/// correct read-back can show.
fn ardupilot_keeps(command: Command) -> Option<[Keeps; 4]> {
    use Keeps::{Nothing, Positive, Radius, Sign, Whole};
    Some(match command {
        Command::NAV_WAYPOINT | Command::NAV_SPLINE_WAYPOINT => [Whole, Nothing, Nothing, Nothing],
        Command::NAV_LOITER_UNLIM => [Nothing, Nothing, Whole, Nothing],
        Command::NAV_LOITER_TURNS => [Whole, Nothing, Radius, Positive],
        Command::NAV_LOITER_TIME => [Whole, Nothing, Sign, Positive],
        Command::NAV_RETURN_TO_LAUNCH => [Nothing; 4],
        Command::NAV_LAND => [Whole, Nothing, Nothing, Sign],
        Command::NAV_TAKEOFF => [Whole, Nothing, Nothing, Nothing],
        Command::NAV_LOITER_TO_ALT => [Nothing, Whole, Nothing, Positive],
        _ => return None,
    })
}

#[cfg(test)]
mod tests;

//! What a mission command means for the path: whether the vehicle goes somewhere, stays, turns
//! home, jumps, or only does something on the way.
//!
//! Sources: MAVLink common and ardupilotmega `MAV_CMD` (`hasLocation`, `isDestination`) and
//! ArduPilot `AP_Mission::is_nav_cmd`. What the items of a mission add up to is in
//! [`super::legs()`].

use super::item::{Command, MissionItem};
use crate::units::Metres;

/// What a command does to the path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Navigation that ends at the item's place, or where the vehicle is when it has none.
    Place(Destination),
    /// Navigation without any place: the vehicle stays where it is (`NAV_DELAY`).
    Hold,
    /// `NAV_RETURN_TO_LAUNCH`: to home, a rally point or the landing sequence.
    Return,
    /// `DO_JUMP`: the next item is the one whose index is in `param1`.
    Jump,
    /// `DO_JUMP_TAG`: the next item is the `JUMP_TAG` with the number in `param1`.
    TagJump,
    /// `JUMP_TAG`: a place in the list that can be jumped to.
    Tag,
    /// `DO_SET_HOME`: where the vehicle returns to from now on.
    SetHome,
    /// The start of a sequence that is entered from anywhere (landing, return path, go-around).
    Entry,
    /// `CONDITION_*`: holds back the actions that follow it, on the way to the next place.
    Condition,
    /// Does something without changing the path (speed, camera, servo, region of interest).
    Action,
    /// Moves the vehicle along a path that the mission does not contain.
    PathNotGiven,
    /// Not known here. Left as it is and assumed not to change the path.
    Unknown,
}

/// What happens at the place of a navigation item.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Destination {
    /// Flown to in a straight line, and on.
    Waypoint,
    /// Flown to and circled (hovered at by some vehicles).
    Loiter,
    /// The vehicle leaves the ground.
    Takeoff,
    /// The vehicle ends on the ground and goes on only by a takeoff.
    Land,
    /// `NAV_PAYLOAD_PLACE`: down to the ground and up again.
    PayloadPlace,
    /// `NAV_SPLINE_WAYPOINT`: reached along a curve.
    Spline,
    /// `NAV_ARC_WAYPOINT`: reached along a circular arc of `param1` degrees.
    Arc,
    /// An unknown navigation command; its place is taken for a waypoint.
    Unknown,
}

impl Role {
    /// Whether the command is one of navigation: it ends the stretch before it.
    #[must_use]
    pub fn is_navigation(self) -> bool {
        matches!(self, Self::Place(_) | Self::Hold | Self::Return | Self::PathNotGiven)
    }

    /// Whether execution can go on elsewhere than at the next item.
    #[must_use]
    pub fn is_jump(self) -> bool {
        matches!(self, Self::Jump | Self::TagJump)
    }
}

impl Command {
    /// What the command does to the path.
    #[must_use]
    pub fn role(self) -> Role {
        use Destination as D;
        match self.0 {
            16 => Role::Place(D::Waypoint),
            17..=19 | 31 => Role::Place(D::Loiter),
            20 => Role::Return,
            21 | 85 => Role::Place(D::Land),
            22 | 84 => Role::Place(D::Takeoff),
            36 => Role::Place(D::Arc),
            82 => Role::Place(D::Spline),
            94 => Role::Place(D::PayloadPlace),
            93 => Role::Hold,
            // LAND_LOCAL, TAKEOFF_LOCAL, FOLLOW, CONTINUE_AND_CHANGE_ALT, DO_FOLLOW,
            // DO_FOLLOW_REPOSITION, DO_ORBIT, DO_FIGURE_EIGHT, ALTITUDE_WAIT, GUIDED_ENABLE,
            // DO_SET_MODE, DO_REPOSITION, NAV_SET_YAW_SPEED, DO_SET_MISSION_CURRENT,
            // OVERRIDE_GOTO, DO_SET_STANDARD_MODE, SET_GUIDED_SUBMODE_*, PAYLOAD_PREPARE_DEPLOY,
            // NAV_SCRIPT_TIME, NAV_ATTITUDE_TIME
            23..=25 | 30 | 32..=35 | 83 | 92 | 176 | 192 | 213 | 224 | 252 | 262 | 4000 | 4001 => {
                Role::PathNotGiven
            }
            30_001 | 42_702 | 42_703 => Role::PathNotGiven,
            177 => Role::Jump,
            601 => Role::TagJump,
            600 => Role::Tag,
            179 => Role::SetHome,
            // DO_RETURN_PATH_START, DO_LAND_START, DO_GO_AROUND
            188 | 189 | 191 => Role::Entry,
            // CONDITION_DELAY, _CHANGE_ALT, _DISTANCE, _YAW, _GATE
            112..=115 | 4501 => Role::Condition,
            // NAV_ROI is a region of interest, not a place to fly to.
            80 | 178 | 180..=187 | 190 | 193..=212 | 214..=218 | 220..=223 | 405 | 511 => {
                Role::Action
            }
            530..=534 | 1000 | 1001 | 2000..=2004 | 2010 | 2500..=2504 | 2510 | 2511 | 2800 => {
                Role::Action
            }
            3000 | 42_007 | 42_600 | 42_701 => Role::Action,
            // WAYPOINT_USER_1 to _5 are navigation by definition, meaning unknown.
            0..=95 | 31_000..=31_004 => Role::Place(D::Unknown),
            _ => Role::Unknown,
        }
    }
}

/// How the vehicle loiters: what the mission itself does not say.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum LoiterHabit {
    /// Not known: circles as far as the items give their radius.
    #[default]
    Unknown,
    /// A vehicle that can hover: it stays at the place, except for `NAV_LOITER_TURNS`.
    Hover {
        /// The radius where an item gives none (`CIRCLE_RADIUS`).
        circle_radius: Metres,
    },
    /// A fixed wing: it always circles.
    Circle {
        /// The radius where an item gives none (`WP_LOITER_RAD`, `NAV_LOITER_RAD`).
        radius: Metres,
    },
}

impl LoiterHabit {
    /// The habit of a kind of vehicle (`MAV_TYPE`), with its own radii where they are known: of a
    /// fixed wing's loiter, and of a multirotor's circle. A VTOL may do either; it is judged as a
    /// fixed wing, whose circle is where a hovering vehicle stays, too.
    #[must_use]
    pub fn of(mav_type: u8, loiter: Option<Metres>, circle: Option<Metres>) -> Self {
        match mav_type {
            // FIXED_WING, VTOL_*
            1 | 19..=25 => loiter.map_or(Self::Unknown, |radius| Self::Circle { radius }),
            // QUADROTOR, COAXIAL, HELICOPTER, HEXAROTOR, OCTOROTOR, TRICOPTER, DODECAROTOR,
            // DECAROTOR. PX4 has one radius for all vehicles.
            2..=4 | 13..=15 | 29 | 35 => circle
                .or(loiter)
                .map_or(Self::Unknown, |circle_radius| Self::Hover { circle_radius }),
            _ => Self::Unknown,
        }
    }
}

/// The radius of the circle around a loiter item's place, from the item and the vehicle's habit;
/// zero for a vehicle that hovers there. The sign of the parameter is the direction only.
///
/// `param3` has the radius, `param2` for `NAV_LOITER_TO_ALT`; 0 or NaN is the vehicle's default.
/// ArduPilot keeps no radius for `NAV_LOITER_TIME`, hands back ±1 for the direction and flies its
/// default, so that the larger of the two is taken.
///
/// `None` where it is the vehicle's default and that is not known.
#[must_use]
pub fn loiter_radius(item: &MissionItem, habit: LoiterHabit) -> Option<Metres> {
    let turns = item.command == Command::NAV_LOITER_TURNS;
    let given = match item.command {
        Command::NAV_LOITER_TO_ALT => item.params[1],
        _ => item.params[2],
    };
    let mut given = if given.is_nan() { 0.0 } else { f64::from(given.abs()) };
    let timed = item.command == Command::NAV_LOITER_TIME;
    if timed && given <= 1.0 {
        given = 0.0;
    }
    match habit {
        LoiterHabit::Hover { .. } if !turns => Some(Metres::ZERO),
        LoiterHabit::Hover { circle_radius } if given == 0.0 => Some(circle_radius),
        LoiterHabit::Circle { radius } if given == 0.0 => Some(radius),
        LoiterHabit::Circle { radius } if timed => Some(radius.max(Metres(given))),
        LoiterHabit::Unknown if given == 0.0 => None,
        _ => Some(Metres(given)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mission::Frame;

    fn item(command: Command, params: [f32; 4]) -> MissionItem {
        MissionItem {
            seq: 0,
            frame: Frame::GLOBAL_RELATIVE_ALT,
            command,
            current: 0,
            autocontinue: 1,
            params,
            x: 0,
            y: 0,
            z: 0.0,
        }
    }

    #[test]
    fn every_command_below_the_last_navigation_command_is_navigation_but_the_region_of_interest() {
        for number in 0..=95 {
            let role = Command(number).role();
            assert_eq!(role.is_navigation(), number != 80, "command {number} is {role:?}");
        }
    }

    #[test]
    fn commands_above_are_navigation_only_where_an_autopilot_treats_them_so() {
        let navigation: Vec<u16> =
            (96..=u16::MAX).filter(|&number| Command(number).role().is_navigation()).collect();
        let expected = [
            176, 192, 213, 224, 252, 262, 4000, 4001, 30_001, 31_000, 31_001, 31_002, 31_003,
            31_004, 42_702, 42_703,
        ];
        assert_eq!(navigation, expected);
    }

    #[test]
    fn the_kind_of_vehicle_says_how_it_loiters() {
        let of = |kind| LoiterHabit::of(kind, Some(Metres(80.0)), Some(Metres(10.0)));
        assert_eq!(of(2), LoiterHabit::Hover { circle_radius: Metres(10.0) });
        assert_eq!(of(1), LoiterHabit::Circle { radius: Metres(80.0) });
        assert_eq!(of(22), LoiterHabit::Circle { radius: Metres(80.0) });
        assert_eq!(of(10), LoiterHabit::Unknown);
        assert_eq!(LoiterHabit::of(1, None, Some(Metres(10.0))), LoiterHabit::Unknown);
        let px4 = LoiterHabit::of(13, Some(Metres(80.0)), None);
        assert_eq!(px4, LoiterHabit::Hover { circle_radius: Metres(80.0) });
    }

    #[test]
    fn the_radius_of_a_loiter_is_that_of_the_item_or_of_the_vehicle() {
        let plane = LoiterHabit::Circle { radius: Metres(60.0) };
        let copter = LoiterHabit::Hover { circle_radius: Metres(10.0) };
        let turns = item(Command::NAV_LOITER_TURNS, [3.0, 0.0, -25.0, 0.0]);
        assert_eq!(loiter_radius(&turns, plane), Some(Metres(25.0)));
        assert_eq!(loiter_radius(&turns, copter), Some(Metres(25.0)));
        let unset = item(Command::NAV_LOITER_TURNS, [3.0, 0.0, f32::NAN, 0.0]);
        assert_eq!(loiter_radius(&unset, plane), Some(Metres(60.0)));
        assert_eq!(loiter_radius(&unset, copter), Some(Metres(10.0)));
        assert_eq!(loiter_radius(&unset, LoiterHabit::Unknown), None);
        let to_alt = item(Command::NAV_LOITER_TO_ALT, [0.0, 80.0, 0.0, 0.0]);
        assert_eq!(loiter_radius(&to_alt, LoiterHabit::Unknown), Some(Metres(80.0)));
        assert_eq!(loiter_radius(&to_alt, copter), Some(Metres::ZERO));
        let time = item(Command::NAV_LOITER_TIME, [9.0, 0.0, -1.0, 0.0]);
        assert_eq!(loiter_radius(&time, plane), Some(Metres(60.0)));
    }
}

"""What sets one autopilot apart from another in numbers: ids, capacities, timers, defaults."""

from dataclasses import dataclass, field

from .dialect import FENCE, MISSION, RALLY, mavlink

INT8, INT32, REAL32 = (mavlink.MAV_PARAM_TYPE_INT8, mavlink.MAV_PARAM_TYPE_INT32, mavlink.MAV_PARAM_TYPE_REAL32)


@dataclass(frozen=True)
class Persona:
    name: str
    autopilot: int
    capacities: dict          # mission type -> most items
    request_again_s: float    # while receiving: ask for the item again
    give_up_s: float          # while receiving (PX4: also sending): abandon the transfer
    modes: dict               # name -> custom_mode
    mission_mode: str         # the mode that flies the mission
    default_mode: str
    base_mode: int            # besides the armed bit
    home: tuple               # lat, lon, AMSL metres
    forwards: bool            # routes between its links by default
    streams_hz: float         # what it streams without being asked, 0 = only heartbeats
    int_params_as_bytes: bool  # PX4 copies the bytes of an INT32 into the float, ArduPilot casts
    flight_version: int       # AUTOPILOT_VERSION.flight_sw_version
    home_is_item_zero: bool
    serves_files: bool        # plans as files over MAVLink FTP
    parameters: dict = field(default_factory=dict)  # name -> (value, MAV_PARAM_TYPE)


def px4_mode(main, sub=0):
    return main << 16 | sub << 24


ARDUPILOT = Persona(
    name="ardupilot",
    autopilot=mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA,
    capacities={MISSION: 650, FENCE: 70, RALLY: 46},
    request_again_s=1.0,
    give_up_s=8.0,
    modes={"STABILIZE": 0, "ALT_HOLD": 2, "AUTO": 3, "GUIDED": 4, "LOITER": 5, "RTL": 6, "LAND": 9, "BRAKE": 17},
    mission_mode="AUTO",
    default_mode="STABILIZE",
    base_mode=mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | mavlink.MAV_MODE_FLAG_STABILIZE_ENABLED,
    home=(-35.3632621, 149.1652374, 584.0),
    forwards=True,
    streams_hz=0.0,
    int_params_as_bytes=False,
    flight_version=4 << 24 | 7 << 16,
    home_is_item_zero=True,
    serves_files=True,
    parameters={
        "FENCE_ENABLE": (0, INT8), "FENCE_TYPE": (7, INT8), "FENCE_ACTION": (1, INT8),
        "FENCE_ALT_MAX": (100.0, REAL32), "FENCE_ALT_MIN": (-10.0, REAL32), "FENCE_RADIUS": (300.0, REAL32),
        "FENCE_MARGIN": (2.0, REAL32), "FENCE_OPTIONS": (1, mavlink.MAV_PARAM_TYPE_INT16),
        "FENCE_TOTAL": (0, INT8), "FENCE_AUTOENABLE": (0, INT8),
        "OA_TYPE": (0, INT8), "OA_MARGIN_MAX": (5.0, REAL32),
        "MIS_TOTAL": (0, mavlink.MAV_PARAM_TYPE_INT16), "MIS_OPTIONS": (0, mavlink.MAV_PARAM_TYPE_INT16),
        "RALLY_TOTAL": (0, INT8), "WPNAV_SPEED": (1000.0, REAL32), "WPNAV_RADIUS": (200.0, REAL32),
        "CIRCLE_RADIUS": (1000.0, REAL32), "RTL_ALT": (1500.0, REAL32), "SYSID_THISMAV": (1, mavlink.MAV_PARAM_TYPE_INT16),
    },
)

PX4 = Persona(
    name="px4",
    autopilot=mavlink.MAV_AUTOPILOT_PX4,
    capacities={MISSION: 2000, FENCE: 64, RALLY: 32},
    request_again_s=0.25,
    give_up_s=5.0,
    modes={"MANUAL": px4_mode(1), "ALTCTL": px4_mode(2), "POSCTL": px4_mode(3), "MISSION": px4_mode(4, 4),
           "LOITER": px4_mode(4, 3), "TAKEOFF": px4_mode(4, 2), "RTL": px4_mode(4, 5), "LAND": px4_mode(4, 6),
           "OFFBOARD": px4_mode(6)},
    mission_mode="MISSION",
    default_mode="POSCTL",
    base_mode=mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED,
    home=(47.397742, 8.545594, 488.0),
    forwards=False,
    streams_hz=1.0,
    int_params_as_bytes=True,
    flight_version=1 << 24 | 16 << 16 | 255,
    home_is_item_zero=False,
    serves_files=False,
    parameters={
        "GF_ACTION": (2, INT32), "GF_MAX_HOR_DIST": (0.0, REAL32), "GF_MAX_VER_DIST": (0.0, REAL32),
        "GF_SOURCE": (0, INT32), "GF_PREDICT": (0, INT32), "NAV_ACC_RAD": (10.0, REAL32),
        "NAV_LOITER_RAD": (80.0, REAL32),
        "MIS_DIST_1WP": (10000.0, REAL32), "MPC_XY_CRUISE": (5.0, REAL32), "MAV_SYS_ID": (1, INT32),
    },
)

PERSONAS = {persona.name: persona for persona in (ARDUPILOT, PX4)}

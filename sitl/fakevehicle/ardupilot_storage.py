"""What ArduPilot (Copter) keeps of an uploaded item, and which items it refuses.

Its storage is lossy: fixed-point altitudes, integer parameters, and only those parameters that the
command uses. `store` turns what came over the link into what a download would give back.
"""

import math
from dataclasses import replace

from .dialect import FENCE, MISSION, RALLY, f32, mavlink
from .items import Item, RAW_XY_COMMANDS, Refused

ALTITUDE_LIMIT_M = 83000.0
FENCE_COMMANDS = range(5000, 5005)

RELATIVE = (mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT)
TERRAIN = (mavlink.MAV_FRAME_GLOBAL_TERRAIN_ALT, mavlink.MAV_FRAME_GLOBAL_TERRAIN_ALT_INT)
ABSOLUTE = (mavlink.MAV_FRAME_GLOBAL, mavlink.MAV_FRAME_GLOBAL_INT)


def _drop(_value):
    return 0.0


def _keep(value):
    return value


def _integer(low, high):
    """A C cast of the float to an integer field (towards zero), kept within its range."""
    return lambda value: float(max(low, min(high, int(value))))


U8, U16, I16 = _integer(0, 255), _integer(0, 65535), _integer(-32768, 32767)
I8 = _integer(-128, 127)


def _sign(value):
    return -1.0 if value < 0 else 1.0


def _flag(value):
    return 1.0 if value > 0 else 0.0


def _radius16(value):
    return math.copysign(U16(abs(value)), value)


def _radius_packed(value):
    """Eight bits: whole metres up to 255, then tens of metres up to 2550."""
    size = int(abs(value))
    size = size if size <= 255 else min(255, size // 10) * 10
    return math.copysign(float(size), value)


_ = _drop
# command -> what happens to param1..param4 on the way through storage
PARAMETERS = {
    16: (U16, _, _, _), 17: (_, _, _radius16, _), 18: (U8, _, _radius_packed, _flag),
    19: (U16, _, _sign, _flag), 20: (_, _, _, _), 21: (U16, _, _, _sign), 22: (U16, _, _, _),
    30: (U16, _, _, _), 31: (_, _radius16, _, _flag), 82: (U16, _, _, _),
    83: (_keep, _keep, U8, _), 84: (_, _, _, _), 85: (_, _, _, _), 92: (U16, _, _, _),
    93: (_keep, I8, I8, I8), 94: (lambda v: int(v * 100) / 100.0, _, _, _),
    112: (_keep, _, _, _), 114: (_keep, _, _, _), 115: (_keep, _keep, I8, U8), 176: (U16, _, _, _),
    177: (U16, I16, _, _), 178: (U8, _keep, _keep, _), 179: (U16, _, _, _), 181: (U8, U8, _, _),
    182: (U8, I16, _keep, _), 183: (U8, U16, _, _), 184: (U8, U16, I16, _keep), 188: (_, _, _, _),
    189: (_, _, _, _), 191: (_, _, _, _), 195: (_, _, _, _), 197: (_, _, _, _), 201: (U16, _, _, _),
    202: (U8, U16, U8, U8), 203: (U8, U8, I8, U8), 205: (_keep, _keep, _keep, _),
    206: (_keep, _, U8, _), 207: (U16, _, _, _), 208: (U16, _, _, _), 210: (U16, _, _, _),
    211: (U8, U8, _, _), 212: (U16, _, _, _), 213: (_keep, _keep, U8, _), 215: (U16, _, _, _),
    218: (U16, U8, _, _), 222: (U16, _keep, _keep, _keep), 223: (_flag, _flag, _keep, _),
    600: (U16, _, _, _), 601: (U16, I16, _, _), 1000: (_keep, _keep, _keep, _keep), 2000: (U8, _keep, _keep, _keep),
    2001: (U8, _, _, _), 2500: (U8, _, _, _), 2501: (U8, _, _, _), 3000: (U8, _, _, _),
    42600: (U8, U8, _keep, _keep), 42702: (U8, U8, _keep, _keep),
}
del _

WITH_LOCATION = {16, 17, 18, 19, 21, 22, 30, 31, 82, 84, 85, 94, 179, 188, 189, 191, 195, 201}
# Where a NaN yaw is a fair "don't care"; a NaN anywhere else is refused.
NAN_YAW_ALLOWED = {16, 17, 21, 22, 84, 85}
INVALID_PARAM = (mavlink.MAV_MISSION_INVALID_PARAM1, mavlink.MAV_MISSION_INVALID_PARAM2,
                 mavlink.MAV_MISSION_INVALID_PARAM3, mavlink.MAV_MISSION_INVALID_PARAM4)


def store(mission_type, item):
    """The item as ArduPilot would give it back; raises `Refused`."""
    return {MISSION: _store_mission, FENCE: _store_fence, RALLY: _store_rally}[mission_type](item)


def home_item(home):
    lat, lon, alt = home
    return Item(mavlink.MAV_CMD_NAV_WAYPOINT, mavlink.MAV_FRAME_GLOBAL,
                x=round(lat * 1e7), y=round(lon * 1e7), z=_centimetres(alt))


def _centimetres(altitude):
    return f32(int(f32(altitude * 100.0)) / 100.0)


def _store_mission(item):
    keep = PARAMETERS.get(item.command)
    if keep is None:
        raise Refused(mavlink.MAV_MISSION_UNSUPPORTED)
    params = []
    for index, (convert, value) in enumerate(zip(keep, item.params)):
        if math.isnan(value):
            if not (index == 3 and item.command in NAN_YAW_ALLOWED):
                raise Refused(INVALID_PARAM[index])
            value = 0.0
        elif math.isinf(value):
            raise Refused(INVALID_PARAM[index])
        params.append(f32(convert(value)))
    stored = Item(item.command, mavlink.MAV_FRAME_GLOBAL, tuple(params))
    if item.command in RAW_XY_COMMANDS:
        return replace(stored, x=item.x, y=item.y)
    if item.command not in WITH_LOCATION:
        return stored
    _check_position(item)
    if not abs(item.z) < ALTITUDE_LIMIT_M:  # also false for NaN
        raise Refused(mavlink.MAV_MISSION_INVALID_PARAM7)
    if item.frame in RELATIVE:
        frame = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT
    elif item.frame in TERRAIN:
        frame = mavlink.MAV_FRAME_GLOBAL_TERRAIN_ALT
    elif item.frame in ABSOLUTE or item.frame == mavlink.MAV_FRAME_MISSION:
        frame = mavlink.MAV_FRAME_GLOBAL
    else:
        raise Refused(mavlink.MAV_MISSION_UNSUPPORTED_FRAME)
    return replace(stored, frame=frame, x=item.x, y=item.y, z=_centimetres(item.z))


def _store_fence(item):
    """One fence item; what needs the neighbours is checked at the end, in `fence_rules`."""
    if item.frame not in ABSOLUTE + RELATIVE + TERRAIN:
        raise Refused(mavlink.MAV_MISSION_UNSUPPORTED_FRAME)
    if item.command not in FENCE_COMMANDS:
        raise Refused(mavlink.MAV_MISSION_UNSUPPORTED)
    param1 = 0.0 if item.command == mavlink.MAV_CMD_NAV_FENCE_RETURN_POINT else item.params[0]
    return Item(item.command, mavlink.MAV_FRAME_GLOBAL, (param1, 0.0, 0.0, 0.0),
                x=item.x, y=item.y, z=0.0, autocontinue=0)


def _store_rally(item):
    if item.command != mavlink.MAV_CMD_NAV_RALLY_POINT:
        raise Refused(mavlink.MAV_MISSION_UNSUPPORTED)
    for frames in (RELATIVE, ABSOLUTE, TERRAIN):
        if item.frame in frames:
            frame = frames[0]
            break
    else:
        raise Refused(mavlink.MAV_MISSION_UNSUPPORTED_FRAME)
    _check_position(item)
    if not -32768 <= item.z <= 32767:
        raise Refused(mavlink.MAV_MISSION_INVALID_PARAM7)
    return Item(item.command, frame, x=item.x, y=item.y, z=float(int(item.z)), autocontinue=0)


def _check_position(item):
    if abs(item.x) > 90 * 10**7:
        raise Refused(mavlink.MAV_MISSION_INVALID_PARAM5_X)
    if abs(item.y) > 180 * 10**7:
        raise Refused(mavlink.MAV_MISSION_INVALID_PARAM6_Y)

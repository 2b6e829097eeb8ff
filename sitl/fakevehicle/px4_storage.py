"""What PX4 keeps of an uploaded item, and which items it refuses.

Only frames 0, 3, 5, 6 (with a place) and 2 (without one), and only the commands it knows for each.
`store` gives the item as a later MISSION_ITEM_INT download would show it.
"""

import math
from dataclasses import replace

from .dialect import FENCE, MISSION, f32, mavlink
from .items import Item, Refused

RELATIVE = (mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT)
ABSOLUTE = (mavlink.MAV_FRAME_GLOBAL, mavlink.MAV_FRAME_GLOBAL_INT)
POLYGONS, CIRCLES = (5001, 5002), (5003, 5004)
NOT_A_MISSION_ITEM = (*POLYGONS, *CIRCLES, 5100)

# Commands taken in frame 2 (no place); their seven parameters pass through unchanged.
WITHOUT_PLACE = {
    20, 80, 93, 112, 114, 177, 178, 179, 183, 187, 189, 196, 197, 201, 200, 202, 203, 204, 205, 206, 211, 212, 214,
    260, 400, 530, 531, 532, 534, 1000, 1001, 2000, 2001, 2003, 2500, 2501, 3000, 42600,
}


def _drop(_value):
    return 0.0


def _keep(value):
    return value


def _flag(value):
    return 1.0 if value > 0 else 0.0


def _yaw(value):
    """Stored as radians in 0..2 pi; NaN ("don't care") survives."""
    if not math.isfinite(value):
        return math.nan
    return math.degrees(f32(f32(math.radians(value)) % (2 * math.pi)))


def _count(value):
    if not math.isfinite(value):
        return 0.0
    return float(int(value + 0.5) & 0xFFFF)


_ = _drop
# command -> what happens to param1..param4 on the way through storage
PARAMETERS = {
    16: (_keep, _keep, _, _yaw), 17: (_, _, _keep, _yaw), 19: (_keep, _flag, _keep, _flag),
    21: (_, lambda v: float(int(v)) if math.isfinite(v) else 0.0, _, _yaw), 22: (_, _, _, _yaw),
    31: (_flag, _keep, _, _flag), 84: (_, _, _, _yaw), 85: (_, _, _, _yaw),
    195: (_, _, _, _), 201: (_keep, _, _, _), 4501: (_, _, _, _), 5000: (_, _, _, _), 5001: (_count, _, _, _),
    5002: (_count, _, _, _), 5003: (_keep, _, _, _), 5004: (_keep, _, _, _), 5100: (_, _, _, _),
}
del _


def store(mission_type, item):
    """The item as PX4 would give it back; raises `Refused`."""
    if item.frame == mavlink.MAV_FRAME_MISSION:
        if item.command not in WITHOUT_PLACE:
            raise Refused(mavlink.MAV_MISSION_UNSUPPORTED)
        stored = replace(item, current=0)
        if item.command == mavlink.MAV_CMD_DO_JUMP:
            whole = tuple(float(int(v)) if math.isfinite(v) else 0.0 for v in item.params[:2])
            stored = replace(stored, params=whole + item.params[2:])
    elif item.frame in RELATIVE + ABSOLUTE:
        keep = PARAMETERS.get(item.command)
        if keep is None:
            raise Refused(mavlink.MAV_MISSION_UNSUPPORTED)
        if item.command == mavlink.MAV_CMD_DO_SET_ROI and item.params[0] not in (0.0, 3.0):
            raise Refused(mavlink.MAV_MISSION_INVALID_PARAM1)
        frame = RELATIVE[1] if item.frame in RELATIVE else ABSOLUTE[1]
        params = tuple(f32(convert(value)) for convert, value in zip(keep, item.params))
        stored = Item(item.command, frame, params, item.x, item.y, item.z, autocontinue=item.autocontinue)
    else:
        raise Refused(mavlink.MAV_MISSION_UNSUPPORTED_FRAME)
    if mission_type == MISSION and item.command in NOT_A_MISSION_ITEM:
        raise Refused(mavlink.MAV_MISSION_ERROR)
    if mission_type == FENCE:
        if item.command in POLYGONS and stored.params[0] < 3:
            raise Refused(mavlink.MAV_MISSION_ERROR)
        stored = replace(stored, autocontinue=0)
    return stored

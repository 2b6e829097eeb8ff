"""One mission item as it travels in MISSION_ITEM_INT, and its JSON form. No protocol here."""

import math
import struct
import zlib
from dataclasses import dataclass, replace

from .dialect import f32, mavlink

# Commands whose x and y are plain numbers rather than degrees x 1e7.
RAW_XY_COMMANDS = {mavlink.MAV_CMD_DO_DIGICAM_CONFIGURE, mavlink.MAV_CMD_DO_DIGICAM_CONTROL}


class Refused(Exception):
    """The item is not taken; `code` is the MAV_MISSION_RESULT of the acknowledgement."""

    def __init__(self, code):
        super().__init__(f"MAV_MISSION_RESULT {code}")
        self.code = code
        self.index = None  # which item, where several are loaded at once


@dataclass(frozen=True)
class Item:
    """A mission, fence or rally item. `x`, `y` are integers: degrees x 1e7, or raw in frame 2."""

    command: int
    frame: int
    params: tuple = (0.0, 0.0, 0.0, 0.0)
    x: int = 0
    y: int = 0
    z: float = 0.0
    current: int = 0
    autocontinue: int = 1

    @classmethod
    def from_item_int(cls, msg):
        return cls(
            command=msg.command, frame=msg.frame,
            params=(msg.param1, msg.param2, msg.param3, msg.param4),
            x=msg.x, y=msg.y, z=msg.z, current=msg.current, autocontinue=msg.autocontinue,
        )

    @classmethod
    def from_float_item(cls, msg):
        """From the deprecated MISSION_ITEM, whose positions are floats (about 0.5 m at best)."""
        return cls.from_item_int(msg).with_float_position(msg.x, msg.y)

    def with_float_position(self, x, y):
        scale = 1 if self.raw_position else 1e7
        return replace(self, x=_to_i32(x * scale), y=_to_i32(y * scale))

    @property
    def raw_position(self):
        return self.frame == mavlink.MAV_FRAME_MISSION or self.command in RAW_XY_COMMANDS

    def message(self, target, seq, mission_type):
        """This item as MISSION_ITEM_INT for `target` = (system, component)."""
        return mavlink.MAVLink_mission_item_int_message(
            *target, seq, self.frame, self.command, self.current, self.autocontinue,
            *self.params, self.x, self.y, self.z, mission_type)

    def float_message(self, target, seq, mission_type):
        """This item as the deprecated MISSION_ITEM."""
        scale = 1.0 if self.raw_position else 1e-7
        return mavlink.MAVLink_mission_item_message(
            *target, seq, self.frame, self.command, self.current, self.autocontinue,
            *self.params, f32(self.x * scale), f32(self.y * scale), self.z, mission_type)

    def to_json(self, seq):
        """Field by field as MISSION_ITEM_INT names them; NaN is null, infinities are strings."""
        fields = {"seq": seq, "frame": self.frame, "command": self.command,
                  "current": self.current, "autocontinue": self.autocontinue}
        for number, value in enumerate(self.params, 1):
            fields[f"param{number}"] = json_number(value)
        fields.update(x=self.x, y=self.y, z=json_number(self.z))
        return fields

    @classmethod
    def from_json(cls, fields):
        """The inverse of `to_json`; raises ValueError naming what is wrong."""
        try:
            return cls(
                command=int(fields["command"]), frame=int(fields["frame"]),
                params=tuple(float_from_json(fields.get(f"param{n}", 0)) for n in (1, 2, 3, 4)),
                x=int(fields.get("x", 0)), y=int(fields.get("y", 0)),
                z=float_from_json(fields.get("z", 0)),
                current=int(fields.get("current", 0)), autocontinue=int(fields.get("autocontinue", 1)),
            )
        except (KeyError, TypeError, OverflowError) as error:
            raise ValueError(f"not a mission item: {fields!r} ({error})") from error


def json_number(value):
    if math.isnan(value):
        return None
    if math.isinf(value):
        return "inf" if value > 0 else "-inf"
    return value


def float_from_json(value):
    return math.nan if value is None else f32(float(value))


def _to_i32(value):
    if not math.isfinite(value):
        return 0
    return max(-(2**31), min(2**31 - 1, round(value)))


def items_id(items):
    """A 32-bit id that changes with the content (PX4 uses a CRC32 too); 0 for an empty plan."""
    crc = 0
    for item in items:
        crc = zlib.crc32(
            struct.pack("<BHB4fiif", item.frame, item.command, item.autocontinue,
                        *item.params, item.x, item.y, item.z), crc)
    return crc

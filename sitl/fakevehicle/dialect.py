"""pymavlink's ardupilotmega dialect plus the extension fields it does not know yet.

`opaque_id` of MISSION_COUNT and MISSION_ACK and the three ids of MISSION_CURRENT are in the
MAVLink specification (common.xml) but not in pymavlink's dialects. Extension fields are not part
of CRC_EXTRA, so that adding them here is compatible with everybody.
"""

import struct

from pymavlink.dialects.v20 import ardupilotmega as mavlink

MISSION, FENCE, RALLY, ALL = 0, 1, 2, 255
TYPE_NAMES = {MISSION: "mission", FENCE: "fence", RALLY: "rally", ALL: "all"}
TYPE_NUMBERS = {name: number for number, name in TYPE_NAMES.items()}


def _extended(base, fields):
    """The message class `base` with extension `fields` [(name, struct letter, C type)] appended."""
    old_format = base.unpacker.format
    unpacker = struct.Struct(old_format + "".join(letter for _, letter, _ in fields))
    names = [name for name, _, _ in fields]
    base_fields = list(base.fieldnames)

    class Extended(base):
        fieldnames = base_fields + names
        ordered_fieldnames = list(base.ordered_fieldnames) + names
        fieldtypes = list(base.fieldtypes) + [c_type for _, _, c_type in fields]
        native_format = bytearray(unpacker.format.encode())
        orders = list(base.orders) + list(range(len(base_fields), len(base_fields) + len(names)))
        lengths = list(base.lengths) + [1] * len(names)
        array_lengths = list(base.array_lengths) + [0] * len(names)

        def __init__(self, *args, **kwargs):
            extra = {name: kwargs.pop(name, 0) for name in names}
            extra.update(zip(names, args[len(base_fields):]))
            base.__init__(self, *args[: len(base_fields)], **kwargs)
            self._fieldnames = Extended.fieldnames
            for name, value in extra.items():
                setattr(self, name, value)

        def pack(self, mav, force_mavlink1=False):
            values = [getattr(self, name) for name in Extended.ordered_fieldnames]
            return self._pack(mav, base.crc_extra, unpacker.pack(*values), force_mavlink1=force_mavlink1)

    Extended.unpacker = unpacker
    Extended.__name__ = base.__name__
    mavlink.mavlink_map[base.id] = Extended
    return Extended


MissionCount = _extended(mavlink.MAVLink_mission_count_message, [("opaque_id", "I", "uint32_t")])
MissionAck = _extended(mavlink.MAVLink_mission_ack_message, [("opaque_id", "I", "uint32_t")])
MissionCurrent = _extended(
    mavlink.MAVLink_mission_current_message,
    [("mission_id", "I", "uint32_t"), ("fence_id", "I", "uint32_t"), ("rally_points_id", "I", "uint32_t")],
)


def f32(value):
    """The nearest 32-bit float, as a Python float; raises OverflowError beyond its range."""
    return struct.unpack("<f", struct.pack("<f", value))[0]

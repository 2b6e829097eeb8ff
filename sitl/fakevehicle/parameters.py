"""The parameter table and its protocol, with each autopilot's way to put an integer into a float."""

import math
import struct

from .dialect import mavlink
from .persona import REAL32


class Parameters:
    def __init__(self, vehicle):
        self.vehicle = vehicle
        self.table = dict(vehicle.persona.parameters)  # name -> (value, type)

    def set(self, name, value):
        """Sets a known parameter, or adds a new REAL32 one."""
        kind = self.table[name][1] if name in self.table else REAL32
        self.table[name] = (float(value) if kind == REAL32 else int(value), kind)

    def handle(self, channel, msg):
        """True if `msg` belongs to the parameter protocol (it has then been dealt with)."""
        handler = {"PARAM_REQUEST_READ": self._read, "PARAM_REQUEST_LIST": self._list,
                   "PARAM_SET": self._set}.get(msg.get_type())
        if handler:
            handler(channel, msg)
        return handler is not None

    def message(self, name):
        names = list(self.table)
        value, kind = self.table[name]
        if kind != REAL32 and self.vehicle.persona.int_params_as_bytes:
            value = struct.unpack("<f", struct.pack("<i", int(value)))[0]
        return mavlink.MAVLink_param_value_message(
            name.encode()[:16], float(value), kind, len(names), names.index(name))

    def _read(self, channel, msg):
        name = _text(msg.param_id)
        if msg.param_index >= 0:
            names = list(self.table)
            name = names[msg.param_index] if msg.param_index < len(names) else None
        if name in self.table:
            channel.send(self.message(name))
        elif self.vehicle.persona.int_params_as_bytes:  # PX4 says so, ArduPilot keeps silent
            channel.statustext(mavlink.MAV_SEVERITY_INFO, f"[pm] unknown param: {name}")

    def _list(self, channel, _msg):
        for name in self.table:
            channel.send(self.message(name))

    def _set(self, channel, msg):
        name, value = _text(msg.param_id), msg.param_value
        if name not in self.table:
            return
        kind = self.table[name][1]
        if kind != REAL32 and self.vehicle.persona.int_params_as_bytes:
            value = struct.unpack("<i", struct.pack("<f", value))[0]
        if not math.isfinite(value):
            return
        self.table[name] = (value if kind == REAL32 else int(value), kind)
        self.vehicle.event("param_set", name=name, value=self.table[name][0])
        self.vehicle.broadcast(self.message(name))


def _text(name):
    name = name.decode(errors="replace") if isinstance(name, bytes) else name
    return name.split("\0")[0]

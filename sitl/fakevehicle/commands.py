"""COMMAND_LONG, COMMAND_INT and SET_MODE: the few commands that a companion needs, UNSUPPORTED for the rest."""

import math

from .dialect import mavlink

ACCEPTED, DENIED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_DENIED
UNSUPPORTED, FAILED = mavlink.MAV_RESULT_UNSUPPORTED, mavlink.MAV_RESULT_FAILED


class Commands:
    def __init__(self, vehicle):
        self.vehicle = vehicle
        self.handlers = {
            mavlink.MAV_CMD_REQUEST_MESSAGE: self._request_message,
            mavlink.MAV_CMD_SET_MESSAGE_INTERVAL: self._set_interval,
            mavlink.MAV_CMD_GET_MESSAGE_INTERVAL: self._get_interval,
            mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: self._capabilities,
            mavlink.MAV_CMD_GET_HOME_POSITION: self._get_home,
            mavlink.MAV_CMD_DO_SET_HOME: self._set_home,
            mavlink.MAV_CMD_COMPONENT_ARM_DISARM: self._arm,
            mavlink.MAV_CMD_DO_SET_MODE: self._set_mode,
            mavlink.MAV_CMD_DO_SET_MISSION_CURRENT: self._set_mission_current,
            mavlink.MAV_CMD_DO_FENCE_ENABLE: self._fence_enable,
            mavlink.MAV_CMD_MISSION_START: self._mission_start,
            mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: self._reboot,
        }

    def handle(self, channel, msg):
        """True if `msg` is a command (it has then been answered)."""
        name = msg.get_type()
        if name == "SET_MODE":
            self.vehicle.set_custom_mode(msg.custom_mode)
            return True
        if name not in ("COMMAND_LONG", "COMMAND_INT"):
            return False
        params = [msg.param1, msg.param2, msg.param3, msg.param4]
        if name == "COMMAND_INT":
            params += [msg.x * 1e-7, msg.y * 1e-7, msg.z]
        else:
            params += [msg.param5, msg.param6, msg.param7]
        handler = self.handlers.get(msg.command)
        after = None
        result = UNSUPPORTED
        if handler:
            try:
                result = handler(channel, params)
            except (ValueError, OverflowError):  # NaN where a whole number belongs
                result = DENIED
        if isinstance(result, tuple):
            result, after = result
        self.vehicle.event("command", command=msg.command, result=result,
                           by=[msg.get_srcSystem(), msg.get_srcComponent()])
        channel.send(mavlink.MAVLink_command_ack_message(
            msg.command, result, 0, 0, msg.get_srcSystem(), msg.get_srcComponent()))
        if after:
            after()
        return True

    # Each handler returns the MAV_RESULT, or (MAV_RESULT, what to do after the acknowledgement).

    def _request_message(self, channel, params):
        message = self.vehicle.telemetry.message(int(params[0]))
        if message is None:
            return FAILED
        return ACCEPTED, lambda: channel.send(message)

    def _set_interval(self, channel, params):
        message_id, microseconds = int(params[0]), params[1]
        if microseconds < 0:
            seconds = None
        elif microseconds == 0:
            seconds = 1 / self.vehicle.streams_hz if self.vehicle.streams_hz else None
        else:
            seconds = microseconds / 1e6
        if message_id == mavlink.MAVLINK_MSG_ID_HEARTBEAT:
            return ACCEPTED  # always 1 Hz here
        return ACCEPTED if self.vehicle.telemetry.set_interval(channel, message_id, seconds) else FAILED

    def _get_interval(self, channel, params):
        message_id = int(params[0])
        streaming = message_id in channel.intervals
        channel.send(mavlink.MAVLink_message_interval_message(message_id, 1000000 if streaming else -1))
        return ACCEPTED

    def _capabilities(self, channel, _params):
        return ACCEPTED, lambda: channel.send(self.vehicle.telemetry.autopilot_version())

    def _get_home(self, channel, _params):
        return ACCEPTED, lambda: channel.send(self.vehicle.telemetry.home_position())

    def _set_home(self, _channel, params):
        if params[0] == 1:
            self.vehicle.set_home(self.vehicle.position)
            return ACCEPTED
        lat, lon, alt = params[4:]
        if not (abs(lat) <= 90 and abs(lon) <= 180 and math.isfinite(alt)):
            return DENIED
        self.vehicle.set_home((lat, lon, alt))
        return ACCEPTED

    def _arm(self, _channel, params):
        self.vehicle.set_armed(params[0] == 1)
        return ACCEPTED

    def _set_mode(self, _channel, params):
        if self.vehicle.persona.name == "px4":  # main and sub mode come apart
            wanted = int(params[1]) << 16 | int(params[2]) << 24
        else:
            wanted = int(params[1])
        return ACCEPTED if self.vehicle.set_custom_mode(wanted) else DENIED

    def _set_mission_current(self, channel, params):
        if not self.vehicle.set_current(int(params[0])):
            return DENIED
        return ACCEPTED, lambda: channel.send(self.vehicle.telemetry.mission_current())

    def _fence_enable(self, _channel, params):
        name = "FENCE_ENABLE"
        if name not in self.vehicle.parameters.table:
            return UNSUPPORTED
        self.vehicle.announce_parameter(name, 1 if params[0] else 0)
        return ACCEPTED

    def _mission_start(self, _channel, _params):
        self.vehicle.set_mode(self.vehicle.persona.mission_mode)
        return ACCEPTED

    def _reboot(self, _channel, params):
        if params[0] not in (1, 3):
            return ACCEPTED
        if self.vehicle.armed:
            return DENIED
        return ACCEPTED, lambda: self.vehicle.reboot(1.0)

"""The messages the vehicle streams or gives out on request, and their rates per channel."""

from .dialect import FENCE, MISSION, RALLY, MissionCurrent, mavlink

LEAST_INTERVAL_S = 0.01
DEFAULT_STREAMS = (mavlink.MAVLINK_MSG_ID_SYS_STATUS, mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
                   mavlink.MAVLINK_MSG_ID_MISSION_CURRENT, mavlink.MAVLINK_MSG_ID_HOME_POSITION,
                   mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE)
CAPABILITIES = (
    mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_FLOAT | mavlink.MAV_PROTOCOL_CAPABILITY_PARAM_FLOAT
    | mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_INT | mavlink.MAV_PROTOCOL_CAPABILITY_COMMAND_INT
    | mavlink.MAV_PROTOCOL_CAPABILITY_MAVLINK2 | mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE
    | mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_RALLY)
NO_MISSION, NOT_STARTED, ACTIVE, PAUSED = 1, 2, 3, 4
ALL_SENSORS = 0x1F | mavlink.MAV_SYS_STATUS_GEOFENCE


class Telemetry:
    def __init__(self, vehicle):
        self.vehicle = vehicle
        self.builders = {
            mavlink.MAVLINK_MSG_ID_HEARTBEAT: self.heartbeat,
            mavlink.MAVLINK_MSG_ID_SYS_STATUS: self.sys_status,
            mavlink.MAVLINK_MSG_ID_SYSTEM_TIME: self.system_time,
            mavlink.MAVLINK_MSG_ID_GPS_RAW_INT: self.gps_raw,
            mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: self.global_position,
            mavlink.MAVLINK_MSG_ID_MISSION_CURRENT: self.mission_current,
            mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION: self.autopilot_version,
            mavlink.MAVLINK_MSG_ID_FENCE_STATUS: self.fence_status,
            mavlink.MAVLINK_MSG_ID_HOME_POSITION: self.home_position,
            mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: self.extended_sys_state,
        }

    # ---- rates

    def handle(self, channel, msg):
        """The old REQUEST_DATA_STREAM, which older ground stations send: all default streams at one rate."""
        if msg.get_type() != "REQUEST_DATA_STREAM":
            return False
        rate = msg.req_message_rate if msg.start_stop else 0
        for message_id in DEFAULT_STREAMS:
            self.set_interval(channel, message_id, 1 / rate if rate else None)
        return True

    def start_defaults(self, channel):
        if self.vehicle.streams_hz:
            for message_id in DEFAULT_STREAMS:
                self.set_interval(channel, message_id, 1 / self.vehicle.streams_hz)

    def set_interval(self, channel, message_id, seconds):
        """Streams a message on this channel; None stops it. False if it is not one of ours."""
        if message_id not in self.builders:
            return False
        timer = channel.intervals.pop(message_id, None)
        if timer:
            timer.cancel()
        if seconds is not None:
            self._stream(channel, message_id, max(LEAST_INTERVAL_S, seconds))
        return True

    def _stream(self, channel, message_id, seconds):
        channel.send(self.builders[message_id]())
        channel.intervals[message_id] = self.vehicle.loop.call_later(
            seconds, self._stream, channel, message_id, seconds)

    def stop(self, channel):
        for timer in channel.intervals.values():
            timer.cancel()
        channel.intervals.clear()

    def message(self, message_id):
        """The message with this id, or None if the vehicle has no such thing."""
        builder = self.builders.get(message_id)
        return builder() if builder else None

    # ---- the messages

    def heartbeat(self):
        vehicle = self.vehicle
        base = vehicle.persona.base_mode
        if vehicle.armed:
            base |= mavlink.MAV_MODE_FLAG_SAFETY_ARMED
        if vehicle.mode == vehicle.persona.mission_mode:
            base |= mavlink.MAV_MODE_FLAG_AUTO_ENABLED | mavlink.MAV_MODE_FLAG_GUIDED_ENABLED
        state = mavlink.MAV_STATE_ACTIVE if vehicle.armed else mavlink.MAV_STATE_STANDBY
        return mavlink.MAVLink_heartbeat_message(
            mavlink.MAV_TYPE_QUADROTOR, vehicle.persona.autopilot, base, vehicle.custom_mode, state, 3)

    def sys_status(self):
        return mavlink.MAVLink_sys_status_message(
            ALL_SENSORS, ALL_SENSORS, ALL_SENSORS, 100, 12600, -1, 100, 0, 0, 0, 0, 0, 0)

    def system_time(self):
        return mavlink.MAVLink_system_time_message(0, self.vehicle.boot_ms())

    def gps_raw(self):
        lat, lon, alt = self._position_int()
        return mavlink.MAVLink_gps_raw_int_message(
            self.vehicle.boot_ms() * 1000, mavlink.GPS_FIX_TYPE_RTK_FIXED, lat, lon, alt, 80, 80, 0, 0, 16)

    def global_position(self):
        lat, lon, alt = self._position_int()
        above_home = alt - round(self.vehicle.home[2] * 1000)
        return mavlink.MAVLink_global_position_int_message(
            self.vehicle.boot_ms(), lat, lon, alt, above_home, 0, 0, 0, 0)

    def _position_int(self):
        lat, lon, alt = self.vehicle.position
        return round(lat * 1e7), round(lon * 1e7), round(alt * 1000)

    def mission_current(self):
        vehicle = self.vehicle
        count = len(vehicle.store.items[MISSION])
        px4 = not vehicle.persona.home_is_item_zero
        total = (count or 65535) if px4 else max(0, count - 1)
        if total in (0, 65535):
            state = NO_MISSION
        elif vehicle.flying_mission:
            state = ACTIVE
        else:
            state = PAUSED if vehicle.armed and vehicle.current_seq > 1 else NOT_STARTED
        ids = [vehicle.store.id(kind) for kind in (MISSION, FENCE, RALLY)] if px4 else [0, 0, 0]
        return MissionCurrent(vehicle.current_seq, total, state, 1 if vehicle.flying_mission else 2, *ids)

    def autopilot_version(self):
        version = self.vehicle.persona.flight_version
        capabilities = CAPABILITIES | (mavlink.MAV_PROTOCOL_CAPABILITY_FTP if self.vehicle.persona.serves_files else 0)
        return mavlink.MAVLink_autopilot_version_message(
            capabilities, version, 0, 0, 0, [0] * 8, [0] * 8, [0] * 8, 0, 0, self.vehicle.uid)

    def fence_status(self):
        return mavlink.MAVLink_fence_status_message(0, 0, 0, 0)

    def home_position(self):
        lat, lon, alt = self.vehicle.home
        return mavlink.MAVLink_home_position_message(
            round(lat * 1e7), round(lon * 1e7), round(alt * 1000), 0, 0, 0, [1, 0, 0, 0], 0, 0, 0)

    def extended_sys_state(self):
        landed = mavlink.MAV_LANDED_STATE_IN_AIR if self.vehicle.armed else mavlink.MAV_LANDED_STATE_ON_GROUND
        return mavlink.MAVLink_extended_sys_state_message(mavlink.MAV_VTOL_STATE_UNDEFINED, landed)

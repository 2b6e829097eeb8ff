"""A second ground station: uploads through the vehicle's own protocol server, as a rival would.

It is a channel without a wire, so that everything a real rival causes (DENIED, truncation, a plan
that changes under one's hands) comes from the same code as for a real one.
"""

from .dialect import FENCE, RALLY, MissionCount, mavlink
from .items import Item

GROUND_STATION = (255, mavlink.MAV_COMP_ID_MISSIONPLANNER)


class GroundStation:
    """Looks like a channel to the servers. One upload each."""

    number = 255  # as a link, for the faults' link= key

    def __init__(self, vehicle):
        self.vehicle, self.link, self.name = vehicle, self, "second-gcs"
        self.mav = mavlink.MAVLink(None, *GROUND_STATION)

    def upload(self, mission_type, items, pace_s, stop_after=None):
        """Starts an upload of `items`; silent for good after `stop_after` items."""
        self.mission_type, self.items, self.pace_s = mission_type, items, pace_s
        self.left = stop_after
        self.vehicle.event("second_gcs", count=len(items))
        self._say(MissionCount(*self._vehicle_id(), len(items), mission_type))

    def _vehicle_id(self):
        return self.vehicle.sysid, mavlink.MAV_COMP_ID_AUTOPILOT1

    def _say(self, message):
        if self.vehicle.down:
            return
        message.pack(self.mav)  # fills in the header that names the sender
        self.vehicle.mission_server(self.link).handle(self, message)

    def send(self, message):
        """An answer of the vehicle."""
        if message.get_type() in ("MISSION_REQUEST", "MISSION_REQUEST_INT"):
            self.vehicle.loop.call_later(self.pace_s, self._answer, message.seq)
        elif message.get_type() == "MISSION_ACK":
            self.vehicle.event("second_gcs_ack", code=message.type)

    def _answer(self, seq):
        if self.left is not None:
            if self.left == 0:
                return
            self.left -= 1
        if seq < len(self.items):
            self._say(self.items[seq].message(self._vehicle_id(), seq, self.mission_type))

    def statustext(self, severity, text):
        pass


def invented_plan(vehicle, mission_type, count):
    """`count` items near home that cannot be mistaken for anybody's: for the second-gcs fault."""
    lat, lon = round(vehicle.home[0] * 1e7), round(vehicle.home[1] * 1e7)
    command, frame, param1 = mavlink.MAV_CMD_NAV_WAYPOINT, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, 0.0
    if mission_type == FENCE:
        command, frame, param1 = mavlink.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION, mavlink.MAV_FRAME_GLOBAL, 7.0
    elif mission_type == RALLY:
        command = mavlink.MAV_CMD_NAV_RALLY_POINT
    return [Item(command, frame, (param1, 0.0, 0.0, 0.0), lat + 777 * (n + 1), lon, 33.0) for n in range(count)]

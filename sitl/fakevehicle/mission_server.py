"""The server side of the mission protocol: what ArduPilot and PX4 have in common.

`ardupilot.py` and `px4.py` hold the differences. The three plans live in `PlanStore`, which knows
nothing of the protocol. A server never sends except in answer to a message or from an upload timer.
"""

from dataclasses import dataclass, field

from .dialect import FENCE, MISSION, RALLY, TYPE_NAMES, MissionAck, MissionCount, mavlink
from .items import Item, items_id


class PlanStore:
    """Mission, fence and rally as the vehicle holds them: survives reboots and failed uploads."""

    def __init__(self):
        self.items = {MISSION: [], FENCE: [], RALLY: []}

    def id(self, mission_type):
        return items_id(self.items[mission_type])


@dataclass
class Upload:
    """One upload in progress, or (in the history) a finished one."""

    mission_type: int
    owner: tuple              # (system, component)
    channel: object
    count: int
    next_seq: int = 0
    received: list = field(default_factory=list)  # items as they came
    staged: list = field(default_factory=list)    # items as they will be stored
    last_heard: float = 0.0
    timer: object = None

    def to_json(self, result, at_s, with_items):
        entry = {"type": TYPE_NAMES[self.mission_type], "by": list(self.owner), "link": self.channel.name,
                 "count": self.count, "received": len(self.received), "result": result, "at_s": round(at_s, 3)}
        if with_items:
            entry["items"] = [item.to_json(seq) for seq, item in enumerate(self.received)]
        return entry


class MissionServer:
    """Sorts messages to handlers and offers the answers; subclasses decide."""

    HANDLED = {
        "MISSION_REQUEST_LIST": "request_list", "MISSION_REQUEST_INT": "request_item",
        "MISSION_REQUEST": "request_item", "MISSION_COUNT": "upload_count", "MISSION_ITEM_INT": "upload_item",
        "MISSION_ITEM": "upload_item", "MISSION_ACK": "peer_ack", "MISSION_CLEAR_ALL": "clear_all",
        "MISSION_SET_CURRENT": "set_current",
    }

    def __init__(self, vehicle):
        self.vehicle = vehicle
        self.store = vehicle.store
        self.persona = vehicle.persona

    def handle(self, channel, msg):
        """True if `msg` belongs to the mission protocol (it has then been dealt with)."""
        handler = self.HANDLED.get(msg.get_type())
        if handler is None:
            return False
        getattr(self, handler)(channel, (msg.get_srcSystem(), msg.get_srcComponent()), msg)
        return True

    def reset(self):
        """A reboot: forget every transfer."""
        raise NotImplementedError

    # ---- answers

    def ack(self, channel, peer, code, mission_type, opaque_id=0):
        self.vehicle.event("ack", type=TYPE_NAMES.get(mission_type, mission_type), code=code, to=list(peer))
        channel.send(MissionAck(*peer, code, mission_type, opaque_id))

    def send_count(self, channel, peer, mission_type, opaque_id=0):
        count = len(self.store.items[mission_type])
        lie = self.vehicle.faults.take("lying-count", mission_type=mission_type)
        if lie:
            count = lie.options["count"] if lie.options["count"] is not None else count + lie.options["delta"]
            count = max(0, min(65535, count))
        self.vehicle.event("download_start", type=TYPE_NAMES[mission_type], count=count, to=list(peer))
        channel.send(MissionCount(*peer, count, mission_type, opaque_id))

    def send_item(self, channel, peer, mission_type, seq, item, as_float):
        bad = self.vehicle.faults.take("bad-value", mission_type=mission_type, item=seq)
        if bad:
            item = bad.spoil(item)
        message = item.float_message if as_float else item.message
        channel.send(message(peer, seq, mission_type))
        self.vehicle.event("download_item", type=TYPE_NAMES[mission_type], item=seq, to=list(peer))

    # ---- shared steps of an upload

    def refusal_at_count(self, mission_type, count):
        """A MAV_MISSION_RESULT to refuse a COUNT with, or None."""
        refuse = self.vehicle.faults.take("refuse-count", mission_type=mission_type)
        if refuse:
            return refuse.options["code"]
        if count > self.vehicle.capacities[mission_type]:
            return mavlink.MAV_MISSION_NO_SPACE
        return None

    def refusal_of_item(self, mission_type, seq):
        refuse = self.vehicle.faults.take("refuse-item", mission_type=mission_type, item=seq)
        return refuse.options["code"] if refuse else None

    def lying_cut(self, mission_type):
        """For the half-write fault: how many items really reach storage, or None for all."""
        cut = self.vehicle.faults.take("half-write", mission_type=mission_type)
        return cut.options["item"] if cut else None

    def mis_stored(self, mission_type, seq, item):
        """For the mis-store fault: what storage makes of an item."""
        fault = self.vehicle.faults.take("mis-store", mission_type=mission_type, item=seq)
        return fault.spoil(item) if fault else item

    @staticmethod
    def received_item(msg):
        return Item.from_float_item(msg) if msg.get_type() == "MISSION_ITEM" else Item.from_item_int(msg)

    def start_timer(self, upload, on_timer, at):
        self.stop_timer(upload)
        upload.timer = self.vehicle.loop.call_at(at, on_timer, upload)

    @staticmethod
    def stop_timer(upload):
        if upload.timer is not None:
            upload.timer.cancel()
            upload.timer = None

    def seconds(self, nominal):
        """Protocol time: divided by --speedup, as in a simulation that runs faster."""
        return nominal / self.vehicle.speedup

    def plan_changed(self, mission_type):
        self.vehicle.plan_changed(mission_type)

"""The mission protocol as ArduPilot serves it.

Item 0 of a mission is home, whatever was uploaded there. COUNT truncates the stored mission and each
item is written as it comes, so an abandoned upload leaves half a mission; a fence is buffered and
validated first. Downloads have no state: any item, any time, any order.
"""

from dataclasses import replace

from .ardupilot_storage import home_item, store
from .dialect import ALL, FENCE, MISSION, RALLY, TYPE_NAMES, mavlink
from .fence_rules import fault_in, fence_total, only_few_circles
from .items import Refused
from .mission_server import MissionServer, Upload

LABELS = {MISSION: "Mission", FENCE: "Fence", RALLY: "Rally"}


class ArduPilotMissionServer(MissionServer):
    def __init__(self, vehicle):
        super().__init__(vehicle)
        self.uploads = {}  # mission type -> Upload

    def reset(self):
        for upload in self.uploads.values():
            self.stop_timer(upload)
        self.uploads.clear()

    # ---- loading from files

    def over_the_link(self, mission_type, items):
        """A file's items as a ground station sends them: a mission behind the home slot."""
        if mission_type != MISSION:
            return items
        return [home_item(self.vehicle.home), *_behind_home(items)]

    def load(self, mission_type, items):
        """Puts a file's items into storage; raises Refused (with .index) as an upload would."""
        stored = []
        for index, item in enumerate(_behind_home(items) if mission_type == MISSION else items):
            try:
                stored.append(store(mission_type, item))
            except Refused as refusal:
                refusal.index = index
                raise
        if mission_type == FENCE:
            fault = fault_in(stored, max(self.vehicle.capacities[FENCE], 10**6))
            if fault:
                raise ValueError(fault)
        if mission_type == MISSION and stored:
            stored.insert(0, home_item(self.vehicle.home))
        self.store.items[mission_type] = stored
        self.plan_changed(mission_type)

    # ---- download

    def request_list(self, channel, peer, msg):
        mission_type = msg.mission_type
        if self._unsupported(channel, peer, mission_type) or self._busy(channel, peer, mission_type):
            return
        self.send_count(channel, peer, mission_type)

    def request_item(self, channel, peer, msg):
        mission_type, seq = msg.mission_type, msg.seq
        if self._unsupported(channel, peer, mission_type) or self._busy(channel, peer, mission_type):
            return
        items = self.store.items[mission_type]
        if mission_type == MISSION and seq == 0:
            item = home_item(self.vehicle.home)  # always served, even from an empty mission
        elif seq < len(items):
            item = items[seq]
        else:
            if mission_type == MISSION:
                self.send_count(channel, peer, mission_type)
            self.ack(channel, peer, mavlink.MAV_MISSION_INVALID_SEQUENCE, mission_type)
            return
        self.send_item(channel, peer, mission_type, seq, item, as_float=msg.get_type() == "MISSION_REQUEST")

    def peer_ack(self, channel, peer, msg):
        """Ends a download; as for an upload, ArduPilot does not even listen to a cancellation."""
        self.vehicle.event("download_done", type=TYPE_NAMES.get(msg.mission_type), code=msg.type, by=list(peer))

    # ---- upload

    def upload_count(self, channel, peer, msg):
        mission_type = msg.mission_type
        if self._unsupported(channel, peer, mission_type) or self._busy(channel, peer, mission_type, but=peer):
            return
        running = self.uploads.pop(mission_type, None)
        if running:  # its owner starts again
            self.stop_timer(running)
        code = self.refusal_at_count(mission_type, msg.count)
        if code is not None:
            self.ack(channel, peer, code, mission_type)
            if code == mavlink.MAV_MISSION_NO_SPACE:
                limit = self.vehicle.capacities[mission_type]
                self.vehicle.statustext(mavlink.MAV_SEVERITY_WARNING, f"Only {limit} items are supported")
            return
        upload = Upload(mission_type, peer, channel, msg.count, last_heard=self.vehicle.loop.time())
        self.vehicle.event("upload_start", type=TYPE_NAMES[mission_type], count=msg.count, by=list(peer))
        if mission_type != FENCE:
            del self.store.items[mission_type][msg.count:]
            self.plan_changed(mission_type)
        if msg.count == 0:
            self._complete(upload)
            return
        self.uploads[mission_type] = upload
        self._ask(upload)

    def upload_item(self, channel, peer, msg):
        mission_type = msg.mission_type
        if self._unsupported(channel, peer, mission_type):
            return
        if mission_type == MISSION and msg.current in (2, 3):
            # Not part of any mission: "go there now" (2) or "change altitude" (3), whatever else is going on.
            self.vehicle.event("guided_item", current=msg.current, by=list(peer))
            self.ack(channel, peer, mavlink.MAV_MISSION_ACCEPTED, mission_type)
            return
        upload = self.uploads.get(mission_type)
        if upload is None:
            self.ack(channel, peer, mavlink.MAV_MISSION_ERROR, mission_type)
            return
        if msg.seq != upload.next_seq:  # a repeat, or out of turn: say so and carry on
            self.ack(channel, peer, mavlink.MAV_MISSION_INVALID_SEQUENCE, mission_type)
            return
        if peer != upload.owner:
            self.ack(channel, peer, mavlink.MAV_MISSION_DENIED, mission_type)
            return
        item = self.received_item(msg)
        upload.received.append(item)
        code = self.refusal_of_item(mission_type, msg.seq)
        if code is None:
            code = self._write(upload, msg.seq, item)
        if code != mavlink.MAV_MISSION_ACCEPTED:
            self._end(upload, code)
            return
        upload.last_heard = self.vehicle.loop.time()
        upload.next_seq += 1
        self.vehicle.event("upload_item", type=TYPE_NAMES[mission_type], item=msg.seq, by=list(peer))
        if self.uploads.get(mission_type) is not upload:
            return  # a fault took the vehicle down at this item
        if upload.next_seq == upload.count:
            self._complete(upload)
        else:
            self._ask(upload)

    def clear_all(self, channel, peer, msg):
        mission_type = msg.mission_type
        if mission_type == ALL:
            self.ack(channel, peer, mavlink.MAV_MISSION_UNSUPPORTED, mission_type)
            return
        if self._unsupported(channel, peer, mission_type) or self._busy(channel, peer, mission_type):
            return
        if mission_type == MISSION and self.vehicle.flying_mission:
            self.ack(channel, peer, mavlink.MAV_MISSION_ERROR, mission_type)
            return
        self.store.items[mission_type] = []
        self.vehicle.event("clear", type=TYPE_NAMES[mission_type], by=list(peer))
        self.plan_changed(mission_type)
        self.ack(channel, peer, mavlink.MAV_MISSION_ACCEPTED, mission_type)

    def set_current(self, channel, peer, msg):
        if self.vehicle.set_current(msg.seq):
            channel.send(self.vehicle.telemetry.mission_current())

    # ---- the steps of an upload

    def _ask(self, upload):
        """Requests the next item, with the old MISSION_REQUEST as ArduPilot does."""
        upload.channel.send(mavlink.MAVLink_mission_request_message(
            *upload.owner, upload.next_seq, upload.mission_type))
        again = self.vehicle.loop.time() + self.seconds(self.persona.request_again_s)
        deadline = upload.last_heard + self.seconds(self.persona.give_up_s)
        self.start_timer(upload, self._on_timer, min(again, deadline))

    def _on_timer(self, upload):
        if self.vehicle.loop.time() < upload.last_heard + self.seconds(self.persona.give_up_s):
            self._ask(upload)
            return
        self.vehicle.event("upload_timeout", type=TYPE_NAMES[upload.mission_type], item=upload.next_seq)
        self._end(upload, mavlink.MAV_MISSION_OPERATION_CANCELLED, before=lambda: upload.channel.statustext(
            mavlink.MAV_SEVERITY_WARNING, f"{LABELS[upload.mission_type]} upload timeout"))

    def _write(self, upload, seq, item):
        try:
            stored = store(upload.mission_type, item)
        except Refused as refusal:
            if seq == 0 and upload.mission_type == MISSION and refusal.code != mavlink.MAV_MISSION_UNSUPPORTED:
                stored = home_item(self.vehicle.home)  # a home slot full of zeros or NaN is no matter
            else:
                return refusal.code
        stored = self.mis_stored(upload.mission_type, seq, stored)
        if upload.mission_type == FENCE:
            upload.staged.append(stored)
            return mavlink.MAV_MISSION_ACCEPTED
        items = self.store.items[upload.mission_type]
        if upload.mission_type == MISSION:
            if stored.command == mavlink.MAV_CMD_DO_JUMP and not 0 < stored.params[0] < max(len(items), upload.count):
                return mavlink.MAV_MISSION_ERROR
            if seq == 0:
                stored = home_item(self.vehicle.home)
        if seq < len(items):
            items[seq] = stored
        else:
            items.append(stored)
        return mavlink.MAV_MISSION_ACCEPTED

    def _complete(self, upload):
        mission_type, text = upload.mission_type, self.vehicle.statustext
        cut = self.lying_cut(mission_type)
        if mission_type == FENCE:
            fault = fault_in(upload.staged, self.vehicle.capacities[FENCE])
            if fault:
                text(mavlink.MAV_SEVERITY_WARNING, fault)
                text(mavlink.MAV_SEVERITY_WARNING, "Fence validation failed")
                self._end(upload, mavlink.MAV_MISSION_ERROR)
                return
            erased_soon = self.store.items[FENCE] and only_few_circles(upload.staged)
            self.store.items[FENCE] = upload.staged[:cut]
            self._end(upload, mavlink.MAV_MISSION_ACCEPTED)
            self.plan_changed(FENCE)
            text(mavlink.MAV_SEVERITY_INFO, "Fence Indexed OK")
            self.vehicle.announce_parameter("FENCE_TOTAL", fence_total(self.store.items[FENCE]))
            if erased_soon:
                self.vehicle.erase_fence_after(self.seconds(0.4))
        else:
            if cut is not None:
                del self.store.items[mission_type][cut:]
            if mission_type == MISSION:
                upload.channel.statustext(mavlink.MAV_SEVERITY_INFO, "Flight plan received")
            else:
                upload.channel.statustext(mavlink.MAV_SEVERITY_INFO, "Rally points received")
            self._end(upload, mavlink.MAV_MISSION_ACCEPTED)
            self.plan_changed(mission_type)
            if mission_type == MISSION and self.vehicle.flying_mission and upload.count:
                text(mavlink.MAV_SEVERITY_WARNING, "Auto mission changed, restarted command")

    def _end(self, upload, code, before=None):
        self.stop_timer(upload)
        self.uploads.pop(upload.mission_type, None)
        if before:
            before()
        self.vehicle.upload_ended(upload, code)
        self.ack(upload.channel, upload.owner, code, upload.mission_type)

    # ---- refusals

    def _unsupported(self, channel, peer, mission_type):
        if mission_type in self.store.items:
            return False
        self.ack(channel, peer, mavlink.MAV_MISSION_UNSUPPORTED, mission_type)
        return True

    def _busy(self, channel, peer, mission_type, but=None):
        """DENIED while somebody uploads this type (`but`: the owner may begin again)."""
        upload = self.uploads.get(mission_type)
        if (upload and upload.owner != but) or self.vehicle.faults.take("busy", mission_type=mission_type):
            self.ack(channel, peer, mavlink.MAV_MISSION_DENIED, mission_type)
            return True
        return False


def _behind_home(items):
    """A file's mission items, DO_JUMP targets counted from the home slot."""
    return [_jump_moved(item, 1) if item.command == mavlink.MAV_CMD_DO_JUMP else item for item in items]


def _jump_moved(item, offset):
    return replace(item, params=(item.params[0] + offset, *item.params[1:]))

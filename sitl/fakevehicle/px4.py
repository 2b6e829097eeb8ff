"""The mission protocol as PX4 serves it.

One transfer at a time per link, strictly in sequence. An upload goes to a second store and replaces
the first one at the end, at once. Content ids travel as `opaque_id`.
"""

from dataclasses import replace

from .dialect import ALL, FENCE, MISSION, RALLY, TYPE_NAMES, mavlink
from .items import Refused, items_id
from .mission_server import MissionServer, Upload
from .px4_storage import store

IDLE, SENDING, RECEIVING = "idle", "sending", "receiving"
CRITICAL, INFO = mavlink.MAV_SEVERITY_CRITICAL, mavlink.MAV_SEVERITY_INFO


class Px4Shared:
    """What all links of one PX4 share: only one upload may run anywhere."""

    def __init__(self):
        self.uploading = None  # the server that receives


class Px4MissionServer(MissionServer):
    """One per link, as PX4 has one mission manager per MAVLink instance."""

    def __init__(self, vehicle, shared):
        super().__init__(vehicle)
        self.shared = shared
        self.upload = None
        self.last_id = 0
        self.idle_timer = None
        self.reset()

    def reset(self):
        self._cancel_idle_timer()
        if self.upload:
            self.stop_timer(self.upload)
        if self.shared.uploading is self:
            self.shared.uploading = None
        self.state, self.partner, self.mission_type, self.cursor, self.count = IDLE, None, MISSION, 0, 0
        self.upload = None

    def over_the_link(self, _mission_type, items):
        """A file's items as a ground station sends them: as they are."""
        return items

    def load(self, mission_type, items):
        stored = []
        for index, item in enumerate(items):
            try:
                stored.append(store(mission_type, item))
            except Refused as refusal:
                refusal.index = index
                raise
        self.store.items[mission_type] = stored
        self.plan_changed(mission_type)

    def handle(self, channel, msg):
        target = getattr(msg, "target_component", 0)
        if msg.get_type() in self.HANDLED and (
                msg.target_system != self.vehicle.sysid or target not in (0, 1, mavlink.MAV_COMP_ID_MISSIONPLANNER)):
            return True  # PX4 takes no broadcasts here
        return super().handle(channel, msg)

    # ---- download

    def request_list(self, channel, peer, msg):
        if self.state == SENDING and self.cursor == len(self.store.items.get(self.mission_type, ())):
            self._to_idle()  # everything had been sent; only the ack is missing
        again = self.state == SENDING and self.mission_type == msg.mission_type and peer == self.partner
        if self.vehicle.faults.take("busy", mission_type=msg.mission_type) or not (self.state == IDLE or again):
            channel.statustext(INFO, "Mission download request ignored, already active")
            return
        if msg.mission_type not in self.store.items:
            channel.statustext(CRITICAL, "Received unknown mission type, abort.")
            return
        self.state, self.partner, self.mission_type, self.cursor = SENDING, peer, msg.mission_type, 0
        self.count = len(self.store.items[self.mission_type])
        self._heard()
        self.send_count(channel, peer, self.mission_type, self.store.id(self.mission_type))

    def request_item(self, channel, peer, msg):
        if peer != self.partner:
            channel.statustext(CRITICAL, "WPM: REJ. CMD: partner id mismatch")
            return
        if self.state == RECEIVING:
            channel.statustext(CRITICAL, "WPM: REJ. CMD: Busy")
            return
        if self.state == IDLE or msg.mission_type != self.mission_type:
            return  # silently
        self._heard()
        items = self.store.items[self.mission_type]
        if msg.seq == self.cursor < self.count and msg.seq < len(items):
            self.cursor += 1
        elif msg.seq != self.cursor - 1 or msg.seq >= len(items):
            self._to_idle()
            self.ack(channel, peer, mavlink.MAV_MISSION_ERROR, self.mission_type)
            channel.statustext(CRITICAL, "WPM: REJ. CMD: Req. WP was unexpected")
            return
        as_float = msg.get_type() == "MISSION_REQUEST"
        item = items[msg.seq]
        if as_float:
            item = _with_float_frame(item)
        if self.mission_type == MISSION and msg.seq == self.vehicle.current_seq:
            item = _marked_current(item)
        self.send_item(channel, peer, self.mission_type, msg.seq, item, as_float)

    def peer_ack(self, channel, peer, msg):
        if peer != self.partner:
            channel.statustext(CRITICAL, "REJ. WP CMD: partner id mismatch")
            return
        if self.state == SENDING and msg.mission_type == self.mission_type:
            self.vehicle.event("download_done", type=TYPE_NAMES[self.mission_type], code=msg.type, by=list(peer))
            self._to_idle()
        elif self.state == RECEIVING and msg.type == mavlink.MAV_MISSION_OPERATION_CANCELLED:
            self._end("cancelled by the peer")

    # ---- upload

    def upload_count(self, channel, peer, msg):
        if self.state == SENDING:
            channel.statustext(CRITICAL, "WPM: IGN MISSION_COUNT: Busy")
            self.ack(channel, peer, mavlink.MAV_MISSION_ERROR, msg.mission_type)
            return
        if self.state == RECEIVING:
            self._heard()
            if peer != self.partner or self.cursor > 0:
                if peer == self.partner:
                    channel.statustext(CRITICAL, "WPM: REJ. CMD: Busy")
                self.ack(channel, peer, mavlink.MAV_MISSION_ERROR, self.mission_type)
                return
            self._ask()  # the first request was lost
            return
        if msg.mission_type not in self.store.items:
            self.ack(channel, peer, mavlink.MAV_MISSION_INVALID, msg.mission_type)
            return
        if self.shared.uploading or self.vehicle.faults.take("busy", mission_type=msg.mission_type):
            self.ack(channel, peer, mavlink.MAV_MISSION_ERROR, msg.mission_type)
            return
        self.partner, self.mission_type = peer, msg.mission_type
        code = self.refusal_at_count(msg.mission_type, msg.count)
        if code is not None:
            self.ack(channel, peer, code, msg.mission_type)
            return
        self.vehicle.event("upload_start", type=TYPE_NAMES[msg.mission_type], count=msg.count, by=list(peer))
        self.upload = Upload(msg.mission_type, peer, channel, msg.count)
        self.cursor, self.count = 0, msg.count
        if msg.count == 0:
            self._complete()
            return
        self.state, self.shared.uploading = RECEIVING, self
        self._heard()
        self._ask()

    def upload_item(self, channel, peer, msg):
        if peer != self.partner:
            channel.statustext(CRITICAL, "REJ. MIS ITEM: partner id mismatch")
            return
        if msg.mission_type != self.mission_type or self.state == SENDING:
            self.ack(channel, peer, mavlink.MAV_MISSION_ERROR, self.mission_type)
            return
        if self.state == IDLE:
            if self.cursor == msg.seq + 1:  # the final ack was lost
                self.ack(channel, peer, mavlink.MAV_MISSION_ACCEPTED, self.mission_type, self.last_id)
            else:
                channel.statustext(CRITICAL, "IGN MISSION_ITEM: No transfer")
                self.ack(channel, peer, mavlink.MAV_MISSION_ERROR, self.mission_type)
            return
        self._heard()
        if msg.seq != self.cursor:
            return  # silently
        upload, item = self.upload, self.received_item(msg)
        upload.received.append(item)
        code = self.refusal_of_item(self.mission_type, msg.seq)
        if code is None:
            try:
                stored = store(self.mission_type, item)
                upload.staged.append(self.mis_stored(self.mission_type, msg.seq, stored))
            except Refused as refusal:
                code = refusal.code
        if code is not None and code != mavlink.MAV_MISSION_ACCEPTED:
            channel.statustext(CRITICAL, "IGN MISSION_ITEM: Invalid item")
            self.ack(channel, peer, code, self.mission_type)
            self._end(code)
            return
        self.cursor += 1
        self.vehicle.event("upload_item", type=TYPE_NAMES[self.mission_type], item=msg.seq, by=list(peer))
        if self.upload is not upload:
            return  # a fault took the vehicle down at this item
        if self.cursor == self.count:
            self._complete()
        else:
            self._ask()

    def clear_all(self, channel, peer, msg):
        if self.state != IDLE:
            channel.statustext(CRITICAL, "WPM: IGN CLEAR CMD: Busy")
            return
        types = (MISSION, FENCE, RALLY) if msg.mission_type == ALL else (msg.mission_type,)
        for mission_type in types:
            if mission_type in self.store.items:
                self.store.items[mission_type] = []
                self.vehicle.event("clear", type=TYPE_NAMES[mission_type], by=list(peer))
                self.plan_changed(mission_type)
        self.ack(channel, peer, mavlink.MAV_MISSION_ACCEPTED, msg.mission_type)

    def set_current(self, channel, peer, msg):
        if self.state != IDLE:
            channel.statustext(CRITICAL, "WPM: IGN WP CURR CMD: Busy")
        elif not self.vehicle.set_current(msg.seq):
            channel.statustext(CRITICAL, "WPM: WP CURR CMD: Not in list")

    # ---- the steps of an upload

    def _ask(self):
        upload = self.upload
        upload.channel.send(mavlink.MAVLink_mission_request_int_message(
            *upload.owner, self.cursor, upload.mission_type))
        again = self.vehicle.loop.time() + self.seconds(self.persona.request_again_s)
        self.start_timer(upload, self._ask_again, again)

    def _ask_again(self, upload):
        if self.upload is upload:
            self._ask()

    def _complete(self):
        upload = self.upload
        staged = upload.staged[: self.lying_cut(upload.mission_type)]
        self.last_id = items_id(upload.staged)
        if self.last_id != self.store.id(upload.mission_type) or len(staged) != len(upload.staged):
            self.store.items[upload.mission_type] = staged
            if upload.mission_type == MISSION:
                marked = [seq for seq, item in enumerate(upload.received) if item.current]
                self.vehicle.current_seq = marked[-1] if marked else 0
            self.plan_changed(upload.mission_type)
        self._end(mavlink.MAV_MISSION_ACCEPTED)
        self.ack(upload.channel, upload.owner, mavlink.MAV_MISSION_ACCEPTED, upload.mission_type, self.last_id)

    def _end(self, result):
        upload, self.upload = self.upload, None
        self.stop_timer(upload)
        self.shared.uploading = None
        self._to_idle()
        self.vehicle.upload_ended(upload, result)

    # ---- state

    def _heard(self):
        """Restarts the time-out of the whole transfer."""
        self._cancel_idle_timer()
        self.idle_timer = self.vehicle.loop.call_later(self.seconds(self.persona.give_up_s), self._timeout)

    def _timeout(self):
        self.idle_timer = None
        if self.state == IDLE:
            return
        self.vehicle.statustext(CRITICAL, "Operation timeout")
        if self.state == RECEIVING:
            self.vehicle.event("upload_timeout", type=TYPE_NAMES[self.mission_type], item=self.cursor)
            self._end("timeout")
        self._to_idle()

    def _to_idle(self):
        self.state = IDLE
        self._cancel_idle_timer()

    def _cancel_idle_timer(self):
        if self.idle_timer:
            self.idle_timer.cancel()
            self.idle_timer = None


def _with_float_frame(item):
    return replace(item, frame={5: 0, 6: 3}.get(item.frame, item.frame))


def _marked_current(item):
    return replace(item, current=1)

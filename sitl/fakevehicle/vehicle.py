"""The vehicle: its state, its heartbeat, who hears what, reboots. Protocols are in their own modules."""

import asyncio

from .ardupilot import ArduPilotMissionServer
from .commands import Commands
from .dialect import FENCE, MISSION, RALLY, TYPE_NAMES, TYPE_NUMBERS, mavlink
from .faults import ON_VEHICLE, Faults
from .fence_rules import fence_total
from .ftp import Ftp
from .ground_station import GroundStation, invented_plan
from .mission_server import PlanStore
from .parameters import Parameters
from .px4 import Px4MissionServer, Px4Shared
from .report import EventLog
from .signing import Signing
from .telemetry import Telemetry

ROUTES_KEPT = 64
LEAST_HEARTBEAT_S = 0.02


class Vehicle:
    def __init__(self, persona, sysid=1, home=None, seed=0, speedup=1.0, streams_hz=None, capacities=None,
                 signing=None, uid=0):
        self.uid = uid
        self.life = 1  # rises with each reset
        self.loop = asyncio.get_running_loop()
        self.started = self.booted = self.loop.time()
        self.persona, self.sysid, self.speedup = persona, sysid, speedup
        self.capacities = {**persona.capacities, **(capacities or {})}
        self.streams_hz = persona.streams_hz if streams_hz is None else streams_hz
        self.home = tuple(home or persona.home)
        self.position = self.home
        self.armed, self.mode, self.current_seq = False, persona.default_mode, 0
        self.boots, self.down, self.vanished = 1, False, False
        self.log = EventLog(self.clock)
        self.faults = Faults(seed, self.clock)
        self.log.listeners.append(self._fault_events)
        self.signing = signing or Signing()
        self.store = PlanStore()
        self.parameters = Parameters(self)
        if "SYSID_THISMAV" in self.parameters.table:
            self.parameters.set("SYSID_THISMAV", sysid)
        self.telemetry, self.commands, self.ftp = Telemetry(self), Commands(self), Ftp(self)
        self.channels = []
        self.servers = {}  # ArduPilot: one for all, PX4: one per link
        self.px4_shared = Px4Shared()

    # ---- time and events

    def clock(self):
        """Seconds since the start of the program (not since boot)."""
        return self.loop.time() - self.started

    def boot_ms(self):
        return int((self.loop.time() - self.booted) * 1000 * self.speedup)

    def event(self, event, /, **fields):
        self.log.add(event, fields)

    # ---- state

    @property
    def custom_mode(self):
        return self.persona.modes.get(self.mode, self.mode if isinstance(self.mode, int) else 0)

    @property
    def flying_mission(self):
        return self.armed and self.mode == self.persona.mission_mode

    def set_armed(self, armed):
        self.armed = bool(armed)
        self.event("armed" if armed else "disarmed")

    def set_mode(self, name):
        """By name; raises ValueError for one this autopilot does not have."""
        if name not in self.persona.modes:
            raise ValueError(f"unknown mode {name!r}; there are: {', '.join(self.persona.modes)}")
        self.mode = name
        self.event("mode", mode=name)

    def set_custom_mode(self, number):
        for name, value in self.persona.modes.items():
            if value == number:
                self.set_mode(name)
                return True
        return False

    def set_home(self, home):
        self.home = tuple(home)
        self.event("home", lat=home[0], lon=home[1], alt=home[2])
        self.broadcast(self.telemetry.home_position())

    def set_current(self, seq):
        if not 0 <= seq < len(self.store.items[MISSION]):
            return False
        self.current_seq = seq
        self.event("current", seq=seq)
        if not self.persona.home_is_item_zero:  # PX4 tells at once, ArduPilot in its stream
            self.broadcast(self.telemetry.mission_current())
        return True

    # ---- plans

    def mission_server(self, link):
        if self.persona.name == "ardupilot":
            link = None
        if link not in self.servers:
            if self.persona.name == "ardupilot":
                self.servers[link] = ArduPilotMissionServer(self)
            else:
                self.servers[link] = Px4MissionServer(self, self.px4_shared)
        return self.servers[link]

    def load(self, mission_type, items):
        """Puts items into storage without a transfer; raises Refused or ValueError."""
        self.mission_server(None).load(mission_type, items)

    def plan_changed(self, mission_type):
        count = len(self.store.items[mission_type])
        self.event("plan_changed", type=TYPE_NAMES[mission_type], count=count)
        if mission_type == MISSION and self.current_seq >= count:
            self.current_seq = 0
        if self.persona.home_is_item_zero:
            name = {MISSION: "MIS_TOTAL", FENCE: "FENCE_TOTAL", RALLY: "RALLY_TOTAL"}[mission_type]
            total = fence_total(self.store.items[FENCE]) if mission_type == FENCE else count
            self.parameters.set(name, total)

    def upload_ended(self, upload, result):
        self.log.add_upload(upload, result)
        self.event("upload_ended", type=TYPE_NAMES[upload.mission_type], count=upload.count, result=result,
                   by=list(upload.owner))
        if upload.mission_type == FENCE and result == mavlink.MAV_MISSION_ACCEPTED and upload.count:
            vanish = self.faults.take("vanish-fence")
            if vanish:
                self.erase_fence_after(vanish.options["after"])

    def erase_fence_after(self, seconds):
        self.loop.call_later(seconds, self._erase_fence, self.life)

    def _erase_fence(self, life):
        if life != self.life:
            return
        self.store.items[FENCE] = []
        self.event("fence_erased")
        self.plan_changed(FENCE)

    # ---- links

    def channel_opened(self, channel):
        self.channels.append(channel)
        self.event("link_up", link=channel.name)
        self.telemetry.start_defaults(channel)

    def channel_closed(self, channel):
        if channel in self.channels:
            self.telemetry.stop(channel)
            self.channels.remove(channel)
            self.event("link_down", link=channel.name)

    def broadcast(self, message):
        for channel in self.channels:
            channel.send(message)

    def statustext(self, severity, text):
        self.event("statustext", text=text)
        for channel in self.channels:
            channel.statustext(severity, text)

    def announce_parameter(self, name, value):
        self.parameters.set(name, value)
        self.broadcast(self.parameters.message(name))

    def heartbeat_for_ever(self):
        self.broadcast(self.telemetry.heartbeat())
        self.loop.call_later(max(LEAST_HEARTBEAT_S, 1.0 / self.speedup), self.heartbeat_for_ever)

    # ---- messages in

    def receive(self, channel, msg):
        peer = (msg.get_srcSystem(), msg.get_srcComponent())
        if peer == (self.sysid, mavlink.MAV_COMP_ID_AUTOPILOT1):
            return  # our own, come back
        if peer not in channel.heard:
            if len(channel.heard) >= ROUTES_KEPT:
                channel.heard.pop(next(iter(channel.heard)))
            channel.heard[peer] = True
            self.event("heard", system=peer[0], component=peer[1], link=channel.name)
            channel.send(self.telemetry.heartbeat())  # nobody has to wait a second for the first one
        system = getattr(msg, "target_system", 0)
        component = getattr(msg, "target_component", 0)
        self._forward(channel, msg, system, component)
        if system not in (0, self.sysid) or component not in (0, mavlink.MAV_COMP_ID_AUTOPILOT1, 190):
            return
        for protocol in (self.mission_server(channel.link), self.commands, self.parameters, self.ftp, self.telemetry):
            if protocol.handle(channel, msg):
                return

    def _forward(self, channel, msg, system, component):
        """Passes a frame on as a router does: to where its target was heard, a broadcast to all others."""
        if not self.persona.forwards or (system, component) == (self.sysid, mavlink.MAV_COMP_ID_AUTOPILOT1):
            return
        for other in self.channels:
            if other is channel or not other.heard:
                continue
            if system == 0 or any(known == system and component in (0, part) for known, part in other.heard):
                other.send_frame(msg.get_type(), bytes(msg.get_msgbuf()))

    # ---- going down

    def reboot(self, down_s, close_links=False):
        """Forgets transfers, routes and rates; keeps what storage holds at this moment."""
        self.event("reboot")
        self.down = True
        for server in self.servers.values():
            server.reset()
        self.ftp.reset()
        for channel in self.channels:
            self.telemetry.stop(channel)
            channel.heard.clear()
        self.armed, self.mode, self.current_seq = False, self.persona.default_mode, 0
        for link in {channel.link for channel in self.channels}:
            link.rebooted(close_links)
        self.loop.call_later(down_s, self._up_again, self.life)

    def _up_again(self, life):
        if life != self.life:
            return
        self.boots += 1
        self.booted = self.loop.time()
        self.down = self.vanished
        self.event("booted")
        for channel in self.channels:
            self.telemetry.start_defaults(channel)

    def vanish(self):
        """Stops answering for good, links stay open."""
        self.event("vanished")
        self.down = self.vanished = True
        for server in self.servers.values():
            server.reset()

    def reset(self, seed):
        """Another vehicle in the same place: nothing is held, open, known or wrong. Only links stay."""
        self.life += 1
        for server in self.servers.values():
            server.reset()
        self.ftp.reset()
        for channel in self.channels:
            self.telemetry.stop(channel)
            channel.heard.clear()
        for link in {channel.link for channel in self.channels}:
            link.rebooted(True)
        self.faults.reset(seed)
        self.log.reset()
        self.log.listeners.append(self._fault_events)
        for mission_type in self.store.items:
            self.store.items[mission_type] = []
        self.home = self.position = tuple(self.persona.home)
        self.armed, self.mode, self.current_seq = False, self.persona.default_mode, 0
        self.boots, self.down, self.vanished = 1, False, False
        self.booted = self.loop.time()

    # ---- faults that act on the vehicle as a whole

    def add_fault(self, spec):
        fault = self.faults.add(spec)
        if fault.kind in ON_VEHICLE and fault.options["at"] is not None:
            self.loop.call_later(fault.options["at"], self._at_its_time, fault)
        return fault

    def _at_its_time(self, fault):
        if fault in self.faults.faults:  # not cleared meanwhile
            fault.applied += 1
            self._carry_out(fault)

    def _fault_events(self, name, fields):
        when = {"upload_item": "upload", "download_item": "download"}.get(name)
        if when is None:
            return
        for kind in ON_VEHICLE:
            fault = self.faults.take(kind, TYPE_NUMBERS[fields["type"]], fields["item"], exact_item=True, when=when)
            if fault:
                self._carry_out(fault)

    def _carry_out(self, fault):
        options = fault.options
        if fault.kind == "vanish":
            self.vanish()
        elif fault.kind == "reboot":
            self.reboot(options["for"], bool(options["close"]))
        else:
            mission_type = MISSION if options["type"] is None else options["type"]
            GroundStation(self).upload(mission_type, invented_plan(self, mission_type, options["count"]),
                                       options["pace"] / 1000, options["stop"])

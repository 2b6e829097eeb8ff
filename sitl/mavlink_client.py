"""A small MAVLink client for the tests of the fake vehicle: one link, mission transfers, fake processes.

Blocking on purpose: a test reads like the conversation it checks.
"""

import json
import os
import select
import socket
import subprocess
import sys
import time
import tty

os.environ["MAVLINK20"] = "1"
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)

from fakevehicle.dialect import MISSION, MissionAck, MissionCount, mavlink  # noqa: E402
from fakevehicle.items import Item  # noqa: E402

PATIENCE_S = 10.0


class Fake:
    """A fake vehicle process; use as a context manager."""

    def __init__(self, *arguments, links=("udpin:127.0.0.1:0",)):
        command = [sys.executable, os.path.join(HERE, "fake_vehicle.py"), "--control", "0",
                   "--exit-on-stdin-eof", "--seed", "1", *arguments]
        for link in links:
            command += ["--link", link]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                        stderr=subprocess.PIPE, text=True)
        line = self.process.stdout.readline()
        if not line:
            raise RuntimeError(f"no ready line: {self.process.stderr.read()}")
        self.ready = json.loads(line)
        self.control = socket.create_connection(("127.0.0.1", self.ready["control"]["port"]), timeout=PATIENCE_S)
        self.control_file = self.control.makefile("rw")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.control_file.close()
        self.control.close()
        self.process.stdin.close()
        self.status = self.process.wait(PATIENCE_S)
        self.stderr = self.process.stderr.read()
        self.process.stdout.close()
        self.process.stderr.close()
        if "Traceback" in self.stderr:
            raise RuntimeError(self.stderr)

    def command(self, **command):
        self.control_file.write(json.dumps(command) + "\n")
        self.control_file.flush()
        return json.loads(self.control_file.readline())

    def dump(self):
        return self.command(cmd="dump")["dump"]

    def client(self, index=0, **identity):
        return Client(self.ready["links"][index]["connect"], **identity)

    def wait_for_event(self, name, count=1):
        """Polls the dump until the event has happened that often."""
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            dump = self.dump()
            if dump["events"]["counts"].get(name, 0) >= count:
                return dump
            time.sleep(0.01)
        raise AssertionError(f"no event {name!r}; there were {dump['events']['counts']}")


class Refusal(Exception):
    def __init__(self, code):
        super().__init__(f"MAV_MISSION_RESULT {code}")
        self.code = code


class Client:
    """One side of one link. `url` is the "connect" of the ready line."""

    def __init__(self, url, system=1, component=195, vehicle=(1, 1), hello=True):
        kind, _, where = url.partition(":")
        self.vehicle, self.kind = vehicle, kind
        self.mav = mavlink.MAVLink(None, srcSystem=system, srcComponent=component)
        self.mav.robust_parsing = True
        self.me = (system, component)
        self.inbox, self.texts, self.statustexts = [], [], []
        self.socket = None
        if kind == "serial":
            self.fd = os.open(where.rpartition(":")[0], os.O_RDWR | os.O_NOCTTY)
            tty.setraw(self.fd)
        else:
            host, _, port = where.rpartition(":")
            udp = kind.startswith("udp")
            self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM if udp else socket.SOCK_STREAM)
            self.socket.connect((host, int(port)))
            self.fd = self.socket.fileno()
        if hello:
            self.heartbeat()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        if self.socket:
            self.socket.close()
        else:
            os.close(self.fd)

    def heartbeat(self):
        self.send(mavlink.MAVLink_heartbeat_message(
            mavlink.MAV_TYPE_ONBOARD_CONTROLLER, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, mavlink.MAV_STATE_ACTIVE, 3))

    def send(self, message):
        frame = bytes(message.pack(self.mav))
        self.mav.seq = (self.mav.seq + 1) % 256
        self.send_raw(frame)

    def send_raw(self, data):
        while data:
            data = data[os.write(self.fd, data):]

    def receive(self, *names, timeout=PATIENCE_S, where=lambda message: True):
        """The next message of one of these types; None if none comes in time."""
        deadline = time.monotonic() + timeout
        while True:
            while self.inbox:
                message = self.inbox.pop(0)
                if message.get_type() == "STATUSTEXT":
                    self.texts.append(message.text)
                if message.get_type() in names and where(message):
                    return message
            left = deadline - time.monotonic()
            if left <= 0 or not select.select([self.fd], [], [], left)[0]:
                return None
            self.inbox += self.mav.parse_buffer(os.read(self.fd, 65536)) or []

    def settle(self, quiet_s=0.1):
        """Drops what is still on its way, such as answers to repeated frames."""
        while select.select([self.fd], [], [], quiet_s)[0]:
            self.mav.parse_buffer(os.read(self.fd, 65536))
        self.inbox.clear()

    def expect(self, *names, **options):
        message = self.receive(*names, **options)
        if message is None:
            raise AssertionError(f"no {' or '.join(names)} came; texts: {self.texts}")
        return message

    # ---- the mission protocol, client side

    def request_list(self, mission_type=MISSION):
        self.send(mavlink.MAVLink_mission_request_list_message(*self.vehicle, mission_type))

    def request_int(self, seq, mission_type=MISSION):
        self.send(mavlink.MAVLink_mission_request_int_message(*self.vehicle, seq, mission_type))

    def count(self, count, mission_type=MISSION):
        self.send(MissionCount(*self.vehicle, count, mission_type))

    def item(self, seq, item, mission_type=MISSION):
        self.send(item.message(self.vehicle, seq, mission_type))

    def ack(self, code=0, mission_type=MISSION):
        self.send(MissionAck(*self.vehicle, code, mission_type))

    def download(self, mission_type=MISSION, retry_s=0.5, patience=20):
        """All items, asking again when an answer is lost."""
        answer = self._ask(lambda: self.request_list(mission_type), ("MISSION_COUNT", "MISSION_ACK"),
                           lambda m: m.mission_type == mission_type and getattr(m, "type", None) != 0,
                           retry_s, patience)
        if answer.get_type() == "MISSION_ACK":
            raise Refusal(answer.type)
        items = []
        for seq in range(answer.count):
            message = self._ask(lambda: self.request_int(seq, mission_type), ("MISSION_ITEM_INT",),
                                lambda m: m.seq == seq and m.mission_type == mission_type, retry_s, patience)
            items.append(Item.from_item_int(message))
        self.ack(0, mission_type)
        return items

    def _ask(self, ask, names, where, retry_s, patience):
        for _ in range(patience):
            ask()
            answer = self.receive(*names, timeout=retry_s, where=where)
            if answer is not None:
                return answer
        raise AssertionError(f"no {names} after {patience} tries")

    def upload(self, items, mission_type=MISSION, timeout=PATIENCE_S):
        """Serves the items as they are asked for; returns the final MISSION_ACK or raises Refusal."""
        self.count(len(items), mission_type)
        asked = False
        last_progress = time.monotonic()
        while time.monotonic() - last_progress < timeout:
            message = self.receive("MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK", timeout=0.5,
                                   where=lambda m: m.mission_type == mission_type)
            if message is None:
                if not asked:
                    self.count(len(items), mission_type)  # lost, or still on its way
                continue
            asked = True
            last_progress = time.monotonic()
            if message.get_type() != "MISSION_ACK":
                self.item(message.seq, items[message.seq], mission_type)
            elif message.type == mavlink.MAV_MISSION_ACCEPTED:
                return message
            elif message.type != mavlink.MAV_MISSION_INVALID_SEQUENCE:
                raise Refusal(message.type)
        raise AssertionError("the upload got stuck")

    def command(self, command, *params):
        values = list(params) + [0.0] * (7 - len(params))
        self.send(mavlink.MAVLink_command_long_message(*self.vehicle, command, 0, *values))
        return self.expect("COMMAND_ACK", where=lambda m: m.command == command)

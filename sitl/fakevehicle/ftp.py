"""MAVLink FTP as ArduPilot serves it, with the plan files of @MISSION and nothing else.

Sessions are per (system, component, channel); a client opens with session 0 and is given a number. A repeat of the last
question is answered with the last answer. Reads go to the live plan, so a plan that changes meanwhile shows both halves.
"""

import struct
import zlib

from .ardupilot_storage import home_item
from .dialect import FENCE, MISSION, RALLY, mavlink

MAGIC = 0x763D
MOST_DATA = 239
HEADER_BYTES, ITEM_BYTES = 10, 38
MOST_SESSIONS = 5
SESSION_TIMEOUT_S = 3.0
CLAIMED_SIZE = 1024 * 1024  # of every plan file
FILES = {b"@MISSION/mission.dat": MISSION, b"@MISSION/fence.dat": FENCE, b"@MISSION/rally.dat": RALLY}

TERMINATE, RESET, OPEN_RO, READ, CRC32, BURST = 1, 2, 4, 5, 14, 15
ACK, NAK = 128, 129
FAIL, WRONG_SIZE, NO_SESSIONS, END_OF_FILE, UNKNOWN_COMMAND, NO_FILE = 1, 3, 5, 6, 7, 10


class Session:
    def __init__(self, number, owner, now):
        self.number, self.owner, self.used_at = number, owner, now
        self.mission_type = None  # of the open file


class Ftp:
    def __init__(self, vehicle):
        self.vehicle = vehicle
        self.reset()

    def reset(self):
        self.sessions, self.next_number, self.last = {}, 1, None

    def handle(self, channel, msg):
        if msg.get_type() != "FILE_TRANSFER_PROTOCOL" or not self.vehicle.persona.serves_files:
            return False
        payload = bytes(msg.payload)
        seq, number, opcode, size, _, _, _, offset = struct.unpack("<HBBBBBBI", payload[:12])
        peer = (msg.get_srcSystem(), msg.get_srcComponent())
        answer = Answer(channel, peer, seq, number, opcode)
        refused = self.vehicle.faults.take("refuse-ftp")
        if refused:
            answer.send(NAK, bytes([refused.options["code"]]))
            return True
        if opcode == RESET:
            for key in [key for key, session in self.sessions.items() if session.owner == (peer, channel)]:
                del self.sessions[key]
            answer.send(ACK)
            return True
        session = self._session(peer, channel, number)
        if session is None:
            answer.send(NAK, bytes([NO_SESSIONS]))
            return True
        answer.number = session.number
        if self.last and self.last[0] == (peer, session.number, seq):
            channel.send(self.last[1])
            return True
        self._carry_out(session, opcode, offset, payload[12:], size, answer)
        self.last = ((peer, session.number, seq), answer.message)
        return True

    def _session(self, peer, channel, number):
        now, owner = self.vehicle.loop.time(), (peer, channel)
        session = self.sessions.get(number)
        if session is None or session.owner != owner:
            idle = [key for key, other in self.sessions.items() if now - other.used_at > SESSION_TIMEOUT_S]
            if len(self.sessions) >= MOST_SESSIONS:
                if not idle:
                    return None
                del self.sessions[min(idle, key=lambda key: self.sessions[key].used_at)]
            if number == 0:
                number, self.next_number = self.next_number, self.next_number % 255 + 1
            session = self.sessions[number] = Session(number, owner, now)
        session.used_at = now
        return session

    def _carry_out(self, session, opcode, offset, data, size, answer):
        if opcode == TERMINATE:
            self.sessions.pop(session.number, None)
            answer.send(ACK)
        elif opcode == OPEN_RO:
            mission_type = FILES.get(data[:size].rstrip(b"\0"))
            if session.mission_type is not None:
                answer.send(NAK, bytes([FAIL]))
            elif mission_type is None:
                answer.send(NAK, bytes([NO_FILE]))
            else:
                session.mission_type = mission_type
                self.vehicle.event("ftp_open", file=data[:size].decode(errors="replace"))
                answer.send(ACK, struct.pack("<I", CLAIMED_SIZE))
        elif opcode == READ:
            if session.mission_type is None or size > MOST_DATA:
                answer.send(NAK, bytes([NO_FILE if size <= MOST_DATA else WRONG_SIZE]))
                return
            content = self._file(session.mission_type, asked=range(offset, offset + size))[offset:offset + size]
            self._read_events(session.mission_type, offset, len(content))
            if content:
                answer.send(ACK, content, offset)
            else:
                answer.send(NAK, bytes([END_OF_FILE]), offset)
        elif opcode == BURST:
            self._burst(session, offset, size or MOST_DATA, answer)
        elif opcode == CRC32:
            mission_type = FILES.get(data[:size].rstrip(b"\0"))
            if mission_type is None:
                answer.send(NAK, bytes([NO_FILE]))
            else:
                # Nothing is inverted at either end, unlike zlib.
                crc = zlib.crc32(self._file(mission_type), 0xFFFFFFFF) ^ 0xFFFFFFFF
                answer.send(ACK, struct.pack("<I", crc))
        else:
            answer.send(NAK, bytes([UNKNOWN_COMMAND]))

    def _burst(self, session, offset, size, answer):
        """All that follows, piece by piece, and the end of the file."""
        if session.mission_type is None or size > MOST_DATA:
            answer.send(NAK, bytes([NO_FILE if size <= MOST_DATA else WRONG_SIZE]))
            return
        content = self._file(session.mission_type, asked=range(offset, CLAIMED_SIZE))
        for at in range(offset, len(content), size):
            piece = content[at:at + size]
            self._read_events(session.mission_type, at, len(piece))
            answer.send(ACK, piece, at)
            answer.seq += 1
        answer.send(NAK, bytes([END_OF_FILE]), max(offset, len(content)))

    def _read_events(self, mission_type, offset, length):
        """For the faults that strike after an item went through."""
        name = {MISSION: "mission", FENCE: "fence", RALLY: "rally"}[mission_type]
        begin, end = offset - HEADER_BYTES, offset - HEADER_BYTES + length
        for seq in range(max(0, -(-begin // ITEM_BYTES)), max(0, end // ITEM_BYTES)):
            self.vehicle.event("download_item", type=name, item=seq, to=[])

    def _file(self, mission_type, asked=range(0)):
        """The whole file; faults strike what is in the bytes that were `asked` for."""
        items = list(self.vehicle.store.items[mission_type])
        if mission_type == MISSION and items:
            items[0] = home_item(self.vehicle.home)
        count = len(items)
        if asked and asked.start < HEADER_BYTES:
            lie = self.vehicle.faults.take("lying-count", mission_type=mission_type)
            if lie:
                count = lie.options["count"] if lie.options["count"] is not None else count + lie.options["delta"]
                count = max(0, min(65535, count))
        content = [struct.pack("<HHHHH", MAGIC, mission_type, 0, 0, count)]
        for seq, item in enumerate(items):
            starts = HEADER_BYTES + seq * ITEM_BYTES
            is_asked = starts < asked.stop and asked.start < starts + ITEM_BYTES
            bad = self.vehicle.faults.take("bad-value", mission_type=mission_type, item=seq) if is_asked else None
            content.append(item_bytes(bad.spoil(item) if bad else item, seq, mission_type))
        return b"".join(content)


def item_bytes(item, seq, mission_type):
    """A MISSION_ITEM_INT payload in wire order, 38 bytes."""
    return struct.pack("<ffffiifHHBBBBBB", *item.params, item.x, item.y, item.z, seq, item.command, 1, 1,
                       item.frame, item.current, item.autocontinue, mission_type)


class Answer:
    def __init__(self, channel, peer, seq, number, opcode):
        self.channel, self.peer, self.seq, self.number, self.opcode = channel, peer, seq, number, opcode
        self.message = None

    def send(self, opcode, data=b"", offset=0):
        head = struct.pack("<HBBBBBBI", (self.seq + 1) % 65536, self.number, opcode, len(data), self.opcode, 0, 0, offset)
        payload = (head + data).ljust(251, b"\0")
        self.message = mavlink.MAVLink_file_transfer_protocol_message(0, *self.peer, list(payload))
        self.channel.send(self.message)

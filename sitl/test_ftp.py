"""The fake vehicle's plan files, read by pymavlink's own MAVLink FTP client."""

import os
import struct
import tempfile
import unittest
import zlib

from mavlink_client import Fake
from pymavlink import mavftp, mavutil

ITEM = struct.Struct("<ffffiifHHBBBBBB")


def waypoints(count):
    return [{"command": 16, "frame": 3, "x": 473977420 + 900 * k, "y": 85455940, "z": 30.0} for k in range(count)]


class PlanFiles(unittest.TestCase):
    def read(self, fake, name):
        """The content of a file, and the vehicle's checksum of it."""
        port = fake.ready["links"][0]["port"]
        link = mavutil.mavlink_connection(f"udpout:127.0.0.1:{port}", source_system=1, source_component=195)
        self.addCleanup(link.close)
        link.mav.heartbeat_send(18, 8, 0, 0, 4)
        client = mavftp.MAVFTP(link, 1, 1)
        with tempfile.TemporaryDirectory() as directory:
            local = os.path.join(directory, "plan")
            client.cmd_get([name, local])
            client.process_ftp_reply("OpenFileRO", timeout=10)
            with open(local, "rb") as file:
                content = file.read()
        link.mav.srcComponent = 196  # another client: the first one's session is busy
        answers = []
        payload = struct.pack("<HBBBBBBI", 500, 0, 14, len(name), 0, 0, 0, 0) + name.encode()
        link.mav.file_transfer_protocol_send(0, 1, 1, list(payload.ljust(251, b"\0")))
        while not answers:
            message = link.recv_match(type="FILE_TRANSFER_PROTOCOL", blocking=True, timeout=10)
            self.assertIsNotNone(message)
            if message.target_component == 196:
                answers.append(bytes(message.payload))
        return content, struct.unpack("<I", answers[0][12:16])[0]

    def test_a_mission_is_a_header_and_items_in_wire_order(self):
        with Fake() as fake:
            fake.command(cmd="set", mission=waypoints(40))
            held = fake.command(cmd="dump")["dump"]["mission"]["items"]
            content, checksum = self.read(fake, "@MISSION/mission.dat")
        self.assertEqual(struct.unpack("<HHHHH", content[:10]), (0x763D, 0, 0, 0, 41))
        items = list(ITEM.iter_unpack(content[10:]))
        self.assertEqual([(item[4], item[5], item[7], item[8]) for item in items],
                         [(item["x"], item["y"], item["seq"], item["command"]) for item in held])
        self.assertEqual(checksum, zlib.crc32(content, 0xFFFFFFFF) ^ 0xFFFFFFFF)

    def test_an_empty_fence_is_a_header(self):
        with Fake() as fake:
            content, _ = self.read(fake, "@MISSION/fence.dat")
        self.assertEqual(struct.unpack("<HHHHH", content), (0x763D, 1, 0, 0, 0))


if __name__ == "__main__":
    unittest.main()

"""Tests of the fake vehicle, from outside: a real process, real links. Run: python -m unittest"""

import json
import os
import signal
import subprocess
import sys
import tempfile
import unittest

from mavlink_client import Fake, HERE, Refusal
from fakevehicle.dialect import ALL, FENCE, MISSION, RALLY, mavlink
from fakevehicle.items import Item

LAT, LON = 221965145, 1135411031
FAST = ("--speedup", "20")


def waypoint(number=0, frame=6, command=16, z=50.0, params=(0.0, 0.0, 0.0, 0.0)):
    return Item(command, frame, params, LAT + 1000 * number, LON + 2000 * number, z)


def mission(count):
    return [waypoint(command=22)] + [waypoint(n) for n in range(1, count)]


def polygon(count, command=5002, number=0):
    return [Item(command, 0, (float(count), 0.0, 0.0, 0.0), LAT + 500 * n + 10000 * number, LON + 700 * (n % 2))
            for n in range(count)]


def circle(radius=30.5, command=5004):
    return Item(command, 0, (radius, 0.0, 0.0, 0.0), LAT, LON)


def rally(z=40.7):
    return Item(5100, 3, (0.0,) * 4, LAT, LON, z)


PLAN = {
    "fileType": "Plan", "version": 1, "groundStation": "QGroundControl",
    "mission": {"version": 2, "plannedHomePosition": [22.1, 113.5, 12.5], "items": [
        {"type": "SimpleItem", "command": 22, "frame": 3, "doJumpId": 1, "autoContinue": True,
         "params": [0, 0, 0, None, 22.1, 113.5, 30]},
        {"type": "ComplexItem", "complexItemType": "survey", "TransectStyleComplexItem": {"Items": [
            {"type": "SimpleItem", "command": 16, "frame": 3, "doJumpId": 2, "autoContinue": True,
             "params": [0, 0, 0, None, 22.2, 113.6, 30]}]}},
        {"type": "SimpleItem", "command": 177, "frame": 2, "doJumpId": 3, "autoContinue": True,
         "params": [2, 5, 0, 0, 0, 0, 0]}]},
    "geoFence": {"version": 2,
                 "polygons": [{"version": 1, "inclusion": False,
                               "polygon": [[22.1, 113.5], [22.2, 113.5], [22.2, 113.6]]}],
                 "circles": [{"version": 1, "inclusion": True, "circle": {"center": [22.1, 113.5], "radius": 500.5}}],
                 "breachReturn": [22.15, 113.55, 40]},
    "rallyPoints": {"version": 2, "points": [[22.1, 113.5, 25]]},
}

WAYPOINTS = """QGC WPL 110
0\t1\t0\t16\t0\t0\t0\t0\t-35.3632621\t149.1652374\t584.0\t1
1\t0\t3\t22\t0\t0\t0\t0\t-35.3632621\t149.1652374\t20.0\t1
2\t0\t3\t16\t0\t0\t0\t0\t-35.3600000\t149.1600000\t30.0\t1
3\t0\t0\t177\t1\t-1\t0\t0\t0\t0\t0\t1
"""


class WithFiles(unittest.TestCase):
    def setUp(self):
        self.directory = tempfile.TemporaryDirectory()
        self.addCleanup(self.directory.cleanup)

    def file(self, name, content):
        path = os.path.join(self.directory.name, name)
        with open(path, "w", encoding="utf-8") as file:
            file.write(content if isinstance(content, str) else json.dumps(content))
        return path


class Links(WithFiles):
    def round_trip(self, link):
        for persona in ("ardupilot", "px4"):
            with self.subTest(persona=persona), Fake("--persona", persona, links=[link]) as fake:
                with fake.client() as client:
                    heartbeat = client.expect("HEARTBEAT")
                    self.assertEqual(heartbeat.autopilot, 3 if persona == "ardupilot" else 12)
                    for mission_type, items in ((MISSION, mission(12)), (FENCE, polygon(4)), (RALLY, [rally()])):
                        client.upload(items, mission_type)
                        back = client.download(mission_type)
                        start = 1 if (persona, mission_type) == ("ardupilot", MISSION) else 0
                        self.assertEqual([(i.x, i.y, i.command) for i in back[start:]],
                                         [(i.x, i.y, i.command) for i in items[start:]])

    def test_udp_carries_all_three_plans_both_ways(self):
        self.round_trip("udpin:127.0.0.1:0")

    def test_tcp_carries_all_three_plans_both_ways(self):
        self.round_trip("tcpin:127.0.0.1:0")

    def test_a_pty_carries_all_three_plans_both_ways(self):
        self.round_trip("pty:" + os.path.join(self.directory.name, "serial"))


class ArduPilot(WithFiles):
    def test_home_is_item_zero_whatever_was_uploaded_there(self):
        with Fake("--home=1.5,2.5,3.25") as fake, fake.client() as client:
            client.upload([waypoint(7), waypoint(1)])
            back = client.download()
            self.assertEqual((back[0].x, back[0].y, back[0].z, back[0].frame), (15000000, 25000000, 3.25, 0))
            self.assertEqual(len(back), 2)
            self.assertEqual(client.command(512, 42).result, 0)
            self.assertEqual(client.expect("MISSION_CURRENT").total, 1)

    def test_storage_is_lossy_the_way_ardupilot_is(self):
        land = Item(21, 6, (0.0, 0.0, 0.0, 0.0), LAT, LON, 0.0, current=1)
        sent = [waypoint(), waypoint(1, z=30.123, params=(1.7, 5.0, 6.0, float("nan"))), land]
        with Fake() as fake, fake.client() as client:
            client.upload(sent)
            _, stored, landed = client.download()
            self.assertEqual((stored.frame, stored.params, round(stored.z, 4)), (3, (1.0, 0.0, 0.0, 0.0), 30.12))
            self.assertEqual((landed.params[3], landed.current), (1.0, 0))

    def test_it_asks_with_the_old_request_and_warns_of_repeats_but_goes_on(self):
        items = mission(4)
        with Fake() as fake, fake.client() as client:
            client.count(4)
            repeats = 0
            while True:
                message = client.expect("MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK")
                if message.get_type() == "MISSION_REQUEST":
                    client.item(message.seq, items[message.seq])
                    client.item(message.seq, items[message.seq])
                elif message.type == mavlink.MAV_MISSION_INVALID_SEQUENCE:
                    repeats += 1
                else:
                    break
            self.assertEqual((message.get_type(), message.type, repeats), ("MISSION_ACK", 0, 3))

    def test_an_abandoned_upload_leaves_half_a_mission(self):
        with Fake(*FAST) as fake, fake.client() as client:
            client.upload(mission(6))
            client.count(4)
            for seq in range(2):
                client.expect("MISSION_REQUEST", where=lambda m: m.seq == seq)
                client.item(seq, waypoint(seq + 50))
            ack = client.expect("MISSION_ACK")
            self.assertEqual(ack.type, mavlink.MAV_MISSION_OPERATION_CANCELLED)
            self.assertIn("Mission upload timeout", client.texts)
            back = client.download()
            self.assertEqual([item.x for item in back[1:]], [waypoint(n).x for n in (51, 2, 3)])

    def test_a_bad_fence_is_refused_in_words_and_the_old_one_stays(self):
        good = polygon(4)
        bad = {
            "Invalid vertex count (2)": polygon(2),
            "Incorrect item count": polygon(4)[:3],
            "Received incorrect vertex type": polygon(4)[:2] + polygon(4, 5001)[:2],
            "Unexpected vertex count": polygon(4)[:2] + polygon(3)[:2],
            "Non-positive circle radius": [circle(0.0)],
            "Bad lat or lon": [Item(5004, 0, (5.0, 0, 0, 0), 10**9, 0)],
            "Multiple return points": [Item(5000, 0, x=1, y=1), Item(5000, 0, x=2, y=2)],
        }
        with Fake() as fake, fake.client() as client:
            client.upload(good, FENCE)
            for text, items in bad.items():
                with self.subTest(text), self.assertRaises(Refusal) as refusal:
                    client.upload(items, FENCE)
                self.assertEqual(refusal.exception.code, mavlink.MAV_MISSION_ERROR)
                self.assertIn(text, client.texts)
                self.assertIn("Fence validation failed", client.texts)
            for code, items in ((2, [Item(5004, 1, (5.0, 0, 0, 0))]), (3, [waypoint()])):
                with self.assertRaises(Refusal) as refusal:
                    client.upload(items, FENCE)
                self.assertEqual(refusal.exception.code, code)
            self.assertEqual([item.x for item in client.download(FENCE)], [item.x for item in good])

    def test_a_polygon_fence_replaced_by_one_circle_is_accepted_and_then_gone(self):
        with Fake() as fake, fake.client() as client:
            client.upload(polygon(4), FENCE)
            client.upload([circle()], FENCE)
            fake.wait_for_event("fence_erased")
            self.assertEqual(client.download(FENCE), [])

    def test_a_second_client_is_denied_and_other_plans_still_work(self):
        with Fake() as fake, fake.client() as one, fake.client(system=255, component=190) as two:
            one.upload(mission(3))
            one.count(3, FENCE)
            one.expect("MISSION_REQUEST")
            for ask in (two.request_list, lambda kind: two.request_int(0, kind), lambda kind: two.count(1, kind),
                        lambda kind: two.send(mavlink.MAVLink_mission_clear_all_message(1, 1, kind))):
                ask(FENCE)
                self.assertEqual(two.expect("MISSION_ACK").type, mavlink.MAV_MISSION_DENIED)
            self.assertEqual(len(two.download(MISSION)), 3)

    def test_refusals_out_of_range_too_many_clear_all_types_and_bad_jump(self):
        with Fake() as fake, fake.client() as client:
            client.upload(mission(3))
            client.request_int(9)
            self.assertEqual(client.expect("MISSION_COUNT").count, 3)
            self.assertEqual(client.expect("MISSION_ACK").type, mavlink.MAV_MISSION_INVALID_SEQUENCE)
            for kind, most in ((MISSION, 650), (FENCE, 70), (RALLY, 46)):
                client.count(most + 1, kind)
                self.assertEqual(client.expect("MISSION_ACK").type, mavlink.MAV_MISSION_NO_SPACE)
            client.send(mavlink.MAVLink_mission_clear_all_message(1, 1, ALL))
            self.assertEqual(client.expect("MISSION_ACK").type, mavlink.MAV_MISSION_UNSUPPORTED)
            self.assertEqual(len(client.download()), 3)
            with self.assertRaises(Refusal):
                client.upload([waypoint(), Item(177, 2, (7.0, 1.0, 0.0, 0.0))])

    def test_an_item_marked_current_2_is_a_command_to_fly_there_and_no_part_of_the_mission(self):
        with Fake() as fake, fake.client() as client:
            client.upload(mission(3))
            client.item(1, Item(16, 3, x=LAT, y=LON, z=9.0, current=2))
            self.assertEqual(client.expect("MISSION_ACK").type, 0)
            self.assertEqual(client.download()[1].z, 50.0)
            self.assertEqual(fake.dump()["events"]["counts"]["guided_item"], 1)

    def test_a_burst_of_requests_in_any_order_is_answered(self):
        with Fake() as fake, fake.client() as client:
            client.upload(mission(40))
            for seq in reversed(range(40)):
                client.request_int(seq)
            got = [client.expect("MISSION_ITEM_INT").seq for _ in range(40)]
            self.assertEqual(got, list(reversed(range(40))))

    def test_float_items_and_the_old_request_still_work(self):
        with Fake() as fake, fake.client() as client:
            client.count(2)
            for seq in range(2):
                client.expect("MISSION_REQUEST")
                client.send(waypoint(seq, frame=3).float_message((1, 1), seq, MISSION))
            self.assertEqual(client.expect("MISSION_ACK").type, 0)
            client.send(mavlink.MAVLink_mission_request_message(1, 1, 1, MISSION))
            item = client.expect("MISSION_ITEM")
            self.assertAlmostEqual(item.x, waypoint(1).x / 1e7, places=5)


class Px4(WithFiles):
    def fake(self, *arguments, **options):
        return Fake("--persona", "px4", *arguments, **options)

    def test_item_zero_is_the_first_command_and_frames_come_back_as_int_twins(self):
        with self.fake() as fake, fake.client() as client:
            sent = [waypoint(0, frame=3, command=22), waypoint(1, frame=0), Item(177, 2, (0.0, 2.0, 0.0, 0.0))]
            ack = client.upload(sent)
            back = client.download()
            self.assertEqual([item.frame for item in back], [6, 5, 2])
            self.assertEqual(back[0].x, sent[0].x)
            self.assertNotEqual(ack.opaque_id, 0)
            self.assertEqual(client.command(512, 42).result, 0)
            current = client.expect("MISSION_CURRENT", where=lambda m: m.total == 3)
            self.assertEqual(current.mission_id, ack.opaque_id)

    def test_an_abandoned_upload_changes_nothing(self):
        with self.fake(*FAST) as fake, fake.client() as client:
            client.upload(mission(5))
            client.count(3)
            client.expect("MISSION_REQUEST_INT")
            client.item(0, waypoint(50))
            fake.wait_for_event("upload_timeout")
            self.assertEqual([item.x for item in client.download()], [item.x for item in mission(5)])

    def test_the_cursor_is_strict(self):
        with self.fake() as fake, fake.client() as client:
            client.upload(mission(5))
            client.request_list()
            client.expect("MISSION_COUNT")
            for seq in (0, 0, 1):
                client.request_int(seq)
                self.assertEqual(client.expect("MISSION_ITEM_INT").seq, seq)
            client.request_int(4)
            self.assertEqual(client.expect("MISSION_ACK").type, mavlink.MAV_MISSION_ERROR)

    def test_it_refuses_terrain_frames_and_unknown_commands_and_keeps_the_old_plan(self):
        with self.fake() as fake, fake.client() as client:
            client.upload(mission(2))
            for code, item in ((2, waypoint(frame=11)), (2, waypoint(frame=10)), (3, waypoint(command=60001))):
                with self.assertRaises(Refusal) as refusal:
                    client.upload([item])
                self.assertEqual(refusal.exception.code, code)
            self.assertEqual(len(client.download()), 2)

    def test_a_second_transfer_gets_an_error_while_one_runs(self):
        with self.fake(links=["tcpin:127.0.0.1:0", "udpin:127.0.0.1:0"]) as fake:
            with fake.client() as one, fake.client(index=1, system=255, component=190) as two:
                one.count(3)
                one.expect("MISSION_REQUEST_INT")
                two.count(2)
                self.assertEqual(two.expect("MISSION_ACK").type, mavlink.MAV_MISSION_ERROR)

    def test_clear_all_255_clears_everything_and_a_repeated_last_item_is_accepted_again(self):
        with self.fake() as fake, fake.client() as client:
            client.upload(polygon(3), FENCE)
            items = mission(3)
            client.upload(items)
            client.item(2, items[2])
            self.assertEqual(client.expect("MISSION_ACK").type, 0)
            client.send(mavlink.MAVLink_mission_clear_all_message(1, 1, ALL))
            self.assertEqual(client.expect("MISSION_ACK").type, 0)
            self.assertEqual((client.download(), client.download(FENCE)), ([], []))


class FilesAndDump(WithFiles):
    def test_a_plan_file_fills_all_three_and_sets_home(self):
        path = self.file("a.plan", PLAN)
        for persona, first in (("ardupilot", 1), ("px4", 0)):
            with self.subTest(persona), Fake("--persona", persona, "--mission", path) as fake:
                dump = fake.dump()
            self.assertEqual(dump["home"], {"lat": 22.1, "lon": 113.5, "alt": 12.5})
            items = dump["mission"]["items"][first:]
            self.assertEqual([item["command"] for item in items], [22, 16, 177])
            self.assertEqual((items[1]["x"], items[1]["y"], items[1]["z"]), (222000000, 1136000000, 30.0))
            self.assertEqual(items[2]["param1"], 1.0 + first)  # doJumpId 2 is the survey's point
            self.assertEqual([(i["command"], i["param1"]) for i in dump["fence"]["items"]],
                             [(5002, 3.0)] * 3 + [(5003, 500.5), (5000, 0.0)])
            self.assertEqual(dump["rally"]["items"][0]["z"], 25.0)

    def test_a_waypoint_file_has_home_in_its_first_line(self):
        path = self.file("a.waypoints", WAYPOINTS)
        with Fake("--mission", path) as fake:
            dump = fake.dump()
        self.assertEqual(dump["home"]["alt"], 584.0)
        self.assertEqual([item["command"] for item in dump["mission"]["items"]], [16, 22, 16, 177])
        self.assertEqual(dump["mission"]["items"][3]["param1"], 1.0)

    def test_unusable_files_and_options_end_with_status_2_and_a_reason(self):
        cases = [
            (["--mission", self.file("x.plan", "{")], "x.plan"),
            (["--mission", self.file("y.txt", "hello")], "neither"),
            (["--mission", self.file("z.waypoints", WAYPOINTS.replace("149.16\t", "999\t").replace(
                "149.1600000", "999"))], "z.waypoints:4"),
            (["--fault", "explode"], "unknown fault"), (["--fault", "drop:p=2"], "from 0 to 1"),
            (["--link", "udp:1"], "udpin|udpout"), (["--home", "91,0,0"], "planet"),
            (["--exit-on-stdin-eof"], "needs a pipe"),
        ]
        for arguments, text in cases:
            with self.subTest(arguments):
                done = subprocess.run([sys.executable, os.path.join(HERE, "fake_vehicle.py"),
                                       "--link", "udpin:127.0.0.1:0", *arguments],
                                      capture_output=True, text=True, timeout=20, stdin=subprocess.DEVNULL)
                self.assertEqual(done.returncode, 2)
                self.assertIn(text, done.stderr)
                self.assertNotIn("Traceback", done.stderr)

    def test_the_dump_is_written_on_a_signal_and_on_exit(self):
        path = os.path.join(self.directory.name, "dump.json")
        with Fake("--dump", path) as fake, fake.client() as client:
            os.kill(fake.ready["pid"], signal.SIGUSR1)
            fake.wait_for_event("dumped")
            with open(path, encoding="utf-8") as file:
                self.assertEqual(json.load(file)["mission"]["count"], 0)
            client.upload(mission(3))
        with open(path, encoding="utf-8") as file:
            dump = json.load(file)
        self.assertEqual(dump["mission"]["count"], 3)
        self.assertEqual(dump["uploads"][0]["by"], [1, 195])
        self.assertEqual(dump["uploads"][0]["result"], 0)
        self.assertEqual(len(dump["uploads"][0]["items"]), 3)
        self.assertEqual(fake.status, 0)

    def test_sigterm_ends_it_with_status_0_and_removes_the_symlink(self):
        link = os.path.join(self.directory.name, "serial")
        fake = Fake(links=[f"pty:{link}"])
        self.assertTrue(os.path.islink(link))
        os.kill(fake.ready["pid"], signal.SIGTERM)
        self.assertEqual(fake.process.wait(10), 0)
        self.assertFalse(os.path.islink(link))
        fake.__exit__()


if __name__ == "__main__":
    unittest.main()

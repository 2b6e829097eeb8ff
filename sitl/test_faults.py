"""Tests of the fake vehicle's misbehaviour, control channel, routing and signing. Run: python -m unittest"""

import json
import os
import random
import re
import socket
import struct
import subprocess
import sys
import unittest

from mavlink_client import Fake, HERE, Refusal
from fakevehicle import cli
from fakevehicle.dialect import FENCE, MISSION, mavlink
from fakevehicle.faults import FaultError, Faults, KINDS, parse_fault
from test_fake_vehicle import FAST, WithFiles, mission, polygon, waypoint

PERSONAS = ("ardupilot", "px4")
SPEED = {"ardupilot": "10", "px4": "5"}  # ArduPilot asks again after 1 s, PX4 after 0.25 s


def places(items):
    return [(item.x, item.y) for item in items]


class OnFrames(WithFiles):
    def test_transfers_survive_loss_repeats_and_disorder(self):
        spoilers = ["drop:p=0.3,msg=MISSION_ITEM_INT+MISSION_REQUEST+MISSION_REQUEST_INT", "duplicate:p=0.3",
                    "reorder:p=0.3,ms=20,dir=tx", "corrupt:p=0.2,msg=MISSION_ITEM_INT",
                    "delay:ms=10,jitter=20", "silence:for=0.1,every=0.4,msg=MISSION_ITEM_INT"]
        for persona in PERSONAS:
            for spec in spoilers:
                with self.subTest(persona=persona, fault=spec):
                    options = ("--persona", persona, "--fault", spec, "--speedup", SPEED[persona])
                    with Fake(*options) as fake, fake.client() as client:
                        sent = mission(10)
                        client.upload(sent)
                        held = fake.dump()
                        self.assertEqual([(i["x"], i["y"]) for i in held["mission"]["items"]][1:], places(sent)[1:])
                        self.assertGreater(held["faults"][0]["applied"], 0)
                        if persona == "ardupilot" or "reorder" not in spec:
                            client.settle()
                            self.assertEqual(places(client.download(retry_s=0.1))[1:], places(sent)[1:])

    def test_delay_with_jitter_keeps_the_order_and_reorder_does_not(self):
        def order(spec):
            with Fake("--fault", spec) as fake, fake.client() as client:
                client.upload(mission(60))
                for seq in range(60):
                    client.request_int(seq)
                return [client.expect("MISSION_ITEM_INT").seq for _ in range(60)]
        self.assertEqual(order("delay:ms=1,jitter=30,dir=tx"), list(range(60)))
        shuffled = order("reorder:p=0.5,ms=60,dir=tx,msg=MISSION_ITEM_INT")
        self.assertNotEqual(shuffled, list(range(60)))
        self.assertEqual(sorted(shuffled), list(range(60)))

    def test_corrupted_frames_never_pass_as_good_ones(self):
        with Fake("--fault", "corrupt:dir=tx,msg=COMMAND_ACK") as fake, fake.client() as client:
            client.send(mavlink.MAVLink_command_long_message(1, 1, 512, 0, 148, 0, 0, 0, 0, 0, 0))
            self.assertIsNotNone(client.receive("AUTOPILOT_VERSION"))
            self.assertEqual(fake.command(cmd="clear-faults")["ok"], True)
            self.assertEqual(client.command(512, 148).result, 0)

    def test_a_seed_repeats_every_decision(self):
        def decisions(seed):
            faults = Faults(seed, clock=lambda: 1.0)
            faults.add("drop:p=0.5")
            return [faults.frame("rx", "HEARTBEAT", 0).lost for _ in range(200)]
        self.assertEqual(decisions(7), decisions(7))
        self.assertNotEqual(decisions(7), decisions(8))

    def test_windows_links_directions_and_times_limit_a_fault(self):
        now = [0.0]
        faults = Faults(1, clock=lambda: now[0])
        faults.add("drop:from=1,until=2,dir=rx,link=0,times=2,msg=HEARTBEAT")

        def lost(direction="rx", name="HEARTBEAT", link=0):
            return faults.frame(direction, name, link).lost

        self.assertFalse(lost())
        now[0] = 1.5
        self.assertEqual([lost("tx"), lost(name="STATUSTEXT"), lost(link=1), lost(), lost(), lost()],
                         [False, False, False, True, True, False])

    def test_a_fault_that_makes_no_sense_is_refused_with_a_reason(self):
        for spec in ("", "nonsense", "drop:p", "drop:p=x", "drop:q=1", "reboot", "bad-value:field=q", "delay:ms=-1",
                     "delay:ms=nan", "refuse-item:type=all"):
            with self.subTest(spec), self.assertRaises(FaultError):
                parse_fault(spec)

    def test_garbage_and_hostile_frames_do_not_stop_it(self):
        generator = random.Random(5)
        for link in ("udpin:127.0.0.1:0", "tcpin:127.0.0.1:0"):
            with self.subTest(link), Fake(links=[link]) as fake, fake.client() as client:
                for _ in range(200):
                    client.send_raw(bytes(generator.randrange(256) for _ in range(200)))
                client.send_raw(b"\0" * 600)  # lets a parser that waits for a long frame finish it
                client.upload(mission(3))
                self.assertNotIn("internal_error", fake.dump()["events"]["counts"])


class Documentation(unittest.TestCase):
    def test_the_readme_names_every_option_fault_key_and_event(self):
        with open(os.path.join(HERE, "README.md"), encoding="utf-8") as file:
            readme = file.read()
        options = [option for action in cli.parser()._actions for option in action.option_strings if len(option) > 2]
        keys = [key for group, own, _ in KINDS.values() for key in (*group, *own)]
        events = set()
        for name in os.listdir(os.path.join(HERE, "fakevehicle")):
            if name.endswith(".py"):
                with open(os.path.join(HERE, "fakevehicle", name), encoding="utf-8") as file:
                    events.update(re.findall(r'event\("(\w+)"', file.read()))
        self.assertIn("upload_item", events)
        missing = [word for word in (*options, *KINDS, *keys, *events)
                   if not re.search(rf"(?<![\w-]){re.escape(word)}(?![\w-])", readme)]
        self.assertEqual(missing, [])


class OnPlans(WithFiles):
    def test_count_and_item_are_refused_with_the_chosen_code(self):
        for persona in PERSONAS:
            with self.subTest(persona), Fake("--persona", persona, "--fault", "refuse-count:code=14,times=1", "--fault",
                                             "refuse-item:item=2,code=10,type=mission,times=1") as fake:
                with fake.client() as client:
                    for code in (14, 10):
                        with self.assertRaises(Refusal) as refusal:
                            client.upload(mission(4))
                        self.assertEqual(refusal.exception.code, code)
                    client.upload(mission(4))

    def test_half_write_is_accepted_but_not_stored(self):
        for persona in PERSONAS:
            with self.subTest(persona), Fake("--persona", persona, "--fault", "half-write:item=3") as fake:
                with fake.client() as client:
                    client.upload(mission(6))
                    self.assertEqual(len(client.download()), 3)

    def test_a_mis_stored_item_is_accepted_and_comes_back_false(self):
        for persona in PERSONAS:
            fault = "mis-store:item=2,field=x,value=77,times=1"
            with self.subTest(persona), Fake("--persona", persona, "--fault", fault) as fake:
                with fake.client() as client:
                    client.upload(mission(4))
                    self.assertEqual(client.download()[2].x, 77)
                    client.upload(mission(4))
                    self.assertEqual(places(client.download())[2], places(mission(4))[2])

    def test_busy_denies_until_its_time_is_over(self):
        for persona, code in (("ardupilot", 14), ("px4", 1)):
            with self.subTest(persona), Fake("--persona", persona) as fake, fake.client() as client:
                number = fake.command(cmd="fault", spec="busy:type=mission")["number"]
                with self.assertRaises(Refusal) as refusal:
                    client.upload(mission(3))
                self.assertEqual(refusal.exception.code, code)
                fake.command(cmd="clear-faults", number=number)
                client.upload(mission(3))

    def test_lying_counts_and_bad_values_are_only_on_the_wire(self):
        with Fake("--fault", "lying-count:delta=5,times=1", "--fault",
                  "bad-value:item=1,field=z,value=nan,times=1") as fake, fake.client() as client:
            client.upload(mission(3))
            client.request_list()
            self.assertEqual(client.expect("MISSION_COUNT").count, 8)
            client.request_int(1)
            bad = client.expect("MISSION_ITEM_INT").z
            self.assertNotEqual(bad, bad)
            self.assertEqual([item.z for item in client.download()][1:], [50.0, 50.0])

    def test_a_fence_vanishes_after_it_was_accepted(self):
        for persona in PERSONAS:
            with self.subTest(persona), Fake("--persona", persona, "--fault", "vanish-fence:after=0.1") as fake:
                with fake.client() as client:
                    client.upload(polygon(4), FENCE)
                    fake.wait_for_event("fence_erased")
                    self.assertEqual(client.download(FENCE), [])

    def test_a_reboot_in_mid_upload_keeps_what_was_stored_and_forgets_the_rest(self):
        old, new = mission(6), [waypoint(n + 100) for n in range(6)]
        expected = {"ardupilot": places(new[1:3] + old[3:])[:5], "px4": places(old)}
        for persona in PERSONAS:
            with self.subTest(persona), Fake("--persona", persona) as fake, fake.client() as client:
                client.upload(old)
                before = fake.dump()
                fake.command(cmd="fault", spec="reboot:item=2,for=0.1,times=1,type=mission")
                client.count(6)
                for seq in range(3):
                    client.expect("MISSION_REQUEST", "MISSION_REQUEST_INT", where=lambda m: m.seq == seq)
                    client.item(seq, new[seq])
                after = fake.wait_for_event("booted")
                self.assertEqual((before["boots"], after["boots"]), (1, 2))
                client.heartbeat()
                items = client.download()
                self.assertEqual(places(items[1:] if persona == "ardupilot" else items), expected[persona])

    def test_time_since_boot_falls_after_a_reboot(self):
        with Fake() as fake, fake.client() as client:
            def boot_ms():
                client.command(512, 2)
                return client.expect("SYSTEM_TIME").time_boot_ms
            fake.wait_for_event("heard")
            while boot_ms() < 300:
                pass
            fake.command(cmd="reboot", **{"for": 0.05})
            fake.wait_for_event("booted")
            client.heartbeat()
            self.assertLess(boot_ms(), 300)

    def test_it_vanishes_for_good_at_an_item(self):
        with Fake("--fault", "vanish:item=1") as fake, fake.client() as client:
            with self.assertRaises(AssertionError):
                client.upload(mission(4), timeout=0.5)
            client.heartbeat()
            client.request_list()
            self.assertIsNone(client.receive("MISSION_COUNT", "HEARTBEAT", timeout=1.5))
            self.assertTrue(fake.dump()["vanished"])

    def test_a_second_ground_station_gets_in_the_way_and_changes_the_plan(self):
        for persona, code in (("ardupilot", 14), ("px4", 1)):
            with self.subTest(persona), Fake("--persona", persona) as fake, fake.client() as client:
                client.upload(mission(3))
                fake.command(cmd="fault", spec="second-gcs:at=0,count=4,pace=80")
                fake.wait_for_event("second_gcs")
                with self.assertRaises(Refusal) as refusal:
                    client.upload(mission(3))
                self.assertEqual(refusal.exception.code, code)
                dump = fake.wait_for_event("second_gcs_ack")
                self.assertEqual(dump["mission"]["count"], 4)
                self.assertEqual(dump["uploads"][-1]["by"], [255, 190])

    def test_a_second_ground_station_that_gives_up_leaves_a_truncated_mission(self):
        with Fake(*FAST) as fake, fake.client() as client:
            client.upload(mission(8))
            fake.command(cmd="gcs-upload", items=[waypoint(n).to_json(n) for n in range(3)], pace=0.01, stop=1)
            self.assertEqual(fake.wait_for_event("upload_timeout")["mission"]["count"], 3)


class ControlAndScript(WithFiles):
    def test_wait_answers_when_the_event_happens_and_gives_up_after_its_time(self):
        with Fake() as fake, fake.client() as client:
            self.assertFalse(fake.command(cmd="wait", on="upload_item", **{"for": 0.05})["ok"])
            client.count(4)
            answer = fake.command(cmd="wait", on="statustext", **{"for": 0.01})
            self.assertFalse(answer["ok"])
            fake.control_file.write(json.dumps({"cmd": "wait", "on": "upload_item", "where": {"item": 1}}) + "\n")
            fake.control_file.flush()
            for seq in range(2):
                client.expect("MISSION_REQUEST", where=lambda m: m.seq == seq)
                client.item(seq, waypoint(seq))
            answer = json.loads(fake.control_file.readline())
            self.assertEqual((answer["ok"], answer["fields"]["item"]), (True, 1))

    def test_reset_leaves_nothing_of_what_was_before(self):
        for persona in PERSONAS:
            with self.subTest(persona), Fake("--persona", persona, "--fault", "drop:p=0.9") as fake:
                fake.command(cmd="set", armed=True, mission=[waypoint(n).to_json(n) for n in range(3)])
                fake.command(cmd="fault", spec="reboot:at=0.2")
                fake.command(cmd="reset", seed=9)
                dump = fake.dump()
                self.assertEqual((dump["mission"]["count"], dump["armed"], dump["faults"], dump["seed"]),
                                 (0, False, [], 9))
                with fake.client() as client:
                    client.upload(mission(3))
                    self.assertEqual(len(client.download()), 3)
                    self.assertEqual(fake.dump()["boots"], 1)

    def test_set_changes_what_the_peer_sees(self):
        with Fake() as fake, fake.client() as client:
            answer = fake.command(cmd="set", armed=True, mode="AUTO", mission=[waypoint(1).to_json(0)], current=1,
                                  param={"FENCE_ENABLE": 0}, position=[1.0, 2.0, 3.0])
            self.assertEqual(answer, {"ok": True})
            heartbeat = client.expect("HEARTBEAT", where=lambda m: m.custom_mode == 3)
            self.assertTrue(heartbeat.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)
            self.assertEqual(places(client.download())[1:], places([waypoint(1)]))
            client.command(512, 33)
            self.assertEqual(client.expect("GLOBAL_POSITION_INT").lat, 10000000)
            client.send(mavlink.MAVLink_mission_clear_all_message(1, 1, MISSION))
            self.assertEqual(client.expect("MISSION_ACK").type, mavlink.MAV_MISSION_ERROR)  # flying it

    def test_wrong_commands_are_answered_with_a_reason(self):
        with Fake() as fake:
            for command in ({"cmd": "nonsense"}, {"cmd": "set", "mode": "X"}, {"cmd": "set", "colour": 1},
                            {"cmd": "fault", "spec": "x"}, {"cmd": "set", "current": 99},
                            {"cmd": "set", "mission": [{"frame": 0}]}):
                answer = fake.command(**command)
                self.assertFalse(answer["ok"])
                self.assertTrue(answer["error"])
            fake.control_file.write("[1]\nnot json\n")
            fake.control_file.flush()
            for _ in range(2):
                self.assertIn('"ok": false', fake.control_file.readline())

    def test_a_script_acts_at_events_and_times(self):
        script = self.file("script.jsonl", "\n".join((
            "# the second item of the second upload",
            '{"on": "upload_item", "where": {"type": "mission", "item": 1}, "nth": 2, "cmd": "set", "armed": true}',
            '{"at": 0.05, "cmd": "set", "position": [10, 20, 30]}')))
        with Fake("--script", script) as fake, fake.client() as client:
            client.upload(mission(3))
            self.assertFalse(fake.dump()["armed"])
            client.upload(mission(3))
            dump = fake.dump()
            self.assertTrue(dump["armed"])
            while dump["position"]["lat"] != 10:
                dump = fake.dump()

    def test_a_unix_socket_serves_as_control_channel(self):
        path = os.path.join(self.directory.name, "control")
        process = subprocess.Popen(
            [sys.executable, os.path.join(HERE, "fake_vehicle.py"), "--link", "pty", "--control", f"unix:{path}"],
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.addCleanup(process.stdout.close)
        self.assertEqual(json.loads(process.stdout.readline())["control"], {"unix": path})
        with socket.socket(socket.AF_UNIX) as control:
            control.connect(path)
            control.sendall(b'{"cmd": "quit"}\n')
            self.assertEqual(control.recv(100), b'{"ok": true}\n')
        self.assertEqual(process.wait(10), 0)
        self.assertFalse(os.path.exists(path))


class CommandsAndParameters(WithFiles):
    def test_unknown_commands_are_unsupported_and_version_has_the_capabilities(self):
        for persona in PERSONAS:
            with self.subTest(persona), Fake("--persona", persona) as fake, fake.client() as client:
                self.assertEqual(client.command(31010).result, mavlink.MAV_RESULT_UNSUPPORTED)
                self.assertEqual(client.command(512, float("nan")).result, mavlink.MAV_RESULT_DENIED)
                client.command(512, 148)
                bits = client.expect("AUTOPILOT_VERSION").capabilities
                for bit in (4, 8192, 16384, 32768):
                    self.assertTrue(bits & bit)

    def test_streams_start_and_stop_on_request(self):
        with Fake() as fake, fake.client() as client:
            self.assertEqual(client.command(511, 33, 20000).result, 0)
            for _ in range(3):
                client.expect("GLOBAL_POSITION_INT")
            self.assertEqual(client.command(511, 33, -1).result, 0)
            self.assertEqual(client.command(511, 9999, 20000).result, mavlink.MAV_RESULT_FAILED)

    def test_parameters_are_encoded_each_autopilots_way(self):
        for persona, name in (("ardupilot", b"FENCE_ACTION"), ("px4", b"GF_ACTION")):
            with self.subTest(persona), Fake("--persona", persona) as fake, fake.client() as client:
                def value():
                    raw = client.expect("PARAM_VALUE", where=lambda m: m.param_id == name.decode()).param_value
                    return struct.unpack("<i", struct.pack("<f", raw))[0] if persona == "px4" else raw
                three = struct.unpack("<f", struct.pack("<i", 3))[0] if persona == "px4" else 3.0
                client.send(mavlink.MAVLink_param_set_message(1, 1, name, three, 6))
                self.assertEqual(value(), 3)
                client.send(mavlink.MAVLink_param_request_read_message(1, 1, name, -1))
                self.assertEqual(value(), 3)
                client.send(mavlink.MAVLink_param_request_list_message(1, 1))
                last = client.expect("PARAM_VALUE", where=lambda m: m.param_index == m.param_count - 1)
                self.assertGreater(last.param_count, 5)


class RoutingSigningSerial(WithFiles):
    LINKS = ["udpin:127.0.0.1:0", "tcpin:127.0.0.1:0", "udpin:127.0.0.1:0"]

    def test_ardupilot_routes_between_links_only_to_where_the_target_was_heard(self):
        with Fake(links=self.LINKS) as fake:
            with fake.client(0) as one, fake.client(1, system=255, component=190) as two, \
                    fake.client(2, system=9, component=9) as three:
                fake.wait_for_event("heard", 3)
                one.send(mavlink.MAVLink_mission_ack_message(255, 190, 0, FENCE))
                self.assertEqual(two.expect("MISSION_ACK").mission_type, FENCE)
                one.heartbeat()
                for other in (two, three):
                    other.expect("HEARTBEAT", where=lambda m: m.get_srcComponent() == 195)
                self.assertIsNone(three.receive("MISSION_ACK", timeout=0.05))

    def test_messages_for_other_systems_are_not_answered(self):
        with Fake("--sysid", "7") as fake, fake.client(system=7, vehicle=(8, 1)) as client:
            client.request_list()
            self.assertIsNone(client.receive("MISSION_COUNT", timeout=0.2))
            client.vehicle = (7, 1)
            client.request_list()
            self.assertEqual(client.expect("MISSION_COUNT").get_srcSystem(), 7)

    def test_with_a_key_only_signed_messages_count(self):
        key = bytes(range(32))
        path = self.file("key", key.hex())

        def sign(client, with_key):
            client.mav.signing.secret_key = with_key
            client.mav.signing.link_id = 3
            client.mav.signing.timestamp = 400_000_000 * 100_000
            client.mav.signing.sign_outgoing = True

        with Fake("--signing-key", path) as fake:
            with fake.client(hello=False) as client:
                client.request_list()
                self.assertIsNone(client.receive("MISSION_COUNT", timeout=0.2))
            with fake.client(hello=False) as client:
                sign(client, b"x" * 32)
                client.request_list()
                self.assertIsNone(client.receive("MISSION_COUNT", timeout=0.2))
            with fake.client(hello=False) as client:
                sign(client, key)
                client.upload(mission(4))
                self.assertEqual(len(client.download()), 4)
        with Fake("--signing-key", path, "--accept-unsigned") as fake, fake.client() as client:
            client.upload(mission(2))

    def test_a_paced_serial_line_carries_everything(self):
        link = "pty:" + os.path.join(self.directory.name, "serial")
        with Fake("--baud", "115200", links=[link]) as fake, fake.client() as client:
            client.upload(mission(40))
            for seq in range(40):
                client.request_int(seq)
            self.assertEqual([client.expect("MISSION_ITEM_INT").seq for _ in range(40)], list(range(40)))

    def test_a_serial_line_can_be_closed_and_opened_again(self):
        with Fake("--persona", "px4", links=["pty"]) as fake:
            for _ in range(3):
                with fake.client() as client:
                    client.upload(mission(5))

    def test_tcp_clients_come_and_go(self):
        with Fake(links=["tcpin:127.0.0.1:0"]) as fake:
            for _ in range(3):
                with fake.client() as client:
                    client.upload(mission(5))
            fake.wait_for_event("link_down", 3)

    def test_udpout_and_tcpout_find_a_listener(self):
        for kind in (socket.SOCK_DGRAM, socket.SOCK_STREAM):
            with socket.socket(socket.AF_INET, kind) as listener:
                listener.bind(("127.0.0.1", 0))
                port = listener.getsockname()[1]
                name = "udpout" if kind == socket.SOCK_DGRAM else "tcpout"
                if name == "tcpout":
                    listener.listen()
                listener.settimeout(10)
                with self.subTest(name), Fake(links=[f"{name}:127.0.0.1:{port}"]):
                    if name == "tcpout":
                        peer, _ = listener.accept()
                        with peer:
                            self.assertEqual(peer.recv(1), b"\xfd")
                    else:
                        self.assertEqual(listener.recv(300)[:1], b"\xfd")


if __name__ == "__main__":
    unittest.main()

"""quavd beside other people's programs on one vehicle: MAVProxy and MAVSDK.

    python sitl/companions.py --quavd target/release/quavd

Wants a Python with requirements-companions.txt (`make companions`). The fake vehicle has a link for
each of the three. MAVSDK uploads a mission; quavd re-plans it; both MAVSDK and MAVProxy see what
quavd says and then read the same mission as the vehicle holds. Ends with status 0 only if all that
came about.
"""

import argparse
import asyncio
import json
import pathlib
import subprocess
import sys
import tempfile
import time

from mavsdk_grpc import System

from bench import EXAMPLES, Daemon, Vehicle


async def with_mavsdk(url, vehicle, daemon):
    host, port = url.removeprefix("udpout:").rsplit(":", 1)
    drone = System()
    await asyncio.wait_for(drone.connect(system_address=f"udpout://{host}:{port}"), 60)
    async for state in drone.core.connection_state():
        if state.is_connected:
            break
    print("MAVSDK: connected", flush=True)
    heard = asyncio.Queue()

    async def listen():
        async for text in drone.telemetry.status_text():
            if text.text.startswith("QUAV"):
                await heard.put(text.text)
    listening = asyncio.create_task(listen())

    uploads = daemon.status()["counts"]["uploads"]
    plan = await drone.mission_raw.import_qgroundcontrol_mission(str(EXAMPLES / "s1.plan"))
    await drone.mission_raw.upload_mission(plan.mission_items)
    print(f"MAVSDK: uploaded {len(plan.mission_items)} items", flush=True)
    await asyncio.to_thread(daemon.wait_for, "upload", lambda status: status["counts"]["uploads"] > uploads)
    print("MAVSDK: hears", repr(await asyncio.wait_for(heard.get(), 30)), flush=True)
    listening.cancel()
    items = await drone.mission_raw.download_mission()
    held = vehicle.dump()["mission"]["items"]
    places = [(item["x"], item["y"]) for item in held]
    assert [(item.x, item.y) for item in items] == places, "MAVSDK reads another mission"
    print(f"MAVSDK: reads the {len(items)} items that the vehicle holds", flush=True)
    return len(items)


def with_mavproxy(url, directory, daemon, items):
    """MAVProxy without a terminal: it lists the waypoints and quavd's parameters."""
    program = pathlib.Path(sys.executable).parent / "mavproxy.py"
    host_port = url.removeprefix("udpout:")
    log = open(directory / "mavproxy.log", "w+")
    process = subprocess.Popen(
        [sys.executable, str(program), f"--master=udpout:{host_port}", "--source-system=254", "--no-state",
         "--default-modules=wp,param,cmdlong", "--force-connected"],
        stdin=subprocess.PIPE, stdout=log, stderr=subprocess.STDOUT, text=True, cwd=directory)
    try:
        time.sleep(8)  # it has no prompt to wait for when its output is a pipe
        # Plan again by command, so that there is something to be heard.
        for line in ("wp list", "set target_component 195", "long 31010 0 0 0 0 0 0 0"):
            process.stdin.write(line + "\n")
            process.stdin.flush()
            time.sleep(5)
    finally:
        process.kill()
        process.wait()
    log.seek(0)
    output = log.read()
    found = {"reads the waypoints": f"Requesting {items} waypoints" in output,
             "hears quavd": "QUAV: " in output, "command accepted": "USER_1: ACCEPTED" in output}
    print(f"MAVProxy: {json.dumps(found)}", flush=True)
    if not all(found.values()):
        print(output[-3000:], file=sys.stderr)
        raise AssertionError("MAVProxy did not see what it should")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quavd", required=True)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as directory:
        vehicle = Vehicle(EXAMPLES / "s1.plan", "ardupilot", "--link", "udpin:127.0.0.1:0")
        daemon = Daemon(args.quavd, directory, vehicle.urls[0])
        try:
            daemon.wait_for("first upload", lambda status: status["counts"]["uploads"] == 1)
            items = asyncio.run(with_mavsdk(vehicle.urls[1], vehicle, daemon))
            with_mavproxy(vehicle.urls[2], pathlib.Path(directory), daemon, items)
            status = daemon.status()
            assert status["counts"]["connections"] == 1, status
            code, _ = daemon.end()
            assert code == 0, code
        finally:
            daemon.process.kill()
            vehicle.end()
    print("companions: quavd, MAVSDK and MAVProxy worked side by side")


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""The main job, to be watched: a fake vehicle with a mission through no-fly areas, and quavd.

Starts the fake vehicle with a scenario, runs `quavd once` against it over UDP, and then asks the vehicle itself what it
holds. Ends with status 0 only if the vehicle's own dump holds a mission that keeps the buffer, by the measure of
judge.py, which shares no code with quavd.
"""

import argparse
import json
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

import judge  # noqa: E402


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quavd", required=True, help="the program")
    parser.add_argument("--scenario", required=True, help="a .plan with mission and fence")
    parser.add_argument("--persona", default="ardupilot", choices=["ardupilot", "px4"])
    parser.add_argument("--out", default="out", help="directory for dump and pictures")
    options = parser.parse_args()
    out = pathlib.Path(options.out)
    out.mkdir(parents=True, exist_ok=True)
    dump, picture = out / "vehicle.json", out / "demo.svg"

    vehicle = subprocess.Popen(
        [sys.executable, HERE / "fake_vehicle.py", "--persona", options.persona, "--mission", options.scenario,
         "--link", "udpin:127.0.0.1:0", "--dump", dump, "--exit-on-stdin-eof"],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        ready = json.loads(vehicle.stdout.readline())
        url = ready["links"][0]["connect"]
        command = [options.quavd, "once", "--connect", url, "--state-dir", str(out / "state"), "--out", str(picture)]
        print("$", " ".join(command), flush=True)
        status = subprocess.run(command, check=False).returncode
    finally:
        vehicle.stdin.close()
        vehicle.wait(timeout=20)
    if status != 0:
        print(f"quavd ended with status {status}")
        return status
    verdict = judge.judge(json.loads(dump.read_text(encoding="utf-8")), 5.0)
    print("the vehicle's own dump, measured by sitl/judge.py:", json.dumps(verdict))
    print(f"picture: {picture}")
    return 0 if verdict["clear"] else 1


if __name__ == "__main__":
    sys.exit(main())

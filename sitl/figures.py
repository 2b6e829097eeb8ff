"""Prints what the daemon costs when idle, and how long a change on the vehicle takes to be answered.

    python sitl/figures.py --quavd target/release/quavd [--idle 20] [--changes 5]
"""

import argparse
import json
import pathlib
import tempfile
import time

from bench import EXAMPLES, Daemon, Vehicle


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quavd", required=True)
    parser.add_argument("--idle", type=float, default=20, metavar="S", help="how long to watch it idle")
    parser.add_argument("--changes", type=int, default=5, metavar="N", help="how many changes to time")
    args = parser.parse_args()

    with tempfile.TemporaryDirectory() as directory:
        vehicle = Vehicle(EXAMPLES / "s1.plan")
        daemon = Daemon(args.quavd, directory, vehicle.urls[0])
        daemon.wait_for("first upload", lambda status: status["counts"]["uploads"] == 1)

        times = []
        for number in range(args.changes):
            # The pilot uploads the mission again over the second link, as drawn.
            uploads = daemon.status()["counts"]["uploads"]
            done = len(vehicle.dump()["uploads"])
            vehicle.tell(cmd="set", mission=str(EXAMPLES / "s1.plan"))
            began = time.monotonic()
            daemon.wait_for("upload", lambda status: status["counts"]["uploads"] > uploads)
            times.append(time.monotonic() - began)
            last = daemon.status()["last"]
            plan = json.loads(pathlib.Path(last["report"]).read_text())["plan"]["time_ms"]
            print(f"  {last['took_ms']} ms from the first sign of it; planning took {plan['total'] - plan['load']:.0f} ms")
            assert len(vehicle.dump()["uploads"]) > done, number
        shown = ", ".join(f"{took:.2f}" for took in times)
        print(f"change -> verified upload on S1 over UDP, debounce of 0.5 s included: {shown} s (worst {max(times):.2f} s)")

        time.sleep(3)  # the look at its own upload
        began, before = time.monotonic(), daemon.cpu_seconds()
        time.sleep(args.idle)
        share = (daemon.cpu_seconds() - before) / (time.monotonic() - began)
        print(f"idle for {args.idle:.0f} s: {100 * share:.2f} % of one core, {daemon.rss_mib():.1f} MiB RSS, "
              f"{daemon.threads()} threads, {daemon.descriptors()} descriptors")
        code, took = daemon.end()
        print(f"SIGTERM: exit code {code} after {took:.2f} s")
        vehicle.end()


if __name__ == "__main__":
    main()

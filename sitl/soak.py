"""The daemon for a while with everything that can happen to it; ends with status 0 only if it held.

    python sitl/soak.py --quavd target/release/quavd --minutes 60 [--seed 1]

Over and over, in random order: a mission is edited, uploaded by a second ground station, uploaded
and abandoned, fences are changed, the vehicle reboots, falls silent, is armed and disarmed, and the
line loses frames. At the end all is quiet, one last mission is uploaded, and then: the vehicle
holds a collision-free mission, every change was answered, and quavd has not grown.
"""

import argparse
import json
import pathlib
import random
import subprocess
import sys
import tempfile
import time

from bench import EXAMPLES, HERE, Daemon, Vehicle

SCENARIOS = [EXAMPLES / f"{name}.plan" for name in ("s1", "s2", "s3", "s4", "s5", "s6", "infeasible")]
# After the first answers everything is loaded once; what is more than this from then on is a leak.
MOST_GROWTH_MIB = 16


class Soak:
    def __init__(self, vehicle, daemon, dice):
        self.vehicle, self.daemon, self.dice = vehicle, daemon, dice
        self.counts = {}

    def turn(self):
        event = self.dice.choices(
            [self.edit, self.upload, self.abandon, self.fence, self.reboot, self.silence, self.arm, self.loss],
            weights=[4, 4, 1, 2, 1, 1, 1, 1])[0]
        self.counts[event.__name__] = self.counts.get(event.__name__, 0) + 1
        event()
        if self.dice.random() < 0.5:
            time.sleep(self.dice.uniform(0, 3))

    def scenario(self):
        return str(self.dice.choice(SCENARIOS))

    def edit(self):
        plan = self.scenario()
        self.vehicle.tell(cmd="set", fence=plan)
        self.vehicle.tell(cmd="set", mission=plan)

    def upload(self):
        self.vehicle.tell(cmd="gcs-upload", type="mission", items=self.scenario(), pace=0.03)

    def abandon(self):
        self.vehicle.tell(cmd="gcs-upload", type="mission", items=self.scenario(), pace=0.05, stop=2)

    def fence(self):
        self.vehicle.tell(cmd="set", fence=self.scenario())

    def reboot(self):
        self.vehicle.tell(cmd="reboot", **{"for": self.dice.uniform(0.5, 4)})

    def silence(self):
        self.vehicle.tell(cmd="fault", spec=f"silence:for={self.dice.uniform(1, 14):.1f}")

    def arm(self):
        self.vehicle.tell(cmd="set", armed=True)
        time.sleep(self.dice.uniform(0.2, 3))
        self.vehicle.tell(cmd="set", armed=False)

    def loss(self):
        self.vehicle.tell(cmd="fault", spec="drop:p=0.2,until=5")


def judged(vehicle):
    with tempfile.NamedTemporaryFile("w", suffix=".json") as dump:
        json.dump(vehicle.dump(), dump)
        dump.flush()
        output = subprocess.run([sys.executable, str(HERE / "judge.py"), dump.name], capture_output=True, text=True)
    return json.loads(output.stdout)


def settled(daemon, seconds=180):
    """Waits until it watches, and nothing has been answered or looked at for a while."""
    end = time.monotonic() + seconds
    before, since = None, time.monotonic()
    while time.monotonic() < end:
        status = daemon.wait_for("vehicle", lambda status: status["vehicle"] is not None)
        now = (status["state"], status["counts"]["answers"], status["counts"]["connections"])
        if now != before:
            before, since = now, time.monotonic()
        if status["state"] == "watching" and time.monotonic() - since > 8:
            return status
        time.sleep(0.2)
    raise RuntimeError(f"not settled within {seconds} s: {json.dumps(status)}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quavd", required=True)
    parser.add_argument("--minutes", type=float, default=60)
    parser.add_argument("--seed", type=int, default=None)
    parser.add_argument("--persona", default="ardupilot", choices=["ardupilot", "px4"])
    args = parser.parse_args()
    seed = args.seed if args.seed is not None else random.randrange(1 << 32)
    print(f"soak: seed {seed}, {args.minutes:g} minutes, {args.persona}", flush=True)
    dice = random.Random(seed)

    with tempfile.TemporaryDirectory() as directory:
        vehicle = Vehicle(SCENARIOS[0], args.persona, "--seed", str(seed % 1000))
        daemon = Daemon(args.quavd, directory, vehicle.urls[0], "retry = 2\ndebounce = 0.5\npoll = 5\nwait = 5")
        soak = Soak(vehicle, daemon, dice)
        failures = []
        try:
            # Each scenario once, so that what is loaded on first use is loaded.
            for plan in SCENARIOS:
                answers = daemon.wait_for("daemon", lambda status: True)["counts"]["answers"]
                vehicle.tell(cmd="set", fence=str(plan))
                vehicle.tell(cmd="set", mission=str(plan))
                daemon.wait_for(f"answer to {plan.stem}", lambda status: status["counts"]["answers"] > answers)
            settled(daemon)
            start = (daemon.rss_mib(), daemon.threads(), daemon.descriptors())

            end = time.monotonic() + 60 * args.minutes
            while time.monotonic() < end:
                soak.turn()

            vehicle.tell(cmd="clear-faults")
            vehicle.tell(cmd="set", armed=False)
            settled(daemon)
            # The last change.
            last = SCENARIOS[0]
            vehicle.tell(cmd="set", fence=str(last))
            settled(daemon)
            uploads = daemon.status()["counts"]["uploads"]
            vehicle.tell(cmd="set", mission=str(last))
            daemon.wait_for("the last upload", lambda status: status["counts"]["uploads"] > uploads)
            status = settled(daemon)
            report = judged(vehicle)
            if report["collisions"] != 0 or report["min_clearance_m"] < 4.99:
                failures.append(f"the vehicle's mission is not clear: {report}")
            # Every change has an answer: a plan of what is held now was the last thing said.
            if status["last"]["verdict"] not in ("uploaded", "already_there"):
                failures.append(f"the last answer is {status['last']}")
            finish = (daemon.rss_mib(), daemon.threads(), daemon.descriptors())
            if finish[0] > start[0] + MOST_GROWTH_MIB:
                failures.append(f"RSS grew from {start[0]:.1f} to {finish[0]:.1f} MiB")
            if finish[2] > start[2]:
                failures.append(f"descriptors grew from {start[2]} to {finish[2]}")
            open_records = [path.name for path in daemon.state.glob("*.json")
                            if path.name[0] in "mfr" and json.loads(path.read_text()).get("outcome") == "started"]
            if open_records:
                failures.append(f"uploads that nobody settled: {open_records}")
            code, took = daemon.end()
            if code != 0:
                failures.append(f"exit code {code}")
            print(f"soak: events {soak.counts}")
            print(f"soak: {json.dumps(status['counts'])}")
            print(f"soak: RSS {start[0]:.1f} -> {finish[0]:.1f} MiB, threads {start[1]} -> {finish[1]}, "
                  f"descriptors {start[2]} -> {finish[2]}, SIGTERM took {took:.2f} s")
        except Exception as error:
            failures.append(str(error))
            daemon.process.kill()
        finally:
            vehicle.end()
        if failures:
            log = pathlib.Path(directory, "quavd.log").read_text().splitlines()
            print("\n".join(log[-60:]), file=sys.stderr)
            for failure in failures:
                print(f"soak: FAILED: {failure}", file=sys.stderr)
            return 1
    print("soak: held")
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""The daemon for a while with everything that can happen to it; ends with status 0 only if it held.

    python sitl/soak.py --quavd target/release/quavd --minutes 60 [--seed 1]

Over and over, in random order: a mission is edited, uploaded by a second ground station, uploaded and
abandoned, fences are changed and uploaded, the vehicle reboots, falls silent, is armed and disarmed, and
the line loses frames. Every --rest seconds all of that pauses, and then the last change must have been
answered: by a mission that is on the vehicle and clear (by judge.py, and by a `quavd once --dry-run` that
knows nothing of the daemon and finds nothing to change), or by a reason that the dry run gives as well.
At the end a ground station uploads one more mission over the protocol, and one is changed in place; both
must come out verified. quavd's memory, threads, tasks and descriptors are sampled at every rest and must
not have grown since the first one.
"""

import argparse
import json
import os
import pathlib
import random
import statistics
import subprocess
import sys
import tempfile
import time

from bench import EXAMPLES, HERE, Daemon, Vehicle

SCENARIOS = [EXAMPLES / f"{name}.plan" for name in ("s1", "s2", "s3", "s4", "s5", "s6", "infeasible")]
CLEAR_M = 4.99
# What the allocator keeps after the largest plan goes up and down by this much; what leaks goes beyond it.
MOST_GROWTH_MIB = 16
# The main one, two of the runtime, four to block (src/daemon/mod.rs), and one of rayon's for each processor.
MOST_THREADS = 7 + (os.cpu_count() or 1)
# A rest is not over while the vehicle is in the middle of something that began before it.
QUIET_S = 8


class Failed(Exception):
    """quavd did not do what it should."""


class Soak:
    def __init__(self, vehicle, daemon, dice, directory):
        self.vehicle, self.daemon, self.dice = vehicle, daemon, dice
        self.second_state = pathlib.Path(directory) / "second-opinion"
        self.counts, self.samples = {}, []
        self.here = SCENARIOS[0]

    # ---- what happens

    def turn(self):
        event = self.dice.choices(
            [self.edit, self.upload, self.abandon, self.fence, self.upload_fence, self.reboot, self.silence,
             self.arm, self.loss],
            weights=[6, 4, 1, 2, 1, 1, 1, 1, 1])[0]
        self.counts[event.__name__] = self.counts.get(event.__name__, 0) + 1
        event()
        if self.dice.random() < 0.5:
            time.sleep(self.dice.uniform(0, 3))

    def scenario(self):
        """Mostly that of the place where the vehicle is: one of another place has no way there."""
        return str(self.here if self.dice.random() < 0.8 else self.dice.choice(SCENARIOS))

    def edit(self):
        self.put(self.dice.choice(SCENARIOS))

    def put(self, plan):
        """The vehicle is carried to another place, and what is to be done there is drawn anew."""
        self.here = plan
        lat, lon, altitude = json.loads(plan.read_text())["mission"]["plannedHomePosition"]
        self.vehicle.tell(cmd="set", home=[lat, lon, altitude], position=[lat, lon, altitude])
        self.vehicle.tell(cmd="set", fence=str(plan))
        self.vehicle.tell(cmd="set", mission=str(plan))

    def upload(self):
        self.vehicle.tell(cmd="gcs-upload", type="mission", items=self.scenario(), pace=0.03)

    def abandon(self):
        self.vehicle.tell(cmd="gcs-upload", type="mission", items=self.scenario(), pace=0.05, stop=2)

    def fence(self):
        self.vehicle.tell(cmd="set", fence=self.scenario())

    def upload_fence(self):
        self.vehicle.tell(cmd="gcs-upload", type="fence", items=self.scenario(), pace=0.02)

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

    # ---- what must hold

    def rest(self):
        """Waits until nothing goes on, and sees that the last change was answered; returns the status."""
        self.vehicle.tell(cmd="clear-faults")
        self.vehicle.tell(cmd="set", armed=False)
        status = self.settled()
        last, report = status["last"], self.judged()
        feasible, verified, reason = self.second_opinion()
        said = f"the answer is {json.dumps(last)}; judged: {report}; the dry run says: {reason}"
        if last["verdict"] in ("uploaded", "already_there"):
            if report["collisions"] or (report["min_clearance_m"] or CLEAR_M) < CLEAR_M or not verified:
                raise Failed(f"what the vehicle holds is not what was to be planned: {said}")
        elif last["verdict"] in ("no_path", "bad_input", "no_mission"):
            if feasible or not last["reason"]:
                raise Failed(f"there is a path: {said}")
        else:
            raise Failed(f"the last change has no answer: {said}")
        resources = status["resources"]
        self.samples.append(resources)
        minutes = status["uptime_s"] / 60
        print(f"soak: {minutes:5.1f} min, {status['counts']['answers']} answers, {last['verdict']}: "
              f"{resources['rss_kib'] / 1024:.1f} MiB, {resources['threads']} threads, {resources['tasks']} tasks, "
              f"{resources['descriptors']} descriptors", flush=True)
        return status

    def settled(self, seconds=240):
        """Waits until it watches, and nothing has been answered, looked at or lost for a while."""
        end = time.monotonic() + seconds
        before, since = None, time.monotonic()
        while time.monotonic() < end:
            status = self.daemon.wait_for("vehicle", lambda status: status["vehicle"] is not None)
            now = (status["state"], status["counts"]["answers"], status["counts"]["connections"])
            if now != before:
                before, since = now, time.monotonic()
            if status["state"] == "watching" and time.monotonic() - since > QUIET_S:
                return status
            time.sleep(0.2)
        raise Failed(f"not at rest within {seconds} s: {json.dumps(status)}")

    def judged(self):
        with tempfile.NamedTemporaryFile("w", suffix=".json") as dump:
            json.dump(self.vehicle.dump(), dump)
            dump.flush()
            output = subprocess.run([sys.executable, str(HERE / "judge.py"), dump.name], capture_output=True, text=True)
        return json.loads(output.stdout)

    def second_opinion(self):
        """What another quavd makes of it over the second link: feasible, nothing to change, in words."""
        output = subprocess.run(
            [self.daemon.quavd, "once", "--dry-run", "--json", "--quiet", "--connect", self.vehicle.urls[1],
             "--system", "1", "--component", "191", "--state-dir", str(self.second_state)],
            capture_output=True, text=True)
        if output.returncode not in (0, 2, 3):
            raise Failed(f"the dry run ended with {output.returncode}: {output.stderr}")
        document = json.loads(output.stdout) if output.stdout else {}
        verified = (document.get("vehicle") or {}).get("verified", False)
        return document.get("feasible", False), verified, document.get("reason") or output.stderr.strip()

    def uploads(self):
        return self.daemon.status()["counts"]["uploads"]

    def last_changes(self):
        """One more mission from a ground station, over the protocol, then one that is changed in place."""
        plan = SCENARIOS[2]
        self.put(plan)
        self.finished("uploaded", "already_there")
        uploads = self.uploads()
        for _ in range(20):
            before = self.last_accepted()
            self.vehicle.tell(cmd="gcs-upload", type="mission", items=str(plan), pace=0.03)
            time.sleep(2)
            # While quavd writes the vehicle says no, and a ground station's user tries again.
            if self.last_accepted() > before:
                break
        else:
            raise Failed("the ground station's upload was never accepted")
        self.daemon.wait_for("the upload after the ground station's", lambda status: status["counts"]["uploads"] > uploads)
        self.finished("uploaded", "already_there")
        uploads = self.uploads()
        self.put(SCENARIOS[0])
        self.daemon.wait_for("the last upload", lambda status: status["counts"]["uploads"] > uploads)
        return self.finished("uploaded")

    def last_accepted(self):
        """When the vehicle last took a mission of the ground station's."""
        return max((upload["at_s"] for upload in self.vehicle.dump()["uploads"]
                    if upload["type"] == "mission" and upload["by"][0] == 255 and upload["result"] == 0), default=0)

    def finished(self, *verdicts):
        status = self.rest()
        if status["last"]["verdict"] not in verdicts:
            raise Failed(f"not {' or '.join(verdicts)} but {json.dumps(status['last'])}")
        return status

    def leaks(self):
        """What has grown from the first sample to the last, in words."""
        first, last = self.samples[0], self.samples[-1]
        third = max(1, len(self.samples) // 3)
        early, late = (statistics.median(sample["rss_kib"] for sample in samples) / 1024
                       for samples in (self.samples[:third], self.samples[-third:]))
        growth = late - early
        print(f"soak: memory {early:.1f} MiB in the first third of {len(self.samples)} samples, {late:.1f} in the last "
              f"(medians; {MOST_GROWTH_MIB} more would be a leak)")
        found = [f"{name} grew from {first[name]} to {last[name]}"
                 for name in ("tasks", "descriptors") if last[name] > first[name]]
        # Those that wait for work to block on come and go.
        if last["threads"] > MOST_THREADS:
            found.append(f"{last['threads']} threads are more than {MOST_THREADS}")
        if growth > MOST_GROWTH_MIB:
            found.append(f"memory grew by {growth:.1f} MiB, more than {MOST_GROWTH_MIB}")
        return found


def run(soak, minutes, rest):
    # Each scenario once, so that what is loaded on first use is loaded.
    for plan in SCENARIOS:
        answers = soak.daemon.wait_for("daemon", lambda status: True)["counts"]["answers"]
        soak.put(plan)
        soak.daemon.wait_for(f"answer to {plan.stem}", lambda status: status["counts"]["answers"] > answers)
    soak.rest()
    end = time.monotonic() + 60 * minutes
    while time.monotonic() < end:
        pause = time.monotonic() + rest
        while time.monotonic() < min(pause, end):
            soak.turn()
        soak.rest()
    return soak.last_changes()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quavd", required=True)
    parser.add_argument("--minutes", type=float, default=60)
    parser.add_argument("--rest", type=float, default=60, metavar="S", help="how long things happen between two rests")
    parser.add_argument("--seed", type=int, default=None)
    parser.add_argument("--persona", default="ardupilot", choices=["ardupilot", "px4"])
    args = parser.parse_args()
    seed = args.seed if args.seed is not None else random.randrange(1 << 32)
    print(f"soak: seed {seed}, {args.minutes:g} minutes, {args.persona}", flush=True)
    failures = []
    with tempfile.TemporaryDirectory() as directory:
        vehicle = Vehicle(SCENARIOS[0], args.persona, "--seed", str(seed % 1000))
        daemon = Daemon(args.quavd, directory, vehicle.urls[0], "retry = 2\npoll = 5\nwait = 5")
        soak = Soak(vehicle, daemon, random.Random(seed), directory)
        try:
            status = run(soak, args.minutes, args.rest)
            print(f"soak: events {json.dumps(soak.counts)}")
            print(f"soak: {json.dumps(status['counts'])}")
            failures += soak.leaks()
            unsettled = [path.name for path in daemon.state.glob("*.json")
                         if json.loads(path.read_text()).get("upload", {}).get("outcome") == "started"]
            if unsettled:
                failures.append(f"uploads that nobody settled: {unsettled}")
            code, took = daemon.end()
            print(f"soak: SIGTERM took {took:.2f} s")
            if code != 0:
                failures.append(f"exit code {code}")
        except (Failed, RuntimeError, OSError, subprocess.TimeoutExpired) as error:
            failures.append(str(error))
        finally:
            daemon.kill()
            vehicle.end()
        if failures:
            log = pathlib.Path(directory, "quavd.log").read_text().splitlines()
            print("\n".join(log[-60:]), file=sys.stderr)
    for failure in failures:
        print(f"soak: FAILED: {failure}", file=sys.stderr)
    print("soak: FAILED" if failures else "soak: held")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())

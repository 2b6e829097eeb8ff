"""What soak.py and figures.py have in common: a fake vehicle and a quavd daemon as child processes."""

import json
import os
import pathlib
import signal
import socket
import subprocess
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
EXAMPLES = HERE.parent / "fence_examples"


class Vehicle:
    """A fake vehicle with two UDP links: the first is quavd's, the second a ground station's."""

    def __init__(self, mission, persona="ardupilot", *more):
        command = [sys.executable, str(HERE / "fake_vehicle.py"), "--control", "0", "--exit-on-stdin-eof",
                   "--persona", persona, "--mission", str(mission),
                   "--link", "udpin:127.0.0.1:0", "--link", "udpin:127.0.0.1:0", *more]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        ready = json.loads(self.process.stdout.readline())
        self.urls = [link["connect"] for link in ready["links"]]
        self.control = socket.create_connection(("127.0.0.1", ready["control"]["port"])).makefile("rw")

    def tell(self, **command):
        self.control.write(json.dumps(command) + "\n")
        self.control.flush()
        answer = json.loads(self.control.readline())
        if not answer.get("ok"):
            raise RuntimeError(f"{command}: {answer}")
        return answer

    def dump(self):
        return self.tell(cmd="dump")["dump"]

    def end(self):
        self.process.stdin.close()
        self.process.wait(10)


class Daemon:
    """A running `quavd run`."""

    def __init__(self, quavd, directory, url, more=""):
        self.quavd, self.state = str(quavd), pathlib.Path(directory) / "state"
        config = pathlib.Path(directory) / "quavd.toml"
        config.write_text(f'connect = "{url}"\nsystem = 1\n{more}\n')
        self.log = open(pathlib.Path(directory) / "quavd.log", "w")
        # What the unit sets as well.
        environment = {"PATH": os.environ["PATH"], "STATE_DIRECTORY": str(self.state), "MALLOC_ARENA_MAX": "2"}
        if "RUST_LOG" in os.environ:
            environment["RUST_LOG"] = os.environ["RUST_LOG"]
        self.process = subprocess.Popen([self.quavd, "run", "--config", str(config)],
                                        env=environment, stdout=subprocess.DEVNULL, stderr=self.log)

    def status(self):
        with socket.socket(socket.AF_UNIX) as ask:
            ask.settimeout(5)
            ask.connect(str(self.state / "status.sock"))
            ask.sendall(b"status\n")
            return json.loads(ask.makefile().readline())

    def wait_for(self, what, wanted, seconds=120):
        """Polls the status until `wanted(status)`; returns it."""
        end = time.monotonic() + seconds
        last = None
        while time.monotonic() < end:
            if self.process.poll() is not None:
                raise RuntimeError(f"quavd ended with {self.process.returncode} while waiting for {what}")
            try:
                last = self.status()
            except OSError:
                last = None
            if last is not None and wanted(last):
                return last
            time.sleep(0.02)
        raise RuntimeError(f"no {what} within {seconds} s; status: {json.dumps(last)}")

    def cpu_seconds(self):
        fields = pathlib.Path(f"/proc/{self.process.pid}/stat").read_text().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def rss_mib(self):
        for line in pathlib.Path(f"/proc/{self.process.pid}/status").read_text().splitlines():
            if line.startswith("VmRSS:"):
                return int(line.split()[1]) / 1024
        raise RuntimeError("no VmRSS")

    def threads(self):
        return len(os.listdir(f"/proc/{self.process.pid}/task"))

    def descriptors(self):
        return len(os.listdir(f"/proc/{self.process.pid}/fd"))

    def end(self):
        """Ends it as systemd does; returns the exit code and the seconds it took."""
        began = time.monotonic()
        self.process.send_signal(signal.SIGTERM)
        code = self.process.wait(30)
        took = time.monotonic() - began
        self.log.close()
        return code, took

    def kill(self):
        """Ends it for certain, where it has not ended."""
        self.process.kill()
        self.process.wait()

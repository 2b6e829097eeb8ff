"""The stand-in as a process, and the plain requests that tests make of it."""

import json
import os
import subprocess
import sys
import time
import urllib.error
import urllib.request
from urllib.parse import urlencode

SITL = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
KEY = "FAKE-API-KEY-0000"


class Service:
    """A running stand-in."""

    def __init__(self, *arguments):
        self.process = subprocess.Popen(
            [sys.executable, os.path.join(SITL, "fake_ibm.py"), "--exit-on-stdin-eof", *arguments],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.ready = json.loads(self.process.stdout.readline())
        self.api, self.crn = self.ready["api"], self.ready["crn"]
        self.token = None

    def close(self):
        self.process.stdin.close()
        self.process.stdout.close()
        self.process.wait()

    def call(self, method, url, body=None, headers=()):
        """`(status, document or text, headers)`."""
        data = json.dumps(body).encode() if body is not None else None
        request = urllib.request.Request(url, data, dict(headers), method=method)
        try:
            with urllib.request.urlopen(request) as response:
                return response.status, self._read(response), response.headers
        except urllib.error.HTTPError as error:
            with error:
                return error.code, self._read(error), error.headers

    @staticmethod
    def _read(response):
        text = response.read().decode()
        return json.loads(text) if text and "json" in (response.headers["Content-Type"] or "") else text

    def sign_in(self, key=KEY):
        form = urlencode({"grant_type": "urn:ibm:params:oauth:grant-type:apikey", "apikey": key}).encode()
        request = urllib.request.Request(self.ready["iam"] + "/identity/token", form, method="POST")
        with urllib.request.urlopen(request) as response:
            self.token = json.load(response)["access_token"]

    def ask(self, method, path, body=None, **headers):
        if self.token is None:
            self.sign_in()
        own = {"Authorization": f"Bearer {self.token}", "Service-CRN": self.crn, "IBM-API-Version": "2026-04-15"}
        return self.call(method, self.api + path, body, own | headers)

    def control(self, what, **body):
        status, answer, _ = self.call("POST", f"{self.ready['control']}/{what}", body)
        assert status == 200, answer
        return answer

    def run(self, qasm, values=None, shots=100, backend="ibm_kyiv"):
        """The job document of a Sampler job, once it has ended."""
        body = {"program_id": "sampler", "backend": backend, "cost": 60, "tags": ["t"],
                "params": {"version": 2, "support_qiskit": False, "pubs": [[qasm, values, shots]], "options": {}}}
        status, made, _ = self.ask("POST", "/jobs", body)
        assert status == 200, made
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline:
            _, job, _ = self.ask("GET", f"/jobs/{made['id']}?exclude_params=true")
            if job["state"]["status"] not in ("Queued", "Running"):
                return job
            time.sleep(0.02)
        raise AssertionError(f"job {made['id']} does not end")

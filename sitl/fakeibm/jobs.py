"""Jobs and what belongs to them: sessions, usage, the limit of submissions. One worker runs them in order."""

import json
import math
import queue
import secrets
import threading
import time
import traceback
from dataclasses import dataclass, field

from . import results
from .circuits import JobFailure, bound, checked, loaded

TERMINAL = ("Completed", "Cancelled", "Failed")
OPTIONS = {"default_shots", "dynamical_decoupling", "execution", "experimental", "simulator", "twirling"}

# QPU seconds: for every job, and for every shot (repetition delay and readout).
JOB_SECONDS, SHOT_SECONDS = 2.0, 265e-6


@dataclass
class Job:
    id: str
    backend: str
    params: dict
    tags: list
    cost: float
    session_id: str | None
    created: float
    status: str = "Queued"
    reason: str = ""
    reason_code: int | None = None
    solution: str = ""
    results: str | None = None
    charged: float = 0.0
    finished: float | None = None
    cancelled: threading.Event = field(default_factory=threading.Event)

    def estimate(self):
        shots = sum((pub[2] if len(pub) > 2 and pub[2] else 4096) for pub in self.params.get("pubs", []))
        return JOB_SECONDS + SHOT_SECONDS * shots

    def document(self):
        state = {"status": self.status}
        if self.status == "Failed":
            state |= {"reason": self.reason, "reason_code": self.reason_code, "reason_solution": self.solution}
        top = "Cancelled - Ran too long" if self.reason_code == 1305 else self.status
        return {"id": self.id, "backend": self.backend, "state": state, "status": top, "program": {"id": "sampler"},
                "created": timestamp(self.created), "cost": self.cost, "tags": self.tags,
                "session_id": self.session_id, "user_id": "IBMid-stub",
                "estimated_running_time_seconds": self.estimate(), "calibration_id": "stub-cal"}


def timestamp(seconds):
    return time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(seconds)) + f".{int(seconds % 1 * 1e6):06d}Z"


class Clock:
    """Time that runs `scale` times as fast as ours: what takes the service a minute need not take a test one."""

    def __init__(self, scale):
        self.scale, self.began = scale, time.time()

    def now(self):
        return self.began + (time.time() - self.began) * self.scale

    def ours(self, seconds):
        return seconds / self.scale


class Refusal(Exception):
    """An HTTP error of the service."""

    def __init__(self, status, error=0, retry_after=None):
        super().__init__(status)
        self.status, self.error, self.retry_after = status, error, retry_after


class Jobs:
    def __init__(self, qpus, sample, clock, faults, *, limit, seed, consumed=12.0, allowed=600.0):
        self.qpus, self.sample, self.clock, self.faults = qpus, sample, clock, faults
        self.limit, self.seed = limit, seed
        self.consumed, self.allowed = consumed, allowed
        self.jobs, self.sessions, self.submitted = {}, {}, []
        self.lock = threading.Lock()
        self.waiting = queue.Queue()
        threading.Thread(target=self._work, daemon=True).start()

    def usage(self):
        return {"usage_consumed_seconds": round(self.consumed), "usage_limit_seconds": self.allowed,
                "usage_limit_reached": self.consumed >= self.allowed}

    # Submissions.

    def create(self, body):
        with self.lock:
            now = self.clock.now()
            self.submitted = [then for then in self.submitted if then > now - 60]
            if self.limit and len(self.submitted) >= self.limit:
                wait = self.clock.ours(self.submitted[0] + 60 - now)
                raise Refusal(429, retry_after=max(1, math.ceil(wait)))
            self._validate(body)
            cost = body.get("cost") or self.allowed
            if self.consumed >= self.allowed:
                raise Refusal(409)
            job = Job("d" + secrets.token_hex(10), body["backend"], body["params"], body.get("tags") or [],
                      cost, body.get("session_id"), time.time())
            self.submitted.append(now)
            self.jobs[job.id] = job
        self.waiting.put((job, self.clock.now() + self.faults.queue_seconds()))
        return job

    def _validate(self, body):
        params = body.get("params")
        pubs = params.get("pubs") if isinstance(params, dict) else None
        if body.get("program_id") != "sampler" or not isinstance(pubs, list) or not pubs:
            raise Refusal(400)
        if body.get("backend") not in self.qpus:
            raise Refusal(404, 1007)
        if set(params) - {"version", "support_qiskit", "pubs", "options"}:
            raise Refusal(400)
        if set(params.get("options") or {}) - OPTIONS:
            raise Refusal(400)
        tags = body.get("tags") or []
        if len(tags) > 8 or any(len(tag) > 86 for tag in tags) or not 0 < (body.get("cost") or 1) <= 10800:
            raise Refusal(400)
        session = body.get("session_id")
        if session and not self.sessions.get(session, {}).get("accepting_jobs"):
            raise Refusal(400, 1217)

    # The QPU.

    def _work(self):
        while True:
            job, ready = self.waiting.get()
            while not job.cancelled.is_set() and self.clock.now() < ready:
                job.cancelled.wait(0.02)
            with self.lock:
                if job.status != "Queued":
                    continue
                job.status = "Running"
            try:
                fault = self.faults.for_job()
                if fault:
                    raise JobFailure(fault.reason_code, "Failed on request of the test.", "Do not ask for it.")
                outcome = self._run(job)
                charged = min(job.estimate(), job.cost)
                if job.estimate() > job.cost:
                    raise JobFailure(1305, "Job exceeded its maximum execution time.")
            except JobFailure as failure:
                self._end(job, "Failed", JOB_SECONDS, reason=failure.reason, reason_code=failure.code,
                          solution=failure.solution)
            except Exception as error:  # A defect of the stand-in must not look like a slow queue.
                self._end(job, "Failed", 0.0, reason=f"stand-in: {error!r}", reason_code=9999)
                traceback.print_exc()
            else:
                self._end(job, "Completed", charged, results=outcome)

    def _end(self, job, status, charged, **more):
        with self.lock:
            if job.status == "Running":
                job.status, job.charged, job.finished = status, charged, time.time()
                self.consumed += charged
                for name, value in more.items():
                    setattr(job, name, value)

    def _run(self, job):
        qpu = self.qpus[job.backend]
        pubs = []
        for number, pub in enumerate(job.params["pubs"]):
            circuit, values, shots = (list(pub) + [None, None])[:3]
            circuit = loaded(circuit)
            checked(circuit, qpu.target)
            pubs.append((*bound(circuit, values), shots or 4096, number))
        outcome = []
        for shape, circuits, shots, number in pubs:
            points = []
            for k, circuit in enumerate(circuits):
                if job.cancelled.is_set():
                    return None
                points.append(self.sample(circuit, qpu, shots, hash((self.seed, len(self.jobs), number, k)) % 2**31))
            outcome.append(results.stacked(shape, points))
        form = results.serialized if job.params.get("support_qiskit") else results.plain
        return form(outcome)

    # What happens to a job.

    def find(self, job_id):
        job = self.jobs.get(job_id)
        if job is None:
            raise Refusal(404, 1291)
        return job

    def listed(self, tags, limit, offset):
        with self.lock:
            found = [job.document() for job in reversed(self.jobs.values()) if set(tags) <= set(job.tags)]
        return {"jobs": found[offset:offset + limit], "count": len(found), "limit": limit, "offset": offset}

    def cancel(self, job_id):
        job = self.find(job_id)
        with self.lock:
            if job.status in TERMINAL:
                raise Refusal(409)
            job.status, job.finished = "Cancelled", time.time()
            job.cancelled.set()

    def metrics(self, job_id):
        job = self.find(job_id)
        running = job.created if job.finished else None
        return {"timestamps": {"created": timestamp(job.created),
                               "running": running and timestamp(running),
                               "finished": job.finished and timestamp(job.finished)},
                "usage": {"status": "done" if job.finished else "pending", "qpu_charge_time_seconds": job.charged},
                "circuits_execution_time_ns": int(job.charged * 1e9)}

    # Sessions.

    def open_session(self, body):
        if body.get("mode") not in ("batch", "dedicated"):
            raise Refusal(500)
        if body["mode"] == "dedicated":
            raise Refusal(403, 1352)
        if body.get("backend") not in self.qpus:
            raise Refusal(404, 1007)
        session = {"id": "s" + secrets.token_hex(12), "backend_name": body["backend"], "mode": body["mode"],
                   "state": "open", "accepting_jobs": True, "interactive_ttl": 60, "max_ttl": body.get("max_ttl", 600),
                   "active_ttl": 600, "started_at": timestamp(time.time())}
        self.sessions[session["id"]] = session
        return session

    def session(self, session_id):
        if session_id not in self.sessions:
            raise Refusal(404, 1216)
        return self.sessions[session_id]

    def close_session(self, session_id):
        session = self.session(session_id)
        session |= {"accepting_jobs": False, "state": "closed"}
        for job in list(self.jobs.values()):
            if job.session_id == session_id and job.status == "Queued":
                self.cancel(job.id)


def decoded(text):
    """A request body; IBM's client wraps circuits and arrays, which needs its decoder."""
    if "__type__" in text:
        from qiskit_ibm_runtime.json import RuntimeDecoder
        return json.loads(text, cls=RuntimeDecoder)
    return json.loads(text)

"""The addresses of IAM, of the API, of Global Search, and of the test's own control channel."""

import json
import secrets
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.parse import parse_qs, unquote, urlsplit

from . import faults
from .jobs import Refusal, decoded

API = "/api/v1"
MAX_BODY = 64 << 20

VERSION = "2026-04-15"
VERSIONS = {"2024-01-01", "2025-01-01", "2025-05-01", "2026-02-01", "2026-02-15", "2026-03-15", VERSION}


class Server(ThreadingHTTPServer):
    daemon_threads = True
    request_queue_size = 64

    def __init__(self, address, jobs, tokens, crn):
        super().__init__(address, Handler)
        self.jobs, self.tokens, self.crn = jobs, tokens, crn
        self.log = []

    def handle_error(self, request, client_address):
        pass  # Clients that go away are part of the tests.


class Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def log_message(self, *_):
        pass

    def do_GET(self):
        self.answer("GET")

    def do_POST(self):
        self.answer("POST")

    def do_PATCH(self):
        self.answer("PATCH")

    def do_PUT(self):
        self.answer("PUT")

    def do_DELETE(self):
        self.answer("DELETE")

    def answer(self, method):
        length = int(self.headers.get("Content-Length") or 0)
        if length > MAX_BODY:
            return self.send(413, faults.body(413, 5302, ""))
        body = self.rfile.read(length).decode("utf-8", "replace")
        parts = urlsplit(self.path)
        path = parts.path[len("/experimental"):] if parts.path.startswith("/experimental/") else parts.path
        query = parse_qs(parts.query)
        if path.startswith("/control/"):
            return self.control(path[len("/control/"):], body)
        self.server.log.append({"time": time.time(), "method": method, "path": path,
                                "user_agent": self.headers.get("User-Agent")})
        fault = self.server.jobs.faults.for_request(method, path)
        if fault and not fault.act and fault.kind == "cut":
            return self.cut()
        if fault and not fault.act and fault.kind == "status":
            return self.send(fault.code, faults.body(fault.code, fault.error, secrets.token_hex(8)),
                             fault.retry_after if fault.retry_after >= 0 else None)
        retry_after = None
        try:
            status, document = self.route(method, path, query, body)
        except Refusal as refusal:
            status, retry_after = refusal.status, refusal.retry_after
            document = faults.body(status, refusal.error, secrets.token_hex(8))
        except (ValueError, KeyError, TypeError, AttributeError):
            status, document = 400, faults.body(400, 0, secrets.token_hex(8))
        if fault and fault.kind == "cut":
            return self.cut()
        if fault and fault.kind == "status":
            status, document = fault.code, faults.body(fault.code, fault.error, secrets.token_hex(8))
        self.send(status, document, retry_after, truncate=bool(fault and fault.kind == "truncate"))

    def cut(self):
        self.close_connection = True
        self.connection.close()

    def send(self, status, document, retry_after=None, truncate=False):
        is_text = isinstance(document, tuple)
        kind, content = document if is_text else ("application/json", document)
        content = content if isinstance(content, str) else json.dumps(content)
        payload = b"" if status == 204 else content.encode()
        if truncate:
            payload = payload[:len(payload) // 2]
        self.send_response(status)
        if status != 204:
            self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(payload)))
        if retry_after is not None:
            self.send_header("Retry-After", f"{retry_after:g}")
        self.end_headers()
        self.wfile.write(payload)

    # The services.

    def route(self, method, path, query, body):
        if (method, path) == ("POST", "/identity/token"):
            return self.token(parse_qs(body))
        if (method, path) == ("GET", API + "/versions"):
            return 200, {"versions": sorted(VERSIONS)}
        if not self.server.tokens.valid(self.headers.get("Authorization")):
            raise Refusal(401, 1219)
        if (method, path) == ("POST", "/v3/resources/search"):
            return 200, self.search()
        if not path.startswith(API + "/"):
            raise Refusal(404, 1000)
        if self.headers.get("Service-CRN") != self.server.crn:
            # The real one repeats the CRN in its message.
            message = f"Instance with CRN {self.headers.get('Service-CRN')} not found."
            return 404, {"errors": [{"code": 1279, "message": message, "solution": "Check the CRN."}], "trace": "t"}
        segments = [unquote(segment) for segment in path[len(API) + 1:].split("/")]
        return self.api(method, segments, query, body)

    def token(self, form):
        granted = self.server.tokens.grant((form.get("apikey") or [""])[0])
        if granted is None:
            return 400, {"errorCode": "BXNIM0415E", "errorMessage": "Provided API key could not be found.",
                         "context": {"requestId": secrets.token_hex(8)}}
        return 200, granted

    def search(self):
        return {"items": [{"crn": self.server.crn, "service_plan_unique_id": "850b21a7-71de-4e53-9441-1abdd202f35d",
                           "name": "open-instance", "tags": [], "doc": {"extensions": {"backends": ["ANY"]}}}],
                "limit": 100}

    def api(self, method, segments, query, body):
        jobs = self.server.jobs
        match (method, *segments):
            case ("GET", "backends"):
                devices = [qpu.device() for qpu in jobs.qpus.values()]
                if self.headers.get("IBM-API-Version") not in VERSIONS - {"2024-01-01"}:
                    devices = [device["name"] for device in devices]
                return 200, {"devices": devices}
            case ("GET", "backends", name, what) if name in jobs.qpus:
                return 200, self.backend(jobs.qpus[name], what)
            case ("GET", "backends", *_):
                raise Refusal(404, 1007)
            case ("GET", "instances", "usage"):
                return 200, {"instance_id": self.server.crn, "plan_id": "850b21a7-71de-4e53-9441-1abdd202f35d",
                             **jobs.usage()}
            case ("POST", "jobs"):
                job = jobs.create(decoded(body))
                made = {"id": job.id, "backend": job.backend}
                return 200, made | ({"session_id": job.session_id} if job.session_id else {})
            case ("GET", "jobs"):
                number = lambda name, default: int(query.get(name, [default])[0])  # noqa: E731
                return 200, jobs.listed(query.get("tags", []), min(number("limit", 10), 200), number("offset", 0))
            case ("GET", "jobs", ""):
                return 200, ("text/html", "<html>IBM Quantum</html>")
            case ("GET", "jobs", job_id):
                document = jobs.find(job_id).document()
                return 200, document
            case ("GET", "jobs", job_id, "results"):
                job = jobs.find(job_id)
                if job.status == "Completed":
                    return 200, job.results
                if job.status in ("Failed", "Cancelled"):
                    return 204, {}
                raise Refusal(400, 1234)
            case ("GET", "jobs", job_id, "metrics"):
                return 200, jobs.metrics(job_id)
            case ("GET", "jobs", job_id, "logs"):
                jobs.find(job_id)
                return 200, ("text/plain", "")
            case ("POST", "jobs", job_id, "cancel"):
                jobs.cancel(job_id)
                return 204, {}
            case ("POST", "sessions"):
                return 200, jobs.open_session(json.loads(body))
            case ("GET", "sessions", session_id):
                return 200, jobs.session(session_id)
            case ("PATCH", "sessions", session_id):
                jobs.session(session_id)["accepting_jobs"] = bool(json.loads(body)["accepting_jobs"])
                return 204, {}
            case ("DELETE", "sessions", session_id, "close"):
                jobs.close_session(session_id)
                return 204, {}
        raise Refusal(404, 1000)

    def backend(self, qpu, what):
        match what:
            case "configuration":
                return qpu.configuration
            case "properties":
                return qpu.properties
            case "status":
                return {"state": qpu.status == "online", "status": "active", "message": "",
                        "length_queue": qpu.queue_length, "backend_version": qpu.version}
            case "defaults":
                return None
        raise Refusal(404, 1007)

    # The control channel, which the real service does not have.

    def control(self, what, body):
        jobs = self.server.jobs
        match what:
            case "fault":
                try:
                    jobs.faults.add(json.loads(body)["spec"])
                except faults.FaultError as error:
                    return self.send(400, {"error": str(error)})
            case "clear":
                jobs.faults.clear()
            case "revoke":
                self.server.tokens.revoke_all()
            case "retire":
                jobs.qpus.pop(json.loads(body)["name"], None)
            case "status":
                request = json.loads(body)
                jobs.qpus[request["name"]].status = request["status"]
            case "usage":
                jobs.consumed = float(json.loads(body)["consumed"])
            case "log":
                return self.send(200, {"requests": self.server.log, "jobs": [
                    job.document() | {"charged": job.charged, "pubs": len(job.params["pubs"]), "reason": job.reason}
                    for job in jobs.jobs.values()]})
            case _:
                return self.send(404, {"error": "no such control"})
        self.send(200, {"ok": True})

"""Misbehaviour on request.

A fault is written `KIND[:key=value,key=value...]`:

  status:code=N        answer with this HTTP status (and the body that belongs to it)
  cut                  close the connection without an answer
  truncate             send half of the JSON document, as if it were all
  fail                 jobs end as Failed
  queue                jobs stay Queued for `seconds`, of the stand-in's clock

Keys of `status`, `cut` and `truncate`: `path=TEXT` (only where the path holds it), `method=GET|POST...`,
`times=N` (at most N times), `act=1` (do what was asked before misbehaving), `retry_after=SECONDS` and
`error=N` (the code in the body). Keys of `fail`: `reason_code=N`, `times=N`. Key of `queue`: `seconds=S`.
"""

from dataclasses import dataclass

KINDS = ("status", "cut", "truncate", "fail", "queue")

# HTTP status -> the code and the text in the body.
BODIES = {
    400: (1000, "The request is malformed."),
    401: (1219, "Invalid credentials."),
    403: (1352, "You are not authorized to run a session when using the open plan."),
    404: (1291, "Job not found."),
    409: (None, "Job create exceeds the usage limit of the instance."),
    429: (1202, "Rate limit exceeded."),
    500: (None, "Internal server error."),
    503: (None, "Service unavailable."),
}


class FaultError(ValueError):
    """The specification is wrong; the text says where."""


@dataclass
class Fault:
    kind: str
    code: int = 500
    path: str = ""
    method: str = ""
    times: int = -1
    act: int = 0
    retry_after: float = -1.0
    error: int = 0
    reason_code: int = 1517
    seconds: float = 0.0

    @classmethod
    def parse(cls, text):
        kind, _, rest = text.partition(":")
        if kind not in KINDS:
            raise FaultError(f"{kind!r} is none of {', '.join(KINDS)}")
        fault = cls(kind)
        for pair in filter(None, rest.split(",")):
            key, _, value = pair.partition("=")
            if key == "kind" or key not in cls.__dataclass_fields__:
                raise FaultError(f"{text!r}: {key!r} is no key of a fault")
            try:
                setattr(fault, key, type(getattr(fault, key))(value))
            except ValueError:
                raise FaultError(f"{text!r}: {value!r} is no value of {key}") from None
        return fault


class Faults:
    def __init__(self, texts=()):
        self.active = [Fault.parse(text) for text in texts]

    def add(self, text):
        self.active.append(Fault.parse(text))

    def clear(self):
        self.active.clear()

    def _take(self, fits):
        for fault in self.active:
            if fault.times != 0 and fits(fault):
                fault.times -= 1 if fault.times > 0 else 0
                return fault
        return None

    def for_request(self, method, path):
        return self._take(lambda fault: fault.kind in ("status", "cut", "truncate")
                          and fault.path in path and fault.method in ("", method))

    def for_job(self):
        return self._take(lambda fault: fault.kind == "fail")

    def queue_seconds(self):
        return sum(fault.seconds for fault in self.active if fault.kind == "queue")


def body(status, error, trace):
    """An error body as the API has it."""
    code, message = BODIES.get(status, (None, "Something is wrong."))
    item = {"message": message, "solution": "See the documentation.", "more_info": "https://quantum.cloud.ibm.com/docs"}
    if error or code:
        item = {"code": error or code, **item}
    return {"errors": [item], "trace": trace}

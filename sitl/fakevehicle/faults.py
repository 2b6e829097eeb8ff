"""Misbehaviour: what can go wrong and when. The links and mission servers ask; this module decides.

A fault is written `KIND[:key=value,key=value...]`, the same on the command line, in a script and on
the control channel. `KINDS` below is the whole language; `--help` and the README are made from it.
Everything random comes from one generator with a printed seed.
"""

import math
import random
from dataclasses import dataclass, field, replace

from .dialect import TYPE_NUMBERS
from .items import float_from_json

HELP_COMMON = (
    "Every fault: from=S, until=S (active only between these seconds, counted from when the fault was added), "
    "times=N (at most N times).")
HELP_FRAMES = (
    "Faults on frames: p=PROBABILITY (default 1), dir=rx|tx|both (rx is towards the vehicle), "
    "msg=NAME+NAME (only these messages), link=N (only the Nth link, from 0).")
HELP_PLANS = "Faults on plans: type=mission|fence|rally (default: any)."


class FaultError(ValueError):
    """The specification is wrong; the text says where."""


def _probability(text):
    value = float(text)
    if not 0 <= value <= 1:
        raise ValueError("must be from 0 to 1")
    return value


def _seconds(text):
    value = float(text)
    if not (math.isfinite(value) and value >= 0):
        raise ValueError("must be a number of at least 0")
    return value


def _whole(text):
    value = int(text)
    if value < 0:
        raise ValueError("must not be negative")
    return value


def _choice(*allowed):
    def parse(text):
        if text not in allowed:
            raise ValueError("must be one of " + ", ".join(allowed))
        return text
    return parse


def _names(text):
    return frozenset(name.upper() for name in text.split("+"))


def _mission_type(text):
    if text not in ("mission", "fence", "rally"):
        raise ValueError("must be mission, fence or rally")
    return TYPE_NUMBERS[text]


def _value(text):
    if text in ("nan", "inf", "-inf"):
        return float(text)
    return float_from_json(float(text))


COMMON = {"from": (_seconds, 0.0), "until": (_seconds, math.inf), "times": (_whole, None)}
FRAMES = {"p": (_probability, 1.0), "dir": (_choice("rx", "tx", "both"), "both"), "msg": (_names, None),
          "link": (_whole, None)}
PLANS = {"type": (_mission_type, None)}
WHEN = {"when": (_choice("upload", "download"), "upload"), "item": (_whole, None), "at": (_seconds, None)}

FIELD = (_choice("param1", "param2", "param3", "param4", "x", "y", "z", "frame", "command"), "z")

# kind -> (group of common keys, own keys {name: (parser, default)}, help)
KINDS = {
    "drop": (FRAMES, {}, "lose the frame"),
    "delay": (FRAMES, {"ms": (_seconds, 100.0), "jitter": (_seconds, 0.0)},
              "deliver ms later, plus up to jitter ms more; the order is kept"),
    "duplicate": (FRAMES, {"copies": (_whole, 1)}, "deliver copies times more"),
    "reorder": (FRAMES, {"ms": (_seconds, 30.0)}, "hold the frame back for ms and let later ones overtake it"),
    "corrupt": (FRAMES, {}, "flip bits on the way (towards the vehicle: the frame is lost to its checksum)"),
    "noise": (FRAMES, {"bytes": (_whole, 1000)}, "random bytes before the frame (over UDP: in a datagram of their own)"),
    "silence": (FRAMES, {"for": (_seconds, 2.0), "every": (_seconds, None)},
                "a burst of total loss: for seconds from `from` on, again every `every` seconds"),
    "refuse-count": (PLANS, {"code": (_whole, 4)}, "answer an upload's COUNT with this MAV_MISSION_RESULT"),
    "refuse-item": (PLANS, {"item": (_whole, None), "code": (_whole, 5)},
                    "answer item number `item` of an upload with this MAV_MISSION_RESULT and end the upload"),
    "busy": (PLANS, {}, "answer as if somebody else were transferring (ArduPilot DENIED, PX4 ERROR); use until="),
    "half-write": (PLANS, {"item": (_whole, 1)}, "accept the whole upload but store only the first `item` items"),
    "refuse-ftp": ({}, {"code": (_whole, 1)}, "answer every MAVLink FTP request with this error"),
    "vanish-fence": ({}, {"after": (_seconds, 0.6)}, "erase a fence this long after it was accepted"),
    "lying-count": (PLANS, {"delta": (int, 1), "count": (_whole, None)},
                    "announce a false count for a download: the true one plus delta, or count"),
    "bad-value": (PLANS, {"item": (_whole, None), "field": FIELD, "value": (_value, math.nan)},
        "send this value in a downloaded item (what is stored stays right)"),
    "mis-store": (PLANS, {"item": (_whole, 1), "field": FIELD, "value": (_value, math.nan)},
                  "accept an item but store it with this value (as it comes back from storage)"),
    "reboot": (PLANS, {**WHEN, "for": (_seconds, 1.0), "close": (_whole, 0)},
               "restart at a time (at=S) or after an item went through (item=K): transfers, routes and stream rates "
               "are forgotten, storage is kept, silent for `for` seconds; close=1 also closes TCP connections"),
    "vanish": (PLANS, WHEN, "stop answering for good, at=S or after item=K"),
    "second-gcs": (PLANS, {**WHEN, "count": (_whole, 5), "pace": (_seconds, 50.0), "stop": (_whole, None)},
                   "another ground station (255/190) uploads count items of its own, one per pace ms, starting at=S "
                   "or after item=K of your transfer; it gives up silently after `stop` items"),
}
ON_VEHICLE = ("reboot", "vanish", "second-gcs")
ON_FRAMES = [kind for kind, (group, _, _) in KINDS.items() if group is FRAMES]


@dataclass
class Fault:
    kind: str
    spec: str
    options: dict
    number: int = 0
    added: float = 0.0
    applied: int = 0

    def active(self, now):
        age = now - self.added
        if not self.options["from"] <= age < self.options["until"]:
            return False
        return self.options["times"] is None or self.applied < self.options["times"]

    def matches_plan(self, mission_type, item):
        options = self.options
        if options.get("type") is not None and options["type"] != mission_type:
            return False
        return item is None or options.get("item") is None or options["item"] == item

    def in_burst(self, now):
        age = now - self.added - self.options["from"]
        if self.options["every"]:
            age %= self.options["every"]
        return age < self.options["for"]

    def spoil(self, item):
        """For bad-value and mis-store: the item with one field replaced."""
        name, value = self.options["field"], self.options["value"]
        if name.startswith("param"):
            params = list(item.params)
            params[int(name[-1]) - 1] = value
            return replace(item, params=tuple(params))
        if name == "z":
            return replace(item, z=value)
        limit = {"x": 2**31 - 1, "y": 2**31 - 1, "frame": 255, "command": 65535}[name]
        whole = limit if not math.isfinite(value) else int(max(-limit - 1 if name in "xy" else 0, min(limit, value)))
        return replace(item, **{name: whole})


def parse_fault(spec):
    """Reads `KIND[:key=value,...]`; raises FaultError."""
    kind, _, rest = spec.partition(":")
    kind = kind.strip()
    if kind not in KINDS:
        raise FaultError(f"unknown fault {kind!r}; there are: {', '.join(KINDS)}")
    group, own, _ = KINDS[kind]
    keys = {**COMMON, **group, **own}
    options = {name: default for name, (_, default) in keys.items()}
    for pair in filter(None, (part.strip() for part in rest.split(","))):
        name, equals, text = pair.partition("=")
        if name not in keys:
            raise FaultError(f"fault {kind!r} has no key {name!r}; it has: {', '.join(keys)}")
        if not equals:
            raise FaultError(f"fault {kind!r}: write {name}=VALUE")
        try:
            options[name] = keys[name][0](text)
        except ValueError as error:
            raise FaultError(f"fault {kind!r}: {name}={text}: {error}") from error
    if kind in ON_VEHICLE and options["item"] is None and options["at"] is None:
        raise FaultError(f"fault {kind!r} needs at=SECONDS or item=NUMBER")
    return Fault(kind, spec, options)


@dataclass
class Verdict:
    """What happens to one frame."""

    lost: bool = False
    corrupt: bool = False
    copies: int = 1
    delay_s: float = 0.0
    hold_s: float = 0.0
    noise_bytes: int = 0
    because: list = field(default_factory=list)


class Faults:
    """All faults of one vehicle. `clock` gives seconds; `seed` makes the random ones repeat."""

    def __init__(self, seed, clock):
        self.seed = seed
        self.random = random.Random(seed)
        self.clock = clock
        self.faults = []
        self.numbers = 0

    def add(self, spec):
        fault = parse_fault(spec)
        self.numbers += 1
        fault.number, fault.added = self.numbers, self.clock()
        self.faults.append(fault)
        return fault

    def reset(self, seed):
        """As if just made, with this seed."""
        self.__init__(seed, self.clock)

    def clear(self, number=None):
        """Removes one fault, or all."""
        self.faults = [fault for fault in self.faults if number is not None and fault.number != number]

    def take(self, kind, mission_type=None, item=None, exact_item=False, **facts):
        """The first active fault of this kind that fits, counted as applied; None if there is none.

        A fault without item= fits every item, unless `exact_item`."""
        now = self.clock()
        for fault in self.faults:
            if (fault.kind == kind and fault.active(now) and fault.matches_plan(mission_type, item)
                    and not (exact_item and fault.options["item"] is None)
                    and all(fault.options.get(name) == value for name, value in facts.items())):
                fault.applied += 1
                return fault
        return None

    def frame(self, direction, name, link):
        """What the link faults do to this frame."""
        verdict, now = Verdict(), self.clock()
        for fault in self.faults:
            if fault.kind not in ON_FRAMES or not fault.active(now):
                continue
            options = fault.options
            if options["dir"] not in ("both", direction) or options["link"] not in (None, link):
                continue
            if options["msg"] and name not in options["msg"]:
                continue
            if fault.kind == "silence" and not fault.in_burst(now):
                continue
            if options["p"] < 1 and self.random.random() >= options["p"]:
                continue
            fault.applied += 1
            self._apply(fault, verdict)
        return verdict

    def _apply(self, fault, verdict):
        options = fault.options
        if fault.kind in ("drop", "silence"):
            verdict.lost = True
        elif fault.kind == "corrupt":
            verdict.corrupt = True
        elif fault.kind == "duplicate":
            verdict.copies += options["copies"]
        elif fault.kind == "delay":
            verdict.delay_s += (options["ms"] + self.random.random() * options["jitter"]) / 1000
        elif fault.kind == "reorder":
            verdict.hold_s = max(verdict.hold_s, options["ms"] / 1000)
        elif fault.kind == "noise":
            verdict.noise_bytes += options["bytes"]
        verdict.because.append(fault.kind)

    def corrupted(self, frame):
        """The frame with one to three bits flipped."""
        frame = bytearray(frame)
        for _ in range(self.random.randint(1, 3)):
            frame[self.random.randrange(len(frame))] ^= 1 << self.random.randrange(8)
        return bytes(frame)

    def to_json(self):
        return [{"number": fault.number, "spec": fault.spec, "applied": fault.applied} for fault in self.faults]


def help_text():
    lines = ["faults (--fault KIND[:key=value,...], repeatable):", ""]
    for kind, (_, own, text) in KINDS.items():
        keys = ", ".join(f"{name}={'...' if default is None else default:g}" if isinstance(default, float)
                         else f"{name}={'...' if default is None else default}" for name, (_, default) in own.items())
        lines.append(f"  {kind}{': ' + keys if keys else ''}")
        lines.append(f"      {text}")
    return "\n".join(lines + ["", "  " + HELP_COMMON, "  " + HELP_FRAMES, "  " + HELP_PLANS])

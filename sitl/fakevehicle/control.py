"""The control channel and scripts: one JSON command per line, the same commands in both.

A command is {"cmd": NAME, ...}; every answer is one JSON line with "ok". A script line adds when:
{"at": SECONDS, ...} or {"on": EVENT, "where": {FIELD: VALUE}, "nth": N, ...}.
"""

import asyncio
import json
import math
import os

from .dialect import TYPE_NUMBERS
from .ground_station import GroundStation
from .items import Item, Refused
from .plan_files import PlanFileError, load_plan
from .report import dump

LONGEST_LINE = 16 * 1024 * 1024
COMMAND_HELP = """control commands (--control, --script), one JSON object per line:

  {"cmd": "dump"}                        everything the vehicle holds
  {"cmd": "set", "armed": true, "mode": "AUTO", "home": [lat, lon, alt], "position": [lat, lon, alt],
   "current": 3, "param": {"FENCE_ENABLE": 0}, "mission": X, "fence": X, "rally": X}
                                         any of these; X is a file name, or a list of items as in the dump but
                                         without home (an edit by somebody else, without a transfer)
  {"cmd": "fault", "spec": "drop:p=0.3"} adds a fault, answers its number
  {"cmd": "clear-faults", "number": 2}   removes one fault, or all of them without a number
  {"cmd": "reboot", "for": 1.0}          down for that long
  {"cmd": "vanish"}                      silent for good
  {"cmd": "wait", "on": "upload_item", "where": {"item": 3}, "nth": 1, "for": 10}
                                         answers when that has happened (or after `for` seconds: an error);
                                         only on the control channel
  {"cmd": "reset", "seed": 7}            as just started, with empty plans and this seed; links stay open
  {"cmd": "gcs-upload", "type": "mission", "items": X, "pace": 0.05, "stop": 3}
                                         another ground station (255/190) uploads X over the protocol, one item
                                         per pace seconds, giving up silently after `stop` items if given; a list
                                         X as it goes over the link (for an ArduPilot item 0 is the home slot)
  {"cmd": "inject", "hex": "fd09..."}    puts these bytes on every link, as somebody else on the line would
  {"cmd": "statustext", "text": "hello", "severity": 6}
  {"cmd": "quit"}

script lines add when: {"at": 2.5, ...} seconds after the start, or {"on": "upload_item",
"where": {"type": "mission", "item": 3}, "nth": 1, ...} at the nth such event (names as in the dump's
event log). Lines starting with # are comments."""


class CommandError(ValueError):
    """The command cannot be carried out; the text says why."""


class Controller:
    def __init__(self, vehicle, quit_event):
        self.vehicle, self.quit_event = vehicle, quit_event
        self.server, self.tasks = None, set()

    def execute(self, command):
        """Carries out one command and returns the answer; raises CommandError."""
        handler = {
            "dump": self._dump, "set": self._set, "fault": self._fault, "clear-faults": self._clear_faults,
            "reboot": self._reboot, "vanish": self._vanish, "statustext": self._statustext,
            "inject": self._inject, "gcs-upload": self._gcs_upload, "reset": self._reset, "quit": self._quit,
        }.get(command.get("cmd"))
        if handler is None:
            raise CommandError(f"unknown cmd {command.get('cmd')!r}")
        try:
            return {"ok": True, **(handler(command) or {})}
        except Refused as refusal:
            raise CommandError(f"item {refusal.index} refused: {refusal}") from refusal
        except (ValueError, KeyError, TypeError, PlanFileError, OverflowError) as error:
            raise CommandError(f"{command.get('cmd')}: {error}") from error

    def _dump(self, _command):
        return {"dump": dump(self.vehicle)}

    def _set(self, command):
        vehicle = self.vehicle
        known = {"cmd", "at", "on", "where", "nth", "armed", "mode", "home", "position", "current", "param",
                 "mission", "fence", "rally"}
        if set(command) - known:
            raise ValueError(f"unknown keys: {', '.join(sorted(set(command) - known))}")
        for name in ("mission", "fence", "rally"):
            if name in command:
                vehicle.load(TYPE_NUMBERS[name], _items(command[name], TYPE_NUMBERS[name]))
        if "home" in command:
            vehicle.set_home(_place(command["home"]))
        if "position" in command:
            vehicle.position = _place(command["position"])
        if "armed" in command:
            vehicle.set_armed(command["armed"])
        if "mode" in command:
            vehicle.set_mode(command["mode"])
        if "current" in command and not vehicle.set_current(int(command["current"])):
            raise ValueError(f"current {command['current']} is not in the mission")
        for name, value in command.get("param", {}).items():
            vehicle.announce_parameter(name, value)

    def _fault(self, command):
        return {"number": self.vehicle.add_fault(command["spec"]).number}

    def _clear_faults(self, command):
        self.vehicle.faults.clear(command.get("number"))

    def _reboot(self, command):
        self.vehicle.reboot(float(command.get("for", 1.0)), bool(command.get("close", False)))

    def _vanish(self, _command):
        self.vehicle.vanish()

    def _reset(self, command):
        self.vehicle.reset(int(command.get("seed", 0)))

    async def wait(self, command):
        """For an event that has not happened yet."""
        happened = asyncio.get_running_loop().create_future()
        left = int(command.get("nth", 1))

        def listener(name, fields):
            nonlocal left
            if name == command["on"] and _fits(fields, command.get("where", {})):
                left -= 1
                if left == 0 and not happened.done():
                    happened.set_result(fields)

        listeners = self.vehicle.log.listeners
        listeners.append(listener)
        try:
            return {"ok": True, "fields": await asyncio.wait_for(happened, float(command.get("for", 10)))}
        except asyncio.TimeoutError:
            return {"ok": False, "error": f"no {command['on']}"}
        finally:
            if listener in listeners:
                listeners.remove(listener)

    def _gcs_upload(self, command):
        mission_type = TYPE_NUMBERS[command.get("type", "mission")]
        items = _items(command["items"], mission_type)
        if isinstance(command["items"], str):
            items = self.vehicle.mission_server(None).over_the_link(mission_type, items)
        GroundStation(self.vehicle).upload(mission_type, items, float(command.get("pace", 0.05)), command.get("stop"))

    def _statustext(self, command):
        self.vehicle.statustext(int(command.get("severity", 6)), str(command["text"]))

    def _inject(self, command):
        data = bytes.fromhex(command["hex"])
        for channel in self.vehicle.channels:
            channel.write(data)

    def _quit(self, _command):
        self.quit_event.set()

    # ---- the channel

    async def serve(self, where):
        """`PORT` on localhost, or `unix:PATH`; returns what to print in the ready line."""
        if where.startswith("unix:"):
            path = where[5:]
            if os.path.exists(path):
                os.unlink(path)
            self.server = await asyncio.start_unix_server(self._connected, path, limit=LONGEST_LINE)
            return {"unix": path}
        self.server = await asyncio.start_server(self._connected, "127.0.0.1", int(where), limit=LONGEST_LINE)
        return {"port": self.server.sockets[0].getsockname()[1]}

    def close(self):
        self.server.close()
        for task in self.tasks:
            task.cancel()

    def _connected(self, reader, writer):
        task = self.vehicle.loop.create_task(self._converse(reader, writer))
        self.tasks.add(task)
        task.add_done_callback(self.tasks.discard)

    async def _converse(self, reader, writer):
        try:
            while line := await reader.readline():
                try:
                    command = _json(line)
                    if not isinstance(command, dict):
                        raise CommandError("a command is a JSON object")
                    waits = command.get("cmd") == "wait" and isinstance(command.get("on"), str)
                    answer = await self.wait(command) if waits else self.execute(command)
                except ValueError as error:  # CommandError and bad JSON alike
                    answer = {"ok": False, "error": str(error)}
                writer.write(json.dumps(answer).encode() + b"\n")
                await writer.drain()
        except (OSError, ValueError):
            pass
        finally:
            writer.close()


class Script:
    """Commands with a time or an event; errors while running go to `complain`."""

    def __init__(self, path, controller, complain):
        self.controller, self.complain = controller, complain
        self.waiting = []
        self.timed = []
        with open(path, encoding="utf-8") as file:
            for number, line in enumerate(file, 1):
                if not line.strip() or line.lstrip().startswith("#"):
                    continue
                try:
                    command = _json(line)
                    if not isinstance(command, dict) or ("at" in command) == ("on" in command):
                        raise ValueError('needs either "at" or "on"')
                    (self.timed if "at" in command else self.waiting).append((f"{path}:{number}", command))
                except ValueError as error:
                    raise CommandError(f"{path}:{number}: {error}") from error

    def start(self):
        vehicle = self.controller.vehicle
        for where, command in self.timed:
            vehicle.loop.call_later(float(command["at"]), self._run, where, command)
        self.left = {where: int(command.get("nth", 1)) for where, command in self.waiting}
        vehicle.log.listeners.append(self._on_event)

    def _on_event(self, name, fields):
        for where, command in list(self.waiting):
            conditions = command.get("where", {})
            if command["on"] != name or not _fits(fields, conditions):
                continue
            self.left[where] -= 1
            if self.left[where] == 0:
                self.waiting.remove((where, command))
                self._run(where, command)

    def _run(self, where, command):
        try:
            self.controller.execute(command)
        except CommandError as error:
            self.complain(f"{where}: {error}")


def _fits(fields, conditions):
    return all(fields.get(key) == value for key, value in conditions.items())


def _items(source, mission_type):
    if isinstance(source, str):
        return load_plan(source).items[mission_type]
    return [Item.from_json(fields) for fields in source]


def _json(line):
    def refuse(constant):
        raise ValueError(f"{constant} is not JSON; write null for NaN")
    return json.loads(line, parse_constant=refuse)


def _place(values):
    lat, lon, alt = (float(value) for value in values)
    if not (abs(lat) <= 90 and abs(lon) <= 180 and math.isfinite(alt)):
        raise ValueError(f"not a place: {values}")
    return lat, lon, alt

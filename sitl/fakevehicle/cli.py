"""Command line, ready line, signals."""

import argparse
import asyncio
import json
import math
import os
import random
import signal
import sys

from .control import COMMAND_HELP, CommandError, Controller, Script
from .dialect import FENCE, MISSION, RALLY, TYPE_NAMES, TYPE_NUMBERS
from .faults import FaultError, help_text
from .items import Refused
from .links import make_link
from .persona import PERSONAS
from .plan_files import PlanFileError, load_plan
from .report import dump, write_json
from .signing import Signing
from .vehicle import Vehicle

DESCRIPTION = """A fake ArduPilot or PX4 vehicle for testing MAVLink software.

It holds a mission, a fence and rally points and serves them over the MAVLink mission protocol the way
the chosen autopilot does, over any number of links at once. It does not fly. When it is ready it prints
one line of JSON on stdout: {"ready": true, "links": [...], "control": ..., "seed": ...}; everything else
goes to stderr. It ends on SIGTERM, SIGINT or {"cmd": "quit"}.

links (--link URL, repeatable; default udpout:127.0.0.1:14550):
  udpout:HOST:PORT   sends to whoever listens there, from the first heartbeat on
  udpin:HOST:PORT    binds; answers everybody who speaks to it (port 0: any free port)
  tcpin:HOST:PORT    a server for any number of clients (port 0: any free port)
  tcpout:HOST:PORT   connects, again and again if need be
  pty[:PATH]         a serial line: a pty in raw mode, its slave also under PATH if given"""


def parser():
    epilog = help_text() + "\n\n" + COMMAND_HELP
    result = argparse.ArgumentParser(
        prog="fake_vehicle.py", description=DESCRIPTION, epilog=epilog,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    add = result.add_argument
    add("--persona", choices=sorted(PERSONAS), default="ardupilot", help="whose behaviour (default: ardupilot)")
    add("--link", action="append", metavar="URL", help="a link to open, see above")
    add("--baud", type=int, metavar="N", help="pace every pty link to this baud rate, both ways")
    add("--sysid", type=int, default=1, help="MAVLink system id (default: 1); the component is always 1")
    add("--uid", type=int, default=0x66616B65, metavar="N",
        help="the flight controller's own number, in AUTOPILOT_VERSION; 0: it has none")
    add("--mission", metavar="FILE", help="what it holds: a .plan (mission, fence and rally) or QGC WPL 110 file")
    add("--fence", metavar="FILE", help="the fence, from a .plan or waypoint file")
    add("--rally", metavar="FILE", help="the rally points, from a .plan or waypoint file")
    add("--home", metavar="LAT,LON,ALT", 
        help="home, AMSL altitude (default: the mission file's); write --home=-35,... in the south")
    add("--capacity", action="append", metavar="TYPE=N", default=[],
        help="most items of mission, fence or rally (default: the persona's; raised to what the files hold)")
    add("--armed", action="store_true", help="armed from the start")
    add("--mode", help="flight mode by name, e.g. AUTO (ardupilot), MISSION (px4)")
    add("--current", type=int, metavar="SEQ", help="the current mission item")
    add("--param", action="append", metavar="NAME=VALUE", default=[], help="set a parameter")
    add("--stream-rate", type=float, metavar="HZ",
        help="telemetry streamed without being asked (default: ardupilot 0, px4 1)")
    add("--speedup", type=float, default=1.0, metavar="X",
        help="run the vehicle's clock (protocol time-outs, heartbeats, time since boot) X times faster")
    add("--fault", action="append", metavar="SPEC", default=[], help="misbehave, see below")
    add("--script", metavar="FILE", help="JSON commands with a time or an event, see below")
    add("--signing-key", metavar="FILE", help="sign with this key (32 bytes, or 64 hex digits) and demand signatures")
    add("--accept-unsigned", action="store_true", help="with --signing-key: take unsigned messages too")
    add("--seed", type=int, help="seed of everything random (default: chosen, and printed)")
    add("--dump", metavar="FILE", help="write everything it holds as JSON on exit and on SIGUSR1 ('-': stdout)")
    add("--control", metavar="PORT|unix:PATH", help="accept JSON commands there (TCP: localhost only, 0: any port)")
    add("--exit-on-stdin-eof", action="store_true", help="end when stdin closes, so that no orphan stays behind")
    return result


class UsageError(Exception):
    """Something on the command line or in a file cannot be used."""


def main(argv=None):
    arguments = parser().parse_args(argv)
    try:
        asyncio.run(run(arguments))
    except (UsageError, CommandError, FaultError, PlanFileError, OSError) as error:
        print(f"fake_vehicle: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        pass
    return 0


async def run(arguments):
    loop = asyncio.get_running_loop()
    quit_event = asyncio.Event()
    vehicle = make_vehicle(arguments)
    controller = Controller(vehicle, quit_event)
    script = Script(arguments.script, controller, complain) if arguments.script else None

    def write_dump():
        if arguments.dump == "-":
            print(json.dumps(dump(vehicle), allow_nan=False), flush=True)
        elif arguments.dump:
            write_json(arguments.dump, dump(vehicle))
        vehicle.event("dumped")

    def unexpected(loop, context):
        vehicle.event("internal_error", error=repr(context.get("exception") or context.get("message")))
        loop.default_exception_handler(context)

    loop.set_exception_handler(unexpected)
    for number in (signal.SIGTERM, signal.SIGINT):
        loop.add_signal_handler(number, quit_event.set)
    loop.add_signal_handler(signal.SIGUSR1, write_dump)
    links = []
    try:
        for number, url in enumerate(arguments.link or ["udpout:127.0.0.1:14550"]):
            try:
                link = make_link(vehicle, number, url, arguments.baud)
            except ValueError as error:
                raise UsageError(f"--link {error}") from error
            await link.open()
            links.append(link)
        ready = {"ready": True, "links": [link.describe() for link in links], "seed": vehicle.faults.seed,
                 "pid": os.getpid()}
        if arguments.control:
            ready["control"] = await controller.serve(arguments.control)
        if arguments.exit_on_stdin_eof:
            watch_stdin(loop, quit_event)
        vehicle.started = loop.time()
        for spec in arguments.fault:
            vehicle.add_fault(spec)
        if script:
            script.start()
        vehicle.heartbeat_for_ever()
        print(json.dumps(ready), flush=True)
        await quit_event.wait()
        write_dump()
    finally:
        for link in links:
            await link.close()
        if controller.server:
            controller.close()
        if arguments.control and arguments.control.startswith("unix:") and os.path.exists(arguments.control[5:]):
            os.unlink(arguments.control[5:])


def make_vehicle(arguments):
    """The vehicle with its plans loaded, before any link is open."""
    persona = PERSONAS[arguments.persona]
    if not 1 <= arguments.sysid <= 255:
        raise UsageError(f"--sysid {arguments.sysid} is not from 1 to 255")
    if not arguments.speedup > 0:
        raise UsageError("--speedup has to be greater than 0")
    plans = {}
    home = None
    if arguments.mission:
        plan = load_plan(arguments.mission)
        plans.update(plan.items)
        home = plan.home
    for mission_type, path in ((FENCE, arguments.fence), (RALLY, arguments.rally)):
        if path:
            plans[mission_type] = load_plan(path).items[mission_type]
    if arguments.home:
        home = _home(arguments.home)
    capacities = dict(_capacity(text) for text in arguments.capacity)
    for mission_type, items in plans.items():
        most = capacities.get(mission_type, persona.capacities[mission_type])
        held = len(items) + (1 if mission_type == MISSION and persona.home_is_item_zero else 0)
        if held > most:
            complain(f"{TYPE_NAMES[mission_type]}: {held} items loaded, capacity raised from {most}")
            capacities[mission_type] = held
    try:
        signing = Signing.from_file(arguments.signing_key, arguments.accept_unsigned)
    except (OSError, ValueError) as error:
        raise UsageError(f"--signing-key {error}") from error
    seed = arguments.seed if arguments.seed is not None else random.SystemRandom().randrange(2**32)
    complain(f"seed {seed}")
    vehicle = Vehicle(persona, sysid=arguments.sysid, home=home, seed=seed, speedup=arguments.speedup,
                      streams_hz=arguments.stream_rate, capacities=capacities, signing=signing,
                      uid=arguments.uid)
    for mission_type, items in plans.items():
        try:
            vehicle.load(mission_type, items)
        except Refused as refusal:
            raise UsageError(f"{TYPE_NAMES[mission_type]} item {refusal.index} ({items[refusal.index]}): "
                             f"a {persona.name} would refuse it with {refusal}") from refusal
        except ValueError as error:
            raise UsageError(f"{TYPE_NAMES[mission_type]}: a {persona.name} would refuse it: {error}") from error
    vehicle.armed = arguments.armed
    try:
        if arguments.mode:
            vehicle.set_mode(arguments.mode)
        for text in arguments.param:
            name, _, value = text.partition("=")
            vehicle.parameters.set(name, float(value))
    except ValueError as error:
        raise UsageError(str(error)) from error
    if arguments.current is not None and not vehicle.set_current(arguments.current):
        raise UsageError(f"--current {arguments.current} is not in the mission")
    return vehicle


def _home(text):
    try:
        lat, lon, alt = (float(part) for part in text.split(","))
    except ValueError as error:
        raise UsageError(f"--home {text!r} is not LAT,LON,ALT") from error
    if not (abs(lat) <= 90 and abs(lon) <= 180 and math.isfinite(alt)):
        raise UsageError(f"--home {text!r} is not on this planet")
    return lat, lon, alt


def _capacity(text):
    name, _, number = text.partition("=")
    if name not in ("mission", "fence", "rally") or not number.isdigit():
        raise UsageError(f"--capacity {text!r} is not mission|fence|rally=NUMBER")
    return TYPE_NUMBERS[name], int(number)


def watch_stdin(loop, quit_event):
    def readable():
        if not os.read(0, 4096):
            loop.remove_reader(0)
            quit_event.set()
    try:
        loop.add_reader(0, readable)
    except OSError as error:  # a file or /dev/null cannot be waited for
        raise UsageError("--exit-on-stdin-eof needs a pipe, socket or terminal as stdin") from error


def complain(text):
    print(f"fake_vehicle: {text}", file=sys.stderr, flush=True)

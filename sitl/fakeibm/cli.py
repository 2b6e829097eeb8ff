"""Command line and ready line."""

import argparse
import json
import os
import signal
import sys
import threading

from . import faults, sampling, snapshots
from .http import Server
from .jobs import Clock, Jobs
from .tokens import Tokens

DESCRIPTION = """A stand-in for IBM Quantum's REST service (IAM, the quantum API, Global Search) with QPUs that
qiskit-ibm-runtime has snapshots of. Circuits are checked against the QPU's instruction set and run on a simulator.
When it is ready it prints one line of JSON on stdout, {"ready": true, "iam": URL, "api": URL, "control": URL};
it ends on SIGTERM or SIGINT."""

CRN = ("crn:v1:bluemix:public:quantum-computing:us-east:a/0123456789abcdef0123456789abcdef:"
       "11111111-2222-3333-4444-555555555555::")


def parser():
    result = argparse.ArgumentParser(prog="fake_ibm.py", description=DESCRIPTION, epilog=faults.__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    add = result.add_argument
    add("--port", type=int, default=0, help="where to listen on 127.0.0.1 (default: any free port)")
    add("--backend", action="append", choices=sorted(snapshots.KNOWN), help="a QPU to offer (default: all)")
    add("--key", default="FAKE-API-KEY-0000", help="the API key that it knows (default: %(default)s)")
    add("--crn", default=CRN, help="the instance that it knows")
    add("--token-life", type=float, default=3600, metavar="S", help="how long a token lives (default: 3600)")
    add("--noise", choices=sorted(sampling.SAMPLERS), default="qpu",
        help="none: ideal QPUs; qpu: their recorded errors (default)")
    add("--rate-limit", type=int, default=5, metavar="N", help="submissions a minute, 0: any number (default: 5)")
    add("--clock-scale", type=float, default=1.0, metavar="X", help="its clock runs X times as fast (default: 1)")
    add("--consumed", type=float, default=12.0, metavar="S", help="QPU seconds used of 600 (default: 12)")
    add("--seed", type=int, default=0, help="seed of the QPUs' randomness (default: 0)")
    add("--fault", action="append", default=[], metavar="SPEC", help="misbehaviour, see below; repeatable")
    add("--exit-on-stdin-eof", action="store_true", help="end with the process that started it")
    return result


def main():
    arguments = parser().parse_args()
    try:
        misbehaviour = faults.Faults(arguments.fault)
    except faults.FaultError as error:
        parser().error(str(error))
    qpus = {name: snapshots.Qpu(name) for name in arguments.backend or snapshots.KNOWN}
    jobs = Jobs(qpus, sampling.SAMPLERS[arguments.noise], Clock(arguments.clock_scale), misbehaviour,
                limit=arguments.rate_limit, seed=arguments.seed, consumed=arguments.consumed)
    server = Server(("127.0.0.1", arguments.port), jobs, Tokens(arguments.key, arguments.token_life), arguments.crn)
    base = f"http://127.0.0.1:{server.server_port}"
    print(json.dumps({"ready": True, "iam": base, "api": base + "/api/v1", "control": base + "/control",
                      "crn": arguments.crn}), flush=True)
    if arguments.exit_on_stdin_eof:
        def watch():
            sys.stdin.read()
            os._exit(0)
        threading.Thread(target=watch, daemon=True).start()
    signal.signal(signal.SIGTERM, lambda *_: os._exit(0))
    try:
        server.serve_forever()
    except KeyboardInterrupt:
        pass
    return 0

#!/usr/bin/env python3
"""The six scenarios planned with --engine ibm on the stand-in of a QPU with its recorded errors.

Every plan must be clear by `quavd check` and at most 1.10 times as long as the shortest path there is. Then the paper's
way: 20 Adam steps on the QPU (--train qpu), whose loss must fall by more than its shot noise; the curve is printed and
written to `ibm_training.json`. Ends with status 0 only if all of that is so.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(HERE)
sys.path.insert(0, os.path.join(HERE, "ibm"))

from service import KEY, Service  # noqa: E402  (needs the line above)

# Shortest lengths with a buffer of 5 m, metres: bracketed to 1 cm by a solver that is not part of quavd.
EXACT = {"s1": 804.47, "s2": 583.33, "s3": 351.66, "s4": 465.75, "s5": 354.07, "s6": 632.90}
MOST = 1.10


def quavd(program, service, state, *arguments):
    environment = os.environ | {
        "QUAV_IBM_API_KEY": KEY, "QUAV_IBM_CRN": service.crn, "QUAV_IBM_API_URL": service.api,
        "QUAV_IBM_IAM_URL": service.ready["iam"], "STATE_DIRECTORY": state}
    done = subprocess.run([program, *arguments], env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{' '.join(arguments)}: status {done.returncode}: {done.stderr}")
    return done.stdout


def scenarios(plan, check, backend, most):
    """Plans all scenarios; whether all of them are good."""
    print(f"{'':4} {'length':>9} {'exact':>9} {'ratio':>6} {'jobs':>4} {'circuits':>8} {'QPU s':>6} {'estimate':>8} "
          f"{'mitigated':>9} {'as read':>9} {'ideal':>9} {'time':>6}")
    good = True
    for name, exact in EXACT.items():
        began = time.monotonic()
        document, planned = plan(name)
        took = time.monotonic() - began
        rounds = [r for leg in document["legs"] for r in leg["rounds"]]
        used, first = document["qpu"], rounds[0]["qpu"]
        ratio = document["length_m"] / exact
        clear = json.loads(check(name, planned))["collision_free"]
        fine = (clear and document["collision_free"] and ratio <= most and document["fallback"] is None
                and {r["engine"] for r in rounds} == {"ibm"} and used["backend"] == backend)
        good &= fine
        print(f"{name:4} {document['length_m']:9.2f} {exact:9.2f} {ratio:6.3f} {used['jobs']:4} {used['circuits']:8} "
              f"{used['charged_seconds']:6.1f} {used['estimated_seconds']:8.1f} {first['expectation']:9.1f} "
              f"{first['raw_expectation']:9.1f} {first['ideal_expectation']:9.1f} {took:5.0f}s"
              f"{'' if fine else '   NOT GOOD: ' + str(document['fallback'])}", flush=True)
    return good


def training(document):
    """Prints the loss curve of a training on the QPU; whether it converged."""
    first = document["legs"][0]["rounds"][0]
    loss, errors = first["loss"], first["qpu"]["loss_errors"]
    low, high = min(loss), max(loss)
    for step, (value, error) in enumerate(zip(loss, errors)):
        bar = "#" * round(50 * (value - low) / (high - low)) if high > low else ""
        print(f"{step:4} {value:9.2f} +- {error:5.2f}  {bar}")
    return loss[-1] < loss[0] - 3 * (errors[0] + errors[-1])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("--quavd", default=os.path.join(ROOT, "target/release/quavd"))
    add("--out", default="out", help="where plans and pictures go (default: out)")
    add("--backend", default="ibm_kyiv", help="the stand-in's QPU (default: ibm_kyiv)")
    add("--jobs", default="1", help="jobs of a leg (default: 1)")
    add("--circuits", default="2", help="circuits in a job (default: 2)")
    add("--clock-scale", default="60", help="how much faster than ours the stand-in's clock runs (default: 60)")
    arguments = parser.parse_args()
    os.makedirs(arguments.out, exist_ok=True)
    service = Service("--clock-scale", arguments.clock_scale)
    with tempfile.TemporaryDirectory() as state:
        def run(*more):
            return quavd(arguments.quavd, service, state, *more)

        def scenario(name):
            return os.path.join(ROOT, f"fence_examples/{name}.plan")

        def plan(name, *more):
            out = os.path.join(arguments.out, f"ibm_{name}")
            text = run("plan", scenario(name), "--engine", "ibm", "--backend", arguments.backend, "--no-fallback",
                       "--json", "--out", out + ".plan", "--out", out + ".svg", *more)
            return json.loads(text), out + ".plan"

        few = ("--qpu-jobs", arguments.jobs, "--qpu-circuits", arguments.circuits)
        print(f"20 qubits, 5 layers, 1024 shots on the stand-in's {arguments.backend}")
        good = scenarios(lambda name: plan(name, *few), lambda name, path: run("check", scenario(name), path, "--json"),
                         arguments.backend, MOST)
        print("\nS5 trained on the QPU: 8 qubits, 2 layers, 20 Adam steps of 9 circuits, 512 shots; loss in metres")
        document, _ = plan("s5", "--train", "qpu", "--qubits", "8", "--layers", "2", "--shots", "512",
                           "--qpu-jobs", "1", "--qpu-circuits", "1")
        with open(os.path.join(arguments.out, "ibm_training.json"), "w", encoding="utf-8") as file:
            json.dump(document, file, indent=1)
        converged = training(document)
        used = document["qpu"]
        print(f"{used['jobs']} jobs, {used['circuits']} circuits, {used['charged_seconds']:.0f} QPU seconds charged, "
              f"{used['estimated_seconds']:.0f} estimated; length {document['length_m']:.2f} m")
        good &= converged and document["collision_free"] and document["length_m"] <= MOST * EXACT["s5"]
    service.close()
    print("all clear and short; the training converged" if good else "NOT GOOD")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())

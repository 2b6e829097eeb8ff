"""PennyLane's side of benches/peers.rs: reads one task (JSON) from stdin, runs it, prints its time.

Without steps: <H> and its gradient, best of three. With steps: a whole training with PennyLane's own
Adam; the loss before each step and after the last, and the angles that it belongs to.
"""

import json
import sys
import time

import numpy
import pennylane as qml
from pennylane import numpy as pnp


def circuit(task, device):
    """The QAOA circuit as a function of the angles, with the quickest gradient that the device has.

    default.qubit's own adjoint wants the Hamiltonian as a dense matrix: 16 TiB at n = 20.
    """
    fields = [(i, h) for i, h in enumerate(task["h"]) if h != 0.0]
    bonds = [(i, j, value) for i, j, value in task["J"] if value != 0.0]
    terms = [qml.PauliZ(i) for i, _ in fields] + [qml.PauliZ(i) @ qml.PauliZ(j) for i, j, _ in bonds]
    hamiltonian = qml.Hamiltonian([h for _, h in fields] + [v for *_, v in bonds], terms)

    method = "backprop" if task["device"] == "default.qubit" else "adjoint"

    @qml.qnode(device, diff_method=method)
    def expectation(gammas, betas):
        for wire in range(len(task["h"])):
            qml.Hadamard(wire)
        for gamma, beta in zip(gammas, betas):
            for i, j, value in bonds:
                qml.IsingZZ(2 * gamma * value, wires=[i, j])
            for i, h in fields:
                qml.RZ(2 * gamma * h, wires=i)
            for wire in range(len(task["h"])):
                qml.RX(2 * beta, wires=wire)
        return qml.expval(hamiltonian)

    return expectation


def main():
    task = json.load(sys.stdin)
    options = {}
    if task["device"] == "lightning.qubit":
        options["c_dtype"] = numpy.complex64 if task["single"] else numpy.complex128
    device = qml.device(task["device"], wires=len(task["h"]), **options)
    expectation = circuit(task, device)
    gammas = pnp.array(task["gammas"], requires_grad=True)
    betas = pnp.array(task["betas"], requires_grad=True)
    versions = f"PennyLane {qml.version()}, lightning {lightning_version()}"

    if task["steps"] == 0:
        seconds, energies = [], []
        for _ in range(3):
            began = time.perf_counter()
            gradient = qml.grad(expectation)
            gradient(gammas, betas)
            seconds.append(time.perf_counter() - began)
            energies = [float(gradient.forward)]
        result = {"seconds": min(seconds), "energies": energies}
    else:
        adam = qml.AdamOptimizer(stepsize=0.1, beta2=0.999)
        losses, angles = [], [(gammas.tolist(), betas.tolist())]
        began = time.perf_counter()
        for _ in range(task["steps"]):
            (gammas, betas), loss = adam.step_and_cost(expectation, gammas, betas)
            losses.append(float(loss))
            angles.append((gammas.tolist(), betas.tolist()))
        losses.append(float(expectation(gammas, betas)))
        result = {"seconds": time.perf_counter() - began, "energies": losses, "angles": angles}
    json.dump(result | {"versions": versions}, sys.stdout)


def lightning_version():
    from importlib.metadata import version

    return version("pennylane-lightning")


main()

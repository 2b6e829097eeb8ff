"""Judges circuits that quavd wrote with qiskit: do they load, are they ISA, do they measure what they ought to?

Reads one JSON document from stdin and writes one to stdout. A case is
{"device": "kyiv", "qasm": text, "values": {name: number}, "probabilities": [2^n numbers]} or, with "h" and "j" in place
of "probabilities", one whose answer is the expectation of the chain's energy. A document with "figures" is answered
by figures: the circuit's counts beside those of qiskit's transpiler, and its line beside qiskit's and the best one.
"""

import json
import math
import sys

import numpy as np
from qiskit import QuantumCircuit, QuantumRegister, qasm3, transpile
from qiskit.circuit import Parameter
from qiskit.circuit.library import ECRGate, RXGate, RZZGate
from qiskit.quantum_info import Operator
from qiskit_aer import AerSimulator
from qiskit_ibm_runtime.fake_provider import FakeKingston, FakeKyiv, FakeNighthawk

DEVICES = {"kyiv": FakeKyiv, "kingston": FakeKingston, "nighthawk": FakeNighthawk}


def target_of(device):
    """The instruction set; the live Herons also list the fractional gates, which the recorded one leaves out."""
    backend = DEVICES[device]()
    target = backend.target
    if device == "kingston":
        target.add_instruction(RXGate(Parameter("t")), {(q,): None for q in range(target.num_qubits)}, name="rx")
        target.add_instruction(RZZGate(Parameter("t")), {pair: None for pair in target["cz"]}, name="rzz")
    return target


def violations(circuit, target):
    """What is not ISA, as text; IBM also refuses rzz angles outside [0, pi/2]."""
    found = []
    for instruction in circuit.data:
        operation = instruction.operation
        qubits = tuple(circuit.find_bit(q).index for q in instruction.qubits)
        if not target.instruction_supported(operation.name, qubits):
            found.append(f"{operation.name} on {qubits}")
        if operation.name == "rzz" and not 0 <= float(operation.params[0]) <= math.pi / 2:
            found.append(f"rzz({operation.params[0]})")
    return found


def compact(circuit):
    """The circuit on its qubits in use: qubit k is the one measured into bit k."""
    physical = [None] * circuit.num_clbits
    for instruction in circuit.data:
        if instruction.operation.name == "measure":
            bit = circuit.find_bit(instruction.clbits[0]).index
            physical[bit] = circuit.find_bit(instruction.qubits[0]).index
    place = {qubit: k for k, qubit in enumerate(physical)}
    small = QuantumCircuit(QuantumRegister(len(physical)))
    for instruction in circuit.data:
        operation = instruction.operation
        if operation.name != "measure":
            # What the program defines by itself is the library's gate of that name; `definitions` checks it.
            operation = {"ecr": ECRGate, "rzz": RZZGate}.get(operation.name, lambda *_: operation)(*operation.params)
            small.append(operation, [place[circuit.find_bit(q).index] for q in instruction.qubits])
    return small, physical


def definitions(circuit):
    """Whether `ecr` and `rzz` are defined as what their names say."""
    kinds = {"ecr": ECRGate, "rzz": RZZGate}
    checked = {i.operation.name: i.operation for i in circuit.data if i.operation.name in kinds}
    return all(Operator(op).equiv(Operator(kinds[name](*op.params))) for name, op in checked.items())


def judged(case):
    loaded = qasm3.loads(case["qasm"])
    names = sorted(parameter.name for parameter in loaded.parameters)
    values = case["values"]
    answer = {"parameters": names == sorted(values)}
    bound = loaded.assign_parameters([values[name] for name in names]) if names else loaded
    answer["violations"] = violations(bound, target_of(case["device"]))[:5]
    small, _ = compact(bound)
    answer["definitions"] = definitions(bound)
    small.save_statevector()
    simulator = AerSimulator(method="statevector", max_parallel_threads=1)
    measured = np.abs(np.asarray(simulator.run(small).result().get_statevector())) ** 2
    if "probabilities" in case:
        answer["tvd"] = float(np.abs(measured - np.array(case["probabilities"])).sum() / 2)
    else:
        index = np.arange(len(measured))
        z = [1.0 - 2.0 * (index >> qubit & 1) for qubit in range(len(case["h"]))]
        energy = sum(h * z[i] for i, h in enumerate(case["h"]))
        energy = energy + sum(j * z[i] * z[i + 1] for i, j in enumerate(case["j"]))
        answer["expectation"] = float(measured @ energy)
    return answer


def plain(h, j, gammas, betas):
    """The circuit as the formulation has it, even bonds before odd ones."""
    n = len(h)
    circuit = QuantumCircuit(n)
    circuit.h(range(n))
    for gamma, beta in zip(gammas, betas):
        for start in (0, 1):
            for i in range(start, n - 1, 2):
                circuit.rzz(2 * gamma * j[i], i, i + 1)
        for i in range(n):
            circuit.rz(2 * gamma * h[i], i)
            circuit.rx(2 * beta, i)
    circuit.measure_all()
    return circuit


def counts_of(circuit, entangler):
    ops = circuit.count_ops()
    return {"two_qubit_gates": ops.get(entangler, 0),
            "two_qubit_depth": circuit.depth(lambda instruction: len(instruction.qubits) == 2),
            "pulses": sum(ops.get(gate, 0) for gate in ("sx", "x", "rx")),
            "depth": circuit.depth(lambda instruction: instruction.operation.name not in ("measure", "barrier"))}


def log_success(circuit, target, qubits):
    total = 0.0
    for instruction in circuit.data:
        name = instruction.operation.name
        pair = tuple(circuit.find_bit(q).index for q in instruction.qubits)
        if name in ("sx", "x", "ecr", "cz"):
            total += math.log1p(-min(target[name][pair].error, 1 - 1e-12))
    return total + sum(math.log1p(-target["measure"][(q,)].error) for q in qubits)


def figures(case):
    """Only for devices whose bonds have one gate, such as ECR on kyiv."""
    target, entangler = target_of(case["device"]), case["entangler"]
    loaded = qasm3.loads(case["qasm"])
    small, line = compact(loaded)
    place = {qubit: k for k, qubit in enumerate(line)}
    bonds, pulses = [0] * (len(line) - 1), [0] * len(line)
    for instruction in loaded.data:
        sites = [place[loaded.find_bit(q).index] for q in instruction.qubits]
        if instruction.operation.name == entangler:
            bonds[min(sites)] += 1
        elif instruction.operation.name in ("sx", "x"):
            pulses[sites[0]] += 1

    def error(a, b):
        return min((target[entangler][pair].error for pair in ((a, b), (b, a)) if pair in target[entangler]), default=1)

    def score(path):
        """The product of errors of quavd's counts on another line."""
        total = 0.0
        for k, qubit in enumerate(path):
            total += pulses[k] * math.log1p(-target["sx"][(qubit,)].error)
            total += math.log1p(-target["measure"][(qubit,)].error)
            if k:
                rate = error(path[k - 1], qubit)
                total += bonds[k - 1] * (math.log1p(-rate) if rate < 1 else -math.inf)
        return total

    neighbours = {q: set() for q in range(target.num_qubits)}
    for a, b in target[entangler]:
        neighbours[a].add(b)
        neighbours[b].add(a)
    best, lines = -math.inf, 0
    stack = [[q] for q in neighbours]
    while stack:
        path = stack.pop()
        if len(path) == len(line):
            lines += 1
            best = max(best, score(path))
            continue
        stack.extend(path + [q] for q in neighbours[path[-1]] - set(path))
    answer = {"lines": lines // 2, "best": math.exp(best), "quavd": {
        **counts_of(loaded, entangler), "line": line, "on_line": math.exp(score(line)),
        "success": math.exp(log_success(loaded, target, line))}}
    for level in (1, 3):
        circuit = transpile(plain(case["h"], case["j"], case["gammas"], case["betas"]), backend=DEVICES[case["device"]](),
                            optimization_level=level, seed_transpiler=11)
        measured = compact(circuit)[1]
        answer[f"qiskit O{level}"] = {
            **counts_of(circuit, entangler), "line": measured,
            "on_line": math.exp(max(score(measured), score(measured[::-1]))),
            "success": math.exp(log_success(circuit, target, measured))}
    return answer


def main():
    document = json.load(sys.stdin)
    if "figures" in document:
        answer = figures(document["figures"])
    else:
        answer = [judged(case) for case in document["cases"]]
    json.dump(answer, sys.stdout)


if __name__ == "__main__":
    main()

"""Circuits as clients send them: OpenQASM 3 text or QPY; and the check against the QPU's instruction set."""

import functools
import itertools

import numpy
from qiskit import QuantumCircuit, qasm3

# Operations that are no gates of the target and are allowed nevertheless.
DIRECTIVES = {"barrier", "measure", "delay", "reset"}


class JobFailure(Exception):
    """The job ends as Failed, with the service's reason code."""

    def __init__(self, code, reason, solution=""):
        super().__init__(reason)
        self.code, self.reason, self.solution = code, reason, solution


@functools.lru_cache(maxsize=64)
def _parsed(text):
    try:
        return qasm3.loads(text)
    except Exception as error:  # Whatever the loader raises, the service says that it could not load it.
        raise JobFailure(1506, f"The QASM program could not be loaded: {str(error)[:300]}") from None


def loaded(circuit):
    """A `QuantumCircuit` from what a PUB holds."""
    if isinstance(circuit, QuantumCircuit):
        return circuit
    if isinstance(circuit, str):
        return _parsed(circuit)
    raise JobFailure(1506, "A PUB's circuit is neither OpenQASM 3 nor QPY.")


def checked(circuit, target):
    """Refuses what is not ISA: every gate in the target, on that very tuple of qubits."""
    if circuit.num_qubits > target.num_qubits:
        raise JobFailure(1517, f"The circuit has {circuit.num_qubits} qubits but the target has {target.num_qubits}.")
    for instruction in circuit.data:
        name = instruction.operation.name
        qubits = tuple(circuit.find_bit(qubit).index for qubit in instruction.qubits)
        if name in DIRECTIVES or target.instruction_supported(name, qubits):
            continue
        raise JobFailure(
            1517,
            f"The instruction {name} on qubits {qubits} is not supported by the target system.",
            "Transpile your circuits for the target before submitting a primitive query.")


def bound(circuit, values):
    """`(shape, circuits)`: the circuit with each point of the values put in, and the sweep's shape."""
    names = sorted(parameter.name for parameter in circuit.parameters)
    if values is None:
        values = []
    if isinstance(values, dict):
        values = {key if isinstance(key, str) else ",".join(key): value for key, value in values.items()}
        if sorted(values) != names:
            raise JobFailure(1521, f"The parameters {names} got values for {sorted(values)}.")
        columns = numpy.broadcast_arrays(*(numpy.asarray(values[name], dtype=float) for name in names)) if names else []
        points = numpy.stack(columns, axis=-1) if names else numpy.zeros((0,))
    else:
        points = numpy.asarray(values, dtype=float)
    if points.shape[-1:] != (len(names),) and not (points.size == 0 and not names):
        raise JobFailure(1521, f"{points.shape[-1:]} values for {len(names)} parameters.")
    if not names:
        return (), [circuit]
    shape = points.shape[:-1]
    circuits = []
    for index in itertools.product(*(range(n) for n in shape)):
        circuits.append(circuit.assign_parameters(dict(zip(names, points[index].tolist()))))
    return shape, circuits

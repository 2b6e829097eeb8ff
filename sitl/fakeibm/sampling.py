"""Running circuits. Only the qubits in use are simulated."""

import numpy
from qiskit import QuantumCircuit, QuantumRegister
from qiskit_aer import AerSimulator

from . import noisy


def compact(circuit):
    """`(circuit, physical)`: the same circuit on its qubits in use only, which are `physical` on the QPU."""
    used = sorted({circuit.find_bit(q).index for inst in circuit.data
                   if inst.operation.name != "barrier" for q in inst.qubits})
    place = {qubit: k for k, qubit in enumerate(used)}
    small = QuantumCircuit(QuantumRegister(len(used)), *circuit.cregs)
    for instruction in circuit.data:
        if instruction.operation.name != "barrier":
            qubits = [place[circuit.find_bit(q).index] for q in instruction.qubits]
            small.append(instruction.operation, qubits, instruction.clbits)
    return small, used


def without_noise(circuit, qpu, shots, seed):
    """An ideal QPU."""
    small, _ = compact(circuit)
    memory = AerSimulator(method="statevector", max_parallel_threads=1).run(
        small, shots=shots, memory=True, seed_simulator=seed).result().get_memory()
    bits = numpy.array([[bit == "1" for bit in reversed(shot.replace(" ", ""))] for shot in memory], dtype=bool)
    return registers(small, bits)


def with_noise(circuit, qpu, shots, seed):
    """The QPU with the errors that its snapshot has."""
    small, physical = compact(circuit)
    return registers(small, noisy.sample(small, physical, noisy.noise_of(qpu.backend), shots, seed))


def registers(circuit, bits):
    """`{register: (packed bytes, size)}` of bits (shots, clbits), clbit 0 first; the first byte is the most significant.

    Both simulators give the clbits of all registers in the order of the circuit.
    """
    packed = {}
    for register in circuit.cregs:
        places = [circuit.find_bit(clbit).index for clbit in register]
        rows = bits[:, list(reversed(places))].astype(numpy.uint8)
        rows = numpy.pad(rows, ((0, 0), (-len(places) % 8, 0)))
        packed[register.name] = (numpy.packbits(rows, axis=1), len(places))
    return packed


SAMPLERS = {"none": without_noise, "qpu": with_noise}

"""Running circuits. Only the qubits in use are simulated."""

import numpy
from qiskit import QuantumCircuit, QuantumRegister
from qiskit_aer import AerSimulator


def compact(circuit):
    """`(circuit, physical)`: the same circuit on its qubits in use only, which are `physical` on the QPU."""
    used = sorted({circuit.find_bit(q).index for inst in circuit.data
                   if inst.operation.name != "barrier" for q in inst.qubits})
    place = {qubit: k for k, qubit in enumerate(used)}
    small = QuantumCircuit(QuantumRegister(len(used)), *circuit.cregs)
    for instruction in circuit.data:
        qubits = [place[index] for q in instruction.qubits
                  if (index := circuit.find_bit(q).index) in place]
        if instruction.operation.name == "barrier":
            continue
        small.append(instruction.operation, qubits, instruction.clbits)
    return small, used


def ideal(circuit, qpu, shots, seed):
    """Shots without any noise: `{register: (shots, bytes) array, most significant byte first}`."""
    small, _ = compact(circuit)
    result = AerSimulator(method="statevector", max_parallel_threads=1).run(
        small, shots=shots, memory=True, seed_simulator=seed).result()
    return registers(small, result.get_memory())


def registers(circuit, memory):
    """The memory of qiskit (one text a shot, the last register first) as packed bytes for each register."""
    packed = {}
    for k, register in enumerate(reversed(circuit.cregs)):
        size = register.size
        rows = numpy.array([[int(bit) for bit in shot.split()[k]] for shot in memory], dtype=numpy.uint8)
        padding = -size % 8
        rows = numpy.pad(rows.reshape(len(memory), size), ((0, 0), (padding, 0)))
        packed[register.name] = (numpy.packbits(rows, axis=1), size)
    return packed


SAMPLERS = {"none": ideal}

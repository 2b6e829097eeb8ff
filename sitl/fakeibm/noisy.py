"""Shots of a noisy QPU, fast enough for 20 qubits and 175 two-qubit gates.

The noise is Aer's `NoiseModel.from_backend` (depolarisation to the calibrated gate error, thermal relaxation during
gates, readout errors), Pauli-twirled: each gate's channel keeps the probabilities of its Pauli errors and loses its
coherences. What that changes in small circuits is measured by `ibm/test_noisy.py`. Qubits that wait do not relax, as in Aer.

A Pauli error is carried to the end of the circuit: a Clifford gate turns it into another Pauli, and a rotation that it
does not commute with changes its sign. So a shot with errors is a shot of a circuit of the same shape with some signs
changed, and some bits flipped afterwards. Many such circuits are run at once as matrix product states. Gates in a row
on the same two qubits are multiplied first; as `RZZ` and a single entangling gate have Schmidt rank 2, a chain of p layers
needs bonds of 2^p and nothing is ever cut off: the simulation is exact.

Circuits that are not on a line, or too deep for it, are left to Aer with the same twirled noise: slow, but the same.
"""

import functools
import itertools

import numpy as np
from qiskit.circuit.library import ECRGate, RZZGate
from qiskit.quantum_info import Pauli, SuperOp
from qiskit_aer import AerSimulator
from qiskit_aer.noise import NoiseModel, depolarizing_error, pauli_error

WIDEST_BOND = 64
BATCH = 64
TINY = 1e-9

SX = np.array([[1, -1j], [-1j, 1]]) / np.sqrt(2)
X = np.array([[0, 1], [1, 0]], dtype=complex)
CZ = np.diag([1, 1, 1, -1]).astype(complex)
# Row and column index: 2 * (first qubit) + (second qubit). ECR = X_c exp(-i pi/4 Z_c X_t), control first.
ECR = np.kron(X, np.eye(2)) @ (np.eye(4) - 1j * np.kron(np.diag([1, -1]), X)) / np.sqrt(2)
ROTATIONS = ("rz", "rx", "rzz")


class NotALine(Exception):
    """The circuit does not suit the matrix product states used here."""


def compose(circuit):
    """`[(gate, qubits, angle or None)]` and `{clbit: qubit}` of a circuit whose angles are numbers."""
    gates, measured = [], {}
    for instruction in circuit.data:
        name = instruction.operation.name
        qubits = tuple(circuit.find_bit(q).index for q in instruction.qubits)
        if name == "measure":
            measured[circuit.find_bit(instruction.clbits[0]).index] = qubits[0]
        elif name in ("rz", "rx", "rzz"):
            gates.append((name, qubits, float(instruction.operation.params[0])))
        elif name in ("sx", "x", "cz", "ecr"):
            gates.append((name, qubits, None))
        elif name not in ("barrier", "delay", "id"):
            raise NotALine(f"{name} is not simulated here")
    return gates, measured


class Twirled:
    """The Pauli-twirled noise of a backend."""

    def __init__(self, backend):
        self.model = NoiseModel.from_backend(backend)
        self.errors = dict(self.model._local_quantum_errors)
        self.readouts = self.model._local_readout_errors
        # The recorded Herons leave their fractional gates out of the target, not out of the properties: depolarisation
        # to the calibrated error (an average infidelity), without relaxation.
        for gate in backend.properties().gates:
            if gate.gate in ("rx", "rzz") and gate.gate not in self.model.noise_instructions:
                error = next((p.value for p in gate.parameters if p.name == "gate_error"), 1.0)
                size = 2 ** len(gate.qubits)
                full = min(error * size / (size - 1), 1.0)
                table = self.errors.setdefault(gate.gate, {})
                table[tuple(gate.qubits)] = depolarizing_error(full, len(gate.qubits))

    @functools.lru_cache(maxsize=4096)
    def paulis(self, gate, physical):
        """`[(label, probability)]`, labels as qiskit writes them (the last letter is the first qubit), or nothing."""
        error = self.errors.get(gate, {}).get(physical)
        if error is None:
            return ()
        labels = ["".join(letters) for letters in itertools.product("IXYZ", repeat=len(physical))]
        return tuple(zip(labels, twirl(SuperOp(error).data, labels)))

    def readout(self, physical):
        """`(P(1|0), P(0|1))`."""
        error = self.readouts.get((physical,))
        if error is None:
            return 0.0, 0.0
        table = np.asarray(error.probabilities)
        return float(table[0, 1]), float(table[1, 0])

    def aer(self, physical, twirled=True):
        """The noise of these qubits as a model for Aer, where they are numbered from 0."""
        place = {qubit: k for k, qubit in enumerate(physical)}
        model = NoiseModel(basis_gates=self.model.basis_gates)
        for gate, errors in self.errors.items():
            for pair, error in errors.items():
                if gate not in ("reset", "measure") and all(qubit in place for qubit in pair):
                    known = pauli_error(list(self.paulis(gate, pair))) if twirled else error
                    model.add_quantum_error(known, gate, [place[qubit] for qubit in pair])
        for (qubit,), error in self.readouts.items():
            if qubit in place:
                model.add_readout_error(error, [place[qubit]])
        return model


def twirl(superop, labels):
    """Probabilities of Pauli errors: the twirled channel's Pauli transfer matrix is the diagonal of the channel's."""
    matrices = [Pauli(label).to_matrix() for label in labels]
    size = matrices[0].shape[0]
    vectors = np.array([m.reshape(-1, order="F") for m in matrices])
    fidelities = np.real(np.einsum("ki,ij,kj->k", vectors.conj(), superop, vectors)) / size
    commute = np.array([[1.0 if np.allclose(a @ b, b @ a) else -1.0 for b in matrices] for a in matrices])
    chances = np.clip(commute @ fidelities / len(labels), 0.0, None)
    return chances / chances.sum()


def errors_of_shots(gates, physical, noise, shots, rng):
    """`(signs, flips)`: which rotations are reversed and which qubits' bits are flipped in each shot.

    `signs` is (shots, rotations) with True for a reversed one, `flips` is (shots, qubits).
    """
    x = np.zeros((len(physical), shots), dtype=bool)
    z = np.zeros_like(x)
    signs = []
    for gate, qubits, angle in gates:
        a, b = qubits[0], qubits[-1]
        if gate in ROTATIONS:
            against = z[a] if gate == "rx" else x[a] if gate == "rz" else x[a] ^ x[b]
            quarter = angle / (np.pi / 2)
            if gate == "rz" and abs(quarter - round(quarter)) < TINY:
                # A Clifford gate: the Pauli changes, the gate stays.
                if round(quarter) % 2:
                    z[a] ^= x[a]
                signs.append(np.zeros(shots, dtype=bool))
            else:
                signs.append(against.copy())
        elif gate == "sx":
            x[a] ^= z[a]
        elif gate == "cz":
            z[a] ^= x[b]
            z[b] ^= x[a]
        elif gate == "ecr":
            moved = x[a] ^ z[b]
            z[a] ^= moved
            x[b] ^= moved
        terms = noise.paulis(gate, tuple(physical[q] for q in qubits)) if gate != "rz" else ()
        if terms:
            drawn = rng.choice(len(terms), size=shots, p=[chance for _, chance in terms])
            for place, qubit in enumerate(qubits):
                letters = np.array([label[-1 - place] for label, _ in terms])[drawn]
                x[qubit] ^= (letters == "X") | (letters == "Y")
                z[qubit] ^= (letters == "Z") | (letters == "Y")
    return np.array(signs, dtype=bool).reshape(len(signs), shots).T, x.T


def line_of(gates, qubits):
    """The qubits in an order in which every two-qubit gate is between neighbours."""
    neighbours = {q: set() for q in range(qubits)}
    for _, pair, _ in gates:
        if len(pair) == 2:
            neighbours[pair[0]].add(pair[1])
            neighbours[pair[1]].add(pair[0])
    order, seen = [], set()
    for start in sorted(neighbours, key=lambda q: (len(neighbours[q]), q)):
        at = start
        while at is not None and at not in seen:
            if len(neighbours[at]) > 2:
                raise NotALine("a qubit has more than two neighbours")
            order.append(at)
            seen.add(at)
            at = min(neighbours[at] - seen, default=None)
    place = {q: k for k, q in enumerate(order)}
    if any(abs(place[pair[0]] - place[pair[1]]) != 1 for _, pair, _ in gates if len(pair) == 2):
        raise NotALine("the qubits form a ring")
    return order


def matrix_of(gate, angle, reversed_):
    """The gate for each circuit of a batch: (batch or 1, d, d)."""
    if gate not in ROTATIONS:
        return {"sx": SX, "x": X, "cz": CZ, "ecr": ECR}[gate][None]
    half = np.where(reversed_, -angle, angle) / 2
    if gate == "rx":
        c, s = np.cos(half), -1j * np.sin(half)
        return np.stack([np.stack([c, s], -1), np.stack([s, c], -1)], -2)
    signs = np.array([1, -1]) if gate == "rz" else np.array([1, -1, -1, 1])
    return np.exp(-1j * half[:, None] * signs)[:, :, None] * np.eye(len(signs))


def states(gates, order, signs):
    """Matrix product states, one for each row of `signs`: a list of (batch, left, 2, right) along the line."""
    place = {q: k for k, q in enumerate(order)}
    batch, n = len(signs), len(order)
    zero = np.zeros((batch, 1, 2, 1), dtype=np.complex128)
    zero[:, 0, 0, 0] = 1
    sites = [zero.copy() for _ in range(n)]
    single = [np.eye(2, dtype=complex)[None] for _ in range(n)]
    block = [None] * n  # Left end -> open two-qubit matrix.

    def close(left):
        matrix, block[left] = block[left], None
        # Operator Schmidt decomposition: rows (left out, left in), columns (right out, right in).
        table = matrix.reshape(-1, 2, 2, 2, 2).transpose(0, 1, 3, 2, 4).reshape(-1, 4, 4)
        u, weight, v = np.linalg.svd(table)
        rank = max(1, int((weight > TINY).sum(axis=1).max()))
        root = np.sqrt(weight[:, None, :rank])
        a = (u[:, :, :rank] * root).reshape(-1, 2, 2, rank)
        b = (v[:, :rank, :] * root.transpose(0, 2, 1)).reshape(-1, rank, 2, 2)
        if sites[left].shape[3] * rank > WIDEST_BOND:
            raise NotALine("the circuit is too deep")
        grown = np.einsum("zoik,zlir->zlork", a, sites[left], optimize=True)
        sites[left] = grown.reshape(batch, grown.shape[1], 2, -1)
        grown = np.einsum("zkoi,zlir->zlkor", b, sites[left + 1], optimize=True)
        sites[left + 1] = grown.reshape(batch, -1, 2, grown.shape[4])

    def settle(site):
        """Puts everything that is open on a site into the state."""
        for left in (site - 1, site):
            if 0 <= left < n and block[left] is not None:
                close(left)
        sites[site] = np.einsum("zoi,zlir->zlor", np.broadcast_to(single[site], (batch, 2, 2)), sites[site])
        single[site] = np.eye(2, dtype=complex)[None]

    rotation = 0
    for gate, qubits, angle in gates:
        reversed_ = None
        if gate in ROTATIONS:
            reversed_ = signs[:, rotation]
            rotation += 1
        matrix = matrix_of(gate, angle, reversed_)
        if len(qubits) == 1:
            site = place[qubits[0]]
            single[site] = matrix @ single[site]
            continue
        first, second = (place[q] for q in qubits)
        left = min(first, second)
        if first > second:
            matrix = matrix.reshape(-1, 2, 2, 2, 2).transpose(0, 2, 1, 4, 3).reshape(-1, 4, 4)
        if block[left] is None:
            settle(left)
            settle(left + 1)
            block[left] = matrix
            continue
        between = np.einsum("zab,zcd->zacbd", *np.broadcast_arrays(single[left], single[left + 1])).reshape(-1, 4, 4)
        single[left] = single[left + 1] = np.eye(2, dtype=complex)[None]
        block[left] = matrix @ (between @ block[left])
    for site in range(n):
        settle(site)
    return [site.astype(np.complex64) for site in sites]


def draw(sites, row_of_shot, rng):
    """One measurement of all qubits per entry of `row_of_shot` (which state): (shots, sites) bits."""
    n = len(sites)
    right = [None] * n
    environment = np.ones((len(sites[0]), 1, 1), dtype=np.complex64)
    for k in range(n - 1, -1, -1):
        right[k] = environment
        if k:
            tensors = sites[k]
            environment = sum(
                (tensors[:, :, s, :] @ environment) @ tensors[:, :, s, :].conj().transpose(0, 2, 1) for s in (0, 1))
    bits = np.zeros((len(row_of_shot), n), dtype=bool)
    for begin in range(0, len(row_of_shot), 256):
        rows = row_of_shot[begin:begin + 256]
        vector = np.ones((len(rows), 1, 1), dtype=np.complex64)
        for k in range(n):
            after = [vector @ sites[k][rows, :, s, :] for s in (0, 1)]
            weight = [np.einsum("sxi,sij,sxj->s", v, right[k][rows], v.conj()).real.clip(0) for v in after]
            total = weight[0] + weight[1]
            one = rng.random(len(rows)) * total >= weight[0]
            bits[begin:begin + 256, k] = one
            chosen = np.where(one[:, None, None], after[1], after[0])
            vector = chosen / np.linalg.norm(chosen, axis=(1, 2), keepdims=True)
    return bits


@functools.lru_cache(maxsize=4)
def noise_of(backend):
    """The noise of a backend; making it takes seconds."""
    return Twirled(backend)


def sample(circuit, physical, noise, shots, seed):
    """Bits that are read, (shots, clbits) with clbit 0 first; `physical[q]` is qubit q of the circuit on the QPU."""
    try:
        return on_a_line(circuit, physical, noise, shots, seed)
    except NotALine:
        return with_aer(circuit, physical, noise, shots, seed)


def with_aer(circuit, physical, noise, shots, seed, twirled=True):
    """The same by Aer."""
    known = {"ecr": ECRGate, "rzz": RZZGate}
    native = circuit.copy_empty_like()
    for instruction in circuit.data:
        operation = instruction.operation
        operation = known.get(operation.name, lambda *_: operation)(*operation.params)
        native.append(operation, instruction.qubits, instruction.clbits)
    simulator = AerSimulator(noise_model=noise.aer(physical, twirled), max_parallel_threads=1)
    memory = simulator.run(native, shots=shots, memory=True, seed_simulator=seed).result().get_memory()
    return np.array([[bit == "1" for bit in reversed(shot.replace(" ", ""))] for shot in memory], dtype=bool)


def on_a_line(circuit, physical, noise, shots, seed):
    """The same by matrix product states."""
    rng = np.random.default_rng(seed)
    gates, measured = compose(circuit)
    order = line_of(gates, circuit.num_qubits)
    signs, flips = errors_of_shots(gates, physical, noise, shots, rng)
    patterns, pattern_of_shot = np.unique(signs, axis=0, return_inverse=True)
    pattern_of_shot = pattern_of_shot.reshape(-1)
    bits = np.zeros((shots, circuit.num_qubits), dtype=bool)
    for begin in range(0, len(patterns), BATCH):
        of_batch = np.flatnonzero((pattern_of_shot >= begin) & (pattern_of_shot < begin + BATCH))
        tensors = states(gates, order, patterns[begin:begin + BATCH])
        drawn = draw(tensors, pattern_of_shot[of_batch] - begin, rng)
        bits[of_batch[:, None], np.array(order)] = drawn
    bits ^= flips
    read = np.zeros((shots, circuit.num_clbits), dtype=bool)
    for clbit, qubit in measured.items():
        up, down = noise.readout(physical[qubit])
        chance = np.where(bits[:, qubit], down, up)
        read[:, clbit] = bits[:, qubit] ^ (rng.random(shots) < chance)
    return read

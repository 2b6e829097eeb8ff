"""The noisy simulator against Aer, with the same twirled noise and with the full model. Seeds are fixed."""

import os
import sys
import unittest

import numpy as np
from qiskit import QuantumCircuit, transpile
from qiskit_aer import AerSimulator
from qiskit_ibm_runtime.fake_provider import FakeKingston, FakeKyiv

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from fakeibm import noisy  # noqa: E402
from fakeibm.sampling import compact  # noqa: E402

H = [0.31, -0.22, 0.13, 0.44, -0.35, 0.26, 0.17, -0.28, 0.09, 0.1, -0.21, 0.32]
J = [0.5, -0.41, 0.32, 0.23, -0.64, 0.15, 0.36, -0.27, 0.48, 0.19, -0.3]
LINE = [43, 42, 41, 53, 60, 59, 58, 71, 77, 76, 75, 90]
HERON = [109, 110, 111, 98, 91, 90, 89, 78, 69, 68, 67, 66]


class Quiet:
    """No noise."""

    def paulis(self, gate, physical):
        return ()

    def readout(self, physical):
        return 0.0, 0.0


def chain(qubits, layers):
    circuit = QuantumCircuit(qubits, qubits)
    circuit.h(range(qubits))
    for layer in range(layers):
        gamma, beta = 0.75 * (layer + 0.5) / layers, -0.75 * (1 - (layer + 0.5) / layers)
        for start in (0, 1):
            for i in range(start, qubits - 1, 2):
                circuit.rzz(2 * gamma * J[i], i, i + 1)
        for i in range(qubits):
            circuit.rz(2 * gamma * H[i], i)
            circuit.rx(2 * beta, i)
    circuit.measure(range(qubits), range(qubits))
    return circuit


def lowered(backend, line, qubits, layers):
    """`(circuit, physical)` in the backend's gates."""
    native = transpile(chain(qubits, layers), backend=backend, initial_layout=line[:qubits],
                       optimization_level=1, seed_transpiler=1)
    return compact(native)


def histogram(bits):
    qubits = bits.shape[1]
    return np.bincount(bits @ (1 << np.arange(qubits)), minlength=1 << qubits)


def two_samples(a, b):
    """Pearson's chi-square of two samples of equal size, and its degrees of freedom."""
    seen = a + b >= 10
    return ((a - b)[seen] ** 2 / (a + b)[seen]).sum(), seen.sum() - 1


class Noisy(unittest.TestCase):
    SHOTS = 40_000

    def test_it_draws_from_the_distribution_aer_has_for_the_same_noise(self):
        for backend, line in ((FakeKyiv(), LINE), (FakeKingston(), HERON)):
            circuit, physical = lowered(backend, line, 6, 2)
            noise = noisy.noise_of(backend)
            mine = histogram(noisy.on_a_line(circuit, physical, noise, self.SHOTS, 1))
            aer = histogram(noisy.with_aer(circuit, physical, noise, self.SHOTS, 2))
            statistic, freedom = two_samples(mine, aer)
            self.assertLess(statistic, freedom + 5 * np.sqrt(2 * freedom))
            if line is LINE:  # Without its noise the same test fails.
                quiet = histogram(noisy.on_a_line(circuit, physical, Quiet(), self.SHOTS, 1))
                statistic, freedom = two_samples(quiet, aer)
                self.assertGreater(statistic, freedom + 5 * np.sqrt(2 * freedom))

    def test_twirling_changes_little(self):
        backend = FakeKyiv()
        circuit, physical = lowered(backend, LINE, 6, 2)
        noise = noisy.noise_of(backend)
        mine = histogram(noisy.on_a_line(circuit, physical, noise, self.SHOTS, 1))
        full = histogram(noisy.with_aer(circuit, physical, noise, self.SHOTS, 2, twirled=False))
        # Two samples of this size from one distribution over 64 outcomes are 0.016 apart on average.
        self.assertLess(np.abs(mine - full).sum() / 2 / self.SHOTS, 0.025)

    def test_a_longer_chain_has_the_energy_of_the_exact_state(self):
        circuit, physical = lowered(FakeKyiv(), LINE, 12, 3)
        shots = noisy.on_a_line(circuit, physical, Quiet(), 4000, 3)
        z = 1.0 - 2.0 * shots
        energy = z @ np.array(H) + (z[:, :-1] * z[:, 1:]) @ np.array(J)
        ideal = chain(12, 3).remove_final_measurements(inplace=False)
        ideal.save_statevector()
        state = np.asarray(AerSimulator(method="statevector").run(ideal).result().get_statevector())
        index = np.arange(1 << 12)
        signs = 1.0 - 2.0 * (index[:, None] >> np.arange(12) & 1)
        exact = np.abs(state) ** 2 @ (signs @ np.array(H) + (signs[:, :-1] * signs[:, 1:]) @ np.array(J))
        self.assertLess(abs(energy.mean() - exact), 5 * energy.std() / np.sqrt(len(energy)))

    def test_fractional_gates_have_their_calibrated_errors(self):
        noise = noisy.noise_of(FakeKingston())
        recorded = FakeKingston().properties()
        pair = tuple(HERON[:2])
        chances = dict(noise.paulis("rzz", pair))
        # An average infidelity e of two qubits is a Pauli error with probability 5/4 e.
        self.assertAlmostEqual(1 - chances["II"], 1.25 * recorded.gate_error("rzz", list(pair)), places=9)
        chances = dict(noise.paulis("rx", pair[:1]))
        self.assertAlmostEqual(1 - chances["I"], 1.5 * recorded.gate_error("rx", [pair[0]]), places=9)
        circuit = QuantumCircuit(4, 4)
        circuit.rx(0.7, range(4))
        for i in range(3):
            circuit.rzz(0.9, i, i + 1)
            circuit.rx(-1.1, i)
        circuit.measure(range(4), range(4))
        mine = histogram(noisy.on_a_line(circuit, HERON[:4], noise, self.SHOTS, 4))
        aer = histogram(noisy.with_aer(circuit, HERON[:4], noise, self.SHOTS, 5))
        statistic, freedom = two_samples(mine, aer)
        self.assertLess(statistic, freedom + 5 * np.sqrt(2 * freedom))

    def test_what_is_no_line_is_left_to_aer(self):
        ring = QuantumCircuit(3, 3)
        ring.x(0)
        for pair in ((0, 1), (1, 2), (2, 0)):
            ring.ecr(*pair)
            ring.ecr(*pair)
        ring.measure(range(3), range(3))
        with self.assertRaises(noisy.NotALine):
            noisy.on_a_line(ring, [0, 1, 2], Quiet(), 10, 1)
        read = noisy.sample(ring, [43, 42, 41], noisy.noise_of(FakeKyiv()), 2000, 1)
        self.assertGreater((read == [True, False, False]).all(axis=1).mean(), 0.8)

    def test_a_seed_fixes_the_shots(self):
        backend = FakeKyiv()
        circuit, physical = lowered(backend, LINE, 5, 1)
        noise = noisy.noise_of(backend)
        first, again, other = (noisy.sample(circuit, physical, noise, 200, seed) for seed in (7, 7, 8))
        self.assertTrue((first == again).all())
        self.assertFalse((first == other).all())


if __name__ == "__main__":
    unittest.main()

"""The QPUs: configuration and properties as recorded by qiskit-ibm-runtime's fake backends."""

import functools
import importlib
import json
import os

from qiskit.circuit import Parameter
from qiskit.circuit.library import RXGate, RZZGate

# Name of the QPU -> fake backend, processor as `GET /backends` has it, queue length.
KNOWN = {
    "ibm_kyiv": ("FakeKyiv", {"family": "Eagle", "revision": "3"}, 3),
    "ibm_fez": ("FakeFez", {"family": "Heron", "revision": "2"}, 121),
    "ibm_kingston": ("FakeKingston", {"family": "Heron", "revision": "2"}, 52),
    "ibm_marrakesh": ("FakeMarrakesh", {"family": "Heron", "revision": "2"}, 14),
}

# QPUs that also offer the fractional gates of the live Herons. The fake backends leave them out of the configuration and
# the target, though their properties have the calibration.
FRACTIONAL = {"ibm_kingston"}


class Qpu:
    """One QPU with its documents; the qiskit objects are made when they are needed."""

    def __init__(self, name):
        fake, self.processor, self.queue_length = KNOWN[name]
        self.name = name
        provider = importlib.import_module("qiskit_ibm_runtime.fake_provider")
        self.backend = getattr(provider, fake)()
        self.status = "online"
        directory = self.backend.dirname

        def document(filename):
            with open(os.path.join(directory, filename), encoding="utf-8") as file:
                return json.load(file)

        self.configuration = document(self.backend.conf_filename)
        self.properties = document(self.backend.props_filename)
        for recorded in (self.configuration, self.properties):
            recorded["backend_name"] = name
        if name in FRACTIONAL:
            self.configuration["basis_gates"] += ["rx", "rzz"]
            self.configuration["gates"] += [
                {"name": gate, "parameters": ["theta"], "qasm_def": "", "coupling_map": qubits}
                for gate, qubits in (("rx", [[q] for q in range(self.qubits)]), ("rzz", self.configuration["coupling_map"]))]

    @functools.cached_property
    def target(self):
        target = self.backend.target
        if self.name in FRACTIONAL:
            ones = {(q,): None for q in range(self.qubits)}
            target.add_instruction(RXGate(Parameter("theta")), ones, name="rx")
            target.add_instruction(RZZGate(Parameter("theta")), {pair: None for pair in target["cz"]}, name="rzz")
        return target

    @property
    def version(self):
        return self.configuration["backend_version"]

    @property
    def qubits(self):
        return self.configuration["n_qubits"]

    def device(self):
        """The entry of `GET /backends`."""
        return {
            "name": self.name,
            "status": {"name": self.status, "reason": "available" if self.status == "online" else self.status},
            "is_simulator": False,
            "qubits": self.qubits,
            "physical_qubits": self.qubits,
            "clops": {"type": "hardware_aware", "value": 30000},
            "processor_type": self.processor,
            "queue_length": self.queue_length,
            "performance_metrics": {"two_q_error_best": {"value": 0.0031}, "two_q_error_layered": {"value": 0.018}},
        }

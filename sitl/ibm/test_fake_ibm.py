"""The stand-in is judged by IBM's own client, and by what is known of the real service's refusals."""

import json
import os
import unittest
import urllib.error

from service import KEY, Service

ASYMMETRIC = """OPENQASM 3.0;
include "stdgates.inc";
input float[64] b00;
bit[3] c;
sx $1; rz(2*b00 + pi) $1; sx $1;
x $2;
c[0] = measure $1;
c[1] = measure $2;
c[2] = measure $3;
"""


class Case(unittest.TestCase):
    arguments = ()

    @classmethod
    def setUpClass(cls):
        cls.service = Service("--noise", "none", "--clock-scale", "600", *cls.arguments)

    @classmethod
    def tearDownClass(cls):
        cls.service.close()

    def setUp(self):
        self.service.control("clear")


class IbmsOwnClient(Case):
    """qiskit-ibm-runtime, not told that this is not IBM."""

    def test_it_signs_in_lists_backends_runs_a_sampler_job_and_decodes_it(self):
        os.environ.update(IAM_URL=self.service.ready["iam"], QISKIT_FUNCTIONS_EXPERIMENTAL="1")
        from qiskit import QuantumCircuit, transpile
        from qiskit_ibm_runtime import QiskitRuntimeService, SamplerV2
        service = QiskitRuntimeService(token=KEY, instance=self.service.crn,
                                       url_resolver=lambda *_: self.service.api)
        self.assertIn("ibm_kyiv", [backend.name for backend in service.backends()])
        backend = service.backend("ibm_kyiv")
        self.assertEqual(backend.num_qubits, 127)
        circuit = QuantumCircuit(3, 3)
        circuit.x(0)
        circuit.cx(0, 1)
        circuit.measure([0, 1, 2], [0, 1, 2])
        isa = transpile(circuit, backend, initial_layout=[4, 3, 2], optimization_level=1)
        job = SamplerV2(mode=backend).run([isa], shots=64)
        self.assertEqual(job.result()[0].data.c.get_counts(), {"011": 64})
        self.assertGreater(job.metrics()["usage"]["qpu_charge_time_seconds"], 0)


class PlainJobs(Case):
    def test_samples_are_hexadecimal_with_c0_as_the_least_significant_bit(self):
        job = self.service.run(ASYMMETRIC, {"b00": 3.141592653589793 / 2}, shots=8)
        self.assertEqual(job["state"]["status"], "Completed", job)
        _, result, _ = self.service.ask("GET", f"/jobs/{job['id']}/results")
        # sx rz(2π) sx is x: qubits 1 and 2 are one, qubit 3 zero.
        self.assertEqual(result["results"][0]["data"]["c"], {"samples": ["0x3"] * 8, "num_bits": 3})

    def test_a_circuit_that_is_not_isa_is_accepted_and_then_fails_with_1517(self):
        head = 'OPENQASM 3.0;\ninclude "stdgates.inc";\ngate ecr a, b { s a; sx b; cx a, b; x a; }\nbit[1] c;\n'
        for bad in ("h $0;", "ecr $1, $0;", "id $0;", "cz $0, $1;"):
            job = self.service.run(f"{head}{bad}\nc[0] = measure $0;\n")
            self.assertEqual((job["state"]["status"], job["state"].get("reason_code")), ("Failed", 1517), bad)
        self.assertEqual(self.service.ask("GET", f"/jobs/{job['id']}/results")[0], 204)
        # The other direction of the same coupler is one that the QPU has.
        self.assertEqual(self.service.run(f"{head}ecr $0, $1;\nc[0] = measure $0;\n")["state"]["status"], "Completed")

    def test_what_is_no_qasm_fails_when_it_is_loaded(self):
        self.assertEqual(self.service.run("OPENQASM 3.0; nonsense;")["state"]["reason_code"], 1506)

    def test_a_heron_takes_cz_in_both_directions(self):
        text = 'OPENQASM 3.0;\ninclude "stdgates.inc";\nbit[1] c;\ncz $0, $1;\ncz $1, $0;\nc[0] = measure $1;\n'
        self.assertEqual(self.service.run(text, backend="ibm_fez")["state"]["status"], "Completed")


class Refusals(Case):
    def test_a_wrong_key_is_400_and_a_wrong_token_401(self):
        with self.assertRaises(urllib.error.HTTPError) as caught:
            self.service.sign_in("wrong")
        with caught.exception as error:
            self.assertEqual((error.code, json.load(error)["errorCode"]), (400, "BXNIM0415E"))
        status, body, _ = self.service.ask("GET", "/backends", Authorization="Bearer no")
        self.assertEqual((status, body["errors"][0]["code"]), (401, 1219))

    def test_a_wrong_crn_is_404_1279_and_its_message_repeats_it(self):
        status, body, _ = self.service.ask("GET", "/backends", **{"Service-CRN": "crn:wrong"})
        self.assertEqual((status, body["errors"][0]["code"]), (404, 1279))
        self.assertIn("crn:wrong", body["errors"][0]["message"])

    def test_without_a_version_the_oldest_schema_is_answered(self):
        _, body, _ = self.service.ask("GET", "/backends", **{"IBM-API-Version": ""})
        self.assertIsInstance(body["devices"][0], str)

    def test_results_that_are_not_ready_are_400_1234_and_a_second_cancel_is_409(self):
        self.service.control("fault", spec="queue:seconds=1e6")
        body = {"program_id": "sampler", "backend": "ibm_kyiv", "params": {"pubs": [[ASYMMETRIC, [0.5], 10]]}}
        _, made, _ = self.service.ask("POST", "/jobs", body)
        status, answer, _ = self.service.ask("GET", f"/jobs/{made['id']}/results")
        self.assertEqual((status, answer["errors"][0]["code"]), (400, 1234))
        self.assertEqual(self.service.ask("POST", f"/jobs/{made['id']}/cancel")[0], 204)
        self.assertEqual(self.service.ask("POST", f"/jobs/{made['id']}/cancel")[0], 409)

    def test_jobs_are_found_by_tag(self):
        job = self.service.run(ASYMMETRIC, {"b00": 0.1})
        _, listed, _ = self.service.ask("GET", "/jobs?tags=t&limit=200")
        self.assertIn(job["id"], [each["id"] for each in listed["jobs"]])
        _, listed, _ = self.service.ask("GET", "/jobs?tags=other")
        self.assertEqual(listed["jobs"], [])

    def test_a_used_up_instance_is_409(self):
        self.service.control("usage", consumed=600)
        body = {"program_id": "sampler", "backend": "ibm_kyiv", "params": {"pubs": [[ASYMMETRIC, [0.5], 10]]}}
        self.assertEqual(self.service.ask("POST", "/jobs", body)[0], 409)
        self.service.control("usage", consumed=0)


class SubmissionLimit(Case):
    arguments = ("--clock-scale", "30")

    def test_the_sixth_submission_in_a_minute_is_429_with_retry_after(self):
        body = {"program_id": "sampler", "backend": "ibm_kyiv", "params": {"pubs": [[ASYMMETRIC, [0.5], 10]]}}
        statuses = [self.service.ask("POST", "/jobs", body) for _ in range(6)]
        self.assertEqual([status for status, _, _ in statuses], [200] * 5 + [429])
        self.assertGreaterEqual(int(statuses[5][2]["Retry-After"]), 1)


if __name__ == "__main__":
    unittest.main()

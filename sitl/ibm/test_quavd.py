"""quavd against the stand-in: every fault ends in its error or in a visible fallback, nothing is paid twice, and the
key is nowhere to be seen."""

import json
import os
import signal
import subprocess
import tempfile
import time
import unittest

from service import KEY, SITL, Service

ROOT = os.path.dirname(SITL)
QUAVD = os.environ.get("QUAVD", os.path.join(ROOT, "target/release/quavd"))
S5, EXACT_S5 = os.path.join(ROOT, "fence_examples/s5.plan"), 354.07

# As small as a leg can be: the service is what is tested.
SMALL = ("--qubits", "4", "--layers", "1", "--steps", "5", "--shots", "64", "--qpu-jobs", "1", "--qpu-circuits", "2")


class Quavd:
    """quavd with an account at a stand-in and a state directory of its own."""

    def __init__(self, service, key=KEY, crn=None):
        self.state = tempfile.TemporaryDirectory()
        self.environment = os.environ | {
            "QUAV_IBM_API_KEY": key, "QUAV_IBM_CRN": crn or service.crn, "QUAV_IBM_API_URL": service.api,
            "QUAV_IBM_IAM_URL": service.ready["iam"], "STATE_DIRECTORY": self.state.name}
        self.environment.pop("RUST_LOG", None)

    def start(self, *arguments):
        return subprocess.Popen([QUAVD, *arguments], env=self.environment, stdin=subprocess.DEVNULL,
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def run(self, *arguments):
        process = self.start(*arguments)
        stdout, stderr = process.communicate(timeout=300)
        return process.returncode, stdout, stderr

    def plan(self, *arguments, backend="ibm_kyiv"):
        return self.run("plan", S5, "--engine", "ibm", "--backend", backend, "--json", *SMALL, *arguments)

    def files(self):
        """Everything in the state directory, names and contents."""
        text = []
        for directory, _, names in os.walk(self.state.name):
            for name in names:
                with open(os.path.join(directory, name), encoding="utf-8", errors="replace") as file:
                    text.append(name + file.read())
        return "\n".join(text)


class Case(unittest.TestCase):
    arguments = ("--noise", "none", "--clock-scale", "600")

    @classmethod
    def setUpClass(cls):
        cls.service = Service(*cls.arguments)

    @classmethod
    def tearDownClass(cls):
        cls.service.close()

    def setUp(self):
        self.service.control("clear")
        self.service.control("usage", consumed=0)
        self.jobs_before = len(self.jobs())

    def quavd(self, *account):
        quavd = Quavd(self.service, *account)
        self.addCleanup(quavd.state.cleanup)
        return quavd

    def jobs(self):
        return self.service.control("log")["jobs"]

    def new_jobs(self):
        return self.jobs()[self.jobs_before:]

    def succeeds(self, outcome):
        code, stdout, stderr = outcome
        self.assertEqual(code, 0, stderr)
        return json.loads(stdout)

    def planned_on_the_qpu(self, outcome):
        document = self.succeeds(outcome)
        self.assertIsNone(document["fallback"])
        engines = {r["engine"] for leg in document["legs"] for r in leg["rounds"]}
        self.assertEqual(engines, {"ibm"})
        return document

    def wait_for_job(self):
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline:
            if self.new_jobs():
                return
            time.sleep(0.05)
        self.fail("no job was submitted")


class Errors(Case):
    """What cannot be mended is an error that says what to do (exit code 6), or the visible fallback."""

    def refused(self, said, key=KEY, crn=None):
        quavd = self.quavd(key, crn)
        code, _, stderr = quavd.plan("--no-fallback")
        self.assertEqual(code, 6, stderr)
        self.assertIn(said, stderr)
        document = self.succeeds(quavd.plan())
        self.assertIn("local engine instead of", document["fallback"])
        self.assertIn(said, document["fallback"])
        self.assertTrue(document["collision_free"])

    def test_a_wrong_key(self):
        self.refused("make a new one at cloud.ibm.com/iam/apikeys", key="wrong")

    def test_a_crn_of_another_region(self):
        self.refused("there is no such instance in eu-de", crn=self.service.crn.replace("us-east", "eu-de"))

    def test_401_also_for_a_fresh_token(self):
        self.service.control("fault", spec="status:code=401,path=/backends")
        self.refused("refused a fresh token")

    def test_403(self):
        self.service.control("fault", spec="status:code=403,path=/jobs,method=POST")
        self.refused("does not allow this")

    def test_no_minutes_left(self):
        self.service.control("fault", spec="status:code=409,path=/jobs,method=POST")
        self.refused("has no QPU time left")

    def test_more_than_the_minutes_that_are_left_is_known_before_anything_is_paid(self):
        self.service.control("usage", consumed=599)
        self.refused("the instance has 1 left")
        self.assertEqual(self.new_jobs(), [])

    def test_500_for_ever(self):
        self.service.control("fault", spec="status:code=500,path=/backends")
        self.refused("answered 500 5 times")

    def test_a_job_that_fails_its_check(self):
        self.service.control("fault", spec="fail:reason_code=1517")
        self.refused("does not fit the backend's instruction set")

    def test_a_truncated_result(self):
        self.service.control("fault", spec="truncate:path=/results")
        self.refused("makes no sense")

    def test_a_truncated_list_of_backends(self):
        self.service.control("fault", spec="truncate:path=/backends")
        self.refused("GET /backends makes no sense")

    def test_a_web_page_instead_of_the_service(self):
        quavd = self.quavd()
        quavd.environment["QUAV_IBM_API_URL"] = self.service.ready["iam"] + "/nowhere"
        self.assertEqual(quavd.plan("--no-fallback")[0], 6)

    def test_nobody_there(self):
        quavd = self.quavd()
        quavd.environment["QUAV_IBM_IAM_URL"] = quavd.environment["QUAV_IBM_API_URL"] = "http://127.0.0.1:9"
        code, _, stderr = quavd.plan("--no-fallback")
        self.assertEqual(code, 6)
        self.assertIn("127.0.0.1 gives no answer", stderr)

    def test_without_credentials_or_over_an_open_line_nothing_is_tried(self):
        quavd = self.quavd()
        quavd.environment["QUAV_IBM_API_URL"] = "http://example.org/api/v1"
        code, _, stderr = quavd.plan()
        self.assertEqual((code, "unencrypted" in stderr), (2, True), stderr)
        del quavd.environment["QUAV_IBM_API_KEY"]
        code, _, stderr = quavd.plan()
        self.assertEqual((code, "QUAV_IBM_API_KEY" in stderr), (2, True), stderr)


class Retirement(Case):
    def test_a_retired_backend_is_named_with_those_that_exist_and_least_busy_takes_the_best(self):
        self.service.control("retire", name="ibm_kyiv")
        quavd = self.quavd()
        code, _, stderr = quavd.run("plan", S5, "--engine", "ibm", "--paper", "--no-fallback")
        self.assertEqual(code, 6)
        self.assertIn("ibm_kyiv was retired on 2025-04-18", stderr)
        self.assertIn("ibm_fez, ibm_kingston, ibm_marrakesh", stderr)
        document = self.planned_on_the_qpu(quavd.plan(backend="least_busy"))
        self.assertEqual(document["qpu"]["backend"], "ibm_marrakesh")


class Mended(Case):
    """What passes is waited out, and what was created is not created again."""

    def once(self, spec):
        self.service.control("fault", spec=spec)
        self.planned_on_the_qpu(self.quavd().plan("--no-fallback"))
        self.assertEqual(len(self.new_jobs()), 1)

    def test_an_expired_token(self):
        self.once("status:code=401,path=/jobs,times=1")

    def test_429_with_retry_after(self):
        self.once("status:code=429,path=/jobs,method=POST,times=2,retry_after=1")

    def test_500_while_reading(self):
        self.once("status:code=500,path=/backends,times=3")

    def test_500_after_the_job_was_created(self):
        self.once("status:code=500,path=/jobs,method=POST,times=1,act=1")

    def test_500_before_the_job_was_created(self):
        self.once("status:code=500,path=/jobs,method=POST,times=1")

    def test_a_connection_cut_after_the_job_was_created(self):
        self.once("cut:path=/jobs,method=POST,times=1,act=1")

    def test_an_answer_cut_in_half_after_the_job_was_created(self):
        self.once("truncate:path=/jobs,method=POST,times=1")

    def test_a_connection_cut_while_waiting(self):
        self.once("cut:path=/jobs/,method=GET,times=3")


class Time(Case):
    def test_a_queue_longer_than_the_deadline_ends_in_the_visible_fallback_and_the_job_is_cancelled(self):
        self.service.control("fault", spec="queue:seconds=1e7")
        document = self.succeeds(self.quavd().plan("--deadline", "20"))
        self.assertIn("--deadline", document["fallback"])
        self.assertTrue(document["collision_free"])
        self.assertLess(document["time_ms"]["total"], 25_000)
        self.assertEqual([job["status"] for job in self.new_jobs()], ["Cancelled"])

    def test_without_a_fallback_it_is_exit_code_6(self):
        self.service.control("fault", spec="queue:seconds=1e7")
        self.assertEqual(self.quavd().plan("--deadline", "12", "--no-fallback")[0], 6)

    def interrupted(self, quavd):
        """A run that is killed while its job waits."""
        process = quavd.start("plan", S5, "--engine", "ibm", "--backend", "ibm_kyiv", *SMALL)
        self.wait_for_job()
        time.sleep(0.3)
        process.send_signal(signal.SIGKILL)
        process.communicate()

    def test_a_job_survives_a_restart_and_is_not_paid_twice(self):
        self.service.control("fault", spec="queue:seconds=3000")
        quavd = self.quavd()
        self.interrupted(quavd)
        document = self.planned_on_the_qpu(quavd.plan("--no-fallback"))
        self.assertEqual(document["qpu"]["picked_up"], 1)
        self.assertEqual([job["status"] for job in self.new_jobs()], ["Completed"])
        # The run is over: the next one is a new one.
        self.assertNotIn("quavd-", quavd.files())

    def test_a_job_that_nobody_wants_any_more_is_cancelled(self):
        self.service.control("fault", spec="queue:seconds=1e7")
        quavd = self.quavd()
        self.interrupted(quavd)
        # Another backend: the first job is of no use to it.
        self.assertEqual(quavd.plan("--deadline", "20", "--no-fallback", backend="ibm_fez")[0], 6)
        self.assertEqual([job["status"] for job in self.new_jobs()], ["Cancelled", "Cancelled"])
        self.assertNotIn("quavd-", quavd.files())


class Secrecy(Case):
    def test_the_key_is_in_no_log_error_file_or_command_line(self):
        self.service.control("fault", spec="queue:seconds=2000")
        quavd = self.quavd()
        process = quavd.start("-vv", "plan", S5, "--engine", "ibm", "--backend", "ibm_kyiv", *SMALL)
        self.wait_for_job()
        with open(f"/proc/{process.pid}/cmdline", encoding="utf-8") as file:
            seen = [file.read(), quavd.files()]
        seen.extend(process.communicate())
        self.assertEqual(process.returncode, 0, seen)
        self.service.control("clear")
        for spec in ("status:code=401", "status:code=403", "status:code=500", "cut", "truncate:path=/identity"):
            self.service.control("fault", spec=spec)
            quavd.environment["RUST_LOG"] = "trace"
            seen.extend(map(str, quavd.plan("--no-fallback")))
            self.service.control("clear")
        for key, crn in (("wrong-key-7316", None), (KEY, self.service.crn.replace("us-east", "eu-de"))):
            other = self.quavd(key, crn)
            seen.extend(map(str, other.run("-vv", "ibm", "backends")))
            self.assertFalse(any(key in text for text in seen))
        account = self.service.crn.split(":")[6]
        for secret in (KEY, self.service.crn, account, "eyJ"):
            self.assertFalse(any(secret in text for text in seen), secret)
        self.assertTrue(any("submitted" in text for text in seen), "nothing was logged at all")


class Noisy(Case):
    """QPUs with their recorded errors."""

    arguments = ("--clock-scale", "600")

    def test_a_leg_planned_on_the_qpu_is_clear_and_short(self):
        small = ("--qubits", "8", "--layers", "2", "--shots", "256", "--qpu-jobs", "1", "--qpu-circuits", "3")
        for backend in ("ibm_kyiv", "ibm_fez"):
            document = self.planned_on_the_qpu(self.quavd().run(
                "plan", S5, "--engine", "ibm", "--backend", backend, "--json", *small))
            self.assertTrue(document["collision_free"])
            self.assertLessEqual(document["length_m"], 1.10 * EXACT_S5)
            used, measured = document["qpu"], document["legs"][0]["rounds"][0]["qpu"]
            self.assertEqual((used["jobs"], used["circuits"]), (1, 3))
            self.assertAlmostEqual(used["charged_seconds"], used["estimated_seconds"], delta=1.0)
            self.assertNotEqual(measured["expectation"], measured["raw_expectation"])

    def test_training_on_the_qpu_lowers_the_loss_and_keeps_its_curve(self):
        with tempfile.NamedTemporaryFile("w", suffix=".json") as problem:
            json.dump({"h": [0.5, -0.2, 0.3, 0.1], "J": [[0, 1, 1.0], [1, 2, -0.5], [2, 3, 0.7]]}, problem)
            problem.flush()
            document = self.succeeds(self.quavd().run(
                "ibm", "run", problem.name, "--backend", "ibm_kyiv", "--train", "qpu", "--layers", "1",
                "--shots", "256", "--json"))
        loss, errors = document["loss"], document["qpu"]["loss_errors"]
        self.assertEqual((len(loss), len(errors)), (20, 20))
        self.assertTrue(all(error > 0 for error in errors))
        self.assertLess(min(loss), loss[0] - 5 * errors[0])
        self.assertEqual(document["qpu"]["used"]["jobs"], 21)


if __name__ == "__main__":
    unittest.main()

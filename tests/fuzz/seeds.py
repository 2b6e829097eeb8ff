#!/usr/bin/env python3
"""Makes the first inputs of the corpora from fence_examples: seeds.py (in the project's venv)."""
import json
import struct
import zipfile
from pathlib import Path

HERE = Path(__file__).parent
EXAMPLES = HERE.parents[1] / "fence_examples"
CORPUS = HERE / "corpus"
NAMES = ["one-polygon", "circles", "inclusion-with-hole", "corridor", "infeasible"]


def put(target, name, content):
    path = CORPUS / target / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)


def item(command, params, lat, lon, alt, frame=3, seq=0):
    numbers = [0.0 if p is None else p for p in params]
    return struct.pack("<4f2ifHHBBBBB", *numbers, round(lat * 1e7), round(lon * 1e7), alt or 0.0,
                       seq, command, 1, 1, frame, 0, 1)


def plan_items(plan):
    out = [item(16, [0, 0, 0, 0], 47, 8, 400, 0)]
    for entry in plan["mission"]["items"]:
        *params, lat, lon, alt = entry["params"]
        degrees = entry["frame"] != 2
        out.append(item(entry["command"], params, (lat or 0) if degrees else 0,
                        (lon or 0) if degrees else 0, alt, entry["frame"], len(out)))
    return out


def fence_items(plan):
    out = []
    for polygon in plan["geoFence"]["polygons"]:
        ring = polygon["polygon"]
        command = 5001 if polygon["inclusion"] else 5002
        out += [item(command, [len(ring), 0, 0, 0], lat, lon, 0, 0) for lat, lon in ring]
    for circle in plan["geoFence"]["circles"]:
        command = 5003 if circle["inclusion"] else 5004
        shape = circle["circle"]
        out.append(item(command, [shape["radius"], 0, 0, 0], *shape["center"], 0, 0))
    out.append(item(5000, [0, 0, 0, 0], 47, 8, 0, 0))
    return out


def chunk(which, payload):
    return bytes([which, len(payload)]) + payload


def answers(items, mission_type):
    """COUNT and the items, as `targets::line` takes them."""
    out = chunk(6, struct.pack("<HBBB", len(items), 255, 190, mission_type))
    for seq, raw in enumerate(items):
        raw = raw[:28] + struct.pack("<H", seq) + raw[30:] + bytes([mission_type])
        out += chunk(10, raw)
    return out


for path in sorted(EXAMPLES.iterdir()):
    if path.is_file() and path.suffix != ".md" and path.stat().st_size < 6000:
        put("files", path.name, path.read_bytes())
with zipfile.ZipFile(CORPUS / "files" / "one-polygon.kmz", "w", zipfile.ZIP_DEFLATED) as archive:
    # With no time in it, so that it is the same file each time.
    info = zipfile.ZipInfo("doc.kml")
    info.compress_type = zipfile.ZIP_DEFLATED
    archive.writestr(info, (EXAMPLES / "one-polygon.kml").read_bytes())
put("files", "old-fence.txt", b"47 8\n47 8\n47.1 8\n47.1 8.1\n47 8\n")
put("files", "old-rally.txt", b"RALLY 47.5 8.25 40 20 90 1\n")
survey = {"type": "ComplexItem", "complexItemType": "survey", "version": 5,
          "TransectStyleComplexItem": {"version": 2, "Items": [
              {"type": "SimpleItem", "command": 16, "frame": 3, "doJumpId": 1, "autoContinue": True,
               "params": [0, 0, 0, None, 47.1, 8.1, 30]}]}}
landing = {"type": "ComplexItem", "complexItemType": "fwLandingPattern", "version": 2,
           "altitudesAreRelative": True, "landCoordinate": [47.0, 8.0, 0], "loiterRadius": 75,
           "landingApproachCoordinate": [47.01, 8.0, 40], "loiterClockwise": False}
jump = {"type": "SimpleItem", "command": 177, "frame": 2, "doJumpId": 9, "autoContinue": True,
        "params": [1, 2, 0, 0, 0, 0, 0]}
put("files", "complex.plan", json.dumps({"fileType": "Plan", "version": 1, "mission": {
    "version": 2, "plannedHomePosition": [47, 8, 400], "items": [survey, landing, jump]}}).encode())
scan = {"type": "ComplexItem", "complexItemType": "StructureScan", "version": 3,
        "CameraCalc": {"AdjustedFootprintFrontal": 25, "AdjustedFootprintSide": 10, "DistanceToSurface": 15},
        "EntranceAltitude": 80, "GimbalPitch": 0, "Layers": 1, "ScanBottomAlt": 4, "StartFromTop": False,
        "StructureHeight": 29, "polygon": [[47, 8], [47.0003, 8], [47.0003, 8.0003], [47, 8.0003]]}
put("files", "structure-scan.plan", json.dumps({"fileType": "Plan", "version": 1, "mission": {
    "version": 2, "plannedHomePosition": [47, 8, 400], "items": [scan]}}).encode())

for name in NAMES:
    plan = json.loads((EXAMPLES / f"{name}.plan").read_text())
    mission, fence = plan_items(plan), fence_items(plan)
    put("mission_items", name, b"\x01" + b"".join(raw[:37] for raw in mission))
    put("fence_items", name, b"".join(raw[:37] for raw in fence))
    put("frames", name, b"\xff\x05hello" + answers(mission, 0) + b"\xff\x03\xfd\xfe\x00")
    ack = chunk(8, bytes([255, 190, 0, 0]))
    put("download", name, answers(mission, 0) + ack + answers(fence, 1))


def plan_file(items, mission_type):
    """ArduPilot's file of a plan."""
    body = b"".join(raw[:28] + struct.pack("<H", seq) + raw[30:] + bytes([mission_type])
                    for seq, raw in enumerate(items))
    return struct.pack("<5H", 0x763D, mission_type, 0, 0, len(items)) + body


for number, name in enumerate(NAMES):
    plan = json.loads((EXAMPLES / f"{name}.plan").read_text())
    mission_type = number % 2
    content = plan_file(fence_items(plan) if mission_type else plan_items(plan), mission_type)
    faults = [b"", bytes([0, 0, 2, 0, 1, 0]), bytes([0, 0, 0, 0, 3, 9]), bytes([0, 0, 4, 129]), bytes([0, 0, 11, 20])]
    put("plan_files", name, struct.pack("<H", len(content)) + content + faults[number])
    # REQUEST (ArduPilot) or REQUEST_INT for each item, then ACK.
    items, which = (4 + number % 4), (number % 2) * 128
    asked = b"".join(chunk(9 if which else 3, struct.pack("<HBBB", seq, 1, 195, 0)) for seq in range(items))
    put("upload", name, bytes([which | items]) + asked + chunk(8, bytes([1, 195, [0, 4, 13, 15, 1][number], 0])))


def device(qubits, entangler):
    pairs = [[a, a + 1] for a in range(qubits - 1)]
    configuration = {"backend_name": "ibm_small", "backend_version": "1.0.0", "n_qubits": qubits,
                     "basis_gates": ["id", "rz", "sx", "x", entangler], "coupling_map": pairs,
                     "dt": 0.5, "default_rep_delay": 250.0, "max_shots": 100000,
                     "processor_type": {"family": "Heron", "revision": 2},
                     "gates": [{"name": entangler, "coupling_map": pairs}]}
    value = lambda name, number, unit: {"name": name, "value": number, "unit": unit,  # noqa: E731
                                        "date": "2026-01-01T00:00:00Z"}
    gate = lambda name, on, error, length: {  # noqa: E731
        "gate": name, "qubits": on,
        "parameters": [value("gate_error", error, ""), value("gate_length", length, "ns")]}
    properties = {"backend_name": "ibm_small", "last_update_date": "2026-01-01T00:00:00Z",
                  "qubits": [[value("T1", 250.0, "us"), value("T2", 100.0, "us"),
                              value("readout_error", 0.01, ""), value("readout_length", 1500, "ns")]
                             for _ in range(qubits)],
                  "gates": [gate("sx", [q], 2e-4, 32) for q in range(qubits)]
                  + [gate(entangler, pair, 3e-3, 68) for pair in pairs]}
    return (json.dumps(configuration) + "\0" + json.dumps(properties)).encode()


for qubits, entangler in [(2, "cz"), (3, "ecr"), (5, "cx"), (4, "cz"), (7, "ecr")]:
    put("device", f"{qubits}-{entangler}", device(qubits, entangler))


ROWS = ['connect = "udpin:0.0.0.0:14550"', 'buffer = 8', 'policy = "on_change"', 'fence = ["a.plan", "b.kml"]',
        'rounds = 12\nseed = 0x10', 'paper = true']
for number in range(1, len(ROWS) + 1):
    put("configuration", f"{number}.toml", ("\n".join(ROWS[:number]) + "\n").encode())


def measured(registers, shots):
    results = [{"data": {"c": {"samples": [hex(min(shot, 2 ** bits - 1)) for shot in range(shots)],
                               "num_bits": bits}}, "metadata": {}} for bits in registers]
    return bytes([shots]) + json.dumps({"results": results, "metadata": {"version": 2}}).encode()


for number, registers in enumerate([[1], [1, 3, 70], [1, 3, 70], [1], [3]]):
    put("results", f"{number}", measured(registers, number + 1))


def said(status, document):
    """An answer, as `targets::service` takes it; `status` counts in its list."""
    body = json.dumps(document).encode()
    return struct.pack("<BH", status, len(body)) + body


TOKEN = said(0, {"access_token": "t", "expires_in": 3600})
REFUSED = {"errors": [{"code": 1234, "message": "no", "solution": "wait"}], "trace": "x"}
backends = {"devices": [{"name": "ibm_small", "status": {"name": "online"}, "qubits": 5, "queue_length": 1,
                         "processor_type": {"family": "Heron", "revision": "2"}}]}
configuration, properties = device(2, "cz").split(b"\0")
plain = lambda raw: struct.pack("<BH", 0, len(raw)) + raw  # noqa: E731
state = lambda name: said(0, {"id": "job", "state": {"status": name, "reason": "r", "reason_code": 1305}})  # noqa: E731
for name, call, replies in [
    ("usage", 0, said(0, {"usage_consumed_seconds": 1, "usage_limit_seconds": 600})),
    ("backends", 1, said(0, backends)),
    ("device", 2, plain(configuration) + plain(properties)),
    ("batch", 3, said(1, {"id": "b-1"})),
    ("state", 4, state("Failed")),
    ("results", 5, state("Queued") + state("Completed") + said(3, REFUSED) + state("Completed") + plain(b"{}")),
    ("metrics", 6, said(0, {"usage": {"qpu_charge_time_seconds": 2.5}})),
    ("cancel", 7, said(2, {})),
    ("submit", 8, said(8, {}) + said(0, {"jobs": []}) + said(0, {"jobs": [{"id": "j", "tags": ["quavd-1"]}]})),
    ("submit-unknown", 8, said(5, REFUSED) + said(0, backends)),
]:
    put("service", name, bytes([call]) + TOKEN + replies)
put("service", "no-token", bytes([0]) + said(3, {"errorCode": "BXNIM0415E", "errorMessage": "no key"}))

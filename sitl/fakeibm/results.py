"""Results in both forms: plain, and the serialized objects that IBM's own client asks for."""

import json

import numpy
from qiskit.primitives.containers import BitArray, DataBin, PrimitiveResult, SamplerPubResult
from qiskit_ibm_runtime.json import RuntimeEncoder


def plain(pubs):
    """`support_qiskit: false`: one unpadded hexadecimal number a shot; a sweep nests one list a point."""
    return json.dumps({
        "results": [{"data": {name: {"samples": _nested(array), "num_bits": size}
                              for name, (array, size) in registers.items()}, "metadata": {}}
                    for registers in pubs],
        "metadata": {"version": 2},
    })


def _nested(array):
    if array.ndim == 2:
        return [hex(int.from_bytes(row.tobytes(), "big")) for row in array]
    return [_nested(point) for point in array]


def serialized(pubs):
    """`support_qiskit: true`."""
    results = []
    for registers in pubs:
        fields = {name: BitArray(array, size) for name, (array, size) in registers.items()}
        shape = next(iter(fields.values())).shape if fields else ()
        results.append(SamplerPubResult(DataBin(**fields, shape=shape), metadata={"circuit_metadata": {}}))
    return json.dumps(PrimitiveResult(results, metadata={"version": 2}), cls=RuntimeEncoder)


def stacked(shape, points):
    """The registers of a sweep's points as arrays with the sweep's shape in front."""
    return {name: (numpy.stack([point[name][0] for point in points]).reshape(*shape, *points[0][name][0].shape),
                   points[0][name][1])
            for name in points[0]}

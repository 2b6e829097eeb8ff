#!/usr/bin/env python3
"""What other people's programs make of files: their loaders' view of each, as one JSON document.

    loaders.py mission FILE...   pymavlink's mavwp and MAVProxy's wp module
    loaders.py fence FILE...     the same of fences: items, polygons, circles, return point
    loaders.py rally FILE...     the same of rally points
    loaders.py plan FILE...      QGroundControl's .plan against the schema of its documentation

Nothing of quavd is used. The MAVProxy modules are the real ones, with a stand-in for the program
around them; what they would upload is what is printed. Exit status 1: a loader refused the file.
"""
import json
import math
import os
import sys
from pathlib import Path
from unittest.mock import MagicMock

os.environ["MAVLINK20"] = "1"

from pymavlink import mavwp  # noqa: E402


def item_dict(item):
    """An item in degrees, whichever of the two messages holds it; NaN is null."""
    degrees = 1e-7 if item.get_type() == "MISSION_ITEM_INT" else 1.0
    number = lambda value: None if math.isnan(value) else value  # noqa: E731
    return {
        "seq": item.seq,
        "frame": item.frame,
        "command": item.command,
        "autocontinue": item.autocontinue,
        "params": [number(p) for p in (item.param1, item.param2, item.param3, item.param4)],
        "x": number(item.x * degrees),
        "y": number(item.y * degrees),
        "z": number(item.z),
    }


def items_of(loader):
    return [item_dict(loader.item(index)) for index in range(loader.count())]


def mavproxy_module(kind):
    """MAVProxy's own module with a stand-in for the program around it."""
    from MAVProxy.modules import mavproxy_fence, mavproxy_rally, mavproxy_wp

    state = MagicMock(name="mpstate")
    state.continue_mode = False
    state.settings.target_system = 1
    state.settings.target_component = 1
    modules = {
        "mission": mavproxy_wp.WPModule,
        "fence": mavproxy_fence.FenceModule,
        "rally": mavproxy_rally.RallyModule,
    }
    return modules[kind](state)


def view(kind, path):
    loaders = {
        "mission": mavwp.MAVWPLoader,
        "fence": mavwp.MissionItemProtocol_Fence,
        "rally": mavwp.MissionItemProtocol_Rally,
    }
    loader = loaders[kind]()
    loader.load(path)
    module = mavproxy_module(kind)
    module.wploader.load(path)
    seen = {"mavwp": items_of(loader), "mavproxy": items_of(module.wploader)}
    if kind == "fence":
        places = lambda ring: [[p["x"], p["y"]] for p in map(item_dict, ring)]  # noqa: E731
        discs = lambda circles: [  # noqa: E731
            [c["x"], c["y"], c["params"][0]] for c in map(item_dict, circles)
        ]
        home = module.returnpoint()
        seen["regions"] = {
            "inclusion_polygons": [places(ring) for ring in module.inclusion_polygons()],
            "exclusion_polygons": [places(ring) for ring in module.exclusion_polygons()],
            "inclusion_circles": discs(module.inclusion_circles()),
            "exclusion_circles": discs(module.exclusion_circles()),
            "return_point": places([home])[0] if home else None,
        }
    return seen


def check_plans(paths):
    from jsonschema import Draft202012Validator

    schema = json.loads((Path(__file__).parent / "plan.schema.json").read_text())
    validator = Draft202012Validator(schema)
    problems = []
    for path in paths:
        document = json.loads(Path(path).read_text())
        for error in validator.iter_errors(document):
            problems.append(f"{path}: {error.json_path}: {error.message}")
    return {"files": len(paths), "problems": problems}


def main(arguments):
    if len(arguments) < 2 or arguments[0] not in ("mission", "fence", "rally", "plan"):
        sys.exit(__doc__)
    kind, *paths = arguments
    # The loaders print on stdout what they have to say; the document stands alone there.
    out, sys.stdout = sys.stdout, sys.stderr
    if kind == "plan":
        seen = check_plans(paths)
        failed = bool(seen["problems"])
    else:
        seen = [view(kind, path) for path in paths]
        failed = False
    json.dump(seen, out)
    out.write("\n")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main(sys.argv[1:])

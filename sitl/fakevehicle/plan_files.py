"""Reading QGroundControl `.plan` and `QGC WPL 110` files into items. No vehicle here.

Home is never part of the returned items: a `.plan` keeps it apart, and line 0 of a waypoint file
is home by convention if it is a WAYPOINT. DO_JUMP targets count from item 0 of the returned mission.
Numbers are checked; errors name the file and the item or line.
"""

import json
import math
from dataclasses import dataclass, field, replace

from .dialect import FENCE, MISSION, RALLY, f32, mavlink
from .items import Item

FENCE_COMMANDS = range(5000, 5005)
RALLY_COMMAND = mavlink.MAV_CMD_NAV_RALLY_POINT


class PlanFileError(Exception):
    """The file cannot be used; the text says where and why."""


@dataclass
class Plan:
    """What a file holds. `home` is (lat, lon, AMSL altitude) in degrees and metres, or None."""

    items: dict = field(default_factory=lambda: {MISSION: [], FENCE: [], RALLY: []})
    home: tuple = None


def load_plan(path):
    """Reads either format, told apart by content."""
    try:
        with open(path, encoding="utf-8-sig") as file:
            text = file.read(64 * 1024 * 1024)
    except (OSError, UnicodeDecodeError) as error:
        raise PlanFileError(f"{path}: {error}") from error
    if text.lstrip().startswith("{"):
        return _load_qgc_plan(path, text)
    if text.startswith("QGC WPL"):
        return _load_waypoints(path, text)
    raise PlanFileError(f"{path}: neither a QGroundControl .plan nor a 'QGC WPL 110' file")


def _load_qgc_plan(path, text):
    try:
        document = json.loads(text)
    except ValueError as error:
        raise PlanFileError(f"{path}: {error}") from error
    plan = Plan()
    where = path
    try:
        if document.get("fileType") != "Plan":
            raise ValueError("fileType is not 'Plan'")
        mission = document.get("mission") or {}
        home = mission.get("plannedHomePosition")
        if home:
            plan.home = (_latitude(home[0]), _longitude(home[1]), _finite(home[2]) if len(home) > 2 else 0.0)

        simple = []  # (doJumpId or None, raw item)
        for index, entry in enumerate(mission.get("items") or []):
            where = f"{path}: mission item {index}"
            simple += _flatten(entry)
        ids = {jump_id: seq for seq, (jump_id, _) in enumerate(simple) if jump_id is not None}
        for seq, (_, entry) in enumerate(simple):
            where = f"{path}: mission item {seq}"
            plan.items[MISSION].append(_simple_item(entry, ids))

        where = f"{path}: geoFence"
        plan.items[FENCE] = _fence_items(document.get("geoFence") or {})
        where = f"{path}: rallyPoints"
        for lat, lon, alt in (document.get("rallyPoints") or {}).get("points") or []:
            plan.items[RALLY].append(_placed(RALLY_COMMAND, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, lat, lon, alt))
    except (ValueError, TypeError, KeyError, IndexError, AttributeError, OverflowError) as error:
        raise PlanFileError(f"{where}: {type(error).__name__}: {error}") from error
    return plan


def _flatten(entry):
    """The simple items of a plan entry, with their doJumpId where there is one."""
    if entry.get("type") == "SimpleItem":
        return [(entry.get("doJumpId"), entry)]
    style = entry.get("TransectStyleComplexItem") or entry
    nested = style.get("Items")
    if nested is None:
        raise ValueError(f"complex item {entry.get('complexItemType')!r} has no expanded 'Items'")
    return [(inner.get("doJumpId"), inner) for inner in nested]


def _simple_item(entry, ids):
    params = [math.nan if value is None else float(value) for value in entry["params"]]
    if len(params) != 7:
        raise ValueError(f"expected 7 params, found {len(params)}")
    command, frame = int(entry["command"]), int(entry["frame"])
    if command == mavlink.MAV_CMD_DO_JUMP:
        target = int(params[0])
        if ids and target not in ids:
            raise ValueError(f"DO_JUMP to {target}, but no item has that doJumpId")
        params[0] = float(ids.get(target, target - 1))
    item = Item(command, frame, tuple(f32(value) for value in params[:4]),
                z=f32(0.0 if math.isnan(params[6]) else params[6]),
                autocontinue=int(bool(entry.get("autoContinue", True))))
    return _with_position(item, params[4], params[5])


def _with_position(item, x, y):
    x, y = (0.0 if math.isnan(value) else value for value in (x, y))
    if not item.raw_position:
        _latitude(x)
        _longitude(y)
    return item.with_float_position(x, y)


def _fence_items(fence):
    items = []
    frame = mavlink.MAV_FRAME_GLOBAL
    for polygon in fence.get("polygons") or []:
        command = (mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION if polygon["inclusion"]
                   else mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION)
        ring = polygon["polygon"]
        items += [_placed(command, frame, lat, lon, 0.0, param1=len(ring)) for lat, lon in ring]
    for entry in fence.get("circles") or []:
        command = (mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION if entry["inclusion"]
                   else mavlink.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION)
        lat, lon = entry["circle"]["center"]
        items.append(_placed(command, frame, lat, lon, 0.0, param1=entry["circle"]["radius"]))
    if fence.get("breachReturn"):
        lat, lon, alt = (list(fence["breachReturn"]) + [0.0])[:3]
        items.append(_placed(mavlink.MAV_CMD_NAV_FENCE_RETURN_POINT, frame, lat, lon, alt))
    return items


def _placed(command, frame, lat, lon, alt, param1=0.0):
    item = Item(command, frame, (f32(float(param1)), 0.0, 0.0, 0.0), z=f32(float(alt)))
    return _with_position(item, float(lat), float(lon))


def _load_waypoints(path, text):
    plan = Plan()
    lines = [(number, line.split()) for number, line in enumerate(text.splitlines(), 1)]
    for number, fields in lines[1:]:
        if not fields or fields[0].startswith("#"):
            continue
        try:
            if len(fields) != 12:
                raise ValueError(f"expected 12 columns, found {len(fields)}")
            seq, current, frame, command = (int(value) for value in fields[:4])
            params = [float(value) for value in fields[4:11]]
            item = Item(command, frame, tuple(f32(value) for value in params[:4]), z=f32(params[6]),
                        autocontinue=int(float(fields[11])))
            item = _with_position(item, params[4], params[5])
        except (ValueError, OverflowError) as error:
            raise PlanFileError(f"{path}:{number}: {error}") from error
        if seq == 0 and command == mavlink.MAV_CMD_NAV_WAYPOINT:
            plan.home = (params[4], params[5], _finite(params[6]))
        elif command in FENCE_COMMANDS:
            plan.items[FENCE].append(item)
        elif command == RALLY_COMMAND:
            plan.items[RALLY].append(item)
        else:
            if command == mavlink.MAV_CMD_DO_JUMP:  # its target counts home as item 0
                first = 1 if plan.home else 0
                item = replace(item, params=(item.params[0] - first, *item.params[1:]))
            plan.items[MISSION].append(item)
    return plan


def _finite(value):
    if not math.isfinite(float(value)):
        raise ValueError(f"{value} is not a finite number")
    return float(value)


def _latitude(value):
    if not abs(float(value)) <= 90:
        raise ValueError(f"latitude {value} is out of range")
    return float(value)


def _longitude(value):
    if not abs(float(value)) <= 180:
        raise ValueError(f"longitude {value} is out of range")
    return float(value)

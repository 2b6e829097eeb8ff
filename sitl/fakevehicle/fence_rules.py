"""ArduPilot's check of a whole uploaded fence, with the words it uses to refuse one.

It does not look for crossing edges, and neither does this.
"""

import math

from .dialect import mavlink

POLYGONS = (mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION, mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION)
CIRCLES = (mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION, mavlink.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION)
RETURN_POINT = mavlink.MAV_CMD_NAV_FENCE_RETURN_POINT

POLYGON_BYTES, VERTEX_BYTES, CIRCLE_BYTES, RETURN_BYTES = 2, 8, 13, 9
STORAGE_BYTES_PER_ITEM = 558 / 70  # measured: the simulator's 70-item fence storage takes about 558 bytes


def fault_in(items, capacity):
    """Why ArduPilot would refuse this fence (its STATUSTEXT), or None if it is fine."""
    returns, storage, left, kind, count = 0, 0, 0, None, 0
    for item in items:
        if left:
            if item.command != kind:
                return "Received incorrect vertex type"
            if _vertex_count(item) != count:
                return "Unexpected vertex count"
            left -= 1
        elif item.command in POLYGONS:
            kind, count = item.command, _vertex_count(item)
            if count is None or not 3 <= count <= 255:
                return f"Invalid vertex count ({count if count is not None else 0})"
            left = count - 1
            storage += POLYGON_BYTES
        if item.command in CIRCLES and not item.params[0] > 0:
            return "Non-positive circle radius"
        if item.command in CIRCLES and math.isinf(item.params[0]):
            return "Non-positive circle radius"
        if item.command == RETURN_POINT:
            returns += 1
            if returns > 1:
                return "Multiple return points"
        if abs(item.x) > 90 * 10**7 or abs(item.y) > 180 * 10**7:
            return "Bad lat or lon"
        storage += (VERTEX_BYTES if item.command in POLYGONS
                    else CIRCLE_BYTES if item.command in CIRCLES else RETURN_BYTES)
    if left:
        return "Incorrect item count"
    if storage > capacity * STORAGE_BYTES_PER_ITEM:
        return "Fence storage full"
    return None


def fence_total(items):
    """The parameter FENCE_TOTAL: a count for the old fence protocol, not a change id."""
    return len(items) + 2 if items else 0


def only_few_circles(items):
    """One or two circles and nothing else: the fence that ArduPilot accepts and then erases."""
    return 1 <= len(items) <= 2 and all(item.command in CIRCLES for item in items)


def _vertex_count(item):
    return int(item.params[0]) if math.isfinite(item.params[0]) else None

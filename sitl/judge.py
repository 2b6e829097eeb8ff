#!/usr/bin/env python3
"""Judges the mission in a dump of the fake vehicle against its fence.

    judge.py DUMP.json [--buffer 5]

An independent second opinion: it shares no code with quavd and projects nothing. Each leg is measured on the plane
that touches the ellipsoid in the leg's middle, from the integers that the vehicle holds. Prints one JSON object:

    {"legs": 9, "length_m": 812.3, "min_clearance_m": 5.02, "collisions": 0, "clear": true}

and ends with status 0 if no leg comes nearer to an obstacle or to the edge of an inclusion than the buffer less
1 cm, else with 1. Standard library only. Knows waypoints, takeoff, landing and a return home; polygons and circles.
"""

import argparse
import json
import math
import sys

A, E2 = 6378137.0, 6.69437999014e-3  # WGS 84
TAKEOFF, RTL, LAND, WAYPOINT = 22, 20, 21, 16
INCLUSION_POLYGON, EXCLUSION_POLYGON, INCLUSION_CIRCLE, EXCLUSION_CIRCLE = 5001, 5002, 5003, 5004


class Plane:
    """Metres east and north of a place, on the plane that touches the ellipsoid there."""

    def __init__(self, lat, lon):
        self.lat, self.lon = lat, lon
        sin2 = math.sin(math.radians(lat)) ** 2
        self.north = math.radians(1) * A * (1 - E2) / (1 - E2 * sin2) ** 1.5
        self.east = math.radians(1) * A / math.sqrt(1 - E2 * sin2) * math.cos(math.radians(lat))

    def xy(self, place):
        lon = (place[1] - self.lon + 540) % 360 - 180
        return (lon * self.east, (place[0] - self.lat) * self.north)


def point_to_segment(p, a, b):
    dx, dy = b[0] - a[0], b[1] - a[1]
    square = dx * dx + dy * dy
    t = 0.0 if square == 0 else max(0.0, min(1.0, ((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / square))
    return math.hypot(p[0] - a[0] - t * dx, p[1] - a[1] - t * dy)


def side(a, b, c):
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def segment_to_segment(a, b, c, d):
    if side(a, b, c) * side(a, b, d) < 0 and side(c, d, a) * side(c, d, b) < 0:
        return 0.0
    return min(point_to_segment(a, c, d), point_to_segment(b, c, d),
               point_to_segment(c, a, b), point_to_segment(d, a, b))


def inside(p, ring):
    result = False
    for a, b in zip(ring, ring[1:] + ring[:1]):
        if (a[1] > p[1]) != (b[1] > p[1]) and p[0] < (b[0] - a[0]) * (p[1] - a[1]) / (b[1] - a[1]) + a[0]:
            result = not result
    return result


def degrees(item):
    return (item["x"] / 1e7, item["y"] / 1e7)


def regions(fence):
    """(inclusion?, ring or None, centre or None, radius) for each region."""
    found, items = [], list(fence)
    while items:
        first = items[0]
        command = first["command"]
        if command in (INCLUSION_POLYGON, EXCLUSION_POLYGON):
            count = int(first["param1"])
            ring, items = [degrees(item) for item in items[:count]], items[count:]
            found.append((command == INCLUSION_POLYGON, ring, None, 0.0))
        elif command in (INCLUSION_CIRCLE, EXCLUSION_CIRCLE):
            found.append((command == INCLUSION_CIRCLE, None, degrees(first), first["param1"]))
            items = items[1:]
        else:
            items = items[1:]
    return found


def way(dump):
    """The places that are flown to, in order."""
    items, places, home = list(dump["mission"]["items"]), [], None
    if dump["persona"] == "ardupilot" and items:
        home, items = degrees(items[0]), items[1:]
    elif dump.get("home"):
        home = (dump["home"]["lat"], dump["home"]["lon"])
    stands = (dump["position"]["lat"], dump["position"]["lon"]) if dump.get("position") else None
    for item in items:
        command = item["command"]
        if command == TAKEOFF:
            # ArduPilot takes off where it stands, whatever place the item has.
            has_place = (item["x"] or item["y"]) and dump["persona"] != "ardupilot"
            places.append(degrees(item) if has_place else stands or home)
        elif command == RTL:
            places.append(home)
        elif command == WAYPOINT or (command == LAND and (item["x"] or item["y"])):
            places.append(degrees(item))
        elif command <= 95 and command not in (LAND, 93):
            raise SystemExit(f"judge.py does not know command {command}")
    return places


def clearance(start, end, region):
    """How near the straight leg comes to the region's edge; 0 on its wrong side."""
    is_inclusion, ring, centre, radius = region
    lon = (end[1] - start[1] + 540) % 360 - 180
    plane = Plane((start[0] + end[0]) / 2, start[1] + lon / 2)
    a, b = plane.xy(start), plane.xy(end)
    if centre is not None:
        middle = plane.xy(centre)
        if is_inclusion:
            return max(0.0, radius - max(math.dist(a, middle), math.dist(b, middle)))
        return max(0.0, point_to_segment(middle, a, b) - radius)
    corners = [plane.xy(corner) for corner in ring]
    if inside(a, corners) != is_inclusion:
        return 0.0
    return min(segment_to_segment(a, b, c, d) for c, d in zip(corners, corners[1:] + corners[:1]))


def judge(dump, buffer):
    places = way(dump)
    legs = [leg for leg in zip(places, places[1:]) if leg[0] != leg[1]]
    fences = regions(dump["fence"]["items"])
    nearest = [min((clearance(a, b, region) for region in fences), default=math.inf) for a, b in legs]
    length = 0.0
    for a, b in legs:
        plane = Plane((a[0] + b[0]) / 2, a[1])
        length += math.dist(plane.xy(a), plane.xy(b))
    least = min(nearest, default=math.inf)
    return {
        "legs": len(legs),
        "length_m": round(length, 3),
        "min_clearance_m": None if math.isinf(least) else round(least, 4),
        "collisions": sum(1 for distance in nearest if distance <= 0),
        "clear": least >= buffer - 0.01,
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dump", help="what the fake vehicle wrote with --dump")
    parser.add_argument("--buffer", type=float, default=5.0, help="metres to keep (5)")
    options = parser.parse_args()
    with open(options.dump, encoding="utf-8") as file:
        verdict = judge(json.load(file), options.buffer)
    print(json.dumps(verdict))
    return 0 if verdict["clear"] else 1


if __name__ == "__main__":
    sys.exit(main())

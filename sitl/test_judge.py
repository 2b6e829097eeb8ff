"""judge.py on dumps whose answers are known."""

import unittest

import judge


def item(command, lat=0.0, lon=0.0, param1=0.0):
    return {"command": command, "x": round(lat * 1e7), "y": round(lon * 1e7), "param1": param1}


def dump(persona, *mission):
    # A square of about 22 m, 1.1 km north of where the vehicle stands.
    square = [(10.0099, 19.9999), (10.0099, 20.0001), (10.0101, 20.0001), (10.0101, 19.9999)]
    return {
        "persona": persona,
        "home": {"lat": 10.0, "lon": 20.0, "alt": 0.0},
        "position": {"lat": 10.0, "lon": 20.0, "alt": 0.0},
        "mission": {"items": list(mission)},
        "fence": {"items": [item(judge.EXCLUSION_POLYGON, lat, lon, 4) for lat, lon in square]},
    }


class Takeoff(unittest.TestCase):
    def test_ardupilot_takes_off_where_it_stands_and_px4_at_the_place_of_the_item(self):
        home, beyond, behind = item(16, 10.0, 20.0), item(judge.TAKEOFF, 10.02, 20.0), item(16, 9.99, 20.0)
        here = judge.judge(dump("ardupilot", home, beyond, behind), 5.0)
        self.assertEqual((here["legs"], here["clear"]), (1, True))
        there = judge.judge(dump("px4", beyond, behind), 5.0)
        self.assertEqual((there["legs"], there["collisions"], there["clear"]), (1, 1, False))

    def test_a_leg_is_measured_from_its_integers(self):
        home, start, end = item(16, 10.0, 20.0), item(16, 10.0, 20.0003), item(16, 10.02, 20.0003)
        verdict = judge.judge(dump("ardupilot", home, start, end), 5.0)
        # 0.0002 degrees of longitude at 10 degrees north.
        self.assertAlmostEqual(verdict["min_clearance_m"], 21.93, delta=0.05)
        self.assertAlmostEqual(verdict["length_m"], 2212.2, delta=1.0)


if __name__ == "__main__":
    unittest.main()

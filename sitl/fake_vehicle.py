#!/usr/bin/env python3
"""A fake ArduPilot or PX4 vehicle for testing MAVLink software. See README.md or --help."""

import os
import sys

# Has to be set before pymavlink is first imported: MAVLink 2, or there are no fences.
os.environ["MAVLINK20"] = "1"
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

from fakevehicle.cli import main  # noqa: E402  (needs the two lines above)

if __name__ == "__main__":
    sys.exit(main())

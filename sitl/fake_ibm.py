#!/usr/bin/env python3
"""A stand-in for IBM Quantum's REST service, for testing its clients. See README.md or --help."""

import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

from fakeibm.cli import main  # noqa: E402  (needs the line above)

if __name__ == "__main__":
    sys.exit(main())

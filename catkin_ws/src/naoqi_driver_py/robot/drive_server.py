#!/usr/bin/env python
# Runs on the robot's own Python 2.7 as well as on Python 3: keep to syntax that both accept.
"""Pepper's drive server: the only program that moves its base. See docs/pepper.md.

Use, with a simulator:      drive_server.py --qi-url tcp://127.0.0.1:9559
On the robot runs the one file that make_drive_server.py makes of this and of what it imports.
"""

import sys

from naoqi_driver.onboard.drive_program import main

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

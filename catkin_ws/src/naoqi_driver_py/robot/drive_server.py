#!/usr/bin/env python
# Runs on the robot's own Python 2.7 as well as on Python 3: keep to syntax that both accept.
"""Pepper's drive server: the only program that moves its base. See docs/pepper.md.

Use, with a simulator:      drive_server.py --qi-url tcp://127.0.0.1:9559
    for a far NAOqi 2.9:    drive_server.py --qi-url tcps://ROBOT:9503     (with NAO_USER and NAO_PASSWORD set)
On the robot runs the one file that make_drive_server.py makes of `drive_program` and of what that imports. TLS is not
in it: it needs Python 3, and on the robot itself NAOqi answers without.
"""

import sys

from naoqi_driver.onboard.drive_program import main


def make_tls(place, say):
    """Return the TLS for a robot with NAOqi 2.9."""
    from naoqi_driver.robot_tls import RobotTls  # what speaks tcp needs neither Python 3 nor ssl

    return RobotTls.from_environment(place, say)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:], make_tls))

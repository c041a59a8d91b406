#!/usr/bin/env python3
"""Put a simulation back to its start, as the simulation guide's RestartClient does:

    rosrun sim_bringup restart_client.py

With several robots in one world any of their services will do: `__ns:=/rto3`. The service is `restart_simulation`
(std_srvs/Trigger); on the command line it is `rosservice call /restart_simulation`. The exit code is 0 when it worked.
"""

import sys

import rospy
from std_srvs.srv import Trigger
from telepresence_ros.master_watch import wait_for_master

PATIENCE = 10.0
"""Seconds within which a simulation must be there."""


def main():
    wait_for_master()  # rospy alone waits for ever, even after Ctrl-C
    rospy.init_node("restart_client", anonymous=True)
    try:
        rospy.wait_for_service("restart_simulation", PATIENCE)
        answer = rospy.ServiceProxy("restart_simulation", Trigger)()
    except (rospy.ROSException, rospy.ServiceException) as error:
        print(f"Restart failed: {error}", file=sys.stderr)
        return 1
    print(f"Restart successful: {answer.message}" if answer.success else f"Restart failed: {answer.message}")
    return 0 if answer.success else 1


if __name__ == "__main__":
    sys.exit(main())

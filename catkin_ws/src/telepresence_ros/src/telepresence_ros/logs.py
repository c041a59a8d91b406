"""What modules without ROS log, shown as if rospy had logged it."""

from __future__ import annotations

import logging

OURS = ("naoqi_driver", "naoqi_pose", "pepper_sensors", "rto_node", "telepresence", "telepresence_1")
"""Packages whose modules log by Python's own logging."""


def route_logs_to_ros() -> None:
    """Show the logs of `OURS` on the terminal and on /rosout. Call it after `rospy.init_node`."""
    for name in OURS:
        logger = logging.getLogger(name)
        logger.setLevel(logging.INFO)
        logger.propagate = False
        logger.handlers = list(logging.getLogger("rosout").handlers)

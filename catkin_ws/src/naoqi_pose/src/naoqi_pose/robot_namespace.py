"""The namespace of the robot whose joints these nodes move; they themselves are in one of their own below it."""

from __future__ import annotations

import rospy

MARK = "pepper_is_here"
"""A parameter that the robot's launch file sets in the robot's namespace: it cannot say which one that is."""


def of_robot(name: str) -> str:
    """Return the name of a topic or service of the robot, e.g. "drive/state": in `~robot_namespace`, or where the mark
    is. Without either the robot is in the root namespace, as it is for launch files that include only the poses."""
    if said := str(rospy.get_param("~robot_namespace", "")):
        return rospy.names.canonicalize_name(f"/{said}/{name}")
    found = rospy.search_param(MARK) or "/"
    return found[: found.rindex("/") + 1] + name

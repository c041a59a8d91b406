"""A world with one simulated Robotino as a ROS node; `sim_bringup.node` says what it publishes and serves.

Parameters: ~address (127.0.0.1), ~port (8080; 0 takes a free one), ~scene (arena), ~seed (0), ~watchdog (0.2) [s],
            ~laser (false), ~battery (NiMH; Li-Ion has a Festool charger), ~charging (false), ~camera_width,
            ~camera_height (640, 480), ~viewer (false): open MuJoCo's;
            ~wires/robotino/{cmd_vel, image}: where the safety gate takes commands and the driver publishes pictures.
"""

from __future__ import annotations

import rospy
from sim_bringup.node import run

from robotino_sim.simulation import DEFAULT_PORT, DEFAULT_SCENE
from telepresence.sim.simulation import RobotRequest


def main() -> int:
    """Run until the node is shut down; the exit code."""
    return run("robotino_sim", _robots, DEFAULT_SCENE)


def _robots() -> list[RobotRequest]:
    options = {
        "watchdog": float(rospy.get_param("~watchdog", 0.2)),
        "laser": bool(rospy.get_param("~laser", False)),
        "battery": str(rospy.get_param("~battery", "NiMH")),
        "charging": bool(rospy.get_param("~charging", False)),
        "camera_size": (int(rospy.get_param("~camera_width", 640)), int(rospy.get_param("~camera_height", 480))),
    }
    return [RobotRequest("robotino", "robotino", int(rospy.get_param("~port", DEFAULT_PORT)), options)]

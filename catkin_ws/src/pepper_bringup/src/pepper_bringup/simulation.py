"""A world with one simulated Pepper as a ROS node; `sim_bringup.node` says what it publishes and serves.

Parameters: ~address (127.0.0.1), ~port (9559; 0 takes a free one), ~scene (apartment), ~seed (0), ~viewer (false): open
            MuJoCo's viewer; ~wires/pepper/{cmd_vel, image}: where the driver takes commands and publishes pictures;
            ~kinds/pepper/{speaker, record_speaker, room_sound, head, posters, people, disk, tablet_browser}: its sound
            and head, what and who stands before it, its files and its tablet, see `SimulatedPepper`;
            ~kinds/pepper/{owner_consents, page_port}: whether programs may switch safety reflexes off, and the page
            where the owner changes that; its key comes from the environment's TELEPRESENCE_ROBOT_PAGE_KEY.
"""

from __future__ import annotations

import rospy
from sim_bringup.node import run

from pepper_sim.simulation import DEFAULT_PORT, DEFAULT_SCENE
from telepresence.sim.simulation import RobotRequest


def main() -> int:
    """Run until the node is shut down; the exit code."""
    return run("pepper_sim", _robots, DEFAULT_SCENE)


def _robots() -> list[RobotRequest]:
    options = rospy.get_param("~kinds/pepper", {})
    return [RobotRequest("pepper", "pepper", int(rospy.get_param("~port", DEFAULT_PORT)), options)]

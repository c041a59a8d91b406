"""joint_angles, which the driver in C++ obeys itself: here pose_controller moves the joints, and heeds the red stop."""

from __future__ import annotations

import contextlib

import rospy
from naoqi_bridge_msgs.msg import JointAnglesWithSpeed
from telepresence_ros.past_commands import subscribe_commands

COMPLAINT_PERIOD = 5.0
"""Seconds between two warnings that nobody takes what is relayed."""


def relay_joint_angles() -> None:
    """Give what comes on joint_angles to pose_controller, on pose/joint_angles."""
    controller = rospy.Publisher("pose/joint_angles", JointAnglesWithSpeed, queue_size=10)

    def relay(message: JointAnglesWithSpeed) -> None:
        if not controller.get_num_connections():
            # That it moves nothing is not sure: in the root namespace pose_controller takes joint_angles itself.
            rospy.logwarn_throttle(
                COMPLAINT_PERIOD, f"joint_angles goes no farther: nobody takes {controller.resolved_name}"
            )
        with contextlib.suppress(rospy.ROSException):  # the topic was closed: this node is being shut down
            controller.publish(message)

    subscribe_commands("joint_angles", JointAnglesWithSpeed, relay, queue_size=10)

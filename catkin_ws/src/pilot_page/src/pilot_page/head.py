"""Where a robot's head points, for the page; nothing for a robot that has none.

Subscribes: head/state (telepresence_msgs/HeadState) of its driver; the camera's calibration (sensor_msgs/CameraInfo),
            once: how many radians a drag across the picture is.
"""

from __future__ import annotations

import math
import time
from typing import Any

import rospy
from sensor_msgs.msg import CameraInfo
from telepresence_msgs.msg import HeadState as HeadStateMessage

from telepresence.teleop.looking import HEAD_LIFE, HeadState, read_head_state
from telepresence.teleop.robot_readings import camera_info_of, read_lens


class Head:
    """The newest state of one head.

    Args:
        topic, picture: Full names of the topics of its state and of what it sees.
    """

    def __init__(self, topic: str, picture: str) -> None:
        self._state: HeadState | None = None
        self._span: list[float] | None = None
        rospy.Subscriber(topic, HeadStateMessage, self._on_state, queue_size=1, tcp_nodelay=True)
        self._calibration = rospy.Subscriber(camera_info_of(picture), CameraInfo, self._on_calibration, queue_size=1)

    def state(self) -> dict[str, Any] | None:
        """Return what the page shows of it, as JSON's types: angles [rad], yaw to the left, pitch down; `span` is how
        much the picture shows, across and down [rad], or null."""
        state = self._state
        if state is None or time.monotonic() - state.arrived > HEAD_LIFE:
            return None
        angles = {name: round(getattr(state, name), 3) for name in ("yaw", "pitch", "left", "up", "down", "ahead")}
        return angles | {"span": self._span, "problem": state.problem}

    def _on_state(self, message: HeadStateMessage) -> None:
        try:
            self._state = read_head_state(message, time.monotonic())
        except ValueError as error:
            rospy.logwarn_throttle(10.0, "head/state cannot be read: %s", error)

    def _on_calibration(self, message: CameraInfo) -> None:
        try:
            lens = read_lens(message, time.monotonic())
        except ValueError:
            return  # it is not calibrated: the page assumes what most cameras show
        pairs = (lens.width, lens.fx), (lens.height, lens.fy)
        self._span = [round(2.0 * math.atan2(size, 2.0 * focal), 4) for size, focal in pairs]
        self._calibration.unregister()

"""What one robot sees of the floor: odometry, calibration and transforms, as `telepresence.page.floor.Floor`."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import rospy
from nav_msgs.msg import Odometry
from sensor_msgs.msg import CameraInfo
from telepresence_msgs.msg import SafetyState
from telepresence_ros.transforms import Transforms

from telepresence.safety.robot_profile import RobotProfile
from telepresence.teleop.camera_view import camera_view
from telepresence.teleop.robot_readings import (
    BodyState,
    CameraView,
    Lens,
    Safety,
    read_lens,
    read_odometry,
    read_safety,
)
from telepresence.video.images import LatestImage


class RobotFloor:
    """Reads on rospy's threads; whoever asks gets the newest reading.

    Args:
        namespace: Of the robot, whose transforms may be there.
        lens: Topic of its camera's calibration.
        picture: Its newest picture.
    """

    def __init__(self, namespace: str, lens: str, profile: RobotProfile, farthest: float, picture: LatestImage) -> None:
        self.farthest = farthest
        self.radius = profile.outline.outer_radius
        self.top_speed, self.top_turn = profile.limits.max_speed, profile.limits.max_turn
        self._namespace, self._lens_topic, self._picture = namespace.rstrip("/"), lens, picture
        self._lens: Lens | None = None
        self._body: BodyState | None = None
        self._safety: Safety | None = None
        self._transforms = Transforms(namespace, _subscribe_all)
        self._topics: list[rospy.Subscriber] = []

    @property
    def body(self) -> BodyState | None:
        """The newest odometry."""
        return self._body

    @property
    def safety(self) -> Safety | None:
        """The newest word of the safety gate."""
        return self._safety

    def newest(self) -> float | None:
        """Return when the newest picture was taken [s since 1970]."""
        picture = self._picture.peek()
        return picture.stamp if picture is not None else None

    def view(self, stamp: float) -> CameraView | str:
        """Return the camera's view in odom at that time [s since 1970]; or why it is unknown."""
        return camera_view(self._lens, self._body, self._transforms.place_of, stamp)

    def watch(self, wanted: bool) -> None:
        """Read only while somebody looks."""
        self._transforms.listen(wanted)
        if wanted and not self._topics:
            self._topics = [
                self._subscribe("odom", Odometry, self._on_odometry),
                self._subscribe(self._lens_topic, CameraInfo, self._on_lens),
            ]
        elif not wanted:
            while self._topics:
                self._topics.pop().unregister()

    def on_gate(self, message: SafetyState) -> None:
        """Take what the safety gate says."""
        self._safety = _read(read_safety, message) or self._safety

    def _subscribe(self, name: str, kind: type, callback: Callable[[Any], None]) -> rospy.Subscriber:
        topic = name if name.startswith("/") else f"{self._namespace}/{name}"
        return rospy.Subscriber(topic, kind, callback, queue_size=1, tcp_nodelay=True)

    def _on_odometry(self, message: Odometry) -> None:
        self._body = _read(read_odometry, message) or self._body

    def _on_lens(self, message: CameraInfo) -> None:
        self._lens = _read(read_lens, message) or self._lens


def _read(read: Callable[[Any, float], Any], message: Any) -> Any:
    """Return what a message says; None for one that no robot sends."""
    try:
        return read(message, time.monotonic())
    except ValueError as error:
        rospy.logwarn_throttle(10.0, "a message of the robot cannot be read: %s", error)
        return None


def _subscribe_all(topic: str, kind: type, callback: Callable, extra: str) -> rospy.Subscriber:
    """Subscribe without losing messages of a burst; `callback` gets each message and `extra`."""
    return rospy.Subscriber(topic, kind, callback, callback_args=extra, queue_size=100)

"""Goals in frames that NAOqi does not know, such as map: where they are in the odometry's frame, by tf."""

from __future__ import annotations

import math
import threading
import time
from functools import partial

import rospy

from telepresence.geometry import Pose

TRANSFORM_TIMEOUT = 1.0
"""Seconds within which the transforms must come: localisation repeats map -> odom at least five times a second."""
POLL_PERIOD = 0.05
ODOMETRY = "odom"


def to_odometry(frame: str, goal: Pose, given_up: threading.Event) -> Pose:
    """Return a goal of `frame` in the odometry's frame [m, m, rad], by the newest transforms.

    It listens to them only while it waits: they come 75 times a second, and this is the program that drives.

    Args:
        given_up: Ends the waiting.
    Raises:
        LookupError: tf does not lead from the frame to odom; the message says why.
    """
    # Of no use to who drives by velocities, and it takes a while.
    from telepresence_ros.transforms import Transforms

    transforms = Transforms(rospy.get_namespace(), _subscribe)
    transforms.listen(True)
    try:
        rotation, origin = _wait(partial(transforms.place_of, frame, ODOMETRY, 0.0), given_up)
    finally:
        transforms.listen(False)
    x, y, _ = origin + rotation @ (goal.x, goal.y, 0.0)
    ahead = rotation @ (math.cos(goal.theta), math.sin(goal.theta), 0.0)
    return Pose(float(x), float(y), math.atan2(ahead[1], ahead[0]))


def _wait(look, given_up: threading.Event):
    deadline = time.monotonic() + TRANSFORM_TIMEOUT
    while True:
        try:
            return look()
        except LookupError:
            if time.monotonic() > deadline or given_up.wait(POLL_PERIOD):
                raise


def _subscribe(topic: str, kind: type, callback, argument: str) -> rospy.Subscriber:
    return rospy.Subscriber(topic, kind, callback, argument, queue_size=100, tcp_nodelay=True)

"""move_base_simple/goal: goals in, to the base once it is known where they are. See `naoqi_driver.goal_frames`."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from typing import NamedTuple

import rospy
from geometry_msgs.msg import PoseStamped
from telepresence_ros.node import Node
from telepresence_ros.past_commands import subscribe_commands

from naoqi_driver.base import BaseDriver
from naoqi_driver.connection import RobotError
from naoqi_driver.goal_frames import ODOMETRY, to_odometry
from telepresence.geometry import Pose, yaw_of

MAX_AGE = 1.0
"""Seconds after which a goal is refused: who waits longer has given it up. One without a stamp is as old as our having
it."""
OWN_FRAMES = ("base_footprint", "base_link")
"""A goal in these is relative to where the robot stands."""
REPLACED = "goal refused: another one has come"
PERIOD = 0.5
"""Seconds between two looks whether the node ends."""


class Given(NamedTuple):
    """A goal as it came.

    Args:
        at: When [s, monotonic].
        mark: `BaseDriver.this_moment` of then: what ends goals afterwards ends this one, too.
    """

    goal: PoseStamped
    at: float
    mark: object


class GoalTopic:
    """Takes goals; only the newest one counts, and it ends the search for the place of the one before.

    Args:
        wake: Called when the base has a goal, or has not got one.
    """

    def __init__(self, node: Node, base: BaseDriver, wake: Callable[[], None]) -> None:
        self._node, self._base, self._wake = node, base, wake
        self._lock = threading.Lock()  # protects the newest
        self._newest: Given | None = None
        self._has_come = threading.Event()
        subscribe_commands("move_base_simple/goal", PoseStamped, self._on_goal)

    def loop(self) -> None:
        """Work on goals until the node ends. It gives no sign of life: what drives must not end because tf is slow."""
        while not self._node.stop.is_set():
            self._has_come.wait(PERIOD)
            with self._lock:
                self._has_come.clear()
                given, self._newest = self._newest, None
            if given is not None:
                self._go_to(given)
                self._wake()

    def _on_goal(self, goal: PoseStamped) -> None:
        # The mark is of this moment: a stop that comes while the goal waits for its turn must end it.
        given = Given(goal, time.monotonic(), self._base.this_moment())
        with self._lock:
            before, self._newest = self._newest, given
            self._has_come.set()
        if before is not None:
            rospy.logwarn(REPLACED)

    def _go_to(self, given: Given) -> None:
        goal = given.goal
        frame = goal.header.frame_id.lstrip("/")
        x, y, q = goal.pose.position.x, goal.pose.position.y, goal.pose.orientation
        theta = yaw_of(q.w, q.x, q.y, q.z)
        if not all(math.isfinite(part) for part in (x, y, theta)):
            rospy.logerr("goal refused: %s, %s, %s is not a place", x, y, theta)
            return
        if (age := age_of(given, time.monotonic())) > MAX_AGE:
            rospy.logwarn("goal refused: it was given %.1f s ago; if it was not, set the clock of its sender", age)
            return
        place = Pose(x, y, theta)
        try:
            if frame not in (ODOMETRY, *OWN_FRAMES):
                place, frame = to_odometry(frame, place, self._has_come), ODOMETRY
            self._base.go_to(*place, in_odometry=frame == ODOMETRY, given=given.mark)
        except (RobotError, LookupError) as error:
            if self._has_come.is_set():
                rospy.logwarn(REPLACED)
            else:
                rospy.logerr("goal refused: %s", error)


def age_of(given: Given, now: float) -> float:
    """Seconds since a goal was given, as far as we can know."""
    stamp = given.goal.header.stamp
    return max(now - given.at, 0.0 if stamp.is_zero() else (rospy.Time.now() - stamp).to_sec())

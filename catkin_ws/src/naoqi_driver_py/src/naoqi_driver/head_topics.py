"""The head's topics: where the pilot looks in, where the head points out. See `naoqi_driver.head_driver`.

Subscribes: head/look (telepresence_msgs/HeadLook) of drive_lease; drive/state (DriveState): whether there is a pilot.
Publishes:  head/state (telepresence_msgs/HeadState).
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import rospy
from telepresence_msgs.msg import DriveState, HeadLook, HeadState
from telepresence_ros.node import Node
from telepresence_ros.past_commands import subscribe_commands

from naoqi_driver.connection import Connection, RobotError
from naoqi_driver.head import LARGEST_YAW, limits_at
from naoqi_driver.head_driver import HeadDriver
from telepresence.security.outside_text import clean
from telepresence.teleop.looking import read_look
from telepresence.teleop.stale_command_filter import BURST_ROOM, StaleCommandFilter

PERIOD = 0.05
"""Seconds between two steps while the head turns."""
IDLE_PERIOD = 0.5
"""Seconds between two looks at a head that nobody turns."""
STATE_PERIOD = 0.1
"""Seconds between two messages about where the head is, while it turns and for a moment afterwards."""
AFTERWARDS = 1.0


class HeadTopics:
    """Joins the topics and the head.

    Args:
        ahead: Pitch of looking straight ahead [rad, positive down].
        asleep: Whether the robot sleeps.
        late: Finds looks that the network held up; it is told when the master is lost.
        ended: See `HeadDriver`.
    """

    def __init__(
        self,
        node: Node,
        connection: Connection,
        ahead: float,
        asleep: Callable[[], bool],
        late: StaleCommandFilter,
        ended: str,
    ) -> None:
        self._node, self._ahead, self._asleep, self._late = node, ahead, asleep, late
        self.head = HeadDriver(connection, ahead, ended)
        self._wake = threading.Event()
        self._state_due = 0.0
        self._turned = -AFTERWARDS
        self._states = rospy.Publisher("head/state", HeadState, queue_size=1)
        subscribe_commands("head/look", HeadLook, self._on_look, queue_size=BURST_ROOM)
        rospy.Subscriber("drive/state", DriveState, self._on_lease, queue_size=1)

    def loop(self) -> None:
        """Turn the head until the node ends."""
        while not self._node.stop.is_set():
            now = time.monotonic()
            if self.head.looks(now):
                self._turned = now
            lively = now - self._turned <= AFTERWARDS
            self._wake.wait(PERIOD if lively else IDLE_PERIOD)
            self._wake.clear()
            self.head.step(time.monotonic(), self._asleep())
            self._report(time.monotonic(), STATE_PERIOD if lively else IDLE_PERIOD)
        try:
            self.head.close()
        except RobotError as error:
            rospy.logdebug("%s", error)

    def _on_look(self, message: HeadLook) -> None:
        now = time.monotonic()
        if self._late.is_stale(now):
            rospy.logwarn_throttle(5.0, "looks that the network held up are refused")
            return
        try:
            look = read_look(message.manner, message.yaw, message.pitch)
        except ValueError as error:
            rospy.logwarn_throttle(5.0, "head/look: %s", error)
            return
        self.head.look(look, now)
        self._wake.set()

    def _on_lease(self, message: DriveState) -> None:
        if message.pilot:
            self.head.piloted(time.monotonic())

    def _report(self, now: float, period: float) -> None:
        if now < self._state_due:
            return
        self._state_due = now + period * 0.9  # the loop wakes a little early, too
        try:
            self.head.measure()
        except RobotError as error:
            rospy.logdebug("%s", error)
        if self.head.angles is None:
            return
        yaw, pitch = self.head.angles
        limits = limits_at(yaw)
        message = HeadState(
            yaw=yaw,
            pitch=pitch,
            left=LARGEST_YAW,
            up=limits.up,
            down=limits.down,
            ahead=self._ahead,
            problem=clean(self.head.problem),
        )
        message.header.stamp = rospy.Time.now()
        self._states.publish(message)

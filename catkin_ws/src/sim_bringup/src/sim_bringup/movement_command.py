"""movement_command: 0 stop, 1 forward, 2 backward, until the next one.

A command needs no repetition, so what makes it safe is who stands behind it: the robot stops when the program that sent
the command is gone, when a value comes that means nothing, and at a restart, after which a command that is still
latched has to be sent again. A flood costs nothing, because
only the newest command counts. A window that drives by velocities only reports here, and its reports move nothing
(`telepresence.teleop.movement`). What the robot does goes through its driver, with the safety gate in between; a robot
without a driver is commanded directly.
"""

from __future__ import annotations

import math
import threading
import time
from typing import Protocol

import rospy
from geometry_msgs.msg import Twist
from std_msgs.msg import Int32
from telepresence_ros.past_commands import PastCommands

from telepresence.sim.simulated_robot import Controls
from telepresence.teleop.movement import Movement, only_reports

PERIOD = 0.1
"""Seconds between two commands to a driver; it gives up after 0.5 s of silence."""
LEAST_PERIOD = 0.02
"""Shortest time between two commands to a driver, however often they change [s]."""
ZEROS = 3
"""How many zeros a driver gets for a stop; then others may drive."""
GRACE = 0.5
"""Whoever sent the command may be gone so long [s]."""


class Mover(Protocol):
    REPEATS: bool
    """Whether what it moves stops by itself: then a movement is handed on every `PERIOD`, and after it STOP `ZEROS`
    times. Else each command is handed on once when it comes, so that the newest one counts whoever else commands."""

    def move(self, movement: Movement) -> None:
        """Move so."""


class DriverMover:
    """Drives through a topic of geometry_msgs/Twist.

    Args:
        topic: "" when there is no driver: then nothing moves.
        speed: [m/s].
    """

    REPEATS = True

    def __init__(self, topic: str, speed: float) -> None:
        self._speed = speed
        self._publisher = rospy.Publisher(topic, Twist, queue_size=1) if topic else None

    def move(self, movement: Movement) -> None:
        if self._publisher is None:
            rospy.logwarn_throttle(10.0, "movement_command: which driver? Set the parameter ~wires/<robot>/cmd_vel")
            return
        twist = Twist()
        twist.linear.x = {Movement.FORWARD: self._speed, Movement.BACKWARD: -self._speed}.get(movement, 0.0)
        self._publisher.publish(twist)


class DirectMover:
    """Moves a robot that has no wire."""

    REPEATS = False

    def __init__(self, controls: Controls) -> None:
        self._controls = controls

    def move(self, movement: Movement) -> None:
        self._controls.move(movement)


class Movements:
    """Takes movement commands from `topic` and hands them to `mover` on a thread of its own."""

    def __init__(self, topic: str, mover: Mover) -> None:
        self._mover = mover
        self._changed = threading.Condition()
        self._wanted = Movement.STOP
        self._sender = ""
        self._left = 0.0
        """How often that is still to be handed on."""
        self.refused = 0
        """Commands that meant nothing."""
        self._past = PastCommands(topic)
        self._subscriber = rospy.Subscriber(topic, Int32, self._take, queue_size=1)

    def stop(self) -> bool:
        """Stop now; whether the robot was moving."""
        with self._changed:
            moving = self._wanted is not Movement.STOP
            self._want(Movement.STOP)
        return moving

    def run(self, stop: threading.Event) -> None:
        """Hand commands on until `stop` is set."""
        alive_at = time.monotonic()
        while not stop.is_set():
            with self._changed:
                if self._wanted is Movement.STOP and not self._left:
                    self._changed.wait(PERIOD)
                    alive_at = time.monotonic()
                    continue
                now = time.monotonic()
                if self._sender_lives():
                    alive_at = now
                elif self._wanted is not Movement.STOP and now - alive_at > GRACE:
                    rospy.logwarn("movement_command: whoever made the robot move is gone; it stops")
                    self._want(Movement.STOP)
                movement, due = self._wanted, self._left > 0
                self._left -= due
            try:
                if due:
                    self._mover.move(movement)
            except rospy.ROSException:
                return  # the topic was closed: this node is being shut down
            stop.wait(LEAST_PERIOD)
            self._wait_for_other(movement)

    def _wait_for_other(self, movement: Movement) -> None:
        with self._changed:
            self._changed.wait_for(
                lambda: self._wanted is not movement or (self._left and not self._mover.REPEATS), PERIOD - LEAST_PERIOD
            )

    def _take(self, message: Int32) -> None:
        if only_reports(message._connection_header):
            return
        if self._past.is_past(message) and message.data != Movement.STOP:
            rospy.logwarn("movement_command: a command from before this program listened is not obeyed; send it again")
            return
        with self._changed:
            try:
                self._want(Movement(message.data))
                self._sender = message._connection_header["callerid"]
            except ValueError:
                self.refused += 1
                self._want(Movement.STOP)
                meaning = "0 stop, 1 forward, 2 backward"
                rospy.logwarn_throttle(5.0, f"movement_command {message.data} means nothing, so it stops: {meaning}")

    def _sender_lives(self) -> bool:
        """Whether the node that sent the last command is still connected; others on the topic do not count."""
        topic = self._subscriber.impl  # None once the node shuts down
        return topic is not None and any(link.callerid_pub == self._sender for link in topic.connections or ())

    def _want(self, movement: Movement) -> None:
        """Change the movement. The caller holds the lock."""
        if not self._mover.REPEATS:
            self._left = 1
        elif movement is not Movement.STOP:
            self._left = math.inf
        elif self._wanted is not Movement.STOP:  # else others drive, and this topic has nothing to end
            self._left = ZEROS
        self._wanted = movement
        self._changed.notify()

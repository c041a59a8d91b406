"""Carries out what `naoqi_driver.head` decides: ALMotion.setAngles, and the end of the robot's own movements meanwhile.

One thread calls `step`, another one, which may wait for the robot, `supervise`.
"""

from __future__ import annotations

import math
import threading

from naoqi_driver.connection import Connection, RobotError
from naoqi_driver.head import JOINTS, HeadMotion
from naoqi_driver.idle_movement import BASE_MOVEMENTS, HEAD_MOVEMENTS, SEPARATOR, IdleMovement
from naoqi_driver.replies import numbers
from telepresence.geometry import Velocity
from telepresence.teleop.looking import Look

ANSWER_TIME = 0.3
"""Seconds within which ALMotion takes an angle; else the next one is as good."""
FORGOTTEN = 1.0
"""Seconds after the last look from which on the head is asked where it is, before it turns again."""
HOLD_PERIOD = 2.0
"""Seconds between two looks whether something else moves the head, or the base, again."""
PILOT_GONE = 3.0
"""Seconds without a pilot after which the robot may move by itself again; a window that reconnects is back sooner."""


class HeadDriver:
    """Turns the head of one robot.

    Args:
        ahead: Pitch of looking straight ahead [rad, positive down].
        ended: What `ended` said in a driver that has died since.
    Attributes:
        angles: Yaw and pitch [rad] as measured lately; None before.
        problem: Why the head cannot be turned, a sentence; empty while it can.
    """

    def __init__(self, connection: Connection, ahead: float, ended: str = "") -> None:
        self._connection = connection
        self._motion = HeadMotion(ahead)
        self._idle = IdleMovement(connection, HEAD_MOVEMENTS, ended)
        self._base_idle = IdleMovement(connection, BASE_MOVEMENTS, ended)
        self._lock = threading.Lock()  # protects the motion
        self._holding = threading.Lock()  # protects what moves by itself, also while the robot is waited for
        self._closed = False
        self._begun = math.inf
        self._looked = self._driven = self._piloted = self._held = -math.inf
        self._wants_idle_off = False
        self.angles: tuple[float, float] | None = None
        self.problem = ""

    def look(self, look: Look, now: float) -> None:
        """Take where the pilot wants to look."""
        with self._lock:
            self._motion.look(look, now)
        first = not self._wants_idle_off
        self._looked, self._wants_idle_off = now, True
        if first:
            self._held = -math.inf  # at once, whenever the base's movements were ended

    def drives(self, velocity: Velocity, now: float) -> None:
        """Take the velocity that is commanded."""
        with self._lock:
            self._motion.drives(velocity, now)
        if any(velocity):
            self._driven = now

    def piloted(self, now: float) -> None:
        """Somebody has the robot."""
        self._piloted = now

    def looks(self, now: float) -> bool:
        """Whether the head is being turned."""
        with self._lock:
            return self._motion.looks(now)

    def step(self, now: float, asleep: bool) -> None:
        """Turn the head on; on each look, and 20 times a second while one counts."""
        if self._connection.problem or asleep:
            self.problem = self._connection.problem or "The robot sleeps, and cannot turn its head. Wake it up."
            with self._lock:
                self._motion.forget()
            return
        self.problem = ""
        try:
            if self.looks(now) and self._motion.needs_angles:
                self.measure()
                with self._lock:
                    self._motion.place(*self.angles or (0.0, 0.0))
            with self._lock:
                steps = self._motion.step(now)
                if now - self._looked > FORGOTTEN:
                    self._motion.forget()
            for step in steps:
                self._connection.call("ALMotion", "setAngles", *step, timeout=ANSWER_TIME)
        except RobotError as error:
            self.problem = str(error)

    def measure(self) -> None:
        """Ask where the head is.

        Raises:
            RobotError: See `Connection.call`.
        """
        reply = self._connection.call("ALMotion", "getAngles", list(JOINTS), True, timeout=ANSWER_TIME)
        yaw, pitch = numbers(reply, len(JOINTS), "getAngles")
        self.angles = yaw, pitch

    @property
    def ended(self) -> str:
        """What moves the robot by itself and was ended, to be resumed."""
        return SEPARATOR.join(filter(None, (self._idle.ended, self._base_idle.ended)))

    def supervise(self, now: float) -> None:
        """As long as somebody has the robot, or drives it, end what turns the base by itself; from the pilot's first
        look on what moves the head, too.

        Raises:
            RobotError: See `Connection.call`.
        """
        with self._holding:
            if self._closed:
                return
            self._begun = min(self._begun, now)
            if now - max(self._piloted, self._looked, self._driven) > PILOT_GONE:
                # Of a pilot whose driver has died its successor hears a little later.
                if now - self._begun > PILOT_GONE:
                    self._wants_idle_off = False
                    self._let_go()
            elif now - self._held > HOLD_PERIOD:
                self._held = now
                self._base_idle.hold()
                if self._wants_idle_off:
                    self._idle.hold()

    def close(self) -> None:
        """Let the robot move by itself again as it did before, and end it no more.

        Raises:
            RobotError: See `Connection.call`.
        """
        with self._holding:
            self._closed = True
            self._let_go()

    def _let_go(self) -> None:
        self._held = -math.inf
        self._idle.resume()
        self._base_idle.resume()

"""Reads Pepper's range sensors, bumpers and odometry for the safety gate.

Wire (NAOqi 2.8 documentation, laser_pep, sonar_pep, bumper_pep): ALMemory keys below
`Device/SubDeviceList/Platform`, read with one `getListData`: the points of the three horizontal laser lines
(`naoqi_driver.laser_points`), renewed every 160 ms;
`LaserSensor/{Front,Left,Right}/Reg/FrameCount/Sensor/Value`, which counts measurements;
`{Front,Back}/Sonar/Sensor/Value` [m], every 100 ms while somebody is subscribed to ALSonar;
`{FrontLeft,FrontRight,Back}/Bumper/Sensor/Value`, 1 when pressed.
`ALMotion.getRobotPosition(True)` is x, y, theta of the odometry [m, m, rad].

ALMemory keeps the last value of a device that has died. A new measurement differs from an old one in the frame
counter, or, where a robot doesn't count, a value that has changed.
"""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeGuard

import numpy as np

from naoqi_driver.connection import CallRefused, Connection, RobotError
from naoqi_driver.laser_points import LINES, clean, keys, to_base
from naoqi_driver.replies import numbers, sequence
from naoqi_driver.robot_facts import SEGMENTS
from telepresence.safety import PEPPER, UNKNOWN, Odometry

log = logging.getLogger(__name__)

PERIOD = 0.05
"""Seconds between two questions."""
CALL_TIMEOUT = 0.4
SONAR_SUBSCRIBER = "TelepresenceGate"
_PLATFORM = "Device/SubDeviceList/Platform"
LASERS = {"front laser": LINES["srd_front"], "left laser": LINES["srd_left"], "right laser": LINES["srd_right"]}
"""Lines by their names in the gate's profile."""
SONARS = {"front sonar": "Front", "back sonar": "Back"}
BUMPERS = {"FrontLeft": math.atan2(0.227, 0.129), "FrontRight": math.atan2(-0.227, 0.129), "Back": math.pi}
"""Direction of each in base_footprint [rad]: frames BumperFL, BumperFR and BumperB of Pepper's URDF."""

KEYS: list[str] = [
    *(key for line in LASERS.values() for key in keys(line)),
    *(f"{_PLATFORM}/LaserSensor/{line.frame.side}/Reg/FrameCount/Sensor/Value" for line in LASERS.values()),
    *(f"{_PLATFORM}/{side}/Sonar/Sensor/Value" for side in SONARS.values()),
    *(f"{_PLATFORM}/{side}/Bumper/Sensor/Value" for side in BUMPERS),
]
_COUNTS = 2 * SEGMENTS * len(LASERS)
_SONARS = _COUNTS + len(LASERS)
_BUMPERS = _SONARS + len(SONARS)


class Reading(NamedTuple):
    """One answer of the robot.

    Args:
        odometry: Where it stood, with the time of the question on the monotonic clock.
        points: Per laser that has measured anew: (15, 2) points in base_footprint, leftmost first [m]; a segment that
            says nothing is a point in its camera.
        ranges: Per sonar that has measured anew [m]; `telepresence.safety.UNKNOWN` if it says nothing.
        pressed: Directions of the bumpers that are pressed [rad].
    """

    odometry: Odometry
    points: dict[str, np.ndarray]
    ranges: dict[str, float]
    pressed: tuple[float, ...]


class Reader:
    """Makes readings of what `getListData` answers for `KEYS`; remembers what was measured last."""

    def __init__(self) -> None:
        self._news = {name: _News(PEPPER.source(name).period) for name in (*LASERS, *SONARS)}

    def read(self, values: Any, position: Any, stamp: float) -> Reading:
        """
        Args:
            values: What getListData answered; a value that is no number is one of a sensor that says nothing.
            position: What getRobotPosition answered: x, y, theta of the odometry [m, m, rad].
            stamp: When the robot was asked [s, monotonic].
        Raises:
            UnexpectedReply: The number of values does not fit, or the position is none.
        """
        values = sequence(values, "sensor values", len(KEYS))
        x, y, theta = numbers(position, 3, "getRobotPosition")
        points: dict[str, np.ndarray] = {}
        ranges: dict[str, float] = {}
        for index, (name, line) in enumerate(LASERS.items()):
            own = values[2 * SEGMENTS * index : 2 * SEGMENTS * (index + 1)]
            if self._news[name].is_new(stamp, own, values[_COUNTS + index]):
                points[name] = to_base(clean(own), line.frame)
        for index, name in enumerate(SONARS):
            value = values[_SONARS + index]
            if self._news[name].is_new(stamp, [value], None):
                # A sonar that has never pinged holds 0; a real echo is never nearer than 0.25 m.
                ranges[name] = UNKNOWN if not _is_number(value) or value <= 0.0 else float(value)
        pressed = tuple(
            bearing
            for value, bearing in zip(values[_BUMPERS:], BUMPERS.values(), strict=True)
            if _is_number(value) and value > 0.5
        )
        return Reading(Odometry(x, y, theta, stamp), points, ranges, pressed)


class _News:
    """Whether a device has measured since the last question.

    A counter is believed once it has been seen counting; some robots may not keep one.
    """

    def __init__(self, period: float) -> None:
        self._period = period
        self._values: list | None = None
        self._count: object = None
        self._counts = False
        self._newest = -math.inf

    def is_new(self, stamp: float, values: Sequence[object], count: object) -> bool:
        values = list(values)
        counted = _is_number(count) and _is_number(self._count) and count != self._count
        self._counts, self._count = self._counts or counted, count
        changed, self._values = values != self._values, values
        believes = self._counts and _is_number(count)
        new = counted if believes else changed or stamp - self._newest >= self._period
        if new:
            self._newest = stamp
        return new


class RangeSensorReader:
    """Asks the robot on a thread of its own, so that no velocity waits for a sensor.

    Args:
        connection: The link to the robot.
        receive: Called with every reading, on that thread.
    """

    def __init__(self, connection: Connection, receive: Callable[[Reading], None]) -> None:
        self.problem = "not asked yet"
        """Why there is no reading now; empty if there is one."""
        self._connection = connection
        self._receive = receive
        self._reader = Reader()
        self._link = 0
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="sensor-watch", daemon=True)

    def start(self) -> RangeSensorReader:
        self._thread.start()
        return self

    def close(self) -> None:
        """End the thread, and let the sonars rest if nobody else wants them."""
        self._stop.set()
        if self._thread.ident is not None:
            self._thread.join(timeout=1.0)
        if self._link and self._link == self._connection.connections and self._connection.connected:
            try:
                self._connection.call("ALSonar", "unsubscribe", SONAR_SUBSCRIBER, timeout=CALL_TIMEOUT)
            except RobotError as error:
                log.debug("%s", error)

    def _run(self) -> None:
        due = time.monotonic()
        while not self._stop.wait(max(0.0, due - time.monotonic())):
            due = max(due + PERIOD, time.monotonic())
            try:
                if self._link != self._connection.connections:
                    self._greet()
                self._receive(self._ask())
                self.problem = ""
            except RobotError as error:
                self.problem = str(error)

    def _greet(self) -> None:
        """First words on a new link: what was measured before it is another robot's life."""
        link = self._connection.connections
        self._reader = Reader()
        try:
            self._connection.call("ALSonar", "subscribe", SONAR_SUBSCRIBER)
        except CallRefused as error:
            # From NAOqi 2.9 on they are on without it (ros-naoqi/naoqi_driver).
            log.debug("the sonars may be off: %s", error)
        self._link = link

    def _ask(self) -> Reading:
        stamp = time.monotonic()
        position = self._connection.call_async("ALMotion", "getRobotPosition", True)
        values = self._connection.call("ALMemory", "getListData", KEYS, timeout=CALL_TIMEOUT)
        return self._reader.read(values, position.result(CALL_TIMEOUT), stamp)


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float)

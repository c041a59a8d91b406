"""Docking: the behaviours by which the robot finds its charging station, drives onto it and leaves it.

The station is found by the lower camera of the head and by nothing else.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from pepper_sim.navigation.behaviours import TRAVELLING, Behaviour, Driver, Wheels
from pepper_sim.navigation.glance import glance
from pepper_sim.navigation.scans import compose, relative
from pepper_sim.navigation.station_finder import find_station
from pepper_sim.navigation.surveyor import Surveyor
from pepper_sim.robot import Pepper
from telepresence.geometry import Pose

OK, UNSAFE, NOT_FOUND, ON_STATION, NO_HYPOTHESIS = range(5)
NOT_CONNECTED, ASLEEP, NOT_IN_FRONT, BUSY = range(7, 11)
"""Error codes (NAOqi 2.8 documentation, ALRecharge)."""
IDLE, LOOKING, APPROACHING, DOCKING = range(4)
LEAVING = 6
"""Status (the same page)."""

IN_FRONT = 0.6
"""The robot stops so far in front of its place on the station [m] (the same documentation, overview)."""
IN_FRONT_XY, IN_FRONT_THETA = 0.12, 0.25
"""It is in front of the station when it is so near that place [m, rad]."""
BACKWARDS = (0.2, 0.4)
"""Speeds of docking [m/s, rad/s]: "reduced"."""
HEADINGS = (0.0, 0.8, -0.8)
"""Directions of the head that together see half of the surroundings [rad]."""
TURN = math.radians(120.0)
"""Turn of the base between two looks around."""

_CAMERA, _WIDTH, _HEIGHT = "CameraBottom", 640, 480
_FAR, _CLOSE = -0.3, 0.0  # pitch of the head for a station across the room and for one just ahead [rad]
_CONNECTING = 2.0  # seconds until the battery knows that a charger is connected


class Docking:
    """One robot and its charging station.

    Attributes:
        station: Where the robot stands on its station, by odometry; None until it was found.
    """

    def __init__(
        self,
        robot: Pepper,
        surveyor: Surveyor,
        driver: Driver,
        wheels: Wheels,
        report: Callable[[str, Any], None],
    ) -> None:
        """`report` receives events by their name in the documentation, such as "StationDetected", and "status"."""
        self.station: Pose | None = None
        self.tries = 3
        self._robot = robot
        self._surveyor = surveyor
        self._driver = driver
        self._wheels = wheels
        self._report = report

    @property
    def connected(self) -> bool:
        """Whether the station charges the robot."""
        return self._robot.snapshot().battery.plugged

    def look(self) -> Behaviour[int]:
        """Search the station: in front, then on both sides after a turn each."""
        self._report("status", LOOKING)
        if problem := self._problem():
            return problem
        if self._robot.has_cameras:
            for turn in range(3):
                for yaw in HEADINGS:
                    if (yield from self._glance(yaw, _FAR)):
                        return OK
                if turn < 2 and not (yield from self._drive(Pose(0.0, 0.0, TURN), TRAVELLING)):
                    return UNSAFE
        self._report("StationNotFound", [])
        return NOT_FOUND

    def approach(self) -> Behaviour[int]:
        """Drive in front of the station, looking at it."""
        self._report("status", APPROACHING)
        if problem := self._problem():
            return problem
        for _ in range(self.tries):
            if self.station is None:
                return NO_HYPOTHESIS
            goal = relative(self._surveyor.odometry(), self._front())
            yield from self._driver.drive_near(goal.x, goal.y, goal.theta)
            if not (yield from self._glance(0.0, _CLOSE)):
                continue
            if self._in_front():
                return OK
        return UNSAFE

    def dock(self) -> Behaviour[int]:
        """Turn around and drive onto the station, backwards."""
        self._report("status", DOCKING)
        if problem := self._problem():
            return problem
        if self.station is None:
            return NO_HYPOTHESIS
        yield from self._glance(0.0, _CLOSE)
        if not self._in_front():
            return NOT_IN_FRONT
        place = relative(self._surveyor.odometry(), self.station)
        self._report("DockingUTurnStarted", place.theta)
        if not (yield from self._drive(Pose(0.0, 0.0, place.theta), TRAVELLING)):
            return UNSAFE
        self._report("DockingBackwardStarted", [])
        protected, self._robot.security.enabled = self._robot.security.enabled, False
        try:
            yield from self._drive(relative(self._surveyor.odometry(), self.station), BACKWARDS)
        finally:
            self._robot.security.enabled = protected
        return (yield from self._connect())

    def adjust(self, positions: list[Pose]) -> Behaviour[int]:
        """Drive small ways on the station until it charges."""
        self._report("status", DOCKING)
        if not self._robot.can_drive:
            return ASLEEP
        self._robot.hold_base("charging", False)
        for position in positions:
            yield from self._drive(position, BACKWARDS)
        return (yield from self._connect())

    def leave(self) -> Behaviour[int]:
        """Drive off the station, forwards."""
        self._report("status", LEAVING)
        if not self.connected:
            return NO_HYPOTHESIS
        self._robot.hold_base("charging", False)
        if (yield from self._drive(Pose(IN_FRONT, 0.0, 0.0), BACKWARDS)):
            self._report("CloseToChargingStation", False)
            self._report("LeaveSuccess", [])
            return OK
        self._report("LeaveFailed", [])
        return UNSAFE

    # --- inside ------------------------------------------------------------------------------------------------------

    def _problem(self) -> int:
        """Return the error code of what makes driving to the station impossible; 0 if nothing does."""
        if not self._robot.can_drive:
            return ASLEEP
        return ON_STATION if self.connected else OK

    def _connect(self) -> Behaviour[int]:
        """Wait until the station charges the robot; if it does not, drive away from it."""
        for _ in range(round(_CONNECTING / 0.08)):
            if self.connected:
                self._robot.hold_base("charging", True)
                self._report("CloseToChargingStation", True)
                self._report("ConnectedToChargingStation", [])
                self._report("DockingSuccess", [])
                return OK
            yield
        self._report("DockingFailed", [])
        if self.station is not None and math.dist(self.station[:2], self._surveyor.odometry()[:2]) < IN_FRONT:
            yield from self._drive(Pose(IN_FRONT, 0.0, 0.0), BACKWARDS)
        return NOT_CONNECTED

    def _front(self) -> Pose:
        """Return the pose in front of the station, looking at it."""
        if self.station is None:
            raise RuntimeError("the station was not found")
        return compose(self.station, Pose(IN_FRONT, 0.0, math.pi))

    def _in_front(self) -> bool:
        error = relative(self._front(), self._surveyor.odometry())
        return math.hypot(error.x, error.y) < IN_FRONT_XY and abs(error.theta) < IN_FRONT_THETA

    def _glance(self, yaw: float, pitch: float) -> Behaviour[bool]:
        """Look with the head in one direction; true if the station is there, whose place is then known anew."""
        view = yield from glance(self._robot, _CAMERA, _WIDTH, _HEIGHT, yaw, pitch)
        if view is None:
            return False
        found = find_station(view.pixels, view.focal, self._robot.link_pose(_CAMERA + "_frame"))
        if found is None:
            return False
        self.station = found
        self._report("StationDetected", list(found))
        return True

    def _drive(self, target: Pose, speeds: tuple[float, float]) -> Behaviour[bool]:
        future = self._wheels.go(*target, *speeds)
        try:
            while not future.done():
                yield
            if not future.result():
                self._report("MoveFailed", [])
            return bool(future.result())
        finally:
            if not future.done():
                self._wheels.halt()

"""ALRecharge: finding the charging station, driving onto it and leaving it.

Source: NAOqi 2.8 documentation, ALRecharge. The station is an option of the simulator; where there is none, the robot
looks for it in vain.
"""

from __future__ import annotations

import concurrent.futures
import math
from typing import Any

from pepper_sim.naoqi.service import Module, ServiceError, finite, remote
from pepper_sim.naoqi.tasks import chained
from pepper_sim.navigation.behaviours import Behaviour
from pepper_sim.navigation.docking import BUSY, IDLE, OK, UNSAFE, Docking
from pepper_sim.robot import Pepper
from pepper_sim.services.al_memory import ALMemory
from pepper_sim.services.al_navigation import ALNavigation
from telepresence.geometry import Pose

_EVENTS = (
    *("StatusChanged", "StationDetected", "StationNotFound", "ConnectedToChargingStation", "CloseToChargingStation"),
    *("DockingSuccess", "DockingFailed", "LeaveSuccess", "LeaveFailed", "SearchStopped"),
    *("DockingBackwardStarted", "DockingUTurnStarted", "MoveFailed"),
)


class ALRecharge(Module):
    """Charges the robot on its station."""

    name = "ALRecharge"

    def __init__(self, robot: Pepper, navigation: ALNavigation, memory: ALMemory) -> None:
        navigator = navigation.navigator
        self._memory = memory
        self._navigator = navigator
        self._docking = Docking(robot, navigator.surveyor, navigator.driver, navigator.wheels, self._report)
        self._status = IDLE
        self._searcher = True
        memory.declare([f"ALRecharge/{event}" for event in _EVENTS], self.name)
        robot.world.on_reset(self._forget)

    @remote("m()")
    def lookForStation(self) -> concurrent.futures.Future:
        """Looks for the station all around; returns [error code, [x, y, theta] in the world]."""
        return chained(self._run(self._docking.look()), self._with_position)

    @remote("i()")
    def moveInFrontOfStation(self) -> concurrent.futures.Future:
        """Drives in front of the station, once it was found; returns an error code."""
        return self._run(self._docking.approach())

    @remote("i()")
    def dockOnStation(self) -> concurrent.futures.Future:
        """Turns around and drives onto the station backwards; returns an error code."""
        return self._run(self._docking.dock())

    @remote("i([[f]])")
    def adjustDockingPosition(self, positions: list[list[float]]) -> concurrent.futures.Future:
        """Drives the ways [[x, y, theta], ...] one after the other to get a connection; returns an error code."""
        ways = []
        for index, position in enumerate(positions):
            if len(position) != 3:
                raise ServiceError(f"positions[{index}] must be [x, y, theta]")
            ways.append(Pose(*(finite(value, f"positions[{index}]") for value in position)))
        return self._run(self._docking.adjust(ways))

    @remote("i()")
    def goToStation(self) -> concurrent.futures.Future:
        """Looks for the station, drives to it and docks; returns an error code."""
        return self._run(self._go())

    @remote("i()")
    def leaveStation(self) -> concurrent.futures.Future:
        """Drives off the station; returns an error code."""
        return self._run(self._docking.leave())

    @remote("i()")
    def getStatus(self) -> int:
        """Returns what is being done: 0 nothing, 1 looking, 2 approaching, 3 docking, 6 leaving."""
        return self._status

    @remote("[f]()")
    def getStationPosition(self) -> list[float]:
        """Returns the pose [x, y, theta] of a docked robot in the world; zeros until the station was found."""
        return self._with_position(OK)[1]

    @remote("v()")
    def stopAll(self) -> concurrent.futures.Future | None:
        """Stops what is being done; ends itself when the robot no longer drives for it."""
        return self._navigator.stop() if self._status != IDLE else None

    @remote("b()")
    def getUseTrackerSearcher(self) -> bool:
        """Whether the search uses ALTracker's movements."""
        return self._searcher

    @remote("v(b)")
    def setUseTrackerSearcher(self, enable: bool) -> None:
        """Chooses the movements of the search. Stored only: there is one."""
        self._searcher = enable

    @remote("v(i)")
    def setMaxNumberOfTries(self, number: int) -> None:
        """Sets how often moveInFrontOfStation tries."""
        if number <= 0:
            raise ServiceError(f"number must be at least 1, got {number}")
        self._docking.tries = number

    @remote("i()")
    def getMaxNumberOfTries(self) -> int:
        """Returns how often moveInFrontOfStation tries."""
        return self._docking.tries

    # --- inside ------------------------------------------------------------------------------------------------------

    def _run(self, behaviour: Behaviour[int]) -> concurrent.futures.Future:
        if self._status != IDLE:
            behaviour.close()
            done: concurrent.futures.Future = concurrent.futures.Future()
            done.set_result(BUSY)
            return done
        return self._navigator.run(self._until_idle(behaviour), UNSAFE)

    def _until_idle(self, behaviour: Behaviour[int]) -> Behaviour[int]:
        ended = False
        try:
            code = yield from behaviour
            ended = True
        finally:
            if not ended:
                self._report("SearchStopped", [])
            self._report("status", IDLE)
        return code

    def _go(self) -> Behaviour[int]:
        for step in (self._docking.look, self._docking.approach, self._docking.dock):
            code = yield from step()
            if code != OK:
                return code
        return OK

    def _with_position(self, code: int) -> list[Any]:
        station = self._docking.station
        return [
            code,
            [0.0, 0.0, 0.0] if station is None else [station.x, station.y, math.remainder(station.theta, math.tau)],
        ]

    def _report(self, what: str, value: Any) -> None:
        if what == "status":
            if value == self._status:
                return
            self._status = value
            what = "StatusChanged"
        self._memory.announce(f"ALRecharge/{what}", value)

    def _forget(self) -> None:
        """The world was put back to its start."""
        self._docking.station = None

"""ALNavigation's free zones: circles of free floor, as [error code, radius, [x, y] in the world]."""

from __future__ import annotations

import concurrent.futures

from pepper_sim.naoqi.navigation.navigator import Navigator
from pepper_sim.naoqi.service import remote, within
from pepper_sim.navigation.behaviours import Behaviour, NotMoved
from pepper_sim.navigation.free_zone import find_free_zone
from pepper_sim.navigation.scans import Scan

FULFILLED, FAILED, NOT_FULFILLED = 0, 1, 2
"""Error codes (NAOqi 2.8 documentation, ALNavigation)."""
LARGEST = 10.0
"""Greatest radius and displacement [m]."""


class FreeZoneCalls:
    """Methods of ALNavigation about free zones."""

    def __init__(self, navigator: Navigator) -> None:
        self._navigator = navigator
        self._updating = False

    @remote("m(ff)")
    def getFreeZone(self, desiredRadius: float, displacementConstraint: float) -> list:
        """Returns the free zone around the robot as it was seen lately; the robot does not move."""
        _check(desiredRadius, displacementConstraint)
        return self._found(self._navigator.surveyor.recent(), desiredRadius, displacementConstraint)

    @remote("m(ff)")
    def findFreeZone(self, desiredRadius: float, displacementConstraint: float) -> concurrent.futures.Future:
        """Looks around for a free circle of a radius [m], not farther away than the displacement [m]."""
        _check(desiredRadius, displacementConstraint)
        return self._navigator.run(self._look(desiredRadius, displacementConstraint), [FAILED, 0.0, [0.0, 0.0]])

    @remote("m()")
    def startFreeZoneUpdate(self) -> bool:
        """Begins to collect what is seen while the client moves the robot; what was collected is forgotten."""
        self._navigator.surveyor.begin_collection()
        self._updating = True
        return True

    @remote("m(ff)")
    def stopAndComputeFreeZone(self, desiredRadius: float, displacementConstraint: float) -> list:
        """Ends the update and returns the free zone; code 1 if none ran. An update lasts at most a minute."""
        _check(desiredRadius, displacementConstraint)
        updating, self._updating = self._updating, False
        scans = self._navigator.surveyor.end_collection()
        if not updating:
            return [FAILED, 0.0, [0.0, 0.0]]
        return self._found(scans, desiredRadius, displacementConstraint)

    def forget(self) -> None:
        """The world was put back to its start: no update runs."""
        self._updating = False

    def _look(self, radius: float, displacement: float) -> Behaviour[list]:
        try:
            yield from self._navigator.driver.sweep()
        except NotMoved:
            return [FAILED, 0.0, [0.0, 0.0]]
        return self._found(self._navigator.surveyor.recent(), radius, displacement)

    def _found(self, scans: list[Scan], radius: float, displacement: float) -> list:
        if not scans:
            return [FAILED, 0.0, [0.0, 0.0]]
        zone = find_free_zone(scans, self._navigator.surveyor.odometry(), radius, displacement)
        return [FULFILLED if zone.fulfilled else NOT_FULFILLED, zone.radius, [zone.x, zone.y]]


def _check(radius: float, displacement: float) -> None:
    within(radius, 0.0, LARGEST, "desiredRadius")
    within(displacement, 0.0, LARGEST, "displacementConstraint")

"""ALNavigation: driving to goals without hitting obstacles.

Goals near the robot are driven to; maps are not simulated, so all calls about maps answer as on a robot that has not
explored yet.
"""

from __future__ import annotations

import concurrent.futures
import math
from typing import Any

from pepper_sim.body.description import SECURITY_DISTANCE_AHEAD
from pepper_sim.naoqi.motion.base import MotionBase
from pepper_sim.naoqi.service import Module, ServiceError, remote, within

MAX_DISTANCE = 3.0
"""navigateTo refuses farther goals [m] (NAOqi 2.8 documentation, ALNavigation)."""
_NO_MAP = "no map is loaded"


class ALNavigation(Module):
    """Drives to goals near the robot."""

    name = "ALNavigation"

    def __init__(self, base: MotionBase) -> None:
        self._base = base
        self._security_distance = SECURITY_DISTANCE_AHEAD

    @remote("b(ff)")
    def navigateTo(self, x: float, y: float) -> concurrent.futures.Future:
        """Drives to a point ahead (x) and to the left (y) [m]; false if an obstacle is in the way."""
        _check_distance(x, y)
        return self._base.moveTo(x, y, 0.0)

    @remote("b(fff)", "b(fffm)", name="navigateTo")
    def navigateToPose(self, x: float, y: float, theta: float, config: Any = ()) -> concurrent.futures.Future:
        """Drives to a relative pose; false if an obstacle is in the way."""
        _check_distance(x, y)
        return self._base.moveTo(x, y, theta)

    @remote("v()")
    def stopNavigateTo(self) -> None:
        """Ends navigateTo."""
        self._base.stopMove()

    @remote("v(f)")
    def setSecurityDistance(self, securityDistance: float) -> None:
        """Sets the distance to keep [m]. Stored only: ALMotion's distances take effect."""
        self._security_distance = within(securityDistance, 0.0, 5.0, "securityDistance")

    @remote("f()")
    def getSecurityDistance(self) -> float:
        """Returns the distance to keep [m]."""
        return self._security_distance

    @remote("i(f)")
    def explore(self, radius: float) -> int:
        """Explores the surroundings. Not simulated."""
        raise ServiceError("exploration is not available on this robot")

    @remote("v()")
    def stopExploration(self) -> None:
        """Ends the exploration; none runs."""

    @remote("s()")
    def saveExploration(self) -> str:
        """Saves the explored map; there is none."""
        raise ServiceError(_NO_MAP)

    @remote("b(s)")
    def loadExploration(self, path: str) -> bool:
        """Loads a map; none can be read: false."""
        return False

    @remote("v()")
    def startLocalization(self) -> None:
        """Starts localisation in the map; there is none."""
        raise ServiceError(_NO_MAP)

    @remote("v()")
    def stopLocalization(self) -> None:
        """Stops localisation; none runs."""

    @remote("b()")
    def isLocalizationRunning(self) -> bool:
        """Whether localisation runs: no."""
        return False

    @remote("m()")
    def relocalizeInMap(self) -> Any:
        """Finds the robot in the map; there is none."""
        raise ServiceError(_NO_MAP)

    @remote("m([f])", name="relocalizeInMap")
    def relocalizeInMapAt(self, estimation: list[float]) -> Any:
        """Finds the robot in the map near a pose (2.5); there is none."""
        raise ServiceError(_NO_MAP)

    @remote("m(fff)")
    def relocalizeInMapWithHint(self, x: float, y: float, theta: float) -> Any:
        """Finds the robot in the map near a pose; there is none."""
        raise ServiceError(_NO_MAP)

    @remote("m()")
    def getRobotPositionInMap(self) -> Any:
        """Returns the robot's pose in the map; there is none."""
        raise ServiceError(_NO_MAP)

    @remote("i([f])")
    def navigateToInMap(self, target: list[float]) -> int:
        """Drives to a pose in the map; there is none."""
        raise ServiceError(_NO_MAP)

    @remote("m()")
    def getMetricalMap(self) -> Any:
        """Returns the map; there is none."""
        raise ServiceError(_NO_MAP)

    @remote("m()")
    def getExplorationPath(self) -> Any:
        """Returns the path of the exploration; there was none."""
        raise ServiceError(_NO_MAP)

    @remote("v()")
    def startMapping(self) -> None:
        """Starts mapping. Not simulated."""
        raise ServiceError("exploration is not available on this robot")


def _check_distance(x: float, y: float) -> None:
    distance = math.hypot(x, y)
    if distance > MAX_DISTANCE:
        raise ServiceError(f"the goal is {distance:.1f} m away; at most {MAX_DISTANCE:g} m are possible")

"""ALNavigation: driving to goals around obstacles, free zones, and maps of the surroundings.

Everything is worked out from what the robot's own lasers, depth camera and wheels say, see `pepper_sim.navigation`.
Source: NAOqi 2.8 documentation, ALNavigation and Exploration; forms of release 2.5 as that release's programs use them.
"""

from __future__ import annotations

import concurrent.futures
import logging
import math
from typing import Any

from pepper_sim.body.description import INFRARED_RANGE, SECURITY_DISTANCE_AHEAD
from pepper_sim.disk import RobotDisk
from pepper_sim.naoqi.motion.base import MotionBase
from pepper_sim.naoqi.motion.move_config import configured_limits
from pepper_sim.naoqi.navigation.free_zones import FreeZoneCalls
from pepper_sim.naoqi.navigation.maps import MapCalls
from pepper_sim.naoqi.navigation.navigator import Navigator, place_beside
from pepper_sim.naoqi.service import Module, ServiceError, finite, remote, shown, within
from pepper_sim.naoqi.tasks import Workers
from pepper_sim.navigation.behaviours import TRAVELLING, Behaviour
from pepper_sim.navigation.trajectory import BadTrajectory, Trajectory, read_trajectory
from pepper_sim.robot import Pepper
from pepper_sim.services.al_memory import ALMemory

log = logging.getLogger(__name__)

MAX_DISTANCE = 3.0
"""navigateTo ignores farther goals [m] (NAOqi 2.8 documentation, ALNavigation)."""

_NAVIGATOR = "Navigation/AvoidanceNavigator/"
_STATUS, _OBSTACLE, _PROGRESS, _TARGET = (
    _NAVIGATOR + event for event in ("Status", "ObstacleDetected", "TrajectoryProgress", "AbsTargetModified")
)
_LEAVING = _NAVIGATOR + "MovingToFreeZone"
_MOTION = "Navigation/MotionDetected"
_SPOT = "Device/SubDeviceList/Platform/InfraredSpot/{}/Sensor/Value"


class ALNavigation(Module):
    """Drives to goals, finds free zones, makes maps and finds its way in them.

    Attributes:
        navigator: Runs the robot's navigation; other services drive with it.
    """

    name = "ALNavigation"

    def __init__(self, robot: Pepper, base: MotionBase, workers: Workers, disk: RobotDisk, memory: ALMemory) -> None:
        self.navigator = Navigator(robot, base, workers, self._announce)
        self._robot = robot
        self._memory = memory
        self._maps = MapCalls(self.navigator, disk)
        self._free_zones = FreeZoneCalls(self.navigator)
        self._security_distance = SECURITY_DISTANCE_AHEAD
        memory.declare((_STATUS, _OBSTACLE, _PROGRESS, _TARGET, _LEAVING, _MOTION), self.name)
        robot.world.on_reset(self._maps.forget_default)
        robot.world.on_reset(self._free_zones.forget)

    def parts(self) -> tuple[Any, ...]:
        return (self, self._maps, self._free_zones)

    def close(self) -> None:
        self.navigator.close()

    @remote("b(ff)", "b(ffm)")
    def navigateTo(self, x: float, y: float, config: Any = ()) -> concurrent.futures.Future | bool:
        """Drives to a point ahead (x) and to the left (y) [m] around obstacles; false if it does not get there."""
        return self._navigate(x, y, None, config)

    @remote("b(fff)", "b(fffm)", name="navigateTo")
    def navigateToPose(self, x: float, y: float, theta: float, config: Any = ()) -> concurrent.futures.Future | bool:
        """Drives to a relative pose around obstacles; false if it does not get there."""
        return self._navigate(x, y, theta, config)

    @remote("v()")
    def stopNavigateTo(self) -> concurrent.futures.Future:
        """Ends navigateTo; ends itself when that no longer drives."""
        return self.navigator.stop()

    @remote("b(m)")
    def moveAlong(self, trajectory: Any) -> concurrent.futures.Future:
        """Drives a trajectory of lines and arcs in given times; true at its end, also if an obstacle ended it."""
        try:
            pieces = read_trajectory(trajectory)
        except BadTrajectory as error:
            raise ServiceError(f"trajectory: {error}") from None
        return self.navigator.run(self._along(pieces), True)

    @remote("v(f)")
    def setSecurityDistance(self, securityDistance: float) -> None:
        """Sets the distance to keep [m]. Stored only: ALMotion's distances take effect."""
        self._security_distance = within(securityDistance, 0.0, 5.0, "securityDistance")

    @remote("f()")
    def getSecurityDistance(self) -> float:
        """Returns the distance to keep [m]."""
        return self._security_distance

    # --- inside ------------------------------------------------------------------------------------------------------

    def _navigate(self, x: float, y: float, theta: float | None, config: Any) -> concurrent.futures.Future | bool:
        speeds = _speeds(config)
        distance = math.hypot(x, y)
        if distance > MAX_DISTANCE:
            log.warning("navigateTo: the goal is %.1f m away; at most %g m are possible", distance, MAX_DISTANCE)
            return False
        return self.navigator.run(self._watched(self.navigator.driver.drive_near(x, y, theta, speeds)))

    def _watched(self, behaviour: Behaviour[bool]) -> Behaviour[bool]:
        self._memory.announce(_STATUS, "Started")
        try:
            return (yield from behaviour)
        finally:
            self._memory.announce(_STATUS, "Stopped")

    def _along(self, pieces: list[Trajectory]) -> Behaviour[bool]:
        for number, piece in enumerate(pieces):
            self._robot.base_limits = configured_limits([["MaxVelXY", 0.55], ["MaxVelTheta", 2.0]])
            future = self._robot.move_to(piece.waypoints, duration=piece.duration)
            try:
                while not future.done():
                    yield
            finally:
                if not future.done():
                    self._robot.stop_move()
            if not future.result():
                return True
            self._announce("progress", (number + 1) / len(pieces))
        return True

    def _announce(self, what: str, value: Any) -> None:
        if what == "progress":
            self._memory.announce(_PROGRESS, float(value))
        elif what == "obstacle":
            self._memory.announce(_OBSTACLE, list(value))
        elif what == "goal":
            self._memory.announce(_TARGET, [*value, 0.0])
        elif what == "motion":
            side, pose, near = value
            self._memory.announce(_MOTION, [_SPOT.format(side), place_beside(side, pose, INFRARED_RANGE), near])


def _speeds(config: Any) -> tuple[float, float]:
    """Return the top speeds of a configuration: [["SpeedFactor", 0 to 1], ...], or ALMotion's parameters.

    Raises:
        ServiceError: Not [[name, value], ...], or an unknown name.
    """
    if not isinstance(config, list | tuple):
        raise ServiceError(f"config must be [[name, value], ...], got {shown(config)}")
    factor, rest = 1.0, []
    for item in config:
        if isinstance(item, list | tuple) and len(item) == 2 and item[0] == "SpeedFactor":
            factor = min(max(finite(item[1], "SpeedFactor"), 0.0), 1.0)
        else:
            rest.append(item)
    if not rest:
        return max(0.1, factor * TRAVELLING[0]), max(0.2, factor * TRAVELLING[1])
    limits = configured_limits(rest)
    return max(0.1, factor * limits.max_xy), max(0.2, factor * limits.max_theta)

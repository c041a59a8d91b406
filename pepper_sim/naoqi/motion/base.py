"""ALMotion: driving. Velocities in m/s and rad/s, poses in m and rad, x ahead, y left, counter-clockwise positive.

`move` and `moveToward` hold until the next command: like the real robot's they have no time-out. Limits: NAOqi 2.8
documentation, control-walk.
"""

from __future__ import annotations

import concurrent.futures
import math
from typing import Any

from pepper_sim.naoqi.motion.move_config import configured_limits, move_config_table
from pepper_sim.naoqi.motion_tasks import MotionTasks
from pepper_sim.naoqi.service import ServiceError, finite, one_of, remote, shown
from pepper_sim.naoqi.tasks import Watch, chained
from pepper_sim.robot import BaseLimits, Pepper

_MAX_POINTS = 1000


class MotionBase:
    """Driving part of ALMotion.

    A robot that is asleep, fallen or too close to an obstacle does not move; it raises the event ALMotion/MoveFailed,
    and moveTo answers false.
    """

    def __init__(self, robot: Pepper, watch: Watch, tasks: MotionTasks) -> None:
        self._robot = robot
        self._watch = watch
        self._tasks = tasks
        self._arms = {"LArm": True, "RArm": True}

    # --- commands ----------------------------------------------------------------------------------------------------

    @remote("v(fff)", "v(fffm)", quick="move")
    def move(self, x: float, y: float, theta: float, moveConfig: Any = ()) -> None:
        """Drives at a velocity [m/s, m/s, rad/s] until the next command."""
        limits = configured_limits(moveConfig)
        self._drive(x, y, theta, limits)

    @remote("v(fff)", "v(fffm)", quick="moveToward")
    def moveToward(self, x: float, y: float, theta: float, moveConfig: Any = ()) -> None:
        """Drives at fractions (-1 to 1) of the top speeds until the next command; (0, 0, 0) stops."""
        limits = configured_limits(moveConfig)
        x, y, theta = (max(-1.0, min(1.0, value)) for value in (x, y, theta))
        self._drive(x * limits.max_xy, y * limits.max_xy, theta * limits.max_theta, limits)

    @remote("b(fff)", "b(fffm)")
    def moveTo(self, x: float, y: float, theta: float, moveConfig: Any = ()) -> concurrent.futures.Future:
        """Drives to a pose relative to where the robot stands; true when it got there."""
        return self._go([(x, y, theta)], None, moveConfig)

    @remote("b(ffff)", "b(ffffm)", name="moveTo")
    def moveToInTime(
        self, x: float, y: float, theta: float, time: float, moveConfig: Any = ()
    ) -> concurrent.futures.Future:
        """Drives to a relative pose in `time` seconds, or longer if the top speed does not allow it."""
        if time <= 0.0:
            raise ServiceError(f"time must be positive, got {time:g}")
        return self._go([(x, y, theta)], time, moveConfig)

    @remote("b(m)", "b(mm)", name="moveTo")
    def moveToPoints(self, controlPoint: Any, moveConfig: Any = ()) -> concurrent.futures.Future:
        """Drives through poses [[x, y, theta], ...], each relative to the one before."""
        return self._go(_points(controlPoint), None, moveConfig)

    @remote("b()")
    def stopMove(self) -> concurrent.futures.Future:
        """Stops as fast as is comfortable; ends move, moveToward and moveTo.

        True when the robot stands, false when another command drives it on.
        """
        return self._robot.stop_move()

    @remote("v()")
    def killMove(self) -> None:
        """Stops abruptly."""
        self._robot.stop_move(abrupt=True)

    @remote("v()")
    def waitUntilMoveIsFinished(self) -> concurrent.futures.Future:
        """Ends when the robot no longer moves."""
        return self._watch.until(lambda: not self._robot.snapshot().moving)

    # --- state -------------------------------------------------------------------------------------------------------

    @remote("b()")
    def moveIsActive(self) -> bool:
        """Whether the base is moving."""
        return bool(self._robot.snapshot().moving)

    @remote("m(s)")
    def getMoveConfig(self, config: str) -> list:
        """Returns [[name, value], ...] for "Default", "Min" or "Max"."""
        return move_config_table(one_of(config, ("Default", "Min", "Max"), "config"))

    @remote("[f](b)")
    def getRobotPosition(self, useSensors: bool) -> list[float]:
        """Returns the pose [x, y, theta] by odometry, since start."""
        return _pose(self._robot.snapshot().odometry)

    @remote("[f]()")
    def getNextRobotPosition(self) -> list[float]:
        """Returns the pose that the robot reaches with the commands that can no longer be withdrawn."""
        return _pose(self._robot.snapshot().next_odometry)

    @remote("[f]()")
    def getRobotVelocity(self) -> list[float]:
        """Returns the velocity [vx, vy, wz] in the robot's frame."""
        return [float(value) for value in self._robot.snapshot().velocity]

    @remote("v(bb)")
    def setMoveArmsEnabled(self, leftArmEnabled: bool, rightArmEnabled: bool) -> None:
        """Lets the arms swing while driving. Stored only: this robot's arms do not swing."""
        self._arms = {"LArm": leftArmEnabled, "RArm": rightArmEnabled}

    @remote("b(s)")
    def getMoveArmsEnabled(self, chainName: str) -> bool:
        """Whether arms may swing: "LArm", "RArm", or both "Arms"."""
        one_of(chainName, ("LArm", "RArm", "Arms"), "chainName")
        return all(self._arms.values()) if chainName == "Arms" else self._arms[chainName]

    # --- names of the walking robots, mapped to driving --------------------------------------------------------------

    @remote("v(ffff)", "v(ffffm)", "v(ffffmm)")
    def setWalkTargetVelocity(
        self,
        x: float,
        y: float,
        theta: float,
        frequency: float,
        leftFootGaitConfig: Any = (),
        rightFootGaitConfig: Any = (),
    ) -> None:
        """Old name of moveToward; there are no steps to count."""
        self.moveToward(x, y, theta)

    @remote("b(fff)", "b(fffm)")
    def walkTo(self, x: float, y: float, theta: float, feetGaitConfig: Any = ()) -> concurrent.futures.Future:
        """Old name of moveTo."""
        return self.moveTo(x, y, theta)

    @remote("b(m)", "b(mm)", name="walkTo")
    def walkToPoints(self, controlPoints: Any, feetGaitConfig: Any = ()) -> concurrent.futures.Future:
        """Old name of moveTo."""
        return self.moveToPoints(controlPoints)

    @remote("b()")
    def stopWalk(self) -> concurrent.futures.Future:
        """Old name of stopMove."""
        return self.stopMove()

    @remote("b()")
    def walkIsActive(self) -> bool:
        """Old name of moveIsActive."""
        return self.moveIsActive()

    @remote("v()")
    def waitUntilWalkIsFinished(self) -> concurrent.futures.Future:
        """Old name of waitUntilMoveIsFinished."""
        return self.waitUntilMoveIsFinished()

    @remote("v()")
    def killWalk(self) -> None:
        """Old name of killMove."""
        self.killMove()

    @remote("m(s)")
    def getFootGaitConfig(self, config: str) -> list:
        """Old name of getMoveConfig."""
        return self.getMoveConfig(config)

    @remote("m()")
    def getWalkArmsEnabled(self) -> bool:
        """Whether both arms may swing; see getMoveArmsEnabled."""
        return self.getMoveArmsEnabled("Arms")

    @remote("v(bb)")
    def setWalkArmsEnabled(self, leftArmEnabled: bool, rightArmEnabled: bool) -> None:
        """Old name of setMoveArmsEnabled."""
        self.setMoveArmsEnabled(leftArmEnabled, rightArmEnabled)

    # --- inside ------------------------------------------------------------------------------------------------------

    def _drive(self, vx: float, vy: float, wz: float, limits: BaseLimits) -> None:
        self._robot.base_limits = limits
        self._robot.set_velocity(vx, vy, wz)

    def _go(
        self, points: list[tuple[float, float, float]], duration: float | None, config: Any
    ) -> concurrent.futures.Future:
        self._robot.base_limits = configured_limits(config)
        future = self._robot.move_to(_from_here(points), duration=duration)
        return chained(self._tasks.add("Move", ("Base",), future, self._robot.stop_move), bool)


def _from_here(points: list[tuple[float, float, float]]) -> list[tuple[float, float, float]]:
    """Return poses relative to the first frame from poses that are each relative to the one before."""
    x = y = theta = 0.0
    poses = []
    for dx, dy, turn in points:
        c, s = math.cos(theta), math.sin(theta)
        x, y, theta = x + c * dx - s * dy, y + s * dx + c * dy, theta + turn
        poses.append((x, y, theta))
    return poses


def _pose(pose: Any) -> list[float]:
    x, y, theta = (float(value) for value in pose)
    wrapped = math.remainder(theta, math.tau)
    return [x, y, math.pi if wrapped <= -math.pi else wrapped]


def _points(value: Any) -> list[tuple[float, float, float]]:
    if isinstance(value, list | tuple) and value and not isinstance(value[0], list | tuple):
        value = [value]
    if not isinstance(value, list | tuple) or not 0 < len(value) <= _MAX_POINTS:
        raise ServiceError(f"controlPoint must be [[x, y, theta], ...], got {shown(value)}")
    points = []
    for index, point in enumerate(value):
        if not isinstance(point, list | tuple) or len(point) != 3:
            raise ServiceError(f"controlPoint[{index}] must be [x, y, theta], got {shown(point)}")
        x, y, theta = (finite(number, f"controlPoint[{index}]") for number in point)
        points.append((x, y, theta))
    return points

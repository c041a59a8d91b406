"""ALTracker: following a target. Targets are not detected: tracking starts and reports the target as lost.

`lookAt` needs no target and turns the head.
"""

from __future__ import annotations

import concurrent.futures
import math
from typing import Any

import numpy as np

from pepper_sim.naoqi.motion.frames import FRAME_LINKS
from pepper_sim.naoqi.motion.joints import MotionJoints
from pepper_sim.naoqi.service import Module, ServiceError, finite, one_of, remote, shown
from pepper_sim.robot import Pepper
from pepper_sim.services.al_memory import ALMemory

MODES = ("Head", "WholeBody", "Move", "Navigate")
TARGETS = ("Face", "LandMark", "LandMarks", "People", "RedBall", "Sound")


class ALTracker(Module):
    """Stores the settings of tracking; turns the head to given points."""

    name = "ALTracker"

    def __init__(self, robot: Pepper, memory: ALMemory, joints: MotionJoints) -> None:
        self._robot = robot
        self._joints = joints
        self._mode = "Head"
        self._target = ""
        self._registered: dict[str, Any] = {}
        self._effector = "None"
        self._relative = [0.0] * 6
        self._max_distance = 3.0
        self._search = True
        memory.declare(("ALTracker/ActiveTargetChanged", "ALTracker/TargetLost", "ALTracker/TargetReached"), self.name)

    @remote("v([f]if)", "v([f]ifb)")
    def lookAt(
        self, position: list[float], frame: int, fractionMaxSpeed: float, useWholeBody: bool = False
    ) -> concurrent.futures.Future:
        """Turns the head to a point [x, y, z] in frame 0 torso, 1 world or 2 robot; ends when it looks there."""
        if not 0.0 < fractionMaxSpeed <= 1.0:
            raise ServiceError(f"fractionMaxSpeed must be above 0 and at most 1, got {fractionMaxSpeed:g}")
        x, y, z = self._relative_to_neck(position, frame)
        angles = {"HeadYaw": math.atan2(y, x), "HeadPitch": -math.atan2(z, math.hypot(x, y))}
        return self._joints.go(angles, fractionMaxSpeed, "lookAt")

    @remote("v(s)")
    def track(self, pTarget: str) -> None:
        """Starts to follow a registered target."""
        if pTarget not in self._registered:
            raise ServiceError(f"target '{shown(pTarget)[1:-1]}' is not registered")
        self._target = pTarget

    @remote("v(s)")
    def trackEvent(self, pEventName: str) -> None:
        """Starts to follow the target of an event."""
        self._target = pEventName

    @remote("v()")
    def stopTracker(self) -> None:
        """Stops following."""
        self._target = ""

    @remote("b()")
    def isActive(self) -> bool:
        """Whether a target is followed."""
        return bool(self._target)

    @remote("b()")
    def isTargetLost(self) -> bool:
        """Whether the target is lost: always, while one is followed."""
        return bool(self._target)

    @remote("b()")
    def isNewTargetDetected(self) -> bool:
        """Whether a target has been detected since the last call: no."""
        return False

    @remote("s()")
    def getActiveTarget(self) -> str:
        """Returns the followed target, or ""."""
        return self._target

    @remote("[f](i)")
    def getTargetPosition(self, pFrame: int) -> list[float]:
        """Returns the target's position; unknown: []."""
        one_of(pFrame, FRAME_LINKS, "pFrame")
        return []

    @remote("v(sm)")
    def registerTarget(self, pTarget: str, pParams: Any) -> None:
        """Registers a target."""
        self._registered[one_of(pTarget, TARGETS, "pTarget")] = pParams

    @remote("v(s)")
    def unregisterTarget(self, pTarget: str) -> None:
        """Removes a target."""
        if self._registered.pop(pTarget, None) is None:
            raise ServiceError(f"target '{shown(pTarget)[1:-1]}' is not registered")

    @remote("v()")
    def unregisterAllTargets(self) -> None:
        """Removes all targets."""
        self._registered.clear()
        self._target = ""

    @remote("[s]()")
    def getRegisteredTargets(self) -> list[str]:
        """Lists the targets."""
        return list(self._registered)

    @remote("[s]()")
    def getManagedTargets(self) -> list[str]:
        """Lists the targets of a registered kind."""
        return list(self._registered)

    @remote("[s]()")
    def getSupportedTargets(self) -> list[str]:
        """Lists the kinds of targets."""
        return list(TARGETS)

    @remote("v(s)")
    def setMode(self, pMode: str) -> None:
        """Sets which parts of the body follow the target."""
        self._mode = one_of(pMode, MODES, "pMode")

    @remote("s()")
    def getMode(self) -> str:
        """Returns which parts of the body follow the target."""
        return self._mode

    @remote("[s]()")
    def getAvailableModes(self) -> list[str]:
        """Lists the modes."""
        return list(MODES)

    @remote("v(s)")
    def setEffector(self, pEffector: str) -> None:
        """Sets which arm points at the target."""
        self._effector = one_of(pEffector, ("None", "Arms", "LArm", "RArm"), "pEffector")

    @remote("s()")
    def getEffector(self) -> str:
        """Returns which arm points at the target."""
        return self._effector

    @remote("v(m)")
    def setRelativePosition(self, target: Any) -> None:
        """Sets where to stay relative to the target: [x, y, θ, ...]."""
        if not isinstance(target, list | tuple) or not target:
            raise ServiceError(f"target must be a list of numbers, got {shown(target)}")
        self._relative = [finite(value, f"target[{index}]") for index, value in enumerate(target)]

    @remote("m()")
    def getRelativePosition(self) -> list[float]:
        """Returns where to stay relative to the target."""
        return self._relative

    @remote("v(f)")
    def setMaximumDistanceDetection(self, pMaxDistance: float) -> None:
        """Sets the range of detection [m]. Stored only."""
        self._max_distance = pMaxDistance

    @remote("f()")
    def getMaximumDistanceDetection(self) -> float:
        """Returns the range of detection [m]."""
        return self._max_distance

    @remote("v(b)")
    def toggleSearch(self, pSearch: bool) -> None:
        """Switches the search for a lost target on or off."""
        self._search = pSearch

    @remote("b()")
    def isSearchEnabled(self) -> bool:
        """Whether a lost target is searched for."""
        return self._search

    def _relative_to_neck(self, position: list[float], frame: int) -> np.ndarray:
        """Return a point relative to the neck joint, in the torso's axes [m]."""
        one_of(frame, FRAME_LINKS, "frame")
        if len(position) != 3:
            raise ServiceError(f"position must be [x, y, z], got {len(position)} numbers")
        with self._robot.world.locked():
            link = FRAME_LINKS[frame]
            reference = np.eye(4) if link is None else self._robot.link_pose(link)
            torso, head = self._robot.link_pose("torso"), self._robot.link_pose("Head")
        place = (reference @ [*position, 1.0])[:3]
        return torso[:3, :3].T @ (place - head[:3, 3])

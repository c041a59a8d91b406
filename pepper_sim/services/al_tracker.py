"""ALTracker: looks at, points at, and follows a target with the head, the arms and the base.

Targets are what `pepper_sim.naoqi.people.targets` finds: nothing is followed that is not seen. A motion of somebody
else's that uses the head has precedence. Source: NAOqi 2.8 documentation, ALTracker.
"""

from __future__ import annotations

import concurrent.futures
from typing import Any

from pepper_sim.naoqi.extractor import Extractor
from pepper_sim.naoqi.other_services import OtherServices
from pepper_sim.naoqi.people.aim import ARMS, arm_angles, from_world, head_angles, to_world
from pepper_sim.naoqi.people.population import Population
from pepper_sim.naoqi.people.pursuit import Pursuit
from pepper_sim.naoqi.people.targets import EXTRACTORS, TARGETS, Targets, check_parameters
from pepper_sim.naoqi.people.tracker_settings import TrackerSettings, check_fraction
from pepper_sim.naoqi.service import Module, ServiceError, finite, one_of, remote, shown
from pepper_sim.robot import Pepper
from pepper_sim.services.al_memory import ALMemory
from pepper_sim.services.al_motion import ALMotion

_PERIOD = 30


class ALTracker(Module):
    """Follows targets; turns the head to given places and points at them."""

    name = "ALTracker"

    def __init__(
        self, robot: Pepper, memory: ALMemory, motion: ALMotion, population: Population, others: OtherServices
    ) -> None:
        self._robot = robot
        self._memory = memory
        self._motion = motion
        self._others = others
        self._targets = Targets(robot, memory, population)
        self._pursuit = Pursuit(robot, memory, motion, self._targets)
        self._settings = TrackerSettings(self._pursuit)
        self._registered: dict[str, Any] = {}
        self._periods: dict[str, int] = {}
        self._coordinates: list[list[float]] = []
        memory.declare(("ALTracker/ActiveTargetChanged", "ALTracker/TargetLost", "ALTracker/TargetReached"), self.name)
        population.watch(lambda: bool(self._pursuit.target), self._pursuit.update, blind=self._pursuit.halt)

    def parts(self) -> tuple[Any, ...]:
        return self, self._settings

    def close(self) -> None:
        self._pursuit.stop()

    # --- looking and pointing ----------------------------------------------------------------------------------------

    @remote("v([f]if)", "v([f]ifb)")
    def lookAt(
        self, position: list[float], frame: int, fractionMaxSpeed: float, useWholeBody: bool = False
    ) -> concurrent.futures.Future:
        """Turns the head to a place [x, y, z] in frame 0 torso, 1 world or 2 robot; ends when it looks there."""
        check_fraction(fractionMaxSpeed)
        angles = head_angles(self._robot, to_world(self._robot, position, frame).tolist())
        return self._motion.joints.go(angles, fractionMaxSpeed, "lookAt")

    @remote("v([f]fb)", name="lookAt")
    def lookAtInTorso(self, position: list[float], fractionMaxSpeed: float, useWholeBody: bool) -> Any:
        """Turns the head to a place [x, y, z] in the torso's frame (deprecated)."""
        return self.lookAt(position, 0, fractionMaxSpeed, useWholeBody)

    @remote("v(s[f]if)")
    def pointAt(
        self, effector: str, position: list[float], frame: int, fractionMaxSpeed: float
    ) -> concurrent.futures.Future:
        """Points LArm, RArm or Arms at a place [x, y, z] in frame 0 torso, 1 world or 2 robot; ends when they do."""
        one_of(effector, ARMS, "effector")
        check_fraction(fractionMaxSpeed)
        angles = arm_angles(self._robot, effector, to_world(self._robot, position, frame).tolist())
        return self._motion.joints.go(angles, fractionMaxSpeed, "pointAt")

    @remote("v(s[f]f)", name="pointAt")
    def pointAtInTorso(self, effector: str, position: list[float], fractionMaxSpeed: float) -> Any:
        """Points at a place [x, y, z] in the torso's frame (deprecated)."""
        return self.pointAt(effector, position, 0, fractionMaxSpeed)

    # --- following ---------------------------------------------------------------------------------------------------

    @remote("v(s)")
    def track(self, pTarget: str) -> None:
        """Starts to follow a registered target."""
        if pTarget not in self._registered:
            raise ServiceError(f"target '{shown(pTarget)[1:-1]}' is not registered")
        self._start(pTarget, self._registered[pTarget])

    @remote("v(s)")
    def trackEvent(self, pEventName: str) -> None:
        """Starts to follow the place that an event of ALMemory holds."""
        if not pEventName:
            raise ServiceError("pEventName must not be empty")
        self._start(pEventName, None)

    @remote("v()")
    def stopTracker(self) -> None:
        """Stops following."""
        if self._pursuit.target:
            self._pursuit.stop()
            self._memory.announce("ALTracker/ActiveTargetChanged", "")

    @remote("b()")
    def isActive(self) -> bool:
        """Whether a target is followed."""
        return bool(self._pursuit.target)

    @remote("b()")
    def isTargetLost(self) -> bool:
        """Whether the target that is followed is not seen."""
        return self._pursuit.lost

    @remote("b()")
    def isNewTargetDetected(self) -> bool:
        """Whether the target has been seen since its place was last asked for."""
        return self._pursuit.new

    @remote("s()")
    def getActiveTarget(self) -> str:
        """Returns the followed target or event, or ""."""
        return self._pursuit.target

    @remote("[f](i)")
    def getTargetPosition(self, pFrame: int) -> list[float]:
        """Returns where the target was last seen in frame 0 torso, 1 world or 2 robot [m]; [] if never."""
        place = self._pursuit.take_place()
        position = from_world(self._robot, place or (0.0, 0.0, 0.0), pFrame)
        return position if place else []

    @remote("[f]()", name="getTargetPosition")
    def getTargetPositionInTorso(self) -> list[float]:
        """Returns where the target was last seen in the torso's frame [m] (deprecated)."""
        return self.getTargetPosition(0)

    @remote("[f]()")
    def getRobotPosition(self) -> list[float]:
        """Returns the robot's place [x, y, z, wx, wy, wz] among the LandMarks of setTargetCoordinates; [] if unseen."""
        marks = self._registered.get("LandMarks")
        return [] if marks is None else self._targets.robot_among_marks(marks, self._coordinates)

    # --- targets -----------------------------------------------------------------------------------------------------

    @remote("v(sm)")
    def registerTarget(self, pTarget: str, pParams: Any) -> None:
        """Registers a target and starts what finds it."""
        one_of(pTarget, TARGETS, "pTarget")
        self._registered[pTarget] = check_parameters(pTarget, pParams)
        extractor = self._extractor(pTarget)
        if extractor is not None:
            extractor.subscribe(self._subscriber(pTarget), self._periods.get(pTarget, _PERIOD), 1.0)
        self._pursuit.change(pTarget, pParams)

    @remote("v(sm)")
    def addTarget(self, pTarget: str, pParams: Any) -> None:
        """Old name of registerTarget."""
        self.registerTarget(pTarget, pParams)

    @remote("v(s)")
    def unregisterTarget(self, pTarget: str) -> None:
        """Removes a target and ends what finds it."""
        if pTarget not in self._registered:
            raise ServiceError(f"target '{shown(pTarget)[1:-1]}' is not registered")
        del self._registered[pTarget]
        extractor = self._extractor(pTarget)
        if extractor is not None:
            extractor.unsubscribe(self._subscriber(pTarget))
        if self._pursuit.target == pTarget:
            self.stopTracker()

    @remote("v(s)")
    def removeTarget(self, pTarget: str) -> None:
        """Old name of unregisterTarget."""
        self.unregisterTarget(pTarget)

    @remote("v([s])")
    def unregisterTargets(self, pTargets: list[str]) -> None:
        """Removes targets."""
        for target in pTargets:
            self.unregisterTarget(target)

    @remote("v([s])")
    def removeTargets(self, pTargets: list[str]) -> None:
        """Old name of unregisterTargets."""
        self.unregisterTargets(pTargets)

    @remote("v()")
    def unregisterAllTargets(self) -> None:
        """Removes all targets and stops following."""
        self.unregisterTargets(list(self._registered))
        self.stopTracker()

    @remote("v()")
    def removeAllTargets(self) -> None:
        """Old name of unregisterAllTargets."""
        self.unregisterAllTargets()

    @remote("[s]()")
    def getRegisteredTargets(self) -> list[str]:
        """Lists the registered targets."""
        return list(self._registered)

    @remote("[s]()")
    def getManagedTargets(self) -> list[str]:
        """Old name of getRegisteredTargets."""
        return list(self._registered)

    @remote("[s]()")
    def getSupportedTargets(self) -> list[str]:
        """Lists the kinds of targets."""
        return list(TARGETS)

    @remote("[s]()")
    def getTargetNames(self) -> list[str]:
        """Old name of getSupportedTargets."""
        return list(TARGETS)

    @remote("i(s)")
    def getExtractorPeriod(self, pTarget: str) -> int:
        """Returns how often the extractor of a registered target works [ms]."""
        self._require_registered(pTarget)
        return self._periods.get(pTarget, _PERIOD)

    @remote("v(si)")
    def setExtractorPeriod(self, pTarget: str, pPeriod: int) -> None:
        """Sets how often the extractor of a registered target works [ms]."""
        self._require_registered(pTarget)
        if pPeriod <= 0:
            raise ServiceError(f"pPeriod must be positive, got {pPeriod}")
        self._periods[pTarget] = pPeriod
        extractor = self._extractor(pTarget)
        if extractor is not None:
            extractor.updatePeriod(self._subscriber(pTarget), pPeriod)

    @remote("v(m)")
    def setTargetCoordinates(self, pCoord: Any) -> None:
        """Sets where the LandMarks are: [[x, y, z], [x, y, z]] [m]."""
        if not isinstance(pCoord, list | tuple) or not all(isinstance(p, list | tuple) and len(p) == 3 for p in pCoord):
            raise ServiceError(f"pCoord must be [[x, y, z], ...], got {shown(pCoord)}")
        self._coordinates = [[finite(value, "pCoord") for value in place] for place in pCoord]

    @remote("m()")
    def getTargetCoordinates(self) -> list[list[float]]:
        """Returns where the LandMarks are."""
        return self._coordinates

    # --- inside ------------------------------------------------------------------------------------------------------

    def _start(self, target: str, parameters: Any) -> None:
        changed = self._pursuit.target != target
        self._pursuit.start(target, parameters)
        if changed:
            self._memory.announce("ALTracker/ActiveTargetChanged", target)

    def _require_registered(self, target: str) -> None:
        if target not in self._registered:
            raise ServiceError(f"target '{shown(target)[1:-1]}' is not registered")

    def _extractor(self, target: str) -> Extractor | None:
        found = self._others.find(EXTRACTORS[target])
        return found if isinstance(found, Extractor) else None

    def _subscriber(self, target: str) -> str:
        return f"{self.name}_{target}"

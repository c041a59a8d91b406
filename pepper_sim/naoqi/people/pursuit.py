"""Pursuit: following one target with the head, the arms and the base, and searching for it when it is lost."""

from __future__ import annotations

import math
import threading
from typing import Any

from pepper_sim.naoqi.people.aim import HEAD, arm_angles, from_world, head_angles, turn_head
from pepper_sim.naoqi.people.following_base import FollowingBase
from pepper_sim.naoqi.people.population import Look
from pepper_sim.naoqi.people.targets import Place, Targets
from pepper_sim.robot import Pepper
from pepper_sim.services.al_memory import ALMemory
from pepper_sim.services.al_motion import ALMotion
from telepresence.sim.base import BaseLimits

VELOCITY = 2.0
"""The head follows no faster than this [rad/s]."""
PATIENCE = 2.0
"""An unseen target counts as lost after this time [s]."""
SEARCH_FRACTION = 0.15
_SEARCH = ((0.8, -0.15), (0.0, -0.3), (-0.8, -0.15), (0.0, 0.0))
"""Where a search looks, one after the other (yaw, pitch [rad]), each for `_SEARCH_TIME` [s]."""
_SEARCH_TIME = 1.5
_ARM_FRACTION = 0.3
_APPROACH, _TURN = 0.8, 1.2
"""Speed of the base per error [1/s]."""
_TURN_FIRST = 0.6
_MOVING = ("Move", "Navigate")


class Pursuit:
    """Follows `target`, the name of a target or of an event; "" for none."""

    def __init__(self, robot: Pepper, memory: ALMemory, motion: ALMotion, targets: Targets) -> None:
        self._robot = robot
        self._memory = memory
        self._motion = motion
        self._targets = targets
        self._lock = threading.RLock()
        self._parameters: Any = None
        self._place: Place | None = None
        self._seen = 0.0
        self._lost_since: float | None = None
        self._base = FollowingBase(robot, motion)
        self._reached = False
        self.target = ""
        self.new = False
        self.relative: list[float] = []
        self.farthest = math.inf
        self.limits: BaseLimits | None = None
        self.reset()

    def reset(self) -> None:
        """Restore all settings."""
        self.mode, self.effector = "Head", "None"
        self.velocity, self.patience = VELOCITY, PATIENCE
        self.searching, self.search_fraction = True, SEARCH_FRACTION
        self.limits = None

    @property
    def lost(self) -> bool:
        """Whether the target is not seen although it is followed."""
        return bool(self.target) and (self._place is None or self._lost_since is not None)

    def start(self, target: str, parameters: Any) -> None:
        """Follow another target."""
        self._parameters, self._place, self._lost_since = parameters, None, None
        self._seen = self._robot.world.time
        self.new = self._reached = False
        self.target = target

    def change(self, target: str, parameters: Any) -> None:
        """Use other parameters from now on, if this target is followed."""
        if target == self.target:
            self._parameters = parameters

    def stop(self) -> None:
        """Follow nothing; the robot stays as it is."""
        with self._lock:
            self.target, self._place, self._lost_since, self.new = "", None, None, False
            self.halt()

    def halt(self) -> None:
        """Stop the base, if it drives after the target."""
        with self._lock:
            self._base.halt()

    def set_mode(self, mode: str) -> None:
        """Choose what follows."""
        with self._lock:
            self.mode = mode
            if mode not in _MOVING:
                self.halt()

    def take_place(self) -> Place | None:
        """Return where the target was seen last; None if it was not. From now on it is no longer new."""
        self.new = False
        return self._place

    def update(self, look: Look) -> None:
        """Follow what was just seen."""
        with self._lock:
            self._update(look)

    # --- inside ------------------------------------------------------------------------------------------------------

    def _update(self, look: Look) -> None:
        target = self.target
        place = self._targets.locate(target, self._parameters, look) if target else None
        if place is not None and self._distance(place) > self.farthest:
            place = None
        if not target:
            return
        if place is None:
            self._miss(look.sight.time)
            return
        self._place, self._seen, self._lost_since, self.new = place, look.sight.time, None, True
        self._look(place)
        if self.effector != "None":
            self._point(place)
        if self.mode in _MOVING:
            self._approach(place)

    def _distance(self, place: Place) -> float:
        return math.hypot(*from_world(self._robot, place, 2))

    def _look(self, place: Place) -> None:
        turn_head(self._robot, self._motion, head_angles(self._robot, place), self.velocity)

    def _point(self, place: Place) -> None:
        angles = arm_angles(self._robot, self.effector, place)
        if not self._motion.tasks.using(angles):
            speeds = {joint: _ARM_FRACTION * self._robot.LIMITS[joint].velocity for joint in angles}
            self._robot.set_angles(angles, speeds)

    def _approach(self, place: Place) -> None:
        x, y, _ = from_world(self._robot, place, 2)
        bearing = math.atan2(y, x) + self.relative[2]
        ahead = math.hypot(x, y) + self.relative[0]
        if abs(ahead) <= max(self.relative[3], 0.01) and abs(bearing) <= max(self.relative[5], 0.02):
            self.halt()
            if not self._reached:
                self._reached = True
                self._memory.announce("ALTracker/TargetReached", self.target)
            return
        self._reached = False
        limits = self.limits or self._robot.base_limits
        speed = 0.0 if abs(bearing) > _TURN_FIRST else max(-limits.max_xy, min(limits.max_xy, _APPROACH * ahead))
        turn = max(-limits.max_theta, min(limits.max_theta, _TURN * bearing))
        self._base.drive(speed, turn)

    def _miss(self, now: float) -> None:
        self.halt()
        if self._lost_since is None and now - self._seen > self.patience:
            self._lost_since = now
            self._memory.announce("ALTracker/TargetLost", self.target)
        if self._lost_since is not None and self.searching and not self._motion.tasks.using(HEAD):
            yaw, pitch = _SEARCH[int((now - self._lost_since) / _SEARCH_TIME) % len(_SEARCH)]
            speeds = {joint: self.search_fraction * self._robot.LIMITS[joint].velocity for joint in HEAD}
            self._robot.set_angles({"HeadYaw": yaw, "HeadPitch": pitch}, speeds)

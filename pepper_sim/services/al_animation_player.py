"""ALAnimationPlayer: animations by path or tag. Source: NAOqi 2.8 documentation, ALAnimationPlayer.

A path may hold [posture], which stands for the robot's posture family, and [robot], which is Pepper. Pepper's own
animations are in `pepper_sim.animations`; any behaviour of an installed package can be played as well.
"""

from __future__ import annotations

import concurrent.futures
import random
import re
import threading
from collections.abc import Mapping
from typing import Any

from pepper_sim.animations import library
from pepper_sim.animations.generator import playable
from pepper_sim.body.postures import CROUCH, STAND
from pepper_sim.naoqi.motion.joints import MotionJoints
from pepper_sim.naoqi.service import Service, ServiceError, remote, shown
from pepper_sim.naoqi.tasks import chained
from pepper_sim.robot import Pepper
from pepper_sim.services.al_behavior_manager import ALBehaviorManager

POSTURES = ("Stand", "Sit", "SitOnPod")
"""What [posture] may stand for."""
ROBOT = "Pepper"
_LEG = ("HipPitch", "KneePitch")
_PATTERN = re.compile(r"\[(\w+)\]")


class ALAnimationPlayer(Service):
    """Plays animations."""

    name = "ALAnimationPlayer"

    def __init__(self, robot: Pepper, joints: MotionJoints, behaviors: ALBehaviorManager) -> None:
        self._robot = robot
        self._joints = joints
        self._behaviors = behaviors
        self._lock = threading.Lock()
        self._random = random.Random()
        self._added: dict[str, list[str]] = {}
        self._folders: list[str] = []

    @remote("v(s)", "v(sm)")
    def run(self, path: str, parameters: Any = None) -> concurrent.futures.Future:
        """Plays an animation by path; ends with it. Cancelling the call ends it early."""
        return self.play(self.resolve(path))

    @remote("v(s)")
    def runTag(self, tag: str) -> concurrent.futures.Future:
        """Plays one of the animations that have a tag, by chance; ends with it."""
        return self.play(self.pick(tag))

    @remote("v(ss)", name="runTag")
    def runTagOf(self, path: str, tag: str) -> concurrent.futures.Future:
        """Plays one of the animations below a path that have a tag, by chance; ends with it."""
        return self.play(self.pick(tag, path))

    @remote("v(s)")
    def declarePathForTags(self, path: str) -> None:
        """Makes the tagged behaviours below a path known to runTag; [posture] in it stands for every posture."""
        folders = [path.replace("[posture]", posture).replace("[robot]", ROBOT) for posture in POSTURES]
        with self._lock:
            self._folders = list(dict.fromkeys([*self._folders, *(f"{folder.rstrip('/')}/" for folder in folders)]))

    @remote("v({s[s]})", "v(m)")
    def addTagForAnimations(self, tagsToAnimations: Any) -> None:
        """Gives tags to animations: {tag: [path, ...]}."""
        if not isinstance(tagsToAnimations, Mapping):
            raise ServiceError(f"tagsToAnimations must be a map, got {shown(tagsToAnimations)}")
        for tag, paths in tagsToAnimations.items():
            if not isinstance(tag, str) or not isinstance(paths, list | tuple):
                raise ServiceError(f"tagsToAnimations must be {{tag: [path, ...]}}, got {shown(tag)}: {shown(paths)}")
            if not all(isinstance(path, str) for path in paths):
                raise ServiceError(f"tagsToAnimations must be {{tag: [path, ...]}}, got {shown(tag)}: {shown(paths)}")
        with self._lock:
            for tag, paths in tagsToAnimations.items():
                known = self._added.setdefault(tag.lower(), [])
                known += [path for path in paths if path not in known]

    @remote("v()")
    def reset(self) -> None:
        """Forgets the tags and paths that were added."""
        with self._lock:
            self._added.clear()
            self._folders.clear()

    # --- for the other services --------------------------------------------------------------------------------------

    def resolve(self, path: str) -> str:
        """Return the behaviour that a path with patterns stands for.

        Raises: ServiceError: A pattern cannot be replaced, or no such behaviour is installed.
        """
        found = _PATTERN.sub(self._replace, path)
        if self._behaviors.installed(found):
            return found
        raise ServiceError(f"animation '{shown(path)[1:-1]}' is not installed")

    def pick(self, tag: str, path: str = "") -> str:
        """Return an animation that has a tag, by chance.

        Args:
            path: With this beginning; may hold patterns.
        Raises: ServiceError: There is none that the robot can play as it stands.
        """
        below = _PATTERN.sub(self._replace, path)
        found = [name for name in self.tagged(tag) if name.startswith(below)]
        if not found:
            where = f" below '{shown(path)[1:-1]}'" if path else ""
            raise ServiceError(f"no installed animation{where} has the tag '{shown(tag)[1:-1]}'")
        return self._random.choice(found)

    def tagged(self, tag: str) -> list[str]:
        """Return the animations that have a tag and can be played as the robot stands."""
        wanted = tag.strip().lower()
        with self._lock:
            added, folders = list(self._added.get(wanted, ())), tuple(self._folders)
        animations = list(_TAGS.get(wanted, ()))
        if folders:
            animations += [
                name
                for name in self._behaviors.getUserBehaviorNames()
                if name.startswith(folders) and wanted in map(str.lower, self._behaviors.tags_of(name))
            ]
        for path in added:
            try:
                animations.append(self.resolve(path))
            except ServiceError:
                continue  # not installed, or not for this posture
        posture = self._posture()
        others = [f"/{other}/" for other in POSTURES if other != posture]
        return [name for name in dict.fromkeys(animations) if not any(other in name for other in others)]

    def play(self, path: str) -> concurrent.futures.Future:
        """Play an installed animation; ends with it. One of the library may be played while it is being played."""
        if library.has(path) and self._behaviors.isBehaviorRunning(path):
            curves = library.curves(path)
            return self._joints.plan("animation", curves, lambda start: playable(curves, start, STAND))
        return chained(self._behaviors.play(path), lambda _: None)

    # --- inside ------------------------------------------------------------------------------------------------------

    def _replace(self, pattern: re.Match) -> str:
        if pattern.group(1) == "robot":
            return ROBOT
        if pattern.group(1) != "posture":
            raise ServiceError(f"unknown pattern '{pattern.group()}'")
        posture = self._posture()
        if posture is None:
            raise ServiceError("[posture] stands for nothing: the robot does not stand")
        return posture

    def _posture(self) -> str | None:
        """Return what [posture] stands for, None if for nothing. It is the leg that tells standing from crouching."""
        snapshot = self._robot.snapshot()
        if snapshot.fallen:
            return None
        legs = snapshot.joint_positions

        def distance(posture: Mapping[str, float]) -> float:
            return sum(abs(legs[joint] - posture[joint]) for joint in _LEG)

        return POSTURES[0] if distance(STAND) < distance(CROUCH) else None


_TAGS: dict[str, list[str]] = {}
for _tag, _paths in library.tags().items():
    _TAGS.setdefault(_tag.lower(), []).extend(_paths)

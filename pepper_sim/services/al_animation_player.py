"""ALAnimationPlayer: gestures by path or tag; `pepper_sim.naoqi.motion.gestures` lists them."""

from __future__ import annotations

import concurrent.futures
from typing import Any

from pepper_sim.naoqi.motion.gestures import GESTURES, TAGS, playable
from pepper_sim.naoqi.motion.joints import MotionJoints
from pepper_sim.naoqi.service import Service, ServiceError, remote, shown
from pepper_sim.robot import Pepper


class ALAnimationPlayer(Service):
    """Plays animations."""

    name = "ALAnimationPlayer"

    def __init__(self, robot: Pepper, joints: MotionJoints) -> None:
        self._robot = robot
        self._joints = joints
        self._tags = dict(TAGS)

    @remote("v(s)", "v(sm)")
    def run(self, path: str, parameters: Any = None) -> concurrent.futures.Future:
        """Plays an animation by path; ends with it. Cancelling the call ends it early."""
        if path not in GESTURES:
            raise ServiceError(f"animation '{shown(path)[1:-1]}' is not installed")
        start = self._robot.snapshot().joint_setpoints
        return self._joints.follow("animation", playable(GESTURES[path], start))

    @remote("v(s)", "v(ss)")
    def runTag(self, tag: str, posture: str = "Stand") -> concurrent.futures.Future:
        """Plays an animation that has a tag; ends with it."""
        path = self._tags.get(tag.lower())
        if path is None:
            raise ServiceError(f"no installed animation has the tag '{shown(tag)[1:-1]}'")
        return self.run(path)

    @remote("v()")
    def reset(self) -> None:
        """Forgets the tags that were added."""
        self._tags = dict(TAGS)

    @remote("v(s)", "v(ss)", "v(sss)")
    def declarePathForTags(self, path: str, posture: str = "", separator: str = "") -> None:
        """Makes a folder of animations known. Only installed animations can be played."""

    @remote("v(m)")
    def addTagForAnimations(self, tagsToAnimations: Any) -> None:
        """Adds tags to installed animations: {tag: [path, ...]}; the first path of a tag is played."""
        if not isinstance(tagsToAnimations, dict):
            raise ServiceError(f"tagsToAnimations must be a map, got {shown(tagsToAnimations)}")
        for tag, paths in tagsToAnimations.items():
            if not isinstance(tag, str) or not isinstance(paths, list | tuple):
                raise ServiceError(f"tagsToAnimations must be {{tag: [path, ...]}}, got {shown(tag)}: {shown(paths)}")
            known = [path for path in paths if isinstance(path, str) and path in GESTURES]
            if known:
                self._tags[tag.lower()] = known[0]
